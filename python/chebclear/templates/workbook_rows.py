"""Lines of a workbook as the tables of parameters and requirements in a scene file, and these as lines.

A cell that says what the file says leaves the words of the file as they are, so that a template goes through
a workbook without a change.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ..base.arguments import as_number
from ..base.units import (
    UnitError,
    convert,
    is_quantity,
    misfit,
    parse_unit,
    si_unit,
    size_of,
    unit_of_quantity,
)
from .changes import written_unit
from .toml_text import inline
from .workbook_sheets import cell_text

UNIT = "unit"
ENDS = ("lower", "upper")
"""Columns of the two limits of a parameter."""
MEASURED = ("nominal", "plus", "minus", *ENDS)
"""Columns of a parameter whose numbers are in the unit of the line."""
LIMITS = ("above", "below")
"""Those of a requirement."""
# Columns of texts, which are never read as TOML.
_WORDS = ("distribution", "fit", "note", "of", "joint")
# Each gives an interval: a line that fills one leaves no other of the file, whose column it does not have.
_WAYS = (("rel",), ("plus", "minus"), ENDS, ("fit",))
_SIGNS = "+-"

Note = Callable[[str, str], None]
"""Notes a problem of the cell below a head."""


def parameter_cells(held: Any) -> dict[str, Any]:
    """The cells of a parameter by their heads."""
    table = held if isinstance(held, Mapping) else {"nominal": held}
    unit = written_unit(held)
    cells: dict[str, Any] = {UNIT: unit or None}
    for key, value in table.items():
        if key == "limits" and isinstance(value, list) and len(value) == len(ENDS):
            cells |= {end: _measured(one, unit) for end, one in zip(ENDS, value, strict=True)}
        elif key != UNIT:
            cells[key] = _measured(value, unit) if key in MEASURED else _plain(value)
    return cells


def requirement_cells(facts: Any) -> dict[str, Any]:
    """The cells of a requirement by their heads, of which the quantity is ``of``."""
    if not isinstance(facts, Mapping):
        return {}
    unit = _unit_of_limits(facts)
    cells = {key: _measured(value, unit) if key in LIMITS else _plain(value) for key, value in facts.items()}
    return {UNIT: unit or None} | cells


def parameter(held: Any, cells: Mapping[str, Any], note: Note) -> Any:
    """A parameter of the file as the cells of its line change it."""
    table = dict(held) if isinstance(held, Mapping) else {"nominal": held}
    before, own = parameter_cells(held), written_unit(held)
    unit = _unit(cells, own, MEASURED, note)
    if unit is None:
        return held
    if own and unit and (wrong := misfit(unit, own)):
        note(UNIT, f'"{unit}" {wrong}')
        return held
    taken = _taken(cells, before, MEASURED, unit, own)
    if not taken:
        return held
    filled = [way for way in _WAYS if any(cells.get(head) is not None for head in way)]
    for way in _WAYS:
        if filled and way not in filled and not any(head in cells for head in way):
            for head in way:
                table.pop("limits" if head in ENDS else head, None)
    for head, value in taken.items():
        if head not in (UNIT, *ENDS):
            _put(table, head, value)
    if any(end in taken for end in ENDS):
        # One of them may be as it was.
        ends = [taken[end] if end in taken else _end(held, index) for index, end in enumerate(ENDS)]
        for end, other, value in zip(ENDS, ENDS[::-1], ends, strict=True):
            if value is None and ends[ENDS.index(other)] is not None:
                note(end, f"must be given beside {other}")
        _put(table, "limits", ends if None not in ends else None)
    table.pop(UNIT, None)
    if unit and written_unit(table) != unit:
        table[UNIT] = unit
    if own and (wrong := misfit(written_unit(table), own)):
        note("nominal", f'"{table.get("nominal")}" {wrong}')
        return held
    return table if isinstance(held, Mapping) or table.keys() != {"nominal"} else table["nominal"]


def requirement(facts: Any, cells: Mapping[str, Any], note: Note) -> Any:
    """A requirement, of the file or a new one, as the cells of its line say it."""
    table = dict(facts) if isinstance(facts, Mapping) else {}
    own = _unit_of_limits(table)
    unit = _unit(cells, own, LIMITS, note)
    if unit is None:
        return facts
    for head, value in _taken(cells, requirement_cells(facts), LIMITS, unit, own).items():
        if head != UNIT:
            _put(table, head, value)
    return table


def _unit(cells: Mapping[str, Any], own: str, measured: Sequence[str], note: Note) -> str | None:
    """The unit of the numbers of a line, which is that of the file where the sheet has no such column.

    None, and a note, if it is none, or is left out where the file has one: its numbers would be SI.
    """
    if UNIT not in cells:
        return own
    given = cells[UNIT]
    if given is None:
        if own and any(_number(cells.get(head)) is not None for head in measured):
            note(UNIT, f"must be the unit of the numbers in this line; the file has {own}")
            return None
        return ""
    try:
        if given == "-" and own:
            raise UnitError(f"must be a unit, as the file has {own}")
        if given == "-":
            return ""
        if not isinstance(given, str):
            raise UnitError(f"must be a unit such as mm, or - for none, got {given!r}")
        parse_unit(given)
    except UnitError as error:
        note(UNIT, str(error))
        return None
    return given


def _taken(
    cells: Mapping[str, Any], before: Mapping[str, Any], measured: Sequence[str], unit: str, own: str
) -> dict[str, Any]:
    """What the cells say that differs from the file, as plain values of one; None for what is empty."""
    taken: dict[str, Any] = {}
    for head, value in cells.items():
        number = _number(value) if head in measured else None
        if head == UNIT:
            if unit != own:
                taken[UNIT] = unit
        elif _same(value, before.get(head), head in measured) and (number is None or unit == own):
            continue
        elif number is not None:
            taken[head] = f"{number!r} {unit}" if unit else number
        else:
            taken[head] = _read(head, value)
    return taken


def _put(table: dict[str, Any], key: str, value: Any) -> None:
    if value is None:
        table.pop(key, None)
    else:
        table[key] = value


def _end(held: Any, index: int) -> Any:
    """A limit as the file has it."""
    limits = held.get("limits") if isinstance(held, Mapping) else None
    return limits[index] if isinstance(limits, list) and len(limits) == len(ENDS) else None


def _unit_of_limits(facts: Mapping[str, Any]) -> str:
    """The unit in which limits are written; empty if they are in none."""
    units = (unit_of_quantity(one) for key in LIMITS if isinstance(one := facts.get(key), str))
    return next(filter(None, units), "")


def _measured(value: Any, unit: str) -> Any:
    """A value of the file as a cell of a line with a unit: a number in it, or a text that means the same.

    >>> _measured("50 mm", "mm"), _measured("60 um", "mm"), _measured(0.05, "mm"), _measured("2 * a", "mm")
    (50.0, '60 um', 50.0, '2 * a')
    """
    if isinstance(value, str) and is_quantity(value):
        number = _number(value.strip().partition(" ")[0])
        if number is None or unit_of_quantity(value) != unit or not _is_short(number):
            return value
        return number if _si(number, unit) == _si(value, "") else value
    bare = _number(value)
    if bare is None or not unit:
        return _plain(value if bare is None else bare)
    there = float(f"{bare / size_of(unit):.15g}")
    if _si(there, unit) == bare:
        return there
    # A number in brackets is an expression, which is in SI units.
    base = si_unit(unit)
    return f"{bare!r} {base}" if base else f"({bare!r})"


def _si(value: float | str | None, unit: str) -> float:
    """A number in a unit, or a quantity, in SI units; NaN if it has none."""
    try:
        return convert(value if isinstance(value, str) else f"{value!r} {unit}", "unit")
    except UnitError:
        return math.nan


def _plain(value: Any) -> Any:
    """Any other value of the file as a cell."""
    if isinstance(value, float) and not _is_short(value):
        return repr(value)
    return value if isinstance(value, str | bool | int | float) else inline(value)


def _is_short(number: float) -> bool:
    """Whether a number is safe in a cell: spreadsheets show 15 digits, and one that is edited has no more.

    >>> _is_short(0.3), _is_short(0.1 + 0.2)
    (True, False)
    """
    return float(f"{number:.15g}") == number


def _read(head: str, value: Any) -> Any:
    """A cell as a plain value of the file; a list or a table as TOML writes it."""
    if isinstance(value, str) and value[:1] in ("{", "[") and head not in _WORDS:
        try:
            return tomllib.loads(f"value = {value}")["value"]
        except (tomllib.TOMLDecodeError, RecursionError):
            return value
    return value


def _number(value: Any) -> float | None:
    """A number, also one in a cell that is formatted as text; None for anything else."""
    if isinstance(value, str):
        text = value.strip()
        # Not what else Python reads: other digits, underscores, "nan".
        plain = text.isascii() and text.lstrip(_SIGNS)[:1] in (*"0123456789", ".") and "_" not in text
        try:
            number = float(text) if plain else None
        except ValueError:
            return None
    else:
        number = as_number(value)
    return number if number is not None and math.isfinite(number) else None


def _same(value: Any, before: Any, measured: bool) -> bool:
    """Whether two cells say the same."""
    numbers = [_number(one) if measured or not isinstance(one, str) else None for one in (value, before)]
    if None not in numbers:
        return numbers[0] == numbers[1]
    texts = [(cell_text(one).strip() or None) if isinstance(one, str) else one for one in (value, before)]
    return type(texts[0]) is type(texts[1]) and texts[0] == texts[1]
