"""Bands that are calibrated on held-out runs by the core, and their verdicts."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.random import default_rng
from numpy.typing import NDArray

from ... import _core
from ...base.rows import Array
from ...errors import ArgumentError
from ...execution.memory import copy_output
from ...scene.scene import Interval
from ..polynomials.points import nominal_point, on_cube, unfilled
from ..polynomials.total_degree import total_degree_polynomial
from ..sources.run_table import ROUNDING, RunTable
from .band import Band
from .margin import Margin, Method
from .requirement import Requirement

# Instants at which a polynomial is checked [-], as many as those by which the core chooses its degree.
_PROBES = 128


# Long because the numbers of a band are made beside those of the core that they follow from.
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
    left_out = _checks(requirement)
    taken = np.delete(np.arange(len(points)), left_out)
    instants = np.unique(np.linspace(0, len(t) - 1, _PROBES).astype(int))

    @cache
    def fewer() -> _core.Design:
        scored = requirement.runs - len(left_out)
        return _core.Design(points[taken], scored, requirement.coverage, requirement.independent, kept)

    def check_error(column: Array, limits: tuple[float, float]) -> float:
        """Largest error of the polynomial of some runs at the others, over the width of their hull."""
        values = column[:, instants].reshape(len(points), -1, len(instants))
        known = values[taken].reshape(-1, len(instants))
        others = fewer().band(known, limits, threads)
        if others["degree"] is None or others["coefficients"] is None:
            return math.inf
        found = _core.total_degree_basis(points[left_out], others["degree"]) @ others["coefficients"]
        error = np.abs(values[left_out] - found[:, None]).max(axis=(0, 1), initial=0.0).mean()
        width = np.ptp(known, axis=0).mean()
        return 0.0 if error <= ROUNDING * np.abs(known).max() else float(error / width)

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
            checks=0 if surrogate is None else len(left_out),
            check_error=math.nan if surrogate is None else check_error(column, requirement.limits[name]),
            persistence=band["persistence"],
        )
        shown = requirement.shown(margin, band["coverage"])
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
            verdict="too few runs" if empty else requirement.flag(margin, shown),
            resolved=not empty and requirement.resolves(margin),
            margin=margin,
            coverage=shown,
            tolerated=requirement.tolerated,
            whole_run=band["whole_run"] * requirement.succeeded,
            angle=angle,
        )
    return bands


def _checks(requirement: Requirement) -> NDArray[np.intp]:
    """The runs that check a polynomial: a quarter, the last of a sequence, any of a table; none of three."""
    runs = np.arange(requirement.runs)
    order = default_rng(0).permutation(runs) if requirement.finished else runs
    return order[len(order) - len(order) // 4 :]
