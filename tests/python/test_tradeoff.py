"""Accuracy against cost: closed forms, synthetic results, the recommendation, the command."""

import copy
import json
import math
import pickle
import sys
import warnings
from dataclasses import replace

import chebclear as cc
import matplotlib as mpl
import numpy as np
import pytest
from chebclear import cli
from chebclear.errors import SimulationError
from chebclear.plots import costs as plot_costs
from chebclear.run.accuracy import chaos_horizon, output_ranges
from chebclear.run.settings import METHODS
from chebclear.run.trajectory import Stats
from chebclear.tradeoffs import output as tradeoff_output
from chebclear.tradeoffs.result import format_error
from matplotlib.figure import Figure

GRAVITY, LENGTH = 9.81, 0.3  # [m/s^2], [m]
MASS, INERTIA = 0.5, 2e-3  # [kg], [kg m^2]


def pendulum():
    """An ideal pendulum that starts at rest at 90 degrees from its lowest position."""
    return cc.Scene(
        [cc.Body("bob", MASS, INERTIA, center_of_mass=(LENGTH, 0.0))],
        [cc.Revolute("pivot", "ground", "bob")],
        [cc.Gravity((0.0, -GRAVITY))],
    )


def quarter_period():
    """Time from rest at 90 degrees to the lowest position [s]: Gauss's arithmetic-geometric mean."""
    a, b = 1.0, math.cos(0.25 * math.pi)
    for _ in range(6):
        a, b = 0.5 * (a + b), math.sqrt(a * b)
    reduced_length = (INERTIA + MASS * LENGTH**2) / (MASS * LENGTH)
    return 0.5 * math.pi * math.sqrt(reduced_length / GRAVITY) / a


LOWEST_ANGLE = -0.5 * math.pi
LOWEST_SPEED = -math.sqrt(2.0 * MASS * GRAVITY * LENGTH / (INERTIA + MASS * LENGTH**2))
OUTPUTS = ("bob.angle", "bob.angular_velocity")
RTOLS = (1e-3, 1e-5, 1e-7, 1e-9)


@pytest.fixture(scope="module")
def swing():
    """Two samples: the start and the lowest position, where everything is known."""
    return cc.tradeoff(pendulum(), quarter_period(), 2, OUTPUTS, rtols=RTOLS, repeats=2)


# --- differences and horizons ---------------------------------------------------------------------------


def test_horizon_is_the_first_sample_beyond_the_threshold():
    t = np.linspace(0.0, 1.0, 11)
    difference = np.zeros((11, 4))
    difference[3, 0], difference[4, 0] = -0.02, 0.0  # parts for one sample only
    difference[:, 1] = 0.01  # just at the threshold
    difference[7:, 2] = np.nan  # a run that failed has not parted
    difference[10, 3] = 1.0
    np.testing.assert_array_equal(chaos_horizon(t, difference, 0.01), [t[3], math.inf, math.inf, 1.0])


def test_an_exponential_difference_parts_at_its_logarithm():
    t = np.linspace(0.0, 1.0, 100001)
    horizon = chaos_horizon(t, 1e-8 * np.exp(40.0 * t), 0.02)
    assert horizon == pytest.approx(math.log(0.02 / 1e-8) / 40.0, abs=2e-5)


def test_ranges_tell_rounding_from_motion():
    values = np.array([[0.17, 1e-18, 5.0, 1e-3], [0.07, -1e-17, 5.0, np.nan], [0.12, 0.0, 5.0, 3e-3]])
    columns = ("slider.x", "slider.y", "crank.angular_velocity", "wrist.normal_force")
    ranges, thresholds = output_ranges(columns, values)
    np.testing.assert_allclose(ranges, [0.10, 0.0, 0.0, 2e-3], rtol=1e-12)
    # What is constant has parted when it differs by more than the rounding of its kind.
    np.testing.assert_allclose(thresholds, [1e-3, 1e-10 * 0.17, 1e-10 * 5.0, 2e-5], rtol=1e-12)


# --- the estimate of a single run -----------------------------------------------------------------------


@pytest.mark.parametrize("method", METHODS)
def test_the_estimate_is_the_error_against_the_closed_form(method):
    run = cc.simulate(
        pendulum(), quarter_period(), 2, rtol=1e-5, method=method, outputs=OUTPUTS, error="estimate"
    )
    assert run.error.rtol == pytest.approx(1e-7) and run.error.status == "done"
    for name, truth in zip(OUTPUTS, (LOWEST_ANGLE, LOWEST_SPEED), strict=True):
        error = abs(run[name][-1] - truth)
        estimate = run.error[name]
        assert 0.4 * error < estimate.max_difference < 2.5 * error
        assert estimate.claim == 2.0 * estimate.max_difference
        assert estimate.relative == pytest.approx(estimate.max_difference / abs(np.ptp(run[name])), rel=1e-3)
        assert estimate.horizon == math.inf


def test_the_estimate_of_a_chaotic_run_has_a_horizon(tmp_path):
    scene = cc.mechanisms.slider_crank(convention="corrected")
    outputs = ["slider.vx", "wrist.normal_force", "slider.y"]
    run = cc.simulate(scene, 0.01, 401, 1e-3, "rodas5p", outputs, error="estimate")
    plain = cc.simulate(scene, 0.01, 401, 1e-3, "rodas5p", outputs)
    assert plain.error is None and run != plain and replace(run, error=None) == plain
    # Against the truth, and not only against runs that may share its error.
    true = cc.simulate(scene, 0.01, 401, 1e-11, outputs=outputs)["wrist.normal_force"]
    force = run.error["wrist.normal_force"]
    error = np.abs(run["wrist.normal_force"] - true)
    assert 0.5 * error.max() < force.max_difference < 2.0 * error.max()
    first = np.flatnonzero(error > 0.01 * np.ptp(true))[0]
    assert 0.5 * run.t[first] < force.horizon < 2.0 * run.t[first] and force.parted
    assert force.claim == 0.02 * force.range and error[run.t < force.horizon].max() < force.claim
    assert run.error["slider.y"].range == 0.0 and math.isnan(run.error["slider.y"].relative)
    for twin in (
        pickle.loads(pickle.dumps(run)),
        copy.deepcopy(run),
        cc.Trajectory.load(run.save(tmp_path / "r")),
    ):
        assert twin == run and twin.error == run.error
    assert cc.Trajectory.load(plain.save(tmp_path / "p")).error is None


def test_the_estimate_of_a_run_that_fails_covers_what_both_reached():
    short = {"rtol": 1e-8, "method": "rodas5p", "max_steps": 30, "error": "estimate"}
    run = cc.simulate(pendulum(), 1.0, 101, outputs=OUTPUTS, on_failure="return", **short)
    assert run.status == run.error.status == "max_steps"
    assert 0.0 < run.error.compared_until < run.end_time
    assert run.error["bob.angle"].max_difference < 1e-6
    with pytest.raises(cc.SimulationError):
        cc.simulate(pendulum(), 1.0, 101, **short)


def test_the_companion_runs_tighten_tolerances_that_were_set():
    own = {"position_tolerance": 1e-4, "velocity_tolerance": 1e-2}
    run = cc.simulate(pendulum(), 0.5, 51, outputs=OUTPUTS, error="estimate", **own)
    error = np.abs(run.values - cc.simulate(pendulum(), 0.5, 51, rtol=1e-11, outputs=OUTPUTS).values)
    # What these tolerances leave is far above what the rtol alone would.
    assert np.all(error.max(axis=0) > 1e-6)
    np.testing.assert_array_less(np.abs(run.error.max_difference / error.max(axis=0) - 1.0), 0.5)


@pytest.mark.parametrize(
    ("change", "words"), [({"error": "bound"}, '"estimate"'), ({"rtol": 5e-12}, "rtol >= 1e-11")]
)
def test_wrong_requests_for_an_estimate(change, words):
    with pytest.raises(ValueError, match=words):
        cc.simulate(pendulum(), 1.0, 11, **({"error": "estimate"} | change))


def test_companions_take_steps_of_their_own_where_no_tolerance_binds():
    # So short and smooth that the method of order 8 does the same at a tenth of the tolerance.
    given = {"scene": pendulum(), "duration": 0.5 * quarter_period(), "samples": 2, "method": "dop853"}
    loose, tenth, tight = (cc.simulate(**given, rtol=rtol, outputs=OUTPUTS) for rtol in (1e-5, 1e-6, 1e-11))
    assert np.array_equal(loose.values, tenth.values)
    run = cc.simulate(**given, rtol=1e-5, outputs=OUTPUTS, error="estimate")
    np.testing.assert_allclose(run.error.max_difference, np.abs(run.values - tight.values)[-1], rtol=0.2)
    # Nothing is integrated where the drives prescribe everything: there is no error.
    crank = cc.Scene(
        [cc.Body("crank", 1.0, 0.1)],
        [cc.Revolute("pivot", "ground", "crank")],
        [],
        [cc.Speed("m", "pivot", 3.0)],
    )
    turn = cc.simulate(crank, 1.0, 11, outputs=["crank.angle"], error="estimate").error
    assert turn["crank.angle"].max_difference == 0.0 and turn["crank.angle"].horizon == math.inf


# A slow crank whose contact rests, and strong friction in two pins: above 1e-6 the tolerances are those of
# the contacts, whatever is asked for.
CAPPED = [
    (cc.mechanisms.slider_crank(crank_speed=cc.rpm(5.0), gravity=9.81), 0.5, 1e-3),
    (
        cc.mechanisms.slider_crank(
            clearance_at=("crank_pin", "wrist"),
            crank_speed=cc.rpm(60.0),
            gravity=9.81,
            contact=cc.Flores(1e10, 0.9),
            friction=cc.ModifiedCoulomb(0.3, 0.225, 1e-3, 1.5e-3),
        ),
        0.01,
        4.4e-4,
    ),
]


@pytest.mark.filterwarnings("ignore:joint .* it slides slower")
@pytest.mark.parametrize(("scene", "duration", "rtol"), CAPPED, ids=["slow crank", "two pins"])
def test_companions_are_more_accurate_where_contacts_bind_the_tolerances(scene, duration, rtol):
    run, true = (
        cc.simulate(scene, duration, 101, outputs=["slider.vx"], **other)
        for other in ({"rtol": rtol, "error": "estimate"}, {"rtol": 1e-10})
    )
    error = np.abs(run["slider.vx"] - true["slider.vx"]).max()
    # 1.00 and 1.01; a run at a tenth of the rtol alone differs by 0.10 and 0.16 errors.
    assert 0.5 * error < run.error["slider.vx"].max_difference < 2.0 * error


def test_a_companion_that_fails_ends_what_is_estimated():
    scene, given = cc.mechanisms.slider_crank(), {"rtol": 1e-5, "outputs": ["slider.vx"], "error": "estimate"}
    steps = cc.simulate(scene, 0.004, 41, rtol=1e-5).stats
    limit = int(1.1 * (steps.steps + steps.rejected))
    run = cc.simulate(scene, 0.004, 41, max_steps=limit, **given)
    assert run.success and run.error.status == "max_steps"
    estimate = run.error["slider.vx"]
    assert 0.0 < estimate.horizon == run.error.compared_until < 0.004 and not estimate.parted
    assert estimate.in_words() == (
        f"did not part until {estimate.horizon:.4g} s, where a companion run ended"
    )


def test_progress_of_all_runs_grows_from_0_to_1(monkeypatch):
    simulated = []

    def simulate(scene, settings, report, start):
        for share in (0.0, 0.5, 1.0):
            report(share)
        simulated.append(json.loads(settings)["rtol"])
        return core_simulate(scene, settings, None)

    core_simulate = cc.run.simulation._core.simulate
    monkeypatch.setattr(cc.run.simulation._core, "simulate", simulate)
    shares = []
    cc.simulate(pendulum(), 0.5, 11, error="estimate", progress=shares.append)
    assert shares == sorted(shares) and (shares[0], shares[-1]) == (0.0, 1.0) and len(shares) == 9
    assert simulated == [1e-6, pytest.approx(1e-7), pytest.approx(1e-8)]


def test_each_warning_comes_once():
    # Restitution below 0.85, and a floor above every impact velocity; the companion run repeats both.
    contact = {"restitution": 0.5, "impact_velocity_floor": 100.0}
    scene = cc.mechanisms.slider_crank(**contact)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run = cc.simulate(scene, 0.002, 21, error="estimate")
    messages = [str(warning.message) for warning in caught]
    assert messages == list(run.warnings)
    assert sum("restitution" in message for message in messages) == 1
    assert sum("floor" in message for message in messages) == 1
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = cc.tradeoff(scene, 0.002, 21, ["slider.x"], rtols=[1e-3, 1e-4], repeats=1)
    assert [str(warning.message) for warning in caught] == list(result.warnings) == messages
    assert {warning.filename for warning in caught} == {__file__}


@pytest.mark.parametrize("friction", [1.0, 0.04, None])
def test_a_contact_that_creeps_is_warned_of_once(friction):
    law = None if friction is None else cc.ModifiedCoulomb(friction, 0.75 * friction, 1e-3, 1.5e-3)
    scene = cc.mechanisms.slider_crank(friction=law)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run = cc.simulate(scene, 0.03, 3001, outputs=["wrist.contact", "wrist.sliding_velocity"])
    messages = [str(warning.message) for warning in caught if "creeps" in str(warning.message)]
    # Counted on samples, which knows nothing of the steps.
    pressed = run["wrist.contact"] > 0.0
    share = np.mean(np.abs(run["wrist.sliding_velocity"][pressed]) < 1e-3)
    if friction == 1.0:
        assert len(messages) == 1 and messages[0].startswith('joint "wrist"')
        said = float(messages[0].split("for ")[1].split(" %")[0])
        assert said == pytest.approx(100.0 * share, abs=2.0) and share > 0.2
    else:
        assert messages == [] and share < 0.1


# --- measured on a scene --------------------------------------------------------------------------------


def test_errors_are_those_against_the_closed_form(swing):
    assert len(swing) == len(METHODS) * len(RTOLS)
    for point in swing:
        run = cc.simulate(
            pendulum(), quarter_period(), 2, rtol=point.rtol, method=point.method, outputs=OUTPUTS
        )
        for name, truth in zip(OUTPUTS, (LOWEST_ANGLE, LOWEST_SPEED), strict=True):
            assert swing.error(point, name) == pytest.approx(abs(run[name][-1] - truth), rel=1e-3, abs=2e-11)
        assert point.stats == run.stats


def test_the_reference_knows_its_own_error(swing):
    for name, truth in zip(OUTPUTS, (LOWEST_ANGLE, LOWEST_SPEED), strict=True):
        run = cc.simulate(
            pendulum(),
            quarter_period(),
            2,
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
    result = cc.tradeoff(scene, 0.004, 401, ["slider.vx"], methods=["rodas4"], rtols=[1e-3], repeats=1)
    (point,) = result
    tight = cc.simulate(scene, 0.004, 401, rtol=1e-12, method=result.reference.method, outputs=["slider.vx"])
    run = cc.simulate(scene, 0.004, 401, rtol=1e-3, method="rodas4", outputs=["slider.vx"])
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
        pendulum(), 1.0, 101, OUTPUTS, methods=["rodas4"], rtols=[1e-3, 1e-8], repeats=1, max_steps=60
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
    with pytest.raises(SimulationError, match="in the reference run") as caught:
        cc.tradeoff(pendulum(), 1.0, 11, OUTPUTS)
    assert caught.value.reason == "max_steps" and not caught.value.trajectory.success


def test_all_outputs_but_contact_states_are_the_default():
    scene = cc.mechanisms.slider_crank()
    result = cc.tradeoff(scene, 0.001, 11, methods=["dop853"], rtols=[1e-3], repeats=1)
    assert set(scene.check().columns) - set(result.outputs) == {"wrist.contact"}
    # Too many for a table: only the worst is shown.
    assert "[% of range]" in str(result) and "slider.vx [m/s]" not in str(result)


def test_results_are_values(swing, tmp_path):
    file = swing.save(tmp_path / "swing")
    for twin in (copy.deepcopy(swing), pickle.loads(pickle.dumps(swing)), cc.Tradeoff.load(file)):
        assert twin == swing
    assert swing != replace(swing, points=swing.points[:-1])
    assert swing["rodas4", 1e-5] in swing.points
    with pytest.raises(KeyError, match="rodas4 was not run at rtol 1e-06"):
        swing["rodas4", 1e-6]
    columns = swing.to_dict()
    assert {len(column) for column in columns.values()} == {len(swing)}
    assert columns["error bob.angle"][0] == swing.error(swing.points[0], "bob.angle")


def test_tables_have_a_row_for_every_run(swing):
    lines = swing.table().splitlines()
    assert len(lines) == 2 + len(swing) and len({line.count("|") for line in lines}) == 1
    text = str(swing).splitlines()
    assert text[0].startswith("Reference: rodas5p and rodas4 at rtol 1e-12 agree within 1 %")
    assert [line.split()[:2] for line in text[2:4]] == [["auto", "1e-3"], ["auto", "1e-5"]]


def test_progress_counts_runs():
    calls = []
    cc.tradeoff(
        pendulum(),
        0.1,
        11,
        OUTPUTS,
        methods=["rodas4", "dop853"],
        rtols=[1e-4],
        repeats=3,
        progress=lambda *done: calls.append(done),
    )
    assert calls == [(number, 8) for number in range(1, 9)]


@pytest.mark.parametrize(
    ("change", "kind", "words"),
    [
        ({"methods": ["rodas"]}, ValueError, 'did you mean "rodas'),
        ({"methods": "rodas4"}, TypeError, "methods must be a list"),
        ({"methods": ["rodas4", "rodas4"]}, ValueError, "more than once"),
        ({"rtols": []}, ValueError, "rtols must not be empty"),
        ({"rtols": [0.5]}, ValueError, r"rtols\[0\] must be"),
        ({"rtols": [1e-12]}, ValueError, "at least 10 times reference_rtol = 1e-12"),
        ({"repeats": 0}, ValueError, "repeats must be"),
        ({"outputs": ["bob.z"]}, ValueError, 'unknown output "bob.z"'),
        ({"progress": 3}, TypeError, "progress must be"),
        ({"scene": "pendulum"}, TypeError, "a Study has the method tradeoff"),
    ],
)
def test_wrong_arguments_are_named(change, kind, words):
    with pytest.raises(kind, match=words):
        cc.tradeoff(**({"scene": pendulum(), "duration": 0.1, "samples": 11} | change))


# --- the recommendation, on tables made up --------------------------------------------------------------

NO_WORK = Stats(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.0, 0.0, 0.0)
TIMES = np.array([0.0, 0.01, 0.02, 0.03])


def made_up(errors, uncertainty=1e-9, seconds=None, status=None):
    """A result with one output of range 10; errors by (method, rtol) grow to a list over `TIMES`."""

    def point(setting, growth):
        growth = np.broadcast_to(np.asarray(growth, dtype=float), TIMES.shape)
        method, rtol = setting
        price = (seconds or {}).get(setting, 1.0)
        return cc.TradeoffPoint(
            method,
            rtol,
            (status or {}).get(setting, "done"),
            TIMES[-1],
            replace(NO_WORK, stages=round(1.0 / price)),
            price,
            chaos_horizon(TIMES, growth[:, None], np.array([0.1])),
            growth[None, :],
        )

    return cc.Tradeoff(
        ("slider.vx",),
        np.array([10.0]),
        TIMES,
        tuple(point(setting, growth) for setting, growth in errors.items()),
        point(("rodas5p", 1e-12), 0.0),
        point(("rodas4", 1e-12), uncertainty),
        (),
        None,
        None,
    )


def test_the_cheapest_setting_that_is_good_enough_is_taken():
    errors = {("rodas4", 1e-4): 0.02, ("rodas4", 1e-6): 0.002, ("dop853", 1e-6): 0.005}
    prices = {("rodas4", 1e-4): 1.0, ("rodas4", 1e-6): 4.0, ("dop853", 1e-6): 2e-3}
    advice = made_up(errors, seconds=prices).recommendation(1e-3)
    assert (advice.point.method, advice.point.rtol, advice.until) == ("dop853", 1e-6, 0.03)
    assert str(advice) == "rtol 1e-6 with dop853: slider.vx within 0.0050 m/s over all 30 ms, 2 ms a run"
    # The same in the unit of the output; by stages (one over the price here) another one is cheaper.
    assert made_up(errors, seconds=prices).recommendation({"slider.vx": 0.01}).point == advice.point
    stages = made_up(errors, seconds={**prices, ("rodas4", 1e-6): 0.5}).recommendation(1e-3, cost="stages")
    assert (stages.point.method, stages.point.rtol) == ("rodas4", 1e-6)
    assert str(stages).endswith("2 stages a run")


def test_auto_is_taken_where_it_is_level_with_the_cheapest():
    # Both costs are within 10 % of each other: what is faster is chance.
    errors = {("dop853", 1e-6): 0.005, ("auto", 1e-6): 0.005, ("auto", 1e-8): 0.001}
    prices = {("dop853", 1e-6): 2e-3, ("auto", 1e-8): 4e-3}
    for price, method in [(2.1e-3, "auto"), (2.3e-3, "dop853")]:
        advice = made_up(errors, seconds={**prices, ("auto", 1e-6): price}).recommendation(1e-3)
        assert (advice.point.method, advice.point.rtol) == (method, 1e-6)


def test_counters_do_not_scatter():
    # One over the price: 500 and 526 stages, so a setting of auto that is 5 % dearer is dearer.
    errors = {("dop853", 1e-6): 0.005, ("auto", 1e-6): 0.005}
    prices = {("dop853", 1e-6): 2e-3, ("auto", 1e-6): 1.9e-3}
    result = made_up(errors, seconds=prices)
    assert result.recommendation(1e-3, cost="stages").point.method == "dop853"
    assert result.recommendation(1e-3).point.method == "auto"


def test_of_two_level_settings_of_auto_the_cheaper_is_taken():
    errors = {("auto", 1e-4): 0.005, ("auto", 1e-6): 0.001, ("dop853", 1e-6): 0.005}
    prices = {("auto", 1e-4): 2.15e-3, ("auto", 1e-6): 2.05e-3, ("dop853", 1e-6): 2e-3}
    assert made_up(errors, seconds=prices).recommendation(1e-3).point.rtol == 1e-6


def test_the_uncertainty_of_the_reference_counts_as_error():
    # 0.0085 + 0.002 is above 0.01, and the reference is known well enough to say so.
    errors = {("rodas4", 1e-4): 0.0085, ("rodas4", 1e-6): 0.0005}
    prices = {("rodas4", 1e-4): 1.0, ("rodas4", 1e-6): 2.0}
    advice = made_up(errors, uncertainty=0.002, seconds=prices).recommendation(1e-3)
    assert advice.point.rtol == 1e-6
    assert advice.errors["slider.vx"] == pytest.approx(0.0025)


def test_a_single_hit_is_luck():
    errors = {("rodas4", 1e-4): 0.001, ("rodas4", 1e-5): 0.05, ("rodas4", 1e-6): 0.002}
    prices = {("rodas4", 1e-4): 1.0, ("rodas4", 1e-5): 2.0, ("rodas4", 1e-6): 3.0}
    assert made_up(errors, seconds=prices).recommendation(1e-3).point.rtol == 1e-6
    del errors["rodas4", 1e-6]
    advice = made_up(errors, seconds=prices).recommendation(1e-3)
    assert advice.point is None and "that is luck" in str(advice)


def test_a_setting_that_failed_is_never_recommended():
    errors = {("rodas4", 1e-4): 0.001, ("rodas4", 1e-6): [0.0, 0.0, np.nan, np.nan]}
    status = {("rodas4", 1e-6): "max_steps"}
    prices = {("rodas4", 1e-4): 2.0, ("rodas4", 1e-6): 1.0}
    result = made_up(errors, seconds=prices, status=status)
    assert result.recommendation(1e-3).point.rtol == 1e-4
    assert result.recommendation(1e-3, until=0.01).point.rtol == 1e-4
    alone = made_up({("rodas4", 1e-6): errors["rodas4", 1e-6]}, status=status)
    assert alone.recommendation(1e-3).point is None
    assert "no run reached 30 ms" in str(alone.recommendation(1e-3))


def test_no_setting_is_said_with_the_nearest_and_with_what_is_possible():
    errors = {("rodas4", 1e-4): [0.0, 0.004, 0.5, 3.0], ("rodas4", 1e-6): [0.0, 1e-4, 0.004, 0.2]}
    advice = made_up(errors, seconds={("rodas4", 1e-6): 2.0}).recommendation(1e-3)
    assert advice.point is None and advice.errors["slider.vx"] == pytest.approx(0.2)
    assert str(advice) == (
        "no setting measured is accurate enough over all 30 ms; the nearest, rtol 1e-6 with rodas4, has "
        "slider.vx within 0.20 m/s; over the first 20 ms rtol 1e-6 with rodas4 is enough"
    )


def test_nothing_is_recommended_beyond_what_the_reference_knows():
    errors = {("rodas4", 1e-4): 0.001}
    result = made_up(errors, uncertainty=[0.0, 1e-6, 1e-3, 5.0])
    assert result.trusted_until == 0.03  # they part at that sample
    advice = result.recommendation(1e-3)
    assert advice.point is not None and advice.until == 0.02
    assert "over the first 20 ms" in str(advice) and "beyond, the reference" in str(advice)
    advice = result.recommendation(1e-3, until=0.03)
    assert advice.point is None and "ask for at most 20 ms" in str(advice)
    advice = made_up(errors, uncertainty=1.0).recommendation(1e-3)
    assert advice.point is None and "the reference itself is known only" in str(advice)


def test_a_demand_that_everything_meets_is_refused_or_said():
    errors = {("rodas4", 1e-4): 0.3, ("rodas4", 1e-6): 0.2}
    result = made_up(errors, seconds={("rodas4", 1e-6): 2.0})  # of a range of 10
    for vain in (1.5, {"slider.vx": 11.0}):
        with pytest.raises(ValueError, match=r"accuracy.* and <= 1"):
            result.recommendation(vain)
    advice = result.recommendation(0.05)
    assert advice.point.rtol == 1e-4
    assert "but off by more than 1 % of a range from 0 s on" in str(advice)
    assert "all settings measured are accurate enough" in str(advice)
    assert "all settings" not in str(result.recommendation(0.025))
    assert "off by more" not in str(made_up({("rodas4", 1e-4): 0.09}).recommendation(0.05))


def test_a_demand_that_nobody_can_meet_is_no_zero():
    errors = {("rodas4", 1e-4): [0.0, 0.0, 1e-3, 1e-3]}
    result = made_up(errors, uncertainty=[0.0, 0.0, 1e-6, 1e-5])
    advice = result.recommendation(1e-20)
    assert advice.point is None and advice.errors["slider.vx"] == 1e-5
    assert str(advice) == (
        "no setting: over all 30 ms the reference itself is known only with slider.vx within 1.0e-05 m/s"
    )
    # Until the first impact all runs are the same to the last bit: known to rounding, of a range of 10.
    early = result.recommendation(1e-12)
    assert early.until == 0.01 and early.errors["slider.vx"] == pytest.approx(1e-13)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"accuracy": 0.0}, "accuracy must be"),
        ({"accuracy": {"slider.v": 1.0}}, 'did you mean "slider.vx"'),
        ({"accuracy": {}}, "at least one output"),
        ({"until": 0.04}, "until must be"),
        ({"cost": "money"}, "cost must be one of"),
    ],
)
def test_wrong_wishes_are_named(options, words):
    with pytest.raises(ValueError, match=words):
        made_up({("rodas4", 1e-4): 0.0}).recommendation(**options)


def test_errors_below_the_uncertainty_are_bounds():
    assert format_error(3e-3, 1e-3) == "0.0030"
    assert format_error(2e-3, 1e-3) == "≤ 0.0030"
    assert format_error(0.0, 0.0) == "≤ 0"
    result = made_up({("rodas4", 1e-4): 1e-3, ("rodas4", 1e-6): 1e-6}, uncertainty=1e-6)
    assert "0.0010" in result.table() and "≤ 2.0e-06" in result.table()


def test_the_table_shows_the_time_that_the_reference_knows():
    result = made_up({("rodas4", 1e-4): [0.0, 0.002, 0.03, 4.0]}, uncertainty=[0.0, 1e-6, 1e-3, 5.0])
    assert "up to 30 ms: no error is known beyond" in str(result)
    # Parted at 30 ms: errors are also shown up to the sample before if that is not the end.
    longer = replace(
        result,
        t=np.append(TIMES, 0.04),
        points=tuple(replace(p, growth=np.append(p.growth, [[6.0]], axis=1)) for p in result.points),
        check=replace(result.check, growth=np.append(result.check.growth, [[7.0]], axis=1)),
    )
    assert "slider.vx [m/s] to 20 ms" in longer.table() and "0.030" in longer.table()


# --- plots ----------------------------------------------------------------------------------------------


def test_the_plot_has_a_line_for_every_method(swing):
    before = dict(mpl.rcParams)
    ax = Figure().subplots()
    assert swing.plot("bob.angular_velocity", ax=ax, cost="stages") is ax
    assert dict(mpl.rcParams) == before
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    assert "bob.angular_velocity" in ax.get_xlabel() and "[rad/s]" in ax.get_xlabel()
    assert ax.get_ylabel() == "stages [-]"
    for method in METHODS:
        (line,) = [line for line in ax.get_lines() if line.get_label() == method]
        points = [point for point in swing if point.method == method]
        np.testing.assert_array_equal(line.get_ydata(), [point.stats.stages for point in points])
        errors = [swing.error(point, "bob.angular_velocity") for point in points[:2]]
        np.testing.assert_array_equal(line.get_xdata()[:2], errors)
    with pytest.raises(KeyError, match="unknown column"):
        swing.plot("bob.speed")
    with pytest.raises(ValueError, match="cost must be one of"):
        swing.plot(cost="money")


def test_points_that_are_only_bounds_are_hollow():
    result = made_up({("rodas4", 1e-4): 1e-3, ("rodas4", 1e-6): 1e-6}, uncertainty=1e-6)
    ax = plot_costs.plot_tradeoff(result)
    hollow = [line for line in ax.get_lines() if line.get_markerfacecolor() == "white"]
    assert [line.get_xdata()[0] for line in hollow] == [pytest.approx(2e-6)]
    ax = plot_costs.plot_tradeoff(made_up({("rodas4", 1e-4): 0.0}, uncertainty=0.0))
    ax.figure.canvas.draw()  # an error of zero has a place as well


# --- studies --------------------------------------------------------------------------------------------


def faller(gravity):
    return cc.Scene(
        [cc.Body("block", 2.0, 0.1)],
        [cc.Prismatic("guide", "ground", "block", axis=(0.0, 1.0))],
        [cc.Gravity((0.0, -gravity))],
    )


@pytest.fixture(scope="module")
def fall():
    study = cc.Study(
        faller, {"gravity": cc.interval(9.81, rel=0.1)}, ["block.y", "block.vy"], duration=0.5, samples=21
    )
    return study.tradeoff(degrees=[1, 2], points=[3], holdout=50)


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
    assert "of degree 1 with 3 runs" in str(advice) and "100 % of 52 hold-out runs inside" in str(advice)
    sampled = replace(fall, points=tuple(point for point in fall if point.bounds == "sampled"))
    assert sampled.recommendation(0.01).point is None
    assert sampled.recommendation(0.2, containment=0.5).point.degree == 2
    # Too narrow by 1 - cos(pi / 6) and 1 - cos(pi / 4).
    text = str(sampled.recommendation(0.01, containment=0.5))
    assert "; the nearest: sampled bounds of degree 2 with 4 runs" in text and "13 % too narrow" in text
    with pytest.raises(ValueError, match="containment must be"):
        fall.recommendation(containment=1.5)


def test_an_output_that_does_not_change_is_no_obstacle():
    study = cc.Study(
        faller, {"gravity": cc.interval(9.0, 10.0)}, ["block.x", "block.y"], duration=0.5, samples=11
    )
    result = study.tradeoff(degrees=[1], points=[], holdout=5)
    assert result.reference_width[0] == 0.0 and math.isnan(result.points[0].width_error[0])
    assert result.recommendation().point.degree == 1


def test_a_motion_that_is_prescribed_has_no_error():
    crank = cc.Scene(
        [cc.Body("crank", 1.0, 0.1, center_of_mass=(0.1, 0.0))],
        [cc.Revolute("pivot", "ground", "crank")],
        [],
        [cc.Speed("motor", "pivot", 3.0)],
    )
    result = cc.tradeoff(crank, 1.0, 11, rtols=[1e-3, 1e-6], repeats=1)
    assert all(not point.growth.any() and np.all(point.horizon == math.inf) for point in result)
    assert result.recommendation().point is not None and "≤ 0" in str(result)
    constant = cc.tradeoff(crank, 1.0, 11, ["crank.angular_velocity"], rtols=[1e-3], repeats=1)
    assert "all outputs constant" in str(constant.recommendation())
    for made in (result, constant):
        made.plot().figure.canvas.draw()


def test_study_results_are_tables_plots_and_values(fall):
    lines = fall.table().splitlines()
    assert len(lines) == 2 + len(fall) == len(str(fall).splitlines())
    assert pickle.loads(pickle.dumps(fall)) == fall
    assert {len(column) for column in fall.to_dict().values()} == {len(fall)}
    ax = fall.plot("block.vy")
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels == ["interval", "polynomial", "sampled", "scan"]
    with pytest.raises(KeyError, match="unknown column"):
        fall.plot("block.v")


def test_settings_of_a_study_that_fail_stay_in_the_table(monkeypatch):
    study = cc.Study(faller, {"gravity": cc.interval(9.0, 10.0)}, ["block.y"], duration=0.5, samples=11)
    real = study.run_points

    def run_points(points, counts, degrees, bounds="range"):
        if degrees == (2,):
            raise SimulationError("max_steps", 0.1)
        return real(points, counts, degrees, bounds)

    monkeypatch.setattr(study, "run_points", run_points)
    result = study.tradeoff(degrees=[1, 2], points=[], holdout=5)
    assert [point.status for point in result] == ["done"] * 3 + ["max_steps"] * 3
    assert result.table().count("max_steps") == 3
    assert result.recommendation().point.degree == 1


def test_wrong_arguments_of_a_study_are_listed_together():
    study = cc.Study(faller, {"gravity": cc.interval(9.0, 10.0)}, ["block.y"], duration=0.5, samples=11)
    with pytest.raises(ValueError) as caught:
        study.tradeoff(degrees=[0], points="5", holdout=1, seed=-1)
    words = [line.split()[0] for line in str(caught.value).splitlines()]
    assert words == ["degrees[0]", "points", "holdout", "seed"]
    with pytest.raises(ValueError, match="must not both be empty"):
        study.tradeoff(degrees=[], points=[])
    wide = {name: cc.interval(1.0, 2.0) for name in "abcdefg"}
    many = cc.Study(lambda **given: faller(9.81), wide, ["block.y"], duration=0.5, samples=11)
    with pytest.raises(ValueError, match="at most 1000000 runs"):
        many.tradeoff(degrees=[9])


# --- the command ----------------------------------------------------------------------------------------


@pytest.fixture
def scene_file(tmp_path):
    file = tmp_path / "pendulum.json"
    file.write_text(pendulum().to_json())
    return str(file)


WORDS = ["--duration", "0.5", "--samples", "51", "--outputs", "bob.angle", "--rtols", "1e-4,1e-6"]


def test_the_command_prints_and_writes(scene_file, tmp_path, capsys):
    out = tmp_path / "made" / "here"
    assert cli.main(["tradeoff", scene_file, *WORDS, "--methods", "rodas4", "--out", str(out)]) == 0
    assert sorted(path.name for path in out.iterdir()) == ["tradeoff.md", "tradeoff.npz", "tradeoff.png"]
    assert (out / "tradeoff.png").read_bytes().startswith(b"\x89PNG")
    result = cc.Tradeoff.load(out / "tradeoff.npz")
    assert [(point.method, point.rtol) for point in result] == [("rodas4", 1e-4), ("rodas4", 1e-6)]
    assert result.scene == pendulum() and result.outputs == ("bob.angle",)
    markdown = (out / "tradeoff.md").read_text(encoding="utf-8")
    assert result.table() in markdown and f"Recommended: {result.recommendation()}" in markdown
    printed = capsys.readouterr()
    assert str(result) in printed.out and str(out) in printed.out and printed.err == ""


def test_the_papers_scene_as_json(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["--paper", "corrected", "--duration", "0.001", "--methods", "dop853", "--rtols", "1e-4"]
    assert cli.main(["tradeoff", *words, "--samples", "21", "--accuracy", "0.01", "--json"]) == 0
    captured = capsys.readouterr()
    numbers = json.loads(captured.out)
    assert captured.out.count("\n") == 1 and not list(tmp_path.iterdir())
    assert numbers["runs"]["method"] == ["dop853"] and numbers["runs"]["status"] == ["done"]
    assert set(numbers["reference"]["uncertainty"]) == {
        "slider.x",
        "slider.vx",
        "slider.ax",
        "wrist.penetration",
    }
    # A horizon that is not reached is null.
    assert numbers["runs"]["horizon slider.x"] == [None]


def test_nothing_half_written_is_left(scene_file, tmp_path, monkeypatch, capsys):
    def full_disk(*arguments, **options):
        raise OSError("no space left on device")

    monkeypatch.setattr(Figure, "savefig", full_disk)
    assert cli.main(["tradeoff", scene_file, *WORDS, "--out", str(tmp_path / "results")]) == 1
    assert "no space left" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["pendulum.json"]


def test_bad_arguments_of_the_command(scene_file, tmp_path, capsys):
    empty = tmp_path / "empty.json"
    empty.write_text("{")
    for words in (
        [scene_file],
        [scene_file, *WORDS, "--paper", "corrected"],
        [str(tmp_path / "none.json"), *WORDS],
        [scene_file, *WORDS, "--rtols", "1e-4,loose"],
        [scene_file, *WORDS, "--accuracy", "-1"],
        [scene_file, *WORDS, "--until", "2.0"],
        [scene_file, *WORDS, "--paper", "improved"],
    ):
        with pytest.raises(SystemExit) as stopped:
            cli.main(["tradeoff", *words])
        assert stopped.value.code == 2 and "usage: chebclear" in capsys.readouterr().err
    for words, message in (
        ([scene_file, *WORDS, "--outputs", "bob.angel"], 'did you mean "bob.angle"'),
        ([scene_file, *WORDS, "--methods", "euler"], "methods must be one of"),
        ([scene_file, *WORDS, "--samples", "1"], "samples must be"),
        ([str(empty), *WORDS], "is not valid JSON"),
    ):
        assert cli.main(["tradeoff", *words]) == 2
        captured = capsys.readouterr()
        assert message in captured.err and captured.out == ""


def test_a_reference_that_fails_ends_the_command(scene_file, monkeypatch, capsys):
    monkeypatch.setattr(sys.modules["chebclear.tradeoffs.of_scene"], "MAX_STEPS", 20)
    assert cli.main(["tradeoff", scene_file, *WORDS]) == 1
    captured = capsys.readouterr()
    assert "in the reference run" in captured.err and captured.out == ""


def test_many_outputs_share_one_picture():
    scene = cc.mechanisms.slider_crank()
    result = cc.tradeoff(scene, 0.001, 11, methods=["dop853"], rtols=[1e-3], repeats=1)
    assert len(tradeoff_output.figure(result).axes) == 4
