"""Functions of time, for drives, forces and torques."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

from ..base.units import unit
from .schema import Numbers, Part


@dataclass(frozen=True)
class Polynomial(Part):
    """c₀ + c₁ t + c₂ t² + ...

    Parameters
    ----------
    coefficients : sequence of float
        c₀, c₁, ... [unit / s^k].
    """

    _tag = ("function", "polynomial")

    coefficients: Numbers = field(metadata=unit("unit / s^k"))


@dataclass(frozen=True)
class Harmonic(Part):
    """mean + amplitude sin(angular_frequency t + phase).

    Parameters
    ----------
    amplitude : float
        Amplitude [unit].
    angular_frequency : float
        Angular frequency [rad/s].
    phase : float
        Phase at time zero [rad].
    mean : float
        Mean value [unit].
    """

    _tag = ("function", "harmonic")

    amplitude: float = field(metadata=unit("unit"))
    angular_frequency: float = field(metadata=unit("rad/s"))
    phase: float = field(default=0.0, metadata=unit("rad"))
    mean: float = field(default=0.0, metadata=unit("unit"))


@dataclass(frozen=True)
class Table(Part):
    """The cubic spline through points, twice continuously differentiable.

    The end conditions are not-a-knot, as in SciPy's ``CubicSpline``. A run must lie within the table; steps
    of the integrator end at its points.

    Parameters
    ----------
    times : sequence of float
        Increasing times [s], at least two.
    values : sequence of float
        Values at those times [unit].
    """

    _tag = ("function", "table")

    times: Numbers = field(metadata=unit("s"))
    values: Numbers = field(metadata=unit("unit"))


TimeFunction: TypeAlias = Polynomial | Harmonic | Table
