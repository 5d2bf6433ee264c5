"""Forces on the bodies: gravity, springs, dampers, applied forces and torques."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from ..base.units import unit
from .functions import Expression, Harmonic, Load, Polynomial, Table
from .schema import Part, Vector

LOADS = (Polynomial, Harmonic, Table, Expression)


class Loaded(Part):
    """A part in which a text in the place of a load is an `Expression`."""

    def __post_init__(self) -> None:
        super().__post_init__()
        values = vars(self)
        for name in self._choices:
            if isinstance(values[name], str):
                values[name] = Expression(values[name])


@dataclass(frozen=True)
class Element(Part):
    """A part with a name.

    Parameters
    ----------
    name : str
        Name, unique in the scene.
    """

    name: str


@dataclass(frozen=True)
class Connection(Element):
    """A part between two points.

    Parameters
    ----------
    a, b : str
        The two points, as ``"body.point"``.
    """

    a: str
    b: str


@dataclass(frozen=True)
class Gravity(Part):
    """Uniform gravity.

    Parameters
    ----------
    acceleration : (float, float)
        Acceleration of free fall [m/s²].
    """

    _tag = ("type", "gravity")

    acceleration: Vector = field(metadata=unit("m/s²"))


@dataclass(frozen=True)
class Spring(Connection, Loaded):
    """A spring and a damper in parallel between two points.

    Its tension is stiffness (distance - length) + damping (rate of the distance) + `tension`.

    Parameters
    ----------
    stiffness : float
        Stiffness [N/m].
    length : float
        Distance of the points when unloaded [m].
    damping : float
        Damping [N s/m].
    tension : float, str, Polynomial, Harmonic, Table or Expression
        Further tension [N]: a preload, or a characteristic such as ``"2e6*strut.lengthening**3"``; a text is
        an `Expression`. Its work counts as input.
    """

    _tag = ("type", "spring")
    _choices: ClassVar = {"tension": LOADS}

    stiffness: float = field(metadata=unit("N/m"))
    length: float = field(metadata=unit("m"))
    damping: float = field(default=0.0, metadata=unit("N s/m"))
    tension: float | Load = field(default=0.0, metadata=unit("N"))


@dataclass(frozen=True)
class Damper(Connection, Loaded):
    """A damper between two points, along the line through them.

    Parameters
    ----------
    damping : float
        Damping [N s/m].
    tension : float, str, Polynomial, Harmonic, Table or Expression
        Further tension [N], as of `Spring`.
    """

    _tag = ("type", "damper")
    _choices: ClassVar = {"tension": LOADS}

    damping: float = field(metadata=unit("N s/m"))
    tension: float | Load = field(default=0.0, metadata=unit("N"))


@dataclass(frozen=True)
class Bushing(Connection, Loaded):
    """A radial spring and damper between two points that may coincide, with a torsion spring and damper.

    A rubber bearing: the force on body b is -stiffness (vector from a to b) - damping (velocity of b against
    body a); both forces act at b. Outputs are its ``deflection``, ``force_x`` and ``force_y``, and with a
    torsion spring or damper ``angle`` and ``torque``.

    Each number may be a formula of the motion, such as ``"2e5 + 3e9*mount.deflection**2"``: force over
    deflection, not its slope. Work of a stiffness that is a formula counts as input, of a damping as loss.

    Parameters
    ----------
    stiffness : float, str or Expression
        Stiffness in all directions [N/m].
    damping : float, str or Expression
        Damping in all directions [N s/m].
    torsional_stiffness : float, str or Expression
        Torsional stiffness [N m/rad], unloaded where the two bodies have the same angle.
    torsional_damping : float, str or Expression
        Torsional damping [N m s/rad].
    """

    _tag = ("type", "bushing")
    _choices: ClassVar = dict.fromkeys(
        ("stiffness", "damping", "torsional_stiffness", "torsional_damping"), (Expression,)
    )

    stiffness: float | Expression | str = field(metadata=unit("N/m"))
    damping: float | Expression | str = field(default=0.0, metadata=unit("N s/m"))
    torsional_stiffness: float | Expression | str = field(default=0.0, metadata=unit("N m/rad"))
    torsional_damping: float | Expression | str = field(default=0.0, metadata=unit("N m s/rad"))


@dataclass(frozen=True)
class TorsionSpring(Element):
    """A torsion spring and a damper in parallel between two bodies.

    The torque on body b is -stiffness (angle of b relative to a - `angle`) - damping (its rate).

    Parameters
    ----------
    a, b : str
        Names of the two bodies; ``"ground"`` may be one.
    stiffness : float
        Stiffness [N m/rad].
    angle : float
        Angle of body b relative to body a when unloaded [rad]; full turns count.
    damping : float
        Damping [N m s/rad].
    """

    _tag = ("type", "torsion_spring")

    a: str
    b: str
    stiffness: float = field(metadata=unit("N m/rad"))
    angle: float = field(default=0.0, metadata=unit("rad"))
    damping: float = field(default=0.0, metadata=unit("N m s/rad"))


@dataclass(frozen=True)
class TorsionDamper(Element):
    """A torsion damper between two bodies.

    Parameters
    ----------
    a, b : str
        Names of the two bodies; ``"ground"`` may be one.
    damping : float
        Damping [N m s/rad].
    """

    _tag = ("type", "torsion_damper")

    a: str
    b: str
    damping: float = field(metadata=unit("N m s/rad"))


@dataclass(frozen=True)
class Force(Element, Loaded):
    """A force at a point, a function of time or of the motion.

    Parameters
    ----------
    point : str
        Point at which it acts, as ``"body.point"``.
    x, y : float, str, Polynomial, Harmonic, Table or Expression
        Its components [N]; a text is an `Expression`.
    frame : {"ground", "body"}
        Whether the components are along the axes of ground or turn with the body.
    """

    _tag = ("type", "force")
    _choices: ClassVar = {"x": LOADS, "y": LOADS}

    point: str
    x: float | Load = field(metadata=unit("N"))
    y: float | Load = field(metadata=unit("N"))
    frame: str = "ground"


@dataclass(frozen=True)
class Torque(Element, Loaded):
    """A torque on a body, a function of time or of the motion.

    Parameters
    ----------
    body : str
        The body on which it acts.
    torque : float, str, Polynomial, Harmonic, Table or Expression
        The torque [N m]; a text is an `Expression`.
    reaction : str
        The body on which its reaction acts, such as the frame of a motor.
    """

    _tag = ("type", "torque")
    _choices: ClassVar = {"torque": LOADS}

    body: str
    torque: float | Load = field(metadata=unit("N m"))
    reaction: str = "ground"
