"""``chebclear run``: one simulation at the nominal values."""

from __future__ import annotations

import argparse
import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from ...base.writing import complete_folder
from ...run.trajectory import Trajectory
from ...scene.columns import column_unit
from ..figures import draw_run
from ..options import OUTPUTS, SCENE, SETTINGS, Command, out
from ..output import Rows, print_json, require_writable, table_text, write_table
from ..scenes import hint, outputs_of, progress_of, settings_of, template_of


def run(options: argparse.Namespace) -> int:
    """Run the command."""
    template = template_of(options)
    settings = outputs_of(template, settings_of(template, options), options, orbits=True)
    require_writable(options.out)
    result = template.simulate(**settings, progress=progress_of(options))
    extremes, contacts = _extremes(result), _contacts(result)
    if options.out is not None:
        with complete_folder(options.out) as folder:
            result.save(folder / "run.npz")
            write_table(extremes, folder, "extremes")
            write_table(contacts, folder, "contacts")
            result.to_csv(folder / "run.csv")
            draw_run(result, folder)
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
        return 0
    print(f"{result.message}; {result.stats.steps} steps", end="\n\n")
    print(table_text(extremes))
    print(f"\n{table_text(contacts)}\n" if contacts else "")
    if options.out is not None:
        print(f"wrote    {options.out / 'report.html'} and more beside it")
    hint(options, "chebclear study FILE --out results" if template.intervals else "chebclear tradeoff FILE")
    return 0


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
