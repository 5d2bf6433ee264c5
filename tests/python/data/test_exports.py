"""Results in other programs: read back by the libraries that others would use."""

import csv
import json
import re

import chebclear as cc
import numpy as np
import pytest
from chebclear.data.dataset import Dataset, Variable
from chebclear.data.exports import Exports
from chebclear.data.matlab import matlab_name, structures
from exported import check_exports

SCENE = cc.mechanisms.slider_crank(
    crank_length=0.05, rod_length=0.12, clearance=2e-5, crank_speed=cc.rpm(2000)
)


@pytest.fixture(scope="module")
def run():
    return cc.simulate(
        SCENE, duration=0.01, samples=41, outputs=["slider.x", "slider.vx", "wrist.normal_force"]
    )


@pytest.fixture(scope="module")
def result():
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.Interval.around(0.05, rel=0.1), "rod_length": cc.Interval.around(0.12, rel=0.1)},
        outputs=["slider.x"],
        features={"peak force": cc.features.peak("wrist.normal_force")},
        duration=0.01,
        samples=21,
    )
    return study.scan(2)


@pytest.fixture(scope="module")
def costs():
    return cc.tradeoff(SCENE, duration=0.005, samples=51, outputs=["slider.vx"], rtols=[1e-3, 1e-4])


@pytest.fixture(scope="module")
def diagram():
    return cc.bifurcation(
        cc.mechanisms.slider_crank, "clearance", [1e-5, 3e-5], "slider.x", periods=2, discard=0, rtol=1e-4
    )


@pytest.fixture(scope="module")
def bounds():
    t = np.linspace(0.0, 1.0, 11)
    study = cc.Study(
        lambda a: {"t": t, "x": a * t}, {"a": cc.Interval.around(1.0, rel=0.1)}, units={"x": "m"}
    )
    return cc.study_tradeoff(study, degrees=[1], points=[2], holdout=5)


@pytest.fixture(scope="module")
def comparison():
    t = np.linspace(0.0, 1.0, 11)
    study = cc.Study(
        lambda a: {"t": t, "x": a * t, "level": a + t},
        {"a": cc.Interval.around(1.0, rel=0.1)},
        units={"x": "m", "level": "mm"},
    )
    return cc.compare(study.chebyshev(1), study.scan(3))


# Of each kind of result: the axis, a column with its unit, and that column in the result.
KINDS = {
    "run": ("t", "slider.vx", "m/s", lambda run: run["slider.vx"]),
    "result": ("t", "slider.x.upper", "m", lambda result: result["slider.x"].upper),
    "costs": ("setting", "error slider.vx", "m/s", lambda costs: costs.to_dict()["error slider.vx"]),
    "diagram": ("sample", "slider.x", "m", lambda diagram: diagram.samples.ravel()),
    "comparison": ("row", "slack", "-", lambda comparison: [row.slack for row in comparison.values()]),
    "bounds": ("setting", "seconds", "s", lambda bounds: [point.seconds for point in bounds]),
}


@pytest.mark.parametrize("kind", KINDS)
def test_every_result_has_every_export_with_units(kind, request, tmp_path):
    check_exports(request.getfixturevalue(kind), *KINDS[kind], tmp_path)


def test_csv_is_read_back_to_the_last_bit(run, tmp_path):
    path = run.to_csv(tmp_path / "run")
    assert path.name == "run.csv"
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    assert head == ["t [s]", "slider.x [m]", "slider.vx [m/s]", "wrist.normal_force [N]"]
    read = np.array(rows, dtype=float)
    assert np.array_equal(read, np.column_stack([run.t, run.samples]))


@pytest.mark.parametrize("name", ["", "."])
def test_a_path_without_the_name_of_a_file_is_refused(run, name):
    for write in (run.save, run.to_csv, run.report):
        with pytest.raises(cc.errors.ArgumentError):
            write(name)


def test_csv_replaces_a_file_whole_or_not_at_all(run, tmp_path):
    path = tmp_path / "run.csv"
    path.write_text("mine")
    wrong = Dataset("t", {"t": Variable(("t",), np.zeros(2)), "a": Variable(("t",), np.zeros(3))})

    class Uneven(Exports):
        def dataset(self):
            return wrong

    with pytest.raises(ValueError):
        Uneven().to_csv(path)
    assert path.read_text() == "mine" and list(tmp_path.iterdir()) == [path]
    run.to_csv(path)
    assert path.read_text().startswith("t [s],")


def test_data_frame_has_the_time_as_index_and_units(run):
    pytest.importorskip("pandas")
    frame = run.to_dataframe()
    assert frame.index.name == "t" and np.array_equal(frame.index, run.t)
    assert list(frame.columns) == list(run.columns)
    assert np.array_equal(frame["slider.vx"], run["slider.vx"])
    assert frame.attrs["units"]["slider.vx"] == "m/s" and frame.attrs["status"] == "done"
    frame["slider.vx"] *= 2.0  # a copy: the run stays as it is
    assert np.array_equal(frame["slider.vx"], 2.0 * run["slider.vx"])


def test_data_frame_of_a_study_has_bounds(result):
    pytest.importorskip("pandas")
    frame = result.to_dataframe()
    assert list(frame.columns) == ["slider.x.lower", "slider.x.upper", "slider.x.nominal"]
    assert np.array_equal(frame["slider.x.upper"], result["slider.x"].upper)


def test_data_frame_of_costs_has_a_row_a_setting(costs):
    pytest.importorskip("pandas")
    frame = costs.to_dataframe()
    assert len(frame) == len(costs) and list(frame["method"]) == [point.method for point in costs]
    assert frame.attrs["units"]["error slider.vx"] == "m/s"


def test_xarray_holds_runs_over_their_parameters(result, tmp_path):
    xarray = pytest.importorskip("xarray")
    data = result.to_xarray()
    assert data["slider.x.runs"].dims == ("run", "t")
    assert np.array_equal(data["slider.x.runs"], result.values("slider.x"))
    assert np.array_equal(data.coords["parameters.rod_length"], result.parameters[:, 1])
    assert np.array_equal(data["features.peak force"][:, 0], result.features["peak force"].values[:, 0])
    assert data["slider.x.lower"].attrs["units"] == "m"
    assert cc.Scene.from_json(data.attrs["scene"]) == result.scene
    path = tmp_path / "result.nc"
    data.to_netcdf(path, engine="scipy")  # the engine that needs nothing else
    back = xarray.load_dataset(path, engine="scipy")
    assert np.array_equal(back["slider.x.upper"], result["slider.x"].upper)


def test_xarray_of_a_run_has_the_contacts(run):
    pytest.importorskip("xarray")
    data = run.to_xarray()
    assert list(data["events.kind"].values) == list(run.events.kind)
    assert np.array_equal(data["contacts.peak_force"], run.contacts.peak_force)
    assert data["contacts.peak_force"].attrs["units"] == "N"


def test_matlab_file_has_structures_with_units(run, tmp_path):
    io = pytest.importorskip("scipy.io")
    path = run.to_mat(tmp_path / "run")
    assert path.name == "run.mat"
    read = io.loadmat(path, simplify_cells=True)
    assert np.array_equal(read["slider"]["vx"], run["slider.vx"])
    assert read["units"]["wrist"]["normal_force"] == "N"
    assert list(read["events"]["kind"]) == list(run.events.kind)
    assert json.loads(read["about"]["scene"]) == json.loads(run.scene.to_json())


def test_matlab_file_of_a_study_and_of_costs(result, costs, tmp_path):
    io = pytest.importorskip("scipy.io")
    read = io.loadmat(result.to_mat(tmp_path / "study.mat"), simplify_cells=True)
    assert np.array_equal(read["slider"]["x"]["runs"], result.values("slider.x"))
    assert np.array_equal(read["features"]["peak_force"], result.features.runs[:, 0, 0])
    read = io.loadmat(costs.to_mat(tmp_path / "costs.mat"), simplify_cells=True)
    assert list(read["method"]) == [point.method for point in costs]


@pytest.mark.parametrize("word", ["end", "2nd link", "größe", "_x", "", "x" * 100, "rod", "Ω", "a-b"])
def test_matlab_names_are_accepted(word):
    assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,62}", matlab_name(word))
    assert matlab_name(word) != "end"


def test_words_that_become_one_name_are_told_apart():
    flat = {"a b.x": 1, "a_b.x": 2, "a-b.x": 3, "a b.y": 4, "units.x": 5}
    nested = structures(flat, taken=("units", "about"))
    assert nested["a_b"] == {"x": 1, "y": 4}
    assert {value["x"] for value in nested.values()} == {1, 2, 3, 5}
    assert not {"units", "about"} & set(nested)


def test_a_value_and_what_is_inside_it_both_stay():
    assert structures({"rod": 1, "rod.x": 2}) == {"rod": 1, "rod_2": {"x": 2}}
    nested = structures({"rod.x": 2, "rod": 1})
    assert nested["rod"] == {"x": 2} and 1 in nested.values()


def test_a_missing_library_is_named(run, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(
        ImportError, match=re.escape("to_dataframe needs pandas: pip install 'chebclear[data]'")
    ):
        run.to_dataframe()


def test_what_chebclear_did_not_write_is_refused(tmp_path):
    strange = tmp_path / "strange.npz"
    np.savez(strange, a=np.zeros(3))
    with pytest.raises(cc.errors.ArgumentError):
        cc.load_result(strange)
