"""Models of one's own and tables of finished runs in place of scenes."""

from dataclasses import replace

import numpy as np
import pytest
from chebclear import ChebclearWarning, Interval, Study, mechanisms, study_tradeoff
from chebclear.features import loss as joint_loss, peak, rms
from chebclear.results import StudyResult
from chebclear.run import simulation
from chebclear.scene.scene import compiled
from chebclear.study.polynomials.points import unfilled
from notices import codes
from refusals import refuses

BOX = {"a": Interval.around(1.0, rel=0.1), "b": Interval.around(2.0, rel=0.1)}
T = np.linspace(0.0, 1.0, 101)


def line(a, b):
    """Its range over the box is known: from 0.9 t - 2.2 to 1.1 t - 1.8."""
    return {"t": T, "x": a * T - b, "product": a * b}


@pytest.fixture
def table():
    points = np.random.default_rng(0).uniform([0.9, 1.8], [1.1, 2.2], (40, 2))
    values = points[:, :1] * T - points[:, 1:]
    return {"a": points[:, 0], "b": points[:, 1]}, values


@pytest.mark.parametrize("ask", ["band", "chebyshev", "scan"])
def test_a_model_of_ones_own_gets_the_bands_of_a_scene(ask):
    study = Study(line, BOX)
    result = {"band": lambda: study.band(20), "chebyshev": study.chebyshev, "scan": study.scan}[ask]()
    band = result["x"]
    assert np.allclose(band.lower, 0.9 * T - 2.2, atol=1e-12)
    assert np.allclose(band.upper, 1.1 * T - 1.8, atol=1e-12)
    assert np.allclose(band.nominal, T - 2.0, atol=1e-15)
    assert (band.verdict, band.resolved) == (("unknown", False) if ask == "scan" else ("estimated", True))
    reach = result.features["product"].interval
    assert (reach.lower, reach.upper) == pytest.approx((0.9 * 1.8, 1.1 * 2.2), rel=1e-12)


def test_a_model_is_extended_and_reported(tmp_path):
    study = Study(line, BOX, features={"peak": peak("x"), "end": lambda run: run["x"][-1]})
    whole = study.band(20)
    assert study.band(12).extend(8) == whole
    assert whole.dataset().variables["x.lower"].unit == "", "a length by its name, but not ours to say"
    assert "product" in whole.report(tmp_path / "own").read_text(encoding="utf-8")
    assert np.array_equal(whole.features["peak"].values, whole.features["end"].values)


def test_a_model_of_numbers_alone_has_features_and_no_band():
    study = Study(lambda a, b: {"product": a * b}, BOX)
    assert study.sample(30).ranking("product").rows[0].narrowing.value > 0.0
    with pytest.raises(ValueError):
        study.band(8)


def test_features_of_samples_are_those_of_the_samples():
    def wave(a, b):
        return {"t": T, "x": b + a * np.sin(2.0 * np.pi * T)}

    features = {"peak": peak("x"), "rms": rms("x")}
    result = Study(wave, BOX, features=features, cycles=2).sample(5)
    a, b = result.parameters.T
    assert np.allclose(result.features["peak"].values, np.stack([b + a, b], axis=1), atol=1e-12)
    # The two halves have the mean squares b² + a²/2 ± 4 a b / pi; trapezoids of 50 steps err by 1e-3.
    squares = b**2 + a**2 / 2.0
    both = np.stack([squares + 4.0 * a * b / np.pi, squares - 4.0 * a * b / np.pi], axis=1)
    assert np.allclose(result.features["rms"].values ** 2, both, rtol=5e-3)


@pytest.mark.parametrize(
    "model",
    [
        lambda a: 3.0,
        lambda a: {"x": T},
        lambda a: {"t": T, "x": T[None, :]},
        lambda a: {"t": T**2, "x": T},
        lambda a: {"t": T[::-1], "x": T},
        lambda a: {"t": np.ma.masked_array(T, mask=T == T[1]), "x": T},
        lambda a: {"t": T},
        lambda a: {"t": T, "x": "wide"},
        lambda a: {"t": T, "x": np.where(T > a - 0.55, np.nan, T)},
        lambda a: {"t": T, "x": T, "y": np.nan},
        lambda a: {"t": T, "x" if a < 1.0 else "y": T},
        lambda a: {"t": T[: 50 if a < 1.0 else 51], "x": T[: 50 if a < 1.0 else 51]},
        lambda a: mechanisms.pendulum_in_bearing(),
    ],
)
def test_a_model_that_returns_something_else_is_told_with_its_parameters(model):
    with pytest.raises((ValueError, TypeError), match="a = "):
        Study(model, {"a": BOX["a"]}, on_failure="raise").band(8)


def test_what_only_simulations_have_is_refused_together():
    with refuses("rtol", "skip", 'features["loss"]'):
        Study(line, BOX, rtol=1e-3, skip=1.0, features={"loss": joint_loss("wrist")})
    with refuses("rtol"):
        Study(line, BOX).band(8, rtol=1e-4)
    with pytest.raises(TypeError):
        Study(line, BOX, duration=1.0, samples=11).band(8)
    with refuses("outputs"):
        Study(line, BOX, outputs=["y"]).band(8)


def test_what_a_model_raises_names_the_parameters():
    def fails(a):
        raise ZeroDivisionError("no such press")

    with pytest.raises(ZeroDivisionError) as caught:
        Study(fails, {"a": BOX["a"]}).band(4)
    assert "a = " in caught.value.__notes__[0]


def test_a_table_of_finished_runs_gets_the_band_of_its_runs(table):
    parameters, values = table
    study = Study.from_runs(parameters, T, {"x": values}, intervals=BOX, features={"peak": peak("x")})
    with pytest.warns(ChebclearWarning):
        result = study.band()
    assert "no_nominal_run" in codes(result)
    assert len(result.parameters) == 39, "the run next to the midpoint is the nominal one"
    assert np.allclose(result["x"].lower, 0.9 * T - 2.2, atol=1e-12)
    assert np.isnan(result.features["peak"].interval.whole_run), "nothing is known of how they were drawn"
    for refused in (
        lambda: study.band(confidence=0.9),
        lambda: study_tradeoff(study),
        study.chebyshev,
        lambda: result.extend(3),
    ):
        with pytest.raises(ValueError):
            refused()
    assert len(study.sample().parameters) == 39


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_every_run_of_a_table_counts_where_several_are_at_one_point():
    points = {"a": [0.0, 0.0, 1.0, 1.0, 0.5, 0.2, 0.2, 0.7, 0.7]}
    rows = np.arange(9.0)
    result = Study.from_runs(points, [0.0, 1.0], {"x": np.stack([rows, rows], axis=1), "f": rows}).sample()
    assert result["x"].runs[:, 0].tolist() == [0.0, 1.0, 2.0, 3.0, 5.0, 6.0, 7.0, 8.0]
    assert result.features["f"].values.ravel().tolist() == result["x"].runs[:, 0].tolist()


def test_a_table_whose_parameters_vary_together_says_so():
    random = np.random.default_rng(1)
    first = random.uniform(1.0, 2.0, 200)
    points = {"a": first, "b": first + random.normal(0.0, 1e-3, 200), "c": random.uniform(1.0, 2.0, 200)}
    values = (first + points["c"])[:, None] * T
    with pytest.warns(ChebclearWarning):
        result = Study.from_runs(points, T, {"x": values}).band()
    assert [one.code for one in result.notices].count("table") == 1, "c varies alone"
    with refuses("independent"):
        Study.from_runs(points, T, {"x": values}, independent=True)


def test_a_box_that_is_wider_than_the_runs_of_a_table_is_not_resolved():
    random = np.random.default_rng(3)
    points = {"m": random.uniform(1.94, 2.06, 60), "k": random.uniform(76.0, 84.0, 60)}
    x = np.cos(np.sqrt(points["k"] / points["m"])[:, None] * T)
    box = {"m": Interval(1.5, 2.5), "k": Interval(76.0, 84.0)}
    study = Study.from_runs(points, T, {"x": x, "last": x[:, -1]}, intervals=box)
    with pytest.warns(ChebclearWarning):
        result = study.band()
    assert result["x"].verdict == "too few runs" and not result.features["last"].interval.resolved
    assert {"table", "too_few_runs"} <= codes(result)


def test_rows_of_data_frames_must_be_in_one_order():
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"a": [3.0, 1.0, 2.0], "y": [9.0, 1.0, 4.0]})
    turned = frame.sort_values("a")
    with refuses('values["y"]'):
        Study.from_runs(turned[["a"]], None, {"y": frame["y"]})
    found = Study.from_runs(turned[["a"]], None, {"y": turned["y"]}).sample().features["y"]
    np.testing.assert_array_equal(found.values[:, 0], found.parameters[:, 0] ** 2)


def test_copies_of_runs_of_a_table_count_once():
    # A run that is held out while its copy is not would always be inside.
    random = np.random.default_rng(0)
    a, b = random.uniform(0.0, 1.0, (2, 60))
    x = np.sin(3.0 * T + 6.28 * random.random(60)[:, None]) * (random.exponential(size=60)[:, None] + 0.2)
    box = {name: Interval(-0.01, 1.01) for name in "ab"}
    once = Study.from_runs({"a": a, "b": b}, T, {"x": x}, intervals=box).band(coverage=0.99)
    twice = {"a": np.r_[a, a * (1.0 + 1e-15)], "b": np.r_[b, b]}
    with pytest.warns(ChebclearWarning):
        both = Study.from_runs(twice, T, {"x": np.r_[x, x]}, intervals=box).band(coverage=0.99)
    assert both["x"] == once["x"]
    with refuses("independent"):
        Study.from_runs(twice, T, {"x": np.r_[x, x]}, intervals=box, independent=True)
    # Measurements at one point that scatter are none, nor equal counts, nor runs that are near by chance.
    assert len(Study.from_runs(twice, T, {"x": np.r_[x, x + 0.01]}, intervals=box).sample().parameters) == 119
    counts = {"a": np.round(a, 1), "b": np.round(b, 1)}
    few = Study.from_runs(counts, None, {"n": np.floor(2.0 * random.random(60))}, intervals=box)
    assert len(few.sample().parameters) == 59
    many = {"a": random.uniform(-1.0, 1.0, 3000)}
    line = many["a"][:, None] * T[:3]
    sides = {"a": Interval(-1.0, 1.0)}
    study = Study.from_runs(many, T[:3], {"x": line}, intervals=sides, independent=True)
    assert study.band(coverage=0.999).requirement.independent
    # Several copies that differ by rounding, in a narrow interval.
    narrow = 0.05 * (1.0 + 1e-3 * a)
    thrice = {"a": np.concatenate([narrow, narrow * 1000.0 * 0.001, narrow * 3.0 / 3.0]), "b": np.tile(b, 3)}
    with pytest.warns(ChebclearWarning):
        study = Study.from_runs(thrice, T, {"x": np.tile(x, (3, 1))})
        assert len(study.sample().parameters) <= 64
    with pytest.raises(ValueError):
        Study.from_runs({"a": [0.5] * 3}, None, {"y": [1.0] * 3}, intervals=sides)


def test_the_first_runs_of_a_table_must_fill_the_box_as_all_do():
    random = np.random.default_rng(1)
    points = {"a": np.sort(random.uniform(0.0, 1.0, 100)), "b": random.uniform(0.0, 1.0, 100)}
    study = Study.from_runs(points, T, {"x": np.exp(4.0 * points["a"])[:, None] * T})
    with pytest.raises(ValueError):
        study.band(21)
    assert study.band()["x"].resolved
    # In two parameters together.
    a, b = random.uniform(-1.0, 1.0, (2, 200))
    a, b = a[np.argsort(np.abs(a - b))], b[np.argsort(np.abs(a - b))]
    study = Study.from_runs({"a": a, "b": b}, T, {"x": (a + b)[:, None] * (1.0 + T)})
    with pytest.raises(ValueError):
        study.band(100)
    assert study.band()["x"].resolved
    # All runs but the nominal one are used: no others are where these are not.
    a = np.concatenate([random.uniform(-1.0, -0.42, 20), random.uniform(0.42, 1.0, 20), [0.0]])
    with pytest.warns(ChebclearWarning):
        study = Study.from_runs({"a": a}, T, {"x": a[:, None] * T}, intervals={"a": Interval(-1.0, 1.0)})
        assert study.band()["x"].verdict == "too few runs"


def test_a_table_whose_runs_leave_out_a_part_of_the_box_says_so():
    points = {"a": np.random.default_rng(0).uniform(0.9, 0.94, 80)}
    values = np.sin(5.0 * points["a"])[:, None] * T
    box = {"a": Interval(0.9, 1.1)}
    with pytest.warns(ChebclearWarning):
        assert "table" in codes(Study.from_runs(points, T, {"x": values}, intervals=box).band())
    with refuses("independent"):
        Study.from_runs(points, T, {"x": values}, intervals=box, independent=True)
    # Grids, and runs that fill their interval.
    corners = {"a": [0.9, 0.9, 1.1, 1.1, 1.0], "b": [0.0, 1.0, 0.0, 1.0, 0.5]}
    Study.from_runs({name: values[:4] for name, values in corners.items()}, T, {"x": np.zeros((4, 101))})
    Study.from_runs({"a": np.repeat([0.9, 1.0, 1.1], 27)}, T, {"x": np.zeros((81, 101))})
    for seed in range(100):
        drawn = np.random.default_rng(seed).uniform(0.9, 1.1, 20)
        Study.from_runs({"a": drawn}, T, {"x": values[:20]}, intervals=box, independent=True)


def strip(random):
    points = random.uniform(-1.0, 1.0, (3000, 2))
    return points[np.abs(points[:, 0] - points[:, 1]) < 1.1]


def disc(random):
    points = random.uniform(-1.0, 1.0, (3000, 2))
    return points[np.hypot(*points.T) < 1.0]


def clusters(random):
    levels = np.repeat([-1.0, -0.9, -0.8, 0.9, 1.0], 24)
    return np.stack([levels, random.uniform(-1.0, 1.0, 120)], axis=-1)


def beginning(random):
    return np.stack([np.repeat([-1.0, -0.8, -0.6, -0.4], 30), random.uniform(-1.0, 1.0, 120)], axis=-1)


@pytest.mark.parametrize(
    "draw",
    [
        strip,
        disc,
        lambda random: np.clip(random.normal(0.0, 1 / 3, (120, 2)), -1.0, 1.0),
        clusters,
        beginning,
    ],
)
def test_nothing_is_extrapolated_into_a_part_of_the_box_that_a_table_leaves_out(draw, tmp_path):
    sides = {"a": Interval(-1.0, 1.0), "b": Interval(-1.0, 1.0)}
    a, b = draw(np.random.default_rng(1))[:120].T
    x = (a + b + 0.2 * a * b + np.exp(-2.0 * (a**2 + b**2)))[:, None] * (1.0 + T)
    with pytest.warns(ChebclearWarning):
        study = Study.from_runs({"a": a, "b": b}, T, {"x": x}, intervals=sides, features={"peak": peak("x")})
        if draw in (clusters, beginning):  # a grid in one parameter has no held-out runs
            result = study.sample()
        else:
            result = study.band()
            assert result["x"].verdict == "too few runs"
            assert result["x"].surrogate is None
            assert np.max(np.abs(result["x"].upper)) < 4.0 * np.max(np.abs(x))
            # More runs at the same points do not help; a loaded result says the same.
            result.save(tmp_path / "table.npz")
            assert str(StudyResult.load(tmp_path / "table.npz")) == str(result)
    reach = result.features["peak"].interval
    assert not reach.resolved
    assert (reach.lower, reach.upper) == (x.max(axis=1).min(), x.max(axis=1).max())
    with pytest.warns(ChebclearWarning):
        assert result.ranking("peak").extrapolated
    assert "table" in codes(result)


def test_runs_that_fill_the_box_leave_nothing_out():
    for seed in range(200):
        for count in (20, 300):
            points = np.random.default_rng([seed, count]).uniform(-1.0, 1.0, (count, 4))
            assert not unfilled(points)
    # Pairs of Sobol' points in many dimensions look empty, but runs of a study are not judged.
    sides = {f"p{index}": Interval(-1.0, 1.0) for index in range(20)}
    study = Study(
        lambda **p: {"t": T, "x": (200.0 + sum(p.values())) * (1.0 + T)}, sides, features={"peak": peak("x")}
    )
    reach = study.band(128).features["peak"].interval
    assert reach.resolved
    assert (reach.lower, reach.upper) == pytest.approx((360.0, 440.0), rel=1e-9)
    # Grids.
    roots = np.cos((2 * np.arange(5) + 1) * np.pi / 10)
    assert not unfilled(np.stack(np.meshgrid(roots, np.linspace(-1.0, 1.0, 2)), axis=-1).reshape(-1, 2))


def test_a_data_frame_is_a_table(table):
    pandas = pytest.importorskip("pandas")
    points, values = table
    found = Study.from_runs(pandas.DataFrame(points), T, {"x": values}).band(20)
    assert found["x"].upper.tolist() == Study.from_runs(points, T, {"x": values}).band(20)["x"].upper.tolist()


def test_instants_of_a_table_are_the_results_own(table):
    t = T.copy()
    result = Study.from_runs(table[0], t, {"x": table[1]}).band()
    t *= 2.0
    np.testing.assert_array_equal(result.t, T)
    with pytest.raises(ValueError):
        result["x"].hull[1][:] = 0.0


def test_the_hull_of_a_table_of_independent_runs_proves_what_its_number_does(table):
    parameters, values = table
    scattered = values + np.random.default_rng(3).normal(size=values.shape)
    study = Study.from_runs(parameters, T, {"x": scattered}, independent=True)
    with pytest.warns(ChebclearWarning):
        assert study.band(coverage=0.95)["x"].verdict == "proved"
    with pytest.warns(ChebclearWarning):
        assert study.band(coverage=0.98)["x"].verdict == "estimated"
    with pytest.raises(ValueError):
        study.band(coverage=0.95, confidence=0.95)


def test_a_table_on_chebyshev_roots_gets_the_polynomial_but_no_held_out_runs():
    own = Study(line, BOX).chebyshev(degree=3)
    order = np.random.default_rng(1).permutation(16)
    parameters = dict(zip(BOX, own.parameters[order].T, strict=True))
    study = Study.from_runs(parameters, T, {"x": own.values("x")[order]}, intervals=BOX)
    with pytest.warns(ChebclearWarning) as told:
        result = study.chebyshev(degree=3)
        # Another run stands in for that at the midpoint: nothing is doubted.
        result["x"].worst("upper")
    assert len(told) == 1
    assert np.array_equal(result["x"].upper, own["x"].upper)
    assert result["x"].resolved
    with pytest.raises(ValueError):
        study.band()


def test_all_that_is_wrong_with_a_table_is_told_together(table):
    parameters, values = table
    holed = values.copy()
    holed[7, 3] = np.nan
    wrong = {"x": values.T, "y": values[:, :50], "z": holed, "w": "text"}
    box = {"a": Interval.around(1.0, rel=0.01), "c": BOX["b"]}
    with refuses(*(f'values["{name}"]' for name in wrong), 'parameters["a"]', "intervals"):
        Study.from_runs(parameters, T, wrong, intervals=box)


T5, ONES = T[:5], np.ones((5, 101))


@pytest.mark.parametrize(
    ("names", "columns", "t", "values"),
    [
        (['values["x"]'], {"a": np.arange(5.0)}, None, {"x": ONES}),
        (['parameters["a"]'], {"a": np.ones(5)}, None, {"x": np.arange(5.0)}),
        (["parameters", "values"], {"a": [1.0, 2.0], "b": [1.0, 2.0, 3.0]}, None, 3.0),
        (['parameters["a"]'], {"a": [[1.0], [1.0, 2.0]]}, None, {"x": [1.0, 2.0]}),
        (['parameters["a"]'], {"a": [1, 10**400]}, None, {"x": [1.0, 2.0]}),
        (["t"], {"a": [1.0, 2.0]}, [1, 10**400], {"x": np.ones((2, 2))}),
        (["t"], {"a": T5}, T.astype("timedelta64[s]"), {"x": ONES}),
        (["t"], {"a": T5}, T + 0j, {"x": ONES}),
        (["t"], {"a": T5}, np.ma.masked_array(T, mask=T == T[1]), {"x": ONES}),
        (['values["x"]'], {"a": T5}, None, {"x": np.array(["1.0", "1,95", "2.0", "1", "3"])}),
        (['values["x"]'], {"a": T5}, None, {"x": T5.astype("datetime64[s]")}),
        (['values["x"]'], {"a": T5}, T, {"x": ONES + 0j}),
        (['values["x"]'], {"a": T5}, T, {"x": np.ma.masked_array(ONES, mask=ONES * T5[:, None] > 0.03)}),
    ],
)
def test_what_is_wrong_with_a_table_is_named(names, columns, t, values):
    with refuses(*names):
        Study.from_runs(columns, t, values)


def test_a_square_table_that_looks_transposed_is_doubted():
    a = np.random.default_rng(2).uniform(0.9, 1.1, 101)
    values = np.sin(6.0 * a[:, None] * T) + 20.0 * (a[:, None] - 1.0)
    with pytest.warns(ChebclearWarning):
        result = Study.from_runs({"a": a}, T, {"x": values.T}).sample()
    assert "table" in codes(result)


def test_a_callable_feature_does_not_simulate_again(monkeypatch):
    calls = []
    monkeypatch.setattr(simulation, "compiled", lambda scene: calls.append(1) or compiled(scene))
    study = Study(
        mechanisms.slider_crank,
        {"crank_length": Interval.around(0.05, rel=0.1)},
        ["slider.x"],
        duration=5e-3,
        samples=51,
        features={"end": lambda run: run["slider.x"][-1], "peak": peak("slider.x")},
    )
    result = study.sample(4)
    drawn = len(calls)
    assert drawn == 1, "the nominal mechanism, whose motion a report shows"
    assert np.array_equal(result.features["end"].values[:, 0], result.values("slider.x")[:, -1])
    study.runner = replace(study.runner, features={"contacts": lambda run: len(run.contacts)})
    assert study.sample(4).features["contacts"].nominal > 0
    assert len(calls) == 2 * drawn + 5, "what a study does not keep costs each run once more"


def test_what_a_polynomial_says_where_runs_failed_is_doubted():
    def model(a):
        if a > 0.8:
            raise RuntimeError("does not assemble")
        return {"t": T, "x": np.exp(2.0 * a) * (1.0 + T)}

    study = Study(model, {"a": Interval(-1.0, 1.0)}, features={"peak": peak("x")})
    with pytest.warns(ChebclearWarning):
        result = study.band(41)
    assert result["x"].verdict == "too few runs"
    for ask in (lambda band: band.worst("upper"), lambda band: band.sensitivity("a")):
        with pytest.warns(ChebclearWarning):
            ask(result["x"])
    # Of the runs alone: the polynomial would be extrapolated.
    reach = result.features["peak"].interval
    assert (reach.resolved, reach.upper) == (False, result.features["peak"].values.max())
