"""Ctrl-C and SIGTERM at the command line, whatever a library makes of them."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import chebclear as cc
import pytest
from chebclear.cli.ending import Terminated, terminable

posix = pytest.mark.skipif(os.name != "posix", reason="needs signals of POSIX")
SCENE = Path(cc.__file__).parent / "templates" / "starters" / "slider_crank.toml"


@posix
@pytest.mark.parametrize(
    ("number", "kind"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)]
)
def test_an_interrupt_of_which_a_library_makes_another_error_is_one(number, kind, monkeypatch):
    usual = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt) as raised, terminable():
            try:
                os.kill(os.getpid(), number)
            except KeyboardInterrupt:
                raise ImportError("initialization failed") from None
        assert type(raised.value) is kind and isinstance(raised.value.__cause__, ImportError)
        with pytest.raises(ImportError), terminable():
            raise ImportError("of its own")
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, usual)


# Interrupts the process at a moment of its life: before a module is imported, or when all is over.
EARLY = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)


class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            signal.raise_signal(signal.SIGINT)


sys.meta_path.insert(0, Watch())
from chebclear.cli import run_process

sys.argv = ["chebclear", "check", {scene!r}, "--no-picture"]
sys.exit(run_process())
"""
LATE = """
import atexit, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)
atexit.register(lambda: signal.raise_signal(signal.SIGINT))
from chebclear.cli import run_process

sys.argv = ["chebclear", {word!r}]
sys.exit(run_process())
"""


def run(program, folder):
    command = [sys.executable, "-c", program]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=600)


@posix
@pytest.mark.parametrize("module", ["numpy", "chebclear.templates.template", "chebclear.scene.scene"])
def test_ctrl_c_while_libraries_are_imported_is_one_line(module, tmp_path):
    done = run(EARLY.format(module=module, scene=str(SCENE)), tmp_path)
    assert done.returncode == 130
    assert done.stderr.splitlines() == ["chebclear: interrupted"]


@posix
@pytest.mark.parametrize(("word", "code"), [("--version", 0), ("nothing", 2)])
def test_ctrl_c_when_all_is_over_changes_nothing(word, code, tmp_path):
    done = run(LATE.format(word=word), tmp_path)
    assert done.returncode == code and "Traceback" not in done.stderr


@posix
def test_an_ignored_ctrl_c_stays_ignored(tmp_path):
    program = EARLY.replace("default_int_handler", "SIG_IGN").format(module="numpy", scene=str(SCENE))
    done = run(program, tmp_path)
    assert done.returncode == 0 and not done.stderr
