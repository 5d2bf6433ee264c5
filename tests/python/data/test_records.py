"""Every result is one record: equal to its copies, whatever it holds, and nothing in it can be changed."""

import copy
import dataclasses
import functools
import inspect
import json
import pickle
import re
import warnings

import chebclear as cc
import numpy as np
import pytest
from exported import check_exports

T = np.linspace(0.0, 1.0, 33)
BOX = {"a": cc.Interval("0.9 m", "1.1 m"), "b": cc.normal(2.0, 0.05)}
LIMITS = {"low": cc.require("x", above=-1.3), "end": cc.require("top", below=2.4)}
WEAR = {"wrist": cc.laws.Archard(coefficient=1e-4, hardness=1e9, length=0.02)}
# Types that are arguments too, which are compared as the numbers they hold.
ARGUMENTS = {"Lognormal", "Normal", "Triangular", "Uniform", "Parameter", "Template", "Specification"}
ARGUMENTS |= {"Capable", "Eccentric", "Inspected", "Sampled", "Skewed"}


def model(a, b):
    if a > 1.095 and b > 2.05:
        raise ValueError("none there")
    return {"t": T, "x": a * T - b * T**2, "top": a * b}


def study(**options):
    return cc.Study(
        model, BOX, features={"low": cc.features.lowest("x")}, units={"x": "m", "a": "m"}, **options
    )


def spread():
    return cc.Study(lambda b: {"top": b}, {"b": cc.normal(2.0, 0.05)})


def trace():
    run = model(1.0, 2.0)
    return cc.results.Measured({"x": run["x"]}, {"x": "m"}, t=T)


def identified():
    named = cc.Study(model, {"a": cc.Interval(0.9, 1.09), "b": cc.Interval(1.8, 2.2)})
    wanted = {"mean": cc.features.mean("x"), "most": cc.features.MagnitudeQuantile("x", 0.9)}
    return cc.identify(named, trace(), ["a", "b"], wanted, runs=100, noise={"x": 0.01})


@functools.cache
def swept():
    crank = cc.Study(
        cc.mechanisms.slider_crank,
        {"clearance": cc.Interval(1e-5, 3e-5)},
        ["slider.x"],
        fixed={"clearance_at": ("wrist",)},
        features={"peak": cc.features.peak("slider.ax")},
        duration=1.0,
        rtol=1e-3,
    )
    return crank.sweep("crank_speed", 100.0, 200.0, points=3, revolutions=8, discard=0)


def failed_sweep():
    """A sweep of which a run failed, whose numbers are NaN."""
    found = swept()
    table = {
        name: np.where(found.points[:, None] > 150.0, np.nan, one) for name, one in found.features.items()
    }
    return dataclasses.replace(found, features=table)


@functools.cache
def moving():
    scene = cc.mechanisms.slider_crank(clearance_at=("wrist",))
    return cc.simulate(scene, duration=4 * scene.period, samples=145, rtol=1e-3, error="estimate")


def block():
    body = cc.Body("block", mass=2.0, inertia=1.0)
    rail = cc.Prismatic("rail", "ground", "block", axis=(1.0, 0.0))
    spring = cc.Spring("spring", "ground.far", "block", stiffness=200.0, length=1.0)
    return cc.Scene([body], [rail], [spring], ground={"far": (-1.0, 0.0)})


def effects():
    return study().sample(60).features["low"]


def constant():
    """Effects on a feature that is the same in every run: they are NaN."""
    made = cc.Study(lambda a: {"level": 1.0 + 0.0 * a}, {"a": cc.Interval(0.0, 1.0)})
    return made.sample(20).features["level"]


@functools.cache
def runs_tradeoff():
    return cc.tradeoff(moving().scene, duration=4e-4, samples=9, rtols=[1e-4], methods=["auto"], repeats=1)


MADE = {
    "sweep": swept,
    "sweep with failures": failed_sweep,
    "modes": lambda: cc.modes(block()),
    "lost motion": lambda: cc.lost_motion(cc.mechanisms.slider_crank(), "slider", (1.0, 0.0), angles=9),
    "spectrum": lambda: moving().spectrum("slider.ax", angle="crank"),
    "cycles": lambda: moving().cycles("slider.ax"),
    "allocation": lambda: cc.allocate(study(), {"b": {0.05: 5, 0.15: 3}}, LIMITS["low"], 0.9, 200),
    "contrast": lambda: cc.contrast(study(), study(), LIMITS, 20),
    "identification": identified,
    "wear life": lambda: cc.laws.wear_life(
        cc.mechanisms.slider_crank(clearance_at=("wrist",)),
        WEAR,
        limit=5e-6,
        requirement=cc.require("slider.x", below=0.2),
        depth_per_jump=5e-6,
        rtol=1e-3,
        settle=1,
        measure=1,
    ),
    "measured": trace,
    "agreement": lambda: trace().compare(study().band(9)["x"]),
    "function": lambda: study().function("low"),
    "effects": lambda: (effects(), effects().effects, effects().interval),
    "events": lambda: (moving().events[0], moving().contacts[0]),
    "tradeoff": lambda: runs_tradeoff(),
    "recommendation": lambda: runs_tradeoff().recommendation(1e-2),
    "study tradeoff": lambda: cc.study_tradeoff(study(), (1,), (2,), holdout=3),
    "rare share": lambda: cc.rare_share(spread(), cc.require("top", below=2.0), plain=500, factor=2.0),
    "systems": lambda: cc.results.SplittingSystems(*np.array([[4.0, np.nan], [0.3, 0.2], [0.5, 0.4]])),
    "polynomial": lambda: study().chebyshev(1)["x"].surrogate.range(),
    "parts": lambda: (
        cc.results.Resonance(1.0, np.nan, 0.5, 2.0),
        cc.results.LiftOff("wrist", 1.0, np.nan, loses=True),
        cc.results.SplittingSystem(4.0, np.nan, 0.5),
        cc.results.NearLimits(100, 10, 1, 20, 0, np.nan, 0.95),
        cc.results.Cause("a", "m", 1.0, 2.0, 0.1, 0.0, 0.5, {"mean": np.nan}, {"mean": 1.0}),
        cc.results.FailedRun(3, {"a": 1.0}, "model", "none there", np.nan, None),
    ),
    "runs": lambda: study().run(5),
    "centering": lambda: cc.center(
        spread(), cc.require("top", below=2.02), move={"b": cc.Interval(1.9, 2.1)}, runs=300
    ),
    "stack-up": lambda: cc.stack_up(spread(), cc.require("top", below=2.1)),
    "plan": lambda: study().plan("scan", points=3),
    "band": lambda: study(requirements=LIMITS).band(41),
    "ranking": lambda: effects().ranking(),
    "ranking of a constant": lambda: constant().ranking(),
    "estimate": lambda: constant().effects.scatter,
    "swing": lambda: constant().effects.swings,
    "shares": lambda: study().chebyshev(1)["x"].variance_shares(),
    "conformance": lambda: cc.conformance(study(), LIMITS, 100),
    "sure": lambda: effects().interval.sure,
    "run": moving,
    "end": lambda: moving().end,
    "extremum": lambda: moving().peak("slider.x"),
    "inspection": lambda: moving().scene.check(),
    "restraint": lambda: cc.restraint_zones(*(study().chebyshev(1)["x"] for _ in "12"), "a", window=0.1),
    "quantiles": lambda: study().chebyshev(1)["x"].quantiles({"a": cc.uniform(0.9, 1.1)}, draws=200),
    "comparison": lambda: cc.compare(study().chebyshev(1), study().scan(3)),
    "bifurcation": lambda: cc.bifurcation(
        cc.mechanisms.slider_crank, "clearance", [2e-5, 3e-5], periods=2, discard=1, rtol=1e-3
    ),
}
WAYS = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda result: pickle.loads(pickle.dumps(result)),
}


@pytest.fixture(autouse=True)
def quiet():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


@pytest.fixture(scope="module", params=MADE)
def result(request):
    if request.param == "cycles":
        pytest.importorskip("rainflow")
    return made(request.param)


@functools.cache
def made(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return MADE[name]()


@pytest.mark.parametrize("way", WAYS)
def test_a_result_is_equal_to_its_copies(result, way):
    if type(result) is tuple:
        for part in result:
            test_a_result_is_equal_to_its_copies(part, way)
        return
    other = WAYS[way](result)
    assert other == result and not other != result
    assert repr(other) == repr(result) and str(other) == str(result)
    assert result != "another" and result != None  # noqa: E711


def parts_of(value, seen):
    """Everything that a result holds, itself first, by identity."""
    if id(value) in seen or isinstance(value, cc.Study):
        return
    seen[id(value)] = value
    if dataclasses.is_dataclass(value):
        # What a function or a template is made of is its own, and no number of a result.
        own = isinstance(value, cc.results.StudyFunction | cc.results.Template)
        names = [item.name for item in dataclasses.fields(value) if not (own and item.name.startswith("_"))]
        inner = [getattr(value, name) for name in names if name != "build"]
    elif isinstance(value, dict):
        inner = list(value.values())
    else:
        inner = list(value) if isinstance(value, list | tuple) else []
    for item in inner:
        parts_of(item, seen)


def test_nothing_in_a_result_can_be_changed(result):
    for way in WAYS.values():
        parts = {}
        parts_of(way(result), parts)
        for part in parts.values():
            assert not isinstance(part, list | set), part
            if isinstance(part, np.ndarray):
                assert not part.flags.writeable
            elif isinstance(part, dict):
                with pytest.raises(TypeError):
                    part["new"] = 1
            elif dataclasses.is_dataclass(part) and not isinstance(part, cc.results.StudyFunction):
                for item in dataclasses.fields(part):
                    with pytest.raises(dataclasses.FrozenInstanceError):
                        setattr(part, item.name, None)


def test_every_public_type_of_result_is_among_these():
    parts = {}
    for name in MADE:
        parts_of(made(name), parts)
    types = {type(part) for part in parts.values()}
    wanted = {getattr(cc.results, name) for name in set(cc.results.__all__) - ARGUMENTS}
    assert all(map(inspect.isclass, wanted)) and wanted - types == set()


def test_a_pickled_function_and_identification_make_the_same_runs():
    function = study().function("low")
    points = np.array([[1.0, 2.0], [0.95, 2.1]])
    for way in WAYS.values():
        other = way(function)
        assert np.array_equal(other(points), function(points)) and other == function
    assert function.calls == 6 and function != study().function("top")
    found = made("identification")
    for parameters in ({"a": 1.0, "b": 2.0}, {"a": 0.9, "b": 1.8}):
        inside = [way(found).contains(parameters, runs=10) for way in WAYS.values()]
        assert inside == [found.contains(parameters, runs=10)] * len(WAYS)


def test_a_saved_result_is_equal_to_its_file(result, tmp_path):
    if not hasattr(result, "save"):
        pytest.skip("a part of other results")
    path = result.save(tmp_path / "result")
    for other in (cc.load_result(path), type(result).load(path)):
        assert other == result and repr(other) == repr(result) and str(other) == str(result)
        test_nothing_in_a_result_can_be_changed(other)


SAVED = ["sweep", "modes", "lost motion", "spectrum", "cycles", "wear life", "allocation", "contrast"]
SAVED += ["identification", "measured", "centering", "stack-up", "runs"]


@pytest.mark.parametrize("name", SAVED)
def test_a_damaged_file_is_refused(name, tmp_path):
    if name == "cycles":
        pytest.importorskip("rainflow")
    whole = made(name).save(tmp_path / "whole").read_bytes()
    damaged = tmp_path / "damaged.npz"
    for length in (0, 10, len(whole) // 2, len(whole) - 30):
        damaged.write_bytes(whole[:length])
        with pytest.raises(cc.errors.ArgumentError, match=re.escape(str(damaged))):
            cc.load_result(damaged)
    with np.load(tmp_path / "whole.npz") as archive:
        arrays = {key: archive[key] for key in archive.files}
    facts = json.loads(str(arrays.pop("metadata")))
    wrong = [
        (arrays, facts | {"record": facts["record"] | {field: {"x": [["!"]]}}}) for field in facts["record"]
    ]
    less = dict(list(facts["record"].items())[1:])
    wrong += [(arrays, facts | {"record": less}), (arrays, facts | {"record": facts["record"] | {"more": 1}})]
    for key, array in arrays.items():
        wrong.append(({other: one for other, one in arrays.items() if other != key}, facts))
        # What its own list of members says too, so that only the result itself can know.
        for other in (array[..., None], np.full(array.shape, "x")):
            members = facts["members"] | {key: list(other.shape)}
            wrong.append((arrays | {key: other}, facts | {"members": members}))
    for others, said in wrong:
        np.savez(damaged, **others, metadata=np.array(json.dumps(said)))
        with pytest.raises((cc.errors.ArgumentError, cc.errors.SceneError)):
            cc.load_result(damaged)
            print(others.keys(), said)  # of what was read all the same


def test_every_result_with_a_file_is_known_to_load_result():
    known = {name for name in MADE if hasattr(made(name), "save")}
    assert known >= set(SAVED)
    loaded = {type(made(name)) for name in known}
    assert {one for one in vars(cc.results).values() if hasattr(one, "load")} <= loaded


def test_an_identification_from_a_file_makes_further_runs(tmp_path):
    crank = cc.Study(
        cc.mechanisms.slider_crank,
        {"rod_length": cc.Interval("119 mm", "121 mm")},
        ["slider.x"],
        fixed={"clearance_at": ()},
        duration=0.01,
        samples=41,
    )
    run = cc.simulate(cc.mechanisms.slider_crank(clearance_at=()), duration=0.01, samples=41)
    measured = cc.results.Measured({"slider.x": run["slider.x"]}, t=run.t)
    wanted = {"rms": cc.features.rms("slider.x"), "most": cc.features.MagnitudeQuantile("slider.x", 0.9)}
    noise = {"slider.x": "0.1 mm"}
    found = cc.identify(crank, measured, ["rod_length"], wanted, runs=100, noise=noise)
    loaded = cc.load_result(found.save(tmp_path / "found"))
    assert loaded == found and loaded.intervals["rod_length"].unit == "mm"
    for length in (0.1195, 0.12):
        inside = found.contains({"rod_length": length}, runs=10)
        assert loaded.contains({"rod_length": length}, runs=10) == inside
    # Python functions do not travel into files.
    alone = cc.load_result(made("identification").save(tmp_path / "alone"))
    with pytest.raises(cc.errors.ArgumentError, match=r"test_records\.model"):
        alone.contains({"a": 1.0, "b": 2.0}, runs=10)


# Of each result: the axis of its table, and a column with its unit and values.
COLUMNS = {
    "sweep": ("point", "peak.mean", "m/s²", lambda one: one["peak"].mean(axis=1)),
    "modes": ("mode", "frequency", "Hz", lambda one: one.frequencies),
    "lost motion": ("angle", "shares.wrist", "m", lambda one: one["wrist"]),
    "spectrum": ("order", "amplitude", "m/s²", lambda one: one.amplitude),
    "cycles": ("cycle", "range", "m/s²", lambda one: one.ranges),
    "wear life": ("run", "depth", "m", lambda one: one.depth),
    "allocation": ("row", "after", "", lambda one: [one["b"].after]),
    "contrast": ("row", "confidence", "-", lambda one: [0.95] * 4),
    "identification": ("point", "parameters.a", "", lambda one: one.points[:, 0]),
    "measured": ("t", "x", "m", lambda one: one["x"]),
    "centering": ("row", "after", "", lambda one: [one["b"].after]),
    "stack-up": ("row", "monte_carlo.upper", "", lambda one: [one["top below 2.1"].monte_carlo[1]]),
    "runs": ("run", "features.low", "m", lambda one: one.features["low"].values[:, 0]),
    "agreement": ("t", "excess", "m", lambda one: one.excess),
    "conformance": ("row", "upper", "-", lambda one: [each.upper for each in one.values()]),
    "rare share": ("mechanism", "parameters.b", "", lambda one: one.mechanisms[:, 0]),
}


@pytest.mark.parametrize("name", COLUMNS)
def test_every_result_has_every_export_with_units(name, tmp_path):
    if name == "cycles":
        pytest.importorskip("rainflow")
    check_exports(made(name), *COLUMNS[name], tmp_path)


def test_exports_have_all_that_a_result_holds():
    pytest.importorskip("xarray")
    modes, data = made("modes"), made("modes").to_xarray()
    assert np.array_equal(data["shapes.x.real"] + 1j * data["shapes.x.imaginary"], modes.shapes[:, :, 0])
    assert list(data["body"].values) == list(modes.bodies) and data["poses.angle"].attrs["units"] == "rad"
    sweep, data = made("sweep"), made("sweep").to_xarray()
    assert np.array_equal(data["peak.revolutions"], sweep["peak"])
    assert np.array_equal(data["peak.median"], np.median(sweep["peak"], axis=1))
    assert np.array_equal(data["parameters.crank_speed"], sweep.points)
    life, data = made("wear life"), made("wear life").to_xarray()
    assert np.array_equal(data["profiles.wrist"], life.profiles["wrist"])
    assert np.array_equal(data["slider.x.highest"], life.values[:, 1])
    pairs, data = made("contrast"), made("contrast").to_xarray()
    assert np.array_equal(data["features.low.second"], pairs.features["low"].second)
    allocation = made("allocation").to_dict()
    assert list(allocation["name"]) == ["b"] and list(allocation["cost_after"]) == [5.0]


def test_every_result_with_a_file_has_exports():
    saved = {name for name in MADE if hasattr(made(name), "save")}
    assert all(hasattr(made(name), "to_csv") for name in saved)
