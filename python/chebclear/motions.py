"""Prescribed motions, and functions of time and of the motion for forces and torques."""

from .scene.scene import Expression, Harmonic, Motion, Polynomial, Speed, Table

__all__ = [
    "Expression",
    "Harmonic",
    "Motion",
    "Polynomial",
    "Speed",
    "Table",
]
