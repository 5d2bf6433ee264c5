"""Time per simulation against error, chebclear beside SciPy and Exudyn, on the paper's case; see README.md.

python benchmarks/simulate.py [--quick] [--json FILE]
"""

from __future__ import annotations

import argparse
import json
import math
import os
import platform
import statistics
import time
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
import rival

try:
    import chebclear as cc
except ImportError as error:
    cc, missing = None, error
try:
    import peer
except ImportError as error:
    peer, no_peer = None, error

DURATION, SAMPLES, FLOOR = 0.06, 1441, 1e-6
REFERENCE_SAMPLES = 601  # of the reference files: every 1e-4 s
FIRST = 101  # of them, the first 10 ms
LIMIT = 3e-3  # largest admissible velocity error [m/s]
REFERENCES = {
    "as_printed": "slider_crank_as_printed.csv",
    "corrected": "slider_crank_physical.csv",
    "frictionless": None,  # the tightest run of the SciPy model: Exudyn has this scene's very equations
}
OUTPUTS = (  # the quantities that the rival computes as well
    "slider.x",
    "slider.vx",
    "slider.ax",
    "rod.angle",
    "rod.angular_velocity",
    "wrist.penetration",
    "wrist.normal_force",
)
# Without the bound of the tolerances by the resting contact: those of the SciPy model, to the letter.
PLAIN = "auto, plain"
OURS = {"auto": "auto", PLAIN: "auto", "Rodas4": "rodas4", "Rodas5P": "rodas5p", "DOP853 (own)": "dop853"}
COMPILED = ("odeint", "ode dop853")
EXUDYN = "Exudyn "
DECADES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
TOLERANCES = {
    **dict.fromkeys(OURS, DECADES),
    **dict.fromkeys((*COMPILED, "LSODA", "DOP853"), DECADES),
    "Radau": DECADES[:5],
    "solve_ivp LSODA": DECADES[1:6],
    "solve_ivp DOP853": DECADES[1:5],
    "solve_ivp Radau": DECADES[1:4],
    "Exudyn DOPRI5": (1e-5, 1e-6, 1e-8, 1e-10),
    "Exudyn DOPRI5 by step": (8e-6, 2e-6, 1e-6, 5e-7),
    "Exudyn trapezoidal": (3.2e-5, 8e-6, 2e-6, 1e-6),
    "Exudyn generalized alpha": (8e-6, 1e-6),
}
QUICK = {
    **dict.fromkeys(OURS, (1e-4, 1e-6)),
    **dict.fromkeys((*COMPILED, "LSODA"), (1e-5, 1e-7)),
    "DOP853": (1e-5,),
    "Radau": (1e-5,),
    "solve_ivp LSODA": (1e-7,),
    "Exudyn DOPRI5": (1e-6,),
}
SLOW = 0.15  # a run that takes longer is repeated less often [s]


@dataclass
class Setting:
    """A method at a tolerance: what it costs and what it delivers."""

    convention: str
    method: str
    rtol: float
    run: Callable[[int], Any] = field(repr=False)
    error: float = math.nan
    error_first: float = math.nan
    counters: dict[str, int] = field(default_factory=dict)
    times: list[float] = field(default_factory=list, repr=False)
    failure: str = ""

    @property
    def best(self) -> float:
        return min(self.times, default=math.nan)

    @property
    def median(self) -> float:
        return statistics.median(self.times) if self.times else math.nan

    @property
    def ours(self) -> bool:
        return self.method in OURS

    @property
    def scipy(self) -> bool:
        return not self.ours and not self.method.startswith(EXUDYN)

    def measure_error(self, reference: np.ndarray) -> None:
        """Also the warm-up: everything is compiled and loaded afterwards."""
        try:
            velocity, self.counters = _velocity_and_counters(self.run(REFERENCE_SAMPLES))
            self.run(SAMPLES)
        except Exception as error:  # a method that gives up at this tolerance is a result, not an accident
            self.failure = f"{type(error).__name__}: {error}"
            return
        deviation = np.abs(velocity - reference)
        if np.isfinite(deviation).all():
            self.error, self.error_first = float(deviation.max()), float(deviation[:FIRST].max())
        else:
            self.failure = "not a number in the result"

    def measure_time(self) -> None:
        begin = time.perf_counter()
        self.run(SAMPLES)
        self.times.append(time.perf_counter() - begin)

    def record(self) -> dict[str, Any]:
        plain = asdict(self)
        del plain["run"]
        plain |= {"best": self.best, "median": self.median}
        return {k: None if isinstance(v, float) and math.isnan(v) else v for k, v in plain.items()}


def _settings(convention: str, tolerances: dict[str, tuple[float, ...]]) -> list[Setting]:
    return [
        Setting(convention, method, rtol, _runner(convention, method, rtol))
        for method, rtols in tolerances.items()
        if (cc is not None or method not in OURS) and (peer is not None or not method.startswith(EXUDYN))
        for rtol in rtols
    ]


def _runner(convention: str, method: str, rtol: float) -> Callable[[int], Any]:
    if method.startswith(EXUDYN):
        name = method.removeprefix(EXUDYN).removesuffix(" by step")
        # DOPRI5 controls its error below this step; the others halve their step until an impact converges.
        given = {"step": 3.2e-5, "tolerance": rtol} if method == "Exudyn DOPRI5" else {"step": rtol}
        return lambda samples: peer.simulate(
            convention,
            method=name,
            **given,
            duration=DURATION,
            samples=samples,
            impact_velocity_floor=FLOOR,
            times=np.linspace(0.0, DURATION, samples) if samples == REFERENCE_SAMPLES else None,
        )
    if method not in OURS:
        return lambda samples: rival.simulate(
            convention,
            method=method,
            rtol=rtol,
            duration=DURATION,
            samples=samples,
            impact_velocity_floor=FLOOR,
        )
    if convention == "frictionless":
        scene = cc.mechanisms.slider_crank(friction=None, impact_velocity_floor=FLOOR)
    else:
        scene = cc.mechanisms.slider_crank(convention=convention, impact_velocity_floor=FLOOR)
    given = {"rtol": rtol, "method": OURS[method], "outputs": OUTPUTS}
    if method == PLAIN:
        given |= {"position_tolerance": rtol * 1e-5, "velocity_tolerance": rtol * 1.0}
    return lambda samples: cc.simulate(scene, duration=DURATION, samples=samples, **given)


def _velocity_and_counters(run: Any) -> tuple[np.ndarray, dict[str, int]]:
    if isinstance(run, rival.Run):
        counters = {"evaluations": run.evaluations, "jacobians": run.jacobians, "changes": len(run.changes)}
        return run.vx, counters if run.steps is None else {"steps": run.steps, **counters}
    if peer is not None and isinstance(run, peer.Run):
        return run.vx, {"steps": run.steps}
    names = ("steps", "rejected", "stages", "evaluations", "jacobians", "factorizations", "relocations")
    counters = {name: getattr(run.stats, name) for name in names if hasattr(run.stats, name)}
    kinds = [str(kind) for kind in run.events.kind]
    return run["slider.vx"], {**counters, "changes": kinds.count("onset") + kinds.count("separation")}


def measure(convention: str, tolerances: dict[str, tuple[float, ...]], repeats: int) -> list[Setting]:
    """Errors first, then the times in rounds over all settings, so that a busy machine slows all alike."""
    reference = _reference(convention)
    settings = _settings(convention, tolerances)
    for setting in settings:
        setting.measure_error(reference)
    for round_number in range(repeats):
        for setting in settings[:: 1 if round_number % 2 == 0 else -1]:
            seldom = setting.times and setting.best > SLOW and round_number >= max(2, repeats // 3)
            if not setting.failure and not seldom:
                setting.measure_time()
    return settings


def _reference(convention: str) -> np.ndarray:
    """Velocities of the slider [m/s] by a code that is not measured at that tolerance."""
    name = REFERENCES[convention]
    if name is None:
        return rival.simulate(
            convention,
            method="DOP853",
            rtol=1e-11,
            duration=DURATION,
            samples=REFERENCE_SAMPLES,
            impact_velocity_floor=FLOOR,
        ).vx
    path = Path(__file__).resolve().parent.parent / "tests" / "data" / name
    return np.loadtxt(path, delimiter=",")[:, 2]


def table(settings: list[Setting]) -> str:
    head = (
        f"{'method':<24} {'rtol':>6} {'best':>9} {'median':>9} {'max error':>10} {'10 ms':>9} "
        f"{'steps':>7} {'rejected':>8} {'rhs':>8} {'jac':>6} {'changes':>7}"
    )
    units = f"{'':<24} {'':>6} {'[ms]':>9} {'[ms]':>9} {'[m/s]':>10} {'[m/s]':>9}"
    lines, previous = [head, units], None
    for s in settings:
        if previous not in (None, s.method):
            lines.append("")
        previous = s.method
        if s.failure:
            lines.append(f"{s.method:<24} {s.rtol:>6.0e} failed: {s.failure[:80]}")
            continue
        steps, rejected, calls, jacobians, changes = (
            s.counters.get(name, "-") for name in ("steps", "rejected", "evaluations", "jacobians", "changes")
        )
        lines.append(
            f"{s.method:<24} {s.rtol:>6.0e} {1e3 * s.best:>9.2f} {1e3 * s.median:>9.2f} {s.error:>10.1e} "
            f"{s.error_first:>9.1e} {steps:>7} {rejected:>8} {calls:>8} {jacobians:>6} {changes:>7}"
        )
    return "\n".join(lines)


def _steady(settings: list[Setting]) -> list[Setting]:
    """Those within the limit at whose tolerance, and all tighter ones of their method, the limit is kept."""
    return [
        s
        for s in settings
        if all(t.error <= LIMIT for t in settings if t.method == s.method and t.rtol <= s.rtol)
    ]


def _fastest(settings: list[Setting]) -> Setting | None:
    return min((s for s in settings if s.times), key=lambda s: s.best, default=None)


def ratios(settings: list[Setting]) -> list[dict[str, Any]]:
    """Fastest rival setting over fastest chebclear setting, by the rules that README.md explains."""
    groups = {
        "all of SciPy": [s for s in settings if s.scipy],
        "solver classes": [s for s in settings if s.scipy and s.method not in COMPILED],
        "solve_ivp": [s for s in settings if s.method.startswith("solve_ivp")],
        "Exudyn": [s for s in settings if s.method.startswith(EXUDYN)],
    }
    ours = [s for s in settings if s.ours]
    best = _fastest([s for s in ours if s.error <= LIMIT])
    steady = _fastest(_steady(ours))
    found = []
    for name, group in groups.items():
        rules = [(f"both <= {LIMIT:g} m/s", best, [s for s in group if s.error <= LIMIT])]
        if best is not None:
            rules.append(("their error >= ours", best, [s for s in group if s.error >= best.error]))
        rules.append((f"both steadily <= {LIMIT:g} m/s", steady, _steady(group)))
        for rule, mine, candidates in rules:
            theirs = _fastest(candidates)
            row = {"rivals": name, "rule": rule, "ours": _name(mine), "theirs": _name(theirs)}
            if mine is not None and theirs is not None:
                row |= {"ratio": theirs.best / mine.best, "ratio_median": theirs.median / mine.median}
            found.append(row)
        for rule, error in (("ours as accurate", "error"), ("ours as accurate, 10 ms", "error_first")):
            found.extend(_no_worse(name, rule, error, ours, group))
    return found


def _no_worse(
    rivals: str, rule: str, error: str, ours: list[Setting], group: list[Setting]
) -> list[dict[str, Any]]:
    """Every rival setting against our fastest that is no less accurate: the closest, and their best."""
    pairs = [
        (theirs, mine)
        for theirs in group
        if theirs.times
        and (mine := _fastest([s for s in ours if getattr(s, error) <= getattr(theirs, error)]))
    ]
    rows = []
    for which, key in (
        ("closest", lambda pair: pair[0].best / pair[1].best),
        ("their best", lambda pair: getattr(pair[0], error)),
    ):
        row = {"rivals": rivals, "rule": f"{rule}: {which}", "ours": "none", "theirs": "none"}
        if pairs:
            theirs, mine = min(pairs, key=key)
            row |= {"ours": _name(mine, error), "theirs": _name(theirs, error)}
            row |= {"ratio": theirs.best / mine.best, "ratio_median": theirs.median / mine.median}
        rows.append(row)
    return rows


def _name(setting: Setting | None, error: str = "error") -> str:
    if setting is None:
        return "none"
    return (
        f"{setting.method} {setting.rtol:.0e} {1e3 * setting.best:.1f} ms {getattr(setting, error):.0e} m/s"
    )


def ratio_table(rows: list[dict[str, Any]]) -> str:
    lines = [f"{'rivals':<15} {'rule':<35} {'ratio of best':>13} {'of medians':>11}"]
    for row in rows:
        best, median = (f"{row[k]:.1f}" if k in row else "-" for k in ("ratio", "ratio_median"))
        pair = f"{row['theirs']}  /  {row['ours']}"
        lines.append(f"{row['rivals']:<15} {row['rule']:<35} {best:>13} {median:>11}   {pair}")
    return "\n".join(lines)


def study(convention: str, repeats: int) -> dict[str, Any]:
    """The paper's study: 16 Chebyshev runs, one at the midpoint, 100 of the scan; on 1 and 2 threads."""
    best: dict[int, float] = {}
    for _ in range(repeats):
        for threads in (1, 2):
            begin = time.perf_counter()
            case = cc.Study(
                cc.mechanisms.slider_crank,
                {
                    "crank_length": cc.Interval.around(0.05, rel=0.1),
                    "rod_length": cc.Interval.around(0.12, rel=0.1),
                },
                outputs=["slider.x", "slider.vx", "slider.ax", "wrist.penetration"],
                duration=DURATION,
                samples=SAMPLES,
                fixed={"convention": convention},
                threads=threads,
            )
            result, scan = case.chebyshev(degree=3), case.scan(10)
            cc.compare(result, scan)
            best[threads] = min(time.perf_counter() - begin, best.get(threads, math.inf))
    return {"convention": convention, "seconds": best, "efficiency": best[1] / (2 * best[2])}


def _machine() -> dict[str, Any]:
    packages = {}
    for name in ("chebclear", "numpy", "scipy", "numba", "exudyn"):
        try:
            packages[name] = version(name)
        except PackageNotFoundError:
            packages[name] = None
    return {"python": platform.python_version(), "processors": os.cpu_count(), "packages": packages}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="few tolerances, three repeats, no study")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write all figures there as well")
    parser.add_argument("--repeats", type=int, help="timings of each setting (default 9)")
    parser.add_argument("--no-study", action="store_true", help="leave out the study of 117 runs")
    parser.add_argument("--convention", choices=tuple(REFERENCES), help="only one of them (default all)")
    arguments = parser.parse_args()
    repeats = arguments.repeats or (3 if arguments.quick else 9)
    if cc is None:
        print(f"chebclear cannot be imported ({missing}): SciPy only\n")
    if peer is None:
        print(f"Exudyn cannot be imported ({no_peer}): left out\n")
    machine = _machine()
    print(", ".join(f"{name} {number}" for name, number in machine["packages"].items()))
    results: dict[str, Any] = {"machine": machine, "limit": LIMIT, "conventions": {}, "study": []}
    for convention in [arguments.convention] if arguments.convention else REFERENCES:
        settings = measure(convention, QUICK if arguments.quick else TOLERANCES, repeats)
        rows = ratios(settings)
        print(f"\n== {convention}: {DURATION:g} s, {SAMPLES} samples, error against the reference ==\n")
        print(table(settings))
        print(f"\n{ratio_table(rows)}", flush=True)
        results["conventions"][convention] = {"settings": [s.record() for s in settings], "ratios": rows}
        without = arguments.quick or arguments.no_study or convention == "frictionless"
        if cc is not None and not without:
            results["study"].append(study(convention, min(3, repeats)))
    for row in results["study"]:
        one, two = row["seconds"][1], row["seconds"][2]
        print(
            f"\nstudy of 117 runs, {row['convention']}: {one:.2f} s on one thread, {two:.2f} s on two, "
            f"efficiency {row['efficiency']:.2f}"
        )
    if arguments.json:
        arguments.json.write_text(json.dumps(results, indent=1) + "\n")


if __name__ == "__main__":
    warnings.simplefilter("ignore")  # of the solvers and of the core: failures are in the table
    main()
