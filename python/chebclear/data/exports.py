"""Export functions, the same for all results."""

from __future__ import annotations

import csv
import os
from abc import ABC, abstractmethod
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..base.tables import shown_by_spreadsheets
from ..base.writing import replaced, with_default_suffix
from . import matlab, xarrays
from .dataset import Dataset
from .needed import needed

if TYPE_CHECKING:
    import pandas
    import xarray


# Rows of a table that notebooks show.
_SHOWN = 10


def _cell(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _caption(data: Dataset, shown: int) -> str:
    """What a notebook writes over the first rows of a table."""
    count = len(data.variables[data.axis].values)
    return f"By {data.axis}" if shown == count else f"By {data.axis}, the first {shown} of {count}"


class Exports(ABC):
    """Base of results that other programs can read."""

    @abstractmethod
    def dataset(self) -> Dataset:
        """The result as named arrays with units: what all the exports are made from."""

    def _repr_html_(self) -> str:
        from ..report import html
        from ..report.document import Table

        data = self.dataset()
        table = data.table()
        head = [f"{name} [{data.unit(name)}]" if data.unit(name) else name for name in table]
        cells = [[_cell(one) for one in column[:_SHOWN].tolist()] for column in table.values()]
        rows = [list(row) for row in zip(*cells, strict=True)]
        return html.fragment(repr(self).strip("<>"), [Table(_caption(data, len(rows)), head, rows)])

    def to_dict(self) -> dict[str, Any]:
        """Views of the columns that `to_csv` writes, by name, the axis first."""
        return self.dataset().table()

    def to_csv(self, path: str | os.PathLike[str]) -> Path:
        """Write the table to a CSV file: a line of names with units in brackets, then a line for each sample.

        Numbers are written so that they are read back to the last bit. A word or name that spreadsheets would
        compute, as ``=x``, gets an apostrophe before it. An existing file is replaced, as a
        whole or not at all.

        Parameters
        ----------
        path : path
            Where to; ``.csv`` is appended if there is no suffix.

        Returns
        -------
        Path
            The file written.
        """
        data, path = self.dataset(), with_default_suffix(path, ".csv")
        table = data.table()
        head = [f"{name} [{data.unit(name)}]" if data.unit(name) else name for name in table]
        # tolist gives Python's numbers, which are written with as many digits as they need.
        columns = [
            one.tolist() if one.dtype.kind in "fiub" else map(shown_by_spreadsheets, one.tolist())
            for one in table.values()
        ]
        with replaced(path) as beside, beside.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(map(shown_by_spreadsheets, head))
            writer.writerows(zip(*columns, strict=True))
        return path

    def to_dataframe(self) -> pandas.DataFrame:
        """The table as a pandas data frame.

        Its index is the axis, its ``attrs`` hold the units by column (``attrs["units"]``) and the facts.

        Raises
        ------
        ImportError
            If pandas is not installed.
        """
        library, data = needed("pandas", "to_dataframe"), self.dataset()
        # Copies: pandas takes its arrays as its own to write in.
        table = {name: column.copy() for name, column in data.table().items()}
        units = {name: data.unit(name) for name in table}
        frame = library.DataFrame(table).set_index(data.axis)
        frame.attrs = {"units": units, **data.facts}
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """Everything, runs and tables of contacts too, as an xarray dataset; units and facts as attributes.

        Returns
        -------
        xarray.Dataset
            It can be written with ``to_netcdf``. Names that netCDF does not accept are changed; such a
            variable has its own name as ``long_name``.

        Raises
        ------
        ImportError
            If xarray is not installed.
        """
        return xarrays.to_xarray(self.dataset())

    def to_mat(self, path: str | os.PathLike[str]) -> Path:
        """Write everything to a MATLAB file (version 5).

        Names are structures at their dots: ``slider.x`` of the result is ``slider.x`` in MATLAB, its unit is
        ``units.slider.x``, and the facts are in ``about``. Words that MATLAB does not accept as names are
        changed as `matlab_name` says. An existing file is replaced, as a whole or not at all.

        Parameters
        ----------
        path : path
            Where to; ``.mat`` is appended if there is no suffix.

        Returns
        -------
        Path
            The file written.

        Raises
        ------
        ImportError
            If SciPy is not installed.
        """
        return matlab.to_mat(self.dataset(), path)
