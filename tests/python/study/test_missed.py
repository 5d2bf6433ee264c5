"""Intervals of effects contain what the polynomial behind them misses."""

import math

import numpy as np
import pytest
from chebclear import _core
from chebclear.study.features.effects import find_effects, model_of
from chebclear.study.features.narrowing import find_narrowing


def ishigami(z):
    """Ishigami and Homma (1990), on [-1, 1]."""
    a, b, c = (math.pi * z.T)[:3]
    return np.sin(a) + 7.0 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a)


def ishigami_shares():
    first = 0.5 * (1.0 + 0.1 * math.pi**4 / 5.0) ** 2
    second = 7.0**2 / 8.0
    both = 0.1**2 * math.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    return np.array([first, second, 0.0, 0.0]) / (first + second + both)


def g_function(z):
    """Saltelli and Sobol' (1995) with weights 0, 1, 4.5, 9, on [-1, 1]."""
    weights = np.array([0.0, 1.0, 4.5, 9.0])
    return np.prod((np.abs(2.0 * z) + weights) / (1.0 + weights), axis=1)


def g_shares():
    parts = 1.0 / (3.0 * (1.0 + np.array([0.0, 1.0, 4.5, 9.0])) ** 2)
    return parts / (np.prod(1.0 + parts) - 1.0)


def dead_zone(z):
    """0 in 92 % of the box, and in 97.75 % where one interval is halved: 95 % of the values are one then."""
    return np.maximum(0.0, z[:, 0] + z[:, 1] - 1.2)


@pytest.mark.parametrize("runs", [21, 41, 121, 321])
@pytest.mark.parametrize(("function", "shares"), [(ishigami, ishigami_shares()), (g_function, g_shares())])
def test_intervals_of_shares_hold(function, shares, runs):
    held = []
    for seed in range(8):
        points = _core.sobol_points(4, 0, runs, seed)
        found = find_effects(list("abcd"), model_of(points, function(points)[:, None])).main.values()
        held.append([one.lower <= true <= one.upper for one, true in zip(found, shares, strict=True)])
    assert np.mean(held) >= 0.9 and np.mean(held, axis=0).min() >= 0.75


def test_halving_that_leaves_nothing_is_in_its_interval():
    held = []
    for seed in range(8):
        points = _core.sobol_points(2, 0, 121, seed)
        found = find_narrowing(["a", "b"], model_of(points, dead_zone(points)[:, None])).values()
        held += [one.upper == 1.0 for one in found]
    assert np.mean(held) >= 0.75  # none held when what the polynomial misses was left out


def test_a_parameter_without_effect_is_not_said_to_narrow():
    false = []
    for seed in range(12):
        points = _core.sobol_points(4, 0, 121, seed)
        found = find_narrowing(list("abcd"), model_of(points, ishigami(points)[:, None]))["d"]
        false.append(round(100.0 * found.lower) > 0)
    assert np.mean(false) <= 0.1


def test_scatter_of_a_function_without_any_may_be_none():
    points = _core.sobol_points(4, 0, 81, 0)
    assert find_effects(list("abcd"), model_of(points, ishigami(points)[:, None])).scatter.lower == 0.0
