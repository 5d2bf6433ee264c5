"""Every result is one record: equal to its copies, whatever it holds, and nothing in it can be changed."""

import copy
import dataclasses
import functools
import inspect
import pickle
import warnings

import chebclear as cc
import numpy as np
import pytest

T = np.linspace(0.0, 1.0, 33)
BOX = {"a": cc.Interval("0.9 m", "1.1 m"), "b": cc.normal(2.0, 0.05)}
LIMITS = {"low": cc.require("x", above=-1.3), "end": cc.require("top", below=2.4)}
WEAR = {"wrist": cc.laws.Archard(coefficient=1e-4, hardness=1e9, length=0.02)}
# Types that are arguments too, which are compared as the numbers they hold.
ARGUMENTS = {"Lognormal", "Normal", "Triangular", "Uniform", "Parameter", "Template", "Specification"}


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
