"""The nominal run of a study, simulated again: for its drawing that moves, and at other tolerances."""

from __future__ import annotations

import dataclasses
import math
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.prefixes import format_quantity
from ..base.rows import Array
from ..errors import ArgumentError, ChebclearError, ChebclearWarning
from ..plots.animation.film import MOST_FRAMES, evenly
from ..plots.drawing.pose import pose_columns, simulated_poses
from ..report.document import Block, Table, Text
from ..run.simulation import simulate
from .band.band import Band

if TYPE_CHECKING:
    from .results import StudyResult


def nominal_poses(result: StudyResult) -> Array | None:
    """Poses of the bodies of a scene in the nominal run; see `StudyResult.nominal_poses`.

    The runs of a study keep its outputs only. None where this run cannot be made with others, or where
    there was no time for all runs of the study.
    """
    if result.scene is None or result.settings is None or not result.bands or result.status == "stopped":
        return None
    wanted = dataclasses.replace(result.settings, outputs=pose_columns(result.scene), features=())
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ChebclearWarning)
            run = simulate(result.scene, settings=wanted)
    except ChebclearError:
        return None
    t = next(iter(result.bands.values())).t
    frames = t[evenly(len(t), MOST_FRAMES)]
    nearest = np.abs(run.t[:, None] - frames).argmin(axis=0)
    return np.asarray(simulated_poses(run)[nearest])


def frames_of(t: Array) -> int:
    """How many frames a drawing that moves has, of so many instants."""
    return len(evenly(len(t), MOST_FRAMES))


def at_other_tolerances(result: StudyResult) -> list[Block]:
    """Work and estimated error of the nominal run at three tolerances, that of the study in the middle.

    It takes the time of some 27 runs at the tolerance of the study. An ArgumentError for a study without
    scenes or outputs.
    """
    settings = result.settings
    if settings is None or result.scene is None or not result.bands:
        raise ArgumentError(
            "check simulates the nominal mechanism at other tolerances: it takes a study of scenes "
            "with outputs"
        )
    names = list(result.bands)
    rows: list[list[str]] = []
    for factor in (10.0, 1.0, 0.1):
        wanted = dataclasses.replace(settings, rtol=factor * settings.run_rtol, outputs=tuple(names))
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
        return [
            Text("The nominal run fails at the tolerance of the study, at a looser and at a tighter one.")
        ]
    caption = "The nominal run at other tolerances: largest estimated error, over the width of the band"
    return [
        Table(caption, ["tolerance", "stages of the integrator", *names], rows),
        Text(
            "The cost is proportional to the number of stages. An error that is small beside the width of "
            "its band does not change the band: a looser tolerance is cheaper then. Where two runs diverge, "
            "no tolerance makes a single run right; only the band holds."
        ),
    ]


def _error(error: Any, band: Band) -> str:
    """An estimated error as a share of the band, with the instant where runs part."""
    width = float(band.max_width)
    if not (math.isfinite(error.claim) and width > 0.0):
        return "not known"
    share = f"{100.0 * error.claim / width:.2g} %"
    if not error.diverged:
        return share
    return f"{share} until {format_quantity(error.horizon, 's', 3)}, where runs diverge"
