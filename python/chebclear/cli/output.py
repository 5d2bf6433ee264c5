"""What commands print and what they write: JSON, tables, pictures, complete folders."""

from __future__ import annotations

import argparse
import csv
import json
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..base.tables import format_number, format_table, markdown_table, shown_by_spreadsheets
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


def table_text(rows: Rows) -> str:
    """The table to be read on a screen."""
    return format_table(*_cells(rows))


def write_table(rows: Rows, folder: Path, name: str) -> None:
    """The table as Markdown to be read, as CSV and JSON with all digits; without rows, files that say so."""
    text = markdown_table(*_cells(rows)) if rows else "none"
    (folder / f"{name}.md").write_text(f"{text}\n", encoding="utf-8")
    with (folder / f"{name}.csv").open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        for cells in [list(rows[0]), *(row.values() for row in rows)] if rows else ():
            table.writerow(map(shown_by_spreadsheets, cells))
    text = json.dumps(_finite(list(rows)), indent=1, allow_nan=False, ensure_ascii=False)
    (folder / f"{name}.json").write_text(text + "\n", encoding="utf-8")


def _cells(rows: Rows) -> tuple[list[str], list[list[str]]]:
    cells = [
        [_cell(cell, _scale(row) if name in _ENDS else 0.0) for name, cell in row.items()] for row in rows
    ]
    return list(rows[0]) if rows else [], cells


# Columns of the ends of one quantity: the rounding of the larger one is shown as 0, not written to files so.
_ENDS = ("lowest", "largest")


def _scale(row: Mapping[str, object]) -> float:
    """The larger of the two ends of a quantity."""
    return max((abs(end) for name in _ENDS if isinstance(end := row.get(name), float)), default=0.0)


def _cell(cell: object, scale: float) -> str:
    return format_number(cell, 4, scale) if isinstance(cell, float) else str(cell)


def draw(folder: Path, name: str, sides: tuple[float, float], *plots: Callable[..., object]) -> None:
    """Pictures, one below the other, as a PNG of this name, of a width and a height [inch]."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=sides, layout="constrained")
    for place, plot in enumerate(plots, start=1):
        plot(ax=figure.add_subplot(len(plots), 1, place))
    (folder / f"{file_name(name)}.png").write_bytes(png(figure, DPI))
