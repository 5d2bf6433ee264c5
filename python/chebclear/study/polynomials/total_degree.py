"""Polynomials of total degree: few terms where there are many parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ... import _core
from ...base.rows import Array
from ...errors import ArgumentError
from ...scene.scene import Interval
from .surrogate import BoundKind, Surrogate, nominal_factors

if TYPE_CHECKING:
    from ..._core import _Ranges


# Largest number of terms of a polynomial that is kept as a tensor, for which more methods exist; 1441 samples
# then take 15 MB.
_MOST_TENSOR = 1296


def total_degree_polynomial(intervals: Mapping[str, Interval], degree: int, terms: Array) -> Surrogate:
    """The polynomial with these coefficients, shape (terms, samples), in the order of the degrees of the
    terms: a `TotalDegree` where their tensor would be large."""
    parameters = len(intervals)
    degrees = (degree,) * parameters
    if (degree + 1) ** parameters > _MOST_TENSOR:
        return TotalDegree(dict(intervals), degrees, terms)
    tensor = np.zeros((degree + 1,) * parameters + terms.shape[1:])
    exponents = np.array(_core.total_degree_exponents(parameters, degree))
    tensor[tuple(exponents.T)] = terms
    return Surrogate(dict(intervals), degrees, tensor.reshape(-1, terms.shape[1]))


@dataclass(frozen=True, eq=False, repr=False)
class TotalDegree(Surrogate):
    """A Chebyshev polynomial in the parameters for every instant, with terms up to a total degree.

    `terms` holds the coefficients in the order of the degrees of the terms; `degrees` is the total degree,
    once for every parameter.
    """

    @property
    def coefficients(self) -> Array:
        """Not available as an array over the degrees of all parameters: always raises ValueError."""
        raise ArgumentError(
            f"a polynomial of total degree {self.degrees[0]} in {len(self.degrees)} parameters has no "
            "array of coefficients, since their tensor would be too large, and so neither variance shares "
            "nor quantiles. Features of the runs and their effects have shares for any number of parameters"
        )

    def bounds(self, kind: BoundKind = "range", threads: int | None = None) -> tuple[Array, Array]:
        """Lower and upper bounds of the polynomial over the box; see `Surrogate.bounds`."""
        if kind != "eq31":
            return super().bounds(kind, threads)
        radius = np.abs(self.terms[1:]).sum(axis=0)
        return self.terms[0] - radius, self.terms[0] + radius

    def _ranges(self, threads: int | None) -> _Ranges:
        # Branch and bound on the coefficients, with monotone parameters fixed. The bounds exceed attained
        # values by at most 1e-6 of the sum of the coefficients, unless that needs more than 1000 boxes; then
        # they are wider, but still hold.
        return _core.total_degree_ranges(self.terms, len(self.degrees), self.degrees[0], threads)

    def _slopes(self, axis: int) -> Array:
        exponents, number = self._numbers()
        terms = np.zeros_like(self.terms)
        for term, c in zip(exponents, self.terms, strict=True):
            # T_n' = 2 n (T_{n-1} + T_{n-3} + ...), with half of T_0
            for m in range(term[axis] - 1, -1, -2):
                lower = (*term[:axis], m, *term[axis + 1 :])
                terms[number[lower]] += (1.0 if m == 0 else 2.0) * term[axis] * c
        return terms

    def frozen(self, parameter: str) -> Surrogate:
        """The polynomial with one parameter at its nominal value, on which it then does not depend."""
        axis = self._axis(parameter)
        exponents, number = self._numbers()
        factors = nominal_factors(self.intervals[parameter], self.degrees[0])
        terms = np.zeros_like(self.terms)
        for term, c in zip(exponents, self.terms, strict=True):
            terms[number[(*term[:axis], 0, *term[axis + 1 :])]] += factors[term[axis]] * c
        return TotalDegree(self.intervals, self.degrees, terms)

    def _numbers(self) -> tuple[list[tuple[int, ...]], dict[tuple[int, ...], int]]:
        """Exponents of the terms, and the number of each."""
        found = _core.total_degree_exponents(len(self.degrees), self.degrees[0])
        exponents = [tuple(term) for term in found]
        return exponents, {term: number for number, term in enumerate(exponents)}

    def _at(self, terms: Array, points: Array, shape: tuple[int, ...]) -> Array:
        basis = _core.total_degree_basis(np.ascontiguousarray(points), self.degrees[0])
        return (basis @ terms).reshape(*shape, terms.shape[1])
