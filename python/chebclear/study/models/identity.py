"""Identity of a user's model: the source of its functions, and the values that they use.

A store returns old runs only if the identity is the same. Values that cannot be compared are refused; files
that a function reads, and other packages that it calls, are not compared.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import BuiltinFunctionType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

from ...errors import ArgumentError

# Largest depth of functions that call functions.
_DEEPEST = 20


class UnknownValueError(ValueError):
    """A value that cannot be compared."""


@dataclass(frozen=True)
class ModelIdentity:
    """Common properties of the runs of a model in a store."""

    name: str
    """Name of the function."""
    source: str
    """Hash of its source and of the variables that it uses from its surroundings."""
    fixed: Mapping[str, Any]
    """Keywords that are the same for all runs, as JSON has them."""

    @classmethod
    def of(cls, call: Callable[..., Any], fixed: Mapping[str, Any]) -> ModelIdentity:
        """The identity of a model.

        Raises
        ------
        ValueError
            If a value that it uses cannot be compared with its value in a later session.
        """
        name = getattr(call, "__qualname__", type(call).__qualname__)
        try:
            text = json.dumps(_plain(call, ()), sort_keys=True)
            given = {key: _plain(value, ()) for key, value in fixed.items()}
        except UnknownValueError as error:
            raise ArgumentError(
                f"store needs to know whether the model is the same the next time, but {error}: make it a "
                "function of numbers, texts, lists, arrays and other functions"
            ) from None
        return cls(name, hashlib.sha256(text.encode()).hexdigest()[:16], given)

    def facts(self) -> dict[str, Any]:
        """As JSON has it; outputs and features are named when the first run is known."""
        return {
            "code": f"model {self.name}, source {self.source}",
            "topology": "",
            "settings": {"fixed": dict(self.fixed)},
            "outputs": [],
            "features": [],
        }


def _plain(value: Any, inside: tuple[object, ...]) -> Any:
    """A value as JSON has it, equal for equal values; `inside` are the functions that led to it."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, complex | bytes):
        return repr(value)
    if isinstance(value, np.generic):
        return value.item() if value.dtype.kind in "biuf" else repr(value)
    if isinstance(value, np.ndarray) and value.dtype.kind in "biufcSU":
        digest = hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()[:16]
        return f"array {value.dtype.str} {value.shape} {digest}"
    if isinstance(value, list | tuple):
        return [_plain(item, inside) for item in value]
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: _plain(item, inside) for key, item in value.items()}
    if isinstance(value, ModuleType):
        return f"module {value.__name__} {getattr(value, '__version__', '')}"
    if isinstance(value, type | BuiltinFunctionType | np.ufunc):
        return f"{getattr(value, '__module__', '')}.{getattr(value, '__qualname__', value)}"
    if isinstance(value, functools.partial):
        return [_plain(item, inside) for item in (value.func, value.args, value.keywords)]
    if isinstance(value, FunctionType):
        return _function(value, inside)
    if isinstance(value, MethodType):
        raise UnknownValueError(f"{value.__qualname__} is a method, whose object may change")
    raise UnknownValueError(f"a {type(value).__name__} is no plain value")


def _function(function: FunctionType, inside: tuple[object, ...]) -> Any:
    """Source of a function, its defaults, and the variables that it uses from its surroundings."""
    if function in inside or len(inside) > _DEEPEST:
        return function.__qualname__
    inside = (*inside, function)
    if function.__module__.partition(".")[0] in ("numpy", "scipy", "chebclear"):
        return f"{function.__module__}.{function.__qualname__}"
    around: dict[str, Any] = {}
    try:
        closed = inspect.getclosurevars(function)
        around = dict(closed.nonlocals) | dict(closed.globals)
    except ValueError:  # a cell that has no value yet
        raise UnknownValueError(f"{function.__qualname__} uses a variable without a value") from None
    return {
        "text": _text(function),
        "defaults": _plain(list(function.__defaults__ or ()), inside),
        "keywords": _plain(function.__kwdefaults__ or {}, inside),
        "around": {name: _plain(value, inside) for name, value in around.items()},
    }


def _text(function: FunctionType) -> str:
    """The source of a function, or its bytecode if there is none."""
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):
        return _compiled(function.__code__)


def _compiled(code: CodeType) -> str:
    inner = [_compiled(one) if isinstance(one, CodeType) else repr(one) for one in code.co_consts]
    return f"{code.co_code.hex()} {inner} {code.co_names}"
