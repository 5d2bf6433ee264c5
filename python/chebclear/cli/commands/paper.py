"""``chebclear paper``: the case study."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...base.writing import complete_folder
from ...run.settings import LEAST_RTOL, MOST_RTOL
from ..options import Commands, add_threads, directory, new_command, tolerance
from ..output import print_json, require_writable
from ..scenes import progress_of


def add(commands: Commands) -> None:
    """Add the command."""
    command = new_command(
        commands,
        "paper",
        paper,
        "compute the case study of the paper",
        "Compute the slider-crank case study of Xiang, Yan, Wu and Niu (2020): Tables 3 to 5 and the numbers "
        "of its text, as printed in the paper and with corrections.",
        "chebclear paper --out paper_results",
    )
    command.add_argument(
        "--out",
        type=directory,
        metavar="DIR",
        help="directory for tables.md (default: paper_results; no files with --json)",
    )
    add_threads(command)
    command.add_argument(
        "--rtol",
        type=tolerance,
        metavar="X",
        help=f"relative tolerance of the integrator, {LEAST_RTOL:g} to {MOST_RTOL:g} (default: the study's "
        "own)",
    )


def paper(options: argparse.Namespace) -> int:
    """Run the command."""
    # Imported here: the other commands need none of it, and Ctrl-C on the way is answered as at any time.
    from ...paper import case_study as paper, output as paper_output

    out = options.out if options.out is not None or options.json else Path("paper_results")
    require_writable(out)
    rtol = paper.RTOL if options.rtol is None else options.rtol
    study = paper.case_study(rtol=rtol, threads=options.threads, progress=progress_of(options))
    tables = paper_output.tables_markdown(study)
    if out is not None:
        with complete_folder(out) as folder:
            (folder / "tables.md").write_text(tables, encoding="utf-8")
    if options.json:
        print_json(study.to_dict())
        return 0
    print(f"{tables}\n{study.runs} simulations in {study.seconds:.2f} s (rtol {study.rtol:g}).")
    if out is not None:
        print(f"Wrote {out}.")
    return 0
