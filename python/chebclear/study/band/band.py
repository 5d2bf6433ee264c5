"""The band of an output over time or crank angle: its range over a box, and its reliability."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from ...base import files as records
from ...base.arguments import Checks, as_number
from ...base.rows import Array
from ...base.units import unit
from ...errors import ArgumentError, ArgumentTypeError, warn
from ...report import html
from ...scene.distributions import Distribution
from ...scene.scene import Interval
from ..polynomials.sensitivity import VarianceShares, variance_shares
from ..polynomials.surrogate import Surrogate
from .hybrid import QuantileBand, quantile_bounds
from .margin import Margin, doubt_of, effect_doubt, far_off, slope_doubt
from .sure import Flag, HowSure

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# An output rises or falls with a parameter if one over this part of the interval changes it beyond the error.
_SURE = 4.0


@dataclass(frozen=True, eq=False, repr=False)
class Band(records.ArrayRecord):
    """The range of one output over a box of parameters, for every instant.

    From `Study.band`, `lower` and `upper` were widened by what held-out runs exceed the hull by. In a
    Chebyshev study they bound the fitted polynomial, by its certified range or by the wider Eq. (31), and
    the response only if the polynomial follows it, which `resolved` says. In a scan they are the
    smallest and largest values of the runs, an inner bound: the response may exceed them between the runs.

    Attributes
    ----------
    name : str
        Name of the output.
    t : Array
        Instants [s], shape (samples,); by crank angle those of the first revolution of the nominal run.
    lower : Array
        Lower bound in the unit of the output, shape (samples,).
    upper : Array
        Upper bound in the unit of the output, shape (samples,).
    nominal : Array
        Response at the nominal values of all intervals in the unit of the output, shape (samples,); by crank
        angle its first revolution.
    hull : tuple[Array, Array]
        Smallest and largest value of all runs, the nominal one included, in the unit of the output, each of
        shape (samples,).
    intervals : dict[str, Interval]
        Interval of each parameter by name [SI units].
    parameters : Array
        Parameters of the runs [SI units], shape (runs, parameters); by crank angle a row for each
        revolution.
    runs : Array
        Values of the runs in the unit of the output, shape (runs, samples); by crank angle a row for each
        revolution, those of the nominal run last.
    surrogate : Surrogate | None
        The polynomial behind the bounds; None without one.
    verdict : Flag
        How sure it is, in one of four words: the flag of `sure`.
    resolved : bool
        Whether a polynomial follows the runs that it was not made from, so that its sensitivities and worst
        cases are those of the response as far as so many runs tell.
    margin : Margin
        Method and margin of the band.
    coverage : float
        Share of the samples of a further run that the runs show to be in the band, on average [-]: proved for
        a certified band, else an estimate from runs that were left out, which counts a further run as outside
        for as long as these were, or for all of its time where a polynomial follows all of them; NaN if it
        was not measured.
    tolerated : float
        Share of all mechanisms that are in the band at any one instant, at least, with 95 % confidence, by
        the number of independent runs alone (Wilks 1941) [-]; NaN for runs on a grid and tables of runs at
        points that someone chose.
    whole_run : float
        Estimated probability that a further run at random parameters is entirely in the band, counted on
        held-out runs [-]; NaN if it is unknown. The runs also chose how far the band is widened, so this is
        no bound: where one instant of each run is disturbed at random, 0.949 is stated and 0.947 true on
        average over 40 studies, 0.85 in the worst of them (41 runs, 31 samples).
    angle : Array | None
        Crank angle of the samples [rad], shape (samples,); None for a band over time.
    unit : str
        Unit of the output; empty if it is not known.
    parameter_units : dict[str, str]
        Units of the parameters, as far as they are known.
    written : tuple[str, ...]
        Units that the user wrote, in which plots and reports show it.
    """

    name: str
    t: Array = field(metadata=unit("s"))
    lower: Array
    upper: Array
    nominal: Array
    hull: tuple[Array, Array]
    intervals: dict[str, Interval]
    parameters: Array
    runs: Array
    surrogate: Surrogate | None
    verdict: Flag
    resolved: bool
    margin: Margin
    coverage: float = math.nan
    tolerated: float = math.nan
    whole_run: float = math.nan
    angle: Array | None = field(default=None, metadata=unit("rad"))
    unit: str = ""
    parameter_units: dict[str, str] = field(default_factory=dict)
    written: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<Band of {self.name}: {len(self.t)} samples, largest width {self.max_width:.6g}>"

    def _repr_html_(self) -> str:
        from ...plots.bands import band_picture

        return html.fragment(f"{repr(self)[1:-1]}, {self.verdict}", [band_picture(self)])

    @property
    def sure(self) -> HowSure:
        """How sure the band is; ``str`` says it in a sentence."""
        runs = len(self.runs)
        if self.angle is not None:  # a row for each revolution
            runs = int(np.count_nonzero(np.any(np.diff(self.parameters, axis=0) != 0.0, axis=1)))
        error = self.margin.error if self.resolved else math.nan
        return HowSure(self.verdict, self.whole_run, self.coverage, error, runs)

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

        The shape is (degree + 1 of each parameter, ..., samples); they include the factors 1/2 of Eq. (27).
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
        ValueError, TypeError
            If a value is outside its interval, a parameter unknown or missing, or the band has no polynomial.
        """
        return self._polynomial().evaluate(values)

    def sensitivity(
        self, parameter: str, *, normalized: bool = False, at: Mapping[str, ArrayLike] | None = None
    ) -> Array:
        """Derivative of the fitted polynomial with respect to one parameter, Eqs. (32) and (33).

        If the band is not `resolved`, or the effect of the parameter is below the error of the
        polynomial, it is not the derivative of the response, and a warning says so; another one if slopes
        away from the midpoint are uncertain.

        Eq. (33) is printed without the factor 2 / (upper - lower) of the physical derivative and, away from
        the midpoint, without 1 / sin θ; both are in the result.

        Parameters
        ----------
        parameter : str
            Name of the parameter.
        normalized : bool
            Differentiate with respect to the variable that runs from -1 to 1 over the interval instead, as
            the paper's Table 5 does: the change of the output for half the width of the interval.
        at : mapping of str to float or array_like, optional
            A value for every parameter, as of `evaluate`; the nominal ones if not given.

        Returns
        -------
        ndarray, shape (..., samples)
            In the unit of the output per unit of the parameter; in the unit of the output if normalized.

        Raises
        ------
        ValueError, TypeError
            As `evaluate`.
        """
        slope = self.polynomial_slope(parameter, normalized=normalized, at=at)
        self._doubt("a sensitivity")
        # The certified range would take hundreds of times as long as the slope.
        self._doubt_effect(parameter, *self._polynomial().slope(parameter).bounds("eq31"))
        if at is not None:
            self._doubt_slopes()
        return slope

    def polynomial_slope(
        self, parameter: str, *, normalized: bool = False, at: Mapping[str, ArrayLike] | None = None
    ) -> Array:
        """The derivative of the polynomial, as `sensitivity` returns it, without a warning."""
        return self._polynomial().derivative(parameter, normalized=normalized, at=at)

    def sensitivity_range(self, parameter: str, *, threads: int | None = None) -> tuple[Array, Array]:
        """Certified range of the derivative of the polynomial with respect to one parameter over the box.

        It is not that of the response if the band is not `resolved`, the effect of the parameter is
        below the error of the polynomial, or the degree is high for that error; a warning says so.

        Parameters
        ----------
        parameter : str
            Name of the parameter.
        threads : int, optional
            Threads to work on [-]; all processors if not given.

        Returns
        -------
        tuple of ndarray, shape (samples,)
            Lower and upper bounds in the unit of the output per unit of the parameter.

        Raises
        ------
        ValueError
            If the parameter or the number of threads is wrong, or the band has no polynomial.
        """
        self._doubt_slopes()
        return self._slopes(parameter, threads)

    def monotone(self, parameter: str, *, threads: int | None = None) -> NDArray[np.int8]:
        """Where the output certainly rises or falls with a parameter, for all values of the others.

        The slope of the polynomial has one sign over the whole box, and even the least slope changes the
        output over a quarter of the interval by more than the polynomial was wrong at held-out runs, on
        average over time. Between values that are nearer to each other the response may do the opposite.
        Arguments and errors are those of `sensitivity_range`.

        Returns
        -------
        ndarray of int, shape (samples,)
            1 where it rises, -1 where it falls, 0 where neither is certain or nothing changes.
        """
        lower, upper = self._slopes(parameter, threads)
        # Rounding errors are no slope, however exact the polynomial is.
        change = _SURE * np.maximum(self._error, self._polynomial().rounding)
        least = change / (2.0 * self.intervals[parameter].half_width)
        rises, falls = (lower >= least) & (upper > 0.0), (upper <= -least) & (lower < 0.0)
        return rises.astype(np.int8) - falls.astype(np.int8)

    def interval_share(self, parameter: str, *, threads: int | None = None) -> Array:
        """Relative reduction of the width if a parameter were exactly at its nominal value.

        The shares of all parameters need not add up to one. Arguments and errors are those of
        `sensitivity_range`.

        Returns
        -------
        ndarray, shape (samples,)
            Between 0 and 1 [-]; 0 where nothing changes.
        """
        surrogate = self._polynomial()
        self._doubt("an interval share")
        whole, rest = surrogate.range(threads), surrogate.frozen(parameter).range(threads)
        width = whole.attained_upper - whole.attained_lower
        left = rest.attained_upper - rest.attained_lower
        share: Array = 1.0 - np.divide(left, width, out=np.ones_like(width), where=width > surrogate.rounding)
        return np.clip(share, 0.0, 1.0)

    def variance_shares(self) -> VarianceShares:
        """Shares of the parameters in the variance (Sobol'), **if they were uniformly distributed**.

        An interval implies no distribution; these shares assume independent, uniform ones. `interval_share`
        needs no such assumption. ValueError is raised if the band has no polynomial.
        """
        surrogate = self._polynomial()
        self._doubt("a variance share")
        return variance_shares(surrogate)

    def quantiles(
        self,
        random: Mapping[str, Distribution],
        *,
        probability: float = 0.95,
        draws: int = 4000,
        rng: int | Generator | None = 0,
    ) -> QuantileBand:
        """Quantiles over random parameters, for the worst case of parameters that are only intervals.

        Each draw of the random parameters is inserted into the polynomial, whose range over the others is
        certified; the quantiles are those of these ends, widened by the error of the polynomial.

        Parameters
        ----------
        random : mapping of str to Distribution
            Distributions of some or all parameters, made by `normal`, `lognormal`, `uniform` and
            `triangular`. The interval of the runs must contain three standard deviations to either side of
            the first two, of which what is beyond counts as outside, or the whole range of the others.
        probability : float
            Least probability of the output to be in the band at an instant [-]; half of the rest on either
            side.
        draws : int
            Number of stratified draws [-], at least four in each tail; two standard errors are added.
        rng : int, numpy.random.Generator or None
            Seed of the draws, as of `Study.band`.

        Returns
        -------
        QuantileBand
            Its ``str`` is its statement in words.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong, all problems listed; or the band has no polynomial.
        """
        surrogate = self._polynomial()
        self._doubt("a quantile")
        lower, upper, statement = quantile_bounds(
            surrogate, random, probability=probability, draws=draws, rng=rng
        )
        error = 0.5 * self._error
        return QuantileBand(self.t, lower - error, upper + error, float(probability), statement)

    def worst(self, side: Literal["lower", "upper"], *, threads: int | None = None) -> dict[str, Array]:
        """Parameters at which the output is largest or smallest, for every instant.

        In a Chebyshev study the point where the polynomial attains the end of its range; if the band is
        not `resolved` that is not the worst case of the response, and a warning says so. In a scan, the
        run that attains the bound.

        Parameters
        ----------
        side : {"lower", "upper"}
            Which bound.
        threads : int, optional
            As of `sensitivity_range`.

        Returns
        -------
        dict of str to ndarray, shape (samples,)
            Value of each parameter [SI units].

        Raises
        ------
        ValueError, TypeError
            If the side or the number of threads is wrong, or the band is an envelope.
        """
        checks = Checks()
        checks.word("side", side, ("lower", "upper"))
        if len(self.runs) == 0:
            checks.add(
                "side", f"is not known of an envelope, the band of {self.name}: ask the band it was made from"
            )
        checks.finish()
        if self.surrogate is not None:
            self._doubt("a worst case")
            found = self.surrogate.range(threads)
            return found.lowest_at if side == "lower" else found.highest_at
        extreme = np.argmin(self.runs, axis=0) if side == "lower" else np.argmax(self.runs, axis=0)
        return dict(zip(self.intervals, self.parameters[extreme].T, strict=True))

    def envelope(self, window: float) -> Band:
        """Running envelope in time: the extremes of the bounds within a window around each instant.

        Parameters
        ----------
        window : float
            Length of the centered window [s], at least two samples; it is truncated at both ends of the band.

        Returns
        -------
        Band
            Without runs and polynomial.

        Raises
        ------
        ValueError, TypeError
            If the window is not a number or too short.
        """
        half = half_window(self.t, window)
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
        """Draw the band on `ax`, or in a new figure; `plot_band` has the options."""
        from ...plots.bands import plot_band

        return plot_band(self, ax=ax, **options)

    def _slopes(self, parameter: str, threads: int | None) -> tuple[Array, Array]:
        surrogate = self._polynomial()
        self._doubt("a range of a sensitivity")
        lower, upper = surrogate.slope(parameter).bounds(threads=threads)
        self._doubt_effect(parameter, lower, upper)
        return lower, upper

    def _doubt(self, what: str) -> None:
        """Warn where the polynomial is not the response."""
        off = self._off if self.resolved else None
        if doubt := doubt_of(self.name, what, self.t, off):
            warn(doubt)

    @cached_property
    def _off(self) -> Array:
        if self.angle is not None:
            return np.zeros(len(self.t))  # revolutions scatter about the mean, which it follows
        return far_off(self._polynomial(), self.parameters, self.runs, self.hull)

    @property
    def _error(self) -> Array:
        """How far the polynomial may be wrong in the change of the output from one point to another."""
        error = 2.0 * self.margin.error * float(np.mean(self.hull[1] - self.hull[0]))
        # That of an exact polynomial is no error.
        return np.where(error > self._polynomial().rounding, error, 0.0)

    def _doubt_effect(self, parameter: str, lower: Array, upper: Array) -> None:
        """Warn if the largest slopes change the output over the interval by less than its error."""
        change = np.maximum(-lower, upper) * (2.0 * self.intervals[parameter].half_width)
        if self.resolved and float(np.mean(change)) < float(np.mean(self._error)):
            warn(effect_doubt(self.name, parameter))

    def _doubt_slopes(self) -> None:
        """Warn if slopes away from the middle of the box are uncertain."""
        if self.resolved and (doubt := slope_doubt(self.name, self.margin)):
            warn(doubt)

    def _polynomial(self) -> Surrogate:
        if self.surrogate is None:
            raise ArgumentError(
                f"the band of {self.name} ({self.verdict}) has no polynomial, and so neither worst case nor "
                "sensitivity: use features of the runs, such as peak or rms, and their ranking"
            )
        return self.surrogate


def running_maximum(values: Array, half: int) -> Array:
    """Largest value within `half` samples to both sides; windows are truncated at the ends."""
    # Maxima over spans of 1, 2, 4, ... samples; two overlapping ones of the longest span cover the window.
    size, width, span = len(values), 2 * half + 1, 1
    reach = np.pad(values, half, constant_values=-np.inf)
    while 2 * span <= width:
        reach = np.maximum(reach[:-span], reach[span:])
        span *= 2
    return np.maximum(reach[:size], reach[width - span : width - span + size])


def half_window(t: Array, window: float) -> int:
    """Number of samples to either side in a window of a given length [s], at most all."""
    number = as_number(window)
    spacing = float(t[-1] - t[0]) / (len(t) - 1)
    # A tolerance, so that rounding does not remove one of an exact number of samples.
    known = number if number is not None and math.isfinite(number) else 0.0
    half = int(min(0.5 * known / spacing + 1e-6, len(t)))
    if half < 1:
        kind = ArgumentTypeError if number is None else ArgumentError
        raise kind(f"window must be a finite number >= {2.0 * spacing:.6g} [s], two samples, got {window!r}")
    return min(half, len(t) - 1)
