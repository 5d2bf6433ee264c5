"""Features of a run that did not compute them, from a repetition of the run."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..scene.parts import has_contacts
from ..scene.scene import Scene, compiled
from .features import Feature
from .settings import Settings


def simulate_features(
    scene: Scene, settings: Settings, start: str | None, features: Sequence[Feature], cycles: int
) -> NDArray[np.float64]:
    """The features of a run, from a repetition with exactly the same steps.

    Parameters
    ----------
    scene : Scene
        The mechanism.
    settings : Settings
        Settings of the run.
    start : str or None
        The state from which the run continued, as JSON.
    features : sequence of Feature
        Features to compute, whose outputs and joints the scene must have.
    cycles : int
        Equal pieces of the sampled time [-].

    Returns
    -------
    ndarray, shape (cycles, features)
        NaN for a piece that the run did not finish.
    """
    # Steps do not depend on samples and outputs.
    column = scene.check().columns[:1]
    again = dataclasses.replace(settings, samples=2, outputs=column, features=tuple(features), cycles=cycles)
    return compiled(scene).simulate(again.to_json(), None, start)["features"]


def settling_time(scene: Scene) -> float:
    """Assumed length of the starting transient of a mechanism with clearance [s]: the slowest revolution.

    A little less than that, so that rounding puts nothing of the second revolution before it. Minus
    infinity without clearance or a drive at constant speed.
    """
    if not has_contacts(scene.joints):
        return -np.inf
    try:
        return (1.0 - 1e-9) * scene.period
    except ValueError:  # nothing revolves
        return -np.inf
