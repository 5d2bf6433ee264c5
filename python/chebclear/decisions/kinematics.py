"""Kinematics: the positions that drives prescribe once clearances are closed, and the transmission angle."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..base.rows import Array
from ..base.units import unit
from ..errors import ArgumentError, ArgumentTypeError
from ..plots.drawing.pose import pose_columns, simulated_poses
from ..run.settings import Settings
from ..run.simulation import simulate
from ..run.trajectory import Trajectory
from ..scene.motions import JointStart, Speed
from ..scene.parts import GROUND, ClearanceRevolute, Joint, Prismatic, Revolute, ends_of, owner_of
from ..scene.scene import Scene
from ..scene.usual import joints_to_ground
from ..study.sources.asked import SweptRun
from .lost_motion import without_play

_PIVOTS = (Revolute, ClearanceRevolute)


@dataclass(frozen=True)
class Positions:
    """Where the bodies of a mechanism without play are."""

    t: Array = field(metadata=unit("s"))
    """Instants [s], shape (frames,)."""
    poses: Array
    """Position x, y [m] and angle [rad] of the frame of each body, shape (frames, bodies, 3)."""
    degrees_of_freedom: int
    """Coordinates that no drive prescribes [-]: with any, the assembled position is the only one."""
    stopped: str = ""
    """Why there are fewer positions than asked for: what a run says that ended early; empty if none did."""


def turning(scene: Scene) -> Scene:
    """A mechanism with one degree of freedom and no drive with one that turns its first bearing on ground, at
    1 rad/s from where it is assembled; any other as it is."""
    ideal = without_play(scene)
    bearing = next(
        (one for one in ideal.joints if isinstance(one, Revolute) and GROUND in map(owner_of, ends_of(one))),
        None,
    )
    facts = scene.check()
    if scene.drives or bearing is None or ideal.check().degrees_of_freedom != 1:
        return scene
    angles = dict(zip(facts.bodies, (pose[2] for pose in facts.poses), strict=True)) | {GROUND: 0.0}
    angle = angles[owner_of(bearing.b)] - angles[owner_of(bearing.a)]
    start = [
        replace(one, velocity=0.0)
        for one in scene.start
        if isinstance(one, JointStart) and one.joint != bearing.name
    ]
    return replace(scene, drives=[Speed(f"turn of {bearing.name}", bearing.name, 1.0, angle)], start=start)


def positions(scene: Scene, duration: float, frames: int) -> Positions:
    """The positions, through a time [s], of a mechanism that its drives prescribe without clearances."""
    ideal = without_play(scene)
    free = ideal.check().degrees_of_freedom
    if free or not scene.drives:
        return Positions(np.zeros(1), np.array([scene.check().poses]), free)
    settings = Settings(duration=duration, samples=frames, outputs=pose_columns(scene))
    run = simulate(ideal, settings=settings, on_failure="return")
    poses = simulated_poses(run)
    known = np.isfinite(poses).all(axis=(1, 2))
    return Positions(run.t[known], poses[known], 0, "" if run.success else run.message)


def output_joint(scene: Scene) -> Prismatic | Revolute | None:
    """The joint by which the driven end of a mechanism slides or swings on ground: the last one that slides
    without being driven, else the last one that swings; None without any."""
    # Not the shoe of a pin in a slot.
    on_ground = [joint for _, joint in joints_to_ground(scene, without_play(scene).joints)]
    sliding = [joint for joint in on_ground if isinstance(joint, Prismatic)]
    swinging = [joint for joint in on_ground if isinstance(joint, Revolute)]
    return sliding[-1] if sliding else swinging[-1] if swinging else None


def transmission_angle(scene: Scene, poses: Array) -> Array | None:
    """Angle [rad] between the coupler and the path of the pin at which it moves the output.

    It is that to the normal of the path: of a rocker the angle between coupler and rocker, of a slider that
    between coupler and the normal of its guide, folded to at most a right angle: at zero no force moves the
    output. After Alt (1932). Shape (frames,), of poses of shape (frames, bodies, 3); None where the output
    has no coupler with two pins.
    """
    joint = output_joint(scene)
    if joint is None:
        return None
    output = next(owner_of(end) for end in ends_of(joint) if owner_of(end) != GROUND)
    pins = [one for one in scene.joints if isinstance(one, _PIVOTS) and output in map(owner_of, ends_of(one))]
    for pin in pins:
        coupler = next((owner_of(end) for end in ends_of(pin) if owner_of(end) != output), GROUND)
        others = [one for one in scene.joints if one is not pin and coupler in map(owner_of, ends_of(one))]
        if coupler == GROUND or len(others) != 1 or not isinstance(others[0], _PIVOTS):
            continue
        far, near = (_path(scene, poses, _end_at(one, coupler)) for one in (others[0], pin))
        rod = near - far
        if isinstance(joint, Prismatic):
            guide = owner_of(joint.a)
            turned = np.zeros(1) if guide == GROUND else poses[:, _index(scene, guide), 2]
            way = _turned(np.array(joint.axis), turned)
        else:
            arm = near - _path(scene, poses, _end_at(joint, output))
            way = np.column_stack([-arm[:, 1], arm[:, 0]])
        lengths = np.hypot(*rod.T) * np.hypot(*way.T)
        return np.asarray(np.arcsin(np.minimum(np.abs(np.sum(rod * way, axis=1)) / lengths, 1.0)))
    return None


def transmission_angles(run: Trajectory | SweptRun) -> Array:
    """Transmission angle at every sample of a run [rad]; see `least_transmission_angle`.

    Parameters
    ----------
    run : Trajectory
        A run with the positions of all bodies, or a run of a study.

    Returns
    -------
    ndarray, shape (samples,)

    Raises
    ------
    ValueError, TypeError
        If the run lacks positions, no coupler with two pins moves the output, or this is no run.

    Examples
    --------
    >>> import chebclear as cc
    >>> scene = cc.mechanisms.slider_crank(crank_length=0.05, rod_length=0.1, clearance_at=())
    >>> angles = cc.features.transmission_angles(cc.simulate(scene, samples=361))
    >>> round(float(np.degrees(angles[90])), 6)  # 90 degrees less the lean of the rod
    60.0
    """
    if not isinstance(run, Trajectory | SweptRun):
        raise ArgumentTypeError(f"run must be a Trajectory or a run of a study, got {run!r:.80}")
    found = transmission_angle(run.scene, simulated_poses(run))
    if found is None:
        raise ArgumentError("no coupler with two pins moves an output on ground: no transmission angle")
    return found


def least_transmission_angle(run: Trajectory | SweptRun) -> float:
    """Smallest transmission angle in the samples of a run [rad], a feature of a study.

    The transmission angle lies between the coupler and a rocker, or the coupler and the normal of the guide
    of a slider, and is folded to at most a right angle. Where it is small, forces and the effect of play are
    large. The output is the last body that slides on ground, else the last one that swings on it.

    Parameters
    ----------
    run : Trajectory
        A run with the positions of all bodies, or a run of a study.

    Examples
    --------
    >>> import chebclear as cc
    >>> lengths = {"rod_length": cc.Interval("0.10 m", "0.12 m")}
    >>> asked = {"transmission": cc.features.least_transmission_angle}
    >>> study = cc.Study(
    ...     cc.mechanisms.slider_crank, lengths, features=asked, fixed={"clearance_at": ()}, samples=361
    ... )
    >>> round(float(study.function("transmission")([0.10])), 6)  # acos(crank / rod)
    1.047198
    """
    return float(np.min(transmission_angles(run)))


def _end_at(joint: Joint, body: str) -> str:
    """The point of a joint on a body."""
    return next(end for end in ends_of(joint) if owner_of(end) == body)


def _index(scene: Scene, body: str) -> int:
    return [one.name for one in scene.bodies].index(body)


def _path(scene: Scene, poses: Array, end: str) -> Array:
    """Where a point of a body is, shape (frames, 2) [m]."""
    index = _index(scene, owner_of(end))
    body, label = scene.bodies[index], end.partition(".")[2]
    local = body.center_of_mass if label == "center_of_mass" else body.points[label] if label else (0.0, 0.0)
    return poses[:, index, :2] + _turned(np.array(local), poses[:, index, 2])


def _turned(vector: Array, angle: Array) -> Array:
    """A vector turned by each of the angles [rad], shape (angles, 2)."""
    sine, cosine = np.sin(angle), np.cos(angle)
    return np.column_stack([cosine * vector[0] - sine * vector[1], sine * vector[0] + cosine * vector[1]])
