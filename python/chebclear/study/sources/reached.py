"""Everything that a function can reach, part by part: code, constants and values, packages by their versions.

Code is compared as bytecode, which is what runs, without the numbers of its lines. A function of the user's
leads to what it looks up in its surroundings, a class to its bases and attributes, an object to its class and
its state. What is found under its name in an installed package or in Python's own modules is the same as long
as their versions are. What can be in none of these ways compared is refused.
"""

from __future__ import annotations

import builtins
import copyreg
import ctypes
import functools
import hashlib
import importlib.machinery
import importlib.util
import inspect
import pickle
import platform
import runpy
import sys
import sysconfig
import threading
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, MappingProxyType, MethodType, ModuleType
from typing import Any

import numpy as np

from ...base.files import package_version
from ...errors import ArgumentError
from ...execution.pieces import code_version
from .bytecode import MISSING, enclosed, uses

# Folder of Python's own modules.
_STANDARD = Path(sysconfig.get_path("stdlib")).resolve()
_INSTALLED = frozenset({"site-packages", "dist-packages"})
# They run code or look up values that no one can foresee.
_UNFORESEEN: Sequence[object] = (
    builtins.eval,
    builtins.exec,
    builtins.globals,
    builtins.__import__,
    importlib.import_module,
    importlib.util.spec_from_file_location,
    importlib.machinery.SourceFileLoader,
    ctypes.CDLL,
    ctypes.PyDLL,
    ctypes.cdll,
    runpy.run_path,
    runpy.run_module,
    sys.modules,
    sys._getframe,
    inspect.currentframe,
)
_UNFORESEEN_NAMES = frozenset({"__subclasses__", "__globals__", "__builtins__", "__import__"})
# Attributes of a class that say where it stands, or are caches of Python's.
_NO_PART = frozenset(
    "__dict__ __weakref__ __module__ __qualname__ __firstlineno__ __static_attributes__ __slotnames__ "
    "__annotations_cache__ _abc_impl".split()
)
# Variables of a module that come with its import, not from what is written in it.
_OF_IMPORT = frozenset(
    "__name__ __file__ __cached__ __spec__ __loader__ __package__ __path__ __builtins__ __doc__".split()
)
_SCALARS = (type(None), bool, float, complex, str, bytes, type(...), type(NotImplemented))
# Descriptors and methods of classes that are not written in Python.
_MEMBERS: Any = (
    type(str.upper),
    type(object.__init__),
    type(dict.__dict__["fromkeys"]),
    type(FunctionType.__code__),
    type(FunctionType.__globals__),
)
# What objects of the user's classes may hold besides their attributes.
_BASES = (list, tuple, dict, set, frozenset, int, float, complex, str, bytes)
_LOCKS = (type(threading.Lock()), type(threading.RLock()))
# Texts up to this length are kept as they are, so that a difference can be read [-].
_READABLE = 60


class UnknownValueError(ValueError):
    """A value that cannot be compared."""


def reached(function: Any) -> dict[str, str]:
    """Text or hash of each part that a function can reach, by kind and name; UnknownValueError if one cannot
    be compared."""
    return {"package python": platform.python_version()} | _Walk("model", function).parts


def is_data(value: Any) -> bool:
    """Whether a value consists of numbers, texts, arrays, lists and dictionaries alone."""
    if type(value) in (list, tuple, set, frozenset):
        return all(map(is_data, value))
    if type(value) is dict:
        return all(map(is_data, [*value, *value.values()]))
    if isinstance(value, np.ndarray):
        return type(value) is np.ndarray and not value.dtype.hasobject
    return type(value) in (*_SCALARS, int) or isinstance(value, np.generic)


def value_text(value: Any) -> str:
    """A value with everything that it can reach, as text or hash; equal for equal values. UnknownValueError
    if it cannot be compared."""
    parts = _Walk("value", value).parts
    return parts["value"] if len(parts) == 1 or is_data(value) else _hash(repr(sorted(parts.items())))


def model_facts(call: Callable[..., Any], fixed: Mapping[str, Any], version: str | None) -> dict[str, Any]:
    """What the runs of a model have in common, as JSON has it: all parts that it can reach, or its version.

    Its outputs and features are named when the first run is known. ArgumentError is raised if something that
    it uses cannot be compared with what it uses in a later session.
    """
    name = getattr(call, "__qualname__", type(call).__qualname__)
    try:
        parts = {
            f"fixed {key}": value_text(value) if version is None or is_data(value) else "of the version"
            for key, value in fixed.items()
        }
        if version is None:
            parts |= reached(call)
    except UnknownValueError as error:
        raise ArgumentError(
            f"store needs to know whether the model is the same the next time, but {error}: give "
            'version="1" to the study, and another version whenever the model is another'
        ) from None
    code = f"model {name}" if version is None else f"model {name}, version {version}"
    return {"code": code, "topology": "", "settings": parts, "outputs": [], "features": []}


class _Walk:
    """A walk from value to value; functions, classes and variables are parts of their own."""

    def __init__(self, name: str, value: Any) -> None:
        self.parts: dict[str, str] = {}
        # Texts of the objects that were met, by identity; each is kept so that no other gets the same.
        self._met: dict[int, tuple[str, Any]] = {}
        self._variables: dict[tuple[int, str, int], tuple[str, Any]] = {}
        self._names: Counter[str] = Counter()
        # Parts wait for their turn, so that calls do not nest.
        self._waiting: deque[tuple[str, Callable[[], str]]] = deque([(name, lambda: self._text(value))])
        while self._waiting:
            part, text = self._waiting.popleft()
            try:
                found = text()
                self.parts[part] = found if len(found) <= _READABLE else _hash(found)
            except UnknownValueError as error:
                raise UnknownValueError(str(error) if part == name else f"{part}: {error}") from None
            except Exception as error:  # of code of the user's, or of a value that is nested too deeply
                what = f"{part} cannot be compared ({type(error).__name__}: {error})"
                raise UnknownValueError(what) from None

    def _part(self, kind: str, name: str, text: Callable[[], str]) -> str:
        """A part of its own, which waits for its turn; its name, which no other has."""
        name = f"{kind} {name}"
        self._names[name] += 1
        if self._names[name] > 1:
            name = f"{name} ({self._names[name]})"
        self._waiting.append((name, text))
        return name

    def _variable(self, owner: object, name: str, value: Any) -> str:
        """A variable of a module, class or function."""
        if value is MISSING or isinstance(value, FunctionType | type | ModuleType):
            return self._text(value)
        # One name of a function may stand for several imports.
        key = (id(owner), name, id(value))
        if key not in self._variables:
            self._variables[key] = (self._part("variable", name, lambda: self._text(value)), value)
        return self._variables[key][0]

    def _text(self, value: Any) -> str:
        """A value as text, the same in every process."""
        kind = type(value)
        if value is MISSING:
            return "nothing"
        if kind in _SCALARS:
            return f"{kind.__name__} {value!r}"
        if kind is int:
            return f"int {value:#x}" if value.bit_length() > 64 else f"int {value}"
        if kind is tuple:
            return self._texts(value)
        if kind is frozenset:
            return f"frozenset {sorted(map(value_text, value))}"
        if isinstance(value, np.generic):
            return self._array(np.asarray(value))
        if kind is CodeType:
            return self._code(value)
        _require_foreseen(value)
        if id(value) in self._met:
            return self._met[id(value)][0]
        text = self._by_name(value)
        if text:
            self._met[id(value)] = (text, value)
        elif isinstance(value, FunctionType):
            text = self._part("function", _name_of(value), lambda: self._function(value))
            self._met[id(value)] = (text, value)
        elif isinstance(value, type):
            text = self._part("class", _name_of(value), lambda: self._class(value))
            self._met[id(value)] = (text, value)
        else:
            self._met[id(value)] = (f"number {len(self._met)}", value)
            text = self._object(value, kind)
        return text

    def _texts(self, values: Iterable[Any]) -> str:
        return f"({', '.join(map(self._text, values))})"

    def _by_name(self, value: Any) -> str:
        """What is found under its name in an installed module, or what a module of the user's is."""
        if isinstance(value, ModuleType):
            return self._package(value) or self._module(value)
        if isinstance(value, FunctionType) and not self._is_of_package(value):
            return ""  # whatever name it was given
        for holder in (value, type(getattr(value, "__self__", None))):
            module = sys.modules.get(str(getattr(holder, "__module__", None)))
            if module is None:
                continue
            for attribute in ("__qualname__", "__name__"):
                path = getattr(value, attribute, None)
                if isinstance(path, str) and _found(module, path) is value:
                    known = self._package(module) or self._compiled(module)
                    if known:
                        return f"{path} of {known}"
        return ""

    def _package(self, module: ModuleType) -> str:
        """An installed module, whose package is a part by its version; empty for those of the user."""
        name = module.__name__
        top = name.partition(".")[0]
        if _is_pythons_own(module):
            return name
        version = _version(top) if top == "chebclear" or _is_installed(module) else None
        if version is not None:
            self.parts[f"package {top}"] = version
            return name
        return ""

    def _compiled(self, module: ModuleType) -> str:
        """A compiled module of the user's, which is a part by the bytes of its file."""
        file = vars(module).get("__file__")
        if not (file and file.endswith(tuple(importlib.machinery.EXTENSION_SUFFIXES))):
            return ""
        with open(file, "rb") as opened:
            self.parts[f"compiled {module.__name__}"] = hashlib.file_digest(opened, "sha256").hexdigest()[:16]
        return module.__name__

    def _module(self, module: ModuleType) -> str:
        """A module of the user's that is used as a whole."""

        def text() -> str:
            return repr(
                sorted(
                    (name, self._variable(vars(module), f"{_module_name(module.__name__)}.{name}", value))
                    for name, value in vars(module).items()
                    if name not in _OF_IMPORT
                )
            )

        return self._compiled(module) or self._part("module", _module_name(module.__name__), text)

    def _is_of_package(self, function: FunctionType) -> bool:
        """Whether a function was written in an installed module."""
        module = sys.modules.get(str(function.__globals__.get("__name__")))
        return module is not None and vars(module) is function.__globals__ and self._package(module) != ""

    def _function(self, function: FunctionType) -> str:
        around = function.__globals__
        parts = [self._code(function.__code__), self._text(function.__defaults__)]
        parts += [self._text(function.__kwdefaults__), self._text(vars(function))]
        if self._is_of_package(function):
            # One that an installed package has made, around functions of the user's perhaps.
            return repr([*parts, *map(self._text, enclosed(function).values())])
        for use in uses(function):
            name = ".".join(use.names)
            if use.names[-1] in _OF_IMPORT:
                continue
            if use.module is not None and self._package(use.module):
                text = self._of_package(use.value)
            elif use.module is not None:
                whole = f"{_module_name(use.module.__name__)}.{use.names[-1]}"
                text = self._variable(vars(use.module), whole, use.value)
            elif around.get(name, MISSING) is use.value:
                text = self._variable(
                    around, f"{_module_name(str(around.get('__name__')))}.{name}", use.value
                )
            else:
                text = self._variable(function, f"{_name_of(function)}: {name}", use.value)
            parts.append(f"{name}: {text}")
        return repr(parts)

    def _of_package(self, value: Any) -> str:
        """What stands in an installed module: known by the version, unless the user has replaced it."""
        _require_foreseen(value)
        kinds = (*_SCALARS, int, FunctionType, MethodType, functools.partial)
        own = not isinstance(value, ModuleType) and not self._by_name(type(value))
        return self._text(value) if own or type(value) in kinds or isinstance(value, type) else ""

    def _code(self, code: CodeType) -> str:
        if not _UNFORESEEN_NAMES.isdisjoint(code.co_names):
            raise UnknownValueError(
                f"{min(_UNFORESEEN_NAMES.intersection(code.co_names))} may reach anything"
            )
        return repr(
            (
                code.co_code.hex(),
                code.co_flags,
                (code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount),
                [self._text(one) for one in code.co_consts],
                (code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars),
                code.co_exceptiontable.hex(),
            )
        )

    def _class(self, given: type) -> str:
        name = _name_of(given)
        attributes = {
            key: self._variable(given, f"{name}.{key}", value)
            for key, value in vars(given).items()
            if key not in _NO_PART and getattr(value, "__objclass__", None) is not given
        }
        return repr([self._text(type(given)), self._texts(given.__bases__), sorted(attributes.items())])

    def _object(self, value: Any, kind: type) -> str:
        """An object by its class and its state."""
        if kind is set:
            return f"set {self._text(frozenset(value))}"
        if kind is list or kind is dict:
            return f"{kind.__name__} {self._texts(value if kind is list else value.items())}"
        if kind is np.ndarray:
            return self._array(value)
        if kind is MappingProxyType:
            return f"mappingproxy {self._text(dict(value))}"
        if kind in (property, staticmethod, classmethod):
            inner = (value.fget, value.fset, value.fdel) if kind is property else (value.__func__,)
            return f"{kind.__name__} {self._texts(inner)}"
        if isinstance(value, _MEMBERS):
            return f"{value.__name__} of {self._text(value.__objclass__)}"
        if isinstance(value, BuiltinFunctionType) and value.__self__ is not None:
            return f"{value.__name__} of {self._text(value.__self__)}"
        if isinstance(value, MethodType):
            return f"method {self._texts((value.__func__, value.__self__))}"
        if kind in _LOCKS:
            return kind.__name__
        if isinstance(value, functools._lru_cache_wrapper):
            return f"cache {self._text(vars(value))}"
        return f"{self._text(kind)} {self._state(value, kind)}"

    def _state(self, value: Any, kind: type) -> str:
        """The state of an object, as it would be copied, and all attributes of one of the user's classes."""
        if isinstance(value, ctypes.CDLL):
            raise UnknownValueError(f"a {kind.__qualname__} leads to compiled code")
        own: list[Any] = []
        module = sys.modules.get(kind.__module__)
        if module is not None and self._package(module):
            for name, one in vars(module).items():
                if one is value:  # as the distributions of SciPy
                    return f"{name} of {module.__name__}"
        try:
            if not self._by_name(kind):  # its class may copy less
                bases = [base for base in _BASES if isinstance(value, base)]
                own = [object.__getstate__(value), *(base(value) for base in bases)]
            reduce = copyreg.dispatch_table.get(kind)
            found = reduce(value) if reduce else value.__reduce_ex__(4)
        except Exception as error:
            raise UnknownValueError(f"a {kind.__qualname__} cannot be compared ({error})") from None
        if isinstance(found, str):
            module = sys.modules.get(pickle.whichmodule(value, found))  # type: ignore[attr-defined,unused-ignore]
            if module is None or _found(module, found) is not value:
                raise UnknownValueError(f"a {kind.__qualname__} cannot be compared")
            place = self._package(module) or self._compiled(module)
            if not place and not own and kind.__module__ != "typing":
                raise UnknownValueError(f"a {kind.__qualname__} cannot be compared")
            return f"{found} of {place or _module_name(module.__name__)} {self._texts(own)}"
        make, arguments, state, items, pairs = (*found, None, None, None)[:5]
        return self._texts([make, arguments, state, [*(items or ())], [*(pairs or ())], own])

    def _array(self, array: np.ndarray[Any, Any]) -> str:
        self._package(np)  # whose methods it has
        if array.dtype.names:
            content = ", ".join(f"{name} {self._array(array[name])}" for name in array.dtype.names)
        elif array.dtype.hasobject:
            content = self._texts(array.ravel().tolist())
        else:
            content = hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:32]
            if array.ndim == 0:
                content = repr(array.item())
        return f"array {array.dtype.str} {array.shape} {content}"


def _require_foreseen(value: Any) -> None:
    if any(value is one for one in _UNFORESEEN):
        name = getattr(value, "__qualname__", "sys.modules")
        raise UnknownValueError(f"{name} may reach anything")


def _found(module: ModuleType, path: str) -> Any:
    found: Any = module
    for name in path.split("."):
        found = getattr(found, name, MISSING)
    return found


def _name_of(value: Any) -> str:
    return f"{_module_name(str(value.__module__))}.{value.__qualname__}"


def _module_name(name: str) -> str:
    """The name under which others import the module; a script is known by its file."""
    if name not in ("__main__", "__mp_main__"):
        return name
    main = sys.modules["__main__"]
    if getattr(main, "__spec__", None) is not None:
        return str(main.__spec__.name)  # type: ignore[union-attr]
    return Path(getattr(main, "__file__", None) or name).stem


def _is_pythons_own(module: ModuleType) -> bool:
    """Told by its folder: modules of users may have names of Python's."""
    file = vars(module).get("__file__")
    if file is None:
        return module.__name__ in sys.builtin_module_names or module.__name__.startswith("_frozen")
    return _STANDARD in Path(file).resolve().parents and _INSTALLED.isdisjoint(Path(file).parts)


def _is_installed(module: ModuleType) -> bool:
    """Whether a module is in a folder of installed packages."""
    places = [vars(module).get("__file__") or "", *vars(module).get("__path__", ())]
    return any(not _INSTALLED.isdisjoint(Path(place).parts) for place in places)


@functools.cache
def _version(top: str) -> str | None:
    """Versions of the packages that a module belongs to; None if it belongs to none."""
    if top == "chebclear":
        return f"{package_version()}, core {code_version()}"
    from importlib import metadata  # which reads e-mail

    found = sorted({f"{name} {metadata.version(name)}" for name in _distributions().get(top, ())})
    return ", ".join(found) or None


@functools.cache
def _distributions() -> dict[str, list[str]]:
    from importlib import metadata

    return dict(metadata.packages_distributions())


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:16]
