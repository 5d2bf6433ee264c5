"""Bifurcation diagrams: the steady motion of a mechanism over one parameter, sampled once per period."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from concurrent.futures import CancelledError, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal, TypeVar, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base import files as records
from ..base.arguments import Checks
from ..base.named import is_pattern
from ..base.progress import Progress, is_request, reporter
from ..base.rows import Array
from ..base.units import unit
from ..data.dataset import Dataset, Variable
from ..data.exports import Exports
from ..errors import ArgumentError, warn
from ..execution.options import MOST_THREADS
from ..report import html
from ..report.document import Table
from ..run.settings import MOST_PERIODS, Settings, StepOptions, with_settings
from ..run.simulation import run_scene
from ..scene.columns import column_unit
from ..scene.parts import ClearanceRevolute
from ..scene.scene import Scene
from .spec import check_keywords

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GoOn = Callable[[float], None]
Result = TypeVar("Result")

# Values of a diagram [-].
_MOST_VALUES = 100_000


@dataclass(frozen=True, eq=False, repr=False)
class Bifurcation(Exports, records.Saved, kind="bifurcation"):
    """A bifurcation diagram: an output sampled once per period, for every value of a parameter.

    Attributes
    ----------
    parameter : str
        Name of the parameter.
    values : Array
        Its values [SI unit], shape (values,).
    output : str
        Name of the output.
    samples : Array
        The output once per period in its unit, shape (values, periods); NaN where a run failed.
    period : Array
        Time between samples [s], shape (values,).
    skipped : int
        Periods before the first sample [-].
    """

    _axes: ClassVar = {"values": ("values",), "samples": ("values", "periods"), "period": ("values",)}

    parameter: str
    values: Array
    output: str
    samples: Array
    period: Array = field(metadata=unit("s"))
    skipped: int = 0

    def __repr__(self) -> str:
        count, periods = self.samples.shape
        return f"<Bifurcation of {self.output} over {self.parameter}: {count} values, {periods} periods each>"

    def _repr_html_(self) -> str:
        unit = column_unit(self.output)
        rows = [
            [f"{value:.6g}", *(f"{end:.6g}" for end in (row.min(), row.max())), f"{period:.6g}"]
            for value, row, period in zip(self.values, self.samples, self.period, strict=True)
        ]
        head = [self.parameter, f"lowest [{unit}]", f"highest [{unit}]", "period [s]"]
        return html.fragment(repr(self)[1:-1], [Table(f"{self.output} once per period", head, rows)])

    def points(self, tolerance: float) -> NDArray[np.int64]:
        """Number of distinct points of each value of the parameter: of a periodic motion, its length.

        Parameters
        ----------
        tolerance : float
            Samples closer to each other than this count as one point; in the unit of the output, above 0.

        Returns
        -------
        ndarray of int, shape (values,)
            0 where the run failed.
        """
        checks = Checks()
        gap = checks.real("tolerance", tolerance, column_unit(self.output), above=0.0)
        checks.finish()
        jumps = np.diff(np.sort(self.samples, axis=1), axis=1) > gap
        known = np.isfinite(self.samples).all(axis=1)
        return np.where(known, 1 + jumps.sum(axis=1), 0)

    def plot(self, *, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw the diagram; see `plot_bifurcation` for the options."""
        from ..plots.bifurcations import plot_bifurcation

        return plot_bifurcation(self, ax=ax, **options)

    def dataset(self) -> Dataset:
        """The samples over the values of the parameter and the periods."""
        count, periods = self.samples.shape
        return Dataset(
            "sample",
            {
                "sample": Variable(("sample",), np.arange(count * periods), "-"),
                f"parameters.{self.parameter}": Variable(("sample",), np.repeat(self.values, periods)),
                self.output: Variable(("sample",), self.samples.ravel(), column_unit(self.output)),
                "period": Variable(("sample",), np.repeat(self.period, periods), "s"),
            },
            {"skipped": self.skipped},
        )


@with_settings(StepOptions)
def bifurcation(
    build: Callable[..., Scene],
    parameter: str,
    values: ArrayLike,
    output: str | None = None,
    *,
    settings: Settings | None = None,
    sample_per: Literal["period"] | float = "period",
    periods: int = 60,
    discard: int = 60,
    fixed: Mapping[str, Any] | None = None,
    threads: int | None = None,
    progress: bool | Progress | None = None,
    **options: Unpack[StepOptions],
) -> Bifurcation:
    """Simulate a mechanism at many values of one parameter and sample its steady motion once per period.

    If the motion has the period of the drive, all samples of a value coincide; after a period doubling there
    are two points, in chaos a cloud. The runs are simulated in parallel, each from its assembled start.

    Parameters
    ----------
    build : callable
        Called as ``build(**{parameter: value}, **fixed)``; returns the scene.
    parameter : str
        Name of the parameter.
    values : array_like
        Its values [SI unit].
    output : str, optional
        Name of the output to sample; the x eccentricity of the first clearance joint if not given.
    settings : Settings, optional
        How to simulate; each of the fields that follow may be given as a keyword as well, or instead. Its
        other fields are those of the periods and of the output.
    {settings}
    sample_per : "period" or float
        A sample for each revolution of the slowest drive, ``scene.period``; or the time between two samples
        [s].
    periods : int
        Number of samples of each run, minus one [-].
    discard : int
        Periods before the first sample, for the starting transient to decay [-].
    fixed : mapping of str to object, optional
        Further keywords of `build`, the same for all runs.
    threads : int, optional
        Number of simultaneous runs [-]; one for each processor if not given.
    progress : True or callable, optional
        True shows a bar, or lines where standard error is not a terminal; a callable gets the number of
        completed runs and that of all runs.

    Returns
    -------
    Bifurcation
        Runs that failed are NaN, and a warning counts them.

    Raises
    ------
    SceneError
        If a scene is wrong.
    ValueError, TypeError
        If an argument is wrong; all problems are listed.

    Examples
    --------
    >>> from chebclear import mechanisms
    >>> bifurcation(mechanisms.slider_crank, "clearance", [1e-5, 2e-5], periods=2, discard=0)
    <Bifurcation of wrist.eccentricity_x over clearance: 2 values, 3 periods each>
    """
    checks = Checks()
    given = _checked_values(checks, values)
    if not isinstance(parameter, str):
        checks.add("parameter", f"must be the name of a keyword of build, got {parameter!r}", wrong_type=True)
    constant = dict(checks.mapping("fixed", fixed, "values"))
    check_keywords(checks, build, [str(parameter)], constant)
    count = checks.whole("periods", periods, least=1, most=MOST_PERIODS)
    skipped = checks.whole("discard", discard, least=0, most=MOST_PERIODS)
    if is_pattern(output):
        checks.add("output", f"must be the name of one output, got the pattern {output!r}")
    if threads is not None:
        checks.whole("threads", threads, least=1, most=MOST_THREADS)
    if not is_request(progress):
        checks.add("progress", f"must be None, True or callable, got {progress!r}", wrong_type=True)
    per_period = isinstance(sample_per, str) and sample_per == "period"
    own_period = None if per_period else checks.real("sample_per", sample_per, "s", above=0.0)
    found = {"duration": 1.0, "samples": count + 1, "skip": 0.0, "outputs": None, "features": (), "cycles": 1}
    one = Settings.gathered(checks, settings, options, accepted=StepOptions.__annotations__, found=found)
    one = one.of_runs

    scenes = [build(**{parameter: float(value)}, **constant) for value in given]
    times = np.array([scene.period if own_period is None else own_period for scene in scenes])
    name = output
    if name is None:
        names = [joint.name for joint in scenes[0].joints if isinstance(joint, ClearanceRevolute)]
        if not names:
            raise ArgumentError("the scene has no clearance joint: name the output to sample")
        name = f"{names[0]}.eccentricity_x"
    each = [
        replace(one, duration=count * time, skip=skipped * time, outputs=(name,)).fitted(scene.check())
        for scene, time in zip(scenes, times.tolist(), strict=True)
    ]

    def sampled(index: int, go_on: GoOn) -> Array:
        run = run_scene(scenes[index], each[index], go_on)
        return np.where(run.success, run[name], np.nan)

    columns: Array = np.array(in_threads(sampled, len(scenes), threads, progress))
    failed = np.flatnonzero(~np.isfinite(columns).all(axis=1))
    if len(failed):
        warn(
            f"{len(failed)} of {len(given)} runs failed and are NaN, the first at {parameter} = "
            f"{given[failed[0]]:g}: simulate that scene to see why"
        )
    return Bifurcation(parameter, given, name, columns, times, skipped)


def _checked_values(checks: Checks, values: ArrayLike) -> Array:
    """The values of the parameter, shape (values,)."""
    given = np.asarray(values)
    if given.ndim != 1 or not 1 <= len(given) <= _MOST_VALUES or given.dtype.kind not in "iuf":
        text = f"must be a list of 1 to {_MOST_VALUES} numbers, got {values!r}"
        checks.add("values", text, wrong_type=True)
    elif not np.isfinite(given).all() or np.ma.is_masked(values):
        checks.add("values", "must be finite, none of them masked")
    return given.astype(float) if given.dtype.kind in "iuf" else np.zeros(0)


def in_threads(
    one: Callable[[int, GoOn], Result], count: int, threads: int | None, progress: bool | Progress | None
) -> list[Result]:
    """What a function returns for each number below `count`, called in threads.

    It also gets a function for its simulations to call, which ends them where the user interrupts.
    """
    stop = threading.Event()

    def go_on(share: float) -> None:
        if stop.is_set():
            raise CancelledError("the sweep was interrupted")

    results = []
    with ThreadPoolExecutor(threads) as pool, reporter(progress, "study") as report:
        try:
            for done, result in enumerate(pool.map(lambda index: one(index, go_on), range(count)), start=1):
                results.append(result)
                if report is not None:
                    report(done, count)
        except BaseException:
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return results
