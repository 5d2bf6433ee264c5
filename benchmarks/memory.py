"""Memory of a large study at its peak, by the accounting of the system, against what was planned for it.

    python benchmarks/memory.py [--runs 4096] [--cases band sample]

Every case runs in a process of its own. Printed are the size of its samples, the largest memory of the
process before the study and at its end, and the plan of the study. Mapped files count as long as they are in
the memory. Linux only.
"""

from __future__ import annotations

import argparse
import math
import re
import subprocess
import sys
import warnings
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import chebclear as cc

OUTPUTS = ["slider.x", "slider.vx", "slider.ax", "wrist.normal_force"]
CASES = (
    "sample",
    "scan",
    "chebyshev",
    "band",
    "rough band",
    "features",
    "save",
    "file: sample",
    "file: band",
)
SHORT, LONG = 1e-3, 4e-3
"""Durations [s]: before the first impacts polynomials follow the outputs, with them they do not."""


def largest() -> float:
    """The largest memory that this process has taken [bytes]."""
    found = re.search(r"VmHWM:\s+(\d+) kB", Path("/proc/self/status").read_text(encoding="ascii"))
    assert found is not None, "Linux tells it"
    return 1024.0 * float(found[1])


def arguments(case: str, runs: int) -> tuple[str, dict[str, Any]]:
    """Method and arguments of a case."""
    if case in ("scan", "chebyshev"):
        side = math.isqrt(runs)
        return (case, {"points": side}) if case == "scan" else (case, {"degree": 5, "nodes": side})
    return ("band" if "band" in case else "sample"), {"runs": runs}


def child(case: str, runs: int, folder: Path) -> None:
    """One case in this process."""
    warnings.simplefilter("ignore")
    box = {
        "crank_length": cc.Interval.around(0.05, rel=0.02),
        "rod_length": cc.Interval.around(0.12, rel=0.02),
    }
    options: dict[str, Any] = {"duration": LONG if "rough" in case else SHORT, "samples": 1441}
    if case.startswith("file"):
        options |= {"store": folder / "store", "in_memory": False}
    outputs = OUTPUTS
    if case == "features":
        outputs, options["features"] = (
            [],
            {"peak": cc.features.peak("slider.vx"), "mean": cc.features.mean("slider.x")},
        )
    study = cc.Study(cc.mechanisms.slider_crank, box, outputs, **options)
    method, given = arguments(case, runs)
    plan = study.plan(method, probes=2, **given)
    begin = largest()
    result = getattr(study, method)(**given)
    kinds = {band.verdict for band in result.bands.values()}
    made = largest()
    if case == "save":
        result.save(folder / "result.npz")
    size = 8e-6 * plan.runs * 1441 * len(outputs)
    print(
        f"{case:14} {plan.runs:6} {size:8.0f} {begin / 1e6:8.0f} {made / 1e6:8.0f} {largest() / 1e6:8.0f} "
        f"{plan.memory / 1e6:8.0f}  {' '.join(sorted(kinds))}",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=4096)
    parser.add_argument("--cases", nargs="+", default=CASES, choices=CASES)
    parser.add_argument("--child", help=argparse.SUPPRESS)
    options = parser.parse_args()
    with TemporaryDirectory() as folder:
        if options.child:
            child(options.child, options.runs, Path(folder))
            return
    print("case             runs  samples   before    study      end  planned [MB]  verdicts", flush=True)
    for case in options.cases:
        command = [sys.executable, __file__, "--child", case, "--runs", str(options.runs)]
        subprocess.run(command, check=True)


if __name__ == "__main__":
    main()
