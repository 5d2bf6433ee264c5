"""Changes of contact in the clearance joints of a run, and whole contacts."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..base import files as records
from ..base.rows import Array, Rows
from ..base.units import unit


@dataclass(frozen=True, eq=False, repr=False)
class Event(records.ArrayRecord):
    """One change of contact, or of the form of a formula.

    Attributes
    ----------
    time : float
        Time [s].
    joint : str
        Name of the clearance joint; of a formula that of the force, torque or coupling.
    kind : str
        ``"onset"``, ``"separation"``; ``"clip"`` and ``"unclip"``: normal force reaches and leaves 0;
        ``"stick"`` and ``"slip"`` of the law `StickSlip`; ``"transfer"``: at the end of a face the contact
        passes to its end, or to the corner that comes there; ``"switch"``: a formula changes its form.
    normal_velocity : float
        Penetration rate at that instant [m/s]; NaN for a force, torque or coupling.
    """

    time: float = field(metadata=unit("s"))
    joint: str
    kind: str
    normal_velocity: float = field(metadata=unit("m/s"))


@dataclass(frozen=True, eq=False, repr=False)
class Events(Rows[Event]):
    """Changes of contact, in the order of time: a sequence of `Event`, and an array of each field.

    Attributes
    ----------
    time : Array
        Time [s].
    joint : ndarray of str
        Name of the clearance joint; of a formula that of the force, torque or coupling.
    kind : ndarray of str
        ``"onset"``, ``"separation"``; ``"clip"`` and ``"unclip"``: normal force reaches and leaves 0;
        ``"stick"`` and ``"slip"`` of the law `StickSlip`; ``"transfer"``: at the end of a face the contact
        passes to its end, or to the corner that comes there; ``"switch"``: a formula changes its form.
    normal_velocity : Array
        Penetration rate at that instant [m/s]; NaN for a force, torque or coupling.
    """

    row: ClassVar = Event

    time: Array = field(metadata=unit("s"))
    joint: NDArray[np.str_]
    kind: NDArray[np.str_]
    normal_velocity: Array = field(metadata=unit("m/s"))


@dataclass(frozen=True, eq=False, repr=False)
class Contact(records.ArrayRecord):
    """One contact, from onset to separation.

    Attributes
    ----------
    joint : str
        Name of the clearance joint.
    onset : float
        When journal and bearing touched [s].
    separation : float
        When they separated [s]; NaN if the run, or the skipped time, ended in contact.
    impact_velocity : float
        Penetration rate at the onset [m/s]; NaN if the run began in contact.
    peak_force : float
        Largest normal force [N]; if the contact lasts from the skipped into the sampled time, that in each.
    peak_time : float
        Time of that force [s].
    """

    joint: str
    onset: float = field(metadata=unit("s"))
    separation: float = field(metadata=unit("s"))
    impact_velocity: float = field(metadata=unit("m/s"))
    peak_force: float = field(metadata=unit("N"))
    peak_time: float = field(metadata=unit("s"))

    @property
    def duration(self) -> float:
        """Separation minus onset [s]."""
        return self.separation - self.onset


@dataclass(frozen=True, eq=False, repr=False)
class Contacts(Rows[Contact]):
    """Contacts in the order of their onsets: a sequence of `Contact`, and an array of each field.

    Attributes
    ----------
    joint : ndarray of str
        Name of the clearance joint.
    onset : Array
        When journal and bearing touched [s].
    separation : Array
        When they separated [s]; NaN if the run, or the skipped time, ended in contact.
    impact_velocity : Array
        Penetration rate at the onset [m/s]; NaN if the run began in contact.
    peak_force : Array
        Largest normal force [N]; if the contact lasts from the skipped into the sampled time, that in each.
    peak_time : Array
        Time of that force [s].
    """

    row: ClassVar = Contact

    joint: NDArray[np.str_]
    onset: Array = field(metadata=unit("s"))
    separation: Array = field(metadata=unit("s"))
    impact_velocity: Array = field(metadata=unit("m/s"))
    peak_force: Array = field(metadata=unit("N"))
    peak_time: Array = field(metadata=unit("s"))

    @property
    def duration(self) -> Array:
        """Separation minus onset [s]."""
        return self.separation - self.onset
