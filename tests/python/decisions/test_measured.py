"""Measured traces: units, triggers and shares inside bands against straight lines; bad files, all at once."""

import json

import chebclear as cc
import numpy as np
import pytest
from chebclear import cli
from chebclear.features import BandPower, Crossings, MagnitudeQuantile
from chebclear.results import Measured
from rail import block

T = np.linspace(0.0, 1.0, 101)


@pytest.fixture(scope="module")
def band():
    """x from t to 2 t."""
    study = cc.Study(lambda a: {"t": T, "x": a * T}, {"a": cc.Interval(1.0, 2.0)}, units={"x": "mm"})
    return study.scan(3)["x"]


def written(folder, text):
    path = folder / "trace.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_straight_line_leaves_a_wedge_where_it_crosses_its_ends(band):
    # 1.5 t + 0.205 > 2 t before t = 0.41.
    t = np.linspace(-0.5, 1.2, 1701)
    found = Measured({"x": 1e-3 * (1.5 * t + 0.205)}, {"x": "m"}, t=t).compare(band)
    assert found.outside == (pytest.approx((0.0, 0.41), abs=2e-3),)
    assert found.share == pytest.approx(0.59, abs=2e-3) and found.left_out == 700
    ax = found.plot()
    assert [text.get_text() for text in ax.get_legend().get_texts()][-2:] == ["measured", "outside"]


def test_a_rising_edge_sets_the_time(band):
    t = np.linspace(3.0, 4.0, 101)
    trace = Measured({"x": 1.5 * (t - 3.2), "pulse": 5.0 * (t >= 3.2)}, t=t)
    aligned = trace.triggered("pulse", 2.5, start=0.0)
    # The edge is between the samples at 3.19 and 3.20.
    assert aligned.t[0] == pytest.approx(3.0 - 3.195)
    assert aligned.compare(band).share == pytest.approx(1.0, abs=0.03)


def test_pulses_of_each_revolution_give_the_crank_angle():
    """A crank that speeds up, seen by one pulse a turn, against the angle itself."""
    t = np.linspace(0.0, 10.0, 20_001)
    angle = 20.0 * t + 0.05 * t**2
    trace = Measured({"x": np.sin(angle), "pulse": np.where(angle % (2 * np.pi) < 1.0, 1.0, 0.0)}, t=t)
    found = trace.triggered("pulse", 0.5, start=0.0, turns=True)
    expected = np.interp(found.t, t, angle) - 2 * np.pi  # the first edge is that of the second turn
    assert np.max(np.abs(found.angle - expected)) < 0.02
    assert found.angle[-1] == pytest.approx(2 * np.pi * (np.floor(angle[-1] / (2 * np.pi)) - 1), abs=0.02)


def test_bands_by_crank_angle_hold_runs_from_any_turn():
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"rod_length": cc.Interval.around(0.12, rel=0.01)},
        ["slider.x", "rod.angle"],
        fixed={"clearance_at": ()},
        duration=0.03,
        samples=181,
    )
    bands = study.band(24, revolutions=2)
    run = cc.simulate(
        cc.mechanisms.slider_crank(clearance_at=(), rod_length=0.1195), duration=0.1, samples=1801
    )
    angle = np.asarray(run["crank.angle"])
    trace = Measured({name: run[name] for name in bands}, t=run.t, angle=angle)
    assert all(one.share > 0.999 for one in trace.compare(bands).values())
    # A slider that is 3 mm off during half a turn, out of a band of 2.4 mm.
    off = run["slider.x"] + 3e-3 * ((angle > 10.0) & (angle < 10.0 + np.pi))
    found = Measured({"slider.x": off}, angle=angle).compare(bands["slider.x"])
    assert found.outside == (pytest.approx((10.0, 10.0 + np.pi), abs=0.03),)
    ax = found.plot(unit="mm")
    assert ax.get_xlabel() == "crank angle [°]"
    line = next(one for one in ax.lines if one.get_label() == "measured")
    assert -1e-9 <= np.nanmin(line.get_xdata()) and np.nanmax(line.get_xdata()) <= 360.0 + 1e-9


def test_files_are_read_with_their_units(tmp_path):
    text = "Zeit (ms);Winkel [deg];Weg [mm];Takt (V)\n0;350;1,5;0\n1;5;1,6;5\n2;20;1,7;5\n"
    columns = {"slider.x": "Weg", "pulse": "Takt [-]"}
    trace = cc.load_measured(written(tmp_path, text), columns, t="Zeit", angle="Winkel")
    np.testing.assert_allclose(trace.t, [0.0, 1e-3, 2e-3])
    np.testing.assert_allclose(np.degrees(trace.angle), [350.0, 365.0, 380.0])
    np.testing.assert_allclose(trace["slider.x"], [1.5e-3, 1.6e-3, 1.7e-3])
    assert trace.units == {"slider.x": "m", "pulse": "-"}
    # What a run writes is read back.
    run = cc.simulate(cc.mechanisms.slider_crank(), duration=1e-3, samples=11, outputs=["slider.ax"])
    again = cc.load_measured(run.to_csv(tmp_path / "run.csv"))
    assert np.array_equal(again["slider.ax"], run["slider.ax"]) and np.array_equal(again.t, run.t)


def test_what_is_wrong_with_a_file_is_told_at_once(tmp_path):
    text = "time [s],slider.x [N],slider.vx,slider.ax [m/s2]\n0,1,2,3\n1,1,2,nothing\n"
    path = written(tmp_path, text)
    with pytest.raises(cc.ChebclearError) as caught:
        cc.load_measured(
            path, {"rod.x": "rod"} | {f"slider.{one}": f"slider.{one}" for one in ("x", "vx", "ax")}
        )
    assert len(caught.value.problems) == 5
    for columns in ({"slider.x": "slider.ax"}, {"slider.ax": "slider.ax [mm/s2]"}, {"a": "slider.vx [m/z]"}):
        with pytest.raises(cc.errors.ArgumentError):
            cc.load_measured(written(tmp_path, text.replace("nothing", "1")), columns, t="time")
    with pytest.raises(cc.errors.ArgumentTypeError):
        cc.load_measured(path, {"slider.x": 3}, t="time")
    for bad in ("", "t [s]\n", "t [s],x [m]\n0,1\n1\n", "t [s],x [m],x [m]\n0,1,1\n1,1,1\n"):
        with pytest.raises(cc.errors.ArgumentError):
            cc.load_measured(written(tmp_path, bad))


def test_traces_that_fit_no_band_are_refused(band):
    for trace in (
        Measured({"x": T}, {"x": "N"}, t=T),  # another dimension
        Measured({"x": T}, t=T + 2.0),  # no overlap
        Measured({"y": T}, t=T),  # another output
        Measured({"x": T}, angle=T),  # no time
    ):
        with pytest.raises(cc.errors.ArgumentError):
            trace.compare(band)
    with pytest.raises(cc.errors.ArgumentError) as caught:
        Measured({"x": T[1:], "y": np.where(T > 0.5, np.nan, T)}, t=T[::-1])
    assert len(caught.value.problems) == 2  # one is not finite, one too short
    for wrong in ({"t": T[::-1]}, {"angle": 2.0 * np.arange(101.0)}, {}):
        with pytest.raises(cc.errors.ArgumentError):
            Measured({"x": T}, **wrong)
    flat = Measured({"x": T}, t=T)
    for bad in (2.0, "3 N m m"):
        with pytest.raises(cc.errors.ArgumentError):
            flat.triggered("x", bad)
    with pytest.raises(cc.errors.ArgumentError):
        flat.triggered("x", 0.5, turns=True)  # a single edge
    pulses = 1.0 * (np.arange(101) % 20 < 5)
    pulses[33] = 1.0  # between two of them
    with pytest.raises(cc.errors.ArgumentError):
        Measured({"x": pulses}, t=T).triggered("x", 0.5, turns=True)
    with pytest.raises(KeyError):
        flat.triggered("puls", 0.5)


def test_features_of_samples_have_their_closed_forms():
    t = np.linspace(0.0, 2.0, 4001)
    run = {"t": t, "x": 3.0 * np.sin(2 * np.pi * 30.0 * t) + 2.0 * np.cos(2 * np.pi * 200.0 * t) + 7.0}
    assert BandPower("x", 20.0, 40.0)(run) == pytest.approx(4.5, rel=1e-3)
    assert BandPower("x", 150.0, 250.0)(run) == pytest.approx(2.0, rel=1e-3)
    assert BandPower("x", 60.0, 120.0)(run) < 1e-4
    sine = {"t": t, "x": 5.0 * np.sin(2 * np.pi * t + 0.1)}
    assert MagnitudeQuantile("x", 2.0 / 3.0)(sine) == pytest.approx(5.0 * np.sin(np.pi / 3.0), rel=1e-2)
    assert Crossings("x", 4.0, 0.0)(sine) == 2.0
    for lower, upper in ((100.0, 1001.0), (10.0, 10.1), (30.0, 20.0)):
        with pytest.raises(cc.errors.ArgumentError):
            BandPower("x", lower, upper)(run)
    with pytest.raises(cc.errors.ArgumentError):
        MagnitudeQuantile("x", 1.5)(run)
    with pytest.raises(cc.errors.ArgumentTypeError):
        Crossings(3, "high")
    # A study takes them of scenes as of models.
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"clearance": cc.Interval(1e-5, 2e-5)},
        ["slider.ax"],
        features={"peaks": MagnitudeQuantile("slider.ax", 0.9)},
        duration=3e-3,
        samples=31,
    )
    sampled = study.sample(3)
    expected = np.quantile(np.abs(sampled.values("slider.ax")), 0.9, axis=1)
    np.testing.assert_allclose(sampled.features["peaks"].values[:, 0], expected)


def test_the_command_compares_and_identifies(tmp_path, capsys):
    file = tmp_path / "block.toml"
    tail = """
[run]
duration = 1
samples = 101
outputs = ["block.x", "block.vx"]
[features]
speed = "mean(block.x)"
"""
    head = "format = 1\n[parameters]\nstiffness = { limits = [80, 120] }\n"
    file.write_text(head + block("0.1", pulled=True) + tail, encoding="utf-8")
    x = 100.0 * np.cos(np.sqrt(95.0) * T)
    lines = [f"{1e3 * t!r},{float(one)!r}" for t, one in zip(T.tolist(), x, strict=True)]
    path = written(tmp_path, "\n".join(["t [ms],block.x [mm]", *lines]))
    command = ["study", str(file), "--runs", "24", "--measured", str(path), "--identify", "stiffness"]
    assert cli.main([*command, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["measured"][0]["output"] == "block.x" and told["measured"][0]["inside"] == 1.0
    low, high = told["identified"]["ranges"]["stiffness"]
    assert told["identified"]["status"] == "identified"
    assert low - 1e-4 < 95.0 < high + 1e-4 and high - low < 0.1
    assert cli.main([*command, "--quiet", "--out", str(tmp_path / "out")]) == 0
    assert "What was measured" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert {"measured.csv", "measured_block.x.png", "identified.png"} <= {
        one.name for one in (tmp_path / "out").iterdir()
    }
    for wrong in (["--identify", "stiffness"], ["--measured", str(tmp_path / "none.csv")]):
        with pytest.raises(SystemExit):
            cli.main(["study", str(file), *wrong])
    written(tmp_path, "t [ms],block.x\n0,1\n1,2\n")
    assert cli.main(command) != 0
