"""The report of a sweep: how features vary over a parameter, resonances, and where joints lose contact."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ...base.prefixes import Form, format_quantity, format_range
from ...base.shown import in_a_sentence
from ...plots.drawing.scene import mechanism_picture
from ...report.document import Block, Cell, Document, Picture, Section, Table
from ...run.report import notice_doubts, notices_section, version_fact
from ...scene.scene import Scene

if TYPE_CHECKING:
    from ..sweep import Sweep


def sweep_document(found: Sweep, title: str | None, scene: Scene | None = None) -> Document:
    """The report of a sweep, with the mechanism if its scene is given."""
    names = list(found)
    pictures = [
        Picture(f"{name} over {found.parameter}, with its scatter.", partial(found.plot, name), name=name)
        for name in names
    ]
    drawing: list[Block] = [] if scene is None else [mechanism_picture(scene)]
    ends = format_range((float(found.points[0]), float(found.points[-1])), found.parameter_unit)
    moving = {name: int(np.count_nonzero(~found.settled(name))) for name in names}
    unsettled = [
        f"{name} has not settled at {count} of {len(found.points)} values: it still changes there from "
        "revolution to revolution."
        for name, count in moving.items()
        if count
    ]
    return Document(
        title=title or f"How does {found.parameter} change {in_a_sentence(names)}?",
        facts=[f"{found.parameter} from {ends}", f"{len(found.points)} values", version_fact()],
        answer=[*_resonances(found), *_contact(found)],
        # Each value that has not settled is a notice too.
        doubts=[*unsettled, *notice_doubts(found.notices, said=("unsettled",))],
        first=[*drawing, _means(found), *pictures[:1]],
        sections=[
            *([Section("Further features", pictures[1:])] if len(pictures) > 1 else []),
            Section("All values", [found.table]),
            *notices_section(found.notices),
        ],
    )


def _resonances(found: Sweep) -> list[str]:
    """Where the mean of each feature is largest, and whether that is a resonance."""
    told = []
    for name in found:
        mean = np.abs(found[name].mean(axis=1))
        if not np.isfinite(mean).any():
            told.append(f"{name}: no run came to its end.")
            continue
        peaks = found.resonances(name)
        for one in peaks:
            at, value = (
                format_quantity(one.at, found.parameter_unit),
                format_quantity(one.value, found.units[name]),
            )
            told.append(f"{name} has a resonance at {found.parameter} = {at}, with {value} in the mean.")
        if not peaks:
            k = int(np.nanargmax(mean))
            at = format_quantity(float(found.points[k]), found.parameter_unit)
            most = format_quantity(float(found[name][k].mean()), found.units[name])
            told.append(
                f"{name} is largest at {found.parameter} = {at}: {most} in the mean; no resonance was found."
            )
    return told


def _contact(found: Sweep) -> list[str]:
    """Where joints begin and cease to lose contact."""
    told = []
    for one in found.lift_offs:
        ends = format_range((one.lower, one.upper), found.parameter_unit)
        word = "begins" if one.loses else "ceases"
        told.append(f"{one.joint} {word} to lose contact between {found.parameter} = {ends}.")
    return told


def _means(found: Sweep) -> Table:
    """The smallest and the largest mean of each feature, and the scatter between revolutions."""
    rows: list[list[Cell]] = []
    for name in found:
        mean, scatter = found[name].mean(axis=1), found[name].std(axis=1, ddof=1)
        if not np.isfinite(mean).any():
            rows.append([name, "-", "-", "-"])
            continue
        low, high = int(np.nanargmin(mean)), int(np.nanargmax(mean))
        form = Form.of((float(mean[low]), float(mean[high])), found.units[name])
        places = [format_quantity(float(found.points[k]), found.parameter_unit) for k in (low, high)]
        ends = [
            f"{form.text(float(mean[k]))} at {place}" for k, place in zip((low, high), places, strict=True)
        ]
        rows.append([name, *ends, form.difference(float(np.nanmax(scatter)))])
    head = ["feature", "smallest mean", "largest mean", "scatter up to"]
    return Table(f"Means over the revolutions, over {found.parameter}", head, rows)
