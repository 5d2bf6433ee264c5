"""The command ``chebclear``."""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from .base.files import package_version
from .errors import ChebclearError, InputError
from .run.settings import LEAST_RTOL, METHODS, MOST_RTOL
from .study.runs import MOST_THREADS
from .tradeoffs.recommendation import MOST_ACCURACY

EXIT_OK = 0
EXIT_FAILED = 1
EXIT_BAD_INPUT = 2  # also what argparse uses for bad arguments
EXIT_INTERRUPTED = 130  # 128 + SIGINT, as shells report it
EXIT_UNREAD = 141  # 128 + SIGPIPE, likewise


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        The words after ``chebclear``; those of the process if not given.

    Returns
    -------
    int
        Exit code: 0 done, 1 failed, 2 bad scene or bad arguments, 130 interrupted by Ctrl-C, 141 nobody reads
        what it prints.
    """
    try:
        try:
            options = _parser().parse_args(arguments)
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
    except (ChebclearError, OSError) as error:
        print(f"chebclear: {error}", file=sys.stderr)
        return EXIT_FAILED
    except KeyboardInterrupt:
        print("chebclear: interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="chebclear",
        description="Dynamics of planar mechanisms with joint clearance and interval parameters.",
    )
    parser.add_argument("--version", action="version", version=f"%(prog)s {package_version()}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _add_paper(commands)
    _add_tradeoff(commands)
    return parser


def _add_paper(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    from .paper import case_study as paper

    command = commands.add_parser(
        "paper",
        help="compute the case study: tables, figures, arrays",
        description="Compute the slider-crank case study of Xiang, Yan, Wu and Niu (2020): Tables 3 to 5, "
        "the numbers of its text and Figures 4 to 12, as printed in the paper and with corrections.",
    )
    command.set_defaults(run=_paper)
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


# Long because it lists the options of one command.
def _add_tradeoff(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    from .paper import case_study as paper
    from .tradeoffs.recommendation import COSTS

    command = commands.add_parser(
        "tradeoff",
        help="measure accuracy against cost on a scene and recommend a setting",
        description="Simulate a scene with many methods and tolerances, compare with two tight runs, print "
        "costs, errors and the time until which each run can be believed, and recommend a setting. "
        "Without a scene: the paper's slider-crank.",
    )
    command.set_defaults(run=_tradeoff, usage_error=command.error)
    command.add_argument(
        "scene", nargs="?", type=_file, metavar="SCENE.json", help="the scene, as Scene.to_json writes it"
    )
    command.add_argument(
        "--paper", choices=paper.CONVENTIONS, help="which slider-crank to take (default: as_printed)"
    )
    command.add_argument(
        "--duration",
        type=_positive,
        metavar="T",
        help=f"simulated time [s]; needed for a scene (the paper's: {paper.DURATION:g})",
    )
    command.add_argument(
        "--samples",
        type=int,
        metavar="N",
        help=f"number of samples at which errors are measured (default: 1001, the paper's: {paper.SAMPLES})",
    )
    command.add_argument(
        "--outputs",
        type=_words,
        metavar="A,B",
        help=f"outputs of interest (default: all, the paper's: {','.join(paper.OUTPUTS)})",
    )
    command.add_argument(
        "--methods", type=_words, metavar="A,B", help=f"integrators (default: {','.join(METHODS)})"
    )
    command.add_argument(
        "--rtols", type=_tolerances, metavar="X,Y", help="relative tolerances (default: 1e-3 to 1e-8)"
    )
    command.add_argument(
        "--accuracy",
        type=_accuracy,
        default=1e-3,
        metavar="X",
        help="error that the recommended setting may have, relative to the range of each output "
        "(default: %(default)g; at most 1)",
    )
    command.add_argument(
        "--until",
        type=_positive,
        metavar="T",
        help="time over which it may have it [s] (default: as far as the reference is known well enough)",
    )
    command.add_argument(
        "--cost", choices=COSTS, default="seconds", help="what is to be small (default: %(default)s)"
    )
    command.add_argument(
        "--out",
        type=_directory,
        metavar="DIR",
        help="directory for tradeoff.md, tradeoff.npz and tradeoff.png (default: no files)",
    )
    command.add_argument("--json", action="store_true", help="print one JSON object and nothing else")


def _paper(options: argparse.Namespace) -> int:
    """``chebclear paper``."""
    # Imported here so that Ctrl-C on the way is answered as at any other time.
    from .paper import case_study as paper
    from .paper import output as paper_output

    out = options.out if options.out is not None or options.json else Path("paper_results")
    if not _can_write(out):
        return EXIT_BAD_INPUT
    study = paper.case_study(rtol=options.rtol, threads=options.threads)
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


def _tradeoff(options: argparse.Namespace) -> int:
    """``chebclear tradeoff``."""
    from .mechanisms import slider_crank
    from .paper import case_study as paper
    from .scene.scene import Scene
    from .tradeoffs import output as tradeoff_output
    from .tradeoffs.of_scene import RTOLS, tradeoff

    if options.scene is None:
        scene = slider_crank(convention=options.paper or paper.CONVENTIONS[0])
        duration, samples, outputs = paper.DURATION, paper.SAMPLES, list(paper.OUTPUTS)
    elif options.paper is not None:
        options.usage_error("give either a scene or --paper")
    elif options.duration is None:
        options.usage_error("a scene needs --duration")
    else:
        scene = Scene.from_json(options.scene.read_text(encoding="utf-8", errors="replace"))
        duration, samples, outputs = options.duration, 1001, None
    duration = options.duration or duration
    # What would be refused after the runs is refused before them.
    if options.until is not None and options.until > duration:
        options.usage_error(f"argument --until: must be <= the duration, {duration:g} s")
    if not _can_write(options.out):
        return EXIT_BAD_INPUT
    try:
        result = tradeoff(
            scene,
            duration=duration,
            samples=samples if options.samples is None else options.samples,
            outputs=outputs if options.outputs is None else options.outputs,
            methods=options.methods,
            rtols=RTOLS if options.rtols is None else options.rtols,
            progress=None if options.json else True,
        )
        recommendation = result.recommendation(options.accuracy, until=options.until, cost=options.cost)
    except InputError:
        raise
    except ValueError as error:  # an argument that only the scene can judge, such as an unknown output
        print(f"chebclear: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    if options.out is not None:
        tradeoff_output.write(result, recommendation, options.out)
    if options.json:
        print(json.dumps(tradeoff_output.plain(result, recommendation), allow_nan=False))
        return EXIT_OK
    print(result)
    print(f"Recommended: {recommendation}")
    if options.out is not None:
        print(f"Wrote {options.out}.")
    return EXIT_OK


def _can_write(directory: Path | None) -> bool:
    """Whether files can be written there, said on standard error if not: before a long computation."""
    from .base.files import complete_folder

    if directory is None:
        return True
    try:
        with complete_folder(directory):
            pass
    except OSError as error:
        reason = error.strerror or error
        print(f"chebclear: cannot write to {str(directory)!r}: {reason}", file=sys.stderr)
        return False
    return True


def _directory(text: str) -> Path:
    if not text:
        raise argparse.ArgumentTypeError("must be a directory, got an empty name")
    path = Path(text)
    if path.exists() and not path.is_dir():
        raise argparse.ArgumentTypeError(f"must be a directory, {text!r} is a file")
    return path


def _file(text: str) -> Path:
    path = Path(text)
    if not path.is_file():
        raise argparse.ArgumentTypeError(f"must be a file, there is none named {text!r}")
    return path


def _words(text: str) -> list[str]:
    return [word.strip() for word in text.split(",")]


def _tolerances(text: str) -> list[float]:
    return [_tolerance(word) for word in text.split(",")]


def _positive(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number > 0.0):
        raise argparse.ArgumentTypeError(f"must be a finite number > 0, got {text!r}")
    return number


def _accuracy(text: str) -> float:
    number = _positive(text)
    if number > MOST_ACCURACY:
        raise argparse.ArgumentTypeError(
            f"must be a part of the range, <= {MOST_ACCURACY:g}, got {text!r}: larger errors have no meaning"
        )
    return number


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
