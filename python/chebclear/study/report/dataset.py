"""The bands of a study as named arrays, for other programs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ...data.dataset import Dataset, Variable
from ...run.settings import common_facts

if TYPE_CHECKING:
    from ..results import StudyResult


def study_dataset(result: StudyResult) -> Dataset:
    """Bands, runs, parameters and features of a study with their units; see `StudyResult.dataset`.

    By crank angle ``angle`` is over ``t`` and ``OUTPUT.runs`` over ``run``, ``cycle`` and ``t``.
    """
    table, variables = result.features, {"t": Variable(("t",), result.t, "s")}
    facts: dict[str, str | int | float] = {"kind": result.kind, "runs": len(result.parameters)}
    facts |= common_facts(result.settings, result.scene, result.warnings)
    for name, band in result.bands.items():
        for side in ("lower", "upper", "nominal"):
            variables[f"{name}.{side}"] = Variable(("t",), getattr(band, side), band.unit)
        axes: tuple[str, ...] = ("run", "t")
        if band.angle is not None:
            axes = ("run", "cycle", "t")
            variables["angle"] = Variable(("t",), band.angle, "rad")
        variables[f"{name}.runs"] = Variable(axes, result.values(name), band.unit)
        facts[f"{name}.verdict"] = band.verdict
        if not math.isnan(band.coverage):
            facts[f"{name}.coverage"] = band.coverage
    for name, values in zip(result.parameter_names, result.parameters.T, strict=True):
        variables[f"parameters.{name}"] = Variable(("run",), values, result.units.get(name, ""))
    units = dict(zip(table.names, table.units, strict=False))
    for k, name in enumerate(table.names):
        variables[f"features.{name}"] = Variable(("run", "cycle"), table.runs[:, :, k], units.get(name, ""))
    return Dataset("t", variables, facts)
