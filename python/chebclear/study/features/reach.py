"""How far a feature reaches over the box."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ... import _core
from ...base.files import ArrayRecord
from ...base.rows import Array
from ...scene.columns import Limits
from ..band.margin import RESOLVED
from ..band.requirement import tolerated_share
from ..band.sure import Flag, HowSure
from .effects import Fit, best_degree, fits_of, left_out

# Number of folds of the cross-validation: the share of runs in the interval made from the others.
_FOLDS = 10


@dataclass(frozen=True, eq=False, repr=False)
class FeatureInterval(ArrayRecord):
    """The range of a feature over the box.

    Attributes
    ----------
    lower : float
        Lower end in the unit of the feature.
    upper : float
        Upper end in the unit of the feature.
    verdict : Flag
        How sure it is, in one of four words: the flag of `sure`.
    resolved : bool
        Whether it is the range of a polynomial in the parameters that follows the feature, with its error;
        else these are the extremes of the runs.
    coverage : float
        Share of further runs that are in the interval with all their cycles, estimated by runs that were left
        out in ten parts, with one miss more than these have [-].
    whole_run : float
        Probability that a further run at random parameters is in the interval with all its cycles, without
        further assumption [-]; NaN for runs on a grid.
    tolerated : float
        Share of all mechanisms that are in the interval with all their cycles, at least, with 95 % confidence
        (Wilks 1941) [-]; NaN for runs on a grid.
    runs : int
        Runs that it rests on [-].
    """

    lower: float
    upper: float
    verdict: Flag
    resolved: bool
    coverage: float
    whole_run: float
    tolerated: float
    runs: int

    @property
    def sure(self) -> HowSure:
        """How sure the interval is; ``str`` says it in a sentence."""
        share = self.coverage if self.resolved else self.whole_run
        return HowSure(self.verdict, share, math.nan, math.nan, self.runs, over_time=False)


def find_intervals(
    points: Array,
    values: Array,
    limits: Sequence[Limits],
    random: bool,
    filled: bool,
    all_fits: list[Fit],
    failed: int = 0,
) -> list[FeatureInterval]:
    """The intervals of features from their values, shape (runs + 1, cycles, features), and limits, at points
    of [-1, 1]^k, and from the polynomials that all points allow.

    The nominal run is the last; the others may be spread at `random` over the box. It is `filled` if none
    have failed and the points leave out no part of it: else no polynomial is extrapolated. Runs that `failed`
    count as outside.
    """
    runs, features = len(values) - 1, [values[:, :, column] for column in range(values.shape[2])]
    folds = np.append(np.arange(runs) % _FOLDS, _FOLDS)  # the nominal run is never left out
    inside = np.zeros(len(features), dtype=int)
    for fold in range(min(_FOLDS, runs)):
        out = folds == fold
        fits = fits_of(points[~out]) if filled else []
        for column, (own, ends) in enumerate(zip(features, limits, strict=True)):
            low, high, _ = find_reach(points[~out], own[~out], ends, filled, fits)
            inside[column] += np.count_nonzero(np.all((own[out] >= low) & (own[out] <= high), axis=1))
    found, of = [], runs + failed + 1
    for own, ends, count in zip(features, limits, inside.tolist(), strict=True):
        lower, upper, resolved = find_reach(points, own, ends, filled, all_fits)
        found.append(
            FeatureInterval(
                lower=lower,
                upper=upper,
                verdict="estimated" if resolved or random else "unknown",
                resolved=resolved,
                coverage=count / of,
                whole_run=(runs - 1) / of if random else math.nan,
                tolerated=tolerated_share(runs, failed=failed) if random else math.nan,
                runs=runs,
            )
        )
    return found


def find_reach(
    points: Array, values: Array, limits: Limits, filled: bool, fits: list[Fit]
) -> tuple[float, float, bool]:
    """Lower and upper end from some runs, and whether a polynomial follows them in the whole box.

    The rule is that of bands: the error of the polynomial at a run that it was made without counts against
    the width that the other runs make. It does not go beyond the `limits` of the feature.
    """
    lower, upper = float(values.min()), float(values.max())
    if upper == lower or not filled:
        return lower, upper, filled and upper == lower
    mean = values.mean(axis=1)
    degree = best_degree(fits, mean)
    if degree == 0:
        return lower, upper, False
    misses = np.abs(left_out(fits[degree], mean)) + np.abs(values - mean[:, None]).max(axis=1)
    others, error = np.delete(values, np.argmax(misses), axis=0), float(misses.max())
    if error > RESOLVED * float(np.ptp(others)):
        return lower, upper, False
    terms = np.linalg.lstsq(_core.total_degree_basis(points, degree), mean)[0]
    found = _core.total_degree_ranges(terms[:, None], points.shape[1], degree, None)
    lowest, highest = float(found["lower"][0]), float(found["upper"][0])
    least, most = limits
    return min(lower, max(lowest - error, least)), max(upper, min(highest + error, most)), True
