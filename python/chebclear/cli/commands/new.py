"""``chebclear new``: a commented starter file."""

from __future__ import annotations

import argparse
import shlex
from importlib import resources
from pathlib import Path

from ...base.writing import replaced
from ..options import Command, Kind, Option, new_file
from ..output import tell


def new(options: argparse.Namespace) -> None:
    """Run the command."""
    path: Path = options.file
    if path.exists() and not options.force:
        options.usage_error(f"argument FILE: {str(path)!r} exists; replace it with --force")
    with replaced(path) as beside:
        beside.write_text(starter(options.mechanism), encoding="utf-8")
    hint = "" if options.quiet else f"\nnext     chebclear check {shlex.quote(str(path))}"
    tell(options, {"file": str(path)}, f"wrote    {path}{hint}")


_STARTERS = resources.files("chebclear.templates") / "starters"


def starter_names() -> tuple[str, ...]:
    """Names of the mechanisms with a starter file."""
    names = (entry.name for entry in _STARTERS.iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml")))


def starter(mechanism: str) -> str:
    """The text of a starter file; with it `loads` gives the mechanism with its default values."""
    return (_STARTERS / f"{mechanism}.toml").read_text(encoding="utf-8")


COMMANDS = {
    "new": Command(
        new,
        "Write a scene file of a ready-made mechanism: every number a named parameter with its unit, the "
        "uncertain ones with intervals, and comments. Change it into your own.",
        "chebclear new four_bar press.toml",
        [
            Option("mechanism", starter_names(), f"one of {', '.join(starter_names())}", metavar="MECHANISM"),
            Option("file", Kind("FILE", new_file(".toml")), "where to, such as press.toml"),
            Option("--force", None, "replace FILE if it exists"),
        ],
    )
}
