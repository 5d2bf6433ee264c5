"""MATLAB files: names that MATLAB accepts, nested structures, units beside the values."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.writing import replaced, with_default_suffix
from .dataset import Dataset
from .needed import needed

# Of MATLAB's documentation of iskeyword and namelengthmax.
_KEYWORDS = frozenset(
    "break case catch classdef continue else elseif end for function global if otherwise parfor persistent "
    "return spmd switch try while".split()
)
_LONGEST = 63
# Names at the top of the file that are not the result's.
_OURS = ("units", "about")


def matlab_name(word: str) -> str:
    """A name that MATLAB accepts for a variable or field.

    Characters other than ASCII letters, digits and the underscore become underscores; a name that does not
    begin with a letter, or is a keyword, gets ``x_`` before it; at most 63 characters are kept.

    >>> matlab_name("slider"), matlab_name("end"), matlab_name("2nd link"), matlab_name("größe")
    ('slider', 'x_end', 'x_2nd_link', 'gr__e')
    """
    name = re.sub(r"[^0-9A-Za-z_]", "_", word)
    if not re.match(r"[A-Za-z]", name) or name in _KEYWORDS:
        name = f"x_{name}"
    return name[:_LONGEST]


def to_mat(data: Dataset, path: str | os.PathLike[str]) -> Path:
    """Write everything of a dataset; see `Exports.to_mat`."""
    io = needed("scipy.io", "to_mat")
    path = with_default_suffix(path, ".mat")
    everything = structures(
        {name: _as_matlab(variable.values) for name, variable in data.variables.items()}, taken=_OURS
    )
    names = {name: variable.unit for name, variable in data.variables.items() if variable.unit}
    everything["units"] = structures(names, taken=_OURS)
    everything["about"] = structures(dict(data.facts))
    with replaced(path) as beside, beside.open("wb") as file:
        io.savemat(file, everything, long_field_names=True, do_compression=True, oned_as="column")
    return path


def structures(flat: dict[str, Any], taken: tuple[str, ...] = ()) -> dict[str, Any]:
    """Nested dictionaries from names joined by dots; two words that become the same name are made different.

    Names in `taken` are not used at the outermost level.

    >>> structures({"rod.C.x": 1, "rod.angle": 2, "rod.C!.x": 3})
    {'rod': {'C': {'x': 1}, 'angle': 2, 'C_': {'x': 3}}}
    """
    # Words that lead on are structures, beside values of the same name.
    entries: dict[tuple[str, bool], dict[str, Any]] = {}
    for name, value in flat.items():
        word, dot, rest = name.partition(".")
        entries.setdefault((word, dot != ""), {})[rest] = value
    found: dict[str, Any] = {}
    for (word, is_outer), inner in entries.items():
        found[_free(matlab_name(word), {*found, *taken})] = structures(inner) if is_outer else inner[""]
    return found


def _free(name: str, occupied: set[str]) -> str:
    """The name, or one like it that is not occupied."""
    count, free = 1, name
    while free in occupied:
        count += 1
        free = f"{name[: _LONGEST - 1 - len(str(count))]}_{count}"
    return free


def _as_matlab(values: NDArray[Any]) -> NDArray[Any]:
    """Words as a cell array, since MATLAB pads a matrix of characters."""
    return values.astype(object) if values.dtype.kind in "US" else np.asarray(values)
