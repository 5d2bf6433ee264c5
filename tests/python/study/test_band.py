"""Calibrated studies: closed forms, fresh runs, points against SciPy, sampling steps, wrong input."""

import math
import warnings
from types import SimpleNamespace

import chebclear as cc
import numpy as np
import pytest
from chebclear import _core
from chebclear.base.files import same
from chebclear.execution import dispatch, limited
from chebclear.study.band.requirement import exact_runs
from chebclear.study.polynomials.total_degree import TotalDegree, total_degree_polynomial
from falling import PLANET, TIME, faller, height
from interrupts import work_after_interrupt
from notices import codes
from refusals import refuses
from scipy.stats import qmc

LENGTHS = {"crank_length": cc.Interval.around(0.05, rel=0.1), "rod_length": cc.Interval.around(0.12, rel=0.1)}
WRIST = ["slider.x", "slider.vx", "slider.ax", "wrist.penetration", "wrist.normal_force", "wrist.contact"]

T = np.linspace(0.0, 1.0, 21)


def planet_study(**options):
    return cc.Study(faller, PLANET, ["block.y", "block.vy"], **(TIME | options))


def wrist_study(samples=181, parameters=LENGTHS, **options):
    # The second quarter of a revolution: impacts, but few enough runs for a test.
    times = {"duration": 7.5e-3, "skip": 7.5e-3, "samples": samples}
    return cc.Study(cc.mechanisms.slider_crank, parameters, WRIST, **(times | options))


@pytest.fixture(scope="module")
def planet():
    return planet_study().band(21)


@pytest.fixture(scope="module")
def wrist():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        return wrist_study().band(41)


@pytest.mark.parametrize("parameters", [1, 2, 8, 32])
def test_points_are_those_of_scipy_without_scrambling(parameters):
    ours = _core.sobol_points(parameters, 0, 200, None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that 200 is no power of two
        theirs = qmc.Sobol(parameters, scramble=False, bits=32).random(200)
    np.testing.assert_array_equal(ours, 2.0 * theirs - 1.0)


def test_a_smooth_response_is_resolved(planet):
    assert planet.kind == "band" and planet.degrees is None and planet.nodes == ()
    assert planet.parameters.shape == (21, 2) and len(planet.stats) == 22
    assert planet.requirement.runs == 21 and planet.settings.rtol == 1e-4
    band, t = planet["block.y"], planet.t
    assert band.resolved and band.margin.method == "polynomial" and band.margin.error < 0.05
    lowest, highest = height(t, 11.0, 1.2), height(t, 8.0, 0.3)
    scale = float((highest - lowest).max())
    assert np.all(band.lower <= lowest + 1e-9) and np.all(band.upper >= highest - 1e-9)
    assert np.all(band.width - (highest - lowest) < 0.03 * scale)
    np.testing.assert_allclose(band.nominal, height(t, 9.5, 0.75), atol=1e-8)
    # One further run may be outside, for all of its time.
    assert band.coverage == pytest.approx(21 / 22) and band.whole_run == pytest.approx(20 / 22)
    assert band.margin.checks == 5 and band.margin.check_error < 0.05
    slope = band.sensitivity("gravity")
    np.testing.assert_allclose(slope, -0.5 * np.sin(0.75) ** 2 * t**2, atol=2e-3)
    assert band.worst("lower")["gravity"][-1] == 11.0


def test_ranges_take_the_threads_they_are_given(planet, monkeypatch):
    band, asked = planet["block.y"], []
    known = _core.polynomial_ranges

    def noted(terms, degrees, threads):
        asked.append(threads)
        return known(terms, degrees, threads)

    monkeypatch.setattr(_core, "polynomial_ranges", noted)
    for threads in (None, 2):
        band.worst("upper", threads=threads)
        band.sensitivity_range("gravity", threads=threads)
        band.monotone("gravity", threads=threads)
        band.interval_share("gravity", threads=threads)
    assert asked == 5 * [None] + 5 * [2]
    with refuses("threads"):
        band.worst("upper", threads=0)


def test_impacts_have_an_estimate_and_say_so(wrist):
    assert wrist["slider.x"].resolved
    force = wrist["wrist.normal_force"]
    assert force.verdict == "too few runs" and force.margin.method == "envelope"
    assert 0.99 < force.coverage < 0.999 and 0.85 < force.whole_run < 1.0
    assert force.margin.window > 0.0 and force.margin.degree is None and math.isnan(force.margin.error)
    assert np.all(force.lower <= force.hull[0]) and np.all(force.upper >= force.hull[1])
    for use in (lambda: force.sensitivity("rod_length"), lambda: force.evaluate(**{})):
        with pytest.raises(cc.errors.ArgumentError):
            use()


def test_fresh_runs_keep_the_bands(wrist):
    study = wrist_study(rtol=1e-4)
    rng = np.random.default_rng(11)
    points = np.stack([rng.uniform(side.lower, side.upper, 60) for side in LENGTHS.values()], axis=-1)
    fresh = study.runner.made(points, study.runner.settings).values[:-1]
    for index, name in enumerate(WRIST):
        band = wrist[name]
        inside = (fresh[:, :, index] >= band.lower) & (fresh[:, :, index] <= band.upper)
        # 60 runs determine 99.9 % to some tenths of a per cent; the extremes of the runs alone hold 95 %.
        assert inside.mean() > 0.995, name


def test_physics_limits_the_bounds(wrist):
    assert np.all(wrist["wrist.normal_force"].lower >= 0.0)
    assert np.all(wrist["wrist.penetration"].lower >= -2e-5)
    contact = wrist["wrist.contact"]
    assert np.all(contact.lower >= 0.0) and np.all(contact.upper <= 1.0)


def test_the_largest_clearance_of_the_box_limits_the_penetration():
    study = wrist_study(parameters={"clearance": cc.Interval(1e-5, 3e-5)}, samples=11)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        result = study.band(3)
    lower, upper = result.requirement.limits["wrist.penetration"]
    assert (lower, upper) == (pytest.approx(-3e-5, rel=1e-12), math.inf)


def test_runs_are_added_and_none_is_lost(wrist):
    study = wrist_study()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        longer = study.band(16).extend(25)
        split = study.band(41, rng=5)
    assert longer.requirement == wrist.requirement and same(longer.bands, wrist.bands)
    assert not same(split.bands, wrist.bands)
    assert longer.stats == wrist.stats


def test_runs_on_a_grid_take_part():
    study = planet_study(rtol=1e-4)
    grid = study.scan(3)
    result = study.band(12, include=grid)
    assert result.parameters.shape == (21, 2) and result.requirement.runs == 12 and len(result.stats) == 22
    np.testing.assert_array_equal(result.parameters[12:], grid.parameters)
    band = result["block.y"]
    # The corners are in the hull.
    np.testing.assert_allclose(band.hull[0], height(result.t, 11.0, 1.2), atol=1e-8)
    assert same(study.band(5).extend(7, include=[grid]).bands, result.bands)


def test_a_table_of_finished_runs_takes_part():
    study = planet_study(rtol=1e-4)
    rng = np.random.default_rng(2)
    points = {name: rng.uniform(side.lower, side.upper, 9) for name, side in PLANET.items()}
    t = np.linspace(0.0, 0.4, 41)
    places = [height(t, *place) for place in zip(*points.values(), strict=True)]
    speeds = [-g * np.sin(tilt) ** 2 * t for g, tilt in zip(*points.values(), strict=True)]
    table = cc.Study.from_runs(
        points, t, {"block.y": np.array(places), "block.vy": np.array(speeds)}
    ).sample()
    result = study.band(12, include=table)
    assert len(result.parameters) == 12 + len(table.parameters) and result.requirement.runs == 12
    assert result["block.y"].resolved
    np.testing.assert_allclose(result["block.y"].upper, height(t, 8.0, 0.3), atol=0.02)
    wider = cc.Study(faller, PLANET | {"tilt": cc.Interval(0.2, 1.3)}, ["block.y", "block.vy"], **TIME)
    with refuses("include[0]"):
        study.band(12, include=wider.scan(2))


def test_threads_do_not_change_a_bit(wrist):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        assert same(wrist_study(threads=1).band(41).bands, wrist.bands)


def test_too_few_runs_are_told():
    study = wrist_study(samples=61)
    with pytest.warns(cc.ChebclearWarning) as told:
        result = study.band(5)
    assert {one.filename for one in told} == {__file__}
    assert result["wrist.normal_force"].verdict == "too few runs" and "too_few_runs" in codes(result)
    with pytest.warns(cc.ChebclearWarning):
        assert result.extend(0) == result


def noise(a, b):
    """White noise that differs between any two points, and is the same at the same one."""
    random = np.random.default_rng([int(a * 2**40), int(b * 2**40)])
    return {"t": np.linspace(0.0, 1.0, 101), "x": random.standard_exponential(101) ** 2, "f": a}


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_included_runs_at_points_of_the_band_count_once():
    # A run that is held out while its twin is not would always be inside.
    study = cc.Study(noise, {"a": cc.Interval(0.0, 1.0), "b": cc.Interval(0.0, 1.0)})
    small, large = study.band(21), study.band(41)
    for result in (study.band(21, include=small), small.extend(0, include=[small, small])):
        assert len(result.parameters) == 21
        np.testing.assert_array_equal(result["x"].upper, small["x"].upper)
        assert result["x"].coverage == small["x"].coverage
    assert len(study.band(21, include=large).parameters) == 41
    # Further runs replace included ones at the same points.
    np.testing.assert_array_equal(study.band(21, include=large).extend(20)["x"].upper, large["x"].upper)
    # Several runs of a table at one point are all there.
    points = {"a": [0.0, 0.3, 0.3, 0.5, 1.0], "b": [0.0, 0.1, 0.1, 0.5, 1.0]}
    level = np.array([0.0, 50.0, 60.0, 1.0, 0.0])[:, None] * np.ones(101)
    replicates = cc.Study.from_runs(points, np.linspace(0.0, 1.0, 101), {"x": level}).sample()
    both = study.band(21, include=replicates)
    assert len(both.parameters) == 21 + len(replicates.parameters) and both["x"].upper.max() >= 60.0
    # Included runs may be on a grid: no statement on a further run is made of features of all of them.
    mixed = study.band(21, include=study.scan(3))
    assert len(mixed.parameters) == 30 and np.isnan(mixed.features["f"].interval.whole_run)
    with pytest.raises(cc.errors.ArgumentError):
        mixed.features["f"].quantile(0.5)


def test_included_runs_of_another_model_are_told():
    t = np.linspace(0.0, 1.0, 61)
    box = {"a": cc.Interval(-1.0, 1.0)}

    def waves(size):  # of one name: what they compute is not known
        return cc.Study(lambda a: {"t": t, "x": np.sin(3.0 * t + a) * size}, box)

    study, other = waves(1.0), waves(2.0)
    with pytest.warns(cc.ChebclearWarning):
        assert "foreign" in codes(study.band(21, include=other.scan(3)))
    with pytest.warns(cc.ChebclearWarning):
        assert "foreign" in codes(study.band(21).extend(0, include=[study.scan(3), other.scan(3)]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        study.band(21, include=study.scan(3))


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_bands_hold_corners_without_a_run_where_motions_follow_a_polynomial_roughly():
    # Of 41 runs some have none where a is near 1 and b near an end: 99.6 to 99.9 % were inside.
    t = np.linspace(0.0, 1.0, 91)

    def ramp(a, b):
        return np.maximum(0.0, a - 0.5) * (1.0 + t) + 0.2 * b * np.sin(6.0 * t)

    box = {name: cc.Interval(-1.0, 1.0) for name in "ab"}
    fresh = ramp(*np.random.default_rng(9).uniform(-1.0, 1.0, (2, 3000, 1)))
    for seed in range(4):
        band = cc.Study(lambda a, b: {"t": t, "y": ramp(a, b)}, box).band(41, rng=seed)["y"]
        # No polynomial explains the bend, so that few runs cannot verify it.
        assert band.verdict == "too few runs" and band.margin.persistence > 0.8
        assert np.mean((fresh >= band.lower) & (fresh <= band.upper)) >= 0.9995


@pytest.mark.parametrize("size", [1e-300, 1e-100, 1e77, 1e140])
def test_bands_of_very_large_and_very_small_values(size):
    t = np.linspace(0.0, 1.0, 91)
    box = {name: cc.Interval(0.0, 1.0) for name in "ab"}

    def bands(unit):
        def model(a, b):
            return {"t": t, "y": unit * np.sin(1e5 * a + 10.0 * t + b), "z": unit * np.exp(a + b * t)}

        return cc.Study(model, box).band(41)

    found, usual = bands(size), bands(1.0)
    for name in ("y", "z"):
        assert found[name].verdict == usual[name].verdict
        np.testing.assert_allclose(found[name].upper / size, usual[name].upper, rtol=1e-6)
        np.testing.assert_allclose(found[name].lower / size, usual[name].lower, rtol=1e-6, atol=1e-6)


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_runs_that_differ_by_offsets_are_single_observations():
    def offset(a, b):
        level = np.random.default_rng([int(a * 2**40), int(b * 2**40)]).standard_normal()
        return {"t": np.linspace(0.0, 1.0, 101), "x": np.full(101, level)}

    box = {"a": cc.Interval(0.0, 1.0), "b": cc.Interval(0.0, 1.0)}
    for runs in (8, 41, 81):
        result = cc.Study(offset, box).band(runs)
        band = result["x"]
        assert band.verdict == "too few runs" and band.margin.persistence > 0.99
        (needed,) = (one.numbers["needed"] for one in result.notices if one.code == "too_few_runs")
        assert needed >= 999
    assert cc.Study(offset, box).band(41, coverage=0.95)["x"].verdict == "proved"
    assert cc.Study(noise, box).band(81)["x"].margin.persistence < 0.1


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
@pytest.mark.parametrize(
    "response",
    [
        lambda t, a, b, e: a * np.sin(9.0 * t) + 0.5 * b + 0.3 * e,
        lambda t, a, b, e: np.sin(20.0 * t) * (1.0 + 0.3 * e) + a * t + 0.3 * b,
    ],
)
def test_runs_that_differ_by_offsets_or_factors_beside_what_parameters_do_are_single_observations(response):
    # With a held-out coverage of 100 % they kept 99.2 to 99.6 % of new runs for 99.9 %.
    t = np.linspace(0.0, 1.0, 101)

    def model(a, b):
        scatter = np.random.default_rng([int((a + 1.0) * 2**40), int((b + 1.0) * 2**40)]).standard_normal()
        return {"t": t, "x": response(t, a, b, scatter)}

    box = {"a": cc.Interval(-1.0, 1.0), "b": cc.Interval(-1.0, 1.0)}
    for seed in range(4):
        band = cc.Study(model, box).band(41, rng=seed)["x"]
        assert band.verdict == "too few runs" and band.margin.persistence > 0.8
    assert cc.Study(model, box).band(81, coverage=0.95)["x"].verdict == "proved"


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_a_resolved_band_keeps_the_coverage_that_it_states():
    # The polynomial follows the large part, and its error is small in the mean over time.
    def model(a, b):
        t = np.linspace(0.0, 1.0, 101)
        level = np.random.default_rng([int(a * 2**40), int(b * 2**40)]).standard_normal()
        return {"t": t, "x": np.where(t < 0.5, 200.0 * a, level)}

    study = cc.Study(model, {"a": cc.Interval(0.0, 1.0), "b": cc.Interval(0.0, 1.0)})
    fresh = np.random.default_rng(1).standard_normal((4000, 1))
    stated, kept = [], []
    for seed in range(6):
        band = study.band(41, rng=seed)["x"]
        stated.append(band.coverage)
        kept.append(1.0 - 0.5 * np.mean((fresh < band.lower[60:]) | (fresh > band.upper[60:])))
    assert np.mean(stated) <= np.mean(kept)


def test_generators_and_none_draw_a_seed_that_is_kept():
    study = planet_study(samples=5)
    drawn = study.band(5, rng=np.random.default_rng(3))
    assert drawn == study.band(5, rng=np.random.default_rng(3)) == study.band(5, rng=drawn.requirement.seed)
    assert study.band(5, rng=None) != study.band(5, rng=None)
    assert study.sample(5, rng=np.random.default_rng(3)).seed == drawn.requirement.seed


def test_wrong_input_is_listed():
    study = planet_study()
    with refuses("runs", "coverage", "rtol", "rng"):
        study.band(2, coverage=1.0, rtol=1.0, rng=-1)
    with refuses("include", error=TypeError):
        study.band(5, include=[3])
    other = cc.Study(faller, PLANET, ["block.y"], duration=0.4, samples=21).scan(2)
    with refuses("include[0]", "include[1]"):
        study.band(5, include=[other, cc.Study(faller, {"tilt": PLANET["tilt"]}, **TIME).scan(2)])
    with pytest.raises(cc.errors.ArgumentError):
        study.scan(2).extend(3)
    with pytest.raises(cc.errors.ArgumentError):
        study.band(100, max_runs=50)
    many = {f"p{index}": cc.Interval(1.0, 2.0) for index in range(33)}
    with pytest.raises(cc.errors.ArgumentError):
        cc.Study(lambda **given: faller(), many, ["block.y"], **TIME).band(5)


def test_polynomials_of_many_parameters():
    rng = np.random.default_rng(3)
    box = {f"p{index}": cc.Interval(1.0, 1.0 + index + 1.0) for index in range(8)}
    terms = rng.normal(size=(165, 4))
    sparse = total_degree_polynomial(box, 3, terms)
    assert isinstance(sparse, TotalDegree)
    point = {name: rng.uniform(side.lower, side.upper) for name, side in box.items()}
    value = sparse.evaluate(point)
    lower, upper = sparse.bounds("eq31")
    assert value.shape == (4,) and np.all(lower <= value) and np.all(value <= upper)
    step = 1e-5
    ahead = sparse.evaluate(point | {"p3": point["p3"] + step})
    behind = sparse.evaluate(point | {"p3": point["p3"] - step})
    np.testing.assert_allclose(sparse.derivative("p3", at=point), (ahead - behind) / (2 * step), rtol=1e-5)
    with pytest.raises(cc.errors.ArgumentError):
        _ = sparse.coefficients
    # Within the certified range, whose ends are taken where it says, and which Eq. (31) contains.
    found = sparse.range(threads=1)
    np.testing.assert_array_equal(found.upper, sparse.range(threads=2).upper)
    draws = {name: rng.uniform(side.lower, side.upper, 300) for name, side in box.items()}
    values = sparse.evaluate(draws)
    assert np.all(found.lower <= values) and np.all(values <= found.upper)
    assert np.all(lower <= found.lower) and np.all(found.upper <= upper)
    for instant in range(4):
        at = {name: place[instant] for name, place in found.highest_at.items()}
        assert sparse.evaluate(at)[instant] == pytest.approx(found.attained_upper[instant], rel=1e-9)
    # Slopes, and what is left without a parameter, are polynomials as well.
    slope, frozen = sparse.slope("p3"), sparse.frozen("p3")
    np.testing.assert_allclose(slope.evaluate(draws), sparse.derivative("p3", at=draws), rtol=1e-9, atol=1e-9)
    middle = draws | {"p3": np.full(300, box["p3"].midpoint)}
    np.testing.assert_allclose(frozen.evaluate(draws), sparse.evaluate(middle), rtol=1e-9, atol=1e-9)
    # The same polynomial as a tensor, in the first two parameters.
    small = {name: box[name] for name in ("p0", "p1")}
    tensor = total_degree_polynomial(small, 3, terms[:10])
    twin = TotalDegree(small, (3, 3), terms[:10])
    at = {name: point[name] for name in small}
    np.testing.assert_allclose(tensor.evaluate(at), twin.evaluate(at), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(tensor.derivative("p1"), twin.derivative("p1"), rtol=1e-12, atol=1e-12)


def test_the_hull_of_independent_runs_says_what_it_holds():
    study = cc.Study(noise, {name: cc.Interval(0.0, 1.0) for name in "ab"})
    result = study.band(99, coverage=0.97)
    assert result.kind == "band" and result.requirement.independent and result.parameters.shape == (99, 2)
    band = result["x"]
    assert band.verdict == "proved" and band.margin.method == "runs" and band.surrogate is None
    assert band.coverage == pytest.approx(0.98, abs=1e-12)
    assert np.array_equal(band.upper, np.maximum(band.runs.max(axis=0), band.nominal))
    assert study.scan(2).statement is None
    # Nothing is evened out: the points are those of a plain generator, and go on.
    assert not np.array_equal(result.parameters, study.band(99, coverage=0.97, rng=1).parameters)
    assert study.band(70, coverage=0.97).extend(29) == result
    assert not study.band(65, coverage=0.97).requirement.independent


def noisy(a):
    return {"t": T, "x": np.sin(1e6 * a * (1.0 + T))}


NOISY = {"a": cc.Interval(0.0, 1.0)}


def test_the_number_of_runs_follows_from_the_requirement_alone():
    study = cc.Study(noisy, NOISY)
    for coverage, needed in ((0.97, 66), (0.999, 1999)):
        result = study.band(coverage=coverage)
        assert result.requirement.runs == needed and result["x"].verdict == "proved"
    assert study.band(1999) == result
    with refuses("max_runs"):
        study.band(max_runs=1000)


@pytest.mark.filterwarnings("ignore:(stopped|too few runs):chebclear.ChebclearWarning")
@pytest.mark.parametrize("end", ["seconds", "interrupt"])
def test_a_study_that_is_ended_states_what_its_runs_allow(end, monkeypatch):
    now = [0.0]
    clock = SimpleNamespace(monotonic=lambda: now[0], perf_counter=lambda: now[0])
    for module in (dispatch, limited):
        monkeypatch.setattr(module, "time", clock)
    calls = []

    def slow(a):
        now[0] += 0.01
        calls.append(a)
        if end == "interrupt" and len(calls) == 120:
            raise KeyboardInterrupt
        return noisy(a)

    study = cc.Study(slow, NOISY)
    few = study.band(seconds=1.2 if end == "seconds" else None)
    made = few.requirement.runs
    assert few.status == "stopped" and made + len(few.failures) == 1999
    assert codes(few) == {"stopped", "too_few_runs"}
    # As many independent runs as were made leave 2 / (n + 1) outside.
    assert 20 < made < 130 and f"extremes of {made} mechanisms" in few.statement
    assert few["x"].coverage == pytest.approx(1.0 - 2.0 / (made + 1))
    everything = cc.Study(noisy, NOISY).band()
    assert np.array_equal(few.parameters, everything.parameters[:made])
    runs = np.vstack([few.values("x"), few["x"].nominal])
    assert np.array_equal(few["x"].upper, np.minimum(runs.max(axis=0), 1.0))
    # The runs that are left make the whole study.
    assert study.extended(few, 1999 - made) == everything


def test_an_interrupt_is_one_where_the_user_said_how_many_runs_or_none_is_made():
    for answer_from, runs in ((50, 81), (2, None)):
        calls = []

        def slow(a, calls=calls, answer_from=answer_from):
            calls.append(a)
            if len(calls) == answer_from:
                raise KeyboardInterrupt
            return noisy(a)

        with pytest.raises(KeyboardInterrupt):
            cc.Study(slow, NOISY).band(runs)


@pytest.mark.filterwarnings("ignore:(stopped|too few runs):chebclear.ChebclearWarning")
def test_interrupted_simulations_leave_a_whole_beginning(tmp_path):
    told = [KeyboardInterrupt]

    def interrupt(done, total):
        if done > 1500 and told:
            raise told.pop()

    few = planet_study(progress=interrupt, store=tmp_path).band()
    made = few.requirement.runs
    assert few.status == "stopped" and 3 <= made < 1999
    first, least = planet_study().band(coverage=0.99), min(made, 199)
    assert np.array_equal(few.values("block.y")[:least], first.values("block.y")[:least])
    assert {one.index for one in few.failures} == set(range(made, 1999))


def test_a_confidence_takes_the_runs_of_wilks():
    # [Wilks1941], two-sided: 93 and 473 runs hold 95 and 99 % with 95 % confidence.
    assert [exact_runs(share, 0.95) for share in (0.95, 0.99, 0.999)] == [93, 473, 4742]
    assert [exact_runs(share) for share in (0.9, 0.99, 0.999)] == [19, 199, 1999]
    study = cc.Study(noise, {name: cc.Interval(0.0, 1.0) for name in "ab"})
    result = study.band(coverage=0.95, confidence=0.95)
    assert len(result.parameters) == 93 and result["x"].verdict == "proved"


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_runs_that_fail_are_made_up_for():
    def picky(a):
        if a > 0.99:
            raise RuntimeError("too long")
        return {"t": T, "x": np.sin(1e6 * a * (1.0 + T))}

    study = cc.Study(picky, {"a": cc.Interval(0.0, 1.0)})
    for seed in range(50):
        result = study.band(41, coverage=0.95, rng=seed)
        if result.requirement.failed:
            break
    few = study.band(39, coverage=0.95, rng=seed)
    assert result["x"].verdict == "proved" and few["x"].verdict in ("proved", "too few runs")


def test_the_search_for_a_range_can_be_interrupted():
    # 400 polynomials of 4096 terms that do not decay: half a minute.
    box = '{f"p{index}": cc.Interval(0.0, 1.0) for index in range(6)}'
    terms = '__import__("numpy").random.default_rng(0).normal(size=(4096, 400))'
    spent = work_after_interrupt(f"cc.results.Surrogate({box}, (3,) * 6, {terms}).range(threads=1)")
    # A few columns are finished first, 60 ms each.
    assert spent < 5.0
