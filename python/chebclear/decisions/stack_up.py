"""Tolerance stack-up: worst case, root sum of squares and Monte Carlo side by side; see `stack_up`."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.random import Generator

from ..base.arguments import Checks
from ..base.rows import Array
from ..errors import ArgumentTypeError
from ..notices import issue
from ..scene.scene import Interval
from ..study.band.exact import binomial_cdf
from ..study.conforming import placed
from ..study.requirements.draws import check_drawn, drawn, places
from ..study.requirements.specification import Specification, checked_specifications
from ..study.runner import Runner
from ..study.sources.finished import FinishedRuns
from ..study.sources.scenes import MOST_RUNS
from ..study.spec import declared_order
from ..study.study import Study
from .stack_up_result import ROUNDING, TAIL, Contribution, StackUp, StackUpValue
from .watched_runs import WatchedRuns, check_all_are_made


def stack_up(
    study: Study,
    of: str | Specification | Sequence[str | Specification] | Mapping[str, Specification] | None = None,
    runs: int = 5000,
    *,
    confidence: float = 0.95,
    rng: int | Generator | None = 0,
) -> StackUp:
    """Tolerance stack-up: worst case, root sum of squares and Monte Carlo side by side.

    Slopes are those between both ends of each tolerance, the others in the middle of theirs. Worst case: the
    sum of slopes times tolerances. RSS: the root of the sum of their squares, which is right if the value is
    linear, all parameters are normal and tolerances are three standard deviations. Monte Carlo: the quantiles
    of 0.135 and 99.865 % of random mechanisms. Where RSS is off by more than these can be, or the value is
    curved, the table says so.

    Parameters
    ----------
    study : Study
        The mechanism, or a model of your own. A parameter that is only an `Interval` adds linearly to RSS,
        and Monte Carlo is repeated at its corners.
    of : str, Specification, or sequence or mapping of them, optional
        Names of features or outputs, or requirements made by `require`; the requirements of the study if not
        given. An output over a time has two values, its lowest and its highest.
    runs : int
        Random mechanisms of Monte Carlo [-]: from 3244 on it can check RSS with 95 % confidence.
    confidence : float
        Probability that the intervals of both Monte Carlo quantiles hold them [-].
    rng : int, numpy.random.Generator or None
        Seed or generator of the draws; None for fresh ones. The seed is kept with the result.

    Returns
    -------
    StackUp

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; all problems are listed.
    SceneError, SimulationError
        As `Study.sample`. Random mechanisms that fail are left out and counted.

    Examples
    --------
    >>> import chebclear as cc
    >>> def stack(plate, spacer):
    ...     return {"gap": 50.5 - plate - 2 * spacer}
    >>> study = cc.Study(stack, {"plate": cc.normal(30.0, 0.01), "spacer": cc.normal(10.0, 0.02)})
    >>> found = cc.stack_up(study, "gap")["gap"]
    >>> [round(end, 3) for end in (*found.worst_case, *found.rss)], found.rss_verdict
    ([0.35, 0.65, 0.376, 0.624], 'agrees')
    """
    if not isinstance(study, Study):
        raise ArgumentTypeError(f"study must be a Study, got {study!r:.80}")
    runner, checks = study.runner, Checks()
    if isinstance(runner.model, FinishedRuns):
        checks.add("study", "is a table of finished runs, which has no values at the ends of tolerances")
    asked = _asked(checks, runner, of)
    count = checks.whole("runs", runs, least=2, most=MOST_RUNS)
    level = checks.real("confidence", confidence, "-", above=0.0, below=1.0)
    seed = checks.seed("rng", rng)
    check_drawn(checks, runner.parameters)
    check_all_are_made(checks, runner)
    made = WatchedRuns.checked(checks, runner, asked)
    # The middle, both ends of each tolerance, and the nominal values.
    sides = list(runner.intervals.values())
    middle = np.array([side.midpoint for side in sides])
    half = np.array([side.half_width for side in sides])
    shifts = np.vstack([np.zeros(len(sides)), np.diag(half), -np.diag(half)])
    nominal = np.array([side.nominal for side in sides])
    single = _values(made, np.vstack([middle + shifts, nominal]))
    draws = drawn(runner.parameters, declared_order(runner.build, runner.parameters), count, seed)
    random = [_values(made, placed(runner, draws, place)) for place in places(runner.parameters, 0, 0)]
    stacks = {}
    for name, wanted, end in _wanted(made, [single, *random]):
        values = single[wanted][end]
        slopes = (values[1 : 1 + len(sides)] - values[1 + len(sides) : -1]) / (2.0 * half)
        point = np.where(slopes >= 0.0, half, -half)
        worst = _values(made, np.vstack([middle - point, middle + point]))[wanted][end]
        stacks[name] = _stacked(
            runner, made, wanted, name, values, worst, [one[wanted][end] for one in random], level
        )
    notices = tuple(made.notices.values())
    issue(notices)
    return StackUp(stacks, tuple(runner.parameters), made.made, seed, notices)


def _asked(checks: Checks, runner: Runner, of: object) -> dict[str, Specification]:
    """What is asked for by name: requirements, and quantities without limits."""
    if of is None:
        if not runner.requirements:
            checks.add("of", "must be given, or the study its requirements")
        return dict(runner.requirements)
    entries = [of] if isinstance(of, str | Specification) else of
    if isinstance(entries, list | tuple):
        entries = {str(one): Specification(one) if isinstance(one, str) and one else one for one in entries}
    return checked_specifications(checks, entries, "of")


def _values(made: WatchedRuns, points: Array) -> dict[str, Array]:
    """The lowest and the highest value of each quantity in runs, NaN where one failed."""
    return dict(zip(made.asked, made.extremes(points), strict=True))


def _wanted(made: WatchedRuns, found: Sequence[Mapping[str, Array]]) -> list[tuple[str, str, int]]:
    """Each value by its name, that of its quantity, and 0 for its lowest or 1 for its highest."""
    wanted = []
    for name, one in made.watched.items():
        if all(np.array_equal(values[name][0], values[name][1], equal_nan=True) for values in found):
            wanted.append((name, name, 0))
            continue
        ends = [end for end in (0, 1) if math.isfinite(one.limits[end])] or [0, 1]
        wanted += [(f"{name}: {('lowest', 'highest')[end]}", name, end) for end in ends]
    return wanted


def _stacked(
    runner: Runner,
    made: WatchedRuns,
    wanted: str,
    name: str,
    values: Array,
    worst: Array,
    random: list[Array],
    confidence: float,
) -> StackUpValue:
    """The stack-up of a value from those in the middle, at both ends of each tolerance, at the nominal
    parameters, at both corners, and of random mechanisms at each corner of what is only an interval."""
    count = len(runner.parameters)
    middle, above, below, nominal = values[0], values[1 : 1 + count], values[1 + count : -1], values[-1]
    half = np.array([side.half_width for side in runner.intervals.values()])
    slopes = (above - below) / (2.0 * half)
    bends = 0.5 * (above + below) - middle
    # Differences of values have the rounding of these.
    bends = np.where(np.abs(bends) <= ROUNDING * np.max(np.abs(values)), 0.0, bends)
    reach = np.abs(slopes) * half
    only = np.array([isinstance(one, Interval) for one in runner.parameters.values()])
    squares = np.where(only, 0.0, reach**2)
    whole, spread = float(reach.sum()), float(reach[only].sum() + math.sqrt(squares.sum()))
    contributions = {
        key: Contribution(
            name=key,
            unit=runner.units.get(key, ""),
            tolerance=float(half[place]),
            slope=float(slopes[place]),
            bend=float(bends[place]),
            worst_case_share=float(reach[place] / whole) if whole > 0.0 else math.nan,
            variance_share=float(squares[place] / squares.sum()) if squares.sum() > 0.0 else math.nan,
            written=runner.written_for(key),
        )
        for place, key in enumerate(runner.parameters)
    }
    tails = [_tails(np.sort(one[np.isfinite(one)]), confidence) for one in random]
    lower = np.min([one[0] for one in tails], axis=0)
    upper = np.max([one[1] for one in tails], axis=0)
    one = made.watched[wanted]
    return StackUpValue(
        name=name,
        unit=one.unit,
        limits=one.limits,
        nominal=float(nominal),
        middle=float(middle),
        worst_case=(float(middle - whole), float(middle + whole)),
        corners=(float(worst[0]), float(worst[1])),
        rss=(float(middle - spread), float(middle + spread)),
        monte_carlo=(float(lower[1]), float(upper[1])),
        lower_between=(float(lower[0]), float(lower[2])),
        upper_between=(float(upper[0]), float(upper[2])),
        confidence=confidence,
        contributions=contributions,
        runs=len(random[0]),
        failed=int(np.count_nonzero(~np.isfinite(random[0]))),
        written=made.asked[wanted].written or runner.written_for(made.asked[wanted].quantity),
    )


def _tails(ordered: Array, confidence: float) -> tuple[Array, Array]:
    """The lower and the upper quantile of ordered values, each between the ends of its interval: these are
    ordered values too, each end with a quarter of the remaining probability."""
    count, risk = len(ordered), 0.25 * (1.0 - confidence)
    if not count:
        return np.array([-math.inf, math.nan, math.inf]), np.array([-math.inf, math.nan, math.inf])
    # Fewer than `first` values, and more than `last`, lie beyond a quantile with no more than the risk.
    first = bisect_left(range(count), True, key=lambda k: binomial_cdf(k, count, TAIL) > risk)
    last = bisect_left(range(count), True, key=lambda k: binomial_cdf(k, count, TAIL) >= 1.0 - risk)
    low, high = np.quantile(ordered, (TAIL, 1.0 - TAIL))
    known = first > 0, last < count
    lower = [
        ordered[first - 1] if known[0] else -math.inf,
        low,
        ordered[last] if known[1] else math.inf,
    ]
    upper = [
        ordered[count - 1 - last] if known[1] else -math.inf,
        high,
        ordered[count - first] if known[0] else math.inf,
    ]
    return np.array(lower), np.array(upper)
