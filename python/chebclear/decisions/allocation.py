"""Tolerances for least cost: how wide each may be, so that requirements are kept."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.random import Generator

from ..base import files as records
from ..base.named import Named
from ..base.prefixes import Form, format_quantity
from ..base.shown import capital, listed
from ..base.tables import format_table
from ..data.dataset import Dataset, facts_of, numbered
from ..data.exports import Exports
from ..errors import ArgumentTypeError
from ..notices import Notice, WithNotices, issue
from ..report import html
from ..report.document import Document, Picture, Section, Sentence, Table, Verdict
from ..run.report import notice_doubts, notices_section, version_fact
from ..scene.distributions import Distribution
from ..scene.scene import Interval
from ..study.requirements.conformance import Conformance, in_percent
from ..study.requirements.specification import Specification
from ..study.study import Study
from .least_cost.search import checked_search
from .rare_result import RareShare

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Relative distance of a tolerance from the end of what is searched at which it is there.
_AT_END = 1e-6
Status = Literal["met", "always", "unproven", "scatter", "others"]


@dataclass(frozen=True, eq=False, repr=False)
class Tolerance(records.ArrayRecord):
    """The tolerance of a parameter before and after: half of its interval.

    Attributes
    ----------
    name : str
        Name of the parameter.
    unit : str
        SI unit; empty if it is not known.
    before, after : float
        What it may lie above and below its nominal value [SI unit of the parameter]; three standard
        deviations where it is normal.
    grade : str
        ISO grade of the tolerance after, where the catalog has grades, such as ``"IT7"``; else empty.
    cost_before, cost_after : float
        What they cost; NaN where a catalog has nothing as tight.
    written : tuple[str, ...]
        The unit that the user wrote, in which it is shown.
    """

    name: str
    unit: str
    before: float
    after: float
    grade: str
    cost_before: float
    cost_after: float
    written: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False, repr=False)
class Allocation(WithNotices, html.Reported, records.Saved, Named[Tolerance], Exports, kind="allocation"):
    """The cheapest tolerances that keep requirements; see `allocate`.

    Attributes
    ----------
    tolerances : dict[str, Tolerance]
        Those of the parameters that have a cost.
    status : {"met", "always", "unproven", "scatter", "others"}
        ``"met"``: fresh runs prove the share, and no cheaper tolerances were found that they prove.
        ``"always"``: they do so at the widest tolerances, which the requirements do not limit.
        ``"unproven"``: they do not, but may with more runs. Where no tolerance helps, since the tightest ones
        do not keep the requirements, the tolerances stay as they are: ``"scatter"`` if most of the variance
        is scatter that no parameter explains, as of impacts; else ``"others"``, nominal values or parameters
        without a cost.
    share : float
        Share of the mechanisms that is to keep to all requirements [-]; 1 where all parameters are only
        intervals.
    aimed : float
        Share for which the model found the tolerances [-]: larger, so that the runs can prove the other.
    decides : str
        Where no tolerance helps, the parameter without a cost that explains most of the variance; else empty.
    verified : Conformance
        Shares of fresh runs with these tolerances, or with the tightest where no tolerance helps, with
        intervals at the confidence of their look; where all parameters are only intervals, of mechanisms
        spread evenly, beside the corners.
    parameters : dict[str, Interval | Distribution]
        All parameters with the tolerances found, for `Study`.
    saving : dict[str, float]
        What the cost falls by for each requirement whose limits are widened, to both sides and by an SI unit
        of its quantity: minus the derivative of the cost; by the best single step where there are steps. NaN
        where no tolerance helps.
    scatter : float
        Share of the variance of a limited quantity, with these tolerances, that no parameter explains [-].
    runs : int
        Runs made [-].
    seed : int
        Seed of the draws: ``rng=seed`` repeats them.
    notices : tuple[Notice, ...]
        Warnings of the runs, each kind once.
    mechanism : str
        What the study is of, as its report names it; empty if that has no name.
    rare : RareShare | None
        The share outside with these tolerances, where less than 1e-3 may be: it is this that proves them, as
        too few of the runs of `verified` are outside to tell. None where counting tells.
    """

    tolerances: dict[str, Tolerance]
    status: Status
    share: float
    aimed: float
    decides: str
    verified: Conformance
    parameters: dict[str, Interval | Distribution]
    saving: dict[str, float]
    scatter: float
    runs: int
    seed: int
    notices: tuple[Notice, ...] = ()
    mechanism: str = ""
    rare: RareShare | None = None

    @property
    def _by_name(self) -> dict[str, Tolerance]:
        return self.tolerances

    @property
    def cost_before(self) -> float:
        """Cost of the tolerances of the study; NaN where a catalog has nothing as tight."""
        return math.fsum(one.cost_before for one in self.tolerances.values())

    @property
    def cost(self) -> float:
        """Cost of the tolerances found."""
        return math.fsum(one.cost_after for one in self.tolerances.values())

    @property
    def table(self) -> Table:
        """One row for each tolerance."""
        rows = []
        for one in self.tolerances.values():
            form = Form.of((one.before, one.after), one.unit, one.written)
            costs = [f"{cost:.4g}" for cost in (one.cost_before, one.cost_after)]
            rows.append(
                [one.name, form.text(one.before), f"{form.text(one.after)} {one.grade}".strip(), *costs]
            )
        rows.append(["all", "", "", f"{self.cost_before:.4g}", f"{self.cost:.4g}"])
        return Table("Tolerances", ["parameter", "before", "after", "cost before", "cost after"], rows)

    def dataset(self) -> Dataset:
        """A row for each tolerance, whose unit is in a column of its own."""
        names = ("name", "unit", "before", "after", "grade", "cost_before", "cost_after")
        columns = {name: [getattr(one, name) for one in self.tolerances.values()] for name in names}
        facts = facts_of(self) | {f"saving of {name}": one for name, one in self.saving.items()}
        return numbered("row", columns, {}, facts)

    def __repr__(self) -> str:
        return f"<Allocation: {self.status}, {listed(self._names, most=4)}>"

    def __str__(self) -> str:
        table = self.table
        rows = [[str(cell) for cell in row] for row in table.rows]
        text = [self._found, format_table(table.head, rows), str(self.verified), *self._rare()]
        text += self._savings()
        return "\n".join(text)

    @property
    def _found(self) -> str:
        """What was found, in words."""
        if self.decides:
            return f"no cheaper tolerances found: {self.decides} decides, and has no cost"
        return _WORDS[self.status] if self.is_found or self.status not in _PROVEN else _AS_BEFORE

    @property
    def is_found(self) -> bool:
        """Whether other tolerances than those of the study were found, and proven."""
        changed = any(not math.isclose(one.before, one.after) for one in self.tolerances.values())
        return changed and self.status in _PROVEN

    def _rare(self) -> list[str]:
        """The share outside where it is too rare to be counted."""
        return [] if self.rare is None else [str(self.rare)]

    def _savings(self) -> list[str]:
        """By how much wider limits save a hundredth of the cost."""
        wider = {
            name: format_quantity(0.01 * self.cost / one, share.unit, written=share.specification.written)
            for name, one in self.saving.items()
            if one > 0.0 and (share := self.verified[name])
        }
        return [f"{name}: limits wider by {one} save 1 % of the cost" for name, one in wider.items()]

    def _document(self, title: str | None) -> Document:
        return allocation_document(self, title)

    def _repr_html_(self) -> str:
        return html.fragment(self._found, [self.table, self.verified.table])

    def plot(self, *, ax: Axes | None = None) -> Axes:
        """Draw by how much each tolerance was closed or opened; see `plot_allocation`."""
        from ..plots.costs import plot_allocation

        return plot_allocation(self, ax=ax)


_PROVEN: tuple[Status, ...] = ("met", "always")
_WORDS: dict[Status, str] = {
    "met": "the cheapest tolerances found; fresh runs prove that they keep the requirements",
    "always": "the widest tolerances; fresh runs prove that they keep the requirements",
    "unproven": "no tolerances are proven to keep the requirements; the model's may: ask for more runs",
    "scatter": "no cheaper tolerances found: scatter that no parameter explains breaks the requirements",
    "others": "no cheaper tolerances found: the nominal values break the requirements",
}
_AS_BEFORE = "no cheaper tolerances found: those of the study stay, and fresh runs prove them"


def allocation_document(found: Allocation, title: str | None) -> Document:
    """The report of tolerances: those that were found, or why there are none."""
    *_, every = found.verified.values()
    answer: list[Sentence] = [
        Verdict(f"{capital(found._found)}.", "good" if found.status in _PROVEN else "bad"),
        f"Of {every.runs:,} fresh mechanisms {in_percent(every.share)} keep to all requirements, between "
        f"{in_percent(every.lower)} and {in_percent(every.upper)} with {100.0 * every.confidence:.4g} % "
        f"confidence; {in_percent(found.share)} were asked for.",
    ]
    answer += [f"{capital(one)}." for one in found._rare()]
    if found.is_found:
        answer.append(f"They cost {found.cost:.4g} instead of {found.cost_before:.4g}.")
    answer += [f"{one}." for one in found._savings()] if found.status in _PROVEN else []
    # Where nothing was found, tolerances that stay as they are say nothing.
    is_shown = found.is_found or found.status == "unproven"
    picture = Picture("By how much each tolerance was closed or opened.", found.plot)
    spread = [
        Picture(f"How the mechanisms are spread about the limits of {name}.", one.plot)
        for name, one in found.verified.items()
        if name != "all" or len(found.verified) == 1
    ]
    of = f"{found.mechanism}: which" if found.mechanism else "Which"
    return Document(
        title=title or f"{of} tolerances cost least and keep the requirements?",
        facts=[f"{found.runs:,} runs", version_fact()],
        answer=answer,
        doubts=notice_doubts(found.notices),
        # The share that was asked for is to be kept, not every mechanism.
        first=[*([found.table] if is_shown else []), found.verified.table],
        sections=[
            Section("How the tolerances change", [picture])
            if is_shown
            else Section("Tolerances", [found.table]),
            *([Section("In specification or not", spread)] if spread else []),
            *notices_section(found.notices),
        ],
    )


def allocate(
    study: Study,
    cost: Mapping[str, Callable[[float], float] | Mapping[str, float] | Mapping[float, float]],
    specifications: Specification | Sequence[Specification] | Mapping[str, Specification] | None = None,
    share: float = 0.99,
    runs: int = 2000,
    *,
    confidence: float = 0.95,
    rng: int | Generator | None = 0,
) -> Allocation:
    """The tolerances of least cost with which so many mechanisms keep to all specifications.

    A tolerance is half of the interval of a parameter, three standard deviations where it is normal; nominal
    values stay. Polynomials of what runs exceed the limits by, with their scatter, are fitted around the
    tolerances until these no longer change. Then fresh runs count; where they do not prove the share, the
    model is corrected by them, and the next design is verified by others, at half of the risk. A parameter
    that is only an `Interval` takes its worst corner; if all are, all mechanisms must keep to the
    specifications.

    Parameters
    ----------
    study : Study
        The mechanism, or a model of your own, with the tolerances before.
    cost : mapping of str to callable or mapping
        For each parameter whose tolerance may change, the cost as a function of the tolerance [SI unit], such
        as ``lambda t: 3.0 + 2e-5 / t``, searched from a tenth to ten times the tolerance of the study but no
        further than half of the nominal value; or a catalog, ``{"10 um": 7.5, "20 um": 5.0}`` or, by ISO
        grades of the nominal length, ``{"IT7": 9.0, "IT8": 6.0}``: plus and minus half of the standard
        tolerance. Beside catalogs functions are taken at ten tolerances a decade. A wider tolerance may not
        cost more.
    specifications : Specification, or sequence or mapping of them by name, optional
        What to keep to, made by `require`; the requirements of the study if not given.
    share : float
        Share of the mechanisms that is to keep to all specifications [-].
    runs : int
        Runs that verify a design [-]. The more, the less must be paid for their uncertainty. Where less than
        1e-3 may be outside, some 40,000 more go on from the worst of them, as in `rare_share`.
    confidence : float
        Probability that a proven share is true, over all designs that were verified [-].
    rng : int, numpy.random.Generator or None
        Seed or generator of the draws; None for fresh ones. The seed is kept with the result.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong, a cost falls with a tighter tolerance, the runs are too few for the share or
        no mechanism keeps to a specification; all problems are listed.
    ImportError
        If a cost is a function and SciPy is not installed.
    SceneError, SimulationError
        As `Study.sample`. A mechanism that fails counts as outside.

    Examples
    --------
    >>> import chebclear as cc
    >>> def stack(plate, spacer):
    ...     return {"gap": 50.5 - plate - 2 * spacer}
    >>> study = cc.Study(stack, {"plate": cc.normal(30.0, 0.02), "spacer": cc.normal(10.0, 0.02)})
    >>> cost = {"plate": {0.03: 5, 0.06: 3, 0.12: 2}, "spacer": {0.03: 6, 0.06: 4, 0.12: 2}}
    >>> found = cc.allocate(study, cost, cc.require("gap", above=0.4, below=0.6))
    >>> found.status, {name: one.after for name, one in found.items()}
    ('met', {'plate': 0.06, 'spacer': 0.03})
    """
    if not isinstance(study, Study):
        raise ArgumentTypeError(f"study must be a Study, got {study!r:.80}")
    search = checked_search(study.runner, cost, specifications, share, runs, confidence, rng)
    best = search.found()
    design, is_met, decides = best.design, best.missing < 0.0, ""
    is_tightest = np.allclose(design, search.low, rtol=_AT_END)
    status: Status = "met" if is_met else "unproven"
    if is_met and np.allclose(design, search.high, rtol=_AT_END):
        status = "always"
    elif not is_met and not best.keeps and is_tightest:
        design, status = search.before, "others"
        free = [place for place in range(len(search.runner.parameters)) if place not in search.costed]
        if best.model.scatter > 0.5:
            status = "scatter"
        elif free:
            place, part = best.model.deciding(free)
            decides = list(search.runner.parameters)[place] if part > 0.5 else ""
    notices = tuple(search.runs.notices.values())
    issue(notices)
    units, before, after = search.runner.units, search.before.tolist(), design.tolist()
    rows = [
        (one, old, new, (one[1].at(old), one[1].at(new)))
        for one, old, new in zip(search.prices.items(), before, after, strict=True)
    ]
    return Allocation(
        tolerances={
            name: Tolerance(
                name,
                units.get(name, ""),
                before,
                after,
                price.grades.get(after, ""),
                *costs,
                search.runner.written_for(name),
            )
            for (name, price), before, after, costs in rows
        },
        status=status,
        share=search.share,
        aimed=1.0 - best.outside,
        decides=decides,
        verified=best.verified,
        parameters=search.parameters(design),
        saving=search.saving(best) if best.keeps else dict.fromkeys(search.runs.asked, math.nan),
        scatter=best.model.scatter,
        runs=search.runs.made,
        seed=search.seed,
        notices=notices,
        mechanism=search.runner.spec.name,
        rare=best.rare,
    )
