"""Identity of a user's model: the source of its functions, and the values that they use.

A store returns old runs only if the identity is the same. Values that cannot be compared are refused; files
that a function reads, and other packages that it calls, are not compared.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
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
    """Hash of its source and of the variables and classes that it uses from its surroundings."""
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
    if isinstance(value, Enum):
        return f"{type(value).__module__}.{type(value).__qualname__}.{value.name} {value.value!r}"
    if isinstance(value, BuiltinFunctionType | np.ufunc):
        return f"{getattr(value, '__module__', '')}.{getattr(value, '__qualname__', value)}"
    if isinstance(value, type):
        return _class(value, inside)
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
    if _is_versioned(function):
        return f"{function.__module__}.{function.__qualname__}"
    try:
        around = dict(inspect.getclosurevars(function).nonlocals)
    except ValueError:  # a cell that has no value yet
        raise UnknownValueError(f"{function.__qualname__} uses a variable without a value") from None
    # Those of functions inside as well, which the closure variables are without.
    names = _names_in(function.__code__)
    around |= {name: function.__globals__[name] for name in names if name in function.__globals__}
    return {
        "text": _text(function),
        "defaults": _plain(list(function.__defaults__ or ()), inside),
        "keywords": _plain(function.__kwdefaults__ or {}, inside),
        "around": {name: _plain(value, inside) for name, value in around.items()},
    }


def _class(given: type, inside: tuple[object, ...]) -> Any:
    """Source of a class, its public attributes, and what its methods use from their surroundings."""
    name = f"{given.__module__}.{given.__qualname__}"
    if _is_versioned(given) or given in inside or len(inside) > _DEEPEST:
        return name
    inside = (*inside, given)
    try:
        text = inspect.getsource(given)
    except (OSError, TypeError):
        text = ""
    parts: dict[str, Any] = {}
    # The source has the members of an enumeration.
    own = {} if issubclass(given, Enum) else vars(given)
    for key, value in own.items():
        functions = _functions_of(value)
        if written := [one for one in functions if _is_written(one, given)]:
            parts[key] = _plain(written, inside)
        # Other descriptors stand for values of the objects.
        elif not (functions or key.startswith("_") or hasattr(type(value), "__get__")):
            parts[key] = _plain(value, inside)
    return {"class": name, "text": text, "bases": _plain(list(given.__bases__), inside), "around": parts}


def _functions_of(attribute: object) -> list[FunctionType]:
    """The functions of a method, property or the like of a class."""
    if isinstance(attribute, classmethod | staticmethod):
        attribute = attribute.__func__
    if isinstance(attribute, functools.cached_property):
        attribute = attribute.func
    parts = [attribute]
    if isinstance(attribute, property):
        parts = [attribute.fget, attribute.fset, attribute.fdel]
    return [one for one in parts if isinstance(one, FunctionType)]


def _is_written(function: FunctionType, given: type) -> bool:
    """Whether a method was written beside its class: dataclasses and the like make others."""
    made = function.__code__.co_filename == "<string>"
    return not made and function.__globals__.get("__name__") == given.__module__


def _is_versioned(value: type | FunctionType) -> bool:
    """Whether a function or class is Python's own or that of a package whose versions are not compared."""
    package = value.__module__.partition(".")[0]
    return package in ("numpy", "scipy", "chebclear") or package in sys.stdlib_module_names


def _names_in(code: CodeType) -> set[str]:
    """Names that a function, with all functions inside it, may look up around it."""
    inner = (one for one in code.co_consts if isinstance(one, CodeType))
    return set(code.co_names).union(*map(_names_in, inner))


def _text(function: FunctionType) -> str:
    """The source of a function, or its bytecode if there is none."""
    try:
        return inspect.getsource(function)
    except (OSError, TypeError):
        return _compiled(function.__code__)


def _compiled(code: CodeType) -> str:
    inner = [_compiled(one) if isinstance(one, CodeType) else repr(one) for one in code.co_consts]
    return f"{code.co_code.hex()} {inner} {code.co_names}"
