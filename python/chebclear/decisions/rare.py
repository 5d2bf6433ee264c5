"""The share of rare mechanisms outside of a specification, by runs where a polynomial is near its limits."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator, default_rng
from numpy.typing import NDArray

from ..base.arguments import Checks
from ..base.files import ArrayRecord
from ..base.rows import Array
from ..base.shown import listed
from ..errors import ArgumentError, ArgumentTypeError
from ..execution.failures import AllFailedError
from ..notices import issue
from ..scene.scene import Interval
from ..study.band.exact import exact_interval
from ..study.conforming import Watched, extremes_of, watching_for
from ..study.polynomials.surrogate import Surrogate, time_blocks
from ..study.requirements.draws import drawn
from ..study.requirements.specification import Specification, checked_specifications
from ..study.results import StudyResult
from ..study.runner import Runner
from ..study.sources.finished import FinishedRuns
from ..study.sources.scenes import MOST_RUNS
from ..study.spec import declared_order
from ..study.study import Study

# Values of a polynomial that are computed at a time [-], and draws for which they are wanted at most.
_AT_A_TIME, _MOST_AT_A_TIME = 4_000_000, 20_000


@dataclass(frozen=True, eq=False, repr=False)
class RareShare(ArrayRecord):
    """The share of mechanisms outside of a specification; see `rare_share`.

    Attributes
    ----------
    specification : Specification
        The limits.
    drawn, near, outside : int
        Mechanisms drawn, those of them that the polynomial puts outside or near the limits, all of which were
        simulated, and those outside; one that fails is [-].
    others, missed : int
        Other mechanisms that were simulated, and those of them outside, which the polynomial missed [-].
    margin : float
        Distance from the limits that is near, in the unit of the output: by so much the polynomial was wrong.
    confidence : float
        Probability that the true share is between `lower` and `upper` [-].
    seed : int
        Seed of the draws.
    """

    specification: Specification
    drawn: int
    near: int
    outside: int
    others: int
    missed: int
    margin: float
    confidence: float
    seed: int

    @property
    def share(self) -> float:
        """Share of the mechanisms outside [-]."""
        missed = self.missed / self.others if self.others else 0.0
        return self.outside / self.drawn + (1.0 - self.near / self.drawn) * missed

    @property
    def lower(self) -> float:
        """Lower end of its interval [-]: the product of those of `near` and `outside`."""
        return self._ends[0][0] * self._ends[1][0]

    @property
    def upper(self) -> float:
        """Upper end [-], if only mechanisms near the limits can be outside; else `upper_of_runs`."""
        return self.upper_of_runs if self.missed else self._ends[0][1] * self._ends[1][1]

    @property
    def upper_of_runs(self) -> float:
        """Upper end that does not trust the polynomial [-]: with what may be outside among the others."""
        (least, most), (_, outside), (_, missed) = self._ends
        return max(near * outside + (1.0 - near) * missed for near in (least, most))

    @property
    def _ends(self) -> list[tuple[float, float]]:
        """Intervals of three probabilities, which hold together (Bonferroni)."""
        level = 1.0 - (1.0 - self.confidence) / 3.0
        counts = (self.near, self.drawn), (self.outside, self.near), (self.missed, self.others)
        return [exact_interval(*count, level) for count in counts]

    def __repr__(self) -> str:
        return f"<RareShare: {self}>"

    def __str__(self) -> str:
        sure = f"with {100.0 * self.confidence:.4g} % confidence"
        text = (
            f"{self.specification}: {self.share:.3g} outside, between {self.lower:.3g} and {self.upper:.3g} "
        )
        text += f"{sure} ({self.near} of {self.drawn} near the limits, {self.outside} of these outside; "
        text += f"elsewhere {self.missed or 'none'} of {self.others}, "
        if self.missed:
            return text + "so that the polynomial misses some)"
        return f"{text}which alone proves below {self.upper_of_runs:.2g})"


def rare_share(
    study: Study,
    specification: Specification,
    along: StudyResult,
    runs: int = 1000,
    *,
    draws: int = 10_000_000,
    confidence: float = 0.95,
    rng: int | Generator | None = 0,
) -> RareShare:
    """The share of mechanisms outside of a specification where it is too rare to be counted.

    A polynomial that follows the output says of many drawn mechanisms which are outside or near the limits;
    only these are simulated. Nothing is extrapolated: the share is that of the mechanisms near the limits,
    counted in the draws, times the share of them outside, counted in runs, whatever the polynomial is worth.
    That no others are outside is its claim; a tenth as many runs elsewhere check it.

    Parameters
    ----------
    study : Study
        The mechanism, or a model of your own; all parameters have distributions.
    specification : Specification
        Limits of an output, made by `require`; not at a crank angle.
    along : StudyResult
        Result of a study of the same parameters whose polynomial follows the output: the verdict is
        ``"resolved"``. Its intervals should reach as far as mechanisms go that are outside, five standard
        deviations say; mechanisms beyond them count as near the limits.
    runs : int
        Mechanisms near the limits to simulate [-].
    draws : int
        Most mechanisms to draw for them [-].
    confidence : float
        Of the interval [-].
    rng : int, numpy.random.Generator or None
        Seed or generator of the draws; None for fresh ones.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong, or no polynomial follows the output.
    SceneError, SimulationError
        As `conformance`.

    Examples
    --------
    >>> import chebclear as cc
    >>> def shaft(gap, thread):
    ...     return {"t": [0.0, 1.0], "play": [gap - thread] * 2}
    >>> study = cc.Study(shaft, {"gap": cc.normal(10.1, 0.02), "thread": cc.normal(10.0, 0.02)})
    >>> sides = {"gap": cc.Interval(10.0, 10.2), "thread": cc.Interval(9.9, 10.1)}
    >>> along = cc.Study(shaft, sides).chebyshev(2)
    >>> found = cc.rare_share(study, cc.require("play", above=0.0), along, 100)
    >>> found.lower < 2.035e-4 < found.upper
    True
    """
    if not isinstance(study, Study) or not isinstance(along, StudyResult):
        raise ArgumentTypeError(
            f"study, along must be a Study and a result, got {study!r:.40}, {along!r:.40}"
        )
    runner, checks = study.runner, Checks()
    asked = checked_specifications(checks, [specification])
    count = checks.whole("runs", runs, least=2, most=MOST_RUNS)
    most = checks.whole("draws", draws, least=1)
    level = checks.real("confidence", confidence, "-", above=0.0, below=1.0)
    seed = checks.seed("rng", rng)
    if isinstance(runner.model, FinishedRuns) or any(
        isinstance(one, Interval) for one in runner.parameters.values()
    ):
        checks.add(
            "study", "must have a distribution for every parameter, from which mechanisms can be drawn"
        )
    if set(along.parameter_names) != set(runner.parameters):
        checks.add("along", f"has other parameters than the study: {', '.join(along.parameter_names)}")
    checks.finish()
    (name, one), *_ = asked.items()
    watching, watched = watching_for(runner, asked)
    own = watched[name]
    polynomial, margin, limits = _near_limits(along, one, own)
    order = declared_order(runner.build, runner.parameters)
    block = max(1, min(_AT_A_TIME // polynomial.terms.shape[1], _MOST_AT_A_TIME))
    near, others = np.empty((2, 0, len(runner.parameters)))
    made = pieces = 0
    while len(near) < count and made < most:
        piece = int(default_rng([seed, pieces]).integers(2**63))
        points = drawn(runner.parameters, order, min(block, most - made), piece)
        is_near = _is_near(polynomial, limits, dict(zip(runner.parameters, points.T, strict=True)))
        rows = np.flatnonzero(is_near)[: count - len(near)]
        # The draws end with the last one near the limits: those behind it do not count.
        used = int(rows[-1]) + 1 if len(near) + len(rows) == count else len(points)
        near = np.concatenate([near, points[rows]])
        others = np.concatenate([others, points[:used][~is_near[:used]]])[: max(2, count // 10)]
        made, pieces = made + used, pieces + 1
    watching = replace(watching, execution=replace(watching.execution, max_seconds=None))
    try:
        missed = _outside(watching, name, one, own, others)
    except AllFailedError as error:
        raise error.first from None
    try:
        outside = _outside(watching, name, one, own, near)
    except AllFailedError:  # which is no wonder where mechanisms cannot be assembled any more
        outside = len(near)
    return RareShare(one, made, len(near), outside, len(others), missed, margin, level, seed)


def _near_limits(
    along: StudyResult, one: Specification, own: Watched
) -> tuple[Surrogate, float, tuple[float, float]]:
    """The polynomial at the instants at which it comes near the limits, its margin, and where near begins."""
    band = along.bands.get(one.quantity)
    if band is None or band.surrogate is None or band.verdict != "resolved" or isinstance(one.at, str):
        known = [name for name, band in along.items() if band.verdict == "resolved" and band.surrogate]
        raise ArgumentError(
            f"along has no polynomial over time that follows {one}; it has some of {listed(known) or 'none'}"
        )
    at = dict(zip(band.intervals, band.parameters.T, strict=True))
    margin = band.margin.error * band.max_width
    for some in time_blocks(*band.runs.shape):
        part = replace(band.surrogate, terms=np.ascontiguousarray(band.surrogate.terms[:, some]))
        margin = max(margin, float(np.max(np.abs(part.evaluate(at) - band.runs[:, some]))))
    limits = own.limits[0] + margin, own.limits[1] - margin
    reach = band.surrogate.range()
    matters = (reach.lower <= limits[0]) | (reach.upper >= limits[1])
    if one.at is not None:
        matters &= np.arange(len(band.t)) == np.argmin(np.abs(band.t - one.at))
    if not matters.any():
        raise ArgumentError(
            f"the polynomial of {one.quantity} keeps to {one} in the whole box of along, from "
            f"{reach.lower.min():.6g} to {reach.upper.max():.6g}: give along larger intervals"
        )
    terms = np.ascontiguousarray(band.surrogate.terms[:, matters])
    return replace(band.surrogate, terms=terms), margin, limits


def _is_near(
    polynomial: Surrogate, limits: tuple[float, float], points: dict[str, Array]
) -> NDArray[np.bool_]:
    """Which points the polynomial puts near the limits or outside, or knows nothing of."""
    sides = polynomial.intervals
    near = np.any(
        [(points[name] < one.lower) | (points[name] > one.upper) for name, one in sides.items()], axis=0
    )
    values = polynomial.evaluate({name: points[name][~near] for name in sides})
    near[~near] = np.any((values <= limits[0]) | (values >= limits[1]), axis=1)
    return np.asarray(near)


def _outside(watching: Runner, name: str, one: Specification, own: Watched, points: Array) -> int:
    """How many of the mechanisms are outside."""
    if not len(points):
        return 0
    made = watching.made(points, watching.settings, midpoint=False)
    issue(made.notices)
    return int(np.count_nonzero(own.is_outside(extremes_of(made, name, one, own, len(points)))))
