"""Labels and legends that are read in full: in words, beside the axes and clear of the data."""

from __future__ import annotations

import itertools
import textwrap
import unicodedata
import warnings
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..scene.columns import column_quantity, column_unit, column_words, plain_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.cm import ScalarMappable

# The frame of a legend and its distance from the axes, and the line or patch beside a text of it with the
# gaps, as parts of the size of the font.
_LEGEND_FRAME, _LEGEND_HANDLE = 2.0, 4.8
# What names of rows take of the width of their axes at most, before there are any names, and the size of
# their type: the first of these that the height holds. And the height of a line over the size of its type.
_ROW_NAMES, _LINE = ((0.4, 1.0), (0.4, 0.85), (0.4, 0.7), (0.55, 0.7)), 1.4
# Least gap between the numbers of an axis, as a part of the size of the font.
_GAP = 0.7
# Small type is smaller than that of the labels by this factor.
_SMALLER = 1.2
# How often room for a legend is asked for where scales are equal.
_ROUNDS = 4
_NO_BREAK = "\u00a0"

# Characters that must be escaped for LaTeX.
_LATEX = {
    "\\": r"\textbackslash{}",
    "%": r"\%",
    "_": r"\_",
    "&": r"\&",
    "#": r"\#",
    # In a formula: the dollar of the text is in a font that small installations do not have.
    "$": r"$\$$",
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

    A text that has formulas between dollars is taken to be LaTeX already. Names may hold anything: a dollar
    that begins no formula is a letter.
    """
    import matplotlib as mpl

    if "$" in text and all(map(_has_formulas, text.split("\n"))):
        return text
    if mpl.rcParams["text.usetex"]:
        return "".join(_latex(letter) for letter in text)
    return text.replace("$", r"\$")


def _has_formulas(line: str) -> bool:
    """Whether matplotlib, which looks at each line for itself, reads a line as a text with formulas."""
    from matplotlib.mathtext import MathTextParser

    if line.count("$") % 2:
        return False
    try:
        MathTextParser("path").parse(line)
    except ValueError:
        return False
    return True


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
    """The quantity that several columns share, in words, without its owner; empty if they share none.

    Examples
    --------
    >>> words_in_common(["slider.vx", "rod.vx"]), words_in_common(["slider.vx", "rod.vy"])
    ('x velocity', 'velocity')
    """
    if len(names) == 1:
        return column_words(names[0])
    quantities = [column_quantity(name).split() for name in names]
    common: list[str] = []
    for ends in zip(*(reversed(quantity) for quantity in quantities), strict=False):
        if len(set(ends)) > 1:
            break
        common.insert(0, ends[0])
    return " ".join(common)


def text_width(text: str, size: float) -> float:
    """Width of a text of one line in matplotlib's own font at a size of it [points]."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    return float(text_to_path.get_text_width_height_descent(text, FontProperties(size=size), False)[0])


def lay_out(ax: Axes) -> None:
    """Give axes the place that the layout of their figure will leave them, as far as they are drawn.

    Not where LaTeX sets the labels: it would be called for each of them, each time.
    """
    import matplotlib as mpl

    if mpl.rcParams["text.usetex"]:
        return
    figure = ax.figure.figure
    engine = figure.get_layout_engine() if figure is not None else None
    if engine is not None:
        with warnings.catch_warnings():
            # It warns when the figure is drawn, if it still has to.
            warnings.simplefilter("ignore")
            engine.execute(figure)


def set_labels(ax: Axes, x: str, y: str) -> None:
    """Labels of both axes, in as many lines as they need; then numbers below that do not touch."""
    set_y_label(ax, y)
    set_x_label(ax, x)


def set_x_label(ax: Axes, text: str) -> None:
    """A label below the axes, in as many lines as it needs to be no wider; and numbers that do not touch."""
    label = ax.set_xlabel("")
    label.set_text(in_lines(text, size_of(ax)[0], float(label.get_fontsize())))
    _part_numbers(ax)


def _part_numbers(ax: Axes) -> None:
    """Fewer numbers below the axes where they would touch."""
    import matplotlib as mpl
    from matplotlib.ticker import AutoLocator

    if mpl.rcParams["text.usetex"] or not isinstance(ax.xaxis.get_major_locator(), AutoLocator):
        return
    for count in (8, 6, 5, 4, 3, 2):
        low, high = sorted(ax.get_xlim())
        texts = ax.xaxis.get_majorticklabels()
        shown = [text for text in texts if low <= text.get_position()[0] <= high and text.get_text()]
        boxes = sorted((box.x0, box.x1) for box in (text.get_window_extent() for text in shown))
        gap = _GAP * (float(shown[0].get_fontsize()) if shown else 0.0) / 72.0 * ax.figure.dpi
        if all(left[1] + gap <= right[0] for left, right in itertools.pairwise(boxes)):
            return
        ax.locator_params(axis="x", nbins=count)


def plain_numbers(axis: Axis) -> None:
    """Plain numbers on a logarithmic axis that may span less than a decade: 6 and 20, not 2 x 10^1.

    Where they span more than five decades the axis keeps powers of ten.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = sorted(axis.get_view_interval())
    if high > 1e5 * low:
        return
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def set_y_label(ax: Axes, text: str) -> None:
    """A label beside the axes, in as many lines as the height needs."""
    label = ax.set_ylabel("")
    figure, size = ax.figure, float(label.get_fontsize())
    # Beside other axes a label has the height of its own, alone that of the figure: it is centered on the
    # axes, which stand above what is written below them.
    alone = figure.bbox.height / figure.dpi * 72.0 - 5.0 * size
    label.set_text(in_lines(text, size_of(ax)[1] - size if len(figure.axes) > 1 else alone, size))


def set_row_names(ax: Axes, names: Sequence[str]) -> None:
    """Names of rows from the top down, in as many lines as they need to leave room for what the rows show."""
    (width, height), size = size_of(ax), float(ax.xaxis.label.get_fontsize())
    for share, scale in _ROW_NAMES:
        texts = [in_lines(name, share * width, scale * size) for name in names]
        lines = max((text.count("\n") + 1 for text in texts), default=1)
        if _LINE * scale * size * lines * len(texts) < height:
            break
    ax.set_yticks(range(len(names)), texts, fontsize=scale * size)
    ax.set_ylim(len(names) - 0.4, -0.6)
    lay_out(ax)


def add_color_bar(ax: Axes, shades: ScalarMappable, text: str, **bar: Any) -> None:
    """A color bar beside the axes, with a label in as many lines as their height needs."""
    size = float(ax.yaxis.label.get_fontsize())
    ax.figure.colorbar(shades, ax=ax, label=in_lines(text, size_of(ax)[1], size), **bar)
    lay_out(ax)


def in_lines(text: str, length: float, size: float) -> str:
    """A text in lines that a length [points] holds at a size of the font [points], typeset."""
    width = text_width(text, size)
    # A unit stays in one line.
    name, bracket, unit = text.rpartition(" [")
    if bracket and text.endswith("]") and text_width(bracket + unit, size) < length:
        text = f"{name} [{unit.replace(' ', _NO_BREAK)}"
    letters, lines = len(text), [text]
    while letters > 8 and max(text_width(line, size) for line in lines) > length:
        # Lines of wide letters are longer than the mean: then shorter ones.
        letters = max(8, min(letters - 1, int(len(text) * length / width)))
        lines = textwrap.wrap(text, letters, break_long_words=False, break_on_hyphens=False) or [""]
    text = "\n".join(lines)
    return typeset(text.replace(_NO_BREAK, " "))


def legend_above_the_data(ax: Axes, title: str | None = None, shown: Mapping[str, str] | None = None) -> None:
    """A legend in the upper part of the axes, whose limits leave it room above all that is drawn.

    Where the user has set the limits it goes to where it covers least. `shown` has shorter words for labels.
    """
    handles, labels = ax.get_legend_handles_labels()
    if not labels:
        return
    texts = [(shown or {}).get(label, label) for label in labels]
    before = ax.get_legend()
    if before is not None:
        before.remove()
    font = float(ax.xaxis.label.get_fontsize()) / _SMALLER
    columns = legend_columns(ax, texts)
    if columns < len(texts):  # every point counts
        lay_out(ax)
        columns = legend_columns(ax, texts)
    height = size_of(ax)[1]
    # Alone in its row an entry is as wide as the axes at most.
    wide = size_of(ax)[0] - (_LEGEND_HANDLE + _LEGEND_FRAME) * font
    limits = _drawn_limits(ax)
    free = ax.get_autoscaley_on() and limits is not None
    legend = ax.legend(
        handles,
        [in_lines(text, wide, font) if columns == 1 else typeset(text) for text in texts],
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
        # With equal scales the limits give more than the share, or less: then once more.
        for _ in range(_ROUNDS):
            top = float(scale.inverted().transform(np.array([low + (high - low) / (1.0 - share)]))[0])
            # No fixed limits: they would prevent equal scales and hide what is drawn later.
            ax.update_datalim([(0.0, top)], updatex=False)
            ax.autoscale_view()
            ax.apply_aspect()
            covered = ax.transData.transform((0.0, limits[1]))[1] - legend.get_window_extent().y0
            if covered < 0.0:
                break
            share = min(0.8, share + covered / ax.get_window_extent().height + 0.02)


def legends_above(ax: Axes, title: str | None = None, guides: tuple[str, ...] = ()) -> None:
    """Legends above the axes, where they can cover no point: one of lines, one of guides below it."""
    from matplotlib.transforms import ScaledTranslation

    style: dict[str, Any] = {
        "fontsize": "small",
        "frameon": False,
        "title_fontsize": "small",
        "loc": "lower center",
        "borderaxespad": 0.0,
    }
    entries = list(zip(*ax.get_legend_handles_labels(), strict=True))
    lines = [entry for entry in entries if not entry[1].startswith(guides or ("\n",))]
    gap = 3.0  # [points]
    for group in ([entry for entry in entries if entry not in lines], lines):
        if not group:
            continue
        labels = [label for _, label in group]
        anchor = ax.transAxes + ScaledTranslation(0.0, gap / 72.0, ax.figure.dpi_scale_trans)
        legend = ax.legend(
            [handle for handle, _ in group],
            list(map(typeset, labels)),
            title=title,
            ncols=legend_columns(ax, labels),
            bbox_to_anchor=(0.5, 1.0),
            bbox_transform=anchor,
            **style,
        )
        gap += legend.get_window_extent().height / ax.figure.dpi * 72.0
        if group is not lines:
            ax.add_artist(legend)


def legend_columns(ax: Axes, labels: Sequence[str]) -> int:
    """How many columns of a legend of small type fit into the width of the axes [-]."""
    font = float(ax.xaxis.label.get_fontsize()) / _SMALLER
    room = size_of(ax)[0] / font - _LEGEND_FRAME
    widths = np.array([text_width(label, font) / font + _LEGEND_HANDLE for label in labels])
    for columns in range(len(labels), 1, -1):
        # Each column is as wide as its widest entry.
        if sum(float(part.max()) for part in np.array_split(widths, columns)) <= room:
            return columns
    return 1


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
