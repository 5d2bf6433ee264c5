"""A run that goes on where another ended is that of a single run, within the error of that."""

import copy
import json
import pickle

import chebclear as cc
import numpy as np
import pytest
from notices import codes
from refusals import refuses

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")


MECHANISMS = cc.mechanisms
IDEAL = MECHANISMS.four_bar(clearance_at=())
PLAY = MECHANISMS.slider_crank(clearance=5e-5)


def assert_alike(values, expected, part=1e-3):
    """Values differ by no more than a part of their ranges."""
    scale = np.maximum(np.ptp(expected, axis=0), np.max(np.abs(expected), axis=0))
    difference = np.max(np.abs(values - expected), axis=0)
    assert np.all(difference <= part * scale + 1e-12), (difference / scale).max()


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
        assert "work_unknown" in codes(run)
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


@pytest.mark.parametrize("other", [IDEAL, MECHANISMS.slider_crank(clearance_at=("crank_pin", "wrist"))])
def test_the_end_of_another_mechanism_is_refused(other):
    end = cc.simulate(PLAY, duration=1e-3, samples=2).end
    with pytest.raises(cc.errors.StartError):
        cc.simulate(other, duration=1e-3, samples=2, start=end)


def test_a_mechanism_of_the_same_size_is_told_by_its_names():
    end = cc.simulate(PLAY, duration=1e-3, samples=2).end
    other = MECHANISMS.four_bar()
    assert other.check().degrees_of_freedom == PLAY.check().degrees_of_freedom
    with refuses("start", error=cc.errors.StartError):
        cc.simulate(other, duration=1e-3, samples=2, start=end)


def test_what_is_no_end_is_refused():
    end = cc.simulate(PLAY, duration=1e-3, samples=2).end
    for start in (3, "end", end.memory, PLAY):
        with refuses("start", error=TypeError):
            cc.simulate(PLAY, duration=1e-3, samples=2, start=start)
    damaged = json.loads(end.memory)
    damaged["q"][1] = "here"
    with pytest.raises(cc.errors.StartError) as caught:
        cc.simulate(PLAY, duration=1e-3, samples=2, start=type(end)(json.dumps(damaged)))
    assert {path for path, _ in caught.value.problems} == {"start.q[1]"}


def test_a_run_that_ended_with_its_table_goes_on_with_a_longer_one():
    def driven(end, mass=1.0, offset=0.0):
        crank = cc.Body("crank", mass, 0.01, points={"A": (0.0, 0.0)})
        times = np.linspace(0.0, end, round(200.0 * end) + 1)
        drive = cc.motions.Motion("motor", "main", cc.motions.Table(times, offset + np.sin(6.0 * times)))
        return cc.Scene([crank], [cc.Revolute("main", "ground", "crank.A")], drives=[drive])

    first = cc.simulate(driven(0.1), duration=0.1, samples=3)
    second = cc.simulate(driven(0.2, mass=2.0), duration=0.05, samples=3, start=first.end)
    np.testing.assert_allclose(second["crank.angle"], np.sin(6.0 * second.t), atol=1e-6)
    with pytest.raises(cc.errors.StartError):
        cc.simulate(driven(0.2, offset=0.3), duration=0.05, samples=3, start=first.end)
