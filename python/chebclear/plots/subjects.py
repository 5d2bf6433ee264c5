"""What a plot needs of the results it draws.

Results offer plots as methods, so plots may not import results: they say here what they ask of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from inspect import getattr_static
from typing import Any, Generic, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.named import is_pattern, matching
from ..errors import ArgumentError
from ..scene.scene import Scene

Array = NDArray[np.float64]


class RunLike(Protocol):
    """A `Trajectory`."""

    @property
    def t(self) -> Array: ...
    @property
    def columns(self) -> tuple[str, ...]: ...
    @property
    def status(self) -> str: ...
    @property
    def scene(self) -> Scene: ...

    @property
    def success(self) -> bool: ...
    @property
    def end_time(self) -> float: ...
    def __getitem__(self, column: str) -> Array: ...


class ContactTableLike(Protocol):
    """`Contacts`."""

    @property
    def joint(self) -> NDArray[np.str_]: ...
    @property
    def onset(self) -> Array: ...
    @property
    def separation(self) -> Array: ...
    @property
    def impact_velocity(self) -> Array: ...
    @property
    def peak_force(self) -> Array: ...


class ContactsLike(Protocol):
    """A `Trajectory`, asked for its contacts."""

    @property
    def t(self) -> Array: ...
    @property
    def end_time(self) -> float: ...
    @property
    def scene(self) -> Scene: ...
    @property
    def contacts(self) -> ContactTableLike: ...


class ZonesLike(Protocol):
    """`RestraintZones`."""

    @property
    def spans(self) -> Sequence[tuple[float, float]]: ...


class BandLike(Protocol):
    """A `Band`."""

    @property
    def name(self) -> str: ...
    @property
    def t(self) -> Array: ...
    @property
    def lower(self) -> Array: ...
    @property
    def upper(self) -> Array: ...
    @property
    def nominal(self) -> Array: ...
    @property
    def runs(self) -> Array: ...
    @property
    def verdict(self) -> str: ...
    @property
    def coverage(self) -> float: ...
    @property
    def angle(self) -> Array | None: ...
    @property
    def unit(self) -> str: ...
    @property
    def parameter_units(self) -> Mapping[str, str]: ...

    def sensitivity(self, parameter: str, *, normalized: bool = False) -> Array: ...


class CostsLike(Protocol):
    """A `Tradeoff`."""

    @property
    def horizon_part(self) -> float: ...
    @property
    def points(self) -> Sequence[Any]: ...
    @property
    def outputs(self) -> tuple[str, ...]: ...
    @property
    def ranges(self) -> Array: ...
    @property
    def end(self) -> float: ...

    def uncertainty(self, output: str, until: float | None = None) -> float: ...
    def error(self, point: Any, output: str, until: float | None = None) -> float: ...


class BoundCostsLike(Protocol):
    """A `StudyTradeoff`."""

    @property
    def holdout(self) -> int: ...
    @property
    def points(self) -> Sequence[Any]: ...
    @property
    def outputs(self) -> tuple[str, ...]: ...


class PolynomialBandLike(BandLike, Protocol):
    """A `Band`, asked for its polynomial and runs."""

    @property
    def coefficients(self) -> Array: ...
    @property
    def intervals(self) -> Mapping[str, Any]: ...
    @property
    def parameters(self) -> Array: ...

    def evaluate(self, **values: ArrayLike) -> Array: ...


class EffectsLike(Protocol):
    """`Effects`."""

    @property
    def mean(self) -> float: ...
    @property
    def swings(self) -> Mapping[str, Any]: ...


class FeatureLike(Protocol):
    """A `FeatureResult`."""

    @property
    def name(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def effects(self) -> Any: ...


class RankingLike(Protocol):
    """A `Ranking`."""

    @property
    def feature(self) -> str: ...
    @property
    def rows(self) -> Sequence[Any]: ...
    @property
    def interactions(self) -> Any: ...
    @property
    def scatter(self) -> Any: ...


class BifurcationLike(Protocol):
    """A `Bifurcation`."""

    @property
    def parameter(self) -> str: ...
    @property
    def values(self) -> Array: ...
    @property
    def output(self) -> str: ...
    @property
    def samples(self) -> Array: ...


# What a function takes, for its users.
_WORDS: dict[type, str] = {
    RunLike: "a Trajectory, as simulate returns it",
    ContactsLike: "a Trajectory, as simulate returns it, or a list of them",
    BandLike: 'a Band: one output of a study, such as result["slider.x"]',
    PolynomialBandLike: 'a Band: one output of a study, such as result["slider.x"]',
    ZonesLike: "what restraint_zones returns",
    FeatureLike: 'a feature of a study, such as result.feature("peak force")',
    RankingLike: 'a Ranking, such as result.ranking("peak force")',
    CostsLike: "a Tradeoff, as tradeoff returns it",
    BoundCostsLike: "a StudyTradeoff, as Study.tradeoff returns it",
    BifurcationLike: "a Bifurcation, as bifurcation returns it",
}


def offers(value: object, kind: type) -> bool:
    """Whether a value has what a protocol of this module names, without computing any of it.

    ``isinstance`` reads every property up to Python 3.11, and some are refused or expensive.
    """
    missing = object()
    declared = [base for base in kind.__mro__ if base not in (Protocol, Generic, object)]
    names = {name for base in declared for name in (*vars(base), *base.__annotations__)}
    return all(getattr_static(value, name, missing) is not missing for name in names if name[0] != "_")


def require(argument: str, value: object, kind: type) -> None:
    """Refuse what a plot cannot draw.

    Parameters
    ----------
    argument : str
        Name of the argument.
    value : object
        What was given.
    kind : type
        One of the protocols of this module.

    Raises
    ------
    TypeError
        If it is something else; the message says what is accepted.
    """
    if not offers(value, kind):
        raise TypeError(f"{argument} must be {_WORDS[kind]}; got {type(value).__name__}")


def require_name(argument: str, name: object, run: RunLike) -> None:
    """Refuse what cannot be the name of one column of a run, as a pattern; not that it is unknown."""
    if not isinstance(name, str) or (is_pattern(name) and name not in run.columns):
        message = f'{argument} must be the name of one column, such as "{run.columns[0]}", got {name!r}'
        raise (ArgumentError if isinstance(name, str) else TypeError)(message)


def column_names(run: RunLike, columns: object) -> list[str]:
    """The names of columns that are given as one or several names or patterns; unknown names stay."""
    given = [columns] if isinstance(columns, str) else columns
    names = list(given) if isinstance(given, Iterable) else []
    if not names or not all(isinstance(name, str) for name in names):
        message = f'columns must be names of columns of the run, such as "{run.columns[0]}", got {columns!r}'
        raise TypeError(message)
    return [found for name in names for found in (matching(run.columns, name) or [name])]
