"""Files and folders that are written as a whole or not at all."""

from __future__ import annotations

import os
import platform
import re
import shutil
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from ..errors import ArgumentError


def with_default_suffix(path: str | os.PathLike[str], suffix: str) -> Path:
    """A path with a default suffix if it has none.

    >>> with_default_suffix("run", ".csv").name, with_default_suffix("run.txt", ".csv").name
    ('run.csv', 'run.txt')
    """
    path = named(path)
    return path if path.suffix else path.with_suffix(suffix)


def named(path: str | os.PathLike[str]) -> Path:
    """The path of a file, whose name is not empty."""
    named = Path(path)
    if not named.name:
        raise ArgumentError(f"path must end with the name of a file, got {str(path)!r}")
    return named


def file_name(name: str) -> str:
    """A name that every file system takes."""
    return re.sub(r"[^\w.-]", "_", name, flags=re.ASCII)


def distinct(
    names: Iterable[str], accepted: Callable[[str], str], key: Callable[[str], str] = str
) -> dict[str, str]:
    """Names as something accepts them, different ones by a key for different names; those that fit stay.

    >>> distinct(["a b", "a_b"], file_name), distinct(["rod", "Rod"], file_name, str.lower)
    ({'a_b': 'a_b', 'a b': 'a_b_2'}, {'rod': 'rod', 'Rod': 'Rod_2'})
    """
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in sorted(dict.fromkeys(names), key=lambda one: accepted(one) != one):
        free, count = accepted(name), 1
        while key(free) in taken:
            count += 1
            free = f"{accepted(name)}_{count}"
        found[name] = free
        taken.add(key(free))
    return found


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """A new file beside a path, or beside the target of a link, that replaces it when the block ends well.

    If the writing is interrupted, the path still holds the complete old file. What writers of the path left
    that were killed is removed.
    """
    path = path.resolve()
    if not path.parent.is_dir():
        raise FileNotFoundError(f"there is no folder {str(path.parent)!r} for {path.name}: make it first")
    prefix = f".{path.name}."
    _remove_left(path.parent, prefix)
    # Threads of one process may write the same path at once, such as two pieces that hold the same run.
    beside = path.with_name(f"{prefix}{_writer()}{threading.get_ident()}{path.suffix}")
    try:
        yield beside
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def _writer() -> str:
    """What names of temporary files hold of who writes them: the machine and the process."""
    return f"{platform.node()}.{os.getpid()}."


def _remove_left(folder: Path, prefix: str) -> None:
    """Remove the temporary files and folders of a name that killed processes of this machine left."""
    pattern = re.compile(rf"{re.escape(prefix + platform.node())}\.(\d{{1,9}})\..*")
    for entry in folder.iterdir():
        named = pattern.fullmatch(entry.name)
        if named is None or not _has_ended(int(named[1])):
            continue
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry, ignore_errors=True)
        else:
            # Another process may be as quick, or Windows keep what is still open.
            with suppress(FileNotFoundError, PermissionError):
                entry.unlink()


def _has_ended(process: int) -> bool:
    """Whether no process has this number; on Windows, where a file in use cannot be removed, always."""
    if os.name == "nt":
        return process != os.getpid()
    try:
        os.kill(process, 0)  # sends nothing
    except ProcessLookupError:
        return True
    except OSError:  # that of another user
        return False
    return False


_PARTIAL = ".partial."


@contextmanager
def complete_folder(directory: Path) -> Iterator[Path]:
    """A temporary folder whose files move into a directory when the block ends without an exception.

    An interrupted job leaves no incomplete file; other files of the directory are not changed. It is created
    with its parents, and removed again if it stays empty.
    """
    made = [each for each in (directory, *directory.parents) if not each.exists()]
    directory.mkdir(parents=True, exist_ok=True)
    try:
        _remove_left(directory, _PARTIAL)
        # Inside the directory, which is writable and on the same file system.
        with TemporaryDirectory(prefix=f"{_PARTIAL}{_writer()}", dir=directory) as folder:
            yield Path(folder)
            for source in sorted(Path(folder).rglob("*.*")):
                target = directory / source.relative_to(folder)
                target.parent.mkdir(exist_ok=True)
                source.replace(target)
    finally:
        for new in made:
            if not new.is_dir() or any(new.iterdir()):
                break
            new.rmdir()
