"""The share outside of limits as a function of nominal values, by polynomials of what runs exceed them by."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...base.rows import Array
from ...scene.distributions import Distribution
from ...study.features.effects import legendre_terms
from ..least_cost.excess import ExcessModel

# Standard normal scores along a line, in which it is cut; a limit between two is found by a straight line.
_NODES = np.linspace(-8.0, 8.0, 33)
# Scores at which the values of a distribution are tabulated.
_TABLE = np.linspace(-12.0, 12.0, 4801)
# How far a polynomial that is no plane is followed, over its box [-].
_FOLLOWED = 1.3
# Part of the scatter of a value along the slope below which this is no direction [-].
_LEAST_SLOPE = 0.3
# Errors of a polynomial over the deviation of the values that are those of rounding [-].
_ROUNDING = 1e-9
# Coefficient over the deviation of the values below which a term is left out [-].
_LEAST_TERM = 1e-6
# Step of a difference in standard deviations, for slopes of the share.
_STEP = 0.02
# Steps of a search, and the length of the last one in standard deviations or what it gains.
_MOST_STEPS, _LAST, _GAINED = 60, 1e-4, 1e-4


@dataclass(frozen=True, eq=False)
class CenterModel:
    """What mechanisms exceed limits by around a center, and the share of those outside.

    The mechanisms outside are split by the requirement that they break most. The share of each is the mean
    over lines in its direction of the probability on them, which the normal distribution says: exact for a
    plane, and without a least share as counting has.
    """

    fitted: ExcessModel
    """The polynomials, of one column for each limit."""
    groups: Sequence[Sequence[int]]
    """The limits of each requirement, by their columns."""
    names: Sequence[str]
    """All parameters."""
    random: Mapping[str, Distribution]
    """Those with a distribution, around the center."""
    places: Sequence[Mapping[str, float]]
    """Values of the others: nominal ones and corners."""
    scores: Array
    """Standard normal scores of the random parameters of mechanisms, shape (lines, random parameters)."""

    @cached_property
    def _tables(self) -> dict[str, Array]:
        return {name: one.at(_TABLE) for name, one in self.random.items()}

    @cached_property
    def _rest(self) -> Array:
        """Scatter of each line: that of the runs in turn, shape (lines, limits); none but rounding is 0."""
        rest = self.fitted.rest[np.arange(len(self.scores)) % len(self.fitted.rest)]
        return np.where(self.residual <= _ROUNDING * self.fitted.deviations, 0.0, rest)

    @cached_property
    def residual(self) -> Array:
        """Standard deviation of what the polynomials leave, shape (limits,)."""
        return np.asarray(np.sqrt(np.mean(self.fitted.rest**2, axis=0)))

    def _values(self, moved: Mapping[str, Distribution], scores: Array, place: Mapping[str, float]) -> Array:
        """Values of all parameters on the cube of the polynomials, shape (mechanisms, parameters)."""
        columns = []
        random = list(self.random)
        for name in self.names:
            if name in place:
                columns.append(np.full(len(scores), place[name]))
                continue
            own, table = self.random[name], self._tables[name]
            if (other := moved.get(name, own)) is not own:
                now, then = own.interval, other.interval
                shift = then.lower - now.lower
                same = math.isclose(then.upper - then.lower, now.upper - now.lower, rel_tol=1e-9)
                table = table + shift if same else other.at(_TABLE)
            columns.append(np.interp(scores[:, random.index(name)], _TABLE, table))
        middle, half = self.fitted.box
        cube = (np.array(columns).T - middle) / half
        return cube if self._is_plane else np.clip(cube, -_FOLLOWED, _FOLLOWED)

    @cached_property
    def _is_plane(self) -> bool:
        return bool(np.max(self.fitted.powers.sum(axis=1)) <= 1)

    def _excess(self, moved: Mapping[str, Distribution], scores: Array) -> Array:
        """What mechanisms exceed each limit by at the worst place, without scatter."""
        powers, terms = self._terms
        found = [legendre_terms(self._values(moved, scores, place), powers) @ terms for place in self.places]
        return np.asarray(np.max(found, axis=0))

    @cached_property
    def _terms(self) -> tuple[NDArray[np.int64], Array]:
        """Powers and coefficients of the terms that matter: of a smooth response a small part."""
        kept = np.any(np.abs(self.fitted.terms) > _LEAST_TERM * self.fitted.deviations, axis=1)
        kept[0] = True
        return self.fitted.powers[kept], self.fitted.terms[kept]

    @cached_property
    def _directions(self) -> Array:
        """For each requirement the direction in which it changes most, shape (groups, random parameters)."""
        random = len(self.random)
        ends = np.vstack([np.eye(random), -np.eye(random)])
        at_ends = self._excess({}, ends)
        slopes = 0.5 * (at_ends[:random] - at_ends[random:])
        # At the center it is the same for all of them.
        middle = np.repeat(self._excess({}, np.zeros((1, random))), random, axis=0)
        bends = np.ptp([at_ends[:random], at_ends[random:], middle], axis=0)
        found = []
        for columns in self.groups:
            column = max(columns, key=lambda one: float(np.linalg.norm(slopes[:, one])))
            slope, bend = slopes[:, column], bends[:, column]
            if np.linalg.norm(slope) <= _LEAST_SLOPE * np.linalg.norm(bend):
                slope = np.eye(random)[int(np.argmax(bend))]
            length = float(np.linalg.norm(slope))
            found.append(slope / length if length > 0.0 else np.eye(random)[0])
        return np.array(found)

    def outside(self, moved: Mapping[str, Distribution], wider: float = 0.0) -> Array:
        """The share outside on each line, with limits wider by so many deviations, shape (lines,)."""
        lines, count = len(self.scores), len(_NODES)
        total = np.zeros(lines)
        for number, along in enumerate(self._directions):
            across = self.scores - (self.scores @ along)[:, None] * along
            scores = (across[:, None, :] + _NODES[None, :, None] * along).reshape(lines * count, -1)
            excess = self._excess(moved, scores).reshape(lines, count, -1) + self._rest[:, None, :] - wider
            worst = np.array([excess[:, :, columns].max(axis=2) for columns in self.groups])
            own = worst[number]
            if len(worst) > 1:
                others = np.delete(worst, number, axis=0).max(axis=0)
                own = np.minimum(own, own - others)
            total += _measure(own)
        return total

    def mean_excess(self, moved: Mapping[str, Distribution]) -> float:
        """Mean of what mechanisms exceed their worst limit by, in deviations of the quantities."""
        return float(np.mean((self._excess(moved, self.scores) + self._rest).max(axis=1)))

    def doubt(self, moved: Mapping[str, Distribution]) -> float:
        """Standard error of how far the polynomials move from the center to another one."""
        point = np.zeros((1, len(self.random)))
        changes = [
            legendre_terms(self._values(moved, point, place), self.fitted.powers)
            - legendre_terms(self._values({}, point, place), self.fitted.powers)
            for place in self.places
        ]
        length = max(float(np.linalg.norm(one)) for one in changes)
        return float(self.residual.max()) * length / math.sqrt(len(self.fitted.rest))


def _measure(above: Array) -> Array:
    """Probability on each line that a value is above 0, from its values at the nodes, shape (lines,)."""
    first, last = above[:, :-1], above[:, 1:]
    inside = (first >= 0.0) & (last >= 0.0)
    rows, pieces = np.nonzero((first >= 0.0) != (last >= 0.0))
    start, end = first[rows, pieces], last[rows, pieces]
    crossing = _NODES[pieces] + start / (start - end) * (_NODES[pieces + 1] - _NODES[pieces])
    other = np.where(end >= 0.0, _TAILS[pieces + 1], _TAILS[pieces])
    parts = np.bincount(rows, np.abs(_tails(crossing) - other), minlength=len(above))
    # Both ends go on for ever.
    ends = (above[:, [0, -1]] >= 0.0) @ _TAILS[[0, -1]]
    return np.asarray(inside @ np.abs(np.diff(_TAILS)) + parts + ends)


def _tails(scores: Array) -> Array:
    """Probability beyond each score, to its own side: 0 is a node, so that no piece has both sides."""
    return np.array([0.5 * math.erfc(abs(one) / math.sqrt(2.0)) for one in scores.tolist()])


_TAILS = _tails(_NODES)


def least(value: Callable[[Array], float], low: Array, high: Array, radius: float) -> Array:
    """Where a function is least, by descent from 0 within ends that hold it and a radius about it."""

    def within(step: Array) -> Array:
        """A box and a ball about 0 hold what is cut to the box and then shortened."""
        cut = np.clip(step, low, high)
        return np.asarray(cut * min(1.0, radius / max(float(np.linalg.norm(cut)), 1e-300)))

    def slopes(at: Array) -> Array:
        steps = _STEP * np.eye(len(at))
        return np.array([value(at + one) - value(at - one) for one in steps]) / (2.0 * _STEP)

    place = np.zeros(len(low))
    now, slope = value(place), slopes(place)
    length = radius / max(float(np.linalg.norm(slope)), 1e-300)
    for _ in range(_MOST_STEPS):
        other = within(place - length * slope)
        while (then := value(other)) >= now and np.linalg.norm(other - place) > _LAST:
            length *= 0.3
            other = within(place - length * slope)
        change = other - place
        if then >= now:
            break
        if np.linalg.norm(change) <= _LAST or now - then <= _GAINED:
            return other
        new = slopes(other)
        bend = float(change @ (new - slope))
        # The step that a parabola through both slopes asks for (Barzilai and Borwein 1988).
        length = float(change @ change) / bend if bend > 0.0 else 2.0 * length
        place, now, slope = other, then, new
    return place
