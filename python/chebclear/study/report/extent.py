"""How far an output reaches over the tolerances: at the samples, and between them where that is known."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...run.features import Feature
from ..band.band import Band

if TYPE_CHECKING:
    from ..results import StudyResult


def extent(result: StudyResult, band: Band) -> tuple[float, float]:
    """Lowest and highest value of an output over the tolerances, in its unit.

    A band is one of samples. Where the study found the largest or the smallest value of each run too, which
    may lie between samples, their intervals count as well.

    Parameters
    ----------
    result : StudyResult
        The study.
    band : Band
        The band of the output.
    """
    lower, upper = at_samples(band)
    if result.spec is not None and result.features:
        for name, asked in result.spec.features.items():
            if asked == Feature("lowest", band.name):
                lower = min(lower, result.features[name].interval.lower)
            elif asked == Feature("peak", band.name):
                upper = max(upper, result.features[name].interval.upper)
    return lower, upper


def at_samples(band: Band) -> tuple[float, float]:
    """The lowest and the highest bound."""
    return float(band.lower.min()), float(band.upper.max())
