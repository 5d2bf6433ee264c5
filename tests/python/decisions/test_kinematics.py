"""Positions that drives prescribe and transmission angles, against closed forms."""

import dataclasses
import math

import chebclear as cc
import numpy as np
import pytest
from chebclear.decisions.kinematics import output_joint, positions, transmission_angle, turning
from refusals import refuses

ANGLE = np.linspace(0.0, 2.0 * math.pi, 121)


def bodies(scene):
    return [body.name for body in scene.bodies]


@pytest.mark.parametrize("rod", [0.08, 0.12, 0.3])
def test_a_slider_crank_is_where_its_lengths_put_it(rod):
    scene = cc.mechanisms.slider_crank(crank_length=0.05, rod_length=rod)
    found = positions(scene, scene.period, 121)
    slider = found.poses[:, bodies(scene).index("slider"), 0]
    lean = np.sqrt(rod**2 - (0.05 * np.sin(ANGLE)) ** 2)
    np.testing.assert_allclose(slider, 0.05 * np.cos(ANGLE) + lean, rtol=0.0, atol=1e-12)
    assert (found.degrees_of_freedom, found.stopped) == (0, "")
    # Between the rod and the normal of the guide.
    angle = transmission_angle(scene, found.poses)
    np.testing.assert_allclose(np.cos(angle), 0.05 * np.abs(np.sin(ANGLE)) / rod, rtol=0.0, atol=1e-7)


def test_the_transmission_angle_of_a_four_bar_follows_from_its_lengths():
    rng = np.random.default_rng(3)
    for _ in range(5):
        crank, coupler, rocker, ground = 0.03, *(0.08 + 0.04 * rng.random(3))
        if crank + max(coupler, rocker, ground) > sum(sorted((coupler, rocker, ground))[:2]):
            continue  # its crank does not turn
        scene = cc.mechanisms.four_bar(
            crank_length=crank, coupler_length=coupler, rocker_length=rocker, ground_length=ground
        )
        found = positions(scene, scene.period, 121)
        turned = scene.drives[0].angle + scene.drives[0].speed * found.t
        # The law of cosines in the two triangles beside the line from the crank pin to the rocker's bearing.
        across = crank**2 + ground**2 - 2.0 * crank * ground * np.cos(turned)
        cosine = (coupler**2 + rocker**2 - across) / (2.0 * coupler * rocker)
        np.testing.assert_allclose(
            np.cos(transmission_angle(scene, found.poses)), np.abs(cosine), rtol=0.0, atol=1e-7
        )


def test_where_a_mechanism_locks_its_positions_end():
    scene = cc.mechanisms.slider_crank(crank_length=0.05, rod_length=0.04)
    found = positions(scene, scene.period, 361)
    assert found.stopped
    reached = np.degrees(scene.drives[0].speed * found.t[-1])
    assert reached == pytest.approx(math.degrees(math.asin(0.04 / 0.05)), abs=1.0)
    assert transmission_angle(scene, found.poses)[-1] < math.radians(15.0)


def press():
    """A crank without a drive that moves a slider by a rod; its crank is 30 degrees up."""
    driven = cc.mechanisms.slider_crank(crank_length=0.05, rod_length=0.12, crank_angle=math.radians(30.0))
    return dataclasses.replace(
        driven, drives=(), start=[cc.JointStart("crank_bearing", math.radians(30.0), 3.0)]
    )


def test_one_freedom_without_a_drive_is_turned():
    scene = turning(press())
    assert scene.period == pytest.approx(2.0 * math.pi)
    found = positions(scene, scene.period, 121)
    slider = found.poses[:, bodies(scene).index("slider"), 0]
    angle = ANGLE + math.radians(30.0)
    lean = np.sqrt(0.12**2 - (0.05 * np.sin(angle)) ** 2)
    np.testing.assert_allclose(slider, 0.05 * np.cos(angle) + lean, rtol=0.0, atol=1e-9)


def test_what_no_drive_prescribes_is_only_assembled():
    double = cc.Scene(
        [cc.Body(name, 1.0, 0.01, points={"A": (0.0, 0.0), "B": (0.1, 0.0)}) for name in ("upper", "lower")],
        [cc.Revolute("pivot", "ground", "upper.A"), cc.Revolute("knee", "upper.B", "lower.A")],
    )
    assert turning(double) is double
    found = positions(double, 1.0, 121)
    assert found.degrees_of_freedom == 2 and len(found.poses) == 1
    free = cc.Scene([cc.Body("bob", 1.0, 0.01)], [])
    assert turning(free) is free and output_joint(free) is None
    assert transmission_angle(free, positions(free, 1.0, 9).poses) is None
    # A driven crank alone moves no output.
    scene = turning(cc.mechanisms.pendulum_in_bearing())
    assert transmission_angle(scene, positions(scene, scene.period, 9).poses) is None


def four_bar(coupler_length=0.1):
    return cc.mechanisms.four_bar(
        crank_length=0.03,
        coupler_length=coupler_length,
        rocker_length=0.08,
        ground_length=0.11,
        clearance_at=(),
    )


def smallest(coupler):
    """By the law of cosines at the two positions of the crank on the line of the bearings."""
    cosines = [(coupler**2 + 0.08**2 - across**2) / (0.16 * coupler) for across in (0.08, 0.14)]
    return min(math.acos(abs(cosine)) for cosine in cosines)


def test_the_least_transmission_angle_is_a_feature_of_a_study_without_a_duration():
    features = {"transmission": cc.features.least_transmission_angle}
    study = cc.Study(
        four_bar,
        {"coupler_length": cc.uniform(0.095, 0.105)},
        features=features,
        units={"transmission": "rad"},
        samples=361,
    )
    lengths = np.array([[0.095], [0.1], [0.105]])
    found = study.function("transmission")(lengths)
    np.testing.assert_allclose(found, [smallest(length) for length in lengths[:, 0]], rtol=1e-12)
    shares = cc.conformance(
        study, {"moves": cc.require("transmission", above=f"{math.degrees(smallest(0.1))} deg")}, 40
    )
    assert 0.0 < shares["moves"].share < 1.0


def test_a_prescribed_motion_is_simulated_for_a_revolution():
    run = cc.simulate(four_bar(), samples=73)
    assert run.t[-1] == four_bar().period
    assert cc.features.transmission_angles(run).min() == pytest.approx(smallest(0.1), rel=1e-12)
    loose = cc.mechanisms.four_bar(clearance_at=("rocker_pin",))
    for call in (
        cc.simulate,
        lambda scene, **how: cc.Study(lambda x: scene, {"x": cc.Interval(0, 1)}, **how),
    ):
        with refuses("duration", error=TypeError):
            call(loose, samples=73)
    with pytest.raises(cc.errors.ArgumentError):
        cc.features.transmission_angles(cc.simulate(four_bar(), samples=3, outputs=["rocker.angle"]))
    with pytest.raises(cc.errors.ArgumentError):
        cc.features.least_transmission_angle(
            cc.simulate(cc.mechanisms.pendulum_in_bearing(), duration=0.01, samples=3)
        )
