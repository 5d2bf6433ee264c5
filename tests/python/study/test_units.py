"""Units that a study was given by name: of a model of one's own, of a table, of the parameters of a file."""

import csv
import re
from pathlib import Path

import chebclear as cc
import numpy as np
import pytest
from chebclear.base.units import UNITS, convert, parse_unit, si_unit
from notices import codes
from refusals import refuses

# The names suggest other units on purpose: a pressure that ends in x, a level that ends in force.
UNITS_OF_MODEL = {
    "tank.x": "bar",
    "level.force": "mm",
    "spring": "N/mm",
    "flow": "l/min",
    "largest": "kg",
    "crest": "mbar",
}


def model(spring, flow):
    t = np.linspace(0.0, 1.0, 41)
    return {
        "t": t,
        "tank.x": spring * np.cos(flow * t),
        "level.force": flow * t,
        "largest": spring * flow,
        "silent": spring,
    }


BOX = {"spring": cc.Interval.around(10.0, rel=0.05), "flow": cc.Interval.around(3.0, rel=0.05)}


def made(units):
    features = {
        "top": cc.features.peak("tank.x"),
        "when": cc.features.time_of_peak("tank.x"),
        "crest": lambda run: run["tank.x"][3],
    }
    return cc.Study(model, BOX, features=features, units=units).band(runs=31)


@pytest.fixture(scope="module")
def result():
    return made(UNITS_OF_MODEL)


@pytest.fixture(scope="module")
def silent():
    return made(None)


def drawn(result):
    """All words of pictures of the result."""
    band = result["tank.x"]
    plain = {name: unit for name, unit in result.units.items() if name != "crest"}
    axes = [
        cc.plots.plot_band(band),
        cc.plots.plot_sensitivity(band, "flow"),
        cc.plots.plot_coefficients(cc.Study(model, BOX, units=plain).chebyshev(4)["tank.x"]),
        cc.plots.plot_tornado(result.features["top"]),
    ]
    return [re.sub(r"\s+", " ", ax.get_xlabel() + "|" + ax.get_ylabel()) for ax in axes]


def test_units_are_those_that_were_given(result):
    assert result.units == UNITS_OF_MODEL
    assert [result[name].unit for name in result] == ["bar", "mm"]
    assert result["tank.x"].parameter_units == {"spring": "N/mm", "flow": "l/min"}
    table = result.features
    assert dict(zip(table.names, table.units, strict=True)) == {
        "top": "bar",  # of its output
        "when": "s",  # a time, whatever the output
        "crest": "mbar",
        "largest": "kg",
        "silent": "",
    }


def test_pictures_show_them_and_guess_none(result, silent):
    assert drawn(result) == [
        "time [s]|tank x [bar]",
        "time [s]|sensitivity of tank x to flow [bar per l/min]",
        "degree in the parameter [-]|largest coefficient of tank x over time [bar]",
        "top, on average [bar]|",
    ]
    # Without units a name says nothing: no length for what ends in x, no force for what ends in force.
    assert drawn(silent) == [
        "time [s]|tank x",
        "time [s]|sensitivity of tank x to flow [per unit of the parameter]",
        "degree in the parameter [-]|largest coefficient of tank x over time",
        "top, on average|",
    ]
    with pytest.raises(cc.errors.ArgumentError):
        silent["tank.x"].plot(unit="mm")


def test_tables_and_exports_show_them(result, silent, tmp_path):
    assert re.search(r"^tank\.x .* bar ", str(result), re.MULTILINE)
    assert "spring: 10 N/mm ±0.5 N/mm" in str(result)
    with result.to_csv(tmp_path / "result.csv").open(encoding="utf-8", newline="") as file:
        head = next(csv.reader(row for row in file if not row.startswith("#")))
    assert {"tank.x.lower [bar]", "level.force.upper [mm]"} <= set(head)
    data = result.to_xarray()
    told = {name: data[name].attrs.get("units") for name in data.variables}
    assert told["tank.x.runs"] == "bar"
    assert told["parameters.flow"] == "l/min"
    assert (told["features.largest"], told["features.crest"]) == ("kg", "mbar")
    assert told["features.when"] == "s"
    assert told["features.silent"] is None
    assert silent.to_xarray()["level.force.runs"].attrs.get("units") is None
    frame = result.to_dataframe()
    assert frame.attrs["units"]["tank.x.lower"] == "bar"


def test_the_report_shows_them(result, silent, tmp_path):
    text = result.report(tmp_path / "a.html").read_text(encoding="utf-8")
    assert re.search(r">9.5 N/mm<", text)
    assert "10.5 bar" in text
    quiet = silent.report(tmp_path / "b.html").read_text(encoding="utf-8")
    assert "in their own units" in quiet
    assert not re.search(r"\d (k|M)?N\b", quiet)


def test_a_table_of_runs_has_them(result):
    runs = dict(zip(BOX, result.parameters.T, strict=True))
    values = {"tank.x": result.values("tank.x"), "largest": result.features.runs[:, 0, 3]}
    with pytest.warns(cc.ChebclearWarning):
        table = cc.Study.from_runs(
            runs, result.t, values, units={"tank.x": "bar", "largest": "kg", "flow": "l/min"}
        ).band()
    assert "no_nominal_run" in codes(table) and table["tank.x"].unit == "bar"
    assert table.features["largest"].unit == "kg"
    assert table["tank.x"].parameter_units == {"flow": "l/min"}


def test_wrong_units_are_told():
    for name, wrong in (("units", {"tank.z": "bar"}), ('units["tank.x"]', {"tank.x": 3}), ("units", "m")):
        with refuses(name):
            made(wrong)
    side, time = {"rod_length": cc.Interval.around(0.12, rel=0.01)}, {"duration": 1e-3, "samples": 11}
    with refuses("units"):
        cc.Study(cc.mechanisms.slider_crank, side, ["slider.x"], units={"slider.x": "mm"}, **time)
    with refuses("units"):
        cc.Study.from_runs({"a": [1.0, 2.0]}, None, {"x": [1.0, 2.0]}, units={"y": "m"})


def test_parameters_of_a_file_have_si_units():
    study = cc.load(Path(__file__).parents[3] / "examples" / "toggle_press.toml").study(
        duration=1e-3, samples=3, skip=0.0
    )
    assert study.runner.units["crank_length"] == "m"
    result = study.sample(2)
    assert "crank_length: 20 mm ±0.2 mm" in str(result)


@pytest.mark.parametrize(
    "unit", [*UNITS, "mm/s2", "N/mm", "kN/mm^1.5", "g mm2", "N mm/deg", "kW h", "m\u00b2", "t/min"]
)
def test_the_si_unit_of_a_unit_has_its_dimension_and_no_factor(unit):
    base = si_unit(unit)
    assert parse_unit(base if base != "-" else "1").dimension == parse_unit(unit).dimension
    assert convert(f"1 {base}", base) == 1.0 if base != "-" else unit == "%"
