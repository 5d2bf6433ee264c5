"""Polynomials in the uncertain parameters.

A surrogate is made from values on a grid, which need not come from a mechanism. Parameters
are keywords with physical values; arrays have time on their last axis.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import ArrayLike

from ... import _core
from ...base import files as records
from ...base.arguments import Checks
from ...base.rows import Array
from ...base.shown import did_you_mean, meant_or_known
from ...errors import ArgumentError, ArgumentTypeError
from ...execution.options import MOST_THREADS
from ...scene.scene import Interval

if TYPE_CHECKING:
    from ..._core import _Ranges


def chebyshev_grid(intervals: Sequence[Interval], nodes: Sequence[int]) -> Array:
    """Tensor grid of Chebyshev roots on a box, Eq. (26), shape (runs, parameters); the first parameter
    changes slowest."""
    return tensor_grid(
        [
            side.midpoint + side.half_width * _core.chebyshev_nodes(count)
            for side, count in zip(intervals, nodes, strict=True)
        ]
    )


def tensor_grid(sides: Sequence[Array]) -> Array:
    """All combinations of the values of every side, shape (runs, sides); the first side changes slowest."""
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, len(sides))


def nominal_factors(side: Interval, degree: int) -> Array:
    """Chebyshev polynomials up to a degree at the nominal value of an interval; in its middle 1, 0, -1, 0."""
    factors: Array = chebvander((side.nominal - side.midpoint) / side.half_width, degree)[0]
    return factors


BoundKind = Literal["range", "eq31"]

MOST_RANGE_DEGREE = 30
"""Highest degree for which the core certifies a range [-]."""


# Of the runs that are worked on at a time, where every instant is by itself [bytes].
_BLOCK = 8_000_000


def time_blocks(runs: int, samples: int) -> Iterator[slice]:
    """Instants of so many runs, some at a time, so that no copy of all runs is needed."""
    count = max(1, _BLOCK // max(1, 8 * runs))
    return (slice(first, first + count) for first in range(0, samples, count))


@dataclass(frozen=True, eq=False, repr=False)
class PolynomialRange(records.ArrayRecord):
    """The range of a polynomial over its box, for every instant; arrays of shape (samples,).

    Attributes
    ----------
    lower : Array
        Certified lower bound in the unit of the output.
    upper : Array
        Certified upper bound in the unit of the output.
    attained_lower : Array
        Smallest value found in the unit of the output, which the polynomial attains to rounding.
    attained_upper : Array
        Largest value found in the unit of the output.
    lowest_at : dict[str, Array]
        Point of the smallest value: values of each parameter [SI units].
    highest_at : dict[str, Array]
        Point of the largest value: values of each parameter [SI units].
    """

    lower: Array
    upper: Array
    attained_lower: Array
    attained_upper: Array
    lowest_at: dict[str, Array]
    highest_at: dict[str, Array]

    def __repr__(self) -> str:
        return f"<PolynomialRange: {len(self.lower)} samples>"


@dataclass(frozen=True, eq=False, repr=False)
class Surrogate(records.ArrayRecord):
    """A Chebyshev polynomial in the parameters for every instant.

    It is fitted to values at the nodes and approximates the response only if the response is smooth in
    the parameters.

    Attributes
    ----------
    intervals : dict[str, Interval]
        Interval of each parameter by name [SI units].
    degrees : tuple[int, ...]
        Degree in each parameter [-].
    terms : Array
        Plain coefficients in the unit of the output, shape (terms, samples); last parameter fastest.
    """

    intervals: dict[str, Interval]
    degrees: tuple[int, ...]
    terms: Array

    @classmethod
    def fit(
        cls, intervals: Mapping[str, Interval], nodes: Sequence[int], degrees: Sequence[int], values: Array
    ) -> Surrogate:
        """Fit values on `chebyshev_grid`, shape (runs, samples), Eq. (27): with one node more than the degree
        it interpolates, with more it is discrete least squares.
        """
        terms: Array | None = None
        for block in time_blocks(*values.shape):
            part = np.ascontiguousarray(values[:, block], dtype=float)
            fitted = _core.chebyshev_fit(part, list(nodes), list(degrees))
            terms = np.empty((len(fitted), values.shape[1])) if terms is None else terms
            terms[:, block] = fitted
        assert terms is not None, "there are samples"
        return cls(dict(intervals), tuple(degrees), terms)

    @property
    def coefficients(self) -> Array:
        """Coefficients in the unit of the output, shape (degree + 1 of each parameter, ..., samples)."""
        return self.terms.reshape(*(degree + 1 for degree in self.degrees), self.terms.shape[1])

    @property
    def rounding(self) -> Array:
        """Bound of its rounding error from the runs, in the unit of the output, shape (samples,)."""
        left: Array = 1e-14 * np.abs(self.terms).sum(axis=0)
        return left

    def bounds(self, kind: BoundKind = "range", threads: int | None = None) -> tuple[Array, Array]:
        """Lower and upper bounds of the polynomial over the box, each of shape (samples,).

        They enclose the polynomial, not the response it was fitted to.

        Parameters
        ----------
        kind : {"range", "eq31"}
            The certified range, see `range`; or Eq. (31), which is wider because it bounds every term of the
            sum separately.
        threads : int, optional
            As of `range`, with its errors [-].
        """
        if kind == "eq31":
            return _core.interval_bounds(self.terms, list(self.degrees))
        found = self.range(threads)
        return found.lower, found.upper

    def range(self, threads: int | None = None) -> PolynomialRange:
        """The certified range of the polynomial over the box, and the points of its ends.

        Branch and bound in the Bernstein basis, rounded outward: the bounds exceed values that the polynomial
        attains by at most 1e-6 of the width, and are wider than those of Eq. (31) by rounding at most. Along
        a ridge of equal values they may exceed them by more, typically 1e-4 to 1e-2 of the width, since the
        search is limited; above degree 20 in two parameters rounding may leave those of Eq. (31). The values
        attained tell.

        Parameters
        ----------
        threads : int, optional
            Threads [-]; all processors if not given. The results do not depend on the number.

        Raises
        ------
        ValueError
            If a degree is above 30 or a coefficient not finite.
        """
        if threads is not None:
            checks = Checks()
            threads = checks.whole("threads", threads, least=1, most=MOST_THREADS)
            checks.finish()
        found = self._ranges(threads)

        def physical(points: Array) -> dict[str, Array]:
            # Clipped, since midpoint and half-width give the ends only to rounding.
            return {
                name: np.select(
                    [column == -1.0, column == 1.0],
                    [side.lower, side.upper],
                    side.midpoint + side.half_width * column,
                )
                for (name, side), column in zip(self.intervals.items(), points.T, strict=True)
            }

        return PolynomialRange(
            found["lower"],
            found["upper"],
            found["attained_lower"],
            found["attained_upper"],
            physical(found["lowest_at"]),
            physical(found["highest_at"]),
        )

    def _ranges(self, threads: int | None) -> _Ranges:
        return _core.polynomial_ranges(self.terms, list(self.degrees), threads)

    def slope(self, parameter: str) -> Surrogate:
        """The derivative with respect to one parameter, as a polynomial, per unit of that
        parameter; ValueError if there is no such parameter.
        """
        slopes = self._slopes(self._axis(parameter)) / self.intervals[parameter].half_width
        return replace(self, terms=slopes)

    def frozen(self, parameter: str) -> Surrogate:
        """The polynomial with one parameter at its nominal value, in which it then has degree 0.

        ValueError if there is no such parameter.
        """
        axis = self._axis(parameter)
        at_nominal = nominal_factors(self.intervals[parameter], self.degrees[axis])
        terms = np.tensordot(at_nominal, self.coefficients, axes=(0, axis))
        degrees = tuple(0 if index == axis else degree for index, degree in enumerate(self.degrees))
        return Surrogate(
            self.intervals, degrees, np.ascontiguousarray(terms.reshape(-1, self.terms.shape[1]))
        )

    def _axis(self, parameter: str) -> int:
        names = list(self.intervals)
        if not isinstance(parameter, str) or parameter not in names:
            raise ArgumentError(f'unknown parameter "{parameter}"{meant_or_known(parameter, names)}')
        return names.index(parameter)

    def evaluate(self, values: Mapping[str, ArrayLike]) -> Array:
        """The polynomial at physical values of all parameters; see `Band.evaluate`."""
        return self._at(self.terms, *self._normalized(values))

    def derivative(
        self, parameter: str, *, normalized: bool = False, at: Mapping[str, ArrayLike] | None = None
    ) -> Array:
        """Derivative with respect to one parameter; see `Band.sensitivity`."""
        axis = self._axis(parameter)
        if at is None:
            at = {name: side.nominal for name, side in self.intervals.items()}
        if not isinstance(normalized, bool):
            raise ArgumentTypeError(f"normalized must be True or False, got {normalized!r}")
        slope = self._at(self._slopes(axis), *self._normalized(at))
        # Eq. (33) is the derivative in the normalized variable; Eq. (32) needs that per physical unit.
        return slope if normalized else slope / self.intervals[parameter].half_width

    def _slopes(self, axis: int) -> Array:
        """Terms of the derivative in the variable that runs from -1 to 1 over an interval."""
        return _core.chebyshev_derivative(self.terms, list(self.degrees), axis)

    def _at(self, terms: Array, points: Array, shape: tuple[int, ...]) -> Array:
        values = _core.chebyshev_evaluate(terms, list(self.degrees), np.ascontiguousarray(points))
        return values.reshape(*shape, terms.shape[1])

    def _normalized(self, values: Mapping[str, ArrayLike]) -> tuple[Array, tuple[int, ...]]:
        """Points of the cube [-1, 1] for physical values, shape (points, parameters), and the shape given."""
        checks = Checks()
        for name in values:
            if name not in self.intervals:
                hint = did_you_mean(name, self.intervals)
                checks.add(name, f"is no parameter{hint}", wrong_type=True)
        sides: list[Array] = []
        for name, side in self.intervals.items():
            if name not in values:
                checks.add(name, "is missing", wrong_type=True)
                continue
            try:
                given = np.asarray(values[name])
            except ValueError:
                # Lists of different lengths.
                given = np.asarray(None)
            if given.dtype.kind not in "iuf":
                checks.add(
                    name, f"must be a number or an array of numbers, got {values[name]!r}", wrong_type=True
                )
                continue
            # A given end may differ by rounding from that computed from midpoint and width, and may lie
            # outside the cube by rounding.
            slack = 4.0 * np.finfo(float).eps * max(abs(side.lower), abs(side.upper))
            if not np.all((given >= side.lower - slack) & (given <= side.upper + slack)):
                checks.add(name, f"must be in [{side.lower!r}, {side.upper!r}], got {values[name]!r}")
            sides.append(np.clip((given - side.midpoint) / side.half_width, -1.0, 1.0))
        checks.finish()
        try:
            together = np.broadcast_arrays(*sides)
        except ValueError:
            told = ", ".join(f"{name} {side.shape}" for name, side in zip(self.intervals, sides, strict=True))
            raise ArgumentError(f"values must have shapes that broadcast together, got {told}") from None
        return np.stack([side.ravel() for side in together], axis=-1), together[0].shape
