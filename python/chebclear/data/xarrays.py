"""xarray datasets, under names that netCDF accepts."""

from __future__ import annotations

import re
import unicodedata
from typing import TYPE_CHECKING, Any

from ..base.writing import distinct
from .dataset import Dataset
from .needed import needed

if TYPE_CHECKING:
    import xarray

# Of the NetCDF Users Guide: the types of its classic format and of its data model.
_TYPES = frozenset(
    "byte char short ushort int uint int64 uint64 float real double bool string opaque enum".split()
)


def netcdf_name(name: str) -> str:
    """A name that netCDF accepts for a dimension, a variable or an attribute.

    Slashes, quotes, control characters and letters beyond Latin-1, which SciPy cannot write, become
    underscores; a name that does not begin with a letter, a digit or an underscore gets an underscore before
    it, a type or a name that ends with a blank one after it.

    >>> netcdf_name("slider.x"), netcdf_name("N/mm"), netcdf_name("$x"), netcdf_name("float")
    ('slider.x', 'N_mm', '_$x', 'float_')
    """
    name = re.sub(r"[/'\x00-\x1f\x7f-\x9f]|[^\x00-\xff]", "_", unicodedata.normalize("NFC", name))
    if not re.match(r"[0-9A-Za-z_\xa0-\xff]", name):
        name = f"_{name}"
    return f"{name}_" if name in _TYPES or name.endswith(" ") else name


def to_xarray(data: Dataset) -> xarray.Dataset:
    """Everything of a dataset; see `Exports.to_xarray`."""
    library = needed("xarray", "to_xarray")
    dimensions = [name for variable in data.variables.values() for name in variable.dimensions]
    given = distinct([*dimensions, *data.variables], netcdf_name)
    variables: dict[str, Any] = {}
    # What is named like its own axis, and the parameters of the runs, are coordinates: labels of the data.
    labels: list[str] = []
    for name, variable in data.variables.items():
        about = {"units": variable.unit} if variable.unit else {}
        if given[name] != name:
            about["long_name"] = name
        axes = tuple(given[axis] for axis in variable.dimensions)
        variables[given[name]] = (axes, variable.values.copy(), about)
        if variable.dimensions == (name,) or name.startswith("parameters."):
            labels.append(given[name])
    facts = distinct(data.facts, netcdf_name)
    attributes = {facts[name]: value for name, value in data.facts.items()}
    dataset: xarray.Dataset = library.Dataset(variables, attrs=attributes).set_coords(labels)
    return dataset
