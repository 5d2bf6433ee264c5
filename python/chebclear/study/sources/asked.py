"""What is taken from every run: features of the core, functions of the user's own, and their units."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...base.arguments import Checks, as_number
from ...base.rows import Array
from ...base.shown import meant_or_known
from ...base.units import misfit, size_of
from ...errors import ArgumentError, ArgumentTypeError
from ...notices import Notice
from ...run.features import Feature, settling_time
from ...run.names import column_index
from ...run.settings import Settings
from ...run.signals import WithSignals
from ...run.simulation import run_scene
from ...run.trajectory import Stats, Trajectory
from ...scene.scene import Interval, Scene


class SweptRun(WithSignals):
    """A run of a study with the interface of a `Trajectory`, a mapping from the names of the columns too.

    Samples, parameters and work of the run are available. Contacts, events, peaks and all else of a
    `Trajectory` are not kept by a study: the first access to them repeats the run with the same steps.
    """

    def __init__(
        self, scene: Scene, settings: Settings, t: Array, columns: Sequence[str], samples: Array, stats: Stats
    ) -> None:
        self.scene = scene
        self.settings = settings
        self.t = t
        self.columns = tuple(columns)
        self.samples = samples
        self.stats = stats
        self.status = "done"
        self.success = True

    def __repr__(self) -> str:
        return f"<run of a study: {len(self.columns)} columns of {len(self.t)} samples>"

    @property
    def _names(self) -> tuple[str, ...]:
        return self.columns

    def _entry(self, name: str) -> Array:
        return self.samples[:, column_index(self.columns, name, self.scene)]

    def to_dict(self) -> dict[str, Array]:
        """``t`` and all columns by name."""
        return {"t": self.t, **{name: self[name] for name in self.columns}}

    @cached_property
    def whole(self) -> Trajectory:
        """The run simulated once more."""
        return run_scene(self.scene, self.settings)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self.whole, name)


FeatureSpec = Feature | Callable[[Any], ArrayLike]

# Features with the times of the extrema of a feature.
_TIMES = {
    "peak": ("time_of_peak",),
    "lowest": ("time_of_lowest",),
    "peak_to_peak": ("time_of_peak", "time_of_lowest"),
}


def checked_features(checks: Checks, given: object) -> dict[str, FeatureSpec]:
    """Features by name from the argument of the user; problems are added to `checks`."""
    features = checks.mapping("features", given, 'features such as peak("slider.ax")')
    checks.names("features", features)
    asked: dict[str, FeatureSpec] = {}
    for name, feature in features.items():
        if not isinstance(name, str):
            checks.add("features", f"must have texts as names, got {name!r}", wrong_type=True)
        elif not isinstance(feature, Feature) and not callable(feature):
            text = f'must be a feature such as peak("slider.ax") or a callable of a run, got {feature!r}'
            checks.add(f'features["{name}"]', text, wrong_type=True)
        else:
            asked[name] = feature
    return asked


def tracked_features(asked: Iterable[FeatureSpec]) -> tuple[Feature, ...]:
    """Features that the core must compute: those of its own kinds, and the times of their extrema."""
    known = [feature for feature in asked if isinstance(feature, Feature)]
    known += [
        Feature(time, feature.of, feature.window)
        for feature in known
        for time in _TIMES.get(feature.kind, ())
    ]
    return tuple(dict.fromkeys(known))


def outputs_of(asked: Mapping[str, FeatureSpec], settings: Settings) -> Sequence[str] | None:
    """Outputs that features need of the runs: none, or all, at which functions of the user's own may look."""
    return () if all(isinstance(one, Feature) for one in asked.values()) else settings.outputs


def settling_notices(
    asked: Mapping[str, FeatureSpec], settings: Settings, scene: Scene, tracked: Array
) -> tuple[Notice, ...]:
    """Features whose extrema lie in the starting transient in at least half of the runs."""
    settled, found = settling_time(scene), []
    for name, feature in asked.items():
        if not isinstance(feature, Feature) or feature.kind not in _TIMES:
            continue
        times = [
            settings.features.index(Feature(kind, feature.of, feature.window))
            for kind in _TIMES[feature.kind]
        ]
        early = np.any(tracked[:, 0, times] < settled, axis=1)
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


def checked_units(checks: Checks, units: object) -> dict[str, str]:
    """Units by name; whether there are such names is known later."""
    given = checks.mapping("units", units, "units")
    for name, unit in given.items():
        if not isinstance(unit, str) or not unit.strip():
            what = f'must be a text such as "mm", or "-" for a number without a unit, got {unit!r}'
            checks.add(f'units["{name}"]', what, wrong_type=not isinstance(unit, str))
    return {str(name): str(unit) for name, unit in given.items()}


def known_units(build: object, names: Iterable[str]) -> dict[str, str]:
    """Units of parameters that their mechanism knows, as the ready-made ones and scene files do."""
    unit_of = getattr(build, "unit_of", None)
    units = {name: unit_of(name) for name in names} if callable(unit_of) else {}
    return {name: unit for name, unit in units.items() if unit}


def check_dimensions(checks: Checks, intervals: Mapping[str, Interval], units: Mapping[str, str]) -> None:
    """Check that intervals were written in units of their parameters, as far as these are known."""
    for name, side in intervals.items():
        own = units.get(name, "")
        if wrong := misfit(side.unit, own):
            checks.add(f'parameters["{name}"]', wrong)
        elif side.unit and size_of(own) != 1.0:
            what = f"is in {side.unit}, so in SI units now, but the study has it in {own}: leave out the unit"
            checks.add(f'parameters["{name}"]', what)


def require_known(
    checks: Checks, with_unit: Iterable[str], known: Sequence[str], *, simulated: bool = False
) -> None:
    """Refuse units of names that a study does not have."""
    for name in with_unit:
        if name not in known:
            hint = meant_or_known(name, known)
            what = "parameter or feature" if simulated else "parameter, output or feature"
            own = "; outputs of simulations have their units" if simulated else ""
            checks.add("units", f'names no {what} with "{name}"{own}{hint}')


def units_of(
    names: Iterable[str], asked: Mapping[str, FeatureSpec], given: Mapping[str, str], *, simulated: bool
) -> tuple[str, ...]:
    """Unit of each feature by its name; empty where none is known, as of the results of callables.

    Outputs of a model of the user's own have the given units, whatever their names.
    """

    def own(feature: FeatureSpec | None) -> str:
        if not isinstance(feature, Feature):
            return ""
        return feature.unit if simulated else feature.unit_with(given.get(feature.of, ""))

    return tuple(given.get(name, own(asked.get(name))) for name in names)
