"""The balance of energies closes: in every ready-made mechanism, with every element, law and drive.

``energy.balance`` is what the stored energy has more than start + input - losses explain; it measures the
errors of the integration, of the quadratures and of every formula of a force or a loss at once.
"""

import dataclasses
import math

import chebclear as cc
import numpy as np
import pytest

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

RTOL = 1e-8
ENERGIES = [
    "kinetic",
    "potential",
    "contact",
    "total",
    "input",
    "impact_loss",
    "friction_loss",
    "damping_loss",
]
METHODS = ["rodas5p", "rodas4", "dop853", "adams"]


def imbalance(scene, duration, method="rodas5p", rtol=RTOL):
    """Largest balance, as a part of the largest energy, and the run."""
    run = cc.simulate(scene, duration=duration, samples=101, rtol=rtol, method=method, outputs=["*"])
    largest = max(abs(run[f"energy.{name}"]).max() for name in ENERGIES)
    return abs(run["energy.balance"]).max() / largest, run


MADE = {
    "slider-crank": (cc.mechanisms.slider_crank(), 0.03),
    "slider-crank, two clearances": (cc.mechanisms.slider_crank(clearance_at=("crank_pin", "wrist")), 0.01),
    "slider-crank, ideal": (cc.mechanisms.slider_crank(clearance_at=()), 0.03),
    "slider-crank of Flores": (cc.mechanisms.flores_slider_crank(), 0.012),
    "four-bar": (cc.mechanisms.four_bar(), 0.03),
    "four-bar, ideal": (cc.mechanisms.four_bar(clearance_at=()), 0.1),
    "six-bar": (cc.mechanisms.six_bar(), 0.03),
    "quick return": (cc.mechanisms.quick_return(), 0.05),
    "pendulum": (cc.mechanisms.pendulum_in_bearing(), 0.1),
    "free journal": (cc.mechanisms.free_journal(), 0.02),
}


def scene_with(*forces, drives=(), start=()):
    """A double pendulum under gravity, at named points."""
    rods = [
        cc.Body(
            name,
            1.0,
            0.01,
            center_of_mass=(0.15, 0.0),
            points={"P": (0.0, 0.0), "Q": (0.3, 0.0)},
            angle=angle,
        )
        for name, angle in (("upper", -1.0), ("lower", 0.2))
    ]
    pins = [cc.Revolute("shoulder", "ground", "upper.P"), cc.Revolute("elbow", "upper.Q", "lower.P")]
    return cc.Scene(rods, pins, [cc.Gravity((0.0, -9.81)), *forces], drives, {"W": (0.4, 0.5)}, start)


def loop_with(*forces, drives=()):
    """The ready-made four-bar without clearance and without its drive, under gravity."""
    scene = cc.mechanisms.four_bar(clearance_at=())
    return dataclasses.replace(scene, forces=[cc.Gravity((0.0, -9.81)), *forces], drives=drives)


TABLE = cc.motions.Table([0.0, 0.1, 0.3, 0.35, 0.6, 1.0], [0.0, 1.0, -2.0, 1.5, 0.5, 0.0])
HARMONIC = cc.motions.Harmonic(2.0, 11.0, 0.3, mean=0.5)
ELEMENTS = {
    "gravity": scene_with(),
    "spring": scene_with(cc.Spring("s", "ground.W", "lower.Q", 200.0, 0.2)),
    "spring with damper": scene_with(cc.Spring("s", "ground.W", "lower.Q", 200.0, 0.2, 3.0)),
    "spring without length": scene_with(cc.Spring("s", "ground.W", "lower.Q", 50.0, 0.0)),
    "damper": scene_with(cc.Damper("s", "ground.W", "lower.Q", 3.0)),
    "torsion spring": scene_with(cc.TorsionSpring("s", "upper", "lower", 3.0, 0.5, 0.05)),
    "torsion damper": scene_with(cc.TorsionDamper("s", "upper", "lower", 0.2)),
    "force": scene_with(cc.Force("f", "lower.Q", 3.0, HARMONIC)),
    "force by a table": scene_with(cc.Force("f", "lower.Q", TABLE, cc.motions.Polynomial([1.0, -2.0, 3.0]))),
    "follower force": scene_with(cc.Force("f", "lower.Q", HARMONIC, TABLE, frame="body")),
    "torque": scene_with(cc.Torque("t", "upper", HARMONIC)),
    "inner torque": scene_with(cc.Torque("t", "lower", TABLE, reaction="upper")),
    "constant speed": scene_with(drives=[cc.motions.Speed("d", "shoulder", 9.0, -1.0)]),
    "harmonic motion": scene_with(drives=[cc.motions.Motion("d", "elbow", HARMONIC)]),
    "motion by a polynomial": scene_with(
        drives=[cc.motions.Motion("d", "shoulder", cc.motions.Polynomial([-1.0, 0.0, 4.0]))]
    ),
    "motion by a table": scene_with(drives=[cc.motions.Motion("d", "shoulder", TABLE)]),
    "motions of all joints": scene_with(
        cc.Spring("s", "ground.W", "lower.Q", 200.0, 0.2, 3.0),
        drives=[cc.motions.Motion("d", "shoulder", TABLE), cc.motions.Motion("e", "elbow", HARMONIC)],
    ),
    "start": scene_with(start=[cc.JointStart("elbow", 0.5, 10.0), cc.BodyStart("upper", 1.0, -3.0)]),
    "loop": loop_with(),
    "loop with torque": loop_with(
        cc.Torque("t", "crank", HARMONIC), cc.TorsionDamper("d", "ground", "rocker", 0.01)
    ),
    "loop with a driven rocker": loop_with(
        drives=[cc.motions.Motion("d", "rocker_bearing", cc.motions.Harmonic(0.2, 9.0, mean=1.8))]
    ),
    "prescribed loop by a table": loop_with(drives=[cc.motions.Motion("d", "crank_bearing", TABLE)]),
}
LAWS = [
    cc.laws.LankaraniNikravesh(1e10, 0.3),
    cc.laws.ExactRestitution(1e10, 0.3),
    cc.laws.KelvinVoigt(2e7, 300.0),
    cc.laws.Impact(1e10, 500.0, 2e-6),
    cc.laws.Hertz(1e8, exponent=1.2),
]
FRICTIONS = [None, cc.laws.ModifiedCoulomb(0.1, 0.05, 1e-3, 1.5e-3), cc.laws.SmoothedCoulomb(0.1, 5e-3)]


def wrist(law, friction, sliding="surface"):
    scene = cc.mechanisms.slider_crank(clearance=2e-5)
    joints = [
        dataclasses.replace(joint, contact=law, friction=friction, sliding=sliding)
        if isinstance(joint, cc.ClearanceRevolute)
        else joint
        for joint in scene.joints
    ]
    return dataclasses.replace(scene, joints=joints)


@pytest.mark.parametrize("name", MADE)
@pytest.mark.parametrize("method", METHODS)
def test_ready_made_mechanisms(name, method):
    scene, duration = MADE[name]
    assert imbalance(scene, duration, method)[0] < 1e-6


@pytest.mark.parametrize("name", ELEMENTS)
@pytest.mark.parametrize("method", METHODS)
def test_elements(name, method):
    assert imbalance(ELEMENTS[name], 1.0, method)[0] < 1e-6


@pytest.mark.parametrize("law", LAWS, ids=repr)
@pytest.mark.parametrize("friction", FRICTIONS, ids=repr)
def test_laws(law, friction):
    part, run = imbalance(wrist(law, friction), 0.005)
    assert part < 1e-6
    assert len(run.contacts) > 0
    for column in ("wrist.friction_loss", "wrist.wear"):
        assert np.all(np.diff(run[column]) >= 0.0)
    if friction is None:
        assert not run["wrist.friction_loss"].any()
    # Where the damping never pulls it only takes; up to the clip of a strong damping and rounding.
    size = max(run["wrist.impact_loss"].max(), 1e-12 * run["energy.total"].max())
    assert np.diff(run["wrist.impact_loss"]).min() > -1e-6 * size
    if isinstance(law, cc.laws.Hertz):
        assert not run["wrist.impact_loss"].any()


def test_the_printed_sliding_velocity_balances_too():
    """Its friction does not act against the sliding of the surfaces, and may give energy; it is counted."""
    part, _ = imbalance(wrist(LAWS[0], FRICTIONS[1], sliding="contact_point"), 0.01)
    assert part < 1e-6


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8, 1e-10])
def test_the_balance_measures_the_error_of_a_run(rtol):
    scene = ELEMENTS["spring with damper"]
    run = cc.simulate(scene, duration=1.0, samples=101, rtol=rtol, outputs=["energy.*", "lower.angle"])
    truth = cc.simulate(
        scene, duration=1.0, samples=101, rtol=1e-13, method="dop853", outputs=["lower.angle"]
    )
    error = abs(run["lower.angle"] - truth["lower.angle"]).max()
    balance = abs(run["energy.balance"]).max()
    assert balance < 300.0 * rtol
    assert error < 1e3 * rtol
    assert balance < 100.0 * error, "the sum of the errors is not far above the error"


@pytest.mark.parametrize("name", ["slider-crank", "four-bar, ideal"])
def test_power_of_the_drive_adds_up_to_the_input(name):
    scene, duration = MADE[name]
    drive = scene.drives[0].name
    run = cc.simulate(
        scene,
        duration=duration,
        samples=20001,
        rtol=1e-9,
        method="dop853",
        outputs=[f"{drive}.*", "energy.input"],
    )
    power = run[f"{drive}.power"]
    np.testing.assert_allclose(power, run[f"{drive}.torque"] * scene.drives[0].speed, rtol=1e-14)
    work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(run.t))])
    # The trapezium rule at the samples; impacts are short against their spacing.
    assert abs(work - run["energy.input"]).max() < 2e-4 * abs(run["energy.input"]).max()


def test_losses_of_the_joints_add_up():
    run = imbalance(*MADE["slider-crank, two clearances"])[1]
    for loss in ("impact_loss", "friction_loss"):
        np.testing.assert_allclose(
            run[f"crank_pin.{loss}"] + run[f"wrist.{loss}"], run[f"energy.{loss}"], rtol=1e-12, atol=1e-18
        )


def test_wear_is_friction_over_its_coefficient():
    """With one friction coefficient, wear (force times sliding) is the loss over the coefficient."""
    friction = cc.laws.ModifiedCoulomb(0.05, 0.05, 1e-9, 1e-8)
    run = imbalance(wrist(cc.laws.Flores(1e10, 0.9), friction), 1e-3, "dop853", 1e-6)[1]
    assert run["wrist.wear"][-1] > 0.0
    np.testing.assert_allclose(0.05 * run["wrist.wear"], run["wrist.friction_loss"], rtol=1e-5, atol=1e-15)


# --- a run whose energy does not balance ----------------------------------------------------------------


def heavy_rod(convention, coefficient=0.62, **choices):
    """A slider-crank with a rod of 8 kg whose pins stick at 2e-5 m/s."""
    law = cc.laws.LankaraniNikravesh(2.7e8, 0.9)
    friction = cc.laws.ModifiedCoulomb(coefficient, 0.75 * coefficient, 2e-5, 3e-5)
    return cc.mechanisms.slider_crank(
        rod_mass=8.0, contact=law, friction=friction, convention=convention, **choices
    )


def unbalanced(run):
    """What a run warns of: the part of the largest energy that it cannot explain."""
    return sum(one.numbers["share"] for one in run.notices if one.code == "energy_balance")


PINS = {"clearance": 2e-4, "clearance_at": ("crank_pin", "wrist"), "crank_speed": cc.rpm(650.0)}


@pytest.mark.parametrize("outputs", [["slider.vx"], ["energy.*"]], ids=["not asked for", "asked for"])
def test_a_run_whose_energy_does_not_balance_warns(outputs):
    # Off by 6.4e-3 to 9.3e-3 at rtol from 8e-4 to 1.2e-3.
    given = {"duration": 0.05, "samples": 101, "rtol": 9e-4, "method": "rodas5p"}
    scene = heavy_rod("as_printed", 1.5, **PINS)
    energies = cc.simulate(scene, **given, outputs=["energy.*"])
    # No gravity acts.
    largest = max(np.abs(energies[f"energy.{name}"]).max() for name in ENERGIES if name != "total")
    off = np.abs(energies["energy.balance"]).max() / largest
    assert off > 3e-3
    # Not asked for, it is estimated from a part of the steps: within a tenth here.
    assert 0.5 * off < unbalanced(cc.simulate(scene, **given, outputs=outputs)) < 2.0 * off
    fine = cc.simulate(scene, **given, outputs=["slider.vx"], velocity_tolerance=2e-8)
    assert unbalanced(fine) == 0.0


@pytest.mark.parametrize("name", MADE)
def test_a_run_whose_energy_balances_does_not_warn(name):
    scene, duration = MADE[name]
    assert (
        unbalanced(cc.simulate(scene, duration=0.3 * duration, samples=2, outputs=["energy.kinetic"])) == 0.0
    )


@pytest.mark.parametrize("method", METHODS)
def test_rounding_errors_of_a_body_at_rest_are_no_imbalance(method):
    # It hangs with its center of mass at the origin, where the potential is zero: all energies are rounding
    # errors.
    bar = cc.Body("bar", 1.0, 1.0 / 12.0, points={"P": (-0.5, 0.0)}, angle=-0.5 * math.pi)
    pin, gravity = cc.Revolute("pin", "ground.P", "bar.P"), cc.Gravity((0.0, -9.81))
    run = cc.simulate(
        cc.Scene([bar], [pin], [gravity], ground={"P": (0.0, 0.5)}), duration=5.0, samples=3, method=method
    )
    assert not run.notices


def test_at_a_loose_tolerance_few_steps_are_looked_at():
    given = {"duration": 0.03, "samples": 2, "rtol": 1e-2, "method": "dop853"}
    scene = cc.mechanisms.slider_crank()
    every, some = (
        cc.simulate(scene, **given, outputs=outputs).stats for outputs in (["energy.*"], ["slider.vx"])
    )
    # The dense output of a step takes three evaluations, and few events ask for it here.
    left_out = (every.evaluations - some.evaluations) / 3
    assert left_out > 0.6 * some.steps


def test_looking_at_energies_changes_no_step():
    scene = heavy_rod("corrected", crank_speed=cc.rpm(365.0))
    given = {"duration": 0.01, "samples": 11, "rtol": 1e-4}
    asked, not_asked = (
        cc.simulate(scene, **given, outputs=outputs) for outputs in (["slider.vx", "energy.*"], ["slider.vx"])
    )
    assert asked.stats.steps == not_asked.stats.steps
    np.testing.assert_array_equal(asked["slider.vx"], not_asked["slider.vx"])


@pytest.mark.parametrize("name", ["energy.kinetic", "energy.balance"])
def test_an_energy_beyond_the_largest_number_ends_a_run(name):
    """A balance of infinite energies is no number at all."""
    slide = cc.Prismatic("slide", "ground", "block", axis=(1.0, 0.0))
    start = [cc.JointStart("slide", 0.0, 1e6)]
    scene = cc.Scene([cc.Body("block", 1e300, 1e300)], [slide], start=start)
    given = {"duration": 1.0, "samples": 5, "on_failure": "return"}
    run = cc.simulate(scene, outputs=["block.x", name], **given)
    assert run.status == "non_finite" and run.end_time == 0.0
    assert cc.simulate(scene, outputs=["block.x"], **given)["block.x"][-1] == pytest.approx(1e6)
