"""Given starts: what the user says of joints and bodies is what the run begins with."""

import dataclasses
import math

import chebclear as cc
import numpy as np
import pytest

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
        drives=[cc.Speed("drive", "pin", 1.0)],
        start=[cc.BodyStart("wheel", angle=0.5)],
    )
    with pytest.raises(cc.SceneError, match="the start may also contradict itself or the drives"):
        scene.check()


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
