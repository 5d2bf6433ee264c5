"""What tolerances cost: functions, and catalogs of tolerances or ISO grades."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.arguments import Checks, as_number
from ...base.rows import Array
from ...base.shown import meant_or_known
from ...base.units import convert, is_quantity
from ...scene.distributions import Distribution
from ...scene.scene import Interval
from ...study.runner import Runner
from ...templates.fits import FitError, grade_tolerance
from ...templates.run_table import GRADE
from .excess import Cost

# Functions are searched from this part of the tolerance of the study to this multiple.
_REACH = 10.0
# Beside catalogs they are taken at so many tolerances a decade: the series R10 of ISO 3.
_IN_A_DECADE = 10
# Relative rounding of tolerances and costs.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Price:
    """What the tolerances of a parameter cost."""

    at: Cost
    """Cost of a tolerance; of a catalog, that of its widest entry which is no wider, NaN if there is none."""
    low: float
    high: float
    """Ends of the tolerances that are searched [SI units]."""
    choices: Array
    """The tolerances to choose from, the tightest first; empty for all between the ends."""
    grades: Mapping[float, str]
    """ISO grades among them."""


def prices_of(checks: Checks, runner: Runner, cost: object) -> dict[str, Price]:
    """The costs of an `allocate` by parameter, checked."""
    if not isinstance(cost, Mapping) or not cost:
        checks.add(
            "cost",
            "must map parameters to functions of their tolerance, or to catalogs such as "
            f'{{"10 um": 7.5, "20 um": 5.0}} or {{"IT7": 9.0, "IT8": 6.0}}, got {cost!r:.80}',
            wrong_type=not isinstance(cost, Mapping),
        )
        return {}
    in_steps = any(isinstance(one, Mapping) for one in cost.values())
    prices: dict[str, Price] = {}
    for name, given in cost.items():
        place, side, found = f'cost["{name}"]', runner.intervals.get(name), None
        if side is None:
            checks.add(place, f"unknown parameter{meant_or_known(name, runner.intervals)}")
        elif isinstance(one := runner.parameters[name], Distribution) and not one.has_tolerance:
            checks.add(place, f"{one.told} values have no tolerance: give it another distribution")
        elif isinstance(given, Mapping):
            found = _of_catalog(checks, place, given, side, runner.units.get(name, ""))
        elif callable(given):
            found = _of_function(checks, place, given, side, in_steps)
        else:
            words = f"must be a function of the tolerance or a catalog, got {given!r:.80}"
            checks.add(place, words, wrong_type=True)
        if found is not None:
            prices[name] = found
    return prices


def _of_catalog(
    checks: Checks, place: str, given: Mapping[object, object], side: Interval, unit: str
) -> Price | None:
    costs, grades = {}, {}
    for key, cost in given.items():
        try:
            tolerance = _tolerance(key, side, unit)
            price = as_number(cost)
            if price is None or not math.isfinite(price):
                raise ValueError(f"the cost must be a finite number, got {cost!r}")
        except ValueError as error:  # a unit or a grade, too
            checks.add(f"{place}[{key!r}]", str(error))
            continue
        costs[tolerance] = price
        if isinstance(key, str) and GRADE.fullmatch(key):
            grades[tolerance] = key
    tolerances = np.array(sorted(costs))
    spent = [costs[tolerance] for tolerance in sorted(costs)]
    if not given:
        checks.add(place, "the catalog is empty")
    if not costs or not _falls(checks, place, tolerances, spent):
        return None

    def at(tolerance: float) -> float:
        count = int(np.searchsorted(tolerances, tolerance * (1.0 + _ROUNDING), side="right"))
        return spent[count - 1] if count else math.nan

    return Price(at, float(tolerances[0]), float(tolerances[-1]), tolerances, grades)


def _tolerance(key: object, side: Interval, unit: str) -> float:
    """The tolerance that an entry of a catalog is for."""
    grade = GRADE.fullmatch(key) if isinstance(key, str) else None
    if grade is not None:
        if unit not in ("m", ""):
            raise FitError(f"grades are those of lengths [m], the parameter is in {unit}")
        return grade_tolerance(abs(side.nominal), int(grade[1]))
    tolerance = convert(key, unit or "unit") if isinstance(key, str) and is_quantity(key) else as_number(key)
    if tolerance is None or not 0.0 < tolerance < math.inf:
        raise ValueError("must be a tolerance above 0, with its unit or in SI units, or a grade such as IT7")
    return tolerance


def _of_function(checks: Checks, place: str, given: Cost, side: Interval, in_steps: bool) -> Price | None:
    low, high = side.half_width / _REACH, side.half_width * _REACH
    if side.half_width <= 0.5 * abs(side.nominal):
        # A clearance or a length stays well above 0.
        high = min(high, 0.5 * abs(side.nominal))
    tolerances = low * 10.0 ** np.arange(0.0, math.log10(high / low) + _ROUNDING, 1.0 / _IN_A_DECADE)
    costs = []
    for tolerance in map(float, [*tolerances, high]):
        try:
            value = as_number(given(tolerance))
        except Exception as error:  # whatever the function of the user raises
            checks.add(place, f"raises for the tolerance {tolerance:g}: {error}")
            return None
        if value is None or not math.isfinite(value):
            checks.add(place, f"must be a finite number for the tolerance {tolerance:g}, got {value!r}")
            return None
        costs.append(value)
    if not _falls(checks, place, [*tolerances, high], costs):
        return None
    choices = tolerances if in_steps else np.empty(0)
    return Price(given, low, float(choices[-1]) if in_steps else high, choices, {})


def _falls(checks: Checks, place: str, tolerances: Sequence[float] | Array, costs: Sequence[float]) -> bool:
    """Notes a cost that falls where the tolerance becomes tighter; whether it does not."""
    ends = zip(itertools.pairwise(tolerances), itertools.pairwise(costs), strict=True)
    for (tight, wide), (cost, wider) in ends:
        if wider > cost + _ROUNDING * abs(cost):
            checks.add(
                place,
                f"falls with a tighter tolerance: {wider:g} at {wide:g}, {cost:g} at {tight:g}; the tighter "
                "one would always be taken",
            )
            return False
    return True
