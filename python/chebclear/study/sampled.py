"""Calibrated studies: runs at points that fill the box evenly, and their bands."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ..base.arguments import Checks
from ..errors import ArgumentError
from ..execution.failures import FAILED, STOPPED, count_failed, failure_notices
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
    if rtol is not None and runner.model is not None:
        checks.add("rtol is a setting of simulations: a model of your own does not use it")
    elif rtol is not None:
        checked_settings(checks, {"rtol": rtol})
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
        requirement = replace(requirement, finished=True, independent=independent)
    else:
        count = needed if runs is None and confidence is not None else runs
        if count is None:
            requirement = replace(requirement, seconds=float(seconds))
            count = _affordable_runs(runner, settings, needed, most, requirement)
        if count > most:
            raise ArgumentError(f"runs must be <= max_runs = {most}, got {count}: take fewer")
        requirement = replace(requirement, independent=count >= needed)
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
    independent = replace(requirement, independent=True)
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

    def result(made: RunTable) -> StudyResult:
        new = made if requirement.revolutions is None else cut(made, requirement.revolutions)
        return _of_new(runner, requirement, new, others)

    alone = requirement.independent and not others
    return Design(points, settings, band_usage(*points.shape), result, alone, requirement.seed)


def _of_new(
    runner: Runner, requirement: Requirement, new: RunTable, others: Sequence[StudyResult]
) -> StudyResult:
    """The result of the runs of a design and of those of others."""
    if not new.outputs:
        raise ArgumentError(
            "a band needs outputs over time: name some in Study(outputs=...), or have the model or table "
            "hold them; Study.sample() is for features alone"
        )
    limits = dict.fromkeys(new.outputs, (-math.inf, math.inf))
    if new.scene is not None:
        largest = largest_clearances(runner.scene, runner.intervals, new.scene, new.clearances)
        limits = physical_limits(new.outputs, largest)
    count, failed = len(new.kept), count_failed(new.failures)
    requirement = replace(requirement, runs=count, failed=failed, limits=limits)
    if count < LEAST_RUNS:
        raise ArgumentError(
            f"a band needs at least {LEAST_RUNS} runs, {count} of {count + len(new.failures)} have a result; "
            f"the first of the others is {new.failures[0]}"
        )
    scored, nominal = new[:count], new[count:]
    kept = _without_twins(runner, scored, new[:0].joined(_others(runner, others, requirement, new)))
    messages = [*new.notices, *_foreign(runner, others, nominal)]
    messages += [] if requirement.revolutions is not None else unpredictable(new)
    runs = scored.joined([kept, nominal]) if len(kept.parameters) else new
    return _result(runner, requirement, runs, messages)


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
    count, messages = len(old.parameters), _lasting(result.notices)
    scored, kept, nominal = old[: requirement.runs], old[requirement.runs : count], old[count:]
    begun = requirement.runs + requirement.failed
    # Runs that time was short for are made now.
    failures = tuple(one for one in result.failures if one.reason != NOT_BEGUN or one.index >= begun + runs)
    seconds = result.seconds
    if runs > 0:
        points = _points(runner, requirement, begun, runs)
        new = runner.made(points, result.settings, midpoint=False, usage=band_usage(*points.shape))
        new = new if requirement.revolutions is None else cut(new, requirement.revolutions)
        seconds += new.seconds
        scored = scored.joined([new])
        messages += _lasting(new.notices)
        failures += tuple(replace(one, index=one.index + begun) for one in new.failures)
    kept = _without_twins(runner, scored, kept.joined(_others(runner, others, requirement, old)))
    messages += _foreign(runner, others, nominal)
    good = len(scored.parameters)
    requirement = replace(requirement, runs=good, failed=count_failed(failures))
    messages += failure_notices(failures, good + len(failures) + 1)
    made = replace(scored.joined([kept, nominal]), seconds=seconds, failures=failures)
    return _result(runner, requirement, made, messages)


def _result(
    runner: Runner, requirement: Requirement, runs: RunTable, notices: Sequence[Notice]
) -> StudyResult:
    """The result of runs at points of the study, then included ones, which may lie on a grid."""
    alone = len(runs.parameters) == requirement.runs
    random = alone and (not isinstance(runner.model, FinishedRuns) or runner.model.independent)
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
    return replace(result, notices=(*notices, *messages))


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
            for point in np.round(on_cube(runner.intervals, table.parameters) / _SAME_POINT) + 0.0
        ]
        for table in (scored, kept)
    )
    held_out = set(own)
    first: dict[tuple[bytes, bytes], int] = {}
    for row, (point, values) in enumerate(zip(others, kept.values, strict=True)):
        if point not in held_out:  # a table may have several runs at one point
            first.setdefault((point, hashlib.sha256(values.tobytes()).digest()), row)
    return kept[np.array(list(first.values()), dtype=np.intp)]
