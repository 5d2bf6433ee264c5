"""Single simulations: closed forms, reference trajectories, results as values, failures, interruption."""

import copy
import io
import itertools
import json
import math
import pickle
import re
import sys
import threading
import time
import types
import warnings

import chebclear as cc
import numpy as np
import pytest
from chebclear.base import progress
from interrupts import work_after_interrupt
from refusals import refuses

GRAVITY = 9.81  # [m/s^2]


def faller(gravity=GRAVITY, tilt=0.5 * math.pi):
    """A block on a guide without friction, tilted from the horizontal."""
    return cc.Scene(
        [cc.Body("block", mass=2.0, inertia=0.1)],
        [cc.Prismatic("guide", "ground", "block", axis=(math.cos(tilt), math.sin(tilt)))],
        [cc.Gravity((0.0, -gravity))],
    )


@pytest.fixture(scope="module")
def run():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        return cc.simulate(cc.mechanisms.slider_crank(), duration=0.004, samples=401)


@pytest.mark.parametrize("method", ["auto", "rodas5p", "rodas4", "dop853", "adams"])
def test_free_fall(method):
    run = cc.simulate(faller(), duration=0.5, samples=51, rtol=1e-9, method=method)
    assert run.status == "done" and run.success and run.end_time == 0.5
    np.testing.assert_allclose(run.t, np.linspace(0.0, 0.5, 51), rtol=1e-14)
    assert (run.t[0], run.t[-1]) == (0.0, 0.5)
    np.testing.assert_allclose(run["block.y"], -0.5 * GRAVITY * run.t**2, atol=1e-9)
    np.testing.assert_allclose(run["block.vy"], -GRAVITY * run.t, atol=1e-9)
    np.testing.assert_allclose(run["block.ay"], -GRAVITY, rtol=1e-12)
    assert np.abs(run["block.x"]).max() < 1e-15


@pytest.mark.parametrize("method", [None, "auto", "rodas5p", "rodas4", "dop853", "adams"])
def test_stats_tell_which_method_took_the_steps(method):
    chosen = {} if method is None else {"method": method}
    run = cc.simulate(faller(), duration=0.5, samples=3, **chosen)
    assert run.settings.method == (method or "auto")
    stats = run.stats
    implicit = method in ("rodas5p", "rodas4")
    # A free fall is not stiff.
    assert stats.explicit_steps == (0 if implicit else stats.steps)
    assert stats.switches == 0 and (stats.jacobians > 0) == implicit


def test_a_driven_crank_turns_as_told():
    speed, angle, length = 30.0, 0.4, 0.2
    bodies = [cc.Body("crank", 1.5, 0.02, center_of_mass=(length, 0.0), angle=angle)]
    scene = cc.Scene(
        bodies,
        [cc.Revolute("bearing", "ground", "crank")],
        [cc.Gravity((0.0, -GRAVITY))],
        [cc.motions.Speed("motor", "bearing", speed, angle)],
    )
    run = cc.simulate(scene, duration=0.3, samples=301)
    turned = angle + speed * run.t
    np.testing.assert_allclose(run["crank.angle"], turned, rtol=1e-12)
    np.testing.assert_allclose(run["crank.x"], length * np.cos(turned), atol=1e-12)
    np.testing.assert_allclose(run["crank.ay"], -(speed**2) * length * np.sin(turned), atol=1e-9)
    # At constant speed the motor does nothing but hold the weight.
    np.testing.assert_allclose(run["motor.torque"], 1.5 * GRAVITY * length * np.cos(turned), atol=1e-9)


def test_columns_are_views_and_unknown_ones_are_named(run):
    column = run["slider.x"]
    assert column.shape == (401,) and np.shares_memory(column, run.samples)
    assert list(run) == list(run.columns) and "slider.x" in run and "slider.z" not in run
    with pytest.raises(cc.errors.UnknownNameError):
        run["slider.xx"]
    table = run.to_dict()
    assert list(table) == ["t", *run.columns]
    assert np.array_equal(table["rod.angle"], run["rod.angle"])


def test_outputs_choose_the_columns(run):
    some = cc.simulate(run.scene, duration=0.004, samples=401, outputs=["wrist.penetration", "slider.x"])
    assert some.columns == ("wrist.penetration", "slider.x") and some.samples.shape == (401, 2)
    for name in some:
        assert np.array_equal(some[name], run[name])


def test_events_and_stats_tell_what_happened(run):
    events = run.events
    assert len(events) == run.stats.events > 0
    assert set(events.kind) <= {"onset", "separation", "clip", "unclip"} and set(events.joint) == {"wrist"}
    assert np.all(np.diff(events.time) >= 0.0)
    assert np.all(events.normal_velocity[events.kind == "onset"] > 0.0)
    stats = run.stats
    assert stats.steps >= stats.explicit_steps >= 0 and stats.steps > 0
    assert stats.factorizations >= stats.steps - stats.explicit_steps
    assert stats.evaluations >= 2 * stats.explicit_steps
    # In flight until the first onset, in contact just after it.
    contact = run["wrist.contact"]
    first = np.searchsorted(run.t, events.time[0])
    assert events.kind[0] == "onset" and not contact[:first].any()


def test_trajectories_are_values(run, tmp_path):
    file = run.save(tmp_path / "run")
    assert file == tmp_path / "run.npz"
    twins = [copy.copy(run), copy.deepcopy(run), pickle.loads(pickle.dumps(run)), cc.Trajectory.load(file)]
    for twin in twins:
        assert twin == run
        assert twin.samples.tobytes() == run.samples.tobytes()
    assert run != cc.simulate(run.scene, duration=0.004, samples=401, rtol=1e-5)
    assert run != "a run"
    for twin in (run, *twins):
        arrays = [twin.t, twin.samples, twin["slider.x"], twin.events.time, twin.contacts.onset]
        assert not any(array.flags.writeable for array in arrays)
        with pytest.raises(ValueError):
            twin["slider.x"][0] = 1.0
    assert repr(run) == "<Trajectory: 37 columns of 401 samples to t = 0.004 s, done>"


def test_files_say_what_made_them(run, tmp_path):
    with np.load(run.save(tmp_path / "run.npz"), allow_pickle=False) as archive:
        facts = json.loads(str(archive["metadata"]))
    assert facts["format"] == 3 and facts["kind"] == "trajectory"
    assert facts["versions"]["chebclear"] == cc.__version__
    assert set(facts["versions"]) == {"chebclear", "numpy", "python", "platform"}
    record = facts["record"]
    assert cc.Scene.from_json(json.dumps(record["scene"])) == run.scene
    assert record["settings"]["rtol"] == 1e-6 and record["stats"]["steps"] == run.stats.steps


def test_other_files_are_refused(run, tmp_path):
    np.savez(tmp_path / "other.npz", x=np.zeros(3))
    with pytest.raises(cc.errors.ArgumentError):
        cc.Trajectory.load(tmp_path / "other.npz")
    with pytest.raises(cc.errors.ArgumentError):
        cc.results.StudyResult.load(run.save(tmp_path / "run.npz"))
    np.save(tmp_path / "array.npy", np.zeros(3))
    np.savez(tmp_path / "facts.npz", metadata=np.array("[1, 2]"))
    for name, content in (("junk", b"nothing of the kind"), ("empty", b""), ("zip", b"PK\x03\x04 torn")):
        (tmp_path / name).write_bytes(content)
    for name in ("junk", "empty", "zip", "array.npy", "facts.npz"):
        with pytest.raises(cc.errors.ArgumentError):
            cc.Trajectory.load(tmp_path / name)


def test_a_run_that_fails_raises_with_what_it_has(tmp_path):
    scene = cc.mechanisms.slider_crank()
    with pytest.raises(cc.errors.SimulationError) as caught:
        cc.simulate(scene, duration=0.01, samples=101, max_steps=200)
    error = caught.value
    assert error.reason == "max_steps" and 0.0 < error.time < 0.01 and error.parameters is None
    assert float(re.search(r"t = (\S+) s", str(error))[1]) == pytest.approx(error.time)
    run = error.trajectory
    assert run.status == "max_steps" and not run.success and run.end_time == error.time
    reached = run.t <= error.time
    assert (
        np.isfinite(run.samples[reached]).all()
        and np.isnan(run.samples[~reached]).all()
        and not reached.all()
    )
    # NaN equals NaN, also after pickling and on file.
    twin = pickle.loads(pickle.dumps(error))
    assert twin.trajectory == run and cc.Trajectory.load(run.save(tmp_path / "run")) == run
    assert cc.simulate(scene, duration=0.01, samples=101, max_steps=200, on_failure="return") == run


def test_wrong_arguments_are_listed_together():
    wrong = {"duration": -1.0, "samples": 1, "rtol": 0.5, "method": "rodas", "outputs": [], "max_steps": 0}
    with refuses(*wrong):
        cc.simulate(faller(), **wrong)


@pytest.mark.parametrize(
    ("name", "value", "kind"),
    [
        ("scene", "slider crank", TypeError),
        ("duration", math.nan, ValueError),
        ("samples", 11.0, TypeError),
        ("outputs", "block.x", TypeError),
        ("outputs", ["block.x", "block.x"], ValueError),
        ("outputs", ["block.xy", 3], TypeError),
        ("progress", 5, TypeError),
        ("on_failure", "ignore", ValueError),
        ("position_tolerance", 0.0, ValueError),
    ],
)
def test_each_wrong_argument_is_named(name, value, kind):
    with refuses(name, error=kind):
        cc.simulate(**({"scene": faller(), "duration": 0.1, "samples": 11} | {name: value}))


def test_progress_is_reported_and_does_not_change_the_result(run):
    shares = []
    again = cc.simulate(run.scene, duration=0.004, samples=401, progress=shares.append)
    assert again == run
    assert shares == sorted(shares) and 0.0 <= shares[0] and shares[-1] <= 1.0


def test_a_progress_callback_that_raises_stops_the_run():
    def stop(share):
        raise LookupError("enough")

    # Hours of work, were it not stopped.
    with pytest.raises(LookupError):
        cc.simulate(cc.mechanisms.slider_crank(), duration=1e6, samples=2, progress=stop)


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_progress_is_a_bar_at_a_terminal(monkeypatch):
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    cc.Study(faller, {"gravity": cc.Interval(9.0, 10.0)}, duration=0.1, samples=11, progress=True).scan(4)
    assert "study" in terminal.getvalue() and "5/5" in terminal.getvalue() and "runs" in terminal.getvalue()


def test_progress_is_a_bar_in_a_notebook(monkeypatch):
    quiet = io.StringIO()
    monkeypatch.setattr(sys, "stderr", quiet)
    running = types.SimpleNamespace(IPKernelApp=types.SimpleNamespace(initialized=lambda: True))
    monkeypatch.setitem(sys.modules, "ipykernel.kernelapp", running)
    cc.simulate(faller(), duration=0.1, samples=11, progress=True)
    assert "simulation: 100%" in quiet.getvalue()


def test_progress_is_lines_with_the_time_that_is_left_elsewhere(monkeypatch):
    log, seconds = io.StringIO(), itertools.count(100.0, 6.0)
    monkeypatch.setattr(sys, "stderr", log)
    with progress.bar("study", "runs") as report:
        report(1, 4)
    assert log.getvalue() == ""
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(seconds))
    with progress.bar("study", "runs") as report:
        for done in range(1, 5):
            report(done, 4)
    # A quarter is done after 6 s, so that 18 s are left; the next line comes after ten seconds more.
    assert log.getvalue().splitlines() == [
        "study: 1/4 runs, 25 %, 00:06 passed, 00:18 left",
        "study: 3/4 runs, 75 %, 00:18 passed, 00:06 left",
    ]


def test_other_threads_run_during_a_simulation():
    ticks = []
    stop = threading.Event()

    def tick():
        while not stop.wait(0.001):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    start = time.process_time()
    try:
        cc.simulate(cc.mechanisms.slider_crank(), duration=3.0, samples=2)
    finally:
        work, count = time.process_time() - start, len(ticks)
        stop.set()
        thread.join()
    # A core that kept the interpreter to itself would give way once in 50 ms, when it looks for interrupts.
    assert count > 2.0 * work / 0.05


LIMITS = "max_steps=10**9, max_events=10**9"
LONG_RUNS = {
    "simulate": f"cc.simulate(cc.mechanisms.slider_crank(), duration=600.0, samples=2, {LIMITS})",
    "study": (
        "cc.Study(cc.mechanisms.slider_crank, {'crank_length': cc.Interval.around(0.05, rel=0.1)},"
        f" duration=600.0, samples=2, threads=2, {LIMITS}).scan(20)"
    ),
    # What has not begun must cost nothing: 480 MB of samples are left alone.
    "many runs": (
        "cc.Study(cc.mechanisms.slider_crank, {'crank_length': cc.Interval.around(0.05, rel=0.1)},"
        " ['slider.x'],"
        " duration=0.6, samples=100_001, threads=2).scan(600)"
    ),
    "executor": (
        "with ThreadPoolExecutor(2) as pool:\n"
        "        cc.Study(cc.mechanisms.slider_crank, {'crank_length': cc.Interval.around(0.05, rel=0.1)},"
        f" duration=600.0, samples=2, executor=pool, {LIMITS}).scan(20)"
    ),
}


@pytest.mark.parametrize("call", LONG_RUNS)
def test_an_interrupt_from_the_keyboard_stops_a_long_run(call):
    threads = 1 if call == "simulate" else 2
    assert work_after_interrupt(LONG_RUNS[call]) < 0.5 * threads


def test_a_scene_is_compiled_once(monkeypatch):
    from chebclear import _core

    compiled = []

    def compile(text):
        compiled.append(text)
        return mechanism(text)

    mechanism = _core.Mechanism
    monkeypatch.setattr(_core, "Mechanism", compile)
    scene = faller()
    settings = cc.Settings(duration=0.01, samples=11)
    run = cc.simulate(scene, settings=settings, outputs=["block.*"], error="estimate")
    assert run.feature(cc.features.lowest("block.y")) < 0.0
    cc.simulate(scene, settings=settings, start=run.end)
    scene.describe()
    assert compiled == [scene.to_json()]
    # A copy is compiled anew: what was computed from a scene is no part of it.
    copied = pickle.loads(pickle.dumps(scene))
    assert copied == scene and copied.check() == scene.check() and len(compiled) == 2
