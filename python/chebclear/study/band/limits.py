"""Physical limits of outputs for all values of the parameters, and their units."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from ...scene.parts import joints_with_play
from ...scene.scene import Interval, Scene

# By the last part of the name of an output, which is never part of a name given by the user.
_LIMITS = {
    "normal_force": (0.0, math.inf),
    "contact": (0.0, 1.0),
    "eccentricity": (0.0, math.inf),
    "impact_loss": (0.0, math.inf),
    "friction_loss": (0.0, math.inf),
    "damping_loss": (0.0, math.inf),
    "wear": (0.0, math.inf),
    "length": (0.0, math.inf),
}
# Outputs of the whole mechanism; "energy" cannot be the name of a part.
_ENERGIES = {"energy.kinetic": (0.0, math.inf), "energy.contact": (0.0, math.inf)}
_NONE = (-math.inf, math.inf)


def physical_limits(
    outputs: Sequence[str], clearances: Mapping[str, float]
) -> dict[str, tuple[float, float]]:
    """Lower and upper limit of each output by its name, in its unit; infinite where there is none.

    The clearance of a joint [m] is the distance to contact of a concentric journal: no penetration is below
    the negative of the largest one.
    """
    limits = {}
    for output in outputs:
        owner, _, quantity = output.rpartition(".")
        if quantity == "penetration" and owner in clearances:
            limits[output] = (-clearances[owner], math.inf)
        else:
            limits[output] = _ENERGIES.get(output) or _LIMITS.get(quantity, _NONE)
    return limits


def largest_clearances(
    scene_at: Callable[[dict[str, float]], Scene],
    intervals: Mapping[str, Interval],
    scene: Scene,
    found: Mapping[str, float],
) -> dict[str, float]:
    """Largest clearance of each joint in the box, where it depends on one parameter at a time [m].

    It includes those of the scene at the midpoint and those `found` in the runs. Joints whose clearances at
    the ends of the box are unknown are left out.
    """
    middle = {name: side.nominal for name, side in intervals.items()}
    nominal, largest = _clearances(scene), _clearances(scene)
    for name, side in intervals.items():
        ends = []
        for end in (side.lower, side.upper):
            try:
                ends.append(_clearances(scene_at({**middle, name: end})))
            except Exception:  # no mechanism there, or a callable that fails
                return {}
        for joint in nominal:
            largest[joint] += max(0.0, *(at[joint] - nominal[joint] for at in ends))
    return {joint: max(clearance, found.get(joint, 0.0)) for joint, clearance in largest.items()}


def _clearances(scene: Scene) -> dict[str, float]:
    return {joint.name: joint.clearance for joint in joints_with_play(scene.joints)}
