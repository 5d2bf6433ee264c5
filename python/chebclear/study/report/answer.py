"""The first screen of a report: the answer in three sentences, the main numbers, and what is not known."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ...base.prefixes import format_quantity, format_range
from ...base.shown import in_a_sentence
from ...execution.failures import count_failed
from ...report.document import Cell, Judgment, Table, Verdict
from ..band.band import Band
from ..band.margin import percent
from ..features.features import FeatureResult
from .extent import at_samples, extent, place_of, sampled_end

if TYPE_CHECKING:
    from ..requirements.conformance import Conformance
    from ..results import StudyResult

JUDGMENTS: dict[str, Judgment] = {
    "resolved": "good",
    "certified": "good",
    "estimated": "good",
    "sampled": "fair",
    "undersampled": "fair",
    "not resolved": "bad",
}

# What the weaker verdicts leave open, for a reader who knows mechanisms and no statistics.
_OPEN = {
    "sampled": "the numbers are those of the simulated mechanisms; others between them may go farther",
    "undersampled": "too few mechanisms were simulated to say with the coverage asked for how far others go",
    "not resolved": "no polynomial follows the motion, so that its extremes may lie outside these numbers",
}


def sentences(result: StudyResult) -> list[str]:
    """In specification or not, else how far the first output moves; the largest force; the tolerance."""
    conformance = result.conformance
    first = _movement(result) if conformance is None else [_specification(conformance)]
    told = [*first, *_force(result), *_tolerance(_judged(result, conformance))]
    return told or ["The study has neither outputs nor features."]


def _specification(conformance: Conformance) -> str:
    *_, every = conformance.values()
    least, most = map(percent, (every.lower, every.upper))
    sure = f"with {100.0 * every.confidence:.4g} % confidence"
    if every.outside == 0:
        what = f"None of {every.runs} mechanisms is out of specification"
        return f"{what}: at least {least} are in it {sure}."
    what = f"In specification are {percent(every.share)} of the mechanisms"
    return f"{what}, between {least} and {most} {sure}."


def requirements(conformance: Conformance | None) -> list[Table]:
    """A line for each requirement: share in specification, its interval, a verdict."""
    if conformance is None:
        return []
    rows: list[list[Cell]] = []
    for name, one in conformance.items():
        word = "kept by all" if one.outside == 0 else "kept by most" if one.share >= 0.5 else "kept by few"
        judged: Judgment = "good" if one.outside == 0 else "fair" if one.share >= 0.5 else "bad"
        limits = str(one.specification) if len(conformance) == 1 or name != "all" else "all of them"
        shares = map(percent, (one.share, one.lower, one.upper))
        rows.append([name, limits, *shares, f"{one.outside} of {one.runs}", Verdict(word, judged)])
    head = ["requirement", "limits", "in specification", "at least", "at most", "outside", "verdict"]
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
        verb = {"sampled": "reached", "not resolved": "may be within"}.get(band.verdict, "stays within")
        text = f"{band.name} {verb} {format_range(extent(result, band), band.unit)} over the tolerances"
        if band.max_width > 0.0:
            width = format_quantity(band.max_width, band.unit)
            text += f"; two mechanisms differ by up to {width}, {_when(band)}"
        yield f"{text}."
    elif result.features:
        feature = result.features[result.features.names[0]]
        assert isinstance(feature, FeatureResult)
        text = format_range(feature.ends, feature.unit)
        yield f"{feature.name} is within {text} over the tolerances."


def _when(band: Band) -> str:
    """Where two mechanisms differ most."""
    at = "at" if band.angle is None else "at a crank angle of"
    return f"{at} {place_of(band, int(np.argmax(band.width)))}"


def _force(result: StudyResult) -> Iterator[str]:
    """The force that is largest in magnitude, in either direction."""
    found = [(one.ends, one.name, one.nominal) for one in features_of(result) if one.unit == "N"]
    found += [
        (extent(result, band), band.name, band.nominal) for band in result.bands.values() if band.unit == "N"
    ]
    if found:
        ends, name, nominal = max(found, key=lambda one: max(map(abs, one[0])))
        texts = [format_quantity(float(max(values, key=abs)), "N") for values in (ends, np.ravel(nominal))]
        yield f"The largest force is {texts[0]}, {name}; without tolerances it is {texts[1]}."


def _tolerance(feature: FeatureResult | None) -> Iterator[str]:
    """The tolerance that narrows most what the reader asked for."""
    if feature is None:
        return
    try:
        ranking = feature.ranking()
    except ValueError:  # too few runs
        return
    first = ranking.rows[0]
    if first.helps:
        text = f"The tolerance of {first.parameter} matters most: half of it narrows the range of "
        yield f"{text}{feature.name} by {first.narrowing}."
    elif ranking.scatter.value > 0.5:
        part = f"{100.0 * ranking.scatter.value:.0f} %"
        yield f"No tolerance matters much for {feature.name}: {part} of its spread is scatter of impacts."
    else:
        yield f"No single tolerance is certain to narrow the range of {feature.name}."


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
        reach = one.interval
        ends = reach.lower, reach.upper
        nominal = format_quantity(float(np.mean(one.nominal)), one.unit, scale=max(map(abs, ends)))
        sure = Verdict(reach.verdict, JUDGMENTS.get(reach.verdict, "fair"))
        rows.append([one.name, nominal, *_ends(ends, one.unit), percent(reach.whole_run), sure])
    for name, band in result.bands.items():
        nominal = format_range((float(band.nominal.min()), float(band.nominal.max())), band.unit)
        row: list[Cell] = [name, nominal, *_ends(extent(result, band), band.unit)]
        row[4] = format_quantity(band.max_width, band.unit)
        rows.append([*row, percent(band.whole_run), Verdict(band.verdict, JUDGMENTS[band.verdict])])
    shown = rows[first:end]
    if not shown:
        return []
    more = len(rows) - first - len(shown)
    caption = "Further numbers over the tolerances" if first else "The main numbers over the tolerances"
    caption += f"; {more} more are in the details" if more else ""
    head = ["what", "nominal", "smallest", "largest", "differ by up to", "further one inside", "known as"]
    return [Table(caption, head, shown)]


def _ends(ends: tuple[float, float], unit: str) -> list[str]:
    """The smallest and the largest value, and how far they are apart."""
    low, high = (format_quantity(value, unit, scale=max(map(abs, ends))) for value in ends)
    return [low, high, format_quantity(ends[1] - ends[0], unit)]


def unknown(result: StudyResult) -> list[str]:
    """What the study does not say."""
    told = []
    failed = count_failed(result.failures)
    if failed:
        count = failed + len(result.parameters) + 1
        told.append(
            f"{failed} of {count} mechanisms could not be simulated: nothing here holds for such mechanisms."
        )
    for verdict, words in _OPEN.items():
        found = [name for name, band in result.bands.items() if band.verdict == verdict]
        if found:
            told.append(f"{in_a_sentence(found)}: {words}.")
    inside = [band.whole_run for band in result.bands.values() if math.isfinite(band.whole_run)]
    if inside:
        told.append(
            f"All numbers come from {len(result.parameters) + 1} simulated mechanisms. Of a hundred further "
            f"ones about {100.0 * min(inside):.0f} stay within a band all the time; the details say how the "
            "others leave it."
        )
    if result.warnings:
        count = len(result.warnings)
        told.append(f"{count} {'warning is' if count == 1 else 'warnings are'} among the details.")
    return told


def widest_of(result: StudyResult, band: Band) -> str:
    """Where two mechanisms differ most, and how far peaks between the samples are beyond them."""
    text = f"{band.name}: two mechanisms differ most {_when(band)}."
    sampled = at_samples(band)
    if extent(result, band) != sampled:
        text += f" Its peaks between the samples go farther than here, {format_range(sampled, band.unit)}."
    return text
