"""What a run of a study costs in Python: of templates, of callables and of ready-made mechanisms.

Run: python benchmarks/overhead.py [runs]

Processor time of the threads that run Python, the callable of the user included, over the runs; the core
computes on threads of its own. Each run is a microsecond of motion, so that next to nothing else is measured.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import chebclear as cc
from chebclear.execution import dispatch
from chebclear.study.polynomials.points import sobol_points

BOX = {
    "crank_length": cc.Interval.around(0.05, rel=0.05),
    "rod_length": cc.Interval.around(0.12, rel=0.05),
    "clearance": cc.Interval.around(2e-5, rel=0.2),
}
SETTINGS: dict[str, Any] = {"duration": 1e-6, "samples": 2, "method": "dop853", "rtol": 1e-2, "threads": 1}
TEMPLATE = """
format = 1
parameters.crank_length = 0.05
parameters.rod_length = 0.12
parameters.clearance = "20 um"
parameters.crank_mass = 0.3
parameters.rod_mass = 0.21
ground.O = [0, 0]
drives = [{ type = "speed", name = "drive", joint = "crank_bearing", speed = "2000 rpm" }]

[[bodies]]
name = "crank"
mass = "crank_mass"
inertia = "crank_mass * crank_length**2 / 12"
center_of_mass = ["crank_length / 2", 0]
points = { A = [0, 0], B = ["crank_length", 0] }

[[bodies]]
name = "rod"
mass = "rod_mass"
inertia = "rod_mass * rod_length**2 / 12"
center_of_mass = ["rod_length / 2", 0]
points = { B = [0, 0], C = ["rod_length", 0] }

[[bodies]]
name = "slider"
mass = 0.14
inertia = 1e-4
points = { C = [0, 0] }

[[joints]]
type = "revolute"
name = "crank_bearing"
a = "ground.O"
b = "crank.A"

[[joints]]
type = "revolute"
name = "crank_pin"
a = "crank.B"
b = "rod.B"

[[joints]]
type = "prismatic"
name = "guide"
a = "ground.O"
b = "slider.C"
axis = [1, 0]

[[joints]]
type = "clearance_revolute"
name = "wrist"
bearing = "rod.C"
journal = "slider.C"
journal_radius = "9.8 mm"
clearance = "clearance"
contact = { law = "flores", stiffness = "1.5e9 * sqrt(1 + 0.0098 / clearance)", restitution = 0.9 }
friction = { law = "smoothed_coulomb", coefficient = 0.03, velocity = 1e-3 }
"""


def by_hand(crank_length: float, rod_length: float, clearance: float) -> cc.Scene:
    """The same mechanism by a callable of a user's."""
    return cc.Scene(
        ground={"O": (0.0, 0.0)},
        bodies=[
            cc.Body("crank", 0.3, 0.3 * crank_length**2 / 12, points={"A": (0, 0), "B": (crank_length, 0.0)}),
            cc.Body("rod", 0.21, 0.21 * rod_length**2 / 12, points={"B": (0, 0), "C": (rod_length, 0.0)}),
            cc.Body("slider", 0.14, 1e-4, points={"C": (0.0, 0.0)}),
        ],
        joints=[
            cc.Revolute("crank_bearing", "ground.O", "crank.A"),
            cc.Revolute("crank_pin", "crank.B", "rod.B"),
            cc.Prismatic("guide", "ground.O", "slider.C", axis=(1.0, 0.0)),
            cc.ClearanceRevolute(
                "wrist",
                "rod.C",
                "slider.C",
                9.8e-3,
                clearance,
                cc.laws.LankaraniNikravesh(3e10, 0.9),
                cc.laws.SmoothedCoulomb(0.03, 1e-3),
            ),
        ],
        drives=[cc.motions.Speed("drive", "crank_bearing", cc.rpm(2000.0))],
    )


class Clock:
    """Processor time of a function on whatever thread it is called."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.function = function
        self.seconds = 0.0
        self._lock = threading.Lock()

    def __call__(self, *arguments: Any, **keywords: Any) -> Any:
        begin = time.thread_time()
        try:
            return self.function(*arguments, **keywords)
        finally:
            with self._lock:
                self.seconds += time.thread_time() - begin


def measure(build: Callable[..., cc.Scene], runs: int) -> tuple[float, float]:
    """Processor time of a run in Python and in the core [s]."""
    study = cc.Study(build, BOX, ["slider.x"], **SETTINGS)
    points = sobol_points(study.intervals, 0, runs, 0)
    study.runner.made(points[:100], study.runner.settings)
    pieces = Clock(dispatch.simulate_order)
    dispatch.simulate_order = pieces  # type: ignore[assignment]
    whole, own = time.process_time(), time.thread_time()
    made = study.runner.made(points, study.runner.settings)
    own, whole = time.thread_time() - own, time.process_time() - whole
    dispatch.simulate_order = pieces.function
    assert len(made.values) == runs + 1
    python = own + pieces.seconds
    return python / runs, (whole - python) / runs


def main() -> None:
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000
    print(f"{runs} runs, processor time of a run    Python [us]   core [us]")
    for name, build in [
        ("template", cc.loads(TEMPLATE)),
        ("callable", by_hand),
        ("mechanisms.slider_crank", cc.mechanisms.slider_crank),
    ]:
        python, core = measure(build, runs)
        print(f"{name:35} {1e6 * python:11.1f} {1e6 * core:11.1f}", flush=True)


if __name__ == "__main__":
    main()
