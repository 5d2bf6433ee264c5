"""Pictures: their data are those of the run, words and units are on the axes, and nothing is covered."""

import itertools

import chebclear as cc
import matplotlib as mpl
import numpy as np
import pytest
from chebclear.plots import labels
from chebclear.plots.runs import section_samples
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from refusals import refuses

PERIOD = cc.mechanisms.slider_crank().period


@pytest.fixture(scope="module")
def scene():
    return cc.mechanisms.slider_crank(convention="corrected", clearance_at=("crank_pin", "wrist"))


@pytest.fixture(scope="module")
def run(scene):
    return cc.simulate(scene, duration=0.5 * PERIOD, samples=1001)


@pytest.fixture(scope="module")
def results():
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.Interval.around(0.05, rel=0.01), "clearance": cc.Interval.around(2e-5, rel=0.01)},
        outputs=["slider.vx", "wrist.penetration"],
        duration=0.004,
        samples=81,
    )
    with pytest.warns(cc.ChebclearWarning):
        return study.chebyshev(degree=2), study.scan(2)


@pytest.fixture(params=[(6.4, 4.8), (3.5, 2.6), (9.0, 3.0)], ids=str)
def ax(request):
    return Figure(figsize=request.param, layout="constrained").subplots()


def covered(ax):
    """Points of the data that lie under the legend, after the figure was laid out."""
    ax.figure.draw_without_rendering()
    box = ax.get_legend().get_window_extent()
    found = []
    for line in ax.lines:
        if line.get_transform().contains_branch(ax.transData) and line.get_transform() == ax.transData:
            found += [line.get_transform().transform(line.get_xydata())]
    for collection in ax.collections:
        found += [
            ax.transData.transform(path.vertices) for path in collection.get_paths() if len(path.vertices)
        ]
    points = np.concatenate(found)
    inside = (
        (points[:, 0] > box.x0) & (points[:, 0] < box.x1) & (points[:, 1] > box.y0) & (points[:, 1] < box.y1)
    )
    return points[inside]


class TestLegendsCoverNoData:
    def test_trajectories(self, run, ax):
        names = ["slider.vx", "rod.vx", "rod.vy", "crank.vx"]
        cc.plots.plot_trajectory(run, names, ax=ax)
        assert len(ax.get_legend().get_texts()) == 4
        assert not len(covered(ax))

    def test_labels_one_after_the_other(self, run, ax):
        for name in ("wrist", "crank_pin"):
            cc.plots.plot_trajectory(run, f"{name}.normal_force", ax=ax, label=name)
        assert [text.get_text() for text in ax.get_legend().get_texts()] == ["wrist", "crank_pin"]
        assert not len(covered(ax))

    def test_band(self, results, ax):
        band, scan = (result["slider.vx"] for result in results)
        cc.plots.plot_band(band, scan=scan, runs=5, ax=ax)
        assert not len(covered(ax))

    def test_orbit(self, run, ax):
        cc.plots.plot_orbit(run, "wrist", ax=ax)
        assert not len(covered(ax))


def test_the_orbit_has_the_color_of_the_force(run):
    ax = cc.plots.plot_orbit(run, "wrist", unit="mm", ax=Figure().subplots())
    free, pressed = ax.collections
    force = run["wrist.normal_force"]
    between = np.maximum(force[:-1], force[1:])
    assert 0 < len(free.get_paths()) < len(between)
    np.testing.assert_allclose(pressed.get_array(), between[between > 0.0])
    ends = np.array([path.vertices[1] for path in pressed.get_paths()])
    np.testing.assert_allclose(ends[:, 0], 1e3 * run["wrist.eccentricity_x"][1:][between > 0.0])
    assert ax.figure.axes[1].get_ylabel() == "normal force in wrist [N]"
    plain = cc.plots.plot_orbit(run, "wrist", color="red", ax=Figure().subplots())
    assert len(plain.figure.axes) == 1 and len(plain.collections) == 1


def test_a_band_says_its_verdict(results):
    ax = Figure().subplots()
    cc.plots.plot_band(results[0]["wrist.penetration"], ax=ax)
    cc.plots.plot_band(results[1]["wrist.penetration"], ax=ax, color="orange", nominal=False)
    words = [text.get_text() for text in ax.get_legend().get_texts()]
    assert words == ["bounds of a polynomial that misses runs", "nominal", "extremes of the runs"]
    hatches = [collection.get_hatch() for collection in ax.collections]
    assert hatches == ["///", "///"]  # both are unknown


def test_contacts_are_bars_from_onset_to_separation(run):
    ax = cc.plots.plot_contacts(run, ax=Figure().subplots())
    assert [text.get_text() for text in ax.get_yticklabels()] == ["crank pin", "wrist"]
    found = [np.flatnonzero(run.contacts.joint == name) for name in ("crank_pin", "wrist")]
    own = np.concatenate(found)
    bars = ax.collections[0]
    starts = [path.vertices[:, 0].min() for path in bars.get_paths()]
    ends = [path.vertices[:, 0].max() for path in bars.get_paths()]
    rows = [path.vertices[:, 1].mean().round() for path in bars.get_paths()]
    assert rows == [row for row, one in enumerate(found) for _ in one]
    np.testing.assert_allclose(starts, run.contacts.onset[own])
    last = np.where(np.isnan(run.contacts.separation[own]), run.t[-1], run.contacts.separation[own])
    np.testing.assert_allclose(ends, last)
    np.testing.assert_allclose(bars.get_array(), run.contacts.peak_force[own])
    both = cc.plots.plot_contacts({"first": run, "second": run}, ax=Figure().subplots())
    rows = [text.get_text() for text in both.get_yticklabels()]
    assert rows == ["first, crank pin", "first, wrist", "second, crank pin", "second, wrist"]
    with pytest.raises(cc.errors.ArgumentTypeError):
        cc.plots.plot_contacts({"first": run, "second": 2.0})


class TestPoincare:
    def test_points_are_whole_periods_apart(self):
        scene = cc.mechanisms.slider_crank(clearance_at=())
        run = cc.simulate(scene, duration=3.0 * scene.period, samples=3 * 40 + 1)
        ax = cc.plots.plot_poincare(run, "slider.x", "slider.vx", x_unit="mm", shift=0.25 * scene.period)
        (points,) = ax.lines
        assert len(points.get_xdata()) == 3
        # Without clearance every revolution is the same.
        np.testing.assert_allclose(points.get_xdata(), 1e3 * run["slider.x"][10], rtol=1e-9)
        assert (ax.get_xlabel(), ax.get_ylabel()) == (
            "x position of slider [mm]",
            "x velocity of slider [m/s]",
        )

    def test_samples_that_miss_the_section_are_refused(self, run):
        assert len(section_samples(run, PERIOD / 100.0)) == 51
        with pytest.raises(cc.errors.ArgumentError):
            section_samples(run, PERIOD / 101.0)
        with pytest.raises(cc.errors.ArgumentError):
            section_samples(run, 1e-9)


class TestSimulatedScene:
    def test_bodies_are_where_they_were_simulated(self, run):
        index = 333
        ax = cc.plots.plot_scene(run, run.t[index] + 1e-7, ax=Figure().subplots(), labels=False)
        assert [text.get_text() for text in ax.texts] == [f"t = {run.t[index]:.6g} s"]
        (journal,) = [
            patch
            for patch in ax.patches
            if isinstance(patch, Circle) and patch.get_facecolor()[:3] == green()
        ]
        place = run["slider.x"][index], run["slider.y"][index]
        np.testing.assert_allclose(journal.center, place, rtol=0.0, atol=1e-15)

    def test_the_journal_is_where_its_eccentricity_says(self, run):
        index, factor = 700, 50.0
        ax = cc.plots.plot_scene(run, run.t[index], exaggerate=factor, ax=Figure().subplots())
        eccentricity = [run[f"wrist.eccentricity_{axis}"][index] for axis in "xy"]
        rims = [patch for patch in ax.patches if isinstance(patch, Circle)]
        bearings = {
            patch.radius: patch.center for patch in rims if patch.get_facecolor()[:3] == (1.0, 1.0, 1.0)
        }
        bearing = np.array(
            [center for radius, center in bearings.items() if radius > 9.8e-3 and center[0] > 0.05][-1]
        )
        (journal,) = [patch for patch in rims if patch.get_facecolor()[:3] == green()]
        np.testing.assert_allclose(
            np.array(journal.center) - bearing, factor * np.array(eccentricity), rtol=0.0, atol=1e-12
        )

    def test_what_is_missing_is_said(self, scene):
        short = cc.simulate(scene, duration=1e-3, samples=3, outputs=["slider.*", "rod.x"])
        with pytest.raises(cc.errors.ArgumentError):
            cc.plots.plot_scene(short)
        with pytest.raises(cc.errors.ArgumentError):
            cc.plots.plot_scene(short, 1.0)
        with pytest.raises(cc.errors.ArgumentError):
            cc.plots.plot_scene(scene, 0.0)
        with refuses("scene", error=TypeError):
            cc.plots.plot_scene("slider_crank")


def green():
    """Color of the third body."""
    return mpl.colors.to_rgb("#228833")


def test_labels_are_latex_on_request(run):
    with mpl.rc_context({"text.usetex": True}):
        assert labels.typeset("50 % of µm/s²_x") == r"50 \% of $\mu$m/s$^2$\_x"
        assert labels.typeset("$l_1$ [mm]") == "$l_1$ [mm]"
        ax = cc.plots.plot_trajectory(run, "slider.ax", ax=Figure().subplots())
        assert ax.get_ylabel() == "x acceleration of slider [m/s$^2$]"
    assert labels.typeset("50 % of µm/s²_x") == "50 % of µm/s²_x"


LONG = {
    "coupler": "upper_connecting_rod_of_left_knee",
    "rocker": "rocker_with_counterweight_and_dial",
    "crank_pin": "bearing_between_crank_and_upper_rod",
    "rocker_pin": "pin_at_the_counterweight_of_the_rocker",
}
FORCE = "the_largest_force_in_the_pin_at_the_counterweight"


def press(length_of_the_upper_connecting_rod=0.1, radial_clearance_of_all_worn_bearings=2e-5):
    """A four-bar with two loose joints and long names."""
    text = cc.mechanisms.four_bar(
        coupler_length=length_of_the_upper_connecting_rod,
        clearance=radial_clearance_of_all_worn_bearings,
        clearance_at=("crank_pin", "rocker_pin"),
    ).to_json()
    for short, long in LONG.items():
        text = text.replace(f'"{short}"', f'"{long}"').replace(f'"{short}.', f'"{long}.')
    return cc.Scene.from_json(text)


@pytest.fixture(scope="module")
def long_names():
    study = cc.Study(
        press,
        {
            "length_of_the_upper_connecting_rod": cc.Interval.around(0.1, rel=0.01),
            "radial_clearance_of_all_worn_bearings": cc.Interval.around(2e-5, rel=0.5),
        },
        outputs=[f"{LONG['rocker']}.angular_acceleration"],
        features={FORCE: cc.features.peak(f"{LONG['rocker_pin']}.normal_force")},
        duration=0.003,
        samples=31,
    )
    return cc.simulate(press(), duration=0.003, samples=61), study.band(runs=16), study.chebyshev(degree=1)


def both_slopes(polynomial, ax):
    for name in polynomial.intervals:
        cc.plots.plot_sensitivity(polynomial, name, ax=ax)


LONG_PICTURES = {
    "scene": lambda run, band, polynomial, ax: cc.plots.plot_scene(run.scene, ax=ax),
    "columns": lambda run, band, polynomial, ax: cc.plots.plot_trajectory(
        run, [f"{LONG['coupler']}.vx", f"{LONG['rocker']}.vx", f"{LONG['coupler']}.vy"], ax=ax
    ),
    "orbit": lambda run, band, polynomial, ax: cc.plots.plot_orbit(run, LONG["rocker_pin"], ax=ax),
    "contacts": lambda run, band, polynomial, ax: cc.plots.plot_contacts(run, ax=ax),
    "sensitivities": lambda run, band, polynomial, ax: both_slopes(next(iter(polynomial.values())), ax),
    "band": lambda run, band, polynomial, ax: next(iter(band.values())).plot(ax=ax, runs=3),
    "spectrogram": lambda run, band, polynomial, ax: cc.plots.plot_spectrogram(
        run, f"{LONG['rocker']}.angular_acceleration", window=1e-3, ax=ax
    ),
    "section": lambda run, band, polynomial, ax: cc.plots.plot_poincare(
        run, f"{LONG['rocker']}.vx", f"{LONG['rocker']}.vy", period=5e-5, ax=ax
    ),
    "tornado": lambda run, band, polynomial, ax: cc.plots.plot_tornado(band.features[FORCE], ax=ax),
    "shares": lambda run, band, polynomial, ax: cc.plots.plot_shares(band.features[FORCE], ax=ax),
    "ranking": lambda run, band, polynomial, ax: cc.plots.plot_ranking(band.ranking(FORCE), ax=ax),
}


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
@pytest.mark.parametrize("kind", LONG_PICTURES)
@pytest.mark.parametrize(
    "style", [{}, {"figure.figsize": (3.5, 2.45), "font.size": 8.0}], ids=["wide", "print"]
)
def test_long_names_leave_room_for_the_data(long_names, kind, style):
    with mpl.rc_context(style):
        figure = Figure(layout="constrained")
        ax = figure.subplots()
        LONG_PICTURES[kind](*long_names, ax)
        figure.draw_without_rendering()
        box, outer = ax.get_window_extent(), figure.bbox.padded(1.0)
        assert box.width > 0.3 * figure.bbox.width and box.height > 0.5 * figure.bbox.height
        numbers = [text.get_window_extent() for text in ax.get_xticklabels()]
        shown = sorted(
            (one.x0, one.x1) for one in numbers if box.x0 - 1.0 <= one.x0 + 0.5 * one.width <= box.x1 + 1.0
        )
        assert all(left[1] < right[0] for left, right in itertools.pairwise(shown))
        texts = [ax.xaxis.label, ax.yaxis.label, *ax.get_yticklabels(), *ax.texts]
        texts = [text for text in texts if text.get_text()]
        rows = [text.get_window_extent() for text in ax.get_yticklabels()]
        rows = sorted((one.y0, one.y1) for one in rows if box.y0 <= 0.5 * (one.y0 + one.y1) <= box.y1)
        assert all(below[1] < above[0] + 1.0 for below, above in itertools.pairwise(rows))
        if kind == "columns":
            assert ax.get_ylabel() == "velocity [m/s]"
        low, high = sorted(ax.get_ylim())
        for text in texts:
            if text in ax.get_yticklabels() and not low <= text.get_position()[1] <= high:
                continue
            one = text.get_window_extent()
            assert outer.contains(one.x0, one.y0) and outer.contains(one.x1, one.y1), text
        if ax.get_legend() is not None:
            legend = ax.get_legend().get_window_extent()
            assert legend.x0 > box.x0 - 1.0 and legend.x1 < box.x1 + 1.0
            assert legend.height < 0.4 * box.height


class TestPrint:
    def test_figures_have_the_size_and_files_the_format(self, scene, tmp_path):
        before = dict(mpl.rcParams)
        with cc.plots.print_style(columns=2, format="svg", font_size=7.0):
            ax = cc.plots.plot_scene(scene)
            ax.figure.savefig(tmp_path / "scene")
        assert ax.figure.get_size_inches().tolist() == [7.2, 4.0]
        assert ax.xaxis.label.get_fontsize() == 7.0
        assert (tmp_path / "scene.svg").read_text(encoding="utf-8").startswith("<?xml")
        assert dict(mpl.rcParams) == before

    def test_what_is_wrong_is_said(self, monkeypatch):
        with refuses("columns", "format"), cc.plots.print_style(columns=3, format="bmp"):
            pass
        monkeypatch.setattr("shutil.which", lambda name: None)
        with pytest.raises(RuntimeError):
            with cc.plots.print_style(latex=True):
                pass
