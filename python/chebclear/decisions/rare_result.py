"""What is known of a rare share: the share with its interval, or why there is none, and what makes mechanisms
fail."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ..base import files as records
from ..base.prefixes import format_quantity
from ..base.rows import Array, Rows
from ..base.shown import in_a_sentence
from ..data.dataset import Dataset, Variable, facts_of
from ..data.exports import Exports
from ..notices import Notice, WithNotices
from ..study.requirements.conformance import Share
from ..study.requirements.specification import Specification
from .near_limits import NearLimits
from .splitting import LEAST_SHARE

# Part of the squared distance of the failing from the nominal values that the parameters named make up [-].
_NAMED_PART = 0.9
# Part of the failing that lies on the other side from which both sides are named [-].
_BOTH_SIDES = 0.1
# Examples of failing mechanisms where there is more than one way to fail.
_EXAMPLES = 3


@dataclass(frozen=True, eq=False, repr=False)
class SplittingSystem(records.ArrayRecord):
    """What one of the systems of a splitting found.

    Attributes
    ----------
    exponent : float
        Minus the logarithm of the share outside, by this system [-].
    acceptance : float
        Accepted share of the proposals in its last rounds [-].
    step : float
        Length of its last step, in standard deviations.
    """

    exponent: float
    acceptance: float
    step: float


@dataclass(frozen=True, eq=False, repr=False)
class SplittingSystems(Rows[SplittingSystem]):
    """The systems of a splitting: a sequence of `SplittingSystem`, and an array of each field.

    Attributes
    ----------
    exponent, acceptance, step : ndarray
        Fields of `SplittingSystem`, each of shape (systems,).
    """

    row: ClassVar = SplittingSystem

    exponent: Array
    acceptance: Array
    step: Array


@dataclass(frozen=True, eq=False, repr=False)
class Cause(records.ArrayRecord):
    """How a parameter of the mechanisms that fail differs from that of all.

    Attributes
    ----------
    name : str
        Name of the parameter.
    unit : str
        Its SI unit; empty if it is not known.
    value : float
        Median value of the mechanisms that fail [SI unit].
    score : float
        The same as a standard normal score: so many standard deviations above the median, below if negative
        [-].
    error : float
        Standard error of their mean score [-].
    other_side : float
        Share of them whose score has the other sign [-].
    distance : float
        Median distance of their scores from 0 [-]; .67 for all mechanisms.
    slopes : dict[str, float]
        Slopes of the logarithm of the share outside over numbers of the distribution, such as ``"mean"``
        per SI unit; empty where the ends of the distribution move with them.
    slope_errors : dict[str, float]
        Their standard errors.
    """

    name: str
    unit: str
    value: float
    score: float
    error: float
    other_side: float
    distance: float
    slopes: dict[str, float]
    slope_errors: dict[str, float]

    @property
    def is_two_sided(self) -> bool:
        """Whether mechanisms fail with values that are too large and with others that are too small."""
        return self.other_side > _BOTH_SIDES and self.distance > 1.0

    def __str__(self) -> str:
        size = f"{self.name} is {abs(self.score):.2g} standard deviations "
        if self.is_two_sided:
            return f"{self.name} is {self.distance:.2g} standard deviations too large or too small"
        return f"{size}too {'large' if self.score > 0.0 else 'small'}"


@dataclass(frozen=True, eq=False, repr=False)
class RareShare(WithNotices, records.Saved, Exports, kind="rare share"):
    """The share of mechanisms outside of specifications where it is too rare to be counted; see `rare_share`.

    Attributes
    ----------
    specifications : dict[str, Specification]
        What mechanisms must keep to, by name.
    verdict : {"known", "below", "unknown"}
        ``"known"``: the share, between `lower` and `upper`. ``"below"``: the runs did not go further; the
        share is below `upper`. ``"unknown"``: no number can be trusted but `upper`, that of the first draws
        alone.
    reason : str
        Why: ``"counted"``, ``"polynomial"`` or empty for a known share; ``"runs"``, ``"seconds"`` or
        ``"least"`` (no smaller share matters) for one below; ``"scatter"``, ``"regions"``, ``"another
        region"`` or ``"yes or no"`` for an unknown one.
    share : float
        Share of the mechanisms outside [-]; NaN unless it is known.
    lower, upper : float
        Ends of its interval [-]; over all values `at`.
    confidence : float
        Probability that the true share is between them [-].
    runs : int
        Mechanisms simulated [-].
    seed : int
        Seed of the draws: ``rng=seed`` repeats them.
    plain : Share | None
        The first draws, counted; None with a polynomial.
    systems : SplittingSystems
        What the systems of particles found; none if the share is counted or a polynomial's.
    inflation : float
        Variance between them over that of independent particles [-]; NaN without them.
    mechanisms : Array
        Parameters of mechanisms that fail, as they do in production: those of the systems, or those counted
        [SI units], shape (mechanisms, parameters).
    parameter_names : tuple[str, ...]
        Names of the parameters.
    causes : tuple[Cause, ...]
        How the random parameters of these differ from those of all, the largest difference first; not where
        the share is unknown.
    at : tuple[dict[str, float], ...]
        Values of the parameters that are only known as intervals [SI units]: nominal ones and corners; what
        is said besides the interval is said of the first.
    intervals : Array
        Interval of the share for each of these [-], shape (values, 2).
    has_play : bool
        Whether the mechanism has joints with clearance, where impacts may make islands that no draw meets.
    polynomial : NearLimits | None
        What runs near the limits by a polynomial tell; None without one.
    notices : tuple[Notice, ...]
        Warnings of the runs, each kind once.
    """

    specifications: dict[str, Specification]
    verdict: str
    reason: str
    share: float
    lower: float
    upper: float
    confidence: float
    runs: int
    seed: int
    plain: Share | None
    systems: SplittingSystems
    inflation: float
    mechanisms: Array
    parameter_names: tuple[str, ...]
    causes: tuple[Cause, ...]
    at: tuple[dict[str, float], ...]
    intervals: Array
    has_play: bool
    polynomial: NearLimits | None
    notices: tuple[Notice, ...] = ()

    @property
    def ppm(self) -> float:
        """Mechanisms outside in a million [-]; NaN unless the share is known."""
        return 1e6 * self.share

    @property
    def examples(self) -> tuple[dict[str, float], ...]:
        """Up to three mechanisms that fail, of different systems [SI units]."""
        count = min(_EXAMPLES, len(self.mechanisms))
        rows = np.linspace(0, len(self.mechanisms) - 1, count).astype(int)
        return tuple(
            dict(zip(self.parameter_names, self.mechanisms[row].tolist(), strict=True)) for row in rows
        )

    @property
    def why(self) -> str:
        """What makes mechanisms fail, in a sentence; empty if it is not known."""
        if not self.causes:
            return ""
        sizes = [one.distance**2 if one.is_two_sided else one.score**2 for one in self.causes]
        count = int(np.searchsorted(np.cumsum(sizes), _NAMED_PART * math.fsum(sizes))) + 1
        named = in_a_sentence([str(one) for one in self.causes[:count]])
        text = f"They fail because {named}."
        if any(one.is_two_sided for one in self.causes[:count]):
            units = {one.name: one.unit for one in self.causes}
            text += " There is more than one way to fail; examples:"
            for one in self.examples:
                values = [
                    f"{name} = {format_quantity(value, units.get(name, ''), 4)}"
                    for name, value in one.items()
                ]
                text += f"\n  {', '.join(values)}"
        return text

    def dataset(self) -> Dataset:
        """A row for each mechanism that fails."""
        units = {one.name: one.unit for one in self.causes}
        variables = {"mechanism": Variable(("mechanism",), np.arange(len(self.mechanisms)), "-")}
        for name, values in zip(self.parameter_names, self.mechanisms.T, strict=True):
            variables[f"parameters.{name}"] = Variable(("mechanism",), values, units.get(name, ""))
        return Dataset("mechanism", variables, facts_of(self))

    def __repr__(self) -> str:
        return f"<RareShare: {self}>"

    def __str__(self) -> str:
        sure = f"with {100.0 * self.confidence:.4g} % confidence"
        below = f"below {rate(self.upper)} {sure}"
        text = f"{rate(self.share)} outside, between {rate(self.lower)} and {rate(self.upper)} {sure}"
        if self.polynomial is not None:
            return f"{self.name}: {text} ({self.polynomial})"
        assert self.plain is not None, "without a polynomial"
        counted = f"{self.plain.outside or 'none'} of {self.plain.runs} plain runs outside"
        lines = [self.why]
        if self.verdict == "known":
            agree = f"{len(self.systems)} systems agree; {self.runs} runs; " if len(self.systems) else ""
            text += f" ({agree}{counted})"
        elif self.verdict == "below":
            text = f"{below}; {_ENDED[self.reason]} ({self.runs} runs; {counted})"
        else:
            text = f"unknown: {_UNKNOWN[self.reason]}. What is sure: {below} ({counted})"
            if len(self.mechanisms):
                text += "; mechanisms that fail exist, see mechanisms"
        lines.insert(0, f"{self.name}: {text}")
        if len(self.at) > 1:
            lines.append(f"The interval holds at the nominal values and corners of {', '.join(self.at[0])}.")
        if self.has_play and self.verdict != "unknown" and self.reason != "counted":
            missed = rate(3.0 / self.plain.runs)
            lines.append(f"Islands that impacts make, if rarer than {missed}, may have been missed.")
        return "\n".join(filter(None, lines))

    @property
    def name(self) -> str:
        """What it is the share of: a requirement by its name, or all of several."""
        return next(iter(self.specifications)) if len(self.specifications) == 1 else "all"

    def _check_shapes(self) -> None:
        records.sound(self, mechanisms=(len(self.mechanisms), len(self.parameter_names)))


_UNKNOWN = {
    "scatter": "the response scatters, impacts decide and not dimensions",
    "regions": "there is more than one way to fail, and the runs did not find them alike",
    "another region": "there is another way to fail that the runs did not follow",
    "yes or no": "the quantity tells only whether it is outside, not how nearly",
}
_ENDED = {
    "runs": "the runs did not go further",
    "seconds": "there was no time to go further",
    "least": f"shares below {LEAST_SHARE:g} are not told apart",
}


def rate(share: float) -> str:
    """A share in words, with two digits.

    >>> rate(3.13e-6), rate(0.00184), rate(1.4e-8), rate(0.0), rate(0.031)
    ('3.1 of a million', '1.8 of 1000', '14 of a billion', '0', '3.1 of 100')
    """
    if share == 0.0:
        return "0"
    for least, factor, words in (
        (1e-2, 1e2, "100"),
        (1e-3, 1e3, "1000"),
        (1e-7, 1e6, "a million"),
        (0.0, 1e9, "a billion"),
    ):
        if share >= least:
            number = f"{factor * share:.2g}"
            number = f"{float(number):.0f}" if "e" in number else number
            return f"{number} of {words}"
    return "an unknown part"


def causes_of(
    scores: Array,
    values: Array,
    slopes: Sequence[dict[str, Array]],
    groups: int,
    names: Sequence[tuple[str, str]],
) -> tuple[Cause, ...]:
    """The causes from the standard normal scores and values of mechanisms that fail, the largest first.

    Errors are those between so many groups of them, which share nothing; of one group, those of independent
    draws.
    """
    found = []
    for column, ((name, unit), own) in enumerate(zip(names, slopes, strict=True)):
        one = scores[:, column]
        median = float(np.median(one))
        found.append(
            Cause(
                name=name,
                unit=unit,
                value=float(np.median(values[:, column])),
                score=median,
                error=_error(one, groups),
                other_side=float(np.mean(one * median < 0.0)),
                distance=float(np.median(np.abs(one))),
                slopes={key: float(np.mean(slope)) for key, slope in own.items()},
                slope_errors={key: _error(slope, groups) for key, slope in own.items()},
            )
        )
    return tuple(
        sorted(found, key=lambda one: -max(abs(one.score), one.distance if one.is_two_sided else 0.0))
    )


def _error(values: Array, groups: int) -> float:
    """Standard error of a mean."""
    parts: list[Any] = np.array_split(values, groups) if groups > 1 else list(values)
    means = [float(np.mean(part)) for part in parts if np.size(part)]
    return float(np.std(means, ddof=1)) / math.sqrt(len(means)) if len(means) > 1 else math.nan
