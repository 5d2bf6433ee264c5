"""Studies at their limits: too few runs, outputs that do not change, files that are damaged."""

import warnings

import chebclear as cc
import numpy as np
import pytest
from refusals import refuses

T = np.linspace(0.0, 1.0, 40)
BOX = {"a": cc.Interval.around(1.0, rel=0.1), "b": cc.Interval.around(2.0, rel=0.1)}


def waves(a, b):
    """Only `a` has an effect, and impacts nothing resolves."""
    return {"t": T, "x": np.sin(400.0 * a * T), "top": a}


def constant(a, b):
    return {"t": T, "x": np.full(40, 0.1), "top": 0.1}


def test_too_few_runs_say_which_statement_falls():
    study = cc.Study(waves, BOX)
    with pytest.warns(cc.ChebclearWarning):
        few = study.band(3)
    assert few["x"].verdict == "too few runs"
    assert [one.numbers["needed"] > 100 for one in few.notices if one.code == "too_few_runs"] == [True]
    for ask in (
        lambda: study.band(2),
        lambda: few.ranking("top"),
        lambda: study.band(coverage=0.99999, confidence=0.95),
        lambda: study.band(41, coverage=0.95, confidence=0.95),
        lambda: study.band(81, max_runs=10),
        lambda: study.band(max_runs=10),
        lambda: study.band(seconds=0.0),
        lambda: study.sample(1),
        lambda: cc.Study(lambda a, b: {"t": T, "x": 1e299 * a * T}, BOX).band(9),  # no square
    ):
        with pytest.raises(cc.errors.ArgumentError):
            ask()
    with refuses("max_runs", error=TypeError):
        study.band(max_runs="x")


def test_runs_that_failures_leave_too_few_are_refused_with_the_failure():
    def picky(a, b):
        if a > 1.0:
            raise RuntimeError("too long")
        return {"t": T, "x": a * T}

    study = cc.Study(picky, BOX)
    found = set()
    for seed in range(8):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", cc.ChebclearWarning)
                assert study.band(4, rng=seed).requirement.runs >= 3
        except (cc.errors.ArgumentError, RuntimeError) as error:  # of the model, if most runs failed
            assert "too long" in str(error)
            found.add(type(error))
    assert cc.errors.ArgumentError in found


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_feature_of_two_runs_has_an_interval():
    def noisy(a, b):
        return {"t": T, "x": np.sin(1e3 * a * T), "top": np.sin(1e3 * a)}

    result = cc.Study(noisy, BOX, features={"peak": cc.features.peak("x")}).sample(2)
    for name in ("top", "peak"):
        reach = result.features[name].interval
        assert reach.lower < reach.upper and not reach.resolved


@pytest.mark.parametrize("ask", ["band", "chebyshev", "scan", "sample"])
def test_outputs_that_do_not_change_have_no_width_and_no_effects(ask):
    result = getattr(cc.Study(constant, BOX), ask)()
    assert result["x"].max_width <= 1e-13
    assert result["x"].verdict in ("proved", "estimated", "unknown")
    reach = result.features["top"].interval
    assert (reach.lower, reach.upper) == (0.1, 0.1)
    ranking = result.ranking("top")
    assert np.isnan(ranking.scatter.upper) and all(str(row.share) == "unknown" for row in ranking)
    assert ranking.advice() == ("top is the same in every run: what would change it is unknown",)


@pytest.mark.parametrize("ask", ["band", "chebyshev", "scan"])
@pytest.mark.filterwarnings("ignore:not resolved")
def test_a_parameter_without_effect_is_said_not_to_help(ask):
    result = getattr(cc.Study(waves, BOX), ask)()
    advice = result.ranking("top").advice()
    assert any(line.startswith("tightening b does not help: 100 %") for line in advice)
    assert result.features["top"].effects.monotone == {"a": "rises"}


def test_two_samples_are_enough():
    study = cc.Study(lambda a, b: {"t": [0.0, 1.0], "x": [a, b]}, BOX)
    for result in (study.band(12), study.chebyshev(2), study.scan(3)):
        assert np.allclose(result["x"].upper, [1.1, 2.2])


def test_thousands_of_outputs_are_told_in_a_few_lines():
    names = [f"x{index}" for index in range(2000)]
    study = cc.Study(lambda a, b: {"t": T[:3]} | {name: a * T[:3] for name in names}, BOX)
    result = study.band(12)
    assert len(result.outputs) == 2000 and len(str(result)) + len(repr(result)) < 4000


def test_whether_runs_are_independent_is_true_or_false():
    with refuses("independent", error=TypeError):
        cc.Study.from_runs({"a": [1.0, 2.0, 3.0]}, None, {"y": [1.0, 2.0, 3.0]}, independent=np.zeros(3))
