"""What differs between two studies: their models, intervals, settings and nominal scenes, a line for each."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from ..base import files
from ..run.settings import Settings
from ..scene.scene import Interval, Scene
from .spec import StudySpec

if TYPE_CHECKING:
    from .results import StudyResult

# Settings that change bounds.
_SETTINGS = (
    *("duration", "skip", "samples", "rtol", "method", "max_step"),
    *("position_tolerance", "velocity_tolerance"),
)
# Most values of scenes that are listed.
_MOST_LINES = 4


def differences(result: StudyResult, reference: StudyResult) -> Iterator[str]:
    """What differs between two results besides the method."""
    if result.spec is not None and reference.spec is not None:
        yield from model_differences(result.spec, reference.spec)
    yield from unequal("interval of ", result.intervals, reference.intervals)
    yield from setting_differences(result.settings, reference.settings)
    yield from scene_differences(result.scene, reference.scene)


def study_differences(one: StudySpec, other: StudySpec) -> list[str]:
    """What differs between what two studies ask for: models, settings, features and intervals."""
    found = [*model_differences(one, other), *setting_differences(one.settings, other.settings)]
    found += unequal("feature ", one.facts()["features"], other.facts()["features"])
    return [*found, *unequal("interval of ", one.intervals, other.intervals)]


def model_differences(one: StudySpec, other: StudySpec) -> Iterator[str]:
    """Differences between what builds the scenes, or computes the runs, and its fixed keywords.

    Python functions are known by their names alone.
    """
    yield from unequal("", {"mechanism": one.name}, {"mechanism": other.name})
    yield from unequal("fixed ", one.facts()["fixed"], other.facts()["fixed"])


def setting_differences(one: Settings | None, other: Settings | None) -> Iterator[str]:
    """Differences between settings that change bounds; runs that are not simulated have none."""
    known = [
        {} if each is None else {name: getattr(each, name) for name in _SETTINGS} for each in (one, other)
    ]
    yield from unequal("", *known)


def scene_differences(one: Scene | None, other: Scene | None) -> Iterator[str]:
    """The first differences between two nominal scenes, and how many more there are."""
    if one is None or other is None:
        return
    found = list(unequal("nominal scene: ", *(_numbers(json.loads(each.to_json())) for each in (one, other))))
    yield from found[:_MOST_LINES]
    if len(found) > _MOST_LINES:
        yield f"nominal scene: {len(found) - _MOST_LINES} more values"


def unequal(what: str, one: Mapping[str, Any], other: Mapping[str, Any]) -> Iterator[str]:
    """A line for each entry that differs."""
    for name in dict.fromkeys([*one, *other]):
        if not files.same(one.get(name), other.get(name)):
            pair = (_shown(values[name]) if name in values else "none" for values in (one, other))
            yield f"{what}{name}: {' and '.join(pair)}"


def _shown(value: Any) -> str:
    """A value in a line."""
    if isinstance(value, Interval):
        nominal = "" if value.nominal == value.midpoint else f" (nominal {value.nominal:.6g})"
        return f"{value.lower:.6g} to {value.upper:.6g}{nominal}"
    if value is None:
        return "not given"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _numbers(plain: Any, path: str = "") -> dict[str, Any]:
    """The single values of a scene by their paths; entries of lists by their names, or numbers."""
    if isinstance(plain, list):
        named = [isinstance(one, dict) and "name" in one for one in plain]
        parts = {f".{one['name']}" if named[k] else f"[{k}]": one for k, one in enumerate(plain)}
    elif isinstance(plain, dict):
        parts = {f".{name}" if path else name: one for name, one in plain.items()}
    else:
        return {path: plain}
    return {where: value for own, one in parts.items() for where, value in _numbers(one, path + own).items()}
