"""A mechanism that moves, with its outputs: what the player of pages and notebooks shows."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..base.prefixes import unit_shown
from ..base.tables import ROUNDING
from ..base.units import unit

Array = NDArray[np.float64]

# Pieces of a curve of which the extremes are kept [-]: more than a screen has columns.
_PIECES = 500


@dataclass(frozen=True)
class Shape:
    """A line, an area or a disc of a panel."""

    kind: Literal["line", "area", "disc"]
    points: Array
    """Corners, or the center of a disc, in the unit of the panel, shape (points, 2)."""
    moves: int
    """Which transform of the panel it moves with."""
    color: str
    width: float = field(metadata=unit("points"))
    """Width of the line or edge [points]."""
    face: str = "none"
    """Color of the inside."""
    alpha: float = 1.0
    """Opacity of the inside [-]."""
    radius: float = 0.0
    """Radius of a disc, in the unit of the panel."""
    dashed: bool = False
    name: str = ""
    """What it is called where one points at it."""


@dataclass(frozen=True)
class Label:
    """A name that moves with what it names."""

    text: str
    at: Array
    """Where it is, in the unit of the panel, shape (2,)."""
    moves: int
    """Which transform of the panel it moves with."""
    color: str


@dataclass(frozen=True)
class Panel:
    """A drawing whose parts move."""

    title: str
    """What it shows; also for readers who cannot see it."""
    view: tuple[float, float, float, float]
    """Lowest and highest x, lowest and highest y of what is seen."""
    shapes: Sequence[Shape]
    """Its parts, those in front last."""
    transforms: Sequence[Array]
    """``(a, b, c, d, e, f)`` of x' = a x + c y + e and y' = b x + d y + f, each of shape (frames, 6)."""
    texts: Sequence[str] = ()
    """A text for each frame; none if empty."""
    labels: Sequence[Label] = ()
    """Names beside its parts."""
    scale: tuple[float, str] | None = None
    """Factor and unit in which the place of the pointer is shown; None where places have no meaning."""


@dataclass(frozen=True)
class Chart:
    """An output over the abscissa of its film, with its bounds if it has any."""

    name: str
    unit: str
    x: Array
    """Abscissa of the samples, shape (samples,)."""
    nominal: Array
    """The output, shape (samples,)."""
    lower: Array | None = None
    """Lower bound, shape (samples,)."""
    upper: Array | None = None
    """Upper bound, shape (samples,)."""
    deviation: bool = False
    """Whether the bounds are first shown as deviations from the output."""


@dataclass(frozen=True)
class Film:
    """Drawings and charts that go through the same frames."""

    title: str
    label: str
    """The abscissa, with its unit."""
    at: Array
    """Abscissa of each frame, rising, shape (frames,)."""
    places: Sequence[str]
    """The instant or angle of each frame, in words."""
    panels: Sequence[Panel]
    charts: Sequence[Chart] = ()
    shown: int = 1
    """How many of the outputs are shown at first [-]; the others are chosen."""
    rate: int = field(default=25, metadata=unit("1/s"))
    """Frames a second [1/s]."""
    starts: bool = False
    """Whether it plays without being asked to."""
    cyclic: bool = False
    """Whether the last frame is followed by the first."""

    def to_json(self) -> str:
        """The film for the player, safe within a page: six digits, gaps where a value is not finite."""
        text = json.dumps(plain(self), allow_nan=False, separators=(",", ":"))
        # As Unicode escapes these end no element of a page.
        for letter in "<>&'":
            text = text.replace(letter, f"\\u{ord(letter):04x}")
        return text


def chart(
    name: str,
    si_unit: str,
    x: Array,
    nominal: Array,
    bounds: tuple[Array, Array] | None = None,
    thin: float = 0.0,
    written: Sequence[str] = (),
) -> Chart:
    """A chart in a unit that the user has `written`, or with a prefix.

    Of many samples those that show the extremes are kept. Bounds that are no wider than the part `thin` of
    the range of the output [-] are shown as deviations.
    """
    curves = np.array([nominal, *(bounds or ())])
    known = np.abs(curves[np.isfinite(curves)])
    scale = float(known.max(initial=0.0))
    factor, shown = unit_shown(scale, si_unit, written)
    kept = _kept(curves)
    values = factor * np.where(np.abs(curves) <= ROUNDING * scale, 0.0, curves)[:, kept]
    if bounds is None:
        return Chart(name, shown, x[kept], values[0])
    width, reach = float(np.nanmax(bounds[1] - bounds[0])), float(np.ptp(nominal))
    middle, lower, upper = values
    return Chart(name, shown, x[kept], middle, lower, upper, width < thin * reach)


def _kept(curves: Array) -> NDArray[np.int64]:
    """Samples that are enough to draw curves, their extremes included."""
    count = curves.shape[1]
    if count <= 2 * _PIECES:
        return np.arange(count)
    filled = np.nan_to_num(curves)
    kept = {0, count - 1}
    for piece in np.array_split(np.arange(count), _PIECES):
        kept |= {int(piece[find]) for row in filled[:, piece] for find in (row.argmin(), row.argmax())}
    return np.array(sorted(kept))


def plain(value: Any) -> Any:
    """A film or a part of it as JSON has it: six digits, None where a value is not finite."""
    if dataclasses.is_dataclass(value):
        return {item.name: plain(getattr(value, item.name)) for item in dataclasses.fields(value)}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(one) for one in value]
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else None
    return value


@cache
def player(kind: Literal["js", "css"]) -> str:
    """The script of the player, the function ``playFilm(element, film)``, or its style sheet."""
    return files("chebclear.report").joinpath(f"player.{kind}").read_text(encoding="utf-8")
