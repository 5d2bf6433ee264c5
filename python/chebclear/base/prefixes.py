"""Quantities as text with unit prefixes: ``"25.0 µm"``, ``"2.31 kN"``."""

from __future__ import annotations

import math

from .tables import format_number, without_rounding

_PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}

# Units that take a prefix, with the largest power of ten in use: km/s² is not. Powers of a unit, as in m²,
# are left out, since the prefix is raised to the power as well.
_LARGEST = {"m": 3, "m/s": 0, "m/s²": 0, "s": 0, "N": 9, "J": 9, "W": 9, "N m": 9, "N/m": 9, "Pa": 9, "Hz": 9}
_LEAST = -12


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
    exponent = int(f"{size:.2e}".partition("e")[2])
    power = min(max(3 * (exponent // 3), _LEAST), _LARGEST[unit])
    return 10.0**-power, f"{_PREFIXES[power]}{unit}"


def format_quantity(value: float, unit: str, digits: int = 3, scale: float = 0.0) -> str:
    """A number with its SI unit, with a prefix where that takes one; the rounding of a `scale` is 0.

    >>> format_quantity(-9.3e-17, "m", scale=0.17)
    '0 m'
    >>> format_quantity(2e-5, "m"), format_quantity(-2310.0, "N"), format_quantity(0.5, "-")
    ('20.0 µm', '-2.31 kN', '0.500')
    >>> format_quantity(0.5, "rad")
    '28.6°'
    """
    return format_range((without_rounding(value, scale),), unit, digits)


def format_exact(value: float, unit: str, size: float | None = None) -> str:
    """A number as it was given, with up to six digits, no zeros at its end, and the prefix of a `size`.

    >>> format_exact(0.02, "m"), format_exact(2e-4, "m", 0.02), format_exact(1e-4, "-")
    ('20 mm', '0.2 mm', '0.0001')
    """
    factor, shown = prefix_of(abs(value) if size is None else size, unit)
    return _with_unit(f"{factor * value:.6g}", shown)


def format_range(values: tuple[float, ...], unit: str, digits: int = 3) -> str:
    """Numbers with one unit, with the prefix of the largest, whose rounding is 0: ``"-1.20 .. 2.31 kN"``.

    >>> format_range((-0.001, 0.12), "m"), format_range((0.1, float("nan")), "N")
    ('-1.00 .. 120 mm', '100 .. - mN')
    """
    known = [abs(value) for value in values if math.isfinite(value)]
    factor, shown = prefix_of(max(known, default=0.0), unit)
    scale = factor * max(known, default=0.0)
    text = " .. ".join(format_number(factor * value, digits, scale) for value in values)
    return _with_unit(text, shown)


def _with_unit(number: str, unit: str) -> str:
    """Degrees stand at their number, other units behind a space."""
    if unit in ("", "-"):
        return number
    return number + unit if unit == "°" else f"{number} {unit}"
