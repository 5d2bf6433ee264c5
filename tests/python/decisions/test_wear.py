"""Wear of bearings: pressures against quadratures, volumes and lives against Archard by hand."""

import dataclasses
import math

import chebclear as cc
import numpy as np
import pytest
from chebclear.scene.scene import compiled
from momenta import momenta
from refusals import refused, refuses
from scipy.integrate import quad

RADIUS, CLEARANCE, STIFFNESS = 0.01, 5e-5, 1e10
PER_ANGLE = 3.0 * STIFFNESS * math.sqrt(CLEARANCE) / (4.0 * math.sqrt(2.0))
LOAD, SPIN = 200.0, 100.0
TURN = 2.0 * math.pi / SPIN
LAW = cc.laws.Archard(coefficient=1e-4, hardness=1e9, length=0.02)
GROOVE = 2e-5 * (1.0 + np.cos(2.0 * math.pi * (np.arange(36) + 0.5) / 36 - 4.0))


def journal(at=(0.0, -6e-5), profile=(), law=None, rate=(0.0, 0.0), spin=SPIN, **options):
    """A journal in a bearing on ground, pressed down, with a damper that lets it come to rest."""
    law = law or cc.laws.Hertz(STIFFNESS)
    return cc.Scene(
        [cc.Body("journal", 0.5, 1.0)],
        [
            cc.ClearanceRevolute(
                "pin", "ground", "journal", RADIUS, CLEARANCE, law, profile=profile, **options
            )
        ],
        [cc.Force("load", "journal", 0.0, -LOAD), cc.Bushing("damper", "ground", "journal", 0.0, 1000.0)],
        start=[cc.BodyStart("journal", angular_velocity=spin), cc.ClearanceStart("pin", at, rate)],
    )


@pytest.mark.filterwarnings("ignore")
def first(scene):
    outputs = ["pin.normal_force", "pin.penetration", "energy.contact", "journal.ax", "journal.ay"]
    outputs += ["journal.angular_acceleration", "pin.friction_force", "pin.sliding_velocity"]
    run = cc.simulate(scene, duration=1e-9, samples=2, outputs=outputs)
    return {name: column[0] for name, column in run.items()}


def depth_at(profile, angle):
    """Depth between the middles of sectors: that of a displaced circle, p·u."""
    count = len(profile)
    width = 2.0 * math.pi / count
    place = angle / width - 0.5
    k = math.floor(place)
    part = (place - k) * width
    a, b = profile[k % count], profile[(k + 1) % count]
    return (a * math.sin(width - part) + b * math.sin(part)) / math.sin(width)


@pytest.mark.parametrize("angle", [0.3, 2.0, -1.2])
@pytest.mark.parametrize("sectors", [8, 31, 72])
def test_without_wear_the_pressures_have_their_closed_form(angle, sectors):
    eccentricity = CLEARANCE + 6e-6
    at = (eccentricity * math.cos(angle), eccentricity * math.sin(angle))
    found = first(journal(at, [0.0] * sectors, spin=0.0))
    alpha = math.acos(CLEARANCE / eccentricity)
    total = 2.0 * PER_ANGLE * eccentricity * (math.sin(alpha) - alpha * math.cos(alpha))
    resultant = PER_ANGLE * eccentricity * (alpha - math.sin(alpha) * math.cos(alpha))
    assert found["pin.penetration"] == pytest.approx(6e-6, rel=1e-9)
    assert found["pin.normal_force"] == pytest.approx(total, rel=1e-9)
    assert found["journal.ax"] == pytest.approx(-2.0 * resultant * math.cos(angle), rel=1e-9)
    assert found["journal.ay"] == pytest.approx(-2.0 * (resultant * math.sin(angle) + LOAD), rel=1e-9)


def test_a_bearing_without_wear_begins_to_press_as_its_law():
    at = (0.0, -(CLEARANCE + 1e-9))
    worn, round_one = (first(journal(at, profile))["pin.normal_force"] for profile in ([0.0] * 72, ()))
    assert worn == pytest.approx(round_one, rel=1e-4)


@pytest.mark.parametrize("at", [(2e-5, -8e-5), (-9.5e-5, 1.5e-5), (-8e-5, -6e-5)])
def test_the_pressures_of_a_groove_are_those_of_a_quadrature(at):
    found = first(journal(at, GROOVE, spin=0.0))
    angles = (np.arange(200_000) + 0.5) * 2.0 * math.pi / 200_000
    depth = np.array([depth_at(GROOVE, angle) for angle in angles])
    pressed = np.maximum(at[0] * np.cos(angles) + at[1] * np.sin(angles) - CLEARANCE - depth, 0.0)
    step = PER_ANGLE * 2.0 * math.pi / 200_000
    assert pressed.max() > 0.0
    assert found["pin.normal_force"] == pytest.approx(step * pressed.sum(), rel=1e-7)
    assert found["pin.penetration"] == pytest.approx(pressed.max(), rel=1e-5)  # of the grid
    assert found["energy.contact"] == pytest.approx(0.5 * step * (pressed**2).sum(), rel=1e-7)
    assert found["journal.ax"] == pytest.approx(-2.0 * step * (pressed * np.cos(angles)).sum(), rel=1e-7)


def test_derivatives_are_those_of_differences():
    """Of the accelerations at the end of a run with friction, whose bearing turns with its body."""
    friction = cc.laws.SmoothedCoulomb(0.1, velocity=0.5)
    at, rate, spins = (2e-5, -8e-5), (0.01, -0.02), (20.0, SPIN)

    def scene(e=at, v=rate, angle=0.4, spin=spins):
        bodies = [cc.Body("bush", 1.0, 0.01, angle=angle), cc.Body("journal", 0.5, 1e-4)]
        pin = cc.ClearanceRevolute(
            "pin", "bush", "journal", RADIUS, CLEARANCE, cc.laws.Hertz(STIFFNESS), friction, profile=GROOVE
        )
        start = [
            cc.JointStart("axle", angle, spin[0]),
            cc.BodyStart("journal", angular_velocity=spin[1], angle=0.0),
            cc.ClearanceStart("pin", e, v),
        ]
        return cc.Scene(bodies, [cc.Revolute("axle", "ground", "bush"), pin], start=start)

    outputs = [f"{body}.{name}" for body in ("bush", "journal") for name in ("ax", "ay")]
    outputs += ["bush.angular_acceleration", "journal.angular_acceleration"]

    def accelerations(**changes):
        run = cc.simulate(scene(**changes), duration=1e-12, samples=2, outputs=outputs, rtol=1e-10)
        return np.array([run["bush.angular_acceleration"][0], run["journal.ax"][0], run["journal.ay"][0]])

    run = cc.simulate(scene(), duration=1e-12, samples=2, outputs=["journal.x"], rtol=1e-10)
    found = compiled(scene()).small_motions(run.end.memory)
    names = scene().check().coordinates
    order = [names.index(name) for name in ("axle", "journal.x", "journal.y")]
    by_position = np.asarray(found["by_position"])[np.ix_(order, order)]
    by_velocity = np.asarray(found["by_velocity"])[np.ix_(order, order)]
    for column, (key, step) in enumerate([("angle", 1e-6), ("x", 1e-10), ("y", 1e-10)]):
        if key == "angle":
            sides = [accelerations(angle=0.4 + sign * step) for sign in (1, -1)]
        else:
            axis = ("x", "y").index(key)
            sides = [accelerations(e=tuple(np.add(at, sign * step * np.eye(2)[axis]))) for sign in (1, -1)]
        expected = (sides[0] - sides[1]) / (2.0 * step)
        np.testing.assert_allclose(
            by_position[:, column], expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max()
        )
    for column, step in enumerate([1e-4, 1e-6, 1e-6]):
        if column == 0:
            sides = [accelerations(spin=(spins[0] + sign * step, spins[1])) for sign in (1, -1)]
        else:
            shift = step * np.eye(2)[column - 1]
            sides = [accelerations(v=tuple(np.add(rate, sign * shift))) for sign in (1, -1)]
        expected = (sides[0] - sides[1]) / (2.0 * step)
        np.testing.assert_allclose(
            by_velocity[:, column], expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max()
        )


FRICTION = cc.laws.ModifiedCoulomb(0.1, 0.08, 1e-3, 1.5e-3)


def test_energy_and_both_momenta_of_a_free_pair():
    bodies = [cc.Body("bush", 0.4, 1e-4), cc.Body("journal", 0.2, 2e-5)]
    law = cc.laws.Flores(STIFFNESS, 0.7)
    pin = cc.ClearanceRevolute("pin", "bush", "journal", RADIUS, CLEARANCE, law, FRICTION, profile=GROOVE)
    start = [
        cc.BodyStart("bush", angular_velocity=3.0),
        cc.BodyStart("journal", angular_velocity=-SPIN),
        cc.ClearanceStart("pin", (1e-5, 0.0), (0.3, 0.05)),
    ]
    scene = cc.Scene(bodies, [pin], start=start)
    outputs = ["bush.*", "journal.*", "energy.*", "pin.wear", "pin.wear_*"]
    runs = [
        cc.simulate(scene, duration=0.01, samples=41, outputs=outputs, rtol=1e-9, method=method)
        for method in ("rodas5p", "dop853")
    ]
    run = runs[0]
    assert len(run.contacts) > 5
    *linear, angular = momenta(run)
    np.testing.assert_allclose(angular, angular[0], rtol=1e-9)
    assert np.ptp(linear, axis=1).max() < 1e-9 * 0.2 * 0.3
    assert np.abs(run["energy.balance"]).max() < 1e-6 * run["energy.kinetic"][0]
    parts = sum(run["pin.wear_*"].values())
    np.testing.assert_allclose(parts, run["pin.wear"], rtol=1e-12)
    np.testing.assert_allclose(run["bush.vx"][:9], runs[1]["bush.vx"][:9], atol=1e-6)


@pytest.mark.parametrize("profile", [(), [0.0] * 72])
def test_the_volume_of_a_pressed_journal_is_archard_by_hand(profile):
    """Force times circumference a turn, all of it where the load points; of a foundation the pressures."""
    run = cc.simulate(
        journal(profile=profile, law=cc.laws.HuntCrossley(STIFFNESS, 1.0)),
        skip=TURN,
        duration=3.0 * TURN,
        samples=2,
        outputs=["pin.wear", "pin.wear_*", "pin.normal_force"],
    )
    depths = np.ptp(LAW.depths(run, "pin"), axis=0)
    volume = depths.sum() * LAW.length * (RADIUS + CLEARANCE) * 2.0 * math.pi / 72
    force = LOAD if not profile else run["pin.normal_force"][-1]
    expected = LAW.coefficient / LAW.hardness * force * 3.0 * 2.0 * math.pi * RADIUS
    assert volume == pytest.approx(expected, rel=1e-6)
    assert volume == pytest.approx(LAW.coefficient / LAW.hardness * np.ptp(run["pin.wear"]), rel=1e-12)
    loaded = depths[np.abs((np.arange(72) + 0.5) * 5.0 - 270.0) < 40.0]
    assert loaded.sum() == pytest.approx(depths.sum(), rel=1e-9)


def rigid_life(depth):
    """Turns until a groove of the journal's own radius is so deep: its volume over the wear of a turn."""

    def turns(eccentricity):
        alpha = math.acos(CLEARANCE / eccentricity)
        pressures = LOAD * 2.0 * math.sin(alpha) / (alpha + math.sin(alpha) * math.cos(alpha))
        volume = 2.0 * math.sin(alpha) * (RADIUS + CLEARANCE) * LAW.length
        return volume / (LAW.coefficient / LAW.hardness * pressures * 2.0 * math.pi * RADIUS)

    return quad(turns, CLEARANCE, CLEARANCE + depth)[0]


def life(**options):
    scene = journal(law=cc.laws.HuntCrossley(STIFFNESS, 1.0))
    options = {"limit": 3e-5, "cycle": TURN, "measure": 1, "settle": 1} | options
    return cc.laws.wear_life(scene, {"pin": LAW}, **options)


def test_a_journal_wears_a_groove_of_its_own_radius():
    found = life()
    assert found.end == "depth"
    assert found.life == pytest.approx(rigid_life(3e-5), rel=0.02)
    angle = np.radians((np.arange(72) + 0.5) * 5.0 - 270.0)
    groove = np.maximum((CLEARANCE + 3e-5) * np.cos(angle) - CLEARANCE, 0.0)
    assert np.abs(found.profiles["pin"][-1] - groove).max() < 0.03 * 3e-5
    assert np.all(np.diff(found.depth) > 0.0)
    assert len(found.table.rows) == len(found.cycles)


def test_half_the_jump_changes_the_life_by_less_than_two_percent():
    whole, half = (life(depth_per_jump=depth).life for depth in (4e-6, 2e-6))
    assert half == pytest.approx(whole, rel=0.02)


def test_it_ends_with_what_came_first():
    """The journal sinks: a requirement of its height fails between two runs."""
    found = life(limit=None, requirement=cc.require("journal.y", above=-7e-5))
    assert found.end == "requirement"
    assert found.cycles[-2] < found.life <= found.cycles[-1]
    assert found.values[-2, 0] >= -7e-5 > found.values[-1, 0]
    at_once = life(requirement=cc.require("journal.y", above=-1e-5))
    assert (at_once.end, at_once.life) == ("requirement", 0.0)
    for budget in ({"max_runs": 2}, {"max_cycles": 10.0}):
        found = life(**budget)
        assert (found.end, math.isnan(found.life), len(found.cycles)) == ("budget", True, 2)
    failed = life(max_steps=5)
    assert (failed.end, math.isnan(failed.life), len(failed.cycles)) == ("failed", True, 1)
    assert "steps" in failed.message


BAD_PROFILES = [
    ({"profile": [0.0] * 7}, "profile"),
    ({"profile": [0.0] * 8 + [-1e-6]}, "profile[8]"),
    ({"profile": [math.nan] * 8}, "profile[0]"),
    ({"profile": GROOVE, "law": cc.laws.Hertz(1e9, exponent=1.0)}, "contact.exponent"),
    ({"profile": GROOVE, "law": cc.laws.KelvinVoigt(1e9, 1.0)}, "contact"),
    ({"profile": GROOVE, "friction": cc.laws.StickSlip(0.2, 0.1, 0.0)}, "friction"),
    ({"profile": GROOVE, "friction": FRICTION, "sliding": "contact_point"}, "sliding"),
    ({"profile": GROOVE, "film": cc.laws.ShortBearing(0.02, 0.005, 1e-6)}, "film"),
]


@pytest.mark.parametrize(("options", "field"), BAD_PROFILES)
def test_profiles_that_cannot_be(options, field):
    assert f"joints[0].{field}" in refused(journal(**options))


def test_arguments_that_cannot_be():
    for bad in ({"coefficient": 0.0}, {"hardness": -1.0}, {"length": math.nan}):
        with pytest.raises(ValueError):
            dataclasses.replace(LAW, **bad)
    scene = journal()
    for arguments, options in (
        ({}, {"limit": 1e-5}),
        ({"pin": LAW}, {}),
        ({"pins": LAW}, {"limit": 1e-5}),
        ({"pin": 1e-4}, {"limit": 1e-5}),
        ({"pin": LAW}, {"limit": 0.0}),
        ({"pin": LAW}, {"limit": 1e-5, "depth_per_jump": -1.0}),
        ({"pin": LAW}, {"limit": 1e-5, "measure": 0}),
        ({"pin": LAW}, {"requirement": cc.require("journal.y", above=0.0, at=0.1)}),
        ({"pin": LAW}, {"requirement": cc.require("journal.z", above=0.0)}),
    ):
        with pytest.raises((ValueError, TypeError)):
            cc.laws.wear_life(scene, arguments, cycle=TURN, **options)


def test_settings_that_follow_from_the_cycles_are_refused():
    scene = cc.mechanisms.slider_crank(clearance_at=("wrist",))
    bronze = {"wrist": cc.laws.Archard(coefficient=1e-4, hardness=1e9, length=0.02)}
    for name in ("duration", "skip", "samples", "outputs", "features", "cycles"):
        with refuses(name):
            cc.laws.wear_life(scene, bronze, limit=5e-6, **{name: 1})
    with refuses("cycle", "settle"):
        cc.laws.wear_life(scene, bronze, limit=5e-6, cycle=-1.0, settle=-1)
