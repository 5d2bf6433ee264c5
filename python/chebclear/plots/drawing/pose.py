"""Positions of the parts of a scene, assembled or simulated, for its picture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...errors import ArgumentError
from ...scene.forces import Damper, Force, Spring
from ...scene.parts import GROUND, ClearancePrismatic, ends_of, loose_joints, owner_of
from ...scene.scene import Scene
from ..axes import COLORS

if TYPE_CHECKING:
    from ...run.trajectory import Trajectory
    from ...study.sources.asked import SweptRun

Array = NDArray[np.float64]

GROUND_COLOR = "0.45"


class Pose:
    """Where everything is: points of bodies in ground's frame, and the size of the mechanism.

    Assembled, or where `poses` says: origin [m] and angle [rad] of every body, shape (bodies, 3).
    """

    def __init__(self, scene: Scene, poses: Array | None = None) -> None:
        self.scene = scene
        self.bodies = {body.name: body for body in scene.bodies}
        self.places: dict[str, tuple[float, float, float]]
        if poses is None:
            facts = scene.check()
            self.places = dict(zip(facts.bodies, facts.poses, strict=True))
        else:
            self.places = {
                name: (float(x), float(y), float(angle))
                for name, (x, y, angle) in zip(self.bodies, poses, strict=True)
            }
        self.colors = colors_of(scene)
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
        sizes = [4.0 * joint.journal_radius for joint in loose_joints(scene.joints)]
        sizes += [joint.length for joint in scene.joints if isinstance(joint, ClearancePrismatic)]
        span = float(np.hypot(*np.ptp(everything, axis=0))) if len(everything) else 0.0
        # A lone body in a bearing or guide has no extent but that of its journal or block.
        self.size = max([span, *sizes]) or 1.0
        self.center: Array = (
            0.5 * (everything.min(axis=0) + everything.max(axis=0)) if len(everything) else np.zeros(2)
        )

    def _note(self, end: str) -> None:
        name, point = owner_of(end), self.at(end)
        if not any(np.abs(point - other).max() <= 1e-12 for other in self.points[name]):
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


def colors_of(scene: Scene) -> dict[str, str]:
    """The color of each body and of ground."""
    colors = {body.name: COLORS[index % len(COLORS)] for index, body in enumerate(scene.bodies)}
    return colors | {GROUND: GROUND_COLOR}


def pose_columns(scene: Scene) -> tuple[str, ...]:
    """The outputs that say where all bodies are."""
    return tuple(f"{body.name}.{axis}" for body in scene.bodies for axis in ("x", "y", "angle"))


def simulated_poses(run: Trajectory | SweptRun) -> Array:
    """Origins [m] and angles [rad] of all bodies at the samples of a run, shape (samples, bodies, 3).

    NaN after a failure. An ArgumentError if the run has not the positions of all bodies.
    """
    missing = [name for name in pose_columns(run.scene) if name not in run.columns]
    if missing:
        more = "" if len(missing) <= 6 else f" and {len(missing) - 6} more"
        raise ArgumentError(
            f"the run lacks positions of bodies: {', '.join(missing[:6])}{more}. Simulate with outputs=None, "
            'or with these, such as outputs=["*.x", "*.y", "*.angle", ...]'
        )
    poses = np.empty((len(run.t), len(run.scene.bodies), 3))
    for index, body in enumerate(run.scene.bodies):
        x, y, angle = (run[f"{body.name}.{axis}"] for axis in ("x", "y", "angle"))
        # Columns are those of the center of mass.
        sine, cosine = np.sin(angle), np.cos(angle)
        offset_x, offset_y = body.center_of_mass
        poses[:, index, 0] = x - (cosine * offset_x - sine * offset_y)
        poses[:, index, 1] = y - (sine * offset_x + cosine * offset_y)
        poses[:, index, 2] = angle
    return poses
