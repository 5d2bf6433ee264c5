"""``chebclear show``: what its page is told, who may ask, when it ends; and a browser that uses it."""

import http.client
import json
import math
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path
from urllib.parse import urlsplit

import chebclear as cc
import pytest
from browser import BROWSER, Browser
from chebclear.cli.show.server import PageServer, Shown

CRANK = (Path(__file__).parents[3] / "examples" / "slider_crank.toml").read_text(encoding="utf-8")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "crank.toml"
    path.write_text(CRANK, encoding="utf-8")
    return path


def saved(path, text):
    """Save a file so that it is seen to be newer, however coarse the clock of the disk."""
    before = path.stat().st_mtime_ns
    path.write_text(text, encoding="utf-8")
    os.utime(path, ns=(before + 10**9, before + 10**9))


@pytest.fixture
def shown(file):
    return Shown(file, lambda: cc.load(file))


def stroke(state):
    position = state["film"]["charts"][0]
    assert position["unit"] == "mm"
    return max(position["nominal"]) - min(position["nominal"])


def test_parameters_move_the_mechanism_within_their_intervals(shown):
    state = shown.state({})
    assert state["title"] == "Slider-crank with a loose wrist" and state["problems"] == state["notes"] == []
    crank, rod = state["parameters"]
    assert crank["words"] == ["50 mm", "45 mm", "55 mm"] and rod["lower"] == pytest.approx(0.108)
    assert stroke(state) == pytest.approx(100.0, abs=1e-3)
    assert state["film"]["cyclic"] and len(state["film"]["places"]) == 121
    longer = shown.state({"value.crank_length": "0.055", "exaggerate": "100"})
    assert longer["parameters"][0]["words"][0] == "55 mm" and stroke(longer) == pytest.approx(110.0, abs=1e-3)
    # The transmission angle where the crank stands upright, and 2 c / cos(phi) at the wrist there.
    _, transmission, lost = longer["film"]["charts"]
    lean = math.asin(0.055 / 0.120)
    assert min(transmission["nominal"]) == pytest.approx(90.0 - math.degrees(lean), abs=1e-2)
    assert (lost["unit"], max(lost["nominal"])) == ("µm", pytest.approx(40.0 / math.cos(lean), abs=1e-3))


@pytest.mark.parametrize("value", ["0.06", "nan", "long", "-1e999", ""])
def test_values_outside_their_interval_count_as_not_given(shown, value):
    state = shown.state({"value.crank_length": value, "value.unknown": "1", "exaggerate": value})
    assert state["parameters"][0]["words"][0] == "50 mm" and state["problems"] == []


def test_problems_have_lines_until_they_are_mended(shown, file):
    assert shown.state({})["problems"] == []
    saved(
        file,
        CRANK.replace('mass = "300 g"', 'mass = "300 mm"').replace(
            'a = "ground"\nb = "slider"', 'a = "grund"\nb = "slider"'
        ),
    )
    first, second = shown.state({})["problems"]
    lines = CRANK.split("\n")
    place = 1 + lines.index('mass = "300 g"')
    assert first.startswith(f"crank.toml:{place}:8: bodies[0].mass: ")
    place = max(number for number, line in enumerate(lines, 1) if line == 'a = "ground"')
    assert second.startswith(f"crank.toml:{place}:5: ")
    assert "film" not in shown.state({})
    saved(file, "format = = 1")
    (problem,) = shown.state({})["problems"]
    assert problem.startswith("crank.toml: 1:10: ")
    file.unlink()
    assert shown.stamp() == 0 and "crank.toml" in shown.state({})["problems"][0]
    file.write_text(CRANK, encoding="utf-8")
    assert stroke(shown.state({})) == pytest.approx(100.0, abs=1e-3)


def test_values_at_which_nothing_can_be_assembled_are_a_problem_and_no_end(file, shown):
    saved(
        file,
        CRANK.replace(
            'rod_length = { nominal = "120 mm", rel = 0.1 }',
            'rod_length = { nominal = "60 mm", plus = "1 mm", minus = "59 mm" }',
        ),
    )
    state = shown.state({"value.rod_length": "0.04"})
    assert state["film"] and not state["film"]["cyclic"]
    assert any("cannot go on" in note for note in state["notes"])


@pytest.fixture
def server(shown):
    with PageServer(shown) as made:
        thread = threading.Thread(target=made.serve, daemon=True)
        thread.start()
        yield made, thread
        made._left = -math.inf
        thread.join()


def ask(server, path, method="GET"):
    connection = http.client.HTTPConnection(*server.server_address, timeout=60)
    connection.request(method, path)
    return connection.getresponse()


def test_only_who_knows_the_address_is_answered(server):
    server, _ = server
    assert server.server_address[0] == "127.0.0.1"
    page = urlsplit(server.address).path
    answer = ask(server, page)
    text = answer.read().decode()
    assert answer.status == 200 and "default-src" in text and "connect-src" in text
    assert stroke(json.loads(ask(server, f"{page}state?value.rod_length=0.11").read())) == pytest.approx(
        100.0, abs=1e-3
    )
    for wrong in (
        "/",
        "/state",
        "state",
        f"/x{page}state",
        f"/{'x' * len(server.key)}/",
        f"{page}..%2fcrank.toml",
        f"{page}crank.toml",
    ):
        assert ask(server, wrong).status == 404
    assert ask(server, page, "POST").status == 501


def test_it_ends_when_the_last_page_is_closed(server, file):
    server, thread = server
    pages = [ask(server, f"{urlsplit(server.address).path}saved") for _ in range(2)]
    assert pages[0].readline().startswith(b"data: ")
    saved(file, CRANK + "\n")
    told = [pages[0].readline() for _ in range(60)]
    assert sum(line.startswith(b"data: ") for line in told) == 1
    pages[0].close()
    thread.join(3.0)
    assert thread.is_alive()
    pages[1].close()
    thread.join(60.0)
    assert not thread.is_alive()


def started(file):
    command = [sys.executable, "-m", "chebclear", "show", str(file), "--no-browser", "--json"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    return process, json.loads(process.stdout.readline())["address"]


@pytest.mark.skipif(os.name == "nt", reason="signals of a terminal")
def test_ctrl_c_ends_it(file):
    process, _ = started(file)
    process.send_signal(signal.SIGTERM)
    assert process.wait(60.0) == 143 and process.stderr.read() == "chebclear: ended\n"


@pytest.mark.skipif(BROWSER is None, reason="no Chromium here")
def test_a_browser_drags_edits_and_leaves(file, tmp_path):
    process, address = started(file)
    with Browser(tmp_path) as browser:
        browser.open(address, 400)
        browser.until("document.querySelectorAll('#parameters input').length === 2")
        words = "document.querySelector('#parameters .value').textContent"
        assert browser.find(words) == "50 mm (45 mm to 55 mm)"
        browser.find("document.querySelector('#parameters input').focus()")
        browser.key("ArrowRight")
        browser.until(f"{words} === '50.05 mm (45 mm to 55 mm)'")
        # Turned to where the slider is nearest.
        browser.find("document.querySelector('.bar input').value = 60")
        browser.find("document.querySelector('.bar input').dispatchEvent(new Event('input'))")
        browser.until("document.querySelector('.chart output').textContent === '69.95'")
        saved(file, CRANK.replace('mass = "300 g"', 'mass = "300 mm"'))
        browser.until("document.querySelector('#problems').textContent.includes('crank.toml:13:8')")
        assert browser.find("document.querySelector('#film').classList.contains('old')")
        saved(file, CRANK.replace('"50 mm"', '"52 mm"'))
        browser.until("document.querySelector('#problems').textContent === ''")
        browser.until("!document.querySelector('#film').classList.contains('old')")
        assert browser.find("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
        assert not browser.errors
    assert process.wait(60.0) == 0 and process.stderr.read() == ""
