"""The result of one simulation."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base import files as records
from ..base.units import unit
from ..scene.scene import Scene
from .accuracy import ErrorEstimate
from .names import output_meant
from .settings import Settings

if TYPE_CHECKING:
    from matplotlib.axes import Axes


Array = NDArray[np.float64]

# How the fields of an error estimate are written to a file.
_ERROR_ARRAYS = ("max_difference", "ranges", "horizon")
_ERROR_FACTS = ("rtol", "status", "compared_until")


@dataclass(frozen=True)
class Stats:
    """What a simulation cost, in counts that do not depend on the machine."""

    steps: int
    """Accepted steps [-]."""
    explicit_steps: int
    """Those that the explicit method took [-]: all with ``"dop853"``, none with Rosenbrock methods."""
    switches: int
    """Changes between the explicit and the Rosenbrock method by ``"auto"`` [-]."""
    rejected: int
    """Rejected steps [-]."""
    stages: int
    """Stages of the integrator [-]."""
    evaluations: int
    """Evaluations of the accelerations [-]."""
    jacobians: int
    """Evaluations of the Jacobian [-]."""
    factorisations: int
    """Matrix factorisations [-]."""
    events: int
    """Located contact changes [-]."""
    landings: int
    """Attempts to end a step on a contact change [-]."""
    floored_latches: int
    """Contacts whose impact velocity was raised to the floor [-]."""
    largest_projection: float = field(metadata=unit("m"))
    """Largest correction that closed the loops after a step [m]; zero in a tree."""
    smallest_step: float = field(metadata=unit("s"))
    """Smallest accepted step that was not cut by a contact change or the end [s]."""
    smallest_step_time: float = field(metadata=unit("s"))
    """When it was taken [s]."""


@dataclass(frozen=True, eq=False, repr=False)
class Events(records.ArrayRecord):
    """Changes of contact, in the order of time."""

    time: Array = field(metadata=unit("s"))
    """When [s]."""
    joint: NDArray[np.str_]
    """Name of the clearance joint."""
    kind: NDArray[np.str_]
    """``"onset"``, ``"separation"``, or ``"clip"`` and ``"unclip"``: normal force reaches and leaves 0."""
    normal_velocity: Array = field(metadata=unit("m/s"))
    """Penetration rate at that instant [m/s]."""

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True, eq=False, repr=False)
class Contacts(records.ArrayRecord):
    """Contacts from onset to separation, in the order of their onsets."""

    joint: NDArray[np.str_]
    """Name of the clearance joint."""
    onset: Array = field(metadata=unit("s"))
    """When journal and bearing touched [s]."""
    separation: Array = field(metadata=unit("s"))
    """When they parted [s]; NaN if the run ended in contact."""
    impact_velocity: Array = field(metadata=unit("m/s"))
    """Penetration rate at the onset [m/s]; NaN if the run began in contact."""
    peak_force: Array = field(metadata=unit("N"))
    """Largest normal force [N]."""
    peak_time: Array = field(metadata=unit("s"))
    """When it acted [s]."""

    def __len__(self) -> int:
        return len(self.onset)

    @property
    def duration(self) -> Array:
        """Separation minus onset [s]."""
        return self.separation - self.onset


@dataclass(frozen=True, repr=False)
class EndState:
    """Where a simulation ended, for another one to start from: `simulate(scene, ..., start=run.end)`."""

    memory: str
    """What the core must know to go on bit for bit, as JSON."""
    scene: Scene | None = dataclasses.field(default=None, hash=False)
    """What was simulated, to tell another scene by; None if that is not known."""

    def __repr__(self) -> str:
        return f"<EndState: t = {self.time:g} s>"

    @property
    def time(self) -> float:
        """When it ended [s]."""
        return float(json.loads(self.memory)["time"])


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(records.ArrayRecord):
    """The result of one simulation; ``run["slider.x"]`` is the column of that name.

    Trajectories compare (NaN equals NaN), copy, pickle, save and load. Their arrays are read-only: change a
    copy.
    """

    t: Array = field(metadata=unit("s"))
    """Instants of the samples [s], shape (samples,)."""
    columns: tuple[str, ...]
    """Names of the columns."""
    values: Array
    """All columns in SI units, shape (samples, columns); NaN after a failure."""
    events: Events
    """Changes of contact, those of the time skipped before the first sample included."""
    contacts: Contacts
    """Contacts with their durations and peak forces, likewise."""
    end: EndState | None
    """Where it ended, for another simulation to start from; None after a failure."""
    stats: Stats
    """What the simulation cost."""
    status: str
    """``"done"``, or the word for why it ended early."""
    message: str
    """How the run ended, in words: that the end was reached, or why it ended early, when and where."""
    end_time: float = field(metadata=unit("s"))
    """Where the simulation ended [s]."""
    joint: str | None
    """The clearance joint whose change of contact could not be located or was one too many."""
    warnings: tuple[str, ...]
    """What the user was warned of."""
    settings: Settings
    """How the simulation was run."""
    scene: Scene
    """What was simulated."""
    error: ErrorEstimate | None = None
    """Errors estimated by a companion run; None unless asked for."""

    @property
    def success(self) -> bool:
        """Whether the simulation reached its end."""
        return self.status == "done"

    def __repr__(self) -> str:
        size = f"{len(self.columns)} columns of {len(self.t)} samples"
        start = f"from t = {self.t[0]:g} s " if self.t[0] else ""
        end = "" if self.success else f" at {self.end_time:g} s"
        return f"<Trajectory: {size} {start}to t = {self.t[-1]:g} s, {self.status}{end}>"

    def __getitem__(self, column: str) -> Array:
        """A view of one column, shape (samples,)."""
        return self.values[:, column_index(self.columns, column, self.scene)]

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def to_dict(self) -> dict[str, Array]:
        """``t`` and all columns by name, as a data frame wants them.

        Returns
        -------
        dict of str to ndarray, shape (samples,)
            Views; in the units of the columns.
        """
        return {"t": self.t, **{name: self[name] for name in self.columns}}

    def plot(self, columns: str | Sequence[str], *, ax: Axes | None = None, **options: Any) -> Axes:
        """Draw columns against time; see `plot_trajectory` for the options.

        Parameters
        ----------
        columns : str or sequence of str
            Names of columns of one unit.
        ax : Axes, optional
            Where to draw; a new figure if not given.
        **options
            Passed to `plot_trajectory`.

        Returns
        -------
        Axes
        """
        from ..plots import results as plot

        return plot.plot_trajectory(
            self, columns if isinstance(columns, str) else list(columns), ax=ax, **options
        )

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write everything to one compressed ``.npz`` file.

        Parameters
        ----------
        path : path
            Where to; ``.npz`` is appended if it is missing.

        Returns
        -------
        Path
            The file written.
        """
        arrays = {"t": self.t, "values": self.values}
        arrays |= {f"events_{name}": array for name, array in vars(self.events).items()}
        arrays |= {f"contacts_{name}": array for name, array in vars(self.contacts).items()}
        facts: dict[str, Any] = {
            "columns": self.columns,
            "stats": dataclasses.asdict(self.stats),
            "status": self.status,
            "message": self.message,
            "end_time": self.end_time,
            "end": None if self.end is None else self.end.memory,
            "joint": self.joint,
            "warnings": self.warnings,
            "settings": dataclasses.asdict(self.settings),
            "scene": json.loads(self.scene.to_json()),
        }
        if self.error is not None:
            arrays |= {f"error_{name}": getattr(self.error, name) for name in _ERROR_ARRAYS}
            facts["error"] = {name: getattr(self.error, name) for name in _ERROR_FACTS}
        return records.save(path, "trajectory", arrays, facts)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Trajectory:
        """Read what `save` wrote.

        Parameters
        ----------
        path : path
            The file.

        Returns
        -------
        Trajectory

        Raises
        ------
        ValueError
            If the file holds something else.
        """
        arrays, facts = records.load(path, "trajectory")
        scene = Scene.from_json(json.dumps(facts["scene"]))
        columns, error = tuple(facts["columns"]), None
        if "error" in facts:
            known = {name: arrays[f"error_{name}"] for name in _ERROR_ARRAYS}
            error = ErrorEstimate(columns=columns, **(facts["error"] | known))

        def table(kind: type, prefix: str) -> Any:
            return kind(**{item.name: arrays[f"{prefix}_{item.name}"] for item in dataclasses.fields(kind)})

        return cls(
            t=arrays["t"],
            columns=columns,
            values=arrays["values"],
            events=table(Events, "events"),
            contacts=table(Contacts, "contacts"),
            end=None if facts["end"] is None else EndState(facts["end"], scene),
            stats=Stats(**facts["stats"]),
            status=facts["status"],
            message=facts["message"],
            end_time=facts["end_time"],
            joint=facts["joint"],
            warnings=tuple(facts["warnings"]),
            settings=Settings.from_dict(facts["settings"]),
            scene=scene,
            error=error,
        )


def column_index(columns: Sequence[str], name: str, scene: Scene | None = None) -> int:
    """Where a column stands; KeyError if it is not there, with the nearest name that the scene has."""
    if name in columns:
        return columns.index(name)
    known = () if scene is None else scene.check().columns + scene.check().further_columns
    if name in known:
        raise KeyError(f'"{name}" was not asked for: name it in outputs=')
    raise KeyError(f'unknown column "{name}"{output_meant(name, columns) or output_meant(name, known)}')
