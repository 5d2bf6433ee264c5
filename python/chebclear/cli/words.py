"""Hints of the library adapted to the command line: options in place of calls of Python."""

from __future__ import annotations

import re
from collections.abc import Callable


def _twice(found: re.Match[str]) -> str:
    """As many runs again, as an option."""
    return f"--runs {2 * int(found[1])}"


# A call in a hint or a warning, and what does the same here. A test holds the list to the texts.
_CALLS: tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...] = (
    (r"(\d+) more runs, result\.extend\(\d+\),", _twice),
    (r": result\.extend\((?:\d+\))?", " (--runs)"),
    (r"\nnext: result\.ranking\([^\n]*", ""),
    (r"\nwarning: [^\n]*", ""),  # they are on standard error already
    (r"prove it: band\((\d+)\)", r"prove it: --runs \1"),
    (r"; band\((\d+)\) repeats it", r"; --runs \1 repeats it"),
    (r"Study\.band\(revolutions=10, discard=1\)", "chebclear study with --revolutions 10"),
    (r"\(Study\.band\)", "(--kind band)"),
    (r"Study\.band(?:\(\))?", "--kind band"),
    (r"Study\.sample", "--kind sample"),
    (r"result\.check\(\) simulates", "--check simulates"),
    (r"skip=\.\.\.", "--skip"),
    (r"skip=", "--skip "),
    (r", or allow them with max_runs=\d*", ""),
    (r" are more than max_runs = (\d+)", r" are more than \1"),
    (r": ask for it in Study\(features=\.\.\.\)", ": name it in the table [features] of the file"),
    (r": add it to outputs=", ": add it to --outputs"),
    (r"simulate with outputs=None, or with these among them", "name these in --outputs"),
    (r", see check\(\)\.columns", ""),
    (r", see check\(\)\.further_columns", " (--list-outputs)"),
    (r"[:,] see result\.failures", ""),
    (r", or let the samples stay on the disk with store=\.\.\. and in_memory=False", ""),
    (r' for bounds="range"', ""),
    (r' or bounds="eq31"', ""),
)


def at_the_command_line(text: str) -> str:
    """A text of the library without its calls of Python."""
    for call, words in _CALLS:
        text = re.sub(call, words, text)
    return text
