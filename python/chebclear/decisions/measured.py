"""Measured traces: read with their units, aligned by a trigger, and compared with bands."""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, overload

import numpy as np

from ..base import files as records
from ..base.arguments import Checks
from ..base.named import Named
from ..base.prefixes import format_range
from ..base.rows import Array
from ..base.shown import listed, meant_or_known
from ..base.units import UnitError, convert, is_quantity, si_unit, unit
from ..data.dataset import Dataset, Variable, facts_of
from ..data.exports import Exports
from ..errors import ArgumentError
from ..scene.columns import column_unit
from ..study.band.band import Band
from ..study.band.margin import percent
from ..study.features.traces import rising_edges

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_TURN = 2.0 * math.pi
# A name and its unit, as in "acceleration [m/s2]" and "Time (ms)"; it matches every line.
_HEAD = re.compile(r"\s*(.*?)\s*(?:[\[(]([^\])]*)[\])])?\s*")
# Samples of a revolution below which turns cannot be counted [-].
_LEAST_OF_A_TURN = 4
# Problems of one kind that are named, and intervals in words.
_MOST_NAMED = 4


@dataclass(frozen=True, eq=False, repr=False)
class Measured(records.Saved, Named[Array], Exports, kind="measured trace"):
    """Measured outputs over time, crank angle or both; ``measured["slider.ax"]`` are the values of one.

    `load_measured` reads one from a file; arrays in SI units make one too.

    Attributes
    ----------
    columns : mapping of str to ndarray
        Values of each output, and of triggers, in SI units, each of shape (samples,).
    units : mapping of str to str
        SI unit of each column; empty where it is not known.
    t : ndarray, optional
        Instants [s], rising, shape (samples,).
    angle : ndarray, optional
        Crank angle [rad], full turns included, shape (samples,). One of the two is needed.

    Raises
    ------
    ValueError
        If something is missing, not finite, or of another length; all problems are listed.
    """

    _axes: ClassVar = {"columns": ("samples",), "t": ("samples",), "angle": ("samples",)}

    columns: dict[str, Array]
    units: dict[str, str] = field(default_factory=dict)
    t: Array | None = field(default=None, metadata=unit("s"))
    angle: Array | None = field(default=None, metadata=unit("rad"))

    def __post_init__(self) -> None:
        checks = Checks()
        axes = {name: axis for name, axis in (("t", self.t), ("angle", self.angle)) if axis is not None}
        given = {name: _column(checks, name, one) for name, one in (axes | dict(self.columns)).items()}
        if not axes or not self.columns:
            checks.add("t", "or angle must be given, and at least one column of values")
        if len({len(column) for column in given.values()}) > 1:
            checks.add(
                "columns", f"must be equally long, got { ({n: len(one) for n, one in given.items()}) }"
            )
        checks.finish()
        for name in axes:
            object.__setattr__(self, name, given[name])
        object.__setattr__(self, "columns", {name: given[name] for name in self.columns})
        if self.t is not None and np.min(np.diff(self.t)) <= 0.0:
            late = int(np.argmax(np.diff(self.t) <= 0.0)) + 1
            checks.add("t", f"must rise, it does not at sample {late}, {self.t[late]:.6g} s")
        if self.angle is not None and np.max(np.abs(np.diff(self.angle))) > _TURN / _LEAST_OF_A_TURN:
            checks.add(
                "angle", f"has fewer than {_LEAST_OF_A_TURN} samples in a turn: too coarse to count turns"
            )
        checks.finish()
        super().__post_init__()

    @property
    def _by_name(self) -> dict[str, Array]:
        return self.columns

    def dataset(self) -> Dataset:
        """The columns over time, or over the crank angle if that alone is known."""
        axis = "angle" if self.t is None else "t"
        known = {"t": self.t, "angle": self.angle, **self.columns}
        units = {**self.units, "t": "s", "angle": "rad"}
        columns = {name: one for name, one in known.items() if one is not None}
        variables = {name: Variable((axis,), one, units.get(name, "")) for name, one in columns.items()}
        return Dataset(axis, variables, facts_of(self))

    def __repr__(self) -> str:
        axes = " and ".join(name for name in ("t", "angle") if getattr(self, name) is not None)
        samples = len(next(iter(self.columns.values())))
        return f"<Measured: {samples} samples over {axes}, {listed(self.columns, most=4)}>"

    def triggered(
        self, signal: str, level: float | str, *, start: float = 0.0, turns: bool = False
    ) -> Measured:
        """The trace aligned at the rising edges of a signal.

        Parameters
        ----------
        signal : str
            Name of the column.
        level : float or str
            Value through which it rises, in its SI unit or with a unit.
        start : float
            Instant of the first edge [s]; with `turns` the crank angle of every edge [rad].
        turns : bool
            Whether the signal rises once in every revolution: the crank angle is then interpolated between
            edges, and what is before the first and after the last edge is left out.

        Raises
        ------
        ValueError
            If there is no edge, or with `turns` fewer than two.
        """
        values, checks = self[signal], Checks()
        number = quantity(checks, "level", level, self.units.get(signal, ""))
        start = checks.real("start", start, "rad" if turns else "s")
        if self.t is None:
            checks.add("t", "is needed: a trigger aligns instants")
        checks.finish()
        assert self.t is not None
        after = np.flatnonzero(rising_edges(values, number, number)) + 1
        if len(after) < 1 + turns:
            low, high = float(np.min(values)), float(np.max(values))
            raise ArgumentError(
                f'"{signal}" rises {len(after)} times through {number:g}, its values are {low:g} to {high:g}'
            )
        before = values[after - 1]
        part = (number - before) / (values[after] - before)
        edges = self.t[after - 1] + part * (self.t[after] - self.t[after - 1])
        if turns and np.min(np.diff(edges)) < 0.5 * np.median(np.diff(edges)):
            raise ArgumentError(f'"{signal}" rises twice within a turn through {number:g}: is it noise?')
        if not turns:
            return replace(self, t=self.t - edges[0] + start)
        kept = (self.t >= edges[0]) & (self.t <= edges[-1])
        angle = np.interp(self.t[kept], edges, start + _TURN * np.arange(len(edges)))
        columns = {name: column[kept] for name, column in self.columns.items()}
        return replace(self, columns=columns, t=self.t[kept], angle=angle)

    @overload
    def compare(self, bands: Band) -> Agreement: ...
    @overload
    def compare(self, bands: Mapping[str, Band]) -> dict[str, Agreement]: ...
    def compare(self, bands: Band | Mapping[str, Band]) -> Agreement | dict[str, Agreement]:
        """How much of the trace is inside bands: by time, or by crank angle if the bands are.

        Parameters
        ----------
        bands : Band or StudyResult
            The band of one output, or a result, of which all outputs that were measured are compared.

        Raises
        ------
        ValueError
            If nothing was measured of it, units differ, or the trace does not overlap; all are listed.
        """
        checks = Checks()
        asked = {bands.name: bands} if isinstance(bands, Band) else bands
        common = [name for name in asked if name in self.columns]
        if not common:
            checks.add(
                "bands", f"of {listed(asked)} have no output in common with the trace, {listed(self.columns)}"
            )
        found = {name: _agreement(checks, self, asked[name]) for name in common}
        checks.finish()
        agreed = {name: one for name, one in found.items() if one is not None}
        return agreed[bands.name] if isinstance(bands, Band) else agreed


@dataclass(frozen=True, eq=False, repr=False)
class Agreement(records.ArrayRecord, Exports):
    """How much of a measured output is inside a band; see `Measured.compare`.

    Attributes
    ----------
    band : Band
        The band.
    places : Array
        Instants [s] of the samples in its time, or by crank angle their angles [rad], shape (samples,).
    values : Array
        The measured values there, in the unit of the band; of an angle without its full turns.
    excess : Array
        How far each is outside, in the unit of the band; at most 0 inside.
    left_out : int
        Samples of the trace before and after the time of the band [-].
    """

    band: Band
    places: Array
    values: Array
    excess: Array
    left_out: int

    @property
    def share(self) -> float:
        """Share of these samples that are inside [-]."""
        return float(np.mean(self.excess <= 0.0))

    @property
    def outside(self) -> tuple[tuple[float, float], ...]:
        """Where the others are: from and to which instant [s] or crank angle [rad]."""
        out = np.concatenate([[False], self.excess > 0.0, [False]])
        firsts, lasts = np.flatnonzero(~out[:-1] & out[1:]), np.flatnonzero(out[:-1] & ~out[1:]) - 1
        return tuple(
            (float(self.places[a]), float(self.places[b])) for a, b in zip(firsts, lasts, strict=True)
        )

    def dataset(self) -> Dataset:
        """The measured values and how far each is outside, over time or crank angle."""
        axis, symbol = ("t", "s") if self.band.angle is None else ("angle", "rad")
        variables = {axis: Variable((axis,), self.places, symbol)}
        for name, values in ((self.band.name, self.values), ("excess", self.excess)):
            variables[name] = Variable((axis,), values, self.band.unit)
        return Dataset(axis, variables, facts_of(self) | {"share": self.share})

    def __str__(self) -> str:
        band, outside = self.band, self.outside
        text = f"{band.name}: {percent(self.share)} of {len(self.places)} samples inside"
        text += f" the band ({band.verdict}"
        if not math.isnan(band.coverage):
            text += f", which holds {percent(band.coverage)} of a new run"
        text += ")"
        if outside:
            axis = "s" if band.angle is None else "rad"
            text += f"; outside: {listed([format_range(one, axis) for one in outside], most=_MOST_NAMED)}"
        return text + (f"; {self.left_out} samples are not in its time" if self.left_out else "")

    def plot(self, *, ax: Axes | None = None, unit: str | None = None, **line: Any) -> Axes:
        """Draw the trace over the band; see `plot_agreement`."""
        from ..plots.bands import plot_agreement

        return plot_agreement(self, ax=ax, unit=unit, **line)


def _agreement(checks: Checks, measured: Measured, band: Band) -> Agreement | None:
    """The comparison with one band, or None after adding a problem."""
    name = band.name
    scale = unit_factor(checks, name, measured.units.get(name, ""), band.unit)
    axis, places = ("t", measured.t) if band.angle is None else ("angle", measured.angle)
    if places is None:
        checks.add(name, f"has a band over {axis}, and the trace has no {axis}: load or trigger it with one")
        return None
    if band.angle is None:
        kept, grid = (places >= band.t[0]) & (places <= band.t[-1]), band.t
        within = places = places[kept]
        if not len(places):
            ends = f"{band.t[0]:.6g} to {band.t[-1]:.6g} s"
            checks.add(name, f"does not overlap with its band, which is from {ends}")
            return None
    else:
        kept, sense = np.ones(len(places), dtype=bool), math.copysign(1.0, band.angle[-1] - band.angle[0])
        within, grid = (sense * (places - band.angle[0])) % _TURN, sense * (band.angle - band.angle[0])
    values = scale * measured.columns[name][kept]
    lower, upper = np.interp(within, grid, band.lower), np.interp(within, grid, band.upper)
    if band.angle is not None and name.rpartition(".")[2] == "angle":
        values = values - _TURN * np.round((values - 0.5 * (lower + upper)) / _TURN)
    excess = np.maximum(values - upper, lower - values)
    return Agreement(band, places, values, excess, int(np.count_nonzero(~kept)))


def _column(checks: Checks, name: str, given: object) -> Array:
    """A column of at least two finite numbers, or a problem."""
    try:
        column = np.array(given, dtype=float)
    except (TypeError, ValueError):
        column = np.empty(0)
    if column.ndim != 1 or len(column) < 2:
        checks.add(name, f"must be at least 2 numbers, of shape (samples,), got {given!r:.60}")
    elif not np.all(np.isfinite(column)):
        checks.add(name, f"must be finite, it is not at sample {np.argmin(np.isfinite(column))}")
    return column if column.ndim == 1 else np.empty(0)


def unit_factor(checks: Checks, name: str, own: str, wanted: str) -> float:
    """The factor from the SI unit of a trace to the unit of a model; 1 where either is not known."""
    if own and wanted and own != wanted:
        try:
            return 1.0 / convert(f"1 {wanted}", own)
        except UnitError:
            checks.add(name, f"is measured in {own}, in the model it is in {wanted}")
    return 1.0


def quantity(checks: Checks, name: str, given: float | str, unit: str, least: float = -math.inf) -> float:
    """A number in SI units, or one with a unit, of the dimension of a unit."""
    number: object = given
    if isinstance(given, str) and is_quantity(given):
        try:
            number = convert(given, unit or "unit")
        except UnitError as error:
            checks.add(name, str(error))
            return math.nan
    return checks.real(name, number, unit or "SI unit", least=least)


def load_measured(
    path: str | os.PathLike[str],
    columns: Mapping[str, str] | None = None,
    *,
    t: str | None = None,
    angle: str | None = None,
) -> Measured:
    """Read a measured trace from a CSV file with a line of names.

    Every column needs its unit, in the file, as ``acceleration [mm/s2]``, or in the argument. Values are
    converted to SI. Columns are divided by commas, semicolons or tabs; with the latter two numbers may have a
    decimal comma.

    Parameters
    ----------
    path : path
        The file.
    columns : mapping of str to str, optional
        For each output, or trigger, the column that measures it, such as ``{"slider.ax": "acc [mm/s2]"}``. If
        not given, all columns, by their own names. A unit that is given counts where that of the file is not
        known, as of a voltage: ``"pulse [-]"``.
    t, angle : str, optional
        Columns of the instants and of the crank angle, which may start again with every turn; ``"t"`` and
        ``"angle"`` if there are such and neither is given.

    Raises
    ------
    ValueError
        If columns are missing or not numbers, a unit is missing, unknown or of another dimension than the
        output; all problems are listed.

    Examples
    --------
    >>> import chebclear as cc
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "trace.csv")
    ...     _ = path.write_text("time [ms],sensor [mm]\\n0,1.5\\n1,1.6\\n")
    ...     trace = cc.load_measured(path, {"slider.x": "sensor"}, t="time")
    >>> trace["slider.x"], trace.units
    (array([0.0015, 0.0016]), {'slider.x': 'm'})
    """
    checks = Checks()
    heads, cells = _cells(Path(path))
    known, own_units = zip(*map(_named, heads), strict=True) if heads else ((), ())
    if t is None and angle is None:
        t, angle = ("t" if "t" in known else None), ("angle" if "angle" in known else None)
    axes = {name: text for name, text in (("t", t), ("angle", angle)) if text is not None}
    if not axes:
        checks.add("t", f"or angle must name a column of the file{meant_or_known('time', known)}")
    taken = {_named(text)[0] for text in axes.values()}
    asked = {name: name for name in known if name not in taken} if columns is None else dict(columns)
    if not all(isinstance(text, str) for text in asked.values()):
        checks.add("columns", f"must name a column for each output, got {columns!r:.80}", wrong_type=True)
        checks.finish()
    found, units = {}, {}
    for name, text in [*axes.items(), *asked.items()]:
        column, given = _named(text)
        if known.count(column) != 1:
            several = "is in several columns" if column in known else "is no column"
            checks.add(name, f'{several} of the file: "{column}"{meant_or_known(column, known)}')
            continue
        index = known.index(column)
        wanted = {"t": "s", "angle": "rad"}[name] if name in axes else column_unit(name)
        scale, units[name] = _scale(checks, name, own_units[index], given, wanted)
        found[name] = scale * _numbers(checks, name, [row[index] for row in cells])
    checks.finish()
    if "angle" in axes:
        found["angle"] = np.unwrap(found["angle"])
    rest = {name: found[name] for name in asked}
    return Measured(rest, {name: units[name] for name in asked}, found.get("t"), found.get("angle"))


def _named(head: str) -> tuple[str, str | None]:
    """Name and unit of a column."""
    name, symbol = _HEAD.fullmatch(head).groups()  # type: ignore[union-attr]
    return name, symbol


def _scale(
    checks: Checks, name: str, of_file: str | None, given: str | None, wanted: str
) -> tuple[float, str]:
    """The factor to SI and the SI unit of a column, whose unit is in the file, given or both."""
    texts = [text.strip() for text in (given, of_file) if text is not None and text.strip()]
    if len(texts) == 2 and not si_unit(texts[1]):
        del texts[1]  # that of the file is not known, so that the one given counts
    read = []
    try:
        for text in texts:
            if text == "-" and wanted in ("", "-", "rad"):
                read.append((1.0, wanted or "-"))
            else:
                read.append((convert(f"1 {text}", wanted or "unit"), wanted or si_unit(text)))
    except UnitError as error:
        checks.add(name, str(error))
        return math.nan, ""
    if not read:
        needed = f"[{wanted}]" if wanted else "any unit, [-] for a plain number"
        checks.add(name, f"has no unit: write it behind the name, of {needed}")
    elif read[0] != read[-1]:
        checks.add(name, f"is in [{of_file}] in the file and in [{given}] in the argument")
    return read[0] if read else (math.nan, "")


def _cells(path: Path) -> tuple[list[str], list[list[str]]]:
    """The names and the lines of a CSV file."""
    try:
        lines = records.on_disk(path).read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise ArgumentError(f"{path} is no text in UTF-8: {error.reason}; save it as such") from None
    mark = next((sign for sign in ";\t" if lines and sign in lines[0]), ",")
    heads, *rows = list(csv.reader([line for line in lines if line.strip()], delimiter=mark)) or [[]]
    uneven = [number for number, row in enumerate(rows, start=2) if len(row) != len(heads)]
    if len(rows) < 2 or uneven:
        what = f"line {uneven[0]} has not {len(heads)} columns" if uneven else "it has not two such lines"
        raise ArgumentError(f"{path} is no table with a line of names and lines of numbers: {what}")
    if mark != ",":
        rows = [[cell.replace(",", ".") for cell in row] for row in rows]
    return heads, rows


def _numbers(checks: Checks, name: str, cells: Sequence[str]) -> Array:
    """A column of finite numbers, or NaN after adding a problem."""
    numbers = np.full(len(cells), math.nan)
    for index, cell in enumerate(cells):
        try:
            numbers[index] = float(cell)
        except ValueError:
            continue
    wrong = np.flatnonzero(~np.isfinite(numbers))
    if len(wrong):
        lines = listed([str(index + 2) for index in wrong], most=_MOST_NAMED)
        checks.add(name, f'must be finite numbers, got "{cells[wrong[0]]:.40}" (lines {lines})')
    return numbers
