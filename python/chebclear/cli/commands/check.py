"""``chebclear check``: the content of a scene file, its problems, and a picture."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from ...base.units import written
from ...base.writing import complete_folder, file_name
from ...notices import Notice
from ...plots.drawing.scene import plot_scene
from ...scene.columns import column_unit
from ...scene.parts import ClearanceRevolute, ends_of, joints_with_play
from ...scene.scene import Scene
from ...templates.template import Template
from ..options import DIRECTORY, SCENE, Command, Option
from ..output import WIDTH, draw, print_json, require_writable
from ..scenes import hint, period_of, template_of


def check(options: argparse.Namespace) -> None:
    """Run the command."""
    template = template_of(options)
    scene = template.scene()
    out = options.scene.parent if options.out is None else options.out
    picture = None if options.no_picture else out / f"{file_name(options.scene.stem)}.png"
    if picture is not None:
        require_writable(out)
        with complete_folder(out) as folder:
            draw(folder, options.scene.stem, (WIDTH, WIDTH), partial(plot_scene, scene))
    if options.json:
        print_json(_facts(template, scene, picture))
        return
    print(f"{options.scene.name}  {template.title}".rstrip(), end="\n\n")
    print(scene.describe(), end="\n\n")
    remarks = _remarks(template, scene)
    if remarks:
        print("left to defaults", *(f"  {text}" for text in remarks), sep="\n", end="\n\n")
    for line in [*_play(scene), *(_outputs(scene) if options.list_outputs else []), *_parameters(template)]:
        print(line)
    print(f"plausible: {'see the numbers to check above' if scene.check().notices else 'yes'}")
    if picture is not None:
        print(f"wrote    {picture}")
    words = "chebclear study FILE --out results" if template.intervals else "chebclear run FILE"
    if "duration" not in template.run:
        turn = period_of(template) or "T"
        words += f" --skip '{turn}' --duration '{turn}'"
    hint(options, words)


def _remarks(template: Template, scene: Scene) -> list[Notice]:
    """Defaults that may be slips: a center of mass that the file does not give, at one of several joints."""
    told = []
    ends = {end for joint in scene.joints for end in ends_of(joint)}
    for written_body, body in zip(template.source.get("bodies", ()), scene.bodies, strict=True):
        if "center_of_mass" in written_body or body.mass == 0:
            continue
        used = {name: place for name, place in body.points.items() if f"{body.name}.{name}" in ends}
        there = [name for name, place in used.items() if place == body.center_of_mass]
        if there and len(set(used.values())) > 1:
            path = f"bodies.{body.name}"
            text = (
                f'{path}: no center_of_mass is given, so it is at the joint "{there[0]}". Of a '
                "uniform link it is half way between its ends; if this is meant, as of a balanced crank, "
                "write center_of_mass = [0, 0]"
            )
            told.append(Notice("default_center", text, (path,)))
    return told


def _play(scene: Scene) -> list[str]:
    """The clearances as radial values and as diametral values for tables of fits."""
    loose = joints_with_play(scene.joints)
    if not loose:
        return []
    lines = [
        f"  {joint.name} {1e6 * joint.clearance:.6g} um "
        + ("radial" if isinstance(joint, ClearanceRevolute) else "to each side")
        + f", {2e6 * joint.clearance:.6g} um "
        + ("between the diameters" if isinstance(joint, ClearanceRevolute) else "in all")
        for joint in loose
    ]
    return ["clearance", *lines, ""]


def _outputs(scene: Scene) -> list[str]:
    facts = scene.check()
    names = [f"  {name} [{column_unit(name)}]" for name in facts.columns]
    further = [f"  {name} [{column_unit(name)}]" for name in facts.further_columns]
    return ["outputs", *names, "", "outputs by name only", *further, ""]


def _parameters(template: Template) -> list[str]:
    if not template.parameters:
        return []
    values = template.values()
    lines = ["parameters"]
    for name, one in template.parameters.items():
        line = f"  {name} = {written(values[name], one.unit)}"
        if one.interval is not None:
            ends = (written(end, one.unit) for end in (one.interval.lower, one.interval.upper))
            line += f", from {' to '.join(ends)}"
        lines.append(line + (f"; {one.note}" if one.note else ""))
    return [*lines, ""]


def _facts(template: Template, scene: Scene, picture: Path | None) -> dict[str, Any]:
    facts = scene.check()
    values = template.values()
    return {
        "title": template.title,
        "bodies": facts.bodies,
        "joints": [joint.name for joint in scene.joints],
        "clearance": {joint.name: joint.clearance for joint in joints_with_play(scene.joints)},
        "degrees_of_freedom": facts.degrees_of_freedom,
        "coordinates": facts.coordinates,
        "cut_joints": facts.cut_joints,
        "outputs": facts.columns,
        "further_outputs": facts.further_columns,
        "parameters": {
            name: {
                "nominal": values[name],
                "interval": None if one.interval is None else [one.interval.lower, one.interval.upper],
                "unit": one.unit,
                "note": one.note,
            }
            for name, one in template.parameters.items()
        },
        "notices": [asdict(one) for one in (*facts.notices, *_remarks(template, scene))],
        "picture": None if picture is None else str(picture),
    }


COMMANDS = {
    "check": Command(
        check,
        "Read a scene file, report every problem with its line, and describe the mechanism: parts with "
        "units, degrees of freedom, where loops are cut, numbers that look wrong, parameters with their "
        "intervals. Nothing is simulated.",
        "chebclear check press.toml",
        [
            *SCENE,
            Option("--out", DIRECTORY, "directory for the picture, FILE.png (default: that of FILE)"),
            Option("--list-outputs", None, "list the names of all outputs, with their units"),
            Option("--no-picture", None, "write no file"),
        ],
    )
}
