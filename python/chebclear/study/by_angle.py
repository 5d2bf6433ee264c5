"""Bands by crank angle: the simulated revolutions, and the runs divided into them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable

import numpy as np

from ..base.arguments import Checks
from ..base.shown import did_you_mean
from ..errors import ArgumentError
from ..notices import HORIZON, Notice
from ..run.accuracy import BY_ANGLE
from ..run.features import settling_time
from ..run.resampling import interpolated, refined
from ..run.settings import LEAST_RTOL, MOST_PERIODS, MOST_SAMPLES, Settings
from ..run.simulation import run_scene
from ..scene.columns import physical_limits
from ..scene.motions import Speed
from ..scene.parts import Revolute
from ..scene.scene import Scene
from .band.revolutions import Revolutions
from .runner import Runner
from .sources.run_table import RunTable
from .sources.scenes import scene_of

# Integrals over time, which grow from revolution to revolution.
_SUMS = ("impact_loss", "friction_loss", "damping_loss", "wear", "input", "balance")
# Least samples in time where the angle is measured, for one step of the crank angle and for one revolution at
# the largest speed. With 180 a revolution accelerations that oscillate between samples put the position of
# the paper's slider off by 7 um, with 1440 by 0.1 um.
_OVERSAMPLING = 2
LEAST_STEPS = 1440
# A crank that turns by less in the whole run counts as at rest [rad].
_LEAST_TURN = 1e-6
# Runs that differ by this part of the spread over the box are not predictable. Within two revolutions that
# hardly ever occurs, so that shorter runs are not simulated twice.
_APART = 0.1
_PREDICTABLE = 2.5
# Samples for the largest speed of a driven crank.
_LOOK = 2001


def check_turns(checks: Checks, settings: Settings | None, revolutions: object, discard: object) -> None:
    """Check that a study has revolutions, and some that are not discarded."""
    if settings is None:
        checks.add("revolutions", "need scenes: runs of other models have no drive")
    turns = checks.whole("revolutions", revolutions, least=1, most=MOST_PERIODS)
    skipped = checks.whole("discard", discard, least=0, most=MOST_PERIODS)
    if turns <= skipped:
        checks.add("revolutions", f"must be > discard, got {revolutions} and {discard}")


def turning(
    study: Runner, settings: Settings, revolutions: int, discard: int, joint: str | None
) -> tuple[Settings, Revolutions]:
    """Settings with which samples can be taken at the same crank angles in every revolution.

    The `samples` of the study are those of a revolution; a drive at constant speed needs neither `skip` nor
    `duration`. The joint is that whose angle is the crank angle, of the only drive at constant speed if None.
    """
    checks, nominal = Checks(), study.nominal
    scene = scene_of(study, nominal)
    crank = crank_of(checks, scene, joint)
    checks.finish()
    ends = [
        scene_of(study, {**nominal, name: end})
        for name, side in study.intervals.items()
        for end in (side.lower, side.upper)
    ]
    drive = drives_of(scene).get(crank)
    if drive is not None and all(_same(drive, other) for other in ends):
        return _constant(settings, drive, revolutions, discard)
    return _measured(study, settings, scene, ends, crank, revolutions, discard)


def _constant(
    settings: Settings, drive: Speed, revolutions: int, discard: int
) -> tuple[Settings, Revolutions]:
    """For runs that all turn at one constant speed: equal steps of time are equal steps of the angle."""
    kept, period = revolutions - discard, 2.0 * math.pi / abs(drive.speed)
    sense = 1 if drive.speed > 0.0 else -1
    turns = Revolutions(drive.joint, kept, discard, drive.angle, sense, settings.samples)
    settings = dataclasses.replace(settings, samples=_affordable(kept * (settings.samples - 1) + 1))
    return dataclasses.replace(settings, skip=discard * period, duration=kept * period, cycles=kept), turns


def _measured(
    study: Runner,
    settings: Settings,
    scene: Scene,
    ends: Iterable[Scene],
    crank: str,
    revolutions: int,
    discard: int,
) -> tuple[Settings, Revolutions]:
    """For other runs: the measured angle is an additional output."""
    if study.features:
        raise ArgumentError(
            "features of each revolution need one constant speed of the drive in the whole box: make the "
            "band in a study without features"
        )
    column = f"{crank}.angle"
    names = settings.fitted(scene.check()).outputs or scene.check().columns
    duration = settings.duration
    driven = [found.get(crank) for found in map(drives_of, [scene, *ends])]
    speeds = [abs(drive.speed) for drive in driven if drive is not None]
    if len(speeds) == len(driven):
        # One revolution more, since the motion up to the first angle is skipped.
        duration = 2.0 * math.pi * (revolutions + 1) / min(speeds)
    look = dataclasses.replace(settings, skip=0.0, duration=duration, samples=_LOOK, outputs=(column,))
    run = run_scene(scene, look)
    if not run.success:
        raise ArgumentError(f"the nominal run cannot be simulated for {duration:.6g} s: {run.message}")
    angle = run[column]
    fastest = float(np.max(np.abs(np.diff(angle)))) * (_LOOK - 1) / duration
    if np.ptp(angle) < _LEAST_TURN:
        raise ArgumentError(f'"{crank}" does not turn: a band by crank angle needs revolutions')
    steps_of_turn = max(_OVERSAMPLING * (settings.samples - 1), LEAST_STEPS)
    steps = steps_of_turn * fastest * duration / (2.0 * math.pi)
    shown, sense = column in names, 1 if angle[-1] >= angle[0] else -1
    kept, start = revolutions - discard, float(angle[0])
    turns = Revolutions(crank, kept, discard, start, sense, settings.samples, column, shown)
    outputs, samples = tuple(names) if shown else (*names, column), _affordable(math.ceil(steps) + 1)
    return dataclasses.replace(look, samples=samples, outputs=outputs, cycles=1), turns


def unpredictable(runs: RunTable) -> tuple[Notice, ...]:
    """A notice if single values in the last revolution are not predictable.

    The midpoint run and two others are simulated once more at a tenth of the tolerance. Where two such runs
    differ by more than a tenth of the spread of all runs over the box, a run is no longer determined by its
    parameters.
    """
    settings, period = runs.settings, -math.inf if runs.scene is None else settling_time(runs.scene)
    if settings is None or not runs.scenes or period < 0.0 or runs.t[-1] < _PREDICTABLE * period:
        return ()
    tighter = max(0.1 * settings.run_rtol, LEAST_RTOL)
    again = dataclasses.replace(settings, rtol=tighter, features=(), cycles=1, companion_of=settings.rtol)
    last = runs.t >= runs.t[-1] - period
    spread = np.ptp(runs.values[:, last], axis=0).mean(axis=0)
    lost: dict[str, None] = {}
    for index in (-1, 0, 1):
        companion = run_scene(runs.scenes[index], again)
        if companion.success:
            apart = np.abs(companion.samples - runs.values[index])[last].mean(axis=0)
            lost |= {runs.outputs[k]: None for k in np.flatnonzero(apart > _APART * spread)}
    if not lost:
        return ()
    text = (
        f"past the chaos horizon: in the last revolution a run changes by more than {100.0 * _APART:g} % of "
        f"the spread of the runs over the box when only its tolerances change ({', '.join(lost)}): {BY_ANGLE}"
    )
    return (Notice(HORIZON, text, tuple(lost)),)


def _affordable(samples: int) -> int:
    if samples > MOST_SAMPLES:
        raise ArgumentError(f"{samples} samples of each run are more than {MOST_SAMPLES}: ask for fewer")
    return samples


def cut(runs: RunTable, revolutions: Revolutions) -> RunTable:
    """The runs by revolution: values of shape (runs, revolutions, samples, outputs).

    The full turns since the first sample are subtracted from output angles. ValueError is raised if an output
    only grows, or a run makes fewer revolutions than are asked for.
    """
    sums = [name for name in runs.outputs if name.rpartition(".")[2] in _SUMS]
    if sums:
        raise ArgumentError(
            f"no band by crank angle for {', '.join(sums)}: they grow from revolution to revolution; use "
            "features instead, such as the wear of each cycle"
        )
    if revolutions.column is None:
        assert runs.scene is not None, "only scenes have revolutions"
        drive = drives_of(runs.scene)[revolutions.joint]
        if not all(_same(drive, scene) for scene in runs.scenes):
            raise ArgumentError(
                f'the speed of "{revolutions.joint}" differs inside the box, but not at the ends of its '
                "sides: make it a parameter of its own"
            )
    else:
        runs = _at_the_angles(runs, revolutions, revolutions.column)
    values = revolutions.folded(runs.values)
    for index, name in enumerate(runs.outputs):
        if name.rpartition(".")[2] == "angle":
            column = values[..., index]
            turns = np.round((column[:, :, 0] - column[:, :1, 0]) / (2.0 * math.pi))
            column -= 2.0 * math.pi * turns[:, :, None]
    return dataclasses.replace(runs, t=runs.t[: revolutions.samples], values=values)


def _at_the_angles(runs: RunTable, revolutions: Revolutions, column: str) -> RunTable:
    """The runs interpolated at the angles that are kept; the instants are those of the last run."""
    place = runs.outputs.index(column)
    shown = [index for index in range(len(runs.outputs)) if revolutions.shown or index != place]
    steps = revolutions.kept * (revolutions.samples - 1) + 1
    values = np.empty((len(runs.values), steps, len(shown)))
    t = runs.t
    for run, table in enumerate(runs.values):
        found = revolutions.instants(runs.t, table[:, place])
        if isinstance(found, float):
            least = revolutions.kept + revolutions.discarded
            raise ArgumentError(
                f'"{revolutions.joint}" makes {found:.3g} revolutions in {runs.t[-1]:.6g} s in run {run}, '
                f"{least} from a first angle on are needed: give the study a longer duration, or take fewer "
                "cycles"
            )
        t = refined(found, runs.t, table[:, place])
        values[run] = interpolated(t, runs.t, table[:, shown])
    outputs = tuple(runs.outputs[index] for index in shown)
    # A cubic through the jumps of a contact may leave what is possible.
    for target, limits in enumerate(physical_limits(outputs, {}).values()):
        np.clip(values[..., target], *limits, out=values[..., target])
    return dataclasses.replace(runs, t=t, outputs=outputs, values=values)


def drives_of(scene: Scene) -> dict[str, Speed]:
    """The drives at constant speed by their joints."""
    return {drive.joint: drive for drive in scene.drives if isinstance(drive, Speed) and drive.speed != 0.0}


def _same(drive: Speed, scene: Scene) -> bool:
    """Whether a joint turns at the same speed from the same angle in another scene."""
    other = drives_of(scene).get(drive.joint)
    return other is not None and (other.speed, other.angle) == (drive.speed, drive.angle)


def crank_of(checks: Checks, scene: Scene, joint: str | None, argument: str = "angle") -> str:
    """The joint whose angle is the crank angle."""
    driven, turn = drives_of(scene), [one.name for one in scene.joints if isinstance(one, Revolute)]
    if joint is None:
        if len(driven) == 1:
            return next(iter(driven))
        why = "no drive turns" if not driven else "several drives turn"
        checks.add(
            argument, f"must name the joint of the crank, one of {_listed(turn)}: {why} at constant speed"
        )
    elif joint not in turn:
        hint = did_you_mean(joint, turn) if isinstance(joint, str) else ""
        checks.add(argument, f"must be a revolute joint, one of {_listed(turn)}, got {joint!r}{hint}")
    return str(joint)


def _listed(names: Iterable[str]) -> str:
    return ", ".join(f'"{name}"' for name in names)
