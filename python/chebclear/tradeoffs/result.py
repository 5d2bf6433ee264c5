"""Results of a trade-off: costs, errors and horizons of every setting, as values, tables and files."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..base import files as records
from ..base.arguments import Checks, as_number
from ..base.prefixes import format_exact
from ..base.rows import Array
from ..base.shown import listed
from ..base.tables import format_number, format_table, markdown_table
from ..base.units import unit
from ..data.dataset import Dataset, numbered
from ..data.exports import Exports
from ..errors import ArgumentTypeError, UnknownNameError
from ..notices import Notice, WithNotices
from ..report import html
from ..report.document import Document, Table
from ..run.accuracy import HORIZON_PART
from ..run.names import column_index
from ..run.settings import Settings
from ..run.trajectory import Stats
from ..scene.columns import column_unit
from ..scene.scene import Scene
from . import recommendation as recommend
from .recommendation import Recommendation, TradeoffPoint, largest_error, power
from .report import tradeoff_document

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Most outputs shown one by one in a table; of more, only the worst is shown.
_SHOWN = 4


@dataclass(frozen=True, eq=False, repr=False)
class Tradeoff(WithNotices, html.Reported, records.Saved, Exports, kind="tradeoff"):
    """Accuracy against cost of one scene; ``result["rodas4", 1e-6]`` is that `TradeoffPoint`.

    Errors are differences from the run `reference`. Its own error is estimated by `check`, a run of another
    method with the same tolerance. A difference that is not above twice theirs is not a measurement of an
    error but a bound, shown with "≤". Errors are those of the solution of the equations, not of the model.

    Attributes
    ----------
    outputs : tuple[str, ...]
        Names of the outputs.
    ranges : Array
        Range of each output in its unit, shape (outputs,); 0 for one that is constant.
    t : Array
        Instants up to which largest errors are known [s], shape (instants,).
    points : tuple[TradeoffPoint, ...]
        The measured settings, by method and with falling tolerance, including failed runs.
    reference : TradeoffPoint
        The run that is used as the exact solution; its differences are zero.
    check : TradeoffPoint
        The run that checks it; its differences are the uncertainty of the reference.
    notices : tuple[Notice, ...]
        Warnings of the reference run.
    settings : Settings
        Settings of the reference.
    scene : Scene
        The simulated mechanism.
    """

    horizon_part: ClassVar[float] = HORIZON_PART

    outputs: tuple[str, ...]
    ranges: Array
    t: Array = field(metadata=unit("s"))
    points: tuple[TradeoffPoint, ...]
    reference: TradeoffPoint
    check: TradeoffPoint
    notices: tuple[Notice, ...]
    settings: Settings
    scene: Scene

    def _repr_html_(self) -> str:
        return html.fragment(self.describe_reference(), [Table("Accuracy against cost", *self.cells())])

    def __repr__(self) -> str:
        start = f"from t = {self.t[0]:g} s " if self.t[0] else ""
        names = listed(self.outputs, most=4)
        return f"<Tradeoff: {len(self.points)} runs {start}to t = {self.end:g} s, {names}>"

    def __getitem__(self, setting: tuple[str, float]) -> TradeoffPoint:
        pair = setting if isinstance(setting, tuple) and len(setting) == 2 else ("", None)
        method, rtol = pair[0], as_number(pair[1])
        for point in self.points:
            if point.method == str(method) and math.isclose(point.rtol, rtol or 0.0, rel_tol=1e-9):
                return point
        known = ", ".join(f'("{point.method}", {point.rtol:g})' for point in self.points)
        raise UnknownNameError(f"{method} was not run at rtol {pair[1]!r}; there are {known}")

    def __iter__(self) -> Iterator[TradeoffPoint]:
        return iter(self.points)

    def __len__(self) -> int:
        return len(self.points)

    @property
    def duration(self) -> float:
        """Time from the first sample to the last [s]; what was skipped does not count."""
        return float(self.t[-1] - self.t[0])

    @property
    def end(self) -> float:
        """Instant of the last sample [s]."""
        return float(self.t[-1])

    @property
    def trusted_until(self) -> float:
        """Time until which the two accurate runs agree within 1 % of the range of every output [s]."""
        return min(float(self.check.horizon.min()), self.end)

    def error(self, point: TradeoffPoint, output: str, until: float | None = None) -> float:
        """Largest difference of a run from the reference.

        Parameters
        ----------
        point : TradeoffPoint
            One of `points`.
        output : str
            Name of the output.
        until : float, optional
            End of the time that counts [s]; all of it if not given.

        Returns
        -------
        float
            In the unit of the output; NaN if the run ended before.
        """
        if not isinstance(point, TradeoffPoint):
            raise ArgumentTypeError(f"point must be one of points, got {point!r}")
        if until is not None:
            checks = Checks()
            until = checks.real("until", until, "s", least=0.0)
            checks.finish()
        return float(largest_error(self.t, point.growth, until)[column_index(self.outputs, output)])

    def uncertainty(self, output: str, until: float | None = None) -> float:
        """Largest difference of the two accurate runs, the uncertainty of the reference; as `error`."""
        return self.error(self.check, output, until)

    def recommendation(
        self,
        accuracy: float | Mapping[str, float] = 1e-3,
        *,
        until: float | None = None,
        cost: str = "seconds",
    ) -> Recommendation:
        """The cheapest setting that is accurate enough; ``"auto"`` if it costs the same.

        A setting qualifies if its difference from the reference and the uncertainty of the reference together
        are within the accuracy for every output, and if that holds for every smaller tolerance of the same
        method as well: where errors scatter, a single small one may be chance.

        Parameters
        ----------
        accuracy : float or mapping of str to float
            Largest error relative to the range of each output [-], at most 1, constant outputs aside; or the
            largest error of the outputs by name, in their units, at most their ranges.
        until : float, optional
            End of the time that counts [s], an instant of `t`; if not given, as far as the reference itself
            is known to a quarter of the accuracy.
        cost : {"seconds", "steps", "stages", "evaluations"}
            The quantity to minimize. Seconds depend on the machine; a stage of a Rosenbrock method and one of
            an explicit method are not the same work.

        Returns
        -------
        Recommendation
            Its ``str`` is one line; its `point` is None if no setting is accurate enough.

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong; all problems are listed.
        """
        return recommend.recommendation(self, accuracy, until=until, cost=cost)

    def table(self) -> str:
        """The results as a Markdown table: a row for each run; of many outputs only the worst error."""
        return markdown_table(*self.cells())

    def __str__(self) -> str:
        return f"{self.describe_reference()}\n{format_table(*self.cells())}"

    def describe_reference(self) -> str:
        """One sentence on what the errors were measured against and how far that is known."""
        pair = f"{self.reference.method} and {self.check.method} at rtol {power(self.reference.rtol)}"
        differences = ", ".join(
            f"{name} by {_with_unit(self.uncertainty(name), name)}" for name in self._shown_outputs()
        )
        least = min(self.check.horizon)
        until = (
            "within 1 % of every range to the end"
            if math.isinf(least)
            else f"within 1 % of every range up to {format_exact(least, 's')}: no error is known beyond"
        )
        return f"Reference: {pair} agree {until}; they differ in {differences}."

    def hardest_outputs(self, most: int) -> list[str]:
        """At most so many outputs whose errors are the largest for their ranges, in their order."""
        finished = [point.growth[:, -1] for point in self.points if np.all(np.isfinite(point.growth[:, -1]))]
        # The geometric mean over the runs, in which a loose tolerance counts no more than a tight one.
        errors = np.array(finished or [self.check.growth[:, -1]])
        scale = np.where(self.ranges > 0.0, self.ranges, math.inf)
        sizes = np.mean(np.log(np.maximum(errors / scale, np.finfo(float).tiny)), axis=0)
        chosen = sorted(np.argsort(-sizes, kind="stable")[:most])
        return [self.outputs[index] for index in chosen]

    def _shown_outputs(self) -> list[str]:
        """All outputs, or of many the one in which the tight runs differ most for its range."""
        if len(self.outputs) <= _SHOWN:
            return list(self.outputs)
        return [self.outputs[_worst(largest_error(self.t, self.check.growth, None), self.ranges)]]

    def cells(self) -> tuple[list[str], list[list[str]]]:
        """Header and rows of the table, as text."""
        spans = [self.end]
        if self.t[0] < self.trusted_until < self.end:
            # The last instant at which the outputs still agree.
            before = int(np.searchsorted(self.t, self.trusted_until)) - 1
            spans.insert(0, float(self.t[max(before, 0)]))
        few = len(self.outputs) <= _SHOWN
        failures = any(not point.success for point in self.points)
        head = ["method", "rtol", "steps", "rejected", "stages", "evaluations", "events", "time [ms]"]
        for span in spans:
            when = "" if span == self.end else f" to {format_exact(span, 's')}"
            if few:
                head += [f"{name} [{column_unit(name)}]{when}" for name in self.outputs]
            head.append(f"worst [% of range]{when}")
            if not few:
                head.append("which is")
        head += ["horizon [ms]", *(["status"] if failures else [])]
        return head, [self._row(point, spans, few, failures) for point in self.points]

    def _row(self, point: TradeoffPoint, spans: list[float], few: bool, failures: bool) -> list[str]:
        stats = point.stats
        counts = (stats.steps, stats.rejected, stats.stages, stats.evaluations, stats.events)
        row = [point.method, power(point.rtol), *map(str, counts), format_number(1e3 * point.seconds, 2)]
        for span in spans:
            errors = largest_error(self.t, point.growth, span)
            uncertain = largest_error(self.t, self.check.growth, span)
            if few:
                row += [format_error(*pair) for pair in zip(errors, uncertain, strict=True)]
            worst = _worst(errors, self.ranges)
            scale = self.ranges[worst] / 100.0 or math.nan
            row.append(format_error(errors[worst] / scale, uncertain[worst] / scale))
            if not few:
                row.append("-" if math.isnan(errors[worst]) else self.outputs[worst])
        least = float(point.horizon.min())
        row.append(f"> {1e3 * point.end_time:.3g}" if math.isinf(least) else f"{1e3 * least:.3g}")
        if failures:
            row.append("done" if point.success else f"{point.status} at {format_exact(point.end_time, 's')}")
        return row

    def dataset(self) -> Dataset:
        """The columns of `to_dict` over ``setting``, as named arrays with units; see `Exports`."""
        units = {"rtol": "-", "seconds": "s"}
        units |= {f"error {name}": column_unit(name) for name in self.outputs}
        units |= {f"horizon {name}": "s" for name in self.outputs}
        return numbered("setting", self.to_dict(), units)

    def to_dict(self) -> dict[str, list[Any]]:
        """The table as columns of plain numbers and words, for a data frame.

        Returns
        -------
        dict of str to list
            Method, rtol [-], status, seconds [s], the counters [-] and for each output ``"error NAME"``
            (largest difference from the reference in its unit) and ``"horizon NAME"`` [s].
        """
        columns: dict[str, list[Any]] = {
            name: [getattr(point, name) for point in self.points]
            for name in ("method", "rtol", "status", "seconds")
        }
        for item in dataclasses.fields(Stats):
            columns[item.name] = [getattr(point.stats, item.name) for point in self.points]
        for index, name in enumerate(self.outputs):
            columns[f"error {name}"] = [float(point.growth[index, -1]) for point in self.points]
            columns[f"horizon {name}"] = [float(point.horizon[index]) for point in self.points]
        return columns

    def plot(self, output: str | None = None, *, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw cost against error of an output, the first if none is named; see `plot_tradeoff`."""
        from ..plots import costs as plot_costs

        return plot_costs.plot_tradeoff(self, output, ax=ax, **options)

    def _document(self, title: str | None) -> Document:
        return tradeoff_document(self, title)

    def _check_shapes(self) -> None:
        count = len(self.outputs)
        records.sound(self, ranges=(count,))
        for point in (*self.points, self.reference, self.check):
            records.sound(point, horizon=(count,), growth=(count, len(self.t)))
            if not 0.0 < point.rtol < math.inf:
                raise ValueError(f"rtol {point.rtol} is no tolerance")


def format_error(error: float, uncertainty: float) -> str:
    """An error with two digits, as a bound if it is not above twice the uncertainty of the reference.

    >>> format_error(3.14e-3, 1e-9), format_error(1e-9, 2e-9), format_error(float("nan"), 1e-9)
    ('0.0031', '≤ 3.0e-09', '-')
    """
    if error > 2.0 * uncertainty or math.isnan(error):
        return format_number(error, 2)
    return f"≤ {format_number(error + uncertainty, 2)}"


def _with_unit(value: float, output: str) -> str:
    return f"{format_number(value, 2)} {column_unit(output)}".rstrip()


def _worst(errors: Array, ranges: Array) -> int:
    """Where the error is largest for the range of the output; constant outputs come last."""
    relative = np.divide(errors, ranges, out=np.full(len(errors), -1.0), where=ranges > 0.0)
    return int(np.argmax(relative))
