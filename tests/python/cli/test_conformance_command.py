"""``chebclear conformance``: shares in specification of a scene file."""

import csv
import json
import re

import chebclear as cc
import pytest
from chebclear import cli
from rail import block

FILE = f"""
format = 1
title = "A block on a spring"
[parameters]
length = {{ nominal = "100 mm", plus = "6 mm", minus = "6 mm", distribution = "normal" }}
stiffness = {{ limits = [90, 110], distribution = "uniform" }}
mass = {{ nominal = 1, rel = 0.01 }}
{block('"length"', '"mass"', pulled=True)}
[features]
speed = "peak(block.vx)"

[requirements]
reach = {{ of = "block.x", above = "-103 mm" }}
fast = {{ of = "speed", below = "1.08 m/s" }}

[run]
duration = 1
samples = 11
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "block.toml"
    path.write_text(FILE, encoding="utf-8")
    return path


def run(*words):
    return cli.main(["conformance", *map(str, words)])


def test_it_prints_the_shares_and_writes_a_table_and_pictures(file, tmp_path, capsys):
    assert run(file, "--runs", 60, "--quiet", "--out", tmp_path / "found") == 0
    printed = capsys.readouterr().out
    shares = [
        line.partition(":")[0] for line in printed.splitlines() if "% in specification, between" in line
    ]
    assert shares == ["reach", "fast", "all"]
    # What fails, or that nothing does, comes first.
    assert printed[0] in "✓✗"
    names = {path.name for path in (tmp_path / "found").iterdir()}
    page = (tmp_path / "found" / "report.html").read_text(encoding="utf-8")
    assert "A block on a spring" in page and 'id="answer"' in page and page.count("<img") >= 3
    assert {
        "report.html",
        "conformance.txt",
        "conformance.csv",
        "conformance.md",
        "reach.png",
        "fast.png",
    } <= names
    with (tmp_path / "found" / "conformance.csv").open(encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    assert [row["requirement"] for row in rows] == ["reach", "fast", "all"]
    assert float(rows[0]["at least"]) <= float(rows[0]["share"]) <= float(rows[0]["at most"])


def test_the_exit_code_says_whether_the_least_share_is_reached(file, capsys):
    near = file.with_name("near.toml")
    near.write_text(FILE.replace("-103 mm", "-100 mm"), encoding="utf-8")
    assert run(near, "--runs", 40, "--quiet", "--least", 0.9) == 3
    capsys.readouterr()
    assert run(file, "--runs", 40, "--quiet", "--json", "--least", 0.2) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["format"] == 1 and printed["not_met"] == [] and len(printed["shares"]) == 3


def test_a_study_of_distributions_needs_no_requirements(file, capsys):
    """Nor do sweeps and scans; only shares ask what is required."""
    text = file.read_text(encoding="utf-8")
    file.write_text(re.sub(r"\[requirements\].*?\n\n", "", text, flags=re.DOTALL), encoding="utf-8")
    for command in (["study", file, "--runs", 20], ["scan", file, "--points", 2]):
        assert cli.main([*map(str, command), "--quiet", "--json"]) == 0
        answer = json.loads(capsys.readouterr().out)
        assert "block.x" in str(answer) and not answer.get("conformance")


def test_a_plan_counts_all_runs(file, capsys):
    def planned(*words):
        assert cli.main([*map(str, words), "--plan", "--json"]) == 0
        return json.loads(capsys.readouterr().out)["plan"]["runs"]

    # A band of 40 runs and its nominal one; of what is drawn at least 100, at the nominal mass and both ends.
    assert planned("study", file, "--runs", 40) == 41 + 3 * 100
    # Each pair is two runs.
    assert planned("contrast", file, file, "--runs", 40) == 81


def test_a_plan_makes_no_more_runs_than_it_needs(file, capsys):
    assert run(file, "--runs", 40, "--plan", "--json") == 0
    # The nominal mass and both ends, and the nominal run.
    assert json.loads(capsys.readouterr().out)["plan"]["runs"] == 121


def test_a_study_of_a_file_with_requirements_answers_them_first(file, tmp_path, capsys):
    folder = tmp_path / "found"
    assert cli.main(["study", str(file), "--runs", "41", "--quiet", "--out", str(folder)]) == 0
    printed = capsys.readouterr().out
    # Which fails, by how much and what to do; then each requirement.
    lines = printed.splitlines()
    assert re.match(r"✗ \w+ fails in \d+ of 100 mechanisms: .* beyond", lines[0])
    assert lines[2].startswith(("To do: ", "No tolerance helps", "reach: "))
    shares = [line.partition(":")[0] for line in lines if "% in specification, between" in line]
    assert shares == ["reach", "fast", "all"]
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.index("The requirements") < page.index("The main numbers")
    assert (folder / "result.txt").read_text(encoding="utf-8").startswith("✗ ")
    assert cli.main(["study", str(file), "--runs", "41", "--quiet", "--json"]) == 0
    shares = json.loads(capsys.readouterr().out)["shares"]
    assert [row["requirement"] for row in shares] == ["reach", "fast", "all"]
    # As the command for shares alone finds them, with as many runs.
    assert run(file, "--runs", 100, "--quiet", "--json") == 0
    assert json.loads(capsys.readouterr().out)["shares"] == shares


def test_requirements_without_distributions_are_a_note(file, capsys):
    text = FILE.replace(', distribution = "normal"', "").replace(', distribution = "uniform"', "")
    file.write_text(text, encoding="utf-8")
    assert cli.main(["study", str(file), "--runs", "21"]) == 0
    printed = capsys.readouterr()
    assert printed.err.startswith("note: ") and not printed.out.startswith(("✓", "✗"))


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("[requirements]", "[others]", "others"),
        ('of = "block.x"', 'of = "block.z"', "requirements.reach.of"),
        ('above = "-103 mm"', 'above = "-103 N"', "requirements.reach.above"),
        ('above = "-103 mm"', 'more = "-103 mm"', "requirements.reach.more"),
        ('above = "-103 mm"', 'above = "-103 mm", joint = "rail"', "requirements.reach.joint"),
        (', above = "-103 mm"', "", "requirements.reach.above"),
        ('distribution = "normal"', 'distribution = "gauss"', "parameters.length.distribution"),
        ('plus = "6 mm", ', 'plus = "5 mm", ', "parameters.length.distribution"),
        ("limits = [90, 110], ", "nominal = 100, ", "parameters.stiffness.distribution"),
        (
            '[90, 110], distribution = "uniform"',
            '[-9, 9], distribution = "lognormal"',
            "stiffness.distribution",
        ),
    ],
)
def test_bad_files_are_refused_with_line_and_field(file, old, new, place, capsys):
    assert old in FILE
    file.write_text(FILE.replace(old, new), encoding="utf-8")
    assert run(file, "--runs", 5, "--quiet") == 2
    assert re.search(rf"block.toml:\d+:\d+: (\w+\.)?{place}: ", capsys.readouterr().err)


def test_the_interval_says_the_distribution(file):
    text = FILE.replace(
        'minus = "6 mm", distribution = "normal"', 'minus = "2 mm", distribution = "triangular"'
    )
    file.write_text(text.replace('distribution = "uniform"', 'distribution = "lognormal"'), encoding="utf-8")
    parameters = cc.load(file).parameters
    length, stiffness = parameters["length"].distribution, parameters["stiffness"].distribution
    assert (length.lower, length.mode, length.upper) == pytest.approx((0.098, 0.1, 0.106))
    ends = stiffness.interval
    assert (ends.lower, ends.upper) == pytest.approx((90.0, 110.0)) and ends.nominal == pytest.approx(
        9900.0**0.5
    )
    assert run(file, "--runs", 20, "--quiet") == 0


def test_what_is_missing_is_told(file, capsys):
    bare = FILE.partition("[requirements]")[0] + "[run]\nduration = 1\n"
    file.write_text(bare, encoding="utf-8")
    with pytest.raises(SystemExit):
        run(file)
    assert "[requirements]" in capsys.readouterr().err
    file.write_text(FILE.replace(', distribution = "normal"', "").replace(', distribution = "uniform"', ""))
    assert run(file, "--quiet") == 2


def test_two_files_are_contrasted(file, tmp_path, capsys):
    second = tmp_path / "stiffer.toml"
    second.write_text(FILE.replace("limits = [90, 110]", "limits = [95, 115]"), encoding="utf-8")
    folder = tmp_path / "found"
    words = ["contrast", str(file), str(second), "--runs", "30", "--quiet", "--out", str(folder)]
    assert cli.main(words) == 0
    printed = capsys.readouterr().out
    assert printed.startswith("reach:")
    names = {path.name for path in folder.iterdir()}
    assert {"contrast.txt", "features.csv", "requirements.csv", "speed.png", "report.html"} <= names
    report = (folder / "report.html").read_text(encoding="utf-8")
    assert report.count("<table") == 2 and "stiffness" in report
    assert cli.main([*words[:-2], "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    # The same blocks on stiffer springs are faster, each of them.
    (speed,) = found["features"]
    assert speed["feature"] == "speed" and speed["smaller in"] == 0.0 and speed["at least"] > 0.0
    assert [row["requirement"] for row in found["shares"]] == ["reach", "fast"]
    assert cli.main([*words[:-2], "--plan"]) == 0


def test_rare_shares_are_answered(file, capsys):
    text = FILE.replace('above = "-103 mm"', 'below = "104.6 mm"').replace("fast = {", "# fast = {")
    file.write_text(
        text.replace("mass = { nominal = 1, rel = 0.01 }", "mass = 1").replace(
            "duration = 1", "duration = 0.01"
        ),
        encoding="utf-8",
    )
    # So many runs prove nothing of the kind: it is refused before them.
    with pytest.raises(SystemExit):
        run(file, "--runs", 1000, "--least", 0.999999)
    assert "3688878" in (told := capsys.readouterr().err) and "--rare" in told
    # 2.3 standard deviations, for which 40 plain runs are too few; each run starts at the length, which is
    # its largest position.
    assert run(file, "--runs", 40, "--quiet", "--json", "--rare", "--least", 0.97) == 0
    (row,) = json.loads(capsys.readouterr().out)["rare"]
    assert row["verdict"] == "known" and row["at least"] < 0.010724 < row["at most"]
    assert "length is 2" in row["causes"] and "too large" in row["causes"]
