"""The paper's case study: a slider-crank with one clearance joint and interval parameters.

Computations only; `output` writes the tables. The crank turns at 2000 r/min from angle 0 without gravity; the
clearance joint sits between rod (bearing) and slider (journal); the start is the ideal mechanism with the
journal centered. Two revolutions are simulated and the statistics are over the second one.

Everything is computed twice: ``as_printed`` follows the paper to the letter, ``corrected`` uses Hertz's
stiffness, the rod's inertia about its own center of mass and the sliding velocity of the material surfaces.
All Chebyshev bounds are those of Eq. (31): they enclose the fitted polynomial with slack, not the response.
A scan is an inner bound.
"""

from __future__ import annotations

import itertools
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import mechanisms
from ..base.progress import Progress, reporter
from ..base.rows import Array
from ..base.units import unit
from ..errors import ChebclearWarning
from ..run.trajectory import Stats
from ..scene.scene import Interval, rpm
from ..study.band.band import Band
from ..study.band.zones import RestraintZones, zones_of
from ..study.comparison import Comparison, compare, root_mean_square
from ..study.results import StudyResult
from ..study.study import Study

CONVENTIONS = ("as_printed", "corrected")
CRANK_LENGTH = 0.05  # Table 1 [m]
ROD_LENGTH = 0.12  # Table 1 [m]
CRANK_SPEED = rpm(2000.0)  # section 6.1 [rad/s]
UNCERTAINTY = 0.10  # Eq. (34): half-width of every interval over its midpoint [-]
LENGTHS = ("crank_length", "rod_length")
OUTPUTS = ("slider.x", "slider.vx", "slider.ax", "wrist.penetration")
LENGTH_CLEARANCES = {"0.01": 1e-5, "0.02": 2e-5}  # sections 6.1 and 6.2 [mm]: [m]
SCANNED = ("0.02",)  # where the paper shows a scan
UNCERTAIN_CLEARANCES = {"0.2": 2e-4, "0.5": 5e-4}  # section 6.2 [mm]: [m]
# Studies of a convention.
_PARTS = len(LENGTH_CLEARANCES) + len(SCANNED) + 2 * len(UNCERTAIN_CLEARANCES)

DEGREE = 3
SCAN_POINTS = 10  # per parameter, both ends included
DURATION = 0.06  # two revolutions [s]
REVOLUTION = 0.03  # [s]
SAMPLES = 1441  # every 0.5 degrees of crank angle
# Against the independent reference over both revolutions: 5e-5 m/s as printed, 4e-4 m/s corrected
# (benchmarks/simulate.py).
RTOL = 1e-6
CRANK_ANGLE = np.linspace(0.0, 720.0, SAMPLES)  # at the samples [deg]
SECOND = slice((SAMPLES - 1) // 2, None)  # the samples of the second revolution

# Crank angle over which running maxima are taken for the restraint zones [deg]. Wide enough to hold some
# periods of the contact's ringing, 2 to 5 degrees each, narrow beside the quarter turns of the load.
ENVELOPE = 10.0


@dataclass(frozen=True)
class ConventionStudy:
    """All results with one convention."""

    convention: str
    """``"as_printed"`` or ``"corrected"``."""
    lengths: dict[str, StudyResult]
    """Chebyshev studies with both lengths uncertain, by clearance in millimeters, ``"0.01"``, ``"0.02"``."""
    length_scans: dict[str, StudyResult]
    """Scans of the same, ``"0.02"`` only: 100 runs are most of the work."""
    clearances: dict[str, StudyResult]
    """Chebyshev studies with uncertain clearance, by its midpoint in millimeters, ``"0.2"``, ``"0.5"``."""
    clearance_scans: dict[str, StudyResult]
    """Scans of the same."""
    ideal: StudyResult
    """Chebyshev study of the ideal mechanism with both lengths uncertain, the same for both conventions."""
    ideal_scan: StudyResult
    """Scan of the same."""

    @property
    def stats(self) -> list[Stats]:
        """What each simulation behind these results cost."""
        studies = (self.lengths, self.length_scans, self.clearances, self.clearance_scans)
        return [stats for by_key in studies for study in by_key.values() for stats in study.stats]

    def restraint_zones(self, clearance: str, length: str) -> RestraintZones:
        """Zones for the sensitivity of the slider's velocity to a length at a clearance in millimeters.

        The second revolution, per relative length change [m/s], over the crank angle [deg].
        """
        own, ideal = (
            sensitivity(study["slider.vx"], length) for study in (self.lengths[clearance], self.ideal)
        )
        return zones_of(
            (own - ideal)[SECOND], CRANK_ANGLE[SECOND], round(0.5 * ENVELOPE * (SAMPLES - 1) / 720.0)
        )

    def tables(self) -> dict[str, Any]:
        """The numbers of Tables 3, 4 and 5 and the velocity widths; see `CaseStudy.to_dict`."""
        errors = bound_errors(self.lengths["0.02"], self.length_scans["0.02"])
        return {
            "table3": {
                output: {"lower": 100.0 * one.lower, "upper": 100.0 * one.upper}
                for output, one in errors.items()
            },
            "velocity_width": {key: largest_width(study["slider.vx"]) for key, study in self.lengths.items()},
            "table4": {
                key: {
                    length: root_mean_square(self.restraint_zones(key, length).deviation) ** 2
                    for length in LENGTHS
                }
                for key in self.lengths
            },
            "table5": {
                key: {
                    "width_x": 1e3 * largest_width(study["slider.x"]),
                    "width_vx": largest_width(study["slider.vx"]),
                    "sensitivity_x": _clearance_sensitivity(study, "slider.x"),
                    "sensitivity_vx": _clearance_sensitivity(study, "slider.vx"),
                }
                for key, study in self.clearances.items()
            },
        }


@dataclass(frozen=True)
class CaseStudy:
    """The whole case study, both conventions."""

    conventions: dict[str, ConventionStudy]
    """``"as_printed"`` and ``"corrected"``."""
    seconds: float = field(metadata=unit("s"))
    """Wall time of the computations, without tables and figures [s]."""
    rtol: float
    """Relative tolerance of the integrator [-]."""

    @property
    def runs(self) -> int:
        """Simulations in all [-]."""
        return sum(len(study.stats) for study in self.conventions.values())

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, the object that ``chebclear paper --json`` prints.

        For each convention ``table3`` (relative errors of the bounds [%]), ``velocity_width`` (largest
        interval length [m/s] by clearance [mm]), ``table4`` (mean squares [(m/s)²] by clearance [mm]) and
        ``table5`` (widths [mm], [m/s], root mean square sensitivities [m], [m/s] by clearance [mm]).
        """
        numbers: dict[str, Any] = {name: study.tables() for name, study in self.conventions.items()}
        return numbers | {"runs": self.runs, "seconds": self.seconds}


def case_study(
    *,
    rtol: float = RTOL,
    threads: int | None = None,
    conventions: tuple[str, ...] = CONVENTIONS,
    progress: bool | Progress | None = None,
) -> CaseStudy:
    """Compute the case study; `progress` counts studies."""
    start = time.perf_counter()
    done, total = itertools.count(1), 2 + _PARTS * len(conventions)
    with warnings.catch_warnings(), reporter(progress, "paper", "parts") as report:
        # One for almost every sweep: some impact began slower than the floor. The stats have the counts.
        warnings.simplefilter("ignore", ChebclearWarning)

        def after(part: Any) -> Any:
            if report is not None:
                report(next(done), total)
            return part

        ideal = [after(study) for study in ideal_studies(threads)]
        studies = {name: _convention_study(name, ideal, rtol, threads, after) for name in conventions}
    return CaseStudy(studies, time.perf_counter() - start, rtol)


def ideal_studies(threads: int | None = None) -> tuple[StudyResult, StudyResult]:
    """Chebyshev study and scan of the mechanism without clearance, which its drive prescribes."""
    study = Study(
        mechanisms.slider_crank,
        length_intervals(),
        outputs=["slider.x", "slider.vx"],
        duration=DURATION,
        samples=SAMPLES,
        fixed={"crank_speed": CRANK_SPEED, "clearance_at": ()},
        threads=threads,
    )
    return study.chebyshev(DEGREE, bounds="eq31"), study.scan(SCAN_POINTS)


def length_intervals() -> dict[str, Interval]:
    """Intervals of both lengths, Eq. (34) [m]."""
    return {
        "crank_length": Interval.around(CRANK_LENGTH, rel=UNCERTAINTY),
        "rod_length": Interval.around(ROD_LENGTH, rel=UNCERTAINTY),
    }


def _convention_study(
    convention: str,
    ideal: Sequence[StudyResult],
    rtol: float,
    threads: int | None,
    after: Callable[[Any], Any],
) -> ConventionStudy:
    """All simulations with one convention; every part goes through `after`."""

    def study(parameters: dict[str, Any], outputs: tuple[str, ...], **fixed: float) -> Study:
        return Study(
            mechanisms.slider_crank,
            parameters,
            outputs=list(outputs),
            duration=DURATION,
            samples=SAMPLES,
            rtol=rtol,
            fixed={"crank_speed": CRANK_SPEED, "convention": convention} | fixed,
            threads=threads,
        )

    lengths, length_scans, clearances, clearance_scans = {}, {}, {}, {}
    for key, clearance in LENGTH_CLEARANCES.items():
        both = study(length_intervals(), OUTPUTS, clearance=clearance)
        lengths[key] = after(both.chebyshev(DEGREE, bounds="eq31"))
        if key in SCANNED:
            length_scans[key] = after(both.scan(SCAN_POINTS))
    for key, clearance in UNCERTAIN_CLEARANCES.items():
        uncertain = {"clearance": Interval.around(clearance, rel=UNCERTAINTY)}
        one = study(uncertain, OUTPUTS[:2], crank_length=CRANK_LENGTH, rod_length=ROD_LENGTH)
        clearances[key] = after(one.chebyshev(DEGREE, bounds="eq31"))
        clearance_scans[key] = after(one.scan(SCAN_POINTS))
    return ConventionStudy(convention, lengths, length_scans, clearances, clearance_scans, *ideal)


def bound_errors(result: StudyResult, scan: StudyResult) -> Comparison:
    """Relative errors of the bounds over the second revolution, as in Table 3 [-]."""
    return compare(result, scan, start=REVOLUTION, end=DURATION)


def sensitivity(band: Band, length: str) -> Array:
    """Midpoint sensitivity to a length, per relative length change, in the output's unit."""
    # l = l_mean (1 + 0.1 zeta), so dl / l_mean = 0.1 dzeta.
    return band.polynomial_slope(length, normalized=True) / UNCERTAINTY


def largest_width(band: Band) -> float:
    """Largest interval length over the second revolution, in the output's unit."""
    return float(band.width[SECOND].max())


def mean_width(band: Band) -> float:
    """Mean interval length over the second revolution, in the output's unit."""
    return float(band.width[SECOND].mean())


def escape_share(band: Band, scan: Band) -> float:
    """Share of the second revolution's samples at which a scan leaves the band by more than a trifle [-].

    The trifle is 1 % of the scan's largest interval length: with uncertain lengths Eq. (31) has no slack at
    the dead centers, where escapes of some nanometers mean nothing.
    """
    trifle = 0.01 * largest_width(scan)
    outside = (scan.lower < band.lower - trifle) | (scan.upper > band.upper + trifle)
    return float(outside[SECOND].mean())


def _clearance_sensitivity(study: StudyResult, output: str) -> float:
    """Root mean square sensitivity to the clearance per normalized variable, in the output's unit."""
    sensitivity = study[output].polynomial_slope("clearance", normalized=True)
    return root_mean_square(sensitivity[SECOND])
