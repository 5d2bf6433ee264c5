"""The bands of a study as named arrays, for other programs, and what a file of a study holds."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...data.dataset import Dataset, Variable
from ...run.notices import as_plain
from ..band.band import Band

if TYPE_CHECKING:
    from ..results import StudyResult


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


def facts_of(result: StudyResult) -> dict[str, Any]:
    """What the file of a `StudyResult` holds besides its arrays."""
    facts: dict[str, Any] = {
        "kind_of_study": result.kind,
        "outputs": result.outputs,
        "intervals": {name: list(dataclasses.astuple(side)) for name, side in result.intervals.items()},
        "degrees": result.degrees,
        "nodes": result.nodes,
        "bounds": result.bounds,
        "requirement": None if result.requirement is None else dataclasses.asdict(result.requirement),
        "stats": [dataclasses.asdict(stats) for stats in result.stats],
        "notices": as_plain(result.notices),
        "settings": None if result.settings is None else dataclasses.asdict(result.settings),
        "scene": None if result.scene is None else json.loads(result.scene.to_json()),
        "failures": [dataclasses.asdict(failure) for failure in result.failures],
        "units": result.units,
        "seed": result.seed,
        "spec": None if result.spec is None else result.spec.facts(),
    }
    facts |= {"seconds": result.seconds, "worst_cases": [dataclasses.asdict(c) for c in result.worst_cases]}
    if result.features:
        facts |= {
            "features": result.features.names,
            "random": result.features.random,
            "uneven": result.features.uneven,
            "feature_units": result.features.units,
            "finished": result.features.finished,
        }
    return facts


def more_arrays(result: StudyResult) -> dict[str, Array]:
    """The arrays of a `StudyResult` besides those of its runs, for its file."""
    arrays: dict[str, Array] = {}
    if result.nominal_parameters is not None:
        arrays["nominal_parameters"] = result.nominal_parameters
    if result.features:
        arrays |= {"features": result.features.runs, "nominal_features": result.features.nominal}
    return arrays
