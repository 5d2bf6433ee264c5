"""Bands of runs on a grid: the range of a polynomial that was fitted to them, or their extremes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...base.rows import Array
from ...errors import ArgumentError
from ...execution.memory import extremes
from ...scene.columns import physical_limits
from ...scene.scene import Interval
from ..polynomials.holes import HoleFit, fit_holes, left_out_error
from ..polynomials.points import nominal_point
from ..polynomials.surrogate import BoundKind, Surrogate, time_blocks
from ..sources.run_table import ROUNDING, RunTable
from .band import Band
from .margin import RESOLVED, Margin


@dataclass(frozen=True)
class Grid:
    """A grid of Chebyshev roots or equally spaced values, with others that check polynomials; or a sample."""

    kind: str
    """``"chebyshev"``, ``"scan"`` or ``"sample"``."""
    nodes: tuple[int, ...]
    """Number of roots or values of each parameter; of a sample, of all points."""
    degrees: tuple[int, ...] | None = None
    """Degrees of the polynomials; None if the extremes of the runs are the bounds."""
    bounds: BoundKind = "range"
    """How polynomials are bounded."""
    random: bool = False
    """Whether the points are independent and uniform in the box."""
    seed: int | None = None
    """Seed of a sample."""


def grid_bands(
    runs: RunTable, intervals: dict[str, Interval], grid: Grid, threads: int | None
) -> dict[str, Band]:
    """The bands of all outputs of runs on a grid, which come first, then those beside it that check the
    polynomials, the nominal run last.

    Without degrees the extremes of the runs are the bounds. ValueError is raised if an output is not finite,
    or too few runs are left for a polynomial."""
    degrees, nodes = grid.degrees, grid.nodes
    values, parameters, missing = runs.values, runs.parameters, [one.index for one in runs.failures]
    whole = len(parameters) + len(missing) if degrees is None else math.prod(nodes)
    lost = [number for number in missing if number < whole]
    holes = fit_holes(nodes, degrees, lost) if degrees is not None and lost else None
    count = whole - len(lost)
    places = np.vstack([parameters[count:], nominal_point(intervals, runs.nominal_parameters)])
    unknown = len(missing) / (len(missing) + len(parameters))
    if len(missing) > len(lost) and count == len(parameters):
        unknown = 1.0  # nothing has checked the polynomials beside their grid
    lowest, highest = extremes(values)
    inner = extremes(values[:-1]) if degrees is None else None
    limits = physical_limits(runs.outputs, {}, simulated=runs.scene is not None)
    bands = {}
    for index, name in enumerate(runs.outputs):
        own, hull = values[:-1, :, index], (lowest[:, index], highest[:, index])
        surrogate: Surrogate | None = None
        resolved = False
        margin = Margin("runs")
        if degrees is None:
            assert inner is not None, "without degrees"
            lower, upper = inner[0][:, index], inner[1][:, index]
        else:
            fitted = own[:count] if holes is None else holes.filled(own[:count])
            surrogate = Surrogate.fit(intervals, nodes, degrees, fitted)
            if not np.all(np.isfinite(surrogate.terms)):
                raise ArgumentError(f"{name} is not finite in every run: no polynomial can be fitted to it")
            if holes is not None:
                kept = np.where(holes.dropped[:, None], 0.0, surrogate.terms)
                surrogate = replace(surrogate, terms=kept)
            # What the polynomial does beyond a limit the output does not.
            lower, upper = (np.clip(end, *limits[name]) for end in surrogate.bounds(grid.bounds, threads))
            width = float(np.mean(hull[1] - hull[0]))
            others = values[count:, :, index]
            resolved, margin = judged(surrogate, nodes, fitted, others, places, width, holes, unknown)
        bands[name] = Band(
            name=name,
            t=runs.t,
            lower=lower,
            upper=upper,
            nominal=values[-1, :, index],
            hull=hull,
            intervals=intervals,
            parameters=parameters,
            runs=own,
            surrogate=surrogate,
            verdict="estimated" if resolved else "unknown",
            resolved=resolved,
            margin=margin,
        )
    return bands


def judged(
    surrogate: Surrogate,
    nodes: Sequence[int],
    grid: Array,
    others: Array,
    at: Array,
    width: float,
    holes: HoleFit | None = None,
    unknown: float = 0.0,
) -> tuple[bool, Margin]:
    """Whether a polynomial follows the response, and its margin.

    It is judged by the runs of its grid, the others, and their mean width. What is `unknown` of the box, a
    share of the runs, counts like what is not known of the width. Of runs in `holes` the error is assumed to
    be larger by the condition number of the least squares.
    """
    errors = fit_error(surrogate, nodes, grid, others, at)
    if holes is not None:
        left_out = holes.left_out(grid[holes.known])
        errors = holes.condition * np.maximum(errors, left_out.max(axis=0))
    miss = float(np.mean(errors))
    # Rounding errors of the runs must not count for a constant output.
    noise = ROUNDING * float(max(np.max(grid, initial=0.0), -np.min(grid, initial=0.0)))
    error = 0.0 if miss <= noise else miss / width if width > 0.0 else math.inf
    return max(error, unknown) <= RESOLVED, Margin("polynomial", degree=max(surrogate.degrees), error=error)


def fit_error(surrogate: Surrogate, nodes: Sequence[int], grid: Array, others: Array, at: Array) -> Array:
    """Estimated error of a polynomial that was fitted on Chebyshev roots, shape (samples,).

    The largest of: that of nodes predicted from the others of their line, half of that with one degree less,
    and that at the `others`, runs `at` no nodes, where waves show that the nodes do not see. The
    documentation of decisions compares it with what polynomials miss.
    """
    found = surrogate.evaluate(dict(zip(surrogate.intervals, at.T, strict=True)))
    error: Array = np.abs(found - others).max(axis=0)
    for block in time_blocks(*grid.shape):
        error[block] = np.maximum(error[block], left_out_error(surrogate.degrees, nodes, grid[:, block]))
    return error
