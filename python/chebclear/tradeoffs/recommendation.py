"""Recommended setting of a trade-off: the cheapest one that is accurate enough, or none."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ..base import files as records
from ..base.arguments import Checks
from ..base.prefixes import format_exact, format_quantity
from ..base.rows import Array
from ..base.shown import did_you_mean, spoken
from ..base.tables import format_number
from ..base.units import unit
from ..run.trajectory import Stats
from ..scene.columns import column_unit

if TYPE_CHECKING:
    from .result import Tradeoff

MOST_ACCURACY = 1.0
"""Largest error that may be requested, relative to the range of an output [-]."""
COSTS = ("seconds", "steps", "stages", "evaluations")
# Ratio of times that count as equal; best times of two runs scatter by as much.
_LEVEL = 1.1
# Least ratio of the requested accuracy to the uncertainty of the reference.
_MARGIN = 4.0
# Least uncertainty relative to the range of an output: two runs may agree to the last bit, as in free flight
# before the first impact, although their rounding errors are of this size.
_ROUNDING = 1e-14


@dataclass(frozen=True, eq=False, repr=False)
class TradeoffPoint(records.ArrayRecord):
    """Cost and accuracy of one method at one tolerance.

    Attributes
    ----------
    method : str
        Integrator.
    rtol : float
        Relative tolerance of the integrator [-].
    status : str
        ``"done"``, or the word for why the run ended early.
    end_time : float
        Where the run ended [s].
    stats : Stats
        What the run cost, in counts that do not depend on the machine.
    seconds : float
        What the run cost on this machine, the best of the repeats [s].
    horizon : Array
        First sample that is off the reference by more than 1 % of the range [s], shape (outputs,).
    growth : Array
        Largest difference from the reference up to each instant in the unit of the output. The shape is
        (outputs, instants); NaN after the end of a run that failed.
    """

    method: str
    rtol: float
    status: str
    end_time: float = field(metadata=unit("s"))
    stats: Stats
    seconds: float = field(metadata=unit("s"))
    horizon: Array = field(metadata=unit("s"))
    growth: Array

    @property
    def success(self) -> bool:
        """Whether the run reached its end."""
        return self.status == "done"


@dataclass(frozen=True, eq=False, repr=False)
class Recommendation(records.ArrayRecord):
    """The cheapest setting that is accurate enough; its ``str`` is one line.

    Attributes
    ----------
    point : TradeoffPoint | None
        The setting; None if none of those measured is accurate enough.
    until : float
        End of the time over which the errors hold [s].
    cost : str
        The quantity to minimize, such as ``"seconds"``.
    limits : dict[str, float]
        Largest admissible error of each output in its unit; infinite for a constant one.
    errors : dict[str, float]
        Bound of the error of each output in its unit: that of the setting, or of the most accurate one.
    text : str
        One line.
    """

    point: TradeoffPoint | None
    until: float = field(metadata=unit("s"))
    cost: str
    limits: dict[str, float]
    errors: dict[str, float]
    text: str

    def __repr__(self) -> str:
        return spoken(self)

    def __str__(self) -> str:
        return self.text


def largest_error(t: Array, growth: Array, until: float | None) -> Array:
    """Largest difference of each output from the reference up to a time [s]; up to the end if it is None.

    From those up to the instants t, shape (outputs, instants): between two the later one counts. NaN if the
    run ended before.
    """
    # A time that was computed may lie past its instant by rounding.
    index = len(t) - 1 if until is None else int(np.searchsorted(t, until * (1.0 - 1e-12)))
    return growth[:, min(index, len(t) - 1)]


def power(number: float) -> str:
    """A positive number in the usual form of tolerances.

    >>> power(1e-3), power(2.5e-10), power(0.02)
    ('1e-3', '2.5e-10', '2e-2')
    """
    if not math.isfinite(number):
        return f"{number:g}"
    digits, exponent = f"{number:.3e}".split("e")
    return f"{float(digits):g}e{int(exponent)}"


# Long because its cases exclude each other one after the other.
def recommendation(
    result: Tradeoff, accuracy: float | Mapping[str, float], *, until: float | None, cost: str
) -> Recommendation:
    """The cheapest setting that is accurate enough; see `Tradeoff.recommendation`."""
    checks = Checks()
    limits = _checked_limits(checks, result, accuracy)
    checks.word("cost", cost, COSTS)
    if until is not None:
        until = checks.real("until", until, "s", above=float(result.t[0]), most=result.end * (1.0 + 1e-12))
    checks.finish()
    bound = np.array([limits[name] for name in result.outputs])

    known = np.all(_MARGIN * _with_rounding(result, result.check.growth) <= bound[:, None], axis=0)
    # Largest differences up to an instant never decrease, so the known part begins at the start.
    trusted = float(result.t[np.count_nonzero(known) - 1]) if known[0] else float(result.t[0])
    span = trusted if until is None else until
    uncertain = _uncertainty(result, span)

    def errors(point: TradeoffPoint) -> Array:
        return largest_error(result.t, point.growth, span) + uncertain

    def answer(point: TradeoffPoint | None, shown: Array, text: str) -> Recommendation:
        by_name = dict(zip(result.outputs, map(float, shown), strict=True))
        return Recommendation(point, span, cost, limits, by_name, text)

    if span <= result.t[0] or not np.all(uncertain <= bound):
        if span <= result.t[0]:  # not known well enough at any time: report how well it is known at all
            span = result.end
            uncertain = _uncertainty(result, span)
        text = (
            f"no setting: over {_span(result, span)} the reference itself is known "
            f"only with {_amount(result, uncertain, bound)}"
        )
        if until is not None and trusted > result.t[0]:
            text += f"; ask for at most {format_exact(trusted, 's')}"
        return answer(None, uncertain, text)

    good = _settings_within(result, bound, span)
    if good:
        best = _cheapest(good, cost)
        seconds = format_quantity(best.seconds, "s", 2)
        price = seconds if cost == "seconds" else f"{_cost(best, cost):.0f} {cost}"
        text = (
            f"rtol {power(best.rtol)} with {best.method}: {_amount(result, errors(best), bound)} over "
            f"{_span(result, span)}, {price} a run"
        )
        diverged = float(best.horizon[np.isfinite(bound)].min(initial=math.inf))
        if diverged <= span:
            text += f", but with errors above 1 % of a range from {format_exact(diverged, 's')} on"
        if until is None and span < result.end:
            text += "; beyond, the reference itself is not known well enough"
        return answer(best, errors(best), text)

    finished = [point for point in result.points if np.all(np.isfinite(errors(point)))]
    if not finished:
        return answer(
            None, np.full(len(bound), math.nan), f"no setting: no run reached {format_exact(span, 's')}"
        )
    closest = min(finished, key=lambda point: float(np.max(errors(point) / bound)))
    shown = errors(closest)
    text = (
        f"no setting measured is accurate enough over {_span(result, span)}; the nearest, rtol "
        f"{power(closest.rtol)} with {closest.method}, has {_amount(result, shown, bound)}"
    )
    if np.all(shown <= bound):
        text += ", but a smaller tolerance of the same method does not: that is chance"
    return answer(None, shown, text)


def _settings_within(result: Tradeoff, bound: Array, span: float) -> list[TradeoffPoint]:
    """Settings that satisfy the bound with every finished smaller tolerance of their method."""
    uncertain = _uncertainty(result, span)
    good: list[TradeoffPoint] = []
    for method in dict.fromkeys(point.method for point in result.points):
        of_method = [point for point in result.points if point.method == method]
        for point in sorted(of_method, key=lambda point: point.rtol):
            errors = largest_error(result.t, point.growth, span) + uncertain
            if np.all(errors <= bound):
                # A run that failed later on is no setting to recommend.
                good += [point] if point.success else []
            elif np.all(np.isfinite(errors)):
                break
    return good


def _uncertainty(result: Tradeoff, span: float) -> Array:
    """How well the reference is known up to a time, in the units of the outputs."""
    return _with_rounding(result, largest_error(result.t, result.check.growth, span)[:, None])[:, 0]


def _with_rounding(result: Tradeoff, growth: Array) -> Array:
    """Differences of the two tight runs, shape (outputs, instants), at least what rounding leaves."""
    return np.maximum(growth, _ROUNDING * result.ranges[:, None])


def _checked_limits(
    checks: Checks, result: Tradeoff, accuracy: float | Mapping[str, float]
) -> dict[str, float]:
    """Largest admissible error of every output in its unit."""
    if not isinstance(accuracy, Mapping):
        # Every run has an error below the range of the motion, so a larger limit is refused.
        part = checks.real("accuracy", accuracy, "-", above=0.0, most=MOST_ACCURACY)
        scales = zip(result.outputs, result.ranges, strict=True)
        return {name: float(part * scale) if scale > 0.0 else math.inf for name, scale in scales}
    limits = dict.fromkeys(result.outputs, math.inf)
    if not accuracy:
        checks.add("accuracy", "must name at least one output")
    for name, value in accuracy.items():
        if name not in limits:
            checks.add("accuracy", f'has the unknown output "{name}"{did_you_mean(name, limits)}')
        else:
            span = float(result.ranges[result.outputs.index(name)])
            most = MOST_ACCURACY * span if span > 0.0 else None
            limits[name] = checks.real(f'accuracy["{name}"]', value, column_unit(name), above=0.0, most=most)
    return limits


def _cheapest(points: list[TradeoffPoint], cost: str) -> TradeoffPoint:
    """The cheapest setting; ``"auto"`` if it costs the same, since it is safe where contacts stick."""
    level = _LEVEL if cost == "seconds" else 1.0
    cheapest = min(points, key=lambda point: (_cost(point, cost), point.rtol))
    auto = [point for point in points if point.method == "auto"]
    best = min(auto, key=lambda point: (_cost(point, cost), point.rtol), default=cheapest)
    return best if _cost(best, cost) <= level * _cost(cheapest, cost) else cheapest


def _cost(point: TradeoffPoint, cost: str) -> float:
    return point.seconds if cost == "seconds" else float(getattr(point.stats, cost))


def _span(result: Tradeoff, span: float) -> str:
    """A part of the time in words; what was skipped does not count."""
    covered = span - float(result.t[0])
    whole = covered >= result.duration * (1.0 - 1e-9)
    return f"all {format_exact(result.duration, 's')}" if whole else f"the first {format_exact(covered, 's')}"


def _amount(result: Tradeoff, errors: Array, bound: Array) -> str:
    """The error of the output that is nearest to its limit or furthest beyond."""
    index = int(np.argmax(np.where(np.isfinite(errors), errors, math.inf) / bound))
    name = result.outputs[index]
    return f"{name} within {format_number(float(errors[index]), 2)} {column_unit(name)}".rstrip()
