"""A run as named arrays, for other programs."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.files import package_version
from ..base.units import units
from ..data.dataset import Dataset, Variable, records
from ..scene.columns import column_unit
from ..scene.scene import Scene
from .settings import Settings

Array = NDArray[np.float64]


def run_dataset(
    t: Array, columns: Sequence[str], values: Array, tables: Mapping[str, Any], facts: Mapping[str, Any]
) -> Dataset:
    """The samples and the tables of contacts of a run.

    Parameters
    ----------
    t : ndarray, shape (samples,)
        Instants [s].
    columns : sequence of str
        Names of the columns.
    values : ndarray, shape (samples, columns)
        In the units of the columns.
    tables : mapping of str to records
        Records of equally long columns: ``events``, ``contacts``, ...
    facts : mapping
        Further facts.

    Returns
    -------
    Dataset
    """
    variables = {"t": Variable(("t",), t, "s")}
    variables |= {
        name: Variable(("t",), column, column_unit(name))
        for name, column in zip(columns, values.T, strict=True)
    }
    for name, table in tables.items():
        variables |= records(name, name, table, units(type(table)))
    return Dataset("t", variables, dict(facts))


def common_facts(
    settings: Settings | None, scene: Scene | None, warnings: Sequence[str]
) -> dict[str, str | int | float]:
    """Facts common to all results: versions, settings, warnings and the scene, if a result has them."""
    metadata: dict[str, str | int | float] = {"chebclear": package_version(), "warnings": "\n".join(warnings)}
    if settings is not None:
        plain = dataclasses.asdict(settings)
        metadata |= {name: value for name, value in plain.items() if isinstance(value, str | int | float)}
    if scene is not None:
        metadata["scene"] = scene.to_json()
    return metadata
