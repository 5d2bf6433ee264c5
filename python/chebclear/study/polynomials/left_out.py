"""Error of a polynomial on a grid of Chebyshev roots at nodes that are left out."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def root_basis(count: int, degree: int) -> Array:
    """Chebyshev polynomials at `count` roots, from +1 to -1, and orthonormal there, shape (roots, degree +
    1)."""
    angles = (2 * np.arange(count) + 1) * math.pi / (2 * count)
    basis: Array = np.cos(np.outer(angles, np.arange(degree + 1))) * math.sqrt(2.0 / count)
    basis[:, 0] *= math.sqrt(0.5)
    return basis


def left_out_error(degrees: Sequence[int], nodes: Sequence[int], runs: Array) -> Array:
    """Largest error at nodes that are predicted from the others of their line, shape (samples,).

    The runs, of shape (nodes, samples), have the last parameter fastest.
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
            basis = root_basis(count, tried)
            residual = np.eye(count) - basis @ basis.T
            misses = (residual / np.diag(residual)[:, None] @ lines).reshape(-1, runs.shape[1])
            worst = np.maximum(misses.max(axis=0), -misses.min(axis=0))
            error = np.maximum(error, weight * worst)
    return error
