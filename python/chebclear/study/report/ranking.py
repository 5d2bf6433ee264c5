"""What a report says of one feature: how far it reaches and which tolerance to tighten."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from ...base.tables import format_number
from ...report.document import Block, Picture, Section, Table, Text
from ..features.features import FeatureResult, Ranking

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def feature_section(feature: FeatureResult) -> tuple[Section, list[str]]:
    """The section of a feature, and its sentences for the answer of the report."""
    reach = feature.interval
    words = f"{format_number(reach.lower, 4)} to {format_number(reach.upper, 4)}"
    text = f"{feature.name}: {words} [SI unit], {reach.verdict}"
    text += f"; {100.0 * reach.coverage:.3g} % of the runs are in the interval made from the others"
    if not math.isnan(reach.whole_run):
        text += f"; a further run is in it with a probability of at least {100.0 * reach.whole_run:.3g} %"
    blocks: list[Block] = [Text(f"{text}.")]
    try:
        ranking = feature.ranking()
    except ValueError as error:  # too few runs
        blocks.append(Text(f"No ranking of the tolerances: {error}."))
        return Section(f"Feature: {feature.name}", blocks), [f"{text}."]
    advice = [f"{feature.name}: {sentence}." for sentence in ranking.advice()]
    blocks += [
        _table(ranking),
        Picture(_finding(ranking), partial(_tornado, ranking), height=1.0 + 0.3 * len(ranking)),
    ]
    return Section(f"Feature: {feature.name}", blocks), [f"{text}.", *advice]


def _finding(ranking: Ranking) -> str:
    first = ranking.rows[0]
    what = f"Bars of what halving each tolerance does to {ranking.feature}"
    return f"{what}: most by {first.parameter}, {first.narrowing}."


def _table(ranking: Ranking) -> Table:
    rows = [[row.parameter, str(row.narrowing), str(row.share), row.monotone or "-"] for row in ranking.rows]
    rows.append(["parameters together", "-", str(ranking.interactions), "-"])
    rows.append(["scatter", "-", str(ranking.scatter), "-"])
    return Table(
        "Which tolerance to tighten; in brackets the interval of 95 % confidence",
        ["parameter", "halving its interval narrows by", "share of the variance", "monotone"],
        rows,
    )


def _tornado(ranking: Ranking, ax: Axes) -> None:
    """Bars of narrowing with their confidence, the largest on top."""
    rows = ranking.rows[::-1]
    values = [100.0 * row.narrowing.value for row in rows]
    errors = [
        [max(0.0, value - 100.0 * row.narrowing.lower) for value, row in zip(values, rows, strict=True)],
        [max(0.0, 100.0 * row.narrowing.upper - value) for value, row in zip(values, rows, strict=True)],
    ]
    ax.barh(
        [row.parameter for row in rows], values, xerr=errors, color="tab:blue", ecolor="black", capsize=2.0
    )
    ax.axvline(0.0, color="black", linewidth=0.8)
    ax.set_xlabel("the interval narrows by [%]")
    ax.grid(axis="y", visible=False)
