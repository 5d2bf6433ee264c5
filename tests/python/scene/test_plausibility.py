"""Numbers that are possible but hardly meant: what is doubted, and what no doubt may fall on."""

import dataclasses
import math

import chebclear as cc
import numpy as np
import pytest
from refusals import refused

MECHANISMS = cc.mechanisms
READY_MADE = [
    MECHANISMS.slider_crank,
    MECHANISMS.flores_slider_crank,
    MECHANISMS.quick_return,
    MECHANISMS.four_bar,
    MECHANISMS.six_bar,
    MECHANISMS.pendulum_in_bearing,
    MECHANISMS.free_journal,
]


def doubt(scene):
    """The only doubt about a scene."""
    (notice,) = scene.check().notices
    return notice


def bar(length, mass, **changes):
    """A bar that hangs in ground."""
    body = cc.Body(
        "bar",
        mass=mass,
        inertia=mass * length**2 / 12.0,
        center_of_mass=(0.5 * length, 0.0),
        points={"A": (0.0, 0.0), "B": (length, 0.0)},
    )
    return cc.Scene([body], [cc.Revolute("pin", "ground", "bar.A")], **changes)


def pressed(scene, force):
    """A slider-crank that no drive holds, its slider pushed along x."""
    return dataclasses.replace(scene, drives=[], forces=[cc.Force("push", "slider", x=force, y=0.0)])


# --- nothing to doubt -----------------------------------------------------------------------------------


@pytest.mark.parametrize("build", READY_MADE)
@pytest.mark.parametrize("size", [1e-2, 1.0, 10.0])
def test_ready_made_mechanisms_small_and_large(build, size):
    plain = build().to_json()
    scene = cc.Scene.from_json(plain)
    bodies = [
        dataclasses.replace(
            body,
            mass=size**3 * body.mass,
            inertia=size**5 * body.inertia,
            center_of_mass=tuple(size * np.array(body.center_of_mass)),
            points={name: tuple(size * np.array(point)) for name, point in body.points.items()},
        )
        for body in scene.bodies
    ]
    joints = [
        dataclasses.replace(
            joint, journal_radius=size * joint.journal_radius, clearance=size * joint.clearance
        )
        if isinstance(joint, cc.ClearanceRevolute)
        else joint
        for joint in scene.joints
    ]
    ground = {name: tuple(size * np.array(point)) for name, point in scene.ground.items()}
    assert dataclasses.replace(scene, bodies=bodies, joints=joints, ground=ground).check().notices == ()


@pytest.mark.parametrize(
    ("what", "length", "mass"),
    [
        ("blade of the largest wind turbine", 118.0, 60e3),
        ("boom of the largest excavator", 200.0, 4e6),
        ("wheel of the London Eye, across", 120.0, 1e6),
        ("boom that a satellite unrolls", 20.0, 2.0),
        ("jib of a tower crane", 60.0, 10e3),
        ("beam of a pumpjack", 10.0, 5e3),
        ("fishing rod of carbon fibre", 10.0, 0.5),
        ("hand of a watch", 5e-3, 5e-6),
        ("arm of a sensor of silicon", 2e-4, 1e-12),
        ("bar without a mass worth speaking of", 1.0, 1e-5),
    ],
)
def test_things_that_exist(what, length, mass):
    assert bar(length, mass, forces=[cc.Gravity((0.0, -9.81))]).check().notices == ()


def test_machines_that_exist():
    # A two-stroke ship engine; an eccentric press, its sheave ten times its throw; a small turbine's speed.
    ship = MECHANISMS.slider_crank(
        crank_length=1.25,
        rod_length=2.9,
        clearance=5e-4,
        journal_radius=0.5,
        crank_speed=cc.rpm(100.0),
        crank_mass=1e4,
        rod_mass=5e3,
        slider_mass=6e3,
        slider_inertia=1e3,
    )
    press = MECHANISMS.slider_crank(
        crank_length=0.02,
        rod_length=1.2,
        clearance=1e-4,
        clearance_at=("crank_pin",),
        journal_radius=0.2,
        crank_speed=10.0,
        crank_mass=100.0,
        rod_mass=200.0,
    )
    turbine = bar(0.06, 0.2, drives=[cc.motions.Speed("shaft", "pin", cc.rpm(200_000.0))])
    for scene in (ship, press, turbine):
        assert scene.check().notices == ()


@pytest.mark.parametrize("angle", [-2.0 * math.pi, 9.9, 4.0 * math.pi, 12.3, 100.123])
def test_angles_in_radians(angle):
    assert MECHANISMS.slider_crank(crank_angle=angle).check().notices == ()


# --- units ----------------------------------------------------------------------------------------------


def long(factor):
    """Lengths in millimeters."""
    lengths = {"crank_length": 50.0, "rod_length": 120.0, "clearance": 0.02}
    return {name: factor * length for name, length in lengths.items()} | {"journal_radius": 9.8}


def hung(stiffness):
    """A ram of 40 kg on a spring."""
    ram = cc.Body("ram", mass=40.0, inertia=1.0, points={"A": (0.0, 0.2)})
    forces = [cc.Gravity((0.0, -9.81)), cc.Spring("counterweight", "ground.top", "ram.A", stiffness, 0.1)]
    return cc.Scene(
        [ram], [cc.Prismatic("guide", "ground", "ram", axis=(0.0, 1.0))], forces, ground={"top": (0.0, 0.4)}
    )


STEEL = cc.laws.ExactRestitution(1e8, 0.5)


def valve(length):
    """A valve on its seat, and a spring of an unloaded length above it, 50 mm long there."""
    body = cc.Body("valve", mass=0.1, inertia=1e-5)
    joints = [
        cc.Prismatic("guide", "ground", "valve", axis=(0.0, 1.0)),
        cc.Stop("seat", "ground", "valve", normal=(0.0, 1.0), contact=STEEL),
    ]
    spring = cc.Spring("spring", "ground.top", "valve", 32e3, length)
    return cc.Scene([body], joints, [spring], ground={"top": (0.0, 0.05)})


def follower(stiffness):
    """A follower that a spring presses on a disk with an eccentric edge at 1000 rpm."""
    disk = cc.Body("disk", mass=1.0, inertia=1e-3, points={"edge": (0.0, 0.02)})
    body = cc.Body("follower", mass=0.1, inertia=1e-5, points={"foot": (0.0, 0.0)})
    joints = [
        cc.Revolute("shaft", "ground", "disk"),
        cc.Prismatic("guide", "ground.G", "follower", axis=(0.0, 1.0)),
        cc.Stop("foot", "follower.foot", "disk.edge", normal=(0.0, -1.0), contact=STEEL),
    ]
    return cc.Scene(
        [disk, body],
        joints,
        [cc.Spring("spring", "ground.top", "follower", stiffness, 0.06)],
        drives=[cc.motions.Speed("drive", "shaft", cc.rpm(1000.0))],
        ground={"G": (0.0, 0.02), "top": (0.0, 0.07)},
    )


@pytest.mark.parametrize("scene", [hung(32e3), valve(0.06), follower(32e3)])
def test_springs_that_carry_and_press(scene):
    assert scene.check().notices == ()


@pytest.mark.parametrize(
    ("scene", "code", "path"),
    [
        *((MECHANISMS.slider_crank(**long(k)), "light_body", "bodies[1].points") for k in (0.5, 1.0)),
        (MECHANISMS.slider_crank(**long(30.0)), "long_body", "bodies[1].points"),
        (
            MECHANISMS.slider_crank(**long(0.2), crank_mass=30.0, rod_mass=30.0),
            "fast_drive",
            "drives[0].speed",
        ),
        # A crank of 30 mm whose drive says nothing; the rod is longer, and as much too light.
        (bar(30.0, 0.3), "light_body", "bodies[0].points"),
        # 1500 rpm given as rad/s, and 157 rad/s given as rpm.
        (MECHANISMS.slider_crank(crank_speed=1500.0), "fast_drive", "drives[0].speed"),
        *(
            (MECHANISMS.slider_crank(crank_speed=cc.rpm(given)), "speed_twice", "drives[0].speed")
            for given in (157, 157.1, 157.08, 314, 104.72)
        ),
        # 32 N/mm given as N/m, of a press and of a follower on a cam.
        (hung(32.0), "feeble_spring", "forces[1].stiffness"),
        (follower(32.0), "feeble_spring", "forces[0].stiffness"),
        (valve(0.04), "pulling_spring", "forces[0].length"),
        (MECHANISMS.slider_crank(journal_radius=9.8), "large_journal", "joints[3].journal_radius"),
        (MECHANISMS.slider_crank(clearance=0.02), "large_clearance", "joints[3].clearance"),
        (MECHANISMS.slider_crank(clearance=0.005), "large_clearance", "joints[3].clearance"),
        (MECHANISMS.pendulum_in_bearing(gravity=9810.0), "free_fall", "forces[0].acceleration"),
        (bar(0.3, 1.0, drives=[cc.motions.Speed("drive", "pin", 12_000.0)]), "fast_drive", "drives[0].speed"),
        # Body and drive have the angle: one warning.
        *(
            (MECHANISMS.slider_crank(crank_angle=degrees), "degrees", "bodies[0].angle drives[0].angle")
            for degrees in (45, 90.0, -30.0, 12.5, 270.0, 720.0)
        ),
        # Turned by a quarter on its way into the scene.
        (MECHANISMS.pendulum_in_bearing(angle=45.0), "degrees", "bodies[0].angle"),
    ],
)
def test_numbers_in_another_unit_are_doubted_at_their_path(scene, code, path):
    assert (doubt(scene).code, doubt(scene).about) == (code, tuple(path.split()))


def test_a_doubt_comes_before_the_run():
    scene = MECHANISMS.slider_crank(journal_radius=9.8)
    with pytest.warns(cc.ChebclearWarning), pytest.raises(cc.errors.SimulationError) as caught:
        cc.simulate(scene, duration=0.06, samples=61, max_steps=100)
    assert doubt(scene) in caught.value.trajectory.notices


def test_degrees_everywhere():
    swing = dataclasses.replace(
        bar(0.2, 0.5),
        forces=[cc.TorsionSpring("coil", "ground", "bar", stiffness=1.0, angle=20.0)],
        start=[cc.JointStart("pin", position=30.0)],
    )
    assert [one.about for one in swing.check().notices] == [("forces[0].angle",), ("start[0].position",)]
    motion = cc.motions.Harmonic(mean=60.0, amplitude=45.0, angular_frequency=3.0, phase=90.0)
    rocked = bar(0.2, 0.5, drives=[cc.motions.Motion("drive", "pin", motion)])
    assert len(rocked.check().notices) == 3
    # A displacement is in meters.
    block = cc.Body("block", 1.0, 1.0)
    guide = cc.Prismatic("guide", "ground", "block", axis=(1.0, 0.0))
    assert cc.Scene([block], [guide], start=[cc.JointStart("guide", position=30.0)]).check().notices == ()


# --- joints ---------------------------------------------------------------------------------------------


def test_a_joint_that_is_there_twice():
    scene = MECHANISMS.slider_crank()
    wrist = scene.joints[3]
    turned = dataclasses.replace(wrist, name="copy", bearing=wrist.journal, journal=wrist.bearing)
    for twin in (dataclasses.replace(wrist, name="copy"), turned):
        both = dataclasses.replace(scene, joints=[*scene.joints, twin])
        assert (doubt(both).code, doubt(both).about) == ("twin_joint", ("joints[4]",))
    with pytest.warns(cc.ChebclearWarning):
        cc.simulate(both, duration=1e-4, samples=2)


def test_a_clearance_that_never_acts():
    scene = MECHANISMS.slider_crank()
    for pin in (cc.Revolute("pin", "slider.C", "rod.C"), cc.Fixed("pin", "rod.C", "slider")):
        held = dataclasses.replace(scene, joints=[*scene.joints, pin])
        assert list(refused(held)) == ["joints[3]"]
    # The same point of the slider by another name: held by a weld elsewhere.
    plate = cc.Body("plate", 0.1, 1e-4, points={"C": (0.0, 0.0), "D": (0.05, 0.0)})
    weld = cc.Fixed("weld", "slider.C", "plate.D")
    wrist = dataclasses.replace(scene.joints[3], name="eye", bearing="slider.C", journal="plate.C")
    welded = dataclasses.replace(scene, bodies=[*scene.bodies, plate], joints=[*scene.joints, weld, wrist])
    assert list(refused(welded)) == ["joints[5]"]


# --- starts ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pins", [(), ("wrist",), ("crank_pin", "wrist")])
def test_a_push_along_a_dead_center(pins):
    # Pushed toward the crank from outside, pulled away from inside; the other way it is stable.
    for angle, force, unstable in ((0.0, -10.0, True), (0.0, 10.0, False), (math.pi, 10.0, True)):
        scene = pressed(MECHANISMS.slider_crank(clearance_at=pins, crank_angle=angle), force)
        assert [one.code for one in scene.check().notices] == ["unstable_start"] * unstable
        beside = pressed(MECHANISMS.slider_crank(clearance_at=pins, crank_angle=angle + 1e-6), force)
        assert beside.check().notices == ()


@pytest.mark.parametrize("pins", [(), ("pivot",)])
def test_upright(pins):
    scene = MECHANISMS.pendulum_in_bearing(
        angle=math.pi, clearance_at=pins, length=0.2, mass=0.5, inertia=1e-3
    )
    growth = math.sqrt(0.5 * 9.81 * 0.2 / (1e-3 + 0.5 * 0.2**2))
    assert doubt(scene).numbers["tenfold"] == pytest.approx(math.log(10.0) / growth, rel=1e-9)
    assert MECHANISMS.pendulum_in_bearing(angle=0.0, clearance_at=pins).check().notices == ()
    # It moves from the start on, or friction of its own holds nothing: no balance to fall out of.
    moved = dataclasses.replace(scene, start=[cc.BodyStart("pendulum", angular_velocity=0.1)])
    assert moved.check().notices == ()


# --- tolerances -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pins", "tolerance"),
    [
        (("wrist",), {"position_tolerance": 1e30}),
        ((), {"position_tolerance": 0.2}),
        (("wrist",), {"velocity_tolerance": 1e30}),
    ],
)
def test_an_absolute_tolerance_larger_than_anything(pins, tolerance):
    scene = MECHANISMS.slider_crank(clearance_at=pins)
    (name,) = tolerance
    with pytest.raises(cc.errors.SettingsError) as caught:
        cc.simulate(scene, duration=1e-3, samples=11, **tolerance)
    assert [problem.path for problem in caught.value.problems] == [f"settings.{name}"]
    study = cc.Study(
        MECHANISMS.slider_crank,
        {"rod_length": cc.Interval.around(0.12, rel=0.1)},
        ["slider.x"],
        duration=1e-3,
        samples=11,
        fixed={"clearance_at": pins},
        **tolerance,
    )
    with pytest.raises(cc.errors.SettingsError):
        study.scan(2)
