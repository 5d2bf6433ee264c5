"""What `auto` costs beside the best of all methods, over scenes drawn at random; see README.md.

python benchmarks/methods.py [extremes | elements | friction | ready] [--scenes N] [--first I] [--csv FILE]
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import math
import warnings
from pathlib import Path

import chebclear as cc
import extremes
import numpy as np
from loads import contact

SEED = 2026
METHODS = ("auto", "adams", "rodas4", "rodas5p", "dop853")
# Work in evaluations, as `benches/stiffness.rs` counts it.
JACOBIAN, FACTORIZATION = 1.0, 0.5
MAX_STEPS = 10_000  # a run in which every method takes more is compared up to where the best of them gets
LOOKED_AT = 10.0  # attempts of `auto` per evaluation of the best method, after which it is given up
FEWEST_STEPS = 50  # of the best method: shorter runs are starts
# What is wanted: at most this many times the work of the best, in 99 % of the runs, in all, in the mean.
WANTED = {"99 %": 2.0, "largest": 4.0, "mean": 1.3}
KINDS = ("slider_crank", "four_bar", "six_bar", "quick_return", "pendulum", "wiper", "loose_guide", "dry")


@dataclasses.dataclass(frozen=True)
class Problem:
    """A scene, how long it runs [s] and at which tolerance."""

    name: str
    scene: cc.Scene
    duration: float
    rtol: float


def work(run: cc.Trajectory) -> float:
    """Evaluations of a run, with what Jacobians and factorizations cost [-]."""
    stats = run.stats
    return stats.evaluations + JACOBIAN * stats.jacobians + FACTORIZATION * stats.factorizations


def simulate(problem: Problem, method: str, max_steps: int, duration: float) -> cc.Trajectory:
    """Run a problem by a method, whatever becomes of it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        return cc.simulate(
            problem.scene,
            duration=duration,
            samples=2,
            rtol=problem.rtol,
            method=method,
            outputs=[f"{problem.scene.bodies[0].name}.x"],
            max_steps=max_steps,
            on_failure="return",
        )


def friction(random: np.random.Generator, speed: float) -> cc.laws.FrictionLaw:
    """A random law of friction of contacts, for surfaces of about this speed [m/s]."""
    coefficient = float(random.uniform(0.02, 0.8))
    velocity = speed * float(10.0 ** random.uniform(-5.0, -1.0))
    lower = coefficient * float(random.uniform(0.5, 1.0))
    laws = cc.laws
    return (
        laws.SmoothedCoulomb(coefficient, velocity),
        laws.ModifiedCoulomb(coefficient, lower, velocity, 1.5 * velocity),
        laws.StickSlip(coefficient, lower, velocity),
    )[random.integers(3)]


def rubbing(index: int, seed: int = SEED) -> Problem:
    """A mechanism with friction: each index has its own generator."""
    random = np.random.default_rng([seed, index, 6])
    kind = str(random.choice(KINDS))
    turn = float(10.0 ** random.uniform(0.0, 2.5))  # [rad/s]
    rtol = float(10.0 ** random.uniform(-8.0, -2.0))
    clearance = float(10.0 ** random.uniform(-5.0, -3.3))
    pins = {
        "clearance": clearance,
        "friction": friction(random, 0.01 * turn),
        "contact": contact(random) if random.random() < 0.5 else None,
        "restitution": float(random.uniform(0.3, 0.95)),
    }
    mechanisms = cc.mechanisms
    makers = {
        "slider_crank": (mechanisms.slider_crank, ("crank_pin", "wrist")),
        "four_bar": (mechanisms.four_bar, ("crank_pin", "rocker_pin", "rocker_bearing")),
        "six_bar": (mechanisms.six_bar, ("rocker_pin", "coupler_pin", "output_pin")),
        "quick_return": (mechanisms.quick_return, ("crank_pin", "lever_pin", "ram_pin")),
        "pendulum": (mechanisms.pendulum_in_bearing, ("pivot",)),
    }
    driven = {"crank_speed": turn, "crank_angle": float(random.uniform(0.0, 2.0 * math.pi)), "gravity": 9.81}
    duration = float(10.0 ** random.uniform(-1.0, 0.5)) * 2.0 * math.pi / turn
    name = f"friction {index}, {kind}"
    if kind == "pendulum":
        scene = mechanisms.pendulum_in_bearing(angle=float(random.uniform(-2.5, 2.5)), **pins)
        return Problem(name, scene, float(random.uniform(0.3, 3.0)), rtol)
    if kind == "wiper":
        # A blade on the rocker, pressed to a pane: a torque that turns around with the motion.
        loose = [pin for pin in ("crank_pin", "rocker_pin") if random.random() < 0.5]
        scene = mechanisms.four_bar(clearance_at=loose, **driven, **pins)
        torque = float(10.0 ** random.uniform(-1.0, 1.5))
        steep = turn * float(10.0 ** random.uniform(-4.0, -1.0))
        rubs = cc.motions.Expression("-T*tanh(rocker.angular_velocity/w)", {"T": torque, "w": steep})
        forces = [*scene.forces, cc.Torque("blade", "rocker", rubs)]
        return Problem(name, dataclasses.replace(scene, forces=forces), duration, rtol)
    if kind == "loose_guide":
        scene = mechanisms.slider_crank(
            clearance_at=("wrist",) if random.random() < 0.5 else (), **driven, **pins
        )
        law, length = contact(random), float(random.uniform(0.03, 0.1))
        joints = [
            cc.ClearancePrismatic(
                joint.name,
                joint.a,
                joint.b,
                joint.axis,
                length,
                0.02,
                clearance,
                law,
                friction(random, 0.01 * turn),
            )
            if isinstance(joint, cc.Prismatic)
            else joint
            for joint in scene.joints
        ]
        return Problem(name, dataclasses.replace(scene, joints=joints), duration, rtol)
    if kind == "dry":
        # All pins and guides without play are dry, beside loose ones.
        maker, places = makers[str(random.choice(("slider_crank", "four_bar")))]
        scene = maker(clearance_at=[places[-1]] if random.random() < 0.7 else [], **driven, **pins)
        coefficient = float(random.uniform(0.02, 0.3))
        laws = cc.laws
        joints = [
            dataclasses.replace(joint, friction=laws.JournalFriction(coefficient, 0.005))
            if isinstance(joint, cc.Revolute) and joint.name != "crank_bearing"
            else dataclasses.replace(joint, friction=laws.GuideFriction(coefficient, 0.02))
            if isinstance(joint, cc.Prismatic)
            else joint
            for joint in scene.joints
        ]
        return Problem(name, dataclasses.replace(scene, joints=joints), duration, rtol)
    maker, places = makers[kind]
    loose = [place for place in places if random.random() < 0.5] or [places[0]]
    return Problem(name, maker(clearance_at=loose, **driven, **pins), duration, rtol)


def ready(index: int) -> Problem:
    """A ready-made mechanism as it comes, at one of seven tolerances."""
    mechanisms = cc.mechanisms
    makers = (
        mechanisms.slider_crank,
        lambda: mechanisms.slider_crank(convention="as_printed"),
        lambda: mechanisms.slider_crank(clearance_at=("crank_pin", "wrist")),
        mechanisms.flores_slider_crank,
        mechanisms.four_bar,
        mechanisms.six_bar,
        mechanisms.quick_return,
        mechanisms.pendulum_in_bearing,
        mechanisms.free_journal,
    )
    number, exponent = index % len(makers), 2 + index // len(makers) % 7
    scene = makers[number]()
    duration = scene.period if scene.drives else 0.5 if number < len(makers) - 1 else 0.01
    return Problem(f"ready {number}, 1e-{exponent}", scene, duration, 10.0**-exponent)


def extreme(index: int, elements: bool) -> Problem:
    """A scene of `extremes.py` at a tolerance from 1e-2 to 1e-8."""
    case = extremes.draw(index, elements=elements)
    rtol = float(10.0 ** np.random.default_rng([SEED, index, 5]).uniform(-8.0, -2.0))
    return Problem(
        f"{'element' if elements else 'extreme'} {index}, {case.family}", case.scene(), case.duration, rtol
    )


DRAWS = {
    "extremes": lambda index: extreme(index, False),
    "elements": lambda index: extreme(index, True),
    "friction": rubbing,
    "ready": ready,
}


def measure(problem: Problem) -> dict[str, str | float] | None:
    """Work of all methods up to where one of them gets; nothing if that fails or is short."""
    duration = problem.duration
    try:
        runs = {method: simulate(problem, method, MAX_STEPS, duration) for method in METHODS[1:]}
        if not any(run.success for run in runs.values()):
            # Over the part that the best of them reaches.
            duration = max(run.end_time for run in runs.values() if run.status == "max_steps")
            runs = {method: simulate(problem, method, 2 * MAX_STEPS, duration) for method in METHODS[1:]}
    except (cc.errors.SceneError, ValueError):
        return None
    works = {method: work(run) if run.success else math.inf for method, run in runs.items()}
    best = min(works, key=lambda method: works[method])
    if not 0.0 < works[best] < math.inf:
        return None
    # An Adams step has two evaluations: attempts that are enough for much more work than wanted.
    run = simulate(problem, "auto", int(LOOKED_AT * works[best]), duration)
    if run.status not in ("done", "max_steps"):
        return None
    works["auto"] = work(run)
    least = min(works.values())
    steps = run.stats.steps if run.success and works["auto"] == least else runs[best].stats.steps
    row = {
        "name": problem.name,
        "rtol": problem.rtol,
        "duration": duration,
        "ratio": works["auto"] / least,
        "steps": steps,
        "done": int(run.success),
        "explicit": run.stats.explicit_steps / max(run.stats.steps, 1),
        "switches": run.stats.switches,
        "events": run.stats.events,
    }
    return row | works if steps > FEWEST_STEPS else None


def summary(rows: list[dict[str, str | float]]) -> str:
    """Ratios of the work of `auto` to the least, and the runs with the largest."""
    ratios = np.array([float(row["ratio"]) for row in rows])
    mean = float(np.exp(np.log(ratios).mean()))
    found = {"mean": mean, "99 %": float(np.quantile(ratios, 0.99)), "largest": float(ratios.max())}
    lines = [f"{len(rows)} runs; work of auto over that of the best method (wanted):"]
    lines += [f"  {name}: {found[name]:.3f} ({WANTED[name]})" for name in found]
    lines.append(f"  above 2: {np.mean(ratios > 2.0):.2%}")
    for row in sorted(rows, key=lambda row: -float(row["ratio"]))[:12]:
        works = ", ".join(f"{method} {float(row[method]):.0f}" for method in METHODS)
        lines.append(
            f"  {row['ratio']:.2f}  {row['name']}, rtol {row['rtol']:.1e}: {works}; "
            f"explicit {row['explicit']:.2f}, switches {row['switches']}"
        )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes_of", nargs="*", default=list(DRAWS), choices=list(DRAWS))
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--csv", type=Path, help="where to write the runs")
    options = parser.parse_args()
    rows = []
    for name in options.scenes_of:
        count = min(options.scenes, 63) if name == "ready" else options.scenes
        for index in range(options.first, options.first + count):
            row = measure(DRAWS[name](index))
            if row:
                rows.append(row)
    if options.csv:
        with options.csv.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, list(rows[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    print(summary(rows))


if __name__ == "__main__":
    main()
