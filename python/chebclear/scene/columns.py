"""Units of the outputs of runs, and what they are in words, by the names of their columns."""

from __future__ import annotations

# SI unit of a column, by the last part of its name.
_UNITS = {
    "x": "m",
    "y": "m",
    "angle": "rad",
    "vx": "m/s",
    "vy": "m/s",
    "angular_velocity": "rad/s",
    "ax": "m/s²",
    "ay": "m/s²",
    "angular_acceleration": "rad/s²",
    "eccentricity_x": "m",
    "eccentricity_y": "m",
    "eccentricity": "m",
    "penetration": "m",
    "penetration_rate": "m/s",
    "sliding_velocity": "m/s",
    "normal_force": "N",
    "friction_force": "N",
    "contact": "-",
    "torque": "N m",
    "force": "N",
    "power": "W",
    "reaction_x": "N",
    "reaction_y": "N",
    "reaction_torque": "N m",
    "displacement": "m",
    "velocity": "m/s",
    "acceleration": "m/s²",
    "length": "m",
    "lengthening": "m/s",
    "impact_loss": "J",
    "friction_loss": "J",
    "wear": "N m",
}


def column_unit(name: str) -> str:
    """SI unit of an output column.

    Parameters
    ----------
    name : str
        Column name such as ``"slider.vx"``.

    Returns
    -------
    str
        The unit, ``"-"`` for a number without one and ``""`` for a column that is not known here.

    Examples
    --------
    >>> column_unit("slider.vx"), column_unit("energy.total")
    ('m/s', 'J')
    """
    if name.startswith("energy."):  # the only owner of that name
        return "J"
    return _UNITS.get(name.rpartition(".")[2], "")


# What a column is, in words, by the last part of its name; the owner follows.
_WORDS = {
    "x": "x position of",
    "y": "y position of",
    "angle": "angle of",
    "vx": "x velocity of",
    "vy": "y velocity of",
    "angular_velocity": "angular velocity of",
    "ax": "x acceleration of",
    "ay": "y acceleration of",
    "angular_acceleration": "angular acceleration of",
    "eccentricity_x": "x eccentricity in",
    "eccentricity_y": "y eccentricity in",
    "eccentricity": "eccentricity in",
    "penetration": "penetration in",
    "penetration_rate": "penetration rate in",
    "sliding_velocity": "sliding velocity in",
    "normal_force": "normal force in",
    "friction_force": "friction force in",
    "contact": "contact in",
    "torque": "torque of",
    "force": "force of",
    "power": "power of",
    "reaction_x": "x reaction in",
    "reaction_y": "y reaction in",
    "reaction_torque": "reaction torque in",
    "displacement": "displacement in",
    "velocity": "velocity in",
    "acceleration": "acceleration in",
    "length": "length of",
    "lengthening": "lengthening rate of",
    "impact_loss": "impact loss in",
    "friction_loss": "friction loss in",
    "wear": "wear integral of",
}
_ENERGIES = {
    "kinetic": "kinetic energy",
    "potential": "potential energy",
    "contact": "elastic energy of contacts",
    "total": "total energy",
    "input": "energy put in",
    "impact_loss": "energy lost in impacts",
    "friction_loss": "energy lost in friction",
    "damping_loss": "energy lost in dampers",
    "balance": "energy that does not balance",
}


def column_words(name: str) -> str:
    """What an output column is, in words for an axis.

    Parameters
    ----------
    name : str
        Column name such as ``"slider.vx"``.

    Returns
    -------
    str
        The words; of a column that is not known here the name itself.

    Examples
    --------
    >>> column_words("slider.vx"), column_words("crank_pin.normal_force"), column_words("energy.total")
    ('x velocity of slider', 'normal force in crank pin', 'total energy')
    """
    owner, _, quantity = name.rpartition(".")
    if owner == "energy" and quantity in _ENERGIES:
        return _ENERGIES[quantity]
    if not owner or quantity not in _WORDS:
        return plain_words(name)
    return f"{_WORDS[quantity]} {plain_words(owner)}"


def plain_words(name: str) -> str:
    """A name without the marks of code.

    Examples
    --------
    >>> plain_words("crank_pin"), plain_words("coupler.C")
    ('crank pin', 'coupler C')
    """
    return name.replace("_", " ").replace(".", " ")
