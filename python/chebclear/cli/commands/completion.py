"""``chebclear completion``: the script by which a shell completes the command."""

from __future__ import annotations

import argparse

import shtab

from ..options import Command, Option
from ..output import tell
from ..program import parser

# A shell that completes by the scripts of shtab starts no Python (docs/decisions.md).
_SHELLS = ("bash", "fish", "zsh")


def completion(options: argparse.Namespace) -> None:
    """Run the command."""
    made = parser()
    _describe(made)
    text = shtab.complete(made, shell=options.shell).rstrip()
    tell(options, {"shell": options.shell, "script": text + "\n"}, text)


def _describe(program: argparse.ArgumentParser) -> None:
    """Name the arguments that are files or directories, and describe each command in a line."""
    for action in program._actions:
        if action.metavar in ("FILE", "DIR"):
            vars(action)["complete"] = shtab.FILE if action.metavar == "FILE" else shtab.DIRECTORY
        if isinstance(action, argparse._SubParsersAction):
            lines = {choice.dest: choice.help for choice in action._choices_actions}
            for name, command in action.choices.items():
                # The description of a command's own help takes several lines.
                command.description = lines[name]
                _describe(command)


COMMANDS = {
    "completion": Command(
        completion,
        "Print a completion script. To keep it: bash, add the output to ~/.bash_completion; fish, write it "
        "to ~/.config/fish/completions/chebclear.fish; zsh, write it to a file _chebclear in a directory of "
        "fpath.",
        'eval "$(chebclear completion bash)"',
        [Option("shell", _SHELLS, f"one of {', '.join(_SHELLS)}", metavar="SHELL")],
    )
}
