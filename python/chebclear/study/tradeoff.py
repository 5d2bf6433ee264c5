"""Accuracy against cost of the bounds of a study: degrees, scan points and ways of bounding."""

from __future__ import annotations

import itertools
import math
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base import files as records
from ..base.arguments import Checks
from ..base.shown import listed, spoken
from ..base.tables import format_number, format_table, markdown_table
from ..base.units import unit
from ..data.dataset import Dataset, numbered
from ..data.exports import Exports
from ..errors import SimulationError
from ..run.trajectory import column_index
from .band.band import Band
from .polynomials.surrogate import MOST_RANGE_DEGREE, chebyshev_grid, tensor_grid
from .results import StudyResult
from .runner import Runner
from .runs import MOST_NODES, MOST_RUNS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

_MOST_CORNERS = 8  # parameters: 256 corners
# A run on the bound itself must not lie outside by rounding; part of the largest width.
_SLACK = 1e-9


@dataclass(frozen=True, eq=False, repr=False)
class StudyTradeoffPoint(records.ArrayRecord):
    """What one way of bounding costs and delivers; widths are relative to those of the reference."""

    bounds: str
    """``"interval"``: Eq. (31). ``"polynomial"``: the certified range of the polynomial. ``"sampled"``:
    extremes of the same runs. ``"scan"``: extremes of equally spaced runs."""
    degree: int | None
    """Degree in every parameter [-]; None for a scan."""
    points: int
    """Nodes or points of every parameter [-]."""
    runs: int
    """Simulations, the nominal one included [-]."""
    stages: int
    """Stages of the integrator in all runs together [-]."""
    seconds: float = field(metadata=unit("s"))
    """Time of the runs and the bounds on this machine with the threads of the study [s]."""
    status: str
    """``"done"``, or the word for why one of the runs failed."""
    width_error: Array
    """Relative error of the width, mean over time [-], shape (outputs,): positive if too wide."""
    containment: Array
    """Share of the samples of the hold-out runs that are within the bounds [-], shape (outputs,)."""
    escape: Array
    """Largest distance of a hold-out run from the bounds over the largest width [-], shape (outputs,)."""
    fit_error: Array
    """Largest error of the polynomial at the hold-out runs over the largest width [-]; NaN without one."""

    def __str__(self) -> str:
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
class StudyTradeoff(records.ArrayRecord, Exports):
    """Accuracy against cost of the bounds of a study.

    The reference is what all runs together reach: an inner bound, which `reference_change` judges.
    """

    outputs: tuple[str, ...]
    """Names of the outputs."""
    points: tuple[StudyTradeoffPoint, ...]
    """What was measured; settings that failed are in it."""
    holdout: int
    """Number of hold-out runs: random points and corners [-]."""
    reference_runs: int
    """Number of runs behind the reference [-]."""
    reference_width: Array
    """Mean width of the reference over time in the unit of each output, shape (outputs,)."""
    reference_change: Array
    """How much narrower half of these runs is, drawn at random [-], shape (outputs,): large if the runs are
    too few to know the range."""
    warnings: tuple[str, ...]
    """What the user was warned of in the hold-out runs."""

    def __repr__(self) -> str:
        return f"<StudyTradeoff: {len(self.points)} settings, {listed(self.outputs, most=4)}>"

    def __iter__(self) -> Iterator[StudyTradeoffPoint]:
        return iter(self.points)

    def __len__(self) -> int:
        return len(self.points)

    def recommendation(self, width_error: float = 0.1, containment: float = 0.99) -> StudyRecommendation:
        """The bounds with the fewest runs that are good enough for every output.

        Parameters
        ----------
        width_error : float
            Largest relative error of the width, too wide or too narrow [-].
        containment : float
            Least share of the samples of the hold-out runs within the bounds [-].

        Returns
        -------
        StudyRecommendation

        Raises
        ------
        ValueError, TypeError
            If an argument is wrong.
        """
        checks = Checks()
        checks.real("width_error", width_error, "-", above=0.0)
        checks.real("containment", containment, "-", least=0.0, most=1.0)
        checks.finish()
        good = [
            point
            for point in self.points
            if point.status == "done"
            # An output that does not change has no width to be wrong: its error is NaN.
            and not np.any(np.abs(point.width_error) > width_error)
            and np.all(point.containment >= containment)
        ]
        if not good:
            limits = f"widths within {100.0 * width_error:.3g} % and {100.0 * containment:.4g} % inside"
            text = f"no bounds measured have {limits} for every output"
            done = [point for point in self.points if point.status == "done"]
            if done:

                def excess(point: StudyTradeoffPoint) -> float:
                    """How many times one of the limits is missed."""
                    outside = 1.0 - float(np.min(point.containment))
                    allowed = max(1.0 - containment, 1.0 / self.holdout)
                    return max(float(np.max(_sizes(point.width_error))) / width_error, outside / allowed)

                text += f"; the nearest: {self._in_words(min(done, key=excess))}"
            return StudyRecommendation(None, text)
        best = min(good, key=lambda point: (point.runs, float(np.max(_sizes(point.width_error)))))
        return StudyRecommendation(best, self._in_words(best))

    def _in_words(self, point: StudyTradeoffPoint) -> str:
        """Bounds with their price and what they deliver for the output that they bound worst."""
        worst = int(np.argmax(_sizes(point.width_error)))
        kind = "narrow" if point.width_error[worst] < 0.0 else "wide"
        error = 100.0 * float(_sizes(point.width_error)[worst])
        inside = 100.0 * float(np.min(point.containment))
        return (
            f"{point} with {point.runs} runs: {self.outputs[worst]} {error:.2g} % too {kind} on average, "
            f"{inside:.4g} % of {self.holdout} hold-out runs inside, {format_number(point.seconds, 2)} s"
        )

    def table(self) -> str:
        """The results as a Markdown table: one row a setting.

        Returns
        -------
        str
            Without a final line break.
        """
        return markdown_table(*self._cells())

    def __str__(self) -> str:
        changes = ", ".join(
            f"{name} {100.0 * change:.2g} %"
            for name, change in zip(self.outputs, self.reference_change, strict=True)
        )
        head = (
            f"Reference: what {self.reference_runs} runs reach, an inner bound; half of them reach less by "
            f"{changes}. Hold-out: {self.holdout} runs."
        )
        return f"{head}\n{format_table(*self._cells())}"

    def _cells(self) -> tuple[list[str], list[list[str]]]:
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
            for column in range(len(self.outputs)):
                error = 100.0 * float(point.width_error[column])
                row.append("-" if math.isnan(error) else f"{error:+.2g}")
                inside = 100.0 * float(point.containment[column])
                row.append("-" if math.isnan(inside) else f"{inside:.2f}")
                row.append(format_number(100.0 * float(point.escape[column]), 2))
                row.append(format_number(100.0 * float(point.fit_error[column]), 2))
            rows.append([*row, point.status] if failures else row)
        return head, rows

    def dataset(self) -> Dataset:
        """The table as named arrays with units; see `Exports`.

        Returns
        -------
        Dataset
            The columns of `to_dict` over ``setting``.
        """
        return numbered("setting", self.to_dict(), {"seconds": "s"})

    def to_dict(self) -> dict[str, list[Any]]:
        """The table as columns of plain numbers and words, as a data frame wants them.

        Returns
        -------
        dict of str to list
            The fields of the points; those with one number an output as ``"width_error NAME"`` and so on [-].
        """
        plain = ("bounds", "degree", "points", "runs", "stages", "seconds", "status")
        columns: dict[str, list[Any]] = {
            name: [getattr(point, name) for point in self.points] for name in plain
        }
        for index, output in enumerate(self.outputs):
            for name in ("width_error", "containment", "escape", "fit_error"):
                columns[f"{name} {output}"] = [float(getattr(point, name)[index]) for point in self.points]
        return columns

    def plot(self, output: str | None = None, *, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw width errors against runs; see `plot_study_tradeoff`.

        Parameters
        ----------
        output : str, optional
            Name of the output; the first one if not given.
        ax : Axes, optional
            Where to draw; a new figure if not given.
        **options
            Passed to `plot_study_tradeoff`.

        Returns
        -------
        Axes
        """
        from ..plots import costs as plot_costs

        if output is not None:
            column_index(self.outputs, output)
        return plot_costs.plot_study_tradeoff(self, output, ax=ax, **options)


@dataclass
class _Setting:
    """One set of runs, with its bands if all of them succeeded."""

    degree: int | None
    points: int
    runs: int
    result: StudyResult | None
    seconds: float
    status: str

    @property
    def stages(self) -> int:
        return 0 if self.result is None else sum(stats.stages for stats in self.result.stats)


def measure(
    study: Runner, degrees: Iterable[int], points: Iterable[int], *, holdout: int, seed: int, max_runs: int
) -> StudyTradeoff:
    """Compare the bounds of a study; see `Study.tradeoff`."""
    probed, wanted = _checked(study, degrees, points, holdout, seed, max_runs)
    probes = study.run_points(probed, (holdout,), None)
    settings = [_run(study, degree, count) for degree, count in wanted]

    outputs = probes.outputs
    runs = {
        name: np.concatenate(
            [probes[name].runs, *(s.result[name].runs for s in settings if s.result is not None)]
        )
        for name in outputs
    }
    count = len(runs[outputs[0]])
    half = np.random.default_rng(seed).permutation(count)[: count // 2]
    reference = {name: (values.min(axis=0), values.max(axis=0)) for name, values in runs.items()}
    widths = np.array([np.mean(upper - lower) for lower, upper in reference.values()])
    halves = np.array([np.mean(np.ptp(values[half], axis=0)) for values in runs.values()])
    return StudyTradeoff(
        outputs=outputs,
        points=tuple(point for setting in settings for point in _points(setting, probes, reference, study)),
        holdout=len(probes.parameters),
        reference_runs=count,
        reference_width=widths,
        reference_change=_relative(widths - halves, widths),
        warnings=probes.warnings,
    )


def _checked(
    study: Runner, degrees: Iterable[int], points: Iterable[int], holdout: int, seed: int, max_runs: int
) -> tuple[Array, list[tuple[int | None, int]]]:
    """Hold-out points, and degree, if any, and points of every setting."""
    sides = list(study.intervals.values())
    checks = Checks()
    wanted: list[tuple[int | None, int]] = []
    for name, given, least, most in (
        ("degrees", degrees, 1, MOST_NODES - 1),
        ("points", points, 2, MOST_NODES),
    ):
        if isinstance(given, str) or not isinstance(given, Iterable):
            checks.add(f"{name} must be a list of whole numbers, got {given!r}", wrong_type=True)
            continue
        for index, value in enumerate(given):
            count = checks.whole(f"{name}[{index}]", value, least=least, most=most)
            wanted.append((count, count + 1) if name == "degrees" else (None, count))
    for _, count in wanted:
        if count ** len(sides) > MOST_RUNS:
            checks.add(
                f"a study must have at most {MOST_RUNS} runs, got {count}^{len(sides)}: leave out the "
                "higher degrees or the finer scans"
            )
    if not wanted:
        checks.add("degrees and points must not both be empty")
    checks.whole("holdout", holdout, least=2, most=MOST_RUNS)
    checks.whole("seed", seed, least=0)
    checks.whole("max_runs", max_runs, least=1)
    checks.finish()
    probed = _holdout_points(study, holdout, seed)
    runs = len(probed) + sum(count ** len(sides) for _, count in wanted)
    if runs > max_runs:
        raise ValueError(
            f"all settings and hold-out points are {runs} runs, more than max_runs = {max_runs}: leave out "
            f"the higher degrees or the finer scans, or allow them with max_runs={runs}"
        )
    return probed, wanted


def _holdout_points(study: Runner, count: int, seed: int) -> Array:
    """Random points of the box and its corners, shape (runs, parameters)."""
    sides = list(study.intervals.values())
    lower, upper = (np.array([getattr(side, end) for side in sides]) for end in ("lower", "upper"))
    points: Array = lower + (upper - lower) * np.random.default_rng(seed).random((count, len(sides)))
    if len(sides) > _MOST_CORNERS:
        return points
    corners = np.array(list(itertools.product(*zip(lower, upper, strict=True))))
    return np.concatenate([points, corners])


def _run(study: Runner, degree: int | None, count: int) -> _Setting:
    sides = list(study.intervals.values())
    counts = (count,) * len(sides)
    if degree is None:
        grid = tensor_grid([np.linspace(side.lower, side.upper, count) for side in sides])
    else:
        grid = chebyshev_grid(sides, counts)
    degrees = None if degree is None else (degree,) * len(sides)
    start = time.perf_counter()
    try:
        result, status = study.run_points(grid, counts, degrees, "eq31"), "done"
    except SimulationError as error:
        result, status = None, error.reason
    return _Setting(degree, count, len(grid) + 1, result, time.perf_counter() - start, status)


def _points(
    setting: _Setting, probes: StudyResult, reference: dict[str, tuple[Array, Array]], study: Runner
) -> Iterator[StudyTradeoffPoint]:
    """What each way of bounding makes of the same runs."""
    if setting.degree is None:
        ways: dict[str, Callable[[Band], tuple[Array, Array]]] = {"scan": _limits}
    else:
        ways = {"interval": _limits, "polynomial": _polynomial_limits, "sampled": _sampled_limits}
    unknown = np.full(len(reference), math.nan)
    fits = unknown if setting.result is None or setting.degree is None else np.empty(len(reference))
    if setting.result is not None and setting.degree is not None:
        for index, (name, (lower, upper)) in enumerate(reference.items()):
            fits[index] = _fit_error(setting.result[name], probes, np.max(upper - lower))
    for bounds, limits in ways.items():
        start = time.perf_counter()
        numbers = [unknown, unknown, unknown]
        if setting.result is not None:
            found = [limits(setting.result[name]) for name in reference]
            columns = [
                _judge(*pair, *reference[name], probes[name].runs)
                for name, pair in zip(reference, found, strict=True)
            ]
            numbers = [np.array(column) for column in zip(*columns, strict=True)]
        yield StudyTradeoffPoint(
            bounds=bounds,
            degree=setting.degree,
            points=setting.points,
            runs=setting.runs,
            stages=setting.stages,
            seconds=setting.seconds + (time.perf_counter() - start),
            status=setting.status,
            width_error=numbers[0],
            containment=numbers[1],
            escape=numbers[2],
            fit_error=unknown if bounds == "sampled" else fits,
        )


def _limits(band: Band) -> tuple[Array, Array]:
    return band.lower, band.upper


def _sampled_limits(band: Band) -> tuple[Array, Array]:
    return band.runs.min(axis=0), band.runs.max(axis=0)


def _polynomial_limits(band: Band) -> tuple[Array, Array]:
    """The certified range of the polynomial; NaN above the degree to which there is one."""
    surrogate = band.surrogate
    if surrogate is None or max(surrogate.degrees) > MOST_RANGE_DEGREE:
        return np.full(len(band.t), math.nan), np.full(len(band.t), math.nan)
    return surrogate.bounds()


def _fit_error(band: Band, probes: StudyResult, width: float) -> float:
    """Largest difference of polynomial and hold-out runs over a width [-]."""
    values = band.evaluate(**dict(zip(band.intervals, probes.parameters.T, strict=True)))
    return float(_relative(np.max(np.abs(values - probes[band.name].runs)), width))


def _judge(lower: Array, upper: Array, least: Array, most: Array, runs: Array) -> tuple[float, float, float]:
    """Width error, containment and escape of bounds against the reference and the hold-out runs [-]."""
    width = float(np.max(most - least))
    outside = np.maximum(lower - runs, runs - upper)
    mean = np.mean(most - least)
    return (
        float(_relative(np.mean(upper - lower) - mean, mean)),
        float(np.mean(outside <= _SLACK * width)),
        float(_relative(max(np.max(outside), 0.0), width)),
    )


def _sizes(errors: Array) -> Array:
    """Absolute values; 0 for what has none."""
    return np.nan_to_num(np.abs(errors), nan=0.0)


def _relative(difference: Any, scale: Any) -> Any:
    """The difference over the scale; NaN where the scale is zero."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(np.equal(scale, 0.0), math.nan, np.divide(difference, scale))
