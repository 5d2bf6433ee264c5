"""Names from strangers on pages, in tables and in the formats of other programs."""

import csv
import json

import chebclear as cc
import hostile_names
import numpy as np
import pytest
from chebclear.report.document import Document, Items, Listing, Picture, Section, Table, Text, Verdict
from chebclear.report.html import as_html, fragment, framed

T = [0.0, 0.5, 1.0]


def blocks(name):
    """Every kind of block with the name in every place."""
    return [
        Text(name),
        Items([name]),
        Table(name, [name, name], [[name, Verdict(name, "bad")], [name, name]]),
        Picture(name, lambda ax: ax.plot([0, 1]), caption=name),
        Listing(name, name, name),
    ]


def written(folder, number, what, text):
    path = folder / f"{number}-{what}.html"
    opened = hostile_names.POLICY.sub("", text).replace("<head>", f"<head>{hostile_names.RAN}")
    path.write_text(opened, encoding="utf-8")
    return path


@pytest.mark.skipif(hostile_names.BROWSER is None, reason="no Chromium here")
def test_no_name_runs_in_any_block(tmp_path):
    raw, made = [], []
    for number, name in enumerate(hostile_names.NAMES):
        raw.append(hostile_names.unescaped(name, tmp_path, number))
        page = Document(name, [name], [name], [name], [Section(name, blocks(name))], blocks(name)[:3])
        made.append(written(tmp_path, number, "report", as_html(page)))
        parts = [fragment(name, blocks(name)[:1]), framed(name, name)]
        notebook = f"<!DOCTYPE html><html><head></head><body>{''.join(parts)}</body></html>"
        made.append(written(tmp_path, number, "notebook", notebook))
    assert hostile_names.ran(made, tmp_path) == []
    # The browser would have shown it: most of the names run where they are not escaped.
    assert len(hostile_names.ran(raw, tmp_path)) > 30


@pytest.mark.skipif(hostile_names.BROWSER is None, reason="no Chromium here")
def test_no_name_runs_on_any_page_of_any_result():
    """Some of each group in one name; `hostile_names.py` as a script gives each of them to every page."""
    wrong, opened, dangerous = hostile_names.faults([" ".join(hostile_names.NAMES[:45:6])])
    assert wrong == [] and opened > 15 and dangerous == 1


@pytest.mark.parametrize("name", ["$x_{$", r"$\frac$", "$", "a$b", "$$", r"\$x$", "$x$ in $y", "$%&#_^~{}$"])
@pytest.mark.filterwarnings("ignore")
def test_dollars_in_names_are_letters_of_pictures(tmp_path, name):
    study = cc.Study(
        lambda **given: {"t": T, name: [given[name], 2.0, 3.0 * given[name]], f"n{name}": given[name]},
        {name: cc.Interval.around(1.0, rel=0.1), "b": cc.Interval.around(1.0, rel=0.1)},
        units={name: name},
    )
    result = study.chebyshev(degree=2)
    result.report(tmp_path / "study.html")
    result[name].plot()
    run = cc.simulate(hostile_names.scene(name), duration=0.001, samples=5)
    run.report(tmp_path / "run.html")
    run.plot(f"{name}.x")
    cc.animate(run, frames=2).save(tmp_path / "run.gif")


@pytest.mark.parametrize("start", "=+-@")
def test_spreadsheets_compute_no_name(tmp_path, start):
    name = f"{start}HYPERLINK(0)"
    run = cc.simulate(cc.Scene([cc.Body(name, 1.0, 1.0)], []), duration=1.0, samples=3)
    with run.to_csv(tmp_path / "run").open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    assert f"'{name}.x [m]" in head and not any(cell[0] in "=+-@" for cell in head)
    assert np.array_equal(np.array(rows, dtype=float)[:, 0], run.t)


NAMES = ["a/b", "/", "a ", " a", "$x", "{x}", "=x", "*", "float", "1x", "x'y", 'x"y', "e\u0301", "日本", "t2"]


def test_netcdf_takes_every_name(tmp_path):
    pytest.importorskip("scipy")
    xarray = pytest.importorskip("xarray")
    names = [*NAMES, *hostile_names.NAMES]
    study = cc.Study(
        lambda a, **other: {"t": T} | {name: [a, number, 0.0] for number, name in enumerate(names)},
        {
            "a": cc.Interval.around(1.0, rel=0.1),
            "a/b": cc.Interval.around(1.0, rel=0.1),
            "a_b": cc.Interval.around(1.0, rel=0.1),
        },
        units=dict.fromkeys(names, "m"),
    )
    result = study.scan(2)
    result.to_xarray().to_netcdf(tmp_path / "study.nc")
    with xarray.open_dataset(tmp_path / "study.nc") as read:
        found = {read[one].attrs.get("long_name", one): read[one] for one in read}
        for number, name in enumerate(names):
            assert found[f"{name}.lower"].values[1] == number and found[f"{name}.lower"].units == "m"


@pytest.mark.parametrize("bad", ["\x1b[2J", "a\nb", "\x7f", "\x9b", "\u2028", "\ud800"])
def test_control_characters_are_no_letters_of_names(bad):
    side = cc.Interval.around(1.0, rel=0.1)
    for refused in (
        lambda: cc.Study(lambda **given: {"x": 1.0}, {bad: side}),
        lambda: cc.Study(lambda a: {bad: a}, {"a": side}).sample(2),
        lambda: cc.Study(lambda a: {"x": a}, {"a": side}, features={bad: lambda run: 1.0}),
        lambda: cc.Study.from_runs({"a": [1.0, 2.0]}, None, {bad: [1.0, 2.0]}).sample(),
        lambda: cc.Scene([cc.Body(bad, 1.0, 1.0)], []).check(),
        lambda: cc.loads(json.dumps({"title": bad, "bodies": [], "joints": []})),
    ):
        with pytest.raises(ValueError) as caught:
            refused()
        assert str(caught.value).replace("\n", "").isprintable()
