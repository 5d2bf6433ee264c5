"""A result is the same result however it was copied, pickled, or saved and loaded."""

import copy
import dataclasses
import pickle
import subprocess
import sys
import warnings

import chebclear as cc
import numpy as np
import pytest
from chebclear import _core
from chebclear.base.files import same
from chebclear.study.report.script import study_listings

T = np.linspace(0.0, 1.0, 11)
SHORT = {"duration": 2e-3, "samples": 9, "skip": 0.01}
CRANK = cc.normal(0.05, 1e-4)
PRESS = """
format = 1
title = "pendulum"
parameters.length = { nominal = "400 mm", plus = "8 mm" }
parameters.mass = "1 kg"
bodies = [{ name = "bob", mass = "mass", inertia = "mass * length**2 / 12", points.A = ["-length / 2", 0] }]
joints = [{ type = "revolute", name = "pin", a = "ground", b = "bob.A" }]
features.reach = "peak(bob.x)"
[run]
duration = 0.2
samples = 11
rtol = 1e-7
outputs = ["bob.*"]
"""


def model(a, b, exponent=2):
    if a > 1.095 and b > 2.15:
        raise ValueError("none there")
    return {"t": T, "x": a * T - b * T**exponent, "top": a * b}


def area(run):
    return float(np.sum(run["slider.x"]))


def slider_crank(**options):
    return cc.Study(
        cc.mechanisms.slider_crank,
        {"rod_length": cc.Interval.around(0.12, rel=0.01), "crank_length": CRANK},
        ["slider.vx", "wrist.normal_force"],
        features={"peak force": cc.features.peak("wrist.normal_force"), "loss": cc.features.loss("wrist")},
        fixed={
            "clearance": 2e-4,
            "friction": cc.laws.SmoothedCoulomb(0.05, 0.01),
            "clearance_at": ("wrist",),
        },
        units={"loss": "J"},
        **{**SHORT, **options},
    )


def own_model(**options):
    box = {"a": cc.Interval.around(1.0, rel=0.1), "b": cc.uniform(1.8, 2.2)}
    return cc.Study(
        model,
        box,
        fixed={"exponent": 3},
        features={"low": cc.features.lowest("x")},
        units={"x": "m"},
        **options,
    )


def table():
    random = np.random.default_rng(3)
    a, b = random.uniform(0.9, 1.1, 24), random.uniform(1.8, 2.2, 24)
    x = a[:, None] * T - b[:, None] * T**2
    return cc.Study.from_runs(
        {"a": a, "b": b}, T, {"x": x, "top": a * b}, features={"low": cc.features.lowest("x")}
    )


KINDS = {
    "band": lambda: slider_crank().band(9),
    "band of a file": lambda: cc.loads(PRESS).study().band(9),
    "band by angle": lambda: cc.Study(
        cc.mechanisms.slider_crank,
        {"rod_length": cc.Interval.around(0.12, rel=0.01)},
        ["slider.x"],
        samples=13,
        duration=0.1,
    ).band(5, revolutions=3),
    "extended": lambda: slider_crank().band(7).extend(2),
    "chebyshev": lambda: slider_crank().chebyshev(1, bounds="eq31"),
    "scan": lambda: slider_crank(rtol=1e-5).scan(2),
    "sample": lambda: slider_crank().sample(8, rng=4),
    "a callable feature": lambda: cc.Study(
        cc.mechanisms.slider_crank,
        {"rod_length": cc.Interval.around(0.12, rel=0.01)},
        ["slider.x"],
        features={"area": area},
        **SHORT,
    ).sample(8),
    "features alone": lambda: cc.Study(
        cc.mechanisms.slider_crank,
        {"rod_length": cc.Interval.around(0.12, rel=0.01)},
        [],
        features={"peak": cc.features.peak("slider.x")},
        **SHORT,
    ).sample(8),
    "own model": lambda: own_model().band(21),
    "own model with failures": lambda: own_model().band(81),
    "checked": lambda: own_model().chebyshev(3).check(),
    "table": lambda: table().band(),
}
WAYS = {
    "copy": lambda result, folder: copy.copy(result),
    "deepcopy": lambda result, folder: copy.deepcopy(result),
    "pickle": lambda result, folder: pickle.loads(pickle.dumps(result)),
    "file": lambda result, folder: cc.load_result(result.save(folder / "result")),
    "file and pickle": lambda result, folder: pickle.loads(
        pickle.dumps(cc.load_result(result.save(folder / "result")))
    ),
}


@pytest.fixture(autouse=True)
def quiet():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


@pytest.fixture(scope="module", params=KINDS)
def result(request):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return KINDS[request.param]()


def script_of(result):
    if result.scene is None:  # nothing is said of models of the user's own
        return None
    listing, meaning = study_listings(result)
    return listing.text, meaning


def test_it_is_equal_prints_and_reports_the_same(result, tmp_path):
    own = result.report(tmp_path / "own").read_text(encoding="utf-8")
    for name, travel in WAYS.items():
        other = travel(result, tmp_path)
        assert other == result, name
        assert (str(other), repr(other)) == (str(result), repr(result)), name
        assert script_of(other) == script_of(result), name
        assert other.spec == result.spec and other.spec.facts() == result.spec.facts(), name
        if name == "file and pickle":  # as every other way, and reports take their time
            assert other.report(tmp_path / "other").read_text(encoding="utf-8") == own


def test_it_goes_on_with_the_same_bits(result, tmp_path):
    requirement = result.requirement
    if requirement is None or requirement.finished:
        pytest.skip("only calibrated results can be extended")
    longer = result.extend(3)
    for name, travel in WAYS.items():
        other = travel(result, tmp_path)
        if other.spec.missing:
            assert name.startswith("file") and other.spec.missing == (f"{model.__module__}.model",)
            with pytest.raises(cc.errors.ArgumentError):
                other.extend(3)
            further = result.study.extended(other, 3)
        else:
            further = other.extend(3)
        assert further == longer and same(further.bands, longer.bands), name


def test_it_cannot_be_changed(result, tmp_path):
    for travel in WAYS.values():
        changed_nothing(travel(result, tmp_path), seen=set())


def changed_nothing(value, seen):
    """Whether everything that a result holds refuses a change."""
    if id(value) in seen:
        return
    seen.add(id(value))
    if isinstance(value, np.ndarray):
        assert not value.flags.writeable
    elif isinstance(value, dict):
        with pytest.raises(TypeError):
            value["new"] = 1
        for item in value.values():
            changed_nothing(item, seen)
    elif isinstance(value, tuple):
        for item in value:
            changed_nothing(item, seen)
    elif dataclasses.is_dataclass(value) and not isinstance(value, cc.Study):
        for item in dataclasses.fields(value):
            if item.name != "build":
                changed_nothing(getattr(value, item.name), seen)
            with pytest.raises(dataclasses.FrozenInstanceError):
                setattr(value, item.name, None)
    else:
        assert not isinstance(value, list | set)


@pytest.mark.parametrize(
    "kind", ["band", "band of a file", "band by angle", "extended", "chebyshev", "scan", "sample"]
)
def test_its_script_makes_it_again(kind, tmp_path):
    result = KINDS[kind]()
    for name in ("pickle", "file"):
        text, meaning = script_of(WAYS[name](result, tmp_path))
        assert meaning == "The script of this study"
        names = {}
        exec(text, names)
        made = names["result"]
        assert same(made.bands, result.bands) and same(made.features, result.features)
        assert made.spec.facts()["fixed"] == result.spec.facts()["fixed"]


def test_it_leaves_the_process(tmp_path):
    """Another process knows the mechanism by its name; a function of a module that it lacks is missing."""
    files = []
    for number, result in enumerate((slider_crank().band(5), own_model().band(5))):
        files.append(tmp_path / f"{number}.pickle")
        files[-1].write_bytes(pickle.dumps((result, result.extend(2).bands)))
    code = """
import pickle, sys, warnings
from pathlib import Path
from chebclear import _core
from chebclear.base.files import same
from chebclear.study.report.script import study_listings
warnings.simplefilter("ignore")
result, bands = pickle.loads(Path(sys.argv[1]).read_bytes())
print(same(result.extend(2).bands, bands))
result, _ = pickle.loads(Path(sys.argv[2]).read_bytes())
print(result.spec.missing)
"""
    told = subprocess.run(
        [sys.executable, "-c", code, *map(str, files)],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
    )
    assert told.stdout.split("\n")[:2] == ["True", f"('{model.__module__}.model',)"]


def test_what_cannot_travel_is_named(tmp_path):
    result = cc.Study(
        lambda length: cc.mechanisms.slider_crank(rod_length=length),
        {"length": cc.Interval.around(0.12, rel=0.01)},
        ["slider.x"],
        features={"sum": lambda run: float(np.sum(run["slider.x"]))},
        **SHORT,
    ).band(5)
    for way in ("pickle", "file"):
        other = WAYS[way](result, tmp_path)
        text, meaning = script_of(other)
        assert meaning == "A script of this study, which needs your model"
        assert "test_travel.test_what_cannot_travel_is_named.<locals>.<lambda>" in text
        assert text.count("<lambda>") == 2 and len(other.spec.missing) == 2
        assert script_of(result) == (text, meaning) and other == result


@pytest.mark.parametrize("method", ["band", "sample"])
def test_the_order_of_parameters_does_not_matter(method):
    sides = {
        "crank_length": cc.Interval.around(0.05, rel=0.01),
        "rod_length": cc.Interval.around(0.12, rel=0.01),
    }
    sides |= {"clearance": cc.Interval(1e-5, 3e-5)}
    found = []
    for names in (list(sides), list(sides)[::-1], ["rod_length", "clearance", "crank_length"]):
        study = cc.Study(
            cc.mechanisms.slider_crank, {name: sides[name] for name in names}, ["slider.x"], **SHORT
        )
        result = getattr(study, method)(6, rng=5)
        found.append({name: result.parameters[:, names.index(name)] for name in sides})
        found[-1]["x"] = result.values("slider.x")
    assert all(same(one, found[0]) for one in found[1:])
    # As given in the order of the mechanism's own arguments, as ever.
    cube = _core.sobol_points(3, 0, 6, 5)
    if method == "band":
        assert found[0]["crank_length"] == pytest.approx(0.05 + 0.0005 * cube[:, 0], rel=1e-15)
        assert found[0]["rod_length"] == pytest.approx(0.12 + 0.0012 * cube[:, 1], rel=1e-15)
        assert found[0]["clearance"] == pytest.approx(2e-5 + 1e-5 * cube[:, 2], rel=1e-14)


def test_without_a_signature_points_go_by_the_names():
    def study(names):
        return cc.Study(
            lambda **given: {"s": sum(given.values())}, {name: cc.Interval(0.0, 1.0) for name in names}
        )

    one, other = study("abc").sample(5), study("cab").sample(5)
    assert np.array_equal(one.parameters, other.parameters[:, [1, 2, 0]])


def test_a_comparison_without_a_number_equals_its_copies(tmp_path):
    study = cc.Study(lambda a: {"t": T, "zero": 0.0 * T, "x": a * T}, {"a": cc.Interval.around(1.0, rel=0.1)})
    comparison = cc.compare(study.chebyshev(1), study.scan(2))
    assert np.isnan(comparison["zero"].slack)
    for travel in WAYS.values():
        other = travel(comparison, tmp_path)
        assert other == comparison and other["zero"] == comparison["zero"] and str(other) == str(comparison)
    with pytest.raises(TypeError):
        comparison.errors["x"] = None


def test_a_pickle_does_not_depend_on_what_a_result_was_asked_for():
    result = cc.Study(
        lambda a, b: {"t": [0.0, 1.0], "x": [a, b], "f": a * b},
        {"a": cc.Interval(0.0, 1.0), "b": cc.Interval(1.0, 2.0)},
    ).sample(200)
    before = len(pickle.dumps(result))
    print(result, result.ranking("f"), result["x"].max_width)
    assert len(pickle.dumps(result)) == before
    assert pickle.loads(pickle.dumps(result)) == result
