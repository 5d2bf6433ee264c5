"""The bands of a study with its nominal mechanism in motion, for the first screen of a report."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...base.rows import Array
from ...plots.animation.film import MOST_FRAMES, evenly, instants, mechanism_panel, mechanism_words, time_axis
from ...plots.animation.motion import moving_mechanism
from ...plots.bands import THIN
from ...report.film import Film, Panel, chart
from ...scene.scene import Scene
from ..band.band import Band

if TYPE_CHECKING:
    from ..results import StudyResult


# Bands that can be shown [-]; all are among the details.
_MOST_CHARTS = 12


def study_film(result: StudyResult) -> Film:
    """The bands of a study; with its nominal mechanism if it is one of a scene."""
    bands = list(result.bands.values())
    x, label = _abscissa(bands[0])
    frames = evenly(len(x), MOST_FRAMES)
    t, scene = bands[0].t[frames], result.scene
    if bands[0].angle is not None:
        places = [f"{angle:.1f}°" for angle in np.degrees(bands[0].angle[frames])]
    elif scene is not None:
        places = instants(scene, t)
    else:
        places = [f"{label} {value:.4g}" for value in x[frames]]
    charts = [
        chart(band.name, band.unit, x, band.nominal, (band.lower, band.upper), THIN, band.written)
        for band in bands[:_MOST_CHARTS]
    ]
    panels = [] if scene is None else [_nominal(scene, result.nominal_poses)]
    return Film("The mechanism and its outputs", label, x[frames], places, panels, charts)


def _abscissa(band: Band) -> tuple[Array, str]:
    """Crank angle or time of the samples of a band, rising, and its label."""
    if band.angle is None:
        return time_axis(band.t)
    sense = 1.0 if band.angle[-1] >= band.angle[0] else -1.0
    return sense * np.degrees(band.angle), "crank angle [°]" if sense > 0.0 else "crank angle, clockwise [°]"


def _nominal(scene: Scene, poses: Array | None) -> Panel:
    """The nominal mechanism at the frames; as assembled where its motion is not known."""
    words = mechanism_words(scene)
    if poses is None:
        assembled = np.array([scene.check().poses])
        return mechanism_panel(moving_mechanism(scene, assembled), f"{words}, as assembled")
    return mechanism_panel(moving_mechanism(scene, poses), f"{words}, all at nominal values")
