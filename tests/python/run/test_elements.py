"""Springs, dampers, given forces and motions against closed forms; reactions against Newton and Euler."""

import dataclasses
import itertools
import math

import chebclear as cc
import numpy as np
import pytest

METHODS = ["rodas5p", "rodas4", "dop853", "adams"]
GRAVITY = cc.Gravity((0.0, -9.81))


def link(name, length, mass, angle=0.0, center=None, inertia=None):
    return cc.Body(
        name,
        mass,
        mass * length**2 / 12.0 if inertia is None else inertia,
        center_of_mass=(0.5 * length, 0.0) if center is None else center,
        points={"P": (0.0, 0.0), "Q": (length, 0.0)},
        angle=angle,
    )


def cart(forces=(), drives=(), start=(), axis=(1.0, 0.0)):
    """A cart of 2 kg on a rail."""
    return cc.Scene(
        [cc.Body("cart", 2.0, 0.3, points={"P": (0.0, 0.0)})],
        [cc.Prismatic("rail", "ground.O", "cart.P", axis)],
        forces,
        drives,
        ground={"O": (0.0, 0.0), "wall": (-1.0, 0.0)},
        start=start,
    )


class TestFunctionsOfTime:
    @pytest.mark.parametrize("count", [2, 3, 4, 5, 12])
    def test_a_table_is_the_spline_of_scipy(self, count):
        spline = pytest.importorskip("scipy.interpolate").CubicSpline
        random = np.random.default_rng(count)
        times = np.concatenate([[0.0], np.cumsum(random.uniform(0.1, 1.0, count - 1))])
        values = random.uniform(-1.0, 1.0, count)
        truth = spline(times, values)
        run = cc.simulate(
            cart(drives=[cc.Motion("drive", "rail", cc.Table(times, values))]),
            duration=times[-1],
            samples=201,
            outputs=["rail.displacement", "rail.velocity", "rail.acceleration", "drive.force"],
        )
        for order, name in enumerate(["displacement", "velocity", "acceleration"]):
            np.testing.assert_allclose(run[f"rail.{name}"], truth(run.t, order), rtol=0.0, atol=1e-11)
        np.testing.assert_allclose(run["drive.force"], 2.0 * truth(run.t, 2), rtol=0.0, atol=1e-10)

    @pytest.mark.parametrize("axis", [(1.0, 0.0), (0.0, -2.0), (3.0, 4.0)])
    def test_a_prescribed_slide_needs_the_force_of_inertia_and_weight(self, axis):
        motion = cc.Polynomial([0.1, 0.2, -0.3, 0.4])
        scene = cart([GRAVITY], [cc.Motion("drive", "rail", motion)], axis=axis)
        run = cc.simulate(
            scene,
            duration=1.0,
            samples=51,
            outputs=["drive.*", "rail.*", "cart.ax", "cart.ay", "cart.vx", "cart.vy"],
        )
        t, along = run.t, np.array(axis) / np.hypot(*axis)
        speed, acceleration = 0.2 - 0.6 * t + 1.2 * t**2, -0.6 + 2.4 * t
        total = 2.0 * (acceleration[:, None] * along + [0.0, 9.81])
        for name, truth in {
            "rail.velocity": speed,
            "rail.acceleration": acceleration,
            "drive.force": total @ along,
            "drive.power": total @ along * speed,
            "rail.reaction_x": total[:, 0],
            "rail.reaction_y": total[:, 1],
            "rail.reaction_torque": 0.0 * t,
            "cart.ax": acceleration * along[0],
            "cart.vy": speed * along[1],
        }.items():
            np.testing.assert_allclose(run[name], truth, rtol=0.0, atol=1e-12, err_msg=name)

    @pytest.mark.parametrize("held", [0.3, cc.Polynomial([0.3]), cc.Harmonic(0.0, 5.0, mean=0.3)])
    def test_a_number_holds_a_joint(self, held):
        run = cc.simulate(
            cart([GRAVITY], [cc.Motion("drive", "rail", held)]), duration=0.1, samples=3, outputs=["rail.*"]
        )
        assert np.array_equal(run["rail.displacement"], np.full(3, 0.3))
        assert np.array_equal(run["rail.velocity"], np.zeros(3))


class TestOscillators:
    @pytest.mark.parametrize("method", METHODS)
    @pytest.mark.parametrize("split", [False, True])
    def test_spring_with_damper(self, method, split):
        """One element, or spring and damper apart."""
        forces = (
            [
                cc.Spring("s", "ground.wall", "cart.P", 200.0, 1.0),
                cc.Damper("d", "cart.P", "ground.wall", 3.0),
            ]
            if split
            else [cc.Spring("s", "ground.wall", "cart.P", 200.0, 1.0, damping=3.0)]
        )
        scene = cart(forces, start=[cc.JointStart("rail", 0.1, -0.5)])
        run = cc.simulate(
            scene, duration=3.0, samples=101, rtol=1e-10, method=method, outputs=["cart.x", "energy.*"]
        )
        decay, w = 3.0 / 4.0, math.sqrt(100.0 - 9.0 / 16.0)
        x = np.exp(-decay * run.t) * (0.1 * np.cos(w * run.t) + (-0.5 + decay * 0.1) / w * np.sin(w * run.t))
        np.testing.assert_allclose(run["cart.x"], x, rtol=0.0, atol=1e-9)
        assert np.all(np.diff(run["energy.damping_loss"]) > 0.0)
        assert abs(run["energy.total"][0] - (0.5 * 200.0 * 0.01 + 0.25)) < 1e-13

    @pytest.mark.parametrize("method", METHODS)
    def test_torsion_spring_with_torsion_damper(self, method):
        scene = cc.Scene(
            [cc.Body("wheel", 1.0, 0.5)],
            [cc.Revolute("axle", "ground", "wheel")],
            [
                cc.TorsionSpring("coil", "ground", "wheel", 8.0, angle=0.4),
                cc.TorsionDamper("drag", "wheel", "ground", 0.6),
            ],
            start=[cc.JointStart("axle", position=1.0, velocity=2.0)],
        )
        run = cc.simulate(
            scene,
            duration=3.0,
            samples=101,
            rtol=1e-10,
            method=method,
            outputs=["wheel.angle", "coil.*", "drag.*"],
        )
        decay, w = 0.6, math.sqrt(16.0 - 0.36)
        x = np.exp(-decay * run.t) * (0.6 * np.cos(w * run.t) + (2.0 + decay * 0.6) / w * np.sin(w * run.t))
        np.testing.assert_allclose(run["wheel.angle"], 0.4 + x, rtol=0.0, atol=1e-8)
        np.testing.assert_allclose(run["coil.torque"], -8.0 * x, rtol=0.0, atol=1e-7)
        np.testing.assert_allclose(run["drag.angle"], -0.4 - x, rtol=0.0, atol=1e-8)

    def test_a_spring_pendulum_in_two_dimensions_follows_its_equations(self):
        """A bob that cross slides let move anywhere but not turn, against SciPy in polar coordinates."""
        solve = pytest.importorskip("scipy.integrate").solve_ivp
        k, c, length, m = 40.0, 0.5, 0.3, 0.7
        scene = cc.Scene(
            [cc.Body("slide", 1e-12, 1e-12), cc.Body("bob", m, 0.1)],
            [cc.Prismatic("x", "ground", "slide", (1.0, 0.0)), cc.Prismatic("y", "slide", "bob", (0.0, 1.0))],
            [GRAVITY, cc.Spring("spring", "ground", "bob", k, length, c)],
            start=[cc.JointStart("x", 0.3, 0.2), cc.JointStart("y", -0.2, 0.0)],
        )

        def motion(t, z):
            r, angle, speed, turning = z
            tension = k * (r - length) + c * speed
            return [
                speed,
                turning,
                r * turning**2 + 9.81 * math.cos(angle) - tension / m,
                -(2.0 * speed * turning + 9.81 * math.sin(angle)) / r,
            ]

        r, angle = math.hypot(0.3, 0.2), math.atan2(0.3, 0.2)
        start = [r, angle, 0.2 * math.sin(angle), 0.2 * math.cos(angle) / r]
        run = cc.simulate(scene, duration=1.5, samples=31, rtol=1e-11, outputs=["spring.*", "bob.x", "bob.y"])
        truth = solve(motion, (0.0, 1.5), start, "DOP853", run.t, rtol=1e-12, atol=1e-12).y
        np.testing.assert_allclose(run["spring.length"], truth[0], rtol=0.0, atol=1e-7)
        np.testing.assert_allclose(run["bob.x"], truth[0] * np.sin(truth[1]), rtol=0.0, atol=1e-7)
        np.testing.assert_allclose(
            run["spring.force"], k * (truth[0] - length) + c * truth[2], rtol=0.0, atol=1e-5
        )


def slider_crank(forces=(), drives=(), start=(), flywheel=0.0, angle=0.7):
    """An ideal slider-crank, crank 0.1 m, rod 0.35 m; all joints at named points."""
    crank, rod = 0.1, 0.35
    tilt = -math.asin(crank * math.sin(angle) / rod)
    return cc.Scene(
        [
            link("crank", crank, 0.4, angle, center=(0.02, 0.0), inertia=3e-3 + flywheel),
            link("rod", rod, 0.6, tilt, center=(0.15, 0.01)),
            cc.Body("slider", 0.8, 1e-3, points={"P": (0.0, 0.0), "T": (0.05, 0.02)}),
        ],
        [
            cc.Revolute("bearing", "ground.O", "crank.P"),
            cc.Revolute("pin", "crank.Q", "rod.P"),
            cc.Revolute("wrist", "rod.Q", "slider.P"),
            cc.Prismatic("guide", "ground.O", "slider.P", (1.0, 0.0)),
        ],
        forces,
        drives,
        ground={"O": (0.0, 0.0), "W": (0.8, 0.1)},
        start=start,
    )


def four_bar(forces=(), drives=(), start=()):
    return cc.Scene(
        [link("crank", 0.1, 0.2, 0.4), link("coupler", 0.25, 0.5, 0.6), link("rocker", 0.2, 0.4, 1.8)],
        [
            cc.Revolute("A", "ground.A", "crank.P"),
            cc.Revolute("B", "crank.Q", "coupler.P"),
            cc.Revolute("C", "coupler.Q", "rocker.Q"),
            cc.Revolute("D", "ground.D", "rocker.P"),
        ],
        forces,
        drives,
        ground={"A": (0.0, 0.0), "D": (0.3, 0.0), "W": (0.15, 0.3)},
        start=start,
    )


def unit_speeds(angle):
    """Speeds of slider-crank's centers of mass and rod at unit crank speed, by the textbook."""
    crank, rod = 0.1, 0.35
    sine, cosine = np.sin(angle), np.cos(angle)
    tilt = np.arcsin(-crank * sine / rod)
    turning = -crank * cosine / (rod * np.cos(tilt))
    pin = np.array([-crank * sine, crank * cosine])
    arm = np.array([0.15 * np.cos(tilt) - 0.01 * np.sin(tilt), 0.15 * np.sin(tilt) + 0.01 * np.cos(tilt)])
    rod_speed = pin + turning * np.array([-arm[1], arm[0]])
    slider = -crank * sine - turning * rod * np.sin(tilt)
    return rod_speed, turning, slider


def reduced_inertia(angle, flywheel):
    """Moment of inertia of the slider-crank seen from its crank."""
    rod_speed, turning, slider = unit_speeds(angle)
    rod_inertia = 0.6 * 0.35**2 / 12.0
    return (
        3e-3
        + flywheel
        + 0.4 * 0.02**2
        + 0.6 * np.sum(rod_speed**2, axis=0)
        + rod_inertia * turning**2
        + 0.8 * slider**2
    )


class TestFlywheel:
    @pytest.mark.parametrize("flywheel", [0.0, 0.05])
    @pytest.mark.parametrize("torque", [0.0, 0.4])
    def test_speed_follows_from_the_work_done(self, flywheel, torque):
        """½ J(θ) ω² = ½ J(θ₀) ω₀² + T (θ - θ₀), with J(θ) by the textbook."""
        scene = slider_crank(
            [cc.Torque("motor", "crank", torque)],
            start=[cc.JointStart("bearing", position=0.7, velocity=20.0)],
            flywheel=flywheel,
        )
        run = cc.simulate(
            scene,
            duration=1.0,
            samples=401,
            rtol=1e-9,
            outputs=["bearing.angle", "bearing.angular_velocity", "energy.*"],
        )
        angle, speed = run["bearing.angle"], run["bearing.angular_velocity"]
        energy = 0.5 * reduced_inertia(0.7, flywheel) * 400.0 + torque * (angle - 0.7)
        np.testing.assert_allclose(speed, np.sqrt(2.0 * energy / reduced_inertia(angle, flywheel)), rtol=1e-7)
        np.testing.assert_allclose(run["energy.input"], torque * (angle - 0.7), rtol=0.0, atol=1e-7)
        assert angle[-1] > 3.0 * math.pi

    def test_a_flywheel_evens_the_speed(self):
        def unevenness(flywheel):
            start = [cc.JointStart("bearing", position=0.7, velocity=20.0)]
            run = cc.simulate(
                slider_crank(start=start, flywheel=flywheel),
                duration=1.0,
                samples=401,
                outputs=["bearing.angular_velocity"],
            )
            speed = run["bearing.angular_velocity"]
            return np.ptp(speed) / np.mean(speed)

        wheels = [0.0, 0.01, 0.1, 1.0]
        uneven = [unevenness(wheel) for wheel in wheels]
        assert all(less < more for more, less in itertools.pairwise(uneven))
        # Large flywheels: δ = ΔJ / (2 J) to first order in ΔJ / J.
        change = np.ptp(reduced_inertia(np.linspace(0.0, 2.0 * math.pi, 1001), 0.0))
        assert uneven[-1] == pytest.approx(0.5 * change / reduced_inertia(0.0, 1.0), rel=0.02)

    def test_constant_torque_on_a_wheel(self):
        scene = cc.Scene(
            [cc.Body("wheel", 1.0, 0.5)],
            [cc.Revolute("axle", "ground", "wheel")],
            [cc.Torque("motor", "wheel", 3.0)],
        )
        run = cc.simulate(scene, duration=2.0, samples=21, outputs=["wheel.angular_velocity"])
        np.testing.assert_allclose(run["wheel.angular_velocity"], 6.0 * run.t, rtol=1e-12)


def newton_and_euler(scene, run):
    """What force and moment balance of every body leaves, from named outputs alone.

    The balance is written about the origin of ground with the loads that the scene names; inertia, weight,
    springs and given forces are computed here.
    """
    g = sum((np.array(f.acceleration) for f in scene.forces if isinstance(f, cc.Gravity)), np.zeros(2))
    bodies = {body.name: body for body in scene.bodies}

    def at(reference):
        owner, point = reference.split(".")
        if owner == "ground":
            return np.tile(scene.ground[point], (len(run.t), 1))
        return np.column_stack((run[f"{reference}.x"], run[f"{reference}.y"]))

    def cross(a, b):
        return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]

    left = {}
    for body in scene.bodies:
        center, acceleration = (
            np.column_stack((run[f"{body.name}.{p}x"], run[f"{body.name}.{p}y"])) for p in ("", "a")
        )
        force = body.mass * (acceleration - g)
        moment = body.inertia * run[f"{body.name}.angular_acceleration"] + cross(center, force)
        left[body.name] = [force, moment]

    def load(owner, place, force, moment=0.0):
        if owner in bodies:
            left[owner][0] = left[owner][0] - force
            left[owner][1] = left[owner][1] - cross(place, force) - moment

    for joint in scene.joints:
        force = np.column_stack((run[f"{joint.name}.reaction_x"], run[f"{joint.name}.reaction_y"]))
        moment, place = run[f"{joint.name}.reaction_torque"], at(joint.b)
        load(joint.b.split(".")[0], place, force, moment)
        load(joint.a.split(".")[0], place, -force, -moment)
    for force in scene.forces:
        if isinstance(force, (cc.Spring, cc.Damper)):
            a, b = at(force.a), at(force.b)
            pull = run[f"{force.name}.force"][:, None] * (a - b) / np.linalg.norm(a - b, axis=1)[:, None]
            load(force.b.split(".")[0], b, pull)
            load(force.a.split(".")[0], a, -pull)
        elif isinstance(force, (cc.TorsionSpring, cc.TorsionDamper)):
            none = np.zeros((len(run.t), 2))
            load(force.b, none, none, run[f"{force.name}.torque"])
            load(force.a, none, none, -run[f"{force.name}.torque"])
        elif isinstance(force, cc.Force):
            load(force.point.split(".")[0], at(force.point), np.tile((force.x, force.y), (len(run.t), 1)))
        elif isinstance(force, cc.Torque):
            none = np.zeros((len(run.t), 2))
            load(force.body, none, none, force.torque)
            load(force.reaction, none, none, -force.torque)
    return left


LOADS = [
    GRAVITY,
    cc.Spring("spring", "ground.W", "{last}.P", 300.0, 0.1, damping=4.0),
    cc.TorsionSpring("coil", "crank", "{middle}", 2.0, 0.3, 0.05),
    cc.Force("push", "{middle}.Q", 3.0, -7.0),
    cc.Torque("motor", "crank", 1.5, reaction="{middle}"),
]


def loaded(make, middle, last, **options):
    def filled(force):
        names = {
            f.name: getattr(force, f.name).format(middle=middle, last=last)
            for f in dataclasses.fields(force)
            if isinstance(getattr(force, f.name), str)
        }
        return dataclasses.replace(force, **names)

    return make([filled(force) for force in LOADS], **options)


class TestReactions:
    @pytest.mark.parametrize(
        "scene",
        [
            loaded(slider_crank, "rod", "slider"),
            loaded(slider_crank, "rod", "slider", drives=[cc.Speed("drive", "bearing", 30.0, 0.7)]),
            loaded(
                slider_crank,
                "rod",
                "slider",
                drives=[cc.Motion("drive", "guide", cc.Harmonic(0.05, 9.0, mean=0.4))],
            ),
            loaded(four_bar, "coupler", "rocker"),
            loaded(
                four_bar,
                "coupler",
                "rocker",
                drives=[cc.Motion("drive", "A", cc.Harmonic(0.5, 9.0, mean=0.4))],
            ),
            loaded(
                four_bar,
                "coupler",
                "rocker",
                drives=[cc.Motion("drive", "B", cc.Polynomial([0.2, 0.0, 0.5]))],
            ),
        ],
        ids=["slider-crank", "driven crank", "driven slider", "four-bar", "swung crank", "driven coupler"],
    )
    def test_every_body_of_a_loop_is_in_balance(self, scene):
        run = cc.simulate(scene, duration=0.3, samples=31, outputs=["*"])
        scale = max(abs(run[name]).max() for name in run.columns if "reaction" in name)
        for name, (force, moment) in newton_and_euler(scene, run).items():
            assert abs(force).max() < 1e-9 * scale, name
            assert abs(moment).max() < 1e-9 * scale, name

    @pytest.mark.parametrize("angle", [0.3, 1.2, 2.5, -0.8])
    def test_a_held_slider_crank_is_a_matter_of_statics(self, angle):
        """The rod is a two-force member; the crank's torque is that of its pin force."""
        push = -50.0
        scene = slider_crank(
            [cc.Force("push", "slider.P", push, 0.0)], [cc.Motion("hold", "bearing", angle)], angle=angle
        )
        run = cc.simulate(scene, duration=0.1, samples=3, outputs=["*"])
        tilt = -math.asin(0.1 * math.sin(angle) / 0.35)
        rod = -push * np.array([1.0, math.tan(tilt)])  # what the rod does to the slider
        pin = 0.1 * np.array([math.cos(angle), math.sin(angle)])
        for name, truth in {
            "wrist.reaction_x": rod[0],
            "wrist.reaction_y": rod[1],
            "guide.reaction_x": 0.0,
            "guide.reaction_y": -rod[1],
            "pin.reaction_x": rod[0],
            "pin.reaction_y": rod[1],
            "bearing.reaction_x": rod[0],
            "bearing.reaction_y": rod[1],
            "hold.torque": pin[0] * rod[1] - pin[1] * rod[0],
            "hold.power": 0.0,
        }.items():
            np.testing.assert_allclose(run[name], truth, rtol=0.0, atol=1e-11 * 50.0, err_msg=name)

    def test_a_bracket_of_welded_bodies_carries_its_load(self):
        """A cantilever: the weld at its root feels weight and moment of all that hangs on it."""
        scene = cc.Scene(
            [link("beam", 0.5, 2.0), link("tip", 0.2, 1.0), cc.Body("wheel", 1.0, 1.0)],
            [
                cc.Fixed("root", "ground", "beam.P"),
                cc.Fixed("splice", "beam.Q", "tip.P"),
                cc.Revolute("axle", "tip.Q", "wheel"),
            ],
            [GRAVITY, cc.Force("load", "tip.Q", 0.0, -10.0)],
        )
        run = cc.simulate(scene, duration=0.1, samples=3, outputs=["root.*", "splice.*"])
        assert run["root.reaction_x"][0] == 0.0
        assert run["root.reaction_y"] == pytest.approx(4.0 * 9.81 + 10.0)
        moment = 2.0 * 9.81 * 0.25 + 1.0 * 9.81 * 0.6 + (9.81 + 10.0) * 0.7
        assert run["root.reaction_torque"] == pytest.approx(moment)
        assert run["splice.reaction_torque"] == pytest.approx(9.81 * 0.1 + (9.81 + 10.0) * 0.2)


class TestStarts:
    def test_a_journal_starts_where_it_is_told(self):
        scene = cc.mechanisms.slider_crank(clearance=1e-4)
        joint = next(joint.name for joint in scene.joints if isinstance(joint, cc.ClearanceRevolute))
        start = cc.ClearanceStart(joint, (3e-5, -4e-5), (0.02, 0.01))
        run = cc.simulate(dataclasses.replace(scene, start=[start]), duration=1e-6, samples=2)
        np.testing.assert_allclose(
            [run[f"{joint}.eccentricity_{axis}"][0] for axis in "xy"], (3e-5, -4e-5), rtol=0.0, atol=1e-16
        )
        rate = (0.02 * 3.0 - 0.01 * 4.0) / 5.0
        assert run[f"{joint}.penetration_rate"][0] == pytest.approx(rate, abs=1e-13)
        assert run[f"{joint}.penetration"][0] == pytest.approx(5e-5 - 1e-4, abs=1e-16)

    @pytest.mark.filterwarnings("ignore:joint .* it slides slower")
    def test_a_journal_may_start_in_contact_and_a_warning_says_how_it_is_damped(self):
        scene = cc.mechanisms.free_journal()
        clearance = next(joint for joint in scene.joints if isinstance(joint, cc.ClearanceRevolute))
        pressed = cc.ClearanceStart(clearance.name, (0.0, -clearance.clearance * 1.001))
        scene = dataclasses.replace(scene, start=[pressed])
        with pytest.warns(cc.ChebclearWarning, match="starts in contact"):
            run = cc.simulate(scene, duration=1e-4, samples=11)
        assert run[f"{clearance.name}.contact"][0] == 1.0
        assert run.contacts.onset[0] == 0.0 and np.isnan(run.contacts.impact_velocity[0])

    def test_joints_and_bodies_start_as_they_are_told(self):
        scene = four_bar(start=[cc.JointStart("C", velocity=3.0), cc.BodyStart("crank", angle=1.25)])
        run = cc.simulate(scene, duration=1e-3, samples=2, outputs=["*"])
        assert run["crank.angle"][0] == pytest.approx(1.25, abs=1e-12)
        assert run["C.angular_velocity"][0] == pytest.approx(3.0, abs=1e-12)
        speeds = [run[f"{name}.angular_velocity"][0] for name in ("coupler", "rocker")]
        assert speeds[1] - speeds[0] == pytest.approx(3.0, abs=1e-12)
        # The loop is closed in position and velocity.
        for axis in "xy":
            for kind in ("", "v"):
                a, b = (run[f"{end}.{kind}{axis}"][0] for end in ("coupler.Q", "rocker.Q"))
                assert a == pytest.approx(b, abs=1e-13)

    @pytest.mark.parametrize(
        "start, words",
        [
            ([cc.BodyStart("crank", angle=0.4), cc.BodyStart("rocker", angle=-1.0)], "cannot be assembled"),
            (
                [cc.BodyStart("crank", angular_velocity=1.0), cc.BodyStart("rocker", angular_velocity=9.0)],
                "the start contradicts itself or the drives",
            ),
            ([cc.JointStart("A", 0.4), cc.JointStart("A", 0.5)], 'the start of "A" is given twice'),
        ],
    )
    def test_starts_that_contradict_are_refused(self, start, words):
        with pytest.raises(cc.SceneError, match=words):
            four_bar(start=start).check()

    def test_a_driven_joint_starts_where_its_drive_is(self):
        scene = four_bar(drives=[cc.Speed("drive", "A", 3.0, 0.4)], start=[cc.JointStart("A", 0.5)])
        with pytest.raises(cc.SceneError, match='the start of joint "A" is prescribed by its drive "drive"'):
            scene.check()

    @pytest.mark.parametrize("method", METHODS)
    def test_skipping_is_looking_later(self, method):
        scene = cc.mechanisms.slider_crank(clearance=5e-5)
        whole = cc.simulate(scene, duration=0.015625, samples=65, method=method)
        late = cc.simulate(scene, duration=0.015625 / 4, samples=17, method=method, skip=0.75 * 0.015625)
        assert np.array_equal(late.t, whole.t[48:])
        assert np.array_equal(late.values, whole.values[48:])
        assert late.end_time == whole.end_time
        told = np.concatenate([late.skipped_events.time, late.events.time])
        assert np.array_equal(told, whole.events.time)
        # DOP853 pays for the dense output of the steps that hold samples.
        assert late.stats.evaluations <= whole.stats.evaluations
        assert dataclasses.replace(late.stats, evaluations=whole.stats.evaluations) == whole.stats

    def test_the_period_is_that_of_the_slowest_drive(self):
        scene = cc.mechanisms.slider_crank(crank_speed=50.0)
        assert scene.period == 2.0 * math.pi / 50.0
        two = dataclasses.replace(
            scene, drives=[*scene.drives, cc.Speed("other", "x", -20.0), cc.Speed("held", "y", 0.0)]
        )
        assert two.period == 2.0 * math.pi / 20.0
        with pytest.raises(ValueError, match="it has no period"):
            _ = four_bar().period
