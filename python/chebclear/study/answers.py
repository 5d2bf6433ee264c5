"""Answers of a study from the table of its runs: bands, features, notices, and further runs."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..base.arguments import Checks
from ..errors import ArgumentError
from ..execution.failures import FAILED, STOPPED, count_failed, failure_notices
from ..execution.pieces import NOT_BEGUN
from ..notices import Notice
from ..scene.columns import physical_limits
from .band.gridded import Grid
from .band.notices import SETTLING, TOO_FEW_RUNS, doubts, early_widths, remarks, told_holes
from .band.requirement import LEAST_RUNS, Requirement, band_usage
from .band.worst import WorstCase, predicted_extremes
from .by_angle import cut, unpredictable
from .differences import model_differences, scene_differences, setting_differences, study_differences, unequal
from .features.features import feature_table
from .polynomials.holes import fit_holes
from .polynomials.points import SAME_POINT, in_box, on_cube
from .results import StudyResult, checked_results
from .runner import Design, Runner
from .sources.finished import FinishedRuns
from .sources.run_table import RunTable
from .sources.scenes import MOST_RUNS, scene_of

# Largest difference of values of one model at one point, over the largest.
_SAME_VALUES = 1e-6


def result_of(runner: Runner, design: Design, runs: RunTable) -> StudyResult:
    """The result of a design from its runs."""
    if isinstance(design.asked, Grid):
        return _of_grid(runner, design.asked, runs)
    return _of_band(runner, design.asked, design.others, runs)


def _of_grid(runner: Runner, grid: Grid, runs: RunTable) -> StudyResult:
    """The result of runs on a grid, then of others that check its polynomials."""
    found = StudyResult.from_runs(
        runs,
        runner.intervals,
        grid,
        threads=runner.execution.threads,
        features=feature_table(runner, runs, grid.random, count_failed(runs.failures)),
        units=runner.units,
        spec=runner.spec,
    )
    # A result that is read from a file already has these notices.
    messages = [*doubts(found.bands), *early_widths(found.bands, found.scene)]
    lost = [one.index for one in runs.failures if one.index < math.prod(grid.nodes)]
    if grid.degrees is not None and lost:
        messages += told_holes(fit_holes(grid.nodes, grid.degrees, lost))
    return replace(found, notices=(*found.notices, *messages))


def _of_band(
    runner: Runner, requirement: Requirement, others: Sequence[StudyResult], made: RunTable
) -> StudyResult:
    """The result of `Study.band` from its new runs and those of others."""
    turns, count = requirement.revolutions, len(made.kept)
    runs = made if turns is None else cut(made, turns)
    if not runs.outputs:
        raise ArgumentError(
            "a band needs outputs over time: name some in Study(outputs=...), or have the model or table "
            "hold them; Study.sample() is for features alone"
        )
    if count < LEAST_RUNS:
        raise ArgumentError(
            f"a band needs at least {LEAST_RUNS} runs, {count} of {count + len(runs.failures)} have a "
            f"result; the first of the others is {runs.failures[0]}"
        )
    limits = physical_limits(runs.outputs, runs.clearances, simulated=runs.scene is not None)
    requirement = replace(requirement, runs=count, failed=count_failed(runs.failures), limits=limits)
    messages = [] if turns is not None else unpredictable(runs)
    return _joined(runner, requirement, runs, None, others, [*runs.notices, *messages])


def _joined(
    runner: Runner,
    requirement: Requirement,
    runs: RunTable,
    kept: RunTable | None,
    others: Sequence[StudyResult],
    notices: Sequence[Notice],
) -> StudyResult:
    """The result of runs at points of the study, the nominal one last, of those that were `kept` from results
    included before, and of other results, whose runs may lie on a grid."""
    count = requirement.runs
    if others or kept is not None:
        scored, nominal = runs[:count], runs[count:]
        tables = ([] if kept is None else [kept]) + _tables(runner, others, requirement, runs)
        kept = _without_twins(runner, scored, tables[0].joined(tables[1:]))
        notices = [*notices, *_foreign(runner, others, nominal)]
        runs = scored.joined([kept, nominal]) if len(kept.parameters) else runs
    alone = len(runs.parameters) == count
    random = alone and (not isinstance(runner.model, FinishedRuns) or runner.model.independent)
    result = StudyResult.from_runs(
        runs,
        runner.intervals,
        requirement,
        threads=runner.execution.threads,
        features=feature_table(runner, runs, random, requirement.failed),
        units=runner.units,
        spec=runner.spec,
    )
    # Shortcomings of the bands are known only now.
    messages = [*remarks(result.bands, requirement), *early_widths(result.bands, result.scene)]
    return replace(result, notices=(*notices, *messages))


def extended(
    checks: Checks,
    runner: Runner,
    result: StudyResult,
    runs: int,
    include: StudyResult | Sequence[StudyResult],
) -> StudyResult:
    """The result of `StudyResult.extend` without shares; problems are added to `checks`."""
    checks.whole("runs", runs, least=0, most=MOST_RUNS)
    others = checked_results(checks, include)
    requirement = result.requirement
    if requirement is None:
        checks.add("result", f"must be one of Study.band to be extended, this is one of Study.{result.kind}")
    elif requirement.finished:
        checks.add(
            "result", "is one of a table of finished runs, which has no further ones: make a new table"
        )
    checks.finish()
    assert requirement is not None, "the checks let no other result pass"
    old = result.run_table(result.outputs)
    count, messages = len(old.parameters), lasting(result.notices)
    scored, kept, nominal = old[: requirement.runs], old[requirement.runs : count], old[count:]
    begun = requirement.runs + requirement.failed
    # Runs that time was short for are made now.
    failures = tuple(one for one in result.failures if one.reason != NOT_BEGUN or one.index >= begun + runs)
    seconds = result.seconds
    if runs > 0:
        points = requirement.points(runner, begun, runs)
        new = runner.made(points, result.settings, midpoint=False, usage=band_usage(*points.shape))
        new = new if requirement.revolutions is None else cut(new, requirement.revolutions)
        seconds += new.seconds
        scored = scored.joined([new])
        messages += lasting(new.notices)
        failures += tuple(replace(one, index=one.index + begun) for one in new.failures)
    good = len(scored.parameters)
    requirement = replace(requirement, runs=good, failed=count_failed(failures))
    made = replace(scored.joined([nominal]), seconds=seconds, failures=failures)
    messages += failure_notices(failures, good + len(failures) + 1)
    return _joined(runner, requirement, made, kept if len(kept.kept) else None, others, messages)


def lasting(notices: Sequence[Notice]) -> list[Notice]:
    """Notices without those that count the runs so far."""
    return [one for one in notices if one.code not in (TOO_FEW_RUNS, SETTLING, FAILED, STOPPED)]


def simulated_extremes(runner: Runner, result: StudyResult) -> tuple[WorstCase, ...]:
    """Runs at the worst cases that the polynomials of a result predict; see `StudyResult.check`."""
    checks = Checks()
    check_same_study(checks, runner, result)
    checks.finish()
    followed = [band for band in result.bands.values() if band.resolved and band.surrogate]
    if not followed:
        raise ArgumentError(
            "no output is resolved by a polynomial, so there is no worst case to be checked: more runs "
            "may resolve one; features of the runs and their ranking need none"
        )
    cases = [case for band in followed for case in predicted_extremes(band)]
    points = np.array([list(case.parameters.values()) for case in cases])
    runs = runner.made(points, result.settings, midpoint=False)
    for row, point in enumerate(runs.kept.tolist()):
        case = cases[point]
        values = runs.values[row, :, runs.outputs.index(case.output)]
        cases[point] = replace(case, simulated=float(values[result.t == case.time][0]))
    return tuple(cases)


def check_same_study(checks: Checks, runner: Runner, result: object) -> None:
    """Refuse a result that is none of this study, with what differs: its runs would be of two mechanisms.

    Python functions are known by their names; of those that build scenes the nominal scene is compared too.
    """
    if not isinstance(result, StudyResult):
        checks.add("result", f"must be a result of this study, got {result!r}", wrong_type=True)
        return
    if result.spec is not None:
        found = study_differences(runner.spec, result.spec)
    else:
        found = list(unequal("interval of ", runner.intervals, result.intervals))
    if not found and result.scene is not None:
        found += scene_differences(scene_of(runner, runner.nominal), result.scene)
    if found:
        checks.add("result", f"is one of another study, this one and that differ in {'; '.join(found)}")


def _tables(
    runner: Runner, results: Sequence[StudyResult], requirement: Requirement, own: RunTable
) -> list[RunTable]:
    """The runs of other results, which must be of the same study or of a table of finished runs of it."""
    checks = Checks()
    for index, result in enumerate(results):
        problems = list(_other_runs(runner, result, requirement, own))
        if problems:
            checks.add(f"include[{index}]", "; ".join(problems))
    checks.finish()
    return [result.run_table(own.outputs)[: len(result.parameters)] for result in results]


def _other_runs(
    runner: Runner, result: StudyResult, requirement: Requirement, own: RunTable
) -> Iterator[str]:
    """Why the runs of a result cannot take part beside those of this study."""
    missing = [name for name in own.outputs if name not in result.outputs]
    if missing:
        yield f"misses the outputs {', '.join(missing)}"
    if result.parameter_names != tuple(runner.intervals):
        yield f"has the parameters {', '.join(result.parameter_names)}"
    elif not in_box(runner.intervals, result.parameters):
        yield "has runs outside of the intervals of this study"
    revolutions = None if result.requirement is None else result.requirement.revolutions
    instants = result.t.shape == own.t.shape
    instants = instants and bool(np.max(np.abs(result.t - own.t)) <= 1e-9 * (own.t[-1] - own.t[0]))
    if revolutions != requirement.revolutions:
        yield "has other revolutions, or none"
    elif not instants:
        yield "has other instants"
    # A table of finished runs may have none; neither its model nor its settings are known.
    spec, theirs = result.spec, result.features.names
    strange = spec is None or runner.table or (spec.table and spec.settings is None)
    if theirs != own.feature_names and not (strange and not theirs):
        yield f"has the features {', '.join(theirs) or 'none'}"
    if spec is None or strange:
        return
    found = list(model_differences(runner, spec))
    asked = spec.facts()["features"]  # this study may have others, for its requirements
    found += unequal(
        "feature ", {name: one for name, one in runner.facts()["features"].items() if name in asked}, asked
    )
    if instants and result.settings is not None:
        found += setting_differences(own.settings, result.settings)
    if not found and result.scene is not None:
        found += scene_differences(own.scene, result.scene)
    if found:
        yield f"is of another study, this one and that differ in {'; '.join(found)}"


def _foreign(runner: Runner, results: Sequence[StudyResult], nominal: RunTable) -> list[Notice]:
    """Notices of included results that are not those of this model at the midpoint, if they have the same.

    Other scenes are refused; what a model of one's own computes is not known.
    """
    found = []
    for index, result in enumerate(results):
        same = all(result.intervals[name].nominal == side.nominal for name, side in runner.intervals.items())
        if runner.settings is not None or not same or result.nominal_parameters is not None:
            continue
        values = nominal.values[0]
        other = np.stack([result[name].nominal for name in nominal.outputs], axis=-1)
        size = np.maximum(np.max(np.abs(values), axis=0), np.max(np.abs(other), axis=0))
        if np.any(np.abs(values - other) > _SAME_VALUES * size):
            text = (
                f"include[{index}] has other values at the midpoint than this study: it is of another model, "
                "or results of the model are random"
            )
            found.append(Notice("foreign", text))
    return found


def _without_twins(runner: Runner, scored: RunTable, kept: RunTable) -> RunTable:
    """The included runs at points that no held-out run has, and those that are the same only once.

    A run that is held out while its twin is not would always be inside.
    """
    # Points are the same to rounding; bit for bit where they come from the same sequence.
    own, others = (
        [
            point.tobytes()
            for point in np.round(on_cube(runner.intervals, table.parameters) / SAME_POINT) + 0.0
        ]
        for table in (scored, kept)
    )
    held_out = set(own)
    first: dict[tuple[bytes, bytes], int] = {}
    for row, (point, values) in enumerate(zip(others, kept.values, strict=True)):
        if point not in held_out:  # a table may have several runs at one point
            first.setdefault((point, hashlib.sha256(values.tobytes()).digest()), row)
    return kept[np.array(list(first.values()), dtype=np.intp)]
