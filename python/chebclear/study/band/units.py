"""Units of bands: those of the columns of a simulation, or those that the user gave."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ...scene.columns import column_unit
from .band import Band


def with_units(bands: Mapping[str, Band], given: Mapping[str, str], *, simulated: bool) -> dict[str, Band]:
    """Bands with the units of their outputs and parameters.

    Parameters
    ----------
    bands : mapping of str to Band
        Bands without units.
    given : mapping of str to str
        Units by the names of parameters, and of outputs of a model of the user's own.
    simulated : bool
        Whether the runs are simulations, whose columns have units.
    """
    return {
        name: replace(
            band,
            unit=column_unit(name) if simulated else given.get(name, ""),
            parameter_units={one: given[one] for one in band.intervals if one in given},
        )
        for name, band in bands.items()
    }
