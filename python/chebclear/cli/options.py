"""Arguments that several commands share, and the types of their values."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from ..execution.options import MOST_THREADS
from ..run.settings import LEAST_RTOL, METHODS, MOST_RTOL

Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"
Command: TypeAlias = argparse.ArgumentParser


def new_command(
    commands: Commands,
    name: str,
    run: Callable[[argparse.Namespace], int],
    words: str,
    description: str,
    example: str,
) -> Command:
    """A command with its one-line and its full description, an example, and what every command takes."""
    command = commands.add_parser(
        name,
        help=words,
        description=description,
        epilog=f"example:\n  {example}",
        formatter_class=_Formatter,
        # "--out" would be taken for "--outputs", and an abbreviation breaks when an option is added.
        allow_abbrev=False,
    )
    command.set_defaults(run=run, usage_error=command.error)
    every = command.add_argument_group("options of every command")
    every.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    every.add_argument(
        "--quiet", action="store_true", help="neither progress nor warnings on standard error, no hints"
    )
    return command


class _Formatter(argparse.RawDescriptionHelpFormatter):
    """Keeps the lines of the example; fills those of the description."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        if text.startswith("example:"):
            return super()._fill_text(text, width, indent)
        return argparse.HelpFormatter._fill_text(self, text, width, indent)


def add_scene(command: Command, *, optional: bool = False) -> None:
    """The scene file and the values that replace some of its own."""
    command.add_argument(
        "scene",
        nargs="?" if optional else None,
        type=file,
        metavar="FILE",
        help="scene file: TOML, or JSON as Scene.to_json writes it",
    )
    command.add_argument(
        "--set",
        action="append",
        default=[],
        type=assignment,
        metavar="NAME=VALUE",
        help="replace a value of the file: a parameter, as in rod_length='130 mm', or any other by its path, "
        "as in joints.wrist.clearance=2e-4; may be given again",
    )


def add_settings(command: Command, *, single: bool = True, outputs: bool = True) -> None:
    """Settings that replace those of the table [run]: with method and tolerance if `single`."""
    command.add_argument(
        "--duration",
        metavar="T",
        help="simulated time [s], or with a unit as in '60 ms' (default: the file's)",
    )
    command.add_argument(
        "--skip", metavar="T", help="time simulated before the first sample [s] (default: the file's, or 0)"
    )
    command.add_argument("--samples", metavar="N", help="number of samples (default: the file's, or 1001)")
    if outputs:
        command.add_argument(
            "--outputs",
            type=words,
            metavar="A,B",
            help="outputs of interest, or patterns as 'wrist.*' (default: the file's, or the motion of what "
            "slides or swings, forces in clearance joints and driving torques)",
        )
    if single:
        command.add_argument("--method", choices=METHODS, help="integrator (default: the file's, or auto)")
        command.add_argument(
            "--rtol",
            type=tolerance,
            metavar="X",
            help=f"relative tolerance of the integrator, {LEAST_RTOL:g} to {MOST_RTOL:g} (default: the "
            "file's, or 1e-6; for kind band of a study 1e-4)",
        )


def add_out(command: Command, files: str) -> None:
    """The directory for files."""
    command.add_argument(
        "--out", type=directory, metavar="DIR", help=f"directory for {files} (default: no files)"
    )


def add_threads(command: Command) -> None:
    """How many threads simulate."""
    command.add_argument(
        "--threads", type=threads, metavar="N", help="threads for the simulations (default: all processors)"
    )


def add_means(command: Command) -> None:
    """Where the runs of a study are made, how long they may take, and what keeps them."""
    add_threads(command)
    command.add_argument(
        "--store",
        type=directory,
        metavar="DIR",
        help="folder that keeps every finished run: a study that was interrupted goes on from there "
        "(default: none)",
    )
    command.add_argument(
        "--run-seconds", type=positive, metavar="T", help="time after which a run is given up as failed [s]"
    )
    command.add_argument(
        "--max-seconds",
        type=positive,
        metavar="T",
        help="time after which no further runs are begun [s]; the result is made from those that are done",
    )
    command.add_argument(
        "--plan",
        action="store_true",
        help="only say how many runs, how long and how much memory and disk it takes, from a few runs",
    )


def directory(text: str) -> Path:
    """A directory, or what may become one."""
    if not text:
        raise argparse.ArgumentTypeError("must be a directory, got an empty name")
    path = Path(text)
    if path.exists() and not path.is_dir():
        raise argparse.ArgumentTypeError(f"must be a directory, {text!r} is a file")
    return path


def file(text: str) -> Path:
    """A file that exists."""
    path = Path(text)
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"must be a file, {text!r} is a directory")
    if not path.is_file():
        raise argparse.ArgumentTypeError(f"must be a file, there is none named {text!r}")
    return path


def assignment(text: str) -> tuple[str, str]:
    """Name and value of ``NAME=VALUE``."""
    name, sign, value = text.partition("=")
    if not sign or not name.strip() or not value.strip():
        raise argparse.ArgumentTypeError(f"must be NAME=VALUE, as in rod_length=0.13, got {text!r}")
    return name.strip(), value.strip()


def words(text: str) -> list[str]:
    """Words between commas."""
    return [word.strip() for word in text.split(",")]


def positive(text: str) -> float:
    """A finite number above 0."""
    number = _number(text)
    if not (math.isfinite(number) and number > 0.0):
        raise argparse.ArgumentTypeError(f"must be a finite number > 0, got {text!r}")
    return number


def tolerance(text: str) -> float:
    """A relative tolerance; whether the integrators accept it is left to them."""
    number = _number(text)
    if math.isnan(number):
        raise argparse.ArgumentTypeError(f"must be a number, got {text!r}")
    return number


def tolerances(text: str) -> list[float]:
    """Relative tolerances between commas."""
    return [tolerance(word) for word in text.split(",")]


def threads(text: str) -> int:
    """A number of threads."""
    number = _whole(text)
    if not 1 <= number <= MOST_THREADS:
        raise argparse.ArgumentTypeError(f"must be a whole number from 1 to {MOST_THREADS}, got {text!r}")
    return number


def count(text: str) -> int:
    """A whole number; whether it is large enough is left to what it is for."""
    number = _whole(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f"must be a whole number, got {text!r}")
    return number


def _number(text: str) -> float:
    try:
        return float(text) if text.isascii() else math.nan
    except ValueError:
        return math.nan


def _whole(text: str) -> int:
    try:
        return int(text) if text.isascii() else -1
    except ValueError:
        return -1
