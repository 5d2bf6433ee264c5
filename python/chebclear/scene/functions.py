"""Functions of time, for drives, forces and torques."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

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

    coefficients: Numbers


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

    amplitude: float
    angular_frequency: float
    phase: float = 0.0
    mean: float = 0.0


@dataclass(frozen=True)
class Table(Part):
    """The cubic spline through points, twice continuously differentiable.

    Its ends are those of SciPy's ``CubicSpline`` (not-a-knot). A run must lie within the table; steps of the
    integrator end at its points.

    Parameters
    ----------
    times : sequence of float
        Increasing times [s], at least two.
    values : sequence of float
        Values at those times [unit].
    """

    _tag = ("function", "table")

    times: Numbers
    values: Numbers


TimeFunction: TypeAlias = Polynomial | Harmonic | Table
