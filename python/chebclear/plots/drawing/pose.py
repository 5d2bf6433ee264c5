"""Where the parts of an assembled scene are, for its picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...scene.scene import ClearanceRevolute, Damper, Force, Scene, Spring

Array = NDArray[np.float64]

GROUND = "ground"
GROUND_COLOUR = "0.45"
# Paul Tol's bright scheme: told apart by colour-blind readers too.
_COLOURS = ("#4477AA", "#EE6677", "#228833", "#CCBB44", "#AA3377", "#66CCEE")


class Pose:
    """Where everything is: points of bodies in ground's frame, and the size of the mechanism."""

    def __init__(self, scene: Scene) -> None:
        facts = scene.check()
        self.scene = scene
        self.bodies = {body.name: body for body in scene.bodies}
        self.places = dict(zip(facts.bodies, facts.poses, strict=True))
        self.colours = {name: _COLOURS[index % len(_COLOURS)] for index, name in enumerate(self.bodies)} | {
            GROUND: GROUND_COLOUR
        }
        # The points of each body that a joint uses or the user named; ground counts where it is used.
        self.points: dict[str, list[Array]] = {name: [] for name in (*self.bodies, GROUND)}
        for body in scene.bodies:
            for name in body.points:
                self._note(f"{body.name}.{name}")
        for joint in scene.joints:
            for end in ends_of(joint):
                self._note(end)
        for force in scene.forces:
            if isinstance(force, (Spring, Damper)):
                self._note(force.a)
                self._note(force.b)
            elif isinstance(force, Force):
                self._note(force.point)
        for body in scene.bodies:
            if len(self.points[body.name]) < 2:
                self._note(f"{body.name}.center_of_mass")
        everything = np.array([point for points in self.points.values() for point in points])
        radii = [joint.journal_radius for joint in scene.joints if isinstance(joint, ClearanceRevolute)]
        span = float(np.hypot(*np.ptp(everything, axis=0))) if len(everything) else 0.0
        # A lone body in a bearing has no extent but its journal's.
        self.size = max([span, *(4.0 * radius for radius in radii)]) or 1.0
        self.centre: Array = (
            0.5 * (everything.min(axis=0) + everything.max(axis=0)) if len(everything) else np.zeros(2)
        )

    def _note(self, end: str) -> None:
        name, point = owner_of(end), self.at(end)
        if not any(np.allclose(point, other, rtol=0.0, atol=1e-12) for other in self.points[name]):
            self.points[name].append(point)

    def at(self, end: str) -> Array:
        """Position of ``"body.point"``."""
        name, _, label = end.partition(".")
        if name == GROUND:
            return np.array(self.scene.ground[label] if label else (0.0, 0.0))
        body = self.bodies[name]
        if label == "":
            local = (0.0, 0.0)
        elif label == "center_of_mass":
            local = body.center_of_mass
        else:
            local = body.points[label]
        x, y, angle = self.places[name]
        return np.array([x, y]) + self._rotated(local, angle)

    def direction(self, vector: tuple[float, float], name: str) -> Array:
        """Unit vector fixed in a body."""
        turned = self._rotated(vector, self.places[name][2] if name != GROUND else 0.0)
        unit: Array = turned / np.hypot(*turned)
        return unit

    @staticmethod
    def _rotated(vector: Sequence[float], angle: float) -> Array:
        sine, cosine = math.sin(angle), math.cos(angle)
        return np.array([cosine * vector[0] - sine * vector[1], sine * vector[0] + cosine * vector[1]])


def ends_of(joint: Any) -> tuple[str, str]:
    """The two points of a joint."""
    if isinstance(joint, ClearanceRevolute):
        return joint.bearing, joint.journal
    return joint.a, joint.b


def owner_of(end: str) -> str:
    """Body of a point ``"body.point"``."""
    return end.partition(".")[0]
