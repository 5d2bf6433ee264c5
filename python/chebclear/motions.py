"""Prescribed motions, coupled coordinates, and functions of time and of the motion for forces and torques."""

from .scene.scene import (
    Coupling as Coupling,
    Expression as Expression,
    Harmonic as Harmonic,
    Motion as Motion,
    Polynomial as Polynomial,
    Speed as Speed,
    Table as Table,
)

__all__ = sorted(name for name in vars() if not name.startswith("_"))
