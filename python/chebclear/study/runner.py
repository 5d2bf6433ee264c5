"""Where the runs of a study come from: scenes that are simulated, a model of the user's own, or a table."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.arguments import Checks
from ..base.progress import Progress, is_request, reporter
from ..errors import ArgumentTypeError, SceneError, describe
from ..execution.failures import located
from ..execution.memory import SAMPLES_ALONE, Usage
from ..execution.options import ExecutionOptions, checked_options
from ..run.settings import RunOptions, Settings, checked_names, checked_settings, revolution_of
from ..scene.distributions import Distribution
from ..scene.scene import Interval, Scene
from ..scene.structure import ManyScenes
from .features.features import FeatureSpec, checked_features, tracked_features
from .requirements.draws import check_drawn
from .requirements.specification import Specification, checked_specifications
from .sources.finished import FinishedRuns
from .sources.own import OwnModel, check_own_features, check_unused
from .sources.run_table import RunTable
from .sources.scenes import Many, SceneRuns
from .sources.units import checked_units, known_units, require_known
from .spec import (
    StudySpec,
    check_keywords,
    checked_fixed,
    checked_intervals,
    declared_order,
    returns_a_scene,
)

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Runner:
    """A mechanism, a model or a table in a box of parameters: the source of the runs of a study."""

    build: Callable[..., Any]
    """Function of the parameters and fixed keywords that returns the scene or a user's model's result."""
    parameters: dict[str, Interval | Distribution]
    """The parameters as they were given."""
    intervals: dict[str, Interval]
    """Interval of each parameter by name [SI units]."""
    fixed: Mapping[str, Any]
    """Keywords of `build` that are the same for all runs."""
    settings: Settings | None
    """Settings of a run; None for a user's model."""
    model: OwnModel | FinishedRuns | None
    """The user's model or table of runs; None if `build` returns scenes."""
    features: dict[str, FeatureSpec]
    """Features of every run by name."""
    units: dict[str, str]
    """Units that were given, by the names of parameters, outputs and features."""
    rtol_given: bool
    """Whether the user said the tolerance of the runs; methods with a default of their own then take it."""
    execution: ExecutionOptions
    """Where runs are simulated, and how failed runs are treated."""
    progress: bool | Progress | None
    """Progress reports."""
    requirements: dict[str, Specification]
    """Limits that outputs and features must keep to, by name."""

    @property
    def random(self) -> dict[str, Distribution]:
        """Distributions of the parameters that have one."""
        return {name: one for name, one in self.parameters.items() if isinstance(one, Distribution)}

    @property
    def spec(self) -> StudySpec:
        """What is asked of the study, as its results carry it."""
        outputs, cycles = None, 1
        if self.settings is not None:
            outputs, cycles = self.settings.outputs, self.settings.cycles
        elif isinstance(self.model, OwnModel):
            outputs, cycles = self.model.outputs, self.model.cycles
        own = known_units(self.build, self.intervals)
        return StudySpec(
            build=self.build,
            parameters=self.parameters,
            outputs=None if outputs is None else tuple(outputs),
            settings=self.settings,
            rtol_given=self.rtol_given,
            fixed=self.fixed,
            features=self.features,
            units={name: given for name, given in self.units.items() if own.get(name) != given},
            cycles=cycles,
            on_failure=self.execution.on_failure,
            run_seconds=self.execution.run_seconds,
            requirements=self.requirements,
            table=isinstance(self.model, FinishedRuns),
        )

    def drawn(self, draw: Callable[[dict[str, Interval]], Array]) -> Array:
        """Points of the box that are the same for each parameter wherever the user names it: `draw` makes
        them, shape (runs, parameters), for the parameters in the order in which the model declares them."""
        names = declared_order(self.build, self.intervals)
        points = draw({name: self.intervals[name] for name in names})
        if names == list(self.intervals):
            return points
        return np.ascontiguousarray(points[:, [names.index(name) for name in self.intervals]])

    def run_settings(self, rtol: float | None, default: float) -> Settings | None:
        """Settings of the runs of a method with a default tolerance of its own; None without simulations.

        The tolerance is that given to the method, else that given to the study, as a keyword, in its settings
        or in its scene file, else the default.
        """
        if self.settings is None or (rtol is None and self.rtol_given):
            return self.settings
        return replace(self.settings, rtol=default if rtol is None else float(rtol))

    def made(
        self,
        points: Array,
        settings: Settings | None,
        *,
        midpoint: bool = True,
        usage: Usage = SAMPLES_ALONE,
    ) -> RunTable:
        """The runs at the points and, if requested, last the nominal one, from any source; warns of
        nothing."""
        start, build = time.perf_counter(), self.build
        if isinstance(self.model, FinishedRuns):
            made = self.model.runs(points, midpoint=midpoint)
        elif self.model is not None:
            with reporter(self.progress, "study") as report:
                made = self.model.runs(points, midpoint=midpoint, report=report, execution=self.execution)
        else:
            assert settings is not None, "of scenes"
            many: Many | None = None
            if isinstance(build, ManyScenes):
                many = partial(build.scene_numbers, fixed=self.fixed)
            rtol = settings.rtol if self.settings is None else self.settings.rtol
            source = self.scene, many, self.intervals, points, settings, self.features, self.execution
            scenes = SceneRuns(*source, rtol, midpoint, usage)
            with reporter(self.progress, "study") as report:
                made = scenes.run(report)
        return replace(made, seconds=time.perf_counter() - start)

    def scene(self, parameters: dict[str, float]) -> Scene:
        """The scene at these values of the parameters [SI units]; errors name them."""
        try:
            scene = self.build(**parameters, **self.fixed)
        except SceneError as error:
            raise SceneError(located(parameters, error.problems)) from error
        except Exception as error:
            error.add_note(f"in build with {describe(parameters)}")
            raise
        if isinstance(scene, Scene):
            return scene
        if isinstance(scene, Mapping):
            raise ArgumentTypeError(
                "build returned a mapping instead of a Scene: a model of your own has its own time axis, so "
                "leave out duration, samples and all other settings of a simulation"
            )
        raise ArgumentTypeError(f"build must return a Scene, got {scene!r} for {describe(parameters)}")


def checked_runner(
    build: Callable[..., Any],
    parameters: Mapping[str, Interval | Distribution],
    outputs: Sequence[str] | None,
    settings: Settings | None,
    fixed: Mapping[str, Any] | None,
    features: Mapping[str, FeatureSpec] | None,
    units: Mapping[str, str] | None,
    version: str | None,
    requirements: object,
    options: RunOptions,
    progress: bool | Progress | None,
    how: tuple[Any, ...],
) -> Runner:
    """The source of runs that the arguments of `Study` say; all problems of these are listed."""
    checks = Checks()
    # Simulations have a duration; a model of the user's own returns its instants.
    settings_given = settings is not None
    timed = settings_given or not options.keys().isdisjoint(("duration", "samples"))
    simulated = timed or returns_a_scene(build)
    asked = checked_features(checks, features)
    if features is None and isinstance(settings, Settings):
        asked = {str(feature): feature for feature in settings.features}
    intervals = checked_intervals(checks, parameters)
    given_units = known_units(build, intervals) | checked_units(checks, units)
    constant = checked_fixed(checks, fixed)
    check_keywords(checks, build, intervals, constant)
    if not is_request(progress):
        checks.add(f"progress must be None, True or callable, got {progress!r}", wrong_type=True)
    execution = checked_options(checks, *how)
    if not simulated and not execution.in_memory:
        checks.add("in_memory may not be False for a model of your own: what it returns is in the memory")
    if version is not None and (not isinstance(version, str) or not version):
        checks.add(f'version must be a text, such as "1", got {version!r}', wrong_type=True)
    if version is not None and (simulated or execution.store is None):
        checks.add("version is for a model of your own with a store, which compares it")
    required: dict[str, Specification] = {}
    if requirements is not None:
        required = checked_specifications(checks, requirements, "requirements")
        check_drawn(checks, parameters)
    model = None
    if simulated:
        more = {"outputs": outputs, "features": tracked_features(asked.values()), **options}
        require_known(checks, given_units, [*intervals, *asked], simulated=True)
        if settings is None and "duration" not in options:
            checks.finish()
            scene = build(**{name: side.nominal for name, side in intervals.items()}, **constant)
            more |= revolution_of(scene) if isinstance(scene, Scene) else {}
        settings = Settings.gathered(checks, settings, more, outputs_needed=not asked)
    else:
        cycles = checked_settings(checks, {"cycles": options.get("cycles", 1)})["cycles"]
        check_unused(checks, [name for name in options if name != "cycles"])
        check_own_features(checks, asked)
        names = checked_names(checks, outputs)
        checks.finish()
        model = OwnModel(build, intervals, constant, names, asked, cycles, tuple(given_units), version)
    return Runner(
        build=build,
        parameters=dict(parameters),
        intervals=intervals,
        fixed=constant,
        settings=settings,
        model=model,
        features=asked,
        units=given_units,
        rtol_given=settings_given or "rtol" in options,
        execution=execution,
        progress=progress,
        requirements=required,
    )
