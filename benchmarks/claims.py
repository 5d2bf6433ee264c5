"""What `error="estimate"` claims against the true errors of drawn scenes; see README.md.

python benchmarks/claims.py [--scenes N] [--first I] [--seed S]
"""

from __future__ import annotations

import argparse
import math
import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import chebclear as cc
import numpy as np
from extremes import Case, draw
from numpy.typing import NDArray

Array = NDArray[np.float64]

SEED = 2027
RTOLS = tuple(10.0**-power for power in range(3, 10))
REFERENCE_RTOL = 1e-11
# Two methods of different order: what they differ by is how well the truth is known.
REFERENCE_METHODS = ("rodas5p", "rodas4")
SAMPLES = 161
# A scene runs until so many contact changes, or for the steps of its trial run, whichever is first.
CHANGES = (2.0, 40.0)
TRIAL_STEPS = 1500
MAX_STEPS, REFERENCE_STEPS = 20_000, 100_000
# An output is judged where the truth is known to this part of its error or claim.
KNOWN = 0.25
# Claims that are exceeded by these factors are counted.
FACTORS = (2.0, 10.0)


@dataclass(frozen=True)
class Claims:
    """The judged outputs of one run."""

    columns: list[str]
    """Their names."""
    excess: Array
    """True errors before the horizon, in claims [-]."""
    undecided: int
    """Outputs that move but whose truth is not known well enough."""


def simulate(scene: cc.Scene, duration: float, rtol: float, method: str, **more: Any) -> cc.Trajectory:
    """A run, whatever becomes of it."""
    arguments: dict[str, Any] = {"max_steps": MAX_STEPS, "on_failure": "return"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        return cc.simulate(
            scene, duration=duration, samples=SAMPLES, rtol=rtol, method=method, **(arguments | more)
        )


def shortened(case: Case, seed: int) -> float:
    """Time that a scene is given [s]: until a drawn number of contact changes."""
    random = np.random.default_rng([seed, case.index, 3])
    changes = round(10.0 ** random.uniform(*np.log10(CHANGES)))
    trial = simulate(case.scene(), case.duration, 1e-6, "auto", max_events=changes, max_steps=TRIAL_STEPS)
    return min(1.01 * trial.end_time, case.duration) if trial.end_time > 0.0 else case.duration


def judged(run: cc.Trajectory, truth: Array, check: Array) -> Claims:
    """The true errors of a run in what was claimed of them, output by output."""
    estimate = run.error
    assert estimate is not None
    before = run.t[:, None] < estimate.horizon
    largest = [
        np.where(before, np.abs(difference), 0.0).max(axis=0)
        for difference in (run.samples - truth, truth - check)
    ]
    error, unknown = largest
    claim = np.array([estimate[column].claim for column in estimate.columns])
    moves = (estimate.ranges > 0.0) & (error > 0.0)
    known = unknown < KNOWN * np.maximum(claim, error)
    chosen = np.flatnonzero(moves & known)
    # No claim is smaller than the rounding of the output itself.
    rounding = 4.0 * np.finfo(float).eps * np.abs(truth).max(axis=0)
    excess = np.maximum(error - unknown, 0.0)[chosen] / np.maximum(claim, rounding)[chosen]
    return Claims([estimate.columns[index] for index in chosen], excess, int(np.sum(moves & ~known)))


def judge_scene(case: Case, seed: int) -> Iterator[tuple[float, Claims | str]]:
    """The tolerances of a scene, each with what came of it; a word where nothing can be said."""
    scene = case.scene()
    # A contact state is a yes or no.
    outputs = [name for name in scene.check().columns if not name.endswith(".contact")]
    duration = shortened(case, seed)
    truths = []
    for method in REFERENCE_METHODS:
        truth = simulate(scene, duration, REFERENCE_RTOL, method, outputs=outputs, max_steps=REFERENCE_STEPS)
        if not truth.success:
            yield math.nan, f"no truth: {truth.status}"
            return
        truths.append(truth.samples)
    for rtol in RTOLS:
        run = simulate(scene, duration, rtol, case.method, outputs=outputs, error="estimate")
        assert run.error is not None
        if not run.success:
            yield rtol, f"run: {run.status}"
        elif run.error.status != "done":
            yield rtol, f"companion: {run.error.status}"
        else:
            yield rtol, judged(run, *truths)


def survey(first: int, count: int, seed: int) -> None:
    """Judge a part of the scenes and print the shares."""
    found: dict[float, list[Claims]] = {rtol: [] for rtol in RTOLS}
    unjudged: dict[str, int] = {}
    worst: list[tuple[float, str]] = []
    for index in range(first, first + count):
        case = draw(index, seed)
        for rtol, outcome in judge_scene(case, seed):
            if isinstance(outcome, str):
                unjudged[outcome] = unjudged.get(outcome, 0) + 1
                continue
            found[rtol].append(outcome)
            if outcome.excess.size and outcome.excess.max() > FACTORS[0]:
                place = int(outcome.excess.argmax())
                where = f"scene {index} ({case.family}, {case.method}), rtol {rtol:.0e}"
                worst.append((float(outcome.excess[place]), f"{where}, {outcome.columns[place]}"))
    print("| rtol | runs | outputs | above 2 claims | above 10 | median error, in claims | undecided |")
    print("|---|---|---|---|---|---|---|")
    rows = {f"{rtol:.0e}": runs for rtol, runs in found.items()}
    rows["all"] = [claims for runs in found.values() for claims in runs]
    for name, runs in rows.items():
        excess = np.concatenate([claims.excess for claims in runs]) if runs else np.zeros(0)
        shares = [f"{100.0 * np.mean(excess > factor):.2f} %" if excess.size else "-" for factor in FACTORS]
        middle = f"{np.median(excess):.2f}" if excess.size else "-"
        undecided = sum(claims.undecided for claims in runs)
        print(f"| {name} | {len(runs)} | {excess.size} | {' | '.join(shares)} | {middle} | {undecided} |")
    print("\nnot judged:", "; ".join(f"{word} {number}" for word, number in unjudged.items()) or "none")
    for ratio, where in sorted(worst, reverse=True)[:10]:
        print(f"{ratio:.3g} claims: {where}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=SEED)
    options = parser.parse_args()
    begin = time.process_time()
    survey(options.first, options.scenes, options.seed)
    print(f"{options.scenes} scenes in {time.process_time() - begin:.0f} s of computing")


if __name__ == "__main__":
    main()
