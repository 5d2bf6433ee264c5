"""Settings of the execution of a study: where runs are made, time limits, treatment of failed runs."""

from __future__ import annotations

import os
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from typing import Literal

from ..base.arguments import Checks
from ..base.units import unit

OnFailure = Literal["collect", "raise"]

MOST_THREADS = 1024  # beyond any machine; each has a stack


@dataclass(frozen=True)
class ExecutionOptions:
    """Where the runs of a study are made, and how failed ones are treated."""

    threads: int | None = None
    """Threads to simulate on [-]; all processors if None, one for each piece given to an executor."""
    executor: Executor | None = None
    """Where to simulate; in this process if None."""
    store: str | os.PathLike[str] | None = None
    """Folder that keeps finished runs."""
    on_failure: OnFailure = "collect"
    """Whether runs that fail are left out or raise."""
    run_seconds: float | None = field(default=None, metadata=unit("s"))
    """Time limit of a run, or of a call for it [s]."""
    max_seconds: float | None = field(default=None, metadata=unit("s"))
    """Time after which no further runs are started [s]."""
    in_memory: bool = True
    """Whether the samples of all runs are in the memory, and not in a file beside the store."""
    answers_from: int | None = None
    """Fewest runs that are answered from when Ctrl-C ends the runs [-]; None if the interrupt is raised."""
    most_failed: float = 0.5
    """Part of the runs that may fail [-]. With more, the error is in what they have in common; 1 for points
    that are judged one by one."""

    def checked(self, checks: Checks) -> ExecutionOptions:
        """The same with plain numbers; problems are added to `checks`."""
        threads, run_seconds, max_seconds = self.threads, self.run_seconds, self.max_seconds
        if threads is not None:
            threads = checks.whole("threads", threads, least=1, most=MOST_THREADS)
        if self.executor is not None and not callable(getattr(self.executor, "submit", None)):
            checks.add("executor", f"must have a method submit, got {self.executor!r}", wrong_type=True)
        checks.word("on_failure", self.on_failure, ("collect", "raise"))
        if run_seconds is not None:
            run_seconds = checks.real("run_seconds", run_seconds, "s", above=0.0)
        if max_seconds is not None:
            max_seconds = checks.real("max_seconds", max_seconds, "s", above=0.0)
        if self.store is not None and not isinstance(self.store, str | os.PathLike):
            checks.add("store", f"must be the path of a folder, got {self.store!r}", wrong_type=True)
        if not isinstance(self.in_memory, bool):
            checks.add("in_memory", f"must be True or False, got {self.in_memory!r}", wrong_type=True)
        elif not self.in_memory and self.store is None:
            checks.add("in_memory", "may only be False with a store, in whose folder the samples then are")
        return replace(self, threads=threads, run_seconds=run_seconds, max_seconds=max_seconds)
