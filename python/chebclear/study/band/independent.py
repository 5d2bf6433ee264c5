"""What the hull of independent runs holds, whatever the mechanism."""

from __future__ import annotations

import math


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
