"""Calibrated studies: runs at points that fill the box evenly, and their bands."""

from __future__ import annotations

import dataclasses
import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _core
from ..base.arguments import Checks
from ..errors import ArgumentError
from ..execution.counts import Costs
from ..execution.failures import FailedRun, count_failed, failure_warnings, is_failure_warning
from ..execution.memory import Usage
from ..execution.pieces import NOT_BEGUN
from ..run.settings import Settings, checked_settings
from ..run.tracking import settling_time
from ..scene.scene import ClearanceRevolute, Scene
from .band.calibrated import (
    Requirement,
    band_usage,
    certifying_runs,
    is_remark,
    remarks,
)
from .band.judgment import early_widths
from .band.limits import physical_limits
from .by_angle import cut, turning, unpredictable
from .features.features import FeatureTable
from .models.finished import FinishedRuns
from .models.units import units_of
from .polynomials.points import on_cube, random_points, sobol_points
from .results import StudyResult
from .runner import Runner
from .runs import MOST_RUNS, Runs

Array = NDArray[np.float64]

LEAST_RUNS = 3
BAND_RUNS = 81
"""Default number of runs of a band [-]."""
BAND_RTOL = 1e-4
"""Relative tolerance of the runs of a band where nothing was said [-]."""
MOST_SEED = 2**64 - 1
MOST_PARAMETERS = 32
"""Parameters for which there are Sobol' points [-]."""
# Largest difference of each parameter between runs at the same point, over half its interval.
_SAME_POINT = 1e-9
# Largest difference of runs of one model at the same point, over the largest value.
_SAME_VALUES = 1e-6


@dataclass(frozen=True)
class Table:
    """Finished runs."""

    parameters: Array
    """Parameters [SI units], shape (runs, parameters)."""
    values: Array
    """Outputs in their units, shape (runs, samples, outputs); by crank angle (runs, revolutions, samples,
    outputs)."""
    stats: Costs
    """What each run cost; nothing if they were not simulated."""
    features: Array | None
    """Features, shape (runs, cycles, features); None if none were asked for."""

    @classmethod
    def of(cls, result: StudyResult, outputs: Sequence[str]) -> Table:
        """The runs of a result, without the nominal one."""
        values = np.stack([result.values(name) for name in outputs], axis=-1)
        features = None if result.features is None else result.features.runs
        return cls(result.parameters, values, Costs.joined([result.stats[:-1]]), features)

    @classmethod
    def nominal(cls, result: StudyResult) -> Table:
        """The nominal run of a result; its parameters are not needed here."""
        values = np.stack([result.table(name)[-1] for name in result.outputs], axis=-1)[None]
        features = None if result.features is None else result.features.nominal[None]
        return cls(result.parameters[:1], values, Costs.joined([result.stats[-1:]]), features)

    def __getitem__(self, rows: slice | NDArray[np.intp]) -> Table:
        features = None if self.features is None else self.features[rows]
        stats = self.stats[rows] if len(self.stats) else self.stats
        return Table(self.parameters[rows], self.values[rows], stats, features)

    @classmethod
    def new(cls, points: Array, runs: Runs) -> Table:
        """The runs at the points and, if it is among them, the nominal one."""
        # The last row may be the nominal run, whose parameters are not needed here.
        parameters = np.resize(points[runs.kept], (len(runs.values), points.shape[1]))
        return cls(parameters, runs.values, Costs.joined([runs.stats]), runs.features)


def band(
    study: Runner,
    runs: int | None,
    coverage: float,
    rtol: float | None,
    seed: int,
    include: StudyResult | Sequence[StudyResult],
    max_runs: int,
    cycles: int | None = None,
    discard: int | None = None,
    angle: str | None = None,
) -> StudyResult:
    """The result of `Study.band`; see there."""
    checks = Checks()
    count = BAND_RUNS if runs is None else checks.whole("runs", runs, least=LEAST_RUNS, most=MOST_RUNS)
    most = checks.whole("max_runs", max_runs, least=1)
    if count > most and not checks.noted("max_runs"):
        checks.add(
            f"runs must be <= max_runs = {most}, got {count}: take fewer, or allow them with max_runs={count}"
        )
    checks.real("coverage", coverage, "-", above=0.0, below=1.0)
    _check_rtol(checks, study, rtol)
    checks.whole("seed", seed, least=0, most=MOST_SEED)
    if len(study.intervals) > MOST_PARAMETERS:
        checks.add(
            f"a band takes at most {MOST_PARAMETERS} parameters, the study has {len(study.intervals)}: "
            "give those that matter least as fixed"
        )
    for name, value in {"discard": discard, "angle": angle}.items():
        if cycles is None and value is not None:
            checks.add(f"{name} is for bands by crank angle: give cycles too, or leave it, got {value!r}")
    others = _results(checks, include)
    checks.finish()
    settings = _settings(study, rtol)
    if isinstance(study.model, FinishedRuns):
        points = _finished_points(study.model, runs, LEAST_RUNS)
        requirement = Requirement(float(coverage), len(points), int(seed), {}, finished=True)
    else:
        points = study.drawn(lambda box: sobol_points(box, 0, count, seed))
        requirement = Requirement(float(coverage), count, int(seed), {})
    if cycles is not None:
        settings, revolutions = turning(study, settings, cycles, 1 if discard is None else discard, angle)
        requirement = dataclasses.replace(requirement, revolutions=revolutions)
    return _made(study, requirement, points, settings, others)


def certify(study: Runner, coverage: float, rtol: float | None, seed: int, max_runs: int) -> StudyResult:
    """The result of `Study.certify`; see there."""
    checks = Checks()
    checks.real("coverage", coverage, "-", above=0.0, below=1.0)
    _check_rtol(checks, study, rtol)
    checks.whole("seed", seed, least=0, most=MOST_SEED)
    checks.whole("max_runs", max_runs, least=1)
    checks.finish()
    runs = certifying_runs(coverage)
    if runs > MOST_RUNS:
        raise ArgumentError(
            f"a coverage of {coverage!r} takes {runs} runs, more than {MOST_RUNS}: ask for less"
        )
    if runs > max_runs:
        raise ArgumentError(
            f"a coverage of {coverage!r} takes {runs} runs, more than max_runs = {max_runs}: ask for less, "
            f"or allow them with max_runs={runs}"
        )
    if isinstance(study.model, FinishedRuns):
        if not study.model.independent:
            raise ArgumentError(
                "nothing can be proved from runs at points that someone chose: certify() needs runs drawn "
                "independently and uniformly from the box, Study.from_runs(..., independent=True)"
            )
        points = _finished_points(study.model, None, runs)
    else:
        points = study.drawn(lambda box: random_points(box, runs, seed))
    requirement = Requirement(float(coverage), len(points), int(seed), {}, certified=True)
    return _made(study, requirement, points, _settings(study, rtol), [])


def _check_rtol(checks: Checks, study: Runner, rtol: float | None) -> None:
    if rtol is not None and study.model is not None:
        checks.add("rtol is a setting of simulations: a model of your own does not use it")
    elif rtol is not None:
        checked_settings(checks, {"rtol": rtol})


def _finished_points(table: FinishedRuns, runs: int | None, least: int) -> Array:
    """Points of a table but the nominal one, all or the first so many."""
    points = table.points
    wanted = len(points) if runs is None else runs
    if len(points) < max(wanted, least):
        raise ArgumentError(
            f"the table has {len(points)} runs besides the nominal one, {max(wanted, least)} are needed"
        )
    table.require_scattered()
    table.require_filled(points[:wanted])
    return points[:wanted]


def _settings(study: Runner, rtol: float | None) -> Settings | None:
    """Settings of the runs of a band; None if they are not simulated."""
    return study.run_settings(rtol, BAND_RTOL)


def _runs(
    study: Runner,
    requirement: Requirement,
    points: Array,
    settings: Settings | None,
    *,
    midpoint: bool = True,
) -> Runs:
    """The runs at the points, divided into the revolutions that are pooled."""
    usage = Usage(copies=2) if requirement.certified else band_usage(*points.shape)
    new = study.made(points, settings, midpoint=midpoint, usage=usage)
    return new if requirement.revolutions is None else cut(new, requirement.revolutions)


def _made(
    study: Runner,
    requirement: Requirement,
    points: Array,
    settings: Settings | None,
    others: Sequence[StudyResult],
) -> StudyResult:
    """The result of runs at the points and the midpoint."""
    new = _runs(study, requirement, points, settings)
    if not new.outputs:
        raise ArgumentError(
            "a band needs outputs over time: name some in Study(outputs=...), or have the model or table "
            "hold them; Study.sample() is for features alone"
        )
    limits = dict.fromkeys(new.outputs, (-math.inf, math.inf))
    if new.scene is not None:
        limits = physical_limits(new.outputs, _largest_clearances(study, new.scene, new.clearances))
    requirement = dataclasses.replace(
        requirement, runs=len(new.kept), failed=count_failed(new.failures), limits=limits
    )
    _check_enough(requirement, new.failures)
    table = Table.new(points, new)
    scored, nominal = table[: requirement.runs], table[requirement.runs :]
    facts = {"t": new.t, "outputs": new.outputs, "feature_names": new.feature_names, **new.facts}
    kept = _others(study, others, requirement, new.t, new.outputs, facts["scene"])
    del facts["stats"], facts["warnings"]
    messages = [*new.warnings, *_foreign(study, others, nominal, new.outputs)]
    messages += [] if requirement.revolutions is not None else unpredictable(new)
    whole = None if kept else table.values
    return _result(study, requirement, [scored], kept, nominal, messages, facts, whole)


def _check_enough(requirement: Requirement, failures: Sequence[FailedRun]) -> None:
    """Refuse to make bands of the few runs that failures left."""
    least = LEAST_RUNS
    if requirement.certified:
        least = max(least, _core.least_certifying_runs(requirement.coverage))
    if requirement.runs < least:
        kind = f"a certified band of {requirement.coverage:g}" if requirement.certified else "a band"
        raise ArgumentError(
            f"{kind} needs at least {least} runs, {requirement.runs} of "
            f"{requirement.runs + len(failures)} have a result; the first of the others is {failures[0]}"
        )


def extended(
    study: Runner, result: StudyResult, runs: int, include: StudyResult | Sequence[StudyResult]
) -> StudyResult:
    """The result of `StudyResult.extend`; see there."""
    checks = Checks()
    checks.whole("runs", runs, least=0, most=MOST_RUNS)
    others = _results(checks, include)
    requirement = result.requirement
    if requirement is None or requirement.certified:
        checks.add(f"only a result of Study.band can be extended, this is one of Study.{result.kind}")
    elif requirement.finished:
        checks.add("a table of finished runs has no further ones: make a new table")
    checks.finish()
    assert requirement is not None, "the checks let no other result pass"
    outputs = result.outputs
    old = Table.of(result, outputs)
    scored, messages = [old[: requirement.runs]], _lasting(result.warnings)
    good, begun = requirement.runs, requirement.runs + requirement.failed
    # Runs that time was short for are made now.
    failures = tuple(one for one in result.failures if one.reason != NOT_BEGUN or one.index >= begun + runs)
    seconds = result.seconds
    if runs > 0:
        seed = requirement.seed
        points = study.drawn(lambda box: sobol_points(box, begun, runs, seed))
        new = _runs(study, requirement, points, result.settings, midpoint=False)
        seconds += new.seconds
        scored.append(Table.new(points, new))
        messages += _lasting(new.warnings)
        good += len(new.kept)
        failures += tuple(dataclasses.replace(one, index=one.index + begun) for one in new.failures)
    kept = [old[requirement.runs :], *_others(study, others, requirement, result.t, outputs, result.scene)]
    messages += _foreign(study, others, Table.nominal(result), outputs)
    requirement = dataclasses.replace(requirement, runs=good, failed=count_failed(failures))
    messages += failure_warnings(failures, good + len(failures) + 1)
    facts = _facts(result) | {"seconds": seconds, "failures": failures}
    return _result(study, requirement, scored, kept, Table.nominal(result), messages, facts)


def shortened(study: Runner, result: StudyResult, runs: int) -> StudyResult:
    """The result of `Study.band` from the first runs of another one."""
    assert result.requirement is not None, "a result of Study.band"
    requirement = dataclasses.replace(result.requirement, runs=runs)
    first = Table.of(result, result.outputs)[:runs]
    facts = _facts(result) | {"seconds": math.nan}
    return _result(study, requirement, [first], [], Table.nominal(result), (), facts)


def _facts(result: StudyResult) -> dict[str, Any]:
    """Facts that results of the same study from other runs have in common."""
    return {
        "t": result.t,
        "outputs": result.outputs,
        "settings": result.settings,
        "scene": result.scene,
        "nominal_parameters": result.nominal_parameters,
        "feature_names": () if result.features is None else result.features.names,
    }


def _result(
    study: Runner,
    requirement: Requirement,
    scored: Sequence[Table],
    kept: Sequence[Table],
    nominal: Table,
    warnings: Sequence[str],
    facts: dict[str, Any],
    whole: Array | None = None,
) -> StudyResult:
    """The result of the runs of all tables; `whole` has their values if they are one array already."""
    kept = _without_twins(study, scored, kept)
    tables = [*scored, *kept]
    parameters = np.concatenate([table.parameters for table in tables])
    # Runs of another result may not know the features.
    found = [table.features for table in [*tables, nominal] if table.features is not None]
    features = None
    names = facts.pop("feature_names")
    if names and len(found) == len(tables) + 1:
        values = np.concatenate(found)
        # Included runs may lie on a grid.
        random = not kept and (not isinstance(study.model, FinishedRuns) or study.model.independent)
        features = FeatureTable(
            names,
            values[:-1],
            values[-1],
            study.intervals,
            parameters,
            random,
            study.normal,
            units_of(names, study.features, study.units, simulated=study.settings is not None),
            requirement.failed,
            isinstance(study.model, FinishedRuns),
            facts.get("nominal_parameters"),
        )
    result = StudyResult.from_runs(
        intervals=study.intervals,
        parameters=parameters,
        values=np.concatenate([one.values for one in [*tables, nominal]]) if whole is None else whole,
        degrees=None,
        nodes=(),
        requirement=requirement,
        threads=study.means.threads,
        stats=Costs.joined(table.stats for table in [*tables, nominal]),
        warnings=tuple(warnings),
        features=features,
        units=study.units,
        **facts,
    )
    # Shortcomings of the bands are known only now.
    messages = remarks(result.bands, requirement)
    if result.scene is not None:
        messages += early_widths(result.bands, settling_time(result.scene))
    return dataclasses.replace(result, warnings=(*warnings, *messages))


def _lasting(warnings: Sequence[str]) -> list[str]:
    """Warnings without those that count the runs so far."""
    return [text for text in warnings if not is_remark(text) and not is_failure_warning(text)]


def _results(checks: Checks, include: object) -> list[StudyResult]:
    """The results whose runs are to be included."""
    given = [include] if isinstance(include, StudyResult) else include
    if not isinstance(given, Sequence) or not all(isinstance(one, StudyResult) for one in given):
        checks.add(f"include must be results of studies, got {include!r}", wrong_type=True)
        return []
    return list(given)


def _others(
    study: Runner,
    results: Sequence[StudyResult],
    requirement: Requirement,
    t: Array,
    outputs: Sequence[str],
    scene: Scene | None,
) -> list[Table]:
    """The runs of other results, which must be of the same study or of a table of finished runs of it."""
    checks = Checks()
    for index, result in enumerate(results):
        missing = [name for name in outputs if name not in result.outputs]
        if missing:
            checks.add(f"include[{index}] misses the outputs {', '.join(missing)}")
        revolutions = None if result.requirement is None else result.requirement.revolutions
        if revolutions != requirement.revolutions:
            checks.add(f"include[{index}] has other revolutions, or none")
        elif len(result.t) != len(t) or np.max(np.abs(result.t - t)) > 1e-9 * (t[-1] - t[0]):
            checks.add(f"include[{index}] has other instants")
        if result.scene is not None and result.scene != scene:
            checks.add(f"include[{index}] is of another study: its midpoint is another scene")
        elif result.parameter_names != tuple(study.intervals):
            checks.add(f"include[{index}] has the parameters {', '.join(result.parameter_names)}")
        elif not _in_box(study, result.parameters):
            checks.add(f"include[{index}] has runs outside of the intervals of this study")
    checks.finish()
    return [Table.of(result, outputs) for result in results]


def _foreign(
    study: Runner, results: Sequence[StudyResult], nominal: Table, outputs: Sequence[str]
) -> list[str]:
    """Warnings of included results that are not those of this model at the midpoint, if they have the same.

    Other scenes are refused; what a model of one's own computes is not known.
    """
    found = []
    for index, result in enumerate(results):
        same = all(result.intervals[name].nominal == side.nominal for name, side in study.intervals.items())
        if study.settings is not None or not same or result.nominal_parameters is not None:
            continue
        values, other = nominal.values[0], np.stack([result[name].nominal for name in outputs], axis=-1)
        size = np.maximum(np.max(np.abs(values), axis=0), np.max(np.abs(other), axis=0))
        if np.any(np.abs(values - other) > _SAME_VALUES * size):
            found.append(
                f"include[{index}] has other values at the midpoint than this study: it is of another model, "
                "or results of the model are random"
            )
    return found


def _without_twins(study: Runner, scored: Sequence[Table], kept: Sequence[Table]) -> list[Table]:
    """The included runs at points that no held-out run has, and those that are the same only once.

    A run that is held out while its twin is not would always be inside.
    """
    if not kept:
        return []
    points = np.concatenate([table.parameters for table in (*scored, *kept)])
    # Points are the same to rounding; bit for bit where they come from the same sequence.
    cube = np.round(on_cube(study.intervals, points) / _SAME_POINT) + 0.0
    place = sum(len(table.parameters) for table in scored)
    held_out = {point.tobytes() for point in cube[:place]}
    seen: set[tuple[bytes, bytes]] = set()
    left = []
    for table in kept:
        rows = []
        for row, values in enumerate(table.values):
            point = cube[place + row].tobytes()
            # A table may have several runs at one point.
            same = (point, hashlib.sha256(values.tobytes()).digest())
            if point not in held_out and same not in seen:
                seen.add(same)
                rows.append(row)
        place += len(table.parameters)
        if rows:
            left.append(table[np.array(rows)])
    return left


def _in_box(study: Runner, points: Array) -> bool:
    """Whether points are in the box, up to rounding of its ends."""
    sides = list(study.intervals.values())
    slack = np.array([1e-9 * side.half_width for side in sides])
    lower, upper = np.array([side.lower for side in sides]), np.array([side.upper for side in sides])
    return bool(np.all((points >= lower - slack) & (points <= upper + slack)))


def _largest_clearances(study: Runner, scene: Scene, found: Mapping[str, float]) -> dict[str, float]:
    """Largest clearance of each joint in the box, where it depends on one parameter at a time [m].

    It includes those of the scene at the midpoint and those `found` in the runs. Joints whose clearances at
    the ends of the box are unknown are left out.
    """
    middle = {name: side.nominal for name, side in study.intervals.items()}
    nominal, largest = _clearances(scene), _clearances(scene)
    for name, side in study.intervals.items():
        ends = []
        for end in (side.lower, side.upper):
            try:
                ends.append(_clearances(study.scene({**middle, name: end})))
            except Exception:  # no mechanism there, or a callable that fails
                return {}
        for joint in nominal:
            largest[joint] += max(0.0, *(at[joint] - nominal[joint] for at in ends))
    return {joint: max(clearance, found.get(joint, 0.0)) for joint, clearance in largest.items()}


def _clearances(scene: Scene) -> dict[str, float]:
    return {joint.name: joint.clearance for joint in scene.joints if isinstance(joint, ClearanceRevolute)}
