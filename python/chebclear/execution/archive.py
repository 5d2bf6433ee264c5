"""A file of finished runs: written as NumPy archive, checked before it is used.

A file may come from a stranger, with a checksum that fits. Nothing in it is unpickled or inflated, no array
is larger than the bytes that stand for it, and its arrays must fit each other.
"""

from __future__ import annotations

import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import IO, Any
from zipfile import ZIP_STORED

import numpy as np
from numpy.typing import NDArray

from ..base.files import DAMAGE, member_header
from .counts import STATS
from .pieces import End, Piece, as_text, code_version, from_text

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
        if archive.zip.getinfo(f"{name}.npy").compress_type != ZIP_STORED:
            raise UnfitError("is no piece of a store: its arrays are packed")
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
