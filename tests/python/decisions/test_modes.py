"""Natural frequencies: closed forms of masses, pendulums and contacts, periods of simulated motions."""

import chebclear as cc
import numpy as np
import pytest
from refusals import refuses

G = 9.81


def masses(damping=0.0):
    """Two masses on a rail, a spring to ground and one between."""
    bodies = [cc.Body(name, mass, 1.0) for name, mass in (("one", 2.0), ("two", 3.0))]
    joints = [cc.Prismatic(f"rail {body.name}", "ground", body.name, (1.0, 0.0)) for body in bodies]
    springs = [
        cc.Spring("left", "ground.wall", "one", 200.0, 1.0, damping),
        cc.Spring("middle", "one", "two", 300.0, 0.5),
    ]
    start = [cc.JointStart("rail one", position=0.0), cc.JointStart("rail two", position=0.5)]
    return cc.Scene(bodies, joints, springs, ground={"wall": (-1.0, 0.0)}, start=start)


def test_two_masses_have_the_frequencies_and_shapes_of_the_matrix():
    found = cc.modes(masses())
    stiffness, mass = np.array([[500.0, -300.0], [-300.0, 300.0]]), np.diag([2.0, 3.0])
    squares, vectors = np.linalg.eig(np.linalg.solve(mass, stiffness))
    order = np.argsort(squares)
    np.testing.assert_allclose(found.frequencies, np.sqrt(squares[order]) / (2 * np.pi), rtol=1e-12)
    np.testing.assert_allclose(found.damping, 0.0, atol=1e-12)
    assert found.at_rest and len(found) == 2 and not len(found.decays)
    for shape, column in zip(found.shapes, order, strict=True):
        ratio = (shape[1, 0] / shape[0, 0]).real
        assert ratio == pytest.approx(vectors[1, column] / vectors[0, column], rel=1e-10)
        assert np.abs(shape[:, 1:]).max() == 0.0
    assert "2 modes" in str(found) and "moves most" in found._repr_html_()


def test_a_damper_gives_the_damping_ratio_of_the_characteristic_polynomial():
    found = cc.modes(masses(damping=4.0))
    matrix = np.array(
        [[0, 0, 1, 0], [0, 0, 0, 1], [-250.0, 150.0, -2.0, 0.0], [100.0, -100.0, 0.0, 0.0]], dtype=float
    )
    roots = [root for root in np.linalg.eigvals(matrix) if root.imag > 0]
    roots.sort(key=abs)
    np.testing.assert_allclose(found.frequencies, np.abs(roots) / (2 * np.pi), rtol=1e-10)
    np.testing.assert_allclose(found.damping, [-root.real / abs(root) for root in roots], rtol=1e-9)


def pendulum(angle):
    bob = cc.Body("bob", 1.5, 0.02, (0.0, -0.4), points={"pivot": (0.0, 0.0)}, angle=angle)
    pin = cc.Revolute("pin", "ground", "bob.pivot")
    start = [cc.JointStart("pin", position=angle)]
    return cc.Scene([bob], [pin], [cc.Gravity((0.0, -G))], start=start)


def test_a_pendulum_hangs_stably_and_stands_unstably():
    rate = np.sqrt(1.5 * G * 0.4 / (0.02 + 1.5 * 0.4**2))
    hanging = cc.modes(pendulum(0.0))
    assert hanging.frequencies[0] == pytest.approx(rate / (2 * np.pi), rel=1e-12)
    standing = cc.modes(pendulum(np.pi))
    assert len(standing) == 0
    np.testing.assert_allclose(standing.decays, [-rate, rate], rtol=1e-6)
    assert "unstable: 1 motion " in str(standing)
    with pytest.warns(cc.ChebclearWarning):
        assert not cc.modes(pendulum(0.8)).at_rest


def test_a_pendulum_in_a_bearing_is_a_double_pendulum_on_a_spring():
    """The journal slides as on a link of the clearance; across it Hertz's contact is the spring."""
    mass, inertia, arm, clearance, stiffness = 1.5, 0.02, 0.4, 1e-3, 1e9
    depth = (mass * G / stiffness) ** (2.0 / 3.0)
    bob = cc.Body("bob", mass, inertia, (0.0, -arm), points={"pin": (0.0, 0.0)})
    joint = cc.ClearanceRevolute("pin", "ground", "bob.pin", 0.01, clearance, cc.laws.Hertz(stiffness))
    start = [cc.ClearanceStart("pin", (0.0, -(clearance + depth)))]
    scene = cc.Scene([bob], [joint], [cc.Gravity((0.0, -G))], start=start)
    run = cc.simulate(scene, duration=1e-7, samples=2)
    assert run["pin.contact"][0] == 1.0
    found = cc.modes(scene, run.end)
    link = clearance + depth
    inertias = mass * np.array([[link**2, link * arm], [link * arm, arm**2 + inertia / mass]])
    gravity = mass * G * np.diag([link, arm])
    expected = list(np.sqrt(np.linalg.eigvals(np.linalg.solve(inertias, gravity))))
    expected.append(np.sqrt(1.5 * stiffness * np.sqrt(depth) / mass))
    np.testing.assert_allclose(found.frequencies, np.sort(expected) / (2 * np.pi), rtol=1e-6)
    # In free flight nothing pulls the journal back.
    free = cc.Scene([bob], [joint], [cc.Gravity((0.0, -G))])
    with pytest.warns(cc.ChebclearWarning):
        assert len(cc.modes(free)) == 0


def test_a_closed_loop_oscillates_with_the_period_of_its_simulation():
    ground = {"A": (0.0, 0.0), "D": (0.3, 0.0)}
    links = [
        cc.Body("crank", 0.4, 4e-4, (0.05, 0.0), points={"A": (0.0, 0.0), "B": (0.1, 0.0)}, angle=-1.3),
        cc.Body("coupler", 0.9, 8e-3, (0.15, 0.0), points={"B": (0.0, 0.0), "C": (0.3, 0.0)}, angle=-0.1),
        cc.Body("rocker", 0.5, 1e-3, (0.06, 0.0), points={"D": (0.0, 0.0), "C": (0.12, 0.0)}, angle=-1.3),
    ]
    joints = [
        cc.Revolute("a", "ground.A", "crank.A"),
        cc.Revolute("b", "crank.B", "coupler.B"),
        cc.Revolute("c", "coupler.C", "rocker.C"),
        cc.Revolute("d", "ground.D", "rocker.D"),
    ]
    damper = [cc.TorsionDamper("drag", "ground", "crank", 0.05), cc.Gravity((0.0, -G))]
    rest = cc.simulate(
        cc.Scene(links, joints, damper, ground=ground), duration=60.0, samples=2, outputs=["crank.angle"]
    )
    lowest = float(rest["crank.angle"][-1])
    swing = cc.Scene(links, joints, damper[1:], ground=ground, start=[cc.BodyStart("crank", angle=lowest)])
    found = cc.modes(swing)
    assert found.at_rest and len(found) == 1
    start = [cc.BodyStart("crank", angle=lowest + 1e-4)]
    run = cc.simulate(
        cc.Scene(links, joints, damper[1:], ground=ground, start=start),
        duration=5.0,
        samples=5001,
        rtol=1e-9,
        outputs=["crank.angle"],
    )
    away = run["crank.angle"] - lowest
    falls = np.flatnonzero((away[:-1] > 0) & (away[1:] <= 0))
    places = run.t[falls] + away[falls] / (away[falls] - away[falls + 1]) * (run.t[1] - run.t[0])
    period = np.diff(places).mean()
    assert found.frequencies[0] == pytest.approx(1.0 / period, rel=1e-5)
    # The shape moves the bodies as the loop lets them: the pin at C has one velocity.
    shape = {name: shape for name, shape in zip(found.bodies, found.shapes[0].real, strict=True)}
    pose = {name: pose for name, pose in zip(found.bodies, found.poses, strict=True)}

    def velocity(name, length):
        x, y, turn = shape[name]
        angle = pose[name][2]
        return np.array([x - turn * length * np.sin(angle), y + turn * length * np.cos(angle)])

    np.testing.assert_allclose(velocity("coupler", 0.3), velocity("rocker", 0.12), atol=1e-9)
    assert found.plot().get_xlabel() == "x [m]"


def test_an_animation_goes_through_a_period_of_the_mode(tmp_path):
    found = cc.modes(masses())
    moving = found.animate(2, size=0.2, frames=8)
    film = moving.film()
    (panel,), (chart,) = film.panels, film.charts
    factors = {"s": 1.0, "ms": 1e3, "m": 1.0, "mm": 1e3}
    phases = np.arange(8) / 8
    unit = film.label.removeprefix("time [").removesuffix("]")
    np.testing.assert_allclose(film.at, factors[unit] * phases / found.frequencies[1], rtol=1e-12)
    name, axis = chart.name.split(".")
    body = found.bodies.index(name)
    assert axis == "x" and abs(found.shapes[1, body, 0]) == np.abs(found.shapes[1, :, 0]).max()
    wave = 0.2 * found.shapes[1, :, 0].real * np.cos(2 * np.pi * phases)[:, None]
    values = factors[chart.unit] * (found.poses[body, 0] + wave[:, body])
    np.testing.assert_allclose(chart.nominal, values, atol=1e-9)
    moves = {shape.name: shape.moves for shape in panel.shapes}
    shifts = np.stack([panel.transforms[moves[one]][:, 4] for one in found.bodies], axis=1)
    np.testing.assert_allclose(shifts, wave - wave[0], atol=1e-12)
    assert moving.save(tmp_path / "mode.html").stat().st_size > 0


def test_bad_input():
    with pytest.raises(cc.errors.ArgumentTypeError):
        cc.modes("scene")
    with pytest.raises(cc.errors.ArgumentTypeError):
        cc.modes(masses(), "end")
    with pytest.raises(cc.errors.StartError):
        cc.modes(masses(), cc.simulate(pendulum(0.1), duration=0.01, samples=2).end)
    driven = cc.mechanisms.four_bar(clearance_at=())
    with pytest.raises(cc.errors.ArgumentError):
        cc.modes(driven)
    for draw in (cc.modes(masses()).plot, cc.modes(masses()).animate):
        with refuses("mode", "size", error=ValueError):
            draw(3, size=-1.0)
    with refuses("frames", "rate", error=ValueError):
        cc.modes(masses()).animate(frames=1, rate=0)
    with pytest.raises(cc.errors.ArgumentError):
        cc.modes(pendulum(np.pi)).animate()
