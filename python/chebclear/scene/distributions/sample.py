"""What measured values of some parts tell of all: mean, and the largest deviation that they allow."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ...base.arguments import Checks

RISK = 0.05
"""Probability that more parts than stated are beyond an end, or that the deviation is larger [-]."""
# Fewest values: of fewer, half of all parts may be beyond either end.
_FEWEST = 5
# Halvings that find a quantile to its rounding.
_HALVINGS = 100


def check_sample(checks: Checks, name: str, values: Sequence[float]) -> None:
    """Check that values tell something: enough of them that are not all equal."""
    if len(values) < _FEWEST:
        checks.add(name, f"must be at least {_FEWEST}, got {len(values)}: fewer say nearly nothing")
    elif min(values) == max(values):
        checks.add(name, f"must not all be equal, got {len(values)} times {values[0]!r}")


def worst_moments(values: Sequence[float]) -> tuple[float, float]:
    """Mean, and the upper end of the interval of the standard deviation with 95 % confidence, if normal."""
    freedom, deviation = len(values) - 1, float(np.std(values, ddof=1))
    return float(np.mean(values)), deviation * math.sqrt(freedom / chi_square_quantile(RISK, freedom))


def chi_square_quantile(share: float, freedom: int) -> float:
    """The value that a share of a chi-square distribution with so many degrees of freedom stays below."""

    def below(value: float) -> float:
        """Probability of a smaller value: the series of the lower incomplete gamma function."""
        shape, half = 0.5 * freedom, 0.5 * value
        term = total = math.exp(shape * math.log(half) - half - math.lgamma(shape + 1.0))
        count = 0
        while term > total * 1e-17:
            count += 1
            term *= half / (shape + count)
            total += term
        return total

    low, high = 0.0, float(freedom)
    while below(high) < share:
        high *= 2.0
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if middle <= 0.0 or below(middle) < share else (low, middle)
    return high
