"""A model of the user's own, a callable that returns named time series and numbers, called at every point."""

from __future__ import annotations

import functools
import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.arguments import Checks
from ...base.progress import Progress
from ...base.rows import Array
from ...errors import ArgumentError, SimulationError, describe
from ...execution.costs import STATS
from ...execution.dispatch import CallingThread, ExecutorWorkers, Source, Task
from ...execution.failures import FEATURE, MODEL, FailedRun, end_of, failure_notices, require_success
from ...execution.limited import Answers, Calls, LimitedCalls, TimeLimitError
from ...execution.pieces import DONE, End, Piece, code_version
from ...execution.store import KEY_BYTES, Store
from ...run.features import Feature
from ..polynomials.points import nominal_point
from .asked import called, require_known
from .own import chosen_outputs, sampled_feature
from .returned import ReturnedRun, read_run, require_same
from .run_table import RunTable

if TYPE_CHECKING:
    from ..runner import Runner

# Largest size of the values of a piece [bytes]; workers hold some pieces at a time.
_MOST_BYTES = 16_000_000
# Texts up to this length are kept as they are, so that a difference can be read [-].
_READABLE = 60


def call_model(
    function: Callable[..., Any], fixed: Mapping[str, Any], parameters: Mapping[str, float]
) -> ReturnedRun:
    """The checked result of a model for some parameters; errors name them."""
    try:
        value = function(**parameters, **fixed)
    except Exception as error:
        error.add_note(f"in the model with {describe(parameters)}")
        raise
    try:
        return read_run(value)
    except (ValueError, TypeError) as error:
        raise _named(error, parameters) from None


class Calling(Source):
    """The calls of a model at `given` parameters, those of the nominal run, if asked for, last: it is called
    first.

    All runs are held to the names and instants of `first`: of the first one that succeeds if it is None.
    """

    def __init__(
        self,
        runner: Runner,
        given: Sequence[Mapping[str, float]],
        midpoint: bool,
        store: Store | None,
        first: ReturnedRun | None,
    ) -> None:
        numbers = list(range(len(given)))
        self._nominal = numbers[-1] if midpoint else None
        if midpoint:  # nothing can be made of a study without it
            numbers = [numbers[-1], *numbers[:-1]]
        super().__init__(numbers, store)
        self._runner = runner
        self._call = functools.partial(call_model, runner.build, runner.fixed)
        self._given = given
        self._limited = LimitedCalls(runner.execution.run_seconds)
        self.first = first
        self._oldest = 0
        self._first_failure: tuple[int, Exception] | None = None
        self._early: dict[int, ReturnedRun] = {}

    def run(self, report: Progress | None) -> None:
        """Make all runs, or those for which there is time."""
        if self.first is not None:
            self._begin(self.first)
        elif self.store is not None and (key := self._key(self._numbers[0])) in self.store:
            self._begin(self._first_of(self.store, key))
        executor = self._runner.execution.executor
        workers = CallingThread() if executor is None else ExecutorWorkers(executor, self)
        self.make(workers, report, self._runner.execution)
        if self.first is None and self.store is not None and self._kept:
            self._begin(self._first_of(self.store, self._kept[0][1]))
        self.read_kept(report)
        self._require_success()

    def table(self, points: Array) -> RunTable:
        """The runs that succeeded, at these points."""
        failed = self.failed()
        failures = tuple(FailedRun.of(number, self._given[number], end) for number, end in failed.items())
        kept = np.array([number for number in range(self.total) if number not in failed], dtype=np.intp)
        inner = kept if self._nominal is None else kept[:-1]
        remarks = () if self.store is None else self.store.remarks
        return RunTable(
            parameters=points[inner],
            kept=inner,
            t=self._t,
            outputs=self._outputs,
            values=self._values[kept],
            features=self._features[kept] if self._names else None,
            feature_names=self._names,
            notices=(*failure_notices(failures, self.total), *remarks),
            failures=failures,
        )

    def take(self, count: int) -> Task | None:
        if self.first is not None:
            values = len(self.first.t) * (1 + len(self.first.series)) + len(self.first.numbers)
            count = min(count, max(1, _MOST_BYTES // (8 * max(1, values))))
        runs: list[int] = []
        while len(runs) < count and self.taken < self.total:
            number = self._numbers[self.taken]
            self.taken += 1
            if self.store is not None and (key := self._key(number)) in self.store:
                self._kept.append((number, key))
            else:
                runs.append(number)
        return self.again(runs) if runs else None

    def again(self, runs: Sequence[int]) -> Task:
        given = [self._given[number] for number in runs]
        return Task(runs, Calls(self._call, given, self._runner.execution.run_seconds), None)

    def place(self, task: Task, answers: Answers) -> None:
        for number, run, error in zip(task.runs, answers.values, answers.errors, strict=True):
            if error is not None:
                self._fail(number, error, MODEL)
            else:
                self._early[number] = run
        self.finish(task.runs)
        if self.first is None:
            self._find_first()
        if self.first is not None:
            self._settle(self.first)

    def lost(self, runs: Sequence[int], error: BaseException) -> None:
        super().lost(runs, error)
        for number in runs:
            end = self.ends[number]
            lost = SimulationError(end.status, 0.0, None, self._given[number], end.message)
            self._ended(number, end, lost)

    def _find_first(self) -> None:
        """The first run in the order of the study that did not fail, whenever it came back."""
        while self._oldest < self.total:
            number = self._numbers[self._oldest]
            if number in self._early:
                self._begin(self._early[number])
                return
            if self.ends[number].status == DONE:
                return  # on its way, or in the store
            self._oldest += 1

    def _begin(self, first: ReturnedRun) -> None:
        """Allocate memory for runs like this one."""
        self.first, runner = first, self._runner
        both = [name for name in first.numbers if name in runner.features]
        if both:
            raise ArgumentError(f'"{both[0]}" is a number that the model returns and a name in features')
        checks = Checks()
        known = [*runner.intervals, *first.series, *runner.features, *first.numbers]
        require_known(checks, runner.units, known)
        checks.finish()
        self._t = first.t
        self._outputs = chosen_outputs(list(first.series), runner.outputs)
        self._names = (*runner.features, *first.numbers)
        samples = len(first.t) if self._outputs else 0
        self._values = np.empty((self.total, samples, len(self._outputs)))
        self._features = np.empty((self.total, runner.cycles, len(self._names)))
        if self.store is not None:
            self.store.name(list(first.series), list(first.numbers))

    def _settle(self, first: ReturnedRun) -> None:
        """Put runs that came back into the store and the table."""
        good: dict[int, ReturnedRun] = {}
        for number, run in self._early.items():
            try:
                require_same(first, run)
                good[number] = run
            except ValueError as error:
                self._fail(number, _named(error, self._given[number]), MODEL)
        self._early = {}
        if self.store is not None and good:
            self.store.write([self._key(number) for number in good], _piece(first, list(good.values())))
        for number, run in good.items():
            self._fill(number, run)

    def _fill(self, number: int, run: ReturnedRun) -> None:
        """Keep a run, with the features that were asked for and then the numbers that it has."""
        for column, name in enumerate(self._outputs):
            self._values[number, :, column] = run.series[name]
        own, cycles = self._features[number], self._runner.cycles
        for index, (name, asked) in enumerate(self._runner.features.items()):
            try:
                if isinstance(asked, Feature):
                    series = run.series[chosen_outputs(list(run.series), [asked.of])[0]]
                    own[:, index] = sampled_feature(asked, run.t, series, cycles)
                else:
                    own[:, index] = self._limited(called, name, asked, run.mapping, cycles)
            except Exception as error:
                error.add_note(f'in feature "{name}" of the run with {describe(self._given[number])}')
                self._fail(number, error, FEATURE)
                return
        asked_first = len(self._runner.features)
        own[:, asked_first:] = [run.numbers[name] for name in self._names[asked_first:]]

    def fill(self, numbers: Sequence[int], piece: Piece) -> None:
        assert self.first is not None, "what is kept is read after it"
        for row, number in enumerate(numbers):
            self._fill(number, _run_of(piece, row, list(self.first.series), list(self.first.numbers)))

    def _first_of(self, store: Store, key: bytes) -> ReturnedRun:
        """A run that is kept, with the names that it was kept with."""
        series, numbers = store.names(key)
        store.name(series, numbers)
        ((_, piece),) = store.read([(0, key)])
        return _run_of(piece, 0, series, numbers)

    def _fail(self, number: int, error: Exception, where: str) -> None:
        if isinstance(error, TimeLimitError):
            error.add_note(f"in the model with {describe(self._given[number])}")
        self._ended(number, end_of(error, where), error)

    def _ended(self, number: int, end: End, error: Exception) -> None:
        """Note a run that failed; its error is kept if it may have to be raised."""
        if self._runner.execution.on_failure == "raise" or number == self._nominal:
            raise error
        self.ends[number] = end
        if self._first_failure is None or number < self._first_failure[0]:
            self._first_failure = (number, error)

    def _require_success(self) -> None:
        failed = self.failed_of_begun()
        require_success(
            failed, self.begun, self._nominal, self._runner.execution, lambda _: self._first_error(failed)
        )

    def _first_error(self, failed: Mapping[int, End]) -> Exception:
        assert self._first_failure is not None, "a run failed"
        error = self._first_failure[1]
        if len(failed) > 1:
            error.add_note(f"{len(failed)} of {self.total} runs of the study failed")
        return error

    def _key(self, number: int) -> bytes:
        text = json.dumps(dict(sorted(self._given[number].items())))
        return hashlib.sha256(text.encode()).digest()[:KEY_BYTES]


def _piece(first: ReturnedRun, runs: Sequence[ReturnedRun]) -> Piece:
    """Runs as a store keeps them: all that the model returned."""
    values = np.empty((len(runs), len(first.t) if first.series else 0, len(first.series)))
    numbers = np.empty((len(runs), 1, len(first.numbers)))
    for row, run in enumerate(runs):
        for column, name in enumerate(first.series):
            values[row, :, column] = run.series[name]
        numbers[row, 0] = [run.numbers[name] for name in first.numbers]
    return Piece(
        t=first.t,
        values=values,
        features=numbers,
        counts=np.zeros((len(runs), len(STATS))),
        ends=(End(),) * len(runs),
        notices=((),) * len(runs),
        code=code_version(),
        seconds=0.0,
    )


def _run_of(piece: Piece, row: int, series: Sequence[str], numbers: Sequence[str]) -> ReturnedRun:
    """A run that a store kept."""
    return ReturnedRun(
        piece.t,
        {name: piece.values[row, :, column] for column, name in enumerate(series)},
        dict(zip(numbers, map(float, piece.features[row, 0]), strict=True)),
    )


def _facts(runner: Runner, version: str | None) -> dict[str, Any]:
    """What the runs of a model have in common, as JSON has it: its version, and the data in `fixed`.

    Its outputs and features are named when the first run is known.
    """
    name = getattr(runner.build, "__qualname__", type(runner.build).__qualname__)
    texts = {key: json.dumps(one, sort_keys=True) for key, one in runner.facts()["fixed"].items()}
    known = {
        f"fixed {key}": text if len(text) <= _READABLE else hashlib.sha256(text.encode()).hexdigest()[:16]
        for key, text in texts.items()
    }
    code = f"model {name}, version {version}"
    return {"code": code, "topology": "", "settings": known, "outputs": [], "features": []}


def _named(error: Exception, parameters: Mapping[str, float]) -> Exception:
    """The error with the parameters of its run."""
    return type(error)(f"the model with {describe(parameters)}: {error}")


@dataclass(eq=False)
class OwnModel:
    """A model of the user's, called at every point."""

    version: str | None
    """What a store compares for the model and everything that it uses."""
    first: ReturnedRun | None = field(default=None, init=False)
    """The run with whose names and instants all others are compared; None before there is one."""

    def runs(self, runner: Runner, points: Array, midpoint: bool, report: Progress | None) -> RunTable:
        """The runs at the points and, if asked for, last at the nominal values; for errors see `Study`."""
        if midpoint:
            points = np.vstack([points, nominal_point(runner.intervals)])
        given = [dict(zip(runner.intervals, map(float, row), strict=True)) for row in points]
        store = None
        if runner.execution.store is not None:
            store = Store(runner.execution.store, _facts(runner, self.version))
        calling = Calling(runner, given, midpoint, store, self.first)
        try:
            calling.run(report)
        finally:
            if store is not None:
                store.close()
        self.first = calling.first
        return calling.table(points)
