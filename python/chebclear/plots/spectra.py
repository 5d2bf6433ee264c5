"""What a signal consists of: its amplitudes over frequency or order, how they change, and its load cycles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.arguments import Checks
from ..errors import ArgumentError
from ..scene.columns import column_unit, column_words, plain_words
from .axes import abscissa_of, line_style, new_axes, plot_of, require_name, shown_scale
from .labels import add_color_bar, set_labels, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..run.signals import Cycles, Spectrum
    from ..run.trajectory import Trajectory

Array = NDArray[np.float64]


def short_time_spectrum(
    t: Array, signal: Array, *, window: float, overlap: float = 0.75
) -> tuple[Array, Array, Array]:
    """Amplitude of a signal by time and frequency: Fourier transforms of short overlapping pieces.

    Instants are equally spaced [s]; `window` is the length of a piece [s], `overlap` the share that it has in
    common with the next one. Each piece loses its mean, is weighted by a Hann window and padded with zeros to
    four times its length, which only makes the picture finer. The resolution is about ``2 / window`` in
    frequency and ``window / 2`` in time. Returned are the middle of each piece [s], the frequencies [Hz] up
    to half the sampling rate, into which what is above is folded down, and the amplitude, shape (bins,
    pieces): a sine of amplitude A gives a ridge of height A.
    """
    checks = Checks()
    window = checks.real("window", window, "s", above=0.0)
    overlap = checks.real("overlap", overlap, "-", least=0.0, below=1.0)
    checks.finish()
    spacing = float(t[-1] - t[0]) / (len(t) - 1)
    length = round(window / spacing)
    if not 8 <= length <= len(t):
        raise ArgumentError(
            f"window must hold 8 to {len(t)} samples of {spacing:.3g} s each, got {window:.3g} s"
        )
    from matplotlib import mlab

    hop = max(1, round(length * (1.0 - overlap)))
    found = mlab.specgram(
        np.asarray(signal, dtype=float),
        NFFT=length,
        Fs=1.0 / spacing,
        detrend="mean",
        noverlap=length - hop,
        pad_to=4 * length,
        mode="magnitude",
    )
    magnitude: Array = np.asarray(found[0], dtype=float)
    frequencies: Array = np.asarray(found[1], dtype=float)
    centers: Array = t[0] + spacing * (hop * np.arange(magnitude.shape[1]) + 0.5 * (length - 1))
    # One side of the spectrum holds half of the amplitude.
    return centers, frequencies, 2.0 * magnitude


@plot_of("Trajectory")
def plot_spectrogram(
    run: Trajectory,
    column: str,
    *,
    ax: Axes | None = None,
    window: float | None = None,
    overlap: float = 0.75,
    decibels: float = 60.0,
    x: Array | None = None,
    x_label: str = "time [s]",
    **mesh: Any,
) -> Axes:
    """Draw the time-frequency plot of a signal: amplitude in decibels below the largest one.

    Parameters
    ----------
    run : Trajectory
        What :func:`simulate` returned.
    column : str
        Column name.
    window : float, optional
        Length of the pieces that are transformed [s]; a 24th of the signal if not given.
    overlap : float
        Share of a piece that it has in common with the next one [-], at least 0 and below 1.
    decibels : float
        Range of the colors [dB]; smaller amplitudes have the darkest color.
    x : ndarray, shape (samples,), optional
        Abscissa that grows evenly with time, such as the crank angle; goes with `x_label`.
    x_label : str
        Label of the abscissa, with its unit.
    **mesh
        Passed to ``Axes.pcolormesh``. With ``vmax`` (amplitude in decibels re 1 unit) several plots share a
        scale.

    Raises
    ------
    KeyError, TypeError, ValueError
        If the column is unknown, or the window does not fit.

    Examples
    --------
    >>> import chebclear as cc
    >>> scene = cc.mechanisms.slider_crank()
    >>> run = cc.simulate(scene, duration=0.01, samples=2001)
    >>> ax = cc.plots.plot_spectrogram(run, "slider.ax")
    """
    checks = Checks()
    span = checks.real("decibels", decibels, "dB", above=0.0)
    checks.finish()
    require_name("column", column, run)
    t, signal = run.t, run[column]
    window = float(t[-1] - t[0]) / 24.0 if window is None else window
    centers, frequencies, amplitude = short_time_spectrum(t, signal, window=window, overlap=overlap)
    abscissa = centers if x is None else np.interp(centers, t, abscissa_of(x, len(t)))
    ax = new_axes(ax)
    level = 20.0 * np.log10(np.maximum(amplitude, np.finfo(float).tiny))
    top = float(mesh.pop("vmax", level.max()))
    style: dict[str, Any] = {
        "shading": "nearest",
        "cmap": "viridis",
        "vmin": top - span,
        "rasterized": True,
    } | mesh
    image = ax.pcolormesh(abscissa, frequencies / 1e3, level, vmax=top, **style)
    what = f"amplitude of {column_words(column)} [dB re 1 {column_unit(column) or 'unit'}]"
    add_color_bar(ax, image, what, extend="min")
    set_labels(ax, x_label, "frequency [kHz]")
    return ax


@plot_of("Spectrum")
def plot_spectrum(
    spectrum: Spectrum, *, ax: Axes | None = None, unit: str | None = None, **line: Any
) -> Axes:
    """Draw the averaged spectrum of an output: amplitude over the frequency, or over the orders of a crank.

    Parameters
    ----------
    spectrum : Spectrum
        What ``run.spectrum`` returned.

    Examples
    --------
    >>> import chebclear as cc
    >>> scene = cc.mechanisms.slider_crank(clearance_at=())
    >>> run = cc.simulate(scene, duration=8 * scene.period, samples=2881)
    >>> ax = cc.plots.plot_spectrum(run.spectrum("slider.ax", angle="crank"))
    """
    scale, shown = shown_scale(ax, spectrum.unit, unit)
    ax = new_axes(ax)
    # Without the mean, which each piece lost.
    ax.plot(spectrum.lines[1:], scale * spectrum.amplitude[1:], **line_style(line, linewidth=0.8))
    ax.set_yscale("log")
    crank = spectrum.angle
    abscissa = "frequency [Hz]" if crank is None else f"order of {plain_words(crank)} [-]"
    set_labels(ax, abscissa, with_unit(f"amplitude of {column_words(spectrum.output)}", shown))
    return ax


@plot_of("Cycles")
def plot_cycles(cycles: Cycles, *, ax: Axes | None = None, unit: str | None = None, **steps: Any) -> Axes:
    """Draw the load spectrum of an output: ranges over the number of cycles that reach them.

    Parameters
    ----------
    cycles : Cycles
        What ``run.cycles`` returned.

    Examples
    --------
    >>> import chebclear as cc
    >>> import numpy as np
    >>> one = np.ones(3)
    >>> ax = cc.plots.plot_cycles(cc.results.Cycles("wrist.normal_force", "N", 900.0 * one, one, one))
    """
    scale, shown = shown_scale(ax, cycles.unit, unit)
    ax = new_axes(ax)
    reached = np.cumsum(cycles.counts)
    ax.step(reached, scale * cycles.ranges, where="pre", **line_style(steps))
    ax.set_xscale("log")
    set_labels(ax, "cycles", with_unit(f"range of {column_words(cycles.output)}", shown))
    return ax
