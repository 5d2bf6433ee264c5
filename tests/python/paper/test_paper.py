"""The case study against the closed form, the paper and itself."""

import math

import numpy as np
import pytest
from chebclear import mechanisms, simulate
from chebclear.paper import case_study as paper, output as paper_output
from chebclear.study.band.running import running_maximum
from chebclear.study.band.zones import spans_below


@pytest.fixture(scope="module")
def study():
    return paper.case_study()


@pytest.fixture(scope="module")
def bands():
    return paper.ideal_bands()


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
        assert bands["slider.x"].errors() == pytest.approx((0.078, 0.220), abs=1e-3)
        assert bands["slider.vx"].errors() == pytest.approx((0.437, 0.437), abs=1e-3)

    def test_widths(self, bands):
        x, vx = bands["slider.x"], bands["slider.vx"]
        assert (x.scan_upper - x.scan_lower)[paper.SECOND].max() == pytest.approx(34.42e-3, abs=1e-5)
        assert (x.upper - x.lower)[paper.SECOND].max() == pytest.approx(34.9e-3, abs=1e-4)
        assert (vx.scan_upper - vx.scan_lower)[paper.SECOND].max() == pytest.approx(3.191, abs=1e-3)
        assert (vx.upper - vx.lower)[paper.SECOND].max() == pytest.approx(3.3705, abs=1e-3)

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
                np.testing.assert_allclose(bands[output].sensitivity[length], expected, atol=2e-3 * size)


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
        # beside the roots of each of four grids; 3 single ones.
        assert study.runs == 2 * (2 * 20 + 101 + 2 * (8 + 11) + 3)
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
                ideal = convention.ideal["slider.x"].sensitivity[length][paper.SECOND]
                real = convention.sensitivity("0.02", "slider.x", length)[paper.SECOND]
                np.testing.assert_allclose(real, ideal, atol=0.01 * np.abs(ideal).max())

    def test_scan_holds_the_single_mechanisms(self, study):
        # Longest and shortest links are corners of the scan, but runs of another duration take other
        # steps and contacts amplify the difference to about 0.01 m/s, beside a band of up to 3 m/s.
        for convention in study.conventions.values():
            scan = convention.length_scans["0.02"]["slider.vx"]
            for name in ("longest", "shortest"):
                run = convention.single[name]["slider.vx"][:7201:5]
                assert (run >= scan.lower - 0.02).all()
                assert (run <= scan.upper + 0.02).all()

    def test_penetration_is_never_below_minus_the_clearance(self, study):
        for convention in study.conventions.values():
            for run in convention.single.values():
                assert run["wrist.penetration"].min() >= -2e-5 * (1.0 + 1e-9)

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
    text = paper_output.tables_markdown(study)
    printed = [f"{value:.2f}" for pair in paper_output.TABLE_3.values() for value in pair]
    printed += ["3.21", "3.36", "0.0074", "0.0266", "0.0076", "0.0341", "3.6", "4.5"]
    printed += ["0.35", "0.55", "0.0001", "0.2540", "1.25", "1.73", "0.0003", "0.7511"]
    cells = {cell.strip() for line in text.splitlines() if line.startswith("|") for cell in line.split("|")}
    assert set(printed) <= cells
    assert {"paper", "as_printed", "corrected"} <= cells
