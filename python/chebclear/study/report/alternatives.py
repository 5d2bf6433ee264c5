"""What a tighter or a cheaper setting would give, measured on the runs of a study; none is made."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from ...base.prefixes import format_quantity
from ...base.rows import Array
from ...report.document import Block, Cell, Table, Text
from ..band.band import Band
from ..band.margin import percent
from ..band.requirement import mean_share
from ..polynomials.surrogate import Surrogate

if TYPE_CHECKING:
    from ..results import StudyResult


# A band of so few runs is judged by too few others [-].
_LEAST_HALF = 8


def alternatives(result: StudyResult) -> list[Block]:
    """Tables and sentences on fewer and more runs; empty where these runs do not tell."""
    return [*_fewer_runs(result), *_fewer_values(result), *_lower_degree(result)]


def _fewer_runs(result: StudyResult) -> list[Block]:
    """Bands of the first half of the runs beside those of all, judged by the other half."""
    count, total = len(result.parameters) // 2, len(result.parameters)
    if result.kind not in _HOW_TO_ADD or count < _LEAST_HALF or not result.bands:
        return []
    halves = result.bands_of_first(count) if result.kind == "band" else {}
    rows: list[list[Cell]] = []
    for name, band in result.bands.items():
        values = result.values(name)
        ends = (halves[name].lower, halves[name].upper) if name in halves else _extremes(values[:count], band)
        rows.append([name, *_compared(ends, band, values[count:])])
    caption = f"The first {count} runs alone, judged by the other {total - count}"
    blocks = [_table(caption, f"{count} runs", f"{total} runs", "other runs inside", rows)]
    if result.requirement is not None and result.requirement.independent:
        blocks.append(Text(f"Half the runs prove a mean coverage of {percent(mean_share(count))} only."))
    if math.isfinite(result.seconds):
        half, own, twice = (
            format_quantity(factor * result.seconds, "s", 2) for factor in (count / total, 1.0, 2.0)
        )
        text = (
            f"Half the runs would have taken {half} in place of {own}; twice as many would take about "
            f"{twice}. What the second half of the runs changed is the best guess of what another doubling "
            f"would: it was not measured. {_HOW_TO_ADD[result.kind]}"
        )
        blocks.append(Text(text))
    return blocks


_HOW_TO_ADD = {
    "band": "More runs continue this study and repeat none.",
    "sample": "More runs repeat the study.",
}


def _table(caption: str, other: str, own: str, judged: str, rows: list[list[Cell]]) -> Block:
    """Mean widths of two ways to make a band, how they differ, and what judges the other one."""
    head = ["output", f"mean width, {other}", f"mean width, {own}", "change", judged]
    return Table(caption, head, rows)


def _extremes(runs: Array, band: Band) -> tuple[Array, Array]:
    """The least and the largest values of some runs and the nominal one."""
    runs = np.concatenate([runs, band.nominal[None]])
    return runs.min(axis=0), runs.max(axis=0)


def _compared(ends: tuple[Array, Array], band: Band, others: Array) -> list[Cell]:
    """The widths of other bounds and of a band, and the share of runs that are within the former."""
    inside = float(((others >= ends[0]) & (others <= ends[1])).mean())
    return [*_widths(ends, band), f"{math.floor(1e4 * inside) / 1e2:g} %"]


def _widths(ends: tuple[Array, Array], band: Band) -> list[Cell]:
    """Mean width of other bounds and of the band, and by how much the first differs."""
    other, own = float((ends[1] - ends[0]).mean()), float(band.width.mean())
    change = "-" if own <= 0.0 else f"{100.0 * (other / own - 1.0):+z.1f} %"
    return [format_quantity(other, band.unit), format_quantity(own, band.unit), change]


def _by(counts: Iterable[int]) -> str:
    return " x ".join(map(str, counts))


def _fewer_values(result: StudyResult) -> list[Block]:
    """The extremes of a scan over every second value of each parameter, beside those of all its runs."""
    if result.kind != "scan" or not result.bands:
        return []
    by_angle = any(band.angle is not None for band in result.bands.values())
    if result.failures or max(result.nodes) < 3 or by_angle:
        return [
            Text(
                "What a scan of fewer values would give is not said: that takes at least three values of a "
                "parameter, all runs, and bands over time."
            )
        ]
    # Both ends stay, since a response that grows with a parameter is largest there.
    kept = [np.linspace(0, count - 1, (count + 2) // 2).round().astype(int) for count in result.nodes]
    chosen = np.zeros(result.nodes, dtype=bool)
    chosen[np.ix_(*kept)] = True
    few = chosen.ravel()
    rows: list[list[Cell]] = []
    for name, band in result.bands.items():
        runs = band.runs[: few.size]
        rows.append([name, *_compared(_extremes(runs[few], band), band, runs[~few])])
    values, own = _by(map(len, kept)), _by(result.nodes)
    caption = (
        f"The {few.sum()} runs at {values} of the {own} values alone, judged by the other {(~few).sum()}"
    )
    text = (
        "A scan is an inner bound: runs between its values may leave it, and how far is not known. Where the "
        "width hardly changes and nearly all other runs are inside, more values would change little; "
        "where they are not, more of them are needed, or bands that say how far a further run may go "
        "(kind band)."
    )
    return [_table(caption, f"{values} values", f"{own} values", "other runs inside", rows), Text(text)]


def _lower_degree(result: StudyResult) -> list[Block]:
    """The bounds of polynomials of one degree less on the same runs, beside those of the study."""
    if result.degrees is None or result.failures or not result.bands or max(result.degrees) < 2:
        return []
    degrees = tuple(max(1, degree - 1) for degree in result.degrees)
    rows: list[list[Cell]] = []
    for name, band in result.bands.items():
        grid = band.runs[: math.prod(result.nodes)]
        ends = Surrogate.fit(result.intervals, result.nodes, degrees, grid).bounds(result.bounds)
        error = "-" if math.isnan(band.margin.error) else f"{100.0 * band.margin.error:.2g} %"
        rows.append([name, *_widths(ends, band), error])
    caption = (
        "One degree less on the same runs; the error is that at runs left out, over the width of the runs"
    )
    beside = len(result.parameters) + 1 - math.prod(result.nodes)
    fewer, more = (math.prod(nodes + step for nodes in result.nodes) + beside for step in (-1, 1))
    text = (
        f"A degree less would need {fewer} runs in place of {len(result.parameters) + 1}, one more "
        f"{more}. Where the width hardly changes and the error is small, the degree is high enough. "
        "Where both are large, no affordable degree follows the response; bands of all runs (kind band) "
        "and features need none that does."
    )
    less, own = f"degree {_by(degrees)}", f"degree {_by(result.degrees)}"
    return [_table(caption, less, own, "error of the study", rows), Text(text)]
