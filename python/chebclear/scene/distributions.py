"""Distributions of parameters: how often the values of a dimension occur."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import TypeVar

import numpy as np
from numpy.random import Generator

from ..base.arguments import Checks
from ..base.quantities import Interval, Written, in_one_unit
from ..base.rows import Array

# The interval of a distribution without ends: three standard deviations to either side hold 99.73 %.
_REACH = 3.0


@dataclass(frozen=True)
class Normal(Written):
    """A normally distributed parameter; see `normal`."""

    mean: float
    standard_deviation: float

    @property
    def interval(self) -> Interval:
        """Three standard deviations to either side of the mean."""
        reach = _REACH * self.standard_deviation
        return Interval(self.mean - reach, self.mean + reach).in_unit(self.unit)

    def cdf(self, value: float) -> float:
        """Probability of a smaller value [-]."""
        return NormalDist(self.mean, self.standard_deviation).cdf(value)

    def quantile(self, share: float) -> float:
        """The value that so many stay below."""
        return NormalDist(self.mean, self.standard_deviation).inv_cdf(share)

    def drawn(self, stream: Generator, draws: int) -> Array:
        """Independent values."""
        return self.mean + self.standard_deviation * stream.standard_normal(draws)


@dataclass(frozen=True)
class Lognormal(Written):
    """A parameter whose logarithm is normally distributed; see `lognormal`."""

    mean: float
    standard_deviation: float

    @classmethod
    def over(cls, side: Interval) -> Lognormal:
        """The one with this interval, whose ends are above 0."""
        deviation = math.log(side.upper / side.lower) / (2.0 * _REACH)
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
        about, reach = self._logarithm.mean, _REACH * self._logarithm.stdev
        side = Interval(math.exp(about - reach), math.exp(about + reach), math.exp(about))
        return side.in_unit(self.unit)

    def cdf(self, value: float) -> float:
        """Probability of a smaller value [-]."""
        return self._logarithm.cdf(math.log(value)) if value > 0.0 else 0.0

    def quantile(self, share: float) -> float:
        """The value that so many stay below."""
        return math.exp(self._logarithm.inv_cdf(share))

    def drawn(self, stream: Generator, draws: int) -> Array:
        """Independent values."""
        about = self._logarithm
        drawn: Array = np.exp(about.mean + about.stdev * stream.standard_normal(draws))
        return drawn


@dataclass(frozen=True)
class Uniform(Written):
    """A uniformly distributed parameter; see `uniform`."""

    lower: float
    upper: float

    @property
    def interval(self) -> Interval:
        """The whole range."""
        return Interval(self.lower, self.upper).in_unit(self.unit)

    def cdf(self, value: float) -> float:
        """Probability of a smaller value [-]."""
        return min(1.0, max(0.0, (value - self.lower) / (self.upper - self.lower)))

    def quantile(self, share: float) -> float:
        """The value that so many stay below."""
        return self.lower + (self.upper - self.lower) * share

    def drawn(self, stream: Generator, draws: int) -> Array:
        """Independent values."""
        return self.lower + (self.upper - self.lower) * stream.random(draws)


@dataclass(frozen=True)
class Triangular(Written):
    """A parameter with a triangular distribution; see `triangular`."""

    lower: float
    mode: float
    upper: float

    @property
    def interval(self) -> Interval:
        """The whole range; the mode is the nominal value."""
        return Interval(self.lower, self.upper, self.mode).in_unit(self.unit)

    def cdf(self, value: float) -> float:
        """Probability of a smaller value [-]."""
        width, value = self.upper - self.lower, min(self.upper, max(self.lower, value))
        if value <= self.mode:
            return (
                (value - self.lower) ** 2 / (width * (self.mode - self.lower)) if value > self.lower else 0.0
            )
        return 1.0 - (self.upper - value) ** 2 / (width * (self.upper - self.mode))

    def quantile(self, share: float) -> float:
        """The value that so many stay below."""
        width, rise = self.upper - self.lower, self.mode - self.lower
        if share * width <= rise:
            return self.lower + math.sqrt(share * width * rise)
        return self.upper - math.sqrt((1.0 - share) * width * (self.upper - self.mode))

    def drawn(self, stream: Generator, draws: int) -> Array:
        """Independent values."""
        return stream.triangular(self.lower, self.mode, self.upper, draws)


Moments = TypeVar("Moments", Normal, Lognormal)
Distribution = Normal | Lognormal | Uniform | Triangular


def inside(one: Distribution, side: Interval, shares: Array) -> Array:
    """Values at shares of the probability that lies inside an interval."""
    first, last = one.cdf(side.lower), one.cdf(side.upper)
    return np.clip([one.quantile(first + (last - first) * share) for share in shares], side.lower, side.upper)


def _with_moments(
    kind: type[Moments], mean: object, standard_deviation: object, *, above: float | None = None
) -> Moments:
    """A distribution with mean and standard deviation, which may be texts with units."""
    given = {"mean": mean, "standard_deviation": standard_deviation}
    (mean, standard_deviation), unit = in_one_unit(given)
    checks = Checks()
    center = checks.real("mean", mean, "SI unit", above=above)
    spread = checks.real("standard_deviation", standard_deviation, "SI unit", above=0.0)
    checks.finish()
    return kind(center, spread).in_unit(unit)


def normal(mean: float | str, standard_deviation: float | str) -> Normal:
    """A normal distribution of a parameter, for `Study`, `conformance` and `Band.quantiles`.

    Parameters
    ----------
    mean : float or str
        Mean, in the SI unit of the quantity or with its unit, such as ``"120 mm"``.
    standard_deviation : float or str
        Standard deviation, above 0, likewise.

    Raises
    ------
    ValueError, TypeError
        If an argument is not a finite number or the standard deviation is not above 0.

    Examples
    --------
    >>> import chebclear as cc
    >>> cc.normal(0.12, 1e-4).mean
    0.12
    """
    return _with_moments(Normal, mean, standard_deviation)


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
    return _with_moments(Lognormal, mean, standard_deviation, above=0.0)


def uniform(lower: float | str, upper: float | str) -> Uniform:
    """A uniform distribution of a parameter, for `Study`, `conformance` and `Band.quantiles`.

    Parameters
    ----------
    lower, upper : float or str
        Ends, in the SI unit of the quantity or with its unit.

    Raises
    ------
    ValueError, TypeError
        If an end is not a finite number or the ends are reversed.

    Examples
    --------
    >>> import chebclear as cc
    >>> cc.uniform(0.119, 0.121).upper
    0.121
    """
    side = Interval(lower, upper)  # type: ignore[arg-type] # numbers once made
    return Uniform(side.lower, side.upper).in_unit(side.unit)


def triangular(lower: float | str, mode: float | str, upper: float | str) -> Triangular:
    """A triangular distribution of a parameter: values near the mode occur most, none beyond the ends.

    Parameters
    ----------
    lower, mode, upper : float or str
        Ends and the value that occurs most, which may be an end, in the SI unit of the quantity or with its
        unit.

    Raises
    ------
    ValueError, TypeError
        If one is not a finite number, the ends are reversed or the mode is not between them.

    Examples
    --------
    >>> import chebclear as cc
    >>> cc.triangular(0.119, 0.12, 0.122).mode
    0.12
    """
    side = Interval(lower, upper, mode)  # type: ignore[arg-type] # numbers once made
    return Triangular(side.lower, side.nominal, side.upper).in_unit(side.unit)
