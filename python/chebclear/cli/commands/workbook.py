"""``chebclear workbook``: parameters and requirements of a scene file as an Excel workbook."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path

from ..options import SCENE, Command, Kind, Option, new_file
from ..output import tell
from ..scenes import template_of


def workbook(options: argparse.Namespace) -> None:
    """Run the command."""
    path: Path = options.book
    if path.exists() and not options.force:
        options.usage_error(f"argument BOOK: {str(path)!r} exists; replace it with --force")
    template = template_of(options)
    try:
        template.to_workbook(path)
    except ImportError as error:
        options.usage_error(str(error))
    named = f"{shlex.quote(str(options.scene))} --workbook {shlex.quote(str(path))}"
    hint = "" if options.quiet else f"\nnext     chebclear study {named}"
    tell(options, {"file": str(path)}, f"wrote    {path}{hint}")


COMMANDS = {
    "workbook": Command(
        workbook,
        "Write the parameters of a scene file (nominal, plus, minus, unit, distribution, ...) and its "
        "requirements as sheets of an Excel workbook. Change the tolerances there; study, conformance and "
        "allocate take them with --workbook.",
        "chebclear workbook examples/toggle_press.toml press.xlsx",
        [
            *SCENE,
            Option("book", Kind("BOOK", new_file(".xlsx")), "where to, such as press.xlsx"),
            Option("--force", None, "replace BOOK if it exists"),
        ],
    )
}
