"""Guides, slots and stops with ends: a block over the end of a table, a rod in a short guide, a disk."""

import dataclasses

import chebclear as cc
import numpy as np
import pytest
from momenta import momenta
from refusals import refused

LENGTH, HEIGHT, CLEARANCE, GRAVITY = 0.1, 0.05, 0.02, 9.81
TABLE = 0.2


def table(law, speed, friction=None, place=0.0):
    """A block of 1 kg that lies and slides on the lower face of a wide guide."""
    guide = cc.ClearancePrismatic(
        "table", "ground", "block", (1.0, 0.0), LENGTH, HEIGHT, CLEARANCE, law, friction, face_length=TABLE
    )
    depth = (0.5 * GRAVITY / law.stiffness) ** (1.0 / law.exponent)
    start = cc.GuideStart("table", offset=-CLEARANCE - depth, velocity=speed, displacement=place)
    block = cc.Body("block", 1.0, 1e-3)
    return cc.Scene([block], [guide], [cc.Gravity((0.0, -GRAVITY))], start=[start])


@pytest.mark.filterwarnings("ignore:joints")
@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_a_block_that_slides_off_a_table_tips_when_its_center_passes_the_end(method):
    """Before, lever rule and center of mass give the forces of end and rear corner."""
    speed = 0.3
    scene = table(cc.laws.Hertz(1e10), speed)
    outputs = ["table.rear_right.normal_force", "table.front_right_end.normal_force", "block.x", "energy.*"]
    run = cc.simulate(
        scene, duration=0.6, samples=601, method=method, outputs=outputs, rtol=1e-8, on_failure="return"
    )
    passed, lifted = run.events
    assert (passed.kind, passed.joint) == ("transfer", "table.front_right")
    assert passed.time == pytest.approx((TABLE - LENGTH) / 2 / speed, rel=1e-9)
    assert (lifted.kind, lifted.joint) == ("separation", "table.rear_right")
    assert lifted.time == pytest.approx(TABLE / 2 / speed, rel=1e-3)
    at = (run.t > passed.time) & (run.t < lifted.time - 0.02)
    rear, end = run["block.x"][at] - LENGTH / 2, TABLE / 2
    lever = (end - run["block.x"][at]) / (end - rear)
    weight = GRAVITY
    np.testing.assert_allclose(run["table.rear_right.normal_force"][at], weight * lever, atol=0.02 * weight)
    np.testing.assert_allclose(
        run["table.front_right_end.normal_force"][at], weight * (1.0 - lever), atol=0.02 * weight
    )
    assert run.status == "left_guide" and run.end_time > lifted.time
    reached = run.t <= run.end_time
    assert np.abs(run["energy.balance"][reached]).max() < 1e-9 * run["energy.kinetic"][reached].max()


@pytest.mark.filterwarnings("ignore:joints")
def test_what_sticks_is_passed_on_with_its_force():
    """A block pushed below the friction limit stays where it is, while its corner passes the end."""
    friction = cc.laws.StickSlip(0.3, 0.2, 0.0)
    law = cc.laws.HuntCrossley(1e9, 1.0)
    edge = (TABLE - LENGTH) / 2
    scene = table(law, 0.0, friction, place=edge - 2e-9)
    push = cc.Force("push", "block", "min(30*time, 1.5)", 0.0)
    run = cc.simulate(
        dataclasses.replace(scene, forces=[*scene.forces, push]),
        duration=0.2,
        samples=201,
        outputs=["block.x", "energy.balance", "*.friction_force"],
    )
    assert [event.kind for event in run.events].count("transfer") == 1
    # The springs of the contacts stretch.
    assert abs(run["block.x"][-1] - edge) < 1e-6
    assert np.ptp(run["block.x"][run.t > 0.15]) < 1e-10
    held = [run[f"table.{place}.friction_force"][-1] for place in ("front_right_end", "rear_right")]
    assert sum(held) == pytest.approx(-1.5, rel=1e-3)
    assert np.abs(run["energy.balance"]).max() < 1e-10


def pair(law, **joint):
    """Two free bodies, of which one slides through the other while a spring pulls it to one side."""
    first = cc.Body("first", mass=2.0, inertia=2e-2, points={"O": (0.02, 0.01), "far": (0.1, 0.4)})
    second = cc.Body("second", mass=1.0, inertia=1e-3, points={"C": (0.003, -0.002)})
    fields = {"length": LENGTH, "height": HEIGHT, "clearance": 1e-3, "angle": 0.2}
    guide = cc.ClearancePrismatic(
        "play",
        "first.O",
        "second.C",
        (1.0, 0.3),
        contact=law,
        friction=cc.laws.SmoothedCoulomb(0.2, velocity=1e-2),
        **fields | joint,
    )
    spring = cc.Spring("spring", "first.far", "second.C", stiffness=1000.0, length=0.1)
    place = {"offset": 1e-4, "displacement": -0.03, "offset_rate": 0.3, "velocity": 1.5}
    start = [cc.GuideStart("play", tilt=0.01, tilt_rate=2.0, **place), cc.BodyStart("first", angle=0.4)]
    return cc.Scene([first, second], [guide], [spring], start=start)


@pytest.mark.parametrize(("corners", "face"), [("b", 0.12), ("a", 0.12), ("b", 0.08), ("a", 0.08)])
@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_momenta_and_energy_are_kept_across_the_ends(corners, face, method):
    law = cc.laws.ExactRestitution(stiffness=1e9, restitution=0.4)
    scene = pair(law, corners=corners, face_length=face)
    names = [f"{body}.{name}" for body in ("first", "second") for name in ("x", "y", "vx", "vy")]
    turning = [f"{body}.angular_velocity" for body in ("first", "second")]
    outputs = [*names, *turning, "energy.balance", "energy.total"]
    run = cc.simulate(
        scene, duration=0.1, samples=201, method=method, rtol=1e-9, outputs=outputs, on_failure="return"
    )
    assert any(event.kind == "transfer" for event in run.events)
    reached = run.t <= run.end_time
    *linear, angular = momenta(run)[:, reached]
    assert np.ptp(linear, axis=1).max() < 1e-11
    assert np.ptp(angular) < 1e-10
    assert np.abs(run["energy.balance"][reached]).max() < 1e-9 * run["energy.total"][reached].max()


def test_a_long_block_in_a_short_guide_is_a_rod_in_a_sleeve():
    """With ends far away a guide is one without; the reverse has the corners of the guide."""
    law = cc.laws.HuntCrossley(1e9, 0.5)
    outputs = ["second.x", "second.y", "second.angle"]

    def on_ground(scene):
        # The speeds of two free bodies would be chosen by their sizes.
        first, second = scene.bodies
        guide = dataclasses.replace(scene.joints[0], a="ground")
        spring = dataclasses.replace(scene.forces[0], a="ground.far")
        ground = {"far": first.points["far"]}
        return cc.Scene([second], [guide], [spring], ground=ground, start=scene.start[:1])

    plain, long, sleeve, short = (
        cc.simulate(on_ground(pair(law, **fields)), duration=0.04, samples=41, rtol=1e-10, outputs=outputs)
        for fields in ({}, {"face_length": 2.0}, {"corners": "a"}, {"length": 2.0, "face_length": LENGTH})
    )
    assert len(plain.events) >= 6 and len(sleeve.events) >= 6
    np.testing.assert_allclose(long.samples, plain.samples, atol=1e-8)
    np.testing.assert_allclose(short.samples, sleeve.samples, atol=1e-8)
    assert [event.time for event in short.events] == pytest.approx(
        [event.time for event in sleeve.events], abs=1e-9
    )


@pytest.mark.filterwarnings("ignore:joints")
@pytest.mark.parametrize("speed", [0.1, 0.4])
def test_a_disk_rolls_around_an_end_until_it_flies(speed):
    """Without friction it leaves at cos(angle) = 2/3 + v² / (3 g r), as a body leaves a sphere."""
    radius, clearance, stiffness = 0.05, 0.04, 1e9
    law = cc.laws.KelvinVoigt(stiffness, 2.0 * np.sqrt(stiffness))
    slot = cc.PinInSlot("slot", "ground", "disk", (1.0, 0.0), radius, clearance, law, face_length=TABLE)
    resting = -clearance - GRAVITY / stiffness
    scene = cc.Scene(
        [cc.Body("disk", 1.0, 1e-3)],
        [slot],
        [cc.Gravity((0.0, -GRAVITY))],
        start=[cc.GuideStart("slot", displacement=0.09, velocity=speed, offset=resting)],
    )
    outputs = ["disk.x", "disk.y", "slot.right.point_*", "slot.right.penetration", "energy.balance"]
    run = cc.simulate(scene, duration=0.5, samples=501, outputs=outputs, rtol=1e-9)
    # The force passes zero, and the damper holds on for a moment.
    free = next(event.time for event in run.events if event.kind == "clip")
    at_end = cc.simulate(scene, duration=free, samples=2, outputs=outputs, rtol=1e-9)
    x, y = run["disk.x"] - TABLE / 2, run["disk.y"] + radius + clearance
    cosine = (at_end["disk.y"][-1] + radius + clearance) / radius
    assert cosine == pytest.approx(2 / 3 + speed**2 / (3 * GRAVITY * radius), rel=1e-3)
    beyond = x > 0.0
    np.testing.assert_allclose(run["slot.right.penetration"][beyond], (radius - np.hypot(x, y))[beyond])
    assert at_end["slot.right.point_x"][-1] == pytest.approx(TABLE / 2, abs=1e-7)
    assert at_end["slot.right.point_y"][-1] == pytest.approx(-radius - clearance, abs=1e-7)
    assert np.abs(run["energy.balance"]).max() < 1e-10


def test_a_stop_with_ends_is_a_plate_that_is_passed_beside_it_and_touched_from_behind():
    law = cc.laws.ExactRestitution(1e8, 0.5)

    def thrown(place, up):
        ground = {"P": (place, -0.1 if not up else 0.1)}
        stop = cc.Stop("plate", "ground.P", "ball", (0.0, 1.0), law, radius=0.02, face_length=0.2)
        ball = cc.Body("ball", 1.0, 1e-3)
        scene = cc.Scene([ball], [stop], [cc.Gravity((0.0, GRAVITY if up else -GRAVITY))], ground=ground)
        return cc.simulate(scene, duration=0.2, samples=201, outputs=["ball.y"])

    for up in (False, True):
        fall = thrown(0.0, up)
        landed = next(iter(fall.events))
        assert landed.time == pytest.approx(np.sqrt(2 * 0.08 / GRAVITY), rel=1e-6)
        assert np.abs(fall["ball.y"]).max() < 0.082
        assert np.abs(thrown(0.1205, up)["ball.y"]).max() == pytest.approx(0.5 * GRAVITY * 0.04, rel=1e-9)


def test_a_run_goes_on_from_beyond_an_end(tmp_path):
    law = cc.laws.HuntCrossley(1e9, 0.5)
    scene = pair(law, face_length=0.12)
    whole = cc.simulate(scene, duration=0.03, samples=4, rtol=1e-10)
    part = cc.simulate(scene, duration=0.02, samples=3, rtol=1e-10)
    assert any(event.kind == "transfer" for event in part.events)
    part.save(tmp_path / "part.npz")
    start = cc.load_result(tmp_path / "part.npz").end
    rest = cc.simulate(scene, duration=0.01, samples=2, rtol=1e-10, start=start)
    np.testing.assert_allclose(rest["second.x"], whole["second.x"][2:], atol=1e-8)


@pytest.mark.parametrize(
    "wrong",
    [
        {"face_length": 0.0},
        {"face_length": np.nan},
        {"radius": 0.0},
        {"friction": cc.laws.StickSlip(0.3, 0.2, 0.0)},
    ],
)
def test_wrong_ends_are_named(wrong):
    fields = {"radius": 0.01, "face_length": 0.1} | wrong
    stop = cc.Stop("stop", "ground", "block", (0.0, 1.0), cc.laws.Hertz(1e8), **fields)
    (name,) = wrong
    assert f"joints[0].{name}" in refused(cc.Scene([cc.Body("block", 1.0, 1e-3)], [stop]))
