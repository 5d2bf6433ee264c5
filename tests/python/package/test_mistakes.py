"""What a user gets wrong is said at once, by a typed error or a warning that names it."""

import dataclasses
import importlib
import math

import chebclear as cc
import numpy as np
import pytest
from chebclear import cli
from chebclear.cli import program
from chebclear.paper import case_study as paper
from chebclear.run import memory, settings
from chebclear.scene.columns import column_words
from chebclear.tradeoffs import report as tradeoff_output
from refusals import refuses

MECHANISMS = cc.mechanisms
QUIET = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

# --- scenes ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("clearance", [0.0, np.float64(0.0), -1e-5, math.nan, math.inf, {"wrist": 0.0}])
def test_a_clearance_that_is_none_is_one_problem(clearance):
    # And not a second one of the stiffness that Hertz makes of it.
    with refuses("clearance.wrist" if isinstance(clearance, dict) else "clearance"):
        MECHANISMS.slider_crank(clearance=clearance)


def test_a_clearance_larger_than_its_journal():
    with pytest.warns(cc.ChebclearWarning):
        run = cc.simulate(MECHANISMS.slider_crank(clearance=0.02), duration=1e-4, samples=3)
    (notice,) = run.notices
    assert (notice.code, notice.about) == ("large_clearance", ("joints[3].clearance",))
    study = cc.Study(
        MECHANISMS.slider_crank,
        {"clearance": cc.Interval(0.0025, 0.0035)},
        ["slider.x"],
        duration=1e-4,
        samples=3,
    )
    # 2.5, 3 and 3.5 mm, and 3 mm once more as the midpoint, beside 0.3 x 9.8 mm.
    with pytest.warns(cc.ChebclearWarning):
        (notice,) = study.scan(3).notices
    assert notice.code == "large_clearance" and notice.numbers["runs"] == 3 and notice.numbers["of_runs"] == 4
    # One warning, although the numbers are written in different ways.
    study = cc.Study(
        lambda size: MECHANISMS.slider_crank(clearance=2.0 * size, journal_radius=size),
        {"size": cc.Interval(1e-5, 1e-3)},
        ["slider.x"],
        duration=1e-9,
        samples=3,
    )
    with pytest.warns(cc.ChebclearWarning):
        (notice,) = study.scan(3).notices
    assert notice.numbers["runs"] == 4


def test_a_ball_may_be_smaller_than_its_box():
    ball = cc.Scene(
        bodies=[cc.Body("ball", mass=0.1, inertia=1e-6, points={"P": (0.0, 0.0)})],
        joints=[
            cc.ClearanceRevolute(
                "box", "ground", "ball.P", 0.005, clearance=0.05, contact=cc.laws.Hertz(stiffness=1e8)
            )
        ],
        forces=[cc.Gravity((0.0, -9.81))],
    )
    with pytest.warns(cc.ChebclearWarning):
        run = cc.simulate(ball, duration=0.05, samples=11, outputs=["ball.y"])
    np.testing.assert_allclose(run["ball.y"], -0.5 * 9.81 * run.t**2, atol=1e-12)


# --- outputs and memory ---------------------------------------------------------------------------------


def test_results_that_do_not_fit_into_the_memory(monkeypatch):
    monkeypatch.setattr(memory, "_left", lambda: iter([(16e9, "this test")]))
    study = cc.Study(
        MECHANISMS.slider_crank,
        {"rod_length": cc.Interval.around(0.12, rel=0.1)},
        ["slider.vx"],
        duration=1e-3,
        samples=settings.MOST_SAMPLES,
    )
    # 10 000 runs of 1e7 samples of 8 bytes each; one run of 1e8 such, of all outputs.
    with pytest.raises(cc.errors.MemoryLimitError):
        study.scan(9999)
    monkeypatch.setattr(memory, "_left", lambda: iter([(1e9, "this test")]))
    with pytest.raises(MemoryError):
        cc.simulate(MECHANISMS.slider_crank(), duration=1e-3, samples=settings.MOST_SAMPLES)


def test_no_column_lacks_its_unit():
    arm = cc.Body(
        "arm", mass=0.5, inertia=1e-3, center_of_mass=(0.1, 0.0), points={"A": (0.0, 0.0), "B": (0.2, 0.0)}
    )
    swing = cc.Scene(
        bodies=[arm],
        joints=[cc.Revolute("pivot", "ground", "arm.A")],
        forces=[
            cc.Spring("spring", "ground.hook", "arm.B", stiffness=80.0, length=0.1),
            cc.TorsionSpring("coil", "ground", "arm", stiffness=1.0),
        ],
        ground={"hook": (0.2, 0.25)},
    )
    for scene in (swing, MECHANISMS.quick_return(), MECHANISMS.slider_crank()):
        facts = scene.check()
        columns = facts.columns + facts.further_columns
        assert not [name for name in columns if not cc.scene.columns.column_unit(name)]
        words = [column_words(name) for name in columns]
        assert len(set(words)) == len(words) and not [text for text in words if "_" in text or "." in text]
    # Both end in "contact": an energy, and a truth value.
    assert (
        cc.scene.columns.column_unit("energy.contact"),
        cc.scene.columns.column_unit("wrist.contact"),
    ) == ("J", "-")
    run = cc.simulate(swing, duration=0.1, samples=11, outputs=["spring.force", "energy.total"])
    assert run.plot("spring.force").get_ylabel() == "force of spring [N]"
    with pytest.raises(cc.errors.ArgumentError):
        run.plot(["spring.force", "energy.total"])


def test_a_plot_shows_that_a_run_ended_early():
    run = cc.simulate(
        MECHANISMS.slider_crank(), duration=0.06, samples=61, max_steps=500, on_failure="return"
    )
    known = np.isfinite(run["slider.vx"])
    assert known[run.t <= run.end_time].all() and not known[run.t > run.end_time].any()
    for x, until, end in ((None, 0.06, run.end_time), (1e3 * run.t, 60.0, 1e3 * run.end_time)):
        ax = run.plot("slider.vx", x=x)
        assert ax.get_xlim() == (0.0, pytest.approx(until))
        (mark,) = [line for line in ax.get_lines() if "ended early: max_steps" in line.get_label()]
        assert mark.get_xdata()[0] == pytest.approx(end) and "max_steps" in str(
            [text.get_text() for text in ax.get_legend().get_texts()]
        )


def test_a_plot_over_another_column_shows_it_too():
    run = cc.simulate(
        MECHANISMS.slider_crank(), duration=0.06, samples=61, max_steps=1000, on_failure="return"
    )
    turned = run["crank.angle"]
    ax = run.plot("slider.vx", x=turned, x_label="crank angle [rad]")
    (mark,) = [line for line in ax.get_lines() if "ended early" in line.get_label()]
    last = turned[np.isfinite(turned)].max()
    assert mark.get_xdata()[0] == last and ax.get_xlim()[1] < 1.1 * last
    ax = run.plot("slider.vx", x=list(np.cos(100.0 * run.t)))  # to and fro
    assert ax.get_xlim() == pytest.approx((-1.0, 1.0), abs=0.01)


# --- files ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", [["paper"], ["tradeoff", "--rtols", "1e-3"]])
def test_a_directory_that_cannot_be_written_is_found_before_the_runs(command, tmp_path, monkeypatch, capsys):
    def never(*given, **options):
        raise AssertionError("computed in vain")

    monkeypatch.setattr(paper, "case_study", never)
    monkeypatch.setattr(importlib.import_module("chebclear.cli.commands.tradeoff"), "tradeoff", never)
    (tmp_path / "file").write_text("")
    assert cli.main([*command, "--out", str(tmp_path / "file" / "results")]) == program.EXIT_BAD_INPUT
    assert "cannot write to" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        cli.main([*command, "--out", ""])
    assert "empty name" in capsys.readouterr().err
    # What is tried leaves nothing behind.
    assert cli.main([*command, "--out", str(tmp_path / "new" / "results")]) == cli.program.EXIT_DEFECT
    assert "computed in vain" in capsys.readouterr().err
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (["--accuracy", "2"], "must be a part of the range, <= 1"),
        (["--until", "0.07"], "must be <= the duration, 0.06 s"),
    ],
)
def test_a_demand_without_meaning_is_found_before_the_runs(words, problem, monkeypatch, capsys):
    def never(*given, **options):
        raise AssertionError("computed in vain")

    monkeypatch.setattr(importlib.import_module("chebclear.cli.commands.tradeoff"), "tradeoff", never)
    with pytest.raises(SystemExit) as raised:
        cli.main(["tradeoff", *words])
    assert raised.value.code == program.EXIT_BAD_INPUT
    assert problem in capsys.readouterr().err


def test_figures_show_the_outputs_that_are_hard(tmp_path):
    result = cc.tradeoff(MECHANISMS.four_bar(), duration=5e-3, samples=101, rtols=[1e-4, 1e-6], repeats=1)
    figure = tradeoff_output.figure(result)
    named = {column_words(name): name for name in result.outputs}
    labels = [" ".join(ax.get_xlabel().split()) for ax in figure.axes]  # in one or two lines
    shown = [named[label.split(" of ", 1)[1].split(" to ")[0]] for label in labels]
    errors = {
        name: max(result.error(point, name) / scale for point in result)
        for name, scale in zip(result.outputs, result.ranges, strict=True)
        if scale > 0.0
    }
    # The crank is driven and known exactly; accelerations and forces are what a contact makes uncertain.
    assert len(shown) == 4 and min(errors[name] for name in shown) > 100.0 * errors["crank.x"]
    assert max(errors, key=errors.get) in shown
    figure.savefig(tmp_path / "figure.png")
    for ax in figure.axes:
        legend = ax.get_legend().get_window_extent()
        assert not legend.overlaps(ax.get_window_extent()), "the legend covers the points"


# --- going on with another scene ------------------------------------------------------------------------


def told(run, code):
    """What the only notice of a code is about."""
    (about,) = [notice.about for notice in run.notices if notice.code == code]
    return about


def block(gravity, speed=0.0):
    """A block in a vertical guide."""
    return cc.Scene(
        bodies=[cc.Body("block", mass=2.0, inertia=1.0)],
        joints=[cc.Prismatic("guide", "ground", "block", axis=(0.0, 1.0))],
        forces=[cc.Gravity((0.0, -gravity))],
        start=[cc.JointStart("guide", velocity=speed)],
    )


def test_another_load_acts_from_there_on():
    up = cc.simulate(block(10.0, speed=6.0), duration=0.5, samples=11)
    with pytest.warns(cc.ChebclearWarning):
        down = cc.simulate(block(2.0), duration=1.0, samples=21, start=up.end)
    since = down.t - 0.5
    height, speed = 6.0 * 0.5 - 10.0 * 0.5**2 / 2.0, 6.0 - 10.0 * 0.5
    np.testing.assert_allclose(down["block.y"], height + speed * since - since**2, atol=1e-12)
    assert told(down, "other_scene") == ("forces[0].acceleration[1]",)


def test_the_same_scene_goes_on_without_a_word(recwarn):
    run = cc.simulate(block(10.0), duration=0.5, samples=11)
    cc.simulate(
        block(10.0, speed=3.0), duration=0.5, samples=11, start=run.end
    )  # where it starts no longer matters
    assert not recwarn.list


@QUIET
def test_another_speed_would_turn_the_crank_at_once(tmp_path):
    run = cc.simulate(MECHANISMS.slider_crank(crank_speed=200.0), duration=0.01, samples=11)
    for end in (run.end, cc.Trajectory.load(run.save(tmp_path / "run")).end):
        with pytest.raises(cc.errors.StartError) as raised:
            cc.simulate(MECHANISMS.slider_crank(crank_speed=100.0), duration=0.01, samples=11, start=end)
        assert len(raised.value.problems) == 2


def test_another_speed_that_goes_on_from_there():
    run = cc.simulate(MECHANISMS.four_bar(clearance_at=(), crank_speed=50.0), duration=0.01, samples=11)
    faster = MECHANISMS.four_bar(clearance_at=(), crank_speed=80.0)
    (drive,) = faster.drives
    # 50 t until 0.01 s, from there on 80 rad/s.
    drive = dataclasses.replace(drive, angle=drive.angle + (50.0 - 80.0) * 0.01)
    with pytest.warns(cc.ChebclearWarning):
        more = cc.simulate(
            dataclasses.replace(faster, drives=[drive]), duration=0.01, samples=11, start=run.end
        )
    turned = more["crank.angle"] - run["crank.angle"][-1]
    np.testing.assert_allclose(turned, 80.0 * (more.t - 0.01), atol=1e-12)
    assert "drives.drive.speed" in told(more, "other_scene")


@QUIET
def test_a_scene_goes_on_where_the_table_of_its_drive_ends():
    def driven(motion):
        block = cc.Body("block", mass=1.0, inertia=1.0)
        guide = cc.Prismatic("guide", "ground", "block", axis=(1.0, 0.0))
        return cc.Scene([block], [guide], drives=[cc.motions.Motion("drive", "guide", motion)])

    times = np.linspace(0.0, 1.0, 6)
    run = cc.simulate(driven(cc.motions.Table(times, np.sin(times))), duration=1.0, samples=11)
    for motion in (
        cc.motions.Table(1.0 + times, np.sin(1.0 + times)),
        cc.motions.Polynomial((math.sin(1.0),)),
    ):
        more = cc.simulate(driven(motion), duration=1.0, samples=6, start=run.end)
        expected = motion.values if isinstance(motion, cc.motions.Table) else math.sin(1.0)
        np.testing.assert_allclose(more["block.x"], expected, atol=1e-12)
    with refuses("start", error=cc.errors.StartError):
        cc.simulate(driven(cc.motions.Polynomial((0.9,))), duration=1.0, samples=6, start=run.end)


@QUIET
def test_another_length_would_tear_the_mechanism_apart():
    run = cc.simulate(MECHANISMS.slider_crank(), duration=0.01, samples=11)
    with refuses("start", error=cc.errors.StartError):
        cc.simulate(MECHANISMS.slider_crank(rod_length=0.13), duration=0.01, samples=11, start=run.end)


@QUIET
def test_loops_that_would_not_close():
    def hanging(**lengths):
        bars = MECHANISMS.four_bar(clearance_at=(), **lengths)
        return dataclasses.replace(bars, drives=[], forces=[cc.Gravity((0.0, -9.81))])

    run = cc.simulate(hanging(), duration=0.01, samples=11)
    for length in ("ground_length", "rocker_length"):
        with pytest.raises(cc.errors.StartError):
            cc.simulate(hanging(**{length: 0.101}), duration=0.01, samples=11, start=run.end)
    assert cc.simulate(hanging(rocker_mass=0.3), duration=0.01, samples=11, start=run.end).success


@QUIET
def test_another_length_would_make_a_prescribed_mechanism_jump():
    ideal = {"clearance_at": ()}
    run = cc.simulate(MECHANISMS.four_bar(**ideal), duration=0.01, samples=11)
    with refuses("start", error=cc.errors.StartError):
        cc.simulate(
            MECHANISMS.four_bar(coupler_length=0.101, **ideal), duration=0.01, samples=11, start=run.end
        )
    more = cc.simulate(
        MECHANISMS.four_bar(coupler_mass=0.3, **ideal), duration=0.01, samples=11, start=run.end
    )
    assert more["rocker.angle"][0] == pytest.approx(run["rocker.angle"][-1], abs=1e-12)


def test_the_angle_of_a_pin_is_no_displacement():
    bob = cc.Body("bob", mass=1.0, inertia=0.01, points={"A": (0.0, 0.5)})
    pinned = cc.Scene([bob], [cc.Revolute("joint", "ground", "bob.A")], [cc.Gravity((1.0, -9.81))])
    guided = dataclasses.replace(pinned, joints=[cc.Prismatic("joint", "ground", "bob.A", axis=(1.0, 0.0))])
    run = cc.simulate(pinned, duration=0.5, samples=11)
    with refuses("start", error=cc.errors.StartError):
        cc.simulate(guided, duration=0.5, samples=11, start=run.end)


def test_a_worn_bearing_is_no_other_mechanism():
    run = cc.simulate(MECHANISMS.slider_crank(clearance=2e-5), duration=0.01, samples=11)
    with pytest.warns(cc.ChebclearWarning):
        worn = cc.simulate(
            MECHANISMS.slider_crank(clearance=2.1e-5), duration=1e-3, samples=11, start=run.end
        )
    assert worn["slider.x"][0] == pytest.approx(run["slider.x"][-1], abs=2e-6)
    assert "joints.wrist.clearance" in told(worn, "other_scene")


# --- the error of one run -------------------------------------------------------------------------------
