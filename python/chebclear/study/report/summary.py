"""The text of ``print(result)``: the runs, a line for each output, and suggestions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ...base.prefixes import Form, format_exact, format_quantity, format_tolerance
from ...base.shown import listed
from ...base.tables import format_table
from ...execution.batch import jammed
from ...execution.failures import set_apart
from ...execution.pieces import NOT_BEGUN
from ...notices import shown_first
from ..band.worst import WorstCase
from ..polynomials.points import on_cube, unfilled
from ..requirements.document import specification, what_to_do
from .answer import main_numbers, tolerances

if TYPE_CHECKING:
    from ..results import StudyResult


# Most outputs and parameters that are listed one by one.
_MOST_LINES = 20
# Most warnings that are given in full; a sentence each.
_MOST_WARNINGS = 3


def summary(result: StudyResult) -> str:
    """The text of a `StudyResult`: what was found, warnings, suggestions."""
    lines = [findings(result)]
    first = shown_first(result.notices)
    lines += [f"warning: {text}" for text in first[:_MOST_WARNINGS]]
    more = len(first) - _MOST_WARNINGS
    lines += [f"warning: and {more} more, see warnings"] * (more > 0)
    rest = len(result.warnings) - len(first)
    lines += [f"{rest} notice{'s' * (rest > 1)} more, by which no number here changes: see warnings"] * (
        rest > 0
    )
    lines += [f"next: {text}" for text in suggestions(result)]
    varying = [name for name in result.features.names if np.ptp(result.features[name].values) > 0.0]
    lines += [f'next: ranking("{name}") says which tolerance to tighten' for name in varying[:1]]
    return "\n".join(lines)


def findings(result: StudyResult) -> str:
    """The runs, a line for each output, the features and what the bands promise."""
    sides = list(result.intervals.items())
    random = {} if result.spec is None else result.spec.random
    lines = []
    if result.conformance is not None:
        answer = [*specification(result.conformance), *what_to_do(result.conformance, tolerances(result))]
        lines += [*map(str, answer), str(result.conformance), ""]
    lines.append(_head(result))
    for name, side in sides[:_MOST_LINES]:
        around = " ".join(format_tolerance(side, result.units.get(name, ""), result.written_for(name)))
        spread = f" ({random[name].told}, taken as an interval)" if name in random else ""
        lines.append(f"  {name}: {around}{spread}")
    lines += [f"  and {len(sides) - _MOST_LINES} more parameters"] * (len(sides) > _MOST_LINES)
    for table in main_numbers(result, end=_MOST_LINES):
        rows = [[str(cell) for cell in row] for row in table.rows]
        lines += format_table(table.head, rows).split("\n")
    more = len(result.bands) + len(result.features) - _MOST_LINES
    lines += [f"and {more} more outputs"] * (more > 0)
    lines += [_worst(result, case) for case in result.worst_cases[:_MOST_LINES]]
    if result.statement is not None:
        lines.append(result.statement)
    return "\n".join(lines)


def _worst(result: StudyResult, case: WorstCase) -> str:
    """A predicted worst case beside its simulation."""
    band, word = result.bands[case.output], "highest" if case.side == "upper" else "lowest"
    form = Form.of((case.predicted, case.simulated), band.unit, band.written)
    there = (
        f"{name} = {format_exact(value, result.units.get(name, ''), written=result.written_for(name))}"
        for name, value in case.parameters.items()
    )
    text = f"{case.output} is {word} at t = {format_quantity(case.time, 's')} with {listed(there, most=4)}: "
    return f"{text}predicted {form.text(case.predicted)}, simulated {form.text(case.simulated)}"


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


def suggestions(result: StudyResult) -> list[str]:
    """Suggestions for a better result and for its use."""
    bands = result.bands.values()
    advice = []
    is_table = result.spec is not None and result.spec.table  # which has no further runs
    made = result.requirement is not None
    wide = [band.name for band in bands if made and band.verdict != "proved" and not band.resolved]
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
    unknown = [band for band in bands if band.verdict == "unknown"]
    lost = [band.name for band in unknown if band.surrogate is not None]
    if lost:
        advice.append(f"bands of all runs (kind band) bound {_named(lost)}, which no polynomial follows")
    inner = [band.name for band in unknown if band.surrogate is None]
    if inner:
        advice.append(f"a band (kind band) says how far further runs of {_named(inner)} may go")
    followed = [band.name for band in bands if band.resolved and band.surrogate is not None]
    if followed and not result.worst_cases and not is_table:
        advice.append(f"result.check() simulates the predicted worst cases of {_named(followed)}")
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
