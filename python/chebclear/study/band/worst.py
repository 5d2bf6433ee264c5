"""Points of the extremes that the polynomial of a band predicts, and simulated values there."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ...base.files import ArrayRecord
from ...base.named import ReadOnlyDict
from ...base.units import unit
from ...errors import describe
from .band import Band


@dataclass(frozen=True, eq=False)
class WorstCase(ArrayRecord):
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


def predicted_extremes(band: Band) -> list[WorstCase]:
    """The highest and the lowest prediction of a band with a polynomial, not simulated: points where this
    attains the ends of its range, at the instants of the extreme bounds."""
    assert band.surrogate is not None, "only bands with a polynomial predict"
    samples = int(np.argmax(band.upper)), int(np.argmin(band.lower))
    found = replace(band.surrogate, terms=np.ascontiguousarray(band.surrogate.terms[:, samples])).range(1)
    ends = ((found.highest_at, found.attained_upper), (found.lowest_at, found.attained_lower))
    return [
        WorstCase(
            output=band.name,
            side="lower" if k else "upper",
            time=float(band.t[sample]),
            parameters={name: float(value[k]) for name, value in at.items()},
            predicted=float(attained[k]),
            simulated=math.nan,
        )
        for k, (sample, (at, attained)) in enumerate(zip(samples, ends, strict=True))
    ]
