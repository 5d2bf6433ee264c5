"""Cost and quality of the bounds of a study: a table, and the cheapest bounds that are good enough."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base import files as records
from ..base.arguments import Checks
from ..base.rows import Array
from ..base.shown import listed, spoken
from ..base.tables import format_number, format_table, markdown_table
from ..base.units import unit
from ..data.dataset import Dataset, numbered
from ..data.exports import Exports
from ..notices import Notice, WithNotices
from ..report import html
from ..report.document import Document, Table
from .report import costs_document

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Fields of a point with one value, and with one for each output.
_BY_POINT = ("bounds", "degree", "points", "runs", "stages", "seconds", "status")
_BY_OUTPUT = ("width_error", "containment", "escape", "fit_error")


@dataclass(frozen=True, eq=False, repr=False)
class StudyTradeoffPoint(records.ArrayRecord):
    """Cost and quality of one method of bounding; widths are relative to those of the reference.

    Attributes
    ----------
    bounds : str
        ``"interval"``: Eq. (31). ``"polynomial"``: the certified range of the polynomial. ``"sampled"``:
        extremes of the same runs. ``"scan"``: extremes of equally spaced runs. ``"band"``: that of
        `Study.band`.
    degree : int | None
        Degree in every parameter [-]; None without polynomials on Chebyshev roots.
    points : int
        Nodes or points of every parameter [-]; of a band its runs.
    runs : int
        Simulations, the nominal one included [-].
    stages : int
        Stages of the integrator in all runs together [-].
    seconds : float
        Time of the runs and the bounds on this machine with the threads of the study [s].
    status : str
        ``"done"``, or the word for why one of the runs failed.
    width_error : Array
        Relative error of the width, mean over time [-], shape (outputs,): positive if too wide.
    containment : Array
        Share of the samples of the hold-out runs that are within the bounds [-], shape (outputs,); NaN
        without bounds, as of a failed setting or of polynomials above degree 30.
    escape : Array
        Largest distance of a hold-out run from the bounds over the largest width [-], shape (outputs,).
    fit_error : Array
        Largest error of the polynomial at the hold-out runs over the largest width [-]; NaN without one.
    """

    bounds: str
    degree: int | None
    points: int
    runs: int
    stages: int
    seconds: float = field(metadata=unit("s"))
    status: str
    width_error: Array
    containment: Array
    escape: Array
    fit_error: Array

    def __str__(self) -> str:
        if self.bounds == "band":
            return "band"
        if self.degree is None:
            return f"scan of {self.points} points"
        return f"{self.bounds} bounds of degree {self.degree}"


@dataclass(frozen=True, eq=False, repr=False)
class StudyRecommendation(records.ArrayRecord):
    """The cheapest bounds that are good enough; its ``str`` is one line."""

    point: StudyTradeoffPoint | None
    """The setting; None if none of those measured is good enough."""
    text: str
    """One line."""

    def __str__(self) -> str:
        return self.text

    def __repr__(self) -> str:
        return spoken(self)


@dataclass(frozen=True, eq=False, repr=False)
class StudyTradeoff(WithNotices, html.Reported, records.Saved, Exports, kind="study tradeoff"):
    """Accuracy against cost of the bounds of a study.

    The reference is the hull of all runs together: an inner bound, whose quality `reference_change` shows.

    Attributes
    ----------
    outputs : tuple[str, ...]
        Names of the outputs.
    points : tuple[StudyTradeoffPoint, ...]
        The measured settings, including those that failed.
    holdout : int
        Number of hold-out runs: random points and corners [-].
    reference_runs : int
        Number of runs of the reference [-].
    reference_width : Array
        Mean width of the reference over time in the unit of each output, shape (outputs,).
    reference_change : Array
        Relative reduction of the width with a random half of these runs [-], shape (outputs,): large if there
        are too few runs for the range.
    notices : tuple[Notice, ...]
        Warnings of the hold-out runs.
    """

    outputs: tuple[str, ...]
    points: tuple[StudyTradeoffPoint, ...]
    holdout: int
    reference_runs: int
    reference_width: Array
    reference_change: Array
    notices: tuple[Notice, ...]

    def __repr__(self) -> str:
        return f"<StudyTradeoff: {len(self.points)} settings, {listed(self.outputs, most=4)}>"

    def __iter__(self) -> Iterator[StudyTradeoffPoint]:
        return iter(self.points)

    def __len__(self) -> int:
        return len(self.points)

    def recommendation(self, width_error: float = 0.25, containment: float = 0.99) -> StudyRecommendation:
        """The bounds with the fewest runs that are good enough for every output.

        Parameters
        ----------
        width_error : float
            Largest relative error of the width, too wide or too narrow [-].
        containment : float
            Least share of the samples of the hold-out runs within the bounds [-].

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong.
        """
        checks = Checks()
        width_error = checks.real("width_error", width_error, "-", above=0.0)
        containment = checks.real("containment", containment, "-", least=0.0, most=1.0)
        checks.finish()
        good = [
            point
            for point in self.points
            if point.status == "done"
            # A constant output has no width, and its error is NaN.
            and not np.any(np.abs(point.width_error) > width_error)
            and np.all(point.containment >= containment)
        ]
        if not good:
            limits = f"widths within {100.0 * width_error:.3g} % and {100.0 * containment:.4g} % inside"
            text = f"no bounds measured have {limits} for every output"
            bounded = [point for point in self.points if not np.any(np.isnan(point.containment))]
            if bounded:

                def excess(point: StudyTradeoffPoint) -> float:
                    """Largest ratio by which a limit is exceeded."""
                    outside = 1.0 - float(np.min(point.containment))
                    allowed = max(1.0 - containment, 1.0 / self.holdout)
                    return max(float(np.max(_sizes(point.width_error))) / width_error, outside / allowed)

                text += f"; the nearest: {self._in_words(min(bounded, key=excess))}"
            return StudyRecommendation(None, text)
        best = min(good, key=lambda point: (point.runs, float(np.max(_sizes(point.width_error)))))
        return StudyRecommendation(best, self._in_words(best))

    def _in_words(self, point: StudyTradeoffPoint) -> str:
        """Bounds with their cost, and their quality for the output that they bound worst."""
        worst = int(np.argmax(_sizes(point.width_error)))
        kind = "narrow" if point.width_error[worst] < 0.0 else "wide"
        error = 100.0 * float(_sizes(point.width_error)[worst])
        inside = 100.0 * float(np.min(point.containment))
        return (
            f"{point} with {point.runs} runs: {self.outputs[worst]} {error:.2g} % too {kind} on average, "
            f"{inside:.4g} % of the samples of {self.holdout} hold-out runs inside, "
            f"{format_number(point.seconds, 2)} s"
        )

    @property
    def changes(self) -> str:
        """The `reference_change` of each output, in words."""
        changes = zip(self.outputs, self.reference_change, strict=True)
        return ", ".join(f"{name} {100.0 * change:.2g} %" for name, change in changes)

    def table(self) -> str:
        """The results as a Markdown table, with one row for each setting."""
        return markdown_table(*self.cells())

    def _repr_html_(self) -> str:
        return html.fragment(
            f"Recommended: {self.recommendation()}", [Table("Bounds and cost", *self.cells())]
        )

    def __str__(self) -> str:
        head = (
            f"Reference: hull of {self.reference_runs} runs, an inner bound; that of half of them is "
            f"narrower by {self.changes}. Hold-out: {self.holdout} runs at random points and, with up to "
            "eight parameters, at the corners of the box, where more samples are outside."
        )
        chosen = f"Recommended: {self.recommendation()} (fewest runs for widths within 25 % and 99 % inside)"
        return f"{head}\n{format_table(*self.cells())}\n{chosen}"

    def cells(self) -> tuple[list[str], list[list[str]]]:
        """Head and rows of the table, in words."""
        head = ["bounds", "degree", "points", "runs", "stages", "time [s]"]
        for name in self.outputs:
            head += [f"{name} width error [%]", "inside [%]", "escape [%]", "fit error [%]"]
        failures = any(point.status != "done" for point in self.points)
        head += ["status"] if failures else []
        rows = []
        for point in self.points:
            degree = "-" if point.degree is None else str(point.degree)
            row = [point.bounds, degree, str(point.points), str(point.runs), str(point.stages)]
            row.append(format_number(point.seconds, 2))
            percents = 100.0 * np.array([getattr(point, name) for name in _BY_OUTPUT])
            for error, inside, *others in percents.T.tolist():
                row.append("-" if math.isnan(error) else f"{error:+.2g}")
                row.append("-" if math.isnan(inside) else f"{inside:.2f}")
                row += [format_number(other, 2) for other in others]
            rows.append([*row, point.status] if failures else row)
        return head, rows

    def dataset(self) -> Dataset:
        """The columns of `to_dict` over ``setting``, as named arrays with units; see `Exports`."""
        return numbered("setting", self.to_dict(), {"seconds": "s"})

    def to_dict(self) -> dict[str, list[Any]]:
        """The table as columns of plain numbers and words, for a data frame.

        Returns
        -------
        dict of str to list
            The fields of the points; those with one number for each output as ``"width_error NAME"`` and so
            on [-].
        """
        columns: dict[str, list[Any]] = {
            name: [getattr(point, name) for point in self.points] for name in _BY_POINT
        }
        for index, output in enumerate(self.outputs):
            for name in _BY_OUTPUT:
                columns[f"{name} {output}"] = [float(getattr(point, name)[index]) for point in self.points]
        return columns

    def _check_shapes(self) -> None:
        count = (len(self.outputs),)
        records.sound(self, reference_width=count, reference_change=count)
        for point in self.points:
            records.sound(point, **dict.fromkeys(_BY_OUTPUT, count))

    def _document(self, title: str | None) -> Document:
        return costs_document(self, title)

    def plot(self, output: str | None = None, *, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw width errors of an output, the first if none is named; see `plot_study_tradeoff`."""
        from ..plots import costs as plot_costs

        return plot_costs.plot_study_tradeoff(self, output, ax=ax, **options)


def _sizes(errors: Array) -> Array:
    """Absolute values; 0 for NaN."""
    return np.nan_to_num(np.abs(errors), nan=0.0)
