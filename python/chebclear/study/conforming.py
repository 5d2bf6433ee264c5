"""The runs that tell which share of mechanisms keeps to specifications; see `conformance`."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ..base.arguments import Checks
from ..base.rows import Array
from ..base.shown import meant_or_known
from ..errors import ArgumentError, ArgumentTypeError
from ..execution.failures import AllFailedError, FailedRun, count_failed, failure_notices
from ..execution.pieces import NOT_BEGUN
from ..notices import Notice, issue
from ..run.features import lowest, peak
from ..run.resampling import at_angle
from ..run.settings import Settings
from ..scene.columns import column_unit
from ..scene.distributions import Uniform
from . import answers
from .answers import lasting, result_of
from .band.exact import looks
from .band.gridded import Grid
from .by_angle import LEAST_STEPS, crank_of, drives_of
from .features.effects import CONFIDENCE
from .requirements.conformance import Conformance, Share, share_of
from .requirements.draws import check_drawn, drawn, places
from .requirements.specification import ALL, Specification, checked_specifications
from .results import StudyResult
from .runner import Design, Runner
from .sources.asked import FeatureSpec, outputs_of, tracked_features, units_of
from .sources.finished import FinishedRuns
from .sources.run_table import RunTable
from .sources.scenes import MOST_RUNS, scene_of
from .spec import declared_order

if TYPE_CHECKING:
    from .study import Study


# Runs of the first piece where failures end them.
_FIRST_PIECE = 200
# Least number of mechanisms that a study draws for its requirements [-]: with none of them outside, at least
# 96.4 % are in specification.
_LEAST_RUNS = 100
# Steps of the crank angle that are taken as one where a crank turns faster than in the nominal mechanism [-].
_COARSEST = 2.0


class NeverPassedError(ArgumentError):
    """No run passes the crank angle at which a quantity counts."""


@dataclass(frozen=True)
class Watched:
    """What is taken from every run for a specification."""

    features: tuple[str, str] | None
    """Features of the lowest and the highest value; None takes them from the samples."""
    unit: str
    """Unit of the quantity."""
    limits: tuple[float, float]
    """Its limits in that unit."""
    crank: str | None = None
    """Output that is the crank angle, where the quantity counts at one; None elsewhere."""

    def is_outside(self, extremes: Array) -> NDArray[np.bool_]:
        """Which runs break them, by the lowest and the highest value of each, or failed."""
        outside: NDArray[np.bool_] = ~((extremes[0] > self.limits[0]) & (extremes[1] < self.limits[1]))
        return outside


def conformance(
    study: Study,
    specifications: Specification | Sequence[Specification] | Mapping[str, Specification] | None = None,
    runs: int = 1000,
    *,
    failures: int | None = None,
    width: float | None = None,
    inner: int = 0,
    confidence: float = 0.95,
    rng: int | Generator | None = 0,
) -> Conformance:
    """The share of mechanisms that keep to specifications, from mechanisms drawn at random.

    Parameters are drawn independently from their distributions, such as `normal`. Those that are only
    known as an `Interval` have none: the runs are repeated at their nominal values, at every corner of
    their intervals and at points inside, and the interval of the share is that of the smallest and the
    largest of these. Between the points nothing is known.

    Parameters
    ----------
    study : Study
        The mechanism, or a model of your own.
    specifications : Specification, or sequence or mapping of them by name, optional
        What to keep to, made by `require`; the requirements of the study if not given.
    runs : int
        Mechanisms to simulate, or the most of them [-]; times the points of parameters that are intervals.
        They are fewer where `max_seconds` of the study ends them.
    failures : int, optional
        Runs end once so many mechanisms are outside of each specification [-]; the relative error of the
        share outside is then about 2 over its root, and its interval is exact as well.
    width : float, optional
        Runs end once the interval of each share is as narrow [-]. It is looked at a few times that are fixed
        in advance, and wide enough to hold at all of them.
    inner : int
        Points inside the intervals of parameters that are only known as intervals [-], besides corners.
    confidence : float
        Probability that the interval of a share holds the true one [-].
    rng : int, numpy.random.Generator or None
        Seed or generator of the draws; None for fresh ones. The seed is kept with the result.

    Returns
    -------
    Conformance

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; all problems are listed.
    SceneError, SimulationError
        As `Study.band`. A mechanism that fails counts as outside.

    Examples
    --------
    >>> import chebclear as cc
    >>> def shaft(gap, thread):
    ...     return {"play": gap - thread}
    >>> study = cc.Study(shaft, {"gap": cc.normal(10.1, 0.02), "thread": cc.normal(10.0, 0.02)})
    >>> print(cc.conformance(study, {"play": cc.require("play", above=0.04)}, 4000))
    play: 98.0 % in specification, between 97.6 % and 98.5 % with 95 % confidence (78 of 4000 outside)
    """
    if not isinstance(getattr(study, "runner", None), Runner):
        raise ArgumentTypeError(f"study must be a Study, got {study!r:.80}")
    checks = Checks()
    asked = requested(checks, study.runner, specifications)
    count = checks.whole("runs", runs, least=2, most=MOST_RUNS)
    if failures is not None:
        failures = checks.whole("failures", failures, least=2)
    if width is not None:
        width = checks.real("width", width, "-", above=0.0, below=1.0)
    if failures is not None and width is not None:
        checks.add("failures", "and width are two rules of when to end: give one")
    checks.whole("inner", inner, least=0, most=MOST_RUNS)
    level = checks.real("confidence", confidence, "-", above=0.0, below=1.0)
    seed = checks.seed("rng", rng)
    if isinstance(study.runner.model, FinishedRuns):
        text = "is a table of finished runs, which were not drawn from the distributions of its parameters"
        checks.add("study", text)
    check_drawn(checks, study.runner.parameters)
    checks.finish()
    found = shares_of(study.runner, asked, count, level, seed, failures, width, inner)
    issue(found.notices)
    return found


def requested(
    checks: Checks, runner: Runner, specifications: object, argument: str = "specifications"
) -> Mapping[str, Specification]:
    """The specifications that an argument gives, else the requirements of the study."""
    if specifications is not None:
        return checked_specifications(checks, specifications, argument)
    if not runner.requirements:
        checks.add(argument, "must be given, or the study its requirements")
    return runner.requirements


def shares_of(
    runner: Runner,
    asked: Mapping[str, Specification],
    runs: int,
    confidence: float,
    seed: int,
    failures: int | None = None,
    width: float | None = None,
    inner: int = 0,
) -> Conformance:
    """The shares of `conformance`, whose arguments are checked; issues no warnings."""
    watching, watched = watching_for(runner, asked)
    at = places(runner.parameters, inner, seed)
    draws = drawn(runner.parameters, declared_order(runner.build, runner.parameters), runs, seed)
    # For each place the extremes of each specification's quantity, shape (2, runs).
    extremes = [[np.empty((2, 0)) for _ in asked] for _ in at]
    notices: dict[object, Notice] = {}
    failed: list[FailedRun] = []
    if width is not None:
        stops = looks(width, runs, confidence)
    elif failures is not None:
        # Each piece doubles the runs.
        stops = [*(_FIRST_PIECE << k for k in range(runs.bit_length()) if _FIRST_PIECE << k < runs), runs]
    else:
        stops = [runs]
    budget, start = runner.execution.max_seconds, time.perf_counter()
    done = 0
    for stop in stops:
        begun = stop - done
        for place, found in zip(at, extremes, strict=True):
            points = placed(runner, draws[done:stop], place)
            if budget is not None:
                left = max(budget - (time.perf_counter() - start), 0.0)
                watching = replace(watching, execution=replace(watching.execution, max_seconds=left))
            try:
                made = watching.made(points, watching.settings, midpoint=False)
            except AllFailedError as error:
                raise error.first from None
            late = [one.index for one in made.failures if one.reason == NOT_BEGUN]
            begun = min([begun, *late])
            failed += [replace(one, index=one.index + done) for one in made.failures]
            notices = {(one.code, one.about): one for one in lasting(made.notices)} | notices
            for index, (name, one) in enumerate(asked.items()):
                more = extremes_of(made, name, one, watched[name], len(points))
                found[index] = np.concatenate([found[index], more], axis=1)
        done += begun
        extremes = [[values[:, :done] for values in found] for found in extremes]
        shares = shares_at(asked, watched, at, extremes, confidence, failures, len(stops) if width else 1)
        if done < stop or _is_enough(shares, failures, width):
            break
    most = max(share.runs for share in shares.values())
    parameters = placed(runner, draws[:most], at[0])
    told = (*notices.values(), *failure_notices(failed, len(at) * stop))
    return Conformance(shares, parameters, tuple(runner.parameters), seed, told)


def answered(runner: Runner, design: Design) -> StudyResult:
    """The result of a design, with the shares of the requirements of the study; issues no warnings.

    The shares are those of its runs if these are draws from the distributions, else of as many others.
    """
    asked, shares = design.asked, None
    own = _are_draws(runner, design)
    if own:
        runner = _following(runner)
        if design.settings is not None and runner.settings is not None:
            design = replace(design, settings=replace(design.settings, features=runner.settings.features))
    own, left = own and design.independent, design.seconds
    if runner.requirements and not own:
        # Both have half of the time, and what the first leaves is the second's.
        start, half = time.perf_counter(), None if left is None else 0.5 * left
        limited = runner.limited(half, design.answers_from)
        shares = _of_others(limited, design.settings, len(design.points), asked.seed or 0)
        left = None if left is None else max(left - (time.perf_counter() - start), 0.5 * left)
    limited = runner.limited(left, design.answers_from)
    runs = limited.made(design.points, design.settings, usage=design.usage)
    result = result_of(runner, design, runs)
    if own:
        shares = _of_runs(runner, result)
    return result if shares is None else _with(result, shares)


def _are_draws(runner: Runner, design: Design) -> bool:
    """Whether the runs of a design may be draws from the distributions, so that shares follow from them."""
    asked = design.asked
    own = asked.kind == "sample" if isinstance(asked, Grid) else asked.revolutions is None
    # Independent points of the box are draws from uniform distributions; an instant is among all samples.
    own = own and all(isinstance(one, Uniform) for one in runner.parameters.values())
    return own and bool(runner.requirements) and all(one.at is None for one in runner.requirements.values())


def runs_for_shares(runner: Runner, design: Design) -> int:
    """Runs that `answered` makes besides those of the design, for the shares of the requirements."""
    if not runner.requirements or (_are_draws(runner, design) and design.independent):
        return 0
    return max(_LEAST_RUNS, len(design.points)) * len(places(runner.parameters, 0, 0))


def extended(
    runner: Runner, result: StudyResult, runs: int, include: StudyResult | Sequence[StudyResult]
) -> StudyResult:
    """The result of `StudyResult.extend` with the shares of all runs."""
    checks = Checks()
    answers.check_same_study(checks, runner, result)
    if not isinstance(result, StudyResult):
        checks.finish()
    own = result.conformance is not None and result.conformance.seed is None
    more = answers.extended(checks, _following(runner) if own else runner, result, runs, include)
    requirement = more.requirement
    assert requirement is not None, "only results of band can be extended"
    if own and len(more.parameters) == requirement.runs:  # without included ones
        return _with(more, _of_runs(runner, more))
    if not runner.requirements:
        return more
    count = requirement.runs + len(more.failures)
    return _with(more, _of_others(runner, more.settings, count, requirement.seed))


def _following(runner: Runner) -> Runner:
    """The runner with the features that its requirements need."""
    if runner.settings is None:
        return runner
    features = watching_for(runner, runner.requirements)[0].features
    settings = replace(runner.settings, features=tracked_features(features.values()))
    return replace(runner, features=features, settings=settings)


def _of_others(runner: Runner, settings: Settings | None, runs: int, seed: int) -> Conformance:
    """Shares of as many mechanisms, simulated as those of the study."""
    alike = replace(runner, settings=settings)
    return shares_of(alike, runner.requirements, max(_LEAST_RUNS, runs), CONFIDENCE, seed)


def _of_runs(runner: Runner, result: StudyResult) -> Conformance:
    """Shares of the mechanisms of a result, which were drawn from the distributions."""
    watched = watching_for(runner, runner.requirements)[1]
    outputs = [one.quantity for one in runner.requirements.values() if one.quantity in result.bands]
    runs = result.run_table(outputs)[: len(result.parameters)]
    count = len(result.parameters) + count_failed(result.failures)
    extremes = [
        extremes_of(runs, name, one, watched[name], count) for name, one in runner.requirements.items()
    ]
    at = places(runner.parameters, 0, 0)
    shares = shares_at(runner.requirements, watched, at, [extremes], CONFIDENCE, None)
    return Conformance(shares, result.parameters, result.parameter_names, None)


def _with(result: StudyResult, shares: Conformance) -> StudyResult:
    """The result with shares, and with what else is to be said of these."""
    known = {(one.code, one.about) for one in result.notices}
    more = [one for one in shares.notices if (one.code, one.about) not in known]
    return replace(result, conformance=shares, notices=(*result.notices, *more))


def _is_enough(shares: dict[str, Share], failures: int | None, width: float | None) -> bool:
    """Whether no further runs are needed."""
    if failures is not None:
        return all(np.all(share.counts[:, 1] >= failures) for share in shares.values())
    return width is not None and all(np.all(np.diff(one.intervals) <= width) for one in shares.values())


def watching_for(runner: Runner, asked: Mapping[str, Specification]) -> tuple[Runner, dict[str, Watched]]:
    """The runner with the features that the specifications need, and what each takes from a run."""
    checks = Checks()
    features: dict[str, FeatureSpec] = dict(runner.features)
    settings = runner.settings
    columns: list[str] = []
    if settings is not None:
        nominal_scene = scene_of(runner, runner.nominal)
        facts = nominal_scene.check()
        columns = [*facts.columns, *facts.further_columns]
    watched: dict[str, Watched] = {}
    sampled: list[str] = []
    steps = 1
    for name, one in asked.items():
        place, quantity = f'specifications["{name}"]', one.quantity
        taken: tuple[str, str] | None = (quantity, quantity)
        crank = None
        if quantity in runner.features:
            unit = units_of([quantity], runner.features, runner.units, simulated=settings is not None)[0]
            if one.at is not None:
                checks.add(place, f'"{quantity}" is a feature of the whole run: leave out at')
        elif settings is not None:
            unit = column_unit(quantity)
            if quantity not in columns:
                known = [*runner.features, *columns]
                checks.add(place, f'unknown output or feature "{quantity}"{meant_or_known(quantity, known)}')
            elif one.angle is not None:
                joint = crank_of(checks, nominal_scene, one.joint, f"{place}.joint")
                crank, taken = f"{joint}.angle", None
                sampled += [quantity, crank]
                if joint in (driven := drives_of(nominal_scene)):
                    turns = abs(driven[joint].speed) * settings.duration / (2.0 * math.pi)
                    steps = max(steps, math.ceil(turns * LEAST_STEPS / (settings.samples - 1)))
            elif one.at is not None:
                t = np.linspace(settings.skip, settings.skip + settings.duration, settings.samples)
                _sample_at(checks, place, float(one.at), t)
                taken = None
                sampled.append(quantity)
            else:
                taken = f"lowest of {quantity}", f"peak of {quantity}"
                features |= {taken[0]: lowest(quantity), taken[1]: peak(quantity)}
        else:
            # A model of the user's own: outputs are known once it has run.
            unit, taken = runner.units.get(quantity, ""), None
            if one.angle is not None:
                checks.add(place, "an angle needs scenes: a model of your own has no crank")
        watched[name] = Watched(taken, unit, one.limits(checks, place, unit), crank)
    checks.finish()
    if settings is not None:
        core = tracked_features(features.values())
        kept = outputs_of(features, settings)
        outputs = None if kept is None else tuple(dict.fromkeys([*kept, *sampled]))
        # Instants of the study remain among the samples.
        samples = steps * (settings.samples - 1) + 1
        settings = replace(settings, features=core, outputs=outputs, samples=samples)
    # A mechanism that fails counts as outside, however many do.
    execution = replace(runner.execution, most_failed=1.0)
    return replace(runner, features=features, settings=settings, execution=execution), watched


def _sample_at(checks: Checks, place: str, at: float, t: Array) -> int:
    """Index of the sample at an instant, which must be one of them."""
    nearest = int(np.argmin(np.abs(t - at)))
    if abs(float(t[nearest]) - at) > 1e-9 * float(t[-1] - t[0]):
        message = f"at = {at:g} s is none of the samples; the nearest is {t[nearest]:.9g} s"
        if not t[0] <= at <= t[-1]:
            message = f"at = {at:g} s is never sampled: samples are from {t[0]:.9g} to {t[-1]:.9g} s"
        checks.add(place, message)
    return nearest


def placed(runner: Runner, draws: Array, place: dict[str, float]) -> Array:
    """Drawn points with these values of the parameters that are only known as intervals."""
    points = draws.copy()
    for column, name in enumerate(runner.parameters):
        if name in place:
            points[:, column] = place[name]
    return points


def extremes_of(runs: RunTable, name: str, one: Specification, watched: Watched, points: int) -> Array:
    """The lowest and the highest value in each run, NaN where it failed, shape (2, points)."""
    found = np.full((2, points), np.nan)
    if watched.features is not None:
        assert runs.features is not None
        columns = [runs.feature_names.index(feature) for feature in watched.features]
        found[0, runs.kept] = runs.features[:, :, columns[0]].min(axis=1)
        found[1, runs.kept] = runs.features[:, :, columns[1]].max(axis=1)
        return found
    if one.quantity in runs.feature_names:  # a number of a model
        assert runs.features is not None
        if one.at is not None:
            checks = Checks()
            checks.add(f'specifications["{name}"]', "is a number of the whole run: leave out at")
            checks.finish()
        found[:, runs.kept] = runs.features[:, 0, runs.feature_names.index(one.quantity)]
        return found
    if one.quantity not in runs.outputs:
        known = [*runs.outputs, *runs.feature_names]
        hint = meant_or_known(one.quantity, known)
        raise ArgumentError(f'specifications["{name}"]: unknown output or feature "{one.quantity}"{hint}')
    values = runs.values[:, :, runs.outputs.index(one.quantity)]
    if watched.crank is not None and one.angle is not None:
        angles = runs.values[:, :, runs.outputs.index(watched.crank)]
        turned = float(np.max(np.abs(np.diff(angles, axis=1)))) / (2.0 * math.pi)
        if turned > _COARSEST / LEAST_STEPS:
            least = math.ceil(turned * LEAST_STEPS * (len(runs.t) - 1)) + 1
            raise ArgumentError(
                f'specifications["{name}"]: the samples are too coarse for a crank angle, the crank turns by '
                f"up to {360.0 * turned:.3g} deg between them; it takes {least} samples"
            )
        for row, angle, own in zip(runs.kept, angles, values, strict=True):
            passings = at_angle(runs.t, angle, own, one.angle)
            if len(passings):
                found[:, row] = passings.min(), passings.max()
        if np.isnan(found).all():
            raise NeverPassedError(
                f'specifications["{name}"]: no crank passes {one.at} in the sampled time: give the study a '
                "longer duration"
            )
        return found
    if one.at is not None and not isinstance(one.at, str):
        checks = Checks()
        values = values[:, [_sample_at(checks, f'specifications["{name}"]', float(one.at), runs.t)]]
        checks.finish()
    found[0, runs.kept], found[1, runs.kept] = values.min(axis=1), values.max(axis=1)
    return found


def shares_at(
    asked: Mapping[str, Specification],
    watched: Mapping[str, Watched],
    at: list[dict[str, float]],
    extremes: list[list[Array]],
    *how: Any,
) -> dict[str, Share]:
    """The share of each specification and, if there are several, of all together; see `share_of`."""
    shares = {}
    for index, (name, one) in enumerate(asked.items()):
        own = watched[name]
        ends = [(found[index][0], found[index][1]) for found in extremes]
        shares[name] = share_of(name, one, own.unit, own.limits, at, ends, *how)
    if len(asked) > 1:
        # Each run has the number of specifications that it breaks.
        broken = []
        for found in extremes:
            outside = [one.is_outside(values) for one, values in zip(watched.values(), found, strict=True)]
            count = np.sum(outside, axis=0, dtype=float)
            broken.append((count, count))
        words = Specification("specifications broken", below=1)
        shares[ALL] = share_of(ALL, words, "-", (-np.inf, 1.0), at, broken, *how)
    return shares
