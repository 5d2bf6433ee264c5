"""Error of a polynomial on a grid of Chebyshev roots at nodes that are left out."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def left_out_error(degrees: Sequence[int], nodes: Sequence[int], runs: Array) -> Array:
    """Largest error at nodes that are predicted from the others of their line, for every instant.

    Parameters
    ----------
    degrees, nodes : sequence of int
        Degree of the polynomial and number of roots of each parameter [-].
    runs : ndarray, shape (nodes, samples)
        Values on the grid, the last parameter fastest.

    Returns
    -------
    ndarray, shape (samples,)
        In the unit of the output.
    """
    error: Array = np.zeros(runs.shape[1])
    before = 1
    for count, degree in zip(nodes, degrees, strict=True):
        # As a stack of matrices, which are multiplied where they are; `tensordot` would copy them.
        lines = runs.reshape(before, count, -1)
        before *= count
        highest = min(degree, count - 2)
        for tried, weight in ((highest, 1.0), (highest - 1, 0.5)):
            if tried < (0 if tried == highest else 1):
                continue
            misses = (_left_out(count, tried) @ lines).reshape(-1, runs.shape[1])
            worst = np.maximum(misses.max(axis=0), -misses.min(axis=0))
            error = np.maximum(error, weight * worst)
    return error


def _left_out(count: int, degree: int) -> Array:
    """Matrix from values at `count` roots to their prediction errors by fits of `degree` to the others."""
    angles = (2 * np.arange(count) + 1) * math.pi / (2 * count)
    basis = np.cos(np.outer(angles, np.arange(degree + 1))) * math.sqrt(2.0 / count)
    basis[:, 0] *= math.sqrt(0.5)
    residual = np.eye(count) - basis @ basis.T
    left_out: Array = residual / np.diag(residual)[:, None]
    return left_out
