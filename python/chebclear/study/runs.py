"""The runs of a study: many scenes simulated, here or by an executor, and what went wrong with which."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import CancelledError, Executor, wait
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..base.units import unit
from ..errors import InputError, Problem, SceneError, SimulationError, describe
from ..run.settings import Settings
from ..run.trajectory import Stats
from ..scene.scene import Interval, Scene

if TYPE_CHECKING:
    from .._core import _Runs

Progress = Callable[[int, int], None]

MOST_NODES = 10_000
"""Nodes or points of one parameter [-]."""
MOST_RUNS = 1_000_000
"""Runs of a study [-]."""

# Pieces an executor gets at most: enough to keep a few dozen workers busy to the end, few enough that sending
# them costs little beside the runs.
_CHUNKS = 64
# Longest time that is waited for pieces to end that are no longer wanted [s]: they need a tenth of it.
_LAST_WAIT = 1.0


@dataclass(frozen=True)
class Runs:
    """Runs of a study that all succeeded, the nominal one last."""

    t: NDArray[np.float64] = field(metadata=unit("s"))
    """Instants [s], shape (samples,)."""
    outputs: tuple[str, ...]
    """Names of the outputs."""
    values: NDArray[np.float64]
    """All outputs of all runs in their units, shape (runs + 1, samples, outputs)."""
    scenes: list[Scene]
    """What was simulated."""
    stats: tuple[Stats, ...]
    """What each run cost."""
    warnings: tuple[str, ...]
    """What the user should be warned of, each text once."""
    settings: Settings | None
    """How the runs were simulated; None if they were not."""
    features: NDArray[np.float64] | None
    """Features of all runs, shape (runs + 1, cycles, features); None if there are none."""
    feature_names: tuple[str, ...]
    """Names of the features."""
    seconds: float = field(default=math.nan, metadata=unit("s"))
    """Time they took [s]."""
    nominal_parameters: NDArray[np.float64] | None = None
    """Parameters of the run that stands for the nominal one, shape (parameters,); None at the midpoint."""

    @property
    def facts(self) -> dict[str, Any]:
        """What a `StudyResult` says of its runs besides their values."""
        return {
            "stats": self.stats,
            "warnings": self.warnings,
            "settings": self.settings,
            "scene": self.scenes[-1] if self.scenes else None,
            "nominal_parameters": self.nominal_parameters,
            "seconds": self.seconds,
        }


def simulate_all(
    texts: list[str], settings: str, threads: int | None, executor: Executor | None, report: Progress | None
) -> _Runs:
    """Simulate scenes, in their order.

    Parameters
    ----------
    texts : list of str
        Scenes as JSON text.
    settings : str
        Settings as JSON text.
    threads : int or None
        Threads to simulate on [-]; all processors if None, one for each piece given to an executor.
    executor : concurrent.futures.Executor or None
        Where to simulate; on threads of this process if None.
    report : callable or None
        Gets the runs done and the runs in all.

    Raises
    ------
    SceneError, SettingsError
        If a scene is wrong, or the settings for it; paths begin with ``scenes[index]``.
    """
    if executor is None:
        return _core.sweep(texts, settings, threads, report)
    size = -(-len(texts) // _CHUNKS)
    chunks = [texts[start : start + size] for start in range(0, len(texts), size)]
    parts: list[_Runs] = []
    with TemporaryDirectory(prefix="chebclear-", ignore_cleanup_errors=True) as folder:
        stop = Path(folder, "stop")
        futures = [
            executor.submit(simulate_chunk, chunk, settings, threads or 1, str(stop)) for chunk in chunks
        ]
        try:
            for index, future in enumerate(futures):
                try:
                    parts.append(future.result())
                except InputError as error:
                    raise _shifted(error, index * size) from None
                _require_columns(parts[0]["columns"], parts[-1]["columns"], index * size)
                if report is not None:
                    report(min((index + 1) * size, len(texts)), len(texts))
        except BaseException:
            # Pieces that wait are taken back; those that have begun look for the file.
            stop.touch()
            wait([future for future in futures if not future.cancel()], timeout=_LAST_WAIT)
            raise
    return _joined(parts)


def simulate_chunk(scenes: list[str], settings: str, threads: int, stop: str) -> _Runs:
    """Simulate some of the scenes of a study, wherever an executor has sent them.

    Parameters
    ----------
    scenes : list of str
        Scenes as JSON text.
    settings : str
        Settings as JSON text.
    threads : int
        Threads to simulate on [-].
    stop : str
        Path of a file that appears when the runs are no longer wanted; on another machine it never does.
    """

    def go_on(done: int, total: int) -> None:
        if os.path.exists(stop):
            raise CancelledError("the study was interrupted")

    return _core.sweep(scenes, settings, threads, go_on)


def scene_text(scene: Scene, parameters: Mapping[str, float]) -> str:
    """A scene as the core reads it; a SceneError names the parameters it was built with."""
    try:
        return scene.to_json()
    except SceneError as error:
        raise SceneError(located(parameters, error.problems)) from None


def located(parameters: Mapping[str, float], problems: Iterable[Problem]) -> list[Problem]:
    """Problems of the scene that was built with these parameters."""
    return [Problem(f"scene with {describe(parameters)}: {path}", message) for path, message in problems]


# The core says which scene of a sweep has a problem by this start of the path; a problem of the settings
# belongs to none.
_SCENE_PATH = re.compile(r"^scenes\[(\d+)\]\.?")


def _scene_index(problem: Problem) -> int | None:
    found = _SCENE_PATH.match(problem.path)
    return int(found[1]) if found else None


def _shifted(error: InputError, offset: int) -> InputError:
    """The error of a chunk of scenes, with the numbers the scenes have in the study."""
    return type(error)(
        (_SCENE_PATH.sub(lambda found: f"scenes[{int(found[1]) + offset}].", problem.path), problem.message)
        for problem in error.problems
    )


def with_parameters(error: InputError, given: Sequence[Mapping[str, float]]) -> InputError:
    """The problems of no scene and of the first wrong one, with its parameters; others mostly repeat them."""
    indices = [_scene_index(problem) for problem in error.problems]
    problems = [problem for problem, index in zip(error.problems, indices, strict=True) if index is None]
    wrong = sorted({index for index in indices if index is not None})
    if not wrong:
        return type(error)(problems)
    first = [
        Problem(_SCENE_PATH.sub("", problem.path), problem.message)
        for problem, index in zip(error.problems, indices, strict=True)
        if index == wrong[0]
    ]
    problems += located(given[wrong[0]], first)
    if len(wrong) > 1:
        problems.append(Problem("study", f"{len(wrong) - 1} more of {len(given)} scenes have problems"))
    return type(error)(problems)


def require_ends(
    intervals: Mapping[str, Interval],
    points: NDArray[np.float64],
    build: Callable[[list[dict[str, float]]], list[Scene]],
) -> None:
    """Raise if there is no mechanism at an end of an interval: bounds are those of the whole interval.

    Chebyshev roots lie inside, and would not notice a length that reaches down to zero.
    """
    midpoint = {name: side.midpoint for name, side in intervals.items()}
    for index, (name, side) in enumerate(intervals.items()):
        for end in (side.lower, side.upper):
            if end in points[:, index]:
                continue
            at_end = midpoint | {name: end}
            try:
                scene = build([at_end])[0]
                try:
                    scene.check()
                except SceneError as error:
                    raise SceneError(located(at_end, error.problems)) from None
            except SceneError as error:
                reason = f'the interval of "{name}" reaches to {end!r}, where there is no such mechanism: '
                reason += "bounds are those of the whole interval"
                raise SceneError([*error.problems, Problem(f"parameters.{name}", reason)]) from None


def require_success(runs: _Runs, given: Sequence[Mapping[str, float]]) -> None:
    """Raise for the first run that failed, if any: a grid with a hole gives no bounds."""
    failed = [index for index, status in enumerate(runs["status"]) if status != "done"]
    if not failed:
        return
    first = failed[0]
    raise SimulationError(
        runs["status"][first],
        runs["time"][first],
        runs["joint"][first],
        given[first],
        f"{runs['message'][first]} ({len(failed)} of {len(given)} runs of the study failed)",
    )


# A name in quotes, a path or a word with digits, which tell warnings apart; or a number, which does not.
_KEPT_OR_NUMBER = re.compile(
    r'"(?:[^"\\]|\\.)*"|[A-Za-z_][\w.\[\]]*|(?P<number>[+-]?\d+(\.\d+)?(e[+-]?\d+)?)'
)


def _without_number(found: re.Match[str]) -> str:
    return "#" if found["number"] else found[0]


def gathered_warnings(runs: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Each warning once, although its numbers may differ from run to run."""
    first: dict[str, str] = {}
    count: dict[str, int] = {}
    for messages in runs:
        kinds: dict[str, str] = {}
        for message in messages:
            kinds.setdefault(_KEPT_OR_NUMBER.sub(_without_number, message), message)
        for kind, message in kinds.items():
            first.setdefault(kind, message)
            count[kind] = count.get(kind, 0) + 1
    return tuple(f"{message} (in {count[kind]} of {len(runs)} runs)" for kind, message in first.items())


def _require_columns(first: Sequence[str], other: Sequence[str], index: int) -> None:
    """As the core does within one piece."""
    if list(first) == list(other):
        return
    lacking = [name for name in first if name not in other] or [name for name in other if name not in first]
    message = f'differ from those of the first scene by "{lacking[0]}": all scenes of a study need the same '
    message += "parts, or outputs that they share"
    raise SceneError([(f"scenes[{index}].outputs", message)])


def _joined(parts: Sequence[_Runs]) -> _Runs:
    """The runs of several sweeps as those of one."""
    return {
        "t": parts[0]["t"],
        "values": np.concatenate([part["values"] for part in parts]),
        "columns": parts[0]["columns"],
        "features": np.concatenate([part["features"] for part in parts]),
        "status": [status for part in parts for status in part["status"]],
        "message": [message for part in parts for message in part["message"]],
        "time": [time for part in parts for time in part["time"]],
        "joint": [joint for part in parts for joint in part["joint"]],
        "stats": [stats for part in parts for stats in part["stats"]],
        "warnings": [messages for part in parts for messages in part["warnings"]],
    }
