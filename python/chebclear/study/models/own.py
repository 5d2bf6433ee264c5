"""Models of the user's own: callables that return named time series and numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...base.arguments import Checks, as_number, did_you_mean
from ...base.units import unit
from ...errors import describe
from ...run.features import JOINT_KINDS, Feature
from ...run.settings import RunOptions
from ...scene.scene import Interval, Scene
from ..features.features import Asked, called

Array = NDArray[np.float64]

# Steps of the time axis may differ by so much of themselves: rounding of what was read from a text.
_EVEN = 1e-3


@dataclass(frozen=True)
class Returned:
    """Runs of a study, the nominal one last."""

    t: Array = field(metadata=unit("s"))
    """Instants [s], shape (samples,)."""
    outputs: tuple[str, ...]
    """Names of the outputs."""
    values: Array
    """All outputs of all runs in their units, shape (runs + 1, samples, outputs)."""
    features: Array | None
    """Features of all runs, shape (runs + 1, cycles, features); None if there are none."""
    feature_names: tuple[str, ...]
    """Names of the features."""
    warnings: tuple[str, ...] = ()
    """What the user should be warned of."""
    nominal_parameters: Array | None = None
    """Parameters of the run that stands for the nominal one, shape (parameters,); None at the midpoint."""


class _Run(NamedTuple):
    """What a model returned, checked."""

    t: Array
    series: dict[str, Array]
    numbers: dict[str, float]


def time_axis(checks: Checks, given: object) -> Array:
    """Instants of a model; empty if something is wrong with them, which is noted in `checks`."""
    try:
        t = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        checks.add(f"t must be instants [s], got {given!r}", wrong_type=True)
        return np.empty(0)
    if t.ndim != 1 or len(t) < 2:
        checks.add(f"t must be at least 2 instants [s], shape (samples,), got shape {t.shape}")
        return np.empty(0)
    steps = np.diff(t)
    if not np.all(np.isfinite(t)) or steps.min() <= 0.0:
        checks.add("t must be finite and rise from instant to instant")
        return np.empty(0)
    if steps.max() - steps.min() > _EVEN * steps.mean():
        checks.add(
            f"t must be equally spaced, its steps go from {steps.min():.6g} to {steps.max():.6g} s: "
            "interpolate the outputs first, with numpy.interp"
        )
        return np.empty(0)
    return t


def _read(given: object) -> _Run:
    """What a model returned, checked; all problems together."""
    checks = Checks()
    if isinstance(given, Scene):
        raise TypeError("it returned a Scene: a study of scenes needs duration and samples")
    if not isinstance(given, Mapping):
        raise TypeError(
            "a model must return a Scene, or a mapping such as {'t': instants, 'force': values, 'stroke': "
            f"0.03}}, got {given!r}"
        )
    t = time_axis(checks, given["t"]) if "t" in given else np.empty(0)
    series, numbers = {}, {}
    for name, value in given.items():
        if not isinstance(name, str):
            checks.add(f"names of outputs must be texts, got {name!r}", wrong_type=True)
        elif name != "t":
            number = as_number(value)
            if number is None:
                series[name] = _series(checks, name, value, t, timed="t" in given)
            elif not math.isfinite(number):
                checks.add(f'"{name}" is not finite: {value!r}')
            else:
                numbers[name] = number
    if not series and not numbers:
        checks.add(f"a model must return at least one output besides t, got {sorted(map(str, given))}")
    checks.finish()
    return _Run(t, series, numbers)


def _series(checks: Checks, name: str, value: object, t: Array, *, timed: bool) -> Array:
    """One output over time."""
    array = np.asarray(value)
    if array.dtype.kind not in "iuf":
        checks.add(f'"{name}" must be a number or an array of numbers, got {value!r}', wrong_type=True)
    elif not timed:
        checks.add(f'"{name}" is an array of shape {array.shape} without a time axis: return "t" as well')
    elif len(t) and array.shape != t.shape:
        checks.add(
            f'"{name}" must have a value for each of the {len(t)} instants of t, shape {t.shape}, got shape '
            f"{array.shape}"
        )
    elif not np.all(np.isfinite(array)):
        first = int(np.flatnonzero(~np.isfinite(array.ravel()))[0])
        at = f"t = {t[first]:.6g} s" if len(t) else f"sample {first}"
        checks.add(f'"{name}" is not finite at {at}')
    return array.astype(float) if array.dtype.kind in "iuf" else np.empty(0)


def sampled_feature(feature: Feature, t: Array, values: Array, cycles: int) -> Array:
    """A feature of sampled values, whatever is between the samples, shape (..., cycles).

    Parameters
    ----------
    feature : Feature
        One of an output.
    t : ndarray, shape (samples,)
        Instants [s].
    values : ndarray, shape (..., samples)
        In the unit of the output.
    cycles : int
        Equal pieces of the time [-]; each needs two samples.

    Raises
    ------
    ValueError
        If there are too few samples.
    """
    pieces = np.linspace(0, len(t) - 1, cycles + 1).round().astype(int)
    if np.diff(pieces).min() < 1:
        raise ValueError(f"{cycles} cycles need at least {cycles + 1} samples, got {len(t)}")
    found = []
    for first, last in pairwise(pieces):
        times, piece = t[first : last + 1], values[..., first : last + 1]
        span = times[-1] - times[0]
        match feature.kind:
            case "peak":
                found.append(piece.max(axis=-1))
            case "lowest":
                found.append(piece.min(axis=-1))
            case "peak_to_peak":
                found.append(np.ptp(piece, axis=-1))
            case "time_of_peak":
                found.append(times[piece.argmax(axis=-1)])
            case "time_of_lowest":
                found.append(times[piece.argmin(axis=-1)])
            case "mean":
                found.append(_integral(times, piece) / span)
            case _:
                found.append(np.sqrt(_integral(times, piece**2) / span))
    return np.stack(found, axis=-1)


def _integral(t: Array, values: Array) -> Array:
    """By trapezoids; NumPy renamed its own."""
    return np.asarray(0.5 * (values[..., 1:] + values[..., :-1]) @ np.diff(t))


def chosen_outputs(known: Sequence[str], outputs: Sequence[str] | None) -> tuple[str, ...]:
    """The outputs of a model by names or patterns, in the order of the names; all if none are given."""
    if outputs is None:
        return tuple(known)
    checks = Checks()
    chosen: list[str] = []
    for wanted in outputs:
        matching = [name for name in known if name == wanted or fnmatchcase(name, wanted)]
        if not matching:
            has = ", ".join(known) or "no time series"
            checks.add(f'the model has no output "{wanted}": it has {has}{did_you_mean(wanted, known)}')
        chosen += matching
    checks.finish()
    return tuple(dict.fromkeys(chosen))


def check_own_features(checks: Checks, asked: Mapping[str, Asked]) -> None:
    """Refuse features that only the core of a simulation finds."""
    for name, feature in asked.items():
        if isinstance(feature, Feature) and feature.kind in JOINT_KINDS:
            checks.add(
                f'features["{name}"]: {feature} is found in simulations of scenes only; a model of your own '
                "returns it as a number"
            )


@dataclass(frozen=True, eq=False)
class OwnModel:
    """A callable of the user, called at every point."""

    call: Callable[..., Any]
    """Called as ``call(**parameters, **fixed)``."""
    intervals: dict[str, Interval]
    """Interval of each parameter by name."""
    fixed: Mapping[str, Any]
    """Further keywords, the same for all runs."""
    outputs: Sequence[str] | None
    """Names or patterns of the time series that are kept; all if None."""
    features: Mapping[str, Asked]
    """What is found of every run besides the numbers that the model returns."""
    cycles: int
    """Equal pieces of the time, each with features of its own [-]."""
    executor: Executor | None
    """Where to call; here, one after the other, if None."""

    def runs(self, points: Array, *, midpoint: bool, report: Callable[[int, int], None] | None) -> Returned:
        """The runs at the points and, if asked for, last at the midpoint.

        `report` gets the runs done and the runs in all.

        Raises
        ------
        ValueError, TypeError
            If the model returns something else than finite numbers, or its runs differ in names or instants.
        """
        middle = np.array([side.midpoint for side in self.intervals.values()])
        rows = np.vstack([points, middle]) if midpoint else points
        given = [dict(zip(self.intervals, map(float, row), strict=True)) for row in rows]
        first: _Run | None = None
        for row, value in enumerate(self._returned(given)):
            try:
                run = _read(value)
                if first is None:
                    first = run
                    chosen = chosen_outputs(list(run.series), self.outputs)
                    names = self._feature_names(list(run.numbers))
                    values = np.empty((len(given), len(run.t) if chosen else 0, len(chosen)))
                    features = np.empty((len(given), self.cycles, len(names)))
                _require_same(first, run)
            except (ValueError, TypeError) as error:
                raise type(error)(f"the model with {describe(given[row])}: {error}") from None
            for column, name in enumerate(chosen):
                values[row, :, column] = run.series[name]
            features[row] = self._features(run, value, given[row]).T
            if report is not None:
                report(row + 1, len(given))
        assert first is not None, "a study has at least one point"
        return Returned(
            t=first.t,
            outputs=chosen,
            values=values,
            features=features if names else None,
            feature_names=names,
        )

    def _returned(self, given: Sequence[Mapping[str, float]]) -> Iterator[object]:
        """What the model returns at each point; its own exceptions get a note with the parameters."""
        futures = []
        if self.executor is not None:
            futures = [self.executor.submit(self.call, **parameters, **self.fixed) for parameters in given]
        try:
            for row, parameters in enumerate(given):
                try:
                    yield futures[row].result() if futures else self.call(**parameters, **self.fixed)
                except Exception as error:
                    error.add_note(f"in the model with {describe(parameters)}")
                    raise
        finally:
            for future in futures:
                future.cancel()

    def _feature_names(self, numbers: Sequence[str]) -> tuple[str, ...]:
        both = [name for name in numbers if name in self.features]
        if both:
            raise ValueError(f'"{both[0]}" is a number that the model returns and a name in features')
        return (*self.features, *numbers)

    def _features(self, run: _Run, value: Any, parameters: Mapping[str, float]) -> Array:
        """Features of a run, those asked for and then the numbers it has, shape (features, cycles)."""
        rows = []
        for name, asked in self.features.items():
            try:
                if isinstance(asked, Feature):
                    series = run.series[chosen_outputs(list(run.series), [asked.of])[0]]
                    rows.append(sampled_feature(asked, run.t, series, self.cycles))
                else:
                    rows.append(called(name, asked, value, self.cycles))
            except Exception as error:
                error.add_note(f'in feature "{name}" of the run with {describe(parameters)}')
                raise
        rows += [np.full(self.cycles, number) for number in run.numbers.values()]
        return np.array(rows).reshape(-1, self.cycles)


def _require_same(first: _Run, run: _Run) -> None:
    """Refuse a run that cannot stand in one table with the first one."""
    for kind, mine, others in (
        ("time series", run.series, first.series),
        ("numbers", run.numbers, first.numbers),
    ):
        if list(mine) != list(others) and set(mine) != set(others):
            raise ValueError(f"it returns the {kind} {sorted(mine)}, the first run {sorted(others)}")
    if run.t.shape != first.t.shape:
        raise ValueError(f"t has {len(run.t)} instants, {len(first.t)} in the first run")
    if len(run.t) and np.max(np.abs(run.t - first.t)) > 1e-9 * (first.t[-1] - first.t[0]):
        raise ValueError("t has other instants than in the first run: interpolate to the same ones")


def check_unused(checks: Checks, given: Iterable[str]) -> None:
    """Refuse what only a simulation knows, and what nothing knows."""
    for name in given:
        if name not in RunOptions.__annotations__:
            known = RunOptions.__annotations__
            checks.add(f'unknown keyword "{name}"{did_you_mean(name, known)}', wrong_type=True)
            continue
        checks.add(
            f"{name} is that of a simulation: give duration and samples too, or leave it out for "
            "a model of your own"
        )
