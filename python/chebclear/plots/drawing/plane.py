"""Geometry of pictures: hulls of discs, and free places for labels."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def hull(discs: Sequence[tuple[Array, float]]) -> Array:
    """Convex hull of discs (center and radius), counter-clockwise, by Andrew's monotone chain.

    Examples
    --------
    >>> corners = hull([(np.array([0.0, 0.0]), 1.0), (np.array([4.0, 0.0]), 1.0)])
    >>> np.ptp(corners, axis=0).round(9).tolist()
    [6.0, 2.0]
    """
    turn = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    rim = np.column_stack((np.cos(turn), np.sin(turn)))
    points = np.concatenate([center + radius * rim for center, radius in discs])
    points = points[np.lexsort((points[:, 1], points[:, 0]))]

    def chain(ordered: Array) -> list[Array]:
        corners: list[Array] = []
        for point in ordered:
            while len(corners) > 1:
                (ax, ay), (bx, by) = corners[-1] - corners[-2], point - corners[-1]
                if ax * by - ay * bx > 0.0:
                    break
                corners.pop()
            corners.append(point)
        return corners[:-1]

    return np.array(chain(points) + chain(points[::-1]))


@dataclass(frozen=True)
class Spot:
    """Where a label may stand.

    Attributes
    ----------
    middle : ndarray, shape (2,)
        Its middle.
    cost : float
        Its cost, in heights of a line.
    on_body : bool
        Whether it names the body that it stands on.
    """

    middle: Array
    cost: float = 0.0
    on_body: bool = False


class Clutter:
    """Areas that labels must avoid: bars, discs and other labels, as segments with a radius."""

    def __init__(self) -> None:
        self._segments: list[tuple[Array, Array, float, str]] = []

    def add(self, start: Array, end: Array, radius: float, owner: str = "") -> None:
        """Note a segment, and the body it is part of if a name may stand on it."""
        self._segments.append((start, end, radius, owner))

    def copy(self) -> Clutter:
        """The same, to be filled on its own."""
        twin = Clutter()
        twin._segments = list(self._segments)
        return twin

    def room(self, points: Array, on: str = "") -> Array:
        """Distance of each point from all but one body, negative where it lies on something."""
        kept = [segment for segment in self._segments if not (on and segment[3] == on)]
        if not kept:
            return np.full(len(points), np.inf)
        starts = np.array([start for start, _, _, _ in kept])
        ways = np.array([end for _, end, _, _ in kept]) - starts
        squares = (ways**2).sum(axis=1)
        off = points[:, None, :] - starts
        along = (off * ways).sum(axis=2) / np.where(squares > 0.0, squares, 1.0)
        apart = off - np.clip(along, 0.0, 1.0)[:, :, None] * ways
        radii = np.array([radius for _, _, radius, _ in kept])
        nearest: Array = (np.hypot(apart[..., 0], apart[..., 1]) - radii).min(axis=1)
        return nearest

    def place(self, spots: Iterable[Spot], size: tuple[float, float], line: float, on: str = "") -> Spot:
        """The spot with the most room, less its cost, for a label of this size; it is then occupied.

        `line` is the height of a line of it, `on` the body on which it may stand where a spot says so.
        """
        sides = np.array(size)
        thin = 0.5 * float(sides.min())
        half = 0.5 * sides - thin
        every = list(spots)
        steps = np.linspace(-1.0, 1.0, 9)[:, None] * half
        points = np.concatenate([spot.middle + steps for spot in every])
        free = np.array([self.room(points), self.room(points, on)]).reshape(2, len(every), 9).min(axis=2)
        room = np.where([spot.on_body for spot in every], free[1], free[0]) - thin
        # Beyond a quarter of a line more room is no better.
        scores = np.minimum(room / line, 0.25) - [spot.cost for spot in every]
        chosen = every[int(np.argmax(scores))]
        self.add(chosen.middle - half, chosen.middle + half, thin)
        return chosen


# How far from its point a label may stand, in lines of it, and what that costs. Chosen by eye on the
# ready-made mechanisms, the toggle press and their pictures in a column of print.
_REACHES = ((0.0, 0.0), (1.2, 0.5), (2.6, 0.8), (4.2, 1.1))
_DIRECTIONS = 16
_OUTWARD = 0.15


def around(point: Array, keep: float, size: tuple[float, float], line: float, outward: Array) -> list[Spot]:
    """Spots around a point, beside a disc of radius `keep` about it, for a label with lines of this height.

    Those in the direction of the unit vector `outward` are preferred.
    """
    spots = []
    for reach, cost in _REACHES:
        for turn in np.arange(_DIRECTIONS) * 2.0 * np.pi / _DIRECTIONS:
            way = np.array([np.cos(turn), np.sin(turn)])
            # The label touches the disc with the side or the corner that faces it.
            lean = np.clip(way / 0.4, -1.0, 1.0)
            middle = point + (keep + reach * line) * way + 0.5 * lean * np.array(size)
            spots.append(Spot(middle, cost - _OUTWARD * float(way @ outward)))
    return spots


def along_body(corners: Array, size: tuple[float, float], line: float, outward: Array) -> list[Spot]:
    """Spots as of `around`: on a body, the middle of its corners first, on its bars, then beside it."""
    middle = corners.mean(axis=0)
    spots = [Spot(middle, 0.0, on_body=True)]
    for first, second in itertools.combinations(corners, 2):
        for share in (0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8):
            cost = 0.1 + 0.4 * abs(share - 0.5)
            spots.append(Spot(first + share * (second - first), cost, on_body=True))
    return spots + [Spot(spot.middle, spot.cost + 0.6) for spot in around(middle, 0.0, size, line, outward)]
