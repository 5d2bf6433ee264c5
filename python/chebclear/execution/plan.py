"""Estimated cost of a study, from a few of its runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from ..base.units import unit


@dataclass(frozen=True)
class Plan:
    """Estimated cost of a study on this machine, or with this executor.

    Attributes
    ----------
    runs : int
        Simulations, the nominal one included [-].
    seconds : float
        Time until the result is there [s].
    memory : float
        Memory of this process at its peak [bytes].
    disk : float
        What a store of these runs takes [bytes].
    probes : int
        Runs that were simulated to find out [-].
    """

    runs: int
    seconds: float = field(metadata=unit("s"))
    memory: float = field(metadata=unit("bytes"))
    disk: float = field(metadata=unit("bytes"))
    probes: int

    def __str__(self) -> str:
        return (
            f"{self.runs} runs in about {duration(self.seconds)}, {self.memory / 1e6:.0f} MB of memory, "
            f"{self.disk / 1e6:.0f} MB in a store (from {self.probes} runs)"
        )

    def __repr__(self) -> str:
        return f"<Plan: {self}>"


def seconds_of(measured: Sequence[tuple[int, float]], runs: int) -> float:
    """Time of so many runs, on the line through the first and the last measurement."""
    (few, short), (many, long) = measured[0], measured[-1]
    if many == few or long <= short:
        return long / many * runs
    each = (long - short) / (many - few)
    return long + each * (runs - many)


def duration(seconds: float) -> str:
    """A time in words, such as ``"3 min"``."""
    if seconds < 100.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
