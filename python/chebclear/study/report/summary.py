"""The text of ``print(result)``: the runs, a line for each output, and suggestions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...base.shown import listed
from ...base.tables import format_ends, format_table
from ...execution.batch import jammed
from ...execution.failures import set_apart
from ...execution.pieces import NOT_BEGUN
from ...scene.scene import Interval
from ..band.band import Band
from ..band.margin import percent
from ..polynomials.points import on_cube, unfilled
from .extent import asked_end, sampled_end

if TYPE_CHECKING:
    from ..results import StudyResult


# Most outputs and parameters that are listed one by one.
_MOST_LINES = 20
# Most warnings that are given in full; a sentence each.
_MOST_WARNINGS = 3


def summary(result: StudyResult) -> str:
    """The text of a `StudyResult`: what was found, warnings, suggestions."""
    lines = [findings(result)]
    lines += [f"warning: {text}" for text in result.warnings[:_MOST_WARNINGS]]
    more = len(result.warnings) - _MOST_WARNINGS
    lines += [f"warning: and {more} more, see warnings"] * (more > 0)
    lines += [f"next: {text}" for text in suggestions(result)]
    varying = [name for name in result.features.names if np.ptp(result.features[name].values) > 0.0]
    lines += [f'next: ranking("{name}") says which tolerance to tighten' for name in varying[:1]]
    return "\n".join(lines)


def findings(result: StudyResult) -> str:
    """The runs, a line for each output, the features and what the bands promise."""
    sides = list(result.intervals.items())
    random = {} if result.spec is None else result.spec.random
    lines = [] if result.conformance is None else [str(result.conformance), ""]
    lines.append(_head(result))
    for name, side in sides[:_MOST_LINES]:
        unit = f" {result.units[name]}" if result.units.get(name, "-") != "-" else ""
        spread = f" ({type(random[name]).__name__.lower()}, taken as an interval)" if name in random else ""
        lines.append(f"  {name}: {_ends(side)}{unit}{spread}")
    lines += [f"  and {len(sides) - _MOST_LINES} more parameters"] * (len(sides) > _MOST_LINES)
    bands = list(result.bands.values())
    if bands:
        head = [
            "output",
            "width",
            "verdict",
            "inside",
            "further run",
            "peak of a run",
            "highest: predicted",
        ]
        rows = [_row(result, band) for band in bands[:_MOST_LINES]]
        lines += format_table([*head, "simulated"], rows).split("\n")
        lines += [f"and {len(bands) - _MOST_LINES} more outputs"] * (len(bands) > _MOST_LINES)
    peaks = {band.name: asked_end(result, band, "peak") for band in bands}
    between = [f"{output} ({peak.name})" for output, peak in peaks.items() if peak is not None]
    if between and result.scene is not None:  # of other models the samples are all there is
        lines.append(
            f"Peaks of a run between the samples too, from its features: {listed(between, most=4)}; the "
            "other columns are of the samples alone."
        )
    if result.features:
        lines += [str(result.features[name]) for name in result.features.names[:_MOST_LINES]]
    if result.statement is not None:
        lines.append(result.statement)
    return "\n".join(lines)


def _ends(side: Interval) -> str:
    """An interval in words; of one that is narrow against its size, middle and half width."""
    text = format_ends(side.lower, side.upper)
    if side.nominal != side.midpoint:
        return f"{text}, nominal {side.nominal:.6g}"
    if f"{side.lower:.6g}" == f"{side.upper:.6g}" and side.half_width > 0.0:
        return f"{side.midpoint:.6g} ± {side.half_width:.3g}"
    return text


def _head(result: StudyResult) -> str:
    """Method, parameters, runs and time."""
    how = result.kind
    if result.degrees is not None:
        how += f" of degree {' x '.join(map(str, result.degrees))}"
    sides, runs = len(result.intervals), len(result.parameters)
    text = f"{how}: {sides} parameter{'s' if sides > 1 else ''}, {runs} runs and the nominal one"
    if result.settings is not None:
        text += f", rtol {result.settings.rtol:g}"
    return text if math.isnan(result.seconds) else f"{text}, {result.seconds:.2g} s of runs"


def _row(result: StudyResult, band: Band) -> list[str]:
    """One output in a line."""
    peak = asked_end(result, band, "peak") or sampled_end(result, band, "peak")
    checked = {case.output: case for case in result.worst_cases if case.side == "upper"}.get(band.name)
    simulated = f"{band.hull[1].max():.5g} (largest run)"
    if checked is not None:
        simulated = f"{checked.simulated:.5g} (there)"
    return [
        f"{band.name} [{band.unit}]" if band.unit else band.name,
        f"{band.max_width:.4g}",
        band.verdict,
        percent(band.coverage),
        percent(band.whole_run),
        format_ends(*peak.ends, 5),
        f"{band.upper.max() if checked is None else checked.predicted:.5g}",
        simulated,
    ]


def suggestions(result: StudyResult) -> list[str]:
    """Suggestions for a better result and for its use."""
    bands = result.bands.values()
    advice = []
    is_table = result.spec is not None and result.spec.table  # which has no further runs
    wide = [band.name for band in bands if band.verdict in ("estimated", "undersampled")]
    requirement = result.requirement
    unfit = _unfit(result)
    if unfit:
        advice.append(f"{unfit}; more runs would not change that")
    elif wide and is_table and unfilled(on_cube(result.intervals, result.parameters)):
        advice.append("runs in the part of the box that the table leaves out, or intervals without it")
    elif wide and requirement is not None:
        more = requirement.runs
        how = "a table of twice as many runs" if requirement.finished else f"{more} more runs"
        advice.append(f"{how} would narrow {_named(wide)}")
    lost = [band.name for band in bands if band.verdict == "not resolved"]
    if lost:
        advice.append(f"bands of all runs (kind band) bound {_named(lost)}, which no polynomial follows")
    inner = [band.name for band in bands if band.verdict == "sampled"]
    if inner:
        advice.append(f"{_named(inner)}: inner bounds; a band (kind band) says how far a further run may go")
    followed = [band.name for band in bands if band.verdict == "resolved" and band.surrogate is not None]
    if followed and not result.worst_cases and not is_table:
        advice.append(f"a check simulates the predicted worst cases of {_named(followed)}")
    return advice


def _unfit(result: StudyResult) -> str:
    """The box to ask for in place of one with mechanisms that do not work: how many, and where they are."""
    failed = [one.parameters for one in result.failures if one.reason != NOT_BEGUN]
    if failed:
        these = np.array([list(parameters.values()) for parameters in failed])
        place = set_apart(result.parameter_names, these, result.parameters)
        count = len(failed) + len(result.parameters) + 1  # the nominal one
        return (
            f"a box in which all runs succeed: {len(failed)} of {count} failed{place}, "
            "and no bound holds there"
        )
    jams = jammed(result.notices)
    return jams and f"a box in which no mechanism jams: {jams}"


def _named(names: Sequence[str]) -> str:
    return listed(names, most=3)
