"""Load cycles of an output by rainflow counting."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ...base.prefixes import format_quantity
from ...base.rows import Array
from ...data.needed import needed
from ...errors import ArgumentError, warn
from ...report import html
from ...report.document import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Part of the largest range that every other sample may miss before the samples count as too coarse.
_MISSED = 0.01
_MOST_ROWS = 10


@dataclass(frozen=True, eq=False, repr=False)
class Cycles(html.Tabled):
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

    def __repr__(self) -> str:
        return f"<Cycles of {self.output}: {self}>"

    def __str__(self) -> str:
        largest = format_quantity(float(self.ranges[0]), self.unit) if len(self.ranges) else "none"
        return f"{self.counts.sum():g} cycles, largest range {largest}"

    def plot(self, *, ax: Axes | None = None, unit: str | None = None) -> Axes:
        """Draw the ranges over the number of cycles that reach them; see `plot_cycles`."""
        from ...plots.spectra import plot_cycles

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
