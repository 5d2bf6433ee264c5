"""Runs as moving pictures."""

from __future__ import annotations

import importlib
import math
import os
import shutil
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...base.arguments import Checks, as_number
from ...base.shown import meant_or_known
from ...base.writing import replaced
from ...errors import ArgumentError, MissingProgramError
from ...report.film import Film, player
from ...report.html import film_page, framed
from ...scene.columns import plain_words
from ...scene.parts import ClearanceRevolute
from ...scene.scene import Scene
from ..axes import require, require_name
from ..drawing.pose import Pose, simulated_poses
from .film import bearing_panel, evenly, moving_film
from .motion import moving_mechanism
from .stage import Stage

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ...decisions.modes import Modes
    from ...run.trajectory import Trajectory

MOST_FRAMES = 2000
MOST_RATE = 100
_ENDINGS = (".gif", ".html", ".mp4")
_RENDER = """
export default { render({ model, el }) {
  const film = JSON.parse(model.get("film"));
  const shown = playFilm(el, {...film, starts: false}, frame => {
    if (model.get("frame") !== frame) { model.set("frame", frame); model.save_changes(); }
  });
  shown.show(model.get("frame"));
  model.on("change:frame", () => shown.show(model.get("frame")));
  return shown.leave;
} };
"""
_JOINT_COLUMNS = ("eccentricity_x", "eccentricity_y", "normal_force", "friction_force")


class Animation:
    """A run or a mode as a moving picture, to be saved or played in a notebook; `animate` makes it."""

    def __init__(self, film: Film, scene: Scene, note: str, size: tuple[float, float] = (10.0, 5.0)) -> None:
        self._film, self._note = film, note
        self._stage = Stage(film, scene, size)

    def __repr__(self) -> str:
        return f"<Animation: {len(self)} frames, {self._film.rate:g} a second>"

    def __len__(self) -> int:
        return len(self._film.at)

    def figure(self, frame: int = 0) -> Figure:
        """The picture of one frame; the same figure for all of them."""
        self._stage.show(range(len(self))[frame])
        return self._stage.figure

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the animation to a file.

        Parameters
        ----------
        path : path
            Where to. Its ending says what: ``.gif``; ``.html``, one page that plays without network; or
            ``.mp4``, for which ``ffmpeg`` must be on the path or the package ``imageio-ffmpeg`` be installed.

        Returns
        -------
        Path
            The file written.

        Raises
        ------
        ValueError
            If the ending is another one.
        RuntimeError
            If there is no ffmpeg for an MP4.
        """
        file = Path(path)
        if file.suffix not in _ENDINGS:
            raise ArgumentError(f"an animation is saved as {', '.join(_ENDINGS)}, got {file.name!r}")
        with replaced(file) as beside:
            if file.suffix == ".html":
                beside.write_text(self._page(), encoding="utf-8")
            elif file.suffix == ".gif":
                self._save_gif(beside)
            else:
                self._save_movie(beside)
        return file

    @cached_property
    def widget(self) -> Any:
        """The animation as a widget of notebooks: its ``frame`` can be read, set and observed; needs the
        package anywidget."""
        return widget_of(self._film)

    def _repr_html_(self) -> str:
        return framed(self._page(), self._film.title)

    def _repr_mimebundle_(self, **asked: Any) -> Any:
        try:
            return self.widget._repr_mimebundle_(**asked)
        except MissingProgramError:
            return {}

    def _save_gif(self, file: Path) -> None:
        from PIL import Image

        pictures = [Image.fromarray(picture) for picture in self._stage.pictures()]
        # One palette for all: colors then do not flicker from frame to frame.
        palette = pictures[len(pictures) // 2].quantize(128)
        first, *rest = (picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures)
        # The format counts in hundredths of a second.
        pause = 10 * max(1, round(100.0 / self._film.rate))
        first.save(file, save_all=True, append_images=rest, duration=pause, loop=0, optimize=True)

    def _save_movie(self, file: Path) -> None:
        import matplotlib as mpl
        from matplotlib import animation

        ffmpeg = _ffmpeg()
        self._stage.settle()
        figure, count = self._stage.figure, len(self)
        movie = animation.FuncAnimation(figure, self._stage.show, frames=count, cache_frame_data=False)
        with mpl.rc_context():
            mpl.rcParams["animation.ffmpeg_path"] = ffmpeg
            movie.save(str(file), writer="ffmpeg", fps=self._film.rate)

    def film(self) -> Film:
        """What pages and notebooks play."""
        return self._film

    def _page(self) -> str:
        return film_page(self._film, self._note)


def animate(
    run: Trajectory,
    output: str | None = None,
    *,
    joint: str | None = None,
    exaggerate: float = 1.0,
    frames: int = 120,
    rate: int = 25,
    size: tuple[float, float] = (10.0, 5.0),
) -> Animation:
    """Animate a run: the mechanism as it was simulated, a clearance joint, and one output.

    The bodies are drawn at their positions in the run; nothing is assembled again. One clearance joint is
    magnified beside the mechanism, with an enlarged clearance, the journal at its true relative position, and
    the contact force on the journal as an arrow. The plot of one output is below.

    Parameters
    ----------
    run : Trajectory
        What `simulate` returned; with the positions of all bodies, and all quantities of the joint.
    output : str, optional
        The output that is plotted; the normal force in the joint, or the first column, if not given.
    joint : str, optional
        The clearance joint to magnify; the first one if not given.
    exaggerate : float
        Factor by which play is drawn larger than it is in the mechanism [-]: gaps, offsets and tilts in
        guides, eccentricities in bearings.
    frames : int
        Number of pictures [-], evenly chosen of the samples, 2 to 2000.
    rate : int
        Pictures a second [1/s], at most 100.
    size : tuple of float
        Width and height of the picture [inch], of 100 dots each.

    Returns
    -------
    Animation
        Its `save` writes GIF, HTML and MP4.

    Raises
    ------
    ValueError, TypeError
        If an argument is wrong, or the run lacks columns: the message names the outputs to ask for.

    Examples
    --------
    >>> from chebclear import mechanisms, simulate
    >>> run = simulate(mechanisms.slider_crank(), duration=0.003, samples=61)
    >>> animate(run, "slider.vx", frames=10)
    <Animation: 10 frames, 25 a second>
    """
    require("run", run, "Trajectory")
    if output is not None:
        require_name("output", output, run)
    checks = Checks()
    count = checks.whole("frames", frames, least=2, most=MOST_FRAMES)
    pace = checks.whole("rate", rate, least=1, most=MOST_RATE)
    factor = checks.real("exaggerate", exaggerate, "-", least=1.0)
    loose = [each.name for each in run.scene.joints if isinstance(each, ClearanceRevolute)]
    if joint is not None and (not isinstance(joint, str) or joint not in loose):
        checks.add("joint", f'must be a clearance joint, got "{joint}"{meant_or_known(str(joint), loose)}')
        joint = None
    chosen = joint if joint is not None else loose[0] if loose else None
    shown = output if output is not None else f"{chosen}.normal_force" if chosen else run.columns[0]
    needed = [shown, *(f"{chosen}.{quantity}" for quantity in _JOINT_COLUMNS if chosen)]
    missing = [name for name in dict.fromkeys(needed) if name not in run.columns]
    if missing:
        checks.add("run", f"lacks {', '.join(missing)}: simulate with these among the outputs")
    extent = tuple(as_number(side) or 0.0 for side in size) if isinstance(size, Sequence) else ()
    if len(extent) != 2 or not all(0.0 < side < math.inf for side in extent):
        checks.add("size", f"must be a width and a height above 0 [inch], got {size!r}", wrong_type=True)
    checks.finish()
    poses = simulated_poses(run)
    samples = np.flatnonzero(np.isfinite(poses).all(axis=(1, 2)) & (run.t <= run.end_time))
    if len(samples) < 2:
        raise ArgumentError(f"the run ended at {run.end_time:g} s: it has fewer than two samples")
    picked = evenly(len(samples), count)
    moving = moving_mechanism(run.scene, poses[samples[picked]], factor)
    panels = [bearing_panel(run, chosen, samples, picked)] if chosen else []
    values = run[shown][samples]
    film, note = moving_film(moving, run.t[samples], picked, shown, values, panels, pace, "the run")
    if chosen:
        note += f" The center of the journal of the {plain_words(chosen)} is free in the dashed circle."
    return Animation(film, run.scene, note, (extent[0], extent[1]))


def animate_mode(modes: Modes, mode: int, size: float, frames: int, rate: int) -> Animation:
    """A period of a mode, with the coordinate that moves most; see `Modes.animate`."""
    checks = Checks()
    count = checks.whole("frames", frames, least=2, most=MOST_FRAMES)
    pace = checks.whole("rate", rate, least=1, most=MOST_RATE)
    checks.finish()
    shape, frequency = modes.shapes[mode - 1], float(modes.frequencies[mode - 1])
    turns = np.arange(count) / count
    waves = size * (shape * np.exp(2j * math.pi * turns)[:, None, None]).real
    moments = [Pose(modes.scene, pose) for pose in modes.poses + waves]
    # Angles count by the displacement at the size of the mechanism.
    spans = np.ptp(waves, axis=0) * [1.0, 1.0, moments[0].size]
    body, axis = np.unravel_index(np.argmax(spans), spans.shape)
    name = modes.bodies[body]
    places = [[*pose.at(f"{name}.center_of_mass"), pose.places[name][2]] for pose in moments]
    output, what = (
        f"{name}.{('x', 'y', 'angle')[axis]}",
        f"mode {mode} at {frequency:.4g} Hz, of no size of its own",
    )
    moving, values = moving_mechanism(modes.scene, modes.poses + waves), np.array(places)[:, axis]
    film, note = moving_film(moving, turns / frequency, np.arange(count), output, values, [], pace, what)
    return Animation(film, modes.scene, note)


def _ffmpeg() -> str:
    """Where ffmpeg is."""
    import matplotlib as mpl

    found = shutil.which(str(mpl.rcParams["animation.ffmpeg_path"]))
    if found is not None:
        return found
    try:
        packaged = importlib.import_module("imageio_ffmpeg")
    except ImportError:
        raise MissingProgramError(
            "an MP4 needs ffmpeg: install it, or the package imageio-ffmpeg, or save a .gif or .html"
        ) from None
    return str(packaged.get_ffmpeg_exe())


def widget_of(film: Film) -> Any:
    """A film as a widget, an `anywidget.AnyWidget`, with the traits ``film``, its JSON, and ``frame``."""
    try:
        anywidget, traitlets = map(importlib.import_module, ("anywidget", "traitlets"))
    except ImportError:
        raise MissingProgramError(
            "a widget needs the package anywidget: pip install 'chebclear[notebook]'"
        ) from None
    traits = {
        "_esm": player("js") + _RENDER,
        "_css": player("css"),
        "film": traitlets.Unicode().tag(sync=True),
        "frame": traitlets.Int().tag(sync=True),
    }
    # A class of its own, so that importing this module needs no package.
    return type("AnimationWidget", (anywidget.AnyWidget,), traits)(film=film.to_json())
