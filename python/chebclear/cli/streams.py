"""Standard output and error that take every text: closed ones, ones of few letters, terminals; warnings."""

from __future__ import annotations

import contextlib
import os
import sys
import warnings
from collections.abc import Iterable, Iterator
from typing import Any, TextIO, cast

from ..errors import ChebclearWarning, visible


class _Shown:
    """A stream whose control characters are shown and not obeyed, and letters that it lacks written out."""

    def __init__(self, stream: TextIO, kept: str) -> None:
        self._stream, self._kept = stream, kept

    def write(self, text: str) -> int:
        encoding = self._stream.encoding or "utf-8"
        shown = visible(text, self._kept).encode(encoding, "backslashreplace")
        self._stream.write(shown.decode(encoding))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextlib.contextmanager
def shown_streams() -> Iterator[None]:
    """Let both streams take every text while the block runs.

    A stream that was closed before the program began is replaced by one that takes all and keeps nothing. On
    standard error a bar of progress returns to the start of its line.
    """
    with contextlib.ExitStack() as stack:

        def shown(stream: TextIO | None, kept: str) -> TextIO:
            usable = stream or stack.enter_context(open(os.devnull, "w", encoding="utf-8"))
            return cast(TextIO, _Shown(usable, kept))

        stack.enter_context(contextlib.redirect_stdout(shown(sys.stdout, "\t\n")))
        stack.enter_context(contextlib.redirect_stderr(shown(sys.stderr, "\t\n\r")))
        yield


@contextlib.contextmanager
def plain_warnings(quiet: bool) -> Iterator[None]:
    """Warnings of the package as plain lines on standard error, each text once; none if quiet."""
    with warnings.catch_warnings():
        usual, seen = warnings.showwarning, set[str]()
        warnings.simplefilter("ignore" if quiet else "always", ChebclearWarning)

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            if not issubclass(category, ChebclearWarning):
                usual(message, category, filename, lineno, file, line)
            elif str(message) not in seen:
                seen.add(str(message))
                print(f"warning: {message}", file=sys.stderr)

        warnings.showwarning = show
        yield
