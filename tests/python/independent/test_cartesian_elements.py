"""The force elements of the independent formulation against closed forms."""

import math
from dataclasses import dataclass
from typing import Any

import cartesian
import chebclear as cc
import numpy as np
import pytest

# Elements with the fields that the independent formulation reads.


@dataclass
class Spring:
    a: str
    b: str
    stiffness: float
    length: float
    damping: float = 0.0


@dataclass
class Damper:
    a: str
    b: str
    damping: float


@dataclass
class TorsionSpring:
    a: str
    b: str
    stiffness: float
    angle: float
    damping: float = 0.0


@dataclass
class TorsionDamper:
    a: str
    b: str
    damping: float


@dataclass
class Force:
    point: str
    x: Any
    y: Any
    frame: str = "ground"


@dataclass
class Torque:
    body: str
    torque: Any
    reaction: str = "ground"


@dataclass
class Harmonic:
    amplitude: float
    angular_frequency: float
    phase: float = 0.0
    mean: float = 0.0


@dataclass
class Polynomial:
    coefficients: tuple[float, ...]


@dataclass
class Table:
    points: tuple[float, ...]
    values: tuple[float, ...]


@dataclass
class Motion:
    name: str
    joint: str
    motion: Any


def ringing(t, mass, damping, stiffness, start):
    """Displacement of a damped oscillator released from rest."""
    decay, natural = damping / (2.0 * mass), math.sqrt(stiffness / mass)
    frequency = math.sqrt(natural**2 - decay**2)
    return start * np.exp(-decay * t) * (np.cos(frequency * t) + decay / frequency * np.sin(frequency * t))


def rotor(angle=0.0):
    """A wheel on a pin at its center of mass."""
    return cc.Scene(
        [cc.Body("wheel", 2.0, 0.03, points={"rim": (0.2, 0.0)}, angle=angle)],
        [cc.Revolute("axle", "ground", "wheel")],
    )


def test_spring_and_damper_make_a_damped_oscillator():
    # The body slides on a rail through the spring's other end, both inclined: released 0.04 m too long.
    direction = np.array([0.8, -0.6])
    start = 0.3 * direction
    scene = cc.Scene(
        [cc.Body("mass", 1.5, 0.01, points={"P": (0.0, 0.0)})],
        [cc.Prismatic("rail", "ground.O", "mass.P", axis=tuple(direction))],
        ground={"O": (0.0, 0.0)},
    )
    forces = [Spring("ground.O", "mass.P", 200.0, 0.26), Damper("mass.P", "ground.O", 3.0)]
    run = cartesian.simulate(scene, 1.0, 51, rtol=1e-11, forces=forces, start=[*start, 0.0, 0.0, 0.0, 0.0])
    length = 0.26 + ringing(run.t, 1.5, 3.0, 200.0, 0.04)
    np.testing.assert_allclose(run["mass.x"], 0.8 * length, atol=1e-10)
    np.testing.assert_allclose(run["mass.y"], -0.6 * length, atol=1e-10)


def test_spring_between_two_bodies_keeps_momentum_and_rings_at_the_reduced_mass():
    scene = cc.Scene([cc.Body("a", 1.0, 0.1), cc.Body("b", 3.0, 0.1)], [])
    start = [0.0, 0.0, 0.0, 0.5, 0.0, 0.0, *np.zeros(6)]
    run = cartesian.simulate(scene, 0.5, 51, rtol=1e-11, forces=[Spring("a", "b", 90.0, 0.4)], start=start)
    apart = 0.4 + ringing(run.t, 0.75, 0.0, 90.0, 0.1)
    np.testing.assert_allclose(run["b.x"] - run["a.x"], apart, atol=1e-10)
    np.testing.assert_allclose(run["a.vx"] + 3.0 * run["b.vx"], 0.0, atol=1e-13)


def test_torsion_spring_and_damper_make_a_damped_oscillator():
    forces = [TorsionSpring("ground", "wheel", 5.0, 0.3), TorsionDamper("wheel", "ground", 0.1)]
    run = cartesian.simulate(rotor(0.8), 1.0, 51, rtol=1e-11, forces=forces)
    np.testing.assert_allclose(run["wheel.angle"], 0.3 + ringing(run.t, 0.03, 0.1, 5.0, 0.5), atol=1e-10)


def test_torque_constant_and_in_time():
    run = cartesian.simulate(rotor(), 1.0, 11, rtol=1e-11, forces=[Torque("wheel", 0.6)])
    np.testing.assert_allclose(run["wheel.angle"], 0.5 * 20.0 * run.t**2, atol=1e-11)
    wave = Torque("wheel", Harmonic(0.6, 7.0, phase=math.pi / 2.0))
    run = cartesian.simulate(rotor(), 1.0, 11, rtol=1e-11, forces=[wave])
    np.testing.assert_allclose(run["wheel.angular_velocity"], 20.0 / 7.0 * np.sin(7.0 * run.t), atol=1e-10)


def test_force_in_the_frame_of_the_body_is_a_torque():
    push = Force("wheel.rim", 50.0, 3.0, frame="body")
    run = cartesian.simulate(rotor(), 1.0, 11, rtol=1e-11, forces=[push])
    np.testing.assert_allclose(run["wheel.angle"], 0.5 * 20.0 * run.t**2, atol=1e-11)


def test_force_in_the_frame_of_ground_is_gravity():
    pendulum = [cc.Body("bob", 0.7, 0.02, (0.3, -0.1), points={"end": (0.5, 0.0)}, angle=0.4)]
    pin = [cc.Revolute("pin", "ground", "bob.end")]
    falling = cc.Scene(pendulum, pin, [cc.Gravity((1.0, -9.81))])
    weight = Force("bob.center_of_mass", 0.7, Polynomial((-0.7 * 9.81,)))
    run = cartesian.simulate(falling, 1.0, 21, rtol=1e-11)
    pushed = cartesian.simulate(cc.Scene(pendulum, pin), 1.0, 21, rtol=1e-11, forces=[weight])
    np.testing.assert_allclose(pushed["bob.angle"], run["bob.angle"], atol=1e-10)
    assert np.ptp(run["bob.angle"]) > 1.0


@pytest.mark.parametrize(
    ("function", "value"),
    [
        (Polynomial((0.1, -0.3, 0.0, 0.5)), lambda t: 0.1 - 0.3 * t + 0.5 * t**3),
        (Harmonic(0.2, 3.0, 0.5, -0.1), lambda t: -0.1 + 0.2 * np.sin(3.0 * t + 0.5)),
        # A cubic spline without kinks at its second and last but one point is exact for a cubic.
        (Table((0.0, 0.3, 0.5, 1.0), (0.0, 0.027, 0.125, 1.0)), lambda t: t**3),
    ],
)
@pytest.mark.parametrize("kind", ["revolute", "prismatic"])
def test_prescribed_motion_follows_the_function(function, value, kind):
    """A driven joint on a turning platform; the drive's multiplier does the work of the kinetic energy."""
    inclined, speed = (0.6, 0.8), 2.0
    joint = (
        cc.Revolute("joint", "platform", "load")
        if kind == "revolute"
        else cc.Prismatic("joint", "platform", "load", axis=(1.2, 1.6))
    )
    platform = cc.Body("platform", 1.0, 0.1)
    scene = cc.Scene(
        [platform, cc.Body("load", 0.5, 0.02)],
        [cc.Revolute("axle", "ground", "platform"), joint],
        drives=[cc.motions.Speed("turn", "axle", speed)],
    )
    model = cartesian.Model(scene)
    model.constraints.append(Motion("push", "joint", function))
    run = cartesian.simulate(model, 1.0, 21, rtol=1e-11)
    moved, turn = value(run.t), speed * run.t
    if kind == "revolute":
        np.testing.assert_allclose(run["load.angle"] - turn, moved, atol=1e-9)
        np.testing.assert_allclose(run["push.torque"], 0.02 * run["load.angular_acceleration"], atol=1e-9)
        return
    direction = inclined[0] + 1j * inclined[1]
    np.testing.assert_allclose(
        run["load.x"] + 1j * run["load.y"], moved * direction * np.exp(1j * turn), atol=1e-9
    )
    assert "push.torque" not in run.columns
    along = (run["load.ax"] + 1j * run["load.ay"]) * np.exp(-1j * turn) / direction
    np.testing.assert_allclose(run["push.force"], 0.5 * along.real, atol=1e-9)


def test_multipliers_are_the_reactions_of_a_resting_body():
    """A beam at rest on a weld: the reaction of ground carries weight and moment."""
    beam = cc.Body("beam", 2.0, 0.1, (0.25, 0.0), points={"root": (0.0, 0.0)})
    scene = cc.Scene([beam], [cc.Fixed("weld", "ground", "beam.root")], [cc.Gravity((0.0, -10.0))])
    run = cartesian.simulate(scene, 0.1, 3, rtol=1e-11)
    # M a + φ_qᵀ λ = Q: the constraint puts -λ on the beam.
    np.testing.assert_allclose(-run.multipliers[-1], [0.0, 20.0, 5.0], atol=1e-12)
    reaction = [run[f"weld.reaction_{part}"][-1] for part in ("x", "y", "torque")]
    np.testing.assert_allclose(reaction, [0.0, 20.0, 5.0], atol=1e-12)


def test_latched_law_without_an_explicit_floor_is_refused():
    with pytest.raises(ValueError, match="joint wrist: give the floor"):
        cartesian.Model(cc.mechanisms.slider_crank())
