"""Execution of the calls of a user's model: remaining, finished and failed runs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from ...base.progress import Progress
from ...errors import SimulationError, describe, error_text
from ...execution.archive import KEY_BYTES
from ...execution.batch import WORKER_LOST
from ...execution.calls import Answers, Calls
from ...execution.counts import STATS
from ...execution.dispatch import Task, dispatch
from ...execution.failures import FEATURE, MODEL, FailedRun, end_of, error_to_raise, run_to_raise
from ...execution.limited import TimeLimitError
from ...execution.options import ExecutionOptions
from ...execution.pieces import DONE, NOT_BEGUN, End, Piece, code_version
from ...execution.store import Store
from .returned import ReturnedRun, read_run, require_same

# Largest size of the values of a piece [bytes]; workers hold some pieces at a time.
_MOST_BYTES = 16_000_000


class Table(Protocol):
    """Destination of runs."""

    def begin(self, first: ReturnedRun) -> None:
        """Allocate memory for runs like this one."""

    def fill(self, number: int, run: ReturnedRun) -> None:
        """Store a run; raises the exceptions of the user's features."""


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


@dataclass(eq=False)
class Calling:
    """A source of pieces of some calls each, and the end of every run."""

    call: Callable[[Mapping[str, float]], ReturnedRun]
    """Gets the parameters of a run."""
    given: Sequence[Mapping[str, float]]
    """Parameters of each run by name."""
    nominal: int | None
    """Number of the nominal run, if it is among them."""
    execution: ExecutionOptions
    """Where calls are made, and how failed ones are treated."""
    store: Store | None
    """Store of finished runs."""
    table: Table
    """Where they go."""
    first: ReturnedRun | None = None
    """The run that all others are held to; the first one that succeeds if there is none yet."""
    done: int = 0
    """Runs that need no more work."""
    ends: list[End] = field(init=False)
    """How each run ended."""

    def __post_init__(self) -> None:
        self.total = len(self.given)
        self.ends = [End()] * self.total
        numbers = list(range(self.total))
        if self.nominal is not None:  # first, since nothing can be made of a study without it
            numbers = [self.nominal, *(number for number in numbers if number != self.nominal)]
        self._numbers = numbers
        self._taken = 0
        self._oldest = 0
        self._first_failure: tuple[int, Exception] | None = None
        self._kept: list[tuple[int, bytes]] = []
        self._early: dict[int, ReturnedRun] = {}

    @property
    def left(self) -> int:
        return self.total - self._taken

    def run(self, report: Progress | None) -> None:
        """Make all runs, or those for which there is time."""
        if self.first is not None:
            self._begin(self.first)
        elif self.store is not None and (key := self._key(self._numbers[0])) in self.store:
            self._begin(self._first_of(self.store, key))
        most = self.execution.max_seconds
        dispatch(self, self.execution.executor, 0, report, most)
        for number in self._numbers[self._taken :]:
            self.ends[number] = End(NOT_BEGUN, f"there was no time for it within {most:g} s")
        if self.store is not None and self._kept:
            if self.first is None:
                self._begin(self._first_of(self.store, self._kept[0][1]))
            for numbers, piece in self.store.read(self._kept):
                self._fill_kept(numbers, piece)
                if report is not None:
                    report(self.done, self.total)
        self._require_success()

    def failures(self) -> tuple[FailedRun, ...]:
        """The runs that failed."""
        return tuple(
            FailedRun.of(number, self.given[number], end)
            for number, end in enumerate(self.ends)
            if end.status != DONE
        )

    def take(self, count: int) -> Task | None:
        """The next runs that no store keeps, at most so many; None if there are no more."""
        if self.first is not None:
            count = min(count, max(1, _MOST_BYTES // max(1, self._bytes(self.first))))
        runs: list[int] = []
        while len(runs) < count and self._taken < self.total:
            number = self._numbers[self._taken]
            self._taken += 1
            if self.store is not None and (key := self._key(number)) in self.store:
                self._kept.append((number, key))
            else:
                runs.append(number)
        return self.again(runs) if runs else None

    def again(self, runs: Sequence[int]) -> Task:
        """Runs that must be made once more."""
        order = Calls(self.call, [self.given[number] for number in runs], self.execution.run_seconds)
        return Task(runs, order, None)

    @property
    def keeps(self) -> bool:
        return self.store is not None

    def keep(self, task: Task, piece: Piece) -> None:
        """Nothing: what a model returned is validated before it is stored."""

    def place(self, task: Task, answers: Answers) -> None:
        """Keep finished runs."""
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
        """Note runs whose worker ended whenever they were tried."""
        message = f"its worker was lost whenever it was tried: {error_text(error)}"
        for number in runs:
            lost = SimulationError(WORKER_LOST, 0.0, None, self.given[number], message)
            self._end(number, End(WORKER_LOST, message), lost)
        self.done += len(runs)

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
        self.table.begin(first)
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
                self._fail(number, _named(error, self.given[number]), MODEL)
        self._early = {}
        if self.store is not None and good:
            self.store.write([self._key(number) for number in good], _piece(first, list(good.values())))
        for number, run in good.items():
            self._fill(number, run)

    def _fill(self, number: int, run: ReturnedRun) -> None:
        try:
            self.table.fill(number, run)
        except Exception as error:
            self._fail(number, error, FEATURE)

    def _fill_kept(self, numbers: Sequence[int], piece: Piece) -> None:
        assert self.first is not None, "what is kept was read after it"
        for row, number in enumerate(numbers):
            self._fill(number, _run_of(piece, row, list(self.first.series), list(self.first.numbers)))
        self.done += len(numbers)

    def _first_of(self, store: Store, key: bytes) -> ReturnedRun:
        """A run that is kept, with the names that it was kept with."""
        series, numbers = store.names(key)
        store.name(series, numbers)
        ((_, piece),) = store.read([(0, key)])
        return _run_of(piece, 0, series, numbers)

    def _fail(self, number: int, error: Exception, where: str) -> None:
        if isinstance(error, TimeLimitError):
            error.add_note(f"in the model with {describe(self.given[number])}")
        self._end(number, end_of(error, where), error)

    def _end(self, number: int, end: End, error: Exception) -> None:
        """Note a run that failed; its error is kept if it may have to be raised."""
        if self.execution.on_failure == "raise" or number == self.nominal:
            raise error
        self.ends[number] = end
        if self._first_failure is None or number < self._first_failure[0]:
            self._first_failure = (number, error)

    def _require_success(self) -> None:
        failed = {number: end for number, end in enumerate(self.ends) if end.status not in (DONE, NOT_BEGUN)}
        nominal = -1 if self.nominal is None else self.nominal
        if run_to_raise(failed, self.total, nominal, self.execution) is not None:
            assert self._first_failure is not None, "a run failed"
            error = self._first_failure[1]
            if len(failed) > 1:
                error.add_note(f"{len(failed)} of {self.total} runs of the study failed")
            raise error_to_raise(error, failed, self.total, self.execution)

    def _key(self, number: int) -> bytes:
        text = json.dumps(dict(sorted(self.given[number].items())))
        return hashlib.sha256(text.encode()).digest()[:KEY_BYTES]

    @staticmethod
    def _bytes(run: ReturnedRun) -> int:
        return 8 * (len(run.t) * (1 + len(run.series)) + len(run.numbers))


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
