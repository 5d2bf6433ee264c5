"""Continuing a run with a changed scene: which changes are allowed, and a warning that names them."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from ..errors import Problem, StartError
from ..notices import Notice
from ..scene.functions import Table
from ..scene.parts import joints_with_play, owner_of
from ..scene.scene import Scene, compiled
from ..scene.schema import join
from .settings import Settings
from .trajectory import EndState

if TYPE_CHECKING:
    from .._core import _Run

# Changes named one by one in a warning.
_NAMED = 5
# Largest jump of a driven joint that counts as rounding, relative to one radian or meter and to its position.
_JUMP = 1e-9
# Simulated time for a test of the state from which a run continues, relative to the time of that state:
# nothing moves in it, and it is far above rounding errors of times.
_INSTANT = 1e-9


def continuation(scene: Scene, start: EndState, settings: Settings) -> tuple[Notice, ...]:
    """A notice of the changes between a scene and that of the run from whose end it continues.

    The state consists of the coordinates and velocities of the joints. Masses, laws and loads may change;
    lengths, drives and clearances only as far as all joints stay closed: a StartError if a joint is of
    another kind, a driven joint would jump, or any joint of a mechanism that its drives prescribe, a journal
    would start deeper in its bearing than the clearance is wide, or loops of ideal joints would not close.
    """
    if start.scene is None or start.scene == scene:
        return ()
    before, after = (json.loads(each.to_json()) for each in (start.scene, scene))
    for plain in (before, after):
        if not scene.couplings:  # where wheels are put together by the first start
            plain.pop("start", None)  # it does not matter for a continuation
    found = {path: f"{path}: {one}, now {other}" for path, one, other in changes(before, after)}
    if not found:
        return ()
    _require_whole(scene, start, settings)
    named = "; ".join([*found.values()][:_NAMED])
    if len(found) > _NAMED:
        named += f"; and {len(found) - _NAMED} more"
    warning = (
        f"the run continues with another scene than it ended with: {named}. Coordinates and velocities of "
        "the joints are kept, except those that drives prescribe; energy.balance has a step"
    )
    return (Notice("other_scene", warning, tuple(found)),)


def _require_whole(scene: Scene, start: EndState, settings: Settings) -> None:
    """Refuse a scene whose joints are not closed in the state from which it continues."""
    assert start.scene is not None
    kinds = {joint.name: type(joint).__name__ for joint in start.scene.joints}
    others = [
        joint for joint in scene.joints if kinds.get(joint.name, type(joint).__name__) != type(joint).__name__
    ]
    if others:
        words = 'belongs to another mechanism: joint "{}" is a {}, was a {}'
        raise StartError(
            Problem("start", words.format(one.name, type(one).__name__, kinds[one.name])) for one in others
        )
    facts = scene.check()
    driven = {drive.joint for drive in scene.drives}
    clearances = {joint.name: joint.clearance for joint in joints_with_play(scene.joints)}
    prescribed = facts.degrees_of_freedom == 0
    moved = {joint.name for joint in scene.joints} if prescribed else driven
    columns = [
        name
        for name in facts.further_columns
        if name.rpartition(".")[0] in moved and name.endswith((".angle", ".displacement"))
    ]
    # Drives first, since jumps of other joints follow from them.
    columns.sort(key=lambda name: name.rpartition(".")[0] not in driven)
    columns += [f"{name}.penetration" for name in facts.clearance_joints if owner_of(name) in clearances]
    if not columns and not facts.cut_joints and not scene.couplings:
        return
    new = _look(scene, start, settings, columns)
    old = _look(_prolonged(start.scene, (1.0 + _INSTANT) * start.time), start, settings, columns)
    problems = []
    if new["status"] == "projection" != old["status"]:
        problems.append("the loops do not close in the state in which the run ended: lengths do not fit")
    for name, before, after in zip(columns, old["values"][0], new["values"][0], strict=False):
        owner, _, quantity = name.rpartition(".")
        if quantity == "penetration":
            clearance = clearances[owner_of(owner)]
            if after > max(before, 0.0) + clearance:
                place = f"{after:.2g} m deep in {'its bearing' if owner in clearances else 'a face'}"
                problems.append(
                    f'the contact of joint "{owner}" would start {place}, deeper '
                    f"than its clearance of {clearance:.2g} m: lengths, drives or clearances do not fit the "
                    "state in which the run ended"
                )
        elif abs(after - before) > _JUMP * (1.0 + abs(before)):
            jump = f"jump from {before:.6g} to {after:.6g} {'rad' if quantity == 'angle' else 'm'}"
            if owner in driven:
                problems.append(
                    f'the drive of joint "{owner}" would make it {jump}: drives are functions of the time '
                    "since the first start; choose one that continues from there"
                )
            elif not problems:
                problems.append(
                    f'joint "{owner}" would {jump}: lengths do not fit the configuration in which the run '
                    "ended, and the drives prescribe every other"
                )
    if problems:
        raise StartError(Problem("start", message) for message in problems)


def _prolonged(scene: Scene, until: float) -> Scene:
    """The scene with a further point in every table that ends before; at its own points a spline is exact."""

    def ends_before(table: Table, until: float) -> bool:
        is_of_time = table.over.strip() == "time" and not table.periodic and table.beyond == "end"
        return is_of_time and table.points[-1] < until

    def longer(part: Any) -> Any:
        tables = {item.name: getattr(part, item.name) for item in dataclasses.fields(part)}
        changed = {
            name: dataclasses.replace(
                table,
                points=(*table.points, 2.0 * table.points[-1] - table.points[0]),
                values=(*table.values, table.values[-1]),
            )
            for name, table in tables.items()
            if isinstance(table, Table) and ends_before(table, until)
        }
        return dataclasses.replace(part, **changed)

    return dataclasses.replace(
        scene,
        drives=[longer(drive) for drive in scene.drives],
        forces=[longer(force) for force in scene.forces],
    )


def _look(scene: Scene, start: EndState, settings: Settings, columns: list[str]) -> _Run:
    """A short run of a scene from the state in which the earlier run ended; NaN if no step is possible."""
    instant = _INSTANT * start.time
    outputs = tuple(columns) or None
    short = dataclasses.replace(settings, duration=instant, skip=0.0, samples=2, outputs=outputs, features=())
    return compiled(scene).simulate(short.to_json(), None, start.memory)


def changes(one: Any, other: Any, path: str = "") -> Iterator[tuple[str, str, str]]:
    """Where two scenes in JSON form differ and how, such as ``("drives.crank.speed", "3", "4")``."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in dict.fromkeys([*one, *other]):
            yield from changes(one.get(key), other.get(key), join(path, key))
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for index, (left, right) in enumerate(zip(one, other, strict=True)):
            name = left.get("name") if isinstance(left, dict) else None
            yield from changes(left, right, join(path, name) if name else f"{path}[{index}]")
    elif one != other:
        yield path, _short(one), _short(other)


def _short(value: Any) -> str:
    """A number or word; of a list, the number of entries."""
    if isinstance(value, float):
        return f"{value:.6g}"
    return (
        f"{len(value)} entries" if isinstance(value, dict | list) else json.dumps(value, ensure_ascii=False)
    )
