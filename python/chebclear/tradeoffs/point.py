"""Cost and accuracy of one setting of a trade-off."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..base import files as records
from ..base.units import unit
from ..run.trajectory import Stats

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class TradeoffPoint(records.ArrayRecord):
    """Cost and accuracy of one method at one tolerance.

    Attributes
    ----------
    method : str
        Integrator.
    rtol : float
        Relative tolerance of the integrator [-].
    status : str
        ``"done"``, or the word for why the run ended early.
    end_time : float
        Where the run ended [s].
    stats : Stats
        What the run cost, in counts that do not depend on the machine.
    seconds : float
        What the run cost on this machine, the best of the repeats [s].
    horizon : Array
        First sample that is off the reference by more than 1 % of the range [s], shape (outputs,).
    growth : Array
        Largest difference from the reference up to each instant in the unit of the output. The shape is
        (outputs, instants); NaN after the end of a run that failed.
    """

    method: str
    rtol: float
    status: str
    end_time: float = field(metadata=unit("s"))
    stats: Stats
    seconds: float = field(metadata=unit("s"))
    horizon: Array = field(metadata=unit("s"))
    growth: Array

    @property
    def success(self) -> bool:
        """Whether the run reached its end."""
        return self.status == "done"
