"""A study as a function of points of one's own: for optimizers and for other packages of sensitivities."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from ..base.arguments import Checks
from ..base.rows import Array
from ..base.shown import listed, meant_or_known
from ..errors import ArgumentError
from ..execution.failures import FAILED, AllFailedError
from ..notices import Notice, issue
from .runner import Runner
from .sources.asked import outputs_of
from .sources.finished import FinishedRuns
from .sources.scenes import MOST_RUNS
from .spec import StudySpec


@dataclass(eq=False, repr=False)
class StudyFunction:
    """Features of a study as a vectorized function of its parameters, made by `Study.function`.

    Two functions are equal if they are the same features of equal studies, however often they were called. A
    pickled one makes its runs on threads of its process and without a store.

    Attributes
    ----------
    parameters : tuple[str, ...]
        Names of the parameters, in the order of the columns of X.
    bounds : Array
        Interval of each parameter [SI units], shape (parameters, 2). Points may lie outside.
    features : tuple[str, ...]
        Names of the features, in the order of the columns of Y.
    spec : StudySpec
        What was asked of the study.
    calls : int
        Points at which it was called [-].
    failed : int
        Points among them that have no value [-].
    notices : tuple[Notice, ...]
        What should be checked, each kind once.
    """

    features: tuple[str, ...]
    spec: StudySpec
    calls: int = 0
    failed: int = 0
    _runner: Runner | None = field(kw_only=True)
    _single: bool = field(kw_only=True)
    _notices: dict[object, Notice] = field(default_factory=dict, kw_only=True)

    @property
    def parameters(self) -> tuple[str, ...]:
        return tuple(self.spec.intervals)

    @property
    def bounds(self) -> Array:
        return np.array([(side.lower, side.upper) for side in self.spec.intervals.values()])

    @property
    def notices(self) -> tuple[Notice, ...]:
        return tuple(self._notices.values())

    def __call__(self, X: ArrayLike) -> Array | float:
        """The features at points of the parameters.

        Parameters
        ----------
        X : array_like, shape (points, parameters) or (parameters,)
            Values of the parameters [SI units].

        Returns
        -------
        ndarray, shape (points, features) or (features,)
            In the units of the features. If the function was made of a single feature, not a list, without
            this axis. NaN where a run failed, which is warned of; with ``on_failure="raise"`` it raises.

        Raises
        ------
        ValueError
            If the points are not finite or have not one column for each parameter.
        """
        points = self._points(X)
        values = self._values(np.atleast_2d(points))
        if self._single:
            values = values[:, 0]
        return cast("Array | float", values if points.ndim == 2 else values[0])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, StudyFunction):
            return NotImplemented
        mine, its = ((one.features, one._single, one.spec) for one in (self, other))
        return mine == its

    __hash__ = None  # type: ignore[assignment]

    def __copy__(self) -> StudyFunction:
        return replace(self, _notices=dict(self._notices))

    def __deepcopy__(self, memory: object) -> StudyFunction:
        return self.__copy__()

    def __getstate__(self) -> dict[str, Any]:
        # Executors cannot be pickled; the specification makes the runner again.
        return vars(self) | {"_runner": None}

    def __repr__(self) -> str:
        return f"<StudyFunction {listed(self.features)} of {listed(self.parameters)}>"

    def _points(self, X: ArrayLike) -> Array:
        try:
            points = np.array(X, dtype=float)
        except (TypeError, ValueError) as error:
            raise ArgumentError(f"X must be numbers, got {X!r:.80}") from error
        names = ", ".join(self.parameters)
        if points.ndim not in (1, 2) or points.shape[-1] != len(self.parameters):
            raise ArgumentError(
                f"X must have a column for each of {names}, the shape (points, {len(self.parameters)}) or "
                f"({len(self.parameters)},); got the shape {points.shape}"
            )
        if points.ndim == 2 and len(points) > MOST_RUNS:
            raise ArgumentError(f"X may have at most {MOST_RUNS} points, got {len(points)}")
        if not np.all(np.isfinite(points)):
            place = tuple(int(index) for index in np.argwhere(~np.isfinite(points))[0])
            raise ArgumentError(f"X must be finite, got {points[place]} for {self.parameters[place[-1]]}")
        return points

    def _values(self, points: Array) -> Array:
        values = np.full((len(points), len(self.features)), np.nan)
        if not len(points):
            return values
        told: list[Notice] = []
        if self._runner is None:
            self._runner = _runner_for(self.spec.study().runner, self.features)
        try:
            runs = self._runner.made(points, self._runner.settings, midpoint=False)
        except AllFailedError as error:
            first = str(error.first)
        else:
            assert runs.features is not None
            columns = [runs.feature_names.index(name) for name in self.features]
            values[runs.kept] = runs.features[:, 0, columns]
            told = [notice for notice in runs.notices if notice.code != FAILED]
            first = str(runs.failures[0]) if runs.failures else ""
        self.calls += len(points)
        if first:
            failed = int(np.count_nonzero(np.isnan(values[:, 0])))
            self.failed += failed
            text = f"failed: {failed} of {len(points)} points have no value, NaN; the first: {first}"
            told = [Notice(FAILED, text, numbers={"runs": failed, "of_runs": len(points)}), *told]
        fresh: dict[object, Notice] = {(one.code, one.about): one for one in told}
        fresh = {kind: one for kind, one in fresh.items() if kind not in self._notices}
        self._notices |= fresh
        issue(fresh.values())
        return values


def function_of(runner: Runner, features: str | Sequence[str] | None) -> StudyFunction:
    """The function of `Study.function`; see there."""
    if isinstance(runner.model, FinishedRuns):
        raise ArgumentError("a table of finished runs has no values at other points")
    single = isinstance(features, str)
    asked = None if features is None else [features] if isinstance(features, str) else list(features)
    spec, every, settings = runner.spec, runner.features, runner.settings
    runner = _runner_for(runner, every if asked is None else asked)
    nominal = np.array([list(runner.nominal.values())])
    checks = Checks()
    if settings is not None and not every:
        checks.add("features", "must be at least one, the study has none")
    if (cycles := runner.cycles) > 1:
        checks.add("cycles", f"must be left out: a function has one value for each run, this study {cycles}")
    checks.finish()
    # Whatever is wrong for every point shows here, and a model of the user's own names its numbers.
    try:
        names = runner.made(nominal, runner.settings, midpoint=False).feature_names
    except AllFailedError as error:
        raise error.first from None
    asked = list(names) if asked is None else asked
    if not asked:
        checks.add("features", "must be at least one; the model returned no numbers")
    for name in asked:
        if name not in names:
            checks.add("features", f'has the unknown feature "{name}"{meant_or_known(name, names)}')
    checks.finish()
    return StudyFunction(tuple(asked), spec, _runner=runner, _single=single)


def _runner_for(runner: Runner, asked: Iterable[str]) -> Runner:
    """The runner of a study with these features alone, if it has them, where any number of runs may fail."""
    every, settings = runner.features, runner.settings
    if settings is not None:
        known = set(asked) if set(asked) <= set(every) else set(every)
        chosen = {name: one for name, one in every.items() if name in known}
        settings = replace(settings, outputs=outputs_of(chosen, settings))
        runner = replace(runner, features=chosen, settings=settings)
    return replace(runner, execution=replace(runner.execution, most_failed=1.0), progress=None)
