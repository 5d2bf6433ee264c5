"""Friction that sticks: closed forms, an independent integration, what is kept exactly."""

import dataclasses
import itertools
import math

import chebclear as cc
import numpy as np
import pytest
from refusals import refused

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

METHODS = ["auto", "dop853", "rodas5p", "adams"]
GRAVITY = 9.81


def line(stiffness=1e8):
    return cc.laws.ExactRestitution(stiffness, 0.5, exponent=1.0)


def times(run, kind, joint):
    return np.array([event.time for event in run.events if (event.kind, event.joint) == (kind, joint)])


@pytest.mark.parametrize("method", METHODS)
def test_a_block_on_a_belt_has_the_period_of_stick_and_slip(method):
    """Stuck until the spring pulls with μ_s N, then half a swing with μ_d N."""
    stiffness, speed, weight, drop = 100.0, 0.1, 10.0, 0.2
    law = cc.laws.KelvinVoigt(1e7, 2e3)
    friction = cc.laws.StickSlip(0.4, 0.4 - drop, 0.0, tangential_stiffness=1e7)
    scene = cc.Scene(
        [cc.Body("belt", 1.0, 1.0), cc.Body("block", 1.0, 1.0)],
        [
            cc.Prismatic("rail", "ground", "belt", (1.0, 0.0)),
            cc.Stop("contact", "belt", "block", (0.0, 1.0), law, friction),
        ],
        [cc.Gravity((0.0, -weight)), cc.Spring("spring", "ground.A", "block", stiffness, length=1.0)],
        [cc.motions.Motion("run", "rail", cc.motions.Polynomial([0.0, speed]))],
        ground={"A": (-1.0, 0.0)},
    )
    run = cc.simulate(scene, duration=4.0, samples=2, rtol=1e-8, method=method, outputs=["energy.balance"])
    rate, stretch = math.sqrt(stiffness), drop * weight / stiffness
    period = 2 * stretch / speed + 2 / rate * (math.pi - math.atan(stretch * rate / speed))
    assert period == pytest.approx(0.8068887871591, rel=1e-12)
    # The stiffness of the contact delays it by 1.2e-6, in proportion to 1/k.
    np.testing.assert_allclose(np.diff(times(run, "slip", "contact"))[1:], period, rtol=2e-6)
    assert abs(run["energy.balance"][-1]) < 1e-6


def on_slope(gradient, **more):
    """A block on two corners on a slope whose axis is x."""
    angle = math.atan(gradient)
    friction = cc.laws.StickSlip(0.4, 0.3, 1e-3, **more)
    block = cc.Body("block", 1.0, 1e-3, points={"L": (-0.05, -0.02), "R": (0.05, -0.02)})
    corners = [
        cc.Stop(name, "ground.S", f"block.{point}", (0.0, 1.0), line(), friction)
        for name, point in (("rear", "L"), ("front", "R"))
    ]
    fall = cc.Gravity((GRAVITY * math.sin(angle), -GRAVITY * math.cos(angle)))
    return cc.Scene([block], corners, [fall], ground={"S": (0.0, -0.02)})


@pytest.mark.parametrize("method", METHODS)
def test_a_block_below_the_angle_of_friction_does_not_move(method):
    run = cc.simulate(on_slope(0.35), duration=1.0, samples=1001, method=method, outputs=["*", "front.wear"])
    # It stretches its springs by about as much as it sinks, in the first milliseconds, and stays there.
    assert 0.0 < run["block.x"][-1] < 1e-7
    assert np.ptp(run["block.x"][100:]) < 1e-11
    assert np.all(run["front.sticking"][10:] == 1.0) and np.all(run["rear.sticking"][10:] == 1.0)
    assert np.ptp(run["front.wear"][10:]) == 0.0
    held = run["front.friction_force"][-1] + run["rear.friction_force"][-1]
    assert abs(held) == pytest.approx(GRAVITY * math.sin(math.atan(0.35)), rel=1e-4)


def test_a_block_above_it_slides_with_the_friction_of_sliding():
    run = cc.simulate(on_slope(0.45), duration=0.5, samples=11, rtol=1e-8, outputs=["block.vx", "block.ax"])
    angle = math.atan(0.45)
    gained = GRAVITY * (math.sin(angle) - 0.3 * math.cos(angle)) * 0.25
    assert run["block.vx"][-1] - run["block.vx"][5] == pytest.approx(gained, rel=1e-7)


@pytest.mark.parametrize("part, moves", [(0.9, True), (1.1, False)])
@pytest.mark.parametrize("method", ["auto", "rodas5p"])
def test_a_drawer_locks_for_good_where_the_arm_exceeds_half_the_length_over_the_friction(part, moves, method):
    length, coefficient, force = 0.1, 0.3, 50.0
    block = cc.Body("block", 1.0, 1e-3, points={"P": (0.0, part * 0.5 * length / coefficient)})
    friction = cc.laws.StickSlip(coefficient, coefficient, 0.0)
    law = cc.laws.KelvinVoigt(1e8, 2e4)
    guide = cc.ClearancePrismatic("guide", "ground", "block", (1.0, 0.0), length, 0.05, 1e-3, law, friction)
    scene = cc.Scene([block], [guide], [cc.Force("push", "block.P", force, 0.0)])
    run = cc.simulate(scene, duration=0.5, samples=501, method=method, outputs=["guide.*", "block.ax"])
    if moves:
        # Its tilt shifts the corners by 2 %.
        assert run["block.ax"][-1] == pytest.approx(force * (1.0 - part), rel=0.2)
    else:
        assert np.ptp(run["guide.displacement"][300:]) < 1e-12


def in_bearing(moment, speed=0.0, climbed=0.0, damping=0.0):
    """A journal under a load of 100 N in a bearing with a radius of 10 mm and a clearance of 0.1 mm."""
    friction = cc.laws.StickSlip(0.3, 0.3, 0.0)
    law = cc.laws.LankaraniNikravesh(1e10, 0.9)
    bearing = cc.ClearanceRevolute("bearing", "ground", "journal", 0.01, 1e-4, law, friction)
    forces = [cc.Force("load", "journal", 0.0, -100.0), cc.Torque("moment", "journal", moment)]
    if damping:
        forces.append(cc.TorsionDamper("damper", "ground", "journal", damping))
    eccentricity = 1e-4 + (1e-8 * math.cos(climbed)) ** (2 / 3)
    start = [
        cc.ClearanceStart("bearing", (-eccentricity * math.sin(climbed), -eccentricity * math.cos(climbed))),
        cc.BodyStart("journal", angular_velocity=speed),
    ]
    return cc.Scene([cc.Body("journal", 1.0, 5e-5)], [bearing], forces, start=start)


@pytest.mark.parametrize("method", METHODS)
def test_a_journal_rolls_up_its_bearing_and_stays_where_friction_holds_the_moment(method):
    moment = 0.15
    run = cc.simulate(in_bearing(moment, damping=0.02), duration=0.4, samples=401, method=method)
    climbed = math.asin(moment / (100.0 * 0.01))
    angle = run["journal.angle"]
    assert run["bearing.sticking"][-1] == 1.0
    assert abs(run["bearing.friction_force"][-1]) == pytest.approx(moment / 0.01, rel=1e-6)
    # It rolled by c φ / R, but for what it slipped at the start, and no longer moves.
    assert angle[-1] == pytest.approx(1e-4 * climbed / 0.01, rel=0.2)
    assert np.ptp(angle[-50:]) < 1e-8
    eccentricity = [run[f"bearing.eccentricity_{axis}"][-1] for axis in "xy"]
    assert abs(math.atan2(eccentricity[0], -eccentricity[1])) == pytest.approx(climbed, rel=1e-3)


def test_a_spinning_journal_is_braked_by_the_force_that_carries_the_load():
    run = cc.simulate(in_bearing(0.0, 400.0, math.atan(0.3)), duration=0.05, samples=101, rtol=1e-8)
    braked = 0.3 * 100.0 * 0.01 / math.sqrt(1.0 + 0.3**2) / 5e-5
    np.testing.assert_allclose(run["journal.angular_velocity"], 400.0 - braked * run.t, atol=1e-4 * 400.0)


def return_mapping(speed, slip, spin, stiffness, tangential, coefficient, mass, inertia, radius):
    """A disk that bounces off a plane, by small steps of a spring whose force is cut at Coulomb's limit."""
    steps, depth, rate, held = 100_000, 0.0, speed, 0.0
    dt = 3.0 * (mass / (stiffness * math.sqrt(speed))) ** 0.4 * 2.0 / steps
    for _ in range(steps):
        normal = stiffness * depth**1.5
        held -= tangential * (slip + spin * radius) * dt
        held = min(max(held, -coefficient * normal), coefficient * normal)
        rate -= normal / mass * dt
        slip += held / mass * dt
        spin += held * radius / inertia * dt
        depth += rate * dt
        if depth <= 0.0:
            break
    return slip, spin


@pytest.mark.parametrize("slip", [0.05, 0.3, 1.0])
@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_an_oblique_impact_is_that_of_an_independent_integration(slip, method):
    """A spinning disk: one sticks in the impact, one also slides back, one slides throughout."""
    mass, radius, stiffness, tangential, coefficient, speed = 0.5, 0.02, 1e9, 1.3e7, 0.3, 0.5
    inertia = 0.5 * mass * radius**2
    friction = cc.laws.StickSlip(coefficient, coefficient, 0.0, tangential, damping_ratio=0.0)
    scene = cc.Scene(
        [cc.Body("disk", mass, inertia)],
        [
            cc.PinInSlot(
                "slot", "ground", "disk", (1.0, 0.0), radius, 1e-3, cc.laws.Hertz(stiffness), friction
            )
        ],
        start=[
            cc.GuideStart("slot", offset_rate=-speed),
            cc.BodyStart("disk", angular_velocity=slip / radius),
        ],
    )
    outputs = ["disk.vx", "disk.angular_velocity", "energy.balance", "energy.friction_loss"]
    run = cc.simulate(scene, duration=4e-3, samples=401, rtol=1e-9, method=method, outputs=outputs)
    expected = return_mapping(
        speed, 0.0, slip / radius, stiffness, tangential, coefficient, mass, inertia, radius
    )
    found = run["disk.vx"][-1], run["disk.angular_velocity"][-1] * radius
    np.testing.assert_allclose(found, (expected[0], expected[1] * radius), atol=1e-4 * slip)
    kinds = [event.kind for event in run.events]
    assert kinds[0] == "onset" and kinds[-1] == "separation" and ("stick" in kinds) == (slip < 1.0)
    # The slider only loses, and what it loses is what is missing.
    assert np.diff(run["energy.friction_loss"]).min() >= 0.0
    assert np.abs(run["energy.balance"]).max() < 1e-9 * 0.5 * mass * speed**2


@pytest.mark.parametrize("method", ["auto", "dop853", "rodas5p"])
def test_energies_close_where_friction_falls_within_a_step(method):
    """What the spring carries along falls to a quarter over a thousandth of the speeds of the mechanism."""
    friction = cc.laws.StickSlip(0.7, 0.35, 1e-5)
    outputs = ["energy.balance", "energy.kinetic", "energy.friction_loss"]
    scene = cc.mechanisms.quick_return(friction=friction)
    run = cc.simulate(scene, duration=0.02, samples=51, method=method, outputs=outputs)
    assert {"stick", "slip"} <= set(run.events.kind)
    size = run["energy.kinetic"].max()
    assert np.abs(run["energy.balance"]).max() < 1e-4 * size
    assert np.diff(run["energy.friction_loss"]).min() >= -1e-6 * size


def test_a_contact_that_begins_at_speed_slides_from_its_onset_on():
    """The rod turns about its journal: the velocities of both surfaces tell the direction."""
    scene = cc.mechanisms.four_bar(friction=cc.laws.StickSlip(0.75, 0.75, 0.0))
    run = cc.simulate(scene, duration=0.02, samples=2)
    kinds = list(run.events.kind)
    after = [second for first, second in itertools.pairwise(kinds) if first == "onset"]
    assert run.status == "done" and len(after) > 10 and "slip" not in after


def test_surfaces_that_a_drive_presses_and_moves_stick_where_it_turns_back():
    """No force moves them, so they have no effective mass; the spring still has Mindlin's stiffness."""
    stop = cc.Stop(
        "stop", "ground.F", "block", (0.0, 1.0), cc.laws.Hertz(1e9), cc.laws.StickSlip(0.3, 0.2, 1e-3)
    )
    scene = cc.Scene(
        [cc.Body("block", 1.0, 1e-3), cc.Body("bob", 1.0, 1e-3, points={"A": (-0.1, 0.0)})],
        [cc.Prismatic("slide", "ground", "block", (1.0, -0.2)), cc.Revolute("pin", "ground", "bob.A"), stop],
        drives=[cc.motions.Motion("drive", "slide", cc.motions.Harmonic(0.02, 20.0))],
        ground={"F": (0.0, -5e-4)},
    )
    run = cc.simulate(scene, duration=0.3, samples=301, outputs=["stop.*"])
    kinds = [event.kind for event in run.events]
    assert kinds[:4] == ["onset", "stick", "slip", "separation"]
    assert np.all(np.abs(run["stop.friction_force"]) <= 0.3 * run["stop.normal_force"] * (1 + 1e-9))


def test_sticking_and_sliding_take_turns_in_the_log_and_in_the_output():
    friction = cc.laws.StickSlip(0.2, 0.1, 1e-2)
    scene = cc.mechanisms.slider_crank(friction=friction)
    run = cc.simulate(scene, duration=0.03, samples=2001, outputs=["*", "energy.balance", "energy.kinetic"])
    assert run.status == "done"
    sticks, last = None, 0.0
    for event in run.events:
        inside = (run.t > last) & (run.t < event.time)
        if sticks is not None:
            assert np.all(run["wrist.sticking"][inside] == sticks)
        assert event.kind != {1.0: "stick", 0.0: "slip"}.get(sticks)
        sticks = {"stick": 1.0, "slip": 0.0, "separation": 0.0, "clip": 0.0}.get(event.kind)
        last = event.time
    assert {"stick", "slip"} <= set(run.events.kind)
    assert np.abs(run["energy.balance"]).max() < 1e-4 * run["energy.kinetic"].max()
    plain = cc.mechanisms.slider_crank()
    assert "wrist.sticking" in scene.check().columns and "wrist.sticking" not in plain.check().columns


@pytest.mark.parametrize("method", METHODS)
def test_a_run_goes_on_in_the_phase_in_which_another_ended(method):
    scene = in_bearing(0.15, damping=0.02)
    outputs = ["journal.angle", "bearing.friction_force", "bearing.sticking", "energy.balance"]
    settings = {"samples": 101, "rtol": 1e-8, "method": method, "outputs": outputs}
    whole = cc.simulate(scene, duration=0.02, **settings)
    first = cc.simulate(scene, duration=0.01, **{**settings, "samples": 51})
    second = cc.simulate(scene, duration=0.01, **{**settings, "samples": 51}, start=first.end)
    assert first["bearing.sticking"][-1] == second["bearing.sticking"][0] == 1.0
    assert second["bearing.friction_force"][0] == pytest.approx(
        first["bearing.friction_force"][-1], rel=1e-12
    )
    for name in ("journal.angle", "bearing.friction_force"):
        np.testing.assert_allclose(second[name], whole[name][50:], atol=1e-5 * np.ptp(whole[name]))
    assert np.abs(second["energy.balance"]).max() < 1e-7


def test_bad_numbers_are_refused_together():
    bad = cc.laws.StickSlip(0.2, 0.3, -1.0, tangential_stiffness=0.0, damping_ratio=math.nan)
    scene = in_bearing(0.0)
    joint = dataclasses.replace(scene.joints[0], friction=bad, sliding="contact_point")
    fields = {"sliding_coefficient", "stribeck_velocity", "tangential_stiffness", "damping_ratio"}
    expected = {f"joints[0].friction.{field}" for field in fields} | {"joints[0].sliding"}
    assert set(refused(dataclasses.replace(scene, joints=[joint]))) == expected
