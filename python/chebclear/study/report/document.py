"""The report of a study, from its question to how it is reproduced."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ...base.prefixes import Form, format_exact, format_quantity, format_tolerance
from ...base.shown import capital, in_a_sentence, of_many
from ...plots.bands import band_picture
from ...plots.drawing.scene import mechanism_picture
from ...plots.features import plot_ranking
from ...report.document import Block, Cell, Document, Items, Moving, Picture, Section, Table, Text, Verdict
from ...run.report import costs_table, notices_section, reproduction, version_fact
from ..band.sure import Flag
from ..features.features import FeatureResult
from ..features.ranking import ranking_table
from ..requirements.document import requirements, shares_section, unproven
from .alternatives import alternatives
from .answer import (
    JUDGMENTS,
    features_of,
    main_numbers,
    sentences,
    unknown,
    widest_of,
)
from .extent import place_of
from .film import study_film
from .script import study_listings

if TYPE_CHECKING:
    from ..results import StudyResult


# Lines of the table of main numbers on the first screen; the details have the others.
_MOST_LINES = 12

MEANINGS: dict[Flag, str] = {
    "proved": "independent runs prove it for parameters drawn uniformly from their intervals",
    "estimated": "runs that the bounds were made without are inside as often as was asked for, or a "
    "polynomial predicts them",
    "too few runs": "there are too few runs to show what was asked for, or none in a part of the intervals",
    "unknown": "nothing says how far mechanisms go that were not simulated",
}


def study_document(result: StudyResult, title: str | None, checked: Sequence[Block] = ()) -> Document:
    """The report of a study, with what was `checked` at other tolerances; see `StudyResult.report`."""
    conformance = result.conformance
    bands = result.bands
    names = [*bands, *result.features.names]
    counted = f"{len(result.parameters)} runs and the nominal one"
    time = [f"{format_quantity(result.seconds, 's', 2)} of runs"] if math.isfinite(result.seconds) else []
    subject = "The parameters and their intervals" if result.scene is None else "The tolerances"
    more = [*alternatives(result), *(checked or _unchecked(result))]
    outputs: list[Block] = [*main_numbers(result, _MOST_LINES)]
    outputs += [
        dataclasses.replace(band_picture(band), caption=widest_of(result, band)) for band in bands.values()
    ]
    return Document(
        title=title
        or f"How far {'does' if len(names) == 1 else 'do'} {in_a_sentence(names)} move over the tolerances?",
        facts=[_method(result), counted, *time, version_fact()],
        answer=sentences(result),
        first=[*_moving(result), *requirements(conformance), *main_numbers(result, end=_MOST_LINES)],
        doubts=[*unproven(conformance), *unknown(result)],
        sections=[
            *([shares_section(conformance)] if conformance is not None else []),
            Section(subject, [_parameters(result)]),
            *([Section("How far the outputs move", outputs)] if bands else []),
            *(_feature(one) for one in features_of(result)),
            *([Section("Worst cases", [_worst_cases(result)])] if bands else []),
            *([Section("How sure this is", sure)] if (sure := _how_sure(result)) else []),
            *([Section("What a tighter or a cheaper setting would give", more)] if more else []),
            *_again(result),
            *notices_section(result.notices),
        ],
    )


def _unchecked(result: StudyResult) -> list[Block]:
    """How to ask what another tolerance of the integrator would give."""
    if result.settings is None or result.scene is None or not result.bands:
        return []
    return [
        Text(
            "What another tolerance of the integrator would give takes further runs of the nominal "
            "mechanism: chebclear report FILE --check, or report(path, check=True) in Python, makes them."
        )
    ]


def _moving(result: StudyResult) -> list[Block]:
    """The drawing of the mechanism, which moves with the bands."""
    still = None if result.scene is None else mechanism_picture(result.scene)
    if result.bands:
        return [Moving(still, partial(study_film, result))]
    return [] if still is None else [still]


def _again(result: StudyResult) -> list[Section]:
    """How to make a study of scenes again; of a model of the user's own there is nothing to say."""
    if result.settings is None or result.scene is None:
        return []
    costs = [costs_table(result.stats)] if result.stats else []
    return [reproduction(result.settings, result.scene, *study_listings(result), costs)]


def _method(result: StudyResult) -> str:
    """How the bands were made, in a few words."""
    if result.degrees is not None:
        return f"Chebyshev polynomials of degree {' x '.join(map(str, result.degrees))}"
    if result.requirement is not None:
        return "extremes of independent runs" if result.requirement.independent else "estimated bands"
    return "scan of a grid" if result.kind == "scan" else "random runs"


def _parameters(result: StudyResult) -> Table:
    """The box."""
    rows: list[list[Cell]] = []
    units = [result.units.get(name, "") for name in result.intervals]
    for (name, side), unit in zip(result.intervals.items(), units, strict=True):
        size, written = max(abs(side.lower), abs(side.upper)), result.written_for(name)
        nominal, tolerance = format_tolerance(side, unit, written)
        lower, upper = (format_exact(end, unit, size, written) for end in (side.lower, side.upper))
        rows.append([name, lower, nominal, upper, tolerance])
    told = "" if all(units) else " in SI units" if result.scene is not None else " in their own units"
    caption = f"The parameters and their intervals{told}"
    return Table(caption, ["parameter", "from", "nominal", "to", "tolerance"], rows)


def _feature(feature: FeatureResult) -> Section:
    """The section of a feature."""
    reach = feature.interval
    ends = reach.lower, reach.upper
    form = Form.of(ends, feature.unit, feature.written)
    told = f"{form.range(*ends)} ({reach.verdict}). {capital(str(reach.sure))}"
    if not math.isnan(reach.tolerated):
        told += f"; at least {of_many(reach.tolerated)} of all with 95 % confidence"
    blocks: list[Block] = [Text(f"{told}.")]
    try:
        ranking = feature.ranking()
    except ValueError as error:  # too few runs
        blocks.append(Text(f"No ranking of the tolerances: {error}."))
        return Section(f"Feature: {feature.name}", blocks)
    blocks += [
        ranking_table(ranking),
        Items([f"{sentence}." for sentence in (*ranking.reservations(), *ranking.advice())]),
        Picture(
            f"Bars of what halving each tolerance does to {ranking.feature}: most by "
            f"{ranking.rows[0].parameter}, {ranking.rows[0].narrowing}.",
            partial(plot_ranking, ranking),
            height=1.0 + 0.3 * len(ranking),
        ),
    ]
    return Section(f"Feature: {feature.name}", blocks)


def _worst_cases(result: StudyResult) -> Table:
    """The runs in which each output was largest and smallest, and their parameters."""
    rows = []
    sides = list(result.intervals.values())
    for name, band in result.bands.items():
        form = Form.of((float(band.runs.min()), float(band.runs.max())), band.unit, band.written)
        for word, find in (("largest", np.argmax), ("smallest", np.argmin)):
            run, sample = np.unravel_index(int(find(band.runs)), band.runs.shape)
            rows.append(
                [
                    name,
                    word,
                    form.text(float(band.runs[run, sample])),
                    place_of(band, int(sample)),
                    # So that runs near a corner of the box are seen.
                    *(
                        f"{100.0 * (value - side.midpoint) / side.half_width:+.0f} %"
                        for value, side in zip(band.parameters[run].tolist(), sides, strict=True)
                    ),
                ]
            )
    head = ["output", "case", "simulated there", "at", *result.intervals]
    words = "each parameter from -100 % at the lower to +100 % at the upper end of its interval"
    return Table(f"The extreme runs of each output; {words}", head, rows)


def _how_sure(result: StudyResult) -> list[Block]:
    """What the runs show of each band and prove, what the verdicts mean, and the statement for them."""
    if not result.bands:
        return []
    rows: list[list[Cell]] = []
    for name, band in result.bands.items():
        error = "-" if math.isnan(band.margin.error) else f"{100.0 * band.margin.error:.2g} %"
        flag = Verdict(band.verdict, JUDGMENTS[band.verdict])
        rows.append([name, flag, str(band.sure), of_many(band.tolerated), error])
    head = [
        "output",
        "how sure",
        "why",
        "inside at an instant, 95 % sure",
        "error of the polynomial, of the width",
    ]
    said = [flag for flag in MEANINGS if any(band.verdict == flag for band in result.bands.values())]
    blocks: list[Block] = [
        Table("What the runs show of each output", head, rows),
        Items([f"{flag}: {MEANINGS[flag]}." for flag in said]),
    ]
    return blocks if result.statement is None else [*blocks, Text(result.statement)]
