"""What a report says of requirements: which fails, by how much, and what would keep it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...base.prefixes import Form, format_tolerance
from ...base.quantities import Interval
from ...base.shown import in_a_sentence, of_many
from ...plots.drawing.scene import mechanism_picture
from ...report.document import Block, Cell, Document, Items, Picture, Section, Sentence, Table, Verdict
from ...run.report import notice_doubts, notices_section, version_fact
from ...scene.scene import Scene
from .conformance import Conformance, Share, in_percent
from .needed import Needed, needed_tolerance
from .specification import ALL


class Tolerance(NamedTuple):
    """The interval of a parameter, and how it is written."""

    interval: Interval
    unit: str
    """SI unit; empty if it is not known."""
    written: tuple[str, ...] = ()
    """Units that the user wrote."""


def conformance_document(
    conformance: Conformance,
    title: str,
    tolerances: Mapping[str, Tolerance],
    scene: Scene | None = None,
    more: Sequence[str] = (),
) -> Document:
    """The report of shares in specification, with `more` that is known of some of them, in words."""
    *_, every = conformance.values()
    beside = [f"{text}." for text in more]
    return Document(
        title=title,
        facts=[f"{every.runs:,} mechanisms", version_fact()],
        answer=[*specification(conformance), *what_to_do(conformance, tolerances), *beside],
        doubts=[*unproven(conformance), *notice_doubts(conformance.notices)],
        first=[
            *([] if scene is None else [mechanism_picture(scene)]),
            *requirements(conformance),
        ],
        sections=[
            shares_section(conformance),
            Section("The tolerances", [tolerances_table(tolerances)]),
            *notices_section(conformance.notices),
        ],
    )


def specification(conformance: Conformance) -> list[Sentence]:
    """Which requirement fails most often, by how much and in how many; or that all are kept."""
    *each, every = conformance.values()
    least, most = map(in_percent, (every.lower, every.upper))
    sure = f"with {100.0 * every.confidence:.4g} % confidence"
    if every.outside == 0:
        kept = (
            f"All {every.runs:,} mechanisms keep to {'the requirement' if not each else 'every requirement'}"
        )
        return [Verdict(f"{kept}: at least {least} are in specification, {sure}.", "good")]
    failing = sorted((one for one in each or [every] if one.outside), key=lambda one: -one.outside)
    worst, others = failing[0], failing[1:]
    told = f"{worst.name} fails in {worst.outside:,} of {worst.runs:,} mechanisms"
    reached = _reached_beyond(worst)
    told += f": {worst.specification}{reached and f', the worst reaches {reached}'}."
    if others:
        told += f" So {'do' if len(others) > 1 else 'does'} "
        told += in_a_sentence([f"{one.name} in {one.outside:,}" for one in others]) + "."
    share = f"{in_percent(every.share)} of the mechanisms are in specification"
    return [Verdict(told, "bad"), f"{share}, between {least} and {most} {sure}."]


def what_to_do(conformance: Conformance, tolerances: Mapping[str, Tolerance]) -> list[str]:
    """The tolerance that the requirement which fails most often needs; nothing where the runs do not tell."""
    *each, every = conformance.values()
    worst = max(each or [every], key=lambda one: one.outside)
    sides = {name: one.interval for name, one in tolerances.items()}
    found = needed_tolerance(worst, conformance.parameters, conformance.parameter_names, sides)
    if found is None:
        return []
    made = f"an estimate from these {found.runs:,} runs"
    source = f"{made}, not simulated"
    if found.nominal_is_outside:
        return [
            f"No tolerance helps: the mechanism at the nominal values does not keep {worst.name} itself "
            f"({made}). Other nominal values or limits do."
        ]
    many = of_many(found.share)
    if not found.parameter:
        if math.isnan(found.part):
            text = f"Not even all tolerances closed to a tenth bring {many} mechanisms within {worst.name}"
            return [f"{text} ({made})."]
        return [
            "To do: no single tolerance is enough. With all of them closed to about "
            f"{100.0 * found.part:.2g} % of what they are {many} mechanisms keep {worst.name} ({source})."
        ]
    own = tolerances[found.parameter]
    now, then = _now_and_then(own, found)
    return [
        f"To do: {found.parameter} {then} instead of {now}. With about that tolerance {many} mechanisms keep "
        f"{worst.name} ({source})."
    ]


def _now_and_then(own: Tolerance, found: Needed) -> tuple[str, str]:
    """The tolerance of a parameter now, and the one that is needed, rounded down to two digits."""
    side = own.interval
    ends = [
        _two_digits(found.part * (side.nominal - side.lower)),
        _two_digits(found.part * (side.upper - side.nominal)),
    ]
    then = Interval(side.nominal - ends[0], side.nominal + ends[1], side.nominal)
    return (
        format_tolerance(side, own.unit, own.written)[1],
        format_tolerance(then, own.unit, own.written)[1],
    )


def _two_digits(value: float) -> float:
    """A positive number rounded down to two digits."""
    if value <= 0.0:
        return 0.0
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.floor(value / step + 1e-9) * step


def _farthest(share: Share) -> tuple[Form, float, float] | None:
    """How the quantity is written, its value farthest outside or nearest to a limit, and how far beyond."""
    if np.all(np.isnan(share.lowest)):
        return None
    (lower, upper), lowest, highest = share.limits, np.nanmin(share.lowest), np.nanmax(share.highest)
    is_low = lower - lowest >= highest - upper
    value, beyond = (lowest, lower - lowest) if is_low else (highest, highest - upper)
    known = [limit for limit in share.limits if math.isfinite(limit)]
    form = Form.of((float(value), *known), share.unit, share.specification.written)
    return form, float(value), float(beyond)


def reached(share: Share) -> str:
    """The simulated value that is farthest outside of the limits, or nearest to them; empty if all failed."""
    found = _farthest(share)
    return "" if found is None else found[0].text(found[1])


def _reached_beyond(share: Share) -> str:
    """The same, with how far it is beyond its limit."""
    found = _farthest(share)
    if found is None:
        return ""
    form, value, beyond = found
    return form.text(value) + (f", {form.difference(beyond, 2)} beyond" if beyond > 0.0 else "")


def requirements(conformance: Conformance | None) -> list[Table]:
    """A line for each requirement: its verdict, the share in specification, its interval."""
    if conformance is None:
        return []
    rows: list[list[Cell]] = []
    for name, one in conformance.items():
        is_kept, is_one = one.outside == 0, len(conformance) == 1 or name != ALL
        said = "kept" if is_kept else f"fails in {one.outside:,} of {one.runs:,}"
        limits, worst = (str(one.specification), reached(one) or "-") if is_one else ("all of them", "-")
        shares = map(in_percent, (one.share, one.lower, one.upper))
        rows.append([name, Verdict(said, "good" if is_kept else "bad"), limits, worst, *shares])
    head = ["requirement", "verdict", "limits", "worst", "in specification", "at least", "at most"]
    return [Table("The requirements", head, rows)]


def unproven(conformance: Conformance | None) -> list[str]:
    """What shares in specification do not say."""
    if conformance is None:
        return []
    *_, every = conformance.values()
    told = []
    if every.failed:
        told.append(f"{every.failed} mechanisms could not be simulated; they count as outside.")
    if len(every.at) > 1:
        sides = in_a_sentence(list(every.at[0]))
        told.append(
            f"Of {sides} only the interval is known: the shares hold at its middle and ends, not between."
        )
    return told


def shares_section(conformance: Conformance) -> Section:
    """How the mechanisms are spread about the limits."""
    blocks: list[Block] = [Items([f"{name}: {one}." for name, one in conformance.items()])]
    blocks += [
        Picture(
            f"How the mechanisms are spread about the limits of {name}: {one.outside} of {one.runs} outside.",
            one.plot,
            name=f"requirement_{name}",
        )
        for name, one in conformance.items()
        if name != ALL or len(conformance) == 1
    ]
    return Section("In specification or not", blocks)


def tolerances_table(tolerances: Mapping[str, Tolerance]) -> Table:
    """The nominal value and the tolerance of each parameter."""
    rows = [
        [name, *format_tolerance(one.interval, one.unit, one.written)] for name, one in tolerances.items()
    ]
    return Table("The parameters and their tolerances", ["parameter", "nominal", "tolerance"], rows)
