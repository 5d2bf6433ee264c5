"""What a study and its methods ask for, and the means of making runs, which alone tell sources apart."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any

from ..base.arguments import Checks
from ..base.progress import Progress, is_request, reporter
from ..base.rows import Array
from ..base.units import unit
from ..execution.memory import SAMPLES_ALONE, Usage
from ..execution.options import ExecutionOptions
from ..run.settings import RunOptions, Settings, checked_names, checked_settings, revolution_of
from ..scene.distributions import Distribution
from ..scene.scene import Interval, Scene
from .band.gridded import Grid
from .band.requirement import Requirement
from .requirements.draws import check_drawn
from .requirements.specification import Specification, checked_specifications
from .sources.asked import (
    FeatureSpec,
    check_dimensions,
    checked_features,
    checked_units,
    known_units,
    require_known,
    tracked_features,
)
from .sources.calling import OwnModel
from .sources.finished import FinishedRuns
from .sources.own import check_own_features, check_unused
from .sources.run_table import RunTable
from .sources.scenes import SceneRuns
from .spec import StudySpec, check_keywords, checked_intervals, returns_a_scene

if TYPE_CHECKING:
    from .results import StudyResult


@dataclass(frozen=True, eq=False)
class Design:
    """The runs that a method of a study asks for."""

    points: Array
    """Parameters of the runs [SI units], shape (runs, parameters); the nominal run comes besides."""
    settings: Settings | None
    """Settings of the runs; None if they are not simulated."""
    usage: Usage
    """What the result takes besides the samples."""
    asked: Requirement | Grid
    """What is made of the runs."""
    others: Sequence[StudyResult] = ()
    """Results whose runs are included in bands."""
    seconds: float | None = field(default=None, metadata=unit("s"))
    """Time after which no further runs are begun [s]; that of the study if None."""
    answers_from: int | None = None
    """Fewest runs that are answered from when Ctrl-C ends the runs; None if the interrupt is raised."""

    @property
    def independent(self) -> bool:
        """Whether all runs are independent and uniform in the box."""
        own = self.asked.random if isinstance(self.asked, Grid) else self.asked.independent
        return own and not self.others


@dataclass(frozen=True, eq=False, repr=False)
class Runner(StudySpec):
    """The specification of a study, with the means of making its runs; `units` has all that are known."""

    model: OwnModel | FinishedRuns | None = None
    """The user's model or table of runs; None if `build` returns scenes."""
    execution: ExecutionOptions = field(default_factory=ExecutionOptions)
    """Where runs are simulated, and how failed runs are treated."""
    progress: bool | Progress | None = None
    """Progress reports."""
    rtol_given: bool = False
    """Whether the user said the tolerance of the settings: bands have another one where nobody did."""

    # A specification leaves its objects behind, a runner takes them along.
    __reduce__ = object.__reduce__  # type: ignore[assignment]

    @property
    def spec(self) -> StudySpec:
        """What is asked of the study, as its results carry it."""
        own = known_units(self.build, self.intervals)
        asked = {item.name: getattr(self, item.name) for item in fields(StudySpec)}
        asked["units"] = {name: given for name, given in self.units.items() if own.get(name) != given}
        if self.settings is not None and not self.rtol_given:
            asked["settings"] = replace(self.settings, rtol=None)
        return StudySpec(**asked)

    def limited(self, seconds: float | None, answers_from: int | None) -> Runner:
        """The runner with limits of a `Design` on the runs; its own is in force if it gives none."""
        own = self.execution
        limit = own.max_seconds if seconds is None else seconds
        return replace(self, execution=replace(own, max_seconds=limit, answers_from=answers_from))

    def made(
        self, points: Array, settings: Settings | None, *, midpoint: bool = True, usage: Usage = SAMPLES_ALONE
    ) -> RunTable:
        """The runs at the points and, if requested, last the nominal one, from any source; warns of
        nothing."""
        start = time.perf_counter()
        if isinstance(self.model, FinishedRuns):
            made = self.model.runs(points, midpoint=midpoint)
        else:
            long = self.execution.answers_from is not None
            with reporter(self.progress, "study", long=long) as report:
                if self.model is not None:
                    made = self.model.runs(self, points, midpoint, report)
                else:
                    assert settings is not None, "of scenes"
                    made = SceneRuns(self, points, settings, midpoint, usage).run(report)
        return replace(made, seconds=time.perf_counter() - start)


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
    execution: ExecutionOptions,
) -> Runner:
    """The source of runs that the arguments of `Study` say; all problems of these are listed."""
    checks = Checks()
    # Simulations have a duration; a model of the user's own returns its instants.
    timed = settings is not None or not options.keys().isdisjoint(("duration", "samples"))
    simulated = timed or returns_a_scene(build)
    asked = checked_features(checks, features)
    if features is None and isinstance(settings, Settings):
        asked = {str(feature): feature for feature in settings.features}
    intervals = checked_intervals(checks, parameters)
    all_units = known_units(build, intervals) | checked_units(checks, units)
    check_dimensions(checks, intervals, all_units)
    constant = dict(checks.mapping("fixed", fixed, "values"))
    check_keywords(checks, build, intervals, constant)
    if not is_request(progress):
        checks.add("progress", f"must be None, True or callable, got {progress!r}", wrong_type=True)
    execution = execution.checked(checks)
    if not simulated and not execution.in_memory:
        checks.add("in_memory", "may not be False for a model of your own: what it returns is in the memory")
    _check_version(checks, version, own_store=not simulated and execution.store is not None)
    required: dict[str, Specification] = {}
    if requirements is not None:
        required = checked_specifications(checks, requirements, "requirements")
        check_drawn(checks, parameters)
    model, rtol_given = None, False
    if simulated:
        more = {"outputs": outputs, "features": tracked_features(asked.values()), **options}
        require_known(checks, all_units, [*intervals, *asked], simulated=True)
        if settings is None and "duration" not in options:
            checks.finish()
            scene = build(**{name: side.nominal for name, side in intervals.items()}, **constant)
            more |= revolution_of(scene) if isinstance(scene, Scene) else {}
        settings = Settings.gathered(checks, settings, more, outputs_needed=not asked)
        rtol_given = settings.rtol is not None
        settings = settings.of_runs
        names, cycles = settings.outputs, settings.cycles
    else:
        cycles = checked_settings(checks, {"cycles": options.get("cycles", 1)})["cycles"]
        check_unused(checks, [name for name in options if name != "cycles"])
        check_own_features(checks, asked)
        names = checked_names(checks, outputs)
        checks.finish()
        model = OwnModel(version)
    return Runner(
        build=build,
        parameters=dict(parameters),
        outputs=None if names is None else tuple(names),
        settings=settings,
        fixed=constant,
        features=asked,
        units=all_units,
        cycles=cycles,
        on_failure=execution.on_failure,
        run_seconds=execution.run_seconds,
        requirements=required,
        model=model,
        execution=execution,
        progress=progress,
        rtol_given=rtol_given,
    )


def _check_version(checks: Checks, version: object, *, own_store: bool) -> None:
    """Check that a version is given where a store keeps runs of a model of the user's own, and only there."""
    if version is None and own_store:
        text = (
            'must be given with a store of a model of your own, such as "1", and be another one whenever the '
            "model is: only you know what it uses. Without a store its runs are kept in this process only"
        )
        checks.add("version", text)
    elif version is not None and (not isinstance(version, str) or not version):
        checks.add("version", f'must be a text, such as "1", got {version!r}', wrong_type=True)
    elif version is not None and not own_store:
        checks.add("version", "is for a model of your own with a store, which compares it")
