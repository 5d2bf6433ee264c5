"""The program: its commands and exit codes.

Exit codes: 0 done; 1 failed, as a run that gave up or a file that cannot be written; 2 wrong arguments or a
wrong scene; 3 done, but not as good as ``--require`` asks for; 70 a defect of this program, with a traceback;
130 interrupted by Ctrl-C; 143 ended by SIGTERM; 141 nobody reads what is printed.
"""

from __future__ import annotations

import argparse
import os
import shlex
import sys
import time
import traceback
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

from ..errors import ArgumentError, ChebclearError, InputError
from .ending import EXIT_INTERRUPTED, EXIT_TERMINATED, Terminated, terminable
from .streams import plain_warnings, shown_streams

if TYPE_CHECKING:
    from .options import Command

EXIT_FAILED = 1
EXIT_BAD_INPUT = 2  # also what argparse uses for bad arguments
EXIT_DEFECT = 70  # "internal software error" of sysexits.h
EXIT_UNREAD = 141  # 128 + SIGPIPE, as shells report it

# What each command does in a line and the module that has it, imported where it is asked for; in the order of
# the help: as one needs them.
_COMMANDS = {
    "new": ("commands.new", "write a commented scene file of a ready-made mechanism to start from"),
    "fields": (
        "commands.fields",
        "list what may stand in a scene file: tables, types, fields with units and defaults",
    ),
    "check": (
        "commands.check",
        "check a scene file: its parts, what can move, what looks wrong, a picture",
    ),
    "workbook": (
        "commands.workbook",
        "write the parameters and requirements of a scene file as an Excel workbook",
    ),
    "show": ("show.command", "the mechanism in the browser: drag its crank and its parameters"),
    "run": ("commands.run", "simulate a scene once, at the nominal values of its parameters"),
    "study": (
        "commands.study",
        "how far the outputs move over the intervals of the parameters, and how sure that is",
    ),
    "conformance": (
        "commands.conformance",
        "what share of mechanisms keeps to the requirements, and how sure that is",
    ),
    "contrast": (
        "commands.conformance",
        "whether the design of a second file is better, and by how much",
    ),
    "allocate": ("commands.conformance", "the tolerances of least cost that keep the requirements"),
    "scan": ("commands.scan", "simulate on a grid of the parameters: inner bounds of the outputs"),
    "sweep": (
        "commands.scan",
        "at which speeds features of a revolution are large, scatter, or contact is lost",
    ),
    "tradeoff": ("commands.tradeoff", "measure accuracy against cost on a scene and recommend a setting"),
    "report": ("commands.report", "write the report of a saved run, study or tradeoff"),
    "animate": ("commands.animate", "simulate a scene and show it as a moving picture"),
    "paper": ("commands.paper", "compute the case study of the paper"),
    "completion": ("commands.completion", "print the script that completes this command in your shell"),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit code, see this module."""
    with shown_streams():
        return _run(list(sys.argv[1:] if arguments is None else arguments))


def _run(given: Sequence[str]) -> int:
    """Run the command that the words name; the exit code."""
    options, started = None, time.monotonic()
    try:
        try:
            with terminable():
                # The name of a command comes first, and no other one is imported.
                options = parser(given[:1]).parse_args(given, argparse.Namespace(started=started))
                with plain_warnings(options.quiet):
                    return int(options.run(options) or 0)
        finally:
            # Not left to the end of the process, which could only complain of a closed pipe.
            sys.stdout.flush()
    except BrokenPipeError:  # as in "chebclear ... | head -1"
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_UNREAD
    except InputError as error:
        print(error, file=sys.stderr)
        return EXIT_BAD_INPUT
    except ArgumentError as error:  # one that only the scene can judge, such as an unknown output
        print(f"chebclear: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except (ChebclearError, OSError, MemoryError) as error:
        print(f"chebclear: {str(error) or 'there is not enough memory'}", file=sys.stderr)
        return EXIT_FAILED
    except KeyboardInterrupt as interrupt:
        ended = isinstance(interrupt, Terminated)
        print(f"chebclear: {'ended' if ended else 'interrupted'}{_resumed(options, given)}", file=sys.stderr)
        return EXIT_TERMINATED if ended else EXIT_INTERRUPTED
    except Exception:
        traceback.print_exc()
        print(
            "chebclear: this is a defect of the program, not of what you gave it; please report it with the "
            "lines above and the file",
            file=sys.stderr,
        )
        return EXIT_DEFECT


def _resumed(options: argparse.Namespace | None, given: Sequence[str]) -> str:
    """How to go on where the runs of a study are kept."""
    if not hasattr(options, "store"):
        return ""
    if options is None or options.store is None:
        return "; no runs were kept, --store DIR keeps them"
    return f"; resume with: {shlex.join(['chebclear', *given])}"


def parser(wanted: Sequence[str] = tuple(_COMMANDS)) -> argparse.ArgumentParser:
    """The parser of all commands, with what those that are wanted take."""
    made = argparse.ArgumentParser(
        prog="chebclear",
        allow_abbrev=False,
        description="Dynamics of planar mechanisms with joint clearance and interval parameters.",
        epilog="Exit codes: 0 done, 1 failed, 2 wrong arguments or scene, 3 not as good as --require "
        "asks for, 70 a defect of this program, 130 interrupted.",
    )
    made.add_argument("--version", action=_Version, nargs=0, help="show the version of the program and exit")
    commands = made.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, (module, words) in _COMMANDS.items():
        # "--out" would be taken for "--outputs", and an abbreviation breaks when an option is added.
        command = commands.add_parser(name, help=words, formatter_class=_Formatter, allow_abbrev=False)
        if name not in wanted:
            continue
        known: dict[str, Command] = import_module(f".{module}", __package__).COMMANDS
        known[name].add_to(command)
        every = command.add_argument_group("options of every command")
        every.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
        every.add_argument(
            "--quiet", action="store_true", help="neither progress nor warnings on standard error, no hints"
        )
    return made


class _Version(argparse.Action):
    """Prints the version, which takes as long to find as all else here."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from ..base.files import package_version

        print(f"{parser.prog} {package_version()}")
        parser.exit()


class _Formatter(argparse.RawDescriptionHelpFormatter):
    """Keeps the lines of the example; fills those of the description."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        if text.startswith("example:"):
            return super()._fill_text(text, width, indent)
        return argparse.HelpFormatter._fill_text(self, text, width, indent)
