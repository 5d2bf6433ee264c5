"""Coverage and width of calibrated bands against the hull of thousands of runs, on thirteen problems.

    python benchmarks/bands.py FOLDER [--problems P1 P2] [--budgets 9 41 81 321] [--coverages 0.99 0.999]

The reference hull, the fresh runs and the runs of the studies of a problem are made once and kept in
FOLDER: half a minute for each. Seven problems with a single parameter and eight with two are made if they
are named. Of every output it prints: the share of the samples of fresh runs that are inside, its standard
deviation between studies, the width over that of the hull, the coverage of held-out runs, the share of
whole runs inside and its estimate, the share of the studies that keep what is asked for, the verdicts, and
the processor time of bands over that of the runs; at the end the means over all outputs that no polynomial
resolves. With --independent it judges hulls of 1999 independent runs.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import math
import time
import warnings
from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import chebclear as cc
import numpy as np
from chebclear import Interval, mechanisms
from chebclear.study.band.band import Band
from chebclear.study.band.calibrated import calibrated_bands
from chebclear.study.band.requirement import Requirement, mean_share
from chebclear.study.polynomials.points import random_points
from chebclear.study.sources.run_table import RunTable

SAMPLES = 721
REFERENCE, FRESH = 4000, 1000
# That of Study.band. At 1e-2 forces and accelerations scatter more: 0.1 to 0.5 % of their samples are outside
# of bands that were made at 1e-4.
RTOL = 1e-4
# Studies of more runs than this are made half as often: they differ less.
MANY = 81
WRIST = ["slider.x", "slider.vx", "slider.ax", "wrist.penetration", "wrist.normal_force"]
LENGTHS = {"crank_length": Interval.around(0.05, rel=0.1), "rod_length": Interval.around(0.12, rel=0.1)}
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
    law = cc.laws.LankaraniNikravesh(stiffness=1e9, restitution=0.7)
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
WIDE = {"clearance": Interval.around(5e-4, rel=0.1)}
# What is built, the intervals, fixed values, outputs, times.
PROBLEMS: dict[str, tuple[Any, dict[str, cc.Interval], dict[str, Any], list[str], dict[str, float]]] = {
    "P1": (mechanisms.slider_crank, LENGTHS, {}, WRIST, SECOND_TURN),
    "P2": (mechanisms.slider_crank, LENGTHS, {"clearance": 2e-4}, WRIST, SECOND_TURN),
    "P3a": (mechanisms.slider_crank, WIDE, {}, WRIST, SECOND_TURN),
    "P3b": (mechanisms.slider_crank, LENGTHS | WIDE, {}, WRIST, SECOND_TURN),
    "P4": (
        mechanisms.four_bar,
        {
            "coupler_length": Interval.around(0.10, rel=0.02),
            "rocker_length": Interval.around(0.08, rel=0.02),
            "clearance": Interval.around(1e-4, rel=0.1),
        },
        {},
        of("rocker", True, "rocker_pin"),
        SECOND_TURN,
    ),
    "P5": (
        rubbing_slider_crank,
        {name: Interval.around(value, rel=0.05) for name, value in EIGHT.items()},
        {},
        WRIST,
        SECOND_TURN,
    ),
    "P6": (mechanisms.slider_crank, LENGTHS, {"clearance_at": ()}, WRIST[:3], SECOND_TURN),
    "quick return": (
        mechanisms.quick_return,
        {
            "crank_length": Interval.around(0.05, rel=0.02),
            "lever_length": Interval.around(0.2, rel=0.02),
            "clearance": Interval.around(1e-4, rel=0.2),
        },
        {},
        of("ram", False, "crank_pin"),
        {"skip": 0.05, "duration": 0.1},
    ),
    "six-bar": (
        mechanisms.six_bar,
        {
            "link_length": Interval.around(0.14, rel=0.01),
            "output_length": Interval.around(0.10, rel=0.01),
            "coupler_length": Interval.around(0.10, rel=0.01),
        },
        {"clearance": 5e-5, "crank_speed": cc.rpm(600.0)},
        of("output", True, "output_pin"),
        {"skip": 0.05, "duration": 0.05},
    ),
    "chain": (
        chain,
        {
            "length": Interval.around(0.1, rel=0.05),
            "mass": Interval.around(0.2, rel=0.1),
            "clearance": Interval.around(1e-4, rel=0.2),
        },
        {},
        of("link2", True, "joint1"),
        {"skip": 0.0, "duration": 0.3},
    ),
    "pendulum": (
        mechanisms.pendulum_in_bearing,
        {
            "length": Interval.around(0.2, rel=0.05),
            "clearance": Interval.around(1e-4, rel=0.2),
            "restitution": Interval.around(0.7, rel=0.1),
        },
        {},
        of("pendulum", True, "pivot"),
        {"skip": 0.0, "duration": 0.3},
    ),
    "two pins": (
        mechanisms.slider_crank,
        {
            "crank_length": Interval.around(0.05, rel=0.05),
            "rod_length": Interval.around(0.12, rel=0.05),
            "clearance": Interval.around(1e-4, rel=0.2),
        },
        {"clearance_at": ("crank_pin", "wrist")},
        of("slider", False, "crank_pin"),
        SECOND_TURN,
    ),
    "second four-bar": (
        mechanisms.four_bar,
        {
            "coupler_length": Interval.around(0.25, rel=0.03),
            "rocker_mass": Interval.around(0.3, rel=0.1),
            "clearance": Interval.around(5e-5, rel=0.3),
        },
        {
            "ground_length": 0.3,
            "crank_length": 0.08,
            "rocker_length": 0.2,
            "crank_speed": cc.rpm(600.0),
            "clearance_at": ("crank_pin",),
        },
        of("rocker", True, "crank_pin"),
        {"skip": 0.1, "duration": 0.1},
    ),
}


def only(name: str, *parameters: str) -> tuple[Any, ...]:
    """A problem with some of its parameters, the others being in the middle of their intervals."""
    build, intervals, fixed, *rest = PROBLEMS[name]
    others = {other: intervals[other].midpoint for other in intervals if other not in parameters}
    return (build, {kept: intervals[kept] for kept in parameters}, fixed | others, *rest)


PARTS = {
    "P1 crank": only("P1", "crank_length"),
    "P2 rod": only("P2", "rod_length"),
    "P4 coupler": only("P4", "coupler_length"),
    "quick return clearance": only("quick return", "clearance"),
    "six-bar link": only("six-bar", "link_length"),
    "two pins clearance": only("two pins", "clearance"),
    "chain length": only("chain", "length"),
    "P3 crank clearance": only("P3b", "crank_length", "clearance"),
    "P4 coupler rocker": only("P4", "coupler_length", "rocker_length"),
    "quick return crank clearance": only("quick return", "crank_length", "clearance"),
    "six-bar link coupler": only("six-bar", "link_length", "coupler_length"),
    "chain length clearance": only("chain", "length", "clearance"),
    "pendulum length restitution": only("pendulum", "length", "restitution"),
    "two pins crank clearance": only("two pins", "crank_length", "clearance"),
    "second four-bar coupler clearance": only("second four-bar", "coupler_length", "clearance"),
}
PROBLEMS |= PARTS


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
    for start in range(0, hull_runs, 1000):
        points = random_points(study.intervals, 0, min(1000, hull_runs - start), seed=10_000 + start)
        values = study.runner.made(points, study.runner.settings, midpoint=False).values
        low, high = values.min(axis=0), values.max(axis=0)
        lower = low if lower is None else np.minimum(lower, low)
        upper = high if upper is None else np.maximum(upper, high)
    points = random_points(study.intervals, 0, fresh_runs, seed=9_999)
    fresh = study.runner.made(points, study.runner.settings, midpoint=False).values
    np.savez(path, lower=lower, upper=upper, fresh=fresh)
    return {"lower": lower, "upper": upper, "fresh": fresh}


@dataclass(frozen=True)
class Design:
    """The runs of a study at so many Sobol' points that smaller budgets are its first ones."""

    t: np.ndarray
    outputs: list[str]
    points: np.ndarray
    values: np.ndarray
    """Values, (runs + 1, samples, outputs), the nominal run last."""
    limits: np.ndarray
    """Physical limits of the outputs, (outputs, 2)."""
    seconds: float
    """Time of all runs on the processor [s]."""

    @classmethod
    def of(cls, name: str, folder: Path, runs: int, seed: int) -> Design:
        """The runs of a seed, from the folder if they are there."""
        path = folder / f"{name.replace(' ', '-')}-runs-{seed}.npz"
        outputs = PROBLEMS[name][3]
        if path.exists():
            kept = dict(np.load(path))
            if len(kept["points"]) >= runs:
                return cls(outputs=outputs, **kept)
        start = time.process_time()
        result = study_of(name).band(runs, rng=seed)
        seconds = time.process_time() - start
        assert result.requirement is not None
        columns = [np.vstack([band.runs, band.nominal]) for band in result.bands.values()]
        values = np.stack(columns, axis=-1)
        limits = np.array([result.requirement.limits[output] for output in outputs])
        # What the study took for its bands is no time of the runs.
        start = time.process_time()
        made = cls(result.t, outputs, result.parameters, values, limits, 0.0)
        made.bands(name, runs, 0.999)
        made = replace(made, seconds=seconds - (time.process_time() - start))
        kept = {key: value for key, value in vars(made).items() if key != "outputs"}
        np.savez(path, **kept)
        return made

    def bands(self, name: str, runs: int, coverage: float) -> dict[str, Band]:
        """What a study of so many runs says."""
        values = np.ascontiguousarray(np.concatenate([self.values[:runs], self.values[-1:]]))
        limits = {output: tuple(ends) for output, ends in zip(self.outputs, self.limits, strict=True)}
        requirement = Requirement(coverage, runs, 0, limits)
        table = RunTable(self.points[:runs], np.arange(runs), self.t, tuple(self.outputs), values)
        return calibrated_bands(table, PROBLEMS[name][1], requirement)


def of_designs(designs: list[Design]) -> dict[str, Any]:
    """The hull of the runs of all studies, and for each study those of the others as fresh ones."""
    runs = [design.values[:-1] for design in designs]
    fresh = [np.concatenate(runs[:own] + runs[own + 1 :]) for own in range(len(runs))]
    low, high = (np.array([extreme(each, axis=0) for each in runs]) for extreme in (np.min, np.max))
    return {"lower": low.min(axis=0), "upper": high.max(axis=0), "fresh": fresh}


def judged(studies: list[Any], known: dict[str, Any], heading: list[Any]) -> list[list[Any]]:
    """A line for every output of studies that differ by their seed; what stands in it, for a table."""
    rows = []
    fresh = known["fresh"]
    of_studies = fresh if isinstance(fresh, list) else [fresh] * len(studies)
    for index, output in enumerate(studies[0]):
        width = float(np.mean(known["upper"][:, index] - known["lower"][:, index]))
        bands = [study[output] for study in studies]
        inside = [
            (runs[:, :, index] >= band.lower) & (runs[:, :, index] <= band.upper)
            for band, runs in zip(bands, of_studies, strict=False)
        ]
        shares = [100.0 * each.mean() for each in inside]
        widths = [band.width.mean() / width for band in bands]
        whole = 100.0 * np.mean([each.all(axis=1).mean() for each in inside])
        promised = 100.0 * np.mean([band.whole_run for band in bands])
        held_out = 100.0 * np.mean([band.coverage for band in bands])
        kept = 100.0 * np.mean([share >= 100.0 * heading[2] for share in shares])
        verdicts = ", ".join(f"{n} {word}" for word, n in Counter(band.verdict for band in bands).items())
        print(
            f"  {output:<30} {np.mean(shares):7.3f} ±{np.std(shares):5.3f} %  width {np.mean(widths):5.3f} "
            f"±{np.std(widths):5.3f}  held out {held_out:7.3f} %  whole {whole:5.1f} % of {promised:4.1f} % "
            f"promised  kept by {kept:3.0f} %  {verdicts}",
            flush=True,
        )
        numbers = [
            np.mean(shares),
            np.std(shares),
            np.mean(widths),
            np.std(widths),
            held_out,
            whole,
            promised,
            kept,
        ]
        rows.append([*heading, output, *(f"{number:.4f}" for number in numbers), verdicts])
    return rows


HEADER = [
    "problem", "runs", "coverage", "studies", "time_of_bands_percent", "output", "inside_percent",
    "inside_deviation", "width", "width_deviation", "held_out_percent", "whole_percent",
    "whole_promised_percent", "kept_percent", "verdicts",
]  # fmt: skip


def summary(rows: list[list[Any]], coverages: list[float]) -> None:
    """Prints, for outputs that no polynomial resolves, what all problems have in common."""
    for coverage in coverages:
        for runs in sorted({row[1] for row in rows}):
            found = [
                row for row in rows if row[1] == runs and row[2] == coverage and "resolved" not in row[-1]
            ]
            if not found:
                continue
            inside, width, keep = (np.mean([float(row[k]) for row in found]) for k in (6, 8, 13))
            print(
                f"{100.0 * coverage:g} % by {runs} runs: {inside:.3f} % inside, width {width:.3f}, kept by "
                f"{keep:.0f} % of the studies ({len(found)} outputs)"
            )


def budgets_of(name: str, asked: argparse.Namespace) -> list[list[Any]]:
    """What studies of every budget deliver."""
    rows = []
    few = max([budget for budget in asked.budgets if budget <= MANY], default=0)
    often = (asked.seeds + 1) // 2
    designs = [
        Design.of(name, asked.folder, max(asked.budgets) if index < often else few, asked.first_seed + index)
        for index in range(asked.seeds if few else often)
    ]
    known = reference(name, asked.folder, asked.hull, asked.fresh) if asked.hull else of_designs(designs)
    for budget, coverage in itertools.product(sorted(asked.budgets), asked.coverages):
        able = [design for design in designs if len(design.points) >= budget]
        start = time.process_time()
        studies = [design.bands(name, budget, coverage) for design in able]
        of_bands = time.process_time() - start
        of_runs = sum(design.seconds * budget / len(design.points) for design in able)
        percent = 100.0 * of_bands / of_runs
        print(
            f"{name}, {budget} runs for {100.0 * coverage:g} %, {len(able)} studies, bands take "
            f"{percent:.1f} % of the time of the runs"
        )
        rows += judged(studies, known, [name, budget, coverage, len(able), f"{percent:.1f}"])
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="where hulls and runs are kept")
    usual = [name for name in PROBLEMS if name not in PARTS]
    parser.add_argument("--problems", nargs="+", default=usual, choices=list(PROBLEMS))
    parser.add_argument("--budgets", nargs="+", type=int, default=[9, 41, 81, 321])
    parser.add_argument("--coverages", nargs="+", type=float, default=[0.999], help="what is asked for [-]")
    parser.add_argument("--seeds", type=int, default=24, help="number of studies, each with its seed")
    parser.add_argument("--first-seed", type=int, default=0, help="others are tried with 100")
    parser.add_argument(
        "--hull",
        type=int,
        default=REFERENCE,
        help="runs of the reference hull; with 0 studies are judged on each other's runs",
    )
    parser.add_argument("--fresh", type=int, default=FRESH, help="fresh runs to judge on")
    parser.add_argument("--independent", action="store_true", help="hulls of 1999 independent runs instead")
    parser.add_argument("--csv", type=Path, help="a table of all that is printed")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore", cc.ChebclearWarning)
    rows = []
    for name in asked.problems:
        if asked.independent:
            study, known = study_of(name), reference(name, asked.folder, asked.hull, asked.fresh)
            results = [study.band(1999, rng=asked.first_seed + index) for index in range(asked.seeds)]
            runs = len(results[0].parameters)
            print(f"{name}, hulls of {runs} independent runs: {100.0 * mean_share(runs)} % on average")
            rows += judged([result.bands for result in results], known, [name, runs, 0.999, asked.seeds, ""])
        else:
            rows += budgets_of(name, asked)
    summary(rows, asked.coverages)
    if asked.csv:
        with asked.csv.open("w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([HEADER, *rows])


if __name__ == "__main__":
    main()
