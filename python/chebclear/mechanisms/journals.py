"""Single bodies in a bearing with play: a pendulum and a free journal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Unpack

from ..base.arguments import as_number
from ..scene.forces import Gravity
from ..scene.parts import Body
from ..scene.scene import Scene
from .joints import PinOptions, Play, checked, with_pins


@with_pins
def pendulum_in_bearing(
    *,
    length: float = 0.20,
    mass: float = 0.50,
    inertia: float = 1e-3,
    angle: float = 0.5,
    gravity: float = 9.81,
    clearance_at: Sequence[str] = ("pivot",),
    **options: Unpack[PinOptions],
) -> Scene:
    """A pendulum whose journal has play in a fixed bearing, released at rest.

    ::

            ===[o]===  pivot
                |\\
                | \\              y
                |__\\ angle       |__ x
                    \\
                     O  center of mass

    The body is ``pendulum``, the joint is ``pivot`` (bearing on ground, journal on the pendulum). An ideal
    pendulum swings as φ'' = -m g l sin φ / (inertia + m l²). The contact is that of Table 2 of Xiang et al.
    (2020); the numbers of the pendulum are chosen, from no source.

    Parameters
    ----------
    length : float
        From the center of the journal to the center of mass [m].
    mass, inertia : float
        Mass [kg], and moment of inertia about the center of mass [kg m²].
    angle : float
        Angle at the start from hanging straight down, counter-clockwise [rad].
    gravity : float
        Acceleration of free fall against y [m/s²].
    clearance_at : sequence of str
        ``("pivot",)``, or none for an ideal pivot.
    {pins}

    Returns
    -------
    Scene
        The outputs ``pendulum.x`` and ``pendulum.y`` are those of the center of mass; ``pendulum.angle`` is
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
    arguments, shared = checked(pendulum_in_bearing, locals())
    clearances = arguments.places(clearance_at, shared.clearance, ("pivot",))
    arguments.finish()
    play = Play(clearances, shared)
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


@with_pins
def free_journal(
    *,
    mass: float = 0.14,
    inertia: float | None = None,
    load_x: float = 0.0,
    load_y: float = 0.0,
    gravity: float = 9.81,
    **options: Unpack[PinOptions],
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
        Moment of inertia about the center [kg m²]; that of a uniform disc of the journal's radius if not
        given.
    load_x, load_y : float
        Constant force on the center, besides the weight [N].
    gravity : float
        Acceleration of free fall against y [m/s²].
    {pins}

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
    arguments, shared = checked(free_journal, locals(), "mass")
    arguments.number("clearance", shared.clearance, "m")
    arguments.finish()
    play = Play({"bearing": as_number(shared.clearance) or 0.0}, shared)
    if inertia is None:
        inertia = 0.5 * float(mass) * float(shared.journal_radius) ** 2
    acceleration = (float(load_x) / float(mass), float(load_y) / float(mass) - float(gravity))
    return Scene(
        ground={"O": (0.0, 0.0)},
        bodies=[Body("journal", mass=mass, inertia=inertia, points={"O": (0.0, 0.0)})],
        joints=[play.pin("bearing", "ground.O", "journal.O")],
        forces=[Gravity(acceleration)] if any(acceleration) else [],
    )
