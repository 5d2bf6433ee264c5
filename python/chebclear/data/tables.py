"""CSV files and pandas data frames."""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.tables import shown_by_spreadsheets
from ..base.writing import replaced, with_default_suffix
from .dataset import Dataset
from .needed import needed

if TYPE_CHECKING:
    import pandas


def to_csv(data: Dataset, path: str | os.PathLike[str]) -> Path:
    """Write the table of a dataset; see `Exports.to_csv`."""
    path = with_default_suffix(path, ".csv")
    table = data.table()
    head = [f"{name} [{data.unit(name)}]" if data.unit(name) else name for name in table]
    with replaced(path) as beside, beside.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(map(shown_by_spreadsheets, head))
        # tolist gives Python's numbers, which are written with as many digits as they need.
        columns = [column.tolist() for column in table.values()]
        for index, column in enumerate(table.values()):
            if column.dtype.kind not in "fiub":
                columns[index] = list(map(shown_by_spreadsheets, columns[index]))
        writer.writerows(zip(*columns, strict=True))
    return path


def to_dataframe(data: Dataset) -> pandas.DataFrame:
    """The table of a dataset; see `Exports.to_dataframe`."""
    library = needed("pandas", "to_dataframe")
    table = data.table()
    index = library.Index(table.pop(data.axis), name=data.axis)
    # Copies: pandas takes its arrays as its own to write in.
    frame: pandas.DataFrame = library.DataFrame(
        {name: column.copy() for name, column in table.items()}, index=index
    )
    units = {name: data.unit(name) for name in [data.axis, *table]}
    frame.attrs = {"units": units, **data.facts}
    return frame
