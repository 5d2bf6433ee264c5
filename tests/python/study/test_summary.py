"""What ``print(result)`` says, and the predicted worst cases beside simulated ones."""

import re

import chebclear as cc
import numpy as np
import pytest
from chebclear.base.units import convert
from chebclear.execution.batch import jammed
from chebclear.execution.failures import set_apart
from chebclear.notices import Notice
from chebclear.study.polynomials.points import sobol_points
from chebclear.study.report.answer import main_numbers
from refusals import refuses

T = np.linspace(0.0, 1.0, 60)
BOX = {"a": cc.Interval.around(1.0, rel=0.1), "b": cc.Interval.around(2.0, rel=0.1)}


def model(a, b):
    """`x` is highest at t = 1 with the largest a and the smallest b: 1.1 - 1.8; nothing follows `noise`."""
    return {"t": T, "x": a * T - b, "noise": np.sin(3000.0 * a * T + 1e4 * b), "top": a}


@pytest.fixture(scope="module")
def study():
    return cc.Study(model, BOX)


def row(text, name):
    return next(line for line in text.splitlines() if line.startswith(name)).split()


def test_a_line_an_output_and_what_to_do_next(study):
    result = study.band(41)
    text = str(result)
    head, first, second = text.splitlines()[:3]
    assert head.startswith("band: 2 parameters, 41 runs and the nominal one, ")
    assert (first, second) == ("  a: 1 ±0.1", "  b: 2 ±0.2")
    # From -2.2 to 1.1 - 1.8, nominally from -2 to -1; width 0.2 t + 0.4 at t = 1; 41 runs and one miss.
    told = "-2.00 .. -1.00 -2.20 -0.70 0.600 95 of 100 97 of 100 ✓ estimated"
    assert " ".join(row(text, "x")[1:]) == told
    assert row(text, "noise")[-1] in ("estimated", "runs")
    assert " ".join(row(text, "top")[1:]) == "1.00 0.90 1.10 0.200 97 of 100 - ✓ estimated"
    assert "next: 41 more runs would narrow noise" in text
    assert "next: result.check() simulates the predicted worst cases of x" in text
    assert 'next: ranking("top")' in text
    assert result.seconds > 0.0 and result.extend(2).seconds > result.seconds


def test_predicted_worst_cases_are_simulated(study, tmp_path):
    result = study.chebyshev(3).check()
    highest, lowest = (case for case in result.worst_cases if case.output == "x")
    assert (highest.time, highest.parameters) == (1.0, pytest.approx({"a": 1.1, "b": 1.8}))
    assert highest.predicted == pytest.approx(-0.7) and highest.simulated == pytest.approx(-0.7)
    assert (lowest.time, lowest.simulated) == (0.0, pytest.approx(-2.2))
    assert "predicted -0.7, simulated -0.7" in str(highest)
    assert "x is highest at t = 1.00 s with a = 1.1, b = 1.8: predicted -0.700, simulated -0.700" in str(
        result
    )
    assert "check()" not in str(result)
    assert "(kind band) bound noise" in str(result)
    assert cc.results.StudyResult.load(result.save(tmp_path / "checked")) == result
    with pytest.raises(cc.errors.ArgumentError):
        study.scan(3).check()
    with pytest.raises(cc.errors.ArgumentError):
        cc.results.StudyResult.load(tmp_path / "checked.npz").check()


def test_a_peak_that_was_asked_for_is_that_of_the_motion():
    sides = {"crank_length": cc.Interval.around(0.05, rel=0.1)}
    options = {"duration": 2e-3, "samples": 5, "rtol": 1e-4}
    features = {"peak force": cc.features.peak("wrist.normal_force")}
    asked = cc.Study(cc.mechanisms.slider_crank, sides, ["wrist.normal_force"], features=features, **options)
    result = asked.sample(6)
    reach = result.features["peak force"].interval
    assert reach.upper > result.values("wrist.normal_force").max(), "samples miss the peak"
    # One number for one question: the largest force is that of the feature.
    (table,) = main_numbers(result)
    of_feature, of_output = (convert(str(cells[3]), "N") for cells in table.rows)
    assert of_feature == pytest.approx(reach.upper, rel=5e-3) == of_output


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_warnings_and_failures_are_told_with_the_result():
    def partly(a):
        if a > 1.05:
            raise ValueError("no solution")
        return {"t": T, "x": a * T}

    text = str(cc.Study(partly, {"a": cc.Interval.around(1.0, rel=0.1)}).band(20))
    assert "\nwarning: failed: " in text and "\nwarning: too few runs: " in text
    told = re.search(
        r"next: a box in which all runs succeed: 5 of 21 failed, with a from ([\d.]+) to ([\d.]+),", text
    )
    assert 1.05 < float(told[1]) < float(told[2]) <= 1.1
    assert "would narrow" not in text, "more runs would fail as well"


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
@pytest.mark.parametrize(
    "play", [(), ("rocker_pin",)], ids=["ideal joints", "a journal that is pressed deep"]
)
def test_mechanisms_that_jam_are_told_before_more_runs(play):
    """By Grashof's rule the crank turns round if it is no longer than 0.08 + 0.1 - 0.12 m."""
    study = cc.Study(
        cc.mechanisms.four_bar,
        {"crank_length": cc.Interval(0.045, 0.073), "crank_mass": cc.Interval.around(0.3, rel=0.1)},
        outputs=["rocker.angle"],
        fixed={"clearance_at": play},
        duration=0.03,
        samples=31,
    )
    result = study.band(16, rtol=1e-5)
    steps = [line for line in str(result).splitlines() if line.startswith("next: ")]
    told = re.search(r": (\d+) of 17 .*, with crank_length from ([\d.]+) to ([\d.]+)[,;]", steps[0])
    cranks = sobol_points(study.intervals, 0, 16, 0)[:, 0]
    jam = cranks[cranks > 0.06]
    assert 5 < len(jam) < 10
    assert int(told[1]) == len(jam)
    assert [float(end) for end in told.groups()[1:]] == pytest.approx([jam.min(), jam.max()], rel=1e-3)
    assert "more runs would not change that" in steps[0]
    assert "would narrow" not in str(result)


def jam(joint, runs, place="", code="deep_penetration"):
    return Notice(code, "in words", (joint,), {"runs": runs, "of_runs": 9}, place)


def test_a_stiffness_that_is_too_small_is_no_matter_of_the_box():
    told = '4 of 9 runs may be jammed at joint "a pin", with rod = 3'
    assert jammed([jam("a pin", 4, ", with rod = 3")]) == told
    assert jammed([jam("a pin", 9)]) == "" == jammed([jam("a pin", 4, code="creep")])


def test_the_jammed_runs_of_all_parts_of_an_extended_study_count():
    parts = [jam("a", 4, ", with rod = 3"), jam("b", 8), jam("a", 2)]
    assert jammed(parts) == '6 of 18 runs may be jammed at joint "a"'
    assert jammed([jam("a", 9), *parts[1:]]) == '11 of 18 runs may be jammed at joint "a"'


def test_runs_in_all_of_a_box_have_no_place_in_it():
    names, points = ["a", "b"], np.array([[1.0, 4.0], [2.0, 3.0], [3.0, 2.0], [4.0, 1.0]])
    assert set_apart(names, points[[0, 3]], points[1:3]) == ""
    assert set_apart(names, points[:2], points[2:]) == ", with a from 1 to 2 and b from 3 to 4"
    assert set_apart(names, points[2:3], points[[0, 1, 3]]) == ", with a = 3 and b = 2"
    assert set_apart(names, points, points[:0]) == ""


def test_a_band_without_a_polynomial_names_what_to_use_instead(study):
    for result in (study.band(41), study.scan(4)):
        with pytest.raises(cc.errors.ArgumentError):
            result["noise"].sensitivity("a")


def test_quantiles_say_where_a_normal_distribution_ends():
    box = {"a": cc.normal(1.0, 0.05), "b": cc.Interval(1.8, 2.2)}
    study = cc.Study(model, box, outputs=["x"])
    result = study.chebyshev(degree=2)
    assert "a: 1 ±0.15 (normal, taken as an interval)" in str(result)
    likely = result["x"].quantiles(study.random, probability=0.9)
    assert likely.statement.endswith("independent; values of a beyond the interval count as outside.")
    # The intervals hold three standard deviations, 0.9973.
    with pytest.raises(cc.errors.ArgumentError):
        result["x"].quantiles(study.random, probability=0.9999, draws=100_000)
    with refuses("random", error=TypeError):
        result["x"].quantiles([0.05, 0.95])
