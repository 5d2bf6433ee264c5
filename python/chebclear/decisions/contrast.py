"""Two designs with the same mechanisms: differences of features and requirements in pairs."""

from __future__ import annotations

import json
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Literal
from zlib import crc32

import numpy as np
from numpy.random import Generator, default_rng
from numpy.typing import NDArray

from ..base import files as records
from ..base.arguments import Checks
from ..base.named import Named
from ..base.prefixes import Form, format_quantity, format_tolerance
from ..base.rows import Array
from ..base.shown import listed
from ..data.dataset import Dataset, Variable, facts_of, numbered
from ..data.exports import Exports
from ..errors import ArgumentError, ArgumentTypeError
from ..notices import Notice, WithNotices, issue
from ..report import html
from ..report.document import Document, Table
from ..run.continuation import changes
from ..scene.scene import Interval
from ..study.band.exact import binomial_cdf, exact_interval
from ..study.conforming import extremes_of, watching_for
from ..study.requirements.specification import Specification, checked_specifications
from ..study.runner import Runner
from ..study.sources.asked import units_of
from ..study.sources.finished import FinishedRuns
from ..study.sources.run_table import RunTable
from ..study.sources.scenes import MOST_RUNS, scene_of
from ..study.spec import interval_of
from ..study.study import Study
from .contrast_report import contrast_document
from .settled import unsettled
from .trace import made_at

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# What differs in two studies that is named one by one [-]: a screen.
_MOST_NAMED = 12


@dataclass(frozen=True, eq=False, repr=False)
class Difference(records.ArrayRecord):
    """A feature of the second design less that of the first, in pairs of mechanisms.

    Attributes
    ----------
    name : str
        Name of the feature.
    unit : str
        SI unit; empty if it is not known.
    first, second : Array
        The feature in both designs, the mean over cycles, of the pairs that both simulated, shape (pairs,).
    median : float
        Median of the differences.
    lower, upper : float
        Interval of the median, exact for any distribution: from one ordered difference to another.
    smaller : float
        Share of the pairs in which the second is smaller [-].
    smaller_between : tuple[float, float]
        Interval of that share, exact as Clopper and Pearson's [-].
    confidence : float
        Probability that an interval holds the true value [-].
    written : tuple[str, ...]
        Units that the user wrote, in which it is shown.
    """

    _axes: ClassVar = {"first": ("pairs",), "second": ("pairs",)}

    name: str
    unit: str
    first: Array
    second: Array
    median: float
    lower: float
    upper: float
    smaller: float
    smaller_between: tuple[float, float]
    confidence: float
    written: tuple[str, ...] = ()

    @property
    def differs(self) -> bool:
        """Whether the interval of the median leaves out zero."""
        return self.lower > 0.0 or self.upper < 0.0

    def __str__(self) -> str:
        first = format_quantity(float(np.median(self.first)), self.unit, written=self.written)
        form = Form.of((self.median, self.lower, self.upper), self.unit, self.written)
        ends, change = form.range(self.lower, self.upper), form.text(self.median)
        low, high = self.smaller_between
        text = f"{self.name}: {change} from {first} (median of {len(self.first)} pairs; between {ends}); "
        text += f"smaller in {100.0 * self.smaller:.3g} % of them"
        return f"{text} ({100.0 * low:.3g} to {100.0 * high:.3g} %)"

    def plot(self, *, ax: Axes | None = None, unit: str | None = None) -> Axes:
        """Draw how the differences are spread; see `plot_difference`."""
        from ..plots.features import plot_difference

        return plot_difference(self, ax=ax, unit=unit)


@dataclass(frozen=True, eq=False, repr=False)
class ShareDifference(records.ArrayRecord):
    """How many more mechanisms of the second design keep to a requirement, in pairs.

    Attributes
    ----------
    name : str
        Name of the requirement.
    specification : Specification
        The limits.
    pairs : int
        Pairs of mechanisms; one that fails counts as outside [-].
    only_first, only_second, both, neither : int
        Pairs in which only the first, only the second, both or none keep to it [-].
    lower, upper : float
        Interval of the share of the second less that of the first, exact for any mechanism: from the
        intervals of the two kinds of pairs that differ [-].
    confidence : float
        Probability that it holds the true difference [-].
    """

    name: str
    specification: Specification
    pairs: int
    only_first: int
    only_second: int
    both: int
    neither: int
    lower: float
    upper: float
    confidence: float

    @property
    def shares(self) -> tuple[float, float]:
        """Shares of both designs [-]."""
        return (self.both + self.only_first) / self.pairs, (self.both + self.only_second) / self.pairs

    @property
    def difference(self) -> float:
        """Share of the second less that of the first [-]."""
        return (self.only_second - self.only_first) / self.pairs

    @property
    def better(self) -> Literal["first", "second"] | None:
        """The design of which more keep to it; None where the pairs do not show one."""
        return "second" if self.lower > 0.0 else "first" if self.upper < 0.0 else None

    def __str__(self) -> str:
        which = "neither design is shown to be" if self.better is None else f"the {self.better} design is"
        first, second = (f"{100.0 * share:.3g} %" for share in self.shares)
        points = [f"{100.0 * one:+.3g}" for one in (self.difference, self.lower, self.upper)]
        text = f"{self.name}: {which} better; {first} and {second} in specification, {points[0]} points, "
        text += f"between {points[1]} and {points[2]} (of {self.pairs} pairs {self.only_second} keep to it "
        return f"{text}in the second design alone, {self.only_first} in the first alone)"


@dataclass(frozen=True, eq=False, repr=False)
class Contrast(
    WithNotices,
    html.Tabled,
    html.Reported,
    records.Saved,
    Named["Difference | ShareDifference"],
    Exports,
    kind="contrast",
):
    """Two designs compared in pairs; see `contrast`.

    Attributes
    ----------
    features : dict[str, Difference]
        Differences of the features that both have.
    requirements : dict[str, ShareDifference]
        Differences of the shares in specification.
    changes : tuple[str, ...]
        What differs in the two studies.
    parameter_names : tuple[str, ...]
        Parameters that were drawn, of both.
    seed : int
        Seed of the draws: ``rng=seed`` repeats them.
    notices : tuple[Notice, ...]
        Warnings of the runs, each kind once.
    """

    features: dict[str, Difference]
    requirements: dict[str, ShareDifference]
    changes: tuple[str, ...]
    parameter_names: tuple[str, ...]
    seed: int
    notices: tuple[Notice, ...] = ()

    @property
    def _by_name(self) -> dict[str, Difference | ShareDifference]:
        # Requirements come first, and before features of the same name.
        first: dict[str, Difference | ShareDifference] = dict(self.requirements)
        return first | self.features | first

    @property
    def table(self) -> Table:
        """One row for each feature."""
        rows = []
        for one in self.features.values():
            medians = (float(np.median(one.first)), float(np.median(one.second)))
            values = map(Form.of(medians, one.unit, one.written).text, medians)
            form = Form.of((one.median, one.lower, one.upper), one.unit, one.written)
            ends = form.range(one.lower, one.upper)
            rows.append([one.name, *values, form.text(one.median), ends, f"{one.smaller:.1%}"])
        head = ["feature", "first", "second", "difference", "between", "smaller in"]
        return Table("Medians of both designs and of their differences in pairs", head, rows)

    @property
    def requirements_table(self) -> Table:
        """One row for each requirement."""
        rows = []
        for one in self.requirements.values():
            shares = [f"{100.0 * share:.3g} %" for share in one.shares]
            points = [f"{100.0 * part:+.3g}" for part in (one.difference, one.lower, one.upper)]
            ends = f"{points[1]} to {points[2]}"
            rows.append([one.name, *shares, points[0], ends, str(one.pairs), one.better or "not shown"])
        head = ["requirement", "first", "second", "difference [points]", "between", "pairs", "better"]
        return Table("Shares in specification", head, rows)

    def _document(self, title: str | None) -> Document:
        return contrast_document(self, title)

    def dataset(self) -> Dataset:
        """A row for each requirement and feature, whose unit is in a column of its own, with the pairs."""
        shares, features = self.requirements.values(), self.features.values()
        columns: dict[str, list[Any]] = {
            "of": ["requirement"] * len(shares) + ["feature"] * len(features),
            "unit": ["-"] * len(shares) + [one.unit for one in features],
            "difference": [one.difference for one in shares] + [one.median for one in features],
        }
        for name in ("name", "lower", "upper", "confidence"):
            columns[name] = [getattr(one, name) for one in (*shares, *features)]
        data = numbered("row", columns, {"confidence": "-"}, facts_of(self))
        for one in features:
            for name, values in (("first", one.first), ("second", one.second)):
                pairs = Variable((f"pair of {one.name}",), values, one.unit)
                data.variables[f"features.{one.name}.{name}"] = pairs
        return replace(data, facts=data.facts | {"changes": "\n".join(self.changes)})

    def __repr__(self) -> str:
        return f"<Contrast: {listed(self._names, most=4)}>"

    def __str__(self) -> str:
        lines = [str(one) for one in (*self.requirements.values(), *self.features.values())]
        return "\n".join([*lines, *(f"differs: {change}" for change in self.changes)])


def contrast(
    first: Study,
    second: Study,
    specifications: Specification | Sequence[Specification] | Mapping[str, Specification] | None = None,
    runs: int = 200,
    *,
    confidence: float = 0.95,
    rng: int | Generator | None = 0,
) -> Contrast:
    """Compare two designs by the same mechanisms: is the second better, and by how much?

    Every mechanism is simulated in both designs. A parameter that both have takes the same place in its own
    distribution or interval, by its name: what is drawn at the upper limit in one is so in the other. Scatter
    that both share leaves the differences; they are known from far fewer runs than two studies apart.

    Parameters
    ----------
    first, second : Study
        The designs. Features of the same name are compared.
    specifications : Specification, or sequence or mapping of them by name, optional
        Requirements, made by `require`; features and outputs that both have.
    runs : int
        Pairs of mechanisms [-].
    confidence : float
        Of the intervals [-].
    rng : int, numpy.random.Generator or None
        Seed or generator of the draws; None for fresh ones. The seed is kept with the result.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong, or nothing can be compared; all problems are listed.
    SceneError, SimulationError
        As `Study.sample`.

    Examples
    --------
    >>> import chebclear as cc
    >>> def shaft(gap, thread):
    ...     return {"play": gap - thread}
    >>> wide, narrow = (
    ...     cc.Study(shaft, {"gap": cc.normal(10.1, s), "thread": cc.normal(10.0, 0.02)})
    ...     for s in (0.03, 0.01)
    ... )
    >>> found = cc.contrast(wide, narrow, {"loose": cc.require("play", above=0.05)}, 400)
    >>> found["loose"].lower > 0.0
    True
    """
    if not isinstance(first, Study) or not isinstance(second, Study):
        raise ArgumentTypeError(f"first and second must be studies, got {first!r:.60} and {second!r:.60}")
    runners = first.runner, second.runner
    checks = Checks()
    asked = {} if specifications is None else checked_specifications(checks, specifications)
    count = checks.whole("runs", runs, least=6, most=MOST_RUNS)
    level = checks.real("confidence", confidence, "-", above=0.0, below=1.0)
    seed = checks.seed("rng", rng)
    for place, runner in zip(("first", "second"), runners, strict=True):
        if isinstance(runner.model, FinishedRuns):
            checks.add(place, "is a table of finished runs, which has no values at other points")
    checks.finish()
    notices: dict[object, Notice] = {}
    features, outside, watchers, points = [], [], [], []
    for runner in runners:
        watching, watched = watching_for(runner, asked)
        watchers.append(watching)
        points.append(_points(runner, count, seed))
        made = made_at(watching, points[-1])
        notices = {(notice.code, notice.about): notice for notice in made.notices} | notices
        features.append(_features(made, count))
        outside.append(
            {
                name: watched[name].is_outside(extremes_of(made, name, one, watched[name], count))
                for name, one in asked.items()
            }
        )
    one, other = features
    own = [
        {name for name in found if runner.settings is None or name in runner.features}
        for runner, found in zip(runners, features, strict=True)
    ]
    common = [name for name in one if name in own[0] & own[1]]
    if not common and not asked:
        raise ArgumentError("no feature in common: give specifications, or both studies features=")
    asks, given, simulated = runners[0].features, runners[0].units, runners[0].settings is not None
    units = units_of(common, asks, given, simulated=simulated)
    differences = {}
    for name, unit in zip(common, units, strict=True):
        pair = np.column_stack([one[name], other[name]])
        found = _difference(name, unit, pair[np.isfinite(pair).all(axis=1)], level)
        differences[name] = replace(found, written=runners[0].written_for(name))
    shares = {
        name: _share_difference(name, one, outside[0][name], outside[1][name], level)
        for name, one in asked.items()
    }
    names = tuple(dict.fromkeys([*runners[0].parameters, *runners[1].parameters]))
    apart = {name: (float(np.nanmedian(other[name] - one[name])), "") for name in one if name in other}
    apart |= {name: (found.median, found.unit) for name, found in differences.items()}
    told = (*notices.values(), *unsettled(watchers, points, apart, level))
    issue(told)
    return Contrast(differences, shares, tuple(_changes(*runners)), names, seed, told)


def _features(made: RunTable, count: int) -> dict[str, Array]:
    """The features of runs, the mean over cycles, NaN where a run failed."""
    found = {}
    for column, name in enumerate(made.feature_names):
        assert made.features is not None
        found[name] = np.full(count, np.nan)
        found[name][made.kept] = made.features[:, :, column].mean(axis=1)
    return found


def _points(runner: Runner, count: int, seed: int) -> Array:
    """Values of the parameters: those of one name have the same places in all designs."""
    points = np.empty((count, len(runner.parameters)))
    for column, (name, one) in enumerate(runner.parameters.items()):
        places = default_rng([seed, crc32(name.encode())]).random(count)
        if isinstance(one, Interval):
            points[:, column] = one.lower + (one.upper - one.lower) * places
        else:
            # A place of exactly 0 has no quantile.
            points[:, column] = [one.quantile(max(float(place), 1e-16)) for place in places]
    return points


def _difference(name: str, unit: str, pairs: Array, confidence: float) -> Difference:
    first, second = pairs.T
    ordered = np.sort(second - first)
    count = len(ordered)
    lower, upper = _median_between(ordered, confidence)
    smaller = int(np.count_nonzero(second < first))
    ends = exact_interval(smaller, count, confidence) if count else (0.0, 1.0)
    median = float(np.median(ordered)) if count else np.nan
    share = smaller / count if count else np.nan
    return Difference(name, unit, first, second, median, lower, upper, share, ends, confidence)


def _median_between(ordered: Array, confidence: float) -> tuple[float, float]:
    """Ordered values between which the median lies with at least this confidence, for any distribution."""
    places = range(len(ordered) // 2)
    risk = 0.5 * (1.0 - confidence)
    place = bisect_left(places, True, key=lambda k: binomial_cdf(k, len(ordered), 0.5) > risk) - 1
    return (float(ordered[place]), float(ordered[-1 - place])) if place >= 0 else (-np.inf, np.inf)


def _share_difference(
    name: str, one: Specification, first: NDArray[np.bool_], second: NDArray[np.bool_], confidence: float
) -> ShareDifference:
    pairs = len(first)
    only_first, only_second = int(np.sum(~first & second)), int(np.sum(first & ~second))
    # Each of the two may be wrong with half of the remaining probability.
    level = 0.5 * (1.0 + confidence)
    lost, won = (exact_interval(found, pairs, level) for found in (only_first, only_second))
    both, neither = int(np.sum(~first & ~second)), int(np.sum(first & second))
    ends = won[0] - lost[1], won[1] - lost[0]
    return ShareDifference(name, one, pairs, only_first, only_second, both, neither, *ends, confidence)


def _changes(first: Runner, second: Runner) -> list[str]:
    """What differs in the two studies, in words."""
    found = [f"{path}: {one} and {other}" for path, one, other in changes(_plain(first), _plain(second))]
    more = [f"{len(found) - _MOST_NAMED} more"] if len(found) > _MOST_NAMED else []
    return found[:_MOST_NAMED] + more


def _plain(runner: Runner) -> dict[str, Any]:
    """A study as names, numbers and texts."""
    plain: dict[str, Any] = {
        "parameters": {
            name: " ".join(format_tolerance(interval_of(one), runner.units.get(name, ""), (one.unit,)))
            + ("" if isinstance(one, Interval) else f", {type(one).__name__.lower()}")
            for name, one in runner.parameters.items()
        },
        "fixed": {
            key: one if isinstance(one, str | float) else f"{one!r:.60}" for key, one in runner.fixed.items()
        },
    }
    if runner.settings is not None:
        plain["settings"] = vars(runner.settings) | {"outputs": None, "features": None}
        plain["scene"] = json.loads(scene_of(runner, runner.nominal).to_json())
    return plain
