"""A JSON Schema of scene files, for editors that complete and check text as it is typed.

It is made from the dataclasses of the scene, so that it cannot differ from what `load` reads. Draft 4 with
plain keywords only: the TOML editors know no newer one.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from dataclasses import MISSING, Field, fields
from typing import Any

from ...run.features import KINDS
from ...run.settings import METHODS
from ...scene.distributions import FILE_KEYS
from ...scene.scene import Scene
from ...scene.schema import Part, descriptions
from ..parameters import DISTRIBUTIONS
from ..reader import FORMAT
from ..run_table import UNITS

_TEXT = {"type": "string"}


def scene_file_schema() -> dict[str, Any]:
    """The schema as plain values; ``chebclear/templates/scene.schema.json`` holds it."""
    definitions = {part.__name__: _record(part) for part in records(Scene)}
    scene = definitions.pop("Scene")
    head = {
        "format": {"description": "Number of the file format.", "enum": [FORMAT]},
        "title": {"description": "Name of the mechanism, for people.", **_TEXT},
        "parameters": {
            "description": "Named numbers that expressions use.",
            "type": "object",
            "additionalProperties": {"anyOf": [_number("the parameter"), PARAMETER]},
        },
        "features": {
            "description": "Numbers of the continuous motion by name, such as 'peak(wrist.normal_force)'.",
            "type": "object",
            "additionalProperties": {"type": "string", "pattern": f"^ *({'|'.join(KINDS)}) *\\(.+\\) *$"},
        },
        "requirements": {
            "description": "Limits that outputs and features must keep to, by name.",
            "type": "object",
            "additionalProperties": REQUIREMENT,
        },
        "costs": {
            "description": "What tolerances of parameters cost, by name.",
            "type": "object",
            "additionalProperties": {"anyOf": [COST, CATALOG]},
        },
        "run": {
            "description": "Settings of runs and studies.",
            "type": "object",
            "additionalProperties": False,
            "properties": {name: _number(f"{name} [{unit}]") for name, unit in UNITS.items()}
            | {"method": {"enum": list(METHODS)}, "outputs": {"type": "array", "items": _TEXT}},
        },
    }
    return {
        "$schema": "http://json-schema.org/draft-04/schema#",
        "title": "chebclear scene file",
        "type": "object",
        "additionalProperties": False,
        "required": scene["required"],
        "properties": head | scene["properties"],
        "definitions": {"number": {"type": ["number", "string"]}, **definitions},
    }


def records(part: type[Part]) -> Iterator[type[Part]]:
    """A record and all that it may hold, each as often as it may be held."""
    yield part
    for choices in part._choices.values():
        for choice in choices:
            yield from records(choice)


def _number(description: str) -> dict[str, Any]:
    written = "a number in SI units, a quantity such as '20 um', or an expression"
    return {"description": f"{description.rstrip('.')}: {written}", "type": ["number", "string"]}


REQUIREMENT_WORDS = {
    "of": "name of an output or a feature",
    "above": "lower limit",
    "below": "upper limit",
    "at": "when alone it must be kept: an instant [s], or a crank angle such as '90 deg'",
    "joint": "joint of the crank, if it is not that of the only drive",
}
REQUIREMENT: dict[str, Any] = {
    "type": "object",
    "additionalProperties": False,
    "required": ["of"],
    "properties": {
        name: {"description": words, **_TEXT} if name in ("of", "joint") else _number(words)
        for name, words in REQUIREMENT_WORDS.items()
    },
}
COST: dict[str, Any] = {
    "description": "the cost as an expression of tolerance, in SI units, such as '3 + 2e-5 / tolerance'",
    **_TEXT,
}
CATALOG: dict[str, Any] = {
    "description": "costs by tolerance, such as '20 um', or by ISO grade, such as IT7",
    "type": "object",
    "additionalProperties": {"type": ["number", "string"]},
}
PARAMETER_WORDS = {
    "nominal": "nominal value",
    "rel": "half-width of the interval over the nominal value [-]",
    "plus": "how far the value may lie above nominal",
    "minus": "how far the value may lie below nominal",
    "limits": "lower and upper limit",
    "fit": "ISO fit of the bearing and its journal, such as '25 H7/f6': the radial clearance",
    "distribution": "how often the values in the interval occur: "
    + "; ".join(kind.in_words for kind in DISTRIBUTIONS.values()),
    **{name: key.meaning for name, key in FILE_KEYS.items()},
    "unit": "unit for tables and pictures",
    "note": "what it is, or where its value comes from",
}
_OF_DISTRIBUTIONS: dict[str, Any] = {
    "values": {"type": "array", "items": _number("a value"), "minItems": 1},
    "count": {"type": "integer"},
    "yes or no": {"type": "boolean"},
}
_PARAMETER_TYPES: dict[str, Any] = {
    **{
        name: _OF_DISTRIBUTIONS[key.holds]
        for name, key in FILE_KEYS.items()
        if key.holds in _OF_DISTRIBUTIONS
    },
    "limits": {"type": "array", "items": _number("a limit"), "minItems": 2, "maxItems": 2},
    "fit": _TEXT,
    "distribution": {"enum": list(DISTRIBUTIONS)},
    "unit": _TEXT,
    "note": _TEXT,
}
PARAMETER: dict[str, Any] = {
    "type": "object",
    "additionalProperties": False,
    "properties": {
        name: {"description": words, **_PARAMETER_TYPES[name]} if name in _PARAMETER_TYPES else _number(words)
        for name, words in PARAMETER_WORDS.items()
    },
}


def _record(part: type[Part]) -> dict[str, Any]:
    words = descriptions(part)
    items = fields(part)  # type: ignore[arg-type]
    properties = {item.name: _property(part, item, words.get(item.name, "")) for item in items}
    required = [item.name for item in items if item.default is MISSING and item.default_factory is MISSING]
    if part._tag is not None:
        properties = {part._tag[0]: {"enum": [part._tag[1]]}, **properties}
        required = [part._tag[0], *required]
    return {
        "description": summary(part),
        "type": "object",
        "additionalProperties": False,
        "required": required,
        "properties": properties,
    }


def _property(part: type[Part], item: Field[Any], words: str) -> dict[str, Any]:
    property = _filled(part, item, words)
    if not str(item.type).endswith("| None"):
        return property
    # Scenes in JSON write null where nothing is given; TOML leaves it out.
    if "anyOf" in property:
        return property | {"anyOf": [*property["anyOf"], {"type": "null"}]}
    types = property["type"] if isinstance(property["type"], list) else [property["type"]]
    return property | {"type": [*types, "null"]}


def _filled(part: type[Part], item: Field[Any], words: str) -> dict[str, Any]:
    annotation = str(item.type)
    numbers = {"type": "array", "items": {"$ref": "#/definitions/number"}}
    pair = {**numbers, "minItems": 2, "maxItems": 2}
    choices = part._choices.get(item.name)
    said = {"description": words}
    if choices is not None:
        records = [{"$ref": f"#/definitions/{choice.__name__}"} for choice in choices]
        one: dict[str, Any] = {"anyOf": records} if len(records) > 1 else records[0]
        if annotation.startswith("Sequence"):
            return said | {"type": "array", "items": one}
        plain = [_number(words)] if annotation.startswith("float") else []
        text = [said | _TEXT] if annotation.endswith("| str") and not plain else []
        return said | {"anyOf": [*records, *plain, *text]}
    if annotation.startswith("float"):
        return _number(words)
    if annotation == "Vector":
        return said | pair
    if annotation == "Numbers":
        return said | numbers
    if annotation == "bool":
        return said | {"type": "boolean"}
    if annotation == "Mapping[str, float]":
        return said | {"type": "object", "additionalProperties": {"$ref": "#/definitions/number"}}
    if annotation.startswith("Mapping"):
        return said | {"type": "object", "additionalProperties": pair}
    words_of_field = accepted_words(part).get(item.name)
    return said | (_TEXT if words_of_field is None else {"type": "string", "enum": list(words_of_field)})


def summary(part: type[Any]) -> str:
    """The first line of the docstring of a record."""
    return inspect.cleandoc(part.__doc__ or "").split("\n")[0]


def accepted_words(part: type[Any]) -> dict[str, tuple[str, ...]]:
    """The words of the fields that accept no others, as the docstring lists them in braces."""
    found = re.findall(r"^(\w+) : \{(.*?)\}", inspect.cleandoc(part.__doc__ or ""), re.MULTILINE)
    return {name: tuple(re.findall(r'"(\w+)"', words)) for name, words in found}
