"""Geometry of pictures: hulls of discs, and free places for labels."""

from __future__ import annotations

from collections.abc import Sequence

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


class Clutter:
    """What labels must keep clear of: bars, discs and other labels, as segments with a radius."""

    def __init__(self) -> None:
        self._segments: list[tuple[Array, Array, float]] = []

    def add(self, start: Array, end: Array, radius: float) -> None:
        """Note a segment."""
        self._segments.append((start, end, radius))

    def room(self, points: Array) -> float:
        """Least distance of the points from everything noted, negative where they lie on it."""
        least = np.inf
        for start, end, radius in self._segments:
            way = end - start
            length = float(way @ way)
            share = (
                np.clip((points - start) @ way / length, 0.0, 1.0) if length > 0.0 else np.zeros(len(points))
            )
            nearest = start + share[:, None] * way
            least = min(least, float(np.hypot(*(points - nearest).T).min()) - radius)
        return least

    def place(
        self, point: Array, keep: float, size: tuple[float, float], outward: Array
    ) -> tuple[Array, str, str]:
        """Where a label of a point has most room, of eight directions; the place is then taken.

        Parameters
        ----------
        point : ndarray, shape (2,)
            What is labeled.
        keep : float
            Distance of the label from it.
        size : (float, float)
            Width and height of the label.
        outward : ndarray, shape (2,)
            Unit vector of the direction to prefer where there is room enough.

        Returns
        -------
        ndarray, str, str
            Anchor of the label, and its horizontal and vertical alignment.
        """
        width, height = size
        best, chosen = -np.inf, (point, "center", "center")
        taken = point, point
        for turn in np.arange(8) * 0.25 * np.pi:
            way = np.array([np.cos(turn), np.sin(turn)])
            anchor = point + keep * way
            across = 0 if abs(way[0]) < 0.1 else int(np.sign(way[0]))
            up = 0 if abs(way[1]) < 0.1 else int(np.sign(way[1]))
            middle = anchor + 0.5 * np.array([across * width, up * height])
            left, right = middle - np.array([0.5 * width, 0.0]), middle + np.array([0.5 * width, 0.0])
            along = left + np.linspace(0.0, 1.0, 9)[:, None] * (right - left)
            # Beyond the height of the label more room is no better.
            room = min(self.room(along) - 0.5 * height, height)
            score = room + 0.3 * height * float(way @ outward)
            if score > best:
                best, taken = score, (left, right)
                chosen = anchor, ("right", "center", "left")[across + 1], ("top", "center", "bottom")[up + 1]
        self.add(*taken, 0.5 * height)
        return chosen
