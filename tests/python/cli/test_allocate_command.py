"""``chebclear allocate``: costs in a scene file, and the tolerances of least cost."""

import csv
import json

import chebclear as cc
import pytest
from chebclear import cli
from rail import block

FILE = f"""
format = 1
[parameters]
rail_length = {{ nominal = "100 mm", plus = "60 um", minus = "60 um", distribution = "normal" }}
stop = {{ nominal = "20 mm", plus = "40 um", minus = "40 um", distribution = "normal" }}
{block('"rail_length - stop"')}
[requirements]
place = {{ of = "block.x", above = "79.95 mm", below = "80.05 mm" }}

[costs]
rail_length = "1 + 2e-5 / tolerance"
stop = {{ IT6 = 9, IT8 = 5, "0.1 mm" = 2 }}

[run]
duration = 0.001
samples = 3
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "block.toml"
    path.write_text(FILE, encoding="utf-8")
    return path


def run(*words):
    return cli.main(["allocate", *map(str, words), "--quiet"])


def test_it_prints_tolerances_and_writes_a_table_and_a_picture(file, tmp_path, capsys):
    pytest.importorskip("pressfit")
    folder = tmp_path / "found"
    words = [file, "--runs", 600]
    assert run(*words, "--out", folder) == 0
    assert "place: " in capsys.readouterr().out
    names = {path.name for path in folder.iterdir()}
    assert {"allocation.txt", "allocation.csv", "allocation.png", "report.html"} <= names
    with (folder / "allocation.csv").open(encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    # 20 mm: IT8 is 33 um. Of the limits it leaves the other some 40 um, 31 of ten tolerances a decade.
    assert [row["grade"] for row in rows] == ["", "IT8"]
    report = (folder / "report.html").read_text(encoding="utf-8")
    assert "IT8" in report and report.count("<table") == 2 and report.count("<img") == 2
    assert run(*words, "--json") == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["status"] == "met" and printed["cost"] == pytest.approx(
        sum(float(row["cost after"]) for row in rows)
    )
    template = cc.load(file)
    found = cc.allocate(template.study(), template.costs, template.requirements, runs=600)
    assert found.cost == printed["cost"] and found.saving == printed["saving"]
    assert cc.loads(template.to_toml()).costs == template.costs
    assert run(file, "--plan") == 0


def test_what_is_not_proven_exits_with_3(file, capsys):
    file.write_text(FILE.replace("IT8 = 5", "IT7 = 5").replace("79.95", "79.9999"), encoding="utf-8")
    assert run(file, "--runs", 600) == 3


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ('rail_length = "1 +', 'rail = "1 +', "costs.rail"),
        ("2e-5 / tolerance", "2e-5 / size", "costs.rail_length"),
        ('"1 + 2e-5 / tolerance"', "3", "costs.rail_length"),
        ('"1 + 2e-5 / tolerance"', '"3 um"', "costs.rail_length"),
        ('"0.1 mm" = 2', '"0.1 kg" = 2', "0.1 kg"),
        ('"0.1 mm" = 2', '"0.1" = 2', "0.1"),
        ('"0.1 mm" = 2', '"0.1 mm" = "dear"', "costs.stop.0.1 mm"),
        ("[costs]", "[cost]", "block.toml:27:1"),
        ('"1 + 2e-5 / tolerance"', '"1 + tolerance"', "rail_length"),
        ("IT6 = 9", "IT6 = 1", "stop"),
        ("IT6 = 9", "IT3 = 12", "IT3"),
        ('below = "80.05 mm"', 'below = "80.05 N"', "requirements.place.below"),
    ],
)
def test_bad_costs_are_refused(file, old, new, place, capsys):
    assert old in FILE
    file.write_text(FILE.replace(old, new), encoding="utf-8")
    assert run(file, "--runs", 600) == 2
    assert place in capsys.readouterr().err


def test_what_is_missing_is_told(file, capsys):
    file.write_text(FILE.partition("[costs]")[0] + "[run]\nduration = 0.001\n", encoding="utf-8")
    with pytest.raises(SystemExit):
        run(file)
    assert "[costs]" in capsys.readouterr().err
