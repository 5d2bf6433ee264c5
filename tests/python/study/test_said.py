"""What the user says wins: tolerances, and nominal values that are not the middle of their intervals."""

import warnings

import chebclear as cc
import numpy as np
import pytest
from chebclear.cli.program import main

PENDULUM = """
format = 1
parameters.length = {{ nominal = "400 mm", {ends} }}
bodies = [{{ name = "bob", mass = 1, inertia = "length**2 / 12", points.A = ["-length / 2", 0] }}]
joints = [{{ type = "revolute", name = "pin", a = "ground", b = "bob.A" }}]
[run]
duration = 0.2
samples = 11
outputs = ["bob.x", "bob.y"]
{more}
"""
SIDES = {"crank_length": cc.Interval.around(0.05, rel=0.05)}
SHORT = {"duration": 1e-3, "samples": 5}


def pendulum(ends='plus = "8 mm"', more=""):
    return cc.loads(PENDULUM.format(ends=ends, more=more))


def slider_crank(**options):
    return cc.Study(cc.mechanisms.slider_crank, SIDES, ["slider.x"], **SHORT, **options)


@pytest.fixture(autouse=True)
def quiet():
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        yield


class TestTolerance:
    @pytest.mark.parametrize(
        ("said", "used"),
        [({}, 1e-4), ({"rtol": 1e-10}, 1e-10), ({"rtol": 1e-6}, 1e-6), ({"rtol": 1e-3}, 1e-3)],
    )
    def test_of_a_study_is_that_of_its_bands(self, said, used):
        assert slider_crank(**said).band(5).settings.rtol == used

    def test_of_settings_and_of_the_method(self):
        settings = cc.Settings(**SHORT, rtol=1e-8)
        study = cc.Study(cc.mechanisms.slider_crank, SIDES, ["slider.x"], settings=settings)
        assert study.band(5).settings.rtol == 1e-8
        assert study.band(5, rtol=1e-5).settings.rtol == 1e-5

    def test_of_other_methods(self):
        for said, used in (({}, 1e-6), ({"rtol": 1e-9}, 1e-9)):
            study = slider_crank(**said)
            for result in (study.scan(2), study.chebyshev(1), study.sample(3)):
                assert result.settings.rtol == used

    def test_of_a_scene_file(self):
        assert pendulum(more="rtol = 1e-9").study().band(5).settings.rtol == 1e-9
        assert pendulum(more="rtol = 1e-9").study(rtol=1e-7).band(5).settings.rtol == 1e-7
        assert pendulum().study().band(5).settings.rtol == 1e-4

    @pytest.mark.parametrize(
        ("more", "words", "used"),
        [("rtol = 1e-9", [], 1e-9), ("", [], 1e-4), ("rtol = 1e-9", ["--rtol", "1e-7"], 1e-7)],
    )
    def test_of_the_command_line(self, tmp_path, more, words, used):
        path = pendulum(more=more).save(tmp_path / "pendulum.toml")
        out = tmp_path / "out"
        assert main(["study", str(path), "--runs", "5", "--quiet", "--out", str(out), *words]) == 0
        assert cc.load_result(out / "study.npz").settings.rtol == used


class TestNominal:
    @pytest.mark.parametrize(
        ("ends", "sides"),
        [
            ('plus = "8 mm"', (0.4, 0.408)),
            ('minus = "8 mm"', (0.392, 0.4)),
            ('plus = "8 mm", minus = "2 mm"', (0.398, 0.408)),
            ('limits = ["390 mm", "430 mm"]', (0.39, 0.43)),
        ],
    )
    def test_is_what_the_file_says(self, ends, sides):
        template = pendulum(ends)
        side = template.intervals["length"]
        assert (side.lower, side.upper) == pytest.approx(sides, rel=1e-15) and side.nominal == 0.4
        assert side.midpoint == pytest.approx(sum(sides) / 2, rel=1e-15)
        own = cc.simulate(template(length=0.4), duration=0.2, samples=11, outputs=["bob.x"])
        for result in (template.study().scan(3), template.study().chebyshev(2), template.study().sample(3)):
            assert np.array_equal(result["bob.x"].nominal, own["bob.x"])
            assert result.scene == template()
        assert np.abs(template.study().band(5)["bob.x"].nominal - own["bob.x"]).max() < 1e-4

    def test_of_symmetric_tolerances_is_the_middle_to_the_bit(self):
        side = pendulum("rel = 0.02").intervals["length"]
        assert side == cc.Interval(side.lower, side.upper)

    def test_is_where_sensitivities_are_taken(self):
        # x = a² t has the slope 2 a t.
        t = np.linspace(0.0, 1.0, 5)
        study = cc.Study(lambda a: {"t": t, "x": a**2 * t}, {"a": cc.Interval(1.0, 3.0, 1.25)})
        band = study.chebyshev(2)["x"]
        assert np.array_equal(band.nominal, 1.25**2 * t)
        assert band.sensitivity("a") == pytest.approx(2.5 * t)
        # At the nominal value nothing of the width is left: there is one parameter.
        assert band.interval_share("a")[1:] == pytest.approx(1.0)

    @pytest.mark.parametrize("parameters", [2, 6])
    def test_is_where_a_parameter_is_frozen(self, parameters):
        # x = (a + sum of n b)² reaches from 1 to (3 + n)²; with a at 1.25 from 1.25² to (1.25 + n)².
        names = [f"b{k}" for k in range(parameters - 1)]
        sides = {"a": cc.Interval(1.0, 3.0, 1.25)} | dict.fromkeys(names, cc.Interval(0.0, 1.0))
        t = np.linspace(0.0, 1.0, 3)

        def model(a, **b):
            return {"t": t, "x": (a + sum(b.values())) ** 2 * (1.0 + t)}

        band = cc.Study(model, sides).band(61)["x"]  # three quarters allow the 28 terms too
        assert band.resolved
        least, most, n = 1.0, (3.0 + parameters - 1) ** 2, parameters - 1
        share = 1.0 - ((1.25 + n) ** 2 - 1.25**2) / (most - least)
        assert band.interval_share("a") == pytest.approx(share, rel=1e-4)

    def test_is_towards_which_tolerances_are_halved(self):
        # The interval of a square over [0, 2] shrinks by 3/4 towards 0, by 1/2 towards 1.
        t = np.linspace(0.0, 1.0, 3)
        for nominal, narrowing in ((0.0, 0.75), (1.0, 0.5)):
            study = cc.Study(lambda a: {"t": t, "s": a**2}, {"a": cc.Interval(0.0, 2.0, nominal)})
            (row,) = study.sample(41).ranking("s").rows
            assert row.narrowing.value == pytest.approx(narrowing, abs=0.02)

    def test_of_a_table_is_the_run_next_to_it(self):
        a = np.array([1.0, 1.2, 2.0, 3.0])
        t = np.linspace(0.0, 1.0, 3)
        study = cc.Study.from_runs(
            {"a": a}, t, {"x": a[:, None] * t}, intervals={"a": cc.Interval(1.0, 3.0, 1.25)}
        )
        assert np.array_equal(study.sample()["x"].nominal, 1.2 * t)
