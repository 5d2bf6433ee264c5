"""What a scene does not use changes no bit and no counter."""

import dataclasses

import chebclear as cc
import numpy as np
import pytest

METHODS = ["rodas5p", "rodas4", "dop853", "adams"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "extra",
    [
        {"forces": [cc.Gravity((0.0, 0.0))]},
        {"forces": [cc.Spring("idle", "ground", "slider", 0.0, 0.3)]},
        {"forces": [cc.Damper("idle", "ground", "slider", 0.0)]},
        {"forces": [cc.TorsionSpring("idle", "crank", "rod", 0.0)]},
        {"forces": [cc.Force("idle", "slider", 0.0, 0.0, frame="body")]},
        {"forces": [cc.Torque("idle", "rod", cc.motions.Harmonic(0.0, 3.0))]},
        {"ground": {"unused": (0.01, 0.02)}},
    ],
    ids=["gravity", "spring", "damper", "torsion spring", "force", "torque", "point"],
)
def test_an_idle_element(method, extra):
    scene = cc.mechanisms.slider_crank(clearance=5e-5)
    if "ground" in extra:
        extra = {"ground": dict(scene.ground) | extra["ground"]}
    plain, more = (
        cc.simulate(each, duration=0.01, samples=21, method=method)
        for each in (scene, dataclasses.replace(scene, **extra))
    )
    assert more.stats == plain.stats
    assert np.array_equal(more.samples, plain.samples) and more.events == plain.events


@pytest.mark.parametrize("method", METHODS)
def test_outputs_that_are_not_asked_for(method):
    scene = cc.mechanisms.slider_crank(clearance=5e-5)
    plain, more = (
        cc.simulate(scene, duration=0.01, samples=21, method=method, outputs=outputs)
        for outputs in (["slider.x"], ["*"])
    )
    assert np.array_equal(more["slider.x"], plain["slider.x"])
    assert more.end_time == plain.end_time and more.events == plain.events
    # DOP853 pays for the dense output that the quadratures of work use.
    assert more.stats.evaluations == plain.stats.evaluations or method == "dop853"
    assert dataclasses.replace(more.stats, evaluations=plain.stats.evaluations) == plain.stats
