"""Execution of a study: scenes are built, simulated and checked, and become a result."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..base.progress import Progress, reporter
from ..errors import SceneError, describe
from ..execution.counts import Costs
from ..execution.failures import count_failed, located
from ..execution.memory import SAMPLES_ALONE, Usage
from ..execution.options import ExecutionOptions
from ..run.settings import Settings
from ..run.tracking import settling_time
from ..scene.scene import Interval, Scene
from ..scene.structure import ManyScenes
from .band.hybrid import Normal, Uniform
from .band.judgment import doubts, early_widths, told_holes
from .features.features import Asked, FeatureTable
from .models.finished import FinishedRuns
from .models.own import OwnModel
from .models.units import known_units, units_of
from .polynomials.holes import fit_holes
from .polynomials.surrogate import BoundKind
from .results import StudyResult
from .runs import Making, Many, Runs
from .spec import StudySpec, declared_order

Array = NDArray[np.float64]


class Runner:
    """A mechanism in a box of parameters, with its settings; `Study` checks the arguments."""

    build: Callable[..., Any]
    """Function of the parameters and fixed keywords that returns the scene or a user's model's result."""
    intervals: dict[str, Interval]
    """Interval of each parameter by name [SI units]."""
    random: dict[str, Normal | Uniform]
    """Distributions of the parameters that have one."""
    fixed: Mapping[str, Any]
    """Keywords of `build` that are the same for all runs."""
    settings: Settings | None
    """Settings of a run; None for a user's model."""
    model: OwnModel | FinishedRuns | None
    """The user's model or table of runs; None if `build` returns scenes."""
    features: dict[str, Asked]
    """Features of every run by name."""
    units: dict[str, str]
    """Units that were given, by the names of parameters, outputs and features."""
    rtol_given: bool
    """Whether the user said the tolerance of the runs; methods with a default of their own then take it."""
    means: ExecutionOptions
    """Where runs are simulated, and how failed runs are treated."""
    progress: bool | Progress | None
    """Progress reports."""

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
            parameters={**self.intervals, **self.random},
            outputs=None if outputs is None else tuple(outputs),
            settings=self.settings,
            rtol_given=self.rtol_given,
            fixed=self.fixed,
            features=self.features,
            units={name: given for name, given in self.units.items() if own.get(name) != given},
            cycles=cycles,
            on_failure=self.means.on_failure,
            run_seconds=self.means.run_seconds,
            table=isinstance(self.model, FinishedRuns),
        )

    def drawn(self, draw: Callable[[dict[str, Interval]], Array]) -> Array:
        """Points of the box that are the same for each parameter wherever the user names it.

        Parameters
        ----------
        draw : callable
            Returns the points of a box, shape (runs, parameters). It gets the parameters in the order in
            which the model declares them.
        """
        names = declared_order(self.build, self.intervals)
        points = draw({name: self.intervals[name] for name in names})
        if names == list(self.intervals):
            return points
        return np.ascontiguousarray(points[:, [names.index(name) for name in self.intervals]])

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
        """Simulate at the points and, last, at the midpoint; issues no warnings.

        Parameters
        ----------
        points : ndarray, shape (runs, parameters)
            Parameters of the runs [SI units]; if there are degrees, those of `chebyshev_grid`, then others
            that check the polynomials.
        counts : tuple of int
            Nodes or points of each parameter [-].
        degrees : tuple of int or None
            Degrees to fit [-]; None takes the extremes of the runs as bounds.
        bounds : {"range", "eq31"}
            Bounds of polynomials, see `chebyshev`.
        random : bool
            Whether the points are spread at random over the box.
        kind : str, optional
            Kind of the result; ``"chebyshev"`` or ``"scan"`` by the degrees if not given.

        Returns
        -------
        StudyResult

        Raises
        ------
        SceneError, SimulationError
            As `chebyshev`.
        """
        terms = math.prod(degree + 1 for degree in degrees) if degrees is not None else 0
        runs = self.made(points, self.settings, usage=Usage(terms=terms))
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
                units_of(runs.feature_names, self.features, self.units, simulated=self.settings is not None),
                count_failed(runs.failures),
                isinstance(self.model, FinishedRuns),
                runs.nominal_parameters,
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
            units=self.units,
            **runs.facts,
        )
        # A result that is read from a file already has these warnings.
        found = doubts(result.bands)
        if result.scene is not None:
            found += early_widths(result.bands, settling_time(result.scene))
        lost = [one.index for one in runs.failures if one.index < math.prod(counts)]
        if degrees is not None and lost:
            found += told_holes(fit_holes(counts, degrees, lost))
        return replace(result, warnings=(*result.warnings, *found))

    def run_settings(self, rtol: float | None, default: float) -> Settings | None:
        """Settings of the runs of a method with a default tolerance of its own; None without simulations.

        The tolerance is that given to the method, else that given to the study, as a keyword, in its settings
        or in its scene file, else the default.
        """
        if self.settings is None or (rtol is None and self.rtol_given):
            return self.settings
        return replace(self.settings, rtol=default if rtol is None else float(rtol))

    @property
    def normal(self) -> tuple[str, ...]:
        """Parameters that are normally distributed."""
        return tuple(name for name, given in self.random.items() if isinstance(given, Normal))

    def made(
        self,
        points: Array,
        settings: Settings | None,
        *,
        midpoint: bool = True,
        usage: Usage = SAMPLES_ALONE,
    ) -> Runs:
        """The runs at the points and, if requested, last the nominal one, from any source."""
        start = time.perf_counter()
        if settings is not None:
            runs = self.simulated(points, settings, midpoint=midpoint, usage=usage)
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
        return Runs(stats=Costs.joined(()), settings=None, seconds=seconds, **facts)

    def simulated(
        self, points: Array, settings: Settings, *, midpoint: bool = True, usage: Usage = SAMPLES_ALONE
    ) -> Runs:
        """The simulated runs at the points and, if requested, last at the midpoint; issues no warnings."""
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
            usage,
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
                "leave out duration, samples and all other settings of a simulation"
            )
        raise TypeError(f"build must return a Scene, got {scene!r} for {describe(parameters)}")
