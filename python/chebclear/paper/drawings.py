"""Figures 1 to 3 of the case study: clearance joint, method and mechanism, from its scene and results."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..plots.axes import COLORS
from ..plots.drawing.scene import plot_scene
from ..scene.scene import ClearanceRevolute
from .case_study import CRANK_SPEED, DEGREE, SCAN_POINTS, UNCERTAINTY, ConventionStudy

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

# The joint in radii of its journal: the clearance as it is drawn.
_GAP = 0.45
# Crank angle at which the mechanism is drawn [deg], and how much larger its clearance is.
_CRANK_ANGLE, _EXAGGERATE = 415.0, 100.0
_ECCENTRICITY, _FORCE = COLORS[4], COLORS[1]


def clearance_joint(study: ConventionStudy) -> Figure:
    """Figure 1: journal and bearing of the wrist when they overlap most in the nominal run."""
    from matplotlib.patches import Circle

    run = study.single["nominal"]
    joint = next(joint for joint in run.scene.joints if isinstance(joint, ClearanceRevolute))
    sample = int(np.nanargmax(run[f"{joint.name}.penetration"]))
    eccentricity = np.array([run[f"{joint.name}.eccentricity_{axis}"][sample] for axis in "xy"])
    # Both are magnified alike, so that the journal overlaps its bearing as it does in the run.
    center = _GAP * eccentricity / joint.clearance
    normal = center / np.hypot(*center)
    figure, ax = _picture(study, "revolute joint with clearance", (6.5, 6.2))
    ax.add_patch(Circle((0.0, 0.0), 1.0 + _GAP, facecolor="0.95", edgecolor=COLORS[0], linewidth=2.0))
    journal = {"facecolor": COLORS[2], "edgecolor": COLORS[2]}
    ax.add_patch(Circle((center[0], center[1]), 1.0, alpha=0.35, **journal))
    ax.plot(*np.array([(0.0, 0.0), (1.0 + _GAP) * normal]).T, color="0.4", linewidth=0.8, linestyle="--")
    _arrow(ax, np.zeros(2), center, _ECCENTRICITY)
    across = np.array([-normal[1], normal[0]])
    _mark(ax, np.zeros(2), "center of the bearing", -across)
    _mark(ax, center, "center of the journal", across)
    _write(ax, 0.5 * center - 0.12 * across, "$\\mathbf{e}$", _ECCENTRICITY)
    for turn, foot, radius, words in (
        (2.5, np.zeros(2), 1.0 + _GAP, "$R_b$"),
        (-0.9, center, 1.0, "$R_j$"),
    ):
        way = np.array([np.cos(turn), np.sin(turn)])
        _arrow(ax, foot, foot + radius * way, "0.2")
        _write(ax, foot + 0.7 * radius * way + 0.12 * np.array([-way[1], way[0]]), words, "0.2")
    touch = center + normal
    _arrow(ax, touch + 0.9 * normal, touch, _FORCE)
    _write(ax, touch + 0.75 * normal + 0.22 * across, "$F_n$", _FORCE)
    excess = run[f"{joint.name}.penetration"][sample]
    size = np.hypot(*eccentricity)
    ax.set_title(
        f"wrist: $c = R_b - R_j$ = {1e6 * joint.clearance:.3g} µm, "
        f"$R_j$ = {1e3 * joint.journal_radius:.3g} mm;\n"
        f"at {1e3 * run.t[sample]:.3g} ms $|e|$ = {1e6 * size:.3g} µm, "
        f"penetration $\\delta = |e| - c$ = {1e6 * excess:.2g} µm\n"
        f"(clearance drawn {_GAP * joint.journal_radius / joint.clearance:.3g} times larger)",
        fontsize="medium",
    )
    # The tail of the force is the farthest of all.
    reach = max(2.1, float(np.abs(touch + 0.9 * normal).max()) + 0.1)
    ax.set_xlim(-reach, reach)
    ax.set_ylim(-reach, reach)
    return figure


def method(study: ConventionStudy) -> Figure:
    """Figure 2: the steps from intervals to bounds and sensitivities, with the numbers of this study."""
    result = study.lengths["0.02"]
    names = ", ".join(f"${symbol}$" for symbol in ("l_1", "l_2"))
    steps = [
        f"intervals of {names}: ± {100.0 * UNCERTAINTY:g} %, Eq. (34)",
        f"{len(result.parameters)} interpolation points: roots of the Chebyshev polynomials, Eq. (26)",
        "scene at every point: simulated with clearance joint, Eq. (16)",
        f"polynomials of degree {DEGREE} in the parameters at {len(result.t)} instants, Eqs. (27), (28)",
        "bounds, Eq. (31)          sensitivities, Eqs. (32), (33)",
        f"compared with a scan of {SCAN_POINTS} x {SCAN_POINTS} points and with the ideal mechanism",
    ]
    figure, ax = _picture(study, "the method", (7.5, 5.5))
    heights = -np.arange(len(steps), dtype=float)
    for height, words in zip(heights, steps, strict=True):
        box = {"boxstyle": "round,pad=0.5", "facecolor": "#E8EEF5", "edgecolor": COLORS[0]}
        ax.text(0.0, height, words, ha="center", va="center", bbox=box)
    for start in heights[:-1]:
        _arrow(ax, np.array([0.0, start - 0.27]), np.array([0.0, start - 0.73]), "0.2")
    ax.set_aspect("auto")
    ax.set_xlim(-1.0, 1.0)
    ax.set_ylim(heights[-1] - 0.6, 0.6)
    return figure


def mechanism(study: ConventionStudy) -> Figure:
    """Figure 3: the slider-crank as it was simulated."""
    run = study.single["nominal"]
    figure, ax = _picture(study, "slider-crank with clearance joint", (9.0, 4.2))
    ax.set_axis_on()
    plot_scene(run, float(np.radians(_CRANK_ANGLE)) / CRANK_SPEED, ax=ax, exaggerate=_EXAGGERATE)
    return figure


def _picture(study: ConventionStudy, title: str, size: tuple[float, float]) -> tuple[Figure, Axes]:
    """A figure that names its convention, with one axes of equal scales and without ticks."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    figure.suptitle(f"{title[0].upper()}{title[1:]} ({study.convention.replace('_', ' ')})", fontsize="large")
    ax = figure.subplots()
    ax.set_aspect("equal")
    ax.set_axis_off()
    return figure, ax


def _arrow(ax: Axes, start: Array, end: Array, color: str) -> None:
    style = {"arrowstyle": "-|>", "color": color, "linewidth": 1.3, "shrinkA": 0.0, "shrinkB": 0.0}
    ax.annotate("", xy=(end[0], end[1]), xytext=(start[0], start[1]), arrowprops=style, zorder=5)


def _mark(ax: Axes, place: Array, words: str, side: Array) -> None:
    """A point with its name some way off, joined by a thin line."""
    ax.plot(*place, color="black", marker="o", markersize=3.0, zorder=6)
    text = place + 0.6 * side
    style = {"arrowstyle": "-", "color": "0.5", "linewidth": 0.6}
    ax.annotate(
        words,
        xy=(place[0], place[1]),
        xytext=(text[0], text[1]),
        arrowprops=style,
        ha="center",
        va="center",
        fontsize="small",
    )


def _write(ax: Axes, place: Array, words: str, color: str) -> None:
    ax.text(place[0], place[1], words, color=color, ha="center", va="center", fontsize="large", zorder=6)
