"""What runs the points of a study: scenes are built, simulated and checked, and become a result."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ChebclearWarning, InputError, SceneError, describe
from ..run.settings import Settings
from ..run.tracking import settling_time
from ..run.trajectory import Stats
from ..scene.scene import Interval, Scene
from .arguments import Progress, reporter
from .band.hybrid import Normal, Uniform
from .band.judgement import doubts, early_widths
from .features.features import Asked, FeatureTable, feature_values, settling_warnings, units_of
from .models.finished import FinishedRuns
from .models.own import OwnModel
from .polynomials.surrogate import BoundKind
from .results import StudyResult
from .runs import (
    Runs,
    gathered_warnings,
    located,
    require_ends,
    require_success,
    scene_text,
    simulate_all,
    with_parameters,
)

Array = NDArray[np.float64]


class Runner:
    """A mechanism in a box of parameters, and how it is simulated; `Study` checks what it is made from."""

    build: Callable[..., Any]
    """Makes the scene, or what a model of the user's own returns, from the parameters and what is fixed."""
    intervals: dict[str, Interval]
    """Interval of each parameter by name [SI units]."""
    random: dict[str, Normal | Uniform]
    """Distributions of the parameters that have one."""
    fixed: Mapping[str, Any]
    """Keywords of `build` that are the same for all runs."""
    settings: Settings | None
    """How a run is simulated; None if the runs are those of a model of the user's own."""
    model: OwnModel | FinishedRuns | None
    """Such a model, or a table of runs; None if `build` returns scenes."""
    features: dict[str, Asked]
    """What is found of every run besides its outputs, by name."""
    threads: int | None
    """Threads to simulate on [-]."""
    progress: bool | Progress | None
    """How the runs are counted for the user."""
    executor: Executor | None
    """Where to simulate; on threads of this process if None."""

    def run_points(
        self,
        points: Array,
        counts: tuple[int, ...],
        degrees: tuple[int, ...] | None,
        bounds: BoundKind = "range",
        *,
        random: bool = False,
        kind: str | None = None,
    ) -> StudyResult:
        """Simulate at the points and, last, at the midpoint; does not pass on warnings.

        Parameters
        ----------
        points : ndarray, shape (runs, parameters)
            Parameters of the runs [SI units]; those of `chebyshev_grid` if there are degrees.
        counts : tuple of int
            Nodes or points of each parameter [-].
        degrees : tuple of int or None
            Degrees to fit [-]; None takes the extremes of the runs as bounds.
        bounds : {"range", "eq31"}
            How polynomials are bounded, see `chebyshev`.
        random : bool
            Whether the points are spread at random over the box.
        kind : str, optional
            What the runs are; ``"chebyshev"`` or ``"scan"`` by the degrees if not given.

        Returns
        -------
        StudyResult

        Raises
        ------
        SceneError, SimulationError
            As `chebyshev`.
        """
        runs = self.made(points, self.settings)
        table = None
        if runs.features is not None:
            values = runs.features
            table = FeatureTable(
                runs.feature_names,
                values[:-1],
                values[-1],
                self.intervals,
                points,
                random,
                self.normal,
                units_of(runs.feature_names, self.features),
            )
        result = StudyResult.from_runs(
            runs.t,
            runs.outputs,
            runs.values,
            self.intervals,
            points,
            degrees=degrees,
            nodes=counts,
            bounds=bounds,
            kind=kind,
            features=table,
            **runs.facts,
        )
        # A result that is read back from a file has these warnings already.
        found = doubts(result.bands)
        if result.scene is not None:
            found += early_widths(result.bands, settling_time(result.scene))
        return replace(result, warnings=(*result.warnings, *found))

    @property
    def normal(self) -> tuple[str, ...]:
        """Parameters that are normally distributed."""
        return tuple(name for name, given in self.random.items() if isinstance(given, Normal))

    def made(self, points: Array, settings: Settings | None, *, midpoint: bool = True) -> Runs:
        """The runs at the points and, if asked for, last the nominal one, whatever they come from."""
        start = time.perf_counter()
        if settings is not None:
            runs = self.simulated(points, settings, midpoint=midpoint)
            return replace(runs, seconds=time.perf_counter() - start)
        if isinstance(self.model, FinishedRuns):
            made = self.model.runs(points, midpoint=midpoint)
        else:
            assert self.model is not None, "what is not simulated comes from a model"
            with reporter(self.progress) as report:
                made = self.model.runs(points, midpoint=midpoint, report=report)
        seconds = time.perf_counter() - start
        return Runs(scenes=[], stats=(), settings=None, seconds=seconds, **vars(made))

    def simulated(self, points: Array, settings: Settings, *, midpoint: bool = True) -> Runs:
        """The runs at the points and, if asked for, last at the midpoint; does not pass on warnings."""
        middle = [[side.midpoint for side in self.intervals.values()]] if midpoint else []
        given = [dict(zip(self.intervals, map(float, row), strict=True)) for row in [*points, *middle]]
        scenes, built = self._scenes(given)
        require_ends(self.intervals, points, lambda ends: self._scenes(ends)[0])
        texts = [scene_text(scene, parameters) for scene, parameters in zip(scenes, given, strict=True)]
        try:
            settings = settings.for_scene(scenes[-1], runs=len(scenes))
        except InputError as error:
            raise type(error)(located(given[-1], error.problems)) from None
        with reporter(self.progress) as report:
            try:
                runs = simulate_all(texts, settings.to_json(), self.threads, self.executor, report)
            except InputError as error:
                raise with_parameters(error, given) from None
        require_success(runs, given)
        told = zip(built, runs["warnings"], strict=True)
        messages = gathered_warnings([[*of_build, *of_run] for of_build, of_run in told])
        features = None
        if self.features:
            features = feature_values(self.features, settings, scenes, given, runs)
            messages += settling_warnings(self.features, settings, scenes[-1], runs["features"])
        return Runs(
            t=runs["t"],
            outputs=tuple(runs["columns"]),
            values=runs["values"],
            scenes=scenes,
            stats=tuple(Stats(**stats) for stats in runs["stats"]),
            warnings=messages,
            settings=settings,
            features=features,
            feature_names=tuple(self.features),
        )

    def _scenes(self, given: list[dict[str, float]]) -> tuple[list[Scene], list[list[str]]]:
        """The scenes of all runs, and what `build` warned of in each; other warnings take their usual way."""
        scenes: list[Scene] = []
        told: list[list[str]] = []
        others: list[warnings.WarningMessage] = []
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            for parameters in given:
                scenes.append(self.scene(parameters))
                told.append([str(one.message) for one in caught if one.category is ChebclearWarning])
                others += [one for one in caught if one.category is not ChebclearWarning]
                caught.clear()
        seen: dict[Any, Any] = {}  # so that a place in `build` warns once, not in every run
        for one in others:
            warnings.warn_explicit(one.message, one.category, one.filename, one.lineno, registry=seen)
        return scenes, told

    def scene(self, parameters: dict[str, float]) -> Scene:
        """The scene at these values of the parameters [SI units]; errors name them."""
        try:
            scene = self.build(**parameters, **self.fixed)
        except SceneError as error:
            raise SceneError(located(parameters, error.problems)) from error
        except Exception as error:
            error.add_note(f"in build with {describe(parameters)}")
            raise
        if isinstance(scene, Mapping):
            raise TypeError(
                "build returned a mapping instead of a Scene: a model of your own has its own time axis, so "
                "leave out duration, samples and all else that says how to simulate"
            )
        if not isinstance(scene, Scene):
            raise TypeError(f"build must return a Scene, got {scene!r} for {describe(parameters)}")
        return scene
