"""Waves that vanish at the roots of a grid are seen by the runs beside it."""

import warnings

import chebclear as cc
import numpy as np
import pytest
from chebclear.study.polynomials.points import CHECKS
from numpy.polynomial import Chebyshev

T = np.linspace(0.0, 1.0, 3)
PLANE = {"a": cc.Interval(2.0, 6.0), "b": cc.Interval(-1.0, 0.0)}


def on_cube(values):
    return [(value - PLANE[name].midpoint) / PLANE[name].half_width for name, value in values.items()]


def chebyshev(response, names, degree):
    """The study of a response to values from -1 to 1."""

    def model(**values):
        return {"t": T, "y": np.full(3, response(*on_cube(values)))}

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        return cc.Study(model, {name: PLANE[name] for name in names}).chebyshev(degree)


@pytest.mark.parametrize("degree", range(1, 9))
@pytest.mark.parametrize("multiple", [2, 4, 6])
def test_a_wave_that_looks_like_a_constant_is_not_resolved(degree, multiple):
    wave = Chebyshev.basis(multiple * (degree + 1))
    assert not chebyshev(wave, "a", degree)["y"].resolved
    for response in (
        lambda a, b: wave(a),
        lambda a, b: wave(b),
        lambda a, b: wave(a) + wave(b),
        lambda a, b: 3.0 * a + wave(b),
    ):
        assert not chebyshev(response, "ab", degree)["y"].resolved


@pytest.mark.parametrize("degree", [3, 4])
def test_runs_beside_the_grid_check_the_polynomial_and_do_not_change_it(degree):
    def smooth(a, b):
        return np.exp(0.3 * a) * (1.0 + 0.1 * b)

    result = chebyshev(smooth, "ab", degree)
    count = (degree + 1) ** 2
    assert len(result.parameters) == count + CHECKS
    band = result["y"]
    assert band.resolved and band.margin.error > 0.0
    fitted = cc.results.Surrogate.fit(PLANE, (degree + 1,) * 2, (degree,) * 2, band.runs[:count])
    assert np.array_equal(band.surrogate.terms, fitted.terms)


def test_nothing_is_resolved_where_no_run_beside_the_grid_succeeds():
    roots = np.cos((np.arange(12) + 0.5) * np.pi / 12)

    def model(a):
        if np.abs(on_cube({"a": a})[0] - np.append(roots, 0.0)).min() > 1e-9:
            raise ValueError("beside the grid")
        return {"t": T, "y": np.full(3, a)}

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        result = cc.Study(model, {"a": PLANE["a"]}).chebyshev(degree=1, nodes=12)
    assert len(result.failures) == CHECKS
    assert not result["y"].resolved


def test_a_finished_table_is_checked_by_its_other_runs():
    box = {"a": cc.Interval(-1.0, 1.0)}
    at = np.append(np.cos((np.arange(4) + 0.5) * np.pi / 4), [0.0, 0.6])
    for wave, resolved in ((Chebyshev.basis(8), False), (Chebyshev.basis(1), True)):
        study = cc.Study.from_runs({"a": at}, T, {"y": np.outer(wave(at), np.ones(3))}, intervals=box)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", cc.ChebclearWarning)
            assert study.chebyshev(degree=3)["y"].resolved is resolved
