"""Finished runs of a study with the specification that made them: they are cut, added and answered from."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self, get_type_hints, overload

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike, NDArray

from ..base import files as records
from ..base.arguments import Checks
from ..base.named import is_pattern, matching
from ..base.rows import Array
from ..base.shown import did_you_mean, listed, meant_or_known
from ..base.units import unit
from ..data.dataset import Dataset, Variable
from ..data.exports import Exports
from ..errors import ArgumentError, UnknownNameError
from ..execution.costs import STATS, Costs
from ..execution.failures import FailedRun, count_failed
from ..execution.options import ExecutionOptions
from ..notices import Notice, WithNotices, changes_answer, issue
from ..run.settings import Settings, common_facts
from ..run.trajectory import Stats
from ..scene.columns import column_unit
from ..scene.scene import Interval, Scene
from . import designs
from .by_angle import unpredictable
from .conforming import answered
from .differences import scene_differences, study_differences
from .features.features import FeatureTable, feature_table
from .polynomials.points import in_box, nominal_point, uniform_points
from .results import StudyResult
from .runner import Design, Runner
from .sources.finished import FinishedRuns
from .sources.run_table import RunTable
from .sources.scenes import MOST_RUNS
from .spec import StudySpec

# Fields of the table of runs that are kept as they are.
_OF_TABLE = ("t", "outputs", "feature_names", "settings", "scene", "clearances")
# Fields that a file has as they are.
_SAVED = (
    *_OF_TABLE,
    "parameters",
    "samples",
    "feature_values",
    "independent",
    "failures",
    "notices",
    "units",
    "seconds",
)


@dataclass(frozen=True, eq=False, repr=False)
class Runs(WithNotices, records.Saved, Exports, kind="runs"):
    """Finished runs of a study, made by `Study.run`, with the specification that made them.

    ``runs["slider.x"]`` are the values of an output, ``runs["slider.*"]`` a dict of them. ``len(runs)`` is
    the number of runs; ``runs[:40]``, ``runs[mask]`` and ``runs[[3, 5]]`` are some of them, and ``a + b``
    those of both, which must be of the same study. They make no further runs: `band` and `extremes` answer
    from what is there.

    They can be compared (NaN equals NaN), copied, pickled, saved and loaded; their arrays are read-only.

    Attributes
    ----------
    spec : StudySpec
        What was asked of the study.
    parameters : Array
        Values of the parameters in each run [SI units], shape (runs, parameters).
    t : Array
        Instants [s], shape (samples,).
    outputs : tuple[str, ...]
        Names of the outputs.
    samples : Array
        All outputs in their units, shape (runs + 1, samples, outputs); the last run is the nominal one.
    feature_values : Array | None
        Features of the same runs in their units, shape (runs + 1, cycles, features); None without features.
    feature_names : tuple[str, ...]
        Names of the features.
    independent : bool
        Whether the points were drawn independently and uniformly from the box of the intervals.
    stats : Sequence[Stats]
        What each run cost, the nominal one last; nothing for a model of your own.
    failures : tuple[FailedRun, ...]
        Runs that failed, which `parameters` and all values leave out.
    notices : tuple[Notice, ...]
        Warnings, each text once.
    settings : Settings | None
        Settings of the runs; None for a model of your own.
    scene : Scene | None
        The scene at the nominal values of all intervals; None without scenes.
    clearances : dict[str, float]
        Largest clearance of each joint in the box and in all runs [m].
    units : dict[str, str]
        Units of parameters, outputs and features that are known.
    seconds : float
        Time of the runs on the machine where they were made [s].
    """

    spec: StudySpec
    parameters: Array
    t: Array = field(metadata=unit("s"))
    outputs: tuple[str, ...]
    samples: Array
    feature_values: Array | None = None
    feature_names: tuple[str, ...] = ()
    independent: bool = False
    stats: Sequence[Stats] = ()
    failures: tuple[FailedRun, ...] = ()
    notices: tuple[Notice, ...] = ()
    settings: Settings | None = None
    scene: Scene | None = None
    clearances: dict[str, float] = field(default_factory=dict, metadata=unit("m"))
    units: dict[str, str] = field(default_factory=dict)
    seconds: float = field(default=math.nan, compare=False, metadata=unit("s"))

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters, in the order of the columns of `parameters`."""
        return tuple(self.spec.intervals)

    @property
    def nominal(self) -> dict[str, Array]:
        """Values of each output in the run at the nominal values of all intervals, shape (samples,)."""
        return dict(zip(self.outputs, self.samples[-1].T, strict=True))

    @property
    def features(self) -> FeatureTable:
        """The features of all runs by name, each with its interval and the effects of the parameters."""
        return feature_table(self._runner, self._table, self.independent, count_failed(self.failures))

    def __len__(self) -> int:
        return len(self.parameters)

    @overload
    def __getitem__(self, which: str) -> Array: ...
    @overload
    def __getitem__(self, which: int | slice | Sequence[int] | NDArray[Any]) -> Runs: ...
    def __getitem__(self, which: Any) -> Any:
        if isinstance(which, str):
            return self._values(which)
        if isinstance(which, slice):
            rows = np.arange(len(self))[which]
            return self._some(rows, self.independent)
        if isinstance(which, int | np.integer):
            index = int(which)
            if not -len(self) <= index < len(self):
                raise IndexError(f"there are {len(self)} runs, got the number {index}")
            return self._some(np.array([index % len(self)]), self.independent)
        try:
            # Chosen one by one, perhaps by their values, they are no random ones any more.
            rows = np.arange(len(self))[np.asarray(which)]
        except (IndexError, TypeError, ValueError) as error:
            wanted = f"numbers of runs, below {len(self)}, or a mask of as many"
            raise ArgumentError(f"runs are taken by a slice, {wanted}; got {which!r:.80}") from error
        return self._some(np.atleast_1d(rows), independent=False)

    def __iter__(self) -> Iterator[Runs]:
        return (self[index] for index in range(len(self)))

    def __contains__(self, name: object) -> bool:
        return name in self.outputs

    def __add__(self, other: object) -> Runs:
        """The runs of both; those at the same point count once."""
        if not isinstance(other, Runs):
            return NotImplemented
        found = study_differences(self.spec, other.spec)
        if not found:
            found = list(scene_differences(self.scene, other.scene))
        if self.outputs != other.outputs:
            found.append(f"outputs: {', '.join(self.outputs)} and {', '.join(other.outputs)}")
        if found:
            raise ArgumentError(f"runs of two studies cannot be added, they differ in {'; '.join(found)}")
        own = {point.tobytes() for point in self.parameters}
        more = other._some(
            np.array(
                [k for k, point in enumerate(other.parameters) if point.tobytes() not in own], dtype=np.intp
            ),
            other.independent,
        )
        tables = self._table, more._table
        last = len(self)
        joined = tables[0][:last].joined([tables[1]])
        return dataclasses.replace(
            self,
            parameters=joined.parameters,
            samples=joined.values,
            feature_values=joined.features,
            independent=self.independent and other.independent,
            stats=joined.stats,
            failures=self.failures + tuple(one for one in other.failures if one not in self.failures),
            notices=tuple({one.text: one for one in (*self.notices, *other.notices)}.values()),
            seconds=self.seconds + other.seconds,
        )

    def __repr__(self) -> str:
        failed = f", {count} failed" if (count := count_failed(self.failures)) else ""
        names = listed((*self.outputs, *self.feature_names), most=4)
        return f"<Runs: {len(self)} of {self.spec.name}{failed}, {names}>"

    def band(
        self, *, coverage: float = 0.999, confidence: float | None = None, threads: int | None = None
    ) -> StudyResult:
        """Bands that contain further runs, from these; see `Study.band`.

        Parameters
        ----------
        coverage, confidence : optional
            As of `Study.band`. Only independent runs prove a coverage; of other points it is estimated.
        threads : int, optional
            Threads to compute on [-]; all processors if not given.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong, or the runs are too few, or on a grid.
        """
        return self._answer(
            lambda runner: designs.band(
                runner, None, coverage, None, confidence, None, 0, (), MOST_RUNS, None, None, None
            ),
            threads,
        )

    def extremes(self, threads: int | None = None) -> StudyResult:
        """The smallest and largest values of the runs at every instant, and their features."""
        return self._answer(lambda runner: designs.sample(runner, len(self), 0), threads)

    def dataset(self) -> Dataset:
        """The runs as named arrays with units; see `Exports`.

        They are ``slider.x`` over ``run`` and ``t``, ``slider.x.nominal`` over ``t``, ``parameters.NAME``
        over ``run`` and ``features.NAME`` over ``run`` and ``cycle``; the table has a row for each run.
        """
        variables = {"run": Variable(("run",), np.arange(len(self)), "-")}
        for name, column in zip(self.parameter_names, self.parameters.T, strict=True):
            variables[f"parameters.{name}"] = Variable(("run",), column, self.units.get(name, ""))
        if self.feature_values is not None:
            units = dict(zip(self.feature_names, self.features.units, strict=False))
            for k, name in enumerate(self.feature_names):
                values, own = self.feature_values[:-1, :, k], units.get(name, "")
                axes: tuple[str, ...] = ("run", "cycle")
                if values.shape[1] == 1:
                    values, axes = values[:, 0], ("run",)
                variables[f"features.{name}"] = Variable(axes, values, own)
        if self.outputs:
            variables["t"] = Variable(("t",), self.t, "s")
        for k, name in enumerate(self.outputs):
            own = column_unit(name) if self.scene is not None else self.units.get(name, "")
            variables[name] = Variable(("run", "t"), self.samples[:-1, :, k], own)
            variables[f"{name}.nominal"] = Variable(("t",), self.samples[-1, :, k], own)
        facts: dict[str, str | int | float] = {"study": self.spec.name, "independent": int(self.independent)}
        return Dataset("run", variables, facts | common_facts(self.settings, self.scene, self.warnings))

    def _values(self, name: str) -> Any:
        if is_pattern(name) and name not in self.outputs:
            found = matching(self.outputs, name)
            if not found:
                raise UnknownNameError(f'nothing matches "{name}"{did_you_mean(name, self.outputs)}')
            return {one: self._values(one) for one in found}
        if name not in self.outputs:
            raise UnknownNameError(f'unknown output "{name}"{meant_or_known(name, self.outputs)}')
        return self.samples[:-1, :, self.outputs.index(name)]

    def _some(self, rows: Any, independent: bool) -> Runs:
        """The runs of these numbers, and the nominal one."""
        all_rows = np.append(rows, len(self))
        return dataclasses.replace(
            self,
            parameters=self.parameters[rows],
            samples=self.samples[all_rows],
            feature_values=None if self.feature_values is None else self.feature_values[all_rows],
            independent=independent,
            stats=Costs.joined([self.stats])[all_rows] if len(self.stats) else (),
        )

    @property
    def _table(self) -> RunTable:
        """The runs, the nominal one last."""
        return RunTable(
            parameters=self.parameters,
            kept=np.arange(len(self)),
            values=self.samples,
            features=self.feature_values,
            failures=self.failures,
            stats=Costs.joined([self.stats]),
            seconds=self.seconds,
            **{name: getattr(self, name) for name in _OF_TABLE},
        )

    @property
    def _runner(self) -> Runner:
        """What answers are computed with; it makes no runs."""
        own = {item.name: getattr(self.spec, item.name) for item in dataclasses.fields(StudySpec)}
        return Runner(**own | {"units": self.units, "table": True})

    def _answer(self, design: Callable[[Runner], Design], threads: int | None) -> StudyResult:
        """What a method of a study makes of these runs, as of a table of others; it issues its notices."""
        checks = Checks()
        execution = ExecutionOptions(threads).checked(checks)
        checks.finish()
        nominal = nominal_point(self.spec.intervals)
        # A run that was asked for at the nominal values is the nominal one.
        rows = np.flatnonzero(
            ~(np.vstack([self.parameters, np.full_like(nominal, np.nan)]) == nominal).all(axis=1)
        )
        table = dataclasses.replace(
            self._table,
            parameters=np.vstack([self.parameters, nominal]),
            kept=np.arange(len(self) + 1),
            notices=self.notices,
        )[rows]
        runner = dataclasses.replace(
            self._runner,
            model=FinishedRuns(dict(self.spec.intervals), table, self.independent),
            execution=execution,
        )
        result = answered(runner, design(runner))
        issue(filter(changes_answer, result.notices))
        return dataclasses.replace(result, spec=runner.spec, seconds=self.seconds)

    def _contents(self) -> records.Contents:
        arrays: dict[str, Any] = {"stats": Costs.joined([self.stats]).counts}
        record = {name: records.flattened(getattr(self, name), name, arrays) for name in _SAVED}
        return arrays, {"record": record, "spec": self.spec.facts()}

    @classmethod
    def _from_contents(cls, arrays: Mapping[str, Any], facts: Mapping[str, Any]) -> Self:
        kinds = get_type_hints(cls)
        known = {name: records.restored(kinds[name], one, arrays) for name, one in facts["record"].items()}
        stats = arrays["stats"]
        found = cls(spec=StudySpec.from_facts(facts["spec"]), stats=Costs(stats), **known)
        count = found.parameters.shape[0]
        if stats.dtype.kind != "f" or stats.shape not in ((count + 1, len(STATS)), (0, len(STATS))):
            raise ValueError(f"the costs of {count} runs are {stats.dtype} of shape {stats.shape}")
        return records.sound(
            found,
            parameters=(count, len(found.spec.intervals)),
            t=("t",),
            samples=(count + 1, "t", len(found.outputs)),
            feature_values=(count + 1, "cycles", len(found.feature_names)),
        )


def runs_of(
    runner: Runner, points: int | Mapping[str, ArrayLike] | ArrayLike, rng: int | Generator | None
) -> Runs:
    """The runs of `Study.run`; see there."""
    checks = Checks()
    if isinstance(runner.model, FinishedRuns):
        checks.add("study", "is a table of finished runs, which has no further ones: make a new table")
    independent = isinstance(points, int | np.integer) and not isinstance(points, bool)
    seed = checks.seed("rng", rng)
    if independent:
        count = checks.whole("points", points, least=1, most=MOST_RUNS)
        checks.finish()
        wanted = runner.drawn(lambda box: uniform_points(box, count, seed))
    else:
        wanted = _points(checks, runner.intervals, points)
        checks.finish()
    made = runner.made(wanted, runner.settings)
    return Runs(
        spec=runner.spec,
        parameters=made.parameters,
        samples=made.values,
        feature_values=made.features,
        independent=independent,
        stats=made.stats,
        failures=made.failures,
        notices=(*made.notices, *unpredictable(made)),
        units={**runner.units},
        seconds=made.seconds,
        **{name: getattr(made, name) for name in _OF_TABLE},
    )


def _points(checks: Checks, intervals: Mapping[str, Interval], given: object) -> Array:
    """Points of the user's in the box, shape (runs, parameters)."""
    names = tuple(intervals)
    if hasattr(given, "columns"):  # a data frame
        given = {str(name): given[name] for name in given.columns}  # type: ignore[index]
    if isinstance(given, Mapping):
        if set(given) != set(names):
            found = ", ".join(map(str, given)) or "none"
            checks.add("points", f"must have the values of {', '.join(names)}, got those of {found}")
            return np.empty((0, len(names)))
        given = [given[name] for name in names]
        columns = True
    else:
        columns = False
    try:
        points = np.array(given, dtype=float)
    except (TypeError, ValueError):
        checks.add("points", f"must be a number of runs, or numbers, got {given!r:.80}", wrong_type=True)
        return np.empty((0, len(names)))
    points = points.T if columns else points
    if points.ndim != 2 or points.shape[1] != len(names) or not len(points):
        wanted = f"a column for each of {', '.join(names)}, the shape (runs, {len(names)})"
        checks.add("points", f"must have {wanted}; got the shape {points.shape}")
    elif len(points) > MOST_RUNS:
        checks.add("points", f"may be at most {MOST_RUNS}, got {len(points)}")
    elif not np.isfinite(points).all():
        checks.add("points", "must be finite numbers")
    elif not in_box(intervals, points):
        checks.add("points", "must lie in the intervals of the study; Study.function takes others")
    return np.ascontiguousarray(points)
