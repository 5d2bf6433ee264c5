"""Tables of finished runs from any source: checks, and look-up by parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...base.arguments import Checks
from ...base.rows import Array
from ...base.shown import meant_or_known
from ...errors import ArgumentError, describe
from ...notices import Notice
from ...run.features import Feature
from ...scene.scene import Interval
from ..polynomials.points import SAME_POINT, is_grid, nominal_point, on_cube
from .asked import checked_units, require_known
from .filled import copies_of, left_out, spread
from .own import check_own_features, sampled_feature
from .returned import time_axis
from .run_table import RunTable

# A square table may be transposed if neighboring runs differ by less than this part of neighboring samples.
_ROUGHER = 0.2


@dataclass(frozen=True, eq=False)
class FinishedRuns:
    """A table of finished runs, to which none can be added."""

    intervals: dict[str, Interval]
    """Interval of each parameter by name."""
    table: RunTable
    """All runs, in their order."""
    independent: bool
    """Whether the points were drawn independently and uniformly from the box."""

    def __repr__(self) -> str:
        return f"{len(self.parameters)} finished runs"

    @property
    def parameters(self) -> Array:
        """Parameters of all runs, shape (runs, parameters)."""
        return self.table.parameters

    @property
    def nominal(self) -> int:
        """The run nearest to the nominal values, which is used as the nominal one."""
        return int(np.argmin(self._away(nominal_point(self.intervals))))

    def _away(self, point: Array) -> Array:
        """Largest distance of each run from a point, over half the interval, shape (runs,)."""
        away = on_cube(self.intervals, self.parameters) - on_cube(self.intervals, point)
        return np.asarray(np.max(np.abs(away), axis=1))

    @property
    def points(self) -> Array:
        """Parameters of the runs but the nominal one."""
        return np.delete(self.parameters, self.nominal, axis=0)

    def first(self, runs: int | None, least: int) -> Array:
        """Parameters of the runs but the nominal one, all or the first so many, for a band.

        They may not be on a grid, where runs that differ in a parameter without effect are equal, nor leave
        out a part of the box in which others of the table are.
        """
        wanted = len(self.points) if runs is None else runs
        if len(self.points) < max(wanted, least):
            text = f"the table has {len(self.points)} runs besides the nominal one"
            raise ArgumentError(f"{text}, {max(wanted, least)} are needed")
        for name, column in zip(self.intervals, self.parameters.T, strict=True):
            if is_grid(column):
                distinct = len(np.unique(column))
                raise ArgumentError(
                    f"the {len(column)} runs take only {distinct} values of {name}: runs on a grid have "
                    "duplicates where a parameter has no effect, so that held-out runs prove nothing. Use "
                    "chebyshev() for Chebyshev roots, sample() for the extremes of the runs and features"
                )
        points = self.points[:wanted]
        parts = [left_out(self.intervals, one) for one in (self.points, points)]
        if more := set(parts[1]) - set(parts[0]):
            raise ArgumentError(
                f"none of the first {wanted} runs is {parts[1][min(more)]}, though others of the table are "
                "there: use all runs, or put them into a random order"
            )
        return points

    def run(self, **parameters: float) -> dict[str, Array | float]:
        """The run with these parameters, as a model of one's own returns it."""
        found = self.runs(np.array([[parameters[name] for name in self.intervals]]), midpoint=False)
        own: dict[str, Array | float] = {"t": found.t} if found.outputs else {}
        return own | {name: found.values[0, :, index] for index, name in enumerate(found.outputs)}

    def runs(self, points: Array, *, midpoint: bool) -> RunTable:
        """The runs at the points and, if asked for, last the nominal one; ValueError if there are none."""
        # The runs but the nominal one, or the first of them, are themselves: a table may have several at a
        # point.
        rows, missing = np.delete(np.arange(len(self.parameters)), self.nominal)[: len(points)].tolist(), []
        if not np.array_equal(self.parameters[rows], points):
            away = [self._away(point) for point in points]
            rows = [int(one.argmin()) for one in away]
            missing = [index for index, one in enumerate(away) if one.min() > SAME_POINT]
        if missing:
            first = dict(zip(self.intervals, map(float, points[missing[0]]), strict=True))
            raise ArgumentError(
                f"the table has no run at {len(missing)} of the {len(points)} points that are needed, the "
                f"first with {describe(first)}: band() and sample() take the runs as they are"
            )
        notices = list(self.table.notices)
        stand_in = None
        if midpoint:
            rows.append(self.nominal)
            if self._away(nominal_point(self.intervals)).min() > SAME_POINT:
                stand_in = self.parameters[self.nominal]
                at = dict(zip(self.intervals, map(float, stand_in), strict=True))
                text = (
                    "no run of the table is at the nominal values of all intervals: the nearest, with "
                    f"{describe(at)}, is used as the nominal one"
                )
                notices.append(Notice("no_nominal_run", text))
        return replace(
            self.table[np.array(rows)],
            parameters=points,
            kept=np.arange(len(points)),
            notices=tuple(notices),
            nominal_parameters=stand_in,
        )

    def beside(self, grid: Array) -> Array:
        """Parameters of the runs but the nominal one that are at none of the points."""
        wanted, points = on_cube(self.intervals, grid), on_cube(self.intervals, self.points)
        away = [np.max(np.abs(wanted - point), axis=1).min() for point in points]
        return np.asarray(self.points[np.array(away) > SAME_POINT])


def finished_runs(
    parameters: object,
    t: object,
    values: object,
    intervals: Mapping[str, Interval] | None,
    features: Mapping[str, Feature] | None,
    cycles: int,
    independent: bool,
    units: Mapping[str, str] | None,
) -> FinishedRuns:
    """A table of runs; arguments as those of `Study.from_runs`, all problems of which are listed."""
    checks = Checks()
    if not isinstance(independent, bool | np.bool_):
        checks.add("independent", f"must be True or False, got {independent!r}", wrong_type=True)
        independent = False
    columns = _table_parameters(checks, parameters)
    runs = len(next(iter(columns.values()))) if columns else 0
    instants = np.empty(0) if t is None else time_axis(checks, t)
    series, numbers, doubts = _table_values(checks, values, runs, instants, timed=t is not None)
    _check_rows(checks, parameters, values)
    sides = _table_intervals(checks, columns, intervals)
    asked = checks.mapping("features", features, "features")
    for name, feature in asked.items():
        if not isinstance(feature, Feature):
            text = 'must be a feature such as peak("force"); put other numbers of the runs into values'
            checks.add(f'features["{name}"]', f"{text}, got {feature!r}", wrong_type=True)
        elif feature.of not in series:
            known = ", ".join(series) or "no time series"
            checks.add(f'features["{name}"]', f'is of no output of the table, "{feature.of}": it has {known}')
        elif name in numbers:
            checks.add(f'features["{name}"]', "is in values too")
    checks.names("columns", [*columns, *series, *numbers, *asked])
    check_own_features(checks, asked)
    require_known(checks, checked_units(checks, units), [*columns, *series, *asked, *numbers])
    checks.whole("cycles", cycles, least=1, most=max(1, len(instants) - 1) if t is not None else None)
    copies = copies_of(columns, sides, [*series.values(), *numbers.values()])
    if copies:
        first = "run {1} is one of run {0}".format(*copies[0])
        text = f"{len(copies)} of {runs} runs are copies of others ({first})"
        doubts.append(f"{text}: these are left out, since they say nothing more")
        if independent:
            checks.add("independent", f"says that runs are drawn at random, but {text}: leave them out")
        left = np.setdiff1d(np.arange(runs), [copy for _, copy in copies])
        columns, series, numbers = (
            {name: values[left] for name, values in part.items()} for part in (columns, series, numbers)
        )
        runs = len(left)
        if runs < 2:
            checks.add("parameters", f"are the same in all {len(copies) + 1} runs: 2 must differ")
    doubts += spread(checks, columns, sides, independent)
    checks.finish()
    found = [sampled_feature(one, instants, series[one.of], cycles) for one in asked.values()]
    found += [np.repeat(column[:, None], cycles, axis=1) for column in numbers.values()]
    shape = (runs, len(instants) if series else 0, len(series))
    table = RunTable(
        parameters=np.stack(list(columns.values()), axis=-1),
        kept=np.arange(runs),
        t=instants,
        outputs=tuple(series),
        values=np.stack(list(series.values()), axis=-1) if series else np.empty(shape),
        notices=tuple(Notice("table", text) for text in doubts),
        features=np.stack(found, axis=-1) if found else None,
        feature_names=(*asked, *numbers),
    )
    return FinishedRuns(sides, table, bool(independent))


def _table_parameters(checks: Checks, given: object) -> dict[str, Array]:
    """The column of each parameter; none if one is wrong."""
    given = _as_mapping(given)
    if not isinstance(given, Mapping) or not given:
        checks.add("parameters", f"must map names to the values of every run, got {given!r}", wrong_type=True)
        return {}
    columns = {}
    for name, value in given.items():
        column = _numbers(checks, f'parameters["{name}"]', value)
        if column is not None and (column.ndim != 1 or len(column) < 2):
            wanted = f"must have one value a run, 2 at least, got shape {column.shape}"
            checks.add(f'parameters["{name}"]', wanted)
        elif column is not None:
            columns[str(name)] = column
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        checks.add("parameters", f"must all have the same number of runs, got {lengths}")
        return {}
    return columns if len(columns) == len(given) else {}


def _check_rows(checks: Checks, parameters: object, values: object) -> None:
    """Refuse columns of data frames whose rows have other labels, or the same in another order."""
    first: tuple[str, Any] | None = None
    for word, given in (("parameters", parameters), ("values", values)):
        if not isinstance(columns := _as_mapping(given), Mapping):
            continue
        for name, value in columns.items():
            rows = getattr(value, "index", None)
            # Those of a series or frame; a list has a method of this name.
            if rows is None or callable(rows):
                continue
            label = f'{word}["{name}"]'
            first = first or (label, rows)
            # Labels may be missing, and such a label does not equal itself.
            same = rows.equals(first[1]) if hasattr(rows, "equals") else np.array_equal(rows, first[1])
            if len(rows) == len(first[1]) and not same:
                text = f"has other row labels than {first[0]}: sort both alike, or give arrays without labels"
                checks.add(label, f"{text} (to_numpy)")


def _as_mapping(given: object) -> object:
    """A data frame as the mapping of its columns."""
    if isinstance(given, Mapping) or not hasattr(given, "columns"):
        return given
    return {str(name): given[name] for name in given.columns}  # type: ignore[index]


def _numbers(checks: Checks, name: str, value: object) -> Array | None:
    """An array of finite numbers, or a problem."""
    try:
        # Imaginary parts would be lost, and dates have no origin.
        if np.asarray(value).dtype.kind in "cmM":
            raise TypeError
        # What is masked has no value.
        array = np.ma.filled(np.ma.asarray(value).astype(float), np.nan)
    except (TypeError, ValueError, OverflowError):
        checks.add(name, f"must be real numbers, got {_no_number(value)}", wrong_type=True)
        return None
    wrong = np.argwhere(~np.isfinite(array))
    if len(wrong):
        rows = len(np.unique(wrong[:, 0])) if array.ndim else 1
        where = f" in run {wrong[0][0]}" if array.ndim else ""
        several, them = ("s", "them") if rows > 1 else ("", "it")
        text = f"must be finite, got {array[tuple(wrong[0])]}{where} ({rows} run{several} in all): leave "
        checks.add(name, f"{text}{them} out, of the parameters as well")
        return None
    return array


def _no_number(value: object) -> str:
    """The first element that is no number and its run, or what was given if it has none."""
    try:
        array = np.asarray(value)
    except ValueError:
        return f"rows of different lengths, {repr(value).splitlines()[0][:200]}"
    for run, one in enumerate(array.ravel() if array.ndim == 1 else ()):
        try:
            if isinstance(one, complex | np.datetime64 | np.timedelta64):
                raise TypeError
            float(one)
        except (TypeError, ValueError, OverflowError):
            return f"{one!s:.40} of the type {type(one).__name__} in run {run}"
    return repr(value).splitlines()[0][:200]


def _table_values(
    checks: Checks, given: object, runs: int, t: Array, *, timed: bool
) -> tuple[dict[str, Array], dict[str, Array], list[str]]:
    """Time series of shape (runs, samples), numbers of shape (runs,), and doubts of their orientation."""
    given = _as_mapping(given)
    series: dict[str, Array] = {}
    numbers: dict[str, Array] = {}
    doubts: list[str] = []
    if not isinstance(given, Mapping) or not given:
        text = f"must map names to arrays of shape (runs, samples) or (runs,), got {given!r}"
        checks.add("values", text, wrong_type=True)
        return series, numbers, doubts
    for name, value in given.items():
        place = f'values["{name}"]'
        array = _numbers(checks, place, value)
        if array is None or not runs or (timed and not len(t)):
            continue  # the numbers of runs and samples are unknown
        if array.shape == (runs,):
            numbers[str(name)] = array
        elif timed and array.shape == (runs, len(t)):
            series[str(name)] = array
            rough = [np.mean(np.abs(np.diff(array, axis=axis))) for axis in (0, 1) if runs == len(t)]
            if rough and rough[0] < _ROUGHER * rough[1]:
                text = f"{place} is square and smoother from run to run than in time: is it (samples, runs)?"
                doubts.append(f"{text} It is taken as (runs, samples)")
        elif timed and array.shape == (len(t), runs):
            text = f"has shape {array.shape}, (samples, runs); it must be (runs, samples) = {(runs, len(t))}"
            checks.add(place, f"{text}: transpose it")
        else:
            wanted = f"(runs, samples) = {(runs, len(t))} or " if timed else ""
            text = f"must have shape {wanted}(runs,) = {(runs,)}, got {array.shape}"
            checks.add(place, text + ("" if timed or array.ndim < 2 else ": time series need t"))
    return series, numbers, doubts


def _table_intervals(checks: Checks, columns: Mapping[str, Array], given: object) -> dict[str, Interval]:
    """The box: as given, or what the runs span."""
    wanted = checks.mapping("intervals", given, "intervals")
    if not isinstance(given, Mapping | None):
        return {}
    for name in wanted:
        if columns and name not in columns:
            hint = meant_or_known(name, columns)
            checks.add("intervals", f'names "{name}", no parameter of the runs{hint}')
    sides = {}
    for name, column in columns.items():
        place, least, most = f'parameters["{name}"]', float(column.min()), float(column.max())
        side = wanted.get(name)
        if side is None and least == most:
            checks.add(place, f"is {least!r} in every run: leave it out, or give its interval")
            continue
        side = Interval(least, most) if side is None else side
        if not isinstance(side, Interval):
            text = f"must be an Interval(lower, upper), got {side!r}"
            checks.add(f'intervals["{name}"]', text, wrong_type=True)
            continue
        slack = SAME_POINT * side.half_width
        outside = np.flatnonzero((column < side.lower - slack) | (column > side.upper + slack))
        if len(outside):
            text = f"is {float(column[outside[0]])!r} in run {outside[0]}, outside its interval "
            text += f"[{side.lower!r}, {side.upper!r}] ({len(outside)} of the runs)"
            checks.add(place, text)
        sides[name] = side
    return sides
