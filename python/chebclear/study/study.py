"""Studies: many simulations of a mechanism with interval parameters, and the bands of its outputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from typing import Any

import numpy as np

from ..base.arguments import Checks
from ..base.progress import is_request
from ..run.settings import MAX_EVENTS, MAX_STEPS, Settings
from ..run.simulation import warn_once
from ..scene.scene import Interval, Scene
from . import sampled
from .arguments import (
    MAX_RUNS,
    Progress,
    check_keywords,
    check_runs,
    checked_fixed,
    checked_intervals,
    per_parameter,
)
from .band.hybrid import Normal, Uniform
from .features.features import Asked, checked_features, tracked_features
from .polynomials.surrogate import MOST_RANGE_DEGREE, BoundKind, chebyshev_grid, tensor_grid
from .results import StudyResult
from .runner import Runner
from .runs import MOST_NODES, MOST_RUNS
from .tradeoff import StudyTradeoff, measure

MOST_THREADS = 1024


class Study(Runner):
    """A mechanism whose parameters are known to lie in intervals.

    Parameters
    ----------
    build : callable
        Called as ``build(**parameters, **fixed)`` with physical values; returns the scene.
    parameters : mapping of str to Interval, Normal or Uniform
        Interval of each uncertain parameter [SI units]. A `normal` distribution is run over three standard
        deviations to either side, a `uniform` one over all of it; ``band.quantiles(study.random)`` then gives
        quantiles at the worst of the intervals.
    outputs : sequence of str, optional
        Names of the outputs of interest, or patterns such as ``"wrist.*"``; all quantities of bodies,
        clearance joints and drives if not given.
    duration : float
        Simulated time [s], above 0.
    samples : int
        Number of equally spaced samples, both ends included [-]; 2 to 10 000 000.
    skip : float
        Time to simulate before the first sample [s].
    rtol : float
        Relative tolerance of the integrator [-], from 1e-13 to 0.1.
    method : {"auto", "rodas5p", "rodas4", "dop853"}
        The explicit method of order 8 (DOP853) and a Rosenbrock method (Rodas4, Rodas5P at an rtol below
        3e-8), changing places with the stiffness of the motion; or one of them throughout. DOP853 alone is
        much dearer, though no less accurate, where a contact sticks.
    fixed : mapping of str to object, optional
        Further keywords of `build`, the same for all runs.
    threads : int, optional
        Threads to simulate on [-], at most 1024; all processors if not given, one for each piece given to an
        executor. The results are the same bits for any number.
    progress : True or callable, optional
        True shows a bar if standard error is a terminal; a callable gets the runs done and the runs in all.
    executor : concurrent.futures.Executor, optional
        Where to simulate instead of on threads of this process.
    max_steps, max_events : int
        Attempted steps, accepted or refused, and changes of contact after which a run is given up [-].
    position_tolerance, velocity_tolerance : float, optional
        Absolute tolerances [m], [m/s], at most half the smallest clearance, or the size of a scene without
        one, and the speed of the scene; from `rtol` and these scales if not given.
    features : mapping of str to Feature or callable, optional
        Numbers of every run by name, such as ``{"peak force": cc.peak("wrist.normal_force")}``: of the
        continuous motion, so that `outputs` may then be empty. A callable gets the `Trajectory` of every run,
        simulated once more for it in this process, and returns a number, or one for each cycle.
    cycles : int
        Equal pieces of the sampled time, each with features of its own [-].

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; all problems are listed.

    Examples
    --------
    >>> from chebclear import Study, interval, mechanisms
    >>> study = Study(
    ...     mechanisms.slider_crank,
    ...     {"crank_length": interval(0.05, rel=0.1)},
    ...     outputs=["slider.x"],
    ...     duration=1e-3,
    ...     samples=11,
    ... )
    >>> study.chebyshev(degree=2)["slider.x"].width.shape
    (11,)
    """

    def __init__(
        self,
        build: Callable[..., Scene],
        parameters: Mapping[str, Interval | Normal | Uniform],
        outputs: Sequence[str] | None = None,
        *,
        duration: float,
        samples: int,
        skip: float = 0.0,
        rtol: float = 1e-6,
        method: str = "auto",
        fixed: Mapping[str, Any] | None = None,
        threads: int | None = None,
        progress: bool | Progress | None = None,
        executor: Executor | None = None,
        max_steps: int = MAX_STEPS,
        max_events: int = MAX_EVENTS,
        position_tolerance: float | None = None,
        velocity_tolerance: float | None = None,
        features: Mapping[str, Asked] | None = None,
        cycles: int = 1,
    ) -> None:
        checks = Checks()
        self.features = checked_features(checks, features)
        self.build = build
        self.intervals = checked_intervals(checks, parameters)
        self.random = {
            name: given
            for name, given in (parameters.items() if isinstance(parameters, Mapping) else ())
            if isinstance(given, Normal | Uniform)
        }
        self.fixed = checked_fixed(checks, fixed)
        check_keywords(checks, build, self.intervals, self.fixed)
        self.settings = Settings.checked(
            checks,
            duration=duration,
            samples=samples,
            skip=skip,
            rtol=rtol,
            method=method,
            outputs=outputs,
            max_steps=max_steps,
            max_events=max_events,
            position_tolerance=position_tolerance,
            velocity_tolerance=velocity_tolerance,
            features=tracked_features(self.features.values()),
            cycles=cycles,
            outputs_needed=not self.features,
        )
        self.threads = (
            None if threads is None else checks.whole("threads", threads, least=1, most=MOST_THREADS)
        )
        if not is_request(progress):
            checks.add(f"progress must be None, True or callable, got {progress!r}", wrong_type=True)
        self.progress = progress
        if executor is not None and not callable(getattr(executor, "submit", None)):
            checks.add(f"executor must have a method submit, got {executor!r}", wrong_type=True)
        self.executor = executor
        checks.finish()

    def __repr__(self) -> str:
        sides = ", ".join(
            f"{name} in [{side.lower:g}, {side.upper:g}]" for name, side in self.intervals.items()
        )
        return f"<Study of {getattr(self.build, '__name__', self.build)}: {sides}>"

    def chebyshev(
        self,
        degree: int | Mapping[str, int] = 3,
        nodes: int | Mapping[str, int] | None = None,
        *,
        bounds: BoundKind = "range",
        max_runs: int = MAX_RUNS,
    ) -> StudyResult:
        """The paper's method: simulate on Chebyshev roots, fit polynomials, bound them.

        The verdict of every band says whether its polynomial follows the response, by predicting left-out
        runs; a warning names the outputs that are not resolved.

        Parameters
        ----------
        degree : int or mapping of str to int
            Degree of the polynomials [-], at least 1; for all parameters or by name.
        nodes : int or mapping of str to int, optional
            Number of roots [-]; one more than the degree if not given, and never fewer. The number of runs is
            their product, at most 1 000 000, and one at the midpoint.
        bounds : {"range", "eq31"}
            The certified range of each polynomial, up to degree 30; or Eq. (31) of the paper, which is wider.
        max_runs : int
            Runs on the roots above which nothing is started [-]: five parameters may mean 100 000.

        Returns
        -------
        StudyResult

        Raises
        ------
        SceneError
            If a scene is wrong; the parameters of the run are in the path of each problem.
        SimulationError
            If a run fails; names its parameters. No result is made from the others.
        MemoryError
            If the samples do not fit into the memory.
        ValueError, TypeError
            If an argument is wrong; all problems are listed.
        """
        checks = Checks()
        # One node more than the degree must be possible.
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
            raise ValueError(
                f'degree must be at most {MOST_RANGE_DEGREE} for bounds="range", got {max(degrees)}: take a '
                'lower degree or bounds="eq31"'
            )
        points = chebyshev_grid(list(self.intervals.values()), counts)
        return self._told(self.run_points(points, tuple(counts), tuple(degrees), bounds))

    def scan(self, points: int | Mapping[str, int] = 10, *, max_runs: int = MAX_RUNS) -> StudyResult:
        """Brute force: simulate on equally spaced points; the bounds are the extremes of the runs.

        Parameters
        ----------
        points : int or mapping of str to int
            Number of points [-], at least 2, both ends included; for all parameters or by name. The number of
            runs is their product, at most 1 000 000, and one at the midpoint that does not count for the
            bounds.
        max_runs : int
            Runs on the grid above which nothing is started [-]: ten points of five parameters are 100 000.

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
        return self._told(self.run_points(tensor_grid(sides), tuple(counts), None))

    def band(
        self,
        runs: int = 81,
        *,
        coverage: float = 0.999,
        rtol: float = 1e-4,
        seed: int = 0,
        include: StudyResult | Sequence[StudyResult] = (),
        max_runs: int = MAX_RUNS,
    ) -> StudyResult:
        """Bands that a further run keeps, with what runs that took no part in them say of it.

        Simulates at the points of a scrambled Sobol' sequence and at the midpoint. Where a polynomial in the
        parameters follows an output, the band is its range with its largest error at runs that it was not
        fitted to. Elsewhere no number of runs that one can afford resolves the single run, but its
        distribution over the box changes slowly in time: the band then is a mean of running extremes of the
        runs over windows in time, widened until held-out runs are inside.

        Parameters
        ----------
        runs : int
            Number of runs at Sobol' points [-], at least 3; one at the midpoint comes on top.
        coverage : float
            Share of the samples of a further run that should be inside [-], between 0 and 1.
        rtol : float
            Relative tolerance of the integrator [-], in place of that of the study: bands need no better
            runs, although single ones change. Velocities of impacting mechanisms are resolved more often at
            1e-5.
        seed : int
            Seed of the points [-], 0 to 2**64 - 1. The same seed gives the same bits on any number of
            threads.
        include : StudyResult or sequence of StudyResult, optional
            Results of the same study whose runs are taken as well. They take part in all bands but are not
            held out, since their points may lie on a grid.
        max_runs : int
            Runs above which nothing is started [-].

        Returns
        -------
        StudyResult
            Its `extend` adds runs. The bands have a polynomial where they are ``"resolved"``.

        Raises
        ------
        SceneError, SimulationError, ValueError, TypeError
            As `chebyshev`.
        """
        return self._told(sampled.band(self, runs, coverage, rtol, seed, include, max_runs))

    def certify(
        self, coverage: float = 0.999, *, rtol: float = 1e-4, seed: int = 0, max_runs: int = MAX_RUNS
    ) -> StudyResult:
        """Bands with a proof: a further run is inside with the coverage in the mean, for every mechanism.

        The one assumption is that parameters are drawn independently and uniformly from the box. The bands
        are hulls of independent runs at random points, widened as leave-one-out hulls demand.

        Parameters
        ----------
        coverage : float
            Expected share of the samples of a further run inside [-], between 0 and 1. It takes
            1.5 / (1 - coverage) runs, 1500 for 0.999.
        rtol, seed, max_runs : optional
            As of `band` [-].

        Returns
        -------
        StudyResult
            Its `statement` says in words what is proved.

        Raises
        ------
        SceneError, SimulationError, ValueError, TypeError
            As `chebyshev`.
        """
        return self._told(sampled.certify(self, coverage, rtol, seed, max_runs))

    def extended(
        self, result: StudyResult, runs: int, include: StudyResult | Sequence[StudyResult] = ()
    ) -> StudyResult:
        """A result of `band` with further runs; see `StudyResult.extend`."""
        return self._told(sampled.extended(self, result, runs, include), stacklevel=5)

    def sample(self, runs: int = 81, *, seed: int = 0) -> StudyResult:
        """Simulate at random points of the box, uniform and independent: what features want.

        Parameters
        ----------
        runs : int
            Number of runs [-], at least 2 and at most 1 000 000; one at the midpoint comes on top.
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
        start = checks.whole("seed", seed, least=0)
        checks.finish()
        sides = list(self.intervals.values())
        points = np.random.default_rng(start).uniform(
            [side.lower for side in sides], [side.upper for side in sides], (count, len(sides))
        )
        return self._told(self.run_points(points, (count,), None, random=True))

    def tradeoff(
        self,
        degrees: Sequence[int] = (1, 2, 3, 4, 5),
        points: Sequence[int] = (5, 10),
        *,
        holdout: int = 100,
        seed: int = 0,
        max_runs: int = MAX_RUNS,
    ) -> StudyTradeoff:
        """Measure accuracy against cost of the bounds: degrees, scan points and ways of bounding.

        All bounds are compared with what all runs together reach, hold-out runs at random points and at the
        corners of the box included. That is an inner bound of the response: a true enclosure is at least as
        wide.

        Parameters
        ----------
        degrees : sequence of int
            Degrees of Chebyshev studies, the same in every parameter [-].
        points : sequence of int
            Points of scans, the same for every parameter [-].
        holdout : int
            Number of random points [-], at least 2; the corners come on top, of up to 8 parameters.
        seed : int
            Seed of the random points [-].
        max_runs : int
            Runs of all settings and hold-out runs together above which nothing is started [-].

        Returns
        -------
        StudyTradeoff
            Settings of which a run failed are in it with their status.

        Raises
        ------
        SceneError
            If a scene is wrong.
        SimulationError
            If a hold-out run fails: there is nothing to compare with.
        ValueError, TypeError
            If an argument is wrong; all problems are listed.
        """
        result = measure(self, degrees, points, holdout=holdout, seed=seed, max_runs=max_runs)
        warn_once(result.warnings, stacklevel=3)
        return result

    def _told(self, result: StudyResult, stacklevel: int = 4) -> StudyResult:
        """The result of this study, with its warnings passed on to whoever called the caller."""
        warn_once(result.warnings, stacklevel=stacklevel)
        return replace(result, study=self)
