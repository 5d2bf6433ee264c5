"""Prescribed motions, and functions of time for forces and torques."""

from .scene.scene import Harmonic, Motion, Polynomial, Speed, Table

__all__ = [
    "Harmonic",
    "Motion",
    "Polynomial",
    "Speed",
    "Table",
]
