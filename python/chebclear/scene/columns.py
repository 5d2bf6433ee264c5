"""Units of the outputs of runs, their limits and their meaning in words, by the names of their columns."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

# SI unit of a column, its meaning in words and the word before the name of its owner, by the last part of the
# name.
_COLUMNS = {
    "x": ("m", "x position", "of"),
    "y": ("m", "y position", "of"),
    "angle": ("rad", "angle", "of"),
    "vx": ("m/s", "x velocity", "of"),
    "vy": ("m/s", "y velocity", "of"),
    "angular_velocity": ("rad/s", "angular velocity", "of"),
    "ax": ("m/s²", "x acceleration", "of"),
    "ay": ("m/s²", "y acceleration", "of"),
    "angular_acceleration": ("rad/s²", "angular acceleration", "of"),
    "eccentricity_x": ("m", "x eccentricity", "in"),
    "eccentricity_y": ("m", "y eccentricity", "in"),
    "eccentricity": ("m", "eccentricity", "in"),
    "penetration": ("m", "penetration", "in"),
    "penetration_rate": ("m/s", "penetration rate", "in"),
    "sliding_velocity": ("m/s", "sliding velocity", "in"),
    "normal_force": ("N", "normal force", "in"),
    "friction_force": ("N", "friction force", "in"),
    "contact": ("-", "contact", "in"),
    "friction_torque": ("N m", "friction torque", "in"),
    "friction_power": ("W", "friction power", "in"),
    "sticking": ("-", "sticking", "in"),
    "point_x": ("m", "x position of the contact", "in"),
    "point_y": ("m", "y position of the contact", "in"),
    "torque": ("N m", "torque", "of"),
    "force": ("N", "force", "of"),
    "driver_torque": ("N m", "torque on the driver", "of"),
    "driver_force": ("N", "force on the driver", "of"),
    "tooth_force": ("N", "tooth force", "of"),
    "tooth_force_x": ("N", "x tooth force", "of"),
    "tooth_force_y": ("N", "y tooth force", "of"),
    "transmission_error": ("m", "transmission error", "of"),
    "power": ("W", "power", "of"),
    "reaction_x": ("N", "x reaction", "in"),
    "reaction_y": ("N", "y reaction", "in"),
    "reaction_torque": ("N m", "reaction torque", "in"),
    "displacement": ("m", "displacement", "in"),
    "velocity": ("m/s", "velocity", "in"),
    "acceleration": ("m/s²", "acceleration", "in"),
    "offset": ("m", "offset", "in"),
    "tilt": ("rad", "tilt", "in"),
    "deflection": ("m", "deflection", "of"),
    "force_x": ("N", "x force", "of"),
    "force_y": ("N", "y force", "of"),
    "eccentricity_ratio": ("-", "eccentricity ratio", "in"),
    "film_force_x": ("N", "x film force", "in"),
    "film_force_y": ("N", "y film force", "in"),
    "film_torque": ("N m", "film torque", "in"),
    "film_thickness": ("m", "film thickness", "in"),
    "film_loss": ("W", "film loss", "in"),
    "length": ("m", "length", "of"),
    "lengthening": ("m/s", "lengthening rate", "of"),
    "impact_loss": ("J", "impact loss", "in"),
    "friction_loss": ("J", "friction loss", "in"),
    "wear": ("N m", "wear integral", "of"),
}


def column_unit(name: str) -> str:
    """SI unit of an output column; ``"-"`` for a number without one and ``""`` for an unknown column.

    >>> column_unit("slider.vx"), column_unit("energy.total")
    ('m/s', 'J')
    """
    if name.startswith("energy."):  # the only owner of that name
        return "J"
    return _COLUMNS.get(_quantity_and_sector(name.rpartition(".")[2])[0], ("",))[0]


# Limits by the last part of the name of an output, which is never part of a name given by the user, and of
# outputs of the whole mechanism; "energy" cannot be the name of a part.
_POSITIVE = ("normal_force", "eccentricity", "impact_loss", "friction_loss", "damping_loss", "wear", "length")
_POSITIVE_ENERGIES = ("energy.kinetic", "energy.contact")


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
        lower, upper = -math.inf, math.inf
        if quantity == "penetration":
            lower = -clearances.get(owner, math.inf)
        elif quantity == "contact" and owner != "energy":
            lower, upper = 0.0, 1.0
        elif quantity in _POSITIVE or output in _POSITIVE_ENERGIES:
            lower = 0.0
        limits[output] = lower, upper
    return limits


def _quantity_and_sector(quantity: str) -> tuple[str, str]:
    """The quantity of an output of a sector and the number of the sector; otherwise the quantity alone."""
    whole, _, sector = quantity.rpartition("_")
    return (whole, sector) if whole == "wear" and sector.isdigit() else (quantity, "")


_ENERGIES = {
    "kinetic": "kinetic energy",
    "potential": "potential energy",
    "contact": "elastic energy of contacts",
    "total": "total energy",
    "input": "energy put in",
    "impact_loss": "energy lost in impacts",
    "friction_loss": "energy lost in friction",
    "damping_loss": "energy lost in dampers",
    "balance": "error of the energy balance",
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
        return _ENERGIES[quantity], _ENERGIES[quantity]
    quantity, sector = _quantity_and_sector(quantity)
    if not owner or quantity not in _COLUMNS:
        return plain_words(name), plain_words(name)
    _, what, joined = _COLUMNS[quantity]
    where = f", sector {sector}" if sector else ""
    return f"{what} {joined} {plain_words(owner)}{where}", f"{what}{where}"


def plain_words(name: str) -> str:
    """A name without the marks of code.

    >>> plain_words("crank_pin"), plain_words("coupler.C")
    ('crank pin', 'coupler C')
    """
    return name.replace("_", " ").replace(".", " ")
