"""Plots of costs: work against precision, and tolerances for least cost."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.arguments import Checks
from ..base.prefixes import Form
from ..base.shown import meant_or_known
from ..errors import UnknownNameError
from ..scene.columns import column_unit, column_words, plain_words
from .axes import COLORS, MARKERS, line_style, new_axes, plot_of
from .labels import (
    legends_above,
    plain_numbers,
    set_labels,
    set_row_names,
    set_x_label,
    size_of,
    text_width,
    typeset,
    with_unit,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..decisions.allocation import Allocation
    from ..tradeoffs.bounds import StudyTradeoff
    from ..tradeoffs.result import Tradeoff

_COSTS = {
    "seconds": "time of a run on this machine [ms]",
    "steps": "steps [-]",
    "stages": "stages [-]",
    "evaluations": "evaluations of the accelerations [-]",
}


# Long because all it draws has a style and words of its own.
@plot_of("Tradeoff")
def plot_tradeoff(
    result: Tradeoff,
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
    cost : {"seconds", "steps", "stages", "evaluations"}
        The ordinate.
    until : float, optional
        End of the time over which the error is the largest [s]; all of it if not given.

    Raises
    ------
    KeyError, ValueError, TypeError
        If the output or the cost is unknown.

    Examples
    --------
    >>> import chebclear as cc
    >>> scene = cc.mechanisms.slider_crank()
    >>> result = cc.tradeoff(scene, duration=0.005, samples=51, outputs=["slider.vx"], rtols=[1e-3, 1e-4])
    >>> ax = cc.plots.plot_tradeoff(result)
    """
    checks = Checks()
    checks.word("cost", cost, _COSTS)
    if until is not None:
        until = checks.real("until", until, "s", above=0.0)
    checks.finish()
    name = result.outputs[0] if output is None else output
    uncertainty = result.uncertainty(name, until)
    scale = float(result.ranges[result.outputs.index(name)])
    # An error of exactly zero has no place on a logarithmic axis: it is drawn at the rounding error.
    least = np.finfo(float).eps * (scale or 1.0)
    ax = new_axes(ax)
    ax.set_xscale("log")
    ax.set_yscale("log")
    if uncertainty > 0.0:
        label = f"uncertainty of the reference, {uncertainty:.1e} {column_unit(name)}".rstrip()
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
        label = f"chaos horizon, {100.0 * result.horizon_part:g} % of the range"
        ax.axvline(result.horizon_part * scale, color="0.4", linewidth=0.8, linestyle="--", label=label)
    if uncertainty > 0.0:
        # The gray area is seen, but does not push the points aside.
        ax.set_xlim(left=0.3 * leftmost)
    span = result.end if until is None else until
    what = f"largest error of {column_words(name)} to {1e3 * span:.3g} ms"
    plain_numbers(ax.yaxis)
    set_labels(ax, with_unit(what, column_unit(name)), _COSTS[cost])
    legends_above(ax, guides=("uncertainty of the reference", "chaos horizon"))
    return ax


@plot_of("StudyTradeoff")
def plot_study_tradeoff(
    result: StudyTradeoff, output: str | None = None, *, ax: Axes | None = None, **line: Any
) -> Axes:
    """Draw the relative error of the mean width against the number of runs, one line a way of bounding.

    Filled markers are too wide, hollow ones too narrow; both axes are logarithmic.

    Parameters
    ----------
    result : StudyTradeoff
        What `study_tradeoff` returned.
    output : str, optional
        Name of the output; the first one if not given.

    Raises
    ------
    KeyError
        If the output is unknown.

    Examples
    --------
    >>> import chebclear as cc
    >>> side = {"rod_length": cc.Interval.around(0.12, rel=0.01)}
    >>> study = cc.Study(cc.mechanisms.slider_crank, side, outputs=["slider.x"], duration=0.01, samples=21)
    >>> ax = cc.plots.plot_study_tradeoff(cc.study_tradeoff(study, degrees=[1, 2], points=[3], holdout=5))
    """
    name = result.outputs[0] if output is None else output
    if not isinstance(name, str) or name not in result.outputs:
        raise UnknownNameError(f'unknown column "{name}"{meant_or_known(name, result.outputs)}')
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
    plain_numbers(ax.xaxis)
    plain_numbers(ax.yaxis)
    set_labels(ax, "runs [-]", f"error of the width of {column_words(name)} [-]")
    legends_above(ax, title="bounds; hollow: too narrow")
    return ax


@plot_of("Allocation")
def plot_allocation(allocation: Allocation, *, ax: Axes | None = None, **bars: Any) -> Axes:
    """Draw which tolerances were closed and which opened, and by what factor.

    Parameters
    ----------
    allocation : Allocation
        What ``allocate`` returned.

    Examples
    --------
    >>> import chebclear as cc
    >>> def shaft(gap, thread):
    ...     return {"play": gap - thread}
    >>> study = cc.Study(shaft, {"gap": cc.normal(10.1, 0.01), "thread": cc.normal(10.0, 0.01)})
    >>> cost = {"gap": {0.02: 9, 0.04: 5}, "thread": {0.02: 6, 0.04: 4}}
    >>> ax = cc.plots.plot_allocation(cc.allocate(study, cost, cc.require("play", above=0.05)))
    """
    ax = new_axes(ax)
    rows = list(allocation.values())
    factors = np.array([one.after / one.before for one in rows])
    set_row_names(ax, [plain_words(one.name) for one in rows])
    ax.set_xscale("log")
    colors = [COLORS[1] if factor > 1.0 else COLORS[0] for factor in factors]
    look: dict[str, Any] = {"left": 1.0, "height": 0.6, "color": colors}
    ax.barh(range(len(rows)), factors - 1.0, **(look | bars))
    forms = [Form.of((one.before, one.after), one.unit, one.written) for one in rows]
    words = [
        " to ".join(map(form.text, (one.before, one.after))) for form, one in zip(forms, rows, strict=True)
    ]
    for row, (factor, text) in enumerate(zip(factors, words, strict=True)):
        place = (max(float(factor), 1.0), float(row))
        beside: dict[str, Any] = {"xytext": (5.0, 0.0), "textcoords": "offset points", "va": "center"}
        ax.annotate(typeset(text), place, fontsize="small", **beside)
    ax.axvline(1.0, color="0.2", linewidth=0.8)
    low, high = math.log(0.9 * min(1.0, *factors)), math.log(1.1 * max(1.0, *factors))
    # The quantities stand to the right of the bars.
    widest = max(text_width(text, float(ax.xaxis.label.get_fontsize())) for text in words)
    ax.set_xlim(math.exp(low), math.exp(low + (high - low) / max(0.2, 1.0 - (widest + 5.0) / size_of(ax)[0])))
    ticks = [tick for tick in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0) if low <= math.log(tick) <= high]
    ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    ax.set_xticks([], minor=True)
    set_x_label(ax, "tolerance over that before [-]")
    ax.set_title(f"cost {allocation.cost_before:.4g} before, {allocation.cost:.4g} after")
    return ax
