"""Models of the user's own: callables that return named time series and numbers."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ...base.arguments import Checks, did_you_mean
from ...base.rows import Array
from ...errors import ArgumentError, describe
from ...execution.failures import failure_notices
from ...execution.limited import LimitedCalls
from ...execution.store import Store
from ...notices import Notice
from ...run.features import JOINT_KINDS, Feature
from ...run.settings import RunOptions
from ..polynomials.points import nominal_point
from .asked import FeatureSpec, called, require_known
from .calling import Calling, call_model
from .reached import model_facts
from .returned import ReturnedRun
from .run_table import RunTable

if TYPE_CHECKING:
    from ..runner import Runner


def sampled_feature(feature: Feature, t: Array, values: Array, cycles: int) -> Array:
    """A feature of sampled values of shape (..., samples), in equal pieces of the time, shape (..., cycles);
    values between the samples do not count. ValueError if there are too few."""
    if cycles > len(t) - 1:
        raise ArgumentError(f"{cycles} cycles need at least {cycles + 1} samples, got {len(t)}")
    found = []
    # What is too large for a number is told below.
    with np.errstate(over="ignore", invalid="ignore"):
        for first, last in pairwise(np.linspace(0.0, len(t) - 1.0, cycles + 1)):
            times, piece = _between(first, last, t), _between(first, last, values)
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
                case "rms":
                    # Relative to the largest, whose square is a number then.
                    size = np.maximum(np.max(np.abs(piece), axis=-1), math.ulp(0.0))
                    found.append(size * np.sqrt(_integral(times, (piece / size[..., None]) ** 2) / span))
                case kind:
                    raise NotImplementedError(f"{kind} of samples")
    if not np.all(np.isfinite(found)):
        raise ArgumentError(f'{feature.kind}("{feature.of}") is not finite: the values are too large')
    return np.stack(found, axis=-1)


def _between(first: float, last: float, values: Array) -> Array:
    """Values from one place in a row of samples to another, interpolated linearly at ends between samples."""
    slack = 1e-9 * values.shape[-1]
    inner = np.arange(math.ceil(first - slack), math.floor(last + slack) + 1)
    places = np.concatenate(
        [[first] if inner[0] - first > slack else [], inner, [last] if last - inner[-1] > slack else []]
    )
    before = np.minimum(places.astype(int), values.shape[-1] - 2)
    part = places - before
    return np.asarray(values[..., before] * (1.0 - part) + values[..., before + 1] * part)


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
            checks.add("outputs", f'name "{wanted}": the model has {has}{did_you_mean(wanted, known)}')
        chosen += matching
    checks.finish()
    return tuple(dict.fromkeys(chosen))


def check_own_features(checks: Checks, asked: Mapping[str, FeatureSpec]) -> None:
    """Refuse features that only the core of a simulation finds."""
    for name, feature in asked.items():
        if isinstance(feature, Feature) and feature.kind in JOINT_KINDS:
            checks.add(
                f'features["{name}"]',
                f"is {feature}, which is found in simulations of scenes only; a model of your own "
                "returns it as a number",
            )


@dataclass(eq=False)
class OwnModel:
    """A model of the user's, called at every point."""

    version: str | None
    """What a store compares instead of the code of the model and what it uses."""
    first: ReturnedRun | None = field(default=None, init=False)
    """The run with whose names and instants all others are compared; None before there is one."""

    def runs(
        self, runner: Runner, points: Array, midpoint: bool, report: Callable[[int, int], None] | None
    ) -> RunTable:
        """The runs at the points and, if asked for, last at the nominal values; see `Study` for its errors.

        `report` gets the runs done and the runs in all.
        """
        execution = runner.execution
        rows = np.vstack([points, nominal_point(runner.intervals)]) if midpoint else points
        given = [dict(zip(runner.intervals, map(float, row), strict=True)) for row in rows]
        store = None
        if execution.store is not None:
            store = Store(execution.store, model_facts(runner.build, runner.fixed, self.version))
        table = ModelTable(runner, given)
        call = functools.partial(call_model, runner.build, runner.fixed)
        nominal = len(given) - 1 if midpoint else None
        calling = Calling(call, given, nominal, execution, store, table, self.first)
        try:
            calling.run(report)
        finally:
            table.limited.close()
            if store is not None:
                store.close()
        self.first = calling.first
        failures = calling.failures()
        failed = {one.index for one in failures}
        kept = np.array([number for number in range(len(given)) if number not in failed], dtype=np.intp)
        remarks = () if store is None else tuple(store.remarks)
        points_kept = kept[: len(kept) - midpoint]
        return RunTable(
            parameters=rows[points_kept],
            kept=points_kept,
            t=table.t,
            outputs=table.chosen,
            values=table.values[kept],
            features=table.features[kept] if table.names else None,
            feature_names=table.names,
            notices=(*failure_notices(failures, len(given)), *(Notice("store", text) for text in remarks)),
            failures=failures,
        )


class ModelTable:
    """The runs of a model as arrays, with their features."""

    def __init__(self, runner: Runner, given: Sequence[Mapping[str, float]]) -> None:
        self._runner = runner
        self._given = given
        self.limited = LimitedCalls(runner.execution.run_seconds)

    def begin(self, first: ReturnedRun) -> None:
        """Allocate memory for runs like this one."""
        runner, count = self._runner, len(self._given)
        both = [name for name in first.numbers if name in runner.features]
        if both:
            raise ArgumentError(f'"{both[0]}" is a number that the model returns and a name in features')
        checks = Checks()
        known = [*runner.intervals, *first.series, *runner.features, *first.numbers]
        require_known(checks, runner.units, known)
        checks.finish()
        self.t = first.t
        self.chosen = chosen_outputs(list(first.series), runner.outputs)
        self.names = (*runner.features, *first.numbers)
        self.values = np.empty((count, len(first.t) if self.chosen else 0, len(self.chosen)))
        self.features = np.empty((count, runner.cycles, len(self.names)))
        self._numbers = tuple(first.numbers)

    def fill(self, number: int, run: ReturnedRun) -> None:
        """Keep a run."""
        for column, name in enumerate(self.chosen):
            self.values[number, :, column] = run.series[name]
        self.features[number] = self._features(run, self._given[number]).T

    def _features(self, run: ReturnedRun, parameters: Mapping[str, float]) -> Array:
        """Features of a run, those asked for and then the numbers it has, shape (features, cycles)."""
        rows, cycles = [], self._runner.cycles
        for name, asked in self._runner.features.items():
            try:
                if isinstance(asked, Feature):
                    series = run.series[chosen_outputs(list(run.series), [asked.of])[0]]
                    rows.append(sampled_feature(asked, run.t, series, cycles))
                else:
                    rows.append(self.limited(called, name, asked, run.mapping, cycles))
            except Exception as error:
                error.add_note(f'in feature "{name}" of the run with {describe(parameters)}')
                raise
        rows += [np.full(cycles, run.numbers[name]) for name in self._numbers]
        return np.array(rows).reshape(-1, cycles)


def check_unused(checks: Checks, given: Iterable[str]) -> None:
    """Refuse settings of simulations, and unknown keywords."""
    for name in given:
        if name not in RunOptions.__annotations__:
            known = RunOptions.__annotations__
            checks.add(name, f"is no keyword{did_you_mean(name, known)}", wrong_type=True)
            continue
        checks.add(
            name,
            "is that of a simulation: give duration and samples too, or leave it out for a model of your own",
        )
