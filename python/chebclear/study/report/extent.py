"""How far an output reaches over the tolerances: at the samples, and between them where that is known."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from ...base.prefixes import format_quantity
from ...execution.failures import count_failed
from ...run.features import Feature
from ...scene.columns import physical_limits
from ..band.band import Band
from ..features.features import FeatureResult, FeatureTable

if TYPE_CHECKING:
    from ..results import StudyResult

End = Literal["lowest", "peak"]


class Extent(NamedTuple):
    """Lowest and highest value of an output over the tolerances and without them, in its unit."""

    lower: float
    upper: float
    nominal_lower: float
    nominal_upper: float


def extent(result: StudyResult, band: Band) -> Extent:
    """How far an output goes: the one answer to this question of a page.

    A band is one of samples. Where the study found the largest or the smallest value of each run, which may
    lie between samples, the answer is that of this feature.
    """
    low, high = asked_end(result, band, "lowest"), asked_end(result, band, "peak")
    lowest = (band.lower, band.nominal) if low is None else (low.ends[0], low.nominal)
    highest = (band.upper, band.nominal) if high is None else (high.ends[1], high.nominal)
    (lower, without_low), (upper, without_high) = (
        [float(find(one)) for one in ends] for find, ends in ((np.min, lowest), (np.max, highest))
    )
    return Extent(lower, upper, without_low, without_high)


def place_of(band: Band, sample: int) -> str:
    """When, or at which crank angle, a sample is."""
    if band.angle is None:
        return format_quantity(float(band.t[sample]), "s")
    return format_quantity(float(band.angle[sample]), "rad")


def asked_end(result: StudyResult, band: Band, end: End) -> FeatureResult | None:
    """The feature of a study that is the lowest value or the peak of an output, if it has one."""
    asked = {} if result.spec is None else result.spec.features
    names = [name for name in result.features.names if asked.get(name) == Feature(end, band.name)]
    return result.features[names[0]] if names else None


def sampled_end(result: StudyResult, band: Band, end: End) -> FeatureResult:
    """The smallest or the largest value of an output at the samples of each run, as a feature."""
    return result.ends[_END_WORDS[end] + band.name]


_END_WORDS: dict[End, str] = {"lowest": "the lowest value of ", "peak": "the peak of "}


def sampled_ends(result: StudyResult) -> FeatureTable:
    """The features of `sampled_end` for all outputs, which share the polynomials of the points."""
    names, lowest, largest = tuple(result.bands), [], []
    for name in names:
        table = result.table(name)
        lowest.append(table.reshape(len(table), -1).min(axis=1))
        largest.append(table.reshape(len(table), -1).max(axis=1))
    values = np.stack(lowest + largest, axis=-1)[:, None, :]
    return FeatureTable(
        names=tuple(words + name for words in _END_WORDS.values() for name in names),
        runs=values[:-1],
        nominal=values[-1],
        intervals=result.intervals,
        parameters=result.parameters,
        random=result.requirement is not None,
        units=2 * tuple(band.unit for band in result.bands.values()),
        failed=count_failed(result.failures),
        finished=result.spec is not None and result.spec.table,
        nominal_parameters=result.nominal_parameters,
        limits=2 * _limits(result),
        written=2 * tuple(band.written for band in result.bands.values()),
    )


def _limits(result: StudyResult) -> tuple[tuple[float, float], ...]:
    """The physical limits of all outputs."""
    if result.requirement is not None:
        return tuple(result.requirement.limits[name] for name in result.bands)
    return tuple(physical_limits(tuple(result.bands), {}, simulated=result.scene is not None).values())
