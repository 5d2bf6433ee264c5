"""Plots of studies: bands with their verdicts and polynomials, sensitivities, lost motion."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.arguments import Checks
from ..base.prefixes import format_range
from ..base.shown import of_many
from ..base.tables import format_number
from ..errors import ArgumentError
from ..report.document import Picture
from ..scene.columns import plain_words
from .axes import (
    COLORS,
    MARKERS,
    MOST_VECTORS,
    abscissa_of,
    line_style,
    new_axes,
    plot_of,
    require,
    shown_scale,
)
from .labels import (
    legend_above_the_data,
    plain_numbers,
    set_labels,
    set_x_label,
    set_y_label,
    typeset,
    with_unit,
    words_of,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..decisions.lost_motion import LostMotion
    from ..decisions.measured import Agreement
    from ..study.band.band import Band
    from ..study.band.zones import RestraintZones

Array = NDArray[np.float64]

BOUNDS, NOMINAL, RUNS, ZONE = "#4477AA", "#AA3377", "0.55", "#228833"

# Filling of the area of a band by how sure it is: plain where it is proved, coarser hatches for less.
_HATCHES = {"proved": None, "estimated": "....", "too few runs": "xx", "unknown": "///"}
THIN = 0.1
"""Width of a band relative to the range of the motion below which it is shown as a deviation [-]."""


def band_picture(band: Band) -> Picture:
    """A band for reports and notebooks; as a deviation where it would look like a line."""
    deviation = bool(band.max_width < THIN * np.ptp(band.nominal))
    reach = format_range((float(band.lower.min()), float(band.upper.max())), band.unit)
    return Picture(
        f"Band of {band.name} against time with the nominal run, {reach}, {band.verdict}.",
        lambda ax: plot_band(band, ax=ax, deviation=deviation),
        name=f"band_{band.name}",
    )


@plot_of("Band")
def plot_band(
    band: Band,
    *,
    ax: Axes | None = None,
    unit: str | None = None,
    x: Array | None = None,
    x_label: str | None = None,
    scan: Band | None = None,
    nominal: bool = True,
    runs: int = 0,
    deviation: bool = False,
    **fill: Any,
) -> Axes:
    """Draw a band: its area, its two bounds, and the nominal response.

    The legend says how sure it is, and the area is filled accordingly: plain where the band is proved or a
    polynomial predicts further runs, dotted where it is estimated, crossed where there are too few runs, and
    hatched where nothing is known of further runs.

    Parameters
    ----------
    band : Band
        The band of one output.
    scan : Band, optional
        Band of the same output to compare with, drawn as dashed lines. A scan is an inner bound.
    nominal : bool
        Draw the response at the nominal values of the parameters.
    runs : int
        How many of the simulated runs to draw, evenly chosen [-].
    deviation : bool
        Draw differences from the nominal response, which is drawn with an axis of its own at the right: for
        bands that are thin against the motion.

    Examples
    --------
    >>> import chebclear as cc
    >>> side = {"rod_length": cc.Interval.around(0.12, rel=0.01)}
    >>> study = cc.Study(cc.mechanisms.slider_crank, side, outputs=["slider.x"], duration=0.01, samples=21)
    >>> ax = cc.plots.plot_band(study.band(runs=12)["slider.x"])
    """
    if scan is not None:
        require("scan", scan, "Band")
    checks = Checks()
    runs = checks.whole("runs", runs, least=0)
    checks.finish()
    scale, shown = shown_scale(ax, band.unit, unit, band.written, (band.lower, band.upper))
    zero = band.nominal if deviation else np.zeros(len(band.t))
    abscissa, own_label = _own_abscissa(band) if x is None else (abscissa_of(x, len(band.t)), "")
    ax = new_axes(ax)
    color = fill.pop("color", fill.pop("facecolor", BOUNDS))
    style = {
        "alpha": 0.25,
        "linewidth": 0.0,
        "edgecolor": color,
        "hatch": None if band.resolved else _HATCHES[band.verdict],
        "rasterized": len(band.t) > MOST_VECTORS,
        "label": verdict_words(band),
    } | fill
    if runs > 0 and len(band.runs):
        rows = "runs" if band.angle is None else "revolutions"
        chosen = np.unique(np.linspace(0, len(band.runs) - 1, min(runs, len(band.runs))).round().astype(int))
        for place, index in enumerate(chosen):
            label = f"{len(chosen)} of {len(band.runs)} {rows}" if place == 0 else None
            ax.plot(
                abscissa,
                scale * (band.runs[index] - zero),
                color=RUNS,
                linewidth=0.3,
                rasterized=True,
                label=label,
            )
    lower, upper = scale * (band.lower - zero), scale * (band.upper - zero)
    ax.fill_between(abscissa, lower, upper, facecolor=color, **style)
    for bound in (lower, upper):
        ax.plot(abscissa, bound, color=color, linewidth=0.8)
    if scan is not None:
        for bound, label in ((scan.lower, "scan"), (scan.upper, None)):
            line = scale * (bound - zero)
            ax.plot(abscissa, line, color="black", linewidth=0.8, linestyle=(0, (4, 2)), label=label)
    words = words_of(band.name, band.unit)
    if nominal and not deviation:
        ax.plot(abscissa, scale * band.nominal, color=NOMINAL, linewidth=0.7, label="nominal")
    below = own_label if x_label is None else x_label
    set_labels(ax, below, with_unit(f"deviation of {words}" if deviation else words, shown))
    legend_above_the_data(ax)
    if nominal and deviation:
        beside = ax.twinx()
        beside.plot(abscissa, scale * band.nominal, color=NOMINAL, linewidth=0.7)
        beside.set_ylabel(typeset(with_unit(words, shown)), color=NOMINAL)
        beside.grid(False)
    return ax


@plot_of("Agreement")
def plot_agreement(
    agreement: Agreement, *, ax: Axes | None = None, unit: str | None = None, **line: Any
) -> Axes:
    """Draw a measured trace over the band of its output; by crank angle all turns over each other.

    Parameters
    ----------
    agreement : Agreement
        What ``measured.compare`` returned.

    Examples
    --------
    >>> import chebclear as cc
    >>> import numpy as np
    >>> t = np.linspace(0.0, 1.0, 101)
    >>> study = cc.Study(lambda a: {"t": t, "x": a * t}, {"a": cc.Interval(1.0, 2.0)})
    >>> trace = cc.results.Measured({"x": 1.5 * t + 0.2}, t=t)
    >>> ax = cc.plots.plot_agreement(trace.compare(study.scan(3)["x"]))
    """
    band = agreement.band
    ax = plot_band(band, ax=ax, unit=unit, nominal=False)
    scale = shown_scale(ax, band.unit, None)[0]
    places, values, outside = agreement.places, scale * agreement.values, agreement.excess > 0.0
    if band.angle is not None:
        turn = np.floor((places - band.angle.min()) / (2.0 * math.pi))
        places = np.degrees(places - 2.0 * math.pi * turn)
        # A gap in the line where a turn ends.
        ends = np.flatnonzero(np.diff(turn)) + 1
        places, values = (np.insert(column, ends, math.nan) for column in (places, values))
        outside = np.insert(outside, ends, False)
    style = line_style(line, color="black", linewidth=0.8, label="measured")
    ax.plot(places, values, **style)
    if np.any(outside):
        ax.plot(places[outside], values[outside], ".", color=COLORS[1], markersize=4.0, label="outside")
    legend_above_the_data(ax)
    return ax


@plot_of("LostMotion")
def plot_lost_motion(
    motion: LostMotion, *, ax: Axes | None = None, unit: str | None = None, **areas: Any
) -> Axes:
    """Draw the lost motion of an output over the angle of the drive, one joint above the other.

    Parameters
    ----------
    motion : LostMotion
        What ``lost_motion`` returned.

    Examples
    --------
    >>> import chebclear as cc
    >>> scene = cc.mechanisms.slider_crank(clearance_at=("crank_pin", "wrist"))
    >>> ax = cc.plots.plot_lost_motion(cc.lost_motion(scene, "slider", (1.0, 0.0)), unit="µm")
    """
    scale, shown = shown_scale(ax, motion.unit, unit)
    ax = new_axes(ax)
    shares = [share * scale for share in motion.shares.values()]
    names = [typeset(plain_words(name)) for name in motion.shares]
    look: dict[str, Any] = {"labels": names, "colors": COLORS, "alpha": 0.8}
    ax.stackplot(np.degrees(motion.angle), shares, **(look | areas))
    set_x_label(ax, "angle of the drive [°]")
    set_y_label(ax, with_unit(f"lost motion of {plain_words(motion.at)}", shown))
    ax.legend()
    return ax


def _slope_unit(band: Band, parameter: str, given: str | None, *, normalized: bool) -> str:
    """The unit of a sensitivity, in words where that of the parameter is not known."""
    per = band.parameter_units.get(parameter, "") if given is None else given
    if normalized:
        per = "half interval"
    elif per in ("", "-"):
        per = "unit of the parameter"
    return f"{band.unit} per {per}".lstrip()


def _own_abscissa(band: Band) -> tuple[Array, str]:
    """What a band is drawn over, and its label."""
    if band.angle is None:
        return band.t, "time [s]"
    return np.degrees(band.angle), "crank angle [°]"


def verdict_words(band: Band) -> str:
    """What the bounds of a band are, for a legend."""
    if band.verdict == "unknown":
        return "extremes of the runs" if band.surrogate is None else "bounds of a polynomial that misses runs"
    share = "" if math.isnan(band.coverage) else f": {of_many(band.coverage)} inside at an instant"
    return f"bounds, {band.verdict}{share}"


@plot_of("Band")
def plot_sensitivity(
    band: Band,
    parameter: str,
    *,
    ax: Axes | None = None,
    normalized: bool = False,
    parameter_unit: str | None = None,
    ideal: Band | None = None,
    zones: RestraintZones | None = None,
    x: Array | None = None,
    x_label: str | None = None,
    **line: Any,
) -> Axes:
    """Draw the sensitivity of an output to one parameter at the nominal values.

    Several on the same axes get a legend that names them.

    Parameters
    ----------
    band : Band
        The band of one output, from a Chebyshev study.
    parameter : str
        Name of the parameter.
    normalized : bool
        Derivative with respect to the normalized variable in [-1, 1] instead of the physical parameter.
    parameter_unit : str, optional
        Unit of the parameter, such as ``"m"``, for the label; that of the study, if it has one, if not given.
    ideal : Band, optional
        The same output of the mechanism without clearance, drawn dashed.
    zones : RestraintZones, optional
        Result of `restraint_zones`: spans in which clearance hardly affects the sensitivity are shaded.

    Examples
    --------
    >>> import chebclear as cc
    >>> side = {"rod_length": cc.Interval.around(0.12, rel=0.01)}
    >>> study = cc.Study(cc.mechanisms.slider_crank, side, outputs=["slider.x"], duration=0.01, samples=21)
    >>> ax = cc.plots.plot_sensitivity(study.chebyshev(degree=2)["slider.x"], "rod_length")
    """
    if ideal is not None:
        require("ideal", ideal, "Band")
    if zones is not None:
        require("zones", zones, "RestraintZones")
    slope = band.sensitivity(parameter, normalized=normalized)
    reference = None if ideal is None else ideal.sensitivity(parameter, normalized=normalized)
    ax = new_axes(ax)
    what = _slope_unit(band, parameter, parameter_unit, normalized=normalized)
    output = words_of(band.name, band.unit)
    style = line_style(line, linewidth=0.9, label=f"{output} to {plain_words(parameter)} [{what}]")
    abscissa, own_label = _own_abscissa(band) if x is None else (abscissa_of(x, len(band.t)), "")
    ax.plot(abscissa, slope, **style)
    if reference is not None:
        ax.plot(
            abscissa,
            reference,
            color="black",
            linewidth=0.8,
            linestyle=(0, (4, 3)),
            label="without clearance",
        )
    for number, (start, end) in enumerate(zones.spans if zones is not None else ()):
        ends = np.interp((start, end), band.t, abscissa)
        label = "restraint zone: clearance disturbs it least" if number == 0 else None
        ax.axvspan(ends[0], ends[1], color=ZONE, alpha=0.15, linewidth=0.0, zorder=0, label=label)
    label, shown = _slope_labels(ax, output, what)
    set_labels(ax, own_label if x_label is None else x_label, label)
    if len(ax.get_legend_handles_labels()[1]) > 1:
        legend_above_the_data(ax, shown=shown)
    return ax


def _slope_labels(ax: Axes, output: str, unit: str) -> tuple[str, dict[str, str]]:
    """The label of the ordinate for all sensitivities on the axes, and what the legend then adds for each."""
    start, end = f"{output} to ", f" [{unit}]"
    # Those that were drawn have their unit behind their names, unless the user named them.
    drawn = [text for text in ax.get_legend_handles_labels()[1] if text.endswith("]")]
    one_output = all(text.startswith(start) for text in drawn)
    one_unit = all(text.endswith(end) for text in drawn)
    if len(drawn) == 1 and one_output and one_unit:
        return f"sensitivity of {drawn[0]}", {drawn[0]: drawn[0].removesuffix(end)}
    shown = {}
    for text in drawn:
        short = f"to {text.removeprefix(start)}" if one_output else text
        shown[text] = short.removesuffix(end) if one_unit else short
    what = f"sensitivity of {output}" if one_output else "sensitivity"
    return f"{what} [{unit if one_unit else 'see legend'}]", shown


@plot_of("Band")
def plot_coefficients(band: Band, *, ax: Axes | None = None, **line: Any) -> Axes:
    """Draw how the coefficients of the polynomial of a band decay with the degree, one line a parameter.

    If the response is smooth they fall by a factor from degree to degree, and the last ones have the size of
    the error of the polynomial. If they do not fall, no affordable degree resolves the response.

    Parameters
    ----------
    band : Band
        A band with a polynomial, from `Study.chebyshev`, say.

    Raises
    ------
    ValueError
        If the band has no polynomial.

    Examples
    --------
    >>> import chebclear as cc
    >>> side = {"rod_length": cc.Interval.around(0.12, rel=0.01)}
    >>> study = cc.Study(cc.mechanisms.slider_crank, side, outputs=["slider.x"], duration=0.01, samples=21)
    >>> ax = cc.plots.plot_coefficients(study.chebyshev(degree=3)["slider.x"])
    """
    sizes = np.abs(band.coefficients).max(axis=-1)
    ax = new_axes(ax)
    for axis, name in enumerate(band.intervals):
        others = tuple(other for other in range(sizes.ndim) if other != axis)
        largest = sizes.max(axis=others)
        style = line_style(
            line, marker=MARKERS[axis % len(MARKERS)], markersize=5.0, linewidth=0.9, label=plain_words(name)
        )
        # A coefficient that is exactly zero has no place on a logarithmic axis.
        ax.plot(np.arange(len(largest)), np.where(largest > 0.0, largest, np.nan), **style)
    ax.set_yscale("log")
    plain_numbers(ax.yaxis)
    ax.set_xticks(range(max(sizes.shape)))
    what = f"largest coefficient of {words_of(band.name, band.unit)} over time"
    set_labels(ax, "degree in the parameter [-]", with_unit(what, band.unit))
    legend_above_the_data(ax)
    return ax


@plot_of("Band")
def plot_prediction(
    band: Band,
    holdout: Band,
    *,
    ax: Axes | None = None,
    unit: str | None = None,
    **points: Any,
) -> Axes:
    """Draw what the polynomial of a band predicts for runs that it was not fitted to, against those runs.

    Points on the diagonal are predicted exactly. The legend has the largest error over the range of the runs.

    Parameters
    ----------
    band : Band
        A band with a polynomial.
    holdout : Band
        The same output in other runs of the same parameters, of `Study.scan` or `Study.band`, say.

    Raises
    ------
    ValueError
        If the band has no polynomial, or the runs are of another output, instants or parameters.

    Examples
    --------
    >>> import chebclear as cc
    >>> side = {"rod_length": cc.Interval.around(0.12, rel=0.01)}
    >>> study = cc.Study(cc.mechanisms.slider_crank, side, outputs=["slider.x"], duration=0.01, samples=21)
    >>> ax = cc.plots.plot_prediction(study.chebyshev(degree=2)["slider.x"], study.scan(5)["slider.x"])
    """
    require("holdout", holdout, "Band")
    if (
        holdout.name != band.name
        or holdout.t.shape != band.t.shape
        or list(holdout.intervals) != list(band.intervals)
    ):
        raise ArgumentError(
            f"holdout must have runs of {band.name} at the same instants and over the same parameters"
        )
    scale, shown = shown_scale(ax, band.unit, unit, band.written, holdout.runs)
    given = dict(zip(band.intervals, holdout.parameters.T, strict=True))
    predicted, simulated = scale * band.evaluate(**given).ravel(), scale * holdout.runs.ravel()
    error, reach = float(np.abs(predicted - simulated).max()), float(np.ptp(simulated))
    ax = new_axes(ax)
    count = len(holdout.runs)
    share = error / reach if reach else 0.0
    size = "below 0.01 %" if share < 1e-4 else f"{format_number(100.0 * share, 2)} %"
    label = f"{count} runs, largest error {size} of their range"
    style = line_style(
        points, marker=".", markersize=3.0, linestyle="none", alpha=0.4, rasterized=True, label=label
    )
    ax.plot(simulated, predicted, **style)
    ends = np.array([min(simulated.min(), predicted.min()), max(simulated.max(), predicted.max())])
    ax.plot(ends, ends, color="black", linewidth=0.8, linestyle="--", label="exact")
    what = with_unit(words_of(band.name, band.unit), shown)
    set_labels(ax, f"simulated {what}", f"predicted {what}")
    legend_above_the_data(ax)
    return ax
