"""Wear by Archard's law: depths of a bearing, and cycles until it is too deep or a requirement fails."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar, Literal, TypeAlias, Unpack

import numpy as np

from ..base import files as records
from ..base.arguments import Checks
from ..base.rows import Array
from ..base.shown import meant_or_known
from ..base.units import unit, units
from ..data.dataset import Dataset, Variable, facts_of
from ..data.exports import Exports
from ..errors import ArgumentTypeError
from ..report import html
from ..report.document import Table
from ..run.features import lowest, peak
from ..run.settings import MOST_PERIODS, Settings, StepOptions
from ..run.simulation import run_scene
from ..run.trajectory import Trajectory
from ..scene.columns import column_unit
from ..scene.parts import ClearanceRevolute, loose_joints
from ..scene.scene import Scene
from ..study.requirements.specification import Specification

if TYPE_CHECKING:
    from matplotlib.axes import Axes

End: TypeAlias = Literal["depth", "requirement", "budget", "failed"]

# Sectors of a bearing whose scene has no profile [-]: those of its outputs of wear.
_SECTORS = 72
# Instants of a cycle at which the penetration is looked at [-]: every degree of a revolution.
_INSTANTS = 360
# Rounding of a depth that was made to reach its limit.
_REACHED = 1.0 - 1e-9

_ENDS: dict[End, str] = {
    "depth": "worn to the limit",
    "requirement": "the requirement fails",
    "budget": "no limit reached yet",
    "failed": "a run failed",
}


@dataclass(frozen=True)
class Archard:
    """Archard's law of wear for the bearing of a joint: the journal does not wear.

    A sector worn by W [N m], its integral of force times slip, loses the volume ``coefficient / hardness *
    W``. Source: Archard (1953).

    Attributes
    ----------
    coefficient : float
        Wear coefficient of the pair of materials and its lubrication [-].
    hardness : float
        Hardness of the bearing [Pa].
    length : float
        Length of the bearing along its axis [m].
    """

    coefficient: float
    hardness: float = field(metadata=unit("Pa"))
    length: float = field(metadata=unit("m"))

    def __post_init__(self) -> None:
        checks = Checks()
        for name, symbol in (("coefficient", "-"), *units(Archard).items()):
            number = checks.real(name, getattr(self, name), symbol, above=0.0)
            object.__setattr__(self, name, number)
        checks.finish()

    def depths(self, run: Trajectory, joint: str) -> Array:
        """Depth by which each sector of a bearing was worn since the start of a run.

        Parameters
        ----------
        run : Trajectory
            A run with the outputs ``"joint.wear_*"``.
        joint : str
            The joint.

        Returns
        -------
        ndarray of shape (samples, sectors)
            [m]

        Raises
        ------
        KeyError
            If the outputs are not there.
        """
        worn = np.stack(list(run.matching(f"{joint}.wear_*").values()), axis=1)
        bearing = next(one for one in loose_joints(run.scene.joints) if one.name == joint)
        width = 2.0 * math.pi / worn.shape[1] * (bearing.journal_radius + bearing.clearance)
        depths: Array = self.coefficient / (self.hardness * self.length * width) * worn
        return depths


@dataclass(frozen=True, eq=False, repr=False)
class WearLife(html.Tabled, records.Saved, Exports, kind="wear life"):
    """How bearings wear over the cycles of a mechanism; see `wear_life`.

    Attributes
    ----------
    end : str
        ``"depth"`` or ``"requirement"``: the limit that was reached; ``"budget"`` if none was in the given
        runs or cycles; ``"failed"`` if a run did not reach its end.
    life : float
        Cycles until then [-]; NaN if no limit was reached.
    cycles : Array
        Cycles at each run [-], shape (runs,).
    depth : Array
        Depth where it is largest, over all bearings [m], shape (runs,).
    values : Array
        Smallest and largest value of the output that is required, in its unit, shape (runs, 2); NaN without.
    profiles : dict[str, Array]
        Depths of each bearing [m], shape (runs, sectors).
    cycle : float
        Time of a cycle [s].
    limit : float | None
        The largest depth allowed [m].
    requirement : Specification | None
        What the motion must keep to.
    message : str
        How the last run ended, in words.
    """

    _axes: ClassVar = {
        "cycles": ("runs",),
        "depth": ("runs",),
        "values": ("runs", 2),
        "profiles": ("runs", None),
    }

    end: End
    life: float
    cycles: Array
    depth: Array = field(metadata=unit("m"))
    values: Array
    profiles: dict[str, Array] = field(metadata=unit("m"))
    cycle: float = field(metadata=unit("s"))
    limit: float | None = field(metadata=unit("m"))
    requirement: Specification | None
    message: str

    @property
    def table(self) -> Table:
        """One row for each run: cycles, largest depth, range of the output that is required."""
        head = ["cycles", "largest depth [m]"]
        rows = [[f"{n:.6g}", f"{depth:.4g}"] for n, depth in zip(self.cycles, self.depth, strict=True)]
        if self.requirement is not None:
            name = self.requirement.quantity
            head.append(f"{name} [{column_unit(name)}]")
            for row, (least, most) in zip(rows, self.values, strict=True):
                row.append(f"{least:.4g} to {most:.4g}")
        return Table("Wear", head, rows)

    def dataset(self) -> Dataset:
        """A row for each run, with the profiles of the bearings by sector."""
        variables = {
            "run": Variable(("run",), np.arange(len(self.cycles)), "-"),
            "cycles": Variable(("run",), self.cycles, "-"),
            "depth": Variable(("run",), self.depth, "m"),
        }
        if self.requirement is not None:
            output = self.requirement.quantity
            for name, values in zip(("lowest", "highest"), self.values.T, strict=True):
                variables[f"{output}.{name}"] = Variable(("run",), values, column_unit(output))
        for name, values in self.profiles.items():
            variables[f"profiles.{name}"] = Variable(("run", f"sector of {name}"), values, "m")
        return Dataset("run", variables, facts_of(self))

    def __repr__(self) -> str:
        return f"<WearLife: {self}>"

    def __str__(self) -> str:
        cycles = self.cycles[-1] if math.isnan(self.life) else self.life
        return (
            f"{_ENDS[self.end]} after {cycles:.4g} cycles, {self.depth[-1]:.3g} m deep, "
            f"{len(self.cycles)} runs"
        )

    def plot(self, joint: str | None = None, *, ax: Axes | None = None, unit: str | None = None) -> Axes:
        """Draw the largest depth over the cycles, or the profiles of one bearing; see `plot_wear`."""
        from ..plots.runs import plot_wear

        return plot_wear(self, joint, ax=ax, unit=unit)


# Long because each argument is checked beside the loop that it steers.
def wear_life(
    scene: Scene,
    wear: Mapping[str, Archard],
    *,
    limit: float | None = None,
    requirement: Specification | None = None,
    depth_per_jump: float | None = None,
    cycle: float | None = None,
    settle: int = 2,
    measure: int = 2,
    max_runs: int = 200,
    max_cycles: float = math.inf,
    **steps: Unpack[StepOptions],
) -> WearLife:
    """Cycles until a bearing is worn too deep, or until the motion fails a requirement.

    Some cycles are simulated, each sector of a bearing is worn by what it lost in a cycle times the cycles of
    a jump, and the next run has the worn bearing: its profile (`ClearanceRevolute`) decides where it carries.

    Parameters
    ----------
    scene : Scene
        The mechanism as new, or with the profiles that it has.
    wear : mapping of str to Archard
        The law of each joint that wears.
    limit : float, optional
        Largest depth allowed [m].
    requirement : Specification, optional
        What an output must keep to in all the time of a cycle, as made by `require`, without ``at``.
    depth_per_jump : float, optional
        Wear of the fastest sector in a jump [m]. If not given, the largest penetration in the run before it:
        what is worn off beyond that carries nothing any more, and jumps of more than twice as much make
        neighboring sectors carry in turn.
    cycle : float, optional
        Time of a cycle [s]; the period of the drives if not given.
    settle, measure : int
        Cycles of a run that are simulated before, and those whose wear counts [-].
    max_runs : int
        Runs at most [-].
    max_cycles : float
        Cycles at most [-].
    **steps
        Fields of `Settings` for the integration, such as ``rtol``.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong; all problems are listed.
    SceneError
        If the scene is wrong, or a law of a joint is none for worn bearings.

    Examples
    --------
    >>> import chebclear as cc
    >>> scene = cc.mechanisms.slider_crank(clearance_at=("wrist",))
    >>> bronze = cc.laws.Archard(coefficient=1e-4, hardness=1e9, length=0.02)
    >>> found = cc.laws.wear_life(scene, {"wrist": bronze}, limit=5e-6, depth_per_jump=5e-6)
    >>> found.end, len(found.cycles)
    ('depth', 2)
    """
    checks = Checks()
    if not isinstance(scene, Scene):
        raise ArgumentTypeError(f"scene must be a Scene, got {scene!r:.80}")
    bearings = {joint.name: joint for joint in loose_joints(scene.joints)}
    if not isinstance(wear, Mapping) or not wear:
        checks.add("wear", f"must map names of joints to laws.Archard, got {wear!r}", wrong_type=True)
        wear = {}
    for name, law in wear.items():
        if name not in bearings:
            checks.add(f'wear["{name}"]', f"is no joint with clearance{meant_or_known(name, bearings)}")
        if not isinstance(law, Archard):
            checks.add(f'wear["{name}"]', f"must be a laws.Archard, got {law!r}", wrong_type=True)
    limit, depth_per_jump, cycle = (
        None if number is None else checks.real(name, number, symbol, above=0.0)
        for name, number, symbol in (
            ("limit", limit, "m"),
            ("depth_per_jump", depth_per_jump, "m"),
            ("cycle", cycle, "s"),
        )
    )
    lower, upper = -math.inf, math.inf
    if requirement is not None:
        if not isinstance(requirement, Specification) or requirement.at is not None:
            checks.add(
                "requirement",
                f"must be one for all the time, as require makes it, got {requirement!r}",
                wrong_type=not isinstance(requirement, Specification),
            )
        else:
            lower, upper = requirement.limits(checks, "requirement", column_unit(requirement.quantity))
    elif limit is None:
        checks.add("limit", "of the depth, a requirement or both must be given")
    skipped = checks.whole("settle", settle, least=0, most=MOST_PERIODS)
    counted = checks.whole("measure", measure, least=1, most=MOST_PERIODS)
    runs = checks.whole("max_runs", max_runs, least=1)
    if max_cycles != math.inf:
        max_cycles = checks.real("max_cycles", max_cycles, "-", above=0.0)
    # A wrong time is reported once, not again by the settings that follow from it.
    time = scene.period if cycle is None or checks.noted("cycle") else float(cycle)
    output = requirement.quantity if isinstance(requirement, Specification) else None
    settings = Settings.gathered(
        checks,
        None,
        steps,
        accepted=StepOptions.__annotations__,
        found={
            "outputs": [f"{name}.{what}" for name in wear for what in ("penetration", "wear_*")],
            "features": () if output is None else (lowest(output), peak(output)),
            "duration": counted * time,
            "skip": skipped * time,
            "samples": counted * _INSTANTS + 1,
        },
    ).of_runs
    profiles = {
        name: np.array(bearings[name].profile, dtype=float) if bearings[name].profile else np.zeros(_SECTORS)
        for name in wear
    }
    worn: list[dict[str, Array]] = []
    passed, values = [0.0], []
    end: End = "budget"
    while True:
        now = _with_profiles(scene, profiles)
        run = run_scene(now, settings.fitted(now.check()))
        worn.append(profiles)
        values.append((math.nan, math.nan) if output is None else tuple(run.features[0]))
        if not run.success:
            end = "failed"
        elif output is not None and not (lower <= values[-1][0] and values[-1][1] <= upper):
            end = "requirement"
        elif limit is not None and max(depths.max() for depths in profiles.values()) >= _REACHED * limit:
            end = "depth"
        if end != "budget":
            break
        rates = {name: np.ptp(law.depths(run, name), axis=0) / counted for name, law in wear.items()}
        fastest = max(float(rate.max()) for rate in rates.values())
        if len(worn) == runs or passed[-1] >= max_cycles or fastest == 0.0:
            break
        deepest = max(float(run[f"{name}.penetration"].max()) for name in wear)
        step = deepest if depth_per_jump is None else float(depth_per_jump)
        jump = min(step / fastest, max_cycles - passed[-1])
        if limit is not None:
            with np.errstate(divide="ignore"):
                jump = min(jump, *(((limit - profiles[name]) / rate).min() for name, rate in rates.items()))
        profiles = {name: profiles[name] + jump * rate for name, rate in rates.items()}
        passed.append(passed[-1] + jump)
    cycles, extremes = np.array(passed), np.array(values)
    return WearLife(
        end,
        _life(end, cycles, extremes, (lower, upper)),
        cycles,
        np.array([max(depths.max() for depths in one.values()) for one in worn]),
        extremes,
        {name: np.stack([one[name] for one in worn]) for name in wear},
        time,
        limit,
        requirement,
        run.message,
    )


def _with_profiles(scene: Scene, profiles: Mapping[str, Array]) -> Scene:
    """The mechanism with worn bearings."""
    joints = [
        replace(joint, profile=profiles[joint.name].tolist())
        if isinstance(joint, ClearanceRevolute) and joint.name in profiles
        else joint
        for joint in scene.joints
    ]
    return replace(scene, joints=joints)


def _life(end: End, cycles: Array, values: Array, limits: tuple[float, float]) -> float:
    """Cycles until a limit was reached: of a requirement, between the last two runs in proportion."""
    if end == "depth":
        return float(cycles[-1])
    if end != "requirement":
        return math.nan
    if len(cycles) == 1:
        return 0.0
    parts = [1.0]
    for side, limit in enumerate(limits):
        before, after = values[-2:, side]
        if (after - limit) * (1 - 2 * side) < 0.0:
            parts.append((limit - before) / (after - before))
    return float(cycles[-2] + min(parts) * (cycles[-1] - cycles[-2]))
