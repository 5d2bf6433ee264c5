"""Output of studies: the table of verdicts, features, pictures, the whole result."""

from __future__ import annotations

import argparse
import dataclasses
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from ..base.writing import complete_folder
from ..report import html
from ..report.document import Document
from ..study.nominal import at_other_tolerances
from ..study.report.document import study_document
from ..study.report.extent import extent
from ..study.report.summary import findings, suggestions
from .output import Rows, draw, print_json, tell, write_table
from .scenes import hint, template_of

if TYPE_CHECKING:
    from ..execution.costs import Plan
    from ..study.requirements.conformance import Conformance
    from ..study.results import StudyResult
    from .traces import TraceFit

EXIT_NOT_MET = 3
# Which verdicts a requirement accepts.
DEMANDS = {"proved": ("proved",), "estimated": ("proved", "estimated")}


def verdicts(result: StudyResult) -> Rows:
    """A row for every output: its range over the box, and its verdict."""
    rows = []
    for name in result:
        band = result[name]
        lower, upper, *_ = extent(result, band)
        rows.append(
            {
                "output": name,
                "unit": band.unit,
                "lowest": lower + 0.0,  # no -0
                "largest": upper + 0.0,
                "widest": band.max_width,
                "verdict": band.verdict,
                "stay inside [%]": 100.0 * band.whole_run,
                "inside at an instant [%]": 100.0 * band.coverage,
                "polynomial misses [% of width]": 100.0 * band.margin.error,
            }
        )
    return rows


def finish(
    result: StudyResult,
    options: argparse.Namespace,
    title: str,
    plan: Plan | None,
    fit: TraceFit | None = None,
) -> int:
    """Write what was asked for under this title, print shares and verdicts, and judge these."""
    table = verdicts(result)
    rankings = _rankings(result)
    if options.out is not None:
        with complete_folder(options.out) as folder:
            result.save(folder / "study.npz")
            write_table(table, folder, "verdicts", () if result.spec is None else result.spec.written)
            texts = [str(result), *([] if fit is None else [str(fit)]), *rankings]
            (folder / "result.txt").write_text("\n\n".join(texts) + "\n", encoding="utf-8")
            if getattr(options, "workbook", None) is not None:
                template_of(options).to_workbook(folder / "workbook.xlsx", result)
            checked = at_other_tolerances(result) if getattr(options, "check", False) else ()
            document = study_document(result, title, checked)
            if fit is not None:
                write_table(fit.rows, folder, "measured")
                document = dataclasses.replace(document, sections=[fit.section, *document.sections])
            html.write(document, folder / "report.html", pictures=folder)
    require = getattr(options, "require", None) or ""
    accepted = DEMANDS.get(require, ())
    asked = 0.0 if require != "estimated" or result.requirement is None else result.requirement.coverage
    poor = [
        name
        for name, band in result.items()
        if accepted and (band.verdict not in accepted or band.coverage < asked)
    ]
    if options.json:
        print_json(
            {
                "kind": result.kind,
                "status": result.status,
                "plan": None if plan is None else dataclasses.asdict(plan),
                "runs": len(result.parameters),
                "intervals": {name: [side.lower, side.upper] for name, side in result.intervals.items()},
                "shares": [] if result.conformance is None else share_rows(result.conformance),
                "measured": [] if fit is None else fit.rows,
                "identified": None if fit is None else fit.region,
                "verdicts": table,
                "rankings": rankings,
                "statement": result.statement,
                "notices": [dataclasses.asdict(one) for one in result.notices],
                "not_met": poor,
            }
        )
        return EXIT_NOT_MET if poor else 0
    print("\n".join([findings(result), *(f"next: {text}" for text in suggestions(result))]), end="\n\n")
    if fit is not None:
        print(fit, end="\n\n")
    for text in rankings:
        print(text, end="\n\n")
    if options.out is not None:
        print(f"wrote    {options.out / 'report.html'} and more beside it")
    print(f"took     {time.monotonic() - options.started:.1f} s in all")
    if poor:
        print(f"not {require}: {', '.join(poor)}")
        return EXIT_NOT_MET
    if options.out is None:
        hint(options, f"chebclear {options.command} FILE --out results")
    return 0


def hand_over(
    options: argparse.Namespace,
    found: object,
    name: str,
    tables: Mapping[str, Rows],
    plots: Mapping[str, Callable[..., object]],
    facts: Mapping[str, Any],
    document: Callable[[], Document],
) -> None:
    """Write what was found as files and as a report, if they are asked for, and print it, or the facts as
    JSON."""
    if options.out is not None:
        with complete_folder(options.out) as folder:
            for table, rows in tables.items():
                write_table(rows, folder, table)
            (folder / f"{name}.txt").write_text(f"{found}\n", encoding="utf-8")
            html.write(document(), folder / "report.html")
            for picture, plot in plots.items():
                draw(folder, picture, (6.4, 4.8), plot)
    wrote = "" if options.out is None else f"\nwrote    {options.out / 'report.html'} and more beside it"
    tell(options, facts, f"{found}{wrote}")


def share_rows(found: Conformance) -> Rows:
    """A row for every requirement."""
    return [
        {
            "requirement": name,
            "limits": str(one.specification),
            "share": one.share,
            "at least": one.lower,
            "at most": one.upper,
            "outside": one.outside,
            "failed": one.failed,
            "runs": one.runs,
        }
        for name, one in found.items()
    ]


def _rankings(result: StudyResult) -> list[str]:
    """The ranking of the tolerances for every feature, in words."""
    texts = []
    for name in result.features.names:
        try:
            texts.append(str(result.ranking(name)))
        except ValueError as error:  # too few runs to tell
            texts.append(f"{name}: {error}")
    return texts
