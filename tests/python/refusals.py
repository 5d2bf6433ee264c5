"""What is wrong with a scene or with the arguments of a call, for tests of bad input."""

from contextlib import contextmanager

import chebclear as cc
import pytest
from chebclear.errors import ArgumentError, ArgumentTypeError, InputError


def refused(scene):
    """The problems of a scene that must be refused: messages by path."""
    with pytest.raises(cc.errors.SceneError) as caught:
        scene.check()
    return dict(caught.value.problems)


@contextmanager
def refuses(*names, error=(ArgumentError, ArgumentTypeError, InputError)):
    """The block raises an error whose problems are those of these arguments or fields, and no others."""
    with pytest.raises(error) as caught:
        yield
    assert {problem.path for problem in caught.value.problems} == set(names)
