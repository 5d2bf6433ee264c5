"""Numbers and tables as text: plain, and in Markdown."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

# Numbers below this part of the largest of their quantity are the rounding of sums, some fifty of the last
# places of a double, and are shown as 0.
ROUNDING = 1e-14


def without_rounding(value: float, scale: float) -> float:
    """The number, or 0 where it is only the rounding of numbers of a scale; results keep what was computed.

    >>> without_rounding(-9.3e-17, 0.17), without_rounding(-9.3e-17, 1e-6), without_rounding(0.02, 0.17)
    (0.0, -9.3e-17, 0.02)
    """
    return 0.0 if abs(value) <= ROUNDING * abs(scale) else value


def format_ends(lower: float, upper: float, digits: int = 6) -> str:
    """An interval in words, of numbers with up to so many digits: rounding of the larger end is 0.

    >>> format_ends(-9.3e-17, 0.17), format_ends(-1.5, float("inf"))
    ('0 to 0.17', '-1.5 to inf')
    """
    known = [abs(value) for value in (lower, upper) if math.isfinite(value)]
    scale = max(known, default=0.0)
    return " to ".join(f"{without_rounding(value, scale):.{digits}g}" for value in (lower, upper))


def format_number(value: float, digits: int = 3, scale: float = 0.0) -> str:
    """A number with so many significant digits, plain from 1e-4 to 1e6; the rounding of a `scale` is 0.

    >>> format_number(0.07803), format_number(14.23, 4), format_number(3.0e-7), format_number(float("nan"))
    ('0.0780', '14.23', '3.00e-07', '-')
    >>> format_number(-0.0)
    '0'
    """
    if math.isnan(value):
        return "-"
    value = without_rounding(value, scale)
    if value == 0.0 or math.isinf(value):
        return f"{value + 0.0:g}"  # no "-0"
    scientific = f"{value:.{digits - 1}e}"
    exponent = int(scientific.partition("e")[2])  # after rounding: 9.999 to two digits is 10
    if not -4 <= exponent < 6:
        return scientific
    return f"{value:.{max(0, digits - 1 - exponent)}f}"


def shown_by_spreadsheets(cell: Any) -> Any:
    """A cell of a CSV file; a text that a spreadsheet would take for a formula gets an apostrophe before it.

    >>> shown_by_spreadsheets("=HYPERLINK(0)"), shown_by_spreadsheets("-"), shown_by_spreadsheets(-1.5)
    ("'=HYPERLINK(0)", '-', -1.5)
    """
    formula = isinstance(cell, str) and len(cell) > 1 and cell[0] in "=+-@"
    return f"'{cell}" if formula else cell


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table, padded: the first column to the left, the others to the right."""
    table = [[cell.replace("|", "\\|") for cell in row] for row in [header, *rows]]
    for row in table:
        if len(row) != len(header):
            raise ValueError(f"every row must have {len(header)} cells, got {row}")
    widths = [max(3, *(len(row[column]) for row in table)) for column in range(len(header))]

    def line(cells: Sequence[str]) -> str:
        padded = [cells[0].ljust(widths[0])]
        padded += [cell.rjust(width) for cell, width in zip(cells[1:], widths[1:], strict=True)]
        return f"| {' | '.join(padded)} |"

    rule = ["-" * widths[0]] + ["-" * (width - 1) + ":" for width in widths[1:]]
    return "\n".join([line(table[0]), line(rule), *(line(row) for row in table[1:])])


def format_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of plain text: the first column to the left, the others to the right.

    >>> print(format_table(["method", "steps"], [["rodas4", "12"]]))
    method  steps
    rodas4     12
    """
    table = [header, *rows]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return "\n".join(
        "  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]).rstrip() for row in table
    )
