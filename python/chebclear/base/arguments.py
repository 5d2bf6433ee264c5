"""Checks of function arguments: every problem at once, with the name of the argument and what it accepts."""

from __future__ import annotations

import math
import numbers
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.random import Generator, default_rng

from ..errors import ArgumentError, ArgumentTypeError, InputError, Problem, is_plain
from .shown import did_you_mean
from .units import UnitError, convert, why_not

MOST_SEED = 2**64 - 1
"""Largest seed of random points."""


def as_number(value: object) -> float | None:
    """A Python or NumPy number as a float; None for anything else, bool included."""
    if type(value) is float:  # the usual case; the tests below take a microsecond
        return value
    if type(value) is not int:
        if isinstance(value, np.ndarray) and value.ndim == 0:
            value = value[()]
        if isinstance(value, bool) or not isinstance(value, numbers.Real):
            return None
    try:
        return float(value)
    except OverflowError:  # an integer beyond the range of floats
        return -math.inf if value < 0 else math.inf


def refused(value: float, limits: Iterable[float | None]) -> str:
    """A refused number without the rounding of its last digits, unless only these cross a limit.

    >>> refused(-4.9999999999999996e-06, [0.0]), refused(1.0000000000000002, [1.0])
    ('-5e-06', '1.0000000000000002')
    """
    rounded = float(f"{value:.12g}")
    return repr(value if rounded in limits else rounded)


def as_whole(value: object) -> int | None:
    """A Python or NumPy integer as an int; None for anything else, bool and 3.0 included."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral):
        return None
    return int(value)


def _in_si(value: object, unit: str) -> float | None:
    """A number, or a text such as ``"60 ms"``, in the SI unit of its place; None for anything else."""
    if type(value) is not str:
        return as_number(value)
    try:
        return convert(value, unit)
    except UnitError:
        return None


class Checks:
    """Collects the problems of the arguments of a call and raises them together.

    They are raised as an ArgumentError or ArgumentTypeError, or as the given kind of InputError, with the
    names of the arguments as paths.

    >>> checks = Checks()
    >>> checks.whole("samples", 1, least=2)
    2
    >>> checks.real("duration", -0.5, "s", above=0.0)
    -0.5
    >>> checks.finish()
    Traceback (most recent call last):
    chebclear.errors.ArgumentError: samples must be a whole number >= 2, got 1
    duration must be a finite number > 0 [s], got -0.5
    """

    def __init__(self, error: type[InputError] | None = None) -> None:
        self._error = error
        self._problems: list[tuple[str, str]] = []
        self._wrong_types = 0

    def add(self, name: str, message: str, *, wrong_type: bool = False) -> None:
        """Add a problem of the argument of this name, of which it says what must be."""
        self._problems.append((name, message))
        self._wrong_types += wrong_type

    def number(self, name: str, value: object, unit: str) -> float:
        """A number, or NaN after adding a problem; the core checks its range."""
        number = _in_si(value, unit)
        if number is None:
            why = why_not(value, unit)
            self.add(name, f"must be a number [{unit}], got {value!r}{why}", wrong_type=not why)
            return math.nan
        return number

    def integer(self, name: str, value: object) -> int:
        """A whole number, or 0 after adding a problem; the core checks its range."""
        number = as_whole(value)
        if number is None:
            self.add(name, f"must be a whole number, got {value!r}", wrong_type=True)
            return 0
        if abs(number) > sys.float_info.max:  # which the core cannot read
            self.add(name, f"must be a whole number, got one of {number.bit_length()} bits")
            return 0
        return number

    def real(
        self,
        name: str,
        value: object,
        unit: str,
        *,
        above: float | None = None,
        below: float | None = None,
        least: float | None = None,
        most: float | None = None,
    ) -> float:
        """A finite number, or NaN after adding a problem; `above` and `below` are open limits.

        A text with a unit, such as ``"60 ms"``, is a number in SI units too.
        """
        number = _in_si(value, unit)
        # First what is nearly always so, without words: a study asks this of thousands of scenes.
        if (
            number is not None
            and math.isfinite(number)
            and (above is None or number > above)
            and (least is None or number >= least)
            and (below is None or number < below)
            and (most is None or number <= most)
        ):
            return number
        limits = ((">", above), (">=", least), ("<", below), ("<=", most))
        words = " and ".join(f"{sign} {limit:g}" for sign, limit in limits if limit is not None)
        accepted = f"a finite number {words}".strip()
        shown = refused(value, [limit for _, limit in limits]) if isinstance(value, float) else repr(value)
        why = why_not(value, unit)
        self.add(
            name, f"must be {accepted} [{unit}], got {shown}{why}", wrong_type=number is None and not why
        )
        return math.nan if number is None else number

    def seed(self, name: str, value: object) -> int:
        """A seed from a whole number, a generator, which draws one, or None, which stands for a fresh one.

        See SPEC 7 of Scientific Python; the seed that was drawn is kept with the result.
        """
        if value is None or isinstance(value, Generator):
            return int(default_rng(value).integers(2**63))
        number = as_whole(value)
        if number is None or not 0 <= number <= MOST_SEED:
            accepted = f"a whole number >= 0 and <= {MOST_SEED}, a numpy.random.Generator or None"
            self.add(name, f"must be {accepted}, got {value!r}", wrong_type=number is None)
            return 0
        return number

    def whole(self, name: str, value: object, *, least: int, most: int | None = None) -> int:
        """A whole number from `least` to `most`, or `least` after adding a problem."""
        number = as_whole(value)
        problem = f"must be a whole number >= {least}"
        if number is None:
            self.add(name, f"{problem}, got {value!r}", wrong_type=True)
            return least
        if number < least:
            self.add(name, f"{problem}, got {value!r}")
            return least
        if most is not None and number > most:
            self.add(name, f"{problem} and <= {most}, got {value!r}")
        return number

    def word(self, name: str, value: object, accepted: Iterable[str]) -> str:
        """One of the accepted words."""
        words = list(accepted)
        if not isinstance(value, str) or value not in words:
            choice = ", ".join(f'"{word}"' for word in words)
            problem = f"must be one of {choice}, got {value!r}{did_you_mean(value, words)}"
            self.add(name, problem, wrong_type=not isinstance(value, str))
            return words[0]
        return str(value)

    def mapping(self, name: str, value: object, to: str) -> Mapping[Any, Any]:
        """A mapping of names to something; empty if it is None, or after adding a problem."""
        if value is not None and not isinstance(value, Mapping):
            self.add(name, f"must map names to {to}, got {value!r}", wrong_type=True)
        return value if isinstance(value, Mapping) else {}

    def names(self, what: str, given: Iterable[object]) -> None:
        """Names that pages, tables and terminals can show."""
        for name in given:
            if isinstance(name, str) and not is_plain(name):
                self.add(what, f"must be named without control characters, got {name!r}")

    def noted(self, name: str) -> bool:
        """Whether there is a problem of the argument of this name."""
        return any(name == known for known, _ in self._problems)

    def include(self, other: Checks, names: Sequence[str]) -> None:
        """Add the problems of other checks in the order of the names of the arguments."""
        place = {name: index for index, name in enumerate(names)}
        # A name may be that of an entry, as in features[1].
        own = [(name if name in place else name.partition("[")[0]) for name, _ in other._problems]
        order = sorted(range(len(own)), key=lambda index: place[own[index]])
        self._problems += [other._problems[index] for index in order]
        self._wrong_types += other._wrong_types

    def finish(self) -> None:
        """Raise all problems: ArgumentTypeError if all are wrong types, else ArgumentError or the given."""
        if not self._problems:
            return
        if self._error is not None:
            raise self._error(self._problems)
        kind = ArgumentTypeError if self._wrong_types == len(self._problems) else ArgumentError
        error = kind("\n".join(f"{name} {message}" for name, message in self._problems))
        error.problems = tuple(Problem(*one) for one in self._problems)
        raise error
