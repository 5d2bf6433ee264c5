"""Pictures of studies: tornado, shares, coefficients, predictions and bifurcation diagrams."""

import dataclasses

import chebclear as cc
import numpy as np
import pytest
from chebclear.study.features.features import FeatureResult, FeatureTable
from chebclear.study.polynomials.points import even_points
from matplotlib.figure import Figure
from refusals import refuses


@pytest.fixture
def ax():
    return Figure(figsize=(6.0, 3.5), layout="constrained").subplots()


def feature_of(name, unit, parameters, points, values):
    """A feature of runs at points of the box from -1 to 1."""
    box = dict.fromkeys(parameters, cc.Interval(-1.0, 1.0))
    runs, nominal = values[:, :, None], values.mean(axis=0)[:, None]
    table = FeatureTable((name,), runs, nominal, box, points, random=True, units=(unit,))
    return FeatureResult(name, table)


@pytest.fixture(scope="module")
def feature():
    """A feature that rises with the first parameter, falls with the second and ignores the third."""
    points = even_points(60, 3)
    noise = np.random.default_rng(0).normal(scale=0.3, size=60)
    values = 1000.0 + 8.0 * points[:, 0] - 3.0 * points[:, 1] + noise
    names = ["link_length", "clearance", "oil"]
    return feature_of("peak_force", "N", names, points, values[:, None])


def texts(ax):
    return [text.get_text() for text in ax.texts]


class TestTornado:
    def test_bars_go_from_the_mean_to_the_ends(self, feature, ax):
        cc.plots.plot_tornado(feature, ax=ax)
        assert [text.get_text() for text in ax.get_yticklabels()] == ["link length", "clearance", "oil"]
        assert ax.get_xlabel() == "peak force, on average [N]"
        low, high = ax.patches[:2]
        assert low.get_x() == pytest.approx(1000.0, abs=0.3) and low.get_width() == pytest.approx(
            -8.0, abs=0.4
        )
        assert high.get_width() == pytest.approx(8.0, abs=0.4)
        # The value at the lower end stands on the side of its bar, also where the output falls.
        swing = feature.effects.swings["clearance"]
        sides = {text.get_text(): text.get_ha() for text in ax.texts}
        assert swing.at_lower > swing.at_upper
        assert sides[f"{swing.at_lower:.1f}"] == "left"
        assert sides[f"{swing.at_upper:.1f}"] == "right"

    def test_bars_to_one_side_do_not_hide_one_another(self, ax):
        points = np.random.default_rng(0).uniform(-1.0, 1.0, (60, 2))
        values = points[:, :1] - (points[:, 1:] - 0.1) ** 2
        cc.plots.plot_tornado(feature_of("y", "", ["line", "bowl"], points, values), ax=ax)
        ax.figure.draw_without_rendering()
        bars = [bar.get_window_extent() for bar in ax.patches]
        assert not any(one.padded(-1.0).overlaps(other) for one in bars for other in bars if one is not other)
        for text in ax.texts:
            assert not any(text.get_window_extent().overlaps(bar) for bar in bars)

    def test_values_and_names_are_in_the_picture_and_the_legend_covers_no_bar(self, feature, ax):
        cc.plots.plot_tornado(feature, ax=ax)
        ax.figure.draw_without_rendering()
        box, legend = ax.get_window_extent(), ax.get_legend().get_window_extent()
        for text in ax.texts:
            extent = text.get_window_extent()
            assert box.x0 <= extent.x0 and extent.x1 <= box.x1
            assert not legend.overlaps(extent)
        for bar in ax.patches:
            assert not legend.overlaps(bar.get_window_extent())
        assert min(text.get_window_extent().x0 for text in ax.get_yticklabels()) >= 0.0

    def test_small_ones_are_counted(self, feature, ax, monkeypatch):
        monkeypatch.setattr("chebclear.plots.features._MOST_ROWS", 2)
        cc.plots.plot_tornado(feature, ax=ax)
        assert len(ax.patches) == 4 and texts(ax)[-1] == "1 more parameters move it less"


def test_shares_are_those_of_the_effects(feature, ax):
    cc.plots.plot_shares(feature, ax=ax)
    rows = [text.get_text() for text in ax.get_yticklabels()]
    assert rows == ["link length", "clearance", "oil", "parameters together", "scatter"]
    effects = feature.effects
    found = [bar.get_width() for bar in ax.patches]
    expected = [effects.main[name].value for name in ("link_length", "clearance", "oil")]
    np.testing.assert_allclose(
        found, 100.0 * np.array([*expected, effects.interactions.value, effects.scatter.value])
    )
    whisker = ax.lines[0].get_xdata()
    np.testing.assert_allclose(whisker, 100.0 * np.array(effects.main["link_length"][1:]))
    assert texts(ax)[0] == f"{100.0 * expected[0]:.0f} %"


@pytest.fixture(scope="module")
def study():
    return cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.Interval.around(0.05, rel=0.1), "rod_length": cc.Interval.around(0.12, rel=0.1)},
        outputs=["slider.vx"],
        duration=cc.mechanisms.slider_crank().period,
        samples=41,
        fixed={"clearance_at": ()},
        features={"peak_velocity": cc.features.peak("slider.vx")},
    )


@pytest.fixture(scope="module")
def smooth(study):
    return study.chebyshev(degree=4)


def test_the_ranking_of_a_study(study, ax):
    ranking = study.band(21).features["peak_velocity"].ranking()
    cc.plots.plot_ranking(ranking, ax=ax)
    np.testing.assert_allclose(
        [bar.get_width() for bar in ax.patches], [100.0 * row.narrowing.value for row in ranking]
    )
    assert ax.get_xlabel().replace("\n", " ") == "peak velocity narrows when the tolerance is halved, by [%]"


def test_coefficients_decay_where_the_response_is_smooth(smooth, ax):
    band = smooth["slider.vx"]
    cc.plots.plot_coefficients(band, ax=ax)
    crank, rod = ax.lines
    assert (crank.get_label(), rod.get_label(), ax.get_yscale()) == ("crank length", "rod length", "log")
    sizes = np.abs(band.coefficients).max(axis=-1)
    np.testing.assert_allclose(crank.get_ydata(), sizes.max(axis=1))
    np.testing.assert_allclose(rod.get_ydata(), sizes.max(axis=0))
    assert crank.get_ydata()[4] < 1e-3 * crank.get_ydata()[1]


def test_predictions_lie_on_the_diagonal(study, smooth, ax):
    scan = study.scan(3)
    cc.plots.plot_prediction(smooth["slider.vx"], scan["slider.vx"], unit="mm/s", ax=ax)
    points, diagonal = ax.lines
    np.testing.assert_array_equal(points.get_xdata(), 1e3 * scan["slider.vx"].runs.ravel())
    np.testing.assert_allclose(points.get_ydata(), points.get_xdata(), atol=10.0)
    np.testing.assert_array_equal(diagonal.get_xdata(), diagonal.get_ydata())
    assert points.get_label() == "9 runs, largest error below 0.01 % of their range"
    with pytest.raises(cc.errors.ArgumentError):
        cc.plots.plot_prediction(smooth["slider.vx"], dataclasses.replace(scan["slider.vx"], name="x"))


class TestBifurcation:
    @pytest.fixture
    def diagram(self):
        return cc.bifurcation(
            cc.mechanisms.slider_crank,
            "clearance",
            [1e-5, 4e-5],
            "slider.ax",
            periods=2,
            discard=1,
            threads=2,
        )

    def test_samples_are_those_of_single_runs(self, diagram):
        for row, clearance in zip(diagram.samples, (1e-5, 4e-5), strict=True):
            scene = cc.mechanisms.slider_crank(clearance=clearance)
            run = cc.simulate(
                scene, duration=2.0 * scene.period, samples=3, skip=scene.period, outputs=["slider.ax"]
            )
            np.testing.assert_array_equal(row, run["slider.ax"])
        assert repr(diagram) == "<Bifurcation of slider.ax over clearance: 2 values, 3 periods each>"

    def test_the_period_follows_the_drive(self):
        found = cc.bifurcation(
            cc.mechanisms.slider_crank,
            "crank_speed",
            [100.0, 200.0],
            "slider.vx",
            periods=4,
            discard=0,
            fixed={"clearance_at": (), "crank_angle": 1.0},
        )
        np.testing.assert_allclose(found.period, 2.0 * np.pi / np.array([100.0, 200.0]), rtol=1e-12)
        # Without clearance every revolution is the same, and twice as fast at twice the speed.
        np.testing.assert_array_equal(found.points(1e-9 * 20.0), [1, 1])
        np.testing.assert_allclose(found.samples[1], 2.0 * found.samples[0], rtol=1e-9)

    def test_picture_and_table(self, diagram, ax):
        diagram.plot(ax=ax, parameter_unit="µm", parameter_scale=1e6, unit="km/s²")
        (points,) = ax.lines
        np.testing.assert_allclose(points.get_xdata(), [10.0] * 3 + [40.0] * 3)
        np.testing.assert_allclose(points.get_ydata(), 1e-3 * diagram.samples.ravel())
        assert ax.get_xlabel() == "clearance [µm]"
        assert ax.get_ylabel().replace("\n", " ") == "x acceleration of slider, once a period [km/s²]"
        np.testing.assert_array_equal(diagram.to_dict()["slider.ax"], diagram.samples.ravel())

    def test_a_run_that_fails_is_nan_and_said(self):
        with pytest.warns(cc.ChebclearWarning):
            found = cc.bifurcation(
                cc.mechanisms.slider_crank, "clearance", [2e-5, 2e-4], periods=1, discard=0, max_steps=4100
            )
        assert np.isnan(found.samples[0]).all() and np.isfinite(found.samples[1]).all()
        assert found.points(1e-9)[0] == 0

    def test_an_interrupted_sweep_stops(self):
        def interrupt(done, total):
            raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            cc.bifurcation(
                cc.mechanisms.slider_crank,
                "clearance",
                [1e-5] * 4,
                periods=1,
                discard=0,
                progress=interrupt,
                threads=1,
            )

    def test_what_is_wrong_is_said(self):
        with refuses("build", error=ValueError):
            cc.bifurcation(cc.mechanisms.slider_crank, "clearence", [1e-5])
        with refuses("values", error=TypeError):
            cc.bifurcation(cc.mechanisms.slider_crank, "clearance", [])
        with refuses("sample_per"):
            cc.bifurcation(cc.mechanisms.slider_crank, "clearance", [1e-5], sample_per="turn")
        with pytest.raises(cc.errors.ArgumentError):
            cc.bifurcation(cc.mechanisms.slider_crank, "clearance", [1e-5], fixed={"clearance_at": ()})
