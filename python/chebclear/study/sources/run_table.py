"""The table of the runs of a study: sources make it; bands, features, polynomials and views read it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ...base.rows import Array
from ...base.units import unit
from ...execution.costs import Costs
from ...execution.failures import FailedRun
from ...notices import Notice
from ...run.settings import Settings
from ...scene.scene import Scene

ROUNDING = 1e-12
"""Relative difference of values of runs that counts as rounding [-]."""


@dataclass(frozen=True, eq=False)
class RunTable:
    """Successful runs of a study, the nominal one last if it was requested."""

    parameters: Array
    """Parameters of the runs without the nominal one [SI units], shape (runs, parameters)."""
    kept: NDArray[np.intp]
    """Numbers of the requested points whose runs these are."""
    t: Array = field(metadata=unit("s"))
    """Instants [s], shape (samples,)."""
    outputs: tuple[str, ...]
    """Names of the outputs."""
    values: Array
    """All outputs of all runs in their units, shape (runs + 1, samples, outputs); by crank angle (runs + 1,
    revolutions, samples, outputs)."""
    features: Array | None = None
    """Features of all runs, shape (runs + 1, cycles, features); None if there are none."""
    feature_names: tuple[str, ...] = ()
    """Names of the features."""
    notices: tuple[Notice, ...] = ()
    """What should be checked, each kind once."""
    failures: tuple[FailedRun, ...] = ()
    """The runs that failed."""
    stats: Costs = field(default_factory=lambda: Costs.joined(()))
    """What each run cost; nothing if they were not simulated."""
    settings: Settings | None = None
    """Settings of the runs; None if they were not simulated."""
    seconds: float = field(default=math.nan, metadata=unit("s"))
    """Time they took [s]."""
    nominal_parameters: Array | None = None
    """Parameters of the run that is used as the nominal one, shape (parameters,); None at nominal values."""
    scene: Scene | None = None
    """The scene at the nominal values of all intervals; None if the runs were not simulated."""
    clearances: dict[str, float] = field(default_factory=dict, metadata=unit("m"))
    """Largest clearance of each joint in the box and in all runs, where it is known [m]."""
    scenes: Sequence[Scene] = ()
    """The scenes, built again on request, because thousands of scenes would fill the memory."""

    def __getitem__(self, rows: slice | NDArray[np.intp]) -> RunTable:
        """Some of the runs."""
        return replace(
            self,
            parameters=self.parameters[rows],
            kept=self.kept[rows],
            values=self.values[rows],
            features=None if self.features is None else self.features[rows],
            stats=self.stats[rows] if len(self.stats) else self.stats,
        )

    def joined(self, others: Sequence[RunTable]) -> RunTable:
        """These runs and then those of others, which may not know the features; else like this table."""
        tables = [self, *others]
        found = [table.features for table in tables if table.features is not None]
        return replace(
            self,
            parameters=np.concatenate([table.parameters for table in tables]),
            kept=np.concatenate([table.kept for table in tables]),
            values=np.concatenate([table.values for table in tables]),
            features=np.concatenate(found) if len(found) == len(tables) else None,
            stats=Costs.joined(table.stats for table in tables),
        )
