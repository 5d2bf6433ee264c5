"""Features: scalar results of a run, taken from its continuous motion rather than from its samples."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from ..base.arguments import Checks
from ..base.files import ArrayRecord
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
class Window:
    """The times of which a feature is taken: those at which a quantity is between two values.

    Attributes
    ----------
    of : str
        Name of an output, or ``"time"``. An angle, such as ``"crank.angle"``, is taken in every turn.
    lower, upper : float or None
        The values in the SI unit of the quantity; None where there is no end.
    """

    of: str
    lower: float | None
    upper: float | None

    def __str__(self) -> str:
        unit_of = "s" if self.of == "time" else column_unit(self.of)
        scale, name = (math.degrees(1.0), "deg") if unit_of == "rad" else (1.0, unit_of)
        ends = [
            "" if end is None else f"{scale * end:.6g} {name}".strip() for end in (self.lower, self.upper)
        ]
        return f"{self.of} = {ends[0]} .. {ends[1]}".replace("  ", " ").rstrip()


WindowLike: TypeAlias = Window | tuple[str, float | str | None, float | str | None]
"""A window, or the name of its quantity with both ends, as numbers in SI units or texts with a unit."""


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
    window : Window | None
        Its times; all if None. Over times that there are none of it is NaN.
    """

    kind: str
    of: str
    window: Window | None = None

    def __post_init__(self) -> None:
        checks = Checks()
        wrong = not isinstance(self.kind, str)
        if wrong or self.kind not in KINDS:
            hint = meant_or_known(self.kind, KINDS)
            checks.add("kind", f"is no feature: {self.kind!r}{hint}", wrong_type=wrong)
        what = "a clearance joint" if not wrong and self.kind in JOINT_KINDS else "an output"
        if not isinstance(self.of, str):
            checks.add("of", f"must be the name of {what}, got {self.of!r}", wrong_type=True)
        if self.window is not None and not isinstance(self.window, Window):
            object.__setattr__(self, "window", _checked_window(checks, self.window))
        checks.finish()

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Feature:
        """The feature from its JSON form."""
        window = plain.get("window")
        return cls(plain["kind"], plain["of"], None if window is None else Window(**window))

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
        while_ = "" if self.window is None else f" while {self.window}"
        return f"{self.kind.replace('_', ' ')} of {self.of}{while_}"


def _checked_window(checks: Checks, given: object) -> Window | None:
    """A window from the argument of the user; problems are added to `checks`."""
    if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != 3:
        example = '("crank.angle", "80 deg", "120 deg")'
        checks.add(
            "window",
            f"must be a quantity and its two ends, such as {example}, got {given!r}",
            wrong_type=True,
        )
        return None
    of, *ends = given
    if not isinstance(of, str):
        checks.add("window", f'must begin with the name of an output or "time", got {of!r}', wrong_type=True)
        return None
    own = "s" if of == "time" else column_unit(of)
    lower, upper = (None if end is None else checks.real("window", end, own or "SI unit") for end in ends)
    if lower is None and upper is None:
        checks.add("window", f"must have one end at least, got {given!r}")
    width = math.inf if lower is None or upper is None else upper - lower
    if width <= 0.0:
        checks.add("window", f"must end above its begin, got {given!r}")
    elif of.rpartition(".")[2] == "angle" and width >= 2.0 * math.pi:
        checks.add("window", f"of an angle must have both ends, less than a turn apart, got {given!r}")
    return Window(of, lower, upper)


def _made(kind: str, of: str, window: WindowLike | None) -> Feature:
    return Feature(kind, of, window)  # type: ignore[arg-type] # a tuple becomes a Window


def peak(output: str, window: WindowLike | None = None) -> Feature:
    """Largest value of an output, in its unit.

    Like all features it is taken of the whole sampled time, or of the times at which a quantity is between
    two values, its `window`: ``("crank.angle", "80 deg", "120 deg")``, in every turn;
    ``("time", 0.02, None)``; ``("slider.vx", None, 0.0)``.

    >>> peak("wrist.normal_force").unit
    'N'
    >>> print(peak("wrist.normal_force", ("crank.angle", "80 deg", "120 deg")))
    peak of wrist.normal_force while crank.angle = 80 deg .. 120 deg
    """
    return _made("peak", output, window)


def lowest(output: str, window: WindowLike | None = None) -> Feature:
    """Smallest value of an output, in its unit.

    >>> lowest("slider.ax").unit
    'm/s²'
    """
    return _made("lowest", output, window)


def peak_to_peak(output: str, window: WindowLike | None = None) -> Feature:
    """Largest minus smallest value of an output, in its unit.

    >>> peak_to_peak("slider.ax").unit
    'm/s²'
    """
    return _made("peak_to_peak", output, window)


def time_of_peak(output: str, window: WindowLike | None = None) -> Feature:
    """When an output is largest [s].

    >>> time_of_peak("slider.vx").unit
    's'
    """
    return _made("time_of_peak", output, window)


def time_of_lowest(output: str, window: WindowLike | None = None) -> Feature:
    """When an output is smallest [s].

    >>> time_of_lowest("slider.vx").unit
    's'
    """
    return _made("time_of_lowest", output, window)


def mean(output: str, window: WindowLike | None = None) -> Feature:
    """Mean of an output over time, in its unit.

    >>> mean("wrist.normal_force").unit
    'N'
    """
    return _made("mean", output, window)


def rms(output: str, window: WindowLike | None = None) -> Feature:
    """Root mean square of an output over time, in its unit.

    >>> rms("slider.ax").unit
    'm/s²'
    """
    return _made("rms", output, window)


def impacts(joint: str, window: WindowLike | None = None) -> Feature:
    """Onsets of contact in a clearance joint [-].

    >>> impacts("wrist").unit
    '-'
    """
    return _made("impacts", joint, window)


def contact_share(joint: str, window: WindowLike | None = None) -> Feature:
    """Part of the time in which a clearance joint is in contact [-].

    >>> contact_share("wrist").unit
    '-'
    """
    return _made("contact_share", joint, window)


def impulse(joint: str, window: WindowLike | None = None) -> Feature:
    """Integral of the normal force of a clearance joint over time [N s].

    >>> impulse("wrist").unit
    'N s'
    """
    return _made("impulse", joint, window)


def wear(joint: str, window: WindowLike | None = None) -> Feature:
    """Integral of normal force times sliding speed of a clearance joint over time [N m].

    Archard's law multiplies it by its coefficient.

    >>> wear("wrist").unit
    'N m'
    """
    return _made("wear", joint, window)


def loss(joint: str, window: WindowLike | None = None) -> Feature:
    """Energy that impacts and friction dissipate in a clearance joint [J].

    >>> loss("wrist").unit
    'J'
    """
    return _made("loss", joint, window)


def settling_time(scene: Scene) -> float:
    """Assumed length of the starting transient of a mechanism with clearance [s]: the slowest revolution.

    A little less than that, so that rounding puts nothing of the second revolution before it. Minus
    infinity without clearance or a drive at constant speed.
    """
    if not has_contacts(scene.joints) and all(one.backlash is None for one in scene.couplings):
        return -math.inf
    return (1.0 - 1e-9) * revolution_time(scene) or -math.inf


@dataclass(frozen=True, eq=False)
class Extremum(ArrayRecord):
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
