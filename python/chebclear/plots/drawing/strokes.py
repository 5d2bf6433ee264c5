"""Lines, areas and discs of a drawing, each with what it moves with; and how they are put on axes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...base.units import unit
from ...report.film import Shape

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Enlarged:
    """The part of a body in a joint whose play is drawn larger than it is."""

    body: str
    joint: str


Owner = str | tuple[str, str] | Enlarged
"""What a stroke moves with: a body or ground; the line between two points, with which it is stretched; a
point given twice, which it follows without turning; or a part in enlarged play."""


@dataclass(frozen=True)
class Stroke:
    """One line, area or disc where it is in the drawing."""

    kind: Literal["line", "area", "disc"]
    points: Array = field(metadata=unit("m"))
    """Corners, or the center of a disc [m], shape (points, 2)."""
    owner: Owner
    """What it moves with."""
    layer: float
    """Higher ones lie above lower ones [-]."""
    color: str
    """Color of the line or edge."""
    width: float = field(default=1.0, metadata=unit("points"))
    """Width of the line or edge [points]."""
    face: str = "none"
    """Color of the inside."""
    alpha: float = 1.0
    """Opacity of the inside [-]."""
    radius: float = field(default=0.0, metadata=unit("m"))
    """Radius of a disc [m]."""


def put_on(ax: Axes, strokes: Iterable[Stroke | Shape]) -> list[Artist]:
    """Draw strokes on axes, or the shapes of a film from back to front, each as one artist."""
    from matplotlib.colors import to_rgba
    from matplotlib.patches import Circle, Polygon

    artists: list[Artist] = []
    for place, stroke in enumerate(strokes):
        layer = stroke.layer if isinstance(stroke, Stroke) else 1.0 + 1e-3 * place
        style = "--" if isinstance(stroke, Shape) and stroke.dashed else "-"
        options: dict[str, Any] = {"linewidth": stroke.width, "zorder": layer, "linestyle": style}
        face = "none" if stroke.face == "none" else to_rgba(stroke.face, stroke.alpha)
        filled = options | {"facecolor": face, "edgecolor": stroke.color}
        if stroke.kind == "line":
            artists += ax.plot(*stroke.points.T, color=stroke.color, solid_capstyle="round", **options)
        elif stroke.kind == "disc":
            artists.append(ax.add_patch(Circle(tuple(stroke.points[0]), stroke.radius, **filled)))
        else:
            artists.append(ax.add_patch(Polygon(stroke.points, **filled)))
    return artists
