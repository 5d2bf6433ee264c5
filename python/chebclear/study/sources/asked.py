"""What is taken from every run as a feature: features of the core, and functions of the user's own."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...base.arguments import Checks, as_number
from ...errors import ArgumentError, ArgumentTypeError, describe
from ...run.features import Feature
from ...run.notices import Notice
from ...run.settings import Settings
from ...run.tracking import settling_time
from ...scene.scene import Scene
from .swept import SweptRun

Array = NDArray[np.float64]
FeatureSpec = Feature | Callable[[Any], ArrayLike]

# Features with the times of the extrema of a feature.
_TIMES = {
    "peak": ("time_of_peak",),
    "lowest": ("time_of_lowest",),
    "peak_to_peak": ("time_of_peak", "time_of_lowest"),
}


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
