"""Every field of springs, dampers, given forces, motions and starts with something wrong in it."""

import dataclasses
import math

import chebclear as cc
import numpy as np
import pytest
from refusals import refused, refuses

SCENE = cc.Scene(
    [
        cc.Body("cart", 1.0, 1.0),
        cc.Body("arm", 1.0, 1.0, center_of_mass=(0.5, 0.0), points={"A": (0.0, 0.0), "B": (1.0, 0.0)}),
        cc.Body("hand", 1.0, 1.0, points={"A": (0.0, 0.0), "B": (1.0, 0.0)}, angle=-1.0),
        cc.Body("ring", 1.0, 1.0),
    ],
    [
        cc.Prismatic("rail", "ground.O", "cart", (1.0, 0.0)),
        cc.Revolute("pivot", "cart", "arm.A"),
        cc.Revolute("wrist", "arm.B", "hand.A"),
        cc.ClearanceRevolute("eye", "hand.B", "ring", 0.01, 1e-3, cc.laws.Hertz(1e9)),
    ],
    [
        cc.Spring("coil", "ground.W", "cart", 10.0, 0.5, 1.0),
        cc.Damper("dashpot", "ground.W", "arm.B", 2.0),
        cc.TorsionSpring("twist", "cart", "arm", 3.0, 0.25, 4.0),
        cc.TorsionDamper("drag", "ground", "hand", 5.0),
        cc.Force(
            "push",
            "arm.B",
            cc.motions.Harmonic(6.0, 7.0, 8.0, 9.0),
            cc.motions.Polynomial([10.0, 11.0]),
            frame="body",
        ),
        cc.Torque("motor", "hand", cc.motions.Table([0.0, 1.0, 2.0], [12.0, 13.0, 14.0]), reaction="arm"),
    ],
    [cc.motions.Motion("shaker", "rail", cc.motions.Harmonic(0.1, 15.0))],
    ground={"O": (0.0, 0.0), "W": (-1.0, 0.0)},
    start=[
        cc.JointStart("pivot", 0.5, 16.0),
        cc.BodyStart("hand", -0.75, 17.0),
        cc.ClearanceStart("eye", (1e-4, 2e-4), (0.125, 18.0)),
    ],
)


def changed(part, value):
    """The scene with one field, at a path such as ``forces[4].x.mean``, replaced."""

    def put(record, steps):
        if not steps:
            return value
        head, *rest = steps
        if isinstance(record, tuple):
            return tuple(put(item, rest) if index == int(head) else item for index, item in enumerate(record))
        return dataclasses.replace(record, **{head: put(getattr(record, head), rest)})

    return put(SCENE, part.replace("[", ".").replace("]", "").split("."))


def number_fields():
    """Path and least value of every number of the elements."""
    for kind in ("forces", "drives", "start"):
        for index, part in enumerate(getattr(SCENE, kind)):
            for field in dataclasses.fields(part):
                value = getattr(part, field.name)
                if isinstance(value, float) and field.name not in part._choices:
                    yield f"{kind}[{index}].{field.name}"
                elif isinstance(value, cc.motions.Harmonic):
                    yield from (
                        f"{kind}[{index}].{field.name}.{inner.name}" for inner in dataclasses.fields(value)
                    )


NUMBERS = list(number_fields())


@pytest.mark.filterwarnings("ignore:joint .* the penetration reached")
def test_the_scene_is_good():
    assert SCENE.check().degrees_of_freedom == 5
    assert cc.Scene.from_json(SCENE.to_json()) == SCENE
    assert cc.simulate(SCENE, duration=0.01, samples=2).success
    assert len(NUMBERS) == 20


@pytest.mark.parametrize("path", NUMBERS)
@pytest.mark.parametrize("value", ["much", [1.0], None, {}, 1j, True], ids=repr)
def test_numbers_of_the_wrong_type(path, value):
    if value is None and path.startswith("start["):
        assert changed(path, value).check()  # optional
        return
    assert list(refused(changed(path, value))) == [path]


@pytest.mark.parametrize(
    "path, value, where",
    [
        ("forces[1].b", 3, None),
        ("forces[4].frame", 0, None),
        ("forces[4].y", "strong", None),
        ("forces[4].y", cc.laws.Hertz(1.0), None),
        ("forces[4].y.coefficients", 3.0, None),
        ("forces[4].y.coefficients", ["x", 1.0], "forces[4].y.coefficients[0]"),
        ("forces[5].torque.values", [0.0, math.inf, 1.0], "forces[5].torque.points"),
        ("forces[5].torque.values", "abc", None),
        ("forces[5].torque.values", [1.0, "x", 2.0], "forces[5].torque.values[1]"),
        ("forces[5].torque", cc.motions.Table([], []), "forces[5].torque.points"),
        ("start[2].eccentricity", (1.0,), None),
        ("start[2].eccentricity", (1.0, math.nan), "start[2].eccentricity[1]"),
        ("start[2].rate", (0.0, "fast"), "start[2].rate[1]"),
        ("forces", [3], "forces[0]"),
        ("drives", [SCENE.forces[0]], "drives[0]"),
        ("start", [SCENE.drives[0]], "start[0]"),
        ("start", 3, None),
    ],
)
def test_what_a_text_cannot_hold_is_refused_at_its_path(path, value, where):
    """The tests of the core have wrong names, references and numbers."""
    assert list(refused(changed(path, value))) == [where or path]


@pytest.mark.parametrize("skip", [-1.0, math.nan, math.inf, "long", None])
def test_wrong_skips(skip):
    with refuses("skip"):
        cc.simulate(SCENE, duration=1.0, samples=2, skip=skip)


@pytest.mark.parametrize("method", ["auto", "rodas5p", "dop853", "adams"])
@pytest.mark.parametrize("damping", [0.0, 14.0])
def test_a_spring_of_length_zero_passes_through_it(method, damping):
    """x'' + damping x' + 50 x = 0 along a guide through the anchor; damped to 1e-29 m in the end."""
    bob = cc.Body("bob", mass=1.0, inertia=0.01, points={"P": (0.0, 0.0)})
    guide = cc.Prismatic("guide", "ground.O", "bob.P", axis=(0.6, 0.8))
    spring = cc.Spring("spring", "ground.O", "bob.P", 50.0, 0.0, damping)
    start = cc.JointStart("guide", 0.2, 0.0)
    scene = cc.Scene([bob], [guide], [spring], ground={"O": (0.0, 0.0), "far": (1.0, 0.0)}, start=[start])
    run = cc.simulate(scene, duration=10.0, samples=101, rtol=1e-9, method=method)
    right = 0.2 * np.cos(np.sqrt(50.0) * run.t)
    if damping:
        right = 0.2 * np.exp(-7.0 * run.t) * (np.cos(run.t) + 7.0 * np.sin(run.t))
    assert run.status == "done"
    assert np.abs(0.6 * run["bob.x"] + 0.8 * run["bob.y"] - right).max() < 1e-6
