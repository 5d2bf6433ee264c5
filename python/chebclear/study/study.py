"""Studies: many simulations of a mechanism with interval parameters, and the bands of its outputs."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from typing import Any, Unpack

from numpy.typing import ArrayLike

from ..base.arguments import Checks
from ..base.progress import Progress, is_request
from ..execution.means import OnFailure, checked_means
from ..execution.plan import Plan
from ..run.features import Feature
from ..run.settings import RunOptions, Settings, checked_names, checked_settings, with_settings
from ..scene.scene import Interval, Scene
from .arguments import (
    check_keywords,
    checked_fixed,
    checked_intervals,
)
from .band.hybrid import Normal, Uniform
from .features.features import Asked, checked_features, tracked_features
from .methods import Methods, plan_of
from .models.finished import FinishedRuns, finished_runs
from .models.own import OwnModel, check_own_features, check_unused


@with_settings(RunOptions)
class Study(Methods):
    """A mechanism, or a model of your own, whose parameters are known to lie in intervals.

    Parameters
    ----------
    build : callable
        Called as ``build(**parameters, **fixed)`` with physical values; returns the scene. Without `duration`
        and `samples` it is a model of your own and returns a mapping: equally spaced instants as ``"t"``,
        arrays of as many values for outputs, numbers for features. Such a model may return numbers alone.
    parameters : mapping of str to Interval, Normal or Uniform
        Interval of each uncertain parameter [SI units]. A `normal` distribution is run over three standard
        deviations to either side, a `uniform` one over all of it; ``band.quantiles(study.random)`` then gives
        quantiles at the worst of the intervals.
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
    progress : True or callable, optional
        True shows a bar, or lines where standard error is no terminal; a callable gets the runs done and the
        runs in all.
    executor : concurrent.futures.Executor, optional
        Where to simulate instead of on threads of this process; where to call a model of your own instead
        of one run after the other.
    features : mapping of str to Feature or callable, optional
        Numbers of every run by name, such as ``{"peak force": cc.peak("wrist.normal_force")}``: of the
        continuous motion, so that `outputs` may then be empty; for a model of your own, of the samples. A
        callable gets every run, as `simulate` returns it, and returns a number, or one for each cycle. The
        samples are there at once; contacts, peaks and what else only the motion knows cost that run again.
        For a model of your own it gets a dictionary of the instants ``"t"``, arrays and numbers that the
        model returned.
    store : path, optional
        Folder that keeps every finished run; made if it does not exist. An interrupted study goes on from
        there to the same bits, and a later study of the mechanism simulates only the runs that are new. Of a
        model of your own, text and surroundings of the function are compared, not what it reads from files.
    on_failure : {"collect", "raise"}
        What becomes of runs that fail. Simulations are repeated once with tighter tolerances, then all are
        collected in `StudyResult.failures`; results are made without them, and their verdicts account for the
        hole. Or the first one raises and there is no result. The nominal run, and more than half of all,
        always raise.
    run_seconds : float, optional
        Time after which a simulation is given up as failed [s], as is a call of `build`, of a feature, or of
        a model of your own. A call that holds the interpreter, as compiled code may, ends only with the
        worker of a process pool that makes it.
    max_seconds : float, optional
        Time after which no further runs are begun [s]. The result is made from those that are done;
        its `status` is then ``"stopped"``, and its verdicts are those of the runs that there are.

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

    A model of your own:

    >>> import numpy as np
    >>> def spring(stiffness):
    ...     t = np.linspace(0.0, 1.0, 101)
    ...     return {"t": t, "x": np.cos(np.sqrt(stiffness) * t), "period": 2 * np.pi / np.sqrt(stiffness)}
    >>> result = Study(spring, {"stiffness": interval(9.0, rel=0.1)}).band(runs=16)
    >>> result["x"].verdict, result.feature("period").interval.verdict
    ('resolved', 'resolved')
    """

    def __init__(
        self,
        build: Callable[..., Scene] | Callable[..., Mapping[str, Any]],
        parameters: Mapping[str, Interval | Normal | Uniform],
        outputs: Sequence[str] | None = None,
        *,
        settings: Settings | None = None,
        fixed: Mapping[str, Any] | None = None,
        threads: int | None = None,
        progress: bool | Progress | None = None,
        executor: Executor | None = None,
        features: Mapping[str, Asked] | None = None,
        store: str | os.PathLike[str] | None = None,
        on_failure: OnFailure = "collect",
        run_seconds: float | None = None,
        max_seconds: float | None = None,
        **options: Unpack[RunOptions],
    ) -> None:
        checks = Checks()
        # What is simulated has a duration; a model of your own returns its instants.
        simulated = settings is not None or not options.keys().isdisjoint(("duration", "samples"))
        self.features = checked_features(checks, features)
        if features is None and isinstance(settings, Settings):
            self.features = {str(feature): feature for feature in settings.features}
        self.build: Callable[..., Any] = build
        self.intervals = checked_intervals(checks, parameters)
        self.random = {
            name: given
            for name, given in (parameters.items() if isinstance(parameters, Mapping) else ())
            if isinstance(given, Normal | Uniform)
        }
        self.fixed = checked_fixed(checks, fixed)
        check_keywords(checks, build, self.intervals, self.fixed)
        if not is_request(progress):
            checks.add(f"progress must be None, True or callable, got {progress!r}", wrong_type=True)
        self.progress = progress
        self.means = checked_means(checks, threads, executor, store, on_failure, run_seconds, max_seconds)
        self.settings, self.model = None, None
        if simulated:
            given = {"outputs": outputs, "features": tracked_features(self.features.values()), **options}
            self.settings = Settings.gathered(checks, settings, given, outputs_needed=not self.features)
            return
        cycles = checked_settings(checks, {"cycles": options.get("cycles", 1)})["cycles"]
        check_unused(checks, [name for name in options if name != "cycles"])
        check_own_features(checks, self.features)
        names = checked_names(checks, outputs)
        checks.finish()
        self.model = OwnModel(build, self.intervals, self.fixed, names, self.features, cycles)

    def plan(self, method: str = "band", *, probes: int | None = None, **arguments: Any) -> Plan:
        """What a method of this study will cost, from a few of its runs.

        Parameters
        ----------
        method : {"band", "certify", "chebyshev", "scan", "sample"}
            The method.
        probes : int, optional
            Runs that are made to find out [-]; 12, and at least 4 for each worker, if not given. Times of
            single runs scatter by a third or so.
        **arguments
            Its arguments.

        Returns
        -------
        Plan

        Raises
        ------
        ValueError, TypeError
            If the study is one of finished runs, or an argument is wrong.

        Examples
        --------
        >>> from chebclear import Study, interval, mechanisms
        >>> sides = {"crank_length": interval(0.05, rel=0.1)}
        >>> study = Study(mechanisms.slider_crank, sides, ["slider.x"], duration=1e-3, samples=11)
        >>> study.plan("scan", points=100).runs
        101
        """
        checks = Checks()
        checks.word("method", method, ("band", "certify", "chebyshev", "scan", "sample"))
        if isinstance(self.model, FinishedRuns):
            checks.add("a table of finished runs costs no further ones: there is nothing to be planned")
        if probes is not None:
            probes = checks.whole("probes", probes, least=1)
        checks.finish()
        return plan_of(self, method, probes, arguments)

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
    ) -> Study:
        """A study of a table of finished runs, whoever has made them.

        `band` and `sample` take the runs as they are, `chebyshev` and `scan` if the table holds all points of
        their grid, `certify` if the runs are independent. If no run is at the midpoint of all intervals the
        nearest one stands for the nominal run, and a warning says so.

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
            Interval of each parameter; what the runs span for those that are not named.
        features : mapping of str to Feature, optional
            Features of the samples, such as ``{"peak": cc.peak("force")}``.
        cycles : int
            Equal pieces of the time, each with features of its own [-].
        independent : bool
            Whether the runs were drawn independently and uniformly from the box. Only then one may speak of
            the probability that a further run stays inside.
        threads : int, optional
            Threads for the bands [-], at most 1024; all processors if not given.

        Returns
        -------
        Study

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
        'resolved'
        """
        table = finished_runs(
            parameters,
            t,
            values,
            intervals=intervals,
            features=features,
            cycles=cycles,
            independent=independent,
        )
        study = cls(table.run, table.intervals, threads=threads)
        study.model = table
        return study

    def __repr__(self) -> str:
        sides = ", ".join(
            f"{name} in [{side.lower:g}, {side.upper:g}]" for name, side in self.intervals.items()
        )
        what = self.model if isinstance(self.model, FinishedRuns) else self.build
        return f"<Study of {getattr(what, '__name__', what)}: {sides}>"
