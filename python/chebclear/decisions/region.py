"""The region in which the features of a model are those observed, from a table of its runs."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ..base.rows import Array
from ..study.features.effects import fits_of, legendre_terms

# Runs nearest to a point whose distances are the measure there: coverages were measured with 40 to 60.
_NEAREST = 50
# Least deviation of a feature, relative to its size, against rounding.
_ROUNDING = 1e-12
# Fits of a polynomial, each weighted by the scatter that the one before left.
_FITS = 3
# Distances between points and runs that are in the memory at once.
_BLOCK = 1_000_000
# Points that show a region, moves of each from level to level, the share that a level keeps; most levels.
_POINTS, _MOVES, _KEPT, _LEVELS = 500, 8, 0.2, 100


class _Model(NamedTuple):
    """A polynomial for the mean of a feature, and a log-linear one for its scatter."""

    powers: NDArray[np.int64]
    terms: Array
    inverse: Array
    """Columns whose squares add up to the variance of the polynomial, shape (terms, terms)."""
    logs: Array
    """Logarithm of the scatter in the middle, and its slopes, shape (parameters + 1,)."""

    def scatter(self, cube: Array) -> Array:
        return np.asarray(np.exp(self.logs[0] + cube @ self.logs[1:]))

    def deviation(self, cube: Array, values: Array) -> Array:
        """Values less the mean, over the scatter with the uncertainty of the mean."""
        basis = legendre_terms(cube, self.powers)
        variance = self.scatter(cube) ** 2 + np.sum((basis @ self.inverse) ** 2, axis=1)
        return np.asarray((values - basis @ self.terms) / np.sqrt(variance))


def _fitted(cube: Array, values: Array, powers: NDArray[np.int64], counts: list[int]) -> tuple[_Model, Array]:
    """The model of a feature, and how far each run is from that of the others, over the scatter."""
    basis = legendre_terms(cube, powers)
    line = np.column_stack([np.ones(len(cube)), cube])
    # Relative to the largest value, so that squares are numbers.
    size = float(np.max(np.abs(values))) or 1.0
    values, least = values / size, _ROUNDING
    scatter = np.ones(len(cube))
    for _ in range(_FITS):
        orthogonal, triangle = np.linalg.qr(basis / scatter[:, None])
        best = math.inf
        for count in counts:
            own = orthogonal[:, :count]
            leverage = np.sum(own**2, axis=1)
            parts = own.T @ (values / scatter)
            left = (values / scatter - own @ parts) / (1.0 - leverage)
            if (error := float(np.mean(left**2))) < best:
                best, kept = error, (count, parts, left * np.sqrt(1.0 - leverage))
        count, parts, left = kept
        logs = np.linalg.lstsq(line, np.log(np.maximum(np.abs(left * scatter), least)), rcond=None)[0]
        left, scatter = left * scatter, np.exp(line @ logs)
    inverse = np.linalg.inv(triangle[:count, :count])
    logs[0] += math.log(size)
    return _Model(powers[:count], size * (inverse @ parts), size * inverse, logs), left / scatter


class FeatureFit:
    """Polynomials and log-linear scatters of features, shape (runs, features), and distances by them.

    The runs are at points of the cube, from -1 to 1 over the interval of each parameter.
    """

    def __init__(self, cube: Array, features: Array, confidence: float) -> None:
        self._cube = cube
        fits = fits_of(cube)
        counts = [len(fit.powers) for fit in fits]
        found = [_fitted(cube, values, fits[-1].powers, counts) for values in features.T]
        self._models = [model for model, _ in found]
        deviations = np.column_stack([left for _, left in found])
        spread = deviations.T @ deviations / len(cube)
        self._inverse = np.linalg.pinv(spread, rcond=1e-8, hermitian=True)
        self._distances = self._lengths(deviations)
        # The k-th of n distances holds one more with a probability of k / (n + 1).
        self._nearest = nearest_needed(confidence)
        self._rank = math.ceil(confidence * (self._nearest + 1)) - 1

    def _lengths(self, deviations: Array) -> Array:
        return np.asarray(np.einsum("ij,jk,ik->i", deviations, self._inverse, deviations))

    def deviation(self, cube: Array, features: Array) -> Array:
        """Features less those of the model at points, over their scatter, shape (points, features)."""
        values = np.broadcast_to(features, (len(cube), len(self._models)))
        columns = [model.deviation(cube, own) for model, own in zip(self._models, values.T, strict=True)]
        return np.column_stack(columns)

    def distance(self, cube: Array, features: Array) -> Array:
        """Squared distances of features from those of the model at points, shape (points,)."""
        return self._lengths(self.deviation(cube, features))

    def cut(self, cube: Array) -> Array:
        """Distances that the runs nearest to points keep with the confidence, shape (points,)."""
        cuts = []
        for block in np.array_split(cube, 1 + len(cube) * len(self._cube) // _BLOCK):
            far = np.sum((block[:, None, :] - self._cube) ** 2, axis=-1)
            near = np.argpartition(far, self._nearest - 1, axis=1)[:, : self._nearest]
            cuts.append(np.partition(self._distances[near], self._rank, axis=1)[:, self._rank])
        return np.concatenate(cuts)

    def ratio(self, cube: Array, features: Array) -> Array:
        """Distances over their cuts, shape (points,): at most 1 in the region."""
        return self.distance(cube, features) / self.cut(cube)

    def information(self, point: Array) -> Array:
        """Squared distances for a change of half an interval, shape (parameters, parameters)."""
        slopes = np.array(
            [
                [legendre_terms(point, one.powers, axis)[0] @ one.terms for axis in range(point.shape[1])]
                / one.scatter(point)
                for one in self._models
            ]
        )
        return np.asarray(slopes.T @ self._inverse @ slopes)


def nearest_needed(confidence: float) -> int:
    """Runs near a point from which a cut with this confidence can be taken [-]."""
    return max(_NEAREST, math.ceil(confidence / (1.0 - confidence)))


def points_below(ratio: Callable[[Array], Array], parameters: int, random: Generator) -> tuple[Array, float]:
    """Points of the cube where a ratio is at most 1, and their share of it; else the lowest, and 0.

    From level to level (subset simulation, Au and Beck 2001): of points below a level those below the next,
    multiplied by moves along differences of two of them, which follow thin regions.
    """
    points = random.uniform(-1.0, 1.0, (4 * _POINTS, parameters))
    found, share, before = ratio(points), 1.0, math.inf
    for _ in range(_LEVELS):
        level = max(1.0, float(np.quantile(found, _KEPT)))
        kept = found <= level
        share *= float(np.mean(kept))
        if level >= before:  # no lower ones are found
            break
        before = level
        chosen = random.choice(np.flatnonzero(kept), _POINTS)
        points, found = points[chosen], found[chosen]
        for _ in range(_MOVES):
            one, other = points[random.integers(_POINTS, size=(2, _POINTS))]
            moved = points + random.exponential(1.0 / math.sqrt(parameters), (_POINTS, 1)) * (one - other)
            there = ratio(np.clip(moved, -1.0, 1.0))
            better = np.all(np.abs(moved) <= 1.0, axis=1) & (there <= level)
            points[better], found[better] = moved[better], there[better]
        if level == 1.0:
            return points, share
    return points, 0.0
