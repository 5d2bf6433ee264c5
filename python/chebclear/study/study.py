"""Studies: many simulations of a mechanism with interval parameters, and the bands of its outputs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from typing import Any

from numpy.typing import ArrayLike

from ..base.arguments import Checks
from ..base.progress import is_request
from ..run.features import Feature
from ..run.settings import MAX_EVENTS, MAX_STEPS, Settings
from ..scene.scene import Interval, Scene
from .arguments import (
    Progress,
    check_keywords,
    checked_fixed,
    checked_intervals,
)
from .band.hybrid import Normal, Uniform
from .features.features import Asked, checked_features, tracked_features
from .methods import Methods
from .models.finished import FinishedRuns, finished_runs
from .models.own import OwnModel, check_own_features, check_unused

MOST_THREADS = 1024


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
    duration : float
        Simulated time [s], above 0. A model of your own has neither this nor `samples`, `skip`, `rtol`,
        `method`, limits of steps and events or tolerances.
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
        Where to simulate instead of on threads of this process; where to call a model of your own instead
        of one run after the other.
    max_steps, max_events : int
        Attempted steps, accepted or refused, and changes of contact after which a run is given up [-].
    position_tolerance, velocity_tolerance : float, optional
        Absolute tolerances [m], [m/s], at most half the smallest clearance, or the size of a scene without
        one, and the speed of the scene; from `rtol` and these scales if not given.
    features : mapping of str to Feature or callable, optional
        Numbers of every run by name, such as ``{"peak force": cc.peak("wrist.normal_force")}``: of the
        continuous motion, so that `outputs` may then be empty; for a model of your own, of the samples. A
        callable gets every run, as `simulate` returns it, and returns a number, or one for each cycle. The
        samples are there at once; contacts, peaks and what else only the motion knows cost that run again.
        For a model of your own it gets what the model returned.
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
        duration: float | None = None,
        samples: int | None = None,
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
        # What is simulated has a duration; a model of your own returns its instants.
        simulated = duration is not None or samples is not None
        self.features = checked_features(checks, features)
        self.build: Callable[..., Any] = build
        self.intervals = checked_intervals(checks, parameters)
        self.random = {
            name: given
            for name, given in (parameters.items() if isinstance(parameters, Mapping) else ())
            if isinstance(given, Normal | Uniform)
        }
        self.fixed = checked_fixed(checks, fixed)
        check_keywords(checks, build, self.intervals, self.fixed)
        settings = Settings.checked(
            checks,
            # What a model of your own does not have is no problem; it is refused below if given.
            duration=duration if simulated else 1.0,
            samples=samples if simulated else 2,
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
            outputs_needed=simulated and not self.features,
        )
        self.settings = settings if simulated else None
        self.threads = (
            None if threads is None else checks.whole("threads", threads, least=1, most=MOST_THREADS)
        )
        if not is_request(progress):
            checks.add(f"progress must be None, True or callable, got {progress!r}", wrong_type=True)
        self.progress = progress
        if executor is not None and not callable(getattr(executor, "submit", None)):
            checks.add(f"executor must have a method submit, got {executor!r}", wrong_type=True)
        self.executor = executor
        self.model = None
        if not simulated:
            check_unused(
                checks,
                {
                    "skip": skip,
                    "rtol": rtol,
                    "method": method,
                    "max_steps": max_steps,
                    "max_events": max_events,
                    "position_tolerance": position_tolerance,
                    "velocity_tolerance": velocity_tolerance,
                },
                type(self).__init__.__kwdefaults__ or {},
            )
            check_own_features(checks, self.features)
            self.model = OwnModel(
                build, self.intervals, self.fixed, settings.outputs, self.features, cycles, executor
            )
        checks.finish()

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
