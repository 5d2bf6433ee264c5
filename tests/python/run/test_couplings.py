"""Gears, racks, belts, cams: coordinates that follow others, against closed forms."""

import math
from dataclasses import replace

import chebclear as cc
import numpy as np
import pytest
from chebclear.motions import Coupling, Harmonic, Motion, Speed, Table
from refusals import refused
from scipy.optimize import brentq

G = 9.81
METHODS = ("dop853", "adams", "rodas4", "rodas5p", "auto")
GROUND = {"A": (0.0, 0.0), "B": (0.3, 0.0)}


def wheels(*couplings, bodies=(), joints=(), **kwargs):
    """Two wheels on ground and a rod that slides upwards."""
    own = [cc.Body("a", 1.0, 0.01), cc.Body("b", 2.0, 0.2), cc.Body("rod", 2.0, 0.1)]
    pins = [
        cc.Revolute("p", "ground.A", "a"),
        cc.Revolute("q", "ground.B", "b"),
        cc.Prismatic("slide", "ground.A", "rod", axis=(0.0, 1.0)),
    ]
    return cc.Scene([*own, *bodies], [*pins, *joints], ground=GROUND, couplings=couplings, **kwargs)


def planetary(couplings, sun=0.12, planet=0.05):
    """A planet, a disk of 0.8 kg, on a light arm that hangs from ground."""
    length = sun + planet
    arm = cc.Body(
        "arm", 1e-9, 1e-12, points={"O": (0.0, 0.0), "P": (length, 0.0)}, angle=1e-3 - 0.5 * math.pi
    )
    disk = cc.Body("planet", 0.8, 0.4 * planet**2)
    joints = [cc.Revolute("axle", "ground", "arm.O"), cc.Revolute("pin", "arm.P", "planet")]
    return cc.Scene([arm, disk], joints, [cc.Gravity((0.0, -G))], couplings=couplings)


@pytest.mark.parametrize("method", METHODS)
def test_a_planet_on_a_sun_that_stands_still_swings_with_its_inertia_and_that_of_its_rolling(method):
    ratio = 0.12 / 0.05
    forms = [
        Coupling("mesh", "planet.angle", "ground.angle", -ratio, carrier="arm"),
        Coupling("mesh", "pin.angle", "axle.angle", ratio),
    ]
    period = 2.0 * math.pi * math.sqrt(1.5 * 0.17 / G) * (1.0 + 1e-6 / 16.0)
    for coupling in forms:
        scene = planetary([coupling])
        assert scene.check().degrees_of_freedom == 1
        # A quarter of a period after the start it hangs straight down.
        run = cc.simulate(
            scene,
            duration=0.25 * period,
            samples=2,
            rtol=1e-9,
            method=method,
            outputs=["*.angle", "energy.*"],
        )
        assert run["arm.angle"][-1] == pytest.approx(-0.5 * math.pi, abs=1e-10)
        turned = run["planet.angle"][-1] - run["planet.angle"][0]
        assert turned == pytest.approx(
            (1.0 + ratio) * (run["arm.angle"][-1] - run["arm.angle"][0]), rel=1e-12
        )
        assert abs(run["energy.balance"][-1]) < 1e-9 * 0.8 * G * 0.17 * 0.5e-6


def test_willis():
    teeth = {"sun": 20, "planet": 20, "ring": 60}
    bodies = [cc.Body(name, 1.0, 0.01) for name in ("sun", "arm", "planet")]
    joints = [
        cc.Revolute("p", "ground", "sun"),
        cc.Revolute("q", "ground", "arm"),
        cc.Revolute("r", "arm.P", "planet"),
    ]
    bodies[1] = cc.Body("arm", 1.0, 0.01, points={"P": (0.1, 0.0)})
    inner = Coupling("inner", "planet.angle", "sun.angle", -teeth["sun"] / teeth["planet"], "arm")
    outer = Coupling("outer", "planet.angle", "ground.angle", teeth["ring"] / teeth["planet"], "arm")
    scene = cc.Scene(
        bodies,
        joints,
        [cc.Torque("load", "arm", -8.0)],
        [Speed("motor", "p", 100.0)],
        couplings=[inner, outer],
    )
    run = cc.simulate(scene, duration=1.0, samples=5)
    assert run["arm.angular_velocity"] == pytest.approx(np.full(5, 100.0 * 20 / 80))
    assert run["planet.angular_velocity"] == pytest.approx(np.full(5, 25.0 - 25.0 * 3))
    # Power in is power out; the planet turns evenly, so that its two torques cancel.
    assert run["motor.torque"] == pytest.approx(np.full(5, 8.0 * 20 / 80))
    assert run["inner.torque"] + run["outer.torque"] == pytest.approx(np.zeros(5), abs=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_two_wheels_have_the_inertia_of_both(method):
    ratio = -0.4
    scene = wheels(Coupling("mesh", "b.angle", "a.angle", ratio), forces=[cc.Torque("motor", "a", 3.0)])
    run = cc.simulate(scene, duration=10.0, samples=11, method=method, rtol=1e-9)
    rate = 3.0 / (0.01 + ratio**2 * 0.2)
    assert run["a.angle"][-1] == pytest.approx(50.0 * rate, rel=1e-9)
    # After 568 turns no digit of the mesh is lost.
    assert abs(run["b.angle"] - ratio * run["a.angle"]).max() < 4e-16 * run["a.angle"][-1]
    assert run["mesh.torque"] == pytest.approx(np.full(11, 0.2 * ratio * rate))
    assert run["mesh.driver_torque"] == pytest.approx(np.full(11, 0.01 * rate - 3.0))


@pytest.mark.parametrize("reverse", [False, True])
def test_a_rack_falls_with_its_pinion(reverse):
    ends, sign = (("rod", "ground.A"), -1.0) if reverse else (("ground.A", "rod"), 1.0)
    scene = wheels(Coupling("mesh", "slide.displacement", "a.angle", 0.05), forces=[cc.Gravity((2.0, -G))])
    slide = cc.Prismatic("slide", *ends, axis=(0.0, sign))
    scene = cc.Scene(
        scene.bodies, [*scene.joints[:2], slide], scene.forces, (), scene.ground, (), scene.couplings
    )
    outputs = ["slide.*", "mesh.*", "p.reaction_torque", "energy.balance"]
    run = cc.simulate(scene, duration=2.0, samples=5, outputs=outputs)
    acceleration = -G / (1.0 + 0.01 / 0.05**2 / 2.0)
    assert run["slide.displacement"][-1] == pytest.approx(2.0 * acceleration, rel=1e-9)
    # The tooth carries the rack along its guide, which carries it across.
    assert run["mesh.force"] == pytest.approx(np.full(5, 2.0 * (acceleration + G)))
    assert run["slide.reaction_x"] == pytest.approx(np.full(5, sign * -4.0))
    assert run["slide.reaction_y"] == pytest.approx(np.zeros(5), abs=1e-12)
    assert abs(run["energy.balance"]).max() < 1e-10


def test_a_belt_on_an_arm_keeps_the_direction_of_its_pulley():
    arm = cc.Body("arm", 1.0, 0.01, points={"P": (0.2, 0.0)})
    lamp = cc.Body("lamp", 1.0, 0.01, angle=0.3)
    joints = [cc.Revolute("p", "ground", "arm"), cc.Revolute("q", "arm.P", "lamp")]
    belt = Coupling("belt", "lamp.angle", "ground.angle", 1.0, carrier="arm")
    scene = cc.Scene([arm, lamp], joints, [cc.Torque("m", "arm", 0.1)], couplings=[belt])
    run = cc.simulate(scene, duration=5.0, samples=21)
    assert run["arm.angle"][-1] > 6.0
    assert run["lamp.angle"] == pytest.approx(np.full(21, 0.3), abs=1e-12)


TURN = np.linspace(0.0, 2.0 * math.pi, 37)
LIFT = 0.01 * (1.0 - np.cos(TURN))
LIFT[-1] = LIFT[0]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("law", "tolerance"),
    [("0.01*(1 - cos(p.angle))", 1e-9), (Table(TURN, LIFT, periodic=True), 3e-3)],
    ids=["formula", "table"],
)
def test_the_force_of_a_cam_is_that_of_its_law(method, law, tolerance):
    cam = Coupling("cam", "slide.displacement", "p.angle", law)
    gravity = [cc.Gravity((0.0, -G))]
    outputs = ["p.*", "slide.*", "cam.*", "energy.balance", "energy.total"]
    driven = wheels(cam, forces=gravity, drives=[Speed("motor", "p", 30.0)])
    driven = cc.simulate(driven, duration=0.5, samples=201, outputs=[*outputs, "motor.torque"])
    start = [cc.JointStart("p", 0.3, 30.0)]
    free = cc.simulate(
        wheels(cam, forces=gravity, start=start),
        duration=0.5,
        samples=201,
        method=method,
        rtol=1e-8,
        outputs=outputs,
    )
    for run in (driven, free):
        angle, speed, rate = (
            run[f"p.{name}"] for name in ("angle", "angular_velocity", "angular_acceleration")
        )
        lift, slope, bend = 0.01 * (1.0 - np.cos(angle)), 0.01 * np.sin(angle), 0.01 * np.cos(angle)
        force = 2.0 * (G + bend * speed**2 + slope * rate)
        assert abs(run["slide.displacement"] - lift).max() < 0.02 * tolerance * 0.01 + 1e-15
        assert abs(run["cam.force"] - force).max() < tolerance * abs(force).max()
        assert run["cam.driver_torque"] == pytest.approx(-slope * run["cam.force"], abs=tolerance)
    assert driven["motor.torque"] == pytest.approx(-driven["cam.driver_torque"], abs=1e-12)
    assert abs(free["energy.balance"]).max() < 1e-7 * abs(free["energy.total"]).max()


@pytest.mark.parametrize("method", ("dop853", "auto"))
def test_a_valve_leaves_the_tappet_of_its_cam_where_the_spring_is_too_weak(method):
    lift, mass, stiffness, preload, speed = 0.01, 0.1, 2e3, 10.0, 300.0
    bodies = [cc.Body("cam", 0.5, 2e-4), cc.Body("tappet", 0.05, 1e-5), cc.Body("valve", mass, 1e-5)]
    contact = cc.laws.ExactRestitution(stiffness=1e11, restitution=0.6)
    joints = [
        cc.Revolute("shaft", "ground", "cam"),
        cc.Prismatic("bore", "ground", "tappet", axis=(0.0, 1.0)),
        cc.Prismatic("guide", "ground", "valve", axis=(0.0, 1.0)),
        cc.Stop("flank", "tappet", "valve", normal=(0.0, 1.0), contact=contact),
    ]
    rest = 0.1 + preload / stiffness
    scene = cc.Scene(
        bodies,
        joints,
        [cc.Spring("spring", "ground.top", "valve", stiffness=stiffness, length=rest)],
        [Speed("motor", "shaft", speed)],
        ground={"top": (0.0, 0.1)},
        couplings=[Coupling("law", "bore.displacement", "shaft.angle", f"{lift}*(1 - cos(shaft.angle))")],
    )
    run = cc.simulate(scene, duration=0.03, samples=2, method=method, rtol=1e-8)

    def height(time):
        return lift * (1.0 - math.cos(speed * time))

    # A rigid flank carries what the spring presses and the acceleration needs; without it the valve swings.
    leaves = brentq(
        lambda time: preload + stiffness * height(time) + mass * lift * speed**2 * math.cos(speed * time),
        0.0,
        math.pi / speed,
    )
    frequency, rate = math.sqrt(stiffness / mass), lift * speed * math.sin(speed * leaves)

    def gap(time):
        angle = frequency * (time - leaves)
        swing = (height(leaves) + preload / stiffness) * math.cos(angle)
        return swing + rate / frequency * math.sin(angle) - preload / stiffness - height(time)

    lands = brentq(gap, 0.015, 0.03)
    separation, onset = run.events[:2]
    assert (separation.kind, onset.kind) == ("separation", "onset")
    # The flank parts from its vibration without an impact, which takes a moment.
    assert separation.time == pytest.approx(leaves, abs=0.01 / speed)
    assert onset.time == pytest.approx(lands, abs=1e-3 / speed)


@pytest.mark.parametrize("lowest", [1e-3, 1e-5, 1e-7])
def test_a_cam_that_is_driven_backwards_near_its_dwell_takes_the_work_of_its_kinetic_energy(lowest):
    # The lift falls from 8 mm to the lowest and rises again: the cam turns back there in next to no time.
    lift, amplitude, speed = 0.01, 0.004, 10.0
    motion = Motion("d", "slide", f"{lowest} + {amplitude}*(1 + cos({speed}*time))")
    cam = Coupling("cam", "slide.displacement", "p.angle", f"{lift}*(1 - cos(p.angle))")
    scene = wheels(cam, drives=[motion])
    scene = replace(scene, bodies=[replace(scene.bodies[0], angle=1.4), *scene.bodies[1:]])
    time = np.linspace(0.0, 0.6, 61)
    run = cc.simulate(scene, duration=0.6, samples=61, outputs=["energy.*", "p.angular_velocity"])
    raised = lowest + amplitude * (1.0 + np.cos(speed * time))
    rate = -amplitude * speed * np.sin(speed * time)
    turning = rate / np.sqrt(raised * (2.0 * lift - raised))
    kinetic = 0.5 * 2.0 * rate**2 + 0.5 * 0.01 * turning**2
    assert run["p.angular_velocity"] == pytest.approx(turning, abs=1e-9 * abs(turning).max())
    assert abs(run["energy.input"] - (kinetic - kinetic[0])).max() < 1e-7 * kinetic.max()
    assert abs(run["energy.balance"]).max() < 1e-7 * kinetic.max()


def test_a_geneva_wheel_goes_on_by_a_quarter_every_turn():
    driven = 0.25 * TURN - 0.2 * np.sin(TURN)
    driven[-1] = 0.5 * math.pi
    law = Table(TURN, driven, periodic=True)
    scene = wheels(Coupling("geneva", "b.angle", "a.angle", law), drives=[Speed("motor", "p", 1.0)])
    run = cc.simulate(scene, duration=2000 * math.pi, samples=1001)
    assert run["b.angle"] == pytest.approx(0.5 * math.pi * np.arange(1001), abs=1e-11)
    assert run["b.angular_velocity"] == pytest.approx(np.full(1001, 0.05), abs=2e-4)


def test_a_law_over_a_stroke_ends_with_its_table():
    law = Table([-0.1, 0.0, 0.1, 0.2], [-0.3, 0.0, 0.3, 0.6])
    scene = wheels(
        Coupling("lever", "b.angle", "slide.displacement", law), start=[cc.JointStart("slide", 0.0, 0.1)]
    )
    with pytest.raises(cc.errors.SimulationError) as caught:
        cc.simulate(scene, duration=5.0, samples=11)
    run = caught.value.trajectory
    assert (run.status, run.failed_load) == ("outside_table", "lever")
    assert caught.value.time == pytest.approx(2.0, abs=1e-6)


def five_bar(ratio=1.0, offset=None, **kwargs):
    """Two cranks on ground that a gear pair ties, and two rods between them."""

    def bar(name, length, angle):
        points = {"A": (0.0, 0.0), "B": (length, 0.0)}
        return cc.Body(name, 1.0, 0.01, (0.5 * length, 0.0), points=points, angle=angle)

    bodies = [bar("left", 0.1, 0.5), bar("rod", 0.3, 0.9), bar("other", 0.3, 2.2), bar("right", 0.1, 1.4)]
    joints = [
        cc.Revolute("p", "ground.A", "left.A"),
        cc.Revolute("q", "ground.B", "right.A"),
        cc.Revolute("r", "left.B", "rod.A"),
        cc.Revolute("s", "right.B", "other.A"),
        cc.Revolute("t", "rod.B", "other.B"),
    ]
    mesh = Coupling("mesh", "right.angle", "left.angle", ratio, offset=offset)
    return cc.Scene(bodies, joints, [cc.Gravity((0.0, -G))], ground=GROUND, couplings=[mesh], **kwargs)


@pytest.mark.parametrize("method", METHODS)
def test_a_geared_five_bar_keeps_its_energy_and_its_phase(method):
    scene = five_bar(-1.0, offset=2.0, start=[cc.BodyStart("left", angular_velocity=20.0)])
    assert scene.check().degrees_of_freedom == 1
    outputs = ["*.angle", "energy.*"]
    run = cc.simulate(scene, duration=2.0, samples=101, method=method, rtol=1e-8, outputs=outputs)
    total = run["left.angle"] + run["right.angle"] - 2.0
    assert abs(total - 2.0 * math.pi * np.round(total / (2.0 * math.pi))).max() < 1e-12
    assert abs(run["energy.balance"]).max() < 1e-7 * run["energy.kinetic"].max()
    # Continued from the middle it is the same motion.
    first = cc.simulate(scene, duration=1.0, samples=51, method=method, rtol=1e-8, outputs=outputs)
    second = cc.simulate(
        scene, duration=1.0, samples=51, method=method, rtol=1e-8, outputs=outputs, start=first.end
    )
    assert second["left.angle"] == pytest.approx(run["left.angle"][50:], abs=2e-5)
    assert second["right.angle"] + second["left.angle"] == pytest.approx(total[50:] + 2.0, abs=1e-12)


def test_wheels_stay_as_the_start_put_them_together():
    scene = five_bar(2.0)
    facts = scene.check()
    angles = dict(zip(facts.bodies, (pose[2] for pose in facts.poses), strict=True))
    run = cc.simulate(scene, duration=0.3, samples=11)
    kept = run["right.angle"] - 2.0 * run["left.angle"]
    assert kept == pytest.approx(np.full(11, angles["right"] - 2.0 * angles["left"]), abs=1e-12)


def test_modes_know_couplings():
    scene = wheels(
        Coupling("mesh", "b.angle", "a.angle", -0.4),
        Coupling("rack", "slide.displacement", "a.angle", 0.05),
        forces=[cc.TorsionSpring("spring", "ground", "b", stiffness=50.0)],
    )
    inertia = 0.01 + 0.4**2 * 0.2 + 0.05**2 * 2.0
    found = cc.modes(scene)
    assert found.frequencies == pytest.approx(
        [math.sqrt(50.0 * 0.4**2 / inertia) / (2.0 * math.pi)], rel=1e-9
    )


MESH = Coupling("mesh", "b.angle", "a.angle", -0.5)
LAW = "couplings[0].law"


@pytest.mark.parametrize(
    ("law", "path", "ends"),
    [
        (Table(TURN, TURN), LAW, ("slide.displacement", "a.angle")),
        (Table(TURN, TURN, periodic=True), LAW, ("slide.displacement", "a.angle")),
        (Table([0, 180, 360], [0, 1, 0], periodic=True), LAW, ()),
        (Table(TURN, 0.11 * TURN, periodic=True), LAW, ()),
        (Table(TURN, LIFT, interpolation="linear", periodic=True), f"{LAW}.interpolation", ()),
        (Table(TURN, LIFT, over="q.angle", periodic=True), f"{LAW}.over", ()),
        (Table([0, 1], [0, 1], periodic=True), LAW, ("b.angle", "slide.displacement")),
        (0.0, LAW, ()),
        (None, LAW, ()),
        ("abs(a.angle)", LAW, ()),
        ("a.angle + q.angle", LAW, ()),
        ("sin(slide.displacement)", LAW, ("b.angle", "slide.displacement")),
        ("sqrt(a.angle - 10)", LAW, ()),
        ("sqrt(a.angle)", LAW, ()),
        (1.0, "couplings[0].driven", ("b.angel", "a.angle")),
        (1.0, "couplings[0].driven", ("rod.angle", "a.angle")),
        (1.0, "couplings[0].driver", ("b.angle", "a.angular_velocity")),
        (1.0, "couplings[0].driver", ("b.angle", "b.angle")),
        (1.0, "couplings[0].driver", ("b.angle", "p.angle", "rod")),
        (1.0, "couplings[0].carrier", ("b.angle", "a.angle", "arm")),
        (1.0, "couplings[0].offset", ("b.angle", "a.angle", None, math.inf)),
    ],
)
def test_laws_and_names_that_cannot_be_are_refused_with_their_path(law, path, ends):
    driven, driver, *more = ends or ("b.angle", "a.angle")
    assert list(refused(wheels(Coupling("x", driven, driver, law, *more)))) == [path]


@pytest.mark.parametrize(
    ("couplings", "path", "drives"),
    [
        ([MESH, Coupling("again", "b.angle", "a.angle", -0.6)], "couplings[1]", []),
        ([MESH, Coupling("again", "a.angle", "b.angle", -2.0)], "couplings[1]", []),
        ([MESH], "couplings[0]", [Speed("d", "p", 3.0), Speed("e", "q", -1.5)]),
        (
            [Coupling("cam", "slide.displacement", "a.angle", "0.01*(1 - cos(a.angle))")],
            "couplings[0]",
            [Motion("d", "slide", Harmonic(0.001, 3.0))],
        ),
        ([Coupling("p", "b.angle", "a.angle", 1.0)], "couplings[0].name", []),
        ([MESH, MESH], "couplings[1].name", []),
    ],
)
def test_what_locks_or_is_tied_twice_is_refused_with_its_path(couplings, path, drives):
    assert list(refused(wheels(*couplings, drives=drives))) == [path]


def test_a_pitch_radius_in_millimeters_is_doubted():
    (notice,) = wheels(Coupling("x", "slide.displacement", "a.angle", 50.0)).check().notices
    assert (notice.code, notice.about) == ("large_coupling", ("couplings[0].law",))


FILE = """
format = 1
bodies = [
    { name = "a", mass = 1, inertia = 0.01 },
    { name = "b", mass = 2, inertia = 0.2 },
    { name = "rod", mass = 2, inertia = 0.1 },
]
joints = [
    { type = "revolute", name = "p", a = "ground", b = "a" },
    { type = "revolute", name = "q", a = "ground", b = "b" },
    { type = "prismatic", name = "slide", a = "ground", b = "rod", axis = [0, 1] },
]
drives = [{ type = "speed", name = "motor", joint = "p", speed = "60 rpm" }]
[[couplings]]
name = "mesh"
driven = "b.angle"
driver = "a.angle"
law = "-teeth/40"
offset = "90 deg"
[[couplings]]
name = "cam"
driven = "slide.displacement"
driver = "b.angle"
law = "lift*(1 - cos(b.angle))"
[parameters]
teeth = 20
lift = { nominal = "10 mm", plus = "1 mm", minus = "1 mm" }
"""


def test_couplings_stand_in_scene_files_with_units_and_parameters():
    template = cc.loads(FILE)
    scene = template()
    assert cc.Scene.from_json(scene.to_json()) == scene
    assert scene.couplings[0].law == -0.5
    run = cc.simulate(scene, duration=2.0, samples=5)
    assert run["b.angle"] - run["b.angle"][0] == pytest.approx(-0.5 * run["a.angle"], abs=1e-12)
    assert run["rod.y"] == pytest.approx(0.01 * (1.0 - np.cos(run["b.angle"])), abs=1e-15)
    assert math.cos(run["b.angle"][0]) == pytest.approx(0.0, abs=1e-12)
    result = template.study(outputs=["rod.y"], duration=2.0, samples=5).sample(5)
    assert len(result.failures) == 0
    assert "mesh" in scene.describe()
