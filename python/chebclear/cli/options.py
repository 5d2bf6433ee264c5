"""What a command takes, as a table: its options, the kinds of their values, and those of several commands."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from ..base.units import UnitError, convert, is_quantity
from ..execution.options import MOST_THREADS
from ..run.settings import LEAST_RTOL, METHODS, MOST_RTOL


class Kind(NamedTuple):
    """A kind of values: what usage calls one, and what reads it."""

    metavar: str
    read: Callable[[str], Any] = str


@dataclass(frozen=True)
class Option:
    """An argument of a command."""

    name: str
    """``"--out"``, or ``"scene"`` of one that is given by its place."""
    kind: Kind | Sequence[str] | None
    """What it takes: a kind of values, one of some words, or nothing."""
    help: str
    """What it does; its default is added."""
    default: Any = None
    dest: str | None = None
    nargs: str | None = None
    metavar: str | None = None
    repeated: bool = False
    """Whether it may be given again."""

    def add_to(self, command: argparse.ArgumentParser) -> None:
        """Let a command take it."""
        given: dict[str, Any] = {"help": self.help, "default": self.default}
        if self.default is not None:
            given["help"] += " (default: %(default)s)"
        if self.kind is None:
            command.add_argument(self.name, action="store_true", help=self.help)
            return
        if isinstance(self.kind, Kind):
            given |= {"type": self.kind.read, "metavar": self.kind.metavar}
        else:
            given["choices"] = list(self.kind)
        optional = {"dest": self.dest, "nargs": self.nargs, "metavar": self.metavar}
        given |= {name: value for name, value in optional.items() if value is not None}
        if self.repeated:
            given |= {"action": "append", "default": []}
        command.add_argument(self.name, **given)


@dataclass(frozen=True)
class Command:
    """A command: what it does, and what it takes."""

    run: Callable[[argparse.Namespace], int | None]
    """Runs it; the exit code, if it is not 0."""
    description: str
    example: str
    """A command line."""
    options: Sequence[Option]
    """What it takes, besides what every command does."""

    def add_to(self, command: argparse.ArgumentParser) -> None:
        """Make a parser that of this command."""
        command.description, command.epilog = self.description, f"example:\n  {self.example}"
        command.set_defaults(run=self.run, usage_error=command.error)
        for option in self.options:
            option.add_to(command)


def directory(text: str) -> Path:
    """A directory, or what may become one."""
    if not text:
        raise argparse.ArgumentTypeError("must be a directory, got an empty name")
    path = Path(text)
    if path.exists() and not path.is_dir():
        raise argparse.ArgumentTypeError(f"must be a directory, {text!r} is a file")
    return path


def new_file(suffix: str) -> Callable[[str], Path]:
    """A file to be written, whose name ends so."""

    def read(text: str) -> Path:
        path = Path(text)
        if path.suffix != suffix:
            raise argparse.ArgumentTypeError(f"must end in {suffix}, got {text!r}")
        if path.is_dir():
            raise argparse.ArgumentTypeError(f"must be a file, {text!r} is a directory")
        if not path.parent.is_dir():
            raise argparse.ArgumentTypeError(f"there is no directory {str(path.parent)!r}")
        return path

    return read


def file(text: str) -> Path:
    """A file that exists."""
    path = Path(text)
    if path.is_dir():
        raise argparse.ArgumentTypeError(f"must be a file, {text!r} is a directory")
    if not path.is_file():
        what = "is a pipe or a device" if path.exists() else "does not exist"
        raise argparse.ArgumentTypeError(f"must be a file, {text!r} {what}")
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


def seconds(text: str) -> float:
    """A time above 0 [s], bare or with its unit."""
    if is_quantity(text):
        try:
            return positive(repr(convert(text, "s")))
        except UnitError as error:
            raise argparse.ArgumentTypeError(f"{text!r}: {error}") from None
    return positive(text)


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


COUNT = Kind("N", count)
NUMBER = Kind("X", positive)
SECONDS = Kind("T", seconds)
WORDS = Kind("A,B", words)
FILE = Kind("FILE", file)
DIRECTORY = Kind("DIR", directory)
NAME = Kind("NAME")
ASSIGNMENT = Kind("NAME=VALUE", assignment)
TOLERANCE = Kind("X", tolerance)

# The scene file and the values that replace some of its own.
SCENE = (
    Option("scene", FILE, "scene file: TOML, or JSON as Scene.to_json writes it"),
    Option(
        "--set",
        ASSIGNMENT,
        "replace a value of the file: a parameter, as in rod_length='130 mm', or any other by its path, as "
        "in joints.wrist.clearance=2e-4; may be given again",
        repeated=True,
    ),
)
WORKBOOK = Option(
    "--workbook",
    FILE,
    "Excel workbook whose sheets parameters and requirements replace those of the file, as the command "
    "workbook writes one; with --out a study writes workbook.xlsx with its results",
)
# Settings that replace those of the table [run].
TIMES = (
    Option("--duration", Kind("T"), "simulated time [s], or with a unit as in '60 ms' (default: the file's)"),
    Option("--skip", Kind("T"), "time simulated before the first sample [s] (default: the file's, or 0)"),
    Option("--samples", Kind("N"), "number of samples (default: the file's, or 1001)"),
)
OUTPUTS = Option(
    "--outputs",
    WORDS,
    "outputs of interest, or patterns as 'wrist.*' (default: the file's, or the motion of what slides or "
    "swings, forces in clearance joints and driving torques)",
)
SETTINGS = (
    *TIMES,
    Option("--method", METHODS, "integrator (default: the file's, or auto)"),
    Option(
        "--rtol",
        TOLERANCE,
        f"relative tolerance of the integrator, {LEAST_RTOL:g} to {MOST_RTOL:g} (default: the file's, or "
        "1e-6; for kind band of a study 1e-4)",
    ),
    Option("--max-step", Kind("T"), "longest step of the integrator [s] (default: the file's, or none)"),
)
THREADS = Option("--threads", Kind("N", threads), "threads for the simulations (default: all processors)")
# Where the runs of a study are made, how long they may take, and what keeps them.
MEANS = (
    THREADS,
    Option(
        "--store",
        DIRECTORY,
        "folder that keeps every finished run: a study that was interrupted goes on from there (default: "
        "none)",
    ),
    Option(
        "--run-seconds",
        SECONDS,
        "time after which a run is given up as failed [s], or with a unit as in '2 min'",
    ),
    Option(
        "--max-seconds",
        SECONDS,
        "time after which no further runs are begun [s]; the result is made from those that are done",
    ),
    Option(
        "--plan",
        None,
        "only say how many runs, how long and how much memory and disk it takes, from a few runs",
    ),
)


def out(files: str) -> Option:
    """The directory for files."""
    return Option("--out", DIRECTORY, f"directory for {files} (default: no files)")
