"""What ``chebclear tradeoff`` writes: the table, the arrays, the work-precision plot, the report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.writing import complete_folder
from ..plots.costs import plot_tradeoff
from .recommendation import Recommendation
from .result import Tradeoff

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 150
_PANEL = (5.0, 5.0)  # [inch]
_COLUMNS = 2
_PANELS = 4


def write(result: Tradeoff, recommendation: Recommendation, directory: Path) -> None:
    """Write ``tradeoff.md``, ``tradeoff.npz``, ``tradeoff.png`` and ``report.html`` into a folder, which is
    made if it does not exist: all of them or none."""
    with complete_folder(directory) as folder:
        (folder / "tradeoff.md").write_text(markdown(result, recommendation), encoding="utf-8")
        result.save(folder / "tradeoff.npz")
        figure(result).savefig(folder / "tradeoff.png", dpi=DPI)
        result.report(folder / "report.html")


def markdown(result: Tradeoff, recommendation: Recommendation) -> str:
    """Reference, table and recommendation as Markdown."""
    return (
        f"# Accuracy against cost, {1e3 * result.duration:g} ms\n\n{result.describe_reference()}\n\n"
        f"{result.table()}\n\nErrors are the largest differences from the reference; a time depends on the "
        "machine, the counters do not. The horizon is the first sample that is off by more than 1 % of the "
        f"range of an output.\n\nRecommended: {recommendation}\n"
    )


def figure(result: Tradeoff) -> Figure:
    """The work-precision plots of up to four outputs; of more, the four with the largest errors."""
    from matplotlib.figure import Figure

    names = result.hardest_outputs(_PANELS)
    columns = min(_COLUMNS, len(names))
    rows = -(-len(names) // columns)
    made = Figure(figsize=(_PANEL[0] * columns, _PANEL[1] * rows), layout="constrained")
    for index, name in enumerate(names):
        plot_tradeoff(result, name, ax=made.add_subplot(rows, columns, index + 1))
    return made


def plain(result: Tradeoff, recommendation: Recommendation) -> dict[str, Any]:
    """What was measured, for JSON."""
    point = recommendation.point
    return {
        "reference": {
            "methods": [result.reference.method, result.check.method],
            "rtol": result.reference.rtol,
            "uncertainty": {name: result.uncertainty(name) for name in result.outputs},
            "trusted_until": result.trusted_until,
        },
        "runs": result.to_dict(),
        "recommendation": {
            "method": None if point is None else point.method,
            "rtol": None if point is None else point.rtol,
            "until": recommendation.until,
            "errors": recommendation.errors,
            "text": recommendation.text,
        },
    }
