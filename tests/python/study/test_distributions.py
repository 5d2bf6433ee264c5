"""Distributions of parameters against those of SciPy."""

import chebclear as cc
import numpy as np
import pytest
from chebclear.scene.distributions import inside
from refusals import refuses
from scipy import stats

LOG = np.sqrt(np.log1p(0.2**2))
PAIRS = [
    (cc.normal(0.12, 1e-3), stats.norm(0.12, 1e-3)),
    (cc.lognormal(1e9, 2e8), stats.lognorm(LOG, scale=1e9 / np.sqrt(1.04))),
    (cc.uniform(-1.0, 3.0), stats.uniform(-1.0, 4.0)),
    (cc.triangular(-1.0, 0.5, 3.0), stats.triang(0.375, -1.0, 4.0)),
    (cc.triangular(-1.0, -1.0, 3.0), stats.triang(0.0, -1.0, 4.0)),
    (cc.triangular(-1.0, 3.0, 3.0), stats.triang(1.0, -1.0, 4.0)),
]


@pytest.mark.parametrize(("own", "other"), PAIRS)
class TestDistributions:
    def test_probabilities_are_those_of_scipy(self, own, other):
        shares = np.linspace(0.001, 0.999, 101)
        values = other.ppf(shares)
        np.testing.assert_allclose([own.cdf(value) for value in values], shares, rtol=1e-9)
        np.testing.assert_allclose([own.quantile(share) for share in shares], values, rtol=1e-9, atol=1e-12)
        low, high = other.support()
        assert own.cdf(max(low, -1e300) - 1.0) == 0.0 and own.cdf(min(high, 1e300) + 1.0) == 1.0

    def test_draws_are_distributed_so(self, own, other):
        draws = own.drawn(np.random.default_rng(3), 20_000)
        assert stats.kstest(draws, other.cdf).pvalue > 1e-3
        assert draws.mean() == pytest.approx(other.mean(), abs=5.0 * other.std() / np.sqrt(20_000))

    def test_the_interval_holds_what_it_says(self, own, other):
        side = own.interval
        held = other.cdf(side.upper) - other.cdf(side.lower)
        endless = not np.all(np.isfinite(other.support())) or other.support()[0] == 0.0
        assert held == pytest.approx(0.9973002 if endless else 1.0, abs=1e-7)
        values = inside(own, side, np.linspace(0.0, 1.0, 11))
        np.testing.assert_allclose(values[[0, -1]], (side.lower, side.upper), rtol=1e-6)
        assert np.all(np.diff(values) > 0.0)


def test_numbers_that_are_no_distribution_are_named():
    for name, make, given in (
        ("mean", cc.lognormal, (-1.0, 1.0)),
        ("standard_deviation", cc.lognormal, (1.0, 0.0)),
        ("nominal", cc.triangular, (0.0, 2.0, 1.5)),
        ("lower", cc.triangular, (1.0, 1.0, 1.0)),
    ):
        with refuses(name):
            make(*given)


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
