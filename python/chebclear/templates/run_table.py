"""The tables ``[run]``, ``[features]``, ``[requirements]`` and ``[costs]`` of a scene file."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..base.arguments import Checks
from ..base.shown import meant_or_known
from ..base.units import is_quantity, units
from ..errors import ArgumentError, ArgumentTypeError, SceneError, is_plain
from ..run.features import JOINT_KINDS, KINDS, Feature
from ..run.settings import RunOptions, Settings, require_features
from ..scene.columns import column_unit
from ..scene.parts import Inspection
from ..study.requirements.specification import Specification, require
from .expressions import Expression, ExpressionError
from .template import Parameter
from .values import Values

UNITS = {name: units(Settings).get(name, "-") for name in RunOptions.__annotations__ if name != "method"}
"""Numbers of the table ``run``, with their units."""
_WHOLE = ("samples", "max_steps", "max_events", "cycles")
# Stand for what a file may leave to the caller, so that the rest can be judged.
_NEEDED: dict[str, Any] = {"duration": 1.0, "samples": 2}
# Without blanks around the name, which would be tried in all ways: the time would grow with their cube.
_FEATURE = re.compile(r"\s*(\w+)\s*\(([^()]*)\)\s*", re.ASCII)
_EXAMPLE = '"peak(slider.ax)"'
_WINDOW = re.compile(r"([\w.]+)\s*=\s*(.*?)\s*\.\.\s*(.*)")
_WINDOW_EXAMPLE = '"crank.angle = 80 deg .. 120 deg" or "time = 20 ms .."'
GRADE = re.compile(r"IT(\d{1,2})")
"""An ISO grade in a catalog."""
_TOLERANCE = "tolerance"
_COST_EXAMPLE = '"3 + 2e-5 / tolerance", or a catalog such as { "10 um" = 7.5, "20 um" = 5 } or { IT7 = 9 }'


def read_run(given: Any, values: Values) -> dict[str, Any]:
    """The settings of a file as keywords of `simulate` and `Study` [SI units]."""
    if not isinstance(given, Mapping):
        values.note(("run",), f"must be a table, got {given!r}")
        return {}
    before = len(values.problems)
    known = (*UNITS, "method", "outputs")
    run: dict[str, Any] = {}
    for key, value in given.items():
        if key in UNITS:
            number = values.constant(value, ("run", key), UNITS[key])
            if number is not None:
                run[key] = int(number) if key in _WHOLE and number == int(number) else number
        elif key == "outputs" and value == []:
            values.note(("run", key), "must name at least one output, or be left out for the usual ones")
        elif key in known:
            run[key] = value
        else:
            values.unknown(("run", key), meant_or_known(key, known, most=20))
    if len(values.problems) == before:
        _check_settings(run, values)
    return run


def _check_settings(run: Mapping[str, Any], values: Values) -> None:
    try:
        Settings(**_NEEDED | dict(run))
    except (ArgumentError, ArgumentTypeError) as error:
        for name, message in error.problems:
            values.note(("run", name), message)


def read_features(given: Any, values: Values) -> dict[str, Feature]:
    """The features of a file by name, from texts such as ``"peak(slider.ax)"``."""
    if not isinstance(given, Mapping):
        values.note(("features",), f"must be a table of names and texts such as {_EXAMPLE}, got {given!r}")
        return {}
    features: dict[str, Feature] = {}
    for name, text in given.items():
        if not is_plain(name):
            values.note(("features", name), "must be named without control characters")
        found = _FEATURE.fullmatch(text) if isinstance(text, str) else None
        if found is None:
            values.note(("features", name), f"must be a text such as {_EXAMPLE}, got {text!r}")
        elif found[1] not in KINDS:
            values.note(("features", name), f'unknown feature "{found[1]}"{meant_or_known(found[1], KINDS)}')
        elif not found[2].strip():
            what = "a clearance joint" if found[1] in JOINT_KINDS else "an output"
            values.note(("features", name), f"misses the name of {what} in its parentheses")
        else:
            of, _, window = (part.strip() for part in found[2].partition(","))
            ends = _WINDOW.fullmatch(window)
            if window and ends is None:
                values.note(
                    ("features", name), f"may have a window such as {_WINDOW_EXAMPLE}, got {window!r}"
                )
                continue
            try:
                given = None if ends is None else (ends[1], _number(ends[2]), _number(ends[3]))
                features[name] = Feature(found[1], of, given)
            except (ArgumentError, ArgumentTypeError) as error:
                for _, message in error.problems:
                    values.note(("features", name), f"window {message}")
    return features


def _number(text: str) -> float | str | None:
    """An end of a window: a number, a text with a unit, or none."""
    try:
        return float(text)
    except ValueError:
        return text or None


def read_requirements(given: Any, values: Values) -> dict[str, Specification]:
    """The requirements of a file by name, from tables with ``of``, ``above``, ``below``, ``at``."""
    if not isinstance(given, Mapping):
        values.note(("requirements",), f"must be a table of tables such as {_LIMITS}, got {given!r}")
        return {}
    found: dict[str, Specification] = {}
    for name, facts in given.items():
        path = ("requirements", name)
        if not is_plain(name):
            values.note(path, "must be named without control characters")
        if not isinstance(facts, Mapping):
            values.note(path, f"must be a table such as {_LIMITS}, got {facts!r}")
            continue
        unknown = [key for key in facts if key not in _LIMIT_KEYS]
        for key in unknown:
            values.unknown((*path, key), meant_or_known(key, _LIMIT_KEYS))
        if "of" not in facts:
            values.note(path, "misses of, the name of an output or a feature")
        if unknown or "of" not in facts:
            continue
        at = facts.get("at")
        if at is not None and not (isinstance(at, str) and is_quantity(at)):  # an expression
            at = values.constant(at, (*path, "at"), "s")
        limits = {key: facts[key] for key in ("above", "below", "joint") if key in facts}
        try:
            found[name] = require(facts["of"], at=at, **limits)
        except (ArgumentError, ArgumentTypeError) as error:
            for problem in error.problems:
                values.note((*path, "of" if problem.path == "quantity" else problem.path), problem.message)
    return found


_LIMIT_KEYS = ("of", "above", "below", "at", "joint")
_LIMITS = '{ of = "slider.x", below = "170.1 mm" }'


def check_names(
    facts: Inspection,
    run: Mapping[str, Any],
    features: Mapping[str, Feature],
    requirements: Mapping[str, Specification],
    values: Values,
) -> None:
    """Note the outputs and joints that a scene has not, and limits of another dimension."""
    columns = [*facts.columns, *facts.further_columns]
    for name, one in requirements.items():
        path = ("requirements", name)
        if one.quantity in features:
            unit = features[one.quantity].unit
        elif one.quantity in columns:
            unit = column_unit(one.quantity)
        else:
            known = [*features, *columns]
            hint = meant_or_known(one.quantity, known)
            values.note((*path, "of"), f'unknown output or feature "{one.quantity}"{hint}')
            continue
        checks = Checks(SceneError)
        one.limits(checks, "limits", unit)
        try:
            checks.finish()
        except SceneError as error:
            for problem in error.problems:
                key = problem.path.rpartition(".")[2]
                values.note((*path, key) if key in _LIMIT_KEYS else path, problem.message)
    for index, name in enumerate(run.get("outputs") or ()):
        try:
            Settings(**_NEEDED, outputs=(name,)).fitted(facts)
        except ValueError as error:
            values.note(("run", "outputs", index), str(error))
    for name, feature in features.items():
        try:
            require_features(facts, [feature])
        except ValueError as error:
            values.note(("features", name), str(error))


@dataclass(frozen=True)
class CostFunction:
    """A cost that an expression of ``tolerance`` gives, in the SI unit of the parameter."""

    expression: Expression

    def __call__(self, tolerance: float) -> float:
        return self.expression.evaluate({_TOLERANCE: tolerance})


def read_costs(
    given: Any, parameters: Mapping[str, Parameter], values: Values
) -> dict[str, CostFunction | dict[str, float]]:
    """The costs of a file by parameter: expressions of ``tolerance``, or catalogs."""
    if not isinstance(given, Mapping):
        values.note(("costs",), f"must be a table of parameters with {_COST_EXAMPLE}, got {given!r}")
        return {}
    found: dict[str, CostFunction | dict[str, float]] = {}
    for name, cost in given.items():
        path = ("costs", name)
        if name in values.lost or (name in parameters and values.has_problem(("parameters", name))):
            continue
        if name not in parameters:
            values.note(path, f"unknown parameter{meant_or_known(name, parameters)}")
        elif parameters[name].interval is None:
            values.note(path, "the parameter has no interval: give it rel, plus and minus, limits or fit")
        elif isinstance(cost, Mapping):
            prices = {
                key: values.constant(price, (*path, key), "-", alone=True) for key, price in cost.items()
            }
            found[name] = {key: price for key, price in prices.items() if price is not None}
        elif not isinstance(cost, str):
            values.note(path, f"must be {_COST_EXAMPLE}, got {cost!r}")
        elif isinstance(expression := values.number(cost, "-", path), Expression):
            found[name] = CostFunction(expression)
            try:
                expression.require((_TOLERANCE,))
            except ExpressionError as error:
                values.refuse(path, expression.text, error)
    return found
