"""What is wrong with a scene, for tests of bad input."""

import chebclear as cc
import pytest


def refused(scene):
    """The problems of a scene that must be refused: messages by path."""
    with pytest.raises(cc.errors.SceneError) as caught:
        scene.check()
    return dict(caught.value.problems)
