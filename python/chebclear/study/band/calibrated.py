"""Bands that are calibrated on held-out runs by the core: required coverage, verdicts and warnings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ... import _core
from ...base.named import ReadOnlyDict
from ...base.units import unit
from ...errors import ArgumentError
from ...execution.memory import Usage, copy_output
from ...scene.scene import Interval
from ..polynomials.points import leaves_out, nominal_point, on_cube
from ..polynomials.total_degree import total_degree_polynomial
from .band import Band
from .independent import exact_runs, mean_share, tolerated_share
from .margin import Margin, Method, Verdict, percent
from .revolutions import Revolutions

Array = NDArray[np.float64]

# Related to the least number of held-out runs that can verify a share of 0.1 %; see `needed_runs`.
_UNSEEN = 0.0112
# Persistence from which the runs and not their samples are the observations. Chains of pendulums with one
# parameter reach 0.72 with 12 to 81 runs, and their bands hold; random offsets and factors, also beside what
# parameters do, reach 0.9 to 1.
_LASTING = 0.8
# Number of revolutions from which a run counts as more than one.
_SEVERAL = 4


@dataclass(frozen=True)
class Requirement:
    """Requirements of a calibrated study."""

    coverage: float
    """Share of the samples of a further run that should be in the band [-]."""
    runs: int
    """Runs at points that the study chose, the first of all; they are held out in turn [-]."""
    seed: int
    """Seed of the points [-]."""
    limits: dict[str, tuple[float, float]]
    """Physical limits of the outputs by name, in their units."""
    independent: bool = False
    """Whether the runs are independent and the bands hulls of them, where no polynomial follows."""
    confidence: float | None = None
    """Confidence with which the hull is to hold the coverage at each instant [-]; None if on average."""
    seconds: float | None = field(default=None, metadata=unit("s"))
    """Time that chose the number of runs [s]; None if the user said it."""
    finished: bool = False
    """Whether the runs came as a table, at points of unknown origin."""
    revolutions: Revolutions | None = None
    """The revolutions of every run that are pooled by crank angle; None for bands over time."""
    failed: int = 0
    """Runs at points of the sequence that failed; they count as outside [-]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "limits", ReadOnlyDict(self.limits))

    @property
    def succeeded(self) -> float:
        """Share of the runs that succeeded [-]."""
        return self.runs / (self.runs + self.failed)


def needed_runs(requirement: Requirement) -> int:
    """Least number of held-out runs that can verify a coverage, if one run may be far outside.

    Fewer runs of several revolutions suffice: with nine runs of nine revolutions each, 99.91 to 100 % of the
    samples of new runs were inside on two mechanisms, 99.84 % of a penetration with rare lift-offs.
    """
    runs = _UNSEEN / (1.0 - requirement.coverage)
    if requirement.revolutions is not None and requirement.revolutions.kept >= _SEVERAL:
        runs *= 0.75
    return max(3, int(np.ceil(runs)))


def lasting_runs(margin: Margin, requirement: Requirement) -> int:
    """Least number of held-out runs where those that differ do so for nearly all of their time.

    Each is then a single observation, however many samples it has. Without this, of normally distributed
    offsets 97.9 % were inside of bands of 41 runs for 99.9 %, whose held-out coverage was 100 %, and of such
    offsets and factors beside what parameters do 99.2 to 99.6 %.
    """
    if margin.persistence < _LASTING:
        return 0
    return int(np.ceil(margin.persistence / (1.0 - requirement.coverage))) - 1


def band_usage(runs: int, parameters: int) -> Usage:
    """What bands of so many runs take: an output, its negative, and the basis of the polynomials."""
    return Usage(copies=2, matrix=runs * _core.band_terms(runs, parameters))


def calibrated_bands(
    t: Array,
    outputs: Sequence[str],
    values: Array,
    intervals: dict[str, Interval],
    parameters: Array,
    requirement: Requirement,
    threads: int | None = None,
    nominal_parameters: Array | None = None,
) -> dict[str, Band]:
    """The bands of all outputs; ValueError if a value is not finite, or there are fewer than three runs.

    `values` have the shape (runs + 1, samples, outputs), by crank angle (runs + 1, revolutions, samples,
    outputs): first the runs at points of the study, then included ones, the nominal run last.
    """
    every = np.vstack([parameters, nominal_point(intervals, nominal_parameters)])
    points = on_cube(intervals, every)
    limits = [requirement.limits[name] for name in outputs]
    nominal, rows, angle, kept = values[-1], values[:-1], None, None
    if requirement.revolutions is not None:
        kept, angle = requirement.revolutions.kept, requirement.revolutions.angle
        parameters = np.repeat(every, kept, axis=0)
        nominal, rows = values[-1, 0], values.reshape(-1, *values.shape[2:])
        values = rows
    # What a table has no runs in is unknown; Sobol' points fill the box.
    empty = requirement.finished and leaves_out(points[: requirement.runs])
    design = _core.Design(
        points, requirement.runs, requirement.coverage, requirement.independent, kept, not empty
    )
    spacing = float(t[-1] - t[0]) / (len(t) - 1)
    # One output at a time: samples in a file need not be in the memory all at once.
    column = np.empty(values.shape[:2])
    bands = {}
    for index, name in enumerate(outputs):
        copy_output(values, index, column)
        try:
            band = design.band(column, limits[index], threads)
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
            verdict="undersampled" if empty else _verdict(margin, band["coverage"], requirement),
            margin=margin,
            coverage=band["coverage"] * requirement.succeeded,
            whole_run=band["whole_run"] * requirement.succeeded,
            angle=angle,
        )
    return bands


def _verdict(margin: Margin, coverage: float, requirement: Requirement) -> Verdict:
    if requirement.succeeded < requirement.coverage:
        return "undersampled"
    if margin.degree is not None:
        return "resolved"
    if requirement.independent:
        needed = exact_runs(requirement.coverage, requirement.confidence)
        return "certified" if requirement.runs >= needed else "undersampled"
    enough = requirement.runs >= max(needed_runs(requirement), lasting_runs(margin, requirement))
    return (
        "calibrated"
        if enough and coverage * requirement.succeeded >= requirement.coverage
        else "undersampled"
    )


def statement(requirement: Requirement) -> str:
    """The coverage that a study estimates or proves, in words."""
    runs = requirement.runs
    text = _of_hull(requirement) if requirement.independent else _of_held_out_runs(requirement)
    if requirement.failed:
        one = requirement.failed == 1
        others = "1 other failed and was" if one else f"{requirement.failed} others failed and were"
        text += f" This holds for runs that succeed: {others} left out."
    if requirement.seconds is not None:
        made = runs + requirement.failed
        text += f" As many runs were made as {requirement.seconds:g} s allow; {made} runs repeat it."
    return text


def _of_hull(requirement: Requirement) -> str:
    runs = requirement.runs
    text = (
        f"Bands hold the hull of {runs} independent runs: {percent(mean_share(runs))} of the samples of a "
        "further run are inside on average, whatever the mechanism, if parameters are drawn independently "
        "and uniformly from the box."
    )
    if requirement.confidence is not None:
        share = percent(tolerated_share(runs, requirement.confidence))
        confidence = f"{100.0 * requirement.confidence:.10g} %"
        text += f" With {confidence} confidence the bounds at an instant hold {share} of all mechanisms."
    return text


def _of_held_out_runs(requirement: Requirement) -> str:
    share = f"{100.0 * requirement.coverage:.10g} %"
    spread = (
        "given, taken as spread evenly over the box" if requirement.finished else "spread evenly over the box"
    )
    needed = exact_runs(requirement.coverage)
    proof = "" if requirement.finished else f" {needed} independent runs prove it."
    return (
        f"Bands contain {share} of the samples of held-out runs, with {requirement.runs} runs {spread}; of "
        "undersampled ones, coverage says how many. A resolved band is the polynomial's range plus its "
        "error. The coverage of a new run is an estimate: it holds on average over studies. Where the size "
        "of the motion varies strongly from run to run, one study may be off by several per cent. Coverage "
        f"counts samples, whole_run counts runs.{proof}"
    )
