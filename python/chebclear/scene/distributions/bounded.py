"""Distributions between two ends: uniform and triangular ones."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from numpy.random import Generator

from ...base.quantities import Interval
from ...base.rows import Array
from .distribution import Distribution, required


@dataclass(frozen=True)
class Uniform(Distribution):
    """A uniformly distributed parameter; see `uniform`."""

    written_as: ClassVar[str] = "uniform"
    in_words: ClassVar[str] = "uniform fills it"
    lower: float
    upper: float

    @classmethod
    def in_file(
        cls, side: Interval | None, given: Mapping[str, Any], written: Mapping[str, Any]
    ) -> Distribution:
        """The whole interval, without a nominal value beside its middle."""
        middle = side is None or side.nominal == side.midpoint
        side = required(side, middle, "needs the nominal value in the middle of the interval")
        return cls(side.lower, side.upper)

    @property
    def interval(self) -> Interval:
        """The whole range."""
        return Interval(self.lower, self.upper).in_unit(self.unit)

    def cdf(self, value: float) -> float:
        """Probability of a smaller value [-]."""
        return min(1.0, max(0.0, (value - self.lower) / (self.upper - self.lower)))

    def upper_cdf(self, value: float) -> float:
        """Probability of a larger value [-]."""
        return min(1.0, max(0.0, (self.upper - value) / (self.upper - self.lower)))

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
    in_words: ClassVar[str] = "triangular has its mode at the nominal value"
    lower: float
    mode: float
    upper: float

    @classmethod
    def in_file(
        cls, side: Interval | None, given: Mapping[str, Any], written: Mapping[str, Any]
    ) -> Distribution:
        """The whole interval, with the mode at the nominal value."""
        side = required(side)
        return cls(side.lower, side.nominal, side.upper)

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

    def upper_cdf(self, value: float) -> float:
        """Probability of a larger value [-]."""
        width, value = self.upper - self.lower, min(self.upper, max(self.lower, value))
        if value > self.mode:
            return (self.upper - value) ** 2 / (width * (self.upper - self.mode))
        return 1.0 - self.cdf(value) if value < self.upper else 0.0

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
