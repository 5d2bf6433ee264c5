"""The outputs that are mostly asked of a mechanism, for reports and commands where none are named."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from .parts import GROUND, ClearancePrismatic, Joint, Prismatic, Revolute, ends_of, owner_of
from .scene import Scene

MOST_OUTPUTS = 12
"""Outputs that are taken where none are named [-]: as many as a report shows without tiring its reader."""


def joints_to_ground(scene: Scene, joints: Iterable[Joint]) -> Iterator[tuple[str, Joint]]:
    """Joints between a body of a scene and ground that no drive moves, with the name of the body."""
    driven, bodies = {drive.joint for drive in scene.drives}, {body.name for body in scene.bodies}
    for joint in joints:
        ends = {owner_of(end) for end in ends_of(joint)}
        if joint.name not in driven and GROUND in ends and (body := bodies & ends):
            yield body.pop(), joint


def usual_outputs(scene: Scene) -> list[str]:
    """What is mostly asked of a mechanism: the motion of what slides or swings, forces in play, torques.

    Bodies that slide on the ground; without one, those on a bearing of the ground that no drive turns; else
    the position of the last body.
    """
    sliding: list[str] = []
    swinging: list[str] = []
    for body, joint in joints_to_ground(scene, scene.joints):
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
