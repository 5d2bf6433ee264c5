"""The table ``[costs]`` of a scene file: what tolerances of parameters cost, for `allocate`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..base.arguments import meant_or_known
from .expressions import Expression, ExpressionError
from .template import Parameter
from .values import Values

GRADE = re.compile(r"IT(\d{1,2})")
"""An ISO grade in a catalog."""
_TOLERANCE = "tolerance"
_EXAMPLE = '"3 + 2e-5 / tolerance", or a catalog such as { "10 um" = 7.5, "20 um" = 5 } or { IT7 = 9 }'


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
        values.note(("costs",), f"must be a table of parameters with {_EXAMPLE}, got {given!r}")
        return {}
    found: dict[str, CostFunction | dict[str, float]] = {}
    for name, cost in given.items():
        path = ("costs", name)
        if name not in parameters:
            values.note(path, f"unknown parameter{meant_or_known(name, parameters)}")
        elif parameters[name].interval is None:
            values.note(path, "the parameter has no interval: give it rel, plus and minus, limits or fit")
        elif isinstance(cost, Mapping):
            prices = {key: values.constant(price, (*path, key), "-") for key, price in cost.items()}
            found[name] = {key: price for key, price in prices.items() if price is not None}
        elif not isinstance(cost, str):
            values.note(path, f"must be {_EXAMPLE}, got {cost!r}")
        elif isinstance(expression := values.number(cost, "-", path), Expression):
            found[name] = CostFunction(expression)
            try:
                expression.require((_TOLERANCE,))
            except ExpressionError as error:
                values.refuse(path, expression.text, error)
    return found
