"""Polynomials on a grid of Chebyshev roots: errors at nodes left out, and fits without missing runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...base.rows import Array
from ...errors import ArgumentError


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


# Largest condition number of the least squares. The error of the polynomial at the missing runs is about this
# many times the error at the others: at 10, an error of 0.5 % of the width is at the limit of "resolved".
# Of 200 grids with holes 50 are wrong there by more than 5 % of the range; with half of it 75, with twice 47.
MOST_CONDITION = 10.0

# A run whose leverage is nearer to 1 than this is followed by the polynomial whatever its value is.
_DETERMINED = 1e-9


@dataclass(frozen=True)
class HoleFit:
    """The least-squares fit to the runs of a grid that are there, for any output."""

    missing: NDArray[np.intp]
    """Numbers of the missing runs on the grid, the last parameter fastest."""
    known: NDArray[np.intp]
    """Numbers of the known runs."""
    dropped: NDArray[np.bool_]
    """Mask of the terms that the known runs do not determine, the last parameter fastest."""
    condition: float
    """Condition number of the least squares on a basis that is orthonormal on the whole grid [-]."""
    spanned: Array
    """Orthonormal columns that span the other terms at the known runs, those of low degree first."""
    counts: NDArray[np.intp]
    """How many of these columns span the terms up to each total degree."""
    matrix: Array
    """From known values to those of the fit at the missing runs, shape (missing, known)."""

    def filled(self, values: Array) -> Array:
        """Values on the whole grid, shape (nodes, samples), from those of the known runs.

        The fit to the whole grid is that to the known runs: its residual vanishes at the missing ones.
        """
        whole = np.empty((len(self.known) + len(self.missing), values.shape[1]))
        whole[self.known] = values
        whole[self.missing] = self.matrix @ values
        return whole

    def left_out(self, values: Array) -> Array:
        """Error of each known run as predicted by the others, from their values (known, samples).

        The prediction is of the highest total degree for which the others determine every run. If it has one
        degree of freedom, half of the errors of the degree below count too, since a single term may vanish by
        chance. The error is infinite if no degree determines the runs.
        """
        free = 1.0 - np.cumsum(self.spanned**2, axis=1)
        counts = self.counts[np.all(free[:, self.counts - 1] > _DETERMINED, axis=0)]
        error = np.full_like(values, 0.0 if len(counts) else np.inf)
        tried = 2 if len(counts) and counts[-1] == len(self.known) - 1 else 1
        for weight, count in zip((1.0, 0.5)[:tried], counts[::-1], strict=False):
            leading = self.spanned[:, :count]
            residual = np.abs(values - leading @ (leading.T @ values))
            error = np.maximum(error, weight * residual / free[:, count - 1 : count])
        return error


def fit_holes(nodes: Sequence[int], degrees: Sequence[int], missing: Sequence[int]) -> HoleFit:
    """The fit without the missing runs of a grid; ValueError if the others determine not even a constant.

    Terms of the highest total degree, relative to the degree in each parameter, are left out until the known
    runs determine the others well.
    """
    holes = np.asarray(missing, dtype=np.intp)
    basis: Array = np.ones((1, 1))
    shares: Array = np.zeros(1)
    for count, degree in zip(nodes, degrees, strict=True):
        basis = np.asarray(np.kron(basis, root_basis(count, degree)), dtype=float)
        shares = (shares[:, None] + np.arange(degree + 1) / max(degree, 1)).ravel()
    shares = np.round(shares, 9)  # equal sums of fractions must be equal
    order = np.argsort(shares, kind="stable")
    known = np.setdiff1d(np.arange(len(basis)), holes)
    for level in np.unique(shares)[::-1]:
        order = order[shares[order] <= level]
        # Of an orthonormal basis, what the missing runs hold of a polynomial the others lack.
        lacking = 1.0 - np.linalg.norm(basis[holes][:, order], 2) ** 2
        if lacking * MOST_CONDITION**2 >= 1.0:
            break
    else:
        raise ArgumentError(f"{len(holes)} of {len(basis)} runs failed: too few are left for a polynomial")
    spanned, triangle = np.linalg.qr(basis[known][:, order])
    matrix = basis[holes][:, order] @ np.linalg.solve(triangle, spanned.T)
    counts = np.searchsorted(shares[order], np.unique(shares[order]), side="right")
    dropped = np.isin(np.arange(len(shares)), order, invert=True)
    return HoleFit(holes, known, dropped, float(lacking**-0.5), spanned, counts, matrix)
