"""The completion scripts know every command and every option."""

import os
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
    assert offered("study", "--kind", "c") == {"chebyshev"}
    assert offered("new", "quick") == {"quick_return"}
    (tmp_path / "press.toml").touch()
    assert offered("check", "pre") == {"press.toml"}


@pytest.mark.skipif(shutil.which("fish") is None, reason="there is no fish")
def test_fish_completes_commands_options_and_choices(tmp_path, capsys):
    path = tmp_path / "chebclear.fish"
    path.write_text(script("fish", capsys), encoding="utf-8")
    (tmp_path / "press.toml").touch()

    def offered(line):
        command = ["fish", "--no-config", "-c", "source $argv[1]; complete -C $argv[2]", str(path), line]
        environment = {**os.environ, "HOME": str(tmp_path)}
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
        )
        assert not done.stderr
        return dict(line.partition("\t")[::2] for line in done.stdout.splitlines())

    assert set(offered("chebclear ")) == set(parsers())
    assert offered("chebclear stu")["study"].startswith("how far the outputs move")
    for name, parser in parsers().items():
        options = {
            text for action in parser._actions for text in action.option_strings if text.startswith("--")
        }
        assert set(offered(f"chebclear {name} --")) == options
    assert set(offered("chebclear study --kind c")) == {"chebyshev"}
    assert set(offered("chebclear new quick")) == {"quick_return"}
    assert set(offered("chebclear check pre")) == {"press.toml"}


@pytest.mark.skipif(shutil.which("zsh") is None, reason="there is no zsh")
def test_zsh_reads_its_script(tmp_path, capsys):
    (tmp_path / "_chebclear").write_text(script("zsh", capsys), encoding="utf-8")
    subprocess.run(["zsh", "-n", str(tmp_path / "_chebclear")], check=True)


def test_zsh_is_told_of_everything(capsys):
    text = script("zsh", capsys)
    for name, parser in parsers().items():
        assert name in text
        for action in parser._actions:
            for option in action.option_strings:
                assert option.lstrip("-") in text
