"""The command line: what it prints, writes and returns."""

import json
import os
import pathlib
import subprocess
import sys

import pytest
from chebclear import cli
from chebclear.cli import program
from chebclear.errors import ArgumentError, MissingProgramError, SceneError, SimulationError
from chebclear.paper import case_study as paper


@pytest.fixture(scope="module")
def study():
    return paper.case_study()


@pytest.fixture
def computed(study, monkeypatch):
    """The command with its computations done already; the list collects what it asked for."""
    asked = []

    def case_study(**options):
        asked.append(options)
        return study

    monkeypatch.setattr(paper, "case_study", case_study)
    return asked


def raising(error):
    def case_study(**options):
        raise error

    return case_study


@pytest.mark.parametrize(
    "words", [["--help"], ["tradeoff", "--duration", "1e-4", "--methods", "rodas4", "--rtols", "1e-3,1e-4"]]
)
def test_nobody_reads_the_answer(words, tmp_path):
    # As in "chebclear ... | head -1".
    command = [sys.executable, "-m", "chebclear", *words]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    with subprocess.Popen(
        command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        process.stdout.close()
        assert process.stderr.read() == b""
    assert process.returncode == program.EXIT_UNREAD


def test_json_of_the_real_command(tmp_path):
    command = [sys.executable, "-m", "chebclear", "paper", "--json"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=600, check=True)
    numbers = json.loads(done.stdout)
    assert done.stdout.count("\n") == 1 and done.stderr == "" and not list(tmp_path.iterdir())
    assert set(numbers) == {"format", "as_printed", "corrected", "runs", "seconds"}
    for name in ("as_printed", "corrected"):
        assert set(numbers[name]) == {"table3", "velocity_width", "table4", "table5"}
        assert set(numbers[name]["table3"]) == {"slider.x", "slider.vx", "slider.ax", "wrist.penetration"}
        assert set(numbers[name]["table4"]) == {"0.01", "0.02"}
    assert isinstance(numbers["runs"], int)


def test_files_are_replaced_and_others_left(computed, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "paper_results"
    out.mkdir()
    for name in ("notes.txt", "tables.md"):
        (out / name).write_text("mine")
    assert cli.main(["paper"]) == 0
    assert (out / "notes.txt").read_text() == "mine"
    assert (out / "tables.md").read_text(encoding="utf-8") in capsys.readouterr().out
    assert {path.name for path in tmp_path.rglob("*")} == {"paper_results", "notes.txt", "tables.md"}
    assert cli.main(["paper", "--out", str(tmp_path / "made" / "here"), "--json"]) == 0
    json.loads(capsys.readouterr().out)
    assert [path.name for path in (tmp_path / "made").rglob("*")] == ["here", "tables.md"]


def test_nothing_half_written_is_left(computed, tmp_path, monkeypatch, capsys):
    def full_disk(*arguments, **options):
        raise OSError("no space left on device")

    monkeypatch.setattr(pathlib.Path, "write_text", full_disk)
    assert cli.main(["paper", "--out", str(tmp_path / "results")]) == 1
    assert "no space left" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
    assert cli.main(["paper", "--out", str(tmp_path)]) == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["nonsense"],
        ["paper", "--threads", "0"],
        ["paper", "--threads", "two"],
        ["paper", "--threads", "1025"],
        ["paper", "--threads", "9" * 40],
        ["paper", "--rtol", "nan"],
        ["paper", "--rtol", "tight"],
        ["paper", "--out", __file__],
    ],
)
def test_bad_arguments_exit_with_2(words, capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.main(words)
    assert stopped.value.code == 2
    assert "usage: chebclear" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["1e-13", "0.1"])
def test_every_tolerance_of_a_simulation_is_accepted(computed, text):
    assert cli.main(["paper", "--json", "--threads", "1024", "--rtol", text]) == 0
    assert computed == [{"rtol": float(text), "threads": 1024, "progress": None}]


def test_an_interrupt_during_an_import_is_answered():
    code = """
import sys
from chebclear import cli
from chebclear.cli import program
class Interrupt:
    def find_spec(self, name, *rest):
        if name == "chebclear.paper.case_study":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Interrupt())
sys.exit(cli.main(["paper", "--json"]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=600)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "chebclear: interrupted\n")


def test_version(capsys):
    with pytest.raises(SystemExit) as stopped:
        cli.main(["--version"])
    assert stopped.value.code == 0
    assert capsys.readouterr().out.startswith("chebclear ")


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (
            SceneError([("joints[0].clearance", "must be > 0 m"), ("bodies[1].mass", "must be > 0 kg")]),
            2,
            "bodies[1].mass",
        ),
        (ArgumentError("rtol must be larger"), 2, "chebclear: rtol must be larger\n"),
        (SimulationError("max_steps", 0.01, message="too many steps"), 1, "max_steps"),
        (MissingProgramError("needs ffmpeg"), 1, "chebclear: needs ffmpeg\n"),
        (MemoryError(), 1, "chebclear: there is not enough memory\n"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
)
def test_failures(error, code, message, monkeypatch, capsys):
    monkeypatch.setattr(paper, "case_study", raising(error))
    assert cli.main(["paper", "--json"]) == code
    captured = capsys.readouterr()
    assert captured.out == ""
    assert message in captured.err and "Traceback" not in captured.err


@pytest.mark.parametrize("error", [ValueError("shapes differ"), TypeError("no float"), KeyError("knee")])
def test_a_defect_is_not_told_as_wrong_arguments(error, monkeypatch, capsys):
    monkeypatch.setattr(paper, "case_study", raising(error))
    assert cli.main(["paper", "--json"]) == program.EXIT_DEFECT == 70
    told = capsys.readouterr().err
    assert "Traceback" in told and f"{type(error).__name__}: " in told
