"""The template of a scene file, with the replacements of the command line."""

from __future__ import annotations

import argparse
import shlex
from typing import Any

from ..templates.reader import load
from ..templates.template import Template

_SETTINGS = ("duration", "skip", "samples", "outputs", "method")
SAMPLES = 1001
"""Samples of a run whose file does not say."""


def template_of(options: argparse.Namespace) -> Template:
    """The template of the file that was named."""
    return load(options.scene, changes=changes_of(options))


def changes_of(options: argparse.Namespace) -> dict[str, Any]:
    """Values of a file that the command line replaces: options for single settings come last."""
    given = {f"run.{name}": getattr(options, name, None) for name in _SETTINGS}
    return dict(options.set) | {name: value for name, value in given.items() if value is not None}


def settings_of(template: Template, options: argparse.Namespace) -> dict[str, Any]:
    """Keywords of runs, from the file and the command line.

    Exits with a usage error if nothing says how long to simulate.
    """
    if "duration" not in template.run:
        options.usage_error("how long? give --duration, or duration in the table [run] of the file")
    rtol = getattr(options, "rtol", None)
    return {"samples": SAMPLES, **template.run} | ({} if rtol is None else {"rtol": rtol})


def progress_of(options: argparse.Namespace) -> bool | None:
    """Whether to show progress."""
    return None if options.json or options.quiet else True


def hint(options: argparse.Namespace, words: str) -> None:
    """Say which command could come next; ``FILE`` stands for the file."""
    if not options.quiet:
        print(f"next     {words.replace('FILE', shlex.quote(str(options.scene)))}")
