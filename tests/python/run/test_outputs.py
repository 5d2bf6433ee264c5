"""Outputs by name: what there is, patterns, and that rates are those of what they belong to."""

import dataclasses
import math
import ntpath
import os

import chebclear as cc
import numpy as np
import pytest
from chebclear.scene.columns import physical_limits
from refusals import refused, refuses

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

RODS = [
    cc.Body(
        name, 1.0, 0.01, center_of_mass=(0.1, 0.02), points={"P": (0.0, 0.0), "Q": (0.3, 0.1)}, angle=angle
    )
    for name, angle in (("upper", -1.0), ("lower", 0.2))
]
SCENE = cc.Scene(
    [*RODS, cc.Body("ring", 0.2, 1e-3), cc.Body("cart", 1.0, 1.0, points={"R": (0.1, 0.1)})],
    [
        cc.Revolute("shoulder", "cart.R", "upper.P"),
        cc.Revolute("elbow", "upper.Q", "lower.P"),
        cc.Prismatic("rail", "ground.O", "cart", (2.0, 1.0)),
        cc.ClearanceRevolute(
            "eye", "lower.Q", "ring", 0.02, 1e-3, cc.laws.Flores(1e8, 0.8), cc.laws.SmoothedCoulomb(0.1, 0.01)
        ),
    ],
    [
        cc.Gravity((0.0, -9.81)),
        cc.Spring("spring", "ground.O", "lower.Q", 30.0, 0.2, 1.0),
        cc.Damper("damper", "cart", "upper.Q", 2.0),
        cc.TorsionSpring("coil", "upper", "lower", 1.0, 0.1, 0.01),
    ],
    [
        cc.motions.Motion("shaker", "rail", cc.motions.Harmonic(0.05, 8.0)),
        cc.motions.Speed("motor", "shoulder", 3.0, -1.0),
    ],
    ground={"O": (0.1, 0.2)},
)


@pytest.fixture(scope="module")
def run():
    return cc.simulate(SCENE, duration=0.2, samples=20001, rtol=1e-9, method="dop853", outputs=["*"])


def test_every_part_has_its_outputs(run):
    facts = SCENE.check()
    assert run.columns == facts.columns + facts.further_columns
    assert len(set(run.columns)) == len(run.columns)
    expected = """
        upper.x lower.vy ring.angular_acceleration cart.x upper.P.x lower.Q.vy cart.R.ay
        shoulder.angle elbow.angular_velocity shoulder.reaction_torque
        rail.displacement rail.velocity rail.acceleration rail.reaction_x
        eye.penetration eye.normal_force eye.impact_loss eye.friction_loss eye.wear
        spring.length spring.lengthening spring.force damper.force coil.angle coil.torque
        shaker.force shaker.power motor.torque motor.power energy.total energy.balance
    """
    assert set(expected.split()) <= set(run.columns)
    assert "shaker.torque" not in run.columns and "motor.force" not in run.columns


@pytest.mark.parametrize(
    "value, rate",
    [
        ("upper.x", "upper.vx"),
        ("lower.Q.y", "lower.Q.vy"),
        ("cart.R.x", "cart.R.vx"),
        ("lower.angle", "lower.angular_velocity"),
        ("elbow.angle", "elbow.angular_velocity"),
        ("rail.displacement", "rail.velocity"),
        ("rail.velocity", "rail.acceleration"),
        ("shoulder.angle", "shoulder.angular_velocity"),
        ("spring.length", "spring.lengthening"),
        ("damper.length", "damper.lengthening"),
        ("eye.penetration", "eye.penetration_rate"),
    ],
)
def test_rates_are_derivatives(run, value, rate):
    # Central differences of the samples; in free flight and contact alike these are continuous.
    difference = (run[value][2:] - run[value][:-2]) / (run.t[2] - run.t[0])
    scale = abs(run[rate]).max()
    np.testing.assert_allclose(difference, run[rate][1:-1], rtol=0.0, atol=2e-3 * scale)
    assert np.median(abs(difference - run[rate][1:-1])) < 1e-6 * scale


def test_points_and_joints_move_with_their_bodies(run):
    angle = run["lower.angle"]
    arm = np.array([0.3 - 0.1, 0.1 - 0.02])
    x = run["lower.x"] + arm[0] * np.cos(angle) - arm[1] * np.sin(angle)
    np.testing.assert_allclose(run["lower.Q.x"], x, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(run["elbow.angle"], angle - run["upper.angle"], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(run["shoulder.angle"], -1.0 + 3.0 * run.t, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(run["rail.displacement"], 0.05 * np.sin(8.0 * run.t), rtol=0.0, atol=1e-15)
    along = np.array([2.0, 1.0]) / math.sqrt(5.0)
    np.testing.assert_allclose(run["cart.x"], 0.1 + run["rail.displacement"] * along[0], rtol=0.0, atol=1e-14)
    q, o = np.column_stack((run["lower.Q.x"], run["lower.Q.y"])), np.array([0.1, 0.2])
    np.testing.assert_allclose(run["spring.length"], np.linalg.norm(q - o, axis=1), rtol=1e-12)
    pull = 30.0 * (run["spring.length"] - 0.2) + 1.0 * run["spring.lengthening"]
    np.testing.assert_allclose(run["spring.force"], pull, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(run["damper.force"], 2.0 * run["damper.lengthening"], rtol=0.0, atol=1e-12)
    torque = -1.0 * (run["elbow.angle"] - 0.1) - 0.01 * run["elbow.angular_velocity"]
    np.testing.assert_allclose(run["coil.torque"], torque, rtol=0.0, atol=1e-12)


def test_energies_are_those_of_the_bodies(run):
    kinetic = potential = 0.0
    for body in SCENE.bodies:
        square = run[f"{body.name}.vx"] ** 2 + run[f"{body.name}.vy"] ** 2
        kinetic = kinetic + 0.5 * (
            body.mass * square + body.inertia * run[f"{body.name}.angular_velocity"] ** 2
        )
        potential = potential + 9.81 * body.mass * run[f"{body.name}.y"]
    potential = potential + 15.0 * (run["spring.length"] - 0.2) ** 2 + 0.5 * (run["coil.angle"] - 0.1) ** 2
    contact = 0.4 * 1e8 * np.maximum(run["eye.penetration"], 0.0) ** 2.5 * run["eye.contact"]
    for name, truth in (("kinetic", kinetic), ("potential", potential), ("contact", contact)):
        np.testing.assert_allclose(run[f"energy.{name}"], truth, rtol=0.0, atol=1e-11, err_msg=name)
    np.testing.assert_allclose(run["energy.total"], kinetic + potential + contact, rtol=0.0, atol=1e-11)
    assert contact.max() > 0.0 and run["energy.damping_loss"][-1] > 0.0


def test_patterns_choose_columns(run):
    def columns(*outputs):
        return cc.simulate(SCENE, duration=1e-3, samples=2, outputs=outputs).columns

    assert columns("energy.*") == tuple(name for name in run.columns if name.startswith("energy."))
    assert columns("*.wear") == ("eye.wear",)
    assert columns("cart.R.v?", "cart.x") == ("cart.R.vx", "cart.R.vy", "cart.x")
    # What is named and matched as well comes once, where it comes first.
    assert columns("cart.R.vy", "cart.R.v*") == ("cart.R.vy", "cart.R.vx")
    assert columns("shaker.[fp]*") == ("shaker.force", "shaker.power")


@pytest.mark.parametrize("name", ["energy", "rod.energy", ""])
def test_the_name_of_the_energies_is_no_name_of_a_part(name):
    bodies = [cc.Body(name, 1.0, 1.0)]
    assert "bodies[0].name" in refused(cc.Scene(bodies, [cc.Revolute("pin", "ground", name)]))
    scene = dataclasses.replace(SCENE, forces=[*SCENE.forces, cc.Torque("energy", "cart", 1.0)])
    with refuses("forces[4].name", error=cc.errors.SceneError):
        scene.check()
    # A point may have it: its outputs are "body.energy.x".
    point = dataclasses.replace(SCENE.bodies[3], points={"R": (0.1, 0.1), "energy": (0.0, 0.0)})
    assert (
        "cart.energy.vx"
        in dataclasses.replace(SCENE, bodies=[*SCENE.bodies[:3], point]).check().further_columns
    )


def test_patterns_know_upper_and_lower_case_on_every_system(monkeypatch):
    body = [cc.Body(name, 1.0, 0.1) for name in ("Arm", "arm")]
    scene = cc.Scene(body, [cc.Revolute("pin", "Arm", "arm")])
    scene.check()
    with monkeypatch.context() as windows:
        windows.setattr(os, "path", ntpath)  # where fnmatch asks for the customs of the system
        run = cc.simulate(scene, duration=0.1, samples=2, outputs=["Arm.*"])
    assert {name.partition(".")[0] for name in run.columns} == {"Arm"}


def test_limits_of_outputs_and_features_stand_beside_their_units():
    free, positive, share = (-math.inf, math.inf), (0.0, math.inf), (0.0, 1.0)
    expected = {
        "pin.sticking": share,
        "pin.contact": share,
        "pin.wear_3": positive,
        "pin.eccentricity_ratio": positive,
        "pin.eccentricity_x": free,
        "pin.penetration": (-2e-5, math.inf),
        "energy.kinetic": positive,
        "energy.balance": free,
        "energy.contact": positive,
        "slider.vx": free,
    }
    assert physical_limits(tuple(expected), {"pin": 2e-5}) == expected
    assert cc.features.peak_to_peak("pin.contact").limits_with(share) == share
    assert cc.features.rms("slider.vx").limits_with(free) == positive
    assert cc.features.contact_share("pin").limits_with(free) == share
    assert cc.features.impacts("pin").limits_with(free) == positive
    assert cc.features.lowest("pin.penetration").limits_with((-2e-5, math.inf)) == (-2e-5, math.inf)
