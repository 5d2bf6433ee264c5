"""Reports of accuracy against cost, and the files that ``chebclear tradeoff`` writes."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.writing import complete_folder
from ..plots.costs import plot_tradeoff
from ..plots.drawing.scene import mechanism_picture
from ..report.document import Document, Picture, Section, Table, Text
from ..run.report import notices_section, reproduction, run_script, version_fact

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from .bounds import StudyTradeoff
    from .recommendation import Recommendation
    from .result import Tradeoff

ACCURACIES = (1e-1, 1e-2, 1e-3, 1e-4)
"""Largest errors, relative to the range of each output, that a report recommends settings for [-]."""
WIDTH_ERRORS = (0.5, 0.25, 0.1, 0.05)
"""Largest relative errors of the width that a report recommends bounds for [-]."""

DPI = 150
_PANEL = (5.0, 5.0)  # [inch]


def tradeoff_document(result: Tradeoff, title: str | None) -> Document:
    """The report of accuracy against cost; see `Tradeoff.report`."""
    advice = {accuracy: str(result.recommendation(accuracy)) for accuracy in ACCURACIES}
    failed = [point for point in result.points if not point.success]
    doubts = [result.describe_reference()]
    if result.trusted_until < result.end:
        doubts.append(
            f"The two accurate runs agree up to {result.trusted_until:.4g} s of {result.end:.4g} s: beyond, "
            "no setting has a known error, and the motion is not predictable."
        )
    doubts += [
        f"{point.method} at rtol {point.rtol:g} ended early: {point.status} at {point.end_time:.4g} s."
        for point in failed
    ]
    head, rows = result.cells()
    pictures = [
        Picture(f"Cost against the error of {name}, a line for each method.", partial(result.plot, name))
        for name in result.hardest_outputs(2)
    ]
    return Document(
        title=title or "Which method and tolerance does this mechanism need?",
        facts=[f"{len(result.points)} runs compared", f"to {result.end:.4g} s", version_fact()],
        answer=[f"Errors up to {100.0 * part:g} % of the range: {text}." for part, text in advice.items()],
        doubts=doubts,
        sections=[
            Section("The mechanism", [mechanism_picture(result.scene)]),
            Section(
                "Accuracy against cost",
                [
                    Text("Errors are differences from the reference; ≤ marks those within its uncertainty."),
                    Table("Every setting with its cost and its errors", head, rows),
                    *pictures,
                ],
            ),
            *notices_section(result.notices),
            reproduction(
                result.settings,
                result.scene,
                run_script(result.settings, result.outputs),
                "A script that simulates the reference",
            ),
        ],
    )


def costs_document(result: StudyTradeoff, title: str | None) -> Document:
    """The report of bounds against runs; see `StudyTradeoff.report`."""
    answer = [f"Widths within {100.0 * part:g} %: {result.recommendation(part)}." for part in WIDTH_ERRORS]
    doubts = [
        f"The reference is what {result.reference_runs} runs reach together, an inner bound. Half of them, "
        f"drawn at random, reach less by {result.changes}: errors of that size mean nothing.",
        *(f"{point} failed: {point.status}." for point in result.points if point.status != "done"),
    ]
    head, rows = result.cells()
    pictures = [
        Picture(
            f"Error of the width of {name} against the number of runs, a line for each way of bounding.",
            partial(result.plot, name),
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
            *notices_section(result.notices),
        ],
    )


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

    names = result.hardest_outputs(4)
    columns = min(2, len(names))
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
