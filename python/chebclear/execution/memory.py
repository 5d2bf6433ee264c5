"""Memory for the samples of a study: refused before the first run where it is not there, or in a file."""

from __future__ import annotations

import contextlib
import math
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import MemoryLimitError, StoreError

Array = NDArray[np.float64]

# What a study takes while its result is made, over the size of its samples, and besides [bytes]. Measured
# with 4 096 runs of 1441 samples of four outputs: 1.05 for extremes, 1.25 for polynomials, 1.95 for
# calibrated bands, and 41 MB.
_TIMES, _BESIDES = 1.5, 100_000_000
# Studies of fewer samples [bytes] are not looked at: they fit, or the core says that they do not.
_SMALL = 16_000_000

_CGROUPS, _PROCESS, _MACHINE = Path("/sys/fs/cgroup"), Path("/proc/self"), Path("/proc/meminfo")


def sample_array(shape: tuple[int, ...], folder: str | os.PathLike[str] | None) -> Array:
    """An array for the samples of all runs.

    Parameters
    ----------
    shape : tuple of int
        Its shape.
    folder : path or None
        Where to put a file that holds it, which goes with the process; None for the memory.

    Raises
    ------
    MemoryLimitError
        If a study of such an array would not fit into the memory.
    StoreError
        If the file does not fit on the disk.
    """
    size = 8 * math.prod(shape)
    if folder is None or size == 0:
        if size > _SMALL:
            _require(_TIMES * size + _BESIDES)
        return np.empty(shape)
    try:
        descriptor, name = tempfile.mkstemp(prefix=".values-", dir=folder)
        try:
            # Of a file with holes a full disk would end the process when they are written to.
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(descriptor, 0, size)
            with os.fdopen(descriptor, "r+b", closefd=False) as file:
                mapped = np.memmap(file, dtype=float, mode="w+", shape=shape)
        finally:
            os.close(descriptor)
            # What is mapped stays until it is no longer used; Windows keeps the name as long.
            with contextlib.suppress(PermissionError):
                os.unlink(name)
    except OSError as error:
        message = f"the samples of all runs take {size / 1e6:.0f} MB in {os.fspath(folder)}"
        raise StoreError(f"{message}: {error.strerror or error}") from error
    return np.asarray(mapped)


def _require(size: float) -> None:
    """Raise if so many bytes are more than this process may still take."""
    left, whose = min(_left(), default=(math.inf, ""))
    if size > left:
        room = f"{size / 1e6:.0f} MB, and {whose} leaves {max(left, 0.0) / 1e6:.0f} MB"
        raise MemoryLimitError(
            f"the study takes about {room}: ask for fewer runs, samples or outputs, for features alone, or "
            "let the samples stay on the disk with store=... and in_memory=False"
        )


def _left() -> Iterator[tuple[float, str]]:
    """How much each limit leaves [bytes], and whose it is, as far as the system reports it."""
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            pages = int((_PROCESS / "statm").read_text().split()[0])
            yield float(limit - pages * resource.getpagesize()), "the limit of this process"
    for folder in _groups():
        with contextlib.suppress(OSError, ValueError):
            most = (folder / "memory.max").read_text().strip()
            if most != "max":
                used = int((folder / "memory.current").read_text())
                statistics = dict(
                    line.split(maxsplit=1) for line in (folder / "memory.stat").read_text().splitlines()
                )
                # Files that nobody uses are given up before anything else.
                left = int(most) - used + int(statistics.get("inactive_file", 0))
                yield float(left), "the control group of this process"
    with contextlib.suppress(OSError, ValueError, KeyError):
        facts = dict(line.split(":") for line in _MACHINE.read_text().splitlines())
        free = sum(int(facts[name].split()[0]) for name in ("MemAvailable", "SwapFree"))
        yield 1024.0 * free, "this machine"


def _groups() -> Iterator[Path]:
    """Folders of the control group of this process and of those that it is part of."""
    with contextlib.suppress(OSError):
        for line in (_PROCESS / "cgroup").read_text().splitlines():
            if line.startswith("0::/"):
                path = Path(line.removeprefix("0::/"))
                yield from (_CGROUPS / part for part in (path, *path.parents))
