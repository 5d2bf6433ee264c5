"""What runs the points of a study: scenes are built, simulated and checked, and become a result."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.progress import Progress, reporter
from ..errors import SceneError, describe
from ..execution.failures import count_failed, located
from ..execution.means import Means
from ..run.settings import Settings
from ..run.tracking import settling_time
from ..scene.scene import Interval, Scene
from ..scene.structure import ManyScenes
from .band.hybrid import Normal, Uniform
from .band.judgment import doubts, early_widths, told_holes
from .features.features import Asked, FeatureTable, units_of
from .models.finished import FinishedRuns
from .models.own import OwnModel
from .polynomials.holes import fit_holes
from .polynomials.surrogate import BoundKind
from .results import StudyResult
from .runs import Making, Many, Runs

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
    means: Means
    """Where it is simulated, and what becomes of runs that fail."""
    progress: bool | Progress | None
    """How the runs are counted for the user."""

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
        points = points[runs.kept]
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
                count_failed(runs.failures),
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
            threads=self.means.threads,
            kind=kind,
            features=table,
            **runs.facts,
        )
        # A result that is read back from a file has these warnings already.
        found = doubts(result.bands)
        if result.scene is not None:
            found += early_widths(result.bands, settling_time(result.scene))
        if degrees is not None and runs.failures:
            found += told_holes(fit_holes(counts, degrees, [one.index for one in runs.failures]))
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
            with reporter(self.progress, "study") as report:
                made = self.model.runs(points, midpoint=midpoint, report=report, means=self.means)
        seconds = time.perf_counter() - start
        facts = vars(made)
        if made.kept is None:
            facts = facts | {"kept": np.arange(len(points))}
        return Runs(stats=(), settings=None, seconds=seconds, **facts)

    def simulated(self, points: Array, settings: Settings, *, midpoint: bool = True) -> Runs:
        """The runs at the points and, if asked for, last at the midpoint; does not pass on warnings."""
        rtol = settings.rtol if self.settings is None else self.settings.rtol
        making = Making(
            self.scene,
            self._many,
            self.intervals,
            points,
            settings,
            self.features,
            self.means,
            rtol,
            midpoint,
        )
        with reporter(self.progress, "study") as report:
            return making.run(report)

    @property
    def _many(self) -> Many | None:
        build = self.build
        if not isinstance(build, ManyScenes):
            return None
        return lambda structure, like, values: build.scene_numbers(structure, like, values, self.fixed)

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
            raise TypeError(
                "build returned a mapping instead of a Scene: a model of your own has its own time axis, so "
                "leave out duration, samples and all else that says how to simulate"
            )
        raise TypeError(f"build must return a Scene, got {scene!r} for {describe(parameters)}")
