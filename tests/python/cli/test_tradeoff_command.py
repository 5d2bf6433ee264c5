"""The command that measures accuracy against cost: what it prints, writes and refuses."""

import json
import sys

import chebclear as cc
import pytest
from chebclear import cli
from chebclear.tradeoffs import report as tradeoff_output
from pendulum import pendulum


@pytest.fixture
def scene_file(tmp_path):
    file = tmp_path / "pendulum.json"
    file.write_text(pendulum().to_json())
    return str(file)


WORDS = ["--duration", "0.5", "--samples", "51", "--outputs", "bob.angle", "--rtols", "1e-4,1e-6"]


def test_the_command_prints_and_writes(scene_file, tmp_path, capsys):
    out = tmp_path / "made" / "here"
    assert cli.main(["tradeoff", scene_file, *WORDS, "--methods", "rodas4", "--out", str(out)]) == 0
    files = ["report.html", "tradeoff.md", "tradeoff.npz", "tradeoff.png"]
    assert sorted(path.name for path in out.iterdir()) == files
    assert (out / "tradeoff.png").read_bytes().startswith(b"\x89PNG")
    result = cc.results.Tradeoff.load(out / "tradeoff.npz")
    assert [(point.method, point.rtol) for point in result] == [("rodas4", 1e-4), ("rodas4", 1e-6)]
    assert result.scene == pendulum() and result.outputs == ("bob.angle",)
    markdown = (out / "tradeoff.md").read_text(encoding="utf-8")
    assert result.table() in markdown and f"Recommended: {result.recommendation()}" in markdown
    printed = capsys.readouterr()
    assert str(result) in printed.out and str(out) in printed.out and printed.err == ""


def test_the_papers_scene_as_json(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["--paper", "corrected", "--duration", "0.001", "--methods", "dop853", "--rtols", "1e-4"]
    assert cli.main(["tradeoff", *words, "--samples", "21", "--accuracy", "0.01", "--json"]) == 0
    captured = capsys.readouterr()
    numbers = json.loads(captured.out)
    assert captured.out.count("\n") == 1 and not list(tmp_path.iterdir())
    assert numbers["runs"]["method"] == ["dop853"] and numbers["runs"]["status"] == ["done"]
    assert set(numbers["reference"]["uncertainty"]) == {
        "slider.x",
        "slider.vx",
        "slider.ax",
        "wrist.penetration",
    }
    # A horizon that is not reached is null.
    assert numbers["runs"]["horizon slider.x"] == [None]


def test_bad_arguments_of_the_command(scene_file, tmp_path, capsys):
    empty = tmp_path / "empty.json"
    empty.write_text("{")
    for words in (
        [scene_file],
        [scene_file, *WORDS, "--paper", "corrected"],
        [str(tmp_path / "none.json"), *WORDS],
        [scene_file, *WORDS, "--rtols", "1e-4,loose"],
        [scene_file, *WORDS, "--accuracy", "-1"],
        [scene_file, *WORDS, "--until", "2.0"],
        [scene_file, *WORDS, "--paper", "improved"],
    ):
        with pytest.raises(SystemExit) as stopped:
            cli.main(["tradeoff", *words])
        assert stopped.value.code == 2 and "usage: chebclear" in capsys.readouterr().err
    for words, message in (
        ([scene_file, *WORDS, "--outputs", "bob.angel"], '"bob.angle"'),
        ([scene_file, *WORDS, "--methods", "euler"], "methods"),
        ([scene_file, *WORDS, "--samples", "1"], "samples"),
        ([str(empty), *WORDS], "empty.json"),
    ):
        assert cli.main(["tradeoff", *words]) == 2
        captured = capsys.readouterr()
        assert message in captured.err and captured.out == ""


def test_a_reference_that_fails_ends_the_command(scene_file, monkeypatch, capsys):
    monkeypatch.setattr(sys.modules["chebclear.tradeoffs.of_scene"], "MAX_STEPS", 20)
    assert cli.main(["tradeoff", scene_file, *WORDS]) == 1
    captured = capsys.readouterr()
    assert captured.err.startswith("chebclear: ") and captured.out == ""


def test_many_outputs_share_one_picture():
    scene = cc.mechanisms.slider_crank()
    result = cc.tradeoff(scene, duration=0.001, samples=11, methods=["dop853"], rtols=[1e-3], repeats=1)
    assert len(tradeoff_output.figure(result).axes) == 4
