"""Mappings from the names of outputs: one entry by its name, several by a pattern."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Generic, NoReturn, TypeVar

from ..errors import ArgumentTypeError, UnknownNameError
from .shown import did_you_mean, meant_or_known

Entry = TypeVar("Entry")
Key = TypeVar("Key")
Value = TypeVar("Value")


def is_pattern(name: object) -> bool:
    """Whether a name is a pattern: with ``"*"``, ``"?"`` or ``"[...]"`` as in a shell."""
    return isinstance(name, str) and any(sign in name for sign in "*?[")


def matching(names: Iterable[str], pattern: str) -> list[str]:
    """Names that match a pattern; ``fnmatch.filter`` would ignore case on Windows.

    >>> matching(["slider.x", "slider.vx", "rod.x"], "slider.*")
    ['slider.x', 'slider.vx']
    """
    return [name for name in names if fnmatch.fnmatchcase(name, pattern)]


class ReadOnlyDict(dict[Key, Value]):
    """A dict that does not change: what frozen results hold. ``dict(it)`` is one that does."""

    def _refuse(self, *given: Any, **named: Any) -> NoReturn:
        raise ArgumentTypeError("results are read-only: change a copy, dict(...)")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse

    def __reduce__(self) -> tuple[type[ReadOnlyDict[Key, Value]], tuple[dict[Key, Value]]]:
        return type(self), (dict(self),)


class Named(Mapping[str, Entry], Generic[Entry]):
    """Base of results with one entry for each name, in the order of the names.

    A `collections.abc.Mapping`: ``in``, ``len``, iteration over the names, ``keys()``, ``items()``, ``get``
    and ``dict(result)``. ``result["slider.*"]`` is a dict of the entries whose names match. Where a result
    has one array of all entries, ``values`` is this array, as in pandas.
    """

    @property
    def _by_name(self) -> Mapping[str, Entry]:
        """The entries of a result that holds them by name."""
        raise NotImplementedError

    @property
    def _names(self) -> Sequence[str]:
        """The names in their order."""
        return tuple(self._by_name)

    def _entry(self, name: str) -> Entry:
        """The entry of a name; a KeyError that suggests a similar name if there is none."""
        entries = self._by_name
        if name not in entries:
            raise UnknownNameError(f'unknown name "{name}"{meant_or_known(name, entries)}')
        return entries[name]

    def __getitem__(self, name: str) -> Entry:
        if is_pattern(name) and name not in self._names:
            # Type checkers cannot distinguish a pattern from a name; `matching` has the right type.
            return self.matching(name)  # type: ignore[return-value]
        return self._entry(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name in self._names

    def matching(self, pattern: str) -> dict[str, Entry]:
        """The entries whose names match a pattern such as ``"slider.*"``; brackets do the same.

        Parameters
        ----------
        pattern : str
            Name with ``*``, ``?`` or ``[...]`` as in a shell; capitals count.

        Returns
        -------
        dict of str to entry
            In the order of the names.

        Raises
        ------
        KeyError
            If no name matches.
        """
        found = matching(self._names, pattern)
        if not found:
            raise UnknownNameError(f'nothing matches "{pattern}"{did_you_mean(pattern, self._names)}')
        return {name: self._entry(name) for name in found}

    def _ipython_key_completions_(self) -> list[str]:
        return list(self._names)
