"""The search of `center`: models around nominal values, the best ones by them, and fresh runs of these."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.random import default_rng
from numpy.typing import NDArray

from ...base.rows import Array
from ...scene.distributions import Distribution
from ...scene.scene import Interval
from ...study.conforming import placed
from ...study.polynomials.points import uniform_points
from ...study.requirements.draws import places
from ...study.runner import Runner
from ...study.spec import declared_order
from ..least_cost.excess import ExcessModel
from ..least_cost.search import model_runs
from ..watched_runs import WatchedRuns
from .model import CenterModel, least

# Models on the way; nominal values move by no more than so many standard deviations with each.
_MODELS, _TRUST = 12, 1.0
# Half of the box of a model, in standard normal scores of each parameter.
_REACH = 3.5
# Lines on which a model finds the share outside [-].
_LINES = 200
# Part of the share outside below which a gain does not matter [-]; times its error below which it is none.
_SETTLED, _ERRORS = 0.01, 2.0
# Share outside from which it is not this that is made least, but what is exceeded in the mean [-].
_MOST_OUTSIDE = 0.5
# Probability with which as many pairs as are said to be needed show what the model finds [-].
_POWER = 0.9
# Pairs that differ one way only, at least, for a test to show it with 95 % [-]; two more for its power.
_LEAST_DIFFERING = 8
# Repetitions that find the distance of a distribution whose nominal value is not moved by the same.
_REPETITIONS = 60


class Verified(NamedTuple):
    """Which fresh runs are outside of each requirement."""

    before: list[NDArray[np.bool_]]
    after: list[NDArray[np.bool_]]


@dataclass(eq=False)
class CenterSearch:
    """What `center` looks for, and the runs that it made."""

    runner: Runner
    """The study, with the nominal values before."""
    limits: dict[str, tuple[float, float]]
    """Ends of the nominal values that may move."""
    count: int
    """Pairs that verify."""
    confidence: float
    seed: int
    """Seed of all runs."""
    runs: WatchedRuns
    """All that it makes, for the requirements."""
    needed: int = 0
    """Pairs that may show what the models find [-]; 0 where they find nothing."""

    def __post_init__(self) -> None:
        self._order = declared_order(self.runner.build, self.runner.parameters)
        self._places = places(self.runner.parameters, 0, 0)
        self._scales = np.empty(0)

    @property
    def names(self) -> list[str]:
        """The parameters that may move."""
        return list(self.limits)

    @property
    def ends(self) -> list[tuple[float, float]]:
        """Ends of their nominal values."""
        return list(self.limits.values())

    @cached_property
    def before(self) -> Array:
        """Their nominal values in the study."""
        return np.array([self.runner.random[name].interval.nominal for name in self.names])

    @cached_property
    def deviations(self) -> dict[str, float]:
        """Their standard deviations, by the quantiles of the scores -1 and 1."""
        ends = np.array([-1.0, 1.0])
        return {name: float(np.ptp(self.runner.random[name].at(ends))) / 2.0 for name in self.names}

    def parameters(self, centers: Array) -> dict[str, Interval | Distribution]:
        """All parameters with these nominal values."""
        return dict(self.runner.parameters) | self._moved(centers)

    def _moved(self, centers: Array) -> dict[str, Distribution]:
        found = {}
        for name, before, after in zip(self.names, self.before, centers, strict=True):
            one = self.runner.random[name]
            found[name] = one if after == before else moved_to(one, float(after))
        return found

    def found(self) -> tuple[Array, bool]:
        """The best nominal values by the models, and whether the last of these found no better ones."""
        centers, shares = self.before, []
        sizes = np.array(list(self.deviations.values()))
        low, high = np.array(self.ends).T
        for number in range(_MODELS):
            model = self._model(centers, number)
            if model is None:
                break
            shares.append(float(np.mean(model.outside({}))))
            new = self._better(model, centers, sizes, low, high)
            if new is None:
                self._set_needed(shares)
                return centers, True
            centers = new
        self._set_needed(shares)
        return centers, False

    def _better(
        self, model: CenterModel, centers: Array, sizes: Array, low: Array, high: Array
    ) -> Array | None:
        """Better nominal values within the reach of a model; None if they are not better by its error."""
        here = model.outside({})
        share = float(np.mean(here))
        counts = share < _MOST_OUTSIDE

        def moved(step: Array) -> dict[str, Distribution]:
            return self._moved(centers + sizes * step)

        def value(step: Array) -> float:
            if counts:
                return math.log(max(float(np.mean(model.outside(moved(step)))), 1e-300))
            return model.mean_excess(moved(step))

        step = least(value, (low - centers) / sizes, (high - centers) / sizes, _TRUST)
        # To the end itself, not to its rounding.
        new = np.clip(centers + sizes * step, low, high)
        new = np.where(np.isclose(new, low, rtol=0.0, atol=1e-9 * sizes), low, new)
        new = np.where(np.isclose(new, high, rtol=0.0, atol=1e-9 * sizes), high, new)
        then, doubt = self._moved(new), model.doubt(self._moved(new))
        if counts:
            gains = here - model.outside(then)
            gain, least_gain = float(np.mean(gains)), _SETTLED * share
            by_doubt = abs(float(np.mean(model.outside({}, doubt))) - share)
            error = math.hypot(float(np.std(gains)) / math.sqrt(len(gains)), by_doubt)
        else:
            gain, least_gain = model.mean_excess({}) - model.mean_excess(then), _SETTLED
            error = doubt
        return new if gain > max(least_gain, _ERRORS * error) else None

    def _set_needed(self, shares: list[float]) -> None:
        """Pairs that show the gain of the models, by the normal distribution of the exact test."""
        if len(shares) < 2 or not (gain := shares[0] - shares[-1]) > 0.0:
            return
        level = NormalDist().inv_cdf(0.5 + 0.5 * self.confidence) + NormalDist().inv_cdf(_POWER)
        pairs = max(level**2 * (shares[0] + shares[-1]) / gain**2, _LEAST_DIFFERING / gain)
        digits = 10.0 ** math.floor(math.log10(pairs) - 1.0)
        self.needed = int(math.ceil(pairs / digits) * digits)

    def _model(self, centers: Array, number: int) -> CenterModel | None:
        """The model of runs spread evenly about nominal values; None if too many of them fail."""
        parameters = self.parameters(centers)
        sides = {
            name: one
            if isinstance(one, Interval)
            else Interval(*one.at(np.array([-_REACH, _REACH])).tolist())
            for name, one in parameters.items()
        }
        count, seed = model_runs(self.count, len(sides)), self._seed(b"model", number)
        points = replace(self.runner, parameters=sides).drawn(lambda box: uniform_points(box, count, seed))
        extremes = self.runs.extremes(points)
        if not len(self._scales):
            self._scales = self.runs.deviations(extremes)
        excess = self.runs.excess(extremes, self._scales)
        kept = np.isfinite(excess).all(axis=1)
        if np.count_nonzero(kept) < max(3 * len(sides), count // 2):
            return None
        none = np.empty((0, len(sides)))
        fitted = ExcessModel.fitted(list(sides.values()), points[kept], excess[kept], none, none, False)
        groups = [
            [column for column, (own, _) in enumerate(self.runs.limits) if own == name]
            for name in self.runs.asked
        ]
        random = {name: one for name, one in parameters.items() if not isinstance(one, Interval)}
        scores = default_rng(self._seed(b"lines", 0)).standard_normal((_LINES, len(random)))
        return CenterModel(fitted, groups, list(parameters), random, self._places, scores)

    def verified(self, centers: Array) -> Verified:
        """Which fresh runs are outside, of the same mechanisms with both nominal values."""
        seed = self.fresh_seed
        scores = {
            name: default_rng([seed, self._order.index(name)]).standard_normal(self.count)
            for name in self.runner.random
        }
        before = self._outside(self.before, scores)
        return Verified(
            before, before if np.array_equal(centers, self.before) else self._outside(centers, scores)
        )

    def _outside(self, centers: Array, scores: Mapping[str, Array]) -> list[NDArray[np.bool_]]:
        draws = np.full((self.count, len(self.runner.parameters)), np.nan)
        for column, (name, one) in enumerate(self.parameters(centers).items()):
            if not isinstance(one, Interval):
                draws[:, column] = one.at(scores[name])
        found = [np.zeros(self.count, dtype=bool) for _ in self.runs.asked]
        for place in self._places:
            extremes = self.runs.extremes(placed(self.runner, draws, place))
            for own, watched, values in zip(found, self.runs.watched.values(), extremes, strict=True):
                own |= watched.is_outside(values)
        return found

    @property
    def fresh_seed(self) -> int:
        """Seed of the runs that verify: no others have it."""
        return self._seed(b"fresh", 0)

    def _seed(self, what: bytes, number: int) -> int:
        return int(default_rng([self.seed, number, *what]).integers(2**63))


def moved_to(one: Distribution, nominal: float) -> Distribution:
    """A distribution with another nominal value.

    That of most kinds moves by the distance of all values; of a lognormal one, the median does not.
    """
    distance = nominal - one.interval.nominal
    for _ in range(_REPETITIONS):
        moved = one.moved(distance)
        missing = nominal - moved.interval.nominal
        if abs(missing) <= 1e-12 * max(abs(nominal), one.interval.half_width):
            break
        distance += missing
    return moved
