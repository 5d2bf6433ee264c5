"""What is found in the samples of an output: its averaged spectrum, and its load cycles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..base import files as records
from ..base.arguments import Checks
from ..base.named import Named
from ..base.prefixes import format_quantity
from ..base.rows import Array
from ..data.dataset import Dataset, Variable, facts_of, numbered
from ..data.exports import Exports
from ..data.needed import needed
from ..errors import ArgumentError, warn
from ..report import html
from ..report.document import Table
from ..scene.columns import column_unit
from ..scene.scene import Scene, revolution_time
from .resampling import interpolated, refined

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Revolutions of a piece that keep whole orders apart: Hann's window spreads a line over two on each side.
_APART = 4
# Pieces of a run, and samples of a piece at least: more pieces scatter less and have wider lines.
_PIECES = 8
_LEAST_SAMPLES = 8
# A hundredth of the power in the last tenth of the lines: as much again may have been folded down from above.
_EDGE, _FOLDED = 0.9, 0.01
_MOST_PEAKS = 8
# Part of the largest range that every other sample may miss before the samples count as too coarse.
_MISSED = 0.01
_MOST_ROWS = 10


@dataclass(frozen=True, eq=False, repr=False)
class Spectrum(html.Tabled, records.Saved, Exports, kind="spectrum"):
    """Averaged spectrum of an output; see `Trajectory.spectrum`.

    Attributes
    ----------
    output : str
        Name of the output.
    unit : str
        Its unit.
    angle : str | None
        Body or joint whose revolutions are counted; None for a spectrum over the frequency.
    lines : Array
        Frequencies in Hz; over an angle orders, the cycles per revolution. Shape (lines,).
    power : Array
        Mean square in each line, averaged over the pieces, in the square of the unit: A²/2 of a sine of
        amplitude A. Shape (lines,).
    pieces : int
        Overlapping pieces that are averaged [-].
    """

    _axes: ClassVar = {"lines": ("lines",), "power": ("lines",)}

    output: str
    unit: str
    angle: str | None
    lines: Array
    power: Array
    pieces: int

    @property
    def amplitude(self) -> Array:
        """Amplitude of a sine in each line, in the unit of the output, shape (lines,)."""
        return np.sqrt(2.0 * self.power)

    @property
    def table(self) -> Table:
        """The highest peaks, by their frequency or order."""
        amplitude, rows = self.amplitude, []
        inner = amplitude[1:-1]
        peaks = 1 + np.flatnonzero((inner > amplitude[:-2]) & (inner >= amplitude[2:]))
        for k in sorted(peaks[np.argsort(-amplitude[peaks], kind="stable")][:_MOST_PEAKS]):
            line = f"{self.lines[k]:.4g}" if self.angle else format_quantity(float(self.lines[k]), "Hz", 4)
            rows.append([line, format_quantity(float(amplitude[k]), self.unit)])
        return Table(f"Peaks of {self.output}", ["order" if self.angle else "frequency", "amplitude"], rows)

    def dataset(self) -> Dataset:
        """Power and amplitude over the frequency or the order."""
        axis, unit = ("order", "-") if self.angle else ("frequency", "Hz")
        variables = {
            axis: Variable((axis,), self.lines, unit),
            "amplitude": Variable((axis,), self.amplitude, self.unit),
            "power": Variable((axis,), self.power, f"({self.unit})²" if self.unit else ""),
        }
        return Dataset(axis, variables, facts_of(self))

    def __repr__(self) -> str:
        over = f"the orders of {self.angle}" if self.angle else "the frequency"
        pieces = "1 piece" if self.pieces == 1 else f"{self.pieces} pieces"
        return f"<Spectrum of {self.output} over {over}: {len(self.lines)} lines, {pieces}>"

    def __str__(self) -> str:
        word = "order " if self.angle else ""
        return "\n".join([repr(self)[1:-1], *(f"  {word}{row[0]}: {row[1]}" for row in self.table.rows)])

    def plot(self, *, ax: Axes | None = None, unit: str | None = None) -> Axes:
        """Draw the amplitude over the frequency or the order; see `plot_spectrum`."""
        from ..plots.spectra import plot_spectrum

        return plot_spectrum(self, ax=ax, unit=unit)


def spectrum_of(
    t: Array,
    values: Array,
    name: str,
    unit: str,
    crank: str | None,
    angle: Array | None,
    window: float | None,
    period: float = 0.0,
) -> Spectrum:
    """The spectrum of equally spaced samples, or of their values at equal steps of an angle [rad].

    `period` is the time of a revolution [s], 0 if there is none; for the length of pieces over the time.
    """
    if not np.all(np.isfinite(values)):
        raise ArgumentError(f"{name} is not known at all samples: a spectrum needs a run without gaps")
    if angle is None:
        step, turn, what = float(t[-1] - t[0]) / (len(t) - 1), period, "s"
    else:
        step, values = _at_equal_angles(t, values, angle, str(crank))
        turn, what = 1.0, "revolutions"
    span = len(values) * step
    if window is None:
        window = min(span, max(_APART * turn, span / _PIECES))
        window = window if angle is None else math.floor(window + 1e-9)
    elif angle is not None and window != int(window):
        raise ArgumentError(f"window must be a whole number of revolutions, got {window:g}")
    length = round(window / step)
    if not _LEAST_SAMPLES <= length <= len(values):
        least = _LEAST_SAMPLES * step
        raise ArgumentError(f"window must be from {least:.3g} to {span:.6g} {what}, got {window:g}")
    power, pieces = averaged_power(values, length)
    lines = np.arange(len(power)) / (length * step)
    if power[int(_EDGE * len(power)) :].sum() > _FOLDED * power.sum():
        warn(
            f"{name}: more than {100.0 * _FOLDED:g} % of the power lies in the last tenth of the spectrum: "
            "faster oscillations are folded down into it; take more samples"
        )
    return Spectrum(name, unit, crank, lines, power, pieces)


def averaged_power(values: Array, length: int) -> tuple[Array, int]:
    """Mean square in each line of pieces that overlap by half, and their number (Welch, 1967).

    Each piece loses its mean and is weighted by a Hann window.
    """
    pieces = np.lib.stride_tricks.sliding_window_view(values, length)[:: max(1, length // 2)]
    window = 0.5 - 0.5 * np.cos(2.0 * math.pi * np.arange(length) / length)
    spectra = np.fft.rfft((pieces - pieces.mean(axis=1, keepdims=True)) * window, axis=1)
    power: Array = np.mean(np.abs(spectra) ** 2, axis=0) / window.sum() ** 2
    # The negative frequencies, which zero and half the sampling rate do not have.
    power[1 : (length + 1) // 2] *= 2.0
    return power, len(pieces)


def _at_equal_angles(t: Array, values: Array, angle: Array, crank: str) -> tuple[float, Array]:
    """Step [revolutions], and the values at equal steps of whole revolutions."""
    sense = 1.0 if angle[-1] >= angle[0] else -1.0
    passed = sense * (angle - angle[0]) / (2.0 * math.pi)
    if not np.all(np.diff(passed) > 0.0):
        raise ArgumentError(f'"{crank}" stands still or turns back: its angle must grow to count revolutions')
    turns = math.floor(passed[-1] + 1e-9)
    if turns < 1:
        raise ArgumentError(f'"{crank}" makes {passed[-1]:.3g} revolutions: at least one is needed')
    each = math.floor((len(t) - 1) / passed[-1] + 1e-9)
    if each < _LEAST_SAMPLES:
        raise ArgumentError(f"{each} samples a revolution are too few: take more samples")
    places = np.arange(turns * each) / each
    instants = refined(np.interp(places, passed, t), t, passed)
    return 1.0 / each, interpolated(instants, t, values[:, None])[:, 0]


@dataclass(frozen=True, eq=False, repr=False)
class Cycles(html.Tabled, records.Saved, Exports, kind="load cycles"):
    """Load cycles of an output, the largest first; see `Trajectory.cycles`.

    Attributes
    ----------
    output : str
        Name of the output.
    unit : str
        Its unit.
    ranges : Array
        Highest less lowest value of each cycle, in the unit, shape (cycles,).
    means : Array
        Mean of both, in the unit, shape (cycles,).
    counts : Array
        1 for a closed cycle, 0.5 for half a cycle [-], shape (cycles,).
    """

    _axes: ClassVar = {"ranges": ("cycles",), "means": ("cycles",), "counts": ("cycles",)}

    output: str
    unit: str
    ranges: Array
    means: Array
    counts: Array

    @property
    def table(self) -> Table:
        """The largest cycles."""
        rows = [
            [*(format_quantity(float(one), self.unit) for one in (size, mean)), f"{count:g}"]
            for size, mean, count in list(zip(self.ranges, self.means, self.counts, strict=True))[:_MOST_ROWS]
        ]
        return Table(f"Largest load cycles of {self.output}", ["range", "mean", "count"], rows)

    def dataset(self) -> Dataset:
        """A row for each cycle."""
        columns = {"range": self.ranges.tolist(), "mean": self.means.tolist(), "count": self.counts.tolist()}
        return numbered(
            "cycle", columns, {"range": self.unit, "mean": self.unit, "count": "-"}, facts_of(self)
        )

    def __repr__(self) -> str:
        return f"<Cycles of {self.output}: {self}>"

    def __str__(self) -> str:
        largest = format_quantity(float(self.ranges[0]), self.unit) if len(self.ranges) else "none"
        return f"{self.counts.sum():g} cycles, largest range {largest}"

    def plot(self, *, ax: Axes | None = None, unit: str | None = None) -> Axes:
        """Draw the ranges over the number of cycles that reach them; see `plot_cycles`."""
        from ..plots.spectra import plot_cycles

        return plot_cycles(self, ax=ax, unit=unit)


def cycles_of(values: Array, name: str, unit: str) -> Cycles:
    """The cycles of a series of values."""
    rainflow = needed("rainflow", "cycles", "cycles")
    if not np.all(np.isfinite(values)):
        raise ArgumentError(f"{name} is not known at all samples: load cycles need a run without gaps")
    found = np.array([one[:3] for one in rainflow.extract_cycles(values.tolist())]).reshape(-1, 3)
    ranges, means, counts = found[np.argsort(-found[:, 0], kind="stable")].T
    if np.ptp(values[::2]) < (1.0 - _MISSED) * np.ptp(values):
        warn(
            f"{name}: every other sample misses more than {100.0 * _MISSED:g} % of the largest range: "
            "peaks are missed between the samples too; take more samples"
        )
    return Cycles(name, unit, ranges, means, counts)


class WithSignals(Named[Array]):
    """Base of runs, which have columns over equally spaced instants ``t``."""

    t: Array
    scene: Scene

    def spectrum(self, output: str, *, angle: str | None = None, window: float | None = None) -> Spectrum:
        """Averaged spectrum of an output, over the frequency or over the orders of a crank (Welch's method).

        The samples are cut into pieces that overlap by half; each loses its mean and is weighted by a Hann
        window. Leave out the starting transient with ``skip=``.

        Parameters
        ----------
        output : str
            Name of a column.
        angle : str, optional
            Body or joint whose revolutions are the abscissa: the output is interpolated at equal steps of its
            angle, by cubics, so that a speed that varies does not smear the orders. The run must have the
            column ``"NAME.angle"``.
        window : float, optional
            Length of a piece [s], or in whole revolutions with an angle [-]; an eighth of the run if not
            given, and at least four revolutions of its drive. Lines are the inverse of it apart.

        Raises
        ------
        KeyError
            If a column is unknown.
        ValueError, TypeError
            If the window does not fit, it does not turn throughout, or the run ended early.

        >>> import chebclear as cc
        >>> scene = cc.mechanisms.slider_crank(clearance_at=())
        >>> run = cc.simulate(scene, duration=8 * scene.period, samples=2881)
        >>> run.spectrum("slider.ax", angle="crank")
        <Spectrum of slider.ax over the orders of crank: 721 lines, 3 pieces>
        """
        checks = Checks()
        if angle is not None and not isinstance(angle, str):
            checks.add(
                "angle", f"must be the name of a body or joint that turns, got {angle!r}", wrong_type=True
            )
        if window is not None:
            window = checks.real("window", window, "s" if angle is None else "-", above=0.0)
        values = self._column(checks, output)
        turned = None if angle is None else self._entry(f"{angle}.angle")
        unit, period = column_unit(output), revolution_time(self.scene)
        return spectrum_of(self.t, values, output, unit, angle, turned, window, period)

    def cycles(self, output: str) -> Cycles:
        """Load cycles of an output by rainflow counting (ASTM E1049), for fatigue.

        Needs the package rainflow: ``pip install 'chebclear[cycles]'``. Half cycles that a single revolution
        leaves open close over several: count over some, after the starting transient (``skip=``).

        Parameters
        ----------
        output : str
            Name of a column.

        Returns
        -------
        Cycles
            Ranges, means and counts.

        Raises
        ------
        ImportError
            If the package is not installed.
        KeyError
            If the column is unknown.
        ValueError, TypeError
            If the run ended early, or `output` is no name of one column.

        >>> import chebclear as cc
        >>> scene = cc.mechanisms.slider_crank(clearance_at=())
        >>> run = cc.simulate(scene, duration=4 * scene.period, samples=1441)
        >>> print(run.cycles("slider.ax"))  # doctest: +SKIP
        4 cycles, largest range 3.15 km/s²
        """
        return cycles_of(self._column(Checks(), output), output, column_unit(output))

    def _column(self, checks: Checks, output: str) -> Array:
        """The samples of one output; raises what is wrong."""
        if not isinstance(output, str):
            checks.add("output", f"must be the name of a column, got {output!r}", wrong_type=True)
        checks.finish()
        return self._entry(output)
