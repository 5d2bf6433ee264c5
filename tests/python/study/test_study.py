"""Studies: bands of systems with closed forms, results as values, failed runs, executors."""

import copy
import math
import pickle
import threading
import warnings
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import chebclear as cc
import numpy as np
import pytest
from chebclear.study.polynomials.points import CHECKS
from falling import PLANET, TIME, faller, height, planet_study
from notices import codes


@pytest.fixture(scope="module")
def chebyshev():
    return planet_study().chebyshev(degree={"gravity": 1, "tilt": 8})


@pytest.fixture(scope="module")
def scan():
    return planet_study().scan({"gravity": 3, "tilt": 5})


def test_shapes_and_names(chebyshev, scan):
    assert chebyshev.kind == "chebyshev" and chebyshev.degrees == (1, 8) and chebyshev.nodes == (2, 9)
    assert scan.kind == "scan" and scan.degrees is None and scan.nodes == (3, 5)
    for result, runs in ((chebyshev, 18 + CHECKS), (scan, 15)):
        assert result.outputs == ("block.y", "block.vy") == tuple(result)
        assert result.parameter_names == ("gravity", "tilt") and result.intervals == PLANET
        assert result.parameters.shape == (runs, 2) and result.values("block.y").shape == (runs, 41)
        assert len(result.stats) == runs + 1 and result.t.shape == (41,)
        assert result.scene == faller(9.5, 0.75)
        with pytest.raises(KeyError):
            result["block.v"]


def test_every_run_belongs_to_its_parameters(chebyshev, scan):
    for result in (chebyshev, scan):
        expected = height(result.t, *(column[:, None] for column in result.parameters.T))
        np.testing.assert_allclose(result.values("block.y"), expected, atol=1e-9)
        np.testing.assert_allclose(result["block.y"].nominal, height(result.t, 9.5, 0.75), atol=1e-9)


def test_scan_points_are_equally_spaced_with_both_ends(scan):
    gravity, tilt = scan.parameters.T
    np.testing.assert_allclose(gravity[::5], [8.0, 9.5, 11.0], rtol=1e-15)
    np.testing.assert_allclose(tilt[:5], np.linspace(0.3, 1.2, 5), rtol=1e-15)
    assert (gravity[0], gravity[-1], tilt[0], tilt[-1]) == (8.0, 11.0, 0.3, 1.2)


def test_a_scan_of_a_monotone_response_finds_its_range(scan):
    band = scan["block.y"]
    np.testing.assert_allclose(band.lower, height(scan.t, 11.0, 1.2), atol=1e-9)
    np.testing.assert_allclose(band.upper, height(scan.t, 8.0, 0.3), atol=1e-9)
    assert band.max_width == pytest.approx(band.width[-1])
    worst = band.worst("lower")
    assert set(worst["gravity"][1:]) == {11.0} and set(worst["tilt"][1:]) == {1.2}
    for use in (
        lambda: band.coefficients,
        lambda: band.sensitivity("tilt"),
        lambda: band.evaluate(gravity=9, tilt=1),
    ):
        with pytest.raises(cc.errors.ArgumentError):
            use()


def test_the_polynomial_follows_the_response(chebyshev):
    rng = np.random.default_rng(4)
    gravity, tilt = rng.uniform(8.0, 11.0, 20), rng.uniform(0.3, 1.2, 20)
    predicted = chebyshev["block.y"].evaluate(gravity=gravity, tilt=tilt)
    np.testing.assert_allclose(predicted, height(chebyshev.t, gravity[:, None], tilt[:, None]), atol=2e-8)


def test_chebyshev_bounds_hold_and_linear_ones_are_exact(chebyshev):
    band = chebyshev["block.y"]
    assert np.all(band.lower <= height(chebyshev.t, 11.0, 1.2) + 1e-8)
    assert np.all(band.upper >= height(chebyshev.t, 8.0, 0.3) - 1e-8)
    assert np.all(band.hull[0] >= band.lower - 1e-12) and np.all(band.hull[1] <= band.upper + 1e-12)
    one = cc.Study(faller, {"gravity": PLANET["gravity"]}, ["block.y"], rtol=1e-10, **TIME).chebyshev(
        degree=1
    )
    np.testing.assert_allclose(one["block.y"].lower, -0.5 * 11.0 * one.t**2, atol=1e-9)
    np.testing.assert_allclose(one["block.y"].upper, -0.5 * 8.0 * one.t**2, atol=1e-9)


def test_a_polynomial_is_judged_by_a_run_it_was_not_fitted_to(scan):
    fine = planet_study().chebyshev({"gravity": 1, "tilt": 5}, {"gravity": 3, "tilt": 6})["block.y"]
    assert fine.resolved and fine.margin.method == "polynomial" and fine.margin.degree == 5
    wide = cc.Study(faller, {"tilt": cc.Interval(0.0, 9.0)}, ["block.y"], **TIME)
    coarse = wide.chebyshev(degree=3)["block.y"]
    assert not coarse.resolved and coarse.margin.error > 0.05
    for doubtful in (lambda: coarse.sensitivity("tilt"), lambda: cc.plots.plot_sensitivity(coarse, "tilt")):
        with pytest.warns(cc.ChebclearWarning) as told:
            doubtful()
        assert {one.filename for one in told} == {__file__}, "the user's line, however deep the cause"
    through_the_middle = wide.chebyshev(degree=2)["block.y"]
    assert not through_the_middle.resolved and through_the_middle.margin.error > 0.05
    assert scan["block.y"].verdict == "unknown" and scan["block.y"].margin.method == "runs"


@pytest.fixture(scope="module")
def crank_study():
    return cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.Interval.around(0.05, rel=0.1), "clearance": cc.Interval.around(2e-5, rel=0.1)},
        outputs=["slider.vx", "wrist.normal_force"],
        duration=0.003,
        samples=61,
        fixed={"convention": "as_printed", "impact_velocity_floor": 1e-6},
    )


@pytest.fixture(scope="module")
def crank_result(crank_study):
    return crank_study.chebyshev(degree=2)


def with_options(study, **options):
    other = copy.copy(study)
    progress = {name: options.pop(name) for name in ("progress",) if name in options}
    other.runner = replace(study.runner, execution=replace(study.runner.execution, **options), **progress)
    return other


def test_runs_are_those_of_single_simulations(crank_result):
    names = crank_result.parameter_names
    for index in (0, 4, 8):
        parameters = dict(zip(names, map(float, crank_result.parameters[index]), strict=True))
        scene = cc.mechanisms.slider_crank(**parameters, convention="as_printed", impact_velocity_floor=1e-6)
        run = cc.simulate(scene, duration=0.003, samples=61)
        assert np.array_equal(crank_result.values("slider.vx")[index], run["slider.vx"])
        assert crank_result.stats[index] == run.stats


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_the_number_of_threads_does_not_change_a_bit(crank_study, crank_result, threads):
    assert with_options(crank_study, threads=threads).chebyshev(degree=2) == crank_result


@pytest.mark.parametrize("kind", ["threads", "processes"])
def test_executors_give_the_same_bits(crank_study, crank_result, kind):
    done = []
    spawn = {"mp_context": get_context("spawn")}
    with ThreadPoolExecutor(2) if kind == "threads" else ProcessPoolExecutor(2, **spawn) as executor:
        study = with_options(crank_study, executor=executor, progress=lambda *counts: done.append(counts))
        assert study.chebyshev(degree=2) == crank_result
    counts = [count for count, total in done if total == 10 + CHECKS]
    assert counts == sorted(set(counts)) and len(counts) == len(done) and counts[-1] == 10 + CHECKS


class Shuffling:
    """An executor that ends its pieces in another order than it got them."""

    num_workers = 4

    def __init__(self):
        self.futures = []
        self.waiting = []

    def submit(self, function, *arguments):
        future = Future()
        self.futures.append(future)
        self.waiting.append((future, function, arguments))
        if len(self.waiting) == self.num_workers or len(self.futures) > 1:
            threading.Timer(0.001, self.work).start()
        else:
            self.work()
        return future

    def work(self):
        while self.waiting:
            future, function, arguments = self.waiting.pop()
            try:
                future.set_result(function(*arguments))
            except Exception as error:
                future.set_exception(error)


def test_many_runs_are_sent_in_few_pieces_and_kept_in_order():
    executor = Shuffling()
    study = cc.Study(faller, {"gravity": PLANET["gravity"]}, ["block.vy"], executor=executor, **TIME)
    result = study.scan(200)
    assert len(executor.futures) <= 64
    np.testing.assert_allclose(
        result.values("block.vy")[:, -1], -0.4 * np.linspace(8.0, 11.0, 200), rtol=1e-9
    )


def test_pieces_with_different_outputs_are_not_mixed():
    def renamed(gravity):
        """A scene whose parts have other names beyond a certain gravity."""
        name = "block" if gravity < 10.0 else "brick"
        return cc.Scene([cc.Body(name, 1.0, 1.0)], [cc.Prismatic("guide", "ground", name, (0.0, 1.0))])

    study = cc.Study(renamed, {"gravity": PLANET["gravity"]}, **TIME)
    for executor in (None, Shuffling()):
        with pytest.raises(cc.errors.SceneError) as caught:
            with_options(study, executor=executor).scan(4)
        assert caught.value.problems[0].path == f"scene with gravity = {PLANET['gravity'].upper!r}: outputs"


@pytest.mark.parametrize("name", ["crank_length", "clearance", "rod_length"])
def test_an_interval_that_reaches_to_where_there_is_no_mechanism(name):
    # The Chebyshev roots lie inside.
    sides = {
        "crank_length": cc.Interval(0.0, 0.05),
        "clearance": cc.Interval(0.0, 4e-5),
        "rod_length": cc.Interval(0.03, 0.12),  # shorter than the crank: it does not reach at a quarter turn
    }
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {name: sides[name]},
        ["slider.x"],
        duration=1e-4,
        samples=3,
        fixed={"crank_angle": math.pi / 2.0},
    )
    with pytest.raises(cc.errors.SceneError) as caught:
        study.chebyshev(degree=2)
    first, *_, last = (problem.path for problem in caught.value.problems)
    assert first.startswith(f"scene with {name} = {sides[name].lower!r}: ") and last == f"parameters.{name}"


def test_warnings_of_all_runs_come_once():
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.Interval.around(0.05, rel=0.1)},
        ["slider.vx"],
        duration=0.003,
        samples=11,
        fixed={"impact_velocity_floor": 100.0},  # above every impact velocity of this mechanism
    )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = study.chebyshev(degree=3)
    texts = [str(warning.message) for warning in caught]
    assert texts == list(result.warnings) and len(set(texts)) == len(texts) > 0
    assert any(notice.numbers.get("runs") == notice.numbers.get("of_runs") == 8 for notice in result.notices)
    assert all(warning.filename == __file__ for warning in caught)


def test_a_failed_run_names_its_parameters_and_no_result_is_made():
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.Interval(0.04, 0.06), "clearance": cc.Interval(1e-5, 2e-5)},
        duration=0.01,
        samples=11,
        max_steps=150,
        on_failure="raise",
    )
    with pytest.raises(cc.errors.SimulationError) as caught:
        study.scan(2)
    error = caught.value
    assert error.reason == "max_steps" and 0.0 < error.time < 0.01
    assert error.parameters == {"crank_length": 0.04, "clearance": 1e-5}
    assert pickle.loads(pickle.dumps(error)).parameters == error.parameters


def test_the_first_of_several_wrong_scenes_is_reported_with_its_parameters():
    study = cc.Study(faller, {"mass": cc.Interval(-1.0, 2.0)}, **TIME)
    for executor in (None, Shuffling()):
        with pytest.raises(cc.errors.SceneError) as caught:
            with_options(study, executor=executor).scan(4)
        paths = [problem.path for problem in caught.value.problems]
        assert paths == ["scene with mass = -1.0: bodies[0].mass", "parameters.mass"]
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.Study(faller, {"mass": cc.Interval(-3.0, 2.0)}, ["block.y"], **TIME).scan(2)
    assert caught.value.problems[0].path == "scene with mass = -0.5: bodies[0].mass"


def by_hand(bound, reference, span):
    rms, other = (math.sqrt(np.mean(np.square(values[span]))) for values in (bound, reference))
    return abs(rms - other) / other


def test_comparison_is_the_measure_of_table_3(chebyshev, scan):
    # The ends of the span are samples only up to rounding.
    for start, end, first, last in (
        (None, None, 0, 40),
        (0.1, 0.3, 10, 30),
        (0.1 + 1e-16, 0.3 - 1e-16, 10, 30),
    ):
        comparison = cc.compare(chebyshev, scan, start, end)
        span = slice(first, last + 1)
        assert (comparison.start, comparison.end) == (scan.t[first], scan.t[last])
        for name in ("block.y", "block.vy"):
            row, band, other = comparison[name], chebyshev[name], scan[name]
            assert row.lower == pytest.approx(by_hand(band.lower, other.lower, span), rel=1e-12)
            assert row.upper == pytest.approx(by_hand(band.upper, other.upper, span), rel=1e-12)
            assert row.width == band.width[span].max() and row.reference_width == other.width[span].max()
            assert row.slack == pytest.approx(row.width / row.reference_width - 1.0)


def test_a_comparison_is_a_table(chebyshev, scan):
    comparison = cc.compare(chebyshev, scan)
    assert len(str(comparison).splitlines()) == 2 + len(comparison)
    table = comparison.to_dict()
    assert dict(zip(table["output"], table["slack"], strict=True))["block.vy"] == comparison["block.vy"].slack
    with pytest.raises(KeyError):
        comparison["block.vv"]


def test_a_relative_error_of_nothing_is_not_a_number():
    study = cc.Study(faller, {"gravity": PLANET["gravity"]}, ["block.angle"], **TIME)
    row = cc.compare(study.chebyshev(1), study.scan(2))["block.angle"]
    assert math.isnan(row.lower) and math.isnan(row.upper) and math.isnan(row.slack)


def test_results_that_cannot_be_compared_are_refused(chebyshev, scan):
    other = cc.Study(faller, PLANET, ["block.x"], **TIME).scan(2)
    coarse = planet_study(samples=21).scan(2)
    for wrong in ((scan, 0.3, 0.1), (scan, 0.101, 0.102), (coarse,), (other,)):
        with pytest.raises(cc.errors.ArgumentError):
            cc.compare(chebyshev, *wrong)


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_a_band_that_is_widest_while_the_start_settles_says_so():
    side = {"crank_length": cc.Interval.around(0.05, rel=0.02)}
    options = {"outputs": ["wrist.normal_force"], "samples": 121, "fixed": {"clearance": 2e-4}}
    turn = cc.mechanisms.slider_crank().period
    for how in ("scan", "band"):
        early = cc.Study(cc.mechanisms.slider_crank, side, duration=2 * turn, **options)
        late = cc.Study(cc.mechanisms.slider_crank, side, duration=turn, skip=turn, **options)
        result, later = (getattr(study, how)(5) for study in (early, late))
        assert result["wrist.normal_force"].width.argmax() < 60
        (notice,) = (one for one in result.notices if one.code == "settling")
        assert notice.numbers["settled"] == pytest.approx(turn) and "settling" not in codes(later)


def test_a_comparison_shows_what_cancels_over_time_and_what_differs():
    """A band moved by d where it is low and by -d where it is high has the same root mean square."""
    t = np.linspace(0.0, 1.0, 5)
    pairs = ((np.array([3.0, 4.0, 3.0, 4.0, 5.0]), 2.0), (np.array([4.0, 3.0, 4.0, 3.0, 5.0]), 3.0))
    made = [
        cc.Study(lambda a, b, x=x: {"t": t, "x": x + a * b}, {"a": cc.Interval(-1.0, 1.0)}, fixed={"b": b})
        for x, b in ((pairs[0][0], 1.0), (pairs[1][0], 1.0), (pairs[0][0], 2.0))
    ]
    first, moved, wider = (study.scan(2) for study in made)
    row = cc.compare(moved, first)["x"]
    assert row.lower == pytest.approx(0.0) and row.upper == pytest.approx(0.0)
    assert row.largest == pytest.approx(1.0 / 4.0)  # of the range from 2 to 6
    assert cc.compare(first, first).differences == ()
    assert cc.compare(wider, first).differences == ("fixed b: 2 and 1",)


def test_a_comparison_of_two_mechanisms_names_both():
    box, span = {"crank_length": cc.Interval.around(0.05, rel=0.01)}, {"duration": 1e-3, "samples": 3}
    one = cc.Study(cc.mechanisms.slider_crank, box, ["crank.angle"], **span)
    two = cc.Study(
        cc.mechanisms.slider_crank, box, ["crank.angle"], **span, rtol=1e-8, fixed={"clearance": 1e-3}
    )
    three = cc.Study(cc.mechanisms.four_bar, box, ["crank.angle"], **span)
    told = cc.compare(one.scan(2), two.scan(2)).differences
    assert told[:2] == ("fixed clearance: none and 0.001", "rtol: 1e-06 and 1e-08")
    assert "nominal scene: joints.wrist.clearance: 2e-05 and 0.001" in told
    assert cc.compare(one.scan(2), three.scan(2)).differences[0] == "mechanism: slider_crank and four_bar"
    other = {"crank_length": cc.Interval(0.04, 0.06, 0.041)}
    told = cc.compare(
        one.scan(2), cc.Study(cc.mechanisms.slider_crank, other, ["crank.angle"], **span).scan(2)
    )
    assert (
        told.differences[0] == "interval of crank_length: 0.0495 to 0.0505 and 0.04 to 0.06 (nominal 0.041)"
    )
