"""Numbers of a scene that are possible but hardly meant."""

from __future__ import annotations

from .scene import ClearanceRevolute, Scene


def scene_warnings(scene: Scene) -> tuple[str, ...]:
    """What looks like a wrong number or unit.

    Parameters
    ----------
    scene : Scene
        A scene that can be simulated.

    Returns
    -------
    tuple of str
        One sentence each.
    """
    return tuple(
        f'joint "{joint.name}": the clearance, {joint.clearance:.3g} m, is larger than the journal, of '
        f"radius {joint.journal_radius:.3g} m: the joint hardly guides anything; clearances are radial and "
        "in metres"
        for joint in scene.joints
        if isinstance(joint, ClearanceRevolute) and joint.clearance > joint.journal_radius
    )
