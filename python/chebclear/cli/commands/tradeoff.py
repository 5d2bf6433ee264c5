"""``chebclear tradeoff``: accuracy against cost of runs."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

from ...mechanisms import slider_crank
from ...paper import case_study as paper
from ...run.settings import METHODS
from ...scene.scene import Scene
from ...templates.reader import loads
from ...templates.template import Template
from ...tradeoffs import report as tradeoff_output
from ...tradeoffs.of_scene import RTOLS, tradeoff
from ...tradeoffs.recommendation import COSTS, MOST_ACCURACY
from ..options import OUTPUTS, SCENE, SECONDS, TIMES, WORDS, Command, Kind, Option, out, positive, tolerances
from ..output import require_writable, tell
from ..scenes import changes_of, outputs_of, progress_of, settings_of, template_of

_CONVENTIONS = ("as_printed", "corrected")


def measured(options: argparse.Namespace) -> None:
    """Run the command."""
    scene, settings = _subject(options)
    # What would be refused after the runs is refused before them.
    if options.until is not None and options.until > settings["duration"]:
        options.usage_error(f"argument --until: must be <= the duration, {settings['duration']:g} s")
    require_writable(options.out)
    result = tradeoff(
        scene,
        **settings,
        methods=options.methods,
        rtols=RTOLS if options.rtols is None else options.rtols,
        progress=progress_of(options),
    )
    recommendation = result.recommendation(options.accuracy, until=options.until, cost=options.cost)
    if options.out is not None:
        tradeoff_output.write(result, recommendation, options.out)
    text = f"{result}\nRecommended: {recommendation}"
    text += "" if options.out is None else f"\nWrote {options.out}."
    tell(options, tradeoff_output.plain(result, recommendation), text)


def _subject(options: argparse.Namespace) -> tuple[Scene, dict[str, Any]]:
    """The scene, and how long and at which samples and outputs to compare."""
    if options.scene is None:
        template = _paper(options)
    elif options.paper is not None:
        options.usage_error("give either a scene or --paper")
    else:
        template = template_of(options)
    settings = outputs_of(template, settings_of(template, options), options)
    # Method and tolerances are what is to be found.
    kept = ("duration", "samples", "outputs", "skip", "max_steps", "max_events")
    return template.scene(), {name: settings[name] for name in kept if name in settings}


def _paper(options: argparse.Namespace) -> Template:
    """The paper's slider-crank, with the settings of its case study."""
    scene = slider_crank(convention=options.paper or _CONVENTIONS[0])
    settings = {"duration": paper.DURATION, "samples": paper.SAMPLES, "outputs": list(paper.OUTPUTS)}
    return loads(scene.to_json(), "slider_crank", changes={"run": settings, **changes_of(options)})


def _accuracy(text: str) -> float:
    number = positive(text)
    if number > MOST_ACCURACY:
        raise argparse.ArgumentTypeError(
            f"must be a part of the range, <= {MOST_ACCURACY:g}, got {text!r}: larger errors have no meaning"
        )
    return number


COMMANDS = {
    "tradeoff": Command(
        measured,
        "Simulate a scene with many methods and tolerances, compare with two tight runs, print costs, errors "
        "and the time until which each run can be trusted, and recommend a setting. Without a scene: the "
        "paper's slider-crank.",
        "chebclear tradeoff press.toml --rtols 1e-4,1e-6 --outputs ram.x",
        [
            *(replace(SCENE[0], nargs="?"), *SCENE[1:], *TIMES, OUTPUTS),
            Option("--paper", _CONVENTIONS, "which slider-crank to take (as_printed)"),
            Option("--methods", WORDS, f"integrators (default: {','.join(METHODS)})"),
            Option("--rtols", Kind("X,Y", tolerances), "relative tolerances (default: 1e-3 to 1e-8)"),
            Option(
                "--accuracy",
                Kind("X", _accuracy),
                "error that the recommended setting may have, relative to the range of each output",
                1e-3,
            ),
            Option(
                "--until",
                SECONDS,
                "time over which it may have it [s] (default: as far as the reference is known well enough)",
            ),
            Option("--cost", COSTS, "what is to be small", "seconds"),
            out("report.html, tradeoff.md, tradeoff.npz and tradeoff.png"),
        ],
    )
}
