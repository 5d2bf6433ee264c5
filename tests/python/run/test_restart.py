"""A run that goes on where another ended is that of a single run, within the error of that."""

import copy
import dataclasses
import itertools
import json
import pickle

import chebclear as cc
import numpy as np
import pytest

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")


def table(duration, size=1.0):
    times = np.linspace(0.0, duration, 9)
    return cc.motions.Table(times, 0.4 + size * np.sin(12.0 * times / duration))


def with_drive(scene, motion):
    joint = scene.drives[0].joint
    return dataclasses.replace(scene, drives=[cc.motions.Motion("drive", joint, motion)])


MECHANISMS = cc.mechanisms
IDEAL = MECHANISMS.four_bar(clearance_at=())
PLAY = MECHANISMS.slider_crank(clearance=5e-5)
# The core's own tests cut runs of more scenes at more places.
SCENES = {
    "friction": (PLAY, 1 / 64),
    "two clearances": (MECHANISMS.slider_crank(clearance_at=("crank_pin", "wrist")), 1 / 128),
    "six-bar": (MECHANISMS.six_bar(), 1 / 64),
    "journal at rest": (MECHANISMS.free_journal(), 1 / 32),
    "prescribed loop by a table": (with_drive(IDEAL, table(1.0)), 1.0),
}


def assert_alike(values, expected, part=1e-3):
    """Values differ by no more than a part of their ranges."""
    scale = np.maximum(np.ptp(expected, axis=0), np.max(np.abs(expected), axis=0))
    difference = np.max(np.abs(values - expected), axis=0)
    assert np.all(difference <= part * scale + 1e-12), (difference / scale).max()


@pytest.mark.parametrize("name", SCENES)
def test_three_runs_are_one(name):
    scene, duration = SCENES[name]
    outputs = [
        column for column in scene.check().columns if column.endswith((".x", ".y", ".vx", ".vy", ".angle"))
    ]
    whole = cc.simulate(scene, duration=duration, samples=33, outputs=outputs)
    parts, start = [], None
    for share, samples in ((0.25, 9), (0.5, 17), (0.25, 9)):
        given = {"duration": share * duration, "samples": samples, "outputs": outputs}
        parts.append(cc.simulate(scene, **given, start=start))
        start = parts[-1].end
    assert start.time == whole.end.time
    assert np.array_equal(np.concatenate([parts[0].t, parts[1].t[1:], parts[2].t[1:]]), whole.t)
    for before, after in itertools.pairwise(parts):
        np.testing.assert_allclose(before.samples[-1], after.samples[0], rtol=1e-11, atol=1e-11)
    assert_alike(parts[2].samples, whole.samples[24:])
    assert sum(len(part.events) for part in parts) == len(whole.events)
    later = whole.events.time[len(whole.events) - len(parts[2].events) :]
    np.testing.assert_allclose(parts[2].events.time, later, atol=1e-3 * duration)


def test_energies_and_turns_are_counted_from_the_first_start():
    scene = IDEAL
    whole = cc.simulate(scene, duration=1.0, samples=3, outputs=["crank.angle", "energy.*"])
    first = cc.simulate(scene, duration=0.5, samples=3, outputs=["crank.angle", "energy.*"])
    second = cc.simulate(scene, duration=0.5, samples=3, outputs=["crank.angle", "energy.*"], start=first.end)
    assert_alike(second.samples[[0, -1]], whole.samples[1:])
    assert whole["crank.angle"][-1] > 4.0 * np.pi


def test_work_that_was_not_counted_from_the_first_start_is_unknown():
    counted = cc.simulate(PLAY, duration=1 / 128, samples=3, outputs=["wrist.wear"])
    uncounted = cc.simulate(PLAY, duration=1 / 128, samples=3, start=counted.end, outputs=["energy.kinetic"])
    for _ in range(2):
        run = cc.simulate(
            PLAY, duration=1 / 128, samples=3, start=uncounted.end, outputs=["energy.*", "wrist.*"]
        )
        assert any("count from the first start on" in warning for warning in run.warnings)
        unknown = {"impact_loss", "friction_loss", "damping_loss", "wear", "input", "balance"}
        for name in run.columns:
            assert np.isnan(run[name]).all() == (name.partition(".")[2] in unknown), name
        uncounted = run
    whole = cc.simulate(PLAY, duration=1 / 64, samples=3, outputs=["energy.*"])
    rest = cc.simulate(PLAY, duration=1 / 128, samples=3, start=counted.end, outputs=["energy.*"])
    names = [name for name in whole.columns if name != "energy.balance"]
    for name in names:
        assert rest[name][-1] == pytest.approx(whole[name][-1], rel=1e-3, abs=1e-9), name


def test_what_is_asked_for_may_change_on_the_way():
    scene = PLAY
    first = cc.simulate(scene, duration=1 / 128, samples=3, outputs=["slider.x"])
    second = cc.simulate(
        scene, duration=1 / 128, samples=9, outputs=["slider.vx", "wrist.*"], start=first.end, rtol=1e-8
    )
    assert second.t[0] == 1 / 128 and second.success
    skipped = cc.simulate(scene, duration=1 / 256, samples=5, start=first.end, skip=1 / 256)
    assert np.array_equal(skipped.t, [1 / 128 + 1 / 256 * (1 + k / 4) for k in range(5)])
    whole = cc.simulate(scene, duration=1 / 64, samples=17)
    assert_alike(skipped["slider.vx"], whole["slider.vx"][12:])


def test_ends_are_values_and_survive_pickles_and_files(tmp_path):
    run = cc.simulate(PLAY, duration=1 / 128, samples=3)
    end = run.end
    assert end.time == 1 / 128 == run.end_time
    loaded = cc.Trajectory.load(run.save(tmp_path / "run"))
    for twin in (copy.copy(end), copy.deepcopy(end), pickle.loads(pickle.dumps(end)), loaded.end):
        assert twin == end and hash(twin) == hash(end)
        again = cc.simulate(PLAY, duration=1 / 128, samples=3, start=twin)
        assert np.array_equal(
            again.samples, cc.simulate(PLAY, duration=1 / 128, samples=3, start=end).samples
        )
    pickled = pickle.loads(pickle.dumps(run))
    assert pickled == run and pickled.end == end


def test_a_failed_run_has_no_end(tmp_path):
    failed = cc.simulate(PLAY, duration=0.01, samples=3, max_steps=50, on_failure="return")
    assert failed.end is None
    assert cc.Trajectory.load(failed.save(tmp_path / "failed")).end is None
    with pytest.raises(cc.errors.SimulationError) as caught:
        cc.simulate(PLAY, duration=0.01, samples=3, max_steps=50)
    assert caught.value.trajectory.end is None


@pytest.mark.parametrize("other", [IDEAL, MECHANISMS.slider_crank(clearance_at=("crank_pin", "wrist"))])
def test_the_end_of_another_mechanism_is_refused(other):
    end = cc.simulate(PLAY, duration=1e-3, samples=2).end
    with pytest.raises(cc.errors.StartError):
        cc.simulate(other, duration=1e-3, samples=2, start=end)


def test_a_mechanism_of_the_same_size_is_told_by_its_names():
    end = cc.simulate(PLAY, duration=1e-3, samples=2).end
    other = MECHANISMS.four_bar()
    assert other.check().degrees_of_freedom == PLAY.check().degrees_of_freedom
    with pytest.raises(cc.errors.StartError, match=r"crank_bearing.*rocker_pin.*wrist"):
        cc.simulate(other, duration=1e-3, samples=2, start=end)


def test_what_is_no_end_is_refused():
    end = cc.simulate(PLAY, duration=1e-3, samples=2).end
    for start in (3, "end", end.memory, PLAY):
        with pytest.raises(TypeError, match="start"):
            cc.simulate(PLAY, duration=1e-3, samples=2, start=start)
    damaged = json.loads(end.memory)
    damaged["q"][1] = "here"
    with pytest.raises(cc.errors.StartError) as caught:
        cc.simulate(PLAY, duration=1e-3, samples=2, start=type(end)(json.dumps(damaged)))
    assert {path for path, _ in caught.value.problems} == {"start.q[1]"}
