"""Mechanisms and runs as films: for pages, notebooks and reports."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...base.prefixes import prefix_of
from ...base.tables import format_number
from ...report.film import Film, Label, Panel, Shape, chart
from ...scene.columns import column_unit, column_words, plain_words
from ...scene.motions import Speed
from ...scene.parts import loose_joints, owner_of
from ...scene.scene import Scene
from ..drawing.pose import colors_of, pose_columns, simulated_poses
from ..drawing.strokes import Enlarged, Owner, Stroke
from .motion import MovingMechanism, moving_mechanism

if TYPE_CHECKING:
    from ...run.trajectory import Trajectory

Array = NDArray[np.float64]

# The magnified joint in radii of the journal: clearance, and half the width of the picture.
GAP, VIEW = 0.35, 2.5
_FORCE, _TRAIL = "#AA3377", "path of the center of the journal"
_STILL = np.array([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]])
MOST_FRAMES = 121
"""Frames of a film in a report [-]."""
# Light of the names of bodies, relative to that of their colors [-]: each has a contrast above 4.5 to white.
_DARKER = 0.6
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
        labels=_labels(moving, owners),
        scale=prefix_of(float(np.max(high - low)), "m"),
    )


def _labels(moving: MovingMechanism, owners: list[Owner]) -> list[Label]:
    """The name of each body in the middle of its points."""
    from matplotlib.colors import to_hex, to_rgb

    first, labels = moving.first, []
    for body in moving.scene.bodies:
        if body.name in owners and first.points[body.name]:
            middle = np.mean(first.points[body.name], axis=0)
            # Darker than the body, so that it can be read on white.
            red, green, blue = to_rgb(first.colors[body.name])
            color = to_hex((_DARKER * red, _DARKER * green, _DARKER * blue))
            labels.append(Label(plain_words(body.name), middle, owners.index(body.name), color))
    return labels


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
    charts = [chart(name, column_unit(name), x, run[name], written=run.written) for name in names]
    words, panels = mechanism_words(run.scene), []
    if set(pose_columns(run.scene)) <= set(run.columns):
        panels = [mechanism_panel(moving_mechanism(run.scene, simulated_poses(run)[frames]), words)]
    return Film(
        "The mechanism and its outputs", label, x[frames], instants(run.scene, run.t[frames]), panels, charts
    )


def moving_film(
    moving: MovingMechanism,
    t: Array,
    frames: NDArray[np.int64],
    output: str,
    values: Array,
    panels: list[Panel],
    rate: int,
    what: str,
) -> tuple[Film, str]:
    """A mechanism in motion with one output at instants [s], of which some are frames; and a note on it."""
    x, label = time_axis(t)
    words, places = mechanism_words(moving.scene), instants(moving.scene, t[frames])
    if moving.exaggerate > 1.0:
        places = [f"{place}, clearances drawn {moving.exaggerate:g} times larger" for place in places]
    charts = [chart(output, column_unit(output), x, values)]
    panels = [mechanism_panel(moving, words), *panels]
    span = float(t[frames[-1]] - t[frames[0]])
    note = f"{span:.4g} s of {what}, {(len(frames) - 1) / rate / span:.3g} times slower, with its "
    film = Film(words, label, x[frames], places, panels, charts, rate=rate, starts=True)
    return film, f"{note}{column_words(output)}."


def _shape(stroke: Stroke, moves: int) -> Shape:
    from matplotlib.colors import to_hex

    face = stroke.face if stroke.face == "none" else to_hex(stroke.face)
    owner = stroke.owner.body if isinstance(stroke.owner, Enlarged) else stroke.owner
    return Shape(
        stroke.kind,
        stroke.points,
        moves,
        to_hex(stroke.color),
        stroke.width,
        face,
        stroke.alpha,
        stroke.radius,
        name=plain_words(owner) if isinstance(owner, str) else "",
    )


def bearing_panel(run: Trajectory, name: str, samples: NDArray[np.int64], frames: NDArray[np.int64]) -> Panel:
    """A clearance joint magnified, in radii of its journal, with the contact force on it as an arrow; the
    frames are some of the samples."""
    joint = next(joint for joint in loose_joints(run.scene.joints) if joint.name == name)
    colors = colors_of(run.scene)
    outer, inner = colors[owner_of(joint.bearing)], colors[owner_of(joint.journal)]
    eccentricity, forces = journal_of(run, name, samples)
    path, forces = GAP * eccentricity / joint.clearance, forces[frames]
    tails, tips, full = arrows(path[frames], forces)
    center = np.zeros((1, 2))
    arm = 0.12 * np.array([[-1.0, 0.0], [1.0, 0.0]])
    shaft, head = np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[1.0, 0.0], [0.78, 0.088], [0.78, -0.088]])
    shapes = [
        Shape("disc", center, 0, outer, 2.5, "#ffffff", radius=1.0 + GAP, name="bearing"),
        Shape("disc", center, 1, inner, 1.0, inner, 0.55, radius=1.0, name="journal"),
        Shape("line", path[np.isfinite(path).all(axis=1)], 0, "#777777", 0.6, name=_TRAIL),
        Shape("disc", center, 0, "#404040", 0.8, radius=GAP, dashed=True, name="contact"),
        *(Shape("line", arm @ turn, 0, outer, 1.0) for turn in (np.eye(2), np.eye(2)[::-1])),
        *(Shape("line", arm @ turn, 1, "#000000", 1.0) for turn in (np.eye(2), np.eye(2)[::-1])),
        Shape("line", shaft, 2, _FORCE, 2.0),
        Shape("area", head, 2, _FORCE, 1.0, _FORCE),
    ]
    journal = np.column_stack([np.tile(_STILL[0, :4], (len(frames), 1)), path[frames]])
    x, y = (tips - tails).T
    texts = [
        f"contact force {format_number(force, 3)} N" if force > 0.0 else "free flight"
        for force in np.hypot(*forces.T).tolist()
    ]
    larger = GAP * joint.journal_radius / joint.clearance
    title = (
        f"{plain_words(name)}, clearance drawn {larger:.3g} times larger; contact force on the "
        f"journal, longest arrow: {format_number(full, 3)} N"
    )
    transforms = [_STILL, journal, np.column_stack([x, y, -y, x, tails])]
    return Panel(title, (-VIEW, VIEW, -VIEW, VIEW), shapes, transforms, texts)


def arrows(path: Array, force: Array) -> tuple[Array, Array, float]:
    """Tails and tips of the contact force on a journal, which acts where the surfaces touch.

    The third is the force that has the longest arrow, one radius of the journal: few frames have more, which
    would leave the others none. Tail and tip are one in free flight.
    """
    strength, size = np.hypot(*force.T), np.hypot(*path.T)
    pressed = strength[strength > 0.0]
    full = float(np.quantile(pressed, 0.9)) if len(pressed) else 0.0
    acts = (strength > 0.0) & (size > 0.0)
    tips = np.where(acts, 1.0 + 1.0 / np.where(acts, size, 1.0), 1.0)[:, None] * path
    scale = np.where(acts, np.minimum(1.0 / np.where(acts, strength, 1.0), 1.0 / (full or 1.0)), 0.0)
    return tips - scale[:, None] * force, tips, full


def journal_of(run: Trajectory, name: str, samples: NDArray[np.int64]) -> tuple[Array, Array]:
    """Places of a journal in its bearing [m] and contact forces on it [N] at samples, shape (samples, 2)."""
    eccentricity = np.column_stack([run[f"{name}.eccentricity_{axis}"][samples] for axis in "xy"])
    size = np.hypot(*eccentricity.T)
    normal = eccentricity / np.where(size > 0.0, size, 1.0)[:, None]
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    pressed, dragged = (run[f"{name}.{kind}_force"][samples][:, None] for kind in ("normal", "friction"))
    # On the journal the normal force points back to the center of the bearing.
    return eccentricity, dragged * tangent - pressed * normal
