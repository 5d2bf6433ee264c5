"""Scenes as values, as JSON and as the user gets them wrong; the ready-made slider-crank."""

import copy
import dataclasses
import json
import math
import pickle

import chebclear as cc
import numpy as np
import pytest
from loops import four_bar
from refusals import refuses

# Numbers that lose bits in careless text, and both zeros.
AWKWARD = [0.1, 1.0 / 3.0, math.pi, 5e-324, 1.7976931348623157e308, -0.0, 1e22, 123456789.123456789]


def one_of_everything():
    """Every kind of part, with numbers that are awkward to write; not a mechanism that makes sense."""
    law = cc.laws.LankaraniNikravesh(AWKWARD[4], 1.0 / 3.0)
    friction = cc.laws.ModifiedCoulomb(0.1, 0.1 + 0.2, 5e-324, 1e22)
    return cc.Scene(
        bodies=[
            cc.Body("a", mass=AWKWARD[7], inertia=AWKWARD[0], points={"P": (1.0 / 3.0, -0.0)}, angle=math.e),
            cc.Body(
                "b", mass=1, inertia=2, center_of_mass=[0.1, 0.7], inertia_about="Q", points={"Q": (0, 0)}
            ),
        ],
        joints=[
            cc.Revolute("pin", "ground", "a.P"),
            cc.Prismatic("guide", "ground.O", "b.Q", axis=(math.sqrt(0.5), 0.3), angle=0.1),
            cc.Fixed("weld", "a", "b", angle=-0.1),
            cc.ClearanceRevolute(
                "wrist",
                bearing="a.P",
                journal="b.Q",
                journal_radius=0.1,
                clearance=1e-5 / 3.0,
                contact=law,
                friction=friction,
                sliding="contact_point",
                impact_velocity_floor=1e-7,
            ),
            cc.ClearanceRevolute("other", "a", "b", 0.1, 1e-5, cc.laws.Hertz(1e12, exponent=10.0 / 9.0)),
        ],
        forces=[cc.Gravity((0.0, -9.80665))],
        drives=[cc.motions.Speed("drive", "pin", cc.rpm(2000), angle=0.2)],
        ground={"O": (0.3, -1e-300)},
    )


def bits(plain):
    """The JSON value with every float replaced by its hexadecimal form, which tells -0.0 from 0.0."""
    if isinstance(plain, float):
        return plain.hex()
    if isinstance(plain, dict):
        return {key: bits(value) for key, value in plain.items()}
    return [bits(value) for value in plain] if isinstance(plain, list) else plain


@pytest.mark.parametrize("scene", [one_of_everything(), cc.mechanisms.slider_crank()])
def test_json_round_trip_is_exact(scene):
    text = scene.to_json()
    again = cc.Scene.from_json(text)
    assert again == scene
    assert bits(json.loads(again.to_json())) == bits(json.loads(text))
    assert cc.Scene.from_json(scene.to_json(indent=2)) == scene


def test_numbers_that_are_not_finite_are_written_as_words_and_read_back():
    scene = cc.Scene([cc.Body("a", mass=math.inf, inertia=-math.inf, center_of_mass=(math.nan, 0.0))], [])
    written = json.loads(scene.to_json())["bodies"][0]
    assert [written["mass"], written["inertia"], written["center_of_mass"]] == [
        "Infinity",
        "-Infinity",
        ["NaN", 0.0],
    ]
    again = cc.Scene.from_json(scene.to_json()).bodies[0]
    assert again.mass == math.inf and again.inertia == -math.inf and math.isnan(again.center_of_mass[0])


def test_scenes_are_values():
    scene = one_of_everything()
    twins = [one_of_everything(), copy.copy(scene), copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))]
    for twin in twins:
        assert twin == scene and hash(twin) == hash(scene)
    assert len({scene, *twins}) == 1
    heavier = dataclasses.replace(
        scene, bodies=[dataclasses.replace(scene.bodies[0], mass=2.0), scene.bodies[1]]
    )
    assert heavier != scene
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.bodies[0].mass = 1.0
    with pytest.raises(TypeError):
        scene.bodies[0].points["P"] = (0.0, 0.0)


def test_arrays_lists_and_numpy_numbers_become_plain_floats():
    body = cc.Body(
        "a", mass=np.float32(0.5), inertia=np.int64(2), center_of_mass=np.array([1, 2]), angle=np.array(0.5)
    )
    assert (body.mass, body.inertia, body.center_of_mass, body.angle) == (0.5, 2.0, (1.0, 2.0), 0.5)
    assert all(
        type(number) is float for number in (body.mass, body.inertia, *body.center_of_mass, body.angle)
    )
    assert cc.Body("a", 1, 1, points={"P": [0, 1]}).points == {"P": (0.0, 1.0)}


def test_a_wrong_type_hides_no_problem_of_a_part_with_a_longer_number():
    bodies = [cc.Body(f"b{index}", 1.0, 1.0) for index in range(12)]
    bodies[1] = dataclasses.replace(bodies[1], mass="heavy")
    bodies[10] = dataclasses.replace(bodies[10], mass=-1.0)
    bodies[11] = dataclasses.replace(bodies[11], inertia=-1.0)
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.Scene(bodies, [cc.Revolute(f"r{i}", "ground", f"b{i}") for i in range(12)]).check()
    assert [path for path, _ in caught.value.problems].count("bodies[1].mass") == 1
    assert {"bodies[10].mass", "bodies[11].inertia"} <= {path for path, _ in caught.value.problems}
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.Scene([bodies[0], "a body", *bodies[2:]], []).check()
    assert {"bodies[1]", "bodies[10].mass"} <= {path for path, _ in caught.value.problems}


def test_check_says_what_the_scene_is():
    facts = cc.mechanisms.slider_crank().check()
    assert facts.degrees_of_freedom == 2  # the rod's angle and the slider's position
    assert facts.bodies == ("crank", "rod", "slider") and facts.cut_joints == ("wrist",)
    assert facts.poses == ((0.0, 0.0, 0.0), (0.05, 0.0, 0.0), (pytest.approx(0.17, abs=1e-15), 0.0, 0.0))
    assert len(facts.columns) == len(set(facts.columns)) == 3 * 9 + 9 + 1
    assert {"slider.x", "rod.angular_acceleration", "wrist.penetration", "drive.torque"} <= set(facts.columns)


def wrong(**changes):
    return dataclasses.replace(cc.mechanisms.slider_crank(), **changes)


def test_wrong_types_are_reported_together_and_with_wrong_numbers():
    crank, rod, slider = cc.mechanisms.slider_crank().bodies
    scene = wrong(
        bodies=[
            dataclasses.replace(crank, mass="heavy", center_of_mass=(0.1, None)),
            dataclasses.replace(rod, inertia=[1.0], points="B"),
            dataclasses.replace(slider, mass=-1.0, name=7),
        ],
        joints=[*cc.mechanisms.slider_crank().joints[:3], "a pin"],
        forces=5,
    )
    for attempt in (scene.to_json, scene.check, lambda: cc.simulate(scene, duration=0.01, samples=11)):
        with pytest.raises(cc.errors.SceneError) as caught:
            attempt()
        # Of the right type but wrong, the mass of the slider is found by the core in the same go.
        assert {path for path, _ in caught.value.problems} >= {
            *("bodies[0].mass", "bodies[0].center_of_mass[1]", "bodies[1].inertia", "bodies[1].points"),
            *("bodies[2].name", "bodies[2].mass", "joints[3]", "forces"),
        }


def test_a_mechanism_that_cannot_be_assembled_is_refused():
    too_short = cc.mechanisms.slider_crank(crank_length=0.05, rod_length=0.03, crank_angle=1.5)
    with refuses("bodies", error=cc.errors.SceneError):
        too_short.check()


@pytest.mark.parametrize(
    ("text", "path"),
    [
        ("{", "scene"),
        ("[1]", "scene"),
        ('{"bodies": []}', "joints"),
        ('{"bodies": [{"name": "a", "mas": 1}], "joints": []}', "bodies[0].mas"),
        ('{"bodies": 3, "joints": []}', "bodies"),
        ('{"bodies": [], "joints": [{"type": "revolut"}]}', "joints[0].type"),
        ('{"bodies": [], "joints": [4]}', "joints[0]"),
        ('{"bodies": [], "joints": [{"type": []}]}', "joints[0].type"),
        ("[" * 100_000, "scene"),
        ('{"bodies":' * 100_000, "scene"),
    ],
)
def test_bad_json_is_refused_with_a_path(text, path):
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.Scene.from_json(text)
    assert path in dict(caught.value.problems)


def test_wrong_values_in_json_are_read_and_then_reported():
    text = cc.mechanisms.slider_crank().to_json().replace('"mass": 0.3', '"mass": "0.3"')
    with refuses("bodies[0].mass", error=cc.errors.SceneError):
        cc.Scene.from_json(text).check()


def test_intervals():
    assert cc.Interval(0.2, 0.5) == cc.Interval(0.2, 0.5)
    assert cc.Interval.around(8, rel=0.25) == cc.Interval.around(8, plus=2, minus=2) == cc.Interval(6.0, 10.0)
    assert cc.Interval.around(-8, rel=0.25) == cc.Interval(-10.0, -6.0)
    assert cc.Interval.around(3.0, rel=1.0) == cc.Interval(0.0, 6.0)
    one_sided = cc.Interval.around("20 mm", minus="0.1 mm")
    assert (one_sided.lower, one_sided.nominal, one_sided.upper) == (0.0199, 0.02, 0.02)
    lower, upper = cc.Interval("119.5 mm", 0.1205)
    assert (lower, upper) == (0.1195, 0.1205)
    assert 0.12 in cc.Interval(lower, upper) and "120 mm" in cc.Interval(lower, upper)
    assert 0.13 not in cc.Interval(lower, upper) and "x" not in cc.Interval(lower, upper)
    side = cc.Interval(np.float64(6), 10)
    assert (side.midpoint, side.half_width) == (8.0, 2.0)
    assert pickle.loads(pickle.dumps(side)) == side and hash(side) == hash(cc.Interval(6, 10))


@pytest.mark.parametrize(
    "make",
    [
        lambda: cc.Interval(0.5, 0.2),
        lambda: cc.Interval(0.5, 0.5),
        lambda: cc.Interval(math.nan, math.inf),
        lambda: cc.Interval.around(1.0, rel=-0.1),
        lambda: cc.Interval.around(0.05, rel=10),
        lambda: cc.Interval.around(0.0, rel=0.1),
        lambda: cc.Interval.around(1.0, plus=0.0, minus=0.0),
        lambda: cc.Interval.around(1.0, plus=-1.0),
        lambda: cc.Interval("1 mm", "2 kgs"),
        lambda: cc.Interval("1", 2.0),
        lambda: cc.Interval.around(1.0),
        lambda: cc.Interval.around(1.0, plus=2.0, rel=0.1),
    ],
)
def test_wrong_intervals_are_refused(make):
    with pytest.raises((cc.errors.ArgumentError, cc.errors.ArgumentTypeError)):
        make()


def test_rpm():
    assert cc.rpm(60.0) == pytest.approx(2.0 * math.pi, rel=1e-15)


def test_stiffness_of_the_papers_joint():
    # Eq. (8) with sigma = (1 - nu^2)/E and, as Eq. (9) is printed, with (1 - nu^2)/(pi E).
    assert cc.laws.hertz_stiffness(9.8e-3, 2e-5, 207e9, 0.3) == pytest.approx(3.326530256934e11, rel=1e-12)
    printed = cc.laws.hertz_stiffness(9.8e-3, 2e-5, 207e9, 0.3, convention="as_printed")
    assert printed == pytest.approx(1.045060301713e12, rel=1e-12)
    # A rigid bearing halves the compliance.
    rigid = cc.laws.hertz_stiffness(9.8e-3, 2e-5, 207e9, 0.3, bearing_young_modulus=1e300)
    assert rigid == pytest.approx(2.0 * 3.326530256934e11, rel=1e-12)


def test_wrong_arguments_of_the_stiffness_are_listed_together():
    with refuses("journal_radius", "clearance", "convention", "poisson_ratio"):
        cc.laws.hertz_stiffness(-1.0, 0.0, 207e9, 1.5, "hertzian")


@pytest.mark.parametrize(
    ("convention", "sliding", "stiffness", "divisor"),
    [
        ("corrected", "surface", 3.326530256934e11, 12.0),
        ("as_printed", "contact_point", 1.045060301713e12, 3.0),
    ],
)
def test_the_conventions_of_the_slider_crank(convention, sliding, stiffness, divisor):
    scene = cc.mechanisms.slider_crank(convention=convention, rod_length=0.132)
    crank, rod, slider = scene.bodies
    assert (crank.mass, rod.mass, slider.mass) == (0.30, 0.21, 0.14)  # Table 1, whatever the lengths
    assert crank.inertia == pytest.approx(0.30 * 0.05**2 / divisor, rel=1e-14)
    assert rod.inertia == pytest.approx(0.21 * 0.132**2 / divisor, rel=1e-14)
    assert slider.inertia == 1e-4
    wrist = scene.joints[3]
    assert wrist.sliding == sliding
    assert wrist.contact.stiffness == pytest.approx(stiffness, rel=1e-12)
    assert wrist.friction == cc.laws.ModifiedCoulomb(0.04, 0.03, 1e-3, 1.5e-3)  # Table 2
    assert not scene.forces


def test_a_pickle_does_not_tell_what_was_done_with_a_scene():
    fresh, used = cc.mechanisms.slider_crank(), cc.mechanisms.slider_crank()
    before = pickle.dumps(fresh)
    used.check()
    assert pickle.dumps(used) == before and pickle.loads(before).check() == used.check()


def test_arrays_changed_later_leave_a_scene_alone():
    place, times = np.array([0.0, 1.0]), np.linspace(0.0, 1.0, 5)
    force = cc.Force("push", "block", cc.motions.Table(times, times**2), 0.0)
    block = cc.Body("block", mass=1.0, inertia=1.0, points={"A": place})
    scene = cc.Scene([block], [cc.Prismatic("guide", "ground", "block", axis=place)], [force])
    text = scene.to_json()
    place[:], times[:] = 7.0, 7.0
    assert scene.to_json() == dataclasses.replace(scene).to_json() == text


@pytest.mark.parametrize("place", [[[1.0, 2.0], 3.0], [0.0, [1.0]], [[0.0, 1.0], [1.0, 0.0]]])
def test_lists_among_numbers_are_reported_like_any_other_mistake(place):
    body = cc.Body("block", mass=-1.0, inertia=1.0, center_of_mass=place)
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.Scene([body], [cc.Prismatic("guide", "ground", "block", axis=(1.0, 0.0))]).check()
    assert [problem.path for problem in caught.value.problems] == [
        "bodies[0].center_of_mass",
        "bodies[0].mass",
    ]


def test_options_of_the_slider_crank():
    scene = cc.mechanisms.slider_crank(
        gravity=9.81, friction=None, convention="as_printed", sliding="surface", impact_velocity_floor=1e-6
    )
    assert scene.forces == (cc.Gravity((0.0, -9.81)),)
    wrist = scene.joints[3]
    assert (wrist.friction, wrist.sliding, wrist.impact_velocity_floor) == (None, "surface", 1e-6)
    with refuses("convention", error=cc.errors.SceneError):
        cc.mechanisms.slider_crank(convention="printed")
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.mechanisms.slider_crank(crank_length="0.05", rod_mass=None)
    assert [problem.path for problem in caught.value.problems] == ["crank_length", "rod_mass"]


def test_laws_are_checked_with_paths() -> None:
    wrist = cc.ClearanceRevolute(
        "wrist",
        bearing="ground",
        journal="a",
        journal_radius=0.01,
        clearance=1e-4,
        contact=cc.laws.HuntCrossley(1e10, -1.0),
        friction=cc.laws.SmoothedCoulomb(-0.1, 0.0),
    )
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.Scene([cc.Body("a", 1.0, 1.0)], [wrist]).check()
    paths = [problem.path for problem in caught.value.problems]
    assert paths == [
        "joints[0].contact.hysteresis_factor",
        "joints[0].friction.coefficient",
        "joints[0].friction.velocity",
    ]


def test_the_period_is_that_of_the_slowest_drive():
    scene = cc.mechanisms.slider_crank(crank_speed=50.0)
    assert scene.period == 2.0 * math.pi / 50.0
    two = dataclasses.replace(
        scene,
        drives=[*scene.drives, cc.motions.Speed("other", "x", -20.0), cc.motions.Speed("held", "y", 0.0)],
    )
    assert two.period == 2.0 * math.pi / 20.0
    with pytest.raises(cc.errors.ArgumentError):
        _ = four_bar().period
