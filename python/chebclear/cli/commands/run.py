"""``chebclear run``: one simulation at the nominal values."""

from __future__ import annotations

import argparse
import dataclasses
import math
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...base.writing import complete_folder
from ...plots.runs import plot_orbit
from ...run.trajectory import Trajectory
from ...scene.columns import column_unit
from ...scene.parts import loose_joints
from ..options import OUTPUTS, SCENE, SETTINGS, Command, out
from ..output import WIDTH, Rows, draw, print_json, require_writable, table_text, write_table
from ..scenes import ORBIT, hint, outputs_of, progress_of, settings_of, template_of


def run(options: argparse.Namespace) -> None:
    """Run the command."""
    template = template_of(options)
    settings = outputs_of(template, settings_of(template, options), options, orbits=True)
    require_writable(options.out)
    result = template.simulate(**settings, progress=progress_of(options))
    extremes, contacts = _extremes(result), _contacts(result)
    if options.out is not None:
        with complete_folder(options.out) as folder:
            result.save(folder / "run.npz")
            write_table(extremes, folder, "extremes", template.written)
            write_table(contacts, folder, "contacts", template.written)
            result.to_csv(folder / "run.csv")
            _draw(result, folder)
            result.report(folder / "report.html", title=template.title or None)
    if options.json:
        print_json(
            {
                "status": result.status,
                "steps": result.stats.steps,
                "extremes": extremes,
                "contacts": contacts,
                "notices": [dataclasses.asdict(one) for one in result.notices],
            }
        )
        return
    print(f"{result.message}; {result.stats.steps} steps", end="\n\n")
    print(table_text(extremes, template.written))
    print(f"\n{table_text(contacts, template.written)}\n" if contacts else "")
    if options.out is not None:
        print(f"wrote    {options.out / 'report.html'} and more beside it")
    hint(options, "chebclear study FILE --out results" if template.intervals else "chebclear tradeoff FILE")


def _extremes(result: Trajectory) -> Rows:
    """Extremes of the continuous motion over the sampled time."""
    rows = []
    for name in result.columns:
        lowest, peak = result.lowest(name), result.peak(name)
        rows.append(
            {
                "output": name,
                "unit": column_unit(name),
                "lowest": lowest.value,
                "lowest at [s]": lowest.time,
                "largest": peak.value,
                "largest at [s]": peak.time,
            }
        )
    return rows


def _contacts(result: Trajectory) -> Rows:
    """Contacts of each clearance joint in the sampled time."""
    rows = []
    for name in result.scene.check().clearance_joints:
        own = result.contacts.joint == name
        rows.append(
            {
                "joint": name,
                "contacts": int(own.sum()),
                "fastest impact [m/s]": _largest(result.contacts.impact_velocity[own]),
                "largest force [N]": _largest(result.contacts.peak_force[own]),
                "longest [s]": _largest(result.contacts.duration[own]),
            }
        )
    return rows


def _largest(values: NDArray[np.float64]) -> float:
    """The largest of the numbers that are known; NaN without one."""
    known = values[np.isfinite(values)]
    return float(known.max()) if len(known) else math.nan


def _draw(run: Trajectory, folder: Path) -> None:
    """``outputs.png``, a panel for every unit, and ``orbit_NAME.png`` where the journal's path is known."""
    panels: dict[str, list[str]] = {}
    for name in run.columns:
        panels.setdefault(column_unit(name), []).append(name)
    draw(
        folder, "outputs", (WIDTH, 2.6 * len(panels)), *(partial(run.plot, some) for some in panels.values())
    )
    for joint in loose_joints(run.scene.joints):
        if {f"{joint.name}.{kind}" for kind in ORBIT} <= set(run.columns):
            draw(folder, f"orbit_{joint.name}", (WIDTH, WIDTH), partial(plot_orbit, run, joint.name))


COMMANDS = {
    "run": Command(
        run,
        "Simulate a scene and print the extremes of its outputs, those of the continuous motion, and its "
        "contacts.",
        "chebclear run press.toml --set joints.wrist.clearance=2e-4 --out results",
        [
            *(*SCENE, *SETTINGS, OUTPUTS),
            out("report.html, run.npz, run.csv, tables of extremes and contacts (md, csv, json) and PNGs"),
        ],
    )
}
