"""Prescribed motions and initial conditions."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from ..base.units import unit
from .forces import LOADS, Loaded
from .functions import Load
from .schema import Part, Vector


@dataclass(frozen=True)
class Speed(Part):
    """A revolute joint driven at constant speed.

    Parameters
    ----------
    name : str
        Name, unique in the scene.
    joint : str
        Name of the revolute joint.
    speed : float
        Angular velocity of body b relative to body a [rad/s].
    angle : float
        Angle of body b relative to body a at time zero [rad].
    """

    _tag = ("type", "speed")

    name: str
    joint: str
    speed: float = field(metadata=unit("rad/s"))
    angle: float = field(default=0.0, metadata=unit("rad"))


@dataclass(frozen=True)
class Motion(Loaded):
    """A revolute or prismatic joint whose coordinate is a given function of time.

    The mechanism starts with the value and the speed of the function at time zero: ``Harmonic`` and
    ``Polynomial`` may have a speed there, with which the other bodies then start.

    Parameters
    ----------
    name : str
        Name, unique in the scene.
    joint : str
        Name of the joint.
    motion : float, str, Polynomial, Harmonic, Table or Expression
        Angle or displacement of body b relative to body a [rad or m]; a number fixes the joint. A text is a
        formula of the time, such as ``"0.02*(1 - cos(8*time))"``, without `if`, `sign`, `abs`, `min`, `max`;
        a table is the cubic one over the time.
    """

    _tag = ("type", "motion")
    _choices: ClassVar = {"motion": LOADS}

    name: str
    joint: str
    motion: float | Load = field(metadata=unit("rad or m"))


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
