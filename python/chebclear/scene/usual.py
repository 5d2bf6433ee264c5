"""The outputs that are mostly asked of a mechanism, for reports and commands where none are named."""

from __future__ import annotations

from .parts import (
    GROUND,
    ClearancePrismatic,
    ClearanceRevolute,
    PinInSlot,
    Prismatic,
    Revolute,
    Stop,
    ends_of,
    owner_of,
)
from .scene import Scene

MOST_OUTPUTS = 12
"""Outputs that are taken where none are named [-]: as many as a report shows without tiring its reader."""


def usual_outputs(scene: Scene) -> list[str]:
    """What is mostly asked of a mechanism: the motion of what slides or swings, forces in play, torques.

    Bodies that slide on the ground; without one, those on a bearing of the ground that no drive turns; else
    the position of the last body.
    """
    driven = {drive.joint for drive in scene.drives}
    sliding: list[str] = []
    swinging: list[str] = []
    for joint in scene.joints:
        if isinstance(joint, ClearanceRevolute | PinInSlot | Stop) or joint.name in driven:
            continue
        ends = [owner_of(end) for end in ends_of(joint)]
        if GROUND not in ends:
            continue
        body = ends[ends[0] == GROUND]
        if isinstance(joint, Prismatic | ClearancePrismatic):
            along = "x" if abs(joint.axis[0]) >= abs(joint.axis[1]) else "y"
            sliding += [f"{body}.{kind}{along}" for kind in ("", "v", "a")]
        elif isinstance(joint, Revolute):
            swinging += [f"{body}.{kind}" for kind in ("angle", "angular_velocity", "angular_acceleration")]
    chosen = sliding or swinging
    if not chosen:
        chosen = [f"{scene.bodies[-1].name}.{kind}" for kind in ("x", "y")]
    facts = scene.check()
    chosen += [f"{name}.normal_force" for name in facts.clearance_joints]
    known = facts.columns
    chosen += [f"{drive.name}.torque" for drive in scene.drives if f"{drive.name}.torque" in known]
    return list(dict.fromkeys(chosen))[:MOST_OUTPUTS]
