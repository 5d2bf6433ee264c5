"""What should be checked but did not stop the computation: with a code and numbers that programs read.

No text is compared, or searched for numbers: what two notices have in common is their code and what they are
about.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..base.named import ReadOnlyDict
from ..errors import ChebclearWarning, HorizonWarning, warn

SCENE = "scene"
"""Code of numbers of a scene that look wrong; `Scene.check` knows them too."""
HORIZON = "horizon"
"""Code of what is not predictable; it is warned of by a `HorizonWarning`."""


@dataclass(frozen=True)
class Notice:
    """Something that should be checked.

    Attributes
    ----------
    code : str
        What it is, such as ``"undersampled"`` or ``"energy_balance"``.
    text : str
        The same in words.
    about : tuple[str, ...]
        The outputs, the joint or the field of the scene that it is about.
    numbers : Mapping[str, float]
        Its numbers by name, in SI units; ``runs`` is how many of all runs (``of_runs``) it is about.
    place : str
        Where in the box these runs are, in words; empty if they are everywhere.
    """

    code: str
    text: str
    about: tuple[str, ...] = ()
    numbers: Mapping[str, float] = field(default_factory=dict)
    place: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "about", tuple(self.about))
        numbers = {name: float(number) for name, number in self.numbers.items()}
        object.__setattr__(self, "numbers", ReadOnlyDict(numbers))

    def __str__(self) -> str:
        return self.text

    @classmethod
    def of_core(cls, plain: Iterable[Any]) -> tuple[Notice, ...]:
        """The notices of a run of the core."""
        return tuple(
            cls(code, text, () if about is None else (about,), numbers)
            for code, about, numbers, text in plain
        )

    @classmethod
    def from_plain(cls, plain: Iterable[Any]) -> tuple[Notice, ...]:
        """The notices that `as_plain` wrote; `ValueError` if they are none."""
        found = []
        for code, text, about, numbers, place in plain:
            if not all(isinstance(word, str) for word in (code, text, place, *about)):
                raise ValueError("a notice has a code, a text, and names that it is about")
            found.append(cls(code, text, about, dict(numbers), place))
        return tuple(found)


def as_plain(notices: Iterable[Notice]) -> list[list[Any]]:
    """Notices as JSON values."""
    return [[one.code, one.text, list(one.about), dict(one.numbers), one.place] for one in notices]


class WithNotices:
    """Base of results that have `notices`."""

    notices: tuple[Notice, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """The texts of the notices, each once."""
        return tuple(dict.fromkeys(one.text for one in self.notices))


def issue(notices: Iterable[Notice]) -> None:
    """Issue a Python warning for each notice, each text once."""
    for one in {one.text: one for one in notices}.values():
        warn(one.text, HorizonWarning if one.code == HORIZON else ChebclearWarning)
