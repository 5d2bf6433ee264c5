"""Results in notebooks: executed by a real kernel; the widget in a real browser."""

import base64
import json
import re

import chebclear as cc
import pytest
from browser import BROWSER, Browser
from chebclear.plots.animation.animate import widget_of

FILE = """format = 1
bodies = [{ name = "bob", mass = "m", inertia = 1 }]
joints = []
parameters.m = "2 kg"
"""
BEFORE = """import warnings
warnings.simplefilter("ignore")
import chebclear as cc
scene = cc.mechanisms.slider_crank()
run = cc.simulate(scene, duration=0.003, samples=61)
box = {"rod_length": cc.Interval.around(0.12, rel=0.01)}
result = cc.Study(cc.mechanisms.slider_crank, box, ["slider.x"], duration=0.003, samples=31).scan(3)
animation = run.animate("slider.vx", frames=5)
scene"""
CELLS = [
    BEFORE,
    f"cc.loads({FILE!r})",
    "run",
    "result",
    'result["slider.x"]',
    'result.report("report.html")',
    "animation",
    "animation.widget.frame = 3\nanimation.widget",
    'cc.Scene([cc.Body("bob", -1.0, 1.0)], [])',
]


def test_a_notebook_shows_scenes_runs_bands_reports_and_animations(tmp_path):
    client = pytest.importorskip("nbclient", reason="no nbclient here: no notebook is executed")
    pytest.importorskip("ipykernel")
    import nbformat

    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in CELLS])
    client.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": tmp_path}}).execute()
    shown = [cell.outputs[-1].data for cell in notebook.cells]
    pages = [data.get("text/html", "") for data in shown]
    for page, pictures, words in zip(
        pages[:5],
        (1, 1, 2, 1, 1),
        ("wrist", "2 kg", "slider.vx", "unknown", "slider.x"),
        strict=True,
    ):
        assert page.count("<img ") == pictures and words in re.sub("<[^>]*>", "", page)
        assert "<script" not in page
    for page in pages[5:7]:
        assert page.startswith("<iframe ") and 'sandbox="allow-scripts allow-downloads"' in page
    assert (tmp_path / "report.html").exists()
    # A wrong scene is shown with its problems.
    assert "<img" not in pages[8] and "mass" in pages[8]
    try:
        import anywidget  # noqa: F401
    except ImportError:
        return
    assert all("application/vnd.jupyter.widget-view+json" in data for data in shown[6:8])


def test_without_the_package_a_widget_says_what_to_install(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "anywidget", None)
    run = cc.simulate(cc.mechanisms.slider_crank(), duration=0.003, samples=31)
    animation = run.animate(frames=3)
    with pytest.raises(cc.errors.MissingProgramError):
        animation.widget  # noqa: B018
    assert animation._repr_mimebundle_() == {} and animation._repr_html_().startswith("<iframe")


# What a notebook does with a widget: it keeps the traits of both sides equal.
HOST = """(async () => {
  const values = JSON.parse(atob("%s")), heard = {};
  window.model = {get: name => values[name], set(name, value) { values[name] = value; }, save_changes() {},
    on(name, call) { heard[name] = call; }, python(value) { values.frame = value; heard["change:frame"](); }};
  const module = await import("data:text/javascript;base64," + values._esm);
  module.default.render({model, el: document.body});
  return true;
})()"""


@pytest.mark.skipif(BROWSER is None, reason="no Chromium here")
def test_the_frame_of_a_widget_is_that_of_python(tmp_path):
    pytest.importorskip("anywidget", reason="no anywidget here: no widget is shown")
    run = cc.simulate(cc.mechanisms.slider_crank(), duration=0.03, samples=61)
    widget = widget_of(run.animate("slider.x", frames=7).film())
    assert widget.frame == 0
    script = base64.b64encode(str(widget._esm).encode()).decode()
    values = json.dumps({"film": widget.film, "frame": 2, "_esm": script})
    with Browser(tmp_path) as browser:
        assert browser.find(HOST % base64.b64encode(values.encode()).decode())
        place = "document.querySelector('.bar output').textContent"
        # It begins where Python has it, follows it, and tells it where the reader went.
        assert browser.find(place).startswith("t = 10 ms")
        browser.find("model.python(6)")
        assert browser.find(place).startswith("t = 30 ms")
        browser.find("document.querySelector('input[type=range]').value = 3")
        browser.find("document.querySelector('input[type=range]').dispatchEvent(new Event('input'))")
        assert browser.find("model.get('frame')") == 3
        assert not browser.errors
