"""Calls of the user's functions with a limit of time."""

from __future__ import annotations

import ctypes
import queue
import threading
from collections.abc import Callable
from typing import Any, TypeVar

Value = TypeVar("Value")


class TimeLimitError(Exception):
    """A function that took too long."""


class LimitedCalls:
    """Calls functions, each for a limited time only.

    With a limit they are called on a thread of their own, which is left behind when one does not return: a
    function that waits for ever can be abandoned but not ended. One that computes in Python is ended.

    Parameters
    ----------
    seconds : float or None
        The limit [s]; None calls directly.
    """

    def __init__(self, seconds: float | None) -> None:
        self._seconds = seconds
        self._worker: _Worker | None = None

    def __call__(self, function: Callable[..., Value], /, *arguments: Any, **keywords: Any) -> Value:
        """What the function returns or raises.

        Raises
        ------
        TimeLimitError
            If it takes longer.
        """
        if self._seconds is None:
            return function(*arguments, **keywords)
        if self._worker is None:
            self._worker = _Worker()
        self._worker.tasks.put(lambda: function(*arguments, **keywords))
        try:
            value, error = self._worker.results.get(timeout=self._seconds)
        except queue.Empty:
            self._worker.abandon()
            self._worker = None
            raise TimeLimitError(f"it was given up after {self._seconds:g} s") from None
        if error is not None:
            raise error
        return value  # type: ignore[no-any-return]

    def close(self) -> None:
        """End the thread."""
        if self._worker is not None:
            self._worker.tasks.put(None)
            self._worker = None


class _Worker:
    """A thread that calls one function after the other."""

    def __init__(self) -> None:
        self.tasks: queue.SimpleQueue[Callable[[], Any] | None] = queue.SimpleQueue()
        self.results: queue.SimpleQueue[tuple[Any, BaseException | None]] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._serve, name="chebclear-call", daemon=True)
        self._thread.start()

    def _serve(self) -> None:
        try:
            while (task := self.tasks.get()) is not None:
                try:
                    self.results.put((task(), None))
                except Exception as error:
                    self.results.put((None, error))
        except SystemExit:  # abandoned
            pass

    def abandon(self) -> None:
        """End what it computes as soon as it is in Python again."""
        self.tasks.put(None)
        identifier = self._thread.ident
        if identifier is not None:
            ctypes.pythonapi.PyThreadState_SetAsyncExc(
                ctypes.c_ulong(identifier), ctypes.py_object(SystemExit)
            )
