"""Friction in ideal joints: closed forms, independent integrations, balance of energy, what ends a run."""

import math

import chebclear as cc
import numpy as np
import pytest
from refusals import refused
from scipy.integrate import solve_ivp, trapezoid

G = 9.81
METHODS = ["dop853", "rodas5p", "auto"]


def pendulum(friction, angle, length=0.5, mass=1.2, inertia=0.02, speed=0.0):
    """A bar on a pin at the origin, whose center of mass hangs below it at the angle zero."""
    bar = cc.Body("bar", mass, inertia, points={"pin": (0.0, length)}, angle=angle)
    start = [cc.JointStart("pin", angle, speed)]
    pin = cc.Revolute("pin", "ground.o", "bar.pin", friction=friction)
    return cc.Scene([bar], [pin], [cc.Gravity((0.0, -G))], ground={"o": (0.0, 0.0)}, start=start)


def block(friction, push=(0.0, 0.0), at=(0.0, 0.0), center=(0.0, 0.0), speed=0.0, gravity=(0.0, -G)):
    """A block on a horizontal guide, whose middle is point b."""
    body = cc.Body("block", 2.0, 0.01, center_of_mass=center, points={"b": (0.0, 0.0), "push": at})
    guide = cc.Prismatic("guide", "ground.o", "block.b", (1.0, 0.0), friction=friction)
    forces = [cc.Gravity(gravity), cc.Force("push", "block.push", *push)]
    start = [cc.JointStart("guide", 0.0, speed)]
    return cc.Scene([body], [guide], forces, ground={"o": (0.0, 0.0)}, start=start)


@pytest.mark.parametrize("method", METHODS)
def test_balanced_rotor_stops_when_its_friction_says(method):
    mu, r, mass, inertia, speed = 0.3, 0.01, 3.0, 0.02, 40.0
    friction = cc.laws.JournalFriction(mu, r)
    scene = pendulum(friction, 0.0, length=0.0, mass=mass, inertia=inertia, speed=speed)
    stops = inertia * speed / (mu / math.hypot(1.0, mu) * r * mass * G)
    run = cc.simulate(
        scene,
        duration=1.2 * stops,
        samples=200,
        outputs=["bar.angle", "bar.angular_velocity", "pin.friction_torque", "energy.balance"],
        rtol=1e-8,
        method=method,
    )
    assert [(event.kind, event.joint) for event in run.events] == [("stick", "pin")]
    assert run.events[0].time == pytest.approx(stops, rel=1e-6)
    at_rest = run.t > stops * 1.01
    assert np.abs(run["bar.angular_velocity"][at_rest]).max() < 1e-6 * speed
    assert np.ptp(run["bar.angle"][at_rest]) < 1e-6
    assert run["pin.friction_torque"][0] == pytest.approx(-inertia * speed / stops, rel=1e-9)
    assert np.abs(run["energy.balance"]).max() < 1e-6 * 0.5 * inertia * speed**2


@pytest.mark.parametrize(("part", "holds"), [(0.98, True), (-0.98, True), (1.02, False)])
def test_pendulum_holds_up_to_the_angle_of_its_friction(part, holds):
    mu, r, length = 0.4, 0.05, 0.5
    limit = math.asin(mu / math.hypot(1.0, mu) * r / length)
    run = cc.simulate(
        pendulum(cc.laws.JournalFriction(mu, r), part * limit), duration=5.0, samples=501, rtol=1e-8
    )
    moved = np.abs(run["bar.angle"] - part * limit).max()
    assert (moved < 1e-7) == holds
    assert bool(run["pin.sticking"].all()) == holds
    # What it holds is the weight.
    if holds:
        torque = 1.2 * G * length * math.sin(part * limit)
        assert run["pin.friction_torque"][-1] == pytest.approx(torque, rel=1e-6)


def swing(mu, r, length, mass, inertia, angle, t_end):
    """Instants and angles at which a pendulum with pin friction turns, from its reaction in polar form."""
    factor, end = mu / math.hypot(1.0, mu) * r, []

    def slope(_, y, s):
        theta, omega = y
        lever = inertia + mass * length**2

        def residual(alpha):
            radial = mass * (length * omega**2 + G * math.cos(theta))
            across = mass * (length * alpha + G * math.sin(theta))
            return (
                lever * alpha + mass * G * length * math.sin(theta) + s * factor * math.hypot(radial, across)
            )

        low, high = -1e3, 1e3
        for _ in range(200):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if residual(middle) > 0.0 else (middle, high)
        return [omega, low]

    def turns(_, y, s):
        return s * y[1] if abs(y[1]) > 0.0 else 1.0

    turns.terminal, turns.direction = True, -1.0
    t, y, s = 0.0, [angle, 0.0], -math.copysign(1.0, angle)
    while t < t_end:
        found = solve_ivp(
            slope, (t, t_end), y, args=(s,), events=turns, rtol=1e-10, atol=1e-12, max_step=0.05
        )
        t, y, s = found.t[-1], [found.y[0, -1], 0.0], -s
        end.append((t, y[0]))
    return end


def test_swinging_pendulum_agrees_with_an_independent_integration():
    mu, r, length, mass, inertia, angle = 0.3, 0.06, 0.5, 1.2, 0.02, 1.4
    expected = swing(mu, r, length, mass, inertia, angle, 3.0)
    scene = pendulum(cc.laws.JournalFriction(mu, r), angle, length, mass, inertia)
    results = []
    for method in METHODS:
        run = cc.simulate(
            scene,
            duration=3.0,
            samples=301,
            outputs=["bar.angle", "bar.angular_velocity", "pin.friction_torque", "energy.balance"],
            rtol=1e-8,
            method=method,
        )
        assert run["bar.angle"][-1] == pytest.approx(expected[-1][1], abs=1e-7)
        turns = [event.time for event in run.events if event.kind == "slip"]
        assert turns == pytest.approx([t for t, _ in expected[:-1]], abs=1e-7)
        assert np.abs(run["energy.balance"]).max() < 1e-6 * mass * G * length
        results.append(run["bar.angle"])
    assert max(np.abs(results[0] - other).max() for other in results[1:]) < 1e-7


@pytest.mark.parametrize(("side", "speed"), [(1.0, 3.0), (-1.0, 3.0), (1.0, -3.0)])
def test_guide_whose_mass_is_aside_amplifies_or_relieves_itself(side, speed):
    mu, a, h = 0.2, 0.1, 0.3 * side
    # All reaction is the moment of the inertia, m h y: y = p / (1 + k) or p / (1 - k).
    scene = block(cc.laws.GuideFriction(mu, a), (4.0, 0.0), center=(0.0, h), speed=speed, gravity=(0.0, 0.0))
    run = cc.simulate(
        scene, duration=0.05, samples=11, outputs=["block.ax", "guide.friction_force"], rtol=1e-9
    )
    push, k = 4.0 / 2.0, mu * abs(h) / a
    acceleration = [
        y for s in (1.0, -1.0) if (y := push / (1.0 + s * k)) * s * math.copysign(1.0, speed) >= 0.0
    ]
    assert run["block.ax"] == pytest.approx(acceleration[0], rel=1e-9)
    assert run["guide.friction_force"] == pytest.approx(2.0 * (acceleration[0] - push), rel=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_guide_beyond_its_bound_has_two_solutions_or_none(method):
    scene = block(
        cc.laws.GuideFriction(0.5, 0.1), (4.0, 0.0), center=(0.0, 0.3), speed=3.0, gravity=(0.0, 0.0)
    )
    with pytest.raises(cc.errors.SimulationError) as error:
        cc.simulate(scene, duration=0.05, samples=11, method=method)
    assert (error.value.reason, error.value.joint, error.value.time) == (
        "friction_indeterminate",
        "guide",
        0.0,
    )
    assert "1.5" in str(error.value)


@pytest.mark.parametrize(("part", "locks"), [(1.02, True), (0.98, False)])
def test_drawer_pushed_far_aside_locks(part, locks):
    mu, a = 0.25, 0.2
    scene = block(cc.laws.GuideFriction(mu, a), (30.0, 0.0), at=(0.0, part * a / mu), gravity=(0.0, 0.0))
    run = cc.simulate(scene, duration=0.5, samples=51, rtol=1e-7)
    moved = np.abs(run["block.x"]).max()
    # 30 N less friction of 0.98 of it, on 2 kg.
    free = 0.5 * 30.0 * (1.0 - part) / 2.0 * 0.5**2
    assert moved < 1e-6 if locks else moved == pytest.approx(free, rel=1e-4)


def test_ends_of_a_block_carry_force_or_moment():
    mu, a = 0.2, 0.1
    for x, carried in [(0.0, 1.0), (0.05, 1.0), (0.3, 3.0)]:
        scene = block(cc.laws.GuideFriction(mu, a), center=(x, 0.0), speed=2.0)
        run = cc.simulate(
            scene, duration=0.01, samples=3, outputs=["guide.friction_force", "guide.friction_power"]
        )
        assert run["guide.friction_force"] == pytest.approx(-mu * carried * 2.0 * G, rel=1e-9)
        assert run["guide.friction_power"][0] == pytest.approx(mu * carried * 2.0 * G * 2.0, rel=1e-9)


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
@pytest.mark.parametrize("driven", [True, False])
def test_pins_of_a_four_bar_lose_what_is_put_in(driven, method):
    friction = cc.laws.JournalFriction(0.2, 0.01)
    bodies = [
        cc.Body("crank", 0.5, 5e-4, points={"a": (-0.05, 0.0), "b": (0.05, 0.0)}, angle=0.6),
        cc.Body("coupler", 1.0, 9e-3, points={"a": (-0.15, 0.0), "b": (0.15, 0.0)}, angle=0.5),
        cc.Body("rocker", 0.8, 4e-3, points={"a": (-0.11, 0.0), "b": (0.11, 0.0)}, angle=1.4),
    ]
    pins = [
        ("o", "ground.o", "crank.a"),
        ("p", "crank.b", "coupler.a"),
        ("q", "coupler.b", "rocker.b"),
        ("r", "ground.r", "rocker.a"),
    ]
    joints = [cc.Revolute(*pin, friction=friction) for pin in pins]
    drives = [cc.motions.Speed("motor", "o", 12.0)] if driven else []
    start = [] if driven else [cc.JointStart("o", velocity=30.0)]
    scene = cc.Scene(
        bodies, joints, [cc.Gravity((0.0, -G))], drives, {"o": (0.0, 0.0), "r": (0.3, 0.0)}, start
    )
    losses = [f"{pin}.friction_loss" for pin, *_ in pins]
    powers = [f"{pin}.friction_power" for pin, *_ in pins]
    energies = [
        "energy.kinetic",
        "energy.input",
        "energy.friction_loss",
        "energy.balance",
        "energy.potential",
    ]
    run = cc.simulate(
        scene,
        duration=1.0,
        samples=401,
        outputs=[*energies, *losses, *powers, "rocker.angle"],
        rtol=1e-8,
        method=method,
    )
    size = run["energy.kinetic"].max()
    assert np.abs(run["energy.balance"]).max() < 1e-6 * size
    assert sum(run[name] for name in losses) == pytest.approx(
        run["energy.friction_loss"], rel=1e-9, abs=1e-12
    )
    stored = run["energy.kinetic"] + run["energy.potential"]
    assert stored - stored[0] == pytest.approx(
        run["energy.input"] - run["energy.friction_loss"], abs=2e-6 * size
    )
    # The loss is the integral of the power, and every pin loses.
    for loss, power in zip(losses, powers, strict=True):
        assert run[power].min() > -1e-9 * run[power].max()
        assert run[loss][-1] == pytest.approx(trapezoid(run[power], run.t), rel=2e-3)


def test_driven_slider_crank_with_one_pin_of_friction_against_statics():
    """The torque of a slow crank holds the friction of its wrist pin, whose reaction is the load."""
    r, length, load, mu, radius = 0.05, 0.2, 1000.0, 0.3, 0.02
    bodies = [
        cc.Body("crank", 1e-6, 1e-9, points={"o": (0.0, 0.0), "a": (r, 0.0)}),
        cc.Body("rod", 1e-6, 1e-9, points={"a": (0.0, 0.0), "b": (length, 0.0)}),
        cc.Body("slider", 1e-6, 1e-9, points={"b": (0.0, 0.0)}),
    ]
    joints = [
        cc.Revolute("main", "ground.o", "crank.o"),
        cc.Revolute("crank_pin", "crank.a", "rod.a"),
        cc.Revolute("wrist", "rod.b", "slider.b", friction=cc.laws.JournalFriction(mu, radius)),
        cc.Prismatic("guide", "ground.o", "slider.b", (1.0, 0.0)),
    ]
    force = cc.Force("load", "slider.b", load, 0.0)
    scene = cc.Scene(
        bodies, joints, [force], [cc.motions.Speed("motor", "main", 1e-3, angle=1.0)], {"o": (0.0, 0.0)}
    )
    run = cc.simulate(
        scene, duration=1.0, samples=3, outputs=["motor.torque", "wrist.friction_torque", "crank.angle"]
    )
    circle = mu / math.hypot(1.0, mu) * radius
    for theta, torque in zip(run["crank.angle"], run["motor.torque"], strict=True):
        # The line of action of the rod passes the crank pin and touches the circle of friction of the wrist.
        beta = math.asin(r * math.sin(theta) / length)
        signs = [beta + s * math.asin(circle / length) for s in (1.0, -1.0)]
        torques = [load * r * (math.sin(theta) + math.cos(theta) * math.tan(b)) for b in signs]
        frictionless = load * r * (math.sin(theta) + math.cos(theta) * math.tan(beta))
        # Friction opposes the motion, forward here.
        assert torque == pytest.approx(max(torques), rel=1e-6) and torque > frictionless


@pytest.mark.parametrize(
    ("joint", "friction", "path"),
    [
        (cc.Revolute, cc.laws.JournalFriction(-0.1, 0.01), ".coefficient"),
        (cc.Revolute, cc.laws.JournalFriction(0.1, 0.0), ".journal_radius"),
        (cc.Revolute, cc.laws.JournalFriction(math.nan, 0.1), ".coefficient"),
        (cc.Prismatic, cc.laws.GuideFriction(0.1, -1.0), ".half_length"),
        (cc.Prismatic, cc.laws.GuideFriction(-1, 1.0), ".coefficient"),
        (cc.Revolute, cc.laws.GuideFriction(0.1, 0.01), ""),
        (cc.Revolute, 0.3, ""),
    ],
)
def test_bad_friction_is_refused_by_its_path(joint, friction, path):
    bar = cc.Body("bar", 1.0, 0.02, points={"pin": (0.0, 0.5)})
    axis = {} if joint is cc.Revolute else {"axis": (1, 0)}
    pin = joint("pin", "ground.o", "bar.pin", friction=friction, **axis)
    assert list(refused(cc.Scene([bar], [pin], ground={"o": (0.0, 0.0)}))) == [f"joints[0].friction{path}"]
