"""What the ready-made mechanisms share: pins with or without play, their stiffness, checks of arguments."""

from __future__ import annotations

import functools
import inspect
import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypedDict, TypeVar, cast

from ..base.arguments import Checks, as_number
from ..base.options import with_fields
from ..base.shown import did_you_mean, meant_or_known
from ..base.units import convert, is_quantity, why_not
from ..errors import ArgumentTypeError, SceneError, warn
from ..scene.laws import ContactLaw, FrictionLaw, LankaraniNikravesh, ModifiedCoulomb
from ..scene.parts import Body, ClearanceRevolute, Revolute
from ..scene.scene import Scene

Mechanism = TypeVar("Mechanism", bound=Callable[..., Scene])

TABLE_2_FRICTION = ModifiedCoulomb(0.04, 0.03, 1e-3, 1.5e-3)
"""Friction of the paper's Table 2."""


def hertz_stiffness(
    journal_radius: float,
    clearance: float,
    young_modulus: float,
    poisson_ratio: float,
    convention: str = "hertz",
    *,
    bearing_young_modulus: float | None = None,
    bearing_poisson_ratio: float | None = None,
) -> float:
    """Stiffness of the contact between a journal and its bearing, Eq. (8).

    K = 4 / (3 (σ_J + σ_B)) √(R_J R_B / (R_B - R_J)) with R_B = R_J + clearance.

    Parameters
    ----------
    journal_radius : float
        Radius of the journal [m].
    clearance : float
        Radial clearance [m].
    young_modulus : float
        Young's modulus of the journal, and of the bearing unless given [Pa].
    poisson_ratio : float
        Poisson's ratio of the journal, and of the bearing unless given [-]; above -1 and below 1.
    convention : {"hertz", "as_printed"}
        ``"hertz"`` has σ = (1 - ν²) / E; ``"as_printed"`` has σ = (1 - ν²) / (π E) of the paper's Eq. (9),
        which makes the stiffness π times that of Hertz.
    bearing_young_modulus, bearing_poisson_ratio : float, optional
        Of the bearing [Pa], [-], if it is of another material.

    Returns
    -------
    float
        Stiffness for an exponent of 1.5 [N/m^1.5].

    Raises
    ------
    ValueError, TypeError
        If a number is out of range; all problems are listed.

    Examples
    --------
    >>> f"{hertz_stiffness(9.8e-3, 2e-5, 207e9, 0.3):.6e}"
    '3.326530e+11'
    """
    checks = Checks()  # the core never sees these numbers, but the stiffness alone
    journal_radius = checks.real("journal_radius", journal_radius, "m", above=0.0)
    clearance = checks.real("clearance", clearance, "m", above=0.0)
    checks.word("convention", convention, ("hertz", "as_printed"))
    materials = [("", young_modulus, poisson_ratio)]
    if bearing_young_modulus is not None or bearing_poisson_ratio is not None:
        other_modulus = young_modulus if bearing_young_modulus is None else bearing_young_modulus
        other_ratio = poisson_ratio if bearing_poisson_ratio is None else bearing_poisson_ratio
        materials.append(("bearing_", other_modulus, other_ratio))
    pairs = []
    for prefix, modulus, ratio in materials:
        modulus = checks.real(f"{prefix}young_modulus", modulus, "Pa", above=0.0)
        ratio = checks.real(f"{prefix}poisson_ratio", ratio, "-", above=-1.0, below=1.0)
        pairs.append((modulus, ratio))
    checks.finish()
    return _stiffness(journal_radius, clearance, pairs[0], pairs[-1], convention)


def _stiffness(
    journal_radius: float,
    clearance: float,
    journal_material: tuple[float, float],
    bearing_material: tuple[float, float],
    convention: str,
) -> float:
    """Eq. (8); not a finite number where it has none, which the check of the scene then reports."""
    try:
        radius, gap = float(journal_radius), float(clearance)
        (modulus, ratio), (bearing_modulus, bearing_ratio) = journal_material, bearing_material
        compliance = (1.0 - float(ratio) ** 2) / float(modulus)
        compliance += (1.0 - float(bearing_ratio) ** 2) / float(bearing_modulus)
        if convention == "as_printed":
            compliance /= math.pi  # Eq. (9)
        # The difference of the radii is the clearance; forming it from the radii would lose its last digits.
        return 4.0 / (3.0 * compliance) * math.sqrt(radius * (radius + gap) / gap)
    except (ZeroDivisionError, ValueError, OverflowError):
        return math.nan


UNITS = {
    **dict.fromkeys(("load_x", "load_y"), "N"),
    **dict.fromkeys(("poisson_ratio", "restitution"), "-"),
    "angle": "rad",
    "clearance": "m",
    "gravity": "m/s²",
    "height": "m",
    "impact_velocity_floor": "m/s",
    "inertia": "kg m²",
    "journal_radius": "m",
    "length": "m",
    "mass": "kg",
    "pivot_distance": "m",
    "point_x": "m",
    "point_y": "m",
    "pivot_x": "m",
    "pivot_y": "m",
    "speed": "rad/s",
    "young_modulus": "Pa",
}
"""Units of the numbers that a mechanism takes, by their names or what these end in."""


@functools.cache
def unit_of(name: str) -> str:
    """Unit of an argument: ``crank_length`` is a length, ``clearance.wrist`` a clearance; empty if unknown.

    >>> unit_of("crank_length"), unit_of("clearance.wrist"), unit_of("clearance_at")
    ('m', 'm', '')
    """
    name = name.partition(".")[0]
    return UNITS.get(name) or next((unit for end, unit in UNITS.items() if name.endswith(f"_{end}")), "")


class Arguments(Checks):
    """The checks of a mechanism's arguments: those of any call, and where its pins have clearance."""

    def __init__(self) -> None:
        super().__init__(SceneError)

    def positive(self, name: str, value: object) -> None:
        """Note what is no finite number above 0.

        For what the core never sees, or sees only what a formula makes of it.
        """
        # Nearly all are as they should be, and studies make thousands of scenes.
        if type(value) is not float or not 0.0 < value < math.inf:
            self.real(name, value, unit_of(name), above=0.0)

    def places(
        self, chosen: object, clearance: object, pins: Sequence[str], driven: str | None = None
    ) -> dict[str, float]:
        """The clearance of every pin in `clearance_at`; notes names and numbers that are wrong.

        `pins` are the names that may have clearance, `driven` is one that must not.
        """
        # An abstract class alone takes a microsecond to answer.
        listed = type(chosen) is tuple or (
            isinstance(chosen, Iterable) and not isinstance(chosen, (str, Mapping))
        )
        names: list[object] = list(chosen) if listed else [chosen]  # type: ignore[call-overload]
        for index, name in enumerate(names):
            before = [one for one in names[:index] if isinstance(one, str)]
            if isinstance(name, str) and name in pins and name not in before:
                continue
            choices = ", ".join(f'"{pin}"' for pin in pins)
            what = f"must name pins, each once, of {choices}, or be () for none, got {name!r}"
            if isinstance(name, str) and name == driven:
                what += ": the angle of this one is prescribed, and where a journal moves there is none"
            self.add("clearance_at", what)
        known = [name for name in names if isinstance(name, str) and name in pins]
        if type(clearance) is float or not isinstance(clearance, Mapping):
            if known:
                self.positive("clearance", clearance)
            else:
                self.number("clearance", clearance, "m")
            return {name: as_number(clearance) or 0.0 for name in known}
        given = dict(clearance)
        for name in known:
            if name not in given:
                self.add(f"clearance.{name}", "is missing")
        for name, value in given.items():
            if name not in known:
                self.add(f"clearance.{name}", f"has no place in clearance_at{did_you_mean(name, known)}")
            else:
                self.positive(f"clearance.{name}", value)
        return {name: as_number(given.get(name)) or 0.0 for name in known}


class PinOptions(TypedDict, total=False):
    """Fields of `Pins` as keywords of the ready-made mechanisms."""

    clearance: float | Mapping[str, float]
    journal_radius: float
    young_modulus: float
    poisson_ratio: float
    restitution: float
    contact: ContactLaw | None
    friction: FrictionLaw | None
    sliding: str | None
    impact_velocity_floor: float | None


@dataclass(frozen=True, kw_only=True)
class Pins:
    """Common dimensions, material and laws of the pins with clearance of a mechanism.

    The numbers are those of Table 2 of Xiang et al. (2020).

    Parameters
    ----------
    clearance : float or mapping of str to float
        Radial clearance of the pins in `clearance_at` [m]; by name if they differ.
    journal_radius : float
        Radius of the journals [m].
    young_modulus, poisson_ratio : float
        Material of journal and bearing [Pa], [-].
    restitution : float
        Nominal coefficient of restitution [-]; see `LankaraniNikravesh`.
    contact : contact law, optional
        Law of the normal force, see `ClearanceRevolute`; Lankarani and Nikravesh's with Hertz's stiffness,
        from the material and the restitution, if not given.
    friction : ModifiedCoulomb, SmoothedCoulomb, StickSlip or None
        Friction law of the pins with clearance; the paper's Table 2 if not given.
    sliding : {"surface", "contact_point"}, optional
        Sliding velocity of the pins, see `ClearanceRevolute`; of the material surfaces, or that of the
        convention, if not given.
    impact_velocity_floor : float, optional
        Lower bound of the impact velocity in the contact law [m/s]; from the `rtol` of a run if not given.
    """

    clearance: float | Mapping[str, float] = 2e-5
    journal_radius: float = 9.8e-3
    young_modulus: float = 207e9
    poisson_ratio: float = 0.3
    restitution: float = 0.9
    contact: ContactLaw | None = None
    friction: FrictionLaw | None = TABLE_2_FRICTION
    sliding: str | None = None
    impact_velocity_floor: float | None = None


def checked(
    mechanism: Callable[..., Scene], given: Mapping[str, Any], *positive: str
) -> tuple[Arguments, Pins]:
    """The checks of the arguments of a mechanism, its first local variables, and its pins.

    What has a unit must be a number; lengths, and those named, must be above 0.
    """
    for name in given["options"]:
        if name not in PinOptions.__annotations__:
            known = [one for one in inspect.signature(mechanism).parameters if one != "options"]
            raise ArgumentTypeError(f'unknown keyword "{name}"{meant_or_known(name, known)}')
    arguments, pins = Arguments(), Pins(**given["options"])
    defaults = inspect.unwrap(mechanism).__kwdefaults__ or {}
    arguments.positive("journal_radius", pins.journal_radius)
    arguments.positive("young_modulus", pins.young_modulus)
    arguments.number("poisson_ratio", pins.poisson_ratio, "-")
    arguments.number("restitution", pins.restitution, "-")
    for name, value in given.items():
        # Nearly all are as they should be, and studies make thousands of scenes.
        if type(value) is float and 0.0 < value < math.inf:
            continue
        if unit_of(name) and not (value is None and defaults[name] is None):
            if name in positive or name.endswith(("length", "distance")):
                arguments.positive(name, value)
            else:  # the core judges what number it is
                arguments.number(name, value, unit_of(name))
    return arguments, pins


def with_units(mechanism: Mechanism) -> Mechanism:
    """Give a mechanism the units of its numbers, which `Study` asks for, and let it take texts with units."""

    @functools.wraps(mechanism)
    def built(**given: Any) -> Scene:
        # Nearly always all are numbers, and studies make thousands of scenes.
        if not _WITH_TEXTS.isdisjoint(map(type, given.values())):
            given = {name: _in_si(name, value) for name, value in given.items()}
        return mechanism(**given)

    vars(built)["unit_of"] = unit_of
    return cast(Mechanism, built)


# Types of what may hold texts with units.
_WITH_TEXTS = frozenset({str, dict})


def _in_si(name: str, value: Any) -> Any:
    """A text with the unit of an argument as a number in SI units; anything else, to be judged, as it is."""
    if isinstance(value, Mapping):
        return {key: _in_si(name, one) for key, one in value.items()}
    unit = unit_of(name)
    if unit and isinstance(value, str) and not why_not(value, unit) and is_quantity(value):
        return convert(value, unit)
    return value


def with_pins(mechanism: Mechanism) -> Mechanism:
    """Give a mechanism the keywords of its pins, their documentation, and the units of its numbers."""
    return with_units(with_fields(Pins, PinOptions, "{pins}")(mechanism))


@dataclass(frozen=True)
class Play:
    """Which pins of a mechanism have clearance, and what those share."""

    clearances: Mapping[str, float]
    pins: Pins
    convention: str = "hertz"

    def pin(self, name: str, a: str, b: str, *, journal: str = "b") -> Revolute | ClearanceRevolute:
        """A pin between points a and b, ideal or with play; the journal is on the body of `journal`."""
        if name not in self.clearances:
            return Revolute(name, a, b)
        clearance, pins = self.clearances[name], self.pins
        contact = pins.contact
        if contact is None:
            material = (pins.young_modulus, pins.poisson_ratio)
            stiffness = _stiffness(pins.journal_radius, clearance, material, material, self.convention)
            contact = LankaraniNikravesh(stiffness, pins.restitution)
        bearing, center = (a, b) if journal == "b" else (b, a)
        printed = self.convention == "as_printed"
        return ClearanceRevolute(
            name,
            bearing=bearing,
            journal=center,
            journal_radius=pins.journal_radius,
            clearance=clearance,
            contact=contact,
            friction=pins.friction,
            sliding=("contact_point" if printed else "surface") if pins.sliding is None else pins.sliding,
            impact_velocity_floor=pins.impact_velocity_floor,
        )


def as_mass(mass: object) -> float:
    """A mass for the formula of an inertia [kg]: 1 where it is none that a body may have.

    The core reports that mass, and one mistake should be one problem.
    """
    number = as_number(mass)
    return number if number is not None and 0.0 <= number < math.inf else 1.0


def bar(
    name: str, points: tuple[str, str], length: float, mass: float, angle: float, inertia: float | None = None
) -> Body:
    """A bar along the x axis of its frame, from the first point to the second; if uniform it is slender."""
    return Body(
        name,
        mass=mass,
        inertia=as_mass(mass) * length * length / 12.0 if inertia is None else inertia,
        center_of_mass=(0.5 * length, 0.0),
        points={points[0]: (0.0, 0.0), points[1]: (length, 0.0)},
        angle=angle,
    )


ROUNDING = 8.0 * sys.float_info.epsilon
"""Sums of lengths that differ by this part are equal but for rounding."""


def elbow(
    start: tuple[float, float], end: tuple[float, float], first: float, second: float, side: float
) -> tuple[float, float] | None:
    """Where two bars from `start` and `end` meet, left (+1) or right (-1) of the way from start to end.

    None where the circles of the two lengths do not meet.
    """
    along_x, along_y = end[0] - start[0], end[1] - start[1]
    distance = math.hypot(along_x, along_y)
    if not (math.isfinite(distance) and distance > 0.0):
        return None
    along = (first / distance * first - second / distance * second + distance) / 2.0
    # Lengths as ratios, so that no square overflows.
    ratio = along / first
    if not abs(ratio) <= 1.0 + ROUNDING:
        return None
    across = side * first * math.sqrt(max(0.0, (1.0 - ratio) * (1.0 + ratio)))
    unit_x, unit_y = along_x / distance, along_y / distance
    return (start[0] + along * unit_x - across * unit_y, start[1] + along * unit_y + across * unit_x)


def direction(start: tuple[float, float], end: tuple[float, float] | None) -> float:
    """Angle of the way from start to end [rad]; 0 if there is no end, and the assembly will say so."""
    return 0.0 if end is None else math.atan2(end[1] - start[1], end[0] - start[0])


def on_circle(radius: float, angle: float) -> tuple[float, float]:
    """The point of a circle about the origin; (0, 0) for an angle that the check of the scene refuses."""
    return (radius * math.cos(angle), radius * math.sin(angle)) if math.isfinite(angle) else (0.0, 0.0)


def warn_of_a_jam(mechanism: str, reason: str) -> None:
    """Say that a crank at constant speed cannot turn all the way."""
    warn(
        f"the crank of this {mechanism} cannot make a full turn: {reason}; driven beyond its range it jams: "
        "change the lengths, or end the run before that"
    )
