"""What a report says of cheaper and tighter settings, against studies made with those settings."""

import math
import re

import chebclear as cc
import numpy as np
import pytest
from chebclear.report.document import Table, Text
from chebclear.study.report.alternatives import alternatives

BOX = {"stiffness": cc.Interval.around(40.0, rel=0.1), "damping": cc.Interval.around(0.5, rel=0.2)}


def oscillator(stiffness, damping):
    t = np.linspace(0.0, 2.0, 101)
    omega = np.sqrt(stiffness - damping**2 / 4.0)
    return {"t": t, "x": np.exp(-damping * t / 2.0) * np.cos(omega * t)}


def found(result):
    blocks = alternatives(result)
    table = next(block for block in blocks if isinstance(block, Table))
    return table, " ".join(block.text for block in blocks if isinstance(block, Text))


def number(cell):
    """The number of a cell, in SI units."""
    value, *unit = cell.split()
    return float(value) * {"mm": 1e-3, "µm": 1e-6}.get("".join(unit), 1.0)


def mean_width(band):
    return float(np.mean(band.upper - band.lower))


def test_a_lower_degree_on_the_same_runs():
    study = cc.Study(oscillator, BOX)
    result = study.chebyshev(3)
    table, text = found(result)
    [row] = table.rows
    # The polynomials of degree 2 on the nodes of degree 3, made as a study of its own.
    less = study.chebyshev(2, nodes=4)
    assert number(row[1]) == pytest.approx(mean_width(less["x"]), rel=2e-3)
    assert number(row[2]) == pytest.approx(mean_width(result["x"]), rel=2e-3)
    counts = [len(study.chebyshev(degree).parameters) + 1 for degree in (2, 3, 4)]
    assert [int(count) for count in re.findall(r"\d+", text)] == counts
    assert not alternatives(study.chebyshev(1))


def test_half_of_a_hull_of_independent_runs():
    study = cc.Study(oscillator, BOX)
    result = study.band(82, coverage=0.95)
    assert result.requirement.independent
    _, text = found(result)
    # Half of 82 independent runs: 1 - 2 / (41 + 1).
    assert f"{math.floor(1e4 * (1.0 - 2.0 / 42.0)) / 100.0:g} %" in text


def test_a_scan_of_fewer_values():
    study = cc.Study(oscillator, BOX)
    result = study.scan(5)
    table, _ = found(result)
    [row] = table.rows
    less = study.scan(3)  # its values are the first, third and fifth of five
    assert number(row[1]) == pytest.approx(mean_width(less["x"]), rel=2e-3)
    assert number(row[2]) == pytest.approx(mean_width(result["x"]), rel=2e-3)
    assert re.findall(r"\d+", table.caption) == ["9", "3", "3", "5", "5", "16"]
    inside = (result["x"].runs[:25] >= less["x"].lower) & (result["x"].runs[:25] <= less["x"].upper)
    # All samples of the nine runs are inside; the share is that of the others, rounded down.
    share = 100.0 * (inside.mean() * 25.0 - 9.0) / 16.0
    assert share - 0.01 <= float(row[4].removesuffix(" %")) <= share
    assert not any(isinstance(block, Table) for block in alternatives(study.scan(2)))


def test_half_of_a_study_by_crank_angle():
    turn = cc.mechanisms.slider_crank().period
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.Interval.around(0.05, rel=0.01), "clearance": cc.Interval.around(2e-5, rel=0.3)},
        ["slider.x"],
        duration=turn,
        samples=31,
        rtol=1e-3,
    )
    result = study.band(16, revolutions=2)
    [row] = found(result)[0].rows
    first = study.band(8, revolutions=2)  # the first eight points of the sequence
    assert number(row[1]) == pytest.approx(mean_width(first["slider.x"]), rel=5e-3)
    assert number(row[2]) == pytest.approx(mean_width(result["slider.x"]), rel=5e-3)
    kept = result.values("slider.x")[8:]
    inside = (kept >= first["slider.x"].lower) & (kept <= first["slider.x"].upper)
    assert number(row[4]) == pytest.approx(math.floor(1e4 * inside.mean()) / 1e2, abs=0.02)
