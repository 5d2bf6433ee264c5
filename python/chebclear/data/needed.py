"""Libraries that only one method needs."""

from __future__ import annotations

import importlib
from typing import Any


def needed(library: str, caller: str, extra: str = "data") -> Any:
    """A library, or an ImportError that says how to get it."""
    try:
        return importlib.import_module(library)
    except ModuleNotFoundError as error:
        name = library.partition(".")[0]
        if error.name != name:  # it is there, something that it needs itself is not
            raise
        raise ImportError(f"{caller} needs {name}: pip install 'chebclear[{extra}]'", name=name) from None
