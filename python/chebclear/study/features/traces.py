"""Features that a simulated run and a measured trace share: they are taken from samples alone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.arguments import Checks
from ...base.rows import Array
from ...base.units import unit
from ...errors import ArgumentError


class OfSamples:
    """Base of features of the samples of one output: callables of a run, as `Study` takes them."""

    of: str

    def __post_init__(self) -> None:
        checks = Checks()
        for item in fields(self):  # type: ignore[arg-type]
            value = getattr(self, item.name)
            if item.name == "of" and not isinstance(value, str):
                checks.add("of", f"must be the name of an output, got {value!r}", wrong_type=True)
            elif item.name != "of" and value is not None:
                number = checks.real(item.name, value, item.metadata.get("unit", "-"))
                object.__setattr__(self, item.name, number)
        checks.finish()

    def __call__(self, run: Mapping[str, Any]) -> float:
        t = run["t"] if "t" in run else run.t  # type: ignore[attr-defined] # a dictionary, or a run
        return float(self.sampled(t, run[self.of]))

    def sampled(self, t: Array, values: Array) -> Array:
        """The feature of values of shape (..., samples)."""
        raise NotImplementedError


@dataclass(frozen=True)
class BandPower(OfSamples):
    """Mean square of an output within a band of frequencies, in the square of its unit.

    From a periodogram with Hann's window, without the mean: an oscillation of amplitude A inside the band
    gives A²/2.

    Attributes
    ----------
    of : str
        Name of the output.
    lower : float
        Lowest frequency that is taken [Hz].
    upper : float
        Highest frequency that is taken [Hz].

    Examples
    --------
    >>> import numpy as np
    >>> t = np.linspace(0.0, 1.0, 2001)
    >>> round(BandPower("x", 20.0, 40.0)({"t": t, "x": 3.0 * np.sin(2 * np.pi * 30 * t)}), 3)
    4.5
    """

    of: str
    lower: float = field(metadata=unit("Hz"))
    upper: float = field(metadata=unit("Hz"))

    def sampled(self, t: Array, values: Array) -> Array:
        """The feature of values of shape (..., samples); ValueError if these do not resolve the band."""
        step = (t[-1] - t[0]) / (len(t) - 1)
        least, most = 1.0 / (t[-1] - t[0]), 0.5 / step
        if not (0.0 <= self.lower < self.upper <= most and self.upper - self.lower >= least):
            raise ArgumentError(
                f"samples every {step:.3g} s resolve frequencies up to {most:.3g} Hz in steps of "
                f"{least:.3g} Hz, not {self.lower:g} to {self.upper:g} Hz of {self.of}"
            )
        window = np.hanning(len(t) + 1)[:-1]
        centered = (values - np.mean(values, axis=-1, keepdims=True)) * window
        power = 2.0 * np.abs(np.fft.rfft(centered, axis=-1)) ** 2 / (len(t) * np.sum(window**2))
        frequency = np.fft.rfftfreq(len(t), step)
        found: Array = power[..., (frequency >= self.lower) & (frequency <= self.upper)].sum(axis=-1)
        return found


@dataclass(frozen=True)
class MagnitudeQuantile(OfSamples):
    """The value that the magnitude of an output stays below during a share of the time, in its unit.

    With a share near 1 it tells how high peaks are, without depending on a single one.

    Parameters
    ----------
    of : str
        Name of the output.
    share : float
        Share of the time [-], from 0 to 1.

    Examples
    --------
    >>> import numpy as np
    >>> MagnitudeQuantile("x", 0.5)({"t": np.arange(5.0), "x": np.array([-3.0, 1.0, 2.0, -4.0, 0.0])})
    2.0
    """

    of: str
    share: float

    def sampled(self, t: Array, values: Array) -> Array:
        """The feature of values of shape (..., samples)."""
        if not 0.0 <= self.share <= 1.0:
            raise ArgumentError(f"share must be from 0 to 1 [-], got {self.share!r}")
        return np.asarray(np.quantile(np.abs(values), self.share, axis=-1))


@dataclass(frozen=True)
class Crossings(OfSamples):
    """How often an output rises through a level [-], such as the impacts that an acceleration shows.

    Parameters
    ----------
    of : str
        Name of the output.
    level : float
        The level, in the unit of the output.
    release : float, optional
        It must have been below this before it counts again, so that noise does not; by default the level.

    Examples
    --------
    >>> import numpy as np
    >>> run = {"t": np.arange(6.0), "x": np.array([0.0, 2.0, 0.9, 1.1, 0.0, 3.0])}
    >>> Crossings("x", 1.0)(run), Crossings("x", 1.0, 0.5)(run)
    (3.0, 2.0)
    """

    of: str
    level: float
    release: float | None = None

    def sampled(self, t: Array, values: Array) -> Array:
        """The feature of values of shape (..., samples)."""
        release = self.level if self.release is None else self.release
        return np.asarray(np.count_nonzero(rising_edges(values, self.level, release), axis=-1), dtype=float)


def rising_edges(values: Array, level: float, release: float) -> NDArray[np.bool_]:
    """After which samples values of shape (..., samples) reach a level, having been below `release`, at most
    the level, since the last time; shape (..., samples - 1)."""
    state = np.where(values >= level, 1, np.where(values < release, -1, 0))
    state[..., 0] = np.where(values[..., 0] >= level, 1, -1)
    # What is between the two levels keeps the last state.
    last = np.maximum.accumulate(np.where(state != 0, np.arange(values.shape[-1]), 0), axis=-1)
    state = np.take_along_axis(state, last, axis=-1)
    return np.asarray((state[..., 1:] == 1) & (state[..., :-1] == -1))
