"""Coverage and width of calibrated bands against the hull of thousands of runs, on eleven problems.

    python benchmarks/bands.py FOLDER [--problems P1 P2] [--budgets 41 81 321] [--seeds 6] [--certify]

The reference hull and the fresh runs of a problem are made once and kept in FOLDER: some minutes for each. Of
every output it prints: the share of the samples of fresh runs that are inside, its standard deviation between
studies, the width over that of the hull, the coverage of held-out runs, the share of whole runs inside and
its estimate, the verdicts, and the time of the bands over that of the runs.
"""

from __future__ import annotations

import argparse
import math
import time
import warnings
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import chebclear as cc
import numpy as np
from chebclear import interval, mechanisms
from chebclear.study.band.calibrated import calibrated_bands
from chebclear.study.polynomials.points import random_points

SAMPLES = 721
REFERENCE, FRESH = 4000, 1500
RTOL = 1e-4
WRIST = ["slider.x", "slider.vx", "slider.ax", "wrist.penetration", "wrist.normal_force"]
LENGTHS = {"crank_length": interval(0.05, rel=0.1), "rod_length": interval(0.12, rel=0.1)}
SECOND_TURN = {"skip": 0.03, "duration": 0.03}
FRICTION = mechanisms.slider_crank().joints[-1].friction


def of(part: str, turning: bool, pin: str) -> list[str]:
    """Position, velocity and acceleration of a part, penetration and force of a pin."""
    motion = ["angle", "angular_velocity", "angular_acceleration"] if turning else ["x", "vx", "ax"]
    return [*(f"{part}.{name}" for name in motion), f"{pin}.penetration", f"{pin}.normal_force"]


def rubbing_slider_crank(friction_coefficient: float, **options: Any) -> cc.Scene:
    """A slider-crank with friction coefficients in the ratio of the paper's."""
    factor = friction_coefficient / FRICTION.sliding_coefficient
    friction = replace(
        FRICTION,
        sliding_coefficient=friction_coefficient,
        static_coefficient=factor * FRICTION.static_coefficient,
    )
    return mechanisms.slider_crank(friction=friction, **options)


def chain(length: float = 0.1, mass: float = 0.2, clearance: float = 1e-4) -> cc.Scene:
    """Three links that swing from a zigzag, with clearance in the second joint."""
    law = cc.LankaraniNikravesh(stiffness=1e9, restitution=0.7)
    ends = ["ground", "link0.B", "link1.B"]
    links = [
        cc.Body(
            f"link{k}",
            mass=mass,
            inertia=mass * length**2 / 12,
            center_of_mass=(length / 2, 0.0),
            points={"A": (0.0, 0.0), "B": (length, 0.0)},
            angle=-0.5 * math.pi + 0.5 * (-1) ** k,
        )
        for k in range(3)
    ]
    loose = cc.ClearanceRevolute(
        "joint1", bearing=ends[1], journal="link1.A", journal_radius=0.01, clearance=clearance, contact=law
    )
    joints = [cc.Revolute("joint0", ends[0], "link0.A"), loose, cc.Revolute("joint2", ends[2], "link2.A")]
    return cc.Scene(bodies=links, joints=joints, forces=[cc.Gravity((0.0, -9.81))])


EIGHT = {
    "crank_length": 0.05,
    "rod_length": 0.12,
    "clearance": 2e-5,
    "rod_mass": 0.21,
    "slider_mass": 0.14,
    "restitution": 0.9,
    "young_modulus": 207e9,
    "friction_coefficient": FRICTION.sliding_coefficient,
}
WIDE = {"clearance": interval(5e-4, rel=0.1)}
# What is built, the intervals, fixed values, outputs, times.
PROBLEMS: dict[str, tuple[Any, dict[str, cc.Interval], dict[str, Any], list[str], dict[str, float]]] = {
    "P1": (mechanisms.slider_crank, LENGTHS, {}, WRIST, SECOND_TURN),
    "P2": (mechanisms.slider_crank, LENGTHS, {"clearance": 2e-4}, WRIST, SECOND_TURN),
    "P3a": (mechanisms.slider_crank, WIDE, {}, WRIST, SECOND_TURN),
    "P3b": (mechanisms.slider_crank, LENGTHS | WIDE, {}, WRIST, SECOND_TURN),
    "P4": (
        mechanisms.four_bar,
        {
            "coupler_length": interval(0.10, rel=0.02),
            "rocker_length": interval(0.08, rel=0.02),
            "clearance": interval(1e-4, rel=0.1),
        },
        {},
        of("rocker", True, "rocker_pin"),
        SECOND_TURN,
    ),
    "P5": (
        rubbing_slider_crank,
        {name: interval(value, rel=0.05) for name, value in EIGHT.items()},
        {},
        WRIST,
        SECOND_TURN,
    ),
    "P6": (mechanisms.slider_crank, LENGTHS, {"clearance_at": ()}, WRIST[:3], SECOND_TURN),
    "quick return": (
        mechanisms.quick_return,
        {
            "crank_length": interval(0.05, rel=0.02),
            "lever_length": interval(0.2, rel=0.02),
            "clearance": interval(1e-4, rel=0.2),
        },
        {},
        of("ram", False, "crank_pin"),
        {"skip": 0.05, "duration": 0.1},
    ),
    "six-bar": (
        mechanisms.six_bar,
        {
            "link_length": interval(0.14, rel=0.01),
            "output_length": interval(0.10, rel=0.01),
            "coupler_length": interval(0.10, rel=0.01),
        },
        {"clearance": 5e-5, "crank_speed": cc.rpm(600.0)},
        of("output", True, "output_pin"),
        {"skip": 0.05, "duration": 0.05},
    ),
    "chain": (
        chain,
        {
            "length": interval(0.1, rel=0.05),
            "mass": interval(0.2, rel=0.1),
            "clearance": interval(1e-4, rel=0.2),
        },
        {},
        of("link2", True, "joint1"),
        {"skip": 0.0, "duration": 0.3},
    ),
    "pendulum": (
        mechanisms.pendulum_in_bearing,
        {
            "length": interval(0.2, rel=0.05),
            "clearance": interval(1e-4, rel=0.2),
            "restitution": interval(0.7, rel=0.1),
        },
        {},
        of("pendulum", True, "pivot"),
        {"skip": 0.0, "duration": 0.3},
    ),
}


def study_of(name: str, **options: Any) -> cc.Study:
    """The study of a problem."""
    build, intervals, fixed, outputs, times = PROBLEMS[name]
    return cc.Study(build, intervals, outputs, fixed=fixed, samples=SAMPLES, rtol=RTOL, **times, **options)


def reference(name: str, folder: Path, hull_runs: int, fresh_runs: int) -> dict[str, np.ndarray]:
    """Hull and fresh runs of a problem, from the folder if they are there."""
    path = folder / f"{name.replace(' ', '-')}-{hull_runs}-{fresh_runs}.npz"
    if path.exists():
        return dict(np.load(path))
    study = study_of(name)
    lower = upper = None
    for start in range(0, hull_runs, 500):
        points = random_points(study.intervals, min(500, hull_runs - start), seed=10_000 + start)
        values = study.simulated(points, study.settings, midpoint=False).values
        low, high = values.min(axis=0), values.max(axis=0)
        lower = low if lower is None else np.minimum(lower, low)
        upper = high if upper is None else np.maximum(upper, high)
    points = random_points(study.intervals, fresh_runs, seed=9_999)
    fresh = study.simulated(points, study.settings, midpoint=False).values
    np.savez(path, lower=lower, upper=upper, fresh=fresh)
    return {"lower": lower, "upper": upper, "fresh": fresh}


def judged(results: list[cc.StudyResult], known: dict[str, np.ndarray], seconds: str) -> None:
    """A line for every output of studies that differ by their seed."""
    for index, output in enumerate(results[0]):
        fresh = known["fresh"][:, :, index]
        width = float(np.mean(known["upper"][:, index] - known["lower"][:, index]))
        bands = [result[output] for result in results]
        inside = [(fresh >= band.lower) & (fresh <= band.upper) for band in bands]
        shares = [100.0 * each.mean() for each in inside]
        widths = [band.width.mean() / width for band in bands]
        verdicts = Counter(band.verdict for band in bands)
        print(
            f"  {output:<30} {np.mean(shares):7.3f} ±{np.std(shares):5.3f} %  width {np.mean(widths):5.3f} "
            f"±{np.std(widths):5.3f}  held out {100 * np.mean([band.coverage for band in bands]):7.3f} %  "
            f"whole {100 * np.mean([each.all(axis=1).mean() for each in inside]):5.1f} % of "
            f"{100 * np.mean([band.whole_run for band in bands]):4.1f} % promised  "
            f"{', '.join(f'{count} {word}' for word, count in verdicts.items())}{seconds}",
            flush=True,
        )


def time_share(result: cc.StudyResult, seconds: float) -> str:
    """Time of the bands of all outputs over that of the runs, on the processor."""
    requirement = result.requirement
    assert requirement is not None
    columns = [np.vstack([band.runs, band.nominal]) for band in result.bands.values()]
    values = np.ascontiguousarray(np.stack(columns, axis=-1))
    start = time.process_time()
    calibrated_bands(result.t, result.outputs, values, result.intervals, result.parameters, requirement)
    return f"  bands take {100.0 * (time.process_time() - start) / seconds:.1f} % of the runs"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="where hulls and fresh runs are kept")
    parser.add_argument("--problems", nargs="+", default=list(PROBLEMS), choices=list(PROBLEMS))
    parser.add_argument("--budgets", nargs="+", type=int, default=[41, 81, 321])
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--hull", type=int, default=REFERENCE, help="runs of the reference hull")
    parser.add_argument("--fresh", type=int, default=FRESH, help="fresh runs to judge on")
    parser.add_argument("--certify", action="store_true", help="certified bands instead")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore", cc.ChebclearWarning)
    for name in asked.problems:
        known = reference(name, asked.folder, asked.hull, asked.fresh)
        study = study_of(name)
        if asked.certify:
            results = [study.certify(seed=seed) for seed in range(asked.seeds)]
            print(f"{name}, certified by {len(results[0].parameters)} runs")
            judged(results, known, "")
            continue
        results, spent = [], 0.0
        for budget in sorted(asked.budgets):
            start, longer = time.process_time(), []
            for seed in range(asked.seeds):
                if results:
                    more = budget - len(results[seed].parameters)
                    longer.append(results[seed].extend(more))
                else:
                    longer.append(study.band(budget, seed=seed))
            results = longer
            spent += time.process_time() - start
            print(f"{name}, {budget} runs, {asked.seeds} studies")
            judged(results, known, time_share(results[0], spent / asked.seeds))


if __name__ == "__main__":
    main()
