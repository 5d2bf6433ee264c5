"""Skewed distributions, from limits that are unequally far from the nominal value: split normal ones."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...base.quantities import Interval
from ...base.rows import Array
from .distribution import REACH, STANDARD, Distribution, required, scores_of, shares_of, standard_cdf


@dataclass(frozen=True)
class Skewed(Distribution):
    """A parameter with unequal normal halves to either side of its nominal value; see `skewed`."""

    written_as: ClassVar[str] = "distributions.skewed"
    in_words: ClassVar[str] = (
        "skewed has three standard deviations to either side of the nominal value, unequal ones"
    )
    lower: float
    nominal: float
    upper: float

    @classmethod
    def in_file(
        cls, side: Interval | None, given: Mapping[str, Any], written: Mapping[str, Any]
    ) -> Distribution:
        """Three standard deviations to either side of the nominal value."""
        side = required(side)
        return cls(side.lower, side.nominal, side.upper)

    @property
    def deviations(self) -> tuple[float, float]:
        """Standard deviations of the halves below and above the nominal value [SI unit of the quantity]."""
        return (self.nominal - self.lower) / REACH, (self.upper - self.nominal) / REACH

    @property
    def shares(self) -> tuple[float, float]:
        """Shares of the values below and above the nominal value [-]."""
        below, above = self.deviations
        return below / (below + above), above / (below + above)

    @property
    def mean(self) -> float:
        """Mean, which is not the nominal value [SI unit of the quantity]."""
        below, above = self.deviations
        return self.nominal + math.sqrt(2.0 / math.pi) * (above - below)

    @property
    def interval(self) -> Interval:
        """Three standard deviations of each half; the nominal value is the most frequent one."""
        return Interval(self.lower, self.upper, self.nominal).in_unit(self.unit)

    @property
    def support(self) -> tuple[float, float]:
        """No ends, but at the nominal value if a limit is there."""
        return (
            -math.inf if self.lower < self.nominal else self.nominal,
            math.inf if self.nominal < self.upper else self.nominal,
        )

    def cdf(self, value: float) -> float:
        """Probability of a smaller value [-]."""
        if value >= self.nominal:
            return 1.0 - self.upper_cdf(value)
        deviation = self.deviations[0]
        return 2.0 * self.shares[0] * standard_cdf((value - self.nominal) / deviation) if deviation else 0.0

    def upper_cdf(self, value: float) -> float:
        """Probability of a larger value [-]."""
        if value < self.nominal:
            return 1.0 - self.cdf(value)
        deviation = self.deviations[1]
        return 2.0 * self.shares[1] * standard_cdf((self.nominal - value) / deviation) if deviation else 0.0

    def quantile(self, share: float) -> float:
        """The value that so many stay below."""
        below, above = self.shares
        if share < below:
            return self.nominal + self.deviations[0] * STANDARD.inv_cdf(0.5 * share / below)
        return self.nominal - self.deviations[1] * STANDARD.inv_cdf(0.5 * (1.0 - share) / above)

    def upper_quantile(self, share: float) -> float:
        """The value that so many stay above."""
        below, above = self.shares
        if share < above:
            return self.nominal - self.deviations[1] * STANDARD.inv_cdf(0.5 * share / above)
        return self.nominal + self.deviations[0] * STANDARD.inv_cdf(0.5 * (1.0 - share) / below)

    def at(self, scores: Array) -> Array:
        """The values of standard normal scores."""
        (smaller, larger), (below, above) = shares_of(scores), self.shares
        left, found = smaller < below, np.empty_like(smaller)
        found[left] = self.deviations[0] * scores_of(0.5 * smaller[left] / below)
        found[~left] = -self.deviations[1] * scores_of(0.5 * larger[~left] / above)
        return self.nominal + found

    def slopes(self, values: Array) -> dict[str, Array]:
        """Over the ends and the nominal value; none if an end is at the nominal value."""
        below, above = self.deviations
        if not below or not above:
            return {}
        side = np.where(values < self.nominal, below, above)
        scores = (values - self.nominal) / side
        by_below = np.where(values < self.nominal, scores**2, 0.0) / below - 1.0 / (below + above)
        by_above = np.where(values < self.nominal, 0.0, scores**2) / above - 1.0 / (below + above)
        return {
            "lower": -by_below / REACH,
            "nominal": scores / side + (by_below - by_above) / REACH,
            "upper": by_above / REACH,
        }


def skewed(lower: float | str, nominal: float | str, upper: float | str) -> Skewed:
    """A normal distribution with unequal halves, from limits that are unequally far from the nominal value.

    Each limit is three standard deviations of its half from the nominal value, which occurs most; the halves
    join without a jump, the wider one has more of the parts.

    The **mean is not the nominal value**: it is .798 of the difference of the standard deviations beside it,
    to the longer side. Nor are the parts beyond the limits equal: .27 % together, but above the upper limit
    as much more than below the lower one as that half is wider.

    A dimension with unequal limits need not be skewed: machines aim at the middle of the limits more often,
    and then `capable` is what is made.

    Parameters
    ----------
    lower, nominal, upper : float or str
        Limits and the value that occurs most, which may be a limit, in the SI unit of the quantity or with
        its unit.

    Raises
    ------
    ValueError, TypeError
        If one is not a finite number, the limits are reversed or the nominal value is not between them.

    Examples
    --------
    >>> import chebclear as cc
    >>> round(cc.distributions.skewed("49.98 mm", "50 mm", "50.06 mm").mean, 7)
    0.0500106
    """
    side = Interval(lower, upper, nominal)  # type: ignore[arg-type] # numbers once made
    return Skewed(side.lower, side.nominal, side.upper).in_unit(side.unit)
