"""Failed runs of a study: their description, and the limit of their number."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ..base.files import ArrayRecord
from ..base.named import ReadOnlyDict
from ..base.rows import Array
from ..base.units import unit
from ..errors import ChebclearError, Problem, SceneError, cut, describe, error_text
from ..notices import Notice
from .limited import CallError, TimeLimitError
from .options import ExecutionOptions
from .pieces import NOT_BEGUN, NOT_FINITE, SCENE, TIME_LIMIT, End

BUILD, MODEL, FEATURE = "build", "model", "feature"
"""Reasons of runs that failed in a callable of the user."""

FAILED, STOPPED = "failed", "stopped"
"""Codes of the notices of runs that failed and of runs for which there was no time."""
# Most parameters by which runs are set apart from others.
_MOST_NAMED = 2


class NotFiniteError(ChebclearError, ValueError):
    """A user's model returned values that are not finite."""


class AllFailedError(Exception):
    """All runs failed though all may; `first` is the error of the first one."""

    def __init__(self, first: Exception) -> None:
        super().__init__(str(first))
        self.first = first


@dataclass(frozen=True, eq=False)
class FailedRun(ArrayRecord):
    """A run of a study that gave no result, repeated with tighter tolerances where those may help.

    Attributes
    ----------
    index : int
        Its place among the runs that the study asked for, from 0 [-].
    parameters : Mapping[str, float]
        Its parameters [SI units].
    reason : str
        The status word of the run, such as ``"step_underflow"``; ``"build"``, ``"model"`` or ``"feature"`` if
        a callable of the user's raised or returned something wrong, ``"scene"`` if there is no such
        mechanism, ``"settings"`` if they do not fit it, ``"not_finite"`` if an output has no value,
        ``"time_limit"`` if it took too long, ``"worker_lost"`` if its worker ended in every attempt,
        ``"not_begun"`` if there was no time.
    message : str
        What happened in words.
    time : float
        Time at which it ended [s].
    joint : str | None
        Name of the clearance joint at fault, if it is known to be one.
    """

    index: int
    parameters: Mapping[str, float]
    reason: str
    message: str
    time: float = field(default=0.0, metadata=unit("s"))
    joint: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", ReadOnlyDict(self.parameters))

    def __repr__(self) -> str:
        return f"<FailedRun {self.index}: {self.reason} with {describe(self.parameters)}>"

    def __str__(self) -> str:
        return f"run {self.index} with {describe(self.parameters)}: {self.reason}: {self.message}"

    @classmethod
    def of(cls, index: int, parameters: Mapping[str, float], end: End) -> FailedRun:
        """The run of a number that ended so."""
        return cls(index, dict(parameters), end.status, end.message, end.time, end.joint)


def end_of(error: Exception, where: str) -> End:
    """The end of a run for which a call of a user's function failed."""
    if isinstance(error, TimeLimitError):
        return End(TIME_LIMIT, f"{where}: {error}")
    if isinstance(error, SceneError):
        return End(SCENE, cut(str(error).replace("\n", "; ")))
    if isinstance(error, NotFiniteError):
        return End(NOT_FINITE, cut(str(error).replace("\n", "; ")))
    return End(where, str(error) if isinstance(error, CallError) else error_text(error))


def require_success(
    failed: Mapping[int, End],
    runs: int,
    nominal: int | None,
    execution: ExecutionOptions,
    error_of: Callable[[int], Exception],
) -> None:
    """Raise the error of the nominal run if it is among those that were begun and failed, or of the first of
    them if most of so many runs did or any must; `AllFailedError` if all may fail and did."""
    must, most = execution.on_failure == "raise", execution.most_failed
    if not failed or not (must or nominal in failed or len(failed) > most * runs or len(failed) == runs):
        return
    error = error_of(min(failed) if must or nominal is None or nominal not in failed else nominal)
    raise error if must or most < 1.0 or len(failed) < runs else AllFailedError(error)


def failure_notices(failures: Sequence[FailedRun], runs: int) -> tuple[Notice, ...]:
    """Notices of failed runs, with the codes `FAILED` and `STOPPED`."""
    found: list[Notice] = []
    failed = [one for one in failures if one.reason != NOT_BEGUN]
    if failed:
        reasons = Counter(one.reason for one in failed)
        kinds = ", ".join(f"{count} {reason}" for reason, count in sorted(reasons.items()))
        text = (
            f"failed: {len(failed)} of {runs} runs have no result ({kinds}); they count as outside of "
            f"requirements and take no other part; the first is {failed[0]}"
        )
        found.append(Notice(FAILED, text, numbers={"runs": len(failed), "of_runs": runs}))
    left = [one for one in failures if one.reason == NOT_BEGUN]
    if left:
        text = (
            f"stopped: {len(left)} of {runs} runs were not made: {left[0].message}; with a store the same "
            "study simulates only these"
        )
        found.append(Notice(STOPPED, text, numbers={"runs": len(left), "of_runs": runs}))
    return tuple(found)


def count_failed(failures: Sequence[FailedRun]) -> int:
    """Runs that were begun and failed."""
    return sum(one.reason != NOT_BEGUN for one in failures)


def set_apart(names: Sequence[str], these: Array, others: Array) -> str:
    """Where in the box some runs are, in words that follow a count of them.

    The range of a parameter is named if more than half of the other runs are outside of it; of more than two
    such parameters, those with the most outside. Both arrays have a row for each run.
    """
    if not len(these) or not len(others):
        return ""
    lower, upper = these.min(axis=0), these.max(axis=0)
    outside = ((others < lower) | (others > upper)).mean(axis=0)
    order = np.argsort(-outside, kind="stable")[:_MOST_NAMED]
    ranges = [
        f"{names[k]} = {lower[k]:.4g}"
        if lower[k] == upper[k]
        else f"{names[k]} from {lower[k]:.4g} to {upper[k]:.4g}"
        for k in order
        if outside[k] > 0.5
    ]
    return f", with {' and '.join(ranges)}" if ranges else ""


def located(parameters: Mapping[str, float], problems: Sequence[Problem]) -> list[Problem]:
    """Problems of the scene that was built with these parameters."""
    return [Problem(f"scene with {describe(parameters)}: {path}", message) for path, message in problems]
