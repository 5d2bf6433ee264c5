"""Bodies without mass or moment of inertia: limits of small masses, closed forms, and what is refused."""

import dataclasses
import math

import chebclear as cc
import loops
import numpy as np
import pytest

METHODS = ["rodas5p", "rodas4", "dop853", "adams", "auto"]
GRAVITY = cc.Gravity((0.0, -9.81))
SLIDER = loops.slider_crank(
    [GRAVITY, cc.Force("load", "slider.T", 20.0, 0.0)], start=[cc.JointStart("bearing", velocity=9.0)]
)
FOUR_BAR = loops.four_bar(
    [GRAVITY, cc.Spring("spring", "ground.W", "rocker.Q", 60.0, 0.1)],
    start=[cc.JointStart("A", velocity=25.0)],
)


def of_mass(scene, mass, *names, inertia=None):
    """The scene with this mass of some bodies, and the inertia of a rod of 0.3 m if none is given."""
    numbers = {"mass": mass, "inertia": 7.5e-3 * mass if inertia is None else inertia}
    bodies = [dataclasses.replace(body, **(numbers if body.name in names else {})) for body in scene.bodies]
    return dataclasses.replace(scene, bodies=bodies)


def pin(name, bearing, journal):
    law = cc.laws.LankaraniNikravesh(1e9, 0.9)
    return cc.ClearanceRevolute(name, bearing, journal, journal_radius=0.01, clearance=1e-4, contact=law)


def loose(*names, mass=0.0, inertia=0.0):
    """The slider-crank with a light rod, some of whose pins are loose."""
    ends = {"pin": ("crank.Q", "rod.P"), "wrist": ("rod.Q", "slider.P")}
    joints = [pin(joint.name, *ends[joint.name]) if joint.name in names else joint for joint in SLIDER.joints]
    return of_mass(dataclasses.replace(SLIDER, joints=joints), mass, "rod", inertia=inertia)


def pendulum(mass, inertia, **body):
    bob = cc.Body("bob", mass, inertia, points={"P": (0.0, 1.5)}, **body)
    return cc.Scene([bob], [cc.Revolute("pivot", "ground", "bob.P")], [GRAVITY])


@pytest.mark.parametrize(("scene", "link"), [(SLIDER, "rod"), (FOUR_BAR, "coupler"), (FOUR_BAR, "rocker")])
def test_a_light_link_becomes_a_massless_one(scene, link):
    outputs = ["crank.angle", f"{scene.joints[1].name}.reaction_?"]
    runs = [
        cc.simulate(of_mass(scene, mass, link), duration=0.3, samples=31, rtol=1e-11, outputs=outputs)
        for mass in (0.0, 5e-4, 1e-3)
    ]
    for name in runs[0]:
        none, one, two = (run[name] for run in runs)
        change = np.abs(one - none).max()
        # But for a term in the square of the mass both give the massless motion.
        assert change > 1e-6 * np.abs(none).max()
        assert np.abs(2.0 * one - two - none).max() < 0.03 * change


@pytest.mark.parametrize("method", METHODS)
def test_a_massless_rod_pulls_along_itself_and_energy_is_kept(method):
    scene = of_mass(SLIDER, 0.0, "rod")
    run = cc.simulate(scene, duration=0.4, samples=81, rtol=1e-10, method=method, outputs=["*", "energy.*"])
    across = np.array([-np.sin(run["rod.angle"]), np.cos(run["rod.angle"])])
    first, second = (np.array([run[f"{end}.reaction_{axis}"] for axis in "xy"]) for end in ("pin", "wrist"))
    assert np.abs((first * across).sum(axis=0)).max() < 1e-10 * np.abs(first).max()
    assert np.abs(first - second).max() < 1e-10 * np.abs(first).max()
    assert np.abs(run["energy.balance"]).max() < 1e-9 * run["energy.kinetic"].max()


def test_a_point_mass_swings_as_a_simple_pendulum():
    mean, other = 1.0, math.cos(1.0)
    while mean - other > 1e-15:
        mean, other = 0.5 * (mean + other), math.sqrt(mean * other)
    period = 2.0 * math.pi * math.sqrt(1.5 / 9.81) / mean
    run = cc.simulate(pendulum(2.0, 0.0, angle=2.0), duration=period, samples=5, rtol=1e-11)
    np.testing.assert_allclose(run["bob.angle"], [2.0, 0.0, -2.0, 0.0, 2.0], atol=1e-8)


def test_wheels_without_mass_turn_and_an_idler_without_inertia_passes_the_torque_on():
    gears = [cc.Body("a", 0.0, 2e-3), cc.Body("idler", 0.0, 0.0), cc.Body("b", 0.0, 5e-3)]
    couplings = [
        cc.motions.Coupling("first", "idler.angle", "a.angle", -2.0),
        cc.motions.Coupling("second", "b.angle", "idler.angle", -0.25),
    ]
    joints = [cc.Revolute(f"pin of {gear.name}", "ground", gear.name) for gear in gears]
    scene = cc.Scene(gears, joints, [cc.Torque("motor", "a", torque=0.3)], couplings=couplings)
    run = cc.simulate(scene, duration=0.1, samples=3, outputs=["*.angular_acceleration", "second.*"])
    acceleration = 0.3 / (2e-3 + 5e-3 * 0.5**2)
    np.testing.assert_allclose(run["a.angular_acceleration"], acceleration, rtol=1e-12)
    np.testing.assert_allclose(run["second.torque"], 5e-3 * 0.5 * acceleration, rtol=1e-12)


def test_a_driven_linkage_without_any_mass_is_statics():
    drives = [cc.motions.Speed("drive", "bearing", 12.0, angle=0.7)]
    scene = loops.slider_crank([cc.Force("load", "slider.P", 20.0, 0.0)], drives)
    scene = of_mass(scene, 0.0, "crank", "rod", "slider")
    run = cc.simulate(scene, duration=0.5, samples=51, outputs=["*", "energy.*"])
    np.testing.assert_allclose(run["drive.torque"] * 12.0, -20.0 * run["slider.vx"], atol=1e-12)
    assert np.abs(run["energy.balance"]).max() < 1e-9


def test_a_mass_on_massless_links_has_its_frequency():
    scene = loops.slider_crank([cc.TorsionSpring("spring", "ground", "crank", 30.0, 0.7)])
    found = cc.modes(of_mass(scene, 0.0, "crank", "rod"))
    height = 0.1 * math.sin(0.7)
    lever = height * (1.0 + 0.1 * math.cos(0.7) / math.sqrt(0.35**2 - height**2))
    np.testing.assert_allclose(
        found.frequencies, [math.sqrt(30.0 / 0.8) / lever / (2.0 * math.pi)], rtol=1e-9
    )


GHOST = cc.Scene([cc.Body("ghost", 0.0, 0.0)], [pin("pin", "ground", "ghost")])
REFUSED = {
    "free": (GHOST, "bodies[0].mass", "ghost"),
    "two loose pins": (loose("pin", "wrist"), "bodies[1].mass", "rod"),
    "two loose pins, with inertia": (loose("pin", "wrist", inertia=1e-3), "bodies[1].mass", "rod"),
    "two loose pins, point mass": (loose("pin", "wrist", mass=0.1), "bodies[1].inertia", "rod"),
    "one loose pin": (loose("wrist"), "bodies[1].mass", "rod"),
    "pendulum": (pendulum(0.0, 0.0), "bodies[0].mass", "bob"),
    "dead center": (of_mass(loops.slider_crank(angle=0.0), 0.0, "crank", "rod"), "bodies[0].mass", "crank"),
    "negative mass": (pendulum(-1.0, 0.1), "bodies[0].mass", ""),
    "negative central inertia": (pendulum(1.0, 0.0, inertia_about="P"), "bodies[0].inertia", "P"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_motion_without_mass_is_refused_with_the_name_of_the_body(case):
    scene, path, name = REFUSED[case]
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.simulate(scene, duration=0.1, samples=3)
    found = {problem.path: problem.message for problem in caught.value.problems}
    assert name in found[path]


@pytest.mark.parametrize("method", METHODS)
def test_a_run_ends_where_no_mass_moves_any_more(method):
    scene = of_mass(SLIDER, 0.0, "crank", "rod")
    run = cc.simulate(scene, duration=3.0, samples=3, method=method, on_failure="return")
    assert run.status in ("singular_mechanism", "step_underflow")
    # A rod that turns has no mass at its loose end, but a moment of inertia.
    assert cc.simulate(loose("wrist", inertia=1e-3), duration=0.01, samples=3, method=method).status == "done"


def test_an_interval_of_a_mass_begins_at_zero_where_that_is_allowed():
    def scan(build):
        mass = {"mass": cc.Interval(0.0, 0.2)}
        return cc.Study(build, mass, outputs=["*.angle"], duration=0.1, samples=5).scan(3)

    assert scan(lambda mass=0.1: of_mass(SLIDER, mass, "rod"))["rod.angle"].lower.shape == (5,)
    with pytest.raises(cc.errors.SceneError):
        scan(lambda mass=0.1: pendulum(mass, mass))


def test_a_massless_body_is_plausible():
    boom = cc.Body("boom", 0.0, 0.0, points={"P": (0.0, 0.0), "Q": (90.0, 0.0)})
    drive = cc.motions.Speed("drive", "A", 1.0)
    assert not cc.Scene([boom], [cc.Revolute("A", "ground", "boom.P")], drives=[drive]).check().notices
