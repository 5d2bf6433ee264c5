"""``chebclear scan``: brute force over a grid of the parameters."""

from __future__ import annotations

import argparse

from ..options import Commands, add_means, add_out, add_scene, add_settings, count, new_command
from .study import STUDY_FILES, carry_out, study_of


def add(commands: Commands) -> None:
    """Add the command."""
    command = new_command(
        commands,
        "scan",
        scan,
        "simulate on a grid of the parameters: inner bounds of the outputs",
        "Simulate a scene on equally spaced points of its parameters' intervals. The bands are the "
        "extremes of the runs: between the points an output may reach further.",
        "chebclear scan press.toml --points 5 --out results",
    )
    add_scene(command)
    command.add_argument(
        "--points",
        type=count,
        metavar="N",
        default=10,
        help="points of every parameter (default: %(default)s)",
    )
    add_settings(command)
    add_out(command, STUDY_FILES)
    add_means(command)
    command.set_defaults(require=None, check=False)


def scan(options: argparse.Namespace) -> int:
    """Run the command."""
    made, title = study_of(options)
    return carry_out(made, "scan", {"points": options.points}, options, title)
