"""Forces by tables of many points, over which a run steps where it can: SciPy integrates their energy."""

import chebclear as cc
import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator, PPoly

METHODS = ["auto", "adams", "dop853", "rodas4", "rodas5p"]
# Largest error of the energy over rtol times its range [-]; 4 is the worst of 38 random tables by all methods
ALLOWED = 10.0


def curve(x, force, interpolation):
    if interpolation == "monotone":
        return PchipInterpolator(x, force)
    return PPoly(np.array([np.diff(force) / np.diff(x), force[:-1]]), x)


def let_go(x, force, interpolation, **options):
    """A block of 1 kg on a rail that a force by a table draws back from x = 1 m, and the error of its energy
    over the range of that."""
    table = cc.motions.Table(x, force, over="block.x", interpolation=interpolation)
    scene = cc.Scene(
        [cc.Body("block", 1.0, 1.0)],
        [cc.Prismatic("rail", "ground", "block", (1.0, 0.0))],
        [cc.Force("spring", "block", table, 0.0)],
        start=[cc.JointStart("rail", 1.0)],
    )
    run = cc.simulate(scene, duration=3.0, samples=301, outputs=["block.x", "block.vx"], **options)
    work = curve(x, force, interpolation).antiderivative()
    gained = work(run["block.x"]) - work(1.0)
    error = np.abs(0.5 * run["block.vx"] ** 2 - gained).max() / np.ptp(work(np.linspace(-1.0, 1.0, 201)))
    return run, error


FORCES = {
    "spring": lambda x: -20.0 * x,
    "hardening": lambda x: -20.0 * x**3 - 2.0 * x,
    "stop": lambda x: -20.0 * x * np.abs(x) ** 0.5 + np.where(x < -0.5, -300.0 * (x + 0.5), 0.0),
}


@pytest.mark.parametrize("interpolation", ["linear", "monotone"])
@pytest.mark.parametrize("name", FORCES)
@pytest.mark.parametrize("seed", range(3))
def test_energy_of_tables_with_close_points(name, interpolation, seed):
    rng = np.random.default_rng(seed)
    x = np.linspace(-1.3, 1.3, 361) if seed == 0 else np.sort([-1.3, *rng.uniform(-1.3, 1.3, 798), 1.3])
    force = FORCES[name](x) * (1.0 + 1e-6 * rng.standard_normal(len(x)))  # as measured
    for method in METHODS:
        for rtol in (1e-3, 1e-5):
            error = let_go(x, force, interpolation, method=method, rtol=rtol)[1]
            assert error < ALLOWED * rtol, (method, rtol)


def test_steps_follow_the_tolerance_not_the_points():
    x = np.linspace(-1.3, 1.3, 1301)
    force = FORCES["hardening"](x)
    steps = {rtol: let_go(x, force, "linear", rtol=rtol)[0].stats.steps for rtol in (1e-3, 1e-9)}
    # The block passes 1000 points in each half of its swing.
    assert steps[1e-3] < 300 and steps[1e-9] > 3000


def test_a_corner_between_two_points_ends_a_step_at_any_tolerance():
    """A stop whose corner is rounded by two points a fiftieth of the distance of others apart."""
    x = np.sort(np.concatenate([np.linspace(-1.3, 1.3, 27), [-0.501, -0.499]]))
    force = np.where(x < -0.5, -1e4 * (x + 0.5), 0.0) - 5.0
    error = let_go(x, np.where(x > 1.0, -5.0, force), "linear", rtol=1e-2, method="dop853")[1]
    assert error < ALLOWED * 1e-2


@pytest.mark.parametrize("interpolation", ["linear", "monotone"])
def test_points_nearer_than_the_tolerance_do_not_end_a_run(interpolation):
    """Of a continuous force, whose values at two such points differ, a run passes both at once."""
    x = np.sort(
        np.concatenate(
            [np.linspace(-1.3, 1.3, 14), np.linspace(-1.25, 1.25, 14) + 2e-6, [-0.33, -0.33 + 1e-9]]
        )
    )
    force = -20.0 * x + 3.0 * np.sin(40.0 * x)
    for method in METHODS:
        run, error = let_go(x, force, interpolation, rtol=1e-2, method=method)
        assert run.status == "done" and error < ALLOWED * 1e-2


@pytest.mark.parametrize("points", [8, 720])
def test_a_periodic_table_over_many_turns(points):
    """A torque by a table over the angle, smooth where it begins anew: the speed is that of its work."""
    angle = np.linspace(0.0, 2.0 * np.pi, points + 1)
    torque = 4.0 * np.cos(angle)
    torque[-1] = torque[0]
    load = cc.motions.Table(angle, torque, over="rotor.angle", periodic=True)
    scene = cc.Scene(
        [cc.Body("rotor", 1.0, 0.1, points={"P": (0.0, 0.0)})],
        [cc.Revolute("shaft", "ground.O", "rotor.P")],
        [cc.Torque("load", "rotor", load)],
        ground={"O": (0.0, 0.0)},
        start=[cc.JointStart("shaft", 0.0, 30.0)],
    )
    work = curve(angle, torque, "linear").antiderivative()
    names = ["rotor.angle", "rotor.angular_velocity"]
    for method in METHODS:
        run = cc.simulate(scene, duration=2.0, samples=301, outputs=names, method=method, rtol=1e-4)
        turned, speed = (run[name] for name in names)
        energy = 45.0 + work(turned % (2.0 * np.pi)) + work(2.0 * np.pi) * (turned // (2.0 * np.pi))
        assert np.abs(0.05 * speed**2 - energy).max() < ALLOWED * 1e-4 * 45.0
        # In nine turns 7000 points are passed.
        assert run.stats.steps < 500
