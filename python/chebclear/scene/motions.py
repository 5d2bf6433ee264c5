"""Prescribed motions, couplings of coordinates, and initial conditions."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from ..base.units import unit
from .forces import LOADS, Element, Loaded
from .functions import Expression, Load, Table
from .laws import CONTACT_LAWS, ContactLaw
from .schema import Part, Vector


@dataclass(frozen=True)
class Speed(Element):
    """A revolute joint driven at constant speed.

    Parameters
    ----------
    joint : str
        Name of the revolute joint.
    speed : float
        Angular velocity of body b relative to body a [rad/s].
    angle : float
        Angle of body b relative to body a at time zero [rad].
    """

    _tag = ("type", "speed")

    joint: str
    speed: float = field(metadata=unit("rad/s"))
    angle: float = field(default=0.0, metadata=unit("rad"))


@dataclass(frozen=True)
class Motion(Element, Loaded):
    """A revolute or prismatic joint whose coordinate is a given function of time.

    The mechanism starts with the value and the speed of the function at time zero: ``Harmonic`` and
    ``Polynomial`` may have a speed there, with which the other bodies then start.

    Parameters
    ----------
    joint : str
        Name of the joint.
    motion : float, str, Polynomial, Harmonic, Table or Expression
        Angle or displacement of body b relative to body a [rad or m]; a number fixes the joint. A text is a
        formula of the time, such as ``"0.02*(1 - cos(8*time))"``, without `if`, `sign`, `abs`, `min`, `max`;
        a table is the cubic one over the time.
    """

    _tag = ("type", "motion")
    _choices: ClassVar = {"motion": LOADS}

    joint: str
    motion: float | Load = field(metadata=unit("rad or m"))


@dataclass(frozen=True)
class Coupling(Element, Loaded):
    """A coordinate that follows another one, whatever the forces: gears, a rack, a belt, a cam.

    driven = law(driver) + `offset`, exactly unless there is backlash. The coupling exerts what that takes:
    its outputs are ``torque`` or ``force`` on the driven coordinate, and ``driver_torque`` or
    ``driver_force`` on the driver.

    Parameters
    ----------
    driven, driver : str
        The coordinates, by the names of outputs: the angle of a body or of a revolute joint, or the
        displacement in a prismatic joint, such as ``"wheel.angle"``, ``"guide.displacement"``.
    law : float, str, Table or Expression
        A number is the ratio, driven per driver [- or m]: of two gears minus the ratio of their numbers of
        teeth, positive for an internal gear or an open belt, the pitch radius of a rack's pinion. A table of
        the driven coordinate over the driver is the cubic spline; over an angle it must be periodic and span
        a turn or a whole part of it, and in a Geneva drive it ends a whole part of a turn beyond its first
        value. A text is a formula of the driver, without `if`, `sign`, `abs`, `min`, `max`.
    carrier : str, optional
        Body against which the angles count, which are then those of bodies: the arm of a planetary gear, or
        what holds the two shafts of a belt. A sun that stands still is ``"ground.angle"``.
    offset : float, optional
        What is added [rad or m]. If not given it is zero for a table or formula, and for a ratio as the
        initial angles of the bodies and the start have it: so the wheels were put together.
    pressure_angle : float, optional
        Angle at the pitch circles between the force of the teeth and their common tangent [rad], for gears,
        or a rack and its pinion. Revolute joints must hold both wheels to the body against which their
        angles count, so that their centers keep their distance; this and the ratio give the pitch radii.
    backlash : float, optional
        Play of the teeth along the pitch circle [m]: how far the driven ones can move between their flanks.
        It needs `pressure_angle` and `contact`.
    contact : LankaraniNikravesh, Flores, ExactRestitution, HuntCrossley, KelvinVoigt, Impact or Hertz
        Force of a flank along the common tangent of the pitch circles, by its penetration along it.

    Notes
    -----
    With a pressure angle the force acts at the pitch point, and bearings carry it: outputs ``tooth_force``,
    and ``tooth_force_x``, ``tooth_force_y`` on the driven teeth. Its radial part does no work. Without one,
    torques act instead, so that motion and drives are right but reactions of the bearings lack that force.

    With backlash nothing is tied: the flanks are contacts of the names of the coupling and ``ahead`` (the
    driven teeth are ahead of those of the driver) or ``behind``, such as ``"mesh.behind.normal_force"``. The
    output ``transmission_error`` is how far the driven teeth are ahead, from the middle of the play. They
    start in the middle, with the speed of the driver, unless the start places or moves both wheels.

    A negative force of a cam says that a follower without a groove would lift off.

    Examples
    --------
    >>> import chebclear as cc
    >>> cc.motions.Coupling("mesh", "wheel.angle", "pinion.angle", -20 / 40).law
    -0.5
    >>> cc.motions.Coupling("cam", "guide.displacement", "cam.angle", "0.01*(1 - cos(cam.angle))").offset
    """

    _choices: ClassVar = {"law": (Table, Expression), "contact": CONTACT_LAWS}

    driven: str
    driver: str
    law: float | Table | Expression | str = field(metadata=unit("- or m"))
    carrier: str | None = None
    offset: float | None = field(default=None, metadata=unit("rad or m"))
    pressure_angle: float | None = field(default=None, metadata=unit("rad"))
    backlash: float | None = field(default=None, metadata=unit("m"))
    contact: ContactLaw | None = None


@dataclass(frozen=True)
class JointStart(Part):
    """Initial position and velocity of an ideal joint.

    What is not given follows from the other joints, the drives and the initial guesses of the angles of the
    bodies.

    Parameters
    ----------
    joint : str
        Name of the revolute or prismatic joint; it must have no drive.
    position : float, optional
        Angle or displacement of body b relative to body a [rad or m].
    velocity : float, optional
        Its rate [rad/s or m/s].

    Notes
    -----
    Full turns of the position count for torsion springs, except at a joint where a loop is cut
    (``scene.check().cut_joints``): give the turns to a body there, with `BodyStart`.
    """

    _tag = ("type", "joint")

    joint: str
    position: float | None = field(default=None, metadata=unit("rad or m"))
    velocity: float | None = field(default=None, metadata=unit("rad/s or m/s"))


@dataclass(frozen=True)
class BodyStart(Part):
    """Initial angle and angular velocity of a body.

    Parameters
    ----------
    body : str
        Name of the body.
    angle : float, optional
        Angle of the body's frame [rad].
    angular_velocity : float, optional
        Angular velocity [rad/s].
    """

    _tag = ("type", "body")

    body: str
    angle: float | None = field(default=None, metadata=unit("rad"))
    angular_velocity: float | None = field(default=None, metadata=unit("rad/s"))


@dataclass(frozen=True)
class ClearanceStart(Part):
    """Initial position and velocity of a journal in its bearing; by default concentric and at relative rest.

    Parameters
    ----------
    joint : str
        Name of the clearance joint.
    eccentricity : (float, float)
        Vector from the center of the bearing to that of the journal, along the axes of ground [m].
    rate : (float, float)
        Its rate [m/s].
    """

    _tag = ("type", "clearance")

    joint: str
    eccentricity: Vector = field(metadata=unit("m"))
    rate: Vector = field(default=(0.0, 0.0), metadata=unit("m/s"))


@dataclass(frozen=True)
class GuideStart(Part):
    """Initial place of what slides in a guide with play; by default in the middle, without tilt and at rest.

    Parameters
    ----------
    joint : str
        Name of the `ClearancePrismatic` or `PinInSlot`.
    offset : float
        Distance of its point from the axis, to the left of it [m].
    tilt : float
        Angle of the block against the guide [rad]; a pin has none.
    displacement : float, optional
        Displacement along the axis [m]; if not given it follows from the other joints.
    offset_rate : float
        Rate of the offset [m/s].
    tilt_rate : float
        Rate of the tilt [rad/s].
    velocity : float, optional
        Rate of the displacement [m/s]; if not given it follows from the other joints.
    """

    _tag = ("type", "guide")

    joint: str
    offset: float = field(default=0.0, metadata=unit("m"))
    tilt: float = field(default=0.0, metadata=unit("rad"))
    displacement: float | None = field(default=None, metadata=unit("m"))
    offset_rate: float = field(default=0.0, metadata=unit("m/s"))
    tilt_rate: float = field(default=0.0, metadata=unit("rad/s"))
    velocity: float | None = field(default=None, metadata=unit("m/s"))
