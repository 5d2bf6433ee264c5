"""A scene as its structure, which the scenes of a study share, and its numbers.

The core reads a structure once and many scenes from it. The order of the numbers is that of the fields.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .scene import Scene
from .schema import Constants, Named, Part, Points

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
    """Everything of a scene that is no number: parts, names, connections, laws."""

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
            joint.name: plain["clearance"] for joint, plain in joints if "clearance" in plain
        }
        """Index of the clearance of each joint with clearance, by name."""

    def clearances_in(self, numbers: bytes) -> dict[str, float]:
        """Clearance of each joint with clearance in a scene with these numbers [m]."""
        return {name: struct.unpack_from("d", numbers, 8 * k)[0] for name, k in self.clearances.items()}

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

    def flat(self, scene: Scene) -> tuple[Structure, bytes]:
        """A scene as its structure and its numbers, as the core takes them."""
        key, numbers = _core.flatten(scene, Part, (Points, Constants))
        try:
            structure = self._known.get(key)
        except TypeError:  # a field that cannot be hashed has a wrong type, which the structure reports
            structure = None
        # A wrong field that holds the type `float` itself looks like the mark of a number.
        if structure is None or 8 * structure.count != len(numbers):
            structure = Structure(scene)
            assert 8 * structure.count == len(numbers)
            self._known[key] = structure
        return structure, numbers


def unpacked(numbers: bytes) -> tuple[float, ...]:
    """Numbers of a scene from what the core takes."""
    return struct.unpack(f"{len(numbers) // 8}d", numbers)


def _numbered(value: Any, count: Iterator[int]) -> Any:
    """A record without wrong types as JSON has it, with the next index in the place of each number."""
    if type(value) is float:
        return next(count)
    if isinstance(value, Part):
        tag = {} if value._tag is None else {value._tag[0]: value._tag[1]}
        return tag | {name: _numbered(getattr(value, name), count) for name in value.__match_args__}
    if isinstance(value, Named):
        return {name: _numbered(item, count) for name, item in value.items()}
    if isinstance(value, tuple):
        return [_numbered(item, count) for item in value]
    return value
