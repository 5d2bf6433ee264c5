"""Tolerance stack-up: sums whose columns are known, and values for which the root of squares is wrong."""

import copy
import math
import pickle
from statistics import NormalDist

import chebclear as cc
import numpy as np
import pytest
from chebclear.decisions.stack_up import _tails
from refusals import refuses

NORMAL = NormalDist()
SLOPES, SPREADS = np.array([1.0, -2.0, 0.5]), np.array([1.0, 0.5, 1.0])


def linear(a, b, c):
    return {"gap": 5.0 + a - 2.0 * b + 0.5 * c}


def normals():
    return cc.Study(linear, {name: cc.normal(0.0, float(s)) for name, s in zip("abc", SPREADS, strict=True)})


def holds(between, truth):
    return between[0] <= truth <= between[1]


def test_a_sum_of_normal_lengths_has_three_known_columns():
    limits = cc.require("gap", above=0.5, below=9.5)
    found = cc.stack_up(normals(), {"gap": limits})["gap"]
    whole, root = 3.0 * np.sum(np.abs(SLOPES) * SPREADS), 3.0 * np.linalg.norm(SLOPES * SPREADS)
    assert found.worst_case == pytest.approx((5.0 - whole, 5.0 + whole), rel=1e-12)
    assert found.corners == pytest.approx(found.worst_case, rel=1e-12)
    assert found.rss == pytest.approx((5.0 - root, 5.0 + root), rel=1e-12)
    assert holds(found.lower_between, 5.0 - root) and holds(found.upper_between, 5.0 + root)
    assert holds(found.lower_between, found.monte_carlo[0])
    assert found.rss_verdict == "agrees" and found.curved == found.doubts == ()
    assert found.limits == (0.5, 9.5) and found.nominal == found.middle == 5.0
    parts = np.array(
        [(one.slope, one.tolerance, one.worst_case_share, one.variance_share) for one in found.values()]
    )
    squares = (SLOPES * SPREADS) ** 2
    np.testing.assert_allclose(
        parts.T,
        [SLOPES, 3.0 * SPREADS, 3.0 * np.abs(SLOPES) * SPREADS / whole, squares / squares.sum()],
        rtol=1e-12,
    )
    assert [one.curvature for one in found.values()] == [0.0, 0.0, 0.0]


def test_a_right_root_of_squares_is_called_wrong_as_seldom_as_is_said():
    verdicts = [cc.stack_up(normals(), "gap", 3300, rng=seed)["gap"].rss_verdict for seed in range(30)]
    # Binomial: more than 5 of 30 with a probability of 0.0033.
    assert verdicts.count("agrees") >= 25 and set(verdicts) <= {"agrees", "wrong"}


def test_uniform_lengths_break_the_root_of_squares():
    """Of the sum of two on [-1, 1], e^2 / 8 is below -2 + e."""
    study = cc.Study(lambda a, b: {"sum": a + b}, dict.fromkeys("ab", cc.uniform(-1.0, 1.0)))
    found = cc.stack_up(study, "sum")["sum"]
    assert found.worst_case == pytest.approx((-2.0, 2.0))
    assert found.rss == pytest.approx((-math.sqrt(2.0), math.sqrt(2.0)))
    true = 2.0 - math.sqrt(8.0 * 0.00135)
    assert holds(found.lower_between, -true) and holds(found.upper_between, true)
    assert found.rss_verdict == "wrong" and "RSS is wrong" in found.doubts[0] and found.curved == ()


def test_a_quadratic_function_is_curved():
    """y = x + x^2 / 4 = (x + 2)^2 / 4 - 1 of a normal x: the root of squares says -3 to 3."""
    study = cc.Study(lambda x: {"y": x + 0.25 * x * x}, {"x": cc.normal(0.0, 1.0)})
    found = cc.stack_up(study, cc.require("y", below=8.0), 20_000)
    (stack,) = found.values()
    assert stack.rss == pytest.approx((-3.0, 3.0)) and stack.worst_case == pytest.approx((-3.0, 3.0))
    assert stack.corners == pytest.approx((-0.75, 5.25))
    part = stack["x"]
    assert part.slope == pytest.approx(1.0) and part.bend == pytest.approx(2.25)
    assert part.curvature == pytest.approx(0.75)

    def below(y):
        root = 2.0 * math.sqrt(1.0 + y)
        return NORMAL.cdf(root - 2.0) - NORMAL.cdf(-root - 2.0)

    low, high = -1.0, 9.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if below(middle) < 0.99865 else (low, middle)
    assert holds(stack.upper_between, low) and stack.lower_between[0] >= -1.0
    assert stack.rss_verdict == "wrong" and stack.curved == ("x",) and stack.not_monotone == ()
    assert "curved in x (75 % of its slope's part)" in str(found) and "wrong" in str(found)


def test_a_bend_that_few_runs_do_not_show_is_said_all_the_same():
    """The bend of b is a fifth of its slope's part; beside the large a it moves no quantile."""
    study = cc.Study(
        lambda a, b: {"y": 3.0 * a + b + 0.2 * b * b / 3.0},
        {"a": cc.normal(0.0, 1.0), "b": cc.normal(0.0, 1.0)},
    )
    found = cc.stack_up(study, "y", 3300)["y"]
    assert found["b"].curvature == pytest.approx(0.2) and found.curved == ("b",)
    assert found.rss_verdict == "curved"
    # One of no weight is not worth a word.
    light = cc.Study(
        lambda a, b: {"y": 1000.0 * a + b * b}, {"a": cc.normal(0.0, 1.0), "b": cc.normal(0.0, 1.0)}
    )
    assert cc.stack_up(light, "y", 3300)["y"].rss_verdict == "agrees"


def test_a_value_that_turns_has_no_worst_case_at_corners():
    study = cc.Study(lambda a, b: {"y": a * a + b}, dict.fromkeys("ab", cc.normal(0.0, 1.0)))
    found = cc.stack_up(study, "y", 4000)["y"]
    assert found.not_monotone == ("a",) and found["a"].curvature == math.inf
    assert any("not monotone in a" in one for one in found.doubts)


def test_intervals_add_linearly_and_monte_carlo_takes_their_corners():
    study = cc.Study(
        lambda a, b, w: {"y": a + b + 2.0 * w},
        {"a": cc.normal(0.0, 1.0), "b": cc.normal(0.0, 1.0), "w": cc.Interval(0.0, 1.0)},
    )
    found = cc.stack_up(study, "y")["y"]
    root = 3.0 * math.sqrt(2.0)
    assert found.rss == pytest.approx((-root, 2.0 + root)) and found["w"].variance_share == 0.0
    assert found.worst_case == pytest.approx((-6.0, 8.0)) and found.nominal == pytest.approx(1.0)
    assert holds(found.lower_between, -root) and holds(found.upper_between, 2.0 + root)
    assert found.rss_verdict == "agrees"


def test_unequal_tolerances_are_taken_about_their_middle():
    side = cc.triangular(-1.0, 0.0, 3.0)
    found = cc.stack_up(cc.Study(lambda a: {"y": 2.0 * a}, {"a": side}), "y", 100)["y"]
    assert found.nominal == 0.0 and found.middle == 2.0 and found.worst_case == (-2.0, 6.0)
    assert found.rss_verdict == "not checked" and "it takes 3244" in found.doubts[0]


def test_intervals_of_quantiles_hold_them_as_often_as_they_say():
    rng, held = np.random.default_rng(3), 0
    for _ in range(300):
        lower, upper = _tails(np.sort(rng.standard_normal(4000)), 0.9)
        true = NORMAL.inv_cdf(0.99865)
        held += lower[0] <= -true <= lower[2] and upper[0] <= true <= upper[2]
    assert held / 300 >= 0.9 - 2.5 * math.sqrt(0.09 / 300)
    few = _tails(np.arange(10.0), 0.95)
    assert few[0][0] == -math.inf and few[1][2] == math.inf


def test_a_mechanism_has_the_slopes_of_its_geometry():
    """An ideal slider-crank in line reaches from l - r to l + r, and its stroke is 2 r."""
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.normal("50 mm", "20 um"), "rod_length": cc.normal("120 mm", "30 um")},
        features={"stroke": cc.features.peak_to_peak("slider.x")},
        fixed={"clearance_at": ()},
    )
    found = cc.stack_up(study, ["stroke", "slider.x"], 300)
    assert list(found) == ["stroke", "slider.x: lowest", "slider.x: highest"]
    slopes = [[one.slope for one in stack.values()] for stack in found.values()]
    np.testing.assert_allclose(slopes, [[2.0, 0.0], [-1.0, 1.0], [1.0, 1.0]], atol=1e-4)
    assert found["stroke"].worst_case == pytest.approx((0.09988, 0.10012), abs=1e-8)
    reach = 3.0 * math.hypot(2e-5, 3e-5)
    assert found["slider.x: highest"].rss == pytest.approx((0.17 - reach, 0.17 + reach), abs=1e-8)
    assert found["stroke"].unit == "m" and "mm" in str(found)
    below = cc.stack_up(study, cc.require("slider.x", below="170.1 mm"), 50)
    assert list(below) == ["slider.x below 170.1 mm: highest"]


def test_results_are_values_tables_and_reports(tmp_path):
    found, again = (cc.stack_up(normals(), "gap", 200, rng=1) for _ in range(2))
    assert found == again == pickle.loads(pickle.dumps(found)) == copy.deepcopy(found)
    assert found != cc.stack_up(normals(), "gap", 200, rng=2)
    with pytest.raises(AttributeError):
        found["gap"].middle = 0.0
    page = found.report(tmp_path / "stack").read_text()
    assert "RSS" in page and "How do the tolerances add up?" in page and "<table" in found._repr_html_()
    columns = found.to_dict()
    assert columns["slope.b"] == pytest.approx([-2.0]) and columns["rss_verdict"][0] == "not checked"
    head = found.to_csv(tmp_path / "stack").read_text().splitlines()[0]
    assert "worst_case.lower" in head and "monte_carlo.upper" in head
    pytest.importorskip("pandas")
    frame = found.to_dataframe()
    assert frame.loc[0, "value"] == "gap" and frame.loc[0, "rss.upper"] == found["gap"].rss[1]


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_random_mechanisms_that_fail_are_left_out_and_counted():
    def brittle(x):
        if x > 3.2:
            raise ValueError("breaks")
        return {"y": x}

    found = cc.stack_up(cc.Study(brittle, {"x": cc.normal(0.0, 1.0)}), "y")["y"]
    assert found.failed == pytest.approx(5000 * (1.0 - NORMAL.cdf(3.2)), abs=8) and found.failed > 0
    assert found.monte_carlo[1] < 3.2


def test_bad_input_is_named_at_once():
    with refuses("runs", "confidence", "rng", "parameters"):
        cc.stack_up(
            cc.Study(linear, dict.fromkeys("abc", cc.Interval(0.0, 1.0))), "gap", 1, confidence=0.0, rng=-1
        )
    with refuses("of"):
        cc.stack_up(normals())
    with refuses("of"):
        cc.stack_up(normals(), 3)
    with refuses('of["3"]'):
        cc.stack_up(normals(), ["gap", 3])
    with pytest.raises(cc.errors.ArgumentError, match="gapp"):
        cc.stack_up(normals(), "gapp", 10)
    with pytest.raises(cc.errors.ArgumentTypeError):
        cc.stack_up("study", "gap")
    table = cc.Study.from_runs({"x": [0.0, 1.0, 2.0]}, None, {"y": [1.0, 2.0, 3.0]})
    with refuses("study", "parameters"):
        cc.stack_up(table, "y")
