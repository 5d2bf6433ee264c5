"""The section of a report on one feature: its range, and which tolerance to tighten."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

from ...base.prefixes import format_range
from ...base.shown import capital
from ...plots.features import plot_ranking
from ...report.document import Block, Items, Picture, Section, Text
from ..band.margin import percent
from ..features.features import FeatureResult
from ..features.ranking import Ranking, ranking_table

if TYPE_CHECKING:
    pass


def feature_section(feature: FeatureResult) -> Section:
    """The section of a feature."""
    reach = feature.interval
    text = f"{format_range((reach.lower, reach.upper), feature.unit, 4)} ({reach.verdict}"
    told = f"{text}); {percent(reach.coverage)} of the runs are in the interval made from the others"
    if not math.isnan(reach.whole_run):
        share = percent(reach.whole_run)
        told += f"; a further run is in it with a probability of at least {share}, and at least "
        told += f"{percent(reach.tolerated)} of all mechanisms with 95 % confidence"
    blocks: list[Block] = [Text(f"{capital(told)}.")]
    try:
        ranking = feature.ranking()
    except ValueError as error:  # too few runs
        blocks.append(Text(f"No ranking of the tolerances: {error}."))
        return Section(f"Feature: {feature.name}", blocks)
    blocks += [
        ranking_table(ranking),
        Items([f"{sentence}." for sentence in (*ranking.reservations(), *ranking.advice())]),
        Picture(_finding(ranking), partial(plot_ranking, ranking), height=1.0 + 0.3 * len(ranking)),
    ]
    return Section(f"Feature: {feature.name}", blocks)


def _finding(ranking: Ranking) -> str:
    first = ranking.rows[0]
    what = f"Bars of what halving each tolerance does to {ranking.feature}"
    return f"{what}: most by {first.parameter}, {first.narrowing}."
