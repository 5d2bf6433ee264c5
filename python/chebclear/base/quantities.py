"""Intervals, and conversion of units that are common but not SI."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .arguments import Checks


@dataclass(frozen=True)
class Interval:
    """All values from `lower` to `upper`, with a nominal one among them.

    Parameters
    ----------
    lower, upper : float
        Ends, in the SI unit of the quantity; finite, `lower` below `upper`.
    nominal : float, optional
        Nominal value, at which the nominal run of a study is simulated: from `lower` to `upper`, as of a
        dimension with tolerances to one side; the midpoint if not given.

    Raises
    ------
    ValueError, TypeError
        If a number is not finite, the ends are reversed, or the nominal value is not between them.
    """

    lower: float
    upper: float
    nominal: float = None  # type: ignore[assignment] # a number once made

    def __post_init__(self) -> None:
        checks = Checks()
        for name in ("lower", "upper"):
            object.__setattr__(self, name, checks.real(name, getattr(self, name), "SI unit"))
        if self.lower >= self.upper:
            checks.add(f"lower must be < upper, got lower = {self.lower!r} and upper = {self.upper!r}")
        checks.finish()
        nominal = self.nominal
        if nominal is None:
            nominal = self.midpoint
        nominal = checks.real("nominal", nominal, "SI unit", least=self.lower, most=self.upper)
        checks.finish()
        object.__setattr__(self, "nominal", nominal)

    def __repr__(self) -> str:
        nominal = "" if self.nominal == self.midpoint else f", nominal={self.nominal!r}"
        return f"Interval(lower={self.lower!r}, upper={self.upper!r}{nominal})"

    @property
    def midpoint(self) -> float:
        """Mean of the ends [SI unit of the quantity]."""
        return 0.5 * self.lower + 0.5 * self.upper  # halved first: the sum may overflow

    @property
    def half_width(self) -> float:
        """Half the distance between the ends [SI unit of the quantity]."""
        return 0.5 * self.upper - 0.5 * self.lower


def interval(
    first: float, upper: float | None = None, *, rel: float | None = None, half_width: float | None = None
) -> Interval:
    """An interval from its ends, or around a midpoint.

    Parameters
    ----------
    first : float
        Lower end if `upper` is given, else the midpoint [SI unit of the quantity].
    upper : float, optional
        Upper end [SI unit of the quantity].
    rel : float, optional
        Half-width over the absolute value of the midpoint [-], above 0 and at most 1: 10 % is 0.1.
    half_width : float, optional
        Half-width [SI unit of the quantity], above 0.

    Returns
    -------
    Interval

    Raises
    ------
    ValueError, TypeError
        If not exactly one of `upper`, `rel` and `half_width` is given, or a number is out of range.

    Examples
    --------
    >>> interval(0.2, 0.5)
    Interval(lower=0.2, upper=0.5)
    >>> interval(8.0, rel=0.25) == interval(8.0, half_width=2.0) == interval(6.0, 10.0)
    True
    """
    if sum(given is not None for given in (upper, rel, half_width)) != 1:
        raise TypeError("give exactly one of upper, rel and half_width")
    if upper is not None:
        return Interval(first, upper)
    checks = Checks()
    middle = checks.real("midpoint", first, "SI unit")
    if rel is not None:
        part = checks.real("rel", rel, "-", above=0.0)
        if math.isfinite(part) and part > 1.0:
            checks.add(
                f"rel must be a part of the midpoint, <= 1 [-], got {rel!r}: {rel!r} % is "
                f"rel={part / 100.0:g}; for an interval that contains zero give half_width, or both ends"
            )
        half = part * abs(middle)
        if middle == 0.0:
            checks.add("midpoint must not be 0 with rel; use half_width")
    else:
        half = checks.real("half_width", half_width, "SI unit", above=0.0)
    checks.finish()
    return Interval(middle - half, middle + half)


def rpm(revolutions_per_minute: float) -> float:
    """Angular velocity [rad/s] of a speed in revolutions per minute [1/min].

    Parameters
    ----------
    revolutions_per_minute : float
        The speed [1/min].

    Returns
    -------
    float
        In rad/s.

    Raises
    ------
    ValueError, TypeError
        If the speed is not a finite number.

    Examples
    --------
    >>> rpm(30.0) == math.pi
    True
    """
    checks = Checks()
    speed = checks.real("revolutions_per_minute", revolutions_per_minute, "1/min")
    checks.finish()
    return speed * (2.0 * math.pi / 60.0)
