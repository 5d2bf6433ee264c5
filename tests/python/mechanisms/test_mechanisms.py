"""The ready-made mechanisms against closed forms, with every choice of clearances, and in studies."""

import dataclasses
import inspect
import itertools
import math

import chebclear as cc
import numpy as np
import pytest
from chebclear.mechanisms.joints import Pins
from notices import codes
from refusals import refuses

mechanisms = cc.mechanisms

# Pins that may have clearance, by function.
PINS = {
    "slider_crank": ("crank_pin", "wrist"),
    "flores_slider_crank": ("crank_pin", "wrist"),
    "four_bar": ("crank_pin", "rocker_pin", "rocker_bearing"),
    "quick_return": ("crank_pin", "lever_bearing", "lever_pin", "ram_pin"),
    "six_bar": ("crank_pin", "rocker_pin", "rocker_bearing", "coupler_pin", "output_pin", "output_bearing"),
    "pendulum_in_bearing": ("pivot",),
}
SUBSETS = [
    (name, subset)
    for name, pins in PINS.items()
    for size in range(len(pins) + 1)
    for subset in itertools.combinations(pins, size)
]


def ideal(name, duration, samples, **arguments):
    """Run without any clearance; a crank at constant speed then needs no integration."""
    scene = getattr(mechanisms, name)(clearance_at=(), **arguments)
    return cc.simulate(scene, duration=duration, samples=samples)


def same_angle(measured, expected):
    """Largest difference of angles, whatever the number of turns."""
    return np.abs(np.angle(np.exp(1j * (measured - expected)))).max()


def circles(a, radius_a, b, radius_b, side):
    """Intersection of two circles as complex numbers, left (+1) or right (-1) of the way from a to b."""
    way = b - a
    cosine = (radius_a**2 + abs(way) ** 2 - radius_b**2) / (2 * radius_a * abs(way))
    return a + radius_a * way / abs(way) * (cosine + 1j * side * np.sqrt(1 - cosine**2))


class TestClosedForms:
    def test_slider_crank(self):
        speed, crank, rod, start = 150.0, 0.07, 0.15, 0.4
        run = ideal(
            "slider_crank",
            0.05,
            201,
            crank_length=crank,
            rod_length=rod,
            crank_speed=speed,
            crank_angle=start,
        )
        assert run.stats.evaluations == 0
        sine, cosine = np.sin(start + speed * run.t), np.cos(start + speed * run.t)
        root = np.sqrt(rod**2 - (crank * sine) ** 2)
        position = crank * cosine + root
        velocity = -crank * speed * sine * (1 + crank * cosine / root)
        acceleration = -crank * speed**2 * cosine - (crank * speed) ** 2 * (
            (cosine**2 - sine**2) / root + (crank * sine * cosine) ** 2 / root**3
        )
        assert abs(run["slider.x"] - position).max() < 1e-13
        assert abs(run["slider.vx"] - velocity).max() < 1e-9 * crank * speed
        assert abs(run["slider.ax"] - acceleration).max() < 1e-9 * crank * speed**2
        assert same_angle(run["rod.angle"], np.arcsin(-crank / rod * sine)) < 1e-12

    @pytest.mark.parametrize("branch", ["open", "crossed"])
    def test_four_bar_by_freudenstein(self, branch):
        speed, start = 100.0, 0.3
        base, crank, coupler, rocker = 0.12, 0.05, 0.10, 0.08
        run = ideal("four_bar", 0.07, 301, branch=branch, crank_speed=speed, crank_angle=start)
        theta = start + speed * run.t
        # K1 cos(phi) - K2 cos(theta) + K3 = cos(theta - phi), a quadratic in tan(phi / 2).
        k1, k2 = base / crank, base / rocker
        k3 = (crank**2 - coupler**2 + rocker**2 + base**2) / (2 * crank * rocker)
        a = np.cos(theta) - k1 - k2 * np.cos(theta) + k3
        b, c = -2 * np.sin(theta), k1 - (k2 + 1) * np.cos(theta) + k3
        side = -1 if branch == "open" else 1
        phi = 2 * np.arctan2(-b + side * np.sqrt(b**2 - 4 * a * c), 2 * a)
        assert same_angle(run["rocker.angle"], phi) < 1e-12
        # Its derivative with respect to time.
        rate = speed * (np.sin(theta - phi) + k2 * np.sin(theta)) / (np.sin(theta - phi) + k1 * np.sin(phi))
        assert abs(run["rocker.angular_velocity"] - rate).max() < 1e-9 * speed

    @pytest.mark.parametrize("branch", ["open", "crossed"])
    @pytest.mark.parametrize("output_branch", ["open", "crossed"])
    def test_six_bar_by_two_circle_intersections(self, branch, output_branch):
        speed = 100.0
        arguments = {"branch": branch, "output_branch": output_branch, "crank_speed": speed}
        if branch == "crossed":  # the coupler's point lies elsewhere, and so must the output
            arguments |= {"output_pivot_x": 0.20, "output_pivot_y": -0.02, "link_length": 0.16}
        run = ideal("six_bar", 0.07, 301, **arguments)
        pivot = complex(arguments.get("output_pivot_x", 0.18), arguments.get("output_pivot_y", 0.08))
        link = arguments.get("link_length", 0.14)
        sides = [1 if word == "open" else -1 for word in (branch, output_branch)]

        def output_angle(theta):
            pin = 0.05 * np.exp(1j * theta)
            joint = circles(pin, 0.10, 0.12, 0.08, sides[0])
            tip = pin + (joint - pin) / 0.10 * (0.05 + 0.06j)
            return circles(tip, link, pivot, 0.10, sides[1]) - pivot

        theta, step = speed * run.t, 1e-4
        assert same_angle(run["output.angle"], np.angle(output_angle(theta))) < 1e-12
        # Rate by a central difference of the closed form, of order 4.
        turn = [np.log(output_angle(theta + k * step) / output_angle(theta)).imag for k in (-2, -1, 1, 2)]
        rate = speed * (turn[0] - 8 * turn[1] + 8 * turn[2] - turn[3]) / (12 * step)
        assert abs(run["output.angular_velocity"] - rate).max() < 1e-8 * speed

    @pytest.mark.parametrize(
        # The first are the defaults, with a time ratio of 2.
        ("crank", "depth", "lever", "link"),
        [(0.05, 0.10, 0.20, 0.10), (0.10, 0.05, 0.08, 0.25)],
    )
    def test_quick_return(self, crank, depth, lever, link):
        speed = 10.0
        run = ideal(
            "quick_return",
            2 * math.pi / speed,
            20001,
            crank_length=crank,
            pivot_distance=depth,
            lever_length=lever,
            link_length=link,
            crank_speed=speed,
        )
        theta = speed * run.t
        angle = np.arctan2(depth + crank * np.sin(theta), crank * np.cos(theta))
        assert same_angle(run["lever.angle"], angle) < 1e-12
        reach = crank**2 + depth**2 + 2 * crank * depth * np.sin(theta)
        rate = speed * crank * (crank + depth * np.sin(theta)) / reach
        assert abs(run["lever.angular_velocity"] - rate).max() < 1e-10 * speed
        swings = crank < depth
        height = 0.5 * lever * (1 + math.cos(math.asin(crank / depth))) if swings else 0.0
        ram = lever * np.cos(angle) - np.sqrt(link**2 - (height - lever * np.sin(angle)) ** 2)
        assert abs(run["ram.x"] - ram).max() < 1e-13
        assert abs(run["ram.y"] - (height - depth)).max() < 1e-14
        # The working stroke, to the left over the top, takes the larger share of a turn.
        extreme = math.asin(min(crank, depth) / max(crank, depth))
        working = np.mean(run["ram.vx"][:-1] < 0.0)
        assert working / (1 - working) == pytest.approx(
            (math.pi + 2 * extreme) / (math.pi - 2 * extreme), abs=1e-3
        )

    def test_period_of_the_pendulum(self):
        length, mass, inertia, gravity, start = 0.3, 0.7, 2e-3, 9.81, 2.0
        small = 2 * math.pi * math.sqrt((inertia + mass * length**2) / (mass * gravity * length))
        mean, other = 1.0, math.cos(0.5 * start)  # the arithmetic-geometric mean
        while abs(mean - other) > 1e-15:
            mean, other = 0.5 * (mean + other), math.sqrt(mean * other)
        scene = mechanisms.pendulum_in_bearing(
            length=length, mass=mass, inertia=inertia, gravity=gravity, angle=start, clearance_at=()
        )
        run = cc.simulate(scene, duration=small / mean, samples=5, rtol=1e-10)
        swing = run["pendulum.angle"] + 0.5 * math.pi
        np.testing.assert_allclose(swing, [start, 0.0, -start, 0.0, start], atol=1e-7)

    def test_free_journal_falls_through_its_clearance_and_comes_to_rest(self):
        scene = mechanisms.free_journal(clearance=1e-4, gravity=4.0, load_y=-0.14 * 5.0)
        with pytest.warns(cc.ChebclearWarning):  # it rests on a friction that is zero at rest
            run = cc.simulate(scene, duration=1.5, samples=1501)
        assert codes(run) == {"creep"}
        onset = run.events.time[0]
        assert onset == pytest.approx(math.sqrt(2 * 1e-4 / 9.0), rel=1e-8)
        assert run.events.normal_velocity[0] == pytest.approx(math.sqrt(2 * 1e-4 * 9.0), rel=1e-8)
        resting = (0.14 * 9.0 / scene.joints[0].contact.stiffness) ** (2 / 3)
        assert run["bearing.penetration"][-1] == pytest.approx(resting, rel=1e-4)
        assert run["journal.y"][-1] == pytest.approx(-1e-4 - resting, rel=1e-9)
        across = cc.simulate(mechanisms.free_journal(gravity=0.0, load_x=2.8), duration=1e-3, samples=2)
        assert across["journal.x"][-1] == pytest.approx(0.5 * 20.0 * 1e-6, rel=1e-9)


class TestClearance:
    @pytest.mark.parametrize(("name", "subset"), SUBSETS, ids=lambda part: str(part).replace("'", ""))
    def test_every_subset_of_the_pins_has_two_more_freedoms_each_and_runs(self, name, subset):
        scene = getattr(mechanisms, name)(clearance_at=subset)
        without = 1 if name == "pendulum_in_bearing" else 0
        facts = scene.check()
        assert facts.degrees_of_freedom == without + 2 * len(subset)
        assert set(subset) <= set(facts.cut_joints)
        if len(subset) in (0, 1, 2, len(PINS[name])):
            run = cc.simulate(scene, duration=2e-3, samples=21, method="dop853")
            assert run.status == "done"
            for pin in subset:
                # Impacts press the surfaces together by up to 11 µm.
                assert run[f"{pin}.eccentricity"].max() < 1.6 * joint(scene, pin).clearance

    @pytest.mark.parametrize("pin", ["crank_pin", "wrist"])
    def test_slider_stays_within_the_clearance_of_the_ideal_one(self, pin):
        run = cc.simulate(mechanisms.slider_crank(clearance_at=pin), duration=0.03, samples=301)
        closed = ideal("slider_crank", 0.03, 301)
        # A displacement e of one end of the rod moves the slider by at most e / cos(rod angle).
        play = run[f"{pin}.eccentricity"]
        off = np.abs(run["slider.x"] - closed["slider.x"])
        assert (off <= 1.001 * play / np.cos(closed["rod.angle"]) + 1e-15).all()
        assert 2e-5 < off.max()

    def test_pins_may_differ_in_clearance(self):
        scene = mechanisms.slider_crank(
            clearance_at=("wrist", "crank_pin"), clearance={"crank_pin": 5e-5, "wrist": 1e-5}
        )
        assert joint(scene, "crank_pin").clearance == 5e-5 and joint(scene, "wrist").clearance == 1e-5
        # Each with the stiffness of its own clearance.
        assert joint(scene, "crank_pin").contact.stiffness == cc.laws.hertz_stiffness(
            9.8e-3, 5e-5, 207e9, 0.3
        )
        assert joint(scene, "wrist").contact.stiffness == cc.laws.hertz_stiffness(9.8e-3, 1e-5, 207e9, 0.3)


def joint(scene, name):
    return next(joint for joint in scene.joints if joint.name == name)


class TestArguments:
    @pytest.mark.parametrize("pins", [("crank_bearing",), ("wrsit",), (3,), ("crank_pin", "crank_pin")])
    @pytest.mark.parametrize("name", ["slider_crank", "four_bar", "quick_return", "six_bar"])
    def test_driven_unknown_and_repeated_pins_cannot_have_clearance(self, name, pins):
        with pytest.raises(cc.errors.SceneError) as caught:
            getattr(mechanisms, name)(clearance_at=pins, crank_length=-1.0)
        assert {problem.path for problem in caught.value.problems} == {"crank_length", "clearance_at"}

    def test_clearances_by_name_must_fit_the_pins(self):
        given = {"wrist": "wide", "crank_pn": 1e-5}
        with pytest.raises(cc.errors.SceneError) as caught:
            mechanisms.slider_crank(clearance=given, clearance_at=("wrist", "crank_pin"))
        paths = {problem.path for problem in caught.value.problems}
        assert paths == {f"clearance.{pin}" for pin in ("crank_pin", "wrist", "crank_pn")}

    @pytest.mark.parametrize("name", [*PINS, "free_journal"])
    def test_all_wrong_arguments_are_listed(self, name):
        build = getattr(mechanisms, name)
        masses = [argument for argument in inspect.unwrap(build).__kwdefaults__ if argument.endswith("mass")]
        with pytest.raises(cc.errors.SceneError) as caught:
            build(**dict.fromkeys(masses, "1"), young_modulus=-1.0, restitution="high")
        assert {problem.path for problem in caught.value.problems} == {
            *masses,
            "young_modulus",
            "restitution",
        }

    @pytest.mark.parametrize("name", PINS)
    @pytest.mark.parametrize("value", [-1.0, math.nan, 10**400])
    def test_masses_are_judged_by_the_core_and_each_is_one_problem(self, name, value):
        build = getattr(mechanisms, name)
        masses = [argument for argument in inspect.unwrap(build).__kwdefaults__ if argument.endswith("mass")]
        scene = build(**dict.fromkeys(masses, value), restitution=2.0)
        with pytest.raises(cc.errors.SceneError) as caught:
            scene.check()
        problems = caught.value.problems
        assert [path for path, _ in problems if path.startswith("bodies")] == [
            f"bodies[{index}].mass" for index in range(len(masses))
        ]
        assert problems[-1].path.endswith("contact.restitution")

    @pytest.mark.parametrize("argument", ["branch", "output_branch"])
    def test_branches(self, argument):
        with pytest.raises(cc.errors.SceneError) as caught:
            mechanisms.six_bar(**{argument: "opne"})
        assert [problem.path for problem in caught.value.problems] == [argument]

    def test_a_crank_that_jams_is_announced(self):
        with pytest.warns(cc.ChebclearWarning):
            scene = mechanisms.four_bar(ground_length=0.14)
        assert scene.check().degrees_of_freedom == 2  # it may still be driven over a part of a turn
        with pytest.warns(cc.ChebclearWarning):
            mechanisms.six_bar(link_length=0.11)

    def test_a_linkage_that_cannot_be_assembled_is_refused(self):
        with pytest.warns(cc.ChebclearWarning), pytest.raises(cc.errors.SceneError):
            mechanisms.four_bar(coupler_length=0.01, rocker_length=0.02).check()
        with pytest.raises(cc.errors.SceneError):
            mechanisms.quick_return(link_length=1e-3, ram_height=0.5).check()
        with pytest.raises(cc.errors.SceneError):
            mechanisms.quick_return(crank_length=0.1, pivot_distance=0.1)

    def test_quick_return_without_a_ram(self):
        scene = mechanisms.quick_return(ram=False)
        assert [body.name for body in scene.bodies] == ["crank", "block", "lever"]
        assert scene.check().degrees_of_freedom == 2
        with pytest.raises(cc.errors.SceneError):
            mechanisms.quick_return(ram=False, clearance_at=("ram_pin",))

    def test_the_inertia_of_the_six_bars_coupler_is_that_of_a_uniform_triangle(self):
        coupler = mechanisms.six_bar(coupler_point_x=0.04, coupler_point_y=0.05).bodies[1]
        corners = np.array([(0.0, 0.0), (0.1, 0.0), (0.04, 0.05)])
        # Quadrature over the triangle, exact for squares: the mid-points of the sides, a third each.
        middles = 0.5 * (corners + np.roll(corners, 1, axis=0))
        center = middles.mean(axis=0)
        np.testing.assert_allclose(coupler.center_of_mass, center, rtol=1e-14)
        assert coupler.inertia == pytest.approx(
            coupler.mass * ((middles - center) ** 2).sum(axis=1).mean(), rel=1e-13
        )


def test_a_bar_without_mass_has_no_inertia():
    assert mechanisms.four_bar(coupler_mass=0.0).bodies[1].inertia == 0.0


def test_flores_slider_crank():
    scene = mechanisms.flores_slider_crank()
    crank, rod, slider = scene.bodies
    assert (crank.mass, rod.mass, slider.mass) == (0.30, 0.21, 0.14)
    assert (rod.inertia, slider.inertia) == (2.5e-4, 1e-4)
    wrist = joint(scene, "wrist")
    assert wrist.clearance == 5e-4 and wrist.journal_radius == 0.0095
    assert wrist.friction is None and wrist.contact.restitution == 0.9
    assert scene.drives[0].speed == cc.rpm(5000.0)
    assert mechanisms.flores_slider_crank(clearance=1e-4).joints[3].journal_radius == 0.0099
    assert mechanisms.flores_slider_crank(friction=cc.laws.SmoothedCoulomb(0.1, 0.01)).joints[3].friction
    run = cc.simulate(scene, duration=0.012, samples=1201, method="dop853")  # a revolution
    closed = ideal("flores_slider_crank", 0.012, 1201)
    # With so much play the journal flies and bounces: the slider still follows within the clearance.
    assert run["wrist.eccentricity"].max() < 1.5 * 5e-4 and len(run.events) > 10
    assert abs(run["slider.x"] - closed["slider.x"]).max() < 1.5 * 5e-4
    assert abs(run["slider.ax"]).max() > 5.0 * abs(closed["slider.ax"]).max()


@pytest.mark.parametrize("name", sorted({*PINS, "free_journal"} - {"flores_slider_crank"}))
def test_the_pins_of_all_mechanisms_are_declared_once(name):
    build = getattr(mechanisms, name)
    known = inspect.signature(build).parameters
    declared = {item.name: item.default for item in dataclasses.fields(Pins)}
    assert {argument: known[argument].default for argument in declared} == declared
    assert "{pins}" not in build.__doc__ and "Radial clearance" in build.__doc__
    with pytest.raises(cc.errors.ArgumentTypeError):
        build(restituton=0.9)


@pytest.mark.parametrize("name", ["four_bar", "six_bar", "slider_crank"])
def test_an_array_names_no_pins(name):
    with refuses("clearance_at", error=cc.errors.SceneError):
        getattr(mechanisms, name)(clearance_at=np.zeros((2, 2)))
