"""Labels set by LaTeX, with names that it would trip over."""

import re
import shutil
import subprocess

import chebclear as cc
import matplotlib as mpl
import pytest
from chebclear.plots.labels import typeset
from matplotlib.figure import Figure

# What matplotlib's preamble asks for besides LaTeX itself.
_NEEDED = ("type1ec.sty", "underscore.sty", "geometry.sty")


def has_latex() -> bool:
    """Whether LaTeX is here with what matplotlib needs of it."""
    if any(shutil.which(program) is None for program in ("latex", "dvipng", "kpsewhich")):
        return False
    found = [subprocess.run(["kpsewhich", name], capture_output=True, check=False) for name in _NEEDED]
    return all(done.stdout for done in found)


pytestmark = [
    pytest.mark.skipif(not has_latex(), reason="there is no LaTeX, or not all that matplotlib needs of it"),
    pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning"),
]

NAMES = {
    "crank": "crank_50%",
    "rod": "\u00b5_rod\u00b2",
    "slider": "slider#1 & Co",
    "wrist": "wrist_\u00b15\u00b0",
    "crank_pin": "pin^~{a}",
    "guide": "guide$",
    "drive": "drive<\u03a9>",
}
SLIDER, WRIST = NAMES["slider"], NAMES["wrist"]
FEATURE = "peak_50 % \u00b5\u00b2"


def scene(**parameters):
    """A slider-crank with awkward names."""
    text = cc.mechanisms.slider_crank(**parameters).to_json()
    for name, awkward in NAMES.items():
        text = re.sub(rf'"{name}(?=["\\.])', lambda _, word=awkward: f'"{word}', text)
    return cc.Scene.from_json(text)


def pictures():
    run, name = cc.simulate(scene(crank_angle=0.9), duration=0.03, samples=361), f"{SLIDER}.vx"
    side = {"rod_length": cc.Interval.around(0.12, rel=0.01)}
    features = {FEATURE: cc.features.peak(f"{WRIST}.normal_force")}
    result = cc.Study(scene, side, [name], features=features, duration=0.003, samples=31).band(runs=16)
    yield lambda ax: cc.plots.plot_scene(run, 0.01, exaggerate=100.0, ax=ax)
    yield lambda ax: cc.plots.plot_trajectory(run, [name, NAMES["rod"] + ".vx"], ax=ax)
    yield lambda ax: cc.plots.plot_trajectory(run, name, label="50 % of \u00b5_s\u00b2", ax=ax)
    yield lambda ax: cc.plots.plot_orbit(run, WRIST, ax=ax)
    yield lambda ax: cc.plots.plot_contacts(run, ax=ax)
    yield lambda ax: cc.plots.plot_band(result[name], runs=3, ax=ax)
    yield lambda ax: cc.plots.plot_tornado(result.features[FEATURE], ax=ax)
    yield lambda ax: cc.plots.plot_ranking(result.ranking(FEATURE), ax=ax)


def texts(figure):
    return [text.get_text() for text in figure.findobj(mpl.text.Text) if text.get_text()]


def test_pictures_can_be_set_by_latex(tmp_path):
    """All labels of all pictures in one document: a process of LaTeX for each takes a minute."""
    found = set()
    with cc.plots.print_style(latex=True):
        for draw in pictures():
            figure = Figure(layout="constrained")
            draw(figure.subplots())
            found |= {text for text in texts(figure) if not re.fullmatch(r"[\d.eE+-]*", text)}
    assert len(found) > 20 and any(r"slider\#1 \& Co" in text for text in found)
    with cc.plots.print_style(latex=True):
        page = Figure(figsize=(20.0, 0.25 * len(found)))
        page.text(0.01, 0.5, "\n".join(sorted(found)))
        page.savefig(tmp_path / "labels.pdf")
    assert (tmp_path / "labels.pdf").read_bytes().startswith(b"%PDF")


def test_letters_of_any_script_reach_latex(tmp_path):
    with mpl.rc_context({"text.usetex": True}):
        text = typeset(
            "a$b {c} ~^ \u03b1\u03c2\u039b\u039c\u03bf \u00e4\u00e9\u0142 \u65e5 x\u22653 5\u00b0\u00b12 %"
        )
        assert text.startswith(r"a$\$$b \{c\} ") and "?" in text
        page = Figure()
        page.text(0.1, 0.5, text)
        page.savefig(tmp_path / "letters.pdf")
