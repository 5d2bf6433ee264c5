"""Executors: the same bits wherever the runs are made, and nothing lost with a worker but its time."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context

import chebclear as cc
import pytest
from chebclear.execution import dispatch
from chebclear.execution.pieces import simulate_order
from chebclear.scene.structure import Structures

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

BOX = {"crank_length": cc.Interval.around(0.05, rel=0.1)}


def study(executor=None, **options):
    options = {"duration": 0.002, "samples": 11} | options
    return cc.Study(cc.mechanisms.slider_crank, BOX, ["slider.x", "slider.vx"], executor=executor, **options)


@pytest.fixture(scope="module")
def whole():
    return study().scan(9)


@pytest.mark.skipif(os.name != "posix", reason="forkserver")
def test_forked_workers_give_the_same_bits(whole):
    with ProcessPoolExecutor(2, mp_context=get_context("forkserver")) as pool:
        assert study(pool).scan(9) == whole


class Failing:
    """An executor whose workers are lost when they get certain runs."""

    num_workers = 2

    def __init__(self, lost):
        self.lost = lost
        self.sent = []

    def submit(self, function, order, stop):
        future = Future()
        self.sent.append(len(order.scenes))
        if self.lost(order):
            future.set_exception(BrokenProcessPool("a worker was killed"))
        else:
            future.set_result(function(order, stop))
        return future

    _broken = False


def test_pieces_of_a_lost_worker_are_sent_again(whole):
    once = []

    def lost(order):
        once.append(order)
        return len(once) == 4

    assert study(Failing(lost)).scan(9) == whole


def test_a_run_that_kills_every_worker_is_named_and_costs_no_other(whole):
    scene = cc.mechanisms.slider_crank(crank_length=float(whole.parameters[2, 0]))
    victim = Structures().flat(scene)[1]
    executor = Failing(lambda order: victim in [scene.numbers for scene in order.scenes])
    result = study(executor).scan(9)
    (failure,) = result.failures
    assert failure.reason == "worker_lost" and failure.index == 2
    assert failure.parameters["crank_length"] == whole.parameters[2, 0]
    assert (result.values("slider.x") == whole.values("slider.x")[[0, 1, 3, 4, 5, 6, 7, 8]]).all()
    with pytest.raises(cc.errors.SimulationError):
        study(executor, on_failure="raise").scan(9)


def suicidal(order, stop):
    """Simulates, unless no worker was killed so far."""
    if not os.path.exists(os.environ["CHEBCLEAR_TEST_KILLED"]):
        with open(os.environ["CHEBCLEAR_TEST_KILLED"], "w"):
            os.kill(os.getpid(), signal.SIGKILL)
    return simulate_order(order, stop)


@pytest.mark.skipif(os.name != "posix", reason="SIGKILL")
def test_a_killed_process_costs_its_time_only(whole, monkeypatch, tmp_path):
    monkeypatch.setenv("CHEBCLEAR_TEST_KILLED", str(tmp_path / "killed"))
    monkeypatch.setattr(dispatch, "simulate_order", suicidal)
    with ProcessPoolExecutor(2, mp_context=get_context("fork")) as pool:
        assert study(pool).scan(9) == whole
    assert (tmp_path / "killed").exists()


def test_workers_with_another_build_are_refused():
    class Other(ThreadPoolExecutor):
        def submit(self, function, *arguments):
            def other():
                piece = function(*arguments)
                object.__setattr__(piece, "code", "another")
                return piece

            return super().submit(other)

    with Other(1) as pool, pytest.raises(cc.ChebclearError):
        study(pool).scan(3)


PROGRAM = """
import sys, time, warnings
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
import chebclear as cc

if __name__ == "__main__":
    pool = ProcessPoolExecutor(2, mp_context=get_context("spawn")) if sys.argv[1] == "pool" else None
    box = {"crank_length": cc.Interval.around(0.05, rel=0.1)}
    study = cc.Study(cc.mechanisms.slider_crank, box, ["slider.x"],
                     duration=60.0, samples=11, max_steps=10**9, max_events=10**9, executor=pool,
                     threads=None if pool else 2,
                     progress=lambda done, total: print(done, flush=True))
    print("begin", flush=True)
    study.scan(100)
"""


def children(process):
    found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(process)], capture_output=True, text=True)
    return [int(one) for one in found.stdout.split()]


def alive(process):
    try:
        with open(f"/proc/{process}/stat") as file:
            return file.read().split()[2] != "Z"
    except OSError:
        return False


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="/proc")
@pytest.mark.parametrize(("where", "how"), [("here", "TERM"), ("pool", "TERM"), ("pool", "KILL")])
def test_no_worker_is_left_behind(tmp_path, where, how):
    script = tmp_path / "ended.py"
    script.write_text(PROGRAM)
    process = subprocess.Popen(
        [sys.executable, str(script), where], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "begin\n"
    deadline = time.monotonic() + 60.0
    while where == "pool" and len(children(process.pid)) < 3 and time.monotonic() < deadline:
        time.sleep(0.05)  # two workers and the tracker of resources
    time.sleep(1.0)
    workers = children(process.pid)
    process.send_signal(getattr(signal, f"SIG{how}"))
    process.communicate(timeout=60.0)
    assert process.returncode in (-signal.SIGTERM, 128 + signal.SIGTERM, -signal.SIGKILL)
    while any(map(alive, workers)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not [worker for worker in workers if alive(worker)]
