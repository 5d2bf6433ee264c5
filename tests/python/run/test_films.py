"""Journals in oil films: closed forms of steady and squeezed films, dissipation, studies, bad input."""

import dataclasses
import math

import chebclear as cc
import numpy as np
import pytest
from refusals import refuses

RADIUS, LENGTH, CLEARANCE, VISCOSITY, ROUGHNESS = 0.02, 0.01, 4e-5, 0.02, 1e-7
THICKNESS = CLEARANCE + ROUGHNESS
RESISTANCE = VISCOSITY * RADIUS * (LENGTH / THICKNESS) ** 3
FILM = cc.laws.ShortBearing(VISCOSITY, LENGTH, ROUGHNESS)


def rotor(load, mass, *, ratio, spin=0.0, film=FILM):
    """A rotor under a load downwards, which starts below the center; its inertia keeps its speed."""
    joint = cc.ClearanceRevolute(
        "bearing", "ground.O", "rotor.O", RADIUS, CLEARANCE, cc.laws.Hertz(1e10), film=film
    )
    return cc.Scene(
        [cc.Body("rotor", mass, 1e4, points={"O": (0.0, 0.0)})],
        [joint],
        ground={"O": (0.0, 0.0)},
        forces=[cc.Force("load", "rotor.O", 0.0, -load)],
        start=[
            cc.ClearanceStart("bearing", (0.0, -ratio * THICKNESS)),
            cc.BodyStart("rotor", angular_velocity=spin),
        ],
    )


def ocvirk(ratio, spin):
    """Load of the steady short bearing with a half film [N]."""
    square = 1.0 - ratio**2
    root = math.sqrt(math.pi**2 * square + 16.0 * ratio**2)
    return 0.25 * RESISTANCE * THICKNESS * spin * ratio * root / square**2


@pytest.mark.parametrize("method", ["auto", "rodas5p", "dop853"])
def test_a_loaded_rotor_settles_on_ocvirks_locus(method):
    ratio, spin = 0.8, 100.0  # above 0.756 it is stable whatever its mass
    load = ocvirk(ratio, spin)
    scene = rotor(load, load / 9.81, ratio=0.5, spin=spin)
    outputs = ["bearing.eccentricity_x", "bearing.eccentricity_y", "bearing.film_force_y"]
    run = cc.simulate(scene, duration=1.0, samples=11, rtol=1e-6, method=method, outputs=outputs)
    x, y, force = (run[name][-1] for name in outputs)
    assert math.hypot(x, y) / THICKNESS == pytest.approx(ratio, rel=1e-5)
    assert x / -y == pytest.approx(0.25 * math.pi * math.sqrt(1.0 - ratio**2) / ratio, rel=1e-4)
    assert force == pytest.approx(load, rel=1e-3)
    if method == "auto":
        assert run.stats.steps < 500


def test_a_squeezed_film_takes_the_time_of_its_integral():
    # Without inertia: load = resistance I(ratio) d(ratio)/dt, with I over the half before the journal.
    load, mass, begin, end = 50.0, 1e-6, 0.2, 0.9
    angles = (np.arange(2000) + 0.5) * math.pi / 2000 - 0.5 * math.pi

    def integral(ratio):
        return np.mean(np.cos(angles) ** 2 / (1.0 - ratio * np.cos(angles)) ** 3) * math.pi

    nodes, weights = np.polynomial.legendre.leggauss(40)
    ratios = begin + 0.5 * (end - begin) * (nodes + 1.0)
    values = [integral(ratio) for ratio in ratios]
    time = RESISTANCE * THICKNESS / load * 0.5 * (end - begin) * np.dot(weights, values)
    run = cc.simulate(
        rotor(load, mass, ratio=begin),
        duration=float(time),
        samples=3,
        rtol=1e-8,
        outputs=["bearing.film_thickness"],
    )
    assert run["bearing.film_thickness"][-1] == pytest.approx(CLEARANCE - end * THICKNESS, rel=1e-5)


@pytest.mark.parametrize("method", ["auto", "rodas5p", "rodas4"])
def test_a_stiff_film_hands_on_the_torque_of_a_joint_without_clearance(method):
    """A micrometer of oil hardly gives: the drive works as that of the ideal mechanism, inside steps too."""
    film = cc.laws.ShortBearing(4e-3, 0.01, 5e-8)
    scene = cc.mechanisms.slider_crank(clearance=5e-7, crank_speed=cc.rpm(300.0))
    (wrist,) = (joint for joint in scene.joints if isinstance(joint, cc.ClearanceRevolute))
    oiled, ideal = (
        dataclasses.replace(scene, joints=[joint if other is wrist else other for other in scene.joints])
        for joint in (
            dataclasses.replace(wrist, film=film),
            cc.Revolute(wrist.name, wrist.bearing, wrist.journal),
        )
    )
    outputs = ["drive.torque", "energy.balance", "energy.input"]
    run = cc.simulate(oiled, duration=0.01, samples=101, rtol=1e-4, method=method, outputs=outputs)
    torque = cc.simulate(ideal, duration=0.01, samples=101, outputs=outputs)["drive.torque"]
    # The journal starts in the middle of its bearing, and oil brakes it by a hundredth of the torque.
    np.testing.assert_allclose(
        run["drive.torque"][1:], torque[1:], rtol=0.0, atol=0.05 * np.max(np.abs(torque))
    )
    assert np.max(np.abs(run["energy.balance"])) < 0.01 * np.ptp(run["energy.input"])


def test_a_light_load_whirls():
    # Below 0.756 a rotor is unstable above a speed: sqrt(mass c / load) times it is 2.758 at a ratio of 0.05.
    ratio, spin = 0.05, 100.0
    load = ocvirk(ratio, spin)
    attitude = math.atan2(0.25 * math.pi * math.sqrt(1.0 - ratio**2), ratio)
    for threshold, grows in ((2.5, False), (3.0, True)):
        mass = load / THICKNESS * (threshold / spin) ** 2
        scene = rotor(load, mass, ratio=ratio, spin=spin)
        place = (
            1.02 * ratio * THICKNESS * math.sin(attitude),
            -1.02 * ratio * THICKNESS * math.cos(attitude),
        )
        scene = dataclasses.replace(scene, start=[cc.ClearanceStart("bearing", place), scene.start[1]])
        steady = ratio * THICKNESS * np.array([math.sin(attitude), -math.cos(attitude)])
        outputs = ["bearing.eccentricity_x", "bearing.eccentricity_y"]
        run = cc.simulate(scene, duration=8.0, samples=801, rtol=1e-8, outputs=outputs)
        off = np.hypot(*(run[name] - value for name, value in zip(outputs, steady, strict=True)))
        assert (off[-100:].max() > off[100:200].max()) == grows


@pytest.mark.parametrize("film", [FILM, cc.laws.FiniteBearing(0.05, 0.02, 1e-6)])
def test_the_energy_balance_closes(film):
    scene = cc.mechanisms.slider_crank()
    joints = [
        dataclasses.replace(joint, film=dataclasses.replace(film, length=joint.journal_radius))
        if isinstance(joint, cc.ClearanceRevolute)
        else joint
        for joint in scene.joints
    ]
    oiled = dataclasses.replace(scene, joints=joints)
    outputs = ["energy.*", "wrist.film_loss", "slider.vx"]
    runs = [
        cc.simulate(oiled, duration=0.06, samples=301, rtol=1e-8, method=method, outputs=outputs)
        for method in ("auto", "rodas5p")
    ]
    for run in runs:
        assert run["wrist.film_loss"].min() >= 0.0
        assert run["energy.damping_loss"][-1] > 0.0
        assert np.abs(run["energy.balance"]).max() < 1e-6 * run["energy.kinetic"].max()
    difference = np.abs(runs[0]["slider.vx"] - runs[1]["slider.vx"]).max()
    assert difference < 1e-4 * np.ptp(runs[0]["slider.vx"])


@pytest.mark.parametrize(
    ("film", "field"),
    [
        (cc.laws.ShortBearing(-1.0, LENGTH, ROUGHNESS), "viscosity"),
        (cc.laws.ShortBearing(VISCOSITY, LENGTH, 0.0), "roughness"),
        (cc.laws.ShortBearing(VISCOSITY, 0.041, ROUGHNESS), "length"),
        (cc.laws.FiniteBearing(VISCOSITY, 0.009, ROUGHNESS), "length"),
    ],
)
def test_films_that_cannot_be_are_refused_by_field(film, field):
    with refuses(f"joints[0].film.{field}"):
        rotor(1.0, 1.0, ratio=0.1, film=film).check()
