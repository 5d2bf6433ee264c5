"""Intervals, and revolutions per minute."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from ..errors import ArgumentError, ArgumentTypeError
from .arguments import Checks, as_number
from .units import UnitError, convert, is_quantity


@dataclass(frozen=True)
class Interval:
    """All values from `lower` to `upper`, with a nominal one among them.

    ``lower, upper = interval`` are its ends, and ``value in interval`` says whether it holds a value.

    Parameters
    ----------
    lower, upper : float or str
        Ends, in the SI unit of the quantity or with their unit, such as ``"120 mm"``; finite, `lower` below
        `upper`.
    nominal : float or str, optional
        Nominal value, at which the nominal run of a study is simulated: from `lower` to `upper`, as of a
        dimension with tolerances to one side; the midpoint if not given.

    Raises
    ------
    ValueError, TypeError
        If a number is not finite, the ends are reversed, or the nominal value is not between them.

    Examples
    --------
    >>> Interval("119.5 mm", 0.1205)
    Interval(lower=0.1195, upper=0.1205)
    """

    lower: float
    upper: float
    nominal: float = None  # type: ignore[assignment] # a number once made

    def __post_init__(self) -> None:
        checks = Checks()
        for name in ("lower", "upper"):
            object.__setattr__(self, name, checks.real(name, _in_si(name, getattr(self, name)), "SI unit"))
        if self.lower >= self.upper:
            checks.add("lower", f"must be < upper, got lower = {self.lower!r} and upper = {self.upper!r}")
        checks.finish()
        nominal = _in_si("nominal", self.nominal)
        if nominal is None:
            nominal = self.midpoint
        nominal = checks.real("nominal", nominal, "SI unit", least=self.lower, most=self.upper)
        checks.finish()
        object.__setattr__(self, "nominal", nominal)

    @classmethod
    def around(
        cls,
        nominal: float | str,
        *,
        rel: float | None = None,
        plus: float | str | None = None,
        minus: float | str | None = None,
    ) -> Interval:
        """The interval around a nominal value.

        Parameters
        ----------
        nominal : float or str
            The nominal value, in the SI unit of the quantity or with its unit.
        rel : float, optional
            How far it reaches to either side, over the absolute nominal value [-], above 0 and at most 1:
            10 % is 0.1.
        plus, minus : float or str, optional
            How far it reaches above and below, at least 0 and not both 0; 0 if only the other is given.

        Raises
        ------
        ValueError, TypeError
            If not either `rel` or one of `plus` and `minus` is given, or a number is out of range.

        Examples
        --------
        >>> Interval.around(8.0, rel=0.25) == Interval.around(8.0, plus=2.0, minus=2.0) == Interval(6.0, 10.0)
        True
        >>> Interval.around("20 mm", minus="0.1 mm").nominal
        0.02
        """
        if (rel is None) == (plus is None and minus is None):
            raise ArgumentTypeError("give either rel, or plus or minus or both")
        checks = Checks()
        middle = checks.real("nominal", _in_si("nominal", nominal), "SI unit")
        if rel is not None:
            part = checks.real("rel", rel, "-", above=0.0)
            if math.isfinite(part) and part > 1.0:
                checks.add(
                    "rel",
                    f"must be a part of the nominal value, <= 1 [-], got {rel!r}: {rel!r} % is "
                    f"rel={part / 100.0:g}; for an interval that contains zero give plus and minus, or "
                    "both ends",
                )
            if middle == 0.0:
                checks.add("nominal", "must not be 0 with rel; use plus and minus")
            above = below = part * abs(middle)
        else:
            above, below = (
                checks.real(name, 0.0 if given is None else _in_si(name, given), "SI unit", least=0.0)
                for name, given in (("plus", plus), ("minus", minus))
            )
            if above == below == 0.0:
                checks.add("plus", "and minus must not both be 0")
        checks.finish()
        return cls(middle - below, middle + above, None if above == below else middle)  # type: ignore[arg-type]

    def __iter__(self) -> Iterator[float]:
        return iter((self.lower, self.upper))

    def __contains__(self, value: object) -> bool:
        number = as_number(_in_si("value", value))
        return number is not None and self.lower <= number <= self.upper

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


def _in_si(name: str, value: object) -> object:
    """What is given as text with a unit as a number in SI units; anything else as it is."""
    if not isinstance(value, str) or not is_quantity(value):
        return value
    try:
        return convert(value, "unit")
    except UnitError as error:
        raise ArgumentError(f'{name} = "{value}": {error}') from None


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
