"""Arrays of numbers, and tables of records: each field a column array, each entry a record."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar, Generic, Self, TypeAlias, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from .files import ArrayRecord
from .shown import listed, shortened
from .tables import format_table
from .units import units

Array: TypeAlias = NDArray[np.float64]
Row = TypeVar("Row")


class Rows(ArrayRecord, Sequence[Row], Generic[Row]):
    """Base of tables whose fields are arrays of one length, ``joint`` and others.

    A `collections.abc.Sequence` of records: ``for contact in contacts``, ``contacts[0]``. A slice, a mask or
    an array of indices gives a shorter table: ``contacts[contacts.joint == "wrist"]``.
    """

    row: ClassVar[type[Any]]
    """Type of an entry; it has the fields of the table, with their units."""

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> Self:
        """The table as the core returns it, whose words are lists."""
        columns = (table[item.name] for item in dataclasses.fields(cls))  # type: ignore[arg-type]
        return cls(*(np.array(one, dtype=np.str_) if isinstance(one, list) else one for one in columns))

    def __len__(self) -> int:
        return len(self._columns()[0])

    @overload
    def __getitem__(self, index: int) -> Row: ...
    @overload
    def __getitem__(self, index: slice | Sequence[int] | NDArray[np.bool_] | NDArray[np.integer]) -> Self: ...
    def __getitem__(self, index: Any) -> Row | Self:
        parts = [column[index] for column in self._columns()]
        if np.ndim(parts[0]):
            return type(self)(*parts)
        entry: Row = self.row(*(part.item() for part in parts))
        return entry

    def __iter__(self) -> Iterator[Row]:
        # Converted to lists first, for numbers and strings of Python instead of NumPy.
        return map(self.row, *(column.tolist() for column in self._columns()))

    def _columns(self) -> list[NDArray[Any]]:
        return [getattr(self, item.name) for item in dataclasses.fields(self)]  # type: ignore[arg-type]

    def __repr__(self) -> str:
        kind = f"{type(self).__name__}: {len(self)}"
        if not len(self):
            return f"<{kind}>"
        symbols = units(self.row)
        names = [item.name for item in dataclasses.fields(self)]  # type: ignore[arg-type]
        head = [f"{name} [{symbols[name]}]" if name in symbols else name for name in names]
        cells = [[_cell(value) for value in column.tolist()] for column in self._columns()]
        lines = format_table(head, zip(*cells, strict=True)).splitlines()
        joints = listed(dict.fromkeys(getattr(self, "joint", np.array([])).tolist()), most=4)
        return "\n".join(shortened([f"<{kind} in {joints}>", *lines]))


def _cell(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
