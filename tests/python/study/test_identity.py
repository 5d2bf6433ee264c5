"""What a store takes for the same model of a user's own: the version that the user gives."""

import chebclear as cc
import numpy as np
import pytest
from refusals import refuses

BOX = {"a": cc.Interval.around(1.0, rel=0.1)}
CALLS = []


def model(a, **fixed):
    CALLS.append(a)
    return {"y": a}


class Opaque:
    """What no file can hold."""


FIXED = {"k": 1.5, "table": np.arange(40.0), "names": {"a": ["b", (1, None)]}, "law": cc.features.peak("x")}


def scan(store, points, version="1", **fixed):
    """The number of calls that a scan makes."""
    CALLS.clear()
    cc.Study(model, BOX, fixed=fixed, store=store, version=version).scan(points)
    return len(CALLS)


def test_a_store_of_a_model_asks_for_a_version(tmp_path):
    with refuses("version"):
        cc.Study(model, BOX, store=tmp_path)
    assert len(cc.Study(model, BOX).scan(2).parameters) == 2 and not list(tmp_path.iterdir())
    for wrong in ({"version": "1"}, {"version": 1, "store": tmp_path}, {"version": "", "store": tmp_path}):
        with refuses("version"):
            cc.Study(model, BOX, **wrong)
    scenes, kept = {"crank_length": cc.Interval.around(0.05, rel=0.1)}, {"store": tmp_path, "version": "1"}
    with refuses("version"):
        cc.Study(cc.mechanisms.slider_crank, scenes, ["slider.x"], duration=1e-3, samples=11, **kept)


def test_the_version_and_the_data_in_fixed_are_compared(tmp_path):
    fixed = FIXED | {"object": Opaque()}
    assert scan(tmp_path, 2, **fixed) == 3
    # Equal data, and whatever objects the version stands for.
    same = FIXED | {"table": np.arange(40.0), "object": Opaque()}
    assert scan(tmp_path, 2, **same) == 0 and scan(tmp_path, 3, **same) == 0
    others = {
        "k": 2.5,
        "table": np.arange(41.0),
        "names": {"a": ["b", (2, None)]},
        "law": cc.features.peak("y"),
    }
    for name, other in others.items():
        with pytest.raises(cc.errors.StoreError, match=f"fixed {name}: "):
            scan(tmp_path, 2, **same | {name: other})
    with pytest.raises(cc.errors.StoreError, match=r"version 1.*version 2"):
        scan(tmp_path, 2, "2", **same)
