"""Accuracy against cost on a scene of one's own: methods and tolerances against two tight runs."""

from __future__ import annotations

import dataclasses
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any, Unpack

import numpy as np

from ..base.arguments import Checks
from ..base.progress import Progress, is_request, reporter
from ..errors import SimulationError
from ..notices import issue
from ..run.accuracy import chaos_horizon, output_ranges
from ..run.settings import (
    MAX_EVENTS,
    MAX_STEPS,
    METHODS,
    Settings,
    SpanOptions,
    checked_settings,
    with_settings,
)
from ..run.simulation import run_scene
from ..run.trajectory import Trajectory
from ..scene.scene import Scene
from .recommendation import TradeoffPoint, power
from .result import Tradeoff

# Default limit of the steps of a measured run: a second or two. A setting that needs more is not a candidate,
# and twenty of them would take hours.
MOST_MEASURED_STEPS = 1_000_000

RTOLS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
REFERENCE_RTOL = 1e-12  # ten times tighter adds rounding only
# Two methods of different order and tableau. Both keep their tolerance where a friction law has kinks, which
# the explicit method does not always (docs/decisions.md), and differ by 4e-10 m/s of 22 m/s on the paper's
# mechanism as printed and by 2e-7 m/s on the corrected one; tighter tolerances only add rounding.
REFERENCE_METHODS = ("rodas5p", "rodas4")
# Instants up to which largest errors are kept: fine enough for a horizon, small beside the samples.
_INSTANTS = 241


# Long because all its runs share a reference and a report of progress.
@with_settings(SpanOptions)
def tradeoff(
    scene: Scene,
    *,
    settings: Settings | None = None,
    outputs: Sequence[str] | None = None,
    methods: Sequence[str] | None = None,
    rtols: Sequence[float] = RTOLS,
    reference_rtol: float = REFERENCE_RTOL,
    repeats: int = 3,
    max_steps: int = MOST_MEASURED_STEPS,
    max_events: int = MAX_EVENTS,
    progress: bool | Progress | None = None,
    **options: Unpack[SpanOptions],
) -> Tradeoff:
    """Measure accuracy against cost: simulate with many settings and compare with an accurate run.

    Parameters
    ----------
    scene : Scene
        The mechanism. For a study see `Study.tradeoff`.
    settings : Settings, optional
        Duration, samples, skipped time and outputs; they may also be given as keywords.
        Tolerances and methods of the settings are not used, since they are varied.
    {settings}
    outputs : sequence of str, optional
        Names of the outputs of interest; all columns but the contact states if not given.
    methods : sequence of str, optional
        Integrators; all of them if not given.
    rtols : sequence of float
        Relative tolerances [-], each at least ten times `reference_rtol`.
    reference_rtol : float
        Relative tolerance of the reference and of the run that checks it [-].
    repeats : int
        Number of repetitions of each setting, of which the least time counts [-].
    max_steps, max_events : int
        Attempted steps, accepted or rejected, and changes of contact after which a measured run is given up
        [-]; the two tight runs have the usual limits.
    progress : True or callable, optional
        True shows a bar, or lines where standard error is no terminal; a callable gets the runs done and the
        runs in all.

    Returns
    -------
    Tradeoff
        Runs that fail are included with their status.

    Raises
    ------
    SceneError
        If the scene is wrong; all problems are listed.
    SimulationError
        If one of the two accurate runs fails, since there is no reference then.
    ValueError, TypeError
        If another argument is wrong; all problems are listed.

    Examples
    --------
    >>> from chebclear import mechanisms, tradeoff
    >>> result = tradeoff(
    ...     mechanisms.slider_crank(),
    ...     duration=2e-3,
    ...     samples=51,
    ...     outputs=["slider.vx"],
    ...     rtols=[1e-4, 1e-6],
    ...     repeats=1,
    ... )
    >>> result.error(result["rodas4", 1e-6], "slider.vx") < result.error(result["rodas4", 1e-4], "slider.vx")
    True
    """
    checks = Checks()
    if not isinstance(scene, Scene):
        checks.add(
            "scene", f"must be a Scene, got {scene!r}; a Study has the method tradeoff", wrong_type=True
        )
    given = {"rtol": reference_rtol, "max_steps": max_steps, "max_events": max_events}
    tight_limits = checked_settings(checks, given, {"rtol": "reference_rtol"})
    names = _checked_list(checks, "methods", METHODS if methods is None else methods)
    names = [checked_settings(checks, {"method": name}, {"method": "methods"})["method"] for name in names]
    tolerances = _checked_tolerances(checks, rtols, tight_limits["rtol"])
    count = checks.whole("repeats", repeats, least=1, most=1000)
    if not is_request(progress):
        checks.add("progress", f"must be None, True or callable, got {progress!r}", wrong_type=True)
    accepted = (*SpanOptions.__annotations__, "outputs")
    span = Settings.gathered(checks, settings, {"outputs": outputs, **options}, accepted=accepted)
    settings = dataclasses.replace(
        span,
        method=REFERENCE_METHODS[0],
        features=(),
        cycles=1,
        position_tolerance=None,
        velocity_tolerance=None,
        **tight_limits,
    ).fitted(scene.check())
    if settings.outputs is None:
        # A contact state is a yes or no: its error is 1 as soon as an impact falls between other samples.
        columns = tuple(name for name in scene.check().columns if not name.endswith(".contact"))
        settings = dataclasses.replace(settings, outputs=columns)

    choices = [
        dataclasses.replace(settings, method=method, rtol=rtol) for method in names for rtol in tolerances
    ]
    total = 2 + count * len(choices)
    with reporter(progress, "tradeoff") as report:
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
        issue(reference.notices)
        ranges, thresholds = output_ranges(reference.columns, reference.samples)
        kept = np.unique(np.linspace(0, len(reference.t) - 1, _INSTANTS).round().astype(int))

        def measured(trajectory: Trajectory, seconds: float) -> TradeoffPoint:
            difference = trajectory.samples - reference.samples
            return TradeoffPoint(
                method=trajectory.settings.method,
                rtol=trajectory.settings.run_rtol,
                status=trajectory.status,
                end_time=trajectory.end_time,
                stats=trajectory.stats,
                seconds=seconds,
                horizon=chaos_horizon(reference.t, difference, thresholds),
                growth=np.maximum.accumulate(np.abs(difference), axis=0)[kept].T.copy(),
            )

        points = [measured(*run(choice)) for choice in choices]
        # In rounds, so that a machine that is busy for a while does not spoil all repeats of one setting.
        for index in [*range(len(choices))] * (count - 1):
            # A run that failed costs what its limits allow; its time is no price of an accuracy.
            if points[index].success:
                seconds = min(points[index].seconds, run(choices[index])[1])
                points[index] = dataclasses.replace(points[index], seconds=seconds)
            elif report is not None:
                report(next(done), total)
    return Tradeoff(
        outputs=reference.columns,
        ranges=ranges,
        t=reference.t[kept],
        points=tuple(points),
        reference=measured(reference, reference_seconds),
        check=measured(check, check_seconds),
        notices=reference.notices,
        settings=settings,
        scene=scene,
    )


def _checked_list(checks: Checks, name: str, given: object) -> list[Any]:
    if isinstance(given, str) or not isinstance(given, Iterable):
        checks.add(name, f"must be a list, got {given!r}", wrong_type=True)
        return []
    values = list(given)
    if not values:
        checks.add(name, "must not be empty")
    # What is neither, such as an array, is refused as what it stands for.
    counts = Counter(value for value in values if isinstance(value, str | float))
    for value, count in counts.items():
        if count > 1:
            checks.add(name, f"has {value!r} more than once")
    return values


def _checked_tolerances(checks: Checks, rtols: object, reference_rtol: float) -> list[float]:
    """The tolerances, from loose to tight."""
    tolerances = [
        checked_settings(checks, {"rtol": rtol}, {"rtol": f"rtols[{index}]"})["rtol"]
        for index, rtol in enumerate(_checked_list(checks, "rtols", rtols))
    ]
    # A reference as loose as what it judges judges nothing; 9 and not 10 for the sake of rounding.
    tight = [rtol for rtol in tolerances if rtol < 9.0 * reference_rtol]
    if tight:
        checks.add(
            "rtols", f"must be at least 10 times reference_rtol = {power(reference_rtol)}, got {tight}"
        )
    return sorted(tolerances, reverse=True)


def _require_success(run: Trajectory) -> None:
    if not run.success:
        message = (
            f"{run.message}, in the reference run ({run.settings.method}, rtol "
            f"{power(run.settings.run_rtol)}); a shorter duration or a looser reference_rtol may help"
        )
        error = SimulationError(run.status, run.end_time, run.joint, message=message)
        error.trajectory = run
        raise error
