"""Whether a difference of two designs lasts: some pairs simulated for further windows of the same length."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ..base.prefixes import format_quantity
from ..base.rows import Array
from ..base.shown import listed
from ..notices import Notice
from ..run.features import Feature
from ..study.runner import Runner
from ..study.sources.asked import tracked_features
from .trace import made_at

# Windows of the length of the runs. Three show how fast a change fades, which tells what is still to come.
_WINDOWS = 3


def unsettled(
    runners: Sequence[Runner],
    points: Sequence[Array],
    differences: Mapping[str, tuple[float, str]],
    confidence: float,
) -> tuple[Notice, ...]:
    """A notice of the features that will still change by more than the designs differ; empty without any.

    Of both designs the first pairs are simulated for three windows. A feature whose change from the first to
    the last has one sign in all of them drifts: so many pairs prove it with the confidence, whatever the
    scatter is.
    If the changes fade like a geometric series, those still to come add up to the first over ``1 - ratio``.
    `differences` are the medians of the features that both designs have, and their units.
    """
    pairs = math.ceil(1.0 - math.log2(1.0 - confidence))
    drifting: dict[str, float] = {}
    for runner, own in zip(runners, points, strict=True):
        for name, values in _windows(runner, own[:pairs]).items():
            changes = np.diff(values, axis=1)
            drift = changes.sum(axis=1)
            if len(drift) < pairs or not (np.all(drift > 0.0) or np.all(drift < 0.0)):
                continue
            first, last = np.median(changes, axis=0)
            ratio = abs(last / first) if first else math.inf
            left = abs(first) / (1.0 - ratio) if ratio < 1.0 else math.inf
            if name in differences and left > abs(differences[name][0]):
                drifting.setdefault(name, float(first))
    settings = runners[0].settings
    if not drifting or settings is None:
        return ()
    name, change = next(iter(drifting.items()))
    size = format_quantity(abs(change), differences[name][1])
    text = (
        f"not settled: {listed(drifting)} will still change by more than the designs differ ({name} by "
        f"{size} from these runs to the next {settings.duration:.3g} s): this compares how the motion "
        "starts; skip more to compare later motion"
    )
    return (Notice("unsettled", text, tuple(drifting), {"change": change}),)


def _windows(runner: Runner, points: Array) -> dict[str, Array]:
    """Each tracked feature in three windows of the runs that succeed, shape (runs, windows)."""
    settings = runner.settings
    features = {
        name: one
        for name, one in runner.features.items()
        if isinstance(one, Feature) and not one.kind.startswith("time_of")
    }
    if settings is None or not features:
        return {}
    settings = replace(
        settings,
        duration=_WINDOWS * settings.duration,
        samples=_WINDOWS * (settings.samples - 1) + 1,
        cycles=_WINDOWS * settings.cycles,
        outputs=(),
        features=tracked_features(features.values()),
    )
    made = made_at(replace(runner, features=features, settings=settings), points)
    assert made.features is not None
    table = made.features.reshape(len(made.features), _WINDOWS, -1, len(made.feature_names)).mean(axis=2)
    return {name: table[:, :, column] for column, name in enumerate(made.feature_names)}
