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
        drives=[cc.motions.Motion("push", "guide", cc.motions.Polynomial((0.0, 0.01)))],
        ground={"O": (0.0, 0.0), "Q": (1.0, 0.0)},
    )


@pytest.mark.parametrize("on_failure", ["collect", "raise"])
def test_a_study_over_two_branches_is_refused_with_its_parameters(on_failure):
    study = cc.Study(rhombus, {"height": cc.Interval(-0.5, 0.9)}, ["block.x"], on_failure=on_failure, **TIME)
    with pytest.raises(cc.errors.SceneError) as caught:
        study.scan(5)
    assert caught.value.problems[0].path == "scene with height = -0.5: branch"
    cc.Study(rhombus, {"height": cc.Interval(0.2, 0.9)}, ["block.x"], **TIME).scan(5)


def test_a_branch_that_only_runs_inside_the_box_take_is_refused_too():
    def inside(height):
        return rhombus(-height if 0.3 < height < 0.4 else height)

    study = cc.Study(inside, {"height": cc.Interval(0.2, 0.9)}, ["block.x"], **TIME)
    study.scan(2)
    with pytest.raises(cc.errors.SceneError) as caught:
        study.scan(5)
    assert caught.value.problems[0].path == "scene with height = 0.375: branch"


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
    push = cc.motions.Motion("push", "guide", cc.motions.Polynomial((0.0, 0.01)))
    return cc.Scene(
        [*bars, cc.Body("block", 1.0, 0.1)], pins, drives=[push], ground={"O": (0.0, 0.0), "G": (x, 0.0)}
    )


def test_two_ways_that_are_equally_near_are_told_and_a_study_takes_one():
    assert "two_assemblies" in [one.code for one in guessed(0.4).check().notices]
    result = cc.Study(guessed, {"x": cc.Interval(0.3, 0.5)}, ["a.angle"], **TIME).sample(40)
    angles = result.values("a.angle")[:, 0]
    side = math.copysign(1.0, result["a.angle"].nominal[0])
    assert angles == pytest.approx(side * np.arccos(result.parameters[:, 0]), abs=1e-9)


@pytest.mark.parametrize("lean", [1.1, 30.0, -20.0])
def test_guesses_far_from_the_way_they_choose_are_enough(lean):
    lean = math.radians(lean)
    angle = guessed(0.4, (lean, -lean)).check().poses[0][2]
    assert angle == pytest.approx(math.copysign(math.acos(0.4), lean), abs=1e-9)


def free_four_bar(lengths, angles):
    """Three bars that nothing drives between two fixed points, from guesses that do not close the loop."""
    crank, coupler, rocker, base = lengths
    return cc.Scene(
        [
            cc.Body(name, 1.0, 0.1, points={"near": (0.0, 0.0), "far": (length, 0.0)}, angle=angle)
            for name, length, angle in zip(
                ("crank", "coupler", "rocker"), (crank, coupler, rocker), angles, strict=True
            )
        ],
        [
            cc.Revolute("A", "ground.A", "crank.near"),
            cc.Revolute("B", "crank.far", "coupler.near"),
            cc.Revolute("C", "coupler.far", "rocker.far"),
            cc.Revolute("D", "ground.D", "rocker.near"),
        ],
        ground={"A": (0.0, 0.0), "D": (base, 0.0)},
    )


def test_the_start_of_a_free_loop_is_continuous_in_its_lengths():
    # A start that jumps between two rules along a line of lengths is an impact that no parameter has.
    rng = np.random.default_rng(3)
    steps = np.linspace(-0.05, 0.05, 41)
    for line in range(40):
        guesses = np.array([1.0, 0.3, 1.4]) + rng.uniform(-0.6, 0.6, 3)
        direction = rng.uniform(-1.0, 1.0, 4)
        lengths = np.array([0.2, 0.5, 0.4, 0.5]) * (1.0 + steps[:, None] * direction)
        runs = [cc.simulate(free_four_bar(row, guesses), duration=1e-6, samples=2) for row in lengths]
        angles = [[run[f"{body}.angle"][0] for body in ("crank", "coupler", "rocker")] for run in runs]
        assert np.abs(np.diff(angles, 2, axis=0)).max() < 0.001, line
