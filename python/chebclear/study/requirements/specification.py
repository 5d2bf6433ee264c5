"""What an output or a feature must keep to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ...base.arguments import Checks, as_number
from ...base.units import UnitError, convert, is_quantity, unit

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
    at : float | None
        Instant at which it must be kept [s]; None for the whole time.
    """

    quantity: str
    above: float | str | None = None
    below: float | str | None = None
    at: float | None = field(default=None, metadata=unit("s"))

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
            checks.add_at(place, f"above must be less than below, got {self.above!r} and {self.below!r}")
        return lower, upper

    def __str__(self) -> str:
        ends = [
            f"{word} {end}" for word, end in (("above", self.above), ("below", self.below)) if end is not None
        ]
        when = "" if self.at is None else f" at {self.at:g} s"
        return f"{self.quantity} {' and '.join(ends)}{when}"


def require(
    quantity: str,
    *,
    above: float | str | None = None,
    below: float | str | None = None,
    at: float | None = None,
) -> Specification:
    """Limits that an output or a feature must keep to, for `conformance`.

    Parameters
    ----------
    quantity : str
        Name of an output, which must keep to the limits during the whole sampled time of the continuous
        motion, or of a feature of the study, in all cycles.
    above, below : float or str, optional
        Limits in the SI unit of the quantity, or with a unit, such as ``"120 mm"``; at least one.
    at : float, optional
        Instant [s], one of the samples, at which alone an output must keep to them.

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
        checks.add(f"quantity must be the name of an output or a feature, got {quantity!r}", wrong_type=True)
    if above is None and below is None:
        checks.add("give a limit: above, below or both")
    for name, given in (("above", above), ("below", below)):
        if given is not None and not (isinstance(given, str) and is_quantity(given)):
            checks.real(name, given, "SI unit")
    if at is not None:
        checks.real("at", at, "s", least=0.0)
    checks.finish()
    return Specification(quantity, above, below, at)


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
            f"{place} must be one that require made, or several in a list or by names, got {given!r}",
            wrong_type=not isinstance(given, Mapping),
        )
        return {}
    checks.names(place, given)
    for name, one in given.items():
        if not isinstance(one, Specification):
            checks.add(f'{place}["{name}"] must be made by require, got {one!r}', wrong_type=True)
    if ALL in given:
        checks.add(f'{place}["{ALL}"]: the name is that of all of them together')
    return {name: one for name, one in given.items() if isinstance(one, Specification)}


def _limit(checks: Checks, place: str, given: float | str | None, of: str, default: float) -> float:
    if given is None:
        return default
    number = as_number(given)
    if number is not None:
        return number
    try:
        return convert(str(given), of or "unit")
    except UnitError as error:
        checks.add_at(place, str(error))
        return default
