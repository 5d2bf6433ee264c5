"""Memory for the samples of a study: refused before the first run where it is not there, or in a file."""

from __future__ import annotations

import contextlib
import math
import mmap
import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..base.rows import Array
from ..errors import MemoryLimitError, StoreError
from ..run.memory import require_memory

# What a study takes besides its samples [bytes], measured by `benchmarks/memory.py`: in any case; for each
# run (its parameters, counts, end, features); for blocks of an output while polynomials or bands are made.
_ANY, _RUN, _BLOCKS = 10e6, 450.0, 30e6
# Copies of the matrix of a least-squares problem while it is solved: 2.5 and 2.9 of 16 and of 63 MB.
_FACTORED = 3.0
# Samples in a file that are in the memory at a time, as far as it is ours to say [bytes].
_BLOCK = 32_000_000


@dataclass(frozen=True)
class Usage:
    """What the result of a method takes besides the samples of its runs."""

    copies: int = 0
    """Copies of all samples of one output, which are taken one output after the other [-]."""
    terms: int = 0
    """Terms of the polynomials that are kept for every sample [-]."""
    matrix: int = 0
    """Size of the matrix of a least-squares problem [-]."""


SAMPLES_ALONE = Usage()


def study_memory(shape: tuple[int, ...], usage: Usage, *, in_memory: bool = True) -> float:
    """Memory that a study of (runs, samples, outputs) takes at most besides what the process has [bytes];
    samples that are not `in_memory` are in a file."""
    size, column = 8.0 * math.prod(shape), 8.0 * math.prod(shape[:2])
    taken = _ANY + _RUN * shape[0] + (size if in_memory else min(size, _BLOCK))
    if not shape[2]:
        return taken
    blocks = min(_BLOCKS, column) if usage.copies or usage.terms else 0.0
    kept = 8.0 * usage.terms * math.prod(shape[1:])
    return taken + blocks + kept + usage.copies * column + _FACTORED * 8.0 * usage.matrix


def sample_array(shape: tuple[int, ...], folder: str | os.PathLike[str] | None, usage: Usage) -> Array:
    """An array for the samples of all runs, in memory or in a file in a folder that goes with the process.

    MemoryLimitError is raised if a study of it, whose result takes `usage` besides, would not fit into the
    memory; StoreError if the file does not fit on the disk.
    """
    size = 8 * math.prod(shape)
    require_memory(study_memory(shape, usage, in_memory=folder is None), "the study takes")
    if folder is None or size == 0:
        return np.empty(shape)
    try:
        descriptor, name = tempfile.mkstemp(prefix=".values-", dir=folder)
        try:
            # Of a file with holes a full disk would end the process when they are written to.
            if hasattr(os, "posix_fallocate"):
                os.posix_fallocate(descriptor, 0, size)
            with os.fdopen(descriptor, "r+b", closefd=False) as file:
                mapped = np.memmap(file, dtype=float, mode="w+", shape=shape)
        finally:
            os.close(descriptor)
            # What is mapped stays until it is no longer used; Windows keeps the name as long.
            with contextlib.suppress(PermissionError):
                os.unlink(name)
    except OSError as error:
        message = f"the samples of all runs take {size / 1e6:.0f} MB in {os.fspath(folder)}"
        raise StoreError(f"{message}: {error.strerror or error}") from error
    return np.asarray(mapped)


def copy_output(values: Array, index: int, into: Array) -> None:
    """Copy one output of all samples, in blocks: samples in a file are in the memory only in part."""
    for part, place in zip(_blocks(values), _blocks(into, values[:1].nbytes), strict=True):
        place[...] = part[:, :, index]
        release(values)


def _blocks(values: Array, row: int = 0) -> Iterator[Array]:
    """Rows of an array, so many as fit a block if a row has a size [bytes], its own if not given."""
    step = max(1, _BLOCK // max(1, row or values[:1].nbytes))
    return (values[start : start + step] for start in range(0, len(values), step))


def extremes(values: Array) -> tuple[Array, Array]:
    """Smallest and largest value of all rows, of shape (samples, outputs); of a file in blocks as well."""
    lowest, highest = values[0].copy(), values[0].copy()
    for part in _blocks(values):
        np.minimum(lowest, part.min(axis=0), out=lowest)
        np.maximum(highest, part.max(axis=0), out=highest)
        release(values)
    return lowest, highest


def release(values: Array) -> None:
    """Let go of the memory of samples in a file; the system reads them again when they are needed."""
    owner: object = values
    while isinstance(owner, np.ndarray):
        owner = owner.base
    if isinstance(owner, mmap.mmap) and sys.platform == "linux":
        owner.madvise(mmap.MADV_DONTNEED)


@contextlib.contextmanager
def threads_started() -> Iterator[None]:
    """A block that starts threads: that this fails means too little memory for their stacks, or too many."""
    try:
        yield
    except RuntimeError as error:
        raise MemoryLimitError("no further thread can be started: memory or processes are limited") from error
