"""The error estimate of a run by companion runs: closed forms, chaotic runs, what it warns of."""

import copy
import json
import math
import pickle
import warnings
from dataclasses import replace

import chebclear as cc
import numpy as np
import pytest
from chebclear.run.accuracy import chaos_horizon, output_ranges
from chebclear.run.settings import METHODS
from chebclear.scene.scene import compiled
from pendulum import LOWEST_ANGLE, LOWEST_SPEED, OUTPUTS, pendulum, quarter_period
from refusals import refuses


def test_horizon_is_the_first_sample_beyond_the_threshold():
    t = np.linspace(0.0, 1.0, 11)
    difference = np.zeros((11, 4))
    difference[3, 0], difference[4, 0] = -0.02, 0.0  # parts for one sample only
    difference[:, 1] = 0.01  # just at the threshold
    difference[7:, 2] = np.nan  # a run that failed has not diverged
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
    # A constant output has diverged when it differs by more than the rounding of its kind.
    np.testing.assert_allclose(thresholds, [1e-3, 1e-10 * 0.17, 1e-10 * 5.0, 2e-5], rtol=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_the_estimate_is_the_error_against_the_closed_form(method):
    run = cc.simulate(
        pendulum(),
        duration=quarter_period(),
        samples=2,
        rtol=1e-5,
        method=method,
        outputs=OUTPUTS,
        error="estimate",
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
    run = cc.simulate(
        scene, duration=0.01, samples=401, rtol=1e-3, method="rodas5p", outputs=outputs, error="estimate"
    )
    plain = cc.simulate(scene, duration=0.01, samples=401, rtol=1e-3, method="rodas5p", outputs=outputs)
    assert plain.error is None and run != plain and replace(run, error=None) == plain
    # Against the truth, and not only against runs that may share its error.
    true = cc.simulate(scene, duration=0.01, samples=401, rtol=1e-11, outputs=outputs)["wrist.normal_force"]
    force = run.error["wrist.normal_force"]
    error = np.abs(run["wrist.normal_force"] - true)
    assert 0.5 * error.max() < force.max_difference < 2.0 * error.max()
    first = np.flatnonzero(error > 0.01 * np.ptp(true))[0]
    assert 0.5 * run.t[first] < force.horizon < 2.0 * run.t[first] and force.diverged
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
    run = cc.simulate(pendulum(), duration=1.0, samples=101, outputs=OUTPUTS, on_failure="return", **short)
    assert run.status == run.error.status == "max_steps"
    assert 0.0 < run.error.compared_until < run.end_time
    assert run.error["bob.angle"].max_difference < 1e-6
    with pytest.raises(cc.errors.SimulationError):
        cc.simulate(pendulum(), duration=1.0, samples=101, **short)


def test_the_companion_runs_tighten_tolerances_that_were_set():
    own = {"position_tolerance": 1e-4, "velocity_tolerance": 1e-2}
    run = cc.simulate(pendulum(), duration=0.5, samples=51, outputs=OUTPUTS, error="estimate", **own)
    error = np.abs(
        run.samples - cc.simulate(pendulum(), duration=0.5, samples=51, rtol=1e-11, outputs=OUTPUTS).samples
    )
    # What these tolerances leave is far above what the rtol alone would.
    assert np.all(error.max(axis=0) > 1e-6)
    np.testing.assert_array_less(np.abs(run.error.max_difference / error.max(axis=0) - 1.0), 0.5)
    finer = run.settings.tightened(10.0)
    assert (finer.position_tolerance, finer.velocity_tolerance) == pytest.approx((1e-5, 1e-3))


@pytest.mark.parametrize(
    ("change", "words"), [({"error": "bound"}, '"estimate"'), ({"rtol": 5e-12}, "rtol >= 1e-11")]
)
def test_wrong_requests_for_an_estimate(change, words):
    with refuses("error", error=ValueError):
        cc.simulate(pendulum(), duration=1.0, samples=11, **({"error": "estimate"} | change))


def test_companions_take_steps_of_their_own_where_no_tolerance_binds():
    # So short and smooth that the method of order 8 does the same at a tenth of the tolerance.
    given = {"scene": pendulum(), "duration": 0.5 * quarter_period(), "samples": 2, "method": "dop853"}
    loose, tenth, tight = (cc.simulate(**given, rtol=rtol, outputs=OUTPUTS) for rtol in (1e-5, 1e-6, 1e-11))
    assert np.array_equal(loose.samples, tenth.samples)
    run = cc.simulate(**given, rtol=1e-5, outputs=OUTPUTS, error="estimate")
    found, error = run.error.max_difference, np.abs(run.samples - tight.samples)[-1]
    assert np.all((0.8 * error < found) & (found < 10.0 * error))
    # Nothing is integrated where the drives prescribe everything: there is no error.
    crank = cc.Scene(
        [cc.Body("crank", 1.0, 0.1)],
        [cc.Revolute("pivot", "ground", "crank")],
        [],
        [cc.motions.Speed("m", "pivot", 3.0)],
    )
    turn = cc.simulate(crank, duration=1.0, samples=11, outputs=["crank.angle"], error="estimate").error
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
            contact=cc.laws.Flores(1e10, 0.9),
            friction=cc.laws.ModifiedCoulomb(0.3, 0.225, 1e-3, 1.5e-3),
        ),
        0.01,
        4.4e-4,
    ),
]


@pytest.mark.filterwarnings("ignore:joint .* it slides slower")
@pytest.mark.parametrize(("scene", "duration", "rtol"), CAPPED, ids=["slow crank", "two pins"])
def test_companions_are_more_accurate_where_contacts_bind_the_tolerances(scene, duration, rtol):
    run, true = (
        cc.simulate(scene, duration=duration, samples=101, outputs=["slider.vx"], **other)
        for other in ({"rtol": rtol, "error": "estimate"}, {"rtol": 1e-10})
    )
    error = np.abs(run["slider.vx"] - true["slider.vx"]).max()
    # 1.00 and 1.01; a run at a tenth of the rtol alone differs by 0.10 and 0.16 errors.
    assert 0.5 * error < run.error["slider.vx"].max_difference < 2.0 * error


def test_a_companion_that_fails_ends_what_is_estimated():
    scene, given = cc.mechanisms.slider_crank(), {"rtol": 1e-5, "outputs": ["slider.vx"], "error": "estimate"}
    steps = cc.simulate(scene, duration=0.004, samples=41, rtol=1e-5).stats
    limit = int(1.1 * (steps.steps + steps.rejected))
    run = cc.simulate(scene, duration=0.004, samples=41, max_steps=limit, **given)
    assert run.success and run.error.status == "max_steps"
    estimate = run.error["slider.vx"]
    assert 0.0 < estimate.horizon == run.error.compared_until < 0.004 and not estimate.diverged
    assert estimate.in_words() == (
        f"did not diverge until {estimate.horizon:.4g} s, where a companion run ended"
    )


def test_progress_of_all_runs_grows_from_0_to_1(monkeypatch):
    simulated = []
    scene = pendulum()
    mechanism = compiled(scene)

    class Reporting:
        def simulate(self, settings, report, start):
            for share in (0.0, 0.5, 1.0):
                report(share)
            simulated.append(json.loads(settings)["rtol"])
            return mechanism.simulate(settings)

    monkeypatch.setattr(cc.run.simulation, "compiled", lambda scene: Reporting())
    shares = []
    cc.simulate(scene, duration=0.5, samples=11, error="estimate", progress=shares.append)
    assert shares == sorted(shares) and (shares[0], shares[-1]) == (0.0, 1.0) and len(shares) == 9
    assert simulated == [1e-6, pytest.approx(1e-7), pytest.approx(1e-8)]


def test_each_warning_comes_once():
    # Restitution below 0.85, and a floor above every impact velocity; the companion run repeats both.
    contact = {"restitution": 0.5, "impact_velocity_floor": 100.0}
    scene = cc.mechanisms.slider_crank(**contact)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run = cc.simulate(scene, duration=0.002, samples=21, error="estimate")
    messages = [str(warning.message) for warning in caught]
    assert messages == list(run.warnings)
    assert sorted(notice.code for notice in run.notices) == ["impacts_at_floor", "law_out_of_range"]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = cc.tradeoff(
            scene, duration=0.002, samples=21, outputs=["slider.x"], rtols=[1e-3, 1e-4], repeats=1
        )
    assert [str(warning.message) for warning in caught] == list(result.warnings) == messages
    assert {warning.filename for warning in caught} == {__file__}


@pytest.mark.parametrize("friction", [1.0, 0.04, None])
def test_a_contact_that_creeps_is_warned_of_once(friction):
    law = None if friction is None else cc.laws.ModifiedCoulomb(friction, 0.75 * friction, 1e-3, 1.5e-3)
    scene = cc.mechanisms.slider_crank(friction=law)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        run = cc.simulate(
            scene, duration=0.03, samples=3001, outputs=["wrist.contact", "wrist.sliding_velocity"]
        )
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
