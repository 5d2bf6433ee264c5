"""The runs that tell which share of mechanisms keeps to specifications; see `conformance`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ..base.arguments import Checks, meant_or_known
from ..errors import ArgumentError, ArgumentTypeError
from ..execution.failures import AllFailedError
from ..run.features import lowest, peak
from ..run.notices import Notice, issue
from ..run.settings import Settings
from ..scene.columns import column_unit
from ..scene.scene import Interval
from .features.features import FeatureSpec, outputs_of, tracked_features
from .requirements.conformance import Conformance, Share, share_of
from .requirements.draws import corners, drawn
from .requirements.specification import Specification, checked_specifications
from .runner import Runner
from .sources.finished import FinishedRuns
from .sources.scenes import MOST_RUNS, Runs
from .sources.units import units_of
from .spec import declared_order
from .study import Study

Array = NDArray[np.float64]

# Runs of the first piece where their number depends on what they find; each further piece doubles them.
_FIRST_PIECE = 200
# Parameters that are only known as intervals: their corners are two to this power.
_MOST_INTERVALS = 6
_ALL = "all"


@dataclass(frozen=True)
class Watched:
    """What is taken from every run for a specification."""

    features: tuple[str, str] | None
    """Features of the lowest and the highest value; None takes them from the samples."""
    unit: str
    """Unit of the quantity."""
    limits: tuple[float, float]
    """Its limits in that unit."""

    def is_outside(self, extremes: Array) -> NDArray[np.bool_]:
        """Which runs break them, by the lowest and the highest value of each, or failed."""
        outside: NDArray[np.bool_] = ~((extremes[0] > self.limits[0]) & (extremes[1] < self.limits[1]))
        return outside


def conformance(
    study: Study,
    specifications: Specification | Sequence[Specification] | Mapping[str, Specification],
    runs: int = 1000,
    *,
    failures: int | None = None,
    confidence: float = 0.95,
    rng: int | Generator | None = 0,
) -> Conformance:
    """The share of mechanisms that keep to specifications, from mechanisms drawn at random.

    Parameters are drawn independently from their distributions, such as `normal`. Those that are only
    known as an `Interval` have none: the runs are repeated at their nominal values and at every corner of
    their intervals, and the interval of the share is that of the smallest and the largest of these.

    Parameters
    ----------
    study : Study
        The mechanism, or a model of your own.
    specifications : Specification, or sequence or mapping of them by name
        What to keep to, made by `require`.
    runs : int
        Mechanisms to simulate, or the most of them [-]; times the corners.
    failures : int, optional
        Runs end once so many mechanisms are outside of each specification [-]; the relative error of the
        share outside is then about 2 over its root, and its interval is exact as well.
    confidence : float
        Probability that the interval of a share holds the true one [-].
    rng : int, numpy.random.Generator or None
        Seed or generator of the draws; None for fresh ones. The seed is kept with the result.

    Returns
    -------
    Conformance

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; all problems are listed.
    SceneError, SimulationError
        As `Study.band`. A mechanism that fails counts as outside.

    Examples
    --------
    >>> import chebclear as cc
    >>> def shaft(gap, thread):
    ...     return {"play": gap - thread}
    >>> study = cc.Study(shaft, {"gap": cc.normal(10.1, 0.02), "thread": cc.normal(10.0, 0.02)})
    >>> print(cc.conformance(study, {"play": cc.require("play", above=0.04)}, 4000))
    play: 98.0 % in specification, between 97.6 % and 98.5 % with 95 % confidence (78 of 4000 outside)
    """
    if not isinstance(study, Study):
        raise ArgumentTypeError(f"study must be a Study, got {study!r:.80}")
    runner = study.runner
    asked, count, failures, level, seed = _checked(runner, specifications, runs, failures, confidence, rng)
    watching, watched = watching_for(runner, asked)
    places = corners(runner.parameters)
    draws = drawn(runner.parameters, declared_order(runner.build, runner.parameters), count, seed)
    # For each place the extremes of each specification's quantity, shape (2, runs).
    extremes = [[np.empty((2, 0)) for _ in asked] for _ in places]
    notices: dict[object, Notice] = {}
    for piece in _pieces(count, failures):
        for place, found in zip(places, extremes, strict=True):
            points = _at(runner, draws[piece], place)
            try:
                made = watching.made(points, watching.settings, midpoint=False)
            except AllFailedError as error:
                raise error.first from None
            notices = {(notice.code, notice.about): notice for notice in made.notices} | notices
            for index, (name, one) in enumerate(asked.items()):
                more = extremes_of(made, name, one, watched[name], len(points))
                found[index] = np.concatenate([found[index], more], axis=1)
        if failures is not None and _fewest_outside(watched, extremes) >= failures:
            break
    shares = {
        name: share_of(
            name,
            one,
            watched[name].unit,
            watched[name].limits,
            places,
            [(found[index][0], found[index][1]) for found in extremes],
            level,
            failures,
        )
        for index, (name, one) in enumerate(asked.items())
    }
    if len(asked) > 1:
        shares[_ALL] = _together(watched, places, extremes, level, failures)
    most = max(share.runs for share in shares.values())
    parameters = _at(runner, draws[:most], places[0])
    told = tuple(notices.values())
    issue(told)
    return Conformance(shares, parameters, tuple(runner.parameters), seed, told)


def _checked(
    runner: Runner,
    specifications: object,
    runs: int,
    failures: int | None,
    confidence: float,
    rng: int | Generator | None,
) -> tuple[dict[str, Specification], int, int | None, float, int]:
    """The arguments, checked: specifications, runs, failures, confidence and seed."""
    checks = Checks()
    asked = checked_specifications(checks, specifications)
    count = checks.whole("runs", runs, least=2, most=MOST_RUNS)
    if failures is not None:
        failures = checks.whole("failures", failures, least=2)
    level = checks.real("confidence", confidence, "-", above=0.0, below=1.0)
    seed = checks.seed("rng", rng)
    sides = [name for name, one in runner.parameters.items() if isinstance(one, Interval)]
    if isinstance(runner.model, FinishedRuns):
        checks.add("the runs of a finished table were not drawn from the distributions of its parameters")
    elif not runner.random:
        checks.add(
            "no parameter has a distribution: an interval says nothing of how often its values occur; give "
            "cc.normal(mean, standard_deviation), cc.lognormal, cc.uniform or cc.triangular in its place"
        )
    if len(sides) > _MOST_INTERVALS:
        checks.add(
            f"{len(sides)} parameters are only known as intervals, whose corners are too many; at most "
            f"{_MOST_INTERVALS} are accepted: give the others a distribution"
        )
    if _ALL in asked:
        checks.add(f'specifications["{_ALL}"]: the name is that of all of them together')
    checks.finish()
    return asked, count, failures, level, seed


def _fewest_outside(watched: dict[str, Watched], extremes: list[list[Array]]) -> int:
    """Runs outside of the specification that the fewest are outside of."""
    return min(
        int(np.count_nonzero(one.is_outside(values)))
        for found in extremes
        for one, values in zip(watched.values(), found, strict=True)
    )


def _pieces(count: int, failures: int | None) -> Iterator[slice]:
    """The runs in pieces: all at once, or until enough of them are outside."""
    done, until = 0, count if failures is None else min(_FIRST_PIECE, count)
    while done < count:
        yield slice(done, until)
        done, until = until, min(2 * until, count)


def watching_for(runner: Runner, asked: dict[str, Specification]) -> tuple[Runner, dict[str, Watched]]:
    """The runner with the features that the specifications need, and what each takes from a run."""
    checks = Checks()
    features: dict[str, FeatureSpec] = dict(runner.features)
    settings = runner.settings
    columns: list[str] = []
    if settings is not None:
        nominal = {name: side.nominal for name, side in runner.intervals.items()}
        facts = runner.scene(nominal).check()
        columns = [*facts.columns, *facts.further_columns]
    watched, sampled = {}, []
    for name, one in asked.items():
        place, quantity = f'specifications["{name}"]', one.quantity
        taken: tuple[str, str] | None = (quantity, quantity)
        if quantity in runner.features:
            unit = units_of([quantity], runner.features, runner.units, simulated=settings is not None)[0]
            if one.at is not None:
                checks.add_at(place, f'"{quantity}" is a feature of the whole run: leave out at')
        elif settings is not None:
            unit = column_unit(quantity)
            if quantity not in columns:
                known = [*runner.features, *columns]
                checks.add_at(
                    place, f'unknown output or feature "{quantity}"{meant_or_known(quantity, known)}'
                )
            elif one.at is not None:
                _instant(checks, place, one.at, settings)
                taken = None
                sampled.append(quantity)
            else:
                ends = {f"{end} of {quantity}": feature(quantity) for end, feature in _ENDS.items()}
                features |= ends
                first, second = ends
                taken = first, second
        else:
            # A model of the user's own: outputs are known once it has run.
            unit, taken = runner.units.get(quantity, ""), None
        watched[name] = Watched(taken, unit, one.limits(checks, place, unit))
    checks.finish()
    if settings is not None:
        core = tracked_features(features.values())
        kept = outputs_of(features, settings)
        outputs = None if kept is None else tuple(dict.fromkeys([*kept, *sampled]))
        settings = replace(settings, features=core, outputs=outputs)
    # A mechanism that fails counts as outside, however many do.
    execution = replace(runner.execution, most_failed=1.0)
    return replace(runner, features=features, settings=settings, execution=execution), watched


_ENDS = {"lowest": lowest, "peak": peak}


def _instant(checks: Checks, place: str, at: float, settings: Settings) -> None:
    """Checks that an instant is one of the samples."""
    t = _instants(settings)
    nearest = float(t[np.argmin(np.abs(t - at))])
    if abs(nearest - at) > 1e-9 * settings.duration:
        checks.add_at(place, f"at = {at:g} s is none of the samples; the nearest is {nearest:.9g} s")


def _instants(settings: Settings) -> Array:
    skip = settings.skip or 0.0
    return np.linspace(skip, skip + settings.duration, settings.samples)


def _at(runner: Runner, draws: Array, place: dict[str, float]) -> Array:
    """Drawn points with these values of the parameters that are only known as intervals."""
    points = draws.copy()
    for column, name in enumerate(runner.parameters):
        if name in place:
            points[:, column] = place[name]
    return points


def extremes_of(runs: Runs, name: str, one: Specification, watched: Watched, points: int) -> Array:
    """The lowest and the highest value in each run, NaN where it failed, shape (2, points)."""
    found = np.full((2, points), np.nan)
    if watched.features is not None:
        assert runs.features is not None
        columns = [runs.feature_names.index(feature) for feature in watched.features]
        found[0, runs.kept] = runs.features[:, :, columns[0]].min(axis=1)
        found[1, runs.kept] = runs.features[:, :, columns[1]].max(axis=1)
        return found
    if one.quantity in runs.feature_names:  # a number of a model
        assert runs.features is not None
        found[:, runs.kept] = runs.features[:, 0, runs.feature_names.index(one.quantity)]
        return found
    if one.quantity not in runs.outputs:
        known = [*runs.outputs, *runs.feature_names]
        hint = meant_or_known(one.quantity, known)
        raise ArgumentError(f'specifications["{name}"]: unknown output or feature "{one.quantity}"{hint}')
    values = runs.values[:, :, runs.outputs.index(one.quantity)]
    if one.at is not None:
        values = values[:, [int(np.argmin(np.abs(runs.t - one.at)))]]
    found[0, runs.kept], found[1, runs.kept] = values.min(axis=1), values.max(axis=1)
    return found


def _together(
    watched: dict[str, Watched],
    places: list[dict[str, float]],
    extremes: list[list[Array]],
    confidence: float,
    failures: int | None,
) -> Share:
    """The share that keeps to all specifications: each run has the number of those that it breaks."""
    broken = []
    for found in extremes:
        outside = [one.is_outside(values) for one, values in zip(watched.values(), found, strict=True)]
        count = np.sum(outside, axis=0, dtype=float)
        broken.append((count, count))
    words = Specification("specifications broken", below=1)
    return share_of(_ALL, words, "-", (-np.inf, 1.0), places, broken, confidence, failures)
