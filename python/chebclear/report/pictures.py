"""Figures inside an HTML file."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from .document import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH = 4.5
"""Width of a picture [in]: wider ones cannot be read on a telephone."""

_RESOLUTION = 200

_STYLE: dict[Any, Any] = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.grid": True,
    "grid.alpha": 0.3,
}


def embedded(picture: Picture, files: Mapping[str, Path] = MappingProxyType({})) -> str:
    """A picture as the ``data:`` address of an ``<img>``, and as a file where it has one.

    As pixels, which are drawn once for both: many lines are six times as large as paths, few as large.
    """
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(WIDTH, picture.height), layout="constrained")
        picture.draw(ax=figure.add_subplot())
        content = png(figure, _RESOLUTION)
    if picture.name in files:
        files[picture.name].write_bytes(content)
    return f"data:image/png;base64,{base64.b64encode(content).decode()}"


def png(figure: Figure, resolution: float) -> bytes:
    """A figure as pixels, so many to an inch. `Figure.savefig` would draw it twice."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    content = io.BytesIO()
    figure.set_dpi(resolution)
    canvas: Any = FigureCanvasAgg(figure)
    canvas.print_png(content, metadata={"Software": None})
    return content.getvalue()
