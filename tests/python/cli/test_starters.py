"""Starter files: `chebclear new` writes the ready-made mechanisms as scene files."""

import inspect
import json
import math
import random

import chebclear as cc
import pytest
from chebclear import mechanisms
from chebclear.cli import program
from chebclear.cli.commands.new import starter, starter_names

MECHANISMS = [
    name
    for name in mechanisms.__all__
    if inspect.signature(getattr(mechanisms, name)).return_annotation in ("Scene", cc.Scene)
]


def assert_same(scene, other, path=""):
    """Plain values that are equal but for rounding, and angles but for full turns."""
    if isinstance(scene, dict):
        assert scene.keys() == other.keys(), path
        for key in scene:
            assert_same(scene[key], other[key], f"{path}.{key}")
    elif isinstance(scene, list):
        assert len(scene) == len(other), path
        for index, pair in enumerate(zip(scene, other, strict=True)):
            assert_same(*pair, f"{path}[{index}]")
    elif isinstance(scene, float):
        turns = path.endswith(".angle")
        gap = math.remainder(scene - other, 2.0 * math.pi) if turns else scene - other
        # Rounding of a few operations; coordinates are of the order of 0.1.
        assert abs(gap) <= 1e-12 * max(abs(scene), 1e-3), (path, scene, other)
    else:
        assert scene == other, path


def test_every_mechanism_has_a_starter_file():
    assert starter_names() == tuple(sorted(MECHANISMS))


@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
@pytest.mark.parametrize("name", MECHANISMS)
def test_a_starter_file_is_the_mechanism(name, tmp_path, capsys):
    path = tmp_path / "mine.toml"
    assert program.main(["new", name, str(path)]) == 0
    assert f"chebclear check {path}" in capsys.readouterr().out
    template, mechanism = cc.load(path), getattr(mechanisms, name)
    assert_same(json.loads(template().to_json()), json.loads(mechanism().to_json()))
    assert "clearance" in template.intervals
    assert len(template.intervals) >= 2
    # And it changes with its parameters as the mechanism does.
    known = {*inspect.signature(mechanism).parameters, *inspect.signature(mechanisms.slider_crank).parameters}
    nominal, source = template.values(), random.Random(5)
    varied = [one for one in nominal if one in known]
    if name == "flores_slider_crank":  # there the radius of the journal follows the clearance
        varied.remove("journal_radius")
    assert len(varied) >= 8
    for _ in range(10):
        values = {one: nominal[one] * source.uniform(0.985, 1.015) for one in varied}
        if "crank_angle" in values:
            values["crank_angle"] = source.uniform(-3.0, 3.0)
        assert_same(json.loads(template(**values).to_json()), json.loads(mechanism(**values).to_json()))


@pytest.mark.parametrize("name", MECHANISMS)
def test_a_starter_file_says_what_to_run(name):
    template = cc.loads(starter(name))
    assert {"duration", "samples", "outputs"} <= set(template.run)
    run = template.simulate(duration=1e-5, skip=0.0, samples=2)
    assert run.columns == tuple(template.run["outputs"])
    assert starter(name).isascii()


def test_new_does_not_replace_a_file_unasked(tmp_path, capsys):
    path = tmp_path / "mine.toml"
    path.write_text("mine", encoding="utf-8")
    for words in (
        ["new", "four_bar", str(path)],
        ["new", "four_bar", str(tmp_path / "x.json")],
        ["new", "four_bar", str(tmp_path / "no" / "x.toml")],
        ["new", "fourbar", str(tmp_path / "x.toml")],
    ):
        with pytest.raises(SystemExit) as stopped:
            program.main(words)
        assert stopped.value.code == 2
    assert path.read_text(encoding="utf-8") == "mine"
    assert [entry.name for entry in tmp_path.iterdir()] == ["mine.toml"]
    assert program.main(["new", "four_bar", str(path), "--force", "--json"]) == 0
    assert path.read_text(encoding="utf-8") == starter("four_bar")
