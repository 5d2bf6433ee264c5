"""Reports: what they say, that they need no network, and how a real browser shows them."""

import base64
import hashlib
import html
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser

import chebclear as cc
import numpy as np
import pytest
from chebclear.report.document import Document, Items, Listing, Picture, Section, Table, Text, Verdict
from chebclear.report.html import as_html, write
from chebclear.study.report.document import study_document

HOSTILE = "<script>alert('x')</script>\"&<img src=http://example.org/a.png>"
VOID = {"meta", "link", "img", "br", "input", "hr", "wbr"}


class Page(HTMLParser):
    """The elements of a page with their attributes, and its text; notes tags that do not match."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.open, self.mismatched, self.words = [], [], [], []
        self.within_word = False
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.elements.append((tag, dict(attributes)))
        # A place for a line break within a word.
        self.within_word = tag == "wbr"
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.mismatched.append(tag)

    def handle_data(self, data):
        if not {"style", "script"} & set(self.open):
            before = self.words.pop() if self.within_word and self.words else ""
            self.words.append(before + data)
        self.within_word = False

    def all(self, tag):
        return [attributes for name, attributes in self.elements if name == tag]

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())


def is_local(address):
    return address.startswith(("data:", "#"))


def check(text):
    """What every report must be; returns its page."""
    page = Page(text)
    assert text.startswith("<!DOCTYPE html>") and not page.mismatched and not page.open
    assert page.all("html")[0]["lang"] == "en" and len(page.all("h1")) == 1 and len(page.all("main")) == 1
    policy = next(one for one in page.all("meta") if one.get("http-equiv") == "Content-Security-Policy")
    scripts = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    digests = [base64.b64encode(hashlib.sha256(one.encode()).digest()).decode() for one in scripts]
    allowed = "".join(f"; script-src 'sha256-{digest}'" for digest in digests)
    assert policy["content"] == f"default-src 'none'; img-src data:; style-src 'unsafe-inline'{allowed}"
    # The player of films, and what it plays.
    assert len(scripts) == bool(page.all("script"))
    assert [one for one in page.all("script") if one] == [{"type": "application/json"}] * len(scripts)
    assert not page.all("iframe") and not page.all("object")
    assert not any(name.startswith("on") for _, attributes in page.elements for name in attributes)
    addresses = [one[key] for _, one in page.elements for key in ("src", "href") if key in one]
    assert addresses and all(map(is_local, addresses))
    identities = [one["id"] for _, one in page.elements if "id" in one]
    assert len(set(identities)) == len(identities)
    assert {address[1:] for address in addresses if address.startswith("#")} <= set(identities)
    assert all(len(image["alt"]) > 20 for image in page.all("img"))
    assert all("scope" in head for head in page.all("th"))
    assert len(page.all("caption")) == len(page.all("table"))
    return page


@pytest.fixture(scope="module")
def scene():
    return cc.mechanisms.slider_crank(
        crank_length=0.05, rod_length=0.12, clearance=2e-5, crank_speed=cc.rpm(2000)
    )


@pytest.fixture(scope="module")
def result():
    study = cc.Study(
        cc.mechanisms.slider_crank,
        {"crank_length": cc.Interval.around(0.05, rel=0.02), "clearance": cc.Interval.around(2e-5, rel=0.5)},
        outputs=["slider.x", "wrist.normal_force"],
        features={"peak force": cc.features.peak("wrist.normal_force")},
        duration=0.01,
        samples=61,
        skip=0.03,
    )
    return study.band(20)


@pytest.fixture(scope="module")
def reports(scene, result, tmp_path_factory):
    """A report of each kind of result."""
    folder = tmp_path_factory.mktemp("reports")
    run = cc.simulate(scene, duration=0.03, samples=301, error="estimate")
    costs = cc.tradeoff(scene, duration=0.01, samples=101, outputs=["slider.vx"], rtols=[1e-3, 1e-5])
    return {
        "run": run.report(folder / "run"),
        "study": result.report(folder / "study.html"),
        "costs": costs.report(folder / "costs.html"),
        "bounds": cc.study_tradeoff(result.study, degrees=[1, 2], points=[3], runs=[8]).report(
            folder / "bounds"
        ),
    }


@pytest.mark.parametrize("kind", ["run", "study", "costs", "bounds"])
def test_a_report_is_one_file_without_network_and_other_scripts(reports, kind):
    path = reports[kind]
    assert path.suffix == ".html" and path.stat().st_size < 3e6
    check(path.read_text(encoding="utf-8"))


def test_the_report_of_a_study_says_what_other_settings_would_give(reports, result, tmp_path):
    """Half the runs are those of a study of half as many; the errors are those of the run."""
    page = Page(reports["study"].read_text(encoding="utf-8"))
    assert "What a tighter or a cheaper setting would give" in page.text
    half = result.study.band(10)
    for name, band in half.items():
        wider = 100.0 * (band.width.mean() / result[name].width.mean() - 1.0)
        inside = ((result[name].runs[10:] >= band.lower) & (result[name].runs[10:] <= band.upper)).mean()
        (row,) = re.findall(rf"{re.escape(name)} \S+ \S+ \S+ \S+ ([+-][\d.]+) % ([\d.]+) %", page.text)
        assert float(row[0]) == pytest.approx(wider, abs=0.06)
        assert float(row[1]) == pytest.approx(100.0 * inside, abs=0.02)
    run = cc.simulate(result.scene, settings=result.settings, error="estimate")
    share = 100.0 * run.error["slider.x"].claim / result["slider.x"].max_width
    page = Page(result.report(tmp_path / "checked", check=True).read_text(encoding="utf-8"))
    assert f"rtol {result.settings.rtol:g} (this study) {run.stats.stages} {share:.2g} %" in page.text
    assert (
        f"rtol {10 * result.settings.rtol:g} " in page.text
        and f"rtol {result.settings.rtol / 10:g} " in page.text
    )


def test_the_report_of_a_study_says_what_the_result_says(reports, result):
    page = Page(reports["study"].read_text(encoding="utf-8"))
    for name, band in result.bands.items():
        assert name in page.text and band.verdict in page.text
    assert result.statement in page.text
    assert all(warning in page.text for warning in result.warnings)
    for sentence in result.ranking("peak force").advice():
        assert sentence in page.text
    assert json.dumps(json.loads(result.scene.to_json())["bodies"][0]["name"]) in page.text


@pytest.mark.parametrize(
    "ask",
    [
        lambda study: study.sample(8, rng=4),
        lambda study: study.chebyshev(2, bounds="eq31"),
        lambda study: study.band(12, rng=3),
    ],
)
@pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")
def test_the_script_has_features_distributions_seeds_and_bounds(ask, tmp_path):
    scene = cc.mechanisms.slider_crank
    box = {"rod_length": cc.normal(0.12, 2e-4), "clearance": cc.Interval.around(2e-5, rel=0.5)}
    features = {"peak force": cc.features.peak("wrist.normal_force"), "own": lambda run: run["slider.x"][-1]}
    study = cc.Study(
        scene,
        box,
        ["slider.x"],
        fixed={"crank_speed": np.float64(100.0)},
        features=features,
        duration=0.01,
        samples=31,
    )
    result = ask(study)
    page = result.report(tmp_path / "report.html").read_text(encoding="utf-8")
    [script] = re.findall(r'<pre[^>]*aria-label="study.py"[^>]*>(.*?)</pre>', page, re.DOTALL)
    found = {}
    exec(html.unescape(script).replace("print(result)", ""), found)
    again = found["result"]
    np.testing.assert_array_equal(again.parameters, result.parameters)
    np.testing.assert_array_equal(again["slider.x"].upper, result["slider.x"].upper)
    name = "peak force"
    np.testing.assert_array_equal(again.features[name].values, result.features[name].values)
    assert found["study"].random == study.random and "a function of your own" in html.unescape(script)


def test_the_script_of_a_report_makes_the_result_again(reports, result):
    text = reports["study"].read_text(encoding="utf-8")
    scripts = re.findall(r'<pre[^>]*aria-label="study.py"[^>]*>(.*?)</pre>', text, re.DOTALL)
    found = {}
    exec(html.unescape(scripts[0]).replace("print(result)", ""), found)
    again = found["result"]
    assert all(cc.compare(again, result)[name].slack == 0.0 for name in result.bands)
    assert again.settings.rtol == result.settings.rtol and again.requirement == result.requirement


def test_the_script_of_the_report_of_a_run_makes_it_again(scene, tmp_path, monkeypatch):
    run = cc.simulate(scene, duration=0.004, samples=21, outputs=["slider.x"], skip=0.001)
    text = run.report(tmp_path / "run").read_text(encoding="utf-8")
    script, stored = (
        html.unescape(re.search(rf'<pre[^>]*aria-label="{name}"[^>]*>(.*?)</pre>', text, re.DOTALL)[1])
        for name in ("run.py", "scene.json")
    )
    (tmp_path / "scene.json").write_text(stored, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    found = {"print": lambda *_: None}
    exec(script, found)
    assert found["run"] == run


def test_hostile_names_stay_text(tmp_path):
    document = Document(
        title=HOSTILE,
        facts=[HOSTILE],
        answer=[HOSTILE],
        doubts=[HOSTILE],
        sections=[
            Section(
                HOSTILE,
                [
                    Text(HOSTILE),
                    Items([HOSTILE]),
                    Table(HOSTILE, ["a", HOSTILE], [[HOSTILE, Verdict(HOSTILE, "bad")], [HOSTILE, HOSTILE]]),
                    Picture(HOSTILE, lambda ax: ax.plot([0, 1]), caption=HOSTILE),
                    Listing(HOSTILE, HOSTILE, HOSTILE),
                ],
            )
        ],
    )
    page = check(as_html(document))
    assert page.text.count(HOSTILE) >= 12
    assert write(document, tmp_path / "hostile").read_text(encoding="utf-8") == as_html(document)


def test_a_row_too_short_is_refused():
    with pytest.raises(ValueError):
        Table("t", ["a", "b"], [["1", "2"], ["1"]])


def test_names_of_rows_may_break_and_captions_fit_a_narrow_page():
    table = Table(
        "A caption that is wider than a telephone", ["output"], [["rod_end.normal_force"], [HOSTILE]]
    )
    text = as_html(Document("rtol 0.001 of rod.vx", [], [], [], [Section("s", [table])]))
    page = check(text)
    assert "rod_<wbr>end.<wbr>normal_<wbr>force" in text and "rtol 0.001 of rod.<wbr>vx</h1>" in text
    assert "rod_end.normal_force" in page.text and HOSTILE in page.text
    assert "<caption><span>" in text


def test_rounding_is_no_bound(scene, tmp_path):
    t = [0.0, 0.5, 1.0]
    study = cc.Study(lambda a: {"t": t, "x": [-9.3e-17, 0.1 * a, a]}, {"a": cc.Interval.around(1.0, rel=0.1)})
    result = study.scan(3)
    assert result["x"].lower.min() == -9.3e-17  # what was computed stays
    assert "e-17" not in check(as_html(study_document(result, None))).text
    assert "e-17" not in str(result)


def test_a_picture_is_drawn_once_for_the_page_and_its_file(tmp_path):
    drawn = []

    def line(ax):
        drawn.extend(ax.plot([0, 1]))

    document = Document("t", [], [], [], [Section("s", [Picture("a" * 30, line, name="a/b")])])
    (image,) = check(as_html(document, tmp_path)).all("img")
    (file,) = tmp_path.iterdir()
    assert image["src"] == f"data:image/png;base64,{base64.b64encode(file.read_bytes()).decode()}"
    assert file.suffix == ".png" and len(drawn) == 1


def test_an_interrupted_report_leaves_the_old_file(tmp_path):
    path = tmp_path / "report.html"
    path.write_text("old")

    def interrupt(ax):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write(Document("t", [], [], [], [Section("s", [Picture("p" * 30, interrupt)])]), path)
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)

# A page that shows reports in frames of some width and writes down how they are laid out.
HARNESS = """<!DOCTYPE html><body><script>
const found = [];
const frames = %s.map(([address, width]) => new Promise(done => {
  const frame = document.createElement("iframe");
  frame.style.width = width + "px"; frame.style.height = "900px"; frame.style.border = "0";
  frame.onload = () => {
    const page = frame.contentDocument, root = page.documentElement;
    found.push({address, width, content: root.scrollWidth, seen: root.clientWidth,
      pictures: [...page.images].every(image => image.complete && image.naturalWidth > 0),
      smallest: Math.min(...[...page.querySelectorAll("p, td, th, li")].map(
        element => parseFloat(frame.contentWindow.getComputedStyle(element).fontSize)))});
    done();
  };
  frame.src = address; document.body.appendChild(frame);
}));
Promise.all(frames).then(() => { document.body.textContent = JSON.stringify(found); });
</script></body>"""


@pytest.mark.skipif(BROWSER is None, reason="no Chromium here: no browser looks at the reports")
def test_a_browser_shows_reports_without_errors_and_without_scrolling_sideways(reports, tmp_path):
    wanted = [[path.as_uri(), width] for path in reports.values() for width in (400, 1400)]
    harness = tmp_path / "harness.html"
    harness.write_text(HARNESS % json.dumps(wanted), encoding="utf-8")
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"]
    command += [
        "--enable-logging=stderr",
        "--virtual-time-budget=30000",
        f"--user-data-dir={tmp_path / 'profile'}",
    ]
    shown = subprocess.run(
        [*command, "--dump-dom", harness.as_uri()], capture_output=True, text=True, timeout=120, check=True
    )
    assert "CONSOLE" not in shown.stderr, shown.stderr
    found = json.loads(shown.stdout.partition("<body>")[2].partition("</body>")[0])
    assert len(found) == len(wanted)
    for layout in found:
        assert layout["content"] <= layout["seen"], layout
        assert layout["pictures"], layout
        assert layout["smallest"] >= 12.0, layout


@pytest.mark.parametrize("kind", ["run", "study", "ranking", "costs", "scene"])
def test_notebooks_show_a_table_without_scripts(kind, scene, result):
    shown = {
        "run": lambda: cc.simulate(scene, duration=0.003, samples=11),
        "study": lambda: result,
        "ranking": lambda: result.ranking("peak force"),
        "costs": lambda: cc.tradeoff(
            scene, duration=0.003, samples=31, outputs=["slider.x"], rtols=[1e-3, 1e-4]
        ),
        "scene": lambda: scene,
    }[kind]()
    page = Page(shown._repr_html_())
    assert not page.mismatched and not page.open and not page.all("script")
    assert len(page.all("table")) == (kind != "scene")
    expected = {
        "run": "slider.vx",
        "study": "estimated",
        "ranking": "scatter",
        "costs": "auto",
        "scene": "crank_pin",
    }
    assert expected[kind] in page.text
