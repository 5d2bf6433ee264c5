"""What the code of a page prints and draws, made when the documentation is built and put behind each block.

Pages hold code alone, which the tests run. A block that prints gets its output, one that draws its pictures,
so that no answer on a page can be out of date.
"""

import contextlib
import io
import logging
import os
import re
import tempfile
import warnings
from pathlib import Path

import chebclear as cc
import matplotlib
from gallery import notebook

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"^```python\n(.*?)^```\n", re.DOTALL | re.MULTILINE)
# Pages that answer; on the others code shows how something is written.
PAGES = re.compile(r"tutorial/\w+|pictures|questions/\w+")
# Lines of an answer: the paper of a page is no terminal.
MOST_LINES = 40


def answered(text: str, page: str, folder: Path) -> str:
    """The text of a page with the answers of its blocks, whose pictures go into the folder.

    Blocks of a page build on each other. Warnings are left out, as a page tells them where they matter.
    """
    # Figures of pyplot are found again by their numbers.
    matplotlib.use("Agg")
    from matplotlib import pyplot

    logging.getLogger("fontTools").setLevel(logging.WARNING)  # tells of every table of a font in a PDF
    folder.mkdir(parents=True, exist_ok=True)
    names: dict[str, object] = {"__name__": page}
    pictures = 0

    def with_answer(found: re.Match[str]) -> str:
        nonlocal pictures
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(io.StringIO()):
            exec(compile(found[1], f"{page}.md", "exec"), names)
        answer = found[0]
        lines = printed.getvalue().rstrip().split("\n")
        if lines != [""]:
            kept = lines[:MOST_LINES] + ["..."] * (len(lines) > MOST_LINES)
            answer += "\n```text\n" + "\n".join(kept) + "\n```\n"
        for number in pyplot.get_fignums():
            pictures += 1
            name = f"{page.replace('/', '_')}_{pictures}.png"
            figure = pyplot.figure(number)
            figure.savefig(folder / name, dpi=110, metadata={"Software": None})
            answer += f"\n```{{image}} /_generated/answers/{name}\n:alt: {alternative(figure)}\n```\n"
            pyplot.close(figure)
        return answer

    here = Path.cwd()
    with tempfile.TemporaryDirectory() as work, warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        Path(work, "examples").symlink_to(ROOT / "examples")
        os.chdir(work)
        try:
            with matplotlib.rc_context({"font.size": 9.0, "figure.figsize": (6.4, 3.4)}):
                return BLOCK.sub(with_answer, text)
        finally:
            os.chdir(here)
            pyplot.close("all")


def alternative(figure: object) -> str:
    """What a picture shows, for those who do not see it: the labels of its axes."""
    told = []
    for ax in figure.axes:
        x, y = (" ".join(text.split()) for text in (ax.get_xlabel(), ax.get_ylabel()))
        told += [f"{y} against {x}" if x and y else x or y]
    return "; ".join(filter(None, told)) or "drawing of the mechanism"


def setup(app):
    """Answers are put in while a page is read."""

    def read(app, page, source):
        if PAGES.fullmatch(page):
            made = Path(app.srcdir) / "_generated"
            text = notebook(page, source[0], made / "notebooks")
            source[0] = answered(text, page, made / "answers")

    app.connect("source-read", read)
    return {"parallel_read_safe": False}
