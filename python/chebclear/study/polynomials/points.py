"""Points of the box at which a study simulates."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np
from numpy.random import default_rng

from ... import _core
from ...base.rows import Array
from ...scene.scene import Interval

CHECKS = 3
"""Runs beside a grid of Chebyshev roots that check its polynomials [-]. With three parameters, two of them
see less than a twentieth of the range of one wave in 20."""

SAME_POINT = 1e-6
"""Difference of points that are the same, over half the interval [-]."""

# Probability of a gap in an interval below which runs do not fill it; a factor of two changes 1 of 450
# verdicts on runs that leave out a part, none on those that fill the box.
_UNLIKELY = 1e-6
# The same of parts of the box in two parameters: 120 normally distributed runs, three standard deviations to
# either side, leave out some 12 % of the box.
_UNLIKELY_TOGETHER = 1e-5
# Number of runs from which a gap between them tells: those at corners alone say nothing.
_FEW = 5
# Gap between levels of a grid in [-1, 1], times their number, that is no even spacing: in the middle of
# Chebyshev roots it is π at most, between equally spaced levels 4.
_UNEVEN = 2.0 * math.pi
# The same from the ends of the interval: 1 at most of roots, and in the middle of even parts.
_UNEVEN_ENDS = 2.0


def sobol_points(intervals: Mapping[str, Interval], first: int, count: int, seed: int) -> Array:
    """Points of a scrambled Sobol' sequence, which fills the box evenly, from the number `first` on.

    They are the same on every machine; the same seed continues the same sequence.
    """
    return on_box(intervals, _core.sobol_points(len(intervals), first, count, seed))


def random_points(intervals: Mapping[str, Interval], first: int, count: int, seed: int) -> Array:
    """Independent points, uniform in the box; arguments as `sobol_points`."""
    return on_box(intervals, _core.random_points(len(intervals), first, count, seed))


def uniform_points(intervals: Mapping[str, Interval], count: int, seed: int) -> Array:
    """Independent points, uniform in the box, by NumPy's generator; arguments as `sobol_points`."""
    lower, upper = ([getattr(side, end) for side in intervals.values()] for end in ("lower", "upper"))
    return default_rng(seed).uniform(lower, upper, (count, len(intervals)))


def nominal_point(intervals: Mapping[str, Interval], given: Array | None = None) -> Array:
    """Parameters of the nominal run [SI units]: those that are given, else the nominal values."""
    return np.array([side.nominal for side in intervals.values()]) if given is None else given


def even_points(count: int, parameters: int) -> Array:
    """Points that fill the cube [-1, 1]^k evenly, shape (points, parameters): multiples of the powers of a
    root of x^(k + 1) = x + 1, modulo 1."""
    root = 2.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (parameters + 1))
    steps = root ** -np.arange(1.0, parameters + 1.0)
    return 2.0 * ((0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0) - 1.0


def between_nodes(intervals: Mapping[str, Interval], nodes: Sequence[int]) -> Array:
    """Points that tell a polynomial on a grid of Chebyshev roots from waves that the roots do not see.

    In the angle θ of x = cos θ, the roots stand in the middle of cells of π / n, and waves such as T_2n and
    T_4n look like a constant there. The points lie a fifth to two fifths of a cell beside roots, in cells and
    at places that differ from parameter to parameter by irrational ratios: of T_2n, T_4n and T_6n, n from 2
    to 31, in any of up to 17 parameters, they see at least a quarter of the range.
    """
    places = even_points(CHECKS, 2 * len(intervals))
    cells, sides = places[:, : len(intervals)], places[:, len(intervals) :]
    cell = np.floor(0.5 * (cells + 1.0) * nodes)
    angles = np.pi * (cell + 0.5 + np.sign(sides) * (0.2 + 0.2 * np.abs(sides))) / nodes
    return on_box(intervals, np.cos(angles))


def on_box(intervals: Mapping[str, Interval], cube: Array) -> Array:
    """Physical values of points of the cube [-1, 1]."""
    middle, half = _middles(intervals)
    return middle + half * cube


def in_box(intervals: Mapping[str, Interval], points: Array) -> bool:
    """Whether points are in the box, up to rounding of its ends."""
    sides = intervals.values()
    slack = np.array([1e-9 * side.half_width for side in sides])
    lower, upper = np.array([side.lower for side in sides]), np.array([side.upper for side in sides])
    return bool(np.all((points >= lower - slack) & (points <= upper + slack)))


def on_cube(intervals: Mapping[str, Interval], points: Array) -> Array:
    """Points of the box in the coordinates of the cube [-1, 1], clipped to it against rounding."""
    middle, half = _middles(intervals)
    return np.clip((points - middle) / half, -1.0, 1.0)


def _middles(intervals: Mapping[str, Interval]) -> tuple[Array, Array]:
    sides = intervals.values()
    return np.array([side.midpoint for side in sides]), np.array([side.half_width for side in sides])


def is_grid(column: Array) -> bool:
    """Whether a parameter has so few values that runs must be on a grid."""
    return 2 * len(np.unique(column)) < len(column)


def empty_parts(column: Array) -> Array:
    """Parts of [-1, 1] without a value of the runs, where runs that fill the box have none, shape (parts, 2).

    Of independent and uniformly distributed runs less than one set in 1e6 has such a part. Of a grid it is
    longer than those of even spacing.
    """
    if len(column) < _FEW:
        return np.empty((0, 2))
    values = np.concatenate([[-1.0], np.sort(column), [1.0]])
    if is_grid(column):
        most = np.full(len(values) - 1, _UNEVEN)
        most[[0, -1]] = _UNEVEN_ENDS
        found = np.flatnonzero(np.diff(values) * len(np.unique(column)) > most)
    else:
        shares = np.clip(0.5 * np.diff(values), 0.0, 1.0)
        # The probability is at most (runs + 1) (1 - share)^runs.
        found = np.flatnonzero((len(column) + 1) * (1.0 - shares) ** len(column) < _UNLIKELY)
    return np.stack([values[found], values[found + 1]], axis=-1)


def empty_together(cube: Array) -> list[tuple[int, int]]:
    """Pairs of parameters that leave out a part of the box together, though neither does alone.

    Runs on a strip, within a circle, or normally distributed ones leave out corners: none has a large sum or
    difference of the two, or a large |a| + |b|. Or they leave out the middle. Of independent and uniformly
    distributed runs less than one set in 1e5 does; grids are not judged.
    """
    runs = len(cube)
    filled = [axis for axis, column in enumerate(cube.T) if not len(empty_parts(column))]
    judged = [axis for axis in filled if runs >= _FEW and not is_grid(cube[:, axis])]
    pairs = list(combinations(judged, 2))
    found = []
    for one, other in pairs:
        total, difference = cube[:, one] + cube[:, other], cube[:, one] - cube[:, other]
        shares = np.array([_share_below(values) for values in (total, difference)])
        # Both ends of each together: corners that are opposite to each other.
        sizes = np.abs(2.0 * shares - 1.0)
        distance = np.abs(cube[:, one]) + np.abs(cube[:, other])
        nearer = np.where(distance < 1.0, 0.5 * distance**2, 1.0 - 0.5 * np.maximum(2.0 - distance, 0.0) ** 2)
        judgments = np.vstack([shares, sizes, nearer])
        # Shares of the box, which are uniformly distributed where runs are: what is left out at either end.
        ends = np.concatenate([judgments.min(axis=1), 1.0 - judgments.max(axis=1)])
        if len(ends) * len(pairs) * (1.0 - min(max(ends.max(), 0.0), 1.0)) ** runs < _UNLIKELY_TOGETHER:
            found.append((one, other))
    return found


def unfilled(cube: Array) -> dict[tuple[int, ...], Array]:
    """The parts of [-1, 1] that runs leave out by single parameters, and by pairs where neither does alone
    (without their parts); see `empty_parts` and `empty_together`."""
    parts = {(axis,): empty_parts(column) for axis, column in enumerate(cube.T)}
    alone = {axes: found for axes, found in parts.items() if len(found)}
    return alone | dict.fromkeys(empty_together(cube), np.empty((0, 2)))


def _share_below(total: Array) -> Array:
    """Share of the square [-1, 1]² in which a + b, or a - b, is smaller."""
    below = 0.125 * (2.0 - np.abs(total)) ** 2
    return np.where(total < 0.0, below, 1.0 - below)
