"""What every result is exported to, read back by the libraries that others would use."""

import csv

import chebclear as cc
import numpy as np
import pytest
from chebclear.data.matlab import matlab_name


def in_matlab(read, name):
    """The value of a name in a file, and its unit, empty if the file has none of it."""
    value, units = read, read["units"]
    for word in map(matlab_name, name.split(".")):
        value, units = value[word], units.get(word, "") if units else ""
    return value, units


def check_exports(one, axis, name, unit, values, folder):
    """Check a column of a result in all its exports: its unit, its axis and its `values` of the result."""
    values = np.asarray(values(one), dtype=float)
    assert np.array_equal(np.asarray(one.to_dict()[name], dtype=float), values)

    with one.to_csv(folder / "table").open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    column = head.index(f"{name} [{unit}]" if unit else name)
    assert np.array_equal(np.array([row[column] for row in rows], dtype=float), values)
    assert head[0].split(" [")[0] == axis

    pytest.importorskip("pandas")
    frame = one.to_dataframe()
    assert np.array_equal(frame[name], values) and frame.attrs["units"][name] == unit

    pytest.importorskip("xarray")
    data = one.to_xarray()
    assert data[name].dims == (axis,) and data[name].attrs.get("units", "") == unit
    assert np.array_equal(data[name], values)
    data.to_netcdf(folder / "file.nc", engine="scipy")

    io = pytest.importorskip("scipy.io")
    value, written = in_matlab(io.loadmat(one.to_mat(folder / "file"), simplify_cells=True), name)
    assert np.array_equal(np.ravel(value), values) and written == unit

    shown = one._repr_html_()
    assert shown.count("<table") == shown.count("</table>") >= 1 and shown.count("<tr") > 1

    if hasattr(one, "save"):
        assert cc.load_result(one.save(folder / "saved")) == one
