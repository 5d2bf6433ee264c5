"""The picture of a mechanism as assembled or as simulated, with joints, ground, drives and gravity.

All sizes are in meters of the drawing and scale with the mechanism, so the picture can be zoomed.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...base.arguments import Checks
from ...errors import ArgumentError
from ...report.document import Picture
from ...scene.columns import plain_words
from ...scene.forces import Gravity
from ...scene.parts import joints_with_play
from ...scene.scene import Scene
from ..axes import is_a, new_axes, plot_of
from ..labels import size_of, typeset
from .pen import Pen, strokes_of
from .plane import along_body, around
from .pose import Pose, simulated_poses
from .strokes import put_on

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ...run.trajectory import Trajectory

Array = NDArray[np.float64]

# Mean width of a letter of the names of bodies and of joints, relative to the size of the axes' labels: in
# matplotlib's own font, bold and small, or italic and very small.
_BOLD, _ITALIC = 0.58, 0.44
_OF_BODIES = {"fontsize": 0.83, "weight": "bold"}
_BESIDE = {"fontsize": 0.69, "style": "italic"}
# Letters of a line of names of joints and of bodies.
_LONGEST = 16
# With half as many the names of a six-bar in a column of print cover its crank pin.
_ROUNDS = 4
# Type is made smaller where the labels would leave the mechanism less than this share of the axes.
_SCALES, _LEAST_SHARE = (1.0, 0.85, 0.7), 0.7
_LABELED_MARGIN = 0.05

# Opacity of the positions behind the first.
_FADED = 0.25


@plot_of()
def plot_scene(
    scene: Scene | Trajectory,
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
    exaggerate : float
        Factor by which clearances, and eccentricities, are drawn larger than they are [-]; the picture states
        it.
    labels : bool
        Write the names of bodies, joints and forces.

    Raises
    ------
    SceneError
        If the scene cannot be assembled.
    ValueError, TypeError
        If `exaggerate` is no number above 0, `t` lies outside the run, or the run lacks
        positions: the message names the outputs to ask for.

    Examples
    --------
    >>> from chebclear import mechanisms
    >>> plot_scene(mechanisms.four_bar(), exaggerate=100.0).get_xlabel()
    'x [m]'
    """
    checks = Checks()
    exaggerate = checks.real("exaggerate", exaggerate, "-", above=0.0)
    if not isinstance(labels, bool):
        checks.add("labels", f"must be True or False, got {labels!r}", wrong_type=True)
    if not isinstance(scene, Scene) and not is_a(scene, "Trajectory"):
        checks.add("scene", f"must be a Scene or a run of one, got {scene!r}", wrong_type=True)
        checks.finish()
    if isinstance(scene, Scene):
        if t is not None:
            checks.add("t", f"is the instant of a run: a scene is drawn as assembled, got t={t!r}")
        checks.finish()
        pose, instant = Pose(scene), None
    else:
        run = scene
        time = checks.real("t", run.t[0] if t is None else t, "s", least=run.t[0], most=run.t[-1])
        checks.finish()
        poses = simulated_poses(run)
        index = _nearest(run, poses, time)
        pose, instant = Pose(run.scene, poses[index]), float(run.t[index])
    ax = new_axes(ax)
    pen = strokes_of(pose, float(exaggerate))
    put_on(ax, pen.strokes)
    _frame(ax)
    notes = [] if instant is None else [f"t = {instant:.6g} s"]
    if joints_with_play(pose.scene.joints) and exaggerate != 1.0:
        notes.append(f"clearances drawn {exaggerate:g} times larger")
    if notes:
        note = ", ".join(notes)
        _room(ax, below=1.2)
        ax.text(0.02, 0.02, note, transform=ax.transAxes, fontsize="small", color="0.3", zorder=10)
    draw_gravity(ax, pose.scene)
    if labels:
        _label_parts(ax, pen)
    return ax


def mechanism_picture(scene: Scene) -> Picture:
    """The mechanism at its start, for reports and notebooks."""
    loose = [joint.name for joint in joints_with_play(scene.joints)]
    bodies = f"{len(scene.bodies)} {'body' if len(scene.bodies) == 1 else 'bodies'}"
    play = f"clearance at {', '.join(loose)}" if loose else "no clearance"
    return Picture(
        f"Drawing of the mechanism with {bodies} and {play}.",
        lambda ax: plot_scene(scene, ax=ax),
        height=2.8,
        caption="The mechanism at its start.",
    )


def plot_poses(scene: Scene, poses: Sequence[Array], *, ax: Axes | None = None) -> Axes:
    """Draw a mechanism in poses of shape (bodies, 3): the first plainly, the others faded behind it."""
    ax = new_axes(ax)
    for place, pose in enumerate(poses):
        for artist in put_on(ax, strokes_of(Pose(scene, pose)).strokes):
            if place:
                artist.set(alpha=_FADED, zorder=0.5)
    _frame(ax)
    return ax


def _nearest(run: Trajectory, poses: Array, time: float) -> int:
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
    _room(ax, above=2.5)
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


@dataclass(frozen=True)
class _Label:
    """A name in the picture."""

    text: str
    place: Array  # what it names
    keep: float  # radius about that place which the label keeps clear of
    middle: Array
    size: tuple[float, float]
    line: float  # height of a line
    body: str = ""  # the body it names, if any

    @property
    def half(self) -> Array:
        """Half its width and height."""
        return 0.5 * np.array(self.size)


def _room(ax: Axes, below: float = 0.0, above: float = 0.0) -> None:
    """Room for lines of text under and over all that is drawn."""
    held = np.array(ax.dataLim.extents).reshape(2, 2)
    line = float(ax.xaxis.label.get_fontsize()) * _span_of_a_point(ax, held)
    ax.update_datalim([(held[0, 0], held[0, 1] - below * line), (held[1, 0], held[1, 1] + above * line)])
    ax.autoscale_view()


def _label_parts(ax: Axes, pen: Pen) -> None:
    """Names of bodies on them, and names of joints and forces beside them."""
    drawn = np.array(ax.dataLim.extents).reshape(2, 2)
    font = float(ax.xaxis.label.get_fontsize())
    for scale in _SCALES:
        held = drawn
        # Labels widen the limits, so that a letter takes more of them: after a few rounds the sizes hold.
        for _ in range(_ROUNDS):
            labels = _placed(pen, scale * font * _span_of_a_point(ax, held))
            ends = [
                label.middle + 0.5 * side * np.array(label.size) for label in labels for side in (-1.0, 1.0)
            ]
            held = np.array([*drawn, *ends])
        if _span_of_a_point(ax, drawn) > _LEAST_SHARE * _span_of_a_point(ax, held):
            break
    style = {"boxstyle": "round,pad=0.1", "facecolor": "white", "edgecolor": "none", "alpha": 0.7}
    for label in labels:
        color = pen.pose.colors[label.body] if label.body else "0.25"
        _lead(ax, label, color)
        kind: dict[str, Any] = _OF_BODIES if label.body else _BESIDE
        ax.text(
            float(label.middle[0]),
            float(label.middle[1]),
            typeset(label.text),
            color=color,
            ha="center",
            va="center",
            bbox=style,
            zorder=9,
            **kind | {"fontsize": kind["fontsize"] * scale * font},
        )
    ax.update_datalim(held)
    # What the margins were for lies within the limits now.
    ax.margins(_LABELED_MARGIN)
    ax.autoscale_view()


def _lead(ax: Axes, label: _Label, color: str) -> None:
    """A thin line from what a label names to the label, where it stands apart."""
    away = label.middle - label.place
    edge = label.middle + np.clip(-away, -label.half, label.half)
    gap = float(np.hypot(*(edge - label.place))) - label.keep
    if gap > 0.8 * label.line:
        foot = label.place + label.keep * away / np.hypot(*away)
        ax.plot(*zip(foot, edge, strict=True), color=color, linewidth=0.5, zorder=8.5)


def _span_of_a_point(ax: Axes, held: Array) -> float:
    """What a typographic point takes of the axes when they hold these places at equal scales [m]."""
    width, height = (1.0 + 2.0 * _LABELED_MARGIN) * np.ptp(held, axis=0)
    return max(float(width) / size_of(ax)[0], float(height) / size_of(ax)[1])


def _placed(pen: Pen, letter: float) -> list[_Label]:
    """Names of bodies, joints and forces where they have room, for a size of the font [m]."""
    pose, clutter, labels = pen.pose, pen.clutter.copy(), []
    for body in pose.scene.bodies:
        words, corners = _lines(plain_words(body.name)), np.array(pose.points[body.name])
        size = (_BOLD * letter * max(map(len, words)) + 0.2 * letter, letter * len(words))
        place = corners.mean(axis=0)
        spots = along_body(corners, size, letter, _outward(pose, place))
        spot = clutter.place(spots, size, letter, body.name)
        shown = spot.middle if spot.on_body else place
        labels.append(_Label("\n".join(words), shown, 0.0, spot.middle, size, letter, body.name))
    for place, names, radius in _named_by_place(pen):
        words = _lines(", ".join(map(plain_words, names)))
        line = 0.85 * letter
        size = (_ITALIC * letter * max(map(len, words)) + 0.2 * letter, line * len(words))
        keep = radius + 0.012 * pen.unit
        spot = clutter.place(around(place, keep, size, line, _outward(pose, place)), size, line)
        labels.append(_Label("\n".join(words), place, keep, spot.middle, size, line))
    return labels


def _lines(text: str) -> list[str]:
    """The lines of a label."""
    return textwrap.wrap(text, _LONGEST, break_long_words=False) or [""]


def _outward(pose: Pose, place: Array) -> Array:
    """Unit vector from the middle of the mechanism to a place, or nothing in the middle."""
    away = place - pose.center
    return away / (np.hypot(*away) or 1.0)


def _named_by_place(pen: Pen) -> Iterator[tuple[Array, list[str], float]]:
    """Joints that lie on each other share a label."""
    left = list(pen.named)
    while left:
        place = left[0][0]
        near = [item for item in left if np.hypot(*(item[0] - place)) < 0.02 * pen.unit]
        left = [item for item in left if not any(item is other for other in near)]
        yield place, [name for _, name, _ in near], max(radius for _, _, radius in near)
