"""The cheapest tolerances that keep limits, by polynomials of what mechanisms exceed the limits by."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...base.rows import Array
from ...data.needed import needed
from ...scene.scene import Interval
from ...study.features.effects import best_degree, fits_of, left_out, legendre_terms

# Errors of a plane at left-out runs, over the deviation of their values, that are those of rounding.
_ROUNDING = 1e-9
# To which part costs and tolerances are found: where draws count, they are not known better.
_EXACT, _DRAWN = 1e-14, 1e-5
# Halvings that find a level of a distribution to its rounding.
_HALVINGS = 80
# Draws beyond a level from which on it is known. A rarer one goes on from this level and one with so many
# times the draws: a model that only aims, since runs prove the design.
_COUNTED, _APART = 50, 4
_NORMAL = NormalDist()


class Exceeded(NamedTuple):
    """How far the limits must be widened so that the allowed share of the mechanisms stays outside."""

    values: Array
    """For each corner of the parameters that are only intervals; below 0 if the limits suffice."""
    slopes: Array
    """Their derivatives by the tolerances, shape (corners, parameters)."""
    parts: Array
    """How much of this each limit takes, a share, shape (corners, limits)."""


@dataclass(frozen=True, eq=False)
class ExcessModel:
    """What mechanisms exceed limits by, as polynomials in the parameters and the remaining scatter."""

    nominal: Array
    """Nominal values of the parameters [SI units]."""
    box: tuple[Array, Array]
    """Midpoints and half-widths of the intervals of the runs that it was fitted to [SI units]."""
    powers: NDArray[np.int64]
    """Degrees of the terms, shape (terms, parameters)."""
    terms: Array
    """Their coefficients, shape (terms, limits)."""
    rest: Array
    """What each run exceeds the polynomial by, shape (runs, limits)."""
    deviations: Array
    """Standard deviations of the values in the runs, shape (limits,)."""
    draws: Array
    """Distances of mechanisms from the nominal values, in tolerances; NaN for what is only an interval,
    shape (draws, parameters). The same for all tolerances: designs differ by nothing else."""
    corners: Array
    """The same of the corners of what is only an interval; NaN for the others, as `draws`."""
    is_normal: bool
    """Whether the values are normally distributed: a plane of normal parameters."""

    @classmethod
    def fitted(
        cls,
        sides: Sequence[Interval],
        points: Array,
        excess: Array,
        draws: Array,
        corners: Array,
        all_normal: bool,
    ) -> ExcessModel:
        """The model of runs in a box, of what they exceed each limit by, shape (runs, limits)."""
        nominal, middle, half = np.array([(one.nominal, one.midpoint, one.half_width) for one in sides]).T
        cube = (points - middle) / half
        deviations = excess.std(axis=0)
        # The plane first: what a table of lengths adds up needs no other.
        fit = fits_of(cube, most=1)[-1]
        errors = np.array([left_out(fit, values) for values in excess.T]).T
        is_plane = bool(np.all(np.abs(errors) <= _ROUNDING * deviations))
        if not is_plane:
            fits = fits_of(cube)
            fit = fits[max(best_degree(fits, values) for values in excess.T)]
        rest = (excess - fit.fitted(excess)) / np.sqrt(1.0 - fit.leverage)[:, None]
        # One quantity: its distances from both limits have a constant sum.
        single = excess.shape[1] == 1 or (excess.shape[1] == 2 and np.ptp(excess.sum(axis=1)) < _ROUNDING)
        is_normal = bool(is_plane and single and all_normal)
        terms = fit.solve(excess)
        return cls(nominal, (middle, half), fit.powers, terms, rest, deviations, draws, corners, is_normal)

    @property
    def precision(self) -> float:
        """To which part the cheapest tolerances can be known [-]: draws leave them uncertain."""
        return _EXACT if self.is_normal or np.isnan(self.draws).all() else _DRAWN

    @property
    def scatter(self) -> float:
        """The largest share of the variance of a value that no parameter explains [-]."""
        variances = np.where(self.deviations > 0.0, self.deviations, np.inf) ** 2
        return float(np.max(np.mean(self.rest**2, axis=0) / variances))

    def exceeded(self, tolerances: Array, outside: float) -> Exceeded:
        """How far the limits must be widened with these tolerances to leave a share `outside` [-]."""
        find = self._of_normal if self.is_normal else self._of_draws
        rows = [find(tolerances, outside, corner) for corner in self.corners]
        values, slopes, parts = zip(*rows, strict=True)
        return Exceeded(np.array(values), np.array(slopes), np.array(parts))

    def deciding(self, parameters: Sequence[int]) -> tuple[int, float]:
        """Which of these parameters explains most of the variance of a value, and which share of it [-].

        The value is that which exceeds its limit most, by three standard deviations.
        """
        column = int(np.argmax(self.terms[0] + 3.0 * self.deviations))
        squares, deviation = self.terms[:, column] ** 2, self.deviations[column] or math.inf
        shares = [float(squares[self.powers[:, one] > 0].sum()) / deviation**2 for one in parameters]
        return max(zip(parameters, shares, strict=True), key=lambda one: one[1])

    @cached_property
    def _rest_of_draws(self) -> Array:
        """What each draw exceeds the polynomial by: that of the runs in turn, shape (limits, draws)."""
        return self.rest[np.arange(len(self.draws)) % len(self.rest)].T.copy()

    def _plane(self) -> tuple[Array, Array]:
        """Values at the nominal parameters, and slopes by the parameters, shape (limits, parameters)."""
        middle, half = self.box
        cube = ((self.nominal - middle) / half)[None, :]
        along = [legendre_terms(cube, self.powers, axis)[0] @ self.terms for axis in range(len(half))]
        return legendre_terms(cube, self.powers)[0] @ self.terms, np.array(along).T / half

    def _of_draws(self, tolerances: Array, outside: float, corner: Array) -> tuple[float, Array, Array]:
        """By the ordered values of the draws. Slopes are the means over those ranked near to the one."""
        places = np.where(np.isnan(self.draws), corner, self.draws)
        middle, half = self.box
        # Limit by limit: products with so few columns take a matrix product a hundred times as long.
        if np.max(self.powers.sum(axis=1)) <= 1:
            each = [mean + places @ (slope * tolerances) for mean, slope in zip(*self._plane(), strict=True)]
        else:
            terms = legendre_terms((self.nominal + tolerances * places - middle) / half, self.powers)
            each = [terms @ own for own in self.terms.T]
        values = np.array(each) + self._rest_of_draws
        highest = values.max(axis=0)
        # Without draws, in the worst case, none may be outside.
        counted = max(outside, min(_COUNTED / len(places), 0.01)) if outside else 0.0
        rank = int(counted * len(places))
        last = min(2 * rank, len(places) - 1)
        largest = np.argpartition(-highest, last)[: last + 1]
        order = largest[np.argsort(-highest[largest])]
        near = order[rank // 2 :]
        limit = values[:, near].argmax(axis=0)
        rows = np.arange(len(near))
        cube = (self.nominal + tolerances * places[near] - middle) / half
        along = [
            (legendre_terms(cube, self.powers, axis) @ self.terms)[rows, limit] for axis in range(len(half))
        ]
        slopes = np.mean(np.array(along).T / half * places[near], axis=0)
        parts = np.bincount(limit, minlength=len(values)) / len(near)
        highest_there = float(highest[order[rank]])
        if counted > outside:
            # On by the normal scores of two levels: exact where values are normal, less far where they end.
            second = min(_APART * rank, len(places) // 2)
            low = -float(np.partition(-highest, second)[second])
            scores = [-_NORMAL.inv_cdf(share) for share in (outside, counted, second / len(places))]
            value = highest_there + (highest_there - low) * (scores[0] - scores[1]) / (scores[1] - scores[2])
            shift = np.where(np.isnan(corner), 0.0, corner) * tolerances
            center = legendre_terms(((self.nominal + shift - middle) / half)[None, :], self.powers)[0]
            about = float(parts @ (center @ self.terms))
            beyond = (value - about) / (highest_there - about) if highest_there > about else 1.0
            return value, beyond * slopes, parts
        return highest_there, slopes, parts

    def _of_normal(self, tolerances: Array, outside: float, corner: Array) -> tuple[float, Array, Array]:
        """By the normal distribution: the probabilities beyond both limits, which exclude each other."""
        shift = np.where(np.isnan(corner), 0.0, corner)
        means, slopes = self._plane()
        means = means + slopes @ (shift * tolerances)
        # Three standard deviations are a tolerance.
        own = np.where(np.isnan(corner), slopes[0] / 3.0, 0.0)
        deviation = float(np.linalg.norm(own * tolerances))
        if deviation == 0.0:
            return float(means.max()), slopes[means.argmax()] * shift, np.eye(len(means))[means.argmax()]
        low, high = means.min() - 40.0 * deviation, means.max() + 40.0 * deviation
        for _ in range(_HALVINGS):
            level = 0.5 * (low + high)
            beyond = sum(_NORMAL.cdf((mean - level) / deviation) for mean in means)
            low, high = (level, high) if beyond > outside else (low, level)
        distances = (means - level) / deviation
        parts = np.exp(-0.5 * (distances**2 - np.min(distances**2)))
        parts /= parts.sum()
        widening = own**2 * tolerances / deviation
        return level, parts @ (slopes * shift - distances[:, None] * widening), parts


Cost = Callable[[float], float]
Keeps = Callable[[Array], Exceeded]
"""What the limits must be widened by with tolerances of the parameters that have a cost."""


def cheapest(
    exceeded: Keeps, costs: Sequence[Cost], start: Array, ends: tuple[Array, Array], precision: float
) -> Array | None:
    """The cheapest tolerances between two ends, to a part of the cost; None if the tightest fail."""
    low, high = ends
    if exceeded(low).values.max() > 0.0:
        return None
    if exceeded(high).values.max() <= 0.0:
        return high
    begin = _at_the_limit(exceeded, start, low, high, precision)
    size = total(costs, begin) or 1.0

    def slope(change: Array) -> Array:
        tolerances = begin * np.exp(change)
        return cost_slopes(costs, tolerances) * tolerances / size

    found = needed("scipy.optimize", "allocate with costs that are functions").minimize(
        lambda change: total(costs, begin * np.exp(change)) / size,
        np.zeros(len(begin)),
        jac=slope,
        bounds=np.log(np.column_stack([low, high]) / begin[:, None]),
        constraints={
            "type": "ineq",
            "fun": lambda change: -exceeded(begin * np.exp(change)).values,
            "jac": lambda change: -exceeded(begin * np.exp(change)).slopes * begin * np.exp(change),
        },
        method="SLSQP",
        options={"ftol": precision, "maxiter": 50},
    )
    return _at_the_limit(exceeded, np.clip(begin * np.exp(found.x), low, high), low, high, precision)


def _at_the_limit(exceeded: Keeps, tolerances: Array, low: Array, high: Array, precision: float) -> Array:
    """Tolerances times the largest factor, within their ends, that keeps the limits."""
    span = float(np.max(np.log(high / low)))
    least, most = -span, span
    while most - least > max(precision, 1e-12):
        middle = 0.5 * (least + most)
        keeps = exceeded(np.clip(tolerances * math.exp(middle), low, high)).values.max() <= 0.0
        least, most = (middle, most) if keeps else (least, middle)
    return np.clip(tolerances * math.exp(least), low, high)


def cheapest_of(exceeded: Keeps, choices: Sequence[Array], costs: Sequence[Array]) -> tuple[int, ...] | None:
    """The number of the cheapest choice of each tolerance, by branch and bound; None if the tightest fail.

    Choices begin with the tightest, and costs do not rise. A wider tolerance is taken not to keep limits that
    a tighter one breaks.
    """
    best: tuple[float, tuple[int, ...] | None] = math.inf, None

    def spent(chosen: tuple[int, ...]) -> float:
        """Cost with all others at their coarsest."""
        return math.fsum(own[chosen[place] if place < len(chosen) else -1] for place, own in enumerate(costs))

    def keeps(chosen: tuple[int, ...]) -> bool:
        """Whether it can still keep the limits, with all others at their tightest."""
        tolerances = [own[chosen[place] if place < len(chosen) else 0] for place, own in enumerate(choices)]
        return bool(exceeded(np.array(tolerances)).values.max() <= 0.0)

    def visit(chosen: tuple[int, ...]) -> None:
        nonlocal best
        if spent(chosen) >= best[0] or not keeps(chosen):
            return
        if len(chosen) == len(choices):
            best = spent(chosen), chosen
            return
        for choice in reversed(range(len(choices[len(chosen)]))):
            visit((*chosen, choice))

    visit(())
    return best[1]


def total(costs: Sequence[Cost], tolerances: Array) -> float:
    """The sum of the costs."""
    return math.fsum(cost(float(one)) for cost, one in zip(costs, tolerances, strict=True))


def cost_slopes(costs: Sequence[Cost], tolerances: Array) -> Array:
    """Derivative of each cost by its tolerance."""
    step = 1e-5  # relative; the error is its square
    rises = [
        cost(t * (1.0 + step)) - cost(t * (1.0 - step))
        for cost, t in zip(costs, map(float, tolerances), strict=True)
    ]
    return np.array(rises) / (2.0 * step * tolerances)
