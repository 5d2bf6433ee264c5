"""Lognormal distributions, as of stiffnesses and other quantities above 0."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Any, ClassVar, Self

import numpy as np

from ...base.quantities import Interval
from ...base.rows import Array
from .distribution import REACH, Distribution, checked_moments, required, standard_cdf


@dataclass(frozen=True)
class Lognormal(Distribution):
    """A parameter whose logarithm is normally distributed; see `lognormal`."""

    written_as: ClassVar[str] = "lognormal"
    in_words: ClassVar[str] = (
        "lognormal has three standard deviations of its logarithm to either side of the median"
    )
    mean: float
    standard_deviation: float

    @classmethod
    def in_file(
        cls, side: Interval | None, given: Mapping[str, Any], written: Mapping[str, Any]
    ) -> Distribution:
        """Three standard deviations of the logarithm to either side of the median."""
        above = side is None or side.lower > 0.0
        lowest = "" if side is None else f"needs an interval above 0, which reaches down to {side.lower!r}"
        side = required(side, above, lowest)
        deviation = math.log(side.upper / side.lower) / (2.0 * REACH)
        mean = math.sqrt(side.lower * side.upper) * math.exp(0.5 * deviation**2)
        return cls(mean, mean * math.sqrt(math.expm1(deviation**2)))

    @property
    def _logarithm(self) -> NormalDist:
        # Moments of the lognormal distribution: Johnson, Kotz and Balakrishnan (1994), section 14.3.
        variance = math.log1p((self.standard_deviation / self.mean) ** 2)
        return NormalDist(math.log(self.mean) - 0.5 * variance, math.sqrt(variance))

    @property
    def interval(self) -> Interval:
        """Three standard deviations of the logarithm to either side of the median, the nominal value."""
        about, reach = self._logarithm.mean, REACH * self._logarithm.stdev
        side = Interval(math.exp(about - reach), math.exp(about + reach), math.exp(about))
        return side.in_unit(self.unit)

    @property
    def has_tolerance(self) -> bool:
        """False: `scaled` keeps the mean, which is not its nominal value."""
        return False

    def cdf(self, value: float) -> float:
        """Probability of a smaller value [-]."""
        about = self._logarithm
        return standard_cdf((math.log(value) - about.mean) / about.stdev) if value > 0.0 else 0.0

    def upper_cdf(self, value: float) -> float:
        """Probability of a larger value [-]."""
        about = self._logarithm
        return standard_cdf((about.mean - math.log(value)) / about.stdev) if value > 0.0 else 1.0

    @property
    def support(self) -> tuple[float, float]:
        """All above 0."""
        return 0.0, math.inf

    def quantile(self, share: float) -> float:
        """The value that so many stay below."""
        return math.exp(self._logarithm.inv_cdf(share))

    def upper_quantile(self, share: float) -> float:
        """The value that so many stay above."""
        return math.exp(2.0 * self._logarithm.mean - self._logarithm.inv_cdf(share))

    def at(self, scores: Array) -> Array:
        """The values of standard normal scores."""
        about = self._logarithm
        values: Array = np.exp(about.mean + about.stdev * scores)
        return values

    def scores(self, values: Array) -> Array:
        """The standard normal scores of values."""
        about = self._logarithm
        return np.asarray((np.log(values) - about.mean) / about.stdev)

    def slopes(self, values: Array) -> dict[str, Array]:
        """Over mean and standard deviation of the parameter itself, by those of its logarithm."""
        about, scores = self._logarithm, self.scores(values)
        center, spread = scores / about.stdev, (scores**2 - 1.0) / about.stdev
        square = (self.standard_deviation / self.mean) ** 2
        # d variance / d mean and / d standard deviation of variance = ln(1 + square).
        by_mean = -2.0 * square / (1.0 + square) / self.mean
        by_deviation = 2.0 * square / (1.0 + square) / self.standard_deviation
        return {
            "mean": center * (1.0 / self.mean - 0.5 * by_mean) + spread * by_mean / (2.0 * about.stdev),
            "standard_deviation": -0.5 * center * by_deviation + spread * by_deviation / (2.0 * about.stdev),
        }

    def scaled(self, factor: float) -> Self:
        """With another standard deviation and the same mean."""
        return replace(self, standard_deviation=factor * self.standard_deviation).in_unit(self.unit)

    def moved(self, distance: float) -> Self:
        """With another mean and the same standard deviation."""
        return replace(self, mean=self.mean + distance).in_unit(self.unit)


def lognormal(mean: float | str, standard_deviation: float | str) -> Lognormal:
    """A distribution whose logarithm is normal, as of stiffnesses and other quantities above 0.

    Parameters
    ----------
    mean : float or str
        Mean of the quantity itself, not of its logarithm, above 0, in its SI unit or with its unit.
    standard_deviation : float or str
        Standard deviation of the quantity itself, above 0, likewise.

    Raises
    ------
    ValueError, TypeError
        If an argument is not a finite number above 0.

    Examples
    --------
    >>> import chebclear as cc
    >>> cc.lognormal(1e9, 2e8).mean
    1000000000.0
    """
    center, spread, unit = checked_moments(mean, standard_deviation, above=0.0)
    return Lognormal(center, spread).in_unit(unit)
