"""Records of the scene and their JSON: the annotations of a record's fields are its schema.

A record converts its fields when it is made (numbers and texts with units become floats, pairs and lists
become tuples) and never raises: values of a wrong type are kept and reported together with all other
problems, with their paths, when the record is written.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ClassVar, Self, TypeAlias, TypeVar

import numpy as np

from ..base.arguments import as_number
from ..base.named import ReadOnlyDict
from ..base.options import PARAMETERS, parameters_of
from ..base.shown import did_you_mean, meant_or_known
from ..base.units import UnitError, convert, is_quantity, why_not
from ..errors import Problem, UnknownKey

Vector: TypeAlias = tuple[float, float]
Numbers: TypeAlias = Sequence[float]
T = TypeVar("T")

# Annotations of plain values, as they are written in the records.
_NUMBERS = ("float", "float | None")
_TRUTH = "bool"
_VECTOR = "Vector"
_POINTS = "Mapping[str, Vector]"
_CONSTANTS = "Mapping[str, float]"
_LIST = "Numbers"
# A number, or a record in its place.
_EITHER = "float | "

_FIELD_AS_POWER = re.compile(r"\^([a-z_]+)$")
# A unit, or the record and its field that have it: it is looked up where a text stands there.
_Unit: TypeAlias = "str | tuple[Part, dataclasses.Field[Any]]"
_Conversion: TypeAlias = Callable[[Any, _Unit], Any]

# Types of numbers that are neither looked at as arrays nor asked whether they are booleans.
_PLAIN = frozenset({float, int})

_NOT_FINITE = {"NaN": math.nan, "Infinity": math.inf, "-Infinity": -math.inf}


class Named(ReadOnlyDict[str, T]):
    """Values with names of the user, which do not change, so that records that contain them can be hashed."""

    def __init__(self, items: Mapping[str, Any]) -> None:
        super().__init__({name: self._converted(value) for name, value in dict(items).items()})

    @staticmethod
    def _converted(value: Any) -> Any:
        """A value in its type, or as it is if it cannot be."""
        return value

    @property
    def _items(self) -> Self:
        return self  # as the core asks for them

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(frozenset(self.items()))


class Points(Named[Vector]):
    """Positions [m] by name."""

    @staticmethod
    def _converted(value: Any) -> Any:
        return _as_vector(value, "m")


class Constants(Named[float]):
    """Numbers by name."""

    @staticmethod
    def _converted(value: Any) -> Any:
        return _as_float(value, "unit")


class Part:
    """Base of the records; a subclass is a frozen dataclass."""

    _tag: ClassVar[tuple[str, str] | None] = None
    """The JSON key and word that distinguish this class from its alternatives."""
    __match_args__: ClassVar[tuple[str, ...]]
    """Names of the fields, in their order; a dataclass has them."""
    _choices: ClassVar[Mapping[str, tuple[type[Part], ...]]] = {}
    """For each field that holds other records, or a sequence of them, their classes."""

    def __init_subclass__(cls) -> None:
        # Inherited fields are documented first, as they are the first arguments.
        entries = ["\n".join(lines) for _, lines in parameters_of(cls.__bases__[0].__doc__ or "")]
        if entries and cls.__doc__:
            text, _, own = inspect.cleandoc(cls.__doc__).partition(PARAMETERS)
            cls.__doc__ = "\n".join([f"{text.rstrip()}\n\n{PARAMETERS}{entries[0]}", *entries[1:], own])

    def __post_init__(self) -> None:
        # Nearly all values are as they should be; studies make thousands of scenes. What is frozen is set in
        # its dictionary, which costs half of what `object.__setattr__` does.
        values = vars(self)
        for item, in_type in _conversions(type(self)):  # type: ignore[arg-type]  # a class has another hash
            value = values[item.name]
            if type(value) is not float:
                converted = in_type(value, (self, item))
                if converted is not value:
                    values[item.name] = converted

    @classmethod
    def _unit_of(cls, item: dataclasses.Field[Any], values: Mapping[str, Any]) -> str:
        """Unit of a field beside the values of all; ``"unit"`` where there may be any.

        One whose power is another field, such as N/m^exponent, has the number that is given there.
        """
        unit = str(item.metadata.get("unit", "unit"))
        power = _FIELD_AS_POWER.search(unit)
        if power is None or power[1] not in values:
            return unit
        number = as_number(values[power[1]])
        # An expression there may stand for any number.
        return "unit" if number is None else f"{unit[: power.start()]}^{number!r}"


def _fields(part: type[Part]) -> tuple[dataclasses.Field[Any], ...]:
    return dataclasses.fields(part)  # type: ignore[arg-type]


@functools.cache
def _conversions(part: Any) -> tuple[tuple[dataclasses.Field[Any], _Conversion], ...]:
    """The fields of a record that may need it, with what puts a value into the type of the annotation."""
    found = ((item, _conversion_of(str(item.type))) for item in _fields(part))
    return tuple((item, convert) for item, convert in found if convert is not None)


def _is_flat(value: Any) -> bool:
    try:
        return np.ndim(value) == 1
    except ValueError:  # lists among the numbers
        return False


def _as_vector(value: Any, unit: _Unit) -> Any:
    if type(value) is tuple:
        if len(value) == 2:  # nearly always
            x, y = value
            if type(x) is type(y) is float:
                return value
            if type(x) in _PLAIN and type(y) in _PLAIN:
                return as_number(x), as_number(y)
        elif set(map(type, value)) == {float}:
            return value
    if not isinstance(value, (list, tuple, range, np.ndarray)) or not _is_flat(value):
        return value
    return tuple(_as_float(item, unit) for item in value)


def _text_of(unit: _Unit) -> str:
    return unit if isinstance(unit, str) else unit[0]._unit_of(unit[1], vars(unit[0]))


def _as_float(value: Any, unit: _Unit) -> Any:
    """A number or a quantity in SI units; anything else as it is, to be reported when a record is written."""
    if isinstance(value, str) and is_quantity(value):
        try:
            return convert(value, _text_of(unit))
        except UnitError:
            return value
    number = as_number(value)
    return value if number is None else number


def _as_named(kind: type[Named[Any]], value: Any, unit: _Unit) -> Any:
    # Asked of an abstract class alone, it costs a microsecond.
    return kind(value) if type(value) is not kind and isinstance(value, (dict, Mapping)) else value


def _as_tuple(value: Any, unit: _Unit) -> Any:
    if isinstance(value, (tuple, list)):
        return tuple(value)
    return tuple(value) if isinstance(value, Iterable) and not isinstance(value, (str, Mapping)) else value


def _conversion_of(annotation: str) -> _Conversion | None:
    """What gives a value the type that the annotation asks for, or leaves it if it cannot be."""
    if annotation in _NUMBERS or annotation.startswith(_EITHER):
        return _as_float
    if annotation in (_VECTOR, _LIST):
        return _as_vector
    if annotation == _POINTS:
        return functools.partial(_as_named, Points)
    if annotation == _CONSTANTS:
        return functools.partial(_as_named, Constants)
    return _as_tuple if annotation.startswith("Sequence") else None


def write(part: Any, accepted: tuple[type[Part], ...], path: str, problems: list[Problem]) -> Any:
    """A record as JSON values; wrong types are added to `problems`, and placeholders written for them."""
    if not isinstance(part, accepted):
        names = " or ".join(choice.__name__ for choice in accepted)
        problems.append(Problem(path or "scene", f"must be a {names}, got {part!r}"))
        return None
    plain: dict[str, Any] = {} if part._tag is None else {part._tag[0]: part._tag[1]}
    for item in _fields(type(part)):
        where, value = join(path, item.name), getattr(part, item.name)
        choices = part._choices.get(item.name)
        plain[item.name] = (
            _write_value(value, str(item.type), where, problems, (part, item))
            if choices is None
            else _write_records(value, str(item.type), choices, where, problems, (part, item))
        )
    return plain


def _write_records(
    value: Any,
    annotation: str,
    accepted: tuple[type[Part], ...],
    path: str,
    problems: list[Problem],
    unit: _Unit,
) -> Any:
    if value is None and annotation.endswith("| None"):
        return None
    if annotation.startswith(_EITHER) and not isinstance(value, Part):
        names = " or ".join(choice.__name__ for choice in accepted)
        return _write_number(value, path, problems, unit, f"a number or a {names}")
    if not annotation.startswith("Sequence"):
        return write(value, accepted, path, problems)
    if isinstance(value, tuple):
        return [write(item, accepted, f"{path}[{index}]", problems) for index, item in enumerate(value)]
    problems.append(Problem(path, f"must be a sequence, got {value!r}"))
    return []


def _write_value(value: Any, annotation: str, path: str, problems: list[Problem], unit: _Unit) -> Any:
    if value is None and annotation.endswith("| None"):
        return None
    if annotation in _NUMBERS:
        return _write_number(value, path, problems, unit)
    if annotation == _VECTOR:
        return _write_vector(value, path, problems, unit)
    kind, wanted, empty = _KINDS[annotation.removesuffix(" | None")]
    if not isinstance(value, kind) or (
        isinstance(value, Named) and not all(isinstance(name, str) for name in value)
    ):
        problems.append(Problem(path, f"must be {wanted}, got {value!r}"))
        return empty()
    if isinstance(value, tuple):
        return [_write_number(item, f"{path}[{index}]", problems, unit) for index, item in enumerate(value)]
    if isinstance(value, Named):
        item_of = _write_vector if annotation == _POINTS else _write_number
        own = "m" if annotation == _POINTS else "unit"
        return {name: item_of(value[name], join(path, name), problems, own) for name in value}
    return empty(value)


# Type of a value that is no number and no vector, its words, and what makes its placeholder.
_KINDS: dict[str, tuple[type, str, Callable[..., Any]]] = {
    _POINTS: (Points, "a mapping of names to positions", dict),
    _CONSTANTS: (Constants, "a mapping of names to numbers", dict),
    _LIST: (tuple, "a sequence of numbers", list),
    _TRUTH: (bool, "True or False", bool),
    "str": (str, "a text", str),
}


def _write_vector(value: Any, path: str, problems: list[Problem], unit: _Unit) -> list[float | str]:
    if not isinstance(value, tuple) or len(value) != 2:
        problems.append(Problem(path, f"must be a pair of numbers (x, y), got {value!r}"))
        return ["NaN", "NaN"]
    return [_write_number(item, f"{path}[{index}]", problems, unit) for index, item in enumerate(value)]


def _write_number(
    value: Any, path: str, problems: list[Problem], unit: _Unit, wanted: str = "a number"
) -> float | str:
    if not isinstance(value, float):
        problems.append(Problem(path, f"must be {wanted}, got {value!r}{why_not(value, _text_of(unit))}"))
        return "NaN"
    written: float | str = as_json_number(value)
    return written


def as_json_number(value: Any) -> Any:
    """A value for the core, with words for numbers that are not finite, which JSON does not have."""
    if not isinstance(value, float) or math.isfinite(value):
        return value
    return "NaN" if math.isnan(value) else "Infinity" if value > 0.0 else "-Infinity"


def read(plain: Any, accepted: tuple[type[Part], ...], path: str, problems: list[Problem]) -> Any:
    """The record that `write` wrote.

    Missing and unknown fields are added to `problems`; values of wrong type are reported by `write`.
    """
    if not isinstance(plain, dict):
        problems.append(Problem(path or "scene", f"must be an object, got {plain!r}"))
        return None
    left = dict(plain)
    part = accepted[0]
    if part._tag is not None:
        key = part._tag[0]
        words = {choice._tag[1]: choice for choice in accepted if choice._tag is not None}
        word = left.pop(key, None)
        if not isinstance(word, str) or word not in words:
            known = ", ".join(f'"{choice}"' for choice in words)
            missing = "is missing: "
            if word is not None:
                missing, known = "", f"{known}, got {word!r}{did_you_mean(word, words)}"
            problems.append(Problem(join(path, key), f"{missing}must be one of {known}"))
            return None
        part = words[word]
    before = len(problems)
    values: dict[str, Any] = {}
    for item in _fields(part):
        where = join(path, item.name)
        if item.name in left:
            value = left.pop(item.name)
            choices = part._choices.get(item.name)
            values[item.name] = (
                _read_value(value, str(item.type))
                if choices is None
                else _read_records(value, str(item.type), choices, where, problems)
            )
        elif item.default is dataclasses.MISSING and item.default_factory is dataclasses.MISSING:
            problems.append(Problem(where, f"is missing{_meaning(part, item.name)}"))
    names = [item.name for item in _fields(part)]
    problems += [UnknownKey(join(path, name), f"unknown field{meant_or_known(name, names)}") for name in left]
    return part(**values) if len(problems) == before else None


def _meaning(part: type[Part], name: str) -> str:
    """The first sentence on a field, to follow the problem that it is missing."""
    words = descriptions(part).get(name, "").partition(". ")[0].rstrip(".").replace("`", "")
    return f": {words[0].lower()}{words[1:]}" if words else ""


def descriptions(part: type[Any]) -> dict[str, str]:
    """What the docstring says of each parameter."""
    entries = parameters_of(part.__doc__ or "")
    return {name: " ".join(line.strip() for line in lines[1:]) for names, lines in entries for name in names}


def _read_records(
    plain: Any, annotation: str, accepted: tuple[type[Part], ...], path: str, problems: list[Problem]
) -> Any:
    if plain is None and annotation.endswith("| None"):
        return None
    if annotation.startswith(_EITHER) and not isinstance(plain, dict):
        return _read_value(plain, "float")
    if annotation.endswith("| str") and isinstance(plain, str):
        return plain
    if not annotation.startswith("Sequence"):
        return read(plain, accepted, path, problems)
    if isinstance(plain, list):
        return [read(item, accepted, f"{path}[{index}]", problems) for index, item in enumerate(plain)]
    problems.append(Problem(path, f"must be a list, got {plain!r}"))
    return []


def _read_value(plain: Any, annotation: str) -> Any:
    if annotation in _NUMBERS and isinstance(plain, str):
        return _NOT_FINITE.get(plain, plain)
    if annotation in (_VECTOR, _LIST) and isinstance(plain, list):
        return [_read_value(item, "float") for item in plain]
    if annotation == _POINTS and isinstance(plain, dict):
        return {name: _read_value(item, _VECTOR) for name, item in plain.items()}
    if annotation == _CONSTANTS and isinstance(plain, dict):
        return {name: _read_value(item, "float") for name, item in plain.items()}
    return plain


def join(path: str, name: str) -> str:
    """Path of a field of the record at `path`."""
    return f"{path}.{name}" if path else name


def at_or_below(path: str, other: str) -> bool:
    """Whether a path is the other one or a part of it; ``a[10]`` is no part of ``a[1]``."""
    return path == other or path.startswith((f"{other}.", f"{other}["))
