"""``chebclear completion``: the script by which a shell completes the command."""

from __future__ import annotations

import argparse
from importlib import resources

from ..options import Commands, new_command
from ..output import print_json

# Scripts that shtab wrote ahead of time: a shell that completes by them starts no Python (docs/decisions.md).
_SHELLS = ("bash", "fish", "zsh")


def add(commands: Commands) -> None:
    """Add the command."""
    command = new_command(
        commands,
        "completion",
        completion,
        "print the script that completes this command in your shell",
        "Print a completion script. To keep it: bash, add the output to ~/.bash_completion; fish, write it "
        "to ~/.config/fish/completions/chebclear.fish; zsh, write it to a file _chebclear in a directory of "
        "fpath.",
        'eval "$(chebclear completion bash)"',
    )
    command.add_argument("shell", choices=_SHELLS, metavar="SHELL", help="one of %(choices)s")


def completion(options: argparse.Namespace) -> int:
    """Run the command."""
    folder = resources.files("chebclear.cli") / "completions"
    text = (folder / f"chebclear.{options.shell}").read_text(encoding="utf-8")
    if options.json:
        print_json({"shell": options.shell, "script": text})
    else:
        print(text, end="")
    return 0
