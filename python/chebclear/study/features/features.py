"""Features over a study: the range of a scalar result over the box, and the effects of the parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...base import files as records
from ...base.arguments import Checks, as_number, meant_or_known
from ...base.named import Named
from ...base.shown import listed
from ...base.tables import format_ends
from ...errors import ArgumentError, ArgumentTypeError, UnknownNameError, describe, warn
from ...report import html
from ...report.document import Table
from ...run.features import Feature
from ...run.notices import Notice
from ...run.settings import Settings
from ...run.tracking import settling_time
from ...scene.scene import Interval, Scene
from ..band.margin import percent
from ..polynomials.points import leaves_out, nominal_point, on_cube
from .effects import Effects, find_effects
from .narrowing import find_narrowing
from .ranking import Rank, Ranking
from .reach import FeatureInterval, find_interval, find_reach
from .swept import SweptRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
FeatureSpec = Feature | Callable[[Any], ArrayLike]

# Features with the times of the extrema of a feature.
_TIMES = {
    "peak": ("time_of_peak",),
    "lowest": ("time_of_lowest",),
    "peak_to_peak": ("time_of_peak", "time_of_lowest"),
}


@dataclass(frozen=True, eq=False, repr=False)
class FeatureTable(records.ArrayRecord, Named["FeatureResult"]):
    """The features of all runs of a study: ``table["peak"]`` is the `FeatureResult` of that name.

    A mapping from the names of the features; `runs` is the array of all of them.

    Attributes
    ----------
    names : tuple[str, ...]
        Names of the features.
    runs : Array
        In the units of the features, shape (runs, cycles, features).
    nominal : Array
        Those of the run at the midpoint of all intervals, shape (cycles, features).
    intervals : dict[str, Interval]
        Interval of each parameter by name [SI units].
    parameters : Array
        Parameters of the runs [SI units], shape (runs, parameters).
    random : bool
        Whether the runs are spread at random over the box, so that statements on a further run are possible.
    uneven : tuple[str, ...]
        Parameters that were given with another distribution than a uniform one; their values in the runs are
        uniformly distributed.
    units : tuple[str, ...]
        SI unit of each feature, empty where it is not known; empty if none is.
    failed : int
        Further runs that failed and are not among these [-].
    finished : bool
        Whether the runs came as a table, at points of unknown origin, which may leave out a part of the box.
    nominal_parameters : Array | None
        Parameters of the nominal run [SI units]; None if it is at the nominal values of the intervals.
    """

    names: tuple[str, ...]
    runs: Array
    nominal: Array
    intervals: dict[str, Interval]
    parameters: Array
    random: bool
    uneven: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    failed: int = 0
    finished: bool = False
    nominal_parameters: Array | None = None

    @property
    def _names(self) -> tuple[str, ...]:
        return self.names

    def _repr_html_(self) -> str:
        found = [self._entry(name) for name in self.names]
        rows = [
            [one.name, one.unit, *(f"{end(one.values):.6g}" for end in (np.min, np.max))] for one in found
        ]
        table = Table("Features of the runs", ["feature", "unit", "lowest", "highest"], rows)
        return html.fragment(repr(self)[1:-1], [table])

    def __repr__(self) -> str:
        runs, cycles = self.runs.shape[:2]
        counted = f", {cycles} cycles" if cycles > 1 else ""
        return f"<FeatureTable: {runs} runs{counted}, {listed(self.names, most=4)}>"

    def _entry(self, name: str) -> FeatureResult:
        if name not in self:
            hint = meant_or_known(name, self.names) if self.names else ": add it to the features of the study"
            raise UnknownNameError(f'unknown feature "{name}"{hint}')
        return self._entries[self.names.index(name)]

    @cached_property
    def _entries(self) -> tuple[FeatureResult, ...]:
        return tuple(FeatureResult(name, self) for name in self.names)

    @cached_property
    def points(self) -> Array:
        """Parameters of the runs, from -1 to 1 over each interval, shape (runs, parameters)."""
        return on_cube(self.intervals, self.parameters)

    @property
    def nominal_point(self) -> Array:
        """As `points`, of the nominal run."""
        return on_cube(self.intervals, nominal_point(self.intervals, self.nominal_parameters))

    @cached_property
    def leaves_out(self) -> bool:
        """Whether the runs leave out a part of the box.

        Those of a study fill it, though pairs of many parameters may look as if they did not.
        """
        return self.finished and leaves_out(self.points)


NO_FEATURES = FeatureTable((), np.empty((0, 1, 0)), np.empty((1, 0)), {}, np.empty((0, 0)), random=False)
"""The features of a study that asked for none."""


@dataclass(frozen=True, eq=False, repr=False)
class FeatureResult(records.ArrayRecord):
    """One feature over the box of parameters.

    Attributes
    ----------
    name : str
        Name of the feature.
    table : FeatureTable
        The features of all runs, with the parameters of these.
    """

    name: str
    table: FeatureTable

    @property
    def _column(self) -> int:
        return self.table.names.index(self.name)

    @property
    def values(self) -> Array:
        """In the unit of the feature, shape (runs, cycles)."""
        return self.table.runs[:, :, self._column]

    @property
    def nominal(self) -> Array:
        """At the midpoint of all intervals, shape (cycles,)."""
        return self.table.nominal[:, self._column]

    @property
    def unit(self) -> str:
        """SI unit of the feature; empty if it is not known."""
        return self.table.units[self._column] if self.table.units else ""

    @property
    def intervals(self) -> dict[str, Interval]:
        """Interval of each parameter by name [SI units]."""
        return self.table.intervals

    @property
    def parameters(self) -> Array:
        """Parameters of the runs [SI units], shape (runs, parameters)."""
        return self.table.parameters

    def plot(self, *, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw what each parameter does to the feature; see `plot_tornado` for the options."""
        from ...plots.features import plot_tornado

        return plot_tornado(self, ax=ax, **options)

    def __repr__(self) -> str:
        runs, cycles = self.values.shape
        counted = f"{runs} runs" if cycles == 1 else f"{runs} runs of {cycles} cycles"
        reach = format_ends(float(np.min(self.values)), float(np.max(self.values)))
        return f"<FeatureResult of {self.name}: {counted}, {reach}>"

    def __str__(self) -> str:
        reach = self.interval
        unit = f" {self.unit}" if self.unit not in ("", "-") else ""
        text = f"{self.name}: {format_ends(reach.lower, reach.upper)}{unit} ({reach.verdict})"
        text += f"; {percent(reach.coverage)} of the runs are in the interval of the others"
        if not math.isnan(reach.whole_run):
            text += f", a further run with a probability of at least {percent(reach.whole_run)}"
            text += f"; at least {percent(reach.tolerated)} of all mechanisms with 95 % confidence"
        return text

    @cached_property
    def interval(self) -> FeatureInterval:
        """How far the feature reaches over the box."""
        table, (points, values, filled) = self.table, self._at_points()
        reach = find_interval(points, values, table.random, filled=filled)
        share = len(self.values) / (len(self.values) + table.failed)
        return replace(
            reach,
            coverage=reach.coverage * share,
            whole_run=reach.whole_run * share,
            tolerated=reach.tolerated * share,
        )

    @cached_property
    def ends(self) -> tuple[float, float]:
        """Ends of the `interval` alone, without its shares, which take ten times as long."""
        lower, upper, _ = find_reach(*self._at_points())
        return lower, upper

    def _at_points(self) -> tuple[Array, Array, bool]:
        """Points and values of all runs, the nominal one last, and whether they fill the box."""
        table = self.table
        points = np.vstack([table.points, table.nominal_point])
        return points, np.vstack([self.values, self.nominal]), not table.failed and not table.leaves_out

    @cached_property
    def effects(self) -> Effects:
        """How much each parameter contributes to the feature, and how much no parameter explains.

        Where the runs leave out a part of the box the polynomial is extrapolated there: a warning says so.

        Raises
        ------
        ValueError
            If there are too few runs to tell.
        """
        if self.table.leaves_out:
            warn(f"{self.name}: the runs leave out a part of the box: effects are extrapolated there")
        return find_effects(list(self.intervals), self.table.points, self.values)

    def quantile(self, shares: ArrayLike) -> Array:
        """Values that so many of the runs, all cycles together, stay below.

        Parameters
        ----------
        shares : float or array_like
            Shares of the runs from 0 to 1 [-].

        Returns
        -------
        ndarray
            In the unit of the feature. Quantiles over the box, for uniform and independent parameters.

        Raises
        ------
        ValueError
            If a share is out of range, the runs are not spread at random, or a parameter was given with
            another distribution than a uniform one.
        """
        try:
            given = np.asarray(shares, dtype=float)
        except (TypeError, ValueError, OverflowError):
            raise ArgumentError(f"shares must be numbers from 0 to 1, got {shares!r}") from None
        if given.ndim > 1 or not given.size or not np.all((given >= 0.0) & (given <= 1.0)):
            raise ArgumentError(f"shares must be from 0 to 1, one or a list of them, got {shares!r}")
        if not self.table.random:
            raise ArgumentError("runs on a grid, or with some, have no quantiles, random points have")
        if self.table.uneven:
            raise ArgumentError(
                f"the runs spread {', '.join(self.table.uneven)} evenly over their intervals: quantiles are "
                "not those of their distributions. Ask conformance, or draw them yourself, Study.from_runs"
            )
        return np.asarray(np.quantile(self.values, given))

    def ranking(self) -> Ranking:
        """Predicted effect of halving the interval of each parameter on the interval of the feature."""
        return self._ranking

    @cached_property
    def _ranking(self) -> Ranking:
        effects, table = self.effects, self.table
        narrowings = find_narrowing(
            list(self.intervals), table.points, self.values, nominal=table.nominal_point
        )
        rows = [
            Rank(name, narrowing, effects.main[name], effects.monotone.get(name))
            for name, narrowing in narrowings.items()
        ]
        rows.sort(key=lambda row: -row.narrowing.value)
        share = table.failed / (len(self.values) + table.failed)
        shared = effects.interactions, effects.scatter, table.uneven, share, table.leaves_out
        return Ranking(self.name, tuple(rows), *shared)


def checked_features(checks: Checks, given: object) -> dict[str, FeatureSpec]:
    """Features by name from the argument of the user; problems are added to `checks`."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        checks.add(
            f'features must map names to features such as peak("slider.ax"), got {given!r}', wrong_type=True
        )
        return {}
    checks.names("features", given)
    asked: dict[str, FeatureSpec] = {}
    for name, feature in given.items():
        if not isinstance(name, str):
            checks.add(f"names of features must be texts, got {name!r}", wrong_type=True)
        elif not isinstance(feature, Feature) and not callable(feature):
            checks.add(
                f'features["{name}"] must be a feature such as peak("slider.ax") or a callable of a run, '
                f"got {feature!r}",
                wrong_type=True,
            )
        else:
            asked[name] = feature
    return asked


def tracked_features(asked: Iterable[FeatureSpec]) -> tuple[Feature, ...]:
    """Features that the core must compute: those of its own kinds, and the times of their extrema."""
    known = [feature for feature in asked if isinstance(feature, Feature)]
    known += [Feature(time, feature.of) for feature in known for time in _TIMES.get(feature.kind, ())]
    return tuple(dict.fromkeys(known))


def outputs_of(asked: Mapping[str, FeatureSpec], settings: Settings) -> Sequence[str] | None:
    """Outputs that features need of the runs: none, or all, at which functions of the user's own may look."""
    return () if all(isinstance(one, Feature) for one in asked.values()) else settings.outputs


def feature_values(
    asked: Mapping[str, FeatureSpec],
    settings: Settings,
    numbers: Iterable[int],
    run: Callable[[int], SweptRun],
    parameters: Callable[[int], Mapping[str, float]],
    tracked: Array,
    fail: Callable[[int, Exception], None],
    call: Callable[..., Any],
) -> Array:
    """The features of all runs, shape (runs, cycles, features); NaN for runs that are not among the numbers.

    `run` and `parameters` give a run as a callable gets it, and its parameters, by its number; `tracked` are
    the features from the core in the order of the settings; `fail` gets number and error of every run that
    has no such feature; `call` calls a function, perhaps for a limited time only.
    """
    values = np.full((len(tracked), settings.cycles, len(asked)), np.nan)
    good = dict.fromkeys(numbers)
    functions = {}
    for index, (name, feature) in enumerate(asked.items()):
        if not isinstance(feature, Feature):
            functions[index] = (name, feature)
            continue
        values[:, :, index] = tracked[:, :, settings.features.index(feature)]
        unknown = np.flatnonzero(~np.all(np.isfinite(values[:, :, index]), axis=1))
        for row in [row for row in unknown.tolist() if row in good]:
            del good[row]
            fail(row, ArgumentError(f'feature "{name}" is not finite with {describe(parameters(row))}'))
    for row in good if functions else ():
        name = ""
        try:
            made = run(row)
            for index, (name, function) in functions.items():
                values[row, :, index] = call(called, name, function, made, settings.cycles)
        except Exception as error:
            error.add_note(f'in feature "{name}" of the run with {describe(parameters(row))}')
            fail(row, error)
    return values


def settling_notices(
    asked: Mapping[str, FeatureSpec], settings: Settings, scene: Scene, tracked: Array
) -> tuple[Notice, ...]:
    """Features whose extrema lie in the starting transient in at least half of the runs."""
    settled, found = settling_time(scene), []
    for name, feature in asked.items():
        if not isinstance(feature, Feature) or feature.kind not in _TIMES:
            continue
        times = [
            tracked[:, 0, settings.features.index(Feature(kind, feature.of))] for kind in _TIMES[feature.kind]
        ]
        early = np.any([time < settled for time in times], axis=0)
        if 2 * early.sum() >= len(early):
            text = (
                f'feature "{name}": its extremum lies in the first revolution, the starting transient, in '
                f"{early.sum()} of {len(early)} runs; skip {settled:.4g} s to leave it out"
            )
            numbers = {"runs": float(early.sum()), "of_runs": float(len(early)), "settled": settled}
            found.append(Notice("settling", text, (name,), numbers))
    return tuple(found)


def called(name: str, function: Callable[[Any], ArrayLike], run: Any, cycles: int) -> Array:
    """The result of a callable for a run, shape (cycles,); TypeError or ValueError if it is not finite."""
    value = function(run)
    number = as_number(value)
    array = np.full(cycles, number) if number is not None else np.asarray(value)
    if array.shape != (cycles,) or array.dtype.kind not in "iuf":
        wanted = "a number" if cycles == 1 else f"a number, or one for each of {cycles} cycles"
        raise ArgumentTypeError(f'feature "{name}" must return {wanted}, got {value!r}')
    if not np.all(np.isfinite(array)):
        raise ArgumentError(f'feature "{name}" must be finite, got {value!r}')
    return array.astype(float)
