"""A folder that keeps finished runs, so that no interruption loses them and no later study repeats them.

The folder contains ``store.json``, which describes the runs, and a file for every finished piece. A piece
is an uncompressed ``.npz`` archive whose name contains the SHA-256 of its content, which reveals any change.
Files are written under a temporary name and then renamed, so that a run is either complete or missing.

A file may come from a stranger, with a checksum that fits. Nothing in it is unpickled or inflated, no array
is larger than the bytes that stand for it, and its arrays must fit each other.
"""

from __future__ import annotations

import contextlib
import dataclasses
import errno
import functools
import hashlib
import io
import json
import os
import re
import stat
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from ..base.files import DAMAGE, member_header, package_version
from ..base.writing import replaced
from ..errors import StoreError
from ..notices import Notice
from ..run.features import Feature
from ..run.settings import Settings
from ..scene.structure import FlatScene
from .costs import STATS
from .pieces import TIME_LIMIT, End, Piece, as_text, code_version, from_text

FORMAT = 1
"""Number of the format of stores; raised when a store can no longer be read the old way."""
KIND = "runs of a study"
KEY_BYTES = 16
"""Length of the key of a run [-]."""

# Type and number of dimensions of each member but the texts.
_MEMBERS = {
    "keys": (np.uint8, 2),
    "t": (np.float64, 1),
    "values": (np.float64, 3),
    "features": (np.float64, 3),
    "counts": (np.float64, 2),
}
_TEXTS = ("head", "ends")
WRONG = (KeyError, TypeError, IndexError, AttributeError, RecursionError, OverflowError, *DAMAGE)
"""What reading raises for bytes or JSON that say something else than they should."""


class UnfitError(Exception):
    """A file that cannot be used."""

    def __init__(self, message: str, damaged: bool = False) -> None:
        super().__init__(message)
        self.damaged = damaged


def packed(facts: Mapping[str, Any], keys: Sequence[bytes], piece: Piece) -> bytes:
    """The bytes of a file of runs with these keys."""
    memory = io.BytesIO()
    np.savez(
        memory,
        head=np.array(json.dumps({**facts, "format": FORMAT, "kind": KIND})),
        keys=np.frombuffer(b"".join(keys), dtype=np.uint8).reshape(len(keys), KEY_BYTES),
        t=piece.t,
        values=piece.values,
        features=piece.features,
        counts=piece.counts,
        ends=np.array(as_text(piece.ends, piece.notices)),
    )
    return memory.getvalue()


def read_header(file: IO[bytes]) -> tuple[dict[str, Any], NDArray[np.uint8], tuple[End, ...]]:
    """What a file says of its runs, their keys and ends; the runs themselves are not read.

    UnfitError is raised if the file is none of runs, or its parts do not fit each other.
    """
    try:
        with np.load(file, allow_pickle=False) as archive:
            shapes = _shapes(archive)
            head = json.loads(str(archive["head"]))
            if head.get("kind") != KIND or not isinstance(head.get("format"), int):
                raise UnfitError("is no piece of a store")
            if head["format"] > FORMAT:
                newest = f"this version reads up to {FORMAT}: take a newer one"
                raise UnfitError(f"has format {head['format']}, {newest}")
            runs, samples = shapes["keys"][0], shapes["t"][0]
            outputs, features = head["outputs"], head["features"]
            fitting = {
                "keys": (runs, KEY_BYTES),
                "values": (runs, samples if outputs or shapes["values"][1] else 0, len(outputs)),
                "features": (runs, shapes["features"][1], len(features)),
                "counts": (runs, len(STATS)),
            }
            names = [*outputs, *features]
            if any(shapes[name] != shape for name, shape in fitting.items()) or not all(
                isinstance(name, str) for name in names
            ):
                raise UnfitError("is no piece of a store: its parts do not fit each other")
            ends, _ = from_text(str(archive["ends"]), runs)
            return head, archive["keys"], ends
    except WRONG:
        raise UnfitError("is no piece of a store") from None


def _shapes(archive: Any) -> dict[str, tuple[int, ...]]:
    """Shape of every array, as long as the file holds all its bytes as they are."""
    found = {}
    for name in (*_MEMBERS, *_TEXTS):
        shape, dtype = member_header(archive, name)
        wanted, dimensions = _MEMBERS.get(name, (dtype, 0))
        if dtype != wanted or dtype.hasobject or len(shape) != dimensions:
            raise UnfitError(f"is no piece of a store: {name} has another type or shape")
        found[name] = shape
    return found


def unpacked(path: Path, rows: Sequence[int], outputs: Sequence[str], features: Sequence[str]) -> Piece:
    """Some runs of a file that was looked at, with these outputs and features."""
    with np.load(path, allow_pickle=False) as file:
        head = json.loads(str(file["head"]))
        columns = [head["outputs"].index(name) for name in outputs]
        tracked = [head["features"].index(name) for name in features]
        ends, notices = from_text(str(file["ends"]), len(file["keys"]))
        return Piece(
            t=file["t"],
            values=file["values"][rows][:, :, columns],
            features=file["features"][rows][:, :, tracked],
            counts=file["counts"][rows],
            ends=tuple(ends[row] for row in rows),
            notices=tuple(notices[row] for row in rows),
            code=code_version(),
            seconds=0.0,
        )


_HEAD, _LOCK, _SET_ASIDE = "store.json", "lock", ".damaged"
# What a killed process was writing: a piece, the head, or the samples of all runs.
_UNFINISHED = (".piece-", f".{_HEAD}.", ".values-")
_PIECE = re.compile(r"piece-([0-9a-f]{32})\.npz")
# A head is a few kilobytes of names and numbers.
_MOST_HEAD_BYTES = 10_000_000
# What the system says of a file that another process has locked.
_TAKEN = (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES, errno.EDEADLK)
# What may differ between the studies of one store: outputs and features are compared by name.
_NAMED = ("outputs", "features")


def scene_facts(settings: Settings, topology: str, rtol: float) -> dict[str, Any]:
    """What the simulations of a store have in common, as JSON has it.

    The settings name the outputs; `topology` is a fingerprint of the mechanism without its numbers, `rtol`
    the tolerance of the study, while that of single runs is part of their key.
    """
    plain = dataclasses.asdict(settings) | {"rtol": rtol}
    return {
        "code": f"chebclear {package_version()}, core {code_version()}",
        "topology": topology,
        "settings": {name: value for name, value in plain.items() if name not in _NAMED},
        "outputs": list(settings.outputs or ()),
        "features": [_named(feature) for feature in settings.features],
    }


def _named(feature: Feature) -> str:
    """What a feature is, to the last digit."""
    own = f"{feature.kind} of {feature.of}"
    return own if feature.window is None else f"{own} while {feature.window!r}"


def run_key(scene: FlatScene, settings: Settings) -> bytes:
    """What distinguishes a run from all others with the same identity: its scene and its tolerance."""
    identity = f"{settings.rtol!r}\n".encode() + _digest(scene.structure) + scene.numbers
    return hashlib.sha256(identity).digest()[:KEY_BYTES]


@functools.lru_cache(maxsize=100)
def _digest(structure: str) -> bytes:
    return hashlib.sha256(structure.encode()).digest()


class SeenFolder(os.PathLike[str]):
    """The folder of a store that is opened again and again: pieces that were looked at are not read again."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._path = os.fspath(path)
        self.pieces: dict[str, tuple[NDArray[np.uint8], tuple[End, ...]]] = {}
        """Keys and ends of their runs by the names of the files."""

    def __fspath__(self) -> str:
        return self._path


class Store:
    """An open store of runs with some `facts` in common, in a folder that is made if it does not exist.

    Other processes are refused until it is closed. StoreError is raised if the folder cannot be written to,
    is used by another process, or holds runs of something else.
    """

    def __init__(self, path: str | os.PathLike[str], facts: Mapping[str, Any]) -> None:
        self.path = Path(path)
        self.remarks: list[Notice] = []
        """Warnings about the files in the folder."""
        self._where: dict[bytes, tuple[str, int]] = {}
        self._facts = dict(facts)
        self._seen = path.pieces if isinstance(path, SeenFolder) else {}
        with self._errors():
            self.path.mkdir(parents=True, exist_ok=True)
        self._lock = self._locked()
        try:
            with self._errors():
                described = self._check_head()
                self._read_all()
                if not described:
                    self._write_head(self._facts | self._kept_names())
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Let other processes use the store."""
        # Workers that were forked in the meantime have the file too, and would keep it locked.
        _lock(self._lock, held=False)
        os.close(self._lock)

    def __len__(self) -> int:
        return len(self._where)

    def __contains__(self, key: bytes) -> bool:
        return key in self._where

    def names(self, key: bytes) -> tuple[list[str], list[str]]:
        """Names of the outputs and of the features that are kept of a run."""
        with self._errors(), (self.path / self._where[key][0]).open("rb") as file:
            head, _, _ = read_header(file)
        return head["outputs"], head["features"]

    def name(self, outputs: Sequence[str], features: Sequence[str]) -> None:
        """Name the outputs and features of the runs, if they were not known when the store was opened."""
        self._facts |= {"outputs": list(outputs), "features": list(features)}
        with self._errors():
            if self._where:
                self._check_head()
            else:
                self._write_head(self._facts)

    def write(self, keys: Sequence[bytes], piece: Piece) -> None:
        """Keep a finished piece; raises StoreError if that is impossible, such as on a full disk."""
        content = packed(self._facts, keys, piece)
        name = f"piece-{hashlib.sha256(content).hexdigest()[:32]}.npz"
        with self._errors(), replaced(self.path / name) as beside:
            beside.write_bytes(content)
        self._where |= {key: (name, row) for row, key in enumerate(keys)}

    def read(self, keys: Iterable[tuple[int, bytes]]) -> Iterator[tuple[list[int], Piece]]:
        """Numbers of some of the runs, which are given with their keys, and these runs, file by file."""
        by_file: dict[str, list[tuple[int, int]]] = {}
        for number, key in keys:
            if key in self._where:
                name, row = self._where[key]
                by_file.setdefault(name, []).append((number, row))
        for name, found in by_file.items():
            rows = [row for _, row in found]
            path, facts = self.path / name, self._facts
            try:
                with self._errors():
                    piece = unpacked(path, rows, facts["outputs"], facts["features"])
            except WRONG as error:
                raise StoreError(f"{path} was changed since it was looked at: {error}") from error
            yield [number for number, _ in found], piece

    def _check_head(self) -> bool:
        """Refuse a store of something else; whether it is described.

        If it is not, pieces may still be there: all that the head says is in every piece as well.
        """
        path = self.path / _HEAD
        if not os.path.lexists(path):
            others = sorted(entry.name for entry in self.path.iterdir() if entry.name != _LOCK)
            if others and not any(_PIECE.fullmatch(name) for name in others):
                raise StoreError(
                    f"{self.path} is no store: it holds {others[0]} and no {_HEAD}; give an empty folder "
                    "or one that does not exist"
                )
            return False
        if not path.is_file():
            raise StoreError(f"{path} is no file")
        with path.open("rb") as file:
            content = file.read(_MOST_HEAD_BYTES)
        try:
            kept = json.loads(content)
            form, kind = kept["format"], kept["kind"]
        except (ValueError, TypeError, KeyError, RecursionError):
            self._remark(path, "was damaged and is written anew")
            return False
        if kind != KIND or not isinstance(form, int):
            raise StoreError(f"{path} was not written by chebclear")
        if form > FORMAT:
            raise StoreError(f"{path} has format {form}, this version reads up to {FORMAT}: take a newer one")
        different = differences(kept, self._facts)
        if different:
            raise StoreError(
                f"the store {self.path} holds runs of another study, or of another version:\n"
                + "\n".join(f"  {line}" for line in different)
                + "\ngive another folder, or simulate as the runs in this one were"
            )
        return True

    def _kept_names(self) -> dict[str, Any]:
        """Names of all outputs and features that the pieces have."""
        one_of_each = {file: key for key, (file, _) in self._where.items()}
        names = [self.names(key) for key in one_of_each.values()]
        if not names:
            return {}
        outputs, features = max(names, key=lambda both: len(both[0]) + len(both[1]))
        return {"outputs": outputs, "features": features}

    def _write_head(self, facts: Mapping[str, Any]) -> None:
        with replaced(self.path / _HEAD) as beside:
            beside.write_text(
                json.dumps({"format": FORMAT, "kind": KIND, **facts}, indent=1), encoding="utf-8"
            )

    def _remark(self, path: Path, words: str) -> None:
        self.remarks.append(Notice("store", f"{path} {words}", (path.name,)))

    def _read_all(self) -> None:
        """Read the keys of all runs; unreliable pieces are named and left out."""
        for path in sorted(self.path.iterdir()):
            named = _PIECE.fullmatch(path.name)
            if named is None:
                if (
                    path.name not in (_HEAD, _LOCK)
                    and not path.name.startswith(".")
                    and path.suffix != _SET_ASIDE
                ):
                    self._remark(path, "is no piece of this store and was left alone")
                elif path.name.startswith(_UNFINISHED):
                    # Windows keeps the samples of a result that is still in use.
                    with contextlib.suppress(PermissionError):
                        path.unlink(missing_ok=True)
                continue
            if not path.is_file():
                self._remark(path, "is no file and was left alone")
                continue
            try:
                keys, ends = self._keys(path, named[1])
            except UnfitError as error:
                self._remark(path, f"{error}; its runs are simulated again")
                if error.damaged:
                    path.replace(path.with_name(path.name + _SET_ASIDE))
                continue
            for row, (key, end) in enumerate(zip(keys, ends, strict=True)):
                # How long a run takes is no property of the run: it gets its time anew.
                if end.status != TIME_LIMIT:
                    self._where[key.tobytes()] = (path.name, row)

    def _keys(self, path: Path, digest: str) -> tuple[NDArray[np.uint8], tuple[End, ...]]:
        """Keys and ends of the runs of a piece; raises `UnfitError` if it cannot be used."""
        if path.name in self._seen:
            return self._seen[path.name]
        with path.open("rb") as file:
            found = hashlib.file_digest(file, "sha256").hexdigest()[: len(digest)]
            if found != digest:
                raise UnfitError("is damaged: its checksum is another one", damaged=True)
            file.seek(0)
            head, keys, ends = read_header(file)
        different = differences(head, self._facts)
        if different:
            raise UnfitError(f"is of another study ({'; '.join(different)})")
        self._seen[path.name] = keys, ends
        return keys, ends

    def _locked(self) -> int:
        """The lock of the store, held until it is closed or its process ends, however that ends."""
        path = self.path / _LOCK
        # What a link leads to, or waits behind a pipe, is none of ours.
        flags = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
        with self._errors(), contextlib.ExitStack() as closing:
            file = os.open(path, os.O_RDWR | os.O_CREAT | flags, 0o666)
            closing.callback(os.close, file)
            if not stat.S_ISREG(os.fstat(file).st_mode):
                raise StoreError(f"{path} is no file")
            try:
                _lock(file)
            except OSError as error:
                message = f"the file system of the store {self.path} cannot lock files ({error.strerror})"
                if error.errno in _TAKEN:
                    owner = os.read(file, 100).decode(errors="replace").strip() or "another process"
                    message = f"the store {self.path} is in use by {owner}: wait for it to end"
                raise StoreError(f"{message}; or give another folder") from error
            os.ftruncate(file, 0)
            os.write(file, f"process {os.getpid()}".encode())
            closing.pop_all()
        return file

    @contextlib.contextmanager
    def _errors(self) -> Iterator[None]:
        """What the system says against reading or writing, as a `StoreError`."""
        try:
            yield
        except StoreError:
            raise
        except OSError as error:
            kept = f"; it keeps {len(self)} runs, and the study goes on from there" if len(self) else ""
            where = f" ({Path(error.filename).name})" if isinstance(error.filename, str) else ""
            raise StoreError(f"the store {self.path}: {error.strerror or error}{where}{kept}") from error


def differences(kept: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    """Differences between the runs in a store and the requested ones, in words."""
    settings = kept.get("settings")
    theirs = {name: kept.get(name) for name in ("code", "topology")}
    theirs |= settings if isinstance(settings, dict) else {}
    ours = {name: wanted[name] for name in ("code", "topology")} | wanted["settings"]
    found = [
        f"{name}: the store has {theirs.get(name)!r}, this study {ours.get(name)!r}"
        for name in dict.fromkeys([*ours, *theirs])
        if name not in theirs or name not in ours or theirs[name] != ours[name]
    ]
    for name in _NAMED:
        known = kept.get(name)
        lacking = [one for one in wanted[name] if not isinstance(known, list) or one not in known]
        if lacking:
            found.append(f"{name}: the store does not keep {', '.join(lacking)}")
    return found


def _lock(file: int, *, held: bool = True) -> None:
    """Lock a file for this process, or let it go; OSError if another one holds it."""
    try:
        import fcntl
    except ImportError:  # Windows, where no process is forked: closing the file lets it go
        import msvcrt

        if held:
            msvcrt.locking(file, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined,unused-ignore]
        return
    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB if held else fcntl.LOCK_UN)
