"""Work-precision plots."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import ArgumentError
from ..scene.columns import column_unit, column_words
from .axes import COLORS, MARKERS, line_style, new_axes
from .labels import set_x_label, set_y_label, typeset, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

    from .subjects import BoundCostsLike, CostsLike

_COSTS = {
    "seconds": "time of a run on this machine [ms]",
    "steps": "steps [-]",
    "stages": "stages [-]",
    "evaluations": "evaluations of the accelerations [-]",
}


# Long because all it draws has a style and words of its own.
def plot_tradeoff(
    result: CostsLike,
    output: str | None = None,
    *,
    ax: Axes | None = None,
    cost: str = "seconds",
    until: float | None = None,
    **line: Any,
) -> Axes:
    """Draw cost against error on logarithmic axes, one line a method.

    The area left of the uncertainty of the reference is gray: points there are hollow and drawn at the
    largest error they may have. Right of the dashed line the runs have passed the chaos horizon: they differ
    by more than 1 % of the range of the output. A run that failed has no error; it is a cross at the right
    edge, at what it cost until then, with its status in the legend.

    Parameters
    ----------
    result : Tradeoff
        What `tradeoff` returned.
    output : str, optional
        Name of the output; the first one if not given.
    ax : Axes, optional
        Where to draw; a new figure if not given.
    cost : {"seconds", "steps", "stages", "evaluations"}
        The ordinate.
    until : float, optional
        End of the time over which the error is the largest [s]; all of it if not given.
    **line
        Passed to ``Axes.plot`` for the lines.

    Returns
    -------
    Axes

    Raises
    ------
    KeyError, ValueError
        If the output or the cost is unknown.

    Examples
    --------
    >>> import chebclear as cc
    >>> scene = cc.mechanisms.slider_crank()
    >>> result = cc.tradeoff(scene, duration=0.005, samples=51, outputs=["slider.vx"], rtols=[1e-3, 1e-4])
    >>> ax = cc.plot_tradeoff(result)
    """
    if cost not in _COSTS:
        raise ArgumentError(f"cost must be one of {', '.join(_COSTS)}, got {cost!r}")
    name = result.outputs[0] if output is None else output
    uncertainty = result.uncertainty(name, until)
    scale = float(result.ranges[result.outputs.index(name)])
    # An error of exactly zero has no place on a logarithmic axis: it is drawn at the rounding error.
    least = np.finfo(float).eps * (scale or 1.0)
    ax = new_axes(ax)
    ax.set_xscale("log")
    ax.set_yscale("log")
    if uncertainty > 0.0:
        label = f"the reference is not known better: {uncertainty:.1e} {column_unit(name)}".rstrip()
        ax.axvspan(least, uncertainty, color="0.9", linewidth=0.0, label=label)
    failures: dict[tuple[str, str, str], list[float]] = {}
    leftmost = uncertainty
    methods = list(dict.fromkeys(point.method for point in result.points))
    for index, method in enumerate(methods):
        errors, costs, hollow = [], [], []
        color = COLORS[index % len(COLORS)]
        for point in result.points:
            if point.method != method:
                continue
            price = 1e3 * point.seconds if cost == "seconds" else float(getattr(point.stats, cost))
            error = result.error(point, name, until)
            if not point.success or math.isnan(error):
                failures.setdefault((method, point.status, color), []).append(price)
                continue
            unresolved = error <= 2.0 * uncertainty
            errors.append(max(error + uncertainty if unresolved else error, least))
            leftmost = min(leftmost, errors[-1])
            costs.append(price)
            hollow.append(unresolved)
        if not errors:
            continue
        marker = {"marker": MARKERS[index % len(MARKERS)], "markersize": 4.5, "color": color}
        style = line_style(line, linewidth=1.0, label=method, **marker)
        ax.plot(errors, costs, **style)
        for error, price in ((x, y) for x, y, open_ in zip(errors, costs, hollow, strict=True) if open_):
            ax.plot(error, price, **{**style, "markerfacecolor": "white", "label": None, "linestyle": "none"})
    for (method, status, color), prices in failures.items():
        ax.plot(
            np.full(len(prices), 0.98),
            prices,
            transform=ax.get_yaxis_transform(),
            marker="x",
            linestyle="none",
            color=color,
            label=f"{method}, {len(prices)} failed: {status}",
        )
    if scale > 0.0:
        label = f"{100.0 * result.horizon_part:g} % of the range: past the chaos horizon"
        ax.axvline(result.horizon_part * scale, color="0.4", linewidth=0.8, linestyle="--", label=label)
    if uncertainty > 0.0:
        # The gray area is seen, but does not push the points aside.
        ax.set_xlim(left=0.3 * leftmost)
    span = result.end if until is None else until
    what = f"largest error of {column_words(name)} to {1e3 * span:.3g} ms"
    set_x_label(ax, with_unit(what, column_unit(name)))
    set_y_label(ax, _COSTS[cost])
    _plain_ticks(ax.yaxis)
    _legend_above(ax)
    return ax


def plot_study_tradeoff(
    result: BoundCostsLike, output: str | None = None, *, ax: Axes | None = None, **line: Any
) -> Axes:
    """Draw the relative error of the mean width against the number of runs, one line a way of bounding.

    Filled markers are too wide, hollow ones too narrow; both axes are logarithmic.

    Parameters
    ----------
    result : StudyTradeoff
        What `Study.tradeoff` returned.
    output : str, optional
        Name of the output; the first one if not given.
    ax : Axes, optional
        Where to draw; a new figure if not given.
    **line
        Passed to ``Axes.plot`` for the lines.

    Returns
    -------
    Axes

    Examples
    --------
    >>> import chebclear as cc
    >>> study = cc.Study(
    ...     cc.mechanisms.slider_crank,
    ...     {"rod_length": cc.interval(0.12, rel=0.01)},
    ...     outputs=["slider.x"],
    ...     duration=0.005,
    ...     samples=21,
    ...     skip=0.03,
    ... )
    >>> ax = cc.plot_study_tradeoff(study.tradeoff(degrees=[1, 2], points=[3], holdout=5))
    """
    name = result.outputs[0] if output is None else output
    column = result.outputs.index(name)
    ax = new_axes(ax)
    ax.set_xscale("log")
    ax.set_yscale("log")
    for index, bounds in enumerate(dict.fromkeys(point.bounds for point in result.points)):
        points = [point for point in result.points if point.bounds == bounds]
        runs = [point.runs for point in points]
        errors = [float(point.width_error[column]) for point in points]
        # An error of exactly zero has no place on a logarithmic axis.
        sizes = [max(abs(error), np.finfo(float).eps) for error in errors]
        marker = {
            "marker": MARKERS[index % len(MARKERS)],
            "markersize": 4.5,
            "color": COLORS[index % len(COLORS)],
        }
        style = line_style(line, linewidth=1.0, label=bounds, **marker)
        ax.plot(runs, sizes, **style)
        for count, size, error in zip(runs, sizes, errors, strict=True):
            if error < 0.0:
                ax.plot(count, size, **{**style, "markerfacecolor": "white", "label": None})
    set_x_label(ax, "runs [-]")
    set_y_label(ax, f"error of the width of {column_words(name)} [-]")
    _plain_ticks(ax.xaxis)
    _legend_above(ax, title="bounds; hollow: too narrow", columns=2)
    return ax


def _plain_ticks(axis: Axis) -> None:
    """Plain numbers on a logarithmic axis that may span less than a decade: 6 and 20, not 2 x 10^1."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _legend_above(ax: Axes, title: str | None = None, columns: int = 1) -> None:
    """A legend above the axes, where it can cover no point."""
    style: dict[str, Any] = {"fontsize": "small", "frameon": False, "title_fontsize": "small"}
    handles, labels = ax.get_legend_handles_labels()
    style |= {"loc": "lower center", "bbox_to_anchor": (0.5, 1.01), "borderaxespad": 0.0}
    ax.legend(handles, list(map(typeset, labels)), title=title, ncols=columns, **style)
