"""Going on with a scene that is not the one an earlier run ended with: what changed, and whether it may."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from .. import _core
from ..errors import Problem, StartError
from ..scene.scene import ClearanceRevolute, Scene, Table
from .settings import Settings
from .trajectory import EndState

if TYPE_CHECKING:
    from .._core import _Run

# Changes named one by one in a warning.
_NAMED = 5
# Largest jump of a driven joint that is rounding, relative to one radian or meter and to its position.
_JUMP = 1e-9
# Simulated time of the look at the state from which a run goes on, over the time of that state: nothing
# moves in it, and it is far above the rounding of times.
_INSTANT = 1e-9


def continuation(scene: Scene, start: EndState, settings: Settings) -> tuple[str, ...]:
    """What changes where a scene takes over the state in which a run ended, perhaps of another scene.

    The state is that of the joints: coordinates and velocities. Masses, laws and loads may change; lengths,
    drives and clearances only as far as no joint is torn apart.

    Parameters
    ----------
    scene : Scene
        What is to be simulated.
    start : EndState
        The end of the earlier run.
    settings : Settings
        How it is to be simulated.

    Returns
    -------
    tuple of str
        A warning that names the changes, or nothing.

    Raises
    ------
    StartError
        If a joint is of another kind, a driven joint would jump, or any joint of a mechanism that its drives
        prescribe, a journal would start deeper in its bearing than the clearance is wide, or loops of ideal
        joints would not close.
    """
    if start.scene is None or start.scene == scene:
        return ()
    before, after = (json.loads(each.to_json()) for each in (start.scene, scene))
    for plain in (before, after):
        plain.pop("start", None)  # where a mechanism starts says nothing of how it goes on
    changes = list(_changes("", before, after))
    if not changes:
        return ()
    _require_kinds(start.scene, scene)
    _require_whole(scene, start, settings)
    named = "; ".join(changes[:_NAMED])
    if len(changes) > _NAMED:
        named += f"; and {len(changes) - _NAMED} more"
    warning = (
        f"the run goes on with another scene than it ended with: {named}. Coordinates and velocities of the "
        "joints are kept, but for what drives prescribe; energy.balance has a step"
    )
    return (warning,)


def _require_kinds(before: Scene, after: Scene) -> None:
    """Refuse joints that kept their names only: the angle of a pin is no displacement of a guide."""
    kinds = {joint.name: type(joint).__name__ for joint in before.joints}
    problems = []
    for joint in after.joints:
        now = type(joint).__name__
        if kinds.get(joint.name, now) != now:
            message = (
                f'belongs to another mechanism: joint "{joint.name}" is a {now}, was a {kinds[joint.name]}'
            )
            problems.append(Problem("start", message))
    if problems:
        raise StartError(problems)


def _require_whole(scene: Scene, start: EndState, settings: Settings) -> None:
    """Refuse a scene whose joints do not fit together in the state it is to take over."""
    assert start.scene is not None
    facts = scene.check()
    driven = {drive.joint for drive in scene.drives}
    joints = [joint for joint in scene.joints if isinstance(joint, ClearanceRevolute)]
    prescribed = facts.degrees_of_freedom == 0
    moved = {joint.name for joint in scene.joints} if prescribed else driven
    columns = [
        name
        for name in facts.further_columns
        if name.rpartition(".")[0] in moved and name.endswith((".angle", ".displacement"))
    ]
    # Drives first: what they make jump follows from them.
    columns.sort(key=lambda name: name.rpartition(".")[0] not in driven)
    columns += [f"{joint.name}.penetration" for joint in joints]
    if not columns and not facts.cut_joints:
        return
    new = _look(scene, start, settings, columns)
    old = _look(_prolonged(start.scene, (1.0 + _INSTANT) * start.time), start, settings, columns)
    problems = []
    if new["status"] == "projection" != old["status"]:
        message = "the loops do not close in the state in which the run ended: lengths do not fit"
        problems.append(Problem("start", message))
    for name, before, after in zip(columns, old["values"][0], new["values"][0], strict=False):
        owner, _, quantity = name.rpartition(".")
        if quantity == "penetration":
            (clearance,) = (joint.clearance for joint in joints if joint.name == owner)
            if after > max(before, 0.0) + clearance:
                message = (
                    f'the journal of joint "{owner}" would start {after:.2g} m deep in its bearing, deeper '
                    f"than its clearance of {clearance:.2g} m: lengths, drives or clearances do not fit the "
                    "state in which the run ended"
                )
                problems.append(Problem("start", message))
        elif abs(after - before) > _JUMP * (1.0 + abs(before)):
            jump = f"jump from {before:.6g} to {after:.6g} {'rad' if quantity == 'angle' else 'm'}"
            if owner in driven:
                message = (
                    f'the drive of joint "{owner}" would make it {jump}: drives are functions of the time '
                    "since the first start; choose one that goes on from there"
                )
                problems.append(Problem("start", message))
            elif not problems:
                message = (
                    f'joint "{owner}" would {jump}: lengths do not fit the pose in which the run ended, and '
                    "the drives prescribe every other"
                )
                problems.append(Problem("start", message))
    if problems:
        raise StartError(problems)


def _prolonged(scene: Scene, until: float) -> Scene:
    """The scene with a further point in every table that ends before; at its own points a spline is exact."""

    def longer(part: Any) -> Any:
        tables = {item.name: getattr(part, item.name) for item in dataclasses.fields(part)}
        changed = {
            name: Table(
                (*table.times, 2.0 * table.times[-1] - table.times[0]), (*table.values, table.values[-1])
            )
            for name, table in tables.items()
            if isinstance(table, Table) and table.times[-1] < until
        }
        return dataclasses.replace(part, **changed)

    return dataclasses.replace(
        scene,
        drives=[longer(drive) for drive in scene.drives],
        forces=[longer(force) for force in scene.forces],
    )


def _look(scene: Scene, start: EndState, settings: Settings, columns: list[str]) -> _Run:
    """A scene in the state from which the run goes on; NaN if not even a step is possible."""
    instant = _INSTANT * start.time
    outputs = tuple(columns) or None
    short = dataclasses.replace(settings, duration=instant, skip=0.0, samples=2, outputs=outputs, features=())
    return _core.simulate(scene.to_json(), short.to_json(), None, start.memory)


def _changes(path: str, before: Any, after: Any) -> Iterator[str]:
    """What differs between two scenes as JSON has them, such as ``"drives[0].speed: 3.0, now 4.0"``."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in dict.fromkeys([*before, *after]):
            yield from _changes(f"{path}.{key}" if path else key, before.get(key), after.get(key))
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for index, pair in enumerate(zip(before, after, strict=True)):
            yield from _changes(f"{path}[{index}]", *pair)
    elif before != after:
        yield f"{path}: {_short(before)}, now {_short(after)}"


def _short(value: Any) -> str:
    """A number or word; how many entries a list has."""
    if isinstance(value, float):
        return f"{value:.6g}"
    return f"{len(value)} entries" if isinstance(value, dict | list) else json.dumps(value)
