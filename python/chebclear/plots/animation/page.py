"""An animation as one HTML page that plays without network: what stays is a picture, what moves is SVG."""

from __future__ import annotations

import base64
import html
import io
import itertools
import json
from collections.abc import Iterable, Sequence
from importlib.resources import files
from string import Template
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..axes import COLORS
from ..drawing.strokes import Stroke
from .motion import LooseJoint, Motion
from .stage import FORCE, Stage, arrow, arrow_head, drawn_path, force_words

if TYPE_CHECKING:
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
    motion, figure = stage.motion, stage.figure
    stage.show(0)
    figure.draw_without_rendering()
    width, height = figure.bbox.width, figure.bbox.height
    to_page = {ax: _to_page(ax, height) for ax in figure.axes}
    owners = list(motion.transforms)
    drawing = [_strokes(motion, owners)]
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
        drawing.append(_bearing(motion, motion.loose, stage.bearing, to_page[stage.bearing], height, data))
    drawing.append(_running(motion, to_page[stage.plot], data))
    words = f"{title}. {note}"
    return Template(files(__package__).joinpath("page.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(title),
        alt=html.escape(words),
        note=html.escape(note),
        width=f"{width:g}",
        height=f"{height:g}",
        last=len(motion.frames) - 1,
        background=_background(stage),
        drawing="\n".join(drawing),
        motion=json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"),
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


def _strokes(motion: Motion, owners: list[Any]) -> str:
    """The mechanism; strokes that lie on each other and move together share a group."""
    lines: list[str] = []
    last = None
    for stroke in motion.strokes:
        if stroke.owner != last:
            lines.append(
                ("</g>" if last is not None else "") + f'<g data-owner="{owners.index(stroke.owner)}">'
            )
            last = stroke.owner
        lines.append(_shape(stroke))
    return "\n".join([*lines, "</g>"])


def _shape(stroke: Stroke) -> str:
    from matplotlib.colors import to_hex

    face = "none" if stroke.face == "none" else to_hex(stroke.face)
    style = f'stroke="{to_hex(stroke.color)}" stroke-width="{stroke.width / 0.72:.3g}" fill="{face}"'
    if stroke.alpha < 1.0:
        style += f' fill-opacity="{stroke.alpha:g}"'
    if stroke.kind == "line":
        return f'<polyline points="{_points(stroke.points)}" {style} stroke-linecap="round"/>'
    if stroke.kind == "disc":
        x, y = stroke.points[0]
        return f'<circle cx="{x:.6g}" cy="{y:.6g}" r="{stroke.radius:.6g}" {style}/>'
    return f'<polygon points="{_points(stroke.points)}" {style}/>'


def _text(name: str, ax: Axes, height: float, color: str) -> str:
    """An empty text in the lower left corner of the axes."""
    x, y = ax.transAxes.transform((0.02, 0.03))
    return f'<text id="{name}" x="{x:.5g}" y="{height - y:.5g}" fill="{color}"></text>'


def _bearing(
    motion: Motion, loose: LooseJoint, ax: Axes, page: Array, height: float, data: dict[str, Any]
) -> str:
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
    return "\n".join(
        [
            f'<circle id="journal" r="{radius:.5g}" fill="{loose.colors[1]}" fill-opacity="0.55"/>',
            '<polyline id="trail" fill="none" stroke="#777" stroke-width="0.8"/>',
            f'<path id="center" d="M-{arm} 0H{arm}M0 -{arm}V{arm}" stroke="black" fill="none"/>',
            f'<path id="shaft" stroke="{FORCE}" stroke-width="2.5" fill="none"/>',
            f'<path id="head" fill="{FORCE}"/>',
            _text("force", ax, height, FORCE),
        ]
    )


def _running(motion: Motion, page: Array, data: dict[str, Any]) -> str:
    """The part of the running plot that has passed."""
    curve = _on_page(np.column_stack([motion.t, motion.values]), page)
    chosen, until = _thinned(motion.values, motion.frames)
    data["paths"]["done"] = {"points": [_points([place]) for place in curve[chosen]], "until": until}
    data["shifts"]["now"] = _numbers(curve[motion.frames])
    return (
        f'<polyline id="done" fill="none" stroke="{COLORS[0]}" stroke-width="1.2"/>\n'
        f'<circle id="now" r="4" fill="{COLORS[0]}"/>'
    )


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
