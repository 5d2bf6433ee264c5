"""Hostile names on every kind of page, in a browser: none may run, break out of its place or break a page.

Every kind of page and of notebook display is made of scenes, outputs, features, parameters and titles with
these names. A browser opens them, without the policy that would stop scripts all the same. Each name that
runs where it stands unescaped must not run there. Prints the counts; ends with status 1 if a name runs.

    python tests/python/hostile_names.py [--names 52]
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import chebclear as cc

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)

NAMES = [
    # Elements.
    "<script>ran()</script>",
    "<ScRiPt >ran()</sCrIpT >",
    "<img src=x onerror=ran()>",
    '<img src=x onerror="ran()">',
    "<IMG SRC=x ONERROR='ran()'>",
    "<svg onload=ran()>",
    "<svg/onload=ran()>",
    "<svg><script>ran()</script></svg>",
    "<svg><animate onbegin=ran() attributeName=x dur=1s>",
    "<body onload=ran()>",
    "<iframe srcdoc='<script>parent&#46;ran()</script>'></iframe>",
    "<iframe src=javascript:parent&#46;ran()></iframe>",
    "<details open ontoggle=ran()>",
    "<video><source onerror=ran()></video>",
    "<audio src=x onerror=ran()>",
    "<input autofocus onfocus=ran()>",
    "<marquee onstart=ran()>x</marquee>",
    "<object data=javascript:ran()></object>",
    "<math><mtext><img src=x onerror=ran()></mtext></math>",
    "<<script>script>ran()</script>",
    "<img src=x onerror=ran()//",
    # Out of attributes.
    '"><img src=x onerror=ran()>',
    "'><img src=x onerror=ran()>",
    '"><script>ran()</script>',
    '" onerror=ran() src=x y="',
    '" onload=ran() y="',
    "' onload=ran() y='",
    '" autofocus onfocus=ran() tabindex=0 y="',
    '"/><svg onload=ran()>',
    "`><img src=x onerror=ran()>",
    # Out of elements whose content is text.
    "</title><img src=x onerror=ran()>",
    "</style><img src=x onerror=ran()>",
    "</script><img src=x onerror=ran()>",
    "</textarea><img src=x onerror=ran()>",
    "</noscript><img src=x onerror=ran()>",
    "</svg><img src=x onerror=ran()>",
    "--><img src=x onerror=ran()>",
    "]]><img src=x onerror=ran()>",
    "<!--<script>ran()</script>",
    # Out of scripts and their texts.
    '";ran();"',
    "';ran();'",
    '\\";ran();//',
    "${ran()}",
    '"}];ran();//',
    "<!--<script>",
    # Of the languages of templates, of formats, of entities.
    "{{ ran() }}",
    "{% raw %}<img src=x onerror=ran()>",
    "$alt <img src=x onerror=ran()>",
    "%s %(x)s {0} {x!r} <img src=x onerror=ran()>",
    "&lt;img src=x onerror=ran()&gt;",
    "&#60;img src=x onerror=ran()&#62;",
    "\uff1cimg src=x onerror=ran()\uff1e",
]
"""Names without dots, which bodies must not have."""

RAN = "<script>function ran() { document.documentElement.dataset.ran = 'yes'; }</script>"
POLICY = re.compile(r'<meta http-equiv="Content-Security-Policy"[^>]*>', re.DOTALL)
# A page that opens others in frames and writes down which of them ran something.
HARNESS = """<!DOCTYPE html><body><script>
const found = [];
const frames = %s.map(address => new Promise(done => {
  const frame = document.createElement("iframe");
  frame.onload = () => setTimeout(() => {
    found.push([address, frame.contentDocument.documentElement.dataset.ran === "yes"]);
    done();
  }, 300);
  frame.src = address; document.body.appendChild(frame);
}));
Promise.all(frames).then(() => { document.body.textContent = JSON.stringify(found); });
</script></body>"""


def scene(name: str, clearance: float = 1e-4) -> cc.Scene:
    """A pendulum in a bearing, all of whose parts have the name."""
    return cc.Scene(
        bodies=[cc.Body(name, 1.0, 0.01, (0.1, 0.0), points={name: (0.0, 0.0)})],
        joints=[
            cc.ClearanceRevolute(f"j{name}", "ground", f"{name}.{name}", 0.01, clearance, cc.laws.Hertz(1e7)),
        ],
        forces=[cc.Gravity((0.0, -9.81)), cc.Torque(f"t{name}", name, 0.1)],
    )


def results(name: str) -> Iterator[tuple[str, Any]]:
    """One result of every kind that has a page or is shown in notebooks, full of the name."""
    made = scene(name)
    run = cc.simulate(made, duration=0.004, samples=11, error="estimate")
    yield "scene", made
    yield "run", run
    yield "animation", cc.animate(run, frames=2, size=(3.0, 2.0))
    yield "estimate", run.error
    yield "tradeoff", cc.tradeoff(made, duration=0.001, samples=11, outputs=[f"{name}.x"], rtols=[1e-3, 1e-4])

    box = {"clearance": cc.Interval.around(1e-4, rel=0.1)}
    options = {"duration": 0.001, "samples": 5, "features": {name: cc.features.peak(f"{name}.x")}}
    of_scene = cc.Study(lambda clearance: scene(name, clearance), box, [f"{name}.x"], **options)
    yield "band of a scene", of_scene.band(5)
    yield (
        "bifurcation",
        cc.bifurcation(
            lambda clearance: scene(name, clearance),
            "clearance",
            [1e-4, 2e-4],
            f"{name}.x",
            periods=2,
            discard=0,
            sample_per=0.001,
        ),
    )

    def model(**given: float) -> dict[str, Any]:
        a, b = given[name], given["b"]
        return {"t": [0.0, 0.5, 1.0], name: [a, a * b, b], f"n{name}": a * b}

    study = cc.Study(
        model,
        {name: cc.Interval.around(1.0, rel=0.1), "b": cc.Interval.around(2.0, rel=0.1)},
        features={f"f{name}": cc.features.peak(name)},
        units={name: name},
    )
    band, polynomial = study.band(21), study.chebyshev(degree=2)
    yield "band", band
    yield "polynomial", polynomial
    yield "features", band.features
    yield "ranking", band.ranking(f"f{name}")
    yield "comparison", cc.compare(polynomial, band)
    yield "costs of a study", cc.study_tradeoff(study, degrees=[1], points=[3], holdout=3)


def pages(name: str, folder: Path, number: int) -> Iterator[tuple[str, Path]]:
    """All pages of a name, without their policies and with something to run."""
    for kind, result in results(name):
        texts = {}
        if kind == "animation":
            path = result.save(folder / "page.html")
            texts["page"] = path.read_text(encoding="utf-8")
        elif hasattr(result, "report"):
            path = result.report(folder / "page.html", title=f"{name} {kind}")
            texts["page"] = path.read_text(encoding="utf-8")
        if hasattr(result, "_repr_html_"):
            texts["notebook"] = (
                f"<!DOCTYPE html><html><head></head><body>{result._repr_html_()}</body></html>"
            )
        for what, text in texts.items():
            assert text.count("<head>") == 1
            opened = POLICY.sub("", text).replace("<head>", f"<head>{RAN}")
            path = folder / f"{number}-{kind.replace(' ', '-')}-{what}.html"
            path.write_text(opened, encoding="utf-8")
            yield f"{kind}, {what}", path


def unescaped(name: str, folder: Path, number: int) -> Path:
    """A page with the name as it is, in all places."""
    path = folder / f"{number}-raw.html"
    places = (
        f'<div>{name}</div><img alt="{name}" src=x><img alt=\'{name}\' src=x><script>x = "{name}";</script>'
    )
    places += f"<script>x = '{name}';</script><script>x = `{name}`;</script>"
    path.write_text(f"<!DOCTYPE html><head>{RAN}</head><body>{places}</body>", encoding="utf-8")
    return path


def ran(paths: list[Path], folder: Path) -> list[Path]:
    """Those of the pages that ran something in the browser."""
    harness = folder / "harness.html"
    harness.write_text(HARNESS % json.dumps([path.as_uri() for path in paths]), encoding="utf-8")
    command = [str(BROWSER), "--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"]
    command += [f"--user-data-dir={folder / 'profile'}", "--virtual-time-budget=60000", "--dump-dom"]
    shown = subprocess.run(
        [*command, harness.as_uri()], capture_output=True, text=True, timeout=600, check=True
    )
    found = json.loads(shown.stdout.partition("<body>")[2].partition("</body>")[0])
    assert len(found) == len(paths)
    by_address = {path.as_uri(): path for path in paths}
    return [by_address[address] for address, did in found if did]


def faults(names: list[str]) -> tuple[list[str], int, int]:
    """What ran; how many pages were opened; and how many of the names run where nothing escapes them."""
    with TemporaryDirectory() as place, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        folder = Path(place)
        raw = [unescaped(name, folder, number) for number, name in enumerate(names)]
        wrong, opened = [], 0
        for number, name in enumerate(names):
            made = list(pages(name, folder, number))
            opened += len(made)
            harmed = ran([path for _, path in made], folder)
            wrong += [f"{name!r} runs on {kind}" for kind, path in made if path in harmed]
            for _, path in made:
                path.unlink()
        return wrong, opened, len(ran(raw, folder))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--names", type=int, default=len(NAMES))
    options = parser.parse_args()
    if BROWSER is None:
        print("there is no Chromium here")
        return 1
    wrong, opened, dangerous = faults(NAMES[: options.names])
    print(f"{options.names} names, {dangerous} of which run unescaped, on {opened} pages: {len(wrong)} ran")
    print(*wrong, sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
