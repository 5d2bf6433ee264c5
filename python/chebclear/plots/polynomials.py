"""Plots of the polynomials behind bands: how fast their coefficients decay, and how they predict runs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.tables import format_number
from ..errors import ArgumentError
from ..scene.columns import plain_words
from .axes import MARKERS, line_style, new_axes, unit_scale
from .labels import legend_above_the_data, plain_numbers, set_labels, with_unit, words_of
from .subjects import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..study.band.band import Band

Array = NDArray[np.float64]

# Points that a cloud of predictions has at most.
_MOST_POINTS = 20_000


def plot_coefficients(band: Band, *, ax: Axes | None = None, **line: Any) -> Axes:
    """Draw how the coefficients of the polynomial of a band decay with the degree, one line a parameter.

    If the response is smooth they fall by a factor from degree to degree, and the last ones have the size of
    the error of the polynomial. If they do not fall, no affordable degree resolves the response.

    Parameters
    ----------
    band : Band
        A band with a polynomial, from `Study.chebyshev`, say.
    ax : Axes, optional
        Where to draw; a new figure if not given.
    **line
        Passed to ``Axes.plot``.

    Returns
    -------
    Axes

    Raises
    ------
    ValueError
        If the band has no polynomial.

    Examples
    --------
    >>> import chebclear as cc
    >>> side = {"rod_length": cc.Interval.around(0.12, rel=0.01)}
    >>> study = cc.Study(cc.mechanisms.slider_crank, side, outputs=["slider.x"], duration=0.01, samples=21)
    >>> ax = cc.plots.plot_coefficients(study.chebyshev(degree=3)["slider.x"])
    """
    require("band", band, "Band")
    sizes = np.abs(band.coefficients).max(axis=-1)
    ax = new_axes(ax)
    for axis, name in enumerate(band.intervals):
        others = tuple(other for other in range(sizes.ndim) if other != axis)
        largest = sizes.max(axis=others)
        style = line_style(
            line, marker=MARKERS[axis % len(MARKERS)], markersize=5.0, linewidth=0.9, label=plain_words(name)
        )
        # A coefficient that is exactly zero has no place on a logarithmic axis.
        ax.plot(np.arange(len(largest)), np.where(largest > 0.0, largest, np.nan), **style)
    ax.set_yscale("log")
    plain_numbers(ax.yaxis)
    ax.set_xticks(range(max(sizes.shape)))
    what = f"largest coefficient of {words_of(band.name, band.unit)} over time"
    set_labels(ax, "degree in the parameter [-]", with_unit(what, band.unit))
    legend_above_the_data(ax)
    return ax


def plot_prediction(
    band: Band,
    holdout: Band,
    *,
    ax: Axes | None = None,
    unit: str | None = None,
    **points: Any,
) -> Axes:
    """Draw what the polynomial of a band predicts for runs that it was not fitted to, against those runs.

    Points on the diagonal are predicted exactly. The legend has the largest error over the range of the runs.

    Parameters
    ----------
    band : Band
        A band with a polynomial.
    holdout : Band
        The same output in other runs of the same parameters, of `Study.scan` or `Study.band`, say.
    ax : Axes, optional
        Where to draw; a new figure if not given.
    unit : str, optional
        Unit to show; SI if not given.
    **points
        Passed to ``Axes.plot``.

    Returns
    -------
    Axes

    Raises
    ------
    ValueError
        If the band has no polynomial, or the runs are of another output, instants or parameters.

    Examples
    --------
    >>> import chebclear as cc
    >>> side = {"rod_length": cc.Interval.around(0.12, rel=0.01)}
    >>> study = cc.Study(cc.mechanisms.slider_crank, side, outputs=["slider.x"], duration=0.01, samples=21)
    >>> ax = cc.plots.plot_prediction(study.chebyshev(degree=2)["slider.x"], study.scan(5)["slider.x"])
    """
    require("band", band, "Band")
    require("holdout", holdout, "Band")
    if (
        holdout.name != band.name
        or holdout.t.shape != band.t.shape
        or list(holdout.intervals) != list(band.intervals)
    ):
        raise ArgumentError(
            f"holdout must have runs of {band.name} at the same instants and over the same parameters"
        )
    scale, shown = unit_scale(band.unit, unit)
    given = dict(zip(band.intervals, holdout.parameters.T, strict=True))
    predicted, simulated = scale * band.evaluate(**given).ravel(), scale * holdout.runs.ravel()
    error, reach = float(np.abs(predicted - simulated).max()), float(np.ptp(simulated))
    chosen = slice(None, None, -(-predicted.size // _MOST_POINTS))
    ax = new_axes(ax)
    count = len(holdout.runs)
    share = error / reach if reach else 0.0
    size = "below 0.01 %" if share < 1e-4 else f"{format_number(100.0 * share, 2)} %"
    label = f"{count} runs, largest error {size} of their range"
    style = line_style(
        points, marker=".", markersize=3.0, linestyle="none", alpha=0.4, rasterized=True, label=label
    )
    ax.plot(simulated[chosen], predicted[chosen], **style)
    ends = np.array([min(simulated.min(), predicted.min()), max(simulated.max(), predicted.max())])
    ax.plot(ends, ends, color="black", linewidth=0.8, linestyle="--", label="exact")
    what = with_unit(words_of(band.name, band.unit), shown)
    set_labels(ax, f"simulated {what}", f"predicted {what}")
    legend_above_the_data(ax)
    return ax
