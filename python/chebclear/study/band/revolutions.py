"""The revolutions of a run that are pooled, and the crank angles of their samples."""

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
    """Revolutions before them, for the starting transient to decay [-]."""
    start: float = field(metadata=unit("rad"))
    """Angle at which each revolution starts [rad]."""
    sense: int
    """1 where the angle grows, -1 where it falls [-]."""
    samples: int
    """Samples of a revolution, both ends included [-]."""
    column: str | None = None
    """Output that measures the angle of each run; None where all turn at the same constant speed."""
    shown: bool = False
    """Whether the user requested that output as well."""

    @property
    def angle(self) -> NDArray[np.float64]:
        """Angles of the samples of one revolution [rad], shape (samples,)."""
        turn: NDArray[np.float64] = np.linspace(0.0, self.sense * 2.0 * math.pi, self.samples)
        return self.start + turn

    def folded(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Samples of whole runs by revolution, shape (runs, kept, samples, ...): the last sample of each is
        the first of the next."""
        steps = (values.shape[1] - 1) // self.kept
        starts = steps * np.arange(self.kept)
        return values[:, starts[:, None] + np.arange(steps + 1)]

    def instants(self, t: NDArray[np.float64], angle: NDArray[np.float64]) -> NDArray[np.float64] | float:
        """Instants at which a run passes the angles of all samples that are kept [s], from its crank angles,
        full turns included [rad]; the revolutions made [-] where they are too few."""
        # If a crank swings back and passes an angle again, the first time counts.
        passed = np.maximum.accumulate(self.sense * (angle - self.start)) / (2.0 * math.pi)
        # A tolerance, so that rounding of the start does not remove a revolution.
        first = math.ceil(passed[0] - 1e-9) + self.discarded
        if passed[-1] < first + self.kept:
            return float(passed[-1] - passed[0])
        steps = np.arange(self.kept * (self.samples - 1) + 1) / (self.samples - 1)
        found: NDArray[np.float64] = np.interp(first + steps, passed, t)
        return found
