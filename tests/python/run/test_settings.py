"""Settings: one declaration of the options of a run, accepted wherever there are options."""

import dataclasses
import inspect

import chebclear as cc
import pytest
from chebclear.run.settings import RunOptions, SpanOptions, StepOptions
from falling import PLANET, faller
from pendulum import pendulum
from refusals import refuses

TIGHT = cc.Settings(duration=0.1, samples=11, skip=0.05, rtol=1e-9, method="rodas4", outputs=["bob.angle"])


def test_the_keywords_are_the_fields_of_the_settings():
    fields = {item.name: item.type for item in dataclasses.fields(cc.Settings)}
    named = {"outputs", "features", "companion_of"}
    assert set(RunOptions.__annotations__) | named == set(fields)
    for options, function in (
        (RunOptions, cc.simulate),
        (RunOptions, cc.Study),
        (SpanOptions, cc.tradeoff),
        (StepOptions, cc.bifurcation),
    ):
        signature = inspect.signature(function).parameters
        assert set(options.__annotations__) <= set(signature) and "options" not in signature
        for name in options.__annotations__:
            assert f"\n{name}" in function.__doc__ or f", {name} :" in function.__doc__
        assert "{settings}" not in function.__doc__
    assert [name for name, item in inspect.signature(cc.simulate).parameters.items() if item.kind < 3] == [
        "scene"
    ]


def test_settings_and_keywords_are_the_same_run():
    run = cc.simulate(pendulum(), settings=TIGHT)
    keywords = {name: getattr(TIGHT, name) for name in (*RunOptions.__annotations__, "outputs")}
    assert run == cc.simulate(pendulum(), **keywords)
    assert run.settings.rtol == 1e-9 and run.settings.method == "rodas4" and run.t[0] == 0.05
    assert cc.simulate(pendulum(), settings=run.settings) == run


def test_a_keyword_goes_before_the_settings():
    run = cc.simulate(pendulum(), settings=TIGHT, rtol=1e-5, outputs=["bob.x"])
    assert (run.settings.rtol, run.settings.samples, run.columns) == (1e-5, 11, ("bob.x",))
    peaks = dataclasses.replace(TIGHT, features=[cc.features.peak("bob.angle")])
    assert cc.simulate(pendulum(), settings=peaks).features.shape == (1, 1)


def test_studies_and_tradeoffs_take_settings():
    settings = cc.Settings(duration=0.4, samples=5, rtol=1e-8, outputs=["block.y"])
    study = cc.Study(faller, PLANET, settings=settings)
    assert study.runner.settings == settings and study.features == {}
    result = study.scan(2)
    assert result == cc.Study(faller, PLANET, settings=result.settings).scan(2)
    assert cc.Study(faller, PLANET, settings=settings, samples=3).scan(2).t.shape == (3,)
    falls = dataclasses.replace(settings, features=[cc.features.lowest("block.vy")])
    assert list(cc.Study(faller, PLANET, settings=falls).scan(2).features) == ["lowest of block.vy"]
    measured = cc.tradeoff(pendulum(), settings=TIGHT, rtols=[1e-4], repeats=1)
    assert (
        measured.outputs == ("bob.angle",)
        and measured.settings.skip == 0.05
        and measured.duration == pytest.approx(0.1)
    )


def test_a_bifurcation_takes_settings():
    settings = cc.Settings(duration=9.0, samples=4, rtol=1e-9, method="rodas4")
    asked = {"output": "block.y", "sample_per": 0.1, "periods": 2, "discard": 1}
    found = cc.bifurcation(faller, "gravity", [9.0], settings=settings, **asked)
    assert (
        found.samples.tobytes()
        == cc.bifurcation(faller, "gravity", [9.0], rtol=1e-9, method="rodas4", **asked).samples.tobytes()
    )
    run = cc.simulate(faller(gravity=9.0), duration=0.2, samples=3, skip=0.1, rtol=1e-9, method="rodas4")
    assert found.samples.tobytes() == run["block.y"].tobytes()
    with refuses("samples", error=TypeError):
        cc.bifurcation(faller, "gravity", [9.0], samples=4, **asked)
    with refuses("rtol"):
        cc.bifurcation(faller, "gravity", [9.0], rtol=1.0, **asked)


@pytest.mark.parametrize(
    "call",
    [
        cc.simulate,
        cc.tradeoff,
        lambda scene, **given: cc.Study(lambda a: scene, {"a": cc.Interval(1, 2)}, **given),
    ],
)
def test_what_is_wrong_with_options_is_said_together(call):
    with refuses("sampels", error=TypeError):
        call(pendulum(), duration=0.1, sampels=3)
    with refuses("settings", error=TypeError):
        call(pendulum(), settings=3)
    with refuses("duration", error=ValueError):
        call(pendulum(), duration=-1.0, samples=3)


def test_samples_have_one_default():
    run = cc.simulate(pendulum(), duration=0.1)
    assert len(run.t) == cc.Settings(duration=0.1).samples == 1001


def test_settings_are_checked_when_they_are_made():
    with refuses("duration", "samples", "rtol", "method", "outputs", "cycles"):
        cc.Settings(duration=0.0, samples=1, rtol=1.0, method="rodas", outputs=["x", "x"], cycles=0)
    with pytest.raises(TypeError):
        cc.Settings(0.1, 11)
