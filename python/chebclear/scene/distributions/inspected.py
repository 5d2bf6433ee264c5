"""Inspected parts: a distribution cut at limits, since what is beyond them is sorted out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from ...base.arguments import Checks
from ...base.quantities import Interval, in_one_unit
from ...base.rows import Array
from .distribution import REACH, Distribution, FileKey, scores_of, shares_of, standard_cdf
from .normal import Capable

# Least share of the parts that limits must keep [-]: a process with fewer makes none.
_LEAST_KEPT = 1e-6
# Share beyond three standard deviations of a normal distribution, on one side [-].
_BEYOND = standard_cdf(-REACH)


@dataclass(frozen=True)
class Inspected(Distribution):
    """A parameter of parts that were inspected; see `inspected`."""

    written_as: ClassVar[str] = "distributions.inspected"
    file_keys: ClassVar[Mapping[str, FileKey]] = {
        "inspected": FileKey("yes or no", "whether all parts beyond the interval are sorted out"),
    }
    process: Distribution
    lower: float
    upper: float

    @property
    def scrapped(self) -> float:
        """Share of the parts made that are beyond the limits and sorted out [-]."""
        below, above, _ = self._parts
        return below + above

    @cached_property
    def _parts(self) -> tuple[float, float, float]:
        """Shares of the parts made that are below and above the limits, and that pass [-]."""
        made = self.process
        below, above = made.cdf(self.lower), made.upper_cdf(self.upper)
        # From that side on which nothing cancels.
        if below > 0.5:
            return below, above, made.upper_cdf(self.lower) - above
        return below, above, made.cdf(self.upper) - below if above > 0.5 else 1.0 - below - above

    @property
    def told(self) -> str:
        """With the share that is sorted out."""
        return f"{self.process.told.partition(',')[0]}, inspected, {100.0 * self.scrapped:.2g} % scrapped"

    @property
    def has_tolerance(self) -> bool:
        """As of what is made."""
        return self.process.has_tolerance

    @property
    def least_share(self) -> float:
        """As of what is made."""
        return self.process.least_share

    @property
    def support(self) -> tuple[float, float]:
        """The limits, or the ends of what is made where they are nearer."""
        least, most = self.process.support
        return max(self.lower, least), min(self.upper, most)

    @property
    def interval(self) -> Interval:
        """The support, but where a limit is beyond the interval of what is made no more than 99.73 %."""
        (lower, upper), made = self.support, self.process.interval
        if lower < made.lower:
            lower = self.quantile(_BEYOND)
        if upper > made.upper:
            upper = self.upper_quantile(_BEYOND)
        return Interval.about(lower, min(upper, max(lower, made.nominal)), upper).in_unit(self.unit)

    def cdf(self, value: float) -> float:
        """Probability of a smaller value [-]."""
        if value <= self.lower:
            return 0.0
        if value >= self.upper:
            return 1.0
        made, (below, _, kept) = self.process, self._parts
        if below > 0.5:
            return (made.upper_cdf(self.lower) - made.upper_cdf(value)) / kept
        return (made.cdf(value) - below) / kept

    def upper_cdf(self, value: float) -> float:
        """Probability of a larger value [-]."""
        if value <= self.lower:
            return 1.0
        if value >= self.upper:
            return 0.0
        made, (_, above, kept) = self.process, self._parts
        if above > 0.5:
            return (made.cdf(self.upper) - made.cdf(value)) / kept
        return (made.upper_cdf(value) - above) / kept

    def quantile(self, share: float) -> float:
        """The value that so many stay below."""
        return self._at(share, 1.0 - share)

    def upper_quantile(self, share: float) -> float:
        """The value that so many stay above."""
        return self._at(1.0 - share, share)

    def _at(self, smaller: float, larger: float) -> float:
        """The value with these shares below and above it, from that side on which fewer of all made are."""
        made, (below, above, kept) = self.process, self._parts
        from_below = below + kept * smaller
        if from_below <= 0.5:
            found = made.quantile(from_below) if from_below > 0.0 else self.support[0]
        else:
            from_above = above + kept * larger
            found = made.upper_quantile(from_above) if from_above > 0.0 else self.support[1]
        return min(self.upper, max(self.lower, found))

    def at(self, scores: Array) -> Array:
        """The values of standard normal scores, by those of what is made."""
        (smaller, larger), (below, above, kept) = shares_of(scores), self._parts
        from_below, from_above = below + kept * smaller, above + kept * larger
        left, made = from_below <= 0.5, np.empty_like(smaller)
        made[left], made[~left] = scores_of(from_below[left]), -scores_of(from_above[~left])
        return np.clip(self.process.at(made), self.lower, self.upper)

    def scaled(self, factor: float) -> Self:
        """With distances of what is made and of the limits from the nominal value times a factor."""
        nominal, center = self.interval.nominal, self.process.interval.nominal
        made = self.process.scaled(factor)
        if center != nominal:
            made = made.moved((factor - 1.0) * (center - nominal))
        lower, upper = (nominal + factor * (end - nominal) for end in (self.lower, self.upper))
        return type(self)(made, lower, upper).in_unit(self.unit)

    def moved(self, distance: float) -> Self:
        """With what is made and the limits larger by a distance."""
        made = self.process.moved(distance)
        return type(self)(made, self.lower + distance, self.upper + distance).in_unit(self.unit)


def inspected(
    process: Distribution, lower: float | str | None = None, upper: float | str | None = None
) -> Inspected:
    """What passes an inspection: a distribution cut at limits, beyond which parts are sorted out.

    **Gauges err.** Parts beyond the limits by no more than the error of the gauge pass, so give what truly
    passes: limits that are wider by this error, or those of the drawing if the inspection has a guard band
    as wide as it. The distribution's `scrapped` is the share that is sorted out; it costs money, and a large
    one says that the process is not what it was taken for.

    Without its ends a sum of such dimensions fails far more rarely than a root sum of squares says, near the
    worst corner hardly ever. That is true only as long as every single part is inspected: of parts that are
    inspected by samples take `capable`.

    Parameters
    ----------
    process : Distribution
        What is made, such as ``cc.normal("50 mm", "20 um")`` or `capable` parts.
    lower, upper : float or str, optional
        Limits that are kept, in the SI unit of the quantity or with its unit; by default those of `capable`.

    Raises
    ------
    ValueError, TypeError
        If the process is no distribution, a limit is missing or no finite number, the limits are reversed, or
        fewer than one part of a million is between them.

    Examples
    --------
    >>> import chebclear as cc
    >>> good = cc.distributions.inspected(cc.distributions.capable("49.96 mm", "50.04 mm", 0.67))
    >>> good.support, round(good.scrapped, 4)
    ((0.04996, 0.05004), 0.0444)
    """
    checks = Checks()
    if not isinstance(process, Distribution):
        known = f"must be a distribution, such as cc.normal(...), got {process!r}"
        checks.add("process", known, wrong_type=True)
    if isinstance(process, Capable):
        lower, upper = process.lower if lower is None else lower, process.upper if upper is None else upper
    (lower, upper), unit = in_one_unit({"lower": lower, "upper": upper})
    ends = [checks.real(name, end, "SI unit") for name, end in (("lower", lower), ("upper", upper))]
    if ends[0] >= ends[1]:
        checks.add("lower", f"must be < upper, got lower = {ends[0]!r} and upper = {ends[1]!r}")
    checks.finish()
    found = Inspected(process, ends[0], ends[1]).in_unit(unit or process.unit)
    if found._parts[2] < _LEAST_KEPT:
        checks.add("process", f"makes fewer than one part of a million between {ends[0]!r} and {ends[1]!r}")
    checks.finish()
    return found
