"""Plots: what they return, label and leave alone; the short-time spectrum against known signals."""

import subprocess
import sys

import chebclear as cc
import matplotlib as mpl
import numpy as np
import pytest
from chebclear.plots import bands as band_plots, runs as run_plots, spectra
from chebclear.scene.columns import column_unit
from matplotlib.axes import Axes
from matplotlib.figure import Figure

DURATION = 0.004  # [s]; some impacts, a millisecond to compute


@pytest.fixture(scope="module")
def run():
    scene = cc.mechanisms.slider_crank(
        crank_length=0.05, rod_length=0.12, clearance=2e-5, crank_speed=cc.rpm(2000)
    )
    return cc.simulate(scene, duration=DURATION, samples=401)


@pytest.fixture(scope="module")
def study():
    return cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.Interval.around(0.05, rel=0.10)},
        outputs=["slider.vx", "wrist.penetration"],
        duration=DURATION,
        samples=101,
        fixed={"rod_length": 0.12, "clearance": 2e-5, "crank_speed": cc.rpm(2000)},
    )


@pytest.fixture(scope="module")
def bands(study):
    return study.chebyshev(degree=3), study.scan(5)


@pytest.fixture
def ax():
    return Figure().subplots()


@pytest.fixture(params=["trajectory", "orbit", "band", "sensitivity", "spectrogram"])
def draw(request, run, bands):
    """One of the plot functions with its data filled in."""
    band = bands[0]["slider.vx"]
    return {
        "trajectory": lambda **more: cc.plots.plot_trajectory(run, "slider.vx", **more),
        "orbit": lambda **more: cc.plots.plot_orbit(run, "wrist", **more),
        "band": lambda **more: cc.plots.plot_band(band, scan=bands[1]["slider.vx"], nominal=True, **more),
        "sensitivity": lambda **more: cc.plots.plot_sensitivity(
            band, "crank_length", parameter_unit="m", **more
        ),
        "spectrogram": lambda **more: cc.plots.plot_spectrogram(run, "slider.vx", **more),
    }[request.param]


def test_draws_on_the_given_axes(draw, ax):
    assert draw(ax=ax) is ax
    assert ax.lines or ax.collections


def test_new_axes_labels_and_untouched_settings(draw):
    before = dict(mpl.rcParams)
    ax = draw()
    assert isinstance(ax, Axes)
    assert ax.get_xlabel().endswith("]")
    assert ax.get_ylabel().endswith("]")
    assert dict(mpl.rcParams) == before


def test_pyplot_is_not_imported():
    code = (
        "import sys, chebclear as cc\n"
        "assert 'matplotlib' not in sys.modules, 'importing the package must not import matplotlib'\n"
        "run = cc.simulate(cc.mechanisms.slider_crank(), duration=0.01, samples=201)\n"
        "cc.plots.plot_spectrogram(run, 'slider.x')\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=600)


@pytest.mark.parametrize(
    "draw_wrong",
    [
        lambda run, bands: cc.plots.plot_trajectory(run, ["slider.x", "slyder.x"]),
        lambda run, bands: cc.plots.plot_orbit(run, "wrst"),
        lambda run, bands: cc.plots.plot_sensitivity(bands[0]["slider.vx"], "crank_lenght"),
        lambda run, bands: cc.plots.plot_sensitivity(bands[1]["slider.vx"], "crank_length"),
        lambda run, bands: cc.plots.plot_spectrogram(run, "slyder.x"),
    ],
)
def test_a_wrong_name_leaves_no_empty_figure(draw_wrong, run, bands, monkeypatch):
    for module in (run_plots, band_plots, spectra):
        monkeypatch.setattr(module, "new_axes", lambda ax: pytest.fail("axes were made"))
    with pytest.raises((KeyError, ValueError)):
        draw_wrong(run, bands)


def test_a_spectrogram_takes_a_run_and_a_column(run, ax):
    cc.plots.plot_spectrogram(run, "slider.vx", ax=ax)
    label = ax.figure.axes[1].get_ylabel().replace("\n", " ")
    assert label == "amplitude of x velocity of slider [dB re 1 m/s]"
    for pair in (("slider.vx", run), (run, run["slider.vx"]), (run.t, "slider.vx"), (1, 2)):
        with pytest.raises(TypeError):
            cc.plots.plot_spectrogram(*pair)


class TestTrajectory:
    def test_unit_and_keywords(self, run, ax):
        cc.plots.plot_trajectory(run, "wrist.penetration", ax=ax, unit="µm", color="red", linewidth=3.0)
        (line,) = ax.lines
        np.testing.assert_allclose(line.get_ydata(), 1e6 * run["wrist.penetration"])
        assert (line.get_color(), line.get_linewidth()) == ("red", 3.0)
        assert ax.get_ylabel() == "penetration in wrist [µm]"

    def test_a_label_has_room(self, run):
        names = [name for name in run.columns if column_unit(name) == "m/s"]
        assert len(names) > 5
        for columns, label in ((names, "[m/s]"), (["slider.vx", "rod.vx"], "x velocity [m/s]")):
            ax = cc.plots.plot_trajectory(run, columns, ax=Figure(figsize=(6.0, 3.0)).subplots())
            assert ax.get_ylabel() == label
            assert len(ax.get_legend().get_texts()) == len(columns)

    def test_columns_of_different_units(self, run, ax):
        with pytest.raises(cc.errors.ArgumentError):
            cc.plots.plot_trajectory(run, ["slider.x", "slider.vx"], ax=ax)

    def test_unit_that_does_not_fit(self, run, ax):
        with pytest.raises(cc.errors.ArgumentError):
            cc.plots.plot_trajectory(run, "slider.vx", ax=ax, unit="kN")


def test_orbit_finds_the_clearance(run, ax):
    cc.plots.plot_orbit(run, "wrist", ax=ax, unit="mm")
    circle = ax.lines[0]
    np.testing.assert_allclose(np.hypot(*circle.get_data()), 0.02, rtol=1e-6)


class TestBand:
    def test_area_bounds_scan_and_nominal(self, bands, ax):
        band, scan = (result["wrist.penetration"] for result in bands)
        cc.plots.plot_band(band, ax=ax, unit="µm", scan=scan, nominal=True, alpha=0.5)
        assert ax.collections[0].get_alpha() == 0.5
        drawn = [line.get_ydata() for line in ax.lines]
        for values in (band.lower, band.upper, scan.lower, scan.upper, band.nominal):
            assert any(np.allclose(1e6 * values, y) for y in drawn)
        assert [text.get_text() for text in ax.get_legend().get_texts()] == [
            "bounds of a polynomial that misses runs",
            "scan",
            "nominal",
        ]

    def test_other_abscissa(self, bands, ax):
        band = bands[0]["slider.vx"]
        cc.plots.plot_band(band, ax=ax, x=12000.0 * band.t, x_label="crank angle [deg]")
        assert ax.get_xlabel() == "crank angle [deg]"
        assert ax.lines[0].get_xdata()[-1] == pytest.approx(12000.0 * DURATION)


def test_sensitivity_units(bands, ax):
    band = bands[0]["slider.vx"]
    physical = cc.plots.plot_sensitivity(band, "crank_length", ax=ax, parameter_unit="m")
    assert (
        physical.get_ylabel().replace("\n", " ")
        == "sensitivity of x velocity of slider to crank length [m/s per m]"
    )
    normalized = cc.plots.plot_sensitivity(band, "crank_length", ax=Figure().subplots(), normalized=True)
    assert (
        normalized.get_ylabel().replace("\n", " ")
        == "sensitivity of x velocity of slider to crank length [m/s per half interval]"
    )
    np.testing.assert_allclose(
        normalized.lines[0].get_ydata(), 0.005 * physical.lines[0].get_ydata(), rtol=1e-9, atol=1e-12
    )


def test_two_sensitivities_are_told_apart(bands, ax):
    velocity, penetration = bands[0]["slider.vx"], bands[0]["wrist.penetration"]
    cc.plots.plot_sensitivity(velocity, "crank_length", ax=ax, parameter_unit="m")
    cc.plots.plot_sensitivity(velocity, "crank_length", ax=ax, parameter_unit="m", label="again")
    written = "sensitivity of x velocity of slider to crank length [m/s per m]"
    assert ax.get_ylabel().replace("\n", " ") == written
    cc.plots.plot_sensitivity(velocity, "crank_length", ax=ax, parameter_unit="m", linestyle=":")
    assert ax.get_ylabel() == "sensitivity of x velocity of slider [m/s per m]"
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert words == ["to crank length", "again", "to crank length"]
    cc.plots.plot_sensitivity(penetration, "crank_length", ax=ax, normalized=True)
    assert ax.get_ylabel() == "sensitivity [see legend]"
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        "x velocity of slider to crank length [m/s per m]",
        "again",
        "x velocity of slider to crank length [m/s per m]",
        "penetration in wrist to crank length [m per half interval]",
    ]


class TestShortTimeSpectrum:
    def test_sine(self):
        t = np.linspace(0.0, 0.06, 7201)
        signal = 3.0 * np.sin(2.0 * np.pi * 9500.0 * t) + 100.0
        centers, frequencies, amplitude = spectra.short_time_spectrum(t, signal, window=2e-3)
        assert amplitude.shape == (len(frequencies), len(centers))
        peaks = frequencies[amplitude.argmax(axis=0)]
        assert np.abs(peaks - 9500.0).max() <= frequencies[1]
        np.testing.assert_allclose(amplitude.max(axis=0), 3.0, rtol=0.02)

    def test_chirp(self):
        t = np.linspace(0.0, 0.1, 4801)
        start, slope = 2000.0, 1e5  # [Hz], [Hz/s]
        signal = np.cos(2.0 * np.pi * (start * t + 0.5 * slope * t * t))
        centers, frequencies, amplitude = spectra.short_time_spectrum(t, signal, window=4e-3)
        peaks = frequencies[amplitude.argmax(axis=0)]
        np.testing.assert_allclose(peaks, start + slope * centers, atol=frequencies[2])

    def test_drawn_peak(self, ax):
        cart = cc.Body("cart", 1.0, 1.0)
        shaken = cc.motions.Motion("drive", "rail", cc.motions.Harmonic(1e-6, 5000.0 * 2.0 * np.pi))
        scene = cc.Scene([cart], [cc.Prismatic("rail", "ground", "cart", axis=(1.0, 0.0))], drives=[shaken])
        run = cc.simulate(scene, duration=0.06, samples=7201)
        cc.plots.plot_spectrogram(run, "cart.x", ax=ax, x=12000.0 * run.t, x_label="crank angle [deg]")
        level = np.asarray(ax.collections[0].get_array())
        row = level.reshape(level.shape[0], -1).max(axis=1).argmax()
        assert np.linspace(0.0, 60.0, level.shape[0])[row] == pytest.approx(5.0, abs=0.2)

    @pytest.mark.parametrize(("window", "overlap"), [(1e-6, 0.5), (1.0, 0.5), (2e-3, 1.0), (2e-3, -0.1)])
    def test_bad_arguments(self, window, overlap):
        t = np.linspace(0.0, 0.06, 7201)
        with pytest.raises(cc.errors.ArgumentError):
            spectra.short_time_spectrum(t, t, window=window, overlap=overlap)
