"""The report of two designs: which is better in which requirement, and by how much features differ."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from ..base.prefixes import Form
from ..base.shown import capital, in_a_sentence
from ..report.document import Document, Items, Judgment, Picture, Section, Sentence, Verdict
from ..run.report import notice_doubts, notices_section, version_fact

if TYPE_CHECKING:
    from .contrast import Contrast, Difference, ShareDifference


def contrast_document(found: Contrast, title: str | None, names: tuple[str, str] | None = None) -> Document:
    """The report of two designs, whose `names` are told if they are given."""
    both: list[Difference | ShareDifference] = [*found.requirements.values(), *found.features.values()]
    shares, features = found.requirements.values(), found.features.values()
    unknown = [one.name for one in features if not math.isfinite(one.upper - one.lower)]
    doubts = (
        [f"The runs do not show whether the designs differ in {in_a_sentence(unknown)}."] if unknown else []
    )
    pictures = [
        Picture(f"How the differences of {name} are spread. {one}.", one.plot)
        for name, one in found.features.items()
    ]
    told = [f"{place}: {name}" for place, name in zip(("first", "second"), names or (), strict=False)]
    return Document(
        title=title or "Which of two designs is better?",
        facts=[*told, f"intervals with {100.0 * both[0].confidence:g} % confidence", version_fact()],
        answer=[
            *_verdict(shares),
            *map(_more, shares),
            *(text for one in features for text in _feature(one)),
        ],
        doubts=[*doubts, *notice_doubts(found.notices)],
        first=[one for one in (found.requirements_table, found.table) if one.rows],
        sections=[
            Section("What differs in the two designs", [Items(found.changes or ["nothing"])]),
            *([Section("How the differences are spread", pictures)] if pictures else []),
            *notices_section(found.notices),
        ],
    )


def _verdict(shares: Collection[ShareDifference]) -> list[Sentence]:
    """Which design is better in which of the requirements."""
    better: dict[str, list[str]] = {"second": [], "first": []}
    for one in shares:
        if one.better is not None:
            better[one.better].append(one.name)
    told = [
        f"the {design} design is better in {in_a_sentence(names)}"
        for design, names in better.items()
        if names
    ]
    # A gain here and a loss there are no clear answer.
    clear: Judgment = "good" if len(told) == 1 else "fair"
    open_ = [one.name for one in shares if one.better is None]
    told += [f"neither is shown to be better in {in_a_sentence(open_)}"] if open_ else []
    return [Verdict(f"{capital('; '.join(told))}.", clear)] if told else []


def _more(one: ShareDifference) -> str:
    """How many more mechanisms keep to a requirement."""
    first, second = (f"{100.0 * share:.3g} %" for share in one.shares)
    points = [f"{100.0 * part:+.3g}" for part in (one.difference, one.lower, one.upper)]
    return (
        f"{one.name}, {one.specification}: {first} of the mechanisms keep to it in the first design, "
        f"{second} in the second; {points[0]} points, {points[1]} to {points[2]} ({one.pairs} pairs)."
    )


def _feature(one: Difference) -> list[str]:
    """By how much a feature differs, or that it hardly does; nothing where the runs do not tell."""
    if not math.isfinite(one.upper - one.lower):
        return []
    first = float(np.median(one.first))
    form = Form.of((one.median, one.lower, one.upper), one.unit, one.written)
    before = Form.of((first,), one.unit, one.written).text(first)
    if one.differs:
        word = "larger" if one.median > 0.0 else "smaller"
        ends = form.range(*sorted((abs(one.lower), abs(one.upper))))
        return [
            f"{one.name} is {word} in the second design by {form.text(abs(one.median))} in the median, "
            f"{ends}; in the first it is {before}."
        ]
    most = max(abs(one.lower), abs(one.upper))
    part = f", {100.0 * most / abs(first):.2g} % of it" if first else ""
    return [
        f"{one.name} is about the same in both designs, {before}: the median difference is at most "
        f"{form.text(most)}{part}."
    ]
