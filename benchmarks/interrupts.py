"""How long a study takes to end after Ctrl-C or SIGTERM, in every stage of it.

    python benchmarks/interrupts.py [--repeats 5] [--stages simulating pool]
    python benchmarks/interrupts.py --life 50 [--last 0.1]

A program of its own repeats the stage until it gets the signal at a random moment. Prints the median and the
longest time until the process is gone, and the processes that it left behind.

With `--life` the command `chebclear study` with a store and a report gets Ctrl-C at so many moments of its
whole life, or of the last seconds of it. Each time it must be gone within half a second with one line and
the right exit code, leave no process behind and a store from which the study goes on. Ends with status 1
otherwise. Before the first line of the package, while Python itself starts, Python answers.
"""

from __future__ import annotations

import argparse
import random
import signal
import statistics
import subprocess
import sys
import time
import warnings
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import chebclear as cc
import numpy as np

BOX = {"crank_length": cc.Interval.around(0.05, rel=0.1), "rod_length": cc.Interval.around(0.12, rel=0.05)}
T = np.linspace(0.0, 1.0, 1441)
LONG = {"duration": 600.0, "samples": 11, "max_steps": 10**9, "max_events": 10**9}
SIGNALS = {"INT": signal.SIGINT, "TERM": signal.SIGTERM}


def rough(**parameters: float) -> dict[str, Any]:
    """Four outputs that scatter with the parameters, as impacts do."""
    total = sum((index + 1.0) * value for index, value in enumerate(parameters.values()))
    return {"t": T, **{f"x{row}": np.sin(20.0 * T * (1.0 + row) + 300.0 * total) for row in range(4)}}


def smooth(a: float, b: float, c: float) -> dict[str, Any]:
    """Four outputs that polynomials follow."""
    return {"t": T, **{f"x{row}": np.sin(a * T + row) * b + c * T for row in range(4)}}


def study(**options: Any) -> cc.Study:
    options = {"duration": 0.03, "samples": 121} | options
    return cc.Study(cc.mechanisms.slider_crank, BOX, ["slider.x", "slider.vx"], **options)


def stage_of(name: str, folder: Path) -> Callable[[], object]:
    """What is interrupted, ready to begin."""
    many = {f"p{index}": cc.Interval.around(1.0, rel=0.1) for index in range(4)}
    few = {name: cc.Interval.around(1.0, rel=0.1) for name in "abc"}
    if name == "building":
        return lambda: study(duration=1e-6, samples=2).sample(200_000)
    if name == "one run":
        return lambda: cc.simulate(cc.mechanisms.slider_crank(), outputs=["slider.x"], **LONG)
    if name == "simulating":
        return lambda: study(**LONG).scan(5)
    if name == "storing":
        return lambda: study(store=folder / "runs").sample(100_000)
    if name == "own model":
        return lambda: cc.Study(lambda **given: time.sleep(600.0), many).sample(9)
    if name == "own model with a limit":
        return lambda: cc.Study(lambda **given: time.sleep(600.0), many, run_seconds=900.0).sample(9)
    if name == "fitting and bounding":
        made = cc.Study(smooth, few)
        return lambda: made.chebyshev(degree=7)
    if name == "calibrating":
        made = cc.Study(rough, many)
        return lambda: made.band(161)
    if name == "ranking":
        ranked = cc.Study(lambda **given: {"y": float(np.prod(list(given.values())))}, many).sample(2000)
        return lambda: (
            cc.Study.from_runs(
                dict(zip(many, ranked.parameters.T, strict=True)),
                None,
                {"y": ranked.features["y"].values[:, 0]},
            )
            .sample()
            .ranking("y")
        )
    if name == "plotting":
        result = cc.Study(smooth, few).chebyshev(degree=3)
        return lambda: result.report(folder / "report.html")
    if name == "saving":
        result = cc.Study(rough, many).sample(400)
        return lambda: result.save(folder / "result.npz")
    assert name == "pool", name
    pool = ProcessPoolExecutor(2, mp_context=get_context("spawn"))
    return lambda: study(executor=pool, **LONG).scan(5)


STAGES = (
    "building",
    "one run",
    "simulating",
    "storing",
    "own model",
    "own model with a limit",
    "fitting and bounding",
    "calibrating",
    "ranking",
    "plotting",
    "saving",
    "pool",
)


def child(name: str, folder: Path) -> None:
    """Repeat a stage until a signal comes, in the way of the command line."""
    from chebclear.cli.ending import terminable

    signal.signal(signal.SIGINT, signal.default_int_handler)
    warnings.simplefilter("ignore")
    with terminable():
        try:
            stage = stage_of(name, folder)
            print("ready", flush=True)
            while True:
                stage()
        except KeyboardInterrupt:
            sys.exit(130)


def left(group: int) -> list[str]:
    """Processes of a session that are still there."""
    found = subprocess.run(["ps", "-o", "pid=,stat=,args=", "-s", str(group)], capture_output=True, text=True)
    return [line for line in found.stdout.splitlines() if line.split()[1][0] != "Z"]


def program(folder: Path, scene: Path, *more: str) -> subprocess.Popen[str]:
    """A study by the command line, whose folder is empty or holds the store of another."""
    words = ["study", str(scene), "--runs", "60", "--samples", "101", "--out", "out", "--store", "runs"]
    return subprocess.Popen(
        [str(Path(sys.executable).with_name("chebclear")), *words, *more],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        # A child of a background job would ignore it.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def life(count: int, last: float, chance: random.Random) -> int:
    """Interrupt the program at random moments, those of its last seconds [s] if there are any."""
    starter = Path(cc.__file__).parent / "templates" / "starters" / "slider_crank.toml"
    ends: Counter[str] = Counter()
    wrong, longest, lives = 0, 0.0, 0.0
    for number in range(-2, count):
        with TemporaryDirectory() as name:
            folder = Path(name)
            begin = time.perf_counter()
            process = program(folder, starter)
            if number < 0:  # to know how long it lives; the first one may have to read from the disk
                process.communicate()
                lives = time.perf_counter() - begin
                continue
            delay = chance.uniform(lives - last if last else 0.0, lives + 0.02)
            time.sleep(delay)
            sent = time.perf_counter()
            process.send_signal(signal.SIGINT)
            _, told = process.communicate()
            took = time.perf_counter() - sent
            time.sleep(0.3)  # workers end a moment later
            orphans = left(process.pid)
            lines = [line for line in told.splitlines() if not line.startswith(("warning:", "study:"))]
            again = program(folder, starter)
            _, later = again.communicate()
            code = process.returncode
            good = not orphans and took < 0.5 and again.returncode == 0 and "damaged" not in later
            if code == 130:
                good &= len(lines) == 1 and lines[0].startswith("chebclear: interrupted")
            else:  # it was over
                good &= code == 0 and not lines
            ends[f"exit code {code}, {len(lines)} lines{'' if good else ', WRONG'}"] += 1
            longest = max(longest, took)
            wrong += not good
            if not good:
                print(f"after {delay:.3f} of {lives:.3f} s: {code}, {took:.2f} s, {orphans}\n{told[-600:]}")
    print(f"{count} interrupts in a life of {lives:.2f} s: {dict(ends)}; longest {longest:.3f} s", flush=True)
    return int(wrong > 0)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--stages", nargs="+", default=STAGES)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--life", type=int, default=0, help="interrupts of the program")
    parser.add_argument("--last", type=float, default=0.0, help="only in its last seconds [s]")
    parser.add_argument("--child", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        child(options.child[0], Path(options.child[1]))
        return 0
    chance = random.Random(options.seed)
    if options.life:
        return life(options.life, options.last, chance)
    print(f"{'stage':24} {'signal':6} {'median':>8} {'longest':>8}  left behind", flush=True)
    for name in options.stages:
        for word, number in SIGNALS.items():
            times, orphans = [], 0
            for _ in range(options.repeats):
                with TemporaryDirectory() as folder:
                    process = subprocess.Popen(
                        [sys.executable, __file__, "--child", name, folder],
                        stdout=subprocess.PIPE,
                        start_new_session=True,
                    )
                    assert process.stdout is not None
                    process.stdout.readline()
                    time.sleep(chance.uniform(1.0 if name == "pool" else 0.1, 1.5))
                    begin = time.perf_counter()
                    process.send_signal(number)
                    process.wait()
                    times.append(time.perf_counter() - begin)
                    time.sleep(0.3)  # workers, and what watches their resources, end a moment later
                    orphans += len(left(process.pid))
            print(
                f"{name:24} {word:6} {statistics.median(times):8.3f} {max(times):8.3f}  {orphans}", flush=True
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
