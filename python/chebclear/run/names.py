"""Suggestions for names of outputs that do not exist."""

from __future__ import annotations

from collections.abc import Sequence

from ..base.arguments import did_you_mean

_VELOCITIES = (
    ("vx", "vy"),
    ("angular_velocity",),
    ("lengthening",),
    ("penetration_rate", "sliding_velocity"),
)
_FORCES = (("normal_force", "friction_force"), ("reaction_x", "reaction_y"))
# Names of outputs in other programs and textbooks, with the groups that they may mean; the first group of
# which a part has an output is suggested.
_MEANT: dict[str, tuple[tuple[str, ...], ...]] = {
    "position": (("x", "y"), ("displacement",), ("angle",)),
    "velocity": _VELOCITIES,
    "v": _VELOCITIES,
    "speed": _VELOCITIES,
    "acceleration": (("ax", "ay"), ("angular_acceleration",)),
    "a": (("ax", "ay"), ("angular_acceleration",)),
    "rotation": (("angle",),),
    "theta": (("angle",),),
    "phi": (("angle",),),
    "omega": (("angular_velocity",),),
    "alpha": (("angular_acceleration",),),
    "force": _FORCES,
    "reaction": (("reaction_x", "reaction_y"),),
    "friction": (("friction_force",),),
    "torque": (("reaction_torque",),),
    "moment": (("torque",), ("reaction_torque",)),
    "depth": (("penetration",),),
    "indentation": (("penetration",),),
}


def output_meant(name: object, columns: Sequence[str]) -> str:
    """``'; did you mean "..."?'`` for an unknown name of an output, or nothing.

    Quantities of the named part come before similar names of other parts.

    Examples
    --------
    >>> output_meant("slider.velocity", ["slider.vx", "slider.vy", "guide.velocity"])
    '; did you mean "slider.vx" or "slider.vy"?'
    """
    owner, _, quantity = str(name).rpartition(".")
    own = [column for column in columns if column.rpartition(".")[0] == owner]
    for group in _MEANT.get(quantity.lower(), ()):
        known = [f'"{owner}.{other}"' for other in group if f"{owner}.{other}" in own]
        if known:
            return f"; did you mean {' or '.join(known)}?"
    return did_you_mean(name, own) or did_you_mean(name, columns)
