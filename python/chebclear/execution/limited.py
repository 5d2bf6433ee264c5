"""Calls of the user's functions, some by one worker, each with a limit of time."""

from __future__ import annotations

import ctypes
import faulthandler
import functools
import math
import multiprocessing
import os
import pickle
import queue
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, TypeVar

from ..base.units import unit
from ..errors import ChebclearError, error_text
from .memory import threads_started
from .pieces import still_wanted

Value = TypeVar("Value")

WAKE = 0.05
"""Interval at which waiting threads look for interrupts, limits of time and progress [s]."""
# A call that does not let other threads run is ended with its process after this many times its limit plus
# this time [s]: long enough for the usual cancellation to work first.
_TIMES, _BESIDES = 2.0, 1.0


class TimeLimitError(ChebclearError, TimeoutError):
    """A function that took too long."""


class CallError(ChebclearError, RuntimeError):
    """A call that ended in a way that cannot be raised or sent as it is, such as `sys.exit`, in words."""


class LimitedCalls:
    """Calls functions, each for a limited time only [s], as long as they are `wanted`.

    With one of both each is called on a thread of its own, which is abandoned when the call does not return:
    a function that waits forever cannot be ended. One that computes in Python is ended.
    """

    def __init__(self, seconds: float | None, wanted: Callable[[], bool] | None = None) -> None:
        self._seconds = seconds
        self._wanted = wanted

    def __call__(self, function: Callable[..., Value], /, *arguments: Any, **keywords: Any) -> Value:
        """What the function returns or raises.

        TimeLimitError if it takes longer, CancelledError if it is no longer wanted, CallError if it raises
        what is no `Exception`; but `KeyboardInterrupt` on the calling thread is the user's.
        """
        call = functools.partial(function, *arguments, **keywords)
        if self._seconds is None and self._wanted is None:
            try:
                return call()
            except (Exception, KeyboardInterrupt):
                raise
            except BaseException as ended:
                raise _ended(ended) from ended
        answers: queue.SimpleQueue[Any] = queue.SimpleQueue()

        def serve() -> None:
            # What is raised when the call was abandoned goes to a queue that nobody reads any more.
            try:
                answers.put((call(), None))
            except BaseException as error:
                answers.put((None, error if isinstance(error, Exception) else _ended(error)))

        thread = threading.Thread(target=serve, name="chebclear-call", daemon=True)
        with threads_started():
            thread.start()
        try:
            value, error = self._answer(answers)
        except BaseException:
            # It ends as soon as it is in Python again.
            identifier = ctypes.c_ulong(thread.ident or 0)
            ctypes.pythonapi.PyThreadState_SetAsyncExc(identifier, ctypes.py_object(SystemExit))
            raise
        if error is not None:
            raise error
        return value  # type: ignore[no-any-return]

    def _answer(self, answers: queue.SimpleQueue[Any]) -> Any:
        """Value and error of a call."""
        deadline = math.inf if self._seconds is None else time.monotonic() + self._seconds
        while True:
            left = deadline - time.monotonic()
            try:
                return answers.get(timeout=min(max(left, 0.0), WAKE))
            except queue.Empty:
                if self._wanted is not None and not self._wanted():
                    raise CancelledError("the study was interrupted") from None
                if left <= WAKE:
                    raise TimeLimitError(f"the run was given up after {self._seconds:g} s") from None


def _ended(error: BaseException) -> CallError:
    return CallError(f"it ended with {error_text(error)}")


@contextmanager
def ended_by_force(seconds: float | None) -> Iterator[None]:
    """End this process, if it is a worker, when the block takes far longer than a limit [s].

    A function that never lets other threads run, as compiled code may, can only be ended with its process.
    What starts it notices that the worker was lost.
    """
    if seconds is None or multiprocessing.parent_process() is None:
        yield
        return
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        faulthandler.dump_traceback_later(_TIMES * seconds + _BESIDES, exit=True, file=nowhere)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()


# Size of an error that is sent back as it is [bytes]; of a larger one only the beginning of its message.
_MOST_SENT = 100_000


@dataclass(frozen=True)
class Calls:
    """Calls for a worker."""

    call: Callable[[Mapping[str, float]], Any]
    """Function of the parameters of a run that returns its result."""
    parameters: Sequence[Mapping[str, float]]
    """Parameters of each run by name."""
    run_seconds: float | None = field(metadata=unit("s"))
    """Time limit of a call [s]."""


@dataclass(frozen=True)
class Answers:
    """Results of some calls."""

    values: tuple[Any, ...]
    """Value of each call; None where it raised."""
    errors: tuple[Exception | None, ...]
    """Exception of each call, if it raised."""
    seconds: float = field(metadata=unit("s"))
    """Time they took [s]."""


def call_order(order: Calls, stop: str | None) -> Answers:
    """Make the calls that were ordered, wherever an executor has sent them.

    CancelledError is raised once a file of the name `stop` says that they are no longer wanted; None calls
    on the calling thread, which gets interrupts itself.
    """
    begin = time.perf_counter()
    values: list[Any] = []
    errors: list[Exception | None] = []
    wanted = None if stop is None else still_wanted(stop)
    limited = LimitedCalls(order.run_seconds, wanted)
    for parameters in order.parameters:
        value, error = None, None
        try:
            with ended_by_force(order.run_seconds):
                value = limited(order.call, parameters)
        except Exception as raised:
            if isinstance(raised, CancelledError) and wanted is not None and not wanted():
                raise
            error = raised if stop is None else _portable(raised)
        values.append(value)
        errors.append(error)
    return Answers(tuple(values), tuple(errors), time.perf_counter() - begin)


def _portable(error: Exception) -> Exception:
    """An error that can be sent back; one that cannot would lose the whole piece."""
    try:
        sent = pickle.dumps(error)
        if len(sent) <= _MOST_SENT:
            pickle.loads(sent)
            return error
    except BaseException:  # an error is code of the user's too
        pass
    return CallError(error_text(error))
