"""Files and texts from strangers are refused with a typed error, or are sound."""

import importlib.util
import io
import json
import os
import signal
import zipfile
from pathlib import Path

import chebclear as cc
import numpy as np
import pytest
from refusals import refuses


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """The arrays of a saved study."""
    box = {"rod_length": cc.Interval.around(0.12, rel=0.01)}
    study = cc.Study(cc.mechanisms.slider_crank, box, outputs=["slider.x"], duration=0.001, samples=5)
    with np.load(study.chebyshev(degree=2).save(tmp_path_factory.mktemp("saved") / "study.npz")) as members:
        return dict(members)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("settings", {"steps": None}),
        ("features", 3),
        ("intervals", "x"),
        ("intervals", {"rod_length": [1.0, 2.0, 3.0, 4.0]}),
        ("degrees", 2.5),
        ("failures", [{"no such": "field"}]),
        ("worst_cases", {"a": {}}),
        ("seconds", {"not_finite": [3.0]}),
        ("members", [None, "t"]),
        ("members", 7),
        ("outputs", []),
    ],
)
def test_facts_that_say_something_else_are_refused(tmp_path, saved, name, value):
    """Such files ended with a TypeError or an AttributeError."""
    facts = json.loads(str(saved["metadata"]))
    (facts["record"] if name in facts["record"] else facts)[name] = value
    np.savez(tmp_path / "study.npz", **saved | {"metadata": np.array(json.dumps(facts))})
    with pytest.raises(cc.errors.ArgumentError):
        cc.load_result(tmp_path / "study.npz")


def test_a_member_that_is_not_listed_is_not_unpacked(tmp_path, saved, monkeypatch):
    path = tmp_path / "study.npz"
    np.savez(path, **saved, zeros=np.zeros(1000))
    read, real = [], np.lib.format.read_array

    def counted(*given, **options):
        read.append(given)
        return real(*given, **options)

    monkeypatch.setattr(np.lib.format, "read_array", counted)
    with pytest.raises(cc.errors.ArgumentError):
        cc.load_result(path)
    # The metadata alone, asked for the kind and for the list.
    assert 1 <= len(read) <= 2
    # Packed zeros fill a thousand times the size of the file: nothing of it is read.
    read.clear()
    np.savez_compressed(path, **saved)
    with pytest.raises(cc.errors.ArgumentError):
        cc.load_result(path)
    assert not read


def test_an_array_of_another_shape_than_was_saved_is_refused(tmp_path, saved):
    path = tmp_path / "study.npz"
    for name in saved.keys() - {"metadata"}:
        for axis in range(saved[name].ndim):
            longer = np.pad(saved[name], [(0, int(axis == other)) for other in range(saved[name].ndim)])
            np.savez(path, **saved | {name: longer})
            with pytest.raises(cc.errors.ArgumentError) as caught:
                cc.load_result(path)
            assert name in str(caught.value)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names")
def test_pipes_and_devices_are_no_files(tmp_path):
    """Reading a pipe never ends, nor does reading a device."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (pipe, os.devnull):
        for read in (cc.load, cc.load_result, cc.read_linkage):
            with pytest.raises(cc.errors.ArgumentError):
                read(path)


@pytest.mark.parametrize("victim", ["metadata", "values"])
@pytest.mark.parametrize("packed", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_a_header_that_claims_a_petabyte_takes_no_memory(tmp_path, saved, victim, packed):
    path = tmp_path / "study.npz"
    header = io.BytesIO()
    claim = {"descr": "<f8", "fortran_order": False, "shape": (10**14,)}
    np.lib.format.write_array_header_1_0(header, claim)
    with zipfile.ZipFile(path, "w", packed) as archive:
        for name, array in saved.items():
            content = io.BytesIO()
            np.save(content, array)
            archive.writestr(f"{name}.npy", (header if name == victim else content).getvalue())
    with pytest.raises(cc.errors.ArgumentError):
        cc.load_result(path)


@pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="nothing ends a call that takes too long")
def test_random_calls_return_or_are_refused(monkeypatch, tmp_path):
    path = Path(__file__).parents[3] / "benchmarks" / "calls.py"
    spec = importlib.util.spec_from_file_location("calls", path)
    calls = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(calls)
    monkeypatch.chdir(tmp_path)  # and back: the calls have a folder of their own
    wrong, counts = calls.faults(calls=600, seed=20261125)
    assert not wrong
    assert min(counts.values()) > 120


@pytest.mark.parametrize("name", [np.zeros(2), np.array([]), np.ma.array(["a", "b"]), 3, None, ("a",)])
def test_what_is_no_text_is_no_name(name):
    """An array that is compared with a text is an array again, which is neither true nor false."""
    scene = cc.mechanisms.slider_crank()
    run = cc.simulate(
        scene, duration=1e-4, samples=3, error="estimate", features=[cc.features.peak("slider.x")]
    )
    costs = cc.tradeoff(scene, duration=1e-4, samples=3, outputs=["slider.x"], rtols=[1e-3, 1e-4])
    assert name not in run
    for call in (
        lambda: run[name],
        lambda: run.error[name],
        lambda: costs[name],
        lambda: costs.uncertainty(name),
        lambda: cc.features.Feature(name, "slider.x"),
        lambda: cc.laws.hertz_stiffness(0.01, 1e-5, 2e11, 0.3, name),
        lambda: cc.loads(name),
        lambda: cc.loads("", changes=name) if name is not None else run[name],
        lambda: cc.simulate(scene, duration=1e-4, samples=3, on_failure=name),
    ):
        with pytest.raises((cc.ChebclearError, TypeError, KeyError)):
            call()


def test_whole_numbers_that_no_machine_holds_are_told_by_name():
    with refuses("max_events"):
        cc.simulate(cc.mechanisms.slider_crank(), duration=1e-4, samples=3, max_events=10**400)
