"""What a tolerance stack-up says: worst case, root sum of squares and Monte Carlo of values, and whether they
can be trusted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from ..base import files as records
from ..base.named import Named
from ..base.prefixes import Form, format_quantity
from ..base.shown import in_a_sentence, listed
from ..base.tables import format_number, format_table
from ..data.dataset import Dataset, numbered
from ..data.exports import Exports
from ..notices import Notice, WithNotices
from ..report import html
from ..report.document import Cell, Document, Judgment, Section, Table, Verdict
from ..run.report import notices_section, version_fact

TAIL = 0.00135
"""Share below and above the limits of three standard deviations [-] (ISO 22514)."""
ROUNDING = 1e-9
"""Relative rounding of sums [-]."""
# Bend over what the slope makes of a tolerance, from which a parameter is curved [-].
_CURVED = 0.1
# Bend over the whole worst case below which it does not matter [-].
_SLIGHT = 0.01

RssVerdict = Literal["agrees", "wrong", "curved", "not checked"]
_JUDGMENTS: dict[RssVerdict, Judgment] = {
    "agrees": "good",
    "wrong": "bad",
    "curved": "fair",
    "not checked": "fair",
}


@dataclass(frozen=True, eq=False, repr=False)
class Contribution(records.ArrayRecord):
    """What one parameter adds to a stack-up.

    Attributes
    ----------
    name : str
        Name of the parameter.
    unit : str
        Its SI unit; empty if it is not known.
    tolerance : float
        Half of its interval, three standard deviations where it is normal, in the unit of the parameter.
    slope : float
        Change of the value for each unit of the parameter: between both ends of the tolerance, all others at
        the middle of theirs [SI units].
    bend : float
        How far the mean of the values at both ends lies above that in the middle, in the unit of the value.
    worst_case_share : float
        Its part of the worst case [-].
    variance_share : float
        Its part of the sum of squares [-]; 0 where it is only an interval, which adds linearly.
    written : tuple[str, ...]
        The unit that the user wrote, in which it is shown.
    """

    name: str
    unit: str
    tolerance: float
    slope: float
    bend: float
    worst_case_share: float
    variance_share: float
    written: tuple[str, ...] = ()

    @property
    def reach(self) -> float:
        """What the tolerance makes of the value, to either side: slope times tolerance, at least 0."""
        return abs(self.slope) * self.tolerance

    @property
    def curvature(self) -> float:
        """The bend over what slope and tolerance make [-]: 0 if linear, above 1 if not monotone."""
        if self.bend == 0.0:
            return 0.0
        return abs(self.bend) / self.reach if self.reach > 0.0 else math.inf


@dataclass(frozen=True, eq=False, repr=False)
class StackUpValue(records.ArrayRecord, Named[Contribution]):
    """The stack-up of one value of a mechanism, in its SI unit.

    Attributes
    ----------
    name : str
        Name of the requirement or quantity; of an output over a time also whether it is its lowest or its
        highest value.
    unit : str
        SI unit of the value; empty if it is not known.
    limits : tuple[float, float]
        Limits of the requirement; infinite for none.
    nominal : float
        The value at the nominal parameters.
    middle : float
        The value at the middle of all tolerances, about which the ends of worst case and RSS lie.
    worst_case : tuple[float, float]
        Ends by the sum of slopes times tolerances.
    corners : tuple[float, float]
        The values simulated at the two corners of the tolerances to which the slopes point: the true worst
        case if the value is monotone in every parameter.
    rss : tuple[float, float]
        Ends by the root of the sum of squares of slopes times tolerances; what is only an interval adds
        linearly.
    monte_carlo : tuple[float, float]
        Quantiles of 0.135 and 99.865 % of random mechanisms, three standard deviations where it is normal; at
        the worst corner of what is only an interval.
    lower_between, upper_between : tuple[float, float]
        Interval of each of the two quantiles, exact for any distribution; infinite for too few runs.
    confidence : float
        Probability that both intervals hold the true quantiles [-].
    contributions : dict[str, Contribution]
        What each parameter adds.
    runs, failed : int
        Random mechanisms, and those of them whose simulation failed and that are left out [-].
    written : tuple[str, ...]
        Units that the user wrote, in which it is shown.
    """

    name: str
    unit: str
    limits: tuple[float, float]
    nominal: float
    middle: float
    worst_case: tuple[float, float]
    corners: tuple[float, float]
    rss: tuple[float, float]
    monte_carlo: tuple[float, float]
    lower_between: tuple[float, float]
    upper_between: tuple[float, float]
    confidence: float
    contributions: dict[str, Contribution]
    runs: int
    failed: int
    written: tuple[str, ...] = ()

    @property
    def _by_name(self) -> Mapping[str, Contribution]:
        return self.contributions

    @property
    def curved(self) -> tuple[str, ...]:
        """Parameters whose bend is above a tenth of what slope and tolerance make, and matters."""
        half = 0.5 * (self.worst_case[1] - self.worst_case[0])
        return tuple(
            one.name
            for one in self.contributions.values()
            if one.curvature > _CURVED and abs(one.bend) > _SLIGHT * half
        )

    @property
    def not_monotone(self) -> tuple[str, ...]:
        """Curved parameters in which the value turns: the worst case is that of corners alone."""
        return tuple(name for name in self.curved if self.contributions[name].curvature > 1.0)

    @property
    def rss_verdict(self) -> RssVerdict:
        """Whether the root sum of squares can be trusted.

        ``"wrong"``: one of its ends is outside of the interval of the Monte Carlo quantile. ``"curved"``: the
        value is not linear in a parameter. ``"not checked"``: too few random mechanisms. Else ``"agrees"``.
        """
        slack = ROUNDING * max(map(abs, (*self.rss, *self.worst_case)))
        known = all(math.isfinite(end) for end in (*self.lower_between, *self.upper_between))
        inside = [
            low - slack <= end <= high + slack
            for end, (low, high) in zip(self.rss, (self.lower_between, self.upper_between), strict=True)
        ]
        if not all(inside):
            return "wrong"
        if self.curved:
            return "curved"
        return "agrees" if known else "not checked"

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why the root sum of squares or the worst case cannot be trusted, in words; empty if they can."""
        found = []
        form = self._form
        if self.rss_verdict == "wrong":
            ends = [form.range(*one) for one in (self.lower_between, self.upper_between)]
            found.append(
                f"{self.name}: RSS is wrong: it says {form.range(*self.rss)}, random mechanisms have their "
                f"lower end in {ends[0]} and their upper end in {ends[1]}"
            )
        if self.curved:
            parts = [
                f"{name} ({100.0 * part:.2g} % of its slope's part)"
                if math.isfinite(part := self.contributions[name].curvature)
                else f"{name} (which has no slope)"
                for name in self.curved
            ]
            found.append(f"{self.name} is curved in {in_a_sentence(parts)}: RSS takes it for linear")
        if self.not_monotone:
            found.append(
                f"{self.name} is not monotone in {in_a_sentence(self.not_monotone)}: the worst case is that "
                "at the corners, between them it may be worse"
            )
        if self.rss_verdict == "not checked":
            found.append(
                f"{self.name}: {self.runs - self.failed} random mechanisms are too few to check RSS, "
                f"it takes {_least_runs(self.confidence)}"
            )
        return tuple(found)

    @property
    def _form(self) -> Form:
        values = (self.nominal, *self.worst_case, *self.corners, *self.rss, *self.monte_carlo)
        return Form.of((*values, *self.limits), self.unit, self.written)

    def _cells(self) -> list[Cell]:
        """What a row of a table says of it."""
        form = self._form
        limits = [
            f"{word} {form.text(end)}"
            for word, end in zip(("above", "below"), self.limits, strict=True)
            if math.isfinite(end)
        ]
        ranges = [form.range(*one) for one in (self.worst_case, self.corners, self.rss, self.monte_carlo)]
        verdict = Verdict(self.rss_verdict, _JUDGMENTS[self.rss_verdict])
        return [self.name, form.text(self.nominal), ", ".join(limits) or "-", *ranges, verdict]

    def __repr__(self) -> str:
        return f"<StackUpValue {self.name}: {self._form.range(*self.monte_carlo)}, RSS {self.rss_verdict}>"


@dataclass(frozen=True, eq=False, repr=False)
class StackUp(WithNotices, html.Reported, records.Saved, Named[StackUpValue], Exports, kind="stack_up"):
    """Worst case, root sum of squares and Monte Carlo of values of a mechanism; see `stack_up`.

    Its exports have a row for each value, with its unit in a column of its own, and columns of slopes,
    tolerances and curvatures of each parameter.

    Attributes
    ----------
    stacks : dict[str, StackUpValue]
        The stack-up of each value, by name.
    parameter_names : tuple[str, ...]
        Names of the parameters.
    runs : int
        Runs made [-].
    seed : int
        Seed of the draws: ``rng=seed`` repeats them.
    notices : tuple[Notice, ...]
        Warnings of the runs, each kind once.
    """

    stacks: dict[str, StackUpValue]
    parameter_names: tuple[str, ...]
    runs: int
    seed: int
    notices: tuple[Notice, ...] = ()

    @property
    def _by_name(self) -> Mapping[str, StackUpValue]:
        return self.stacks

    @property
    def table(self) -> Table:
        """One row for each value."""
        rows = [one._cells() for one in self.stacks.values()]
        head = ["value", "nominal", "limits", "worst case", "at its corners", "RSS", "Monte Carlo", "RSS is"]
        return Table("Tolerance stack-up; Monte Carlo: 99.73 % of the mechanisms", head, rows)

    @property
    def contributions_table(self) -> Table:
        """One row for each value and parameter."""
        rows = []
        for stack in self.stacks.values():
            form = Form.of([one.reach for one in stack.contributions.values()], stack.unit, stack.written)
            for one in stack.contributions.values():
                curvature = f"{100.0 * one.curvature:.2g} %" if math.isfinite(one.curvature) else "no slope"
                shares = [
                    f"{100.0 * part:.3g} %" if math.isfinite(part) else "-"
                    for part in (one.worst_case_share, one.variance_share)
                ]
                rows.append(
                    [
                        stack.name,
                        one.name,
                        f"±{format_quantity(one.tolerance, one.unit, written=one.written)}",
                        format_number(one.slope, 4),
                        f"±{form.text(one.reach)}",
                        *shares,
                        curvature if one.name in stack.curved or one.curvature < 1.0 else "-",
                    ]
                )
        head = [
            "value",
            "parameter",
            "tolerance",
            "slope [SI]",
            "makes",
            "of worst case",
            "of RSS²",
            "curvature",
        ]
        return Table("What each tolerance adds", head, rows)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why a root sum of squares or a worst case cannot be trusted, in words."""
        return tuple(doubt for one in self.stacks.values() for doubt in one.doubts)

    def dataset(self) -> Dataset:
        """A row for each value, in its SI unit; see `Exports`."""
        stacks = list(self.stacks.values())
        columns: dict[str, list[str | float | int]] = {
            "value": [one.name for one in stacks],
            "unit": [one.unit for one in stacks],
            "nominal": [one.nominal for one in stacks],
        }
        for name in ("limits", "worst_case", "corners", "rss", "monte_carlo"):
            for place, end in enumerate(("lower", "upper")):
                columns[f"{name}.{end}"] = [getattr(one, name)[place] for one in stacks]
        for name in ("lower_between", "upper_between"):
            for place, end in enumerate(("from", "to")):
                columns[f"{name}.{end}"] = [getattr(one, name)[place] for one in stacks]
        columns["rss_verdict"] = [one.rss_verdict for one in stacks]
        for name in self.parameter_names:
            for what in ("tolerance", "slope", "curvature"):
                columns[f"{what}.{name}"] = [getattr(one.contributions[name], what) for one in stacks]
        return numbered("row", columns, {})

    def __repr__(self) -> str:
        return f"<StackUp: {listed(self._names, most=4)}>"

    def __str__(self) -> str:
        tables = [self.table, self.contributions_table]
        text = [format_table(one.head, [list(map(str, row)) for row in one.rows]) for one in tables]
        return "\n".join([text[0], *self.doubts, "", text[1]])

    def _document(self, title: str | None) -> Document:
        trusted = [one.name for one in self.stacks.values() if one.rss_verdict == "agrees"]
        answer = [
            f"{one.name}: 99.73 % of the mechanisms are from {one._form.range(*one.monte_carlo)}."
            for one in self.stacks.values()
        ]
        if trusted:
            answer.append(f"The root sum of squares agrees for {in_a_sentence(trusted)}.")
        return Document(
            title=title or "How do the tolerances add up?",
            facts=[f"{self.runs} runs", version_fact()],
            answer=answer,
            doubts=[f"{one}." for one in self.doubts],
            first=[self.table],
            sections=[
                Section("What each tolerance adds", [self.contributions_table]),
                *notices_section(self.notices),
            ],
        )

    def _repr_html_(self) -> str:
        return html.fragment(repr(self)[1:-1], [self.table])


def _least_runs(confidence: float) -> int:
    """Fewest runs of which the extremes are beyond both quantiles with this confidence [-]."""
    return math.ceil(math.log(0.25 * (1.0 - confidence)) / math.log1p(-TAIL))
