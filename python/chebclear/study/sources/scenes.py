"""The runs of a study: scenes are built and simulated, and failed runs are separated."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...base.progress import Progress
from ...base.rows import Array
from ...errors import ChebclearWarning, InputError, Problem, SceneError, SettingsError, SimulationError
from ...execution.batch import Batch, Built, RefusedRunError
from ...execution.counts import Costs
from ...execution.failures import (
    BUILD,
    FEATURE,
    FailedRun,
    end_of,
    failure_notices,
    located,
    require_success,
    set_apart,
)
from ...execution.limited import LimitedCalls
from ...execution.memory import Usage
from ...execution.pieces import NOT_BEGUN, SCENE, SETTINGS, End
from ...execution.store import Store, scene_facts
from ...notices import Notice
from ...run.settings import Settings
from ...scene.scene import Scene
from ...scene.structure import FlatScene, ManyScenes, Structure, Structures, number_at, unpacked
from .asked import SweptRun, feature_values, settling_notices
from .run_table import RunTable

if TYPE_CHECKING:
    from ..runner import Runner

Many = Callable[[Structure, Sequence[float], Mapping[str, Array]], tuple[Array, NDArray[np.bool_]]]
"""Numbers of the scenes of many runs from one of them and the parameters that change; see `ManyScenes`."""

MOST_NODES = 10_000
"""Nodes or points of one parameter [-]."""
MOST_RUNS = 1_000_000
"""Runs of a study [-]."""


class Scenes(Sequence[Scene]):
    """The scenes of the runs with some numbers, each built on request."""

    def __init__(self, numbers: NDArray[np.intp], build: Callable[[int], Scene]) -> None:
        self._numbers = numbers
        self._build = build

    def __len__(self) -> int:
        return len(self._numbers)

    def __getitem__(self, index: int) -> Scene:  # type: ignore[override] # nobody asks for slices
        return self._build(int(self._numbers[index]))


class SceneRuns:
    """Simulation of the runs at some points, and of the nominal one, as the last, if the midpoint is asked
    for.

    `usage` is what the result takes besides the samples.
    """

    def __init__(
        self, runner: Runner, points: Array, settings: Settings, midpoint: bool, usage: Usage
    ) -> None:
        self._usage = usage
        self._scene = runner.scene
        self._many: Many | None = None
        if isinstance(runner.build, ManyScenes):
            self._many = partial(runner.build.scene_numbers, fixed=runner.fixed)
        self._intervals = runner.intervals
        self._asked = runner.features
        self._execution = execution = runner.execution
        self._midpoint = midpoint
        # That of the study, which single analyses replace.
        self._rtol = settings.rtol if runner.settings is None else runner.settings.rtol
        self._last = len(points)
        """Number of the nominal run."""
        self._limited = LimitedCalls(execution.run_seconds)
        self._raised: dict[int, Exception] = {}
        self._seen: set[Any] = set()  # so that a place in `build` warns once, not in every run
        self._clearances: dict[str, float] = {}
        self._structures = Structures()
        self.count = len(points) + midpoint
        with self._watched():
            nominal = runner.nominal
            self._nominal = self._limited(self._scene, nominal)
        self._points = np.vstack([points, list(nominal.values())])
        self._like = self._flat(self._nominal, nominal)
        try:
            facts = self._nominal.check()
            self.settings = settings.fitted(facts)
            self._branch = facts.branch
        except InputError as error:
            raise type(error)(located(nominal, error.problems)) from None
        outputs = self.settings.outputs
        self.columns = facts.columns if outputs is None else tuple(outputs)
        if execution.most_failed < 1.0:  # else nothing is said of the box
            self._require_ends(nominal)

    def parameters(self, number: int) -> dict[str, float]:
        """Parameters of a run by its number; the nominal one comes last [SI units]."""
        return dict(zip(self._intervals, self._points[number].tolist(), strict=True))

    def _place(self, numbers: Sequence[int]) -> str:
        """Where in the box some runs are, in words."""
        these = np.isin(np.arange(self.count), numbers)
        points = self._points[: self.count]
        return set_apart(list(self._intervals), points[these], points[~these])

    def run(self, report: Progress | None) -> RunTable:
        """Simulate."""
        execution = self._execution
        store = None
        settings = replace(self.settings, outputs=self.columns)
        if execution.store is not None:
            store = Store(execution.store, scene_facts(settings, self._like[0].fingerprint, self._rtol))
        try:
            numbers = list(range(self._last))
            if self._midpoint:  # first, since a study needs it
                numbers = [self._last, *numbers]
            batch = Batch(self._build, numbers, settings, execution, store, self._usage)
            batch.run(report)
        except RefusedRunError as error:
            raise SceneError(located(self.parameters(error.number), error.end.problems)) from None
        finally:
            self._limited.close()
            if store is not None:
                store.close()
        return self._sorted(batch, [] if store is None else store.remarks)

    def _build(self, numbers: Sequence[int]) -> Sequence[Built | End]:
        """The scenes of some runs for the core."""
        if self._many is None:
            return self._build_each(numbers)
        structure, like = self._like
        values = dict(zip(self._intervals, self._points[numbers].T, strict=True))
        table, refused = self._many(structure, unpacked(like), values)
        for name, index in structure.clearances.items():
            self._note_clearance(name, float(np.max(table[~refused, index], initial=0.0)))
        built: list[Built | End] = [
            Built(FlatScene(structure.text, row.tobytes(), self._branch)) for row in table
        ]
        for row in np.flatnonzero(refused).tolist():
            built[row] = self._build_each([numbers[row]])[0]
        return built

    def _build_each(self, numbers: Sequence[int]) -> list[Built | End]:
        """The same, one after the other."""
        built: list[Built | End] = []
        with self._watched() as caught:
            for number in numbers:
                parameters, before = self.parameters(number), len(caught)
                try:
                    structure, values = self._flat(self._limited(self._scene, parameters), parameters)
                except Exception as error:
                    if self._execution.on_failure == "raise":
                        raise
                    self._raised.setdefault(number, error)
                    built.append(end_of(error, BUILD))
                    continue
                for name, index in structure.clearances.items():
                    self._note_clearance(name, number_at(index, values))
                notices: tuple[Notice, ...] = ()
                if len(caught) > before:
                    told = [one for one in caught[before:] if one.category is ChebclearWarning]
                    # Of one kind are those of one line, whatever their numbers.
                    places = [f"{os.path.basename(one.filename)}:{one.lineno}" for one in told]
                    notices = tuple(
                        Notice("build", str(one.message), (place,))
                        for one, place in zip(told, places, strict=True)
                    )
                branch = self._branch if structure is self._like[0] else ()
                built.append(Built(FlatScene(structure.text, values, branch), notices))
        return built

    def _flat(self, scene: Scene, parameters: Mapping[str, float]) -> tuple[Structure, bytes]:
        try:
            return self._structures.flat(scene)
        except SceneError as error:
            raise SceneError(located(parameters, error.problems)) from None

    @contextmanager
    def _watched(self) -> Iterator[list[warnings.WarningMessage]]:
        """What is warned of in the block; other warnings than those of this package take their usual way."""
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            yield caught
        for one in caught:
            place = (str(one.message), one.category, one.filename, one.lineno)
            if one.category is not ChebclearWarning and place not in self._seen:
                self._seen.add(place)
                warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)

    def _note_clearance(self, name: str, clearance: float) -> None:
        if clearance > self._clearances.get(name, 0.0):
            self._clearances[name] = clearance

    def _require_ends(self, nominal: dict[str, float]) -> None:
        """Raise if there is no mechanism at an end of an interval, since bounds hold for the whole interval.

        Chebyshev roots lie inside, and would not reveal a length that reaches down to zero; for other points
        the problem is reported before the runs are simulated.
        """
        for name, side in self._intervals.items():
            for end in (side.lower, side.upper):
                at_end = nominal | {name: end}
                try:
                    with self._watched():
                        scene = self._limited(self._scene, at_end)
                    try:
                        facts = scene.check()
                        known = facts.columns + facts.further_columns + facts.sector_columns
                        lacking = [column for column in self.columns if column not in known]
                        if lacking:
                            message = (
                                f'has no "{lacking[0]}" as at the nominal values: all scenes of a study need '
                            )
                            raise SceneError([("outputs", message + "the outputs of interest")])
                        same = self._flat(scene, at_end)[0] is self._like[0]
                        if same and any(a * b < 0 for a, b in zip(facts.branch, self._branch, strict=True)):
                            raise SceneError(
                                [("branch", "closes its loops on another side than at the nominal values")]
                            )
                    except SceneError as error:
                        raise SceneError(located(at_end, error.problems)) from None
                except SceneError as error:
                    reason = (
                        f'the interval of "{name}" reaches to {end!r}, where there is no such mechanism: '
                    )
                    reason += "bounds are those of the whole interval"
                    raise SceneError([*error.problems, Problem(f"parameters.{name}", reason)]) from None
                except Exception:
                    # A callable that fails at a point fails in its run, if there is one.
                    if self._execution.on_failure == "raise":
                        raise

    def _sorted(self, batch: Batch, remarks: list[str]) -> RunTable:
        """Successful and failed runs."""
        self._require_success(batch)
        features = None
        if self._asked:
            features = self._features(batch)
            self._require_success(batch)
        failed = batch.failed()
        kept = np.array([number for number in range(self.count) if number not in failed], dtype=np.intp)
        failures = tuple(FailedRun.of(number, self.parameters(number), end) for number, end in failed.items())
        values = _moved_up(batch.values, kept)
        told = batch.notices.of(self.count, self._place)
        kept_back = [Notice("store", text) for text in remarks]
        notices = (*told, *failure_notices(failures, self.count), *kept_back)
        if features is not None:
            features = _moved_up(features, kept)
            tracked = batch.features[kept]
            notices += settling_notices(self._asked, self.settings, self._nominal, tracked)
        assert batch.t is not None, "at least one run succeeded"
        return RunTable(
            parameters=self._points[kept[: len(kept) - self._midpoint]],
            t=batch.t,
            outputs=self.columns,
            values=values,
            kept=kept[: len(kept) - self._midpoint],
            failures=failures,
            scene=self._nominal,
            clearances=self._clearances,
            scenes=Scenes(kept, lambda number: self._scene(self.parameters(number))),
            stats=Costs(batch.counts[kept]),
            notices=notices,
            settings=self.settings,
            features=features,
            feature_names=tuple(self._asked),
        )

    def _features(self, batch: Batch) -> Array:
        """The features of all runs; a run without one counts as failed."""
        failed = batch.failed()

        def fail(number: int, error: Exception) -> None:
            if self._execution.on_failure == "raise":
                raise error
            self._raised.setdefault(number, error)
            batch.end(number, end_of(error, FEATURE))

        def swept(number: int) -> SweptRun:
            samples = batch.values[number].view()
            samples.flags.writeable = False
            scene, stats = self._scene(self.parameters(number)), Costs(batch.counts)[number]
            assert batch.t is not None, "a run succeeded"
            return SweptRun(scene, self.settings, batch.t, self.columns, samples, stats)

        return feature_values(
            self._asked,
            self.settings,
            [number for number in range(self.count) if number not in failed],
            swept,
            self.parameters,
            batch.features,
            fail,
            self._limited,
        )

    def _require_success(self, batch: Batch) -> None:
        """Raise for the first failure if the study says so, or if the nominal run or most runs failed."""
        failed = {number: end for number, end in batch.failed().items() if end.status != NOT_BEGUN}
        require_success(
            failed, self.count, self._last, self._execution, lambda first: self._error_of(first, failed)
        )

    def _error_of(self, first: int, failed: Mapping[int, End]) -> Exception:
        """The error of a failed run, which tells of the others."""
        end, parameters = failed[first], self.parameters(first)
        if first in self._raised:
            return self._raised[first]
        if end.status in (SCENE, SETTINGS):
            problems = located(parameters, end.problems)
            wrong = sum(one.status == end.status for one in failed.values())
            if wrong > 1:
                problems.append(Problem("study", f"{wrong - 1} more of {self.count} scenes have problems"))
            return (SceneError if end.status == SCENE else SettingsError)(problems)
        counted = f"({len(failed)} of {self.count} runs of the study failed)"
        return SimulationError(end.status, end.time, end.joint, parameters, f"{end.message} {counted}")


def _moved_up(values: Array, kept: NDArray[np.intp]) -> Array:
    """The rows that are kept, moved in place to save memory."""
    for new, old in enumerate(kept):
        if new != old:
            values[new] = values[old]
    return values[: len(kept)]
