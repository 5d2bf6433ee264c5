"""The template of a scene file, with the replacements of the command line."""

from __future__ import annotations

import argparse
import shlex
import sys
from typing import Any

from ..scene.parts import ClearanceRevolute, Prismatic, Revolute
from ..scene.scene import Scene
from ..templates.reader import load
from ..templates.template import Template

_SETTINGS = ("duration", "skip", "samples", "outputs", "method")
SAMPLES = 1001
"""Samples of a run whose file does not say."""
MOST_OUTPUTS = 12
"""Outputs of a command that names none [-]: as many as a report shows without tiring its reader."""
_GROUND = "ground"


def template_of(options: argparse.Namespace) -> Template:
    """The template of the file that was named."""
    return load(options.scene, changes=changes_of(options))


def changes_of(options: argparse.Namespace) -> dict[str, Any]:
    """Values of a file that the command line replaces: options for single settings come last."""
    given = {f"run.{name}": getattr(options, name, None) for name in _SETTINGS}
    return dict(options.set) | {name: value for name, value in given.items() if value is not None}


def settings_of(template: Template, options: argparse.Namespace) -> dict[str, Any]:
    """Keywords of runs, from the file and the command line.

    Exits with a usage error if nothing says how long to simulate.
    """
    if "duration" not in template.run:
        options.usage_error("how long? give --duration, or duration in the table [run] of the file")
    rtol = getattr(options, "rtol", None)
    return {"samples": SAMPLES, **template.run} | ({} if rtol is None else {"rtol": rtol})


def outputs_of(
    template: Template, settings: dict[str, Any], options: argparse.Namespace, *, orbits: bool = False
) -> dict[str, Any]:
    """The settings with outputs: where neither file nor command line names any, the usual ones; says so.

    Parameters
    ----------
    template : Template
        The mechanism.
    settings : dict
        Keywords of runs.
    options : argparse.Namespace
        The command line.
    orbits : bool
        Whether the paths of the journals in their bearings are wanted too.
    """
    if "outputs" in settings:
        return settings
    scene = template.scene()
    facts = scene.check()
    chosen = usual_outputs(scene)
    if not options.quiet:
        every = len(facts.columns) + len(facts.further_columns)
        print(
            f"note: no outputs are named, so of {every} these are taken: {', '.join(chosen)}. Others by "
            'outputs = ["NAME", ...] in the table [run] of the file, or by --outputs NAME,NAME; '
            f"chebclear check {shlex.quote(str(options.scene))} --list-outputs names all of them",
            file=sys.stderr,
        )
    if orbits:
        kinds = ("eccentricity", "eccentricity_x", "eccentricity_y", "penetration")
        chosen += [f"{joint.name}.{kind}" for joint in _loose(scene) for kind in kinds]
    return settings | {"outputs": chosen}


def usual_outputs(scene: Scene) -> list[str]:
    """What is mostly asked of a mechanism: the motion of what slides or swings, forces in play, torques.

    Bodies that slide on the ground; without one, those on a bearing of the ground that no drive turns; else
    the position of the last body.
    """
    driven = {drive.joint for drive in scene.drives}
    sliding: list[str] = []
    swinging: list[str] = []
    for joint in scene.joints:
        if isinstance(joint, ClearanceRevolute) or joint.name in driven:
            continue
        ends = [end.partition(".")[0] for end in (joint.a, joint.b)]
        if _GROUND not in ends:
            continue
        body = ends[ends[0] == _GROUND]
        if isinstance(joint, Prismatic):
            along = "x" if abs(joint.axis[0]) >= abs(joint.axis[1]) else "y"
            sliding += [f"{body}.{kind}{along}" for kind in ("", "v", "a")]
        elif isinstance(joint, Revolute):
            swinging += [f"{body}.{kind}" for kind in ("angle", "angular_velocity", "angular_acceleration")]
    chosen = sliding or swinging
    if not chosen:
        chosen = [f"{scene.bodies[-1].name}.{kind}" for kind in ("x", "y")]
    chosen += [f"{joint.name}.normal_force" for joint in _loose(scene)]
    known = scene.check().columns
    chosen += [f"{drive.name}.torque" for drive in scene.drives if f"{drive.name}.torque" in known]
    return list(dict.fromkeys(chosen))[:MOST_OUTPUTS]


def _loose(scene: Scene) -> list[ClearanceRevolute]:
    return [joint for joint in scene.joints if isinstance(joint, ClearanceRevolute)]


def progress_of(options: argparse.Namespace) -> bool | None:
    """Whether to show progress."""
    return None if options.json or options.quiet else True


def hint(options: argparse.Namespace, words: str) -> None:
    """Say which command could come next; ``FILE`` stands for the file."""
    if not options.quiet:
        print(f"next     {words.replace('FILE', shlex.quote(str(options.scene)))}")
