"""Whether the runs of a table fill the box: copies of runs, and parts of the box without any."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from ...base.arguments import Checks
from ...base.rows import Array
from ...scene.scene import Interval
from ..polynomials.points import on_cube, unfilled
from .run_table import ROUNDING

# Correlation of two parameters from which runs leave out most of the box, and that of independent ones by
# chance, times the square root of the number of runs: with half of that 7 of 300 independent sets are blamed.
_LARGEST_CORRELATION = 0.5
_CHANCE = 5.0


def copies_of(
    columns: Mapping[str, Array], sides: Mapping[str, Interval], values: Sequence[Array]
) -> list[tuple[int, int]]:
    """Pairs of a run and a later one at the same point with the same values, to rounding.

    Held-out runs with a copy among the others are always inside. Runs at one point that differ are none:
    measurements and impacts scatter. Neither are they where runs at different points are often equal too,
    such as counts of rare events.
    """
    if not values or not columns or len(sides) < len(columns):
        return []
    points = np.stack(list(columns.values()), axis=-1)
    # Values whose differences overflow are refused elsewhere, as are intervals without a width.
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        scales = np.array([ROUNDING * sides[name].half_width for name in columns])
        # Not below the rounding of the values themselves.
        cells = np.round(points / np.maximum(scales, 8.0 * np.spacing(np.max(np.abs(points), axis=0)))) + 0.0
        near = [ROUNDING * float(np.ptp(array)) for array in values]
    rows = (b"".join(array[run].tobytes() for array in values) for run in range(len(points)))
    if 2 * len({hashlib.sha256(row).digest() for row in rows}) < len(np.unique(cells, axis=0)):
        return []
    first: dict[bytes, list[int]] = {}
    found = []
    with np.errstate(over="ignore", invalid="ignore"):
        for run, cell in enumerate(cells):
            known = first.setdefault(cell.tobytes(), [])
            for other in known:
                if all(np.all(np.abs(a[run] - a[other]) <= e) for a, e in zip(values, near, strict=True)):
                    found.append((other, run))
                    break
            else:
                known.append(run)
    return found


def spread(
    checks: Checks, columns: Mapping[str, Array], sides: Mapping[str, Interval], independent: bool
) -> list[str]:
    """Doubts of runs that leave out a part of the box; problems are added to `checks` if they are said to be
    independent."""
    correlated = _correlated(columns)
    found = [
        f"in most of the box, since {one} and {other} vary together (correlation {correlation:.2f})"
        for (one, other), correlation in correlated.items()
    ]
    if columns and len(sides) == len(columns) and all(side.half_width > 0.0 for side in sides.values()):
        parts = left_out(sides, np.stack(list(columns.values()), axis=-1))
        pairs = [names for names in parts if len(names) == 2 and names not in correlated]
        found += [text for names, text in parts.items() if len(names) == 1 or names in pairs[:1]]
    if independent:
        for text in found:
            checks.add("independent", f"says that runs fill the box at random, but none is {text}")
    return [f"no run of the table is {text}: nothing it says holds there" for text in found]


def left_out(sides: Mapping[str, Interval], points: Array) -> dict[tuple[str, ...], str]:
    """The parts of the box that runs leave out, in words, by the one or two parameters that show them."""
    names, found = list(sides), {}
    for axes, parts in unfilled(on_cube(sides, points)).items():
        own = tuple(names[axis] for axis in axes)
        found[own] = f"in a part of the box that shows in {' and '.join(own)} together"
        if len(own) == 1:
            side, share = sides[own[0]], 50.0 * float(np.sum(np.diff(parts)))
            parts = side.midpoint + side.half_width * parts
            ends = " or ".join(f"between {lower:.6g} and {upper:.6g}" for lower, upper in parts)
            found[own] = f"where {own[0]} is {ends}, {share:.0f} % of its interval"
    return found


def _correlated(columns: Mapping[str, Array]) -> dict[tuple[str, str], float]:
    """Correlations of correlated pairs; of independent parameters less than one pair in 1e6 is by chance."""
    found = {}
    # Relative to the largest, whose square is a number then.
    sizes = {name: max(float(np.max(np.abs(column))), math.ulp(0.0)) for name, column in columns.items()}
    relative = {name: column / sizes[name] for name, column in columns.items()}
    varying = [(name, column) for name, column in relative.items() if np.ptp(column) > 0.0]
    for (name, column), (other, values) in combinations(varying, 2):
        # What has another number of runs is a problem of its own.
        if len(column) != len(values):
            continue
        correlation = float(np.corrcoef(column, values)[0, 1])
        if abs(correlation) > max(_LARGEST_CORRELATION, _CHANCE / math.sqrt(len(column))):
            found[name, other] = correlation
    return found
