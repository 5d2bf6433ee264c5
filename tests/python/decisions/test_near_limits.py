"""Rare shares by a polynomial against closed forms, counted mechanisms and published numbers."""

import math
from statistics import NormalDist

import chebclear as cc
import numpy as np
import pytest


def function_generator(a, b, c, d):
    """Error [rad] over the crank angle of a four-bar that should turn its rocker by a sine, closed form."""
    theta = np.radians(np.linspace(95.5, 215.5, 121))
    wanted = np.radians(76.0) + np.radians(60.0) * np.sin(0.75 * (theta - theta[0]))
    x, y = a * np.cos(theta) - d, a * np.sin(theta)
    length = np.hypot(x, y)
    angle = np.arctan2(y, x) - np.arccos((length**2 + c**2 - b**2) / (2.0 * length * c))
    return {"t": np.arange(121.0), "error": np.angle(np.exp(1j * (angle - wanted)))}


def play(gap, thread):
    return {"t": [0.0, 1.0], "play": [gap - thread, 2.0 * (gap - thread)]}


SHAFT = cc.Study(play, {"gap": cc.normal(10.1, 0.02), "thread": cc.normal(10.0, 0.02)})
WIDE = cc.Study(play, {"gap": cc.Interval(10.0, 10.2), "thread": cc.Interval(9.9, 10.1)}).chebyshev(2)
LOW = cc.require("play", above=0.0, at=0.0)


def test_a_function_generator_has_its_published_probability():
    """P(error > 0.8 degrees) = 0.00640 from 3e7 independent mechanisms."""
    sizes = {"a": 53.0, "b": 122.0, "c": 66.5, "d": 100.0}
    units = {"error": "rad"}
    along = cc.Study(
        function_generator, {name: cc.Interval(size - 0.5, size + 0.5) for name, size in sizes.items()}
    ).chebyshev(3)
    study = cc.Study(
        function_generator, {name: cc.normal(size, 0.1) for name, size in sizes.items()}, units=units
    )
    wanted = cc.require("error", above="-0.8 deg", below="0.8 deg")
    found = cc.rare_share(study, wanted, along, 200, rng=2)
    assert found.lower <= 0.00640 <= found.upper and found.upper < 1.7 * found.lower
    # Nearly all of the mechanisms that were simulated tell: as many runs at random have one outside.
    near = found.polynomial
    assert near.near == 200 and near.outside > 180 and near.missed == 0
    assert near.upper_of_runs > found.upper and "near the limits" in str(found)


def test_intervals_hold_a_closed_form_in_at_least_93_of_100_seeds():
    truth = NormalDist(0.1, 0.02 * math.sqrt(2.0)).cdf(0.02)
    wanted, held = cc.require("play", above=0.02, at=0.0), 0
    for seed in range(100):
        found = cc.rare_share(SHAFT, wanted, WIDE, 20, rng=seed)
        held += found.lower <= truth <= found.upper
    assert held >= 93
    rare = NormalDist(0.1, 0.02 * math.sqrt(2.0)).cdf(0.0)
    found = cc.rare_share(SHAFT, LOW, WIDE, 20)
    assert found.lower <= rare <= found.upper and found.polynomial.drawn > 50_000


def test_what_the_polynomial_does_not_know_is_told():
    """A tenth of the mechanisms cannot be built, which no polynomial of the others knows."""

    def fragile(gap, thread):
        if thread > 10.02:
            raise ValueError("does not fit")
        return play(gap, thread)

    study = cc.Study(fragile, SHAFT.runner.parameters)
    truth = 1.0 - NormalDist().cdf(1.0)
    with pytest.warns(cc.ChebclearWarning):
        found = cc.rare_share(study, cc.require("play", above=0.0, at=0.0), WIDE, 200, rng=1)
    assert found.polynomial.missed > 0
    assert found.lower < truth < found.upper == found.polynomial.upper_of_runs


@pytest.mark.parametrize(
    "given",
    [
        {"along": 3},
        {"specification": [LOW, cc.require("play", above=0.1)]},
        {"study": cc.Study(play, WIDE.intervals)},
        {"specification": cc.require("pley", above=0.0)},
        {"specification": cc.require("play", above=-9.0)},
        {"runs": 1, "draws": 0, "confidence": 1.0},
        {"along": cc.Study(lambda gap: play(gap, 0.0), {"gap": cc.Interval(0.0, 1.0)}).scan(3)},
    ],
)
def test_bad_input(given):
    with pytest.raises((cc.errors.ArgumentError, cc.errors.ArgumentTypeError)):
        cc.rare_share(**{"study": SHAFT, "specification": LOW, "along": WIDE} | given)


def test_what_no_polynomial_follows_is_refused():
    def stepped(x):
        return {"t": [0.0, 1.0], "y": [float(np.sign(np.sin(40.0 * x)))] * 2}

    along = cc.Study(stepped, {"x": cc.Interval(-1.0, 1.0)}).chebyshev(3)
    study = cc.Study(stepped, {"x": cc.normal(0.0, 0.2)})
    with pytest.raises(cc.errors.ArgumentError):
        cc.rare_share(study, cc.require("y", below=0.5), along)
