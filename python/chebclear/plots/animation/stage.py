"""The figure of an animation: the mechanism, the magnified joint and the running plot, at any frame."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...base.tables import format_number
from ...scene.columns import column_words, plain_words
from ...scene.scene import ClearanceRevolute
from ..axes import COLORS
from ..drawing.scene import draw_gravity
from ..drawing.strokes import put_on
from ..labels import in_lines, set_labels, typeset, with_unit
from .motion import LooseJoint, Motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

# The magnified joint in radii of the journal: clearance, longest arrow, and half the width of the picture.
GAP, REACH, VIEW = 0.35, 1.0, 2.5
FORCE = "#AA3377"
# Part of the width of the figure for the mechanism [-].
_SCENE_SHARE = 0.6


class Stage:
    """A figure with all moving and all fixed parts."""

    def __init__(self, motion: Motion, size: tuple[float, float]) -> None:
        from matplotlib.figure import Figure

        self.motion = motion
        self.figure: Figure = Figure(figsize=size, layout="constrained")
        grid = self.figure.add_gridspec(2, 2, width_ratios=(_SCENE_SHARE, 1.0 - _SCENE_SHARE))
        self.scene = self.figure.add_subplot(grid[:, 0])
        self.moving: list[Any] = []
        self.artists = self._draw_scene(self.scene)
        self.bearing: Axes | None = None
        if motion.loose is not None:
            self.bearing = self.figure.add_subplot(grid[0, 1])
            self._draw_bearing(self.bearing, motion.loose)
        self.plot = self.figure.add_subplot(grid[1, 1] if motion.loose is not None else grid[:, 1])
        self._draw_plot(self.plot)
        self.show(0)

    def show(self, frame: int) -> list[Any]:
        """Move everything to a frame; the artists that move."""
        from matplotlib.transforms import Affine2D

        motion, sample = self.motion, int(self.motion.frames[frame])
        for stroke, artist in zip(motion.strokes, self.artists, strict=True):
            a, b, c, d, e, f = motion.transforms[stroke.owner][frame]
            artist.set_transform(Affine2D(np.array([[a, c, e], [b, d, f], [0, 0, 1]])) + self.scene.transData)
        self.clock.set_text(typeset(f"t = {motion.t[sample]:.5f} s"))
        self.done.set_data(motion.t[: sample + 1], motion.values[: sample + 1])
        self.now.set_data([motion.t[sample]], [motion.values[sample]])
        if motion.loose is not None:
            self._show_bearing(motion.loose, sample)
        return self.moving

    def settle(self) -> None:
        """Lay the figure out once and for all: else the size of the axes would change with the labels."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        FigureCanvasAgg(self.figure)
        self.figure.draw_without_rendering()
        self.figure.set_layout_engine("none")

    def pictures(self) -> Iterator[NDArray[np.uint8]]:
        """All frames as pictures, shape (height, width, 3); only what moves is drawn again."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        self.settle()
        canvas: Any = FigureCanvasAgg(self.figure)
        for artist in self.moving:
            artist.set_animated(True)
        try:
            canvas.draw()
            still = canvas.copy_from_bbox(self.figure.bbox)
            for frame in range(len(self.motion.frames)):
                canvas.restore_region(still)
                for artist in sorted(self.show(frame), key=lambda artist: artist.get_zorder()):
                    self.figure.draw_artist(artist)
                yield np.asarray(canvas.buffer_rgba())[..., :3].copy()
        finally:
            for artist in self.moving:
                artist.set_animated(False)

    def _draw_scene(self, ax: Axes) -> list[Any]:
        artists = put_on(ax, self.motion.strokes)
        low, high = self.motion.view()
        # Room for the words below and for the arrow of gravity.
        margin = 0.08 * float(np.max(high - low))
        ax.set_aspect("equal", adjustable="datalim")
        ax.margins(0.0)
        ax.update_datalim([low - margin, high + margin])
        ax.autoscale_view()
        set_labels(ax, "x [m]", "y [m]")
        draw_gravity(ax, self.motion.scene)
        self.clock = ax.text(0.02, 0.02, "", transform=ax.transAxes, fontsize="small", color="0.3", zorder=10)
        self.moving += [*artists, self.clock]
        return artists

    def _draw_bearing(self, ax: Axes, loose: LooseJoint) -> None:
        from matplotlib.patches import Circle

        outer, inner = loose.colors
        ax.add_patch(Circle((0.0, 0.0), 1.0 + GAP, facecolor="white", edgecolor=outer, linewidth=2.5))
        (self.trail,) = ax.plot([], [], color="0.6", linewidth=0.6, zorder=4)
        self.journal = Circle((0.0, 0.0), 1.0, facecolor=inner, edgecolor=inner, alpha=0.55, zorder=2)
        ax.add_patch(self.journal)
        (self.center,) = ax.plot([], [], color="black", marker="+", markersize=7.0, zorder=5)
        ax.plot([0.0], [0.0], color=outer, marker="+", markersize=7.0, zorder=3)
        # The circle that the center reaches where the surfaces touch.
        ax.add_patch(
            Circle(
                (0.0, 0.0), GAP, facecolor="none", edgecolor="0.25", linestyle="--", linewidth=0.8, zorder=4
            )
        )
        (self.shaft,) = ax.plot([], [], color=FORCE, linewidth=2.0, zorder=6)
        (self.head,) = ax.fill([0.0], [0.0], color=FORCE, linewidth=0.0, zorder=6)
        self.strength = ax.text(
            0.02, 0.02, "", transform=ax.transAxes, fontsize="small", color=FORCE, zorder=10
        )
        ax.set_aspect("equal", adjustable="box")
        ax.set_xlim(-VIEW, VIEW)
        ax.set_ylim(-VIEW, VIEW)
        ax.set_xticks([])
        ax.set_yticks([])
        title = ax.set_title("", fontsize="small")
        # The column that holds these axes is wider than they are; some of it is for the numbers of the plot.
        room = 0.8 * (1.0 - _SCENE_SHARE) * self.figure.get_figwidth() * 72.0
        words = bearing_words(loose, self.motion.frames)
        title.set_text(in_lines(words, room, float(title.get_fontsize())))
        self.moving += [self.trail, self.journal, self.center, self.shaft, self.head, self.strength]

    def _show_bearing(self, loose: LooseJoint, sample: int) -> None:
        path = drawn_path(loose)
        place = path[sample]
        self.trail.set_data(*path[: sample + 1].T)
        self.journal.set_center(tuple(place))
        self.center.set_data([place[0]], [place[1]])
        tail, tip = arrow(loose, self.motion.frames, sample)
        self.shaft.set_data(*np.array([tail, tip]).T)
        self.head.set_xy(arrow_head(tail, tip))
        force = float(np.hypot(*loose.force[sample]))
        self.strength.set_text(typeset(force_words(force)))

    def _draw_plot(self, ax: Axes) -> None:
        motion = self.motion
        ax.plot(motion.t, motion.values, color="0.75", linewidth=0.7)
        (self.done,) = ax.plot([], [], color=COLORS[0], linewidth=0.9)
        (self.now,) = ax.plot([], [], color=COLORS[0], marker="o", markersize=4.0)
        set_labels(ax, "time [s]", with_unit(column_words(motion.output), motion.unit))
        self.moving += [self.done, self.now]


def bearing_words(loose: LooseJoint, frames: NDArray[np.int64]) -> str:
    """What the magnified joint shows."""
    name, full = plain_words(loose.joint.name), format_number(full_force(loose, frames), 3)
    return (
        f"{name}, clearance drawn {magnification(loose.joint):.3g} times larger; contact force on the "
        f"journal, longest arrow: {full} N"
    )


def magnification(joint: ClearanceRevolute) -> float:
    """How much larger than the journal the clearance is drawn, relative to what it is [-]."""
    return GAP * joint.journal_radius / joint.clearance


def drawn_path(loose: LooseJoint) -> Array:
    """Centers of the journal in the magnified picture, shape (samples, 2)."""
    path: Array = GAP * loose.eccentricity / loose.joint.clearance
    return path


def force_words(force: float) -> str:
    """The contact force [N]."""
    return f"contact force {format_number(force, 3)} N" if force > 0.0 else "free flight"


def full_force(loose: LooseJoint, frames: NDArray[np.int64]) -> float:
    """The force that has the longest arrow [N]: few frames have more, which would leave the others none."""
    forces = np.hypot(*loose.force[frames].T)
    pressed = forces[forces > 0.0]
    return float(np.quantile(pressed, 0.9)) if len(pressed) else 0.0


def arrow(loose: LooseJoint, frames: NDArray[np.int64], sample: int) -> tuple[Array, Array]:
    """Tail and tip of the contact force in the magnified picture; it acts on the journal where they touch."""
    force = loose.force[sample]
    strength, full = float(np.hypot(*force)), full_force(loose, frames)
    place = drawn_path(loose)[sample]
    size = float(np.hypot(*place))
    if not strength > 0.0 or not full > 0.0 or not size > 0.0:
        return place, place
    tip = place * (1.0 + 1.0 / size)
    return tip - REACH * min(1.0, strength / full) * force / strength, tip


def arrow_head(tail: Array, tip: Array) -> Array:
    """Corners of the head of an arrow; a short arrow has a small one."""
    way = tip - tail
    length = float(np.hypot(*way))
    size = min(0.22, length)
    if not size > 0.0:
        return np.array([tip, tip, tip])
    way = way / length
    across = np.array([-way[1], way[0]])
    corners: Array = np.array(
        [tip, tip - size * way + 0.4 * size * across, tip - size * way - 0.4 * size * across]
    )
    return corners
