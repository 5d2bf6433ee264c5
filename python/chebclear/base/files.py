"""Results as files and as values: ``.npz`` archives with JSON metadata, and equality of records of arrays."""

from __future__ import annotations

import dataclasses
import json
import math
import operator
import os
import platform
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tokenize import TokenError
from types import NoneType, UnionType
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Literal,
    Self,
    TypeAlias,
    TypeVar,
    get_args,
    get_origin,
    get_type_hints,
)
from zipfile import ZIP_STORED, BadZipFile, ZipFile
from zlib import error as ZlibError

import numpy as np
from numpy.typing import NDArray

from ..errors import ArgumentError, ChebclearError
from .named import ReadOnlyDict
from .shown import Shown
from .writing import named, replaced

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Record = TypeVar("Record", bound="DataclassInstance")

LIVE: Mapping[str, Any] = ReadOnlyDict({"live": True})
"""Metadata of a field of a record that stays in its process, such as a study with its executor: it is neither
pickled nor saved, and has a default."""

FORMAT = 3
"""Number of the file format; increased when other versions cannot read the files of this one."""


def package_version() -> str:
    """Version of this package; ``"unknown"`` in a source tree that was never installed."""
    from importlib.metadata import PackageNotFoundError, version  # here only: it costs as much as a room

    try:
        return version("chebclear")
    except PackageNotFoundError:
        return "unknown"


def on_disk(path: str | os.PathLike[str]) -> Path:
    """The path of a file, which may not be a pipe or a device: reading these may never end."""
    found = Path(path)
    if found.exists() and not found.is_file() and not found.is_dir():
        raise ArgumentError(f"{os.fspath(path)} is no file on disk, but a pipe or a device")
    return found


class Stacked:
    """Arrays that are written as one without making it.

    Its parts follow each other along the first axis; the arrays of a part, of one shape, stand side by side
    on a new last axis.
    """

    def __init__(self, parts: Sequence[Sequence[NDArray[np.float64]]]) -> None:
        self._parts = parts
        rows = sum(len(part[0]) for part in parts)
        self.shape = (rows, *parts[0][0].shape[1:], len(parts[0]))
        self.dtype = np.dtype(float)

    def blocks(self) -> Iterator[NDArray[np.float64]]:
        """The rows, some at a time."""
        count = max(1, _BLOCK // max(1, 8 * math.prod(self.shape[1:])))
        for part in self._parts:
            for first in range(0, len(part[0]), count):
                yield np.stack([array[first : first + count] for array in part], axis=-1)


# Of an array that is written a block at a time [bytes].
_BLOCK = 1_000_000


def _write_member(archive: ZipFile, name: str, array: NDArray[Any] | Stacked) -> None:
    """Write an array as `numpy.savez` does; the archive keeps a checksum of it."""
    with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
        if not isinstance(array, Stacked):
            np.lib.format.write_array(member, np.asarray(array), allow_pickle=False)
            return
        header = {"descr": array.dtype.str, "fortran_order": False, "shape": array.shape}
        np.lib.format.write_array_header_1_0(member, header)
        for block in array.blocks():
            member.write(np.ascontiguousarray(block).data)


# Key of the object that represents a number which JSON does not have.
_NOT_FINITE = "not_finite"


def _as_json(value: Any) -> Any:
    """A value with ``{"not_finite": "Infinity"}`` and the like in place of the numbers that JSON lacks."""
    if isinstance(value, Mapping):
        return {key: _as_json(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_as_json(entry) for entry in value]
    if not isinstance(value, float) or math.isfinite(value):
        return value
    return {_NOT_FINITE: "NaN" if math.isnan(value) else "Infinity" if value > 0.0 else "-Infinity"}


def _from_json(plain: dict[str, Any]) -> Any:
    """The value that an object of the metadata represents."""
    if plain.keys() != {_NOT_FINITE}:
        return plain
    word = plain[_NOT_FINITE]
    if not isinstance(word, str):
        raise ValueError(f"{word!r} is no word for a number")
    return float(word)


Shape: TypeAlias = tuple[int | str | None, ...]
"""Sizes of the axes of an array: numbers, None for any, or names of axes that arrays of a record share. A
field of that name has its size, as a number or by its length."""

DAMAGE = (ValueError, EOFError, OSError, RuntimeError, SyntaxError, TokenError, BadZipFile, ZlibError)
"""Exceptions of numpy and zipfile for unreadable content of a file that is open."""


def sound(record: Record, **shapes: Shape) -> Record:
    """A record made of what a file says, if its fields have the declared types and its arrays their shapes.

    Shapes are those that its class or `shapes` say. Records in its fields, and in sequences and mappings of
    them, are looked at as well. Raises a TypeError or ValueError.
    """
    shapes = {**getattr(record, "_axes", {}), **shapes}
    sizes: dict[str, int] = {}
    for item in dataclasses.fields(record):
        value = getattr(record, item.name)
        where = f"{type(record).__name__}.{item.name}"
        if not any(_has_type(value, one) for one in str(item.type).split(" | ")):
            raise TypeError(f"{where} is a {type(value).__name__}, not {item.type}")
        entries = value if isinstance(value, list | tuple) else (value,)
        for one in value.values() if isinstance(value, dict) else entries:
            if item.name in shapes and one is not None:
                _check_shape(where, one.shape, shapes[item.name], record, sizes)
            if dataclasses.is_dataclass(one) and not isinstance(one, type):
                sound(one)
    return record


def _check_shape(
    where: str, shape: tuple[int, ...], wanted: Shape, record: object, sizes: dict[str, int]
) -> None:
    """Raise ValueError if an array has another shape; `sizes` are those of the axes that have names."""
    for axis, size in zip(wanted, shape, strict=False):
        if isinstance(axis, str) and axis not in sizes:
            known = getattr(record, axis, size)
            sizes[axis] = known if isinstance(known, int) else len(known)
    named = tuple(sizes.get(axis, axis) for axis in wanted)  # type: ignore[arg-type]
    if len(shape) != len(named) or any(
        one not in (None, size) for one, size in zip(named, shape, strict=True)
    ):
        raise ValueError(f"{where} has shape {shape}, not {named}")


_COLLECTION = re.compile(r"tuple\[([^|]+), \.\.\.\]|dict\[str, ([^|]+)\]")
# Arrays as they are annotated, and the kinds of their numbers.
_ARRAYS = {"Array": "fiu", "NDArray[np.complex128]": "c"}


def _has_type(value: Any, annotation: str) -> bool:
    """Whether a value has an annotated type; only those that a file can get wrong are looked at."""
    if annotation == "None":
        return value is None
    if found := _COLLECTION.fullmatch(annotation):
        kind, inner = (tuple, found[1]) if found[1] else (dict, found[2])
        entries = value.values() if isinstance(value, dict) else value
        return isinstance(value, kind) and all(_has_type(one, inner) for one in entries)
    if annotation in _ARRAYS:
        return isinstance(value, np.ndarray) and value.dtype.kind in _ARRAYS[annotation]
    if annotation == "float":
        return isinstance(value, float) or (_has_type(value, "int") and math.isfinite(float(value)))
    if annotation == "int":
        return isinstance(value, int) and not isinstance(value, bool)
    plain = {"str": str, "bool": bool}
    return annotation not in plain or isinstance(value, plain[annotation])


def _arrays(archive: np.lib.npyio.NpzFile, facts: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """The arrays of a file that has those which it lists, in the shapes that they had."""
    names = {name for name in archive.files if name != "metadata"}
    if differing := sorted(facts["members"].keys() ^ names):
        raise ValueError(f"{', '.join(differing)} is missing or misnamed")
    # All of them before any is read.
    for name in names:
        shape, _ = member_header(archive, name)
        if list(shape) != facts["members"][name]:
            raise ValueError(
                f"{name} has shape {list(shape)}, not {facts['members'][name]} as when it was saved"
            )
    return {name: archive[name] for name in sorted(names)}


def member_header(archive: Any, name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and type of an array of an archive that holds all its bytes as they are, else a ValueError.

    NumPy asks for the memory of whatever a header says before it reads on, and packed zeros would fill a
    thousand times the size of the file.
    """
    member = archive.zip.getinfo(f"{name}.npy")
    if member.compress_type != ZIP_STORED:
        raise ValueError(f"{name} is packed")
    with archive.zip.open(member) as file:
        np.lib.format.read_magic(file)
        # Versions differ in the length of the header alone; NumPy writes the first for the types of results.
        shape, _, dtype = np.lib.format.read_array_header_1_0(file)
        size = int(np.prod(shape, dtype=object)) * dtype.itemsize + file.tell()
    if not size == member.file_size == member.compress_size:
        raise ValueError(f"{name} is not as long as it says")
    return shape, dtype


def kind_of(path: str | os.PathLike[str]) -> str:
    """The kind of content of a file that `save` wrote, else a ValueError, as of a later version."""
    with _opened(path) as (_, facts):
        return str(facts["kind"])


@contextmanager
def _opened(path: str | os.PathLike[str]) -> Iterator[tuple[np.lib.npyio.NpzFile, dict[str, Any]]]:
    """The archive and the facts in a file that `save` wrote."""
    stranger = ArgumentError(
        f"{os.fspath(path)} was not written by chebclear, or is damaged: give a whole file that save() wrote"
    )
    # Opened here, because numpy leaves a file open if it is not an archive.
    with on_disk(path).open("rb") as file, ExitStack() as closing:
        try:
            archive = np.load(file, allow_pickle=False)
            if not isinstance(archive, np.lib.npyio.NpzFile):  # a single array
                raise stranger
            closing.enter_context(archive)
            member_header(archive, "metadata")
            facts = json.loads(str(archive["metadata"]), object_hook=_from_json)
        except (KeyError, *DAMAGE):
            raise stranger from None
        if not (isinstance(facts, dict) and isinstance(facts.get("format"), int) and "kind" in facts):
            raise stranger
        if facts["format"] != FORMAT:
            other = "a later" if facts["format"] > FORMAT else "an earlier"
            raise ArgumentError(
                f"{os.fspath(path)} has format {facts['format']}, this version reads {FORMAT}: take {other} "
                "version, or compute it again"
            )
        yield archive, facts


def same(first: Any, second: Any) -> bool:
    """Equality of values that may hold arrays; NaN equals NaN."""
    if isinstance(first, np.ndarray) or isinstance(second, np.ndarray):
        floats = all(np.asarray(one).dtype.kind in "fc" for one in (first, second))
        return bool(np.array_equal(first, second, equal_nan=floats))
    if type(first) is not type(second):
        return False
    if isinstance(first, ArrayRecord) or (
        dataclasses.is_dataclass(first) and first.__dataclass_params__.eq  # type: ignore[union-attr]
    ):
        names = [item.name for item in dataclasses.fields(first) if item.compare]  # type: ignore[arg-type]
        return all(same(getattr(first, name), getattr(second, name)) for name in names)
    if isinstance(first, (list, tuple)):
        return len(first) == len(second) and all(map(same, first, second))
    if isinstance(first, dict):
        return first.keys() == second.keys() and all(same(first[key], second[key]) for key in first)
    return bool(first == second) or (first != first and second != second)


def lasting(record: Any) -> list[str]:
    """Names of the fields of a record that outlast its process, see `LIVE`."""
    return [item.name for item in dataclasses.fields(record) if "live" not in item.metadata]


def _read_only(value: Any) -> Any:
    """The value with read-only arrays, views, so that those of the caller stay writeable, and dicts."""
    if isinstance(value, np.ndarray) and value.flags.writeable:
        view = value.view()
        view.flags.writeable = False
        return view
    if type(value) is tuple:
        items = tuple(map(_read_only, value))
        return value if all(map(operator.is_, items, value)) else items
    if type(value) in (dict, ReadOnlyDict):
        entries = {key: _read_only(item) for key, item in value.items()}
        kept = type(value) is ReadOnlyDict and all(map(operator.is_, entries.values(), value.values()))
        return value if kept else ReadOnlyDict(entries)
    return value


class ArrayRecord(Shown):
    """Base of results: dataclasses that are frozen with the arrays and dicts they hold, equal if all their
    fields are. A copy is the result itself, as of a tuple."""

    _axes: ClassVar[Mapping[str, Shape]] = ReadOnlyDict({})
    """Shapes of the arrays of fields, and of those in mappings."""
    __hash__ = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        self._freeze()

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memory: object) -> Self:
        return self

    def __getstate__(self) -> dict[str, Any]:
        # Cached values are no part of a record: its pickle must not depend on what it was asked for.
        return {name: getattr(self, name) for name in lasting(self)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        # Pickles do not call __init__, and their arrays are new ones.
        self.__dict__.update(state)
        self._freeze()

    def _freeze(self) -> None:
        for name, value in vars(self).items():
            frozen = _read_only(value)
            if frozen is not value:
                object.__setattr__(self, name, frozen)

    def __eq__(self, other: object) -> bool:
        return same(self, other) if type(other) is type(self) else NotImplemented


def flattened(value: Any, place: str, arrays: dict[str, NDArray[Any]]) -> Any:
    """A value of a field as JSON has it; arrays go into `arrays`, under their places in the record."""
    if isinstance(value, np.ndarray):
        arrays[place] = value
        return {"array": place}
    if hasattr(value, "from_json"):  # a scene, which has a form of its own
        return json.loads(value.to_json())
    if hasattr(value, "from_facts"):  # as what was asked of a study, and its parameters
        return value.facts()
    if dataclasses.is_dataclass(value):
        value = {name: getattr(value, name) for name in lasting(value)}
    inner = f"{place}." if place else ""
    if isinstance(value, Mapping):
        # By their numbers, since keys may be names of the user's.
        named = all(str(key).isidentifier() for key in value)
        places = map(str, value if named else range(len(value)))
        entries = zip(value.items(), places, strict=True)
        return {key: flattened(one, inner + own, arrays) for (key, one), own in entries}
    if isinstance(value, list | tuple):
        return [flattened(one, f"{inner}{number}", arrays) for number, one in enumerate(value)]
    return value


def restored(kind: Any, plain: Any, arrays: Mapping[str, Any]) -> Any:
    """The value of a type from what `flattened` made of it."""
    origin, inner = get_origin(kind), get_args(kind)
    if origin is UnionType:
        kinds = [one for one in inner if one is not NoneType]
        told = len(kinds) == 1 or hasattr(kinds[0], "from_facts")  # which says of what kind it is
        return restored(kinds[0], plain, arrays) if told and plain is not None else plain
    if origin is Literal and plain not in inner:
        raise ValueError(f"{plain!r} is none of {inner}")
    if isinstance(plain, dict) and plain.keys() == {"array"}:
        return arrays[plain["array"]]
    if hasattr(kind, "from_json"):
        return kind.from_json(json.dumps(plain))
    if hasattr(kind, "from_facts"):
        return kind.from_facts(plain)
    if hasattr(kind, "from_dict"):
        return kind.from_dict(plain)
    if dataclasses.is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(**{name: restored(hints[name], one, arrays) for name, one in plain.items()})  # type: ignore[operator]
    if origin is tuple:
        if not isinstance(plain, list):
            raise TypeError(f"{plain!r} is no list")
        kinds = [inner[0]] * len(plain) if Ellipsis in inner else list(inner)
        return tuple(restored(one, value, arrays) for one, value in zip(kinds, plain, strict=True))
    if origin is dict:
        return {name: restored(inner[1], one, arrays) for name, one in plain.items()}
    return plain


Contents: TypeAlias = tuple[Mapping[str, "NDArray[Any] | Stacked"], Mapping[str, Any]]
"""Arrays of a file, and values that JSON can represent."""


class Saved(ArrayRecord):
    """A result that one file holds: a class says what goes into it, and what is made of that."""

    kind_of_file: ClassVar[str]
    """What files of the class say that they hold."""

    def __init_subclass__(cls, *, kind: str, **options: Any) -> None:
        super().__init_subclass__(**options)
        cls.kind_of_file = kind

    def _contents(self) -> Contents:
        """What goes into the file: by default all fields, see `flattened`."""
        arrays: dict[str, NDArray[Any]] = {}
        return arrays, {"record": flattened(self, "", arrays)}

    @classmethod
    def _from_contents(cls, arrays: Mapping[str, Any], facts: Mapping[str, Any]) -> Self:
        """The result of such a file."""
        found: Self = sound(restored(cls, facts["record"], arrays))
        found._check_shapes()
        return found

    def _check_shapes(self) -> None:
        """Raise ValueError if arrays of a file do not fit each other."""

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write everything to one ``.npz`` file.

        Parameters
        ----------
        path : path
            The file; ``.npz`` is appended if it is missing.

        Returns
        -------
        Path
            The file written.
        """
        # Not compressed: samples of impacts shrink by a tenth, which takes ten times as long as writing them.
        arrays, facts = self._contents()
        path = named(path)
        if path.suffix != ".npz":
            path = path.with_name(path.name + ".npz")
        versions = {
            "chebclear": package_version(),
            "numpy": np.__version__,
            "python": platform.python_version(),
            "platform": platform.platform(),
        }
        with replaced(path) as beside, ZipFile(beside, "w") as archive:
            for name, array in arrays.items():
                _write_member(archive, name, array)
            metadata = {
                "format": FORMAT,
                "kind": self.kind_of_file,
                "versions": versions,
                "members": {name: list(array.shape) for name, array in arrays.items()},
                **facts,
            }
            _write_member(archive, "metadata", np.array(json.dumps(_as_json(metadata), allow_nan=False)))
        return path

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read what `save` wrote.

        Parameters
        ----------
        path : path
            The file.

        Returns
        -------
        same class
            The result that was saved.

        Raises
        ------
        ValueError
            If the file holds something else, is damaged, or was written by a later version.
        """
        with _opened(path) as (archive, facts):
            if facts["kind"] != cls.kind_of_file:
                raise ArgumentError(f"{os.fspath(path)} holds a {facts['kind']}, not a {cls.kind_of_file}")
            try:
                return cls._from_contents(_arrays(archive, facts), facts)
            except (LookupError, TypeError, AttributeError, OverflowError, *DAMAGE) as error:
                # Of a file wrong types and names are damage; what else the package says of it stands.
                if isinstance(error, ChebclearError) and isinstance(error, ValueError):
                    raise
                raise ArgumentError(
                    f"{os.fspath(path)} is damaged: it is no sound {cls.kind_of_file}: {error}"
                ) from error
