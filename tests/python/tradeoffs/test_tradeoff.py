"""Accuracy against cost of runs, measured on a pendulum with closed forms."""

import copy
import math
import pickle
import sys
from dataclasses import replace

import chebclear as cc
import matplotlib as mpl
import numpy as np
import pytest
from chebclear.errors import SimulationError
from chebclear.run.settings import METHODS
from matplotlib.figure import Figure
from pendulum import LOWEST_ANGLE, LOWEST_SPEED, OUTPUTS, pendulum, quarter_period
from refusals import refuses

RTOLS = (1e-3, 1e-5, 1e-7, 1e-9)


@pytest.fixture(scope="module")
def swing():
    """Two samples: the start and the lowest position, where everything is known."""
    return cc.tradeoff(
        pendulum(), duration=quarter_period(), samples=2, outputs=OUTPUTS, rtols=RTOLS, repeats=2
    )


def test_errors_are_those_against_the_closed_form(swing):
    assert len(swing) == len(METHODS) * len(RTOLS)
    for point in swing:
        run = cc.simulate(
            pendulum(),
            duration=quarter_period(),
            samples=2,
            rtol=point.rtol,
            method=point.method,
            outputs=OUTPUTS,
        )
        for name, truth in zip(OUTPUTS, (LOWEST_ANGLE, LOWEST_SPEED), strict=True):
            assert swing.error(point, name) == pytest.approx(abs(run[name][-1] - truth), rel=1e-3, abs=2e-11)
        assert point.stats == run.stats


def test_the_reference_knows_its_own_error(swing):
    for name, truth in zip(OUTPUTS, (LOWEST_ANGLE, LOWEST_SPEED), strict=True):
        run = cc.simulate(
            pendulum(),
            duration=quarter_period(),
            samples=2,
            rtol=swing.reference.rtol,
            method=swing.reference.method,
            outputs=OUTPUTS,
        )
        assert abs(run[name][-1] - truth) <= 10.0 * max(swing.uncertainty(name), 1e-14)
    assert swing.trusted_until == swing.duration == quarter_period()


def test_a_tighter_tolerance_costs_more_and_errs_less(swing):
    for method in METHODS:
        points = [point for point in swing if point.method == method]
        assert [point.rtol for point in points] == list(RTOLS)
        errors = [swing.error(point, "bob.angle") for point in points]
        assert errors == sorted(errors, reverse=True)
        stages = [point.stats.stages for point in points]
        assert stages == sorted(stages)
        assert all(point.seconds > 0.0 for point in points)


def test_errors_grow_with_time_and_end_at_the_largest():
    scene = cc.mechanisms.slider_crank(convention="corrected")
    result = cc.tradeoff(
        scene, duration=0.004, samples=401, outputs=["slider.vx"], methods=["rodas4"], rtols=[1e-3], repeats=1
    )
    (point,) = result
    tight = cc.simulate(
        scene, duration=0.004, samples=401, rtol=1e-12, method=result.reference.method, outputs=["slider.vx"]
    )
    run = cc.simulate(scene, duration=0.004, samples=401, rtol=1e-3, method="rodas4", outputs=["slider.vx"])
    difference = np.abs(run["slider.vx"] - tight["slider.vx"])
    assert result.error(point, "slider.vx") == difference.max() > 0.0
    assert np.all(np.diff(point.growth) >= 0.0)
    # A time between two instants is rounded up to the later one.
    for until in (0.001, 0.0023456):
        instant = result.t[np.flatnonzero(result.t >= until * (1.0 - 1e-12))[0]]
        expected = difference[tight.t <= instant * (1.0 + 1e-12)].max()
        assert result.error(point, "slider.vx", until) == expected


def test_runs_that_fail_stay_in_the_table():
    result = cc.tradeoff(
        pendulum(),
        duration=1.0,
        samples=101,
        outputs=OUTPUTS,
        methods=["rodas4"],
        rtols=[1e-3, 1e-8],
        repeats=1,
        max_steps=60,
    )
    loose, tight = result
    assert loose.success and tight.status == "max_steps" and 0.0 < tight.end_time < 1.0
    assert math.isnan(result.error(tight, "bob.angle"))
    assert 0.0 <= result.error(tight, "bob.angle", 0.5 * tight.end_time) < 1e-5
    for text in (str(result), result.table()):
        assert text.count("max_steps at") == 1 and " done" in text
    assert result.to_dict()["status"] == ["done", "max_steps"]
    assert result.recommendation(0.5).point is loose
    ax = result.plot("bob.angle")
    assert "rodas4, 1 failed: max_steps" in [text.get_text() for text in ax.get_legend().get_texts()]


def test_a_reference_that_fails_is_an_error(monkeypatch):
    monkeypatch.setattr(sys.modules["chebclear.tradeoffs.of_scene"], "MAX_STEPS", 100)
    with pytest.raises(SimulationError) as caught:
        cc.tradeoff(pendulum(), duration=1.0, samples=11, outputs=OUTPUTS)
    assert caught.value.reason == "max_steps" and not caught.value.trajectory.success


def test_all_outputs_but_contact_states_are_the_default():
    scene = cc.mechanisms.slider_crank()
    result = cc.tradeoff(scene, duration=0.001, samples=11, methods=["dop853"], rtols=[1e-3], repeats=1)
    assert set(scene.check().columns) - set(result.outputs) == {"wrist.contact"}
    # Too many for a table: only the worst is shown.
    assert "[% of range]" in str(result) and "slider.vx [m/s]" not in str(result)


def test_results_are_values(swing, tmp_path):
    file = swing.save(tmp_path / "swing")
    for twin in (copy.deepcopy(swing), pickle.loads(pickle.dumps(swing)), cc.results.Tradeoff.load(file)):
        assert twin == swing
    assert swing != replace(swing, points=swing.points[:-1])
    assert swing["rodas4", 1e-5] in swing.points
    with pytest.raises(cc.errors.UnknownNameError):
        swing["rodas4", 1e-6]
    columns = swing.to_dict()
    assert {len(column) for column in columns.values()} == {len(swing)}
    assert columns["error bob.angle"][0] == swing.error(swing.points[0], "bob.angle")


def test_tables_have_a_row_for_every_run(swing):
    lines = swing.table().splitlines()
    assert len(lines) == 2 + len(swing) and len({line.count("|") for line in lines}) == 1


def test_progress_counts_runs():
    calls = []
    cc.tradeoff(
        pendulum(),
        duration=0.1,
        samples=11,
        outputs=OUTPUTS,
        methods=["rodas4", "dop853"],
        rtols=[1e-4],
        repeats=3,
        progress=lambda *done: calls.append(done),
    )
    assert calls == [(number, 8) for number in range(1, 9)]


@pytest.mark.parametrize(
    ("path", "value", "kind"),
    [
        ("methods", ["rodas"], ValueError),
        ("methods", "rodas4", TypeError),
        ("methods", ["rodas4", "rodas4"], ValueError),
        ("rtols", [], ValueError),
        ("rtols[0]", [0.5], ValueError),
        ("rtols", [1e-12], ValueError),
        ("repeats", 0, ValueError),
        ("progress", 3, TypeError),
        ("scene", "pendulum", TypeError),
    ],
)
def test_wrong_arguments_are_named(path, value, kind):
    name = path.partition("[")[0]
    with refuses(path, error=kind):
        cc.tradeoff(**({"scene": pendulum(), "duration": 0.1, "samples": 11} | {name: value}))


def test_the_plot_has_a_line_for_every_method(swing):
    before = dict(mpl.rcParams)
    ax = Figure().subplots()
    assert swing.plot("bob.angular_velocity", ax=ax, cost="stages") is ax
    assert dict(mpl.rcParams) == before
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    assert "angular velocity of bob" in ax.get_xlabel() and "[rad/s]" in ax.get_xlabel()
    assert ax.get_ylabel() == "stages [-]"
    for method in METHODS:
        (line,) = [line for line in ax.get_lines() if line.get_label() == method]
        points = [point for point in swing if point.method == method]
        np.testing.assert_array_equal(line.get_ydata(), [point.stats.stages for point in points])
        errors = [swing.error(point, "bob.angular_velocity") for point in points[:2]]
        np.testing.assert_array_equal(line.get_xdata()[:2], errors)
    with pytest.raises(KeyError):
        swing.plot("bob.speed")
    with refuses("cost", error=ValueError):
        swing.plot(cost="money")


def test_the_loose_end_is_measured_and_recommended_where_the_demand_allows():
    result = cc.tradeoff(
        cc.mechanisms.slider_crank(),
        duration=0.01,
        samples=121,
        outputs=["slider.vx"],
        methods=["auto"],
        repeats=1,
    )
    loose, tight = (result.recommendation(accuracy, cost="evaluations").point for accuracy in (5e-2, 1e-5))
    assert loose.rtol >= 1e-2 > tight.rtol
    assert loose.stats.evaluations < 0.5 * tight.stats.evaluations
