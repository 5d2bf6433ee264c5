"""Lines, areas and discs of a drawing, each with what it moves with; how they are put on axes; symbols."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...base.units import unit
from ...report.film import Shape
from ...scene.functions import Expression, Harmonic, Load, Polynomial, Table

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
    layer: float
    """Higher ones lie above lower ones [-]."""
    color: str
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


def typical(value: float | Load) -> float:
    """A value that shows the sign of a function: its mean, its first coefficient that is not zero, or the
    largest value of its table; 1 for an expression, whose sign the motion decides.
    """
    if isinstance(value, Polynomial):
        return next((coefficient for coefficient in value.coefficients if coefficient), 0.0)
    if isinstance(value, Harmonic):
        return value.mean or value.amplitude
    if isinstance(value, Table):
        return max(value.values, key=abs)
    if isinstance(value, (Expression, str)):
        return 1.0
    return value


def varies(value: float | Load) -> bool:
    """Whether a function changes its direction, so that its arrow should have two heads."""
    return isinstance(value, (Harmonic, Table, Expression))


def along(start: Array, end: Array) -> tuple[Array, Array, float]:
    """Unit vectors along and across a line, and its length [m]; to the right if its ends coincide."""
    length = float(np.hypot(*(end - start)))
    way = (end - start) / length if length > 0.0 else np.array([1.0, 0.0])
    return way, np.array([-way[1], way[0]]), length


def zigzag(start: Array, end: Array, width: float) -> list[Array]:
    """Lines of a coil spring between two points, half as wide as `width` says [m]."""
    way, across, length = along(start, end)
    lead = 0.15 * length
    turns = max(3, min(12, round((length - 2.0 * lead) / (1.2 * width))))
    places = np.linspace(lead, length - lead, 2 * turns + 1)
    sides = np.array([0.0, *(width * (-1.0) ** np.arange(2 * turns - 1)), 0.0])
    coil = start + places[:, None] * way + sides[:, None] * across
    return [np.vstack((start, coil, end))]


def dashpot(start: Array, end: Array, width: float) -> list[Array]:
    """Lines of a cylinder with a piston between two points, half as wide as `width` says [m]."""
    way, across, length = along(start, end)
    half = min(1.6 * width, 0.3 * length)
    middle = 0.5 * (start + end)
    back, front, wall = middle - half * way, middle + half * way, width * across
    piston = middle + 0.1 * half * way
    return [
        np.array([start, back]),
        np.array([front - wall, back - wall, back + wall, front + wall]),
        np.array([piston - 0.7 * wall, piston + 0.7 * wall]),
        np.array([piston, end]),
    ]


def beside(start: Array, end: Array, offset: float, symbols: list[tuple[float, list[Array]]]) -> list[Array]:
    """Lines of symbols side by side between two points, joined by a yoke at the end of either lead.

    Each symbol has a shift across the line [m] and its lines, drawn between the yokes.
    """
    way, across, _ = along(start, end)
    shifts = [shift for shift, _ in symbols]
    lines = [line + shift * across for shift, drawn in symbols for line in drawn]
    for place, yoke in ((start, start + offset * way), (end, end - offset * way)):
        lines.append(np.array([place, yoke]))
        lines.append(np.array([yoke + min(shifts) * across, yoke + max(shifts) * across]))
    return lines


def spiral(center: Array, inner: float, outer: float) -> list[Array]:
    """A torsion spring about a point, between two radii [m]."""
    turn = np.linspace(0.0, 5.0 * math.pi, 160)
    radius = np.linspace(inner, outer, turn.size)
    return [center + radius[:, None] * np.column_stack((np.cos(turn), np.sin(turn)))]


def drum(center: Array, radius: float) -> list[Array]:
    """A torsion damper about a point: a drum [m] with two shoes."""
    lines = [arc(center, radius, 0.0, 360.0)]
    lines += [arc(center, 1.25 * radius, start, start + 80.0) for start in (50.0, 230.0)]
    return lines


def arc(center: Array, radius: float, start: float, end: float) -> Array:
    """Points of an arc about a center, from one direction to another [degrees]."""
    turn = np.radians(np.linspace(start, end, 60))
    return np.asarray(center + radius * np.column_stack((np.cos(turn), np.sin(turn))))
