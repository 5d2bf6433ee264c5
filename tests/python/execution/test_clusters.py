"""Executors of Dask, MPI and Ray with processes of their own; each is skipped where it is missing."""

import os
import shutil
import subprocess
import sys

import chebclear as cc
import pytest

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

BOX = {"crank_length": cc.Interval.around(0.05, rel=0.1)}


def study(executor=None, **options):
    options = {"duration": 0.002, "samples": 11} | options
    return cc.Study(cc.mechanisms.slider_crank, BOX, ["slider.x"], executor=executor, **options)


@pytest.fixture
def dask(tmp_path):
    """A client of two processes, looked at every second and given up after 5 s without a sign of life.

    Dask waits for ten signs of life, two a second, whatever shorter time it is told.
    """
    distributed = pytest.importorskip("distributed", reason="needs chebclear[dask]")
    import dask as settings

    with settings.config.set({"distributed.scheduler.worker-ttl": "1s"}):
        cluster = distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, local_directory=str(tmp_path)
        )
        with cluster, distributed.Client(cluster) as client:
            yield client


def test_dask_processes_give_the_same_bits_and_live_through_long_pieces(dask):
    executor = dask.get_executor(pure=False)
    assert study(executor).scan(9) == study().scan(9)
    before = set(dask.scheduler_info()["workers"])
    # A run without an end takes exactly its limit; when it ends no other is begun.
    endless = {
        "duration": 1e6,
        "max_steps": 10**9,
        "max_events": 10**9,
        "run_seconds": 7.0,
        "max_seconds": 1.0,
    }
    with pytest.raises(cc.errors.SimulationError):
        study(executor, **endless).scan(2)
    assert set(dask.scheduler_info()["workers"]) == before and len(before) == 2


def test_a_call_that_exits_on_dask_is_a_failed_run(dask):
    def ending(a):  # inside, since workers cannot import a module of tests
        if a < 0.95:
            sys.exit(3)
        if a > 1.05:
            raise KeyboardInterrupt
        return {"y": a}

    executor = dask.get_executor(pure=False)
    result = cc.Study(ending, {"a": cc.Interval.around(1.0, rel=0.1)}, executor=executor).scan(3)
    assert [one.message for one in result.failures] == [
        "it ended with SystemExit: 3",
        "it ended with KeyboardInterrupt: ",
    ]


MPI = """
import sys
import warnings
import chebclear as cc
from mpi4py.futures import MPIPoolExecutor

def ending(a):
    return sys.exit(3) if a < 0.95 else {"y": a}

if __name__ == "__main__":
    warnings.simplefilter("ignore")
    box = {"crank_length": cc.Interval.around(0.05, rel=0.1)}
    options = {"duration": 0.002, "samples": 11}
    with MPIPoolExecutor(2) as ranks:
        sent = cc.Study(cc.mechanisms.slider_crank, box, ["slider.x"], executor=ranks, **options).scan(9)
        ended = cc.Study(ending, {"a": cc.Interval.around(1.0, rel=0.1)}, executor=ranks).scan(3)
    print(*(one.message for one in ended.failures))
    print(sent == cc.Study(cc.mechanisms.slider_crank, box, ["slider.x"], **options).scan(9))
"""


@pytest.mark.skipif(shutil.which("mpiexec") is None, reason="needs mpiexec")
def test_two_ranks_of_mpi_give_the_same_bits(tmp_path):
    pytest.importorskip("mpi4py", reason="needs mpi4py")
    script = tmp_path / "ranks.py"
    script.write_text(MPI)
    # Open MPI refuses to start for root, and more ranks than processors, unless it is told.
    allowed = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    allowed |= {"OMPI_MCA_rmaps_base_oversubscribe": "1"}
    done = subprocess.run(
        ["mpiexec", "-n", "3", sys.executable, "-m", "mpi4py.futures", str(script)],
        capture_output=True,
        text=True,
        timeout=300,
        env=os.environ | allowed,
        check=False,
    )
    assert done.stdout.splitlines() == ["it ended with SystemExit: 3", "True"], done.stderr


def test_ray_gives_the_same_bits(tmp_path):
    ray = pytest.importorskip("ray", reason="needs ray")
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)

    class RayExecutor:
        num_workers = 2

        def submit(self, function, *arguments):
            return ray.remote(function).remote(*arguments).future()

    try:
        assert study(RayExecutor()).scan(9) == study().scan(9)
    finally:
        ray.shutdown()
