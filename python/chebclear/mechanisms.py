"""Ready-made mechanisms, and the stiffness of a contact between a journal and its bearing."""

from __future__ import annotations

import math

from .checks import Checks, as_number
from .errors import Problem, SceneError
from .scene import (
    Body,
    ClearanceRevolute,
    FrictionLaw,
    Gravity,
    LankaraniNikravesh,
    ModifiedCoulomb,
    Prismatic,
    Revolute,
    Scene,
    Speed,
    rpm,
)

_TABLE_2_FRICTION = ModifiedCoulomb(0.04, 0.03, 1e-3, 1.5e-3)
_TABLE_2_SPEED = rpm(2000.0)


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
    checks = Checks()
    checks.real("journal_radius", journal_radius, "m", above=0.0)
    checks.real("clearance", clearance, "m", above=0.0)
    checks.word("convention", convention, ("hertz", "as_printed"))
    materials = [("", young_modulus, poisson_ratio)]
    if bearing_young_modulus is not None or bearing_poisson_ratio is not None:
        other_modulus = young_modulus if bearing_young_modulus is None else bearing_young_modulus
        other_ratio = poisson_ratio if bearing_poisson_ratio is None else bearing_poisson_ratio
        materials.append(("bearing_", other_modulus, other_ratio))
    for prefix, modulus, ratio in materials:
        checks.real(f"{prefix}young_modulus", modulus, "Pa", above=0.0)
        checks.real(f"{prefix}poisson_ratio", ratio, "-", above=-1.0, below=1.0)
    checks.finish()
    return _stiffness(journal_radius, clearance, materials[0][1:], materials[-1][1:], convention)


def slider_crank(
    *,
    crank_length: float = 0.05,
    rod_length: float = 0.12,
    clearance: float = 2e-5,
    crank_speed: float = _TABLE_2_SPEED,
    crank_angle: float = 0.0,
    crank_mass: float = 0.30,
    rod_mass: float = 0.21,
    slider_mass: float = 0.14,
    slider_inertia: float = 1e-4,
    journal_radius: float = 9.8e-3,
    young_modulus: float = 207e9,
    poisson_ratio: float = 0.3,
    restitution: float = 0.9,
    friction: FrictionLaw | None = _TABLE_2_FRICTION,
    gravity: float = 0.0,
    sliding: str | None = None,
    convention: str = "corrected",
    impact_velocity_floor: float | None = None,
) -> Scene:
    """The paper's slider-crank: a crank at constant speed, with play in the pin between rod and slider.

    The bodies are ``crank``, ``rod`` and ``slider``. The joints are ``crank_bearing`` (ground and crank),
    ``crank_pin`` (crank and rod), ``guide`` (ground and slider, along x) and ``wrist`` (bearing on the rod,
    journal on the slider). The drive is ``drive``. Masses do not change with the lengths; inertias do.

    Parameters
    ----------
    crank_length, rod_length : float
        Distances between the pins [m].
    clearance : float
        Radial clearance of the wrist [m].
    crank_speed : float
        Angular velocity of the crank [rad/s]; 2000 revolutions per minute if not given.
    crank_angle : float
        Angle of the crank at time zero [rad]; 0 with the slider farthest out.
    crank_mass, rod_mass, slider_mass : float
        Masses [kg]; crank and rod are slender and uniform.
    slider_inertia : float
        Moment of inertia of the slider about its centre of mass [kg m²].
    journal_radius : float
        Radius of the journal of the wrist [m].
    young_modulus, poisson_ratio : float
        Material of journal and bearing [Pa], [-].
    restitution : float
        Nominal coefficient of restitution [-]; see `LankaraniNikravesh`.
    friction : ModifiedCoulomb or None
        Friction law of the wrist; the paper's Table 2 if not given.
    gravity : float
        Acceleration of free fall against y [m/s²].
    sliding : {"surface", "contact_point"}, optional
        Sliding velocity of the wrist, see `ClearanceRevolute`; that of the convention if not given.
    convention : {"corrected", "as_printed"}
        ``"corrected"``: sliding velocity of the material surfaces, Hertz's stiffness with σ = (1 - ν²) / E,
        and the inertia m l² / 12 of crank and rod about their centres of mass. ``"as_printed"`` follows the
        paper to the letter and with it three errata: the contact-point sliding velocity of Eqs. (5) and (6),
        which misses the rotation of the bodies; σ = (1 - ν²) / (π E) of Eq. (9), π times too stiff; and the
        inertia m l² / 3 about the end of a rod, of Table 1 and Eq. (35), used about its centre of mass.
    impact_velocity_floor : float, optional
        Least impact velocity that the contact law latches [m/s]; from the scales of the scene if not given.

    Returns
    -------
    Scene
        Further checks, as of the clearance, are made when it is checked or simulated.

    Raises
    ------
    SceneError
        If an argument is no number, or a length, mass, radius or modulus is not finite and above 0; all are
        listed.
    ValueError, TypeError
        If the convention is unknown.
    """
    problems: list[Problem] = []
    _require_positive(
        problems,
        crank_length=(crank_length, "m"),
        rod_length=(rod_length, "m"),
        crank_mass=(crank_mass, "kg"),
        rod_mass=(rod_mass, "kg"),
        slider_mass=(slider_mass, "kg"),
        slider_inertia=(slider_inertia, "kg m²"),
        journal_radius=(journal_radius, "m"),
        young_modulus=(young_modulus, "Pa"),
    )
    _require_numbers(
        problems,
        clearance=clearance,
        crank_speed=crank_speed,
        crank_angle=crank_angle,
        poisson_ratio=poisson_ratio,
        restitution=restitution,
        gravity=gravity,
    )
    if problems:
        raise SceneError(problems)
    crank_length, rod_length = float(crank_length), float(rod_length)
    crank_mass, rod_mass = float(crank_mass), float(rod_mass)
    start = as_number(crank_angle) or 0.0
    checks = Checks()
    checks.word("convention", convention, ("corrected", "as_printed"))
    checks.finish()

    as_printed = convention == "as_printed"
    inertia_divisor = 3.0 if as_printed else 12.0  # Table 1, Eq. (35): 3
    material = (young_modulus, poisson_ratio)
    stiffness = _stiffness(
        journal_radius, clearance, material, material, "as_printed" if as_printed else "hertz"
    )
    # Where the ideal mechanism has the rod. If the rod is too short to reach, the assembly will say so.
    rise = -crank_length / rod_length * math.sin(start) if math.isfinite(start) else 0.0
    rod_angle = math.asin(rise) if abs(rise) <= 1.0 else 0.0
    return Scene(
        ground={"O": (0.0, 0.0)},
        bodies=[
            Body(
                "crank",
                mass=crank_mass,
                inertia=crank_mass * crank_length * crank_length / inertia_divisor,
                center_of_mass=(0.5 * crank_length, 0.0),
                points={"A": (0.0, 0.0), "B": (crank_length, 0.0)},
                angle=crank_angle,
            ),
            Body(
                "rod",
                mass=rod_mass,
                inertia=rod_mass * rod_length * rod_length / inertia_divisor,
                center_of_mass=(0.5 * rod_length, 0.0),
                points={"B": (0.0, 0.0), "C": (rod_length, 0.0)},
                angle=rod_angle,
            ),
            Body("slider", mass=slider_mass, inertia=slider_inertia, points={"C": (0.0, 0.0)}),
        ],
        joints=[
            Revolute("crank_bearing", "ground.O", "crank.A"),
            Revolute("crank_pin", "crank.B", "rod.B"),
            Prismatic("guide", "ground.O", "slider.C", axis=(1.0, 0.0)),
            ClearanceRevolute(
                "wrist",
                bearing="rod.C",
                journal="slider.C",
                journal_radius=journal_radius,
                clearance=clearance,
                contact=LankaraniNikravesh(stiffness, restitution),
                friction=friction,
                sliding=sliding or ("contact_point" if as_printed else "surface"),
                impact_velocity_floor=impact_velocity_floor,
            ),
        ],
        forces=[Gravity((0.0, -gravity))] if gravity else [],
        drives=[Speed("drive", "crank_bearing", crank_speed, angle=crank_angle)],
    )


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
        compliance = sum(
            (1.0 - float(ratio) ** 2) / float(modulus)
            for modulus, ratio in (journal_material, bearing_material)
        )
        if convention == "as_printed":
            compliance /= math.pi  # Eq. (9)
        # The difference of the radii is the clearance; forming it from the radii would lose its last digits.
        return 4.0 / (3.0 * compliance) * math.sqrt(radius * (radius + gap) / gap)
    except (ZeroDivisionError, ValueError, OverflowError):
        return math.nan


def _require_numbers(problems: list[Problem], **arguments: object) -> None:
    """Note the arguments that are no numbers."""
    problems += [
        Problem(name, f"must be a number, got {value!r}")
        for name, value in arguments.items()
        if as_number(value) is None
    ]


def _require_positive(problems: list[Problem], **arguments: tuple[object, str]) -> None:
    """Note the arguments that are no finite numbers above 0; each comes with its unit."""
    for name, (value, unit) in arguments.items():
        number = as_number(value)
        if number is None:
            problems.append(Problem(name, f"must be a number, got {value!r}"))
        elif not (math.isfinite(number) and number > 0.0):
            problems.append(Problem(name, f"must be a finite number > 0 [{unit}], got {value!r}"))
