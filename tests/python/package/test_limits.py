"""What is refused before anything is computed, and what the message says."""

import subprocess
import sys

import chebclear as cc
import numpy as np
import pytest
from chebclear.execution import pieces as study_pieces
from refusals import refuses

TIME = {"duration": 0.1, "samples": 11}
SIDES = {"gravity": cc.Interval(8.0, 11.0), "mass": cc.Interval(1.0, 2.0)}


def faller(gravity=9.81, mass=2.0):
    return cc.Scene(
        [cc.Body("block", mass=mass, inertia=0.1)],
        [cc.Prismatic("guide", "ground", "block", axis=(0.0, 1.0))],
        [cc.Gravity((0.0, -gravity))],
    )


def unbuildable(gravity, mass):
    raise AssertionError("no scene may be built")


@pytest.mark.parametrize(
    ("name", "most"),
    [("samples", 10_000_000), ("max_steps", 2**53), ("max_events", 2**53), ("threads", 1024)],
)
def test_counts_beyond_what_can_be_computed_are_refused(name, most):
    for value in (most + 1, 10**30):
        with refuses(name):
            cc.Study(faller, SIDES, **(TIME | {name: value}))
        if name != "threads":
            with refuses(name):
                cc.simulate(faller(), **(TIME | {name: value}))
    cc.Study(faller, SIDES, **(TIME | {name: most}))


@pytest.mark.parametrize(
    "call",
    [
        lambda study: study.scan(10_001),
        lambda study: study.chebyshev(2, 10**30),
        lambda study: study.chebyshev(10**30),
        lambda study: study.scan(1001),
        lambda study: study.chebyshev(1000),
        lambda study: study.chebyshev(1, {"gravity": 9999, "mass": 101}),
    ],
)
def test_studies_of_too_many_runs_are_refused_before_a_scene_is_built(call):
    with pytest.raises(cc.errors.ArgumentError):
        call(cc.Study(unbuildable, SIDES, **TIME))


# What has to end with an exception where so many bytes are left.
LARGE = {
    "study": (
        300_000_000,
        "cc.Study(cc.mechanisms.slider_crank, {'crank_length': cc.Interval.around(0.05, rel=0.1)},"
        " ['slider.x', 'slider.vx'], duration=0.01, samples=100_001).scan(249)",
    ),
    "run": (300_000_000, "cc.simulate(cc.mechanisms.slider_crank(), duration=1e-3, samples=1_500_000)"),
    "small study": (
        20_000_000,
        "cc.Study(cc.mechanisms.slider_crank, {'crank_length': cc.Interval.around(0.05, rel=0.1)},"
        " duration=1e-4, samples=11).scan(3)",
    ),
    "small run": (20_000_000, "cc.simulate(cc.mechanisms.slider_crank(), duration=1e-3, samples=11)"),
}


@pytest.mark.skipif(sys.platform != "linux", reason="the limit of the memory is that of Linux")
@pytest.mark.parametrize("call", LARGE)
def test_the_end_of_the_memory_is_an_exception(call):
    left, words = LARGE[call]
    # Counted from what the libraries take, which depends on the processors.
    code = f"""
import resource
import chebclear as cc
cc.simulate(cc.mechanisms.slider_crank(), duration=1e-4, samples=2)
with open("/proc/self/statm") as file:
    used = int(file.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + {left},) * 2)
try:
    {words}
except MemoryError as error:
    print("MemoryError:", error)
"""
    command = [sys.executable, "-W", "ignore", "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("MemoryError: ")


class Direct:
    """An executor that computes when it is asked."""

    def submit(self, function, *arguments):
        from concurrent.futures import Future

        future = Future()
        try:
            future.set_result(function(*arguments))
        except cc.errors.SceneError as error:
            future.set_exception(error)
        return future


@pytest.mark.parametrize("executor", [None, Direct()])
def test_problems_of_no_scene_are_not_blamed_on_the_first(monkeypatch, executor):
    problems = [("settings.rtol", "is wrong"), ("scenes[0].joints[0].a", "is wrong too")]

    def sweep(*arguments):
        raise cc.errors.SceneError(problems)

    monkeypatch.setattr(study_pieces._core, "sweep", sweep)
    study = cc.Study(faller, {"mass": cc.Interval(1.0, 2.0)}, executor=executor, **TIME)
    with pytest.raises(cc.errors.SceneError) as caught:
        study.scan(2)
    assert caught.value.problems == problems[:1]


@pytest.mark.parametrize("name", ["crank_length", "rod_length", "crank_angle", "clearance", "poisson_ratio"])
@pytest.mark.parametrize("value", [1e200, np.float64(1e200), 10**400], ids=["float", "numpy", "int"])
def test_huge_numbers_are_no_overflow(name, value):
    try:
        cc.mechanisms.slider_crank(**{name: value}).check()
    except cc.errors.SceneError:
        return
    assert value < 1e300 and name in ("crank_angle", "clearance")


def test_a_drive_too_fast_for_numbers_is_named():
    for scene in (cc.mechanisms.slider_crank, cc.mechanisms.six_bar):
        with refuses("drives"):  # and no singular mass matrix of its body
            scene(crank_speed=1e300).check()


def test_forces_too_large_for_numbers_are_no_singular_mass_matrix():
    with pytest.raises(cc.errors.SceneError):
        cc.mechanisms.slider_crank(gravity=1.7e308).check()


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_max_steps_holds_where_drives_prescribe_the_motion():
    # At 1e100 rad/s every number of the time is a pose of its own: without a limit the run never ended.
    ideal = cc.mechanisms.four_bar(crank_speed=1e100, clearance_at=())
    run = cc.simulate(ideal, duration=1e-3, samples=3, max_steps=100, on_failure="return")
    assert (run.status, run.stats.steps) == ("max_steps", 100)
    assert cc.simulate(
        cc.mechanisms.four_bar(clearance_at=()), duration=1e-3, samples=3, max_steps=100
    ).success


def test_rejected_steps_count_as_the_documentation_says():
    run = cc.simulate(
        cc.mechanisms.quick_return(), duration=0.03, samples=3, max_steps=500, on_failure="return"
    )
    assert run.status == "max_steps" and run.stats.rejected > 0
    assert run.stats.steps + run.stats.rejected == 500
    for function in (cc.simulate, cc.tradeoff, cc.Study):
        assert "Attempted steps, accepted or rejected" in " ".join(function.__doc__.split())
