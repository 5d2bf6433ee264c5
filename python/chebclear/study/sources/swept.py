"""A run of a study as features that are callables get it: its samples, and all else on demand."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...run.names import column_index
from ...run.settings import Settings
from ...run.signals.signals import WithSignals
from ...run.simulation import run_scene
from ...run.trajectory import Stats, Trajectory
from ...scene.scene import Scene

Array = NDArray[np.float64]


class SweptRun(WithSignals):
    """A run of a study with the interface of a `Trajectory`, a mapping from the names of the columns too.

    Samples, parameters and work of the run are available. Contacts, events, peaks and all else of a
    `Trajectory` are not kept by a study: the first access to them repeats the run with the same steps.
    """

    def __init__(
        self, scene: Scene, settings: Settings, t: Array, columns: Sequence[str], samples: Array, stats: Stats
    ) -> None:
        self.scene = scene
        self.settings = settings
        self.t = t
        self.columns = tuple(columns)
        self.samples = samples
        self.stats = stats
        self.status = "done"
        self.success = True

    def __repr__(self) -> str:
        return f"<run of a study: {len(self.columns)} columns of {len(self.t)} samples>"

    @property
    def _names(self) -> tuple[str, ...]:
        return self.columns

    def _entry(self, name: str) -> Array:
        return self.samples[:, column_index(self.columns, name, self.scene)]

    def to_dict(self) -> dict[str, Array]:
        """``t`` and all columns by name."""
        return {"t": self.t, **{name: self[name] for name in self.columns}}

    @cached_property
    def whole(self) -> Trajectory:
        """The run simulated once more."""
        return run_scene(self.scene, self.settings)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self.whole, name)
