"""Options that several functions share: declared and documented once, as fields of a dataclass."""

from __future__ import annotations

import dataclasses
import inspect
import re
from collections.abc import Callable, Collection
from typing import Any, TypeVar

PARAMETERS = "Parameters\n----------\n"
Documented = TypeVar("Documented", bound=Callable[..., Any])


def with_fields(
    record: type[Any], options: type, marker: str, further: Collection[str] = ()
) -> Callable[[Documented], Documented]:
    """Give a function or class of ``**options`` the signature and the documentation of fields of a record.

    The fields named in the TypedDict `options` are accepted as keywords; those and `further` ones, parameters
    of the function itself, are documented in the line `marker` of the docstring, with what the section
    "Parameters" of the dataclass `record` says of them.
    """
    fields = {item.name: item for item in dataclasses.fields(record)}

    def decorate(documented: Documented) -> Documented:
        function: Any = documented.__init__ if isinstance(documented, type) else documented  # type: ignore[misc]
        signature = inspect.signature(function)
        kept = [
            item for item in signature.parameters.values() if item.kind is not inspect.Parameter.VAR_KEYWORD
        ]
        named = {item.name for item in kept}
        # Where the documentation has them: behind the first keyword.
        place = 1 + next(
            index for index, item in enumerate(kept) if item.kind is inspect.Parameter.KEYWORD_ONLY
        )
        names = [name for name in options.__annotations__ if name not in named]
        kept[place:place] = [_keyword(fields[name]) for name in names]
        function.__signature__ = signature.replace(parameters=kept)
        text = documented.__doc__
        if text and record.__doc__:  # not where Python drops docstrings
            wanted = {*names, *further}
            entries = [lines for own, lines in parameters_of(record.__doc__) if not wanted.isdisjoint(own)]
            documented.__doc__ = inspect.cleandoc(text).replace(marker, "\n".join(map("\n".join, entries)))
        return documented

    return decorate


def _keyword(item: dataclasses.Field[Any]) -> inspect.Parameter:
    """A field as a keyword of a function."""
    missing = item.default is dataclasses.MISSING
    default = inspect.Parameter.empty if missing else item.default
    return inspect.Parameter(item.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=item.type)


def parameters_of(text: str) -> list[tuple[list[str], list[str]]]:
    """Names and lines, the head first, of the entries in the section "Parameters" of a docstring."""
    found: list[tuple[list[str], list[str]]] = []
    for line in inspect.cleandoc(text).partition(PARAMETERS)[2].splitlines():
        if heading := re.match(r"(\w[\w, ]*) : ", line):
            found.append((heading[1].split(", "), [line]))
        elif not line.startswith(" "):  # the end of the section
            break
        else:
            found[-1][1].append(line)
    return found
