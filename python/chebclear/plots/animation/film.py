"""Mechanisms and runs as films: for pages, notebooks and reports."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...base.prefixes import prefix_of
from ...report.film import Film, Panel, Shape, chart
from ...scene.columns import column_unit, plain_words
from ...scene.scene import Scene, Speed
from ..drawing.pose import pose_columns, simulated_poses
from ..drawing.strokes import Stroke
from .motion import LooseJoint, Motion, MovingMechanism, moving_mechanism
from .stage import FORCE, GAP, REACH, VIEW, arrow, arrow_head, bearing_words, drawn_path, force_words

if TYPE_CHECKING:
    from ...run.trajectory import Trajectory

Array = NDArray[np.float64]

_STILL = np.array([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]])
MOST_FRAMES = 121
"""Frames of a film in a report [-]."""
# Room around a mechanism, relative to its size [-].
_MARGIN = 0.05


def mechanism_words(scene: Scene) -> str:
    """What a drawing of a scene shows, in words."""
    return f"Mechanism of {', '.join(plain_words(body.name) for body in scene.bodies)}"


def mechanism_panel(moving: MovingMechanism, title: str) -> Panel:
    """The drawing of a mechanism that moves."""
    low, high = moving.view()
    room = _MARGIN * float(np.max(high - low))
    owners = list(moving.transforms)
    steps = [moving.transforms[owner] for owner in owners]
    return Panel(
        title,
        (low[0] - room, high[0] + room, low[1] - room, high[1] + room),
        [_shape(stroke, owners.index(stroke.owner)) for stroke in moving.strokes],
        [one if np.any(one != one[0]) else one[:1] for one in steps],
        scale=prefix_of(float(np.max(high - low)), "m"),
    )


def instants(scene: Scene, t: Array) -> list[str]:
    """Instants in words, with the angle of the crank where one turns at constant speed."""
    factor, shown = prefix_of(float(np.abs(t).max()), "s")
    speeds = [drive for drive in scene.drives if isinstance(drive, Speed)]
    words = [f"t = {factor * one:.4g} {shown}" for one in t]
    if len(speeds) != 1:
        return words
    angles = np.round(np.degrees(speeds[0].angle + speeds[0].speed * t), 1) % 360.0
    name = plain_words(speeds[0].joint)
    return [f"{word}, {name} at {angle:.1f}°" for word, angle in zip(words, angles, strict=True)]


def evenly(samples: int, most: int) -> NDArray[np.int64]:
    """At most so many of the samples, evenly chosen, both ends included."""
    return np.unique(np.linspace(0, samples - 1, most).round().astype(np.int64))


def time_axis(t: Array) -> tuple[Array, str]:
    """Instants with a prefix, and the label of the axis."""
    factor, shown = prefix_of(float(np.abs(t).max()), "s")
    return factor * t, f"time [{shown}]"


def outputs_film(run: Trajectory, names: Sequence[str]) -> Film:
    """Outputs of a run over time, with the mechanism if the run has the positions of its bodies."""
    frames = evenly(int(np.sum(run.t <= run.end_time)), MOST_FRAMES)
    x, label = time_axis(run.t)
    charts = [chart(name, column_unit(name), x, run[name]) for name in names]
    words, panels = mechanism_words(run.scene), []
    if set(pose_columns(run.scene)) <= set(run.columns):
        panels = [mechanism_panel(moving_mechanism(run.scene, simulated_poses(run)[frames]), words)]
    return Film(
        "The mechanism and its outputs", label, x[frames], instants(run.scene, run.t[frames]), panels, charts
    )


def run_film(motion: Motion, rate: int) -> Film:
    """A run as an animation shows it: the mechanism, the magnified joint, one output."""
    x, label = time_axis(motion.t)
    words, frames = mechanism_words(motion.scene), motion.frames
    panels = [mechanism_panel(motion, words)]
    if motion.loose is not None:
        panels.append(_bearing(motion, motion.loose))
    charts = [chart(motion.output, motion.unit, x, motion.values)]
    places = instants(motion.scene, motion.t[frames])
    return Film(words, label, x[frames], places, panels, charts, rate=rate, starts=True)


def _shape(stroke: Stroke, moves: int) -> Shape:
    from matplotlib.colors import to_hex

    face = stroke.face if stroke.face == "none" else to_hex(stroke.face)
    owner = stroke.owner if isinstance(stroke.owner, str) else ""
    return Shape(
        stroke.kind,
        stroke.points,
        moves,
        to_hex(stroke.color),
        stroke.width,
        face,
        stroke.alpha,
        stroke.radius,
        name=plain_words(owner),
    )


def _bearing(motion: Motion, loose: LooseJoint) -> Panel:
    """The magnified joint, in radii of its journal, with the contact force on the journal as an arrow."""
    outer, inner = loose.colors
    path = drawn_path(loose)
    center = np.zeros((1, 2))
    arm = 0.12 * np.array([[-1.0, 0.0], [1.0, 0.0]])
    unit_arrow = np.array([[0.0, 0.0], [REACH, 0.0]])
    trail = path[np.isfinite(path).all(axis=1)]
    shapes = [
        Shape("disc", center, 0, outer, 2.5, "#ffffff", radius=1.0 + GAP, name="bearing"),
        Shape("disc", center, 1, inner, 1.0, inner, 0.55, radius=1.0, name="journal"),
        Shape("line", trail, 0, "#777777", 0.6, name="path of the center of the journal"),
        Shape("disc", center, 0, "#404040", 0.8, radius=GAP, dashed=True, name="contact"),
        *(Shape("line", arm @ turn, 0, outer, 1.0) for turn in (np.eye(2), np.eye(2)[::-1])),
        *(Shape("line", arm @ turn, 1, "#000000", 1.0) for turn in (np.eye(2), np.eye(2)[::-1])),
        Shape("line", unit_arrow, 2, FORCE, 2.0),
        Shape("area", arrow_head(*unit_arrow), 2, FORCE, 1.0, FORCE),
    ]
    journal = np.column_stack([np.tile(_STILL[0, :4], (len(motion.frames), 1)), path[motion.frames]])
    forces = np.array([_arrow_steps(*arrow(loose, motion.frames, int(sample))) for sample in motion.frames])
    texts = [force_words(float(force)) for force in np.hypot(*loose.force[motion.frames].T)]
    view = (-VIEW, VIEW, -VIEW, VIEW)
    return Panel(bearing_words(loose, motion.frames), view, shapes, [_STILL, journal, forces], texts)


def _arrow_steps(tail: Array, tip: Array) -> Array:
    """What takes the arrow along the first axis to another one."""
    x, y = (tip - tail) / REACH
    return np.array([x, y, -y, x, *tail])
