"""Prescribed motions, coupled coordinates, and functions of time and of the motion for forces and torques."""

from .scene.scene import Coupling, Expression, Harmonic, Motion, Polynomial, Speed, Table

__all__ = [
    "Coupling",
    "Expression",
    "Harmonic",
    "Motion",
    "Polynomial",
    "Speed",
    "Table",
]
