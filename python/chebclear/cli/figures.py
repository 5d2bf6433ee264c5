"""Pictures as files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from ..base.writing import file_name
from ..plots.drawing.scene import plot_scene
from ..plots.runs import plot_orbit
from ..report.pictures import png
from ..run.trajectory import Trajectory
from ..scene.columns import column_unit
from ..scene.parts import ClearanceRevolute
from ..scene.scene import Scene

DPI = 150
_WIDTH, _HEIGHT = 6.5, 2.6  # [inch], of a panel


def draw_each(plots: Mapping[str, Callable[..., object]], folder: Path) -> None:
    """The picture of each method `plot`, under its name."""
    from matplotlib.figure import Figure

    for name, plot in plots.items():
        figure = Figure(layout="constrained")
        plot(ax=figure.add_subplot())
        (folder / f"{file_name(name)}.png").write_bytes(png(figure, DPI))


def draw_scene(scene: Scene, path: Path) -> None:
    """The mechanism in its assembled start."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(_WIDTH, _WIDTH), layout="constrained")
    plot_scene(scene, ax=figure.add_subplot())
    path.write_bytes(png(figure, DPI))


def draw_run(run: Trajectory, folder: Path) -> None:
    """``outputs.png``, a panel for every unit, and ``orbit_NAME.png`` where the journal's path is known."""
    from matplotlib.figure import Figure

    panels: dict[str, list[str]] = {}
    for name in run.columns:
        panels.setdefault(column_unit(name), []).append(name)
    figure = Figure(figsize=(_WIDTH, _HEIGHT * len(panels)), layout="constrained")
    for index, names in enumerate(panels.values()):
        run.plot(names, ax=figure.add_subplot(len(panels), 1, index + 1))
    (folder / "outputs.png").write_bytes(png(figure, DPI))
    needed = ("eccentricity", "eccentricity_x", "eccentricity_y", "penetration")
    for joint in run.scene.joints:
        known = all(f"{joint.name}.{name}" in run.columns for name in needed)
        if isinstance(joint, ClearanceRevolute) and known:
            figure = Figure(figsize=(_WIDTH, _WIDTH), layout="constrained")
            plot_orbit(run, joint.name, ax=figure.add_subplot())
            (folder / f"orbit_{file_name(joint.name)}.png").write_bytes(png(figure, DPI))
