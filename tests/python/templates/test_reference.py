"""The tables of the fields of scene files, against the records and against files that are read."""

import importlib.resources
import json
import re
import tomllib
from dataclasses import fields
from pathlib import Path

import chebclear as cc
import pytest
from chebclear.cli import main
from chebclear.scene.scene import Scene
from chebclear.templates.parameters import KEYS
from chebclear.templates.reference.fields import field_tables, matching, page, plain
from chebclear.templates.reference.json_schema import accepted_words, records
from chebclear.templates.run_table import UNITS
from refusals import refuses

ROOT = Path(__file__).parents[3]
TABLES = field_tables()


def table_of(part):
    key, word = part._tag or ("", "")
    found = [one for one in TABLES if one.kind == word and (key != "type" or one.section.startswith("[["))]
    if not word:
        found = [one for one in TABLES if one.section in ("[[bodies]]", "[[couplings]]")]
    # A torque is a force of that name, and so on: the fields tell which is meant.
    names = {item.name for item in fields(part)}
    [table] = [one for one in found if {row.name for row in one.rows} - {key} == names]
    return table


@pytest.mark.parametrize("part", sorted(set(records(Scene)) - {Scene}, key=lambda part: part.__name__))
def test_every_field_of_every_record_is_listed_with_unit_and_default(part):
    rows = {row.name: row for row in table_of(part).rows}
    for item in fields(part):
        row, unit = rows[item.name], item.metadata.get("unit")
        assert unit is None or f"[{unit}]" in row.value, row
        assert row.meaning, row
        required = repr(item.default).endswith("MISSING_TYPE object>") or "MISSING" in repr(item.default)
        required = required and "MISSING" in repr(item.default_factory)
        assert (row.default == "required") == required, row


def test_the_page_is_that_of_this_version():
    written = (ROOT / "docs" / "scene_fields.md").read_text(encoding="utf-8")
    assert written == page(TABLES), "run .ci/schema"


def test_tables_that_are_no_records_are_complete():
    tables = {table.section: {row.name for row in table.rows} for table in TABLES}
    assert tables["[parameters]"] == {f"NAME.{key}" for key in KEYS}
    assert tables["[run]"] == {*UNITS, "method", "outputs"}
    assert set(cc.Settings.__dataclass_fields__) - tables["[run]"] == {"features", "companion_of"}


STARTERS = importlib.resources.files("chebclear.templates") / "starters"
FILES = [*sorted((ROOT / "examples").glob("*.toml")), *STARTERS.iterdir()]


@pytest.mark.parametrize(
    "file", [file for file in FILES if file.name.endswith(".toml")], ids=lambda one: one.name
)
def test_everything_in_the_files_of_this_package_is_listed(file):
    values = tomllib.loads(file.read_text(encoding="utf-8"))
    for section in ("bodies", "joints", "forces", "drives", "start"):
        for entry in values.get(section, ()):
            found = [
                table
                for table in TABLES
                if table.section == f"[[{section}]]" and table.kind == entry.get("type", "")
            ]
            [table] = found
            assert set(entry) <= {row.name for row in table.rows}


def test_what_is_required_is_required_and_what_has_a_default_has_it():
    """Leaves out each field of a clearance joint in turn."""
    text = (ROOT / "examples" / "toggle_press.toml").read_text(encoding="utf-8")
    whole = cc.loads(text)()
    [table] = matching(TABLES, ["clearance_revolute"])
    entry = text[text.index('name = "knee"\nbearing') :].split("\n\n")[0]
    for row in table.rows[1:]:
        line = next((line for line in entry.split("\n") if line.startswith(f"{row.name} =")), None)
        if line is None:
            assert row.default != "required"
            continue
        less = text.replace(entry, entry.replace(line, "#"))
        if row.default == "required":
            with pytest.raises(cc.errors.SceneError) as caught:
                cc.loads(less)
            (problem,) = caught.value.problems
            assert problem.path.endswith(f" joints[4].{row.name}")
        else:
            assert getattr(cc.loads(less)().joints[4], row.name) is None  # friction, the only one given
    given = cc.loads(text.replace(entry, f'{entry}\nsliding = "surface"'))()
    assert given == whole


@pytest.mark.parametrize(("part", "name"), [("ClearanceRevolute", "sliding"), ("Force", "frame")])
def test_the_words_of_a_field_are_those_that_the_core_accepts(part, name):
    words = accepted_words(getattr(cc, part))[name]
    assert len(words) == 2
    template = cc.load(ROOT / "examples" / "toggle_press.toml")
    plain_scene = json.loads(template().to_json())
    push = {"type": "force", "name": "push", "point": "ram.pin", "x": 1.0, "y": 0.0}
    plain_scene["forces"].append(push)
    holder = push if part == "Force" else plain_scene["joints"][4]
    for word in words:
        holder[name] = word
        Scene.from_json(json.dumps(plain_scene)).check()
    holder[name] = "neither"
    with refuses(f"forces[4].{name}" if part == "Force" else f"joints[4].{name}"):
        Scene.from_json(json.dumps(plain_scene)).check()


def test_the_command_prints_them(capsys):
    assert main(["fields", "spring", "run"]) == 0
    shown = capsys.readouterr().out
    assert re.search(r"stiffness +number \[N/m\]; required", shown)
    assert re.search(r"duration +number \[s\]; required", shown)
    assert "torsion_spring" not in shown
    assert main(["fields"]) == 0
    assert "clearance_revolute" in capsys.readouterr().out
    assert main(["fields", "all", "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["tables"]) == len(TABLES)
    assert max(map(len, plain(TABLES).split("\n"))) <= 110
    with pytest.raises(SystemExit):
        main(["fields", "clearance_revolut"])
    assert 'did you mean "clearance_revolute"' in capsys.readouterr().err
