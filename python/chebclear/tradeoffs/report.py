"""The report of accuracy against cost."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from ..plots.costs import plot_tradeoff
from ..plots.drawing.scene import mechanism_picture
from ..report.document import Document, Picture, Section, Table, Text
from ..run.report import reproduction, run_script, version_fact, warnings_section

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .result import Tradeoff

ACCURACIES = (1e-1, 1e-2, 1e-3, 1e-4)
"""Largest errors, relative to the range of each output, that a report recommends settings for [-]."""


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
        Picture(f"Cost against the error of {name}, a line for each method.", partial(_costs, result, name))
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
            *warnings_section(result.warnings),
            reproduction(
                result.settings,
                result.scene,
                run_script(result.settings, result.outputs),
                "A script that simulates the reference",
            ),
        ],
    )


def _costs(result: Tradeoff, name: str, ax: Axes) -> None:
    plot_tradeoff(result, name, ax=ax)
