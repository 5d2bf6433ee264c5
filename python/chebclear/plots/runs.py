"""Plots of single runs: columns over time, journals in their bearings, contacts and wear, Poincaré
sections.

Every function takes ``ax=None``, draws on it, labels the axes in words with units and returns the Axes. None
calls ``show``, none changes ``rcParams`` or the backend. Extra keywords go to the artist that carries the
data. Without ``ax`` a new figure is made: one of pyplot's when pyplot has been imported (so that
``plt.show()`` shows it), else a plain ``matplotlib.figure.Figure``, reached by ``ax.figure``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..base.arguments import Checks
from ..base.shown import meant_or_known
from ..errors import ArgumentError, ArgumentTypeError, UnknownNameError
from ..scene.columns import column_quantity, column_unit, column_words, plain_words
from ..scene.parts import ClearanceRevolute, loose_joints
from .axes import (
    COLORS,
    abscissa_of,
    column_names,
    is_a,
    line_style,
    new_axes,
    plot_of,
    require,
    require_name,
    shown_scale,
)
from .labels import (
    add_color_bar,
    legend_above_the_data,
    set_labels,
    set_row_names,
    set_x_label,
    with_unit,
    words_in_common,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..decisions.wear import WearLife
    from ..run.trajectory import Trajectory

Array = NDArray[np.float64]

# Instants of a section may miss the samples by this part of the time between two of them.
_ON_SAMPLE = 1e-3
# Profiles that are drawn at most, evenly over the depths.
_PROFILES = 8


@plot_of("Trajectory")
def plot_trajectory(
    run: Trajectory,
    columns: str | Sequence[str],
    *,
    ax: Axes | None = None,
    unit: str | None = None,
    x: Array | None = None,
    x_label: str = "time [s]",
    **line: Any,
) -> Axes:
    """Draw columns of one simulation against time; a dotted line marks where a run ended early.

    Parameters
    ----------
    run : Trajectory
        What :func:`simulate` returned.
    columns : str or sequence of str
        Column names, or patterns such as ``"*.vx"``; all of one unit, since they share the axis.

    Raises
    ------
    ValueError, KeyError, TypeError
        If a column is unknown, the columns have different units, or the unit does not fit them.

    Examples
    --------
    >>> import chebclear as cc
    >>> scene = cc.mechanisms.slider_crank()
    >>> run = cc.simulate(scene, duration=0.01, samples=101)
    >>> ax = cc.plots.plot_trajectory(run, ["slider.vx", "rod.vx"])
    """
    names = column_names(run, columns)
    curves = [run[name] for name in names]
    units = {column_unit(name) for name in names}
    if len(units) != 1:
        raise ArgumentError(f"columns on one axis must share a unit, got {names} in {sorted(units)}")
    scale, shown = shown_scale(ax, units.pop(), unit, run.written, curves)
    abscissa = run.t if x is None else abscissa_of(x, len(run.t))
    ax = new_axes(ax)
    common = words_in_common(names)
    for name, curve in zip(names, curves, strict=True):
        # What all of them are is on the axis.
        alike = len(names) > 1 and column_quantity(name) == common
        own = plain_words(name.rpartition(".")[0]) if alike else column_words(name)
        style = line_style(line, linewidth=0.9, label=own)
        ax.plot(abscissa, scale * curve, **style)
    # A column of the run as abscissa is no more known after the end than the curves are.
    known = np.isfinite(abscissa)
    if not run.success and known.any():
        # A curve that just stops looks like the whole of it.
        end = float(np.interp(run.end_time, run.t[known], abscissa[known]))
        words = f"the run ended early: {run.status}"
        ax.axvline(end, color="black", linewidth=0.9, linestyle=":", label=words)
        if known.all():
            ax.set_xlim(abscissa.min(), abscissa.max())
    set_labels(ax, x_label, with_unit(common, shown))
    if len(ax.get_legend_handles_labels()[1]) > 1:
        legend_above_the_data(ax)
    return ax


@plot_of("Trajectory")
def plot_orbit(
    run: Trajectory,
    joint: str,
    *,
    ax: Axes | None = None,
    unit: str = "µm",
    **line: Any,
) -> Axes:
    """Draw the path of the journal center inside the clearance circle of a joint.

    The circle has the radius of the clearance: inside it the journal flies free, outside it the surfaces
    overlap by the distance to the circle. Axes are those of the ground. The path has the color of the normal
    force, and is gray in free flight.

    Parameters
    ----------
    run : Trajectory
        What :func:`simulate` returned.
    joint : str
        Name of the clearance joint.
    unit : str
        Unit of length to show.
    **line
        Passed to ``matplotlib.collections.LineCollection`` for the path. With a ``color`` the path has that
        color throughout, and no color bar.

    Raises
    ------
    ValueError, KeyError
        If the scene has no such clearance joint, the run has not its columns, or the unit does not fit.

    Examples
    --------
    >>> import chebclear as cc
    >>> scene = cc.mechanisms.slider_crank()
    >>> run = cc.simulate(scene, duration=0.01, samples=101)
    >>> ax = cc.plots.plot_orbit(run, "wrist")
    """
    from matplotlib.cbook import normalize_kwargs
    from matplotlib.collections import LineCollection

    clearance = _clearance_joint(run, joint).clearance
    scale, shown = shown_scale(ax, "m", unit, run.written, clearance)
    path = np.column_stack([scale * run[f"{joint}.eccentricity_{axis}"] for axis in "xy"])
    style = normalize_kwargs(line, LineCollection)
    own_color = {"color", "colors", "edgecolor"} & set(style)
    force = None if own_color else run[f"{joint}.normal_force"]
    ax = new_axes(ax)
    turn = np.linspace(0.0, 2.0 * np.pi, 361)
    radius = scale * clearance
    ax.plot(
        radius * np.cos(turn),
        radius * np.sin(turn),
        color="0.25",
        linewidth=1.0,
        linestyle="--",
        label=f"clearance circle, radius {radius:.3g} {shown}",
        zorder=3,
    )
    pieces = np.stack([path[:-1], path[1:]], axis=1)
    defaults: dict[str, Any] = {"linewidth": 0.8, "label": "journal center"}
    if force is None:
        ax.add_collection(LineCollection(list(pieces), **(defaults | style)))
    else:
        between = np.fmax(force[:-1], force[1:])
        pressed = between > 0.0
        free = style | {"label": None}
        ax.add_collection(LineCollection(list(pieces[~pressed]), **(defaults | free | {"colors": "0.75"})))
        shades = LineCollection(
            list(pieces[pressed]), array=between[pressed], **({"cmap": "viridis_r"} | defaults | style)
        )
        ax.add_collection(shades)
        if pressed.any():
            label = with_unit(column_words(f"{joint}.normal_force"), "N")
            add_color_bar(ax, shades, label)
    ax.set_aspect("equal", adjustable="datalim")
    ax.autoscale_view()
    set_labels(ax, *(with_unit(column_words(f"{joint}.eccentricity_{axis}"), shown) for axis in "xy"))
    legend_above_the_data(ax)
    return ax


@plot_of("Trajectory")
def plot_poincare(
    run: Trajectory,
    x: str,
    y: str,
    *,
    ax: Axes | None = None,
    period: float | None = None,
    shift: float = 0.0,
    x_unit: str | None = None,
    y_unit: str | None = None,
    **points: Any,
) -> Axes:
    """Draw the Poincaré section of a run: two of its columns, once a period.

    A motion with this period is one point, one with twice the period two; a chaotic one is a cloud
    with structure. Skip the first periods, the starting transient.

    Parameters
    ----------
    run : Trajectory
        What :func:`simulate` returned, with a whole number of samples a period.
    x, y : str
        Columns on the abscissa and ordinate.
    period : float, optional
        Time from point to point [s]; ``run.scene.period``, a revolution of the slowest drive, if not given.
    shift : float
        Time from the first sample to the first point [s]: the phase of the section.
    x_unit, y_unit : str, optional
        Units to show; SI if not given.

    Raises
    ------
    ValueError, KeyError, TypeError
        If a column is unknown, or no samples lie where the section is taken; the message says
        which to ask for.

    Examples
    --------
    >>> import chebclear as cc
    >>> scene = cc.mechanisms.slider_crank()
    >>> run = cc.simulate(scene, duration=4 * scene.period, samples=401)
    >>> ax = cc.plots.plot_poincare(run, "slider.x", "slider.vx")
    """
    for axis, column in (("x", x), ("y", y)):
        require_name(axis, column, run)
    section = section_samples(run, period, shift)
    data = []
    asked: tuple[tuple[Literal["x", "y"], str, str | None], ...] = (("x", x, x_unit), ("y", y, y_unit))
    for along, column, unit in asked:
        scale, shown = shown_scale(ax, column_unit(column), unit, run.written, run[column], along)
        data.append((scale * run[column][section], with_unit(column_words(column), shown)))
    ax = new_axes(ax)
    style = line_style(points, marker=".", markersize=4.0, linestyle="none")
    ax.plot(data[0][0], data[1][0], **style)
    set_labels(ax, data[0][1], data[1][1])
    return ax


def section_samples(run: Trajectory, period: float | None, shift: float = 0.0) -> NDArray[np.int64]:
    """Indices of the samples of a run that are whole periods [s] apart, from a shift [s] on.

    The period is that of the scene if None. An ArgumentError if no samples lie there.
    """
    checks = Checks()
    period = run.scene.period if period is None else checks.real("period", period, "s", above=0.0)
    shift = checks.real("shift", shift, "s", least=0.0)
    checks.finish()
    spacing = float(run.t[-1] - run.t[0]) / (len(run.t) - 1)
    if not period >= spacing * (1.0 - _ON_SAMPLE):
        raise ArgumentError(
            f"period must be at least the {spacing:.6g} s between two samples, got {period!r}"
        )
    count = int((run.t[-1] - run.t[0] - shift) / period + _ON_SAMPLE) + 1
    places = (shift + period * np.arange(max(count, 0))) / spacing
    nearest = np.round(places).astype(np.int64)
    if count < 1 or np.abs(places - nearest).max() > _ON_SAMPLE:
        each = max(1, round(period / spacing))
        raise ArgumentError(
            f"no samples lie a period of {period:.6g} s apart: ask for a duration of N periods and "
            f"samples=N * {each} + 1, and for a shift of whole samples within it"
        )
    return nearest


@plot_of()
def plot_contacts(
    runs: Trajectory | Mapping[str, Trajectory], *, ax: Axes | None = None, **bars: Any
) -> Axes:
    """Draw when journals touch their bearings: a row for each joint, a bar for each contact.

    Bars have the color of the largest normal force of the contact, on a logarithmic scale if that spans more
    than a decade; a tick at their start is the impact.

    Parameters
    ----------
    runs : Trajectory or mapping of Trajectory
        What :func:`simulate` returned; several runs by their names to compare them, one below the other.
    **bars
        Passed to ``matplotlib.collections.PolyCollection``.

    Examples
    --------
    >>> import chebclear as cc
    >>> scene = cc.mechanisms.slider_crank()
    >>> run = cc.simulate(scene, duration=0.01, samples=101)
    >>> ax = cc.plots.plot_contacts(run)
    """
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import LogNorm, Normalize

    given: Any = runs
    several = isinstance(given, Mapping) and given and not is_a(given, "Trajectory")
    named: Mapping[str, Trajectory] = given if several else {"": given}
    rows: list[str] = []
    boxes, forces, onsets = [], [], []
    for name, run in named.items():
        require("runs", run, "Trajectory")
        found = run.contacts
        for joint in loose_joints(run.scene.joints):
            row = len(rows)
            rows.append(", ".join(filter(None, [name, plain_words(joint.name)])))
            for index in np.flatnonzero(found.joint == joint.name):
                start, end = max(found.onset[index], run.t[0]), found.separation[index]
                end = min(end if np.isfinite(end) else run.end_time, run.t[-1])
                boxes.append([(start, row - 0.35), (end, row - 0.35), (end, row + 0.35), (start, row + 0.35)])
                forces.append(found.peak_force[index])
                if np.isfinite(found.impact_velocity[index]):
                    onsets.append((start, row))
    ax = new_axes(ax)
    peaks = np.maximum(np.array(forces), np.finfo(float).tiny)
    wide = len(peaks) > 0 and peaks.max() > 20.0 * peaks.min()
    norm = LogNorm() if wide else Normalize(0.0, peaks.max(initial=1.0))
    style: dict[str, Any] = {"cmap": "viridis_r", "linewidth": 0.0, "norm": norm} | bars
    shades = ax.add_collection(PolyCollection(boxes, array=peaks, **style))
    if onsets:
        times, places = np.array(onsets).T
        ax.plot(
            times, places, linestyle="none", marker="|", markersize=9.0, color="0.15", markeredgewidth=0.4
        )
    set_row_names(ax, rows)
    ax.set_xlim(run.t[0], run.t[-1])
    if boxes:
        add_color_bar(ax, shades, "largest normal force of the contact [N]")
    set_x_label(ax, "time [s]")
    return ax


def _clearance_joint(run: Trajectory, name: str) -> ClearanceRevolute:
    """The clearance joint of a run's scene."""
    known = {joint.name: joint for joint in loose_joints(run.scene.joints)}
    if not isinstance(name, str):
        raise ArgumentTypeError(f"joint must be the name of a clearance joint, got {name!r}")
    if name not in known:
        if any(joint.name == name for joint in run.scene.joints):
            others = f"; known are {', '.join(known)}" if known else ""
            raise ArgumentError(f'the joint "{name}" has no clearance{others}')
        raise ArgumentError(f'unknown clearance joint "{name}"{meant_or_known(name, list(known))}')
    return known[name]


@plot_of("WearLife")
def plot_wear(
    life: WearLife, joint: str | None = None, *, ax: Axes | None = None, unit: str | None = None
) -> Axes:
    """Draw the largest depth of wear over the cycles, or the profiles of a bearing as it wears.

    Parameters
    ----------
    life : WearLife
        What ``wear_life`` returned.
    joint : str, optional
        Joint whose profiles are drawn; the largest depth over the cycles if not given.

    Raises
    ------
    KeyError
        If the joint does not wear.

    Examples
    --------
    >>> import chebclear as cc
    >>> scene = cc.mechanisms.slider_crank(clearance_at=("wrist",))
    >>> law = cc.laws.Archard(coefficient=1e-4, hardness=1e9, length=0.02)
    >>> found = cc.laws.wear_life(scene, {"wrist": law}, limit=2e-6, depth_per_jump=2e-6)
    >>> ax = cc.plots.plot_wear(found, "wrist", unit="µm")
    """
    if joint is not None and joint not in life.profiles:
        raise UnknownNameError(f'"{joint}" does not wear here{meant_or_known(joint, life.profiles)}')
    scale, shown = shown_scale(ax, "m", unit)
    ax = new_axes(ax)
    if joint is None:
        ax.plot(life.cycles, scale * life.depth, ".-", color=COLORS[0])
        if life.limit is not None:
            ax.axhline(scale * life.limit, color="0.3", linewidth=0.8, linestyle="--", label="limit")
            legend_above_the_data(ax)
        set_x_label(ax, "cycles [-]")
        ax.set_ylabel(with_unit("largest depth of wear", shown))
        return ax
    profiles = life.profiles[joint]
    steps = np.linspace(0.0, life.depth[-1], _PROFILES)
    rows = sorted({int(np.abs(life.depth - depth).argmin()) for depth in steps})
    angles = (np.arange(profiles.shape[1]) + 0.5) * 360.0 / profiles.shape[1]
    for place, row in enumerate(rows):
        shade = str(0.8 - 0.8 * (place + 1) / len(rows))
        ax.plot(angles, scale * profiles[row], color=shade, label=f"{life.cycles[row]:.3g}")
    set_x_label(ax, f"angle in the bearing of {plain_words(joint)} [°]")
    ax.set_ylabel(with_unit("depth of wear", shown))
    legend_above_the_data(ax, "cycles")
    return ax
