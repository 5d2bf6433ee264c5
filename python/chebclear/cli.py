"""The command ``chebclear``."""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from .errors import ChebclearError, SceneError
from .records import package_version
from .simulation import LEAST_RTOL, MOST_RTOL
from .study import MOST_THREADS

EXIT_OK = 0
EXIT_FAILED = 1
EXIT_BAD_INPUT = 2  # also what argparse uses for bad arguments
EXIT_INTERRUPTED = 130  # 128 + SIGINT, as shells report it


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        The words after ``chebclear``; those of the process if not given.

    Returns
    -------
    int
        Exit code: 0 done, 1 failed, 2 bad scene or bad arguments, 130 interrupted by Ctrl-C.
    """
    try:
        return _paper(_parser().parse_args(arguments))
    except SceneError as error:
        print(error, file=sys.stderr)
        return EXIT_BAD_INPUT
    except (ChebclearError, OSError) as error:
        print(f"chebclear: {error}", file=sys.stderr)
        return EXIT_FAILED
    except KeyboardInterrupt:
        print("chebclear: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    from . import paper

    parser = argparse.ArgumentParser(
        prog="chebclear",
        description="Dynamics of planar mechanisms with joint clearance and interval parameters.",
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {package_version()}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    command = commands.add_parser(
        "paper",
        help="compute the case study: tables, figures, arrays",
        description="Compute the slider-crank case study of Xiang, Yan, Wu and Niu (2020): Tables 3 to 5, "
        "the numbers of its text and Figures 4 to 12, as printed in the paper and with corrections.",
    )
    command.add_argument(
        "--out",
        type=_directory,
        metavar="DIR",
        help="directory for PNGs, tables.md and results.npz (default: paper_results; no files with --json)",
    )
    command.add_argument("--json", action="store_true", help="print one JSON object and nothing else")
    command.add_argument(
        "--threads", type=_threads, metavar="N", help="threads for the simulations (default: all processors)"
    )
    command.add_argument(
        "--rtol",
        type=_tolerance,
        default=paper.RTOL,
        metavar="X",
        help=f"relative tolerance of the integrator, {LEAST_RTOL:g} to {MOST_RTOL:g} (default: %(default)g)",
    )
    command.add_argument("--no-figures", action="store_true", help="write the tables and arrays only")
    return parser


def _paper(options: argparse.Namespace) -> int:
    """``chebclear paper``."""
    # Imported here so that Ctrl-C on the way is answered as at any other time.
    from . import paper, paper_output

    study = paper.case_study(rtol=options.rtol, threads=options.threads)
    out = options.out if options.out is not None or options.json else Path("paper_results")
    drawing = 0.0
    if out is not None:
        start = time.perf_counter()
        paper_output.write(study, out, figures=not options.no_figures)
        drawing = time.perf_counter() - start
    if options.json:
        print(json.dumps(study.to_dict(), allow_nan=False))
        return EXIT_OK
    print(paper_output.summary(study))
    if out is not None:
        print(f"Wrote {out} in {drawing:.1f} s.")
    return EXIT_OK


def _directory(text: str) -> Path:
    path = Path(text)
    if path.exists() and not path.is_dir():
        raise argparse.ArgumentTypeError(f"must be a directory, {text!r} is a file")
    return path


def _threads(text: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = 0
    if not 1 <= number <= MOST_THREADS:
        raise argparse.ArgumentTypeError(f"must be a whole number from 1 to {MOST_THREADS}, got {text!r}")
    return number


def _tolerance(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not LEAST_RTOL <= number <= MOST_RTOL:
        raise argparse.ArgumentTypeError(
            f"must be a number from {LEAST_RTOL:g} to {MOST_RTOL:g}, got {text!r}"
        )
    return number


if __name__ == "__main__":
    sys.exit(main())
