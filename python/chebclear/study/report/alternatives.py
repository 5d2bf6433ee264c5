"""What a tighter or a cheaper setting would give, measured on the runs of a study and on its nominal run."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...base.prefixes import format_quantity
from ...errors import ChebclearError, ChebclearWarning
from ...report.document import Block, Cell, Table, Text
from ...run.simulation import simulate
from ..band.band import Band
from ..band.calibrated import Requirement, calibrated_bands

Array = NDArray[np.float64]

# A band of so few runs is judged by too few others [-].
_LEAST_HALF = 8
# The nominal run is simulated again with its companions, as long as that takes no more time than this [s], or
# than this part of the time of the study [-]. All of it is some 27 runs at the tolerance of the study.
_PATIENCE, _PART, _COST_OF_AN_ESTIMATE = 5.0, 0.25, 27.0


def alternatives(result: Any) -> list[Block]:
    """Tables and sentences on fewer and more runs, and on looser and tighter tolerances.

    Parameters
    ----------
    result : StudyResult
        The study.

    Returns
    -------
    list of Block
        Empty where nothing was measured.
    """
    return [*_fewer_runs(result), *_tolerances(result)]


def _fewer_runs(result: Any) -> list[Block]:
    """Bands of the first half of the runs beside those of all, judged by the other half."""
    kinds = {"band": _calibrated_half, "sample": _sampled_half}
    count = len(result.parameters) // 2
    if result.kind not in kinds or count < _LEAST_HALF or not result.bands:
        return []
    if any(band.angle is not None for band in result.bands.values()):
        return []  # the revolutions of a run are pooled: they are no further runs
    halves = kinds[result.kind](result, count)
    rows: list[list[Cell]] = []
    for name, band in result.bands.items():
        lower, upper = halves[name]
        others = band.runs[count:]
        inside = float(((others >= lower) & (others <= upper)).mean())
        width, whole = float((upper - lower).mean()), float(band.width.mean())
        unit = band.unit
        change = "-" if whole <= 0.0 else f"{100.0 * (width / whole - 1.0):+.1f} %"
        rows.append([name, *(format_quantity(size, unit) for size in (width, whole)), change, _share(inside)])
    total = len(result.parameters)
    head = ["output", f"mean width, {count} runs", f"mean width, {total} runs", "change", "other runs inside"]
    caption = f"The first {count} runs alone, judged by the other {total - count}"
    blocks: list[Block] = [Table(caption, head, rows)]
    if math.isfinite(result.seconds):
        half, twice = result.seconds * count / total, 2.0 * result.seconds
        blocks.append(
            Text(
                f"Half the runs would have taken {format_quantity(half, 's', 2)} in place of "
                f"{format_quantity(result.seconds, 's', 2)}; twice as many would take about "
                f"{format_quantity(twice, 's', 2)}. What the second half of the runs changed is the best "
                "guess of what another doubling would: it was not measured. result.extend(runs) adds runs "
                "and repeats none; at the command line --runs asks for more."
            )
        )
    return blocks


def _calibrated_half(result: Any, count: int) -> Mapping[str, tuple[Array, Array]]:
    """Bands calibrated on the first runs alone, by the rule of the whole."""
    names = list(result.bands)
    bands = list(result.bands.values())
    runs = np.stack([np.vstack([band.runs[:count], band.nominal]) for band in bands], axis=2)
    requirement: Requirement = dataclasses.replace(result.requirement, runs=count, failed=0)
    first: Band = bands[0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ChebclearWarning)
        made = calibrated_bands(
            first.t,
            names,
            runs,
            dict(result.intervals),
            result.parameters[:count],
            requirement,
            nominal_parameters=result.nominal_parameters,
        )
    return {name: (band.lower, band.upper) for name, band in made.items()}


def _sampled_half(result: Any, count: int) -> Mapping[str, tuple[Array, Array]]:
    """The extremes of the first runs and of the nominal one."""
    return {
        name: (
            np.minimum(band.runs[:count].min(axis=0), band.nominal),
            np.maximum(band.runs[:count].max(axis=0), band.nominal),
        )
        for name, band in result.bands.items()
    }


def _tolerances(result: Any) -> list[Block]:
    """Work and estimated error of the nominal run at three tolerances, that of the study in the middle."""
    settings = result.settings
    if settings is None or result.scene is None or not result.bands:
        return []
    a_run = result.seconds / (len(result.parameters) + 1)
    if not a_run * _COST_OF_AN_ESTIMATE <= max(_PATIENCE, _PART * result.seconds):
        return [
            Text(
                "What another tolerance would give was not measured here, since it takes too long: "
                'simulate(..., error="estimate") estimates it for the nominal run.'
            )
        ]
    names = list(result.bands)
    rows: list[list[Cell]] = []
    for factor in (10.0, 1.0, 0.1):
        wanted = dataclasses.replace(settings, rtol=factor * settings.rtol, outputs=tuple(names))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ChebclearWarning)
                run = simulate(result.scene, settings=wanted, error="estimate")
        except ChebclearError:  # a tolerance that the integrators do not take, or a run that gives up
            continue
        marked = f"rtol {wanted.rtol:g}" + (" (this study)" if factor == 1.0 else "")
        assert run.error is not None, "it was asked for"
        errors = [_error(run.error[name], result.bands[name]) for name in names]
        rows.append([marked, f"{run.stats.stages:d}", *errors])
    if not rows:
        return []
    caption = "The nominal run at other tolerances: largest estimated error, over the width of the band"
    blocks: list[Block] = [Table(caption, ["tolerance", "stages of the integrator", *names], rows)]
    blocks.append(
        Text(
            "Time goes with the stages. An error that is small beside the width of its band does not change "
            "it: a looser tolerance is cheaper then. Where two runs diverge, no tolerance makes a single run "
            "right, and only the band means something."
        )
    )
    return blocks


def _error(error: Any, band: Band) -> str:
    """An estimated error as a share of the band, with the instant where runs part."""
    width = float(band.max_width)
    if not (math.isfinite(error.claim) and width > 0.0):
        return "not known"
    share = f"{100.0 * error.claim / width:.2g} %"
    if not error.diverged:
        return share
    return f"{share} until {format_quantity(error.horizon, 's', 3)}, where runs diverge"


def _share(share: float) -> str:
    return f"{math.floor(1e4 * share) / 1e2:g} %"
