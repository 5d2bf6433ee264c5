"""One simulation: settings in, trajectory out."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Literal

from .. import _core
from ..base.arguments import Checks
from ..base.progress import bar, is_request
from ..errors import ChebclearWarning, SimulationError
from ..scene.scene import Scene
from .accuracy import ErrorEstimate
from .contacts import Contacts, Events
from .continuation import continuation
from .features import Feature
from .settings import LEAST_RTOL, MAX_EVENTS, MAX_STEPS, Settings
from .trajectory import EndState, Stats, Trajectory

# The companion runs of an error estimate have the tolerances of the run divided by these. The second takes
# another method: one companion, or two of one method, too often share the error of the run
# (docs/decisions.md).
_TIGHTER = (10.0, 100.0)
_OTHER_METHOD = {"auto": "rodas5p", "rodas5p": "auto", "rodas4": "auto", "dop853": "auto"}
# Where the work of the run itself and of its first companion ends, of all three: they cost 1.4 and 1.9 times
# as much as the run, in the median over the scenes of `benchmarks/claims.py`.
_OWN_SHARE, _FIRST_SHARE = 0.23, 0.56


def simulate(
    scene: Scene,
    duration: float,
    samples: int,
    rtol: float = 1e-6,
    method: str = "auto",
    outputs: Sequence[str] | None = None,
    *,
    skip: float = 0.0,
    start: EndState | None = None,
    max_steps: int = MAX_STEPS,
    max_events: int = MAX_EVENTS,
    position_tolerance: float | None = None,
    velocity_tolerance: float | None = None,
    features: Sequence[Feature] | None = None,
    cycles: int = 1,
    progress: bool | Callable[[float], None] | None = None,
    on_failure: Literal["raise", "return"] = "raise",
    error: Literal["estimate"] | None = None,
) -> Trajectory:
    """Simulate a scene from its assembled position.

    Contacts make trajectories chaotic: the error doubles every few changes of contact, so a tolerance buys
    accuracy over a limited time only. ``error="estimate"`` tells how much and how long.

    Parameters
    ----------
    scene : Scene
        What to simulate.
    duration : float
        Simulated time [s], above 0.
    samples : int
        Number of equally spaced samples, both ends included [-]; 2 to 10 000 000. Does not change the
        steps.
    rtol : float
        Relative tolerance of the integrator [-], from 1e-13 to 0.1.
    method : {"auto", "rodas5p", "rodas4", "dop853"}
        The explicit method of order 8 (DOP853) and a Rosenbrock method (Rodas4, Rodas5P at an rtol below
        3e-8), changing places with the stiffness of the motion; or one of them throughout. DOP853 alone is
        much dearer, though no less accurate, where a contact sticks.
    outputs : sequence of str, optional
        Names of the columns to return, or patterns such as ``"energy.*"``; all quantities of bodies,
        clearance joints and drives if not given. ``scene.check()`` lists them, and further ones.
    skip : float
        Time to simulate before the first sample [s], such as ``10 * scene.period`` for a mechanism to settle.
    start : EndState, optional
        The end of an earlier run of the scene, `Trajectory.end`, to continue from: time goes on, and the
        steps are those of a single run, bit for bit. A scene whose numbers differ takes over the coordinates
        and velocities of the joints, and a warning names the differences; one that this would tear apart is
        refused.
    max_steps, max_events : int
        Attempted steps, accepted or refused, and changes of contact after which the run is given up [-].
    position_tolerance, velocity_tolerance : float, optional
        Absolute tolerances [m], [m/s], at most half the smallest clearance, or the size of a scene without
        one, and the speed of the scene; from `rtol` and these scales if not given.
    features : sequence of Feature, optional
        What to find on the way, such as ``[cc.peak("slider.ax"), cc.impacts("wrist")]``: then
        `Trajectory.peak` and `Trajectory.feature` answer at once. Without, they simulate once more.
    cycles : int
        Equal pieces of the sampled time, each with features of its own [-].
    progress : True or callable, optional
        True shows a bar if standard error is a terminal; a callable gets the share that is done, from 0 to 1.
    on_failure : {"raise", "return"}
        Whether a run that fails raises or returns what it has, with its `Trajectory.status`.
    error : {"estimate"}, optional
        Simulate twice more, at a tenth of all tolerances and at a hundredth by another method, and say in
        `Trajectory.error` how far each output differs, and from when on by more than 1 % of its range. Costs
        3 to 5 times the run itself.

    Returns
    -------
    Trajectory

    Raises
    ------
    SceneError, SettingsError, StartError
        If the scene is wrong, asked for what it does not have, or cannot go on from `start`; all problems
        are listed.
    SimulationError
        If the run fails; the exception has what was computed as `SimulationError.trajectory`.
    ValueError, TypeError
        If another argument is wrong; all problems are listed.
    MemoryError
        If the samples do not fit into the memory.
    """
    checks = Checks()
    if not isinstance(scene, Scene):
        checks.add(f"scene must be a Scene, got {scene!r}", wrong_type=True)
    settings = Settings.checked(
        checks,
        duration=duration,
        samples=samples,
        skip=skip,
        rtol=rtol,
        method=method,
        outputs=outputs,
        max_steps=max_steps,
        max_events=max_events,
        position_tolerance=position_tolerance,
        velocity_tolerance=velocity_tolerance,
        features=features,
        cycles=cycles,
        outputs_needed=not features,
    )
    if start is not None and not isinstance(start, EndState):
        checks.add(f"start must be the end of a run, got {start!r}", wrong_type=True)
    if not is_request(progress):
        checks.add(f"progress must be None, True or callable, got {progress!r}", wrong_type=True)
    checks.word("on_failure", on_failure, ("raise", "return"))
    if error is not None:
        checks.word("error", error, ("estimate",))
        least = LEAST_RTOL * _TIGHTER[-1]
        if settings.rtol < least:
            checks.add(f'error="estimate" needs an rtol >= {least:g} for its companion runs, got {rtol!r}')
    checks.finish()
    settings = settings.for_scene(scene)
    # Told before the run: what looks wrong in a scene may make it long.
    doubts = scene.check().warnings
    warn_once(doubts, stacklevel=3)
    changes: tuple[str, ...] = ()
    if start is not None:
        start, changes = continuation(scene, start, settings)

    with _reporter(progress) as report:
        own = _share(report, 0.0, 1.0 if error is None else _OWN_SHARE)
        trajectory = run_scene(scene, settings, own, start)
        trajectory = dataclasses.replace(trajectory, warnings=changes + trajectory.warnings)
        if error is not None and (trajectory.success or on_failure == "return"):
            shares = (_share(report, _OWN_SHARE, _FIRST_SHARE), _share(report, _FIRST_SHARE, 1.0))
            companions = _companions(trajectory, start, shares)
            trajectory = dataclasses.replace(trajectory, error=_estimate(trajectory, companions))
    warn_once([message for message in trajectory.warnings if message not in doubts], stacklevel=3)
    if not trajectory.success and on_failure == "raise":
        failure = SimulationError(
            trajectory.status, trajectory.end_time, trajectory.joint, message=trajectory.message
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
    """Simulate with settings that were checked; neither warns nor raises when the run fails.

    Parameters
    ----------
    scene : Scene
        What to simulate.
    settings : Settings
        How.
    report : callable, optional
        Gets the share that is done, from 0 to 1.
    start : EndState, optional
        The end of another run, to continue from.

    Returns
    -------
    Trajectory

    Raises
    ------
    InputError
        If the scene is wrong, or settings or start do not fit it.
    """
    memory = None if start is None else start.memory
    run = _core.simulate(scene.to_json(), settings.to_json(), report, memory)
    return Trajectory(
        t=run["t"],
        columns=tuple(run["columns"]),
        values=run["values"],
        events=Events.of(run["events"]),
        contacts=Contacts.of(run["contacts"]),
        skipped_events=Events.of(run["skipped_events"]),
        skipped_contacts=Contacts.of(run["skipped_contacts"]),
        features=run["features"],
        start=memory,
        end=None if run["end"] is None else EndState(run["end"], scene),
        stats=Stats(**run["stats"]),
        status=run["status"],
        message=run["message"],
        end_time=run["time"],
        joint=run["joint"],
        warnings=tuple(run["warnings"]),
        settings=settings,
        scene=scene,
    )


def _companions(
    run: Trajectory, start: EndState | None, reports: Sequence[Callable[[float], None] | None]
) -> list[Trajectory]:
    """The runs at tighter tolerances that a run is compared with."""
    methods = (run.settings.method, _OTHER_METHOD[run.settings.method])
    return [
        run_scene(run.scene, _tightened(run.settings, factor, method), report, start)
        for factor, method, report in zip(_TIGHTER, methods, reports, strict=True)
    ]


def _tightened(settings: Settings, factor: float, method: str) -> Settings:
    """The settings of a companion run: all tolerances divided by a factor, the core's own included."""

    def tighter(tolerance: float | None) -> float | None:
        return None if tolerance is None else tolerance / factor

    return dataclasses.replace(
        settings,
        rtol=max(settings.rtol / factor, LEAST_RTOL),
        method=method,
        features=(),
        position_tolerance=tighter(settings.position_tolerance),
        velocity_tolerance=tighter(settings.velocity_tolerance),
        companion_of=settings.rtol,
    )


def _estimate(run: Trajectory, companions: Sequence[Trajectory]) -> ErrorEstimate:
    statuses = [companion.status for companion in companions]
    return ErrorEstimate.between(
        run.columns,
        run.t,
        run.values,
        [companion.values for companion in companions],
        rtol=companions[-1].settings.rtol,
        status=next((status for status in statuses if status != "done"), "done"),
        end_time=run.end_time,
        companions_end=min(companion.end_time for companion in companions),
    )


def _share(
    report: Callable[[float], None] | None, start: float, end: float
) -> Callable[[float], None] | None:
    """A report of the part of the work that goes from one share of all to another."""
    return None if report is None else lambda share: report(start + (end - start) * share)


def warn_once(messages: Iterable[str], stacklevel: int) -> None:
    """Pass on the warnings of the core, each text once; for `stacklevel`, this function is level 1."""
    for message in dict.fromkeys(messages):
        warnings.warn(message, ChebclearWarning, stacklevel=stacklevel)


@contextmanager
def _reporter(progress: bool | Callable[[float], None] | None) -> Iterator[Callable[[float], None] | None]:
    if callable(progress):
        yield progress
    elif progress:
        with bar("simulation", "") as report:
            yield None if report is None else lambda share: report(share, 1.0)
    else:
        yield None
