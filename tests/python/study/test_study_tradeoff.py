"""Accuracy against cost of the bounds of a study, where the response is linear."""

import math
import pickle
from dataclasses import replace

import chebclear as cc
import numpy as np
import pytest
from chebclear.errors import SimulationError
from chebclear.tradeoffs import of_study
from refusals import refuses

GRIDS = {"runs": ()}
"""No bands from scattered runs."""


def faller(gravity):
    return cc.Scene(
        [cc.Body("block", 2.0, 0.1)],
        [cc.Prismatic("guide", "ground", "block", axis=(0.0, 1.0))],
        [cc.Gravity((0.0, -gravity))],
    )


@pytest.fixture(scope="module")
def fall():
    study = cc.Study(
        faller,
        {"gravity": cc.Interval.around(9.81, rel=0.1)},
        ["block.y", "block.vy"],
        duration=0.5,
        samples=21,
    )
    return cc.study_tradeoff(study, degrees=[1, 2], points=[3], holdout=50, **GRIDS)


def test_bounds_of_a_linear_response_are_known(fall):
    # y and vy are linear in gravity: degree 1 is exact and so is Eq. (31); the extremes of n Chebyshev nodes
    # reach cos(pi / 2n) of the interval.
    by_name = {(point.bounds, point.degree): point for point in fall}
    assert list(by_name) == [
        ("interval", 1),
        ("polynomial", 1),
        ("sampled", 1),
        ("interval", 2),
        ("polynomial", 2),
        ("sampled", 2),
        ("scan", None),
    ]
    for (bounds, degree), point in by_name.items():
        narrow = math.cos(0.5 * math.pi / (degree + 1)) - 1.0 if bounds == "sampled" else 0.0
        np.testing.assert_allclose(point.width_error, narrow, atol=1e-9)
        np.testing.assert_allclose(point.escape, -0.5 * narrow, atol=1e-9)
        if bounds == "sampled":
            # Uniform hold-out points lie within with the probability of the part that the nodes reach; the
            # two corners never do, and at t = 0 nothing moves.
            assert np.all(np.abs(point.containment - (1.0 + narrow)) < 0.15)
        else:
            np.testing.assert_array_equal(point.containment, 1.0)
        if degree is not None and bounds != "sampled":
            assert np.all(point.fit_error < 1e-9)
    assert fall.holdout == 52 and fall.reference_runs == 52 + 2 + 3 + 3
    np.testing.assert_allclose(
        fall.reference_width, [0.5 * 2 * 0.981 * 0.25 * 0.3417, 2 * 0.981 * 0.25], rtol=1e-3
    )
    assert [point.runs for point in fall] == [3, 3, 3, 4, 4, 4, 4]


def test_the_cheapest_bounds_that_are_good_enough_are_taken(fall):
    advice = fall.recommendation(width_error=0.01)
    assert advice.point.degree == 1 and advice.point.bounds in ("interval", "polynomial")
    sampled = replace(fall, points=tuple(point for point in fall if point.bounds == "sampled"))
    assert sampled.recommendation(0.01).point is None
    assert sampled.recommendation(0.2, containment=0.5).point.degree == 2
    with refuses("containment"):
        fall.recommendation(containment=1.5)


def test_an_output_that_does_not_change_is_no_obstacle():
    study = cc.Study(
        faller, {"gravity": cc.Interval(9.0, 10.0)}, ["block.x", "block.y"], duration=0.5, samples=11
    )
    result = cc.study_tradeoff(study, degrees=[1], points=[], holdout=5, **GRIDS)
    assert result.reference_width[0] == 0.0 and math.isnan(result.points[0].width_error[0])
    assert result.recommendation().point.degree == 1


def test_a_motion_that_is_prescribed_has_no_error():
    crank = cc.Scene(
        [cc.Body("crank", 1.0, 0.1, center_of_mass=(0.1, 0.0))],
        [cc.Revolute("pivot", "ground", "crank")],
        [],
        [cc.motions.Speed("motor", "pivot", 3.0)],
    )
    result = cc.tradeoff(crank, duration=1.0, samples=11, rtols=[1e-3, 1e-6], repeats=1)
    assert all(not point.growth.any() and np.all(point.horizon == math.inf) for point in result)
    assert result.recommendation().point is not None
    constant = cc.tradeoff(
        crank, duration=1.0, samples=11, outputs=["crank.angular_velocity"], rtols=[1e-3], repeats=1
    )
    for made in (result, constant):
        made.plot().figure.canvas.draw()


def test_study_results_are_tables_plots_and_values(fall):
    lines = fall.table().splitlines()
    assert len(lines) == 2 + len(fall) == len(str(fall).splitlines()) - 1
    assert pickle.loads(pickle.dumps(fall)) == fall
    assert {len(column) for column in fall.to_dict().values()} == {len(fall)}
    ax = fall.plot("block.vy")
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels == ["interval", "polynomial", "sampled", "scan"]
    with pytest.raises(KeyError):
        fall.plot("block.v")


def test_settings_of_a_study_that_fail_stay_in_the_table(monkeypatch):
    study = cc.Study(faller, {"gravity": cc.Interval(9.0, 10.0)}, ["block.y"], duration=0.5, samples=11)
    real = of_study.on_grid

    def on_grid(runner, points, counts, degrees=None, *options):
        if degrees == (2,):
            raise SimulationError("max_steps", 0.1)
        return real(runner, points, counts, degrees, *options)

    monkeypatch.setattr(of_study, "on_grid", on_grid)
    result = cc.study_tradeoff(study, degrees=[1, 2], points=[], holdout=5, **GRIDS)
    assert [point.status for point in result] == ["done"] * 3 + ["max_steps"] * 3
    assert result.table().count("max_steps") == 3
    assert result.recommendation().point.degree == 1


def test_polynomials_without_a_certified_range_bound_nothing():
    study = cc.Study(faller, {"gravity": cc.Interval(9.0, 10.0)}, ["block.y"], duration=0.5, samples=11)
    result = cc.study_tradeoff(study, degrees=[31], points=[], holdout=5, **GRIDS)
    interval, polynomial, _ = result
    assert interval.containment[0] == 1.0
    numbers = [polynomial.width_error, polynomial.containment, polynomial.escape]
    assert np.all(np.isnan(numbers))
    assert result.cells()[1][1][6:9] == ["-", "-", "-"]
    assert result.recommendation(containment=0.0).point is interval


def test_wrong_arguments_of_a_study_are_listed_together():
    study = cc.Study(faller, {"gravity": cc.Interval(9.0, 10.0)}, ["block.y"], duration=0.5, samples=11)
    with refuses("rng", "degrees[0]", "points", "holdout"):
        cc.study_tradeoff(study, degrees=[0], points="5", holdout=1, rng=-1)
    with pytest.raises(cc.errors.ArgumentError):
        cc.study_tradeoff(study, degrees=[], points=[], **GRIDS)
    wide = {name: cc.Interval(1.0, 2.0) for name in "abcdefg"}
    many = cc.Study(lambda **given: faller(9.81), wide, ["block.y"], duration=0.5, samples=11)
    with refuses("degrees"):
        cc.study_tradeoff(many, degrees=[9])


def test_bands_of_a_linear_response_are_exact_from_few_runs_on():
    study = cc.Study(
        faller, {"gravity": cc.Interval.around(9.81, rel=0.1)}, ["block.y"], duration=0.5, samples=21
    )
    result = cc.study_tradeoff(study, degrees=[], points=[2], runs=[41, 9], holdout=20)
    assert [(point.bounds, point.runs) for point in result] == [
        ("scan", 3),
        ("band", 10),
        ("band", 42),
    ]
    # A calibrated band without a polynomial of degree 1 would not reach the ends of the interval.
    for point in list(result)[:3]:
        assert np.allclose(point.width_error, 0.0, atol=1e-6) and np.all(point.containment == 1.0)
    assert result.reference_runs == 22 + 2 + 41
    nine = study.band(9, rng=0)
    assert np.isclose(
        list(result)[1].width_error, nine["block.y"].width.mean() / result.reference_width - 1.0
    )


def test_bands_are_of_the_runs_that_have_a_result():
    def linear(a):
        if a > 0.8:
            raise ValueError("no mechanism")
        return {"t": np.arange(3.0), "y": np.full(3, a)}

    study = cc.Study(linear, {"a": cc.Interval(0.0, 1.0)})
    with pytest.warns(cc.ChebclearWarning):
        found = cc.study_tradeoff(study, degrees=[], points=[], runs=[20, 40], holdout=50)
    assert [(one.runs, one.status) for one in found.points] == [(21, "done"), (41, "done")]
    # A fifth of the mechanisms fail: the polynomial of the others reaches over the whole interval.
    assert found.points[-1].width_error == pytest.approx([0.25], abs=0.05)
