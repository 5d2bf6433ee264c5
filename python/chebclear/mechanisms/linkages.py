"""Mechanisms of bars and pins: four-bar and six-bar linkages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Unpack

from ..base.arguments import as_number
from ..scene.forces import Gravity
from ..scene.motions import Speed
from ..scene.parts import Body, Revolute
from ..scene.scene import Scene, rpm
from .joints import (
    ROUNDING,
    PinOptions,
    Play,
    as_mass,
    bar,
    checked,
    direction,
    elbow,
    on_circle,
    warn_of_a_jam,
    with_pins,
)

_BRANCHES = ("open", "crossed")


@with_pins
def four_bar(
    *,
    ground_length: float = 0.12,
    crank_length: float = 0.05,
    coupler_length: float = 0.10,
    rocker_length: float = 0.08,
    branch: str = "open",
    clearance_at: Sequence[str] = ("rocker_pin",),
    crank_speed: float = rpm(2000.0),
    crank_angle: float = 0.0,
    crank_mass: float = 0.30,
    coupler_mass: float = 0.21,
    rocker_mass: float = 0.14,
    gravity: float = 0.0,
    **options: Unpack[PinOptions],
) -> Scene:
    """A four-bar linkage: crank, coupler and rocker on ground, the crank at constant speed.

    ::

                                     __o rocker_pin
                     coupler ____----  |
              crank_pin o----          |
                       /               | rocker
                crank /                |
                     /                 |                 y
            ========o==================o=====            |__ x
             crank_bearing       rocker_bearing

    The bodies are ``crank``, ``coupler`` and ``rocker``, all slender and uniform. The joints are
    ``crank_bearing`` (ground and crank, driven), ``crank_pin`` (crank and coupler), ``rocker_pin`` (coupler
    and rocker) and ``rocker_bearing`` (ground and rocker). The drive is ``drive``. With clearance the coupler
    carries the bearings of its pins and the rocker the journals of its own. The lengths are those of the
    crank-rocker in the documentation of Simscape Multibody (MathWorks); the contact is that of Table 2 of
    Xiang et al. (2020), and masses and speed are those of their slider-crank.

    Parameters
    ----------
    ground_length, crank_length, coupler_length, rocker_length : float
        Distances between the pins [m].
    branch : {"open", "crossed"}
        How the linkage is put together: rocker pin to the left or to the right of the way from the crank's
        pin to the rocker's bearing.
    clearance_at : sequence of str
        The pins with clearance: any of ``"crank_pin"``, ``"rocker_pin"`` and ``"rocker_bearing"``, or none.
        The crank's bearing is driven and must be ideal.
    crank_speed, crank_angle : float
        Angular velocity of the crank [rad/s], and its angle at time zero [rad], 0 to the rocker's bearing.
    crank_mass, coupler_mass, rocker_mass : float
        Masses [kg].
    {pins}
    gravity : float
        Acceleration of free fall against y [m/s²].

    Raises
    ------
    SceneError
        If an argument is no number or out of range, or a pin or the branch is unknown; all are listed.

    Warns
    -----
    ChebclearWarning
        If the lengths do not let the crank turn fully (Grashof).

    Examples
    --------
    >>> four_bar(clearance_at=("crank_pin", "rocker_bearing")).check().degrees_of_freedom
    4
    """
    arguments, shared = checked(four_bar, locals())
    arguments.word("branch", branch, _BRANCHES)
    pins = ("crank_pin", "rocker_pin", "rocker_bearing")
    clearances = arguments.places(clearance_at, shared.clearance, pins, driven="crank_bearing")
    arguments.finish()
    play = Play(clearances, shared)
    base, crank = float(ground_length), float(crank_length)
    coupler, rocker = float(coupler_length), float(rocker_length)
    if not _full_turn(base, crank, coupler, rocker):
        warn_of_a_jam("four-bar", _GRASHOF)
    pin, pivot = on_circle(crank, as_number(crank_angle) or 0.0), (base, 0.0)
    joint = elbow(pin, pivot, coupler, rocker, 1.0 if branch == "open" else -1.0)
    return Scene(
        ground={"A": (0.0, 0.0), "D": pivot},
        bodies=[
            bar("crank", ("A", "B"), crank, crank_mass, crank_angle),
            bar("coupler", ("B", "C"), coupler, coupler_mass, direction(pin, joint)),
            bar("rocker", ("D", "C"), rocker, rocker_mass, direction(pivot, joint)),
        ],
        joints=[
            Revolute("crank_bearing", "ground.A", "crank.A"),
            play.pin("crank_pin", "crank.B", "coupler.B", journal="a"),
            play.pin("rocker_pin", "coupler.C", "rocker.C"),
            play.pin("rocker_bearing", "ground.D", "rocker.D"),
        ],
        forces=[Gravity((0.0, -gravity))] if gravity else [],
        drives=[Speed("drive", "crank_bearing", crank_speed, angle=crank_angle)],
    )


# Long because it lists the parts of one mechanism.
@with_pins
def six_bar(
    *,
    ground_length: float = 0.12,
    crank_length: float = 0.05,
    coupler_length: float = 0.10,
    rocker_length: float = 0.08,
    coupler_point_x: float = 0.05,
    coupler_point_y: float = 0.06,
    output_pivot_x: float = 0.18,
    output_pivot_y: float = 0.08,
    link_length: float = 0.14,
    output_length: float = 0.10,
    branch: str = "open",
    output_branch: str = "open",
    clearance_at: Sequence[str] = ("output_pin",),
    crank_speed: float = rpm(2000.0),
    crank_angle: float = 0.0,
    crank_mass: float = 0.30,
    coupler_mass: float = 0.21,
    rocker_mass: float = 0.14,
    link_mass: float = 0.21,
    output_mass: float = 0.14,
    gravity: float = 0.0,
    **options: Unpack[PinOptions],
) -> Scene:
    """A six-bar linkage (Stephenson's third): the coupler of a four-bar drives an output rocker by a link.

    ::

                coupler_pin        link
                     o------------------------o output_pin
                    / \\                        \\
                   /   \\                        \\ output
        crank_pin o-----o rocker_pin             \\
                 /       \\ rocker                 o===  output_bearing
                /         \\
           ====o===========o====
          crank_bearing  rocker_bearing

    The bodies are ``crank``, ``coupler`` (a triangular plate), ``rocker``, ``link`` and ``output``; all but
    the coupler are slender and uniform bars, the coupler is a uniform plate with its pins at the corners. The
    joints are ``crank_bearing`` (driven), ``crank_pin``, ``rocker_pin``, ``rocker_bearing``, ``coupler_pin``
    (coupler and link), ``output_pin`` (link and output) and ``output_bearing`` (ground and output). The drive
    is ``drive``. The four-bar is that of `four_bar`; the second loop is chosen, from no source, such that
    link and output stay between 62 and 130 degrees to each other.

    Parameters
    ----------
    ground_length, crank_length, coupler_length, rocker_length : float
        Distances between the pins of the four-bar [m].
    coupler_point_x, coupler_point_y : float
        The pin for the link on the coupler [m]: along the coupler from the crank's pin, and to its left.
    output_pivot_x, output_pivot_y : float
        The bearing of the output from the crank's bearing [m].
    link_length, output_length : float
        Distances between the pins of link and output [m].
    branch, output_branch : {"open", "crossed"}
        How the four-bar and the second loop are put together: rocker pin to the left or to the right of the
        way from the crank's pin to the rocker's bearing; output pin to the left or to the right of the way
        from the coupler's pin to the output's bearing.
    clearance_at : sequence of str
        The pins with clearance: any of ``"crank_pin"``, ``"rocker_pin"``, ``"rocker_bearing"``,
        ``"coupler_pin"``, ``"output_pin"`` and ``"output_bearing"``, or none.
    crank_speed, crank_angle : float
        Angular velocity of the crank [rad/s], and its angle at time zero [rad], 0 to the rocker's bearing.
    crank_mass, coupler_mass, rocker_mass, link_mass, output_mass : float
        Masses [kg].
    {pins}
    gravity : float
        Acceleration of free fall against y [m/s²].

    Raises
    ------
    SceneError
        If an argument is no number or out of range, or a pin or a branch is unknown; all are listed.

    Warns
    -----
    ChebclearWarning
        If the four-bar does not let the crank turn fully (Grashof), or the second loop cannot follow a full
        turn.

    Examples
    --------
    >>> six_bar(clearance_at=()).check().degrees_of_freedom
    0
    """
    arguments, shared = checked(six_bar, locals())
    arguments.word("branch", branch, _BRANCHES)
    arguments.word("output_branch", output_branch, _BRANCHES)
    pins = ("crank_pin", "rocker_pin", "rocker_bearing", "coupler_pin", "output_pin", "output_bearing")
    clearances = arguments.places(clearance_at, shared.clearance, pins, driven="crank_bearing")
    arguments.finish()
    play = Play(clearances, shared)
    base, crank = float(ground_length), float(crank_length)
    coupler, rocker = float(coupler_length), float(rocker_length)
    link, output = float(link_length), float(output_length)
    # Whole numbers beyond the range of floats are left to the core, as infinity.
    corner = (as_number(coupler_point_x) or 0.0, as_number(coupler_point_y) or 0.0)
    pivots = (base, 0.0), (as_number(output_pivot_x) or 0.0, as_number(output_pivot_y) or 0.0)
    sides = [1.0 if word == "open" else -1.0 for word in (branch, output_branch)]

    def pose(angle: float) -> tuple[float, float, float, float, bool]:
        """Angles of coupler, rocker, link and output, and whether both loops close."""
        pin = on_circle(crank, angle)
        joint = elbow(pin, pivots[0], coupler, rocker, sides[0])
        along, across = on_circle(1.0, direction(pin, joint))
        tip = (
            pin[0] + corner[0] * along - corner[1] * across,
            pin[1] + corner[0] * across + corner[1] * along,
        )
        end = elbow(tip, pivots[1], link, output, sides[1])
        closed = joint is not None and end is not None
        return (
            direction(pin, joint),
            direction(pivots[0], joint),
            direction(tip, end),
            direction(pivots[1], end),
            closed,
        )

    jams = [degree for degree in range(360) if not pose(math.radians(degree))[-1]]
    if not _full_turn(base, crank, coupler, rocker):
        warn_of_a_jam("six-bar", _GRASHOF)
    elif jams:
        warn_of_a_jam("six-bar", f"at a crank angle of {jams[0]} degrees its output loop cannot close")
    coupler_angle, rocker_angle, link_angle, output_angle, _ = pose(as_number(crank_angle) or 0.0)
    plate = (0.0, 0.0), (coupler, 0.0), corner
    sides_squared = sum(
        (plate[k][0] - plate[k - 1][0]) ** 2 + (plate[k][1] - plate[k - 1][1]) ** 2 for k in range(3)
    )
    return Scene(
        ground={"A": (0.0, 0.0), "D": pivots[0], "G": pivots[1]},
        bodies=[
            bar("crank", ("A", "B"), crank, crank_mass, crank_angle),
            Body(
                "coupler",
                mass=coupler_mass,
                # A uniform triangle, about its centroid.
                inertia=as_mass(coupler_mass) * sides_squared / 36.0,
                center_of_mass=((coupler + corner[0]) / 3.0, corner[1] / 3.0),
                points={"B": plate[0], "C": plate[1], "E": corner},
                angle=coupler_angle,
            ),
            bar("rocker", ("D", "C"), rocker, rocker_mass, rocker_angle),
            bar("link", ("E", "F"), link, link_mass, link_angle),
            bar("output", ("G", "F"), output, output_mass, output_angle),
        ],
        joints=[
            Revolute("crank_bearing", "ground.A", "crank.A"),
            play.pin("crank_pin", "crank.B", "coupler.B", journal="a"),
            play.pin("rocker_pin", "coupler.C", "rocker.C"),
            play.pin("rocker_bearing", "ground.D", "rocker.D"),
            play.pin("coupler_pin", "coupler.E", "link.E"),
            play.pin("output_pin", "link.F", "output.F"),
            play.pin("output_bearing", "ground.G", "output.G"),
        ],
        forces=[Gravity((0.0, -gravity))] if gravity else [],
        drives=[Speed("drive", "crank_bearing", crank_speed, angle=crank_angle)],
    )


def _full_turn(base: float, crank: float, coupler: float, rocker: float) -> bool:
    """Whether coupler and rocker reach each other at every angle of the crank (Grashof).

    They may be in line, as in a parallelogram, whose sums of lengths are equal but for rounding.
    """
    rounding = ROUNDING * (base + crank + coupler + rocker)
    shortest = abs(coupler - rocker) <= abs(base - crank) + rounding
    return shortest and base + crank <= coupler + rocker + rounding


_GRASHOF = "it needs |coupler - rocker| <= |ground - crank| and ground + crank <= coupler + rocker"
