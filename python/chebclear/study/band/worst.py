"""Points of the extremes that the polynomial of a band predicts, and simulated values there."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ...base.units import unit
from ...errors import describe
from ..polynomials.points import on_box, sobol_points
from .band import Band

Array = NDArray[np.float64]

# Number of points at which a polynomial is evaluated, and of parameters up to which these include all
# corners.
_POINTS, _MOST_CORNERS = 2048, 10


@dataclass(frozen=True)
class WorstCase:
    """A run at the parameters for which a polynomial predicts the largest or smallest value of an output."""

    output: str
    """Name of the output."""
    side: Literal["lower", "upper"]
    """Which bound."""
    time: float = field(metadata=unit("s"))
    """When [s]."""
    parameters: dict[str, float]
    """Parameters of the run [SI units]."""
    predicted: float
    """Value of the polynomial, in the unit of the output."""
    simulated: float
    """Value of the run at that instant; NaN if it failed."""

    def __str__(self) -> str:
        word = "highest" if self.side == "upper" else "lowest"
        return (
            f"{self.output} is {word} at t = {self.time:.6g} s with {describe(self.parameters)}: predicted "
            f"{self.predicted:.6g}, simulated {self.simulated:.6g}"
        )


def predicted_extremes(band: Band) -> list[tuple[Literal["lower", "upper"], int, Array, float]]:
    """Side, sample, parameters and value of the highest and lowest prediction of a band with a polynomial.

    The polynomial is evaluated at the corners of the box and at points between them, at the instant of the
    extreme bound.
    """
    sides = band.intervals
    points = sobol_points(sides, 0, _POINTS, 0)
    if len(sides) <= _MOST_CORNERS:
        corners = np.array(list(itertools.product((-1.0, 1.0), repeat=len(sides))))
        points = np.concatenate([on_box(sides, corners), points])
    # The given ends, since rounding might move a corner out of the box.
    ends = np.array([[side.lower, side.upper] for side in sides.values()]).T
    points = np.clip(points, *ends)
    values = band.evaluate(**dict(zip(sides, points.T, strict=True)))
    high, low = int(np.argmax(band.upper)), int(np.argmin(band.lower))
    highest, lowest = int(np.argmax(values[:, high])), int(np.argmin(values[:, low]))
    return [
        ("upper", high, points[highest], float(values[highest, high])),
        ("lower", low, points[lowest], float(values[lowest, low])),
    ]
