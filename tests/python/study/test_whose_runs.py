"""Runs of another study are refused with what differs, so that no result is of two mechanisms."""

import dataclasses
import pickle

import chebclear as cc
import pytest
from chebclear.errors import ArgumentError, ArgumentTypeError
from refusals import refuses

ROD = {"rod_length": cc.Interval.around(0.12, rel=0.01)}
SHORT = {"duration": 1e-3, "samples": 11}
STROKE = {"stroke": cc.features.peak_to_peak("slider.x")}

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")


def crank_study(parameters=ROD, **options):
    return cc.Study(cc.mechanisms.slider_crank, parameters, ["slider.x"], **(SHORT | options))


def cranks(rod_length):
    return cc.mechanisms.slider_crank(rod_length=rod_length, crank_length=0.04)


@pytest.fixture(scope="module")
def result():
    return crank_study(features=STROKE).band(16)


OTHERS = {
    "mechanism": cc.Study(cranks, ROD, ["slider.x"], features=STROKE, **SHORT),
    "fixed crank_length": crank_study(features=STROKE, fixed={"crank_length": 0.04}),
    "interval of crank_length": crank_study(
        {"crank_length": cc.Interval.around(0.05, rel=0.01)}, features=STROKE
    ),
    "interval of rod_length: 0.1188 to 0.1212 and 0.1176": crank_study(
        {"rod_length": cc.Interval.around(0.12, rel=0.02)}, features=STROKE
    ),
    "rtol: not given and 1e-08": crank_study(features=STROKE, rtol=1e-8),
    "method": crank_study(features=STROKE, method="dop853"),
    "duration": crank_study(features=STROKE, duration=2e-3),
    "feature stroke": crank_study(features={"stroke": cc.features.peak("slider.x")}),
    "feature peak": crank_study(features=STROKE | {"peak": cc.features.peak("slider.x")}),
}


@pytest.mark.parametrize("words", OTHERS)
def test_a_result_is_extended_checked_and_joined_by_its_own_study_alone(words):
    study, other = crank_study(features=STROKE), OTHERS[words].band(16)
    for answer in (lambda: study.extended(other, 4), lambda: study.worst_cases(other)):
        with pytest.raises(ArgumentError) as told:
            answer()
        assert [one.path for one in told.value.problems] == ["result"] and words in str(told.value)


@pytest.mark.parametrize("words", [one for one in OTHERS if not one.startswith(("interval", "rtol"))])
def test_runs_of_another_study_take_no_part(words):
    study, included = crank_study(features=STROKE), OTHERS[words].scan(3)
    with pytest.raises(ArgumentError) as told:
        study.band(16, include=[study.scan(3), included])
    assert [one.path for one in told.value.problems] == ["include[1]"]
    # Samples at other instants, and features of other names, are said before what follows from them.
    assert words.removeprefix("feature ").replace("duration", "instants") in str(told.value)


def test_included_runs_have_the_tolerance_of_the_band():
    study, coarse = crank_study(), crank_study(rtol=1e-3)
    assert study.band(16, include=study.scan(3)).settings.rtol == 1e-6  # nobody said another one
    with refuses("include[1]"):
        study.band(16, include=[study.scan(3), coarse.scan(3)])
    with refuses("include[0]"):
        study.band(16, rtol=1e-5, include=study.scan(3))
    narrow = crank_study({"rod_length": cc.Interval.around(0.12, rel=0.005)})
    assert len(study.band(16, include=narrow.scan(3)).parameters) == 19


def test_the_study_made_again_goes_on(result):
    again = crank_study(features=STROKE)
    assert again.extended(result, 9) == result.extend(9)
    assert again.worst_cases(result) == result.check().worst_cases
    assert len(again.band(16, include=result).parameters) == 16  # the same points


def test_a_study_keeps_what_it_was_asked_for():
    study = crank_study()
    with pytest.raises(ArgumentTypeError):
        study.intervals["rod_length"] = cc.Interval(0.1, 0.2)
    with refuses("result"):
        study.extended(3, 4)
    assert study.intervals == ROD


def test_settings_in_one_argument_are_those_of_keywords():
    settings = cc.Settings(**SHORT, outputs=["slider.x"])
    study = cc.Study(cc.mechanisms.slider_crank, ROD, settings=settings)
    result = study.band(16)
    assert result == crank_study().band(16) and result.settings.rtol == 1e-4
    assert pickle.loads(pickle.dumps(result.spec)).study().band(16) == result
    given = cc.Study(cc.mechanisms.slider_crank, ROD, settings=dataclasses.replace(settings, rtol=1e-6))
    assert (
        given.band(16).settings.rtol
        == cc.simulate(cc.mechanisms.slider_crank(), settings=settings).settings.rtol
        == 1e-6
    )
    assert given.scan(3).bands == study.scan(3).bands
    with refuses("result"):
        given.extended(result, 4)
