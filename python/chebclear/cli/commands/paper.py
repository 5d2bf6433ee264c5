"""``chebclear paper``: the case study."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...base.writing import complete_folder
from ...paper import case_study
from ...run.settings import LEAST_RTOL, MOST_RTOL
from ..options import DIRECTORY, THREADS, TOLERANCE, Command, Option
from ..output import require_writable, tell
from ..scenes import progress_of


def paper(options: argparse.Namespace) -> None:
    """Run the command."""
    out = options.out if options.out is not None or options.json else Path("paper_results")
    require_writable(out)
    rtol = case_study.RTOL if options.rtol is None else options.rtol
    study = case_study.case_study(rtol=rtol, threads=options.threads, progress=progress_of(options))
    tables = case_study.tables_markdown(study)
    if out is not None:
        with complete_folder(out) as folder:
            (folder / "tables.md").write_text(tables, encoding="utf-8")
    text = f"{tables}\n{study.runs} simulations in {study.seconds:.2f} s (rtol {study.rtol:g})."
    tell(options, study.to_dict(), text if out is None else f"{text}\nWrote {out}.")


COMMANDS = {
    "paper": Command(
        paper,
        "Compute the slider-crank case study of Xiang, Yan, Wu and Niu (2020): Tables 3 to 5 and the numbers "
        "of its text, as printed in the paper and with corrections.",
        "chebclear paper --out paper_results",
        [
            Option(
                "--out",
                DIRECTORY,
                "directory for tables.md (default: paper_results; no files with --json)",
            ),
            THREADS,
            Option(
                "--rtol",
                TOLERANCE,
                f"relative tolerance of the integrator, {LEAST_RTOL:g} to {MOST_RTOL:g} (default: the "
                "study's own)",
            ),
        ],
    )
}
