"""Distributions of parameters against those of SciPy."""

import dataclasses
import json
import pickle
from dataclasses import replace

import chebclear as cc
import numpy as np
import pytest
from chebclear.scene.distributions import Distribution, inside
from chebclear.scene.distributions.sample import chi_square_quantile
from chebclear.study.report.script import _written
from refusals import refuses
from scipy import stats


class Halves:
    """Two half-normal distributions around 0 of SciPy, of shares as their deviations."""

    def __init__(self, below, above):
        self.low, self.high = stats.halfnorm(scale=below), stats.halfnorm(scale=above)
        self.below, self.above = below / (below + above), above / (below + above)

    def cdf(self, x):
        return np.where(x < 0.0, self.below * self.low.sf(-x), self.below + self.above * self.high.cdf(x))

    def sf(self, x):
        return np.where(x < 0.0, self.below * self.low.cdf(-x) + self.above, self.above * self.high.sf(x))

    def ppf(self, share):
        share = np.asarray(share)
        low = -self.low.isf(np.minimum(share / self.below, 1.0))
        return np.where(share < self.below, low, self.high.ppf((share - self.below) / self.above))

    def isf(self, share):
        share = np.asarray(share)
        high = self.high.isf(np.minimum(share / self.above, 1.0))
        return np.where(share < self.above, high, -self.low.ppf((share - self.above) / self.below))

    def support(self):
        return -np.inf, np.inf

    def mean(self):
        return self.above * self.high.mean() - self.below * self.low.mean()

    def std(self):
        return np.sqrt(self.above * self.high.moment(2) + self.below * self.low.moment(2) - self.mean() ** 2)


def exact_isf(own, other):
    """The value that a share stays above, where SciPy takes it from 1 - share or from logarithms."""
    if isinstance(own, cc.results.Triangular):
        part = (own.upper - own.mode) / (own.upper - own.lower)
        mirrored = stats.triang(part, -own.upper, own.upper - own.lower)
        return lambda share: -mirrored.ppf(share)
    if isinstance(own, cc.results.Inspected):
        made = stats.norm(*own.process.moments)
        beyond = made.sf(own.upper)
        return lambda share: made.isf(beyond + share * (made.sf(own.lower) - beyond))
    return other.isf


MEASURED = (2.1, 1.0, 1.7, 1.3, 1.45, 1.9, 1.8, 2.6)
LOG = np.sqrt(np.log1p(0.2**2))
PAIRS = [
    (cc.normal(0.12, 1e-3), stats.norm(0.12, 1e-3)),
    (cc.lognormal(1e9, 2e8), stats.lognorm(LOG, scale=1e9 / np.sqrt(1.04))),
    (cc.uniform(-1.0, 3.0), stats.uniform(-1.0, 4.0)),
    (cc.triangular(-1.0, 0.5, 3.0), stats.triang(0.375, -1.0, 4.0)),
    (cc.triangular(-1.0, -1.0, 3.0), stats.triang(0.0, -1.0, 4.0)),
    (cc.triangular(-1.0, 3.0, 3.0), stats.triang(1.0, -1.0, 4.0)),
    # The nearer limit is 0.5 - 0.1 = 0.4 from the mean 1.6: 3 * 1.25 standard deviations.
    (cc.distributions.capable(1.0, 2.0, 1.25, shift=0.1), stats.norm(1.6, 0.4 / 3.75)),
    # Half the distance, 0.5, is 6 standard deviations, 1.5 of which the mean is below the middle.
    (cc.distributions.capable(1.0, 2.0, cp=2.0, shift=-1.5), stats.norm(1.375, 1.0 / 12.0)),
    (cc.distributions.inspected(cc.normal(1.0, 2.0), -1.0, 4.0), stats.truncnorm(-1.0, 1.5, 1.0, 2.0)),
    (cc.distributions.inspected(cc.normal(1.0, 2.0), -9.0, 13.0), stats.truncnorm(-5.0, 6.0, 1.0, 2.0)),
    (cc.distributions.inspected(cc.normal(0.0, 1.0), 3.0, 4.5), stats.truncnorm(3.0, 4.5)),
    (cc.distributions.inspected(cc.normal(0.0, 1.0), -9.0, -4.0), stats.truncnorm(-9.0, -4.0)),
    (
        cc.distributions.inspected(cc.distributions.capable(1.0, 2.0, 0.5)),
        stats.truncnorm(-1.5, 1.5, 1.5, 1.0 / 3.0),
    ),
    (cc.distributions.skewed(-3.0, 0.0, 6.0), Halves(1.0, 2.0)),
    (cc.distributions.skewed(-6.0, 0.0, 3.0), Halves(2.0, 1.0)),
    (cc.distributions.skewed(-1.5, 0.0, 1.5), stats.norm(0.0, 0.5)),
    (cc.distributions.skewed(0.0, 0.0, 3.0), stats.halfnorm()),
    (cc.distributions.eccentric(0.5), stats.rayleigh(scale=0.5)),
    (cc.distributions.eccentric(tolerance=3.0), stats.powerlaw(2.0, scale=1.5)),
    (cc.distributions.sampled(MEASURED), stats.rv_histogram((np.ones(7), sorted(MEASURED)), density=False)),
]


@pytest.mark.parametrize(("own", "other"), PAIRS)
class TestDistributions:
    def test_probabilities_are_those_of_scipy(self, own, other):
        shares = np.linspace(0.001, 0.999, 101)
        values = other.ppf(shares)
        np.testing.assert_allclose([own.cdf(value) for value in values], shares, rtol=1e-9)
        np.testing.assert_allclose([own.quantile(share) for share in shares], values, rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose([own.upper_cdf(value) for value in other.isf(shares)], shares, rtol=1e-9)
        upper = [own.upper_quantile(share) for share in shares]
        np.testing.assert_allclose(upper, other.isf(shares), rtol=1e-9, atol=1e-12)
        low, high = other.support()
        assert own.support == pytest.approx((low, high), abs=1e-12)
        assert own.cdf(max(low, -1e300) - 1.0) == 0.0 and own.cdf(min(high, 1e300) + 1.0) == 1.0
        assert own.upper_cdf(max(low, -1e300) - 1.0) == 1.0 and own.upper_cdf(min(high, 1e300) + 1.0) == 0.0

    def test_tails_keep_their_digits(self, own, other):
        isf = exact_isf(own, other)
        for share in (1e-3, 1e-6, 1e-12):
            for quantile, tail, truth in (
                (own.quantile, own.cdf, other.ppf),
                (own.upper_quantile, own.upper_cdf, isf),
            ):
                value = quantile(share)
                assert value == pytest.approx(float(truth(share)), rel=1e-12, abs=1e-12 * other.std())
                # As many digits as the value leaves: it is rounded.
                slack = np.spacing(abs(value)) / max(abs(value - quantile(1.01 * share)), 1e-300)
                assert tail(value) == pytest.approx(share, rel=1e-10 + slack)

    def test_scores_are_those_of_the_values(self, own, other):
        scores = np.array([-5.0, -2.0, -0.3, 0.0, 0.4, 1.0, 2.5, 4.5])
        values = own.at(scores)
        np.testing.assert_allclose(
            values, other.ppf(stats.norm.cdf(scores)), rtol=1e-9, atol=1e-9 * other.std()
        )
        np.testing.assert_allclose(own.scores(values), scores, atol=1e-6)
        # Moments by as many values at the middles of equal shares as make a sum of 1e-5.
        values = own.at(stats.norm.ppf((np.arange(100_000) + 0.5) / 100_000))
        assert values.mean() == pytest.approx(other.mean(), abs=1e-4 * other.std())
        assert values.std() == pytest.approx(other.std(), rel=1e-3)

    def test_it_is_moved_and_scaled_around_its_nominal_value(self, own, other):
        if not own.has_tolerance:
            return
        nominal, scores = own.interval.nominal, np.array([-3.0, -1.0, 0.2, 2.0])
        values, size = own.at(scores), 1e-9 * other.std()
        if isinstance(own, cc.results.Eccentric):
            with pytest.raises(cc.errors.ArgumentError, match="nominal place"):
                own.moved(7.5)
        else:
            np.testing.assert_allclose(own.moved(7.5).at(scores), values + 7.5, rtol=1e-12, atol=size)
        smaller = own.scaled(0.25)
        np.testing.assert_allclose(smaller.at(scores), nominal + 0.25 * (values - nominal), atol=size)
        assert smaller.interval.half_width == pytest.approx(0.25 * own.interval.half_width)
        assert type(smaller) is type(own)

    def test_slopes_are_those_of_the_density(self, own, other):
        values = own.at(np.array([-2.0, -0.7, 0.6, 1.9]))
        fields = {item.name: getattr(own, item.name) for item in dataclasses.fields(own)}

        def logarithm(changed):
            """Of the density, by central differences of the probability."""
            step = 1e-4 * other.std()
            return np.log([changed.cdf(one + step) - changed.cdf(one - step) for one in values])

        if not isinstance(own, cc.results.Capable):  # whose mean and deviation are no fields
            for name, slope in own.slopes(values).items():
                step = 1e-4 * other.std()
                above, below = (replace(own, **{name: fields[name] + way * step}) for way in (1.0, -1.0))
                expected = (logarithm(above) - logarithm(below)) / (2.0 * step)
                np.testing.assert_allclose(slope, expected, rtol=1e-4, atol=1e-4 / other.std())

    def test_it_travels(self, own, other):
        given = own.in_unit("mm")
        for back in (
            pickle.loads(pickle.dumps(given)),
            Distribution.from_facts(json.loads(json.dumps(given.facts()))).in_unit("mm"),
            eval(_written(given), {"cc": cc}).in_unit("mm"),
        ):
            assert back == own and type(back) is type(own) and back.unit == "mm" == back.interval.unit

    def test_draws_are_distributed_so(self, own, other):
        draws = own.drawn(np.random.default_rng(3), 20_000)
        assert stats.kstest(draws, other.cdf).pvalue > 1e-3
        assert draws.mean() == pytest.approx(other.mean(), abs=5.0 * other.std() / np.sqrt(20_000))

    def test_the_interval_holds_what_it_says(self, own, other):
        side = own.interval
        held = other.cdf(side.upper) - other.cdf(side.lower)
        if np.any(np.isinf(other.support())):  # one of them may be open
            assert held == pytest.approx(0.9973002, abs=1e-7)
        elif isinstance(own, cc.results.Inspected):
            assert held > 0.9973
        else:
            assert held == pytest.approx(1.0, abs=1e-12)
        values = inside(own, side, np.linspace(0.0, 1.0, 11))
        np.testing.assert_allclose(values[[0, -1]], (side.lower, side.upper), rtol=1e-6)
        assert np.all(np.diff(values) > 0.0)


def test_numbers_that_are_no_distribution_are_named():
    for name, make, given in (
        ("mean", cc.lognormal, (-1.0, 1.0)),
        ("standard_deviation", cc.lognormal, (1.0, 0.0)),
        ("nominal", cc.triangular, (0.0, 2.0, 1.5)),
        ("lower", cc.triangular, (1.0, 1.0, 1.0)),
        ("nominal", cc.distributions.skewed, (0.0, 2.0, 1.5)),
        ("lower", cc.distributions.capable, (2.0, 1.0, 1.33)),
        ("cpk", cc.distributions.capable, (1.0, 2.0)),
        ("cpk", cc.distributions.capable, (1.0, 2.0, -1.0)),
        ("process", cc.distributions.inspected, ("normal", 0.0, 1.0)),
        ("process", cc.distributions.inspected, (cc.normal(0.0, 1.0), 8.0, 9.0)),
        ("lower", cc.distributions.inspected, (cc.normal(0.0, 1.0), 1.0, 1.0)),
        ("deviation", cc.distributions.eccentric, (0.0,)),
        ("deviation", cc.distributions.eccentric, ()),
        ("values", cc.distributions.sampled, ([1.0, 2.0, 3.0, 4.0],)),
        ("values", cc.distributions.sampled, ([1.0] * 9,)),
        ("values", cc.distributions.sampled, (7.0,)),
        ("lower", cc.distributions.sampled, (MEASURED, 1.01)),
        ("upper", cc.distributions.sampled, (MEASURED, None, "2.5 mm")),
    ):
        with refuses(name):
            make(*given)


def test_problems_of_a_capability_are_named_together():
    with refuses("lower", "cpk", "parts", "shift"):
        cc.distributions.capable("3 mm", "1 mm", cpk="good", shift=float("inf"), parts=1)
    with refuses("cpk", "parts"):
        cc.distributions.capable(1.0, 2.0, 1.3, cp=1.0, shift=1.5, parts=30)
    with refuses("shift"):  # a length, where the number of standard deviations is asked for
        cc.distributions.capable("1 mm", "2 mm", cp=1.0, shift="5 um")
    with refuses("shift"):
        cc.distributions.capable("1 mm", "2 mm", 1.0, shift="0.5 mm")
    with refuses("parts"):
        cc.distributions.capable(1.0, 2.0, 0.3, parts=4)
    with refuses("parts"):
        cc.distributions.capable(1.0, 2.0, 1.3, parts=10**400)
    for capability in ({"cpk": 1e-320}, {"cpk": 1e300}, {"cp": 1e300}):
        with refuses(*capability):
            cc.distributions.capable(1.0, 2.0, **capability)
    with refuses("upper"):
        cc.distributions.inspected(cc.normal(0.0, 1.0), -1.0)


def test_a_capability_is_as_bad_as_it_may_be():
    """Numbers of Bissell's bound, and of the rates that quality handbooks give."""
    known, measured = (
        cc.distributions.capable(-1.0, 1.0, 1.33),
        cc.distributions.capable(-1.0, 1.0, 1.33, parts=50),
    )
    assert 1e6 * known.upper_cdf(1.0) == pytest.approx(33.0, abs=0.5)
    assert known.outside == 2.0 * known.upper_cdf(1.0)
    assert measured.least_cpk == pytest.approx(
        1.33 * (1.0 - 1.6448536 * np.sqrt(1.0 / (9.0 * 50.0 * 1.33**2) + 1.0 / 98.0)), rel=1e-7
    )
    assert round(measured.least_cpk, 2) == 1.1
    assert 1e6 * measured.upper_cdf(1.0) == pytest.approx(506.0, abs=8.0)
    six_sigma = cc.distributions.capable(-1.0, 1.0, cp=2.0, shift=1.5)
    assert 1e6 * six_sigma.outside == pytest.approx(3.3977, abs=1e-4)
    assert six_sigma.least_cpk == 1.5


def test_the_mean_of_unequal_limits_is_not_the_nominal_value():
    bore = cc.distributions.capable("49.98 mm", "50.06 mm", 1.33, shift="5 um")
    assert bore.mean == pytest.approx(0.050025, rel=1e-12) and bore.unit == "mm"
    skewed = cc.distributions.skewed(-1.0, 0.0, 3.0)
    assert skewed.mean == pytest.approx(np.sqrt(2.0 / np.pi) * 2.0 / 3.0)
    # 2 sd+ / (sd- + sd+) of the share beyond three deviations, and sd- in place of sd+ below.
    assert skewed.upper_cdf(3.0) == pytest.approx(1.5 * stats.norm.sf(3.0), rel=1e-12)
    assert skewed.cdf(-1.0) == pytest.approx(0.5 * stats.norm.sf(3.0), rel=1e-12)


def test_inspection_cuts_any_distribution_and_says_what_it_scraps():
    good = cc.distributions.inspected(cc.distributions.skewed(-3.0, 0.0, 6.0), -2.0, 2.0)
    made = Halves(1.0, 2.0)
    assert good.scrapped == pytest.approx(float(made.cdf(-2.0) + made.sf(2.0)), rel=1e-12)
    for value in (-1.5, 0.5, 1.9):
        expected = float((made.cdf(value) - made.cdf(-2.0)) / (made.cdf(2.0) - made.cdf(-2.0)))
        assert good.cdf(value) == pytest.approx(expected, rel=1e-12)
    for share in (1e-9, 0.3, 1.0 - 1e-9):
        assert good.cdf(good.quantile(share)) == pytest.approx(share, rel=1e-6)
    again = cc.distributions.inspected(good, -1.0, 1.0)
    assert again.cdf(0.5) == pytest.approx(
        cc.distributions.inspected(good.process, -1.0, 1.0).cdf(0.5), rel=1e-12
    )


def test_problems_of_a_sample_are_named_together():
    with refuses("values[1]", "values[3]", "upper"):
        cc.distributions.sampled([1.0, "two", 3.0, float("nan"), 5.0], upper=float("inf"))
    with refuses("values[1]", "lower"):
        cc.distributions.sampled(["1 mm", "2 N", "3 mm", "4 mm", "5 mm"], lower="1 s")


def test_a_sample_does_not_know_what_is_beyond_its_ends():
    """Nor that nothing is: with 95 % confidence no more is than has a chance of 5 % to be missed by all."""
    values = np.random.default_rng(3).normal(10.0, 0.02, 50)
    known = cc.distributions.sampled(values)
    assert known.support == (values.min(), values.max())
    assert (1.0 - known.unseen) ** 50 == pytest.approx(0.05, rel=1e-12)
    assert known.unseen == pytest.approx(0.0582, abs=5e-5)
    worst = cc.distributions.sampled(values, 9.9, 10.1)
    assert worst.support == (9.9, 10.1)
    assert worst.cdf(9.9 + 1e-6) == pytest.approx(known.unseen, rel=1e-12) == worst.cdf(values.min())
    assert worst.upper_cdf(10.1 - 1e-6) == pytest.approx(known.unseen, rel=1e-12)
    middle = worst.cdf(10.0) - known.unseen
    assert middle == pytest.approx((1.0 - 2.0 * known.unseen) * known.cdf(10.0), rel=1e-12)
    for one in (known, worst):
        shares = np.array([1e-4, 0.03, 0.2, 0.5, 0.8, 0.97, 1.0 - 1e-4])
        np.testing.assert_allclose([one.cdf(one.quantile(share)) for share in shares], shares, rtol=1e-4)
        np.testing.assert_allclose(
            [one.cdf(one.upper_quantile(share)) for share in shares], 1.0 - shares, rtol=1e-2
        )
        back = Distribution.from_facts(json.loads(json.dumps(one.facts())))
        assert back == one and back.moved(1.0).support == pytest.approx(np.array(one.support) + 1.0)
    # At a limit of its own the sample has no room for what it has not seen.
    assert cc.distributions.sampled(values, lower=values.min()).cdf(values.min()) == 0.0


def test_bounds_from_samples_hold_as_often_as_they_say():
    """Of 4000 samples of 50 parts, with a standard error of 0.35 % of such shares."""
    samples = np.random.default_rng(12).normal(size=(4000, 50))
    means, deviations = samples.mean(axis=1), samples.std(axis=1, ddof=1)
    # Limits at -4 and 4: a Cpk of 4/3. The bound is an approximation of the same order.
    measured = np.minimum(4.0 - means, 4.0 + means) / (3.0 * deviations)
    proved = [cc.distributions.capable(-4.0, 4.0, one, parts=50).least_cpk for one in measured.tolist()]
    assert 0.94 < np.mean(np.array(proved) <= 4.0 / 3.0) < 0.975
    one = cc.distributions.sampled(samples[0])
    factor = one.as_normal().standard_deviation / deviations[0]
    assert np.mean(factor * deviations >= 1.0) == pytest.approx(0.95, abs=0.015)
    assert np.mean(stats.norm.sf(samples.max(axis=1)) <= one.unseen) == pytest.approx(0.95, abs=0.015)


def test_equal_values_of_a_coarse_gauge_are_a_step():
    one = cc.distributions.sampled([1.0, 2.0, 2.0, 2.0, 3.0])
    assert one.cdf(2.0) == 0.25 and one.upper_cdf(2.0) == 0.25
    np.testing.assert_allclose(
        [one.quantile(share) for share in (0.125, 0.25, 0.5, 0.75, 0.875)], [1.5, 2, 2, 2, 2.5]
    )
    draws = one.drawn(np.random.default_rng(5), 10_000)
    assert np.mean(draws == 2.0) == pytest.approx(0.5, abs=0.02)


def test_a_sample_taken_as_normal_has_the_largest_deviation_that_it_allows():
    values = np.random.default_rng(4).normal(10.0, 0.02, 50)
    normal = cc.distributions.sampled(values).as_normal()
    assert normal.mean == pytest.approx(values.mean(), rel=1e-14)
    worst = values.std(ddof=1) * np.sqrt(49.0 / stats.chi2(49).ppf(0.05))
    assert normal.standard_deviation == pytest.approx(worst, rel=1e-12)
    assert worst / values.std(ddof=1) == pytest.approx(1.2, abs=0.02)
    for freedom in (1, 2, 4, 30, 1000, 100_000):
        assert chi_square_quantile(0.05, freedom) == pytest.approx(stats.chi2(freedom).ppf(0.05), rel=1e-10)


def test_a_rare_share_is_not_known_from_a_sample():
    def sum_of(a, b):
        return {"sum": a + b}

    sampled = cc.distributions.sampled(MEASURED)
    for one in (sampled, cc.distributions.inspected(sampled, 1.2, 2.0)):
        study = cc.Study(sum_of, {"a": one, "b": cc.normal(1.0, 0.1)})
        with refuses('parameters["a"]'):
            cc.rare_share(study, cc.require("sum", below=9.0))
    study = cc.Study(sum_of, {"a": sampled.as_normal(), "b": cc.normal(1.0, 0.1)})
    assert cc.rare_share(study, cc.require("sum", below=2.0)).verdict == "known"


def test_an_eccentricity_in_any_direction_is_normal_along_each_axis():
    stream = np.random.default_rng(8)
    offset = cc.distributions.eccentric("5 um").drawn(stream, 20_000)
    direction = cc.uniform("0 deg", "360 deg").drawn(stream, 20_000)
    for along in (np.cos(direction), np.sin(direction)):
        assert stats.kstest(offset * along, stats.norm(0.0, 5e-6).cdf).pvalue > 1e-3
    assert cc.distributions.eccentric("5 um").upper_cdf(15e-6) == pytest.approx(np.exp(-4.5), rel=1e-12)
    within = cc.distributions.eccentric(tolerance="20 um")
    assert within.support == (0.0, 1e-5) and within.quantile(0.5) == pytest.approx(1e-5 * np.sqrt(0.5))


def test_shares_in_specification_are_those_of_the_closed_form():
    def same(a, b):
        return {"a": a, "b": b}

    study = cc.Study(same, {"a": cc.lognormal(2.0, 0.5), "b": cc.triangular(0.0, 0.2, 1.0)})
    limits = {"a": cc.require("a", below=3.0), "b": cc.require("b", below=0.8)}
    found = cc.conformance(study, limits, 4000, rng=5)
    log = np.sqrt(np.log1p(0.25**2))
    truth = {
        "a": stats.lognorm(log, scale=2.0 / np.sqrt(1.0625)).cdf(3.0),
        "b": 1.0 - 0.2**2 / 0.8,
    }
    for name, share in truth.items():
        # Four standard errors: an interval of 95 % would miss one of twenty seeds.
        inside_share = 1.0 - found[name].outside / found[name].runs
        assert abs(inside_share - share) < 4.0 * np.sqrt(share * (1.0 - share) / 4000)


def test_quantiles_of_a_band():
    side = {"x": cc.lognormal(2.0, 0.2)}
    t = np.linspace(0.0, 1.0, 11)
    study = cc.Study(lambda x: {"t": t, "y": x * np.ones_like(t)}, side)
    assert study.random == side and study.intervals == {"x": side["x"].interval}
    band = study.chebyshev(degree=2)["y"].quantiles(study.random, probability=0.9, draws=20_000)
    log = np.sqrt(np.log1p(0.01))
    # Two standard errors of the draws further out: 0.05 - 2 sqrt(0.05 * 0.95 / 20000) = 0.0469.
    outermost, low, high, uppermost = stats.lognorm(log, scale=2.0 / np.sqrt(1.01)).ppf(
        (0.046, 0.05, 0.95, 0.954)
    )
    assert np.all((band.lower > outermost) & (band.lower < low))
    assert np.all((band.upper > high) & (band.upper < uppermost))
