"""``chebclear animate``: a run as a moving picture."""

from __future__ import annotations

import argparse
from pathlib import Path

from ...plots.animation.animate import animate as animated
from ..options import Commands, add_scene, add_settings, count, directory, new_command
from ..output import print_json, require_writable
from ..scenes import progress_of, settings_of, template_of

_KINDS = (".html", ".gif", ".mp4")


def add(commands: Commands) -> None:
    """Add the command."""
    command = new_command(
        commands,
        "animate",
        animate,
        "simulate a scene and show it as a moving picture",
        "Simulate a scene once and write the mechanism in motion, a loose joint magnified beside it with its "
        "contact force, and a running plot of one output: HTML that plays without network, GIF, or MP4 where "
        "ffmpeg is found.",
        "chebclear animate press.toml --to press.gif --joint knee",
    )
    add_scene(command)
    command.add_argument(
        "--to",
        type=_picture,
        metavar="FILE",
        help="where to: a name that ends in .html, .gif or .mp4 (default: that of the scene file with .html)",
    )
    command.add_argument(
        "--out",
        type=directory,
        metavar="DIR",
        help="directory for it without --to (default: the current one)",
    )
    command.add_argument("--output", metavar="NAME", help="the output that is plotted (default: the force)")
    command.add_argument("--joint", metavar="NAME", help="the loose joint to magnify (default: the first)")
    command.add_argument("--frames", type=count, default=120, metavar="N", help="pictures (default: 120)")
    add_settings(command, outputs=False)


def animate(options: argparse.Namespace) -> int:
    """Run the command."""
    template = template_of(options)
    settings = settings_of(template, options)
    # It needs the positions of all bodies and all of the joint: the columns of a run that does not choose.
    columns = template.scene().check().columns
    settings["outputs"] = list(dict.fromkeys([*columns, *([options.output] if options.output else [])]))
    require_writable(options.out if options.to is None else None)
    path = options.to or (options.out or Path()) / f"{options.scene.stem}.html"
    run = template.simulate(**settings, features=None, progress=progress_of(options))
    moving = animated(run, options.output, joint=options.joint, frames=options.frames)
    path.parent.mkdir(parents=True, exist_ok=True)
    moving.save(path)
    if options.json:
        print_json({"file": str(path), "frames": options.frames})
    else:
        print(f"wrote    {path}")
    return 0


def _picture(text: str) -> Path:
    path = Path(text)
    if path.suffix not in _KINDS:
        raise argparse.ArgumentTypeError(f"must end in {', '.join(_KINDS)}, got {text!r}")
    if not path.parent.is_dir():
        raise argparse.ArgumentTypeError(f"there is no directory {str(path.parent)!r}")
    return path
