"""Error estimate of a polynomial from the runs of its fit alone, and the verdict on its band."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ...run.notices import Notice
from ..polynomials.holes import HoleFit
from ..polynomials.left_out import left_out_error
from ..polynomials.surrogate import Surrogate, time_blocks
from .band import Band
from .margin import RESOLVED, Margin, Verdict

Array = NDArray[np.float64]

SETTLING = "settling"
"""Code of the notices of bands that are widest in the starting transient."""


def fit_error(surrogate: Surrogate, nodes: Sequence[int], grid: Array, others: Array, at: Array) -> Array:
    """Estimated error of a polynomial that was fitted on Chebyshev roots, for every instant.

    Along each axis in turn, the node of every line is predicted from the others of the line by the polynomial
    of the highest degree that they determine, one less than the fitted one if that interpolates. The fit is
    made for each line separately, because other lines at the same value of the parameter contain information
    about the node. The estimate is the largest of: the prediction errors; half of those with one degree less
    again, because the highest coefficient of a response with a kink may vanish by chance; and the errors at
    the runs that are no nodes, where waves show that the nodes do not see. With two nodes a line cannot be
    distinguished from a curve: all changes along such an axis count as error.

    Compared with 160 random runs and the corners, on slider-cranks, a four-bar and a toggle press with and
    without clearance at degrees 2 to 16, the time mean of this estimate was never below the largest error.
    Where that was above 1e-3 of the width it was 1.1 to 15 times as large, with the larger factors at high
    degrees, since the outermost nodes are extrapolated.

    Parameters
    ----------
    surrogate : Surrogate
        The polynomial.
    nodes : sequence of int
        Number of roots of each parameter [-].
    grid : ndarray, shape (nodes, samples)
        Values to which it was fitted.
    others : ndarray, shape (others, samples)
        Values of all other runs, the nominal one too.
    at : ndarray, shape (others, parameters)
        Their parameters [SI units].

    Returns
    -------
    ndarray, shape (samples,)
        In the unit of the output.
    """
    found = surrogate.evaluate(dict(zip(surrogate.intervals, at.T, strict=True)))
    error: Array = np.abs(found - others).max(axis=0)
    for block in time_blocks(*grid.shape):
        error[block] = np.maximum(error[block], left_out_error(surrogate.degrees, nodes, grid[:, block]))
    return error


def judged(
    surrogate: Surrogate | None,
    nodes: Sequence[int],
    grid: Array,
    others: Array,
    at: Array,
    width: float,
    holes: HoleFit | None = None,
    unknown: float = 0.0,
) -> tuple[Verdict, Margin]:
    """Verdict on a band and its margin, from the runs of its grid, the others, and their mean width.

    What is `unknown` of the box, a share of the runs, counts like what is not known of the width.

    Missing runs are replaced by values that follow from the others, which tell nothing of the error: known
    runs are left out of the least squares instead. The error at the missing runs is assumed to be larger by
    the condition number of the least squares.
    """
    if surrogate is None:
        return "sampled", Margin("runs")
    errors = fit_error(surrogate, nodes, grid, others, at)
    if holes is not None:
        left_out = holes.left_out(grid[holes.known])
        errors = holes.condition * np.maximum(errors, left_out.max(axis=0))
    miss = float(np.mean(errors))
    # Rounding errors of the runs must not count for a constant output.
    noise = 1e-12 * float(max(np.max(grid, initial=0.0), -np.min(grid, initial=0.0)))
    error = 0.0 if miss <= noise else miss / width if width > 0.0 else math.inf
    verdict: Verdict = "resolved" if max(error, unknown) <= RESOLVED else "not resolved"
    return verdict, Margin("polynomial", degree=max(surrogate.degrees), error=error)


def told_holes(holes: HoleFit) -> list[Notice]:
    """Notice that polynomials were fitted to fewer runs than the grid has."""
    count = len(holes.missing) + len(holes.known)
    without = f"without {holes.dropped.sum()} of {len(holes.dropped)} terms, those of the highest degree, "
    text = (
        f"holes: the polynomials are fitted by least squares to {len(holes.known)} of {count} runs, "
        f"{without if holes.dropped.any() else ''}with the condition number {holes.condition:.3g}: at the "
        "missing runs they are not checked"
    )
    numbers = {"runs": len(holes.missing), "of_runs": count, "condition": holes.condition}
    return [Notice("holes", text, numbers=numbers)]


def early_widths(bands: Mapping[str, Band], settled: float) -> list[Notice]:
    """One notice for all bands that are widest before an instant [s] by which the starting transient has
    decayed.

    Bands that end before it are left out.
    """
    early = [
        name
        for name, band in bands.items()
        if band.t[int(np.argmax(band.width))] < settled < band.t[-1] and band.max_width > 0.0
    ]
    if not early:
        return []
    text = (
        f"settling: {', '.join(early)}: the band is widest in the first revolution, in the starting "
        f"transient; skip {settled:.4g} s to leave it out"
    )
    return [Notice(SETTLING, text, tuple(early), {"settled": settled})]


def doubts(bands: Mapping[str, Band]) -> list[Notice]:
    """Notices of the outputs that no polynomial follows, or not in all of the box."""
    lost = {
        name: band.margin.error
        for name, band in bands.items()
        if band.surrogate is not None and band.verdict == "not resolved"
    }
    unseen = [name for name, error in lost.items() if error <= RESOLVED]
    found = []
    if unseen:
        text = (
            f"not resolved: {', '.join(unseen)}: more than {100.0 * RESOLVED:g} % of the runs failed, and "
            "where they did the polynomial is not checked: ask for a box in which runs succeed"
        )
        found.append(Notice("not_resolved", text, tuple(unseen)))
    errors = [100.0 * error for error in lost.values() if error > RESOLVED]
    if not errors:
        return found
    others = tuple(name for name in lost if name not in unseen)
    names = ", ".join(others)
    least, most = f"{min(errors):.3g}", f"{max(errors):.3g}"
    size = f"is {most} %" if least == most else f"is {least} to {most} %"
    told = f"{size} of the width of the band" if math.isfinite(max(errors)) else "cannot be told from so few"
    text = (
        f"not resolved: {names}: the error of the polynomial at left-out runs {told}. The "
        "response may leave its bounds, and neither worst case nor sensitivity is that of the response. A "
        "higher degree helps where the response is smooth; where impacts scatter, "
        "use bands of all runs (kind band) and features instead"
    )
    return [*found, Notice("not_resolved", text, others, {"error": 0.01 * max(errors)})]
