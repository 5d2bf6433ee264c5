"""Columns by their names, with suggestions for names of outputs that do not exist."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..base.arguments import did_you_mean, meant_or_known
from ..errors import UnknownNameError

if TYPE_CHECKING:
    from ..scene.scene import Scene

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

_ABBREVIATED = {
    "pos": "position",
    "vel": "velocity",
    "acc": "acceleration",
    "accel": "acceleration",
    "rot": "rotation",
}

# Outputs of a part that are listed.
_MOST = 12


def near_output(name: object, columns: Sequence[str]) -> str:
    """``'; did you mean "..."?'`` for an unknown name of an output, the outputs of a part, or nothing.

    Quantities of the named part come before similar names of other parts.
    """
    name = str(name)  # an array would be compared entry by entry
    outputs = [column for column in columns if column.rpartition(".")[0] == name]
    if outputs:  # the name of a body or a joint alone
        more = f" and {len(outputs) - _MOST} more" if len(outputs) > _MOST else ""
        return f"; its outputs are {', '.join(outputs[:_MOST])}{more}"
    owner, _, quantity = str(name).rpartition(".")
    of_parts = [
        f'"{column}"'
        for column in columns
        if column.startswith(f"{owner}.") and column.endswith(f".{quantity}")
    ]
    if owner and of_parts:  # the force of a joint that touches in several places
        return f"; did you mean {' or '.join(of_parts)}?"
    own = [column for column in columns if column.rpartition(".")[0] == owner]
    meant = _MEANT.get(quantity.lower()) or _MEANT.get(_ABBREVIATED.get(quantity.lower(), ""), ())
    for group in meant:
        known = [f'"{owner}.{other}"' for other in group if f"{owner}.{other}" in own]
        if known:
            return f"; did you mean {' or '.join(known)}?"
    return did_you_mean(name, own) or did_you_mean(name, [] if own else columns)


def output_meant(name: object, columns: Sequence[str]) -> str:
    """What :func:`near_output` says, or else what there is.

    >>> output_meant("slider.velocity", ["slider.vx", "slider.vy", "guide.velocity"])
    '; did you mean "slider.vx" or "slider.vy"?'
    >>> output_meant("pin.normal_force", ["pin.left.normal_force", "pin.right.normal_force"])
    '; did you mean "pin.left.normal_force" or "pin.right.normal_force"?'
    >>> output_meant("piston.ax", ["slider.vx", "slider.vy", "guide.velocity"])
    '; there are outputs of slider, guide'
    """
    if near := near_output(name, columns):
        return near
    owner = str(name).rpartition(".")[0]
    if own := [column for column in columns if column.rpartition(".")[0] == owner]:
        return meant_or_known(name, own, most=40)
    owners = list(dict.fromkeys(column.rpartition(".")[0] or column for column in columns))
    return f"; there are outputs of {', '.join(owners)}" if owners else "; there is none"


def column_index(columns: Sequence[str], name: str, scene: Scene | None = None) -> int:
    """Index of a column; a KeyError that suggests the nearest name of the scene if there is none."""
    if isinstance(name, str) and name in columns:
        return columns.index(name)
    facts = None if scene is None else scene.check()
    known = () if facts is None else facts.columns + facts.further_columns
    sectors = () if facts is None else facts.sector_columns
    if isinstance(name, str) and (name in known or name in sectors):
        raise UnknownNameError(f'"{name}" was not recorded: add it to the outputs')
    hint = near_output(name, columns) or output_meant(name, known or columns)
    raise UnknownNameError(f'unknown column "{name}"{hint}')
