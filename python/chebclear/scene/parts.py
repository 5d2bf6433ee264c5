"""Bodies and joints, and the facts about a scene that the core finds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar, TypeAlias

from ..base.shown import Shown
from ..base.units import unit
from ..notices import Notice
from .forces import (
    Bushing,
    Connection,
    Damper,
    Element,
    Force,
    Gravity,
    Spring,
    Torque,
    TorsionDamper,
    TorsionSpring,
)
from .laws import (
    CONTACT_LAWS,
    FRICTION_LAWS,
    ContactLaw,
    Film,
    FiniteBearing,
    FrictionLaw,
    GuideFriction,
    JournalFriction,
    ShortBearing,
)
from .motions import BodyStart, ClearanceStart, GuideStart, JointStart, Motion, Speed
from .schema import Numbers, Points, Vector


@dataclass(frozen=True)
class Body(Element):
    """A rigid body.

    Parameters
    ----------
    mass : float
        Mass [kg]; 0 where the other bodies determine how the body accelerates.
    inertia : float
        Moment of inertia about the point `inertia_about` [kg m²]; 0 likewise, as of a point mass.
    center_of_mass : (float, float)
        Center of mass in the frame of the body [m].
    inertia_about : str
        Name of the point of the body that `inertia` refers to.
    points : mapping of str to (float, float)
        Named points in the frame of the body [m].
    angle : float
        Initial guess of the angle of the body's frame at the start [rad], which selects one of several
        possible assemblies of a mechanism.
    """

    mass: float = field(metadata=unit("kg"))
    inertia: float = field(metadata=unit("kg m²"))
    center_of_mass: Vector = field(default=(0.0, 0.0), metadata=unit("m"))
    inertia_about: str = "center_of_mass"
    points: Mapping[str, Vector] = field(default_factory=lambda: Points({}), metadata=unit("m"))
    angle: float = field(default=0.0, metadata=unit("rad"))


@dataclass(frozen=True)
class Revolute(Connection):
    """A pin joint without clearance: the points coincide, the bodies turn.

    Parameters
    ----------
    friction : JournalFriction, optional
        Friction; without it the joint turns freely.
    """

    _tag = ("type", "revolute")
    _choices: ClassVar = {"friction": (JournalFriction,)}

    friction: JournalFriction | None = None


@dataclass(frozen=True)
class Prismatic(Connection):
    """A guide without clearance: point b slides along the line through point a, the bodies do not turn.

    Parameters
    ----------
    axis : (float, float)
        Direction of the line in the frame of body a [-], of any length.
    angle : float
        Angle of body b relative to body a [rad].
    friction : GuideFriction, optional
        Friction; without it the body slides freely.
    """

    _tag = ("type", "prismatic")
    _choices: ClassVar = {"friction": (GuideFriction,)}

    axis: Vector = field(metadata=unit("-"))
    angle: float = field(default=0.0, metadata=unit("rad"))
    friction: GuideFriction | None = None


@dataclass(frozen=True)
class Fixed(Connection):
    """A weld: the points coincide, the bodies do not turn.

    Parameters
    ----------
    angle : float
        Angle of body b relative to body a [rad].
    """

    _tag = ("type", "fixed")

    angle: float = field(default=0.0, metadata=unit("rad"))


@dataclass(frozen=True)
class ClearanceRevolute(Element):
    """A revolute joint with clearance: a journal moves freely in a larger bearing until it touches.

    Parameters
    ----------
    bearing, journal : str
        Centers of bearing and journal, as ``"body.point"``.
    journal_radius : float
        Radius of the journal [m].
    clearance : float
        Radial clearance, bearing radius minus journal radius [m].
    contact : ExactRestitution, LankaraniNikravesh, Flores, Hertz or another contact law
        Law of the normal force.
    friction : ModifiedCoulomb, SmoothedCoulomb, StickSlip or FrictionFormula, optional
        Law of the friction force; none if not given.
    sliding : {"surface", "contact_point"}
        Sliding velocity in the friction law: of the two material surfaces, or of the geometric contact point
        as in the paper's Eqs. (5) and (6), which omits the rotation of the bodies.
    film : ShortBearing or FiniteBearing, optional
        Oil film between the surfaces; a dry joint if not given.
    profile : sequence of float
        Depth by which the bearing is worn in each of equal sectors [m], eight at least, counterclockwise from
        the x axis of its body. The surface then is a foundation of springs (Winkler) that presses wherever
        the journal reaches into it; with zeros it begins to press as the law does. Needs a law with the
        exponent 1.5 and damping in proportion to the elastic force, no film, and no `StickSlip`. A
        round bearing with a contact point if empty.
    impact_velocity_floor : float, optional
        Lower bound of the impact velocity in the contact law [m/s]: slower impacts are damped as if at it. If
        not given it is proportional to the velocity tolerance of a run, and changes results no more than the
        tolerance does.

    Notes
    -----
    Both forces act at the contact points of journal and bearing, Eq. (3) of Xiang et al. (2020), whose
    distance is the penetration. The normal forces there are collinear; the friction forces are not and form a
    couple of penetration times friction force. The angular momentum of a free pair of bodies therefore
    drifts: by a part of that exchanged by friction which is at most about the ratio of penetration to journal
    radius. Measured: 0.4 % at a ratio of 0.4 %, 18 % at 22 %; 2e-4 in the mechanism of the paper.
    """

    _tag = ("type", "clearance_revolute")
    _choices: ClassVar = {
        "contact": CONTACT_LAWS,
        "friction": FRICTION_LAWS,
        "film": (ShortBearing, FiniteBearing),
    }

    bearing: str
    journal: str
    journal_radius: float = field(metadata=unit("m"))
    clearance: float = field(metadata=unit("m"))
    contact: ContactLaw
    friction: FrictionLaw | None = None
    sliding: str = "surface"
    film: Film | None = None
    profile: Numbers = field(default=(), metadata=unit("m"))
    impact_velocity_floor: float | None = field(default=None, metadata=unit("m/s"))


@dataclass(frozen=True)
class ClearancePrismatic(Element):
    """A guide with play: a block moves freely between two parallel faces until its corners touch them.

    Which corners touch decides whether it is free, leans on one corner, lies flat on a face or is tilted
    across the guide.

    Parameters
    ----------
    a, b : str
        A point in the middle between the faces and the middle of the block, as ``"body.point"``.
    axis : (float, float)
        Direction of the guide in the frame of body a [-], of any length.
    length, height : float
        Size of the block along and across the axis [m].
    clearance : float
        Distance of the block in the middle to each face [m]: half of the whole play.
    contact : LankaraniNikravesh, Flores, ExactRestitution, HuntCrossley, KelvinVoigt, Impact or Hertz
        Law of the normal force of each corner.
    friction : ModifiedCoulomb, SmoothedCoulomb, StickSlip or FrictionFormula, optional
        Law of the friction force; none if not given.
    angle : float
        Angle of body b relative to body a without tilt [rad].
    corners : {"b", "a"}
        The body that has the corners. With ``"a"`` it is a sleeve of this length that slides on a rod of this
        height, which belongs to body b.
    face_length : float, optional
        Length of the faces along the axis [m]: of the guide, with the point of body a in their middle, or of
        the rod in a sleeve, with that of body b. As long as the block slides if not given. Where a corner has
        passed the end of a face, that end touches the side of the block; a block that leaves its guide ends
        the run (``"left_guide"``).
    impact_velocity_floor : float, optional
        Lower bound of the impact velocity in the contact law [m/s], as that of `ClearanceRevolute`.

    Notes
    -----
    A corner at a distance y from the axis penetrates by ``|y| - height / 2 - clearance``. Its force acts on
    both bodies in the corner, so that momentum, angular momentum and energy are kept exactly. In the plane an
    edge has no stiffness of its own: that of the law is that of the edge over its whole width.

    Corners are named as seen along the axis: ``front_left``, ``front_right``, ``rear_left``, ``rear_right``;
    the ends of faces ``front_left_end`` and so on.
    Outputs such as ``"guide.front_left.normal_force"`` belong to one of them, others such as
    ``"guide.tilt"`` to the whole.
    """

    _tag = ("type", "clearance_prismatic")
    _choices: ClassVar = {"contact": CONTACT_LAWS, "friction": FRICTION_LAWS}

    a: str
    b: str
    axis: Vector = field(metadata=unit("-"))
    length: float = field(metadata=unit("m"))
    height: float = field(metadata=unit("m"))
    clearance: float = field(metadata=unit("m"))
    contact: ContactLaw
    friction: FrictionLaw | None = None
    angle: float = field(default=0.0, metadata=unit("rad"))
    corners: str = "b"
    face_length: float | None = field(default=None, metadata=unit("m"))
    impact_velocity_floor: float | None = field(default=None, metadata=unit("m/s"))


@dataclass(frozen=True)
class PinInSlot(Element):
    """A pin in a straight slot with play: it moves and turns freely until it touches one of the two faces.

    Parameters
    ----------
    slot, pin : str
        A point in the middle between the faces and the center of the pin, as ``"body.point"``.
    axis : (float, float)
        Direction of the slot in the frame of its body [-], of any length.
    pin_radius : float
        Radius of the pin [m].
    clearance : float
        Distance of the pin in the middle to each face [m]: half of the whole play.
    contact : ExactRestitution, LankaraniNikravesh, Flores, Hertz or another contact law
        Law of the normal force.
    friction : ModifiedCoulomb, SmoothedCoulomb, StickSlip or FrictionFormula, optional
        Law of the friction force; none if not given.
    face_length : float, optional
        Length of the faces along the axis [m], with the point of the slot in their middle; without ends if
        not given. The slot is open there: the pin may leave it and touch the ends of its faces from outside.
    impact_velocity_floor : float, optional
        Lower bound of the impact velocity in the contact law [m/s], as that of `ClearanceRevolute`.
    """

    _tag = ("type", "pin_in_slot")
    _choices: ClassVar = {"contact": CONTACT_LAWS, "friction": FRICTION_LAWS}

    slot: str
    pin: str
    axis: Vector = field(metadata=unit("-"))
    pin_radius: float = field(metadata=unit("m"))
    clearance: float = field(metadata=unit("m"))
    contact: ContactLaw
    friction: FrictionLaw | None = None
    face_length: float | None = field(default=None, metadata=unit("m"))
    impact_velocity_floor: float | None = field(default=None, metadata=unit("m/s"))


@dataclass(frozen=True)
class Stop(Element):
    """A one-sided stop: a corner or a round edge of body b cannot pass a straight face of body a.

    Parameters
    ----------
    a, b : str
        A point of the face and the corner, or the center of the edge, as ``"body.point"``.
    normal : (float, float)
        Direction out of the face in the frame of body a [-], of any length.
    contact : ExactRestitution, LankaraniNikravesh, Flores, Hertz or another contact law
        Law of the normal force.
    friction : ModifiedCoulomb, SmoothedCoulomb, StickSlip or FrictionFormula, optional
        Law of the friction force; none if not given.
    radius : float
        Radius of the edge [m]; zero for a corner.
    face_length : float, optional
        Length of the face [m], with its point in the middle; without ends if not given. One with ends is a
        thin plate, which touches a round edge from both sides and with its ends.
    impact_velocity_floor : float, optional
        Lower bound of the impact velocity in the contact law [m/s], as that of `ClearanceRevolute`.
    """

    _tag = ("type", "stop")
    _choices: ClassVar = {"contact": CONTACT_LAWS, "friction": FRICTION_LAWS}

    a: str
    b: str
    normal: Vector = field(metadata=unit("-"))
    contact: ContactLaw
    friction: FrictionLaw | None = None
    radius: float = field(default=0.0, metadata=unit("m"))
    face_length: float | None = field(default=None, metadata=unit("m"))
    impact_velocity_floor: float | None = field(default=None, metadata=unit("m/s"))


Joint: TypeAlias = Revolute | Prismatic | Fixed | ClearanceRevolute | ClearancePrismatic | PinInSlot | Stop
AnyForce: TypeAlias = Gravity | Spring | Damper | Bushing | TorsionSpring | TorsionDamper | Force | Torque
Drive: TypeAlias = Speed | Motion
Start: TypeAlias = JointStart | BodyStart | ClearanceStart | GuideStart


@dataclass(frozen=True, repr=False)
class Inspection(Shown):
    """Facts about a scene; see `Scene.check`.

    Attributes
    ----------
    degrees_of_freedom : int
        Number of coordinates that are integrated [-].
    coordinates : tuple[str, ...]
        Names of those coordinates.
    columns : tuple[str, ...]
        Names of the default outputs of a simulation: of bodies, clearance joints and drives.
    further_columns : tuple[str, ...]
        Names of outputs on request: of points, joint coordinates, reactions and energies.
    sector_columns : tuple[str, ...]
        Names of the wear of every revolute joint with clearance by the sectors of its bearing, such as
        ``"wrist.wear_0"``: outputs on request too, which only patterns such as ``"wrist.wear_*"`` match.
    bodies : tuple[str, ...]
        Names of the bodies.
    poses : tuple[tuple[float, float, float], ...]
        Position x, y [m] and angle [rad] of the frame of each body in the assembled start.
    cut_joints : tuple[str, ...]
        Names of the joints at which loops were cut.
    impact_velocity_floors : tuple[float, ...]
        Lower bound of the impact velocity in the contact law of each of the `clearance_joints` [m/s]; that at
        the default rtol if the scene gives none.
    branch : tuple[int, ...]
        On which side each loop was closed, as signs -1 and 1 that change only where two ways to close it
        meet, and 0 near there [-]. Clearance joints close loops too. Loops that close only together have one
        sign for all their ways; those that neither a drive nor a given position holds have none.
    notices : tuple[Notice, ...]
        Numbers that look wrong or seem to be in another unit, each with its path; a simulation warns of them.
    """

    degrees_of_freedom: int
    coordinates: tuple[str, ...]
    columns: tuple[str, ...]
    further_columns: tuple[str, ...]
    sector_columns: tuple[str, ...]
    bodies: tuple[str, ...]
    poses: tuple[tuple[float, float, float], ...]
    cut_joints: tuple[str, ...]
    impact_velocity_floors: tuple[float, ...] = field(metadata=unit("m/s"))
    branch: tuple[int, ...]
    notices: tuple[Notice, ...]

    @property
    def clearance_joints(self) -> tuple[str, ...]:
        """Names of the joints with clearance and, of those with several contacts, of each of these."""
        return tuple(
            name.removesuffix(".penetration") for name in self.columns if name.endswith(".penetration")
        )


GROUND = "ground"
"""Name of the frame to which bodies are joined."""


def ends_of(joint: Joint) -> tuple[str, str]:
    """The two points of a joint."""
    if isinstance(joint, ClearanceRevolute):
        return joint.bearing, joint.journal
    return (joint.slot, joint.pin) if isinstance(joint, PinInSlot) else (joint.a, joint.b)


def owner_of(end: str) -> str:
    """Body of a point ``"body.point"``."""
    return end.partition(".")[0]


def loose_joints(joints: Iterable[Joint]) -> list[ClearanceRevolute]:
    """Revolute joints with clearance."""
    return [joint for joint in joints if isinstance(joint, ClearanceRevolute)]


def joints_with_play(joints: Iterable[Joint]) -> list[ClearanceRevolute | ClearancePrismatic | PinInSlot]:
    """Joints that have a clearance."""
    return [
        joint for joint in joints if isinstance(joint, ClearanceRevolute | ClearancePrismatic | PinInSlot)
    ]


def has_contacts(joints: Iterable[Joint]) -> bool:
    """Whether bodies touch somewhere by a contact force."""
    return any(not isinstance(joint, Revolute | Prismatic | Fixed) for joint in joints)
