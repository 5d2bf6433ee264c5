"""Runs that fail: what is collected, what the results are without them, and what their verdicts say."""

import math
import time

import chebclear as cc
import numpy as np
import pytest
from chebclear.study.polynomials.holes import fit_holes

G = {"gravity": cc.Interval(8.0, 11.0), "tilt": cc.Interval(0.3, 1.2)}
TIME = {"duration": 0.4, "samples": 9}


def faller(gravity, tilt=math.pi / 2.0):
    axis = (math.cos(tilt), math.sin(tilt))
    return cc.Scene(
        [cc.Body("block", 1.0, 1.0)],
        [cc.Prismatic("guide", "ground", "block", axis)],
        [cc.Gravity((0.0, -gravity))],
    )


def height(gravity, tilt, t):
    return -0.5 * gravity * np.sin(tilt) ** 2 * t**2


def refusing(wrong, error=ValueError):
    """A mechanism whose `build` raises where `wrong` says so."""

    def build(gravity, tilt):
        if wrong(gravity, tilt):
            raise error("not today")
        return faller(gravity, tilt)

    return build


def near(gravity, tilt):
    return lambda g, a: abs(g - gravity) < 1e-9 and abs(a - tilt) < 1e-9


@pytest.fixture(scope="module")
def grid():
    return cc.Study(faller, G, ["block.y"], **TIME).chebyshev(degree=5).parameters


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_a_grid_with_a_hole_gives_the_polynomial_of_the_others(grid):
    study = cc.Study(refusing(near(*grid[14])), G, ["block.y"], rtol=1e-9, **TIME)
    result = study.chebyshev(degree=5)
    (failure,) = result.failures
    assert failure.index == 14 and failure.reason == "build"
    assert list(failure.parameters.values()) == pytest.approx(list(grid[14]))
    assert len(result.parameters) == 38 and result.values("block.y").shape == (38, 9)
    band = result["block.y"]
    exact = height(grid[14][0], grid[14][1], result.t)
    # Degree 5 follows the sine to 1e-5 of its change.
    missed = np.max(np.abs(band.evaluate(**failure.parameters) - exact))
    assert missed < 1e-3 * band.max_width
    assert band.resolved and missed / band.max_width < band.margin.error < 0.05
    told = {one.code: dict(one.numbers) for one in result.notices}
    assert told["failed"] == {"runs": 1, "of_runs": 40}
    assert (told["holes"]["runs"], told["holes"]["of_runs"]) == (1, 36) and told["holes"]["condition"] > 1.0


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_a_result_with_holes_survives_a_file(grid, tmp_path):
    build = refusing(lambda gravity, tilt: gravity > 10.7)
    result = cc.Study(
        build, G, ["block.y"], features={"end": cc.features.peak("block.vy")}, **TIME
    ).chebyshev(degree=5)
    assert len(result.failures) == 7
    again = cc.results.StudyResult.load(result.save(tmp_path / "holes"))
    assert again == result and again.failures == result.failures
    assert len(result.features["end"].values) == 32


def test_missing_values_follow_from_a_polynomial_that_the_others_determine():
    rng = np.random.default_rng(1)
    nodes, degrees, missing = (5, 6, 4), (3, 4, 2), (0, 17, 18, 60, 119)
    holes = fit_holes(nodes, degrees, missing)
    roots = [np.cos((2 * np.arange(count) + 1) * np.pi / (2 * count)) for count in nodes]
    grid = np.stack(np.meshgrid(*roots, indexing="ij"), axis=-1).reshape(-1, 3)
    powers = [p for p in np.ndindex(4, 5, 3)]
    values = sum(rng.normal() * np.prod(grid**p, axis=1) for p in powers)[:, None]
    assert not holes.dropped.any()  # there are runs to spare
    np.testing.assert_allclose(holes.filled(values[holes.known]), values, atol=1e-10)
    # Least squares: the fit to the filled grid is that of the known runs.
    noisy = values + 0.1 * rng.normal(size=values.shape)
    basis = np.stack([np.prod(np.cos(np.arccos(grid) * p), axis=1) for p in powers], axis=1)
    known, *_ = np.linalg.lstsq(basis[holes.known], noisy[holes.known], rcond=None)
    filled, *_ = np.linalg.lstsq(basis, holes.filled(noisy[holes.known]), rcond=None)
    np.testing.assert_allclose(filled, known, atol=1e-9)
    # The condition is that of the orthonormal basis on the known runs.
    scaled = np.linalg.qr(basis)[0][holes.known]
    assert holes.condition == pytest.approx(
        np.linalg.cond(scaled) * np.linalg.norm(scaled, 2) ** -1, rel=1e-6
    )


def test_terms_that_the_runs_do_not_determine_are_left_out():
    holes = fit_holes((4, 4), (3, 3), (5,))
    assert holes.dropped.sum() == 1 and holes.dropped[-1]  # the highest in both parameters
    with pytest.raises(ValueError):
        fit_holes((12, 12), (3, 3), range(143))


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_a_band_counts_failed_runs_as_outside():
    build = refusing(lambda gravity, tilt: gravity > 10.8)
    study = cc.Study(build, G, ["block.y"], **TIME)
    result = study.band(40, coverage=0.99)
    lost = len(result.failures)
    assert 0 < lost < 8 and len(result.parameters) == 40 - lost
    band = result["block.y"]
    assert band.verdict == "too few runs" and band.coverage <= (40 - lost) / 40
    assert [one.numbers["failed"] for one in result.notices if one.code == "too_few_runs"] == [lost]
    assert result.extend(20) == study.band(60, coverage=0.99)
    whole = cc.Study(faller, G, ["block.y"], **TIME).band(40, coverage=0.99)
    assert whole["block.y"].resolved and not whole.failures


def test_runs_that_fail_raise_if_they_are_to(grid):
    build = refusing(near(*grid[3]), LookupError)
    study = cc.Study(build, G, ["block.y"], on_failure="raise", **TIME)
    with pytest.raises(LookupError, match="not today"):
        study.chebyshev(degree=5)


def test_without_the_nominal_run_or_with_most_runs_failed_there_is_no_result():
    middle = near(G["gravity"].midpoint, G["tilt"].midpoint)
    with pytest.raises(ValueError, match="not today"):
        cc.Study(refusing(middle), G, ["block.y"], **TIME).scan(4)
    most = refusing(lambda gravity, tilt: not middle(gravity, tilt))
    with pytest.raises(ValueError, match="not today"):
        cc.Study(most, G, ["block.y"], **TIME).scan(4)


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_a_run_that_fails_is_repeated_once_more_tightly():
    from chebclear import _core
    from chebclear.execution import pieces

    real, asked = _core.sweep, []

    def sweep(scenes, settings, *rest):
        runs = real(scenes, settings, *rest)
        asked.append((len(scenes), settings))
        for row, (_, numbers, _) in enumerate(scenes):
            if -8.0 in np.frombuffer(numbers) and '"rtol": 1e-06' in settings:
                runs["ends"][row] = ("step_underflow", "", 0.0, None)
        return runs

    with pytest.MonkeyPatch.context() as patch:
        core = {"sweep": staticmethod(sweep), "__file__": _core.__file__}
        patch.setattr(pieces, "_core", type("Core", (), core))
        result = cc.Study(faller, {"gravity": G["gravity"]}, ["block.y"], **TIME).scan(4)
    assert [count for count, settings in asked if '"rtol": 1e-07' in settings] == [1]
    assert not result.failures
    (notice,) = (one for one in result.notices if one.code == "repeated")
    assert notice.numbers == {"runs": 1, "of_runs": 5} and notice.about == ("step_underflow",)
    alone = cc.simulate(faller(8.0), **TIME, rtol=1e-7)
    assert np.array_equal(result.values("block.y")[0], alone["block.y"])


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_callables_that_raise_return_nonsense_or_hang_cost_their_runs_only():
    def moody(run):
        g = run.scene.forces[0].acceleration[1]
        if g == -8.0:
            raise KeyError("mood")
        if g == -8.5:
            return math.nan
        if g == -9.0:
            while True:
                time.sleep(0.01)
        if g == -10.0:
            return "much"
        return run["block.y"][-1]

    study = cc.Study(
        faller, {"gravity": G["gravity"]}, ["block.y"], features={"end": moody}, run_seconds=0.5, **TIME
    )
    result = study.scan(13)
    reasons = {one.parameters["gravity"]: one.reason for one in result.failures}
    assert reasons == {8.0: "feature", 8.5: "feature", 9.0: "time_limit", 10.0: "feature"}
    np.testing.assert_allclose(result.features["end"].values[:, 0], result.values("block.y")[:, -1])
