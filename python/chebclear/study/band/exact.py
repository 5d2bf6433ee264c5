"""The exact interval of a probability of which some trials tell."""

from __future__ import annotations

import math

import numpy as np

# Halvings of the interval in which a probability is looked for: down to its rounding.
_HALVINGS = 100


def binomial_cdf(count: int, trials: int, probability: float) -> float:
    """Probability of at most `count` successes of `trials`, each of the given probability [-], to 1e-12."""
    if probability <= 0.0 or count >= trials:
        return 1.0
    if probability >= 1.0:
        return 0.0
    if count > trials // 2:
        # By the failures, of which there are fewer terms: two for the extremes of half a million runs.
        return 1.0 - binomial_cdf(trials - count - 1, trials, 1.0 - probability)
    k = np.arange(1, count + 1)
    # Ratios of successive terms, summed as logarithms: the terms alone underflow for many trials.
    ratios = np.log(trials - k + 1) - np.log(k) + math.log(probability) - math.log1p(-probability)
    terms = trials * math.log1p(-probability) + np.concatenate([[0.0], np.cumsum(ratios)])
    return float(min(1.0, math.fsum(np.exp(terms))))


def exact_interval(count: int, trials: int, confidence: float) -> tuple[float, float]:
    """The interval of a probability of which `count` of `trials` were successes `[ClopperPearson1934]`.

    It holds the probability with at least this confidence, whatever it is: at its lower end as many successes
    or more, at its upper end as many or fewer, have half of the remaining probability each.
    """
    tail = 0.5 * (1.0 - confidence)

    def end(reached: int, wanted: float) -> float:
        """The probability at which at most `reached` successes have the probability `wanted`."""
        low, high = 0.0, 1.0
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if binomial_cdf(reached, trials, middle) > wanted else (low, middle)
        return high

    lower = 0.0 if count == 0 else end(count - 1, 1.0 - tail)
    upper = 1.0 if count == trials else end(count, tail)
    return lower, upper


def looks(width: float, most: int, confidence: float) -> list[int]:
    """Numbers of trials after which the interval is looked at until it is as narrow as asked.

    They are fixed before the first trial, so that intervals with ``1 - (1 - confidence) / len(looks)`` hold
    at all of them together with the confidence (Bonferroni). Looking again and again at intervals with the
    confidence itself, and stopping when one pleases, holds the probability much less often.

    They go from as many trials as give the width if there are no successes among them, doubled each time, to
    as many as give it whatever there are (Hoeffding's inequality, which is wider than the exact interval), or
    to the most.
    """
    count = 1
    while True:
        rest = math.log(2.0 * count / (1.0 - confidence))
        first, last = _at_most(most, rest, -math.log1p(-width)), _at_most(most, 2.0 * rest, width**2)
        if first * 2 ** (count - 1) >= last:
            return sorted({min(first * 2**place, last) for place in range(count)})
        count += 1


def _at_most(most: int, part: float, whole: float) -> int:
    """The quotient, rounded up, or the most; `whole` may be too small to be divided by."""
    return most if part >= most * whole else math.ceil(part / whole)
