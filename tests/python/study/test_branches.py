"""A study of mechanisms that close their loops on different sides is refused; a turn of the crank is none."""

import math

import chebclear as cc
import numpy as np
import pytest

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
TIME = {"duration": 1e-3, "samples": 5}
MECHANISMS = [
    getattr(cc.mechanisms, name)
    for name in ("slider_crank", "four_bar", "six_bar", "quick_return", "flores_slider_crank")
]


def sides(scene):
    return scene.check().branch


@pytest.mark.parametrize("build", MECHANISMS, ids=lambda build: build.__name__)
def test_a_turn_of_the_crank_changes_no_side(build):
    found = {sides(build(crank_angle=angle)) for angle in (-2.0, -0.5, 0.3, 1.2, 2.6, 3.0, 6.0)}
    (signs,) = found
    assert signs and all(sign in (-1, 1) for sign in signs)


@pytest.mark.parametrize("pins", [(), ("crank_pin",)])
def test_the_two_ways_to_close_a_loop_differ(pins):
    one, other = (
        sides(cc.mechanisms.four_bar(branch=branch, clearance_at=pins)) for branch in ("open", "crossed")
    )
    assert one == tuple(-sign for sign in other) != ()


def test_each_loop_of_a_six_bar_has_its_sign():
    words = ("open", "crossed")
    found = {
        (one, other): sides(
            cc.mechanisms.six_bar(branch=one, output_branch=other, clearance_at=(), crank_angle=1.0)
        )
        for one in words
        for other in words
    }
    assert len(set(found.values())) == 4


def test_what_may_turn_has_no_side():
    bob = cc.Body("bob", 1.0, 0.1, points={"pivot": (0.0, 0.5)}, angle=0.3)
    assert (
        sides(cc.Scene([bob], [cc.Revolute("pin", "ground.O", "bob.pivot")], ground={"O": (0.0, 0.0)})) == ()
    )


def rhombus(height):
    """Two bars between a fixed point and a block on a guide; the guesses of their angles choose the side."""
    lean = math.atan2(height, 0.5)
    return cc.Scene(
        [
            cc.Body("a", 1.0, 0.1, points={"O": (0.0, 0.0), "P": (1.0, 0.0)}, angle=lean),
            cc.Body("b", 1.0, 0.1, points={"P": (0.0, 0.0), "Q": (1.0, 0.0)}, angle=-lean),
            cc.Body("block", 1.0, 0.1),
        ],
        [
            cc.Revolute("left", "ground.O", "a.O"),
            cc.Revolute("middle", "a.P", "b.P"),
            cc.Prismatic("guide", "ground.Q", "block", axis=(1.0, 0.0)),
            cc.Revolute("right", "b.Q", "block"),
        ],
        drives=[cc.Motion("push", "guide", cc.Polynomial((0.0, 0.01)))],
        ground={"O": (0.0, 0.0), "Q": (1.0, 0.0)},
    )


@pytest.mark.parametrize("on_failure", ["collect", "raise"])
def test_a_study_over_two_branches_is_refused_with_its_parameters(on_failure):
    study = cc.Study(rhombus, {"height": cc.interval(-0.5, 0.9)}, ["block.x"], on_failure=on_failure, **TIME)
    with pytest.raises(cc.SceneError, match=r"height = -0\.5.*\n?.*another side"):
        study.scan(5)
    cc.Study(rhombus, {"height": cc.interval(0.2, 0.9)}, ["block.x"], **TIME).scan(5)


def test_a_branch_that_only_runs_inside_the_box_take_is_refused_too():
    def inside(height):
        return rhombus(-height if 0.3 < height < 0.4 else height)

    study = cc.Study(inside, {"height": cc.interval(0.2, 0.9)}, ["block.x"], **TIME)
    study.scan(2)
    with pytest.raises(cc.SceneError, match=r"height = 0\.375.*branch.*another side"):
        study.scan(5)


def guessed(x, guesses=(0.0, 0.0)):
    """Two bars of 0.5 m from the origin to (x, 0): the first stands at arccos(x) or at its negative."""
    bars = [
        cc.Body(name, 1.0, 0.1, points={"P": (0.0, 0.0), "Q": (0.5, 0.0)}, angle=angle)
        for name, angle in zip("ab", guesses, strict=True)
    ]
    pins = [
        cc.Revolute("left", "ground.O", "a.P"),
        cc.Revolute("middle", "a.Q", "b.P"),
        cc.Revolute("right", "b.Q", "block"),
        cc.Prismatic("guide", "ground.G", "block", axis=(1.0, 0.0)),
    ]
    push = cc.Motion("push", "guide", cc.Polynomial((0.0, 0.01)))
    return cc.Scene(
        [*bars, cc.Body("block", 1.0, 0.1)], pins, drives=[push], ground={"O": (0.0, 0.0), "G": (x, 0.0)}
    )


def test_two_ways_that_are_equally_near_are_told_and_a_study_takes_one():
    said = guessed(0.4).check().warnings
    assert any("equally near" in warning for warning in said)
    result = cc.Study(guessed, {"x": cc.interval(0.3, 0.5)}, ["a.angle"], **TIME).sample(40)
    angles = result.values("a.angle")[:, 0]
    side = math.copysign(1.0, result["a.angle"].nominal[0])
    assert angles == pytest.approx(side * np.arccos(result.parameters[:, 0]), abs=1e-9)


@pytest.mark.parametrize("lean", [1.1, 30.0, -20.0])
def test_guesses_far_from_the_way_they_choose_are_enough(lean):
    lean = math.radians(lean)
    angle = guessed(0.4, (lean, -lean)).check().poses[0][2]
    assert angle == pytest.approx(math.copysign(math.acos(0.4), lean), abs=1e-9)
