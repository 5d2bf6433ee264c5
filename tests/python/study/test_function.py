"""`Study.function`: the runs of a study at points of one's own, and the packages that ask for them."""

import math
import pickle
from concurrent.futures import ThreadPoolExecutor

import chebclear as cc
import numpy as np
import pytest
from scipy import optimize, stats

SIDES = {"crank_length": cc.Interval.around(0.05, rel=0.01), "clearance": cc.Interval(1e-5, 4e-5)}
FEATURES = {
    "peak force": cc.features.peak("wrist.normal_force"),
    "reach": cc.features.peak("slider.x"),
    "mean torque": lambda run: float(np.mean(run["drive.torque"])),
}
WINDOW = {"skip": 0.03, "duration": 0.03, "samples": 101}


def slider_crank(**more):
    return cc.Study(cc.mechanisms.slider_crank, SIDES, features=FEATURES, **WINDOW, **more)


def ishigami(x1, x2, x3):
    """Ishigami and Homma (1990); its variance shares have a closed form."""
    return {"y": math.sin(x1) + 7.0 * math.sin(x2) ** 2 + 0.1 * x3**4 * math.sin(x1), "half": 0.5 * x1}


def closed_shares():
    """First-order and total shares of the Ishigami function with a = 7, b = 0.1."""
    a, b = 7.0, 0.1
    one = 0.5 * (1.0 + b * math.pi**4 / 5.0) ** 2
    two = a**2 / 8.0
    both = b**2 * math.pi**8 * 8.0 / 225.0
    whole = one + two + both
    return np.array([one, two, 0.0]) / whole, np.array([one + both, two, both]) / whole


@pytest.fixture(scope="module")
def own():
    side = cc.Interval(-math.pi, math.pi)
    return cc.Study(ishigami, {"x1": side, "x2": side, "x3": side}).function("y")


@pytest.mark.filterwarnings("ignore::chebclear.errors.ChebclearWarning")
def test_the_values_are_those_of_the_study_to_the_bit():
    study = slider_crank()
    table = study.sample(runs=8).features
    function = study.function()
    assert function.parameters == ("crank_length", "clearance")
    assert function.features == tuple(FEATURES) == table.names
    assert np.array_equal(function.bounds, [(one.lower, one.upper) for one in SIDES.values()])
    values = function(table.parameters)
    assert np.array_equal(values, table.runs[:, 0])
    # In any order of features, points and calls.
    some = study.function(["reach", "peak force"])
    assert np.array_equal(some(table.parameters[::-1]), values[::-1, [1, 0]])
    assert np.array_equal(some(table.parameters[3]), values[3, [1, 0]])
    alone = study.function("reach")
    assert np.array_equal(alone(table.parameters), values[:, 1])
    assert alone(list(table.parameters[2])) == values[2, 1]
    assert alone.calls == 9 and alone.failed == 0


def test_a_point_without_a_mechanism_has_no_value_and_is_told_once():
    function = slider_crank().function(["peak force", "reach"])
    points = np.array([(0.05, -1e-5), (0.05, 2e-5), (0.05, -2e-5)])
    with pytest.warns(cc.errors.ChebclearWarning):
        values = function(points)
    assert np.array_equal(np.isnan(values), [[True] * 2, [False] * 2, [True] * 2])
    # All of them, as for an optimizer that asks for one at a time.
    assert np.all(np.isnan(function(points[0])))
    assert (function.calls, function.failed) == (4, 3)
    assert [one.code for one in function.notices].count("failed") == 1
    strict = slider_crank(on_failure="raise").function("reach")
    with pytest.raises(cc.errors.SceneError):
        strict(points)


def test_failures_of_a_model_of_ones_own():
    def root(x):
        if x < 0.0:
            raise ValueError("no root")
        return {"y": math.sqrt(x)}

    function = cc.Study(root, {"x": cc.Interval(1.0, 4.0)}).function("y")
    with pytest.warns(cc.errors.ChebclearWarning):
        assert math.isnan(function([-1.0]))
    found = function([[4.0], [-1.0], [-2.0], [9.0]])
    assert np.array_equal(found, [2.0, math.nan, math.nan, 3.0], equal_nan=True)
    assert function(np.empty((0, 1))).shape == (0,)


def test_the_store_and_executors_are_those_of_the_study(tmp_path):
    calls = []

    def model(x):
        calls.append(x)
        return {"y": 2.0 * x}

    side = {"x": cc.Interval(0.0, 1.0)}
    points = np.linspace(0.0, 1.0, 7)[:, None]
    with ThreadPoolExecutor(2) as pool:
        study = cc.Study(model, side, store=tmp_path, version="1", executor=pool)
        first = study.function("y")(points)
        made = len(calls)
        again = study.function("y")(points[::-1])
    assert np.array_equal(first, 2.0 * points[:, 0]) and np.array_equal(again, first[::-1])
    assert made >= 7 and len(calls) == made


def test_bad_input_is_named():
    table = cc.Study.from_runs({"x": [0.0, 1.0, 2.0]}, None, {"y": [0.0, 1.0, 2.0]})
    for study, features in (
        (slider_crank(), ["reech", "peak force"]),
        (slider_crank(), []),
        (slider_crank(cycles=3), None),
        (cc.Study(cc.mechanisms.slider_crank, SIDES, **WINDOW), None),
        (table, "y"),
    ):
        with pytest.raises(cc.errors.ArgumentError):
            study.function(features)
    function = cc.Study(ishigami, dict.fromkeys(("x1", "x2", "x3"), cc.Interval(0.0, 1.0))).function()
    assert function.features == ("y", "half")
    for wrong in (1.0, [1.0, 2.0], [[1.0, 2.0]], np.zeros((2, 3, 3)), "abc", [[1.0, 2.0, math.inf]]):
        with pytest.raises(cc.errors.ArgumentError):
            function(wrong)


def test_it_goes_to_another_process():
    study = cc.Study(ishigami, dict.fromkeys(("x1", "x2", "x3"), cc.Interval(0.0, 1.0)))
    function = pickle.loads(pickle.dumps(study.function("y")))
    assert function([0.5, 0.2, 0.1]) == ishigami(0.5, 0.2, 0.1)["y"]


def test_variance_shares_by_scipy(own):
    first, total = closed_shares()
    found = stats.sobol_indices(
        func=lambda x: own(x.T)[None],
        n=4096,
        dists=[stats.uniform(-math.pi, 2.0 * math.pi)] * 3,
        random_state=1,
    )
    # Scatter of the estimate with 4096 points is about 0.01.
    assert np.allclose(found.first_order.squeeze(), first, atol=0.05)
    assert np.allclose(found.total_order.squeeze(), total, atol=0.05)


def test_variance_shares_by_salib(own):
    sample = pytest.importorskip("SALib.sample.sobol")
    analyze = pytest.importorskip("SALib.analyze.sobol")
    problem = {"num_vars": 3, "names": list(own.parameters), "bounds": own.bounds.tolist()}
    points = sample.sample(problem, 2048, calc_second_order=False, seed=1)
    found = analyze.analyze(problem, own(points), calc_second_order=False, seed=1)
    first, total = closed_shares()
    assert np.allclose(found["S1"], first, atol=0.05) and np.allclose(found["ST"], total, atol=0.05)


def test_a_failure_probability_by_openturns():
    ot = pytest.importorskip("openturns")

    def margin(a, b):
        return {"play": a - b}

    side = cc.Interval(-3.0, 3.0)
    own = cc.Study(margin, {"a": side, "b": side}).function(["play"])
    function = ot.PythonFunction(2, 1, func_sample=lambda X: own(np.array(X)))
    beyond = ot.CompositeRandomVector(function, ot.RandomVector(ot.Normal(2)))
    search = ot.FORM(ot.Cobyla(), ot.ThresholdEvent(beyond, ot.Greater(), 3.0), [0.1, 0.1])
    search.run()
    # The difference of two standard normal numbers is normal with the variance 2.
    truth = 1.0 - stats.norm.cdf(3.0 / math.sqrt(2.0))
    assert search.getResult().getEventProbability() == pytest.approx(truth, rel=1e-3)


def test_an_optimum_by_pymoo():
    pytest.importorskip("pymoo")
    from pymoo.algorithms.soo.nonconvex.de import DE
    from pymoo.core.problem import Problem
    from pymoo.optimize import minimize

    def bowl(x, y):
        return {"height": (x - 0.3) ** 2 + 2.0 * (y + 0.2) ** 2 + 1.0}

    own = cc.Study(bowl, {"x": cc.Interval(-1.0, 1.0), "y": cc.Interval(-1.0, 1.0)}).function(["height"])

    class Design(Problem):
        def __init__(self):
            super().__init__(n_var=2, n_obj=1, xl=own.bounds[:, 0], xu=own.bounds[:, 1])

        def _evaluate(self, X, out, *args, **kwargs):
            out["F"] = own(X)

    found = minimize(Design(), DE(pop_size=20), ("n_gen", 80), seed=1, verbose=False)
    assert np.allclose(found.X, (0.3, -0.2), atol=1e-3)


def test_an_optimum_by_scipy_is_that_of_the_mechanism():
    # At its dead center an ideal slider-crank reaches the sum of its lengths, 0.05 + 0.12 m; play changes it
    # by no more than the clearance and what the contact yields.
    study = cc.Study(
        cc.mechanisms.slider_crank, SIDES, features={"reach": FEATURES["reach"]}, **WINDOW, rtol=1e-8
    )
    reach = study.function("reach")
    wanted = 0.17
    root = optimize.brentq(lambda crank: reach([crank, 1e-5]) - wanted, 0.0495, 0.0505, xtol=1e-9)
    assert root == pytest.approx(0.05, abs=2e-5)
    assert reach([root, 1e-5]) == pytest.approx(wanted, abs=1e-7)
