"""Distributions of parameters: how often the values of a dimension occur."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Any, ClassVar, Self, TypeVar

import numpy as np
from numpy.random import Generator

from ..base.arguments import Checks
from ..base.quantities import Interval, Written, in_one_unit
from ..base.rows import Array

# The interval of a distribution without ends: three standard deviations to either side hold 99.73 %.
_REACH = 3.0
# Least probability of a tail [-]: at 37 standard deviations, before it is no number any more.
_LEAST_TAIL = 1e-300
_STANDARD = NormalDist()


@dataclass(frozen=True)
class Distribution(Written):
    """How often the values of a parameter occur: base of all kinds.

    A kind is a frozen dataclass of plain numbers. It says its interval, which holds nearly all values, its
    support, which holds all, the probability of a smaller value, and the values at a probability from below
    and from above. The rest follows; kinds with formulas for arrays say them too.
    """

    kinds: ClassVar[dict[str, type[Distribution]]] = {}
    """All kinds by the names of their classes."""
    written_as: ClassVar[str]
    """What makes one: name of a public function, which takes its fields."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        Distribution.kinds[cls.__name__] = cls

    @property
    def interval(self) -> Interval:
        """The interval of a study of the parameter."""
        raise NotImplementedError

    @property
    def support(self) -> tuple[float, float]:
        """The ends beyond which no value lies; infinite if there are none."""
        return self.interval.lower, self.interval.upper

    def cdf(self, value: float) -> float:
        """Probability of a smaller value [-]."""
        raise NotImplementedError

    def quantile(self, share: float) -> float:
        """The value that so many stay below."""
        raise NotImplementedError

    def upper_quantile(self, share: float) -> float:
        """The value that so many stay above: exact where ``1 - share`` is 1."""
        return self.quantile(1.0 - share)

    def drawn(self, stream: Generator, draws: int) -> Array:
        """Independent values."""
        return self.at(stream.standard_normal(draws))

    def at(self, scores: Array) -> Array:
        """The values whose probabilities are those of standard normal scores."""
        found = [
            self.quantile(_tail(-one)) if one < 0.0 else self.upper_quantile(_tail(one))
            for one in scores.tolist()
        ]
        return np.array(found, dtype=float)

    def scores(self, values: Array) -> Array:
        """The standard normal scores of values; at most 8.2, where the probability of a smaller one is 1."""
        shares = np.clip([self.cdf(one) for one in values.tolist()], _LEAST_TAIL, np.nextafter(1.0, 0.0))
        return np.array([_STANDARD.inv_cdf(one) for one in shares.tolist()], dtype=float)

    def slopes(self, values: Array) -> dict[str, Array]:
        """Slopes of the logarithm of the density over numbers of the distribution, by their names.

        None where the ends move with them: draws of one are then no draws of the other.
        """
        return {}

    def scaled(self, factor: float) -> Self:
        """With distances from the nominal value times a factor."""
        nominal = self.interval.nominal
        values = (nominal + factor * (value - nominal) for value in self._values())
        return type(self)(*values).in_unit(self.unit)

    def moved(self, distance: float) -> Self:
        """With all values larger by a distance."""
        return type(self)(*(value + distance for value in self._values())).in_unit(self.unit)

    def _values(self) -> tuple[Any, ...]:
        """The fields of a kind all of whose numbers are values of the parameter."""
        return dataclasses.astuple(self)


def _tail(score: float) -> float:
    """Probability beyond a score [-]."""
    return max(0.5 * math.erfc(score / math.sqrt(2.0)), _LEAST_TAIL)


@dataclass(frozen=True)
class Normal(Distribution):
    """A normally distributed parameter; see `normal`."""

    written_as: ClassVar[str] = "normal"
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

    @property
    def support(self) -> tuple[float, float]:
        """No ends."""
        return -math.inf, math.inf

    def quantile(self, share: float) -> float:
        """The value that so many stay below."""
        return NormalDist(self.mean, self.standard_deviation).inv_cdf(share)

    def upper_quantile(self, share: float) -> float:
        """The value that so many stay above."""
        return 2.0 * self.mean - self.quantile(share)

    def at(self, scores: Array) -> Array:
        """The values of standard normal scores."""
        return self.mean + self.standard_deviation * scores

    def scores(self, values: Array) -> Array:
        """The standard normal scores of values."""
        return np.asarray((values - self.mean) / self.standard_deviation)

    def slopes(self, values: Array) -> dict[str, Array]:
        """Over mean and standard deviation."""
        scores = self.scores(values)
        return {
            "mean": scores / self.standard_deviation,
            "standard_deviation": (scores**2 - 1.0) / self.standard_deviation,
        }

    def scaled(self, factor: float) -> Self:
        """With another standard deviation."""
        return replace(self, standard_deviation=factor * self.standard_deviation).in_unit(self.unit)

    def moved(self, distance: float) -> Self:
        """With another mean."""
        return replace(self, mean=self.mean + distance).in_unit(self.unit)


@dataclass(frozen=True)
class Lognormal(Distribution):
    """A parameter whose logarithm is normally distributed; see `lognormal`."""

    written_as: ClassVar[str] = "lognormal"
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


@dataclass(frozen=True)
class Uniform(Distribution):
    """A uniformly distributed parameter; see `uniform`."""

    written_as: ClassVar[str] = "uniform"
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

    def upper_quantile(self, share: float) -> float:
        """The value that so many stay above."""
        return self.upper - (self.upper - self.lower) * share

    def drawn(self, stream: Generator, draws: int) -> Array:
        """Independent values."""
        return self.lower + (self.upper - self.lower) * stream.random(draws)


@dataclass(frozen=True)
class Triangular(Distribution):
    """A parameter with a triangular distribution; see `triangular`."""

    written_as: ClassVar[str] = "triangular"
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

    def upper_quantile(self, share: float) -> float:
        """The value that so many stay above."""
        width, fall = self.upper - self.lower, self.upper - self.mode
        if share * width <= fall:
            return self.upper - math.sqrt(share * width * fall)
        return self.lower + math.sqrt((1.0 - share) * width * (self.mode - self.lower))

    def drawn(self, stream: Generator, draws: int) -> Array:
        """Independent values."""
        return stream.triangular(self.lower, self.mode, self.upper, draws)


Moments = TypeVar("Moments", Normal, Lognormal)


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
