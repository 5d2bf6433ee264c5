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
    time, joint, kind, normal_velocity : ndarray
        Fields of `Event`, each of shape (events,).
    """

    row: ClassVar = Event

    time: Array
    joint: NDArray[np.str_]
    kind: NDArray[np.str_]
    normal_velocity: Array


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
    joint, onset, separation, impact_velocity, peak_force, peak_time : ndarray
        Fields of `Contact`, each of shape (contacts,).
    """

    row: ClassVar = Contact

    joint: NDArray[np.str_]
    onset: Array
    separation: Array
    impact_velocity: Array
    peak_force: Array
    peak_time: Array

    @property
    def duration(self) -> Array:
        """Separation minus onset [s]."""
        return self.separation - self.onset
