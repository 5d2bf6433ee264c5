"""Labels and legends that are read in full: in words, beside the axes and clear of the data."""

from __future__ import annotations

import textwrap
import unicodedata
from typing import TYPE_CHECKING, Any

import numpy as np

from ..scene.columns import column_unit, column_words, plain_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable

# Width of a letter, as a part of the size of the font: that of a wide text in matplotlib's own font.
_LETTER = 0.6
# The frame of a legend and its distance from the axes [letters].
_LEGEND_FRAME = 2.0
# The line or patch of a legend beside its text, with the gaps [letters].
_LEGEND_HANDLE = 5.0

# Characters that must be escaped for LaTeX.
_LATEX = {
    "\\": r"\textbackslash{}",
    "%": r"\%",
    "_": r"\_",
    "&": r"\&",
    "#": r"\#",
    "$": r"\$",
    "{": r"\{",
    "}": r"\}",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
    "µ": r"$\mu$",
    "²": "$^2$",
    "³": "$^3$",
    "°": r"$^\circ$",
    "±": r"$\pm$",
    "∂": r"$\partial$",
    "·": r"$\cdot$",
    "×": r"$\times$",
    "≤": r"$\leq$",
    "≥": r"$\geq$",
    "<": "$<$",
    ">": "$>$",
    "−": "$-$",
    "–": "--",
}
# Greek letters whose names Unicode and LaTeX spell differently, and capitals that are those of Latin.
_GREEK = {"LAMDA": "lambda", "FINAL SIGMA": "varsigma", "OMICRON": "mathrm{o}"}
_CAPITALS = dict(
    zip(
        "ALPHA BETA EPSILON ZETA ETA IOTA KAPPA MU NU OMICRON RHO TAU CHI".split(),
        "ABEZHIKMNOPTX",
        strict=True,
    )
)


def typeset(text: str) -> str:
    """A label as it is to be given to matplotlib: as LaTeX where ``text.usetex`` is on.

    A text that has formulas between dollars is taken to be LaTeX already.
    """
    import matplotlib as mpl

    if not mpl.rcParams["text.usetex"] or (text.count("$") >= 2 and text.count("$") % 2 == 0):
        return text
    return "".join(_latex(letter) for letter in text)


def _latex(letter: str) -> str:
    """One letter for LaTeX; a question mark for one of a script that it does not have."""
    if letter in _LATEX or letter.isascii():
        return _LATEX.get(letter, letter)
    kind, found, name = unicodedata.name(letter, "").partition(" LETTER ")
    if kind == "GREEK CAPITAL" and name in _CAPITALS:
        return _CAPITALS[name]
    if kind in ("GREEK CAPITAL", "GREEK SMALL") and " WITH " not in name:
        word = _GREEK.get(name, name.lower())
        return f"${chr(92)}{word.capitalize() if kind == 'GREEK CAPITAL' else word}$"
    # LaTeX reads the accented letters of western Europe as they are.
    return letter if found and kind.startswith("LATIN") and ord(letter) < 0x180 else "?"


def with_unit(name: str, unit: str) -> str:
    """A name and its unit in brackets; either may be empty."""
    return " ".join(part for part in (name, f"[{unit}]" if unit else "") if part)


def words_of(name: str, unit: str) -> str:
    """What an output is, in words.

    The names of a model of the user's own may mean anything: only an output in the unit of a column of that
    name is one.

    Examples
    --------
    >>> words_of("slider.vx", "m/s"), words_of("engine.power", "kW"), words_of("x", "")
    ('x velocity of slider', 'engine power', 'x')
    """
    return column_words(name) if unit and unit == column_unit(name) else plain_words(name)


def words_in_common(names: list[str]) -> str:
    """The quantity that several columns share, in words, without its owner; empty if they differ.

    Examples
    --------
    >>> words_in_common(["slider.vx", "rod.vx"]), words_in_common(["slider.vx", "rod.vy"])
    ('x velocity', '')
    """
    words = [column_words(name) for name in names]
    if len(words) == 1:
        return words[0]
    quantities = {text.rpartition(" of ")[0] or text.rpartition(" in ")[0] for text in words}
    return quantities.pop() if len(quantities) == 1 else ""


def set_x_label(ax: Axes, text: str, share: float = 0.8) -> None:
    """A label below the axes, in as many lines as it needs to be no wider than a share of the figure."""
    label = ax.set_xlabel("")
    # Beside other axes a label has the width of its own and of their numbers.
    figure = ax.figure
    alone = share * figure.bbox.width / figure.dpi * 72.0
    width = 1.15 * size_of(ax)[0] if len(figure.axes) > 1 else alone
    label.set_text(_in_lines(text, width, float(label.get_fontsize())))


def set_y_label(ax: Axes, text: str) -> None:
    """A label beside the axes, in as many lines as the height needs."""
    label = ax.set_ylabel("")
    # Beside other axes a label has the height of its own, alone that of the figure.
    figure = ax.figure
    height = size_of(ax)[1] if len(figure.axes) > 1 else figure.bbox.height / figure.dpi * 72.0
    label.set_text(_in_lines(text, height, float(label.get_fontsize())))


def add_color_bar(ax: Axes, shades: ScalarMappable, text: str, **bar: Any) -> None:
    """A color bar beside the axes, with a label in as many lines as their height needs."""
    size = float(ax.yaxis.label.get_fontsize())
    ax.figure.colorbar(shades, ax=ax, label=_in_lines(text, size_of(ax)[1], size), **bar)


def _in_lines(text: str, length: float, size: float) -> str:
    """A text in lines that a length [points] holds at a size of the font [points]."""
    width = max(8, int(length / (_LETTER * size)))
    return typeset(textwrap.fill(text, width, break_long_words=False, break_on_hyphens=False))


def legend_above_the_data(ax: Axes, title: str | None = None) -> None:
    """A legend in the upper part of the axes, whose limits leave it room above all that is drawn.

    Where the user has set the limits it goes to where it covers least.
    """
    handles, labels = ax.get_legend_handles_labels()
    if not labels:
        return
    height = size_of(ax)[1]
    legend = ax.legend(handles, list(map(typeset, labels)), title=title, loc="upper center", fontsize="small")
    font = float(legend.get_texts()[0].get_fontsize())
    columns = legend_columns(ax, labels)
    # Alone in its row an entry is as wide as the axes at most.
    wide = size_of(ax)[0] - (_LEGEND_HANDLE * _LETTER + _LEGEND_FRAME) * font
    texts = [_in_lines(label, wide, font) if columns == 1 else typeset(label) for label in labels]
    limits = _drawn_limits(ax)
    free = ax.get_autoscaley_on() and limits is not None
    legend = ax.legend(
        handles,
        texts,
        title=title,
        title_fontsize="small",
        loc="upper center" if free else "best",
        ncols=columns,
        fontsize="small",
    )
    if free and limits is not None:
        tall = legend.get_window_extent().height / ax.figure.dpi * 72.0
        share = min(0.6, (tall + font) / height)
        scale = ax.yaxis.get_transform()
        low, high = scale.transform(np.array(limits))
        top = float(scale.inverted().transform(np.array([low + (high - low) / (1.0 - share)]))[0])
        # No fixed limits: they would prevent equal scales and hide what is drawn later.
        ax.update_datalim([(0.0, top)], updatex=False)
        ax.autoscale_view()


def legend_columns(ax: Axes, labels: list[str]) -> int:
    """How many entries of a legend of small type fit beside each other [-]."""
    # Small type is a sixth smaller than that of the labels.
    font = float(ax.xaxis.label.get_fontsize()) / 1.2
    longest = max(map(len, labels)) * _LETTER + _LEGEND_HANDLE
    return max(1, min(len(labels), int(size_of(ax)[0] / (font * longest))))


def _drawn_limits(ax: Axes) -> tuple[float, float] | None:
    """Lowest and highest ordinate of all that is drawn, or None if there is no such range."""
    ends: list[float] = []
    for line in ax.lines:
        if line.get_transform().contains_branch_seperately(ax.transData)[1]:
            ends += list(np.asarray(line.get_ydata(), dtype=float))
    for collection in ax.collections:
        ends += list(collection.get_datalim(ax.transData).intervaly)
    values = np.array(ends)
    values = values[np.isfinite(values)]
    if ax.get_yscale() == "log":
        values = values[values > 0.0]
    if not len(values) or not values.min() < values.max():
        return None
    return float(values.min()), float(values.max())


def size_of(ax: Axes) -> tuple[float, float]:
    """Width and height of the axes [points]."""
    box = ax.get_window_extent()
    return float(box.width / ax.figure.dpi * 72.0), float(box.height / ax.figure.dpi * 72.0)
