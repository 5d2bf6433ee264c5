"""Units: of the fields of a record, and of quantities as text, ``"20 um"``, ``"2000 rpm"``, ``"30 deg"``.

The unit of a field is declared once with it, where code can read it; docstrings name the units for the
reader, and a test holds them to the metadata. Quantities with a unit are converted to SI once, when they are
read. A bare number is SI already. Conversion is exact before the one rounding to a float: 20 um is exactly
the float 2e-05, unlike 20 * 1e-6.

Angles count as a dimension where nothing else tells what is counted: an angular velocity is in rad/s, deg/s,
rpm or revolutions in Hz, and no number of "1/min". In products with lengths or masses they do not: N m/rad
and N m are of one dimension, as in SI.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from decimal import Decimal, InvalidOperation
from fractions import Fraction
from typing import Any, NamedTuple

from .shown import did_you_mean, suggested

_KEY = "unit"


def unit(symbol: str) -> dict[str, str]:
    """Metadata of a field that holds a number with a unit: ``field(metadata=unit("kg"))``."""
    return {_KEY: symbol}


def units(record: type[Any]) -> dict[str, str]:
    """The unit of every field of a dataclass by name; fields without one are left out.

    >>> @dataclasses.dataclass
    ... class Wheel:
    ...     name: str
    ...     mass: float = dataclasses.field(metadata=unit("kg"))
    >>> units(Wheel)
    {'mass': 'kg'}
    """
    return {item.name: item.metadata[_KEY] for item in dataclasses.fields(record) if _KEY in item.metadata}


class Dimension(NamedTuple):
    """Powers of mass, length, time and angle."""

    mass: Fraction = Fraction(0)
    length: Fraction = Fraction(0)
    time: Fraction = Fraction(0)
    angle: Fraction = Fraction(0)

    def fits(self, other: Dimension) -> bool:
        """Whether quantities of both may stand for each other: angles count where nothing else does.

        >>> torque, stiffness = (parse_unit(text).dimension for text in ("N m", "N m/rad"))
        >>> speed, frequency = (parse_unit(text).dimension for text in ("rpm", "1/min"))
        >>> torque.fits(stiffness), speed.fits(frequency)
        (True, False)
        """
        return self[:3] == other[:3] and (self.angle == other.angle or bool(self.mass or self.length))


class Unit(NamedTuple):
    """A unit: the SI value is the written one times `scale`, and times the factor of an angular unit."""

    scale: Fraction
    dimension: Dimension
    angular: str = ""
    """``"deg"``, ``"rev"``, these below 1, or ``"rpm"``: their factors hold pi, no fraction is exact."""


class UnitError(ValueError):
    """A quantity that cannot be read, or of a wrong dimension; `hint` says what may be meant."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message + hint)
        self.message, self.hint = message, hint


def _dimension(mass: int = 0, length: int = 0, time: int = 0, angle: int = 0) -> Dimension:
    return Dimension(Fraction(mass), Fraction(length), Fraction(time), Fraction(angle))


_ONE, _LENGTH, _MASS, _TIME = _dimension(), _dimension(length=1), _dimension(mass=1), _dimension(time=1)
_FORCE, _ENERGY = _dimension(1, 1, -2), _dimension(1, 2, -2)
_PRESSURE, _POWER = _dimension(1, -1, -2), _dimension(1, 2, -3)
_ANGLE, _SPEED, _FREQUENCY = _dimension(angle=1), _dimension(time=-1, angle=1), _dimension(time=-1)


# Symbols with their scales. The micro sign is written in two ways, U+00B5 and the Greek letter U+03BC. Pounds
# and kilograms of force, inches and feet are exact by their definitions.
_SCALES = {
    _LENGTH: "m 1 mm 1e-3 um 1e-6 km 1e3 dm 0.1 cm 0.01 \u00b5m 1e-6 \u03bcm 1e-6 nm 1e-9 "
    "in 0.0254 inch 0.0254 ft 0.3048 yd 0.9144 mil 2.54e-5 thou 2.54e-5",
    _MASS: "kg 1 g 1e-3 mg 1e-6 t 1e3 lb 0.45359237 oz 0.028349523125",
    _TIME: "s 1 ms 1e-3 us 1e-6 \u00b5s 1e-6 \u03bcs 1e-6 ns 1e-9 min 60 h 3600",
    _ANGLE: "rad 1 mrad 1e-3 deg 1 \u00b0 1 arcmin 1/60 arcsec 1/3600 rev 1 r 1 U 1 turn 1",
    _ONE: "% 0.01",
    _SPEED: "rpm 1",
    _FREQUENCY: "Hz 1 kHz 1e3",
    _FORCE: "N 1 mN 1e-3 daN 10 kN 1e3 MN 1e6 GN 1e9 kgf 9.80665 kp 9.80665 lbf 4.4482216152605",
    _dimension(1, 1, -1): "Ns 1",
    _ENERGY: "J 1 mJ 1e-3 kJ 1e3 MJ 1e6 Nm 1 Nmm 1e-3 kNm 1e3",
    _POWER: "W 1 mW 1e-3 kW 1e3 MW 1e6",
    _PRESSURE: "Pa 1 kPa 1e3 MPa 1e6 GPa 1e9 mbar 1e2 bar 1e5 "
    "psi 4.4482216152605/0.00064516 ksi 4448.2216152605/0.00064516",
    _dimension(1, -1, -1): "P 0.1 cP 1e-3",
}
_ANGULAR = dict.fromkeys(("deg", "\u00b0", "arcmin", "arcsec"), "deg")
_ANGULAR |= dict.fromkeys(("rev", "r", "U", "turn"), "rev") | {"rpm": "rpm"}


def _scale(text: str) -> Fraction:
    above, _, below = text.partition("/")
    return Fraction(Decimal(above)) / Fraction(Decimal(below or 1))


UNITS = {
    symbol: Unit(_scale(scale), dimension, _ANGULAR.get(symbol, ""))
    for dimension, text in _SCALES.items()
    for symbol, scale in zip(text.split()[::2], text.split()[1::2], strict=True)
}
"""Symbols of units that a scene file may use, alone or as in ``"N m/rad"`` and ``"kg m2"``."""

# Units of more than one symbol that are in common use, to be suggested.
_COMPOUND = (
    *("m/s", "mm/s", "m/s2", "mm/s2", "rad/s", "rev/min", "rev/s", "deg/s", "1/s", "s/m"),
    *("N/m", "N/mm", "kN/m", "lbf/in", "N s/m", "N s/mm", "N/m^1.5", "N/mm^1.5"),
    *("N m", "N mm", "kN m", "lbf ft", "lbf in", "N m/rad", "N m/deg", "N m s/rad"),
    *("kg m2", "kg mm2", "g mm2", "lb in2", "Pa s", "mPa s", "m2", "mm2", "cm2", "kg/m3", "g/cm3"),
)
_FACTORS: dict[str, Callable[[float], float]] = {
    "": float,
    "deg": math.radians,
    "1/deg": math.degrees,
    "rev": lambda turns: turns * math.tau,
    "1/rev": lambda turns: turns / math.tau,
    "rpm": lambda turns: turns * (2.0 * math.pi / 60.0),
}
# Other ways to write rpm, which then is the same number to the last bit.
_RPM = re.compile(r"(?<![^\s*(/])(?:rev|r|U|turn)\s*/\s*min(?![^\s*)/])")
# Not \d, which stands for the digits of every script.
_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?"
_QUANTITY = re.compile(rf"\s*({_NUMBER})\s+([^\s*+/()-].*?)\s*")
_GLUED = re.compile(rf"\s*({_NUMBER})([^\s0-9.*+/()-].*?)\s*")
_FACTOR = re.compile(r"([^\s*/^0-9.()+-]+)(?:\^?\(?(-?[0-9]+(?:\.[0-9]+)?)\)?)?")
_RAISED = str.maketrans("\u00b2\u00b3\u2074\u00b7", "234*")
# Characters of a quantity [-]: the longest that make sense have thirty.
MOST_CHARACTERS = 100


def is_quantity(text: str) -> bool:
    """Whether a text is a number, a space and a unit; such a text is never an expression."""
    return len(text) <= MOST_CHARACTERS and _QUANTITY.fullmatch(text) is not None


def unit_of_quantity(text: str) -> str:
    """The unit of a quantity as text, as it is written; empty if the text is none.

    >>> unit_of_quantity("20 N mm"), unit_of_quantity("2 * length")
    ('N mm', '')
    """
    found = _QUANTITY.fullmatch(text) if len(text) <= MOST_CHARACTERS else None
    return found[2] if found else ""


def units_in(plain: object) -> Iterator[str]:
    """The units of all quantities in nested lists and mappings.

    >>> list(units_in({"mass": "3 kg", "points": [["20 mm", 0], ["l / 2", "5 um"]]}))
    ['kg', 'mm', 'um']
    """
    if isinstance(plain, str):
        yield from filter(None, [unit_of_quantity(plain)])
    elif isinstance(plain, Mapping):
        for value in plain.values():
            yield from units_in(value)
    elif isinstance(plain, list | tuple):
        for value in plain:
            yield from units_in(value)


def why_not(value: object, unit: str) -> str:
    """Why a text is no quantity of a unit, to follow the problem; empty for anything else than a quantity.

    >>> why_not("5 kg", "m"), why_not(None, "m")
    (': "kg" is not of the dimension of [m]; it may be given in m, mm, um, km', '')
    """
    if isinstance(value, str) and is_quantity(value):
        try:
            convert(value, unit)
        except UnitError as error:
            return f": {error}"
    return ""


def misfit(unit: str, wanted: str) -> str:
    """What is wrong with numbers in one unit where another one is wanted; empty if nothing is known to be.

    >>> misfit("mm", "m"), misfit("mm", "no known unit")
    ('', '')
    """
    accepted = _dimensions_of(wanted)
    own = _dimension_of(unit) if unit else None
    if not accepted or own is None or any(own.fits(one) for one in accepted):
        return ""
    return f"is in {unit}, which is not of the dimension of [{wanted}]{_fitting(unit, wanted, accepted)}"


def size_of(unit: str) -> float:
    """A unit in SI units; 1 for what is no known one.

    >>> size_of("mm"), size_of("N m"), size_of("-")
    (0.001, 1.0, 1.0)
    """
    return 1.0 if _dimension_of(unit) in (None, _ONE) else convert(f"1 {unit}", unit)


def same_kind(written: str, unit: str) -> bool:
    """Whether a unit that someone wrote stands for the SI unit; a torque in N mm is no energy in J.

    >>> same_kind("mm/s^2", "m/s²"), same_kind("N mm", "J"), same_kind("rpm", "rad/s"), same_kind("%", "-")
    (True, False, True, True)
    """
    return _plain(si_unit(written)) == _plain(unit)


def _plain(unit: str) -> str:
    return " ".join(unit.translate(_RAISED).replace("*", " ").replace("^", "").split())


def quantity_meant(text: str) -> str:
    """A quantity with the space that ``"20um"`` lacks; empty for any other text.

    >>> quantity_meant("20um"), quantity_meant("2*a"), quantity_meant("1e-3")
    ('20 um', '', '')
    """
    found = _GLUED.fullmatch(text) if len(text) <= MOST_CHARACTERS else None
    if found is None:
        return ""
    try:
        parse_unit(found[2])
    except UnitError:
        return ""
    return f"{found[1]} {found[2]}"


def parse_unit(text: str) -> Unit:
    """The unit that a text such as ``"N m/rad"``, ``"kg*m^2"`` or ``"m/s2"`` stands for, or a UnitError.

    Spaces or ``*`` multiply, what follows one ``/`` divides. Degrees and revolutions have no powers.
    """
    above, *below = _RPM.sub("rpm", text.translate(_RAISED)).split("/")
    if len(below) > 1:
        raise UnitError(f'"{text}" divides twice; write all that divides behind one "/"')
    scale, powers = Fraction(1), [Fraction(0)] * len(_ONE)
    angular: list[str] = []
    for part, sign in [(above, 1), *((piece, -1) for piece in below)]:
        part = part.strip().removeprefix("(").removesuffix(")")
        for word in part.replace("*", " ").split():
            found = _FACTOR.fullmatch(word)
            symbol = found[1] if found else word
            if found is None or symbol not in UNITS:
                if (word, part, sign) == ("1", above.strip(), 1):
                    continue
                raise UnitError(f'unknown unit "{symbol}"', _near(symbol, UNITS))
            power = sign * Fraction(found[2] or 1)
            if abs(power) > 12:
                raise UnitError(f'"{word}" has a power above 12')
            unit = UNITS[symbol]
            if unit.angular:
                angular.append(unit.angular if power == 1 else f"1/{unit.angular}")
                if power not in (1, -1) or len(angular) > 1 or angular[0] not in _FACTORS:
                    raise UnitError(f'"{symbol}" stands in "{text}" with a power; use rad')
            # A fractional power, as in N/mm^1.5, has no exact rational scale.
            whole = power.denominator == 1
            scale *= unit.scale ** int(power) if whole else Fraction(float(unit.scale) ** float(power))
            powers = [one + power * other for one, other in zip(powers, unit.dimension, strict=True)]
    return Unit(scale, Dimension(*powers), "".join(angular))


def convert(text: str, unit: str) -> float:
    """A quantity, as ``"20 um"``, in the SI unit of its place, as ``"m"`` or ``"rad or m"``; else a
    UnitError.

    ``"unit"`` and whatever else is no known unit accepts any dimension, ``"-"`` a plain ratio.

    >>> convert("20 um", "m"), convert("180 deg", "rad") == math.pi
    (2e-05, True)
    """
    found = _QUANTITY.fullmatch(text) if len(text) <= MOST_CHARACTERS else None
    if found is None:
        raise UnitError("is no number with a unit")
    wanted = _dimensions_of(unit)
    try:
        given = parse_unit(found[2])
    except UnitError as error:
        # Units of the place, rather than any that has a similar symbol.
        hint = _fitting(found[2], unit, wanted) if wanted else ""
        meant = _arithmetic(found)
        raise (UnitError(meant) if meant else UnitError(error.message, hint or error.hint)) from None
    if wanted and not any(given.dimension.fits(one) for one in wanted):
        if _SPEED not in wanted or found[2].strip() not in ("Hz", "kHz"):
            hint = _fitting(found[2], unit, wanted)
            if given.dimension == _FREQUENCY and _SPEED in wanted:
                hint = (
                    " of an angular velocity: say what is counted, turns in rpm, rev/s or Hz, angles in rad/s"
                )
                raise UnitError(f'"{found[2]}" is not the unit', hint)
            raise UnitError(f'"{found[2]}" is not of the dimension of [{unit}]{hint}')
        given = given._replace(angular="rev")  # cycles, of which each is a turn
    try:
        number = Decimal(found[1])
    except InvalidOperation:  # pragma: no cover (the pattern lets only numbers through)
        raise UnitError("is no number with a unit") from None
    value = _rounded(Fraction(number) * given.scale)
    if not math.isfinite(value):
        raise UnitError("is too large a number")
    return _FACTORS[given.angular](value)


def _arithmetic(found: re.Match[str]) -> str:
    """What to write for a quantity inside an expression, as in ``"20 mm - lash"``; empty for others."""
    split = re.fullmatch(r"([^+*-]*?)\s*([+*-])\s*(.*)", found[2])
    try:
        number = convert(f"{found[1]} {split[1]}", "unit") if split else None
    except UnitError:
        number = None
    if split is None or number is None:
        return ""
    return (
        "a quantity stands alone, and numbers of expressions are in SI units: give "
        f'"{found[1]} {split[1]}" a name in [parameters], or write "{number!r} {split[2]} {split[3]}"'
    )


def _fitting(text: str, unit: str, wanted: list[Dimension]) -> str:
    """Units of the wanted dimension to suggest: the one with the nearest name, or some."""
    known = [one for one in (*UNITS, *_COMPOUND) if _dimension_of(one) in wanted]
    if _dimension_of(text) is None:
        meant = _near(text, known)
    else:  # rightly written: as a mass for its weight, or something else than is wanted
        weight = re.sub(r"\b(lb|kg)\b", r"\1f", text)
        meant = suggested([weight] if _dimension_of(weight) in wanted else ())
    return meant or (f"; it may be given in {', '.join(known[:4])}" if known else "")


def _near(text: str, known: Iterable[str]) -> str:
    """The unit that a wrong one may be; both of mN and MN."""
    names = list(known)
    same = [one for one in names if one.lower() == text.lower()]
    return suggested(same) if len(same) > 1 else did_you_mean(text, names)


def written(value: float, unit: str) -> str:
    """A number in SI units as it is read: in its own unit, which may be empty, with six digits.

    >>> written(0.12, "mm"), written(0.5 * math.pi, "deg"), written(0.5, "")
    ('120 mm', '90 deg', '0.5')
    """
    if not unit:
        return f"{value:.6g}"
    parsed = parse_unit(unit)
    return f"{value / (_FACTORS[parsed.angular](1.0) * float(parsed.scale)):.6g} {unit}"


# What a symbol becomes in SI units; those of one size are there already.
_BASES = {"rpm": "rad/s", "%": "-", "Nmm": "N m", "kNm": "N m", "P": "Pa s", "cP": "Pa s"}


def si_unit(unit: str) -> str:
    """The SI unit of what is written in another one; empty if there is none.

    >>> si_unit("um"), si_unit("N/mm^1.5"), si_unit("g mm2"), si_unit("rpm"), si_unit("N m s/deg")
    ('m', 'N/m^1.5', 'kg m2', 'rad/s', 'N m s/rad')
    """
    unit = _RPM.sub("rpm", unit)
    if "rpm" in unit and unit.strip() != "rpm":
        return ""  # revolutions would divide twice
    try:
        parse_unit(unit)
    except UnitError:
        return ""
    return re.sub(r"[^\W\d_]+|[%\u00b0]", lambda symbol: _base(symbol[0]), unit.translate(_RAISED))


def _base(symbol: str) -> str:
    """The symbol of the SI unit of the same dimension."""
    own = UNITS[symbol]
    if symbol in _BASES or (own.scale == 1 and not own.angular):
        return _BASES.get(symbol, symbol)
    if own.angular or own.dimension == _ONE:
        return "rad"
    alike = (name for name, one in UNITS.items() if one.dimension == own.dimension)
    return next((name for name in alike if UNITS[name].scale == 1), symbol)


def _rounded(value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _dimensions_of(unit: str) -> list[Dimension]:
    """Dimensions that a place accepts, as one in ``"rad or m"``; none where any is."""
    return [one for one in map(_dimension_of, unit.split(" or ")) if one is not None]


def _dimension_of(unit: str) -> Dimension | None:
    if unit.strip() in ("-", "1"):
        return _ONE
    try:
        return parse_unit(unit).dimension
    except UnitError:
        return None
