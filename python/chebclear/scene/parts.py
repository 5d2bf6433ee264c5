"""Bodies and joints, and what the core makes of a scene of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, TypeAlias

from ..base.shown import Shown
from ..base.units import unit
from .forces import Damper, Force, Gravity, Spring, Torque, TorsionDamper, TorsionSpring
from .laws import (
    ContactLaw,
    Flores,
    FrictionLaw,
    Hertz,
    HuntCrossley,
    LankaraniNikravesh,
    ModifiedCoulomb,
    SmoothedCoulomb,
)
from .motions import BodyStart, ClearanceStart, JointStart, Motion, Speed
from .schema import Part, Points, Vector


@dataclass(frozen=True)
class Body(Part):
    """A rigid body.

    Parameters
    ----------
    name : str
        Name, unique in the scene.
    mass : float
        Mass [kg].
    inertia : float
        Moment of inertia about the point `inertia_about` [kg m²].
    center_of_mass : (float, float)
        Center of mass in the frame of the body [m].
    inertia_about : str
        Name of the point of the body that `inertia` refers to.
    points : mapping of str to (float, float)
        Named points in the frame of the body [m].
    angle : float
        Rough angle of the body's frame at the start [rad]; chooses between the ways to assemble a mechanism.
    """

    name: str
    mass: float = field(metadata=unit("kg"))
    inertia: float = field(metadata=unit("kg m²"))
    center_of_mass: Vector = field(default=(0.0, 0.0), metadata=unit("m"))
    inertia_about: str = "center_of_mass"
    points: Mapping[str, Vector] = field(default_factory=lambda: Points({}), metadata=unit("m"))
    angle: float = field(default=0.0, metadata=unit("rad"))


@dataclass(frozen=True)
class Revolute(Part):
    """A pin without play: the points coincide, the bodies turn.

    Parameters
    ----------
    name : str
        Name, unique in the scene.
    a, b : str
        The two points, as ``"body.point"``.
    """

    _tag = ("type", "revolute")

    name: str
    a: str
    b: str


@dataclass(frozen=True)
class Prismatic(Part):
    """A guide without play: point b slides along the line through point a, the bodies do not turn.

    Parameters
    ----------
    name : str
        Name, unique in the scene.
    a, b : str
        The two points, as ``"body.point"``.
    axis : (float, float)
        Direction of the line in the frame of body a [-], of any length.
    angle : float
        Angle of body b relative to body a [rad].
    """

    _tag = ("type", "prismatic")

    name: str
    a: str
    b: str
    axis: Vector = field(metadata=unit("-"))
    angle: float = field(default=0.0, metadata=unit("rad"))


@dataclass(frozen=True)
class Fixed(Part):
    """A weld: the points coincide, the bodies do not turn.

    Parameters
    ----------
    name : str
        Name, unique in the scene.
    a, b : str
        The two points, as ``"body.point"``.
    angle : float
        Angle of body b relative to body a [rad].
    """

    _tag = ("type", "fixed")

    name: str
    a: str
    b: str
    angle: float = field(default=0.0, metadata=unit("rad"))


@dataclass(frozen=True)
class ClearanceRevolute(Part):
    """A pin with play: a journal moves freely in a larger bearing until it touches.

    Parameters
    ----------
    name : str
        Name, unique in the scene.
    bearing, journal : str
        Centers of bearing and journal, as ``"body.point"``.
    journal_radius : float
        Radius of the journal [m].
    clearance : float
        Radial clearance, bearing radius minus journal radius [m].
    contact : LankaraniNikravesh, Flores, HuntCrossley or Hertz
        Law of the normal force.
    friction : ModifiedCoulomb or SmoothedCoulomb, optional
        Law of the friction force; none if not given.
    sliding : {"surface", "contact_point"}
        Sliding velocity that friction sees: of the two material surfaces, or of the geometric contact point
        as in the paper's Eqs. (5) and (6), which misses the rotation of the bodies.
    impact_velocity_floor : float, optional
        Least impact velocity that the contact law latches [m/s]. If not given it follows the velocity
        tolerance of a run, and so moves its results no more than the tolerance does.

    Notes
    -----
    Both forces act at the contact points of journal and bearing, Eq. (3) of Xiang et al. (2020), which lie
    apart by the penetration. Normal forces there are in line; friction forces are not and leave a couple,
    penetration times friction force: a free pair drifts by somewhat less of the angular momentum that
    friction exchanges than the deepest penetration is of the journal radius. Measured: 0.4 % at 0.4 %, 18 %
    at 22 %; 2e-4 in the mechanism of the paper.
    """

    _tag = ("type", "clearance_revolute")
    _choices: ClassVar = {
        "contact": (LankaraniNikravesh, Flores, HuntCrossley, Hertz),
        "friction": (ModifiedCoulomb, SmoothedCoulomb),
    }

    name: str
    bearing: str
    journal: str
    journal_radius: float = field(metadata=unit("m"))
    clearance: float = field(metadata=unit("m"))
    contact: ContactLaw
    friction: FrictionLaw | None = None
    sliding: str = "surface"
    impact_velocity_floor: float | None = field(default=None, metadata=unit("m/s"))


Joint: TypeAlias = Revolute | Prismatic | Fixed | ClearanceRevolute
AnyForce: TypeAlias = Gravity | Spring | Damper | TorsionSpring | TorsionDamper | Force | Torque
Drive: TypeAlias = Speed | Motion
Start: TypeAlias = JointStart | BodyStart | ClearanceStart


@dataclass(frozen=True, repr=False)
class Inspection(Shown):
    """What the core made of a scene; see `Scene.check`.

    Attributes
    ----------
    degrees_of_freedom : int
        Number of coordinates that are integrated [-].
    coordinates : tuple[str, ...]
        Names of those coordinates.
    columns : tuple[str, ...]
        Names of the outputs of a simulation that does not choose: bodies, clearance joints, drives.
    further_columns : tuple[str, ...]
        Names of the outputs that it can choose besides: points, joint coordinates, reactions, energies.
    bodies : tuple[str, ...]
        Names of the bodies.
    poses : tuple[tuple[float, float, float], ...]
        Position x, y [m] and angle [rad] of the frame of each body in the assembled start.
    cut_joints : tuple[str, ...]
        Names of the joints at which loops were cut.
    impact_velocity_floors : tuple[float, ...]
        Least impact velocity that the contact law latches at each clearance joint [m/s]; at the default
        rtol if the scene gives none.
    warnings : tuple[str, ...]
        Numbers that look wrong or in another unit, each with its path; a simulation warns of them.
    """

    degrees_of_freedom: int
    coordinates: tuple[str, ...]
    columns: tuple[str, ...]
    further_columns: tuple[str, ...]
    bodies: tuple[str, ...]
    poses: tuple[tuple[float, float, float], ...]
    cut_joints: tuple[str, ...]
    impact_velocity_floors: tuple[float, ...] = field(metadata=unit("m/s"))
    warnings: tuple[str, ...]

    @property
    def clearance_joints(self) -> tuple[str, ...]:
        """Names of the joints with clearance."""
        return tuple(
            name.removesuffix(".penetration") for name in self.columns if name.endswith(".penetration")
        )
