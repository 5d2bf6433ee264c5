"""Labels and legends that are read in full: beside the axes and above the data."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Width of a letter, as a part of the size of the font: that of a wide text in matplotlib's own font.
_LETTER = 0.6


def with_unit(name: str, unit: str) -> str:
    """A name and its unit in brackets; either may be empty."""
    return " ".join(part for part in (name, f"[{unit}]" if unit else "") if part)


def set_y_label(ax: Axes, text: str) -> None:
    """A label beside the axes, in as many lines as the height needs."""
    label = ax.set_ylabel("")
    # Beside other axes a label has the height of its own, alone that of the figure.
    figure = ax.figure
    height = _height(ax) if len(figure.axes) > 1 else figure.bbox.height / figure.dpi * 72.0
    width = max(8, int(height / (_LETTER * float(label.get_fontsize()))))
    label.set_text(textwrap.fill(text, width, break_long_words=False, break_on_hyphens=False))


def legend_above_the_data(ax: Axes) -> None:
    """A legend in the upper part of the axes, whose limits leave it room above all that is drawn."""
    legend = ax.legend(loc="upper center", fontsize="small")
    texts = legend.get_texts()
    # A line of a legend is one and a half letters high; its frame and distance add two.
    room = (1.5 * len(texts) + 2.0) * float(texts[0].get_fontsize())
    share = min(0.5, room / _height(ax))
    drawn = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in ax.lines])
    lowest, highest = np.nanmin(drawn, initial=np.inf), np.nanmax(drawn, initial=-np.inf)
    if not lowest < highest:
        return
    # No fixed limits: they would be in the way of the equal scales.
    ax.update_datalim([(0.0, lowest + (highest - lowest) / (1.0 - share))])
    ax.autoscale_view()


def _height(ax: Axes) -> float:
    """Height of the axes [points]."""
    return float(ax.get_window_extent().height / ax.figure.dpi * 72.0)
