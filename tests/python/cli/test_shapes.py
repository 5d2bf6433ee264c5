"""Every command on every shape of mechanism ends well, or says what the file lacks."""

import json

import pytest
from chebclear.cli import main

BODY = """
[[bodies]]
name = "bob"
mass = {mass}
inertia = 0.01
center_of_mass = [0.1, 0]
points.A = [0, 0]
"""
PIN = '[[joints]]\ntype = "revolute"\nname = "pin"\na = "ground"\nb = "bob.A"\n'
LOOSE = """
[[joints]]
type = "clearance_revolute"
name = "pin"
bearing = "ground"
journal = "bob.A"
journal_radius = 0.01
clearance = 1e-4
contact = { law = "hertz", stiffness = 1e8 }
"""
FALL = '[[forces]]\ntype = "gravity"\nacceleration = [0, -9.81]\n'
MOTOR = '[[drives]]\ntype = "speed"\nname = "motor"\njoint = "pin"\nspeed = 10\n'
FREE = BODY.format(mass=1)
OF_MASS = 'parameters.m = { nominal = "1 kg", rel = 0.1 }\n', BODY.format(mass='"m"')
RUN = "run = { duration = 0.01, samples = 11 }\n"
ASKED = 'run = { duration = 0.01, samples = 11, outputs = ["bob.x"] }\n'
NOTHING = "run = { duration = 0.01, samples = 11, outputs = [] }\n"

# The text of the file, and whether it has an interval.
SHAPES = {
    "one body": ("joints = []\n" + RUN + FREE, False),
    "one body with a parameter": ("joints = []\n" + RUN + "".join(OF_MASS), True),
    "no contacts, no drive": (RUN + OF_MASS[0] + OF_MASS[1] + PIN + FALL, True),
    "no freedom": (ASKED + OF_MASS[0] + OF_MASS[1] + PIN + MOTOR, True),
    "no parameters": (RUN + FREE + PIN + FALL, False),
    "a constant parameter": (RUN + 'parameters.m = "1 kg"\n' + OF_MASS[1] + PIN + FALL, False),
    "no forces at all": (RUN + OF_MASS[0] + OF_MASS[1] + PIN, True),
    "a contact": (RUN + OF_MASS[0] + OF_MASS[1] + LOOSE + FALL, True),
    "a feature": (ASKED + 'features.top = "peak(bob.x)"\n' + OF_MASS[0] + OF_MASS[1] + LOOSE + FALL, True),
    "no settings": (FREE + PIN, False),
}
COMMANDS = {
    "check": ["--no-picture"],
    "run": ["--out", "out"],
    "study": ["--runs", "5", "--out", "out"],
    "scan": ["--points", "2"],
    "tradeoff": ["--out", "out"],
    "animate": ["--frames", "3"],
}


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def ended(capsys, words):
    """The exit code of a command, and what it said where it failed."""
    try:
        code = main(words)
    except SystemExit as error:
        code = error.code
    return code, capsys.readouterr().err


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("shape", SHAPES)
def test_every_command_of_every_shape(place, capsys, shape):
    text, uncertain = SHAPES[shape]
    (place / "scene.toml").write_text(text, encoding="utf-8")
    for command, more in COMMANDS.items():
        code, told = ended(capsys, [command, "scene.toml", *more, "--quiet"])
        if command in ("study", "scan") and not uncertain:
            assert code == 2 and "[parameters]" in told, (command, told)
        elif command != "check" and "run =" not in text:
            assert code == 2 and "--duration" in told, (command, told)
        else:
            assert code == 0, (command, told)
    for saved in ("run", "study"):
        path = place / "out" / f"{saved}.npz"
        if path.exists():
            code, told = ended(capsys, ["report", str(path), "--quiet"])
            assert code == 0, told


def test_without_contacts_the_tables_of_contacts_say_so(place, capsys):
    (place / "scene.toml").write_text(SHAPES["no parameters"][0], encoding="utf-8")
    assert ended(capsys, ["run", "scene.toml", "--out", "out", "--quiet"])[0] == 0
    assert json.loads((place / "out" / "contacts.json").read_text()) == []
    assert (place / "out" / "contacts.md").read_text() == "none\n"


@pytest.mark.parametrize("command", ["run", "study", "scan", "tradeoff", "animate"])
def test_an_empty_list_of_outputs_is_a_mistake_of_the_file(place, capsys, command):
    text = NOTHING + OF_MASS[0] + OF_MASS[1] + PIN
    (place / "scene.toml").write_text(text, encoding="utf-8")
    code, told = ended(capsys, [command, "scene.toml", "--quiet"])
    assert code == 2 and "outputs" in told and "scene.toml:1" in told
