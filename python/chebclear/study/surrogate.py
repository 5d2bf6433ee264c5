"""Polynomials in the uncertain parameters, and the bands of outputs over time.

Nothing here knows of mechanisms: a surrogate is made from values on a grid, whatever gave them. Parameters
are keywords with physical values; arrays have time on their last axis.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..base import files as records
from ..base.arguments import Checks, as_number, did_you_mean
from ..base.units import unit
from ..scene.scene import Interval

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


def chebyshev_grid(intervals: Sequence[Interval], nodes: Sequence[int]) -> Array:
    """Tensor grid of Chebyshev roots on a box, Eq. (26).

    Parameters
    ----------
    intervals : sequence of Interval
        Sides of the box.
    nodes : sequence of int
        Number of roots on each side [-].

    Returns
    -------
    ndarray, shape (runs, parameters)
        Physical values; the first parameter changes slowest.
    """
    return tensor_grid(
        [
            side.midpoint + side.half_width * _core.chebyshev_nodes(count)
            for side, count in zip(intervals, nodes, strict=True)
        ]
    )


def tensor_grid(sides: Sequence[Array]) -> Array:
    """All combinations of the values of every side, shape (runs, sides); the first side changes slowest."""
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, len(sides))


@dataclass(frozen=True, eq=False, repr=False)
class Surrogate(records.ArrayRecord):
    """A Chebyshev polynomial in the parameters for every instant.

    It is fitted to values at the nodes and stands for the response only as far as the response is smooth in
    the parameters.
    """

    intervals: dict[str, Interval]
    """Interval of each parameter by name [SI units]."""
    degrees: tuple[int, ...]
    """Degree in each parameter [-]."""
    terms: Array
    """Plain coefficients in the unit of the output, shape (terms, samples); last parameter fastest."""

    @classmethod
    def fit(
        cls, intervals: Mapping[str, Interval], nodes: Sequence[int], degrees: Sequence[int], values: Array
    ) -> Surrogate:
        """Fit values on a grid of Chebyshev roots, Eq. (27).

        With one node more than the degree this interpolates, with more it is discrete least squares.

        Parameters
        ----------
        intervals : mapping of str to Interval
            Interval of each parameter [SI units].
        nodes, degrees : sequence of int
            Number of nodes and degree in each parameter [-].
        values : ndarray, shape (runs, samples)
            Values on `chebyshev_grid`.

        Returns
        -------
        Surrogate
        """
        terms = _core.chebyshev_fit(np.ascontiguousarray(values, dtype=float), list(nodes), list(degrees))
        return cls(dict(intervals), tuple(degrees), terms)

    @property
    def coefficients(self) -> Array:
        """Coefficients in the unit of the output, shape (degree + 1 of each parameter, ..., samples)."""
        return self.terms.reshape(*(degree + 1 for degree in self.degrees), self.terms.shape[1])

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the polynomial over the box, Eq. (31), each of shape (samples,).

        They enclose the polynomial, not the response it was fitted to, and with some slack: every term of the
        sum is bounded on its own.
        """
        return _core.interval_bounds(self.terms, list(self.degrees))

    def evaluate(self, values: Mapping[str, ArrayLike]) -> Array:
        """The polynomial at physical values of all parameters; see `Band.evaluate`."""
        return self._at(self.terms, *self._normalised(values))

    def derivative(
        self, parameter: str, *, normalised: bool = False, at: Mapping[str, ArrayLike] | None = None
    ) -> Array:
        """Derivative with respect to one parameter; see `Band.sensitivity`."""
        names = list(self.intervals)
        if parameter not in names:
            raise ValueError(f'unknown parameter "{parameter}"{did_you_mean(parameter, names)}')
        if at is None:
            at = {name: side.midpoint for name, side in self.intervals.items()}
        points, shape = self._normalised(at)
        slopes = _core.chebyshev_derivative(self.terms, list(self.degrees), names.index(parameter))
        slope = self._at(slopes, points, shape)
        # Eq. (33) is the slope in the normalised variable; Eq. (32) needs it per physical unit.
        return slope if normalised else slope / self.intervals[parameter].half_width

    def _at(self, terms: Array, points: Array, shape: tuple[int, ...]) -> Array:
        values = _core.chebyshev_evaluate(terms, list(self.degrees), np.ascontiguousarray(points))
        return values.reshape(*shape, terms.shape[1])

    def _normalised(self, values: Mapping[str, ArrayLike]) -> tuple[Array, tuple[int, ...]]:
        """Points of the cube [-1, 1] for physical values, shape (points, parameters), and the shape given."""
        checks = Checks()
        for name in values:
            if name not in self.intervals:
                hint = did_you_mean(name, self.intervals)
                checks.add(f'unknown parameter "{name}"{hint}', wrong_type=True)
        sides: list[Array] = []
        for name, side in self.intervals.items():
            if name not in values:
                checks.add(f'parameter "{name}" is missing', wrong_type=True)
                continue
            given = np.asarray(values[name])
            if given.dtype.kind not in "iuf":
                checks.add(
                    f"{name} must be a number or an array of numbers, got {values[name]!r}", wrong_type=True
                )
                continue
            # An end as it is typed may miss the end that was computed from midpoint and width by rounding,
            # which may also carry it past the end of the cube.
            slack = 4.0 * np.finfo(float).eps * max(abs(side.lower), abs(side.upper))
            if not np.all((given >= side.lower - slack) & (given <= side.upper + slack)):
                checks.add(f"{name} must be in [{side.lower!r}, {side.upper!r}], got {values[name]!r}")
            sides.append(np.clip((given - side.midpoint) / side.half_width, -1.0, 1.0))
        checks.finish()
        together = np.broadcast_arrays(*sides)
        return np.stack([side.ravel() for side in together], axis=-1), together[0].shape


@dataclass(frozen=True, eq=False, repr=False)
class Band(records.ArrayRecord):
    """The range of one output over a box of parameters, for every instant.

    In a Chebyshev study `lower` and `upper` are the bounds of Eq. (31): they enclose the fitted polynomial,
    with slack, and hence the response only as far as the polynomial follows it. In a scan they are the
    smallest and largest of the runs, which is an inner bound: the response may reach further between them.
    """

    name: str
    """Name of the output."""
    t: Array = field(metadata=unit("s"))
    """Instants [s], shape (samples,)."""
    lower: Array
    """Lower bound in the unit of the output, shape (samples,)."""
    upper: Array
    """Upper bound in the unit of the output, shape (samples,)."""
    nominal: Array
    """Response at the midpoint of all intervals in the unit of the output, shape (samples,)."""
    sampled_lower: Array
    """Smallest value of all runs, the nominal one included, in the unit of the output, shape (samples,)."""
    sampled_upper: Array
    """Largest value of all runs, the nominal one included, in the unit of the output, shape (samples,)."""
    intervals: dict[str, Interval]
    """Interval of each parameter by name [SI units]."""
    parameters: Array
    """Parameters of the runs [SI units], shape (runs, parameters)."""
    runs: Array
    """Values of the runs in the unit of the output, shape (runs, samples)."""
    surrogate: Surrogate | None
    """The polynomial behind the bounds; None for a scan."""

    def __repr__(self) -> str:
        return f"<Band of {self.name}: {len(self.t)} samples, largest width {self.max_width:.6g}>"

    @property
    def width(self) -> Array:
        """Upper minus lower bound in the unit of the output, shape (samples,)."""
        return self.upper - self.lower

    @property
    def max_width(self) -> float:
        """Largest width over time in the unit of the output."""
        return float(np.max(self.width))

    @property
    def coefficients(self) -> Array:
        """Chebyshev coefficients in the unit of the output.

        The shape is (degree + 1 of each parameter, ..., samples); the factors 1/2 of Eq. (27) are in them.
        """
        return self._polynomial().coefficients

    def evaluate(self, **values: ArrayLike) -> Array:
        """The fitted polynomial at physical values of the parameters.

        Parameters
        ----------
        **values : float or array_like
            A value for every parameter [SI units], inside its interval. Arrays broadcast.

        Returns
        -------
        ndarray, shape (..., samples)
            In the unit of the output.

        Raises
        ------
        ValueError
            If a value is outside its interval, or the band has no polynomial.
        TypeError
            If a parameter is unknown or missing.
        """
        return self._polynomial().evaluate(values)

    def sensitivity(
        self, parameter: str, *, normalised: bool = False, at: Mapping[str, ArrayLike] | None = None
    ) -> Array:
        """Derivative of the fitted polynomial with respect to one parameter, Eqs. (32) and (33).

        Eq. (33) is printed without the factor 2 / (upper - lower) of the physical derivative and, away from
        the midpoint, without 1 / sin θ; both are in the result.

        Parameters
        ----------
        parameter : str
            Name of the parameter.
        normalised : bool
            Differentiate with respect to the variable that runs from -1 to 1 over the interval instead, as
            the paper's Table 5 does: the change of the output for half the width of the interval.
        at : mapping of str to float or array_like, optional
            A value for every parameter [SI units]; the midpoints if not given. Arrays broadcast.

        Returns
        -------
        ndarray, shape (..., samples)
            In the unit of the output per SI unit of the parameter; in the unit of the output if normalised.

        Raises
        ------
        ValueError
            If the parameter is unknown, a value is outside its interval, or the band has no polynomial.
        TypeError
            If `at` names an unknown or misses a parameter.
        """
        return self._polynomial().derivative(parameter, normalised=normalised, at=at)

    def worst(self, side: Literal["lower", "upper"]) -> dict[str, Array]:
        """Parameters at which the output is largest or smallest, for every instant.

        Sampled, not optimised: in a scan the run that attains the bound; in a Chebyshev study the node or
        corner of the box where the polynomial is extreme. The bounds of Eq. (31) have slack, so no parameters
        need attain them.

        Parameters
        ----------
        side : {"lower", "upper"}
            Which bound.

        Returns
        -------
        dict of str to ndarray, shape (samples,)
            Value of each parameter [SI units].

        Raises
        ------
        ValueError, TypeError
            If the side is unknown, or the band is an envelope.
        """
        checks = Checks()
        checks.word("side", side, ("lower", "upper"))
        if len(self.runs) == 0:
            checks.add(f"the band of {self.name} is an envelope: ask the band it was made from")
        checks.finish()
        points, values = self.parameters, self.runs
        if self.surrogate is not None:
            sides = self.intervals.values()
            corners = np.array(list(itertools.product(*((side.lower, side.upper) for side in sides))))
            points = np.concatenate([points, corners])
            values = self.surrogate.evaluate(dict(zip(self.intervals, points.T, strict=True)))
        extreme = np.argmin(values, axis=0) if side == "lower" else np.argmax(values, axis=0)
        return dict(zip(self.intervals, points[extreme].T, strict=True))

    def envelope(self, window: float) -> Band:
        """Running envelope in time: what the bounds reach within a window around each instant.

        Parameters
        ----------
        window : float
            Length of the window [s], at least two samples; centred, and cut off at both ends of the band.

        Returns
        -------
        Band
            With the running largest of the upper and smallest of the lower bounds. It has neither runs nor a
            polynomial.

        Raises
        ------
        ValueError, TypeError
            If the window is no number or too short.
        """
        number = as_number(window)
        spacing = float(self.t[-1] - self.t[0]) / (len(self.t) - 1)
        # An exact number of samples must not lose one to rounding.
        half = 0 if number is None or not math.isfinite(number) else int(0.5 * number / spacing + 1e-6)
        if half < 1:
            kind = TypeError if number is None else ValueError
            raise kind(
                f"window must be a finite number >= {2.0 * spacing:.6g} [s], two samples, got {window!r}"
            )
        half = min(half, len(self.t) - 1)
        return replace(
            self,
            lower=-running_maximum(-self.lower, half),
            upper=running_maximum(self.upper, half),
            sampled_lower=-running_maximum(-self.sampled_lower, half),
            sampled_upper=running_maximum(self.sampled_upper, half),
            parameters=self.parameters[:0],
            runs=self.runs[:0],
            surrogate=None,
        )

    def plot(self, *, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw the band; see `plot_band` for the options.

        Parameters
        ----------
        ax : Axes, optional
            Where to draw; a new figure if not given.
        **options
            Passed to `plot_band`.

        Returns
        -------
        Axes
        """
        from ..plots import results as plot

        return plot.plot_band(self, ax=ax, **options)

    def _polynomial(self) -> Surrogate:
        if self.surrogate is None:
            raise ValueError(f"the band of {self.name} has no polynomial: it is a scan or an envelope")
        return self.surrogate


def running_maximum(values: Array, half: int) -> Array:
    """Largest value within `half` samples to both sides; windows are cut short at the ends."""
    # Maxima over spans of 1, 2, 4, ... samples; two overlapping ones of the longest span cover the window.
    size, width, span = len(values), 2 * half + 1, 1
    reach = np.pad(values, half, constant_values=-np.inf)
    while 2 * span <= width:
        reach = np.maximum(reach[:-span], reach[span:])
        span *= 2
    return np.maximum(reach[:size], reach[width - span : width - span + size])
