"""Polynomials on a grid of Chebyshev roots of which some runs are missing: least squares on the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...errors import ArgumentError

Array = NDArray[np.float64]

# Largest condition number of the least squares. The error of the polynomial at the missing runs is about this
# many times the error at the others: at 10, an error of 0.5 % of the width is at the limit of "resolved".
MOST_CONDITION = 10.0

# A run whose leverage is nearer to 1 than this is followed by the polynomial whatever its value is.
_DETERMINED = 1e-9


@dataclass(frozen=True)
class HoleFit:
    """Linear map from the known values on the grid to the missing ones, for any output."""

    missing: NDArray[np.intp]
    """Numbers of the missing runs on the grid."""
    known: NDArray[np.intp]
    """Numbers of the known runs."""
    dropped: NDArray[np.bool_]
    """Mask of the terms that the known runs do not determine, the last parameter fastest."""
    condition: float
    """Condition number of the least squares [-]."""
    matrix: Array
    """From known values to missing ones, shape (missing, known)."""

    def filled(self, values: Array) -> Array:
        """Values on the whole grid, shape (nodes, samples), from those of the known runs.

        A fit to the whole grid with these values, without the dropped terms, is the least-squares fit to the
        known ones: its residual vanishes at the missing runs.
        """
        whole = np.empty((len(self.known) + len(self.missing), values.shape[1]))
        whole[self.known] = values
        whole[self.missing] = self.matrix @ values
        return whole

    def left_out(self, degrees: Sequence[int], nodes: Sequence[int], values: Array) -> Array:
        """Error of each known run as predicted by the others, from their values (known, samples).

        The prediction is of the highest total degree for which the others determine every run, one less
        than the fitted one if that follows every run. If it has one degree of freedom, half of the errors
        of the degree below count too, since a single term may vanish by chance. The error is infinite if
        no degree determines the runs.
        """
        shares = _shares([degree + 1 for degree in degrees], degrees).ravel()
        order = np.argsort(shares, kind="stable")
        order = order[~self.dropped[order]]
        basis: Array = np.ones((1, 1))
        for count, degree in zip(nodes, degrees, strict=True):
            basis = np.asarray(np.kron(basis, _basis(count)[:, : degree + 1]), dtype=np.float64)
        # Ascending degrees: the leading columns span the polynomials of each of them.
        spanned = np.linalg.qr(basis[self.known][:, order])[0]
        free = 1.0 - np.cumsum(spanned**2, axis=1)
        counts = np.searchsorted(shares[order], np.unique(shares[order]), side="right")
        counts = counts[np.all(free[:, counts - 1] > _DETERMINED, axis=0)]
        error = np.full_like(values, 0.0 if len(counts) else np.inf)
        tried = 2 if len(counts) and counts[-1] == len(self.known) - 1 else 1
        for weight, count in zip((1.0, 0.5)[:tried], counts[::-1], strict=False):
            leading = spanned[:, :count]
            residual = np.abs(values - leading @ (leading.T @ values))
            error = np.maximum(error, weight * residual / free[:, count - 1 : count])
        return error


def fit_holes(nodes: Sequence[int], degrees: Sequence[int], missing: Sequence[int]) -> HoleFit:
    """Find the terms that the runs determine, and the missing values for them.

    The basis is orthonormal on the whole grid of roots. The missing values are chosen to minimize the mean
    square of the terms that are left out. Terms of the highest total degree, relative to the degree in each
    parameter, are left out until the known runs determine the others well.

    Parameters
    ----------
    nodes, degrees : sequence of int
        Number of roots and degree of each parameter.
    missing : sequence of int
        Numbers of the missing runs on the grid, the last parameter fastest.

    Returns
    -------
    HoleFit

    Raises
    ------
    ValueError
        If not even a constant is determined.
    """
    count = int(np.prod(nodes))
    holes = np.asarray(missing, dtype=np.intp)
    bases = [_basis(nodes_of) for nodes_of in nodes]
    # Terms of degrees 0 to nodes - 1, and which are beyond the degrees.
    shares = _shares(nodes, degrees)
    beyond = np.zeros(nodes, dtype=bool)
    for number, degree in zip(np.indices(nodes), degrees, strict=True):
        beyond |= number > degree
    levels = np.unique(shares[~beyond])[::-1]
    deltas = np.zeros((count, len(holes)))
    deltas[holes, np.arange(len(holes))] = 1.0
    terms = _transformed(deltas, [basis.T for basis in bases], nodes)
    for level in levels:
        left_out = (beyond | (shares > level)).ravel()
        projected = _transformed(np.where(left_out[:, None], terms, 0.0), bases, nodes).T
        smallest = float(np.linalg.eigvalsh(projected[:, holes])[0])
        if smallest * MOST_CONDITION**2 >= 1.0:
            break
    else:
        raise ArgumentError(f"{len(holes)} of {count} runs failed: too few are left for a polynomial")
    known = np.setdiff1d(np.arange(count), holes)
    dropped = left_out.reshape(nodes)[tuple(slice(degree + 1) for degree in degrees)].ravel()
    matrix = np.asarray(-np.linalg.solve(projected[:, holes], projected[:, known]), dtype=np.float64)
    return HoleFit(holes, known, dropped, smallest**-0.5, matrix)


def _shares(sizes: Sequence[int], degrees: Sequence[int]) -> Array:
    """Total degree of the first `sizes` terms along each axis, relative to the degree in each parameter."""
    shares = np.zeros(sizes)
    for number, degree in zip(np.indices(sizes), degrees, strict=True):
        shares += number / max(degree, 1)
    # Equal sums of fractions must be equal.
    rounded: Array = np.round(shares, 9)
    return rounded


def _basis(count: int) -> Array:
    """The orthonormal Chebyshev polynomials at their roots, from +1 to -1, shape (roots, polynomials)."""
    angles = (2 * np.arange(count) + 1) * np.pi / (2 * count)
    basis: Array = np.cos(np.outer(angles, np.arange(count))) * np.sqrt(2.0 / count)
    basis[:, 0] *= np.sqrt(0.5)
    return basis


def _transformed(values: Array, matrices: Sequence[Array], nodes: Sequence[int]) -> Array:
    """Columns on the grid, with a matrix applied along each axis."""
    grid = values.reshape(*nodes, -1)
    for axis, matrix in enumerate(matrices):
        grid = np.moveaxis(np.tensordot(matrix, grid, axes=(1, axis)), 0, axis)
    return grid.reshape(values.shape)
