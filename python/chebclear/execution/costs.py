"""What the runs of a study cost, as one table, and what they will cost, from a few of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import overload

import numpy as np
from numpy.typing import NDArray

from ..base.files import ArrayRecord, same
from ..base.rows import Array
from ..base.units import unit
from ..run.trajectory import Stats

STATS = tuple(item.name for item in dataclasses.fields(Stats))
"""Names of the counts of a run."""


class Costs(Sequence[Stats]):
    """What each run cost: a sequence of `Stats`, kept as an array of shape (runs, counts) in the order of
    `STATS`, since a study may have 100 000 runs."""

    def __init__(self, counts: Array) -> None:
        self.counts = counts.view()
        self.counts.flags.writeable = False

    @classmethod
    def joined(cls, parts: Iterable[Sequence[Stats]]) -> Costs:
        """Those of some runs and then of others."""
        counts = (
            costs.counts
            if isinstance(costs, Costs)
            else np.array([dataclasses.astuple(one) for one in costs])
            for costs in parts
        )
        return cls(np.concatenate([one.reshape(-1, len(STATS)) for one in [np.empty(0), *counts]]))

    def __reduce__(self) -> tuple[type[Costs], tuple[Array]]:
        return Costs, (self.counts,)

    def __len__(self) -> int:
        return len(self.counts)

    def __iter__(self) -> Iterator[Stats]:
        return (Stats.from_dict(dict(zip(STATS, row.tolist(), strict=True))) for row in self.counts)

    @overload
    def __getitem__(self, index: int) -> Stats: ...
    @overload
    def __getitem__(self, index: slice | NDArray[np.intp]) -> Costs: ...
    def __getitem__(self, index: int | slice | NDArray[np.intp]) -> Stats | Costs:
        if isinstance(index, slice | np.ndarray):
            return Costs(self.counts[index])
        return Stats.from_dict(dict(zip(STATS, self.counts[index].tolist(), strict=True)))

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Costs):
            return same(self.counts, other.counts)
        return tuple(self) == other if isinstance(other, tuple) else NotImplemented

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<Costs: {len(self)} runs>"


@dataclass(frozen=True, eq=False)
class Plan(ArrayRecord):
    """Estimated cost of a study on this machine, or with this executor.

    Attributes
    ----------
    runs : int
        Simulations, the nominal one and those for requirements included [-].
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
