"""What `chebclear show` plays: positions over a turn, the output, its transmission angle and lost motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...decisions.kinematics import Positions, output_joint, positions, transmission_angle, turning
from ...decisions.lost_motion import lost_motion
from ...errors import ChebclearError
from ...plots.animation.film import instants, mechanism_panel, mechanism_words, time_axis
from ...plots.animation.motion import moving_mechanism
from ...plots.drawing.pose import Pose
from ...report.film import Chart, Film, chart
from ...scene.columns import plain_words
from ...scene.motions import Speed
from ...scene.parts import GROUND, Prismatic, Revolute, ends_of, joints_with_play, owner_of
from ...scene.scene import Scene

Array = NDArray[np.float64]

FRAMES = 121
"""Positions of a turn [-]: every three degrees."""


def film_of(given: Scene, exaggerate: float, duration: float) -> tuple[Film, list[str]]:
    """A mechanism through a turn of its drive, or through a duration [s]; and what is not shown and why.

    Clearances are drawn larger by the factor `exaggerate` [-].
    """
    scene = turning(given)
    notes = list(map(str, given.check().notices))
    if scene is not given:
        joint = next(drive.joint for drive in scene.drives)
        notes.append(
            f"No drive prescribes the mechanism: {plain_words(joint)} is turned, without its forces."
        )
    speeds = [drive for drive in scene.drives if isinstance(drive, Speed) and drive.speed]
    found = positions(scene, scene.period if speeds else duration, FRAMES)
    if found.degrees_of_freedom:
        notes.append(
            f"The drives leave {found.degrees_of_freedom} degrees of freedom: only the assembled position is "
            "shown; chebclear animate shows the motion."
        )
    panel = mechanism_panel(moving_mechanism(scene, found.poses, exaggerate), mechanism_words(scene))
    if len(speeds) != 1:
        at, label = time_axis(found.t)
        places = instants(scene, found.t)
    else:
        at = 360.0 * found.t / scene.period
        label = f"turn of {plain_words(speeds[0].joint)} [°]"
        places = [f"{angle:.1f}°" for angle in at]
    if found.stopped:
        notes.append(f"It cannot go on from {places[-1]}: {found.stopped}. So its lost motion is not known.")
    charts = _charts(scene, at, found, notes) if len(at) > 1 else []
    cyclic = len(speeds) == 1 and not found.stopped
    return Film(panel.title, label, at, places, [panel], charts, len(charts), cyclic=cyclic), notes


def _charts(scene: Scene, at: Array, found: Positions, notes: list[str]) -> list[Chart]:
    """The output, its transmission angle, and how far it moves by play; notes say what is missing."""
    joint, poses = output_joint(scene), found.poses
    if joint is None:
        return []
    name = next(owner_of(end) for end in ends_of(joint) if owner_of(end) != GROUND)
    index = [body.name for body in scene.bodies].index(name)
    way = _way(scene, joint, poses[0])
    if way is None:
        charts = [chart(f"angle of {plain_words(name)}", "rad", at, poses[:, index, 2])]
    else:
        along = poses[:, index, :2] @ np.array(way)
        charts = [chart(f"position of {plain_words(name)} along its guide", "m", at, along)]
    angle = transmission_angle(scene, poses)
    if angle is None:
        notes.append(f"No transmission angle: {plain_words(name)} is not moved by a coupler with two pins.")
    else:
        charts.append(chart("transmission angle", "rad", at, angle))
    if joints_with_play(scene.joints) and not found.stopped:
        try:
            lost = lost_motion(scene, name, way, angles=FRAMES)
            charts.append(chart(f"lost motion of {plain_words(name)} by play", lost.unit, at, lost.total))
        except ChebclearError as error:
            notes.append(f"No lost motion: {error}")
    return charts


def _way(scene: Scene, joint: Prismatic | Revolute, pose: Array) -> tuple[float, float] | None:
    """The direction in which an output slides; None for one that swings."""
    if not isinstance(joint, Prismatic):
        return None
    x, y = Pose(scene, pose).direction(joint.axis, owner_of(joint.a))
    return float(x), float(y)
