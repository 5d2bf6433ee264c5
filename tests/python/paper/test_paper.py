"""The case study against the closed form, the paper and itself."""

import math

import numpy as np
import pytest
from chebclear import mechanisms, simulate
from chebclear.paper import case_study as paper
from chebclear.study.band.band import running_maximum
from chebclear.study.band.zones import spans_below


@pytest.fixture(scope="module")
def study():
    return paper.case_study()


@pytest.fixture(scope="module")
def bands():
    return paper.ideal_studies()


def ideal_slider_crank(angle, crank_length, rod_length, crank_speed=paper.CRANK_SPEED):
    """Position, velocity and acceleration of the slider of an ideal in-line slider-crank, in closed form."""
    sine, cosine = np.sin(angle), np.cos(angle)
    offset = crank_length * sine  # height of the crank pin, and of the far end of the rod below it
    reach = np.sqrt(rod_length * rod_length - offset * offset)  # the rod's projection on the guide
    reach_slope = -crank_length * crank_length * sine * cosine / reach
    reach_curvature = -(crank_length**2 * (cosine * cosine - sine * sine) + reach_slope * reach_slope) / reach
    position = crank_length * cosine + reach
    velocity = crank_speed * (reach_slope - crank_length * sine)
    acceleration = crank_speed**2 * (reach_curvature - crank_length * cosine)
    return position, velocity, acceleration


class TestIdealMechanism:
    def test_the_engine_gives_the_closed_form(self):
        scene = mechanisms.slider_crank(crank_length=0.053, rod_length=0.117, clearance_at=())
        run = simulate(scene, duration=paper.DURATION, samples=paper.SAMPLES)
        assert run.stats.evaluations == 0  # nothing is integrated
        position, velocity, acceleration = ideal_slider_crank(np.radians(paper.CRANK_ANGLE), 0.053, 0.117)
        np.testing.assert_allclose(run["slider.x"], position, rtol=0, atol=1e-13)
        np.testing.assert_allclose(run["slider.vx"], velocity, rtol=0, atol=1e-10)
        np.testing.assert_allclose(run["slider.ax"], acceleration, rtol=0, atol=1e-7)


class TestIdealBands:
    """Oracles worked out independently: Table 3's measure on the mechanism without clearance."""

    def test_errors(self, bands):
        errors = paper.bound_errors(*bands)
        for output, expected in (("slider.x", (0.078, 0.220)), ("slider.vx", (0.437, 0.437))):
            found = 100.0 * errors[output].lower, 100.0 * errors[output].upper
            assert found == pytest.approx(expected, abs=1e-3)

    def test_widths(self, bands):
        x, vx, scan_x, scan_vx = (paper.largest_width(some[name]) for some in bands for name in some)
        assert (scan_x, scan_vx) == (pytest.approx(34.42e-3, abs=1e-5), pytest.approx(3.191, abs=1e-3))
        assert (x, vx) == (pytest.approx(34.9e-3, abs=1e-4), pytest.approx(3.3705, abs=1e-3))

    def test_sensitivities_are_the_closed_form_derivatives(self, bands):
        angle = np.radians(paper.CRANK_ANGLE)
        for length, other, change in (
            ("crank_length", "rod_length", 0.05),
            ("rod_length", "crank_length", 0.12),
        ):
            middle = {"crank_length": 0.05, "rod_length": 0.12}
            far, near = (
                ideal_slider_crank(
                    angle, **{length: middle[length] * (1 + sign * 1e-5), other: middle[other]}
                )
                for sign in (1, -1)
            )
            for column, output, size in (
                (0, "slider.x", change),
                (1, "slider.vx", change * paper.CRANK_SPEED),
            ):
                expected = (far[column] - near[column]) / 2e-5
                # The interpolation error of degree 3 on +-10 % is a few 1e-4 of the response's scale.
                found = paper.sensitivity(bands[0][output], length)
                np.testing.assert_allclose(found, expected, atol=2e-3 * size)


def test_running_maximum():
    values = np.random.default_rng(1).normal(size=50)
    expected = [values[max(0, i - 3) : i + 4].max() for i in range(50)]
    np.testing.assert_array_equal(running_maximum(values, 3), expected)


def test_spans_below():
    angle = np.arange(8.0)
    values = np.array([0.0, 0.0, 2.0, 2.0, 0.0, 2.0, 0.0, 0.0])
    assert spans_below(angle, values, 1.0) == [(0.0, 1.0), (4.0, 4.0), (6.0, 7.0)]
    assert spans_below(angle, values, 3.0) == [(0.0, 7.0)]
    assert spans_below(angle, values, 0.0) == []


def test_second_revolution():
    angle = paper.CRANK_ANGLE[paper.SECOND]
    assert (angle[0], angle[-1], len(angle)) == (360.0, 720.0, 721)


class TestCaseStudy:
    def test_displacement_errors_of_table_3_as_printed(self, study):
        errors = study.to_dict()["as_printed"]["table3"]["slider.x"]
        assert errors["lower"] == pytest.approx(0.078, abs=5e-3)
        assert errors["upper"] == pytest.approx(0.219, abs=5e-3)

    def test_table_5_as_printed(self, study):
        # An independent model gave 0.361 mm and 0.261 m/s; impacts amplify the integrators' differences.
        table = study.to_dict()["as_printed"]["table5"]["0.2"]
        assert table["width_x"] == pytest.approx(0.361, rel=0.1)
        assert table["sensitivity_vx"] == pytest.approx(0.261, rel=0.1)

    def test_counts_of_runs(self, study):
        # 16 runs at two clearances, 100 at one of them, 4 and 10 at two others, each with the nominal run, 3
        # beside the roots of each of four grids.
        assert study.runs == 2 * (2 * 20 + 101 + 2 * (8 + 11))
        assert study.seconds > 0.0

    def test_every_number_is_finite(self, study):
        def walk(value):
            if isinstance(value, dict):
                for part in value.values():
                    walk(part)
            else:
                assert math.isfinite(value)

        walk(study.to_dict())

    def test_larger_clearance_moves_the_velocity_sensitivity_more(self, study):
        for name in paper.CONVENTIONS:
            table = study.to_dict()[name]["table4"]
            for length in paper.LENGTHS:
                assert 1.5 * table["0.01"][length] < table["0.02"][length]

    def test_displacement_sensitivity_is_nearly_ideal(self, study):
        for convention in study.conventions.values():
            for length in paper.LENGTHS:
                studies = (convention.lengths["0.02"], convention.ideal)
                real, ideal = (paper.sensitivity(one["slider.x"], length)[paper.SECOND] for one in studies)
                np.testing.assert_allclose(real, ideal, atol=0.01 * np.abs(ideal).max())

    def test_restraint_zones(self, study):
        angle = paper.CRANK_ANGLE[paper.SECOND]
        for convention in study.conventions.values():
            zones = convention.restraint_zones("0.02", "crank_length")
            assert zones.threshold == 0.5 * np.abs(zones.deviation).max()
            assert zones.spans
            for start, end in zones.spans:
                inside = (angle >= start) & (angle <= end)
                assert (np.abs(zones.deviation[inside]) < zones.threshold).all()


def test_tables_hold_the_papers_values(study):
    text = paper.tables_markdown(study)
    printed = [f"{value:.2f}" for pair in paper.TABLE_3.values() for value in pair]
    printed += ["3.21", "3.36", "0.0074", "0.0266", "0.0076", "0.0341", "3.6", "4.5"]
    printed += ["0.35", "0.55", "0.0001", "0.2540", "1.25", "1.73", "0.0003", "0.7511"]
    cells = {cell.strip() for line in text.splitlines() if line.startswith("|") for cell in line.split("|")}
    assert set(printed) <= cells
    assert {"paper", "as_printed", "corrected"} <= cells
