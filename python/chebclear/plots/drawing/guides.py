"""Drawing of guides with play, pins in slots and stops: faces, what slides between them, enlarged play."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...scene.parts import GROUND, owner_of
from ...scene.scene import ClearancePrismatic, PinInSlot, Stop
from .pose import Pose

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
    along, off = (float((pose.at(moving) - start) @ one) for one in (way, across))
    half_length, half_height = half_size(joint)
    reach = (1.0 + _BEYOND) * half_length
    low, high = along + travel[0] - reach, along + travel[1] + reach
    if joint.face_length is not None:
        low, high = -0.5 * joint.face_length, 0.5 * joint.face_length
    gap = half_height + pen.exaggerate * joint.clearance
    for side in (-1.0, 1.0):
        ends = [start + place * way + side * gap * across for place in (low, high)]
        _face(pen, owner_of(rail), *(ends if side < 0.0 else ends[::-1]))
    center = start + along * way + pen.exaggerate * off * across
    color = pose.colors[owner_of(moving)]
    if isinstance(joint, PinInSlot):
        pen.disc(center, half_height, owner_of(moving), color, color, 5, alpha=0.75)
        return
    tilt = _tilt(pose, owner_of(rail), owner_of(moving), joint.angle)
    _block(pen, owner_of(moving), center, _turned(way, pen, tilt), half_length, (-half_height, half_height))


def _sleeve(pen: Pen, joint: ClearancePrismatic, travel: tuple[float, float]) -> None:
    """A rod of body b between the two walls of a sleeve of body a."""
    pose = pen.pose
    sleeve, rod = owner_of(joint.a), owner_of(joint.b)
    way = pose.direction(joint.axis, sleeve)
    across = np.array([-way[1], way[0]])
    start = pose.at(joint.a)
    along, off = (float((pose.at(joint.b) - start) @ one) for one in (way, across))
    half_length, half_height = half_size(joint)
    gap = half_height + pen.exaggerate * joint.clearance
    for side in (-1.0, 1.0):
        inner, outer = side * gap, side * (gap + 0.6 * half_height)
        _block(pen, sleeve, start, way, half_length, (inner, outer))
    reach = max(2.0 * half_length, abs(along) + half_length, *(abs(one) + half_length for one in travel))
    center = start + pen.exaggerate * off * across
    if joint.face_length is not None:
        center, reach = center + along * way, 0.5 * joint.face_length
    tilt = _tilt(pose, sleeve, rod, joint.angle)
    _block(pen, rod, center, _turned(way, pen, tilt), reach, (-half_height, half_height))


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
    pen: Pen, owner: str, center: Array, way: Array, half_length: float, between: tuple[float, float]
) -> None:
    across = np.array([-way[1], way[0]])
    low, high = between
    places = ((-half_length, low), (half_length, low), (half_length, high), (-half_length, high))
    corners = np.array([center + x * way + y * across for x, y in places])
    pen.area(corners, owner, pen.pose.colors[owner], 1.5, alpha=0.45)


def _tilt(pose: Pose, first: str, second: str, angle: float) -> float:
    """Angle of the second body against the first, without that which it has untilted [rad]."""
    turned = [0.0 if name == GROUND else pose.places[name][2] for name in (first, second)]
    return float((turned[1] - turned[0] - angle + np.pi) % (2.0 * np.pi) - np.pi)


def _turned(way: Array, pen: Pen, tilt: float) -> Array:
    shown = float(np.clip(pen.exaggerate * tilt, -_MOST_TILT, _MOST_TILT))
    if pen.exaggerate == 1.0:
        shown = tilt
    sine, cosine = np.sin(shown), np.cos(shown)
    return np.array([cosine * way[0] - sine * way[1], sine * way[0] + cosine * way[1]])
