"""Parameters from a measured trace: the region in which a model has the features of the trace."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from numpy.random import default_rng

from ..base import files as records
from ..base.arguments import Checks
from ..base.named import ReadOnlyDict
from ..base.prefixes import format_range
from ..base.rows import Array
from ..base.shown import listed, meant_or_known
from ..base.units import unit
from ..data.dataset import Dataset, Variable, facts_of
from ..data.exports import Exports
from ..errors import ArgumentTypeError
from ..notices import Notice, issue
from ..scene.scene import Interval
from ..study.polynomials.points import on_cube
from ..study.results import StudyResult
from ..study.sources.finished import FinishedRuns
from ..study.sources.scenes import MOST_RUNS
from ..study.spec import StudySpec
from ..study.study import Study
from .measured import Measured
from .region import FeatureFit, nearest_needed, points_below
from .trace import TraceFeature, TraceFeatures, asked_features, simulated, trace_features

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Part of half an interval from which on a point is at its end.
_AT_THE_END = 0.98


@dataclass(frozen=True, eq=False, repr=False)
class Identification(records.Saved, Exports, kind="identification"):
    """The parameters with which a model has the features of a trace; see `identify`.

    Attributes
    ----------
    intervals : dict[str, Interval]
        Interval of each named parameter, the box that was searched [SI units].
    features : dict[str, float]
        The features of the trace, in their units.
    confidence : float
        Probability that the region holds the true parameters [-].
    runs : int
        Runs of the model that it is made from [-].
    seed : int
        Seed of their points and of the noise.
    units : dict[str, str]
        Units of the parameters, where they are known.
    notices : tuple[Notice, ...]
        What should be checked of the runs.
    spec : StudySpec | None
        What was asked of the study, with the features of the trace; None if the runs were finished before.
    study : Study | None
        The study; None of finished runs and after pickling or loading, where `spec` makes it again.
    """

    _axes: ClassVar = {"_cube": ("runs", "intervals"), "_table": ("runs", "features"), "_t": ("samples",)}

    intervals: dict[str, Interval]
    features: dict[str, float]
    confidence: float
    runs: int
    seed: int
    units: dict[str, str]
    notices: tuple[Notice, ...] = ()
    spec: StudySpec | None = None
    _cube: Array = field(kw_only=True)
    """The named parameters of the runs, from -1 to 1 over their intervals, shape (runs, parameters)."""
    _table: Array = field(kw_only=True)
    """The features of the runs, shape (runs, features)."""
    _t: Array = field(kw_only=True, metadata=unit("s"))
    """Instants of the trace [s], shape (samples,)."""
    _noise: dict[str, float] = field(kw_only=True)
    """Standard deviation of the noise of each output, in the unit of the model."""
    study: Study | None = field(default=None, kw_only=True, compare=False, metadata=records.LIVE)

    @property
    def _observed(self) -> Array:
        return np.array(list(self.features.values()))

    @cached_property
    def _fit(self) -> FeatureFit:
        return FeatureFit(self._cube, self._table, self.confidence)

    @cached_property
    def _region(self) -> tuple[Array, float]:
        """Points in the region, on the cube, and the share of the box that it fills."""
        random = default_rng(self.seed)
        return points_below(lambda cube: self._fit.ratio(cube, self._observed), len(self.intervals), random)

    @property
    def _inside(self) -> Array:
        return self._region[0] if self.share else np.empty((0, len(self.intervals)))

    @cached_property
    def _best(self) -> Array:
        cube = self._region[0]
        return cube[[int(np.argmin(self._fit.ratio(cube, self._observed)))]]

    def _physical(self, cube: Array) -> Array:
        sides = list(self.intervals.values())
        return np.asarray([side.midpoint for side in sides] + cube * [side.half_width for side in sides])

    def _named(self, point: Array) -> dict[str, float]:
        return dict(zip(self.intervals, point.tolist(), strict=True))

    @property
    def status(self) -> Literal["identified", "not_identifiable", "rejected"]:
        """``"rejected"`` if no parameters in the box give such features, ``"not_identifiable"`` if there are
        `directions`, else ``"identified"``."""
        if self.share == 0.0:
            return "rejected"
        return "not_identifiable" if self.directions else "identified"

    @property
    def share(self) -> float:
        """Share of the box that the region fills [-]."""
        return self._region[1]

    @property
    def points(self) -> Array:
        """Points that fill the region evenly [SI units], shape (points, parameters); none if it is empty."""
        return self._physical(self._inside)

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """How far the region reaches in each parameter [SI units]; NaN if it is empty."""
        ends = self.points if self.share else np.full((1, len(self.intervals)), math.nan)
        pairs = zip(ends.min(axis=0).tolist(), ends.max(axis=0).tolist(), strict=True)
        return dict(zip(self.intervals, pairs, strict=True))

    @property
    def best(self) -> dict[str, float]:
        """The parameters whose features are nearest to those of the trace [SI units]."""
        return self._named(self._physical(self._best)[0])

    @property
    def deviations(self) -> dict[str, float]:
        """How far each feature of the trace is from that of the model there, over its scatter [-]."""
        found = self._fit.deviation(self._best, self._observed)[0].tolist()
        return dict(zip(self.features, found, strict=True))

    @property
    def open_ends(self) -> tuple[str, ...]:
        """Parameters whose region reaches an end of the interval, where its confidence is less sure."""
        far = np.abs(self._inside).max(axis=0, initial=0.0)
        return tuple(name for name, most in zip(self.intervals, far, strict=True) if most > _AT_THE_END)

    @cached_property
    def directions(self) -> tuple[dict[str, float], ...]:
        """Joint changes of the parameters that leave the features as they are.

        Each is a unit vector in half widths of the intervals: one along which the linearized region is longer
        than the box, and the region reaches over half of it; or else a parameter of whose interval the region
        holds as much as one that ignores the trace would.
        """
        if not self.share:
            return ()
        squares, vectors = np.linalg.eigh(self._fit.information(self._best))
        ridges = vectors.T[squares <= self._fit.cut(self._best)]
        long = [one for one in ridges if np.ptp(self._inside @ one) >= 1.0]
        found = long or [
            one for one in np.eye(len(squares)) if np.ptp(self._inside @ one) >= 2.0 * self.confidence
        ]
        signed = (np.sign(one[np.argmax(np.abs(one))]) * one for one in found)
        return tuple(ReadOnlyDict(self._named(one)) for one in signed)

    def contains(self, parameters: Mapping[str, float], *, runs: int = 0) -> bool:
        """Whether the region holds these parameters.

        Parameters
        ----------
        parameters : mapping of str to float
            A value for each named parameter [SI units], inside its interval.
        runs : int
            Fresh runs at these parameters, such as 99 [-]: the trace is ranked among them, so that the
            confidence holds exactly, at the ends of intervals too. Without any, the runs that there are.

        Raises
        ------
        ValueError
            If a parameter is missing or outside, or runs are too few for the confidence or cannot be made.
        """
        checks, given = Checks(), {}
        for name in dict.fromkeys([*self.intervals, *parameters]):
            if name not in self.intervals or name not in parameters:
                checks.add(name, f"must be one of {', '.join(self.intervals)}, each with a value")
            else:
                side = self.intervals[name]
                unit = side.unit or "SI unit"
                given[name] = checks.real(name, parameters[name], unit, least=side.lower, most=side.upper)
        least = math.ceil(self.confidence / (1.0 - self.confidence))
        if runs and (self.spec is None or runs < least):
            checks.add("runs", f"must be at least {least}, of a study that can make them, got {runs}")
        checks.finish()
        given = {name: given[name] for name in self.intervals}
        cube = on_cube(self.intervals, np.array([list(given.values())]))
        if not runs:
            return bool(self._fit.ratio(cube, self._observed)[0] <= 1.0)
        assert self.spec is not None
        features: dict[str, Any] = dict(self.spec.features)
        trace = TraceFeatures(self._t, features, self._noise)
        study = self.study or replace(self.spec, features={}, requirements={}).study()
        _, others, _ = simulated(study, trace, self.intervals, runs, self.seed + 1, given)
        place = np.repeat(cube, len(others), axis=0)
        rank = math.ceil(self.confidence * (len(others) + 1)) - 1
        cut = np.sort(self._fit.distance(place, others))[min(rank, len(others) - 1)]
        return bool(self._fit.distance(cube, self._observed)[0] <= cut)

    def dataset(self) -> Dataset:
        """The points that fill the region."""
        variables = {"point": Variable(("point",), np.arange(len(self.points)), "-")}
        for name, values in zip(self.intervals, self.points.T, strict=True):
            variables[f"parameters.{name}"] = Variable(("point",), values, self.units.get(name, ""))
        facts = facts_of(self) | {"status": self.status, "share": self.share}
        facts |= {f"features.{name}": one for name, one in self.features.items()}
        return Dataset("point", variables, facts)

    def __repr__(self) -> str:
        return f"<Identification of {listed(self.intervals)}: {self.status}>"

    def __str__(self) -> str:
        level = f"{100.0 * self.confidence:g} %"
        if self.status == "rejected":
            worst = max(self.deviations, key=lambda name: abs(self.deviations[name]))
            return (
                f"model rejected ({level} confidence): no {listed(self.intervals)} in the box gives such "
                f"features; farthest off is {worst}, by {self.deviations[worst]:+.3g} times its scatter"
            )
        lines = [
            f"{name}: {format_range(ends, self.units.get(name, ''), 5)} ({level} confidence)"
            for name, ends in self.ranges.items()
        ]
        for one in self.directions:
            along = ", ".join(f"{name} {part:+.2f}" for name, part in one.items())
            lines.append(f"not identifiable along {along} (in half widths of the intervals)")
        if self.open_ends:
            level = f"{100.0 * self.confidence:g} %"
            lines.append(
                f"the region reaches an end of the interval of {listed(self.open_ends)}: there {level} is "
                "approximate; contains(parameters, runs=99) is exact"
            )
        return "\n".join(lines)

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw the region; see `plot_identification`."""
        from ..plots.features import plot_identification

        return plot_identification(self, ax=ax)


def identify(
    source: Study | StudyResult,
    measured: Measured,
    parameters: Sequence[str],
    features: Sequence[TraceFeature | str] | Mapping[str, TraceFeature] | None = None,
    *,
    confidence: float = 0.9,
    runs: int = 400,
    noise: Mapping[str, float | str] | None = None,
    rng: int | np.random.Generator | None = 0,
) -> Identification:
    """The parameters with which a model has the features of a measured trace.

    Runs fill the box of the named parameters; the others of the study are drawn from their distributions or
    intervals, and what they do is scatter, as that of impacts. Features are taken from samples of the runs at
    the instants of the trace, with noise as that of its sensor. A point belongs to the region if the features
    of the trace are no farther from those of the model there than those of the runs nearest to it.

    Parameters
    ----------
    source : Study or StudyResult
        The model, which is simulated at the instants of the trace; or finished runs over time, as they are.
    measured : Measured
        The trace, equally spaced, in the time of the model. What is outside of that of the study is left out.
    parameters : sequence of str
        Names of the parameters to find.
    features : sequence or mapping by name, optional
        Those of the study that are steady (`rms`, `mean`, `contact_share`, `impacts`, those of samples), or
        else the rms of each measured output, if not given; extremes only if they are asked for.
        Such as ``[features.rms("slider.ax"), features.BandPower("slider.ax", 200.0, 2000.0)]``, of outputs
        that were measured, or names of features of the study. `contact_share` and `impacts` of a joint are
        taken from its output ``"JOINT.contact"``. Only statistics of many impacts: single values are not
        predictable after a few.
    confidence : float
        Probability that the region holds the true parameters, at any one point of the box [-].
    runs : int
        Runs of the model [-].
    noise : mapping of str to float or str, optional
        Standard deviation of the noise of each output that is measured with any, in its unit or with a unit.
    rng : int, numpy.random.Generator or None
        Seed or generator of the points and the noise; the seed is kept with the result.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong, the trace does not overlap with the time of the model or has too few samples
        for a feature; all problems are listed.
    SceneError, SimulationError
        As `Study.sample`.

    Examples
    --------
    >>> import chebclear as cc
    >>> import numpy as np
    >>> t = np.linspace(0.0, 1.0, 201)
    >>> def swing(length, size):
    ...     return {"t": t, "x": size * np.sin(np.sqrt(9.81 / length) * 4.0 * t)}
    >>> study = cc.Study(swing, {"length": cc.Interval(0.5, 1.5), "size": cc.Interval(0.1, 0.2)})
    >>> trace = cc.results.Measured({"x": swing(1.0, 0.15)["x"]}, t=t)
    >>> wanted = [cc.features.rms("x"), cc.features.mean("x")]
    >>> found = cc.identify(study, trace, ["length", "size"], wanted, noise={"x": 0.01})
    >>> found.status, found.contains({"length": 1.0, "size": 0.15})
    ('identified', True)
    """
    if not isinstance(source, Study | StudyResult) or not isinstance(measured, Measured):
        given = f"{source!r:.60} and {measured!r:.60}"
        raise ArgumentTypeError(f"source must be a Study or its result, and measured a trace, got {given}")
    if isinstance(source, Study) and isinstance(source.runner.model, FinishedRuns):
        source = source.sample()
    checks = Checks()
    if isinstance(parameters, str) or not parameters:
        checks.add("parameters", f"must be a list of names, got {parameters!r}", wrong_type=True)
    for name in parameters:
        if name not in source.intervals:
            known = meant_or_known(name, source.intervals)
            checks.add("parameters", f'has an unknown name "{name}"{known}')
    level = checks.real("confidence", confidence, "-", above=0.0, below=1.0)
    seed = checks.seed("rng", rng)
    asked = asked_features(checks, features, source, measured)
    if measured.t is None:
        checks.add("measured", "has no instants t")
    checks.finish()
    named = {name: source.intervals[name] for name in parameters}
    columns = [list(source.intervals).index(name) for name in named]
    found = runs if isinstance(source, Study) else len(source.parameters)
    count = checks.whole("runs", found, least=2 * nearest_needed(level), most=MOST_RUNS)
    trace, values = trace_features(checks, source, measured, asked, noise)
    checks.finish()
    if isinstance(source, Study):
        points, table, notices = simulated(source, trace, named, count, seed, {})
        units = source.runner.units
    else:
        series = {name: source.values(name) for name in trace.noise}
        points, table, notices = source.parameters, trace.of(source.t, series, seed), ()
        units = source.units
    if not np.isfinite(table).all():
        checks.add("features", "are beyond the largest number: samples, or their noise, are too large")
    checks.finish()
    issue(notices)
    study = source if isinstance(source, Study) else None
    return Identification(
        named,
        values,
        level,
        len(points),
        seed,
        {name: units[name] for name in named if name in units},
        notices,
        None if study is None else replace(study.runner.spec, features=trace.features),
        _cube=on_cube(named, points[:, columns]),
        _table=table,
        _t=trace.t,
        _noise=trace.noise,
        study=study,
    )
