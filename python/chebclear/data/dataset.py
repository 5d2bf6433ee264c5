"""Named arrays with units: the common form of all results for other programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.files import package_version

_NO_FACTS: Mapping[str, str | int | float] = MappingProxyType({})


@dataclass(frozen=True)
class Variable:
    """One array of a dataset."""

    dimensions: tuple[str, ...]
    """Name of each axis."""
    values: NDArray[Any]
    """Numbers or words, one axis for each dimension."""
    unit: str = ""
    """Unit of the numbers; ``"-"`` for a number without one and ``""`` where none is known."""

    def __post_init__(self) -> None:
        if self.values.ndim != len(self.dimensions):
            raise ValueError(f"{self.values.ndim} axes are not the dimensions {self.dimensions}")


@dataclass(frozen=True)
class Dataset:
    """Named arrays over shared axes, the first of which is that of the table."""

    axis: str
    """Dimension of the table, which has a variable of the same name, as ``"t"``."""
    variables: dict[str, Variable]
    """The arrays by name; words joined by dots, as ``"slider.x.lower"``."""
    facts: dict[str, str | int | float] = field(default_factory=dict)
    """What else is known: status, settings, versions, the scene as JSON."""

    def table(self) -> dict[str, NDArray[Any]]:
        """The arrays along the axis alone, by name; the axis itself comes first."""
        names = [name for name, variable in self.variables.items() if variable.dimensions == (self.axis,)]
        names.sort(key=lambda name: name != self.axis)
        return {name: self.variables[name].values for name in names}

    def unit(self, name: str) -> str:
        """Unit of a variable by its name."""
        return self.variables[name].unit


def records(prefix: str, dimension: str, table: object, units: dict[str, str]) -> dict[str, Variable]:
    """The arrays of a dataclass of equally long columns along a dimension, named ``"PREFIX.FIELD"``."""
    return {
        f"{prefix}.{name}": Variable((dimension,), np.asarray(column), units.get(name, ""))
        for name, column in vars(table).items()
        if isinstance(column, np.ndarray)
    }


def facts_of(record: Any) -> dict[str, str | int | float]:
    """What else is known of a result: its fields that are numbers or words, its warnings, and the version."""
    values = {item.name: getattr(record, item.name) for item in fields(record)}
    # netCDF has no truth values.
    facts = {
        name: int(value) if isinstance(value, bool) else value
        for name, value in values.items()
        if isinstance(value, str | int | float)
    }
    return {"chebclear": package_version(), "warnings": "\n".join(getattr(record, "warnings", ())), **facts}


def numbered(
    axis: str,
    columns: Mapping[str, Sequence[Any]],
    units: Mapping[str, str],
    facts: Mapping[str, str | int | float] = _NO_FACTS,
) -> Dataset:
    """Rows of a table of numbers or words, counted along its axis; a None among numbers becomes NaN."""
    variables: dict[str, Variable] = {}
    for name, column in columns.items():
        numbers = all(entry is None or isinstance(entry, int | float) for entry in column)
        values = np.array(column, dtype=float) if numbers and None in column else np.array(column)
        variables[name] = Variable((axis,), values, units.get(name, ""))
    count = len(next(iter(columns.values())))
    return Dataset(axis, {axis: Variable((axis,), np.arange(count), "-"), **variables}, dict(facts))
