"""The result of one simulation."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, overload

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ..base import files as records
from ..base.arguments import Checks
from ..base.rows import Array
from ..base.units import unit, units
from ..data.dataset import Dataset, Variable, records as table_variables
from ..data.exports import Exports
from ..notices import Notice, WithNotices
from ..report import html
from ..report.document import Document
from ..scene.columns import column_unit
from ..scene.scene import Scene, compiled
from .accuracy import ErrorEstimate
from .contacts import Contacts, Events
from .features import EXTREMA, Extremum, Feature, settling_time
from .names import column_index
from .settings import Settings, checked_settings, common_facts, require_features
from .signals import WithSignals

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..plots.animation.animate import Animation


@dataclass(frozen=True, eq=False, repr=False)
class Stats(records.ArrayRecord):
    """The work of a simulation, in counts that do not depend on the machine.

    Attributes
    ----------
    steps : int
        Accepted steps [-].
    explicit_steps : int
        Accepted steps of an explicit method [-]: all with ``"adams"`` or ``"dop853"``, none with Rosenbrock
        methods.
    switches : int
        Changes between the explicit and the Rosenbrock method by ``"auto"`` [-].
    rejected : int
        Rejected steps [-].
    stages : int
        Stages of the integrator [-].
    evaluations : int
        Evaluations of the accelerations [-].
    jacobians : int
        Evaluations of the Jacobian [-].
    factorizations : int
        Matrix factorizations [-].
    events : int
        Located contact changes [-].
    relocations : int
        Attempts to end a step on a contact change [-].
    impacts_at_floor : int
        Impacts slower than the floor of the impact velocity, which were damped as if at it [-].
    largest_projection : float
        Largest correction of a projection onto closed loops [m]; zero without loops.
    smallest_step : float
        Smallest accepted step that was not cut by a contact change or the end [s].
    smallest_step_time : float
        Start of that step [s].
    """

    steps: int
    explicit_steps: int
    switches: int
    rejected: int
    stages: int
    evaluations: int
    jacobians: int
    factorizations: int
    events: int
    relocations: int
    impacts_at_floor: int
    largest_projection: float = field(metadata=unit("m"))
    smallest_step: float = field(metadata=unit("s"))
    smallest_step_time: float = field(metadata=unit("s"))

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Stats:
        """The counts from the core or from a file."""
        # The core has floats for all.
        return cls(**{name: int(n) if name in _WHOLE else n for name, n in plain.items()})


_WHOLE = frozenset(item.name for item in dataclasses.fields(Stats) if item.type == "int")


@dataclass(frozen=True, repr=False)
class EndState:
    """The end of a simulation, from which another one can continue: `simulate(scene, ..., start=run.end)`.

    Attributes
    ----------
    memory : str
        The state that the core needs to continue, as JSON.
    scene : Scene | None
        The simulated scene, with which another one is compared; None if it is not known.
    """

    memory: str
    scene: Scene | None = dataclasses.field(default=None, hash=False)

    def __repr__(self) -> str:
        return f"<EndState: t = {self.time:g} s>"

    @property
    def time(self) -> float:
        """Time at which the simulation ended [s]."""
        return float(json.loads(self.memory)["time"])


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(WithNotices, html.Reported, records.Saved, Exports, WithSignals, kind="trajectory"):
    """The result of one simulation: ``run["slider.x"]`` is a column, ``run["slider.*"]`` a dict of columns.

    A mapping from the names of the columns to views of shape (samples,): ``in``, ``len``, ``keys()``,
    ``values()``, ``items()`` and ``dict(run)`` work. ``numpy.asarray(run)`` is `samples`, the array of all.

    Trajectories can be compared (NaN equals NaN), copied, pickled, saved and loaded. Their arrays are
    read-only; copy them to change them.

    Attributes
    ----------
    t : Array
        Instants of the samples [s], shape (samples,).
    columns : tuple[str, ...]
        Names of the columns.
    samples : Array
        All columns in SI units, shape (samples, columns); NaN after a failure.
    events : Events
        Changes of contact in the sampled time.
    contacts : Contacts
        Contacts in the sampled time with their durations and peak forces.
    end : EndState | None
        The end, from which another simulation can continue; None after a failure.
    stats : Stats
        The work of the simulation.
    status : str
        ``"done"``, or the word for why it ended early.
    message : str
        How the run ended, in words: that the end was reached, or why it ended early, when and where.
    end_time : float
        Time at which the simulation ended [s].
    joint : str | None
        The clearance joint whose change of contact could not be located or exceeded the allowed number.
    failed_load : str | None
        The force, torque or tension that the run could not follow further.
    notices : tuple[Notice, ...]
        Warnings of the run.
    settings : Settings
        Settings of the simulation.
    scene : Scene
        The simulated mechanism.
    skipped_events : Events
        Changes of contact in the time skipped before the first sample.
    skipped_contacts : Contacts
        Contacts in the skipped time; one that lasts into the sampled time is in both tables.
    features : Array
        Features of the settings in their order, shape (cycles, features). NaN where
        the run did not finish a cycle.
    start : str | None
        The `EndState.memory` of the run that this one continues; None if it continues none.
    error : ErrorEstimate | None
        Errors estimated by companion runs; None unless asked for.
    written : tuple[str, ...]
        Units of the scene file, in which plots and reports show it.
    """

    t: Array = field(metadata=unit("s"))
    columns: tuple[str, ...]
    samples: Array
    events: Events
    contacts: Contacts
    end: EndState | None
    stats: Stats
    status: str
    message: str
    end_time: float = field(metadata=unit("s"))
    joint: str | None
    failed_load: str | None
    notices: tuple[Notice, ...]
    settings: Settings
    scene: Scene
    skipped_events: Events
    skipped_contacts: Contacts
    features: Array
    start: str | None = None
    error: ErrorEstimate | None = None
    written: tuple[str, ...] = field(default=(), compare=False)

    @property
    def success(self) -> bool:
        """Whether the simulation reached its end."""
        return self.status == "done"

    def _repr_html_(self) -> str:
        # Here and below: what reports and drawings import is a tenth of the time of an import.
        from .report import notebook_blocks

        return html.fragment(repr(self)[1:-1], notebook_blocks(self))

    def __repr__(self) -> str:
        size = f"{len(self.columns)} columns of {len(self.t)} samples"
        start = f"from t = {self.t[0]:g} s " if self.t[0] else ""
        end = "" if self.success else f" at {self.end_time:g} s"
        return f"<Trajectory: {size} {start}to t = {self.t[-1]:g} s, {self.status}{end}>"

    @property
    def _names(self) -> tuple[str, ...]:
        return self.columns

    def _entry(self, name: str) -> Array:
        return self.samples[:, column_index(self.columns, name, self.scene)]

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        # Not np.array(..., copy=copy): NumPy 1 does not know None.
        if copy is False and dtype is not None and np.dtype(dtype) != self.samples.dtype:
            raise ValueError(f"samples are {self.samples.dtype}: as {np.dtype(dtype)} they must be copied")
        return np.array(self.samples, dtype) if copy else np.asarray(self.samples, dtype)

    def dataset(self) -> Dataset:
        """The samples and the tables of contacts as named arrays with units; see `Exports`.

        Returns
        -------
        Dataset
            The columns over ``t``; ``events.time``, ``contacts.peak_force`` and so on over axes of their own.
        """
        variables = {"t": Variable(("t",), self.t, "s")}
        variables |= {name: Variable(("t",), self[name], column_unit(name)) for name in self.columns}
        for name in ("events", "contacts", "skipped_events", "skipped_contacts"):
            table = getattr(self, name)
            variables |= table_variables(name, name, table, units(table.row))
        facts: dict[str, str | int | float] = {
            "status": self.status,
            "message": self.message,
            "end_time": self.end_time,
        }
        return Dataset("t", variables, facts | common_facts(self.settings, self.scene, self.warnings))

    def peak(self, output: str) -> Extremum:
        """Largest value of an output in the sampled time: of the continuous motion, not of the samples.

        Available at once if `simulate` was called with ``features=[features.peak(output),
        features.time_of_peak(output)]``. Otherwise the run is repeated with the same steps, and the extrema
        of all its columns are kept: the first call takes about as long as three runs, further ones no time.

        Parameters
        ----------
        output : str
            Name of an output of the scene; it need not be a column of this run.

        Returns
        -------
        Extremum
            NaN if the run failed.

        Raises
        ------
        ValueError
            If the scene has no such output.
        """
        return self._extremum("peak", output)

    def lowest(self, output: str) -> Extremum:
        """Smallest value of an output in the sampled time; see `peak`."""
        return self._extremum("lowest", output)

    @overload
    def feature(self, feature: Feature, *, cycles: None = None) -> float: ...
    @overload
    def feature(self, feature: Feature, *, cycles: int) -> Array: ...
    def feature(self, feature: Feature, *, cycles: int | None = None) -> float | Array:
        """A feature of the continuous motion over the sampled time, such as ``features.rms("slider.ax")``.

        Available at once if it was among the ``features`` of the settings, with as many ``cycles``; otherwise
        the run is repeated with the same steps.

        Parameters
        ----------
        feature : Feature
            The feature: `peak`, `mean`, `impacts` and similar.
        cycles : int, optional
            Divide the sampled time into so many equal pieces [-] and find the feature of each.

        Returns
        -------
        float, or ndarray of shape (cycles,) if cycles are given
            In the unit of the feature; NaN where the run ended before.

        Raises
        ------
        ValueError, TypeError
            If the scene has no such output or clearance joint, or an argument is wrong.
        """
        checks = Checks()
        if not isinstance(feature, Feature):
            checks.add("feature", f'must be one such as peak("slider.ax"), got {feature!r}', wrong_type=True)
        pieces = 1 if cycles is None else checked_settings(checks, {"cycles": cycles})["cycles"]
        checks.finish()
        found = self._found([feature], pieces)[:, 0]
        return float(found[0]) if cycles is None else found

    def _extremum(self, kind: str, output: str) -> Extremum:
        value, time = self._found([Feature(kind, output), Feature(f"time_of_{kind}", output)], 1)[0]
        return Extremum(float(value), float(time), bool(time < settling_time(self.scene)))

    def _found(self, features: list[Feature], cycles: int) -> Array:
        """Features over the sampled time in pieces, shape (cycles, features)."""
        known = self._known
        missing = [feature for feature in features if (feature, cycles) not in known]
        if missing:
            if cycles == 1 and missing[0].of in self.columns:
                missing += [Feature(kind, name) for name in self.columns for kind in EXTREMA]
            asked = list(dict.fromkeys(missing))
            require_features(self.scene.check(), asked)
            # Exactly the same steps again, which do not depend on samples and outputs.
            again = dataclasses.replace(
                self.settings,
                samples=2,
                outputs=self.scene.check().columns[:1],
                features=tuple(asked),
                cycles=cycles,
            )
            values = compiled(self.scene).simulate(again.to_json(), None, self.start)["features"]
            known |= {(feature, cycles): values[:, index] for index, feature in enumerate(asked)}
        return np.stack([known[feature, cycles] for feature in features], axis=1)

    @cached_property
    def _known(self) -> dict[tuple[Feature, int], Array]:
        """The features found so far, by the number of cycles."""
        cycles = self.settings.cycles
        return {(feature, cycles): self.features[:, k] for k, feature in enumerate(self.settings.features)}

    def plot(self, columns: str | Sequence[str], *, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw columns of one unit against time; see `plot_trajectory`."""
        from ..plots.runs import plot_trajectory

        return plot_trajectory(self, columns if isinstance(columns, str) else list(columns), ax=ax, **options)

    def animate(self, output: str | None = None, **options: Any) -> Animation:
        """The run in motion, for notebooks and files; `chebclear.animate` has the options."""
        from ..plots.animation.animate import animate

        return animate(self, output, **options)

    def _document(self, title: str | None) -> Document:
        from .report import run_document

        return run_document(self, title)

    def _check_shapes(self) -> None:
        records.sound(self, samples=(len(self.t), len(self.columns)))
