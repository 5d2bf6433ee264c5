"""Steady motions over a parameter: bifurcation diagrams, features of the revolutions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.arguments import Checks
from ..scene.columns import column_unit, column_words, plain_words
from .axes import COLORS, MOST_VECTORS, line_style, new_axes, plot_of, shown_scale
from .labels import set_labels, typeset, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..study.bifurcation import Bifurcation
    from ..study.sweep import Sweep


@plot_of("Bifurcation")
def plot_bifurcation(
    diagram: Bifurcation,
    *,
    ax: Axes | None = None,
    unit: str | None = None,
    parameter_unit: str = "",
    parameter_scale: float = 1.0,
    **points: Any,
) -> Axes:
    """Draw a bifurcation diagram: all samples of every value of the parameter as points.

    Parameters
    ----------
    diagram : Bifurcation
        What `bifurcation` returned.
    parameter_unit : str
        Unit of the parameter, for the label.
    parameter_scale : float
        What one SI unit of the parameter is in that unit [-].

    Examples
    --------
    >>> import chebclear as cc
    >>> diagram = cc.bifurcation(cc.mechanisms.slider_crank, "clearance", [2e-5, 5e-5], periods=3, discard=1)
    >>> ax = cc.plots.plot_bifurcation(diagram)
    """
    checks = Checks()
    parameter_scale = checks.real("parameter_scale", parameter_scale, "-", above=0.0)
    checks.finish()
    scale, shown = shown_scale(ax, column_unit(diagram.output), unit)
    ax = new_axes(ax)
    count = diagram.samples.shape[1]
    # Points lie on each other where the motion repeats itself: they are drawn lightly where there are many.
    many = diagram.samples.size > MOST_VECTORS
    style = line_style(
        points,
        marker=".",
        markersize=1.5 if many else 3.0,
        alpha=0.5 if many else 0.8,
        linestyle="none",
        markeredgewidth=0.0,
        rasterized=many,
    )
    ax.plot(np.repeat(parameter_scale * diagram.values, count), scale * diagram.samples.ravel(), **style)
    ordinate = with_unit(f"{column_words(diagram.output)}, once a period", shown)
    set_labels(ax, with_unit(plain_words(diagram.parameter), parameter_unit), ordinate)
    return ax


@plot_of("Sweep")
def plot_sweep(
    sweep: Sweep,
    feature: str,
    *,
    ax: Axes | None = None,
    unit: str | None = None,
    parameter_unit: str | None = None,
    parameter_scale: float = 1.0,
    **line: Any,
) -> Axes:
    """Draw a feature of the revolutions over a parameter: mean, 5 to 95 %, resonances, and lift-off.

    Parameters
    ----------
    sweep : Sweep
        What `Study.sweep` returned.
    feature : str
        Name of the feature.
    parameter_unit : str, optional
        Unit of the parameter, for the label; SI if not given.
    parameter_scale : float
        What one SI unit of the parameter is in that unit [-].

    Examples
    --------
    >>> import chebclear as cc
    >>> box = {"crank_length": cc.Interval.around(0.05, rel=0.01)}
    >>> stroke = {"stroke": cc.features.peak_to_peak("slider.x")}
    >>> study = cc.Study(cc.mechanisms.slider_crank, box, features=stroke, duration=1.0, samples=2)
    >>> sweep = study.sweep("crank_speed", "60 rpm", "600 rpm", 3, revolutions=8, discard=0)
    >>> ax = cc.plots.plot_sweep(sweep, "stroke", unit="mm")
    """
    checks = Checks()
    parameter_scale = checks.real("parameter_scale", parameter_scale, "-", above=0.0)
    checks.finish()
    values = sweep[feature]
    scale, shown = shown_scale(ax, sweep.units[feature], unit)
    ax = new_axes(ax)
    at, ends = parameter_scale * sweep.points, scale * np.quantile(values, (0.05, 0.95), axis=1)
    ax.plot(at, scale * values.mean(axis=1), **line_style(line, label="mean"))
    ax.fill_between(at, *ends, alpha=0.3, linewidth=0.0, label="5 to 95 % of the revolutions")
    for k, peak in enumerate(sweep.resonances(feature)):
        look: dict[str, Any] = {"color": COLORS[1], "linestyle": ":", "label": None if k else "resonance"}
        ax.axvline(parameter_scale * peak.at, **look)
    for k, joint in enumerate(dict.fromkeys(one.joint for one in sweep.lift_offs)):
        for n, one in enumerate(one for one in sweep.lift_offs if one.joint == joint):
            label = None if n else typeset(f"lift-off in {plain_words(joint)}")
            color = COLORS[(2 + k) % len(COLORS)]
            ax.axvspan(
                parameter_scale * one.lower, parameter_scale * one.upper, color=color, alpha=0.4, label=label
            )
    ax.legend()
    abscissa = with_unit(plain_words(sweep.parameter), parameter_unit or sweep.parameter_unit)
    set_labels(ax, abscissa, with_unit(f"{plain_words(feature)}, of a revolution", shown))
    return ax
