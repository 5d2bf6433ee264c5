"""A report as one HTML file that needs no network and runs no scripts."""

from __future__ import annotations

import base64
import os
import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.writing import file_names, replaced, with_default_suffix
from ..errors import ArgumentError
from .document import Block, Document, Items, Listing, Picture, Section, Table, Text, Verdict
from .markup import templates_of
from .pictures import embedded

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

_KINDS = {Text: "text", Items: "items", Table: "table", Picture: "picture", Listing: "listing"}


def as_html(document: Document, pictures: Path | None = None) -> str:
    """The text of the file.

    Parameters
    ----------
    document : Document
        What it says. All its texts are escaped.
    pictures : Path, optional
        Folder that gets each picture with a name as a file of pixels too.

    Returns
    -------
    str
    """
    environment = _environment()
    environment.globals["anchor"] = partial(_anchor, list(document.sections))
    environment.filters["embedded"] = partial(embedded, files=_files(document, pictures))
    return environment.get_template("report.html.j2").render(document=document)


def fragment(title: str, blocks: Sequence[Block]) -> str:
    """Some blocks as a part of another page, such as a notebook: no style, no scripts.

    Parameters
    ----------
    title : str
        A line above them; may be empty.
    blocks : sequence of Block
        What to show. All texts are escaped.

    Returns
    -------
    str
    """
    return _environment().get_template("fragment.html.j2").render(title=title, blocks=blocks)


def _environment() -> Environment:
    """The templates of this room, and what they may call."""
    environment = templates_of("chebclear.report")
    environment.filters.update(embedded=embedded, download=_download, kind=_kind, breakable=_breakable)
    environment.tests.update(verdict=_is_verdict)
    return environment


def write(document: Document, path: str | os.PathLike[str], pictures: Path | None = None) -> Path:
    """Write a report; an existing file is replaced, as a whole or not at all.

    Parameters
    ----------
    document : Document
        What it says.
    path : path
        Where to; ``.html`` is appended if there is no suffix.
    pictures : Path, optional
        Folder that gets each picture with a name as a file of pixels too, ``NAME.png``.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    ValueError
        If the file has another suffix.
    """
    path = with_default_suffix(path, ".html")
    if path.suffix.lower() not in (".html", ".htm"):
        raise ArgumentError(
            f"path must end in .html, a report is a page of a browser, got {os.fspath(path)!r}"
        )
    text = as_html(document, pictures)
    with replaced(path) as beside:
        beside.write_text(text, encoding="utf-8")
    return path


def _files(document: Document, folder: Path | None) -> dict[str, Path]:
    """The file of each picture that has a name."""
    if folder is None:
        return {}
    blocks = [block for section in document.sections for block in section.blocks]
    names = [block.name for block in blocks if isinstance(block, Picture) and block.name]
    return {name: folder / f"{file}.png" for name, file in zip(names, file_names(names), strict=True)}


def _download(listing: Listing) -> str:
    return f"data:text/plain;charset=utf-8;base64,{base64.b64encode(listing.text.encode()).decode()}"


def _anchor(sections: list[Section], section: Section) -> str:
    """Address of a section within the page."""
    return f"section-{1 + sections.index(section)}"


def _breakable(name: str) -> Markup:
    """A name that may go on in another line after a point or an underscore; escaped."""
    from markupsafe import Markup, escape

    return Markup(re.sub(r"([._])(?=[^\W\d])", r"\1<wbr>", str(escape(name))))


def _kind(block: Block) -> str:
    return _KINDS[type(block)]


def _is_verdict(cell: object) -> bool:
    return isinstance(cell, Verdict)
