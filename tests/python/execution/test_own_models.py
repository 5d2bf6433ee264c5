"""Models of one's own that fail, hang or kill their worker, and stores of what they returned."""

import asyncio
import contextlib
import dataclasses
import itertools
import math
import os
import re
import signal
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from types import SimpleNamespace

import chebclear as cc
import numpy as np
import pytest
from chebclear.execution import dispatch, limited
from chebclear.execution.limited import call_order
from notices import codes

pytestmark = pytest.mark.filterwarnings("ignore::chebclear.ChebclearWarning")

BOX = {"a": cc.Interval.around(1.0, rel=0.1), "b": cc.Interval.around(2.0, rel=0.1)}
T = np.linspace(0.0, 1.0, 21)


def line(a, b):
    return {"t": T, "x": a * T - b, "y": b * T, "product": a * b}


def moody(faults):
    """`line`, but for some values of `a`, in which it does something else."""

    def model(a, b):
        return faults.get(a, lambda: line(a, b))()

    return model


def no_license():
    raise ConnectionError("no license")


def points(runs):
    return cc.Study(line, BOX).sample(runs).parameters


def test_one_run_in_a_hundred_that_fails_costs_no_other():
    at = points(400)
    kinds = {
        "raised": (no_license, "model"),
        "nan": (lambda: line(1.0, 2.0) | {"x": T * math.nan}, "not_finite"),
        "nonsense": (lambda: 3.0, "model"),
        "hung": (threading.Event().wait, "time_limit"),
    }
    wrong = dict(zip((7, 100, 233, 399), kinds.values(), strict=True))
    model = moody({at[number, 0]: fault for number, (fault, _) in wrong.items()})
    result = cc.Study(model, BOX, run_seconds=2.0, features={"peak": cc.features.peak("x")}).sample(400)
    assert {one.index: one.reason for one in result.failures} == {
        number: reason for number, (_, reason) in wrong.items()
    }
    for one in result.failures:
        assert list(one.parameters.values()) == list(at[one.index])
    whole = cc.Study(line, BOX, features={"peak": cc.features.peak("x")}).sample(400)
    others = np.delete(np.arange(400), list(wrong))
    assert np.array_equal(result.parameters, at[others])
    assert np.array_equal(result.values("x"), whole.values("x")[others])
    for name in ("peak", "product"):
        assert np.array_equal(result.features[name].values, whole.features[name].values[others])
        # Nothing is known of a feature where runs failed.
        assert result.features[name].interval.resolved is False
        assert whole.features[name].interval.resolved
    assert [dict(one.numbers) for one in result.notices if one.code == "failed"] == [
        {"runs": 4, "of_runs": 401}
    ]


def test_verdicts_account_for_runs_without_values():
    fresh = cc.Study(line, BOX).band(40).parameters
    result = cc.Study(moody({fresh[11, 0]: lambda: line(1.0, 2.0) | {"x": T - math.inf}}), BOX).band(40)
    assert result["x"].verdict == "too few runs" and result["x"].coverage <= 39 / 40
    assert cc.Study(line, BOX).band(40)["x"].resolved
    grid = cc.Study(line, BOX).chebyshev(degree=2).parameters
    holed = cc.Study(lambda a, b: no_license() if (a, b) == tuple(grid[3]) else line(a, b), BOX)
    fitted = holed.chebyshev(degree=2)
    assert "holes" in codes(fitted)
    # A polynomial of degree 1 follows from the others.
    assert fitted["x"].evaluate(a=1.1, b=1.8) == pytest.approx(1.1 * T - 1.8, abs=1e-12)


def test_what_must_raise_raises_at_once():
    calls = []

    def model(a, b):
        calls.append(a)
        return no_license()

    with pytest.raises(ConnectionError):
        cc.Study(model, BOX).sample(50)
    assert len(calls) == 1, "nothing can be made of a study without its nominal run"
    middle = lambda a, b: line(a, b) if (a, b) == (1.0, 2.0) else no_license()  # noqa: E731
    with pytest.raises(ConnectionError) as caught:
        cc.Study(middle, BOX).sample(10)
    assert "10 of 11 runs of the study failed" in caught.value.__notes__
    hung = moody({points(5)[2, 0]: threading.Event().wait})
    with pytest.raises(limited.TimeLimitError):
        cc.Study(hung, BOX, run_seconds=0.1, on_failure="raise").sample(5)


def test_a_run_that_is_not_finite_is_one_that_failed(monkeypatch):
    """Of scenes, whose core gives such values only where an output is not defined."""
    from chebclear import _core
    from chebclear.execution import pieces

    def sweep(scenes, settings, threads, go_on, place, *rest):
        runs = _core.sweep(scenes, settings, threads, go_on, place, *rest)
        for row, (_, numbers, _) in enumerate(scenes):
            if 0.045 in np.frombuffer(numbers):
                place.reshape(len(scenes), -1)[row, 3] = math.nan
        return runs

    core = {"sweep": staticmethod(sweep), "__file__": _core.__file__}
    monkeypatch.setattr(pieces, "_core", type("Core", (), core))
    box = {"crank_length": cc.Interval(0.045, 0.055)}
    study = cc.Study(cc.mechanisms.slider_crank, box, ["slider.x", "slider.vx"], duration=1e-3, samples=6)
    (failure,) = study.scan(5).failures
    assert failure.reason == "not_finite"
    assert failure.parameters == {"crank_length": 0.045}


def endless():
    """Holds the interpreter for longer than anyone waits."""
    re.match(r"(a+)+$", "a" * 60 + "b")


def killed():
    os.kill(os.getpid(), signal.SIGKILL)


AT = points(24)
FAULTS = {
    AT[3, 0]: endless,
    AT[5, 0]: killed,
    AT[6, 0]: no_license,
    AT[8, 0]: threading.Event().wait,
    AT[10, 0]: lambda: os._exit(0),
}


def worst(a, b):
    return FAULTS.get(a, lambda: line(a, b))()


@pytest.mark.skipif(os.name != "posix", reason="SIGKILL")
def test_calls_that_take_their_worker_with_them_cost_no_other(monkeypatch):
    monkeypatch.setattr(limited, "_BESIDES", 0.1)  # forked workers have it too
    with ProcessPoolExecutor(2, mp_context=get_context("fork")) as pool:
        result = cc.Study(worst, BOX, run_seconds=0.2, executor=pool).sample(12)
    assert {one.index: one.reason for one in result.failures} == {
        3: "worker_lost",
        5: "worker_lost",
        6: "model",
        8: "time_limit",
        10: "worker_lost",
    }
    others = [0, 1, 2, 4, 7, 9, 11]
    assert np.array_equal(result.values("x"), cc.Study(line, BOX).sample(12).values("x")[others])


class Rude(Exception):
    """Does not pickle."""

    def __reduce__(self):
        raise TypeError("never")


def rude(a, b):
    if a < 0.95:
        raise Rude("go away")
    return line(a, b)


@pytest.mark.skipif(os.name != "posix", reason="fork")
def test_errors_that_do_not_pickle_come_back_by_name():
    with ProcessPoolExecutor(1, mp_context=get_context("fork")) as pool:
        result = cc.Study(rude, BOX, executor=pool).sample(20)
    assert result.failures and all("Rude: go away" in one.message for one in result.failures)


class Unreadable(Exception):
    """Its message raises what it was made of."""

    def __str__(self):
        raise self.args[0]


def raises(error):
    raise error


ENDS = {
    "exit": (sys.exit, "it ended with SystemExit: "),
    "status": (lambda: sys.exit(3), "it ended with SystemExit: 3"),
    "interrupt": (lambda: raises(KeyboardInterrupt()), "it ended with KeyboardInterrupt: "),
    "generator": (lambda: raises(GeneratorExit()), "it ended with GeneratorExit: "),
    "cancelled": (lambda: raises(asyncio.CancelledError()), "it ended with CancelledError: "),
    "group": (lambda: raises(BaseExceptionGroup("all", [SystemExit()])), "BaseExceptionGroup: all"),
    "unreadable": (lambda: raises(Unreadable(ValueError())), "Unreadable: (its message raises ValueError)"),
    "worse": (lambda: raises(Unreadable(SystemExit())), "Unreadable: (its message raises SystemExit)"),
    "endless": (lambda: raises(ValueError("x" * 50_000_000)), "... (50000012 characters)"),
    "nonsense": (lambda: "y" * 50_000_000, "must return a Scene, or a mapping"),
}
ENDING = {AT[1 + number, 0]: fault for number, (fault, _) in enumerate(ENDS.values())}


def ending(a, b):
    return ENDING.get(a, lambda: line(a, b))()


@contextlib.contextmanager
def executor(where):
    if where == "here":
        yield None
    elif where == "threads":
        with ThreadPoolExecutor(2) as pool:
            yield pool
    else:
        with ProcessPoolExecutor(2, mp_context=get_context("fork")) as pool:
            yield pool


@pytest.mark.skipif(os.name != "posix", reason="fork")
@pytest.mark.parametrize("seconds", [None, 60.0])
@pytest.mark.parametrize("where", ["here", "threads", "processes"])
def test_every_way_a_call_can_end_is_a_failed_run(where, seconds, monkeypatch):
    if where == "here" and seconds is None:  # there it may be the user's Ctrl-C
        faults = {a: fault for a, fault in ENDING.items() if fault is not ENDS["interrupt"][0]}
        monkeypatch.setitem(globals(), "ENDING", faults)
    results = []

    def work():
        with executor(where) as pool:
            results.append(cc.Study(ending, BOX, executor=pool, run_seconds=seconds).sample(24))

    # A study that waits for ever must not keep the test.
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(50.0)
    assert not thread.is_alive(), "the study hangs"
    (result,) = results
    told = {one.index: (one.reason, one.message) for one in result.failures}
    for number, (fault, words) in enumerate(ENDS.values()):
        if fault in ENDING.values():
            reason, message = told.pop(1 + number)
            assert reason == "model" and words in message and len(message) < 2000
    assert not told
    at = cc.Study(line, BOX).sample(24)
    kept = [number for number in range(24) if at.parameters[number, 0] not in ENDING]
    assert np.array_equal(result.values("x"), at.values("x")[kept])


def test_a_callable_of_a_scene_that_exits_is_a_failed_run_too():
    def build(crank_length):
        return sys.exit(2) if crank_length < 0.047 else cc.mechanisms.slider_crank(crank_length=crank_length)

    def last(run):
        return sys.exit(2) if run["slider.x"][-1] > 0.172 else 1.0

    study = cc.Study(
        build,
        {"crank_length": cc.Interval(0.045, 0.055)},
        ["slider.x"],
        duration=1e-3,
        samples=6,
        features={"last": last},
    )
    told = {(one.reason, one.message) for one in study.scan(5).failures}
    assert told == {(reason, "it ended with SystemExit: 2") for reason in ("build", "feature")}


def test_a_nominal_run_that_exits_is_an_error():
    with pytest.raises(cc.ChebclearError):
        cc.Study(lambda a, b: sys.exit(4), BOX).sample(3)


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_an_interrupt_of_a_worker_alone_costs_its_piece(monkeypatch):
    monkeypatch.setattr(dispatch, "call_order", interrupted)
    with ProcessPoolExecutor(1, mp_context=get_context("fork")) as pool:
        result = cc.Study(line, BOX, executor=pool).sample(12)
    assert [one.reason for one in result.failures] == ["worker_lost"]
    assert result.failures[0].parameters["a"] == AT[5, 0]


def interrupted(order, stop):
    if any(one["a"] == AT[5, 0] for one in order.parameters):
        # A child of a background job would ignore it.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(60.0)
    return call_order(order, stop)


def test_workers_that_end_before_they_have_finished_anything_are_an_error(monkeypatch):
    monkeypatch.setattr(dispatch, "call_order", ended)
    with (
        ProcessPoolExecutor(1, mp_context=get_context("fork")) as pool,
        pytest.raises(cc.ChebclearError),
    ):
        cc.Study(line, BOX, executor=pool).sample(50)


def ended(order, stop):
    os._exit(1)


@pytest.fixture
def counted(monkeypatch):
    """Number of calls of the model."""
    from chebclear.study.sources import calling

    numbers = []
    real = calling.Calling.place

    def place(self, task, answers):
        numbers.extend(task.runs)
        real(self, task, answers)

    monkeypatch.setattr(calling.Calling, "place", place)
    return numbers


def stored(path, model=line, **options):
    return cc.Study(model, BOX, store=path, version="1", **options)


def test_a_study_that_is_refined_reuses_all_runs(tmp_path, counted):
    features = {"end": lambda run: run["x"][-1], "peak": cc.features.peak("y")}
    first = stored(tmp_path, outputs=["x"]).scan(3)
    assert len(counted) == 9  # the midpoint is a point of the grid
    assert stored(tmp_path, outputs=["x"]).scan(3) == first and len(counted) == 9
    more = stored(tmp_path, features=features).scan(5)  # all that is returned was kept
    assert len(counted) == 9 + 16
    assert more == cc.Study(line, BOX, features=features).scan(5)
    stored(tmp_path).band(20).extend(10)
    stored(tmp_path).band(30)
    assert len(counted) - 25 - 26 == 30  # 26 by the study without a store


def test_a_run_that_failed_is_called_again(tmp_path, counted, monkeypatch):
    monkeypatch.setenv("CHEBCLEAR_TEST_LICENSE", "no")
    result = stored(tmp_path, licensed).sample(6)
    again = [one.index for one in result.failures]
    assert 0 < len(again) < 6 and len(counted) == 7
    monkeypatch.setenv("CHEBCLEAR_TEST_LICENSE", "yes")
    del counted[:]
    assert not stored(tmp_path, licensed).sample(6).failures
    assert counted == again


def licensed(a, b):
    if a < 0.97 and os.environ["CHEBCLEAR_TEST_LICENSE"] == "no":
        no_license()
    return line(a, b)


def test_a_model_without_time_gives_what_is_done(tmp_path, monkeypatch):
    # A clock that goes on whenever it is read: the test does not depend on the speed of a machine.
    monkeypatch.setattr(dispatch, "time", SimpleNamespace(monotonic=itertools.count(0.0, 0.02).__next__))
    short = stored(tmp_path, line, max_seconds=0.3, threads=1).band(60)
    monkeypatch.undo()
    assert short.status == "stopped"
    done = len(short.parameters)
    assert 0 < done < 60
    # What time was short for is made.
    whole = cc.Study(line, BOX).band(60)
    made = dataclasses.replace(short, study=whole.study).extend(60 - done)
    assert made.status != "stopped" and made.failures == () and made["x"] == whole["x"]
    assert short["x"] == cc.Study(line, BOX).band(done)["x"]
    assert stored(tmp_path, line).band(60)["x"] == cc.Study(line, BOX).band(60)["x"]


def test_threads_and_order_do_not_matter():
    with ThreadPoolExecutor(3) as pool:
        assert cc.Study(line, BOX, executor=pool).band(50) == cc.Study(line, BOX).band(50)
