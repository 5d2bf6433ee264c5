"""Prescribed motions, coupled coordinates, and functions of time and of the motion for forces and torques."""

from .scene.functions import (
    Expression as Expression,
    Harmonic as Harmonic,
    Polynomial as Polynomial,
    Table as Table,
)
from .scene.motions import Coupling as Coupling, Motion as Motion, Speed as Speed

__all__ = sorted(name for name in vars() if not name.startswith("_"))
