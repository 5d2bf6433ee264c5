"""The starting transient of a run."""

from __future__ import annotations

import math

from ..scene.parts import has_contacts
from ..scene.scene import Scene


def settling_time(scene: Scene) -> float:
    """Assumed length of the starting transient of a mechanism with clearance [s]: the slowest revolution.

    A little less than that, so that rounding puts nothing of the second revolution before it. Minus
    infinity without clearance or a drive at constant speed.
    """
    if not has_contacts(scene.joints) and all(one.backlash is None for one in scene.couplings):
        return -math.inf
    try:
        return (1.0 - 1e-9) * scene.period
    except ValueError:  # nothing revolves
        return -math.inf
