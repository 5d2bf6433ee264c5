"""Chebyshev surrogates and bands against polynomials known in closed form and the ideal slider-crank."""

import math

import chebclear as cc
import numpy as np
import pytest
from chebclear.study.polynomials.surrogate import chebyshev_grid, tensor_grid
from numpy.polynomial import chebyshev
from refusals import refuses

# Three scales, none symmetric about zero.
BOX = {"long": cc.Interval(2.0, 5.0), "tiny": cc.Interval(-3e-6, 1e-6), "big": cc.Interval(1e9, 4e9)}
MIDDLE = {name: side.midpoint for name, side in BOX.items()}


def normalized(box, points):
    """Physical points, shape (points, parameters), to [-1, 1]."""
    return np.stack(
        [(x - s.midpoint) / s.half_width for x, s in zip(points.T, box.values(), strict=True)], axis=-1
    )


def fitted(function, degrees, nodes=None, box=BOX):
    """Surrogate of a function of normalized points, shape (points, parameters) -> (points, samples)."""
    nodes = nodes or [degree + 1 for degree in degrees]
    points = chebyshev_grid(list(box.values()), nodes)
    return cc.results.Surrogate.fit(box, nodes, degrees, function(normalized(box, points)))


def band_of(surrogate, t):
    lower, upper = surrogate.bounds()
    nodes = [degree + 1 for degree in surrogate.degrees]
    points = chebyshev_grid(list(surrogate.intervals.values()), nodes)
    runs = surrogate.evaluate(dict(zip(surrogate.intervals, points.T, strict=True)))
    return cc.results.Band(
        "output", t, lower, upper, runs.mean(axis=0), (runs.min(axis=0), runs.max(axis=0)),
        surrogate.intervals, points, runs, surrogate, "estimated", True, cc.results.Margin("polynomial"),
    )  # fmt: skip


def analytic(z):
    """Smooth in all three variables, with two samples."""
    first = np.exp(0.5 * z[:, 0]) * np.cos(z[:, 1] + 0.3) / (12.0 + z[:, 2])
    return np.stack([first, np.sin(z[:, 0] - 0.5 * z[:, 1] + 0.7 * z[:, 2])], axis=-1)


def random_points(count, seed=1):
    z = np.random.default_rng(seed).uniform(-1.0, 1.0, (count, len(BOX)))
    return {
        name: s.midpoint + s.half_width * column for (name, s), column in zip(BOX.items(), z.T, strict=True)
    }, z


def test_grids_change_the_first_parameter_slowest():
    grid = tensor_grid([np.array([1.0, 2.0]), np.array([3.0, 4.0, 5.0])])
    assert grid.tolist() == [[1, 3], [1, 4], [1, 5], [2, 3], [2, 4], [2, 5]]
    roots = chebyshev_grid([cc.Interval(0.0, 2.0)], [2])[:, 0]
    np.testing.assert_allclose(roots, [1.0 + math.sqrt(0.5), 1.0 - math.sqrt(0.5)], rtol=1e-15)


def test_evaluation_is_that_of_numpy():
    surrogate = fitted(analytic, (4, 3, 5))
    values, z = random_points(50)
    # NumPy sums the same series by Clenshaw's recurrence.
    expected = chebyshev.chebval3d(*z.T, surrogate.coefficients).T
    np.testing.assert_allclose(surrogate.evaluate(values), expected, atol=1e-13)


def test_evaluation_broadcasts():
    surrogate = fitted(analytic, (4, 3, 5))
    band = band_of(surrogate, np.arange(2.0))
    assert band.evaluate(**MIDDLE).shape == (2,)
    grid = band.evaluate(long=np.array([[2.0], [3.0], [5.0]]), tiny=np.array([-1e-6, 0.0]), big=2e9)
    assert grid.shape == (3, 2, 2)
    np.testing.assert_array_equal(grid[1, 1], band.evaluate(long=3.0, tiny=0, big=2e9))


def test_the_ends_of_the_intervals_are_inside_and_nothing_beyond():
    band = band_of(fitted(analytic, (2, 2, 2)), np.arange(2.0))
    for name, side in BOX.items():
        for end, sign in ((side.lower, -1.0), (side.upper, 1.0)):
            at_end = band.evaluate(**{**MIDDLE, name: end})
            size = max(abs(side.lower), abs(side.upper))
            # Rounding of an end is forgiven, and the polynomial not continued.
            assert np.array_equal(band.evaluate(**{**MIDDLE, name: end + sign * 4e-16 * size}), at_end)
            with refuses(name):
                band.evaluate(**{**MIDDLE, name: end + sign * 2e-15 * size})
    with refuses("big"):
        band.evaluate(**{**MIDDLE, "big": math.nan})
    with refuses("lnog", "long", "tiny", error=TypeError):
        band.evaluate(lnog=3.0, tiny="small", big=2e9)
    with refuses("tiny", error=TypeError):
        band.sensitivity("long", at={"long": 3.0, "big": 2e9})
    with pytest.raises(ValueError):
        band.sensitivity("lng")


@pytest.mark.parametrize("middle", [0.05, 0.12, 2e-5, 0.3, 7.0])
@pytest.mark.parametrize("percent", [1, 3, 7, 10, 15])
def test_the_ends_of_a_relative_interval_can_be_typed(middle, percent):
    box = {"a": cc.Interval.around(middle, rel=percent / 100)}
    surrogate = fitted(lambda z: z, (1,), box=box)
    for sign in (-1, 1):
        typed = float(f"{middle * (100 + sign * percent) / 100:.12g}")
        assert surrogate.evaluate({"a": typed})[0] == pytest.approx(sign, rel=1e-12)


def test_no_points_give_no_values():
    band = band_of(fitted(analytic, (2, 2, 2)), np.arange(2.0))
    assert band.evaluate(**{**MIDDLE, "long": []}).shape == (0, 2)
    assert band.evaluate(**{**MIDDLE, "long": np.empty((3, 0))}).shape == (3, 0, 2)
    assert band.sensitivity("tiny", at={**MIDDLE, "long": []}).shape == (0, 2)


def test_sensitivities_broadcast():
    band = band_of(fitted(analytic, (4, 3, 5)), np.arange(2.0))
    long = [2.0, 3.5, 5.0]
    slopes = band.sensitivity("tiny", at={**MIDDLE, "long": long})
    assert slopes.shape == (3, 2)
    for slope, value in zip(slopes, long, strict=True):
        np.testing.assert_allclose(slope, band.sensitivity("tiny", at={**MIDDLE, "long": value}), rtol=1e-13)


def test_an_interval_as_wide_as_the_floats():
    side = cc.Interval(-1.5e308, 1.7e308)
    assert side.midpoint == pytest.approx(0.1e308) and side.half_width == pytest.approx(1.6e308)
    surrogate = fitted(lambda z: z, (1,), box={"a": side})
    assert surrogate.evaluate({"a": [side.lower, side.midpoint, side.upper]})[:, 0] == pytest.approx(
        [-1, 0, 1]
    )


def test_sensitivities_are_central_differences_in_physical_units():
    band = band_of(fitted(analytic, (8, 8, 8)), np.arange(2.0))
    inside = {"long": 4.1, "tiny": 0.6e-6, "big": 1.3e9}
    for at in (None, inside):
        center = at or MIDDLE
        for name, side in BOX.items():
            step = 1e-4 * side.half_width
            ahead = band.evaluate(**{**center, name: center[name] + step})
            behind = band.evaluate(**{**center, name: center[name] - step})
            slope = band.sensitivity(name, at=at)
            np.testing.assert_allclose(slope, (ahead - behind) / (2.0 * step), rtol=1e-6)
            scaled = band.sensitivity(name, normalized=True, at=at)
            np.testing.assert_allclose(scaled, slope * side.half_width, rtol=1e-14)


def test_the_worst_corner_of_a_monotone_function():
    def monotone(z):
        rising = z[:, 0] - 2.0 * z[:, 1] + 0.5 * z[:, 2]
        return np.stack([rising, -rising], axis=-1)

    band = band_of(fitted(monotone, (1, 2, 1)), np.arange(2.0))
    assert {name: list(column) for name, column in band.worst("upper").items()} == {
        "long": [5.0, 2.0],
        "tiny": [-3e-6, 1e-6],
        "big": [4e9, 1e9],
    }
    assert {name: list(column) for name, column in band.worst("lower").items()} == {
        "long": [2.0, 5.0],
        "tiny": [1e-6, -3e-6],
        "big": [1e9, 4e9],
    }
    with refuses("side"):
        band.worst("uper")


@pytest.fixture
def wavy():
    t = np.linspace(0.0, 1.0, 101)
    surrogate = cc.results.Surrogate(
        {"a": cc.Interval(0.0, 1.0)}, (1,), np.stack([np.sin(30.0 * t), 0.1 + 0.05 * np.cos(70.0 * t)])
    )
    return band_of(surrogate, t)


@pytest.mark.parametrize("window", [0.02, 0.03, 0.1, 0.35, 1.0, 5.0])
def test_running_envelope(wavy, window):
    envelope = wavy.envelope(window)
    for index, instant in enumerate(wavy.t):
        near = np.abs(wavy.t - instant) <= 0.5 * window + 1e-9
        assert envelope.upper[index] == wavy.upper[near].max()
        assert envelope.lower[index] == wavy.lower[near].min()
    assert np.array_equal(envelope.nominal, wavy.nominal) and envelope.name == wavy.name
    assert envelope.max_width >= wavy.max_width


@pytest.mark.parametrize("window", [0.0, -0.1, 0.019, math.nan, math.inf, "0.1", None])
def test_wrong_windows_are_refused(wavy, window):
    with pytest.raises((ValueError, TypeError)):
        wavy.envelope(window)


def test_an_envelope_has_no_polynomial_and_no_runs(wavy):
    envelope = wavy.envelope(0.1)
    for use in (
        lambda: envelope.coefficients,
        lambda: envelope.sensitivity("a"),
        lambda: envelope.evaluate(a=0.5),
    ):
        with pytest.raises(cc.errors.ArgumentError):
            use()
    with pytest.raises(cc.errors.ArgumentError):
        envelope.worst("upper")


# The ideal slider-crank of the paper, two parameters of 10 %, over one revolution.
LENGTHS = {
    "crank_length": cc.Interval.around(0.05, rel=0.10),
    "rod_length": cc.Interval.around(0.12, rel=0.10),
}
SPEED = cc.rpm(2000)


def ideal_runs(points, angle):
    """Position and velocity of the slider in closed form, each of shape (runs, samples)."""
    crank, rod = points[:, :1], points[:, 1:]
    root = np.sqrt(rod**2 - (crank * np.sin(angle)) ** 2)
    position = crank * np.cos(angle) + root
    velocity = -SPEED * (crank * np.sin(angle) + crank**2 * np.sin(angle) * np.cos(angle) / root)
    return position, velocity


@pytest.mark.parametrize(
    ("output", "errors", "scan_width", "bound_width"),
    [
        # Bounds of the ideal mechanism, found independently: relative errors as the paper's Table 3 measures
        # them, and largest widths [m], [m/s].
        (0, (0.078e-2, 0.220e-2), 34.42e-3, 34.9e-3),
        (1, (0.437e-2, 0.437e-2), 3.191, 3.3705),
    ],
)
def test_bounds_of_the_ideal_mechanism(output, errors, scan_width, bound_width):
    angle = np.linspace(0.0, 2.0 * math.pi, 721)
    sides = list(LENGTHS.values())
    nodes = chebyshev_grid(sides, [4, 4])
    surrogate = cc.results.Surrogate.fit(LENGTHS, [4, 4], [3, 3], ideal_runs(nodes, angle)[output])
    lower, upper = surrogate.bounds("eq31")
    scan = ideal_runs(tensor_grid([np.linspace(side.lower, side.upper, 10) for side in sides]), angle)[output]

    def rms(values):
        return math.sqrt(np.mean(values**2))

    scan_lower, scan_upper = scan.min(axis=0), scan.max(axis=0)
    assert abs(rms(lower) - rms(scan_lower)) / rms(scan_lower) == pytest.approx(errors[0], abs=0.0006e-2)
    assert abs(rms(upper) - rms(scan_upper)) / rms(scan_upper) == pytest.approx(errors[1], abs=0.0012e-2)
    assert (scan_upper - scan_lower).max() == pytest.approx(scan_width, rel=2e-4)
    assert (upper - lower).max() == pytest.approx(bound_width, rel=2e-3)
    # The range of the same polynomial is that of the mechanism: Table 3 shows the slack of Eq. (31).
    lower, upper = surrogate.bounds()
    assert (upper - lower).max() == pytest.approx(scan_width, rel=2e-4)
    assert rms(lower) == pytest.approx(rms(scan_lower), rel=2e-5)
    assert rms(upper) == pytest.approx(rms(scan_upper), rel=2e-5)
