"""The ``repr`` of records: the most important facts, in at most twelve lines."""

from __future__ import annotations

import dataclasses
import textwrap
from collections.abc import Iterable, Sequence

import numpy as np

MOST_LINES = 12
"""Most lines of a ``repr`` [-]."""
WIDTH = 100
"""Most characters of a line of a ``repr`` [-], unless a single field is longer."""


def listed(names: Iterable[str], most: int = 8) -> str:
    """Names with commas; of many, the first ones and the number of the others.

    >>> listed(["a", "b", "c"]), listed(["a", "b", "c", "d"], most=2)
    ('a, b, c', 'a, b and 2 more')
    """
    known = list(names)
    if len(known) <= most:
        return ", ".join(known)
    return f"{', '.join(known[:most])} and {len(known) - most} more"


def in_a_sentence(names: Sequence[str]) -> str:
    """Names in a sentence; of many the first ones.

    >>> in_a_sentence(["slider.x", "slider.vx"]), in_a_sentence(list("abcdef"))
    ('slider.x and slider.vx', 'a, b, c and 3 more')
    """
    if len(names) > 4:
        return listed(names, most=3)
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)


def capital(text: str) -> str:
    """A text that begins with a capital letter; the others stay, unlike with ``str.capitalize``."""
    return text[:1].upper() + text[1:]


def shortened(lines: Sequence[str], most: int = MOST_LINES) -> list[str]:
    """Lines, without the middle ones if there are too many.

    >>> shortened(["1", "2", "3", "4", "5"], most=3)
    ['1', '...', '5']
    """
    if len(lines) <= most:
        return list(lines)
    last = (most - 1) // 2
    return [*lines[: most - 1 - last], "...", *lines[len(lines) - last :]]


def spoken(record: object) -> str:
    """A ``repr`` from the ``str`` of a record, in lines of limited length."""
    lines = f"<{type(record).__name__}: {record}>".splitlines()
    return "\n".join(shortened([piece for line in lines for piece in textwrap.wrap(line, WIDTH)]))


class Shown:
    """Base of records whose ``repr`` fits a prompt: arrays by shape, long collections by length."""

    def __repr__(self) -> str:
        fields = [item for item in dataclasses.fields(self) if item.repr]  # type: ignore[arg-type]
        name = type(self).__name__
        lines, indent = [f"{name}("], " " * (len(name) + 1)
        for number, item in enumerate(fields):
            end = ")" if number == len(fields) - 1 else ","
            piece = f"{item.name}={_short(getattr(self, item.name))}{end}"
            gap = "" if lines[-1].endswith("(") or not lines[-1].strip() else " "
            if number and len(lines[-1]) + len(gap) + len(piece) > WIDTH:
                lines.append(indent + piece)
            else:
                lines[-1] += gap + piece
        return "\n".join(shortened(lines))


def _short(value: object) -> str:
    """A value in a line: arrays by their shape, long collections by their length."""
    if isinstance(value, np.ndarray):
        return f"<array {value.shape}>"
    named = isinstance(value, tuple) and hasattr(value, "_fields")
    text = str(value) if named else repr(value)
    if len(text) <= 80 and "\n" not in text:
        return text
    if isinstance(value, tuple | list | dict):
        return f"<{len(value)} entries>"
    return f"<{type(value).__name__}>"
