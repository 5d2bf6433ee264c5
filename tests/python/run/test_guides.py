"""Guides with play: closed forms of where a block jams, rests and rebounds, and what is kept exactly."""

import chebclear as cc
import numpy as np
import pytest
from momenta import momenta
from refusals import refused

LENGTH, HEIGHT, CLEARANCE = 0.1, 0.05, 1e-3
CORNERS = ("front_left", "front_right", "rear_left", "rear_right")
STIFF = cc.laws.KelvinVoigt(stiffness=1e8, damping=2e4, exponent=1.0)


def block_scene(law, start=None, forces=(), friction=None, points=None, **more):
    block = cc.Body("block", mass=1.0, inertia=1e-3, points=points or {})
    guide = cc.ClearancePrismatic(
        "guide", "ground", "block", (1.0, 0.0), LENGTH, HEIGHT, CLEARANCE, law, friction=friction, **more
    )
    return cc.Scene([block], [guide], forces, start=[] if start is None else [start])


def test_a_block_jams_where_two_opposite_corners_touch():
    a, b = LENGTH / 2, HEIGHT / 2
    tilt = np.arctan2(a, b) - np.arccos((b + CLEARANCE) / np.hypot(a, b))
    assert a * np.sin(tilt) + b * np.cos(tilt) == pytest.approx(b + CLEARANCE, rel=1e-14)
    scene = block_scene(STIFF, cc.GuideStart("guide", tilt=tilt))
    names = [f"guide.{corner}.penetration" for corner in CORNERS]
    run = cc.simulate(scene, duration=1e-6, samples=2, outputs=[*names, "guide.tilt"])
    touching = {corner: run[name][0] for corner, name in zip(CORNERS, names, strict=True)}
    assert abs(touching["front_left"]) < 1e-16 and abs(touching["rear_right"]) < 1e-16
    assert touching["front_right"] == pytest.approx(-2 * a * np.sin(tilt), rel=1e-12)
    assert run["guide.tilt"][0] == pytest.approx(tilt, rel=1e-14)


@pytest.mark.parametrize("place", [0.02, 0.045])
def test_a_pressed_block_rests_on_two_corners_as_the_lever_says(place):
    force = 100.0
    push = cc.Force("push", "block.P", 0.0, -force)
    scene = block_scene(STIFF, cc.GuideStart("guide", offset=-CLEARANCE), [push], points={"P": (place, 0.0)})
    run = cc.simulate(scene, duration=0.05, samples=2, rtol=1e-8)
    # To the tilt, by which the lever arms differ: 2e-5 rad.
    expected = [force * (LENGTH / 2 + sign * place) / LENGTH for sign in (1.0, -1.0)]
    found = [run[f"guide.{corner}.normal_force"][-1] for corner in ("front_right", "rear_right")]
    np.testing.assert_allclose(found, expected, rtol=1e-4)
    assert run["guide.reaction_y"][-1] == pytest.approx(force, rel=1e-6)
    assert run["guide.reaction_torque"][-1] == pytest.approx(force * place, rel=1e-4)
    assert run["guide.front_left.normal_force"][-1] == run["guide.rear_left.normal_force"][-1] == 0.0


@pytest.mark.parametrize("part, moves", [(0.9, True), (1.1, False)])
def test_a_drawer_locks_if_the_arm_of_the_force_exceeds_half_the_length_over_the_friction(part, moves):
    friction = 0.3
    arm = part * 0.5 * LENGTH / friction
    push = cc.Force("push", "block.P", 50.0, 0.0)
    scene = block_scene(
        STIFF, None, [push], cc.laws.SmoothedCoulomb(friction, velocity=1e-3), {"P": (0.0, arm)}
    )
    run = cc.simulate(scene, duration=0.5, samples=101, outputs=["guide.displacement", "guide.velocity"])
    assert run.status == "done"
    if moves:
        # What the two corners leave of the force accelerates the block; it has to close the play first.
        speed = 50.0 * (1.0 - part) * (run.t - 0.05)
        late = run.t > 0.3
        np.testing.assert_allclose(run["guide.velocity"][late], speed[late], atol=0.2)
    else:
        # Regularized friction lets it creep, no faster than the velocity of its smoothing allows.
        assert 0.0 < run["guide.velocity"][-1] < 3e-3


@pytest.mark.parametrize("restitution", [0.4, 0.9])
def test_a_corner_rebounds_with_the_mass_that_it_feels(restitution):
    law = cc.laws.ExactRestitution(stiffness=1e11, restitution=restitution)
    tilt, speed = 0.004, 0.01
    scene = block_scene(law, cc.GuideStart("guide", tilt=tilt, offset_rate=-speed))
    run = cc.simulate(scene, duration=0.09, samples=2, rtol=1e-8, outputs=["block.vy"])
    assert [event.joint for event in run.events] == ["guide.rear_right"] * 2
    along = -LENGTH / 2 * np.cos(tilt) + HEIGHT / 2 * np.sin(tilt)
    mass = 1.0 / (1.0 / 1.0 + along**2 / 1e-3)
    assert run["block.vy"][-1] + speed == pytest.approx((1.0 + restitution) * speed * mass, rel=2e-5)


def test_corners_that_land_together_are_all_found():
    law = cc.laws.ExactRestitution(stiffness=1e9, restitution=0.8)
    scene = block_scene(law, forces=[cc.Gravity((0.0, -9.81))])
    for method in ("dop853", "rodas5p", "adams"):
        run = cc.simulate(scene, duration=0.1, samples=101, method=method)
        landed = [event for event in run.events if event.kind == "onset"]
        assert len(landed) >= 8 and len(landed) % 2 == 0
        for one, other in zip(landed[::2], landed[1::2], strict=True):
            assert {one.joint, other.joint} == {"guide.front_right", "guide.rear_right"}
            assert one.time == other.time
        assert np.abs(run["guide.tilt"]).max() < 1e-14


def free_pair(kind):
    """Two free bodies with a spring, and between them a guide, a sleeve, a pin in a slot or a stop."""
    law = cc.laws.ExactRestitution(stiffness=1e9, restitution=0.8)
    friction = cc.laws.SmoothedCoulomb(0.2, velocity=1e-2)
    first = cc.Body("first", mass=2.0, inertia=2e-2, points={"O": (0.02, 0.01), "far": (0.2, 0.0)})
    # Before the face of the stop, or in the slot.
    place = (0.06, 0.02) if kind == "stop" else (0.003, -0.002)
    second = cc.Body("second", mass=1.0, inertia=1e-3, points={"C": place})
    ends, laws, axis = ("play", "first.O", "second.C"), (law, friction), (1.0, 0.3)
    place = {"offset": 1e-4, "displacement": 0.02, "offset_rate": 0.3, "velocity": 0.5}
    if kind == "pin":
        joint = cc.PinInSlot(*ends, axis, 0.01, CLEARANCE, *laws)
        starts = [cc.GuideStart("play", **place)]
    elif kind == "stop":
        joint = cc.Stop(*ends, axis, *laws, radius=0.01)
        starts = [cc.BodyStart("second", angular_velocity=2.0)]
    else:
        joint = cc.ClearancePrismatic(*ends, axis, LENGTH, HEIGHT, CLEARANCE, *laws, angle=0.2, corners=kind)
        starts = [cc.GuideStart("play", tilt=0.01, tilt_rate=2.0, **place)]
    # Pushes the edge against the stop.
    length = 0.3 if kind == "stop" else 0.05
    spring = cc.Spring("spring", "first.far", "second.C", stiffness=500.0, length=length)
    starts.append(cc.BodyStart("first", angle=0.4, angular_velocity=3.0))
    return cc.Scene([first, second], [joint], [spring], start=starts)


@pytest.mark.parametrize("kind", ["b", "a", "pin", "stop"])
@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_momentum_angular_momentum_and_energy_are_kept(kind, method):
    scene = free_pair(kind)
    names = [f"{body}.{name}" for body in ("first", "second") for name in ("x", "y", "vx", "vy")]
    turning = [f"{body}.angular_velocity" for body in ("first", "second")]
    outputs = [*names, *turning, "energy.balance", "energy.total"]
    run = cc.simulate(scene, duration=0.3, samples=301, method=method, rtol=1e-9, outputs=outputs)
    assert run.status == "done" and len(run.events) >= 8
    *linear, angular = momenta(run)
    assert np.ptp(linear, axis=1).max() < 1e-11
    assert np.ptp(angular) < 1e-9 * np.abs(angular).max()
    assert np.abs(run["energy.balance"]).max() < 1e-9 * run["energy.total"].max()


def test_the_first_impact_of_the_published_slider_crank():
    """Table 1 of Flores, Leine and Glocker (2010), doi 10.1007/s11044-009-9178-y.

    The instant is that of another code, written for this mechanism alone.
    """
    law = cc.laws.ExactRestitution(stiffness=1e10, restitution=0.4)
    crank = cc.Body("crank", mass=0.038, inertia=7.4e-5, points={"A": (-0.0765, 0.0), "B": (0.0765, 0.0)})
    rod = cc.Body("rod", mass=0.038, inertia=5.9e-4, points={"B": (-0.153, 0.0), "C": (0.153, 0.0)})
    slider = cc.Body("slider", mass=0.076, inertia=2.7e-6)
    guide = cc.ClearancePrismatic(
        "guide", "ground", "slider", (1.0, 0.0), 0.1, 0.05, 1e-3, law, cc.laws.SmoothedCoulomb(0.01, 1e-2)
    )
    scene = cc.Scene(
        [crank, rod, slider],
        [
            cc.Revolute("axle", "ground", "crank.A"),
            cc.Revolute("pin", "crank.B", "rod.B"),
            cc.Revolute("wrist", "rod.C", "slider"),
            guide,
        ],
        [cc.Gravity((0.0, -9.81))],
        start=[
            cc.BodyStart("crank", angle=0.0, angular_velocity=150.0),
            cc.BodyStart("rod", angle=0.0, angular_velocity=-75.0),
        ],
    )
    run = cc.simulate(scene, duration=2.8e-3, samples=2, rtol=1e-10)
    first, second = run.events
    assert {first.joint, second.joint} == {"guide.front_left", "guide.rear_left"}
    assert first.time == second.time == pytest.approx(2.6925027520213e-3, rel=1e-9)


def test_assemblies_are_those_of_the_ideal_guide():
    """The start has no offset and no tilt, in the way that is nearest to the given angles."""
    rng = np.random.default_rng(5)
    for _ in range(60):
        ground = {"O": (0.0, 0.0), "G": tuple(rng.uniform(-0.05, 0.05, 2))}
        crank = cc.Body(
            "crank", 0.2, 1e-4, points={"A": (0.0, 0.0), "B": (0.05, 0.0)}, angle=rng.uniform(-3, 3)
        )
        rod = cc.Body(
            "rod", 0.2, 1e-4, points={"B": (0.0, 0.0), "C": (0.2, 0.0)}, angle=rng.uniform(-0.6, 0.6)
        )
        slider = cc.Body("slider", 0.2, 1e-4, points={"C": tuple(rng.uniform(-0.02, 0.02, 2))})
        axis, angle = tuple(rng.normal(size=2)), float(np.round(rng.uniform(-0.3, 0.3), 3))
        tail = [cc.Revolute("pin", "crank.B", "rod.B"), cc.Revolute("wrist", "rod.C", "slider.C")]
        drive = [cc.motions.Speed("drive", "axle", 10.0, angle=float(rng.uniform(-3, 3)))]
        found = []
        for guide in (
            cc.Prismatic("guide", "ground.G", "slider", axis, angle=angle),
            cc.ClearancePrismatic(
                "guide", "ground.G", "slider", axis, 0.04, 0.02, 1e-4, cc.laws.Hertz(1e9), angle=angle
            ),
        ):
            joints = [cc.Revolute("axle", "ground.O", "crank.A"), *tail, guide]
            try:
                found.append(cc.Scene([crank, rod, slider], joints, drives=drive, ground=ground).check())
            except cc.ChebclearError as error:
                found.append(error)
        if isinstance(found[0], Exception) or isinstance(found[1], Exception):
            assert type(found[0]) is type(found[1]), found
            continue
        poses = [np.array(facts.poses) for facts in found]
        off = poses[0] - poses[1]
        off[:, 2] = (off[:, 2] + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(off).max() < 1e-9
        assert len(found[0].notices) == len(found[1].notices)


@pytest.mark.parametrize(
    "change",
    [
        {"length": 0.0},
        {"height": -1.0},
        {"clearance": 0.0},
        {"clearance": 0.04},
        {"axis": (0.0, 0.0)},
        {"corners": "c"},
        {"angle": np.nan},
        {"impact_velocity_floor": 0.0},
    ],
)
def test_wrong_guides_are_named(change):
    fields = {"axis": (1.0, 0.0), "length": LENGTH, "height": HEIGHT, "clearance": CLEARANCE} | change
    guide = cc.ClearancePrismatic("guide", "ground", "block", contact=STIFF, **fields)
    (name,) = change
    assert f"joints[0].{name}" in refused(cc.Scene([cc.Body("block", 1.0, 1e-3)], [guide]))


def test_wrong_starts_are_named():
    slot = cc.PinInSlot("slot", "ground", "block", (1.0, 0.0), 0.01, CLEARANCE, STIFF)
    block = cc.Body("block", 1.0, 1e-3)
    for start, path in (
        (cc.GuideStart("slot", tilt=0.1), "start[0].joint"),
        (cc.GuideStart("none"), "start[0].joint"),
        (cc.GuideStart("slot", offset=np.inf), "start[0].offset"),
        (cc.ClearanceStart("slot", (0.0, 0.0)), "start[0].joint"),
    ):
        assert list(refused(cc.Scene([block], [slot], start=[start]))) == [path]


def test_a_rod_jams_in_its_sleeve_and_a_pin_touches_one_side():
    a, b = LENGTH / 2, HEIGHT / 2
    tilt = np.arccos(b / np.hypot(a, b + CLEARANCE)) - np.arctan2(a, b + CLEARANCE)
    scene = block_scene(STIFF, cc.GuideStart("guide", tilt=tilt), corners="a")
    run = cc.simulate(scene, duration=1e-9, samples=2)
    touching = {corner: run[f"guide.{corner}.penetration"][0] for corner in CORNERS}
    # The other pair of corners than in a guide: the sleeve tilts against the rod.
    assert abs(touching["front_left"]) < 1e-16 and abs(touching["rear_right"]) < 1e-16
    assert touching["front_right"] == pytest.approx(-2 * a * np.sin(tilt), rel=1e-12)
    law, depth = cc.laws.Hertz(1e8), 2e-4
    slot = cc.PinInSlot("slot", "ground", "pin", (0.0, 2.0), 0.01, CLEARANCE, law)
    start = [cc.GuideStart("slot", offset=CLEARANCE + depth, displacement=0.3)]
    run = cc.simulate(cc.Scene([cc.Body("pin", 1.0, 1e-3)], [slot], start=start), duration=1e-9, samples=2)
    # The axis is that of y: its left is towards -x.
    assert run["pin.x"][0] == pytest.approx(-CLEARANCE - depth) and run["pin.y"][0] == pytest.approx(0.3)
    assert run["slot.left.normal_force"][0] == pytest.approx(1e8 * depth**1.5, rel=1e-9)
    assert run["slot.reaction_x"][0] == pytest.approx(1e8 * depth**1.5, rel=1e-9)
    assert run["slot.right.contact"][0] == 0.0
