"""Exceptions: their hierarchy, their words, and that they survive pickling and copying."""

import copy
import pickle

import chebclear as cc
import numpy as np
import pytest
from chebclear.base.arguments import Checks
from chebclear.base.shown import did_you_mean
from refusals import refuses

PROBLEMS = [("bodies[0].mass", "must be > 0 [kg], got -1"), ("joints[2]", "is missing")]


def failure(message=""):
    parameters = {"crank_length": 0.05, "rod_length": 0.12}
    return cc.errors.SimulationError("step_underflow", 0.0125, "wrist", parameters, message)


def test_one_root_catches_everything():
    for kind in (cc.errors.SceneError, cc.errors.SettingsError, cc.errors.StartError):
        assert issubclass(kind, cc.errors.InputError) and str(kind([("a", "b"), ("c", "d")])) == "a: b\nc: d"
    assert issubclass(cc.errors.InputError, cc.ChebclearError) and issubclass(
        cc.errors.InputError, ValueError
    )
    assert issubclass(cc.errors.SimulationError, cc.ChebclearError) and issubclass(
        cc.errors.SimulationError, RuntimeError
    )
    assert issubclass(cc.ChebclearWarning, UserWarning)


def test_scene_error_lists_every_problem_on_its_line():
    error = cc.errors.SceneError(PROBLEMS)
    assert error.problems == [cc.errors.Problem(*problem) for problem in PROBLEMS]
    assert str(error).splitlines() == ["bodies[0].mass: must be > 0 [kg], got -1", "joints[2]: is missing"]


@pytest.mark.parametrize("twin", [lambda error: pickle.loads(pickle.dumps(error)), copy.copy, copy.deepcopy])
def test_exceptions_survive_pickling_and_copying(twin):
    scene = twin(cc.errors.SceneError(PROBLEMS))
    assert type(scene) is cc.errors.SceneError and scene.problems == cc.errors.SceneError(PROBLEMS).problems
    error = failure("it stopped")
    other = twin(error)
    assert type(other) is cc.errors.SimulationError and str(other) == str(error)
    assert vars(other) == vars(error)


def test_checks_collect_problems_and_tell_wrong_types_from_wrong_values():
    checks = Checks()
    checks.real("length", "long", "m")
    with pytest.raises(cc.errors.ArgumentTypeError):
        checks.finish()
    checks.real("share", 1.0, "-", least=0.0, below=1.0)
    checks.whole("count", True, least=1)
    checks.word("method", "rodas5", ["rodas5p", "rodas4"])
    with pytest.raises(cc.errors.ArgumentError) as caught:
        checks.finish()
    assert [problem.path for problem in caught.value.problems] == ["length", "share", "count", "method"]


@pytest.mark.parametrize("value", [np.float32(0.5), np.int64(3), np.array(2.5), 7, 0.25])
def test_checks_accept_the_numbers_of_python_and_numpy(value):
    checks = Checks()
    assert checks.real("x", value, "m") == float(value)
    checks.finish()


@pytest.mark.parametrize(
    "value",
    [float("nan"), float("inf"), 10**400, None, "1", 1j, True, [1.0]],
    ids=lambda value: type(value).__name__,
)
def test_checks_refuse_what_is_no_finite_number(value):
    checks = Checks()
    checks.real("x", value, "m")
    with refuses("x"):
        checks.finish()


def test_the_nearest_name_is_offered_only_if_it_is_near():
    assert did_you_mean("slider.xv", ["slider.vx", "rod.angle"]) == '; did you mean "slider.vx"?'
    assert did_you_mean("banana", ["slider.vx", "rod.angle"]) == ""
    assert did_you_mean("Slider.X", ["slider.y", "slider.x", "slider.vx"]) == '; did you mean "slider.x"?'
