"""What commands say and choose where a file is silent: outputs, a center of mass."""

import csv
import importlib.resources
import json
from pathlib import Path

import chebclear as cc
import pytest
from chebclear.cli import main
from chebclear.scene.usual import MOST_OUTPUTS, usual_outputs

ROOT = Path(__file__).parents[3]
STARTERS = importlib.resources.files("chebclear.templates") / "starters"
BRIEF = ["--duration", "1 ms", "--skip", "0", "--samples", "5"]


def without_outputs(folder):
    """The slider-crank, with a file that names no outputs."""
    text = (STARTERS / "slider_crank.toml").read_text(encoding="utf-8")
    line = next(line for line in text.split("\n") if line.startswith("outputs"))
    path = folder / "crank.toml"
    path.write_text(text.replace(line, ""), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("slider_crank", ["slider.x", "slider.vx", "slider.ax", "wrist.normal_force", "drive.torque"]),
        (
            "four_bar",
            [
                "rocker.angle",
                "rocker.angular_velocity",
                "rocker.angular_acceleration",
                "rocker_pin.normal_force",
                "drive.torque",
            ],
        ),
        ("free_journal", ["journal.x", "journal.y", "bearing.normal_force"]),
    ],
)
def test_the_usual_outputs_are_few_and_telling(name, expected):
    scene = cc.loads((STARTERS / f"{name}.toml").read_text(encoding="utf-8"))()
    assert usual_outputs(scene) == expected


def test_of_a_press_they_are_those_of_its_ram():
    scene = cc.load(ROOT / "examples" / "toggle_press.toml")()
    assert usual_outputs(scene) == ["ram.y", "ram.vy", "ram.ay", "knee.normal_force", "wrist.normal_force"]


@pytest.mark.parametrize("file", sorted(one.name for one in STARTERS.iterdir() if one.name.endswith(".toml")))
def test_every_usual_output_exists(file):
    scene = cc.loads((STARTERS / file).read_text(encoding="utf-8"))()
    chosen = usual_outputs(scene)
    assert 0 < len(chosen) <= MOST_OUTPUTS
    assert set(chosen) <= set(scene.check().columns)


def test_a_run_without_outputs_says_which_it_took(tmp_path, capsys):
    path = without_outputs(tmp_path)
    assert main(["run", str(path), *BRIEF, "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().err
    assert (
        told.startswith("note: ")
        and "slider.x, slider.vx, slider.ax, wrist.normal_force, drive.torque" in told
    )
    rows = (tmp_path / "out" / "extremes.csv").read_text(encoding="utf-8").split("\n")
    names = [row["output"] for row in csv.DictReader(rows)]
    assert names[:5] == ["slider.x", "slider.vx", "slider.ax", "wrist.normal_force", "drive.torque"]
    # The path of the journal needs these.
    assert (tmp_path / "out" / "orbit_wrist.png").exists()


def test_a_study_without_outputs_has_a_table_for_each_of_them_only(tmp_path, capsys):
    path = without_outputs(tmp_path)
    assert main(["study", str(path), *BRIEF, "--kind", "sample", "--runs", "3", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert len(found["verdicts"]) == 5
    assert main(["study", str(path), *BRIEF, "--kind", "sample", "--runs", "3", "--outputs", "slider.*"]) == 0
    told = capsys.readouterr()
    assert "note: " not in told.err and "slider.angular_velocity" in told.out


def test_quiet_says_nothing(tmp_path, capsys):
    assert main(["run", str(without_outputs(tmp_path)), *BRIEF, "--quiet"]) == 0
    assert capsys.readouterr().err == ""


def test_a_forgotten_center_of_mass_is_told(tmp_path, capsys):
    text = (STARTERS / "slider_crank.toml").read_text(encoding="utf-8")
    path = tmp_path / "crank.toml"
    given = 'center_of_mass = ["rod_length / 2", 0]\n'
    for replaced, told in [("", True), ("center_of_mass = [0, 0]\n", False), (given, False)]:
        path.write_text(text.replace(given, replaced), encoding="utf-8")
        assert main(["check", str(path), "--no-picture"]) == 0
        out = capsys.readouterr().out
        assert ("bodies.rod: " in out) == told
        assert "bodies.slider" not in out  # all its joints are at one point
    path.write_text(text.replace(given, ""), encoding="utf-8")
    assert main(["check", str(path), "--no-picture", "--json"]) == 0
    (notice,) = json.loads(capsys.readouterr().out)["notices"]
    assert (notice["code"], notice["about"]) == ("default_center", ["bodies.rod"])
