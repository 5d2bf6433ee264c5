"""xarray datasets."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .dataset import Dataset
from .needed import needed

if TYPE_CHECKING:
    import xarray


def to_xarray(data: Dataset) -> xarray.Dataset:
    """Everything of a dataset; see `Exports.to_xarray`."""
    library = needed("xarray", "to_xarray")
    variables = {
        name: (variable.dimensions, variable.values.copy(), {"units": variable.unit} if variable.unit else {})
        for name, variable in data.variables.items()
    }
    # What is named like its own axis, and the parameters of the runs, are coordinates: labels of the data.
    labels = [
        name
        for name, variable in data.variables.items()
        if variable.dimensions == (name,) or name.startswith("parameters.")
    ]
    dataset: xarray.Dataset = library.Dataset(variables, attrs=dict(data.facts)).set_coords(labels)
    return dataset
