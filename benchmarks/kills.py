"""A study killed at random moments: how much is lost each time, and whether it goes on to the same bits.

    python benchmarks/kills.py [--kills 20] [--seed 1]

For every kill a study with a store is begun, killed with SIGKILL between its first piece and its last, and
begun again to its end. Of each it prints when it was killed, the pieces that were kept and those that workers
had begun in vain. Ends with status 1 if a resumed study differs from an uninterrupted one in any bit, if a
resumption made more pieces than were missing, or if more than one piece a worker was lost.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import chebclear as cc
from chebclear.execution import dispatch
from chebclear.execution.pieces import simulate_order

WORKERS = 2
BOX = {"crank_length": cc.Interval.around(0.05, rel=0.1), "rod_length": cc.Interval.around(0.12, rel=0.05)}
LOG = "CHEBCLEAR_KILLS_LOG"


def logged(*arguments: Any) -> Any:
    """Simulates a piece and says so before."""
    with open(os.environ[LOG], "ab", buffering=0) as log:
        log.write(b"begun\n")
    return simulate_order(*arguments)


def study(store: Path | None, pool: Any, runs: int, result: Path) -> None:
    """The study that is killed."""
    warnings.simplefilter("ignore")
    made = cc.Study(
        cc.mechanisms.slider_crank,
        BOX,
        ["slider.x", "slider.vx"],
        duration=0.03,
        samples=121,
        store=store,
        executor=pool,
        threads=None if pool else WORKERS,
    )
    made.sample(runs, rng=3).save(result)


def begun(log: Path) -> int:
    return len(log.read_bytes().splitlines()) if log.exists() else 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--runs", type=int, default=600)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--child", nargs=3, metavar=("STORE", "WHERE", "RESULT"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        store, where, result = options.child
        dispatch.simulate_order = logged
        pool = ProcessPoolExecutor(WORKERS, mp_context=get_context("spawn")) if where == "pool" else None
        print("ready", flush=True)
        study(Path(store), pool, options.runs, Path(result))
        return 0
    chance = random.Random(options.seed)
    wrong = 0
    with TemporaryDirectory() as name:
        folder = Path(name)
        study(None, None, options.runs, folder / "whole.npz")
        whole = cc.results.StudyResult.load(folder / "whole.npz")
        for where in ("here", "pool"):
            wrong += kills(where, options.kills, options.runs, chance, folder, whole)
    return 1 if wrong else 0


def kills(
    where: str, count: int, runs: int, chance: random.Random, folder: Path, whole: cc.results.StudyResult
) -> int:
    """Kill studies, one after the other; how many went wrong."""
    pieces, lost, differ = 0, [], 0
    for number in range(-1, count):  # the first one is not killed, and says how many pieces there are
        store, log = folder / f"{where}{number}", folder / f"{where}{number}.log"
        command = [sys.executable, __file__, "--runs", str(runs), "--child", str(store), where]
        environment = os.environ | {LOG: str(log)}
        process = subprocess.Popen(
            [*command, str(folder / "killed.npz")], env=environment, stdout=subprocess.PIPE
        )
        assert process.stdout is not None
        process.stdout.readline()
        if number < 0:
            process.wait()
            pieces = begun(log)
            continue
        # A moment between the first piece and the last, whatever else the machine does.
        most = chance.uniform(0.0, pieces)
        while begun(log) < most and process.poll() is None:
            time.sleep(0.005)
        time.sleep(chance.uniform(0.0, 0.3))
        process.send_signal(signal.SIGKILL)
        process.wait()
        time.sleep(0.5)  # workers of a pool end a moment later
        kept, tried = len(list(store.glob("piece-*.npz"))), begun(log)
        log.unlink(missing_ok=True)
        subprocess.run(
            [*command, str(folder / "again.npz")], env=environment, check=True, capture_output=True
        )
        again = cc.results.StudyResult.load(folder / "again.npz")
        new = len(list(store.glob("piece-*.npz"))) - kept
        same = again == whole
        lost.append(tried - kept)
        differ += not same or begun(log) != new
        print(
            f"{where}: killed after {tried} of about {pieces} pieces, {kept} kept, {tried - kept} begun in "
            f"vain; begun again {begun(log)}, {'same' if same else 'OTHER'} bits",
            flush=True,
        )
    print(f"{where}: of {count} resumptions {differ} differ; pieces lost at most {max(lost)}", flush=True)
    return differ + (max(lost) > WORKERS)


if __name__ == "__main__":
    sys.exit(main())
