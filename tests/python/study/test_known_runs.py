"""Every known run takes part in the verdict: no polynomial is trusted that misses the nominal run."""

import warnings

import chebclear as cc
import numpy as np
import pytest
from refusals import refuses

T = np.linspace(0.0, 1.0, 5)


def resonance(ratio):
    """Amplification of a forced oscillator with a damping ratio of 1e-4: 5,000 at the nominal frequency."""
    return {"t": T, "y": np.full(5, ((1 - ratio**2) ** 2 + (2e-4 * ratio) ** 2) ** -0.5)}


def narrow(**parameters):
    """1 at the nominal values, and nearly 0 at each of some hundred other places in eight dimensions."""
    return {"t": T, "y": np.full(5, np.exp(-200 * sum(value**2 for value in parameters.values())))}


def quiet_band(model, box, runs, seed):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        return cc.Study(model, box).band(runs, rng=seed)["y"]


@pytest.mark.parametrize("runs", [21, 41, 81, 161])
@pytest.mark.parametrize("half_width", [0.5, 0.1])
def test_a_resonance_at_the_nominal_is_not_resolved(runs, half_width):
    box = {"ratio": cc.Interval(1 - half_width, 1 + half_width)}
    for seed in range(20):
        band = quiet_band(resonance, box, runs, seed)
        assert not band.resolved, seed
        assert band.surrogate is None
        with pytest.raises(cc.ChebclearError):
            band.sensitivity("ratio")


@pytest.mark.parametrize("runs", [21, 161])
def test_a_narrow_peak_of_many_parameters_is_not_resolved(runs):
    box = {f"p{number}": cc.Interval(-1.0, 1.0) for number in range(8)}
    for seed in range(5):
        assert not quiet_band(narrow, box, runs, seed).resolved, seed


def test_an_included_run_that_is_far_from_all_others_counts_as_well():
    def spike(a):
        return {"t": T, "y": np.full(5, a + 100 * (abs(a - 0.7) < 1e-9))}

    study = cc.Study(spike, {"a": cc.Interval(0.0, 1.0)})
    assert study.band(41)["y"].resolved
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        further = cc.Study(spike, {"a": cc.Interval(0.4, 1.0)}).chebyshev(degree=2)
        assert not study.band(41, include=further)["y"].resolved


def test_a_nominal_run_off_the_middle_is_where_it_is_in_bands_of_a_part_of_the_runs():
    side = cc.Interval(0.0, 1.0, nominal=0.9)
    result = cc.Study(lambda a: {"t": T, "y": np.full(5, a)}, {"a": side}).band(41)
    assert result["y"].resolved and result.nominal_parameters is None
    assert result.bands_of_first(20)["y"].resolved


@pytest.mark.parametrize("runs", [2, 9, 0.5])
def test_the_first_runs_of_a_band_are_three_or_more_of_them(runs):
    result = cc.Study(lambda a: {"t": T, "y": np.full(5, a)}, {"a": cc.Interval(0.0, 1.0)}).band(8)
    with refuses("runs"):
        result.bands_of_first(runs)
