"""Splitting: shares too rare to be counted, by the worst draws that go on from level to level.

For particles that move on independently, minus the logarithm of the share beyond the present level is a
Poisson process `[Guyader2011]`, `[Walter2015]`. Here moves are a few proposals, so that several systems of
particles, which share nothing but the first draws, say how far that holds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from statistics import NormalDist
from typing import Literal

import numpy as np
from numpy.random import Generator, default_rng

from ..base.rows import Array
from ..study.band.exact import exact_interval

COUNTED = 50
"""Draws outside from which their share is counted [-]: its interval is then within a third of it."""
LEAST_SHARE = 1e-9
"""Shares below this are not told apart [-]: no process is as constant."""
# Draws that are wider than the distributions, which may only refuse an answer [-]; how many of them outside
# say something, and the standard errors from which they contradict.
_WIDE_DRAWS, _WIDE_OUTSIDE, _WIDE_ERRORS = 2000, 5, 2.5
# Variance between systems over that of independent particles [-]: above the first another run with twice the
# particles and proposals is published instead, above the second systems have seen different regions.
_REPEATED, _REFUSED = 2.0, 5.0
# Accepted share of the proposals that steps are adapted to, and below which the response is scatter [-].
_ACCEPTANCE, _SCATTER = 0.35, 0.15
# Rounds over which acceptance is judged, and without any after which a system is stuck.
_LAST_ROUNDS, _STUCK_ROUNDS = 10, 20
# Length of the first step in standard deviations, its ends, and its gain per root of the particles moved. A
# shorter step under scatter is not accepted more often, it only leaves copies together.
_FIRST_STEP, _STEPS, _GAIN = 0.5, (0.1, 0.95), 0.15
# Different values from which a quantity says how nearly a draw is outside.
_VALUES = 4
# Places of streams of draws beside those of rounds.
_FIRST, _WIDE = 1, 2

Verdict = Literal["known", "below", "unknown"]
Reason = Literal[
    "", "counted", "runs", "seconds", "least", "regions", "scatter", "another region", "yes or no"
]


class SpentError(Exception):
    """There are no runs or there is no time for more draws; `reason` says which."""

    def __init__(self, reason: Reason) -> None:
        super().__init__(reason)
        self.reason: Reason = reason


@dataclass(frozen=True)
class Rounds:
    """How many draws go where [-]."""

    systems: int = 8
    """Systems of particles, which share nothing but the first draws."""
    particles: int = 50
    """Particles of a system: worst draws that go on."""
    moved: int = 5
    """Lowest particles of a system that are moved at once, at most half of them."""
    proposals: int = 10
    """Proposals for each of them, one after the other."""

    @property
    def kept(self) -> int:
        """Particles of all systems."""
        return self.systems * self.particles

    @property
    def doubled(self) -> Rounds:
        """With twice the particles and proposals."""
        return replace(self, particles=2 * self.particles, moved=2 * self.moved, proposals=2 * self.proposals)

    def expected(self, exponent: float, draws: int) -> int:
        """Further draws for a share of this exponent after so many first ones."""
        rest = max(exponent - math.log(draws / self.kept), 0.0)
        return _WIDE_DRAWS + math.ceil(self.kept * self.proposals * rest)


@dataclass(frozen=True, eq=False)
class Split:
    """What splitting found."""

    verdict: Verdict
    reason: Reason
    share: float
    """Share outside [-]; NaN unless it is known."""
    lower: float
    upper: float
    """Its interval [-]."""
    inflation: float = math.nan
    """Variance between the systems over that of independent particles [-]."""
    exponents: Array = field(default_factory=lambda: np.empty(0))
    """Minus the logarithm of the share by each system [-], shape (systems,)."""
    acceptance: Array = field(default_factory=lambda: np.empty(0))
    """Accepted share of its proposals in its last rounds [-]."""
    steps: Array = field(default_factory=lambda: np.empty(0))
    """Its last step, in standard deviations."""
    scores: Array = field(default_factory=lambda: np.empty((0, 0)))
    """The last particles, system by system, as standard normal scores [-], shape (particles, parameters)."""
    badness: Array = field(default_factory=lambda: np.empty(0))
    """Their badness, outside from 0 on."""


class _System:
    """Particles that go on from level to level."""

    def __init__(
        self, scores: Array, badness: Array, ties: Array, rounds: Rounds, place: tuple[int, ...]
    ) -> None:
        self.scores, self.badness, self.ties = scores, badness, ties
        self.moved = rounds.moved
        self.place = place
        alive = len(badness) - np.arange(rounds.moved)
        # What a round adds to minus the logarithm of the share, and to its variance, particle by particle.
        self.gains = np.array([np.cumsum(1.0 / alive), np.cumsum(1.0 / alive**2)])
        self.exponent, self.variance = 0.0, 0.0
        self.step = _FIRST_STEP
        self.accepted: list[float] = []
        self.levels: list[tuple[float, float]] = []
        self.done = False

    def ordered(self) -> None:
        """Sort the particles, and end where the lowest of them that would be moved are outside.

        Ties of the badness are broken by a number that is drawn with every particle and stays with it.
        """
        order = np.lexsort((self.ties, self.badness))
        self.scores, self.badness, self.ties = self.scores[order], self.badness[order], self.ties[order]
        if self.badness[self.moved - 1] >= 0.0:
            inside = int(np.count_nonzero(self.badness[: self.moved] < 0.0))
            self._gain(inside)
            self.done = True

    def _gain(self, moved: int) -> None:
        """Count so many particles as moved."""
        if moved:
            self.exponent += float(self.gains[0, moved - 1])
            self.variance += float(self.gains[1, moved - 1])

    def begin(self) -> None:
        """Copy others onto the lowest particles; what these were is gone before."""
        self.level = float(self.badness[self.moved - 1]), float(self.ties[self.moved - 1])
        stream = default_rng([*self.place, len(self.levels), 0])
        parents = stream.integers(self.moved, len(self.badness), size=self.moved)
        for column in (self.scores, self.badness, self.ties):
            column[: self.moved] = column[parents]
        self._taken = 0

    def proposed(self, number: int) -> Array:
        """The next proposal for each particle that moves."""
        stream = default_rng([*self.place, len(self.levels), 1 + number])
        self._fresh_ties = stream.random(self.moved)
        noise = stream.standard_normal((self.moved, self.scores.shape[1]))
        self._proposal = math.sqrt(1.0 - self.step**2) * self.scores[: self.moved] + self.step * noise
        return self._proposal

    def judge(self, badness: Array) -> None:
        """Take proposals beyond the level."""
        beyond = (badness > self.level[0]) | ((badness == self.level[0]) & (self._fresh_ties > self.level[1]))
        rows = np.flatnonzero(beyond)
        self.scores[rows], self.badness[rows] = self._proposal[rows], badness[rows]
        self.ties[rows] = self._fresh_ties[rows]
        self._taken += len(rows)

    def end(self, proposals: int) -> None:
        """Note the level that is reached, and adapt the step."""
        self.accepted.append(self._taken / (self.moved * proposals))
        change = _GAIN * math.sqrt(self.moved) * (self.accepted[-1] - _ACCEPTANCE)
        self.step = float(np.clip(self.step * math.exp(change), *_STEPS))
        self._gain(len(self.gains[0]))
        self.levels.append(self.level)

    @property
    def acceptance(self) -> float:
        """Accepted share of the proposals of the last rounds; all of none."""
        return float(np.mean(self.accepted[-_LAST_ROUNDS:])) if self.accepted else 1.0

    @property
    def is_stuck(self) -> bool:
        return len(self.accepted) >= _STUCK_ROUNDS and not any(self.accepted[-_STUCK_ROUNDS:])

    def up_to(self, level: tuple[float, float]) -> tuple[float, float]:
        """Exponent and variance at its last level that is not beyond another."""
        rounds = sum(one <= level for one in self.levels)
        return rounds * self.gains[0, -1], rounds * self.gains[1, -1]


def split(
    badness: Callable[[Array], Array],
    scores: Array,
    first: Array,
    rounds: Rounds,
    seed: int,
    confidence: float = 0.95,
) -> Split:
    """The share of draws whose badness is not below 0, where few of the first draws are.

    `badness` takes standard normal scores, shape (draws, parameters), and returns numbers, infinite where it
    has none, of shape (draws,); it raises `SpentError` to end. `first` is that of the first draws at
    `scores`.
    """
    draws, dimension = len(scores), scores.shape[1]
    outside = int(np.count_nonzero(first >= 0.0))
    counted = exact_interval(outside, draws, confidence)
    if len(np.unique(first)) < _VALUES:
        none = np.empty((0, dimension))
        return Split("unknown", "yes or no", math.nan, 0.0, counted[1], scores=none)
    stream = default_rng([seed, _FIRST])
    ties = stream.random(draws)
    worst = stream.permutation(np.lexsort((ties, first))[draws - rounds.kept :])
    systems = [
        _System(scores[rows], first[rows], ties[rows], rounds, (seed, _WIDE + 1 + number))
        for number, rows in enumerate(worst.reshape(rounds.systems, -1))
    ]
    alive = draws - np.arange(draws - rounds.kept)
    before = float(np.sum(1.0 / alive)), float(np.sum(1.0 / alive**2))
    ended: Reason = ""
    wide = math.nan, math.inf
    try:
        wide = _wide(badness, dimension, default_rng([seed, _WIDE]))
        ended = _advanced(badness, systems, rounds, before[0])
    except SpentError as spent:
        ended = spent.reason
    reached = np.array([(one.exponent, one.variance) for one in systems])
    if running := [one for one in systems if not one.done]:
        # As far as all systems are.
        level = min(one.levels[-1] if one.levels else (-math.inf, 0.0) for one in running)
        reached = np.array([one.up_to(level) for one in systems])
    share, lower, upper, inflation = _interval(reached, before, confidence)
    acceptance = np.array([one.acceptance for one in systems])
    reason: Reason = ""
    if any(one.is_stuck for one in systems) or acceptance.mean() < _SCATTER:
        reason = "scatter"
    elif inflation > _REFUSED:
        reason = "regions"
    elif wide[0] - _WIDE_ERRORS * wide[1] > upper or counted[0] > upper:
        reason = "another region"
    verdict: Verdict = "unknown" if reason else "below" if running else "known"
    if verdict == "unknown":
        lower, upper = 0.0, counted[1]
    elif verdict == "below":
        lower, upper, reason = 0.0, min(upper, counted[1]), ended
    return Split(
        verdict=verdict,
        reason=reason,
        share=share if verdict == "known" else math.nan,
        lower=lower,
        upper=upper,
        inflation=inflation,
        exponents=before[0] + reached[:, 0],
        acceptance=acceptance,
        steps=np.array([one.step for one in systems]),
        scores=np.concatenate([one.scores for one in systems]),
        badness=np.concatenate([one.badness for one in systems]),
    )


def is_doubtful(found: Split) -> bool:
    """Whether systems differ so much that another split with `Rounds.doubled` is to be published instead."""
    return found.verdict == "known" and found.inflation > _REPEATED


def _advanced(
    badness: Callable[[Array], Array], systems: list[_System], rounds: Rounds, before: float
) -> Reason:
    """Move the systems on until all of them are outside, side by side; the reason why they end before."""
    while True:
        for one in systems:
            if not one.done:
                one.ordered()
        running = [one for one in systems if not one.done]
        if not running or any(one.is_stuck for one in running):
            return ""
        if any(before + one.exponent > -math.log(LEAST_SHARE) for one in running):
            return "least"
        for one in running:
            one.begin()
        for number in range(rounds.proposals):
            found = badness(np.concatenate([one.proposed(number) for one in running]))
            for one, own in zip(running, found.reshape(len(running), -1), strict=True):
                one.judge(own)
        for one in running:
            one.end(rounds.proposals)


def _wide(badness: Callable[[Array], Array], dimension: int, stream: Generator) -> tuple[float, float]:
    """The share outside by draws wider than the distributions, and its standard error; infinite if too few
    are."""
    width = 2.0 if dimension <= 3 else 1.5 if dimension <= 8 else 1.25
    scores = width * stream.standard_normal((_WIDE_DRAWS, dimension))
    squares = np.einsum("ij,ij->i", scores, scores)
    outside = badness(scores) >= 0.0
    weights = np.where(outside, width**dimension * np.exp(-0.5 * squares * (1.0 - width**-2.0)), 0.0)
    error = float(np.std(weights)) / math.sqrt(_WIDE_DRAWS)
    return float(np.mean(weights)), error if np.count_nonzero(outside) >= _WIDE_OUTSIDE else math.inf


def _interval(
    reached: Array, before: tuple[float, float], confidence: float
) -> tuple[float, float, float, float]:
    """Share, its interval and the inflation, from exponent and variance of each system and of the first
    draws.

    At each end the wider of the interval of independent particles and of that between the systems. At the
    upper one also that of the mean of their shares, which is unbiased where they see different regions.
    """
    count, (first, first_variance) = len(reached), before
    exponents = reached[:, 0]
    exponent = first + float(np.mean(exponents))
    ideal = float(np.sum(reached[:, 1])) / count**2
    spread = float(np.var(exponents, ddof=1)) / count
    variance = first_variance + ideal
    shape = exponent**2 / variance
    tail = 0.5 * (1.0 - confidence)
    student = student_quantile(1.0 - tail, count - 1)
    least = gamma_quantile(tail, shape) * exponent / shape
    most = gamma_quantile(1.0 - tail, shape + 1.0) * exponent / shape
    # The first draws are shared by all systems, which say nothing of their error.
    shared = NormalDist().inv_cdf(1.0 - tail) ** 2 * first_variance
    reach = math.sqrt(student**2 * spread + shared)
    smallest = float(np.min(exponents))
    shares = np.exp(smallest - exponents)
    relative = float(np.std(shares, ddof=1) / np.mean(shares))
    mixed = math.log(float(np.mean(shares))) - smallest - first
    mixed += math.sqrt(student**2 * relative**2 / count + shared)
    upper = max(-least, -exponent + reach, mixed)
    lower = min(-most, -exponent - reach)
    inflation = spread / ideal if ideal > 0.0 else 0.0
    return math.exp(-exponent), math.exp(lower), min(1.0, math.exp(upper)), inflation


def gamma_quantile(share: float, shape: float) -> float:
    """Quantile of a gamma distribution of scale 1 `[WilsonHilferty1931]`; within 1e-5 of it for shapes above
    50."""
    z = NormalDist().inv_cdf(share)
    return shape * (1.0 - 1.0 / (9.0 * shape) + z / (3.0 * math.sqrt(shape))) ** 3


def student_quantile(share: float, degrees: int) -> float:
    """Quantile of Student's distribution above its median, by bisection of the closed form of its
    probability."""

    def inside(t: float) -> float:
        """Probability between -t and t: Abramowitz and Stegun, 26.7.3 and 26.7.4."""
        angle = math.atan(t / math.sqrt(degrees))
        cosine = math.cos(angle)
        odd = degrees % 2
        term = cosine if odd else 1.0
        total = term if degrees > 1 else 0.0
        for number in range(2 + odd, degrees - 1, 2):
            term *= cosine**2 * (number - 1) / number
            total += term
        total *= math.sin(angle)
        return 2.0 / math.pi * (angle + total) if odd else total

    low, high = 0.0, 1.0
    while inside(high) < 2.0 * share - 1.0:
        high *= 2.0
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if inside(middle) < 2.0 * share - 1.0 else (low, middle)
    return high
