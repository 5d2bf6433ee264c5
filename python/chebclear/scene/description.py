"""A scene in words: its parts with units, its degrees of freedom, and the joints that are cut, with the
reason.

The units are those of the fields of the records, so that a new kind of part needs no code here.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..base.arguments import as_number
from ..base.shown import listed
from ..base.units import units
from ..errors import SceneError
from .functions import Expression, Table, unit_of_points
from .parts import GROUND, Inspection, Prismatic, Stop, ends_of, has_contacts, joints_with_play, owner_of
from .schema import Part, Points

if TYPE_CHECKING:
    from .scene import Scene

# Most numbers of a table that are shown.
_LONG = 8


def summarize_scene(scene: Scene) -> str:
    """The text of ``repr(scene)``: numbers and names of the parts; of many, the first ones."""
    parts = {name: _parts(getattr(scene, name)) for name in scene._choices}
    lines = [f"<Scene: {_counts(parts)}"]
    for name, found in parts.items():
        if found:
            names = (str(getattr(part, "name", None) or type(part).__name__.lower()) for part in found)
            lines.append(f"  {name}: {listed(names)}")
    clearances = joints_with_play(parts["joints"])
    if clearances:
        lines.append(
            f"  clearance: {listed(f'{part.name} {_number(part.clearance)} m' for part in clearances)}"
        )
    return "\n".join(lines) + ">"


def describe_scene(scene: Scene) -> str:
    """The text of `Scene.describe`, of a scene that is right or wrong."""
    try:
        facts, problems = scene.check(), []
    except SceneError as error:
        facts, problems = None, error.problems
    parts = {name: _parts(getattr(scene, name)) for name in scene._choices}
    lines = [_counts(parts)]
    if isinstance(scene.ground, Points) and scene.ground:
        lines += ["", f"ground: points [m] {_points(scene.ground)}"]
    lines += ["", "bodies", *_records(parts["bodies"], ())]
    if facts is not None:
        size = max((abs(number) for pose in facts.poses for number in pose[:2]), default=0.0) or 1.0
        poses = zip(facts.bodies, facts.poses, strict=True)
        lines += [
            "",
            "assembled at x, y [m], angle [rad]",
            *_table([[name, *_pose(at, size)] for name, at in poses]),
        ]
    slides = {joint.name for joint in parts["joints"] if isinstance(joint, Prismatic)}
    for name, found in parts.items():
        if name == "joints" or (found and name != "bodies"):
            lines += ["", name, *_records(found, slides)]
    lines.append("")
    if facts is None:
        lines += ["This scene cannot be simulated:", *(f"  {problem}" for problem in problems)]
    else:
        lines += _mobility(scene, facts)
        if facts.notices:
            lines += ["numbers to check", *(f"  {notice}" for notice in facts.notices)]
    return "\n".join(lines)


def _parts(value: Any) -> tuple[Any, ...]:
    return value if isinstance(value, tuple) else ()


def _counts(parts: Mapping[str, Sequence[Any]]) -> str:
    # Initial conditions and couplings are optional.
    counted = {name: found for name, found in parts.items() if found or name not in ("start", "couplings")}
    return ", ".join(f"{len(found)} {_plural(name, len(found))}" for name, found in counted.items())


def _plural(name: str, count: int) -> str:
    if name == "start":
        name = "start conditions"
    if count != 1:
        return name
    return "body" if name == "bodies" else name.removesuffix("s")


def _number(value: Any) -> str:
    number = as_number(value)
    return repr(value) if number is None else f"{number + 0.0:.6g}"  # -0 is 0


def _vector(value: Any) -> str:
    if not isinstance(value, tuple):
        return _number(value)
    shown = [_number(item) for item in value]
    if len(shown) > _LONG:
        shown = [*shown[: _LONG - 2], f"... {len(shown) - _LONG + 1} more ...", shown[-1]]
    return f"({', '.join(shown)})"


def _pose(pose: tuple[float, float, float], size: float) -> list[str]:
    """Without the rounding errors of the assembly."""
    x, y, angle = pose
    return [_number(round(value / of, 12) * of) for value, of in ((x, size), (y, size), (angle, 1.0))]


def _points(points: Points) -> str:
    return ", ".join(f"{name} {_vector(position)}" for name, position in points.items())


def _table(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows with aligned columns."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def _records(records: Iterable[Any], slides: Collection[str]) -> list[str]:
    """One line for each record, and one for each record inside it; `slides` names the prismatic joints."""
    rows: list[list[str]] = []
    inner: list[list[str]] = []
    for record in records:
        if not isinstance(record, Part):
            rows.append([repr(record), "", ""])
            inner.append([])
            continue
        fields = dict(vars(record))
        name = fields.pop("name", None)
        held = {key: fields.pop(key) for key in record._choices}
        kind = _kind(record)
        unit = _units_at(record, slides)
        rows.append(
            [kind, "", _fields(fields, unit)]
            if name is None
            else [str(name), kind if record._tag else "", _fields(fields, unit)]
        )
        driver = str(getattr(record, "driver", ""))
        inner.append([f"{key}: {_held(value, unit.get(key, '?'), driver)}" for key, value in held.items()])
    if not rows:
        return ["  none"]
    lines = []
    for line, more in zip(_table(rows), inner, strict=True):
        lines += [line, *(f"      {text}" for text in more)]
    return lines


def _units_at(record: Part, slides: Collection[str]) -> dict[str, str]:
    """Units of a record; where they depend on its joint, as in ``"rad or m"``, the one that applies."""
    driven = str(getattr(record, "driven", "")).endswith(".displacement")
    choice = -1 if driven or getattr(record, "joint", None) in slides else 0
    return {name: unit.split(" or ")[choice] for name, unit in units(type(record)).items()}


def _held(value: Any, unit: str, driver: str) -> str:
    """A law, or a number or function with the unit of its owner; of the `driver` if that is a coupling."""
    if value is None:
        return "none"
    if as_number(value) is not None:
        return f"{_number(value)} [{unit}]"
    if not isinstance(value, Part):
        return repr(value)
    inner = {name: re.sub(r"\bunit\b", unit, own) for name, own in units(type(value)).items()}
    if isinstance(value, Table):
        inner["points"] = unit_of_points(driver or str(value.over))
    return f"{_kind(value)}, {_fields(vars(value), inner)}"


def _kind(record: Part) -> str:
    return type(record).__name__ if record._tag is None else record._tag[1].replace("_", " ")


def _fields(fields: dict[str, Any], unit: dict[str, str]) -> str:
    shown = []
    for name, value in fields.items():
        if value is None or value is False:
            continue
        words = name.replace("_", " ")
        if value is True:
            shown.append(words)
        elif isinstance(value, str):
            shown.append(f"{words} {value}")
        elif isinstance(value, Points):
            shown.append(f"{words} {_points(value)} [{unit.get(name, '?')}]" if value else "")
        elif isinstance(value, Expression):
            constants = "".join(f", {key} {_number(number)}" for key, number in value.constants.items())
            shown.append(f"{words} {value.text} [{unit.get(name, '?')}]{constants}")
        elif as_number(value) is not None or isinstance(value, tuple):
            of = unit.get(name, "?").replace("exponent", _number(fields.get("exponent", "exponent")))
            shown.append(f"{words} {_vector(value)} [{of}]")
        else:
            shown.append(f"{words} {value!r}")
    return ", ".join(filter(None, shown))


def _mobility(scene: Scene, facts: Inspection) -> list[str]:
    """Degrees of freedom, coordinates, loops and cut joints."""
    joints = {joint.name: joint for joint in scene.joints}
    clearance = [name for name in facts.cut_joints if has_contacts([joints[name]])]
    closures = [name for name in facts.cut_joints if name not in clearance]
    freedom = facts.degrees_of_freedom
    reason = f"{len(facts.coordinates)} {_plural('coordinates', len(facts.coordinates))}"
    if closures:
        reason += f" less {2 * len(closures)} equations of {len(closures)} {_plural('loops', len(closures))} "
        reason += "of ideal joints"
    tied = sum(coupling.backlash is None for coupling in scene.couplings)
    if tied:
        reason += f" less {tied} {_plural('couplings', tied)}"
    lines = [f"degrees of freedom: {freedom} ({reason})"]
    if freedom == 0:
        lines.append(
            "  the drives prescribe the whole motion: it is solved for at each instant, not integrated"
        )
    if facts.coordinates:
        named = ", ".join(f"{name} [{_coordinate_unit(name, joints)}]" for name in facts.coordinates)
        lines.append(f"coordinates: {named}")
    ends = {owner_of(end) for joint in scene.joints for end in ends_of(joint)}
    loops = len(scene.joints) - len(facts.bodies) + (0 if GROUND in ends else 1)
    lines.append(f"independent loops: {loops}")
    lines += ["cut joints" if facts.cut_joints else "cut joints: none"]
    for name in clearance:
        play = "" if isinstance(joints[name], Stop) else "has clearance and "
        lines.append(f"  {name}: it {play}acts by a contact force")
    lines += [f"  {name}: it closes a loop of ideal joints, by two Lagrange multipliers" for name in closures]
    if closures:
        lines.append("redundant constraints: none, the loop equations are independent at the start")
    lines.append(f"outputs: {len(facts.columns)} columns, {len(facts.further_columns)} further ones by name")
    return lines


def _coordinate_unit(name: str, joints: dict[str, Any]) -> str:
    """Unit of a coordinate, which is named by its joint, or by a floating body and its direction."""
    if name in joints:
        return "m" if isinstance(joints[name], Prismatic) else "rad"
    return "rad" if name.endswith(".angle") else "m"
