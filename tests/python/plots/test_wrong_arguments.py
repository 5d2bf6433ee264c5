"""What a plot cannot draw is refused by a typed error that says what it takes."""

import re

import chebclear as cc
import numpy as np
import pytest
from matplotlib.figure import Figure


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
    "trajectory": (lambda it: cc.plots.plot_trajectory(it, "slider.x"), "run must be a Trajectory"),
    "orbit": (lambda it: cc.plots.plot_orbit(it, "wrist"), "run must be a Trajectory"),
    "poincare": (lambda it: cc.plots.plot_poincare(it, "slider.x", "slider.vx"), "run must be a Trajectory"),
    "contacts": (cc.plots.plot_contacts, "runs must be a Trajectory"),
    "spectrogram": (lambda it: cc.plots.plot_spectrogram(it, "slider.x"), "plot_spectrogram takes a run"),
    "scene": (cc.plots.plot_scene, "scene must be a Scene or a run of one"),
    "animation": (cc.animate, "run must be a Trajectory"),
    "band": (cc.plots.plot_band, "band must be a Band"),
    "sensitivity": (lambda it: cc.plots.plot_sensitivity(it, "rod_length"), "band must be a Band"),
    "coefficients": (cc.plots.plot_coefficients, "band must be a Band"),
    "prediction": (lambda it: cc.plots.plot_prediction(it, it), "band must be a Band"),
    "tornado": (cc.plots.plot_tornado, "feature must be a feature of a study"),
    "shares": (cc.plots.plot_shares, "effects must be a Ranking"),
    "ranking": (cc.plots.plot_ranking, "ranking must be a Ranking"),
    "tradeoff": (cc.plots.plot_tradeoff, "result must be a Tradeoff"),
    "study tradeoff": (cc.plots.plot_study_tradeoff, "result must be a StudyTradeoff"),
    "bifurcation": (cc.plots.plot_bifurcation, "diagram must be a Bifurcation"),
}


@pytest.mark.parametrize("drawn", DRAWN)
@pytest.mark.parametrize("given", [None, "slider.x", 3, [], "study", "result"])
def test_what_is_no_result_is_refused(drawn, given, study, result):
    draw, message = DRAWN[drawn]
    wrong = {"study": study, "result": result}.get(given, given) if isinstance(given, str) else given
    if (drawn, given) == ("contacts", []):
        message = "runs must be at least one run"
    with pytest.raises((TypeError, cc.errors.ArgumentError), match=f"^{re.escape(message)}"):
        draw(wrong)


def test_a_section_of_one_column(run):
    pair = re.escape('such as "wrist.eccentricity_x" and "wrist.eccentricity_y"; got \'wrist\' alone')
    with pytest.raises(cc.errors.ArgumentError, match=f"a section is of two columns, x and y, {pair}"):
        cc.plots.plot_poincare(run, "wrist")
    with pytest.raises(cc.errors.ArgumentError):
        cc.plots.plot_poincare(run, "slider.x")


@pytest.mark.parametrize("name", [3, ["slider.x"], b"slider.x", {}, "slider.*"])
def test_what_names_no_column(run, name):
    for argument, draw in {
        "x": lambda: cc.plots.plot_poincare(run, name, "slider.vx"),
        "y": lambda: cc.plots.plot_poincare(run, "slider.x", name),
        "output": lambda: cc.animate(run, name, frames=3),
    }.items():
        with pytest.raises(
            (TypeError, cc.errors.ArgumentError), match=f"{argument} must be the name of one column"
        ):
            draw()
    with pytest.raises((TypeError, cc.errors.ArgumentError)):
        cc.plots.plot_spectrogram(run, name)


@pytest.mark.parametrize("names", [None, 3, [], {}, ["slider.x", 3], [["slider.x"]], b"slider.x"])
def test_what_names_no_columns(run, names):
    with pytest.raises(TypeError, match="columns"):
        cc.plots.plot_trajectory(run, names)


def test_columns_by_a_pattern(run):
    drawn = cc.plots.plot_trajectory(run, "*.vx", ax=Figure().subplots())
    assert len(drawn.lines) == sum(name.endswith(".vx") for name in run.columns) > 1
    with pytest.raises(KeyError):
        cc.plots.plot_trajectory(run, "*.speed")
    # An unknown name is no matter of units.
    with pytest.raises(KeyError, match='"nope"'):
        cc.plots.plot_trajectory(run, ["slider.x", "nope"])


def test_the_name_of_a_part_has_outputs(run):
    with pytest.raises(KeyError, match='"slider"'):
        run["slider"]
    with pytest.raises(cc.errors.ArgumentError, match='"wrist"'):
        cc.simulate(run.scene, duration=1e-4, samples=2, outputs=["wrist"])


def test_joints_of_contacts(run):
    one, same = (cc.plots.plot_contacts(run, joints=given, labels="a") for given in ("wrist", ["wrist"]))
    assert [text.get_text() for text in one.get_yticklabels()] == [
        text.get_text() for text in same.get_yticklabels()
    ]
    for draw in (
        lambda: cc.plots.plot_orbit(run, "crank_pin"),
        lambda: cc.plots.plot_contacts(run, joints="crank_pin"),
    ):
        with pytest.raises(cc.errors.ArgumentError, match='"crank_pin"'):
            draw()
    with pytest.raises(TypeError, match="joint"):
        cc.plots.plot_orbit(run, None)
    with pytest.raises(TypeError, match="labels"):
        cc.plots.plot_contacts(run, labels=3)


def test_numbers_and_abscissas(run, result):
    band = result["slider.x"]
    feature = result.features["mean force"]
    for message, draw in (
        (r"period must be a finite number > 0 \[s\]", lambda: cc.plots.plot_poincare(run, *"ab", period="1")),
        (r"shift must be a finite number >= 0 \[s\]", lambda: run_section(run, shift=-1.0)),
        (r"period must be a finite number > 0 \[s\]", lambda: run_section(run, period=0.0)),
        (
            r"window must be a finite number > 0 \[s\]",
            lambda: cc.plots.plot_spectrogram(run, "slider.x", window=0),
        ),
        (
            r"overlap must be .* >= 0 and < 1 \[-\]",
            lambda: cc.plots.plot_spectrogram(run, "slider.x", overlap="a"),
        ),
        (
            r"decibels must be a finite number > 0",
            lambda: cc.plots.plot_spectrogram(run, "slider.x", decibels=-1),
        ),
        (r"most must be a whole number >= 1", lambda: cc.plots.plot_tornado(feature, most=0)),
        (r"runs must be a whole number >= 0", lambda: cc.plots.plot_band(band, runs=True)),
        (r"x must be 21 numbers, one for each sample", lambda: cc.plots.plot_band(band, x=np.arange(20.0))),
        (
            r"x must be 201 numbers, one for each",
            lambda: cc.plots.plot_trajectory(run, "slider.x", x="angle"),
        ),
        (r"unit=\[.mm.\] of data in m", lambda: cc.plots.plot_trajectory(run, "slider.x", unit=["mm"])),
        (r"ax must be an Axes of matplotlib, got Figure", lambda: cc.plots.plot_band(band, ax=Figure())),
        (r"size must be a width and a height above 0 \[inch\]", lambda: cc.animate(run, size=3)),
    ):
        with pytest.raises((TypeError, cc.errors.ArgumentError), match=message):
            draw()


def run_section(run, **options):
    return cc.plots.plot_poincare(run, "slider.x", "slider.vx", **options)


@pytest.mark.parametrize("joint", [np.zeros(3), "knee", 7])
def test_a_clearance_joint_that_is_no_name_of_one_is_refused(run, joint):
    with pytest.raises(cc.errors.ArgumentError):
        cc.animate(run, frames=3, joint=joint)
