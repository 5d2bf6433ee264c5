"""Single values of scene files: numbers, quantities and expressions, and what is wrong with them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ..base.arguments import as_number
from ..base.units import UnitError, convert, is_quantity
from ..errors import Problem, UnknownKey
from .expressions import Expression, ExpressionError, ExpressionProblem, parse
from .template import path_text
from .toml_text import Path


class Values:
    """Reads values and notes every problem with its path."""

    def __init__(self) -> None:
        self.problems: list[Problem] = []

    def note(self, path: Path, message: str) -> None:
        """Note a problem."""
        self.problems.append(Problem(path_text(path), message))

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
            self.note(path, f'"{value}": {error}')
        except ExpressionError as error:
            self.refuse(path, value, error)
        return None

    def refuse(self, path: Path, text: str, error: ExpressionError, more: str = "") -> None:
        """Note an expression that cannot be read or evaluated, with the place inside its text."""
        self.problems.append(ExpressionProblem(path_text(path), f'"{text}" {error}{more}', error.column))

    def constant(
        self, value: Any, path: Path, unit: str = "unit", known: Mapping[str, float] | None = None
    ) -> float | None:
        """A number that follows no parameters but the known ones."""
        number = self.number(value, unit, path)
        if not isinstance(number, Expression):
            return number
        try:
            return number.evaluate(known or {})
        except ExpressionError as error:
            more = "" if known else "; no parameters are known here"
            self.refuse(path, number.text, error, more)
            return None
