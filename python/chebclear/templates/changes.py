"""Changes of single values of a scene file by name, such as ``joints.wrist.clearance``."""

from __future__ import annotations

import copy
import tomllib
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from ..base.shown import did_you_mean
from ..base.units import misfit, unit_of_quantity
from ..errors import Problem, SceneError
from ..scene.distributions import FILE_KEYS
from ..scene.scene import Scene
from .toml_text import Path

SECTIONS = (
    *("format", "title", "parameters", "features", "requirements", "costs", "run"),
    *(item.name for item in fields(Scene)),
)
"""What may stand at the top of a scene file."""
# What distinguishes the entries of a list: starts name the joint or body that they are of.
_NAMES = ("name", "joint", "body")
# Keys of a parameter whose values have another unit than it, or none.
_PLAIN = (
    *("rel", "fit", "distribution", "unit", "note"),
    *(name for name, key in FILE_KEYS.items() if key.holds not in ("value", "values")),
)


def changed(values: Mapping[str, Any], changes: Mapping[str, Any]) -> tuple[dict[str, Any], list[Path]]:
    """A copy of the plain values of a scene file with some of them replaced, and the paths of these.

    New values are given by name: that of a parameter, or the way to a value, such as ``"run.duration"`` or
    ``"joints.wrist.clearance"``, on which entries of lists go by their names or numbers. Texts are read as
    TOML if they are that, and are quantities and expressions otherwise. A SceneError has every name that
    leads nowhere.
    """
    result = copy.deepcopy(dict(values))
    problems: list[Problem] = []
    paths: list[Path] = []
    for name, value in changes.items():
        try:
            paths.append(_change(result, name, _read(value) if isinstance(value, str) else value))
        except LookupError as error:
            problems.append(Problem(name, str(error.args[0])))
    if problems:
        raise SceneError(problems)
    return result, paths


def _read(text: str) -> Any:
    try:
        values = tomllib.loads(f"value = {text}")
    except (tomllib.TOMLDecodeError, RecursionError):
        return text
    return values["value"] if values.keys() == {"value"} else text


def _change(values: dict[str, Any], name: str, value: Any) -> Path:
    words = name.split(".")
    parameters = values.get("parameters", {})
    if words[0] not in SECTIONS and isinstance(parameters, Mapping):
        if words[0] not in parameters:
            hint = did_you_mean(words[0], (*parameters, *SECTIONS))
            raise LookupError(f'there is no parameter and no section "{words[0]}"{hint}')
        words = ["parameters", *words]
    if words[0] == "parameters" and len(words) > 1:
        _keep_dimension(parameters, words, value)
        _open_parameter(parameters, words, value)
    holder: Any = values
    path: Path = ()
    for word in words[:-1]:
        key = _key(holder, word, path)
        if isinstance(holder, dict):
            holder = holder.setdefault(key, {})
        else:
            holder = holder[key]
        path = (*path, key)
    key = _key(holder, words[-1], path)
    holder[key] = value
    return (*path, key)


def _keep_dimension(parameters: Any, words: list[str], value: Any) -> None:
    """Refuse a quantity of another dimension than the parameter has in the file."""
    held = parameters.get(words[1]) if isinstance(parameters, Mapping) else None
    own = unit_of_quantity(value) if isinstance(value, str) and words[-1] not in _PLAIN else ""
    if own and (wrong := misfit(own, written_unit(held))):
        raise LookupError(f'"{value}" {wrong}')


def written_unit(held: Any) -> str:
    """The unit in which a parameter of a file is written; empty if it is in none."""
    if isinstance(held, Mapping):
        if "unit" in held:
            return str(held["unit"])
        if "fit" in held:
            return "um"
        keys = ("nominal", "limits", *(name for name, key in FILE_KEYS.items() if key.gives_interval))
        held = next((held[key] for key in keys if key in held), "")
        held = held[0] if isinstance(held, list) and held else held
    return unit_of_quantity(held) if isinstance(held, str) else ""


def _open_parameter(parameters: Any, words: list[str], value: Any) -> None:
    """Let a new number be the nominal value of a table, and a bare number grow into one."""
    held = parameters.get(words[1]) if isinstance(parameters, Mapping) else None
    if isinstance(held, Mapping) and len(words) == 2 and not isinstance(value, Mapping):
        words.append("nominal")
    elif held is not None and not isinstance(held, Mapping) and len(words) > 2:
        parameters[words[1]] = {"nominal": held}


def _key(holder: Any, word: str, path: Path) -> str | int:
    """How what a word means is found in a table or a list."""
    if isinstance(holder, dict):
        return word
    if not isinstance(holder, list):
        raise LookupError(f'"{path[-1]}" is a single value: it has no "{word}"')
    names: dict[str, int] = {}
    for index, entry in enumerate(holder):
        if isinstance(entry, Mapping):
            name = next((entry[key] for key in _NAMES if isinstance(entry.get(key), str)), None)
            names.setdefault(str(index) if name is None else name, index)
    if word in names:
        return names[word]
    if word.isascii() and word.isdecimal() and int(word) < len(holder):
        return int(word)
    known = did_you_mean(word, names) or f"; there are {', '.join(names) or 'none'}"
    raise LookupError(f'{".".join(map(str, path))} has no "{word}"{known}')
