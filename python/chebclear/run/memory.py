"""Memory that is left: what does not fit is refused before it is begun."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from ..errors import MemoryLimitError

# What takes less [bytes] is not looked at: it fits, or the core says that it does not.
_SMALL = 30e6
_CGROUPS, _PROCESS, _MACHINE = Path("/sys/fs/cgroup"), Path("/proc/self"), Path("/proc/meminfo")
_UNKNOWN = (ImportError, OSError, ValueError, LookupError)


def require_memory(size: float, what: str) -> None:
    """Raise MemoryLimitError if so many bytes are more than this process may still take."""
    left, whose = min(_left(), default=(math.inf, "")) if size > _SMALL else (math.inf, "")
    if size > left:
        raise MemoryLimitError(
            f"{what} about {size / 1e6:.0f} MB, and {whose} leaves {max(left, 0.0) / 1e6:.0f} MB: ask for "
            "fewer runs, samples or outputs, for features alone, or leave samples of a study in a store"
        )


def room() -> float:
    """What this process may still take [bytes], as far as the system reports it."""
    return min((left for left, _ in _left()), default=math.inf)


def taken(place: int = 1) -> float:
    """What this process takes now [bytes], 0 where the system does not tell; at place 0 its addresses."""
    with suppress(*_UNKNOWN):
        import resource

        return float(int((_PROCESS / "statm").read_text().split()[place]) * resource.getpagesize())
    return 0.0


def _left() -> Iterator[tuple[float, str]]:
    """How much each limit leaves [bytes], and whose it is, as far as the system reports it."""
    with suppress(*_UNKNOWN):
        import resource

        limit = resource.getrlimit(resource.RLIMIT_AS)[0]
        if limit != resource.RLIM_INFINITY:
            yield limit - taken(0), "the limit of this process"
    with suppress(*_UNKNOWN):
        # The line of version 2 of control groups.
        lines = (_PROCESS / "cgroup").read_text().splitlines()
        group = Path(next(line for line in lines if line.startswith("0::")).removeprefix("0::/"))
        for folder in (_CGROUPS / part for part in (group, *group.parents)):
            with suppress(*_UNKNOWN):
                statistics = dict(line.split() for line in (folder / "memory.stat").read_text().splitlines())
                # Files that nobody uses are given up before anything else.
                used = int((folder / "memory.current").read_text()) - int(statistics["inactive_file"])
                most = float((folder / "memory.max").read_text().replace("max", "inf"))
                yield most - used, "its control group"
    with suppress(*_UNKNOWN):
        facts = dict(line.split(":") for line in _MACHINE.read_text().splitlines())
        free = sum(int(facts[name].split()[0]) for name in ("MemAvailable", "SwapFree"))
        yield 1024.0 * free, "this machine"
