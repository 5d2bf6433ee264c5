"""Pictures of wear: how deep over the cycles, and where."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..base.arguments import meant_or_known
from ..errors import UnknownNameError
from ..scene.columns import plain_words
from .axes import COLORS, new_axes, unit_scale
from .labels import legend_above_the_data, set_x_label, with_unit
from .subjects import require

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..decisions.wear import WearLife

# Profiles that are drawn at most, evenly over the depths.
_PROFILES = 8


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
    ax : Axes, optional
        Where to draw; a new figure if not given.
    unit : str, optional
        Unit to show, such as ``"µm"``; SI if not given.

    Returns
    -------
    Axes

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
    require("life", life, "WearLife")
    if joint is not None and joint not in life.profiles:
        raise UnknownNameError(f'"{joint}" does not wear here{meant_or_known(joint, life.profiles)}')
    ax = new_axes(ax)
    scale, shown = unit_scale("m", unit)
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
