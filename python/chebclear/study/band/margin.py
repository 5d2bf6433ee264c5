"""How a band was made, the margin by which it exceeds its runs, and doubts about its polynomial."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ...base.files import ArrayRecord
from ...base.rows import Array
from ...base.units import unit
from ..polynomials.holes import left_out_error
from ..polynomials.points import SAME_POINT, on_cube
from ..polynomials.surrogate import Surrogate, chebyshev_grid, time_blocks

Method = Literal["polynomial", "envelope", "runs"]

# Largest error of a polynomial that resolves an output, over the width of the runs. Of 150
# features (five functions, 12 to 161 runs) 53 are resolved, 14 of which go beyond the range stated, near a
# pole by up to 27 %; with half of it 44 and 8, with twice 66 and 19.
RESOLVED = 0.05
# Residual at an instant that is told, over the width: twice that error. Resolved positions, velocities and
# accelerations of slider-cranks, with and without clearance, have no such instant; a step of a single
# sample has.
_FAR_OFF = 2.0 * RESOLVED
# The same for nodes of a grid that are predicted from the others, whose errors are several times those of the
# polynomial itself.
_FAR_OFF_LEFT_OUT = 5.0 * RESOLVED
# Error of slopes near the boundaries of the box that is told, over the width divided by the interval.
_STEEP = 0.25


@dataclass(frozen=True, eq=False)
class Margin(ArrayRecord):
    """Method of a band, and the margin by which it exceeds its runs.

    Attributes
    ----------
    method : Literal['polynomial', 'envelope', 'runs']
        The range of a polynomial in the parameters with its largest error at runs it was not fitted to;
        running extremes of the runs in time, widened; or the extremes of the runs alone.
    degree : int | None
        Degree of the polynomial [-], the largest of all parameters; None without one.
    error : float
        Largest error of the polynomial at runs it was not fitted to, over the width of the hull, both
        averaged over time [-]; NaN without such a run.
    window : float
        Half-length of the window of the running extremes [s]; the mean if several were averaged.
    inflation : float
        Widening of the band to either side, in local spreads of the runs [-].
    checks : int
        Runs that were left out together, and the polynomial made of the others by the same rule [-].
    check_error : float
        Its largest error at these, over the width of the hull of the others, both averaged over time [-];
        infinite if no polynomial follows the others, NaN if there was no check.
    persistence : float
        Clustering of exceedances, the larger of two shares [-]: of the samples for which a held-out run that
        leaves the band of the others, before that is widened, stays outside; and of those for which a run
        stays furthest from what a polynomial explains. Near 1 runs differ for all of their time.
    """

    method: Method
    degree: int | None = None
    error: float = math.nan
    window: float = field(default=0.0, metadata=unit("s"))
    inflation: float = 0.0
    checks: int = 0
    check_error: float = field(default=math.nan, repr=False)
    persistence: float = 0.0


def percent(share: float) -> str:
    """A share of what was inside, in words; never rounded up to what was asked for."""
    return "-" if math.isnan(share) else f"{math.floor(1e4 * share + 1e-9) / 1e2:g} %"


def far_off(surrogate: Surrogate, points: Array, runs: Array, hull: tuple[Array, Array]) -> Array:
    """Residual of a polynomial at runs over the width of their hull, 0 where it is small, shape (samples,).

    A polynomial with as many terms as nodes of a grid, whose runs come first, passes through all of them:
    their errors when they are left out count instead. Where the hull is narrow its mean width counts.
    """
    width = hull[1] - hull[0]
    width = np.maximum(width, np.mean(width))
    nodes = [degree + 1 for degree in surrogate.degrees]
    count = math.prod(nodes) if _on_grid(surrogate, nodes, points) else 0
    others = dict(zip(surrogate.intervals, points[count:].T, strict=True))
    off, left_out = np.zeros((2, len(width)))
    for block in time_blocks(*runs.shape):
        if count:
            left_out[block] = left_out_error(surrogate.degrees, nodes, runs[:count, block])
        part = replace(surrogate, terms=np.ascontiguousarray(surrogate.terms[:, block]))
        off[block] = np.max(np.abs(part.evaluate(others) - runs[count:, block]), axis=0, initial=0.0)
    found = np.zeros(len(width))
    for misses, least in ((off, _FAR_OFF), (left_out, _FAR_OFF_LEFT_OUT)):
        relative = np.divide(misses, width, out=np.zeros_like(misses), where=width > 0.0)
        found = np.maximum(found, np.where(relative > least, relative, 0.0))
    return found


def _on_grid(surrogate: Surrogate, nodes: list[int], points: Array) -> bool:
    """Whether the first points are the Chebyshev grid of so many nodes."""
    # Counted first: the grid of a polynomial of many parameters is large.
    if len(points) < math.prod(nodes):
        return False
    grid = chebyshev_grid(list(surrogate.intervals.values()), nodes)
    own, wanted = (on_cube(surrogate.intervals, each) for each in (points[: len(grid)], grid))
    return bool(np.max(np.abs(own - wanted)) < SAME_POINT)


def doubt_of(name: str, what: str, t: Array, off: Array | None) -> str:
    """Warning that a polynomial is not the response, at the instants where it is `far_off` or, without these,
    at all; empty if it is."""
    if off is None:
        return (
            f"{name} is not resolved: runs failed, or its polynomial does not predict runs that it was not "
            f"made from, so that {what} of it is not that of the response. Use features of the runs, or "
            "bands of all runs (kind band), instead"
        )
    if not off.any():
        return ""
    return (
        f"{name}: at {np.count_nonzero(off)} of {len(t)} instants, such as t = {t[np.argmax(off)]:.6g} s, "
        f"the polynomial is off by up to {100.0 * off.max():.3g} % of the width, though not on average: "
        f"{what} there is not that of the response. Use features of the runs instead"
    )


def slope_doubt(name: str, margin: Margin) -> str:
    """Warning that slopes of a polynomial are much less certain than its values; empty if they are not.

    A polynomial of degree d and size e has slopes of up to d e in the middle of [-1, 1] (Bernstein) and
    d² e at its ends (Markov). Of 394 resolved polynomials in 1 to 3 parameters (sines, exponentials,
    rational functions, kinks, steps; 9 to 81 runs) the slope with the largest error had 0.5 of the latter in
    the median and 1.5 in nine of ten; those at the midpoint had 0.1 and 0.4 of the former.
    """
    ends = (margin.degree or 0) ** 2 * margin.error
    if not ends > _STEEP:
        return ""
    return (
        f"{name}: slopes of a polynomial of degree {margin.degree} with an error of "
        f"{100.0 * margin.error:.2g} % may be wrong by some {100.0 * ends:.2g} % of the width per interval "
        "near the boundaries of the box, and are better in the middle: more runs reduce the error"
    )


def effect_doubt(name: str, parameter: str) -> str:
    """Warning that the largest slopes change an output over the interval by less than its error."""
    return (
        f"{name}: what {parameter} does is below the error of the polynomial, whose sensitivity to it is not "
        "that of the response: more runs reduce the error, a larger interval enlarges the effect"
    )
