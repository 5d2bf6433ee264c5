"""Normal distributions: by mean and deviation, and as a drawing and a process capability say them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Self

import numpy as np

from ...base.arguments import Checks
from ...base.quantities import Interval, in_one_unit
from ...base.rows import Array
from .distribution import REACH, STANDARD, Distribution, FileKey, checked_moments, required, standard_cdf
from .sample import check_sample, worst_moments

# Standard deviations beyond which 5 % of a normal distribution are: an end that holds with 95 %.
_ONE_SIDED = STANDARD.inv_cdf(0.95)
# Most parts that a Cpk was measured on [-]: of more it is known to 1e-4 of itself.
_MOST_PARTS = 10**9


class NormallyDistributed(Distribution):
    """Base of the kinds that are normal: everything by mean and standard deviation."""

    @property
    def moments(self) -> tuple[float, float]:
        """Mean and standard deviation [SI unit of the quantity]."""
        raise NotImplementedError

    @property
    def is_normal(self) -> bool:
        """True."""
        return True

    @property
    def interval(self) -> Interval:
        """Three standard deviations to either side of the mean."""
        mean, deviation = self.moments
        return Interval(mean - REACH * deviation, mean + REACH * deviation).in_unit(self.unit)

    @property
    def support(self) -> tuple[float, float]:
        """No ends."""
        return -math.inf, math.inf

    def cdf(self, value: float) -> float:
        """Probability of a smaller value [-]."""
        mean, deviation = self.moments
        return standard_cdf((value - mean) / deviation)

    def upper_cdf(self, value: float) -> float:
        """Probability of a larger value [-]."""
        mean, deviation = self.moments
        return standard_cdf((mean - value) / deviation)

    def quantile(self, share: float) -> float:
        """The value that so many stay below."""
        mean, deviation = self.moments
        return mean + deviation * STANDARD.inv_cdf(share)

    def upper_quantile(self, share: float) -> float:
        """The value that so many stay above."""
        mean, deviation = self.moments
        return mean - deviation * STANDARD.inv_cdf(share)

    def at(self, scores: Array) -> Array:
        """The values of standard normal scores."""
        mean, deviation = self.moments
        return mean + deviation * scores

    def scores(self, values: Array) -> Array:
        """The standard normal scores of values."""
        mean, deviation = self.moments
        return np.asarray((values - mean) / deviation)

    def slopes(self, values: Array) -> dict[str, Array]:
        """Over mean and standard deviation."""
        scores, deviation = self.scores(values), self.moments[1]
        return {"mean": scores / deviation, "standard_deviation": (scores**2 - 1.0) / deviation}


@dataclass(frozen=True)
class Normal(NormallyDistributed):
    """A normally distributed parameter; see `normal`."""

    written_as: ClassVar[str] = "normal"
    in_words: ClassVar[str] = (
        "normal has three standard deviations to either side of its middle, or as cpk says"
    )
    file_keys: ClassVar[Mapping[str, FileKey]] = {
        "cpk": FileKey(
            "number",
            "process capability of a normal distribution: the mean, middle of the interval and shift, is 3 "
            "cpk standard deviations from the nearer limit",
        ),
        "shift": FileKey(
            "value",
            "how far the mean is above the middle of the interval; with cp a number of standard deviations",
        ),
        "parts": FileKey(
            "count",
            "number of parts that cpk was measured on: the least that they prove with 95 % confidence "
            "is taken",
        ),
        "sample": FileKey(
            "values",
            "measured values of at least 5 parts: sampled is as they are, and with limits the parts that "
            "they may not have seen are there; normal has their mean and the largest standard deviation "
            "that they allow with 95 % confidence",
            gives_interval=True,
        ),
        "cp": FileKey("number", "in place of cpk: half the interval over three standard deviations"),
    }
    mean: float
    standard_deviation: float

    @classmethod
    def in_file(
        cls, side: Interval | None, given: Mapping[str, Any], written: Mapping[str, Any]
    ) -> Distribution:
        """By the capability if it is given, else three standard deviations to either side of the middle."""
        if "sample" in given:
            checks = Checks()
            for name in given:
                if name != "sample":
                    checks.add(name, "does not go with a sample, which has its own mean and deviation")
            if side is not None and written.get("inspected") is not True:
                checks.add("limits", "cut nothing off a normal distribution without inspected = true")
            check_sample(checks, "sample", given["sample"])
            checks.finish()
            return cls(*worst_moments(given["sample"]))
        if given:
            side = required(side)
            # With cp the shift has no unit, and a length is refused as it is written.
            as_written = {name: written[name] for name in ("shift",) if name in given and "cp" in given}
            return capable(side.lower, side.upper, **(dict(given) | as_written))
        middle = side is None or side.nominal == side.midpoint
        side = required(side, middle, "needs the nominal value in the middle of the interval, or cpk")
        return cls(side.midpoint, side.half_width / REACH)

    @property
    def moments(self) -> tuple[float, float]:
        """Mean and standard deviation [SI unit of the quantity]."""
        return self.mean, self.standard_deviation

    def scaled(self, factor: float) -> Self:
        """With another standard deviation."""
        return replace(self, standard_deviation=factor * self.standard_deviation).in_unit(self.unit)

    def moved(self, distance: float) -> Self:
        """With another mean."""
        return replace(self, mean=self.mean + distance).in_unit(self.unit)


@dataclass(frozen=True)
class Capable(NormallyDistributed):
    """A normally distributed parameter by limits and process capability; see `capable`."""

    written_as: ClassVar[str] = "distributions.capable"
    lower: float
    upper: float
    cpk: float | None = None
    shift: float = 0.0
    parts: int | None = None
    cp: float | None = None

    @cached_property
    def moments(self) -> tuple[float, float]:
        """Mean and standard deviation [SI unit of the quantity]."""
        middle, half = 0.5 * self.lower + 0.5 * self.upper, 0.5 * self.upper - 0.5 * self.lower
        if self.cp is not None:
            deviation = half / (REACH * self.cp)
            return middle + self.shift * deviation, deviation
        return middle + self.shift, (half - abs(self.shift)) / (REACH * self.least_cpk)

    @property
    def mean(self) -> float:
        """Mean: the middle of the limits and the shift [SI unit of the quantity]."""
        return self.moments[0]

    @property
    def standard_deviation(self) -> float:
        """Standard deviation, such that the nearer limit is 3 Cpk of them from the mean [SI unit of the
        quantity]."""
        return self.moments[1]

    @property
    def least_cpk(self) -> float:
        """The Cpk that is taken [-]: of one measured on `parts` parts, the least with 95 % confidence."""
        if self.cpk is None:
            assert self.cp is not None
            return self.cp - abs(self.shift) / REACH
        return self.cpk if self.parts is None else proved_cpk(self.cpk, self.parts)

    @property
    def outside(self) -> float:
        """Share of the parts beyond the limits, on both sides together [-]."""
        return self.cdf(self.lower) + self.upper_cdf(self.upper)

    @property
    def told(self) -> str:
        """With the share beyond its limits."""
        return f"normal, {float(f'{1e6 * self.outside:.2g}'):g} ppm beyond its limits"

    def scaled(self, factor: float) -> Self:
        """With limits, standard deviation and shift times a factor, around the same mean: the same Cpk."""
        mean = self.mean
        shift = self.shift if self.cpk is None else factor * self.shift
        lower, upper = (mean + factor * (end - mean) for end in (self.lower, self.upper))
        return replace(self, lower=lower, upper=upper, shift=shift).in_unit(self.unit)

    def moved(self, distance: float) -> Self:
        """With other limits, and the mean with them."""
        return replace(self, lower=self.lower + distance, upper=self.upper + distance).in_unit(self.unit)


def proved_cpk(cpk: float, parts: int) -> float:
    """The Cpk that one measured on so many parts proves with 95 % confidence [-] `[Bissell1990]`."""
    # The bound as printed, cpk (1 - z sqrt(1 / (9 n cpk²) + 1 / (2 (n - 1)))), without a square of cpk.
    return cpk - _ONE_SIDED * math.hypot(math.sqrt(1.0 / parts) / REACH, cpk * math.sqrt(0.5 / (parts - 1)))


def normal(mean: float | str, standard_deviation: float | str) -> Normal:
    """A normal distribution of a parameter, for `Study`, `conformance` and `Band.quantiles`.

    Parameters
    ----------
    mean : float or str
        Mean, in the SI unit of the quantity or with its unit, such as ``"120 mm"``.
    standard_deviation : float or str
        Standard deviation, above 0, likewise.

    Raises
    ------
    ValueError, TypeError
        If an argument is not a finite number or the standard deviation is not above 0.

    Examples
    --------
    >>> import chebclear as cc
    >>> cc.normal(0.12, 1e-4).mean
    0.12
    """
    center, spread, unit = checked_moments(mean, standard_deviation)
    return Normal(center, spread).in_unit(unit)


def capable(
    lower: float | str,
    upper: float | str,
    cpk: float | None = None,
    *,
    shift: float | str = 0.0,
    parts: int | None = None,
    cp: float | None = None,
) -> Capable:
    """A normal distribution as a drawing and a process capability say it: limits and Cpk.

    The mean is the **middle of the limits**, not the nominal value of the drawing, and the shift beside it;
    the standard deviation is such that the nearer limit is 3 Cpk of them from the mean.

    A Cpk says how many parts are beyond the nearer limit, Phi(-3 Cpk): 33 of a million with 1.33. Beyond both
    there are up to twice as many; the distribution's `outside` is their sum.

    A Cpk that was measured is uncertain: 1.33 on 50 parts proves 1.10, that is 506 instead of 33 of a million
    beyond a limit. With `parts` the least Cpk that it proves with 95 % confidence is taken.

    A Cpk of some days is no Cpk of years, over which the mean drifts. Say the drift, with the `cp` of the
    spread alone: ``cp=2.0, shift=1.5`` is "six sigma", 3.4 of a million.

    Parts beyond the limits occur here. If all are inspected, see `inspected`. `allocate` takes three standard
    deviations as the tolerance, as of `normal`, and keeps the Cpk.

    Parameters
    ----------
    lower, upper : float or str
        Limits of the drawing, in the SI unit of the quantity or with its unit.
    cpk : float, optional
        Distance of the mean from the nearer limit, in three standard deviations [-], above 0.
    shift : float or str, optional
        How far the mean is above the middle of the limits, in the SI unit or with its unit; less than half
        the distance between the limits. With `cp` a number of standard deviations [-].
    parts : int, optional
        Number of parts that the Cpk was measured on [-], at least 2; None for a known Cpk.
    cp : float, optional
        In place of `cpk`: half the distance between the limits, in three standard deviations [-].

    Raises
    ------
    ValueError, TypeError
        If a number is out of range, not exactly one of `cpk` and `cp` is given, `parts` stands with `cp`, or
        so few parts prove no Cpk above 0.

    Examples
    --------
    >>> import chebclear as cc
    >>> bore = cc.distributions.capable("49.98 mm", "50.06 mm", 1.33, shift="5 um")
    >>> round(bore.mean, 9), round(bore.standard_deviation, 9)
    (0.050025, 8.772e-06)
    """
    given = {"lower": lower, "upper": upper} | ({} if cp is not None else {"shift": shift})
    (lower, upper, *moved), unit = in_one_unit(given)
    checks = Checks()
    side = [checks.real(name, end, "SI unit") for name, end in (("lower", lower), ("upper", upper))]
    if not any(map(checks.noted, ("lower", "upper"))) and side[0] >= side[1]:
        checks.add("lower", f"must be < upper, got lower = {side[0]!r} and upper = {side[1]!r}")
    distance = checks.real("shift", moved[0] if moved else shift, "SI unit" if moved else "-")
    index = None if cpk is None else checks.real("cpk", cpk, "-", above=0.0)
    spread = None if cp is None else checks.real("cp", cp, "-", above=0.0)
    count = None if parts is None else checks.whole("parts", parts, least=2, most=_MOST_PARTS)
    if (cpk is None) == (cp is None):
        both = "are both given" if cp is not None else "are both missing"
        checks.add("cpk", f"and cp {both}: give one, cp with the shift in standard deviations")
    if cp is not None and parts is not None:
        checks.add("parts", "goes with a measured cpk, not with cp")
    half = 0.5 * side[1] - 0.5 * side[0]
    if moved and abs(distance) >= half > 0.0:
        checks.add(
            "shift", f"must be less than half the distance of the limits, {half:.6g}, got {distance!r}"
        )
    if index and count and not checks.noted("parts") and index > 0.0 and proved_cpk(index, count) <= 0.0:
        checks.add("parts", f"prove no Cpk: {index:g} on {count} may be one below 0; measure more")
    checks.finish()
    made = Capable(side[0], side[1], index, distance, count, spread).in_unit(unit)
    mean, deviation = made.moments
    if not mean - deviation < mean < mean + deviation < math.inf:
        wrong = f"makes a standard deviation of {deviation!r}, which no interval around {mean!r} can hold"
        checks.add("cpk" if cp is None else "cp", wrong)
    checks.finish()
    return made
