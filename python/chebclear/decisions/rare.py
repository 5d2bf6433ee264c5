"""The share of mechanisms outside of specifications where it is too rare to be counted; see `rare_share`."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import Generator, default_rng

from ..base.arguments import Checks
from ..base.progress import Progress, reporter
from ..base.rows import Array
from ..errors import ArgumentTypeError
from ..execution.failures import AllFailedError, FailedRun, failure_notices
from ..execution.pieces import TIME_LIMIT
from ..execution.store import SeenFolder
from ..notices import Notice, issue
from ..scene.parts import joints_with_play
from ..scene.scene import Interval
from ..study.answers import lasting
from ..study.conforming import (
    NeverPassedError,
    Watched,
    extremes_of,
    placed,
    requested,
    shares_at,
)
from ..study.requirements.conformance import Share
from ..study.requirements.draws import check_drawn, drawn, places
from ..study.requirements.specification import Specification
from ..study.results import StudyResult
from ..study.runner import Runner
from ..study.sources.finished import FinishedRuns
from ..study.sources.scenes import MOST_RUNS, scene_of
from ..study.spec import declared_order
from ..study.study import Study
from .near_limits import near_limits
from .rare_result import Cause, RareShare, SplittingSystems, causes_of
from .splitting import COUNTED, Reason, Rounds, SpentError, Split, Verdict, is_doubtful, split
from .watched_runs import WatchedRuns

MOST_INTERVALS = 2
"""Most parameters that are only known as intervals [-]: each of their corners takes a splitting of its
own."""
# Share at which the factor between it and its upper end is that asked for [-].
_TYPICAL = 1e-5
# Half width of an interval of 95 %, over the standard error of independent particles [-]: measured.
_HALF_WIDTH = 1.25 * 1.96
# Particles of a system are a multiple of the first, at least the second [-].
_STEP, _LEAST_PARTICLES = 5, 25
# First draws over those that go on, at least [-].
_DRAWS_OVER_KEPT = 5
# First draws between two looks at the time.
_PIECE = 500
# Part of the last particles that failed from which failing is what is rare [-].
_MANY_FAILED = 0.1


def rare_share(
    study: Study,
    specification: Specification | Sequence[Specification] | Mapping[str, Specification] | None = None,
    along: StudyResult | None = None,
    runs: int | None = None,
    *,
    factor: float = 1.5,
    plain: int = 2000,
    at_once: int | None = None,
    draws: int = 10_000_000,
    confidence: float = 0.95,
    rng: int | Generator | None = 0,
) -> RareShare:
    """The share of mechanisms outside of specifications where it is too rare to be counted.

    First mechanisms are drawn and counted. If fewer than 50 are outside, the worst of them go on: systems of
    particles move from level to level towards the limits, each draw not far from one that is nearly outside.
    What they cost depends neither on the number of parameters nor on how smooth the response is: 40,000 runs
    for a share of 1e-5, 57,000 for 1e-7. Where the systems disagree, or few draws are accepted, there is no
    number: the verdict is ``"unknown"`` and says why.

    With `along`, a polynomial that follows the output says of many drawn mechanisms which are outside or near
    the limits; only these are simulated. The share is that of the mechanisms near the limits, counted in the
    draws, times the share of them outside, counted in runs, whatever the polynomial is worth. That no others
    are outside is its claim; a tenth as many runs elsewhere check it.

    Parameters
    ----------
    study : Study
        The mechanism, or a model of your own. Parameters have distributions; up to two may be intervals,
        whose nominal values and corners each take runs of their own.
    specification : Specification, or sequence or mapping of them by name, optional
        What to keep to, made by `require`: of several, the share that breaks one of them. The requirements of
        the study if not given.
    along : StudyResult, optional
        Result of a study of the same parameters whose polynomial follows the output: the band is
        `resolved`. Its intervals should reach as far as mechanisms go that are outside, five standard
        deviations say; mechanisms beyond them count as near the limits. It takes one specification, not at a
        crank angle.
    runs : int, optional
        The most mechanisms to simulate [-]: a million if not given. With `along`, those near the limits:
        1000.
    factor : float
        How many times the share its upper end may be, for a share of 1e-5 [-], 1.05 to 2: half the logarithm
        takes four times the runs.
    plain : int
        Mechanisms that are drawn and counted first [-], at least 500. Where impacts decide, take three over
        the share that matters: what none of them meets may be missed.
    at_once : int, optional
        Mechanisms that may be simulated side by side [-]: 40 if not given, up to 200 at the same cost, for
        many workers, and more with a smaller `factor`.
    draws : int
        With `along`, most mechanisms to draw [-].
    confidence : float
        Of the interval [-].
    rng : int, numpy.random.Generator or None
        Seed or generator of the draws; None for fresh ones. The same seed gives the same bits for any number
        of threads, any executor, and where a store has some of the runs. `conformance` with this seed has the
        same first draws.

    Returns
    -------
    RareShare

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong, or no polynomial follows the output; all problems are listed.
    SceneError, SimulationError
        As `conformance`. A mechanism that fails counts as outside.

    Examples
    --------
    >>> import chebclear as cc
    >>> def shaft(gap, thread):
    ...     return {"play": gap - thread}
    >>> study = cc.Study(shaft, {"gap": cc.normal(10.1, 0.02), "thread": cc.normal(10.0, 0.015)})
    >>> found = cc.rare_share(study, cc.require("play", above=0.0), factor=2.0, plain=1000)
    >>> found.verdict, found.lower < 3.17e-5 < found.upper
    ('known', True)
    >>> print(found.causes[0])
    gap is 3.5 standard deviations too small
    """
    if not isinstance(study, Study) or not (along is None or isinstance(along, StudyResult)):
        raise ArgumentTypeError(
            f"study, along must be a Study and a result, got {study!r:.40}, {along!r:.40}"
        )
    runner, checks = study.runner, Checks()
    asked = requested(checks, runner, specification, "specification")
    for name, one in runner.random.items():
        if one.least_share > 0.0:
            checks.add(
                f'parameters["{name}"]',
                f"is a sample, which tells nothing of shares below {one.least_share:.2g}: count by "
                "conformance, or give a form, as with sampled(values).as_normal()",
            )
    most_draws = checks.whole("draws", draws, least=1)
    level = checks.real("confidence", confidence, "-", above=0.5, below=1.0)
    seed = checks.seed("rng", rng)
    if isinstance(runner.model, FinishedRuns):
        checks.add("study", "is a table of finished runs, which has no other mechanisms")
    if along is not None:
        return _along(runner, checks, asked, along, runs, most_draws, level, seed)
    first = checks.whole("plain", plain, least=_PIECE, most=MOST_RUNS)
    wide = checks.real("factor", factor, "-", least=1.05, most=2.0)
    most = MOST_RUNS if runs is None else checks.whole("runs", runs, least=_PIECE, most=MOST_RUNS)
    side_by_side = None if at_once is None else checks.whole("at_once", at_once, least=1, most=MOST_RUNS)
    check_drawn(checks, runner.parameters)
    sides = [name for name, one in runner.parameters.items() if isinstance(one, Interval)]
    if len(sides) > MOST_INTERVALS:
        checks.add(
            "study",
            f"must have at most {MOST_INTERVALS} parameters only known as intervals, got {len(sides)}: each "
            "corner takes a splitting of its own; find the worst corner by conformance, and ask for that",
        )
    watching, watched = _checked_watching(checks, runner, asked)
    rounds = _rounds(wide, side_by_side)
    first = max(first, _DRAWS_OVER_KEPT * rounds.kept)
    needed = first * len(places(runner.parameters, 0, 0))
    if most < needed:
        checks.add("runs", f"must be at least {needed}, the draws that are counted first, got {most}")
        checks.finish()
    return _split(_Answer(runner, watching, asked, watched, level, seed, most), first, rounds)


def share_of(
    runner: Runner,
    asked: Mapping[str, Specification],
    confidence: float,
    seed: int,
    plain: int,
    factor: float,
) -> RareShare:
    """What `rare_share` finds of a study, with arguments that are checked."""
    watching, watched = _checked_watching(Checks(), runner, asked)
    rounds = _rounds(factor, None)
    first = max(plain, _PIECE, _DRAWS_OVER_KEPT * rounds.kept)
    return _split(_Answer(runner, watching, asked, watched, confidence, seed, MOST_RUNS), first, rounds)


def expected_runs(plain: int, factor: float) -> int:
    """Runs of the answer to a typical share."""
    rounds = _rounds(factor, None)
    first = max(plain, _PIECE, _DRAWS_OVER_KEPT * rounds.kept)
    return first + rounds.expected(-math.log(_TYPICAL), first)


def _split(answer: _Answer, first: int, rounds: Rounds) -> RareShare:
    """The answer by counting and splitting at all places of parameters that are intervals."""
    at = places(answer.runner.parameters, 0, 0)
    with reporter(answer.runner.progress, "rare share") as report:
        answer.report = report
        answer.expected = len(at) * (first + rounds.expected(-math.log(_TYPICAL), first))
        found = [answer.place(place, first, rounds) for place in at]
    one, split_ = found[0].plain, found[0].split
    verdicts = [each.split.verdict for each in found]
    verdict = next(word for word in ("unknown", "below", "known") if word in verdicts)
    reason = found[verdicts.index(verdict)].split.reason
    intervals = np.array([(each.split.lower, each.split.upper) for each in found])
    failing = split_.badness >= 0.0
    scores = split_.scores[failing]
    values = answer.points(scores, at[0])
    causes: tuple[Cause, ...] = ()
    random = answer.runner.random
    if verdict == "known" and len(scores):
        columns = [list(answer.runner.parameters).index(name) for name in random]
        own = values[:, columns]
        slopes = [each.slopes(column) for each, column in zip(random.values(), own.T, strict=True)]
        names = [(name, answer.runner.units.get(name, "")) for name in random]
        causes = causes_of(scores, own, slopes, len(split_.exponents), names)
    has_play = False
    if answer.watching.settings is not None:
        scene = scene_of(answer.runner, answer.runner.nominal)
        has_play = bool(joints_with_play(scene.joints))
    notices = answer.told(split_)
    issue(notices)
    return RareShare(
        specifications=dict(answer.asked),
        verdict=verdict,
        reason=reason,
        share=split_.share if verdict == "known" else math.nan,
        lower=float(intervals[:, 0].min()) if verdict == "known" else 0.0,
        upper=float(intervals[:, 1].max()),
        confidence=answer.confidence,
        runs=answer.made,
        seed=answer.seed,
        plain=one,
        systems=SplittingSystems(split_.exponents, split_.acceptance, split_.steps),
        inflation=split_.inflation,
        mechanisms=values,
        parameter_names=tuple(answer.runner.parameters),
        causes=causes,
        at=tuple(at),
        intervals=intervals,
        has_play=has_play,
        polynomial=None,
        notices=notices,
    )


@dataclass
class _Place:
    """What was found with some values of the parameters that are intervals."""

    plain: Share
    split: Split


@dataclass(eq=False)
class _Answer:
    """The runs of an answer, and what they say."""

    runner: Runner
    watching: Runner
    asked: Mapping[str, Specification]
    watched: dict[str, Watched]
    confidence: float
    seed: int
    most: int
    """The most runs [-]."""
    made: int = 0
    """Runs made [-]."""
    expected: int = 0
    report: Progress | None = None
    notices: dict[object, Notice] = field(default_factory=dict)
    failed: list[FailedRun] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._begin = time.monotonic()
        self._seconds = self.runner.execution.max_seconds
        self._order = declared_order(self.runner.build, self.runner.parameters)
        self._scales = np.ones(len(self.asked))

    def place(self, place: dict[str, float], first: int, rounds: Rounds) -> _Place:
        """Count and split with these values of the parameters that are intervals."""
        found = self._once(place, first, rounds, self.seed)
        if not is_doubtful(found.split):
            return found
        # Whichever looks better: the one with twice the particles and proposals counts, on draws of its own.
        rounds = rounds.doubled
        first = max(first, _DRAWS_OVER_KEPT * rounds.kept)
        if self.made + first + rounds.expected(float(np.mean(found.split.exponents)), first) > self.most:
            return found
        return self._once(place, first, rounds, int(default_rng([self.seed, *b"again"]).integers(2**63)))

    def _once(self, place: dict[str, float], first: int, rounds: Rounds, seed: int) -> _Place:
        draws = drawn(self.runner.parameters, self._order, first, seed)
        points = placed(self.runner, draws, place)
        extremes = self._extremes(points[:_PIECE], required=True)
        ended: Reason = ""
        for row in range(_PIECE, first, _PIECE):
            try:
                more = self._extremes(points[row : row + _PIECE])
            except SpentError as spent:
                ended = spent.reason
                break
            extremes = [np.concatenate(pair, axis=1) for pair in zip(extremes, more, strict=True)]
        draws = draws[: extremes[0].shape[1]]
        plain = list(
            shares_at(self.asked, self.watched, [place], [extremes], self.confidence, None).values()
        )[-1]
        self._scales = np.ones(len(self.asked))
        if len(self.asked) > 1:
            self._scales = np.array([_spread(one) for one in self._each(extremes)])
        badness = self._badness(extremes)
        names = list(self.runner.parameters)
        scores = np.empty((len(draws), len(self.runner.random)))
        for column, (name, one) in enumerate(self.runner.random.items()):
            scores[:, column] = one.scores(draws[:, names.index(name)])
        outside = badness >= 0.0
        if plain.outside >= COUNTED or ended:
            verdict: Verdict = "known" if plain.outside >= COUNTED else "below"
            found = Split(
                verdict,
                "counted" if verdict == "known" else ended,
                1.0 - plain.share if verdict == "known" else math.nan,
                1.0 - plain.upper if verdict == "known" else 0.0,
                1.0 - plain.lower,
                scores=scores[outside],
                badness=badness[outside],
            )
            return _Place(plain, found)
        start = int(default_rng([seed, *b"split"]).integers(2**63))
        found = split(
            lambda more: self._badness_at(self.points(more, place)),
            scores,
            badness,
            rounds,
            start,
            self.confidence,
        )
        if found.verdict == "unknown":
            # Those that the first draws met are as sure as those of the systems.
            scores = np.concatenate([scores[outside], found.scores])
            found = replace(found, scores=scores, badness=np.concatenate([badness[outside], found.badness]))
        return _Place(plain, found)

    def points(self, scores: Array, place: Mapping[str, float]) -> Array:
        """Parameters of mechanisms from standard normal scores of the random ones."""
        points = np.empty((len(scores), len(self.runner.parameters)))
        names = list(self.runner.parameters)
        for column, (name, one) in enumerate(self.runner.random.items()):
            points[:, names.index(name)] = one.at(scores[:, column])
        return placed(self.runner, points, dict(place))

    def _badness_at(self, points: Array) -> Array:
        pieces = [points[row : row + _PIECE] for row in range(0, len(points), _PIECE)]
        return np.concatenate([self._badness(self._extremes(piece)) for piece in pieces])

    def _extremes(self, points: Array, *, required: bool = False) -> list[Array]:
        """Lowest and highest value of each quantity in runs, NaN where one failed; `required` ones are made
        whatever
        the time, and may not all fail."""
        if not required and self.made + len(points) > self.most:
            raise SpentError("runs")
        over = self._seconds is not None and time.monotonic() - self._begin >= self._seconds
        if over and not required:
            raise SpentError("seconds")
        none = np.full((2, len(points)), np.nan)
        found: list[Array] = []
        try:
            made = self.watching.made(points, self.watching.settings, midpoint=False)
        except AllFailedError as error:
            if required:
                raise error.first from None
            found = [none] * len(self.asked)
        else:
            self.failed += [replace(one, index=one.index + self.made) for one in made.failures]
            self.notices = {(one.code, one.about): one for one in lasting(made.notices)} | self.notices
            for name, one in self.asked.items():
                try:
                    found.append(extremes_of(made, name, one, self.watched[name], len(points)))
                except NeverPassedError:
                    if required:
                        raise
                    found.append(none)
        self.made += len(points)
        if self.report is not None:
            self.report(self.made, max(self.expected, self.made))
        return found

    def _each(self, extremes: list[Array]) -> list[Array]:
        """By how much each quantity is beyond its limits, below 0 inside, infinite without a value."""
        found = []
        for one, (lowest, highest) in zip(self.watched.values(), extremes, strict=True):
            beyond = np.maximum(one.limits[0] - lowest, highest - one.limits[1])
            found.append(np.where(np.isnan(beyond), np.inf, beyond))
        return found

    def _badness(self, extremes: list[Array]) -> Array:
        """The worst of them, each over its spread if there are several."""
        return np.asarray(np.max(self._each(extremes) / self._scales[:, None], axis=0))

    def told(self, found: Split) -> tuple[Notice, ...]:
        """What is to be said of the runs."""
        more = []
        without = float(np.mean(np.isinf(found.badness))) if len(found.badness) else 0.0
        if without > _MANY_FAILED:
            text = f"{100.0 * without:.0f} % of the last mechanisms have no value: "
            text += "what is rare is that a run fails"
            more.append(Notice("rare_failures", text, numbers={"share": without}))
        if any(one.reason == TIME_LIMIT for one in self.failed):
            text = "runs that took longer than run_seconds count as outside: the share depends on the machine"
            more.append(Notice("machine", text))
        margins = np.abs(found.badness[np.isfinite(found.badness)])
        if self.watching.settings is not None and len(margins):
            rtol = self.watching.settings.run_rtol
            limits = [
                max(abs(end) for end in one.limits if math.isfinite(end)) for one in self.watched.values()
            ]
            if float(np.median(margins)) < rtol * float(np.max(np.divide(limits, self._scales))):
                text = "the last mechanisms are nearer to the limits than the tolerance of their runs: "
                text += "take a smaller rtol"
                more.append(Notice("within_tolerance", text, numbers={"rtol": rtol}))
        return (*self.notices.values(), *failure_notices(self.failed, self.made), *more)


def _spread(badness: Array) -> float:
    """Standard deviation of a quantity; 1 if it has none."""
    deviation = float(np.std(badness[np.isfinite(badness)])) if np.isfinite(badness).any() else 0.0
    return deviation if deviation > 0.0 else 1.0


def _rounds(factor: float, at_once: int | None) -> Rounds:
    """Particles for an upper end that is so many times a typical share."""
    rest = 1.0 - 1.0 / _DRAWS_OVER_KEPT - math.log(_DRAWS_OVER_KEPT * _TYPICAL)
    kept = rest * (_HALF_WIDTH / math.log(factor)) ** 2
    systems = Rounds().systems
    particles = max(_LEAST_PARTICLES, _STEP * math.ceil(kept / systems / _STEP))
    moved = particles // 10 if at_once is None else at_once // systems
    return Rounds(particles=particles, moved=min(max(1, moved), particles // 2))


def _checked_watching(
    checks: Checks, runner: Runner, asked: Mapping[str, Specification]
) -> tuple[Runner, dict[str, Watched]]:
    """What `watching_for` returns, after raising all problems; runs are reported together and end by
    themselves."""
    found = WatchedRuns.checked(checks, runner, asked)
    store = found.runner.execution.store
    execution = replace(
        found.runner.execution, max_seconds=None, store=None if store is None else SeenFolder(store)
    )
    return replace(found.runner, execution=execution, progress=None), found.watched


def _along(
    runner: Runner,
    checks: Checks,
    asked: Mapping[str, Specification],
    along: StudyResult,
    runs: int | None,
    draws: int,
    confidence: float,
    seed: int,
) -> RareShare:
    """The answer by runs where a polynomial is near the limits."""
    count = 1000 if runs is None else checks.whole("runs", runs, least=2, most=MOST_RUNS)
    if any(isinstance(one, Interval) for one in runner.parameters.values()):
        checks.add("study", "must have a distribution for every parameter with along")
    if set(along.parameter_names) != set(runner.parameters):
        checks.add("along", f"has other parameters than the study: {', '.join(along.parameter_names)}")
    if len(asked) > 1:
        checks.add("specification", f"must be one with along, got {len(asked)}")
    watching, watched = _checked_watching(checks, runner, asked)
    (name, one), *_ = asked.items()
    found = near_limits(watching, name, one, watched[name], along, count, draws, confidence, seed)
    return RareShare(
        specifications=dict(asked),
        verdict="known",
        reason="polynomial",
        share=found.share,
        lower=found.lower,
        upper=found.upper,
        confidence=confidence,
        runs=found.near + found.others,
        seed=seed,
        plain=None,
        systems=SplittingSystems(*np.empty((3, 0))),
        inflation=math.nan,
        mechanisms=np.empty((0, len(runner.parameters))),
        parameter_names=tuple(runner.parameters),
        causes=(),
        at=({},),
        intervals=np.array([(found.lower, found.upper)]),
        has_play=False,
        polynomial=found,
    )
