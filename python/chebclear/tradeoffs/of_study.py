"""Measures accuracy against cost of the bounds of a study: degrees, points, runs and methods of bounding."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.random import Generator, default_rng
from numpy.typing import NDArray

from ..base.arguments import Checks
from ..errors import ArgumentError, ArgumentTypeError, SimulationError
from ..run.notices import issue
from ..scene.scene import Interval
from ..study import sampled
from ..study.band.band import Band
from ..study.designs import carried_out, on_grid
from ..study.polynomials.surrogate import MOST_RANGE_DEGREE, chebyshev_grid, tensor_grid
from ..study.results import StudyResult
from ..study.runner import Runner
from ..study.sources.finished import FinishedRuns
from ..study.sources.scenes import MOST_NODES, MOST_RUNS
from ..study.spec import MAX_RUNS
from ..study.study import Study
from .bounds import StudyTradeoff, StudyTradeoffPoint

Array = NDArray[np.float64]

_MOST_CORNERS = 8  # parameters: 256 corners
# Margin for rounding of runs on the bound itself, relative to the largest width.
_SLACK = 1e-9


@dataclass
class _Setting:
    """One set of runs, with its bands if all of them succeeded."""

    kind: str
    degree: int | None
    points: int
    runs: int
    result: StudyResult | None
    seconds: float
    status: str

    @property
    def stages(self) -> int:
        return 0 if self.result is None else sum(stats.stages for stats in self.result.stats)


@dataclass(frozen=True)
class TradeoffSpec:
    """Settings that are compared."""

    degrees: Iterable[int]
    """Degrees of Chebyshev studies."""
    points: Iterable[int]
    """Points of scans."""
    runs: Iterable[int]
    """Runs of calibrated bands."""
    holdout: int
    """Random hold-out points."""
    seed: int
    """Seed of these points and of those of bands."""
    max_runs: int
    """Largest number of runs; with more, no run is started."""


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
    checks = Checks()
    seed = checks.seed("rng", rng)
    result = _measured(study.runner, TradeoffSpec(degrees, points, runs, holdout, seed, max_runs), checks)
    issue(result.notices)
    return result


def _measured(study: Runner, asked: TradeoffSpec, checks: Checks) -> StudyTradeoff:
    """Compare the bounds of a study; see `study_tradeoff`."""
    probed, wanted, budgets = _checked(study, asked, checks)
    probes = carried_out(study, on_grid(study, probed, (asked.holdout,)))
    if not probes.outputs:
        raise ArgumentError("a tradeoff compares bands of outputs: name some in Study(outputs=...)")
    seed = asked.seed
    settings = [_run(study, degree, count) for degree, count in wanted]
    settings += _bands(study, budgets, seed)

    outputs = probes.outputs
    runs = {
        name: np.concatenate(
            # Bands of fewer runs use the same ones.
            [probes[name].runs, *(s.result[name].runs for s in _distinct(settings) if s.result is not None)]
        )
        for name in outputs
    }
    count = len(runs[outputs[0]])
    half = default_rng(seed).permutation(count)[: count // 2]
    reference = {name: (values.min(axis=0), values.max(axis=0)) for name, values in runs.items()}
    widths = np.array([np.mean(upper - lower) for lower, upper in reference.values()])
    halves = np.array([np.mean(np.ptp(values[half], axis=0)) for values in runs.values()])
    return StudyTradeoff(
        outputs=outputs,
        points=tuple(point for setting in settings for point in _points(setting, probes, reference, study)),
        holdout=len(probes.parameters),
        reference_runs=count,
        reference_width=widths,
        reference_change=_relative(widths - halves, widths),
        notices=probes.notices,
    )


def _distinct(settings: Sequence[_Setting]) -> Iterator[_Setting]:
    """The settings with runs that no other one has."""
    bands = [setting for setting in settings if setting.kind == "band"]
    for setting in settings:
        if setting.result is not None and (setting.kind != "band" or setting is bands[-1]):
            yield setting


def _checked(
    study: Runner, asked: TradeoffSpec, checks: Checks
) -> tuple[Array, list[tuple[int | None, int]], list[int]]:
    """Hold-out points, degree, if any, and points of every grid, and runs of every band."""
    sides = list(study.intervals.values())
    wanted: list[tuple[int | None, int]] = []
    budgets: list[int] = []
    for name, given, least, most in (
        ("degrees", asked.degrees, 1, MOST_NODES - 1),
        ("points", asked.points, 2, MOST_NODES),
        ("runs", asked.runs, sampled.LEAST_RUNS, MOST_RUNS),
    ):
        if isinstance(given, str) or not isinstance(given, Iterable):
            checks.add(f"{name} must be a list of whole numbers, got {given!r}", wrong_type=True)
            continue
        for index, value in enumerate(given):
            count = checks.whole(f"{name}[{index}]", value, least=least, most=most)
            if name == "runs":
                budgets.append(count)
            else:
                wanted.append((count, count + 1) if name == "degrees" else (None, count))
    for _, count in wanted:
        if count ** len(sides) > MOST_RUNS:
            checks.add(
                f"a study must have at most {MOST_RUNS} runs, got {count}^{len(sides)}: leave out the "
                "higher degrees or the finer scans"
            )
    if not wanted and not budgets:
        checks.add("degrees, points and runs must not all be empty")
    checks.whole("holdout", asked.holdout, least=2, most=MOST_RUNS)
    checks.whole("max_runs", asked.max_runs, least=1)
    checks.finish()
    probed = _holdout_points(study, asked.holdout, asked.seed)
    runs = len(probed) + sum(count ** len(sides) for _, count in wanted) + max(budgets, default=0)
    if runs > asked.max_runs:
        raise ArgumentError(
            f"all settings and hold-out points are {runs} runs, more than max_runs = {asked.max_runs}: leave "
            "out the higher degrees or the finer scans"
        )
    return probed, wanted, sorted(set(budgets))


def _holdout_points(study: Runner, count: int, seed: int) -> Array:
    """Random points of the box and its corners, shape (runs, parameters)."""
    sides = list(study.intervals.values())
    lower, upper = (np.array([getattr(side, end) for side in sides]) for end in ("lower", "upper"))
    points = study.drawn(lambda box: _random(box, count, seed))
    if len(sides) > _MOST_CORNERS:
        return points
    corners = np.array(list(itertools.product(*zip(lower, upper, strict=True))))
    return np.concatenate([points, corners])


def _random(box: Mapping[str, Interval], count: int, seed: int) -> Array:
    lower, upper = (np.array([getattr(side, end) for side in box.values()]) for end in ("lower", "upper"))
    points: Array = lower + (upper - lower) * default_rng(seed).random((count, len(box)))
    return points


def _run(study: Runner, degree: int | None, count: int) -> _Setting:
    sides = list(study.intervals.values())
    counts = (count,) * len(sides)
    if degree is None:
        grid = tensor_grid([np.linspace(side.lower, side.upper, count) for side in sides])
    else:
        grid = chebyshev_grid(sides, counts)
    degrees = None if degree is None else (degree,) * len(sides)
    start = time.perf_counter()
    try:
        found = carried_out(study, on_grid(study, grid, counts, degrees, "eq31"))
        result, status = (None, found.failures[0].reason) if found.failures else (found, "done")
    except SimulationError as error:
        result, status = None, error.reason
    kind = "scan" if degree is None else "chebyshev"
    return _Setting(kind, degree, count, len(grid) + 1, result, time.perf_counter() - start, status)


def _bands(study: Runner, budgets: Sequence[int], seed: int) -> list[_Setting]:
    """Calibrated bands of these numbers of runs; smaller ones use the first runs of the largest."""
    if not budgets:
        return []
    most = budgets[-1]
    try:
        largest = carried_out(study, sampled.spread_evenly(study, most, 0.999, seed))
    except SimulationError as error:
        return [_Setting("band", None, count, count + 1, None, math.nan, error.reason) for count in budgets]
    settings = []
    for count in budgets:
        start = time.perf_counter()
        result = sampled.shortened(study, largest, count)
        seconds = time.perf_counter() - start + largest.seconds * (count + 1) / (most + 1)
        settings.append(_Setting("band", None, count, count + 1, result, seconds, "done"))
    return settings


def _points(
    setting: _Setting, probes: StudyResult, reference: dict[str, tuple[Array, Array]], study: Runner
) -> Iterator[StudyTradeoffPoint]:
    """The points of all methods of bounding with the same runs."""
    if setting.degree is None:
        ways: dict[str, Callable[[Band], tuple[Array, Array]]] = {setting.kind: _limits}
    else:
        ways = {"interval": _limits, "polynomial": _polynomial_limits, "sampled": _sampled_limits}
    unknown = np.full(len(reference), math.nan)
    fits = unknown if setting.result is None or setting.degree is None else np.empty(len(reference))
    if setting.result is not None and setting.degree is not None:
        for index, (name, (lower, upper)) in enumerate(reference.items()):
            fits[index] = _fit_error(setting.result[name], probes, np.max(upper - lower))
    for bounds, limits in ways.items():
        start = time.perf_counter()
        numbers = [unknown, unknown, unknown]
        if setting.result is not None:
            found = [limits(setting.result[name]) for name in reference]
            columns = [
                _judge(*pair, *reference[name], probes[name].runs)
                for name, pair in zip(reference, found, strict=True)
            ]
            numbers = [np.array(column) for column in zip(*columns, strict=True)]
        yield StudyTradeoffPoint(
            bounds=bounds,
            degree=setting.degree,
            points=setting.points,
            runs=setting.runs,
            stages=setting.stages,
            seconds=setting.seconds + (time.perf_counter() - start),
            status=setting.status,
            width_error=numbers[0],
            containment=numbers[1],
            escape=numbers[2],
            fit_error=unknown if bounds == "sampled" else fits,
        )


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


def _fit_error(band: Band, probes: StudyResult, width: float) -> float:
    """Largest difference of polynomial and hold-out runs over a width [-]."""
    values = band.evaluate(**dict(zip(band.intervals, probes.parameters.T, strict=True)))
    return float(_relative(np.max(np.abs(values - probes[band.name].runs)), width))


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
