"""``chebclear sweep``: a parameter of a scene file from one value to another."""

import json
from pathlib import Path

import pytest
from chebclear import cli

EXAMPLE = Path(__file__).parents[3] / "examples" / "slider_crank.toml"


@pytest.fixture
def file(tmp_path):
    text = EXAMPLE.read_text(encoding="utf-8").replace('speed = "2000 rpm"', 'speed = "crank_speed"')
    text = text.replace("[parameters]", '[parameters]\ncrank_speed = "2000 rpm"')
    path = tmp_path / "press.toml"
    path.write_text(f'{text}\n[features]\nstroke = "peak_to_peak(slider.x)"\n', encoding="utf-8")
    return path


def swept(*words):
    return cli.main(["sweep", *map(str, words), "--points", "3", "--revolutions", "8", "--discard", "1"])


def test_it_prints_and_writes_what_the_study_finds(file, tmp_path, capsys):
    assert swept(file, "crank_length", "40 mm", 0.05, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert [row["mean of stroke [m]"] for row in found["values"]] == pytest.approx(
        [0.08, 0.09, 0.1], rel=1e-3
    )
    assert swept(file, "crank_speed", "600 rpm", "900 rpm", "--out", tmp_path / "out") == 0
    assert "stroke: mean" in capsys.readouterr().out
    names = {path.name for path in (tmp_path / "out").iterdir()}
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "stroke is largest at crank_speed" in page or "stroke has a resonance" in page
    assert "Drawing of the mechanism with 3 bodies" in page
    assert names == {"report.html", "sweep.txt", "sweep.csv", "sweep.md", "sweep.json", "stroke.png"}


@pytest.mark.parametrize(
    ("words", "problem"),
    [
        (("crank_sped", "1", "2"), '"crank_speed"'),
        (("crank_speed", "1 m", "2"), "rad/s"),
        (("crank_speed", "3", "2"), "lower"),
        (("crank_speed", "1 rmp", "2"), "rmp"),
    ],
)
def test_bad_input(file, capsys, words, problem):
    try:
        code = swept(file, *words)
    except SystemExit as end:  # a usage error
        code = end.code
    assert code == 2 and problem in capsys.readouterr().err


def test_a_file_without_features_is_told_what_to_add(capsys):
    with pytest.raises(SystemExit):
        swept(EXAMPLE, "crank_length", "1", "2")
    assert "[features]" in capsys.readouterr().err
