"""The bands of a study as named arrays, for other programs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...data.dataset import Dataset, Variable
from ..band.band import Band

if TYPE_CHECKING:
    pass


Array = NDArray[np.float64]


def study_dataset(
    t: Array,
    bands: Mapping[str, Band],
    parameters: Mapping[str, Array],
    features: Mapping[str, Array],
    units: Mapping[str, str],
    facts: Mapping[str, str | int | float],
) -> Dataset:
    """Bands, runs, parameters and features of a study with their units; see `StudyResult.dataset`.

    By crank angle ``angle`` is over ``t`` and ``OUTPUT.runs`` over ``run``, ``cycle`` and ``t``.
    """
    variables = {"t": Variable(("t",), t, "s")}
    metadata = dict(facts)
    runs = len(next(iter(parameters.values())))
    for name, band in bands.items():
        unit = band.unit
        for side in ("lower", "upper", "nominal"):
            variables[f"{name}.{side}"] = Variable(("t",), getattr(band, side), unit)
        if band.angle is None:
            variables[f"{name}.runs"] = Variable(("run", "t"), band.runs, unit)
        else:
            variables["angle"] = Variable(("t",), band.angle, "rad")
            rows = band.runs.reshape(runs + 1, -1, len(t))[:-1]
            variables[f"{name}.runs"] = Variable(("run", "cycle", "t"), rows, unit)
        metadata[f"{name}.verdict"] = band.verdict
        if band.coverage == band.coverage:  # not NaN
            metadata[f"{name}.coverage"] = band.coverage
    for name, values in parameters.items():
        variables[f"parameters.{name}"] = Variable(("run",), values, units.get(name, ""))
    for name, values in features.items():
        variables[f"features.{name}"] = Variable(("run", "cycle"), values, units.get(name, ""))
    return Dataset("t", variables, metadata)
