"""Where a study simulates and what that costs: the points of each method, and the result of their runs."""

from __future__ import annotations

import math
import os
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ..base.arguments import Checks
from ..errors import ArgumentError
from ..execution.counts import Costs
from ..execution.dispatch import worker_count
from ..execution.failures import count_failed
from ..execution.memory import Usage, study_memory, taken
from ..execution.plan import Plan, seconds_of
from ..run.settings import Settings
from ..scene.distributions import Uniform
from .band.notices import doubts, early_widths, told_holes
from .band.worst import WorstCase, predicted_extremes
from .features.features import NO_FEATURES, FeatureTable
from .polynomials.holes import fit_holes
from .polynomials.points import between_nodes, uniform_points
from .polynomials.surrogate import MOST_RANGE_DEGREE, BoundKind, chebyshev_grid, tensor_grid
from .results import StudyResult
from .runner import Runner
from .sources.finished import FinishedRuns
from .sources.run_table import RunTable
from .sources.scenes import MOST_NODES, MOST_RUNS
from .sources.units import units_of
from .spec import check_runs, per_parameter

Array = NDArray[np.float64]

# Runs that are simulated at first; the times of single runs scatter by about a third.
_PROBES, _PROBES_OF_WORKER = 12, 4
# They become more by this factor until they take so long [s], but no more than this part of the study: what a
# study takes besides its runs, some tens of milliseconds, is then told from them.
_MORE, _ENOUGH, _PART = 4, 0.5, 4
# Samples of which polynomials are fitted for a plan, at first and then.
_FITTED = 8, 32


@dataclass(frozen=True, eq=False)
class Design:
    """The runs that a method of a study asks for."""

    points: Array
    """Parameters of the runs [SI units], shape (runs, parameters); the nominal run comes besides."""
    settings: Settings | None
    """Settings of the runs; None if they are not simulated."""
    usage: Usage
    """What the result takes besides the samples."""
    result: Callable[[RunTable], StudyResult]
    """Makes the result of the runs."""
    independent: bool = False
    """Whether the points are independent and uniform in the box."""
    seed: int = 0
    """Seed of the points."""


def carried_out(runner: Runner, design: Design) -> StudyResult:
    """The result of a design; issues no warnings."""
    return design.result(runner.made(design.points, design.settings, usage=design.usage))


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
    axes = [
        np.linspace(side.lower, side.upper, count) for side, count in zip(sides.values(), counts, strict=True)
    ]
    return on_grid(runner, tensor_grid(axes), tuple(counts))


def sample(runner: Runner, runs: int, rng: int | Generator | None) -> Design:
    """The design of `Study.sample`; see there."""
    checks = Checks()
    count = checks.whole("runs", runs, least=2, most=MOST_RUNS)
    start = checks.seed("rng", rng)
    checks.finish()
    if isinstance(runner.model, FinishedRuns):
        points, independent, kept = runner.model.points, runner.model.independent, None
    else:
        points, independent, kept = runner.drawn(lambda box: uniform_points(box, count, start)), True, start
    design = on_grid(runner, points, (len(points),), random=independent, kind="sample")
    return replace(
        design,
        result=lambda made: replace(design.result(made), seed=kept),
        independent=independent,
        seed=start,
    )


def on_grid(
    runner: Runner,
    points: Array,
    counts: tuple[int, ...],
    degrees: tuple[int, ...] | None = None,
    bounds: BoundKind = "range",
    *,
    random: bool = False,
    kind: str | None = None,
) -> Design:
    """Runs on a grid of so many nodes or points of each parameter, then others that check the polynomials.

    Without degrees their extremes are the bounds. The points may be spread at `random` over the box; the
    `kind` of the result is ``"chebyshev"`` or ``"scan"`` by the degrees if it is not given.
    """

    def result(runs: RunTable) -> StudyResult:
        found = StudyResult.from_runs(
            runs,
            runner.intervals,
            degrees=degrees,
            nodes=counts,
            bounds=bounds,
            threads=runner.execution.threads,
            kind=kind,
            features=feature_table(runner, runs, random, count_failed(runs.failures)),
            units=runner.units,
        )
        # A result that is read from a file already has these notices.
        messages = [*doubts(found.bands), *early_widths(found.bands, found.scene)]
        lost = [one.index for one in runs.failures if one.index < math.prod(counts)]
        if degrees is not None and lost:
            messages += told_holes(fit_holes(counts, degrees, lost))
        return replace(found, notices=(*found.notices, *messages))

    terms = math.prod(degree + 1 for degree in degrees) if degrees is not None else 0
    return Design(points, runner.settings, Usage(terms=terms), result)


def feature_table(runner: Runner, runs: RunTable, random: bool, failed: int) -> FeatureTable:
    """The features of the runs."""
    if runs.features is None:
        return NO_FEATURES
    names = runs.feature_names
    return FeatureTable(
        names,
        runs.features[:-1],
        runs.features[-1],
        runner.intervals,
        runs.parameters,
        random,
        tuple(name for name, given in runner.random.items() if not isinstance(given, Uniform)),
        units_of(names, runner.features, runner.units, simulated=runner.settings is not None),
        failed,
        isinstance(runner.model, FinishedRuns),
        runs.nominal_parameters,
    )


def simulated_extremes(runner: Runner, result: StudyResult) -> tuple[WorstCase, ...]:
    """Runs at the worst cases that the polynomials of a result predict; see `StudyResult.check`."""
    found = [
        (name, *extreme)
        for name, band in result.bands.items()
        if band.verdict == "resolved" and band.surrogate is not None
        for extreme in predicted_extremes(band)
    ]
    if not found:
        raise ArgumentError(
            "no output is resolved by a polynomial, so there is no worst case to be checked: more runs "
            "may resolve one; features of the runs and their ranking need none"
        )
    points = np.array([at for _, _, _, at, _ in found])
    runs = runner.made(points, result.settings, midpoint=False)
    columns = [runs.outputs.index(name) for name, *_ in found]
    rows = {int(point): row for row, point in enumerate(runs.kept)}
    return tuple(
        WorstCase(
            output=name,
            side=side,
            time=float(result.t[sample]),
            parameters=dict(zip(runner.intervals, map(float, at), strict=True)),
            predicted=predicted,
            simulated=float(runs.values[rows[point], sample, column]) if point in rows else math.nan,
        )
        for point, ((name, side, sample, at, predicted), column) in enumerate(
            zip(found, columns, strict=True)
        )
    )


def plan_of(runner: Runner, design: Design, probes: int | None) -> Plan:
    """The cost of a design; see `Study.plan`."""
    runs, rows, measured = _timed(runner, design, probes, _ENOUGH, (_PROBES, _PROBES_OF_WORKER))
    count = len(design.points) + 1
    shape = count, len(runs.t), len(runs.outputs)
    features = 0 if runs.features is None else math.prod(runs.features.shape[1:])
    seconds = seconds_of(measured, count)
    if design.usage.terms and runs.outputs:
        seconds += _fit_seconds(design, replace(runs, kept=rows[runs.kept]))
    return Plan(
        count,
        seconds,
        memory=taken() + study_memory(shape, design.usage, in_memory=runner.execution.in_memory),
        # A run leaves its counts, its key and a status besides.
        disk=8.0 * math.prod(shape) + count * (8.0 * features + 200.0),
        probes=sum(some for some, _ in measured),
    )


def predicted_seconds(runner: Runner, design: Design, enough: float) -> tuple[float, tuple[int, int]]:
    """Time of the runs of a design [s], from some that take so long, with the samples and outputs of each."""
    # One for each worker at first: a single run may take longer than that.
    runs, _, measured = _timed(runner, design, None, enough, (1, 1))
    return seconds_of(measured, len(design.points) + 1), (len(runs.t), len(runs.outputs))


def _timed(
    runner: Runner, design: Design, probes: int | None, enough: float, first: tuple[int, int]
) -> tuple[RunTable, NDArray[np.intp], list[tuple[int, float]]]:
    """Some runs, their numbers, and how many took how long at each time, until these take long enough [s].

    If their number is not given, the `first` are so many, and so many for each worker.
    """
    points = design.points
    probe = replace(
        runner,
        execution=replace(runner.execution, store=None, max_seconds=None, in_memory=True),
        progress=None,
    )
    workers = probe.execution.threads or os.cpu_count() or 1
    if probe.execution.executor is not None:
        workers = worker_count(probe.execution.executor)
        probe.made(points[:workers], design.settings, midpoint=False)  # workers start with their first piece
    count = min(len(points), probes or max(first[0], first[1] * workers))
    measured: list[tuple[int, float]] = []
    while True:
        rows = np.linspace(0, len(points) - 1, count).round().astype(int)
        runs = probe.made(points[rows], design.settings, midpoint=False)
        measured.append((count, runs.seconds))
        most = max(count, len(points) // _PART)
        if probes is not None or runs.seconds >= enough or count == most:
            return runs, rows, measured
        count = min(most, _MORE * count)


def _fit_seconds(design: Design, runs: RunTable) -> float:
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
            design.result(all_runs)
        took.append((len(at), time.perf_counter() - begin))
    (few, short), (many, long) = took
    each = max(0.0, long - short) / max(1, many - few)
    return long + each * (len(runs.t) - many)
