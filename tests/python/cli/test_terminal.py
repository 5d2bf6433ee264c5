"""What the command shows of its progress at a real terminal, and where standard error is none."""

import os
import re
import select
import signal
import struct
import subprocess
import sys
import time
from pathlib import Path

import pytest

pty = pytest.importorskip("pty", reason="there are no pseudoterminals here")
fcntl = pytest.importorskip("fcntl")
termios = pytest.importorskip("termios")

CRANK = str(Path(__file__).parents[3] / "examples" / "slider_crank.toml")


def at_terminal(*words, interrupt=None):
    """Everything that a terminal gets, and the exit code; Ctrl-C is typed when it got `interrupt`."""
    process, terminal = pty.fork()
    if process == 0:
        fcntl.ioctl(2, termios.TIOCSWINSZ, struct.pack("4H", 24, 100, 0, 0))
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # a child of a background job would ignore it
        os.execv(sys.executable, [sys.executable, "-m", "chebclear", *words])
    found, end = "", time.monotonic() + 600.0
    while time.monotonic() < end:
        try:
            if select.select([terminal], [], [], 0.1)[0]:
                found += os.read(terminal, 65536).decode(errors="replace")
        except OSError:  # it has ended
            break
        if interrupt is not None and re.search(interrupt, found):
            os.write(terminal, b"\x03")
            interrupt = None
    os.close(terminal)
    return found, os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def lines(printed):
    """What stays on the screen: of what is written over itself the last."""
    return [line.rpartition("\r")[2] for line in printed.replace("\r\n", "\n").split("\n")]


def test_a_study_shows_a_bar_that_ends_as_one_line():
    printed, code = at_terminal("study", CRANK, "--runs", "9", "--samples", "21")
    assert code == 0
    told = [line for line in lines(printed) if line.startswith("study:")]
    (last,) = told
    assert re.fullmatch(r"study: 100% \|█+\| 10/10 runs, \d\d:\d\d passed, 00:00 left", last)


def test_a_run_shows_its_share_and_ctrl_c_leaves_one_line():
    printed, code = at_terminal("run", CRANK, "--duration", "1000 s", interrupt=r"passed, [\d:]+ left")
    assert code == 130
    shown = lines(printed)
    assert [line for line in shown if line] == [shown[0], "chebclear: interrupted"]
    assert re.fullmatch(r"simulation: +\d+% \|[^|]+\| \d\d:\d\d passed, [\d:]+ left", shown[0])


@pytest.mark.parametrize("words", [[], ["--quiet"]])
def test_nothing_is_drawn_where_standard_error_is_no_terminal(words):
    command = [sys.executable, "-m", "chebclear", "study", CRANK, "--runs", "9", "--samples", "21", *words]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0 and "\r" not in done.stderr and "|" not in done.stderr
