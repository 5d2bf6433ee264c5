"""Several ideal joints with friction come to rest, hold and let go together: statics by linear programs."""

import math

import chebclear as cc
import numpy as np
import pytest
from scipy.optimize import linprog

G = 9.81
GROUND = {"o": (0.0, 0.0), "r": (0.3, 0.0)}
PINS = {
    "o": ("ground.o", "crank.a"),
    "p": ("crank.b", "coupler.a"),
    "q": ("coupler.b", "rocker.b"),
    "r": ("ground.r", "rocker.a"),
}
#: Mass [kg] and half length [m].
BARS = {"crank": (0.5, 0.05), "coupler": (1.0, 0.15), "rocker": (0.8, 0.11)}
MU, RADIUS = 0.4, 0.015
CIRCLE = MU / math.hypot(1.0, MU) * RADIUS
ALIKE = dict.fromkeys(PINS, cc.laws.JournalFriction(MU, RADIUS))


def four_bar(speed=0.0, torque=None, friction=ALIKE):
    angles = (0.6, 0.5, 1.4)
    bodies = [
        cc.Body(name, mass, mass * half**2, points={"a": (-half, 0.0), "b": (half, 0.0)}, angle=angle)
        for (name, (mass, half)), angle in zip(BARS.items(), angles, strict=True)
    ]
    joints = [cc.Revolute(name, *pin, friction=friction.get(name)) for name, pin in PINS.items()]
    forces = [cc.Gravity((0.0, -G))]
    if torque is not None:
        forces.append(cc.Torque("motor", "crank", torque))
    return cc.Scene(bodies, joints, forces, [], GROUND, [cc.JointStart("o", velocity=speed)])


def test_pins_of_a_loop_come_to_rest_together():
    ends = []
    for method in ("dop853", "rodas5p", "auto", "adams"):
        outputs = ["crank.angle", "crank.angular_velocity", "energy.balance", "energy.kinetic"]
        run = cc.simulate(four_bar(8.0), duration=2.2, samples=441, outputs=outputs, rtol=1e-7, method=method)
        sticks = [event for event in run.events if event.kind == "stick"]
        # All four at one instant, for good.
        assert [event.joint for event in run.events[-4:]] == ["o", "p", "q", "r"] and len(sticks) == 4
        assert len({event.time for event in sticks}) == 1 and len(run.events) < 50
        at_rest = run.t > sticks[0].time
        assert at_rest.sum() > 50
        assert np.abs(run["crank.angular_velocity"][at_rest]).max() < 1e-6
        assert np.ptp(run["crank.angle"][at_rest]) < 1e-9
        assert np.abs(run["energy.balance"]).max() < 1e-6 * run["energy.kinetic"].max()
        ends.append((sticks[0].time, run["crank.angle"][-1]))
    times, angles = np.transpose(ends)
    assert np.ptp(times) < 1e-6 and np.ptp(angles) < 1e-5


def places_of(scene):
    """Where the ends and the middles of the bars are at the start."""
    outputs = [f"{body}.{axis}" for body in BARS for axis in ("x", "y", "angle")]
    held = cc.simulate(scene, duration=1e-6, samples=2, outputs=outputs)
    places = {"ground.o": np.array(GROUND["o"]), "ground.r": np.array(GROUND["r"])}
    for body, (_, half) in BARS.items():
        x, y, angle = (held[f"{body}.{name}"][0] for name in ("x", "y", "angle"))
        axis = half * np.array([math.cos(angle), math.sin(angle)])
        places |= {
            body: np.array([x, y]),
            f"{body}.a": np.array([x, y]) - axis,
            f"{body}.b": np.array([x, y]) + axis,
        }
    return places


def largest_torque(places, sense, circles=(CIRCLE,) * 4):
    """The torque on the crank that its pins just hold: linear programs, each with the circles of the last.

    Unknown are the forces and the friction of the pins on the second body of each, and the torque.
    """
    names = list(BARS)
    rows, right = np.zeros((9, 13)), np.zeros(9)
    for k, (first, second) in enumerate(PINS.values()):
        for end, sign in ((first, -1.0), (second, 1.0)):
            body = end.split(".")[0]
            if body == "ground":
                continue
            row = 3 * names.index(body)
            arm = places[end] - places[body]
            rows[row, 2 * k] += sign
            rows[row + 1, 2 * k + 1] += sign
            rows[row + 2, 2 * k : 2 * k + 2] += sign * np.array([-arm[1], arm[0]])
            rows[row + 2, 8 + k] += sign
    right[1::3] = [mass * G for mass, _ in BARS.values()]
    rows[2, 12] = 1.0
    limits = np.zeros(4)
    for _ in range(60):
        bounds = [(None, None)] * 8 + [(-limit, limit) for limit in limits] + [(None, None)]
        cost = np.zeros(13)
        cost[12] = -sense
        found = linprog(cost, A_eq=rows, b_eq=right, bounds=bounds).x
        limits = np.array(circles) * np.hypot(found[0:8:2], found[1:8:2])
    return float(found[12])


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_four_bar_lets_go_at_the_torque_of_statics(sense, method):
    places = places_of(four_bar(torque="0"))
    low, high = largest_torque(places, -1.0), largest_torque(places, 1.0)
    limit, rate = high if sense > 0.0 else low, 0.2 * sense * (high - low)
    scene = four_bar(torque=f"{limit!r} + {rate!r}*(time - 0.1)")
    outputs = ["crank.angular_velocity", "energy.balance"]
    run = cc.simulate(scene, duration=0.4, samples=11, outputs=outputs, rtol=1e-7, method=method)
    slips = run.events[:4]
    assert [(event.joint, event.kind) for event in slips] == [(name, "slip") for name in PINS]
    assert len({event.time for event in slips}) == 1
    assert limit + rate * (slips[0].time - 0.1) == pytest.approx(limit, rel=1e-6)
    assert sense * run["crank.angular_velocity"][-1] > 0.1


@pytest.mark.parametrize(("driven", "held"), [("upper", "elbow"), ("lower", "shoulder")])
def test_pins_of_a_chain_let_go_one_by_one(driven, held):
    pin = cc.laws.JournalFriction(MU, RADIUS)
    bodies = [
        cc.Body(name, mass, 0.01, points={"a": (0.0, 0.1), "b": (0.0, -0.1)})
        for name, mass in (("upper", 1.0), ("lower", 2.0))
    ]
    joints = [
        cc.Revolute("shoulder", "ground.o", "upper.a", friction=pin),
        cc.Revolute("elbow", "upper.b", "lower.a", friction=pin),
    ]
    # The shoulder carries both, the elbow the lower one alone.
    limit = CIRCLE * G * (3.0 if driven == "upper" else 2.0)
    forces = [cc.Gravity((0.0, -G)), cc.Torque("motor", driven, f"{limit!r} * (0.9 + time)")]
    scene = cc.Scene(bodies, joints, forces, [], {"o": (0.0, 0.0)})
    outputs = [f"{held}.sticking", f"{held}.angle"]
    run = cc.simulate(scene, duration=0.15, samples=31, outputs=outputs, rtol=1e-8)
    assert [(event.kind, event.joint) for event in run.events] == [
        ("slip", scene.joints[driven == "lower"].name)
    ]
    assert run.events[0].time == pytest.approx(0.1, abs=1e-6)
    assert run[f"{held}.sticking"].all() and np.ptp(run[f"{held}.angle"]) < 1e-7


@pytest.mark.parametrize("seed", range(8))
def test_random_pins_hold_or_end_typed(seed):
    random = np.random.default_rng(seed)
    dry = random.permutation(list(PINS))[: random.integers(2, 5)]
    friction = {
        name: cc.laws.JournalFriction(*map(float, random.uniform((0.05, 0.004), (0.6, 0.03)))) for name in dry
    }
    torque = f"{random.uniform(0.0, 1.0)} * sin({random.uniform(2.0, 10.0)} * time)"
    scene = four_bar(float(random.uniform(-15.0, 15.0)), torque, friction)
    ends = []
    for method in ("dop853", "rodas5p"):
        outputs = ["crank.angle", "energy.balance", "energy.kinetic"]
        try:
            run = cc.simulate(scene, duration=1.0, samples=101, outputs=outputs, method=method)
        except cc.errors.SimulationError as error:
            assert error.reason == "friction_indeterminate"
            run = error.trajectory
        whole = np.isfinite(run["crank.angle"])
        assert len(run.events) < 100
        assert np.abs(run["energy.balance"][whole]).max() < 2e-6 * run["energy.kinetic"][whole].max()
        ends.append((whole.sum(), run["crank.angle"][whole][-1]))
    assert ends[0] == pytest.approx(ends[1], abs=1e-4)


METHODS = ("dop853", "rodas5p", "rodas4", "adams", "auto")


def hung(margin):
    """A pendulum at rest beside the angle at which its pin just holds it."""
    sine = CIRCLE / 0.3 * (1.0 - margin)
    bar = cc.Body("bar", 1.2, 0.02, points={"pin": (0.0, 0.3)}, angle=math.asin(sine))
    pin = cc.Revolute("pin", "ground.o", "bar.pin", friction=ALIKE["o"])
    return cc.Scene([bar], [pin], [cc.Gravity((0.0, -G))], ground={"o": (0.0, 0.0)}), "bar.angle"


def pushed(margin):
    """A block in a guide, pushed by nearly as much as it just holds."""
    block = cc.Body("block", 2.0, 0.01, points={"b": (0.0, 0.0)})
    guide = cc.Prismatic("guide", "ground.o", "block.b", (1.0, 0.0), friction=cc.laws.GuideFriction(0.3, 0.1))
    forces = [cc.Gravity((0.0, -G)), cc.Force("push", "block.b", 0.3 * 2.0 * G * (1.0 - margin), 0.0)]
    return cc.Scene([block], [guide], forces, ground={"o": (0.0, 0.0)}), "block.x"


@pytest.mark.parametrize("scene", [hung, pushed])
@pytest.mark.parametrize("exponent", [2, 4, 6, 9])
def test_what_is_held_near_its_limit_neither_creeps_nor_chatters(scene, exponent):
    for method in METHODS:
        for samples in (2, 1001):
            held, output = scene(10.0**-exponent)
            run = cc.simulate(
                held, duration=1000.0, samples=samples, outputs=[output], method=method, rtol=1e-4
            )
            assert not run.events and run.stats.steps < 50
            assert np.ptp(run[output]) < 1e-15
        free, output = scene(-(10.0**-exponent))
        run = cc.simulate(free, duration=0.05, samples=2, outputs=[output], method=method)
        assert not run.events
        # As long as the balance changes little: half of acceleration times the time squared.
        if scene is pushed:
            travel = 0.5 * 0.3 * G * 10.0**-exponent * 0.05**2
            assert run["block.x"][-1] == pytest.approx(travel, rel=1e-6)
        else:
            assert run["bar.angle"][-1] < run["bar.angle"][0]


@pytest.mark.parametrize("part", [0.999, 1.0001, 1.001, 1.01])
def test_block_on_a_shaken_table_sticks_or_slips_at_every_turn(part):
    # The load of what sticks is that of the drive alone: nothing that moves tells it to the steps.
    mu, rate, turns = 0.4, 20.0, 40
    amplitude = part * mu * G / rate**2
    table = cc.Body("table", 5.0, 0.1, points={"m": (0.0, 0.0)})
    block = cc.Body("block", 2.0, 0.01, points={"b": (0.0, 0.0)})
    joints = [
        cc.Prismatic("way", "ground.o", "table.m", (1.0, 0.0)),
        cc.Prismatic("top", "table.m", "block.b", (1.0, 0.0), friction=cc.laws.GuideFriction(mu, 0.1)),
    ]
    drive = cc.motions.Motion("shaker", "way", cc.motions.Harmonic(amplitude, rate))
    scene = cc.Scene(
        [table, block], joints, [cc.Gravity((0.0, -G))], drives=[drive], ground={"o": (0.0, 0.0)}
    )
    first = math.acos(1.0 / part) if part > 1.0 else None
    for method in METHODS:
        run = cc.simulate(
            scene,
            duration=turns * math.pi / rate,
            samples=11,
            outputs=["table.x", "block.x"],
            method=method,
            rtol=1e-7,
        )
        slips = [event.time for event in run.events if event.kind == "slip"]
        if first is None:
            assert not run.events and np.ptp(run["block.x"] - run["table.x"]) < 1e-9 * amplitude
        else:
            # The acceleration of the table is largest where its displacement is.
            assert len(slips) == turns
            expected = (0.5 * math.pi - first + np.arange(turns) * math.pi) / rate
            assert np.abs(np.array(slips) - expected).max() < 1e-6


@pytest.mark.parametrize("seed", range(6))
def test_slow_ramps_let_go_at_the_linear_program(seed):
    random = np.random.default_rng(seed)
    friction = {
        name: cc.laws.JournalFriction(*map(float, random.uniform((0.1, 0.004), (0.6, 0.015))))
        for name in PINS
    }
    places = places_of(four_bar(torque="0", friction=friction))
    circles = [
        law.coefficient / math.hypot(1.0, law.coefficient) * law.journal_radius for law in friction.values()
    ]
    low, high = (largest_torque(places, sense, circles) for sense in (-1.0, 1.0))
    middle, slow = 0.5 * (low + high), 10.0 ** (seed % 3)
    torque = f"{middle!r} + {high - middle!r}*time/{slow!r}"
    for method in METHODS:
        run = cc.simulate(
            four_bar(torque=torque, friction=friction),
            duration=1.2 * slow,
            samples=3,
            method=method,
            rtol=1e-4,
        )
        slips = run.events[:4]
        assert [(event.joint, event.kind) for event in slips] == [(name, "slip") for name in PINS]
        assert slips[0].time == pytest.approx(slow, rel=1e-6)


def test_five_bar_comes_to_rest_once():
    # Of its five pins three are more than statics asks for.
    names = ["left", "first", "second", "right"]
    angles = (2.1, 0.9, 2.2, 1.0)
    bodies = [
        cc.Body(name, 0.5, 1e-3, points={"a": (-0.1, 0.0), "b": (0.1, 0.0)}, angle=angle)
        for name, angle in zip(names, angles, strict=True)
    ]
    pins = [
        ("ground.o", "left.a"),
        ("left.b", "first.a"),
        ("first.b", "second.b"),
        ("right.b", "second.a"),
        ("ground.r", "right.a"),
    ]
    law = cc.laws.JournalFriction(0.6, 0.03)
    joints = [cc.Revolute(f"pin{k}", *pin, friction=law) for k, pin in enumerate(pins)]
    start = [cc.JointStart("pin0", velocity=3.0), cc.JointStart("pin4", velocity=-1.5)]
    scene = cc.Scene(bodies, joints, [cc.Gravity((0.0, -G))], [], {"o": (0.0, 0.0), "r": (0.3, 0.0)}, start)
    ends = []
    for method in ("dop853", "rodas5p", "adams"):
        runs = [
            cc.simulate(
                scene,
                duration=20.0,
                samples=samples,
                outputs=["*.angle", "*.angular_velocity"],
                method=method,
            )
            for samples in (2, 301)
        ]
        # Samples change nothing.
        assert runs[0].events == runs[1].events and len(runs[1].events) < 60
        run = runs[1]
        at_rest = run.t > run.events[-1].time
        assert at_rest.sum() > 100
        for name in names:
            assert np.abs(run[f"{name}.angular_velocity"][at_rest]).max() < 1e-10
            assert np.ptp(run[f"{name}.angle"][at_rest]) < 1e-10
        ends.append([run[f"{name}.angle"][-1] for name in names])
    assert np.ptp(ends, axis=0).max() < 1e-4


@pytest.mark.parametrize("method", METHODS)
def test_pins_turned_back_at_dead_centers_are_no_events(method):
    # The crank turns on: no pin of the rocker can rest where the mechanism turns it back.
    for rtol in (1e-3, 1e-7):
        outputs = ["crank.angular_velocity", "q.angular_velocity", "r.angular_velocity", "energy.balance"]
        run = cc.simulate(
            four_bar(40.0), duration=0.4, samples=401, outputs=outputs, rtol=rtol, method=method
        )
        assert run["crank.angular_velocity"].min() > 0.0 and not run.events
        for pin in "qr":
            assert np.sum(np.diff(np.sign(run[f"{pin}.angular_velocity"])) != 0.0) >= 2
        assert np.abs(run["energy.balance"]).max() < rtol * 40.0**2


@pytest.mark.parametrize("method", METHODS)
def test_a_slide_that_grazes_rest_changes_its_phase_there_alone(method):
    # A block drawn by a spring whose end moves slowly: its velocity is pull (1 - cos(rate t)) from the limit.
    pull, rate, periods = 0.01, 10.0, 20
    stiffness, limit = 2.0 * rate**2, 0.3 * 2.0 * G
    start = limit / (stiffness * pull)
    block = cc.Body("block", 2.0, 0.01, points={"b": (0.0, 0.0), "edge": (0.1, 0.0)})
    guide = cc.Prismatic("guide", "ground.o", "block.b", (1.0, 0.0), friction=cc.laws.GuideFriction(0.3, 0.1))
    spring = cc.Force("spring", "block.b", f"{stiffness}*({pull}*time - block.x)", 0.0)
    scene = cc.Scene([block], [guide], [cc.Gravity((0.0, -G)), spring], ground={"o": (0.0, 0.0)})
    duration = start + (periods + 0.5) * 2.0 * math.pi / rate
    for rtol in (1e-4, 1e-7):
        run = cc.simulate(
            scene, duration=duration, samples=501, outputs=["block.x"], method=method, rtol=rtol
        )
        first, *others = [event.time for event in run.events]
        assert first == pytest.approx(start, rel=1e-9)
        # It rests for an instant once a period.
        assert len(others) <= 2 * periods
        period = (np.array(others) - start) * rate / (2.0 * math.pi)
        assert np.abs(period - np.round(period)).max(initial=0.0) < 0.1
        phase = rate * np.maximum(run.t - start, 0.0)
        assert np.abs(run["block.x"] - pull / rate * (phase - np.sin(phase))).max() < 10.0 * rtol
