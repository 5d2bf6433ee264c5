"""What `Study.plan` predicts against what then happens, on five studies with a store.

    python benchmarks/plans.py [--cases band features]

Every study runs in a process of its own. Printed are runs, seconds, memory at the peak and disk, planned and
found, and their ratio. Linux only, since the system must tell the peak.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
import warnings
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import chebclear as cc
import numpy as np
from memory import largest
from scaling import BOX, FEATURES

SMALL = {"crank_length": cc.Interval.around(0.05, rel=0.05), "rod_length": cc.Interval.around(0.12, rel=0.05)}
OUTPUTS = ["slider.x", "slider.vx", "slider.ax", "wrist.normal_force"]
T = np.linspace(0.0, 1.0, 501)


def own(a: float, b: float) -> dict[str, Any]:
    """A model of one's own, which takes some milliseconds."""
    begin = time.perf_counter()
    while time.perf_counter() - begin < 3e-3:
        pass
    return {"t": T, "x": np.sin(a * T) * b, "v": a * np.cos(a * T) * b}


def case_of(name: str, store: Path) -> tuple[cc.Study, str, dict[str, Any]]:
    """Study, method and arguments of a case."""
    crank = cc.mechanisms.slider_crank
    if name == "band":
        return (
            cc.Study(crank, SMALL, OUTPUTS, duration=0.03, samples=721, store=store),
            "band",
            {"runs": 1500},
        )
    if name == "polynomials":
        options: dict[str, Any] = {"duration": 2e-3, "samples": 481, "store": store}
        return cc.Study(crank, SMALL, OUTPUTS, **options), "chebyshev", {"degree": 6, "nodes": 50}
    if name == "features":
        options = {"duration": 4e-3, "samples": 2, "features": FEATURES, "store": store}
        return cc.Study(crank, BOX, [], **options), "sample", {"runs": 8000}
    if name == "file":
        options = {"duration": 0.01, "samples": 1441, "store": store, "in_memory": False}
        return cc.Study(crank, SMALL, OUTPUTS, **options), "scan", {"points": 45}
    assert name == "own model", name
    box = {"a": cc.Interval.around(9.0, rel=0.1), "b": cc.Interval.around(1.0, rel=0.1)}
    return cc.Study(own, box, store=store, version=None if store is None else "1"), "band", {"runs": 2000}


CASES = ("band", "polynomials", "features", "file", "own model")


def child(name: str, folder: Path) -> None:
    """One case in this process."""
    warnings.simplefilter("ignore")
    store = folder / "store"
    study, method, given = case_of(name, store)
    plan = study.plan(method, **given)
    begin = time.perf_counter()
    result = getattr(study, method)(**given)
    seconds = time.perf_counter() - begin
    runs = len(result.parameters) + 1
    disk = float(sum(path.stat().st_size for path in store.iterdir()))
    found = (float(runs), seconds, largest() / 1e6, disk / 1e6)
    planned = (float(plan.runs), plan.seconds, plan.memory / 1e6, plan.disk / 1e6)
    for what, one, other in zip(("runs", "s", "MB", "MB on disk"), planned, found, strict=True):
        print(f"{name:12} {what:10} {one:9.1f} {other:9.1f} {one / other:6.2f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", nargs="+", default=CASES, choices=CASES)
    parser.add_argument("--child", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        with TemporaryDirectory() as folder:
            child(options.child, Path(folder))
        return
    print(f"{'study':12} {'':10} {'planned':>9} {'found':>9} {'ratio':>6}", flush=True)
    for case in options.cases:
        subprocess.run([sys.executable, __file__, "--child", case], check=True)


if __name__ == "__main__":
    main()
