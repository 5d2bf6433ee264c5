"""Studies: many simulations of a mechanism with interval parameters, and the bands of its outputs."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from inspect import signature
from typing import Any, Unpack

from numpy.typing import ArrayLike

from ..base.arguments import Checks, meant_or_known
from ..base.progress import Progress, is_request
from ..execution.options import OnFailure, checked_options
from ..execution.plan import Plan
from ..run.features import Feature
from ..run.settings import RunOptions, Settings, checked_names, checked_settings, with_settings
from ..scene.scene import Interval, Scene
from .band.hybrid import Normal, Uniform
from .features.features import Asked, checked_features, tracked_features
from .methods import Methods, plan_of
from .models.finished import FinishedRuns, finished_runs
from .models.own import OwnModel, check_own_features, check_unused
from .models.units import checked_units, known_units, require_known
from .spec import (
    check_keywords,
    checked_fixed,
    checked_intervals,
    returns_a_scene,
)


@with_settings(RunOptions)
class Study(Methods):
    """A mechanism, or a model of your own, whose parameters are known to lie in intervals.

    Parameters
    ----------
    build : callable
        Called as ``build(**parameters, **fixed)`` with physical values; returns the scene. Without `duration`
        and `samples`, unless its annotation says that it returns a scene, it is a model of your own and
        returns a mapping: equally spaced instants as ``"t"``,
        arrays of as many values for outputs, numbers for features. Such a model may return numbers alone.
    parameters : mapping of str to Interval, Normal or Uniform
        Interval of each uncertain parameter [SI units]. The interval of a `normal` distribution is three
        standard deviations to either side of its mean, that of a `uniform` one its range;
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
    progress : True or callable, optional
        True shows a bar, or lines where standard error is no terminal; a callable gets the runs done and the
        runs in all.
    executor : concurrent.futures.Executor, optional
        Runs are simulated there instead of on threads of this process; a model of your own is called there
        instead of one run after the other.
    features : mapping of str to Feature or callable, optional
        Scalar results of every run by name, such as ``{"peak force": cc.peak("wrist.normal_force")}``. They
        are taken from the continuous motion, so that `outputs` may be empty; for a model of your own, from
        the samples. A callable gets every run, as `simulate` returns it, and returns a number, or one for
        each cycle. Samples are available to it at once; contacts, peaks and other results of the continuous
        motion need the run to be repeated. For a model of your own it gets a dictionary of the instants
        ``"t"``, arrays and numbers that the model returned.
    units : mapping of str to str, optional
        Units by the names of parameters, of features that callables return, and, for a model of your own, of
        everything it returns, such as ``{"stiffness": "N/m", "x": "m"}``. Tables, pictures, exports and
        reports show them; nothing is converted. Outputs of simulations, and parameters of ready-made
        mechanisms and scene files, have their units already.
    store : path, optional
        Folder that keeps every finished run; created if it does not exist. An interrupted study continues
        from there with exactly the same result, and a later study of the mechanism simulates only new runs.
        For a model of your own, everything that the function can reach is compared, but not files that it
        reads.
    version : str, optional
        For a model of your own with a store: stands for the function and everything that it uses. The store
        then compares this text and the data in `fixed`, so give another one whenever the model is another.
    on_failure : {"collect", "raise"}
        Treatment of failed runs. ``"collect"`` repeats simulations once with tighter tolerances, then
        collects failed runs in `StudyResult.failures`; results are made without them, and their verdicts
        account for the gaps. ``"raise"`` raises for the first failure. A failure of the nominal run, or of
        more than half of the runs, always raises.
    run_seconds : float, optional
        Time limit of a simulation [s], also of a call of `build`, of a feature, or of
        a model of your own; beyond it the run has failed. A call that does not release the interpreter, as in
        compiled code, ends only with its worker in a process pool.
    max_seconds : float, optional
        Time after which no further runs are started [s]. The result is made from the finished runs;
        its `status` is then ``"stopped"``, and its verdicts hold for these runs.
    in_memory : bool
        If False, the samples of all runs are in a file in the folder of the store, which the system reads as
        they are needed; for more runs than fit into the memory. The file disappears with the result. Not for
        a model of your own.

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
        version: str | None = None,
        on_failure: OnFailure = "collect",
        run_seconds: float | None = None,
        max_seconds: float | None = None,
        in_memory: bool = True,
        units: Mapping[str, str] | None = None,
        **options: Unpack[RunOptions],
    ) -> None:
        checks = Checks()
        # Simulations have a duration; a model of your own returns its instants.
        self.rtol_given = settings is not None or "rtol" in options
        timed = settings is not None or not options.keys().isdisjoint(("duration", "samples"))
        simulated = timed or returns_a_scene(build)
        self.features = checked_features(checks, features)
        if features is None and isinstance(settings, Settings):
            self.features = {str(feature): feature for feature in settings.features}
        self.build: Callable[..., Any] = build
        self.intervals = checked_intervals(checks, parameters)
        self.units = known_units(build, self.intervals) | checked_units(checks, units)
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
        self.means = checked_options(
            checks, threads, executor, store, on_failure, run_seconds, max_seconds, in_memory
        )
        if not simulated and in_memory is False:
            checks.add("in_memory may not be False for a model of your own: what it returns is in the memory")
        if version is not None and (not isinstance(version, str) or not version):
            checks.add(f'version must be a text, such as "1", got {version!r}', wrong_type=True)
        if version is not None and (simulated or store is None):
            checks.add("version is for a model of your own with a store, which compares it")
        self.settings, self.model = None, None
        if simulated:
            given = {"outputs": outputs, "features": tracked_features(self.features.values()), **options}
            require_known(checks, self.units, [*self.intervals, *self.features], simulated=True)
            self.settings = Settings.gathered(checks, settings, given, outputs_needed=not self.features)
            return
        cycles = checked_settings(checks, {"cycles": options.get("cycles", 1)})["cycles"]
        check_unused(checks, [name for name in options if name != "cycles"])
        check_own_features(checks, self.features)
        names = checked_names(checks, outputs)
        checks.finish()
        self.model = OwnModel(
            build, self.intervals, self.fixed, names, self.features, cycles, tuple(self.units), version
        )

    def plan(self, method: str = "band", *, probes: int | None = None, **arguments: Any) -> Plan:
        """Estimate the cost of a method of this study from a few of its runs.

        Parameters
        ----------
        method : {"band", "certify", "chebyshev", "scan", "sample"}
            The method.
        probes : int, optional
            Runs that are made to find out [-]. If not given, 12 and at least 4 for each worker, then four
            times as many until they take half a second or are a quarter of the study.
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
        known = list(signature(getattr(self, method)).parameters)
        for name in arguments:
            if name not in known:
                checks.add(f'{method} has no argument "{name}"{meant_or_known(name, known)}', wrong_type=True)
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
        units: Mapping[str, str] | None = None,
    ) -> Study:
        """A study of a table of finished runs from any source.

        `band` and `sample` use the runs as they are. `chebyshev` and `scan` need all points of
        their grid in the table, `certify` independent runs. If no run is at the midpoint of all intervals the
        nearest one is used as the nominal run, with a warning.

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
        features : mapping of str to Feature, optional
            Features of the samples, such as ``{"peak": cc.peak("force")}``.
        cycles : int
            Equal pieces of the time, each with features of its own [-].
        independent : bool
            Whether the runs were drawn independently and uniformly from the box. Only then the
            probability that a further run stays inside is defined.
        units : mapping of str to str, optional
            Units of parameters, outputs and features by name, such as ``{"stiffness": "N/m", "x": "m"}``.
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
            units=units,
        )
        study = cls(table.run, table.intervals, threads=threads)
        study.model = table
        study.units = dict(units or {})
        return study

    def __repr__(self) -> str:
        sides = ", ".join(
            f"{name} in [{side.lower:g}, {side.upper:g}]" for name, side in self.intervals.items()
        )
        what = self.model if isinstance(self.model, FinishedRuns) else self.build
        return f"<Study of {getattr(what, '__name__', what)}: {sides}>"
