"""Quantiles over random parameters, for the worst case of parameters that are only known as intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator, default_rng

from ... import _core
from ...base import files as records
from ...base.arguments import Checks
from ...base.rows import Array
from ...base.shown import did_you_mean
from ...base.units import unit
from ...errors import ArgumentError
from ...scene.distributions import Distribution, inside
from ..polynomials.surrogate import Surrogate, time_blocks

# Number of polynomials in the interval parameters that are bounded at once: 64 MB at 16 terms.
_AT_ONCE = 500_000
# Draws [-]: 16 MB of ends an instant.
_MOST_DRAWS = 1_000_000
# A quantile is taken so many of its standard errors further out: of 40 sets of draws less than one is not far
# enough out. A factor of two changes the width by 2 to 3 %.
_CONFIDENCE = 2.0


@dataclass(frozen=True, eq=False, repr=False)
class QuantileBand(records.ArrayRecord):
    """A band that contains an output with a probability, for all values of the interval parameters.

    Attributes
    ----------
    t : Array
        Instants [s], shape (samples,).
    lower : Array
        Lower bound in the unit of the output, shape (samples,).
    upper : Array
        Upper bound in the unit of the output, shape (samples,).
    probability : float
        Least probability of the output to be between them, at each instant [-].
    statement : str
        Meaning of the band in words.
    """

    t: Array = field(metadata=unit("s"))
    lower: Array
    upper: Array
    probability: float
    statement: str

    def __str__(self) -> str:
        return self.statement

    def __repr__(self) -> str:
        return f"<QuantileBand: {len(self.t)} samples, probability {self.probability:g}>"


def quantile_bounds(
    surrogate: Surrogate,
    random: Mapping[str, Distribution],
    *,
    probability: float,
    draws: int,
    rng: int | Generator | None,
) -> tuple[Array, Array, str]:
    """Bounds and statement of a `QuantileBand`; see `Band.quantiles`."""
    checks = Checks()
    if not isinstance(random, Mapping) or not random:
        checks.add(
            "random",
            f"must map names of parameters to normal(...) or uniform(...), got {random!r}",
            wrong_type=True,
        )
        checks.finish()
    for name, given in random.items():
        if name not in surrogate.intervals:
            checks.add(f'random["{name}"]', f"is no parameter{did_you_mean(name, surrogate.intervals)}")
        elif not isinstance(given, Distribution):
            checks.add(
                f'random["{name}"]',
                f"must be a distribution, such as normal(...), got {given!r}",
                wrong_type=True,
            )
        else:
            side, (least, most) = surrogate.intervals[name], given.interval
            slack = 1e-12 * max(abs(side.lower), abs(side.upper))
            if least < side.lower - slack or most > side.upper + slack:
                checks.add(
                    f'random["{name}"]',
                    f"reaches from {least!r} to {most!r}, beyond the interval "
                    f"[{side.lower!r}, {side.upper!r}] of the runs",
                )
    asked = checks.real("probability", probability, "-", above=0.0, below=1.0)
    start = checks.seed("rng", rng)
    checks.finish()
    # What is beyond the intervals is not known, and counts as outside; other distributions have whole ranges.
    known, sides = 1.0, surrogate.intervals
    for name, given in random.items():
        if _is_endless(given):
            known *= given.cdf(sides[name].upper) - given.cdf(sides[name].lower)
    if asked >= known:
        raise ArgumentError(
            f"probability must be below {known:.6g}, that of the intervals of the runs, got {asked!r}: give "
            "the distributions wider intervals in a new study"
        )
    share = asked / known
    tail = 0.5 * (1.0 - share)
    # Draws are left in each tail, beyond its standard error.
    least = math.ceil(_CONFIDENCE**2 / tail)
    if least > _MOST_DRAWS:
        raise ArgumentError(
            f"a probability of {asked!r} takes {least} draws, more than {_MOST_DRAWS}: ask for less"
        )
    count = checks.whole("draws", draws, least=least, most=_MOST_DRAWS)
    checks.finish()
    beyond = max(0, math.floor(tail * count - _CONFIDENCE * math.sqrt(tail * (1.0 - tail) * count)))
    weights = _drawn(surrogate, random, count, default_rng(start))
    lower, upper = np.empty((2, surrogate.terms.shape[1]))
    for block in time_blocks(count, len(lower)):
        lows, highs = _worst_of_draws(surrogate, random, weights, block)
        lower[block] = np.partition(lows, beyond, axis=0)[beyond]
        upper[block] = np.partition(highs, count - 1 - beyond, axis=0)[count - 1 - beyond]
    return lower, upper, _statement(surrogate, random, asked, count)


def _is_endless(given: Distribution) -> bool:
    """Whether values beyond the interval may occur."""
    return given.support != (given.interval.lower, given.interval.upper)


def _statement(surrogate: Surrogate, random: Mapping[str, Distribution], asked: float, count: int) -> str:
    """What the band promises."""
    rest = [name for name in surrogate.intervals if name not in random]
    are = "is in its interval" if len(rest) == 1 else "are in their intervals"
    whatever = f", wherever {' and '.join(rest)} {are}" if rest else ""
    endless = [name for name, given in random.items() if _is_endless(given)]
    cut = f"; values of {' and '.join(endless)} beyond the interval count as outside" if endless else ""
    return (
        f"At each instant the output is between the bounds with a probability of at least {asked:g} over "
        f"{' and '.join(random)}{whatever}; estimated with {count} draws from the fitted polynomial and "
        f"widened by its error, all random parameters independent{cut}."
    )


def _drawn(surrogate: Surrogate, random: Mapping[str, Distribution], draws: int, rng: Generator) -> Array:
    """Basis of the random parameters at each draw, shape (draws, terms)."""
    names = list(surrogate.intervals)
    weights = np.ones((draws, 1))
    for name in random:
        axis = names.index(name)
        side = surrogate.intervals[name]
        # Latin hypercube: one draw in each of `draws` equally probable strata of every parameter.
        shares = (rng.permutation(draws) + rng.random(draws)) / draws
        x = (inside(random[name], side, shares) - side.midpoint) / side.half_width
        basis = np.cos(np.arange(surrogate.degrees[axis] + 1) * np.arccos(np.clip(x, -1.0, 1.0))[:, None])
        weights = (weights[:, :, None] * basis[:, None, :]).reshape(draws, -1)
    return weights


def _worst_of_draws(
    surrogate: Surrogate, random: Mapping[str, Distribution], weights: Array, block: slice
) -> tuple[Array, Array]:
    """Lowest and highest value over the interval parameters for each draw, shape (draws, instants)."""
    names = list(surrogate.intervals)
    axes = [names.index(name) for name in random]
    c = np.moveaxis(surrogate.coefficients[..., block], axes, range(len(axes)))
    draws, samples = len(weights), c.shape[-1]
    c = c.reshape(weights.shape[1], -1)
    degrees = [degree for axis, degree in enumerate(surrogate.degrees) if axis not in axes]
    lows, highs = np.empty((2, draws, samples))
    step = max(1, _AT_ONCE // samples)
    for first in range(0, draws, step):
        inserted = (weights[first : first + step] @ c).reshape(-1, c.shape[1] // samples, samples)
        if not degrees:
            lows[first : first + step] = highs[first : first + step] = inserted[:, 0, :]
            continue
        terms = np.ascontiguousarray(np.moveaxis(inserted, 1, 0).reshape(inserted.shape[1], -1))
        found = _core.polynomial_ranges(terms, degrees)
        lows[first : first + step] = found["lower"].reshape(-1, samples)
        highs[first : first + step] = found["upper"].reshape(-1, samples)
    return lows, highs
