"""Averaged spectra against closed forms and SciPy; load cycles against the example of ASTM E1049."""

import dataclasses
import math
import sys

import chebclear as cc
import numpy as np
import pytest
from chebclear.run.signals import averaged_power, cycles_of, spectrum_of
from refusals import refuses

ASTM = np.array([-2.0, 1.0, -3.0, 5.0, -1.0, 3.0, -4.0, 4.0, -2.0])


def crank(depth, turns=16, samples=4001):
    """A crank whose speed varies by this part within a turn, and the amplitudes of what it moves."""
    body = cc.Body("crank", 1.0, 1.0, points={"O": (0.0, 0.0), "A": (0.3, 0.0)})
    way = cc.motions.Motion("drive", "axle", f"2*pi*time + {depth}*sin(2*pi*time)")
    scene = cc.Scene([body], [cc.Revolute("axle", "ground", "crank.O")], drives=[way])
    return cc.simulate(scene, duration=turns, samples=samples, outputs=["crank.angle", "crank.A.x"])


class TestSpectrum:
    @pytest.mark.parametrize("length", [100, 101])
    def test_it_is_the_average_of_welch(self, length):
        signal = pytest.importorskip("scipy.signal")
        noise = np.random.default_rng(1).normal(size=1003)
        overlap = length - length // 2
        _, power = signal.welch(noise, nperseg=length, noverlap=overlap, scaling="spectrum")
        np.testing.assert_allclose(averaged_power(noise, length)[0], power, rtol=1e-12)

    def test_equal_steps_of_the_angle_keep_an_order_that_a_varying_speed_smears(self):
        """cos 7 theta at +-10 % speed: J0(0.7)^2 / 2 of its power stay in the line over the frequency."""
        special = pytest.importorskip("scipy.special")
        t = np.linspace(0.0, 40.0, 20001)
        theta = 2.0 * np.pi * t + 0.1 * np.sin(2.0 * np.pi * t)
        wave = np.cos(7.0 * theta)
        orders = spectrum_of(t, wave, "y", "", "crank", theta, None)
        assert orders.lines[np.argmax(orders.power)] == 7.0
        assert orders.power.max() == pytest.approx(0.5, abs=1e-5)
        frequencies = spectrum_of(t, wave, "y", "", None, None, None)
        place = np.argmin(abs(frequencies.lines - 7.0))
        assert frequencies.power[place] == pytest.approx(0.5 * special.j0(0.7) ** 2, rel=1e-3)

    @pytest.mark.parametrize("angle", ["crank", "axle"])
    def test_a_crank_pin_has_the_first_order_alone(self, angle):
        run = crank(0.3)
        run = dataclasses.replace(run, columns=(f"{angle}.angle", "crank.A.x"))
        found = run.spectrum("crank.A.x", angle=angle)
        assert found.amplitude[found.lines == 1.0] == pytest.approx(0.3, abs=1e-6)
        assert found.amplitude[abs(found.lines - 1.0) > 0.6].max() < 1e-6
        assert (found.unit, found.pieces) == ("m", 7) and "order 1: " in str(found)
        raw = run.spectrum("crank.A.x", window=4.0)
        assert raw.amplitude[np.argmin(abs(raw.lines - 2.0))] > 0.02  # smeared to the second
        assert raw.lines[1] == pytest.approx(0.25)

    def test_pieces_have_at_least_four_revolutions(self):
        scene = cc.mechanisms.slider_crank(clearance_at=())
        run = cc.simulate(scene, duration=16 * scene.period, samples=1601, outputs=["slider.ax"])
        found = run.spectrum("slider.ax")
        assert found.lines[4] == pytest.approx(1.0 / scene.period, rel=1e-3) and found.pieces == 7

    def test_a_falling_angle_counts_as_well(self):
        run = crank(0.3)
        back = dataclasses.replace(run, samples=run.samples * [-1.0, 1.0])
        np.testing.assert_allclose(
            back.spectrum("crank.A.x", angle="crank").power, run.spectrum("crank.A.x", angle="crank").power
        )

    def test_power_at_the_end_of_the_lines_is_warned_of(self):
        t = np.linspace(0.0, 1.0, 1001)
        with pytest.warns(cc.ChebclearWarning):
            spectrum_of(t, np.sin(2.0 * np.pi * 490.0 * t), "y", "m", None, None, None)

    def test_bad_input(self):
        run = crank(0.3, turns=3, samples=61)
        for arguments, error in (
            ({"window": -1.0}, cc.errors.ArgumentError),
            ({"window": 4.0}, cc.errors.ArgumentError),
            ({"window": 4.0, "angle": "crank"}, cc.errors.ArgumentError),
            ({"window": 1.5, "angle": "crank"}, cc.errors.ArgumentError),
            ({"angle": 3}, cc.errors.ArgumentTypeError),
            ({"angle": "krank"}, cc.errors.UnknownNameError),
        ):
            with pytest.raises(error):
                run.spectrum("crank.A.x", **arguments)
        with refuses("output", error=TypeError):
            run.spectrum(3)
        for angle in (np.zeros(61), np.linspace(0, 3, 61)):  # it stands still, or turns less than once
            wrong = dataclasses.replace(run, samples=np.column_stack([angle, run["crank.A.x"]]))
            with pytest.raises(cc.errors.ArgumentError):
                wrong.spectrum("crank.A.x", angle="crank")
        gap = dataclasses.replace(run, samples=np.where(run.samples > 0.29, np.nan, run.samples))
        with pytest.raises(cc.errors.ArgumentError):
            gap.spectrum("crank.A.x")


class TestCycles:
    @pytest.fixture(autouse=True)
    def _package(self):
        pytest.importorskip("rainflow")

    def test_the_example_of_the_standard(self):
        with pytest.warns(cc.ChebclearWarning):
            found = cycles_of(ASTM, "force", "N")
        ranges = sorted(set(found.ranges))
        counts = [found.counts[found.ranges == one].sum() for one in ranges]
        assert (ranges, counts) == ([3.0, 4.0, 6.0, 8.0, 9.0], [0.5, 1.5, 0.5, 1.0, 0.5])
        assert list(found.ranges) == sorted(found.ranges, reverse=True)
        assert found.means[0] == 0.5 and "largest range 9" in str(found)

    def test_a_crank_pin_makes_a_cycle_a_turn(self):
        found = crank(0.0, turns=5).cycles("crank.A.x")
        large = found.ranges > 0.1
        assert found.counts[large].sum() == 5.0
        np.testing.assert_allclose(found.ranges[large], 0.6, rtol=1e-4)
        np.testing.assert_allclose(found.means[large], 0.0, atol=1e-4)

    def test_it_is_a_feature_of_a_study(self):
        def largest(run):
            return run.cycles("slider.ax").ranges[0]

        box = {"crank_length": cc.Interval(0.04, 0.05)}
        study = cc.Study(
            cc.mechanisms.slider_crank,
            box,
            ["slider.ax"],
            features={"range": largest},
            fixed={"clearance_at": ()},
            duration=0.06,
            samples=361,
        )
        lengths, found = np.array([[0.04], [0.05]]), study.function("range")
        # r omega^2 (1 + r / l) at the one dead center; the other or the valley beside it is below.
        assert np.all(found(lengths) > 1.9 * lengths[:, 0] * (209.44**2))
        assert found(lengths)[0] < found(lengths)[1]

    def test_bad_input(self, monkeypatch):
        run = crank(0.0, turns=2)
        with refuses("output", error=TypeError):
            run.cycles(["crank.A.x"])
        with pytest.raises(cc.errors.UnknownNameError):
            run.cycles("crank.A.X")
        with pytest.raises(cc.errors.ArgumentError):
            cycles_of(np.array([0.0, math.nan]), "force", "N")
        monkeypatch.setitem(sys.modules, "rainflow", None)
        with pytest.raises(ImportError):
            run.cycles("crank.A.x")


def test_pictures_have_units():
    run = crank(0.3)
    ax = run.spectrum("crank.A.x", angle="crank").plot(unit="mm")
    assert (ax.get_xlabel(), ax.get_yscale()) == ("order of crank [-]", "log")
    assert ax.get_ylabel().endswith("[mm]")
    ones = np.ones(3)
    ax = cc.results.Cycles("crank.A.x", "m", ones, ones, ones).plot(unit="mm")
    assert ax.lines[0].get_ydata().max() == 1000.0
    for draw in (cc.plots.plot_spectrum, cc.plots.plot_cycles):
        with pytest.raises(cc.errors.ArgumentTypeError):
            draw(run)
