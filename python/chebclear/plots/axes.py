"""What all plots share: checks of what they draw, new axes, keywords of lines, units to show.

Results offer plots as methods, so plots import results for types only.
"""

from __future__ import annotations

import functools
import inspect
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Literal, ParamSpec

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.named import is_pattern, matching
from ..base.prefixes import unit_shown
from ..base.units import UnitError, convert
from ..errors import ArgumentError, ArgumentTypeError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..run.trajectory import Trajectory

Array = NDArray[np.float64]

# Paul Tol's bright scheme, whose colors color-blind readers can distinguish, not by hue alone.
COLORS = ("#4477AA", "#EE6677", "#228833", "#CCBB44", "#AA3377", "#66CCEE")
MARKERS = "osD^vP*X"
MOST_VECTORS = 4000
"""What has more points than this is drawn as pixels in vector files, which would be larger with paths."""

Given = ParamSpec("Given")

# What parameters of these names are, in all plots; the last ones are keywords for an artist.
_SHARED = {
    "ax": "ax : Axes, optional\n    Where to draw; a new figure if not given.",
    "unit": 'unit : str, optional\n    Unit to show, such as ``"µm"``; as written, or SI, if not given.',
    "x": "x : ndarray, optional\n    Abscissa in place of time or crank angle; goes with `x_label`.",
    "x_label": "x_label : str, optional\n    Label of the abscissa, with its unit.",
} | {
    name: f"**{name}\n    Passed to ``Axes.{artist}``."
    for name, artist in {
        **{"line": "plot", "points": "plot", "steps": "step", "fill": "fill_between"},
        **{"bars": "barh", "bins": "hist", "areas": "stackplot"},
    }.items()
}


def plot_of(*kinds: str) -> Callable[[Callable[Given, Axes]], Callable[Given, Axes]]:
    """Make a function a plot of these classes, or of any, and add to its documentation what plots share."""

    def decorate(plot: Callable[Given, Axes]) -> Callable[Given, Axes]:
        parameters = inspect.signature(plot).parameters
        subject = next(iter(parameters))

        @functools.wraps(plot)
        def checked(*given: Given.args, **keywords: Given.kwargs) -> Axes:
            if kinds and (given or subject in keywords):  # else Python says what is missing
                require(subject, given[0] if given else keywords[subject], *kinds)
            return plot(*given, **keywords)

        if plot.__doc__:  # not where Python drops docstrings
            head, line, rest = inspect.cleandoc(plot.__doc__).partition("----------\n")
            own, _, rest = rest.partition("\n\n")
            said = set(re.findall(r"^\**(\w+)", own, re.MULTILINE))
            shared = [_SHARED[name] for name in parameters if name in _SHARED and name not in said]
            own, stars, artist = own.partition("\n**")
            own = "\n".join([own, *shared]) + stars + artist
            checked.__doc__ = f"{head}{line}{own}\n\nReturns\n-------\nAxes\n\n{rest}"
        return checked

    return decorate


def new_axes(ax: Axes | None) -> Axes:
    """`ax`, or the axes of a new figure: one of pyplot's if pyplot has been imported.

    Lines get colors that color-blind readers can distinguish too, unless the user has chosen a style.
    """
    import matplotlib as mpl
    from cycler import cycler
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    if ax is None:
        if "matplotlib.pyplot" in sys.modules:
            from matplotlib import pyplot

            ax = pyplot.subplots(layout="constrained")[1]
        else:
            ax = Figure(layout="constrained").subplots()
    elif not isinstance(ax, Axes):
        raise ArgumentTypeError(f"ax must be an Axes of matplotlib, got {type(ax).__name__}")
    if not ax.lines and mpl.rcParams["axes.prop_cycle"] == mpl.rcParamsDefault["axes.prop_cycle"]:
        ax.set_prop_cycle(cycler(color=COLORS))
    return ax


def line_style(given: dict[str, Any], **defaults: Any) -> dict[str, Any]:
    """The user's keywords over the defaults; short names such as ``lw`` count as the long ones."""
    from matplotlib.cbook import normalize_kwargs
    from matplotlib.lines import Line2D

    return defaults | normalize_kwargs(given, Line2D)


def unit_scale(si_unit: str, unit: str | None) -> tuple[float, str]:
    """Factor from the SI unit to the unit asked for, and the unit to show; an ArgumentError if it does not
    fit.

    Examples
    --------
    >>> unit_scale("m", "µm")
    (1000000.0, 'µm')
    """
    if unit is None or (isinstance(unit, str) and unit == si_unit):
        return 1.0, si_unit
    if not si_unit:
        raise ArgumentError(
            f"unit={unit!r} needs the unit of the data, which is not known: give it to the study, "
            'units={"NAME": "UNIT"}'
        )
    try:
        asked = convert(f"1 {unit}", si_unit)
        return convert(f"1 {si_unit}", str(unit)) / asked, str(unit)
    except UnitError as error:
        raise ArgumentError(f"unit={unit!r} of data in {si_unit}: {error}") from None


def shown_scale(
    ax: object,
    si_unit: str,
    unit: str | None,
    written: Sequence[str] = (),
    values: ArrayLike = (),
    along: Literal["x", "y"] = "y",
) -> tuple[float, str]:
    """Factor from the SI unit to the one in which values are drawn, and that unit.

    It is the one that was asked for, that of the axes, one that the user has `written`, or the SI unit.

    What is drawn on one axis has one unit: an ArgumentError if another one was asked for, or none fits.
    """
    said = _unit_of(ax, along)
    if said is None:
        if unit is None and written:
            known = np.asarray(values, dtype=float)
            size = float(np.max(np.abs(known[np.isfinite(known)]), initial=0.0))
            factor, shown = unit_shown(size, si_unit, written)
            return (factor, shown) if shown in written else (1.0, si_unit)
        return unit_scale(si_unit, unit)
    if unit is None and si_unit and si_unit != said:
        try:
            return unit_scale(si_unit, said)
        except ArgumentError:
            raise ArgumentError(f"ax has curves in {said}, got one in {si_unit}: give other axes") from None
    found = unit_scale(si_unit, unit)
    if si_unit and found[1] != said:
        raise ArgumentError(
            f'ax has curves in {said}, got one in {found[1]}: give unit="{said}" or other axes'
        )
    return found


def _unit_of(ax: object, along: Literal["x", "y"]) -> str | None:
    """The unit that the label of an axis says of what is drawn; None where there is none."""
    label = getattr(ax, f"get_{along}label", None)
    if label is None or not ax.has_data():  # type: ignore[attr-defined]
        return None  # a new one, or no axes, which is refused where they are needed
    said = re.search(r"\[([^\]]*)\]$", " ".join(label().split()))
    return None if said is None else said[1]


def abscissa_of(x: object, samples: int) -> Array:
    """The abscissa that a user gave, one finite or missing number for each sample."""
    given = np.asarray(x)
    if given.dtype.kind not in "iuf" or given.shape != (samples,):
        what = f"an array of shape {given.shape}" if given.dtype.kind in "iuf" else repr(x)
        raise ArgumentError(f"x must be {samples} numbers, one for each sample, got {what}")
    return given.astype(float)


def is_a(value: object, kind: str) -> bool:
    """Whether a value is of a class of this name, or of one derived from it."""
    return any(base.__name__ == kind for base in type(value).__mro__)


def require(argument: str, value: object, *kinds: str) -> None:
    """Refuse, with a TypeError, what is of none of these classes."""
    if not any(is_a(value, kind) for kind in kinds):
        words = " or ".join(kinds)
        raise ArgumentTypeError(f"{argument} must be a {words} of chebclear, got {type(value).__name__}")


def require_name(argument: str, name: object, run: Trajectory) -> None:
    """Refuse what cannot be the name of one column of a run, as a pattern; not that it is unknown."""
    if not isinstance(name, str) or (is_pattern(name) and name not in run.columns):
        message = f'{argument} must be the name of one column, such as "{run.columns[0]}", got {name!r}'
        raise (ArgumentError if isinstance(name, str) else TypeError)(message)


def column_names(run: Trajectory, columns: object) -> list[str]:
    """The names of columns that are given as one or several names or patterns; unknown names stay."""
    given = [columns] if isinstance(columns, str) else columns
    names = list(given) if isinstance(given, Iterable) else []
    if not names or not all(isinstance(name, str) for name in names):
        message = f'columns must be names of columns of the run, such as "{run.columns[0]}", got {columns!r}'
        raise ArgumentTypeError(message)
    return [found for name in names for found in (matching(run.columns, name) or [name])]
