"""Precision against the number of parameters, which the paper leaves to future work: one to eight of them.

Lengths as in the paper, then clearance, stiffness and damping of the contact, masses and friction.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.progress import Progress, reporter
from ..base.tables import markdown_table
from ..base.writing import complete_folder
from ..errors import ChebclearWarning
from ..mechanisms.sliders import slider_crank
from ..scene.laws import ModifiedCoulomb
from ..scene.scene import ClearanceRevolute, Interval, Scene, interval
from ..study.band.band import Band
from ..study.polynomials.points import random_points
from ..study.results import StudyResult
from ..study.study import Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

OUTPUTS = ("slider.x", "slider.vx", "slider.ax", "wrist.normal_force")
BUDGETS = (21, 41, 81, 161)
"""Runs of calibrated bands."""
DEGREES, POINTS = (2, 3), (3, 5, 10)
"""Degrees of the paper's method and points of scans, as far as their grids go."""
MOST_RUNS = 256
"""Runs of the largest grid: 4 nodes of 4 parameters."""
FRESH = 200
"""Random runs that judge."""


def _friction_coefficient() -> float:
    joint = slider_crank().joints[-1]
    assert isinstance(joint, ClearanceRevolute) and isinstance(joint.friction, ModifiedCoulomb)
    return float(joint.friction.sliding_coefficient)


def parameters() -> dict[str, Interval]:
    """The eight parameters in the order in which they join: lengths ±10 % as in the paper, others ±5 %."""
    nominal = {
        "clearance": 2e-5,
        "young_modulus": 207e9,  # stiffness of the contact
        "restitution": 0.9,  # its damping
        "rod_mass": 0.21,
        "slider_mass": 0.14,
        "friction_coefficient": _friction_coefficient(),
    }
    lengths = {"crank_length": interval(0.05, rel=0.1), "rod_length": interval(0.12, rel=0.1)}
    return lengths | {name: interval(value, rel=0.05) for name, value in nominal.items()}


def rubbing_slider_crank(friction_coefficient: float | None = None, **options: Any) -> Scene:
    """The paper's slider-crank, corrected, with another coefficient of sliding friction."""
    scene = slider_crank(convention="corrected", **options)
    if friction_coefficient is None:
        return scene
    joints = []
    for joint in scene.joints:
        if isinstance(joint, ClearanceRevolute) and isinstance(joint.friction, ModifiedCoulomb):
            ratio = friction_coefficient / joint.friction.sliding_coefficient
            static = ratio * joint.friction.static_coefficient
            friction = replace(
                joint.friction, sliding_coefficient=friction_coefficient, static_coefficient=static
            )
            joint = replace(joint, friction=friction)
        joints.append(joint)
    return replace(scene, joints=joints)


@dataclass(frozen=True)
class Precision:
    """What one way of bounding delivers for so many parameters; an entry for each of `OUTPUTS`."""

    parameters: int
    """Uncertain parameters [-]."""
    way: str
    """``"band"``, ``"Eq. (31), degree N"`` or ``"scan, N points"``."""
    runs: int
    """Runs, the nominal one included [-]."""
    error: tuple[float, ...]
    """Largest error of the polynomial at fresh runs over the width of the hull, both averaged over time [-];
    NaN without a polynomial."""
    coverage: tuple[float, ...]
    """Share of the samples of fresh runs inside [-]."""
    width: tuple[float, ...]
    """Mean width over that of the hull of all runs [-]."""
    verdicts: tuple[str, ...]
    """Verdict of each band."""


def many_parameters(
    most: int = 8,
    threads: int | None = None,
    *,
    budgets: Sequence[int] = BUDGETS,
    fresh: int = FRESH,
    progress: bool | Progress | None = None,
) -> list[Precision]:
    """Measure precision against runs for 1 to `most` parameters; some 3000 runs for all eight.

    Parameters
    ----------
    most : int
        Largest number of parameters [-].
    threads : int, optional
        Threads to simulate on [-].
    budgets : sequence of int
        Runs of calibrated bands [-], rising.
    fresh : int
        Random runs that judge [-].
    progress : True or callable, optional
        As of `Study`; it counts numbers of parameters.

    Returns
    -------
    list of Precision
    """
    box, rows = parameters(), []
    with warnings.catch_warnings(), reporter(progress, "many parameters", "numbers of parameters") as report:
        warnings.simplefilter("ignore", ChebclearWarning)
        for count in range(1, most + 1):
            sides = dict(list(box.items())[:count])
            study = Study(
                rubbing_slider_crank,
                sides,
                OUTPUTS,
                duration=0.03,
                skip=0.03,
                samples=361,
                rtol=1e-5,
                threads=threads,
            )
            points = random_points(sides, fresh, 7)
            seen = study.made(points, study.settings, midpoint=False).values
            made = list(_results(study, count, budgets))
            rows += [_precision(count, way, result, made, points, seen) for way, result in made]
            if report is not None:
                report(count, most)
    return rows


def _results(study: Study, count: int, budgets: Sequence[int]) -> Iterator[tuple[str, StudyResult]]:
    result: StudyResult | None = None
    for runs in budgets:
        more = 0 if result is None else runs - len(result.parameters)
        result = study.band(runs, rtol=1e-5) if result is None else result.extend(more)
        yield "band", result
    for degree in DEGREES:
        if (degree + 1) ** count <= MOST_RUNS:
            yield f"Eq. (31), degree {degree}", study.chebyshev(degree, bounds="eq31")
    for points in POINTS:
        if points**count <= MOST_RUNS:
            yield f"scan, {points} points", study.scan(points)


def _precision(
    count: int,
    way: str,
    result: StudyResult,
    made: list[tuple[str, StudyResult]],
    points: Array,
    fresh: Array,
) -> Precision:
    found = []
    for index, name in enumerate(OUTPUTS):
        band, seen = result[name], fresh[:, :, index]
        lowest = np.min([seen.min(axis=0), *(other[name].hull[0] for _, other in made)], axis=0)
        highest = np.max([seen.max(axis=0), *(other[name].hull[1] for _, other in made)], axis=0)
        width = float(np.mean(highest - lowest))
        inside = (seen >= band.lower - 1e-9 * width) & (seen <= band.upper + 1e-9 * width)
        error = _error(band, points, seen) / width
        found.append((error, float(inside.mean()), float(band.width.mean()) / width, band.verdict))
    errors, coverages, widths, verdicts = zip(*found, strict=True)
    return Precision(count, way, len(result.parameters) + 1, errors, coverages, widths, verdicts)


def _error(band: Band, points: Array, seen: Array) -> float:
    if band.surrogate is None:
        return float("nan")
    fitted = band.evaluate(**dict(zip(band.intervals, points.T, strict=True)))
    return float(np.mean(np.max(np.abs(fitted - seen), axis=0)))


def write(rows: list[Precision], directory: Path, *, figures: bool = True) -> None:
    """Write ``many_parameters.md`` and, with figures, ``many_parameters.png``, both or none."""
    with complete_folder(directory) as folder:
        (folder / "many_parameters.md").write_text(section(rows), encoding="utf-8")
        if figures:
            figure(rows).savefig(folder / "many_parameters.png", dpi=150)


def section(rows: list[Precision]) -> str:
    """The table in Markdown: error, coverage and width of every output."""
    head = ["parameters", "way", "runs", *OUTPUTS]
    table = [
        [
            str(row.parameters),
            row.way,
            str(row.runs),
            *(
                f"{'-' if error != error else f'{100.0 * error:.1f}'} / {100.0 * inside:.2f} / {width:.2f}"
                f"{' R' if verdict == 'resolved' else ''}"
                for error, inside, width, verdict in zip(
                    row.error, row.coverage, row.width, row.verdicts, strict=True
                )
            ),
        ]
        for row in rows
    ]
    return (
        "## Many parameters\n\nThe paper's future work: precision against the number of parameters, contact "
        "stiffness and damping among them. Lengths ±10 %, all others ±5 %, corrected convention, second "
        f"revolution. Of each output: error of the polynomial [% of the width] / share of {FRESH} fresh runs "
        "inside [%] / width over the hull of all runs; R: resolved. Grids end at "
        f"{MOST_RUNS} runs.\n\n{markdown_table(head, table)}\n"
    )


def figure(rows: list[Precision]) -> Figure:
    """Share outside and width against runs, a column an output, a color a number of parameters."""
    from matplotlib import colormaps
    from matplotlib.figure import Figure

    made = Figure(figsize=(12, 6), layout="constrained")
    axes = made.subplots(2, len(OUTPUTS), sharex=True, sharey="row", squeeze=False)
    most = max(row.parameters for row in rows)
    markers = {"band": "o-", "Eq. (31)": "s", "scan": "^"}
    for index, name in enumerate(OUTPUTS):
        above, below = axes[:, index]
        for count in range(1, most + 1):
            color = colormaps["viridis"]((count - 1) / max(1, most - 1))
            for way, marker in markers.items():
                own = [row for row in rows if row.parameters == count and row.way.startswith(way)]
                if not own:
                    continue
                counted = "1 parameter" if count == 1 else f"{count} parameters"
                label = f"{way}, {counted}" if index == 0 and count in (1, most) else None
                style: dict[str, Any] = {"color": color, "markersize": 4, "linewidth": 1.0}
                runs = [row.runs for row in own]
                above.plot(runs, [max(1.0 - row.coverage[index], 1e-5) for row in own], marker, **style)
                below.plot(runs, [row.width[index] for row in own], marker, label=label, **style)
        above.set(title=name, xscale="log", yscale="log")
        above.axhline(1e-3, color="0.7", linewidth=0.8)
        below.set_yscale("log")
        below.axhline(1.0, color="0.7", linewidth=0.8)
        below.set_xlabel("runs [-]")
    axes[0, 0].set_ylabel("share of fresh samples outside [-]")
    axes[1, 0].set_ylabel("width over the hull [-]")
    made.legend(loc="outside lower center", ncols=6, fontsize="small")
    return made
