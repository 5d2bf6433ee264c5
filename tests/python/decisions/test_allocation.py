"""Least cost of tolerances: Lagrange's closed forms, enumeration, and where no tolerance helps."""

import itertools
from statistics import NormalDist

import chebclear as cc
import numpy as np
import pytest
from chebclear.decisions.allocation import allocation_document
from chebclear.decisions.least_cost.search import checked_search
from refusals import refuses

B = np.array([0.02, 0.03, 0.05])
S = np.array([1.0, -2.0, 0.5])
T = 0.1
COST = {name: lambda t, b=b: b / t for name, b in zip("abc", B, strict=True)}
LIMIT = {"gap": cc.require("gap", above=-T, below=T)}


def stack(a, b, c):
    return {"gap": a - 2.0 * b + 0.5 * c}


def study_of(make, build=stack):
    return cc.Study(build, {name: make for name in "abc"})


def after(found):
    return np.array([one.after for one in found.values()])


def test_worst_case_is_that_of_lagrange():
    pytest.importorskip("scipy")
    found = cc.allocate(study_of(cc.Interval(-0.03, 0.03)), COST, LIMIT, runs=50)
    root = np.sqrt(B * np.abs(S)).sum()
    np.testing.assert_allclose(after(found), np.sqrt(B / np.abs(S)) * T / root, rtol=1e-6)
    assert found.cost == pytest.approx(2.9646306, abs=1e-7) and found.status == "met"
    assert found.saving["gap"] == pytest.approx(found.cost / T, rel=1e-6)
    assert found.cost_before == pytest.approx(B.sum() / 0.03) and found.share == 1.0
    # The corners themselves keep to it, by no more than rounding.
    wide = max(stack(*corner)["gap"] for corner in itertools.product(*np.outer(after(found), [-1, 1])))
    assert T - 1e-9 < wide < T


def test_normal_tolerances_are_those_of_lagrange():
    pytest.importorskip("scipy")
    share, runs = 0.99, 1000
    found = cc.allocate(study_of(cc.normal(0.0, 0.01)), COST, LIMIT, share, runs)
    assert found.status == "met" and found.aimed > share
    # As if limits were those of three standard deviations; dC/dT = -C/T.
    reach = 3.0 * T / NormalDist().inv_cdf(0.5 + 0.5 * found.aimed)
    root = np.sqrt(((B * np.abs(S)) ** (2 / 3)).sum())
    np.testing.assert_allclose(after(found), (B / S**2) ** (1 / 3) * reach / root, rtol=1e-6)
    assert found.cost == pytest.approx(root**3 / reach, rel=1e-7)
    assert found.saving["gap"] == pytest.approx(found.cost / T, rel=1e-6)
    assert found.parameters["b"].mean == 0.0
    assert found.parameters["b"].standard_deviation == pytest.approx(found["b"].after / 3.0, rel=1e-12)
    assert found.verified["gap"].lower >= share and found.verified["gap"].runs == runs


def test_a_fixed_part_a_single_limit_and_an_exponential_cost():
    """Minimum of exp(-40 t_a) + 1 + 0.03 / t_b with t_a + 2 t_b = 0.1, by one equation."""
    optimize = pytest.importorskip("scipy.optimize")
    study = cc.Study(lambda a, b: {"gap": a - 2.0 * b}, {name: cc.Interval(-0.03, 0.03) for name in "ab"})
    cost = {"a": lambda t: np.exp(-40.0 * t), "b": lambda t: 1.0 + 0.03 / t}
    found = cc.allocate(study, cost, {"gap": cc.require("gap", below=T)}, runs=50)
    b = optimize.brentq(lambda b: 80.0 * np.exp(-40.0 * (T - 2.0 * b)) - 0.03 / b**2, 0.01, 0.049)
    np.testing.assert_allclose(after(found), [T - 2.0 * b, b], rtol=1e-6)


def test_draws_find_what_the_normal_distribution_says():
    """A bent stack has draws only; with a bend of nothing they must agree with the closed form."""
    pytest.importorskip("scipy")
    tight = {name: cc.uniform(-1e-6, 1e-6) for name in ("u",)}
    study = cc.Study(
        lambda a, b, c, u: {"gap": a - 2.0 * b + 0.5 * c + u},
        {**dict.fromkeys("abc", cc.normal(0.0, 0.015)), **tight},
    )
    found = cc.allocate(study, COST, LIMIT, 0.99, 1000)
    reach = 3.0 * T / NormalDist().inv_cdf(0.5 + 0.5 * found.aimed)
    least = ((B * np.abs(S)) ** (2 / 3)).sum() ** 1.5 / reach
    assert found.cost == pytest.approx(least, rel=0.03)
    ratios = (B / S**2) ** (1 / 3)
    np.testing.assert_allclose(after(found) / after(found)[0], ratios / ratios[0], rtol=0.15)
    assert found.saving["gap"] == pytest.approx(least / T, rel=0.15)


# ISO 286-1, IT5 to IT11 over 18 to 30, 50 to 80 and 80 to 120 mm [um].
GRADES = {
    "a": (0.025, (9, 13, 21, 33, 52, 84, 130)),
    "b": (0.06, (13, 19, 30, 46, 74, 120, 190)),
    "c": (0.1, (15, 22, 35, 54, 87, 140, 220)),
}


def test_grades_are_those_of_an_enumeration():
    pytest.importorskip("pressfit")
    widths = [np.array(widths) / 2e6 for _, widths in GRADES.values()]
    price = [1e-3 * b / own for b, own in zip(B, widths, strict=True)]
    best = min(
        (sum(own[k] for own, k in zip(price, chosen, strict=True)), chosen)
        for chosen in itertools.product(range(7), repeat=3)
        if sum(abs(s) * own[k] for s, own, k in zip(S, widths, chosen, strict=True)) < 60.5e-6
    )
    assert best[0] == pytest.approx(5.06397306, abs=1e-8) and best[1] == (3, 2, 3)
    catalog = {name: {f"IT{5 + k}": own[k] for k in range(7)} for name, own in zip("abc", price, strict=True)}
    sides = {name: cc.Interval.around(size, plus=2e-5, minus=2e-5) for name, (size, _) in GRADES.items()}
    middle = stack(**{name: size for name, (size, _) in GRADES.items()})["gap"]
    limit = cc.require("gap", above=middle - 60.5e-6, below=middle + 60.5e-6)
    found = cc.allocate(cc.Study(stack, sides), catalog, limit, runs=50)
    assert found.cost == pytest.approx(best[0], rel=1e-12)
    assert [one.grade for one in found.values()] == ["IT8", "IT7", "IT8"]
    # The cheapest single step: what it saves over what it needs.
    rates = [
        (own[k] - own[k + 1]) / (60.0e-6 + abs(s) * (w[k + 1] - w[k]) - 60.5e-6)
        for own, w, s, k in zip(price, widths, S, best[1], strict=True)
    ]
    (saving,) = found.saving.values()
    assert saving == pytest.approx(max(rates), rel=1e-6)


def test_functions_beside_a_catalog_are_taken_at_ten_tolerances_a_decade():
    cost = {"a": COST["a"], "b": {0.01: 3.0, 0.02: 2.0}, "c": COST["c"]}
    found = cc.allocate(study_of(cc.Interval(-0.03, 0.03)), cost, LIMIT, runs=20)
    steps = 0.003 * 10.0 ** (np.arange(21) / 10.0)
    best = min(
        B[0] / a + B[2] / c + (2.0 if b > 0.015 else 3.0)
        for a, b, c in itertools.product(steps, (0.01, 0.02), steps)
        if a + 2.0 * b + 0.5 * c < T
    )
    assert found.cost == pytest.approx(best, rel=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_choices_are_those_of_an_enumeration(seed):
    """Random slopes and catalogs of four parameters, in the worst case."""
    rng = np.random.default_rng(seed)
    slopes, names = rng.normal(size=4), "wxyz"
    choices = np.sort(rng.uniform(0.02, 0.05, (4, 4)))
    price = -np.sort(-rng.uniform(1.0, 9.0, (4, 4)))
    limit = float(np.abs(slopes) @ choices[:, 1:3].mean(axis=1))
    study = cc.Study(
        lambda **given: {"sum": float(slopes @ list(given.values()))},
        {name: cc.Interval(-0.03, 0.03) for name in names},
    )
    cost = {name: dict(zip(*both, strict=True)) for name, *both in zip(names, choices, price, strict=True)}
    found = cc.allocate(study, cost, cc.require("sum", above=-limit, below=limit), runs=20)
    rows = np.arange(4)
    assert found.cost == pytest.approx(
        min(
            price[rows, chosen].sum()
            for chosen in map(list, itertools.product(range(4), repeat=4))
            if np.abs(slopes) @ choices[rows, chosen] < limit
        )
    )


def noisy(a, b, c, size=0.03):
    """A stack with scatter that looks random, as impacts leave."""
    return {"gap": a - 2.0 * b + 0.5 * c + size * np.sin(1e9 * (a + 0.3 * b + 0.7 * c))}


def test_it_says_that_no_tolerance_helps_and_why():
    cost = {name: {0.003: 9.0, 0.03: 3.0} for name in "abc"}
    study = study_of(cc.normal(0.0, 0.01), noisy)
    found = cc.allocate(study, cost, {"gap": cc.require("gap", below=0.02)}, 0.9, 300)
    assert found.status == "scatter" and found.scatter > 0.8
    assert np.isnan(found.saving["gap"]) and found.verified["gap"].upper < 0.9
    # The tolerances stay as they are, and cost no more.
    assert {one.after for one in found.values()} == {0.03} and found.cost == found.cost_before
    # A parameter without a cost does the same, but not as scatter.
    found = cc.allocate(
        study_of(cc.normal(0.0, 0.02)), {"a": cost["a"]}, {"gap": cc.require("gap", below=0.02)}, 0.9, 300
    )
    assert found.status == "others" and found.scatter < 0.1
    # b has four times the variance of a, and sixteen times that of c.
    assert found.decides == "b" and "b decides, and has no cost" in str(found)


def test_tolerances_that_a_jump_hides_from_the_model_are_not_replaced_by_more_expensive_ones():
    pytest.importorskip("scipy")
    cost = {name: lambda t: 0.02 / t for name in "ab"}
    parameters = {"a": cc.normal(0.0, 0.005), "b": cc.normal(0.0, 0.01)}
    study = cc.Study(lambda a, b: {"y": a + b + 0.5 * (a > 0.02)}, parameters)
    found = cc.allocate(study, cost, cc.require("y", above=-0.1, below=0.1))
    # With the tolerances of the study 32 of a million are outside: those with a above 0.02.
    assert found.status == "met" and found.cost <= found.cost_before


def searched(looks, own):
    """What a search ends with whose looks are (tolerance, model keeps, missing), and whose own tolerance is
    0.03 with `own` missing; a tolerance costs its inverse."""
    study = cc.Study(lambda a: {"gap": a}, {"a": cc.normal(0.0, 0.01)})
    cost = {"a": lambda t: 1.0 / t}
    search = checked_search(study.runner, cost, LIMIT, 0.99, 1000, 0.95, 0)
    remaining = iter(looks)
    missing = {0.03: own} | {tolerance: more for tolerance, _, more in looks}

    def settled(design, outside, offset):
        tolerance, keeps, _ = next(remaining)
        return np.array([tolerance]), keeps, None

    search.settled = settled
    search.verified = lambda design, level, allowed: (None, missing[round(float(design[0]), 9)], None)
    return search.found()


def test_it_never_ends_above_the_cost_of_a_design_that_was_proven():
    # The runs prove what the model thought too wide; what it finds then costs more.
    found = searched([(0.04, False, -1.0), (0.02, True, -1.0)], own=1.0)
    assert found.design.tolist() == [0.04] and found.missing < 0.0
    # The model finds nothing that runs prove, while they prove the more expensive tolerances of the study.
    looks = [(0.2, True, 1.0), (0.15, True, 1.0), (0.1, True, 1.0)]
    found = searched(looks, own=-1.0)
    assert found.design.tolist() == [0.03] and found.missing < 0.0
    assert searched(looks, own=1.0).design.tolist() == [0.1]


@pytest.mark.parametrize("share", [0.9999, 0.99999])
def test_shares_too_rare_to_be_counted_are_proven_by_splitting(share):
    """The aim is that of Lagrange; the true share outside is in the interval and below the wanted one."""
    pytest.importorskip("scipy")
    found = cc.allocate(study_of(cc.normal(0.0, 0.01)), COST, LIMIT, share, 500)
    assert found.status == "met" and found.rare.upper < 1.0 - share and found.rare.verdict == "known"
    outside = 2.0 * NormalDist().cdf(-3.0 * T / np.linalg.norm(S * after(found)))
    assert outside == pytest.approx(1.0 - found.aimed, rel=1e-6)
    assert found.rare.lower < outside < found.rare.upper
    reach = 3.0 * T / NormalDist().inv_cdf(0.5 + 0.5 * found.aimed)
    root = np.sqrt(((B * np.abs(S)) ** (2 / 3)).sum())
    assert found.cost == pytest.approx(root**3 / reach, rel=1e-7)
    assert "of a million outside" in str(found) and found.runs < 60_000


def test_rare_shares_take_few_intervals():
    sides = {"a": cc.normal(0.0, 0.01)} | {name: cc.Interval(-1e-3, 1e-3) for name in "bcd"}
    study = cc.Study(lambda a, b, c, d: {"gap": a + b + c + d}, sides)
    with refuses("parameters"):
        cc.allocate(study, {"a": COST["a"]}, LIMIT, share=0.9999)


def test_scatter_leaves_less_for_tolerances():
    cost = {name: {t: 0.1 / t for t in (0.01, 0.02, 0.04, 0.08)} for name in "abc"}
    sides = dict.fromkeys("abc", cc.normal(0.0, 0.005))
    calm, rough = (
        cc.allocate(cc.Study(noisy, sides, fixed={"size": size}), cost, LIMIT, 0.9, 500)
        for size in (0.0, 0.08)
    )
    assert rough.status == "met" and rough.cost > calm.cost


def test_what_does_not_bind_takes_the_widest():
    found = cc.allocate(
        study_of(cc.normal(0.0, 0.001)),
        {name: {0.003: 9.0, 0.006: 3.0} for name in "abc"},
        {"gap": cc.require("gap", above=-9.0, below=9.0)},
    )
    assert found.status == "always" and found.saving["gap"] == 0.0 and found.cost == 9.0


def test_a_part_that_is_only_an_interval_takes_its_worst_corner():
    """Limits are narrower by what the interval takes on either side."""
    pytest.importorskip("scipy")

    def cost_of(taken, below):
        sides = {"a": cc.normal(0.0, 0.01), "b": cc.normal(0.0, 0.01), "c": taken}
        costs = {"a": COST["a"], "b": COST["b"]}
        limit = {"gap": cc.require("gap", above=-below, below=below)}
        return after(cc.allocate(cc.Study(stack, sides), costs, limit, 0.99, 2000, rng=3))

    shifted = cost_of(cc.Interval(-0.06, 0.06), 0.13)
    # One limit only binds at a corner: half of what two share, so narrower than that.
    np.testing.assert_allclose(shifted[0] / shifted[1], (B[0] / B[1] * 4.0) ** (1 / 3), rtol=1e-6)
    alone = cost_of(cc.Interval(-1e-12, 1e-12), 0.1)
    assert np.all(shifted > alone)


def test_words_tables_and_pictures():
    found = cc.allocate(
        study_of(cc.normal(0.0, 0.01)), {"a": {0.01: 9.0, 0.02: 3.0}}, {"gap": cc.require("gap", below=0.2)}
    )
    assert [row[0] for row in found.table.rows] == ["a", "all"]
    assert "0.0200" in str(found) and "<table" in found._repr_html_() and "met" not in repr(found["a"])
    ax = found.plot()
    assert len(ax.patches) == 1 and ax.get_xscale() == "log"


def test_bad_input_is_told_at_once():
    study = cc.Study(
        stack, {"a": cc.normal(0.0, 0.01), "b": cc.lognormal(1.0, 0.1), "c": cc.Interval(0.0, 1.0)}
    )
    with pytest.raises(cc.errors.ArgumentError) as caught:
        cc.allocate(
            study,
            {"a": lambda t: t, "b": lambda t: 1.0 / t, "c": {"1 kg": "dear", -1.0: 2.0}, "d": lambda t: 1.0},
            LIMIT,
            share=0.999,
            runs=100,
        )
    assert len(caught.value.problems) >= 4
    plain = study_of(cc.normal(0.0, 0.01))
    for cost in (
        {"a": lambda t: 1.0 + t},
        {"a": {0.01: 1.0, 0.02: 2.0}},
        {"a": lambda t: 1 / 0},
        {"a": lambda t: None},
        {"a": {"IT99": 1.0}},
        {"a": {}},
        {},
    ):
        with pytest.raises(cc.errors.ArgumentError):
            cc.allocate(plain, cost, LIMIT)
    with pytest.raises(cc.errors.ArgumentTypeError):
        cc.allocate(plain, {"a": 3.0}, LIMIT)
    with pytest.raises(cc.errors.ArgumentTypeError):
        cc.allocate(stack, COST, LIMIT)
    ended = cc.Study(stack, {name: cc.normal(0.0, 0.01) for name in "abc"}, max_seconds=1.0)
    with pytest.raises(cc.errors.ArgumentError):
        cc.allocate(ended, COST, LIMIT)
    with pytest.raises(cc.errors.ArgumentError):
        cc.allocate(plain, COST)
    with pytest.raises(cc.errors.ArgumentError):
        cc.allocate(plain, COST, {"far": cc.require("gap", above=9.0)})
    inches = cc.Study(stack, {name: cc.normal(0.1, 1e-5) for name in "abc"}, units={"a": "N"})
    with pytest.raises(cc.errors.ArgumentError):
        cc.allocate(inches, {"a": {"IT7": 1.0}}, LIMIT)
    with pytest.raises(cc.errors.ArgumentError):
        cc.allocate(inches, {"a": {"7 um": 1.0}}, LIMIT)


def test_a_report_names_the_mechanism_and_says_where_nothing_was_found():
    def stack(plate, spacer):
        return {"gap": 50.5 - plate - 2 * spacer}

    sides = {"plate": cc.normal(30.0, 0.02), "spacer": cc.normal(10.0, 0.02)}
    # Of these catalogs the tolerances of the study, three standard deviations, are the cheapest that do.
    cost = {"plate": {0.06: 3, 0.6: 3}, "spacer": {0.06: 4}}
    for limits, word, judgment in (
        ({"above": -10.0}, "The widest tolerances", "good"),
        ({"above": 0.6}, "No cheaper tolerances found: the nominal values break the requirements.", "bad"),
    ):
        found = cc.allocate(cc.Study(stack, sides), cost, cc.require("gap", **limits), 0.9, 400)
        document = allocation_document(found, None)
        assert document.title.endswith("stack: which tolerances cost least and keep the requirements?")
        assert document.answer[0].word.startswith(word) and document.answer[0].judgment == judgment
        tables = [one.caption for one in document.first]
        assert tables == (["Tolerances"] if found.is_found else []) + ["Shares in specification"]
    same = {"plate": {0.06: 3}, "spacer": {0.06: 4}}
    found = cc.allocate(cc.Study(stack, sides), same, cc.require("gap", above=-10.0), 0.9, 400)
    first = allocation_document(found, None).answer[0].word
    assert first.startswith("No cheaper tolerances found: those of the study stay")
    assert "cheapest" not in str(found)
