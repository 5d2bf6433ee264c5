"""Nominal values at no cost: closed forms of normal shares, fresh draws, and where there is no better."""

import copy
import math
import pickle
from statistics import NormalDist

import chebclear as cc
import numpy as np
import pytest
from refusals import refuses

PHI = NormalDist().cdf
WIDE = cc.Interval(-10.0, 10.0)


def itself(x):
    return {"y": x}


def unit(build=itself, **parameters):
    return cc.Study(build, parameters or {"x": cc.normal(0.0, 1.0)})


def test_two_sided_limits_are_centered():
    """Limits -3 and 5: by +1, from 1.35018e-3 outside to 6.33425e-5."""
    found = cc.center(unit(), cc.require("y", above=-3.0, below=5.0), move={"x": WIDE}, runs=20_000)
    assert found["x"].after == pytest.approx(1.0, abs=0.01) and found["x"].end == ""
    assert found["x"].deviation == pytest.approx(1.0) and found["x"].distance == found["x"].after
    assert found.status == "better" and found.settled
    share = found.share
    for truth, (low, high) in (
        (1.35018e-3, share.before_between),
        (6.33425e-5, share.after_between),
    ):
        assert low < 1.0 - truth < high
    assert found.parameters["x"].mean == found["x"].after
    assert found.parameters["x"].standard_deviation == 1.0
    assert "better: moving x by 1.00, at no cost" in str(found)


def test_the_shares_are_those_of_fresh_draws():
    """The intervals hold the truth of the center found in nearly all repetitions: not of the draws that
    chose it."""
    held = 0
    for seed in range(40):
        limits = cc.require("y", above=-1.0, below=2.0)
        found = cc.center(unit(), limits, move={"x": WIDE}, runs=200, rng=seed)
        after = found["x"].after
        low, high = found.share.after_between
        held += low <= PHI(2.0 - after) - PHI(-1.0 - after) <= high
    assert held >= 34


def test_a_centered_design_is_no_better():
    for limit in (3.0, 1.0):
        requirement = cc.require("y", above=-limit, below=limit)
        found = cc.center(unit(), requirement, move={"x": WIDE}, runs=500)
        assert found.status == "no better" and found["x"].distance == 0.0 and found.needed == 0
        assert found.parameters["x"] == cc.normal(0.0, 1.0)
        share = found.share
        assert share.only_before == share.only_after == 0 and share.better is None and share.p_value == 1.0
        assert str(found).startswith("no better")


def test_a_single_limit_ends_at_what_may_move():
    found = cc.center(unit(), cc.require("y", below=2.0), move={"x": cc.Interval(-1.5, 4.0)}, runs=1000)
    assert found["x"].after == -1.5 and found["x"].end == "lower" and found.status == "better"
    assert "x at its lower end" in str(found)
    low, high = found.share.after_between
    assert low < PHI(3.5) < high


def test_far_limits_are_reached_over_several_models():
    found = cc.center(unit(), cc.require("y", above=4.0, below=8.0), move={"x": WIDE}, runs=1000)
    assert found["x"].after == pytest.approx(6.0, abs=0.05) and found.settled
    assert found.share.before < 0.01 and found.share.after_between[0] < PHI(2.0) - PHI(-2.0)
    beyond = cc.center(
        unit(), cc.require("y", above=28.0, below=32.0), move={"x": cc.Interval(-40.0, 40.0)}, runs=50
    )
    assert not beyond.settled and "go on from those found" in str(beyond)


def test_a_sum_of_three_lengths_moves_along_its_slopes():
    """The margin moves by -1 into the middle of the limits, by the least distance in standard deviations."""
    slopes, spreads = np.array([1.0, -2.0, 0.5]), np.array([1.0, 0.5, 2.0])
    study = unit(
        lambda a, b, c: {"y": a - 2.0 * b + 0.5 * c},
        **{name: cc.normal(0.0, float(s)) for name, s in zip("abc", spreads, strict=True)},
    )
    limits = cc.require("y", above=-4.0, below=2.0)
    found = cc.center(study, limits, move=dict.fromkeys("abc", WIDE), runs=2000)
    moved = np.array([one.distance for one in found.values()])
    assert slopes @ moved == pytest.approx(-1.0, abs=0.02)
    np.testing.assert_allclose(moved / spreads, -slopes * spreads / 3.0, atol=0.02)
    deviation = math.sqrt(3.0)
    low, high = found.share.after_between
    assert low < PHI(3.0 / deviation) - PHI(-3.0 / deviation) < high and found.status == "better"
    # What is not listed does not move.
    alone = cc.center(study, limits, move={"b": WIDE}, runs=400)
    assert alone["b"].distance == pytest.approx(0.5, abs=0.02)
    assert alone.parameters["a"] == cc.normal(0.0, 1.0)


def test_a_bent_response_and_several_requirements():
    bent = cc.center(
        unit(lambda x: {"y": x * x}, x=cc.normal(0.7, 1.0)), cc.require("y", below=4.0), move={"x": WIDE}
    )
    assert bent["x"].after == pytest.approx(0.0, abs=0.03) and bent.status == "better"
    optimize = pytest.importorskip("scipy.optimize")
    # One of the two may move no further than the other pays for.
    study = cc.Study(
        lambda a, b: {"u": a, "v": b + 2.0, "w": a + b},
        {"a": cc.normal(0.0, 1.0), "b": cc.normal(0.0, 1.0)},
    )
    limits = {
        "u": cc.require("u", above=-1.0, below=2.5),
        "v": cc.require("v", below=3.5),
        "w": cc.require("w", above=-2.0),
    }
    found = cc.center(study, limits, move={"a": WIDE, "b": WIDE}, runs=2000)
    scores = np.random.default_rng(1).standard_normal((400_000, 2))

    def outside(centers):
        a, b = (scores + centers).T
        return np.mean((a <= -1.0) | (a >= 2.5) | (b >= 1.5) | (a + b <= -2.0))

    best = optimize.minimize(outside, [0.5, -0.5], method="Nelder-Mead", options={"xatol": 1e-3}).fun
    here = outside([one.after for one in found.values()])
    assert list(found.shares) == ["u", "v", "w", "all"] and found.share.name == "all"
    assert outside([0.0, 0.0]) > 1.2 * best and here < 1.02 * best


def test_parameters_that_are_only_intervals_take_all_their_corners():
    """y = x + u, u from -0.5 to 0.5: as limits -2.5 and 3.5 of x alone."""
    study = unit(lambda x, u: {"y": x + u}, x=cc.normal(0.0, 1.0), u=cc.Interval(-0.5, 0.5))
    found = cc.center(study, cc.require("y", above=-3.0, below=4.0), move={"x": WIDE}, runs=4000)
    assert found["x"].after == pytest.approx(0.5, abs=0.03)
    for truth, (low, high) in (
        (PHI(3.5) - PHI(-2.5), found.share.before_between),
        (PHI(3.0) - PHI(-3.0), found.share.after_between),
    ):
        assert low < truth < high


def test_nominal_values_of_other_distributions():
    optimize = pytest.importorskip("scipy.optimize")
    stiff = cc.lognormal(10.0, 2.0)
    found = cc.center(
        unit(x=stiff), cc.require("y", above=9.0, below=16.0), move={"x": cc.Interval(5.0, 20.0)}
    )
    after = found.parameters["x"]
    assert after.interval.nominal == pytest.approx(found["x"].after, rel=1e-12)
    assert after.standard_deviation == 2.0

    def outside(mean):
        one = cc.lognormal(float(mean), 2.0)
        return 1.0 - one.cdf(16.0) + one.cdf(9.0)

    best = optimize.minimize_scalar(outside, bounds=(8.0, 16.0), method="bounded").fun
    assert outside(after.mean) < 1.02 * best
    # A uniform one of half width 1 fits in wider limits: none outside, as soon as it is inside of them.
    flat = cc.center(
        unit(x=cc.uniform(0.0, 2.0)), cc.require("y", above=0.5, below=2.7), move={"x": WIDE}, runs=1000
    )
    assert flat["x"].after == pytest.approx(1.6, abs=0.11) and flat.share.after == 1.0
    assert flat.status == "better" and "leaves none of the fresh runs outside" in str(flat)


def test_scatter_has_no_better_nominal_values():
    better = 0
    for seed in range(10):
        study = unit(lambda x: {"y": math.sin(1e7 * x)})
        found = cc.center(study, cc.require("y", below=0.9), move={"x": WIDE}, runs=400, rng=seed)
        better += found.status == "better"
    assert better <= 1


def test_what_few_runs_cannot_show_is_unproven():
    limits = cc.require("y", above=-3.0, below=5.0)
    found = cc.center(unit(), limits, move={"x": WIDE}, runs=1500, rng=2)
    assert found.status == "unproven" and found.share.p_value > 0.05
    # Eight that differ, of 1.287e-3: 6200; the polynomial tells it from few runs.
    assert found.needed == pytest.approx(6500, rel=0.4) and str(found.needed) in str(found)
    # Nominal values that look better are kept, those that are not are left.
    assert found.parameters["x"].mean == found["x"].after
    again = cc.center(unit(), limits, move={"x": WIDE}, runs=4 * found.needed)
    assert again.status == "better"


def test_rare_shares_show_what_counting_cannot():
    """Limits -3.7 and 5.5: from 1.078e-4 outside to 2 Phi(-4.6) = 4.22e-6, of which 300 runs see nothing."""
    limits = cc.require("y", above=-3.7, below=5.5)
    blind = cc.center(unit(), limits, move={"x": WIDE}, runs=300)
    assert blind.status == "unproven" and blind.share.only_after == 0 and blind.rare is None
    found = cc.center(unit(), limits, move={"x": WIDE}, runs=300, rare=True)
    assert found.status == "better" and found["x"].after == pytest.approx(0.9, abs=0.02)
    before, after = found.rare
    assert before.lower < PHI(-3.7) + PHI(-5.5) < before.upper
    assert after.lower < 2.0 * PHI(-4.6) < after.upper < before.lower
    assert found.parameters["x"].mean == found["x"].after
    assert "before: y" in str(found) and "of a million outside" in str(found)
    assert found.runs > before.runs + after.runs > 20_000
    with refuses("rare"):
        cc.center(unit(), limits, move={"x": WIDE}, rare="yes")


def test_mcnemar_is_exact():
    share = cc.results.CenteredShare("a", cc.require("y", above=0.0), 100, 0, 6, 90, 4, 0.95)
    assert share.p_value == pytest.approx(2.0 * 0.5**6) and share.better == "after"
    assert share.before == 0.9 and share.after == 0.96
    five = cc.results.CenteredShare("a", cc.require("y", above=0.0), 100, 5, 0, 90, 5, 0.95)
    assert five.p_value == pytest.approx(0.0625) and five.better is None
    turned = cc.results.CenteredShare("a", cc.require("y", above=0.0), 100, 9, 1, 80, 10, 0.95)
    assert turned.p_value == pytest.approx(2.0 * 11 / 1024) and turned.better == "before"


def test_the_crank_of_a_slider_is_centered():
    """The stroke of an ideal one in line is twice its crank."""
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.normal("50 mm", "20 um"), "rod_length": cc.normal("120 mm", "20 um")},
        features={"stroke": cc.features.peak_to_peak("slider.x")},
        fixed={"clearance_at": ()},
        requirements={"stroke": cc.require("stroke", above="99.96 mm", below="100.12 mm")},
    )
    move = {
        "crank_length": cc.Interval("49.9 mm", "50.1 mm"),
        "rod_length": cc.Interval("119 mm", "121 mm"),
    }
    found = cc.center(study, move=move, runs=200)
    assert found["crank_length"].after == pytest.approx(0.05002, abs=4e-7)
    assert found["rod_length"].distance == pytest.approx(0.0, abs=4e-7)
    low, high = found.share.after_between
    assert found.status == "better" and low < PHI(2.0) - PHI(-2.0) < high
    assert "crank_length by 0.02" in str(found) and "mm" in str(found)


def test_results_are_values_and_have_reports(tmp_path):
    limits = cc.require("y", above=-1.0, below=2.0)
    found, again = (cc.center(unit(), limits, move={"x": WIDE}, runs=300, rng=4) for _ in range(2))
    assert found == again == pickle.loads(pickle.dumps(found)) == copy.deepcopy(found)
    assert found != cc.center(unit(), limits, move={"x": WIDE}, runs=300, rng=5)
    with pytest.raises(AttributeError):
        found.status = "worse"
    assert list(found) == ["x"] and "<table" in found._repr_html_()
    page = found.report(tmp_path / "center.html").read_text()
    assert "Nominal values" in page and "at no cost" in page
    assert repr(found) == "<Centering: better, x>"


def test_bad_input_is_named_at_once():
    study = unit(lambda x, u, k: {"y": x + u + k}, x=cc.normal(0.0, 1.0), u=cc.Interval(0.0, 1.0), k=WIDE)
    limits = cc.require("y", above=-3.0)
    with refuses('move["xx"]', 'move["u"]', 'move["x"]', "runs", "confidence", "rng"):
        cc.center(
            study,
            limits,
            move={"xx": WIDE, "u": WIDE, "x": cc.Interval(1.0, 2.0)},
            runs=2,
            confidence=1.0,
            rng=-1,
        )
    with refuses('move["x"]'):
        cc.center(study, limits, move={"x": (0.0, 1.0)})
    with refuses('move["x"]'):
        cc.center(unit(x=cc.lognormal(2.0, 0.1)), limits, move={"x": cc.Interval(-1.0, 3.0)})
    with refuses("specifications", "move"):
        cc.center(study, move={})
    with refuses("move"):
        cc.center(study, limits, move=["x"])
    with refuses('specifications["a"]', 'move["x"]'):
        cc.center(unit(), {"a": 3.0}, move={"x": cc.Interval(1.0, 2.0)})
    with refuses("parameters", 'move["x"]'):
        cc.center(unit(x=WIDE), limits, move={"x": WIDE})
    with pytest.raises(cc.errors.ArgumentTypeError):
        cc.center("study", limits, move={"x": WIDE})
    table = cc.Study.from_runs({"x": [0.0, 1.0, 2.0]}, None, {"y": [1.0, 2.0, 3.0]})
    with refuses("study", "parameters", 'move["x"]'):
        cc.center(table, limits, move={"x": WIDE})


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_mechanisms_that_fail_are_outside():
    def brittle(x):
        if x > 1.0:
            raise ValueError("breaks")
        return {"y": x}

    found = cc.center(unit(brittle), cc.require("y", above=-4.0), move={"x": WIDE}, runs=400)
    low, high = found.share.before_between
    assert low < PHI(1.0) - PHI(-4.0) < high
