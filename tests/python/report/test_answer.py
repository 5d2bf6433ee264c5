"""The answer of a report and its numbers, as a reader meets them."""

import itertools
import math
import re
from dataclasses import replace

import chebclear as cc
import pytest
from chebclear.base.prefixes import Form, format_range
from chebclear.cli.bands import verdicts
from chebclear.report.document import Moving, Table
from chebclear.report.html import as_html
from chebclear.run.report import outputs_to_show, run_document
from chebclear.study.features.effects import Estimate
from chebclear.study.features.ranking import Rank, Ranking
from chebclear.study.report.document import study_document
from chebclear.study.report.extent import extent


def test_a_column_is_flush_right_if_all_of_it_are_numbers():
    table = Table("c", ["a", "b", "c", "d"], [["x", "1 mm", "2", "-"], ["y", "-", "auto", "-"]])
    assert [table.in_numbers(column) for column in range(4)] == [False, True, False, False]
    # A sentence that begins with a number is none: it takes several lines.
    said = Table("c", ["a", "b"], [["x", "90 of 100 further mechanisms stay inside for the whole run"]])
    assert not said.in_numbers(1)


@pytest.fixture(scope="module")
def result():
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.Interval.around(0.05, rel=0.02), "clearance": cc.Interval.around(2e-5, rel=0.5)},
        ["slider.*", "wrist.*"],
        features={"rms": cc.features.rms("slider.ax")},
        duration=2e-3,
        samples=21,
        skip=0.03,
        units={"crank_length": "m"},
    )
    return study.sample(20)


def test_the_first_screen_has_three_sentences_a_drawing_and_the_main_numbers(result):
    document = study_document(result, None)
    movement, force, tolerance = document.answer
    band = result["slider.x"]
    assert movement.startswith(f"slider.x reached {format_range((band.lower.min(), band.upper.max()), 'm')}")
    largest = max(band.upper.max() for band in result.bands.values() if band.unit == "N")
    assert force.startswith(f"The largest force is {format_range((largest,), 'N')}, wrist.normal_force")
    first = result.features["rms"].ranking().rows[0]
    assert (f"The tolerance of {first.parameter} matters most" in tolerance) == bool(first.helps)
    drawing, table = document.first
    assert isinstance(drawing, Moving) and "mechanism" in drawing.still.finding
    assert [row[0] for row in table.rows] == ["rms", *list(result)[:11]]
    (moves,) = (one for one in document.sections if one.title == "How far the outputs move")
    assert [row[0] for row in moves.blocks[0].rows] == list(result)[11:]
    text = as_html(document)
    assert text.count('<details class="part">') == len(document.sections)
    # As they were given, in one unit a row.
    row = re.search(r'<th scope="row">crank_<wbr>length</th>(.*?)</tr>', text, re.DOTALL)
    assert row is not None
    assert re.findall(r">([^<>\n]+)</td>", row[1]) == ["49 mm", "50 mm", "51 mm", "±1 mm"]


def test_where_the_extreme_runs_are_is_told_as_a_part_of_the_interval(result):
    document = study_document(result, None)
    [table] = [
        block for section in document.sections if section.title == "Worst cases" for block in section.blocks
    ]
    band = result["slider.x"]
    run = int(band.runs.max(axis=1).argmax())
    side = result.intervals["crank_length"]
    expected = 100.0 * (band.parameters[run, 0] - side.midpoint) / side.half_width
    row = next(row for row in table.rows if row[:2] == ["slider.x", "largest"])
    assert row[4] == f"{expected:+.0f} %"
    assert abs(expected) <= 100.0


def test_a_run_of_many_outputs_shows_the_usual_ones():
    scene = cc.mechanisms.slider_crank()
    columns = scene.check().columns
    assert outputs_to_show(scene, columns)[:4] == ["slider.x", "slider.vx", "slider.ax", "wrist.normal_force"]
    assert outputs_to_show(scene, columns[:3]) == list(columns[:3])
    run = cc.simulate(scene, duration=1e-3, samples=5, outputs=["slider.x"])
    assert run_document(run, None).title == "How does slider.x move?"
    run = cc.simulate(scene, duration=1e-3, samples=5, outputs=["slider.x", "slider.vx"])
    assert run_document(run, None).title == "How do slider.x and slider.vx move?"


def test_rows_that_read_the_same_are_judged_the_same():
    """Each row has one judgment, in the advice, in the short answer, and beside every other row."""
    ends = [-0.01, 0.0, 0.001, 0.0049, 0.006, 0.02, 0.04, 0.096, 0.104, 0.3]
    rows = [
        Rank(f"p{number}", Estimate(0.5 * (low + high), low, high), Estimate(0.1, 0.0, 0.2), None)
        for number, (low, high) in enumerate(itertools.combinations(ends, 2))
    ]
    told = {}
    for row in rows:
        assert told.setdefault(str(row.narrowing).partition(" (")[2], row.helps) == row.helps
    assert set(told.values()) == {True, False, None}
    ranking = Ranking("f", tuple(rows), Estimate(0.0, 0.0, 0.0), Estimate(0.0, 0.0, 0.0))
    for row in rows:
        sentences = [text for text in ranking.advice() if row.parameter in text.split(":")[0].split()]
        word = {True: "halving", False: "tightening"}.get(row.helps)
        assert [text.split()[0] for text in sentences] == ([word] if word else [])


def test_how_far_an_output_moves_holds_the_peaks_of_its_runs_between_the_samples():
    """Four samples of a revolution miss the dead centers of a slider: crank and rod in line, closed form."""
    turn = 2.0 * math.pi / cc.mechanisms.slider_crank().drives[0].speed
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.Interval.around(0.05, rel=0.1)},
        ["slider.x"],
        features={"far": cc.features.peak("slider.x"), "near": cc.features.lowest("slider.x")},
        fixed={"clearance_at": (), "rod_length": 0.12},
        skip=0.1 * turn,
        duration=turn,
        samples=5,
    )
    for result in (study.sample(9), study.scan(3), study.band(9)):
        band = result["slider.x"]
        reach = extent(result, band)
        lowest, highest, *without = reach
        assert without == pytest.approx([0.12 - 0.05, 0.12 + 0.05], abs=1e-6), (
            "the nominal run, in closed form"
        )
        form = Form.of(reach, "m")
        # From rod minus crank to rod plus crank of the runs.
        crank = result.parameters[:, 0].max()
        assert lowest <= 0.12 - crank + 1e-6 and highest >= 0.12 + crank - 1e-6
        assert band.upper.max() < 0.12 + crank - 1e-3, "the samples miss it"
        document = study_document(result, None)
        assert form.range(lowest, highest) in document.answer[0]
        (moves,) = (one for one in document.sections if one.title == "How far the outputs move")
        drawn = float(band.lower.min()), float(band.upper.max())
        assert Form.of((lowest, highest, *drawn), "m").range(*drawn) in moves.blocks[0].caption
        rows = {row["output"]: row for row in verdicts(result)}
        assert (rows["slider.x"]["lowest"], rows["slider.x"]["largest"]) == (lowest, highest)
        *_, table = document.first
        row = next(row for row in table.rows if row[0] == "slider.x")
        assert row[2:4] == [form.text(end) for end in (lowest, highest)]


def test_the_tolerance_that_matters_is_the_one_that_makes_the_spread():
    t = [0.0, 0.5, 1.0]
    study = cc.Study(
        lambda strong, weak: {"t": t, "force": [strong + 0.01 * weak] * 3},
        {"weak": cc.Interval(0.0, 1.0), "strong": cc.Interval(2.0, 3.0)},
        units={"force": "N"},
    )
    *_, force, tolerance = study_document(study.band(81), None).answer
    assert "The largest force is 3.01 N, force; without tolerances it is 2.50 N." in force
    # Of a sum with one term a hundred times the other, both uniform: 95 % of the width, halved.
    assert tolerance.startswith("The tolerance of strong matters most: with ±0.25 instead of ±0.5, ")
    after, least, most, before = map(float, re.findall(r"(\d\.\d+) N", tolerance))
    assert before == pytest.approx(0.95, rel=0.02) and after == pytest.approx(0.475, rel=0.02)
    assert least <= after <= most
    still = cc.Study(lambda a: {"t": t, "x": [1.0, 2.0, 3.0]}, {"a": cc.Interval(0.0, 1.0)}).sample(9)
    assert study_document(still, None).answer == ["x reached 1.00 .. 3.00 over the tolerances."]


def test_a_band_that_is_thin_against_the_motion_is_drawn_as_a_deviation():
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.Interval.around(0.05, rel=1e-3)},
        ["slider.x"],
        duration=0.03,
        samples=31,
        fixed={"clearance_at": ()},
    )
    band = study.scan(3)["slider.x"]
    assert band.max_width < 0.01 * (band.nominal.max() - band.nominal.min())
    ax = band.plot(deviation=True)
    low, high = ax.get_ylim()
    assert high - low < 4.0 * band.max_width and low < 0.0 < high
    motion, shown = ax.figure.axes[1], ax.get_ylabel()
    assert shown.startswith("deviation of x position of slider")
    assert motion.lines[0].get_ydata().max() == pytest.approx(band.nominal.max())
    (moves,) = (
        one for one in study_document(study.scan(3), None).sections if one.title == "How far the outputs move"
    )
    figure_ax = cc.plots.plot_band(band).figure.add_subplot()
    moves.blocks[0].draw(ax=figure_ax)
    assert figure_ax.get_ylabel().startswith("deviation")


def test_angles_are_in_degrees_for_readers():
    assert format_range((0.1, math.pi), "rad") == "6 .. 180°"


def test_a_report_with_shares_says_first_whether_mechanisms_are_in_specification(tmp_path):
    t = [0.0, 0.5, 1.0]
    study = cc.Study(
        lambda gap, thread: {"t": t, "play": [gap - thread, 0.0, gap], "force": [1.0, 2.0, gap]},
        {"gap": cc.normal(10.1, 0.02), "thread": cc.normal(10.0, 0.02)},
        units={"force": "N", "play": "m"},
    )
    limits = {"tight": cc.require("play", below=10.12), "strong": cc.require("force", below=20.0)}
    shares = cc.conformance(study, limits, 400)
    document = study_document(replace(study.band(81), conformance=shares), None)
    verdict, share, todo, force = document.answer
    every, first = shares["all"], verdict.word
    assert every.outside > 0 and verdict.judgment == "bad"
    assert "are in specification, between" in share and "95 % confidence" in share
    assert todo.startswith("To do: gap ±") and "estimate" in todo
    assert force.startswith("The largest force is")
    table = next(one for one in document.first if isinstance(one, Table))
    assert [row[0] for row in table.rows] == ["tight", "strong", "all"]
    tight = shares["tight"]
    assert (
        f"tight fails in {tight.outside} of 400 mechanisms: play below 10.12, the worst reaches 10." in first
    )
    assert first.endswith(" beyond.")
    assert table.rows[0][3] == f"{tight.highest.max():.3f} m" and table.rows[2][3] == "-"
    fails = f"fails in {every.outside} of 400"
    assert [row[1].word for row in table.rows] == [fails, "kept", fails]
    assert [row[1].judgment for row in table.rows] == ["bad", "good", "bad"]
    assert document.sections[0].title == "In specification or not"
    path = replace(study.band(81), conformance=shares).report(tmp_path / "report")
    assert "The requirements" in path.read_text(encoding="utf-8")
    none = cc.conformance(study, {"strong": limits["strong"]}, 100)
    first = study_document(replace(study.band(81), conformance=none), None).answer[0]
    assert (
        first.word.startswith("All 100 mechanisms keep to the requirement: at least 96.")
        and first.judgment == "good"
    )
