"""Effects of the parameters on a feature: a polynomial in the parameters, and the remaining scatter."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from numpy.random import default_rng
from numpy.typing import NDArray

from ... import _core
from ...base import files as records
from ...base.rows import Array
from ...errors import ArgumentError
from ..polynomials.points import even_points
from ..sources.run_table import ROUNDING

if TYPE_CHECKING:
    from matplotlib.axes import Axes


CONFIDENCE = 0.95
"""Confidence level of the intervals of estimates [-]."""
MOST_DEGREE = 8
"""Largest total degree [-], for the time of thousands of runs; 41 runs allow less in two parameters."""
# Largest ratio of the number of terms of a polynomial to that of runs. With 0.95 intervals of shares hold in
# 96 instead of 99 % (seven features, 41 runs), with half of it a fifth of the certain signs is lost.
_TERMS_PART = 0.7
LEAST_FREE = 4
"""Least number of statistical degrees of freedom for an estimate of the scatter: with few runs it decides
whether there are effects, with 41 a factor of two changes nothing."""
REPLICATES = 200
"""Number of resampled sets of runs: twice as many take twice the time and lengthen intervals by 1 %."""
# Number of points of the box at which slopes are evaluated; a factor of two changed no sign of 51.
_POINTS = 256
# Largest error of the shares by that; resampled residuals show what is larger. A factor of two moves the part
# of intervals that hold by 0.5 to 1 % and their length by 1 to 2 %.
_MOVED = 0.01
# Largest size of values, whose square is a number still.
_LARGEST = 1e150


class Estimate(NamedTuple):
    """An estimate with its 95 % confidence interval.

    What the polynomial behind it misses is scatter, or what a parameter does that so many runs do not
    resolve: the interval holds both. On seven functions of the literature with 21 to 641 runs, intervals of
    shares held in 98 to 100 % (the documentation has the table). All three are NaN where the runs differ by
    rounding alone.
    """

    value: float
    """The estimate."""
    lower: float
    """Lower end of the interval."""
    upper: float
    """Upper end of the interval."""

    def __str__(self) -> str:
        if math.isnan(self.value):
            return "unknown"
        # z: no -0.
        return f"{100.0 * self.value:z.0f} % ({100.0 * self.lower:z.0f} to {100.0 * self.upper:z.0f})"

    def __eq__(self, other: object) -> bool:
        return records.same(self, other)

    def __ne__(self, other: object) -> bool:
        return not records.same(self, other)


UNKNOWN = Estimate(math.nan, math.nan, math.nan)
"""What runs that differ by rounding alone say of shares and of effects."""


class Swing(NamedTuple):
    """Means of a feature with one parameter at either end of its interval, the others anywhere in theirs.

    In the unit of the feature; with 95 % confidence intervals.
    """

    at_lower: float
    """With the parameter at its lower end."""
    at_upper: float
    """With the parameter at its upper end."""
    at_lower_range: tuple[float, float]
    """Interval of the first."""
    at_upper_range: tuple[float, float]
    """Interval of the second."""

    def __eq__(self, other: object) -> bool:
        return records.same(self, other)

    def __ne__(self, other: object) -> bool:
        return not records.same(self, other)


@dataclass(frozen=True, eq=False, repr=False)
class Effects(records.ArrayRecord):
    """The variance of a feature over the box, decomposed by a polynomial in the parameters.

    The parameters are assumed to be uniform and independent. The shares refer to the variance of the feature
    in one cycle of one run.

    Attributes
    ----------
    degree : int
        Total degree of the polynomial, chosen by leave-one-out [-].
    deviation : float
        Standard deviation of the feature over the box in its unit.
    main : dict[str, Estimate]
        Share of each parameter alone [-].
    interactions : Estimate
        Share of parameters together [-].
    scatter : Estimate
        Share that no parameter explains [-], because the sequence of impacts differs between runs.
        Without scatter it is the error of a polynomial of this degree, and its interval reaches down to 0.
    monotone : dict[str, str]
        ``"rises"`` or ``"falls"`` with a parameter for which the polynomial certainly does so everywhere in
        the box. Between values of a parameter that are near each other the feature may do the opposite, in
        waves or bends that the runs do not resolve; if there is scatter, this is its mean.
    mean : float
        Mean of the feature over the box in its unit.
    swings : dict[str, Swing]
        Mean of the feature with each parameter at the ends of its interval.
    """

    degree: int
    deviation: float
    main: dict[str, Estimate]
    interactions: Estimate
    scatter: Estimate
    monotone: dict[str, str]
    mean: float
    swings: dict[str, Swing]

    def plot(self, *, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw the shares in the variance; see `plot_shares` for the options."""
        from ...plots.features import plot_shares

        return plot_shares(self, ax=ax, **options)


class Fit(NamedTuple):
    """Least squares on orthonormal Legendre polynomials of a total degree: a part of those of the largest."""

    powers: NDArray[np.int64]
    leverage: Array
    basis: Array
    orthogonal: Array
    """Orthonormal columns that span those of the basis."""
    inverse: Array
    """From these to the basis, shape (terms, terms)."""

    @property
    def spread(self) -> Array:
        """Variance of each coefficient over that of the values, shape (terms,)."""
        return np.asarray(np.sum(self.inverse**2, axis=1))

    def solve(self, values: Array) -> Array:
        """Coefficients for values of runs, shape (terms, ...)."""
        return np.asarray(self.inverse @ (self.orthogonal.T @ values))

    def fitted(self, values: Array) -> Array:
        """The polynomial at the runs."""
        return np.asarray(self.orthogonal @ (self.orthogonal.T @ values))


def legendre_terms(points: Array, powers: NDArray[np.int64], derivative: int | None = None) -> Array:
    """Products of Legendre polynomials at points of the cube [-1, 1]^k, shape (points, terms).

    They are orthonormal under the uniform distribution, so that squares of coefficients are variances. With
    `derivative` they are differentiated with respect to that parameter.
    """
    most = int(powers.max(initial=0))
    norms = np.sqrt(2.0 * np.arange(most + 1) + 1.0)
    terms = np.ones((len(points), len(powers)))
    for axis, own in enumerate(powers.T):
        coefficients = np.diag(norms) if axis != derivative else legendre.legder(np.diag(norms))
        terms *= (legendre.legvander(points[:, axis], len(coefficients) - 1) @ coefficients)[:, own]
    return terms


def fits_of(points: Array, most: int = MOST_DEGREE) -> list[Fit]:
    """The polynomials that the number of runs allows, from degree 0 on, to a degree at most."""
    runs, parameters = points.shape
    counts = [1]
    for degree in range(1, most + 1):
        count = math.comb(parameters + degree, degree)
        if count > _TERMS_PART * runs or runs - count < LEAST_FREE:
            break
        counts.append(count)
    powers = np.array(_core.total_degree_exponents(parameters, len(counts) - 1))
    basis = legendre_terms(points, powers)
    # Terms are in the order of their degrees: the leading columns of one factorization are those of each.
    orthogonal, triangle = np.linalg.qr(basis)
    leverages = np.cumsum(orthogonal**2, axis=1)
    # Points on a grid determine no more powers than they have values.
    pivots = np.minimum.accumulate(np.abs(np.diag(triangle)))
    least, highest = 1e-8 * math.sqrt(runs), 1.0 - 1e-9
    kept = [counts[0]]
    for count in counts[1:]:
        if pivots[count - 1] < least or leverages[:, count - 1].max() > highest:
            break
        kept.append(count)
    inverse = np.linalg.inv(triangle[: kept[-1], : kept[-1]])
    return [
        Fit(
            powers[:count],
            leverages[:, count - 1],
            basis[:, :count],
            orthogonal[:, :count],
            inverse[:count, :count],
        )
        for count in kept
    ]


def left_out(fit: Fit, values: Array) -> Array:
    """Errors at every run of the polynomial fitted to the others."""
    return np.asarray((values - fit.fitted(values)) / (1.0 - fit.leverage))


def best_degree(fits: list[Fit], values: Array) -> int:
    """The degree with the smallest leave-one-out error; at least 1 if there are enough runs."""
    # Relative to the largest value, so that squares are numbers.
    relative = values / (float(np.max(np.abs(values))) or 1.0)
    errors = [float(np.mean(left_out(fit, relative) ** 2)) for fit in fits]
    return max(int(np.argmin(errors)), min(1, len(fits) - 1))


class Model(NamedTuple):
    """A polynomial for a feature, and those of resampled sets of runs."""

    points: Array
    """Points of the runs in [-1, 1]^k, shape (runs, parameters)."""
    values: Array
    """The feature there, shape (runs, cycles)."""
    fit: Fit
    terms: Array
    """Coefficients, shape (terms,)."""
    again: Array
    """Those of resampled sets, shape (terms, replicates)."""
    variances: Array
    """Of each parameter, interactions and scatter, shape (parameters + 2,)."""
    resampled: Array
    """Those of resampled sets, shape (parameters + 2, replicates)."""
    left: Array
    """Residuals of the polynomial, shape (runs, cycles)."""
    scale: Array
    """Factors for the scatter of the resampled sets, shape (replicates,)."""


def find_effects(names: list[str], model: Model) -> Effects:
    """The variance of the values of a feature over the box, decomposed."""
    values = model.values
    variances = np.maximum(model.variances, 0.0)
    total = float(variances.sum())
    shares = variances / total if total > 0.0 else variances
    totals = model.resampled.sum(axis=0)
    # Not limited to 0 and 1 before the ends are taken.
    lower, upper = ends_of(model.resampled / np.where(totals > 0.0, totals, math.inf))
    missed = missed_share(model)
    # What is missed is part of what any parameter gives. Of a smooth response, it moves the other terms too.
    moved = min(_MOVED, math.sqrt(missed))
    lower[:-1] -= moved + aliased_shares(model, total)
    upper[:-1] += missed + moved
    # What differs between the cycles of one run is not that of the parameters.
    lower[-1] = min(float(lower[-1]), float(np.mean(np.var(values, axis=1))) / total if total > 0.0 else 0.0)
    lower, upper = np.clip(lower, 0.0, shares), np.clip(upper, shares, 1.0)
    estimates = [Estimate(*map(float, row)) for row in zip(shares, lower, upper, strict=True)]
    if total == 0.0:
        estimates = [UNKNOWN] * len(estimates)
    words = {1: "rises", -1: "falls"}
    level = float(np.mean(values)) if is_constant(values) else 0.0
    error = max(math.sqrt(missed * total), ROUNDING * float(np.max(np.abs(values))))
    signs = _certain_signs(names, model, error)
    return Effects(
        degree=int(model.fit.powers.sum(axis=1).max()),
        deviation=math.sqrt(total),
        main=dict(zip(names, estimates, strict=False)),
        interactions=estimates[-2],
        scatter=estimates[-1],
        monotone={name: words[sign] for name, sign in zip(names, signs, strict=True) if sign},
        mean=float(model.terms[0]) + level,
        swings={name: _swing(model, axis, level, error) for axis, name in enumerate(names)},
    )


def _swing(model: Model, axis: int, level: float, error: float) -> Swing:
    """Means over all parameters but one, at its ends: terms with other parameters have the mean zero.

    The model is that of the values without their `level`; what it misses has the deviation `error`.
    """
    powers = model.fit.powers
    own = powers.sum(axis=1) == powers[:, axis]
    points = np.zeros((2, powers.shape[1]))
    points[:, axis] = -1.0, 1.0
    basis = legendre_terms(points, powers[own])
    ends = basis @ model.terms[own]
    lower, upper = ends_of(basis @ model.again[own])
    ends, lower, upper = (
        each + level for each in (ends, np.minimum(lower, ends) - error, np.maximum(upper, ends) + error)
    )
    rows = [(float(low), float(high)) for low, high in zip(lower, upper, strict=True)]
    return Swing(float(ends[0]), float(ends[1]), rows[0], rows[1])


def ends_of(resampled: Array) -> tuple[Array, Array]:
    """Ends of the intervals of estimates from their resampled values, shape (estimates, replicates)."""
    lower, upper = np.quantile(resampled, [0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE], axis=1)
    return lower, upper


def model_of(points: Array, values: Array, fits: list[Fit] | None = None, seed: int = 0) -> Model:
    """The polynomial of the degree with the least error at left-out runs, and those of resampled sets, of
    values of shape (runs, cycles), from the polynomials that the points of the runs allow.

    ValueError is raised if there are too few runs for a polynomial of degree 1, or the points do not vary
    all parameters independently.
    """
    fits = fits_of(points) if fits is None else fits
    level = np.zeros_like(values) if is_constant(values) else values
    size = float(np.max(np.abs(level)))
    if not size <= _LARGEST or (0.0 < np.ptp(level) < 1.0 / _LARGEST):
        raise ArgumentError(
            f"effects need values of sizes from {1.0 / _LARGEST:g} to {_LARGEST:g}, got {size:g}: give them "
            "in another unit"
        )
    if len(fits) < 2:
        parameters = points.shape[1]
        least = max(parameters + 1 + LEAST_FREE, math.ceil((parameters + 1) / _TERMS_PART))
        if len(points) >= least:
            raise ArgumentError(
                "effects cannot be told apart: parameters vary together, or one does not vary, and more such "
                "runs do not help"
            )
        raise ArgumentError(
            f"effects of {parameters} parameter{'s' * (parameters > 1)} need at least {least} runs that vary "
            f"all of them, got {len(points)}: ask for more runs"
        )
    return _model(fits[best_degree(fits, level.mean(axis=1))], points, values, level, seed)


def is_constant(values: Array) -> bool:
    """Whether a feature is the same in every run up to rounding, and so has no effects."""
    return bool(np.ptp(values) <= ROUNDING * np.max(np.abs(values)))


def _model(fit: Fit, points: Array, values: Array, level: Array, seed: int) -> Model:
    """One polynomial of values, those that are taken for constant made 0, and of resampled sets of runs.

    Residuals are resampled, divided by their leverage, and with them the variance between cycles; the
    scatter is scaled as its own estimate may be off.
    """
    random = default_rng(seed)
    runs, cycles = level.shape
    free = runs - len(fit.powers)
    mean = level.mean(axis=1)
    within = level.var(axis=1, ddof=1) * (1.0 - 1.0 / cycles) if cycles > 1 else np.zeros(runs)
    terms = fit.solve(mean)
    smooth = fit.basis @ terms
    residuals = (mean - smooth) / np.sqrt(1.0 - fit.leverage)
    residuals -= residuals.mean()
    drawn = random.integers(runs, size=(runs, REPLICATES))
    scale = np.sqrt(free / random.chisquare(free, REPLICATES))
    copies = smooth[:, None] + residuals[drawn] * scale
    again = fit.solve(copies)
    return Model(
        points=points,
        values=values,
        fit=fit,
        terms=terms,
        again=again,
        variances=_variances(fit, terms[:, None], mean[:, None], np.array([within.mean()]))[:, 0],
        resampled=_variances(fit, again, copies, within[drawn].mean(axis=0)),
        left=level - mean[:, None] + residuals[:, None],
        scale=scale,
    )


def box_points(names: list[str], count: int) -> Array:
    """Points that fill the cube evenly, the same for a parameter wherever it stands among the others."""
    return even_points(count, len(names))[:, np.argsort(np.argsort(names))]


def aliased_shares(model: Model, total: float) -> Array:
    """By how much the shares of each parameter and of interactions may be too large, shape (parameters + 1,).

    The polynomial has some of what it misses in its own terms. What it misses at left-out runs, and not what
    is left at its own, is the noise from which the variance of each term then comes.
    """
    fit, free = model.fit, len(model.points) - len(model.fit.powers)
    errors = left_out(fit, model.values.mean(axis=1))
    noise = float(np.sum((errors * (1.0 - fit.leverage)) ** 2)) / free
    more = max(0.0, float(np.mean(errors**2)) - noise)
    spread = [float(fit.spread[group].sum()) for group in _groups(fit)]
    return more * np.array(spread) / total if total > 0.0 else np.zeros(len(spread))


def _groups(fit: Fit) -> list[NDArray[np.bool_]]:
    """The terms of each parameter alone, and of several together."""
    active = fit.powers > 0
    alone = active.sum(axis=1) == 1
    return [*(alone & own for own in active.T), active.sum(axis=1) > 1]


def missed_share(model: Model) -> float:
    """Share of the variance that the polynomial misses at runs that it was made without, at most all of it.

    It may be scatter, or what a higher degree would give to any parameter.
    """
    if is_constant(model.values):
        return 0.0
    error = float(np.mean(left_out(model.fit, model.values.mean(axis=1)) ** 2))
    return min(1.0, error / float(np.var(model.values)))


def _variances(fit: Fit, terms: Array, means: Array, within: Array) -> Array:
    """Variances of each parameter, interactions and scatter without bias, shape (parameters + 2, sets)."""
    noise = np.sum((means - fit.basis @ terms) ** 2, axis=0) / (len(means) - len(fit.powers))
    squares = terms**2 - noise * fit.spread[:, None]
    return np.array([*(squares[group].sum(axis=0) for group in _groups(fit)), noise + within])


def _certain_signs(names: list[str], model: Model, error: float) -> list[int]:
    """Signs of slopes that do not change in the box, in nearly all resampled sets, and are larger than this
    error over half the interval; 0 where not certain."""
    parameters = model.points.shape[1]
    box = box_points(names, _POINTS)
    if parameters <= 8:
        box = np.concatenate([box, np.array(list(itertools.product((-1.0, 1.0), repeat=parameters)))])
    signs = []
    for axis in range(parameters):
        slopes = legendre_terms(box, model.fit.powers, derivative=axis)
        own, again = slopes @ model.terms, slopes @ model.again
        rises, falls = np.mean(again.min(axis=0) > 0.0), np.mean(again.max(axis=0) < 0.0)
        nearly = 0.5 + 0.5 * CONFIDENCE
        signs.append(int(own.min() > error and rises >= nearly) - int(own.max() < -error and falls >= nearly))
    return signs
