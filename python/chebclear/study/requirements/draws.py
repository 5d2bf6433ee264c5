"""Independent mechanisms, drawn from the distributions of their parameters."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.random import default_rng

from ...base.arguments import Checks
from ...base.rows import Array
from ...scene.distributions import Distribution
from ...scene.scene import Interval
from ..polynomials.points import sobol_points

MOST_INTERVALS = 6
"""Most parameters that are only known as intervals [-]: their corners are two to this power."""


def check_drawn(checks: Checks, parameters: object) -> None:
    """Check that mechanisms can be drawn from the distributions of the parameters."""
    known = parameters if isinstance(parameters, Mapping) else {}
    sides = [one for one in known.values() if isinstance(one, Interval)]
    if not any(isinstance(one, Distribution) for one in known.values()):
        checks.add(
            "parameters",
            "must have a distribution at least: an interval says nothing of how often its values occur; give "
            "cc.normal(mean, standard_deviation) or another distribution in its place",
        )
    if len(sides) > MOST_INTERVALS:
        checks.add(
            "parameters",
            f"must have at most {MOST_INTERVALS} only known as intervals, whose corners are all tried, "
            f"got {len(sides)}: give the others a distribution",
        )


def drawn(
    parameters: Mapping[str, Interval | Distribution], names: Sequence[str], runs: int, seed: int
) -> Array:
    """Values of the random parameters, NaN for the others, shape (runs, parameters).

    Fewer runs are the first of more, and a parameter has the same values whatever the others are: each draws
    from a stream of its own, by its place in `names`, the order in which the model declares them.
    """
    points = np.full((runs, len(parameters)), np.nan)
    for column, (name, one) in enumerate(parameters.items()):
        stream = default_rng([seed, names.index(name)])
        if not isinstance(one, Interval):
            points[:, column] = one.drawn(stream, runs)
    return points


def places(
    parameters: Mapping[str, Interval | Distribution], inner: int, seed: int
) -> list[dict[str, float]]:
    """Values of the parameters that are only known as intervals: nominal ones, corners, points inside."""
    sides = {name: one for name, one in parameters.items() if isinstance(one, Interval)}
    nominal = {name: side.nominal for name, side in sides.items()}
    if not sides:
        return [nominal]
    ends = itertools.product(*((side.lower, side.upper) for side in sides.values()))
    points = [*ends, *(sobol_points(sides, 0, inner, seed).tolist() if inner else ())]
    return [nominal, *(dict(zip(sides, point, strict=True)) for point in points)]
