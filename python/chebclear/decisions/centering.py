"""Nominal values moved at no cost, so that more mechanisms keep to requirements; see `center`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.random import Generator

from ..base import files as records
from ..base.arguments import Checks
from ..base.named import Named
from ..base.prefixes import Form
from ..base.rows import Array
from ..base.shown import capital, in_a_sentence, listed, meant_or_known
from ..base.tables import format_table
from ..data.dataset import Dataset, facts_of, numbered
from ..data.exports import Exports
from ..errors import ArgumentTypeError
from ..notices import Notice, WithNotices, issue
from ..report import html
from ..report.document import Document, Table
from ..run.report import notices_section, version_fact
from ..scene.distributions import Distribution
from ..scene.scene import Interval
from ..study.band.exact import binomial_cdf, exact_interval
from ..study.conforming import requested
from ..study.requirements.conformance import in_percent
from ..study.requirements.draws import check_drawn
from ..study.requirements.specification import ALL, Specification
from ..study.runner import Runner
from ..study.sources.finished import FinishedRuns
from ..study.sources.scenes import MOST_RUNS
from ..study.study import Study
from .best_center.search import CenterSearch, Verified, moved_to
from .rare import MOST_INTERVALS, rare_share
from .rare_result import RareShare
from .watched_runs import WatchedRuns, check_all_are_made

Status = Literal["better", "unproven", "no better"]
# Least number of pairs [-]: in six that differ one way only, the exact test shows a difference with 95 %.
_LEAST_PAIRS = 6
# Move over the standard deviation below which it is not worth a word [-].
_SLIGHT = 0.01


@dataclass(frozen=True, eq=False, repr=False)
class Move(records.ArrayRecord):
    """The nominal value of a parameter before and after.

    Attributes
    ----------
    name : str
        Name of the parameter.
    unit : str
        SI unit; empty if it is not known.
    before, after : float
        Nominal value: of a normal distribution its mean [SI unit of the parameter].
    deviation : float
        Standard deviation of the parameter, half of what lies between its quantiles of 15.9 and 84.1 %.
    lower, upper : float
        Ends between which it might move.
    end : {"", "lower", "upper"}
        The end of these at which it stopped; empty where it is between them.
    written : tuple[str, ...]
        The unit that the user wrote, in which it is shown.
    """

    name: str
    unit: str
    before: float
    after: float
    deviation: float
    lower: float
    upper: float
    end: str
    written: tuple[str, ...] = ()

    @property
    def distance(self) -> float:
        """How far it moves [SI unit of the parameter]."""
        return self.after - self.before

    def __str__(self) -> str:
        form = Form.of((self.before, self.after, self.lower, self.upper), self.unit, self.written)
        text = f"{self.name}: {form.text(self.before)} to {form.text(self.after)}"
        return f"{text}, the {self.end} end of what it may be" if self.end else text


@dataclass(frozen=True, eq=False, repr=False)
class CenteredShare(records.ArrayRecord):
    """How many mechanisms keep to a requirement before and after, counted in the same draws.

    Attributes
    ----------
    name : str
        Name of the requirement; ``"all"`` for all of several.
    specification : Specification
        The limits.
    pairs : int
        Mechanisms, each simulated with both nominal values; one that fails is outside [-].
    only_before, only_after, both, neither : int
        Those that keep to it only before, only after, with both or with none [-]. One keeps to it if it does
        so at all corners of the parameters that are only intervals.
    confidence : float
        Of the intervals, and of the test [-].
    """

    name: str
    specification: Specification
    pairs: int
    only_before: int
    only_after: int
    both: int
    neither: int
    confidence: float

    @property
    def before(self) -> float:
        """Share in specification before [-]."""
        return (self.both + self.only_before) / self.pairs

    @property
    def after(self) -> float:
        """Share in specification after [-]."""
        return (self.both + self.only_after) / self.pairs

    @property
    def before_between(self) -> tuple[float, float]:
        """Exact interval of the share before `[ClopperPearson1934]` [-]."""
        return exact_interval(self.both + self.only_before, self.pairs, self.confidence)

    @property
    def after_between(self) -> tuple[float, float]:
        """Exact interval of the share after `[ClopperPearson1934]` [-]."""
        return exact_interval(self.both + self.only_after, self.pairs, self.confidence)

    @property
    def p_value(self) -> float:
        """Probability of pairs that differ as much if the shares are the same [-]: McNemar's exact test."""
        fewer, count = min(self.only_before, self.only_after), self.only_before + self.only_after
        return min(1.0, 2.0 * binomial_cdf(fewer, count, 0.5))

    @property
    def better(self) -> Literal["before", "after"] | None:
        """With which nominal values more keep to it; None where the pairs do not show it."""
        if self.p_value > 1.0 - self.confidence:
            return None
        return "after" if self.only_after > self.only_before else "before"

    def __str__(self) -> str:
        first, last = (
            f"{in_percent(share)} ({in_percent(low)} to {in_percent(high)})"
            for share, (low, high) in ((self.before, self.before_between), (self.after, self.after_between))
        )
        return (
            f"{self.name}: {first} in specification before, {last} after; of {self.pairs} pairs "
            f"{self.only_after} keep to it only after, {self.only_before} only before"
        )


@dataclass(frozen=True, eq=False, repr=False)
class Centering(WithNotices, html.Reported, records.Saved, Named[Move], Exports, kind="centering"):
    """Nominal values with which more mechanisms keep to requirements, at the same tolerances; see `center`.

    Attributes
    ----------
    moves : dict[str, Move]
        Those of the parameters that might move.
    status : {"better", "unproven", "no better"}
        ``"better"``: fresh runs show that more mechanisms keep to all requirements. ``"unproven"``: the model
        finds so, and the fresh runs do not contradict it, but are too few to show it. ``"no better"``: the
        model finds no better nominal values, or of the fresh runs that differ no more do so.
    shares : dict[str, CenteredShare]
        Shares of each requirement in fresh runs, and of ``"all"`` together if there are several.
    parameters : dict[str, Interval | Distribution]
        All parameters for `Study`: with the nominal values found; as they were where these are no better.
    rare : tuple[RareShare, RareShare] | None
        What `rare_share` says before and after, if it was asked for; intervals that hold together.
    needed : int
        About how many pairs may show what the model finds, if it is right [-]; 0 where it finds no better.
    settled : bool
        Whether the models ended since the next one found no better; else they moved on each time: go on from
        `parameters`.
    runs : int
        Runs made [-].
    seed : int
        Seed of the draws: ``rng=seed`` repeats them.
    notices : tuple[Notice, ...]
        Warnings of the runs, each kind once.
    """

    moves: dict[str, Move]
    status: Status
    shares: dict[str, CenteredShare]
    parameters: dict[str, Interval | Distribution]
    rare: tuple[RareShare, RareShare] | None
    needed: int
    settled: bool
    runs: int
    seed: int
    notices: tuple[Notice, ...] = ()

    @property
    def _by_name(self) -> Mapping[str, Move]:
        return self.moves

    def dataset(self) -> Dataset:
        """A row for each nominal value, whose unit is in a column of its own; see `Exports`."""
        moves = list(self.moves.values())
        names = ("name", "unit", "before", "after", "deviation", "lower", "upper", "end")
        data = numbered(
            "row", {name: [getattr(one, name) for one in moves] for name in names}, {}, facts_of(self)
        )
        data.facts["status"] = self.status
        return data

    @property
    def share(self) -> CenteredShare:
        """The share that keeps to all requirements."""
        return list(self.shares.values())[-1]

    @property
    def table(self) -> Table:
        """One row for each nominal value."""
        rows = []
        for one in self.moves.values():
            form = Form.of((one.before, one.after, one.lower, one.upper), one.unit, one.written)
            moved = Form.of((one.distance,), one.unit, one.written).text(one.distance)
            ends = form.range(one.lower, one.upper)
            rows.append([one.name, form.text(one.before), form.text(one.after), moved, ends, one.end or "-"])
        head = ["nominal value", "before", "after", "moved by", "may be", "at the end"]
        return Table("Nominal values", head, rows)

    @property
    def shares_table(self) -> Table:
        """One row for each requirement."""
        rows = []
        for one in self.shares.values():
            cells = [
                f"{in_percent(share)} ({in_percent(low)} to {in_percent(high)})"
                for share, (low, high) in ((one.before, one.before_between), (one.after, one.after_between))
            ]
            rows.append([one.name, *cells, str(one.only_after), str(one.only_before), f"{one.p_value:.2g}"])
        head = ["requirement", "before", "after", "only after", "only before", "p-value"]
        return Table("Shares in specification, of the same mechanisms", head, rows)

    @property
    def _found(self) -> str:
        """What was found, in words."""
        if self.status == "no better":
            return "no better: fresh runs do not show nominal values with which more keep to the requirements"
        if self.status == "unproven":
            return (
                "unproven: a model finds better nominal values, the fresh runs are too few to show it; ask "
                f"for about {self.needed} runs, or for rare=True"
            )
        moved = [
            f"{one.name} by {Form.of((one.distance,), one.unit, one.written).text(one.distance)}"
            for one in self.moves.values()
            if abs(one.distance) > _SLIGHT * one.deviation
        ]
        if self.rare is not None:
            return f"better: moving {in_a_sentence(moved)}, at no cost, leaves fewer outside"
        one, fewer = self.share, "leaves none of the fresh runs outside"
        if outside := one.pairs - one.both - one.only_after:
            before = one.pairs - one.both - one.only_before
            fewer = f"puts {before / outside:.2g} times fewer mechanisms outside"
        return f"better: moving {in_a_sentence(moved)}, at no cost, {fewer}"

    def _doubts(self) -> list[str]:
        """What limits the answer."""
        ends = [f"{one.name} at its {one.end} end" for one in self.moves.values() if one.end]
        found = [f"what may move ends the search: {in_a_sentence(ends)}"] if ends else []
        if not self.settled:
            found.append("the nominal values still moved with each model: go on from those found")
        return found

    def __repr__(self) -> str:
        return f"<Centering: {self.status}, {listed(self._names, most=4)}>"

    def __str__(self) -> str:
        rows = [[str(cell) for cell in row] for row in self.table.rows]
        text = [self._found, format_table(self.table.head, rows), *map(str, self.shares.values())]
        return "\n".join([*text, *self._rare(), *self._doubts()])

    def _rare(self) -> list[str]:
        """What splitting says of both, in words."""
        if self.rare is None:
            return []
        return [f"{when}: {one}" for when, one in zip(("before", "after"), self.rare, strict=True)]

    def _document(self, title: str | None) -> Document:
        found = f"{capital(self._found)}."
        return Document(
            title=title or "Do other nominal values keep more mechanisms in specification?",
            facts=[f"{self.runs} runs", version_fact()],
            answer=[found, *(f"{one}." for one in self.shares.values()), *self._rare()],
            doubts=[
                *([found] if self.status == "unproven" else []),
                *(f"{capital(one)}." for one in self._doubts()),
            ],
            first=[self.table, self.shares_table],
            sections=notices_section(self.notices),
        )

    def _repr_html_(self) -> str:
        return html.fragment(self._found, [self.table, self.shares_table])


def center(
    study: Study,
    specifications: Specification | Sequence[Specification] | Mapping[str, Specification] | None = None,
    *,
    move: Mapping[str, Interval],
    runs: int = 2000,
    rare: bool = False,
    confidence: float = 0.95,
    rng: int | Generator | None = 0,
) -> Centering:
    """Nominal values with which more mechanisms keep to specifications, at the same tolerances.

    A polynomial of what runs exceed the limits by is fitted around the present nominal values. These move to
    where the share outside is least by it, by no more than one standard deviation in root sum of squares, and
    a new polynomial is fitted there, until the gain is below its error. The shares before and after are then
    counted in fresh runs of the same mechanisms, never in those that chose the nominal values. That they are
    no better is an answer.

    Parameters
    ----------
    study : Study
        The mechanism, or a model of your own.
    specifications : Specification, or sequence or mapping of them by name, optional
        What to keep to, made by `require`; the requirements of the study if not given.
    move : mapping of str to Interval
        The nominal values that may change, with the ends between which they may: those of which drawings and
        tools can be changed. They are of parameters with a distribution, which moves with them.
    runs : int
        Pairs of mechanisms that verify what was found [-], besides a quarter as many for each polynomial.
    rare : bool
        Whether `rare_share` of both nominal values shows which is better, where too few are outside to be
        counted; it takes tens of thousands of runs of each.
    confidence : float
        Of the intervals, and of the exact test of McNemar that shows which is better [-].
    rng : int, numpy.random.Generator or None
        Seed or generator of the draws; None for fresh ones. The seed is kept with the result.

    Returns
    -------
    Centering

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; all problems are listed.
    SceneError, SimulationError
        As `Study.sample`. A mechanism that fails counts as outside.

    Examples
    --------
    >>> import chebclear as cc
    >>> def stack(plate, spacer):
    ...     return {"gap": 50.4 - plate - 2 * spacer}
    >>> study = cc.Study(stack, {"plate": cc.normal(30.0, 0.03), "spacer": cc.normal(10.0, 0.02)})
    >>> found = cc.center(
    ...     study, cc.require("gap", above=0.4, below=0.6), move={"plate": cc.Interval(29.5, 30.5)}
    ... )
    >>> found.status, round(found["plate"].after, 2)
    ('better', 29.9)
    """
    if not isinstance(study, Study):
        raise ArgumentTypeError(f"study must be a Study, got {study!r:.80}")
    search = _checked_search(study.runner, specifications, move, runs, rare, confidence, rng)
    centers, settled = search.found()
    verified = search.verified(centers)
    shares = _shares(verified, search, search.confidence)
    moves_at_all = not np.array_equal(centers, search.before)
    both = _rare_shares(study, search, centers) if rare and moves_at_all else None
    status = _status(list(shares.values())[-1], both) if moves_at_all else "no better"
    notices = tuple(search.runs.notices.values())
    issue(notices)
    moves = {}
    for name, one, before, after in zip(search.names, search.ends, search.before, centers, strict=True):
        end = "lower" if after <= one[0] else "upper" if after >= one[1] else ""
        deviation, written = search.deviations[name], study.runner.written_for(name)
        unit = study.runner.units.get(name, "")
        moves[name] = Move(name, unit, float(before), float(after), deviation, *one, end, written)
    return Centering(
        moves=moves,
        status=status,
        shares=shares,
        parameters=search.parameters(search.before if status == "no better" else centers),
        rare=both,
        needed=search.needed,
        settled=settled,
        runs=search.runs.made + sum(one.runs for one in both or ()),
        seed=search.seed,
        notices=notices,
    )


def _status(share: CenteredShare, rare: tuple[RareShare, RareShare] | None) -> Status:
    """What fresh runs say of nominal values that a model finds better."""
    if rare is not None:
        before, after = rare
        return "better" if before.lower > after.upper else "unproven"
    if share.better == "after":
        return "better"
    return "no better" if share.only_before >= max(share.only_after, 1) else "unproven"


def _rare_shares(study: Study, search: CenterSearch, centers: Array) -> tuple[RareShare, RareShare]:
    """The shares outside before and after by splitting; either may be wrong with half of the risk."""
    level, seed = 0.5 * (1.0 + search.confidence), search.fresh_seed
    moved = copy(study)
    moved.runner = replace(study.runner, parameters=search.parameters(centers))
    before, after = (rare_share(one, search.runs.asked, confidence=level, rng=seed) for one in (study, moved))
    return before, after


def _shares(verified: Verified, search: CenterSearch, confidence: float) -> dict[str, CenteredShare]:
    """Shares of each requirement, and of all together if there are several."""
    before, after = (dict(zip(search.runs.asked, own, strict=True)) for own in verified)
    asked = dict(search.runs.asked)
    if len(asked) > 1:
        before[ALL], after[ALL] = (np.any(own, axis=0) for own in verified)
        asked[ALL] = Specification("specifications broken", below=1)
    shares = {}
    for name, one in asked.items():
        first, last = before[name], after[name]
        shares[name] = CenteredShare(
            name=name,
            specification=one,
            pairs=len(first),
            only_before=int(np.sum(~first & last)),
            only_after=int(np.sum(first & ~last)),
            both=int(np.sum(~first & ~last)),
            neither=int(np.sum(first & last)),
            confidence=confidence,
        )
    return shares


def _checked_search(
    runner: Runner,
    specifications: object,
    move: object,
    runs: int,
    rare: object,
    confidence: float,
    rng: int | Generator | None,
) -> CenterSearch:
    """The search with the arguments of `center`, checked."""
    checks = Checks()
    if isinstance(runner.model, FinishedRuns):
        checks.add("study", "is a table of finished runs, which has no values at other nominal values")
    asked = requested(checks, runner, specifications)
    if not isinstance(move, Mapping) or not move:
        checks.add(
            "move",
            "must map parameters to the intervals in which their nominal values may be, such as "
            f'{{"rod_length": cc.Interval("119 mm", "121 mm")}}, got {move!r:.80}',
            wrong_type=not isinstance(move, Mapping),
        )
    ends = {}
    for name, side in move.items() if isinstance(move, Mapping) else ():
        if _check_move(checks, runner, name, side):
            ends[name] = (side.lower, side.upper)
    count = checks.whole("runs", runs, least=_LEAST_PAIRS, most=MOST_RUNS)
    level = checks.real("confidence", confidence, "-", above=0.0, below=1.0)
    seed = checks.seed("rng", rng)
    if not isinstance(rare, bool):
        checks.add("rare", f"must be True or False, got {rare!r}", wrong_type=True)
    elif rare:
        sides = len(runner.parameters) - len(runner.random)
        if sides > MOST_INTERVALS:
            checks.add("rare", f"takes at most {MOST_INTERVALS} parameters that are intervals, got {sides}")
    check_drawn(checks, runner.parameters)
    check_all_are_made(checks, runner)
    return CenterSearch(runner, ends, count, level, seed, WatchedRuns.checked(checks, runner, asked))


def _check_move(checks: Checks, runner: Runner, name: object, side: object) -> bool:
    """Note what is wrong with the interval of a nominal value; whether nothing is."""
    place, one = f'move["{name}"]', runner.parameters.get(name) if isinstance(name, str) else None
    if one is None:
        checks.add(place, f"unknown parameter{meant_or_known(name, runner.parameters)}")
        return False
    if not isinstance(one, Distribution):
        checks.add(place, "is only known as an interval, whose corners are all tried: give it a distribution")
        return False
    if not isinstance(side, Interval):
        checks.add(
            place,
            f"must be the interval in which the nominal value may be, made by cc.Interval, got {side!r:.80}",
            wrong_type=True,
        )
        return False
    nominal = one.interval.nominal
    if not side.lower <= nominal <= side.upper:
        checks.add(
            place, f"must hold the present nominal value {nominal:g}, got {side.lower:g} to {side.upper:g}"
        )
        return False
    try:
        ends = [moved_to(one, end).interval for end in side]
        sound = all(math.isfinite(end.lower) and math.isfinite(end.upper) for end in ends)
    except ValueError:  # as of a lognormal distribution at 0
        sound = False
    if not sound:
        checks.add(place, f"{type(one).__name__.lower()} values cannot have all these nominal values")
    return sound
