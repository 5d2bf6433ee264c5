"""Rare shares of mechanisms by splitting: what is counted, what is refused, and that runs repeat to the last
bit."""

import math
import pickle
import time
from concurrent.futures import ThreadPoolExecutor
from statistics import NormalDist

import chebclear as cc
import numpy as np
import pytest


def play(gap, thread):
    return {"play": gap - thread, "waste": gap + thread}


SIDES = {"gap": cc.normal(10.1, 0.02), "thread": cc.normal(10.0, 0.015)}
TRUTH = NormalDist(0.1, 0.025).cdf(0.0)
LOW = cc.require("play", above=0.0)
QUICK = {"factor": 2.0, "plain": 1000}


def study(build=play, sides=SIDES, **options):
    return cc.Study(build, sides, **options)


@pytest.fixture(scope="module")
def found():
    return cc.rare_share(study(), LOW, **QUICK)


def test_a_share_of_a_closed_form_is_known(found):
    assert found.verdict == "known" and found.lower < TRUTH < found.upper
    assert found.ppm == 1e6 * found.share and found.runs < 25_000
    assert len(found.systems) == 8 and found.inflation < 5.0
    assert "of a million outside" in str(found) and "none of 1000 plain runs outside" in str(found)
    assert np.all(found.mechanisms[:, 0] <= found.mechanisms[:, 1])


def test_why_they_fail_is_the_nearest_failing_point(found):
    """The likeliest failing mechanism is at 4 standard deviations: 3.2 of gap and 2.4 of thread; the failing
    lie a
    quarter of one beyond."""
    gap, thread = found.causes
    assert (gap.name, thread.name) == ("gap", "thread")
    beyond = NormalDist().pdf(4.0) / TRUTH  # mean of the normal variable along the direction
    assert gap.score == pytest.approx(-0.8 * beyond, abs=0.35) and not gap.is_two_sided
    assert thread.score == pytest.approx(0.6 * beyond, abs=0.35)
    assert found.why.startswith("They fail because gap is 3") and "too small and thread" in found.why


def test_slopes_over_means_and_deviations_are_those_of_the_closed_form(found):
    beyond = NormalDist().pdf(4.0) / TRUTH
    gap = found.causes[0]
    truth = {"mean": -0.8 * beyond / 0.02, "standard_deviation": 0.64 * 4.0 * beyond / 0.02}
    for name, slope in truth.items():
        assert abs(gap.slopes[name] - slope) < 4.5 * gap.slope_errors[name]
        assert gap.slope_errors[name] < 0.1 * abs(slope)


def test_two_ways_to_fail_are_said_with_examples():
    wide = cc.require("play", above=0.0, below=0.2)
    found = cc.rare_share(study(), wide, **QUICK)
    assert found.lower < 2.0 * TRUTH < found.upper
    if found.causes[0].is_two_sided:
        assert "too large or too small" in found.why and "examples" in found.why
    assert found.causes[0].distance > 2.5 and len(found.examples) == 3


def test_the_same_seed_gives_the_same_bits(found, tmp_path):
    with ThreadPoolExecutor(3) as pool:
        sent = cc.rare_share(study(executor=pool), LOW, runs=4000, **QUICK)
    here, other = (cc.rare_share(study(), LOW, runs=4000, rng=rng, **QUICK) for rng in (0, 1))
    assert sent == here != other
    path = found.save(tmp_path / "rare.npz")
    assert cc.load_result(path) == found == pickle.loads(pickle.dumps(found))


def test_an_interrupted_answer_resumes_from_the_store(tmp_path):
    calls = 0

    def counted(gap, thread):
        nonlocal calls
        calls += 1
        if calls == 1500:
            raise KeyboardInterrupt
        return {"play": gap - thread}

    options = {"store": tmp_path / "store", "version": "1"}
    small = {"factor": 2.0, "plain": 1000, "at_once": 96, "runs": 4000}
    with pytest.raises(KeyboardInterrupt):
        cc.rare_share(study(counted, **options), cc.require("play", above=0.02), **small)
    again = cc.rare_share(study(counted, **options), cc.require("play", above=0.02), **small)
    whole = cc.rare_share(study(counted), cc.require("play", above=0.02), **small)
    assert again == whole and calls < 2 * whole.runs + 700


def test_threads_of_a_scene_do_not_matter():
    sides = {"crank_length": cc.normal(0.05, 2e-5), "rod_length": cc.normal(0.12, 5e-5)}
    options = {"fixed": {"clearance_at": ()}, "duration": 1e-4, "samples": 2, "outputs": ["slider.x"]}
    limit = cc.require("slider.x", below="170.14 mm")
    one, other = (
        cc.rare_share(
            cc.Study(cc.mechanisms.slider_crank, sides, threads=threads, **options), limit, runs=2000, **QUICK
        )
        for threads in (1, 2)
    )
    assert one == other and not one.has_play and one.runs <= 2000


def test_islands_and_tolerances_are_named():
    sides = {"crank_length": cc.normal(0.05, 2e-5), "clearance": cc.uniform(1e-5, 4e-5)}
    crank = cc.Study(cc.mechanisms.slider_crank, sides, ["slider.x"], duration=1e-4, samples=2, rtol=1e-2)
    with pytest.warns(cc.ChebclearWarning, match="nearer to the limits than the tolerance"):
        found = cc.rare_share(
            crank, cc.require("slider.x", below="170.1 mm"), runs=1100, factor=2.0, plain=500
        )
    assert found.has_play and found.verdict == "below" and found.reason == "runs"
    assert "Islands" in str(found)


def test_frequent_failures_are_counted():
    found = cc.rare_share(study(), cc.require("play", above=0.09), plain=1000, factor=2.0)
    assert (found.verdict, found.reason, found.runs) == ("known", "counted", 1000)
    counted = cc.conformance(study(), cc.require("play", above=0.09), 1000)
    assert (found.lower, found.upper) == (
        1.0 - counted["play above 0.09"].upper,
        1.0 - counted["play above 0.09"].lower,
    )
    always = cc.rare_share(study(), cc.require("play", above=9.0), plain=500, factor=2.0)
    assert always.share == always.upper == 1.0 and "plain runs outside" in str(always)


def test_no_more_runs_than_asked_for():
    found = cc.rare_share(study(), LOW, runs=5000, **QUICK)
    assert (found.verdict, found.reason) == ("below", "runs") and found.runs <= 5000
    assert math.isnan(found.share) and found.lower == 0.0 and TRUTH < found.upper < 0.0037
    assert "below" in str(found) and "did not go further" in str(found)


def test_time_ends_an_answer():
    slow = study(lambda gap, thread: {"play": gap - thread}, max_seconds=1e-6)
    found = cc.rare_share(slow, LOW, **QUICK)
    assert (found.verdict, found.reason, found.runs) == ("below", "seconds", 500)


def test_failures_count_as_outside_and_are_named():
    """A mechanism that cannot be built beyond 3 standard deviations."""

    def fragile(x):
        if x > 3.0:
            raise ValueError("does not fit")
        return {"y": x}

    truth = NormalDist().cdf(-3.0)
    with pytest.warns(cc.ChebclearWarning, match="what is rare is that a run fails"):
        found = cc.rare_share(
            study(fragile, {"x": cc.normal(0.0, 1.0)}), cc.require("y", below=4.5), rng=1, **QUICK
        )
    assert found.lower < truth < found.upper
    assert {one.code for one in found.notices} >= {"failed", "rare_failures"}


def test_time_limits_of_runs_depend_on_the_machine():
    def stuck(x):
        time.sleep(1.0 if x > 2.5 else 0.0)
        return {"y": x}

    with pytest.warns(cc.ChebclearWarning, match="depends on the machine"):
        cc.rare_share(
            study(stuck, {"x": cc.normal(0.0, 1.0)}, run_seconds=0.1),
            cc.require("y", below=5.0),
            runs=1000,
            **QUICK,
        )


def test_several_requirements_are_one_share():
    wide = {"play": LOW, "waste": cc.require("waste", below=20.2)}
    truth = 2.0 * TRUTH  # the sum is independent of the difference but for the unequal deviations
    found = cc.rare_share(study(), wide, **QUICK)
    assert found.name == "all" and found.lower < truth < found.upper and str(found).startswith("all: ")
    required = study(requirements=wide)
    assert cc.rare_share(required, **QUICK) == found


def test_intervals_are_tried_at_their_corners():
    sides = {"gap": cc.normal(10.1, 0.02), "thread": cc.normal(10.0, 0.015), "shift": cc.Interval(0.0, 0.01)}

    def shifted(gap, thread, shift):
        return {"play": gap - thread - shift}

    found = cc.rare_share(study(shifted, sides), LOW, **QUICK)
    worst = NormalDist(0.09, 0.025).cdf(0.0)
    assert len(found.at) == 3 and found.lower < TRUTH and worst < found.upper
    assert found.upper == found.intervals[2, 1] and "corners of shift" in str(found)


def test_yes_or_no_is_refused():
    found = cc.rare_share(study(lambda gap, thread: {"play": float(gap > thread)}), LOW, **QUICK)
    assert (found.verdict, found.reason) == ("unknown", "yes or no") and math.isnan(found.ppm)
    assert "tells only whether" in str(found) and found.upper < 0.004


def test_scatter_is_refused_and_says_what_is_sure():
    def scattered(x, z):
        hashed = 43758.5453 * math.sin(1e7 * (x + math.sqrt(2.0) * z))
        return {
            "y": NormalDist().inv_cdf(min(max(hashed - math.floor(hashed), 1e-12), 1.0 - 1e-12)) + 0.1 * x
        }

    sides = {"x": cc.normal(0.0, 1.0), "z": cc.normal(0.0, 1.0)}
    found = cc.rare_share(study(scattered, sides), cc.require("y", below=4.5), **QUICK)
    assert (found.verdict, found.reason) == ("unknown", "scatter")
    assert "impacts decide" in str(found) and found.upper == pytest.approx(
        1.0 - 0.025 ** (1.0 / 1000.0), rel=0.6
    )
    assert found.causes == () and found.why == ""


def test_bad_input_is_said_all_at_once():
    three = {name: cc.Interval(0.0, 1.0) for name in ("a", "b", "c")}
    many = cc.Study(lambda x, a, b, c: {"y": x}, {"x": cc.normal(0.0, 1.0), **three})
    with pytest.raises(cc.errors.ArgumentError) as raised:
        cc.rare_share(
            many, cc.require("y", below="1 m"), runs=3, factor=1.0, plain=7, confidence=0.2, at_once=0
        )
    named = {one.path for one in raised.value.problems}
    assert named >= {"runs", "factor", "plain", "confidence", "at_once", "study"}
    with pytest.raises(cc.errors.ArgumentError, match="at least 1000"):
        cc.rare_share(study(), LOW, runs=900, **QUICK)
    with pytest.raises(cc.errors.ArgumentError):
        cc.rare_share(study())
