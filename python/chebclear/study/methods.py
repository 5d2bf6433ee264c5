"""The methods of a study: choices of the points, and results from the runs."""

from __future__ import annotations

import copy
import math
import os
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.arguments import Checks
from ..errors import ArgumentError
from ..execution.counts import Costs
from ..execution.dispatch import worker_count
from ..execution.memory import SAMPLES_ALONE, Usage, study_memory, taken
from ..execution.plan import Plan, planned
from ..run.settings import Settings
from ..run.simulation import warn_once
from . import sampled
from .band.worst import WorstCase, predicted_extremes
from .costs import StudyTradeoff
from .models.finished import FinishedRuns
from .polynomials.points import between_nodes, uniform_points
from .polynomials.surrogate import MOST_RANGE_DEGREE, BoundKind, chebyshev_grid, tensor_grid
from .results import StudyResult
from .runner import Runner
from .runs import MOST_NODES, MOST_RUNS, Runs
from .spec import (
    MAX_RUNS,
    check_runs,
    per_parameter,
)
from .tradeoff import Asked, measure

Array = NDArray[np.float64]

# Runs that are simulated for a plan at first; the times of single runs scatter by about a third.
_PROBES, _PROBES_OF_WORKER = 12, 4
# They become more by this factor until they take so long [s], but no more than this part of the study: what a
# study takes besides its runs, some tens of milliseconds, is then told from them.
_MORE, _ENOUGH, _PART = 4, 0.5, 4
# Samples of which polynomials are fitted for a plan, at first and then.
_FITTED = 8, 32


class Methods(Runner):
    """The methods of `Study` that simulate."""

    def chebyshev(
        self,
        degree: int | Mapping[str, int] = 3,
        nodes: int | Mapping[str, int] | None = None,
        *,
        bounds: BoundKind = "range",
        max_runs: int = MAX_RUNS,
    ) -> StudyResult:
        """The paper's method: simulate on Chebyshev roots, fit polynomials, bound them.

        The verdict of every band says whether its polynomial follows the response, judged by its prediction
        of left-out runs; a warning names the outputs that are not resolved.

        Parameters
        ----------
        degree : int or mapping of str to int
            Degree of the polynomials [-], at least 1; for all parameters or by name.
        nodes : int or mapping of str to int, optional
            Number of roots [-]; one more than the degree if not given, and never fewer. The number of runs is
            their product, at most 1 000 000, and one at the midpoint; three more beside the roots show waves
            that vanish at these, and take part in the verdict alone.
        bounds : {"range", "eq31"}
            The certified range of each polynomial, up to degree 30; or Eq. (31) of the paper, which is wider.
        max_runs : int
            Largest number of runs on the roots; with more, no run is started [-]. Five parameters may need
            100 000.

        Returns
        -------
        StudyResult

        Raises
        ------
        SceneError
            If a scene is wrong; the parameters of the run are in the path of each problem.
        SimulationError
            If a run fails; it names the parameters, and there is no result.
        MemoryError
            If the samples do not fit into the memory.
        ValueError, TypeError
            If an argument is wrong; all problems are listed.
        """
        checks = Checks()
        # One node more than the degree is needed.
        degrees = per_parameter(
            checks, "degree", degree, self.intervals, [1] * len(self.intervals), MOST_NODES - 1
        )
        least = [degree + 1 for degree in degrees]
        counts = least if nodes is None else per_parameter(checks, "nodes", nodes, self.intervals, least)
        checks.whole("max_runs", max_runs, least=1)
        checks.word("bounds", bounds, ("range", "eq31"))
        checks.finish()
        check_runs(counts, max_runs, "a lower degree")
        if bounds == "range" and max(degrees) > MOST_RANGE_DEGREE:
            raise ArgumentError(
                f'degree must be at most {MOST_RANGE_DEGREE} for bounds="range", got {max(degrees)}: take a '
                'lower degree or bounds="eq31"'
            )
        grid = chebyshev_grid(list(self.intervals.values()), counts)
        # Of a finished table its other runs.
        table = self.model if isinstance(self.model, FinishedRuns) else None
        beside = between_nodes(self.intervals, counts) if table is None else table.beside(grid)
        points = np.vstack([grid, beside])
        return self._with_warnings(self.run_points(points, tuple(counts), tuple(degrees), bounds))

    def scan(self, points: int | Mapping[str, int] = 10, *, max_runs: int = MAX_RUNS) -> StudyResult:
        """Brute force: simulate on equally spaced points; the bounds are the extremes of the runs.

        Parameters
        ----------
        points : int or mapping of str to int
            Number of points [-], at least 2, both ends included; for all parameters or by name. The number of
            runs is their product, at most 1 000 000, and one at the midpoint that does not count for the
            bounds.
        max_runs : int
            Largest number of runs on the grid; with more, no run is started [-]. Ten points of five
            parameters are 100 000.

        Returns
        -------
        StudyResult
            Its bands are inner bounds and have no polynomial.

        Raises
        ------
        SceneError, SimulationError, ValueError, TypeError
            As `chebyshev`.
        """
        checks = Checks()
        counts = per_parameter(
            checks, "points", points, self.intervals, [2] * len(self.intervals), MOST_NODES
        )
        checks.whole("max_runs", max_runs, least=1)
        checks.finish()
        check_runs(counts, max_runs, "fewer points")
        sides = [
            np.linspace(side.lower, side.upper, count)
            for side, count in zip(self.intervals.values(), counts, strict=True)
        ]
        return self._with_warnings(self.run_points(tensor_grid(sides), tuple(counts), None))

    def band(
        self,
        runs: int | None = None,
        *,
        coverage: float = 0.999,
        rtol: float | None = None,
        seed: int = 0,
        include: StudyResult | Sequence[StudyResult] = (),
        max_runs: int = MAX_RUNS,
        cycles: int | None = None,
        discard: int | None = None,
        angle: str | None = None,
    ) -> StudyResult:
        """Bands that should contain further runs, calibrated on held-out runs.

        Simulates at the points of a scrambled Sobol' sequence and at the midpoint. Where a polynomial in the
        parameters follows an output, the band is its range, widened by its largest error at runs that it was
        not fitted to. Elsewhere no affordable number of runs resolves single runs, but the distribution of
        the output over the box changes slowly in time. The band then is a mean of running extremes of the
        runs over windows in time, widened by a tail that is fitted to what held-out runs exceed them by.

        With `cycles` the bands are **by crank angle**: all revolutions of all runs are pooled. This needs
        fewer runs, and remains valid when impacts have made long runs unpredictable.

        Parameters
        ----------
        runs : int, optional
            Number of runs at Sobol' points [-], at least 3, in addition to one at the midpoint; 81 if not
            given. Of a table of finished runs, the number of first runs to use; all if not given.
        coverage : float
            Share of the samples of a further run that should be inside [-], between 0 and 1.
        rtol : float, optional
            Relative tolerance of the integrator [-], in place of that of the study; 1e-4 if neither
            says one. Bands need no smaller one, although single runs change. Velocities of impacting
            mechanisms are resolved more often at 1e-5.
        seed : int
            Seed of the points [-], 0 to 2**64 - 1. The same seed gives exactly the same result on any number
            of threads.
        include : StudyResult or sequence of StudyResult, optional
            Results of the same study whose runs are included. They take part in all bands but are not
            held out, since their points may lie on a grid; for the same reason features of all runs then
            state nothing about a further run. Runs at points that the band has already are left out.
        max_runs : int
            Largest number of runs; with more, no run is started [-].
        cycles : int, optional
            Revolutions of every run [-] for bands by crank angle; the `samples` of the study are then those
            of one revolution. With a drive at constant speed the duration follows from `cycles`, in place of
            `skip` and `duration` of the study. If the speed is a parameter, or a torque drives the crank, the
            angle of every run is measured: outputs are interpolated between samples at most half a step
            apart.
            A torque drive needs a `duration` in which every run completes all `cycles`.
        discard : int, optional
            Number of first cycles that are not pooled [-], for the starting transient to decay; 1 if not
            given.
        angle : str, optional
            Name of the revolute joint whose angle is the crank angle; that of the only drive at constant
            speed if not given.

        Returns
        -------
        StudyResult
            `StudyResult.extend` adds runs. Bands that are ``"resolved"`` have a polynomial.

        Raises
        ------
        SceneError, SimulationError, ValueError, TypeError
            As `chebyshev`.
        """
        made = sampled.band(self, runs, coverage, rtol, seed, include, max_runs, cycles, discard, angle)
        return self._with_warnings(made)

    def certify(
        self, coverage: float = 0.999, *, rtol: float | None = None, seed: int = 0, max_runs: int = MAX_RUNS
    ) -> StudyResult:
        """Bands whose mean coverage of further runs is proved, for every mechanism.

        The only assumption is that parameters are drawn independently and uniformly from the box. The bands
        are hulls of independent runs at random points, widened as leave-one-out hulls require.

        Parameters
        ----------
        coverage : float
            Expected share of the samples of a further run inside [-], between 0 and 1. It needs
            1.5 / (1 - coverage) runs, 1500 for 0.999.
        rtol, seed, max_runs : optional
            As of `band` [-].

        Returns
        -------
        StudyResult
            `StudyResult.statement` says in words what is proved.

        Raises
        ------
        SceneError, SimulationError, ValueError, TypeError
            As `chebyshev`.
        """
        return self._with_warnings(sampled.certify(self, coverage, rtol, seed, max_runs))

    def extended(
        self, result: StudyResult, runs: int, include: StudyResult | Sequence[StudyResult] = ()
    ) -> StudyResult:
        """A result of `band` with further runs; see `StudyResult.extend`."""
        return self._with_warnings(sampled.extended(self, result, runs, include))

    def sample(self, runs: int = 81, *, seed: int = 0) -> StudyResult:
        """Simulate at independent, uniformly distributed random points of the box, as for features.

        Parameters
        ----------
        runs : int
            Number of runs [-], at least 2 and at most 1 000 000, in addition to one at the midpoint. Ignored
            for a table of finished runs, of which all are used.
        seed : int
            Seed of the random points [-].

        Returns
        -------
        StudyResult
            Its bands are the extremes of the runs.

        Raises
        ------
        SceneError, SimulationError, ValueError, TypeError
            As `chebyshev`.
        """
        checks = Checks()
        count = checks.whole("runs", runs, least=2, most=MOST_RUNS)
        start = checks.whole("seed", seed, least=0, most=sampled.MOST_SEED)
        checks.finish()
        if isinstance(self.model, FinishedRuns):
            own = self.model.points
            return self._with_warnings(
                self.run_points(own, (len(own),), None, random=self.model.independent, kind="sample")
            )
        points = self.drawn(lambda box: uniform_points(box, count, start))
        made = self.run_points(points, (count,), None, random=True, kind="sample")
        return self._with_warnings(replace(made, seed=start))

    def tradeoff(
        self,
        degrees: Sequence[int] = (1, 2, 3, 4, 5),
        points: Sequence[int] = (5, 10),
        runs: Sequence[int] = (9, 21, 41, 81, 161, 321),
        *,
        certify: float | None = 0.99,
        holdout: int = 100,
        seed: int = 0,
        max_runs: int = MAX_RUNS,
    ) -> StudyTradeoff:
        """Measure accuracy against cost of the bounds: degrees, scan points, runs and methods of bounding.

        All bounds are compared with the hull of all runs, including hold-out runs at random points and at the
        corners of the box. It is an inner bound of the response: a true enclosure is at least as
        wide.

        Parameters
        ----------
        degrees : sequence of int
            Degrees of Chebyshev studies, the same in every parameter [-].
        points : sequence of int
            Points of scans, the same for every parameter [-].
        runs : sequence of int
            Numbers of runs of calibrated bands [-]; smaller bands use the first runs of the largest.
        certify : float or None
            Coverage of a certified band [-]; None for none.
        holdout : int
            Number of random points [-], at least 2, in addition to the corners of up to 8 parameters.
        seed : int
            Seed of the random points [-].
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
        """
        if isinstance(self.model, FinishedRuns):
            raise ArgumentError("a tradeoff makes further runs, which a table of finished runs does not have")
        asked = Asked(degrees, points, runs, certify, holdout, seed, max_runs)
        result = measure(self, asked)
        warn_once(result.warnings)
        return result

    def worst_cases(self, result: StudyResult) -> tuple[WorstCase, ...]:
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
        runs = self.made(points, result.settings, midpoint=False)
        columns = [runs.outputs.index(name) for name, *_ in found]
        rows = {int(point): row for row, point in enumerate(runs.kept)}
        return tuple(
            WorstCase(
                output=name,
                side=side,
                time=float(result.t[sample]),
                parameters=dict(zip(self.intervals, map(float, at), strict=True)),
                predicted=predicted,
                simulated=float(runs.values[rows[point], sample, column]) if point in rows else math.nan,
            )
            for point, ((name, side, sample, at, predicted), column) in enumerate(
                zip(found, columns, strict=True)
            )
        )

    def _with_warnings(self, result: StudyResult) -> StudyResult:
        """The result of this study, after issuing its warnings."""
        warn_once(result.warnings)
        return replace(result, study=self, spec=self.spec)


class _Planned(Exception):
    """Carries the points and settings that a method was about to simulate."""

    def __init__(self, points: Array, settings: Settings | None, usage: Usage) -> None:
        super().__init__()
        self.points = points
        self.settings = settings
        self.usage = usage


def plan_of(study: Methods, method: str, probes: int | None, arguments: Mapping[str, Any]) -> Plan:
    """The cost of a method; see `Study.plan`."""

    def made(
        points: Array, settings: Settings | None, *, midpoint: bool = True, usage: Usage = SAMPLES_ALONE
    ) -> Runs:
        raise _Planned(points, settings, usage)

    probe = copy.copy(study)
    vars(probe)["made"] = made
    try:
        getattr(probe, method)(**arguments)
    except _Planned as found:
        points, settings, usage = found.points, found.settings, found.usage
    del vars(probe)["made"]
    probe.means = replace(study.means, store=None, max_seconds=None, in_memory=True)
    probe.progress = None
    workers = probe.means.threads or os.cpu_count() or 1
    if probe.means.executor is not None:
        workers = worker_count(probe.means.executor)
        probe.made(points[:workers], settings, midpoint=False)  # workers start with their first piece
    count = min(len(points), probes or max(_PROBES, _PROBES_OF_WORKER * workers))
    measured: list[tuple[int, float]] = []
    while True:
        rows = np.linspace(0, len(points) - 1, count).round().astype(int)
        runs = probe.made(points[rows], settings, midpoint=False)
        measured.append((count, runs.seconds))
        most = max(count, len(points) // _PART)
        if probes is not None or runs.seconds >= _ENOUGH or count == most:
            break
        count = min(most, _MORE * count)
    shape = (len(points) + 1, len(runs.t), len(runs.outputs))
    features = len(runs.feature_names) * (1 if runs.features is None else runs.features.shape[1])
    memory = taken() + study_memory(shape, usage, in_memory=study.means.in_memory)
    fits = 0.0
    if usage.terms and runs.outputs:
        fits = _fit_seconds(probe, method, arguments, points, replace(runs, kept=rows[runs.kept]))
    return planned(shape, features, measured, memory, fits)


def _fit_seconds(
    probe: Methods, method: str, arguments: Mapping[str, Any], points: Array, runs: Runs
) -> float:
    """Time of the polynomials of a study [s], on the line through the times of a few samples and of more.

    The values are those of planes through the runs that were made: they are fitted in the time of any others,
    and bounded in that of smooth ones. Nothing better is known before the runs.
    """
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
            kept=np.arange(len(points)),
            stats=Costs.joined(()),
            features=None,
            failures=(),
        )
        vars(probe)["made"] = lambda *given, result=all_runs, **options: result
        begin = time.perf_counter()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            getattr(probe, method)(**arguments)
        took.append((len(at), time.perf_counter() - begin))
    (few, short), (many, long) = took
    each = max(0.0, long - short) / max(1, many - few)
    return long + each * (len(runs.t) - many)
