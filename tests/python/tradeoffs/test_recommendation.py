"""The recommendation of a method and a tolerance, on tables made up."""

from dataclasses import replace

import chebclear as cc
import numpy as np
import pytest
from chebclear.plots import costs as plot_costs
from chebclear.run.accuracy import chaos_horizon
from chebclear.run.trajectory import Stats
from chebclear.tradeoffs.result import format_error

NO_WORK = Stats(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.0, 0.0, 0.0)
TIMES = np.array([0.0, 0.01, 0.02, 0.03])


def made_up(errors, uncertainty=1e-9, seconds=None, status=None):
    """A result with one output of range 10; errors by (method, rtol) grow to a list over `TIMES`."""

    def point(setting, growth):
        growth = np.broadcast_to(np.asarray(growth, dtype=float), TIMES.shape)
        method, rtol = setting
        price = (seconds or {}).get(setting, 1.0)
        return cc.results.TradeoffPoint(
            method,
            rtol,
            (status or {}).get(setting, "done"),
            TIMES[-1],
            replace(NO_WORK, stages=round(1.0 / price)),
            price,
            chaos_horizon(TIMES, growth[:, None], np.array([0.1])),
            growth[None, :],
        )

    return cc.results.Tradeoff(
        ("slider.vx",),
        np.array([10.0]),
        TIMES,
        tuple(point(setting, growth) for setting, growth in errors.items()),
        point(("rodas5p", 1e-12), 0.0),
        point(("rodas4", 1e-12), uncertainty),
        (),
        None,
        None,
    )


def test_the_cheapest_setting_that_is_good_enough_is_taken():
    errors = {("rodas4", 1e-4): 0.02, ("rodas4", 1e-6): 0.002, ("dop853", 1e-6): 0.005}
    prices = {("rodas4", 1e-4): 1.0, ("rodas4", 1e-6): 4.0, ("dop853", 1e-6): 2e-3}
    advice = made_up(errors, seconds=prices).recommendation(1e-3)
    assert (advice.point.method, advice.point.rtol, advice.until) == ("dop853", 1e-6, 0.03)
    # The same in the unit of the output; by stages (one over the price here) another one is cheaper.
    assert made_up(errors, seconds=prices).recommendation({"slider.vx": 0.01}).point == advice.point
    stages = made_up(errors, seconds={**prices, ("rodas4", 1e-6): 0.5}).recommendation(1e-3, cost="stages")
    assert (stages.point.method, stages.point.rtol) == ("rodas4", 1e-6)


def test_auto_is_taken_where_it_is_level_with_the_cheapest():
    # Both costs are within 10 % of each other: what is faster is chance.
    errors = {("dop853", 1e-6): 0.005, ("auto", 1e-6): 0.005, ("auto", 1e-8): 0.001}
    prices = {("dop853", 1e-6): 2e-3, ("auto", 1e-8): 4e-3}
    for price, method in [(2.1e-3, "auto"), (2.3e-3, "dop853")]:
        advice = made_up(errors, seconds={**prices, ("auto", 1e-6): price}).recommendation(1e-3)
        assert (advice.point.method, advice.point.rtol) == (method, 1e-6)


def test_counters_do_not_scatter():
    # One over the price: 500 and 526 stages, so a setting of auto that costs 5 % more costs more.
    errors = {("dop853", 1e-6): 0.005, ("auto", 1e-6): 0.005}
    prices = {("dop853", 1e-6): 2e-3, ("auto", 1e-6): 1.9e-3}
    result = made_up(errors, seconds=prices)
    assert result.recommendation(1e-3, cost="stages").point.method == "dop853"
    assert result.recommendation(1e-3).point.method == "auto"


def test_of_two_level_settings_of_auto_the_cheaper_is_taken():
    errors = {("auto", 1e-4): 0.005, ("auto", 1e-6): 0.001, ("dop853", 1e-6): 0.005}
    prices = {("auto", 1e-4): 2.15e-3, ("auto", 1e-6): 2.05e-3, ("dop853", 1e-6): 2e-3}
    assert made_up(errors, seconds=prices).recommendation(1e-3).point.rtol == 1e-6


def test_the_uncertainty_of_the_reference_counts_as_error():
    # 0.0085 + 0.002 is above 0.01, and the reference is known well enough to say so.
    errors = {("rodas4", 1e-4): 0.0085, ("rodas4", 1e-6): 0.0005}
    prices = {("rodas4", 1e-4): 1.0, ("rodas4", 1e-6): 2.0}
    advice = made_up(errors, uncertainty=0.002, seconds=prices).recommendation(1e-3)
    assert advice.point.rtol == 1e-6
    assert advice.errors["slider.vx"] == pytest.approx(0.0025)


def test_a_single_accurate_run_is_not_recommended():
    errors = {("rodas4", 1e-4): 0.001, ("rodas4", 1e-5): 0.05, ("rodas4", 1e-6): 0.002}
    prices = {("rodas4", 1e-4): 1.0, ("rodas4", 1e-5): 2.0, ("rodas4", 1e-6): 3.0}
    assert made_up(errors, seconds=prices).recommendation(1e-3).point.rtol == 1e-6
    del errors["rodas4", 1e-6]
    advice = made_up(errors, seconds=prices).recommendation(1e-3)
    assert advice.point is None


def test_a_setting_that_failed_is_never_recommended():
    errors = {("rodas4", 1e-4): 0.001, ("rodas4", 1e-6): [0.0, 0.0, np.nan, np.nan]}
    status = {("rodas4", 1e-6): "max_steps"}
    prices = {("rodas4", 1e-4): 2.0, ("rodas4", 1e-6): 1.0}
    result = made_up(errors, seconds=prices, status=status)
    assert result.recommendation(1e-3).point.rtol == 1e-4
    assert result.recommendation(1e-3, until=0.01).point.rtol == 1e-4
    alone = made_up({("rodas4", 1e-6): errors["rodas4", 1e-6]}, status=status)
    assert alone.recommendation(1e-3).point is None


def test_no_setting_is_said_with_the_nearest_and_with_what_is_possible():
    errors = {("rodas4", 1e-4): [0.0, 0.004, 0.5, 3.0], ("rodas4", 1e-6): [0.0, 1e-4, 0.004, 0.2]}
    advice = made_up(errors, seconds={("rodas4", 1e-6): 2.0}).recommendation(1e-3)
    assert advice.point is None and advice.errors["slider.vx"] == pytest.approx(0.2)


def test_nothing_is_recommended_beyond_what_the_reference_knows():
    errors = {("rodas4", 1e-4): 0.001}
    result = made_up(errors, uncertainty=[0.0, 1e-6, 1e-3, 5.0])
    assert result.trusted_until == 0.03  # they diverge at that sample
    advice = result.recommendation(1e-3)
    assert advice.point is not None and advice.until == 0.02
    advice = result.recommendation(1e-3, until=0.03)
    assert advice.point is None
    advice = made_up(errors, uncertainty=1.0).recommendation(1e-3)
    assert advice.point is None


def test_a_demand_that_everything_meets_is_refused_or_said():
    errors = {("rodas4", 1e-4): 0.3, ("rodas4", 1e-6): 0.2}
    result = made_up(errors, seconds={("rodas4", 1e-6): 2.0})  # of a range of 10
    for vain in (1.5, {"slider.vx": 11.0}):
        with pytest.raises(cc.errors.ArgumentError):
            result.recommendation(vain)
    advice = result.recommendation(0.05)
    assert advice.point.rtol == 1e-4


def test_a_demand_that_nobody_can_meet_is_no_zero():
    errors = {("rodas4", 1e-4): [0.0, 0.0, 1e-3, 1e-3]}
    result = made_up(errors, uncertainty=[0.0, 0.0, 1e-6, 1e-5])
    advice = result.recommendation(1e-20)
    assert advice.point is None and advice.errors["slider.vx"] == 1e-5
    # Until the first impact all runs are the same to the last bit: known to rounding, of a range of 10.
    early = result.recommendation(1e-12)
    assert early.until == 0.01 and early.errors["slider.vx"] == pytest.approx(1e-13)


@pytest.mark.parametrize(
    "options",
    [
        {"accuracy": 0.0},
        {"accuracy": {"slider.v": 1.0}},
        {"accuracy": {}},
        {"until": 0.04},
        {"cost": "money"},
    ],
)
def test_wrong_wishes_are_refused(options):
    with pytest.raises(cc.errors.ArgumentError):
        made_up({("rodas4", 1e-4): 0.0}).recommendation(**options)


def test_errors_below_the_uncertainty_are_bounds():
    assert format_error(3e-3, 1e-3) == "0.0030"
    assert format_error(2e-3, 1e-3) == "≤ 0.0030"
    assert format_error(0.0, 0.0) == "≤ 0"
    result = made_up({("rodas4", 1e-4): 1e-3, ("rodas4", 1e-6): 1e-6}, uncertainty=1e-6)
    assert "0.0010" in result.table() and "≤ 2.0e-06" in result.table()


def test_the_table_shows_the_time_that_the_reference_knows():
    result = made_up({("rodas4", 1e-4): [0.0, 0.002, 0.03, 4.0]}, uncertainty=[0.0, 1e-6, 1e-3, 5.0])
    assert "up to 30 ms: no error is known beyond" in str(result)
    # Diverged at 30 ms: errors are also shown up to the sample before if that is not the end.
    longer = replace(
        result,
        t=np.append(TIMES, 0.04),
        points=tuple(replace(p, growth=np.append(p.growth, [[6.0]], axis=1)) for p in result.points),
        check=replace(result.check, growth=np.append(result.check.growth, [[7.0]], axis=1)),
    )
    assert "slider.vx [m/s] to 20 ms" in longer.table() and "0.030" in longer.table()


def test_points_that_are_only_bounds_are_hollow():
    result = made_up({("rodas4", 1e-4): 1e-3, ("rodas4", 1e-6): 1e-6}, uncertainty=1e-6)
    ax = plot_costs.plot_tradeoff(result)
    hollow = [line for line in ax.get_lines() if line.get_markerfacecolor() == "white"]
    assert [line.get_xdata()[0] for line in hollow] == [pytest.approx(2e-6)]
    ax = plot_costs.plot_tradeoff(made_up({("rodas4", 1e-4): 0.0}, uncertainty=0.0))
    ax.figure.canvas.draw()  # an error of zero has a place as well
