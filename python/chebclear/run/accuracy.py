"""Difference of two runs of one scene, and the time until which they agree.

Impacts amplify errors until two runs are uncorrelated. Their difference measures
accuracy only up to the *chaos horizon*: the first instant at which the runs differ by more than 1 % of the
range of the output in the whole run. From then on the runs have diverged.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..base import files as records
from ..base.named import Named
from ..base.rows import Array
from ..base.units import unit
from ..errors import UnknownNameError
from ..notices import HORIZON, Notice
from .names import output_meant

HORIZON_PART = 0.01
"""Difference at which runs have diverged, relative to the range of the output [-]."""
SAFETY = 2.0
"""Ratio of the claimed error to the difference from the companion runs [-].

Measured with ``benchmarks/claims.py`` on 300 random scenes: without it the errors of 1.7 % of the outputs at
rtol 1e-9 exceeded twice the claim, and one run of 1842 ten times the claim."""
ROUNDING_PART = 1e-10
"""An output whose range is less than this part of the largest output of its kind is constant [-].

The rounding errors of some 1e6 steps add up to 1e-13; an output of interest is far above."""


def output_ranges(columns: Sequence[str], values: Array) -> tuple[Array, Array]:
    """Range of every output, and the difference at which two runs have diverged, each of shape (columns,).

    Both are in the units of the outputs. The range, of values of shape (samples, columns), is 0 for an output
    that is constant to rounding, relative to the largest value among the outputs of its kind (such as
    ``"slider.y"`` and ``"crank.x"``); the difference is 1 % of the range, or the rounding error if that is
    larger.
    """
    finite = np.where(np.isfinite(values), values, np.nan)
    known = ~np.all(np.isnan(finite), axis=0)
    ranges, sizes = np.zeros(len(columns)), np.zeros(len(columns))
    ranges[known] = np.nanmax(finite[:, known], axis=0) - np.nanmin(finite[:, known], axis=0)
    sizes[known] = np.nanmax(np.abs(finite[:, known]), axis=0)
    kinds = [_kind(name) for name in columns]
    largest = {
        kind: max(sizes[index] for index, other in enumerate(kinds) if other == kind) for kind in kinds
    }
    rounding = ROUNDING_PART * np.array([largest[kind] for kind in kinds])
    ranges = np.where(ranges > rounding, ranges, 0.0)
    return ranges, np.maximum(HORIZON_PART * ranges, rounding)


def _kind(column: str) -> str:
    """The kind of a column without body and direction: the same for ``"rod.vx"`` and ``"slider.vy"``."""
    return column.rpartition(".")[2].rstrip("xy").rstrip("_")


def chaos_horizon(t: Array, difference: Array, threshold: Array | float) -> Array:
    """First instant [s] at which a difference of two runs exceeds a threshold, else infinity.

    >>> chaos_horizon(np.array([0.0, 0.1, 0.2]), np.array([0.0, -0.02, 0.005]), 0.01)
    array(0.1)
    """
    diverged = np.abs(difference) > threshold
    return np.where(diverged.any(axis=0), t[np.argmax(diverged, axis=0)], math.inf)


BY_ANGLE = (
    "single values there are not predictable, only their distribution, which "
    "a band over the crank angle bounds: ten revolutions of each run, without the first"
)
"""Advice beyond the chaos horizon of a mechanism with a revolving drive."""


def past_horizon(errors: Mapping[str, OutputError], period: float, end: float) -> tuple[Notice, ...]:
    """A notice if outputs continue to the end [s] for more than a period [s] beyond their horizon."""
    lost = {
        name: error.horizon
        for name, error in errors.items()
        if error.diverged and error.horizon + period < end
    }
    if period < 0.0 or not lost:
        return ()
    first = min(lost.values())
    text = (
        f"past the chaos horizon: runs at tighter tolerances diverge from this one at t = {first:.4g} s, "
        f"over a revolution before its end ({', '.join(lost)}): {BY_ANGLE}"
    )
    return (Notice(HORIZON, text, tuple(lost), {"time": first}),)


class OutputError(NamedTuple):
    """The estimated error of one output."""

    max_difference: float
    """Largest difference from the companion runs in the unit of the output."""
    range: float
    """Range of the output in its unit; 0 if it is constant."""
    horizon: float
    """Instant from which the estimate no longer holds [s]; infinity if it holds to the end."""
    diverged: bool
    """Whether the runs differ there by more than 1 % of the range; otherwise a companion run ended there."""

    @property
    def claim(self) -> float:
        """Claimed bound of the error up to the horizon, in the unit of the output.

        It is twice the largest difference, or 2 % of the range if the runs diverge.
        """
        most = HORIZON_PART * self.range if self.diverged else math.inf
        return SAFETY * min(self.max_difference, most)

    @property
    def relative(self) -> float:
        """Largest difference relative to the range [-]; NaN for a constant output."""
        return self.max_difference / self.range if self.range > 0.0 else math.nan

    def in_words(self) -> str:
        """Whether and when the runs diverged, such as ``"diverged at 0.0125 s"``."""
        if math.isnan(self.max_difference):
            return "not known"
        if math.isinf(self.horizon):
            return "did not diverge"
        if self.diverged:
            return f"diverged at {self.horizon:.4g} s"
        return f"did not diverge until {self.horizon:.4g} s, where a companion run ended"


@dataclass(frozen=True, eq=False, repr=False)
class ErrorEstimate(records.ArrayRecord, Named[OutputError]):
    """The errors of a run, estimated by two companion runs at tighter tolerances.

    One has a tenth of its tolerances, the other a hundredth and another method. ``estimate["slider.vx"]`` is
    the `OutputError` of that output. Its `claim` is twice the largest difference; ``benchmarks/README.md``
    says how often true errors exceed it. Beyond the horizon the runs are uncorrelated, and their difference
    no longer estimates an error.

    Attributes
    ----------
    columns : tuple[str, ...]
        Names of the outputs.
    max_difference : Array
        Largest difference from the companions in the unit of each output, shape (columns,); NaN if not
        known.
    ranges : Array
        Range of each output in its unit, shape (columns,); 0 for one that is constant.
    horizon : Array
        First sample that differs by more than 1 % of the range, or where a companion run ended before the
        run if that is earlier [s], shape (columns,); infinity if none does.
    rtol : float
        Relative tolerance of the tighter companion run [-], a hundredth of that of the run.
    status : str
        ``"done"``, or the word for why a companion run ended early.
    compared_until : float
        End of the time that the run and both companions have reached [s].
    """

    columns: tuple[str, ...]
    max_difference: Array
    ranges: Array
    horizon: Array = field(metadata=unit("s"))
    rtol: float
    status: str
    compared_until: float = field(metadata=unit("s"))

    @property
    def _names(self) -> tuple[str, ...]:
        return self.columns

    def _entry(self, name: str) -> OutputError:
        if name not in self:
            raise UnknownNameError(f'unknown column "{name}"{output_meant(name, self.columns)}')
        index = self.columns.index(name)
        horizon = float(self.horizon[index])
        # If both companions are done, neither ended before the run.
        ended = self.status != "done" and horizon == self.compared_until
        return OutputError(
            float(self.max_difference[index]),
            float(self.ranges[index]),
            horizon,
            math.isfinite(horizon) and not ended,
        )

    def _repr_html_(self) -> str:
        # Here, as in Trajectory: what reports import takes time.
        from ..report import html
        from ..report.document import Table

        rows = [
            [name, f"{error.max_difference:.3g}", f"{error.relative:.2g}", error.in_words()]
            for name, error in ((name, self._entry(name)) for name in self.columns)
        ]
        head = ["output", "largest difference", "of the range [-]", "compared with the companions"]
        return html.fragment(repr(self)[1:-1], [Table("Estimated errors", head, rows)])

    def __repr__(self) -> str:
        errors = [self._entry(name) for name in self.columns]
        relative = np.array([error.relative for error in errors])
        head = f"<ErrorEstimate of {len(errors)} outputs from runs up to rtol {self.rtol:g}, {self.status}"
        if not np.isfinite(relative).any():
            return f"{head}>"
        worst = int(np.nanargmax(relative))
        largest = f"largest difference {relative[worst]:.2g} of the range, in {self.columns[worst]}"
        return f"{head}:\n  {largest}; {sum(error.diverged for error in errors)} outputs diverged>"
