"""Runs whose first sample is not at zero: what they hold, and the times that results tell."""

import chebclear as cc
from refusals import refuses


def swing():
    body = cc.Body("bob", 1.0, 0.01, center_of_mass=(0.2, 0.0), points={"P": (0.0, 0.0)}, angle=-1.0)
    return cc.Scene([body], [cc.Revolute("pin", "ground", "bob.P")], [cc.Gravity((0.0, -9.81))])


def test_a_run_tells_the_times_of_its_samples():
    late = cc.simulate(swing(), duration=0.25, samples=6, outputs=["bob.angle"], skip=0.5)
    assert repr(late) == "<Trajectory: 1 columns of 6 samples from t = 0.5 s to t = 0.75 s, done>"
    more = cc.simulate(swing(), duration=0.25, samples=6, outputs=["bob.angle"], start=late.end)
    assert repr(more) == "<Trajectory: 1 columns of 6 samples from t = 0.75 s to t = 1 s, done>"
    failed = cc.simulate(
        swing(), duration=0.25, samples=6, outputs=["bob.angle"], max_steps=1, on_failure="return"
    )
    assert repr(failed).endswith(f"to t = 0.25 s, max_steps at {failed.end_time:g} s>")


def test_a_tradeoff_tells_the_times_of_its_samples():
    result = cc.tradeoff(
        swing(), duration=0.25, samples=6, outputs=["bob.angle"], rtols=[1e-6, 1e-8], repeats=1, skip=0.5
    )
    assert result.duration == 0.25 and result.end == result.trusted_until == result.t[-1] == 0.75
    assert repr(result) == "<Tradeoff: 10 runs from t = 0.5 s to t = 0.75 s, bob.angle>"
    advice = result.recommendation(1e-3)
    assert advice.until == 0.75 and "over all 250 ms" in str(advice)
    shorter = result.recommendation(1e-3, until=0.6)
    assert "over the first 100 ms" in str(shorter)
    for wrong in (0.5, 0.76):
        with refuses("until", error=ValueError):
            result.recommendation(1e-3, until=wrong)
