"""Features: scalar results of a run, taken from its continuous motion rather than from its samples."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from ..base.arguments import Checks
from ..base.shown import meant_or_known
from ..base.units import unit
from ..scene.columns import POSITIVE, SHARE, Limits, column_unit
from ..scene.parts import has_contacts
from ..scene.scene import Scene, revolution_time

JOINT_KINDS = ("impacts", "contact_share", "impulse", "wear", "loss")
"""Features of a clearance joint; all others are of an output."""
KINDS = ("peak", "lowest", "peak_to_peak", "time_of_peak", "time_of_lowest", "mean", "rms", *JOINT_KINDS)
"""The words for all features."""
EXTREMA = ("peak", "time_of_peak", "lowest", "time_of_lowest")
"""Kinds of features that an `Extremum` needs."""

# Units and limits of the features that are not in the unit of an output.
_OWN = {
    "time_of_peak": ("s", POSITIVE),
    "time_of_lowest": ("s", POSITIVE),
    "impacts": ("-", POSITIVE),
    "contact_share": ("-", SHARE),
    "impulse": ("N s", POSITIVE),
    "wear": ("N m", POSITIVE),
    "loss": ("J", POSITIVE),
}


@dataclass(frozen=True)
class Feature:
    """A scalar result of a run, as `peak`, `mean`, `impacts` and similar functions define it.

    Attributes
    ----------
    kind : str
        ``"peak"``, ``"lowest"``, ``"peak_to_peak"``, ``"time_of_peak"``, ``"time_of_lowest"``, ``"mean"``
        or ``"rms"`` of an output; ``"impacts"``, ``"contact_share"``, ``"impulse"``, ``"wear"`` or
        ``"loss"`` of a clearance joint.
    of : str
        Name of the output or of the clearance joint.
    """

    kind: str
    of: str

    def __post_init__(self) -> None:
        checks = Checks()
        wrong = not isinstance(self.kind, str)
        if wrong or self.kind not in KINDS:
            hint = meant_or_known(self.kind, KINDS)
            checks.add("kind", f"is no feature: {self.kind!r}{hint}", wrong_type=wrong)
        what = "a clearance joint" if not wrong and self.kind in JOINT_KINDS else "an output"
        if not isinstance(self.of, str):
            checks.add("of", f"must be the name of {what}, got {self.of!r}", wrong_type=True)
        checks.finish()

    @property
    def unit(self) -> str:
        """SI unit of the number; empty for an output whose unit is not known."""
        return self.unit_with(column_unit(self.of))

    def unit_with(self, output_unit: str) -> str:
        """Unit of the number, given that of the output."""
        return _OWN[self.kind][0] if self.kind in _OWN else output_unit

    def limits_with(self, output: Limits) -> Limits:
        """Limits of the number, given those of the output, in their units."""
        if self.kind in _OWN:
            return _OWN[self.kind][1]
        lower, upper = output
        if self.kind == "peak_to_peak":
            return 0.0, upper - lower
        return (0.0, max(-lower, upper)) if self.kind == "rms" else output

    def __str__(self) -> str:
        return f"{self.kind.replace('_', ' ')} of {self.of}"


def peak(output: str) -> Feature:
    """Largest value of an output, in its unit.

    >>> peak("wrist.normal_force").unit
    'N'
    """
    return Feature("peak", output)


def lowest(output: str) -> Feature:
    """Smallest value of an output, in its unit.

    >>> lowest("slider.ax").unit
    'm/s²'
    """
    return Feature("lowest", output)


def peak_to_peak(output: str) -> Feature:
    """Largest minus smallest value of an output, in its unit.

    >>> peak_to_peak("slider.ax").unit
    'm/s²'
    """
    return Feature("peak_to_peak", output)


def time_of_peak(output: str) -> Feature:
    """When an output is largest [s].

    >>> time_of_peak("slider.vx").unit
    's'
    """
    return Feature("time_of_peak", output)


def time_of_lowest(output: str) -> Feature:
    """When an output is smallest [s].

    >>> time_of_lowest("slider.vx").unit
    's'
    """
    return Feature("time_of_lowest", output)


def mean(output: str) -> Feature:
    """Mean of an output over time, in its unit.

    >>> mean("wrist.normal_force").unit
    'N'
    """
    return Feature("mean", output)


def rms(output: str) -> Feature:
    """Root mean square of an output over time, in its unit.

    >>> rms("slider.ax").unit
    'm/s²'
    """
    return Feature("rms", output)


def impacts(joint: str) -> Feature:
    """Onsets of contact in a clearance joint [-].

    >>> impacts("wrist").unit
    '-'
    """
    return Feature("impacts", joint)


def contact_share(joint: str) -> Feature:
    """Part of the time in which a clearance joint is in contact [-].

    >>> contact_share("wrist").unit
    '-'
    """
    return Feature("contact_share", joint)


def impulse(joint: str) -> Feature:
    """Integral of the normal force of a clearance joint over time [N s].

    >>> impulse("wrist").unit
    'N s'
    """
    return Feature("impulse", joint)


def wear(joint: str) -> Feature:
    """Integral of normal force times sliding speed of a clearance joint over time [N m].

    Archard's law multiplies it by its coefficient.

    >>> wear("wrist").unit
    'N m'
    """
    return Feature("wear", joint)


def loss(joint: str) -> Feature:
    """Energy that impacts and friction dissipate in a clearance joint [J].

    >>> loss("wrist").unit
    'J'
    """
    return Feature("loss", joint)


def settling_time(scene: Scene) -> float:
    """Assumed length of the starting transient of a mechanism with clearance [s]: the slowest revolution.

    A little less than that, so that rounding puts nothing of the second revolution before it. Minus
    infinity without clearance or a drive at constant speed.
    """
    if not has_contacts(scene.joints) and all(one.backlash is None for one in scene.couplings):
        return -math.inf
    return (1.0 - 1e-9) * revolution_time(scene) or -math.inf


@dataclass(frozen=True)
class Extremum:
    """The largest or smallest value of an output in the continuous motion.

    Attributes
    ----------
    value : float
        The value in the unit of the output.
    time : float
        Time [s].
    in_transient : bool
        Whether it lies in the first revolution after the start, the transient of a mechanism with clearance
        after its assembled position. False if no drive turns at constant speed.
    """

    value: float
    time: float = field(metadata=unit("s"))
    in_transient: bool

    def __str__(self) -> str:
        place = f"{self.value:.6g} at t = {self.time:.6g} s"
        return f"{place}, in the starting transient" if self.in_transient else place


def checked_features(checks: Checks, given: object) -> tuple[Feature, ...]:
    """Features from the argument of the user; problems are added to `checks`."""
    if given is None:
        return ()
    if isinstance(given, str) or not isinstance(given, Sequence):
        checks.add("features", f'must be a list such as [peak("slider.ax")], got {given!r}', wrong_type=True)
        return ()
    for index, feature in enumerate(given):
        if not isinstance(feature, Feature):
            checks.add(
                f"features[{index}]",
                f'must be a feature such as peak("slider.ax"), got {feature!r}',
                wrong_type=True,
            )
    return tuple(feature for feature in given if isinstance(feature, Feature))
