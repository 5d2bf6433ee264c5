"""Shares in specification against closed forms, SciPy and published probabilities."""

import dataclasses
import math
import pickle
from statistics import NormalDist
from types import SimpleNamespace

import chebclear as cc
import numpy as np
import pytest
from chebclear.execution import dispatch
from chebclear.study.band.exact import binomial_cdf, exact_interval, looks
from refusals import refuses


def play(gap, thread):
    return {"play": gap - thread}


SHAFT = cc.Study(play, {"gap": cc.normal(10.1, 0.02), "thread": cc.normal(10.0, 0.02)})
PLAY = NormalDist(0.1, 0.02 * math.sqrt(2.0))


def function_generator(a, b, c, d):
    """Error [rad] of a four-bar that should turn its rocker by a sine, closed form."""
    theta = np.radians(np.linspace(95.5, 215.5, 121))
    wanted = np.radians(76.0) + np.radians(60.0) * np.sin(0.75 * (theta - theta[0]))
    x, y = a * np.cos(theta) - d, a * np.sin(theta)
    length = np.hypot(x, y)
    angle = np.arctan2(y, x) - np.arccos((length**2 + c**2 - b**2) / (2.0 * length * c))
    return {"error": float(np.max(np.abs(np.angle(np.exp(1j * (angle - wanted))))))}


class TestIntervals:
    @pytest.mark.parametrize("trials", [1, 2, 10, 93, 1000, 50_000])
    def test_they_are_those_of_scipy(self, trials):
        stats = pytest.importorskip("scipy.stats")
        for count in sorted({0, 1, trials // 7, trials // 2, trials - 1, trials}):
            for confidence in (0.8, 0.95, 0.999):
                truth = stats.binomtest(count, trials).proportion_ci(confidence, method="exact")
                found = exact_interval(count, trials, confidence)
                # SciPy finds its ends by a root search with an absolute tolerance of 2e-12.
                np.testing.assert_allclose(found, (truth.low, truth.high), rtol=1e-9, atol=2e-12)

    def test_the_distribution_sums_to_one_and_is_that_of_scipy(self):
        stats = pytest.importorskip("scipy.stats")
        for count, trials, probability in [(0, 5, 0.3), (4, 5, 0.3), (40, 10_000, 0.005), (900, 1000, 0.9)]:
            truth = stats.binom.cdf(count, trials, probability)
            assert binomial_cdf(count, trials, probability) == pytest.approx(truth, rel=1e-10)
        assert binomial_cdf(5, 5, 0.3) == 1.0

    @pytest.mark.parametrize("probability", [1e-4, 0.02, 0.3])
    def test_looks_at_growing_runs_keep_the_confidence(self, probability):
        """The whole procedure on 2000 series of binomial trials: naive intervals hold it in 82 to 92 %."""
        beta = pytest.importorskip("scipy.stats").beta
        stops = looks(0.04, 5000, 0.95)
        assert len(set(stops)) == len(stops) > 3
        tail = 0.025 / len(stops)
        pieces = np.diff(stops, prepend=0)
        found = np.cumsum(np.random.default_rng(7).binomial(pieces, probability, (2000, len(stops))), axis=1)
        lower = np.where(found == 0, 0.0, beta.ppf(tail, found, np.array(stops) - found + 1))
        upper = np.where(found == stops, 1.0, beta.isf(tail, found + 1, np.array(stops) - found))
        end = np.argmax(upper - lower <= 0.04, axis=1), np.arange(2000)
        assert np.all((upper - lower).T[end] <= 0.04)
        held = (lower.T[end] <= probability) & (probability <= upper.T[end])
        assert np.count_nonzero(held) >= 0.95 * 2000


class TestShares:
    def test_intervals_hold_the_true_share_as_often_as_they_say(self):
        """95 % intervals hold it in at least 93 of 100 seeds, also where the 12th failure ends the runs."""
        truth = 1.0 - PLAY.cdf(0.04)
        for more in ({"runs": 300}, {"runs": 3000, "failures": 12}):
            held = 0
            for seed in range(100):
                share = cc.conformance(SHAFT, {"play": cc.require("play", above=0.04)}, rng=seed, **more)[
                    "play"
                ]
                held += share.lower <= truth <= share.upper
            assert held >= 93, more

    def test_runs_grow_until_the_interval_is_as_narrow_as_asked(self):
        """The true share is held in at least 93 of 100 seeds, also where no mechanism is outside."""
        for limit, width in ((0.08, 0.2), (-0.1, 0.02)):
            truth, held = 1.0 - PLAY.cdf(limit), 0
            for seed in range(100):
                wanted = {"play": cc.require("play", above=limit)}
                share = cc.conformance(SHAFT, wanted, 2000, width=width, rng=seed)["play"]
                held += share.lower <= truth <= share.upper
                assert share.upper - share.lower <= width and share.runs in looks(width, 2000, 0.95)
            assert held >= 93, limit
        # The budget ends them first: wider than asked, and as sure.
        share = cc.conformance(SHAFT, {"play": cc.require("play", above=0.08)}, 100, width=0.01)["play"]
        assert share.runs == 100 and share.upper - share.lower > 0.01

    def test_runs_end_when_their_time_is_over_and_what_was_not_begun_does_not_count(self, monkeypatch):
        now = [0.0]
        monkeypatch.setattr(dispatch, "time", SimpleNamespace(monotonic=lambda: now[0]))

        def slow(gap):
            now[0] += 2e-3
            return {"play": gap}

        study = cc.Study(slow, {"gap": cc.normal(0.0, 1.0)}, max_seconds=0.2, threads=1)
        with pytest.warns(cc.ChebclearWarning):
            found = cc.conformance(study, cc.require("play", below=9.0), 100_000)
        (share,) = found.values()
        assert share.outside == share.failed == 0 and 0 < share.runs < 100_000
        assert len(found.parameters) == share.runs

    def test_a_function_generator_has_its_published_probabilities(self):
        """P(error > 0.6, 0.7, 0.8 degrees) = 0.1598, 0.0398, 0.00640 from 3e7 independent mechanisms."""
        lengths = {"a": 53.0, "b": 122.0, "c": 66.5, "d": 100.0}
        study = cc.Study(
            function_generator,
            {name: cc.normal(size, 0.1) for name, size in lengths.items()},
            units={"error": "rad"},
        )
        wanted = {f"{limit}": cc.require("error", below=f"{limit} deg") for limit in (0.6, 0.7, 0.8)}
        found = cc.conformance(study, wanted, 8000, rng=3)
        for limit, truth in {"0.6": 0.1598, "0.7": 0.0398, "0.8": 0.00640}.items():
            share = found[limit]
            assert share.lower <= 1.0 - truth <= share.upper, limit
        # The narrowest limit decides on all of them.
        assert found["all"].outside == found["0.6"].outside

    def test_parameters_that_are_only_known_as_intervals_give_the_smallest_and_the_largest_share(self):
        """|x + s| < 3 for s in [-1, 1]: at the nominal value 0.99730, at the corners 0.97722."""

        def shifted(x, s):
            return {"y": x + s}

        study = cc.Study(shifted, {"x": cc.normal(0.0, 1.0), "s": cc.Interval(-1.0, 1.0)})
        share = cc.conformance(study, {"y": cc.require("y", above=-3, below=3)}, 4000, rng=1)["y"]
        standard = NormalDist()
        best, worst = 1.0 - 2.0 * standard.cdf(-3.0), standard.cdf(2.0) - standard.cdf(-4.0)
        assert share.lower <= worst and best <= share.upper
        assert share.lower > worst - 0.01 and share.upper < best + 0.003
        assert [place["s"] for place in share.at] == [0.0, -1.0, 1.0]
        assert share.share == pytest.approx(best, abs=0.003)

    def test_the_least_share_may_be_at_a_point_inside_an_interval(self):
        """x + 3 - 2 |s - 0.3| < 5.5 for s in [-1, 1]: 0.99379 at s = 0.3, 1 at both ends."""

        def bent(x, s):
            return {"y": x + 3.0 - 2.0 * abs(s - 0.3)}

        study = cc.Study(bent, {"x": cc.normal(0.0, 1.0), "s": cc.Interval(-1.0, 1.0)})
        wanted = cc.require("y", below=5.5)
        (coarse,) = cc.conformance(study, wanted, 3000, rng=4).values()
        (fine,) = cc.conformance(study, wanted, 3000, inner=16, rng=4).values()
        worst = NormalDist().cdf(2.5)
        assert len(coarse.at) == 3 and len(fine.at) == len(fine.counts) == 19
        assert fine.lower <= worst and fine.lower < coarse.lower
        assert fine.at[int(np.argmin(fine.intervals[:, 0]))]["s"] == pytest.approx(0.3, abs=0.13)

    def test_dimensions_that_depend_on_each_other_are_functions_of_independent_ones(self):
        """A bore and a shaft of one batch share its deviation: only their own deviations are in the play."""

        def fit(batch, bore, shaft):
            return {"play": (batch + bore) - (batch + shaft)}

        own = {"bore": cc.normal(0.03, 0.004), "shaft": cc.normal(0.0, 0.003)}
        study = cc.Study(fit, {"batch": cc.normal(20.0, 0.5)} | own)
        (share,) = cc.conformance(study, cc.require("play", above=0.02), 4000).values()
        truth = NormalDist(0.03, 0.005).cdf(0.02)
        assert share.lower <= 1.0 - truth <= share.upper
        file = """
            format = 1
            parameters.batch = { limits = ["18.5 mm", "21.5 mm"], distribution = "normal" }
            parameters.more = { limits = ["-0.3 mm", "0.3 mm"], distribution = "normal" }
            parameters.length = "2 * batch + more"
            bodies = [{ name = "block", mass = 1, inertia = 1 }]
            joints = [{ type = "prismatic", name = "rail", a = "ground", b = "block", axis = [1, 0] }]
            start = [{ type = "joint", joint = "rail", position = "length - 2 * batch" }]
            requirements.short = { of = "block.x", below = "0.1 mm" }
            run = { duration = 1e-3, samples = 3 }
        """
        found = cc.loads(file).conformance(1000)["short"]
        assert found.lower <= NormalDist().cdf(1.0) <= found.upper

    def test_a_conformance_is_saved_loaded_copied_and_compared(self, tmp_path):
        wanted = {"play": cc.require("play", above=0.04), "large": cc.require("play", below=0.2)}
        found = cc.conformance(SHAFT, wanted, 50)
        again = cc.load_result(found.save(tmp_path / "found"))
        assert again == found == pickle.loads(pickle.dumps(found)) and str(again) == str(found)
        assert again != cc.conformance(SHAFT, wanted, 51)
        with pytest.raises(cc.errors.ArgumentError):
            cc.results.StudyResult.load(tmp_path / "found.npz")

    def test_ppk_is_cpk_of_a_normal_distribution_and_not_of_another(self):
        found = cc.conformance(SHAFT, {"play": cc.require("play", above=0.0, below=0.21)}, 40_000, rng=5)
        assert found["play"].ppk == pytest.approx(0.1 / (3.0 * PLAY.stdev), rel=0.03)

        def factor(z):
            return {"y": math.exp(0.4 * z)}

        skewed = cc.Study(factor, {"z": cc.normal(0.0, 1.0)})
        share = cc.conformance(skewed, {"y": cc.require("y", below=3.0)}, 40_000, rng=5)["y"]
        assert share.ppk == pytest.approx(0.862, rel=0.03)
        assert share.ppm == pytest.approx(3010.0, rel=0.3)
        assert math.isnan(cc.conformance(SHAFT, {"play": cc.require("play", above=0.0)}, 100)["play"].ppk)

    def test_runs_end_with_the_last_failure_that_counts(self):
        share = cc.conformance(SHAFT, {"play": cc.require("play", above=0.08)}, 5000, failures=20, rng=2)[
            "play"
        ]
        assert share.outside == 20
        assert not share.limits[0] < share.lowest[-1]
        # The same mechanisms as without an end.
        whole = cc.conformance(SHAFT, {"play": cc.require("play", above=0.08)}, 5000, rng=2)["play"]
        np.testing.assert_array_equal(whole.lowest[: share.runs], share.lowest)


class TestStudies:
    """Studies answer their requirements first."""

    @staticmethod
    def moving(gap, thread):
        t = np.linspace(0.0, math.pi, 5)
        return {"t": t, "x": (gap - thread) * np.cos(t), "play": gap - thread}

    def uniform(self, **more):
        sides = {"gap": cc.uniform(10.0, 10.2), "thread": cc.uniform(9.9, 10.1)}
        limits = {"wide": cc.require("play", below=0.15), "moves": cc.require("x", above=-0.05)}
        return cc.Study(self.moving, sides, requirements=limits, **more)

    def test_independent_runs_of_uniform_parameters_are_counted_themselves(self, tmp_path):
        """The play is distributed as a triangle from -0.1 to 0.3: 23/32 are below 0.15, 8/32 within 0.05."""
        result = self.uniform().band(400, coverage=0.99)
        shares = result.conformance
        assert shares.seed is None and shares["wide"].runs == 400
        play, x = result.features["play"].values[:, 0], result.values("x")
        assert shares["wide"].outside == np.count_nonzero(play >= 0.15)
        assert shares["moves"].outside == np.count_nonzero(np.any(x <= -0.05, axis=1))
        held = []
        for seed in range(40):
            found = self.uniform().sample(60, rng=seed).conformance
            held += [found["wide"].lower <= 23 / 32 <= found["wide"].upper]
            held += [found["moves"].lower <= 8 / 32 <= found["moves"].upper]
        assert sum(held) >= 0.93 * len(held)
        assert str(shares) in str(result)
        assert cc.load_result(result.save(tmp_path / "study")) == result
        more = result.extend(100)
        assert more == self.uniform().band(500, coverage=0.99) and more.conformance["wide"].runs == 500
        assert self.uniform().sample(50).conformance["wide"].runs == 50

    def test_other_runs_are_drawn_where_those_of_the_study_are_no_draws(self):
        for make in (lambda one: one.band(81), lambda one: one.chebyshev(2), lambda one: one.scan(3)):
            found = make(self.uniform()).conformance
            assert found.seed == 0 and found == cc.conformance(self.uniform(), runs=100)
        sides = {"gap": cc.normal(10.1, 0.03), "thread": cc.Interval(9.9, 10.1)}
        study = cc.Study(self.moving, sides, requirements=cc.require("x", below=0.3))
        result = study.band(300, coverage=0.99, rng=7)
        assert result.conformance == cc.conformance(study, runs=300, rng=7)
        (share,) = result.conformance.values()
        assert len(share.at) == 3
        # The least share is that of the thinnest thread.
        assert share.lower <= NormalDist(10.1, 0.03).cdf(10.2) <= share.upper
        assert result.extend(41) == study.band(341, coverage=0.99, rng=7)

    def test_simulated_runs_are_judged_between_their_samples(self):
        """The lowest position is minus the length, which lies between samples; the drawing is the same."""
        sides = {"length": cc.uniform(0.09, 0.11), "stiffness": cc.uniform(90.0, 110.0)}
        how = {"duration": 1.0, "samples": 11, "rtol": 1e-6}
        wanted = cc.require("block.x", above=-0.105)
        study = cc.Study(TestSimulations.scene, sides, ["block.vx"], requirements=wanted, **how)
        result = study.sample(400)
        (share,) = result.conformance.values()
        assert list(result) == ["block.vx"] and result.conformance.seed is None
        length = result.parameters[:, list(sides).index("length")]
        assert share.outside == np.count_nonzero(length >= 0.105)
        assert result.spec.study().sample(400) == result
        plain = cc.Study(TestSimulations.scene, sides, ["block.vx"], **how).sample(400)
        np.testing.assert_array_equal(result.values("block.vx"), plain.values("block.vx"))
        assert plain.conformance is None

    def test_its_requirements_are_checked_with_all_else_and_before_the_runs(self):
        box = {"gap": cc.Interval(10.0, 10.2), "thread": cc.Interval(9.9, 10.0)}
        with refuses('requirements["a"]', "parameters", "threads"):
            cc.Study(self.moving, box, requirements={"a": "x < 3"}, threads=0)
        study = TestSimulations().study(requirements=cc.require("block.z", below=1.0))
        with pytest.raises(cc.errors.ArgumentError):
            study.band(10_000)
        with pytest.raises(cc.errors.ArgumentError):
            cc.conformance(SHAFT)


class TestSimulations:
    @staticmethod
    def scene(length, stiffness):
        return cc.Scene(
            [cc.Body("block", 1.0, 1.0)],
            [cc.Prismatic("rail", "ground", "block", (1.0, 0.0))],
            [cc.Force("pull", "block", x=cc.motions.Expression("-k*block.x", {"k": stiffness}), y=0.0)],
            start=[cc.JointStart("rail", position=length)],
        )

    def study(self, **more):
        return cc.Study(
            self.scene,
            {"length": cc.normal(0.1, 0.002), "stiffness": cc.uniform(90.0, 110.0)},
            duration=1.0,
            samples=11,
            **more,
        )

    def test_an_output_may_be_required_at_an_instant_and_a_feature_as_it_is(self):
        study = self.study(features={"top speed": cc.features.peak("block.vx")})
        found = cc.conformance(
            study,
            {
                "there": cc.require("block.x", above=-0.1, below=0.1, at=0.5),
                "speed": cc.require("top speed", below="1.02 m/s"),
            },
            200,
        )
        length, stiffness = (
            found.parameters[:, found.parameter_names.index(name)] for name in ("length", "stiffness")
        )
        np.testing.assert_allclose(
            found["there"].lowest, length * np.cos(0.5 * np.sqrt(stiffness)), atol=1e-6
        )
        np.testing.assert_allclose(found["speed"].highest, length * np.sqrt(stiffness), rtol=1e-5)
        assert found["speed"].outside == np.count_nonzero(length * np.sqrt(stiffness) >= 1.02)
        assert list(found) == ["there", "speed", "all"]

    @staticmethod
    def wheel(radius, speed):
        return cc.Scene(
            [cc.Body("wheel", 1.0, 1.0, points={"tip": (radius, 0.0)})],
            [cc.Revolute("axle", "ground", "wheel")],
            drives=[cc.motions.Speed("drive", "axle", speed)],
        )

    def test_an_output_may_be_required_at_a_crank_angle_in_every_revolution(self):
        """At 60 degrees the tip is at half the radius, whatever the speed and however coarse the samples."""
        sides = {"radius": cc.normal(0.1, 0.002), "speed": cc.uniform(-22.0, -18.0)}
        study = cc.Study(self.wheel, sides, duration=1.0, samples=5)
        angle = {"there": cc.require("wheel.tip.x", above=0.0495, at="60 deg")}
        instant = {"then": cc.require("wheel.tip.x", below="99 mm", at="0.25 s")}
        found = cc.conformance(study, angle | instant, 200)
        radius, speed = found.parameters.T
        np.testing.assert_allclose(found["there"].lowest, 0.5 * radius, rtol=1e-8)
        np.testing.assert_allclose(found["there"].highest, 0.5 * radius, rtol=1e-8)
        np.testing.assert_allclose(found["then"].highest, radius * np.cos(0.25 * speed), rtol=1e-6)
        assert found["there"].lower <= NormalDist(0.05, 0.001).cdf(0.0505) <= found["there"].upper
        # At the start alone: the crank does not come round again in 0.2 s.
        start = cc.require("wheel.tip.x", above=0.1, at="0 deg")
        (share,) = cc.conformance(study, start, 20).values()
        np.testing.assert_allclose(share.lowest, found.parameters[:20, 0], rtol=1e-8)
        late = cc.Study(self.wheel, sides, duration=0.1, samples=5)
        for made, quantity, more in (
            (late, "wheel.tip.x", {}),
            (study, "wheel.tip.x", {"joint": "axel"}),
            (self.study(), "block.x", {}),
            (SHAFT, "play", {}),
        ):
            with pytest.raises(cc.errors.ArgumentError):
                cc.conformance(made, cc.require(quantity, above=0.0, at="90 deg", **more), 5)

    def test_samples_that_are_too_coarse_for_an_angle_are_refused(self):
        def spun(torque):
            wheel = self.wheel(0.1, 1.0)
            pushed = cc.Torque("motor", "wheel", torque)
            return dataclasses.replace(wheel, drives=(), forces=(pushed,))

        study = cc.Study(spun, {"torque": cc.normal(30.0, 1.0)}, duration=1.0, samples=101)
        wanted = cc.require("wheel.tip.y", above=0.05, at="90 deg", joint="axle")
        with pytest.raises(cc.errors.ArgumentError):
            cc.conformance(study, wanted, 5)
        (share,) = cc.conformance(
            cc.Study(spun, {"torque": cc.normal(30.0, 1.0)}, duration=1.0, samples=8001), wanted, 5
        ).values()
        np.testing.assert_allclose(share.lowest, 0.1, rtol=1e-6)

    def test_a_mechanism_that_fails_is_outside(self):
        def fragile(x):
            if x > 2.0:
                raise ValueError("cannot be assembled")
            return {"y": x}

        study = cc.Study(fragile, {"x": cc.normal(0.0, 1.0)})
        share = cc.conformance(study, {"y": cc.require("y", below=5.0)}, 500, rng=1)["y"]
        assert share.failed == share.outside > 0
        # Nine of ten, as most of a bad design do.
        worse = cc.Study(fragile, {"x": cc.normal(3.3, 1.0)})
        share = cc.conformance(worse, {"y": cc.require("y", below=5.0)}, 500, rng=1)["y"]
        assert 0.85 * 500 < share.failed == share.outside < 500
        none = cc.Study(fragile, {"x": cc.normal(30.0, 1.0)})
        with pytest.raises(ValueError):
            cc.conformance(none, {"y": cc.require("y", below=5.0)}, 50)
        # The notice counts those of all pieces of runs, and says that they count as outside.
        with pytest.warns(cc.errors.ChebclearWarning):
            found = cc.conformance(study, {"y": cc.require("y", below=1.7)}, 4000, failures=60)
        (notice,) = [one for one in found.notices if one.code == "failed"]
        assert notice.numbers["of_runs"] >= found["y"].runs > 400
        assert notice.numbers["runs"] >= found["y"].failed > 0

    def test_an_instant_that_a_model_does_not_compute_is_refused(self):
        def line(slope):
            t = np.linspace(0.0, 1.0, 11)
            return {"t": t, "x": slope * t, "end": slope}

        study = cc.Study(line, {"slope": cc.normal(1.0, 0.1)})
        for quantity, at in (("x", 99.0), ("x", 0.55), ("end", 0.5)):
            with refuses('specifications["a"]'):
                cc.conformance(study, {"a": cc.require(quantity, below=0.55, at=at)}, 50)
        share = cc.conformance(study, {"a": cc.require("x", below=0.55, at=0.5)}, 400)["a"]
        assert share.lower < NormalDist(1.0, 0.1).cdf(1.1) < share.upper


class TestBadInput:
    @pytest.mark.parametrize("width", [5e-324, 1e-300, 1e-9])
    def test_a_width_that_no_runs_reach_ends_with_all_of_them(self, width):
        share = cc.conformance(SHAFT, {"play": cc.require("play", above=0.08)}, 200, width=width)["play"]
        assert share.runs == 200

    @pytest.mark.parametrize(
        ("given", "name"),
        [
            ({}, "above"),
            ({"below": "three"}, "below"),
            ({"below": math.nan}, "below"),
            ({"below": 1, "at": -1}, "at"),
            ({"below": 1, "at": "90 N"}, "at"),
            ({"below": 1, "at": "middle"}, "at"),
            ({"below": 1, "joint": "axle"}, "joint"),
            ({"quantity": 3, "below": 1}, "quantity"),
        ],
    )
    def test_limits(self, given, name):
        with refuses(name):
            cc.require(**({"quantity": "play"} | given))

    @pytest.mark.parametrize(
        ("specification", "place"),
        [
            ({"a": cc.require("block.z", below=1)}, '["a"]'),
            ({"a": cc.require("block.x", below="3 N")}, '["a"].below'),
            ({"a": cc.require("block.x", above=1, below=0.5)}, '["a"]'),
            ({"a": cc.require("block.x", below=1, at=0.123)}, '["a"]'),
            ("block.x < 3", ""),
            ({"x": 3}, '["x"]'),
            ({"all": cc.require("block.x", below=1)}, '["all"]'),
        ],
    )
    def test_specifications(self, specification, place):
        with refuses(f"specifications{place}"):
            cc.conformance(TestSimulations().study(), specification, 10)

    def test_distributions_and_numbers(self):
        box = cc.Study(play, {"gap": cc.Interval(10.0, 10.2), "thread": cc.Interval(9.9, 10.0)})
        with pytest.raises(cc.errors.ArgumentError):
            cc.conformance(box, cc.require("play", above=0.0))
        with refuses("runs", "failures", "confidence"):
            cc.conformance(SHAFT, cc.require("play", above=0.0), 1, failures=0, confidence=1.0)
        with refuses("width", "inner"):
            cc.conformance(SHAFT, cc.require("play", above=0.0), 9, width=0.0, inner=-1)
        with pytest.raises(cc.errors.ArgumentError):
            cc.conformance(SHAFT, cc.require("play", above=0.0), 9, width=0.1, failures=3)
        with pytest.raises(ValueError):
            cc.conformance(SHAFT, cc.require("pley", above=0.0), 10)
