"""A report or a film as one HTML file that needs no network; its only script is the player of films.

Names of a scene come from files of strangers: only templates, which escape them, make markup of text.
"""

from __future__ import annotations

import base64
import hashlib
import io
import os
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import partial
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from ..base.shown import Shown
from ..base.writing import distinct, file_name, replaced, with_default_suffix
from ..errors import ArgumentError
from .document import Block, Document, Listing, Moving, Picture, Table, Verdict
from .film import Film, player

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup
    from matplotlib.figure import Figure

    _Path = Path
else:
    _Path = type(Path())  # Python 3.11 derives only from the kind of path of its system

WIDTH = 4.5
"""Width of a picture [in]: wider ones cannot be read on a telephone."""

_RESOLUTION = 200

_STYLE: dict[Any, Any] = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.grid": True,
    "grid.alpha": 0.3,
}
_NO_FILES: Mapping[str, Path] = MappingProxyType({})

# The space between a number and its unit.
_UNIT = re.compile(r"(?<=\d) (?=(?:%|[a-zA-Zµ]{1,3}(?:/[a-z]+)?[²³]?)(?:[\s.,;:)]|$))")

# Plays every film of a page.
_START = """
for (const one of document.querySelectorAll(".player")) {
  playFilm(one, JSON.parse(one.firstElementChild.textContent));
}
"""


class ReportFile(_Path):
    """The path of a report, which notebooks show as the report itself."""

    def _repr_html_(self) -> str:
        return framed(self.read_text(encoding="utf-8"), self.name)


class Tabled(Shown, ABC):
    """Base of results with a table, which notebooks show below the `repr`."""

    @property
    @abstractmethod
    def table(self) -> Table:
        """The rows that a report and notebooks show."""

    def _repr_html_(self) -> str:
        return fragment(repr(self)[1:-1], [self.table])


class Reported(ABC):
    """Base of results that have a report."""

    @abstractmethod
    def _document(self, title: str | None) -> Document:
        """What the report says."""

    def report(self, path: str | os.PathLike[str], *, title: str | None = None) -> Path:
        """Write a report: one HTML file that needs no network.

        Parameters
        ----------
        path : path
            The file; ``.html`` is appended if there is no suffix. An existing file is replaced.
        title : str, optional
            The heading: the question in words.

        Returns
        -------
        Path
            The file written.
        """
        return write(self._document(title), path)


def as_html(document: Document, pictures: Path | None = None) -> str:
    """The text of the file, all escaped. Pictures with a name become files of a folder too."""
    environment = _environment()
    sections = list(document.sections)
    environment.globals["anchor"] = lambda section: f"section-{1 + sections.index(section)}"
    environment.filters["embedded"] = partial(embedded, files=_files(document, pictures))
    moves = any(isinstance(block, Moving) for block in document.first)
    return environment.get_template("report.html.j2").render(document=document, moves=moves, **_parts(moves))


def film_page(film: Film, note: str) -> str:
    """A film as a page of its own, with a note below it; both are escaped."""
    return _environment().get_template("film.html.j2").render(film=film, note=note, **_parts(True))


def framed(page: str, title: str) -> str:
    """A page within another one, such as a notebook, whose scripts cannot reach that."""
    from markupsafe import Markup

    frame = '<iframe title="{}" srcdoc="{}" sandbox="allow-scripts allow-downloads" style="{}"></iframe>'
    return Markup(frame).format(title, page, "width: 100%; height: 36rem; border: 0")


def page_with_player(package: str, template: str, script: str) -> str:
    """A page with the player and a script of its own, both from files of a package.

    Its template gets the policy, the style of the player, and the scripts as one.
    """
    own = files(package).joinpath(script).read_text(encoding="utf-8")
    return templates_of(package).get_template(template).render(**_parts(True, own))


def _parts(moves: bool, own: str = _START) -> dict[str, str]:
    """The policy of a page, and style and script of the player if there is a film on it."""
    from markupsafe import Markup

    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    if not moves:
        return {"policy": policy}
    script = player("js") + own
    # No other script runs, whatever a name of the scene may hold.
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy += f"; script-src 'sha256-{digest}'"
    return {"policy": policy, "script": Markup(script), "style": Markup(player("css"))}


def fragment(title: str, blocks: Sequence[Block]) -> str:
    """Some blocks, below a line, for another page, such as a notebook; escaped, no style, no scripts."""
    return _environment().get_template("fragment.html.j2").render(title=title, blocks=blocks)


def _environment() -> Environment:
    """The templates of this room, and what they may call."""
    environment = templates_of("chebclear.report")
    environment.filters.update(embedded=embedded, download=_download, breakable=_breakable)
    environment.filters["together"] = _together
    environment.filters["kind"] = lambda block: type(block).__name__
    environment.tests["verdict"] = lambda cell: isinstance(cell, Verdict)
    return environment


def write(document: Document, path: str | os.PathLike[str], pictures: Path | None = None) -> Path:
    """Write a report to a file, ``.html`` if it has no suffix, as a whole or not at all.

    Pictures with a name become files of a folder too, ``NAME.png``. An ArgumentError for another suffix.
    """
    path = with_default_suffix(path, ".html")
    if path.suffix.lower() not in (".html", ".htm"):
        raise ArgumentError(
            f"path must end in .html, a report is a page of a browser, got {os.fspath(path)!r}"
        )
    text = as_html(document, pictures)
    with replaced(path) as beside:
        beside.write_text(text, encoding="utf-8")
    return ReportFile(path)


def _files(document: Document, folder: Path | None) -> dict[str, Path]:
    """The file of each picture that has a name."""
    if folder is None:
        return {}
    blocks = [block for section in document.sections for block in section.blocks]
    names = [block.name for block in blocks if isinstance(block, Picture) and block.name]
    return {name: folder / f"{file}.png" for name, file in distinct(names, file_name, str.lower).items()}


def _download(listing: Listing) -> str:
    return f"data:text/plain;charset=utf-8;base64,{base64.b64encode(listing.text.encode()).decode()}"


def _breakable(name: str) -> Markup:
    """A name that may go on in another line after a point or an underscore; escaped."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"([._])(?=[^\W\d])", r"\1<wbr>", str(escape(name))))


def _together(sentence: str) -> str:
    """A sentence whose numbers stay in one line with their units."""
    return _UNIT.sub("\N{NO-BREAK SPACE}", sentence)


def templates_of(package: str) -> Environment:
    """The templates that stand in a package; all that they are given is escaped."""
    # Here, so that importing the package does not take its 40 ms.
    from jinja2 import Environment, PackageLoader, StrictUndefined

    # Jinja escapes nothing unless told; a name that the template does not know is a mistake, not a blank.
    return Environment(
        loader=PackageLoader(package, "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def embedded(picture: Picture, files: Mapping[str, Path] = _NO_FILES) -> str:
    """A picture as the ``data:`` address of an ``<img>``, and as a file where it has one.

    As pixels, which are drawn once for both: many lines are six times as large as paths, few as large.
    """
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=(WIDTH, picture.height), layout="constrained")
        picture.draw(ax=figure.add_subplot())
        content = png(figure, _RESOLUTION)
    if picture.name in files:
        files[picture.name].write_bytes(content)
    return f"data:image/png;base64,{base64.b64encode(content).decode()}"


def png(figure: Figure, resolution: float) -> bytes:
    """A figure as pixels, so many to an inch. `Figure.savefig` would draw it twice."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    content = io.BytesIO()
    figure.set_dpi(resolution)
    canvas: Any = FigureCanvasAgg(figure)
    canvas.print_png(content, metadata={"Software": None})
    return content.getvalue()
