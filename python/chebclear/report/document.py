"""The content of a report, without its layout."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from ..base.units import unit

if TYPE_CHECKING:
    from .film import Film

_NUMBER = re.compile(r"[-+−±<>≤≥]?\s?\d")
_GAPS = ("-", "", "not known")
# Letters of a number with its unit, range and share; what is longer is a sentence that begins with one.
_LONGEST = 30

Judgment = Literal["good", "fair", "bad"]


@dataclass(frozen=True)
class Text:
    """A paragraph: sentences, no markup."""

    text: str


@dataclass(frozen=True)
class Items:
    """A list of sentences."""

    items: Sequence[str]


@dataclass(frozen=True)
class Verdict:
    """A verdict; its symbol and color have the same meaning."""

    word: str
    judgment: Judgment
    """Whether results with it can be relied on."""

    @property
    def symbol(self) -> str:
        """A symbol for readers who do not see colors."""
        return {"good": "✓", "fair": "~", "bad": "✗"}[self.judgment]

    def __str__(self) -> str:
        return f"{self.symbol} {self.word}"


Cell = str | Verdict
Sentence = str | Verdict


@dataclass(frozen=True)
class Table:
    """Rows of equally many cells; the first cell of a row is its heading."""

    caption: str
    head: Sequence[str]
    """Heading of each column, with units."""
    rows: Sequence[Sequence[Cell]]

    def __post_init__(self) -> None:
        wrong = [index for index, row in enumerate(self.rows) if len(row) != len(self.head)]
        if wrong:
            raise ValueError(f'rows {wrong} of the table "{self.caption}" do not have {len(self.head)} cells')

    def in_numbers(self, column: int) -> bool:
        """Whether a column holds numbers and gaps only, and so is set flush right."""
        cells = [row[column] for row in self.rows]
        numbers = [
            cell for cell in cells if isinstance(cell, str) and _NUMBER.match(cell) and len(cell) <= _LONGEST
        ]
        return bool(numbers) and all(cell in numbers or cell in _GAPS for cell in cells)


@dataclass(frozen=True)
class Picture:
    """A figure; it is drawn when the report is written."""

    finding: str
    """Description of its content, for readers who cannot see it."""
    draw: Callable[..., object]
    """Draws into empty axes, its argument `ax`, as the method `plot` of a result does."""
    height: float = field(default=2.6, metadata=unit("in"))
    """Height over 4.5 inches of width [in]."""
    caption: str = ""
    name: str = ""
    """Of its own file, where pictures are written beside the report; empty if it has none."""


@dataclass(frozen=True)
class Moving:
    """Charts, and a drawing that moves with them; only seen first, with the answer."""

    still: Picture | None
    """In its place in print and where scripts are not allowed."""
    film: Callable[[], Film]
    """Makes what moves; it is asked when the report is written."""


@dataclass(frozen=True)
class Listing:
    """A text to copy or to save: a script, a scene."""

    name: str
    text: str
    shown: str
    """What it is, in words."""


Block = Text | Items | Table | Picture | Moving | Listing


@dataclass(frozen=True)
class Section:
    """A heading and what is below it."""

    title: str
    blocks: Sequence[Block]


@dataclass(frozen=True)
class Document:
    """A whole report."""

    title: str
    """The question, in words."""
    facts: Sequence[str]
    """A line of short facts below the title: runs, seconds, version, date."""
    answer: Sequence[Sentence]
    """The answer in a few sentences; the first may be judged."""
    doubts: Sequence[str]
    """What is not known and why, a sentence each."""
    sections: Sequence[Section] = field(default_factory=tuple)
    """The details, folded until they are asked for."""
    first: Sequence[Block] = field(default_factory=tuple)
    """What is seen with the answer: a picture, a table of the main numbers."""
