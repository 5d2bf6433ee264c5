"""One simulation: settings in, trajectory out."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Literal, Unpack

import numpy as np

from ..base.arguments import Checks
from ..base.progress import bar, is_request
from ..errors import SimulationError
from ..notices import Notice, issue
from ..scene.scene import Scene, compiled
from .accuracy import ErrorEstimate, chaos_horizon, output_ranges, past_horizon
from .contacts import Contacts, Events
from .continuation import continuation
from .features import Feature, settling_time
from .settings import LEAST_RTOL, RunOptions, Settings, revolution_of, with_settings
from .trajectory import EndState, Stats, Trajectory

# The tolerances of the companion runs of an error estimate are those of the run divided by these. The second
# companion uses another method: one companion, or two of one method, too often have the same error as the run
# (docs/decisions.md).
_TIGHTER = (10.0, 100.0)


@with_settings(RunOptions, "outputs", "features")
def simulate(
    scene: Scene,
    *,
    settings: Settings | None = None,
    outputs: Sequence[str] | None = None,
    features: Sequence[Feature] | None = None,
    start: EndState | None = None,
    progress: bool | Callable[[float], None] | None = None,
    on_failure: Literal["raise", "return"] = "raise",
    error: Literal["estimate"] | None = None,
    **options: Unpack[RunOptions],
) -> Trajectory:
    """Simulate a scene from its assembled position.

    Contacts make trajectories chaotic: errors double every few changes of contact, so a tolerance ensures
    accuracy for a limited time only. ``error="estimate"`` estimates both the error and that time.

    Parameters
    ----------
    scene : Scene
        The mechanism.
    settings : Settings, optional
        Settings of the run; each of the following fields may also be given as a keyword.
    {settings}
    start : EndState, optional
        The end of an earlier run of the scene, `Trajectory.end`, to continue from: time, turns, contacts and
        work are continued. The step size is chosen anew, so the result agrees with that of a single run
        within its error. A scene with other numbers takes over the coordinates and velocities of the joints,
        and a warning names the differences; a scene whose joints would then not be closed is refused.
    progress : True or callable, optional
        True shows a bar, or lines where standard error is not a terminal; a callable gets the completed
        part, from 0 to 1.
    on_failure : {"raise", "return"}
        Whether a run that fails raises an exception or returns its incomplete result, with its
        `Trajectory.status`.
    error : {"estimate"}, optional
        Simulate twice more, at a tenth of all tolerances and at a hundredth by another method.
        `Trajectory.error` then has the difference of each output, and the time from which it exceeds 1 % of
        its range. This takes 3 to 5 times the work of the run itself.

    Raises
    ------
    SceneError, SettingsError, StartError
        If the scene is wrong, lacks something that the settings name, or cannot continue from `start`; all
        problems are listed.
    SimulationError
        If the run fails; the exception has the incomplete result as `SimulationError.trajectory`.
    ValueError, TypeError
        If another argument is wrong; all problems are listed.
    MemoryError
        If the samples do not fit into the memory.

    Examples
    --------
    >>> import chebclear as cc
    >>> scene = cc.mechanisms.slider_crank()
    >>> run = cc.simulate(scene, duration=0.01, samples=101, outputs=["slider.x", "wrist.*"])
    >>> run.status, run["slider.x"].shape
    ('done', (101,))
    """
    checks = Checks()
    if not isinstance(scene, Scene):
        checks.add("scene", f"must be a Scene, got {scene!r}", wrong_type=True)
    if start is not None and not isinstance(start, EndState):
        checks.add("start", f"must be the end of a run, got {start!r}", wrong_type=True)
    if not is_request(progress):
        checks.add("progress", f"must be None, True or callable, got {progress!r}", wrong_type=True)
    checks.word("on_failure", on_failure, ("raise", "return"))
    if error is not None:
        checks.word("error", error, ("estimate",))
    if settings is None and "duration" not in options and isinstance(scene, Scene):
        options = {**options, **revolution_of(scene)}
    given = {"outputs": outputs, "features": features, **options}
    settings = Settings.gathered(checks, settings, given).of_runs
    least = LEAST_RTOL * _TIGHTER[-1]
    if error is not None and settings.run_rtol < least:
        checks.add(
            "error",
            f'= "estimate" needs an rtol >= {least:g} for its companion runs, got {settings.run_rtol!r}',
        )
        checks.finish()
    facts = scene.check()
    settings = settings.fitted(facts)
    # Warned of before the run: wrong numbers in a scene may make it long.
    issue(facts.notices)
    changes: tuple[Notice, ...] = ()
    if start is not None:
        changes = continuation(scene, start, settings)

    with _reporter(progress) as report:
        reports = [report] if error is None else [_third(report, place) for place in range(3)]
        trajectory = run_scene(scene, settings, reports[0], start)
        trajectory = dataclasses.replace(trajectory, notices=changes + trajectory.notices)
        if error is not None and (trajectory.success or on_failure == "return"):
            companions = _companions(trajectory, start, reports[1:])
            estimate = _estimate(trajectory, companions)
            lost = past_horizon(estimate, settling_time(scene), trajectory.end_time)
            trajectory = dataclasses.replace(trajectory, error=estimate, notices=trajectory.notices + lost)
    issue(one for one in trajectory.notices if one not in facts.notices)
    if not trajectory.success and on_failure == "raise":
        failure = SimulationError(
            trajectory.status,
            trajectory.end_time,
            trajectory.joint,
            message=trajectory.message,
            load=trajectory.failed_load,
        )
        failure.trajectory = trajectory
        raise failure
    return trajectory


def run_scene(
    scene: Scene,
    settings: Settings,
    report: Callable[[float], None] | None = None,
    start: EndState | None = None,
) -> Trajectory:
    """Simulate with checked settings; neither warns nor raises when the run fails."""
    memory = None if start is None else start.memory
    run = compiled(scene).simulate(settings.to_json(), report, memory)
    return Trajectory(
        t=run["t"],
        columns=tuple(run["columns"]),
        samples=run["values"],
        events=Events.of(run["events"]),
        contacts=Contacts.of(run["contacts"]),
        skipped_events=Events.of(run["skipped_events"]),
        skipped_contacts=Contacts.of(run["skipped_contacts"]),
        features=run["features"],
        start=memory,
        end=None if run["end"] is None else EndState(run["end"], scene),
        stats=Stats.from_dict(run["stats"]),
        status=run["status"],
        message=run["message"],
        end_time=run["time"],
        joint=run["joint"],
        failed_load=run["load"],
        notices=Notice.of_core(run["notices"]),
        settings=settings,
        scene=scene,
    )


def _companions(
    run: Trajectory, start: EndState | None, reports: Sequence[Callable[[float], None] | None]
) -> list[Trajectory]:
    """The runs at tighter tolerances with which a run is compared."""
    methods = (run.settings.method, "rodas5p" if run.settings.method == "auto" else "auto")
    return [
        run_scene(
            run.scene,
            run.settings.tightened(factor, method=method, features=(), companion_of=run.settings.rtol),
            report,
            start,
        )
        for factor, method, report in zip(_TIGHTER, methods, reports, strict=True)
    ]


def _estimate(run: Trajectory, companions: Sequence[Trajectory]) -> ErrorEstimate:
    """The errors of a run by its companions, the tightest last."""
    ranges, thresholds = output_ranges(run.columns, companions[-1].samples)
    # fmax ignores the NaN of a companion that ended early.
    difference = np.fmax.reduce([np.abs(run.samples - one.samples) for one in companions])
    known = np.isfinite(difference)
    largest = np.where(known, difference, -math.inf).max(axis=0)
    horizon = chaos_horizon(run.t, difference, thresholds)
    end = min(one.end_time for one in companions)
    if end < run.end_time:
        horizon = np.minimum(horizon, end)
    return ErrorEstimate(
        columns=run.columns,
        max_difference=np.where(known.any(axis=0), largest, math.nan),
        ranges=ranges,
        horizon=horizon,
        rtol=companions[-1].settings.run_rtol,
        status=next((one.status for one in companions if not one.success), "done"),
        compared_until=min(run.end_time, end),
    )


def _third(report: Callable[[float], None] | None, place: int) -> Callable[[float], None] | None:
    """A progress function for one of three runs; the companions take 1.4 and 1.9 times as long as the run."""
    return None if report is None else lambda share: report((place + share) / 3.0)


@contextmanager
def _reporter(progress: bool | Callable[[float], None] | None) -> Iterator[Callable[[float], None] | None]:
    if callable(progress):
        yield progress
    elif progress:
        with bar("simulation", "") as report:
            yield lambda share: report(share, 1.0)
    else:
        yield None
