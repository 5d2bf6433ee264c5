"""TOML text as plain values with the place of each in the file, and plain values as TOML text."""

from __future__ import annotations

import bisect
import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ..errors import Problem, SceneError

# A scene of 100 bodies has 60 kB. The limits keep a hostile file from costing time: 40 kB of dots in one key
# take the parser 3 s.
MOST_CHARACTERS = 1_000_000
MOST_DOTS = 20

# What a text is made of as far as keys matter, wherever they stand: those of too many parts, other keys and
# strings, strings of several lines, comments, and strings that do not end, which take the rest of their line.
_PART = r"""(?:[\w-]+|"(?:\\.|[^"\\\n])*"|'[^'\n]*')"""
_NEXT = rf"(?:[ \t]*\.[ \t]*{_PART})"
_TOKEN = re.compile(
    r'"""(?:\\.|[^\\])*?(?:"""|\Z)|' + r"'''.*?(?:'''|\Z)|#[^\n]*|"
    rf"(?P<long>{_PART}{_NEXT}{{{MOST_DOTS + 1}}})|{_PART}{_NEXT}*|[\"'][^\n]*",
    re.DOTALL,
)

Path = tuple[str | int, ...]


class Place(NamedTuple):
    """Where a value stands in a file; all count from 1."""

    line: int
    column: int
    key_column: int
    """Where its key begins, in the same line; that of the value where it has none."""


def read_toml(text: str) -> tuple[dict[str, Any], dict[Path, Place]]:
    """Values of a TOML text, and the place of each path, such as ``("bodies", 0, "mass")``; of a table, its
    header.

    A SceneError with line and column if the text is no TOML.
    """
    if len(text) > MOST_CHARACTERS:
        raise SceneError(
            [("file", f"has {len(text)} characters; at most {MOST_CHARACTERS} are accepted for a scene")]
        )
    text = text.replace("\r\n", "\n")
    long = next((found for found in _TOKEN.finditer(text) if found["long"] is not None), None)
    if long is not None:
        line = text.count("\n", 0, long.start()) + 1
        raise SceneError([(f"line {line}", f"a key with more than {MOST_DOTS} dots is not accepted")])
    try:
        return tomllib.loads(text), dict(_Locator(text).walk())
    except tomllib.TOMLDecodeError as error:
        raise SceneError([_syntax_problem(str(error), text)]) from None
    except (RecursionError, ValueError):
        # A ValueError: whole numbers of more than 4300 digits.
        raise SceneError([("file", "is nested too deeply or holds too long a number")]) from None


def _syntax_problem(message: str, text: str) -> Problem:
    found = re.search(r"\s*\(at (?:line (\d+), column (\d+)|end of document)\)$", message)
    words = message[: found.start()] if found else message
    words = f"is not valid TOML: {words[:1].lower()}{words[1:]}"
    if found is None or found[1] is None:
        return Problem("end of file", words)
    line, column = int(found[1]), int(found[2])
    written = text.split("\n")[line - 1]
    bare = _BARE_QUANTITY.search(written)
    dot = re.search(r"[=\s\[,]([+-]?(?:\d+\.(?!\d)|\.\d+))", written)
    if bare:
        words += f'; write a quantity in quotes: "{bare[1]} {bare[2]}"'
    elif dot:
        words += f"; {dot[1]} needs a digit on both sides of the point"
    elif words.endswith("invalid value"):
        word = re.match(r"[^\W\d]\w*", written[column - 1 :])
        words += (
            f'; a text stands in quotes: "{word[0]}"' if word else "; texts and quantities stand in quotes"
        )
    elif "cannot overwrite a value" in words and written.lstrip().startswith("["):
        name = written.strip().strip("[]")
        words += f"; every table of a list begins with [[{name}]], the first one too"
    return Problem(f"{line}:{column}", f"{words}{pointed_at(written, column)}")


# A line of a file that fits a terminal; of a longer one so much is shown on either side of the place.
_SHOWN, _AROUND = 160, 60


def pointed_at(line: str, column: int) -> str:
    """A line of the file with a mark below a column, counted from 1; of a long line the part around it.

    A file of one line may have as many problems as letters.
    """
    start, end = 0, len(line)
    if len(line) > _SHOWN:
        start, end = max(0, column - 1 - _AROUND), column - 1 + _AROUND
    before, after = "... " * (start > 0), " ..." * (end < len(line))
    mark = " " * (len(before) + column - 1 - start)
    return f"\n    | {before}{line[start:end]}{after}\n    | {mark}^"


# A number with a unit that stands in no quotes, as a value of its own, in a list or in a table.
_BARE_QUANTITY = re.compile(
    r"[=\[,]\s*([+-]?\d[\d.]*(?:[eE][+-]?\d+)?)\s+([A-Za-z\u00b5\u03bc%\u00b0][^\s,\]}#]*)\s*(?:[,\]}#]|$)"
)


class _Locator:
    """Walks over a text that `tomllib` has accepted, and so can trust it."""

    _SPACE = re.compile(r"(?:[ \t\n]|#[^\n]*)*")
    _BARE = re.compile(r"[A-Za-z0-9_-]+")
    _STRING = re.compile(
        r'"""(?:\\.|[^\\])*?"{3,5}|' + r"'''.*?'{3,5}|" + r'"(?:\\.|[^"\\])*"|' + r"'[^']*'", re.DOTALL
    )
    _SCALAR = re.compile(r"[^,\]}\n#]+")

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.ends = [index for index, letter in enumerate(text) if letter == "\n"]
        self.counts: dict[Path, int] = {}

    def walk(self) -> Iterator[tuple[Path, Place]]:
        table: Path = ()
        self._skip()
        while self.at < len(self.text):
            start = self.at
            if self.text.startswith("[[", start):
                self.at += 2
                name = self._resolved(self._key())
                index = self.counts.get(name, 0)
                self.counts[name] = index + 1
                table = (*name, index)
                self.at = self.text.index("]]", self.at) + 2
                yield table, self._place(start)
            elif self.text[start] == "[":
                self.at += 1
                table = self._resolved(self._key())
                self.at = self.text.index("]", self.at) + 1
                yield table, self._place(start)
            else:
                yield from self._pair(table)
            self._skip()

    def _resolved(self, key: Path) -> Path:
        """The path of a header: under an array of tables it means the last one."""
        path: Path = ()
        for index, name in enumerate(key):
            path = (*path, name)
            if path in self.counts and index < len(key) - 1:
                path = (*path, self.counts[path] - 1)
        return path

    def _pair(self, table: Path) -> Iterator[tuple[Path, Place]]:
        start = self.at
        key = self._key()
        for length in range(1, len(key)):
            yield (*table, *key[:length]), self._place(start)
        self.at = self.text.index("=", self.at) + 1
        self._skip()
        yield from self._value((*table, *key), self._place(start).column)

    def _value(self, path: Path, key_column: int | None = None) -> Iterator[tuple[Path, Place]]:
        place = self._place(self.at)
        yield path, place if key_column is None else place._replace(key_column=key_column)
        opening = self.text[self.at]
        if opening in "[{":
            self.at += 1
            closing, index = ("]" if opening == "[" else "}"), 0
            self._skip()
            while self.text[self.at] != closing:
                if opening == "[":
                    yield from self._value((*path, index))
                    index += 1
                else:
                    yield from self._pair(path)
                self._skip()
                if self.text[self.at] == ",":
                    self.at += 1
                    self._skip()
            self.at += 1
        elif opening in "\"'":
            self._match(self._STRING)
        else:
            self._match(self._SCALAR)

    def _key(self) -> Path:
        names: list[str] = []
        while True:
            self._skip()
            if self.text[self.at] in "\"'":
                quoted = self._match(self._STRING)
                names.append(tomllib.loads(f"x = {quoted}")["x"])
            else:
                names.append(self._match(self._BARE))
            self._skip()
            if self.text[self.at] != ".":
                return tuple(names)
            self.at += 1

    def _skip(self) -> None:
        self._match(self._SPACE)

    def _match(self, pattern: re.Pattern[str]) -> str:
        found = pattern.match(self.text, self.at)
        assert found is not None, "tomllib accepted what the locator cannot read"
        self.at = found.end()
        return found[0]

    def _place(self, at: int) -> Place:
        line = bisect.bisect_left(self.ends, at)
        start = self.ends[line - 1] + 1 if line else 0
        return Place(line + 1, at - start + 1, at - start + 1)


_PLAIN_KEY = re.compile(r"[A-Za-z0-9_-]+")
_ESCAPES = {"\\": "\\\\", '"': '\\"', "\n": "\\n", "\t": "\\t", "\r": "\\r", "\b": "\\b", "\f": "\\f"}
_WIDTH = 100


def write_toml(values: Mapping[str, Any]) -> str:
    """Plain values as TOML 1.0 that `tomllib` reads back to the last bit; None is left out.

    Lists of tables become ``[[name]]`` sections, tables at the top ``[name]`` sections; all else stands in
    one line.
    """
    lines: list[str] = []
    _write_table(values, (), lines)
    return "\n".join(lines).lstrip("\n") + "\n"


def _write_table(values: Mapping[str, Any], path: tuple[str, ...], lines: list[str]) -> None:
    later: list[tuple[str, Any]] = []
    for key, value in values.items():
        if value is None:
            continue
        section = isinstance(value, Mapping) and (not path or len(inline(value)) > _WIDTH)
        if (section or _is_tables(value)) and not _is_empty(value):
            later.append((key, value))
        else:
            lines.append(f"{_key_text(key)} = {inline(value)}")
    for key, value in later:
        name = (*path, key)
        header = ".".join(map(_key_text, name))
        for table in value if _is_tables(value) else [value]:
            lines += ["", f"[[{header}]]" if _is_tables(value) else f"[{header}]"]
            _write_table(table, name, lines)


def _is_tables(value: Any) -> bool:
    return (
        isinstance(value, Sequence)
        and not isinstance(value, str)
        and bool(value)
        and all(isinstance(item, Mapping) for item in value)
    )


def _is_empty(value: Any) -> bool:
    return isinstance(value, Mapping) and not value


def _key_text(key: str) -> str:
    return key if _PLAIN_KEY.fullmatch(key) else _quoted(key)


def _quoted(text: str) -> str:
    letters = (
        _ESCAPES.get(letter, letter if letter.isprintable() else f"\\U{ord(letter):08X}") for letter in text
    )
    return '"' + "".join(letters) + '"'


def inline(value: Any) -> str:
    """A plain value as TOML in one line; None is left out of tables."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return _quoted(value)
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if math.isfinite(value):
            return repr(value)
        return "nan" if math.isnan(value) else "inf" if value > 0.0 else "-inf"
    if isinstance(value, Mapping):
        pairs = [f"{_key_text(key)} = {inline(item)}" for key, item in value.items() if item is not None]
        return "{ " + ", ".join(pairs) + " }" if pairs else "{}"
    return "[" + ", ".join(inline(item) for item in value) + "]"
