"""Bands by crank angle: which revolutions are simulated, and the runs cut into revolutions."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..base.arguments import Checks, did_you_mean
from ..run.settings import MOST_CYCLES, MOST_SAMPLES, Settings
from ..scene.motions import Speed
from ..scene.scene import Scene
from .band.revolutions import Revolutions
from .runner import Runner
from .runs import Runs

Array = NDArray[np.float64]

# What only grows: no two revolutions are alike.
_SUMS = ("impact_loss", "friction_loss", "damping_loss", "wear", "input", "balance")


def turning(
    study: Runner, settings: Settings | None, cycles: int, discard: int, joint: str | None
) -> tuple[Settings, Revolutions]:
    """How to simulate so that the samples are at the same crank angles in every revolution.

    Parameters
    ----------
    study : Runner
        What to simulate.
    settings : Settings or None
        How; `samples` are those of a revolution, `skip` and `duration` do not count. None if the runs are not
        simulated here.
    cycles : int
        Revolutions of every run [-].
    discard : int
        How many of them, the first ones, are not pooled [-].
    joint : str or None
        Joint whose angle is the crank angle; that of the only drive at constant speed if None.

    Raises
    ------
    ValueError
        If an argument is wrong, or the drive does not turn at the same constant speed in the whole box.
    """
    checks = Checks()
    if settings is None:
        raise ValueError("a band by crank angle needs scenes: runs of other models have no drive")
    checks.whole("cycles", cycles, least=1, most=MOST_CYCLES)
    checks.whole("discard", discard, least=0, most=MOST_CYCLES)
    checks.finish()
    kept = cycles - discard
    if kept < 1:
        checks.add(f"cycles must be > discard, got {cycles} and {discard}")
    samples = kept * (settings.samples - 1) + 1
    if samples > MOST_SAMPLES:
        checks.add(f"{kept} revolutions of {settings.samples} samples are more than {MOST_SAMPLES}")
    middle = {name: side.midpoint for name, side in study.intervals.items()}
    drive = _drive(checks, study.scene(middle), joint)
    checks.finish()
    assert drive is not None, "the checks let no scene without a drive pass"
    for name, side in study.intervals.items():
        for end in (side.lower, side.upper):
            _require_drive(study.scene({**middle, name: end}), drive)
    period = 2.0 * math.pi / abs(drive.speed)
    settings = dataclasses.replace(
        settings,
        skip=discard * period,
        duration=kept * period,
        samples=samples,
        cycles=kept,
    )
    sense = 1 if drive.speed > 0.0 else -1
    return settings, Revolutions(drive.joint, kept, discard, drive.angle, sense)


def cut(runs: Runs, revolutions: Revolutions) -> Runs:
    """The runs by revolution: values of shape (runs, revolutions, samples, outputs).

    Angles of outputs lose their full turns since the first sample.

    Raises
    ------
    ValueError
        If an output only grows, or a drive turns otherwise than that of the nominal run.
    """
    sums = [name for name in runs.outputs if name.rpartition(".")[2] in _SUMS]
    if sums:
        raise ValueError(
            f"no band by crank angle for {', '.join(sums)}: they grow from revolution to revolution; ask for "
            "features, such as the wear of each cycle, instead"
        )
    drive = _driven(runs.scenes[-1])[revolutions.joint]
    for scene in runs.scenes:
        _require_drive(scene, drive)
    values = revolutions.folded(runs.values)
    for index, name in enumerate(runs.outputs):
        if name.rpartition(".")[2] == "angle":
            column = values[..., index]
            turns = np.round((column[:, :, 0] - column[:, :1, 0]) / (2.0 * math.pi))
            column -= 2.0 * math.pi * turns[:, :, None]
    steps = values.shape[2]
    return dataclasses.replace(runs, t=runs.t[:steps], values=values)


def _driven(scene: Scene) -> dict[str, Speed]:
    """The drives at constant speed by their joints."""
    return {drive.joint: drive for drive in scene.drives if isinstance(drive, Speed) and drive.speed != 0.0}


def _drive(checks: Checks, scene: Scene, joint: str | None) -> Speed | None:
    """The drive whose angle is the crank angle."""
    driven = _driven(scene)
    if not driven:
        checks.add("no drive turns at constant speed: a band by crank angle needs one")
        return None
    if joint is None and len(driven) > 1:
        checks.add(f"several joints are driven at constant speed: angle must be one of {_listed(driven)}")
        return None
    if joint is not None and joint not in driven:
        checks.add(
            f"angle must be a joint that is driven at constant speed, one of {_listed(driven)}, got "
            f"{joint!r}{did_you_mean(joint, driven) if isinstance(joint, str) else ''}"
        )
        return None
    return next(iter(driven.values())) if joint is None else driven[joint]


def _listed(names: Sequence[str] | dict[str, Speed]) -> str:
    return ", ".join(f'"{name}"' for name in names)


def _require_drive(scene: Scene, drive: Speed) -> None:
    other = _driven(scene).get(drive.joint)
    if other is None or (other.speed, other.angle) != (drive.speed, drive.angle):
        raise ValueError(
            f'the drive of "{drive.joint}" must turn at the same speed from the same angle in the whole box: '
            "a band by crank angle takes neither as a parameter"
        )
