"""Checked results of a user's model."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ...base.arguments import Checks, as_number
from ...base.rows import Array
from ...errors import ArgumentError, ArgumentTypeError, cut
from ...execution.failures import NotFiniteError
from ...scene.scene import Scene

# Largest relative difference of the steps of the time axis, by rounding in text files.
_EVEN = 1e-3


class ReturnedRun(NamedTuple):
    """The result of a model for one run."""

    t: Array
    """Instants [s], shape (samples,); empty if there are only numbers."""
    series: dict[str, Array]
    """Outputs by name, shape (samples,)."""
    numbers: dict[str, float]
    """Numbers by name."""

    @property
    def mapping(self) -> dict[str, Any]:
        """The run as the model returned it."""
        return ({"t": self.t} if self.series else {}) | self.series | self.numbers


def time_axis(checks: Checks, given: object) -> Array:
    """Instants of a model; empty after adding a problem to `checks`."""
    try:
        # Imaginary parts would be lost, and dates have no origin.
        if np.asarray(given).dtype.kind in "cmM":
            raise TypeError
        # A copy, so that later changes of the caller's array are not those of the result.
        t: Array = np.ma.filled(np.ma.array(given, dtype=float, copy=True), np.nan)
    except (TypeError, ValueError, OverflowError):
        checks.add("t", f"must be instants [s], got {cut(repr(given))}", wrong_type=True)
        return np.empty(0)
    if t.ndim != 1 or len(t) < 2:
        checks.add("t", f"must be at least 2 instants [s], shape (samples,), got shape {t.shape}")
        return np.empty(0)
    steps = np.diff(t)
    if not np.all(np.isfinite(t)) or steps.min() <= 0.0:
        checks.add("t", "must be finite and rise from instant to instant")
        return np.empty(0)
    if steps.max() - steps.min() > _EVEN * steps.mean():
        checks.add(
            "t",
            f"must be equally spaced, its steps go from {steps.min():.6g} to {steps.max():.6g} s: "
            "interpolate the outputs first, with numpy.interp",
        )
        return np.empty(0)
    return t


def read_run(given: object) -> ReturnedRun:
    """The result of a model, checked: TypeError or ValueError, all problems together, if it is not a mapping
    of instants, arrays and numbers, NotFiniteError if it is one with values that are not finite."""
    checks = Checks()
    unknown: list[str] = []
    if isinstance(given, Scene):
        raise ArgumentTypeError("it returned a Scene: a study of scenes needs duration and samples")
    if not isinstance(given, Mapping):
        raise ArgumentTypeError(
            "a model must return a Scene, or a mapping such as {'t': instants, 'force': values, 'stroke': "
            f"0.03}}, got {cut(repr(given))}"
        )
    t = time_axis(checks, given["t"]) if "t" in given else np.empty(0)
    series, numbers = {}, {}
    for name, value in given.items():
        if not isinstance(name, str):
            checks.add("outputs", f"must have texts as names, got {name!r}", wrong_type=True)
        elif name != "t":
            number = as_number(value)
            if number is None:
                series[name] = _series(checks, unknown, name, value, t, timed="t" in given)
            elif not math.isfinite(number):
                unknown.append(f'"{name}" is not finite: {cut(repr(value))}')
            else:
                numbers[name] = number
    if not series and not numbers and not unknown:
        checks.add("outputs", f"must be at least one besides t, got {sorted(map(str, given))}")
    checks.names("outputs", given)
    checks.finish()
    if unknown:
        raise NotFiniteError("\n".join(unknown))
    return ReturnedRun(t, series, numbers)


def _series(checks: Checks, unknown: list[str], name: str, value: object, t: Array, *, timed: bool) -> Array:
    """One output over time."""
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        first = int(np.flatnonzero(np.ma.getmaskarray(value).ravel())[0])
        unknown.append(f'"{name}" is masked in sample {first}')
    array = np.asarray(value)
    if array.dtype.kind not in "iuf":
        checks.add(name, f"must be a number or an array of numbers, got {cut(repr(value))}", wrong_type=True)
    elif not timed:
        checks.add(name, f'is an array of shape {array.shape} without a time axis: return "t" as well')
    elif len(t) and array.shape != t.shape:
        checks.add(
            name,
            f"must have a value for each of the {len(t)} instants of t, shape {t.shape}, got {array.shape}",
        )
    elif not np.all(np.isfinite(array)):
        first = int(np.flatnonzero(~np.isfinite(array.ravel()))[0])
        at = f"t = {t[first]:.6g} s" if len(t) else f"sample {first}"
        unknown.append(f'"{name}" is not finite at {at}')
    return array.astype(float) if array.dtype.kind in "iuf" else np.empty(0)


def require_same(first: ReturnedRun, run: ReturnedRun) -> None:
    """Refuse a run whose outputs or instants differ from those of the first one."""
    for kind, mine, others in (
        ("time series", run.series, first.series),
        ("numbers", run.numbers, first.numbers),
    ):
        if list(mine) != list(others) and set(mine) != set(others):
            raise ArgumentError(f"it returns the {kind} {sorted(mine)}, the first run {sorted(others)}")
    if run.t.shape != first.t.shape:
        raise ArgumentError(f"t has {len(run.t)} instants, {len(first.t)} in the first run")
    if len(run.t) and np.max(np.abs(run.t - first.t)) > 1e-9 * (first.t[-1] - first.t[0]):
        raise ArgumentError("t has other instants than in the first run: interpolate to the same ones")
