"""Identity of a user's model: the source of its functions, and the values that they use.

A store returns old runs only if the identity is the same. Values that cannot be compared are refused; files
that a function reads, and other packages that it calls, are not compared.
"""

from __future__ import annotations

import dis
import functools
import hashlib
import inspect
import json
import sys
import sysconfig
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

from ...errors import ArgumentError

# Folder of Python's own modules.
_STANDARD = Path(sysconfig.get_path("stdlib")).resolve()


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
            text = json.dumps(_plain(call, set()), sort_keys=True)
            given = {key: _plain(value, set()) for key, value in fixed.items()}
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


def _plain(value: Any, seen: set[object]) -> Any:
    """A value as JSON has it, equal for equal values; those `seen` have their names alone."""
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
        return [_plain(item, seen) for item in value]
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: _plain(item, seen) for key, item in value.items()}
    if isinstance(value, ModuleType):
        return f"module {value.__name__} {getattr(value, '__version__', '')}"
    if isinstance(value, Enum):
        return f"{type(value).__module__}.{type(value).__qualname__}.{value.name} {value.value!r}"
    if isinstance(value, BuiltinFunctionType | np.ufunc):
        return f"{getattr(value, '__module__', '')}.{getattr(value, '__qualname__', value)}"
    if isinstance(value, type):
        return _class(value, seen)
    if isinstance(value, functools.partial):
        return [_plain(item, seen) for item in (value.func, value.args, value.keywords)]
    if isinstance(value, FunctionType):
        return _function(value, seen)
    if isinstance(value, MethodType):
        raise UnknownValueError(f"{value.__qualname__} is a method, whose object may change")
    raise UnknownValueError(f"a {type(value).__name__} is no plain value")


def _function(function: FunctionType, seen: set[object]) -> Any:
    """Source of a function, its defaults, and the variables that it uses from its surroundings."""
    name = f"{function.__module__}.{function.__qualname__}"
    if function in seen or _is_versioned(function.__module__, function.__code__.co_filename):
        return name
    seen.add(function)
    try:
        around = dict(inspect.getclosurevars(function).nonlocals)
    except ValueError:  # a cell that has no value yet
        raise UnknownValueError(f"{function.__qualname__} uses a variable without a value") from None
    # Those of functions inside as well, which the closure variables are without; in an order of their own.
    names = sorted(_names_in(function.__code__))
    around |= {name: function.__globals__[name] for name in names if name in function.__globals__}
    return {
        "text": _text(function),
        "defaults": _plain(list(function.__defaults__ or ()), seen),
        "keywords": _plain(function.__kwdefaults__ or {}, seen),
        "around": {name: _plain(value, seen) for name, value in around.items()},
    }


def _class(given: type, seen: set[object]) -> Any:
    """Source of a class, its public attributes, and what its methods use from their surroundings.

    Classes of installed packages are named alone.
    """
    name = f"{given.__module__}.{given.__qualname__}"
    file = getattr(sys.modules.get(given.__module__), "__file__", None)
    # In an interactive session there is no file.
    others = file is not None and (_is_installed(file) or _is_versioned(given.__module__, file))
    if given in seen or others or given.__module__ == "builtins":
        return name
    seen.add(given)
    try:
        text = inspect.getsource(given)
    except (OSError, TypeError):
        text = ""
    return {"class": name, "text": text, "around": _own(given, seen)}


def _own(given: type, seen: set[object]) -> list[Any]:
    """Bases of a class, its attributes that can be compared and do not change, and its methods."""
    # The source has the members of an enumeration.
    own = {} if issubclass(given, Enum) else vars(given)
    methods = {
        key: [one for one in _functions_of(value) if _is_written(one, given)] for key, value in own.items()
    }
    changed = {name for found in methods.values() for one in found for name in _assigned_in(one.__code__)}
    parts: dict[str, Any] = {}
    for key, value in own.items():
        if methods[key]:
            parts[key] = _plain(methods[key], seen)
        # Other descriptors stand for values of the objects.
        elif not (key.startswith("_") or key in changed or hasattr(type(value), "__get__")):
            try:
                parts[key] = _plain(value, seen)
            except UnknownValueError:
                parts[key] = type(value).__qualname__
    return [_plain(list(given.__bases__), seen), parts]


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


def _assigned_in(code: CodeType) -> set[str]:
    """Names of the attributes to which a function assigns."""
    return {one.argval for one in dis.get_instructions(code) if one.opname == "STORE_ATTR"}


def _is_versioned(module: str, file: str) -> bool:
    """Whether a module is Python's own or that of a package whose versions are not compared.

    Python's own is told by its folder: modules of users may have names of Python's.
    """
    if module.partition(".")[0] in ("numpy", "scipy", "chebclear"):
        return True
    own = _STANDARD in Path(file).resolve().parents and not _is_installed(file)
    return own or file.startswith("<frozen")


def _is_installed(file: str) -> bool:
    """Whether a file is in a folder of installed packages."""
    return not {"site-packages", "dist-packages"}.isdisjoint(Path(file).parts)


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
