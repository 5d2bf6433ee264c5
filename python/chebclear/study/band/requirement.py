"""What is asked of the bands of `Study.band`, how many runs show it, and what they then state."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from ... import _core
from ...base.named import ReadOnlyDict
from ...base.rows import Array
from ...base.shown import of_many
from ...errors import ArgumentError
from ...execution.memory import Usage
from ..polynomials.points import random_points, sobol_points
from .exact import binomial_cdf
from .margin import RESOLVED, Margin
from .revolutions import Revolutions
from .sure import Flag

if TYPE_CHECKING:
    from ..spec import StudySpec

LEAST_RUNS = 3
"""Fewest runs of a band [-]."""
# Parameters for which there are Sobol' points [-].
_MOST_PARAMETERS = 32


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

    @property
    def tolerated(self) -> float:
        """Share of all mechanisms in the band at any one instant, at least, with 95 % confidence [-].

        That of as many independent runs; NaN for a table of others.
        """
        if self.finished and not self.independent:
            return math.nan
        return tolerated_share(self.runs, failed=self.failed)

    def shown(self, margin: Margin, held_out: float) -> float:
        """Share of the samples of a further run that these runs show to be in the band, on average [-].

        Of exchangeable runs the last one is outside as much as each of them when it is left out. The share of
        `held_out` samples that are inside is from runs that were left out of the others alone: a further run
        is counted as outside for as long as a run that leaves stays there, one that a polynomial does not
        follow for all of its time `[AngelopoulosEtAl2024]`. Hulls of independent runs need no such count.
        """
        lasting = margin.persistence if margin.degree is None else 0.0
        outside = self.runs * (1.0 - held_out) + (lasting or 1.0)
        if self.independent:
            outside = 2.0 if margin.degree is None else min(2.0, outside)
        return max(0.0, 1.0 - (outside + self.failed) / (self.runs + self.failed + 1))

    def resolves(self, margin: Margin) -> bool:
        """Whether the polynomial of a band of this margin follows the runs that it was not made from."""
        return (
            self.succeeded >= self.coverage and margin.degree is not None and margin.check_error <= RESOLVED
        )

    def flag(self, margin: Margin, shown: float) -> Flag:
        """How sure a band of this margin is, with this share of further runs that is shown to be inside."""
        if self.succeeded < self.coverage:
            return "too few runs"
        if self.independent and self.runs >= exact_runs(self.coverage, self.confidence):
            return "proved"
        known = self.resolves(margin) or (shown >= self.coverage and not self.independent)
        return "estimated" if known else "too few runs"


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


def tolerated_share(runs: int, confidence: float = 0.95, failed: int = 0, ends: int = 2) -> float:
    """Share of a population that the extremes of so many independent runs hold, with this confidence [-].

    It is more than g if at most ``runs - ends`` of the runs and the `failed` ones are in a part g of the
    population, for any continuous distribution `[Wilks1941]`, and for the largest and smallest of several
    cycles of each run as well `[Tukey1947]`. 93 runs hold 95 %, 473 hold 99 %; 59 and 299 stay below the
    largest alone, which is one of the `ends`.
    """
    low, high = 0.0, 1.0
    for _ in range(60):
        share = 0.5 * (low + high)
        holds = binomial_cdf(runs - ends, runs + failed, share) >= confidence
        low, high = (share, high) if holds else (low, share)
    return low


def statement(requirement: Requirement) -> str:
    """What the runs of a study show or prove, in words."""
    runs, share = requirement.runs, f"{100.0 * requirement.coverage:.10g} %"
    if requirement.independent:
        text = (
            f"The bounds at an instant are the extremes of {runs} mechanisms, drawn independently and "
            f"uniformly from the intervals: {of_many(mean_share(runs))} further ones are inside there on "
            "average, whatever the mechanism."
        )
        if requirement.confidence is not None:
            held = of_many(tolerated_share(runs, requirement.confidence))
            confidence = f"{100.0 * requirement.confidence:.10g} %"
            text += f" With {confidence} confidence they hold {held} mechanisms."
    else:
        given = "given, taken as " if requirement.finished else ""
        text = (
            f"The bounds are made so that at any one instant {share} of further mechanisms are inside, from "
            f"{runs} runs {given}spread evenly over the intervals. How many are inside is estimated: each "
            "run is compared with bounds that were made without it."
        )
        if not requirement.finished:
            held, one = (
                of_many(tolerated_share(runs, failed=requirement.failed, ends=ends)) for ends in (2, 1)
            )
            text += (
                f" As many independent runs prove that {held} mechanisms are inside at any one "
                f"instant, and {one} on the inner side of one bound, with 95 % confidence; "
                f"{exact_runs(requirement.coverage)} prove {share} on average."
            )
    if requirement.failed == 1:
        text += " A run that failed counts as outside."
    elif requirement.failed:
        text += f" {requirement.failed} runs that failed count as outside."
    return text
