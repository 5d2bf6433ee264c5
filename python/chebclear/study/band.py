"""The band of an output over time: how far it reaches over a box of parameters, and how sure that is."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base import files as records
from ..base.arguments import Checks, as_number
from ..base.units import unit
from ..scene.scene import Interval
from .surrogate import Surrogate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Verdict = Literal["resolved", "not resolved", "calibrated", "undersampled", "sampled"]

# Largest error of a polynomial that is trusted, over the width of the hull of the runs.
RESOLVED = 0.05


@dataclass(frozen=True)
class Margin:
    """What a band was made from, and how far it goes beyond its runs."""

    method: Literal["polynomial", "envelope", "trend", "runs"]
    """The range of a polynomial in the parameters; running extremes of the runs in time; the range of a
    polynomial with the running extremes of what it leaves; or the extremes of the runs alone."""
    degree: int | None = None
    """Degree of the polynomial [-], the largest of all parameters; None without one."""
    error: float = math.nan
    """Largest error of the polynomial at runs it was not fitted to, over the width of the hull, both averaged
    over time [-]; NaN without such a run."""
    window: float = field(default=0.0, metadata=unit("s"))
    """How far the running extremes reach to either side [s]."""
    inflation: float = 0.0
    """By how many local spreads of the runs the band was then widened to either side [-]."""


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
    hull: tuple[Array, Array]
    """Smallest and largest value of all runs, the nominal one included, in the unit of the output, each of
    shape (samples,)."""
    intervals: dict[str, Interval]
    """Interval of each parameter by name [SI units]."""
    parameters: Array
    """Parameters of the runs [SI units], shape (runs, parameters)."""
    runs: Array
    """Values of the runs in the unit of the output, shape (runs, samples)."""
    surrogate: Surrogate | None
    """The polynomial behind the bounds; None without one."""
    verdict: Verdict
    """``"resolved"``: a polynomial follows the response, so that its sensitivities and worst cases are those
    of the response. ``"not resolved"``: it does not, or nothing tells. ``"calibrated"``: the band is bounded
    as a whole, with the coverage below, but no derivative in the parameters exists at this number of runs.
    ``"undersampled"``: the coverage asked for was not reached. ``"sampled"``: the extremes of the runs, an
    inner bound."""
    margin: Margin
    """What the band was made from."""
    coverage: float = math.nan
    """Share of the samples of a run that is in the band made without it, mean over the runs [-]; NaN where it
    was not measured."""
    whole_run: float = math.nan
    """Probability that a further run at random parameters is in the band throughout [-]; NaN where nothing
    may be promised."""

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
            hull=(-running_maximum(-self.hull[0], half), running_maximum(self.hull[1], half)),
            parameters=self.parameters[:0],
            runs=self.runs[:0],
            surrogate=None,
            coverage=math.nan,
            whole_run=math.nan,
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
