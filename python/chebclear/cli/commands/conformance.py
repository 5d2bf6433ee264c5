"""``chebclear conformance``, ``contrast``, ``allocate``: shares in specification, two designs, least cost."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ...decisions.allocation import allocate as cheapest_tolerances, allocation_document
from ...decisions.contrast import Difference, contrast as compare_designs
from ...decisions.contrast_report import contrast_document
from ...decisions.least_cost.search import expected_runs
from ...decisions.rare import rare_share
from ...decisions.rare_result import RareShare
from ...decisions.splitting import COUNTED
from ...report.document import Document
from ...study.requirements.conformance import Conformance, Share
from ...study.requirements.document import Tolerance, conformance_document, specification, what_to_do
from ...study.requirements.specification import ALL
from ...templates.reader import load
from ...templates.template import Template
from ..bands import EXIT_NOT_MET, hand_over, share_rows
from ..options import COUNT, MEANS, NUMBER, SCENE, SETTINGS, WORKBOOK, Command, Kind, Option, out
from ..output import require_writable
from ..scenes import changes_of, plan_of, study_settings, template_of


def conformance(options: argparse.Namespace) -> int:
    """Run the command."""
    template = template_of(options)
    if not template.requirements:
        options.usage_error(
            "what is required? give the file a table [requirements], as in reach = "
            '{ of = "slider.x", below = "170.1 mm" }'
        )
    if options.least is not None and not options.rare:
        # With none outside.
        rest = math.log(0.5 * (1.0 - options.confidence))
        needed = math.ceil(rest / math.log(options.least)) if 0.0 < options.least < 1.0 else 0
        if options.runs < needed:
            options.usage_error(
                f"{options.runs} runs cannot prove a share of {100.0 * options.least:g} %, not even with "
                f"none outside: it takes --runs {needed}, or --rare, which follows the worst runs"
            )
    require_writable(options.out)
    means = study_settings(template, options)
    only = sum(one.interval is not None and one.distribution is None for one in template.parameters.values())
    # The nominal values of what is only an interval, all corners and points inside.
    places = 1 + 2**only + options.inner if only else 1
    _planned(template, means, options.runs * places, options)
    if options.plan:
        return 0
    found = template.conformance(
        options.runs,
        failures=options.failures,
        width=options.width,
        inner=options.inner,
        confidence=options.confidence,
        rng=options.rng,
        **means,
    )
    rows, worst = share_rows(found), list(found.values())[-1]
    rare = _rare(template, found, options, means) if options.rare else {}
    least = 1.0 - rare[worst.name].upper if worst.name in rare else worst.lower
    poor = options.least is not None and least < options.least
    facts: dict[str, Any] = {"shares": rows, "seed": found.seed, "not_met": [worst.name] if poor else []}
    tables = {"conformance": rows}
    if options.rare:
        tables["rare"] = facts["rare"] = _rare_rows(rare)
    sides, more = tolerances_of(template, means), list(map(str, rare.values()))
    text = "\n".join(map(str, [*specification(found), *what_to_do(found, sides), found, *more]))

    def document() -> Document:
        return conformance_document(found, _titled(template, options), sides, template.scene(), more)

    hand_over(options, text, "conformance", tables, _plots(found), facts, document)
    if poor and not options.json:
        print(f"not at least {100.0 * options.least:g} %: {worst.name}")
    return EXIT_NOT_MET if poor else 0


def _rare(
    template: Template, found: Conformance, options: argparse.Namespace, means: Mapping[str, Any]
) -> dict[str, RareShare]:
    """The shares outside that are too rare to be counted, and not yet proven to be small enough."""
    study = template.study(**means)
    rare = {}
    for name, one in found.items():
        if one.outside >= COUNTED or (options.least is not None and one.lower >= options.least):
            continue
        asked = template.requirements if name == ALL else {name: template.requirements[name]}
        rare[name] = rare_share(study, asked, confidence=options.confidence, rng=options.rng)
    return rare


def _rare_rows(rare: Mapping[str, RareShare]) -> list[dict[str, Any]]:
    """A row for every share outside that is too rare to be counted."""
    return [
        {
            "requirement": name,
            "verdict": one.verdict,
            "reason": one.reason,
            "outside": one.share,
            "at least": one.lower,
            "at most": one.upper,
            "runs": one.runs,
            "causes": "; ".join(map(str, one.causes)),
        }
        for name, one in rare.items()
    ]


def contrast(options: argparse.Namespace) -> None:
    """Run the command."""
    templates = [template_of(options), load(options.second, changes=changes_of(options))]
    require_writable(options.out)
    studies = []
    for place, template in zip(("first", "second"), templates, strict=True):
        means = study_settings(template, options)
        # A store is that of one study.
        studies.append(template.study(**means | {"store": options.store and options.store / place}))
    if options.plan:
        # Each pair is a run of both designs.
        _planned(templates[0], study_settings(templates[0], options), 2 * options.runs, options)
        return
    found = compare_designs(
        studies[0],
        studies[1],
        templates[0].requirements or None,
        options.runs,
        confidence=options.confidence,
        rng=options.rng,
    )
    rows = [
        {
            "feature": name,
            "unit": one.unit,
            "difference": one.median,
            "at least": one.lower,
            "at most": one.upper,
            "smaller in": one.smaller,
            "pairs": len(one.first),
        }
        for name, one in found.features.items()
    ]
    shares = [
        {
            "requirement": name,
            "first": one.shares[0],
            "second": one.shares[1],
            "difference": one.difference,
            "at least": one.lower,
            "at most": one.upper,
            "pairs": one.pairs,
        }
        for name, one in found.requirements.items()
    ]
    tables = {name: some for name, some in (("features", rows), ("requirements", shares)) if some}
    facts = {"features": rows, "shares": shares, "changes": found.changes, "seed": found.seed}
    names, titles = _files(options), (templates[0].title, templates[1].title)
    if titles[0] != titles[1] and all(titles):
        names = titles[0], titles[1]

    def document() -> Document:
        return contrast_document(found, f"{names[0]} or {names[1]}: which is better?", names)

    hand_over(options, found, "contrast", tables, _plots(found.features), facts, document)


def allocate(options: argparse.Namespace) -> int | None:
    """Run the command."""
    template = template_of(options)
    for name in ("requirements", "costs"):
        if not getattr(template, name):
            options.usage_error(f"give the file a table [{name}]: chebclear fields {name} tells how")
    require_writable(options.out)
    means = study_settings(template, options)
    study = template.study(**means)
    if options.plan:
        _planned(template, means, expected_runs(study.runner, options.runs, options.share), options)
        return None
    found = cheapest_tolerances(
        study,
        template.costs,
        template.requirements,
        options.share,
        options.runs,
        confidence=options.confidence,
        rng=options.rng,
    )
    rows = [
        {
            "parameter": name,
            "unit": one.unit,
            "before": one.before,
            "after": one.after,
            "grade": one.grade,
            "cost before": one.cost_before,
            "cost after": one.cost_after,
        }
        for name, one in found.items()
    ]
    facts: dict[str, object] = {
        "status": found.status,
        "cost": found.cost,
        "saving": found.saving,
        "outside at most": None if found.rare is None else found.rare.upper,
        "seed": found.seed,
    }
    facts |= {"tolerances": rows, "shares": share_rows(found.verified)}
    tables, pictures = {"allocation": rows}, {"allocation": found.plot}
    title = f"{_titled(template, options)}: which tolerances cost least?"
    hand_over(
        options, found, "allocation", tables, pictures, facts, lambda: allocation_document(found, title)
    )
    return None if found.status in ("met", "always") else EXIT_NOT_MET


def _planned(template: Template, means: Mapping[str, Any], runs: int, options: argparse.Namespace) -> None:
    """Say what so many runs cost, if that is much or asked for."""
    # Without requirements, whose shares would be counted twice.
    study = template.study(**means, requirements=None)
    plan_of(study, "sample", {"runs": max(2, runs)}, options)


def _titled(template: Template, options: argparse.Namespace) -> str:
    """What the file is about."""
    return template.title or str(options.scene.name)


def _files(options: argparse.Namespace) -> tuple[str, str]:
    """The names of the two files; with their folders where they are the same."""
    names = options.scene.name, options.second.name
    return names if names[0] != names[1] else (str(options.scene), str(options.second))


def tolerances_of(template: Template, means: Mapping[str, Any]) -> dict[str, Tolerance]:
    """The tolerances of the parameters of a file."""
    runner = template.study(**means).runner
    return {
        name: Tolerance(side, runner.units.get(name, ""), runner.written_for(name))
        for name, side in runner.intervals.items()
    }


def _plots(found: Mapping[str, Share | Difference]) -> dict[str, Callable[..., object]]:
    return {name: one.plot for name, one in found.items()}


def _sure(held: str) -> list[Option]:
    """Options of what is drawn and how sure the intervals are; `held` is what an interval holds."""
    return [
        Option("--confidence", NUMBER, f"probability that an interval holds the true {held} [-]", 0.95),
        Option("--seed", COUNT, "seed of the draws", 0, dest="rng"),
    ]


COMMANDS = {
    "conformance": Command(
        conformance,
        "Draw mechanisms from the distributions of the parameters, simulate them, and print, for every entry "
        "of the table [requirements], the share that keeps to it, with an exact interval. Parameters are "
        "drawn that have a distribution; of those that are only intervals, the nominal values, the corners "
        "and points inside are taken, and the smallest and the largest share are reported.",
        "chebclear conformance examples/toggle_press.toml --runs 2000",
        [
            *SCENE,
            WORKBOOK,
            Option("--runs", COUNT, "mechanisms, or the most", 1000),
            Option(
                "--failures",
                COUNT,
                "end once so many mechanisms are outside of every requirement (default: make all runs)",
            ),
            Option("--width", NUMBER, "end once the interval of every share is as narrow [-]"),
            Option(
                "--inner",
                COUNT,
                "points inside the box of parameters that are only intervals, besides corners",
                0,
            ),
            *_sure("share"),
            Option(
                "--least",
                NUMBER,
                "exit with 3 unless the share of all requirements is at least this, with the confidence [-]",
            ),
            Option(
                "--rare",
                None,
                "where fewer than 50 of the runs are outside, follow the worst ones to shares of 1e-9: "
                "some 40,000 more for each requirement, and for all together",
            ),
            *SETTINGS,
            out(
                "report.html, conformance.txt, the table of shares (md, csv, json) and a PNG for every "
                "requirement"
            ),
            *MEANS,
        ],
    ),
    "contrast": Command(
        contrast,
        "Simulate the same mechanisms in the designs of two files: parameters of one name take the same "
        "places of their distributions. Print how features and the requirements of the first file differ, "
        "with exact intervals, and what differs in the two files.",
        "chebclear contrast press.toml longer_guide.toml --runs 200",
        [
            *SCENE,
            Option("second", Kind("SECOND", Path), "scene file of the second design"),
            Option("--runs", COUNT, "pairs of mechanisms", 200),
            *(*_sure("value"), *SETTINGS),
            out("report.html, contrast.txt, the table of features (md, csv, json) and a PNG for each"),
            *MEANS,
        ],
    ),
    "allocate": Command(
        allocate,
        "Find the tolerances, of the parameters in the table [costs], with which the share of the mechanisms "
        "keeps to the requirements at least cost, and prove it by fresh runs. Print them with what they "
        "cost, and the share with its interval.",
        "chebclear allocate press.toml --share 0.99",
        [
            *SCENE,
            WORKBOOK,
            Option("--share", NUMBER, "share of the mechanisms that keeps to all requirements [-]", 0.99),
            Option("--runs", COUNT, "runs that prove it", 2000),
            *(*_sure("share"), *SETTINGS),
            out("report.html, allocation.txt, the table of tolerances (md, csv, json) and a picture"),
            *MEANS,
        ],
    ),
}
