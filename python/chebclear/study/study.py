"""Studies: many simulations of a mechanism with interval parameters, and the bands of its outputs."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from inspect import signature
from typing import Any, Unpack

from numpy.random import Generator
from numpy.typing import ArrayLike

from ..base.arguments import Checks
from ..base.progress import Progress
from ..base.shown import meant_or_known
from ..execution.costs import Plan
from ..execution.options import ExecutionOptions, OnFailure
from ..notices import changes_answer, issue
from ..run.features import Feature
from ..run.settings import RunOptions, Settings, with_settings
from ..scene.distributions import Distribution
from ..scene.scene import Interval, Scene
from . import designs
from .answers import simulated_extremes
from .band.worst import WorstCase
from .conforming import answered, extended, runs_for_shares
from .function import StudyFunction, function_of
from .nominal import nominal_poses
from .polynomials.surrogate import BoundKind
from .requirements.specification import Specification
from .results import StudyResult
from .runner import Design, checked_runner
from .runs import Runs, runs_of
from .sources.asked import FeatureSpec
from .sources.finished import FinishedRuns, finished_runs
from .spec import MAX_RUNS
from .sweep import Sweep, sweep_of


@with_settings(RunOptions)
class Study:
    """A mechanism, or a model of your own, whose parameters are known to lie in intervals.

    Parameters
    ----------
    build : callable
        Called as ``build(**parameters, **fixed)`` with physical values; returns the scene. Without `duration`
        and `samples`, unless its annotation says that it returns a scene, it is a model of your own and
        returns a mapping: equally spaced instants as ``"t"`` with arrays for outputs, numbers for features.
    parameters : mapping of str to Interval or Distribution
        Interval of each uncertain parameter [SI units]. The interval of a `normal` or `lognormal`
        distribution is three standard deviations to either side, that of the others their whole range;
        ``band.quantiles(study.random)`` then gives quantiles for the worst case of the other intervals.
    outputs : sequence of str, optional
        Names of the outputs of interest, or patterns such as ``"wrist.*"``; all quantities of bodies,
        clearance joints and drives if not given, or all that a model of your own returns.
    settings : Settings, optional
        How to simulate; each of the fields that follow may be given as a keyword as well, or instead. A model
        of your own has none of them but `cycles`.
    {settings}
    fixed : mapping of str to object, optional
        Further keywords of `build`, the same for all runs.
    threads : int, optional
        Threads to simulate on [-], at most 1024; all processors if not given, one for each piece given to an
        executor. The results are the same bits for any number.
    progress : bool or callable, optional
        True shows a bar, or lines; a callable gets the runs done and the runs in all. If not given, only
        studies are shown that take more than ten seconds by a number of runs that the user did not choose.
    executor : concurrent.futures.Executor, optional
        Where runs are made instead of on threads of this process, or one after the other.
    features : mapping of str to Feature or callable, optional
        Scalar results of every run by name, such as ``{"peak": features.peak("wrist.normal_force")}``. They
        are taken from the continuous motion, so that `outputs` may be empty; for a model of your own, from
        the samples. A callable gets every run, as `simulate` returns it, and returns a number, or one for
        each cycle. Samples are available to it at once; contacts, peaks and other results of the continuous
        motion need the run to be repeated. For a model of your own it gets what the model returned.
    units : mapping of str to str, optional
        Units of parameters, of features that callables return, and of all that a model of your own returns,
        such as ``{"stiffness": "N/m"}``. Nothing is converted. Outputs of simulations, and parameters of
        ready-made mechanisms and scene files, have their units already.
    store : path, optional
        Folder that keeps every finished run. An interrupted study continues from there with exactly the same
        result, and a later study of the mechanism simulates only new runs. One of a model of your own needs
        a `version`; without a store its runs are kept in this process only.
    version : str, optional
        For a model of your own with a store: stands for the function and everything that it uses. The store
        compares this text and the data in `fixed`, so give another one whenever the model is another.
    on_failure : {"collect", "raise"}
        ``"collect"`` repeats failed simulations once with tighter tolerances, then collects them in
        `StudyResult.failures`; verdicts account for the gaps. ``"raise"`` raises for the first failure. That
        of the nominal run, or of more than half of the runs, always raises.
    run_seconds : float, optional
        Time limit of a simulation or a call [s]; beyond it the run has failed. A call that does not release
        the interpreter, as in compiled code, ends only with its worker in a process pool.
    max_seconds : float, optional
        Time after which no further runs are started [s]; the `status` of the result is then ``"stopped"``.
    in_memory : bool
        If False, the samples of all simulated runs are in a file beside the store, for more runs than fit
        into the memory. The file disappears with the result.
    requirements : Specification, or sequence or mapping of them by name, optional
        Limits made by `require`, answered first: `StudyResult.conformance` has the shares, of the runs if
        these are independent and all parameters `uniform`, else of as many drawn from the distributions.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; all problems are listed.

    Examples
    --------
    >>> from chebclear import Study, Interval, mechanisms
    >>> sides = {"crank_length": Interval.around(0.05, rel=0.1)}
    >>> study = Study(mechanisms.slider_crank, sides, ["slider.x"], duration=1e-3, samples=11)
    >>> study.chebyshev(degree=2)["slider.x"].width.shape
    (11,)

    A model of your own:

    >>> import numpy as np
    >>> def spring(stiffness):
    ...     t = np.linspace(0.0, 1.0, 101)
    ...     return {"t": t, "x": np.cos(np.sqrt(stiffness) * t), "period": 2 * np.pi / np.sqrt(stiffness)}
    >>> result = Study(spring, {"stiffness": Interval.around(9.0, rel=0.1)}).band(runs=16)
    >>> result["x"].verdict, result.features["period"].interval.verdict
    ('estimated', 'estimated')
    """

    def __init__(
        self,
        build: Callable[..., Scene] | Callable[..., Mapping[str, Any]],
        parameters: Mapping[str, Interval | Distribution],
        outputs: Sequence[str] | None = None,
        *,
        settings: Settings | None = None,
        fixed: Mapping[str, Any] | None = None,
        threads: int | None = None,
        progress: bool | Progress | None = None,
        executor: Executor | None = None,
        features: Mapping[str, FeatureSpec] | None = None,
        store: str | os.PathLike[str] | None = None,
        version: str | None = None,
        on_failure: OnFailure = "collect",
        run_seconds: float | None = None,
        max_seconds: float | None = None,
        in_memory: bool = True,
        units: Mapping[str, str] | None = None,
        requirements: Specification | Sequence[Specification] | Mapping[str, Specification] | None = None,
        **options: Unpack[RunOptions],
    ) -> None:
        execution = ExecutionOptions(
            threads, executor, store, on_failure, run_seconds, max_seconds, in_memory
        )
        what = build, parameters, outputs, settings, fixed, features, units, version, requirements
        self.runner = checked_runner(*what, options, progress, execution)
        self._spec = self.runner.spec

    @property
    def intervals(self) -> dict[str, Interval]:
        """Interval of each parameter by name [SI units]."""
        return self.runner.intervals

    @property
    def random(self) -> dict[str, Distribution]:
        """Distributions of the parameters that have one."""
        return self.runner.random

    @property
    def features(self) -> Mapping[str, FeatureSpec]:
        """Features of every run by name."""
        return self.runner.features

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
            Largest number of runs on the roots; with more, no run is started [-].

        Returns
        -------
        StudyResult

        Raises
        ------
        SceneError, SimulationError, MemoryError
            If a scene is wrong, a run fails, with its parameters, or the samples do not fit into the memory.
        ValueError, TypeError
            If an argument is wrong; all problems are listed.
        """
        design = designs.chebyshev(self.runner, degree, nodes, bounds, max_runs)
        return self._issued(answered(self.runner, design))

    def scan(self, points: int | Mapping[str, int] = 10, *, max_runs: int = MAX_RUNS) -> StudyResult:
        """Brute force: simulate on equally spaced points; the bounds are the extremes of the runs.

        Parameters
        ----------
        points : int or mapping of str to int
            Number of points [-], at least 2, both ends included; for all parameters or by name. The number of
            runs is their product, at most 1 000 000, and one at the midpoint that does not count for the
            bounds.
        max_runs : int
            Largest number of runs on the grid; with more, no run is started [-].

        Returns
        -------
        StudyResult
            Its bands are inner bounds and have no polynomial. Errors are those of `chebyshev`.
        """
        return self._issued(answered(self.runner, designs.scan(self.runner, points, max_runs)))

    def band(
        self,
        runs: int | None = None,
        *,
        coverage: float = 0.999,
        seconds: float | None = None,
        confidence: float | None = None,
        rtol: float | None = None,
        rng: int | Generator | None = 0,
        include: StudyResult | Sequence[StudyResult] = (),
        max_runs: int = MAX_RUNS,
        revolutions: int | None = None,
        discard: int | None = None,
        angle: str | None = None,
    ) -> StudyResult:
        """Bands that contain further runs, by as many runs as their coverage takes.

        The hull of n independent runs holds all but 2 / (n + 1) of the samples of a further run on average,
        whatever the mechanism: 1999 runs hold 99.9 %. If `runs` asks for fewer, runs at evenly spread points
        make bands of running extremes, widened by what held-out runs exceed them by. Where a polynomial in
        the parameters follows an output, its range with its error is the band, which holds all runs too.

        Where the number of runs is not given, the time that they will take is shown if it is long and
        `progress` of the study does not say otherwise, and Ctrl-C ends them: the answer is that of the runs
        made so far, with the coverage that these prove, and its `status` is ``"stopped"``.

        With `revolutions` the bands are **by crank angle**: those of all runs are pooled. This needs fewer
        runs, and remains valid when impacts have made long runs unpredictable.

        Parameters
        ----------
        runs : int, optional
            Number of runs [-], at least 3, in addition to one at the midpoint. If not given, so many as the
            hull needs for the `coverage` (and `confidence`): the same number on every machine. Of a table of
            finished runs, the number of first runs to use; all if not given.
        coverage : float
            Share of the samples of a further run that should be inside [-], between 0 and 1.
        seconds : float, optional
            Time after which no further runs are begun [s], in place of `max_seconds` of the study; the answer
            is that of the runs made so far.
        confidence : float, optional
            As many independent runs are made that with this probability their hull holds the `coverage` of
            all mechanisms at any one instant [-]; 4742 for 0.999 with 0.95.
        rtol : float, optional
            Relative tolerance of the integrator [-], in place of that of the study; 1e-4 if neither
            says one. Bands need no smaller one, although single runs change. Velocities of impacting
            mechanisms are resolved more often at 1e-5.
        rng : int, numpy.random.Generator or None
            Seed of the points, 0 to 2**64 - 1; a generator draws one, None stands for a fresh one. The
            result keeps the seed, with which it repeats exactly on any number of threads.
        include : StudyResult or sequence of StudyResult, optional
            Results of the same study whose runs take part in all bands. They are not held out, since their
            points may lie on a grid, and features of all runs then state nothing about a further run.
        max_runs : int
            Largest number of runs; with more, no run is started [-].
        revolutions : int, optional
            Revolutions of every run [-] for bands by crank angle; the `samples` of the study are then those
            of one revolution. With a drive at constant speed the duration follows from them. If the speed is
            a parameter, or a torque drives the crank, the angle of every run is measured. A torque drive
            needs a `duration` in which every run completes all of them.
        discard : int, optional
            First revolutions that are not pooled [-], for the starting transient to decay; 1 by default.
        angle : str, optional
            Name of the revolute joint whose angle is the crank angle; that of the only drive at constant
            speed if not given.

        Returns
        -------
        StudyResult
            `StudyResult.extend` adds runs. Bands that are ``"resolved"`` have a polynomial. Errors are those
            of `chebyshev`.
        """
        how = seconds, confidence, rtol, rng, include, max_runs, revolutions, discard, angle
        design = designs.band(self.runner, runs, coverage, *how)
        return self._issued(answered(self.runner, design))

    def extended(
        self, result: StudyResult, runs: int, include: StudyResult | Sequence[StudyResult] = ()
    ) -> StudyResult:
        """A result of `band` with further runs; see `StudyResult.extend`."""
        return self._issued(extended(self.runner, result, runs, include))

    def run(
        self, points: int | Mapping[str, ArrayLike] | ArrayLike, *, rng: int | Generator | None = 0
    ) -> Runs:
        """The runs themselves, at random points or at your own, to look at, to add and to answer from.

        Parameters
        ----------
        points : int, mapping of str to array_like, or array_like
            Number of independent points, uniform in the box [-]; or the values of each parameter by name,
            shape (runs,); or all of them, shape (runs, parameters) [SI units], inside the intervals. One run
            at the nominal values comes besides.
        rng : int, numpy.random.Generator or None
            As of `band`.

        Returns
        -------
        Runs
            ``runs["slider.x"]`` has the values of an output; ``runs.band()`` answers. Errors are those of
            `chebyshev`.

        Examples
        --------
        >>> import chebclear as cc
        >>> sides = {"crank_length": cc.Interval.around(0.05, rel=0.1)}
        >>> study = cc.Study(cc.mechanisms.slider_crank, sides, ["slider.x"], duration=1e-3, samples=11)
        >>> runs = study.run(20)
        >>> runs["slider.x"].shape, len(runs + study.run([[0.049], [0.051]]))
        ((20, 11), 22)
        """
        made = runs_of(self.runner, points, rng)
        issue(filter(changes_answer, made.notices))
        return made

    def sample(self, runs: int = 81, *, rng: int | Generator | None = 0) -> StudyResult:
        """Simulate at independent, uniformly distributed random points of the box, as for features.

        Bands are the extremes of the runs. Errors are those of `chebyshev`.

        Parameters
        ----------
        runs : int
            Number of runs [-], 2 to 1 000 000, and one at the midpoint; a table has all it has.
        rng : int, numpy.random.Generator or None
            As of `band`.
        """
        return self._issued(answered(self.runner, designs.sample(self.runner, runs, rng)))

    def function(self, features: str | Sequence[str] | None = None) -> StudyFunction:
        """The features as a function of points of your own, ``f(X)``, for other packages and optimizers.

        Parameters
        ----------
        features : str or sequence of str, optional
            Names of the features, or of numbers that a model of your own returns; all if not given.

        Raises
        ------
        ValueError, SceneError, SimulationError
            If the study has no such feature or has cycles, or its nominal run fails.
        """
        return function_of(self.runner, features)

    def sweep(
        self,
        parameter: str,
        lower: float | str,
        upper: float | str,
        points: int = 41,
        *,
        revolutions: int = 20,
        discard: int = 10,
        angle: str | None = None,
    ) -> Sweep:
        """The settled motion over one parameter, such as the speed: the features of every revolution.

        All other parameters are at their nominal values; every run begins at its assembled start. Runs are
        made in threads of this process, and no store keeps them. Values are NaN where a run failed; notices
        name failed runs and features that have not settled. Errors are those of `chebyshev`.

        Parameters
        ----------
        parameter : str
            Name of a keyword of the mechanism; it need not be a parameter of the study.
        lower, upper : float or str
            First and last value [SI unit], or with a unit, such as ``"3000 rpm"``.
        points : int
            Number of equally spaced values [-], 3 to 10 000.
        revolutions : int
            Revolutions of each run whose features are found [-], at least 8.
        discard : int
            Revolutions before them, for the starting transient to decay [-].
        angle : str, optional
            Name of the revolute joint whose revolutions count, as of `band`. Where the speed varies within a
            turn, the angle is measured, and the `duration` must be long enough for all revolutions.

        Examples
        --------
        >>> import chebclear as cc
        >>> box = {"crank_length": cc.Interval.around(0.05, rel=0.01)}
        >>> stroke = {"stroke": cc.features.peak_to_peak("slider.x")}
        >>> study = cc.Study(cc.mechanisms.slider_crank, box, features=stroke, duration=1.0, samples=2)
        >>> study.sweep("crank_speed", "60 rpm", "600 rpm", 3, revolutions=8, discard=0)
        <Sweep of stroke over crank_speed: 3 values from 6.28319 to 62.8319>
        """
        return sweep_of(self.runner, parameter, lower, upper, points, revolutions, discard, angle)

    def worst_cases(self, result: StudyResult) -> tuple[WorstCase, ...]:
        """Runs at the worst cases that the polynomials of a result predict; see `StudyResult.check`."""
        return simulated_extremes(self.runner, result)

    def _issued(self, result: StudyResult) -> StudyResult:
        """The result of this study, after issuing the notices that may change its answers."""
        issue(filter(changes_answer, result.notices))
        return replace(result, study=self, spec=self._spec, nominal_poses=nominal_poses(result))

    def plan(self, method: str = "band", *, probes: int | None = None, **arguments: Any) -> Plan:
        """Estimate the cost of a method of this study from a few of its runs.

        Parameters
        ----------
        method : {"band", "chebyshev", "scan", "sample"}
            The method.
        probes : int, optional
            Runs that are made to find out [-]; if not given, until they take half a second.
        **arguments
            Its arguments.

        Examples
        --------
        >>> from chebclear import Study, Interval, mechanisms
        >>> sides = {"crank_length": Interval.around(0.05, rel=0.1)}
        >>> study = Study(mechanisms.slider_crank, sides, ["slider.x"], duration=1e-3, samples=11)
        >>> study.plan("scan", points=100).runs
        101
        """
        checks = Checks()
        checks.word("method", method, ("band", "chebyshev", "scan", "sample"))
        if isinstance(self.runner.model, FinishedRuns):
            checks.add(
                "study",
                "is a table of finished runs, which costs no further ones: there is nothing to be planned",
            )
        if probes is not None:
            probes = checks.whole("probes", probes, least=1)
        checks.finish()
        asked = signature(getattr(self, method))
        for name in [name for name in arguments if name not in asked.parameters]:
            hint = meant_or_known(name, asked.parameters)
            checks.add(name, f"is no argument of {method}{hint}", wrong_type=True)
        checks.finish()
        given = asked.bind(**arguments)
        given.apply_defaults()
        make: Callable[..., Design] = getattr(designs, method)
        design = make(self.runner, **given.arguments)
        return designs.plan_of(self.runner, design, probes, runs_for_shares(self.runner, design))

    @classmethod
    def from_runs(
        cls,
        parameters: Mapping[str, ArrayLike],
        t: ArrayLike | None,
        values: Mapping[str, ArrayLike],
        *,
        intervals: Mapping[str, Interval] | None = None,
        features: Mapping[str, Feature] | None = None,
        cycles: int = 1,
        independent: bool = False,
        threads: int | None = None,
        units: Mapping[str, str] | None = None,
    ) -> Study:
        """A study of a table of finished runs from any source.

        `band` and `sample` use the runs as they are. `chebyshev` and `scan` need all points of their grid in
        the table. If no run is at the midpoint of all intervals the nearest one is the nominal run, with a
        warning.

        Parameters
        ----------
        parameters : mapping of str to array_like
            Value of each parameter in every run, shape (runs,).
        t : array_like or None
            Equally spaced instants [s], shape (samples,); None if there are only numbers.
        values : mapping of str to array_like
            Outputs by name in their units: time series of shape (runs, samples), numbers of shape (runs,),
            which become features.
        intervals : mapping of str to Interval, optional
            Interval of each parameter; by default the span of its values in the runs.
        features, cycles : optional
            Features of the samples, and equal pieces of the time that have each their own, as of `Study`.
        independent : bool
            Whether the runs were drawn independently and uniformly from the box. Only then their hull proves
            what `band` says, and the probability that a further run stays inside is defined.
        threads, units : optional
            As of `Study`.

        Raises
        ------
        ValueError, TypeError
            If the table is wrong: shapes that do not fit, numbers that are not finite, runs outside the
            intervals; all problems are listed.

        Examples
        --------
        >>> import numpy as np
        >>> from chebclear import Study
        >>> stiffness = np.linspace(8.0, 10.0, 21)
        >>> t = np.linspace(0.0, 1.0, 101)
        >>> x = np.cos(np.sqrt(stiffness)[:, None] * t)
        >>> Study.from_runs({"stiffness": stiffness}, t, {"x": x}).band()["x"].verdict
        'estimated'
        """
        table = finished_runs(parameters, t, values, intervals, features, cycles, independent, units)
        study = cls(table.run, table.intervals, threads=threads)
        study.runner = replace(study.runner, model=table, units=dict(units or {}), table=True)
        study._spec = study.runner.spec
        return study

    def __repr__(self) -> str:
        sides = ", ".join(f"{name} in [{one.lower:g}, {one.upper:g}]" for name, one in self.intervals.items())
        what = self.runner.model if isinstance(self.runner.model, FinishedRuns) else self.runner.build
        return f"<Study of {getattr(what, '__name__', what)}: {sides}>"
