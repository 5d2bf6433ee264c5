"""``chebclear report``: a report of a saved result."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...errors import ArgumentError
from ...loading import load_result
from ...report.html import Reported
from ...run.trajectory import Trajectory
from ...study.results import StudyResult
from ..options import DIRECTORY, Command, Kind, Option, file
from ..output import require_writable, tell


def report(options: argparse.Namespace) -> None:
    """Run the command."""
    path = options.to or (options.out or options.result.parent) / f"{options.result.stem}.html"
    if options.out and not options.to:
        options.out.mkdir(parents=True, exist_ok=True)
    require_writable(path.parent)
    result = load_result(options.result)
    if not isinstance(result, Trajectory | Reported):
        what = f"a {type(result).__name__}, which has no report: see it in Python with load_result(...)"
        raise ArgumentError(f"{options.result} holds {what}")
    if options.check and not isinstance(result, StudyResult):
        options.usage_error("argument --check: is for results of studies, which have runs at one tolerance")
    further = {"check": True} if options.check else {}
    written = result.report(path, title=options.title, **further)
    tell(options, {"file": str(written)}, f"wrote    {written}")


COMMANDS = {
    "report": Command(
        report,
        "Write one HTML file that needs no network: the answer, the mechanism, the main numbers and what is "
        "not known on one screen; bands, verdicts, warnings and cost unfold below.",
        "chebclear report results/study.npz --to press.html --title 'How far does the ram move?'",
        [
            Option("result", Kind("RESULT", file), "an .npz file that a command or save wrote"),
            Option("--to", Kind("FILE", Path), "where to (default: RESULT with .html)"),
            Option("--out", DIRECTORY, "directory for it without --to (default: that of RESULT)"),
            Option("--title", Kind("TEXT"), "the heading: the question in words"),
            Option(
                "--check",
                None,
                "simulate the nominal mechanism at other tolerances of the integrator, and say what these "
                "give; without it no run is made",
            ),
        ],
    )
}
