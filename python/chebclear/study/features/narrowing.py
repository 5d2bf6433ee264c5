"""What halving the interval of a parameter does to the interval of a feature."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.random import Generator, default_rng
from numpy.typing import NDArray

from ...base.rows import Array
from .effects import (
    CONFIDENCE,
    LEAST_FREE,
    REPLICATES,
    UNKNOWN,
    Estimate,
    Model,
    box_points,
    ends_of,
    fits_of,
    is_constant,
    left_out,
    legendre_terms,
)

Rows = NDArray[np.intp]

# Points of the box at which polynomials of resampled sets are evaluated: twice as many take twice the time
# and shorten intervals by 0.3 %.
_POINTS = 2048
# So many of them at a time fit into the cache of a processor with all their neighbors and replicates.
_AT_A_TIME = 64
# Draws of scatter for the estimate itself; a factor of two changes the length of intervals by 0.2 %.
_DRAWS = 2**15
# So many times as many points for the estimate itself, and the error of the relative width with them: at most
# 0.012 for squares of sums of eight parameters, 0.027 without them.
_TIMES, _POINTS_ERROR = 8, 1.5e-2
# Neighbors of a point where the scatter is uneven: part of the runs, and least and largest number of them,
# the last for the memory. A factor of two in any changes the length of intervals by less than 1 %.
_NEIGHBORS_PART, _LEAST_NEIGHBORS, _MOST_NEIGHBORS = 0.08, 5, 25
# Size of the scatter, over that of the polynomial, below which it does not matter where it is. Without it the
# error of smooth features triples, from 0.001 to 0.003; a factor of two changes nothing.
_MATTERS = 0.01
# Significance level of the test for uneven scatter, against shuffled sets; without the test effects of a
# scatter exp(2 a) are off by 0.25 instead of 0.14, a factor of two changes the length of intervals by 0.2 %.
_UNEVEN = 0.2
# That of the test for the parameters on which it depends: one too many makes neighbors farther. With 0.2 the
# intervals of 41 and 81 runs hold the effect of a scatter exp(2 a) in 79 and 88 % instead of 83 and 94.
_TELLING = 0.05
# Dimensions in which neighbors are near enough.
_FEW = 2
# Least size of the scatter at a point, over the root of its mean square.
_LEAST_SIZE = 0.1
# Part of the values in the interval of a feature whose width is compared.
_CENTRAL = 0.95
ENDS = (0.5 - 0.5 * _CENTRAL, 0.5 + 0.5 * _CENTRAL)
"""Quantiles of the values of a feature between which its range is compared [-]."""


def find_narrowing(names: list[str], model: Model, nominal: Array | None = None) -> dict[str, Estimate]:
    """Relative reduction of the interval of 95 % of the values when the interval of a
    parameter is halved towards its nominal value, from -1 to 1; the midpoint if not given [-].

    The scatter may be of any size and shape in any part of the box.
    """
    points, values = model.points, model.values
    nominal = np.zeros(points.shape[1]) if nominal is None else nominal
    if is_constant(values):
        return dict.fromkeys(names, UNKNOWN)
    effect, resampled = _narrowed(names, model, nominal)
    lower, upper = ends_of(resampled)
    lower, upper = lower - _POINTS_ERROR, upper + _POINTS_ERROR
    # By the interval of what the polynomial misses it may be wrong, as far as the runs themselves allow.
    missed, whole = (
        float(np.ptp(np.quantile(some, ENDS))) for some in (left_out(model.fit, values.mean(axis=1)), values)
    )
    missed = missed / whole if whole > 0.0 else 0.0
    least, most = _of_runs(points, values, nominal)
    lower = np.minimum(lower, np.maximum(lower - missed, least))
    upper = np.maximum(upper, np.minimum(upper + missed, most))
    lower, upper = np.minimum(lower, effect), np.maximum(np.minimum(upper, 1.0), effect)
    rows = zip(effect, lower, upper, strict=True)
    return {name: Estimate(*map(float, row)) for name, row in zip(names, rows, strict=True)}


def _of_runs(points: Array, values: Array, nominal: Array) -> tuple[Array, Array]:
    """Ends of the intervals of the narrowing by the runs in the halved box alone, shape (parameters,).

    Without a model they are wide: some runs show little of the tails, and half of them less.
    """
    runs, cycles = values.shape
    random = default_rng([0, 2])
    order = np.argsort(values, axis=None)
    ordered = values.ravel()[order]
    # How often each run is in each of the resampled sets, then for each of its cycles in the order of values.
    counts = random.multinomial(runs, np.full(runs, 1.0 / runs), size=REPLICATES).T
    counts = np.repeat(counts, cycles, axis=0)[order]

    def widths(inside: NDArray[np.intp]) -> Array:
        among = np.cumsum(counts * np.repeat(inside, cycles)[order, None], axis=0)
        found = [ordered[np.argmax(among >= share * among[-1], axis=0)] for share in ENDS]
        return np.where(among[-1] > 0, found[1] - found[0], math.nan)

    whole = widths(np.ones(runs, dtype=np.intp))
    inside = (np.abs(2.0 * points - nominal) <= 1.0).astype(np.intp)
    halved = np.array([widths(column) for column in inside.T])
    narrowing = 1.0 - halved / np.where(whole > 0.0, whole, math.nan)
    ends = [0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE]
    known = np.asarray(np.all(np.isfinite(narrowing), axis=1))
    found = np.quantile(np.where(known[:, None], narrowing, 0.0), ends, axis=1)
    return np.where(known, found[0], -math.inf), np.where(known, found[1], math.inf)


class _Scatter(NamedTuple):
    """Runs whose scatter a point of the box gets; the same draws for all boxes, since they are compared."""

    drawn: Rows
    """For the estimate, shape (points, draws), among the neighbors of a point or all runs."""
    weights: NDArray[np.float32]
    """Weights of the runs in the resampled sets, shape (runs, replicates)."""
    waits: NDArray[np.float32]
    """Exponential waiting times for these, shape (points, neighbors, replicates)."""

    def chosen(self, among: Rows) -> Rows:
        """Which of the runs a point gets in each of the resampled sets, shape (points, replicates)."""
        # Who comes first, at rates that are the weights, is drawn by the weights; a few points at a time.
        found = np.empty((len(among), self.weights.shape[1]), dtype=among.dtype)
        for first in range(0, len(among), _AT_A_TIME):
            part = slice(first, first + _AT_A_TIME)
            weighted = np.argmin(self.waits[part] / self.weights[among[part]], axis=1)
            found[part] = np.take_along_axis(among[part], weighted, axis=1)
        return found


def _narrowed(names: list[str], model: Model, nominal: Array) -> tuple[Array, Array]:
    """By how much the interval of 95 % of the values narrows with each parameter halved, and in resampled
    sets, shapes (parameters,) and (parameters, replicates).

    The scatter of a value is that of any run, or of one nearby where it is larger in a part of the box, with
    several cycles of the size there: nearby ones alone would be too even.
    Resampled sets have random weights of the runs and random signs of the residuals.
    """
    points = model.points
    runs, parameters = points.shape
    random = default_rng([0, 1])
    smooth, residuals = model.fit.basis @ model.terms, model.left.mean(axis=1)
    signs = random.choice([-1.0, 1.0], size=(runs, REPLICATES))
    again = model.fit.solve(smooth[:, None] + residuals[:, None] * signs)
    sizes = np.sqrt(np.mean(model.left**2, axis=1))
    matters = float(np.mean(sizes**2)) > _MATTERS**2 * float(np.var(smooth))
    telling = _uneven_along(points, sizes, random) if matters else np.zeros(parameters, dtype=bool)
    uneven = bool(telling.any())
    near = min(runs, max(_LEAST_NEIGHBORS, min(_MOST_NEIGHBORS, round(_NEIGHBORS_PART * runs))))
    # Of one cycle the size is too noisy for a polynomial.
    size_at = _size_of_scatter(points, sizes) if uneven and model.left.shape[1] > 1 else None
    # Residuals, scaled by the local scatter where that is known.
    left = model.left if size_at is None else model.left / size_at(points)[:, None]
    # Neighbors of so many points would take most of the time, and such scatter outweighs the error of few.
    count = _POINTS if uneven else _TIMES * _POINTS
    scatter = _Scatter(
        drawn=random.integers(near if uneven else runs, size=(count, _DRAWS // count)),
        weights=random.exponential(size=(runs, REPLICATES)).astype(np.float32),
        waits=random.standard_exponential(size=(_POINTS, near, REPLICATES), dtype=np.float32),
    )
    # Where all runs are alike, the same ones for every box.
    anywhere = np.empty(0, int) if uneven else scatter.chosen(random.integers(runs, size=(_POINTS, near)))
    own_cycles = random.integers(model.left.shape[1], size=(count, _DRAWS // count))
    cycles = random.integers(model.left.shape[1], size=(_POINTS, REPLICATES))

    def nearest(at: Array) -> Rows:
        # Along other parameters all runs are alike, and near in fewer dimensions is nearer.
        own, others = at[:, telling], points[:, telling]
        distances = np.sum(own**2, axis=1)[:, None] - 2.0 * own @ others.T + np.sum(others**2, axis=1)
        return np.argpartition(distances, near - 1, axis=1)[:, :near]

    def left_at(at: Array, chosen: Rows, cycle: Rows) -> Array:
        """Residuals of runs in a cycle, with the local scatter of the points."""
        found = left[chosen, cycle]
        return found if size_at is None else found * size_at(at)[:, None]

    def values_at(at: Array) -> tuple[Array, Array]:
        """Values of the estimate, shape (points, draws), and those of the resampled sets at the first of the
        points, shape (points, replicates)."""
        among = nearest(at) if uneven else None
        parts, first = [], np.empty(0)
        for start in range(0, len(at), _POINTS):
            part = slice(start, start + _POINTS)
            basis = legendre_terms(at[part], model.fit.powers)
            drawn = scatter.drawn[part]
            chosen = drawn if among is None else np.take_along_axis(among, drawn, axis=1)
            parts.append((basis @ model.terms)[:, None] + left_at(at[part], chosen, own_cycles[part]))
            if start == 0:
                chosen = anywhere if among is None else scatter.chosen(among)
                first = basis @ again + left_at(at[part], chosen, cycles) * model.scale
        return np.concatenate(parts), first

    return _compared(values_at, box_points(names, count), nominal)


def _compared(
    values_at: Callable[[Array], tuple[Array, Array]], box: Array, nominal: Array
) -> tuple[Array, Array]:
    """The narrowing of values over the box with each parameter halved, and that of the resampled sets.

    These are evaluated at the first of the points, and moved by what the estimate changes with all of them.
    """
    parameters = box.shape[1]
    narrowing, resampled = np.zeros(parameters), np.zeros((parameters, REPLICATES))

    def widths(at: Array) -> tuple[float, float, Array]:
        values, again = values_at(at)
        of_all, of_first = (float(np.ptp(np.quantile(some, ENDS))) for some in (values, values[:_POINTS]))
        return of_all, of_first, np.ptp(np.quantile(again, ENDS, axis=0), axis=0)

    whole, whole_of_first, wholes = widths(box)
    if min(whole, whole_of_first) > 0.0:
        for axis in range(parameters):
            halved = box.copy()
            halved[:, axis] = 0.5 * (halved[:, axis] + nominal[axis])
            width, of_first, all_widths = widths(halved)
            narrowing[axis] = 1.0 - width / whole
            moved = narrowing[axis] - (1.0 - of_first / whole_of_first)
            resampled[axis] = 1.0 - all_widths / np.where(wholes > 0.0, wholes, math.inf) + moved
    return narrowing, resampled


def _size_of_scatter(points: Array, sizes: Array) -> Callable[[Array], Array]:
    """The size of the scatter in the box: the polynomial for its square that is best at runs left out."""
    squares = sizes**2
    fits = fits_of(points)
    fit = fits[int(np.argmin([np.mean(left_out(fit, squares) ** 2) for fit in fits]))]
    terms, least = fit.solve(squares), _LEAST_SIZE**2 * float(np.mean(squares))
    return lambda at: np.sqrt(np.maximum(legendre_terms(at, fit.powers) @ terms, least))


def _uneven_along(points: Array, sizes: Array, random: Generator) -> NDArray[np.bool_]:
    """The parameters on which the size of the scatter of each run depends, shape (parameters,).

    It follows parabolas in all parameters better than when it is shuffled, else none is meant, and parabolas
    in these alone. If no single one is certain all are meant, as in two dimensions, where neighbors are near.
    """
    runs, parameters = points.shape
    none = np.zeros(parameters, dtype=bool)
    if runs < 2 * parameters + 1 + LEAST_FREE:
        return none
    ranks = np.argsort(np.argsort(sizes)).astype(float)
    ranks -= ranks.mean()
    shuffled = random.permuted(np.repeat(ranks[:, None], REPLICATES, axis=1), axis=0)

    def follows(some: Array) -> float:
        """Share of the shuffled sets that follow parabolas as well."""
        basis, _ = np.linalg.qr(np.concatenate([np.ones((runs, 1)), some, some**2], axis=1))
        own, others = np.sum((basis.T @ ranks) ** 2), np.sum((basis.T @ shuffled) ** 2, axis=0)
        return float(np.mean(others >= own))

    if follows(points) > _UNEVEN:
        return none
    if parameters <= _FEW:
        return ~none
    along = np.array([follows(column[:, None]) <= _TELLING for column in points.T])
    return along if along.any() else ~none
