"""Features over a window of time, angle or any output, against closed forms."""

import math
import pickle

import chebclear as cc
import numpy as np
import pytest
from chebclear import features
from refusals import refuses

METHODS = ["auto", "adams", "dop853", "rodas4", "rodas5p"]
SIZE, OMEGA = 0.3, 20.0


def oscillator():
    """x = 0.3 cos(20 t), free."""
    return cc.Scene(
        [cc.Body("block", 2.0, 1.0)],
        [cc.Prismatic("rail", "ground.O", "block", (1.0, 0.0))],
        [cc.Force("spring", "block", f"{-2.0 * OMEGA**2!r}*block.x", 0.0)],
        ground={"O": (0.0, 0.0)},
        start=[cc.JointStart("rail", SIZE)],
    )


def driven():
    """A crank at 10 rad/s, whose tip is at 0.2 cos(10 t)."""
    return cc.Scene(
        [cc.Body("crank", 1.0, 0.1, points={"tip": (0.2, 0.0)})],
        [cc.Revolute("shaft", "ground", "crank")],
        drives=[cc.motions.Speed("motor", "shaft", 10.0)],
    )


def over(scene, *asked, duration, **options):
    run = cc.simulate(scene, duration=duration, samples=2, features=list(asked), **options)
    return run.features[0] if options.get("cycles") is None else run.features


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("part", [0.9999, 0.99, 0.5, 0.0, -0.7])
def test_a_quantity_above_a_value(method, part):
    """Over eight whole oscillations; the shortest window is a 220th of one, far less than a step."""
    asked = [
        kind("block.x", ("block.x", part * SIZE, None))
        for kind in (features.mean, features.rms, features.lowest, features.peak)
    ]
    asked.append(features.peak("block.vx", ("block.x", part * SIZE, None)))
    duration = 8.0 * 2.0 * math.pi / OMEGA
    mean, rms, lowest, peak, fastest = over(
        oscillator(), *asked, duration=duration, rtol=1e-10, method=method
    )
    half = math.acos(part)
    assert mean == pytest.approx(SIZE * math.sin(half) / half, rel=1e-6)
    assert rms == pytest.approx(SIZE * math.sqrt(0.5 + math.sin(2.0 * half) / (4.0 * half)), rel=1e-6)
    assert lowest == pytest.approx(part * SIZE, abs=1e-7 * SIZE)
    assert peak == pytest.approx(SIZE, rel=1e-7)
    assert fastest == pytest.approx(SIZE * OMEGA * math.sin(min(half, 0.5 * math.pi)), rel=1e-6)


@pytest.mark.parametrize("window", [("80 deg", "120 deg"), (-0.2, 0.1), (3.0, 9.0), ("719 deg", "721 deg")])
def test_an_angle_in_every_turn(window):
    lower, upper = (math.radians(float(one[:-4])) if isinstance(one, str) else one for one in window)
    around = ("crank.angle", *window)
    mean, count = features.mean("crank.tip.x", around), features.rms("crank.tip.x", around)
    found, size = over(driven(), mean, count, duration=5.0 * 2.0 * math.pi / 10.0)
    assert found == pytest.approx(0.2 * (math.sin(upper) - math.sin(lower)) / (upper - lower), abs=1e-9)
    square = 0.5 + (math.sin(2.0 * upper) - math.sin(2.0 * lower)) / (4.0 * (upper - lower))
    assert size == pytest.approx(0.2 * math.sqrt(square), rel=1e-9)
    assert str(mean).startswith("mean of crank.tip.x while crank.angle = ")


def test_times_and_cycles():
    turn = 2.0 * math.pi / 10.0
    asked = features.mean("crank.tip.x", ("time", 0.25 * turn, 1.5 * turn))
    late = features.peak("crank.tip.x", ("time", "1 s", None))
    values = over(driven(), asked, late, duration=3.0 * turn, cycles=3)
    # From 90 deg to 360 deg, half a turn, and no time at all.
    np.testing.assert_allclose(values[:2, 0], [0.2 * -1.0 / (1.5 * math.pi), 0.0], atol=1e-12)
    assert np.isnan(values[2, 0]) and np.isnan(values[0, 1])
    np.testing.assert_allclose(values[1:, 1], [0.2, 0.2], atol=1e-12)


def test_contacts_within_a_window():
    """A journal that meets its bearing head-on, without loss: half of the impulse until it is deepest."""
    scene = cc.Scene(
        [cc.Body("journal", 0.3, 1e-4)],
        [cc.ClearanceRevolute("bearing", "ground", "journal", 0.01, 1e-3, cc.laws.Hertz(1e9))],
        start=[cc.ClearanceStart("bearing", (0.0, 0.0), (0.24, -0.32))],
    )
    inwards, late = ("bearing.penetration_rate", 0.0, None), ("time", 3.5e-3, None)
    asked = [
        features.impulse("bearing", inwards),
        features.impulse("bearing"),
        features.impacts("bearing", inwards),
        features.impacts("bearing", late),
        features.contact_share("bearing", late),
        features.contact_share("bearing", ("bearing.penetration", 0.0, None)),
    ]
    half, whole, hits, none, share, always = over(scene, *asked, duration=4e-3, rtol=1e-10)
    assert half == pytest.approx(0.3 * 0.4, rel=1e-7) and whole == pytest.approx(0.3 * 0.8, rel=1e-7)
    assert (hits, none, share) == (1.0, 0.0, 0.0) and always == pytest.approx(1.0, abs=1e-6)


def test_windows_change_no_step_and_no_other_feature():
    scene = cc.mechanisms.slider_crank()
    plain = [features.peak("wrist.normal_force"), features.wear("wrist")]
    more = [
        features.loss("wrist", ("crank.angle", 1.0, 2.0)),
        features.mean("slider.ax", ("slider.x", 0.1, 0.12)),
    ]
    one, other = (
        cc.simulate(scene, duration=0.03, samples=11, features=asked) for asked in (plain, plain + more)
    )
    assert one.stats == other.stats and np.isfinite(other.features).all()
    np.testing.assert_allclose(other.features[0, :2], one.features[0], rtol=1e-9)
    # Parts add up to the whole.
    turns = [("crank.angle", 0.0, 2.0), ("crank.angle", 2.0, 4.0), ("crank.angle", 4.0, 2.0 * math.pi)]
    parts = [other.feature(features.wear("wrist", window)) for window in turns]
    assert sum(parts) == pytest.approx(other.feature(features.wear("wrist")), rel=1e-7)


def test_in_studies_files_and_copies(tmp_path):
    asked = {
        "late": features.mean("slider.x", ("time", "0.02 s", None)),
        "low": features.peak("slider.vx", ("crank.angle", "80 deg", "120 deg")),
    }
    box = {"crank_length": cc.Interval.around(0.05, rel=0.05)}
    study = cc.Study(cc.mechanisms.slider_crank, box, features=asked, duration=0.03, samples=2)
    result = study.sample(5)
    assert result.spec.features == asked and pickle.loads(pickle.dumps(result.spec)) == result.spec
    assert cc.load_result(result.save(tmp_path / "study")) == result
    assert result.spec.study().sample(5) == result
    run = cc.simulate(cc.mechanisms.slider_crank(), duration=0.03, features=list(asked.values()))
    assert cc.load_result(run.save(tmp_path / "run")) == run
    seldom = study.function("late")  # a feature like others for other packages
    assert seldom([0.05]) == pytest.approx(run.features[0, 0], rel=1e-12)


def test_a_window_that_a_mechanism_never_reaches_fails_its_run():
    box = {"crank_length": cc.Interval(0.048, 0.06, 0.055)}
    far = {"far": features.mean("slider.vx", ("slider.x", 0.17, None))}
    study = cc.Study(cc.mechanisms.slider_crank, box, features=far, duration=0.03, samples=2)
    with pytest.warns(cc.ChebclearWarning, match="failed"):
        result = study.sample(12)
    short = 12 - len(result.parameters)
    assert 0 < short == len(result.failures) and (result.parameters > 0.0499).all()
    assert "slider.x = 0.17 m .." in str(result.failures[0])


@pytest.mark.parametrize(
    "window",
    [
        "crank.angle",
        ("crank.angle", 1.0),
        (3, 1.0, 2.0),
        ("time", 2.0, 1.0),
        ("time", None, None),
        ("time", "2 mm", None),
        ("crank.angle", 0.0, None),
        ("crank.angle", 0.0, "360 deg"),
        ("slider.x", math.nan, 1.0),
        ("slider.x", math.inf, None),
    ],
)
def test_windows_that_are_none_are_refused(window):
    with refuses("window"):
        features.peak("slider.x", window)


def test_names_that_are_none_are_refused():
    scene = cc.mechanisms.slider_crank()
    with pytest.raises(cc.errors.ArgumentError, match=r"window of the unknown output .*slider\.x"):
        cc.simulate(scene, duration=0.01, features=[features.peak("slider.vx", ("slider.xx", 0.1, None))])
    own = {"late": features.peak("x", ("time", 0.5, None))}
    with refuses('features["late"]'):
        cc.Study(lambda a: {"t": [0.0, 1.0], "x": [a, a]}, {"a": cc.Interval(0.0, 1.0)}, features=own)
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.Interval(0.04, 0.05)},
        features={"late": features.peak("slider.x", ("time", 0.5, None))},
        duration=1.0,
        samples=2,
    )
    with refuses("features"):
        study.sweep("crank_speed", 10.0, 20.0, 3)


FILE = """
format = 1
title = "A crank"
[[bodies]]
name = "crank"
mass = 1
inertia = 0.1
points = {{ tip = [0.2, 0] }}
[[joints]]
type = "revolute"
name = "shaft"
a = "ground"
b = "crank"
[[drives]]
type = "speed"
name = "motor"
joint = "shaft"
speed = 10
[run]
duration = 1
samples = 2
[features]
found = "{}"
"""


@pytest.mark.parametrize(
    ("text", "window"),
    [
        ("mean(crank.tip.x, crank.angle = 80 deg .. 120 deg)", ("crank.angle", "80 deg", "120 deg")),
        ("mean(crank.tip.x, time = 0.5 ..)", ("time", 0.5, None)),
        ("mean( crank.tip.x , crank.tip.y = .. 10 mm )", ("crank.tip.y", None, 0.01)),
    ],
)
def test_windows_in_scene_files(text, window):
    template = cc.loads(FILE.format(text))
    assert template.features == {"found": features.mean("crank.tip.x", window)}
    assert np.isfinite(template.simulate().features).all()
    assert cc.loads(template.to_toml()).features == template.features


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("mean(crank.tip.x, 80 deg)", "window such as"),
        ("mean(crank.tip.x, time = 2 .. 1)", "end above"),
        ("mean(crank.tip.x, time = 2 mm ..)", "window must be a finite number"),
        ("mean(crank.tip.x, crank.tip.z = 1 ..)", "unknown output"),
    ],
)
def test_wrong_windows_in_scene_files_are_refused_at_their_lines(text, words):
    with pytest.raises(cc.errors.SceneError, match=words) as told:
        cc.loads(FILE.format(text)).check()
    assert "features" in str(told.value)
