"""Features over a study: the range of a scalar result over the box, and the effects of the parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from ...base import files as records
from ...base.named import Named
from ...base.prefixes import Form
from ...base.rows import Array
from ...base.shown import listed, meant_or_known
from ...errors import ArgumentError, UnknownNameError, warn
from ...report import html
from ...report.document import Table
from ...run.features import Feature
from ...scene.columns import FREE, Limits, physical_limits
from ...scene.distributions import Uniform
from ...scene.scene import Interval
from ..polynomials.points import nominal_point, on_cube, unfilled
from ..sources.asked import FeatureSpec, units_of
from ..sources.run_table import RunTable
from .effects import Effects, Fit, Model, find_effects, fits_of, model_of
from .narrowing import find_narrowing
from .ranking import Rank, Ranking
from .reach import FeatureInterval, find_intervals, find_reach

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..runner import Runner


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
    limits : tuple[tuple[float, float], ...]
        Physical limits of each feature in its unit; empty if none is known.
    written : tuple[tuple[str, ...], ...]
        Units that the user wrote, in which each feature is shown; empty if none are known.
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
    limits: tuple[tuple[float, float], ...] = ()
    written: tuple[tuple[str, ...], ...] = ()

    @property
    def _names(self) -> tuple[str, ...]:
        return self.names

    def _repr_html_(self) -> str:
        found = [self._entry(name) for name in self.names]
        rows = []
        for one in found:
            ends = float(np.min(one.values)), float(np.max(one.values))
            rows.append([one.name, *map(Form.of(ends, one.unit, one.written).text, ends)])
        table = Table("Features of the runs", ["feature", "smallest", "largest"], rows)
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
    def all_points(self) -> tuple[Array, bool, list[Fit]]:
        """Points of all runs, the nominal one last; whether they fill the box, and the polynomials if so."""
        points, filled = np.vstack([self.points, self.nominal_point]), not (self.failed or self.leaves_out)
        return points, filled, fits_of(points) if filled else []

    @cached_property
    def fits(self) -> list[Fit]:
        """The polynomials that the points allow, the same for all features."""
        return fits_of(self.points)

    @cached_property
    def intervals_of_features(self) -> list[FeatureInterval]:
        """How far each feature reaches over the box; runs that failed count as outside."""
        points, filled, fits = self.all_points
        values = np.concatenate([self.runs, self.nominal[None]])
        return find_intervals(points, values, self.all_limits, self.random, filled, fits, self.failed)

    @property
    def all_limits(self) -> tuple[Limits, ...]:
        """The `limits`, infinite where none is known."""
        return self.limits or (FREE,) * len(self.names)

    @cached_property
    def leaves_out(self) -> bool:
        """Whether the runs leave out a part of the box.

        Those of a study fill it, though pairs of many parameters may look as if they did not.
        """
        return self.finished and bool(unfilled(self.points))


NO_FEATURES = FeatureTable((), np.empty((0, 1, 0)), np.empty((1, 0)), {}, np.empty((0, 0)), random=False)
"""The features of a study that asked for none."""


def feature_table(runner: Runner, runs: RunTable, random: bool, failed: int) -> FeatureTable:
    """The features of the runs of a study."""
    if runs.features is None:
        return NO_FEATURES
    names = runs.feature_names
    return FeatureTable(
        names,
        runs.features[:-1],
        runs.features[-1],
        runner.intervals,
        runs.parameters,
        random,
        tuple(name for name, given in runner.random.items() if not isinstance(given, Uniform)),
        units_of(names, runner.features, runner.units, simulated=runner.settings is not None),
        failed,
        runner.table,
        runs.nominal_parameters,
        tuple(_limits(runner.features.get(name), runs) for name in names),
        tuple(map(runner.written_for, names)),
    )


def _limits(feature: FeatureSpec | None, runs: RunTable) -> Limits:
    """Physical limits of a feature in its unit; none are known of the results of callables."""
    if not isinstance(feature, Feature):
        return FREE
    known = physical_limits([feature.of], runs.clearances, simulated=runs.scene is not None)
    return feature.limits_with(known[feature.of])


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
    def written(self) -> tuple[str, ...]:
        """Units that the user wrote, in which it is shown."""
        return self.table.written[self._column] if self.table.written else ()

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
        ends = float(np.min(self.values)), float(np.max(self.values))
        reach = Form.of(ends, self.unit, self.written).range(*ends)
        return f"<FeatureResult of {self.name}: {counted}, {reach}>"

    def __str__(self) -> str:
        reach = self.interval
        ends = reach.lower, reach.upper
        text = Form.of(ends, self.unit, self.written).range(*ends)
        return f"{self.name}: {text} ({reach.verdict}: {reach.sure})"

    @property
    def interval(self) -> FeatureInterval:
        """How far the feature reaches over the box."""
        return self.table.intervals_of_features[self._column]

    @cached_property
    def ends(self) -> tuple[float, float]:
        """Ends of the `interval` alone, without its shares, which take ten times as long."""
        points, filled, fits = self.table.all_points
        values, limits = np.vstack([self.values, self.nominal]), self.table.all_limits[self._column]
        lower, upper, _ = find_reach(points, values, limits, filled, fits)
        return lower, upper

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
        return find_effects(list(self.intervals), self._model)

    @cached_property
    def _model(self) -> Model:
        return model_of(self.table.points, self.values, self.table.fits)

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
        narrowings = find_narrowing(list(self.intervals), self._model, table.nominal_point)
        rows = [
            Rank(name, narrowing, effects.main[name], effects.monotone.get(name))
            for name, narrowing in narrowings.items()
        ]
        rows.sort(key=lambda row: -row.narrowing.value)
        share = table.failed / (len(self.values) + table.failed)
        shared = effects.interactions, effects.scatter, table.uneven, share, table.leaves_out
        return Ranking(self.name, tuple(rows), *shared)
