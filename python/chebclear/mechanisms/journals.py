"""Single bodies in a bearing with play: a pendulum and a free journal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from ..base.arguments import as_number
from ..scene.scene import Body, ContactLaw, FrictionLaw, Gravity, Scene
from .joints import TABLE_2_FRICTION, Arguments, Play


def pendulum_in_bearing(
    *,
    length: float = 0.20,
    mass: float = 0.50,
    inertia: float = 1e-3,
    angle: float = 0.5,
    gravity: float = 9.81,
    clearance: float | Mapping[str, float] = 2e-5,
    clearance_at: Sequence[str] = ("pivot",),
    journal_radius: float = 9.8e-3,
    young_modulus: float = 207e9,
    poisson_ratio: float = 0.3,
    restitution: float = 0.9,
    contact: ContactLaw | None = None,
    friction: FrictionLaw | None = TABLE_2_FRICTION,
    sliding: str | None = None,
    impact_velocity_floor: float | None = None,
) -> Scene:
    """A pendulum whose journal has play in a fixed bearing, released at rest.

    ::

            ===[o]===  pivot
                |\\
                | \\              y
                |__\\ angle       |__ x
                    \\
                     O  centre of mass

    The body is ``pendulum``, the joint is ``pivot`` (bearing on ground, journal on the pendulum). An ideal
    pendulum swings as φ'' = -m g l sin φ / (inertia + m l²). The contact is that of Table 2 of Xiang et al.
    (2020); the numbers of the pendulum are chosen, from no source.

    Parameters
    ----------
    length : float
        From the centre of the journal to the centre of mass [m].
    mass : float
        Mass [kg].
    inertia : float
        Moment of inertia about the centre of mass [kg m²].
    angle : float
        Angle at the start from hanging straight down, counter-clockwise [rad].
    gravity : float
        Acceleration of free fall against y [m/s²].
    clearance : float or mapping of str to float
        Radial clearance [m].
    clearance_at : sequence of str
        ``("pivot",)``, or none for an ideal pivot.
    journal_radius, young_modulus, poisson_ratio, restitution, contact, friction : optional
        Contact of the pivot, as for `slider_crank` [m], [Pa], [-], [-].
    sliding, impact_velocity_floor : optional
        As for `ClearanceRevolute`; the floor in [m/s].

    Returns
    -------
    Scene
        The outputs ``pendulum.x`` and ``pendulum.y`` are those of the centre of mass; ``pendulum.angle`` is
        that from x to the arm, `angle` - π/2 at the start.

    Raises
    ------
    SceneError
        If an argument is no number or out of range; all are listed.

    Examples
    --------
    >>> pendulum_in_bearing().check().degrees_of_freedom
    3
    """
    arguments = Arguments()
    arguments.positive(
        length=(length, "m"),
        mass=(mass, "kg"),
        inertia=(inertia, "kg m²"),
        journal_radius=(journal_radius, "m"),
        young_modulus=(young_modulus, "Pa"),
    )
    arguments.numbers(
        angle=angle,
        gravity=gravity,
        poisson_ratio=poisson_ratio,
        restitution=restitution,
    )
    clearances = arguments.places(clearance_at, clearance, ("pivot",))
    arguments.finish()
    play = Play(
        clearances,
        journal_radius,
        young_modulus,
        poisson_ratio,
        restitution,
        contact,
        friction,
        sliding,
        impact_velocity_floor,
    )
    return Scene(
        ground={"O": (0.0, 0.0)},
        bodies=[
            Body(
                "pendulum",
                mass=mass,
                inertia=inertia,
                center_of_mass=(length, 0.0),
                points={"O": (0.0, 0.0)},
                angle=(as_number(angle) or 0.0) - 0.5 * math.pi,
            )
        ],
        joints=[play.pin("pivot", "ground.O", "pendulum.O")],
        forces=[Gravity((0.0, -gravity))] if gravity else [],
    )


def free_journal(
    *,
    mass: float = 0.14,
    inertia: float | None = None,
    load_x: float = 0.0,
    load_y: float = 0.0,
    gravity: float = 9.81,
    clearance: float = 2e-5,
    journal_radius: float = 9.8e-3,
    young_modulus: float = 207e9,
    poisson_ratio: float = 0.3,
    restitution: float = 0.9,
    contact: ContactLaw | None = None,
    friction: FrictionLaw | None = TABLE_2_FRICTION,
    sliding: str | None = None,
    impact_velocity_floor: float | None = None,
) -> Scene:
    """A journal that nothing holds but its fixed bearing: it falls, bounces and comes to rest.

    ::

               _______
             /   ___   \\
            |  /     \\  |  clearance all round
            | | journal| |           y
            |  \\ ___ /  |           |__ x
             \\ _______ /
               bearing     | load, gravity
                           v

    The body is ``journal``, the joint is ``bearing`` (bearing on ground). It starts at rest in the middle. At
    rest under a load F it lies at a penetration of (F / K)^(2/3). The sizes and the contact are those of
    Table 2 of Xiang et al. (2020), the mass is that of their slider.

    Parameters
    ----------
    mass : float
        Mass [kg].
    inertia : float, optional
        Moment of inertia about the centre [kg m²]; that of a uniform disc of the journal's radius if not
        given.
    load_x, load_y : float
        Constant force on the centre, besides the weight [N].
    gravity : float
        Acceleration of free fall against y [m/s²].
    clearance : float
        Radial clearance [m].
    journal_radius, young_modulus, poisson_ratio, restitution, contact, friction : optional
        Contact, as for `slider_crank` [m], [Pa], [-], [-].
    sliding, impact_velocity_floor : optional
        As for `ClearanceRevolute`; the floor in [m/s].

    Returns
    -------
    Scene
        The load enters as an acceleration of free fall, which for a single body is the same.

    Raises
    ------
    SceneError
        If an argument is no number or out of range; all are listed.

    Examples
    --------
    >>> free_journal().check().degrees_of_freedom
    3
    """
    arguments = Arguments()
    arguments.positive(
        mass=(mass, "kg"),
        journal_radius=(journal_radius, "m"),
        young_modulus=(young_modulus, "Pa"),
    )
    if inertia is not None:
        arguments.positive(inertia=(inertia, "kg m²"))
    arguments.numbers(
        load_x=load_x,
        load_y=load_y,
        gravity=gravity,
        clearance=clearance,
        poisson_ratio=poisson_ratio,
        restitution=restitution,
    )
    arguments.finish()
    play = Play(
        {"bearing": clearance},
        journal_radius,
        young_modulus,
        poisson_ratio,
        restitution,
        contact,
        friction,
        sliding,
        impact_velocity_floor,
    )
    if inertia is None:
        inertia = 0.5 * float(mass) * float(journal_radius) ** 2
    acceleration = (float(load_x) / float(mass), float(load_y) / float(mass) - float(gravity))
    return Scene(
        ground={"O": (0.0, 0.0)},
        bodies=[Body("journal", mass=mass, inertia=inertia, points={"O": (0.0, 0.0)})],
        joints=[play.pin("bearing", "ground.O", "journal.O")],
        forces=[Gravity(acceleration)] if any(acceleration) else [],
    )
