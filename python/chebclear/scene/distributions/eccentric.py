"""Eccentricities: how far a place is from where it should be, in any direction of the plane."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np

from ...base.arguments import Checks
from ...base.quantities import Interval, in_one_unit
from ...base.rows import Array
from ...errors import ArgumentError
from .distribution import REACH, Distribution, FileKey, standard_cdf

# Share beyond three standard deviations of a normal distribution, on both sides [-].
_BEYOND = 2.0 * standard_cdf(-REACH)


@dataclass(frozen=True)
class Eccentric(Distribution):
    """The distance of a place from where it should be; see `eccentric`."""

    written_as: ClassVar[str] = "distributions.eccentric"
    in_words: ClassVar[str] = "eccentric is the distance from a place, by deviation or tolerance"
    file_keys: ClassVar[Mapping[str, FileKey]] = {
        "deviation": FileKey(
            "value", "standard deviation of each coordinate of an eccentric place", gives_interval=True
        ),
        "tolerance": FileKey(
            "value", "diameter of the circle in which an eccentric place is", gives_interval=True
        ),
    }
    deviation: float | None = None
    tolerance: float | None = None

    @classmethod
    def in_file(
        cls, side: Interval | None, given: Mapping[str, Any], written: Mapping[str, Any]
    ) -> Distribution:
        """By its deviation or its tolerance."""
        checks = Checks()
        if side is not None:
            checks.add("distribution", "has its interval from deviation or tolerance: give no other")
        checks.finish()
        return eccentric(**given)

    @property
    def interval(self) -> Interval:
        """From 0, the nominal value, to the radius of the tolerance, or of the circle that holds 99.73 %."""
        return Interval(0.0, self.upper_quantile(_BEYOND if self._radius is None else 0.0), 0.0).in_unit(
            self.unit
        )

    @property
    def support(self) -> tuple[float, float]:
        """From 0 to the radius of the tolerance."""
        return 0.0, math.inf if self._radius is None else self._radius

    @property
    def _radius(self) -> float | None:
        return None if self.tolerance is None else 0.5 * self.tolerance

    def cdf(self, value: float) -> float:
        """Probability of a smaller value [-]."""
        if value <= 0.0:
            return 0.0
        if self._radius is None:
            return -math.expm1(self._exponent(value))
        return (min(value, self._radius) / self._radius) ** 2

    def upper_cdf(self, value: float) -> float:
        """Probability of a larger value [-]."""
        if value <= 0.0:
            return 1.0
        if self._radius is None:
            return math.exp(self._exponent(value))
        part = min(value, self._radius) / self._radius
        return (1.0 - part) * (1.0 + part)

    def quantile(self, share: float) -> float:
        """The value that so many stay below."""
        if self.deviation is not None:
            return self.deviation * math.sqrt(-2.0 * math.log1p(-share))
        return self.support[1] * math.sqrt(share)

    def upper_quantile(self, share: float) -> float:
        """The value that so many stay above."""
        if self.deviation is not None:
            return self.deviation * math.sqrt(-2.0 * math.log(share))
        return self.support[1] * math.sqrt(1.0 - share)

    def slopes(self, values: Array) -> dict[str, Array]:
        """Over the standard deviation; none with a tolerance, at which the values end."""
        if self.deviation is None:
            return {}
        return {"deviation": np.asarray((values / self.deviation) ** 2 - 2.0) / self.deviation}

    def scaled(self, factor: float) -> Self:
        """With another standard deviation or tolerance."""
        sizes = (None if one is None else factor * one for one in (self.deviation, self.tolerance))
        return type(self)(*sizes).in_unit(self.unit)

    def moved(self, distance: float) -> Self:
        """Refused: a distance from the nominal place stays one if that is moved."""
        raise ArgumentError("an eccentricity is the distance from the nominal place: move this place")

    def _exponent(self, value: float) -> float:
        assert self.deviation is not None
        score = value / self.deviation
        return -0.5 * score * score  # which may be infinite, a power is refused then


def eccentric(deviation: float | str | None = None, *, tolerance: float | str | None = None) -> Eccentric:
    """How far a place, such as the center of a bore, is from where it should be, in any direction.

    It is a distance, at least 0. Its direction is another parameter, uniform over a turn:
    ``cc.uniform(0, "360 deg")``; with both the place is displaced by ``offset * cos(direction)`` and
    ``offset * sin(direction)``.

    The **deviation is that of one coordinate**: both are normal with it, and their distance has Rayleigh's
    distribution. A part of exp(-r²/2s²) is farther off than r: 61 % farther than the deviation s, 1.1 %
    farther than 3 s.

    A **positional tolerance is a diameter**: with ``tolerance="20 um"`` no place is farther off than 10 um.
    Places are then as frequent everywhere in this circle, most of them near its edge, half of them farther
    off than .71 of the radius; that is what may be said where nothing but the tolerance is known.

    Parameters
    ----------
    deviation : float or str, optional
        Standard deviation of each coordinate, above 0, in the SI unit of the quantity or with its unit.
    tolerance : float or str, optional
        In its place the diameter of the circle that the place is in, likewise.

    Raises
    ------
    ValueError, TypeError
        If not exactly one is given, or it is not a finite number above 0.

    Examples
    --------
    >>> import chebclear as cc
    >>> offset = cc.distributions.eccentric("5 um")
    >>> round(offset.upper_cdf(15e-6), 4)
    0.0111
    """
    (deviation, tolerance), unit = in_one_unit({"deviation": deviation, "tolerance": tolerance})
    checks = Checks()
    sizes = [
        None if one is None else checks.real(name, one, "SI unit", above=0.0)
        for name, one in (("deviation", deviation), ("tolerance", tolerance))
    ]
    if (deviation is None) == (tolerance is None):
        both = "missing" if deviation is None else "given"
        checks.add("deviation", f"and tolerance are both {both}: give one")
    checks.finish()
    return Eccentric(*sizes).in_unit(unit)
