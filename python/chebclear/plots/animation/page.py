"""An animation as one HTML page that plays without network: what stays is a picture, what moves is SVG."""

from __future__ import annotations

import base64
import io
import itertools
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...report.markup import element, templates_of
from ..axes import COLORS
from ..drawing.strokes import Stroke
from .motion import LooseJoint, Motion
from .stage import FORCE, Stage, arrow, arrow_head, drawn_path, force_words

if TYPE_CHECKING:
    from markupsafe import Markup
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

# Points that a path keeps between two frames.
_KEPT = 8
# Resolution of what stays, in dots of the screen for each unit of the drawing.
_SHARPNESS = 1.6


def page_of(stage: Stage, rate: int, title: str, note: str) -> str:
    """The page.

    Parameters
    ----------
    stage : Stage
        The figure.
    rate : int
        Frames a second [1/s].
    title, note : str
        Heading, and what stands below.

    Returns
    -------
    str
        HTML without references to anything outside.
    """
    from jinja2.utils import htmlsafe_json_dumps

    motion, figure = stage.motion, stage.figure
    stage.show(0)
    figure.draw_without_rendering()
    width, height = figure.bbox.width, figure.bbox.height
    to_page = {ax: _to_page(ax, height) for ax in figure.axes}
    owners = list(motion.transforms)
    drawing = _strokes(motion, owners)
    data: dict[str, Any] = {
        "rate": rate,
        "time": [f"t = {motion.t[sample]:.5f} s" for sample in motion.frames],
        "owners": [_numbers(_composed(motion.transforms[owner], to_page[stage.scene])) for owner in owners],
        "shifts": {},
        "shapes": {},
        "paths": {},
        "texts": {},
    }
    data["texts"]["clock"] = data["time"]
    drawing.append(_text("clock", stage.scene, height, "#555"))
    if motion.loose is not None and stage.bearing is not None:
        drawing += _bearing(motion, motion.loose, stage.bearing, to_page[stage.bearing], height, data)
    drawing += _running(motion, to_page[stage.plot], data)
    return (
        templates_of("chebclear.plots.animation")
        .get_template("page.html.j2")
        .render(
            title=title,
            note=note,
            width=f"{width:g}",
            height=f"{height:g}",
            last=len(motion.frames) - 1,
            background=_background(stage),
            drawing=drawing,
            motion=htmlsafe_json_dumps(data, allow_nan=False, separators=(",", ":")),
        )
    )


def _background(stage: Stage) -> str:
    """What does not move, as a picture in base64."""
    for artist in stage.moving:
        artist.set_visible(False)
    picture = io.BytesIO()
    try:
        stage.figure.savefig(picture, format="png", dpi=_SHARPNESS * stage.figure.dpi)
    finally:
        for artist in stage.moving:
            artist.set_visible(True)
    return base64.b64encode(picture.getvalue()).decode("ascii")


def _to_page(ax: Axes, height: float) -> Array:
    """From data of the axes to the page, whose ordinates go down: ``(a, b, c, d, e, f)``."""
    (x0, y0), (x1, _), (_, y1) = ax.transData.transform([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    return np.array([x1 - x0, 0.0, 0.0, y0 - y1, x0, height - y0])


def _composed(transforms: Array, page: Array) -> Array:
    """Transforms of the drawing, then to the page, shape (frames, 6)."""
    matrix, shift = page[:4].reshape(2, 2), page[4:]
    turned = transforms[:, :4].reshape(-1, 2, 2) @ matrix
    return np.concatenate([turned.reshape(-1, 4), transforms[:, 4:] @ matrix + shift], axis=1)


def _on_page(points: Array, page: Array) -> Array:
    return np.asarray(points @ page[:4].reshape(2, 2) + page[4:])


def _numbers(rows: Array) -> list[str]:
    return [" ".join(f"{value:.6g}" for value in row) for row in rows]


def _points(points: Iterable[Array]) -> str:
    return " ".join(f"{x:.6g},{y:.6g}" for x, y in points)


def _path(points: Array, end: str = "") -> str:
    return "M" + "L".join(f"{x:.5g} {y:.5g}" for x, y in points) + end


def _strokes(motion: Motion, owners: list[Any]) -> list[Markup]:
    """The mechanism; strokes that lie on each other and move together share a group."""
    from markupsafe import Markup

    return [
        element("g", Markup("\n").join(map(_shape, strokes)), data_owner=owners.index(owner))
        for owner, strokes in itertools.groupby(motion.strokes, lambda stroke: stroke.owner)
    ]


def _shape(stroke: Stroke) -> Markup:
    from matplotlib.colors import to_hex

    style = {
        "stroke": to_hex(stroke.color),
        "stroke_width": f"{stroke.width / 0.72:.3g}",
        "fill": "none" if stroke.face == "none" else to_hex(stroke.face),
    }
    if stroke.alpha < 1.0:
        style["fill_opacity"] = f"{stroke.alpha:g}"
    if stroke.kind == "line":
        return element("polyline", points=_points(stroke.points), **style, stroke_linecap="round")
    if stroke.kind == "disc":
        x, y = stroke.points[0]
        return element("circle", cx=f"{x:.6g}", cy=f"{y:.6g}", r=f"{stroke.radius:.6g}", **style)
    return element("polygon", points=_points(stroke.points), **style)


def _text(name: str, ax: Axes, height: float, color: str) -> Markup:
    """An empty text in the lower left corner of the axes."""
    x, y = ax.transAxes.transform((0.02, 0.03))
    return element("text", "", id=name, x=f"{x:.5g}", y=f"{height - y:.5g}", fill=color)


def _bearing(
    motion: Motion, loose: LooseJoint, ax: Axes, page: Array, height: float, data: dict[str, Any]
) -> list[Markup]:
    """The parts of the magnified joint that move."""
    path = drawn_path(loose)
    arrows = [arrow(loose, motion.frames, int(sample)) for sample in motion.frames]
    data["shifts"]["journal"] = data["shifts"]["center"] = _numbers(_on_page(path[motion.frames], page))
    data["shapes"]["shaft"] = [_path(_on_page(np.array(ends), page)) for ends in arrows]
    data["shapes"]["head"] = [_path(_on_page(arrow_head(*ends), page), "Z") for ends in arrows]
    forces = np.hypot(*loose.force[motion.frames].T)
    data["texts"]["force"] = [force_words(force) for force in forces]
    chosen, until = _thinned(path[:, 0], motion.frames)
    data["paths"]["trail"] = {
        "points": [_points([place]) for place in _on_page(path[chosen], page)],
        "until": until,
    }
    radius, arm = abs(page[0]), 5.0
    cross = f"M-{arm} 0H{arm}M0 -{arm}V{arm}"
    return [
        element("circle", id="journal", r=f"{radius:.5g}", fill=loose.colors[1], fill_opacity="0.55"),
        element("polyline", id="trail", fill="none", stroke="#777", stroke_width="0.8"),
        element("path", id="center", d=cross, stroke="black", fill="none"),
        element("path", id="shaft", stroke=FORCE, stroke_width="2.5", fill="none"),
        element("path", id="head", fill=FORCE),
        _text("force", ax, height, FORCE),
    ]


def _running(motion: Motion, page: Array, data: dict[str, Any]) -> list[Markup]:
    """The part of the running plot that has passed."""
    curve = _on_page(np.column_stack([motion.t, motion.values]), page)
    chosen, until = _thinned(motion.values, motion.frames)
    data["paths"]["done"] = {"points": [_points([place]) for place in curve[chosen]], "until": until}
    data["shifts"]["now"] = _numbers(curve[motion.frames])
    return [
        element("polyline", id="done", fill="none", stroke=COLORS[0], stroke_width="1.2"),
        element("circle", id="now", r="4", fill=COLORS[0]),
    ]


def _thinned(values: Array, frames: Sequence[int] | NDArray[np.int64]) -> tuple[NDArray[np.int64], list[int]]:
    """Samples that a path keeps, extremes between frames included, and how many until each frame."""
    chosen, until = [int(frames[0])], [1]
    for start, end in itertools.pairwise(map(int, frames)):
        pieces = np.array_split(np.arange(start + 1, end + 1), _KEPT // 2)
        kept = {int(end)}
        for piece in pieces:
            if len(piece):
                kept |= {int(piece[values[piece].argmin()]), int(piece[values[piece].argmax()])}
        chosen += sorted(kept)
        until.append(len(chosen))
    return np.array(chosen, dtype=np.int64), until
