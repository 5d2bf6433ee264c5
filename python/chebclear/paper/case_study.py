"""The paper's case study: a slider-crank with one clearance joint and interval parameters.

The crank turns at 2000 r/min from angle 0 without gravity; the
clearance joint sits between rod (bearing) and slider (journal); the start is the ideal mechanism with the
journal centered. Two revolutions are simulated and the statistics are over the second one.

Everything is computed twice: ``as_printed`` follows the paper to the letter, ``corrected`` uses Hertz's
stiffness, the rod's inertia about its own center of mass and the sliding velocity of the material surfaces.
All Chebyshev bounds are those of Eq. (31): they enclose the fitted polynomial with slack, not the response.
A scan is an inner bound.
"""

from __future__ import annotations

import itertools
import math
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import mechanisms
from ..base.progress import Progress, reporter
from ..base.rows import Array
from ..base.tables import format_number, markdown_table
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
    return root_mean_square(study[output].polynomial_slope("clearance", normalized=True)[SECOND])


# What the paper prints.
TABLE_3 = {
    "slider.x": (0.08, 0.22),
    "slider.vx": (0.37, 0.24),
    "slider.ax": (11.78, 14.23),
    "wrist.penetration": (7.89, 8.81),
}
VELOCITY_WIDTH = {"0.01": 3.21, "0.02": 3.36}
ACCELERATION_DECREASE = 20.0
TABLE_4 = {
    "0.01": {"crank_length": 0.0074, "rod_length": 0.0076},
    "0.02": {"crank_length": 0.0266, "rod_length": 0.0341},
}
TABLE_5 = {"0.2": (0.35, 0.55, 0.0001, 0.2540), "0.5": (1.25, 1.73, 0.0003, 0.7511)}
LARGEST_ACCELERATION = 465
RESTRAINT_ZONES = 3

NAMES = {
    "slider.x": "slider displacement",
    "slider.vx": "slider velocity",
    "slider.ax": "slider acceleration",
    "wrist.penetration": "penetration depth",
    "crank_length": "crank length l1",
    "rod_length": "rod length l2",
}


def tables_markdown(study: CaseStudy) -> str:
    """The text of ``tables.md``: the paper's values beside ours, and what each number means."""
    numbers = study.to_dict()
    by_convention = [(convention, numbers[name]) for name, convention in study.conventions.items()]
    tables = (_table_3, _interval_lengths, _table_4, _restraint_zones, _table_5)
    return "\n\n".join([_introduction(study), *(table(by_convention) for table in tables)]) + "\n"


# A convention with its numbers, as in CaseStudy.to_dict.
Columns = Sequence[tuple[ConventionStudy, dict[str, Any]]]


def _introduction(study: CaseStudy) -> str:
    settings = f"({DURATION:g} s, {SAMPLES} samples)"
    fit = f"degree {DEGREE} on {DEGREE + 1} nodes a parameter"
    stats = [stats for convention in study.conventions.values() for stats in convention.stats]
    slow, changes = (sum(getattr(run, name) for run in stats) for name in ("impacts_at_floor", "events"))
    return f"""# The case study: paper and chebclear

Slider-crank with one clearance joint between rod and slider; crank at 2000 r/min, no gravity. Two
revolutions {settings}, numbers over the second one. Chebyshev: {fit},
bounds by Eq. (31). Scan: {SCAN_POINTS} equispaced points a parameter, ends included.
{study.runs} simulations at rtol {study.rtol:g} with {changes} changes of contact; {slow} impacts began
slower than the floor of the impact velocity and were damped as if at the floor.

- `as_printed`: the paper's equations to the letter: stiffness with pi in Eq. (9) only, rod inertia m l²/3
  used about the center of mass, sliding velocity of the geometric contact point (5)-(6).
- `corrected`: Hertz's stiffness, the same m l²/3 taken about the rod's end, sliding velocity of the
  material surfaces.
- Eq. (31) encloses the fitted polynomial, and with slack: it overestimates the polynomial's range and says
  nothing about how far the response is from the polynomial. A scan sees 10 points a parameter only: it is
  an inner bound, from below.
- Trajectories with impacts are chaotic. The displacement can be compared digit by digit; what depends on
  the phase of the contact (acceleration, penetration, residuals, all of Table 5) can agree with the paper
  in size only."""


def _table_3(columns: Columns) -> str:
    ideal = bound_errors(columns[0][0].ideal, columns[0][0].ideal_scan)
    rows = []
    for output, printed in TABLE_3.items():
        one = ideal.get(output)
        ideal_errors = (100.0 * one.lower, 100.0 * one.upper) if one else (math.nan, math.nan)
        for bound, value, ideal_error in zip(("lower", "upper"), printed, ideal_errors, strict=True):
            cells = [numbers["table3"][output][bound] for _, numbers in columns] + [ideal_error]
            rows.append([f"{NAMES[output]}, {bound}", f"{value:.2f}", *map(format_number, cells)])
    outside = []
    for output in OUTPUTS:
        shares = []
        for study, _ in columns:
            band, scan = study.lengths["0.02"][output], study.length_scans["0.02"][output]
            shares.append(100.0 * escape_share(band, scan))
        outside.append([NAMES[output], "-", *map(format_number, shares)])
    return f"""## Table 3: relative error of the bounds, c = 0.02 mm, lengths ± 10 % [%]

{markdown_table([*_header("bound", columns), "ideal"], rows)}

|RMS(Chebyshev) - RMS(scan)| / RMS(scan), bound by bound. `ideal` is the mechanism without clearance:
its displacement errors are the paper's, so that row measures the slack of Eq. (31) and nothing else. A
small number does not mean that the band holds the response. Share of the samples at which the scan
leaves the Chebyshev bounds by more than 1 % of the largest interval length [%]:

{markdown_table(_header("output", columns), outside)}"""


def _interval_lengths(columns: Columns) -> str:
    ideal, ideal_scan = (study["slider.vx"] for study in (columns[0][0].ideal, columns[0][0].ideal_scan))
    rows = []
    for key, value in VELOCITY_WIDTH.items():
        widths = [numbers["velocity_width"][key] for _, numbers in columns]
        rows.append(
            [
                f"velocity, c = {key} mm, Eq. (31) [m/s]",
                f"{value:.2f}",
                *(format_number(width, 4) for width in widths),
            ]
        )
    width = format_number(largest_width(ideal), 4)
    rows.append(["velocity, ideal mechanism, Eq. (31) [m/s]", "-", *[width] * len(columns)])
    for key in SCANNED:
        widths = [largest_width(study.length_scans[key]["slider.vx"]) for study, _ in columns]
        rows.append(
            [f"velocity, c = {key} mm, scan [m/s]", "-", *(format_number(width, 4) for width in widths)]
        )
    width = format_number(largest_width(ideal_scan), 4)
    rows.append(["velocity, ideal mechanism, scan [m/s]", "-", *[width] * len(columns)])
    for measure, name in ((mean_width, "mean"), (largest_width, "largest")):
        decreases = []
        for study, _ in columns:
            small, large = (measure(study.lengths[key]["slider.ax"]) for key in ("0.01", "0.02"))
            decreases.append(100.0 * (1.0 - small / large))
        row = f"acceleration, {name} interval length: decrease from c = 0.02 to 0.01 mm, Eq. (31) [%]"
        rows.append([row, f"{ACCELERATION_DECREASE:.0f}", *map(format_number, decreases)])
    angles = []
    for study, _ in columns:
        widest = study.lengths["0.02"]["slider.ax"].width[SECOND].argmax()
        angles.append(f"{CRANK_ANGLE[SECOND][widest]:.0f}")
    row = "acceleration, c = 0.02 mm: crank angle of the largest interval length [deg]"
    rows.append([row, f"{LARGEST_ACCELERATION}", *angles])
    return f"""## Section 6.2: interval lengths with uncertain lengths

{markdown_table(_header("quantity", columns), rows)}

Largest interval length of the slider velocity, and by how much the acceleration's shrinks with the
clearance (the paper does not say whether it means the mean or the largest one). Eq. (31) alone widens the
ideal mechanism's band by 5.6 %, more than what the paper puts down to the larger clearance (3.21 to 3.36
m/s): compare rows of one kind only."""


def _table_4(columns: Columns) -> str:
    rows = []
    for key, printed in TABLE_4.items():
        for length, value in printed.items():
            cells = [numbers["table4"][key][length] for _, numbers in columns]
            rows.append([f"c = {key} mm, to {NAMES[length]}", f"{value:.4f}", *map(format_number, cells)])
    for length in LENGTHS:
        ratios = [
            numbers["table4"]["0.02"][length] / numbers["table4"]["0.01"][length] for _, numbers in columns
        ]
        printed_ratio = TABLE_4["0.02"][length] / TABLE_4["0.01"][length]
        rows.append(
            [f"ratio 0.02 to 0.01 mm, {NAMES[length]}", f"{printed_ratio:.1f}", *map(format_number, ratios)]
        )
    return f"""## Table 4: mean square of the residual of the velocity sensitivity [(m/s)²]

{markdown_table(_header("quantity", columns), rows)}

Sensitivity with clearance minus that of the ideal mechanism by the same fit. Sensitivities are per relative
length change dl/l: the paper's values have the size of these. Per normalized variable of Eq. (34) (10 % of
the length) all values are 100 times smaller. The ratio means "to 4.5 times", not "by"."""


def _restraint_zones(columns: Columns) -> str:
    rows = []
    for length in LENGTHS:
        for key in LENGTH_CLEARANCES:
            cells = []
            for study, _ in columns:
                spans = study.restraint_zones(key, length).spans
                cells.append(f"{len(spans)}: " + ", ".join(f"{start:.0f}-{end:.0f}" for start, end in spans))
            rows.append([f"{NAMES[length]}, c = {key} mm", f"{RESTRAINT_ZONES}", *cells])
    return f"""## Clearance effect restraint zones [deg of crank angle]

{markdown_table(_header("sensitivity of the velocity to", columns), rows)}

Count and spans over 360 to 720 degrees. A zone is where the deviation from the ideal mechanism's
sensitivity is under half its maximum. The deviation oscillates and crosses zero all the time, so its
running maximum over {ENVELOPE:g} degrees is compared, not the deviation itself; counts depend on that
width. A zone that spans 360 and 720 degrees counts twice here."""


def _table_5(columns: Columns) -> str:
    rows = []
    for key, printed in TABLE_5.items():
        labels = (
            ("width_x", "displacement width [mm]", "{:.2f}"),
            ("width_vx", "velocity width [m/s]", "{:.2f}"),
            ("sensitivity_x", "RMS sensitivity of displacement [m]", "{:.4f}"),
            ("sensitivity_vx", "RMS sensitivity of velocity [m/s]", "{:.4f}"),
        )
        for (name, label, form), value in zip(labels, printed, strict=True):
            cells = [numbers["table5"][key][name] for _, numbers in columns]
            rows.append([f"c = {key} mm: {label}", form.format(value), *map(format_number, cells)])
        half_width = UNCERTAINTY * float(key)
        cells = [numbers["table5"][key]["sensitivity_vx"] / half_width for _, numbers in columns]
        row = f"c = {key} mm: the same per mm of clearance [(m/s)/mm]"
        rows.append([row, format_number(printed[3] / half_width), *map(format_number, cells)])
        for output, label, scale in (
            ("slider.x", "displacement [mm]", 1e3),
            ("slider.vx", "velocity [m/s]", 1.0),
        ):
            cells = [scale * largest_width(study.clearance_scans[key][output]) for study, _ in columns]
            rows.append([f"c = {key} mm: scanned width of {label}", "-", *map(format_number, cells)])
        for output, label in (("slider.x", "displacement"), ("slider.vx", "velocity")):
            cells = []
            for study, _ in columns:
                band, scan = study.clearances[key][output], study.clearance_scans[key][output]
                cells.append(100.0 * escape_share(band, scan))
            rows.append(
                [
                    f"c = {key} mm: samples where the scan leaves the {label} band by 1 % [%]",
                    "-",
                    *map(format_number, cells),
                ]
            )
    return f"""## Table 5: uncertain clearance, ± 10 %

{markdown_table(_header("quantity", columns), rows)}

Largest interval lengths by Eq. (31), and sensitivities per normalized variable (10 % of the nominal
clearance). The interval of c = 0.5 mm is 2.5 times as wide, which makes up most of the paper's "triple":
compare per millimeter. With uncertain clearance the response is no longer smooth in the parameter and
degree {DEGREE} does not resolve it: the scan leaves the Chebyshev band at many samples, and neither
is a safe bound."""


def _header(first: str, columns: Columns) -> list[str]:
    return [first, "paper", *(study.convention for study, _ in columns)]
