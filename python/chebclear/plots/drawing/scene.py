"""The picture of a mechanism as assembled or as simulated, with joints, ground, drives and gravity.

All sizes are in meters of the drawing and scale with the mechanism, so the picture can be zoomed.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...base.arguments import Checks
from ...errors import ArgumentError
from ...scene.scene import ClearanceRevolute, Gravity, Scene
from ..axes import new_axes
from ..labels import size_of, typeset
from .pen import Pen, strokes_of
from .pose import Pose, simulated_poses
from .strokes import put_on

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..subjects import RunLike

Array = NDArray[np.float64]

# Width and height of a letter of a name, relative to the size of the axes' labels.
_LETTER = (0.52, 1.0)


def plot_scene(
    scene: Scene | RunLike,
    t: float | None = None,
    *,
    ax: Axes | None = None,
    exaggerate: float = 1.0,
    labels: bool = True,
) -> Axes:
    """Draw a mechanism: as assembled from a scene, or as it was simulated at an instant of a run.

    Bodies are bars or plates through their points, with a cross at the center of mass; ground is hatched.
    Ideal pins are small circles, guides are rails with a block, welds are squares. A pin with clearance is a
    journal (a disc in the color of its body) in a bearing of true radius. Springs are zigzags or spirals,
    dampers are cylinders with a piston or drums with shoes. Drives, given forces and torques are arrows,
    straight or curved, with two heads if they change direction; gravity is an arrow in the corner.

    Parameters
    ----------
    scene : Scene or Trajectory
        The scene, which is checked and assembled; or a run that has the positions of all bodies, which are
        drawn as they are.
    t : float, optional
        Instant of the run [s]; the nearest sample is drawn, and named in the picture. The first one if not
        given.
    ax : Axes, optional
        Where to draw; a new figure if not given.
    exaggerate : float
        Factor by which clearances, and eccentricities, are drawn larger than they are [-]; the picture states
        it.
    labels : bool
        Write the names of bodies, joints and forces.

    Returns
    -------
    Axes

    Raises
    ------
    SceneError
        If the scene cannot be assembled.
    ValueError, TypeError
        If `exaggerate` is no finite number above 0, `t` lies outside the run, or the run lacks positions: the
        message names the outputs to ask for.

    Examples
    --------
    >>> from chebclear import mechanisms
    >>> plot_scene(mechanisms.four_bar(), exaggerate=100.0).get_xlabel()
    'x [m]'
    """
    checks = Checks()
    checks.real("exaggerate", exaggerate, "-", above=0.0)
    run = None if isinstance(scene, Scene) else scene
    if run is not None and not isinstance(getattr(run, "scene", None), Scene):
        checks.add(f"scene must be a Scene or a run of one, got {scene!r}", wrong_type=True)
        checks.finish()
    if run is None:
        if t is not None:
            checks.add(f"t is the instant of a run: a scene is drawn as assembled, got t={t!r}")
        checks.finish()
        pose, instant = Pose(scene), None  # type: ignore[arg-type]
    else:
        time = checks.real("t", run.t[0] if t is None else t, "s", least=run.t[0], most=run.t[-1])
        checks.finish()
        poses = simulated_poses(run)
        index = _nearest(run, poses, time)
        pose, instant = Pose(run.scene, poses[index]), float(run.t[index])
    ax = new_axes(ax)
    pen = strokes_of(pose, float(exaggerate))
    put_on(ax, pen.strokes)
    _frame(ax)
    if labels:
        _label_parts(ax, pen)
    notes = [] if instant is None else [f"t = {instant:.6g} s"]
    loose = any(isinstance(joint, ClearanceRevolute) for joint in pose.scene.joints)
    if loose and exaggerate != 1.0:
        notes.append(f"clearances drawn {exaggerate:g} times larger")
    if notes:
        note = ", ".join(notes)
        ax.text(0.02, 0.02, note, transform=ax.transAxes, fontsize="small", color="0.3", zorder=10)
    draw_gravity(ax, pose.scene)
    return ax


def _nearest(run: RunLike, poses: Array, time: float) -> int:
    """The sample nearest to an instant, of those that the run has reached."""
    reached = np.flatnonzero(np.isfinite(poses).all(axis=(1, 2)))
    if not len(reached) or time > run.end_time:
        raise ArgumentError(
            f"the run ended at {run.end_time:.6g} s: there is nothing to draw at {time:.6g} s"
        )
    return int(reached[np.abs(run.t[reached] - time).argmin()])


def _frame(ax: Axes) -> None:
    """Equal scales, and room around the mechanism."""
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("y [m]")
    ax.margins(0.18)
    ax.autoscale_view()


def draw_gravity(ax: Axes, scene: Scene) -> None:
    """An arrow in the corner, with the acceleration of gravity if there is one."""
    gravity = sum(
        (np.array(force.acceleration) for force in scene.forces if isinstance(force, Gravity)), np.zeros(2)
    )
    strength = float(np.hypot(*gravity))
    if not strength:
        return
    tail = (0.94, 0.90)
    ax.annotate(
        "",
        xy=(tail[0] + 0.1 * gravity[0] / strength, tail[1] + 0.1 * gravity[1] / strength),
        xytext=tail,
        xycoords="axes fraction",
        arrowprops={"arrowstyle": "-|>", "color": "0.1", "linewidth": 1.3},
        zorder=10,
    )
    ax.text(
        0.98,
        tail[1] + 0.02,
        typeset(f"{strength:.4g} m/s²"),
        transform=ax.transAxes,
        ha="right",
        fontsize="small",
        zorder=10,
    )


def _label_parts(ax: Axes, pen: Pen) -> None:
    """Names of bodies on them, and names of joints and forces beside them."""
    pose = pen.pose
    style = {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.7}
    # What a letter takes of the axes as they are now; the labels may narrow them a little.
    left, right = ax.get_xlim()
    font = float(ax.xaxis.label.get_fontsize()) * (right - left) / size_of(ax)[0]
    width, height = _LETTER[0] * font, _LETTER[1] * font
    for body in pose.scene.bodies:
        spot: Array = np.mean(pose.points[body.name], axis=0)
        half = np.array([0.5 * width * len(body.name), 0.0])
        pen.clutter.add(spot - half, spot + half, 0.5 * height)
        ax.text(
            spot[0],
            spot[1],
            typeset(body.name),
            fontsize="small",
            weight="bold",
            color=pose.colors[body.name],
            ha="center",
            va="center",
            bbox=style,
            zorder=9,
        )
    for place, names, radius in _named_by_place(pen):
        text = ", ".join(names)
        away = place - pose.center
        outward = away / (np.hypot(*away) or 1.0)
        size = (width * len(text), height)
        anchor, across, up = pen.clutter.place(place, radius + 0.012 * pen.unit, size, outward)
        ax.text(
            anchor[0],
            anchor[1],
            typeset(text),
            fontsize="x-small",
            style="italic",
            color="0.25",
            ha=across,
            va=up,
            bbox=style,
            zorder=9,
        )
        # The axes hold the labels too.
        wide = size[0]
        shifts = {"left": (0.0, wide), "center": (-0.5 * wide, 0.5 * wide), "right": (-wide, 0.0)}[across]
        ax.update_datalim([anchor + np.array([shift, 0.0]) for shift in shifts])
    # What the margins were for lies within the limits now.
    ax.margins(0.08)
    ax.autoscale_view()


def _named_by_place(pen: Pen) -> Iterator[tuple[Array, list[str], float]]:
    """Joints that lie on each other share a label."""
    left = list(pen.named)
    while left:
        place = left[0][0]
        near = [item for item in left if np.hypot(*(item[0] - place)) < 0.02 * pen.unit]
        left = [item for item in left if not any(item is other for other in near)]
        yield place, [name for _, name, _ in near], max(radius for _, _, radius in near)
