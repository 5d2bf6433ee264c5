"""Execution of the runs of one study: remaining runs, those in a store, and the end of each."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..base.progress import Progress
from ..base.rows import Array
from ..errors import ChebclearError
from ..notices import Notice
from ..run.settings import Settings
from ..scene.structure import FlatScene
from .costs import STATS
from .dispatch import ExecutorWorkers, Source, Task, Threads
from .memory import Usage, release, sample_array
from .options import ExecutionOptions
from .pieces import BRANCH, DONE, NOT_BEGUN, End, Order, Piece, code_version
from .store import Store, run_key

# Notices of one run of `build` that keep their order before those of the simulation.
_MOST_BUILT = 1_000_000
# Largest size of the samples of a piece [bytes]; workers hold some pieces at a time.
_MOST_BYTES = 16_000_000


class Built(NamedTuple):
    """A scene that is to be simulated."""

    flat: FlatScene
    """Its structure and its numbers."""
    notices: tuple[Notice, ...] = ()
    """What was warned of when it was built."""


Build = Callable[[Sequence[int]], Sequence[Built | End]]
"""The scenes of some runs by their numbers, or how those ended before they began."""


class RefusedRunError(Exception):
    """A run with which the study makes no sense: its number and its end."""

    def __init__(self, number: int, end: End) -> None:
        super().__init__(end.message)
        self.number = number
        self.end = end


class Batch(Source):
    """The scenes of a study, and the table of their results.

    `build` makes the scenes of some runs, which are started in the order of their `numbers`; the settings
    name the outputs, and `usage` is what the result takes besides the samples. Raises MemoryLimitError or
    StoreError if the samples do not fit where `execution` wants them.
    """

    def __init__(
        self,
        build: Build,
        numbers: Sequence[int],
        settings: Settings,
        execution: ExecutionOptions,
        store: Store | None,
        usage: Usage,
    ) -> None:
        super().__init__(numbers, store)
        self._build = build
        self._settings = settings
        self._execution = execution
        self._keys: dict[int, bytes] = {}
        count, columns = len(numbers), len(settings.outputs or ())
        self.t: Array | None = None
        folder = None if execution.in_memory or store is None else store.path
        self.values = sample_array((count, settings.samples, columns), folder, usage)
        self.features = np.full((count, settings.cycles, len(settings.features)), np.nan)
        self.counts = np.zeros((count, len(STATS)))
        self.notices = GatheredNotices()

    def run(self, report: Progress | None) -> None:
        """Simulate the runs; raises `RefusedRunError` if they are of more than one branch."""
        executor, threads = self._execution.executor, self._execution.threads
        workers = Threads(threads, self) if executor is None else ExecutorWorkers(executor, self)
        self.make(workers, report, self._execution)
        self.notices.drop(number for number, end in enumerate(self.ends) if end.status == NOT_BEGUN)
        self.read_kept(report)

    def take(self, count: int) -> Task | None:
        runs: list[int] = []
        scenes: list[FlatScene] = []
        count = min(count, max(1, _MOST_BYTES // max(1, self.values[:1].nbytes)))
        while len(runs) < count and self.taken < self.total:
            numbers = self._numbers[self.taken : self.taken + count - len(runs)]
            self.taken += len(numbers)
            for number, built in zip(numbers, self._build(numbers), strict=True):
                if isinstance(built, End):
                    self.end(number, built)
                    self.finish([number])
                    continue
                if built.notices:
                    self.notices.add(number, built.notices)
                if self.store is not None:
                    key = run_key(built.flat, self._settings)
                    if key in self.store:
                        self._kept.append((number, key))
                        continue
                    self._keys[number] = key
                runs.append(number)
                scenes.append(built.flat)
        return self._task(runs, scenes) if runs else None

    def again(self, runs: Sequence[int]) -> Task:
        scenes = [built.flat for built in self._build(runs) if isinstance(built, Built)]
        assert len(scenes) == len(runs), "they were built before"
        return self._task(runs, scenes)

    def keep(self, task: Task, piece: Piece) -> None:
        if self.store is not None and not task.kept:
            self.store.write([self._keys.pop(number) for number in task.runs], piece)
            task.kept = True

    def place(self, task: Task, piece: Piece) -> None:
        if piece.code != code_version():
            raise ChebclearError(
                "a worker has another build of chebclear than this process, so that its results would not be "
                "the same bits: install the same one everywhere"
            )
        self.keep(task, piece)
        self.fill(task.runs, piece, placed=piece.values is task.into)
        self.finish(task.runs)

    def end(self, number: int, end: End) -> None:
        super().end(number, end)
        self._keys.pop(number, None)
        self.values[number] = np.nan

    def _task(self, runs: Sequence[int], scenes: Sequence[FlatScene]) -> Task:
        how = self._execution
        threads = 1 if how.executor is None else how.threads or 1
        order = Order(scenes, self._settings, threads, how.on_failure == "collect", how.run_seconds)
        following = runs[-1] - runs[0] + 1 == len(runs) and sorted(runs) == list(runs)
        return Task(runs, order, self.values[runs[0] : runs[-1] + 1] if following else None)

    def fill(self, numbers: Sequence[int], piece: Piece, placed: bool = False) -> None:
        rows = np.asarray(numbers)
        if not placed:
            for row, number in enumerate(numbers):
                self.values[number] = piece.values[row]
        self.features[rows] = piece.features
        self.counts[rows] = piece.counts
        for number, end, notices in zip(numbers, piece.ends, piece.notices, strict=True):
            if end.status == BRANCH:
                raise RefusedRunError(number, end)
            if end.status != DONE:
                self.end(number, end)
            if notices:
                self.notices.add(number, notices, after=_MOST_BUILT)
        if self.t is None and np.isfinite(piece.t).all():
            self.t = piece.t
        release(self.values)


def jammed(notices: Iterable[Notice]) -> str:
    """How many of the runs may be jammed, and where in the box, if that is known of a joint.

    Those of an extended study tell it of each part. Not if all runs are: that is no matter of the box.
    Then the stiffness may be too small.
    """
    parts = [one for one in notices if one.code == "deep_penetration" and "of_runs" in one.numbers]
    for about in dict.fromkeys(part.about for part in parts):
        of_joint = [part for part in parts if part.about == about]
        runs, count = (int(sum(part.numbers[name] for part in of_joint)) for name in ("runs", "of_runs"))
        if runs < count:
            place = of_joint[0].place if len(of_joint) == 1 else ""
            return f'{runs} of {count} runs may be jammed at joint "{about[0]}"{place}'
    return ""


class GatheredNotices:
    """Notices of runs, each kind once although its numbers may differ from run to run."""

    def __init__(self) -> None:
        self._first: dict[tuple[str, tuple[str, ...]], tuple[int, int, Notice]] = {}
        self._runs: dict[tuple[str, tuple[str, ...]], set[int]] = {}

    def add(self, number: int, notices: Sequence[Notice], after: int = 0) -> None:
        """Those of a run, after so many others."""
        for place, notice in enumerate(notices, start=after):
            kind = notice.code, notice.about
            if kind not in self._first or (number, place) < self._first[kind][:2]:
                self._first[kind] = (number, place, notice)
            self._runs.setdefault(kind, set()).add(number)

    def drop(self, numbers: Iterable[int]) -> None:
        """Forget some runs."""
        dropped = set(numbers)
        for runs in self._runs.values():
            runs -= dropped

    def kinds(self) -> Iterator[tuple[list[int], Notice]]:
        """Each kind once, in the order of the runs: the runs that have it, and the notice of the first."""
        for kind in sorted(filter(self._runs.get, self._first), key=lambda kind: self._first[kind][:2]):
            yield sorted(self._runs[kind]), self._first[kind][2]

    def of(self, runs: int, place: Callable[[Sequence[int]], str]) -> tuple[Notice, ...]:
        """Each kind once, as of so many runs and with the place of some."""
        found = []
        for numbers, notice in self.kinds():
            where = place(numbers)
            found.append(
                replace(
                    notice,
                    text=f"{notice.text} (in {len(numbers)} of {runs} runs{where})",
                    numbers={**notice.numbers, "runs": float(len(numbers)), "of_runs": float(runs)},
                    place=where,
                )
            )
        return tuple(found)
