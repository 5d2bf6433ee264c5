"""The commands on scene files: what they print, write and return."""

import csv
import json
import os
import re
import shlex
import subprocess
import sys
import time
from pathlib import Path

import chebclear as cc
import numpy as np
import pytest
from chebclear import cli
from chebclear.cli import program, scenes
from chebclear.study.report.summary import findings

ROOT = Path(__file__).parents[3]
CRANK = str(ROOT / "examples" / "slider_crank.toml")
BRIEF = ["--duration", "1 ms", "--skip", "0", "--samples", "11"]


def answer(capsys, *words):
    """The JSON object that a command prints, and its exit code."""
    code = cli.main([*words, "--json"])
    printed = capsys.readouterr()
    assert printed.out.count("\n") == 1
    values = json.loads(printed.out)
    assert values.pop("format") == 1
    return values, code


def refused(capsys, *words):
    """What a command says that ends with exit code 2."""
    try:
        code = cli.main(list(words))
    except SystemExit as stopped:
        code = stopped.code
    assert code == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    return printed.err


def commands():
    made = program.parser()
    (choices,) = (action.choices for action in made._actions if action.dest == "command")
    return choices


@pytest.mark.parametrize("name", commands())
def test_every_command_has_an_example_that_its_parser_reads(name):
    text = commands()[name].format_help()
    (example,) = re.findall(r"example:\n  .*chebclear (\S+.*)", text)
    assert example.split()[0] == name
    for word in example.split()[1:]:
        if word.startswith("--"):
            assert word in text.split("example:")[0]


def test_check_describes_and_draws(tmp_path, capsys):
    assert cli.main(["check", CRANK, "--out", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    scene = cc.load(CRANK)()
    assert scene.describe() in printed
    assert f"chebclear study {CRANK}" in printed and "rod.C.vx" not in printed
    assert (tmp_path / "slider_crank.png").read_bytes().startswith(b"\x89PNG")
    facts, _ = answer(capsys, "check", CRANK, "--no-picture")
    assert facts["degrees_of_freedom"] == scene.check().degrees_of_freedom
    assert facts["clearance"] == {"wrist": 2e-5}
    assert facts["parameters"]["rod_length"]["interval"] == pytest.approx([0.108, 0.132])
    assert [path.name for path in tmp_path.iterdir()] == ["slider_crank.png"]
    assert cli.main(["check", CRANK, "--no-picture", "--list-outputs"]) == 0
    printed = capsys.readouterr().out
    inspection = scene.check()
    for name in inspection.columns + inspection.further_columns:
        assert re.search(rf"^  {re.escape(name)} \[.+\]$", printed, re.MULTILINE), name


def test_run_prints_what_simulate_finds(tmp_path, capsys):
    values, _ = answer(capsys, "run", CRANK, *BRIEF, "--rtol", "1e-5", "--out", str(tmp_path))
    run = cc.load(CRANK).simulate(duration=1e-3, skip=0.0, samples=11, rtol=1e-5)
    rows = {row["output"]: row for row in values["extremes"]}
    assert list(rows) == list(run.columns)
    for name, row in rows.items():
        assert (row["lowest"], row["largest"]) == (run.lowest(name).value, run.peak(name).value)
    assert values["contacts"][0]["contacts"] == len(run.contacts)
    assert cc.Trajectory.load(tmp_path / "run.npz") == run
    with (tmp_path / "extremes.csv").open(encoding="utf-8", newline="") as file:
        assert [float(row["largest"]) for row in csv.DictReader(file)] == [
            row["largest"] for row in rows.values()
        ]
    assert {"outputs.png", "report.html", "run.csv"} <= {path.name for path in tmp_path.iterdir()}


def test_study_writes_what_its_table_says(tmp_path, capsys):
    out = tmp_path / "results"
    words = ["study", CRANK, *BRIEF, "--runs", "5", "--outputs", "slider.x,slider.vx", "--out", str(out)]
    assert cli.main(words) == 0
    printed = capsys.readouterr().out
    result = cc.results.StudyResult.load(out / "study.npz")
    direct = cc.load(CRANK).study(duration=1e-3, skip=0.0, samples=11, outputs=["slider.x", "slider.vx"])
    assert result == direct.band(5)
    told = findings(result).partition("\n")[2]  # the first line has the time it took
    assert told in printed
    assert all(re.search(rf"^{name} .*{result[name].verdict}", printed, re.MULTILINE) for name in result)
    assert {path.name for path in out.iterdir()} == {
        "band_slider.vx.png",
        "band_slider.x.png",
        "report.html",
        "result.txt",
        "study.npz",
        "verdicts.csv",
        "verdicts.json",
        "verdicts.md",
    }
    with (out / "verdicts.csv").open(encoding="utf-8", newline="") as file:
        rows = {row["output"]: row for row in csv.DictReader(file)}
    assert float(rows["slider.vx"]["widest"]) == result["slider.vx"].max_width
    assert json.loads((out / "verdicts.json").read_text(encoding="utf-8"))[1]["verdict"] in printed


@pytest.mark.parametrize(
    ("words", "make"),
    [
        (["study", "--kind", "chebyshev", "--degree", "1"], lambda study: study.chebyshev(1)),
        (["study", "--kind", "sample", "--runs", "3", "--seed", "4"], lambda study: study.sample(3, rng=4)),
        (["scan", "--points", "2"], lambda study: study.scan(2)),
    ],
)
def test_every_kind_of_study(words, make, capsys):
    outputs = ["slider.x"]
    command, *rest = words
    values, _ = answer(capsys, command, CRANK, *rest, *BRIEF, "--outputs", "slider.x", "--threads", "1")
    result = make(cc.load(CRANK).study(duration=1e-3, skip=0.0, samples=11, outputs=outputs))
    assert values["kind"] == result.kind
    assert values["runs"] == len(result.parameters)
    (row,) = values["verdicts"]
    assert row["largest"] == np.max(result["slider.x"].upper)


def test_a_demand_that_is_not_met_exits_with_3(capsys):
    words = ["study", CRANK, *BRIEF, "--kind", "sample", "--runs", "2", "--outputs", "slider.x"]
    assert answer(capsys, *words)[1] == 0
    values, code = answer(capsys, *words, "--require", "estimated")
    assert (values["not_met"], code) == (["slider.x"], 3)
    met = ["study", CRANK, *BRIEF, "--runs", "9", "--outputs", "slider.x"]
    assert answer(capsys, *met, "--coverage", "0.8", "--require", "estimated")[1] == 0


def test_values_are_replaced_by_name(capsys):
    changes = [
        "--set",
        "joints.wrist.clearance=0.2 mm",
        "--set",
        "rod_length=130 mm",
        "--set",
        "rod_mass=0.2",
    ]
    facts, _ = answer(capsys, "check", CRANK, "--no-picture", *changes)
    assert facts["clearance"] == {"wrist": 2e-4}
    rod = facts["parameters"]["rod_length"]
    assert rod["nominal"] == 0.13
    assert rod["interval"] == pytest.approx([0.117, 0.143])  # the 10 % of the file
    assert facts["parameters"]["rod_mass"]["nominal"] == 0.2


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run", "missing.toml"], "missing.toml"),
        (["run", CRANK, "--set", "rod_length"], "--set"),
        (["run", CRANK, "--set", "rod_lenth=1"], '"rod_length"'),
        (["run", CRANK, "--set", "joints.wirst.clearance=1"], '"wrist"'),
        (["run", CRANK, "--set", "joints.wrist.clearance=-1 um"], "joints[2].clearance"),
        (["run", CRANK, "--set", "joints.wrist.clearance.x=1"], "joints.wrist.clearance"),
        (["run", CRANK, "--outputs", "slider.q"], '"slider.q"'),
        (["run", CRANK, "--duration", "5 kg"], "run.duration"),
        (["run", CRANK, "--out", __file__], "--out"),
        (["study", CRANK, "--kind", "sample", "--degree", "3"], "--degree"),
        (["study", CRANK, "--runs", "1"], "runs must be"),
        (["study", CRANK, "--discard", "2"], "--revolutions"),
        (["study", CRANK, "--identify", "rod_length"], "--measured"),
        (["tradeoff", CRANK, "--paper", "corrected"], "--paper"),
        (["tradeoff", CRANK, "--until", "2"], "--until"),
    ],
)
def test_what_is_wrong_is_said_before_anything_runs(words, message, capsys):
    assert message in refused(capsys, *words)


def test_a_file_without_duration_or_intervals_is_asked_for_them(tmp_path, capsys):
    path = tmp_path / "scene.json"
    path.write_text(cc.mechanisms.slider_crank().to_json(indent=1), encoding="utf-8")
    assert "--duration" in refused(capsys, "run", str(path))
    assert "[parameters]" in refused(capsys, "study", str(path), *BRIEF)
    assert answer(capsys, "run", str(path), *BRIEF, "--outputs", "slider.x")[1] == 0


def test_warnings_are_plain_lines_and_quiet_silences_them(capsys):
    # A crank of 50 m: looks like another unit.
    words = ["run", CRANK, *BRIEF, "--set", "joints.wrist.journal_radius=9.8", "--outputs", "slider.x"]
    assert cli.main(words) == 0
    told = capsys.readouterr().err
    assert told.startswith("warning: ")
    assert ".py:" not in told
    assert cli.main([*words, "--quiet"]) == 0
    quiet = capsys.readouterr()
    assert quiet.err == ""
    assert "next" not in quiet.out


def test_a_saved_result_is_reported(tmp_path, capsys):
    words = ["study", CRANK, *BRIEF, "--kind", "sample", "--runs", "2", "--outputs", "slider.x"]
    assert cli.main([*words, "--out", str(tmp_path / "results")]) == 0
    saved = tmp_path / "results" / "study.npz"
    assert cli.main(["report", str(saved), "--to", str(tmp_path / "mine.html"), "--title", "How far?"]) == 0
    assert "<h1>How far?" in (tmp_path / "mine.html").read_text(encoding="utf-8")
    capsys.readouterr()
    values, _ = answer(capsys, "report", str(saved))
    assert Path(values["file"]) == saved.with_suffix(".html")
    for name, text in (("none", None), ("other", b"no result")):
        if text is not None:
            (tmp_path / f"{name}.npz").write_bytes(text)
        assert f"{name}.npz" in refused(capsys, "report", str(tmp_path / f"{name}.npz"))


@pytest.mark.parametrize("ending", ["html", "gif"])
def test_a_run_is_animated(ending, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "slider_crank.toml").write_bytes(Path(CRANK).read_bytes())
    words = ["animate", "slider_crank.toml", *BRIEF, "--frames", "3", "--output", "crank_pin.reaction_x"]
    values, _ = answer(capsys, *words, *(["--to", "press.gif"] if ending == "gif" else []))
    assert {path.name for path in tmp_path.iterdir()} == {"slider_crank.toml", values["file"]}
    assert values["file"] == ("press.gif" if ending == "gif" else "slider_crank.html")
    assert '"wrist"' in refused(capsys, *words, "--joint", "wirst")
    assert ".gif" in refused(capsys, *words, "--to", "press.png")


def test_a_study_prints_the_features_of_its_file(capsys):
    words = ["study", CRANK, *BRIEF, "--outputs", "slider.x"]
    feature = ["--set", "features.hardest=peak(wrist.normal_force)"]
    assert cli.main([*words, *feature, "--runs", "12"]) == 0
    printed = capsys.readouterr().out
    assert "hardest: " in printed
    # Too few runs for a ranking are no reason to lose the rest.
    values, _ = answer(capsys, *words, *feature, "--kind", "sample", "--runs", "2")
    assert values["rankings"][0].startswith("hardest: ")


INTERRUPTED = """
import signal, sys, threading
signal.signal(signal.SIGINT, signal.default_int_handler)  # a child of a background job would ignore it
from chebclear import cli
from chebclear.cli.commands import study
threading.Timer(0.5, lambda: signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)).start()
sys.exit(cli.main(sys.argv[1:]))
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of a terminal")
def test_ctrl_c_is_one_line(tmp_path):
    # A minute of runs at least.
    words = ["study", CRANK, "--runs", "20000", "--outputs", "slider.x", "--out", str(tmp_path / "results")]
    command = [sys.executable, "-c", INTERRUPTED, *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=600)
    told = "chebclear: interrupted; no runs were kept, --store DIR keeps them\n"
    assert (done.returncode, done.stdout, done.stderr.splitlines()[-1:]) == (130, "", [told.rstrip()])
    assert [line.startswith("plan: 20001 runs in about") for line in done.stderr.splitlines()[:-1]] in (
        [],
        [True],
    )
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.name == "nt", reason="SIGTERM")
def test_a_study_that_was_ended_says_how_to_resume(tmp_path):
    words = ["study", CRANK, "--runs", "60", "--outputs", "slider.x", "--store", "kept runs"]
    process = subprocess.Popen(
        [sys.executable, "-m", "chebclear", *words], cwd=tmp_path, stderr=subprocess.PIPE, text=True
    )
    while len(list((tmp_path / "kept runs").glob("piece-*.npz"))) < 3 and process.poll() is None:
        time.sleep(0.005)
    process.terminate()
    _, told = process.communicate(timeout=600)
    assert process.returncode == 143
    command = f"chebclear study {CRANK} --runs 60 --outputs slider.x --store 'kept runs'"
    assert told.splitlines()[-1] == f"chebclear: ended; resume with: {command}"
    kept = set((tmp_path / "kept runs").glob("piece-*.npz"))
    program = [sys.executable, "-m", *shlex.split(told.partition("resume with: ")[2])]
    subprocess.run(program, cwd=tmp_path, check=True, capture_output=True, timeout=600)
    assert kept < set((tmp_path / "kept runs").glob("piece-*.npz"))


def test_pictures_stand_beside_the_scene_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    assert cli.main(["new", "four_bar", "sub/press.toml", "--quiet"]) == 0
    own = tmp_path / "press.png"
    own.write_bytes(b"a photograph")
    assert cli.main(["check", "sub/press.toml", "--quiet"]) == 0
    assert own.read_bytes() == b"a photograph"
    assert (tmp_path / "sub" / "press.png").read_bytes().startswith(b"\x89PNG")
    assert "sub/press.png" in capsys.readouterr().out


def test_times_of_options_may_have_units(capsys):
    words = ["study", CRANK, *BRIEF, "--outputs", "slider.x", "--runs", "20", "--quiet", "--json"]
    assert cli.main([*words, "--run-seconds", "2 min"]) == 0
    capsys.readouterr()
    assert "may be given in s, ms" in refused(capsys, *words, "--run-seconds", "2 mm")


def test_a_plan_is_printed_without_the_study(capsys):
    words = ["study", CRANK, *BRIEF, "--outputs", "slider.x", "--runs", "1000", "--plan"]
    values, _ = answer(capsys, *words)
    assert values["plan"]["runs"] == 1001 and values["plan"]["seconds"] > 0.0
    assert cli.main(words) == 0
    assert capsys.readouterr().out.startswith("1001 runs in about")


def test_what_takes_long_is_announced(capsys, monkeypatch):
    words = ["scan", CRANK, *BRIEF, "--outputs", "slider.x", "--points", "2"]
    assert answer(capsys, *words)[0]["plan"] is None
    monkeypatch.setattr(scenes, "_LONG", 0.0)
    assert cli.main(words) == 0
    assert capsys.readouterr().err.startswith("plan: ")
    values, _ = answer(capsys, *words)
    assert values["plan"]["runs"] == values["runs"] + 1 and values["status"] == "done"


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
@pytest.mark.parametrize("kind", ["band", "sample", "chebyshev"])
def test_a_study_tells_what_to_do_next_by_its_options(kind, capsys):
    words = ["--kind", kind, "--samples", "41", *(["--runs", "9"] if kind != "chebyshev" else [])]
    assert cli.main(["study", CRANK, *words]) == 0
    printed = capsys.readouterr()
    assert "next: " in printed.out + printed.err


def test_predicted_worst_cases_are_simulated_on_request(capsys):
    words = ["study", CRANK, "--runs", "21", "--samples", "41", "--outputs", "slider.x"]
    assert cli.main([*words, "--check", "--quiet"]) == 0
    assert "slider.x is highest at t = " in capsys.readouterr().out
    assert cli.main([*words, "--revolutions", "2", "--discard", "1", "--json"]) == 0
    assert cli.main(["study", CRANK, "--kind", "sample", "--runs", "5", "--samples", "5", "--check"]) == 0
    assert capsys.readouterr().err.startswith("warning: ")
