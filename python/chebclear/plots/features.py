"""Plots of the effects of parameters on a feature: tornado, shares of the variance, tightened tolerances."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.prefixes import prefix_of
from ..scene.columns import plain_words
from .axes import COLORS, new_axes, plot_of, shown_scale
from .labels import (
    legends_above,
    set_row_names,
    set_x_label,
    size_of,
    text_width,
    typeset,
    with_unit,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..decisions.contrast import Difference
    from ..decisions.identification import Identification
    from ..study.features.effects import Effects
    from ..study.features.features import FeatureResult
    from ..study.features.ranking import Ranking
    from ..study.requirements.conformance import Share

Array = NDArray[np.float64]

# Parameters that a tornado draws; the others are counted in a note.
_MOST_ROWS = 10
LOW, HIGH, TOGETHER, SCATTER = COLORS[0], COLORS[1], "0.6", "0.8"


@plot_of("FeatureResult")
def plot_tornado(
    feature: FeatureResult, *, ax: Axes | None = None, unit: str | None = None, **bars: Any
) -> Axes:
    """Draw the effect of each parameter on the mean of a feature, the largest on top.

    A bar goes from the mean with the parameter at the lower end of its interval to that at the upper end, the
    others anywhere in theirs. Its ends are labeled with their values; whiskers hold the true means with a
    confidence of 95 %.

    Parameters
    ----------
    feature : FeatureResult
        A feature of a study, ``result.features["peak force"]``.

    Raises
    ------
    ValueError
        If there are too few runs to separate the effects of the parameters, or the unit does not fit.

    Examples
    --------
    >>> import chebclear as cc
    >>> box = {"radius": cc.Interval(1.0, 2.0), "load": cc.Interval(3.0, 5.0)}
    >>> study = cc.Study(lambda radius, load: {"torque": radius * load}, box, units={"torque": "N m"})
    >>> ax = cc.plots.plot_tornado(study.sample(20).features["torque"])
    """
    effects = feature.effects
    scale, shown_unit = shown_scale(ax, feature.unit, unit, feature.written, effects.mean, "x")
    names = sorted(effects.swings, key=lambda name: -_reach(effects, name))
    shown = names[:_MOST_ROWS]
    ax = new_axes(ax)
    mean = scale * effects.mean
    sides: dict[str, list[tuple[float, float, float]]] = {"left": [], "right": []}
    for row, name in enumerate(shown):
        swing = effects.swings[name]
        ends = scale * np.array([swing.at_lower, swing.at_upper])
        reaches = scale * np.array([swing.at_lower_range, swing.at_upper_range])
        labels = ("lower end of the interval", "upper end of the interval")
        # Bars to the same side would hide one another: each gets half of the height.
        beside = 0.15 if (ends[0] - mean) * (ends[1] - mean) > 0.0 else 0.0
        for number, (end, reach, color, label) in enumerate(
            zip(ends, reaches, (LOW, HIGH), labels, strict=True)
        ):
            style: dict[str, Any] = {
                "height": 0.3 if beside else 0.6,
                "color": color,
                "label": label if row == 0 else None,
            } | bars
            ax.barh(row + (beside if number else -beside), end - mean, left=mean, **style)
            # Whiskers of both ends overlap: one above the other.
            height = row + (beside or 0.12) * (1.0 if number else -1.0)
            ax.plot(reach, (height, height), color="0.2", linewidth=1.0, marker="|", markersize=7.0)
        if beside:
            side = "left" if ends[0] < mean else "right"
            for offset, end, reach in zip((-beside, beside), ends, reaches, strict=True):
                place = min(end, *reach) if side == "left" else max(end, *reach)
                sides[side].append((float(place), row + offset, float(end)))
            continue
        sides["left"].append((float(reaches.min()), row, float(ends.min())))
        sides["right"].append((float(reaches.max()), row, float(ends.max())))
    ax.plot((mean, mean), (-0.5, len(shown) - 0.5), color="0.2", linewidth=0.8)
    set_row_names(ax, [plain_words(name) for name in shown])
    _values_beside(ax, sides)
    ax.locator_params(axis="x", nbins=4)
    ax.ticklabel_format(axis="x", useOffset=False)
    set_x_label(ax, with_unit(f"{plain_words(feature.name)}, on average", shown_unit))
    if len(names) > len(shown):
        note = f"{len(names) - len(shown)} more parameters move it less"
        ax.text(0.99, 0.02, typeset(note), transform=ax.transAxes, ha="right", fontsize="small", color="0.3")
    legends_above(ax)
    return ax


def _values_beside(ax: Axes, sides: dict[str, list[tuple[float, float, float]]]) -> None:
    """Values beside the ends of bars, with as many decimals as distinguish them, and room for them."""
    everything = [place for entries in sides.values() for place, _, _ in entries]
    reach = max(everything) - min(everything)
    decimals = max(0, min(12, 2 - math.floor(math.log10(reach)))) if reach > 0.0 else 3
    texts = {side: [f"{value:z.{decimals}f}" for _, _, value in entries] for side, entries in sides.items()}
    for side, entries in sides.items():
        for (place, row, _), text in zip(entries, texts[side], strict=True):
            _beside(ax, place, row, text, "right" if side == "left" else "left")
    rooms = [_room(ax, texts[side]) for side in ("left", "right")]
    span = (reach or 1.0) / max(0.2, 1.0 - sum(rooms))
    ax.set_xlim(min(everything) - rooms[0] * span, max(everything) + rooms[1] * span)


def _room(ax: Axes, texts: list[str]) -> float:
    """Part of the width of the axes that the longest of some small texts takes, with its gaps."""
    size = float(ax.xaxis.label.get_fontsize())
    points = max((text_width(text, size) for text in texts), default=0.0) + 16.0
    return points / size_of(ax)[0]


def _reach(effects: Effects, name: str) -> float:
    swing = effects.swings[name]
    return float(max(abs(swing.at_lower - effects.mean), abs(swing.at_upper - effects.mean)))


@plot_of("FeatureResult", "Effects", "Ranking")
def plot_shares(effects: Effects | FeatureResult | Ranking, *, ax: Axes | None = None, **bars: Any) -> Axes:
    """Draw the shares in the variance of a feature: parameters, parameters together, and scatter.

    Whiskers hold the true shares with a confidence of 95 %. The share of scatter is what no
    parameter explains; tightening one narrows it only where its size depends on that parameter.

    Parameters
    ----------
    effects : FeatureResult, Effects or Ranking
        A feature of a study, its effects or its ranking.

    Raises
    ------
    ValueError
        If there are too few runs to separate the effects of the parameters.

    Examples
    --------
    >>> import chebclear as cc
    >>> box = {"radius": cc.Interval(1.0, 2.0), "load": cc.Interval(3.0, 5.0)}
    >>> study = cc.Study(lambda radius, load: {"torque": radius * load}, box, units={"torque": "N m"})
    >>> ax = cc.plots.plot_shares(study.sample(20).ranking("torque"))
    """
    found: Any = getattr(effects, "effects", effects)
    main = found.main if hasattr(found, "main") else {row.parameter: row.share for row in found.rows}
    rows = sorted(
        ((plain_words(name), share, COLORS[0]) for name, share in main.items()), key=lambda row: -row[1].value
    )
    rows += [("parameters together", found.interactions, TOGETHER), ("scatter", found.scatter, SCATTER)]
    ax = new_axes(ax)
    _bars_with_whiskers(ax, rows, bars)
    feature = getattr(effects, "feature", None) or getattr(effects, "name", None)
    of = f" of {plain_words(feature)}" if feature else ""
    set_x_label(ax, f"share of the variance{of} [%]")
    # The room for the numbers beside the bars is beyond 100 %, where no share can be.
    ax.set_xticks([tick for tick in ax.get_xticks() if 0.0 <= tick <= 100.0])
    return ax


@plot_of("Ranking")
def plot_ranking(ranking: Ranking, *, ax: Axes | None = None, **bars: Any) -> Axes:
    """Draw by how much the interval of a feature narrows when that of a parameter is halved.

    Whiskers are 95 % confidence intervals: where one includes zero, no effect is certain.

    Parameters
    ----------
    ranking : Ranking
        What ``result.feature[...].ranking()`` returned.

    Examples
    --------
    >>> import chebclear as cc
    >>> box = {"radius": cc.Interval(1.0, 2.0), "load": cc.Interval(3.0, 5.0)}
    >>> study = cc.Study(lambda radius, load: {"torque": radius * load}, box, units={"torque": "N m"})
    >>> ax = cc.plots.plot_ranking(study.sample(20).ranking("torque"))
    """
    ax = new_axes(ax)
    rows = [(plain_words(row.parameter), row.narrowing, COLORS[0]) for row in ranking.rows]
    _bars_with_whiskers(ax, rows, bars)
    ax.axvline(0.0, color="0.2", linewidth=0.8)
    set_x_label(ax, f"{plain_words(ranking.feature)} narrows when the tolerance is halved, by [%]")
    return ax


@plot_of("Share")
def plot_share(share: Share, *, ax: Axes | None = None, unit: str | None = None, **bins: Any) -> Axes:
    """Draw how the mechanisms are spread, and the limits that they must keep to.

    A quantity that must keep to its limits over a time is drawn by its lowest and its highest value.

    Parameters
    ----------
    share : Share
        What ``conformance(...)[name]`` returned.

    Examples
    --------
    >>> import chebclear as cc
    >>> def shaft(gap, thread):
    ...     return {"play": gap - thread}
    >>> study = cc.Study(shaft, {"gap": cc.normal(10.1, 0.02), "thread": cc.normal(10.0, 0.02)})
    >>> found = cc.conformance(study, {"play": cc.require("play", above=0.04, below=0.2)})
    >>> ax = cc.plots.plot_share(found["play"])
    """
    ends = (share.lowest, share.highest)
    scale, shown = shown_scale(ax, share.unit, unit, share.specification.written, ends, "x")
    ax = new_axes(ax)
    values = [values[np.isfinite(values)] * scale for values in (share.lowest, share.highest)]
    single = np.array_equal(values[0], values[1])
    # Of a value that changes during the run the extreme that a limit is about.
    limited = [math.isfinite(limit) for limit in share.limits]
    series = values[:1] if single else [one for one, used in zip(values, limited, strict=True) if used]
    edges = np.histogram_bin_edges(np.concatenate(series), bins="auto" if len(series[0]) < 1000 else 50)
    words = zip(("lowest", "highest"), limited, strict=True)
    names = [None] if single else [word for word, used in words if used]
    for one, name, color in zip(series, names, COLORS, strict=False):
        look: dict[str, Any] = {"bins": edges, "color": color, "label": name, "alpha": 0.8}
        ax.hist(one, **(look | bins))
    for limit in share.limits:
        if math.isfinite(limit):
            ax.axvline(limit * scale, color="0.2", linestyle="--")
    ax.ticklabel_format(axis="x", useOffset=False)
    set_x_label(ax, with_unit(plain_words(share.specification.quantity), shown))
    ax.set_ylabel("mechanisms")
    ax.set_title(f"{share.outside or 'none'} of {share.runs} outside")
    if not single:
        ax.legend()
    return ax


@plot_of("Difference")
def plot_difference(
    difference: Difference, *, ax: Axes | None = None, unit: str | None = None, **bins: Any
) -> Axes:
    """Draw how the differences of a feature between two designs are spread, and where their median lies.

    Parameters
    ----------
    difference : Difference
        One of the features of what ``contrast`` returned.

    Examples
    --------
    >>> import chebclear as cc
    >>> def shaft(gap, thread):
    ...     return {"play": gap - thread}
    >>> wide, narrow = (
    ...     cc.Study(shaft, {"gap": cc.normal(10.1, s), "thread": cc.normal(10.0, 0.02)})
    ...     for s in (0.03, 0.01)
    ... )
    >>> ax = cc.plots.plot_difference(cc.contrast(wide, narrow)["play"])
    """
    scale, shown = shown_scale(ax, difference.unit, unit, along="x")
    ax = new_axes(ax)
    change = scale * (difference.second - difference.first)
    look: dict[str, Any] = {"bins": "auto" if len(change) < 1000 else 50, "color": COLORS[0], "alpha": 0.8}
    ax.hist(change, **(look | bins))
    ax.axvline(0.0, color="0.2", linewidth=0.8)
    ends = [scale * end for end in (difference.lower, difference.upper) if math.isfinite(end)]
    if ends:
        ax.axvspan(ends[0], ends[-1], color=COLORS[1], alpha=0.3, label="median, between")
        ax.legend()
    set_x_label(ax, with_unit(f"change of {plain_words(difference.name)}", shown))
    ax.set_ylabel("pairs of mechanisms")
    return ax


@plot_of("Identification")
def plot_identification(found: Identification, *, ax: Axes | None = None, **points: Any) -> Axes:
    """Draw the region of the first two parameters, or of the only one, in the box that was searched.

    Parameters
    ----------
    found : Identification
        What ``identify`` returned.

    Examples
    --------
    >>> import chebclear as cc
    >>> import numpy as np
    >>> t = np.linspace(0.0, 1.0, 101)
    >>> box = {"a": cc.Interval(1.0, 2.0), "b": cc.normal(0.0, 0.1)}
    >>> study = cc.Study(lambda a, b: {"t": t, "x": a * t + b}, box)
    >>> trace = cc.results.Measured({"x": 1.5 * t}, t=t)
    >>> ax = cc.plots.plot_identification(cc.identify(study, trace, ["a"], [cc.features.rms("x")]))
    """
    ax = new_axes(ax)
    names = list(found.intervals)[:2]
    columns, best = found.points.T[:2].copy(), [found.best[name] for name in names]
    for axis, name in enumerate(names):
        side = found.intervals[name]
        factor, unit = prefix_of(max(abs(side.lower), abs(side.upper)), found.units.get(name, ""))
        letter, label = "xy"[axis], typeset(with_unit(plain_words(name), unit))
        ax.set(**{f"{letter}lim": (factor * side.lower, factor * side.upper), f"{letter}label": label})
        columns[axis] *= factor
        best[axis] *= factor
    if len(names) == 1:
        columns, best = np.vstack([columns, np.zeros(columns.shape[1])]), [*best, 0.0]
        ax.set_yticks([])
    look: dict[str, Any] = {"color": COLORS[0], "linestyle": "", "marker": ".", "markersize": 4.0}
    label = f"region with {100.0 * found.confidence:g} % confidence"
    ax.plot(*columns, **(look | {"label": label} | points))
    ax.plot(
        *([value] for value in best), color=COLORS[4], linestyle="", marker="+", label="nearest to the trace"
    )
    ax.set_title(found.status.replace("_", " "))
    ax.legend(loc="upper right")
    return ax


def _bars_with_whiskers(ax: Axes, rows: list[tuple[str, Any, str]], bars: dict[str, Any]) -> None:
    """Bars of estimates in per cent from the top down, with their intervals and values."""
    set_row_names(ax, [name for name, _, _ in rows])
    for row, (_, estimate, color) in enumerate(rows):
        value, lower, upper = (100.0 * number for number in estimate)
        if math.isnan(value):
            _beside(ax, 0.0, row, "unknown", "left")
            continue
        style: dict[str, Any] = {"height": 0.6, "color": color} | bars
        ax.barh(row, value, **style)
        ax.plot((lower, upper), (row, row), color="0.2", linewidth=1.0, marker="|", markersize=7.0)
        _beside(ax, max(value, upper), row, f"{round(value) + 0:d} %", "left")
    known = [estimate for _, estimate, _ in rows if not math.isnan(estimate[0])]
    low = 100.0 * min((0.0, *(estimate[1] for estimate in known)))
    high = 100.0 * max((0.0, *(max(estimate[0], estimate[2]) for estimate in known)))
    room = _room(ax, ["100 %"])
    span = (high - low or 1.0) / (1.0 - room - 0.03)
    ax.set_xlim(low - (0.03 * span if low < 0.0 else 0.0), low + span * 0.97 if low < 0.0 else span)


def _beside(ax: Axes, place: float, row: float, text: str, side: str) -> None:
    """A value beside the end of a bar."""
    shift = (-5.0 if side == "right" else 5.0, 0.0)
    ax.annotate(
        typeset(text),
        (place, row),
        xytext=shift,
        textcoords="offset points",
        ha=side,
        va="center",
        fontsize="small",
    )
