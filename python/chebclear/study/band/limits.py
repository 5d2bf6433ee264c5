"""Physical limits of outputs, for all values of the parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

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

    Parameters
    ----------
    outputs : sequence of str
        Names of the outputs.
    clearances : mapping of str to float
        Largest clearance of each joint in the box [m]: the distance to contact of a concentric journal, so
        that no penetration is below its negative.

    Examples
    --------
    >>> physical_limits(["wrist.normal_force", "wrist.penetration"], {"wrist": 2e-5})
    {'wrist.normal_force': (0.0, inf), 'wrist.penetration': (-2e-05, inf)}
    """
    limits = {}
    for output in outputs:
        owner, _, quantity = output.rpartition(".")
        if quantity == "penetration" and owner in clearances:
            limits[output] = (-clearances[owner], math.inf)
        else:
            limits[output] = _ENERGIES.get(output) or _LIMITS.get(quantity, _NONE)
    return limits
