"""The template of a scene file, with the replacements of the command line; what a study of it will cost."""

from __future__ import annotations

import argparse
import dataclasses
import shlex
import sys
from typing import TYPE_CHECKING, Any

from ..run.settings import revolution_of
from ..scene.parts import loose_joints
from ..scene.usual import usual_outputs
from ..templates.reader import load
from ..templates.template import Template
from .output import tell

if TYPE_CHECKING:
    from ..execution.costs import Plan
    from ..study.study import Study

# What takes longer [s] is announced.
_LONG = 30.0
_SETTINGS = ("duration", "skip", "samples", "outputs", "method", "max_step")
ORBIT = ("eccentricity", "eccentricity_x", "eccentricity_y", "penetration")
"""Quantities of a joint that the path of its journal takes."""


def template_of(options: argparse.Namespace) -> Template:
    """The template of the file that was named, with the tolerances of a workbook if there is one."""
    workbook = getattr(options, "workbook", None)
    try:
        return load(options.scene, changes=changes_of(options), workbook=workbook)
    except ImportError as error:
        if workbook is not None:
            options.usage_error(f"argument --workbook: {error}")
        raise


def changes_of(options: argparse.Namespace) -> dict[str, Any]:
    """Values of a file that the command line replaces: options for single settings come last."""
    given = {f"run.{name}": getattr(options, name, None) for name in _SETTINGS}
    return dict(options.set) | {name: value for name, value in given.items() if value is not None}


def settings_of(template: Template, options: argparse.Namespace) -> dict[str, Any]:
    """Keywords of runs, from the file and the command line.

    Exits with a usage error if nothing says how long to simulate.
    """
    if "duration" not in template.run and not revolution_of(template.scene()):
        turn = period_of(template)
        told = f"; one revolution of its drive takes {turn}" if turn else ""
        options.usage_error(f"how long? give --duration, or duration in the table [run] of the file{told}")
    rtol = getattr(options, "rtol", None)
    return {**template.run} | ({} if rtol is None else {"rtol": rtol})


def study_settings(template: Template, options: argparse.Namespace) -> dict[str, Any]:
    """Keywords of a study, from the file and the command line."""
    names = ("threads", "store", "run_seconds", "max_seconds")
    own = {name: getattr(options, name) for name in names}
    return settings_of(template, options) | own | {"progress": progress_of(options)}


def period_of(template: Template) -> str:
    """One revolution of the drive as an argument of the command line; empty without such a drive."""
    try:
        turn = template.scene().period
    except ValueError:  # no drive at constant speed, or several
        return ""
    return f"{1e3 * turn:.6g} ms"


def outputs_of(
    template: Template, settings: dict[str, Any], options: argparse.Namespace, *, orbits: bool = False
) -> dict[str, Any]:
    """The settings with outputs: where neither file nor command line names any, the usual ones; says so.

    With `orbits` the paths of the journals in their bearings are added to these.
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
        chosen += [f"{joint.name}.{kind}" for joint in loose_joints(scene.joints) for kind in ORBIT]
    return settings | {"outputs": chosen}


def progress_of(options: argparse.Namespace) -> bool | None:
    """Whether to show progress."""
    return None if options.json or options.quiet else True


def hint(options: argparse.Namespace, words: str) -> None:
    """Say which command could come next; ``FILE`` stands for the file."""
    if not options.quiet:
        print(f"next     {words.replace('FILE', shlex.quote(str(options.scene)))}")


def plan_of(study: Study, method: str, given: dict[str, Any], options: argparse.Namespace) -> Plan | None:
    """The plan of a method of a study, printed if it was asked for or takes long; None if it is short.

    What is clearly short after two runs is not worth more of them.
    """
    plan = study.plan(method, probes=2, **given)
    if options.plan or plan.seconds > _LONG / 3.0:
        plan = study.plan(method, **given)
    if options.plan:
        tell(options, {"plan": dataclasses.asdict(plan)}, plan)
        return plan
    if plan.seconds <= _LONG:
        return None
    if not options.quiet:
        print(f"plan: {plan}", file=sys.stderr)
    return plan
