# The compiled core. Text is JSON, see schema.py and simulation.Settings.
from collections.abc import Callable, Sequence
from typing import Any, TypedDict, final, type_check_only

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "METHODS",
    "MOST_SAMPLES",
    "RTOL_RANGE",
    "Design",
    "Mechanism",
    "band_terms",
    "chebyshev_derivative",
    "chebyshev_evaluate",
    "chebyshev_fit",
    "chebyshev_nodes",
    "check_settings",
    "expression_names",
    "flatten",
    "interval_bounds",
    "polynomial_ranges",
    "random_points",
    "sobol_points",
    "sweep",
    "total_degree_basis",
    "total_degree_exponents",
    "total_degree_ranges",
]

METHODS: list[str]
MOST_SAMPLES: int
RTOL_RANGE: tuple[float, float]

@type_check_only
class _Events(TypedDict):
    time: NDArray[np.float64]
    joint: list[str]
    kind: list[str]
    normal_velocity: NDArray[np.float64]

@type_check_only
class _Contacts(TypedDict):
    joint: list[str]
    onset: NDArray[np.float64]
    separation: NDArray[np.float64]
    impact_velocity: NDArray[np.float64]
    peak_force: NDArray[np.float64]
    peak_time: NDArray[np.float64]

@type_check_only
class _Run(TypedDict):
    t: NDArray[np.float64]
    values: NDArray[np.float64]
    columns: list[str]
    status: str
    message: str
    time: float
    joint: str | None
    load: str | None
    stats: dict[str, Any]
    events: _Events
    contacts: _Contacts
    skipped_events: _Events
    skipped_contacts: _Contacts
    features: NDArray[np.float64]
    end: str | None
    notices: list[tuple[str, str | None, dict[str, float], str]]

@type_check_only
class _Runs(TypedDict):
    t: NDArray[np.float64]
    values: NDArray[np.float64]
    columns: list[str]
    features: NDArray[np.float64]
    stats: dict[str, NDArray[np.float64]]
    ends: dict[int, tuple[str, str, float, str | None]]
    notices: dict[int, list[tuple[str, str | None, dict[str, float], str]]]

@type_check_only
class _Ranges(TypedDict):
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    attained_lower: NDArray[np.float64]
    attained_upper: NDArray[np.float64]
    lowest_at: NDArray[np.float64]
    highest_at: NDArray[np.float64]

@type_check_only
class _CalibratedBand(TypedDict):
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    window: float
    inflation: float
    coverage: float
    whole_run: float
    persistence: float
    degree: int | None
    error: float | None
    coefficients: NDArray[np.float64] | None

@type_check_only
class _SmallMotions(TypedDict):
    accelerations: NDArray[np.float64]
    by_position: NDArray[np.float64]
    by_velocity: NDArray[np.float64]
    closures: NDArray[np.float64]
    bodies: NDArray[np.float64]
    poses: list[list[float]]
    levers: list[float]
    speeds: list[float]
    lengths: list[float]
    length: float

@final
class Mechanism:
    def __new__(cls, scene: str) -> Mechanism: ...
    def facts(self) -> str: ...
    def simulate(
        self,
        settings: str,
        progress: Callable[[float], None] | None = None,
        start: str | None = None,
    ) -> _Run: ...
    def small_motions(self, start: str | None = None) -> _SmallMotions: ...

def flatten(record: object, part: type, named: tuple[type, type]) -> tuple[tuple[Any, ...], bytes]: ...
def expression_names(text: str) -> list[str] | None: ...
def sweep(
    scenes: Sequence[tuple[str, bytes, tuple[int, ...]]],
    settings: str,
    threads: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    into: NDArray[np.float64] | None = None,
    run_seconds: float | None = None,
) -> _Runs: ...
def check_settings(settings: str) -> None: ...
def chebyshev_nodes(count: int) -> NDArray[np.float64]: ...
def chebyshev_fit(
    values: NDArray[np.float64], nodes: Sequence[int], degrees: Sequence[int]
) -> NDArray[np.float64]: ...
def chebyshev_evaluate(
    coefficients: NDArray[np.float64], degrees: Sequence[int], points: NDArray[np.float64]
) -> NDArray[np.float64]: ...
def chebyshev_derivative(
    coefficients: NDArray[np.float64], degrees: Sequence[int], axis: int
) -> NDArray[np.float64]: ...
def interval_bounds(
    coefficients: NDArray[np.float64], degrees: Sequence[int]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def polynomial_ranges(
    coefficients: NDArray[np.float64], degrees: Sequence[int], threads: int | None = None
) -> _Ranges: ...
def sobol_points(parameters: int, first: int, count: int, seed: int | None) -> NDArray[np.float64]: ...
def random_points(parameters: int, first: int, count: int, seed: int) -> NDArray[np.float64]: ...
def total_degree_exponents(parameters: int, degree: int) -> list[list[int]]: ...
def total_degree_ranges(
    coefficients: NDArray[np.float64], parameters: int, degree: int, threads: int | None
) -> _Ranges: ...
def total_degree_basis(points: NDArray[np.float64], degree: int) -> NDArray[np.float64]: ...
def band_terms(runs: int, parameters: int) -> int: ...

@final
class Design:
    def __new__(
        cls,
        points: NDArray[np.float64],
        scored: int,
        coverage: float,
        independent: bool = False,
        revolutions: int | None = None,
        filled: bool = True,
    ) -> Design: ...
    def band(
        self, values: NDArray[np.float64], limits: tuple[float, float], threads: int | None = None
    ) -> _CalibratedBand: ...
