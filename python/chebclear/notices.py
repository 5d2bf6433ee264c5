"""What should be checked but did not stop the computation: with a code and numbers that programs read.

What two notices have in common is their code and what they are about.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from .base.files import ArrayRecord
from .base.named import ReadOnlyDict
from .errors import ChebclearWarning, HorizonWarning, warn

HORIZON = "horizon"
"""Code of what is not predictable; it is warned of by a `HorizonWarning`."""

CODES = {
    "long_body": "a body is longer than anything rigid: a length in millimeters?",
    "light_body": "a body is lighter than anything rigid of its length",
    "fast_drive": "a drive is so fast that everything of this size bursts",
    "speed_twice": "a speed was converted from revolutions per minute twice",
    "free_fall": "the acceleration of gravity is that in mm/s²",
    "degrees": "an angle beyond a turn is a round number of degrees",
    "large_journal": "a journal is far larger than the bodies it joins",
    "large_clearance": "a clearance is far larger than in any bearing or guide",
    "large_coupling": "a pitch radius or backlash is one in millimeters",
    "no_size": "nothing gives a length of a body, from which tolerances follow",
    "twin_joint": "a joint joins the same two points as another one",
    "default_center": "a body has no center of mass in the file, so that it is at a joint",
    "two_assemblies": "two ways to close the loops are equally near to the given angles",
    "unstable_start": "the start is at rest in an unstable equilibrium",
    "starts_in_contact": "a contact without an impact velocity",
    "rests_near_rounding": "the load of a contact is too small for its stiffness",
    "law_out_of_range": "a contact law outside of its range",
    "deep_penetration": "a contact law does not hold; the mechanism may be jammed",
    "creep": "a contact creeps that should stick",
    "impacts_at_floor": "impacts slower than the tolerance resolves, or than their floor",
    "energy_balance": "the energy does not balance",
    "stability": "stability, not accuracy, limits the steps of the method",
    "unknown_samples": "samples at a change point, where forces are not known",
    "unseen_load": "a load or drive whose formula could not be bounded between the instants of a step",
    "work_unknown": "work that the run before did not count",
    HORIZON: "single values are not predictable (a `HorizonWarning`)",
    "other_scene": "a run continues with another scene",
    "repeated": "a run of a study was repeated with tighter tolerances",
    "build": "a warning of `build`",
    "store": "a remark of the store",
    "failed": "runs without a result",
    "stopped": "runs for which there was no time",
    "rare_failures": "what is rare is that a run fails",
    "machine": "a share depends on how fast the machine is",
    "within_tolerance": "margins are smaller than the tolerance of the runs",
    "too_few_runs": "too few runs for the coverage of a band",
    "not_resolved": "a polynomial does not follow the runs",
    "holes": "a polynomial is fitted to fewer runs than its grid has",
    "settling": "a band or an extremum is in the starting transient",
    "unsettled": "features still change from revolution to revolution, or from these runs to later ones",
    "table": "what a table of runs lacks",
    "no_nominal_run": "a table of runs has none at the nominal values",
    "foreign": "included runs are those of another model",
}
"""Every code of a notice, with what it says: of scenes, of runs, of studies."""


@dataclass(frozen=True, eq=False)
class Notice(ArrayRecord):
    """Something that should be checked.

    Attributes
    ----------
    code : str
        What it is, such as ``"too_few_runs"``: one of `CODES`.
    text : str
        The same in words.
    about : tuple[str, ...]
        The outputs, the joint or the fields of the scene that it is about.
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
        """The notices of a scene or run from the core."""
        return tuple(cls(code, text, about, numbers) for code, about, numbers, text in plain)

    @classmethod
    def from_plain(cls, plain: Iterable[Any]) -> tuple[Notice, ...]:
        """The notices that `as_plain` wrote; `ValueError` if they are none."""
        found = []
        for code, text, about, numbers, place in plain:
            if not all(isinstance(word, str) for word in (code, text, place, *about)):
                raise ValueError("a notice has a code, a text, and names that it is about")
            found.append(cls(code, text, about, dict(numbers), place))
        return tuple(found)


# What is about how the runs were made, or about what lasts long: no answer changes by it.
_ASIDE = frozenset({"stability", "repeated", "store", "creep"})
# What counts however few runs it is about.
_ALWAYS = frozenset({"failed", "stopped", "deep_penetration", "rare_failures"})
# Fewer than this part of the runs change no answer about all of them [-].
_FEW_RUNS = 0.01
# Forces whose error is less, relative to the largest energy, are shown with the same three digits [-].
_SMALL_ERROR = 0.005


def changes_answer(notice: Notice) -> bool:
    """Whether a notice may change an answer, so that it is shown beside it; else it stands in the details."""
    if notice.code in _ALWAYS:
        return True
    if notice.code in _ASIDE:
        return False
    if notice.code == "energy_balance" and notice.numbers.get("share", 1.0) < _SMALL_ERROR:
        return False
    runs, of_runs = (notice.numbers.get(name, 1.0) for name in ("runs", "of_runs"))
    return runs >= _FEW_RUNS * of_runs


def shown_first(notices: Iterable[Notice]) -> list[str]:
    """The texts of the notices that may change an answer, each once."""
    return list(dict.fromkeys(one.text for one in notices if changes_answer(one)))


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
