"""Comparison of the bounds of two studies, as in Table 3 of the paper."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..base import files
from ..base.arguments import Checks
from ..base.named import Named
from ..base.rows import Array
from ..base.shown import shortened
from ..base.units import unit
from ..data.dataset import Dataset, numbered
from ..data.exports import Exports
from ..report import html
from ..report.document import Items, Table
from ..run.names import column_index
from .band.band import Band
from .differences import differences
from .results import StudyResult


@dataclass(frozen=True, eq=False, repr=False)
class BoundErrors(files.ArrayRecord):
    """Differences between the bounds of one output and reference bounds, over a span of time.

    Attributes
    ----------
    lower : float
        Relative difference of the root mean squares of the lower bounds [-].
    upper : float
        Relative difference of the root mean squares of the upper bounds [-].
    width : float
        Largest width of the band in the unit of the output.
    reference_width : float
        Largest width of the reference band in the unit of the output.
    slack : float
        Largest width of the band minus that of the reference, relative to the latter [-].
    unit : str
        Unit of the output; empty if it is not known.
    largest : float
        Largest difference of a bound from that of the reference at an instant, over the range of the output
        in the reference, from the lowest of its bounds to the highest [-].
    """

    lower: float
    upper: float
    width: float
    reference_width: float
    slack: float
    unit: str = ""
    largest: float = math.nan


_FIELDS = tuple(item.name for item in dataclasses.fields(BoundErrors))


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(files.Saved, Named[BoundErrors], Exports, kind="comparison"):
    """Comparison of two studies; ``comparison["slider.vx"]`` holds the `BoundErrors` of that output.

    Its exports have a row for each output. The unit of the widths is in a column of its own, since every
    output has another.

    Attributes
    ----------
    errors : dict[str, BoundErrors]
        Errors of each output by name.
    start : float
        First instant compared [s].
    end : float
        Last instant compared [s].
    differences : tuple[str, ...]
        What differs between the studies besides the method: mechanism, intervals, tolerance and so on.
    """

    errors: dict[str, BoundErrors]
    start: float = field(metadata=unit("s"))
    end: float = field(metadata=unit("s"))
    differences: tuple[str, ...] = ()

    @property
    def _names(self) -> tuple[str, ...]:
        return tuple(self.errors)

    def _entry(self, name: str) -> BoundErrors:
        column_index(list(self.errors), name)
        return self.errors[name]

    def __repr__(self) -> str:
        return "\n".join(shortened(str(self).splitlines()))

    def dataset(self) -> Dataset:
        """The fields of `BoundErrors`, a row for each output; see `Exports`."""
        columns = {"output": list(self.errors)}
        columns |= {name: [getattr(row, name) for row in self.errors.values()] for name in _FIELDS}
        data = numbered("row", columns, dict.fromkeys(("lower", "upper", "slack", "largest"), "-"))
        span: dict[str, str | int | float] = {"start": self.start, "end": self.end}
        return dataclasses.replace(data, facts=span | {"differences": "\n".join(self.differences)})

    def _repr_html_(self) -> str:
        table = Table("Differences between the bounds", *self._cells())
        return html.fragment(self._span(), [table, *([Items(self.differences)] if self.differences else [])])

    def _span(self) -> str:
        return f"bounds from t = {self.start:.6g} s to {self.end:.6g} s"

    def _cells(self) -> tuple[list[str], list[list[str]]]:
        head = ["output", "lower [%]", "upper [%]", "largest [%]", "width", "reference", "slack [%]"]
        rows = [
            [
                f"{name} [{row.unit}]" if row.unit else name,
                f"{100.0 * row.lower:.3f}",
                f"{100.0 * row.upper:.3f}",
                f"{100.0 * row.largest:.3f}",
                f"{row.width:.6g}",
                f"{row.reference_width:.6g}",
                f"{100.0 * row.slack:+.2f}",
            ]
            for name, row in self.errors.items()
        ]
        return head, rows

    def __str__(self) -> str:
        head, rows = self._cells()
        widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
        lines = [
            "  ".join([row[0].ljust(widths[0]), *map(str.rjust, row[1:], widths[1:])]).rstrip()
            for row in [head, *rows]
        ]
        return "\n".join([self._span(), *lines, *(f"differs: {text}" for text in self.differences)])


def compare(
    result: StudyResult, reference: StudyResult, start: float | None = None, end: float | None = None
) -> Comparison:
    """Compare the bounds of two studies as in the paper's Table 3.

    The relative error of a bound is ``|RMS(bound) - RMS(reference)| / RMS(reference)`` with the root mean
    square over time. It hides differences that cancel over time: `BoundErrors.largest` is the largest one.
    Studies of different mechanisms can be compared; what differs is in `Comparison.differences`.

    Parameters
    ----------
    result : StudyResult
        Usually of `Study.chebyshev`.
    reference : StudyResult
        Usually of `Study.scan`; at the same instants.
    start, end : float, optional
        Span of time [s], ends included; all of it if not given.

    Returns
    -------
    Comparison
        For the outputs of both studies. A relative number is NaN if the reference is zero at all times.

    Raises
    ------
    ValueError, TypeError
        If the instants differ, no output is in both, or no sample is in the span.

    Examples
    --------
    >>> import chebclear as cc
    >>> study = cc.Study(
    ...     cc.mechanisms.slider_crank,
    ...     {"rod_length": cc.Interval.around(0.12, rel=0.01)},
    ...     outputs=["slider.x"],
    ...     duration=0.005,
    ...     samples=21,
    ...     skip=0.03,
    ... )
    >>> errors = cc.compare(study.chebyshev(degree=2), study.scan(5))
    >>> errors["slider.x"].slack < 0.01
    True
    """
    checks = Checks()
    for name, given in (("result", result), ("reference", reference)):
        if not isinstance(given, StudyResult):
            wanted = "must be a StudyResult, as Study.chebyshev and Study.scan return"
            checks.add(name, f"{wanted}, got {given!r}", wrong_type=True)
    checks.finish()
    shared = [name for name in result if name in reference.outputs]
    if not shared:
        checks.add(
            "reference", f"has no output of the result: {list(reference.outputs)} and {list(result.outputs)}"
        )
        checks.finish()
    t = result.t
    first = float(t[0]) if start is None else checks.real("start", start, "s")
    last = float(t[-1]) if end is None else checks.real("end", end, "s")
    if first > last:
        checks.add("start", f"must be <= end, got start = {first!r} and end = {last!r}")
    # A margin, so that rounding does not exclude samples at the ends of the span.
    margin = 1e-9 * float(t[-1] - t[0])
    span = (t >= first - margin) & (t <= last + margin)
    if not span.any():
        checks.add(
            "start", f"and end have no sample between them; the samples are in [{t[0]:.6g}, {t[-1]:.6g}] s"
        )
    if not (t.shape == reference.t.shape and np.allclose(t, reference.t, rtol=0.0, atol=margin)):
        checks.add(
            "reference", "must have the instants of the result: the same duration and number of samples"
        )
    checks.finish()

    errors = {}
    for name in shared:
        band, other = result[name], reference[name]
        width, reference_width = float(band.width[span].max()), float(other.width[span].max())
        errors[name] = BoundErrors(
            lower=abs(_relative(root_mean_square(band.lower[span]), root_mean_square(other.lower[span]))),
            upper=abs(_relative(root_mean_square(band.upper[span]), root_mean_square(other.upper[span]))),
            width=width,
            reference_width=reference_width,
            slack=_relative(width, reference_width),
            unit=band.unit,
            largest=_largest(band, other, span),
        )
    return Comparison(errors, float(t[span][0]), float(t[span][-1]), tuple(differences(result, reference)))


def _largest(band: Band, reference: Band, span: NDArray[np.bool_]) -> float:
    """Largest difference of a bound at an instant, over the range of the reference."""
    pairs = [(band.lower[span], reference.lower[span]), (band.upper[span], reference.upper[span])]
    size = float(pairs[1][1].max() - pairs[0][1].min())
    return max(float(np.abs(own - other).max()) for own, other in pairs) / size if size > 0.0 else math.nan


def root_mean_square(values: Array) -> float:
    """Root mean square, in the unit of the values."""
    return math.sqrt(float(np.mean(values * values)))


def _relative(value: float, reference: float) -> float:
    return (value - reference) / reference if reference else math.nan
