"""The tolerance with which a requirement would be kept, estimated from runs that are there."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...base.quantities import Interval
from ...base.rows import Array
from ..features.effects import Fit, best_degree, fits_of, left_out, legendre_terms
from ..polynomials.points import nominal_point, on_cube
from .conformance import Share

# Shares that are aimed at [-]: the first of them that is not reached yet.
_AIMS = (0.99, 0.999)
# No tolerance is closed further than to this part [-], from which `allocate` searches too.
_LEAST_PART = 0.1
# A polynomial that explains less of the variance at runs that it was not made from predicts no tolerance [-].
_EXPLAINED = 0.5
# Halvings of the range of the part: more digits than are said.
_HALVINGS = 8


class Needed(NamedTuple):
    """What would bring so many mechanisms within the limits of a requirement; an estimate."""

    share: float
    """Share of the mechanisms that is aimed at [-]."""
    parameter: str
    """The parameter whose tolerance must be closed least; empty if closing a single one is not enough."""
    part: float
    """The part of its tolerance that is left, without such a parameter of all of them [-]; NaN where neither
    is enough."""
    nominal_is_outside: bool
    """Whether the mechanism at the nominal values is outside itself, so that no tolerance helps."""
    runs: int
    """Runs that the estimate is made from [-]."""


def needed_tolerance(
    share: Share, parameters: Array, names: Sequence[str], intervals: Mapping[str, Interval]
) -> Needed | None:
    """The tolerance that a requirement needs, from the runs that were counted; None where they do not tell.

    Polynomials for the extremes of the quantity say how each run would move with a parameter that is nearer
    to its nominal value; what they miss of a run stays as it is, and runs that failed stay outside.
    """
    runs = len(share.highest)
    aims = [aim for aim in _AIMS if share.share < aim and runs * (1.0 - aim) >= 1.0 - 1e-9]
    if not share.outside or not aims or len(parameters) < runs:
        return None
    known = np.isfinite(share.lowest) & np.isfinite(share.highest)
    sides = {name: intervals[name] for name in names if name in intervals}
    columns = [k for k, name in enumerate(names) if name in sides and np.ptp(parameters[:runs, k]) > 0.0]
    sides = {names[k]: sides[names[k]] for k in columns}
    if not sides or np.count_nonzero(known) < 2:
        return None
    points = on_cube(sides, parameters[:runs][known][:, columns])
    nominal = on_cube(sides, nominal_point(sides)[None])[0]
    fits = fits_of(points)
    ends = [
        _Moved(fits, points, sign * values[known], sign * limit)
        for values, limit, sign in (
            (share.highest, share.limits[1], 1.0),
            (share.lowest, share.limits[0], -1.0),
        )
        if math.isfinite(limit)
    ]
    if len(fits) < 2 or not all(one.follows for one in ends if one.breaks):
        return None
    allowed = (1.0 - aims[0]) * runs - np.count_nonzero(~known)

    def is_enough(column: int | slice, part: float) -> bool:
        at = points.copy()
        at[:, column] = nominal[column] + part * (at[:, column] - nominal[column])
        outside = np.any([one.outside_at(at) for one in ends], axis=0)
        return bool(np.count_nonzero(outside) <= allowed)

    if any(one.is_beyond(nominal[None]) for one in ends):
        return Needed(aims[0], "", math.nan, nominal_is_outside=True, runs=runs)

    def largest(column: int | slice, least: float) -> float:
        """The largest part that is enough, if it is above a least one; else NaN."""
        low, high = least, 1.0
        if not is_enough(column, low):
            return math.nan
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if is_enough(column, middle) else (low, middle)
        return low

    best, parameter = math.nan, ""
    for column, name in enumerate(sides):
        part = largest(column, _LEAST_PART if math.isnan(best) else best)
        if not math.isnan(part):
            best, parameter = part, name
    if not parameter:
        best = largest(slice(None), _LEAST_PART)
    return Needed(aims[0], parameter, best, nominal_is_outside=False, runs=runs)


class _Moved:
    """Largest value of a quantity in each run against an upper limit, as it moves with the parameters."""

    def __init__(self, fits: list[Fit], points: Array, values: Array, limit: float) -> None:
        fit = fits[best_degree(fits, values)]
        self._values, self._limit, self._powers = values, limit, fit.powers
        self._terms = fit.solve(values)
        self._there = legendre_terms(points, fit.powers) @ self._terms
        spread = float(np.var(values))
        self.follows = float(np.mean(left_out(fit, values) ** 2)) <= (1.0 - _EXPLAINED) * spread
        self.breaks = bool(np.any(values >= limit))

    def outside_at(self, points: Array) -> Array:
        """Whether each run is outside with its parameters at other points."""
        moved = self.polynomial_at(points) - self._there + self._values
        return np.asarray(moved >= self._limit)

    def is_beyond(self, points: Array) -> bool:
        """Whether the polynomial is outside at one of some points."""
        return bool(np.any(self.polynomial_at(points) >= self._limit))

    def polynomial_at(self, points: Array) -> Array:
        """The polynomial at points."""
        return np.asarray(legendre_terms(points, self._powers) @ self._terms)
