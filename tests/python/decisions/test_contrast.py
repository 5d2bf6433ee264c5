"""Two designs in pairs: closed forms of normal differences, exact intervals, what is named as changed."""

import chebclear as cc
import numpy as np
import pytest
from chebclear.decisions.contrast import _median_between
from chebclear.decisions.contrast_report import contrast_document
from refusals import refuses


def shaft(gap, thread, taper=0.0):
    return {"play": gap - thread - taper}


def designs(spread=(0.03, 0.01), mean=(10.1, 10.1), **more):
    return [
        cc.Study(shaft, {"gap": cc.normal(m, s), "thread": cc.normal(10.0, 0.02)}, **more)
        for m, s in zip(mean, spread, strict=True)
    ]


def test_a_shift_of_a_design_is_found_exactly_by_pairs():
    """The same draws in both: a shift of 5 um is seen under a scatter of 36 um."""
    found = cc.contrast(*designs((0.03, 0.03), (10.1, 10.105)), runs=20)["play"]
    np.testing.assert_allclose(found.second - found.first, 0.005, rtol=1e-9)
    assert found.lower == pytest.approx(0.005) and found.upper == pytest.approx(0.005)
    assert found.differs and found.smaller == 0.0
    assert np.ptp(found.first) > 0.05


def test_a_wider_tolerance_has_the_same_places():
    wide, narrow = designs()
    found = cc.contrast(wide, narrow, runs=400)["play"]
    # The thread leaves the difference: what remains is two thirds of the deviation of the gap.
    deviation = np.std(found.second - found.first)
    assert deviation == pytest.approx(0.02, rel=0.15)
    assert not found.differs


def test_shares_differ_as_the_normal_distribution_says():
    wide, narrow = designs()
    limit = {"loose": cc.require("play", above=0.05)}
    found = cc.contrast(wide, narrow, limit, 2000, rng=3)["loose"]
    expected = []
    for spread in (0.03, 0.01):
        whole = cc.normal(0.1, float(np.hypot(spread, 0.02)))
        expected.append(1.0 - whole.cdf(0.05))
    np.testing.assert_allclose(found.shares, expected, atol=0.02)
    assert found.lower < expected[1] - expected[0] < found.upper
    assert found.lower > 0.0 and found.better == "second" and "the second design is better" in str(found)
    turned = cc.contrast(narrow, wide, limit, 2000, rng=3)
    assert turned["loose"].better == "first" and turned.requirements_table.rows[0][-1] == "first"
    few = cc.contrast(wide, narrow, limit, 6, rng=3)["loose"]
    assert few.better is None and "neither design is shown to be better" in str(few)
    assert found.only_first + found.only_second + found.both + found.neither == 2000
    assert found.difference == pytest.approx(found.shares[1] - found.shares[0])


def test_intervals_of_medians_hold_them_as_often_as_they_say():
    rng = np.random.default_rng(8)
    for count in (6, 25, 60):
        held = 0
        for _ in range(400):
            lower, upper = _median_between(np.sort(rng.exponential(size=count)), 0.9)
            held += lower <= np.log(2.0) <= upper
        assert held / 400 >= 0.9 - 2.5 * np.sqrt(0.09 / 400)
    assert _median_between(np.arange(4.0), 0.95) == (-np.inf, np.inf)


def test_mechanisms_are_compared_and_what_differs_is_named():
    def study(clearance, rod):
        return cc.Study(
            cc.mechanisms.slider_crank,
            {"crank_length": cc.Interval.around(0.05, rel=0.01), "clearance": clearance},
            features={"peak": cc.features.peak("wrist.normal_force")},
            fixed={"rod_length": rod},
            skip=0.03,
            duration=0.03,
            samples=31,
        )

    tight, loose = study(cc.Interval(1e-5, 2e-5), 0.12), study(cc.Interval(2e-5, 4e-5), 0.12)
    found = cc.contrast(tight, loose, {"reach": cc.require("slider.x", below=0.1702)}, 12)
    assert found["peak"].unit == "N" and len(found["peak"].first) == 12
    assert found["reach"].pairs == 12
    text = "\n".join(found.changes)
    assert 'parameters.clearance: "15 µm ±5 µm" and "30 µm ±10 µm"' in text
    assert "scene.joints.wrist.clearance: 1.5e-05 and 3e-05" in text
    # The same mechanisms as the studies themselves would simulate.
    function = tight.function("peak")
    again = cc.contrast(tight, tight, runs=12)
    assert again["peak"].median == 0.0 and again.changes == ()
    assert function.parameters == ("crank_length", "clearance")
    other = cc.contrast(tight, study(cc.Interval(1e-5, 2e-5), 0.15), runs=6)
    assert any(one.startswith("fixed.rod_length: 0.12 and 0.15") for one in other.changes)
    assert "peak" in str(other) and "<table" in other._repr_html_()


def test_pictures_and_bad_input():
    wide, narrow = designs()
    ax = cc.contrast(wide, narrow, runs=50)["play"].plot()
    assert ax.get_xlabel() == "change of play"
    plain = cc.Study(lambda gap: {"size": gap}, {"gap": cc.Interval(10.0, 10.1)})
    with pytest.raises(cc.errors.ArgumentError):
        cc.contrast(wide, plain)
    with refuses("runs", "confidence"):
        cc.contrast(wide, narrow, {"a": cc.require("play", above=0.0)}, 2, confidence=1.5)
    with pytest.raises(cc.errors.ArgumentTypeError):
        cc.contrast(wide, "narrow")
    with pytest.raises(cc.errors.ArgumentError):
        cc.contrast(wide, narrow, {"a": cc.require("plai", above=0.0)})
    failing = cc.Study(lambda gap: {"play": gap} if gap < 0.5 else 1 / 0, {"gap": cc.Interval(0.0, 1.0)})
    found = cc.contrast(failing, failing, {"a": cc.require("play", above=-1.0)}, 40)
    assert found["a"].neither > 0 and len(found["play"].first) == 40 - found["a"].neither


def test_machines_that_have_not_settled_are_said_to_be_so():
    def wheel(inertia, drag):
        return cc.Scene(
            bodies=[cc.Body("wheel", 1.0, inertia, points={"O": (0.0, 0.0)})],
            joints=[cc.Revolute("pin", "ground.O", "wheel.O")],
            ground={"O": (0.0, 0.0)},
            forces=[cc.Torque("motor", "wheel", f"1 - {drag}*wheel.angular_velocity")],
        )

    def study(inertia, drag, skip):
        speed = cc.features.mean("wheel.angular_velocity")
        return cc.Study(
            wheel,
            {"inertia": cc.normal(inertia, 0.02 * inertia)},
            fixed={"drag": drag},
            features={"speed": speed, "time": cc.features.time_of_peak("wheel.angular_velocity")},
            duration=1.0,
            skip=skip,
            samples=11,
        )

    # Ahead at first, but the final speed 1 / drag is lower: the sign of the difference changes on the way.
    for skip, settled, sign in ((0.0, False, 1.0), (5.0, False, 1.0), (200.0, True, -1.0)):
        found = cc.contrast(study(5.0, 0.5, skip), study(4.0, 0.6, skip), runs=12)
        assert found["speed"].differs and sign * found["speed"].median > 0.0
        about = [one.about for one in found.notices if one.code == "unsettled"]
        assert about == ([] if settled else [("speed",)])
    # Settled: the closed form.
    assert found["speed"].median == pytest.approx(1.0 / 0.6 - 1.0 / 0.5, abs=1e-5)


def test_a_report_says_first_which_design_is_better_in_which_requirement():
    def shaft(gap, thread):
        return {"play": gap - thread, "weight": 2.0 * gap + 0.0 * thread}

    gaps = {"thread": cc.normal(10.0, 0.02)}
    wide, narrow = (cc.Study(shaft, {"gap": cc.normal(10.1, s), **gaps}) for s in (0.05, 0.01))
    limits = {"loose": cc.require("play", above=0.05), "light": cc.require("weight", below=20.199)}
    first, *more = contrast_document(cc.contrast(wide, narrow, limits, 400), None, ("A", "B")).answer
    # Of loose 85 and 99 % keep to it; the limit of light lies at the median of both.
    assert (first.word, first.judgment) == (
        "The second design is better in loose; neither is shown to be better in light.",
        "good",
    )
    assert more[0].startswith("loose, play above 0.05: 8") and more[1].startswith("light, ")
    same = contrast_document(cc.contrast(wide, wide, limits, 100), None).answer[0]
    assert (same.word, same.judgment) == ("Neither is shown to be better in loose and light.", "fair")
