"""Quantities as text: in which unit, and with how many digits: ``"25.0 µm"``, ``"2.31 kN"``."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from .quantities import Interval
from .tables import ROUNDING, format_number, without_rounding
from .units import same_kind, size_of

_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}

# Units that take a prefix, with the largest power of ten in use: km/s² is not. Powers of a unit, as in m²,
# are left out, since the prefix is raised to the power as well.
_LARGEST = {"m": 3, "m/s": 0, "m/s²": 0, "s": 0, "N": 9, "J": 9, "W": 9, "N m": 9, "N/m": 9, "Pa": 9, "Hz": 9}
_LEAST = -12
# Digits that a number may have [-]; those behind the last are the rounding of sums.
_MOST_DIGITS = 12


def prefix_of(size: float, unit: str) -> tuple[float, str]:
    """Factor and unit in which a quantity of some size has one to three digits before the point.

    >>> prefix_of(2.5e-5, "m"), prefix_of(2310.0, "N"), prefix_of(2310.0, "m/s²"), prefix_of(0.02, "rad/s")
    ((1000000.0, 'µm'), (0.001, 'kN'), (1.0, 'm/s²'), (1.0, 'rad/s'))
    """
    if unit == "rad":  # as drawings have angles
        return 180.0 / math.pi, "°"
    if unit not in _LARGEST or not (size > 0.0 and math.isfinite(size)):
        return 1.0, unit
    # Three digits count: 999.6 is written as 1.00 k.
    exponent = _exponent(size)
    power = min(max(3 * (exponent // 3), _LEAST), _LARGEST[unit])
    return 10.0**-power, f"{_PREFIXES[power]}{unit}"


def unit_shown(size: float, unit: str, written: Sequence[str] = ()) -> tuple[float, str]:
    """Factor and unit in which a quantity of some size is shown: one of those that the user has `written`, if
    one is of its kind, else with a prefix.

    Of several the largest in which the quantity has a digit before the point. One in which it takes a power
    of ten is not shown.

    >>> unit_shown(0.17, "m", ("mm", "um")), unit_shown(2e-5, "m", ("mm", "um")), unit_shown(2e-5, "m")
    ((1000.0, 'mm'), (1000000.0, 'um'), (1000000.0, 'µm'))
    >>> unit_shown(209.0, "rad/s", ("rpm",))[1], unit_shown(3e-9, "m", ("mm",))[1]
    ('rpm', 'nm')
    """
    sizes = {one: size_of(one) for one in written if one and same_kind(one, unit)}
    known = {one: own for one, own in sizes.items() if size == 0.0 or _is_plain(_exponent(size / own))}
    if not known:
        return prefix_of(size, unit)
    whole = {one: own for one, own in known.items() if size >= own}
    found = max(whole, key=whole.__getitem__) if whole else min(known, key=known.__getitem__)
    return 1.0 / known[found], found


@dataclass(frozen=True)
class Form:
    """How numbers that are compared are written: in one unit, with digits that tell them apart."""

    factor: float
    """From the SI unit to the shown one [-]."""
    unit: str
    """The unit that is shown."""
    decimals: int
    """Digits behind the point [-]."""
    size: float
    """Largest of the numbers, in the unit that is shown."""

    @classmethod
    def of(cls, values: Iterable[float], unit: str, written: Sequence[str] = (), digits: int = 3) -> Form:
        """The form of numbers of an SI unit, with at least so many digits of the largest of them.

        Two digits of the distance between the smallest and the largest are shown, and more, up to four, where
        two numbers that differ would else read the same: a run resolves no more of it.

        >>> bottom = Form.of((-0.47002, -0.47, -0.46998), "m", ["mm"])
        >>> [bottom.number(value) for value in (-0.47002, -0.47, -0.46998)], bottom.unit
        (['-470.020', '-470.000', '-469.980'], 'mm')
        >>> Form.of((395.0, 400.0, 658.0), "N").range(395.0, 658.0)
        '395 .. 658 N'
        """
        known = [float(value) for value in values if math.isfinite(value)]
        size = max(map(abs, known), default=0.0)
        factor, shown = unit_shown(size, unit, written)
        apart = sorted({factor * without_rounding(value, size) for value in known})
        size *= factor
        if size == 0.0:
            return cls(factor, shown, 0, 0.0)
        # No digit of a double is behind these.
        most = _MOST_DIGITS - 1 - _exponent(size)
        decimals = digits - 1 - _exponent(size)
        width = apart[-1] - apart[0]
        if width > ROUNDING * size:
            of_width = 1 - _exponent(width)
            decimals = max(decimals, of_width)
            while decimals < of_width + 2 and len({f"{value:.{max(decimals, 0)}f}" for value in apart}) < len(
                apart
            ):
                decimals += 1
        return cls(factor, shown, min(decimals, most), size)

    def number(self, value: float) -> str:
        """A number without its unit."""
        if math.isnan(value):
            return "-"
        value = without_rounding(self.factor * value, self.size)
        if value == 0.0 or math.isinf(value):
            return f"{value + 0.0:g}"  # no "-0"
        exponent = _exponent(self.size)
        if _is_plain(exponent):
            return f"{value:z.{max(0, self.decimals)}f}"
        return f"{value:.{max(0, self.decimals + exponent)}e}"

    def text(self, value: float) -> str:
        """A number with its unit."""
        return _with_unit(self.number(value), self.unit)

    def range(self, *values: float) -> str:
        """Numbers with one unit: ``"-1.20 .. 2.31 kN"``."""
        return _with_unit(" .. ".join(map(self.number, values)), self.unit)

    def difference(self, value: float, digits: int = 3) -> str:
        """A difference of such numbers in their unit, with digits of its own."""
        known = 0.0 if abs(self.factor * value) <= ROUNDING * self.size else self.factor * value
        return _with_unit(format_number(known, digits), self.unit)


def format_quantity(value: float, unit: str, digits: int = 3, written: Sequence[str] = ()) -> str:
    """A number with its unit: one that the user has `written`, else SI with a prefix where that takes one.

    >>> format_quantity(2e-5, "m"), format_quantity(-2310.0, "N"), format_quantity(0.5, "-")
    ('20.0 µm', '-2.31 kN', '0.500')
    >>> format_quantity(0.5, "rad"), format_quantity(0.5, "m", written=["mm"])
    ('28.6°', '500 mm')
    """
    return Form.of((value,), unit, written, digits).text(value)


def format_exact(value: float, unit: str, size: float | None = None, written: Sequence[str] = ()) -> str:
    """A number as it was given, with up to six digits, no zeros at its end, in the unit of a `size`.

    >>> format_exact(0.02, "m"), format_exact(2e-4, "m", 0.02), format_exact(1e-4, "-")
    ('20 mm', '0.2 mm', '0.0001')
    """
    factor, shown = unit_shown(abs(value) if size is None else size, unit, written)
    return _with_unit(f"{factor * value:.6g}", shown)


def format_tolerance(side: Interval, unit: str, written: Sequence[str] = ()) -> tuple[str, str]:
    """The nominal value of a parameter and how far it may be from it, to either side, as they were given.

    >>> format_tolerance(Interval.around("20 mm", rel=0.01), "m")
    ('20 mm', '±0.2 mm')
    >>> format_tolerance(Interval(1.0, 3.0, 1.0), "")
    ('1', '+2 / -0')
    """
    size = max(abs(side.lower), abs(side.upper))

    def exact(value: float) -> str:
        return format_exact(without_rounding(value, size), unit, size, written)

    if side.nominal == side.midpoint:
        return exact(side.nominal), f"±{exact(side.half_width)}"
    plus, minus = side.upper - side.nominal, side.nominal - side.lower
    return exact(side.nominal), f"+{exact(plus)} / -{exact(minus)}"


def format_range(values: tuple[float, ...], unit: str, digits: int = 3, written: Sequence[str] = ()) -> str:
    """Numbers with one unit, with digits that tell them apart: ``"-1.20 .. 2.31 kN"``.

    >>> format_range((-0.001, 0.12), "m"), format_range((0.1, float("nan")), "N")
    ('-1 .. 120 mm', '100 .. - mN')
    """
    return Form.of(values, unit, written, digits).range(*values)


def _exponent(size: float) -> int:
    """Power of ten of a number that is written with three digits."""
    return int(f"{size:.2e}".partition("e")[2])


def _is_plain(exponent: int) -> bool:
    """Whether numbers of this size are written without a power of ten."""
    return -4 <= exponent < 6


def _with_unit(number: str, unit: str) -> str:
    """Degrees stand at their number, other units behind a space."""
    if unit in ("", "-"):
        return number
    return number + unit if unit == "°" else f"{number} {unit}"
