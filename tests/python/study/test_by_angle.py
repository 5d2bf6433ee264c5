"""Bands by crank angle: closed forms, fresh revolutions, values that last, wrong input."""

import math
import warnings

import chebclear as cc
import matplotlib.pyplot as plt
import numpy as np
import pytest
from chebclear.base.files import same
from refusals import refuses

LENGTHS = {"crank_length": cc.Interval.around(0.05, rel=0.1), "rod_length": cc.Interval.around(0.12, rel=0.1)}
TIME = {"duration": 1.0, "samples": 73}


def ideal_study(**fixed):
    outputs = ["slider.x", "crank.angle"]
    fixed = {"clearance_at": (), **fixed}
    return cc.Study(cc.mechanisms.slider_crank, LENGTHS, outputs, fixed=fixed, **TIME)


def wrist_study(**options):
    outputs = ["slider.x", "wrist.normal_force"]
    fixed = {"clearance": 2e-4}
    return cc.Study(cc.mechanisms.slider_crank, LENGTHS, outputs, fixed=fixed, **(TIME | options))


@pytest.fixture(scope="module")
def wrist():
    with warnings.catch_warnings():
        warnings.simplefilter("error", cc.ChebclearWarning)
        return wrist_study().band(15, revolutions=5, coverage=0.99)


@pytest.mark.parametrize("speed", [40.0, -70.0])
@pytest.mark.parametrize("start", [0.0, 0.6])
def test_without_clearance_the_band_is_that_of_the_closed_form(speed, start):
    result = ideal_study(crank_speed=speed, crank_angle=start).band(9, revolutions=3, discard=1)
    band = result["slider.x"]
    # A revolution from where the drive starts, to where it turns.
    np.testing.assert_allclose(band.angle, start + math.copysign(1.0, speed) * np.linspace(0, 2 * np.pi, 73))
    np.testing.assert_allclose(band.t, np.linspace(1.0, 2.0, 73) * 2.0 * np.pi / abs(speed), rtol=1e-12)

    def position(crank, rod):
        return crank * np.cos(band.angle) + np.sqrt(rod**2 - (crank * np.sin(band.angle)) ** 2)

    np.testing.assert_allclose(band.nominal, position(0.05, 0.12), atol=1e-9)
    # Monotone in both lengths but where the crank pulls; the extremes are on the edges of the box.
    cranks, rods = np.linspace(0.045, 0.055, 201), np.linspace(0.108, 0.132, 3)
    values = np.array([position(crank, rod) for crank in cranks for rod in rods])
    lowest, highest = values.min(axis=0), values.max(axis=0)
    assert band.resolved and band.coverage == 0.9
    # Nine runs fit a polynomial of degree 2, which is off by 0.05 % of the width.
    width = np.mean(highest - lowest)
    np.testing.assert_allclose(band.lower, lowest, rtol=0.0, atol=5e-3 * width)
    np.testing.assert_allclose(band.upper, highest, rtol=0.0, atol=5e-3 * width)
    # Full turns do not count: the crank angle is the axis itself.
    crank = result["crank.angle"]
    np.testing.assert_allclose(crank.nominal - crank.nominal[0], band.angle - band.angle[0], atol=1e-9)
    assert crank.max_width < 1e-9


def rotor(torque=0.3, speed=100.0, mass=1.0):
    """A balanced rotor of inertia 2e-3 kg m^2 under a constant torque."""
    return cc.Scene(
        [cc.Body("rotor", mass=mass, inertia=2e-3)],
        [cc.Revolute("bearing", "ground", "rotor")],
        [cc.Torque("motor", "rotor", torque)],
        start=[cc.JointStart("bearing", position=0.4, velocity=speed)],
    )


def rotor_study(**options):
    outputs = ["rotor.angular_velocity", "rotor.angle"]
    return cc.Study(rotor, {"torque": cc.Interval(0.2, 0.4)}, outputs, **(TIME | options))


@pytest.mark.parametrize("sense", [1, -1])
def test_under_a_torque_the_angle_is_the_measured_one(sense, tmp_path):
    study = cc.Study(
        rotor,
        {"torque": cc.Interval.around(sense * 0.3, rel=0.3)},
        ["rotor.angular_velocity"],
        fixed={"speed": sense * 100.0},
        **TIME,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        result = study.band(5, revolutions=6, discard=2, angle="bearing")
        longer = study.band(3, revolutions=6, discard=2, angle="bearing").extend(2)
    assert tuple(result) == ("rotor.angular_velocity",)
    band = result["rotor.angular_velocity"]
    np.testing.assert_allclose(band.angle, 0.4 + sense * np.linspace(0.0, 2.0 * np.pi, 73))
    turned = np.linspace(0.0, 2.0 * np.pi, 73) + 2.0 * np.pi * np.arange(2, 6)[:, None]
    for torque, rows in zip(result.parameters[:, 0], result.values("rotor.angular_velocity"), strict=True):
        # Energy: the square of the speed grows in proportion to the angle.
        expected = sense * np.sqrt(100.0**2 + 2.0 * abs(torque) / 2e-3 * turned)
        np.testing.assert_allclose(rows, expected, rtol=1e-5)
    # Constant acceleration from the start on.
    growth = 0.3 / 2e-3
    np.testing.assert_allclose(
        band.t, (np.sqrt(100.0**2 + 2.0 * growth * turned[0]) - 100.0) / growth, rtol=1e-5
    )
    assert same(longer.bands, result.bands)
    single = study.band(5, revolutions=2, angle="bearing")
    single.save(tmp_path / "rotor.npz")
    assert same(type(single).load(tmp_path / "rotor.npz").bands, single.bands)


def test_the_speed_of_the_drive_may_be_a_parameter():
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_speed": cc.Interval.around(60.0, rel=0.2), "crank_length": cc.Interval.around(0.05, rel=0.1)},
        ["slider.x", "crank_bearing.angle"],
        fixed={"clearance_at": ()},
        **TIME,
    )
    result = study.band(9, revolutions=3, discard=1)
    band = result["slider.x"]
    for (_, crank), rows in zip(result.parameters, result.values("slider.x"), strict=True):
        expected = crank * np.cos(band.angle) + np.sqrt(0.12**2 - (crank * np.sin(band.angle)) ** 2)
        # Samples lie at most a quarter of a degree apart: a chord would miss the arc by 2e-7 m.
        np.testing.assert_allclose(rows, np.broadcast_to(expected, rows.shape), rtol=0.0, atol=1e-8)
    assert band.resolved
    assert result["crank_bearing.angle"].max_width < 1e-8


def test_a_band_by_the_measured_angle_holds_what_does_not_depend_on_the_speed():
    def ideal(crank_speed):
        return cc.mechanisms.slider_crank(crank_speed=crank_speed, clearance_at=())

    study = cc.Study(
        ideal, {"crank_speed": cc.Interval.around(200.0, rel=0.05)}, ["slider.x"], duration=0.03, samples=91
    )
    band = study.band(41, revolutions=3)["slider.x"]
    expected = 0.05 * np.cos(band.angle) + np.sqrt(0.12**2 - (0.05 * np.sin(band.angle)) ** 2)
    np.testing.assert_allclose([band.lower, band.upper], [expected, expected], rtol=0.0, atol=1e-7)


def test_fresh_revolutions_keep_the_band(wrist):
    force = wrist["wrist.normal_force"]
    assert force.verdict == "estimated" and force.coverage >= 0.99 and force.lower.min() >= 0.0
    assert force.runs.shape == (16 * 4, 73) and force.parameters.shape == (16 * 4, 2)
    assert wrist.values("slider.x").shape == (15, 4, 73) and wrist.parameters.shape == (15, 2)
    period = 0.03
    fresh = wrist_study(samples=4 * 72 + 1, duration=4 * period, skip=period, rtol=1e-4).sample(40, rng=3)
    values = fresh.values("wrist.normal_force")
    rows = np.stack([values[:, 72 * turn : 72 * turn + 73] for turn in range(4)])
    inside = (rows >= force.lower) & (rows <= force.upper)
    # The extremes of the 60 revolutions hold 97 %.
    assert inside.mean() > 0.985


def test_revolutions_are_those_of_one_long_run(wrist):
    place = {name: values[7] for name, values in zip(LENGTHS, wrist.parameters.T, strict=True)}
    scene = cc.mechanisms.slider_crank(clearance=2e-4, **place)
    run = cc.simulate(
        scene, duration=4 * 0.03, samples=4 * 72 + 1, skip=0.03, rtol=1e-4, outputs=["slider.x"]
    )
    rows = np.stack([run["slider.x"][72 * turn : 72 * turn + 73] for turn in range(4)])
    np.testing.assert_allclose(wrist.values("slider.x")[7], rows, atol=1e-9)


def test_results_by_angle_are_extended_and_included(wrist):
    assert same(wrist_study(threads=1).band(9, revolutions=5, coverage=0.99).extend(6).bands, wrist.bands)
    more = wrist_study().band(4, revolutions=5, rng=3, include=wrist)
    assert more.parameters.shape == (19, 2) and more.requirement.runs == 4


def test_revolutions_leave_with_their_angle(wrist):
    arrays = wrist.dataset()
    runs = arrays.variables["slider.x.runs"]
    assert runs.dimensions == ("run", "cycle", "t")
    np.testing.assert_array_equal(runs.values, wrist.values("slider.x"))
    np.testing.assert_array_equal(arrays.variables["angle"].values, wrist["slider.x"].angle)


def test_features_are_those_of_each_revolution():
    study = wrist_study(features={"peak": cc.features.peak("wrist.normal_force")})
    result = study.band(3, coverage=0.9, revolutions=3)
    assert result.features.runs.shape == (3, 2, 1)
    peaks = result.features.runs[:, :, 0]
    assert np.all(peaks >= result.values("wrist.normal_force").max(axis=2) - 1e-9)


def test_a_band_by_angle_is_drawn_over_the_angle(wrist):
    axes = wrist["wrist.normal_force"].plot(nominal=True)
    assert axes.get_xlabel() == "crank angle [°]"
    for line in axes.lines:
        np.testing.assert_allclose(line.get_xdata()[[0, -1]], [0.0, 360.0], atol=1e-9)
    plt.close("all")


def test_what_has_no_band_by_angle_is_refused():
    study = wrist_study()
    for names, how in (
        (["revolutions"], {"revolutions": 2, "discard": 2}),
        (["revolutions", "discard"], {"revolutions": 0, "discard": -1}),
        (["angle"], {"revolutions": 3, "angle": "wrist"}),
        (["angle", "discard"], {"angle": "crank_bearing", "discard": 1}),
        (["include[0]"], {"revolutions": 3, "include": study.band(3, coverage=0.5, revolutions=2)}),
    ):
        with refuses(*names):
            study.band(9, **how)
    faster = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_speed": cc.Interval(200.0, 220.0)},
        ["slider.x"],
        features={"peak": cc.features.peak("slider.x")},
        **TIME,
    )
    worn = cc.Study(cc.mechanisms.slider_crank, LENGTHS, ["wrist.wear"], **TIME)
    swinging = cc.Study(
        cc.mechanisms.pendulum_in_bearing, {"length": cc.Interval.around(0.2, rel=0.1)}, **TIME
    )
    resting = cc.Study(rotor, {"mass": cc.Interval(1.0, 2.0)}, fixed={"torque": 0.0, "speed": 0.0}, **TIME)
    for made, revolutions, joint in (
        (faster, 3, None),
        (worn, 2, None),
        (swinging, 3, None),
        (rotor_study(duration=0.5), 12, "bearing"),
        (resting, 2, "bearing"),
    ):
        with pytest.raises(cc.errors.ArgumentError):
            made.band(3, revolutions=revolutions, angle=joint)


def test_a_study_beyond_the_chaos_horizon_is_told_what_to_call():
    def study(revolutions):
        times = {"duration": 0.03 * revolutions, "samples": 61 * revolutions}
        return cc.Study(cc.mechanisms.slider_crank, LENGTHS, ["slider.x", "slider.ax"], **times)

    with pytest.warns(cc.errors.HorizonWarning):
        result = study(5).band(5)
    assert [one.about for one in result.notices if one.code == "horizon"] == [("slider.ax",)]
    with warnings.catch_warnings():
        warnings.simplefilter("error", cc.errors.HorizonWarning)
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        warnings.simplefilter("error", cc.errors.HorizonWarning)
        study(2).band(5)
        # What is asked for by angle need not be told to ask for it.
        study(5).band(3, revolutions=5)


def test_a_run_beyond_its_horizon_is_told_what_to_call():
    scene = cc.mechanisms.slider_crank()
    with pytest.warns(cc.errors.HorizonWarning):
        run = cc.simulate(
            scene, duration=0.15, samples=751, outputs=["slider.ax"], rtol=1e-4, error="estimate"
        )
    assert run.error["slider.ax"].horizon + 0.03 < 0.15
    # Within a revolution of the horizon nothing is said.
    end = run.error["slider.ax"].horizon + 0.02
    with warnings.catch_warnings():
        warnings.simplefilter("error", cc.errors.HorizonWarning)
        cc.simulate(scene, duration=end, samples=201, outputs=["slider.ax"], rtol=1e-4, error="estimate")
