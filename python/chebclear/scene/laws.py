"""Contact and friction laws of clearance joints, and the friction of ideal ones."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, TypeAlias, get_args

from ..base.units import unit
from .forces import Loaded
from .functions import Expression
from .schema import Part


@dataclass(frozen=True)
class Elastic(Part):
    """A normal force in proportion to a power of the penetration δ.

    Parameters
    ----------
    stiffness : float
        Contact stiffness K [N/m^exponent].
    """

    stiffness: float = field(metadata=unit("N/m^exponent"))


@dataclass(frozen=True)
class LankaraniNikravesh(Elastic):
    """Hertz contact with hysteresis damping, F = K δⁿ (1 + χ δ̇), never tensile.

    χ = 3 (1 - restitution²) / (4 v₀) with the impact velocity v₀ at the onset of the contact, for which χ is
    fixed (latched). Derived for small losses: the rebound ratio is 0.913 for a restitution of 0.9, 0.725 for
    0.5 and still 0.66 toward 0, so the law is intended for values above 0.85. Otherwise as `Hertz`. Source:
    Lankarani and Nikravesh (1990), Eq. (10) of the paper.

    Parameters
    ----------
    restitution : float
        Nominal coefficient of restitution [-], above 0 and at most 1.
    exponent : float
        Exponent n of the penetration [-].
    """

    _tag = ("law", "lankarani_nikravesh")

    restitution: float = field(metadata=unit("-"))
    exponent: float = field(default=1.5, metadata=unit("-"))


@dataclass(frozen=True)
class Hertz(Elastic):
    """Elastic contact, F = K δⁿ.

    Valid for dry contacts that are small compared with the radii, and for impacts that are slow compared with
    elastic waves and below yield. For two cylinders with nearly equal radii it is an approximation, with the
    exponent n = 1.5 of spheres. Source: Hertz (1882).

    Parameters
    ----------
    exponent : float
        Exponent n of the penetration [-].
    """

    _tag = ("law", "hertz")

    exponent: float = field(default=1.5, metadata=unit("-"))


@dataclass(frozen=True)
class Flores(Elastic):
    """Dry contact with hysteresis damping, F = K δⁿ (1 + χ δ̇), never tensile.

    χ = 8 (1 - c) / (5 c v₀) with the impact velocity v₀ at the onset of the contact. Intended for the whole
    range of restitution; the rebound ratio is 0.894 for c = 0.9, 0.470 for 0.5 and 0.069 for 0.1. Otherwise
    as `Hertz`. Source: Flores et al. (2011).

    Parameters
    ----------
    restitution : float
        Coefficient of restitution c [-], above 0 and at most 1.
    exponent : float
        Exponent n of the penetration [-].
    """

    _tag = ("law", "flores")

    restitution: float = field(metadata=unit("-"))
    exponent: float = field(default=1.5, metadata=unit("-"))


@dataclass(frozen=True)
class ExactRestitution(Elastic):
    """Dry contact whose rebound is the restitution asked for, F = K δⁿ (1 + χ δ̇), never tensile.

    χ = d / v₀ with the impact velocity v₀ at the onset of the contact and the d for which a free impact
    rebounds with c v₀: (1 + d) / (1 - c d) = exp(d (1 + c)), for any exponent. Recommended where a
    restitution is known and no publication is to be reproduced. Otherwise as `Hertz`. Source: the rebound of
    F = K δⁿ (1 + χ δ̇) solved for χ, which the laws of Lankarani and Nikravesh and of Flores approximate.

    Parameters
    ----------
    restitution : float
        Coefficient of restitution c [-], above 0 and at most 1.
    exponent : float
        Exponent n of the penetration [-].
    """

    _tag = ("law", "exact_restitution")

    restitution: float = field(metadata=unit("-"))
    exponent: float = field(default=1.5, metadata=unit("-"))


@dataclass(frozen=True)
class HuntCrossley(Elastic):
    """Dry contact with a fixed hysteresis factor, F = K δⁿ (1 + χ δ̇), never tensile.

    The rebound ratio falls with the impact velocity v₀, at first as 1 - 2 χ v₀ / 3; the factor is a
    property of the materials. Otherwise as `Hertz`. Source: Hunt and Crossley (1975).

    Parameters
    ----------
    hysteresis_factor : float
        Hysteresis factor χ [s/m], at least 0.
    exponent : float
        Exponent n of the penetration [-].
    """

    _tag = ("law", "hunt_crossley")

    hysteresis_factor: float = field(metadata=unit("s/m"))
    exponent: float = field(default=1.5, metadata=unit("-"))


@dataclass(frozen=True)
class KelvinVoigt(Elastic):
    """A spring and a viscous damper, F = K δⁿ + D δ̇, never tensile.

    The force jumps by D v₀ where the contact begins, and the rebound ratio of a mass does not depend on v₀
    for n = 1. For models from other programs, and for soft layers.

    Parameters
    ----------
    damping : float
        Damping D [N s/m], at least 0.
    exponent : float
        Exponent n of the penetration [-].
    """

    _tag = ("law", "kelvin_voigt")

    damping: float = field(metadata=unit("N s/m"))
    exponent: float = field(default=1.0, metadata=unit("-"))


@dataclass(frozen=True)
class Impact(Elastic):
    """The contact function of commercial programs, F = K δⁿ + D s(δ/d) δ̇, never tensile.

    The damping grows from zero to D over the depth d, by s(x) = x² (3 - 2x), and stays there: the force does
    not jump where the contact begins. For models from other programs; the rebound follows from the numbers.

    Parameters
    ----------
    damping : float
        Damping D at full depth [N s/m], at least 0.
    depth : float
        Penetration d at which it is reached [m], above 0.
    exponent : float
        Exponent n of the penetration [-].
    """

    _tag = ("law", "impact")

    damping: float = field(metadata=unit("N s/m"))
    depth: float = field(metadata=unit("m"))
    exponent: float = field(default=1.5, metadata=unit("-"))


@dataclass(frozen=True)
class SmoothedCoulomb(Part):
    """Coulomb friction smoothed by a hyperbolic tangent, μ tanh(v / V).

    For dry contacts that slide faster than V most of the time: below V a loaded contact creeps instead of
    sticking. There is no static friction. Source: a common regularization, e.g. Andersson et al. (2007).

    Parameters
    ----------
    coefficient : float
        Coefficient of friction μ [-].
    velocity : float
        Velocity V of the smoothing [m/s]; at 3 V the force is 99.5 % of Coulomb's.
    """

    _tag = ("law", "smoothed_coulomb")

    coefficient: float = field(metadata=unit("-"))
    velocity: float = field(metadata=unit("m/s"))


@dataclass(frozen=True)
class ModifiedCoulomb(Part):
    """Friction with a smooth rise to the static and a smooth fall to the sliding coefficient.

    The coefficient follows a quarter sine up to `stick_slip_velocity`, half a cosine wave from there to
    `static_sliding_velocity`, and is constant above. For contacts that slide faster than
    `stick_slip_velocity` most of the time: below it a loaded contact creeps instead of sticking. Source: Eq.
    (11) of the paper.

    Parameters
    ----------
    static_coefficient, sliding_coefficient : float
        Coefficients of friction [-].
    stick_slip_velocity : float
        Sliding velocity of the largest friction [m/s].
    static_sliding_velocity : float
        Sliding velocity above which the coefficient is constant [m/s]; above `stick_slip_velocity`.
    """

    _tag = ("law", "modified_coulomb")

    static_coefficient: float = field(metadata=unit("-"))
    sliding_coefficient: float = field(metadata=unit("-"))
    stick_slip_velocity: float = field(metadata=unit("m/s"))
    static_sliding_velocity: float = field(metadata=unit("m/s"))


@dataclass(frozen=True)
class StickSlip(Part):
    """Coulomb friction that sticks: a spring in series with a slider, as in the element of Jenkins.

    The contact sticks while the spring holds less than μ_s F_N, then it slides with
    μ = μ_d + (μ_s - μ_d) exp(-(v/V)²). It does not creep: what sticks moves by the stretch of the spring, of
    the order of the penetration, and comes back. The run locates where sticking begins and ends; events name
    them ``"stick"`` and ``"slip"``. The energy of the spring is part of ``energy.contact``. It needs the
    velocity of the surfaces (``sliding="surface"``). Sources: Iwan (1966); Mindlin (1949) for the stiffness.

    Parameters
    ----------
    static_coefficient, sliding_coefficient : float
        Coefficients of friction μ_s, μ_d [-]; the sliding one at most the static one.
    stribeck_velocity : float
        Sliding velocity V over which friction falls from the static to the sliding coefficient [m/s]; 0 for
        a jump.
    tangential_stiffness : float, optional
        Stiffness of the spring [N/m]. If not given, 0.82 of the normal stiffness dF_N/dδ (Mindlin's ratio for
        a Poisson ratio of 0.3) at the penetration under the load of the start, or in the impact that begins
        the contact if it is deeper.
    damping_ratio : float
        Damping ratio of the tangential oscillation of a contact that sticks, at that penetration [-].
    """

    _tag = ("law", "stick_slip")

    static_coefficient: float = field(metadata=unit("-"))
    sliding_coefficient: float = field(metadata=unit("-"))
    stribeck_velocity: float = field(metadata=unit("m/s"))
    tangential_stiffness: float | None = field(default=None, metadata=unit("N/m"))
    damping_ratio: float = field(default=0.3, metadata=unit("-"))


@dataclass(frozen=True)
class ContactFormula(Loaded):
    """A normal force that is a formula, never tensile.

    Its names are ``penetration``, ``penetration_rate`` and ``impact_velocity``, the rate at the onset of the
    contact, which is kept until the separation; for the language see `Expression`. Without rate it is zero at
    no penetration and positive beyond; damping must not make energy. Both are looked at when a scene is
    checked. Where the force would pull it is zero, as that of all laws.

    Parameters
    ----------
    force : str or Expression
        The force [N]; a text is an `Expression`.

    Examples
    --------
    >>> import chebclear as cc
    >>> law = cc.laws.ContactFormula("1e10*penetration**1.5*(1 + 0.2*penetration_rate)")
    >>> law.force.text
    '1e10*penetration**1.5*(1 + 0.2*penetration_rate)'
    """

    _tag = ("law", "formula")
    _choices: ClassVar = {"force": (Expression,)}

    force: Expression | str = field(
        metadata=unit("N") | {"quantities": ("penetration", "penetration_rate", "impact_velocity")}
    )


@dataclass(frozen=True)
class FrictionFormula(Loaded):
    """A friction coefficient that is a formula.

    Its names are ``sliding_velocity`` and ``normal_force``. It has the sign of the sliding velocity, so that
    friction takes energy, which is looked at when a scene is checked. One that jumps there, as ``sign`` does,
    ends a run where the surfaces come to rest: take ``tanh``, or the law `StickSlip`.

    Parameters
    ----------
    coefficient : str or Expression
        The coefficient [-]; a text is an `Expression`.

    Examples
    --------
    >>> import chebclear as cc
    >>> cc.laws.FrictionFormula("0.1*tanh(sliding_velocity/0.01)").coefficient.text
    '0.1*tanh(sliding_velocity/0.01)'
    """

    _tag = ("law", "formula")
    _choices: ClassVar = {"coefficient": (Expression,)}

    coefficient: Expression | str = field(
        metadata=unit("-") | {"quantities": ("sliding_velocity", "normal_force")}
    )


@dataclass(frozen=True)
class ShortBearing(Part):
    """Oil film between journal and bearing: the closed form for a bearing that is short along its axis.

    Where the film would be under tension it breaks: half of it carries. It damps and carries at any motion
    and never makes energy. Where the surfaces touch, the contact law acts besides, and the film keeps the
    thickness of the roughness. For bearings of up to a quarter of the diameter; at half of it the force is
    1.1 to 2.4 times too large for eccentricity ratios of 0.3 to 0.9, and `FiniteBearing` is better. Source:
    Ocvirk's solution, DuBois and Ocvirk (1953).

    Parameters
    ----------
    viscosity : float
        Dynamic viscosity [Pa s].
    length : float
        Length of the bearing along its axis [m], at most its diameter.
    roughness : float
        Height of the roughness of both surfaces together [m].
    """

    _tag = ("law", "short_bearing")

    viscosity: float = field(metadata=unit("Pa s"))
    length: float = field(metadata=unit("m"))
    roughness: float = field(metadata=unit("m"))


@dataclass(frozen=True)
class FiniteBearing(ShortBearing):
    """Oil film of a bearing of finite length: that of a short bearing times a factor.

    The factor depends on the ratio of length to diameter, from a quarter to one, and on the eccentricity
    ratio. Its force under a steady load is within a tenth of Reynolds' equation. A journal that is squeezed
    against its bearing meets 4 % too little to 20 % too much force, one that leaves it up to two thirds too
    little (at an eccentricity ratio of 0.9). Source: Butenschön (1976).
    """

    _tag = ("law", "finite_bearing")


@dataclass(frozen=True)
class JournalFriction(Part):
    """Dry friction in a pin joint without clearance: a torque in proportion to its reaction.

    It is at most ``μ' r |R|`` under the reaction R. μ' = μ / √(1 + μ²) is the limit of a bearing of vanishing
    clearance, where R is the resultant of normal force and friction. The joint sticks below that torque and
    slides at it; events name where it begins to (``"stick"``, ``"slip"``). It does not creep: what sticks
    moves by less than the tolerance of the run.
    Reaction and friction are solved for together; where they have two solutions or none, a journal larger
    than the arm of its load, the run ends as ``"friction_indeterminate"``. Source: the limit of
    `ClearanceRevolute` with Coulomb friction.

    Parameters
    ----------
    coefficient : float
        Coefficient of friction μ [-], at least 0.
    journal_radius : float
        Radius r of the journal [m].
    """

    _tag = ("law", "journal_friction")

    coefficient: float = field(metadata=unit("-"))
    journal_radius: float = field(metadata=unit("m"))


@dataclass(frozen=True)
class GuideFriction(Part):
    """Dry friction in a guide without clearance: a force in proportion to its reaction.

    It is at most ``μ max(|N|, |P| / a)``. N is the force across the guide, P the moment about point b,
    the middle of a block of length 2a, which only its ends carry; friction acts along the line through
    it. Otherwise as `JournalFriction`: a block that is pushed beyond a / μ beside this line locks, and
    one whose mass lies beyond a / μ jams (``"friction_indeterminate"``). Source: the limit of
    `ClearancePrismatic` with Coulomb friction.

    Parameters
    ----------
    coefficient : float
        Coefficient of friction μ [-], at least 0.
    half_length : float
        Half the length a of the block [m].
    """

    _tag = ("law", "guide_friction")

    coefficient: float = field(metadata=unit("-"))
    half_length: float = field(metadata=unit("m"))


ContactLaw: TypeAlias = (
    LankaraniNikravesh
    | Flores
    | ExactRestitution
    | HuntCrossley
    | KelvinVoigt
    | Impact
    | Hertz
    | ContactFormula
)
CONTACT_LAWS: tuple[type[Part], ...] = get_args(ContactLaw)
FrictionLaw: TypeAlias = ModifiedCoulomb | SmoothedCoulomb | StickSlip | FrictionFormula
FRICTION_LAWS: tuple[type[Part], ...] = get_args(FrictionLaw)
Film: TypeAlias = ShortBearing | FiniteBearing
