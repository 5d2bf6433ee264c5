"""Distributions of parameters: how often the values of a dimension occur."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.random import Generator

from ..base.arguments import Checks
from ..base.quantities import Interval
from ..base.rows import Array

# The interval of a distribution without ends: three standard deviations to either side hold 99.73 %.
_REACH = 3.0


@dataclass(frozen=True)
class Normal:
    """A normally distributed parameter; see `normal`."""

    mean: float
    standard_deviation: float

    @property
    def interval(self) -> Interval:
        """Three standard deviations to either side of the mean."""
        reach = _REACH * self.standard_deviation
        return Interval(self.mean - reach, self.mean + reach)

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
class Lognormal:
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
        return Interval(math.exp(about - reach), math.exp(about + reach), math.exp(about))

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
class Uniform:
    """A uniformly distributed parameter; see `uniform`."""

    lower: float
    upper: float

    @property
    def interval(self) -> Interval:
        """The whole range."""
        return Interval(self.lower, self.upper)

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
class Triangular:
    """A parameter with a triangular distribution; see `triangular`."""

    lower: float
    mode: float
    upper: float

    @property
    def interval(self) -> Interval:
        """The whole range; the mode is the nominal value."""
        return Interval(self.lower, self.upper, self.mode)

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


Distribution = Normal | Lognormal | Uniform | Triangular


def inside(one: Distribution, side: Interval, shares: Array) -> Array:
    """Values at shares of the probability that lies inside an interval."""
    first, last = one.cdf(side.lower), one.cdf(side.upper)
    return np.clip([one.quantile(first + (last - first) * share) for share in shares], side.lower, side.upper)


def normal(mean: float, standard_deviation: float) -> Normal:
    """A normal distribution of a parameter, for `Study`, `conformance` and `Band.quantiles`.

    Parameters
    ----------
    mean : float
        Mean [SI unit of the quantity].
    standard_deviation : float
        Standard deviation [SI unit of the quantity], above 0.

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
    checks = Checks()
    center = checks.real("mean", mean, "SI unit")
    spread = checks.real("standard_deviation", standard_deviation, "SI unit", above=0.0)
    checks.finish()
    return Normal(center, spread)


def lognormal(mean: float, standard_deviation: float) -> Lognormal:
    """A distribution whose logarithm is normal, as of stiffnesses and other quantities above 0.

    Parameters
    ----------
    mean : float
        Mean of the quantity itself, not of its logarithm [SI unit of the quantity], above 0.
    standard_deviation : float
        Standard deviation of the quantity itself [SI unit of the quantity], above 0.

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
    checks = Checks()
    center = checks.real("mean", mean, "SI unit", above=0.0)
    spread = checks.real("standard_deviation", standard_deviation, "SI unit", above=0.0)
    checks.finish()
    return Lognormal(center, spread)


def uniform(lower: float, upper: float) -> Uniform:
    """A uniform distribution of a parameter, for `Study`, `conformance` and `Band.quantiles`.

    Parameters
    ----------
    lower, upper : float
        Ends [SI unit of the quantity].

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
    side = Interval(lower, upper)
    return Uniform(side.lower, side.upper)


def triangular(lower: float, mode: float, upper: float) -> Triangular:
    """A triangular distribution of a parameter: values near the mode occur most, none beyond the ends.

    Parameters
    ----------
    lower, mode, upper : float
        Ends and the value that occurs most, which may be an end [SI unit of the quantity].

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
    side = Interval(lower, upper, mode)
    return Triangular(side.lower, side.nominal, side.upper)
