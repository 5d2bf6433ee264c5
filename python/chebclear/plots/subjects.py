"""What a plot draws: its arguments checked.

Results offer plots as methods, so plots import results for types only.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from ..base.named import is_pattern, matching
from ..errors import ArgumentError, ArgumentTypeError

if TYPE_CHECKING:
    from ..run.trajectory import Trajectory


def is_a(value: object, kind: str) -> bool:
    """Whether a value is of a class of this name, or of one derived from it."""
    return any(base.__name__ == kind for base in type(value).__mro__)


def require(argument: str, value: object, kind: str) -> None:
    """Refuse, with a TypeError, what is not of the class that a plot draws."""
    if not is_a(value, kind):
        raise ArgumentTypeError(f"{argument} must be a {kind} of chebclear, got {type(value).__name__}")


def require_name(argument: str, name: object, run: Trajectory) -> None:
    """Refuse what cannot be the name of one column of a run, as a pattern; not that it is unknown."""
    if not isinstance(name, str) or (is_pattern(name) and name not in run.columns):
        message = f'{argument} must be the name of one column, such as "{run.columns[0]}", got {name!r}'
        raise (ArgumentError if isinstance(name, str) else TypeError)(message)


def column_names(run: Trajectory, columns: object) -> list[str]:
    """The names of columns that are given as one or several names or patterns; unknown names stay."""
    given = [columns] if isinstance(columns, str) else columns
    names = list(given) if isinstance(given, Iterable) else []
    if not names or not all(isinstance(name, str) for name in names):
        message = f'columns must be names of columns of the run, such as "{run.columns[0]}", got {columns!r}'
        raise ArgumentTypeError(message)
    return [found for name in names for found in (matching(run.columns, name) or [name])]
