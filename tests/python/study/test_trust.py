"""Certified ranges, the verdict on a polynomial, and what it says of each parameter."""

import warnings
from pathlib import Path
from statistics import NormalDist

import chebclear as cc
import numpy as np
import pytest
from chebclear.study.band.gridded import fit_error, judged
from chebclear.study.polynomials.surrogate import chebyshev_grid
from notices import codes
from refusals import refuses

PLANE = {"a": cc.Interval(2.0, 6.0), "b": cc.Interval(-1e-3, 3e-3)}
MIDDLE = {name: side.midpoint for name, side in PLANE.items()}
HALF = {name: side.half_width for name, side in PLANE.items()}


def fitted(function, degree, box, nodes=None):
    """Surrogate, nodes, runs and nominal run of a function of normalized variables."""
    nodes = [nodes or degree + 1] * len(box)
    sides = box.values()
    points = chebyshev_grid(list(sides), nodes)
    z = np.stack(
        [(x - s.midpoint) / s.half_width for x, s in zip(points.T, sides, strict=True)],
        axis=-1,
    )
    runs = function(z)
    surrogate = cc.results.Surrogate.fit(box, nodes, [degree] * len(box), runs)
    return surrogate, nodes, runs, function(np.zeros((1, len(box))))[0]


def middle_of(box):
    return np.array([[side.midpoint for side in box.values()]])


def verdict(function, degree, box, nodes=None):
    surrogate, nodes, runs, nominal = fitted(function, degree, box, nodes)
    width = float(np.ptp([*runs, nominal], axis=0).mean())
    return judged(surrogate, nodes, runs, nominal[None], middle_of(box), width)


def band_of(function, degree):
    surrogate, nodes, runs, nominal = fitted(function, degree, PLANE)
    width = float(np.ptp(runs, axis=0).mean())
    resolved, margin = judged(surrogate, nodes, runs, nominal[None], middle_of(PLANE), width)
    lower, upper = surrogate.bounds()
    t = np.arange(float(runs.shape[1]))
    hull = runs.min(axis=0), runs.max(axis=0)
    points = chebyshev_grid(list(PLANE.values()), nodes)
    return cc.results.Band(
        "output", t, lower, upper, nominal, hull, PLANE, points, runs, surrogate,
        "estimated" if resolved else "unknown", resolved, margin
    )  # fmt: skip


@pytest.mark.parametrize("degree", range(1, 17))
@pytest.mark.parametrize("place", [0.3, 0.0, -0.55, 0.7])
def test_a_kink_is_never_resolved(degree, place):
    line = {"a": cc.Interval(0.0, 1.0)}
    assert verdict(lambda z: np.abs(z - place), degree, line)[0] is False
    # Another parameter that only adds to it must not hide the kink from the runs that are left out.
    assert verdict(lambda z: np.abs(z[:, :1] - place) + 0.02 * z[:, 1:], degree, PLANE)[0] is False
    if place == 0.3 and degree > 1:  # least squares
        assert verdict(lambda z: np.abs(z - place), degree, line, nodes=degree + 3)[0] is False


@pytest.mark.parametrize(
    "function",
    [
        lambda z: np.exp(0.3 * z),
        lambda z: np.sin(0.5 * z),
        lambda z: 1.0 / (5.0 + z),
        lambda z: 0.0 * z + 7.0,
    ],
)
@pytest.mark.parametrize("degree", [3, 4, 8])
def test_smooth_responses_are_resolved_with_an_error_that_is_not_too_small(function, degree):
    def plane(z):
        return function(z[:, :1]) * (1.0 + 0.1 * z[:, 1:])

    surrogate, nodes, runs, nominal = fitted(plane, degree, PLANE)
    assert verdict(plane, degree, PLANE)[0] is True
    z = np.stack(np.meshgrid(np.linspace(-1, 1, 41), [-1.0, 0.2, 1.0]), axis=-1).reshape(-1, 2)
    values = surrogate.evaluate({name: MIDDLE[name] + HALF[name] * z[:, i] for i, name in enumerate(PLANE)})
    worst = np.abs(values - plane(z)).max()
    assert fit_error(surrogate, nodes, runs, nominal[None], middle_of(PLANE))[0] >= 0.99 * worst - 1e-14


def test_bounds_range_is_the_default_and_never_wider_than_equation_31():
    build, box = cc.mechanisms.slider_crank, {"rod_length": cc.Interval.around(0.12, rel=0.1)}
    study = cc.Study(build, box, ["slider.x"], duration=0.01, samples=41, fixed={"clearance_at": ()})
    result, paper = study.chebyshev(4), study.chebyshev(4, bounds="eq31")
    assert (result.bounds, paper.bounds) == ("range", "eq31") and result["slider.x"].resolved
    band, wide = result["slider.x"], paper["slider.x"]
    assert np.all(band.lower >= wide.lower - 1e-12) and np.all(band.upper <= wide.upper + 1e-12)
    assert band.max_width < wide.max_width
    with pytest.raises(ValueError):
        study.chebyshev(31)
    with refuses("bounds"):
        study.chebyshev(2, bounds="eq30")


def test_the_toggle_press_is_not_resolved():
    press = cc.load(Path(__file__).parents[3] / "examples" / "toggle_press.toml")
    box = {name: press.intervals[name] for name in ("upper_length", "bearing_distance")}
    study = cc.Study(press, box, ["ram.y", "knee.normal_force"], duration=0.06, samples=121, rtol=1e-5)
    with pytest.warns(cc.ChebclearWarning):
        result = study.chebyshev(degree=2)
    (doubt,) = (notice for notice in result.notices if notice.code == "not_resolved")
    assert doubt.about == ("knee.normal_force",)
    assert result["ram.y"].resolved
    assert not result["knee.normal_force"].resolved
    for ask in (
        lambda band: band.worst("upper"),
        lambda band: band.sensitivity("upper_length"),
        lambda band: band.monotone("upper_length"),
        lambda band: band.interval_share("upper_length"),
        lambda band: band.variance_shares(),
    ):
        with pytest.warns(cc.ChebclearWarning):
            ask(result["knee.normal_force"])
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            ask(result["ram.y"])


def curved(z):
    """Rising in the first everywhere, neither rising nor falling in the second; constant; falling in both."""
    x, y = z.T
    return np.stack([2.0 * x + 0.3 * x * x + 0.5 * y * y, 0.0 * x + 4.0, -np.exp(x + 0.1 * y)], axis=-1)


def test_derivatives_over_the_whole_box():
    band = band_of(curved, 12)
    lower, upper = band.sensitivity_range("a")
    np.testing.assert_allclose(HALF["a"] * lower, [1.4, 0.0, -np.exp(1.1)], rtol=1e-5, atol=1e-11)
    np.testing.assert_allclose(HALF["a"] * upper, [2.6, 0.0, -np.exp(-1.1)], rtol=1e-5, atol=1e-11)
    assert band.monotone("a").tolist() == [1, 0, -1] and band.monotone("b").tolist() == [0, 0, -1]
    with pytest.raises(ValueError):
        band.monotone("c")


def test_worst_cases_are_where_the_range_ends():
    band = band_of(curved, 12)
    highest, lowest = band.worst("upper"), band.worst("lower")
    assert highest["a"][0] == 6.0 and abs(highest["b"][0]) in (1e-3, 3e-3) and lowest["a"][0] == 2.0
    assert lowest["b"][0] == pytest.approx(MIDDLE["b"], abs=2e-2 * HALF["b"])  # in the middle of the bowl
    assert (lowest["a"][2], lowest["b"][2]) == (6.0, 3e-3)
    np.testing.assert_allclose(
        [band.evaluate(a=highest["a"][i], b=highest["b"][i])[i] for i in range(3)], band.upper, atol=1e-5
    )


def test_interval_shares_in_closed_form():
    def response(z):
        x, y = z.T
        return np.stack([3.0 * x + y, 3.0 * x * y, 0.0 * x], axis=-1)

    band = band_of(response, 3)
    # Without x the first moves by 2 of 8; with either at its midpoint the product does not move at all.
    np.testing.assert_allclose(band.interval_share("a"), [0.75, 1.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(band.interval_share("b"), [0.25, 1.0, 0.0], atol=1e-9)


def test_variance_shares_in_closed_form():
    def response(z):
        x, y = z.T
        return np.stack([3.0 * x + y, 2.0 * x * y, x**2 + x * y, 0.0 * x + 1.0], axis=-1)

    shares = band_of(response, 4).variance_shares()
    # Uniform on [-1, 1]: var x = 1/3, var x² = 4/45, var xy = 1/9.
    np.testing.assert_allclose(shares.variance, [10 / 3, 4 / 9, 4 / 45 + 1 / 9, 0.0], atol=1e-12)
    np.testing.assert_allclose(shares.main["a"], [0.9, 0.0, 4 / 9, 0.0], atol=1e-12)
    np.testing.assert_allclose(shares.main["b"], [0.1, 0.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(shares.total["a"], [0.9, 1.0, 1.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(shares.total["b"], [0.1, 1.0, 5 / 9, 0.0], atol=1e-12)
    assert "uniform" in repr(shares)


def test_nothing_is_bounded_that_is_not_finite():
    surrogate = cc.results.Surrogate(
        {"a": cc.Interval(0.0, 1.0)}, (1,), np.array([[0.0, 1.0], [1.0, np.nan]])
    )
    with pytest.raises(ValueError):
        surrogate.range()


def test_restraint_zones_are_where_the_sensitivity_is_calm():
    t = np.linspace(0.0, 1.0, 1001)
    box = {"a": cc.Interval(-1.0, 1.0)}

    def band(slope):
        surrogate = cc.results.Surrogate(box, (1,), np.stack([0.0 * t, slope]))
        hull = -np.abs(slope), np.abs(slope)
        empty = np.empty((0, 1)), np.empty((0, len(t)))
        return cc.results.Band(
            "v", t, *hull, 0.0 * t, hull, box, *empty, surrogate,
            "estimated", True, cc.results.Margin("polynomial")
        )  # fmt: skip

    # The clearance adds ripples of 50 Hz, 1 high outside and 0.2 high within [0.3, 0.6] s.
    calm = (t >= 0.3) & (t <= 0.6)
    ideal = np.cos(3.0 * t)
    ripples = np.where(calm, 0.2, 1.0) * np.sin(100.0 * np.pi * t)
    zones = cc.restraint_zones(band(ideal + ripples), band(ideal), "a", window=0.02)
    np.testing.assert_allclose(zones.deviation, ripples, atol=1e-12)
    assert zones.threshold == pytest.approx(0.5, rel=1e-2)
    # The running maximum takes half a window, and a ripple has no peak in its last quarter.
    np.testing.assert_allclose(zones.spans, [(0.31, 0.59)], atol=6e-3)
    with refuses("window", "threshold"):
        cc.restraint_zones(band(ideal), band(ideal), "a", window=1e-4, threshold=2.0)
    with refuses("ideal", error=TypeError):
        cc.restraint_zones(band(ideal), None, "a", window=0.02)


def test_quantiles_at_the_worst_of_the_intervals():
    def response(z):
        x, y = z.T
        return np.stack([2.0 * x + y, 0.5 * x * x - y], axis=-1)

    band = band_of(response, 5)
    # Of 20,000 draws 500 are in each tail; two standard errors are 44. Stratified draws scatter less.
    least, most = 500.0 / 20_000.0, (500.0 - 44.2) / 20_000.0
    with pytest.raises(ValueError):
        band.quantiles({"a": cc.uniform(2.0, 6.0)}, probability=1.0 - 1e-12)
    # a in [2, 6] is x = (a - 4) / 2. Uniform over all of it: quantiles of 2 x are ±1.9, then y adds ±1.
    even = band.quantiles({"a": cc.uniform(2.0, 6.0)}, probability=0.95, draws=20_000)
    assert 3.0 - 4.0 * least < even.upper[0] == pytest.approx(3.0 - 4.0 * most, abs=1e-3)
    assert -3.0 + 4.0 * least > even.lower[0] == pytest.approx(-3.0 + 4.0 * most, abs=1e-3)
    assert even.lower[1] == pytest.approx(0.5 * most**2 - 1.0, abs=1e-5)
    assert (
        0.5 * (1.0 - least) ** 2 + 1.0
        < even.upper[1]
        == pytest.approx(0.5 * (1.0 - most) ** 2 + 1.0, abs=1e-3)
    )
    # Normal with a deviation of 0.5 in a: 0.25 in x, 0.5 in 2 x.
    bell = band.quantiles({"a": cc.normal(4.0, 0.5)}, probability=0.95, draws=20_000)
    ends = [1.0 - 0.5 * NormalDist().inv_cdf(tail) for tail in (least, most)]
    assert ends[0] < bell.upper[0] == pytest.approx(ends[1], abs=1e-3)
    assert -ends[0] > bell.lower[0] == pytest.approx(-ends[1], abs=1e-3)
    # All random: 2 x + y of two uniform ones has its upper tail above 3 - sqrt(16 x tail).
    both = {"a": cc.uniform(2.0, 6.0), "b": cc.uniform(-1e-3, 3e-3)}
    alone = band.quantiles(both, probability=0.95, draws=20_000)
    assert 3.0 - np.sqrt(16.0 * least) < alone.upper[0] == pytest.approx(3.0 - np.sqrt(16.0 * most), abs=2e-2)
    assert bell == band.quantiles({"a": cc.normal(4.0, 0.5)}, draws=20_000)
    with refuses('random["a"]', 'random["c"]', "probability"):
        band.quantiles({"a": cc.normal(4.0, 1.0), "c": cc.uniform(0, 1)}, probability=1.0, draws=5)
    with refuses("draws"):
        band.quantiles({"a": cc.uniform(2.0, 6.0)}, draws=159)
    with pytest.raises(cc.errors.ArgumentTypeError):
        band.quantiles({"a": cc.Interval(2.0, 6.0)})


def test_quantiles_hold_where_a_polynomial_has_an_error():
    t = np.linspace(0.0, 1.0, 5)
    box = {name: cc.uniform(-1.0, 1.0) for name in "ab"}

    def response(a, b):
        return 0.2 * np.exp(2.0 * a) + 0.03 * np.sin(30.0 * b)

    fresh = response(*np.random.default_rng(5).uniform(-1.0, 1.0, (2, 40_000)))
    # Of 0.95 were 0.89 to 0.92 inside, as no polynomial follows the sine.
    for seed in range(4):
        band = cc.Study(lambda a, b: {"t": t, "y": np.full(5, response(a, b))}, box).band(81, rng=seed)["y"]
        assert band.margin.method == "polynomial" and band.margin.error > 0.02
        likely = band.quantiles(box, probability=0.95)
        assert np.mean((fresh >= likely.lower[0]) & (fresh <= likely.upper[0])) >= 0.95


def test_a_parameter_whose_effect_is_below_the_error_has_no_certain_slope():
    # It rises and falls with b, by less than the polynomial is wrong, which takes it for a straight line.
    t = np.linspace(0.0, 1.0, 51)

    def model(a, b):
        return {"t": t, "y": a * (1.0 + t) + 0.03 * np.sin(6.0 * b)}

    study = cc.Study(model, {"a": cc.Interval(0.0, 1.0), "b": cc.Interval(-1.0, 1.0)})
    band = study.band(41)["y"]
    assert band.resolved and np.all(band.monotone("a") == 1)
    for ask in (band.sensitivity, band.sensitivity_range, band.monotone):
        with pytest.warns(cc.ChebclearWarning):
            found = ask("b")
    assert not found.any()
    assert band.sensitivity("a").mean() == pytest.approx(1.5, rel=0.05)
    # More runs resolve it.
    fine = study.band(161)["y"]
    lower, upper = fine.sensitivity_range("b")
    assert np.all(lower <= -0.17) and np.all(upper >= 0.17) and not fine.monotone("b").any()


def test_a_parameter_at_its_optimum_is_no_matter_of_the_error():
    t = np.linspace(0.0, 1.0, 51)
    box = {"a": cc.Interval(0.0, 1.0), "b": cc.Interval(-1.0, 1.0)}
    study = cc.Study(lambda a, b: {"t": t, "y": np.cos(2.0 * b) * (1.0 + t) + 0.01 * a}, box)
    band = study.band(41)["y"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_allclose(band.sensitivity("b"), 0.0, atol=0.01)


def test_slopes_at_the_boundaries_are_doubted_where_the_degree_is_high_for_the_error():
    t = np.linspace(0.0, 1.0, 3)
    box = {"x": cc.Interval(-1.0, 1.0)}
    kink = cc.Study(lambda x: {"t": t, "y": np.full(3, abs(x - 0.3))}, box).band(81)["y"]
    # Slopes of 1 and -1, of which the polynomial makes up to 2.7.
    assert max(kink.polynomial_slope("x", at={"x": [-1.0, 1.0]})[:, 0]) > 1.5
    for ask in (lambda band: band.sensitivity_range("x"), lambda band: band.sensitivity("x", at={"x": 1.0})):
        with pytest.warns(cc.ChebclearWarning):
            ask(kink)
    smooth = cc.Study(lambda x: {"t": t, "y": np.full(3, np.exp(x))}, box).band(81)["y"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        smooth.sensitivity("x"), smooth.monotone("x")
        smooth.sensitivity_range("x"), smooth.sensitivity("x", at={"x": 1.0})


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_without_freedom_left_by_failed_runs_nothing_is_resolved():
    # Two known nodes determine a line, whatever the response is: the missing ones follow from it. The error
    # is that of a constant, and one node has not even that.
    def failing(function, limit):
        def model(x):
            if x > limit:
                raise ValueError("does not assemble")
            return {"t": np.linspace(0.0, 1.0, 3), "y": np.full(3, function(x))}

        return model

    box = {"x": cc.Interval(-1.0, 1.0)}
    for function in (np.square, np.sin, lambda x: abs(x - 0.2), lambda x: 3.0 * x):
        for degree, least in ((2, 1.0), (1, np.inf)):
            result = cc.Study(failing(function, 0.5), box).chebyshev(degree=degree)
            assert codes(result) == {"failed", "not_resolved", "holes"}
            assert not result["y"].resolved and result["y"].margin.error >= least
    # Five of seven nodes leave the quadratic term and its check, but a part of the box without a run.
    for limit, nodes, resolved in ((0.7, 7, False), (0.997, 30, True)):
        result = cc.Study(failing(np.square, limit), box).chebyshev(degree=6, nodes=nodes)
        assert codes(result) - {"not_resolved"} == {"failed", "holes"}
        assert result["y"].resolved is resolved and result["y"].margin.error <= 1e-12


@pytest.mark.parametrize(
    ("function", "names", "degree", "slope"),
    [
        (lambda a, b, c: np.sin(3.0 * (a + b + c)), "abc", 12, 3.0),
        (lambda a, b: np.sin(8.0 * (a + b)), "ab", 24, 8.0),
    ],
)
def test_ranges_along_ridges_of_equal_maxima_are_tight(function, names, degree, slope):
    t = np.linspace(0.0, 1.0, 2)
    box = {name: cc.Interval(-1.0, 1.0) for name in names}
    band = cc.Study(lambda **p: {"t": t, "y": np.full(2, function(**p))}, box).chebyshev(degree)["y"]
    # With a single gap of 1e-6 the bounds were 2.2 and 5.4.
    assert np.all(band.lower <= -1.0 + 1e-4) and np.all(band.lower >= -1.05)
    assert np.all(band.upper >= 1.0 - 1e-4) and np.all(band.upper <= 1.05)
    lower, upper = band.sensitivity_range("a")
    assert np.all(lower >= -1.05 * slope) and np.all(upper <= 1.05 * slope)


def test_rounding_is_no_slope():
    t = np.linspace(0.0, 1.0, 21)
    box = {name: cc.Interval(-1.0, 2.0) for name in "abc"}
    for runs in (9, 41, 81):
        band = cc.Study(lambda a, b, c: {"t": t, "y": 2.0 * a + 7.0 * t}, box).band(runs)["y"]
        assert np.all(band.monotone("a") == 1)
        assert not band.monotone("b").any() and not band.monotone("c").any()


def test_instants_at_which_a_resolved_polynomial_is_wrong_are_told():
    t = np.linspace(0.0, 1.0, 101)

    def pulse(x):
        y = 2.0 * x * np.ones(101)
        y[50] += 10.0 * (x > 0.3)
        return {"t": t, "y": y}

    study = cc.Study(pulse, {"x": cc.Interval(-1.0, 1.0)})
    for band in (study.band(81)["y"], study.chebyshev(degree=3)["y"]):
        assert band.resolved
        for ask in (lambda band=band: band.sensitivity("x"), lambda band=band: band.worst("lower")):
            with pytest.warns(cc.ChebclearWarning):
                ask()


def test_checked_worst_cases_are_those_of_the_range():
    t = np.linspace(0.0, 1.0, 3)
    box = {name: cc.Interval(-1.0, 1.0) for name in "abcd"}

    def model(**p):
        return {"t": t, "y": -(1.0 + t) * sum((x - 0.37) ** 2 for x in p.values())}

    result = cc.Study(model, box).band(81)
    highest, lowest = result.check().worst_cases
    for name in box:
        assert highest.parameters[name] == result["y"].worst("upper")[name][-1]
        assert highest.parameters[name] == pytest.approx(0.37, abs=2e-3)
        assert lowest.parameters[name] == -1.0
    assert lowest.simulated == pytest.approx(-2.0 * 4.0 * 1.37**2)


def test_wrong_shapes_and_missing_tensors_are_typed():
    t = np.linspace(0.0, 1.0, 3)
    box = {f"p{k}": cc.Interval(-1.0, 1.0) for k in range(8)}
    band = cc.Study(lambda **p: {"t": t, "y": np.full(3, np.exp(0.05 * sum(p.values())))}, box).band(161)["y"]
    assert band.resolved
    for ask in (band.variance_shares, lambda: band.quantiles({"p0": cc.uniform(-1.0, 1.0)})):
        with pytest.raises(cc.errors.ArgumentError):
            ask()
    others = dict.fromkeys(list(box)[2:], 0.0)
    with pytest.raises(cc.errors.ArgumentError):
        band.evaluate(p0=[1.0, 0.5], p1=[1.0, 0.5, 0.2], **others)
    with pytest.raises(cc.errors.ArgumentTypeError):
        band.evaluate(p0=[[1.0, 0.5], [0.0]], p1=0.0, **others)
    with pytest.raises(cc.errors.ArgumentError):
        band.envelope(-1.0)


def test_an_exact_polynomial_holds_in_corners_that_no_run_is_near():
    t = np.linspace(0.0, 1.0, 3)
    for count, runs in ((4, 41), (5, 81), (8, 161)):
        box = {f"p{k}": cc.Interval(-1.0, 1.0) for k in range(count)}
        study = cc.Study(lambda **p: {"t": t, "y": (1.0 + t) * sum(x * x for x in p.values())}, box)
        band = study.band(runs)["y"]
        assert band.resolved
        np.testing.assert_allclose(band.lower, 0.0, atol=1e-9)
        np.testing.assert_allclose(band.upper, count * (1.0 + t), rtol=1e-6)


def test_tables_whose_nominal_run_is_elsewhere_are_not_doubted():
    t = np.linspace(0.0, 1.0, 21)
    box = {"a": cc.Interval(-1.0, 1.0), "b": cc.Interval(-1.0, 1.0)}

    def smooth(a, b):
        return np.exp(0.2 * (a + b)) * (1.0 + t)

    own = cc.Study(lambda a, b: {"t": t, "x": smooth(a, b)}, box).chebyshev(degree=3)
    points = np.vstack([own.parameters[:16], [0.35, 0.35]])
    values = np.vstack([own.values("x")[:16], smooth(0.35, 0.35)])
    with pytest.warns(cc.ChebclearWarning):
        study = cc.Study.from_runs(dict(zip("ab", points.T, strict=True)), t, {"x": values}, intervals=box)
        band = study.chebyshev(degree=3)["x"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        band.worst("upper")
    # Points are compared on the box: all are near each other in a narrow one.
    narrow = {name: cc.Interval(-1e-9, 1e-9) for name in "ab"}

    def quadratic(a, b):
        return {"t": t, "x": 1e9 * (a + b + 5e8 * a * a) * (1.0 + t)}

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        band = cc.Study(quadratic, narrow).band(81)["x"]
        band.worst("upper")
    assert band.resolved
