"""The answer of a report and its numbers, as a reader meets them."""

import itertools
import math
import re

import chebclear as cc
import pytest
from chebclear.base.prefixes import format_range
from chebclear.cli.bands import verdicts
from chebclear.report.document import Table
from chebclear.report.html import as_html
from chebclear.run.report import outputs_to_show, run_document
from chebclear.study.features.effects import Estimate
from chebclear.study.features.ranking import Rank, Ranking
from chebclear.study.report.document import study_document, verdict_table
from chebclear.study.report.extent import extent


def ranking(scatter, **narrowings):
    none = Estimate(0.0, 0.0, 0.0)
    rows = [Rank(name, Estimate(*one), Estimate(*one), None) for name, one in narrowings.items()]
    return Ranking("peak", tuple(rows), none, Estimate(scatter, 0.0, 1.0))


def test_the_conclusion_of_a_ranking_is_short():
    found = ranking(0.2, rod=(0.3, 0.2, 0.4), crank=(0.1, 0.05, 0.2), play=(-0.001, -0.02, 0.01)).in_short()
    assert found == (
        "Halving the interval of rod narrows it by 30 % (20 to 40), of crank by 10 % (5 to 20). "
        "Tightening play does not help. 20 % of its spread is scatter that no parameter explains."
    )
    assert ranking(0.05, rod=(0.3, -0.1, 0.4)).in_short() == "No single tolerance is certain to narrow it."
    assert ranking(0.0, rod=(0.0, 0.0, 0.0)).in_short() == "It is the same in every run."


def test_no_estimate_is_minus_zero():
    assert str(Estimate(-0.001, -0.03, 0.004)) == "0 % (-3 to 0)"
    assert str(Estimate(float("nan"), 0.0, 1.0)).startswith("nan %")


def test_a_column_is_flush_right_if_all_of_it_are_numbers():
    table = Table("c", ["a", "b", "c", "d"], [["x", "1 mm", "2", "-"], ["y", "-", "auto", "-"]])
    assert [table.in_numbers(column) for column in range(4)] == [False, True, False, False]


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


def test_the_answer_has_a_finding_for_each_subject_and_no_more_than_can_be_read(result):
    document = study_document(result, None)
    findings = [one for one in document.answer if not isinstance(one, str)]
    assert [one.subject for one in findings] == ["rms", *list(result)[:8]]
    assert document.answer[-1] == f"{len(result) - 8} more outputs are in the table below."
    text = as_html(document)
    assert "<strong>slider.x</strong> reached in the runs:" in text
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
    assert run_document(run, None, None).title == "How does slider.x move?"
    run = cc.simulate(scene, duration=1e-3, samples=5, outputs=["slider.x", "slider.vx"])
    assert run_document(run, None, None).title == "How do slider.x and slider.vx move?"


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
    useless = ranking.in_short().partition("Tightening")[2]
    assert all((row.helps is False) or f"{row.parameter}," not in useless for row in rows)


def test_two_rows_of_two_percent():
    small = Estimate(0.02, 0.0004, 0.04), Estimate(0.02, 0.0, 0.04)
    rows = [Rank("xl", Estimate(0.4, 0.3, 0.5), Estimate(0.65, 0.6, 0.7), None)]
    rows += [
        Rank(name, one, Estimate(0.02, 0.0, 0.1), None) for name, one in zip(("r", "yl"), small, strict=True)
    ]
    ranking = Ranking("f", tuple(rows), Estimate(0.0, 0.0, 0.0), Estimate(0.3, 0.2, 0.4))
    told = ranking.advice()
    assert len(told) == 3 and all(text.startswith("tightening") for text in told[1:])
    assert "Tightening r and yl does not help" in ranking.in_short()


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
        lowest, highest = extent(result, band)
        # From rod minus crank to rod plus crank of the runs.
        crank = result.parameters[:, 0].max()
        assert lowest <= 0.12 - crank + 1e-6 and highest >= 0.12 + crank - 1e-6
        assert band.upper.max() < 0.12 + crank - 1e-3, "the samples miss it"
        document = study_document(result, None)
        (found,) = (one for one in document.answer if not isinstance(one, str) and one.subject == "slider.x")
        assert f"{format_range((lowest, highest), 'm')} with its peaks between the samples" in found.text
        rows = {row["output"]: row for row in verdicts(result)}
        assert (rows["slider.x"]["lowest"], rows["slider.x"]["largest"]) == (lowest, highest)
        shown = verdict_table(result).rows[0][1]
        assert shown == format_range((lowest, highest), "m")
