"""Drawing of guides with play, pins in slots and stops: faces, what slides between them, enlarged play."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...scene.parts import GROUND, ClearancePrismatic, ClearanceRevolute, PinInSlot, Stop, ends_of, owner_of
from .pose import Pose
from .strokes import Enlarged, Owner

if TYPE_CHECKING:
    from .pen import Pen

Array = NDArray[np.float64]

# Length of the faces beyond what slides, relative to that; of a stop relative to the mechanism.
_BEYOND, _FACE = 0.8, 0.06
# Largest tilt that is drawn, however much it is enlarged [rad].
_MOST_TILT = 0.4


def half_size(joint: ClearancePrismatic | PinInSlot | Stop) -> tuple[float, float]:
    """Half the length along the faces and half the height across them of what slides [m]."""
    if isinstance(joint, ClearancePrismatic):
        return 0.5 * joint.length, 0.5 * joint.height
    radius = joint.pin_radius if isinstance(joint, PinInSlot) else joint.radius
    return radius, radius


def place_in(
    pose: Pose, joint: ClearanceRevolute | ClearancePrismatic | PinInSlot, exaggerate: float
) -> tuple[Array, Array]:
    """Where a journal, a pin, or a block in its guide is drawn with its play enlarged, and its direction."""
    holder, held = ends_of(joint)
    start, place = pose.at(holder), pose.at(held)
    if isinstance(joint, ClearanceRevolute):
        return start + exaggerate * (place - start), pose.direction((1.0, 0.0), owner_of(held))
    way = pose.direction(joint.axis, owner_of(holder))
    across = np.array([-way[1], way[0]])
    center = place + (exaggerate - 1.0) * float((place - start) @ across) * across
    if isinstance(joint, PinInSlot):
        return center, pose.direction((1.0, 0.0), owner_of(held))
    tilt = _tilt(pose, owner_of(holder), owner_of(held), joint.angle)
    return center, _turned(way, exaggerate, tilt)


def part_in(pen: Pen, joint: ClearanceRevolute | ClearancePrismatic | PinInSlot) -> Owner:
    """What that moves with."""
    body = owner_of(ends_of(joint)[1])
    return body if pen.exaggerate == 1.0 else Enlarged(body, joint.name)


def draw_guide(pen: Pen, joint: ClearancePrismatic | PinInSlot | Stop, travel: tuple[float, float]) -> None:
    """Draw one of them; it slides back and forth from where it is by `travel` [m]."""
    if isinstance(joint, Stop):
        _stop(pen, joint)
    elif isinstance(joint, PinInSlot):
        _between_faces(pen, joint, joint.slot, joint.pin, travel)
    elif joint.corners == "a":
        _sleeve(pen, joint, travel)
    else:
        _between_faces(pen, joint, joint.a, joint.b, travel)


def _between_faces(
    pen: Pen, joint: ClearancePrismatic | PinInSlot, rail: str, moving: str, travel: tuple[float, float]
) -> None:
    pose = pen.pose
    way = pose.direction(joint.axis, owner_of(rail))
    across = np.array([-way[1], way[0]])
    start = pose.at(rail)
    along = float((pose.at(moving) - start) @ way)
    half_length, half_height = half_size(joint)
    reach = (1.0 + _BEYOND) * half_length
    low, high = along + travel[0] - reach, along + travel[1] + reach
    if joint.face_length is not None:
        low, high = -0.5 * joint.face_length, 0.5 * joint.face_length
    gap = half_height + pen.exaggerate * joint.clearance
    for side in (-1.0, 1.0):
        ends = [start + place * way + side * gap * across for place in (low, high)]
        _face(pen, owner_of(rail), *(ends if side < 0.0 else ends[::-1]))
    center, turned = place_in(pose, joint, pen.exaggerate)
    color = pose.colors[owner_of(moving)]
    if isinstance(joint, PinInSlot):
        pen.disc(center, half_height, part_in(pen, joint), color, color, 5, alpha=0.75)
        return
    _block(pen, part_in(pen, joint), color, center, turned, half_length, (-half_height, half_height))


def _sleeve(pen: Pen, joint: ClearancePrismatic, travel: tuple[float, float]) -> None:
    """A rod of body b between the two walls of a sleeve of body a."""
    pose = pen.pose
    sleeve, rod = owner_of(joint.a), owner_of(joint.b)
    way = pose.direction(joint.axis, sleeve)
    start = pose.at(joint.a)
    along = float((pose.at(joint.b) - start) @ way)
    half_length, half_height = half_size(joint)
    gap = half_height + pen.exaggerate * joint.clearance
    for side in (-1.0, 1.0):
        inner, outer = side * gap, side * (gap + 0.6 * half_height)
        _block(pen, sleeve, pose.colors[sleeve], start, way, half_length, (inner, outer))
    reach = max(2.0 * half_length, abs(along) + half_length, *(abs(one) + half_length for one in travel))
    center, turned = place_in(pose, joint, pen.exaggerate)
    if joint.face_length is None:
        center = center - along * way
    else:
        reach = 0.5 * joint.face_length
    _block(pen, part_in(pen, joint), pose.colors[rod], center, turned, reach, (-half_height, half_height))


def _stop(pen: Pen, joint: Stop) -> None:
    pose = pen.pose
    normal = pose.direction(joint.normal, owner_of(joint.a))
    along = np.array([normal[1], -normal[0]])
    half = _FACE * pen.unit
    reach = half if joint.face_length is None else 0.5 * joint.face_length
    place = pose.at(joint.a)
    # The body of the face lies to the right of its line.
    _face(pen, owner_of(joint.a), place - reach * along, place + reach * along, reverse=True)
    color = pose.colors[owner_of(joint.b)]
    radius = joint.radius or 0.15 * half
    pen.disc(pose.at(joint.b), radius, owner_of(joint.b), color, color, 5, alpha=0.75)


def _face(pen: Pen, owner: str, start: Array, end: Array, *, reverse: bool = False) -> None:
    """A straight face; ground has hatching behind it."""
    if owner == GROUND:
        pen.hatched(*((end, start) if reverse else (start, end)))
    else:
        pen.line([start, end], owner, pen.pose.colors[owner], 1.4, 3)


def _block(
    pen: Pen,
    owner: Owner,
    color: str,
    center: Array,
    way: Array,
    half_length: float,
    between: tuple[float, float],
) -> None:
    across = np.array([-way[1], way[0]])
    low, high = between
    places = ((-half_length, low), (half_length, low), (half_length, high), (-half_length, high))
    corners = np.array([center + x * way + y * across for x, y in places])
    pen.area(corners, owner, color, 1.5, alpha=0.45)


def _tilt(pose: Pose, first: str, second: str, angle: float) -> float:
    """Angle of the second body against the first, without that which it has untilted [rad]."""
    turned = [0.0 if name == GROUND else pose.places[name][2] for name in (first, second)]
    return float((turned[1] - turned[0] - angle + np.pi) % (2.0 * np.pi) - np.pi)


def _turned(way: Array, exaggerate: float, tilt: float) -> Array:
    shown = float(np.clip(exaggerate * tilt, -_MOST_TILT, _MOST_TILT))
    if exaggerate == 1.0:
        shown = tilt
    sine, cosine = np.sin(shown), np.cos(shown)
    return np.array([cosine * way[0] - sine * way[1], sine * way[0] + cosine * way[1]])
