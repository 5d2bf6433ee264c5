"""Which tolerance to tighten: the parameters by the effect of halving their intervals on a feature."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.files import ArrayRecord
from ...base.shown import shortened
from ...report import html
from ...report.document import Items, Table
from .effects import Estimate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Halving a tolerance that narrows the interval by less than this certainly does not help [%].
_HELPFUL = 10.0


@dataclass(frozen=True, eq=False, repr=False)
class Rank(ArrayRecord):
    """Effect of one parameter on a feature.

    Attributes
    ----------
    parameter : str
        Name of the parameter.
    narrowing : Estimate
        Relative reduction of the interval of 95 % of the feature's values when that of the parameter is
        halved [-], towards its nominal value.
    share : Estimate
        Share of the variance that the parameter alone explains [-].
    monotone : str | None
        ``"rises"`` or ``"falls"`` where that is certain.
    """

    parameter: str
    narrowing: Estimate
    share: Estimate
    monotone: str | None

    @property
    def helps(self) -> bool | None:
        """Whether halving the interval of the parameter helps: certainly, certainly not, or None.

        Judged by the interval of `narrowing` in whole percent, as it is shown: rows that read the same are
        judged the same.
        """
        lower, upper = (np.round(100.0 * end) for end in (self.narrowing.lower, self.narrowing.upper))
        return True if lower > 0.0 else False if upper < _HELPFUL else None


@dataclass(frozen=True, eq=False, repr=False)
class Ranking(ArrayRecord):
    """Which tolerance to tighten: the parameters by the effect of halving their intervals on a feature.

    It is the interval of 95 % of the values of the feature. ``print(ranking)`` shows the table with its
    conclusions; `rows` are the bars of a tornado chart.

    Attributes
    ----------
    feature : str
        Name of the feature.
    rows : tuple[Rank, ...]
        The parameters, the most effective first.
    interactions : Estimate
        Share of the variance of parameters together [-].
    scatter : Estimate
        Share of the variance that no parameter explains [-].
    uneven : tuple[str, ...]
        Parameters that were given with another distribution and are taken as uniform over their intervals.
    failed : float
        Share of the runs that failed [-].
    extrapolated : bool
        Whether the runs leave out a part of the box, into which effects are extrapolated.
    """

    feature: str
    rows: tuple[Rank, ...]
    interactions: Estimate
    scatter: Estimate
    uneven: tuple[str, ...] = ()
    failed: float = 0.0
    extrapolated: bool = False

    def __repr__(self) -> str:
        return "\n".join(shortened(str(self).splitlines()))

    def plot(self, *, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw the effects of halving each interval; see `plot_ranking` for the options."""
        from ...plots.features import plot_ranking

        return plot_ranking(self, ax=ax, **options)

    def __iter__(self) -> Iterator[Rank]:
        return iter(self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    def advice(self) -> tuple[str, ...]:
        """Conclusions from the table, a sentence for each parameter with a certain effect."""
        if math.isnan(self.scatter.value):
            return (f"{self.feature} is the same in every run: what would change it is unknown",)
        sentences = []
        largest = max(self.rows, key=lambda row: row.share.value)
        for row in self.rows:
            if row.helps is False:
                scattered = self.scatter.value >= max(0.5, largest.share.value)
                part = self.scatter.value if scattered else largest.share.value
                why = f"{100.0 * part:.0f} % of the spread is "
                why += "scatter that no parameter explains" if scattered else f"that of {largest.parameter}"
                if row is largest and not scattered:
                    why = "what is left of its interval reaches as far"
                sentences.append(f"tightening {row.parameter} does not help: {why}")
            elif row.helps:
                sentences.append(f"halving the interval of {row.parameter} narrows it by {row.narrowing}")
        if not any(row.helps for row in self.rows):
            text = "no single tolerance is certain to narrow it"
            if self.scatter.value >= 0.5:
                text += f": {self.scatter} of the spread is scatter that no parameter explains"
            wide = any(row.helps is None for row in self.rows)
            sentences.append(f"{text}; more runs narrow the intervals in brackets" if wide else text)
        return tuple(sentences)

    def reservations(self) -> tuple[str, ...]:
        """What the table assumes or does not know, a sentence for each."""
        told = []
        if self.uneven:
            told.append(f"{', '.join(self.uneven)}: taken as uniform over the interval")
        if self.failed:
            told.append(
                f"{100.0 * self.failed:.2g} % of the runs failed: where they did the others are "
                "extrapolated, and runs with smaller intervals may differ"
            )
        if self.extrapolated:
            told.append("the runs leave out a part of the box: effects are extrapolated there, not known")
        return tuple(told)

    def _repr_html_(self) -> str:
        return html.fragment(
            self.feature, [ranking_table(self), Items((*self.reservations(), *self.advice()))]
        )

    def __str__(self) -> str:
        head = ("parameter", "halving it narrows by", "share of the variance", "monotone")
        rows = [head] + [
            (row.parameter, str(row.narrowing), str(row.share), row.monotone or "") for row in self.rows
        ]
        rows += [("together", "", str(self.interactions), ""), ("scatter", "", str(self.scatter), "")]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]
        title = f"{self.feature}: effect of each parameter, in brackets its interval of 95 % confidence"
        return "\n".join([title, *lines, *self.reservations(), *self.advice()])


def ranking_table(ranking: Ranking) -> Table:
    """Effects of halving each tolerance, with shares of the variance."""
    rows = [[row.parameter, str(row.narrowing), str(row.share), row.monotone or "-"] for row in ranking.rows]
    rows.append(["parameters together", "-", str(ranking.interactions), "-"])
    rows.append(["scatter", "-", str(ranking.scatter), "-"])
    return Table(
        "Which tolerance to tighten; in brackets the interval of 95 % confidence",
        ["parameter", "halving its interval narrows by", "share of the variance", "monotone"],
        rows,
    )
