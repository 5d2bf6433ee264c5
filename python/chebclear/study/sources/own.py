"""Features of samples, and what may be asked of a model of the user's own."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from itertools import pairwise

import numpy as np

from ...base.arguments import Checks
from ...base.rows import Array
from ...base.shown import did_you_mean
from ...errors import ArgumentError
from ...run.features import JOINT_KINDS, Feature
from ...run.settings import RunOptions
from .asked import FeatureSpec


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
            found.append(_SAMPLED[feature.kind](times, piece))
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


def _mean(t: Array, values: Array) -> Array:
    """By trapezoids; NumPy renamed its own."""
    integral = np.asarray(0.5 * (values[..., 1:] + values[..., :-1]) @ np.diff(t))
    return np.asarray(integral / (t[-1] - t[0]))


def _rms(t: Array, values: Array) -> Array:
    # Relative to the largest, whose square is a number then.
    size = np.maximum(np.max(np.abs(values), axis=-1), math.ulp(0.0))
    return np.asarray(size * np.sqrt(_mean(t, (values / size[..., None]) ** 2)))


_SAMPLED: dict[str, Callable[[Array, Array], Array]] = {
    "peak": lambda t, values: values.max(axis=-1),
    "lowest": lambda t, values: values.min(axis=-1),
    "peak_to_peak": lambda t, values: np.ptp(values, axis=-1),
    "time_of_peak": lambda t, values: t[values.argmax(axis=-1)],
    "time_of_lowest": lambda t, values: t[values.argmin(axis=-1)],
    "mean": _mean,
    "rms": _rms,
}


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
            text = (
                f"is {feature}, which is found in simulations of scenes only; a model of your own returns it"
            )
            checks.add(f'features["{name}"]', f"{text} as a number")
        elif isinstance(feature, Feature) and feature.window is not None:
            text = "has a window, which is found in simulations of scenes only; leave it out"
            checks.add(f'features["{name}"]', text)


def check_unused(checks: Checks, given: Iterable[str]) -> None:
    """Refuse settings of simulations, and unknown keywords."""
    for name in given:
        if name not in RunOptions.__annotations__:
            hint = did_you_mean(name, RunOptions.__annotations__)
            checks.add(name, f"is no keyword{hint}", wrong_type=True)
            continue
        text = (
            "is that of a simulation: give duration and samples too, or leave it out for a model of your own"
        )
        checks.add(name, text)
