"""``chebclear study``: the bands of the outputs over the intervals of the parameters."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING, Any

from ...study.results import StudyResult
from ...study.study import Study
from ..bands import DEMANDS, finish
from ..options import (
    ASSIGNMENT,
    COUNT,
    MEANS,
    NUMBER,
    OUTPUTS,
    SCENE,
    SECONDS,
    SETTINGS,
    WORDS,
    WORKBOOK,
    Command,
    Kind,
    Option,
    file,
    out,
)
from ..output import require_writable
from ..scenes import outputs_of, plan_of, study_settings, template_of

if TYPE_CHECKING:
    from ...decisions.measured import Measured

# Which options each kind of study takes besides those of every one.
_KINDS = {
    "band": ("runs", "seconds", "coverage", "confidence", "rng", "revolutions", "discard"),
    "chebyshev": ("degree",),
    "sample": ("runs", "rng"),
}
STUDY_FILES = out("report.html, study.npz, the table of verdicts (md, csv, json) and a PNG for every output")


def study(options: argparse.Namespace) -> int:
    """Run the command."""
    given = {
        name: getattr(options, name)
        for names in _KINDS.values()
        for name in names
        if getattr(options, name) is not None
    }
    for name in given:
        if name not in _KINDS[options.kind]:
            kinds = " and ".join(kind for kind, names in _KINDS.items() if name in names)
            option = "seed" if name == "rng" else name
            options.usage_error(f"argument --{option}: is for --kind {kinds}, not for {options.kind}")
    if "discard" in given and "revolutions" not in given:
        options.usage_error("argument --discard: is for bands by crank angle, give --revolutions too")
    for name, needed in (("identify", "measured"), ("noise", "identify")):
        if getattr(options, name) and not getattr(options, needed):
            options.usage_error(f"argument --{name}: needs --{needed} too")
    trace = None
    if options.measured is not None:
        from ..traces import load_measured  # here alone: what it needs is large, and rarely wanted

        trace = load_measured(options.measured)
    made, title = study_of(options)
    template = template_of(options)
    drawn = any(one.distribution is not None for one in template.parameters.values())
    if template.requirements and not drawn and not options.quiet:
        print(
            "note: a share in specification takes distributions: give parameters one in the file, as in "
            'distribution = "normal"',
            file=sys.stderr,
        )
    return carry_out(made, options.kind, given, options, title, trace)


def carry_out(
    made: Study,
    method: str,
    given: dict[str, Any],
    options: argparse.Namespace,
    title: str,
    trace: Measured | None = None,
) -> int:
    """Say what a method of a study will cost if that is much, or if no more is wanted, and run it."""
    plan = plan_of(made, method, given, options)
    if options.plan:
        return 0
    result: StudyResult = getattr(made, method)(**given)
    followed = any(band.resolved and band.surrogate for band in result.values())
    check = getattr(options, "check", False)
    if check and not followed:
        print("warning: no output is resolved by a polynomial: --check finds no worst case", file=sys.stderr)
    fit = None
    if trace is not None:
        from ..traces import fit_of

        fit = fit_of(made, result, trace, options)
    return finish(result.check() if check and followed else result, options, title, plan, fit)


def study_of(options: argparse.Namespace) -> tuple[Study, str]:
    """The study of the file that was named, and its title; a usage error if the file has no intervals."""
    template = template_of(options)
    if not template.intervals:
        options.usage_error(
            "which parameters are uncertain? give one an interval in the table [parameters] of the file, as "
            "rel, plus and minus, or limits"
        )
    keywords = outputs_of(template, study_settings(template, options), options)
    require_writable(options.out)
    return template.study(**keywords), template.title or options.scene.name


COMMANDS = {
    "study": Command(
        study,
        "Simulate a scene at many points of its parameters' intervals and print, for every output, how far "
        "it reaches and how sure that is: band, the extremes of as many independent runs as it takes or, of "
        "fewer, widened by what runs that took no part exceed them by; chebyshev, the "
        "paper's polynomials; sample, the extremes of random runs. Of a file with a table [requirements] the "
        "share in specification comes first, from as many mechanisms again, drawn from the distributions, or "
        "from the runs themselves if these are such draws.",
        "chebclear study examples/slider_crank.toml --out results",
        [
            *SCENE,
            WORKBOOK,
            Option("--kind", list(_KINDS), "kind of study", "band"),
            Option(
                "--runs",
                COUNT,
                "runs of kinds band (default: as many as the coverage takes, 1999 for 0.999) and sample (81)",
            ),
            Option(
                "--seconds",
                SECONDS,
                "time after which kind band begins no further runs and answers from those made, as Ctrl-C "
                "does without --runs",
            ),
            Option(
                "--confidence",
                NUMBER,
                "probability with which the coverage is to hold at any one instant, of kind band",
            ),
            Option(
                "--coverage",
                NUMBER,
                "required coverage of a new run [-], of kind band (default: 0.999)",
            ),
            Option("--degree", COUNT, "degree of the polynomials of kind chebyshev (default: 3)"),
            Option("--seed", COUNT, "seed of the points of kinds band and sample (0)", dest="rng"),
            Option(
                "--revolutions",
                COUNT,
                "bands by crank angle, over so many revolutions of every run, of kind band",
            ),
            Option("--discard", COUNT, "revolutions before those of --revolutions (default: 1)"),
            Option(
                "--check",
                None,
                "simulate the worst cases that the polynomials predict, and print both; for the report, the "
                "nominal mechanism at other tolerances of the integrator",
            ),
            Option(
                "--require",
                list(DEMANDS),
                "exit with 3 if an output is less sure; estimated accepts proved, and wants the "
                "coverage to be shown",
            ),
            Option(
                "--measured",
                Kind("TRACE", file),
                "CSV file with t or angle and columns named as outputs, with their units, as in "
                "'t [ms],slider.ax [m/s2]': print which share of it is inside the bands, and where not",
            ),
            Option(
                "--identify",
                WORDS,
                "parameters to find from --measured, by the steady features of the file that it holds, or "
                "else the rms",
            ),
            Option(
                "--noise",
                ASSIGNMENT,
                "standard deviation of the noise in an output of --measured, as in slider.ax='30 m/s2'",
                repeated=True,
            ),
            *(*SETTINGS, OUTPUTS, STUDY_FILES, *MEANS),
        ],
    )
}
