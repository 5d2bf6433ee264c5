"""What is wrong with the arguments of a study, or with what it builds, is told with its name."""

import re

import chebclear as cc
import pytest
from falling import PLANET, TIME, faller, planet_study


def test_what_build_does_wrong_is_told_with_the_parameters():
    def text(gravity):
        return "a scene"

    def broken(gravity):
        raise LookupError("no such planet")

    def half_typed(gravity):
        return cc.Scene([cc.Body("block", "heavy", 1.0)], [])

    def unbuildable(gravity):
        return cc.mechanisms.slider_crank(rod_mass="heavy")

    sides = {"gravity": PLANET["gravity"]}
    with pytest.raises(TypeError, match="build"):
        cc.Study(text, sides, **TIME).scan(2)
    with pytest.raises(LookupError, match="no such planet") as caught:
        cc.Study(broken, sides, **TIME).scan(2)
    assert "in build with gravity = 9.5" in caught.value.__notes__
    with pytest.raises(
        cc.errors.SceneError, match=re.escape("gravity = 9.5: bodies[0].mass: must be a number")
    ):
        cc.Study(half_typed, sides, **TIME).scan(2)
    with pytest.raises(cc.errors.SceneError, match=r"9\.5"):
        cc.Study(unbuildable, sides, **TIME).scan(2)


def test_wrong_arguments_of_a_study_are_listed_together():
    with pytest.raises(ValueError) as caught:
        cc.Study(
            faller,
            {"gravty": PLANET["gravity"], "tilt": (0.3, 1.2), "mass": cc.Interval(1.0, 2.0)},
            "block.y",
            duration=0.0,
            samples=1,
            fixed={"mass": 1.0},
            threads=0,
            progress="yes",
            executor=4,
        )
    words = str(caught.value)
    for part in (
        'parameters["tilt"] must be an Interval(lower, upper), got (0.3, 1.2)',
        'build has no parameter "gravty"; did you mean "gravity"?',
        '"mass" is both a parameter and fixed',
        "duration must be a finite number > 0 [s], got 0.0",
        "samples must be a whole number >= 2 and <= 10000000, got 1",
        "outputs must be a list of column names, got 'block.y'",
        "threads must be a whole number >= 1, got 0",
        "progress must be None, True or callable, got 'yes'",
        "executor must have a method submit, got 4",
    ):
        assert part in words


def test_build_must_fit_the_parameters():
    def needs_two(gravity, tilt):
        return faller(gravity, tilt)

    def takes_all(**anything):
        return faller(**anything)

    side = {"gravity": PLANET["gravity"]}
    with pytest.raises(ValueError, match='"tilt"'):
        cc.Study(needs_two, side, **TIME)
    assert cc.Study(needs_two, side, fixed={"tilt": 1.0}, **TIME).scan(2).parameters.shape == (2, 1)
    assert cc.Study(takes_all, side, **TIME).scan(2).parameters.shape == (2, 1)
    with pytest.raises(TypeError, match="build"):
        cc.Study(faller(), side, **TIME)
    with pytest.raises(cc.errors.ArgumentError):
        cc.Study(faller, {}, **TIME)
    with pytest.raises(TypeError, match="parameters"):
        cc.Study(faller, [cc.Interval(1, 2)], **TIME)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda study: study.chebyshev(degree=0), "degree must be a whole number >= 1, got 0"),
        (lambda study: study.chebyshev(degree=-2), "degree must be a whole number >= 1, got -2"),
        (lambda study: study.chebyshev(degree=3.0), "degree must be a whole number >= 1, got 3.0"),
        (lambda study: study.chebyshev(degree=True), "degree must be a whole number >= 1, got True"),
        (lambda study: study.chebyshev(degree=3, nodes=3), "nodes must be a whole number >= 4, got 3"),
        (lambda study: study.chebyshev(degree={"gravity": 2}), 'degree misses the parameter "tilt"'),
        (
            lambda study: study.chebyshev(degree={"gravity": 2, "tilt": 0, "til": 1}),
            r'(?s)unknown parameter "til"; did you mean "tilt".*degree\["tilt"\] must be a whole number >= 1',
        ),
        (
            lambda study: study.chebyshev(degree={"gravity": 1, "tilt": 4}, nodes={"gravity": 2, "tilt": 4}),
            r'nodes\["tilt"\] must be a whole number >= 5, got 4',
        ),
        (lambda study: study.scan(1), "points must be a whole number >= 2, got 1"),
        (lambda study: study.scan("ten"), "points must be a whole number >= 2, got 'ten'"),
    ],
)
def test_wrong_degrees_nodes_and_points_are_refused(call, words):
    with pytest.raises((ValueError, TypeError), match=words):
        call(planet_study())


def test_unknown_outputs_are_named():
    study = cc.Study(faller, PLANET, ["block.y", "blok.x", "block.z"], **TIME)
    with pytest.raises(ValueError) as caught:
        study.scan(2)
    assert str(caught.value).splitlines()[0] == 'unknown output "blok.x"; did you mean "block.x"?'
    assert 'unknown output "block.z"' in str(caught.value)


def test_all_columns_are_outputs_unless_some_are_named():
    result = cc.Study(faller, {"gravity": PLANET["gravity"]}, **TIME).scan(2)
    assert result.outputs == faller().check().columns
