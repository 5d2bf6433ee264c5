"""What a plot needs of the results it draws.

Results offer plots as methods, so plots may not import results: they say here what they ask of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

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
