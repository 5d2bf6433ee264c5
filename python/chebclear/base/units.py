"""The unit of a field of a record, declared once with the field, where code can read it.

Docstrings name the units for the reader; a test holds them to the metadata.
"""

from __future__ import annotations

import dataclasses
from typing import Any

_KEY = "unit"


def unit(symbol: str) -> dict[str, str]:
    """Metadata of a field that holds a number with a unit: ``field(metadata=unit("kg"))``."""
    return {_KEY: symbol}


def units(record: type[Any]) -> dict[str, str]:
    """The unit of every field of a dataclass by name; fields without one are left out.

    Examples
    --------
    >>> @dataclasses.dataclass
    ... class Wheel:
    ...     name: str
    ...     mass: float = dataclasses.field(metadata=unit("kg"))
    >>> units(Wheel)
    {'mass': 'kg'}
    """
    return {item.name: item.metadata[_KEY] for item in dataclasses.fields(record) if _KEY in item.metadata}
