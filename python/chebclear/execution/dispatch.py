"""Sending pieces of a study to workers: their sizes, and the treatment of lost workers."""

from __future__ import annotations

import math
import os
import threading
import time
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from numpy.typing import NDArray

from ..base.progress import Progress
from ..errors import ChebclearError, error_text
from .limited import WAKE, Answers, Calls, call_order
from .memory import threads_started
from .options import ExecutionOptions
from .pieces import DONE, NOT_BEGUN, End, Order, Piece, simulate_order, start_worker
from .store import Store

# Duration of a piece [s]: long compared with sending it, which takes a few milliseconds, and short enough
# that little is lost with a worker and all stop soon after an interrupt. It grows to one part in 200 of the
# elapsed time of the study, so that a run over night has a few thousand pieces and not half a million.
_SECONDS_HERE, _SECONDS_SENT, _GROWTH, _MOST_SECONDS = 0.25, 1.0, 200.0, 10.0
# Pieces sent to each worker, so that none waits for the next one.
_QUEUED = 2
# Number of rounds in which the remaining runs are sent: pieces become smaller, so that all workers end
# together.
_PARTS = 3
# Longest wait for cancelled pieces to end [s]; they need a tenth of it.
_LAST_WAIT = 1.0
# Assumed number of workers of an executor if it is unknown.
_UNKNOWN_WORKERS = 16
# Number of times a piece is sent again after its worker was lost; the last time its runs are sent one by one.
_RESENT = 2
WORKER_LOST = "worker_lost"
"""Reason of a run whose worker ended in every attempt."""
# What executors raise when a worker ends before its piece does, besides `BrokenExecutor`.
_LOST = frozenset({"KilledWorker", "WorkerCrashedError", "CommClosedError", "WorkerLost", "NodeDiedError"})


class Source:
    """The runs of a study: pieces of them for workers, and where their results go.

    A class says what a piece is (`take`, `again`) and what becomes of it (`place`, `fill`).
    """

    def __init__(self, numbers: Sequence[int], store: Store | None) -> None:
        self._numbers = numbers
        self.store = store
        self.taken = 0
        """Runs that were sent or found in the store."""
        self._kept: list[tuple[int, bytes]] = []  # runs that the store has
        self.total = len(numbers)
        self._open = dict.fromkeys(numbers)  # runs that need more work, in their order
        self.ends = [End()] * self.total

    @property
    def done(self) -> int:
        """Runs that need no more work."""
        return self.total - len(self._open)

    def finish(self, numbers: Iterable[int]) -> None:
        """Note that runs need no more work."""
        for number in numbers:
            self._open.pop(number, None)

    def take(self, count: int) -> Task | None:
        """The next runs that no store keeps, at most so many; None if there are no more."""
        raise NotImplementedError

    def again(self, runs: Sequence[int]) -> Task:
        """Runs that must be made once more."""
        raise NotImplementedError

    def keep(self, task: Task, piece: Any) -> None:
        """Put finished runs into the store, on whatever thread; those of models are validated first."""

    def place(self, task: Task, piece: Any) -> None:
        """Keep finished runs: a `Piece` of an `Order`, or `Answers` to `Calls`."""
        raise NotImplementedError

    def lost(self, runs: Sequence[int], error: BaseException) -> None:
        """Record runs whose worker ended in every attempt."""
        end = End(WORKER_LOST, f"its worker was lost whenever it was tried: {error_text(error)}")
        for number in runs:
            self.end(number, end)
        self.finish(runs)

    def fill(self, numbers: Sequence[int], piece: Piece) -> None:
        """Take runs from the store."""
        raise NotImplementedError

    def end(self, number: int, end: End) -> None:
        """Record the end of a run without values."""
        self.ends[number] = end

    def failed(self) -> dict[int, End]:
        """The ends of the runs that failed, by their numbers."""
        return {number: end for number, end in enumerate(self.ends) if end.status != DONE}

    def failed_of_begun(self) -> dict[int, End]:
        """The ends of the runs that were begun and failed."""
        return {number: end for number, end in self.failed().items() if end.status != NOT_BEGUN}

    @property
    def begun(self) -> int:
        """Runs that were begun."""
        return self.total - sum(end.status == NOT_BEGUN for end in self.ends)

    def make(self, workers: Workers, report: Progress | None, how: ExecutionOptions) -> None:
        """Make all runs, or those for which there is time; `report` gets the runs done and in all.

        Exceptions of workers are raised, except for their loss; work in progress is then cancelled. So is an
        interrupt, unless enough runs are answered from: then all runs from the first on that is not finished
        count as not begun, so that which ones are left out does not depend on how long they take.
        """
        why = f"there was no time for it within {how.max_seconds} s"
        try:
            with workers.ready():
                _Dispatcher(self, workers, report, how.max_seconds).run()
        except KeyboardInterrupt as interrupt:
            # A subclass asks the whole program to end.
            if type(interrupt) is not KeyboardInterrupt or how.answers_from is None:
                raise
            if self._whole() < how.answers_from:
                raise
            why = "it was interrupted"
        left = dict.fromkeys(self._numbers[self._whole() :])
        self._kept = [(number, key) for number, key in self._kept if number not in left]
        for number in left:
            self.end(number, End(NOT_BEGUN, why))

    def _whole(self) -> int:
        """Runs before the first that is neither finished nor kept."""
        kept = {number for number, _ in self._kept}
        first = next((number for number in self._open if number not in kept), None)
        return self.total if first is None else self._numbers.index(first)

    def read_kept(self, report: Progress | None) -> None:
        """Take from the store the runs that it has."""
        if self.store is None:
            return
        for numbers, piece in self.store.read(self._kept):
            self.fill(numbers, piece)
            self.finish(numbers)
            if report is not None:
                report(self.done, self.total)


@dataclass
class Task:
    """Runs on their way to a worker."""

    runs: Sequence[int]
    """Their numbers."""
    order: Order | Calls
    """Order for the worker."""
    into: NDArray[Any] | None
    """Destination of the samples of a worker of this process."""
    losses: int = 0
    """Number of times its worker was lost."""
    kept: bool = False
    """Whether its runs are in the store."""
    finished: int = 0
    """Runs that the worker has finished, as far as it is known."""


class _Dispatcher:
    """Keeps workers busy until there is no more to do."""

    def __init__(
        self, source: Source, workers: Workers, report: Progress | None, max_seconds: float | None
    ) -> None:
        self.most = math.inf if max_seconds is None else max_seconds
        self.source = source
        self.workers = workers
        self.report = report
        self.pending: dict[Future[Any], Task] = {}
        self.suspects: deque[Task] = deque()
        self.begin = time.monotonic()
        self.seconds = 0.0
        self.runs = 0
        self.reported = -1

    def run(self) -> None:
        try:
            while self._fill() or self.pending:
                finished, _ = wait(self.pending, timeout=WAKE, return_when=FIRST_COMPLETED)
                for future in finished:
                    self._take(future, self.pending.pop(future))
                self._tell()
        except BaseException:
            self.workers.stop(self.pending)
            raise

    def _fill(self) -> bool:
        """Send pieces until every worker has enough; whether there was one to send."""
        sent = False
        while len(self.pending) < self.workers.count * (self.workers.queued if self.runs else 1):
            # A piece whose worker was lost goes alone, so that no other suffers from it once more.
            if self.suspects and self.pending:
                break
            # The first pieces are begun whatever the time: the nominal run is among them.
            if self.runs and time.monotonic() - self.begin >= self.most:
                break
            task = self.suspects.popleft() if self.suspects else self.source.take(self._size())
            if task is None:
                break
            self._send(task)
            sent = True
            if task.losses:
                break
        return sent

    def _send(self, task: Task) -> None:
        try:
            future = self.workers.submit(task)
        except BrokenExecutor as error:
            # All pieces under way have failed too; what they were is known when they are taken.
            self.workers.renew(error)
            future = self.workers.submit(task)
        self.pending[future] = task

    def _take(self, future: Future[Any], task: Task) -> None:
        # It is not raised here, so that only this process's own Ctrl-C ends the study as one.
        error = future.exception()
        if error is not None:
            lost = isinstance(error, BrokenExecutor) or type(error).__name__ in _LOST
            # What is no exception, such as an interrupt that came to a worker alone, ended the worker.
            if isinstance(error, Exception) and not lost:
                raise error
            self._lose(task, error)
            return
        piece = future.result()
        task.finished = 0
        self.seconds += piece.seconds
        self.runs += len(task.runs)
        self.source.place(task, piece)

    def _lose(self, task: Task, error: BaseException) -> None:
        """Send a piece again whose worker ended in the middle."""
        if isinstance(error, BrokenExecutor):
            self.workers.renew(error)
        losses = task.losses + 1
        if losses > _RESENT:
            if not self.runs:
                raise ChebclearError(
                    f"no worker has finished a run, each was lost before: {error}. Workers must import "
                    'what they are sent; a script that starts processes needs if __name__ == "__main__"'
                ) from error
            self.source.lost(task.runs, error)
            return
        parts = [task.runs] if losses < _RESENT else [[run] for run in task.runs]
        for runs in parts:
            again = self.source.again(runs)
            again.losses = losses
            self.suspects.append(again)

    def _size(self) -> int:
        """Runs of the next piece."""
        if not self.runs:
            return 1
        elapsed = time.monotonic() - self.begin
        wanted = min(max(self.workers.seconds, elapsed / _GROWTH), _MOST_SECONDS, self.most / _PARTS)
        size = int(wanted / max(self.seconds / self.runs, 1e-9))
        left = self.source.total - self.source.taken
        share = -(-left // (_PARTS * self.workers.count))
        return max(1, min(size, share))

    def _tell(self) -> None:
        done = self.source.done + sum(task.finished for task in self.pending.values())
        if self.report is not None and done != self.reported:
            self.report(min(done, self.source.total), self.source.total)
        self.reported = done


class Workers:
    """Where pieces are made."""

    count = 1
    """Pieces that are made at a time."""
    queued = 1
    """Pieces that a worker may have, once a run has been measured."""
    seconds = _SECONDS_HERE
    """Time that a piece should take [s]."""

    @contextmanager
    def ready(self) -> Iterator[None]:
        """While they may get work."""
        yield

    def submit(self, task: Task) -> Future[Any]:
        """Send a piece."""
        raise NotImplementedError

    def renew(self, error: BrokenExecutor) -> None:
        """Replace workers that take no more work."""
        raise error

    def stop(self, pending: Iterable[Future[Any]]) -> None:
        """Give up what is under way."""


class CallingThread(Workers):
    """The calling thread: a callable of the user's need not be safe on another one."""

    def submit(self, task: Task) -> Future[Any]:
        assert isinstance(task.order, Calls), "scenes are simulated on threads"
        future: Future[Answers] = Future()
        future.set_result(call_order(task.order, None))
        return future


class Threads(Workers):
    """Threads of this process, all processors if their number is None; the core needs no interpreter."""

    queued = _QUEUED

    def __init__(self, threads: int | None, source: Source) -> None:
        self.count = max(1, min(threads or os.cpu_count() or 1, source.total))
        self._source = source
        self._stop = threading.Event()
        self._pool = ThreadPoolExecutor(self.count, thread_name_prefix="chebclear")

    @contextmanager
    def ready(self) -> Iterator[None]:
        try:
            yield
        finally:
            self._pool.shutdown(wait=True, cancel_futures=True)

    def submit(self, task: Task) -> Future[Any]:
        def count(finished: int) -> None:
            task.finished = finished

        order = task.order
        assert not isinstance(order, Calls), "calls are made on the calling thread"

        def work() -> Piece:
            piece = simulate_order(order, self._stop, task.into, count)
            self._source.keep(task, piece)
            return piece

        with threads_started():
            return self._pool.submit(work)

    def stop(self, pending: Iterable[Future[Any]]) -> None:
        self._stop.set()


class ExecutorWorkers(Workers):
    """Workers of an executor."""

    seconds = _SECONDS_SENT

    def __init__(self, executor: Executor, source: Source) -> None:
        # With a store no worker begins a piece before its last one is safe.
        self.queued = _QUEUED if source.store is None else 1
        from concurrent.futures import ProcessPoolExecutor

        # Workers that a killed parent has just started may never get a task, and would wait for ever.
        if isinstance(executor, ProcessPoolExecutor) and not executor._processes:
            own = getattr(executor, "_initializer", None), getattr(executor, "_initargs", ())
            vars(executor).update(_initializer=start_worker, _initargs=own)
        self._executor = executor
        self._own: list[Executor] = []
        self._folder = TemporaryDirectory(prefix="chebclear-", ignore_cleanup_errors=True)
        self._stop = Path(self._folder.name, "stop")
        self.count = worker_count(executor)

    @contextmanager
    def ready(self) -> Iterator[None]:
        try:
            yield
        finally:
            for one in self._own:
                one.shutdown(wait=True, cancel_futures=True)
            if not self._stop.exists():
                self._folder.cleanup()

    def submit(self, task: Task) -> Future[Any]:
        if isinstance(task.order, Calls):
            return self._executor.submit(call_order, task.order, str(self._stop))
        return self._executor.submit(simulate_order, task.order, str(self._stop))

    def renew(self, error: BrokenExecutor) -> None:
        # A process pool is of no more use when it has lost a worker; any of the many pieces that fail with it
        # may be the first to tell.
        if not getattr(self._executor, "_broken", True):
            return
        make = getattr(self._executor, "_mp_context", None)
        if make is None:
            raise error
        from concurrent.futures import ProcessPoolExecutor

        self._executor = ProcessPoolExecutor(
            self.count,
            mp_context=make,
            initializer=getattr(self._executor, "_initializer", None),
            initargs=getattr(self._executor, "_initargs", ()),
        )
        self._own.append(self._executor)

    def stop(self, pending: Iterable[Future[Any]]) -> None:
        # Pieces that wait are taken back; those that have begun look for the file.
        self._stop.touch()
        begun = [future for future in pending if not future.cancel()]
        wait(begun, timeout=_LAST_WAIT)

        def clean(_: object = None) -> None:
            # The file stays until the last of them is over, however busy the machine is.
            if all(future.done() for future in begun):
                self._folder.cleanup()

        clean()
        for future in begun:
            future.add_done_callback(clean)


def worker_count(executor: Executor) -> int:
    """How many pieces an executor simulates at a time, as far as it is known."""
    for name in ("_max_workers", "num_workers"):
        count = getattr(executor, name, None)
        if isinstance(count, int) and count > 0:
            return count
    client = getattr(executor, "_client", None)
    threads = getattr(client, "nthreads", None)
    if callable(threads):  # Dask
        return max(1, int(sum(threads().values())))
    return _UNKNOWN_WORKERS
