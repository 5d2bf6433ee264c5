"""Accuracy against cost on a scene of one's own: methods and tolerances against two tight runs."""

from __future__ import annotations

import dataclasses
import json
import math
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import recommend, records
from .accuracy import chaos_horizon, output_ranges
from .checks import Checks
from .errors import SimulationError
from .plot import column_unit
from .progress import bar, is_request
from .recommend import Recommendation, in_words, largest_error, power
from .report import format_number, format_table, markdown_table
from .scene import Scene
from .simulation import (
    LEAST_RTOL,
    MAX_EVENTS,
    MAX_STEPS,
    METHODS,
    MOST_RTOL,
    Settings,
    Stats,
    Trajectory,
    column_index,
    run_scene,
    warn_once,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Progress = Callable[[int, int], None]

RTOLS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
REFERENCE_RTOL = 1e-12
# Two methods of different order and tableau. Both keep their tolerance where a friction law has kinks, which
# the explicit method does not always (docs/decisions.md), and differ by 4e-10 m/s of 22 m/s on the paper's
# mechanism as printed and by 2e-7 m/s on the corrected one; tighter tolerances only add rounding.
REFERENCE_METHODS = ("rodas5p", "rodas4")
# Instants up to which largest errors are kept: fine enough for a horizon, small beside the samples.
_INSTANTS = 241
# Outputs shown one by one in a table; of more only the worst.
_SHOWN = 4


@dataclass(frozen=True, eq=False, repr=False)
class TradeoffPoint(records.ArrayRecord):
    """What one method costs and delivers at one tolerance."""

    method: str
    """Integrator."""
    rtol: float
    """Relative tolerance of the integrator [-]."""
    status: str
    """``"done"``, or the word for why the run ended early."""
    end_time: float
    """Where the run ended [s]."""
    stats: Stats
    """What the run cost, in counts that do not depend on the machine."""
    seconds: float
    """What the run cost on this machine, the best of the repeats [s]."""
    horizon: Array
    """First sample that is off the reference by more than 1 % of the range [s], shape (outputs,)."""
    growth: Array
    """Largest difference from the reference up to each instant in the unit of the output.

    The shape is (outputs, instants); NaN after the end of a run that failed.
    """

    @property
    def success(self) -> bool:
        """Whether the run reached its end."""
        return self.status == "done"


@dataclass(frozen=True, eq=False, repr=False)
class Tradeoff(records.ArrayRecord):
    """Accuracy against cost of one scene; ``result["rodas4", 1e-6]`` is that `TradeoffPoint`.

    Errors are differences from the run `reference`, which has an error itself: `check`, a run of another
    method as tight, tells how much. A difference that is not above twice theirs is no measurement of an
    error, only a bound, shown with "≤". All of it is about the solution of the equations, not of the model.
    """

    outputs: tuple[str, ...]
    """Names of the outputs."""
    ranges: Array
    """Range of each output in its unit, shape (outputs,); 0 for one that is constant."""
    t: Array
    """Instants up to which largest errors are known [s], shape (instants,)."""
    points: tuple[TradeoffPoint, ...]
    """What was measured, by method and from loose to tight; failed runs are in it."""
    reference: TradeoffPoint
    """The run that stands for the truth; its differences are zero."""
    check: TradeoffPoint
    """The run that checks it; its differences are the uncertainty of the reference."""
    warnings: tuple[str, ...]
    """What the core warned of in the reference run."""
    settings: Settings
    """How the reference was simulated."""
    scene: Scene
    """What was simulated."""

    def __repr__(self) -> str:
        return f"<Tradeoff: {len(self.points)} runs to t = {self.duration:g} s, {', '.join(self.outputs)}>"

    def __getitem__(self, setting: tuple[str, float]) -> TradeoffPoint:
        method, rtol = setting
        for point in self.points:
            if point.method == method and math.isclose(point.rtol, rtol, rel_tol=1e-9):
                return point
        raise KeyError(f"{method} was not run at rtol {rtol!r}")

    def __iter__(self) -> Iterator[TradeoffPoint]:
        return iter(self.points)

    def __len__(self) -> int:
        return len(self.points)

    @property
    def duration(self) -> float:
        """Simulated time [s]."""
        return float(self.t[-1])

    @property
    def trusted_until(self) -> float:
        """Until when the two tight runs agree within 1 % of the range of every output [s]."""
        return min(float(self.check.horizon.min()), self.duration)

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
        return float(largest_error(self.t, point.growth, until)[column_index(self.outputs, output)])

    def uncertainty(self, output: str, until: float | None = None) -> float:
        """Largest difference of the two tight runs; see `error`."""
        return self.error(self.check, output, until)

    def recommendation(
        self,
        accuracy: float | Mapping[str, float] = 1e-3,
        *,
        until: float | None = None,
        cost: str = "seconds",
    ) -> Recommendation:
        """The cheapest setting that is accurate enough.

        A setting counts if its difference from the reference and the uncertainty of the reference together
        are within the accuracy for every output, and if that holds for every tighter tolerance of the same
        method as well: where errors scatter, a single hit is luck.

        Parameters
        ----------
        accuracy : float or mapping of str to float
            Largest error relative to the range of each output [-], constant outputs aside; or the largest
            error of the outputs by name, in their units.
        until : float, optional
            End of the time that counts [s]; if not given, as far as the reference itself is known to a
            quarter of the accuracy.
        cost : {"seconds", "steps", "stages", "evaluations"}
            What is to be small. Seconds depend on the machine; a stage of a Rosenbrock method and one of an
            explicit method are not the same work.

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
        """The results as a Markdown table: one row a run, with costs, errors and horizons.

        Returns
        -------
        str
            Without a final line break. Of more than four outputs only the worst error is shown.
        """
        return markdown_table(*self._cells())

    def __str__(self) -> str:
        return f"{self.describe_reference()}\n{format_table(*self._cells())}"

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
            else f"within 1 % of every range up to {in_words(least)}: no error is known beyond"
        )
        return f"Reference: {pair} agree {until}; they differ in {differences}."

    def _shown_outputs(self) -> list[str]:
        """All outputs, or of many the one in which the tight runs differ most for its range."""
        if len(self.outputs) <= _SHOWN:
            return list(self.outputs)
        return [self.outputs[_worst(largest_error(self.t, self.check.growth, None), self.ranges)]]

    def _cells(self) -> tuple[list[str], list[list[str]]]:
        """Header and rows of the table."""
        spans = [self.duration]
        if self.t[0] < self.trusted_until < self.duration:
            spans.insert(0, self._instant_before(self.trusted_until))
        few = len(self.outputs) <= _SHOWN
        failures = any(not point.success for point in self.points)
        head = ["method", "rtol", "steps", "rejected", "stages", "evaluations", "events", "time [ms]"]
        for span in spans:
            when = "" if span == self.duration else f" to {in_words(span)}"
            if few:
                head += [f"{name} [{column_unit(name)}]{when}" for name in self.outputs]
            head.append(f"worst [% of range]{when}")
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
        least = float(point.horizon.min())
        row.append(f"> {1e3 * point.end_time:.3g}" if math.isinf(least) else f"{1e3 * least:.3g}")
        if failures:
            row.append("done" if point.success else f"{point.status} at {in_words(point.end_time)}")
        return row

    def _instant_before(self, time: float) -> float:
        """The last instant at which the outputs still agree, if they part at this time."""
        return float(self.t[max(int(np.searchsorted(self.t, time)) - 1, 0)])

    def to_dict(self) -> dict[str, list[Any]]:
        """The table as columns of plain numbers and words, as a data frame wants them.

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
        for field in dataclasses.fields(Stats):
            columns[field.name] = [getattr(point.stats, field.name) for point in self.points]
        for index, name in enumerate(self.outputs):
            columns[f"error {name}"] = [float(point.growth[index, -1]) for point in self.points]
            columns[f"horizon {name}"] = [float(point.horizon[index]) for point in self.points]
        return columns

    def plot(self, output: str | None = None, *, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw cost against error, one line a method; see `plot_tradeoff` for the options.

        Parameters
        ----------
        output : str, optional
            Name of the output; the first one if not given.
        ax : Axes, optional
            Where to draw; a new figure if not given.
        **options
            Passed to `plot_tradeoff`.

        Returns
        -------
        Axes
        """
        from . import plot_costs

        return plot_costs.plot_tradeoff(self, output, ax=ax, **options)

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write everything to one compressed ``.npz`` file.

        Parameters
        ----------
        path : path
            Where to; ``.npz`` is appended if it is missing.

        Returns
        -------
        Path
            The file written.
        """
        runs = [*self.points, self.reference, self.check]
        arrays = {
            "t": self.t,
            "ranges": self.ranges,
            "horizon": np.stack([point.horizon for point in runs]),
            "growth": np.stack([point.growth for point in runs]),
        }
        named = ("method", "rtol", "status", "end_time", "seconds")
        facts = {
            "outputs": self.outputs,
            "runs": [
                {name: getattr(point, name) for name in named} | {"stats": dataclasses.asdict(point.stats)}
                for point in runs
            ],
            "warnings": self.warnings,
            "settings": dataclasses.asdict(self.settings),
            "scene": json.loads(self.scene.to_json()),
        }
        return records.save(path, "tradeoff", arrays, facts)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Tradeoff:
        """Read what `save` wrote.

        Parameters
        ----------
        path : path
            The file.

        Returns
        -------
        Tradeoff

        Raises
        ------
        ValueError
            If the file holds something else.
        """
        arrays, facts = records.load(path, "tradeoff")
        *points, reference, check = (
            TradeoffPoint(
                **{**run, "stats": Stats(**run["stats"])},
                horizon=arrays["horizon"][index],
                growth=arrays["growth"][index],
            )
            for index, run in enumerate(facts["runs"])
        )
        return cls(
            outputs=tuple(facts["outputs"]),
            ranges=arrays["ranges"],
            t=arrays["t"],
            points=tuple(points),
            reference=reference,
            check=check,
            warnings=tuple(facts["warnings"]),
            settings=Settings.from_dict(facts["settings"]),
            scene=Scene.from_json(json.dumps(facts["scene"])),
        )


def format_error(error: float, uncertainty: float) -> str:
    """An error with two digits, as a bound if it is not above twice the uncertainty of the reference.

    Examples
    --------
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


def tradeoff(
    scene: Scene,
    duration: float,
    samples: int,
    outputs: Sequence[str] | None = None,
    *,
    methods: Sequence[str] | None = None,
    rtols: Sequence[float] = RTOLS,
    reference_rtol: float = REFERENCE_RTOL,
    repeats: int = 3,
    max_steps: int = MAX_STEPS,
    max_events: int = MAX_EVENTS,
    progress: bool | Progress | None = None,
) -> Tradeoff:
    """Measure accuracy against cost: simulate with many settings and compare with a tight run.

    Parameters
    ----------
    scene : Scene
        What to simulate. For a study see `Study.tradeoff`.
    duration : float
        Simulated time [s], above 0.
    samples : int
        Number of equally spaced samples, both ends included [-]. Errors are measured at the samples.
    outputs : sequence of str, optional
        Names of the outputs of interest; all columns but the contact states if not given.
    methods : sequence of str, optional
        Integrators; all of them if not given.
    rtols : sequence of float
        Relative tolerances [-], each at least ten times `reference_rtol`.
    reference_rtol : float
        Relative tolerance of the reference and of the run that checks it [-].
    repeats : int
        How often each setting is run to find its least time [-].
    max_steps, max_events : int
        Accepted steps and changes of contact after which a measured run is given up [-]; the two tight runs
        have the usual limits.
    progress : True or callable, optional
        True shows a bar if standard error is a terminal; a callable gets the runs done and the runs in all.

    Returns
    -------
    Tradeoff
        Runs that fail are in it with their status.

    Raises
    ------
    SceneError
        If the scene is wrong; all problems are listed.
    SimulationError
        If one of the two tight runs fails: there is nothing to compare with.
    ValueError, TypeError
        If another argument is wrong; all problems are listed.

    Examples
    --------
    >>> from chebclear import mechanisms, tradeoff
    >>> result = tradeoff(
    ...     mechanisms.slider_crank(), 2e-3, 51, ["slider.vx"], rtols=[1e-4, 1e-6], repeats=1
    ... )
    >>> result.error(result["rodas4", 1e-6], "slider.vx") < result.error(result["rodas4", 1e-4], "slider.vx")
    True
    """
    checks = Checks()
    if not isinstance(scene, Scene):
        checks.add(f"scene must be a Scene, got {scene!r}; a Study has the method tradeoff", wrong_type=True)
    settings = Settings.checked(
        checks,
        duration=duration,
        samples=samples,
        rtol=reference_rtol,
        method=REFERENCE_METHODS[0],
        outputs=outputs,
        max_steps=max_steps,
        max_events=max_events,
        position_tolerance=None,
        velocity_tolerance=None,
    )
    names = _checked_list(checks, "methods", METHODS if methods is None else methods)
    names = [checks.word("methods", name, METHODS) for name in names]
    tolerances = _checked_tolerances(checks, rtols, settings.rtol)
    count = checks.whole("repeats", repeats, least=1, most=1000)
    if not is_request(progress):
        checks.add(f"progress must be None, True or callable, got {progress!r}", wrong_type=True)
    checks.finish()
    settings.require_outputs_of(scene)
    if settings.outputs is None:
        # A contact state is a yes or no: its error is 1 as soon as an impact falls between other samples.
        columns = tuple(name for name in scene.check().columns if not name.endswith(".contact"))
        settings = dataclasses.replace(settings, outputs=columns)

    choices = [
        dataclasses.replace(settings, method=method, rtol=rtol) for method in names for rtol in tolerances
    ]
    total = 2 + count * len(choices)
    with _reporter(progress) as report:
        done = iter(range(1, total + 1))

        def run(choice: Settings) -> tuple[Trajectory, float]:
            start = time.perf_counter()
            trajectory = run_scene(scene, choice)
            seconds = time.perf_counter() - start
            if report is not None:
                report(next(done), total)
            return trajectory, seconds

        tight = dataclasses.replace(settings, max_steps=MAX_STEPS, max_events=MAX_EVENTS)
        reference, reference_seconds = run(tight)
        _require_success(reference)
        check, check_seconds = run(dataclasses.replace(tight, method=REFERENCE_METHODS[1]))
        _require_success(check)
        warn_once(reference.warnings, stacklevel=3)
        ranges, thresholds = output_ranges(reference.columns, reference.values)
        kept = np.unique(np.linspace(0, len(reference.t) - 1, _INSTANTS).round().astype(int))

        def measured(trajectory: Trajectory, seconds: float) -> TradeoffPoint:
            difference = trajectory.values - reference.values
            return TradeoffPoint(
                method=trajectory.settings.method,
                rtol=trajectory.settings.rtol,
                status=trajectory.status,
                end_time=trajectory.end_time,
                stats=trajectory.stats,
                seconds=seconds,
                horizon=chaos_horizon(reference.t, difference, thresholds),
                growth=np.maximum.accumulate(np.abs(difference), axis=0)[kept].T.copy(),
            )

        points = [measured(*run(choice)) for choice in choices]
        # In rounds, so that a machine that is busy for a while does not spoil all repeats of one setting.
        seconds = [point.seconds for point in points]
        for _ in range(count - 1):
            seconds = [min(best, run(choice)[1]) for best, choice in zip(seconds, choices, strict=True)]
        points = [
            dataclasses.replace(point, seconds=best) for point, best in zip(points, seconds, strict=True)
        ]
    return Tradeoff(
        outputs=reference.columns,
        ranges=ranges,
        t=reference.t[kept],
        points=tuple(points),
        reference=measured(reference, reference_seconds),
        check=measured(check, check_seconds),
        warnings=reference.warnings,
        settings=settings,
        scene=scene,
    )


def _checked_list(checks: Checks, name: str, given: object) -> list[Any]:
    if isinstance(given, str) or not isinstance(given, Iterable):
        checks.add(f"{name} must be a list, got {given!r}", wrong_type=True)
        return []
    values = list(given)
    if not values:
        checks.add(f"{name} must not be empty")
    for index, value in enumerate(values):
        if value in values[:index]:
            checks.add(f"{name} has {value!r} more than once")
    return values


def _checked_tolerances(checks: Checks, rtols: object, reference_rtol: float) -> list[float]:
    """The tolerances, from loose to tight."""
    tolerances = [
        checks.real(f"rtols[{index}]", rtol, "-", least=LEAST_RTOL, most=MOST_RTOL)
        for index, rtol in enumerate(_checked_list(checks, "rtols", rtols))
    ]
    # A reference as loose as what it judges judges nothing; 9 and not 10 for the sake of rounding.
    tight = [rtol for rtol in tolerances if rtol < 9.0 * reference_rtol]
    if tight:
        checks.add(f"rtols must be at least 10 times reference_rtol = {power(reference_rtol)}, got {tight}")
    return sorted(tolerances, reverse=True)


def _require_success(run: Trajectory) -> None:
    if not run.success:
        message = (
            f"{run.message}, in the reference run ({run.settings.method}, rtol "
            f"{power(run.settings.rtol)}); a shorter duration or a looser reference_rtol may help"
        )
        error = SimulationError(run.status, run.end_time, run.joint, message=message)
        error.trajectory = run
        raise error


@contextmanager
def _reporter(progress: bool | Progress | None) -> Iterator[Callable[[int, int], None] | None]:
    if callable(progress):
        yield progress
    elif progress:
        with bar("tradeoff", "runs") as report:
            yield report
    else:
        yield None
