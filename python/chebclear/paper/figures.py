"""The figures of the case study, from its results; `drawings` has those without a curve, 1 to 3.

Each function returns a matplotlib figure that belongs to no backend. The abscissa of the others is the
paper's: the crank angle over the second revolution, 360 to 720 degrees.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..plots.axes import COLORS
from ..plots.bands import plot_band
from ..plots.runs import plot_trajectory
from ..plots.spectra import plot_spectrogram
from . import drawings
from .case_study import (
    CRANK_ANGLE,
    CRANK_SPEED,
    DURATION,
    ENVELOPE,
    LENGTH_CLEARANCES,
    LENGTHS,
    SECOND,
    UNCERTAIN_CLEARANCES,
    ConventionStudy,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from ..study.band.band import Band

Array = NDArray[np.float64]

ANGLE = "crank angle [deg]"
SYMBOLS = {"crank_length": "$l_1$", "rod_length": "$l_2$"}
NAMES = {"longest": "longest links", "shortest": "shortest links", "nominal": "nominal links"}
# Told apart by color-blind readers too; the deviation of a sensitivity has a color of its own.
CHEBYSHEV, NOMINAL, DEVIATION, OTHER = COLORS[0], COLORS[4], COLORS[4], COLORS[1]
IDEAL, ZONE = "black", COLORS[2]
# 1 m/s or 1 m for the whole length is 10 mm/s or 10 mm for one per cent of it.
PER_CENT = 10.0

# A time-frequency piece lasts 30 degrees of crank angle, 2.5 ms: 0.8 kHz of resolution beside a ringing of
# 2 to 6 kHz, and short beside the quarter turns over which the load changes.
PIECE = 30.0


def figures(study: ConventionStudy) -> dict[str, Callable[[], Figure]]:
    """Functions that draw the figures, by file name without its ending.

    Parameters
    ----------
    study : ConventionStudy
        Results with one convention.

    Returns
    -------
    dict
        ``"fig01"`` to ``"fig12"`` -> function without arguments that returns the figure.
    """
    return {
        "fig01": lambda: drawings.clearance_joint(study),
        "fig02": lambda: drawings.method(study),
        "fig03": lambda: drawings.mechanism(study),
        "fig04": lambda: response_bounds(study, "0.02"),
        "fig05": lambda: single_penetration(study),
        "fig06": lambda: single_acceleration(study),
        "fig07": lambda: time_frequency(study),
        "fig08": lambda: response_bounds(study, "0.01"),
        "fig09": lambda: displacement_sensitivity(study),
        "fig10": lambda: velocity_sensitivity(study, "crank_length"),
        "fig11": lambda: velocity_sensitivity(study, "rod_length"),
        "fig12": lambda: uncertain_clearance(study),
    }


def response_bounds(study: ConventionStudy, clearance: str) -> Figure:
    """Figures 4 and 8: bounds of displacement, velocity, acceleration, penetration; lengths uncertain."""
    scans = study.length_scans.get(clearance)
    figure, axes = _figure(study, f"bounds with uncertain lengths, c = {clearance} mm", 2, 2)
    panels = (
        ("slider.x", "mm", "slider displacement", False),
        ("slider.vx", None, "slider velocity", False),
        ("slider.ax", "km/s²", "slider acceleration", True),
        ("wrist.penetration", "µm", "relative penetration depth", True),
    )
    for ax, letter, (output, unit, title, in_time) in zip(axes.flat, "abcd", panels, strict=True):
        band, scan = study.lengths[clearance][output], scans[output] if scans else None
        if in_time:
            window = ENVELOPE / 720.0 * DURATION
            band, scan = band.envelope(window), scan.envelope(window) if scan else None
            title += f"\n(bounds: running envelopes over {ENVELOPE:g}°; nominal: as it is)"
        plot_band(
            band,
            ax=ax,
            unit=unit,
            x=CRANK_ANGLE,
            x_label=ANGLE,
            scan=scan,
            nominal=True,
            label="Chebyshev bounds, Eq. (31)",
        )
        _finish(ax, f"({letter}) {title}", legend=letter == "a")
    _mark_contact(axes.flat[3])
    return figure


def single_penetration(study: ConventionStudy) -> Figure:
    """Figure 5: penetration with the longest and the shortest links."""
    figure, axes = _figure(study, "penetration of single mechanisms, c = 0.02 mm", 2, 1)
    _single(study, axes, "wrist.penetration", "µm")
    for ax in axes.flat:
        _mark_contact(ax)
    _share_limits(axes)
    return figure


def single_acceleration(study: ConventionStudy) -> Figure:
    """Figure 6: slider acceleration with the longest and the shortest links."""
    figure, axes = _figure(study, "slider acceleration of single mechanisms, c = 0.02 mm", 2, 1)
    _single(study, axes, "slider.ax", "km/s²")
    _share_limits(axes)
    return figure


def _single(study: ConventionStudy, axes: NDArray[Any], column: str, unit: str) -> None:
    for ax, letter, name in zip(axes.flat, "ab", ("longest", "shortest"), strict=True):
        run = study.single[name]
        plot_trajectory(run, column, ax=ax, unit=unit, x=_angle(run.t), x_label=ANGLE)
        _finish(ax, f"({letter}) {NAMES[name]}")


def time_frequency(study: ConventionStudy) -> Figure:
    """Figure 7: time-frequency plots of the slider acceleration, longest, shortest and nominal links."""
    figure, axes = _figure(study, "time-frequency plot of the slider acceleration, c = 0.02 mm", 3, 1)
    images = []
    for ax, letter, name in zip(axes.flat, "abc", ("longest", "shortest", "nominal"), strict=True):
        run = study.single[name]
        # The pieces are centered on 360 to 720 degrees; the run goes on for half a piece.
        held = _angle(run.t) >= 360.0 - 0.5 * PIECE
        plot_spectrogram(
            run.t[held],
            run["slider.ax"][held],
            ax=ax,
            window=PIECE / 720.0 * DURATION,
            overlap=0.98,
            x=_angle(run.t[held]),
            x_label=ANGLE,
            color_bar=False,
        )
        ax.set_xlim(360.0, 720.0)
        ax.set_xticks(np.arange(360.0, 721.0, 45.0))
        ax.set_ylim(0.0, 15.0)
        ax.set_title(f"({letter}) {NAMES[name]} (pieces of {PIECE:g}°)", fontsize="medium", loc="left")
        images.append(ax.collections[0])
    top = max(image.get_clim()[1] for image in images)
    for image in images:
        image.set_clim(top - 50.0, top)
    figure.colorbar(images[0], ax=list(axes.flat), label="amplitude [dB re 1 m/s²]", extend="min", aspect=40)
    return figure


def displacement_sensitivity(study: ConventionStudy) -> Figure:
    """Figure 9: sensitivity of the displacement to both lengths, at both clearances."""
    figure, axes = _figure(
        study, "sensitivity of the slider displacement per relative length change [mm per 1 %]", 2, 1
    )
    for ax, letter, clearance in zip(axes.flat, "ab", LENGTH_CLEARANCES, strict=True):
        for length, color in zip(LENGTHS, (CHEBYSHEV, OTHER), strict=True):
            values = PER_CENT * study.sensitivity(clearance, "slider.x", length)
            ideal = PER_CENT * study.ideal["slider.x"].sensitivity[length]
            symbol = SYMBOLS[length]
            ax.plot(CRANK_ANGLE[SECOND], values[SECOND], color=color, linewidth=1.2, label=f"to {symbol}")
            ax.plot(
                CRANK_ANGLE[SECOND],
                ideal[SECOND],
                color=IDEAL,
                linewidth=0.8,
                linestyle=(0, (4, 3)),
                label="ideal mechanism" if length == LENGTHS[-1] else None,
            )
        ax.axhline(0.0, color="0.6", linewidth=0.6, zorder=0)
        ax.set_xlabel(ANGLE)
        ax.set_ylabel("sensitivity [mm per 1 %]")
        _finish(ax, f"({letter}) c = {clearance} mm", legend=letter == "a")
    _share_limits(axes)
    return figure


def velocity_sensitivity(study: ConventionStudy, length: str) -> Figure:
    """Figures 10 and 11: sensitivity of the velocity to a length, clearance effect restraint zones shaded."""
    symbol = SYMBOLS[length]
    figure, axes = _figure(
        study,
        f"sensitivity of the slider velocity to {symbol} per relative length change [mm/s per 1 %]",
        2,
        2,
    )
    angle = CRANK_ANGLE[SECOND]
    for column, letters, clearance in zip(axes.T, ("ac", "bd"), LENGTH_CLEARANCES, strict=True):
        zones = study.restraint_zones(clearance, length)
        above, below = column
        values = PER_CENT * study.sensitivity(clearance, "slider.vx", length)[SECOND]
        above.plot(angle, values, color=CHEBYSHEV, linewidth=0.9, label="with clearance")
        ideal = PER_CENT * study.ideal["slider.vx"].sensitivity[length][SECOND]
        above.plot(angle, ideal, color=IDEAL, linewidth=0.8, linestyle=(0, (4, 3)), label="ideal mechanism")
        above.set_ylabel("sensitivity [mm/s per 1 %]")
        below.plot(
            angle,
            PER_CENT * zones.deviation,
            color=DEVIATION,
            linewidth=0.7,
            label="deviation from the ideal",
        )
        for sign, label in ((1.0, f"envelope of its size over {ENVELOPE:g}°"), (-1.0, None)):
            below.plot(angle, sign * PER_CENT * zones.envelope, color="0.35", linewidth=0.8, label=label)
            half = "half its maximum" if label else None
            below.axhline(
                sign * PER_CENT * zones.threshold, color=ZONE, linewidth=1.0, linestyle=":", label=half
            )
        below.set_ylabel("deviation [mm/s per 1 %]")
        for ax in column:
            for number, (start, end) in enumerate(zones.spans):
                ax.axvspan(
                    start,
                    end,
                    color=ZONE,
                    alpha=0.15,
                    linewidth=0.0,
                    zorder=0,
                    label="restraint zone (envelope under half the maximum)" if number == 0 else None,
                )
            ax.set_xlabel(ANGLE)
        _finish(above, f"({letters[0]}) c = {clearance} mm", legend=False)
        _finish(below, f"({letters[1]}) deviation, c = {clearance} mm", legend=False)
    for row in axes:
        _share_limits(row)
    _legend_below(figure, axes.flat[0], axes.flat[2])
    return figure


def uncertain_clearance(study: ConventionStudy) -> Figure:
    """Figure 12: bounds of displacement and velocity with uncertain clearance, and their widths."""
    figure, axes = _figure(study, "bounds with uncertain clearance, ± 10 %", 2, 2)
    angle = CRANK_ANGLE
    panels = (("slider.x", "mm", "slider displacement", 1e3), ("slider.vx", "m/s", "slider velocity", 1.0))
    for column, letters, (output, unit, title, scale) in zip(axes.T, ("ac", "bd"), panels, strict=True):
        above, below = column
        styles = ((OTHER, ":"), (CHEBYSHEV, "--"))
        for clearance, (color, dashes) in zip(UNCERTAIN_CLEARANCES, styles, strict=True):
            band = study.clearances[clearance][output]
            scan = study.clearance_scans[clearance][output]
            label = f"c = {clearance} mm"
            _bounds(above, angle, band, scale, color=color)
            nominal = f"{label}: nominal"
            above.plot(
                angle, scale * band.nominal, color="black", linewidth=0.7, linestyle=dashes, label=nominal
            )
            below.plot(angle, scale * band.width, color=color, linewidth=0.8, label=f"{label}: Eq. (31)")
            below.plot(
                angle,
                scale * scan.width,
                color=color,
                linewidth=0.8,
                linestyle=(0, (3, 2)),
                label=f"{label}: scan",
            )
        above.set_ylabel(f"{title} [{unit}]")
        below.set_ylabel(f"width of the bounds [{unit}]")
        for ax in column:
            ax.set_xlabel(ANGLE)
        _finish(above, f"({letters[0]}) {title}")
        _finish(below, f"({letters[1]}) {title}: upper minus lower bound")
        below.set_ylim(bottom=0.0)
    _legend_below(figure, axes.flat[0], axes.flat[2], columns=3)
    return figure


def _figure(study: ConventionStudy, title: str, rows: int, columns: int) -> tuple[Figure, NDArray[Any]]:
    """Figure with a title that names the convention, and its grid of axes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0 if columns > 1 else 9.0, 3.4 * rows), layout="constrained")
    figure.suptitle(f"{title[0].upper()}{title[1:]} ({study.convention.replace('_', ' ')})", fontsize="large")
    return figure, figure.subplots(rows, columns, squeeze=False)


def _angle(t: Array) -> Array:
    """Crank angle at instants of a single run [deg]."""
    return np.degrees(CRANK_SPEED * t)


def _bounds(ax: Axes, angle: Array, band: Band, scale: float, *, color: str) -> None:
    """Both bounds as an area with thin edges."""
    ax.fill_between(angle, scale * band.lower, scale * band.upper, color=color, alpha=0.25, linewidth=0.0)
    ax.plot(angle, scale * band.lower, color=color, linewidth=0.8)
    ax.plot(angle, scale * band.upper, color=color, linewidth=0.8)


def _finish(ax: Axes, title: str, *, legend: bool = False) -> None:
    """Title, ticks every 45 degrees of the second revolution, limits from what is visible, legend on top."""
    ax.set_title(title, fontsize="medium", loc="left")
    ax.set_xlim(360.0, 720.0)
    ax.set_xticks(np.arange(360.0, 721.0, 45.0))
    visible = []
    for line in ax.get_lines():
        x, y = np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)
        if len(x) > 2:
            visible.append(y[(x >= 360.0) & np.isfinite(y)])
    values = np.concatenate(visible)
    margin = 0.05 * (values.max() - values.min())
    head = 0.22 * (values.max() - values.min()) if legend else margin
    ax.set_ylim(values.min() - margin, values.max() + head)
    old = ax.get_legend()
    if old is not None:
        old.remove()
    if legend:
        ax.legend(loc="upper center", ncols=4, fontsize="small", frameon=False)


def _mark_contact(ax: Axes) -> None:
    """Zero line of a penetration plot: above it the surfaces overlap, below it the journal flies free."""
    low, high = ax.get_ylim()
    ax.axhline(0.0, color="0.4", linewidth=0.7, zorder=0)
    if low > -0.1 * (high - low):
        ax.set_ylim(-0.1 * (high - low), high)
    ax.annotate(
        "free flight below 0",
        (0.5, 0.0),
        xycoords=("axes fraction", "data"),
        xytext=(0, -3),
        textcoords="offset points",
        ha="center",
        va="top",
        fontsize="small",
        color="0.3",
    )


def _share_limits(axes: NDArray[Any]) -> None:
    """Give all axes the same range of ordinates, so that they can be compared by eye."""
    limits = [ax.get_ylim() for ax in axes.flat]
    for ax in axes.flat:
        ax.set_ylim(min(low for low, _ in limits), max(high for _, high in limits))


def _legend_below(figure: Figure, *sources: Axes, columns: int = 3) -> None:
    """One legend under all axes, each label once."""
    found: dict[str, Any] = {}
    for ax in sources:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    figure.legend(
        list(found.values()),
        list(found),
        loc="outside lower center",
        ncols=columns,
        fontsize="small",
        frameon=False,
    )
