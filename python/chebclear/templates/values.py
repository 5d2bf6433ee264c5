"""Single values of scene files: numbers, quantities and expressions, and what is wrong with them."""

from __future__ import annotations

import math
from typing import Any

from ..base.arguments import as_number
from ..base.units import UnitError, convert, is_quantity
from ..errors import Problem, UnknownKey
from ..scene.schema import at_or_below
from .expressions import (
    CausedProblem,
    Expression,
    ExpressionError,
    ExpressionProblem,
    UnknownNameInExpression,
    parse,
)
from .template import path_text
from .toml_text import Path


class Values:
    """Reads values and notes every problem with its path.

    What follows from a wrong parameter is wrong for that reason alone, and no problem of its own.
    """

    def __init__(self) -> None:
        self.problems: list[Problem] = []
        self.constants: dict[str, float] = {}
        """Nominal values of parameters [SI units]."""
        self.lost: set[str] = set()
        """Parameters without a value, which is a problem already."""

    def note(self, path: Path, message: str) -> None:
        """Note a problem."""
        self.problems.append(Problem(path_text(path), message))

    def has_problem(self, path: Path) -> bool:
        """Whether a problem was noted at a path or below it."""
        return any(at_or_below(problem.path, path_text(path)) for problem in self.problems)

    def unknown(self, path: Path, hint: str) -> None:
        """Note a key that there is not."""
        self.problems.append(UnknownKey(path_text(path), f"unknown key{hint}"))

    def number(self, value: Any, unit: str, path: Path) -> float | Expression | None:
        """A number in the SI unit of its place, or an expression; None, and a note, for anything else."""
        number = as_number(value)
        if number is not None:
            if math.isfinite(number):
                return number
            self.note(path, f"must be a finite number, got {value!r}")
            return None
        if not isinstance(value, str):
            self.note(path, f'must be a number, a quantity such as "20 mm" or an expression, got {value!r}')
            return None
        try:
            return convert(value, unit) if is_quantity(value) else parse(value)
        except UnitError as error:
            # Entries of one list have one unit.
            cause = f"{path_text(path[:-1])}: {error}" if path and isinstance(path[-1], int) else ""
            self.problems.append(CausedProblem(path_text(path), f'"{value}": {error}', cause))
        except ExpressionError as error:
            self.refuse(path, value, error)
        return None

    def refuse(self, path: Path, text: str, error: ExpressionError, more: str = "") -> None:
        """Note an expression that cannot be read or evaluated, with the place inside its text."""
        cause = str(error) if isinstance(error, UnknownNameInExpression) else ""
        self.problems.append(
            ExpressionProblem(path_text(path), f'"{text}" {error}{more}', error.column, cause)
        )

    def constant(self, value: Any, path: Path, unit: str = "unit", *, alone: bool = False) -> float | None:
        """A number at the nominal values of the parameters, or `alone`, which may follow none of them."""
        number = self.number(value, unit, path)
        if not isinstance(number, Expression):
            return number
        try:
            if alone or self.lost.isdisjoint(number.names):
                return number.evaluate({} if alone else self.constants)
        except ExpressionError as error:
            more = "; no parameters are known here" if alone and number.names else ""
            self.refuse(path, number.text, error, more)
        return None
