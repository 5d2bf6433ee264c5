"""Measures accuracy against cost of the bounds of a study: degrees, points, runs and methods of bounding."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator, default_rng

from ..base.arguments import Checks
from ..base.rows import Array
from ..errors import ArgumentError, ArgumentTypeError, SimulationError
from ..notices import issue
from ..study.answers import result_of
from ..study.band.band import Band
from ..study.band.requirement import LEAST_RUNS
from ..study.designs import on_grid, spread_evenly
from ..study.polynomials.points import uniform_points
from ..study.polynomials.surrogate import MOST_RANGE_DEGREE, chebyshev_grid, tensor_grid
from ..study.results import StudyResult
from ..study.runner import Design, Runner
from ..study.sources.finished import FinishedRuns
from ..study.sources.scenes import MOST_NODES, MOST_RUNS
from ..study.spec import MAX_RUNS
from ..study.study import Study
from .bounds import StudyTradeoff, StudyTradeoffPoint

_MOST_CORNERS = 8  # parameters: 256 corners
# Margin for rounding of runs on the bound itself, relative to the largest width.
_SLACK = 1e-9


class _Setting(NamedTuple):
    """One set of runs, with its bands and stages if all of them succeeded."""

    kind: str
    degree: int | None
    points: int
    runs: int
    seconds: float
    status: str
    bands: Mapping[str, Band] | None = None
    stages: int = 0


def study_tradeoff(
    study: Study,
    degrees: Sequence[int] = (1, 2, 3, 4, 5),
    points: Sequence[int] = (5, 10),
    runs: Sequence[int] = (9, 21, 41, 81, 161, 321),
    *,
    holdout: int = 100,
    rng: int | Generator | None = 0,
    max_runs: int = MAX_RUNS,
) -> StudyTradeoff:
    """Measure accuracy against cost of the bounds: degrees, scan points, runs and methods of bounding.

    All bounds are compared with the hull of all runs, including hold-out runs at random points and at the
    corners of the box. It is an inner bound of the response: a true enclosure is at least as
    wide.

    Parameters
    ----------
    study : Study
        The study, of scenes or of a model of your own.
    degrees : sequence of int
        Degrees of Chebyshev studies, the same in every parameter [-].
    points : sequence of int
        Points of scans, the same for every parameter [-].
    runs : sequence of int
        Numbers of runs of bands at evenly spread points [-]; smaller bands use the first runs of the
        largest.
    holdout : int
        Number of random points [-], at least 2, in addition to the corners of up to 8 parameters.
    rng : int, numpy.random.Generator or None
        Seed of the random points, as of `Study.band`.
    max_runs : int
        Largest number of runs of all settings and hold-out runs; with more, no run is started [-].

    Returns
    -------
    StudyTradeoff
        Settings with failed runs are included with their status.

    Raises
    ------
    SceneError
        If a scene is wrong.
    SimulationError
        If a hold-out run fails, since there is no reference then.
    ValueError, TypeError
        If an argument is wrong; all problems are listed.

    Examples
    --------
    >>> from chebclear import Study, Interval, mechanisms, study_tradeoff
    >>> sides = {"crank_length": Interval.around(0.05, rel=0.1)}
    >>> study = Study(mechanisms.slider_crank, sides, ["slider.x"], duration=1e-3, samples=11)
    >>> len(study_tradeoff(study, degrees=[2], points=[5], runs=[9]).points)
    5
    """
    if not isinstance(study, Study):
        raise ArgumentTypeError(f"study must be a Study, got {study!r}")
    if isinstance(study.runner.model, FinishedRuns):
        raise ArgumentError("a tradeoff makes further runs, which a table of finished runs does not have")
    runner, checks = study.runner, Checks()
    seed = checks.seed("rng", rng)
    grids: list[tuple[int | None, int]] = [
        (degree, degree + 1) for degree in _counts(checks, "degrees", degrees, 1, MOST_NODES - 1)
    ]
    grids += [(None, count) for count in _counts(checks, "points", points, 2, MOST_NODES)]
    budgets = sorted(set(_counts(checks, "runs", runs, LEAST_RUNS, MOST_RUNS)))
    sides = len(runner.intervals)
    for _, count in grids:
        if count**sides > MOST_RUNS:
            checks.add(
                "degrees",
                f"and points must lead to at most {MOST_RUNS} runs, got {count}^{sides}: leave out the "
                "higher degrees or the finer scans",
            )
    if not grids and not budgets:
        checks.add("degrees", "points and runs must not all be empty")
    checks.whole("holdout", holdout, least=2, most=MOST_RUNS)
    checks.whole("max_runs", max_runs, least=1)
    checks.finish()
    probed = _holdout_points(runner, holdout, seed)
    needed = len(probed) + sum(count**sides for _, count in grids) + max(budgets, default=0)
    if needed > max_runs:
        raise ArgumentError(
            f"all settings and hold-out points are {needed} runs, more than max_runs = {max_runs}: leave out "
            "the higher degrees or the finer scans"
        )
    probes = _carried_out(runner, on_grid(runner, probed, (holdout,)))
    if not probes.outputs:
        raise ArgumentError("a tradeoff compares bands of outputs: name some in Study(outputs=...)")
    settings = [_grid(runner, *grid) for grid in grids]
    bands = _bands(runner, budgets, seed)
    # Bands of fewer runs use the first ones of the largest.
    known = [probes.bands, *(one.bands for one in [*settings, *bands[-1:]] if one.bands is not None)]
    found = _compared([*settings, *bands], probes, known, seed)
    issue(found.notices)
    return found


def _carried_out(runner: Runner, design: Design) -> StudyResult:
    """The result of a design without shares of requirements; issues no warnings."""
    return result_of(runner, design, runner.made(design.points, design.settings, usage=design.usage))


def _counts(checks: Checks, name: str, given: object, least: int, most: int) -> list[int]:
    if isinstance(given, str) or not isinstance(given, Iterable):
        checks.add(name, f"must be a list of whole numbers, got {given!r}", wrong_type=True)
        return []
    return [checks.whole(f"{name}[{k}]", value, least=least, most=most) for k, value in enumerate(given)]


def _compared(
    settings: Sequence[_Setting], probes: StudyResult, known: Sequence[Mapping[str, Band]], seed: int
) -> StudyTradeoff:
    """The settings beside the hull of all `known` runs, those of `probes` first."""
    runs = {name: np.concatenate([bands[name].runs for bands in known]) for name in probes.outputs}
    count = len(runs[probes.outputs[0]])
    half = default_rng(seed).permutation(count)[: count // 2]
    reference = {name: (values.min(axis=0), values.max(axis=0)) for name, values in runs.items()}
    widths = np.array([np.mean(upper - lower) for lower, upper in reference.values()])
    halves = np.array([np.mean(np.ptp(values[half], axis=0)) for values in runs.values()])
    return StudyTradeoff(
        outputs=probes.outputs,
        points=tuple(point for setting in settings for point in _points(setting, probes, reference)),
        holdout=len(probes.parameters),
        reference_runs=count,
        reference_width=widths,
        reference_change=_relative(widths - halves, widths),
        notices=probes.notices,
    )


def _holdout_points(runner: Runner, count: int, seed: int) -> Array:
    """Random points of the box and its corners, shape (runs, parameters)."""
    points = runner.drawn(lambda box: uniform_points(box, count, seed))
    if len(runner.intervals) > _MOST_CORNERS:
        return points
    ends = [(side.lower, side.upper) for side in runner.intervals.values()]
    return np.concatenate([points, list(itertools.product(*ends))])


def _grid(runner: Runner, degree: int | None, count: int) -> _Setting:
    sides = list(runner.intervals.values())
    counts, degrees = (count,) * len(sides), None
    if degree is None:
        grid = tensor_grid([np.linspace(side.lower, side.upper, count) for side in sides])
    else:
        grid, degrees = chebyshev_grid(sides, counts), (degree,) * len(sides)
    start, status, bands, stages = time.perf_counter(), "done", None, 0
    try:
        found = _carried_out(runner, on_grid(runner, grid, counts, degrees, "eq31"))
        if found.failures:
            status = found.failures[0].reason
        else:
            bands, stages = found.bands, sum(one.stages for one in found.stats)
    except SimulationError as error:
        status = error.reason
    seconds = time.perf_counter() - start
    return _Setting("scan", degree, count, len(grid) + 1, seconds, status, bands, stages)


def _bands(runner: Runner, budgets: Sequence[int], seed: int) -> list[_Setting]:
    """Calibrated bands of these numbers of runs; smaller ones use the first runs of the largest."""
    if not budgets:
        return []
    most = budgets[-1]
    try:
        largest = _carried_out(runner, spread_evenly(runner, most, 0.999, seed))
    except SimulationError as error:
        return [_Setting("band", None, count, count + 1, math.nan, error.reason) for count in budgets]
    settings = []
    for count in budgets:
        start = time.perf_counter()
        failed = sum(one.index < count for one in largest.failures)
        bands = largest.bands_of_first(count - failed, runner.execution.threads)
        seconds = time.perf_counter() - start + largest.seconds * (count + 1) / (most + 1)
        stages = sum(one.stages for one in [*largest.stats[: count - failed], *largest.stats[-1:]])
        settings.append(_Setting("band", None, count, count + 1, seconds, "done", bands, stages))
    return settings


def _points(
    setting: _Setting, probes: StudyResult, reference: dict[str, tuple[Array, Array]]
) -> Iterator[StudyTradeoffPoint]:
    """The points of all methods of bounding with the same runs."""
    ways: dict[str, Callable[[Band], tuple[Array, Array]]] = {setting.kind: _limits}
    unknown = np.full(len(reference), math.nan)
    fits = unknown
    if setting.degree is not None:
        ways = {"interval": _limits, "polynomial": _polynomial_limits, "sampled": _sampled_limits}
        if setting.bands is not None:
            errors = (_fit_error(setting.bands[name], probes, *ends) for name, ends in reference.items())
            fits = np.array(list(errors))
    for bounds, limits in ways.items():
        start = time.perf_counter()
        width, inside, escape = unknown, unknown, unknown
        if setting.bands is not None:
            pairs = {name: limits(setting.bands[name]) for name in reference}
            rows = [_judge(*pairs[name], *reference[name], probes[name].runs) for name in reference]
            width, inside, escape = np.array(rows).T
        seconds = setting.seconds + (time.perf_counter() - start)
        facts = (setting.degree, setting.points, setting.runs, setting.stages, seconds, setting.status)
        fit = unknown if bounds == "sampled" else fits
        yield StudyTradeoffPoint(bounds, *facts, width, inside, escape, fit)


def _limits(band: Band) -> tuple[Array, Array]:
    return band.lower, band.upper


def _sampled_limits(band: Band) -> tuple[Array, Array]:
    return band.runs.min(axis=0), band.runs.max(axis=0)


def _polynomial_limits(band: Band) -> tuple[Array, Array]:
    """The certified range of the polynomial; NaN above the largest degree for which it is available."""
    surrogate = band.surrogate
    if surrogate is None or max(surrogate.degrees) > MOST_RANGE_DEGREE:
        return np.full(len(band.t), math.nan), np.full(len(band.t), math.nan)
    return surrogate.bounds()


def _fit_error(band: Band, probes: StudyResult, least: Array, most: Array) -> float:
    """Largest difference of polynomial and hold-out runs over the width of the reference [-]."""
    values = band.evaluate(**dict(zip(band.intervals, probes.parameters.T, strict=True)))
    return float(_relative(np.max(np.abs(values - probes[band.name].runs)), np.max(most - least)))


def _judge(lower: Array, upper: Array, least: Array, most: Array, runs: Array) -> tuple[float, float, float]:
    """Width error, containment and escape of bounds against the reference and the hold-out runs [-].

    All are NaN where there are no bounds.
    """
    width = float(np.max(most - least))
    outside = np.maximum(lower - runs, runs - upper)
    mean = np.mean(most - least)
    return (
        float(_relative(np.mean(upper - lower) - mean, mean)),
        float(np.mean(np.where(np.isnan(outside), math.nan, outside <= _SLACK * width))),
        float(_relative(max(np.max(outside), 0.0), width)),
    )


def _relative(difference: Any, scale: Any) -> Any:
    """The difference over the scale; NaN where the scale is zero."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(np.equal(scale, 0.0), math.nan, np.divide(difference, scale))
