"""Intervals, and revolutions per minute."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Mapping
from copy import copy
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Self

from ..errors import ArgumentTypeError
from .arguments import Checks, as_number
from .units import UnitError, convert, is_quantity, unit_of_quantity

# Part of the ends by which a nominal value that is meant to be the midpoint may differ from it.
_ROUNDING = 4.0 * sys.float_info.epsilon


class Written:
    """What may be written with units, and remembers the one it was written with."""

    unit: ClassVar[str] = ""
    """The unit that stood with its first number, for checks against that of the quantity; no field, so that
    equal numbers are equal however they were written."""
    _kinds: ClassVar[dict[str, type[Any]]] = {}
    """All kinds by their names."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        Written._kinds[cls.__name__] = cls

    def facts(self) -> dict[str, Any]:
        """Its fields, kind and unit, as files have them."""
        numbers = {item.name: _plain(getattr(self, item.name)) for item in fields(self)}  # type: ignore[arg-type]
        return {**numbers, "kind": type(self).__name__, "unit": self.unit}

    @staticmethod
    def from_facts(facts: Mapping[str, Any]) -> Any:
        """What has such facts."""
        numbers = {name: _as_it_was(value) for name, value in facts.items()}
        kind, unit = Written._kinds[numbers.pop("kind")], numbers.pop("unit")
        if not isinstance(unit, str):
            raise ValueError(f"{unit!r} is no unit")
        return kind(**numbers).in_unit(unit)

    def in_unit(self, unit: str) -> Self:
        """The same with the unit in which it was written."""
        made = copy(self)
        object.__setattr__(made, "unit", unit)
        return made


def _plain(value: Any) -> Any:
    """A field as JSON has it: what is written is its facts, numbers in a row are a list."""
    if isinstance(value, Written):
        return value.facts()
    return list(value) if isinstance(value, tuple) else value


def _as_it_was(plain: Any) -> Any:
    if isinstance(plain, Mapping):
        return Written.from_facts(plain)
    return tuple(plain) if isinstance(plain, list) else plain


@dataclass(frozen=True)
class Interval(Written):
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
        If a number is not finite, the ends are reversed, the nominal value is not between them, or units
        are not of one dimension.

    Examples
    --------
    >>> Interval("119.5 mm", 0.1205)
    Interval(lower=0.1195, upper=0.1205)
    >>> Interval("119.5 mm", 0.1205).unit
    'mm'
    """

    lower: float
    upper: float
    nominal: float = None  # type: ignore[assignment] # a number once made

    def __post_init__(self) -> None:
        checks = Checks()
        names = ("lower", "upper", "nominal")
        (lower, upper, nominal), unit = in_one_unit({name: getattr(self, name) for name in names})
        if unit:
            object.__setattr__(self, "unit", unit)
        for name, value in (("lower", lower), ("upper", upper)):
            object.__setattr__(self, name, checks.real(name, value, "SI unit"))
        if self.lower >= self.upper:
            checks.add("lower", f"must be < upper, got lower = {self.lower!r} and upper = {self.upper!r}")
        checks.finish()
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
        (nominal, plus, minus), unit = in_one_unit({"nominal": nominal, "plus": plus, "minus": minus})
        middle = checks.real("nominal", nominal, "SI unit")
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
                checks.real(name, 0.0 if given is None else given, "SI unit", least=0.0)
                for name, given in (("plus", plus), ("minus", minus))
            )
            if above == below == 0.0:
                checks.add("plus", "and minus must not both be 0")
        checks.finish()
        made = cls(middle - below, middle + above, None if above == below else middle)  # type: ignore[arg-type]
        return made.in_unit(unit)

    @classmethod
    def about(cls, lower: float, nominal: float, upper: float) -> Interval:
        """The interval with a nominal value [SI unit], the midpoint if it differs from it by rounding."""
        side = cls(lower, upper)
        slack = _ROUNDING * max(abs(lower), abs(upper))
        return side if abs(nominal - side.midpoint) <= slack else cls(lower, upper, nominal)

    def __iter__(self) -> Iterator[float]:
        return iter((self.lower, self.upper))

    def __contains__(self, value: object) -> bool:
        if isinstance(value, str) and is_quantity(value):
            value = convert(value, self.unit or "unit")
        number = as_number(value)
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


def in_one_unit(given: Mapping[str, Any]) -> tuple[list[Any], str]:
    """Values by name in SI units, texts with units among them, and the unit of the first such text.

    What is neither a number nor a quantity stays as it is. An ArgumentError has all texts whose unit is
    unknown or of another dimension than the first.
    """
    checks, unit, values = Checks(), "", []
    for name, value in given.items():
        if isinstance(value, str) and is_quantity(value):
            try:
                text, value = value, convert(value, unit or "unit")
                unit = unit or unit_of_quantity(text)
            except UnitError as error:
                checks.add(name, f'= "{value}": {error}')
        values.append(value)
    checks.finish()
    return values, unit


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
    if isinstance(revolutions_per_minute, str):
        what = f'must be a number [1/min], got {revolutions_per_minute!r}: "2000 rpm" is a speed by itself'
        checks.add("revolutions_per_minute", what, wrong_type=True)
        checks.finish()
    speed = checks.real("revolutions_per_minute", revolutions_per_minute, "1/min")
    checks.finish()
    return speed * (2.0 * math.pi / 60.0)
