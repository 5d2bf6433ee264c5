"""Bifurcation diagrams: samples of a steady motion over a parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.arguments import Checks
from ..scene.columns import column_unit, column_words, plain_words
from .axes import distinct_colors, line_style, new_axes, unit_scale
from .labels import set_labels, with_unit
from .subjects import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..study.bifurcation import Bifurcation


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
    ax : Axes, optional
        Where to draw; a new figure if not given.
    unit : str, optional
        Unit of the output to show, such as ``"µm"``; SI if not given.
    parameter_unit : str
        Unit of the parameter, for the label.
    parameter_scale : float
        What one SI unit of the parameter is in that unit [-].
    **points
        Passed to ``Axes.plot``.

    Returns
    -------
    Axes

    Examples
    --------
    >>> import chebclear as cc
    >>> diagram = cc.bifurcation(cc.mechanisms.slider_crank, "clearance", [2e-5, 5e-5], periods=3, discard=1)
    >>> ax = cc.plots.plot_bifurcation(diagram)
    """
    require("diagram", diagram, "Bifurcation")
    checks = Checks()
    parameter_scale = checks.real("parameter_scale", parameter_scale, "-", above=0.0)
    checks.finish()
    scale, shown = unit_scale(column_unit(diagram.output), unit)
    ax = new_axes(ax)
    distinct_colors(ax)
    count = diagram.samples.shape[1]
    # Points lie on each other where the motion repeats itself: they are drawn lightly where there are many.
    many = diagram.samples.size > 3000
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
