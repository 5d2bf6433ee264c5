"""Execution of the calls of a user's model: remaining, finished and failed runs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.progress import Progress
from ...errors import SimulationError, describe
from ...execution.counts import STATS
from ...execution.dispatch import CallingThread, ExecutorWorkers, Source, Task
from ...execution.failures import FEATURE, MODEL, FailedRun, end_of, require_success
from ...execution.limited import Answers, Calls, TimeLimitError
from ...execution.options import ExecutionOptions
from ...execution.pieces import DONE, NOT_BEGUN, End, Piece, code_version
from ...execution.store import KEY_BYTES, Store
from .returned import ReturnedRun, read_run, require_same

if TYPE_CHECKING:
    from .own import ModelTable

# Largest size of the values of a piece [bytes]; workers hold some pieces at a time.
_MOST_BYTES = 16_000_000


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
    """The calls of a model at `given` parameters; the nominal run, if it is among them, is called first.

    All runs are held to the names and instants of `first`: of the first one that succeeds if it is None.
    """

    def __init__(
        self,
        call: Callable[[Mapping[str, float]], ReturnedRun],
        given: Sequence[Mapping[str, float]],
        nominal: int | None,
        execution: ExecutionOptions,
        store: Store | None,
        table: ModelTable,
        first: ReturnedRun | None,
    ) -> None:
        numbers = list(range(len(given)))
        if nominal is not None:  # nothing can be made of a study without it
            numbers = [nominal, *(number for number in numbers if number != nominal)]
        super().__init__(numbers, store)
        self._call = call
        self._given = given
        self._nominal = nominal
        self._execution = execution
        self._table = table
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
        executor = self._execution.executor
        workers = CallingThread() if executor is None else ExecutorWorkers(executor, self)
        self.make(workers, report, self._execution.max_seconds)
        if self.first is None and self.store is not None and self._kept:
            self._begin(self._first_of(self.store, self._kept[0][1]))
        self.read_kept(report)
        self._require_success()

    def failures(self) -> tuple[FailedRun, ...]:
        """The runs that failed."""
        return tuple(FailedRun.of(number, self._given[number], end) for number, end in self.failed().items())

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
        order = Calls(self._call, [self._given[number] for number in runs], self._execution.run_seconds)
        return Task(runs, order, None)

    def place(self, task: Task, answers: Answers) -> None:
        for number, run, error in zip(task.runs, answers.values, answers.errors, strict=True):
            if error is not None:
                self._fail(number, error, MODEL)
            else:
                self._early[number] = run
        self.done += len(task.runs)
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
        self.first = first
        self._table.begin(first)
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
        try:
            self._table.fill(number, run)
        except Exception as error:
            self._fail(number, error, FEATURE)

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
        if self._execution.on_failure == "raise" or number == self._nominal:
            raise error
        self.ends[number] = end
        if self._first_failure is None or number < self._first_failure[0]:
            self._first_failure = (number, error)

    def _require_success(self) -> None:
        failed = {number: end for number, end in self.failed().items() if end.status != NOT_BEGUN}
        require_success(
            failed, self.total, self._nominal, self._execution, lambda _: self._first_error(failed)
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


def _named(error: Exception, parameters: Mapping[str, float]) -> Exception:
    """The error with the parameters of its run."""
    return type(error)(f"the model with {describe(parameters)}: {error}")
