"""What ``print(result)`` says, and the predicted worst cases beside simulated ones."""

import chebclear as cc
import numpy as np
import pytest

T = np.linspace(0.0, 1.0, 60)
BOX = {"a": cc.interval(1.0, rel=0.1), "b": cc.interval(2.0, rel=0.1)}


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
    assert (first, second) == ("  a: 0.9 to 1.1", "  b: 1.8 to 2.2")
    # Width 0.2 t + 0.4 at t = 1.
    assert row(text, "x")[1:5] == ["0.6", "resolved", "100", "%"]
    assert row(text, "noise")[2] in ("calibrated", "undersampled")
    assert "top: 0.9 to 1.1 (resolved)" in text
    assert "next: 41 more runs, result.extend(41), would narrow noise by about 4 %" in text
    assert "next: result.check() simulates the predicted worst cases of x" in text
    assert 'next: result.ranking("top")' in text
    assert result.seconds > 0.0 and result.extend(2).seconds > result.seconds


def test_predicted_worst_cases_are_simulated(study, tmp_path):
    result = study.chebyshev(3).check()
    highest, lowest = (case for case in result.worst_cases if case.output == "x")
    assert (highest.time, highest.parameters) == (1.0, pytest.approx({"a": 1.1, "b": 1.8}))
    assert highest.predicted == pytest.approx(-0.7) and highest.simulated == pytest.approx(-0.7)
    assert (lowest.time, lowest.simulated) == (0.0, pytest.approx(-2.2))
    assert "predicted -0.7, simulated -0.7" in str(highest)
    assert "(there)" in row(str(result), "x")[-1]
    assert "result.check()" not in str(result)
    assert "Study.band() bounds noise" in str(result)
    assert cc.StudyResult.load(result.save(tmp_path / "checked")) == result
    with pytest.raises(ValueError, match="no output is resolved"):
        study.scan(3).check()
    with pytest.raises(ValueError, match="has lost its study"):
        cc.StudyResult.load(tmp_path / "checked.npz").check()


@pytest.mark.parametrize("ask", ["scan", "sample", "certify"])
def test_every_kind_of_study_prints(study, ask):
    result = study.certify(0.9) if ask == "certify" else getattr(study, ask)()
    text = str(result)
    assert text.startswith(f"{ask}: 2 parameters")
    assert ("inner bounds; Study.band()" in text) == (ask != "certify")
    assert ("is proved" in text or "expected share" in text) == (ask == "certify")


def test_a_study_without_outputs_prints_its_features():
    result = cc.Study(lambda a, b: {"product": a * b}, BOX).sample(20)
    assert "product: 1.62 to 2.42 (resolved)" in str(result)


def test_a_peak_that_was_asked_for_is_that_of_the_motion():
    sides = {"crank_length": cc.interval(0.05, rel=0.1)}
    options = {"duration": 2e-3, "samples": 5, "rtol": 1e-4}
    features = {"peak force": cc.peak("wrist.normal_force")}
    asked = cc.Study(cc.mechanisms.slider_crank, sides, ["wrist.normal_force"], features=features, **options)
    result = asked.sample(6)
    reach = result.feature("peak force").interval
    assert f"{reach.lower:.5g} to {reach.upper:.5g}" in str(result)
    assert reach.upper > result.values("wrist.normal_force").max(), "samples miss the peak"


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_warnings_and_failures_are_told_with_the_result():
    def partly(a):
        if a > 1.05:
            raise ValueError("no solution")
        return {"t": T, "x": a * T}

    text = str(cc.Study(partly, {"a": cc.interval(1.0, rel=0.1)}).band(20))
    assert "\nwarning: failed: " in text and "\nwarning: undersampled: " in text
    assert "next: a box in which all runs succeed: 5 failed" in text
    assert "would narrow" not in text, "more runs would fail as well"


def test_a_band_without_a_polynomial_names_what_to_use_instead(study):
    for result in (study.band(41), study.scan(4)):
        with pytest.raises(
            cc.ArgumentError, match=rf"noise \({result['noise'].verdict}\) .* features of the runs"
        ):
            result["noise"].sensitivity("a")
