"""Studies from and to an Excel workbook: tolerances and requirements of a scene file, and what was found."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from ..base.prefixes import Form
from ..base.shown import meant_or_known
from ..base.writing import with_default_suffix
from ..errors import ArgumentTypeError, Problem, SceneError
from ..study.report.answer import features_of
from ..study.report.extent import extent
from ..study.requirements.conformance import Conformance
from ..study.results import StudyResult
from .workbook_rows import ENDS, UNIT, parameter, parameter_cells, requirement, requirement_cells
from .workbook_sheets import NAME, Row, Sheet, Workbook, write_sheets

PARAMETERS, REQUIREMENTS, RESULTS = "parameters", "requirements", "results"
# Columns that are written even if all of their cells are empty, to be filled.
_OF_PARAMETERS = (NAME, "nominal", "plus", "minus", UNIT, "distribution", "rel", *ENDS, "fit", "note")
_OF_REQUIREMENTS = (NAME, "quantity", "above", "below", "at", UNIT, "joint")
_OF_RESULTS = ("quantity", "nominal", "smallest", "largest", UNIT, "how sure", "why")
# What a file calls the quantity of a requirement.
_QUANTITY, _OF = "quantity", "of"

Table = tuple[Sequence[str], list[list[Any]]]


def with_workbook(
    values: Mapping[str, Any], path: str | os.PathLike[str], keys: Sequence[str]
) -> tuple[dict[str, Any], dict[str, str], list[Problem]]:
    """The plain values of a scene file with those of a workbook in their place.

    Parameters
    ----------
    values : mapping
        The plain values of the file.
    path : path
        The workbook.
    keys : sequence of str
        What the table of a parameter may hold.

    Returns
    -------
    values : dict
        Those of the file with the parameters and requirements of the workbook.
    cells : dict of str to str
        Where in the workbook what stands, by its path.
    problems : list of Problem
        What is wrong with cells themselves.

    Raises
    ------
    SceneError
        If the file is no workbook of a study.
    """
    book = Workbook(path, "a workbook")
    if not {PARAMETERS, REQUIREMENTS} & book.titles.keys():
        there = ", ".join(f'"{title}"' for title in book.titles.values())
        message = f'has neither a sheet "{PARAMETERS}" nor one "{REQUIREMENTS}"; there are {there or "none"}'
        raise SceneError([(book.path.name, message)])
    found, cells = dict(values), dict[str, str]()
    of_parameters = dict.fromkeys((*_OF_PARAMETERS, *(key for key in keys if key != "limits")))
    sheet = book.sheet(PARAMETERS, list(of_parameters))
    held = values.get(PARAMETERS, {})
    if sheet is not None and isinstance(held, Mapping):
        _set(found, PARAMETERS, _parameters(book, sheet, held, cells))
    sheet = book.sheet(REQUIREMENTS, _OF_REQUIREMENTS, [_QUANTITY])
    held = values.get(REQUIREMENTS, {})
    if sheet is not None and isinstance(held, Mapping):
        _set(found, REQUIREMENTS, _requirements(book, sheet, held, cells))
    return found, cells, book.problems


def _set(values: dict[str, Any], name: str, table: dict[str, Any]) -> None:
    """Put a table into the values of a file, which need not get an empty one."""
    if table or name in values:
        values[name] = table


def _parameters(
    book: Workbook, sheet: Sheet, held: Mapping[str, Any], cells: dict[str, str]
) -> dict[str, Any]:
    """The parameters of the file as the sheet changes them."""
    found = dict(held)
    for row in sheet.rows:
        if row.name not in held:
            unknown = meant_or_known(row.name, held, most=20)
            book.note(sheet.cell(NAME, row.number), f'the file has no parameter "{row.name}"{unknown}')
            continue
        places = _places(sheet, row, f"{PARAMETERS}.{row.name}", row.cells)
        path = f"{PARAMETERS}.{row.name}.limits"
        places[path] = places.pop(f"{PARAMETERS}.{row.name}.lower", sheet.cell("lower", row.number))
        places[f"{path}[0]"] = places[path]
        places[f"{path}[1]"] = places.pop(f"{PARAMETERS}.{row.name}.upper", places[path])
        given = parameter(held[row.name], row.cells, partial(_note, book, sheet, row))
        # A problem of what the file says stands there.
        if given is not held[row.name]:
            cells |= places
        found[row.name] = given
    return found


def _requirements(
    book: Workbook, sheet: Sheet, held: Mapping[str, Any], cells: dict[str, str]
) -> dict[str, Any]:
    """The requirements of the sheet, of which those that the file has too are as it says them."""
    found: dict[str, Any] = {}
    for row in sheet.rows:
        given = {_OF if head == _QUANTITY else head: value for head, value in row.cells.items()}
        places = _places(sheet, row, f"{REQUIREMENTS}.{row.name}", row.cells)
        places[f"{REQUIREMENTS}.{row.name}.{_OF}"] = sheet.cell(_QUANTITY, row.number)
        found[row.name] = requirement(held.get(row.name), given, partial(_note, book, sheet, row))
        cells |= places
    return found


def _note(book: Workbook, sheet: Sheet, row: Row, head: str, message: str) -> None:
    book.note(sheet.cell(head, row.number), message)


def _places(sheet: Sheet, row: Row, path: str, heads: Mapping[str, Any]) -> dict[str, str]:
    """The cells of a line by the paths of what stands there."""
    return {path: sheet.cell(NAME, row.number)} | {
        f"{path}.{head}": sheet.cell(head, row.number) for head in heads
    }


def write_workbook(
    source: Mapping[str, Any], path: str | os.PathLike[str], result: StudyResult | Conformance | None = None
) -> Path:
    """Write the parameters and requirements of a scene file, and a result, as sheets of a workbook."""
    if not isinstance(result, StudyResult | Conformance | None):
        raise ArgumentTypeError(
            f"result must be that of a study, or shares of conformance, got {result!r:.80}"
        )
    path = with_default_suffix(path, ".xlsx")
    sheets = {
        PARAMETERS: _table(source.get(PARAMETERS, {}), _OF_PARAMETERS, parameter_cells),
        REQUIREMENTS: _table(source.get(REQUIREMENTS, {}), _OF_REQUIREMENTS, _of_requirement),
    }
    if result is not None:
        sheets[RESULTS] = _results(result)
    write_sheets(path, sheets, "to_workbook")
    return path


def _table(held: Mapping[str, Any], heads: Sequence[str], cells_of: Any) -> Table:
    """A line for every name, with columns for whatever stands in one of them."""
    lines = {name: cells_of(one) for name, one in held.items()}
    heads = list(dict.fromkeys([*heads, *(head for cells in lines.values() for head in cells)]))
    rows = [[name, *(cells.get(head) for head in heads[1:])] for name, cells in lines.items()]
    return heads, rows


def _of_requirement(facts: Any) -> dict[str, Any]:
    return {_QUANTITY if key == _OF else key: value for key, value in requirement_cells(facts).items()}


def _results(result: StudyResult | Conformance) -> Table:
    """Shares in specification, features and outputs: smallest, largest, and how sure that is."""
    rows: list[list[Any]] = []
    shares = result if isinstance(result, Conformance) else result.conformance
    for name, share in (shares or {}).items():
        what = "all requirements" if len(shares or {}) > 1 and name == "all" else str(share.specification)
        sure = f"{100.0 * share.confidence:.4g} % confidence"
        why = f"{what}; {share.outside} of {share.runs} outside"
        ends = 100.0 * share.lower, 100.0 * share.upper
        rows.append([f"in specification: {name}", None, *ends, "%", sure, why])
    if isinstance(result, StudyResult):
        for one in features_of(result):
            reach, nominal = one.interval, float(one.nominal.mean())
            form = Form.of((reach.lower, nominal, reach.upper), one.unit, one.written)
            numbers = [_shown(form, value) for value in (nominal, reach.lower, reach.upper)]
            rows.append([one.name, *numbers, form.unit or None, reach.verdict, str(reach.sure)])
        for name, band in result.bands.items():
            ends_of = extent(result, band)
            form = Form.of(ends_of, band.unit, band.written)
            between = f"{form.number(ends_of.nominal_lower)} to {form.number(ends_of.nominal_upper)}"
            numbers = [_shown(form, value) for value in (ends_of.lower, ends_of.upper)]
            rows.append([name, between, *numbers, form.unit or None, band.verdict, str(band.sure)])
    return _OF_RESULTS, rows


def _shown(form: Form, value: float) -> float | None:
    """A number in the unit that is shown; an empty cell for NaN, which Excel has not."""
    return form.factor * value if math.isfinite(value) else None
