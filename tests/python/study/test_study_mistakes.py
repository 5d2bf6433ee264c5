"""What is wrong with the arguments of a study, or with what it builds, is told with its name."""

import chebclear as cc
import pytest
from falling import PLANET, TIME, faller, planet_study
from refusals import refuses


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
    with pytest.raises(cc.errors.ArgumentTypeError):
        cc.Study(text, sides, **TIME).scan(2)
    with pytest.raises(LookupError) as caught:
        cc.Study(broken, sides, **TIME).scan(2)
    assert "gravity = 9.5" in caught.value.__notes__[0]
    for build, field in ((half_typed, "bodies[0].mass"), (unbuildable, "rod_mass")):
        with refuses(f"scene with gravity = 9.5: {field}", error=cc.errors.SceneError):
            cc.Study(build, sides, **TIME).scan(2)


def test_wrong_arguments_of_a_study_are_listed_together():
    wrong = {"duration": 0.0, "samples": 1, "threads": 0, "progress": "yes", "executor": 4}
    sides = {"gravty": PLANET["gravity"], "tilt": (0.3, 1.2), "mass": cc.Interval(1.0, 2.0)}
    with refuses('parameters["tilt"]', "build", "mass", "outputs", *wrong):
        cc.Study(faller, sides, "block.y", fixed={"mass": 1.0}, **wrong)


def test_build_must_fit_the_parameters():
    def needs_two(gravity, tilt):
        return faller(gravity, tilt)

    def takes_all(**anything):
        return faller(**anything)

    side = {"gravity": PLANET["gravity"]}
    with refuses("build", error=ValueError):
        cc.Study(needs_two, side, **TIME)
    assert cc.Study(needs_two, side, fixed={"tilt": 1.0}, **TIME).scan(2).parameters.shape == (2, 1)
    assert cc.Study(takes_all, side, **TIME).scan(2).parameters.shape == (2, 1)
    with refuses("build", error=TypeError):
        cc.Study(faller(), side, **TIME)
    with pytest.raises(cc.errors.ArgumentError):
        cc.Study(faller, {}, **TIME)
    with refuses("parameters", error=TypeError):
        cc.Study(faller, [cc.Interval(1, 2)], **TIME)


@pytest.mark.parametrize(
    ("method", "given", "names"),
    [
        ("chebyshev", {"degree": 0}, ["degree"]),
        ("chebyshev", {"degree": 3.0}, ["degree"]),
        ("chebyshev", {"degree": True}, ["degree"]),
        ("chebyshev", {"degree": 3, "nodes": 3}, ["nodes"]),
        ("chebyshev", {"degree": {"gravity": 2}}, ["degree"]),
        ("chebyshev", {"degree": {"gravity": 2, "tilt": 0, "til": 1}}, ["degree", 'degree["tilt"]']),
        (
            "chebyshev",
            {"degree": {"gravity": 1, "tilt": 4}, "nodes": {"gravity": 2, "tilt": 4}},
            ['nodes["tilt"]'],
        ),
        ("scan", {"points": 1}, ["points"]),
        ("scan", {"points": "ten"}, ["points"]),
    ],
)
def test_wrong_degrees_nodes_and_points_are_refused(method, given, names):
    with refuses(*names):
        getattr(planet_study(), method)(**given)


def test_unknown_outputs_are_named():
    study = cc.Study(faller, PLANET, ["block.y", "blok.x", "block.z"], **TIME)
    with refuses("outputs", error=ValueError):
        study.scan(2)


def test_all_columns_are_outputs_unless_some_are_named():
    result = cc.Study(faller, {"gravity": PLANET["gravity"]}, **TIME).scan(2)
    assert result.outputs == faller().check().columns
