"""An interval keeps the dimension that it was written in; studies compare it with that of the parameter."""

import copy
import pickle

import chebclear as cc
import pytest
from chebclear import mechanisms

STROKE = {"stroke": cc.features.peak_to_peak("slider.x")}
SPAN = {"features": STROKE, "duration": 1.0, "samples": 2}


def study(**parameters):
    return cc.Study(mechanisms.slider_crank, parameters, **SPAN)


@pytest.mark.parametrize(
    "make",
    [
        lambda: cc.Interval("1 mm", "2 s"),
        lambda: cc.Interval("1 mm", "2 mm", nominal="1.5 kg"),
        lambda: cc.Interval.around("5 mm", plus="0.1 rad"),
        lambda: cc.normal("120 mm", "0.1 s"),
        lambda: cc.triangular("1 mm", "2 mm", "3 N"),
    ],
)
def test_numbers_of_an_interval_have_one_dimension(make):
    with pytest.raises(ValueError, match=r"is not of the dimension of \[mm\]; it may be given in m, mm"):
        make()


def test_an_interval_remembers_its_unit_and_equals_bare_numbers():
    side = cc.Interval("1 mm", 0.002)
    assert side == cc.Interval(0.001, 0.002)
    assert side.unit == copy.copy(side).unit == pickle.loads(pickle.dumps(side)).unit == "mm"
    assert cc.normal("120 mm", "0.1 mm").interval.unit == cc.Interval.around("5 mm", plus="1 um").unit == "mm"
    assert "1.5 mm" in side


@pytest.mark.parametrize(
    ("name", "side", "meant"),
    [
        ("crank_length", cc.Interval("1 s", "2 s"), "m, mm"),
        ("crank_mass", cc.normal("120 mm", "0.1 mm"), "kg, g"),
        # Neither 1/min nor Hz says whether radians or turns were counted once the interval is made.
        ("crank_speed", cc.Interval("45 1/min", "50 1/min"), "rpm"),
        ("crank_speed", cc.Interval("1 Hz", "2 Hz"), "rpm"),
    ],
)
def test_a_study_refuses_an_interval_of_another_dimension(name, side, meant):
    with pytest.raises(ValueError, match=rf'parameters\["{name}"\] is in .* may be given in {meant}'):
        study(**{name: side})


def test_a_study_of_a_model_in_other_units_takes_bare_numbers():
    given = {"units": {"gap": "mm"}, "outputs": ["x"]}

    def model(gap):
        return {"t": [0.0, 1.0], "x": [gap, gap]}

    with pytest.raises(ValueError, match="in SI units now, but the study has it in mm: leave out the unit"):
        cc.Study(model, {"gap": cc.Interval("1 mm", "2 mm")}, **given)
    cc.Study(model, {"gap": cc.Interval(1.0, 2.0)}, **given)


def test_limits_of_a_model_in_other_units_are_in_these():
    def model(gap):
        return {"t": [0.0, 1.0], "x": [gap, gap]}

    box = {"gap": cc.uniform(1.0, 2.0)}
    found = cc.conformance(
        cc.Study(model, box, units={"gap": "mm", "x": "mm"}), {"small": cc.require("x", below="3 mm")}, 50
    )
    assert found["small"].share == 1.0


def test_a_sweep_reads_the_unit_of_its_parameter():
    crank = study(crank_length=cc.Interval.around("50 mm", rel=0.01))
    with pytest.raises(ValueError, match=r'"rpm" is not of the dimension of \[m\]'):
        crank.sweep("rod_length", "0.1 rpm", "0.2 rpm", 3)
    turns = crank.sweep("crank_speed", "1 Hz", "10 Hz", 3, revolutions=8, discard=0)
    assert turns.points.tolist() == pytest.approx([cc.rpm(60), cc.rpm(330), cc.rpm(600)], rel=1e-15)
