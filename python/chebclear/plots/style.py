"""Pictures for print: sizes of columns, small type, vector files, labels set by LaTeX."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal

from ..base.arguments import Checks
from ..errors import MissingProgramError

# Widths of one and of two columns of a journal [inch]: 89 and 183 mm.
_WIDTHS = {1: 3.5, 2: 7.2}
# Height of a picture over its width, and the tallest one that a page holds [inch].
_PROPORTION, _TALLEST = 0.7, 4.0
_FORMATS = ("pdf", "svg", "eps", "png")


@contextmanager
def print_style(
    columns: Literal[1, 2] = 1,
    *,
    format: Literal["pdf", "svg", "eps", "png"] = "pdf",
    font_size: float = 8.0,
    latex: bool = False,
) -> Iterator[None]:
    """Make the figures drawn within for print: ``with cc.plots.print_style(): run.plot("slider.x")``.

    Figures are as wide as one or two columns of a journal, with small type and thin axes, and a file saved
    without an ending gets that of `format`. Save them within as well. Outside nothing changes.

    Parameters
    ----------
    columns : {1, 2}
        Width of the figures: 3.5 or 7.2 inch (89 or 183 mm).
    format : {"pdf", "svg", "eps", "png"}
        What ``figure.savefig("name")`` writes; a PNG has 600 dots an inch. Text stays text in PDF and EPS.
    font_size : float
        Size of the type [points].
    latex : bool
        Have all labels set by LaTeX, which must be installed.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong.
    MissingProgramError
        If LaTeX is asked for and not installed.

    Examples
    --------
    >>> from chebclear import mechanisms
    >>> from chebclear.plots import plot_scene
    >>> with print_style(columns=1):
    ...     ax = plot_scene(mechanisms.four_bar())
    >>> ax.figure.get_size_inches().round(6).tolist()
    [3.5, 2.45]
    """
    import matplotlib as mpl

    checks = Checks()
    if columns not in _WIDTHS:
        checks.add("columns", f"must be 1 or 2, got {columns!r}")
    checks.word("format", format, _FORMATS)
    points = checks.real("font_size", font_size, "pt", above=0.0)
    checks.finish()
    if latex and shutil.which("latex") is None:
        raise MissingProgramError(
            "latex=True needs LaTeX, and there is no latex on the path: install it, or leave it out"
        )
    width = _WIDTHS[columns]
    style: dict[Any, Any] = {
        "figure.figsize": (width, min(_PROPORTION * width, _TALLEST)),
        "figure.dpi": 200.0,
        "font.size": points,
        "axes.linewidth": 0.6,
        "xtick.major.width": 0.6,
        "ytick.major.width": 0.6,
        "xtick.minor.width": 0.4,
        "ytick.minor.width": 0.4,
        "legend.framealpha": 1.0,
        "legend.fancybox": False,
        "savefig.format": format,
        "savefig.dpi": 600.0,
        # Text stays text, as journals require.
        "pdf.fonttype": 42,
        "ps.fonttype": 42,
        "text.usetex": latex,
    }
    with mpl.rc_context(style):
        yield
