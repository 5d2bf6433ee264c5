"""The completion scripts know every command and every option."""

import shutil
import subprocess

import pytest
from chebclear.cli import program

COMPLETE = """
source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1))
_shtab_chebclear chebclear "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD-1]}"
printf '%s\\n' "${COMPREPLY[@]}"
"""


def parsers():
    (choices,) = (action.choices for action in program.parser()._actions if action.dest == "command")
    return choices


def script(shell, capsys):
    assert program.main(["completion", shell]) == 0
    return capsys.readouterr().out


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_completes_commands_options_and_choices(tmp_path, capsys):
    path = tmp_path / "chebclear.bash"
    path.write_text(script("bash", capsys), encoding="utf-8")

    def offered(*words):
        command = ["bash", "-c", COMPLETE, "bash", str(path), "chebclear", *words]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
        return set(done.stdout.split())

    assert offered("") == set(parsers())
    for name, parser in parsers().items():
        options = {text for action in parser._actions for text in action.option_strings}
        assert offered(name, "-") == options
    assert offered("study", "--kind", "c") == {"certify", "chebyshev"}
    assert offered("new", "quick") == {"quick_return"}
    (tmp_path / "press.toml").touch()
    assert offered("check", "pre") == {"press.toml"}


@pytest.mark.parametrize("shell", ["fish", "zsh"])
def test_the_other_shells_are_told_of_everything(shell, capsys):
    text = script(shell, capsys)
    for name, parser in parsers().items():
        assert name in text
        for action in parser._actions:
            for option in action.option_strings:
                assert option.lstrip("-") in text
