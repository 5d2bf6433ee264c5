"""Bands that the core widens are those of the rule as it is written in the documentation."""

import numpy as np
import pytest
from chebclear import _core
from one_page import widened


def random_values(random, kind, shape):
    runs, rows, samples = shape
    t = np.linspace(0.0, 1.0, samples)
    if kind == "walk":
        return np.cumsum(random.normal(size=shape), axis=2)
    if kind == "heavy":
        return random.standard_t(3, size=shape) * (1.0 + np.sin(6.0 * t))
    waves = np.sin(2.0 * np.pi * (3.0 * t + random.uniform(size=(runs, rows, 1))))
    return np.maximum(waves * random.lognormal(size=(runs, 1, 1)), 0.0)


@pytest.mark.parametrize("kind", ["walk", "heavy", "contact"])
@pytest.mark.parametrize(("runs", "rows", "samples"), [(9, 1, 30), (21, 1, 60), (12, 4, 37)])
@pytest.mark.parametrize("coverage", [0.9, 0.999])
def test_the_core_follows_the_written_rule(kind, runs, rows, samples, coverage):
    random = np.random.default_rng([runs, rows, samples])
    values = random_values(random, kind, (runs, rows, samples))
    if rows > 1:
        values[:, :, -1] = values[:, :, 0]
    limits = (0.0, np.inf) if kind == "contact" else (-np.inf, np.inf)
    points = random.uniform(-1.0, 1.0, (runs, 2))
    # Runs that leave out a part of the box get no polynomial.
    design = _core.Design(points, runs, coverage, False, rows if rows > 1 else None, False)
    found = design.band(values.reshape(runs * rows, samples), limits)
    lower, upper, inside = widened(values, 1.0 - coverage, limits, joined=rows > 1)
    size = np.abs(values).max()
    np.testing.assert_allclose(found["lower"], lower, rtol=0.0, atol=1e-11 * size)
    np.testing.assert_allclose(found["upper"], upper, rtol=0.0, atol=1e-11 * size)
    assert found["coverage"] == pytest.approx(inside, abs=1e-12)
