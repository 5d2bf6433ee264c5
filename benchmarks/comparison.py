"""Ways of bounding an output over a box: ours, the paper's, scans, Monte Carlo, chaospy, OpenTURNS.

    pip install chaospy openturns
    python benchmarks/comparison.py FOLDER [--problems P1 P2 P4 P5 P6] [--page docs/comparison]

Every way is judged on the same fresh runs at random points of the box: by the share of their samples
inside, and by the mean width over that of the hull of 4,000 runs. Hull and fresh runs are those of
`bands.py`, kept in FOLDER. The two packages get an advantage that a user has not: of all degrees the one
whose bounds hold most is shown. The time is that of the processor, of all cores together. `--page` writes
table and picture of the documentation.
"""

from __future__ import annotations

import argparse
import math
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import chebclear as cc
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from bands import PROBLEMS, reference, study_of
from chebclear.study.polynomials.points import random_points

# Above this many runs a way is listed, not tried.
MOST_RUNS = 10_000
# Points at which the packages' polynomials are evaluated to find their ranges.
RANGE_POINTS = 4_000
# OpenTURNS selects the terms of one sample in some 30 ms, so it gets every eighth sample.
STRIDE = 8
DEGREES = range(1, 9)


@dataclass
class Row:
    """One way on one problem; `runs` alone where it would take too many."""

    way: str
    runs: int
    seconds: float = math.nan
    inside: tuple[float, ...] = ()
    width: tuple[float, ...] = ()


def judged(
    way: str, runs: int, seconds: float, bounds: np.ndarray, known: dict[str, np.ndarray], stride: int = 1
) -> Row:
    """Bounds of shape (2, samples, outputs) against the fresh runs."""
    fresh = known["fresh"][:, ::stride]
    inside = ((fresh >= bounds[0]) & (fresh <= bounds[1])).mean(axis=(0, 1))
    widths = (known["upper"] - known["lower"])[::stride].mean(axis=0)
    return Row(
        way, runs, seconds, tuple(100.0 * inside), tuple((bounds[1] - bounds[0]).mean(axis=0) / widths)
    )


def of_study(way: str, make: Callable[[], cc.results.StudyResult], known: dict[str, np.ndarray]) -> Row:
    start = time.process_time()
    result = make()
    bounds = np.stack(
        [
            np.stack([getattr(band, end) for band in result.bands.values()], axis=-1)
            for end in ("lower", "upper")
        ]
    )
    return judged(way, len(result.parameters), time.process_time() - start, bounds, known)


def ours_and_the_papers(study: cc.Study, known: dict[str, np.ndarray]) -> Iterator[Row]:
    for runs in (41, 81, 321):
        yield of_study(f"band, {runs} runs", lambda runs=runs: study.band(runs), known)
    yield of_study("hull, 1999 runs", lambda: study.band(1999), known)
    size = len(study.intervals)
    for degree in (3, 5, 8):
        runs = (degree + 1) ** size
        for bounds, words in (("range", "range"), ("eq31", "Eq. (31)")):
            way = f"Chebyshev degree {degree}, {words}"
            if runs > MOST_RUNS:
                yield Row(way, runs)
            else:
                yield of_study(way, lambda d=degree, b=bounds: study.chebyshev(d, bounds=b), known)
    for points in (10, 20):
        if points**size > MOST_RUNS:
            yield Row(f"scan, {points} points", points**size)
        else:
            yield of_study(f"scan, {points} points", lambda n=points: study.scan(n), known)
    for runs in (41, 81, 321, 1000):
        yield of_study(f"Monte Carlo hull, {runs} runs", lambda n=runs: study.sample(n, rng=1), known)


def designed(study: cc.Study, runs: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Points in [-1, 1], values (runs, samples, outputs) and the time of a random design."""
    start = time.process_time()
    points = random_points(study.intervals, 0, runs, seed=1)
    values = np.asarray(study.runner.made(points, study.runner.settings, midpoint=False).values)
    ends = np.array([[each.lower, each.upper] for each in study.intervals.values()])
    scaled = (2.0 * np.asarray(points) - ends.sum(axis=1)) / (ends[:, 1] - ends[:, 0])
    return scaled, values, time.process_time() - start


def with_chaospy(study: cc.Study, runs: int, known: dict[str, np.ndarray]) -> Row:
    """Least squares of total degree at every sample; extremes at random points and corners."""
    import chaospy

    scaled, values, simulated = designed(study, runs)
    size = scaled.shape[1]
    box = chaospy.J(*[chaospy.Uniform(-1.0, 1.0) for _ in range(size)])
    corners = np.stack(np.meshgrid(*[[-1.0, 1.0]] * size), axis=-1).reshape(-1, size).T
    at = np.hstack([np.asarray(box.sample(RANGE_POINTS, rng=1)).reshape(size, -1), corners])
    flat = values.reshape(runs, -1)
    best: Row | None = None
    for degree in DEGREES:
        if math.comb(size + degree, degree) > runs // 2:
            break
        start = time.process_time()
        expansion = chaospy.generate_expansion(degree, box)
        _, coefficients = chaospy.fit_regression(expansion, scaled.T, flat, retall=1)
        predicted = np.asarray(expansion(*at)).T @ np.asarray(coefficients)
        bounds = np.stack([predicted.min(axis=0), predicted.max(axis=0)]).reshape(2, *values.shape[1:])
        row = judged(f"chaospy, {runs} runs", runs, simulated + time.process_time() - start, bounds, known)
        if best is None or np.mean(row.inside) > np.mean(best.inside):
            best = row
    assert best is not None
    return best


def with_openturns(study: cc.Study, runs: int, known: dict[str, np.ndarray]) -> Row:
    """Sparse expansion of every eighth sample: terms by least angles, corrected leave-one-out."""
    import openturns as ot

    scaled, values, simulated = designed(study, runs)
    size = scaled.shape[1]
    start = time.process_time()
    box = ot.JointDistribution([ot.Uniform(-1.0, 1.0)] * size)
    basis = ot.OrthogonalProductPolynomialFactory(
        [ot.LegendreFactory()] * size, ot.LinearEnumerateFunction(size)
    )
    degree = max(d for d in DEGREES if math.comb(size + d, d) <= 2 * runs)
    adaptive = ot.FixedStrategy(basis, math.comb(size + degree, degree))
    selection = ot.LeastSquaresStrategy(
        ot.LeastSquaresMetaModelSelectionFactory(ot.LARS(), ot.CorrectedLeaveOneOut())
    )
    ot.RandomGenerator.SetSeed(1)
    at = box.getSample(RANGE_POINTS)
    thinned = values[:, ::STRIDE].reshape(runs, -1)
    bounds = np.empty((2, thinned.shape[1]))
    for index, column in enumerate(thinned.T):
        algorithm = ot.FunctionalChaosAlgorithm(
            ot.Sample(scaled), ot.Sample(column[:, None]), box, adaptive, selection
        )
        algorithm.run()
        predicted = np.asarray(algorithm.getResult().getMetaModel()(at))
        bounds[:, index] = predicted.min(), predicted.max()
    seconds = simulated + STRIDE * (time.process_time() - start)
    shape = (2, -1, values.shape[2])
    return judged(f"OpenTURNS, {runs} runs", runs, seconds, bounds.reshape(shape), known, STRIDE)


def compared(name: str, folder: Path, packages: bool) -> list[Row]:
    """All ways on one problem."""
    known, study = reference(name, folder, 4000, 1500), study_of(name)
    rows = list(ours_and_the_papers(study, known))
    if packages:
        for way in (with_chaospy, with_openturns):
            rows += [way(study, runs, known) for runs in (81, 321)]
    return rows


def cell(row: Row, output: int) -> str:
    return f"{row.inside[output]:.2f} / {row.width[output]:.2f}" if row.inside else "-"


def table(outputs: list[str], rows: list[Row]) -> str:
    """All outputs of one problem: inside [%] / width over that of the hull [-]."""
    lines = [f"| way | runs | time [s] | {' | '.join(outputs)} |", f"|---|---:|---:|{'---:|' * len(outputs)}"]
    for row in rows:
        cells = " | ".join(cell(row, index) for index in range(len(outputs)))
        lines.append(f"| {row.way} | {row.runs} | {f'{row.seconds:.2f}' if row.inside else '-'} | {cells} |")
    return "\n".join(lines)


def accelerations(found: dict[str, list[Row]]) -> str:
    """One output of all problems: runs, time [s], inside [%] / width over that of the hull [-]."""
    lines = [f"| way | {' | '.join(found)} |", f"|---|{'---:|' * len(found)}"]
    for rows in zip(*found.values(), strict=True):
        cells = [
            f"{row.runs}, {row.seconds:.1f} s: **{cell(row, 2)}**" if row.inside else f"{row.runs}: not tried"
            for row in rows
        ]
        lines.append(f"| {rows[0].way} | {' | '.join(cells)} |")
    return "\n".join(lines)


# Kind of a way by the first word of its name: label, marker.
KINDS = {
    "band": ("band (ours)", "o"),
    "hull,": ("hull of independent runs (ours)", "*"),
    "Chebyshev": ("Chebyshev polynomials", "s"),
    "scan": ("scan", "^"),
    "Monte": ("Monte Carlo hull", "v"),
    "chaospy": ("chaospy", "D"),
    "OpenTURNS": ("OpenTURNS", "P"),
}


def draw(found: dict[str, list[Row]], path: Path) -> None:
    """Share outside against width of the acceleration; size grows with the runs."""
    names = [name for name in found if len(found[name][0].inside) > 2]
    figure, axes = plt.subplots(
        1, len(names), figsize=(3.1 * len(names), 3.4), sharey=True, layout="constrained"
    )
    for ax, name in zip(np.atleast_1d(axes), names, strict=True):
        for index, (kind, (label, marker)) in enumerate(KINDS.items()):
            rows = [row for row in found[name] if row.way.split()[0].rstrip(",") == kind and row.inside]
            outside = [max(100.0 - row.inside[2], 1e-3) for row in rows]
            sizes = [12.0 * math.log10(row.runs) ** 1.5 for row in rows]
            ax.scatter(
                [row.width[2] for row in rows],
                outside,
                sizes,
                marker=marker,
                color=f"C{index}",
                label=label,
                alpha=0.8,
            )
        ax.axhline(0.1, color="0.4", linewidth=0.8, linestyle="--")
        ax.axvline(1.0, color="0.4", linewidth=0.8, linestyle="--")
        ax.set(xscale="log", yscale="log", title=name, xlabel="width over that of 4,000 runs [-]")
        ax.xaxis.set_major_formatter("{x:g}")
        ax.xaxis.set_minor_formatter("")
        ax.set_xticks([0.5, 1.0, 2.0, 4.0])
    np.atleast_1d(axes)[0].set_ylabel("acceleration: samples outside [%]")
    figure.legend(
        *np.atleast_1d(axes)[0].get_legend_handles_labels(),
        loc="outside upper center",
        ncols=7,
        fontsize="small",
    )
    figure.savefig(path, dpi=120)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="where hulls and fresh runs are kept")
    parser.add_argument(
        "--problems", nargs="+", default=["P1", "P2", "P4", "P5", "P6"], choices=list(PROBLEMS)
    )
    parser.add_argument("--without-packages", action="store_true", help="neither chaospy nor OpenTURNS")
    parser.add_argument("--page", type=Path, help="tables as PAGE.txt, the picture as PAGE.png")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore")
    found = {}
    for name in asked.problems:
        found[name] = compared(name, asked.folder, not asked.without_packages)
        print(f"\n{name}\n\n{table(list(PROBLEMS[name][3]), found[name])}", flush=True)
    if asked.page:
        draw(found, asked.page.with_suffix(".png"))
        asked.page.with_suffix(".txt").write_text(accelerations(found) + "\n")


if __name__ == "__main__":
    main()
