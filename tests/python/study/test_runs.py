"""Runs as an object: at points of one's own, cut, added, saved and answered from, without a further run."""

import copy
import pickle

import chebclear as cc
import numpy as np
import pytest
from chebclear.base.files import same
from chebclear.errors import ArgumentError
from refusals import refuses

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

T = np.linspace(0.0, 1.0, 31)
BOX = {"stiffness": cc.Interval.around(9.0, rel=0.1), "size": cc.Interval(1.0, 3.0)}
ROD = {"rod_length": cc.Interval.around(0.12, rel=0.01), "crank_length": cc.Interval.around(0.05, rel=0.01)}
calls = []


def spring(stiffness, size):
    calls.append((stiffness, size))
    return {"t": T, "x": size * np.cos(np.sqrt(stiffness) * T), "period": 2.0 * np.pi / np.sqrt(stiffness)}


def spring_study(**options):
    return cc.Study(spring, BOX, **options)


def crank_study(**options):
    features = {"stroke": cc.features.peak_to_peak("slider.x")}
    given = {"outputs": ["slider.x", "slider.vx"], "features": features, "duration": 0.03, "samples": 31}
    return cc.Study(cc.mechanisms.slider_crank, ROD, **(given | options))


@pytest.fixture(scope="module")
def runs():
    return crank_study().run(24)


def test_values_are_those_of_the_model_at_the_points():
    points = np.array([[9.0, 2.0], [8.5, 1.0], [9.9, 3.0]])
    runs = spring_study(units={"x": "m"}).run(points)
    assert len(runs) == 3 and np.array_equal(runs.parameters, points) and not runs.independent
    np.testing.assert_allclose(runs["x"], points[:, 1:] * np.cos(np.sqrt(points[:, :1]) * T), rtol=1e-15)
    np.testing.assert_allclose(runs.features["period"].values[:, 0], 2.0 * np.pi / np.sqrt(points[:, 0]))
    np.testing.assert_allclose(runs.nominal["x"], 2.0 * np.cos(3.0 * T))
    assert same(spring_study(units={"x": "m"}).run({"size": points[:, 1], "stiffness": points[:, 0]}), runs)
    table = runs.to_xarray()
    assert table["x"].dims == ("run", "t") and table["x"].attrs["units"] == "m"
    assert list(runs.to_dict()) == ["run", "parameters.stiffness", "parameters.size", "features.period"]


def test_a_number_of_runs_are_independent_draws():
    runs, sample = crank_study().run(24, rng=5), crank_study().sample(24, rng=5)
    assert runs.independent and np.array_equal(runs.parameters, sample.parameters)
    assert np.array_equal(runs["slider.x"], sample["slider.x"].runs) and runs.stats == sample.stats
    assert same(runs.extremes().bands, sample.bands)
    assert runs.extremes().features["stroke"].interval == sample.features["stroke"].interval


def test_answers_are_those_of_a_table_and_make_no_run():
    given = {"independent": True, "intervals": BOX, "units": {"x": "m"}}
    runs = spring_study(units={"x": "m"}).run(60)
    made = len(calls)
    points = np.vstack([runs.parameters, [9.0, 2.0]])
    columns = dict(zip(BOX, points.T, strict=True))
    values = {"x": np.vstack([runs["x"], runs.nominal["x"]]), "period": 2.0 * np.pi / np.sqrt(points[:, 0])}
    table = cc.Study.from_runs(columns, T, values, **given)
    for coverage in (0.9, 0.999):
        band, other = runs.band(coverage=coverage), table.band(coverage=coverage)
        assert same(band.bands, other.bands) and band.requirement == other.requirement
    assert len(calls) == made
    hull = runs.band(coverage=0.9)["x"].hull
    np.testing.assert_array_equal(hull, [runs["x"].min(axis=0), runs["x"].max(axis=0)])
    with pytest.raises(ArgumentError, match="no further ones"):
        runs.band().extend(3)


def test_some_runs_and_the_others_are_all(runs):
    first, rest = runs[:10], runs[10:]
    assert len(first) == 10 and first.independent and first + rest == runs
    assert (first + rest).parameters.tolist() == runs.parameters.tolist()
    assert first + runs[5:] == first + rest  # those at the same point count once
    long = runs[runs.parameters[:, 0] > 0.12]
    assert (long.parameters[:, 0] > 0.12).all() and 0 < len(long) < 24 and not long.independent
    assert runs[[3, -1]].parameters.tolist() == runs.parameters[[3, -1]].tolist()
    assert [one["slider.x"].shape for one in runs][:2] == [(1, 31)] * 2
    assert np.array_equal(runs[-1]["slider.x"][0], runs["slider.x"][-1])
    assert list(runs["slider.*"]) == ["slider.x", "slider.vx"] and "slider.x" in runs
    study = crank_study()
    assert same(study.run(24)[:10], first) and len(study.run(8) + study.run(8, rng=1)) == 16


OTHERS = {
    "mechanism": cc.Study(spring, BOX),
    "duration: 0.03 and 0.02": crank_study(duration=0.02),
    "rtol": crank_study(rtol=1e-8),
    "fixed": crank_study(fixed={"crank_mass": 0.4}),
    "feature": crank_study(features=None),
    "outputs": crank_study(outputs=["slider.x"]),
    "interval of rod_length": cc.Study(
        cc.mechanisms.slider_crank,
        ROD | {"rod_length": cc.Interval.around(0.12, rel=0.02)},
        ["slider.x", "slider.vx"],
        features={"stroke": cc.features.peak_to_peak("slider.x")},
        duration=0.03,
        samples=31,
    ),
}


@pytest.mark.parametrize("words", OTHERS)
def test_runs_of_two_studies_are_not_added(runs, words):
    with pytest.raises(ArgumentError, match=words):
        runs + OTHERS[words].run(2)


def test_copies_and_files_are_equal(runs, tmp_path):
    for one in (runs, spring_study().run(3)):
        for other in (
            pickle.loads(pickle.dumps(one)),
            copy.deepcopy(one),
            cc.load_result(one.save(tmp_path / "r")),
        ):
            assert other == one
            assert same(other.band(coverage=0.5).bands, one.band(coverage=0.5).bands)
    assert runs != runs[:10] and runs != 3
    with pytest.raises(ValueError, match="read-only"):
        runs.parameters[0] = 0.0


def test_failed_runs_are_named():
    def model(a):
        if a > 0.9:
            raise ValueError("too large")
        return {"t": T, "x": a * T}

    runs = cc.Study(model, {"a": cc.Interval(0.0, 1.0)}).run([[0.1], [0.95], [0.3]])
    assert len(runs) == 2 and [one.index for one in runs.failures] == [1] and "failed" in repr(runs)
    assert [one.code for one in runs.notices] == ["failed"]


@pytest.mark.parametrize(
    ("points", "names"),
    [
        (0, ["points"]),
        (2_000_000, ["points"]),
        ("many", ["points"]),
        ([0.12, 0.05], ["points"]),
        ([[0.12, 0.05, 1.0]], ["points"]),
        ([[0.12, np.nan]], ["points"]),
        ([[0.12, 0.06]], ["points"]),
        ({"rod_length": [0.12]}, ["points"]),
        ({"rod_length": [0.12], "crank_length": [0.05, 0.051]}, ["points"]),
        (np.empty((0, 2)), ["points"]),
    ],
)
def test_points_that_are_none_are_refused(points, names):
    with refuses(*names):
        crank_study().run(points)


def test_a_seed_and_rows_that_are_none_are_refused(runs):
    with refuses("rng"):
        crank_study().run(3, rng=-1)
    with pytest.raises(IndexError):
        runs[24]
    for which in (None, 1.5, [30], np.ones(7, dtype=bool)):
        with pytest.raises(ArgumentError):
            runs[which]
    with pytest.raises(cc.errors.UnknownNameError, match=r"slider\.x"):
        runs["slider.y"]
    with pytest.raises(TypeError):
        runs + 3
    table = cc.Study.from_runs({"a": [0.0, 0.5, 1.0]}, None, {"b": [1.0, 2.0, 3.0]})
    with refuses("study"):
        table.run(3)
