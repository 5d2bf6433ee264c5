"""Progress reports: tqdm if there is one, else one line on standard error."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

Report = Callable[[float, float], None]
"""Takes what is done and what there is to do in all, in the same unit."""


def is_request(progress: object) -> bool:
    """Whether this is a value that ``progress=`` accepts."""
    return progress is None or isinstance(progress, bool) or callable(progress)


@contextmanager
def bar(label: str, unit: str) -> Iterator[Report | None]:
    """A bar while the block runs; None if standard error is no terminal, so that logs stay clean."""
    if not sys.stderr.isatty():
        yield None
        return
    try:
        from tqdm.auto import tqdm  # type: ignore[import-untyped, unused-ignore]
    except ImportError:
        line = _Line(label, unit)
        try:
            yield line
        finally:
            line.close()
        return
    shown: Any = tqdm(desc=label, unit=unit, file=sys.stderr)

    def report(done: float, total: float) -> None:
        shown.total = total
        shown.update(done - shown.n)

    try:
        yield report
    finally:
        shown.close()


class _Line:
    """One line that is written over."""

    def __init__(self, label: str, unit: str) -> None:
        self._label = label
        self._unit = unit
        self._start = time.monotonic()

    def __call__(self, done: float, total: float) -> None:
        elapsed = time.monotonic() - self._start
        share = 100.0 * done / total if total else 100.0
        count = f"{done:g}/{total:g} {self._unit}, " if total != 1.0 else ""
        sys.stderr.write(f"\r{self._label}: {count}{share:3.0f} %, {elapsed:.1f} s\x1b[K")
        sys.stderr.flush()

    def close(self) -> None:
        sys.stderr.write("\n")
        sys.stderr.flush()
