"""Files of results: whole at any time, and JSON that every reader understands."""

import dataclasses
import json
import math

import chebclear as cc
import numpy as np
import pytest
from chebclear.study.comparison import BoundErrors, Comparison


def resting():
    return cc.simulate(cc.Scene([cc.Body("block", 1.0, 0.1)], []), duration=0.1, samples=3)


def refuse(constant):
    raise AssertionError(f"{constant} is no JSON")


def test_numbers_that_are_not_finite_are_plain_json(tmp_path):
    run = resting()
    stats = dataclasses.replace(run.stats, smallest_step=math.inf, smallest_step_time=math.nan)
    run = dataclasses.replace(run, stats=stats, end_time=-math.inf)
    path = run.save(tmp_path / "run")
    with np.load(path) as archive:
        facts = json.loads(str(archive["metadata"]), parse_constant=refuse)
    assert facts["record"]["stats"]["smallest_step"] == {"not_finite": "Infinity"}
    assert cc.Trajectory.load(path) == run


@pytest.mark.parametrize("stop", [KeyboardInterrupt, OSError])
def test_what_interrupts_the_writing_leaves_the_old_file(tmp_path, monkeypatch, stop):
    run = resting()
    path = run.save(tmp_path / "run")
    old = path.read_bytes()
    write = np.lib.format.write_array

    def halfway(member, array, **options):
        write(member, array[: len(array) // 2], **options)
        raise stop

    monkeypatch.setattr(np.lib.format, "write_array", halfway)
    with pytest.raises(stop):
        run.save(path)
    assert path.read_bytes() == old
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_stays_a_link(tmp_path):
    target, link = tmp_path / "target.npz", tmp_path / "link.npz"
    target.write_bytes(b"old")
    try:
        link.symlink_to(target)
    except OSError:
        pytest.skip("this system does not let us make links")
    resting().save(link)
    assert link.is_symlink() and target.read_bytes() == link.read_bytes() != b"old"


def test_what_a_file_says_has_the_types_of_the_result(tmp_path):
    row = BoundErrors(lower=0.5, upper=0.5, width=0.5, reference_width=0.5, slack=0.5, unit="m")
    right = Comparison({"x": row}, 0.0, 1.0, ())
    assert cc.load_result(right.save(tmp_path / "good"))["x"].slack == 0.5
    one_wrong = dataclasses.replace(row, lower=[1.0])
    for change in ({"start": "soon"}, {"end": None}, {"errors": {"x": one_wrong}}):
        path = dataclasses.replace(right, **change).save(tmp_path / "wrong")
        with pytest.raises(
            cc.errors.ArgumentError, match=r"is no sound comparison: \w+\.\w+ is a \w+, not float"
        ):
            cc.load_result(path)


def test_a_tradeoff_with_arrays_of_other_shapes_is_refused(tmp_path):
    scene = cc.mechanisms.slider_crank()
    costs = cc.tradeoff(scene, duration=1e-4, samples=5, outputs=["slider.x"], rtols=[1e-3])
    for change in (
        {"t": costs.t[:-1]},
        {"ranges": np.ones(2)},
        {"outputs": ("slider.x", 3)},
        {"points": (dataclasses.replace(costs.points[0], rtol=math.inf),)},
        {"points": (dataclasses.replace(costs.points[0], seconds="1"),)},
    ):
        path = dataclasses.replace(costs, **change).save(tmp_path / "costs")
        with pytest.raises(cc.errors.ArgumentError):
            cc.load_result(path)
