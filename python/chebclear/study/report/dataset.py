"""The bands of a study as named arrays, for other programs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ...data.dataset import Dataset, Variable
from ...scene.columns import column_unit
from ..band.band import Band

Array = NDArray[np.float64]


def study_dataset(
    t: Array,
    bands: Mapping[str, Band],
    parameters: Mapping[str, Array],
    features: Mapping[str, Array],
    facts: Mapping[str, str | int | float],
) -> Dataset:
    """Bands and runs of a study.

    Parameters
    ----------
    t : ndarray, shape (samples,)
        Instants [s].
    bands : mapping of str to Band
        Band of each output.
    parameters : mapping of str to ndarray, shape (runs,)
        Values of each parameter in the runs [SI units].
    features : mapping of str to ndarray, shape (runs, cycles)
        Features of the runs.
    facts : mapping
        What else is known.

    Returns
    -------
    Dataset
        ``OUTPUT.lower``, ``.upper`` and ``.nominal`` over ``t``, ``OUTPUT.runs`` over ``run`` and ``t``,
        ``parameters.NAME`` over ``run``. By crank angle ``angle`` is over ``t`` and ``OUTPUT.runs`` over
        ``run``, ``cycle`` and ``t``.
    """
    variables = {"t": Variable(("t",), t, "s")}
    metadata = dict(facts)
    runs = len(next(iter(parameters.values())))
    for name, band in bands.items():
        # Outputs of a model of the user's own may have any unit, whatever their names.
        unit = column_unit(name) if "scene" in facts else ""
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
    variables |= {f"parameters.{name}": Variable(("run",), values) for name, values in parameters.items()}
    variables |= {f"features.{name}": Variable(("run", "cycle"), values) for name, values in features.items()}
    return Dataset("t", variables, metadata)
