"""How far a feature reaches over the box."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...base.shown import Shown
from ..band.margin import RESOLVED
from .effects import best_degree, even_points, fits_of, left_out, legendre_terms

Array = NDArray[np.float64]

# Number of folds of the cross-validation: the share of runs in the interval made from the others.
_FOLDS = 10
# Number of points at which the extremes of a polynomial are searched, and of the best ones that are refined.
_POINTS, _BEST = 4096, 10


@dataclass(frozen=True, repr=False)
class FeatureInterval(Shown):
    """The range of a feature over the box.

    Attributes
    ----------
    lower : float
        Lower end in the unit of the feature.
    upper : float
        Upper end in the unit of the feature.
    verdict : Literal['resolved', 'sampled']
        ``"resolved"``: the range of a polynomial in the parameters that follows the feature, with its
        error. ``"sampled"``: the extremes of the runs; the feature may exceed them between the runs.
    coverage : float
        Share of the runs, with all their cycles, that are in the interval made from the others in ten parts
        [-].
    whole_run : float
        Probability that a further run at random parameters is in the interval with all its cycles, without
        further assumption [-]; NaN for runs on a grid.
    """

    lower: float
    upper: float
    verdict: Literal["resolved", "sampled"]
    coverage: float
    whole_run: float


def find_interval(
    points: Array, values: Array, nominal: Array, random: bool, *, filled: bool
) -> FeatureInterval:
    """The interval of a feature.

    Parameters
    ----------
    points : ndarray, shape (runs, parameters)
        Parameters of the runs, from -1 to 1 over each interval.
    values : ndarray, shape (runs, cycles)
        The feature in its unit.
    nominal : ndarray, shape (cycles,)
        That of the run at the midpoint.
    random : bool
        Whether the runs are spread at random over the box.
    filled : bool
        Whether none have failed and the points leave out no part of the box, where nothing is known of the
        feature: no polynomial is extrapolated.

    Returns
    -------
    FeatureInterval
    """
    runs = len(values)
    lower, upper, resolved = _reach(points, values, filled)
    inside = np.zeros(runs, dtype=bool)
    for fold in range(min(_FOLDS, runs)):
        out = np.arange(runs) % _FOLDS == fold
        if out.all():
            break
        low, high, _ = _reach(points[~out], values[~out], filled)
        inside[out] = np.all((values[out] >= low) & (values[out] <= high), axis=1)
    return FeatureInterval(
        lower=min(lower, float(nominal.min())),
        upper=max(upper, float(nominal.max())),
        verdict="resolved" if resolved else "sampled",
        coverage=float(inside.mean()),
        whole_run=(runs - 1) / (runs + 1) if random else math.nan,
    )


def _reach(points: Array, values: Array, filled: bool) -> tuple[float, float, bool]:
    """Lower and upper end from some runs, and whether a polynomial follows them in the whole box."""
    lower, upper = float(values.min()), float(values.max())
    # A single run cannot be left out.
    if len(values) < 2 or upper == lower or not filled:
        return lower, upper, filled and upper == lower
    mean = values.mean(axis=1)
    fits = fits_of(points)
    degree = best_degree(fits, mean)
    if degree == 0:
        return lower, upper, False
    fit = fits[degree]
    error = float(np.max(np.abs(left_out(fit, mean)))) + float(np.max(np.abs(values - mean[:, None])))
    if error > RESOLVED * (upper - lower):
        return lower, upper, False
    terms = fit.solve @ mean

    def smooth(at: Array) -> Array:
        return np.asarray(legendre_terms(at, fit.powers) @ terms)

    highest, lowest = _highest(smooth, points.shape[1]), -_highest(lambda at: -smooth(at), points.shape[1])
    return min(lower, lowest - error), max(upper, highest + error), True


def _highest(function: Callable[[Array], Array], parameters: int) -> float:
    """Largest value of a polynomial found in the cube: from even points and corners, with refinement."""
    points = even_points(_POINTS, parameters)
    if parameters <= 10:
        corners = np.array(list(itertools.product((-1.0, 1.0), repeat=parameters)))
        points = np.concatenate([points, corners])
    values = function(points)
    best = points[np.argsort(values)[-_BEST:]]
    steps = np.linspace(-1.0, 1.0, 41)
    # First over the whole width, then ever nearer around the best.
    for part in (1.0, 1.0, 1.0, 0.1, 0.1, 0.01, 0.01, 0.001, 0.001, 1e-4):
        for axis in range(parameters):
            tried = np.repeat(best[:, None, :], len(steps), axis=1)
            tried[:, :, axis] = np.clip(
                (best[:, axis : axis + 1] if part < 1.0 else 0.0) + part * steps, -1.0, 1.0
            )
            heights = function(tried.reshape(-1, parameters)).reshape(len(best), len(steps))
            own = function(best)
            better = heights.max(axis=1) > own
            best[better, axis] = tried[better, heights.argmax(axis=1)[better], axis]
    return float(max(values.max(), function(best).max()))
