"""Which revolutions of a run are pooled, and at which crank angles they are sampled."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ...base.units import unit


@dataclass(frozen=True)
class Revolutions:
    """The revolutions of every run that are pooled by crank angle."""

    joint: str
    """Revolute joint whose angle is the crank angle."""
    kept: int
    """Revolutions of each run that are pooled [-]."""
    discarded: int
    """Revolutions before them, in which the start settles [-]."""
    start: float = field(metadata=unit("rad"))
    """Angle at which each revolution starts [rad]."""
    sense: int
    """1 where the angle grows, -1 where it falls [-]."""

    def angle(self, samples: int) -> NDArray[np.float64]:
        """Angles of the samples of one revolution, both ends included [rad]."""
        turn: NDArray[np.float64] = np.linspace(0.0, self.sense * 2.0 * math.pi, samples)
        return self.start + turn

    def folded(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Samples of whole runs by revolution.

        Parameters
        ----------
        values : ndarray, shape (runs, kept * (samples - 1) + 1, ...)
            Values at equal steps of the angle.

        Returns
        -------
        ndarray, shape (runs, kept, samples, ...)
            The last sample of each revolution is the first of the next.
        """
        steps = (values.shape[1] - 1) // self.kept
        starts = steps * np.arange(self.kept)
        return values[:, starts[:, None] + np.arange(steps + 1)]
