"""Files and folders are there as a whole or not at all, and nothing stays beside them."""

import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from chebclear.base.writing import complete_folder, replaced


def test_a_kill_leaves_the_old_file(tmp_path):
    """Nothing is cleaned up after a kill: all that matters is that the path is not open for writing."""
    path = tmp_path / "run.npz"
    path.write_bytes(b"old")
    with replaced(path) as beside:
        beside.write_bytes(b"new, half of it")
        assert path.read_bytes() == b"old" and beside.parent == tmp_path
    assert path.read_bytes() == b"new, half of it"


def test_threads_may_replace_a_file_at_the_same_time(tmp_path):
    """Each writes a file of its own; the last one to end stays, and none is lost in between."""
    path, both_write = tmp_path / "run.npz", threading.Barrier(2)

    def write(content):
        with replaced(path) as beside:
            beside.write_bytes(content)
            both_write.wait(timeout=60)
            assert beside.read_bytes() == content

    with ThreadPoolExecutor(2) as pool:
        for written in [pool.submit(write, content) for content in (b"one", b"two")]:
            written.result()
    assert path.read_bytes() in (b"one", b"two") and list(tmp_path.iterdir()) == [path]


KILLED = """
import os, signal, sys
from pathlib import Path
from chebclear.base.writing import complete_folder, replaced

place = Path(sys.argv[1])
with complete_folder(place) as folder, replaced(place / "run.npz") as beside:
    (folder / "table.csv").write_text("half")
    beside.write_bytes(b"half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(os.name == "nt", reason="no signals there")
def test_what_killed_writers_left_is_removed_by_the_next_one(tmp_path):
    (tmp_path / "run.npz").write_bytes(b"old")
    subprocess.run([sys.executable, "-c", KILLED, tmp_path], check=False)
    left = [path for path in tmp_path.iterdir() if path.name != "run.npz"]
    assert len(left) == 2 and (tmp_path / "run.npz").read_bytes() == b"old"
    other = tmp_path / ".run.npz.another machine.1.1.npz"
    other.write_bytes(b"whose processes are not ours to judge")
    threads = ThreadPoolExecutor(1)
    with complete_folder(tmp_path) as folder, replaced(tmp_path / "run.npz") as beside, threads:
        beside.write_bytes(b"new")
        # Another thread leaves those alone that live.
        threads.submit(write_again, tmp_path).result()
        assert folder.is_dir() and beside.read_bytes() == b"new"
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([other.name, "run.npz"])
    assert (tmp_path / "run.npz").read_bytes() == b"new"


def write_again(place):
    with complete_folder(place), replaced(place / "run.npz") as beside:
        beside.write_bytes(b"of the other thread")
