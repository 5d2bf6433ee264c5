"""What all plots share: new axes, keywords of lines, units to show."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..base.units import UnitError, convert
from ..errors import ArgumentError, ArgumentTypeError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

# Paul Tol's bright scheme, whose colors color-blind readers can distinguish, not by hue alone.
COLORS = ("#4477AA", "#EE6677", "#228833", "#CCBB44", "#AA3377", "#66CCEE")
MARKERS = "osD^vP*X"


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


def abscissa_of(x: object, samples: int) -> Array:
    """The abscissa that a user gave, one finite or missing number for each sample."""
    given = np.asarray(x)
    if given.dtype.kind not in "iuf" or given.shape != (samples,):
        what = f"an array of shape {given.shape}" if given.dtype.kind in "iuf" else repr(x)
        raise ArgumentError(f"x must be {samples} numbers, one for each sample, got {what}")
    return given.astype(float)
