"""What commands print and what they write: JSON, tables, pictures, complete folders."""

from __future__ import annotations

import argparse
import csv
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..base.prefixes import Form
from ..base.tables import format_number, format_table, markdown_table, shown_by_spreadsheets
from ..base.units import si_unit
from ..base.writing import complete_folder, file_name
from ..errors import ArgumentError
from ..report.html import png

FORMAT = 1
"""Number of the form of the JSON objects that commands print."""

DPI = 150
WIDTH = 6.5
"""Of pictures [inch]."""

Rows = Sequence[Mapping[str, Any]]
"""A table: the same keys in every row, numbers in full."""


def print_json(values: Mapping[str, Any]) -> None:
    """One object in one line; numbers that are not finite are null."""
    print(json.dumps({"format": FORMAT, **_finite(values)}, allow_nan=False))


def tell(options: argparse.Namespace, facts: Mapping[str, Any], text: object) -> None:
    """Print facts as JSON where that is asked for, else a text."""
    if options.json:
        print_json(facts)
    else:
        print(text, flush=True)


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(entry) for entry in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def require_writable(directory: Path | None) -> None:
    """Refuse a directory that cannot be written to before a long computation."""
    if directory is None:
        return
    try:
        with complete_folder(directory):
            pass
    except OSError as error:
        raise ArgumentError(f"cannot write to {str(directory)!r}: {error.strerror or error}") from None


def table_text(rows: Rows, written: Sequence[str] = ()) -> str:
    """The table to be read on a screen, in units that the user has `written`."""
    return format_table(*_cells(rows, written))


def write_table(rows: Rows, folder: Path, name: str, written: Sequence[str] = ()) -> None:
    """The table as Markdown to be read, in units that the user has `written`, and as CSV and JSON in SI units
    with all digits; without rows, files that say so."""
    text = markdown_table(*_cells(rows, written)) if rows else "none"
    (folder / f"{name}.md").write_text(f"{text}\n", encoding="utf-8")
    with (folder / f"{name}.csv").open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        for cells in [list(rows[0]), *(row.values() for row in rows)] if rows else ():
            table.writerow(map(shown_by_spreadsheets, cells))
    text = json.dumps(_finite(list(rows)), indent=1, allow_nan=False, ensure_ascii=False)
    (folder / f"{name}.json").write_text(text + "\n", encoding="utf-8")


def _cells(rows: Rows, written: Sequence[str]) -> tuple[list[str], list[list[str]]]:
    """Heads and cells to be read: numbers of a quantity in one unit, with digits that tell them apart.

    These are the columns of `_ENDS` and `_WIDTH` of a row that has a unit, and each whose head has one.
    """
    columns = {name: [row[name] for row in rows] for name in rows[0]} if rows else {}
    heads, texts = [], []
    for name, cells in columns.items():
        head, bracket, unit = name.rpartition(" [")
        unit = unit.removesuffix("]")
        if name == "unit":
            heads.append(name)
            texts.append([_form_of(row, written).unit for row in rows])
        elif name in _ENDS and "unit" in columns:
            heads.append(name)
            texts.append([_form_of(row, written).number(row[name]) for row in rows])
        elif name == _WIDTH and "unit" in columns:
            heads.append(name)
            texts.append([format_number(_form_of(row, written).factor * row[name]) for row in rows])
        elif bracket and si_unit(unit) and all(isinstance(cell, float) for cell in cells):
            form = Form.of(cells, unit, written)
            heads.append(f"{head} [{form.unit}]")
            texts.append(list(map(form.number, cells)))
        else:
            heads.append(name)
            texts.append([_cell(cell) for cell in cells])
    return heads, [list(row) for row in zip(*texts, strict=True)]


# Columns of one quantity, whose unit is in a column of its own.
_ENDS = ("lowest", "largest")
_WIDTH = "widest"


def _form_of(row: Mapping[str, Any], written: Sequence[str]) -> Form:
    """How the quantity of a row is written."""
    return Form.of([row[name] for name in _ENDS if name in row], row["unit"], written)


def _cell(cell: object) -> str:
    return format_number(cell, 4) if isinstance(cell, float) else str(cell)


def draw(folder: Path, name: str, sides: tuple[float, float], *plots: Callable[..., object]) -> None:
    """Pictures, one below the other, as a PNG of this name, of a width and a height [inch]."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=sides, layout="constrained")
    for place, plot in enumerate(plots, start=1):
        plot(ax=figure.add_subplot(len(plots), 1, place))
    (folder / f"{file_name(name)}.png").write_bytes(png(figure, DPI))
