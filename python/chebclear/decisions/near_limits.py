"""The share of rare mechanisms outside of a specification, by runs where a polynomial is near its limits."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import default_rng
from numpy.typing import NDArray

from ..base.files import ArrayRecord
from ..base.rows import Array
from ..base.shown import listed
from ..errors import ArgumentError
from ..execution.failures import AllFailedError
from ..notices import issue
from ..study.band.exact import exact_interval
from ..study.conforming import Watched, extremes_of
from ..study.polynomials.surrogate import Surrogate, time_blocks
from ..study.requirements.draws import drawn
from ..study.requirements.specification import Specification
from ..study.results import StudyResult
from ..study.runner import Runner
from ..study.spec import declared_order

# Values of a polynomial that are computed at a time [-], and draws for which they are wanted at most.
_AT_A_TIME, _MOST_AT_A_TIME = 4_000_000, 20_000


@dataclass(frozen=True, eq=False, repr=False)
class NearLimits(ArrayRecord):
    """The share of mechanisms outside of a specification, as a product: those near its limits by a
    polynomial, and those of them that are outside.

    Attributes
    ----------
    drawn, near, outside : int
        Mechanisms drawn, those of them that the polynomial puts outside or near the limits, all of which were
        simulated, and those outside; one that fails is [-].
    others, missed : int
        Other mechanisms that were simulated, and those of them outside, which the polynomial missed [-].
    margin : float
        Distance from the limits that is near, in the unit of the output: by so much the polynomial was wrong.
    confidence : float
        Probability that the true share is between `lower` and `upper` [-].
    """

    drawn: int
    near: int
    outside: int
    others: int
    missed: int
    margin: float
    confidence: float

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

    def __str__(self) -> str:
        text = f"{self.near} of {self.drawn} near the limits, {self.outside} of these outside; elsewhere "
        text += f"{self.missed or 'none'} of {self.others}, "
        if self.missed:
            return f"{text}so that the polynomial misses some"
        return f"{text}which alone proves below {self.upper_of_runs:.2g}"


def near_limits(
    watching: Runner,
    name: str,
    one: Specification,
    own: Watched,
    along: StudyResult,
    runs: int,
    draws: int,
    confidence: float,
    seed: int,
) -> NearLimits:
    """Simulate so many mechanisms that the polynomial of a result puts near the limits, and a tenth
    elsewhere."""
    polynomial, margin, limits = _near_limits(along, one, own)
    parameters = watching.parameters
    order = declared_order(watching.build, parameters)
    block = max(1, min(_AT_A_TIME // polynomial.terms.shape[1], _MOST_AT_A_TIME))
    near, others = np.empty((2, 0, len(parameters)))
    made = pieces = 0
    while len(near) < runs and made < draws:
        piece = int(default_rng([seed, pieces]).integers(2**63))
        points = drawn(parameters, order, min(block, draws - made), piece)
        is_near = _is_near(polynomial, limits, dict(zip(parameters, points.T, strict=True)))
        rows = np.flatnonzero(is_near)[: runs - len(near)]
        # The draws end with the last one near the limits: those behind it do not count.
        used = int(rows[-1]) + 1 if len(near) + len(rows) == runs else len(points)
        near = np.concatenate([near, points[rows]])
        others = np.concatenate([others, points[:used][~is_near[:used]]])[: max(2, runs // 10)]
        made, pieces = made + used, pieces + 1
    try:
        missed = _outside(watching, name, one, own, others)
    except AllFailedError as error:
        raise error.first from None
    try:
        outside = _outside(watching, name, one, own, near)
    except AllFailedError:  # which is no wonder where mechanisms cannot be assembled any more
        outside = len(near)
    return NearLimits(made, len(near), outside, len(others), missed, margin, confidence)


def _near_limits(
    along: StudyResult, one: Specification, own: Watched
) -> tuple[Surrogate, float, tuple[float, float]]:
    """The polynomial at the instants at which it comes near the limits, its margin, and where near begins."""
    band = along.bands.get(one.quantity)
    if band is None or band.surrogate is None or not band.resolved or isinstance(one.at, str):
        known = [name for name, band in along.items() if band.resolved and band.surrogate]
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
