"""Given starts: what the user says of joints and bodies is what the run begins with."""

import dataclasses
import math

import chebclear as cc
import numpy as np
import pytest
from loops import four_bar
from refusals import refused

SPRING = cc.TorsionSpring("spring", "ground", "wheel", 2.0, damping=0.04)
WHEEL = cc.Body("wheel", mass=1.0, inertia=0.02)


@pytest.mark.parametrize("ends", [("ground", "wheel"), ("wheel", "ground")])
@pytest.mark.parametrize("angle", [7.0, -20.0, 3.0])
@pytest.mark.parametrize("of", ["joint", "body"])
def test_springs_count_the_turns_of_a_given_start(ends, angle, of):
    """A damped torsional oscillation, in closed form."""
    sign = 1.0 if ends[0] == "ground" else -1.0
    start = (
        cc.JointStart("pin", position=sign * angle) if of == "joint" else cc.BodyStart("wheel", angle=angle)
    )
    scene = cc.Scene([WHEEL], [cc.Revolute("pin", *ends)], [SPRING], start=[start])
    run = cc.simulate(scene, duration=3.0, samples=301, rtol=1e-10)
    rate, ratio = 10.0, 0.04 / (2.0 * math.sqrt(2.0 * 0.02))
    damped = rate * math.sqrt(1.0 - ratio**2)
    phase = damped * run.t
    expected = np.exp(-ratio * rate * run.t) * (np.cos(phase) + ratio * rate / damped * np.sin(phase))
    assert np.allclose(run["wheel.angle"], angle * expected, rtol=0.0, atol=1e-8 * abs(angle))


def test_turns_of_the_joints_of_a_chain_add_up():
    bodies = [WHEEL, cc.Body("arm", mass=1.0, inertia=0.02)]
    joints = [cc.Revolute("pin", "ground", "wheel"), cc.Revolute("elbow", "wheel", "arm")]
    start = [cc.BodyStart("wheel", angle=8.0), cc.JointStart("elbow", position=-15.0)]
    run = cc.simulate(
        cc.Scene(bodies, joints, [SPRING], start=start), duration=1e-3, samples=2, outputs=["*"]
    )
    assert run["elbow.angle"][0] == pytest.approx(-15.0, abs=1e-14)
    assert run["arm.angle"][0] == pytest.approx(-7.0, abs=1e-14)
    assert run["spring.torque"][0] == pytest.approx(-16.0, abs=1e-13)


def test_a_start_that_contradicts_the_drive_is_said_to():
    scene = cc.Scene(
        [WHEEL],
        [cc.Revolute("pin", "ground", "wheel")],
        drives=[cc.motions.Speed("drive", "pin", 1.0)],
        start=[cc.BodyStart("wheel", angle=0.5)],
    )
    assert refused(scene)


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_a_journal_that_touches_may_lie_on_either_side_by_rounding():
    scene = cc.mechanisms.free_journal(gravity=0.0)
    runs = []
    for side in (-1e-9, 1e-9):
        eccentricity = scene.joints[0].clearance * (1.0 + side)
        given = dataclasses.replace(
            scene, start=[cc.ClearanceStart("bearing", (eccentricity, 0.0), (1.0, 0.0))]
        )
        runs.append(cc.simulate(given, duration=2e-4, samples=101, rtol=1e-9))
    apart, touching = runs
    assert np.isnan(touching.contacts.impact_velocity[0])
    assert apart.contacts.impact_velocity[0] == pytest.approx(1.0, rel=1e-9)
    rebounds = [run.events.normal_velocity[run.events.kind == "separation"][0] for run in runs]
    assert rebounds[0] == pytest.approx(-0.913, abs=1e-3)  # of the law, for a restitution of 0.9
    assert rebounds[1] == pytest.approx(rebounds[0], rel=1e-6)


def test_a_journal_starts_where_it_is_told():
    scene = cc.mechanisms.slider_crank(clearance=1e-4)
    joint = next(joint.name for joint in scene.joints if isinstance(joint, cc.ClearanceRevolute))
    start = cc.ClearanceStart(joint, (3e-5, -4e-5), (0.02, 0.01))
    run = cc.simulate(dataclasses.replace(scene, start=[start]), duration=1e-6, samples=2)
    np.testing.assert_allclose(
        [run[f"{joint}.eccentricity_{axis}"][0] for axis in "xy"], (3e-5, -4e-5), rtol=0.0, atol=1e-16
    )
    rate = (0.02 * 3.0 - 0.01 * 4.0) / 5.0
    assert run[f"{joint}.penetration_rate"][0] == pytest.approx(rate, abs=1e-13)
    assert run[f"{joint}.penetration"][0] == pytest.approx(5e-5 - 1e-4, abs=1e-16)


@pytest.mark.filterwarnings("ignore:joint .* it slides slower")
def test_a_journal_may_start_in_contact_and_a_warning_says_how_it_is_damped():
    scene = cc.mechanisms.free_journal()
    clearance = next(joint for joint in scene.joints if isinstance(joint, cc.ClearanceRevolute))
    pressed = cc.ClearanceStart(clearance.name, (0.0, -clearance.clearance * 1.001))
    scene = dataclasses.replace(scene, start=[pressed])
    with pytest.warns(cc.ChebclearWarning):
        run = cc.simulate(scene, duration=1e-4, samples=11)
    assert run[f"{clearance.name}.contact"][0] == 1.0
    assert run.contacts.onset[0] == 0.0 and np.isnan(run.contacts.impact_velocity[0])


def test_joints_and_bodies_start_as_they_are_told():
    scene = four_bar(start=[cc.JointStart("C", velocity=3.0), cc.BodyStart("crank", angle=1.25)])
    run = cc.simulate(scene, duration=1e-3, samples=2, outputs=["*"])
    assert run["crank.angle"][0] == pytest.approx(1.25, abs=1e-12)
    assert run["C.angular_velocity"][0] == pytest.approx(3.0, abs=1e-12)
    speeds = [run[f"{name}.angular_velocity"][0] for name in ("coupler", "rocker")]
    assert speeds[1] - speeds[0] == pytest.approx(3.0, abs=1e-12)
    # The loop is closed in position and velocity.
    for axis in "xy":
        for kind in ("", "v"):
            a, b = (run[f"{end}.{kind}{axis}"][0] for end in ("coupler.Q", "rocker.Q"))
            assert a == pytest.approx(b, abs=1e-13)


@pytest.mark.parametrize(
    "given",
    [
        {"start": [cc.BodyStart("crank", angle=0.4), cc.BodyStart("rocker", angle=-1.0)]},
        {"start": [cc.BodyStart(name, angular_velocity=v) for name, v in (("crank", 1.0), ("rocker", 9.0))]},
        {"start": [cc.JointStart("A", 0.4), cc.JointStart("A", 0.5)]},
        {"start": [cc.JointStart("A", 0.5)], "drives": [cc.motions.Speed("drive", "A", 3.0, 0.4)]},
    ],
)
def test_starts_that_contradict_are_refused(given):
    assert refused(four_bar(**given))
