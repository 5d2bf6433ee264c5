"""Change points: configurations with all links in line, in which the closures of the loops are dependent.

A run passes over them with its momentum; where a drive pulls a loop apart, it ends.
"""

import math

import chebclear as cc
import numpy as np
import pytest
from scipy.integrate import solve_ivp

METHODS = ("auto", "adams", "dop853", "rodas4", "rodas5p")
GRAVITY = 9.81


def link(name, angle, length=1.0):
    points = {"P": (0.0, 0.0), "Q": (length, 0.0)}
    return cc.Body(
        name, 1.0, length**2 / 12.0, center_of_mass=(0.5 * length, 0.0), points=points, angle=angle
    )


def windows(count, tilt=0.0):
    """Benchmark A02 of the IFToMM library of multibody problems: windows of equal links in a row."""
    cosine, sine = math.cos(tilt), math.sin(tilt)
    bodies = [link(f"crank{i}", tilt + 0.5 * math.pi) for i in range(count + 1)]
    joints = [cc.Revolute(f"A{i}", f"ground.A{i}", f"crank{i}.P") for i in range(count + 1)]
    for i in range(1, count + 1):
        bodies.append(link(f"rod{i}", tilt))
        joints.append(cc.Revolute(f"L{i}", f"crank{i - 1}.Q", f"rod{i}.P"))
        joints.append(cc.Revolute(f"R{i}", f"rod{i}.Q", f"crank{i}.Q"))
    return cc.Scene(
        bodies,
        joints,
        [cc.Gravity((GRAVITY * sine, -GRAVITY * cosine))],
        ground={f"A{i}": (i * cosine, i * sine) for i in range(count + 1)},
        start=[cc.JointStart("A0", velocity=-1.0)],
    )


def angles_of_windows(count, t):
    """Angle of the cranks [rad], all parallel: one coordinate."""
    inertia, moment = (count + 1) / 3.0 + count, 0.5 * (count + 1) + count
    solution = solve_ivp(
        lambda _, y: [y[1], -GRAVITY * moment / inertia * math.cos(y[0])],
        (0.0, t[-1]),
        [0.5 * math.pi, -1.0],
        method="DOP853",
        t_eval=t,
        rtol=1e-12,
        atol=1e-12,
    )
    return solution.y[0]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("count", "rtol"), [(2, 1e-3), (2, 1e-6), (2, 1e-9), (5, 1e-7), (5, 1e-9), (10, 1e-8)]
)
def test_windows_pass_their_change_points(count, rtol, method):
    run = cc.simulate(
        windows(count),
        duration=20.0,
        samples=201,
        rtol=rtol,
        method=method,
        outputs=["crank0.angle", "energy.total", "energy.kinetic"],
        on_failure="return",
    )
    assert run.status == "done"
    drift = np.abs(run["energy.total"] - run["energy.total"][0]).max()
    assert drift < 10.0 * rtol * run["energy.kinetic"].max()
    # An error of the energy changes the period, so that of the angle grows.
    assert run["crank0.angle"] == pytest.approx(angles_of_windows(count, run.t), abs=5000.0 * rtol)


def test_published_end_of_two_windows():
    run = cc.simulate(
        windows(2), duration=10.0, samples=2, rtol=1e-9, method="dop853", outputs=["crank0.Q.x"]
    )
    assert run["crank0.Q.x"][-1] == pytest.approx(0.32845811, abs=1e-7)


def test_axes_do_not_matter():
    # In a tilted frame no row of the closures vanishes at the change point: their combination does.
    run = cc.simulate(windows(2, tilt=0.7), duration=10.0, samples=2, rtol=1e-9, method="dop853")
    assert run["crank0.angle"][-1] - 0.7 == pytest.approx(math.acos(0.32845811) + angles_turns(), abs=1e-6)


def angles_turns():
    """Full turns and side of the published end, by the equation of one coordinate."""
    angle = angles_of_windows(2, np.array([0.0, 10.0]))[-1]
    return angle - math.acos(math.cos(angle))


def test_forty_windows_by_default():
    run = cc.simulate(windows(40), duration=5.0, samples=51, outputs=["crank0.angle"], on_failure="return")
    assert run.status == "done"
    assert run["crank0.angle"] == pytest.approx(angles_of_windows(40, run.t), abs=1e-4)


def slider_crank(drive=None, start=(), angle=1.0):
    """Crank and rod of 1 m: with the crank upright the slider stands on its bearing."""
    return cc.Scene(
        [link("crank", angle), link("rod", -angle), cc.Body("slider", 1.0, 1e-3, points={"P": (0.0, 0.0)})],
        [
            cc.Revolute("O", "ground.O", "crank.P"),
            cc.Revolute("A", "crank.Q", "rod.P"),
            cc.Revolute("B", "rod.Q", "slider.P"),
            cc.Prismatic("guide", "ground.O", "slider.P", (1.0, 0.0)),
        ],
        drives=[] if drive is None else [drive],
        ground={"O": (0.0, 0.0)},
        start=start,
    )


def inertia_of_slider_crank(angle):
    """Twice the kinetic energy at 1 rad/s [kg m^2]: of crank, rod, and slider."""
    sine, cosine = np.sin(angle), np.cos(angle)
    return 1 / 3 + 1 / 12 + 2.25 * sine**2 + 0.25 * cosine**2 + 4.0 * sine**2


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-3, 1e-6, 1e-9])
def test_a_slider_crank_of_equal_links_turns(method, rtol):
    scene = slider_crank(start=[cc.JointStart("O", velocity=3.0)])
    run = cc.simulate(scene, duration=5.0, samples=51, rtol=rtol, method=method, outputs=["crank.angle"])
    energy = 0.5 * inertia_of_slider_crank(1.0) * 9.0
    exact = solve_ivp(
        lambda _, y: np.sqrt(2.0 * energy / inertia_of_slider_crank(y)),
        (0.0, 5.0),
        [1.0],
        t_eval=run.t,
        rtol=1e-12,
        atol=1e-12,
    )
    assert run["crank.angle"] == pytest.approx(exact.y[0], abs=200.0 * rtol)


@pytest.mark.parametrize("away", [0.0, 1e-9, -1e-6])
def test_forces_and_accelerations_at_a_change_point_are_not_known(away):
    speed = 2.0 * math.pi
    scene = slider_crank(cc.motions.Speed("motor", "O", speed, 0.3), angle=0.3)
    t = (0.5 * math.pi - 0.3) / speed + away
    outputs = ["motor.torque", "slider.x", "slider.vx", "slider.ax"]
    with pytest.warns(cc.ChebclearWarning):
        run = cc.simulate(scene, duration=2.0 * t, samples=3, outputs=outputs)
    assert run["slider.x"][1] == pytest.approx(-2.0 * speed * away, abs=1e-7)
    assert all(math.isnan(run[name][1]) for name in ("motor.torque", "slider.vx", "slider.ax"))
    assert np.isfinite(run["motor.torque"][[0, 2]]).all()


@pytest.mark.parametrize("away", [1e-3, -1e-3, 0.02])
def test_beside_a_change_point_they_are(away):
    speed = 2.0 * math.pi
    scene = slider_crank(cc.motions.Speed("motor", "O", speed, 0.3), angle=0.3)
    t = (0.5 * math.pi - 0.3) / speed + away
    run = cc.simulate(scene, duration=2.0 * t, samples=3, outputs=["motor.torque", "slider.vx"])
    angle = 0.3 + speed * t
    # By Lagrange's equation: half the derivative of the inertia times the square of the speed.
    torque = 6.0 * math.sin(angle) * math.cos(angle) * speed**2
    assert run["motor.torque"][1] == pytest.approx(torque, rel=1e-6)
    assert run["slider.vx"][1] == pytest.approx(-2.0 * speed * math.sin(angle), rel=1e-8)


@pytest.mark.parametrize("method", ["auto", "dop853", "rodas5p"])
@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_a_loop_that_is_pulled_apart_ends_the_run(rtol, method):
    # A crank of 1 m is driven away from D, to which three links of 0.6 m lead.
    tip, ground = np.array([math.cos(0.5), math.sin(0.5)]), np.array([1.2, 0.0])
    x, y = ground - tip
    along, bend = math.atan2(y, x), math.acos((math.hypot(x, y) - 0.6) / 1.2)
    scene = cc.Scene(
        [
            link("crank", 0.5),
            link("one", along + bend, 0.6),
            link("two", along, 0.6),
            link("three", along - bend + math.pi, 0.6),
        ],
        [
            cc.Revolute("A", "ground.A", "crank.P"),
            cc.Revolute("B", "crank.Q", "one.P"),
            cc.Revolute("C", "one.Q", "two.P"),
            cc.Revolute("E", "two.Q", "three.Q"),
            cc.Revolute("D", "ground.D", "three.P"),
        ],
        drives=[cc.motions.Speed("motor", "A", 1.0, 0.5)],
        ground={"A": (0.0, 0.0), "D": (1.2, 0.0)},
    )
    run = cc.simulate(scene, duration=3.0, samples=31, rtol=rtol, method=method, on_failure="return")
    assert run.status in ("projection", "step_underflow")
    # At 1 rad/s from 0.5 rad, until the tip of the crank is 1.8 m from D.
    end = math.acos((1.0 + 1.2**2 - 1.8**2) / 2.4) - 0.5
    assert run.end_time == pytest.approx(end, abs=1e-3)
    assert run.stats.steps < 20_000


@pytest.mark.parametrize("mass", [1e-9, 1e9])
def test_a_heavy_body_in_a_loop_is_no_change_point(mass):
    """The rod of a parallelogram is much heavier or lighter than its cranks: a pendulum of known length."""
    span = cc.Body(
        "rod", mass, mass / 12.0, center_of_mass=(0.5, 0.0), points={"P": (0.0, 0.0), "Q": (1.0, 0.0)}
    )
    scene = cc.Scene(
        [link("left", 0.3), span, link("right", 0.3)],
        [
            cc.Revolute("A", "ground.A", "left.P"),
            cc.Revolute("B", "left.Q", "rod.P"),
            cc.Revolute("C", "rod.Q", "right.Q"),
            cc.Revolute("D", "ground.D", "right.P"),
        ],
        [cc.Gravity((GRAVITY, 0.0))],
        ground={"A": (0.0, 0.0), "D": (1.0, 0.0)},
    )
    run = cc.simulate(scene, duration=0.05, samples=6, rtol=1e-8, outputs=["left.angle"])
    rate = GRAVITY * (1.0 + mass) / (2.0 / 3.0 + mass)
    exact = solve_ivp(
        lambda _, y: [y[1], -rate * math.sin(y[0])],
        (0.0, 0.05),
        [0.3, 0.0],
        t_eval=run.t,
        rtol=1e-12,
        atol=1e-12,
    )
    assert run["left.angle"] == pytest.approx(exact.y[0], abs=1e-7)
