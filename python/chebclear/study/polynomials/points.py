"""Points of the box at which a study simulates."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ... import _core
from ...scene.scene import Interval

Array = NDArray[np.float64]

# Probability of a gap in an interval below which runs do not fill it.
_UNLIKELY = 1e-6
# Number of runs from which a gap between them tells.
_FEW = 5


def sobol_points(intervals: Mapping[str, Interval], first: int, count: int, seed: int) -> Array:
    """Points of a scrambled Sobol' sequence, which fills the box evenly for any number of points.

    Parameters
    ----------
    intervals : mapping of str to Interval
        Sides of the box.
    first, count : int
        Number of the first point and of points; the same seed continues the same sequence.
    seed : int
        Seed of the scrambling. The points are the same on every machine.

    Returns
    -------
    ndarray, shape (count, parameters)
        Physical values.
    """
    return on_box(intervals, _core.sobol_points(len(intervals), first, count, seed))


def random_points(intervals: Mapping[str, Interval], count: int, seed: int) -> Array:
    """Independent points, uniform in the box; arguments as `sobol_points`."""
    return on_box(intervals, _core.random_points(len(intervals), 0, count, seed))


def on_box(intervals: Mapping[str, Interval], cube: Array) -> Array:
    """Physical values of points of the cube [-1, 1]."""
    sides = list(intervals.values())
    middle = np.array([side.midpoint for side in sides])
    return middle + np.array([side.half_width for side in sides]) * cube


def on_cube(intervals: Mapping[str, Interval], points: Array) -> Array:
    """Points of the box in the coordinates of the cube [-1, 1], clipped to it against rounding."""
    sides = list(intervals.values())
    middle = np.array([side.midpoint for side in sides])
    cube: Array = (points - middle) / np.array([side.half_width for side in sides])
    return np.clip(cube, -1.0, 1.0)


def is_grid(column: Array) -> bool:
    """Whether a parameter has so few values that runs must be on a grid."""
    return 2 * len(np.unique(column)) < len(column)


def empty_parts(column: Array) -> Array:
    """Parts of [-1, 1] without a value of the runs, where runs that fill the box have none such.

    Of independent and uniformly distributed runs less than one set in 1e6 has such a part. Grids are not
    judged: their bands are those of polynomials or of the runs alone.

    Parameters
    ----------
    column : ndarray, shape (runs,)
        Values of the runs, from -1 to 1 over the interval.

    Returns
    -------
    ndarray, shape (parts, 2)
        Ends of the parts, in their order.
    """
    runs = len(column)
    if is_grid(column) or runs < _FEW:
        return np.empty((0, 2))
    values = np.sort(np.concatenate([[-1.0], column, [1.0]]))
    shares = np.clip(0.5 * np.diff(values), 0.0, 1.0)
    # The probability is at most (runs + 1) (1 - share)^runs.
    found = np.flatnonzero((runs + 1) * (1.0 - shares) ** runs < _UNLIKELY)
    return np.stack([values[found], values[found + 1]], axis=-1)
