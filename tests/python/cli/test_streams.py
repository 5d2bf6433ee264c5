"""Output that is closed, knows few letters or belongs to a terminal; and what surrounds the program."""

import os
import subprocess
import sys

import pytest
from chebclear.cli import main

SCENE = """
title = "a \\u03bc \u03bc"
[[bodies]]
name = "bob"
mass = 1
inertia = 0.01
points.A = [0.1, 0]
[[joints]]
type = "revolute"
name = "pin\u03bc"
a = "ground"
b = "bob.A"
"""
CHECK = [sys.executable, "-m", "chebclear", "check", "scene.toml", "--quiet"]


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(SCENE, encoding="utf-8")
    return tmp_path


@pytest.mark.skipif(os.name == "nt", reason="no shell of POSIX there")
@pytest.mark.parametrize("closed", [">&-", "2>&-", ">&- 2>&-", "<&- >&- 2>&-"])
def test_closed_streams(place, closed):
    command = " ".join(CHECK) + " --no-picture " + closed
    done = subprocess.run(command, shell=True, cwd=place, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8"])
def test_letters_that_the_output_does_not_have(place, encoding):
    environment = os.environ | {"PYTHONIOENCODING": encoding}
    done = subprocess.run([*CHECK, "--no-picture"], cwd=place, capture_output=True, env=environment)
    assert done.returncode == 0, done.stderr
    assert ("pin\u03bc" if encoding == "utf-8" else r"pin\u03bc") in done.stdout.decode(encoding)


def test_any_backend_of_matplotlib(place):
    environment = os.environ | {"MPLBACKEND": "module://nowhere"}
    done = subprocess.run(CHECK, cwd=place, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    assert (place / "scene.png").exists()


@pytest.mark.parametrize(
    "text",
    [
        SCENE.replace("a \\u03bc", r"a \u001b[2J\u0007"),
        SCENE.replace("bob", r"b\u001b]0;owned\u0007ob"),
        SCENE.replace("pin", r"pin\u009b31m"),
        SCENE + '"\\u001b[1m" = 3\n',
        SCENE + "\x1b[1m = 3\n",
        'features."\\u001b[1m" = "peak(bob.x)"\n' + SCENE,
        'parameters."\\u001b[1m" = 3\n' + SCENE,
    ],
)
def test_control_characters_are_shown_and_not_obeyed(place, capsys, text):
    (place / "scene.toml").write_text(text, encoding="utf-8")
    assert main(["check", "scene.toml", "--no-picture", "--quiet"]) == 2
    printed = "".join(capsys.readouterr())
    assert "\\x" in printed or "\\u{" in printed
    assert all(letter.isprintable() or letter == "\n" for letter in printed)
