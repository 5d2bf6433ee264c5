"""The settled motion over one parameter, as the speed: features of every revolution, and what changes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeGuard

import numpy as np
from numpy.typing import NDArray

from ..base import files as records
from ..base.arguments import Checks
from ..base.named import Named
from ..base.prefixes import format_quantity, format_range
from ..base.rows import Array
from ..base.shown import listed, meant_or_known
from ..base.units import unit as unit_of
from ..data.dataset import Dataset, Variable, facts_of
from ..data.exports import Exports
from ..errors import ArgumentError, UnknownNameError
from ..execution.batch import GatheredNotices
from ..execution.failures import FAILED
from ..notices import Notice, WithNotices, issue
from ..report import html
from ..report.document import Document, Table
from ..run.features import Feature
from ..run.resampling import refined
from ..run.settings import MOST_PERIODS, Settings
from ..run.simulation import run_scene
from ..run.trajectory import Trajectory
from ..scene.scene import Interval, Scene
from .band.revolutions import Revolutions
from .bifurcation import GoOn, in_threads
from .by_angle import crank_of, drives_of
from .report.sweep import sweep_document
from .runner import Runner
from .sources.asked import FeatureSpec, known_units, units_of
from .sources.scenes import scene_of
from .spec import check_keywords

if TYPE_CHECKING:
    from matplotlib.axes import Axes


MOST_POINTS = 10_000
# Equal pieces of the time of a revolution: where the speed varies, its ends are known to half of one.
_PIECES = 360
# Samples that measure the angle, and how many a revolution needs at least.
_LOOK, _LEAST_A_TURN = 20_001, 20
# A steady drift over so many revolutions is more than four standard errors of their halves.
_LEAST_TURNS = 8
# Share of the time in contact that is all of it, but for rounding.
_KEPT = 1.0 - 1e-9


@dataclass(frozen=True, eq=False)
class Resonance(records.ArrayRecord):
    """A peak of the mean of a feature, from which it falls on both sides to half the power, 1/sqrt(2) of it.

    Attributes
    ----------
    at : float
        Value of the parameter at the peak, by a parabola through the three highest means.
    value : float
        The mean there, without its sign.
    lower, upper : float
        Values of the parameter at half the power.
    """

    at: float
    value: float
    lower: float
    upper: float


@dataclass(frozen=True, eq=False)
class LiftOff(records.ArrayRecord):
    """Neighboring values of the parameter of which only one keeps contact through all revolutions.

    Attributes
    ----------
    joint : str
        The clearance joint, corner or stop.
    lower, upper : float
        The values of the parameter.
    loses : bool
        Whether it is the lower one that keeps contact.
    """

    joint: str
    lower: float
    upper: float
    loses: bool


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(WithNotices, html.Reported, records.Saved, Named[Array], Exports, kind="sweep"):
    """Features of every revolution over a parameter; see `Study.sweep`.

    A mapping from the names of the features to arrays of shape (points, revolutions), NaN where a run failed.

    Attributes
    ----------
    parameter : str
        Name of the parameter.
    parameter_unit : str
        Its SI unit; empty if it is not known.
    points : Array
        Its values, shape (points,).
    speeds : Array
        Mean angular velocity of the crank [rad/s], shape (points,).
    features : dict[str, Array]
        The features by name.
    units : dict[str, str]
        Their SI units.
    lift_offs : tuple[LiftOff, ...]
        Where joints begin or cease to lose contact.
    notices : tuple[Notice, ...]
        Runs that failed, warnings of the runs, and features that have not settled.
    """

    _axes: ClassVar = {"points": ("points",), "speeds": ("points",), "features": ("points", "turns")}

    parameter: str
    parameter_unit: str
    points: Array
    speeds: Array = field(metadata=unit_of("rad/s"))
    features: dict[str, Array]
    units: dict[str, str]
    lift_offs: tuple[LiftOff, ...]
    notices: tuple[Notice, ...]

    @property
    def _names(self) -> tuple[str, ...]:
        return tuple(self.features)

    def _entry(self, name: str) -> Array:
        if name not in self.features:
            raise UnknownNameError(f'unknown feature "{name}"{meant_or_known(name, self.features)}')
        return self.features[name]

    def settled(self, name: str) -> NDArray[np.bool_]:
        """Whether the later half of the revolutions is as the earlier one, shape (points,).

        It is not where the means of both differ by more than four standard errors, or the earlier half
        scatters more than three times as much, and that is more than 1 % of the largest mean of the sweep.
        """
        every = self[name]
        halves = np.array_split(every, 2, axis=1)
        means = [half.mean(axis=1) for half in halves]
        spreads = [half.std(axis=1, ddof=1) for half in halves]
        error = np.hypot(*spreads) / math.sqrt(every.shape[1] / 2)
        matters = 0.01 * np.nanmax(np.abs(every.mean(axis=1)), initial=0.0)
        drifts = np.abs(means[1] - means[0]) > np.maximum(4.0 * error, matters)
        decays = spreads[0] > np.maximum(3.0 * spreads[1], matters)
        still: NDArray[np.bool_] = ~(drifts | decays)
        return still

    def resonances(self, name: str) -> tuple[Resonance, ...]:
        """Peaks of the mean that fall to half the power on both sides, and stand out of the scatter there."""
        sizes, found = np.abs(self[name].mean(axis=1)), []
        for k in range(1, len(sizes) - 1):
            below, peak, above = sizes[k - 1 : k + 2]
            if not below < peak >= above:
                continue
            shift = 0.5 * (below - above) / (below - 2.0 * peak + above)
            peak -= 0.25 * (below - above) * shift
            ends = [
                _fall(self.points[side], sizes[side], peak) for side in (slice(k, None, -1), slice(k, None))
            ]
            stands_out = np.quantile(np.abs(self[name][k]), 0.05) > math.sqrt(0.5) * peak
            if stands_out and ends[0] is not None and ends[1] is not None:
                at = self.points[k] + shift * (self.points[1] - self.points[0])
                found.append(Resonance(float(at), float(peak), ends[0], ends[1]))
        return tuple(found)

    @property
    def statistics(self) -> dict[str, Array]:
        """Parameter, speed, and of each feature mean, scatter (standard deviation), 5, 50 and 95 % quantile
        over the revolutions, by names with units, each of shape (points,)."""
        columns = {self.parameter: self.points, "speed [rad/s]": self.speeds}
        for name, every in self.features.items():
            for word, column in _statistics(every).items():
                columns[f"{word} of {name} [{self.units[name]}]"] = column
        return columns

    def dataset(self) -> Dataset:
        """The statistics, a row for each value of the parameter, with the features of all revolutions.

        They are ``FEATURE.mean``, ``.scatter``, ``.lower``, ``.median`` and ``.upper`` (5 and 95 %), and
        ``FEATURE.revolutions`` over ``point`` and ``revolution``.
        """
        point = ("point",)
        variables = {
            "point": Variable(point, np.arange(len(self.points)), "-"),
            f"parameters.{self.parameter}": Variable(point, self.points, self.parameter_unit),
            "speed": Variable(point, self.speeds, "rad/s"),
        }
        words = ("mean", "scatter", "lower", "median", "upper")
        for name, every in self.features.items():
            unit = self.units[name]
            for word, column in zip(words, _statistics(every).values(), strict=True):
                variables[f"{name}.{word}"] = Variable(point, column, unit)
            variables[f"{name}.revolutions"] = Variable(("point", "revolution"), every, unit)
        return Dataset("point", variables, facts_of(self))

    @property
    def table(self) -> Table:
        """The statistics, one row for each value of the parameter."""
        columns = self.statistics
        rows = [[f"{cell:.6g}" for cell in row] for row in zip(*columns.values(), strict=True)]
        return Table(f"Features of the revolutions over {self.parameter}", list(columns), rows)

    def __repr__(self) -> str:
        what = f"<Sweep of {listed(self.features, most=4)} over {self.parameter}"
        return f"{what}: {len(self.points)} values from {self.points[0]:g} to {self.points[-1]:g}>"

    def __str__(self) -> str:
        lines = []
        for name in self.features:
            mean = self[name].mean(axis=1)
            known = mean[np.isfinite(mean)].tolist() or [np.nan]
            text = f"{name}: mean {format_range((min(known), max(known)), self.units[name])}"
            for one in self.resonances(name):
                text += f"; resonance at {format_quantity(one.at, self.parameter_unit, 4)}"
            moving = np.count_nonzero(~self.settled(name))
            lines.append(text + (f"; not settled at {moving} of {len(mean)} values" if moving else ""))
        for found in self.lift_offs:
            ends = (format_quantity(end, self.parameter_unit, 4) for end in (found.lower, found.upper))
            word = "begins" if found.loses else "ceases"
            lines.append(f"{found.joint} {word} to lose contact between {' and '.join(ends)}")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return html.fragment(repr(self)[1:-1], [self.table])

    def _document(self, title: str | None) -> Document:
        return sweep_document(self, title)

    def plot(self, name: str, *, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw a feature over the parameter, with resonances and lift-off; see `plot_sweep`."""
        from ..plots.bifurcations import plot_sweep

        return plot_sweep(self, name, ax=ax, **options)


def _statistics(every: Array) -> dict[str, Array]:
    """Mean, scatter and quantiles over the revolutions, each of shape (points,)."""
    low, middle, high = np.quantile(every, (0.05, 0.5, 0.95), axis=1)
    numbers = {"mean": every.mean(axis=1), "scatter": every.std(axis=1, ddof=1)}
    return numbers | {"5 %": low, "50 %": middle, "95 %": high}


def _fall(values: Array, sizes: Array, peak: float) -> float | None:
    """Where sizes fall from a peak at the first of them to half its power; None if they rise above it."""
    ends = np.flatnonzero((sizes <= math.sqrt(0.5) * peak) | ~(sizes <= peak))
    if not len(ends) or not sizes[ends[0]] <= peak:
        return None
    last = ends[0] + 1
    return float(np.interp(-math.sqrt(0.5) * peak, -sizes[last - 2 : last], values[last - 2 : last]))


def sweep_of(
    runner: Runner,
    parameter: str,
    lower: float | str,
    upper: float | str,
    points: int,
    revolutions: int,
    discard: int,
    angle: str | None,
) -> Sweep:
    """The sweep of `Study.sweep`; see there."""
    settings = runner.settings
    if settings is None:
        raise ArgumentError("a sweep needs scenes: a model of your own has no revolutions")
    checks = Checks()
    fixed = {name: one for name, one in runner.fixed.items() if name != parameter}
    if isinstance(parameter, str):
        check_keywords(checks, runner.build, {**runner.intervals, parameter: None}, fixed)
    else:
        checks.add("parameter", f"must name a keyword of build, got {parameter!r}", wrong_type=True)
    count = checks.whole("points", points, least=3, most=MOST_POINTS)
    kept = checks.whole("revolutions", revolutions, least=_LEAST_TURNS, most=MOST_PERIODS)
    skipped = checks.whole("discard", discard, least=0, most=MOST_PERIODS)
    asked = [one for one in runner.features.values() if _is_of_a_turn(one)]
    if not asked or len(asked) < len(runner.features):
        text = "must be those of a revolution, such as the peak of an output, without a window, and no others"
        checks.add("features", text)
    unit = ""
    if isinstance(parameter, str) and not checks.noted("parameter"):
        unit = (known_units(runner.build, [parameter]) | dict(runner.units)).get(parameter, "")
    ends = [checks.real(name, end, unit or "SI unit") for name, end in (("lower", lower), ("upper", upper))]
    checks.finish()
    box = Interval(*ends)
    at = np.linspace(box.lower, box.upper, count)
    source = replace(runner, fixed=fixed)
    scenes = [scene_of(source, {**runner.nominal, parameter: value}) for value in at.tolist()]
    crank = crank_of(checks, scenes[0], angle)
    checks.finish()
    joints = scenes[0].check().clearance_joints
    wanted = [*asked, *(Feature("contact_share", joint) for joint in joints)]
    tracked = replace(settings, outputs=(), features=_tracked(wanted), cycles=1).fitted(scenes[0].check())

    def found_at(index: int, go_on: GoOn) -> _Turned:
        try:
            return _revolutions(scenes[index], tracked, wanted, crank, kept, skipped, go_on)
        except _Failed as error:
            nothing = np.full((kept, len(wanted)), np.nan)
            return _Turned(nothing, np.nan, (Notice(FAILED, str(error)),))

    found = in_threads(found_at, count, runner.execution.threads, runner.progress)
    notices = _told(parameter, at, found)
    table, names = np.array([one.features for one in found]), tuple(runner.features)
    units = units_of(names, runner.features, runner.units, simulated=True)
    contact = {joint: table[:, :, len(names) + k] for k, joint in enumerate(joints)}
    sweep = Sweep(
        parameter,
        unit,
        at,
        np.array([one.speed for one in found]),
        {name: table[:, :, k] for k, name in enumerate(names)},
        dict(zip(names, units, strict=True)),
        tuple(_lift_offs(at, contact)),
        notices,
    )
    moving = [name for name in names if not np.all(sweep.settled(name))]
    if moving:
        text = f"not settled at all values: {listed(moving)}; discard more revolutions"
        sweep = replace(sweep, notices=(*notices, Notice("unsettled", text, tuple(moving))))
    issue(sweep.notices)
    return sweep


class _Failed(Exception):
    """Why a value of the parameter has no features."""


class _Turned(NamedTuple):
    """A run by its revolutions."""

    features: Array
    """Shape (revolutions, features)."""
    speed: float
    """Mean angular velocity [rad/s]."""
    notices: tuple[Notice, ...]


def _told(parameter: str, at: Array, found: Sequence[_Turned]) -> tuple[Notice, ...]:
    """Failures and notices of the runs, each kind once with its first run; an error if all failed."""
    gathered = GatheredNotices()
    for k, one in enumerate(found):
        gathered.add(k, one.notices)
    notices = []
    for runs, told in gathered.kinds():
        failed = told.code == FAILED
        what = f"{len(runs)} of {len(found)} runs{' failed and are NaN' if failed else ''}"
        text = f"{what}, the first at {parameter} = {at[runs[0]]:g}: {told.text}"
        if failed and len(runs) == len(found):
            raise ArgumentError(text)
        notices.append(replace(told, text=text, numbers={"runs": len(runs), "of_runs": len(found)}))
    return tuple(notices)


def _is_of_a_turn(feature: FeatureSpec) -> TypeGuard[Feature]:
    return isinstance(feature, Feature) and feature.unit != "s" and feature.window is None


def _tracked(wanted: list[Feature]) -> tuple[Feature, ...]:
    """Features of pieces from which those of revolutions follow: a range is that of the extrema."""
    parts = {"peak_to_peak": ("peak", "lowest")}
    found = [Feature(kind, one.of) for one in wanted for kind in parts.get(one.kind, (one.kind,))]
    return tuple(dict.fromkeys(found))


def _revolutions(
    scene: Scene, settings: Settings, wanted: list[Feature], crank: str, kept: int, skipped: int, go_on: GoOn
) -> _Turned:
    """A run until it has made its revolutions; `_Failed` if it does not."""
    drive = drives_of(scene).get(crank)
    if drive is not None:
        sense, pieces = math.copysign(1.0, drive.speed), 1
        ends = 2.0 * math.pi / abs(drive.speed) * (skipped + np.arange(kept + 1))
    else:
        # The same run first with its angle: features are then those of small pieces of it.
        column = f"{crank}.angle"
        look = _done(scene, replace(settings, skip=0.0, samples=_LOOK, outputs=(column,), features=()), go_on)
        sense, pieces = math.copysign(1.0, look[column][-1] - look[column][0]), _PIECES
        turns = Revolutions(crank, kept, skipped, float(look[column][0]), int(sense), 2)
        instants = turns.instants(look.t, look[column])
        if isinstance(instants, float):
            raise _Failed(f"{instants:.3g} revolutions in {look.t[-1]:g} s, {kept + skipped} are needed")
        if np.max(np.abs(np.diff(look[column]))) > 2.0 * math.pi / _LEAST_A_TURN:
            raise _Failed(f"more than {_LOOK // _LEAST_A_TURN} revolutions: give a shorter duration")
        ends = refined(instants, look.t, look[column])
    span = float(ends[-1] - ends[0])
    timed = replace(settings, skip=float(ends[0]), duration=span, samples=2, cycles=kept * pieces)
    run = _done(scene, timed, go_on)
    places = (ends - ends[0]) / span * (kept * pieces)
    parts = dict(zip(timed.features, run.features.T, strict=True))
    rows = np.stack([_of_revolutions(one, parts, places) for one in wanted], axis=1)
    return _Turned(rows, sense * 2.0 * math.pi * kept / span, run.notices)


def _done(scene: Scene, settings: Settings, go_on: GoOn) -> Trajectory:
    run = run_scene(scene, settings, go_on)
    if not run.success:
        raise _Failed(run.message)
    return run


def _of_revolutions(one: Feature, parts: Mapping[Feature, Array], places: Array) -> Array:
    """A feature of revolutions from that of pieces of equal length; `places` are the ends, in pieces."""
    if one.kind == "peak_to_peak":
        highest, lowest = (Feature(kind, one.of) for kind in ("peak", "lowest"))
        return _of_revolutions(highest, parts, places) - _of_revolutions(lowest, parts, places)
    values = parts[one]
    if one.kind in _WHOLE:
        # A piece belongs to the revolution that holds its middle.
        gathered: Array = _WHOLE[one.kind].reduceat(values, np.round(places[:-1]).astype(int))
        return gathered
    sums = np.concatenate([[0.0], np.cumsum(values**2 if one.kind == "rms" else values)])
    total: Array = np.diff(np.interp(places, np.arange(len(sums)), sums))
    if one.kind in ("impulse", "wear", "loss"):
        return total
    mean: Array = total / np.diff(places)
    return np.sqrt(mean) if one.kind == "rms" else mean


_WHOLE = {"peak": np.maximum, "lowest": np.minimum, "impacts": np.add}


def _lift_offs(values: Array, contact: Mapping[str, Array]) -> Iterator[LiftOff]:
    for joint, share in contact.items():
        known = np.flatnonzero(np.isfinite(share).all(axis=1))
        kept = np.all(share[known] >= _KEPT, axis=1)
        for k in np.flatnonzero(kept[1:] != kept[:-1]):
            yield LiftOff(joint, float(values[known[k]]), float(values[known[k + 1]]), loses=bool(kept[k]))
