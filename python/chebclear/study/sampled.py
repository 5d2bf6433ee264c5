"""Calibrated studies: runs at points that fill the box evenly, and their bands."""

from __future__ import annotations

import dataclasses
import hashlib
import math
from collections.abc import Sequence

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ..base.arguments import Checks
from ..errors import ArgumentError
from ..execution.counts import Costs
from ..execution.failures import FAILED, STOPPED, FailedRun, count_failed, failure_notices
from ..execution.memory import room, study_memory
from ..execution.pieces import NOT_BEGUN
from ..run.notices import Notice
from ..run.settings import Settings, checked_settings
from .band.calibrated import Requirement, band_usage
from .band.independent import exact_runs
from .band.limits import largest_clearances, physical_limits
from .band.notices import SETTLING, UNDERSAMPLED, early_widths, remarks
from .by_angle import cut, turning, unpredictable
from .designs import Design, feature_table, predicted_seconds
from .polynomials.points import in_box, on_cube, random_points, sobol_points
from .results import StudyResult
from .runner import Runner
from .sources.finished import FinishedRuns
from .sources.run_table import RunTable, runs_of
from .sources.scenes import MOST_RUNS

Array = NDArray[np.float64]

LEAST_RUNS = 3
BAND_RUNS = 81
"""Runs of a band where time allows no more [-]."""
BAND_RTOL = 1e-4
"""Relative tolerance of the runs of a band where nothing was said [-]."""
MOST_PARAMETERS = 32
"""Parameters for which there are Sobol' points [-]."""
# Parts of the time and of the memory that are allowed: for the runs that are timed, and for the samples.
_TIMED, _MEMORY = 0.01, 0.5
# Largest difference of parameters of runs at one point, over half the interval.
_SAME_POINT = 1e-9
# The same of values of one model, over the largest.
_SAME_VALUES = 1e-6


def band(
    runner: Runner,
    runs: int | None,
    coverage: float,
    seconds: float,
    confidence: float | None,
    rtol: float | None,
    rng: int | Generator | None,
    include: StudyResult | Sequence[StudyResult],
    max_runs: int,
    revolutions: int | None,
    discard: int | None,
    angle: str | None,
) -> Design:
    """The design of `Study.band`; see there."""
    checks = Checks()
    if runs is not None:
        checks.whole("runs", runs, least=LEAST_RUNS, most=MOST_RUNS)
    most = checks.whole("max_runs", max_runs, least=1)
    checks.real("coverage", coverage, "-", above=0.0, below=1.0)
    checks.real("seconds", seconds, "s", above=0.0)
    if confidence is not None:
        checks.real("confidence", confidence, "-", above=0.0, below=1.0)
    _check_rtol(checks, runner, rtol)
    seed = checks.seed("rng", rng)
    for name, value in {"discard": discard, "angle": angle}.items():
        if revolutions is None and value is not None:
            checks.add(f"{name} is for bands by crank angle: give revolutions too, got {value!r}")
    others = _results(checks, include)
    checks.finish()
    settings, turns = runner.run_settings(rtol, BAND_RTOL), None
    if revolutions is not None:
        first = 1 if discard is None else discard
        settings, turns = turning(runner, settings, revolutions, first, angle)
    needed = exact_runs(coverage, confidence)
    requirement = Requirement(float(coverage), 0, seed, {}, confidence=confidence, revolutions=turns)
    if isinstance(runner.model, FinishedRuns):
        points = _finished_points(runner.model, runs)
        independent = runner.model.independent and len(points) >= needed
        if confidence is not None and not runner.model.independent:
            raise ArgumentError(
                "nothing has a confidence by runs at points that someone chose: they must be drawn "
                "independently and uniformly from the box, Study.from_runs(..., independent=True)"
            )
        requirement = dataclasses.replace(requirement, finished=True, independent=independent)
    else:
        count = needed if runs is None and confidence is not None else runs
        if count is None:
            requirement = dataclasses.replace(requirement, seconds=float(seconds))
            count = _affordable_runs(runner, settings, needed, most, requirement)
        if count > most:
            raise ArgumentError(f"runs must be <= max_runs = {most}, got {count}: take fewer")
        requirement = dataclasses.replace(requirement, independent=count >= needed)
        points = _points(runner, requirement, 0, count)
    if confidence is not None and len(points) < needed:
        raise ArgumentError(
            f"a coverage of {coverage!r} with a confidence of {confidence!r} takes {needed} independent "
            f"runs, got {len(points)}: ask for less, or for more runs"
        )
    return _design(runner, requirement, points, settings, others)


def spread_evenly(runner: Runner, runs: int, coverage: float, seed: int) -> Design:
    """The design of a band by so many runs at Sobol' points, however many."""
    requirement = Requirement(coverage, runs, seed, {})
    points = _points(runner, requirement, 0, runs)
    return _design(runner, requirement, points, runner.run_settings(None, BAND_RTOL), [])


def _points(runner: Runner, requirement: Requirement, first: int, count: int) -> Array:
    """Points of a study from a number on: independent ones, or of a sequence that fills the box evenly."""
    draw, seed = random_points if requirement.independent else sobol_points, requirement.seed
    if not requirement.independent and len(runner.intervals) > MOST_PARAMETERS:
        raise ArgumentError(
            f"a band by runs at evenly spread points takes at most {MOST_PARAMETERS} parameters, the study "
            f"has {len(runner.intervals)}: give those that matter least as fixed, or ask for "
            f"{exact_runs(requirement.coverage)} runs, whose points are independent"
        )
    return runner.drawn(lambda box: draw(box, first, count, seed))


def _affordable_runs(
    runner: Runner, settings: Settings | None, needed: int, most: int, requirement: Requirement
) -> int:
    """As many runs as are needed for the exact statement, or as time and memory allow; 81 at least."""
    limit = requirement.seconds
    assert limit is not None, "time chooses the number of runs"
    independent = dataclasses.replace(requirement, independent=True)
    count = min(needed, most)
    design = _design(runner, independent, _points(runner, independent, 0, count), settings, [])
    try:
        seconds, shape = predicted_seconds(runner, design, _TIMED * limit)
    except Exception:  # most of a few runs failed: whether most of all do the study itself finds out
        return min(BAND_RUNS, most)
    affordable = min(most, int(count * limit / seconds))

    def fits(count: int) -> bool:
        usage = band_usage(count, len(runner.intervals))
        size = study_memory((count + 1, *shape), usage, in_memory=runner.execution.in_memory)
        return count <= affordable and size <= _MEMORY * room()

    count = BAND_RUNS
    while fits(2 * count):
        count *= 2
    return needed if fits(needed) else min(count, most)


def _check_rtol(checks: Checks, runner: Runner, rtol: float | None) -> None:
    if rtol is not None and runner.model is not None:
        checks.add("rtol is a setting of simulations: a model of your own does not use it")
    elif rtol is not None:
        checked_settings(checks, {"rtol": rtol})


def _finished_points(table: FinishedRuns, runs: int | None) -> Array:
    """Points of a table but the nominal one, all or the first so many."""
    points = table.points
    wanted = len(points) if runs is None else runs
    if len(points) < max(wanted, LEAST_RUNS):
        raise ArgumentError(
            f"the table has {len(points)} runs besides the nominal one, {max(wanted, LEAST_RUNS)} are needed"
        )
    table.require_scattered()
    table.require_filled(points[:wanted])
    return points[:wanted]


def _design(
    runner: Runner,
    requirement: Requirement,
    points: Array,
    settings: Settings | None,
    others: Sequence[StudyResult],
) -> Design:
    """Runs at the points and the midpoint, whose result is that of a band."""
    usage, alone = band_usage(*points.shape), requirement.independent and not others

    def result(made: RunTable) -> StudyResult:
        return _made(runner, requirement, made, others)

    return Design(points, settings, usage, result, alone, requirement.seed)


def _made(
    runner: Runner,
    requirement: Requirement,
    made: RunTable,
    others: Sequence[StudyResult],
) -> StudyResult:
    """The result of runs at the points and the midpoint."""
    new = made if requirement.revolutions is None else cut(made, requirement.revolutions)
    if not new.outputs:
        raise ArgumentError(
            "a band needs outputs over time: name some in Study(outputs=...), or have the model or table "
            "hold them; Study.sample() is for features alone"
        )
    limits = dict.fromkeys(new.outputs, (-math.inf, math.inf))
    if new.scene is not None:
        limits = physical_limits(
            new.outputs, largest_clearances(runner.scene, runner.intervals, new.scene, new.clearances)
        )
    requirement = dataclasses.replace(
        requirement, runs=len(new.kept), failed=count_failed(new.failures), limits=limits
    )
    _check_enough(requirement, new.failures)
    scored, nominal = new[: requirement.runs], new[requirement.runs :]
    kept = _others(runner, others, requirement, new)
    messages = [*new.notices, *_foreign(runner, others, nominal)]
    messages += [] if requirement.revolutions is not None else unpredictable(new)
    whole = None if kept else new.values
    return _result(runner, requirement, new, [scored], kept, nominal, messages, whole)


def _check_enough(requirement: Requirement, failures: Sequence[FailedRun]) -> None:
    """Refuse to make bands of the few runs that failures left."""
    if requirement.runs < LEAST_RUNS:
        raise ArgumentError(
            f"a band needs at least {LEAST_RUNS} runs, {requirement.runs} of "
            f"{requirement.runs + len(failures)} have a result; the first of the others is {failures[0]}"
        )


def extended(
    runner: Runner, result: StudyResult, runs: int, include: StudyResult | Sequence[StudyResult]
) -> StudyResult:
    """The result of `StudyResult.extend`; see there."""
    checks = Checks()
    checks.whole("runs", runs, least=0, most=MOST_RUNS)
    others = _results(checks, include)
    requirement = result.requirement
    if requirement is None:
        checks.add(f"only a result of Study.band can be extended, this is one of Study.{result.kind}")
    elif requirement.finished:
        checks.add("a table of finished runs has no further ones: make a new table")
    checks.finish()
    assert requirement is not None, "the checks let no other result pass"
    old = runs_of(result, result.outputs)
    scored, messages = [old[: requirement.runs]], _lasting(result.notices)
    count = len(old.parameters)
    kept, nominal = [old[requirement.runs : count]], old[count:]
    good, begun = requirement.runs, requirement.runs + requirement.failed
    # Runs that time was short for are made now.
    failures = tuple(one for one in result.failures if one.reason != NOT_BEGUN or one.index >= begun + runs)
    seconds = result.seconds
    if runs > 0:
        points = _points(runner, requirement, begun, runs)
        new = runner.made(points, result.settings, midpoint=False, usage=band_usage(*points.shape))
        new = new if requirement.revolutions is None else cut(new, requirement.revolutions)
        seconds += new.seconds
        scored.append(new)
        messages += _lasting(new.notices)
        good += len(new.kept)
        failures += tuple(dataclasses.replace(one, index=one.index + begun) for one in new.failures)
    kept += _others(runner, others, requirement, old)
    messages += _foreign(runner, others, nominal)
    requirement = dataclasses.replace(requirement, runs=good, failed=count_failed(failures))
    messages += failure_notices(failures, good + len(failures) + 1)
    base = dataclasses.replace(old, seconds=seconds, failures=failures)
    return _result(runner, requirement, base, scored, kept, nominal, messages)


def _result(
    runner: Runner,
    requirement: Requirement,
    base: RunTable,
    scored: Sequence[RunTable],
    kept: Sequence[RunTable],
    nominal: RunTable,
    notices: Sequence[Notice],
    whole: Array | None = None,
) -> StudyResult:
    """The result of the runs of all tables, otherwise like `base`; `whole` are their values as one array."""
    kept = _without_twins(runner, scored, kept)
    tables = [*scored, *kept]
    # Runs of another result may not know the features.
    found = [table.features for table in [*tables, nominal] if table.features is not None]
    runs = dataclasses.replace(
        base,
        parameters=np.concatenate([table.parameters for table in tables]),
        values=np.concatenate([one.values for one in [*tables, nominal]]) if whole is None else whole,
        features=np.concatenate(found) if base.feature_names and len(found) == len(tables) + 1 else None,
        stats=Costs.joined(table.stats for table in [*tables, nominal]),
        notices=tuple(notices),
    )
    # Included runs may lie on a grid.
    random = not kept and (not isinstance(runner.model, FinishedRuns) or runner.model.independent)
    result = StudyResult.from_runs(
        runs,
        runner.intervals,
        degrees=None,
        nodes=(),
        requirement=requirement,
        threads=runner.execution.threads,
        features=feature_table(runner, runs, random, requirement.failed),
        units=runner.units,
    )
    # Shortcomings of the bands are known only now.
    messages = [*remarks(result.bands, requirement), *early_widths(result.bands, result.scene)]
    return dataclasses.replace(result, notices=(*notices, *messages))


def _lasting(notices: Sequence[Notice]) -> list[Notice]:
    """Notices without those that count the runs so far."""
    return [one for one in notices if one.code not in (UNDERSAMPLED, SETTLING, FAILED, STOPPED)]


def _results(checks: Checks, include: object) -> list[StudyResult]:
    """The results whose runs are to be included."""
    given = [include] if isinstance(include, StudyResult) else include
    if not isinstance(given, Sequence) or not all(isinstance(one, StudyResult) for one in given):
        checks.add(f"include must be results of studies, got {include!r}", wrong_type=True)
        return []
    return list(given)


def _others(
    runner: Runner,
    results: Sequence[StudyResult],
    requirement: Requirement,
    own: RunTable,
) -> list[RunTable]:
    """The runs of other results, which must be of the same study or of a table of finished runs of it."""
    checks = Checks()
    for index, result in enumerate(results):
        missing = [name for name in own.outputs if name not in result.outputs]
        if missing:
            checks.add(f"include[{index}] misses the outputs {', '.join(missing)}")
        revolutions = None if result.requirement is None else result.requirement.revolutions
        if revolutions != requirement.revolutions:
            checks.add(f"include[{index}] has other revolutions, or none")
        elif len(result.t) != len(own.t) or np.max(np.abs(result.t - own.t)) > 1e-9 * (own.t[-1] - own.t[0]):
            checks.add(f"include[{index}] has other instants")
        if result.scene is not None and result.scene != own.scene:
            checks.add(f"include[{index}] is of another runner: its midpoint is another scene")
        elif result.parameter_names != tuple(runner.intervals):
            checks.add(f"include[{index}] has the parameters {', '.join(result.parameter_names)}")
        elif not in_box(runner.intervals, result.parameters):
            checks.add(f"include[{index}] has runs outside of the intervals of this study")
    checks.finish()
    return [runs_of(result, own.outputs)[: len(result.parameters)] for result in results]


def _foreign(runner: Runner, results: Sequence[StudyResult], nominal: RunTable) -> list[Notice]:
    """Notices of included results that are not those of this model at the midpoint, if they have the same.

    Other scenes are refused; what a model of one's own computes is not known.
    """
    found = []
    for index, result in enumerate(results):
        same = all(result.intervals[name].nominal == side.nominal for name, side in runner.intervals.items())
        if runner.settings is not None or not same or result.nominal_parameters is not None:
            continue
        values, other = (
            nominal.values[0],
            np.stack([result[name].nominal for name in nominal.outputs], axis=-1),
        )
        size = np.maximum(np.max(np.abs(values), axis=0), np.max(np.abs(other), axis=0))
        if np.any(np.abs(values - other) > _SAME_VALUES * size):
            text = (
                f"include[{index}] has other values at the midpoint than this study: it is of another model, "
                "or results of the model are random"
            )
            found.append(Notice("foreign", text))
    return found


def _without_twins(runner: Runner, scored: Sequence[RunTable], kept: Sequence[RunTable]) -> list[RunTable]:
    """The included runs at points that no held-out run has, and those that are the same only once.

    A run that is held out while its twin is not would always be inside.
    """
    if not kept:
        return []
    points = np.concatenate([table.parameters for table in (*scored, *kept)])
    # Points are the same to rounding; bit for bit where they come from the same sequence.
    cube = np.round(on_cube(runner.intervals, points) / _SAME_POINT) + 0.0
    place = sum(len(table.parameters) for table in scored)
    held_out = {point.tobytes() for point in cube[:place]}
    seen: set[tuple[bytes, bytes]] = set()
    left = []
    for table in kept:
        rows = []
        for row, values in enumerate(table.values):
            point = cube[place + row].tobytes()
            # A table may have several runs at one point.
            same = (point, hashlib.sha256(values.tobytes()).digest())
            if point not in held_out and same not in seen:
                seen.add(same)
                rows.append(row)
        place += len(table.parameters)
        if rows:
            left.append(table[np.array(rows)])
    return left
