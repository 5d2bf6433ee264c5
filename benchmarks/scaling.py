"""How a study scales: measured on the processors of this machine, simulated for more workers than it has.

    python benchmarks/scaling.py measure FILE [--runs 20000]
    python benchmarks/scaling.py simulate FILE [--figure docs/scaling.png]

`measure` runs eight parameters with features on one thread and on two, and sends empty pieces through a
process pool; it writes times of runs and latencies to FILE. `simulate` feeds a model of the scheduler with
them: one parent that makes and places pieces one at a time, workers that simulate them, messages that take
their time. Pieces are sized as `chebclear.execution.dispatch` does.
"""

from __future__ import annotations

import argparse
import heapq
import json
import os
import statistics
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import chebclear as cc
import numpy as np
from chebclear.execution import dispatch
from chebclear.execution.pieces import simulate_order
from chebclear.study.sources.scenes import scene_of

BOX = {
    "crank_length": cc.Interval.around(0.05, rel=0.05),
    "rod_length": cc.Interval.around(0.12, rel=0.05),
    "crank_mass": cc.Interval.around(0.3, rel=0.05),
    "rod_mass": cc.Interval.around(0.21, rel=0.05),
    "slider_mass": cc.Interval.around(0.14, rel=0.05),
    "clearance": cc.Interval.around(2e-5, rel=0.05),
    "journal_radius": cc.Interval.around(9.8e-3, rel=0.05),
    "restitution": cc.Interval.around(0.9, rel=0.05),
}
FEATURES = {"peak force": cc.features.peak("wrist.normal_force"), "peak": cc.features.peak("slider.ax")}
# Workers, and seconds of a piece, that are simulated.
WORKERS = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1000)
SECONDS = (0.1, 0.3, 1.0, 3.0, 10.0)
# Measurements whose medians count.
ROUNDS = 10
# What a message between machines takes on top of the process pool's [s].
NETWORK = 2e-3


def echo(order: bytes) -> bytes:
    """An empty piece."""
    return order


SPENT: list[float] = []
"""Time that each piece took in its worker [s]."""


def timed(*arguments: Any) -> Any:
    """Simulates a piece and notes how long that took."""
    piece = simulate_order(*arguments)
    SPENT.append(piece.seconds)
    return piece


def study(threads: int) -> cc.Study:
    return cc.Study(
        cc.mechanisms.slider_crank,
        BOX,
        [],
        features=FEATURES,
        duration=0.004,
        samples=2,
        rtol=1e-4,
        threads=threads,
    )


def measure(path: Path, runs: int) -> None:
    """Times of runs, of making and placing them, and of messages."""
    warnings.simplefilter("ignore")
    dispatch.simulate_order = timed
    facts: dict[str, float] = {"runs": runs, "parameters": len(study(1).intervals)}
    points = study(1).sample(50, rng=1).parameters
    made = study(1)
    begin = time.perf_counter()
    for row in points:
        scene_of(made, dict(zip(made.intervals, map(float, row), strict=True))).to_json()
    facts["build"] = (time.perf_counter() - begin) / len(points)
    rounds: dict[str, list[float]] = {}
    for number in range(ROUNDS):
        # In turn, so that a machine whose speed changes does not speak for one of them.
        for threads in (1, 2):
            count = runs // ROUNDS if threads == 2 else runs // (4 * ROUNDS)
            del SPENT[:]
            cpu, begin = time.process_time(), time.perf_counter()
            study(threads).sample(count, rng=2 + number)
            for what, took in (
                ("wall", time.perf_counter() - begin),
                ("processor", time.process_time() - cpu),
                ("simulated", sum(SPENT)),
            ):
                rounds.setdefault(f"{what} {threads}", []).append(took / count)
        pairs = rounds["wall 2"][-1], rounds["simulated 1"][-1], rounds["simulated 2"][-1]
        print(f"round {number + 1}: " + " ".join(f"{1e3 * one:.3f}" for one in pairs) + " ms", flush=True)
    facts |= {what: statistics.median(times) for what, times in rounds.items()}
    with ProcessPoolExecutor(2, mp_context=get_context("forkserver")) as pool:
        pool.submit(echo, b"").result()
        for size in (1_000, 1_000_000):
            times = []
            for _ in range(50):
                begin = time.perf_counter()
                pool.submit(echo, b"0" * size).result()
                times.append(time.perf_counter() - begin)
            facts[f"latency {size}"] = statistics.median(times)
    path.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(facts, indent=1))
    for threads in (1, 2):
        ratio = 2.0 * facts["wall 2"] / facts[f"simulated {threads}"]
        print(f"wall time on 2 threads over half the simulation time on {threads}: {ratio:.3f}")


def simulated_time(
    runs: int, run: float, parent: float, latency: float, workers: int, seconds: float
) -> float:
    """Time of a study by the model [s].

    Parameters
    ----------
    runs : int
        Runs in all [-].
    run : float
        Time that a worker takes for one; scatters by a third about it [s].
    parent : float
        Time that the parent takes to make and place one [s].
    latency : float
        Time of a piece on its way, there and back together [s].
    workers : int
        Workers [-]; each has two pieces, so that it does not wait for the next.
    seconds : float
        Time that a piece should take [s].
    """
    chance = np.random.default_rng(0)
    left, now, parent_free = runs, 0.0, 0.0
    free = [0.0] * workers  # when each worker has done all that it was sent
    back: list[tuple[float, int, int]] = []  # arrival, worker, runs
    measured, end = False, 0.0

    def size() -> int:
        if not measured:
            return 1
        share = -(-left // (3 * workers))  # pieces become smaller, so that all end at a time
        return max(1, min(int(seconds / run), share))

    def send(worker: int) -> None:
        nonlocal left, parent_free
        count = min(size(), left)
        left -= count
        parent_free = max(parent_free, now) + count * parent
        begin = max(free[worker], parent_free + latency / 2.0)
        took = float(np.sum(run * chance.uniform(2.0 / 3.0, 4.0 / 3.0, count)))
        free[worker] = begin + took
        heapq.heappush(back, (free[worker] + latency / 2.0, worker, count))

    for worker in range(workers):
        if left:
            send(worker)
    while back:
        now, worker, _ = heapq.heappop(back)
        end = max(now, parent_free)
        wanted = 1 if measured else 2
        measured = True
        for _ in range(wanted):
            if left:
                send(worker)
    return end


def simulate(path: Path, figure: Path | None) -> None:
    """Efficiency against workers by the model, for pieces of several sizes."""
    facts = json.loads(path.read_text(encoding="utf-8"))
    # The parent works on a thread of its own.
    run, parent = facts["simulated 1"], facts["processor 1"] - facts["simulated 1"]
    latency = facts["latency 1000"]
    for threads in (1, 2):
        predicted = simulated_time(facts["runs"], run, parent, 0.0, threads, 0.25) / facts["runs"]
        print(
            f"{threads} threads: model {1e3 * predicted:.3f} ms a run, measured "
            f"{1e3 * facts[f'wall {threads}']:.3f}"
        )
    curves: dict[tuple[float, float], list[float]] = {}
    for each in (run, 0.1):
        for seconds in SECONDS:
            row = []
            for workers in WORKERS:
                # A minute of work for each, or so many runs that it takes no longer to simulate them.
                runs = min(int(60.0 * workers / each), 100_000)
                took = simulated_time(runs, each, parent, latency + NETWORK, workers, seconds)
                row.append(runs * each / workers / took)
            curves[each, seconds] = row
            best = max((count for count, share in zip(WORKERS, row, strict=True) if share >= 0.9), default=0)
            shares = " ".join(f"{100.0 * share:5.1f}" for share in row)
            print(f"run {1e3 * each:7.3f} ms, pieces {seconds:4.1f} s: {shares} %; 90 % up to {best} workers")
    if figure is None:
        return
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    picture, axes = pyplot.subplots(1, 2, figsize=(9.0, 3.4), sharey=True, layout="constrained")
    for ax, each in zip(axes, (run, 0.1), strict=True):
        for seconds in SECONDS:
            ax.plot(WORKERS, [100.0 * share for share in curves[each, seconds]], label=f"{seconds:g} s")
        ax.set(xscale="log", xlabel="workers", title=f"runs of {1e3 * each:.3g} ms", ylim=(0.0, 105.0))
        ax.axhline(90.0, color="0.7", linewidth=0.8)
    axes[0].set_ylabel("efficiency [%]")
    axes[1].legend(title="pieces of", fontsize="small")
    picture.savefig(figure, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("measure", "simulate"))
    parser.add_argument("file", type=Path)
    parser.add_argument("--runs", type=int, default=20_000)
    parser.add_argument("--figure", type=Path)
    options = parser.parse_args()
    if options.what == "measure":
        measure(options.file, options.runs)
    else:
        simulate(options.file, options.figure)


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    main()
