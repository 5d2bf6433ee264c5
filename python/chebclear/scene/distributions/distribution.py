"""What every distribution of a parameter can tell: how often the values of a dimension occur."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from numpy.random import Generator

from ...base.arguments import Checks
from ...base.quantities import Interval, Written, in_one_unit
from ...base.rows import Array

REACH = 3.0
"""Standard deviations to either side that the interval of a distribution without ends holds: 99.73 %."""
# Least probability of a tail [-]: at 37 standard deviations, before it is no number any more.
_LEAST_TAIL = 1e-300
STANDARD = NormalDist()
"""The standard normal distribution."""


class FileKey(NamedTuple):
    """What a kind of distribution takes from a parameter in a scene file, besides its interval."""

    holds: Literal["value", "values", "number", "count", "yes or no"]
    """A value of the parameter, in its unit, or a list of them; a number without unit, a whole one; true or
    false."""
    meaning: str
    gives_interval: bool = False
    """Whether no interval is needed beside it."""


@dataclass(frozen=True)
class Distribution(Written):
    """How often the values of a parameter occur: base of all kinds.

    A kind is a frozen dataclass of plain numbers. It says its interval, which holds nearly all values, its
    support, which holds all, the probabilities of a smaller and of a larger value, and the values at a
    probability from below and from above. The rest follows; kinds with formulas for arrays say them too.
    """

    kinds: ClassVar[dict[str, type[Distribution]]] = {}
    """All kinds by the names of their classes."""
    written_as: ClassVar[str]
    """What makes one: name of a public function, which takes its fields."""
    in_words: ClassVar[str] = ""
    """What the word `written_as` means in a scene file; empty if it is none there."""
    file_keys: ClassVar[Mapping[str, FileKey]] = {}
    """What it takes there besides the interval."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "written_as" in cls.__dict__:
            Distribution.kinds[cls.__name__] = cls

    @classmethod
    def in_file(
        cls, side: Interval | None, given: Mapping[str, Any], written: Mapping[str, Any]
    ) -> Distribution:
        """The distribution over an interval, if there is one, with its `file_keys` as numbers and as written.

        The problems of an ArgumentError have the names of these keys, or "distribution".
        """
        raise NotImplementedError

    @property
    def interval(self) -> Interval:
        """The interval of a study of the parameter."""
        raise NotImplementedError

    @property
    def support(self) -> tuple[float, float]:
        """The ends beyond which no value lies; infinite if there are none."""
        return self.interval.lower, self.interval.upper

    @property
    def told(self) -> str:
        """What it is, in a word or a few."""
        return type(self).__name__.lower()

    @property
    def has_tolerance(self) -> bool:
        """Whether `scaled` keeps its nominal value and multiplies its interval: whether its tolerance may be
        chosen."""
        return True

    @property
    def least_share(self) -> float:
        """Share of the parts below which it tells nothing [-]; 0 for what is known by a form."""
        return 0.0

    @property
    def is_normal(self) -> bool:
        """Whether values are normally distributed."""
        return False

    def cdf(self, value: float) -> float:
        """Probability of a smaller value [-]."""
        raise NotImplementedError

    def upper_cdf(self, value: float) -> float:
        """Probability of a larger value [-]: exact where that of a smaller one is 1."""
        raise NotImplementedError

    def quantile(self, share: float) -> float:
        """The value that so many stay below."""
        raise NotImplementedError

    def upper_quantile(self, share: float) -> float:
        """The value that so many stay above: exact where ``1 - share`` is 1."""
        raise NotImplementedError

    def drawn(self, stream: Generator, draws: int) -> Array:
        """Independent values."""
        return self.at(stream.standard_normal(draws))

    def at(self, scores: Array) -> Array:
        """The values whose probabilities are those of standard normal scores."""
        found = [
            self.quantile(_tail(-one)) if one < 0.0 else self.upper_quantile(_tail(one))
            for one in scores.tolist()
        ]
        return np.array(found, dtype=float)

    def scores(self, values: Array) -> Array:
        """The standard normal scores of values."""
        return np.array([self._score(one) for one in values.tolist()], dtype=float)

    def _score(self, value: float) -> float:
        below = self.cdf(value)
        if below < 0.5:
            return STANDARD.inv_cdf(max(below, _LEAST_TAIL))
        return -STANDARD.inv_cdf(max(self.upper_cdf(value), _LEAST_TAIL))

    def slopes(self, values: Array) -> dict[str, Array]:
        """Slopes of the logarithm of the density over numbers of the distribution, by their names.

        None where the ends move with them: draws of one are then no draws of the other.
        """
        return {}

    def scaled(self, factor: float) -> Self:
        """With distances from the nominal value times a factor."""
        nominal = self.interval.nominal
        values = (nominal + factor * (value - nominal) for value in self._values())
        return type(self)(*values).in_unit(self.unit)

    def moved(self, distance: float) -> Self:
        """With all values larger by a distance."""
        return type(self)(*(value + distance for value in self._values())).in_unit(self.unit)

    def _values(self) -> tuple[Any, ...]:
        """The fields of a kind all of whose numbers are values of the parameter."""
        return dataclasses.astuple(self)


def _tail(score: float) -> float:
    """Probability beyond a score [-]."""
    return max(0.5 * math.erfc(score / math.sqrt(2.0)), _LEAST_TAIL)


def standard_cdf(score: float) -> float:
    """Probability of a smaller standard normal value [-], to its last digits however small."""
    return 0.5 * math.erfc(-score / math.sqrt(2.0))


def required(side: Interval | None, fits: bool = True, what: str = "") -> Interval:
    """The interval of a scene file that a distribution needs, or what of it does not fit."""
    checks = Checks()
    if side is None:
        checks.add("distribution", "needs an interval: give rel, plus and minus, limits or fit as well")
    elif not fits:
        checks.add("distribution", what)
    checks.finish()
    assert side is not None
    return side


def inside(one: Distribution, side: Interval, shares: Array) -> Array:
    """Values at shares of the probability that lies inside an interval."""
    first, last = one.cdf(side.lower), one.cdf(side.upper)
    return np.clip([one.quantile(first + (last - first) * share) for share in shares], side.lower, side.upper)


def shares_of(scores: Array) -> tuple[Array, Array]:
    """Probabilities of smaller and of larger standard normal values [-], either to its last digits."""
    tails = np.array([_tail(abs(one)) for one in scores.tolist()], dtype=float)
    return np.where(scores < 0.0, tails, 1.0 - tails), np.where(scores < 0.0, 1.0 - tails, tails)


def scores_of(shares: Array) -> Array:
    """Standard normal scores that so many stay below."""
    return np.array([STANDARD.inv_cdf(one) for one in shares.tolist()], dtype=float)


def checked_moments(
    mean: object, standard_deviation: object, *, above: float | None = None
) -> tuple[float, float, str]:
    """Mean and standard deviation, which may be texts with units, and the unit of the first."""
    given = {"mean": mean, "standard_deviation": standard_deviation}
    (mean, standard_deviation), unit = in_one_unit(given)
    checks = Checks()
    center = checks.real("mean", mean, "SI unit", above=above)
    spread = checks.real("standard_deviation", standard_deviation, "SI unit", above=0.0)
    checks.finish()
    return center, spread, unit
