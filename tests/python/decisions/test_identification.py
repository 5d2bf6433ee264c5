"""Parameters from traces: regions hold the truth as often as they say, ridges and wrong models are told."""

import chebclear as cc
import numpy as np
import pytest
from chebclear.decisions.region import FeatureFit
from chebclear.features import BandPower, Crossings, MagnitudeQuantile
from chebclear.results import Measured
from refusals import refuses

T = np.linspace(0.0, 1.0, 201)
BOX = {"a": cc.Interval(1.0, 3.0), "b": cc.Interval(0.5, 1.5)}


def wave(a, b, start=0.0):
    return {"t": T, "x": a * b * np.sin(40.0 * T + start), "y": a + 0.0 * T}


def noisy(seed, a, b, level=0.1):
    random = np.random.default_rng(seed)
    run = wave(a, b, random.uniform(0.0, 6.0))
    return Measured({name: run[name] + level * random.standard_normal(len(T)) for name in ("x", "y")}, t=T)


def study(**more):
    return cc.Study(wave, BOX | {"start": cc.uniform(0.0, 6.0)}, **more)


@pytest.fixture(scope="module")
def result():
    return study().sample(400)


def observed(cube, random):
    """Three features whose scatter is normal, skew or a count, and differs nine times within the box."""
    a, b = cube.T
    return np.column_stack(
        [
            np.exp(0.6 * a) * (1.0 + 0.3 * b) + (0.05 + 0.04 * a) * random.standard_normal(len(cube)),
            np.sin(1.2 * a + 0.8 * b) + 0.1 * np.exp(0.5 * b) * (random.gamma(2.0, 1.0, len(cube)) - 2.0),
            random.poisson(20.0 * np.exp(0.3 * a + 0.2 * b)),
        ]
    )


def test_regions_hold_the_truth_at_each_point():
    random = np.random.default_rng(2)
    points = np.array([(0.0, 0.0), (0.5, -0.5), (0.0, -1.0), (0.98, 0.0), (-1.0, 1.0), (0.97, 0.97)])
    held = np.zeros(len(points))
    for _ in range(8):
        cube = random.uniform(-1.0, 1.0, (400, 2))
        fit = FeatureFit(cube, observed(cube, random), 0.9)
        place = np.repeat(points, 50, axis=0)
        inside = fit.ratio(place, observed(place, random)) <= 1.0
        held += inside.reshape(len(points), 50).mean(axis=1) / 8
    assert np.all((held >= 0.85) & (held <= 0.97)), held


def test_fresh_runs_keep_the_confidence_in_a_corner():
    wanted = [cc.features.rms("x")]
    held = 0
    for seed in range(24):
        trace = noisy(seed, 1.0, 1.5)
        found = cc.identify(study(), trace, ["a", "b"], wanted, runs=100, noise={"x": 0.1}, rng=seed)
        held += found.contains({"a": 1.0, "b": 1.5}, runs=99)
        assert not found.contains({"a": 3.0, "b": 1.5}, runs=99)
    assert 18 <= held <= 24


def test_only_the_product_is_told_where_only_the_product_matters(result):
    trace = noisy(1, 1.8, 1.1)
    found = cc.identify(result, trace, ["a", "b"], [cc.features.rms("x")], noise={"x": 0.1})
    assert found.status == "not_identifiable" and len(found.directions) == 1
    # a b stays the same along (a, -b), here over half of the intervals.
    best = np.array([found.best["a"], -found.best["b"] / 0.5])
    along = np.array(list(found.directions[0].values()))
    assert abs(along @ best) / np.linalg.norm(best) > 0.999
    products = found.points.prod(axis=1)
    assert products.min() > 1.8 and products.max() < 2.2 and found.contains({"a": 1.8, "b": 1.1})
    # Another feature, of a alone, tells both.
    both = cc.identify(
        result, trace, ["a", "b"], [cc.features.rms("x"), cc.features.mean("y")], noise={"x": 0.1, "y": 0.1}
    )
    assert both.status == "identified" and both.directions == () and both.share < 0.1 * found.share
    for name, value in (("a", 1.8), ("b", 1.1)):
        low, high = both.ranges[name]
        assert low < value < high and high - low < 0.2
    # Of b nothing is known from y.
    blind = cc.identify(result, trace, ["b"], [cc.features.mean("y")], noise={"y": 0.1})
    assert blind.status == "not_identifiable" and blind.directions == ({"b": 1.0},)
    assert blind.open_ends == ("b",) and "there 90 % is approximate" in str(blind)


def test_without_features_the_steady_ones_are_taken():
    trace = noisy(1, 1.8, 1.1)
    rms, mean, power = cc.features.rms("x"), cc.features.mean("y"), BandPower("x", 5.0, 8.0)
    own = {"top": cc.features.peak("x"), "level": mean, "power": power, "span": cc.features.peak_to_peak("y")}
    noise = {"x": 0.1, "y": 0.1}
    found = cc.identify(study(features=own), trace, ["a", "b"], noise=noise, runs=100)
    asked = cc.identify(study(), trace, ["a", "b"], {"level": mean, "power": power}, noise=noise, runs=100)
    assert list(found.features) == ["level", "power"] and found.features == asked.features
    assert found.contains({"a": 1.8, "b": 1.1}) and found.ranges == asked.ranges
    # Without any of them the rms of what was measured.
    only = study(features={"top": cc.features.peak("x")})
    found = cc.identify(only, trace, ["a", "b"], noise=noise, runs=100)
    assert list(found.features) == ["rms of x", "rms of y"]
    assert (
        found.features["rms of x"]
        == cc.identify(only, trace, ["a"], {"r": rms}, noise={"x": 0.1}, runs=100).features["r"]
    )


def test_a_wrong_model_is_rejected(result):
    trace = noisy(1, 1.8, 1.1)
    wrong = Measured({"x": trace["x"], "y": trace["y"] - 5.0}, t=T)
    wanted = {"size": cc.features.rms("x"), "level": cc.features.mean("y")}
    found = cc.identify(result, wrong, ["a", "b"], wanted, noise={"x": 0.1, "y": 0.1})
    assert found.status == "rejected" and found.share == 0.0 and len(found.points) == 0
    assert abs(found.deviations["level"]) > 10.0 and np.isnan(found.ranges["a"][0])
    assert found.plot().get_title() == "rejected"


def test_thin_regions_are_found_and_pictures_show_them():
    """Without scatter a region is a point: 1e-6 of the box is no rejection."""
    plain = cc.Study(lambda a, b: {"t": T, "x": a + b * T}, BOX)
    trace = Measured({"x": 2.2 + 0.9 * T}, {"x": "mm"}, t=T)
    wanted = [cc.features.mean("x"), cc.features.peak_to_peak("x")]
    found = cc.identify(plain, trace, ["a", "b"], wanted, runs=100, noise={"x": 1e-4})
    assert found.status == "identified" and found.share < 1e-5
    assert found.best == pytest.approx({"a": 2.2, "b": 0.9}, abs=1e-3)
    ax = found.plot()
    assert ax.get_xlim() == (1.0, 3.0) and ax.get_ylabel() == "b"


def test_a_mechanism_is_identified_at_the_instants_of_the_trace():
    """The mass of a slider from the torque of the drive; contacts as the core counts them."""
    box = {"slider_mass": cc.Interval(0.1, 0.2), "clearance": cc.Interval(1e-4, 2e-4)}
    fixed = {"restitution": 0.9}
    model = cc.Study(
        cc.mechanisms.slider_crank, box, ["slider.x"], fixed=fixed, skip=0.03, duration=0.015, samples=3
    )
    wanted = [
        cc.features.rms("drive.torque"),
        cc.features.contact_share("wrist"),
        cc.features.impacts("wrist"),
    ]
    run = cc.simulate(
        cc.mechanisms.slider_crank(slider_mass=0.14, clearance=1.5e-4),
        duration=0.015,
        skip=0.03,
        samples=3001,
        features=wanted[1:],
    )
    names = ["drive.torque", "wrist.contact"]
    trace = Measured(
        {name: run[name] for name in names}, {"drive.torque": "N m", "wrist.contact": "-"}, t=run.t
    )
    found = cc.identify(model, trace, ["slider_mass"], wanted, runs=100, noise={"drive.torque": "10 N mm"})
    low, high = found.ranges["slider_mass"]
    assert low < 0.14 < high < low + 0.03 and found.units == {"slider_mass": "kg"}
    shares = list(found.features.values())
    assert shares[1] == pytest.approx(run.feature(wanted[1]), abs=2e-3) and shares[2] == run.feature(
        wanted[2]
    )


def test_bad_input_is_told_at_once(result):
    trace = Measured({"x": T, "pulse": np.where(np.arange(201) % 9 == 4, 1.0, 0.0)}, {"x": "N"}, t=T)
    own = study(units={"x": "m"})
    wrong = [cc.features.wear("x"), cc.features.rms("y"), "size"]
    with refuses(
        "parameters", "confidence", *(f'features["{name}"]' for name in ("wear of x", "rms of y", "size"))
    ):
        cc.identify(own, trace, ["a", "z"], wrong, confidence=2.0)
    features = [cc.features.rms("x"), BandPower("x", 10.0, 200.0), Crossings("pulse", 0.5)]
    # Too few runs, no such output of the model, another dimension twice, and samples too coarse twice.
    coarse = [f'features["{feature!r}"]' for feature in features[1:]]
    with refuses("runs", "pulse", "x", 'noise["y"]', 'noise["x"]', *coarse):
        cc.identify(own, trace, ["a"], features, runs=20, noise={"y": 1.0, "x": "1 kg"})
    wanted = [MagnitudeQuantile("x", 0.9)]
    for bad in (
        Measured({"x": T}, t=T + 5.0),  # no overlap
        Measured({"x": T}, t=T**2),  # uneven
        Measured({"x": T}, angle=T),  # no time
        Measured({"x": T}, t=0.1 * T),  # finer than the runs
    ):
        with pytest.raises(cc.errors.ArgumentError):
            cc.identify(result, bad, ["a"], wanted)
    with pytest.raises(cc.errors.ArgumentTypeError):
        cc.identify(result, T, ["a"], wanted)
    found = cc.identify(result, Measured({"x": T}, t=T), ["a"], wanted)
    for wrong in ({}, {"a": 9.0}, {"a": 2.0, "b": 1.0}):
        with pytest.raises(cc.errors.ArgumentError):
            found.contains(wrong)
    with pytest.raises(cc.errors.ArgumentError):
        found.contains({"a": 2.0}, runs=99)  # a result makes no runs
