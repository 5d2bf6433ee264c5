"""One simulation: settings in, trajectory out."""

from __future__ import annotations

import dataclasses
import json
import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _core, records
from .checks import Checks, did_you_mean
from .errors import ChebclearWarning, SimulationError
from .progress import bar, is_request
from .scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

METHODS = ("auto", "rodas5p", "rodas4", "dop853")
MAX_STEPS = 10_000_000
MAX_EVENTS = 1_000_000

# What is accepted at most; beyond, memory or the exact counts of floats end.
LEAST_RTOL, MOST_RTOL = 1e-13, 0.1
MOST_SAMPLES = 10_000_000
MOST_COUNT = 2**53


@dataclass(frozen=True)
class Settings:
    """How a simulation is run."""

    duration: float
    """Simulated time [s]."""
    samples: int
    """Number of equally spaced samples, both ends included [-]."""
    rtol: float
    """Relative tolerance of the integrator [-]."""
    method: str
    """Integrator."""
    outputs: tuple[str, ...] | None
    """Names of the columns to return; all of them if None."""
    max_steps: int
    """Steps after which a run is given up [-]."""
    max_events: int
    """Contact changes after which a run is given up [-]."""
    position_tolerance: float | None
    """Absolute tolerance of positions [m]; from `rtol` and the scales of the scene if None."""
    velocity_tolerance: float | None
    """Absolute tolerance of velocities [m/s]; from `rtol` and the scales of the scene if None."""

    @classmethod
    def checked(
        cls,
        checks: Checks,
        *,
        duration: object,
        samples: object,
        rtol: object,
        method: object,
        outputs: object,
        max_steps: object,
        max_events: object,
        position_tolerance: object,
        velocity_tolerance: object,
    ) -> Settings:
        """Settings from what the user gave; what is wrong with it is noted in `checks`."""
        absolute = {
            "position_tolerance": (position_tolerance, "m"),
            "velocity_tolerance": (velocity_tolerance, "m/s"),
        }
        return cls(
            duration=checks.real("duration", duration, "s", above=0.0),
            samples=checks.whole("samples", samples, least=2, most=MOST_SAMPLES),
            rtol=checks.real("rtol", rtol, "-", least=LEAST_RTOL, most=MOST_RTOL),
            method=checks.word("method", method, METHODS),
            outputs=_checked_names(checks, outputs),
            max_steps=checks.whole("max_steps", max_steps, least=1, most=MOST_COUNT),
            max_events=checks.whole("max_events", max_events, least=1, most=MOST_COUNT),
            **{
                name: None if value is None else checks.real(name, value, unit, above=0.0)
                for name, (value, unit) in absolute.items()
            },
        )

    def to_json(self) -> str:
        """The settings as the core reads them."""
        return json.dumps(dataclasses.asdict(self), allow_nan=False)

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Settings:
        """The settings from what JSON made of them."""
        outputs = plain["outputs"]
        return cls(**{**plain, "outputs": None if outputs is None else tuple(outputs)})

    def require_outputs_of(self, scene: Scene) -> None:
        """Raise ValueError if an output is no column of the scene."""
        if self.outputs is None:
            return
        columns = scene.check().columns
        checks = Checks()
        for name in self.outputs:
            if name not in columns:
                checks.add(f'unknown output "{name}"{did_you_mean(name, columns)}')
        checks.finish()


def _checked_names(checks: Checks, outputs: object) -> tuple[str, ...] | None:
    if outputs is None:
        return None
    if isinstance(outputs, str) or not isinstance(outputs, Iterable):
        checks.add(f"outputs must be a list of column names, got {outputs!r}", wrong_type=True)
        return None
    names = tuple(outputs)
    for name in names:
        if not isinstance(name, str):
            checks.add(f"outputs must be column names, got {name!r}", wrong_type=True)
        elif names.count(name) > 1:
            checks.add(f'outputs names "{name}" more than once')
    if not names:
        checks.add("outputs must name at least one column; None stands for all")
    return names


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
    largest_projection: float
    """Largest correction that closed the loops after a step [m]; zero in a tree."""
    smallest_step: float
    """Smallest accepted step that was not cut by a contact change or the end [s]."""
    smallest_step_time: float
    """When it was taken [s]."""


@dataclass(frozen=True, eq=False, repr=False)
class Events(records.ArrayRecord):
    """Changes of contact, in the order of time."""

    time: Array
    """When [s]."""
    joint: NDArray[np.str_]
    """Name of the clearance joint."""
    kind: NDArray[np.str_]
    """``"onset"``, ``"separation"``, or ``"clip"`` and ``"unclip"``: normal force reaches and leaves 0."""
    normal_velocity: Array
    """Penetration rate at that instant [m/s]."""

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory(records.ArrayRecord):
    """The result of one simulation; ``run["slider.x"]`` is the column of that name.

    Trajectories compare (NaN equals NaN), copy, pickle, save and load.
    """

    t: Array
    """Instants of the samples [s], shape (samples,)."""
    columns: tuple[str, ...]
    """Names of the columns."""
    values: Array
    """All columns in SI units, shape (samples, columns); NaN after a failure."""
    events: Events
    """Changes of contact."""
    stats: Stats
    """What the simulation cost."""
    status: str
    """``"done"``, or the word for why it ended early."""
    message: str
    """How the run ended, in words: that the end was reached, or why it ended early, when and where."""
    end_time: float
    """Where the simulation ended [s]."""
    joint: str | None
    """The joint that was concerned by a failure."""
    warnings: tuple[str, ...]
    """What the core warned of."""
    settings: Settings
    """How the simulation was run."""
    scene: Scene
    """What was simulated."""

    @property
    def success(self) -> bool:
        """Whether the simulation reached its end."""
        return self.status == "done"

    def __repr__(self) -> str:
        size = f"{len(self.columns)} columns of {len(self.t)} samples"
        return f"<Trajectory: {size} to t = {self.settings.duration:g} s, {self.status}>"

    def __getitem__(self, column: str) -> Array:
        """A view of one column, shape (samples,)."""
        return self.values[:, column_index(self.columns, column)]

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
        from . import plot

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
        facts = {
            "columns": self.columns,
            "stats": dataclasses.asdict(self.stats),
            "status": self.status,
            "message": self.message,
            "end_time": self.end_time,
            "joint": self.joint,
            "warnings": self.warnings,
            "settings": dataclasses.asdict(self.settings),
            "scene": json.loads(self.scene.to_json()),
        }
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
        names = [item.name for item in dataclasses.fields(Events)]
        return cls(
            t=arrays["t"],
            columns=tuple(facts["columns"]),
            values=arrays["values"],
            events=Events(**{name: arrays[f"events_{name}"] for name in names}),
            stats=Stats(**facts["stats"]),
            status=facts["status"],
            message=facts["message"],
            end_time=facts["end_time"],
            joint=facts["joint"],
            warnings=tuple(facts["warnings"]),
            settings=Settings.from_dict(facts["settings"]),
            scene=Scene.from_json(json.dumps(facts["scene"])),
        )


def column_index(columns: Sequence[str], name: str) -> int:
    """Where a column stands; KeyError with the nearest name if there is none."""
    if name not in columns:
        raise KeyError(f'unknown column "{name}"{did_you_mean(name, columns)}')
    return columns.index(name)


def simulate(
    scene: Scene,
    duration: float,
    samples: int,
    rtol: float = 1e-6,
    method: str = "auto",
    outputs: Sequence[str] | None = None,
    *,
    max_steps: int = MAX_STEPS,
    max_events: int = MAX_EVENTS,
    position_tolerance: float | None = None,
    velocity_tolerance: float | None = None,
    progress: bool | Callable[[float], None] | None = None,
    on_failure: Literal["raise", "return"] = "raise",
) -> Trajectory:
    """Simulate a scene from its assembled position.

    Contacts make trajectories chaotic: the error doubles every few changes of contact, so a tolerance buys
    accuracy over a limited time only.

    Parameters
    ----------
    scene : Scene
        What to simulate.
    duration : float
        Simulated time [s], above 0.
    samples : int
        Number of equally spaced samples, both ends included [-]; 2 to 10 000 000. Does not change the
        steps.
    rtol : float
        Relative tolerance of the integrator [-], from 1e-13 to 0.1.
    method : {"auto", "rodas5p", "rodas4", "dop853"}
        The explicit method of order 8 (DOP853) and a Rosenbrock method (Rodas4, Rodas5P at an rtol below
        3e-8), changing places with the stiffness of the motion; or one of them throughout. DOP853 alone is
        much dearer, though no less accurate, where a contact sticks.
    outputs : sequence of str, optional
        Names of the columns to return; all of them if not given. ``scene.check().columns`` lists them.
    max_steps, max_events : int
        Accepted steps and changes of contact after which the run is given up [-].
    position_tolerance, velocity_tolerance : float, optional
        Absolute tolerances [m], [m/s]; from `rtol` and the scales of the scene if not given.
    progress : True or callable, optional
        True shows a bar if standard error is a terminal; a callable gets the share that is done, from 0 to 1.
    on_failure : {"raise", "return"}
        Whether a run that fails raises or returns what it has, with its `Trajectory.status`.

    Returns
    -------
    Trajectory

    Raises
    ------
    SceneError
        If the scene is wrong; all problems are listed.
    SimulationError
        If the run fails; the exception has what was computed as `SimulationError.trajectory`.
    ValueError, TypeError
        If another argument is wrong; all problems are listed.
    """
    checks = Checks()
    if not isinstance(scene, Scene):
        checks.add(f"scene must be a Scene, got {scene!r}", wrong_type=True)
    settings = Settings.checked(
        checks,
        duration=duration,
        samples=samples,
        rtol=rtol,
        method=method,
        outputs=outputs,
        max_steps=max_steps,
        max_events=max_events,
        position_tolerance=position_tolerance,
        velocity_tolerance=velocity_tolerance,
    )
    if not is_request(progress):
        checks.add(f"progress must be None, True or callable, got {progress!r}", wrong_type=True)
    checks.word("on_failure", on_failure, ("raise", "return"))
    checks.finish()
    settings.require_outputs_of(scene)

    with _reporter(progress) as report:
        run = _core.simulate(scene.to_json(), settings.to_json(), report)
    warn_once(run["warnings"], stacklevel=3)
    events = run["events"]
    trajectory = Trajectory(
        t=run["t"],
        columns=tuple(run["columns"]),
        values=run["values"],
        events=Events(
            time=events["time"],
            joint=np.array(events["joint"], dtype=np.str_),
            kind=np.array(events["kind"], dtype=np.str_),
            normal_velocity=events["normal_velocity"],
        ),
        stats=Stats(**run["stats"]),
        status=run["status"],
        message=run["message"],
        end_time=run["time"],
        joint=run["joint"],
        warnings=tuple(run["warnings"]),
        settings=settings,
        scene=scene,
    )
    if not trajectory.success and on_failure == "raise":
        error = SimulationError(run["status"], run["time"], run["joint"], message=run["message"])
        error.trajectory = trajectory
        raise error
    return trajectory


def warn_once(messages: Iterable[str], stacklevel: int) -> None:
    """Pass on the warnings of the core, each text once; for `stacklevel`, this function is level 1."""
    for message in dict.fromkeys(messages):
        warnings.warn(message, ChebclearWarning, stacklevel=stacklevel)


@contextmanager
def _reporter(progress: bool | Callable[[float], None] | None) -> Iterator[Callable[[float], None] | None]:
    if callable(progress):
        yield progress
    elif progress:
        with bar("simulation", "") as report:
            yield None if report is None else lambda share: report(share, 1.0)
    else:
        yield None
