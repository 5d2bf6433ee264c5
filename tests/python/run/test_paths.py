"""Closed loops that drives prescribe follow the path of their motion: closed forms of dyads, jams, tables."""

import math

import chebclear as cc
import numpy as np
import pytest


def dyad(a, b, lengths, side):
    """The pin of two links from two points, on a side of the way between them; complex numbers."""
    first, second = lengths
    way = b - a
    d = np.abs(way)
    along = (first**2 - second**2 + d**2) / (2.0 * d)
    area = (d + first + second) * (first + second - d) * (d - first + second) * (d + first - second)
    return a + (along + 0.5j * side * np.sqrt(area) / d) * way / d


def agree(angles, path):
    """Whether angles follow those of a path from where it begins, with all their turns."""
    path = np.unwrap(path)
    turns = 2.0 * math.pi * np.round((angles[0] - path[0]) / (2.0 * math.pi))
    assert angles == pytest.approx(path + turns, rel=0.0, abs=1e-9)


def grashof(rng, least):
    """Lengths of a four-bar whose crank turns fully, with a margin from `least` to a tenth."""
    while True:
        lengths = rng.uniform(0.1, 1.0, 4)
        short, *middle, _ = np.sort(lengths)
        lengths[np.argmax(lengths)] = sum(middle) - short - 10.0 ** rng.uniform(math.log10(least), -1.0)
        short, *middle, long = np.sort(lengths)
        if 0.05 < short == min(lengths[:2]) and short + long < sum(middle):
            return lengths


def four_bar(lengths, **arguments):
    ground, crank, coupler, rocker = map(float, lengths)
    return cc.mechanisms.four_bar(
        ground_length=ground,
        crank_length=crank,
        coupler_length=coupler,
        rocker_length=rocker,
        clearance_at=(),
        **arguments,
    )


def turn(scene, outputs, samples=3601):
    """A turn, whose samples are those of a run with eleven."""
    fine, coarse = (
        cc.simulate(scene, duration=1.0, samples=count, outputs=outputs) for count in (samples, 11)
    )
    assert coarse.stats.steps == fine.stats.steps
    for name in outputs:
        assert coarse[name] == pytest.approx(fine[name][:: (samples - 1) // 10], rel=0.0, abs=1e-9)
    return fine


def test_a_turn_of_a_four_bar_beside_its_mirror():
    lengths = (0.7, 0.681, 0.976, 0.961)
    run = turn(
        four_bar(lengths, crank_angle=math.pi, crank_speed=2.0 * math.pi), ["rocker.angle", "coupler.angle"]
    )
    assert len(set(np.sign(np.sin(run["rocker.angle"] - run["coupler.angle"])))) == 1
    pin = dyad(-0.681 * np.exp(2j * math.pi * run.t), 0.7, lengths[2:], 1.0)
    agree(run["rocker.angle"], np.angle(pin - 0.7))


@pytest.mark.parametrize("seed", range(30))
def test_turns_of_random_four_bars(seed):
    rng = np.random.default_rng(seed)
    lengths = grashof(rng, 1e-6)
    start, branch = rng.uniform(0.0, 2.0 * math.pi), ["open", "crossed"][seed % 2]
    scene = four_bar(lengths, crank_angle=start, crank_speed=2.0 * math.pi, branch=branch)
    run = turn(scene, ["rocker.angle"], 361)
    tip = lengths[1] * np.exp(1j * (start + 2.0 * math.pi * run.t))
    pin = dyad(tip, lengths[0], lengths[2:], 1.0 if branch == "open" else -1.0)
    agree(run["rocker.angle"], np.angle(pin - lengths[0]))


def bar(name, length, angle, tip=0j):
    points = {"P": (0.0, 0.0), "Q": (float(length), 0.0), "X": (tip.real, tip.imag)}
    return cc.Body(name, 1.0, 1.0, center_of_mass=(0.0, 0.0), points=points, angle=float(angle))


@pytest.mark.parametrize("seed", range(12))
def test_turns_of_random_six_bars(seed):
    """A second dyad on the coupler, which reaches its farthest point with a small margin."""
    rng = np.random.default_rng(seed)
    lengths = grashof(rng, 1e-2)
    ground, crank, coupler, rocker = lengths
    sides, tip, bearing = rng.choice([-1.0, 1.0], 2), complex(*rng.uniform(-0.5, 0.5, 2)), -0.3 - 0.7j

    def path(t):
        crank_pin = crank * np.exp(2j * math.pi * t)
        pin = dyad(crank_pin, ground, (coupler, rocker), sides[0])
        carried = crank_pin + tip * (pin - crank_pin) / coupler
        return crank_pin, pin, carried

    away = np.abs(path(np.linspace(0.0, 1.0, 10_001))[2] - bearing)
    apart = rng.uniform(-1.0, 1.0) * max(away.min() - 0.01, 0.0)
    links = [0.5 * (away.max() + 10.0 ** rng.uniform(-4.0, -2.0) + sign * apart) for sign in (1.0, -1.0)]

    def angles(t):
        crank_pin, pin, carried = path(t)
        knee = dyad(carried, bearing, links, sides[1])
        return [np.angle(way) for way in (pin - crank_pin, pin - ground, knee - carried, knee - bearing)]

    names = ("coupler", "rocker", "link", "arm")
    first = [float(angle[0]) for angle in angles(np.zeros(1))]
    bodies = [
        bar("crank", crank, 0.0),
        bar("coupler", coupler, first[0], tip),
        bar("rocker", rocker, first[1]),
    ]
    bodies += [bar("link", links[0], first[2]), bar("arm", links[1], first[3])]
    joints = [
        cc.Revolute("O", "ground.O", "crank.P"),
        cc.Revolute("A", "crank.Q", "coupler.P"),
        cc.Revolute("B", "coupler.Q", "rocker.Q"),
        cc.Revolute("D", "ground.D", "rocker.P"),
        cc.Revolute("X", "coupler.X", "link.P"),
        cc.Revolute("F", "link.Q", "arm.Q"),
        cc.Revolute("E", "ground.E", "arm.P"),
    ]
    scene = cc.Scene(
        bodies,
        joints,
        drives=[cc.motions.Speed("motor", "O", 2.0 * math.pi, 0.0)],
        ground={"O": (0.0, 0.0), "D": (float(ground), 0.0), "E": (bearing.real, bearing.imag)},
    )
    run = turn(scene, [f"{name}.angle" for name in names], 361)
    for name, expected in zip(names, angles(run.t), strict=True):
        agree(run[f"{name}.angle"], expected)


@pytest.mark.parametrize("method", ["auto", "adams", "dop853", "rodas5p"])
def test_a_driven_loop_that_carries_a_pendulum_keeps_its_assembly(method):
    """The pendulum is integrated. At a loose tolerance a step is wrong by more than the two ways to close the
    loop are apart, where coupler and rocker come in line (margin 4e-7 m)."""
    lengths = [0.17708425042926193, 0.3131294559364898, 0.759990670875751, 0.623945832457931]
    ground, crank, coupler, rocker = lengths
    start = 2.721416827037463

    def pins(t):
        tip = crank * np.exp(1j * (start + 2.0 * math.pi * t))
        return tip, dyad(tip, ground, (coupler, rocker), 1.0)

    tip, pin = pins(0.0)
    bodies = [
        bar("crank", crank, start),
        bar("coupler", coupler, np.angle(pin - tip)),
        bar("rocker", rocker, np.angle(pin - ground)),
        cc.Body("bob", 0.3, 0.01, (0.0, -0.1), points={"P": (0.0, 0.0)}),
    ]
    joints = [
        cc.Revolute("O", "ground.O", "crank.P"),
        cc.Revolute("A", "crank.Q", "coupler.P"),
        cc.Revolute("B", "coupler.Q", "rocker.Q"),
        cc.Revolute("D", "ground.D", "rocker.P"),
        cc.Revolute("X", "coupler.Q", "bob.P"),
    ]
    scene = cc.Scene(
        bodies,
        joints,
        [cc.Gravity((0.0, -9.81))],
        drives=[cc.motions.Speed("motor", "O", 2.0 * math.pi, start)],
        ground={"O": (0.0, 0.0), "D": (ground, 0.0)},
    )
    outputs = ["coupler.angle", "rocker.angle"]
    run = cc.simulate(scene, duration=1.0, samples=1001, rtol=1e-2, method=method, outputs=outputs)
    tip, pin = pins(run.t)
    for name, way in zip(outputs, (pin - tip, pin - ground), strict=True):
        off = np.exp(1j * run[name]) * np.abs(way) / way - 1.0
        assert np.abs(off).max() < 1e-6


def stretched(ground, crank, reach):
    """Angle of the crank at which its pin is at a distance from the other bearing."""
    return math.acos((ground**2 + crank**2 - reach**2) / (2.0 * ground * crank))


@pytest.mark.parametrize("samples", [2, 11, 1001])
@pytest.mark.parametrize(
    ("lengths", "start", "speed", "reach"),
    [((0.3, 0.2, 0.15, 0.12), 0.6, 1.0, 0.27), ((0.5, 0.4, 0.7, 0.3), 2.0, -1.0, 0.4)],
)
@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_a_jam_is_where_coupler_and_rocker_are_in_line(lengths, start, speed, reach, samples):
    scene = four_bar(lengths, crank_angle=start, crank_speed=speed)
    features = [cc.features.peak("rocker.angle")]
    run = cc.simulate(scene, duration=2.0, samples=samples, features=features, on_failure="return")
    assert run.status == "singular_mechanism"
    jam = (stretched(*lengths[:2], reach) - start) / speed
    assert run.end_time == pytest.approx(jam, rel=0.0, abs=1e-9)


@pytest.mark.parametrize("samples", [2, 101])
def test_a_table_ends_where_it_says(samples):
    table = cc.motions.Table([0.0, 1.0], [1.0, 2.0], over="crank.angle")
    crank = cc.Body("crank", 1.0, 1.0)
    scene = cc.Scene(
        [crank],
        [cc.Revolute("O", "ground", "crank")],
        [cc.Torque("load", "crank", table)],
        drives=[cc.motions.Speed("motor", "O", 2.0, 0.25)],
    )
    run = cc.simulate(scene, duration=1.0, samples=samples, on_failure="return")
    assert (run.status, run.failed_load) == ("outside_table", "load")
    assert run.end_time == pytest.approx(0.375, rel=0.0, abs=1e-12)


def test_pieces_of_work_count_as_steps():
    """A follower trembles far faster than its crank turns: the work takes pieces of 1e-6 rad."""
    scene = cc.Scene(
        [cc.Body("crank", 1.0, 1.0), cc.Body("follower", 1.0, 1.0)],
        [cc.Revolute("O", "ground", "crank"), cc.Revolute("P", "ground", "follower")],
        drives=[cc.motions.Speed("motor", "O", 2.0, 0.0)],
        couplings=[cc.motions.Coupling("cam", "follower.angle", "crank.angle", "1e-6*sin(1e6*crank.angle)")],
    )
    run = cc.simulate(
        scene, duration=1.0, samples=2, outputs=["energy.*"], max_steps=1000, on_failure="return"
    )
    assert run.status == "max_steps"
