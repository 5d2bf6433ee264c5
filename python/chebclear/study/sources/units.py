"""Units that the user gives by name: of parameters, outputs and features."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from ...base.arguments import Checks, meant_or_known
from ...run.features import Feature
from .asked import FeatureSpec


def checked_units(checks: Checks, units: object) -> dict[str, str]:
    """Units by name; whether there are such names is known later."""
    if units is None:
        return {}
    if not isinstance(units, Mapping):
        checks.add(f"units must map names to units, got {units!r}", wrong_type=True)
        return {}
    for name, unit in units.items():
        if not isinstance(unit, str) or not unit.strip():
            what = 'a text such as "mm", or "-" for a number without a unit'
            checks.add(f'units["{name}"] must be {what}, got {unit!r}', wrong_type=not isinstance(unit, str))
    return {str(name): str(unit) for name, unit in units.items()}


def known_units(build: object, names: Iterable[str]) -> dict[str, str]:
    """Units of parameters that their mechanism knows, as the ready-made ones and scene files do."""
    unit_of = getattr(build, "unit_of", None)
    units = {name: unit_of(name) for name in names} if callable(unit_of) else {}
    return {name: unit for name, unit in units.items() if unit}


def require_known(
    checks: Checks, with_unit: Iterable[str], known: Sequence[str], *, simulated: bool = False
) -> None:
    """Refuse units of names that a study does not have."""
    for name in with_unit:
        if name not in known:
            hint = meant_or_known(name, known)
            what = "parameter or feature" if simulated else "parameter, output or feature"
            own = "; outputs of simulations have their units" if simulated else ""
            checks.add(f'units names no {what} with "{name}"{own}{hint}')


def units_of(
    names: Iterable[str], asked: Mapping[str, FeatureSpec], given: Mapping[str, str], *, simulated: bool
) -> tuple[str, ...]:
    """Unit of each feature by its name; empty where none is known, as of the results of callables.

    Outputs of a model of the user's own have the given units, whatever their names.
    """
    found = []
    for name in names:
        feature = asked.get(name)
        if isinstance(feature, Feature):
            own = feature.unit if simulated else feature.unit_with(given.get(feature.of, ""))
        else:
            own = ""
        found.append(given.get(name, own))
    return tuple(found)
