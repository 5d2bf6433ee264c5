"""Plots of trajectories, bands and sensitivities.

Every function takes ``ax=None``, draws on it, labels the axes with units and returns the Axes. None calls
``show``, none changes ``rcParams`` or the backend. Extra keywords go to the artist that carries the data.
Without ``ax`` a new figure is made: one of pyplot's when pyplot has been imported (so that ``plt.show()``
shows it), else a plain ``matplotlib.figure.Figure``, reached by ``ax.figure``.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..scene.columns import column_unit
from .labels import legend_above_the_data, set_y_label, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .subjects import BandLike, RunLike

Array = NDArray[np.float64]

# (unit asked for, SI unit) -> what one SI unit is in the unit asked for.
_CONVERSIONS = {
    ("mm", "m"): 1e3,
    ("µm", "m"): 1e6,
    ("mm/s", "m/s"): 1e3,
    ("km/s²", "m/s²"): 1e-3,
    ("deg", "rad"): 180.0 / np.pi,
    ("deg/s", "rad/s"): 180.0 / np.pi,
    ("kN", "N"): 1e-3,
}


def plot_trajectory(
    run: RunLike,
    columns: str | Sequence[str],
    *,
    ax: Axes | None = None,
    unit: str | None = None,
    x: Array | None = None,
    x_label: str = "time [s]",
    **line: Any,
) -> Axes:
    """Draw columns of one simulation against time; a dotted line marks where a run ended early.

    Parameters
    ----------
    run : Trajectory
        What :func:`simulate` returned.
    columns : str or sequence of str
        Column names; all of one unit, since they share the axis.
    ax : Axes, optional
        Where to draw; a new figure if not given.
    unit : str, optional
        Unit to show, such as ``"µm"``; SI if not given.
    x : ndarray, optional
        Abscissa in place of ``run.t``, such as the crank angle; goes with `x_label`.
    x_label : str
        Label of the abscissa, with its unit.
    **line
        Passed to ``Axes.plot``.

    Returns
    -------
    Axes

    Raises
    ------
    ValueError
        If the columns have different units, or the unit does not fit them.
    """
    names = [columns] if isinstance(columns, str) else list(columns)
    units = {column_unit(name) for name in names}
    if len(units) != 1:
        raise ValueError(f"columns on one axis must share a unit, got {names} in {sorted(units)}")
    scale, shown = _scale(units.pop(), unit)
    curves = [scale * run[name] for name in names]
    abscissa = run.t if x is None else np.asarray(x, dtype=float)
    ax = _axes(ax)
    for name, curve in zip(names, curves, strict=True):
        style = _line_style(line, linewidth=0.9, label=name)
        ax.plot(abscissa, curve, **style)
    # A column of the run as abscissa is no more known after the end than the curves are.
    known = np.isfinite(abscissa)
    if not run.success and known.any():
        # A curve that just stops looks like the whole of it.
        end = float(np.interp(run.end_time, run.t[known], abscissa[known]))
        words = f"the run ended early: {run.status}"
        ax.axvline(end, color="tab:red", linewidth=0.9, linestyle=":", label=words)
        if known.all():
            ax.set_xlim(abscissa.min(), abscissa.max())
    ax.set_xlabel(x_label)
    # The legend names the columns; what they have in common is on the axis.
    quantities = {name.rpartition(".")[2] for name in names}
    common = names[0] if len(names) == 1 else quantities.pop() if len(quantities) == 1 else ""
    set_y_label(ax, with_unit(common, shown))
    if len(names) > 1 or not run.success:
        ax.legend(loc="best", fontsize="small")
    return ax


def plot_orbit(run: RunLike, joint: str, *, ax: Axes | None = None, unit: str = "µm", **line: Any) -> Axes:
    """Draw the path of the journal centre inside the clearance circle of a joint.

    The circle has the radius of the clearance: inside it the journal flies free, outside it the surfaces
    overlap by the distance to the circle. Axes are those of the ground.

    Parameters
    ----------
    run : Trajectory
        What :func:`simulate` returned.
    joint : str
        Name of the clearance joint.
    ax : Axes, optional
        Where to draw; a new figure if not given.
    unit : str
        Unit of length to show.
    **line
        Passed to ``Axes.plot`` for the path.

    Returns
    -------
    Axes
    """
    scale, shown = _scale("m", unit)
    # eccentricity - penetration is the clearance at every sample; the median shrugs off rounding and failed
    # samples.
    clearance = float(np.nanmedian(run[f"{joint}.eccentricity"] - run[f"{joint}.penetration"]))
    path = scale * run[f"{joint}.eccentricity_x"], scale * run[f"{joint}.eccentricity_y"]
    ax = _axes(ax)
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    ax.plot(
        scale * clearance * np.cos(turn),
        scale * clearance * np.sin(turn),
        color="0.4",
        linewidth=1.0,
        linestyle="--",
        label=f"clearance circle, {scale * clearance:.3g} {shown}",
    )
    style = _line_style(line, linewidth=0.6, label="journal centre")
    ax.plot(*path, **style)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set_xlabel(with_unit(f"{joint} eccentricity x", shown))
    set_y_label(ax, with_unit(f"{joint} eccentricity y", shown))
    legend_above_the_data(ax)
    return ax


def plot_band(
    band: BandLike,
    *,
    ax: Axes | None = None,
    unit: str | None = None,
    x: Array | None = None,
    x_label: str = "time [s]",
    scan: BandLike | None = None,
    nominal: bool = False,
    **fill: Any,
) -> Axes:
    """Draw a band: its area, its two bounds and, on request, the nominal response and a reference band.

    Parameters
    ----------
    band : Band
        The band of one output.
    ax : Axes, optional
        Where to draw; a new figure if not given.
    unit : str, optional
        Unit to show, such as ``"µm"``; SI if not given.
    x : ndarray, optional
        Abscissa in place of ``band.t``, such as the crank angle; goes with `x_label`.
    x_label : str
        Label of the abscissa, with its unit.
    scan : Band, optional
        Band of the same output to compare with, drawn as dashed lines. A scan is an inner bound.
    nominal : bool
        Draw the response at the midpoint of the intervals.
    **fill
        Passed to ``Axes.fill_between``.

    Returns
    -------
    Axes
    """
    scale, shown = _scale(column_unit(band.name), unit)
    ax = _axes(ax)
    abscissa = band.t if x is None else x
    colour = fill.pop("color", fill.pop("facecolor", "tab:blue"))
    style = {
        "alpha": 0.25,
        "linewidth": 0.0,
        "label": "Chebyshev bounds" if scan is not None else "bounds",
    } | fill
    ax.fill_between(abscissa, scale * band.lower, scale * band.upper, color=colour, **style)
    for bound in (band.lower, band.upper):
        ax.plot(abscissa, scale * bound, color=colour, linewidth=0.8)
    if scan is not None:
        for bound, label in ((scan.lower, "scan"), (scan.upper, None)):
            ax.plot(abscissa, scale * bound, color="black", linewidth=0.8, linestyle=(0, (4, 2)), label=label)
    if nominal:
        ax.plot(abscissa, scale * band.nominal, color="tab:red", linewidth=0.7, label="nominal")
    ax.set_xlabel(x_label)
    set_y_label(ax, with_unit(band.name, shown))
    ax.legend(loc="best", fontsize="small")
    return ax


def plot_sensitivity(
    band: BandLike,
    parameter: str,
    *,
    ax: Axes | None = None,
    normalised: bool = False,
    parameter_unit: str = "",
    x: Array | None = None,
    x_label: str = "time [s]",
    **line: Any,
) -> Axes:
    """Draw the sensitivity of an output to one parameter at the midpoint of the intervals.

    Several on the same axes get a legend that names them.

    Parameters
    ----------
    band : Band
        The band of one output, from a Chebyshev study.
    parameter : str
        Name of the parameter.
    ax : Axes, optional
        Where to draw; a new figure if not given.
    normalised : bool
        Derivative with respect to the normalised variable in [-1, 1] instead of the physical parameter.
    parameter_unit : str
        Unit of the parameter, such as ``"m"``, for the label.
    x : ndarray, optional
        Abscissa in place of ``band.t``; goes with `x_label`.
    x_label : str
        Label of the abscissa, with its unit.
    **line
        Passed to ``Axes.plot``.

    Returns
    -------
    Axes
    """
    slope = band.sensitivity(parameter, normalised=normalised)
    ax = _axes(ax)
    unit = column_unit(band.name)
    if normalised:
        what = f"{unit} per half interval"
    else:
        what = f"({unit})/{parameter_unit}" if parameter_unit else f"({unit}) per SI unit"
    label = f"∂ {band.name} / ∂ {parameter} [{what}]"
    earlier = ax.get_legend_handles_labels()[1]
    style = _line_style(line, linewidth=0.9, label=label)
    ax.plot(band.t if x is None else x, slope, **style)
    ax.set_xlabel(x_label)
    if earlier:
        # One unit for all of them, or each its own in the legend.
        shared = all(other.endswith(f" [{what}]") for other in earlier)
        set_y_label(ax, f"sensitivity [{what}]" if shared else "sensitivity [see legend]")
        ax.legend(loc="best", fontsize="small")
    else:
        set_y_label(ax, label)
    return ax


def short_time_spectrum(
    t: Array, signal: Array, *, window: float, overlap: float = 0.75
) -> tuple[Array, Array, Array]:
    """Amplitude of a signal by time and frequency: Fourier transforms of short overlapping pieces.

    Each piece loses its mean, is weighted by a Hann window and padded with zeros to four times its length,
    which only makes the picture finer. The resolution is about ``2 / window`` in frequency and ``window /
    2`` in time.

    Parameters
    ----------
    t : ndarray, shape (samples,)
        Equally spaced instants [s].
    signal : ndarray, shape (samples,)
        The signal, in any unit.
    window : float
        Length of a piece [s].
    overlap : float
        Share of a piece that it has in common with the next one [-], at least 0 and below 1.

    Returns
    -------
    centres : ndarray, shape (pieces,)
        Middle of each piece [s].
    frequencies : ndarray, shape (bins,)
        Frequencies [Hz], up to half the sampling rate. What the signal holds above that is folded down into
        the picture: sample finely enough.
    amplitude : ndarray, shape (bins, pieces)
        Amplitude in the unit of the signal: a sine of amplitude A gives a ridge of height A.

    Raises
    ------
    ValueError
        If the window holds fewer than 8 samples or is longer than the signal, or the overlap is out of range.
    """
    spacing = float(t[-1] - t[0]) / (len(t) - 1)
    length = round(window / spacing)
    if not 8 <= length <= len(t):
        raise ValueError(
            f"window must hold 8 to {len(t)} samples of {spacing:.3g} s each, got {window:.3g} s"
        )
    if not 0.0 <= overlap < 1.0:
        raise ValueError(f"overlap must be at least 0 and below 1, got {overlap}")
    hop = max(1, round(length * (1.0 - overlap)))
    starts = np.arange(0, len(t) - length + 1, hop)
    weights = 0.5 - 0.5 * np.cos(2.0 * np.pi * (np.arange(length) + 0.5) / length)
    pieces = np.lib.stride_tricks.sliding_window_view(signal, length)[starts]
    pieces = (pieces - pieces.mean(axis=1, keepdims=True)) * weights
    padded = 4 * length
    amplitude = 2.0 * np.abs(np.fft.rfft(pieces, n=padded, axis=1)) / weights.sum()
    centres: Array = t[0] + spacing * (starts + 0.5 * (length - 1))
    frequencies = np.arange(amplitude.shape[1]) / (padded * spacing)
    return centres, frequencies, amplitude.T


def plot_spectrogram(
    run: RunLike | Array,
    column: str | Array,
    *,
    ax: Axes | None = None,
    window: float | None = None,
    overlap: float = 0.75,
    unit: str | None = None,
    decibels: float = 60.0,
    colour_bar: bool = True,
    x: Array | None = None,
    x_label: str = "time [s]",
    **mesh: Any,
) -> Axes:
    """Draw the time-frequency plot of a signal: amplitude in decibels below the largest one.

    Parameters
    ----------
    run : Trajectory or ndarray, shape (samples,)
        What :func:`simulate` returned; or equally spaced instants [s].
    column : str or ndarray, shape (samples,)
        Column name; or the signal at those instants.
    ax : Axes, optional
        Where to draw; a new figure if not given.
    window : float, optional
        Length of the pieces that are transformed [s]; a 24th of the signal if not given.
    overlap : float
        Share of a piece that it has in common with the next one [-], at least 0 and below 1.
    unit : str, optional
        Unit of the signal, for the label of the colour bar; that of the column if not given.
    decibels : float
        Range of the colours [dB]; smaller amplitudes have the darkest colour.
    colour_bar : bool
        Add a colour bar to the figure.
    x : ndarray, shape (samples,), optional
        Abscissa that grows evenly with time, such as the crank angle; goes with `x_label`.
    x_label : str
        Label of the abscissa, with its unit.
    **mesh
        Passed to ``Axes.pcolormesh``. With ``vmax`` (amplitude in decibels re 1 unit) several plots share a
        scale.

    Returns
    -------
    Axes

    Raises
    ------
    KeyError, TypeError, ValueError
        If the column is unknown, the data are neither a column nor two arrays, or the window does not fit.
    """
    t, signal = _signal(run, column)
    if unit is None:
        unit = column_unit(column) if isinstance(column, str) else ""
    window = float(t[-1] - t[0]) / 24.0 if window is None else window
    centres, frequencies, amplitude = short_time_spectrum(t, signal, window=window, overlap=overlap)
    abscissa = centres if x is None else np.interp(centres, t, x)
    ax = _axes(ax)
    level = 20.0 * np.log10(np.maximum(amplitude, np.finfo(float).tiny))
    top = float(mesh.pop("vmax", level.max()))
    style: dict[str, Any] = {"shading": "nearest", "vmin": top - decibels, "rasterized": True} | mesh
    image = ax.pcolormesh(abscissa, frequencies / 1e3, level, vmax=top, **style)
    ax.set_xlabel(x_label)
    ax.set_ylabel("frequency [kHz]")
    if colour_bar:
        ax.figure.colorbar(image, ax=ax, label=f"amplitude [dB re 1 {unit or 'unit'}]", extend="min")
    return ax


def _signal(run: Any, column: Any) -> tuple[Array, Array]:
    """Instants and values of what `plot_spectrogram` was given."""
    if isinstance(column, str) and hasattr(run, "columns"):
        return run.t, run[column]
    t, signal = np.asarray(run), np.asarray(column)
    numbers = t.dtype.kind in "iuf" and signal.dtype.kind in "iuf"
    if not (numbers and t.ndim == 1 and len(t) >= 2 and t.shape == signal.shape):
        raise TypeError(
            "plot_spectrogram takes a run and the name of one of its columns, or two arrays of equal length, "
            f"the instants and the signal; got {type(run).__name__} and {type(column).__name__}"
        )
    return t, signal


def _axes(ax: Axes | None) -> Axes:
    """`ax`, or the axes of a new figure."""
    if ax is not None:
        return ax
    if "matplotlib.pyplot" in sys.modules:
        from matplotlib import pyplot

        return pyplot.subplots(layout="constrained")[1]
    from matplotlib.figure import Figure

    return Figure(layout="constrained").subplots()


def _line_style(given: dict[str, Any], **defaults: Any) -> dict[str, Any]:
    """The user's keywords over the defaults; short names such as ``lw`` count as the long ones."""
    from matplotlib.cbook import normalize_kwargs
    from matplotlib.lines import Line2D

    return defaults | normalize_kwargs(given, Line2D)


def _scale(si_unit: str, unit: str | None) -> tuple[float, str]:
    """Factor from the SI unit to the unit asked for, and the unit to show."""
    if unit is None or unit == si_unit:
        return 1.0, si_unit
    try:
        return _CONVERSIONS[unit, si_unit], unit
    except KeyError:
        known = ", ".join([si_unit, *(shown for shown, base in _CONVERSIONS if base == si_unit)])
        raise ValueError(f"unit must be one of {known} for a column in {si_unit}, got {unit!r}") from None
