"""Units of the outputs of runs, by the names of their columns."""

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
