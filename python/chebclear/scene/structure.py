"""A scene as its structure, which the scenes of a study share, and its numbers.

The core reads a structure once and many scenes from it. The order of the numbers is that of the fields.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import itertools
import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from .parts import ClearanceRevolute
from .scene import Scene
from .schema import Part, Points

Path = Sequence[str | int]


class FlatScene(NamedTuple):
    """A scene for the core."""

    structure: str
    """JSON of the scene with the index of each number in its place."""
    numbers: bytes
    """The numbers as floats of this machine, one after the other."""
    branch: tuple[int, ...] = ()
    """Signs of the branch on which it must be assembled, see `Inspection`; empty if any will do."""


class Structure:
    """Everything of a scene that is no number: parts, names, connections, laws.

    Parameters
    ----------
    scene : Scene
        One of the scenes.

    Raises
    ------
    SceneError
        If a field has the wrong type.
    """

    def __init__(self, scene: Scene) -> None:
        scene.to_json()
        count = itertools.count()
        self._plain = _numbered(scene, count)
        self.text = json.dumps(self._plain)
        self.count = next(count)
        """Numbers of a scene."""
        self.fingerprint = hashlib.sha256(self.text.encode()).hexdigest()[:16]
        """What distinguishes it from other structures."""
        joints = zip(scene.joints, self._plain["joints"], strict=True)
        self.clearances: dict[str, int] = {
            joint.name: plain["clearance"] for joint, plain in joints if isinstance(joint, ClearanceRevolute)
        }
        """Index of the clearance of each joint with clearance, by name."""

    def index(self, path: Path) -> int:
        """Index of the number that stands at a path, such as ``("bodies", 0, "mass")``."""
        found: Any = self._plain
        for name in path:
            found = found[name]
        assert isinstance(found, int), path
        return found


@runtime_checkable
class ManyScenes(Protocol):
    """A callable that returns scenes and knows the numbers of many of them at once, as templates do."""

    def scene_numbers(
        self,
        structure: Structure,
        like: Sequence[float],
        values: Mapping[str, NDArray[np.float64]],
        fixed: Mapping[str, Any],
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Numbers of the scenes with these values, and which must be asked for one by one."""


class Structures:
    """The structures of the scenes of a study: one, unless parts come and go with the parameters."""

    def __init__(self) -> None:
        self._known: dict[tuple[Any, ...], Structure] = {}

    def __len__(self) -> int:
        return len(self._known)

    def flat(self, scene: Scene) -> tuple[Structure, list[float]]:
        """A scene as its structure and its numbers.

        Raises
        ------
        SceneError
            If a field has the wrong type.
        """
        shape: list[Any] = []
        numbers: list[float] = []
        _flatten(scene, shape, numbers)
        key = tuple(shape)
        try:
            structure = self._known.get(key)
        except TypeError:  # a field that cannot be hashed has a wrong type, which the structure reports
            structure = None
        if structure is None:
            structure = Structure(scene)
            assert structure.count == len(numbers)
            self._known[key] = structure
        return structure, numbers


def packed(numbers: Sequence[float]) -> bytes:
    """Numbers as the core takes them."""
    return struct.pack(f"{len(numbers)}d", *numbers)


@functools.cache
def _names(part: Any) -> tuple[str, ...]:
    return tuple(item.name for item in dataclasses.fields(part))


_PAIR = float, float


def _flatten(part: Part, shape: list[Any], numbers: list[float]) -> None:
    """Append the numbers of a record, and to `shape` all else, with a mark where each number stands.

    Records with the same shape have the same structure: what is no number is there as it is, and every list
    comes with its length.
    """
    shape.append(type(part))
    fields = vars(part)
    for name in _names(type(part)):  # type: ignore[arg-type]  # a class has another hash
        value = fields[name]
        kind = type(value)
        if kind is float:
            numbers.append(value)
            shape.append(float)
        elif kind is str:
            shape.append(value)
        else:
            _flatten_other(value, shape, numbers)


def _flatten_other(value: Any, shape: list[Any], numbers: list[float]) -> None:
    if type(value) is tuple and len(value) == 2 and type(value[0]) is type(value[1]) is float:
        numbers += value
        shape.append(_PAIR)
    elif type(value) is tuple:
        shape += (tuple, len(value))
        for item in value:
            if type(item) is float:
                numbers.append(item)
                shape.append(float)
            else:
                _flatten_other(item, shape, numbers)
    elif type(value) is Points:
        shape += (Points, *value)
        _flatten_other(tuple(value.values()), shape, numbers)
    elif isinstance(value, Part):
        _flatten(value, shape, numbers)
    else:
        shape.append(value)


def _numbered(value: Any, count: Iterator[int]) -> Any:
    """A record without wrong types as JSON has it, with the next index in the place of each number."""
    if type(value) is float:
        return next(count)
    if isinstance(value, Part):
        tag = {} if value._tag is None else {value._tag[0]: value._tag[1]}
        return tag | {name: _numbered(getattr(value, name), count) for name in _names(type(value))}  # type: ignore[arg-type]
    if isinstance(value, Points):
        return {name: _numbered(position, count) for name, position in value.items()}
    if isinstance(value, tuple):
        return [_numbered(item, count) for item in value]
    return value
