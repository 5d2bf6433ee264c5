"""Results at a prompt: mappings and tables that NumPy and pandas users know, and reprs that fit a screen."""

import dataclasses
import math
import pydoc
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import chebclear as cc
import numpy as np
import pytest
from chebclear.base.files import same
from chebclear.base.shown import Shown
from public_names import public_names

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

EXAMPLE = Path(__file__).parents[3] / "examples" / "slider_crank.toml"
BOX = {"crank_length": cc.Interval.around(0.05, rel=0.01), "clearance": cc.Interval.around(2e-5, rel=0.1)}
# Records that a scene is made of, and arguments: what they hold is short, and shown so that it can be typed.
PUBLIC = public_names()
PLAIN = {
    *("Body", "Revolute", "Prismatic", "Fixed", "ClearanceRevolute", "Gravity", "Spring", "Damper", "Force"),
    *("TorsionSpring", "TorsionDamper", "Torque", "Speed", "Motion", "Harmonic", "Polynomial", "Table"),
    *("BodyStart", "JointStart", "ClearanceStart", "Flores", "Hertz", "HuntCrossley", "LankaraniNikravesh"),
    *("ModifiedCoulomb", "SmoothedCoulomb", "Interval", "Feature", "Problem", "Parameter"),
    *(
        "Normal",
        "Capable",
        "Inspected",
        "Skewed",
        "Sampled",
        "Eccentric",
        "Lognormal",
        "Uniform",
        "Triangular",
    ),
}


@pytest.fixture(scope="module")
def run():
    return cc.simulate(cc.mechanisms.slider_crank(), duration=0.004, samples=41, error="estimate")


@pytest.fixture(scope="module")
def results(run):
    """One of every public type of result, with many outputs where there can be many."""
    build, time = cc.mechanisms.slider_crank, {"duration": 4e-4, "samples": 9}
    study = cc.Study(build, BOX, **time, features={"peak": cc.features.peak("slider.ax")})
    chebyshev, sample = study.chebyshev(1), study.sample(24)
    ideal = cc.Study(build, {"crank_length": BOX["crank_length"]}, fixed={"clearance_at": ()}, **time)
    ideal = ideal.chebyshev(1)
    band, feature = chebyshev["slider.x"], sample.features["peak"]
    bounds = cc.study_tradeoff(cc.Study(build, BOX, ["slider.x"], **time), (1,), (2,), holdout=3)
    runs = cc.tradeoff(run.scene, duration=4e-4, samples=9, rtols=[1e-4], methods=["auto"], repeats=1)
    template = cc.load(EXAMPLE)
    found = [
        *(run, run.events, run.contacts, run.events[0], run.contacts[0], run.end, run.stats, run.settings),
        *(run.error, run.peak("slider.x"), run.scene, run.scene.check(), study, chebyshev, band, band.margin),
        *(band.surrogate, band.surrogate.range(), band.variance_shares(), sample.features, feature),
        *(feature.interval, feature.effects, feature.effects.scatter, feature.ranking()),
        *(
            feature.ranking().rows[0],
            cc.compare(chebyshev, sample),
            cc.compare(chebyshev, sample)["slider.x"],
        ),
        *(bounds, bounds.points[0], bounds.recommendation(), runs, runs.points[0], runs.recommendation(1e-2)),
        band.quantiles({"crank_length": cc.uniform(0.0495, 0.0505)}, draws=200),
        cc.restraint_zones(chebyshev["slider.vx"], ideal["slider.vx"], "crank_length", window=1e-4),
        *(template, cc.animate(run), next(iter(feature.effects.swings.values()))),
        cc.bifurcation(build, "clearance", [2e-5, 3e-5], periods=2, discard=1, rtol=1e-3),
        study.plan("scan", points=3),
        cc.results.FailedRun(
            3, {"crank_length": 0.05}, "max_steps", "the allowed number of steps was used up", 0.01
        ),
    ]
    return {type(each).__name__: each for each in found}


def test_every_public_result_shows_what_matters_in_a_dozen_lines(results):
    types = {name: one for name, one in PUBLIC.items() if isinstance(one, type) and name not in PLAIN}
    types = {name: one for name, one in types.items() if not issubclass(one, Exception | Warning)}
    # What no example is made of here has the repr of its base, which is as short, or is a tuple of numbers.
    missing = [
        one for name, one in types.items() if name not in results and not issubclass(one, (Shown, tuple))
    ]
    assert all(one.__repr__ is not object.__repr__ for one in missing), missing
    for name, result in results.items():
        text = repr(result)
        assert name in text or name in ("Comparison", "Ranking"), text
        assert len(text.splitlines()) <= 12 and max(map(len, text.splitlines())) <= 120, text
        assert "object at 0x" not in text, text


def test_many_outputs_and_contacts_are_shown_by_the_first_ones(run):
    many = dataclasses.replace(
        run.contacts,
        **{
            item.name: np.resize(getattr(run.contacts, item.name), 100)
            for item in dataclasses.fields(cc.results.Contacts)
        },
    )
    lines = repr(many).splitlines()
    assert len(lines) == 12 and lines[0] == "<Contacts: 100 in wrist>" and "..." in lines
    assert lines[1].split()[:3] == ["joint", "onset", "[s]"]
    assert repr(many[:0]) == "<Contacts: 0>"
    bodies = [cc.Body(f"body {number}", 1.0, 1.0) for number in range(30)]
    assert "body 7 and 22 more" in repr(cc.Scene(bodies, []))


@pytest.mark.parametrize("kind", ["Trajectory", "ErrorEstimate", "StudyResult", "FeatureTable", "Comparison"])
def test_results_are_mappings_from_names(results, kind):
    result = results[kind]
    names = list(result)
    assert isinstance(result, Mapping) and len(result) == len(names) > 0
    assert list(result.keys()) == names == result._ipython_key_completions_() == list(dict(result))
    for name, value, (key, item) in zip(names, result.values(), result.items(), strict=True):
        assert (
            key == name and same(value, result[name]) and same(item, value) and same(result.get(name), value)
        )
    assert same({**result}[names[-1]], result[names[-1]])
    assert names[0] in result and "no such name" not in result and result.get("no such name") is None
    assert "*" not in result
    some = result[f"{names[0][:2]}*"]
    assert type(some) is dict and list(some) == [name for name in names if name.startswith(names[0][:2])]
    assert some.keys() == result.matching(f"{names[0][:2]}*").keys()
    with pytest.raises(cc.errors.UnknownNameError):
        result["zzz*"]
    with pytest.raises(cc.errors.UnknownNameError):
        result["zzz"]


def test_every_table_is_one_in_a_notebook(results):
    for kind, result in results.items():
        if isinstance(result, Mapping) or hasattr(result, "to_csv"):
            shown = result._repr_html_()
            assert shown.count("<table") == shown.count("</table>") == 1 and "<script" not in shown, kind
            assert shown.count("<tr") > 1, kind


def test_a_run_is_an_array_and_a_table_for_others(run):
    array = np.asarray(run)
    assert array.shape == (len(run.t), len(run)) and np.shares_memory(array, run.samples)
    assert np.array_equal(array[:, 2], run[list(run)[2]])
    assert np.array(run, dtype=np.float32).dtype == np.float32
    own = np.array(run)
    own[0, 0] += 1.0  # a copy of the user's
    pandas = pytest.importorskip("pandas")
    series = pandas.Series(run)
    assert list(series.index) == list(run) and np.array_equal(series["slider.x"], run["slider.x"])
    assert np.array_equal(pandas.DataFrame(run).to_numpy(), run.samples)
    assert list(pandas.DataFrame(dict(run)).columns) == list(run)


def test_a_run_that_a_feature_gets_is_a_mapping_too():
    seen = []

    def spread(run):
        seen.append((dict(run), run.samples, "slider.x" in run, len(run), list(run["slider.*"])))
        return float(np.ptp(run["slider.x"]))

    time = {"duration": 4e-4, "samples": 9}
    study = cc.Study(
        cc.mechanisms.slider_crank, BOX, ["slider.x", "crank.angle"], features={"s": spread}, **time
    )
    result = study.sample(2)
    columns, samples, has, count, found = seen[0]
    assert list(columns) == ["slider.x", "crank.angle"] and np.array_equal(columns["slider.x"], samples[:, 0])
    assert has and count == 2 and found == ["slider.x"]
    assert len(result.features["s"].values) == 2


def test_a_feature_in_the_place_of_an_output_is_named(results):
    result = results["StudyResult"]
    with pytest.raises(cc.errors.UnknownNameError):
        result["peak"]
    assert result.features["peak"].name == "peak"


def test_columns_by_pattern_are_views_in_their_order(run):
    found = run["slider.[xy]"]
    assert list(found) == ["slider.x", "slider.y"]
    assert np.shares_memory(found["slider.x"], run.samples)
    assert list(run["SLIDER.*".lower()]) == [name for name in run if name.startswith("slider.")]
    with pytest.raises(KeyError):
        run["SLIDER.*"]
    assert run.samples.shape == (len(run.t), len(run))


def test_bands_are_the_values_of_a_result(results):
    result = results["StudyResult"]
    assert list(result.values()) == [result[name] for name in result]
    assert np.array_equal(result.values("slider.x"), result["slider.x"].runs)


def test_a_name_that_looks_like_a_pattern_is_found_first():
    bodies = [cc.Body("a[1]", 1.0, 1.0), cc.Body("a1", 1.0, 1.0)]
    run = cc.simulate(cc.Scene(bodies, [cc.Revolute("pin", "a[1]", "a1")]), duration=0.1, samples=2)
    assert isinstance(run["a[1].x"], np.ndarray) and list(run["a*.x"]) == ["a[1].x", "a1.x"]


@pytest.mark.parametrize("name", ["events", "contacts"])
def test_events_and_contacts_are_tables_of_records(run, name):
    table = getattr(run, name)
    names = [item.name for item in dataclasses.fields(table)]
    assert isinstance(table, Sequence) and len(table) > 3
    for index, record in enumerate(table):
        assert [item.name for item in dataclasses.fields(record)] == names
        for field in names:
            value, column = getattr(record, field), getattr(table, field)
            assert type(value) in (float, str) and (value == column[index] or math.isnan(column[index]))
        assert record == table[index] == table[index - len(table)]
    assert table[0] in table and table.index(table[2]) == 2
    last = table[np.int64(-1)]
    assert type(last) is type(table[0])
    with pytest.raises(IndexError):
        table[len(table)]


def test_parts_of_a_table_are_tables(run):
    contacts = run.contacts
    assert contacts[1:3] == contacts[[1, 2]] and len(contacts[1:3]) == 2
    strong = contacts[contacts.peak_force > np.median(contacts.peak_force)]
    assert isinstance(strong, cc.results.Contacts) and 0 < len(strong) < len(contacts)
    assert contacts[:0] == contacts[len(contacts) :] and not contacts[:0]
    lasting = [each.duration for each in contacts]
    np.testing.assert_array_equal(lasting, contacts.duration)


@pytest.mark.parametrize("name", sorted(set(PUBLIC) - PLAIN))
def test_help_shows_the_fields_of_a_result(name):
    record = PUBLIC[name]
    if not (isinstance(record, type) and dataclasses.is_dataclass(record)):
        return
    text = pydoc.plain(pydoc.render_doc(record)).partition("Methods defined here")[0]
    hidden = {"row", "source", "angles"}
    for item in dataclasses.fields(record):
        if not item.name.startswith("_") and item.name not in hidden:
            assert re.search(rf"\b{item.name}(, \w+)* : |, {item.name}(, \w+)* : ", text), item.name
