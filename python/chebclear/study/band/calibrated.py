"""Bands that are calibrated on held-out runs by the core, and their verdicts."""

from __future__ import annotations

import numpy as np

from ... import _core
from ...errors import ArgumentError
from ...execution.memory import copy_output
from ...scene.scene import Interval
from ..polynomials.points import nominal_point, on_cube, unfilled
from ..polynomials.total_degree import total_degree_polynomial
from ..sources.run_table import RunTable
from .band import Band
from .margin import Margin, Method
from .requirement import Requirement


def calibrated_bands(
    runs: RunTable, intervals: dict[str, Interval], requirement: Requirement, threads: int | None = None
) -> dict[str, Band]:
    """The bands of all outputs; ValueError if a value is not finite, or there are fewer than three runs.

    First come the runs at points of the study, then included ones, the nominal run last.
    """
    t, values, parameters = runs.t, runs.values, runs.parameters
    every = np.vstack([parameters, nominal_point(intervals, runs.nominal_parameters)])
    points = on_cube(intervals, every)
    nominal, rows, angle, kept = values[-1], values[:-1], None, None
    if requirement.revolutions is not None:
        kept, angle = requirement.revolutions.kept, requirement.revolutions.angle
        parameters = np.repeat(every, kept, axis=0)
        nominal, rows = values[-1, 0], values.reshape(-1, *values.shape[2:])
        values = rows
    # What a table has no runs in is unknown; Sobol' points fill the box.
    empty = requirement.finished and bool(unfilled(points[: requirement.runs]))
    design = _core.Design(
        points, requirement.runs, requirement.coverage, requirement.independent, kept, not empty
    )
    spacing = float(t[-1] - t[0]) / (len(t) - 1)
    # One output at a time: samples in a file need not be in the memory all at once.
    column = np.empty(values.shape[:2])
    bands = {}
    for index, name in enumerate(runs.outputs):
        copy_output(values, index, column)
        try:
            band = design.band(column, requirement.limits[name], threads)
        except ValueError as error:
            raise ArgumentError(f"no band of {name}: {error}") from None
        surrogate = None
        if band["degree"] is not None and band["coefficients"] is not None:
            surrogate = total_degree_polynomial(intervals, band["degree"], band["coefficients"])
        otherwise: Method = "runs" if requirement.independent else "envelope"
        margin = Margin(
            method=otherwise if surrogate is None else "polynomial",
            degree=band["degree"],
            error=float("nan") if band["error"] is None else band["error"],
            window=band["window"] * spacing,
            inflation=band["inflation"],
            persistence=band["persistence"],
        )
        bands[name] = Band(
            name=name,
            t=t,
            lower=band["lower"],
            upper=band["upper"],
            nominal=nominal[:, index],
            hull=(column.min(axis=0), column.max(axis=0)),
            intervals=intervals,
            parameters=parameters,
            runs=rows[:, :, index],
            surrogate=surrogate,
            verdict="undersampled" if empty else requirement.verdict(margin, band["coverage"]),
            margin=margin,
            coverage=band["coverage"] * requirement.succeeded,
            whole_run=band["whole_run"] * requirement.succeeded,
            angle=angle,
        )
    return bands
