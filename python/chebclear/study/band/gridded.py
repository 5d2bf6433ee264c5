"""Bands of runs on a grid: the range of a polynomial that was fitted to them, or their extremes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...errors import ArgumentError
from ...execution.memory import extremes
from ...scene.scene import Interval
from ..polynomials.holes import fit_holes
from ..polynomials.surrogate import BoundKind, Surrogate
from .band import Band
from .judgment import judged

Array = NDArray[np.float64]


def grid_bands(
    t: Array,
    outputs: Sequence[str],
    values: Array,
    intervals: dict[str, Interval],
    parameters: Array,
    degrees: tuple[int, ...] | None,
    nodes: tuple[int, ...],
    bounds: BoundKind,
    threads: int | None,
    at: Array,
    missing: Sequence[int],
) -> dict[str, Band]:
    """The bands of all outputs.

    Parameters
    ----------
    t : ndarray, shape (samples,)
        Instants [s].
    outputs : sequence of str
        Names of the outputs.
    values : ndarray, shape (runs + 1, samples, outputs)
        All outputs of all runs in their units: those of the grid, then those beside it that check the
        polynomials, the nominal run last.
    intervals : dict of str to Interval
        Interval of each parameter [SI units].
    parameters : ndarray, shape (runs, parameters)
        Parameters of the runs [SI units].
    degrees : tuple of int or None
        Degrees to fit [-]; None takes the extremes of the runs as bounds.
    nodes : tuple of int
        Number of nodes or points of each parameter [-].
    bounds : {"range", "eq31"}
        Bounds of polynomials, see `Surrogate.bounds`.
    threads : int or None
        Threads for the ranges [-]; all processors if None.
    at : ndarray, shape (parameters,)
        Parameters of the nominal run [SI units].
    missing : sequence of int
        Numbers of the runs, of the grid first, that are not among the values.

    Raises
    ------
    ValueError
        If an output is not finite, or too few runs are left for a polynomial.
    """
    whole = len(parameters) + len(missing) if degrees is None else math.prod(nodes)
    lost = [number for number in missing if number < whole]
    holes = fit_holes(nodes, degrees, lost) if degrees is not None and lost else None
    count = whole - len(lost)
    places = np.vstack([parameters[count:], at])
    unknown = len(missing) / (len(missing) + len(parameters))
    if len(missing) > len(lost) and count == len(parameters):
        unknown = 1.0  # nothing has checked the polynomials beside their grid
    lowest, highest = extremes(values)
    inner = extremes(values[:-1]) if degrees is None else None
    bands = {}
    for index, name in enumerate(outputs):
        runs, nominal = values[:-1, :, index], values[-1, :, index]
        grid = runs[:count]
        surrogate = None
        if degrees is not None:
            if holes is not None:
                grid = holes.filled(grid)
            surrogate = Surrogate.fit(intervals, nodes, degrees, grid)
            if not np.all(np.isfinite(surrogate.terms)):
                raise ArgumentError(f"{name} is not finite in every run: no polynomial can be fitted to it")
            if holes is not None:
                kept = np.where(holes.dropped[:, None], 0.0, surrogate.terms)
                surrogate = replace(surrogate, terms=kept)
        if surrogate is None:
            assert inner is not None, "without degrees"
            lower, upper = inner[0][:, index], inner[1][:, index]
        else:
            lower, upper = surrogate.bounds(bounds, threads)
        hull = lowest[:, index], highest[:, index]
        width = float(np.mean(hull[1] - hull[0]))
        others = values[count:, :, index]
        verdict, margin = judged(surrogate, nodes, grid, others, places, width, holes, unknown)
        bands[name] = Band(
            name=name,
            t=t,
            lower=lower,
            upper=upper,
            nominal=nominal,
            hull=hull,
            intervals=intervals,
            parameters=parameters,
            runs=runs,
            surrogate=surrogate,
            verdict=verdict,
            margin=margin,
        )
    return bands
