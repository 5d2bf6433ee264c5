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
import traceback
from collections.abc import Sequence

from ..base.files import package_version
from ..errors import ArgumentError, ChebclearError, InputError
from .commands import (
    animate,
    check,
    completion,
    conformance,
    fields,
    new,
    paper,
    report,
    run,
    scan,
    study,
    tradeoff,
)
from .ending import EXIT_INTERRUPTED, EXIT_TERMINATED, Terminated, terminable
from .output import plain_warnings
from .show import command as show
from .streams import shown_streams

EXIT_FAILED = 1
EXIT_BAD_INPUT = 2  # also what argparse uses for bad arguments
EXIT_DEFECT = 70  # "internal software error" of sysexits.h
EXIT_UNREAD = 141  # 128 + SIGPIPE, as shells report it

# In the order of the help: as one needs them.
_COMMANDS = (
    *(new, fields, check, show, run, study, conformance, scan, tradeoff),
    *(report, animate, paper, completion),
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; the exit code, see this module."""
    with shown_streams():
        return _run(list(sys.argv[1:] if arguments is None else arguments))


def _run(given: Sequence[str]) -> int:
    """Run the command that the words name; the exit code."""
    options = None
    try:
        try:
            options = parser().parse_args(given)
            with terminable(), plain_warnings(options.quiet):
                return int(options.run(options))
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


def parser() -> argparse.ArgumentParser:
    """The parser of all commands; completion scripts are made from it."""
    made = argparse.ArgumentParser(
        prog="chebclear",
        allow_abbrev=False,
        description="Dynamics of planar mechanisms with joint clearance and interval parameters.",
        epilog="Exit codes: 0 done, 1 failed, 2 wrong arguments or scene, 3 not as good as --require "
        "asks for, 70 a defect of this program, 130 interrupted.",
    )
    made.add_argument("--version", action="version", version=f"%(prog)s {package_version()}")
    made.set_defaults(parser=made)  # for completion
    commands = made.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for command in _COMMANDS:
        command.add(commands)
    return made
