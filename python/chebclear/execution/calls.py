"""A piece of a study of a user's model: some of its calls, made by one worker."""

from __future__ import annotations

import pickle
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass, field
from typing import Any

from ..base.units import unit
from ..errors import error_text
from .limited import CallError, LimitedCalls, ended_by_force
from .pieces import still_wanted

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
    try:
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
    finally:
        limited.close()
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
