"""The figure of an animation: a film, its mechanism at the left, at any of its frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...report.film import Chart, Film, Panel
from ...scene.columns import column_words
from ...scene.scene import Scene
from ..axes import COLORS
from ..drawing.scene import draw_gravity
from ..drawing.strokes import put_on
from ..labels import in_lines, set_labels, typeset, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

# Part of the width of the figure for the mechanism [-].
_SCENE_SHARE = 0.6


class Stage:
    """A figure with all moving and all fixed parts."""

    def __init__(self, film: Film, scene: Scene, size: tuple[float, float]) -> None:
        from matplotlib.figure import Figure

        self.film = film
        self.figure: Figure = Figure(figsize=size, layout="constrained")
        first, *others = film.panels
        shares = (_SCENE_SHARE, 1.0 - _SCENE_SHARE)
        grid = self.figure.add_gridspec(1 + len(others), 2, width_ratios=shares)
        self.moving: list[Any] = []
        self._shapes: list[tuple[Any, Panel, int, Axes]] = []
        self._texts: list[tuple[Text, Sequence[str]]] = []
        self._draw_mechanism(self.figure.add_subplot(grid[:, 0]), first, scene)
        for row, panel in enumerate(others):
            self._draw_magnified(self.figure.add_subplot(grid[row, 1]), panel)
        self._draw_chart(self.figure.add_subplot(grid[-1, 1]), film.charts[0])
        self.show(0)

    def show(self, frame: int) -> list[Any]:
        """Move everything to a frame; the artists that move."""
        from matplotlib.transforms import Affine2D

        for artist, panel, moves, ax in self._shapes:
            steps = panel.transforms[moves]
            a, b, c, d, e, f = steps[min(frame, len(steps) - 1)]
            artist.set_transform(Affine2D(np.array([[a, c, e], [b, d, f], [0, 0, 1]])) + ax.transData)
            artist.set_visible(any((a, b, c, d)))
        for text, words in self._texts:
            text.set_text(typeset(words[frame]))
        chart, at = self.film.charts[0], self.film.at[frame]
        until = int(np.searchsorted(chart.x, at, side="right"))
        self.done.set_data(chart.x[:until], chart.nominal[:until])
        self.now.set_data([at], [np.interp(at, chart.x, chart.nominal)])
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
            for frame in range(len(self.film.at)):
                canvas.restore_region(still)
                for artist in sorted(self.show(frame), key=lambda artist: artist.get_zorder()):
                    self.figure.draw_artist(artist)
                yield np.asarray(canvas.buffer_rgba())[..., :3].copy()
        finally:
            for artist in self.moving:
                artist.set_animated(False)

    def _draw_mechanism(self, ax: Axes, panel: Panel, scene: Scene) -> None:
        self._put(ax, panel, self.film.places, "0.3")
        ax.set_aspect("equal", adjustable="datalim")
        ax.margins(0.03)  # room for the words below and for the arrow of gravity
        ax.update_datalim(np.reshape(panel.view, (2, 2)).T)
        ax.autoscale_view()
        set_labels(ax, "x [m]", "y [m]")
        draw_gravity(ax, scene)

    def _draw_magnified(self, ax: Axes, panel: Panel) -> None:
        self._put(ax, panel, panel.texts, panel.shapes[-1].color)
        low, high, bottom, top = panel.view
        ax.set(aspect="equal", xlim=(low, high), ylim=(bottom, top), xticks=[], yticks=[])
        title = ax.set_title("", fontsize="small")
        # The column that holds these axes is wider than they are; some of it is for the numbers of the plot.
        room = 0.8 * (1.0 - _SCENE_SHARE) * self.figure.get_figwidth() * 72.0
        title.set_text(in_lines(panel.title, room, float(title.get_fontsize())))

    def _put(self, ax: Axes, panel: Panel, words: Sequence[str], color: str) -> None:
        """The shapes of a panel, and its text at every frame."""
        for shape, artist in zip(panel.shapes, put_on(ax, panel.shapes), strict=True):
            self._shapes.append((artist, panel, shape.moves, ax))
            if len(panel.transforms[shape.moves]) > 1:
                self.moving.append(artist)
        text = ax.text(0.02, 0.02, "", transform=ax.transAxes, fontsize="small", color=color, zorder=10)
        self._texts.append((text, words))
        self.moving.append(text)

    def _draw_chart(self, ax: Axes, chart: Chart) -> None:
        ax.plot(chart.x, chart.nominal, color="0.75", linewidth=0.7)
        (self.done,) = ax.plot([], [], color=COLORS[0], linewidth=0.9)
        (self.now,) = ax.plot([], [], color=COLORS[0], marker="o", markersize=4.0)
        set_labels(ax, self.film.label, with_unit(column_words(chart.name), chart.unit))
        self.moving += [self.done, self.now]
