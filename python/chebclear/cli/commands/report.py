"""``chebclear report``: a report of a saved result."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...errors import ArgumentError
from ...loading import load_result
from ...study.bifurcation import Bifurcation
from ...study.comparison import Comparison
from ...study.requirements.conformance import Conformance
from ..options import Commands, directory, file, new_command
from ..output import print_json, require_writable


def add(commands: Commands) -> None:
    """Add the command."""
    command = new_command(
        commands,
        "report",
        report,
        "write the report of a saved run, study or tradeoff",
        "Write one HTML file that needs no network: the answer, the mechanism, the main numbers and what is "
        "not known on one screen; bands, verdicts, warnings and cost unfold below.",
        "chebclear report results/study.npz --to press.html --title 'How far does the ram move?'",
    )
    command.add_argument(
        "result", type=file, metavar="RESULT", help="an .npz file that a command or save wrote"
    )
    command.add_argument("--to", type=Path, metavar="FILE", help="where to (default: RESULT with .html)")
    command.add_argument(
        "--out", type=directory, metavar="DIR", help="directory for it without --to (default: that of RESULT)"
    )
    command.add_argument("--title", metavar="TEXT", help="the heading: the question in words")


def report(options: argparse.Namespace) -> int:
    """Run the command."""
    path = options.to or (options.out or options.result.parent) / f"{options.result.stem}.html"
    if options.out and not options.to:
        options.out.mkdir(parents=True, exist_ok=True)
    require_writable(path.parent)
    result = load_result(options.result)
    if isinstance(result, Bifurcation):
        what = "a bifurcation diagram, which has no report: draw it in Python with load_result(...).plot()"
        raise ArgumentError(f"{options.result} holds {what}")
    if isinstance(result, Comparison | Conformance):
        what = "a comparison of two studies" if isinstance(result, Comparison) else "shares in specification"
        what += ", which have no report: print them in Python with load_result(...)"
        raise ArgumentError(f"{options.result} holds {what}")
    written = result.report(path, title=options.title)
    if options.json:
        print_json({"file": str(written)})
    else:
        print(f"wrote    {written}")
    return 0
