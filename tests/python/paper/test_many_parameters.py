"""Precision against the number of parameters."""

import chebclear as cc
import pytest
from chebclear.paper import many_parameters as many


@pytest.fixture(scope="module")
def rows():
    return many.many_parameters(most=1, budgets=(9, 21), fresh=20)


def test_eight_parameters_with_stiffness_and_damping_among_them():
    box = many.parameters()
    assert len(box) == 8 and {"young_modulus", "restitution"} <= set(box)
    nominal = many.rubbing_slider_crank(**{name: side.midpoint for name, side in box.items()})
    plain = cc.mechanisms.slider_crank(convention="corrected")
    assert nominal.joints[-1].friction == plain.joints[-1].friction
    doubled = many.rubbing_slider_crank(friction_coefficient=2.0 * box["friction_coefficient"].midpoint)
    friction, usual = doubled.joints[-1].friction, plain.joints[-1].friction
    assert friction.static_coefficient == pytest.approx(2.0 * usual.static_coefficient)
    many.rubbing_slider_crank(**{name: side.upper for name, side in box.items()}).check()


def test_every_way_is_judged_by_the_same_runs(rows, tmp_path):
    assert [(row.way, row.runs) for row in rows] == [
        ("band", 10),
        ("band", 22),
        ("Eq. (31), degree 2", 4),
        ("Eq. (31), degree 3", 5),
        ("scan, 3 points", 4),
        ("scan, 5 points", 6),
        ("scan, 10 points", 11),
    ]
    band, scan = rows[1], rows[4]
    assert band.verdicts[:2] == ("resolved", "resolved") and band.error[0] < 0.01
    assert min(band.coverage[:2]) > 0.99
    # The ends of the interval are among the points of a scan, and the displacement is monotone in the length.
    assert scan.coverage[0] > 0.99 and scan.width[0] == pytest.approx(1.0, abs=0.02)
    many.write(rows, tmp_path)
    text = (tmp_path / "many_parameters.md").read_text(encoding="utf-8")
    assert "| 1 " in text and "Eq. (31), degree 3" in text
    assert (tmp_path / "many_parameters.png").stat().st_size > 10_000
