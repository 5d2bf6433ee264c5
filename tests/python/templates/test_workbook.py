"""Excel workbooks: tolerances and requirements of a scene file from and to the sheets of one."""

import importlib
import re
import zipfile
from datetime import date
from pathlib import Path

import chebclear as cc
import openpyxl
import pytest
from chebclear import cli
from chebclear.templates.toml_text import inline
from chebclear.templates.workbook_rows import (
    MEASURED,
    parameter,
    parameter_cells,
    requirement,
    requirement_cells,
)
from openpyxl.styles import Font
from rail import block
from refusals import refuses

ROOT = Path(__file__).parents[3]
FILE = f"""
format = 1
title = "A block on a rail"

[parameters]
rail = {{ nominal = "100 mm", plus = "60 um", minus = "0.06 mm", distribution = "normal", note = "=ground" }}
stop = {{ limits = ["19.95 mm", 0.02005], distribution = "uniform" }}
third = {{ nominal = 0.30000000000000004, unit = "mm", rel = 1e-3 }}
angle = {{ nominal = "12.5 deg", plus = 0.001, note = "[rad] or {{deg}}" }}
mass = "0.12345678901234567890 kg"
half = {{ nominal = "rail / 2", unit = "mm" }}
turns = "2000 rpm"
{block('"rail - stop"')}
[requirements]
place = {{ of = "block.x", above = "79.95 mm", below = 0.08005 }}
start = {{ of = "block.x", below = 0.1, at = "1 ms" }}

[run]
duration = 0.001
samples = 3
"""


@pytest.fixture
def template():
    return cc.loads(FILE)


@pytest.fixture
def book(template, tmp_path):
    return template.to_workbook(tmp_path / "book")


def changed(book, cells):
    """The workbook with other values of cells, as ``{"parameters!B2": 3.0}``."""
    work = openpyxl.load_workbook(book)
    for place, value in cells.items():
        title, cell = place.split("!")
        work[title][cell] = value
    work.save(book)
    return book


def problems(book, cells=None):
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(FILE, workbook=changed(book, cells or {}))
    return {one.path: one.message for one in caught.value.problems}


def sheet(book, title):
    return [list(row) for row in openpyxl.load_workbook(book)[title].iter_rows(values_only=True)]


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.toml")), ids=lambda path: path.stem)
def test_every_example_goes_through_a_workbook(path, tmp_path):
    there = cc.load(path)
    back = cc.load(path, workbook=there.to_workbook(tmp_path / "book.xlsx"))
    assert back == there and back.to_toml() == there.to_toml()
    assert back.parameters == there.parameters and back.requirements == there.requirements


def test_every_word_of_the_file_stays(template, book):
    assert book.suffix == ".xlsx"
    back = cc.loads(FILE, workbook=book)
    assert back == template and back.source == template.source
    # Numbers are numbers in the unit of their line; what has another unit is written as in the file.
    head, rail, stop, third, angle, mass, half, turns = sheet(book, "parameters")
    assert head[:6] == ["name", "nominal", "plus", "minus", "unit", "distribution"]
    assert rail[:6] == ["rail", 100, "60 um", 0.06, "mm", "normal"]
    assert stop[head.index("lower")] == 19.95 and stop[head.index("upper")] == 20.05
    assert third[1] == "0.30000000000000004 m" and third[4] == "mm"
    assert angle[1] == 12.5 and half[1] == "rail / 2" and turns[1] == 2000
    assert mass[1] == "0.12345678901234567890 kg"
    assert sheet(book, "requirements")[1][:6] == ["place", "block.x", 79.95, 80.05, None, "mm"]


def test_a_workbook_carries_every_bit_to_a_file_that_says_other_things(template, book):
    other = (
        FILE.replace("100 mm", "7 mm").replace("0.30000000000000004", "0.2").replace("0.1234567890", "0.5")
    )
    other = other.replace("19.95 mm", "19 mm").replace("79.95 mm", "70 mm").replace("12.5 deg", "1 deg")
    other = other.replace("1e-3", "2e-3").replace('"1 ms"', "0.0005")
    assert cc.loads(other) != template
    back = cc.loads(other, workbook=book)
    assert back.parameters == template.parameters and back.values() == template.values()
    assert {name: one.unit for name, one in back.intervals.items()} == {
        name: one.unit for name, one in template.intervals.items()
    }
    limits = [(one.above, one.below, one.at) for one in back.requirements.values()]
    assert limits == [("79.95 mm", 0.08005, None), (None, 0.1, 0.001)]
    assert cc.loads(back.to_toml()) == back


def test_numbers_that_a_spreadsheet_would_round_are_texts(tmp_path):
    text = FILE.replace('"100 mm"', '"100.00000000000001 mm"').replace("1e-3", "0.30000000000000004")
    book = cc.loads(text).to_workbook(tmp_path / "book.xlsx")
    assert sheet(book, "parameters")[1][1] == "100.00000000000001 mm"
    assert sheet(book, "parameters")[3][6] == "0.30000000000000004"
    assert cc.loads(text, workbook=book) == cc.loads(text)
    # Through a program that saves what it has read, too.
    other = cc.loads(FILE.replace("100 mm", "101 mm"), workbook=changed(book, {"parameters!K4": "x"}))
    assert other.intervals["rail"] == cc.loads(text).intervals["rail"]
    assert other.intervals["third"] == cc.loads(text).intervals["third"]


@pytest.mark.parametrize(
    "held",
    [
        {"nominal": 0.1 + 0.2, "unit": "mm", "plus": "3 um"},
        {"nominal": 1e-3 / 3, "unit": "deg", "plus": 1 / 3},
        {"nominal": "1/3", "unit": "mm", "minus": 1e-5},
        {"nominal": "0.5", "unit": "mm"},
        {"nominal": 2000 / 7, "unit": "rev/min"},
        {"nominal": "12345678901234567890123 nm"},
        {"nominal": 5},
        {"limits": ["1 - 2", "3 mm"], "note": "x"},
        {"fit": "25 H7/f6"},
        {"nominal": "1 mm", "other": ["a", 1, True, {"b": 0.1}]},
        "3 + 4",
        "2 mm",
        -7.25,
    ],
    ids=str,
)
def test_cells_of_any_parameter_mean_the_same(held):
    """The same words to the file that has them, the same numbers to one that has others."""
    wrong = []
    cells = dict.fromkeys((*MEASURED, "rel", "fit")) | parameter_cells(held)
    assert parameter(held, cells, lambda *one: wrong.append(one)) is held
    other = {"nominal": "99 mm" if cells["unit"] in ("mm", "um", "nm") else 99.0}
    made = parameter(other, cells, lambda *one: wrong.append(one))
    assert not wrong and dict.fromkeys((*MEASURED, "rel", "fit")) | parameter_cells(made) == cells
    if "other" not in cells:
        text = "format = 1\nparameters.p = {}\n" + block("0")
        first, second = (cc.loads(text.format(inline(one))) for one in (held, made))
        assert first.parameters == second.parameters or first.values() == second.values()
        assert first.intervals == second.intervals


def test_cells_of_any_requirement_mean_the_same():
    for facts in (
        {"of": "a", "above": "-5 mm", "below": 0.12, "at": "90 deg", "joint": "main"},
        {"of": "a", "below": 1 / 3},
        {"of": "a", "above": "1 N mm", "below": "2 N m", "at": 0.25},
    ):
        cells = requirement_cells(facts)
        same = requirement(facts, cells, None)
        assert same == facts
        assert requirement_cells(requirement(None, cells, None)) == cells


def test_new_tolerances_and_requirements(book):
    cells = {"parameters!C2": 0.05, "parameters!D2": 0.05, "parameters!F2": "triangular", "parameters!B6": 2}
    cells |= {"parameters!C6": "5 g", "parameters!D6": "0.005", "parameters!E6": "kg"}
    cells |= {"requirements!C2": 79.9, "requirements!A3": "end", "requirements!D3": "0.2 m"}
    new = cc.loads(FILE, workbook=changed(book, cells))
    assert new.intervals["rail"] == cc.Interval.around("100 mm", plus="50 um", minus="50 um")
    assert type(new.parameters["rail"].distribution).__name__ == "Triangular"
    # A constant of the file gets an interval; texts have their own unit, numbers as text that of the line.
    assert new.intervals["mass"] == cc.Interval(1.995, 2.005)
    assert list(new.requirements) == ["place", "end"]
    assert new.requirements["place"].above == "79.9 mm" and new.requirements["end"].below == "0.2 m"
    later = cc.loads(FILE, workbook=book, changes={"rail.plus": "10 um", "rail.minus": "10 um"})
    assert later.intervals["rail"].upper == 0.10001
    assert cc.loads(new.to_toml()) == new


def test_another_way_to_give_the_interval_takes_the_place_of_the_first(book):
    cells = {"parameters!B3": 20, "parameters!C3": 0.05, "parameters!D3": 0.05}
    assert "two ways" in problems(book, cells)["parameters!A3"]
    work = openpyxl.load_workbook(book)
    work["parameters"].delete_cols(7, 4)  # rel, lower, upper and fit
    work.save(book)
    found = cc.loads(FILE, workbook=book).intervals["stop"]
    assert found == cc.Interval.around("20 mm", plus="50 um", minus="50 um")


def test_another_unit_is_that_of_all_numbers_of_the_line(book):
    new = cc.loads(
        FILE, workbook=changed(book, {"parameters!E2": "cm", "parameters!F2": None, "requirements!F2": "cm"})
    )
    assert new.source["parameters"]["rail"]["nominal"] == "100.0 cm"
    assert new.intervals["rail"].lower == 1.0 - 6e-4 and new.intervals["rail"].upper == pytest.approx(1.00006)
    assert new.requirements["place"].above == "79.95 cm"


def test_problems_are_named_by_their_cells_all_at_once(book):
    cells = {
        "parameters!C2": -1,
        "parameters!F2": "gauss",
        "parameters!F3": "normall",
        "parameters!E4": "mmm",
        "parameters!B5": date(2024, 5, 1),
        "parameters!A6": "mas",
        "parameters!E8": "mm",
        "parameters!Q1": "tolerance class",
        "requirements!B2": "block.q",
        "requirements!F3": "kg",
    }
    found = problems(book, cells)
    assert set(found) == cells.keys() - {"requirements!F3"} | {"requirements!D3"}
    assert "at least 0" in found["parameters!C2"] and '"normal"' in found["parameters!F2"]
    assert 'did you mean "mm"' in found["parameters!E4"] and "date" in found["parameters!B5"]
    assert 'did you mean "mass"' in found["parameters!A6"] and "rpm" in found["parameters!E8"]
    assert "#" in found["parameters!Q1"] and "kg" in found["requirements!D3"]


def test_problems_of_the_file_keep_their_lines(book):
    text = FILE.replace("duration = 0.001", "duration = -1").replace("samples", "sampels")
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(text, workbook=changed(book, {"parameters!C2": -1}))
    paths = [one.path for one in caught.value.problems]
    assert paths[0] == "parameters!C2"
    assert any(path.startswith("scene:") and "sampels" in path for path in paths)


@pytest.mark.parametrize("cell", ["parameters!E2", "requirements!F2"])
def test_a_missing_unit_makes_no_meters_of_millimeters(book, cell):
    assert "the file has mm" in problems(book, {cell: None})[cell]
    assert "the file has mm" in problems(book, {cell: "-"})[cell]


def test_names_stand_once_and_are_texts(book):
    found = problems(book, {"parameters!A3": "rail", "parameters!A4": 4, "parameters!A5": None})
    assert set(found) == {"parameters!A3", "parameters!A4", "parameters!A5"}
    assert "parameters!A2" in found["parameters!A3"]


def computed(book, title, cell, value):
    """Put what a program computed into a formula cell, as it would save it."""
    number = {"parameters": 1, "requirements": 2}[title]
    with zipfile.ZipFile(book) as parts:
        texts = {name: parts.read(name) for name in parts.namelist()}
    part = f"xl/worksheets/sheet{number}.xml"
    pattern = rf'(<c r="{cell}"[^>]*><f>[^<]*</f>)<v ?/>|(<c r="{cell}"[^>]*><f>[^<]*</f>)<v></v>'
    new, count = re.subn(pattern, rf"\g<1><v>{value}</v>", texts[part].decode())
    assert count == 1
    with zipfile.ZipFile(book, "w") as parts:
        for name, text in texts.items():
            parts.writestr(name, new if name == part else text)


def test_formulas_are_read_by_the_values_that_the_file_holds(template, book):
    assert "LibreOffice" in problems(book, {"parameters!B2": "=50*2+1"})["parameters!B2"]
    computed(book, "parameters", "B2", "101")
    assert cc.loads(FILE, workbook=book).values()["rail"] == 0.101
    # They would be lost.
    with refuses("path"):
        template.to_workbook(book)
    changed(book, {"parameters!B2": 101})
    template.to_workbook(book)
    assert cc.loads(FILE, workbook=book) == template


def test_errors_in_cells_are_said(book):
    assert "#DIV/0!" in problems(book, {"parameters!B2": "#DIV/0!"})["parameters!B2"]


def test_merged_hidden_and_formatted_cells_and_columns_of_ones_own_are_harmless(template, book):
    work = openpyxl.load_workbook(book)
    table = work["parameters"]
    table.row_dimensions[3].hidden = table.column_dimensions["D"].hidden = True
    table["L1"], table["L2"] = "# drawing", "=A1"
    table["M2"] = "no head, no meaning"
    table["A9"] = "# a line of one's own"
    table["B9"] = "=1/0"
    table.insert_rows(1, 2)
    table["A1"] = "Tolerances of the block"
    table.merge_cells("A1:K1")
    table["A12"] = "A heading"
    table.merge_cells("A12:F12")
    # rail and stop: one cell of the unit for both.
    table["E5"] = None
    table.merge_cells("E4:E5")
    table["B900000"].font = Font(bold=True)
    work.create_sheet("notes")["A1"] = "whatever"
    work.save(book)
    assert cc.loads(FILE, workbook=book) == template
    with refuses("path"):
        template.to_workbook(book)


def test_what_is_no_workbook_is_refused(tmp_path, book):
    path = tmp_path / "scene.xlsx"
    for content, words in (
        (b"name,nominal", "no Excel"),
        (b"\xd0\xcf\x11\xe0" + b"0" * 9, "password"),
        (b"", "no"),
    ):
        path.write_bytes(content)
        with pytest.raises(cc.errors.SceneError, match=words):
            cc.loads(FILE, workbook=path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as parts:
        parts.writestr("xl/workbook.xml", b"0" * 30_000_000)
    with pytest.raises(cc.errors.SceneError, match="20 MB"):
        cc.loads(FILE, workbook=path)
    with zipfile.ZipFile(path, "w") as parts:
        parts.writestr("xl/workbook.xml", b"<nothing/>")
    with pytest.raises(cc.errors.SceneError, match="no Excel workbook"):
        cc.loads(FILE, workbook=path)
    with pytest.raises(FileNotFoundError):
        cc.loads(FILE, workbook=tmp_path / "none.xlsx")
    work = openpyxl.Workbook()
    work.save(path)
    with pytest.raises(cc.errors.SceneError, match='"Sheet"'):
        cc.loads(FILE, workbook=path)
    work.create_sheet("parameters")["C7"] = "nominal"
    work.create_sheet("Requirements")["A1"] = "Name"
    work.save(path)
    with pytest.raises(cc.errors.SceneError) as caught:
        cc.loads(FILE, workbook=path)
    assert [one.path for one in caught.value.problems] == ["parameters!A1", "requirements!A1"]
    work["parameters"]["A5000"] = "rail"
    work.save(path)
    with pytest.raises(cc.errors.SceneError, match="parameters!A5000"):
        cc.loads(FILE, workbook=path)


def test_texts_are_no_formulas_and_no_control_characters(tmp_path):
    text = FILE.replace('"=ground"', r'"=HYPERLINK(0) \u0007 \u001b"')
    template = cc.loads(text)
    book = template.to_workbook(tmp_path / "book.xlsx")
    note = openpyxl.load_workbook(book)["parameters"]["K2"]
    assert note.data_type == "s" and note.value.startswith("=HYPERLINK(0) \\x07") and note.quotePrefix
    assert cc.loads(text, workbook=book) == template


def test_results_are_a_third_sheet(template, book, tmp_path):
    study = template.study(
        outputs=["block.x"], features={"place": cc.features.peak("block.x")}, progress=None
    )
    result = study.sample(24)
    path = template.to_workbook(tmp_path / "with_results.xlsx", result)
    head, *rows = sheet(path, "results")
    assert head == ["quantity", "nominal", "smallest", "largest", "unit", "how sure", "why"]
    found = {row[0]: row for row in rows}
    place = result.features["place"].interval
    assert found["place"][2:5] == [pytest.approx(1e3 * place.lower), pytest.approx(1e3 * place.upper), "mm"]
    assert found["place"][5] == place.verdict
    assert found["block.x"][2] == pytest.approx(1e3 * float(result["block.x"].lower.min()))
    share = result.conformance["place"]
    assert found["in specification: place"][2:5] == [100.0 * share.lower, 100.0 * share.upper, "%"]
    # The third sheet is no news to the file, and is written again.
    assert cc.loads(FILE, workbook=path) == template
    template.to_workbook(path, template.conformance(24, progress=None))
    assert [row[0] for row in sheet(path, "results")[1:]] == [
        f"in specification: {one}" for one in ("place", "start", "all")
    ]
    with pytest.raises(TypeError, match="result"):
        template.to_workbook(path, 3)


def test_without_openpyxl_it_says_what_to_install(template, book, monkeypatch, capsys):
    real = importlib.import_module

    def without(name, *more):
        if name.startswith("openpyxl"):
            raise ModuleNotFoundError(f"No module named '{name}'", name="openpyxl")
        return real(name, *more)

    monkeypatch.setattr(importlib, "import_module", without)
    with pytest.raises(ImportError, match=r"pip install 'chebclear\[excel\]'"):
        cc.loads(FILE, workbook=book)
    with pytest.raises(ImportError, match=r"pip install 'chebclear\[excel\]'"):
        template.to_workbook(book)
    file = book.with_name("block.toml")
    file.write_text(FILE, encoding="utf-8")
    with pytest.raises(SystemExit):
        cli.main(["study", str(file), "--workbook", str(book)])
    assert "chebclear[excel]" in capsys.readouterr().err


def test_the_command_line_writes_and_takes_workbooks(tmp_path, capsys):
    file, book, folder = tmp_path / "block.toml", tmp_path / "book.xlsx", tmp_path / "found"
    file.write_text(FILE, encoding="utf-8")
    assert cli.main(["workbook", str(file), str(book)]) == 0
    assert f"--workbook {book}" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        cli.main(["workbook", str(file), str(book)])
    assert "--force" in capsys.readouterr().err
    assert cli.main(["workbook", str(file), str(book), "--force", "--quiet"]) == 0
    changed(book, {"parameters!B2": 101, "requirements!D2": 81.05})
    words = ["--workbook", str(book), "--quiet"]
    command = ["study", str(file), "--kind", "sample", "--runs", "20", "--outputs", "block.x"]
    assert cli.main([*command, "--out", str(folder), *words]) == 0
    written = cc.load(file, workbook=folder / "workbook.xlsx")
    assert written == cc.load(file, workbook=book) and written.values()["rail"] == 0.101
    assert sheet(folder / "workbook.xlsx", "results")[-1][0] == "block.x"
    capsys.readouterr()
    assert cli.main(["conformance", str(file), "--runs", "20", "--json", *words]) == 0
    assert "below 81.05 mm" in capsys.readouterr().out
    changed(book, {"parameters!C2": -1})
    assert cli.main(["conformance", str(file), *words]) == 2
    assert "parameters!C2: parameters.rail.plus: " in capsys.readouterr().err
