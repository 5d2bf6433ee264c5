"""The report of one run."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import fields
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.files import package_version
from ..base.prefixes import Form, format_exact, format_quantity, format_range
from ..base.shown import capital, in_a_sentence
from ..base.units import units
from ..notices import Notice, shown_first
from ..plots.animation.film import outputs_film
from ..plots.drawing.pose import pose_columns
from ..plots.drawing.scene import mechanism_picture
from ..report.document import Block, Document, Items, Listing, Moving, Picture, Section, Table
from ..scene.columns import column_unit
from ..scene.scene import Scene
from ..scene.usual import usual_outputs
from .settings import Settings

if TYPE_CHECKING:
    from .trajectory import Trajectory

MOST_PICTURES = 6
"""Most outputs that are drawn by default [-]."""
# Outputs that are drawn in a notebook [-].
_FEW = 2


def run_document(run: Trajectory, title: str | None) -> Document:
    """The report of one run; see `Trajectory.report`."""
    shown = outputs_to_show(run.scene, run.columns, run.settings.outputs or ())
    extremes = [_extremes(run, name) for name in shown]
    pictures = [
        Picture(
            f"{name} against time, from {_form(run, unit, low, high).range(low.value, high.value)}.",
            partial(run.plot, name),
        )
        for name, unit, low, high in extremes
    ]
    return Document(
        title=title or _question(shown),
        facts=[
            f"run from {format_quantity(run.t[0], 's')} to {format_quantity(run.end_time, 's')}",
            version_fact(),
        ],
        answer=_answer(run, extremes),
        first=[*_moving(run, shown), _extremes_table(run, extremes)],
        doubts=_doubts(run, extremes),
        sections=[
            Section("Motion", pictures),
            *([Section("Contacts", [_contacts_table(run)])] if len(run.contacts.onset) else []),
            reproduction(
                run.settings,
                run.scene,
                run_script(run.settings, shown),
                "A script that simulates it again",
                [costs_table([run.stats])],
            ),
            *notices_section(run.notices),
        ],
    )


def _moving(run: Trajectory, shown: Sequence[str]) -> list[Block]:
    """The drawing of the mechanism, in motion if the run has the positions of its bodies, and its outputs."""
    still, film = mechanism_picture(run.scene), partial(outputs_film, run, shown)
    if run.end_time <= run.t[0]:
        return [still]
    moves = set(pose_columns(run.scene)) <= set(run.columns)
    return [Moving(still, film)] if moves else [still, Moving(None, film)]


def _answer(run: Trajectory, extremes: Sequence[tuple[str, str, Any, Any]]) -> list[str]:
    """Whether the run went to its end, the first output, and the largest force."""
    sentences = []
    if not run.success:
        sentences.append(f"The run ended early, at {format_quantity(run.end_time, 's')}: {run.message}.")
    for name, unit, low, high in extremes[:1]:
        reach = _form(run, unit, low, high).range(low.value, high.value)
        sentences.append(f"{name} moves within {reach}: it is largest at {format_quantity(high.time, 's')}.")
    forces = [(one, name) for name, unit, *ends in extremes if unit == "N" for one in ends]
    if forces:
        most, name = max(forces, key=lambda one: abs(one[0].value))
        size = format_quantity(most.value, "N", written=run.written)
        sentences.append(f"The largest force is {size}, {name} at {format_quantity(most.time, 's')}.")
    return sentences


def _doubts(run: Trajectory, extremes: Sequence[tuple[str, str, Any, Any]]) -> list[str]:
    doubts = notice_doubts(run.notices)
    for name, _, low, high in extremes:
        early = [word for word, one in (("lowest", low), ("highest", high)) if one.in_transient]
        if early:
            doubts.append(
                f"{name} is {' and '.join(early)} in the first revolution, in the starting transient: "
                "a skipped time leaves it out."
            )
    if run.error is None:
        doubts.append('The error of the run was not estimated; simulate(..., error="estimate") does so.')
    return doubts


def _question(names: Sequence[str]) -> str:
    """The question that a run answers."""
    if not names:
        return "How does the mechanism move?"
    return f"How {'does' if len(names) == 1 else 'do'} {in_a_sentence(names)} move?"


def outputs_to_show(scene: Scene, columns: Sequence[str], named: Sequence[str] = ()) -> list[str]:
    """The outputs to draw: all of few, otherwise the usual ones, then those that were named."""
    if len(columns) <= MOST_PICTURES:
        return list(columns)
    wanted = dict.fromkeys([*usual_outputs(scene), *named])
    found = [name for name in wanted if name in columns]
    return (found or list(columns))[:MOST_PICTURES]


def _extremes(run: Trajectory, name: str) -> tuple[str, str, Any, Any]:
    return name, column_unit(name), run.lowest(name), run.peak(name)


def _form(run: Trajectory, unit: str, low: Any, high: Any) -> Form:
    """How the extremes of an output are written."""
    return Form.of((low.value, high.value), unit, run.written)


def _extremes_table(run: Trajectory, extremes: Sequence[tuple[str, str, Any, Any]]) -> Table:
    head = ["output", "lowest", "at", "highest", "at"]
    rows = [
        [
            name,
            _form(run, unit, low, high).text(low.value),
            format_quantity(low.time, "s"),
            _form(run, unit, low, high).text(high.value),
            format_quantity(high.time, "s"),
        ]
        for name, unit, low, high in extremes
    ]
    if run.error is not None:
        head += ["error at most", "known until"]
        for row, (name, unit, *_) in zip(rows, extremes, strict=True):
            error = run.error[name]
            end = float(run.t[-1]) if math.isinf(error.horizon) else error.horizon
            row += [format_quantity(error.claim, unit, 2, run.written), format_quantity(end, "s")]
    return Table("Extremes of the continuous motion, not of the samples", head, rows)


def notebook_blocks(run: Trajectory) -> list[Block]:
    """What notebooks show of a run: a few of its outputs, and the ranges of all."""
    shown = outputs_to_show(run.scene, run.columns, run.settings.outputs or ())[:_FEW]
    curves = [Picture(f"{name} of the run against time.", partial(run.plot, name)) for name in shown]
    return [*curves, columns_table(run)]


def columns_table(run: Trajectory) -> Table:
    """Every column with the range of its samples."""
    rows = []
    for name in run.columns:
        values = run[name][np.isfinite(run[name])]
        reach = (float(values.min()), float(values.max())) if len(values) else (math.nan, math.nan)
        rows.append([name, format_range(reach, column_unit(name), written=run.written)])
    return Table("Ranges of the samples; run.peak finds extrema between them", ["output", "range"], rows)


def _contacts_table(run: Trajectory) -> Table:
    """Number and strength of the contacts of each joint."""
    contacts, rows = run.contacts, []
    for joint in dict.fromkeys(contacts.joint.tolist()):
        chosen = contacts.joint == joint
        impact = contacts.impact_velocity[chosen]
        fastest = float(np.nanmax(impact)) if np.isfinite(impact).any() else math.nan
        largest = int(np.argmax(np.where(chosen, contacts.peak_force, -np.inf)))
        rows.append(
            [
                joint,
                str(int(chosen.sum())),
                format_quantity(fastest, "m/s", written=run.written),
                format_quantity(float(contacts.peak_force[largest]), "N", written=run.written),
                format_quantity(float(contacts.peak_time[largest]), "s"),
            ]
        )
    head = ["joint", "contacts", "fastest impact", "largest force", "at"]
    return Table("Contacts in the sampled time", head, rows)


def costs_table(stats: Sequence[Any]) -> Table:
    """Work of some runs, in counts that do not depend on the machine."""
    names = ("steps", "rejected", "stages", "evaluations", "jacobians", "events")
    rows = []
    for name in names:
        counts = [getattr(one, name) for one in stats]
        shown = [sum(counts)] if len(stats) == 1 else [sum(counts), min(counts), max(counts)]
        rows.append([name, *(f"{count:,}".replace(",", "\u202f") for count in shown)])
    head = (
        ["count", "in all"]
        if len(stats) == 1
        else ["count", "in all", "smallest in a run", "largest in a run"]
    )
    return Table("Work of the integrator, in counts that do not depend on the computer", head, rows)


def version_fact() -> str:
    """The version that wrote the report."""
    return f"chebclear {package_version()}"


def reproduction(
    settings: Settings, scene: Scene, script: Listing | None, meaning: str, more: Sequence[Block] = ()
) -> Section:
    """How to reproduce the result: settings, versions, scene and script."""
    import platform

    known = units(Settings)
    rows = []
    for item in fields(settings):
        value = getattr(settings, item.name)
        if value is None or value == ():
            continue
        if isinstance(value, tuple):
            text = ", ".join(map(str, value))
        elif item.name in known:
            text = format_exact(value, known[item.name])
        else:
            text = f"{value:g}" if isinstance(value, float) else str(value)
        rows.append([item.name, text])
    rows += [
        ["chebclear", package_version()],
        ["numpy", np.__version__],
        ["python", platform.python_version()],
    ]
    rows.append(["platform", platform.platform()])
    listings = [Listing("scene.json", scene.to_json(), "The scene, as scene.json")]
    if script is not None:
        listings.insert(0, Listing(script.name, script.text, meaning))
    return Section(
        "How to reproduce it", [Table("Settings and versions", ["setting", "value"], rows), *listings, *more]
    )


def run_script(settings: Settings, outputs: Sequence[str]) -> Listing:
    """A script that simulates a scene file with these settings."""
    lines = [
        "from pathlib import Path",
        "",
        "import chebclear as cc",
        "",
        'scene = cc.Scene.from_json(Path("scene.json").read_text(encoding="utf-8"))',
        "run = cc.simulate(",
        "    scene,",
        *(f"    {name}={value!r}," for name, value in settings_in_script(settings).items()),
        ")",
        f"print(run.status, run.peak({outputs[0]!r}))" if outputs else "print(run.status)",
    ]
    return Listing("run.py", "\n".join(lines) + "\n", "A script")


def settings_in_script(settings: Settings) -> dict[str, Any]:
    """Keywords of `simulate` and `Study` that differ from their defaults."""
    names = (
        "duration samples skip rtol method outputs max_step max_steps max_events position_tolerance "
        "velocity_tolerance"
    )
    defaults = {"skip": 0.0, "max_steps": 10_000_000, "max_events": 1_000_000}
    kept = {name: getattr(settings, name) for name in names.split()}
    kept = {name: list(value) if isinstance(value, tuple) else value for name, value in kept.items()}
    return {name: value for name, value in kept.items() if value is not None and value != defaults.get(name)}


MOST_NOTICES = 3
"""Most notices that are shown beside an answer in full [-]; a sentence each."""


def notice_doubts(notices: Sequence[Notice], said: Collection[str] = ()) -> list[str]:
    """What notices say that may change the answer, but for those codes of which the answer has `said` it."""
    texts = shown_first(one for one in notices if one.code not in said)
    more = len(texts) - MOST_NOTICES
    told = [f"{capital(text)}." for text in texts[:MOST_NOTICES]]
    return [*told, f"{more} more such warnings are among the details."] if more > 0 else told


def notices_section(notices: Sequence[Notice]) -> list[Section]:
    """All notices, if there are any: those that may change the answer first."""
    texts = dict.fromkeys([*shown_first(notices), *(one.text for one in notices)])
    return [Section("Warnings", [Items(list(texts))])] if texts else []
