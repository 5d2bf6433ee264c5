"""Variance-based sensitivity: shares of the parameters in the variance of an output."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...base import files as records
from ...base.rows import Array
from ...base.shown import listed
from .surrogate import Surrogate


@dataclass(frozen=True, eq=False, repr=False)
class VarianceShares(records.ArrayRecord):
    """Shares of the parameters in the variance of an output (Sobol'), if uniform and independent.

    Attributes
    ----------
    variance : Array
        Variance in the squared unit of the output, shape (samples,).
    main : dict[str, Array]
        First-order share of each parameter [-], shape (samples,); 0 where nothing varies.
    total : dict[str, Array]
        Total share of each parameter, with all its interactions [-], shape (samples,).
    """

    variance: Array
    main: dict[str, Array]
    total: dict[str, Array]

    def __repr__(self) -> str:
        return f"<VarianceShares of {listed(self.main, most=4)}, uniform distributions assumed>"


def variance_shares(surrogate: Surrogate) -> VarianceShares:
    """Sobol' shares of a polynomial over its box, in closed form.

    On [-1, 1] the mean of T_i is w_i = 1 / (1 - i²) for even i and 0 for odd i, and that of T_i T_j is
    (w_{i+j} + w_{|i-j|}) / 2.
    """
    c = surrogate.coefficients
    axes = range(len(surrogate.degrees))
    means, moments = [], []
    for degree in surrogate.degrees:
        i = np.arange(degree + 1)
        means.append(_mean(i))
        moments.append(0.5 * (_mean(i[:, None] + i) + _mean(np.abs(i[:, None] - i))))

    def variance_of_mean(kept: set[int]) -> Array:
        """Variance of the mean over all parameters but the kept ones."""
        left = np.moveaxis(c, -1, 0)  # samples first, so that axis q of the parameters is axis q + 1
        for axis in reversed(axes):
            if axis not in kept:
                left = np.tensordot(left, means[axis], axes=(axis + 1, 0))
        weighted = left
        centered = left
        for place, axis in enumerate(sorted(kept)):
            # After all parameters, subtracting the product of the means from the moments gives the variance.
            weighted = np.moveaxis(np.tensordot(weighted, moments[axis], axes=(place + 1, 0)), -1, place + 1)
            outer = np.outer(means[axis], means[axis])
            centered = np.moveaxis(np.tensordot(centered, outer, axes=(place + 1, 0)), -1, place + 1)
        both: Array = (left * (weighted - centered)).reshape(len(left), -1)
        variance: Array = np.maximum(both.sum(axis=1), 0.0)
        return variance

    everything = set(axes)
    variance = variance_of_mean(everything)
    varies = variance > surrogate.rounding**2

    def share(part: Array) -> Array:
        quotient: Array = np.divide(part, variance, out=np.zeros_like(variance), where=varies)
        return np.clip(quotient, 0.0, 1.0)

    names = list(surrogate.intervals)
    main = {name: share(variance_of_mean({axis})) for axis, name in enumerate(names)}
    total = {name: share(variance - variance_of_mean(everything - {axis})) for axis, name in enumerate(names)}
    return VarianceShares(variance, main, total)


def _mean(i: NDArray[np.int_]) -> Array:
    """Mean of T_i over [-1, 1]."""
    even = i % 2 == 0
    return np.where(even, 1.0 / np.where(even, 1.0 - i * i.astype(float), 1.0), 0.0)
