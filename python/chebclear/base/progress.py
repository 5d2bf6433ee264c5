"""Progress reports: a bar of tqdm at a terminal and in a notebook, plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

Report = Callable[[float, float], None]
"""Function of the work done and the total work, in the same unit."""

Progress = Callable[[int, int], None]
"""Function of the number of runs done and of all runs, which users may pass as ``progress=`` to studies."""

# What tqdm fills in: before the first report; where something is counted; where the part done is known.
_BEFORE = "{desc}: started"
_TIMES = "{elapsed} passed, {remaining} left"
_COUNTED = "{desc}: {percentage:3.0f}% |{bar}| {n:.0f}/{total:.0f} {unit}, " + _TIMES
_SHARE = "{desc}: {percentage:3.0f}% |{bar}| " + _TIMES

PAUSE = 10.0
"""Time between two lines of a log [s]; shorter work writes none."""
# From this time on [s] the part that is done tells how long all of it takes: workers have begun.
_FIRST = 0.5


def is_request(progress: object) -> bool:
    """Whether this is a value that ``progress=`` accepts."""
    return progress is None or isinstance(progress, bool) or callable(progress)


def _in_notebook() -> bool:
    """Whether a kernel of notebooks runs here; that its package was imported says nothing, widgets do it."""
    kernels = sys.modules.get("ipykernel.kernelapp")
    return kernels is not None and bool(kernels.IPKernelApp.initialized())


def _is_long(elapsed: float, done: float, total: float) -> bool:
    """Whether work is known to take longer than `PAUSE`."""
    return elapsed >= _FIRST and 0.0 < done <= total and elapsed * total > PAUSE * done


@contextmanager
def bar(label: str, unit: str, *, always: bool = True) -> Iterator[Report]:
    """Show progress while the block runs: as a bar, from the start or once the work is known to take long; as
    lines where standard error is not a terminal."""
    if not (sys.stderr.isatty() or _in_notebook()):
        yield _Lines(label, unit)
        return
    from tqdm.auto import tqdm  # here only: it costs 20 ms, and few ask for it

    start = time.monotonic()
    with ExitStack() as closing:

        def begin() -> tqdm[Any]:
            own = tqdm(desc=label, total=1.0, unit=unit, file=sys.stderr, bar_format=_BEFORE)
            return closing.enter_context(own)

        shown = begin() if always else None

        def report(done: float, total: float) -> None:
            nonlocal shown
            if shown is None:
                if not _is_long(time.monotonic() - start, done, total):
                    return
                shown = begin()
            shown.total, shown.bar_format = total, _SHARE if total == 1.0 else _COUNTED
            shown.update(done - shown.n)

        yield report


@contextmanager
def reporter(
    progress: bool | Progress | None, label: str, unit: str = "runs", *, long: bool = False
) -> Iterator[Progress | None]:
    """The function to call with the runs done and all runs while the block runs, or None; without a request
    for progress that of `long` work is shown."""
    if callable(progress):
        yield progress
    elif progress or (progress is None and long):
        with bar(label, unit, always=bool(progress)) as report:
            yield report
    else:
        yield None


class _Lines:
    """Lines in a log, the first once the work is known to take long, with the time that is left."""

    def __init__(self, label: str, unit: str) -> None:
        self._label, self._unit = label, unit
        self._start, self._next = time.monotonic(), 0.0

    def __call__(self, done: float, total: float) -> None:
        now = time.monotonic()
        elapsed = now - self._start
        if now < self._next or not _is_long(elapsed, done, total):
            return
        from tqdm import tqdm

        self._next = now + PAUSE
        left = elapsed * (total - done) / done
        count = f"{done:g}/{total:g} {self._unit}, " if total != 1.0 else ""
        passed, rest = map(tqdm.format_interval, (elapsed, left))
        line = f"{self._label}: {count}{100.0 * done / total:.0f} %, {passed} passed, {rest} left"
        print(line, file=sys.stderr, flush=True)
