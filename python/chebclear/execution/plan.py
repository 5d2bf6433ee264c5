"""Estimated cost of a study, from a few of its runs."""

from __future__ import annotations

from dataclasses import dataclass, field

from ..base.units import unit

# What a result takes besides its samples [bytes], and how often it takes its samples while bands are made:
# the limits that are set for both.
_BASE, _TWICE = 150_000_000, 1.3


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
        Memory [bytes].
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


def planned(runs: int, samples: int, features: int, probes: int, seconds: float) -> Plan:
    """The plan for runs of which some took so long.

    Parameters
    ----------
    runs : int
        Runs in all [-].
    samples : int
        Numbers that a run leaves: samples times outputs [-].
    features : int
        Features of a run, of all cycles [-].
    probes : int
        Runs that were measured [-].
    seconds : float
        Time that these took together [s].
    """
    size = 8.0 * runs * samples
    # A run leaves its counts, its key and a status besides.
    disk = size + runs * (8.0 * features + 160.0)
    return Plan(runs, seconds / probes * runs, _BASE + _TWICE * size, disk, probes)


def duration(seconds: float) -> str:
    """A time in words, such as ``"3 min"``."""
    if seconds < 100.0:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.1f} h"
