"""What an output or a feature must keep to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ...base.arguments import Checks, as_number
from ...base.units import UnitError, convert, is_quantity, size_of, unit, units_in

ALL = "all"
"""Name of the share that keeps to all specifications."""


@dataclass(frozen=True)
class Specification:
    """Limits of an output or a feature; see `require`.

    Attributes
    ----------
    quantity : str
        Name of the output or feature.
    above : float | str | None
        Lower limit, in the unit of the quantity or with its unit; None for none.
    below : float | str | None
        Upper limit.
    at : float | str | None
        When it must be kept: an instant [s], a crank angle with its unit, or None for the whole time.
    joint : str | None
        Joint of the crank; None for that of the only drive at constant speed.
    """

    quantity: str
    above: float | str | None = None
    below: float | str | None = None
    at: float | str | None = field(default=None, metadata=unit("s"))
    joint: str | None = None

    @property
    def angle(self) -> float | None:
        """Crank angle at which it must be kept [rad]; None for an instant or the whole time."""
        return convert(self.at, "rad") if isinstance(self.at, str) else None

    @property
    def written(self) -> tuple[str, ...]:
        """The units of its limits, as the user wrote them."""
        return tuple(dict.fromkeys(units_in([self.above, self.below])))

    def limits(self, checks: Checks, place: str, of: str) -> tuple[float, float]:
        """Its limits in the SI unit `of` the quantity; infinite for none."""
        lower, upper = (
            _limit(checks, f"{place}.{name}", given, of, default)
            for name, given, default in (
                ("above", self.above, -float("inf")),
                ("below", self.below, float("inf")),
            )
        )
        if lower >= upper:
            checks.add(place, f"above must be less than below, got {self.above!r} and {self.below!r}")
        return lower, upper

    def __str__(self) -> str:
        ends = [
            f"{word} {end}" for word, end in (("above", self.above), ("below", self.below)) if end is not None
        ]
        when = f" at {self.at:g} s" if isinstance(self.at, float) else f" at {self.at}"
        return f"{self.quantity} {' and '.join(ends)}{'' if self.at is None else when}"


def require(
    quantity: str,
    *,
    above: float | str | None = None,
    below: float | str | None = None,
    at: float | str | None = None,
    joint: str | None = None,
) -> Specification:
    """Limits that an output or a feature must keep to, for `conformance`.

    Parameters
    ----------
    quantity : str
        Name of an output, which must keep to the limits during the whole sampled time of the continuous
        motion, or of a feature of the study, in all cycles.
    above, below : float or str, optional
        Limits in the SI unit of the quantity, or with a unit, such as ``"120 mm"``; at least one.
    at : float or str, optional
        When alone an output must keep to them: at an instant [s], one of the samples, or wherever the crank
        passes an angle in the sampled time, such as ``"90 deg"``. A mechanism that never does is outside.
    joint : str, optional
        Revolute joint whose angle is meant; that of the only drive at constant speed if not given.

    Returns
    -------
    Specification

    Raises
    ------
    ValueError, TypeError
        If there is no limit, or an argument is wrong.

    Examples
    --------
    >>> import chebclear as cc
    >>> print(cc.require("ram.y", above="-5 mm", below=0.12))
    ram.y above -5 mm and below 0.12
    """
    checks = Checks()
    if not isinstance(quantity, str) or not quantity:
        checks.add(
            "quantity", f"must be the name of an output or a feature, got {quantity!r}", wrong_type=True
        )
    if above is None and below is None:
        checks.add("above", "or below must be given, or both")
    for name, given in (("above", above), ("below", below)):
        if given is not None and not (isinstance(given, str) and is_quantity(given)):
            checks.real(name, given, "SI unit")
    when: float | str | None = at
    if isinstance(at, str):
        try:
            convert(at, "rad")
        except UnitError:
            when = _limit(checks, "at", at, "s", 0.0)
    if when is not None and not isinstance(when, str):
        when = checks.real("at", when, "s", least=0.0)
    if joint is not None and not isinstance(when, str):
        checks.add("joint", f'is that of the crank: give an angle too, at="90 deg", got {joint!r}')
    checks.finish()
    return Specification(quantity, above, below, when, joint)


def checked_specifications(
    checks: Checks, given: object, place: str = "specifications"
) -> dict[str, Specification]:
    """Specifications by name; a single one, or several without names, are named by their words."""
    if isinstance(given, Specification):
        given = [given]
    if isinstance(given, (list, tuple)):
        given = {str(one): one for one in given}
    if not isinstance(given, Mapping) or not given:
        checks.add(
            place,
            f"must be one that require made, or several in a list or by names, got {given!r}",
            wrong_type=not isinstance(given, Mapping),
        )
        return {}
    checks.names(place, given)
    for name, one in given.items():
        if not isinstance(one, Specification):
            checks.add(f'{place}["{name}"]', f"must be made by require, got {one!r}", wrong_type=True)
    if ALL in given:
        checks.add(f'{place}["{ALL}"]', "has the name of all of them together")
    return {name: one for name, one in given.items() if isinstance(one, Specification)}


def _limit(checks: Checks, place: str, given: float | str | None, of: str, default: float) -> float:
    if given is None:
        return default
    number = as_number(given)
    if number is not None:
        return number
    try:
        return convert(str(given), of or "unit") / size_of(of)  # as a model of one's own may be in mm
    except UnitError as error:
        checks.add(place, str(error))
        return default
