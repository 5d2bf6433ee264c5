"""Lost motion: how far a loaded output moves by the play of the joints while the drive is held."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from ..base import files as records, units
from ..base.arguments import Checks, as_number
from ..base.named import Named
from ..base.rows import Array
from ..base.shown import listed, meant_or_known
from ..data.dataset import Dataset, Variable, facts_of
from ..data.exports import Exports
from ..errors import ArgumentError, ArgumentTypeError
from ..run.settings import Settings
from ..run.simulation import simulate
from ..scene.forces import Force, Torque
from ..scene.functions import Polynomial
from ..scene.motions import ClearanceStart, GuideStart, Motion, Speed
from ..scene.parts import (
    GROUND,
    Body,
    ClearancePrismatic,
    ClearanceRevolute,
    Joint,
    PinInSlot,
    Prismatic,
    Revolute,
    Stop,
    joints_with_play,
    owner_of,
)
from ..scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..run.trajectory import Trajectory

# Time of a revolution [s]: so slow that inertial forces are below rounding beside a unit load.
_SLOW = 1e9


@dataclass(frozen=True, eq=False, repr=False)
class LostMotion(records.Saved, Named[Array], Exports, kind="lost motion"):
    """Lost motion of an output over the angle of the drive, and what each joint adds to it.

    A mapping from the names of the joints to their shares, each of shape (angles,).

    Attributes
    ----------
    at : str
        The point, or the body whose rotation is meant.
    unit : str
        Unit of the lost motion: m, or rad for a body.
    angle : Array
        Angle of the drive from its start [rad], shape (angles,).
    shares : dict[str, Array]
        What each joint adds, in `unit`, shape (angles,).
    clearances : dict[str, float]
        Clearance of each joint on one side [m].
    """

    _axes: ClassVar = {"angle": ("angles",), "shares": ("angles",)}

    at: str
    unit: str
    angle: Array = field(metadata=units.unit("rad"))
    shares: dict[str, Array]
    clearances: dict[str, float] = field(metadata=units.unit("m"))

    @property
    def total(self) -> Array:
        """Lost motion by all joints, in `unit`, shape (angles,)."""
        return np.asarray(np.sum(list(self.shares.values()), axis=0))

    @property
    def _by_name(self) -> dict[str, Array]:
        return self.shares

    def dataset(self) -> Dataset:
        """Lost motion by all joints and by each, over the angle of the drive."""
        columns = {"total": self.total, **{f"shares.{name}": one for name, one in self.shares.items()}}
        variables = {name: Variable(("angle",), one, self.unit) for name, one in columns.items()}
        facts = facts_of(self) | {f"clearance of {name} [m]": one for name, one in self.clearances.items()}
        return Dataset("angle", {"angle": Variable(("angle",), self.angle, "rad"), **variables}, facts)

    def __repr__(self) -> str:
        return f"<LostMotion of {self.at} by {listed(self._names, most=4)}: {self}>"

    def __str__(self) -> str:
        total = self.total
        worst = int(np.nanargmax(total))
        return (
            f"{np.nanmin(total):.4g} to {total[worst]:.4g} {self.unit}, most at "
            f"{math.degrees(self.angle[worst]):.4g} degrees of the drive"
        )

    def plot(self, *, ax: Axes | None = None, unit: str | None = None) -> Axes:
        """Draw what each joint adds over the angle of the drive; see `plot_lost_motion`."""
        from ..plots.bands import plot_lost_motion

        return plot_lost_motion(self, ax=ax, unit=unit)


def lost_motion(
    scene: Scene,
    at: str,
    direction: Sequence[float] | None = None,
    *,
    clearances: Mapping[str, float] | None = None,
    angles: int = 361,
) -> LostMotion:
    """How far an output moves by the play of the joints when its load changes its sign, the drive held.

    By virtual work: a revolute joint or a pin in a slot with the clearance c and the reaction R to a load F
    at the output adds ``2 c |R| / F``, to first order in c. A guide adds ``2 c (|N| + |N'|) / F``, with the
    forces at the two ends of what its faces and the block have in common. Gravity, springs, masses and
    friction do not count.

    Parameters
    ----------
    scene : Scene
        The mechanism, which its drives prescribe completely once its clearances are closed.
    at : str
        Point at which it is loaded, as ``"body.point"`` (or ``"body"``, its origin), with a direction; or a
        body, without one, whose rotation under a torque is meant.
    direction : (float, float), optional
        Direction of the load along the axes of ground [-]; any length.
    clearances : mapping of str to float, optional
        Clearance on one side of each revolute joint, pin in a slot and guide with play that counts [m]; all
        those of the scene if not given.
    angles : int
        Angles of the drive over one revolution [-], both ends included.

    Raises
    ------
    SceneError, SimulationError
        If the mechanism is wrong, or cannot make the revolution.
    ValueError, TypeError
        If an argument is wrong; all problems are listed.

    Examples
    --------
    >>> import chebclear as cc
    >>> scene = cc.mechanisms.slider_crank(clearance_at=("crank_pin", "wrist"))
    >>> print(cc.lost_motion(scene, "slider", (1.0, 0.0)))
    8e-05 to 8.8e-05 m, most at 90 degrees of the drive
    """
    checks = Checks()
    if not isinstance(scene, Scene):
        raise ArgumentTypeError(f"scene must be a Scene, got {scene!r:.80}")
    if not isinstance(at, str):
        checks.add("at", f'must be a point or a body, such as "slider", got {at!r}', wrong_type=True)
    way = _way(checks, direction)
    count = checks.whole("angles", angles, least=2)
    play = _play(checks, scene, clearances)
    speeds = [drive for drive in scene.drives if isinstance(drive, Speed) and drive.speed]
    if len(speeds) != 1:
        checks.add("scene", f"must have one drive at constant speed, got {len(speeds)}")
    checks.finish()
    name = "load of the output"
    load = Torque(name, owner_of(at), 1.0) if way is None else Force(name, at, *way)
    held = _held(scene, speeds[0], load)
    turning = held.check()
    if turning.degrees_of_freedom:
        raise ArgumentError(
            f"scene must be prescribed by its drives once its clearances are closed; it still has "
            f"{turning.degrees_of_freedom} degrees of freedom"
        )
    guides = [one for one in scene.joints if isinstance(one, ClearancePrismatic) and one.name in play]
    outputs = [f"{name}.reaction_{axis}" for name in play for axis in ("x", "y")]
    outputs = list(dict.fromkeys([*outputs, *(name for guide in guides for name in _outputs(guide))]))
    run = simulate(held, settings=Settings(duration=_SLOW, samples=count, outputs=outputs))
    reactions = {name: np.hypot(run[f"{name}.reaction_x"], run[f"{name}.reaction_y"]) for name in play}
    for guide in guides:
        reactions[guide.name] = _at_ends(guide, run)
    shares = {name: 2.0 * clearance * reactions[name] for name, clearance in play.items()}
    angle = np.linspace(0.0, math.copysign(2.0 * math.pi, speeds[0].speed), count)
    return LostMotion(at, "rad" if way is None else "m", angle, shares, play)


def _way(checks: Checks, direction: object) -> tuple[float, float] | None:
    """The direction of unit length; None for a torque."""
    if direction is None:
        return None
    numbers = [as_number(one) for one in np.ravel(np.asarray(direction, dtype=object))]
    x, y = numbers if len(numbers) == 2 else (None, None)
    length = math.nan if x is None or y is None else math.hypot(x, y)
    if x is None or y is None or not 0.0 < length < math.inf:
        words = f"must be a pair of numbers (x, y), finite and not zero, got {direction!r}"
        checks.add("direction", words, wrong_type=math.isnan(length))
        return 1.0, 0.0
    return x / length, y / length


def _play(checks: Checks, scene: Scene, clearances: object) -> dict[str, float]:
    """The clearances of the joints that have play."""
    with_play = joints_with_play(scene.joints)
    if clearances is None:
        found = {joint.name: joint.clearance for joint in with_play}
        if not found:
            checks.add("scene", "has no joint with clearance: give clearances")
        return found
    known = [joint.name for joint in scene.joints if isinstance(joint, Revolute) or joint in with_play]
    if not isinstance(clearances, Mapping) or not clearances:
        checks.add(
            "clearances",
            f"must map names of joints to clearances on one side [m], got {clearances!r}",
            wrong_type=not isinstance(clearances, Mapping),
        )
        return {}
    for name in clearances:
        if name not in known:
            checks.add(
                f'clearances["{name}"]',
                f"is no joint that may have play{meant_or_known(str(name), known)}",
            )
    return {
        name: checks.real(f'clearances["{name}"]', one, "m", least=0.0) for name, one in clearances.items()
    }


def _outputs(guide: ClearancePrismatic) -> list[str]:
    """What `_at_ends` needs of a run."""
    owner = owner_of(guide.a)
    kinds = ("reaction_x", "reaction_y", "reaction_torque", "displacement")
    return [f"{guide.name}.{kind}" for kind in kinds] + ([f"{owner}.angle"] if owner != GROUND else [])


def _at_ends(guide: ClearancePrismatic, run: Trajectory) -> Array:
    """Sum of the forces at both ends of what faces and block have in common [N]; NaN where it is outside."""
    x, y, moment, place, *turned = (run[name] for name in _outputs(guide))
    angle = math.atan2(guide.axis[1], guide.axis[0]) + (turned[0] if turned else 0.0)
    across = y * np.cos(angle) - x * np.sin(angle)
    own, face = 0.5 * guide.length, 0.5 * (guide.face_length or math.inf)
    # From the middle of the block: the sleeve on a rod, the block in a guide.
    sleeve, rod = (own, face) if guide.corners == "a" else (face, own)
    rear, front = np.maximum(-sleeve - place, -rod), np.minimum(sleeve - place, rod)
    shared = np.where(front > rear, front - rear, np.nan)
    forces: Array = np.abs((across * front - moment) / shared) + np.abs((moment - across * rear) / shared)
    return forces


def without_play(scene: Scene) -> Scene:
    """The mechanism with ideal joints in the place of those with clearance; without stops and forces.

    A pin in a slot turns in a shoe that slides there, a body more.
    """
    ideal: list[Joint] = []
    shoes = []
    for joint in scene.joints:
        if isinstance(joint, ClearanceRevolute):
            ideal.append(Revolute(joint.name, joint.bearing, joint.journal))
        elif isinstance(joint, ClearancePrismatic):
            ideal.append(Prismatic(joint.name, joint.a, joint.b, joint.axis, joint.angle))
        elif isinstance(joint, PinInSlot):
            shoe = f"shoe of {joint.name}"
            shoes.append(Body(shoe, 1.0, 1.0))
            ideal += [Prismatic(f"{shoe} in its slot", joint.slot, shoe, joint.axis)]
            ideal += [Revolute(joint.name, shoe, joint.pin)]
        elif not isinstance(joint, Stop):
            ideal.append(joint)
    start = [one for one in scene.start if not isinstance(one, ClearanceStart | GuideStart)]
    return replace(scene, bodies=[*scene.bodies, *shoes], joints=ideal, start=start, forces=())


def _held(scene: Scene, speed: Speed, load: Force | Torque) -> Scene:
    """The mechanism without play, masses that matter or other forces, driven very slowly."""
    rate = math.copysign(2.0 * math.pi / _SLOW, speed.speed)
    drives = [
        Motion(drive.name, drive.joint, Polynomial([speed.angle, rate])) if drive is speed else drive
        for drive in scene.drives
    ]
    return replace(without_play(scene), drives=drives, forces=[load])
