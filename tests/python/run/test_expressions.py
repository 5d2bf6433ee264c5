"""Forces and torques that depend on the motion, against closed forms and independent codes."""

import math
import re

import chebclear as cc
import numpy as np
import pytest
from refusals import refused
from scipy.integrate import solve_ivp

METHODS = ["rodas5p", "rodas4", "dop853", "adams"]
Expression, Table = cc.motions.Expression, cc.motions.Table


def block(*forces, x=0.1, v=0.0, mass=1.0, axis=(1.0, 0.0)):
    """A block on a rail."""
    return cc.Scene(
        [cc.Body("block", mass, 1.0, points={"P": (0.0, 0.0)})],
        [cc.Prismatic("rail", "ground.O", "block.P", axis)],
        forces,
        ground={"O": (0.0, 0.0), "W": (-1.0, 0.0), "far": (-10.0, 0.0)},
        start=[cc.JointStart("rail", position=x, velocity=v)],
    )


def rotor(*torques, inertia=0.1, speed=10.0, angle=0.0, drives=()):
    start = [] if drives else [cc.JointStart("shaft", position=angle, velocity=speed)]
    return cc.Scene(
        [cc.Body("rotor", 1.0, inertia, points={"P": (0.0, 0.0)})],
        [cc.Revolute("shaft", "ground", "rotor.P")],
        torques,
        drives,
        start=start,
    )


def press(force, **kwargs):
    """A slider-crank whose ram slides along x."""
    radius, length = 0.05, 0.2
    return cc.Scene(
        [
            cc.Body("crank", 0.5, 0.1, points={"O": (0.0, 0.0), "A": (radius, 0.0)}),
            cc.Body("rod", 0.4, 1e-3, (0.1, 0.0), points={"A": (0.0, 0.0), "B": (length, 0.0)}),
            cc.Body("ram", 2.0, 1e-2, points={"B": (0.0, 0.0)}),
        ],
        [
            cc.Revolute("main", "ground", "crank.O"),
            cc.Revolute("pin", "crank.A", "rod.A"),
            cc.Revolute("wrist", "rod.B", "ram.B"),
            cc.Prismatic("guide", "ground", "ram.B", (1.0, 0.0)),
        ],
        [force],
        **kwargs,
    )


CUT = cc.Force("cut", "ram.B", x="if(ram.vx < 0, if(ram.x < 0.2, if(ram.x > 0.17, 800, 0), 0), 0)", y=0.0)


SPRING = {"k": 300.0, "c": 2.0, "free": 0.7}
TENSION = "(k*({name}.length - free) + c*{name}.lengthening)"
ALONG = [f"-{TENSION.format(name='gauge')}*{along}/gauge.length" for along in ("(block.x + 1)", "block.y")]
COIL = cc.Spring("coil", "ground.far", "block.P", 100.0, 9.9, 0.5)
STRUT = cc.Spring("strut", "ground.W", "block.P", 300.0, 0.7, 2.0)
LINE, INCLINED = {"v": 20.0}, {"v": 50.0, "axis": (0.8, 0.6)}
# The same law built in and written, and where.
PAIRS = {
    "spring and damper": (
        [COIL],
        [
            cc.Force(
                "coil",
                "block.P",
                x=Expression("-k*(block.x + 10 - length) - c*block.vx", {"k": 100, "c": 0.5, "length": 9.9}),
                y=0.0,
            )
        ],
        LINE,
    ),
    # A spring without stiffness names the length; the force is that of another one.
    "spring by its length": (
        [STRUT],
        [
            cc.Damper("gauge", "ground.W", "block.P", damping=0.0),
            cc.Force("pull", "block.P", *(Expression(text, SPRING) for text in ALONG)),
        ],
        INCLINED,
    ),
    "preload": ([COIL], [cc.Spring("coil", "ground.far", "block.P", 100.0, 9.8, 0.5, tension=-10.0)], LINE),
    "characteristic": (
        [STRUT],
        [
            cc.Damper(
                "strut", "ground.W", "block.P", 0.0, tension=Expression(TENSION.format(name="strut"), SPRING)
            )
        ],
        INCLINED,
    ),
}


class TestLawsThatAreBuiltIn:
    @pytest.mark.parametrize("method", METHODS)
    @pytest.mark.parametrize("pair", PAIRS)
    def test_springs_and_dampers(self, pair, method):
        built_in, written, where = PAIRS[pair]
        # Fast enough that the start decides the scale of speed, and both runs take about the same steps.
        given = {"duration": 2.0, "samples": 101, "method": method, "rtol": 1e-9}
        outputs = ["block.x", "block.vx", "rail.reaction_x", "energy.balance"]
        runs = [cc.simulate(block(*law, **where), **given, outputs=outputs) for law in (built_in, written)]
        for name in outputs[:3]:
            scale = max(1.0, np.max(np.abs(runs[0][name])))
            np.testing.assert_allclose(runs[0][name], runs[1][name], rtol=0.0, atol=1e-9 * scale)
        assert np.max(np.abs(runs[1]["energy.balance"])) < 1e-5

    @pytest.mark.parametrize("method", METHODS)
    def test_a_torsion_spring_over_full_turns(self, method):
        spring = cc.TorsionSpring("coil", "ground", "rotor", stiffness=0.5, damping=0.01)
        written = cc.Torque("coil", "rotor", "-0.5*rotor.angle - 0.01*rotor.angular_velocity")
        runs = [
            cc.simulate(rotor(torque, speed=30.0), duration=5.0, samples=101, method=method, rtol=1e-9)
            for torque in (spring, written)
        ]
        np.testing.assert_allclose(runs[0]["rotor.angle"], runs[1]["rotor.angle"], rtol=0.0, atol=2e-7)
        assert np.max(np.abs(runs[0]["rotor.angle"])) > 4.0 * math.pi


class TestTensions:
    """Springs and dampers with a further tension: preload and characteristic."""

    def test_a_hardening_spring_has_the_period_of_duffing(self):
        """x'' = -x - x^3 from rest at 1: period 4 K(m) / sqrt(2), m = 1/4."""
        special = pytest.importorskip("scipy.special")
        scene = block(
            cc.Spring("coil", "ground.far", "block.P", 1.0, 10.0, tension="1*(coil.length - 10)**3"), x=1.0
        )
        period = 4.0 * special.ellipk(0.25) / math.sqrt(2.0)
        run = cc.simulate(scene, duration=5.0 * period, samples=6, rtol=1e-11, outputs=["block.x"])
        np.testing.assert_allclose(run["block.x"], 1.0, rtol=0.0, atol=1e-8)


class TestTables:
    def test_a_periodic_torque_does_its_work_every_turn(self):
        """0, 4, 0, -2, 0 N m at quarters of a turn do pi J a turn: from 10 rad/s to 20.350903 after five."""
        table = Table(np.arange(5) * math.pi / 2, [0, 4, 0, -2, 0], over="rotor.angle", periodic=True)
        run = cc.simulate(
            rotor(cc.Torque("motor", "rotor", table)),
            duration=6.0,
            samples=6001,
            rtol=1e-10,
            outputs=["rotor.angle", "rotor.angular_velocity", "energy.balance", "energy.input"],
        )
        turns = run["rotor.angle"] / (2.0 * math.pi)
        speed = np.sqrt(100.0 + 2.0 * run["energy.input"] / 0.1)
        np.testing.assert_allclose(run["rotor.angular_velocity"], speed, rtol=1e-9)
        # The work of the straight lines up to any angle, in closed form.
        part = (turns % 1.0) * 2.0 * math.pi
        knots, torques = np.arange(5) * math.pi / 2, np.array([0.0, 4.0, 0.0, -2.0, 0.0])
        done = np.concatenate([[0.0], np.cumsum(0.5 * (torques[1:] + torques[:-1]) * np.diff(knots))])
        at = np.minimum((part / (math.pi / 2)).astype(int), 3)
        slope = (torques[at + 1] - torques[at]) / (math.pi / 2)
        work = done[at] + torques[at] * (part - knots[at]) + 0.5 * slope * (part - knots[at]) ** 2
        truth = np.sqrt(100.0 + 20.0 * (np.floor(turns) * math.pi + work))
        np.testing.assert_allclose(run["rotor.angular_velocity"], truth, rtol=1e-8)
        assert turns[-1] > 5.0
        assert math.sqrt(100.0 + 20.0 * 5.0 * math.pi) == pytest.approx(20.350903, abs=5e-7)

    @pytest.mark.parametrize("interpolation", ["linear", "monotone", "cubic"])
    @pytest.mark.parametrize("periodic", [True, False])
    def test_the_curves_are_those_of_scipy(self, interpolation, periodic):
        interpolate = pytest.importorskip("scipy.interpolate")
        random = np.random.default_rng(5)
        points = np.concatenate([[0.0], np.cumsum(random.uniform(0.2, 1.0, 8))])
        values = random.uniform(-1.0, 1.0, 9)
        values[-1] = values[0]
        if interpolation == "monotone" and periodic:
            # Continued on both sides, so that the ends do not count.
            span = points[-1]
            longer = np.concatenate([points[:-1] - span, points[:-1], points + span])
            truth = interpolate.PchipInterpolator(longer, [*np.tile(values[:-1], 3), values[0]])
        elif interpolation == "monotone":
            truth = interpolate.PchipInterpolator(points, values)
        elif interpolation == "cubic":
            truth = interpolate.CubicSpline(points, values, bc_type="periodic" if periodic else "not-a-knot")
        else:
            truth = interpolate.make_interp_spline(points, values, k=1)
        table = Table(points, values, over="rotor.angle", interpolation=interpolation, periodic=periodic)
        scene = rotor(cc.Torque("load", "rotor", table), drives=[cc.motions.Speed("motor", "shaft", 1.0)])
        run = cc.simulate(
            scene, duration=points[-1] * (1.9 if periodic else 1.0), samples=501, outputs=["motor.torque"]
        )
        angle = np.where(run.t > points[-1], run.t - points[-1], run.t)
        np.testing.assert_allclose(-run["motor.torque"], truth(angle), rtol=0.0, atol=1e-12)

    def test_a_run_ends_where_its_table_ends(self):
        table = Table([-0.2, 0.2], [1.0, 3.0], over="block.x")
        with pytest.raises(cc.errors.SimulationError) as caught:
            cc.simulate(block(cc.Force("push", "block.P", x=table, y=0.0), x=0.0), duration=2.0, samples=11)
        assert (caught.value.reason, caught.value.load, caught.value.joint) == ("outside_table", "push", None)
        assert caught.value.trajectory.failed_load == "push"
        # x'' = 2 + 5 x from rest at 0
        assert caught.value.time == pytest.approx(
            math.acosh(0.2 * 5.0 / 2.0 + 1.0) / math.sqrt(5.0), rel=1e-3
        )
        held = Table([-0.2, 0.2], [1.0, 3.0], over="block.x", beyond="hold")
        run = cc.simulate(
            block(cc.Force("push", "block.P", x=held, y=0.0), x=0.0), duration=2.0, samples=11, rtol=1e-9
        )
        t = math.acosh(1.5) / math.sqrt(5.0)
        v = 0.4 * math.sqrt(5.0) * math.sinh(math.sqrt(5.0) * t)
        assert run["block.x"][-1] == pytest.approx(0.2 + v * (2.0 - t) + 1.5 * (2.0 - t) ** 2, rel=1e-7)


class TestSwitches:
    @pytest.mark.parametrize("method", METHODS)
    def test_dry_friction_takes_its_share_of_every_half_swing_and_ends_in_a_typed_error(self, method):
        """The amplitude falls by 2 f / k a half swing until the spring is weaker than friction."""
        scene = block(cc.Force("f", "block.P", x="-100*block.x - 1.3*sign(block.vx)", y=0.0))
        with pytest.raises(cc.errors.SimulationError) as caught:
            cc.simulate(scene, duration=5.0, samples=5001, method=method, rtol=1e-9)
        run = caught.value.trajectory
        assert caught.value.reason == "held"
        assert caught.value.time == pytest.approx(4.0 * math.pi / 10.0, rel=1e-7)
        x = run["block.x"]
        for half, extreme in enumerate([0.1, -0.074, 0.048, -0.022, -0.004]):
            at = round(half * math.pi / 10.0 / 1e-3)
            # Samples lie up to half a millisecond beside the extremes.
            near = x[max(at - 1, 0) : at + 2]
            near = near[np.isfinite(near)]
            assert np.min(np.abs(near - extreme)) < 2e-6

    @pytest.mark.parametrize("method", METHODS)
    def test_a_ball_on_a_one_sided_spring(self, method):
        """Flights and contacts of known length, energy kept over 30 bounces."""
        k, g, drop = 1e4, 9.81, 0.5
        scene = block(
            cc.Gravity((0.0, -g)),
            cc.Force("floor", "block.P", x=0.0, y=Expression("if(block.y < 0, -k*block.y, 0)", {"k": k})),
            x=drop,
            axis=(0.0, 1.0),
        )
        omega = math.sqrt(k)
        flight, speed = math.sqrt(2.0 * drop / g), math.sqrt(2.0 * g * drop)
        contact = 2.0 * (math.pi - math.atan(speed * omega / g)) / omega
        period = 2.0 * flight + contact
        run = cc.simulate(
            scene,
            duration=30.0 * period,
            samples=31,
            method=method,
            rtol=1e-9,
            outputs=["block.y", "block.vy", "energy.balance"],
        )
        np.testing.assert_allclose(run["block.y"], drop, rtol=0.0, atol=2e-6)
        assert run.stats.events == 60

    def test_a_press_loses_the_work_of_every_stroke(self):
        """The crank turns freely; a cut of 800 N over 30 mm takes 24 J a turn, gradually and exactly."""
        scene = press(CUT, start=[cc.JointStart("main", position=0.0, velocity=60.0)])
        run = cc.simulate(
            scene,
            duration=0.5,
            samples=2001,
            rtol=1e-9,
            outputs=["energy.kinetic", "energy.balance", "crank.angle"],
        )
        strokes = run["crank.angle"] / (2.0 * math.pi)
        # Cuts happen while the ram moves inward, in the first half of a turn, well inside of it.
        before = (strokes % 1.0 < 0.02) | (strokes % 1.0 > 0.6)
        lost = run["energy.kinetic"][0] - run["energy.kinetic"]
        np.testing.assert_allclose(lost[before], 24.0 * np.round(strokes[before]), rtol=0.0, atol=1e-6)
        assert np.max(np.abs(run["energy.balance"])) < 1e-7
        assert strokes[-1] > 3.0

    def test_a_prescribed_press_needs_the_work_of_the_cut(self):
        scene = press(CUT, drives=[cc.motions.Speed("motor", "main", 20.0)])
        run = cc.simulate(
            scene,
            duration=math.pi / 10.0,
            samples=20001,
            outputs=["motor.power", "ram.x", "ram.vx", "energy.balance"],
        )
        assert np.max(np.abs(run["energy.balance"])) < 1e-9
        # The torque jumps by the force times the lever at both ends of the cut.
        assert np.trapezoid(run["motor.power"], run.t) == pytest.approx(24.0, abs=0.02)


class TestKnownCurves:
    def test_a_motor_runs_up_along_the_curve_of_kloss(self):
        """T = 2 T_k / (s / s_k + s_k / s), s = 1 - w / w_s; the time to a slip s from s_0 is known."""
        pull_out, slip, synchronous, inertia = 30.0, 0.2, 157.0, 0.5
        motor = cc.Torque(
            "motor",
            "rotor",
            Expression(
                "2*T/((1 - rotor.angular_velocity/w)/s + s/(1 - rotor.angular_velocity/w))",
                {"T": pull_out, "s": slip, "w": synchronous},
            ),
        )
        run = cc.simulate(rotor(motor, inertia=inertia, speed=0.0), duration=5.0, samples=301, rtol=1e-10)
        s = 1.0 - run["rotor.angular_velocity"] / synchronous
        time = inertia * synchronous / (2.0 * pull_out) * ((1.0 - s**2) / (2.0 * slip) - slip * np.log(s))
        np.testing.assert_allclose(time, run.t, rtol=0.0, atol=1e-8)
        assert s[-1] < slip


class TestScenes:
    def test_they_survive_json_and_copies(self):
        scene = press(CUT)
        assert cc.Scene.from_json(scene.to_json()) == scene
        table = Table([0.1, 0.2], [1, 2], over="ram.x", interpolation="monotone", beyond="hold")
        for x in (table, Expression("k*ram.x", {"k": 3})):
            scene = press(cc.Force("cut", "ram.B", x=x, y=0.0))
            assert cc.Scene.from_json(scene.to_json()) == scene
            assert hash(scene) == hash(cc.Scene.from_json(scene.to_json()))


class TestPrescribedMotions:
    @staticmethod
    def driven(motion):
        return cc.Scene(
            [cc.Body("block", 2.0, 1.0)],
            [cc.Prismatic("rail", "ground", "block", (1.0, 0.0))],
            drives=[cc.motions.Motion("cam", "rail", motion)],
        )

    def test_a_formula_is_the_built_in_function(self):
        outputs = ["rail.displacement", "rail.velocity", "rail.acceleration", "cam.force"]
        runs = [
            cc.simulate(self.driven(motion), duration=3.0, samples=301, outputs=outputs)
            for motion in ("0.1 + 0.02*sin(7*time + 0.4)", cc.motions.Harmonic(0.02, 7.0, 0.4, 0.1))
        ]
        for name in outputs:
            np.testing.assert_allclose(runs[0][name], runs[1][name], rtol=0.0, atol=1e-14)

    def test_the_cycloid_of_cams(self):
        """s = h (t/T - sin(2 pi t/T)/(2 pi)): at rest, without acceleration at both ends."""
        rise = Expression("h*(time/T - sin(2*pi*time/T)/(2*pi))", {"h": 0.03, "T": 0.5})
        run = cc.simulate(
            self.driven(rise),
            duration=0.5,
            samples=51,
            outputs=[
                "rail.displacement",
                "rail.velocity",
                "rail.acceleration",
                "cam.force",
                "energy.balance",
            ],
        )
        turn = 2.0 * math.pi * run.t / 0.5
        np.testing.assert_allclose(run["rail.velocity"], 0.06 * (1.0 - np.cos(turn)), atol=1e-15)
        np.testing.assert_allclose(run["rail.acceleration"], 0.24 * math.pi * np.sin(turn), atol=1e-13)
        np.testing.assert_allclose(run["cam.force"], 2.0 * run["rail.acceleration"], atol=1e-13)
        assert np.max(np.abs(run["energy.balance"])) < 1e-10

    @pytest.mark.parametrize(
        "motion",
        [
            "0.1*block.x",
            "abs(time)",
            "h*time",
            Expression("h*time", {"h": math.inf}),
            Table([0, 1], [0, 1], interpolation="linear"),
            "sin(time",
        ],
        ids=repr,
    )
    def test_what_is_no_such_formula_is_refused(self, motion):
        (path,) = refused(self.driven(motion))
        assert path.startswith("drives[0].motion")


BAD = [
    *("800*ram.z", "if(rma.vx < 0, 1, 0)", "2*ram.ax", "2*pin.reaction_x", "2*cut.force", "ram.x", "k*ram.x"),
    *("ram.x + ram.vx", "exp(ram.x)", "sinn(time)", "3*(ram.x", "import os", "sqrt(ram.x - 1)", ""),
    "1/(ram.x - ram.x)",
]


class TestBadInput:
    @pytest.mark.parametrize("text", BAD)
    def test_a_bad_text_is_refused_at_its_path(self, text):
        (path,) = refused(press(cc.Force("cut", "ram.B", x=text, y=0.0)))
        assert path.startswith("forces")

    @pytest.mark.parametrize(
        ("constants", "place"),
        [
            ({"k": 1.0, "unused": 2.0}, ".constants.unused"),
            ({"k": math.nan}, ".constants.k"),
            ({"k": "a"}, ".constants.k"),
            ({}, ""),
            (3, ".constants"),
        ],
    )
    def test_bad_constants_are_refused_with_their_place(self, constants, place):
        force = cc.Force("cut", "ram.B", x=Expression("k*ram.x", constants), y=0.0)
        assert f"forces[0].x{place}" in refused(press(force))

    @pytest.mark.parametrize(
        "fields",
        [
            {"periodic": True, "values": [1, 2]},
            {"periodic": True, "beyond": "hold"},
            {"interpolation": "spline"},
            {"points": [1, 1]},
            {"over": "ram.q"},
            {"over": "ram.ax"},
            {"periodic": 1},
            {"points": [1, 2]},
        ],
    )
    def test_bad_tables_are_refused(self, fields):
        table = Table(**{"points": [0, 1], "values": [1, 1], "over": "ram.x"} | fields)
        (path,) = refused(press(cc.Force("cut", "ram.B", x=table, y=0.0)))
        assert path.startswith("forces")

    def test_a_prescribed_motion_cannot_depend_on_the_motion(self):
        table = Table([0, 1], [0, 1], over="ram.x")
        assert refused(press(CUT, drives=[cc.motions.Motion("motor", "main", table)]))

    def test_what_becomes_infinite_in_a_run_is_named_with_its_values(self):
        scene = block(cc.Force("f", "block.P", x="-0.1*log(block.x / 0.1)", y=0.0), x=0.1, v=-1.0)
        with pytest.raises(cc.errors.SimulationError) as caught:
            cc.simulate(scene, duration=5.0, samples=11)
        assert "log(block.x / 0.1)" in str(caught.value) and "block.x = " in str(caught.value)


DRAG = "-0.01*abs(rotor.angular_velocity)**{power}*sign(rotor.angular_velocity)"


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("power", [0.1, 0.5, 0.8])
@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
def test_drag_by_a_power_of_the_speed_stops_a_rotor_in_finite_time(method, power, rtol):
    # w' = -0.1 w^p: w^(1-p) falls at the rate 0.1 (1 - p) to zero, where the rotor rests.
    stop = 1.0 / (0.1 * (1.0 - power))
    scene = rotor(cc.Torque("drag", "rotor", DRAG.format(power=power)), speed=1.0)
    run = cc.simulate(scene, duration=2.0 * stop, samples=101, rtol=rtol, method=method)
    left = np.maximum(1.0 - run.t / stop, 0.0) ** (1.0 / (1.0 - power))
    np.testing.assert_allclose(run["rotor.angular_velocity"], left, atol=10.0 * rtol)
    # The form changes where it stops, not with every step of its rest.
    assert len(run.events) <= 5


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("torque", [1e-3, -1e-3])
def test_drag_by_a_root_lets_go_from_rest_and_limits_the_speed(method, torque):
    formula = f"{torque}*one + {DRAG.format(power=0.5)}"
    drag = cc.Torque("drag", "rotor", Expression(formula, {"one": 1.0}))
    run = cc.simulate(rotor(drag, speed=0.0, inertia=1e-3), duration=1.0, rtol=1e-6, method=method)
    # 0.01 sqrt(w) = 0.001
    assert run["rotor.angular_velocity"][-1] == pytest.approx(math.copysign(0.01, torque), abs=1e-7)


CROSSING = {
    "max(0, x)**1.5": lambda x: max(0.0, x) ** 1.5,
    "sqrt(abs(x - 0.3))": lambda x: math.sqrt(abs(x - 0.3)),
    "acos(max(-1, min(1, 1.5*x)))": lambda x: math.acos(max(-1.0, min(1.0, 1.5 * x))),
    "sqrt(1 - max(-1, min(1, 1.5*x))**2)": lambda x: math.sqrt(1 - max(-1.0, min(1.0, 1.5 * x)) ** 2),
    "if(x > 0.2, (x - 0.2)**0.5, 0)": lambda x: math.sqrt(max(0.0, x - 0.2)),
    "(x**2)**0.4*x": lambda x: abs(x) ** 0.8 * x,
    "sign(x)*abs(x)**0.3": lambda x: math.copysign(abs(x) ** 0.3, x),
    "hypot(x, 2*x) + atan2(x, 3*x)": lambda x: math.hypot(x, 2 * x) + math.atan2(x, 3 * x),
    "x*log(abs(x) + 1e-3)": lambda x: x * math.log(abs(x) + 1e-3),
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("formula", CROSSING)
def test_formulas_cross_the_ends_of_the_domains_of_their_functions(method, formula):
    of_angle = formula.replace("max", "MAX").replace("x", "rotor.angle").replace("MAX", "max")
    for speed in (1.0, 0.0):
        torque = cc.Torque("T", "rotor", f"0.1*({of_angle}) - 0.3*rotor.angle")
        run = cc.simulate(rotor(torque, speed=speed), duration=3.0, rtol=1e-6, method=method)

        def rates(_, y):
            return [y[1], CROSSING[formula](y[0]) - 3.0 * y[0]]

        truth = solve_ivp(rates, (0.0, 3.0), [0.0, speed], "DOP853", rtol=1e-9, atol=1e-11, max_step=1e-2)
        np.testing.assert_allclose(
            [run["rotor.angle"][-1], run["rotor.angular_velocity"][-1]], truth.y[:, -1], atol=5e-5
        )


ENDS = {"x**0.5": 0.0, "sqrt(x)": 0.0, "acos(1 - x)": 0.0, "log(x + 0.5)": -0.5, "x**(1 + x)": 0.0}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("formula", ENDS)
def test_a_run_ends_where_a_formula_leaves_the_domain_of_a_function(method, formula):
    torque = cc.Torque("T", "rotor", f"0.1*{formula.replace('x', 'rotor.angle')} - 10*rotor.angle")
    with pytest.raises(cc.errors.SimulationError) as failure:
        cc.simulate(rotor(torque, speed=-3.0, angle=0.5), duration=3.0, method=method)
    assert (failure.value.reason, failure.value.load) == ("outside_domain", "T")
    angle = re.search(r"rotor\.angle = ([-+.e\d]+)", str(failure.value))
    assert float(angle[1]) == pytest.approx(ENDS[formula], abs=1e-6)


@pytest.mark.parametrize("formula", ["sqrt(rotor.angle)", "rotor.angle**0.3", "acos(rotor.angle + 2.5)"])
def test_a_formula_without_a_value_at_the_start_is_refused(formula):
    with pytest.raises(cc.errors.SceneError, match="outside its domain"):
        cc.simulate(rotor(cc.Torque("T", "rotor", formula), angle=-1.0), duration=0.1)


def test_a_condition_that_is_written_twice_changes_once():
    x = "rotor.angle"
    torque = f"-0.1*{x}*abs({x}) + 0.01*max(0, {x}) - if(0 < {x}, 0.2, 0.1)*{x}"
    run = cc.simulate(rotor(cc.Torque("T", "rotor", torque), speed=1.0), duration=10.0)
    changes = np.count_nonzero(np.diff(np.sign(run["rotor.angle"][1:])))
    assert len(run.events) == changes > 1
