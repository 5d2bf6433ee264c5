"""Verdict on a band, the method that made it, and the margin by which it exceeds its runs."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Literal

from ...base.units import unit

Verdict = Literal["resolved", "not resolved", "calibrated", "certified", "undersampled", "sampled"]


@dataclass(frozen=True)
class Margin:
    """Method of a band, and the margin by which it exceeds its runs.

    Attributes
    ----------
    method : Literal['polynomial', 'envelope', 'runs']
        The range of a polynomial in the parameters with its largest error at runs it was not fitted to;
        running extremes of the runs in time, widened; or the extremes of the runs alone.
    degree : int | None
        Degree of the polynomial [-], the largest of all parameters; None without one.
    error : float
        Largest error of the polynomial at runs it was not fitted to, over the width of the hull, both
        averaged over time [-]; NaN without such a run.
    window : float
        Half-length of the window of the running extremes [s]; the mean if several were averaged.
    inflation : float
        Widening of the band to either side, in local spreads of the runs [-].
    persistence : float
        Share of the samples for which a held-out run that leaves the band of the others, before that is
        widened, stays outside [-]; 0 without such runs. Near 1 runs differ for all of their time.
    """

    method: Literal["polynomial", "envelope", "runs"]
    degree: int | None = None
    error: float = math.nan
    window: float = field(default=0.0, metadata=unit("s"))
    inflation: float = 0.0
    persistence: float = 0.0
