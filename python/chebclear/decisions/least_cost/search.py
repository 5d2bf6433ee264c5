"""The search of `allocate`: models around tolerances, the cheapest ones by them, and fresh runs of these."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import astuple, dataclass, replace
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.random import Generator, default_rng

from ...base.arguments import Checks
from ...base.rows import Array
from ...base.tables import format_ends
from ...errors import ArgumentError
from ...scene.distributions import Distribution, Uniform
from ...scene.scene import Interval
from ...study.band.exact import binomial_cdf, exact_interval
from ...study.conforming import placed, requested, shares_at
from ...study.polynomials.points import uniform_points
from ...study.requirements.conformance import Conformance
from ...study.requirements.draws import MOST_INTERVALS, drawn, places
from ...study.runner import Runner
from ...study.sources.finished import FinishedRuns
from ...study.sources.scenes import MOST_RUNS
from ...study.spec import declared_order
from .. import rare
from ..rare_result import RareShare
from ..watched_runs import WatchedRuns, check_all_are_made
from .costs import Price, prices_of
from .excess import Exceeded, ExcessModel, Keeps, cheapest, cheapest_of, cost_slopes, total

LOOKS = 3
"""Designs found that are verified, each by fresh runs and at half of the risk of the one before; at the risk
that is left, the tolerances of the study are, where no cheaper ones were found."""
RARE = 1e-3
"""Share outside below which `rare_share` verifies designs, as counting would take too many runs [-]."""
# The factor of these, and the deviation of the logarithm of a share by it [-].
_FACTOR = 1.5
_DEVIATION = math.log(_FACTOR) / NormalDist().inv_cdf(0.975)
# Least part of the deviation of a quantity by which a design that such runs do not prove is corrected, and
# how many times the wanted share may be what they say.
_LEAST_MISSING, _MOST_RATIO = 1e-6, 1e3
# Probability that the runs prove a design whose share outside is the one aimed at.
_POWER = 0.9
# Least and most runs for a model, between them a quarter of those that verify.
_MODEL_RUNS = (200, 1000)
# Times that tolerances may change by within the reach of a model; models for a design.
_TRUST, _MODELS = 3.0, 6
# Change of tolerances up to which a model made with the earlier ones is that of the later ones too.
_SETTLED = 0.05
# Draws for the share outside of a model: so many, or as many as have so many outside, and the most.
_DRAWS, _DRAWS_OUTSIDE, _MOST_DRAWS = 20_000, 50, 200_000
# Where the share is too rare to be counted in draws either.
_RARE_DRAWS = 100_000
# Part of the deviation of a quantity within which a limit binds, and of a tolerance that is at its end.
_BINDS = 1e-4


class Found(NamedTuple):
    """A design and the fresh runs that verify it."""

    design: Array
    """Tolerances of the parameters that have a cost."""
    keeps: bool
    """Whether it keeps the limits by the model."""
    model: ExcessModel
    """The model by which it is the cheapest; if it does not keep the limits, the tightest."""
    outside: float
    """Share outside that the model leaves [-]."""
    offset: float
    """What earlier runs exceeded earlier models by, in deviations of the quantities."""
    verified: Conformance
    """Shares of fresh runs."""
    missing: float
    """What the limits must be widened by for these to prove the share; below 0 if they do."""
    rare: RareShare | None = None
    """The share outside, where it is too rare to be counted."""


@dataclass(eq=False)
class Search:
    """What `allocate` looks for, and the runs that it made."""

    runner: Runner
    """The study, with the tolerances before."""
    prices: dict[str, Price]
    """What tolerances cost."""
    share: float
    """Share of the mechanisms that is to keep to all requirements [-]; 1 without distributions."""
    count: int
    """Runs that verify a design [-]."""
    confidence: float
    """Of all that is proven together [-]."""
    seed: int
    """Seed of all runs."""
    runs: WatchedRuns
    """All that it makes, for the requirements."""

    def __post_init__(self) -> None:
        self._order = declared_order(self.runner.build, self.runner.parameters)
        self.costed = [list(self.runner.parameters).index(name) for name in self.prices]
        sides = self.runner.intervals.values()
        self._nominal, self._every = np.array([(side.nominal, side.half_width) for side in sides]).T
        self.low, self.high = np.array([(price.low, price.high) for price in self.prices.values()]).T
        self._scales = np.empty(0)

    @property
    def before(self) -> Array:
        """Tolerances of the study that have a cost."""
        return np.asarray(self._every[self.costed])

    @property
    def is_rare(self) -> bool:
        """Whether the share that may be outside is too rare to be counted."""
        return not self.is_worst_case and 1.0 - self.share < RARE

    @property
    def is_worst_case(self) -> bool:
        """Whether all mechanisms must keep to the requirements: no parameter has a distribution."""
        return not self.runner.random

    def parameters(self, design: Array) -> dict[str, Interval | Distribution]:
        """All parameters with these tolerances."""
        factors = dict(zip(self.prices, (design / self.before).tolist(), strict=True))
        return {
            name: _scaled(one, factors[name]) if name in factors else one
            for name, one in self.runner.parameters.items()
        }

    def found(self) -> Found:
        """The cheapest design that fresh runs prove, or else the last one.

        Runs and model agree at the end: that the design keeps the limits, or that none does. Where they do
        not, the model is corrected by what the runs exceeded it by. A model may miss what the runs keep to,
        so that the tolerances of the study are a design too.
        """
        design, offset = self.before, 0.0
        proven: Found | None = None
        for look in range(LOOKS):
            level, allowed, outside = self.aim(look)
            design, keeps, model = self.settled(design, outside, offset)
            last = self._looked(
                Found(design, keeps, model, outside, offset, *self.verified(design, level, allowed))
            )
            if last.missing < 0.0 and (proven is None or self.spent(design) < self.spent(proven.design)):
                proven = last
            if keeps == (last.missing < 0.0):
                break
            offset += last.missing
        best, own = proven or last, self.before
        # Without a design that is proven any other one is better, whatever it costs.
        if self._is_open(own) and (proven is None or self.spent(own) <= self.spent(proven.design)):
            level, allowed, outside = self.aim(LOOKS)
            found = Found(own, True, best.model, outside, offset, *self.verified(own, level, allowed))
            if self._looked(found).missing < 0.0:
                return self._looked(found)
        return best

    def _looked(self, found: Found) -> Found:
        """What is missing where rare shares verify: by the model, from the share that they say at most."""
        if found.rare is None:
            return found
        wanted = 1.0 - self.share
        ratio = wanted / max(found.rare.upper, wanted / _MOST_RATIO)
        levels = [
            float(self._exceeded(found.model, share, 0.0)(found.design).values.max())
            for share in (found.outside * max(ratio, 1.0 / _MOST_RATIO), found.outside)
        ]
        missing = max(abs(levels[0] - levels[1]), _LEAST_MISSING)
        return found._replace(missing=-missing if ratio > 1.0 else missing)

    def _is_open(self, design: Array) -> bool:
        """Whether costs are known for these tolerances: in a catalog, those that stand in it."""
        among = [
            not len(price.choices) or bool(np.isclose(price.choices, one, rtol=_BINDS).any())
            for price, one in zip(self.prices.values(), design, strict=True)
        ]
        return all(among) and bool(np.all((design >= self.low) & (design <= self.high)))

    def spent(self, design: Array) -> float:
        """What tolerances cost; infinite where a catalog has nothing as tight."""
        cost = total([price.at for price in self.prices.values()], design)
        return cost if math.isfinite(cost) else math.inf

    def aim(self, look: int) -> tuple[float, int, float]:
        """Confidence of a look, the most runs outside that still prove the share, and the share to aim at."""
        level = 1.0 - (1.0 - self.confidence) / 2.0 ** (look + 1)
        if self.is_worst_case:
            return level, 0, 0.0
        if self.is_rare:
            normal = NormalDist()
            reach = normal.inv_cdf(0.5 + 0.5 * level) + normal.inv_cdf(_POWER)
            return level, 0, (1.0 - self.share) * math.exp(-reach * _DEVIATION)
        allowed = most_outside(self.count, 1.0 - self.share, level)
        # The share outside with which no more than that are so with the power.
        return level, allowed, exact_interval(allowed + 1, self.count, 2.0 * _POWER - 1.0)[0]

    def settled(self, design: Array, outside: float, offset: float) -> tuple[Array, bool, ExcessModel]:
        """The cheapest design by a model around itself, whether it keeps the limits, and the model."""
        for _ in range(_MODELS):
            model = self._model(design, outside)
            new, keeps = self._cheapest(model, design, outside, offset)
            change = float(np.max(np.abs(np.log(new / design))))
            design = new
            if change <= _SETTLED:
                break
        return design, keeps, model

    def verified(
        self, design: Array, level: float, allowed: int
    ) -> tuple[Conformance, float, RareShare | None]:
        """Shares of fresh runs, by what these prove the share if it is below 0, else what is missing, and the
        share outside where it is too rare to be counted."""
        parameters, seed = self.parameters(design), self._fresh_seed()
        at, among = places(parameters, 0, 0), parameters
        extra: list[Array] = []
        if self.is_worst_case:
            extra = [np.array([list(place.values()) for place in at])]
            among = {name: Uniform(side.lower, side.upper) for name, side in _intervals(parameters).items()}
            at = [{}]
        runner = replace(self.runner, parameters=among)
        draws = drawn(among, self._order, self.count, seed)
        points = [placed(runner, draws, place) for place in at]
        extremes = [self.runs.extremes(one) for one in points]
        shares = shares_at(self.runs.asked, self.runs.watched, at, extremes, level, None)
        found = Conformance(shares, points[0], tuple(parameters), seed, tuple(self.runs.notices.values()))
        missing = [np.sort(self.runs.excess(one, self._scales).max(axis=1))[-1 - allowed] for one in extremes]
        missing += [self.runs.excess(self.runs.extremes(one), self._scales).max() for one in extra]
        outside = None
        if self.is_rare:
            own = replace(self.runner, parameters=parameters)
            outside = rare.share_of(own, self.runs.asked, level, self._fresh_seed(), self.count, _FACTOR)
            self.runs.made += outside.runs
        return found, float(max(missing)), outside

    def saving(self, best: Found) -> dict[str, float]:
        """What the cost falls by for each requirement whose limits are widened, to both sides."""
        design, exceeded = best.design, self._exceeded(best.model, best.outside, best.offset)
        found = exceeded(design)
        widest = found.values.max()
        by_limit = np.zeros(len(self.runs.limits))
        prices = list(self.prices.values())
        if self._has_steps:
            most = 0.0
            for index, price in enumerate(prices):
                wider = price.choices[price.choices > design[index] * (1.0 + _BINDS)]
                if len(wider):
                    then = exceeded(np.where(np.arange(len(design)) == index, wider[0], design))
                    gain = price.at(float(design[index])) - price.at(float(wider[0]))
                    needed = float(then.values.max())
                    if needed > 0.0 and gain / needed > most:
                        most = gain / needed
                        by_limit = most * then.parts[then.values.argmax()]
        elif widest > -_BINDS:
            active = found.values >= widest - _BINDS
            is_free = (design > self.low * (1.0 + _BINDS)) & (design < self.high * (1.0 - _BINDS))
            slopes = cost_slopes([price.at for price in prices], design)
            forces = np.linalg.lstsq(found.slopes[active][:, is_free].T, -slopes[is_free], rcond=None)[0]
            by_limit = np.maximum(forces, 0.0) @ found.parts[active]
        by_limit = by_limit / self._scales
        names = np.array([name for name, _ in self.runs.limits])
        return {name: float(by_limit[names == name].sum()) for name in self.runs.asked}

    @property
    def _has_steps(self) -> bool:
        return any(len(price.choices) for price in self.prices.values())

    def _fresh_seed(self) -> int:
        return int(default_rng([self.seed, self.runs.made]).integers(2**63))

    def _model(self, design: Array, outside: float) -> ExcessModel:
        """The model of runs spread evenly over the tolerances."""
        parameters, seed = self.parameters(design), self._fresh_seed()
        sides = _intervals(parameters)
        count = model_runs(self.count, len(sides))
        points = replace(self.runner, parameters=sides).drawn(lambda box: uniform_points(box, count, seed))
        extremes = self.runs.extremes(points)
        if not len(self._scales):
            self._scales = self._checked_scales(extremes)
        excess = self.runs.excess(extremes, self._scales)
        kept = np.isfinite(excess).all(axis=1)
        draws = np.full((int(kept.sum()), len(sides)), np.nan)
        if not self.is_worst_case:
            count = int(np.clip(_DRAWS_OUTSIDE / outside, _DRAWS, _MOST_DRAWS))
            if self.is_rare:
                count = _RARE_DRAWS
            draws = drawn(self.runner.parameters, self._order, count, self.seed)
            draws = (draws - self._nominal) / self._every
        ends = [
            [place[name] if name in place else np.nan for name in sides]
            for place in places(self.runner.parameters, 0, 0)
        ]
        all_normal = all(one.is_normal for one in self.runner.random.values())
        ends = (np.array(ends) - self._nominal) / self._every
        return ExcessModel.fitted(list(sides.values()), points[kept], excess[kept], draws, ends, all_normal)

    def _exceeded(self, model: ExcessModel, outside: float, offset: float) -> Keeps:
        """What the limits must be widened by, as a function of the tolerances that have a cost."""

        def exceeded(design: Array) -> Exceeded:
            tolerances = self._every.copy()
            tolerances[self.costed] = design
            found = model.exceeded(tolerances, outside)
            return Exceeded(found.values + offset, found.slopes[:, self.costed], found.parts)

        return exceeded

    def _cheapest(
        self, model: ExcessModel, design: Array, outside: float, offset: float
    ) -> tuple[Array, bool]:
        """The cheapest design within the reach of a model, and whether it keeps the limits by that."""
        exceeded = self._exceeded(model, outside, offset)
        prices = list(self.prices.values())
        costs = [price.at for price in prices]
        low, high = np.maximum(self.low, design / _TRUST), np.minimum(self.high, design * _TRUST)
        if not self._has_steps:
            found = cheapest(exceeded, costs, design, (low, high), model.precision)
            return (low, False) if found is None else (found, True)
        choices = []
        for index, price in enumerate(prices):
            # The next ones beyond are tried too: a catalog may have gaps.
            first, last = np.searchsorted(price.choices, (low[index], high[index]))
            choices.append(price.choices[max(0, int(first) - 1) : int(last) + 1])
        spent = [
            np.array([cost(float(one)) for one in own]) for cost, own in zip(costs, choices, strict=True)
        ]
        chosen = cheapest_of(exceeded, choices, spent) or (0,) * len(choices)
        found = np.array([own[choice] for own, choice in zip(choices, chosen, strict=True)])
        return found, bool(exceeded(found).values.max() <= 0.0)

    def _checked_scales(self, extremes: list[Array]) -> Array:
        """The deviation of each limited quantity in runs; refuses requirements that none of them keeps to."""
        checks = Checks()
        by_name = dict(zip(self.runs.asked, extremes, strict=True))
        for name, (lowest, highest) in by_name.items():
            if self.runs.watched[name].is_outside(by_name[name]).all():
                ends = format_ends(float(np.nanmin(lowest)), float(np.nanmax(highest)))
                checks.add(
                    f'specifications["{name}"]',
                    f"is never met: none of {len(lowest)} mechanisms keeps to it; values are from {ends}",
                )
        checks.finish()
        return self.runs.deviations(extremes)


def model_runs(count: int, sides: int) -> int:
    """Runs of a model, where so many verify a design."""
    return max(3 * sides, int(np.clip(count // 4, *_MODEL_RUNS)))


def expected_runs(runner: Runner, runs: int, share: float) -> int:
    """Runs of a search that ends at its first look: two models, the second around the first's design, and
    those that verify it. Each model and each look more adds its own."""
    each = runs + (rare.expected_runs(runs, _FACTOR) if runner.random and 1.0 - share < RARE else 0)
    return 2 * model_runs(runs, len(runner.intervals)) + each * len(places(runner.parameters, 0, 0))


def checked_search(
    runner: Runner,
    cost: object,
    specifications: object,
    share: float,
    runs: int,
    confidence: float,
    rng: int | Generator | None,
) -> Search:
    """The search with the arguments of `allocate`, checked."""
    checks = Checks()
    if isinstance(runner.model, FinishedRuns):
        raise ArgumentError("study is a table of finished runs, which has no values with other tolerances")
    asked = requested(checks, runner, specifications)
    wanted = checks.real("share", share, "-", above=0.0, below=1.0)
    count = checks.whole("runs", runs, least=2, most=MOST_RUNS)
    level = checks.real("confidence", confidence, "-", above=0.0, below=1.0)
    seed = checks.seed("rng", rng)
    prices = prices_of(checks, runner, cost)
    check_all_are_made(checks, runner)
    only = [name for name, one in runner.parameters.items() if isinstance(one, Interval)]
    if len(only) > MOST_INTERVALS:
        checks.add(
            "parameters",
            f"must have at most {MOST_INTERVALS} only known as intervals, whose corners are all tried, "
            f"got {len(only)}: give the others a distribution",
        )
    is_rare = bool(runner.random) and 1.0 - wanted < RARE
    if is_rare and len(only) > rare.MOST_INTERVALS:
        checks.add(
            "parameters",
            f"must have at most {rare.MOST_INTERVALS} only known as intervals where less than {RARE:g} may "
            f"be outside, got {len(only)}: each corner takes a splitting of its own",
        )
    if runner.random and not is_rare and not any(map(checks.noted, ("share", "runs", "confidence"))):
        # None outside, at the last look.
        least = math.ceil(math.log((1.0 - level) / 2.0 ** (LOOKS + 1)) / math.log(wanted))
        if count < least:
            checks.add("runs", f"must be at least {least} to prove a share of {wanted:g}, got {count}")
    watched = WatchedRuns.checked(checks, runner, asked)
    aimed = wanted if runner.random else 1.0
    return Search(runner, prices, aimed, count, level, seed, watched)


def most_outside(trials: int, outside: float, confidence: float) -> int:
    """The most of so many trials that may be outside and still prove that no larger share is."""
    risk = 0.5 * (1.0 - confidence)
    return bisect_left(range(trials), True, key=lambda found: binomial_cdf(found, trials, outside) > risk) - 1


def _intervals(parameters: Mapping[str, Interval | Distribution]) -> dict[str, Interval]:
    return {name: one if isinstance(one, Interval) else one.interval for name, one in parameters.items()}


def _scaled(one: Interval | Distribution, factor: float) -> Interval | Distribution:
    """A parameter whose distances from its nominal value are multiplied."""
    if isinstance(one, Distribution):
        return one.scaled(factor)
    return Interval(*(one.nominal + factor * (value - one.nominal) for value in astuple(one)))
