"""Sheets of an Excel workbook: tables below a line of heads, whose problems are named by their cells."""

from __future__ import annotations

import io
import math
import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from zipfile import BadZipFile, ZipFile

from ..base.arguments import Checks
from ..base.files import on_disk
from ..base.shown import meant_or_known
from ..base.writing import replaced
from ..data.needed import needed
from ..errors import Problem, SceneError, visible

NAME = "name"
"""The column that every table has."""
OWN = "#"
"""What the heads of columns and the names of rows begin with that are no part of the study."""
# A workbook of 200 parameters has 20 kB.
_MOST_BYTES = 20_000_000
_MOST_ROWS = 1000
_LONGEST = 32_767
"""Characters that a cell holds [-]: a limit of Excel."""
_OLD = b"\xd0\xcf\x11\xe0"
"""How files of Excel 97, and those with a password, begin."""
_EXTRA = "excel"
_BROKEN: Any = object()
"""Stands for what a cell holds that cannot be used."""


@dataclass(frozen=True)
class Row:
    """A line of a table.

    Attributes
    ----------
    name : str
        What stands in its column of names.
    number : int
        Its number in the sheet, counted from 1 [-].
    cells : Mapping[str, Any]
        Numbers, texts and truth values by the heads of the sheet; None where a cell is empty.
    """

    name: str
    number: int
    cells: Mapping[str, Any]


@dataclass(frozen=True)
class Sheet:
    """A table of a workbook.

    Attributes
    ----------
    title : str
        Name of the sheet, as problems write it.
    letters : Mapping[str, str]
        Letters of the columns by their heads.
    rows : Sequence[Row]
        The lines below the heads.
    """

    title: str
    letters: Mapping[str, str]
    rows: Sequence[Row]

    def cell(self, head: str, number: int) -> str:
        """A cell as formulas of other sheets write it, such as ``parameters!C4``."""
        return f"{self.title}!{self.letters.get(head, self.letters[NAME])}{number}"


def cell_text(text: str) -> str:
    """A text as a cell can hold it."""
    return visible(text)[:_LONGEST]


class Workbook:
    """The sheets of a file, and every problem of their cells.

    Attributes
    ----------
    problems : list of Problem
        What was found so far, with cells as paths.
    titles : dict of str to str
        Names of the sheets by their names in small letters.
    """

    def __init__(self, path: str | os.PathLike[str], caller: str) -> None:
        library = needed("openpyxl", caller, _EXTRA)
        self.path = on_disk(path)
        self.problems: list[Problem] = []
        content = self._content()
        try:
            with warnings.catch_warnings():
                # Of what it leaves out when it writes such a file, which this one is not.
                warnings.simplefilter("ignore")
                # Values as they were when the workbook was last saved, and the formulas behind them.
                self._values, self._formulas = (
                    library.load_workbook(io.BytesIO(content), data_only=only) for only in (True, False)
                )
        except Exception as error:  # whatever a reader meets in a file that is none of its kind
            raise self._refused(f"is no Excel workbook: {type(error).__name__}: {error}") from None
        self.titles = {sheet.title.strip().lower(): sheet.title for sheet in self._values.worksheets}

    def _content(self) -> bytes:
        """The bytes of the file, unless it unpacks to more than any workbook of a study."""
        with self.path.open("rb") as file:
            content = file.read(_MOST_BYTES + 1)
        if content.startswith(_OLD):
            raise self._refused("is a file of Excel 97 (.xls), or has a password: save it as .xlsx without")
        try:
            with ZipFile(io.BytesIO(content)) as parts:
                size = sum(one.file_size for one in parts.infolist())
        except BadZipFile:
            raise self._refused("is no Excel workbook (.xlsx)") from None
        if max(size, len(content)) > _MOST_BYTES:
            raise self._refused(f"has more than {_MOST_BYTES // 1_000_000} MB of sheets")
        return content

    def _refused(self, message: str) -> SceneError:
        return SceneError([(self.path.name, message)])

    def has_formulas(self) -> bool:
        """Whether a cell is computed from others."""
        return any(
            cell.data_type == "f" for sheet in self._formulas.worksheets for cell in _cells_of(sheet).values()
        )

    def sheet(self, name: str, heads: Sequence[str], required: Sequence[str] = ()) -> Sheet | None:
        """The table of a sheet, whose heads are some of these; None if there is none, or none can be read."""
        title = self.titles.get(name)
        if title is None:
            return None
        values, formulas = self._values[title], _cells_of(self._formulas[title])
        last = max((line for (line, _), cell in formulas.items() if cell.value is not None), default=1)
        if last > _MOST_ROWS:
            self._note(f"{name}!A{last}", f"a sheet has at most {_MOST_ROWS} rows: delete the rest")
            return None
        cells = self._filled(values)
        named = [line for (line, _), cell in cells.items() if line <= last and _head(cell) == NAME]
        if not named:
            heads_of = ", ".join(heads[:6])
            self._note(f"{name}!A1", f'has no line of heads, {heads_of} ..., of which "name" must be one')
            return None
        first, lines = min(named), range(1, last + 1)
        columns = self._columns(name, cells, first, heads)
        for head in required:
            if head not in columns:
                self._note(f"{name}!A{first}", f'misses the column "{head}"')
                return None
        reader = _Cells(self, name, cells, formulas)
        letters = {head: _letters(column) for head, column in columns.items()}
        rows = list(reader.rows(columns, lines[first:], self._headings(values, columns[NAME])))
        return Sheet(name, letters, rows)

    def _note(self, cell: str, message: str) -> None:
        self.problems.append(Problem(cell, message))

    def note(self, cell: str, message: str) -> None:
        """Note a problem of a cell."""
        self._note(cell, message)

    def _filled(self, sheet: Any) -> dict[tuple[int, int], Any]:
        """The cells of a sheet; those that are merged with one above them have its value."""
        cells = _cells_of(sheet)
        for merged in sheet.merged_cells.ranges:
            top = cells.get((merged.min_row, merged.min_col))
            for line in range(merged.min_row + 1, min(merged.max_row, _MOST_ROWS) + 1):
                if top is not None:
                    cells[line, merged.min_col] = top
        return cells

    def _headings(self, sheet: Any, column: int) -> set[int]:
        """Lines whose name is merged with cells beside it: headings of a part of the table."""
        return {
            line
            for merged in sheet.merged_cells.ranges
            if merged.min_col <= column < merged.max_col
            for line in range(merged.min_row, min(merged.max_row, _MOST_ROWS) + 1)
        }

    def _columns(
        self, name: str, cells: Mapping[tuple[int, int], Any], first: int, heads: Sequence[str]
    ) -> dict[str, int]:
        """Numbers of the columns by their heads."""
        columns: dict[str, int] = {}
        for column in sorted(column for line, column in cells if line == first):
            cell, head = f"{name}!{_letters(column)}{first}", _head(cells.get((first, column)))
            if not head or head.startswith(OWN):
                continue
            if head not in heads:
                known = meant_or_known(head, heads, most=20)
                self._note(cell, f'unknown column "{head}"{known}; a column of your own begins with {OWN}')
            elif head in columns:
                self._note(cell, f'there are two columns "{head}"')
            else:
                columns[head] = column
        return columns


class _Cells:
    """Reads the lines of a table."""

    def __init__(
        self,
        book: Workbook,
        name: str,
        cells: Mapping[tuple[int, int], Any],
        formulas: Mapping[tuple[int, int], Any],
    ) -> None:
        self.book, self.name, self.cells, self.formulas = book, name, cells, formulas

    def rows(self, columns: Mapping[str, int], lines: Sequence[int], headings: set[int]) -> Iterator[Row]:
        """The lines that have a name; notes cells of others, and names that are no texts."""
        seen: dict[str, str] = {}
        for line in lines:
            if line in headings:
                continue
            before = len(self.book.problems)
            values = {head: self._value(line, column) for head, column in columns.items()}
            cell, name = f"{self.name}!{_letters(columns[NAME])}{line}", values.pop(NAME)
            # What cannot be used is a problem already, and changes nothing.
            found = {head: value for head, value in values.items() if value is not _BROKEN}
            if isinstance(name, str) and name.startswith(OWN):
                del self.book.problems[before:]
                continue
            if name is _BROKEN or (name is None and all(value is None for value in values.values())):
                continue
            if not isinstance(name, str):
                got = "the cell is empty" if name is None else f"got {name!r}"
                self.book.note(cell, f"must be the name of what stands in this line, {got}")
            elif name in seen:
                self.book.note(cell, f'"{name}" stands in {seen[name]} too')
            else:
                seen[name] = cell
                yield Row(name, line, found)

    def _value(self, line: int, column: int) -> Any:
        """What a cell holds; a note if it cannot be used."""
        cell = self.cells.get((line, column))
        if cell is None:
            return None
        place, value = f"{self.name}!{_letters(column)}{line}", cell.value
        behind = self.formulas.get((cell.row, cell.column))
        if cell.data_type == "e":
            self.book.note(place, f"holds the error {value}")
        elif value is None and behind is not None and behind.data_type == "f":
            self.book.note(
                place,
                "is a formula whose value the file does not hold: open it in Excel or LibreOffice, which "
                "compute it, and save it",
            )
        elif isinstance(value, str):
            return value.strip() or None
        elif isinstance(value, bool | int) or (isinstance(value, float) and math.isfinite(value)):
            return value
        elif value is None:
            return None
        else:
            self.book.note(place, f"must be a number or a text, got a {type(value).__name__}")
        return _BROKEN


def _head(cell: Any) -> str:
    """The head of a column; empty if a cell is none."""
    value = None if cell is None else cell.value
    return "" if value is None else str(value).strip().lower()


def _cells_of(sheet: Any) -> dict[tuple[int, int], Any]:
    """The cells of a sheet that are there, by line and column: one far away makes none between."""
    # The public iterators make every cell up to the last one, which may be a million lines below.
    return dict(sheet._cells)


def _letters(column: int) -> str:
    """The letters of a column, counted from 1.

    >>> _letters(1), _letters(28)
    ('A', 'AB')
    """
    letters = ""
    while column:
        column, rest = divmod(column - 1, 26)
        letters = chr(ord("A") + rest) + letters
    return letters


def write_sheets(
    path: Any, sheets: Mapping[str, tuple[Sequence[str], Sequence[Sequence[Any]]]], caller: str
) -> None:
    """Write tables as the sheets of a workbook, in place of one that holds no others.

    Each has its heads and its lines, of numbers, texts and None.
    """
    library = needed("openpyxl", caller, _EXTRA)
    styles = needed("openpyxl.styles", caller, _EXTRA)
    _require_ours(path, tuple(sheets), caller)
    book = library.Workbook()
    book.remove(book.active)
    for title, (heads, rows) in sheets.items():
        sheet = book.create_sheet(title)
        for line, values in enumerate([heads, *rows], start=1):
            for column, value in enumerate(values, start=1):
                if value is not None:
                    _write(sheet.cell(line, column), value)
        for column, head in enumerate(heads, start=1):
            sheet.cell(1, column).font = styles.Font(bold=True)
            longest = max(
                (len(str(row[column - 1])) for row in rows if row[column - 1] is not None), default=0
            )
            sheet.column_dimensions[_letters(column)].width = min(60, max(len(head), longest)) + 2
        sheet.freeze_panes = "B2"
    with replaced(path) as beside:
        book.save(beside)


def _write(cell: Any, value: Any) -> None:
    """Put a value into a cell as what it is: no text becomes a formula."""
    if isinstance(value, str):
        cell.value = cell_text(value)
        cell.data_type = "s"
        # Such a text stays one when somebody edits the cell.
        cell.quotePrefix = value.startswith(("=", "+", "-", "@"))
    else:
        cell.value = value


def _require_ours(path: Any, titles: Sequence[str], caller: str) -> None:
    """Refuse to write over a workbook with formulas or sheets of somebody's own."""
    if not path.exists():
        return
    try:
        there = Workbook(path, caller)
    except SceneError:  # no workbook: a file of that name, as others are replaced
        return
    own = [title for title in there.titles.values() if title not in (*titles, "results")]
    what = f'the sheet "{own[0]}"' if own else "formulas" if there.has_formulas() else ""
    if what:
        checks = Checks()
        checks.add("path", f"{path.name} holds {what} of your own, which would be lost: give another name")
        checks.finish()
