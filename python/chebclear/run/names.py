"""Columns by their names, with suggestions for names of outputs that do not exist."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..base.shown import did_you_mean, listed, meant_or_known, suggested, synonyms
from ..errors import UnknownNameError

if TYPE_CHECKING:
    from ..scene.scene import Scene


def output_meant(name: object, columns: Sequence[str]) -> str:
    """Outputs that may be meant by an unknown name, those of the part that it names first, or what there is.

    >>> output_meant("slider.velocity", ["slider.vx", "slider.vy", "guide.velocity"])
    '; did you mean "slider.vx" or "slider.vy"?'
    >>> output_meant("pin.normal_force", ["pin.left.normal_force", "pin.right.normal_force"])
    '; did you mean "pin.left.normal_force" or "pin.right.normal_force"?'
    >>> output_meant("piston.ax", ["slider.vx", "slider.vy", "guide.velocity"])
    '; there are outputs of slider, guide'
    """
    name = str(name)  # an array would be compared entry by entry
    if outputs := [column for column in columns if column.rpartition(".")[0] == name]:
        return f"; its outputs are {listed(outputs, most=12)}"  # of a body or a joint alone
    owner, _, quantity = name.rpartition(".")
    # The force of a joint that touches in several places is one of each.
    several = [one for one in columns if one.startswith(f"{owner}.") and one.endswith(f".{quantity}")]
    own = {column.rpartition(".")[2]: column for column in columns if column.rpartition(".")[0] == owner}
    if known := (several if owner else []) or [own[one] for one in synonyms(quantity, own)]:
        return suggested(known)
    if near := did_you_mean(name, own.values() if own else columns):
        return near
    if own:
        return meant_or_known(name, own.values(), most=40)
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
    raise UnknownNameError(f'unknown column "{name}"{output_meant(name, known or columns)}')
