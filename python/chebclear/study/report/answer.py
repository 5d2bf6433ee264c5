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
from ...report.document import Cell, Judgment, Table, Verdict
from ..band.band import Band
from ..band.sure import Flag, HowSure
from ..features.features import FeatureResult
from ..features.narrowing import ENDS
from ..requirements.conformance import in_percent
from .extent import extent, place_of, sampled_end

if TYPE_CHECKING:
    from ..features.ranking import Rank
    from ..requirements.conformance import Conformance, Share
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


def sentences(result: StudyResult) -> list[str]:
    """In specification or not, else how far the first output moves; the largest force; the tolerance."""
    conformance = result.conformance
    first = _movement(result) if conformance is None else [_specification(conformance)]
    told = [*first, *_force(result), *_tolerance(result, _judged(result, conformance))]
    return told or ["The study has neither outputs nor features."]


def _specification(conformance: Conformance) -> str:
    """The share in specification, and which requirement fails most often, by how much."""
    *each, every = conformance.values()
    least, most = map(in_percent, (every.lower, every.upper))
    sure = f"with {100.0 * every.confidence:.4g} % confidence"
    if every.outside == 0:
        what = f"None of {every.runs} mechanisms is out of specification"
        return f"{what}: at least {least} are in it {sure}."
    worst = max(each or [every], key=lambda one: one.outside)
    told = f"In specification are {in_percent(every.share)} of the mechanisms, "
    told += f"between {least} and {most} {sure}. {worst.name} fails in {worst.outside} of {worst.runs}"
    reached = _reached(worst)
    return f"{told}: {worst.specification}{reached and f', the worst reaches {reached}'}."


def _reached(share: Share) -> str:
    """The simulated value that is farthest outside of the limits, or nearest to them; empty if all failed."""
    if np.all(np.isnan(share.lowest)):
        return ""
    (lower, upper), lowest, highest = share.limits, np.nanmin(share.lowest), np.nanmax(share.highest)
    value = float(lowest if lower - lowest >= highest - upper else highest)
    known = [limit for limit in share.limits if math.isfinite(limit)]
    return Form.of((value, *known), share.unit, share.specification.written).text(value)


def requirements(conformance: Conformance | None) -> list[Table]:
    """A line for each requirement: share in specification, its interval, a verdict."""
    if conformance is None:
        return []
    rows: list[list[Cell]] = []
    for name, one in conformance.items():
        is_kept, is_one = one.outside == 0, len(conformance) == 1 or name != "all"
        verdict = Verdict(
            "kept" if is_kept else f"fails in {one.outside} of {one.runs}", "good" if is_kept else "bad"
        )
        limits, reached = (str(one.specification), _reached(one) or "-") if is_one else ("all of them", "-")
        shares = map(in_percent, (one.share, one.lower, one.upper))
        rows.append([name, limits, reached, *shares, verdict])
    head = ["requirement", "limits", "worst", "in specification", "at least", "at most", "verdict"]
    return [Table("The requirements", head, rows)]


def unproven(conformance: Conformance | None) -> list[str]:
    """What shares in specification do not say."""
    if conformance is None:
        return []
    *_, every = conformance.values()
    told = []
    if every.failed:
        told.append(f"{every.failed} mechanisms could not be simulated; they count as outside.")
    if len(every.at) > 1:
        sides = in_a_sentence(list(every.at[0]))
        told.append(
            f"Of {sides} only the interval is known: the shares hold at its middle and ends, not between."
        )
    return told


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
    if result.warnings:
        count = len(result.warnings)
        told.append(f"{count} {'warning is' if count == 1 else 'warnings are'} among the details.")
    return told


def widest_of(result: StudyResult, band: Band) -> str:
    """Where two mechanisms differ most, and how the bounds differ from the extremes between the samples."""
    text = f"{band.name}: two mechanisms differ most {_when(band)}."
    ends, drawn = extent(result, band)[:2], (float(band.lower.min()), float(band.upper.max()))
    if ends != drawn:
        form = Form.of((*ends, *drawn), band.unit, band.written)
        text += f" The bounds at each instant reach {form.range(*drawn)}, the extremes of a whole run "
        text += f"{form.range(*ends)}."
    return text
