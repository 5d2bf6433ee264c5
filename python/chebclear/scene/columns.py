"""Units of the outputs of runs, their limits and their meaning in words, by the names of their columns."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

Limits = tuple[float, float]
"""Lower and upper limit of a quantity, whatever the mechanism; infinite where there is none."""

FREE: Limits = (-math.inf, math.inf)
POSITIVE: Limits = (0.0, math.inf)
SHARE: Limits = (0.0, 1.0)


class _Column(NamedTuple):
    unit: str
    """SI unit."""
    words: str
    """Meaning in words."""
    joined: str
    """The word before the name of its owner."""
    limits: Limits = FREE


# Columns by the last part of the name, which is never part of a name given by the user.
_COLUMNS = {
    "x": _Column("m", "x position", "of"),
    "y": _Column("m", "y position", "of"),
    "angle": _Column("rad", "angle", "of"),
    "vx": _Column("m/s", "x velocity", "of"),
    "vy": _Column("m/s", "y velocity", "of"),
    "angular_velocity": _Column("rad/s", "angular velocity", "of"),
    "ax": _Column("m/s²", "x acceleration", "of"),
    "ay": _Column("m/s²", "y acceleration", "of"),
    "angular_acceleration": _Column("rad/s²", "angular acceleration", "of"),
    "eccentricity_x": _Column("m", "x eccentricity", "in"),
    "eccentricity_y": _Column("m", "y eccentricity", "in"),
    "eccentricity": _Column("m", "eccentricity", "in", POSITIVE),
    "penetration": _Column("m", "penetration", "in"),
    "penetration_rate": _Column("m/s", "penetration rate", "in"),
    "sliding_velocity": _Column("m/s", "sliding velocity", "in"),
    "normal_force": _Column("N", "normal force", "in", POSITIVE),
    "friction_force": _Column("N", "friction force", "in"),
    "contact": _Column("-", "contact", "in", SHARE),
    "friction_torque": _Column("N m", "friction torque", "in"),
    "friction_power": _Column("W", "friction power", "in"),
    "sticking": _Column("-", "sticking", "in", SHARE),
    "point_x": _Column("m", "x position of the contact", "in"),
    "point_y": _Column("m", "y position of the contact", "in"),
    "torque": _Column("N m", "torque", "of"),
    "force": _Column("N", "force", "of"),
    "driver_torque": _Column("N m", "torque on the driver", "of"),
    "driver_force": _Column("N", "force on the driver", "of"),
    "tooth_force": _Column("N", "tooth force", "of"),
    "tooth_force_x": _Column("N", "x tooth force", "of"),
    "tooth_force_y": _Column("N", "y tooth force", "of"),
    "transmission_error": _Column("m", "transmission error", "of"),
    "power": _Column("W", "power", "of"),
    "reaction_x": _Column("N", "x reaction", "in"),
    "reaction_y": _Column("N", "y reaction", "in"),
    "reaction_torque": _Column("N m", "reaction torque", "in"),
    "displacement": _Column("m", "displacement", "in"),
    "velocity": _Column("m/s", "velocity", "in"),
    "acceleration": _Column("m/s²", "acceleration", "in"),
    "offset": _Column("m", "offset", "in"),
    "tilt": _Column("rad", "tilt", "in"),
    "deflection": _Column("m", "deflection", "of"),
    "force_x": _Column("N", "x force", "of"),
    "force_y": _Column("N", "y force", "of"),
    "eccentricity_ratio": _Column("-", "eccentricity ratio", "in", POSITIVE),
    "film_force_x": _Column("N", "x film force", "in"),
    "film_force_y": _Column("N", "y film force", "in"),
    "film_torque": _Column("N m", "film torque", "in"),
    "film_thickness": _Column("m", "film thickness", "in"),
    "film_loss": _Column("W", "film loss", "in"),
    "length": _Column("m", "length", "of", POSITIVE),
    "lengthening": _Column("m/s", "lengthening rate", "of"),
    "impact_loss": _Column("J", "impact loss", "in", POSITIVE),
    "friction_loss": _Column("J", "friction loss", "in", POSITIVE),
    "wear": _Column("N m", "wear integral", "of", POSITIVE),
}


def column_unit(name: str) -> str:
    """SI unit of an output column; ``"-"`` for a number without one and ``""`` for an unknown column.

    >>> column_unit("slider.vx"), column_unit("energy.total")
    ('m/s', 'J')
    """
    if name.startswith("energy."):  # the only owner of that name
        return "J"
    known = _COLUMNS.get(_quantity_and_sector(name.rpartition(".")[2])[0])
    return "" if known is None else known.unit


def physical_limits(
    outputs: Sequence[str], clearances: Mapping[str, float], *, simulated: bool = True
) -> dict[str, Limits]:
    """Lower and upper limit of each output by its name, in its unit; infinite where there is none.

    The clearance of a joint [m] is the distance to contact of a concentric journal: no penetration is below
    the negative of the largest one. Of a model of the user's own, which is not `simulated`, none is known.
    """
    limits = {}
    if not simulated:
        return dict.fromkeys(outputs, FREE)
    for output in outputs:
        owner, _, quantity = output.rpartition(".")
        if owner == "energy":
            _, limits[output] = _ENERGIES.get(quantity, ("", FREE))
        elif quantity == "penetration":
            limits[output] = -clearances.get(owner, math.inf), math.inf
        else:
            known = _COLUMNS.get(_quantity_and_sector(quantity)[0])
            limits[output] = FREE if known is None else known.limits
    return limits


def _quantity_and_sector(quantity: str) -> tuple[str, str]:
    """The quantity of an output of a sector and the number of the sector; otherwise the quantity alone."""
    whole, _, sector = quantity.rpartition("_")
    return (whole, sector) if whole == "wear" and sector.isdigit() else (quantity, "")


_ENERGIES = {
    "kinetic": ("kinetic energy", POSITIVE),
    "potential": ("potential energy", FREE),
    "contact": ("elastic energy of contacts", POSITIVE),
    "total": ("total energy", FREE),
    "input": ("energy put in", FREE),
    "impact_loss": ("energy lost in impacts", POSITIVE),
    "friction_loss": ("energy lost in friction", POSITIVE),
    "damping_loss": ("energy lost in dampers", POSITIVE),
    "balance": ("error of the energy balance", FREE),
}


def column_words(name: str) -> str:
    """The meaning of an output column, in words for an axis; of an unknown column the name itself.

    >>> column_words("slider.vx"), column_words("crank_pin.normal_force"), column_words("energy.total")
    ('x velocity of slider', 'normal force in crank pin', 'total energy')
    """
    return _words(name)[0]


def column_quantity(name: str) -> str:
    """The same without the owner.

    >>> column_quantity("slider.vx"), column_quantity("energy.total")
    ('x velocity', 'total energy')
    """
    return _words(name)[1]


def _words(name: str) -> tuple[str, str]:
    """The meaning of a column in words, with its owner and without."""
    owner, _, quantity = name.rpartition(".")
    if owner == "energy" and quantity in _ENERGIES:
        words, _ = _ENERGIES[quantity]
        return words, words
    quantity, sector = _quantity_and_sector(quantity)
    if not owner or quantity not in _COLUMNS:
        return plain_words(name), plain_words(name)
    what, joined = _COLUMNS[quantity].words, _COLUMNS[quantity].joined
    where = f", sector {sector}" if sector else ""
    return f"{what} {joined} {plain_words(owner)}{where}", f"{what}{where}"


def plain_words(name: str) -> str:
    """A name without the marks of code.

    >>> plain_words("crank_pin"), plain_words("coupler.C")
    ('crank pin', 'coupler C')
    """
    return name.replace("_", " ").replace(".", " ")
