"""``chebclear scan`` and ``sweep``: brute force over the parameters; the settled motion over one of them."""

from __future__ import annotations

import argparse
import dataclasses
from functools import partial

import numpy as np

from ...base.quantities import Interval
from ...base.shown import meant_or_known
from ...report.document import Document
from ...study.report.sweep import sweep_document
from ...study.study import Study
from ...templates.reader import load
from ...templates.template import Template
from ..bands import hand_over
from ..options import COUNT, MEANS, NAME, OUTPUTS, SCENE, SETTINGS, THREADS, Command, Kind, Option, out
from ..output import require_writable
from ..scenes import changes_of, progress_of, settings_of, template_of
from .study import STUDY_FILES, carry_out, study_of


def scan(options: argparse.Namespace) -> int:
    """Run the command."""
    made, title = study_of(options)
    return carry_out(made, "scan", {"points": options.points}, options, title)


def sweep(options: argparse.Namespace) -> None:
    """Run the command."""
    template = template_of(options)
    if not template.features:
        options.usage_error(
            'of what? give the file a table [features], as in stroke = "peak_to_peak(slider.x)"'
        )
    require_writable(options.out)
    if options.parameter not in template.parameters:
        hint = meant_or_known(options.parameter, template.parameters)
        options.usage_error(f'argument NAME: the file has no parameter "{options.parameter}"{hint}')
    lower, upper = (_value(template, options, end) for end in (options.lower, options.upper))
    settings = settings_of(template, options) | {"features": template.features}
    means = {"threads": options.threads, "progress": progress_of(options)}
    study = Study(template, {options.parameter: Interval(lower, upper)}, **settings, **means)
    found = study.sweep(
        options.parameter,
        lower,
        upper,
        options.points,
        revolutions=options.revolutions,
        discard=options.discard,
        angle=options.angle,
    )
    columns = found.statistics
    rows = [dict(zip(columns, row, strict=True)) for row in np.column_stack(list(columns.values())).tolist()]
    facts = {
        "values": rows,
        "resonances": {name: [vars(one) for one in found.resonances(name)] for name in found},
        "lift_offs": [vars(one) for one in found.lift_offs],
        "notices": [dataclasses.asdict(one) for one in found.notices],
    }
    pictures = {name: partial(found.plot, name) for name in found}
    title = template.title or options.scene.name

    def document() -> Document:
        return sweep_document(found, title, template.scene())

    hand_over(options, found, "sweep", {"sweep": rows}, pictures, facts, document)


def _value(template: Template, options: argparse.Namespace, text: str) -> float:
    """A value of the parameter, read as the file is."""
    changed = load(options.scene, changes=changes_of(options) | {options.parameter: text})
    unit, known = changed.unit_of(options.parameter), template.unit_of(options.parameter)
    if unit not in ("", known):
        options.usage_error(f"{options.parameter} is in {known or 'no unit'}, got {text!r}")
    return changed.values()[options.parameter]


COMMANDS = {
    "scan": Command(
        scan,
        "Simulate a scene on equally spaced points of its parameters' intervals. The bands are the "
        "extremes of the runs: between the points an output may reach further.",
        "chebclear scan press.toml --points 5 --out results",
        [
            *SCENE,
            Option("--points", COUNT, "points of every parameter", 10),
            *(*SETTINGS, OUTPUTS, STUDY_FILES, *MEANS),
        ],
    ),
    "sweep": Command(
        sweep,
        "Simulate a scene at many values of one parameter of the file, such as the speed of its drive, until "
        "it has settled. Print for every entry of the table [features] how it varies from revolution to "
        "revolution, resonances, and where joints begin to lose contact.",
        "chebclear sweep press.toml crank_speed '60 rpm' '600 rpm' --points 55",
        [
            *SCENE,
            Option("parameter", NAME, "a parameter of the file"),
            Option("lower", Kind("FROM"), "its first value, as 20 or '60 rpm'"),
            Option("upper", Kind("TO"), "its last value"),
            Option("--points", COUNT, "number of equally spaced values", 41),
            Option("--revolutions", COUNT, "revolutions of each run whose features are found", 20),
            Option("--discard", COUNT, "revolutions before them, for the starting transient to decay", 10),
            Option("--angle", Kind("JOINT"), "joint whose revolutions count (default: the driven one)"),
            *SETTINGS,
            out("report.html, sweep.txt, the table of values (md, csv, json) and a PNG for every feature"),
            THREADS,
        ],
    ),
}
