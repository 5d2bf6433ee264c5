"""Figures inside an HTML file."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from .document import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH = 4.5
"""Width of a picture [in]: wider ones cannot be read on a telephone."""

# Above so many vertices a picture is smaller as pixels: 80 lines of 1441 samples are 673 kB as paths, 109 kB
# as pixels.
_MOST_VERTICES = 20_000
_RESOLUTION = 200

_STYLE: dict[Any, Any] = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.grid": True,
    "grid.alpha": 0.3,
    "svg.fonttype": "path",  # the same on every computer
    "svg.hashsalt": "chebclear",  # the same bytes each time
    "path.simplify": True,
}


def embedded(picture: Picture, files: Mapping[str, Path] = MappingProxyType({})) -> str:
    """A picture as the ``data:`` address of an ``<img>``: paths, or pixels where there are too many of them.

    Pictures are images of their own since the ids of several drawings inside one page would clash. Those with
    a file get it as pixels too: drawn and laid out once for both.
    """
    import matplotlib
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    with matplotlib.rc_context(_STYLE):
        layout = ConstrainedLayoutEngine()
        figure = Figure(figsize=(WIDTH, picture.height), layout=layout)
        picture.draw(figure.add_subplot())
        layout.execute(figure)
        figure.set_layout_engine("none")  # else each file lays it out again
        pixels, paths = io.BytesIO(), io.BytesIO()
        heavy = _vertices(figure) > _MOST_VERTICES
        if heavy or picture.name in files:
            figure.savefig(pixels, format="png", dpi=_RESOLUTION, metadata={"Software": None})
        if picture.name in files:
            files[picture.name].write_bytes(pixels.getvalue())
        if not heavy:
            figure.savefig(paths, format="svg", metadata={"Date": None})
    kind, content = ("png", pixels) if heavy else ("svg+xml", paths)
    return f"data:image/{kind};base64,{base64.b64encode(content.getvalue()).decode()}"


def _vertices(figure: Figure) -> int:
    """Points of all lines and filled areas."""
    count = 0
    for axes in figure.axes:
        count += sum(np.size(line.get_xdata()) for line in axes.lines)
        count += sum(np.shape(path.vertices)[0] for area in axes.collections for path in area.get_paths())
    return count
