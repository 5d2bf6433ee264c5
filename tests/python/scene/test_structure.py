"""Scenes as a structure and numbers: the core gets the same scene, and a study describes its parts once."""

import dataclasses
import json
import math

import chebclear as cc
import numpy as np
import pytest
from chebclear import _core
from chebclear.run.settings import Settings
from chebclear.scene import scene as scene_module
from chebclear.scene.structure import FlatScene, Structure, Structures, unpacked
from falling import PLANET, TIME, faller, height

SCENES = [
    cc.mechanisms.slider_crank(clearance_at=("crank_pin", "wrist"), gravity=9.81),
    cc.mechanisms.six_bar(),
    cc.Scene(
        [
            cc.Body("a", 1.0, 0.1, (0.1, 0.0), "tip", {"tip": (0.3, 0.0), "side": (0.0, 0.2)}, 0.4),
            cc.Body("b", 2.0, 0.2, points={"tip": (0.5, 0.1)}),
        ],
        [
            cc.Revolute("pin", "ground.O", "a"),
            cc.Prismatic("guide", "ground.wall", "b", axis=(3.0, 4.0), angle=0.2),
        ],
        [
            cc.Gravity((0.0, -9.81)),
            cc.Spring("spring", "a.tip", "b.tip", 100.0, 0.2, 3.0),
            cc.Force(
                "push", "b", cc.motions.Harmonic(1.0, 2.0, 0.3, 0.4), cc.motions.Polynomial((1.0, 2.0, 3.0))
            ),
            cc.Torque("twist", "a", cc.motions.Table((0.0, 0.5, 1.0), (0.0, 1.0, 0.5))),
            cc.TorsionSpring("coil", "ground", "a", 3.0, 0.1, 0.2),
        ],
        ground={"O": (0.0, 0.0), "wall": (1.0, 0.5)},
        start=[cc.JointStart("pin", velocity=0.7), cc.JointStart("guide", 0.3)],
    ),
]


def flat(scene):
    structure, numbers = Structures().flat(scene)
    return FlatScene(structure.text, numbers)


def filled(plain, numbers):
    """What a structure and numbers stand for."""
    if isinstance(plain, dict):
        return {name: filled(value, numbers) for name, value in plain.items()}
    if isinstance(plain, list):
        return [filled(value, numbers) for value in plain]
    return numbers[plain] if type(plain) is int else plain


@pytest.mark.parametrize("scene", SCENES, ids=range(len(SCENES)))
def test_structure_and_numbers_are_the_scene(scene):
    structure, packed = Structures().flat(scene)
    numbers = unpacked(packed)
    assert filled(json.loads(structure.text), numbers) == json.loads(scene.to_json())
    assert structure.index(("bodies", 0, "mass")) == numbers.index(scene.bodies[0].mass)


@pytest.mark.parametrize("scene", SCENES, ids=range(len(SCENES)))
def test_the_core_simulates_it_to_the_same_bits(scene):
    settings = Settings(duration=0.01, samples=11, outputs=None).fitted(scene.check())
    swept = _core.sweep([flat(scene)], settings.to_json())
    alone = cc.simulate(scene, duration=0.01, samples=11)
    for column, name in enumerate(swept["columns"]):
        assert np.array_equal(swept["values"][0, :, column], alone[name]), name


def test_numbers_that_the_core_does_not_find_are_told_with_their_path():
    structure, numbers = Structures().flat(faller())
    settings = Settings(duration=0.01, samples=3, outputs=("block.x",)).to_json()
    with pytest.raises(cc.errors.SceneError) as caught:
        _core.sweep([(structure.text, numbers[:16], ())], settings)
    assert "scenes[0].forces[0].acceleration[0]" in dict(caught.value.problems)
    with pytest.raises(cc.errors.SceneError):
        _core.sweep([("{", b"", ())], settings)


def test_scenes_that_differ_in_more_than_numbers_have_another_structure():
    scene = SCENES[0]
    wrist = scene.joints[-1]
    others = [
        dataclasses.replace(scene, forces=()),
        dataclasses.replace(scene, ground={"P": (0.0, 0.0)}),
        dataclasses.replace(scene, drives=[cc.motions.Motion("drive", "crank_bearing", 1.0)]),
        dataclasses.replace(
            scene, drives=[cc.motions.Motion("drive", "crank_bearing", cc.motions.Polynomial((1.0,)))]
        ),
        dataclasses.replace(
            scene, drives=[cc.motions.Motion("drive", "crank_bearing", cc.motions.Polynomial((1.0, 2.0)))]
        ),
    ]
    for changes in (
        {"friction": None},
        {"impact_velocity_floor": 1e-3},
        {"sliding": "contact_point"},
        {"contact": cc.laws.Flores(1e9, 0.9)},
        {"contact": cc.laws.LankaraniNikravesh(1e9, 0.9), "name": "hand"},
    ):
        joints = [*scene.joints[:-1], dataclasses.replace(wrist, **changes)]
        others.append(dataclasses.replace(scene, joints=joints))
    starts = [cc.JointStart("guide", 0.5, None), cc.JointStart("guide", None, 0.5)]
    others += [dataclasses.replace(scene, start=[start]) for start in starts]
    structures = Structures()
    texts = {structures.flat(each)[0].text for each in [scene, *others]}
    assert len(texts) == len(structures) == 1 + len(others)
    assert structures.flat(cc.mechanisms.slider_crank(clearance_at=("crank_pin", "wrist"), gravity=2.0))
    assert len(structures) == 1 + len(others)


@pytest.mark.parametrize("wrong", ["much", None, [1.0], {}, 1j])
def test_wrong_types_are_told_as_ever(wrong):
    structures = Structures()
    structures.flat(faller())
    scene = dataclasses.replace(faller(), bodies=[cc.Body("block", wrong, 0.1)])
    with pytest.raises(cc.errors.SceneError) as told:
        structures.flat(scene)
    with pytest.raises(cc.errors.SceneError) as expected:
        scene.to_json()
    assert told.value.problems == expected.value.problems


class Counted:
    """How often something of a class is called."""

    def __init__(self, patch, owner, name):
        self.count = 0
        real = getattr(owner, name)

        def counting(*arguments, **keywords):
            self.count += 1
            return real(*arguments, **keywords)

        patch.setattr(owner, name, counting)


def falling():
    template = """
    format = 1
    parameters.gravity = 9.81
    parameters.tilt = 0.5
    parameters.sine = "sin(tilt)"
    bodies = [{ name = "block", mass = 2, inertia = 0.1 }]
    joints = [{ type = "prismatic", name = "guide", a = "ground", b = "block", axis = ["cos(tilt)", "sine"] }]
    forces = [{ type = "gravity", acceleration = [0, "-gravity"] }]
    """
    return cc.loads(template)


@pytest.mark.parametrize("build", [faller, falling()], ids=["callable", "template"])
def test_a_study_describes_its_scenes_once_and_sends_numbers(monkeypatch, build):
    structures = Counted(monkeypatch, Structure, "__init__")
    texts = Counted(monkeypatch, scene_module, "write")
    scenes = Counted(monkeypatch, cc.Scene, "__post_init__")
    study = cc.Study(build, PLANET, ["block.y"], threads=2, **TIME)
    few = study.scan(3)
    once = structures.count, texts.count, scenes.count
    many = study.scan(17)
    again = structures.count - once[0], texts.count - once[1], scenes.count - once[2]
    assert once[0] == again[0] == 1
    assert again[1] == once[1]  # the nominal scene and those at the ends of the intervals
    assert again[2] == once[2] + (0 if build is not faller else 17**2 - 3**2)
    for result in (few, many):
        gravity, tilt = result.parameters.T
        expected = height(result.t, gravity[:, None], tilt[:, None])
        np.testing.assert_allclose(result.values("block.y"), expected, atol=1e-6)


def test_parts_may_come_and_go_with_the_parameters(monkeypatch):
    def build(push):
        scene = faller()
        force = [cc.Force("push", "block", 0.0, push)] if push > 0.0 else []
        return dataclasses.replace(scene, forces=[*scene.forces, *force])

    structures = Counted(monkeypatch, Structure, "__init__")
    study = cc.Study(build, {"push": cc.Interval(-4.0, 4.0)}, ["block.y"], **TIME)
    result = study.scan(9)
    assert structures.count == 2
    end = result.values("block.y")[:, -1]
    push = result.parameters[:, 0]
    np.testing.assert_allclose(end, (np.maximum(push, 0.0) / 2.0 - 9.81) * 0.08, rtol=1e-5)


def test_not_a_number_is_refused_with_its_parameters():
    def build(gravity):
        return faller(gravity=math.nan if gravity == 8.0 else gravity)

    study = cc.Study(build, {"gravity": cc.Interval(7.0, 11.0)}, ["block.y"], **TIME)
    result = study.scan(5)
    assert [(one.parameters["gravity"], one.reason) for one in result.failures] == [(8.0, "scene")]


def test_a_scene_that_is_nested_without_end_is_refused_and_no_crash():
    deep = ()
    for _ in range(100_000):
        deep = (deep,)
    scene = dataclasses.replace(faller(), bodies=[cc.Body("block", deep, 0.1)])
    with pytest.raises(RecursionError):
        Structures().flat(scene)


def test_a_class_in_the_place_of_a_number_is_no_number():
    structures = Structures()
    structures.flat(faller())
    scene = dataclasses.replace(faller(), bodies=[cc.Body("block", float, 0.1)])
    with pytest.raises(cc.errors.SceneError):
        structures.flat(scene)
