"""Mechanisms with a slider: slider-cranks and quick returns."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Unpack

from ..base.arguments import as_number
from ..errors import SceneError
from ..scene.forces import Gravity
from ..scene.motions import Speed
from ..scene.parts import Body, Prismatic, Revolute
from ..scene.scene import Scene, rpm
from .joints import PinOptions, Play, as_mass, bar, checked, direction, on_circle, with_pins, with_units

_TABLE_2_SPEED = rpm(2000.0)


# Long because it lists the parts of one mechanism.
@with_pins
def slider_crank(
    *,
    crank_length: float = 0.05,
    rod_length: float = 0.12,
    clearance_at: Sequence[str] = ("wrist",),
    crank_speed: float = _TABLE_2_SPEED,
    crank_angle: float = 0.0,
    crank_mass: float = 0.30,
    rod_mass: float = 0.21,
    slider_mass: float = 0.14,
    slider_inertia: float = 1e-4,
    crank_inertia: float | None = None,
    rod_inertia: float | None = None,
    gravity: float = 0.0,
    convention: str = "corrected",
    **options: Unpack[PinOptions],
) -> Scene:
    """A slider-crank: a crank at constant speed, by default with play in the pin between rod and slider.

    ::

              crank_pin
                 o
          crank / \\_
               /    \\_  rod
              /       \\_
             o          \\_ [o] slider          y
        ============================          |__ x
        crank_bearing     wrist, guide

    The bodies are ``crank``, ``rod`` and ``slider``. The joints are ``crank_bearing`` (ground and crank),
    ``crank_pin`` (crank and rod), ``guide`` (ground and slider, along x) and ``wrist`` (rod and slider). The
    drive is ``drive``. With clearance the rod carries the bearings, crank and slider the journals. Masses do
    not change with the lengths; inertias do. The default numbers are those of Tables 1 and 2 of Xiang et al.
    (2020), "the paper".

    Parameters
    ----------
    crank_length, rod_length : float
        Distances between the pins [m].
    clearance_at : sequence of str
        The pins with clearance: any of ``"crank_pin"`` and ``"wrist"``, or none; with both the rod floats.
        The crank's bearing is driven and must be ideal.
    crank_speed, crank_angle : float
        Angular velocity of the crank [rad/s], and its angle at time zero [rad], 0 with the slider far out.
    crank_mass, rod_mass, slider_mass : float
        Masses [kg]; crank and rod are slender and uniform.
    slider_inertia : float
        Moment of inertia of the slider about its center of mass [kg m²].
    crank_inertia, rod_inertia : float, optional
        Moments of inertia about the centers of mass [kg m²]; those of uniform bars (see `convention`) if not
        given.
    {pins}
    gravity : float
        Acceleration of free fall against y [m/s²].
    convention : {"corrected", "as_printed"}
        ``"corrected"``: sliding velocity of the material surfaces, Hertz's stiffness with σ = (1 - ν²) / E,
        and the inertia m l² / 12 of crank and rod about their centers of mass. ``"as_printed"`` follows the
        paper to the letter and with it three errata: the contact-point sliding velocity of Eqs. (5) and (6),
        which misses the rotation of the bodies; σ = (1 - ν²) / (π E) of Eq. (9), π times too stiff; and the
        inertia m l² / 3 about the end of a rod, of Table 1 and Eq. (35), used about its center of mass.

    Returns
    -------
    Scene
        What the arguments make of it, such as masses above 0, is checked when it is checked or simulated.

    Raises
    ------
    SceneError
        If an argument is no number, a length, radius, modulus or clearance is not finite and above 0, a pin
        or the convention is unknown; all are listed.

    Examples
    --------
    >>> scene = slider_crank(clearance_at=("crank_pin", "wrist"))
    >>> scene.check().degrees_of_freedom  # a floating rod and the slider
    4
    """
    arguments, shared = checked(slider_crank, locals())
    arguments.word("convention", convention, ("corrected", "as_printed"))
    clearances = arguments.places(
        clearance_at, shared.clearance, ("crank_pin", "wrist"), driven="crank_bearing"
    )
    arguments.finish()
    crank_length, rod_length = float(crank_length), float(rod_length)
    start = as_number(crank_angle) or 0.0

    as_printed = convention == "as_printed"
    if as_printed and crank_inertia is None:
        crank_inertia = as_mass(crank_mass) * crank_length * crank_length / 3.0  # Table 1, Eq. (35)
    if as_printed and rod_inertia is None:
        rod_inertia = as_mass(rod_mass) * rod_length * rod_length / 3.0
    play = Play(clearances, shared, "as_printed" if as_printed else "hertz")
    # Where the ideal mechanism has the rod. If the rod is too short to reach, the assembly will say so.
    rise = -crank_length / rod_length * math.sin(start) if math.isfinite(start) else 0.0
    rod_angle = math.asin(rise) if abs(rise) <= 1.0 else 0.0
    return Scene(
        ground={"O": (0.0, 0.0)},
        bodies=[
            bar("crank", ("A", "B"), crank_length, crank_mass, crank_angle, crank_inertia),
            bar("rod", ("B", "C"), rod_length, rod_mass, rod_angle, rod_inertia),
            Body("slider", mass=slider_mass, inertia=slider_inertia, points={"C": (0.0, 0.0)}),
        ],
        joints=[
            Revolute("crank_bearing", "ground.O", "crank.A"),
            play.pin("crank_pin", "crank.B", "rod.B", journal="a"),
            Prismatic("guide", "ground.O", "slider.C", axis=(1.0, 0.0)),
            play.pin("wrist", "rod.C", "slider.C"),
        ],
        forces=[Gravity((0.0, -gravity))] if gravity else [],
        drives=[Speed("drive", "crank_bearing", crank_speed, angle=crank_angle)],
    )


@with_units
def flores_slider_crank(
    *, clearance: float = 5e-4, crank_speed: float = rpm(5000.0), **changes: Any
) -> Scene:
    """The slider-crank of P. Flores and co-workers, to which papers on joint clearance compare themselves.

    A `slider_crank` with play in the wrist of 0.5 mm in a bearing of 10 mm radius, 5000 revolutions per
    minute, restitution 0.9 with the law of Lankarani and Nikravesh, steel on steel (207 GPa, 0.3), no
    friction. It starts with crank and rod in line, the journal centered. Lengths of 0.05 and 0.12 m, masses
    of 0.30, 0.21 and 0.14 kg and the slider's inertia of 1e-4 kg m² are also those of Table 1 of Xiang et al.
    (2020). The inertia of the rod, 2.5e-4 kg m², is that of a uniform bar, m l² / 12, to two digits; that of
    the crank does not matter at a prescribed speed. See Flores (2010) in the list of references.

    Parameters
    ----------
    clearance : float
        Radial clearance [m]; the journal radius is 10 mm less the clearance unless given.
    crank_speed : float
        Angular velocity of the crank [rad/s]; 5000 revolutions per minute if not given.
    **changes
        Any other argument of `slider_crank`.

    Raises
    ------
    SceneError
        As `slider_crank`.

    Examples
    --------
    >>> from chebclear.mechanisms import flores_slider_crank
    >>> [joint.name for joint in flores_slider_crank().joints]
    ['crank_bearing', 'crank_pin', 'guide', 'wrist']
    """
    if "journal_radius" not in changes:
        gap = as_number(clearance)
        # Anything else than a number is left to the checks of slider_crank.
        changes["journal_radius"] = 0.01 if gap is None else 0.01 - gap
    defaults = {"rod_inertia": 2.5e-4, "restitution": 0.9, "friction": None}
    return slider_crank(clearance=clearance, crank_speed=crank_speed, **(defaults | changes))


# Long because it lists the parts of one mechanism.
@with_pins
def quick_return(
    *,
    crank_length: float = 0.05,
    pivot_distance: float = 0.10,
    lever_length: float = 0.20,
    link_length: float = 0.10,
    ram_height: float | None = None,
    ram: bool = True,
    clearance_at: Sequence[str] = ("crank_pin",),
    crank_speed: float = rpm(300.0),
    crank_angle: float = 0.0,
    crank_mass: float = 0.30,
    block_mass: float = 0.14,
    block_inertia: float = 1e-4,
    lever_mass: float = 0.50,
    link_mass: float = 0.21,
    ram_mass: float = 1.0,
    gravity: float = 0.0,
    **options: Unpack[PinOptions],
) -> Scene:
    """A quick return: a block on the crank's pin slides along a lever, which drives a ram.

    ::

         ram_pin         link          lever_pin
        ===[o]--------------------------o
                                       /
                                      /
                                   _[o]   crank_pin; the block slides along the lever
                       crank  __--  /
            crank_bearing   o-     /            y
                            |     / lever       |__ x
           pivot_distance   |   /
                            | /
            lever_bearing   o

    With a crank shorter than `pivot_distance` the lever swings by asin(crank_length / pivot_distance) to
    either side (crank and slotted lever, as in a shaper); with a longer one it turns fully (Whitworth's
    mechanism). The working stroke takes (π + 2 β) / (π - 2 β) times as long as the return, with β the angle
    above, or asin(pivot_distance / crank_length) where the lever turns fully and the ram's line passes its
    pivot.

    The bodies are ``crank``, ``block``, ``lever`` and, with a ram, ``link`` and ``ram``. The joints are
    ``crank_bearing`` (driven), ``crank_pin`` (crank and block), ``slot`` (the block slides along the lever),
    ``lever_bearing`` (ground and lever), ``lever_pin`` (lever and link), ``ram_pin`` (link and ram) and
    ``guide`` (ground and ram, along x). The drive is ``drive``. The contact is that of Table 2 of Xiang et
    al. (2020), and the masses of crank, link and block are those of their crank, rod and slider. Lengths,
    speed and the other masses are chosen, from no source; they give a time ratio of 2.

    Parameters
    ----------
    crank_length : float
        Radius of the crank [m].
    pivot_distance : float
        Distance of the lever's pivot below the crank's [m]; not equal to `crank_length`.
    lever_length : float
        From the lever's pivot to its pin for the link [m].
    link_length : float
        Length of the link to the ram [m].
    ram_height : float, optional
        Height of the ram's line above the lever's pivot [m]. If not given, midway between the lowest and
        highest place of a swinging lever's pin, and 0 for a lever that turns fully.
    ram : bool
        Whether there are a link and a ram.
    clearance_at : sequence of str
        The pins with clearance: any of ``"crank_pin"``, ``"lever_bearing"``, ``"lever_pin"`` and
        ``"ram_pin"``, or none.
    crank_speed, crank_angle : float
        Angular velocity of the crank [rad/s], and its angle at time zero [rad], 0 along x.
    crank_mass, block_mass, lever_mass, link_mass, ram_mass : float
        Masses [kg]; crank, lever and link are slender and uniform.
    block_inertia : float
        Moment of inertia of the block about its center of mass [kg m²].
    {pins}
    gravity : float
        Acceleration of free fall against y [m/s²].

    Raises
    ------
    SceneError
        If an argument is no number or out of range, or a pin is unknown; all are listed.

    Examples
    --------
    >>> quick_return(clearance_at=()).check().degrees_of_freedom
    0
    """
    if not isinstance(ram, bool):
        raise SceneError([("ram", f"must be True or False, got {ram!r}")])
    arguments, shared = checked(quick_return, locals())
    pins = ("crank_pin", "lever_bearing", *(("lever_pin", "ram_pin") if ram else ()))
    clearances = arguments.places(clearance_at, shared.clearance, pins, driven="crank_bearing")
    radius, depth = as_number(crank_length), as_number(pivot_distance)
    if radius is not None and radius == depth:
        arguments.add(
            "pivot_distance", "must differ from crank_length: the block would reach the lever's pivot"
        )
    arguments.finish()
    play = Play(clearances, shared)
    radius, depth, arm = float(crank_length), float(pivot_distance), float(lever_length)
    pivot, pin = (0.0, -depth), on_circle(radius, as_number(crank_angle) or 0.0)
    lever_angle = direction(pivot, pin)
    bodies = [
        bar("crank", ("A", "B"), radius, crank_mass, crank_angle),
        Body("block", mass=block_mass, inertia=block_inertia, points={"B": (0.0, 0.0)}, angle=lever_angle),
        bar("lever", ("D", "E"), arm, lever_mass, lever_angle),
    ]
    joints = [
        Revolute("crank_bearing", "ground.O", "crank.A"),
        play.pin("crank_pin", "crank.B", "block.B", journal="a"),
        Prismatic("slot", "lever.D", "block.B", axis=(1.0, 0.0)),
        play.pin("lever_bearing", "ground.D", "lever.D", journal="a"),
    ]
    ground = {"O": (0.0, 0.0), "D": pivot}
    if ram:
        length = float(link_length)
        if ram_height is None:
            swing = radius / depth
            ram_height = 0.5 * arm * (1.0 + math.sqrt(1.0 - swing * swing)) if swing < 1.0 else 0.0
        line = -depth + (as_number(ram_height) or 0.0)
        tip = (arm * math.cos(lever_angle), pivot[1] + arm * math.sin(lever_angle))
        rise = (line - tip[1]) / length
        # To the left of the lever. If the link is too short to reach the line, the assembly will say so.
        link_angle = math.pi - math.asin(rise) if abs(rise) <= 1.0 else math.pi
        bodies += [
            bar("link", ("E", "F"), length, link_mass, link_angle),
            # Its guide keeps the ram from turning, so that its inertia never matters.
            Body(
                "ram",
                mass=ram_mass,
                inertia=as_mass(ram_mass) * length * length / 12.0,
                points={"F": (0.0, 0.0)},
            ),
        ]
        joints += [
            play.pin("lever_pin", "lever.E", "link.E", journal="a"),
            play.pin("ram_pin", "link.F", "ram.F"),
            Prismatic("guide", "ground.G", "ram.F", axis=(1.0, 0.0)),
        ]
        ground["G"] = (0.0, line)
    return Scene(
        ground=ground,
        bodies=bodies,
        joints=joints,
        forces=[Gravity((0.0, -gravity))] if gravity else [],
        drives=[Speed("drive", "crank_bearing", crank_speed, angle=crank_angle)],
    )
