"""``chebclear animate``: a run as a moving picture."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...plots.animation.animate import animate as animated
from ..options import COUNT, DIRECTORY, NAME, SCENE, SETTINGS, Command, Kind, Option
from ..output import require_writable, tell
from ..scenes import progress_of, settings_of, template_of

_KINDS = (".html", ".gif", ".mp4")


def animate(options: argparse.Namespace) -> None:
    """Run the command."""
    template = template_of(options)
    settings = settings_of(template, options)
    # It needs the positions of all bodies and all of the joint: the columns of a run that does not choose.
    columns = template.scene().check().columns
    settings["outputs"] = list(dict.fromkeys([*columns, *([options.output] if options.output else [])]))
    out = options.scene.parent if options.out is None else options.out
    require_writable(out if options.to is None else None)
    path = options.to or out / f"{options.scene.stem}.html"
    run = template.simulate(**settings, features=None, progress=progress_of(options))
    moving = animated(run, options.output, joint=options.joint, frames=options.frames)
    path.parent.mkdir(parents=True, exist_ok=True)
    moving.save(path)
    tell(options, {"file": str(path), "frames": options.frames}, f"wrote    {path}")


def _picture(text: str) -> Path:
    path = Path(text)
    if path.suffix not in _KINDS:
        raise argparse.ArgumentTypeError(f"must end in {', '.join(_KINDS)}, got {text!r}")
    if not path.parent.is_dir():
        raise argparse.ArgumentTypeError(f"there is no directory {str(path.parent)!r}")
    return path


COMMANDS = {
    "animate": Command(
        animate,
        "Simulate a scene once and write the mechanism in motion, a loose joint magnified beside it with its "
        "contact force, and a running plot of one output: HTML that plays without network, GIF, or MP4 where "
        "ffmpeg is found.",
        "chebclear animate press.toml --to press.gif --joint knee",
        [
            *SCENE,
            Option(
                "--to",
                Kind("FILE", _picture),
                "where to: a name that ends in .html, .gif or .mp4 (default: that of the scene file with "
                ".html)",
            ),
            Option("--out", DIRECTORY, "directory for it without --to (default: that of the scene file)"),
            Option("--output", NAME, "the output that is plotted (default: the force)"),
            Option("--joint", NAME, "the loose joint to magnify (default: the first)"),
            Option("--frames", COUNT, "pictures", 120),
            *SETTINGS,
        ],
    )
}
