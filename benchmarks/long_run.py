"""A thousand revolutions of the paper's scene: memory, the drive's phase, cost per revolution; see README.md.

python benchmarks/long_run.py [--revolutions N]
"""

from __future__ import annotations

import argparse
import itertools
import math
import subprocess
import sys
import time
import warnings
from dataclasses import dataclass
from fractions import Fraction

import chebclear as cc
import numpy as np

SPEED = cc.rpm(2000.0)
SAMPLES_PER_REVOLUTION = 5
# The default, and one that notices errors of 1e-14 m.
TOLERANCES = (1e-6, 1e-8)
COUNTERS = ("steps", "rejected", "stages", "evaluations", "events")


@dataclass(frozen=True)
class LongRun:
    """What a run of some revolutions cost and how exact its phase stayed."""

    revolutions: int
    per_revolution: dict[str, float]
    """Counters over revolutions [-]."""
    phase_error: float
    """Largest deviation of the crank from speed times time, in roundings of that angle [-]."""
    strain: float
    """Largest deviation of the slider from the ideal mechanism, over what the eccentricity allows [-]."""


def run(convention: str, revolutions: int, **settings: object) -> LongRun:
    """Simulate and look at what must not drift."""
    duration = revolutions * 2.0 * math.pi / SPEED
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        scene = cc.mechanisms.slider_crank(crank_speed=SPEED, convention=convention)
        result = cc.simulate(
            scene,
            duration=duration,
            samples=SAMPLES_PER_REVOLUTION * revolutions + 1,
            outputs=["crank.angle", "slider.x", "wrist.eccentricity"],
            **settings,  # type: ignore[arg-type]
        )
    # Products of the numbers themselves, rounded once.
    exact = np.array([float(Fraction(SPEED) * Fraction(t)) for t in result.t])
    roundings = np.abs(result["crank.angle"] - exact)[1:] / np.spacing(exact[1:])
    height = 0.05 * np.sin(exact)
    reach = np.sqrt(0.12**2 - height**2)
    deviation = np.abs(result["slider.x"] - 0.05 * np.cos(exact) - reach)
    # cos of the rod's angle; the curvature of the circle adds a part of order clearance / rod.
    allowed = result["wrist.eccentricity"] / (reach / 0.12) * (1.0 + 1e-3) + 1e-12
    counters = {name: getattr(result.stats, name) / revolutions for name in COUNTERS}
    return LongRun(revolutions, counters, float(roundings.max()), float((deviation / allowed).max()))


def peak_memory(convention: str, revolutions: int) -> float:
    """Largest resident memory of a process of its own that makes one run with two samples [MB]."""
    code = (
        "import pathlib, re, resource, warnings, chebclear as cc\n"
        "warnings.simplefilter('ignore')\n"
        f"scene = cc.mechanisms.slider_crank(convention={convention!r})\n"
        f"cc.simulate(scene, duration={revolutions * 0.03!r}, samples=2, outputs=['slider.x'])\n"
        # On Linux a child inherits the peak of its parent in `ru_maxrss`.
        "status = pathlib.Path('/proc/self/status')\n"
        "peak = re.search(r'VmHWM:\\s+(\\d+) kB', status.read_text()) if status.exists() else None\n"
        "print(peak[1] if peak else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)"
    )
    answer = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    # Kilobytes on Linux, bytes on macOS.
    return float(answer.stdout) / (1e6 if sys.platform == "darwin" else 1e3)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--revolutions", type=int, default=1000)
    options = parser.parse_args()
    lengths = [options.revolutions // part for part in (8, 4, 2, 1)]
    for convention, rtol in itertools.product(("as_printed", "corrected"), TOLERANCES):
        print(f"{convention}, rtol {rtol:g}")
        for revolutions in lengths:
            begin = time.perf_counter()
            result = run(convention, revolutions, rtol=rtol)
            seconds = time.perf_counter() - begin
            counts = ", ".join(f"{value:.1f} {name}" for name, value in result.per_revolution.items())
            print(
                f"  {revolutions:5d} revolutions: {counts} per revolution; {seconds:.2f} s; phase off by "
                f"{result.phase_error:.1f} roundings; slider at {result.strain:.4f} of its bound; "
                f"{peak_memory(convention, revolutions):.1f} MB"
            )


if __name__ == "__main__":
    main()
