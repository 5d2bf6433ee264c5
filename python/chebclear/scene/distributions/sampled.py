"""Measured samples of parts as distributions, with what they cannot know beyond their ends."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np

from ...base.arguments import Checks
from ...base.quantities import Interval, in_one_unit
from ...base.rows import Array
from .distribution import Distribution, FileKey, shares_of
from .normal import Normal
from .sample import RISK, check_sample, worst_moments

# Where the unseen parts are, over the distance between a limit and the nearest value: at the limit, but not
# in a point, which would leave their probabilities without an inverse.
_AT_LIMIT = 1e-6


@dataclass(frozen=True)
class Sampled(Distribution):
    """A parameter of which a sample was measured; see `sampled`."""

    written_as: ClassVar[str] = "distributions.sampled"
    in_words: ClassVar[str] = "sampled is as the values of sample"
    file_keys: ClassVar[Mapping[str, FileKey]] = {"sample": Normal.file_keys["sample"]}
    values: tuple[float, ...]
    lower: float | None = None
    upper: float | None = None

    @classmethod
    def in_file(
        cls, side: Interval | None, given: Mapping[str, Any], written: Mapping[str, Any]
    ) -> Distribution:
        """The values, with the limits if there are any."""
        checks = Checks()
        if "sample" not in given:
            checks.add("distribution", "needs a sample: the measured values")
        checks.finish()
        return sampled(given["sample"], *(() if side is None else side))

    @property
    def unseen(self) -> float:
        """Share of the parts that may be beyond one end of the sample, with 95 % confidence [-]."""
        return float(1.0 - RISK ** (1.0 / len(self.values)))

    @property
    def least_share(self) -> float:
        """One part in as many as were measured [-]."""
        return 1.0 / len(self.values)

    @property
    def told(self) -> str:
        """With the number of values."""
        return f"sample of {len(self.values)}"

    @property
    def interval(self) -> Interval:
        """From end to end; the median is the nominal value."""
        places = self._places[0]
        return Interval.about(float(places[0]), self.quantile(0.5), float(places[-1])).in_unit(self.unit)

    @cached_property
    def _places(self) -> tuple[Array, Array, Array]:
        """Values, and the probabilities of smaller and of larger ones, which are linear in between."""
        values = np.array(self.values)
        least, most = float(values[0]), float(values[-1])
        low = 0.0 if self.lower is None or self.lower >= least else self.unseen
        high = 0.0 if self.upper is None or self.upper <= most else self.unseen
        steps = np.linspace(0.0, 1.0, len(values))
        below, above = low + (1.0 - low - high) * steps, high + (1.0 - low - high) * steps[::-1]
        if low and self.lower is not None:
            start = [self.lower, self.lower + _AT_LIMIT * (least - self.lower)]
            values = np.concatenate([start, values])
            below, above = np.concatenate([[0.0, low], below]), np.concatenate([[1.0, 1.0 - low], above])
        if high and self.upper is not None:
            end = [self.upper - _AT_LIMIT * (self.upper - most), self.upper]
            values = np.concatenate([values, end])
            below, above = np.concatenate([below, [1.0 - high, 1.0]]), np.concatenate([above, [high, 0.0]])
        return values, below, above

    def cdf(self, value: float) -> float:
        """Probability of a smaller value [-]."""
        values, below, _ = self._places
        if value <= values[0] or value >= values[-1]:
            return float(value >= values[-1])
        # Equal values of a coarse gauge are a step, of which the lower end counts.
        after = bisect_left(values, value)
        return float(np.interp(value, values[after - 1 : after + 1], below[after - 1 : after + 1]))

    def upper_cdf(self, value: float) -> float:
        """Probability of a larger value [-]."""
        values, _, above = self._places
        if value <= values[0] or value >= values[-1]:
            return float(value <= values[0])
        after = bisect_right(values, value)
        return float(np.interp(value, values[after - 1 : after + 1], above[after - 1 : after + 1]))

    def quantile(self, share: float) -> float:
        """The value that so many stay below."""
        values, below, _ = self._places
        return float(np.interp(share, below, values))

    def upper_quantile(self, share: float) -> float:
        """The value that so many stay above."""
        values, _, above = self._places
        return float(np.interp(share, above[::-1], values[::-1]))

    def at(self, scores: Array) -> Array:
        """The values of standard normal scores."""
        (values, below, above), (smaller, larger) = self._places, shares_of(scores)
        from_above = np.interp(larger, above[::-1], values[::-1])
        return np.where(scores < 0.0, np.interp(smaller, below, values), from_above)

    def as_normal(self) -> Normal:
        """The normal distribution, if it is one, with the largest standard deviation that the sample allows.

        The mean is that of the sample, the standard deviation the upper end of its interval with 95 %
        confidence: with 50 values 1.2 times that of the sample. Whether parts are normally distributed no
        sample of this size tells about one part in thousands: that is what one takes on with this.
        """
        return Normal(*worst_moments(self.values)).in_unit(self.unit)

    def scaled(self, factor: float) -> Self:
        """With distances of all values and limits from the median times a factor."""
        nominal = self.interval.nominal
        return self._with(lambda value: nominal + factor * (value - nominal))

    def moved(self, distance: float) -> Self:
        """With all values and limits larger by a distance."""
        return self._with(lambda value: value + distance)

    def _with(self, changed: Callable[[float], float]) -> Self:
        ends = (None if end is None else changed(end) for end in (self.lower, self.upper))
        return type(self)(tuple(map(changed, self.values)), *ends).in_unit(self.unit)


def sampled(
    values: Iterable[float | str], lower: float | str | None = None, upper: float | str | None = None
) -> Sampled:
    """The distribution of a measured sample: its values, with straight lines between.

    **A sample knows nothing beyond its ends.** Of 50 parts, 5.8 % of all others may be below the smallest and
    as many above the largest, with 95 % confidence each (the distribution's `unseen`). Without limits no part
    is beyond the ends, which is too good; with the limits of an inspection, so many parts are **at** them,
    which is as bad as may be. Make the study with both: the truth is between the two answers.

    No share below one in as many as were measured can be known from a sample, and `rare_share` refuses it;
    neither does drawing from the sample again and again make it larger. Who knows that the parts are normally
    distributed takes `sampled(values).as_normal()`, whose standard deviation is the largest that the sample
    allows.

    Parameters
    ----------
    values : iterable of float or str
        At least 5 measured values that are not all equal, in the SI unit of the quantity or with their unit.
    lower, upper : float or str, optional
        Limits of an inspection that every part passes, beyond the values, likewise.

    Raises
    ------
    ValueError, TypeError
        If a value is not a finite number, there are too few of them, or a limit is among them.

    Examples
    --------
    >>> import chebclear as cc
    >>> bores = cc.distributions.sampled(["10.01 mm", "10.02 mm", "10.02 mm", "10.03 mm", "10.05 mm"])
    >>> bores.support, round(bores.unseen, 2)
    ((0.01001, 0.01005), 0.45)
    """
    checks = Checks()
    given = list(values) if isinstance(values, Iterable) and not isinstance(values, str) else None
    if given is None:
        checks.add("values", f"must be the measured values, got {values!r:.80}", wrong_type=True)
        checks.finish()
        given = []
    names = [f"values[{place}]" for place in range(len(given))]
    numbers, unit = in_one_unit(dict(zip(names, given, strict=True)) | {"lower": lower, "upper": upper})
    found = [checks.real(name, one, "SI unit") for name, one in zip(names, numbers, strict=False)]
    ends = [
        None if end is None else checks.real(name, end, "SI unit")
        for name, end in zip(("lower", "upper"), numbers[-2:], strict=True)
    ]
    check_sample(checks, "values", found)
    if not any(map(checks.noted, ("values", *names))):
        least, most = min(found), max(found)
        if ends[0] is not None and ends[0] > least:
            checks.add("lower", f"must be <= all values, which begin at {least!r}, got {ends[0]!r}")
        if ends[1] is not None and ends[1] < most:
            checks.add("upper", f"must be >= all values, which end at {most!r}, got {ends[1]!r}")
    checks.finish()
    return Sampled(tuple(sorted(found)), *ends).in_unit(unit)
