"""What is asked of the bands of `Study.band`, how many runs show it, and what they then state."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING

from ... import _core
from ...base.named import ReadOnlyDict
from ...base.rows import Array
from ...base.units import unit
from ...errors import ArgumentError
from ...execution.memory import Usage
from ..polynomials.points import random_points, sobol_points
from .margin import Margin, Verdict, percent
from .revolutions import Revolutions

if TYPE_CHECKING:
    from ..spec import StudySpec

LEAST_RUNS = 3
"""Fewest runs of a band [-]."""
# Parameters for which there are Sobol' points [-].
_MOST_PARAMETERS = 32
# Related to the least number of held-out runs that can verify a share of 0.1 %; see `needed_runs`. Of 168
# studies of 5 to 12 runs 44 are calibrated, and the worst holds 99.88 %; with half of it 87 and 99.66 %, with
# twice none.
_UNSEEN = 0.0112
# Persistence from which the runs and not their samples are the observations. Chains of pendulums with one
# parameter reach 0.72 with 12 to 81 runs, and their bands hold; random offsets and factors, also beside what
# parameters do, reach 0.9 to 1. Without it 5 of 86 calibrated bands leave out three times what was asked;
# with half of it 64 remain of 74.
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

    def points(self, spec: StudySpec, first: int, count: int) -> Array:
        """Points of a band from a number on: independent ones, or of a sequence that fills the box evenly."""
        draw, parameters = random_points if self.independent else sobol_points, len(spec.parameters)
        if not self.independent and parameters > _MOST_PARAMETERS:
            raise ArgumentError(
                f"a band by runs at evenly spread points takes at most {_MOST_PARAMETERS} parameters, the "
                f"study has {parameters}: give those that matter least as fixed, or ask for "
                f"{exact_runs(self.coverage)} runs, whose points are independent"
            )
        return spec.drawn(partial(draw, first=first, count=count, seed=self.seed))

    def verdict(self, margin: Margin, coverage: float) -> Verdict:
        """Verdict on a band of this margin and coverage of held-out runs."""
        if self.succeeded < self.coverage:
            return "undersampled"
        if margin.degree is not None:
            return "resolved"
        if self.independent:
            return "certified" if self.runs >= exact_runs(self.coverage, self.confidence) else "undersampled"
        enough = self.runs >= max(needed_runs(self), lasting_runs(margin, self))
        return "calibrated" if enough and coverage * self.succeeded >= self.coverage else "undersampled"


def band_usage(runs: int, parameters: int) -> Usage:
    """What bands of so many runs take: an output, its negative, and the basis of the polynomials."""
    return Usage(copies=2, matrix=runs * _core.band_terms(runs, parameters))


def mean_share(runs: int) -> float:
    """Share of the samples of a further run that the hull of so many independent runs holds on average [-].

    The newest of n + 1 values that are drawn alike is the largest or the smallest with the probability
    2 / (n + 1).
    """
    return 1.0 - 2.0 / (runs + 1)


def exact_runs(coverage: float, confidence: float | None = None) -> int:
    """Independent runs whose hull holds a share on average or, if a confidence is given, with this
    probability over the runs, all mechanisms at any one instant [-]."""
    # 1 - 0.999 is a little more than a thousandth.
    runs = max(2, math.ceil(2.0 / (1.0 - coverage) * (1.0 - 1e-12)) - 1)
    if confidence is None:
        return runs
    few, enough = runs - 1, runs
    while tolerated_share(enough, confidence) < coverage:
        few, enough = enough, 2 * enough
    while enough - few > 1:
        middle = (few + enough) // 2
        few, enough = (few, middle) if tolerated_share(middle, confidence) >= coverage else (middle, enough)
    return enough


def tolerated_share(runs: int, confidence: float = 0.95) -> float:
    """Share of a population that the extremes of so many independent runs hold, with this confidence [-].

    It is more than g with the probability 1 - g^n - n (1 - g) g^(n - 1), for any continuous distribution
    `[Wilks1941]`, and for the largest and smallest of several cycles of each run as well `[Tukey1947]`.
    93 runs hold 95 %, 473 hold 99 %.
    """
    low, high = 0.0, 1.0
    for _ in range(60):
        share = 0.5 * (low + high)
        holds = 1.0 - share**runs - runs * (1.0 - share) * share ** (runs - 1) >= confidence
        low, high = (share, high) if holds else (low, share)
    return low


def needed_runs(requirement: Requirement) -> int:
    """Least number of held-out runs that can verify a coverage, if one run may be far outside.

    Fewer runs of several revolutions suffice: with nine runs of nine revolutions each, 99.91 to 100 % of the
    samples of new runs were inside on two mechanisms, 99.84 % of a penetration with rare lift-offs.
    """
    runs = _UNSEEN / (1.0 - requirement.coverage)
    if requirement.revolutions is not None and requirement.revolutions.kept >= _SEVERAL:
        runs *= 0.75
    return max(3, math.ceil(runs))


def lasting_runs(margin: Margin, requirement: Requirement) -> int:
    """Least number of held-out runs where those that differ do so for nearly all of their time.

    Each is then a single observation, however many samples it has. Without this, of normally distributed
    offsets 97.9 % were inside of bands of 41 runs for 99.9 %, whose held-out coverage was 100 %.
    """
    if margin.persistence < _LASTING:
        return 0
    return math.ceil(margin.persistence / (1.0 - requirement.coverage)) - 1


def statement(requirement: Requirement) -> str:
    """The coverage that a study estimates or proves, in words."""
    runs, share = requirement.runs, f"{100.0 * requirement.coverage:.10g} %"
    if requirement.independent:
        text = (
            f"Bands hold the hull of {runs} independent runs: {percent(mean_share(runs))} of the samples of "
            "a further run are inside on average, whatever the mechanism, if parameters are drawn "
            "independently and uniformly from the box."
        )
        if requirement.confidence is not None:
            held = percent(tolerated_share(runs, requirement.confidence))
            confidence = f"{100.0 * requirement.confidence:.10g} %"
            text += f" With {confidence} confidence the bounds at an instant hold {held} of all mechanisms."
    else:
        given = "given, taken as " if requirement.finished else ""
        text = (
            f"Bands contain {share} of the samples of held-out runs, with {runs} runs {given}spread evenly "
            "over the box; of undersampled ones, coverage says how many. A resolved band is the polynomial's "
            "range plus its error. The coverage of a new run is an estimate: it holds on average over "
            "studies. Where the size of the motion varies strongly from run to run, one study may be off by "
            "several per cent. Coverage counts samples, whole_run counts runs."
        )
        if not requirement.finished:
            text += f" {exact_runs(requirement.coverage)} independent runs prove it."
    if requirement.failed:
        one = requirement.failed == 1
        others = "1 other failed and was" if one else f"{requirement.failed} others failed and were"
        text += f" This holds for runs that succeed: {others} left out."
    if requirement.seconds is not None:
        made = runs + requirement.failed
        text += f" As many runs were made as {requirement.seconds:g} s allow; {made} runs repeat it."
    return text
