"""Bushings: closed forms, momentum and energy."""

import math

import chebclear as cc
import numpy as np
import pytest
from momenta import momenta
from refusals import refused

METHODS = ["rodas5p", "rodas4", "dop853", "adams"]


@pytest.mark.parametrize("method", METHODS)
def test_a_body_on_a_bushing_oscillates_alike_in_all_directions(method):
    """m x'' = -k x - c x' in both directions, through the point where the force has no direction."""
    k, c, m = 200.0, 1.5, 2.0
    scene = cc.Scene(
        [cc.Body("block", m, 0.1)],
        [],
        [cc.Bushing("rubber", "ground", "block", k, c, torsional_stiffness=5.0, torsional_damping=0.02)],
        start=[cc.BodyStart("block", angle=0.3, angular_velocity=0.0)],
    )
    run = cc.simulate(
        cc.Scene(
            scene.bodies,
            scene.joints,
            [*scene.forces, cc.Force("push", "block", 10.0, -4.0)],
            start=scene.start,
        ),
        duration=2.0,
        samples=201,
        method=method,
        rtol=1e-9,
        outputs=["block.x", "block.y", "block.angle", "rubber.*", "energy.balance"],
    )
    decay, omega = c / (2.0 * m), math.sqrt(k / m - (c / (2.0 * m)) ** 2)
    step = 1.0 - np.exp(-decay * run.t) * (np.cos(omega * run.t) + decay / omega * np.sin(omega * run.t))
    np.testing.assert_allclose(run["block.x"], 10.0 / k * step, atol=1e-9)
    np.testing.assert_allclose(run["block.y"], -4.0 / k * step, atol=1e-9)
    decay, omega = 0.02 / 0.2, math.sqrt(50.0 - 0.01)
    turn = 0.3 * np.exp(-decay * run.t) * (np.cos(omega * run.t) + decay / omega * np.sin(omega * run.t))
    np.testing.assert_allclose(run["block.angle"], turn, atol=1e-7)
    np.testing.assert_allclose(run["rubber.deflection"], np.hypot(run["block.x"], run["block.y"]), atol=1e-15)
    np.testing.assert_allclose(run["rubber.torque"][0], -1.5, rtol=1e-12)
    assert np.max(np.abs(run["energy.balance"])) < 1e-8


FORMULAS = {
    "stiffness": "300 + 2000*rubber.deflection**2",
    "damping": "4 + 10*rubber.deflection",
    "torsional_stiffness": "0.5 + 0.1*rubber.angle**2",
    "torsional_damping": "0.01*(1 + abs(rubber.angle))",
}


@pytest.mark.parametrize(
    "rubber", [(300.0, 4.0, 0.5, 0.01), tuple(FORMULAS.values())], ids=["numbers", "formulas"]
)
@pytest.mark.parametrize("method", METHODS)
def test_two_free_bodies_keep_their_momenta(method, rubber):
    """A bushing with damping, off center on turning bodies, makes no moment of its own."""
    bodies = [
        cc.Body("a", 1.0, 0.02, points={"P": (0.1, 0.05)}),
        cc.Body("b", 0.5, 0.01, (0.02, 0.0), points={"P": (-0.1, 0.0)}),
    ]
    scene = cc.Scene(
        bodies,
        [],
        [cc.Bushing("rubber", "a.P", "b.P", *rubber)],
        start=[
            cc.BodyStart("a", angle=0.0, angular_velocity=8.0),
            cc.BodyStart("b", angle=0.2, angular_velocity=-15.0),
        ],
    )
    names = [f"{body}.{name}" for body in "ab" for name in ("x", "y", "vx", "vy", "angular_velocity")]
    run = cc.simulate(
        scene, duration=1.0, samples=101, method=method, rtol=1e-10, outputs=[*names, "energy.*"]
    )
    for conserved in momenta(run):
        np.testing.assert_allclose(conserved, conserved[0], atol=1e-9)
    assert np.max(np.abs(run["energy.balance"])) < 1e-7
    assert run["energy.damping_loss"][-1] > 0.1


@pytest.mark.parametrize("method", METHODS)
def test_a_stiffness_that_grows_with_the_deflection_makes_the_oscillator_of_duffing(method):
    """m v^2 / 2 + k x^2 / 2 + c x^4 / 4 is constant, and so is the sum of kinetic energy and input."""
    m, k, c, x0 = 2.0, 200.0, 5e4, 0.1
    text = cc.motions.Expression("k + c*rubber.deflection**2", {"k": k, "c": c})
    scene = cc.Scene(
        [cc.Body("block", m, 0.1)],
        [cc.Prismatic("rail", "ground", "block", (1.0, 0.0))],
        [cc.Bushing("rubber", "ground", "block", text)],
        start=[cc.JointStart("rail", position=x0)],
    )
    run = cc.simulate(
        scene,
        duration=1.0,
        samples=1001,
        method=method,
        rtol=1e-9,
        outputs=["block.*", "rubber.*", "energy.*"],
    )
    x, v = run["block.x"], run["block.vx"]
    whole = 0.5 * k * x0**2 + 0.25 * c * x0**4
    np.testing.assert_allclose(0.5 * m * v**2 + 0.5 * k * x**2 + 0.25 * c * x**4, whole, rtol=1e-6)
    np.testing.assert_allclose(run["energy.input"], 0.5 * m * v**2, atol=1e-6 * whole)
    np.testing.assert_allclose(run["rubber.force_x"], -k * x - c * x**3, rtol=1e-9, atol=1e-9)
    assert np.min(x) == pytest.approx(-x0, rel=1e-3)


@pytest.mark.parametrize(
    "bushing",
    [
        cc.Bushing("rubber", "ground.Q", "block", 1.0),
        cc.Bushing("rubber", "block.P", "block", 1.0),
        cc.Bushing("rubber", "ground", "block", -1.0),
        cc.Bushing("rubber", "ground", "block", 1.0, torsional_damping=-1.0),
        cc.Bushing("rail", "ground", "block", 1.0),
        cc.Bushing("rubber", "ground", "block", "100*rubber.deflecton**0"),
        cc.Bushing("rubber", "ground", "block", 1.0, "rubber.deflection"),
        cc.Bushing("rubber", "ground", "block", "rubber.force_x"),
    ],
    ids=repr,
)
def test_bad_bushings_are_refused(bushing):
    block = cc.Body("block", 1.0, 0.1, points={"P": (0.1, 0.0)})
    (path,) = refused(cc.Scene([block], [cc.Prismatic("rail", "ground", "block", (1.0, 0.0))], [bushing]))
    assert path.startswith("forces[0]")
