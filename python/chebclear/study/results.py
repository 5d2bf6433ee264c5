"""Results of studies, and the comparison of two of them."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Mapping, Sequence, ValuesView
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Self, get_type_hints, overload

import numpy as np

from ..base import files as records
from ..base.arguments import Checks
from ..base.named import Named
from ..base.rows import Array
from ..base.shown import listed
from ..base.units import unit
from ..data.dataset import Dataset, Variable
from ..data.exports import Exports
from ..errors import ArgumentError, UnknownNameError
from ..execution.costs import STATS, Costs
from ..execution.failures import FailedRun, count_failed
from ..notices import Notice, WithNotices
from ..report import html
from ..report.document import Document
from ..run.names import column_index
from ..run.settings import Settings, common_facts
from ..run.trajectory import Stats
from ..scene.columns import column_unit
from ..scene.scene import Interval, Scene
from .band.band import Band
from .band.calibrated import calibrated_bands
from .band.gridded import Grid, grid_bands
from .band.requirement import LEAST_RUNS, Requirement, statement
from .band.worst import WorstCase
from .features.features import NO_FEATURES, FeatureResult, FeatureTable
from .features.ranking import Ranking
from .nominal import at_other_tolerances, frames_of
from .polynomials.surrogate import BoundKind
from .report.answer import main_numbers
from .report.document import study_document
from .report.extent import sampled_ends
from .report.summary import summary
from .requirements.conformance import Conformance
from .sources.run_table import RunTable
from .spec import StudySpec

# Fields that are those of the table of the runs.
_OF_RUNS = ("stats", "notices", "settings", "scene", "nominal_parameters", "failures", "seconds")
# Fields that are those of the grid.
_OF_GRID = ("kind", "degrees", "nodes", "bounds", "seed")
# Fields that a file has as they are; bands are made again of the runs.
_SAVED = (
    *_OF_RUNS[1:],
    *_OF_GRID,
    "requirement",
    "features",
    "worst_cases",
    "units",
    "conformance",
    "nominal_poses",
)


@dataclass(frozen=True, eq=False, repr=False)
class StudyResult(WithNotices, html.Reported, records.Saved, Exports, Named[Band], kind="study"):
    """The bands of all outputs of a study; ``result["slider.vx"]`` is the `Band` of that output.

    A mapping from the names of the outputs to their bands: ``in``, ``len``, ``keys()``, ``items()`` and
    ``values()`` work, and ``result["slider.*"]`` is a dict of bands.

    Results can be compared (NaN equals NaN), copied, pickled, saved and loaded; their arrays are read-only.

    Attributes
    ----------
    kind : str
        ``"band"``, ``"chebyshev"``, ``"scan"`` or ``"sample"``.
    bands : dict[str, Band]
        Band of each output by name.
    degrees : tuple[int, ...] | None
        Degree of the polynomials in each parameter [-]; None except for a Chebyshev study.
    nodes : tuple[int, ...]
        Number of nodes or scan points on each parameter [-]; empty for a study of `Study.band`.
    bounds : BoundKind
        How polynomials are bounded: ``"range"``, certified, or ``"eq31"``, by Eq. (31) of the paper.
    stats : Sequence[Stats]
        What each run cost; the last one is the nominal run.
    notices : tuple[Notice, ...]
        Warnings, each text once.
    settings : Settings | None
        Settings of the runs; None for a model of your own.
    scene : Scene | None
        The scene at the midpoint of all intervals; None without scenes.
    requirement : Requirement | None
        Required coverage and seed of a study of `Study.band`; None for the others.
    study : Study | None
        The study that made this result; None after pickling or loading, where `spec` makes it again.
    features : FeatureTable
        The features of all runs by name, each with its interval, quantiles and the effects of the
        parameters; empty if none were asked for.
    nominal_parameters : Array | None
        Parameters of the run that is used as the nominal one, if a table of runs has none at the midpoint.
    failures : tuple[FailedRun, ...]
        The failed runs, which `parameters` and all values leave out.
    seconds : float
        Time of the runs on the machine where they were made [s].
    worst_cases : tuple[WorstCase, ...]
        Runs at the worst cases that the polynomials predict; none before `check`.
    units : dict[str, str]
        Units that were given to the study, by the names of parameters, outputs and features.
    seed : int | None
        Seed of the points of `Study.sample`; None for the others, see `requirement`.
    spec : StudySpec | None
        What was asked of the study; None in files of earlier versions.
    conformance : Conformance | None
        Shares in specification, if the study has requirements.
    nominal_poses : Array | None
        Origins [m] and angles [rad] of the bodies in the nominal run, at as many of the instants as a drawing
        that moves has frames, shape (frames, bodies, 3); None without scenes or outputs.
    """

    kind: str
    bands: dict[str, Band]
    degrees: tuple[int, ...] | None
    nodes: tuple[int, ...]
    bounds: BoundKind
    stats: Sequence[Stats]
    notices: tuple[Notice, ...]
    settings: Settings | None
    scene: Scene | None
    requirement: Requirement | None = None
    # Executors cannot be pickled; the specification makes the study again.
    study: Any = field(default=None, compare=False, metadata=records.LIVE)
    features: FeatureTable = field(default_factory=lambda: NO_FEATURES)
    nominal_parameters: Array | None = None
    failures: tuple[FailedRun, ...] = ()
    seconds: float = field(default=math.nan, compare=False, metadata=unit("s"))
    worst_cases: tuple[WorstCase, ...] = ()
    units: dict[str, str] = field(default_factory=dict)
    seed: int | None = None
    spec: StudySpec | None = field(default=None, compare=False)  # the same may be asked in other words
    conformance: Conformance | None = None
    nominal_poses: Array | None = field(default=None, compare=False)  # the same runs have the same

    def __str__(self) -> str:
        return summary(self)

    def check(self) -> StudyResult:
        """Simulate the worst cases that the polynomials predict: at the highest and the lowest bound.

        Returns
        -------
        StudyResult
            The same with `worst_cases`, which ``print`` shows with the predictions.

        Raises
        ------
        ValueError
            If no output is resolved, or a function of the study did not travel, see `StudySpec`.
        """
        return dataclasses.replace(self, worst_cases=self._own_study().worst_cases(self))

    def _own_study(self) -> Any:
        """The study that made the result, or the same made again."""
        if self.study is not None:
            return self.study
        if self.spec is None:
            raise ArgumentError("the file of this result does not say how its study was made: make it again")
        return self.spec.study()

    @cached_property
    def ends(self) -> FeatureTable:
        """The lowest and the largest sample of each output in each run, as features."""
        return sampled_ends(self)

    def written_for(self, name: str) -> tuple[str, ...]:
        """Units that the user wrote, in which a parameter, output or feature is shown."""
        return () if self.spec is None else self.spec.written_for(name)

    @property
    def status(self) -> str:
        """``"done"``, or ``"stopped"`` if there was no time for all runs."""
        return "stopped" if len(self.failures) > count_failed(self.failures) else "done"

    def ranking(self, feature: str) -> Ranking:
        """Which tolerance to tighten: the predicted effect of halving each interval on that of a feature.

        Parameters
        ----------
        feature : str
            Name of the feature.

        Raises
        ------
        KeyError, ValueError
            If there is no such feature, or there are too few runs.
        """
        if not isinstance(found := self.features[feature], FeatureResult):  # several, of a pattern
            raise UnknownNameError(f'unknown feature "{feature}": give the name of one')
        return found.ranking()

    def _repr_html_(self) -> str:
        from ..plots.bands import band_picture

        pictures = [band_picture(band) for band in list(self.bands.values())[:2]]
        return html.fragment(repr(self)[1:-1], [*main_numbers(self), *pictures] if pictures else [])

    def __repr__(self) -> str:
        how = self.kind
        if self.degrees is not None:
            how += f" of degree {' x '.join(map(str, self.degrees))}"
        return f"<StudyResult: {how}, {len(self.parameters)} runs, {listed(self.outputs, most=4)}>"

    @property
    def _names(self) -> tuple[str, ...]:
        return self.outputs

    def _entry(self, name: str) -> Band:
        if name in self.features and name not in self.bands:
            raise UnknownNameError(f'"{name}" is a feature, not an output: result.features["{name}"]')
        column_index(self.outputs, name, self.scene)
        return self.bands[name]

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(self.bands)

    @property
    def t(self) -> Array:
        """Instants [s], shape (samples,)."""
        for band in self.bands.values():
            return band.t
        settings = self.settings
        if settings is None:
            return np.empty(0)
        return np.linspace(settings.skip, settings.skip + settings.duration, settings.samples)

    @property
    def intervals(self) -> dict[str, Interval]:
        """Interval of each parameter by name [SI units]."""
        return self._any.intervals

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(self.intervals)

    @property
    def parameters(self) -> Array:
        """Parameters of every run [SI units], shape (runs, parameters); without the nominal run."""
        known = self._any.parameters
        return known if self._kept is None or not self.bands else known[: -self._kept : self._kept]

    @property
    def statement(self) -> str | None:
        """What the runs of `Study.band` show and prove, in words; None for other studies."""
        return None if self.requirement is None else statement(self.requirement)

    def extend(self, runs: int, *, include: StudyResult | Sequence[StudyResult] = ()) -> StudyResult:
        """Add runs to a study of `Study.band`; nothing is simulated twice.

        Parameters
        ----------
        runs : int
            Number of further runs [-], at least 0; the sequence of points is continued.
        include : StudyResult or sequence of StudyResult, optional
            Results of the same study whose runs are included, as for `Study.band`.

        Returns
        -------
        StudyResult
            Exactly the same as with all runs in one call.

        Raises
        ------
        ValueError
            If this is no result of `Study.band`, or a function of the study did not travel, see `StudySpec`.
        SceneError, SimulationError, TypeError
            As `Study.band`.
        """
        made: StudyResult = self._own_study().extended(self, runs, include)
        return made

    @overload
    def values(self) -> ValuesView[Band]: ...
    @overload
    def values(self, output: str) -> Array: ...
    def values(self, output: str | None = None) -> ValuesView[Band] | Array:
        """The bands, as in any mapping; or, given an output, its values in all runs but the nominal one.

        Parameters
        ----------
        output : str, optional
            Name of an output.

        Returns
        -------
        collections.abc.ValuesView of Band, or ndarray of shape (runs, samples)
            The array in the unit of the output; by crank angle of shape (runs, revolutions, samples).
        """
        if output is None:
            return self.bands.values()
        return self.table(output)[:-1] if self._kept else self._entry(output).runs

    def table(self, output: str) -> Array:
        """Values of an output in every run, as `values` returns them, and of the nominal run."""
        return np.concatenate(self._tables(output))

    def _tables(self, output: str) -> list[Array]:
        """The parts of `table`, without a copy."""
        band, kept = self._entry(output), self._kept
        return [band.runs.reshape(-1, kept, len(self.t))] if kept else [band.runs, band.nominal[None]]

    @property
    def _kept(self) -> int | None:
        """Revolutions of each run that are pooled."""
        revolutions = None if self.requirement is None else self.requirement.revolutions
        return None if revolutions is None else revolutions.kept

    @property
    def _any(self) -> Band | FeatureTable:
        """A band or, in a study without outputs, the features: both have the parameters of the runs."""
        for band in self.bands.values():
            return band
        return self.features

    @classmethod
    def from_runs(
        cls,
        runs: RunTable,
        intervals: dict[str, Interval],
        asked: Requirement | Grid,
        *,
        threads: int | None = None,
        units: Mapping[str, str],
        spec: StudySpec | None = None,
        **facts: Any,
    ) -> Self:
        """The result of a table of runs, the nominal one last; `facts` are other fields.

        The `spec` says in which units it is shown.
        """
        grid = asked if isinstance(asked, Grid) else Grid("band", ())
        if isinstance(asked, Requirement):
            bands = calibrated_bands(runs, intervals, asked, threads)
            facts["requirement"] = asked
        else:
            bands = grid_bands(runs, intervals, asked, threads)
        known = {name: units[name] for name in intervals if name in units}
        for name, band in bands.items():
            unit_of = units.get(name, "") if runs.scene is None else column_unit(name)
            written = () if spec is None else spec.written_for(name)
            bands[name] = dataclasses.replace(band, unit=unit_of, parameter_units=known, written=written)
        facts |= {name: getattr(runs, name) for name in _OF_RUNS}
        facts |= {name: getattr(grid, name) for name in _OF_GRID}
        return cls(bands=bands, units=dict(units), spec=spec, **facts)

    def run_table(self, outputs: Sequence[str]) -> RunTable:
        """The runs with some of the outputs, the nominal one last."""
        count, table = len(self.parameters), self.features
        return RunTable(
            self.parameters,
            np.arange(count),
            self.t,
            tuple(outputs),
            np.stack(list(map(self.table, outputs)), axis=-1) if outputs else np.empty((count + 1, 0, 0)),
            np.concatenate([table.runs, table.nominal[None]]) if table else None,
            table.names,
            **{name: getattr(self, name) for name in _OF_RUNS}
            | {"stats": Costs.joined([self.stats]), "notices": ()},
        )

    def bands_of_first(self, runs: int, threads: int | None = None) -> dict[str, Band]:
        """The bands of the first runs of a result of `Study.band` that did not fail, by the rule of all."""
        checks = Checks()
        checks.whole("runs", runs, least=LEAST_RUNS, most=len(self.parameters))
        if self.requirement is None:
            checks.add(
                "runs", f"may only be given for a result of Study.band, not for one of Study.{self.kind}"
            )
        checks.finish()
        assert self.requirement is not None, "the checks let no other result pass"
        requirement = dataclasses.replace(self.requirement, runs=runs, failed=0)
        table = self.run_table(self.outputs)
        first = table[:runs].joined([table[len(table.kept) :]])
        return calibrated_bands(first, self.intervals, requirement, threads)

    def dataset(self) -> Dataset:
        """Bands, runs, parameters and features as named arrays with units; see `Exports`.

        They are ``slider.x.lower``, ``.upper`` and ``.nominal`` over ``t``, ``slider.x.runs`` over ``run``
        and ``t``, ``parameters.NAME`` over ``run``, ``features.NAME`` over ``run`` and ``cycle``. By
        crank angle ``angle`` is over ``t`` and ``OUTPUT.runs`` over ``run``, ``cycle`` and ``t``.
        """
        table, variables = self.features, {"t": Variable(("t",), self.t, "s")}
        facts: dict[str, str | int | float] = {"kind": self.kind, "runs": len(self.parameters)}
        facts |= common_facts(self.settings, self.scene, self.warnings)
        for name, band in self.bands.items():
            for side in ("lower", "upper", "nominal"):
                variables[f"{name}.{side}"] = Variable(("t",), getattr(band, side), band.unit)
            axes: tuple[str, ...] = ("run", "t")
            if band.angle is not None:
                axes = ("run", "cycle", "t")
                variables["angle"] = Variable(("t",), band.angle, "rad")
            variables[f"{name}.runs"] = Variable(axes, self.values(name), band.unit)
            facts[f"{name}.verdict"] = band.verdict
            if not math.isnan(band.coverage):
                facts[f"{name}.coverage"] = band.coverage
        for name, values in zip(self.parameter_names, self.parameters.T, strict=True):
            variables[f"parameters.{name}"] = Variable(("run",), values, self.units.get(name, ""))
        units = dict(zip(table.names, table.units, strict=False))
        for k, name in enumerate(table.names):
            variables[f"features.{name}"] = Variable(
                ("run", "cycle"), table.runs[:, :, k], units.get(name, "")
            )
        return Dataset("t", variables, facts)

    def report(self, path: str | os.PathLike[str], *, title: str | None = None, check: bool = False) -> Path:
        """Write a report: one HTML file that needs no network.

        Parameters
        ----------
        path : path
            The file; ``.html`` is appended if there is no suffix. An existing file is replaced.
        title : str, optional
            The heading: the question in words.
        check : bool
            Simulate the nominal mechanism at the tolerance of the study, a looser and a tighter one, and say
            what these give. Without it no run is made.

        Returns
        -------
        Path
            The file written.

        Raises
        ------
        ValueError
            If the path has another suffix, or `check` is asked for of a study without scenes or outputs.
        """
        return html.write(study_document(self, title, at_other_tolerances(self) if check else ()), path)

    def _document(self, title: str | None) -> Document:
        return study_document(self, title)

    def _contents(self) -> records.Contents:
        empty = np.empty((len(self.parameters) + 1, len(self.t), 0))
        parts = list(zip(*map(self._tables, self.bands), strict=True))
        values = records.Stacked(parts) if self.bands else empty
        arrays = {"t": self.t, "parameters": self.parameters, "stats": Costs.joined([self.stats]).counts}
        record = {name: records.flattened(getattr(self, name), name, arrays) for name in _SAVED}
        facts = {"outputs": self.outputs, "spec": None if self.spec is None else self.spec.facts()}
        facts["intervals"] = records.flattened(self.intervals, "", arrays)
        return {**arrays, "values": values}, {**facts, "record": record}

    @classmethod
    def _from_contents(cls, arrays: Mapping[str, Any], facts: Mapping[str, Any]) -> Self:
        kinds = get_type_hints(cls)
        known = {name: records.restored(kinds[name], one, arrays) for name, one in facts["record"].items()}
        if facts["spec"] is not None:
            known["spec"] = StudySpec.from_facts(facts["spec"])
        runs = RunTable(
            arrays["parameters"],
            np.arange(len(arrays["parameters"])),
            arrays["t"],
            tuple(facts["outputs"]),
            arrays["values"],
            stats=Costs(np.asarray(arrays["stats"], dtype=float).reshape(-1, len(STATS))),
            **{name: known.pop(name) for name in _OF_RUNS if name != "stats"},
        )
        intervals = records.restored(dict[str, Interval], facts["intervals"], arrays)
        grid = Grid(**{name: known.pop(name) for name in _OF_GRID})
        found = cls.from_runs(runs, intervals, known.pop("requirement") or grid, **known)
        if not found.bands and not found.features:
            raise ValueError("it has neither outputs nor features")
        shapes = {}
        if found.scene is not None and found.nominal_poses is not None:
            shapes["nominal_poses"] = (frames_of(found.t), len(found.scene.bodies), 3)
        return records.sound(found, **shapes)


def checked_results(checks: Checks, include: object) -> list[StudyResult]:
    """The results whose runs are to be included."""
    given = [include] if isinstance(include, StudyResult) else include
    if not isinstance(given, Sequence) or not all(isinstance(one, StudyResult) for one in given):
        checks.add("include", f"must be results of studies, got {include!r}", wrong_type=True)
        return []
    return list(given)
