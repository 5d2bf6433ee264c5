"""Wear by the sectors of a bearing, against that of the whole bearing and against sums by hand."""

import math

import chebclear as cc
import numpy as np
import pytest

SECTORS = 72
MECHANISMS = [
    cc.mechanisms.slider_crank(clearance_at=("crank_pin", "wrist")),
    cc.mechanisms.four_bar(),
    cc.mechanisms.pendulum_in_bearing(),
]


@pytest.mark.parametrize("scene", MECHANISMS)
def test_the_sectors_add_up_to_the_wear_of_the_bearing(scene):
    joints = scene.check().clearance_joints
    names = [name for joint in joints for name in (f"{joint}.wear", f"{joint}.wear_*")]
    run = cc.simulate(scene, duration=0.03, samples=7, outputs=names)
    for joint in joints:
        parts = np.stack(list(run[f"{joint}.wear_*"].values()))
        assert len(parts) == SECTORS
        assert run[f"{joint}.wear"][-1] > 0.0
        np.testing.assert_allclose(parts.sum(axis=0), run[f"{joint}.wear"], rtol=1e-12)
        assert np.all(np.diff(parts) >= 0.0)


def test_sectors_turn_with_the_body_of_the_bearing():
    """The integrand at many instants, put into sectors by hand: the rod is the bearing of both pins."""
    scene = cc.mechanisms.slider_crank(clearance_at=("wrist",))
    names = ["wrist.eccentricity_*", "rod.angle", "wrist.normal_force", "wrist.sliding_velocity"]
    run = cc.simulate(scene, duration=0.03, samples=60001, outputs=[*names, "wrist.wear_*"], rtol=1e-6)
    assert next(joint for joint in scene.joints if joint.name == "wrist").bearing.startswith("rod")
    angle = np.arctan2(run["wrist.eccentricity_y"], run["wrist.eccentricity_x"]) - run["rod.angle"]
    sector = np.floor(angle / (2.0 * math.pi) * SECTORS).astype(int) % SECTORS
    power = np.abs(run["wrist.normal_force"] * run["wrist.sliding_velocity"])
    expected = np.bincount(sector, power, SECTORS) * (run.t[1] - run.t[0])
    found = np.array([run[f"wrist.wear_{k}"][-1] for k in range(SECTORS)])
    assert np.abs(found - expected).sum() < 0.03 * expected.sum()


def test_only_a_pattern_of_their_own_names_the_sectors():
    facts = MECHANISMS[0].check()
    assert len(facts.sector_columns) == 2 * SECTORS
    run = cc.simulate(MECHANISMS[0], duration=1e-3, samples=2, outputs=["wrist.*"])
    assert not any("wear_" in name for name in run.columns)
    with pytest.raises(cc.errors.UnknownNameError):
        run["wrist.wear_3"]
    with pytest.raises(ValueError):
        cc.simulate(MECHANISMS[0], duration=1e-3, samples=2, outputs=["wrist.wear_72"])


def test_sectors_count_from_the_start_of_a_run_that_continues():
    scene = MECHANISMS[0]
    whole = cc.simulate(scene, duration=0.02, samples=3, outputs=["wrist.wear"])
    first = cc.simulate(scene, duration=0.01, samples=2, outputs=["wrist.wear"])
    second = cc.simulate(
        scene, duration=0.01, samples=2, outputs=["wrist.wear", "wrist.wear_*"], start=first.end
    )
    parts = np.stack(list(second["wrist.wear_*"].values()))
    assert parts[:, 0].sum() == 0.0
    assert parts[:, -1].sum() == pytest.approx(np.ptp(second["wrist.wear"]), rel=1e-12)
    assert second["wrist.wear"][-1] == pytest.approx(whole["wrist.wear"][-1], rel=0.1)


def test_features_of_a_sector_need_no_output_of_it():
    peak = cc.features.peak("wrist.wear_3")
    run = cc.simulate(MECHANISMS[0], duration=0.02, samples=2, outputs=["slider.x"], features=[peak])
    sector = cc.simulate(MECHANISMS[0], duration=0.02, samples=2, outputs=["wrist.wear_3"])["wrist.wear_3"]
    assert peak.unit == "N m"
    assert run.feature(peak) == pytest.approx(sector[-1], rel=0.02)
    with pytest.raises(ValueError):
        cc.simulate(MECHANISMS[0], duration=0.02, samples=2, features=[cc.features.peak("wrist.wear_72")])
