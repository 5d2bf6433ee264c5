"""What a plot draws: its arguments checked.

Results offer plots as methods, so plots import results for types only.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from ..base.named import is_pattern, matching
from ..errors import ArgumentError, ArgumentTypeError

if TYPE_CHECKING:
    from ..run.trajectory import Trajectory

# What a function takes, for its users.
_WORDS = {
    "Trajectory": "a Trajectory, as simulate returns it",
    "Band": 'a Band: one output of a study, such as result["slider.x"]',
    "RestraintZones": "what restraint_zones returns",
    "FeatureResult": 'a feature of a study, such as result.features["peak force"]',
    "Ranking": 'a Ranking, such as result.ranking("peak force")',
    "Tradeoff": "a Tradeoff, as tradeoff returns it",
    "StudyTradeoff": "a StudyTradeoff, as study_tradeoff returns it",
    "Share": 'the share of a specification, such as conformance(...)["stroke"]',
    "Difference": 'a feature of two designs, such as contrast(...)["peak force"]',
    "Agreement": 'what a measured trace is compared with: measured.compare(result["slider.x"])',
    "Identification": "an Identification, as identify returns it",
    "Allocation": "an Allocation, as allocate returns it",
    "LostMotion": "a LostMotion, as lost_motion returns it",
    "WearLife": "a WearLife, as wear_life returns it",
    "Spectrum": 'a Spectrum, as run.spectrum("slider.ax") returns it',
    "Cycles": 'load cycles, as run.cycles("wrist.normal_force") returns them',
    "Sweep": "a Sweep, as Study.sweep returns it",
    "Bifurcation": "a Bifurcation, as bifurcation returns it",
}


def is_a(value: object, kind: str) -> bool:
    """Whether a value is of a class of this name, or of one derived from it."""
    return any(base.__name__ == kind for base in type(value).__mro__)


def require(argument: str, value: object, kind: str) -> None:
    """Refuse, with a TypeError, what is not of the class that a plot draws."""
    if not is_a(value, kind):
        raise ArgumentTypeError(f"{argument} must be {_WORDS[kind]}; got {type(value).__name__}")


def require_name(argument: str, name: object, run: Trajectory) -> None:
    """Refuse what cannot be the name of one column of a run, as a pattern; not that it is unknown."""
    if not isinstance(name, str) or (is_pattern(name) and name not in run.columns):
        message = f'{argument} must be the name of one column, such as "{run.columns[0]}", got {name!r}'
        raise (ArgumentError if isinstance(name, str) else TypeError)(message)


def column_names(run: Trajectory, columns: object) -> list[str]:
    """The names of columns that are given as one or several names or patterns; unknown names stay."""
    given = [columns] if isinstance(columns, str) else columns
    names = list(given) if isinstance(given, Iterable) else []
    if not names or not all(isinstance(name, str) for name in names):
        message = f'columns must be names of columns of the run, such as "{run.columns[0]}", got {columns!r}'
        raise ArgumentTypeError(message)
    return [found for name in names for found in (matching(run.columns, name) or [name])]
