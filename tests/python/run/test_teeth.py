"""Forces of teeth on bearings, and backlash, against statics by hand and closed forms."""

import math
from dataclasses import replace

import chebclear as cc
import numpy as np
import pytest
from chebclear.laws import ExactRestitution, Hertz, KelvinVoigt
from chebclear.motions import Coupling, Speed
from refusals import refused

ALPHA = math.radians(20.0)
TANGENT = math.tan(ALPHA)
METHODS = ("dop853", "adams", "rodas4", "rodas5p", "auto")
GROUND = {"A": (0.0, 0.0), "B": (0.3, 0.0)}


def pair(ratio=-0.5, *, forces=(), drives=(), start=(), joints=(), bodies=(), **teeth):
    """Two wheels of 0.01 and 0.2 kg m² whose pitch radii are 0.1 and 0.2 m by the usual ratio."""
    mesh = Coupling("mesh", "b.angle", "a.angle", ratio, **{"pressure_angle": ALPHA, **teeth})
    bodies = [cc.Body("a", 1.0, 0.01), cc.Body("b", 2.0, 0.2), *bodies]
    pins = [cc.Revolute("p", "ground.A", "a"), cc.Revolute("q", "ground.B", "b")]
    return cc.Scene(bodies, [*pins, *joints], forces, drives, ground=GROUND, start=start, couplings=[mesh])


@pytest.mark.parametrize(
    ("ratio", "radius", "apart"),
    # Pitch radius of b, and whether the radial force pushes it away from a; then b is a ring, then a is.
    [(-0.5, 0.2, 1.0), (0.5, 0.6, -1.0), (2.0, 0.3, -1.0)],
)
@pytest.mark.parametrize("load", [-3.0, 3.0])
def test_bearings_carry_the_force_along_the_pressure_line(ratio, radius, apart, load):
    scene = pair(ratio, forces=[cc.Torque("load", "b", load)], drives=[Speed("motor", "p", 30.0)])
    run = cc.simulate(scene, duration=0.1, samples=3, outputs=["mesh.*", "*.reaction_*", "motor.torque"])
    force = -load / radius
    # The pitch point is on the line of centers; to the left of b, but beyond b in a ring a.
    along = -force if ratio < 1.0 else force
    assert run["mesh.tooth_force"] == pytest.approx(np.full(3, abs(force) / math.cos(ALPHA)))
    assert run["mesh.tooth_force_y"] == pytest.approx(np.full(3, along))
    assert run["mesh.tooth_force_x"] == pytest.approx(np.full(3, apart * abs(force) * TANGENT))
    for axis in "xy":
        assert run[f"q.reaction_{axis}"] == pytest.approx(-run[f"mesh.tooth_force_{axis}"])
        assert run[f"p.reaction_{axis}"] == pytest.approx(run[f"mesh.tooth_force_{axis}"])
    assert run["motor.torque"] == pytest.approx(np.full(3, -ratio * load))


def test_the_pin_of_a_planet_carries_both_tooth_forces():
    bodies = [cc.Body("sun", 1.0, 0.01), cc.Body("planet", 0.5, 0.001)]
    bodies.append(cc.Body("arm", 1.0, 0.01, points={"P": (0.1, 0.0)}))
    joints = [
        cc.Revolute("p", "ground", "sun"),
        cc.Revolute("q", "ground", "arm"),
        cc.Revolute("pin", "arm.P", "planet"),
    ]
    couplings = [
        Coupling("inner", "planet.angle", "sun.angle", -1.0, "arm", pressure_angle=ALPHA),
        Coupling("outer", "planet.angle", "ground.angle", 3.0, "arm", pressure_angle=ALPHA),
    ]
    load = [cc.Torque("load", "sun", -2.0)]
    scene = cc.Scene(bodies, joints, load, [Speed("motor", "q", 5.0)], couplings=couplings)
    run = cc.simulate(scene, duration=1.0, samples=11, outputs=["arm.angle", "*.reaction_*", "motor.torque"])
    cosine, sine = np.cos(run["arm.angle"]), np.sin(run["arm.angle"])
    x, y = run["pin.reaction_x"], run["pin.reaction_y"]
    # Sun and planet have pitch radii of 50 mm: 40 N on either side of the planet, whose radial parts cancel.
    assert cosine * x + sine * y == pytest.approx(np.full(11, -0.5 * 0.1 * 5.0**2))
    assert cosine * y - sine * x == pytest.approx(np.full(11, 80.0))
    assert run["motor.torque"] == pytest.approx(np.full(11, 8.0))
    # The bearing of the sun carries what the planet exerts on it.
    assert np.hypot(run["p.reaction_x"], run["p.reaction_y"]) == pytest.approx(
        np.full(11, 40.0 / math.cos(ALPHA))
    )


@pytest.mark.parametrize("forward", [True, False])
@pytest.mark.parametrize("on_carriage", [True, False])
def test_a_rack_pushes_its_pinion_away(forward, on_carriage):
    # Either the rack slides on ground, which holds the pinion, or a carriage with the pinion along a rack.
    bodies = [cc.Body("pinion", 1.0, 0.01), cc.Body("slider", 2.0, 0.1)]
    pin = cc.Revolute("pin", "slider" if on_carriage else "ground", "pinion")
    slide = cc.Prismatic("slide", "ground", "slider", axis=(1.0, 0.0))
    ends = ("slide.displacement", "pin.angle")
    radius = -0.05 if on_carriage else 0.05
    mesh = Coupling("rack", *ends, radius, pressure_angle=ALPHA)
    if not forward:
        mesh = Coupling("rack", *ends[::-1], 1.0 / radius, pressure_angle=ALPHA)
    load = [cc.Torque("load", "pinion", 4.0, reaction="slider" if on_carriage else "ground")]
    scene = cc.Scene(bodies, [pin, slide], load, couplings=[mesh])
    run = cc.simulate(scene, duration=0.01, samples=3, outputs=["pin.reaction_*", "slider.ax", "rack.*"])
    # The pinion is at rest but for its turning, or moves with the carriage; its rack is below it.
    mass = 2.0 + 0.01 / 0.05**2 + (1.0 if on_carriage else 0.0)
    away = -4.0 / 0.05 / mass if on_carriage else 4.0 / 0.05 / mass
    tangential = (4.0 - 0.01 * abs(away) / 0.05) / 0.05
    assert run["slider.ax"] == pytest.approx(np.full(3, away))
    assert run["rack.tooth_force"] == pytest.approx(np.full(3, tangential / math.cos(ALPHA)))
    assert run["pin.reaction_y"] == pytest.approx(np.full(3, -tangential * TANGENT))
    by_hand = (away if on_carriage else 0.0) + tangential
    assert run["pin.reaction_x"] == pytest.approx(np.full(3, by_hand))


@pytest.mark.parametrize("last", ["p", "q", "r", "s", "t"])
@pytest.mark.parametrize("play", [False, True])
def test_wheels_in_a_loop_obey_newton_whichever_joint_is_cut(last, play):
    def bar(name, length, angle):
        points = {"A": (0.0, 0.0), "B": (length, 0.0)}
        return cc.Body(name, 1.0, 0.01, (0.5 * length, 0.0), points=points, angle=angle)

    bodies = [bar("a", 0.1, 0.5), bar("rod", 0.3, 0.9), bar("other", 0.3, 2.2), bar("b", 0.1, 1.4)]
    joints = [
        cc.Revolute("p", "ground.A", "a.A"),
        cc.Revolute("q", "ground.B", "b.A"),
        cc.Revolute("r", "a.B", "rod.A"),
        cc.Revolute("s", "b.B", "other.A"),
        cc.Revolute("t", "rod.B", "other.B"),
    ]
    joints.sort(key=lambda joint: joint.name == last)
    teeth = {"backlash": 1e-4, "contact": Hertz(1e8)} if play else {}
    mesh = Coupling("mesh", "b.angle", "a.angle", -1.5, pressure_angle=ALPHA, **teeth)
    scene = cc.Scene(
        bodies,
        joints,
        [cc.Torque("load", "b", 5.0)],
        ground=GROUND,
        start=[cc.BodyStart("a", angular_velocity=10.0)],
        couplings=[mesh],
    )
    assert scene.check().cut_joints == (last,)
    run = cc.simulate(scene, duration=0.02, samples=21, rtol=1e-8, outputs=["*.reaction_*", "mesh.*", "*.a?"])
    assert run["mesh.tooth_force"].max() > 10.0
    largest = max(abs(run[name]).max() for name in run.columns if "reaction" in name)
    for axis in "xy":
        tooth = run[f"mesh.tooth_force_{axis}"]
        reaction = {name: run[f"{name}.reaction_{axis}"] for name in "pqrs"}
        on_a = reaction["p"] - reaction["r"] - tooth - run[f"a.a{axis}"]
        on_b = reaction["q"] - reaction["s"] + tooth - run[f"b.a{axis}"]
        assert abs(np.array([on_a, on_b])).max() < 1e-8 * largest


def rattling(contact, **kwargs):
    """Both wheels free, the driver turning in the middle of a play of 0.2 mm."""
    start = [cc.BodyStart("a", 0.0, 3.0), cc.BodyStart("b", 0.0, 0.0)]
    return pair(backlash=2e-4, contact=contact, start=start, **kwargs)


# Effective mass on the pitch line [kg], and the speed at which the teeth meet [m/s].
MASS = 1.0 / (0.1**2 / 0.01 + 0.2**2 / 0.2)
SPEED = 0.3
RATTLE = ["*.angular_velocity", "mesh.*", "energy.*"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("restitution", [0.05, 0.5, 0.9])
def test_teeth_rebound_with_their_restitution_and_keep_the_momentum_weighted_by_the_radii(
    method, restitution
):
    scene = rattling(ExactRestitution(1e12, restitution))
    run = cc.simulate(scene, duration=7e-4, samples=101, outputs=RATTLE, method=method, rtol=1e-10)
    assert [event.kind for event in run.events] == ["onset", "separation"]
    relative = 0.2 * run["b.angular_velocity"] + 0.1 * run["a.angular_velocity"]
    assert relative[-1] / relative[0] == pytest.approx(-restitution, rel=1e-5)
    momentum = 0.01 / 0.1 * run["a.angular_velocity"] - 0.2 / 0.2 * run["b.angular_velocity"]
    assert np.ptp(momentum) < 1e-13 * momentum[0]
    assert run["energy.impact_loss"][-1] == pytest.approx(
        0.5 * MASS * SPEED**2 * (1.0 - restitution**2), rel=1e-5
    )
    # The strongest damping acts in a jolt at the onset.
    accuracy = 1e-9 if restitution > 0.1 else 1e-7
    assert abs(run["energy.balance"]).max() < accuracy * run["energy.kinetic"].max()


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_the_period_of_a_free_bounce_between_the_flanks(method):
    # The driver turns on by itself: 10 flights over the play and 10 half oscillations at the flanks.
    run = cc.simulate(
        rattling(Hertz(1e8, exponent=1.0)),
        duration=0.012,
        samples=101,
        outputs=RATTLE,
        method=method,
        rtol=1e-9,
    )
    onsets = [event for event in run.events if event.kind == "onset"]
    assert [event.joint for event in onsets[:4]] == ["mesh.ahead", "mesh.behind"] * 2
    half = 2e-4 / SPEED + math.pi * math.sqrt(MASS / 1e8)
    found = np.array([event.time for event in onsets])
    assert len(found) > 10
    assert found == pytest.approx(1e-4 / SPEED + half * np.arange(len(found)), rel=1e-8)
    assert abs(run["energy.balance"]).max() < 1e-9 * run["energy.kinetic"].max()


def test_teeth_rest_under_load_as_deep_as_their_law_says():
    driven = {"forces": [cc.Torque("load", "b", -3.0)], "drives": [Speed("motor", "p", 200.0 * math.pi)]}
    law = KelvinVoigt(1e7, 2e4, exponent=1.5)
    scene = pair(backlash=2e-4, contact=law, **driven)
    assert scene.check().degrees_of_freedom == 1
    run = cc.simulate(scene, duration=100.0, samples=3, outputs=["mesh.*", "q.reaction_*", "*.angle"])
    # Ten thousand turns of the motor; the play has an angle of 1 mrad.
    assert run["a.angle"][-1] == pytest.approx(2e4 * math.pi, rel=1e-12)
    depth = (15.0 / 1e7) ** (2.0 / 3.0)
    assert run["mesh.transmission_error"][1:] == pytest.approx(np.full(2, -1e-4 - depth), abs=1e-11)
    assert run["mesh.behind.penetration"][1:] == pytest.approx(np.full(2, depth), abs=1e-11)
    assert run["mesh.behind.contact"].tolist() == [0.0, 1.0, 1.0]
    assert run["mesh.torque"][1:] == pytest.approx(np.full(2, 3.0), rel=1e-6)
    assert run["q.reaction_x"][1:] == pytest.approx(np.full(2, -15.0 * TANGENT), rel=1e-6)
    tied = cc.simulate(pair(**driven), duration=0.01, samples=3, outputs=["q.reaction_*"])
    assert run["q.reaction_y"][-1] == pytest.approx(tied["q.reaction_y"][-1], rel=1e-6)


def test_trains_in_parallel_and_driven_wheels_may_have_backlash():
    law = {"pressure_angle": ALPHA, "backlash": 2e-4, "contact": Hertz(1e8)}
    both = pair(**law, drives=[Speed("m", "p", 30.0), Speed("n", "q", -14.0)])
    run = cc.simulate(both, duration=1e-3, samples=3, outputs=["mesh.*"])
    # The driven teeth get ahead by 1 rad/s at 0.2 m, and into a flank.
    assert run["mesh.transmission_error"] == pytest.approx([0.0, 1e-4, 2e-4], abs=1e-15)
    force = 1e8 * 1e-4**1.5
    assert run["mesh.tooth_force"] == pytest.approx([0.0, 0.0, force / math.cos(ALPHA)], abs=1e-6)
    assert run["mesh.driver_torque"] == pytest.approx([0.0, 0.0, -0.1 * force], abs=1e-6)
    mesh = pair(**law).couplings[0]
    parallel = replace(pair(**law), couplings=[mesh, replace(mesh, name="other", law=-0.6)])
    assert parallel.check().degrees_of_freedom == 2


def test_a_start_says_where_in_the_play_the_teeth_are_and_how_fast():
    law = {"backlash": 2e-4, "contact": Hertz(1e8)}
    motor = [Speed("motor", "p", 30.0)]
    outputs = ["mesh.transmission_error", "*.angular_velocity", "*.angle"]

    def first(scene):
        run = cc.simulate(scene, duration=1e-6, samples=2, outputs=outputs)
        return run["mesh.transmission_error"][0], run["b.angular_velocity"][0]

    assert first(pair(drives=motor, **law)) == pytest.approx((0.0, -15.0), abs=1e-14)
    assert first(pair(drives=motor, offset=0.7, **law)) == pytest.approx((0.0, -15.0), abs=1e-14)
    slow = [cc.BodyStart("b", 0.7 + 4e-4, -10.0)]
    placed = first(pair(drives=motor, offset=0.7, start=slow, **law))
    assert placed == pytest.approx((0.2 * 4e-4, -10.0), abs=1e-14)


def test_a_rattle_goes_on_from_its_middle():
    scene = rattling(ExactRestitution(1e9, 0.8))
    settings = {"samples": 51, "outputs": RATTLE, "method": "rodas5p", "rtol": 1e-9}
    whole = cc.simulate(scene, duration=0.002, **{**settings, "samples": 101})
    # The first half ends while the teeth touch.
    first = cc.simulate(scene, duration=0.001, **settings)
    assert first["mesh.ahead.contact"][-1] + first["mesh.behind.contact"][-1] == 1.0
    second = cc.simulate(scene, duration=0.001, start=first.end, **settings)
    for name in ("mesh.transmission_error", "b.angular_velocity"):
        assert second[name] == pytest.approx(whole[name][50:], abs=1e-6 * abs(whole[name]).max())


def test_a_backlash_in_millimeters_is_doubted():
    (notice,) = pair(backlash=0.1, contact=Hertz(1e8)).check().notices
    assert (notice.code, notice.about) == ("large_coupling", (PLAY,))


PRESSURE, CONTACT, PLAY = (f"couplings[0].{name}" for name in ("pressure_angle", "contact", "backlash"))


@pytest.mark.parametrize(
    ("teeth", "paths"),
    [
        ({"pressure_angle": 20.0}, [PRESSURE]),
        ({"pressure_angle": -0.1}, [PRESSURE]),
        ({"pressure_angle": math.nan}, [PRESSURE]),
        ({"law": "-0.5*a.angle"}, [PRESSURE]),
        ({"law": 1.0}, [PRESSURE]),
        ({"driver": "q.angle", "driven": "c.angle"}, [PRESSURE]),
        ({"driver": "c.angle"}, [PRESSURE]),
        ({"driven": "d.angle"}, [PRESSURE]),
        ({"carrier": "d"}, [PRESSURE]),
        ({"driven": "slide.displacement", "driver": "c.angle"}, [PRESSURE]),
        ({"driven": "slide.displacement", "driver": "rail.displacement"}, [PRESSURE]),
        ({"pressure_angle": None, "backlash": 1e-4, "contact": Hertz(1e8)}, [PRESSURE]),
        ({"backlash": 1e-4}, [CONTACT]),
        ({"contact": Hertz(1e8)}, [PLAY]),
        ({"backlash": 0.0, "contact": Hertz(1e8)}, [PLAY]),
        (
            {"backlash": -1.0, "contact": Hertz(-1e8), "pressure_angle": 20.0},
            [PLAY, CONTACT + ".stiffness", PRESSURE],
        ),
    ],
)
def test_teeth_that_cannot_be_are_refused_with_their_path(teeth, paths):
    scene = pair(
        bodies=[cc.Body(name, 1.0, 0.1, points={"P": (0.2, 0.0)}) for name in "cdef"],
        joints=[
            # d turns with play on ground, c on d; e and f slide.
            cc.Revolute("r", "d", "c.P"),
            cc.ClearanceRevolute("loose", "ground.A", "d", 0.01, 1e-4, Hertz(1e9)),
            cc.Prismatic("slide", "ground", "e", axis=(1.0, 0.0)),
            cc.Prismatic("rail", "ground", "f", axis=(1.0, 0.0)),
        ],
    )
    scene = replace(scene, couplings=[replace(scene.couplings[0], **teeth)])
    assert sorted(refused(scene)) == sorted(paths)


FILE = """
format = 1
bodies = [{ name = "a", mass = 1, inertia = 0.01 }, { name = "b", mass = 2, inertia = 0.2 }]
joints = [
    { type = "revolute", name = "p", a = "ground.A", b = "a" },
    { type = "revolute", name = "q", a = "ground.B", b = "b" },
]
ground = { A = [0, 0], B = ["300 mm", 0] }
drives = [{ type = "speed", name = "motor", joint = "p", speed = "600 rpm" }]
forces = [{ type = "torque", name = "load", body = "b", torque = "2*sin(100*time)" }]
[[couplings]]
name = "mesh"
driven = "b.angle"
driver = "a.angle"
law = "-1/2"
pressure_angle = "20 deg"
backlash = "play"
contact = { law = "exact_restitution", stiffness = 1e9, restitution = 0.8 }
[parameters]
play = { nominal = "0.1 mm", plus = "0.05 mm", minus = "0.05 mm" }
"""


def test_teeth_stand_in_scene_files_and_vary_in_studies():
    template = cc.loads(FILE)
    scene = template()
    assert cc.Scene.from_json(scene.to_json()) == scene
    assert scene.couplings[0].pressure_angle == pytest.approx(ALPHA)
    assert "backlash 0.0001 [m]" in scene.describe()
    found = template.study(
        outputs=["mesh.transmission_error"],
        features={"hits": cc.features.impacts("mesh.behind")},
        skip=0.1,
        duration=0.1,
        samples=5,
    ).sample(4)
    assert len(found.failures) == 0
    cc.plots.plot_scene(scene)
