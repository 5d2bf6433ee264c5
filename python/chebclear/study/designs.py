"""Where a study simulates and what that costs: checked arguments, points, and the time of their runs."""

from __future__ import annotations

import math
import os
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ..base.arguments import Checks
from ..base.rows import Array
from ..errors import ArgumentError
from ..execution.costs import Costs, Plan, seconds_of
from ..execution.dispatch import worker_count
from ..execution.memory import Usage, study_memory
from ..run.memory import taken
from ..run.settings import Settings, checked_settings
from .answers import result_of
from .band.gridded import Grid
from .band.requirement import LEAST_RUNS, Requirement, band_usage, exact_runs
from .by_angle import check_turns, turning
from .polynomials.points import between_nodes, uniform_points
from .polynomials.surrogate import MOST_RANGE_DEGREE, BoundKind, chebyshev_grid, tensor_grid
from .results import StudyResult, checked_results
from .runner import Design, Runner
from .sources.finished import FinishedRuns
from .sources.run_table import RunTable
from .sources.scenes import MOST_NODES, MOST_RUNS
from .spec import check_runs, per_parameter

BAND_RTOL = 1e-4
"""Relative tolerance of the runs of a band where nothing was said [-]."""
# Runs that are timed, one for each worker at first, become more by this factor until they take so long [s],
# but no more than this part of the study: what a study takes besides its runs, some tens of milliseconds, is
# then told from them, and the scatter of single runs, about a third, averages out.
_MORE, _ENOUGH, _PART = 4, 0.5, 4
# Samples of which polynomials are fitted for a plan, at first and then.
_FITTED = 8, 32


def band(
    runner: Runner,
    runs: int | None,
    coverage: float,
    seconds: float | None,
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
    coverage = checks.real("coverage", coverage, "-", above=0.0, below=1.0)
    if seconds is not None:
        seconds = checks.real("seconds", seconds, "s", above=0.0)
    if confidence is not None:
        confidence = checks.real("confidence", confidence, "-", above=0.0, below=1.0)
    if rtol is not None and runner.model is not None:
        checks.add("rtol", "is a setting of simulations: a model of your own does not use it")
    elif rtol is not None:
        checked_settings(checks, {"rtol": rtol})
    seed = checks.seed("rng", rng)
    skipped = 1 if discard is None else discard
    if revolutions is not None:
        check_turns(checks, runner.settings, revolutions, skipped)
    for name, value in {"discard": discard, "angle": angle}.items():
        if revolutions is None and value is not None:
            checks.add(name, f"is for bands by crank angle: give revolutions too, got {value!r}")
    others = checked_results(checks, include)
    checks.finish()
    settings = runner.settings
    if settings is not None and not (rtol is None and runner.rtol_given):
        # Included runs have theirs, and one band has one.
        theirs = [one.settings.rtol for one in others if one.settings is not None]
        settings = replace(settings, rtol=float(rtol) if rtol is not None else (*theirs, BAND_RTOL)[0])
    needed = exact_runs(coverage, confidence)
    requirement = Requirement(float(coverage), 0, seed, {}, confidence=confidence)
    if revolutions is not None and settings is not None:
        settings, turns = turning(runner, settings, revolutions, skipped, angle)
        requirement = replace(requirement, revolutions=turns)
    if isinstance(runner.model, FinishedRuns):
        points = runner.model.first(runs, LEAST_RUNS)
        independent = runner.model.independent and len(points) >= needed
        if confidence is not None and not runner.model.independent:
            raise ArgumentError(
                "nothing has a confidence by runs at points that someone chose: they must be drawn "
                "independently and uniformly from the box, Study.from_runs(..., independent=True)"
            )
        requirement = replace(requirement, finished=True, independent=independent)
        usage = band_usage(*points.shape)
    else:
        count = needed if runs is None else runs
        if count > most:
            took = f"a coverage of {coverage!r} takes" if runs is None else "runs are"
            checks.add("max_runs", f"= {most} is too small: {took} {count}")
            checks.finish()
        requirement = replace(requirement, independent=count >= needed)
        usage = band_usage(count, len(runner.parameters))
        points = requirement.points(runner, 0, count)
    if confidence is not None and len(points) < needed:
        raise ArgumentError(
            f"a coverage of {coverage!r} with a confidence of {confidence!r} takes {needed} independent "
            f"runs, got {len(points)}: ask for less, or for more runs"
        )
    least = LEAST_RUNS + 1 if runs is None else None
    return Design(points, settings, usage, requirement, others, seconds, least)


def spread_evenly(runner: Runner, runs: int, coverage: float, seed: int) -> Design:
    """The design of a band by so many runs at Sobol' points, however many."""
    requirement = Requirement(coverage, runs, seed, {})
    points, settings = requirement.points(runner, 0, runs), runner.settings
    if settings is not None and not runner.rtol_given:
        settings = replace(settings, rtol=BAND_RTOL)
    return Design(points, settings, band_usage(*points.shape), requirement)


def chebyshev(
    runner: Runner,
    degree: int | Mapping[str, int],
    nodes: int | Mapping[str, int] | None,
    bounds: BoundKind,
    max_runs: int,
) -> Design:
    """The design of `Study.chebyshev`; see there."""
    checks = Checks()
    sides = runner.intervals
    # One node more than the degree is needed.
    degrees = per_parameter(checks, "degree", degree, sides, [1] * len(sides), MOST_NODES - 1)
    least = [degree + 1 for degree in degrees]
    counts = least if nodes is None else per_parameter(checks, "nodes", nodes, sides, least)
    checks.whole("max_runs", max_runs, least=1)
    checks.word("bounds", bounds, ("range", "eq31"))
    checks.finish()
    check_runs(counts, max_runs, "a lower degree")
    if bounds == "range" and max(degrees) > MOST_RANGE_DEGREE:
        raise ArgumentError(
            f"degree must be at most {MOST_RANGE_DEGREE} for certified ranges, got {max(degrees)}: take a "
            "lower degree, or the bounds of Eq. (31)"
        )
    grid = chebyshev_grid(list(sides.values()), counts)
    # Of a finished table its other runs.
    table = runner.model if isinstance(runner.model, FinishedRuns) else None
    beside = between_nodes(sides, counts) if table is None else table.beside(grid)
    return on_grid(runner, np.vstack([grid, beside]), tuple(counts), tuple(degrees), bounds)


def scan(runner: Runner, points: int | Mapping[str, int], max_runs: int) -> Design:
    """The design of `Study.scan`; see there."""
    checks = Checks()
    sides = runner.intervals
    counts = per_parameter(checks, "points", points, sides, [2] * len(sides), MOST_NODES)
    checks.whole("max_runs", max_runs, least=1)
    checks.finish()
    check_runs(counts, max_runs, "fewer points")
    pairs = zip(sides.values(), counts, strict=True)
    axes = [np.linspace(side.lower, side.upper, count) for side, count in pairs]
    return on_grid(runner, tensor_grid(axes), tuple(counts))


def sample(runner: Runner, runs: int, rng: int | Generator | None) -> Design:
    """The design of `Study.sample`; see there."""
    checks = Checks()
    count = checks.whole("runs", runs, least=2, most=MOST_RUNS)
    start = checks.seed("rng", rng)
    checks.finish()
    table = runner.model if isinstance(runner.model, FinishedRuns) else None
    if table is not None:
        points, asked = table.points, Grid("sample", (len(table.points),), random=table.independent)
    else:
        points = runner.drawn(lambda box: uniform_points(box, count, start))
        asked = Grid("sample", (count,), random=True, seed=start)
    return Design(points, runner.settings, Usage(), asked)


def on_grid(
    runner: Runner,
    points: Array,
    counts: tuple[int, ...],
    degrees: tuple[int, ...] | None = None,
    bounds: BoundKind = "range",
) -> Design:
    """Runs on a grid of so many nodes or points of each parameter, then others that check the polynomials;
    without degrees their extremes are the bounds."""
    terms = math.prod(degree + 1 for degree in degrees) if degrees is not None else 0
    grid = Grid("scan" if degrees is None else "chebyshev", counts, degrees, bounds)
    return Design(points, runner.settings, Usage(terms=terms), grid)


def plan_of(runner: Runner, design: Design, probes: int | None, further: int = 0) -> Plan:
    """The cost of a design and of further runs of the same kind; see `Study.plan`."""
    runs, rows, measured = _timed(runner, design.points, design.settings, probes, _ENOUGH)
    count = len(design.points) + 1
    shape = count, len(runs.t), len(runs.outputs)
    features = 0 if runs.features is None else math.prod(runs.features.shape[1:])
    seconds = seconds_of(measured, count + further)
    if design.usage.terms and runs.outputs:
        seconds += _fit_seconds(runner, design, replace(runs, kept=rows[runs.kept]))
    return Plan(
        count + further,
        seconds,
        memory=taken() + study_memory(shape, design.usage, in_memory=runner.execution.in_memory),
        # A run leaves its counts, its key and a status besides.
        disk=8.0 * math.prod(shape) + (count + further) * (8.0 * features + 200.0),
        probes=sum(some for some, _ in measured),
    )


def _timed(
    runner: Runner,
    points: Array,
    settings: Settings | None,
    probes: int | None,
    enough: float,
) -> tuple[RunTable, NDArray[np.intp], list[tuple[int, float]]]:
    """Some runs, their numbers, and how many took how long at each time, until these take long enough [s]."""
    probe = replace(
        runner,
        execution=replace(runner.execution, store=None, max_seconds=None, in_memory=True),
        progress=None,
    )
    workers = probe.execution.threads or os.cpu_count() or 1
    if probe.execution.executor is not None:
        workers = worker_count(probe.execution.executor)
        probe.made(points[:workers], settings, midpoint=False)  # workers start with their first piece
    count = min(len(points), probes or workers)
    measured: list[tuple[int, float]] = []
    while True:
        rows = np.linspace(0, len(points) - 1, count).round().astype(int)
        runs = probe.made(points[rows], settings, midpoint=False)
        measured.append((count, runs.seconds))
        most = max(count, len(points) // _PART)
        if probes is not None or runs.seconds >= enough or count == most:
            return runs, rows, measured
        count = min(most, _MORE * count)


def _fit_seconds(runner: Runner, design: Design, runs: RunTable) -> float:
    """Time of the polynomials of a study [s], on the line through the times of a few samples and of more.

    The values are those of planes through the runs that were made: they are fitted in the time of any others,
    and bounded in that of smooth ones. Nothing better is known before the runs.
    """
    points = design.points
    known = np.column_stack([np.ones(len(points)), (points - points.mean(axis=0)) / np.ptp(points, axis=0)])
    known = np.vstack([known, np.eye(1, known.shape[1])])
    took = []
    for count in _FITTED:
        at = np.linspace(0, len(runs.t) - 1, min(count, len(runs.t))).round().astype(int)
        made = runs.values[:, at]
        plane = np.linalg.lstsq(known[runs.kept], made.reshape(len(made), -1), rcond=None)[0]
        all_runs = replace(
            runs,
            t=runs.t[at],
            values=(known @ plane).reshape(len(known), *made.shape[1:]),
            parameters=points,
            kept=np.arange(len(points)),
            stats=Costs.joined(()),
            features=None,
            failures=(),
        )
        begin = time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result_of(runner, design, all_runs)
        took.append((len(at), time.perf_counter() - begin))
    (few, short), (many, long) = took
    each = max(0.0, long - short) / max(1, many - few)
    return long + each * (len(runs.t) - many)
