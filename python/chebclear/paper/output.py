"""The tables of the case study: the paper's values beside ours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ..base.tables import format_number, markdown_table
from . import case_study as paper
from .case_study import CaseStudy, ConventionStudy

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
    sections = [
        _introduction(study),
        _table_3(by_convention),
        _interval_lengths(by_convention),
        _table_4(by_convention),
        _restraint_zones(by_convention),
        _table_5(by_convention),
    ]
    return "\n\n".join(sections) + "\n"


# A convention with its numbers, as in CaseStudy.to_dict.
Columns = Sequence[tuple[ConventionStudy, dict[str, Any]]]


def _introduction(study: CaseStudy) -> str:
    settings = f"({paper.DURATION:g} s, {paper.SAMPLES} samples)"
    fit = f"degree {paper.DEGREE} on {paper.DEGREE + 1} nodes a parameter"
    stats = [stats for convention in study.conventions.values() for stats in convention.stats]
    slow, changes = (sum(getattr(run, name) for run in stats) for name in ("impacts_at_floor", "events"))
    return f"""# The case study: paper and chebclear

Slider-crank with one clearance joint between rod and slider; crank at 2000 r/min, no gravity. Two
revolutions {settings}, numbers over the second one. Chebyshev: {fit},
bounds by Eq. (31). Scan: {paper.SCAN_POINTS} equispaced points a parameter, ends included.
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
    ideal = paper.bound_errors(columns[0][0].ideal, columns[0][0].ideal_scan)
    rows = []
    for output, printed in TABLE_3.items():
        one = ideal.get(output)
        ideal_errors = (100.0 * one.lower, 100.0 * one.upper) if one else (math.nan, math.nan)
        for bound, value, ideal_error in zip(("lower", "upper"), printed, ideal_errors, strict=True):
            cells = [numbers["table3"][output][bound] for _, numbers in columns] + [ideal_error]
            rows.append([f"{NAMES[output]}, {bound}", f"{value:.2f}", *map(format_number, cells)])
    outside = []
    for output in paper.OUTPUTS:
        shares = []
        for study, _ in columns:
            band, scan = study.lengths["0.02"][output], study.length_scans["0.02"][output]
            shares.append(100.0 * paper.escape_share(band, scan))
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
        rows.append([f"velocity, c = {key} mm, Eq. (31) [m/s]", f"{value:.2f}", *map(_four, widths)])
    width = _four(paper.largest_width(ideal))
    rows.append(["velocity, ideal mechanism, Eq. (31) [m/s]", "-", *[width] * len(columns)])
    for key in paper.SCANNED:
        widths = [paper.largest_width(study.length_scans[key]["slider.vx"]) for study, _ in columns]
        rows.append([f"velocity, c = {key} mm, scan [m/s]", "-", *map(_four, widths)])
    width = _four(paper.largest_width(ideal_scan))
    rows.append(["velocity, ideal mechanism, scan [m/s]", "-", *[width] * len(columns)])
    for measure, name in ((paper.mean_width, "mean"), (paper.largest_width, "largest")):
        decreases = []
        for study, _ in columns:
            small, large = (measure(study.lengths[key]["slider.ax"]) for key in ("0.01", "0.02"))
            decreases.append(100.0 * (1.0 - small / large))
        row = f"acceleration, {name} interval length: decrease from c = 0.02 to 0.01 mm, Eq. (31) [%]"
        rows.append([row, f"{ACCELERATION_DECREASE:.0f}", *map(format_number, decreases)])
    angles = []
    for study, _ in columns:
        widest = study.lengths["0.02"]["slider.ax"].width[paper.SECOND].argmax()
        angles.append(f"{paper.CRANK_ANGLE[paper.SECOND][widest]:.0f}")
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
    for length in paper.LENGTHS:
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
    for length in paper.LENGTHS:
        for key in paper.LENGTH_CLEARANCES:
            cells = []
            for study, _ in columns:
                spans = study.restraint_zones(key, length).spans
                cells.append(f"{len(spans)}: " + ", ".join(f"{start:.0f}-{end:.0f}" for start, end in spans))
            rows.append([f"{NAMES[length]}, c = {key} mm", f"{RESTRAINT_ZONES}", *cells])
    return f"""## Clearance effect restraint zones [deg of crank angle]

{markdown_table(_header("sensitivity of the velocity to", columns), rows)}

Count and spans over 360 to 720 degrees. A zone is where the deviation from the ideal mechanism's
sensitivity is under half its maximum. The deviation oscillates and crosses zero all the time, so its
running maximum over {paper.ENVELOPE:g} degrees is compared, not the deviation itself; counts depend on that
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
        half_width = paper.UNCERTAINTY * float(key)
        cells = [numbers["table5"][key]["sensitivity_vx"] / half_width for _, numbers in columns]
        row = f"c = {key} mm: the same per mm of clearance [(m/s)/mm]"
        rows.append([row, format_number(printed[3] / half_width), *map(format_number, cells)])
        for output, label, scale in (
            ("slider.x", "displacement [mm]", 1e3),
            ("slider.vx", "velocity [m/s]", 1.0),
        ):
            cells = [scale * paper.largest_width(study.clearance_scans[key][output]) for study, _ in columns]
            rows.append([f"c = {key} mm: scanned width of {label}", "-", *map(format_number, cells)])
        for output, label in (("slider.x", "displacement"), ("slider.vx", "velocity")):
            cells = []
            for study, _ in columns:
                band, scan = study.clearances[key][output], study.clearance_scans[key][output]
                cells.append(100.0 * paper.escape_share(band, scan))
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
degree {paper.DEGREE} does not resolve it: the scan leaves the Chebyshev band at many samples, and neither
is a safe bound."""


def _header(first: str, columns: Columns) -> list[str]:
    return [first, "paper", *(study.convention for study, _ in columns)]


def _four(value: float) -> str:
    return format_number(value, 4)
