"""What a plot cannot draw is refused by a typed error that says what it takes."""

import chebclear as cc
import numpy as np
import pytest
from matplotlib.figure import Figure
from refusals import refuses


@pytest.fixture(scope="module")
def run():
    scene = cc.mechanisms.slider_crank()
    return cc.simulate(scene, duration=0.06, samples=201)


@pytest.fixture(scope="module")
def study():
    return cc.Study(
        cc.mechanisms.slider_crank,
        {"rod_length": cc.Interval.around(0.12, rel=0.01)},
        outputs=["slider.x"],
        features={"mean force": cc.features.mean("wrist.normal_force")},
        duration=0.002,
        samples=21,
    )


@pytest.fixture(scope="module")
def result(study):
    return study.chebyshev(degree=2)


DRAWN = {
    "trajectory": lambda it: cc.plots.plot_trajectory(it, "slider.x"),
    "orbit": lambda it: cc.plots.plot_orbit(it, "wrist"),
    "poincare": lambda it: cc.plots.plot_poincare(it, "slider.x", "slider.vx"),
    "contacts": cc.plots.plot_contacts,
    "spectrogram": lambda it: cc.plots.plot_spectrogram(it, "slider.x"),
    "scene": cc.plots.plot_scene,
    "animation": cc.animate,
    "band": cc.plots.plot_band,
    "sensitivity": lambda it: cc.plots.plot_sensitivity(it, "rod_length"),
    "coefficients": cc.plots.plot_coefficients,
    "prediction": lambda it: cc.plots.plot_prediction(it, it),
    "tornado": cc.plots.plot_tornado,
    "shares": cc.plots.plot_shares,
    "ranking": cc.plots.plot_ranking,
    "tradeoff": cc.plots.plot_tradeoff,
    "study tradeoff": cc.plots.plot_study_tradeoff,
    "bifurcation": cc.plots.plot_bifurcation,
}


@pytest.mark.parametrize("drawn", DRAWN)
@pytest.mark.parametrize("given", [None, "slider.x", 3, [], "study", "result"])
def test_what_is_no_result_is_refused(drawn, given, study, result):
    wrong = {"study": study, "result": result}.get(given, given) if isinstance(given, str) else given
    with pytest.raises((cc.errors.ArgumentTypeError, cc.errors.ArgumentError)):
        DRAWN[drawn](wrong)


@pytest.mark.parametrize("name", [3, ["slider.x"], b"slider.x", {}, "slider.*"])
def test_what_names_no_column(run, name):
    for draw in (
        lambda: cc.plots.plot_poincare(run, name, "slider.vx"),
        lambda: cc.plots.plot_poincare(run, "slider.x", name),
        lambda: cc.animate(run, name, frames=3),
        lambda: cc.plots.plot_spectrogram(run, name),
    ):
        with pytest.raises((TypeError, cc.errors.ArgumentError)):
            draw()


@pytest.mark.parametrize("names", [None, 3, [], {}, ["slider.x", 3], [["slider.x"]], b"slider.x"])
def test_what_names_no_columns(run, names):
    with pytest.raises(cc.errors.ArgumentTypeError):
        cc.plots.plot_trajectory(run, names)


def test_columns_by_a_pattern(run):
    drawn = cc.plots.plot_trajectory(run, "*.vx", ax=Figure().subplots())
    assert len(drawn.lines) == sum(name.endswith(".vx") for name in run.columns) > 1
    with pytest.raises(KeyError):
        cc.plots.plot_trajectory(run, "*.speed")
    # An unknown name is no matter of units.
    with pytest.raises(cc.errors.UnknownNameError):
        cc.plots.plot_trajectory(run, ["slider.x", "nope"])


def test_the_name_of_a_part_has_outputs(run):
    with pytest.raises(cc.errors.UnknownNameError):
        run["slider"]
    with refuses("outputs"):
        cc.simulate(run.scene, duration=1e-4, samples=2, outputs=["wrist"])


def test_joints_of_orbits(run):
    with pytest.raises(cc.errors.ArgumentError):
        cc.plots.plot_orbit(run, "crank_pin")
    with pytest.raises(cc.errors.ArgumentTypeError):
        cc.plots.plot_orbit(run, None)


def test_numbers_and_abscissas(run, result):
    band = result["slider.x"]
    section, spectrogram = run_section, cc.plots.plot_spectrogram
    for argument, draw in (
        ("period", lambda: cc.plots.plot_poincare(run, *"ab", period="1")),
        ("shift", lambda: section(run, shift=-1.0)),
        ("period", lambda: section(run, period=0.0)),
        ("window", lambda: spectrogram(run, "slider.x", window=0)),
        ("overlap", lambda: spectrogram(run, "slider.x", overlap="a")),
        ("decibels", lambda: spectrogram(run, "slider.x", decibels=-1)),
        ("runs", lambda: cc.plots.plot_band(band, runs=True)),
        ("size", lambda: cc.animate(run, size=3)),
    ):
        with refuses(argument):
            draw()
    for draw in (
        lambda: cc.plots.plot_band(band, x=np.arange(20.0)),
        lambda: cc.plots.plot_trajectory(run, "slider.x", x="angle"),
        lambda: cc.plots.plot_trajectory(run, "slider.x", unit=["mm"]),
        lambda: cc.plots.plot_band(band, ax=Figure()),
    ):
        with pytest.raises((cc.errors.ArgumentError, cc.errors.ArgumentTypeError)):
            draw()


def run_section(run, **options):
    return cc.plots.plot_poincare(run, "slider.x", "slider.vx", **options)


@pytest.mark.parametrize("joint", [np.zeros(3), "knee", 7])
def test_a_clearance_joint_that_is_no_name_of_one_is_refused(run, joint):
    with pytest.raises(cc.errors.ArgumentError):
        cc.animate(run, frames=3, joint=joint)


def test_curves_of_two_units_do_not_share_an_axis():
    run = cc.simulate(cc.mechanisms.slider_crank(), duration=1e-3, samples=11)
    ax = cc.plots.plot_trajectory(run, "slider.x", unit="mm")
    with pytest.raises(ValueError, match=r'ax has curves in mm, got one in um: give unit="mm"'):
        cc.plots.plot_trajectory(run, "rod.x", unit="um", ax=ax)
    with pytest.raises(ValueError, match="ax has curves in mm, got one in m/s: give other axes"):
        cc.plots.plot_trajectory(run, "rod.vx", ax=ax)
    cc.plots.plot_trajectory(run, "rod.x", unit="mm", ax=ax)
    cc.plots.plot_trajectory(run, "rod.x", ax=ax)
    assert len(ax.lines) == 3
    np.testing.assert_array_equal(ax.lines[2].get_ydata(), 1e3 * run["rod.x"])
