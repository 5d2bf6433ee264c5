"""The runs of a study: scenes built, simulated wherever that is, and those sorted out that failed."""

from __future__ import annotations

import hashlib
import json
import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from ..base.progress import Progress
from ..base.units import unit
from ..errors import ChebclearWarning, InputError, Problem, SceneError, SettingsError, SimulationError
from ..execution.batch import Batch, Built
from ..execution.failures import (
    BUILD,
    FEATURE,
    FailedRun,
    end_of,
    located,
    run_to_raise,
    told_failures,
)
from ..execution.limited import LimitedCalls
from ..execution.means import Means
from ..execution.pieces import NOT_BEGUN, SCENE, SETTINGS, End, stats_of
from ..execution.store import Identity, Store
from ..run.settings import Settings
from ..run.trajectory import Stats
from ..scene.scene import ClearanceRevolute, Interval, Scene
from .features.features import Asked, feature_values, settling_warnings
from .features.swept import SweptRun

Array = NDArray[np.float64]

MOST_NODES = 10_000
"""Nodes or points of one parameter [-]."""
MOST_RUNS = 1_000_000
"""Runs of a study [-]."""


@dataclass(frozen=True)
class Runs:
    """Runs of a study that succeeded, the nominal one last if it was asked for."""

    t: Array = field(metadata=unit("s"))
    """Instants [s], shape (samples,)."""
    outputs: tuple[str, ...]
    """Names of the outputs."""
    values: Array
    """All outputs of all runs in their units, shape (runs + 1, samples, outputs)."""
    kept: NDArray[np.intp]
    """Numbers of the points whose runs these are, without the nominal one."""
    stats: tuple[Stats, ...]
    """What each run cost."""
    warnings: tuple[str, ...]
    """What the user should be warned of, each text once."""
    settings: Settings | None
    """How the runs were simulated; None if they were not."""
    features: Array | None
    """Features of all runs, shape (runs + 1, cycles, features); None if there are none."""
    feature_names: tuple[str, ...]
    """Names of the features."""
    seconds: float = field(default=math.nan, metadata=unit("s"))
    """Time they took [s]."""
    nominal_parameters: Array | None = None
    """Parameters of the run that stands for the nominal one, shape (parameters,); None at the midpoint."""
    scene: Scene | None = None
    """The scene at the midpoint of all intervals; None if the runs were not simulated."""
    clearances: dict[str, float] = field(default_factory=dict, metadata=unit("m"))
    """Largest clearance of each joint in all scenes [m]."""
    scenes: Sequence[Scene] = ()
    """What was simulated, built anew when it is asked for: thousands of scenes fill the memory."""
    failures: tuple[FailedRun, ...] = ()
    """The runs that failed."""

    @property
    def facts(self) -> dict[str, Any]:
        """What a `StudyResult` says of its runs besides their values."""
        return {
            "stats": self.stats,
            "warnings": self.warnings,
            "settings": self.settings,
            "scene": self.scene,
            "nominal_parameters": self.nominal_parameters,
            "seconds": self.seconds,
            "failures": self.failures,
        }


class Scenes(Sequence[Scene]):
    """The scenes of runs, each built when it is asked for.

    Parameters
    ----------
    numbers : ndarray
        Numbers of the runs.
    build : callable
        Makes the scene of a run by its number.
    """

    def __init__(self, numbers: NDArray[np.intp], build: Callable[[int], Scene]) -> None:
        self._numbers = numbers
        self._build = build

    def __len__(self) -> int:
        return len(self._numbers)

    @overload
    def __getitem__(self, index: int) -> Scene: ...
    @overload
    def __getitem__(self, index: slice) -> Scenes: ...
    def __getitem__(self, index: int | slice) -> Scene | Scenes:
        if isinstance(index, slice):
            return Scenes(self._numbers[index], self._build)
        return self._build(int(self._numbers[index]))


class Making:
    """The runs at some points while they are made.

    Parameters
    ----------
    scene : callable
        Makes the scene from parameters by name; its errors name them.
    intervals : mapping of str to Interval
        Interval of each parameter [SI units].
    points : ndarray, shape (runs, parameters)
        Parameters of the runs [SI units].
    settings : Settings
        How a run is simulated; outputs may be patterns.
    features : mapping of str to Feature or callable
        What is found of every run.
    means : Means
        Where and how.
    rtol : float
        Relative tolerance of the study [-], which single analyses replace.
    midpoint : bool
        Whether the run at the midpoint is simulated too, as the last one.
    """

    def __init__(
        self,
        scene: Callable[[dict[str, float]], Scene],
        intervals: Mapping[str, Interval],
        points: Array,
        settings: Settings,
        features: Mapping[str, Asked],
        means: Means,
        rtol: float,
        midpoint: bool,
    ) -> None:
        self._scene = scene
        self._intervals = intervals
        self._points = points
        self._asked = features
        self._means = means
        self._midpoint = midpoint
        self._rtol = rtol
        self._limited = LimitedCalls(means.run_seconds)
        self._raised: dict[int, BaseException] = {}
        self._seen: set[Any] = set()  # so that a place in `build` warns once, not in every run
        self._clearances: dict[str, float] = {}
        self.count = len(points) + midpoint
        middle = {name: side.midpoint for name, side in intervals.items()}
        self._nominal, self._nominal_told = self._built(middle)
        self._note_clearances(self._nominal)
        try:
            facts = self._nominal.check()
            self.settings = settings.for_scene(self._nominal, runs=self.count)
        except InputError as error:
            raise type(error)(located(middle, error.problems)) from None
        outputs = self.settings.outputs
        self.columns = facts.columns if outputs is None else tuple(outputs)
        self._require_ends(middle)

    def parameters(self, number: int) -> dict[str, float]:
        """Parameters of a run by its number; the nominal one comes last [SI units]."""
        if number == len(self._points):
            return {name: side.midpoint for name, side in self._intervals.items()}
        return dict(zip(self._intervals, map(float, self._points[number]), strict=True))

    def run(self, report: Progress | None) -> Runs:
        """Simulate."""
        means = self._means
        store = None
        settings = replace(self.settings, outputs=self.columns)
        if means.store is not None:
            identity = Identity(settings, topology(self._nominal), self._rtol)
            store = Store(means.store, identity)
        try:
            numbers = list(range(self.count))
            if self._midpoint:  # first, since nothing can be made of a study without it
                numbers = [numbers[-1], *numbers[:-1]]
            batch = Batch(
                self._build,
                numbers,
                settings,
                threads=1 if means.executor is None else means.threads or 1,
                retried=means.on_failure == "collect",
                run_seconds=means.run_seconds,
                store=store,
            )
            batch.run(means.executor, means.threads, report, means.max_seconds)
        finally:
            self._limited.close()
            if store is not None:
                store.close()
        return self._sorted(batch, [] if store is None else store.remarks)

    def _build(self, number: int) -> Built | End:
        """The scene of a run for the core."""
        parameters = self.parameters(number)
        try:
            scene, told = self._built(parameters)
            self._note_clearances(scene)
            try:
                return Built(scene.to_json(), told)
            except SceneError as error:
                raise SceneError(located(parameters, error.problems)) from None
        except Exception as error:
            if self._means.on_failure == "raise":
                raise
            self._raised.setdefault(number, error)
            return end_of(error, BUILD)

    def _built(self, parameters: dict[str, float]) -> tuple[Scene, tuple[str, ...]]:
        """A scene, and what `build` warned of; other warnings take their usual way."""
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            scene = self._limited(self._scene, parameters)
        for one in caught:
            place = (str(one.message), one.category, one.filename, one.lineno)
            if one.category is not ChebclearWarning and place not in self._seen:
                self._seen.add(place)
                warnings.warn_explicit(one.message, one.category, one.filename, one.lineno)
        return scene, tuple(str(one.message) for one in caught if one.category is ChebclearWarning)

    def _note_clearances(self, scene: Scene) -> None:
        for joint in scene.joints:
            if isinstance(joint, ClearanceRevolute):
                known = self._clearances.get(joint.name, 0.0)
                self._clearances[joint.name] = max(known, joint.clearance)

    def _require_ends(self, middle: dict[str, float]) -> None:
        """Raise if there is no mechanism at an end of an interval: bounds are those of the whole interval.

        Chebyshev roots lie inside, and would not notice a length that reaches down to zero; and the others
        should be told before the runs are paid for.
        """
        for name, side in self._intervals.items():
            for end in (side.lower, side.upper):
                at_end = middle | {name: end}
                try:
                    scene, _ = self._built(at_end)
                    try:
                        facts = scene.check()
                        known = facts.columns + facts.further_columns
                        lacking = [column for column in self.columns if column not in known]
                        if lacking:
                            message = f'has no "{lacking[0]}" as at the midpoint: all scenes of a study need '
                            raise SceneError([("outputs", message + "the outputs of interest")])
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
                    if self._means.on_failure == "raise":
                        raise

    def _sorted(self, batch: Batch, remarks: list[str]) -> Runs:
        """What succeeded, and what did not."""
        self._require_success(batch)
        features = None
        if self._asked:
            features = self._features(batch)
            self._require_success(batch)
        failed = dict(batch.failed())
        kept = np.array([number for number in range(self.count) if number not in failed], dtype=np.intp)
        failures = tuple(FailedRun.of(number, self.parameters(number), end) for number, end in failed.items())
        values = _moved_up(batch.values, kept)
        messages = (*batch.told.messages(self.count), *told_failures(failures, self.count), *remarks)
        if features is not None:
            features = _moved_up(features, kept)
            tracked = batch.features[kept]
            messages += settling_warnings(self._asked, self.settings, self._nominal, tracked)
        assert batch.t is not None, "at least one run succeeded"
        return Runs(
            t=batch.t,
            outputs=self.columns,
            values=values,
            kept=kept[: len(kept) - self._midpoint],
            failures=failures,
            scene=self._nominal,
            clearances=self._clearances,
            scenes=Scenes(kept, lambda number: self._scene(self.parameters(number))),
            stats=tuple(stats_of(row) for row in batch.counts[kept].tolist()),
            warnings=messages,
            settings=self.settings,
            features=features,
            feature_names=tuple(self._asked),
        )

    def _features(self, batch: Batch) -> Array:
        """The features of all runs; a run without one is noted as failed."""
        failed = dict(batch.failed())

        def fail(number: int, error: Exception) -> None:
            if self._means.on_failure == "raise":
                raise error
            self._raised.setdefault(number, error)
            batch.end(number, end_of(error, FEATURE))

        def swept(number: int) -> SweptRun:
            samples = batch.values[number].view()
            samples.flags.writeable = False
            scene, stats = self._scene(self.parameters(number)), stats_of(batch.counts[number].tolist())
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
        """Raise for the first failed run if it is to be, if the nominal run is lost, or most are."""
        failed = {number: end for number, end in batch.failed() if end.status != NOT_BEGUN}
        first = run_to_raise(failed, self.count, len(self._points), self._means.on_failure)
        if first is None:
            return
        end, parameters = failed[first], self.parameters(first)
        if first in self._raised:
            raise self._raised[first]
        if end.status in (SCENE, SETTINGS):
            problems = located(parameters, end.problems)
            wrong = sum(one.status == end.status for one in failed.values())
            if wrong > 1:
                problems.append(Problem("study", f"{wrong - 1} more of {self.count} scenes have problems"))
            raise (SceneError if end.status == SCENE else SettingsError)(problems)
        counted = f"({len(failed)} of {self.count} runs of the study failed)"
        raise SimulationError(end.status, end.time, end.joint, parameters, f"{end.message} {counted}")


def topology(scene: Scene) -> str:
    """Fingerprint of a scene without its numbers: its parts, their names and how they are connected."""

    def shape(plain: Any) -> Any:
        if isinstance(plain, dict):
            return {name: shape(value) for name, value in plain.items()}
        if isinstance(plain, list):
            return [shape(value) for value in plain]
        return None if isinstance(plain, int | float) else plain

    text = json.dumps(shape(json.loads(scene.to_json())), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _moved_up(values: Array, kept: NDArray[np.intp]) -> Array:
    """The rows that are kept, without room for a second copy of all."""
    for new, old in enumerate(kept):
        if new != old:
            values[new] = values[old]
    return values[: len(kept)]
