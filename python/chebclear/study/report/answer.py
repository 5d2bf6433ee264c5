"""The first screen of a report: the answer in three sentences, the main numbers, and what is not known."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ...base.prefixes import Form, format_tolerance
from ...base.quantities import Interval
from ...base.shown import capital, in_a_sentence, of_many
from ...execution.failures import count_failed
from ...report.document import Cell, Judgment, Sentence, Table, Verdict
from ...run.report import notice_doubts
from ..band.band import Band
from ..band.sure import Flag, HowSure
from ..features.features import FeatureResult
from ..features.narrowing import ENDS
from ..requirements.document import Tolerance, specification, what_to_do
from .extent import extent, place_of, sampled_end

if TYPE_CHECKING:
    from ..features.ranking import Rank
    from ..requirements.conformance import Conformance
    from ..results import StudyResult

JUDGMENTS: dict[Flag, Judgment] = {
    "proved": "good",
    "estimated": "good",
    "too few runs": "fair",
    "unknown": "bad",
}

# What the weaker flags leave open, for a reader who knows mechanisms and no statistics.
_OPEN: dict[Flag, str] = {
    "too few runs": "too few mechanisms were simulated to say, as sure as was asked for, how far others go",
    "unknown": "the numbers are those of the simulated mechanisms; others between them may go farther",
}


HEAD = [
    "what",
    "nominal",
    "smallest",
    "largest",
    "differ by up to",
    "stay inside",
    "inside at an instant",
    "how sure",
]
"""Columns of the main numbers: what a further mechanism does, and how sure that is."""


def sentences(result: StudyResult) -> list[Sentence]:
    """Which requirement fails and what to do, else how far the first output moves; the largest force; the
    tolerance that matters most, where no other is to be changed."""
    conformance = result.conformance
    first: list[Sentence] = []
    todo: list[str] = []
    if conformance is None:
        first += _movement(result)
    else:
        todo = what_to_do(conformance, tolerances(result))
        first += [*specification(conformance), *todo]
    told = [*first, *_force(result)]
    if not todo:
        told += _tolerance(result, _judged(result, conformance))
    return told or ["The study has neither outputs nor features."]


def tolerances(result: StudyResult) -> dict[str, Tolerance]:
    """The tolerances of the parameters of a study."""
    return {
        name: Tolerance(side, result.units.get(name, ""), result.written_for(name))
        for name, side in result.intervals.items()
    }


def _movement(result: StudyResult) -> Iterator[str]:
    if result.bands:
        band = next(iter(result.bands.values()))
        verb = "reached" if band.verdict == "unknown" else "stays within"
        reach = extent(result, band)
        form = Form.of(reach, band.unit, band.written)
        text = f"{band.name} {verb} {form.range(reach.lower, reach.upper)} over the tolerances"
        if band.max_width > 0.0:
            width = form.difference(band.max_width)
            text += f"; two mechanisms differ by up to {width}, {_when(band)}"
        yield f"{text}."
    elif result.features:
        feature = result.features[result.features.names[0]]
        assert isinstance(feature, FeatureResult)
        text = Form.of(feature.ends, feature.unit, feature.written).range(*feature.ends)
        yield f"{feature.name} is within {text} over the tolerances."


def _when(band: Band) -> str:
    """Where two mechanisms differ most."""
    at = "at" if band.angle is None else "at a crank angle of"
    return f"{at} {place_of(band, int(np.argmax(band.width)))}"


def _force(result: StudyResult) -> Iterator[str]:
    """The force that is largest in magnitude, in either direction."""
    found = [(one.ends, one.name, one.nominal, one.written) for one in features_of(result) if one.unit == "N"]
    for band in result.bands.values():
        if band.unit == "N":
            reach = extent(result, band)
            found.append((reach[:2], band.name, np.array(reach[2:]), band.written))
    if found:
        ends, name, nominal, written = max(found, key=lambda one: max(map(abs, one[0])))
        values = [float(max(some, key=abs)) for some in (ends, nominal)]
        form = Form.of(values, "N", written)
        most, without = map(form.text, values)
        yield f"The largest force is {most}, {name}; without tolerances it is {without}."


def _tolerance(result: StudyResult, feature: FeatureResult | None) -> Iterator[str]:
    """The tolerance that narrows most what the reader asked for."""
    if feature is None:
        return
    try:
        ranking = feature.ranking()
    except ValueError:  # too few runs
        return
    first = ranking.rows[0]
    if first.helps:
        yield _halved(result, feature, first)
    elif ranking.scatter.value > 0.5:
        part = f"{100.0 * ranking.scatter.value:.0f} %"
        yield f"No tolerance matters much for {feature.name}: {part} of its spread is scatter of impacts."
    else:
        yield f"No single tolerance is certain to narrow the range of {feature.name}."


def _halved(result: StudyResult, feature: FeatureResult, rank: Rank) -> str:
    """What half the tolerance of a parameter makes of the spread of a feature."""
    name, side = rank.parameter, feature.intervals[rank.parameter]
    nominal = side.nominal
    half = Interval(nominal - 0.5 * (nominal - side.lower), nominal + 0.5 * (side.upper - nominal), nominal)
    unit, written = result.units.get(name, ""), result.written_for(name)
    (_, now), (_, then) = (format_tolerance(one, unit, written) for one in (side, half))
    wide = float(np.ptp(np.quantile(feature.values, ENDS)))
    # The least narrowing leaves the widest spread.
    left = [wide * (1.0 - by) for by in (rank.narrowing.value, rank.narrowing.upper, rank.narrowing.lower)]
    form = Form.of(feature.ends, feature.unit, feature.written)
    before, after, least, most = (form.difference(value) for value in (wide, *left))
    return (
        f"The tolerance of {name} matters most: with {then} instead of {now}, {feature.name} of 95 % of the "
        f"mechanisms spreads over {after} ({least} to {most}) instead of {before}."
    )


def _judged(result: StudyResult, conformance: Conformance | None) -> FeatureResult | None:
    """What breaks most requirements; the first feature that varies; the peak of a force, or of an output."""
    features = {one.name: one for one in features_of(result)}
    broken = [] if conformance is None else sorted(conformance.values(), key=lambda one: -one.outside)
    for share in broken:
        name, (lower, upper) = share.specification.quantity, share.limits
        if share.outside and name in features:
            return features[name]
        if share.outside and name in result.bands:
            # The side on which most are outside.
            low, high = (np.sum(share.lowest <= lower), np.sum(share.highest >= upper))
            return sampled_end(result, result.bands[name], "peak" if high >= low else "lowest")
    for one in features.values():
        if np.ptp(one.values) > 0.0:
            return one
    bands = [band for band in result.bands.values() if band.max_width > 0.0]
    bands.sort(key=lambda band: band.unit != "N")
    return sampled_end(result, bands[0], "peak") if bands else None


def features_of(result: StudyResult) -> list[FeatureResult]:
    """The features of a study."""
    found = (result.features[name] for name in result.features.names)
    return [one for one in found if isinstance(one, FeatureResult)]


def main_numbers(result: StudyResult, first: int = 0, end: int | None = None) -> list[Table]:
    """Features and outputs, a line each: nominal, smallest, largest, how sure; all of them, or a part."""
    rows: list[list[Cell]] = []
    for one in features_of(result):
        reach, nominal = one.interval, float(np.mean(one.nominal))
        form = Form.of((reach.lower, nominal, reach.upper), one.unit, one.written)
        numbers = map(form.text, (nominal, reach.lower, reach.upper))
        rows.append([one.name, *numbers, form.difference(reach.upper - reach.lower), *_sure(reach.sure)])
    for name, band in result.bands.items():
        ends = extent(result, band)
        form = Form.of(ends, band.unit, band.written)
        both = form.range(ends.nominal_lower, ends.nominal_upper)
        numbers, width = map(form.text, (ends.lower, ends.upper)), form.difference(band.max_width)
        rows.append([name, both, *numbers, width, *_sure(band.sure)])
    shown = rows[first:end]
    if not shown:
        return []
    more = len(rows) - first - len(shown)
    caption = "Further numbers over the tolerances" if first else "The main numbers over the tolerances"
    caption += f", from {len(result.parameters):,} runs"
    caption += f"; {more} more are in the details" if more else ""
    return [Table(caption, HEAD, shown)]


def _sure(sure: HowSure) -> list[Cell]:
    """How many further mechanisms stay inside, at all times and at any one, and how sure that is."""
    return [of_many(sure.whole), of_many(sure.instant), Verdict(sure.flag, JUDGMENTS[sure.flag])]


def unknown(result: StudyResult) -> list[str]:
    """What the study does not say."""
    told = []
    failed = count_failed(result.failures)
    if failed:
        count = failed + len(result.parameters) + 1
        told.append(
            f"{failed} of {count} mechanisms could not be simulated: nothing here holds for such mechanisms."
        )
    for flag, words in _OPEN.items():
        found = [name for name, band in result.bands.items() if band.verdict == flag]
        if found:
            told.append(f"{in_a_sentence(found)}: {words}.")
    known = [band.sure for band in result.bands.values() if math.isfinite(band.whole_run)]
    if known:
        told.append(f"{capital(str(min(known, key=lambda one: one.whole)))}.")
    # Those that failed, and bands of too few runs or without bounds, are said above.
    return told + notice_doubts(result.notices, said=("failed", "too_few_runs", "not_resolved"))


def widest_of(result: StudyResult, band: Band) -> str:
    """Where two mechanisms differ most, and how the bounds differ from the extremes between the samples."""
    text = f"{band.name}: two mechanisms differ most {_when(band)}."
    ends, drawn = extent(result, band)[:2], (float(band.lower.min()), float(band.upper.max()))
    if ends != drawn:
        form = Form.of((*ends, *drawn), band.unit, band.written)
        text += f" The bounds at each instant reach {form.range(*drawn)}, the extremes of a whole run "
        text += f"{form.range(*ends)}."
    return text
