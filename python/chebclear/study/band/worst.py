"""Points of the extremes that the polynomial of a band predicts, and simulated values there."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ...base.named import ReadOnlyDict
from ...base.rows import Array
from ...base.units import unit
from ...errors import describe
from .band import Band


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

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", ReadOnlyDict(self.parameters))

    def __str__(self) -> str:
        word = "highest" if self.side == "upper" else "lowest"
        return (
            f"{self.output} is {word} at t = {self.time:.6g} s with {describe(self.parameters)}: predicted "
            f"{self.predicted:.6g}, simulated {self.simulated:.6g}"
        )


def predicted_extremes(band: Band) -> list[tuple[Literal["lower", "upper"], int, Array, float]]:
    """Side, sample, parameters and value of the highest and lowest prediction of a band with a polynomial.

    They are the points where the polynomial attains the ends of its range, at the instants of the extreme
    bounds.
    """
    high, low = int(np.argmax(band.upper)), int(np.argmin(band.lower))
    polynomial = band.surrogate
    assert polynomial is not None, "only bands with a polynomial predict"
    found = replace(polynomial, terms=np.ascontiguousarray(polynomial.terms[:, [high, low]])).range(1)
    highest = np.array([at[0] for at in found.highest_at.values()])
    lowest = np.array([at[1] for at in found.lowest_at.values()])
    return [
        ("upper", high, highest, float(found.attained_upper[0])),
        ("lower", low, lowest, float(found.attained_lower[1])),
    ]
