"""Plans, and studies that are given less time than they need."""

from types import SimpleNamespace

import chebclear as cc
import numpy as np
import pytest
from chebclear.execution import dispatch
from chebclear.execution.costs import Plan, duration, seconds_of
from refusals import refuses

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

BOX = {"crank_length": cc.Interval.around(0.05, rel=0.1), "rod_length": cc.Interval.around(0.12, rel=0.05)}


def plain(crank_length, rod_length):
    """A callable whose arguments have no units, unlike those of ready-made mechanisms."""
    return cc.mechanisms.slider_crank(crank_length=crank_length, rod_length=rod_length)


TIME = {"duration": 0.01, "samples": 51, "threads": 1}


def study(**options):
    return cc.Study(cc.mechanisms.slider_crank, BOX, ["slider.x"], **TIME | options)


def test_a_plan_counts_what_a_method_will_simulate():
    small = study(duration=1e-4)
    assert small.plan("chebyshev", degree=3).runs == 20
    assert small.plan("scan", points=7).runs == 50
    assert small.plan(runs=33).runs == 34
    plan = small.plan("sample", runs=1000)
    assert plan.runs == 1001 and 12 <= plan.probes < plan.runs
    assert 1001 * 51 * 8 < plan.disk < 1.5 * 1001 * 51 * 8
    with refuses("method"):
        small.plan("guess")
    own = cc.Study(lambda a: {"t": [0.0, 1.0], "x": [a, 0.0]}, {"a": cc.Interval(1.0, 2.0)})
    assert own.plan("sample", runs=1000).runs == 1001 and own.plan(runs=9, probes=2).probes == 2
    with pytest.raises(cc.errors.ArgumentError):
        cc.Study.from_runs({"a": [1.0, 2.0, 3.0]}, None, {"x": [1.0, 2.0, 3.0]}).plan()


def test_the_time_of_a_plan_is_that_of_its_probes():
    assert seconds_of([(10, 0.2)], 1000) == pytest.approx(20.0)
    assert "1000 runs in about 20 s" in str(Plan(1000, 20.0, 1e8, 1e6, 10))
    # Starting takes 0.1 s, a run 0.02 s.
    assert seconds_of([(10, 0.3), (40, 0.9)], 1000) == pytest.approx(20.1)
    assert [duration(t) for t in (0.5, 300.0, 7200.0)] == ["0.5 s", "5 min", "2.0 h"]


def test_a_study_without_time_gives_what_is_done(tmp_path, monkeypatch):
    whole = study().band(120)
    clock = [0.0]

    def slow(crank_length, rod_length):
        clock[0] += 1.0  # of a clock of its own: the test does not depend on the speed of a machine
        return plain(crank_length, rod_length)

    monkeypatch.setattr(dispatch, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    short = cc.Study(slow, BOX, ["slider.x"], max_seconds=50.0, store=tmp_path, **TIME).band(120)
    monkeypatch.undo()
    assert short.status == "stopped" and whole.status == "done"
    done = len(short.parameters)
    assert 3 < done < 120
    assert np.array_equal(short.values("slider.x"), whole.values("slider.x")[:done])
    (notice,) = (one for one in short.notices if one.code == "stopped")
    assert notice.numbers == {"runs": 120 - done, "of_runs": 121}
    # The verdict is that of a study with so many runs.
    assert short["slider.x"] == cc.Study(plain, BOX, ["slider.x"], **TIME).band(done)["slider.x"]
    again = study(store=tmp_path).band(120)
    assert again["slider.x"] == whole["slider.x"] and again.stats == whole.stats
