"""The outputs that are mostly asked of a mechanism, for reports and commands where none are named."""

from __future__ import annotations

from .parts import ClearanceRevolute, Prismatic, Revolute
from .scene import Scene

MOST_OUTPUTS = 12
"""Outputs that are taken where none are named [-]: as many as a report shows without tiring its reader."""
_GROUND = "ground"


def usual_outputs(scene: Scene) -> list[str]:
    """What is mostly asked of a mechanism: the motion of what slides or swings, forces in play, torques.

    Bodies that slide on the ground; without one, those on a bearing of the ground that no drive turns; else
    the position of the last body.
    """
    driven = {drive.joint for drive in scene.drives}
    sliding: list[str] = []
    swinging: list[str] = []
    for joint in scene.joints:
        if isinstance(joint, ClearanceRevolute) or joint.name in driven:
            continue
        ends = [end.partition(".")[0] for end in (joint.a, joint.b)]
        if _GROUND not in ends:
            continue
        body = ends[ends[0] == _GROUND]
        if isinstance(joint, Prismatic):
            along = "x" if abs(joint.axis[0]) >= abs(joint.axis[1]) else "y"
            sliding += [f"{body}.{kind}{along}" for kind in ("", "v", "a")]
        elif isinstance(joint, Revolute):
            swinging += [f"{body}.{kind}" for kind in ("angle", "angular_velocity", "angular_acceleration")]
    chosen = sliding or swinging
    if not chosen:
        chosen = [f"{scene.bodies[-1].name}.{kind}" for kind in ("x", "y")]
    chosen += [f"{joint.name}.normal_force" for joint in loose_joints(scene)]
    known = scene.check().columns
    chosen += [f"{drive.name}.torque" for drive in scene.drives if f"{drive.name}.torque" in known]
    return list(dict.fromkeys(chosen))[:MOST_OUTPUTS]


def loose_joints(scene: Scene) -> list[ClearanceRevolute]:
    """The joints with clearance."""
    return [joint for joint in scene.joints if isinstance(joint, ClearanceRevolute)]
