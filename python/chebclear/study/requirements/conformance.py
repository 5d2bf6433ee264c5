"""The share of mechanisms that keep to specifications, with exact intervals."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ...base import files as records
from ...base.named import Named
from ...base.rows import Array
from ...base.shown import listed
from ...data.dataset import Dataset, Variable, facts_of, numbered
from ...data.exports import Exports
from ...notices import Notice
from ...report import html
from ...report.document import Table
from ..band.exact import exact_interval
from .specification import Specification

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# Runs from which the quantile of 99.865 % of a process has an interval: 1 - 0.99865^n - n (1 - 0.99865)
# 0.99865^(n - 1) is 0.95 for them, see `tolerated_share`.
_RUNS_OF_PPK = 3513
# The quantiles of a process that stand for three standard deviations (ISO 22514).
_TAILS = (0.00135, 0.5, 0.99865)


@dataclass(frozen=True, eq=False, repr=False)
class Share(records.ArrayRecord):
    """The share of mechanisms that keep to a specification, with its exact interval `[ClopperPearson1934]`.

    Attributes
    ----------
    name : str
        Name of the specification.
    specification : Specification
        The limits.
    unit : str
        SI unit of the quantity; empty if it is not known.
    runs : int
        Mechanisms that count, at the nominal values of parameters that are only known as intervals [-].
    outside : int
        Those of them outside of the limits, with those that failed [-].
    failed : int
        Those whose simulation failed [-].
    confidence : float
        Probability that the true share is between `lower` and `upper` [-].
    at : tuple[dict[str, float], ...]
        Values of the parameters that are only known as intervals [SI units]: nominal ones, corners, points
        inside.
    counts : Array
        Runs and those outside, for each of these, shape (values, 2).
    intervals : Array
        Interval of the share for each of these [-], shape (values, 2).
    lowest, highest : Array
        Extremes of the quantity in each run that counts, NaN if it failed, shape (runs,).
    limits : tuple[float, float]
        The limits, infinite for none.
    """

    _axes: ClassVar = {"counts": ("at", 2), "intervals": ("at", 2), "lowest": ("runs",), "highest": ("runs",)}

    name: str
    specification: Specification
    unit: str
    runs: int
    outside: int
    failed: int
    confidence: float
    at: tuple[dict[str, float], ...]
    counts: Array
    intervals: Array
    lowest: Array
    highest: Array
    limits: tuple[float, float]

    @property
    def lower(self) -> float:
        """Lower end of the interval of the smallest share at the values `at` [-]."""
        return float(np.min(self.intervals[:, 0]))

    @property
    def upper(self) -> float:
        """Upper end of the interval of the largest share at the values `at` [-].

        It needs no correction for their number: they do not depend on the runs, so that the largest share
        is that of one of them, and its own interval holds it.
        """
        return float(np.max(self.intervals[:, 1]))

    @property
    def share(self) -> float:
        """Share of the runs that keep to it [-]."""
        return 1.0 - self.outside / self.runs

    @property
    def ppm(self) -> float:
        """Runs outside in a million [-]; the ends of their interval are ``1e6 * (1 - upper)`` and so on."""
        return 1e6 * self.outside / self.runs

    @property
    def ppk(self) -> float:
        """Distance of the limits from the median over that of the quantiles of 0.135 and 99.865 % [-].

        ISO 22514 for any distribution; Cpk where it is normal. NaN for fewer than 3513 runs, in which these
        quantiles are not known with 95 % confidence, and for a quantity that must keep to its limits over a
        time, which has no single value.
        """
        values = self.highest
        if len(values) < _RUNS_OF_PPK or not np.array_equal(values, self.lowest):
            return math.nan
        low, median, high = np.quantile(values, _TAILS)
        sides = (self.limits[1] - median) / (high - median), (median - self.limits[0]) / (median - low)
        return float(min(sides))

    def __repr__(self) -> str:
        return f"<Share of {self.name}: {self}>"

    def __str__(self) -> str:
        text = f"{in_percent(self.share)} in specification, between {in_percent(self.lower)} and "
        text += f"{in_percent(self.upper)} with {100.0 * self.confidence:.4g} % confidence"
        text += f" ({self.outside or 'none'} of {self.runs} outside"
        if self.failed:
            text += f", of which {self.failed} failed"
        if len(self.at) > 1:
            sides, inner = listed(list(self.at[0]), most=4), len(self.at) - 1 - 2 ** len(self.at[0])
            more = f", corners and {inner} points inside" if inner else " and corners"
            text += f"; the interval holds at the nominal values{more} of {sides}"
        return text + ")"

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw how the runs are spread, with the limits; see `plot_share`."""
        from ...plots.features import plot_share

        return plot_share(self, ax=ax)


@dataclass(frozen=True, eq=False, repr=False)
class Conformance(records.Saved, Named[Share], Exports, kind="conformance"):
    """The shares of mechanisms that keep to specifications, by their names, and to all of them.

    Attributes
    ----------
    shares : dict[str, Share]
        Share of each specification by name; the last one, ``"all"``, is that of all together, if there are
        several.
    parameters : Array
        Parameters of the mechanisms that were simulated, at nominal values of those that are only known as
        intervals [SI units], shape (runs, parameters).
    parameter_names : tuple[str, ...]
        Their names.
    seed : int | None
        Seed of the draws: ``rng=seed`` repeats them; None for the runs of a study itself.
    notices : tuple[Notice, ...]
        Warnings of the runs, each text once.
    """

    _axes: ClassVar = {"parameters": (None, "parameter_names")}

    shares: dict[str, Share]
    parameters: Array
    parameter_names: tuple[str, ...]
    seed: int | None
    notices: tuple[Notice, ...] = ()

    @property
    def _names(self) -> tuple[str, ...]:
        return tuple(self.shares)

    def _entry(self, name: str) -> Share:
        return self.shares[name]

    @property
    def table(self) -> Table:
        """One row for each specification."""
        rows = []
        for name, one in self.shares.items():
            shares = map(in_percent, (one.share, one.lower, one.upper))
            rows.append([name, str(one.specification), *shares, str(one.outside), str(one.runs)])
        heads = ["specification", "limits", "share", "at least", "at most", "outside", "runs"]
        return Table("Shares in specification", heads, rows)

    def dataset(self) -> Dataset:
        """A row for each specification, with the parameters of the mechanisms."""
        names = ("share", "lower", "upper", "confidence", "runs", "outside", "failed")
        columns: dict[str, list[Any]] = {"specification": list(self.shares)}
        columns |= {name: [getattr(one, name) for one in self.shares.values()] for name in names}
        columns["limits"] = [str(one.specification) for one in self.shares.values()]
        data = numbered("row", columns, dict.fromkeys(names, "-"), facts_of(self))
        for name, values in zip(self.parameter_names, self.parameters.T, strict=True):
            data.variables[f"parameters.{name}"] = Variable(("run",), values)
        return data

    def __repr__(self) -> str:
        return f"<Conformance: {listed(self._names, most=4)}>"

    def __str__(self) -> str:
        return "\n".join(f"{name}: {one}" for name, one in self.shares.items())

    def _repr_html_(self) -> str:
        return html.fragment(repr(self)[1:-1], [self.table])


def share_of(
    name: str,
    specification: Specification,
    unit: str,
    limits: tuple[float, float],
    at: list[dict[str, float]],
    extremes: list[tuple[Array, Array]],
    confidence: float,
    failures: int | None = None,
    looks: int = 1,
) -> Share:
    """The share of a specification from the lowest and the highest value of its quantity in all runs, NaN
    where it failed, for each of the values `at` which parameters that are only known as intervals have.

    Runs end after so many `failures`: the interval of as many runs as it took is exact then as well. At so
    many `looks` they could have ended because an interval was narrow enough: all these intervals hold
    together."""
    counts, intervals, kept = [], [], []
    level = 1.0 - (1.0 - confidence) / looks
    for lowest, highest in extremes:
        is_outside = ~((lowest > limits[0]) & (highest < limits[1]))
        used = len(is_outside)
        if failures is not None and len(last := np.flatnonzero(np.cumsum(is_outside) == failures)):
            used = int(last[0]) + 1
        counts.append((used, int(np.count_nonzero(is_outside[:used]))))
        below, above = exact_interval(counts[-1][1], used, level)
        intervals.append((1.0 - above, 1.0 - below))
        kept.append((lowest[:used], highest[:used]))
    (runs, outside), (lowest, highest) = counts[0], kept[0]
    return Share(
        name=name,
        specification=specification,
        unit=unit,
        runs=runs,
        outside=outside,
        failed=int(np.count_nonzero(np.isnan(highest))),
        confidence=confidence,
        at=tuple(at),
        counts=np.array(counts),
        intervals=np.array(intervals),
        lowest=lowest,
        highest=highest,
        limits=limits,
    )


def in_percent(share: float) -> str:
    """A share in percent, with as many digits as tell it from 0 and 100."""
    rest = min(share, 1.0 - share)
    digits = 2 if rest <= 0.0 else max(1, 1 - math.floor(math.log10(100.0 * rest)))
    return f"{100.0 * share:.{min(digits, 8)}f} %"
