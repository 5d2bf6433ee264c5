"""The runs of a study: scenes are built and simulated, and failed runs are separated."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...base.progress import Progress
from ...base.rows import Array
from ...errors import (
    ArgumentError,
    ArgumentTypeError,
    ChebclearWarning,
    InputError,
    Problem,
    SceneError,
    SettingsError,
    SimulationError,
    describe,
)
from ...execution.batch import Batch, Built, RefusedRunError
from ...execution.costs import Costs
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
from ...execution.pieces import SCENE, SETTINGS, End
from ...execution.store import Store, scene_facts
from ...notices import Notice
from ...run.features import Feature
from ...run.settings import Settings
from ...scene.scene import Scene
from ...scene.structure import FlatScene, ManyScenes, Structure, Structures, unpacked
from .asked import SweptRun, called, settling_notices
from .run_table import RunTable

if TYPE_CHECKING:
    from ..runner import Runner
    from ..spec import StudySpec

MOST_NODES = 10_000
"""Nodes or points of one parameter [-]."""
MOST_RUNS = 1_000_000
"""Runs of a study [-]."""


def scene_of(spec: StudySpec, parameters: dict[str, float]) -> Scene:
    """The scene of a study at these values of the parameters [SI units]; errors name them."""
    try:
        scene = spec.build(**parameters, **spec.fixed)
    except SceneError as error:
        raise SceneError(located(parameters, error.problems)) from error
    except Exception as error:
        error.add_note(f"in build with {describe(parameters)}")
        raise
    if isinstance(scene, Scene):
        return scene
    if isinstance(scene, Mapping):
        raise ArgumentTypeError(
            "build returned a mapping instead of a Scene: a model of your own has its own time axis, so "
            "leave out duration, samples and all other settings of a simulation"
        )
    raise ArgumentTypeError(f"build must return a Scene, got {scene!r} for {describe(parameters)}")


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
        self._runner = runner
        self._midpoint = midpoint
        self._usage = usage
        # That of the study, which single analyses replace.
        self._rtol = settings.run_rtol if runner.settings is None else runner.settings.run_rtol
        self._last = len(points)
        """Number of the nominal run."""
        self._limited = LimitedCalls(runner.execution.run_seconds)
        self._raised: dict[int, Exception] = {}
        self._seen: set[Any] = set()  # so that a place in `build` warns once, not in every run
        self._clearances: dict[str, float] = {}
        """Largest clearance of each joint in the runs [m]."""
        self.count = len(points) + midpoint
        self._points = np.vstack([points, [side.nominal for side in runner.intervals.values()]])
        nominal = self.parameters(self._last)
        with self._watched():
            self._nominal = self._limited(scene_of, runner, nominal)
        self._structures = Structures()
        self._like = self._flat(self._nominal, nominal)
        middle = self._like[0].clearances_in(self._like[1])
        try:
            facts = self._nominal.check()
            self.settings = settings.fitted(facts)
        except InputError as error:
            raise type(error)(located(nominal, error.problems)) from None
        self._branch = facts.branch
        outputs = self.settings.outputs
        self.columns = facts.columns if outputs is None else tuple(outputs)
        self._reach: dict[str, float] = {}
        if runner.execution.most_failed < 1.0:  # else nothing is said of the box
            self._reach = self._checked_ends(nominal, middle)

    def parameters(self, number: int) -> dict[str, float]:
        """Parameters of a run by its number; the nominal one comes last [SI units]."""
        return dict(zip(self._runner.intervals, self._points[number].tolist(), strict=True))

    def _place(self, numbers: Sequence[int]) -> str:
        """Where in the box some runs are, in words."""
        these = np.isin(np.arange(self.count), numbers)
        points = self._points[: self.count]
        return set_apart(list(self._runner.intervals), points[these], points[~these])

    def run(self, report: Progress | None) -> RunTable:
        """Simulate."""
        execution = self._runner.execution
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
            if store is not None:
                store.close()
        return self._sorted(batch, [] if store is None else store.remarks)

    def _build(self, numbers: Sequence[int]) -> Sequence[Built | End]:
        """The scenes of some runs for the core."""
        runner = self._runner
        if not isinstance(runner.build, ManyScenes):
            return self._build_each(numbers)
        structure, like = self._like
        values = dict(zip(runner.intervals, self._points[numbers].T, strict=True))
        table, refused = runner.build.scene_numbers(structure, unpacked(like), values, fixed=runner.fixed)
        built: list[Built | End] = [
            Built(FlatScene(structure.text, row.tobytes(), self._branch)) for row in table
        ]
        self._note(
            {name: float(np.max(table[~refused, k], initial=0.0)) for name, k in structure.clearances.items()}
        )
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
                    scene = self._limited(scene_of, self._runner, parameters)
                    structure, values = self._flat(scene, parameters)
                except Exception as error:
                    built.append(self._fail(number, error, BUILD))
                    continue
                self._note(structure.clearances_in(values))
                told = [one for one in caught[before:] if one.category is ChebclearWarning]
                # Of one kind are those of one line, whatever their numbers.
                notices = tuple(
                    Notice("build", str(one.message), (f"{os.path.basename(one.filename)}:{one.lineno}",))
                    for one in told
                )
                branch = self._branch if structure is self._like[0] else ()
                built.append(Built(FlatScene(structure.text, values, branch), notices))
        return built

    def _fail(self, number: int, error: Exception, where: str) -> End:
        """How a run ends by an error outside of the simulation, which is raised if the study says so."""
        if self._runner.execution.on_failure == "raise":
            raise error
        self._raised.setdefault(number, error)
        return end_of(error, where)

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

    def _note(self, clearances: Mapping[str, float]) -> None:
        for name, clearance in clearances.items():
            self._clearances[name] = max(clearance, self._clearances.get(name, 0.0))

    def _checked_ends(self, nominal: dict[str, float], middle: dict[str, float]) -> dict[str, float]:
        """Largest clearance of each joint in the box, from that in the `middle`, where it depends on one
        parameter at a time [m]; none if it is not known at an end of an interval.

        An error is raised if there is no mechanism at an end, since bounds hold for the whole interval:
        Chebyshev roots lie inside, and would not reveal a length that reaches down to zero; for other points
        the problem is reported before the runs are simulated.
        """
        largest, known = dict(middle), True
        for name, side in self._runner.intervals.items():
            ends = []
            for end in (side.lower, side.upper):
                try:
                    ends.append(self._clearances_at(nominal | {name: end}))
                except SceneError as error:
                    reason = (
                        f'the interval of "{name}" reaches to {end!r}, where there is no such mechanism: '
                        "bounds are those of the whole interval"
                    )
                    raise SceneError([*error.problems, Problem(f"parameters.{name}", reason)]) from None
                except Exception:
                    # A callable that fails at a point fails in its run, if there is one.
                    if self._runner.execution.on_failure == "raise":
                        raise
                    known = False
            for joint, clearance in middle.items():
                largest[joint] += max([0.0, *(at.get(joint, math.inf) - clearance for at in ends)])
        return largest if known else {}

    def _clearances_at(self, parameters: dict[str, float]) -> dict[str, float]:
        """Clearances of the mechanism at some parameters [m], which must be one like the nominal."""
        with self._watched():
            scene = self._limited(scene_of, self._runner, parameters)
        try:
            facts = scene.check()
            known = facts.columns + facts.further_columns + facts.sector_columns
            lacking = [column for column in self.columns if column not in known]
            if lacking:
                text = (
                    f'has no "{lacking[0]}" as at the nominal values: all scenes of a study need the outputs '
                )
                raise SceneError([("outputs", f"{text}of interest")])
            structure, numbers = self._flat(scene, parameters)
            same = structure is self._like[0]
            if same and any(a * b < 0 for a, b in zip(facts.branch, self._branch, strict=True)):
                raise SceneError([("branch", "closes its loops on another side than at the nominal values")])
        except SceneError as error:
            raise SceneError(located(parameters, error.problems)) from None
        return structure.clearances_in(numbers)

    def _sorted(self, batch: Batch, remarks: list[Notice]) -> RunTable:
        """Successful and failed runs."""
        self._require_success(batch)
        asked, features = self._runner.features, None
        if asked:
            features = self._features(batch)
            self._require_success(batch)
        failed = batch.failed()
        kept = np.array([number for number in range(self.count) if number not in failed], dtype=np.intp)
        failures = tuple(FailedRun.of(number, self.parameters(number), end) for number, end in failed.items())
        values = _moved_up(batch.values, kept)
        told = batch.notices.of(self.count, self._place)
        notices = (*told, *failure_notices(failures, self.count), *remarks)
        if features is not None:
            features = _moved_up(features, kept)
            notices += settling_notices(asked, self.settings, self._nominal, batch.features[kept])
        assert batch.t is not None, "at least one run succeeded"
        inner = kept[: len(kept) - self._midpoint]
        return RunTable(
            parameters=self._points[inner],
            t=batch.t,
            outputs=self.columns,
            values=values,
            kept=inner,
            failures=failures,
            scene=self._nominal,
            clearances={
                name: max(most, self._clearances.get(name, 0.0)) for name, most in self._reach.items()
            },
            scenes=Scenes(kept, lambda number: scene_of(self._runner, self.parameters(number))),
            stats=Costs(batch.counts[kept]),
            notices=notices,
            settings=self.settings,
            features=features,
            feature_names=tuple(asked),
        )

    def _features(self, batch: Batch) -> Array:
        """The features of all runs, shape (runs, cycles, features); a run without one counts as failed."""
        settings, asked = self.settings, self._runner.features
        values = np.full((self.count, settings.cycles, len(asked)), np.nan)
        failed = batch.failed()
        good = dict.fromkeys(number for number in range(self.count) if number not in failed)
        functions = {}
        for index, (name, feature) in enumerate(asked.items()):
            if not isinstance(feature, Feature):
                functions[index] = (name, feature)
                continue
            values[:, :, index] = batch.features[:, :, settings.features.index(feature)]
            for number in [number for number in good if not np.all(np.isfinite(values[number, :, index]))]:
                del good[number]
                why = "" if feature.window is None else f", at no time is {feature.window},"
                text = f'feature "{name}" is not finite{why} with {describe(self.parameters(number))}'
                batch.end(number, self._fail(number, ArgumentError(text), FEATURE))
        for number in good if functions else ():
            name = ""
            try:
                run = self._swept(batch, number)
                for index, (name, function) in functions.items():
                    values[number, :, index] = self._limited(called, name, function, run, settings.cycles)
            except Exception as error:
                error.add_note(f'in feature "{name}" of the run with {describe(self.parameters(number))}')
                batch.end(number, self._fail(number, error, FEATURE))
        return values

    def _swept(self, batch: Batch, number: int) -> SweptRun:
        """A run as a function of the user's own gets it."""
        samples = batch.values[number].view()
        samples.flags.writeable = False
        scene, stats = scene_of(self._runner, self.parameters(number)), Costs(batch.counts)[number]
        assert batch.t is not None, "a run succeeded"
        return SweptRun(scene, self.settings, batch.t, self.columns, samples, stats)

    def _require_success(self, batch: Batch) -> None:
        """Raise for the first failure if the study says so, or if the nominal run or most runs failed."""
        failed = batch.failed_of_begun()
        require_success(
            failed,
            batch.begun,
            self._last,
            self._runner.execution,
            lambda first: self._error_of(first, failed),
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
