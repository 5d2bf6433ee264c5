"""Arithmetic expressions over named numbers, as they stand in scene files.

A small language and nothing else: numbers, names, ``+ - * / **``, parentheses and a few functions. It is read
with Python's own parser, but only the nodes listed here are ever evaluated, so that a file
which is not trusted can compute numbers and do nothing else.
"""

from __future__ import annotations

import ast
import math
import operator
import re
import string
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ..base.rows import Array
from ..base.shown import did_you_mean, meant_or_known
from ..base.units import quantity_meant
from ..errors import Problem, describe

# More than a formula of a mechanism needs: the inertia of a rod with two holes has 90 characters, 40 nodes
# and depth 8. The limits keep hostile texts from costing time or stack.
MOST_CHARACTERS = 300
MOST_NODES = 100
MOST_DEPTH = 25

FUNCTIONS: dict[str, Callable[..., float]] = {
    "abs": abs,
    "acos": math.acos,
    "asin": math.asin,
    "atan": math.atan,
    "atan2": math.atan2,
    "cos": math.cos,
    "exp": math.exp,
    "hypot": math.hypot,
    "log": math.log,
    "max": max,
    "min": min,
    "sin": math.sin,
    "sqrt": math.sqrt,
    "tan": math.tan,
}
"""Functions that an expression may call; angles in rad."""
CONSTANTS = {"pi": math.pi}
"""Names that every expression knows."""

# Neither quotes, brackets of lists, comments nor anything that looks like a letter and is none.
_LETTERS = frozenset(string.ascii_letters + string.digits + "_ .,+-*/()")
_ARGUMENTS = {"atan2": (2, 2), "hypot": (1, 8), "max": (2, 8), "min": (2, 8)}
_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
_UNARY: dict[type[ast.unaryop], Callable[[Any], Any]] = {ast.UAdd: operator.pos, ast.USub: operator.neg}
_ALLOWED = "numbers, names of parameters, + - * / **, parentheses and " + ", ".join(FUNCTIONS)


class ExpressionError(ValueError):
    """An expression that cannot be read or evaluated; `column` [-] counts characters from 0."""

    def __init__(self, message: str, column: int = 0) -> None:
        super().__init__(message)
        self.column = column


class UnknownNameInExpression(ExpressionError):
    """A name that no parameter has."""


class CausedProblem(Problem):
    """A problem whose cause may show at several places of a file."""

    cause: str
    """What problems of one cause have in common; empty for one that stands for itself."""

    def __new__(cls, path: str, message: str, cause: str = "") -> Self:
        problem = super().__new__(cls, path, message)
        problem.cause = cause
        return problem

    def with_more(self, words: str) -> Self:
        """The problem with more words on it."""
        problem = type(self)(self.path, f"{self.message}{words}")
        vars(problem).update(vars(self))
        return problem

    def with_others(self, others: Sequence[Problem]) -> Self:
        """The first problem of a cause, with how many follow and where the last of them is."""
        places = "" if len(others) == 1 else f" {len(others)} more places, the last of them"
        return self.with_more(f"; the same at{places} {others[-1].path}")


class ExpressionProblem(CausedProblem):
    """A problem inside the text of an expression."""

    offset: int
    """Characters of the text before it [-]."""

    def __new__(cls, path: str, message: str, offset: int = 0, cause: str = "") -> Self:
        problem = super().__new__(cls, path, message, cause)
        problem.offset = offset
        return problem


def by_cause(problems: Iterable[Problem]) -> list[Problem]:
    """Problems with those of one cause as one."""
    groups: dict[object, list[Problem]] = {}
    for index, problem in enumerate(problems):
        cause = problem.cause if isinstance(problem, CausedProblem) else ""
        groups.setdefault(cause or index, []).append(problem)
    return [
        first.with_others(others) if others and isinstance(first, CausedProblem) else first
        for first, *others in groups.values()
    ]


@dataclass(frozen=True)
class Expression:
    """A checked expression.

    Examples
    --------
    >>> inertia = parse("mass * length**2 / 12")
    >>> sorted(inertia.names)
    ['length', 'mass']
    >>> inertia.evaluate({"mass": 0.5, "length": 0.12})
    0.0006
    """

    text: str
    """As it was written."""
    names: frozenset[str]
    """Names whose values it needs, constants not among them."""
    _tree: ast.expr = field(compare=False, repr=False)

    def evaluate(self, values: Mapping[str, float]) -> float:
        """The value with these of all names [SI units]; an ExpressionError where there is no finite one."""
        return _evaluate(self._tree, {**CONSTANTS, **values})

    @property
    def name(self) -> str:
        """The name that it consists of; empty if it is more than that."""
        return self._tree.id if isinstance(self._tree, ast.Name) else ""

    def require(self, known: Iterable[str], meant: Iterable[str] = ()) -> None:
        """Raise an ExpressionError at the first name that is not known; `meant` are others to suggest."""
        known = [*known, *CONSTANTS]
        functions = {id(node.func) for node in ast.walk(self._tree) if isinstance(node, ast.Call)}
        unknown = [
            (node.col_offset, node.id)
            for node in ast.walk(self._tree)
            if isinstance(node, ast.Name) and id(node) not in functions and node.id not in known
        ]
        if unknown:
            column, name = min(unknown)
            raise UnknownNameInExpression(
                f'unknown name "{name}"{meant_or_known(name, [*known, *meant])}', column
            )

    def column(self, values: Mapping[str, float | Array], runs: int) -> Array:
        """The values for many runs, shape (runs,), to the same bits; NaN where `evaluate` raises."""
        lost = np.zeros(runs, dtype=bool)
        with np.errstate(all="ignore"):
            found = _column(self._tree, values, lost)
        found[lost] = math.nan
        return found


def parse(text: str) -> Expression:
    """Read an expression; an ExpressionError if it is none, holds what is not allowed, or is too large."""
    if len(text) > MOST_CHARACTERS:
        raise ExpressionError(f"has {len(text)} characters; at most {MOST_CHARACTERS} are accepted")
    column = next((index for index, letter in enumerate(text) if letter not in _LETTERS), None)
    meant = quantity_meant(text)
    if re.fullmatch(r"\s*[+-]?[0-9]+,[0-9]+(\s+\S.*)?", text):
        point = text.strip().replace(",", ".", 1)
        raise ExpressionError(f'has a comma; decimals follow a point, "{point}"', text.index(","))
    if meant:
        raise ExpressionError(
            f'is no arithmetic expression; write a space between number and unit, "{meant}"', 0
        )
    if column is not None:
        power = "; a power is written **" if text[column] == "^" else ""
        raise ExpressionError(
            f"{text[column]!r} is not accepted{power}; an expression holds {_ALLOWED}", column
        )
    if not text.strip():
        raise ExpressionError("is empty")
    before = len(text) - len(text.lstrip())
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except SyntaxError as error:
        if not error.offset:  # the text ends where more was expected
            message = "is no arithmetic expression: it ends too early"
            raise ExpressionError(message, min(len(text.rstrip()), len(text) - 1)) from None
        raise ExpressionError(
            "is no arithmetic expression", min(before + error.offset, len(text)) - 1
        ) from None
    except (RecursionError, MemoryError, ValueError):
        raise ExpressionError("is nested too deeply") from None
    for node in ast.walk(tree):
        if isinstance(node, ast.expr):
            node.col_offset += before
    names: set[str] = set()
    _check(tree, names, [0], 0)
    return Expression(text, frozenset(names - set(CONSTANTS)), tree)


def _check(node: ast.expr, names: set[str], count: list[int], depth: int) -> None:
    count[0] += 1
    column = node.col_offset
    if count[0] > MOST_NODES or depth > MOST_DEPTH:
        raise ExpressionError(
            f"is too large: at most {MOST_NODES} numbers, names and operations, {MOST_DEPTH} deep", column
        )
    match node:
        case ast.Constant(value=int() | float()) if not isinstance(node.value, bool):
            # As a float at once: whole numbers of Python grow without limit (9**9**9).
            _finite(_as_float(node.value), column)
        case ast.Name():
            names.add(node.id)
        case ast.BinOp() if type(node.op) in _BINARY:
            _check(node.left, names, count, depth + 1)
            _check(node.right, names, count, depth + 1)
        case ast.UnaryOp() if type(node.op) in _UNARY:
            _check(node.operand, names, count, depth + 1)
        case ast.Call(func=ast.Name(id=name), keywords=[]):
            if name not in FUNCTIONS:
                known = did_you_mean(name, FUNCTIONS) or f"; known are {', '.join(FUNCTIONS)}"
                raise ExpressionError(f'unknown function "{name}"{known}', column)
            least, most = _ARGUMENTS.get(name, (1, 1))
            if not least <= len(node.args) <= most:
                wanted = str(least) if least == most else f"{least} to {most}"
                raise ExpressionError(
                    f"{name} takes {wanted} argument{'s' * (most > 1)}, got {len(node.args)}", column
                )
            for argument in node.args:
                _check(argument, names, count, depth + 1)
        case _:
            raise ExpressionError(f"holds something else than {_ALLOWED}", column)


def _evaluate(node: ast.expr, values: Mapping[str, float]) -> float:
    column = node.col_offset
    try:
        match node:
            case ast.Constant():
                result = _as_float(node.value)
            case ast.Name():
                if node.id not in values:
                    hint = meant_or_known(node.id, values)
                    raise UnknownNameInExpression(f'unknown name "{node.id}"{hint}', column)
                result = float(values[node.id])
            case ast.BinOp():
                left, right = _evaluate(node.left, values), _evaluate(node.right, values)
                result = _BINARY[type(node.op)](left, right)
            case ast.UnaryOp():
                result = _UNARY[type(node.op)](_evaluate(node.operand, values))
            case ast.Call(func=ast.Name(id=name)):
                result = FUNCTIONS[name](*(_evaluate(argument, values) for argument in node.args))
            case _:
                raise AssertionError(node)
    except ZeroDivisionError:
        raise ExpressionError(f"divides by zero{_given(node, values)}", column) from None
    except OverflowError:
        raise ExpressionError("is too large a number", column) from None
    except ExpressionError:
        raise
    except ValueError:  # the root or logarithm of a negative number
        raise ExpressionError(f"has no real value{_given(node, values)}", column) from None
    return _finite(result, column)


def _given(node: ast.expr, values: Mapping[str, float]) -> str:
    """The values of the names in a part of an expression, in words."""
    names = dict.fromkeys(part.id for part in ast.walk(node) if isinstance(part, ast.Name))
    known = {name: values[name] for name in names if name in values and name not in CONSTANTS}
    return f" with {describe(known)}" if known else ""


def _column(node: ast.expr, values: Mapping[str, float | Array], lost: NDArray[np.bool_]) -> Array:
    """The values of a part of an expression; notes the runs in which it has none.

    Sums, products and quotients are those of IEEE 754 everywhere. All else is computed one by one with the
    functions that a single run uses, whose last bits are not those of NumPy.
    """
    match node:
        case ast.Constant():
            found = np.full(len(lost), _as_float(node.value))
        case ast.Name():
            found = np.full(len(lost), values[node.id] if node.id in values else CONSTANTS[node.id])
        case ast.BinOp(op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div()):
            found = _BINARY[type(node.op)](
                _column(node.left, values, lost), _column(node.right, values, lost)
            )
        case ast.BinOp():
            found = _one_by_one(_BINARY[type(node.op)], [node.left, node.right], values, lost)
        case ast.UnaryOp():
            found = _UNARY[type(node.op)](_column(node.operand, values, lost))
        case ast.Call(func=ast.Name(id=name)):
            found = _one_by_one(FUNCTIONS[name], node.args, values, lost)
        case _:
            raise AssertionError(node)
    lost |= ~np.isfinite(found)
    return found


def _one_by_one(
    function: Callable[..., float],
    nodes: Sequence[ast.expr],
    values: Mapping[str, float | Array],
    lost: NDArray[np.bool_],
) -> Array:
    arguments = [_column(node, values, lost).tolist() for node in nodes]
    try:
        return np.fromiter(map(function, *arguments), float, len(lost))
    except (
        ArithmeticError,
        ValueError,
        TypeError,
    ):  # of some run, which is TypeError where the value is complex
        return np.array([_value(function, each) for each in zip(*arguments, strict=True)])


def _value(function: Callable[..., float], arguments: Sequence[float]) -> float:
    try:
        return float(function(*arguments))
    except (ArithmeticError, ValueError, TypeError):
        return math.nan


def _as_float(value: object) -> float:
    try:
        return float(value)  # type: ignore[arg-type]
    except OverflowError:
        return math.inf


def _finite(value: object, column: int) -> float:
    if isinstance(value, complex):  # a fractional power of a negative number
        raise ExpressionError("has no real value", column)
    assert isinstance(value, float)
    if not math.isfinite(value):
        raise ExpressionError("is too large a number", column)
    return value
