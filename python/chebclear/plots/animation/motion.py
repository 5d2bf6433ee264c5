"""The moving parts of a mechanism: strokes with their transforms by frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...scene.parts import (
    GROUND,
    ClearancePrismatic,
    ClearanceRevolute,
    PinInSlot,
    Prismatic,
    ends_of,
    owner_of,
)
from ...scene.scene import Scene
from ..drawing.guides import place_in
from ..drawing.pen import strokes_of
from ..drawing.pose import Pose
from ..drawing.strokes import Enlarged, Owner, Stroke, along

if TYPE_CHECKING:
    pass

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MovingMechanism:
    """A mechanism in several poses, its frames."""

    scene: Scene
    strokes: tuple[Stroke, ...]
    """Its drawing in the first pose, from back to front."""
    exaggerate: float
    """Factor by which clearances are drawn larger than they are [-]."""
    transforms: dict[Owner, Array]
    """How each owner has moved since the first pose: ``(a, b, c, d, e, f)`` of x' = a x + c y + e and
    y' = b x + d y + f, shape (frames, 6)."""
    first: Pose
    """The first pose."""

    def view(self) -> tuple[Array, Array]:
        """Lowest and highest corner of all that is drawn in any frame [m]."""
        lows, highs = [], []
        for stroke in self.strokes:
            points = moved(self.transforms[stroke.owner], stroke.points)
            lows.append(points.min(axis=(0, 1)) - stroke.radius)
            highs.append(points.max(axis=(0, 1)) + stroke.radius)
        return np.min(lows, axis=0), np.max(highs, axis=0)


def moved(transforms: Array, points: Array) -> Array:
    """Points after each of the transforms, shape (frames, points, 2)."""
    matrices = transforms[:, :4].reshape(-1, 2, 2)  # the rows are what the unit vectors become
    shifted: Array = points @ matrices + transforms[:, None, 4:]
    return shifted


def moving_mechanism(scene: Scene, poses: Array, exaggerate: float = 1.0) -> MovingMechanism:
    """Draw a mechanism in poses of shape (frames, bodies, 3), clearances enlarged, and how parts move."""
    moments = [Pose(scene, pose) for pose in poses]
    strokes = sorted(
        strokes_of(moments[0], exaggerate, _travels(moments)).strokes, key=lambda stroke: stroke.layer
    )
    owners = dict.fromkeys(stroke.owner for stroke in strokes)
    transforms = {
        owner: np.array([_since(moments[0], pose, owner, exaggerate) for pose in moments]) for owner in owners
    }
    return MovingMechanism(scene, tuple(strokes), exaggerate, transforms, moments[0])


def _since(first: Pose, pose: Pose, owner: Owner, exaggerate: float) -> Array:
    """The transform of an owner between two poses."""
    if owner == GROUND:
        return np.array([1.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    if isinstance(owner, str):
        start, end = first.places[owner], pose.places[owner]
        turn = end[2] - start[2]
        sine, cosine = np.sin(turn), np.cos(turn)
        matrix = np.array([[cosine, sine], [-sine, cosine]])
        return _about(np.array(start[:2]), np.array(end[:2]), matrix)
    if isinstance(owner, Enlarged):
        joint = next(one for one in pose.scene.joints if one.name == owner.joint)
        assert isinstance(joint, ClearanceRevolute | ClearancePrismatic | PinInSlot)
        (old, way), (new, new_way) = (place_in(each, joint, exaggerate) for each in (first, pose))
        cosine, sine = way @ new_way, way[0] * new_way[1] - way[1] * new_way[0]
        return _about(old, new, np.array([[cosine, sine], [-sine, cosine]]))
    before, after = (np.array([each.at(end) for end in owner]) for each in (first, pose))
    matrix = np.eye(2)
    if owner[0] != owner[1]:
        # Stretched along the line between the points, as wide as before.
        way, across, length = along(*before)
        new_way, new_across, new_length = along(*after)
        matrix = np.outer(way, new_way) * (new_length / length if length > 0.0 else 1.0) + np.outer(
            across, new_across
        )
    return _about(before[0], after[0], matrix)


def _about(start: Array, end: Array, matrix: Array) -> Array:
    """The transform that takes one point to another and turns or stretches what is around it."""
    return np.concatenate([matrix.ravel(), end - start @ matrix])


def _travels(moments: list[Pose]) -> dict[str, tuple[float, float]]:
    """How far the block of each guide goes back and forth from where it is in the first frame [m]."""
    travels = {}
    for joint in moments[0].scene.joints:
        if isinstance(joint, Prismatic | ClearancePrismatic | PinInSlot):
            rail, slides = ends_of(joint)
            places = [
                float((pose.at(slides) - pose.at(rail)) @ pose.direction(joint.axis, owner_of(rail)))
                for pose in moments
            ]
            travels[joint.name] = (min(places) - places[0], max(places) - places[0])
    return travels
