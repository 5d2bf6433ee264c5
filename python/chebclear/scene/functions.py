"""Functions of time and of the motion, for drives, forces and torques."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import Field, dataclass, field
from typing import Any, TypeAlias

from ..base.units import unit
from .columns import column_unit
from .schema import Constants, Numbers, Part


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
    """Values at points, of the time or of a quantity of the motion.

    Over the time it is the cubic spline, twice continuously differentiable, with not-a-knot ends as in
    SciPy's ``CubicSpline``. Over anything else it is linear, unless `interpolation` says otherwise. It is
    never extrapolated. Steps of the integrator end at its points; over a quantity of the motion only at
    those where the curve is not smooth within the `rtol` of the run.

    Parameters
    ----------
    points : sequence of float
        Increasing times [s], or values of `over`; two at least.
    values : sequence of float
        Values at those points [unit].
    over : str
        What it is a table of: ``"time"``, the name of an output such as ``"ram.y"`` or ``"crank.angle"``, or
        a formula as of `Expression`.
    interpolation : {"linear", "monotone", "cubic"}, optional
        Straight lines; cubic pieces without overshoot, as SciPy's ``PchipInterpolator``; the cubic spline.
    periodic : bool
        Whether it repeats itself, as over the angle of a crank; it then ends with its first value.
    beyond : {"end", "hold"}
        Beyond its ends a run ends (a run over a longer time is refused), or the value at the end holds on.
    """

    _tag = ("function", "table")

    points: Numbers = field(metadata=unit("s"))
    values: Numbers = field(metadata=unit("unit"))
    over: str = "time"
    interpolation: str | None = None
    periodic: bool = False
    beyond: str = "end"

    @classmethod
    def _unit_of(cls, item: Field[Any], values: Mapping[str, Any]) -> str:
        return (
            unit_of_points(str(values["over"])) if item.name == "points" else super()._unit_of(item, values)
        )


def unit_of_points(over: str) -> str:
    """Unit of the points of a table over a quantity; ``"unit"`` where it is not known.

    >>> unit_of_points("time"), unit_of_points("crank.angle"), unit_of_points("2*ram.y")
    ('s', 'rad', 'unit')
    """
    name = over.strip()
    is_name = all(part.isidentifier() for part in name.split("."))
    return "s" if name == "time" else (is_name and column_unit(name)) or "unit"


@dataclass(frozen=True)
class Expression(Part):
    """A formula of the time and the motion, for a force or torque.

    Its names are those of outputs - positions, angles, velocities, lengths of springs: ``"ram.y"``,
    ``"crank.angular_velocity"``, ``"spring.length"`` - and ``"time"``; accelerations and forces are not among
    them, since they follow from it. It may hold ``+ - * / **``, parentheses, ``abs``, ``acos``, ``asin``,
    ``atan``, ``atan2``, ``cos``, ``exp``, ``hypot``, ``log``, ``max``, ``min``, ``sign``, ``sin``, ``sqrt``,
    ``tan``, ``tanh``, ``pi`` and ``if(a < b, x, y)``. Steps of the integrator end where ``if``, ``sign``,
    ``abs``, ``min`` and ``max`` change their form. In the place of a force a plain text does as well.

    Parameters
    ----------
    text : str
        The formula, in SI units and radians.
    constants : mapping of str to float
        Numbers in it by their names [unit]; a study may vary them.

    Examples
    --------
    >>> import chebclear as cc
    >>> cc.Force("cutting", "ram.tip", x=0.0, y="if(ram.vy < 0, 800, 0)").y.text
    'if(ram.vy < 0, 800, 0)'
    """

    _tag = ("function", "expression")

    text: str
    constants: Mapping[str, float] = field(default_factory=lambda: Constants({}), metadata=unit("unit"))


def names_of_motion(text: str, quantities: Collection[str] = ()) -> list[str] | None:
    """The names in an `Expression` of the time or the motion, or of the `quantities` of a law; None for a
    text that is none, as ``"2 * weight"``.
    """
    from .. import _core  # here only: writing down a scene needs no core

    names = _core.expression_names(text)
    if quantities:
        return names or []
    return names if names and any(name == "time" or "." in name for name in names) else None


Load: TypeAlias = Polynomial | Harmonic | Table | Expression | str
