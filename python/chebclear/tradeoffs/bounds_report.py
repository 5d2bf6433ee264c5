"""The report of what bounds of a study cost and deliver."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from ..plots.costs import plot_study_tradeoff
from ..report.document import Document, Picture, Section, Table, Text
from ..run.report import version_fact, warnings_section

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .bounds import StudyTradeoff

WIDTH_ERRORS = (0.5, 0.25, 0.1, 0.05)
"""Largest relative errors of the width that a report recommends bounds for [-]."""


def costs_document(result: StudyTradeoff, title: str | None) -> Document:
    """The report of bounds against runs; see `StudyTradeoff.report`."""
    answer = [f"Widths within {100.0 * part:g} %: {result.recommendation(part)}." for part in WIDTH_ERRORS]
    changes = ", ".join(
        f"{name} {100.0 * change:.2g} %"
        for name, change in zip(result.outputs, result.reference_change, strict=True)
    )
    doubts = [
        f"The reference is what {result.reference_runs} runs reach together, an inner bound. Half of them, "
        f"drawn at random, reach less by {changes}: errors of that size mean nothing.",
        *_failed(result.points),
    ]
    head, rows = result.cells()
    pictures = [
        Picture(
            f"Error of the width of {name} against the number of runs, a line for each way of bounding.",
            partial(_costs, result, name),
        )
        for name in result.outputs[:4]
    ]
    return Document(
        title=title or "Which bounds does this study need, and how many runs?",
        facts=[f"{len(result.points)} settings compared", f"{result.holdout} hold-out runs", version_fact()],
        answer=answer,
        doubts=doubts,
        sections=[
            Section(
                "Accuracy against cost",
                [
                    Text(
                        "The error of the width is its mean over time, relative to that of the reference: "
                        "positive if too wide. The next columns are the share of hold-out samples inside, "
                        "how far they escape, and the error of the polynomial at them."
                    ),
                    Table("Every setting with its cost and what it delivers", head, rows),
                    *pictures,
                ],
            ),
            *warnings_section(result.warnings),
        ],
    )


def _failed(points: Sequence[Any]) -> list[str]:
    return [f"{point} failed: {point.status}." for point in points if point.status != "done"]


def _costs(result: StudyTradeoff, name: str, ax: Axes) -> None:
    plot_study_tradeoff(result, name, ax=ax)
