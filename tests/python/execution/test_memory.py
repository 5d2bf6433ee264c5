"""Memory of studies: refused before the first run, in a file beside the store, and no copy of all samples."""

import errno
import os
import subprocess
import sys
import threading
import tracemalloc

import chebclear as cc
import numpy as np
import pytest
from chebclear.run import memory
from chebclear.study import designs
from falling import PLANET, TIME, faller, planet_study
from refusals import refuses

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")


def test_the_samples_may_be_in_a_file_beside_the_store(tmp_path):
    expected = planet_study().chebyshev(3)
    result = planet_study(store=tmp_path, in_memory=False).chebyshev(3)
    assert result == expected
    again = planet_study(store=tmp_path, in_memory=False).chebyshev(3)
    assert again == expected
    if os.name == "posix":
        assert not [path for path in tmp_path.iterdir() if "values" in path.name]


def test_only_simulations_with_a_store_are_in_a_file(tmp_path):
    for wrong in (False, "no"):
        with refuses("in_memory"):
            planet_study(in_memory=wrong)
    with refuses("in_memory"):
        cc.Study(
            lambda x: {"y": x}, {"x": cc.Interval(0.0, 1.0)}, store=tmp_path, version="1", in_memory=False
        )


@pytest.mark.skipif(not hasattr(os, "posix_fallocate"), reason="the system does not reserve files")
def test_a_full_disk_is_told_before_the_first_run(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full)
    with pytest.raises(cc.errors.StoreError):
        planet_study(store=tmp_path, in_memory=False).scan(3)
    assert not [path for path in tmp_path.iterdir() if "values" in path.name]


def large():
    return cc.Study(faller, PLANET, ["block.x", "block.y"], **(TIME | {"samples": 100_001}))


def test_a_study_beyond_its_control_group_is_refused(tmp_path, monkeypatch):
    # Version 1 of control groups has a tree for each controller, version 2 one line.
    (tmp_path / "cgroup").write_text("9:name=systemd:/other\n0::/batch/job\n")
    (tmp_path / "statm").write_text("1000 500 10 1 0 10 0\n")
    (tmp_path / "batch" / "job").mkdir(parents=True)
    for folder, most in [(tmp_path / "batch" / "job", "max"), (tmp_path / "batch", "110000000")]:
        (folder / "memory.max").write_text(f"{most}\n")
        (folder / "memory.current").write_text("100000000\n")
        (folder / "memory.stat").write_text("anon 1000000\ninactive_file 26000000\n")
    monkeypatch.setattr(memory, "_PROCESS", tmp_path)
    monkeypatch.setattr(memory, "_CGROUPS", tmp_path)
    # 17 runs of 1.6 MB, the nominal one included, and 10 MB.
    with pytest.raises(cc.errors.MemoryLimitError):
        large().scan(4)
    (tmp_path / "batch" / "memory.stat").write_text("anon 1000000\ninactive_file 28000000\n")
    memory.require_memory(37.5e6, "this test takes")


def test_what_a_plan_says_is_what_a_study_is_refused_for(monkeypatch):
    monkeypatch.setattr(designs, "taken", lambda: 0.0)
    needed = large().plan("scan", points=4).memory
    monkeypatch.setattr(memory, "_left", lambda: iter([(needed - 5e6, "this test")]))
    with pytest.raises(cc.errors.MemoryLimitError):
        large().scan(4)
    monkeypatch.setattr(memory, "_left", lambda: iter([(needed + 5e6, "this test")]))
    assert large().scan(4).status == "done"


def test_a_thread_that_cannot_be_started_means_too_little_memory(monkeypatch):
    def start(self):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", start)
    with pytest.raises(MemoryError):
        planet_study().scan(3)
    with pytest.raises(MemoryError):
        planet_study(run_seconds=5.0).scan(3)


@pytest.mark.skipif(sys.platform != "linux", reason="the limit of the memory is that of Linux")
def test_a_study_beyond_the_limit_of_its_process_is_refused():
    code = """
import resource
import chebclear as cc
from chebclear import _core
from falling import PLANET, TIME, faller
with open("/proc/self/statm") as file:
    used = int(file.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + 150_000_000,) * 2)
study = cc.Study(faller, PLANET, ["block.x", "block.y"], **(TIME | {"samples": 100_001}))
_core.sweep = None
try:
    study.scan(10)
except cc.errors.MemoryLimitError as error:
    print(isinstance(error, MemoryError), error)
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert done.stdout.startswith("True the study takes about 172 MB, and the limit of this process leaves")


def peak(call):
    """Memory that a call takes at most [bytes], as far as Python and NumPy ask for it."""
    tracemalloc.start()
    try:
        kept = call()
        return tracemalloc.get_traced_memory()[1], kept
    finally:
        tracemalloc.stop()


def test_no_step_copies_all_samples(tmp_path):
    def study():
        return cc.Study(
            faller, PLANET, ["block.x", "block.y", "block.vx", "block.vy"], **(TIME | {"samples": 1441})
        )

    size = 577 * 1441 * 4 * 8  # 27 MB
    fitted, result = peak(lambda: study().chebyshev(3, nodes=24))
    saved, path = peak(lambda: result.save(tmp_path / "result"))
    calibrated, _ = peak(lambda: study().band(576))
    # The polynomials have 16 terms for 576 runs; blocks of 8 MB are transposed. A band takes one output.
    assert fitted < 1.3 * size + 25e6
    assert saved < 0.1 * size + 4e6
    assert calibrated < 1.3 * size + 8e6
    assert cc.load_result(path) == result
    assert np.isfinite(result["block.x"].upper).all()


def test_a_study_imports_all_that_it_needs_before_it_begins():
    # Under a limit of memory a library that is loaded late is an ImportError, and no MemoryError.
    code = "import sys, chebclear as cc; cc.Study; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert {"numpy.random", "tempfile", "concurrent.futures.thread"} <= set(done.stdout.split())
