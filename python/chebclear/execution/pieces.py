"""A piece of a study: some of its runs, made by one worker, wherever that is."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import multiprocessing
import os
import re
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..base.rows import Array
from ..base.units import unit
from ..errors import InputError, Problem, SettingsError
from ..notices import Notice, as_plain
from ..run.settings import Settings
from ..scene.structure import FlatScene
from .costs import STATS

if TYPE_CHECKING:
    from .._core import _Runs


DONE = "done"
SCENE, SETTINGS = "scene", "settings"
"""Why a run failed that the core did not begin: there is no such mechanism, or the settings do not fit it."""
BRANCH = "branch"
"""Why a run is refused, and with it the study: its loops are closed on another side than elsewhere."""
NOT_FINITE, TIME_LIMIT, NOT_BEGUN = "not_finite", "time_limit", "not_begun"
"""Why a run failed that has outputs without a value, that took too long, or for which there was no time."""

# What a tighter tolerance may help with. The other ends are limits of the user's, who set them.
_RETRIED = frozenset({"step_underflow", "non_finite", "singular_mechanism", "event_location", "projection"})
# By what a failed run is repeated more tightly.
_TIGHTER = 10.0


@dataclass(frozen=True)
class End:
    """How a run ended."""

    status: str = DONE
    """``"done"``, or the word for why it failed."""
    message: str = ""
    """What happened in words."""
    time: float = field(default=0.0, metadata=unit("s"))
    """Where it ended [s]."""
    joint: str | None = None
    """Name of the joint at fault, if it is known to be one."""
    problems: tuple[Problem, ...] = ()
    """What is wrong with its scene."""


@dataclass(frozen=True)
class Order:
    """Scenes for a worker to simulate."""

    scenes: Sequence[FlatScene]
    """Structure and numbers of each scene."""
    settings: Settings
    """How; the outputs are given by name."""
    threads: int
    """Threads to simulate on [-]."""
    retried: bool
    """Whether runs that fail are repeated once with tighter tolerances."""
    run_seconds: float | None = field(metadata=unit("s"))
    """Time after which a run is given up [s]."""


@dataclass(frozen=True)
class Piece:
    """Some finished runs; arrays have a row for each."""

    t: Array = field(metadata=unit("s"))
    """Instants [s], shape (samples,)."""
    values: Array
    """Outputs in their units, shape (runs, samples, outputs); NaN after a run failed."""
    features: Array
    """Shape (runs, cycles, features)."""
    counts: Array
    """What each run cost, shape (runs, counts), in the order of `STATS`."""
    ends: tuple[End, ...]
    """How each run ended."""
    notices: tuple[tuple[Notice, ...], ...]
    """What should be checked of each run."""
    code: str
    """Fingerprint of the code that computed them."""
    seconds: float = field(metadata=unit("s"))
    """Time they took [s]."""


@functools.cache
def code_version() -> str:
    """Fingerprint of the numerical core: another one may compute other bits."""
    with Path(_core.__file__).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()[:16]


def simulate_order(
    order: Order,
    stop: str | threading.Event,
    into: Array | None = None,
    count: Callable[[int], None] | None = None,
) -> Piece:
    """Simulate what was ordered, wherever an executor has sent it.

    `stop` is as of `still_wanted`; the outputs go `into` an array of shape (runs, samples, outputs), and
    `count` gets the number of finished runs now and then. Raises InputError if the settings are wrong
    (what is wrong with a scene is in the end of its run), CancelledError if the runs are no longer wanted.
    """
    begin = time.perf_counter()
    wanted = still_wanted(stop)

    def go_on(done: int, total: int) -> None:
        if not wanted():
            raise CancelledError("the study was interrupted")
        if count is not None:
            count(done)

    settings = order.settings
    shape = (len(order.scenes), settings.samples, len(settings.outputs or ()))
    values = np.empty(shape) if into is None else into
    runs = _Rows(order, values, go_on)
    runs.simulate(range(len(order.scenes)), settings, values)
    failed = [row for row, end in enumerate(runs.ends) if end.status in _RETRIED]
    if order.retried and failed:
        again = np.empty((len(failed), *shape[1:]))
        before = [runs.ends[row].status for row in failed]
        runs.simulate(failed, settings.tightened(_TIGHTER), again)
        values[failed] = again
        for row, status in zip(failed, before, strict=True):
            text = f"the run failed ({status}) and was repeated with tolerances {_TIGHTER:g} times as tight"
            runs.notices[row] = (Notice("repeated", text, (status,)), *runs.notices[row])
    return Piece(
        t=runs.t,
        values=values,
        features=runs.features,
        counts=runs.counts,
        ends=tuple(runs.ends),
        notices=tuple(runs.notices),
        code=code_version(),
        seconds=time.perf_counter() - begin,
    )


class _Rows:
    """The rows of a piece while they are made."""

    def __init__(self, order: Order, values: Array, go_on: Callable[[int, int], None]) -> None:
        runs, settings = len(order.scenes), order.settings
        self.order = order
        self.go_on = go_on
        self.t = np.full(settings.samples, np.nan)
        self.features = np.full((runs, settings.cycles, len(settings.features)), np.nan)
        self.counts = np.zeros((runs, len(STATS)))
        self.ends = [End()] * runs
        self.notices: list[tuple[Notice, ...]] = [()] * runs

    def simulate(self, rows: Sequence[int], settings: Settings, values: Array) -> None:
        """Simulate some rows into `values`, which has a row for each of them."""
        good = list(range(len(rows)))
        while good:
            try:
                runs = self._sweep([self.order.scenes[rows[index]] for index in good], settings, values, good)
                break
            except InputError as error:
                # The core refuses all scenes together; the others are simulated without the wrong ones.
                wrong = _by_scene(error)
                for position, problems in wrong.items():
                    text = "; ".join(map(str, problems))
                    status = SETTINGS if isinstance(error, SettingsError) else SCENE
                    if any(problem.path == BRANCH for problem in problems):
                        status = BRANCH
                    self.ends[rows[good[position]]] = End(status, text, problems=tuple(problems))
                    values[good[position]] = np.nan
                good = [index for position, index in enumerate(good) if position not in wrong]
        else:
            return
        self.t = runs["t"]
        made = [rows[index] for index in good]
        self.features[made] = runs["features"]
        for column, name in enumerate(STATS):
            self.counts[made, column] = runs["stats"][name]
        done = End()
        for row in made:
            self.ends[row], self.notices[row] = done, ()
        for position, plain in runs["notices"].items():
            self.notices[made[position]] = Notice.of_core(plain)
        finite = np.all(np.isfinite(values if len(good) == len(values) else values[good]), axis=1)
        for position in np.flatnonzero(~np.all(finite, axis=1)).tolist():
            columns = np.flatnonzero(~finite[position]).tolist()
            names = ", ".join((settings.outputs or ())[column] for column in columns)
            when = settings.skip + settings.duration
            self.ends[made[position]] = End(NOT_FINITE, f"{names}: not finite in every sample", when)
        for position, (status, message, when, joint) in runs["ends"].items():
            if status == "cancelled":
                message = f"the run was given up after {self.order.run_seconds:g} s, at t = {when:.9g} s"
                status, joint = TIME_LIMIT, None
            self.ends[made[position]] = End(status, message, when, joint)

    def _sweep(self, scenes: list[FlatScene], settings: Settings, values: Array, good: list[int]) -> _Runs:
        whole = len(good) == len(values)
        place = values if whole else np.empty((len(good), *values.shape[1:]))
        runs = _core.sweep(
            scenes,
            settings.to_json(),
            self.order.threads,
            self.go_on,
            place.reshape(-1) if place.size else None,
            self.order.run_seconds,
        )
        if not whole:
            values[good] = place
        return runs


# The core says which scene of a sweep has a problem by this start of the path; a problem of the settings
# belongs to none.
_SCENE_PATH = re.compile(r"^scenes\[(\d+)\]\.?")


def _by_scene(error: InputError) -> dict[int, list[Problem]]:
    """The problems of each wrong scene; raises those of no scene."""
    found: dict[int, list[Problem]] = {}
    general = []
    for problem in error.problems:
        match = _SCENE_PATH.match(problem.path)
        if match is None:
            general.append(problem)
        else:
            path = _SCENE_PATH.sub("", problem.path)
            found.setdefault(int(match[1]), []).append(Problem(path, problem.message))
    if general or not found:
        raise type(error)(general or error.problems) from None
    return found


def still_wanted(stop: str | threading.Event) -> Callable[[], bool]:
    """Whether runs are still wanted: until an event, or until a file of this name appears for a worker
    elsewhere, which ends with its parent; on another machine it never does."""
    if not isinstance(stop, str):
        return lambda: not stop.is_set()
    end_with_parent()
    return lambda: not os.path.exists(stop)


@functools.cache
def end_with_parent() -> None:
    """Let this worker end when the process that started it has been killed.

    Workers of a process pool wait for their next task on a pipe that they hold open themselves, so they would
    wait for ever.
    """
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, name="chebclear-parent", daemon=True).start()


def start_worker(own: Callable[..., object] | None, arguments: tuple[Any, ...]) -> None:
    """Begin a worker of a process pool: it ends with its parent, even before its first task."""
    end_with_parent()
    if own is not None:
        own(*arguments)


def as_text(ends: Sequence[End], notices: Sequence[Sequence[Notice]]) -> str:
    """Ends that are not ``"done"`` and notices of runs that have some, by their row, as JSON."""
    plain: dict[str, Any] = {
        "ends": {str(row): dataclasses.astuple(end) for row, end in enumerate(ends) if end != End()},
        "notices": {str(row): as_plain(told) for row, told in enumerate(notices) if told},
    }
    return json.dumps(plain)


def from_text(text: str, runs: int) -> tuple[tuple[End, ...], tuple[tuple[Notice, ...], ...]]:
    """What `as_text` wrote, for so many rows."""
    plain = json.loads(text)
    ends, notices = [End()] * runs, [()] * runs  # type: list[End], list[tuple[Notice, ...]]
    for row, (status, message, when, joint, problems) in plain["ends"].items():
        found = tuple(Problem(str(path), str(problem)) for path, problem in problems)
        ends[int(row)] = End(str(status), str(message), float(when), joint, found)
    for row, told in plain["notices"].items():
        notices[int(row)] = Notice.from_plain(told)
    return tuple(ends), tuple(notices)
