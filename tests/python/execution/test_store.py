"""Stores: what was finished is never simulated again, what cannot be trusted is, and others are refused."""

import dataclasses
import errno
import hashlib
import io
import os
import random
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import chebclear as cc
import numpy as np
import pytest
from chebclear.execution import batch, dispatch, store
from chebclear.execution.pieces import TIME_LIMIT, End

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

BOX = {"crank_length": cc.Interval.around(0.05, rel=0.1), "rod_length": cc.Interval.around(0.12, rel=0.05)}


def study(path, outputs=("slider.x", "slider.vx"), duration=0.003, box=BOX, **options):
    return cc.Study(
        cc.mechanisms.slider_crank, box, list(outputs), duration=duration, samples=31, store=path, **options
    )


@pytest.fixture
def simulated(monkeypatch):
    """Number of runs that were simulated."""
    numbers = []
    real = batch.Batch.place

    def place(self, task, piece):
        numbers.extend(task.runs)
        real(self, task, piece)

    monkeypatch.setattr(batch.Batch, "place", place)
    return numbers


def pieces(path):
    return sorted(path.glob("piece-*.npz"))


def test_finished_runs_are_not_simulated_again(tmp_path, simulated):
    whole = study(None).chebyshev(degree=3)
    del simulated[:]
    assert study(tmp_path / "runs").chebyshev(degree=3) == whole
    assert len(simulated) == 20
    assert study(tmp_path / "runs").chebyshev(degree=3) == whole
    assert len(simulated) == 20


def test_a_study_that_is_refined_reuses_what_is_there(tmp_path, simulated):
    first = study(tmp_path)
    first.scan(3)
    # The midpoint is also a point of the grid, and may be there before its turn.
    assert len(simulated) in (9, 10)
    del simulated[:]
    first.scan(5)  # 9 of the 25 points are there, and the midpoint
    assert len(simulated) == 16
    first.band(20)
    first.band(20).extend(10)
    assert len(simulated) == 16 + 21 + 10
    fewer = study(tmp_path, ["slider.vx"]).scan(5)
    assert len(simulated) == 47
    assert np.array_equal(fewer.values("slider.vx"), study(None).scan(5).values("slider.vx"))


def test_failed_runs_are_kept_too(tmp_path, simulated):
    # A stiffer contact takes more steps.
    box = {"young_modulus": cc.Interval.around(2e11, rel=0.9)}
    whole = study(None, box=box).scan(16)
    attempts = [one.steps + one.rejected for one in whole.stats]
    # The nominal run, the last one, must end.
    short = {"max_steps": max(attempts[-1], sorted(attempts)[len(attempts) // 2])}
    assert short["max_steps"] < max(attempts)
    result = study(tmp_path, box=box, **short).scan(16)
    assert 0 < len(result.failures) <= 8 and {one.reason for one in result.failures} == {"max_steps"}
    count = len(simulated)
    assert study(tmp_path, box=box, **short).scan(16) == result
    assert len(simulated) == count


def damage(path, how):
    content = bytearray(path.read_bytes())
    if how == "truncated":
        path.write_bytes(content[: len(content) // 2])
    elif how == "empty":
        path.write_bytes(b"")
    elif how == "flipped":
        content[random.Random(5).randrange(len(content))] ^= 4
        path.write_bytes(content)


def remarked(result):
    """The files of a store that the notices of a result are about."""
    return {name for notice in result.notices if notice.code == "store" for name in notice.about}


@pytest.mark.parametrize("how", ["truncated", "empty", "flipped"])
def test_damaged_pieces_are_named_and_simulated_again(tmp_path, simulated, how):
    whole = study(tmp_path).scan(3)
    victim = pieces(tmp_path)[1]
    damage(victim, how)
    del simulated[:]
    again = study(tmp_path).scan(3)
    assert 0 < len(simulated) < 10
    assert again["slider.x"] == whole["slider.x"] and again.stats == whole.stats
    assert remarked(again) == {victim.name}
    del simulated[:]
    assert study(tmp_path).scan(3) == whole and not simulated


def test_what_a_killed_process_was_writing_is_removed(tmp_path):
    whole = study(tmp_path).scan(2)
    kept = sorted(tmp_path.iterdir())
    for name in (".piece-0123.npz.17.140", ".store.json.17.140", ".values-abcdefgh"):
        (tmp_path / name).write_bytes(b"half")
    (tmp_path / ".mine").write_bytes(b"of the user")
    assert study(tmp_path).scan(2) == whole
    assert sorted(tmp_path.iterdir()) == sorted([*kept, tmp_path / ".mine"])


def test_foreign_and_newer_pieces_are_left_alone_and_named(tmp_path, simulated):
    whole = study(tmp_path).scan(2)
    other = tmp_path / "other"
    study(other, duration=0.004).scan(2)
    foreign = pieces(other)[0]
    foreign.rename(tmp_path / foreign.name)
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "piece-0123456789abcdef0123456789abcdef.npz").write_bytes(b"PK nothing")
    del simulated[:]
    again = study(tmp_path).scan(2)
    assert not simulated and again["slider.x"] == whole["slider.x"]
    nothing = "piece-0123456789abcdef0123456789abcdef.npz"
    assert remarked(again) == {"other", foreign.name, "notes.txt", nothing}
    assert (tmp_path / "notes.txt").exists() and (tmp_path / foreign.name).exists()


@pytest.mark.parametrize(
    ("member", "change"),
    [
        ("t", lambda array: array),
        ("values", lambda array: array[:, :-1]),
        ("values", lambda array: array.astype(np.float32)),
        ("counts", lambda array: array[:, 1:]),
        ("keys", lambda array: array[:0]),
        ("features", lambda array: array.reshape(-1)),
        ("ends", lambda array: np.array('{"ends": {"99": ["done", "", 0, null, []]}, "warnings": {}}')),
        ("ends", lambda array: np.array("[" * 100_000)),
        ("head", lambda array: np.array('["no head"]')),
        ("head", lambda array: np.array(str(array).replace('"format": 1', '"format": 2'))),
    ],
)
def test_pieces_with_a_checksum_that_fits_and_other_content_are_refused(tmp_path, simulated, member, change):
    whole = study(tmp_path).scan(2)
    victim = pieces(tmp_path)[0]
    with np.load(victim) as archive:
        arrays = dict(archive)
    victim.unlink()
    arrays[member] = change(arrays[member])
    memory = io.BytesIO()
    # A few packed bytes may become a memory full of zeros.
    (np.savez_compressed if member == "t" else np.savez)(memory, **arrays)
    name = f"piece-{hashlib.sha256(memory.getvalue()).hexdigest()[:32]}.npz"
    (tmp_path / name).write_bytes(memory.getvalue())
    del simulated[:]
    again = study(tmp_path).scan(2)
    assert again["slider.x"] == whole["slider.x"] and simulated
    assert name in remarked(again)


def test_another_study_is_refused_with_the_difference(tmp_path, monkeypatch):
    study(tmp_path).scan(2)
    for name, other in {"duration": {"duration": 0.005}, "rtol": {"rtol": 1e-8}, "outputs": {}}.items():
        with pytest.raises(cc.errors.StoreError, match=f"  {name}: "):
            study(tmp_path, ["slider.ax"] if name == "outputs" else ["slider.x"], **other).scan(2)
    pendulum = cc.Study(
        lambda length: cc.Scene(
            [cc.Body("slider", 1.0, length)], [cc.Prismatic("guide", "ground", "slider", (1.0, 0.0))]
        ),
        {"length": cc.Interval(1.0, 2.0)},
        ["slider.x", "slider.vx"],
        duration=0.003,
        samples=31,
        store=tmp_path,
    )
    with pytest.raises(cc.errors.StoreError):
        pendulum.scan(2)
    monkeypatch.setattr(store, "code_version", lambda: "another")
    with pytest.raises(cc.errors.StoreError):
        study(tmp_path).scan(2)
    monkeypatch.undo()
    monkeypatch.setattr(store, "FORMAT", 0)
    with pytest.raises(cc.errors.StoreError):
        study(tmp_path).scan(2)


def test_a_folder_of_other_files_is_no_store(tmp_path):
    (tmp_path / "thesis.tex").write_text("")
    with pytest.raises(cc.errors.StoreError):
        study(tmp_path).scan(2)
    assert not (tmp_path / "store.json").exists()


HOLDER = """
import sys
from chebclear.execution import store
facts = {"code": "", "topology": "", "settings": {}, "outputs": [], "features": []}
held = store.Store(sys.argv[1], facts)
print("open", flush=True)
sys.stdin.read()
"""


def test_one_process_at_a_time(tmp_path):
    (tmp_path / "store.json").write_text("damaged")
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as other:
        assert other.stdout.readline() == b"open\n"
        with pytest.raises(cc.errors.StoreError, match=rf"in use by process {other.pid}"):
            study(tmp_path).scan(2)
    (tmp_path / "store.json").unlink()
    assert study(tmp_path).scan(2) == study(None).scan(2)


@pytest.mark.skipif(os.name != "posix", reason="rights of a folder")
def test_a_read_only_folder_is_refused(tmp_path):
    tmp_path.chmod(0o500)
    made, user = study(tmp_path / "runs"), os.geteuid()
    if user == 0:  # the superuser may write everywhere
        os.seteuid(65534)
    try:
        with pytest.raises(cc.errors.StoreError):
            made.scan(2)
    finally:
        os.seteuid(user)


LIMITED = """
import resource, signal, sys, warnings
import chebclear as cc
warnings.simplefilter("ignore")
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
box = {"crank_length": cc.Interval.around(0.05, rel=0.1), "rod_length": cc.Interval.around(0.12, rel=0.05)}
study = cc.Study(cc.mechanisms.slider_crank, box, ["slider.x", "slider.vx"], duration=0.003, samples=31,
                 threads=1, store=sys.argv[1])
try:
    study.scan(8)
except cc.errors.StoreError as error:
    print(error)
"""


@pytest.mark.skipif(os.name != "posix", reason="limits of a process")
def test_a_file_system_that_takes_no_more_loses_nothing(tmp_path):
    program = [sys.executable, "-c", LIMITED, str(tmp_path), "6000"]  # pieces of some runs are larger
    told = subprocess.run(program, capture_output=True, text=True, check=True, timeout=600).stdout
    assert "File too large; it keeps" in told
    kept = pieces(tmp_path)
    assert kept and all(path.stat().st_size <= 6000 for path in kept)
    assert {path.name for path in tmp_path.iterdir()} == {"lock", "store.json"} | {one.name for one in kept}
    assert study(tmp_path).scan(8) == study(None).scan(8)


@pytest.mark.skipif(os.name != "posix", reason="fork")
def test_workers_that_were_forked_do_not_keep_the_store(tmp_path, simulated):
    with ProcessPoolExecutor(2, mp_context=get_context("fork")) as pool:
        first = study(tmp_path, executor=pool).scan(2)
        count = len(simulated)
        assert study(tmp_path, executor=pool).scan(2) == first and len(simulated) == count


@pytest.mark.parametrize("content", [None, "", "{", "[]"])
def test_a_lost_head_is_made_anew_of_the_pieces(tmp_path, simulated, content):
    whole = study(tmp_path).scan(2)
    head = (tmp_path / "store.json").read_text()
    (tmp_path / "store.json").unlink()
    if content is not None:
        (tmp_path / "store.json").write_text(content)
    del simulated[:]
    study(tmp_path, ["slider.vx"]).scan(2)
    assert not simulated and (tmp_path / "store.json").read_text() == head
    assert study(tmp_path).scan(2)["slider.x"] == whole["slider.x"] and not simulated


def test_a_run_that_took_too_long_gets_its_time_anew(tmp_path, monkeypatch):
    real = dispatch.simulate_order

    def slow(order, stop, into=None, count=None):
        piece = real(order, stop, into, count)
        given_up = End(TIME_LIMIT, "the run was given up after 1 s", 0.001)
        late = [0.045 in np.frombuffer(scene.numbers) for scene in order.scenes]
        piece.values[late] = np.nan
        ends = tuple(given_up if slow else end for slow, end in zip(late, piece.ends, strict=True))
        return dataclasses.replace(piece, ends=ends)

    monkeypatch.setattr(dispatch, "simulate_order", slow)
    failures = study(tmp_path, run_seconds=1.0).scan(3).failures
    assert {one.reason for one in failures} == {"time_limit"} and len(failures) == 3
    monkeypatch.undo()
    result = study(tmp_path).scan(3)
    assert not result.failures and result["slider.x"] == study(None).scan(3)["slider.x"]


def link(path, target):
    path.symlink_to(target)


def directory(path, target):
    path.mkdir()


def pipe(path, target):
    os.mkfifo(path)


@pytest.mark.skipif(os.name != "posix", reason="links and pipes")
@pytest.mark.parametrize("kind", [link, directory, pipe])
@pytest.mark.parametrize("name", ["lock", "store.json", "piece-0123456789abcdef0123456789abcdef.npz"])
def test_what_is_no_file_is_named_and_left_alone(tmp_path, name, kind):
    target, folder = tmp_path / "thesis.tex", tmp_path / "runs"
    target.write_text("mine")
    whole = study(folder).scan(2)
    (folder / name).unlink(missing_ok=True)
    kind(folder / name, target if name == "lock" else tmp_path / "nothing")
    found = []

    def work():
        try:
            found.append(study(folder).scan(2))
        except cc.errors.StoreError as error:
            found.append(error)

    thread = threading.Thread(target=work, daemon=True)  # a pipe may keep who opens it
    thread.start()
    thread.join(50.0)
    (again,) = found
    if name.startswith("piece"):
        assert again["slider.x"] == whole["slider.x"]
        assert name in remarked(again)
    else:
        assert isinstance(again, cc.errors.StoreError) and name in str(again)
    assert target.read_text() == "mine" and os.path.lexists(folder / name)


@pytest.mark.skipif(os.name != "posix", reason="flock")
def test_a_file_system_that_locks_nothing_is_said_to(tmp_path, monkeypatch):
    import fcntl

    def flock(file, what):
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS))

    monkeypatch.setattr(fcntl, "flock", flock)
    with pytest.raises(cc.errors.StoreError):
        study(tmp_path).scan(2)


PROGRAM = """
import sys, warnings
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
import chebclear as cc
warnings.simplefilter("ignore")

if __name__ == "__main__":
    pool = ProcessPoolExecutor(2, mp_context=get_context("spawn")) if sys.argv[2] == "pool" else None
    box = {"crank_length": cc.Interval.around(0.05, rel=0.1)}
    box["rod_length"] = cc.Interval.around(0.12, rel=0.05)
    study = cc.Study(cc.mechanisms.slider_crank, box, ["slider.x", "slider.vx"], duration=0.012,
                     samples=121, store=sys.argv[1], executor=pool)
    print("begin", flush=True)
    result = study.scan(9)
    result.save(sys.argv[3])
"""


@pytest.mark.skipif(os.name != "posix", reason="SIGKILL")
@pytest.mark.parametrize("where", ["here", "pool"])
def test_a_killed_study_goes_on_to_the_same_bits(tmp_path, where):
    script = tmp_path / "killed.py"
    script.write_text(PROGRAM)
    command = [sys.executable, str(script), str(tmp_path / "runs"), where, str(tmp_path / "result")]
    chance = random.Random(7)
    for _ in range(2):
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True)
        process.stdout.readline()
        deadline = time.monotonic() + 60.0
        enough = len(pieces(tmp_path / "runs")) + 2
        while len(pieces(tmp_path / "runs")) < enough and process.poll() is None:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        time.sleep(0.1 * chance.random())
        process.kill()
        process.wait()
        process.stdout.close()
    kept = len(pieces(tmp_path / "runs"))
    assert kept > 0
    subprocess.run(command, check=True, capture_output=True, timeout=300.0)
    result = cc.results.StudyResult.load(tmp_path / "result.npz")
    whole = cc.Study(
        cc.mechanisms.slider_crank, BOX, ["slider.x", "slider.vx"], duration=0.012, samples=121
    ).scan(9)
    assert result == whole
