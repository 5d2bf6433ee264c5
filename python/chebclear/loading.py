"""Results from files, whatever they hold."""

from __future__ import annotations

import os

from .base.files import kind_of
from .errors import ArgumentError
from .run.trajectory import Trajectory
from .study.results import StudyResult
from .tradeoffs.result import Tradeoff

_CLASSES: dict[str, type[Trajectory | StudyResult | Tradeoff]] = {
    "trajectory": Trajectory,
    "study": StudyResult,
    "tradeoff": Tradeoff,
}


def load_result(path: str | os.PathLike[str]) -> Trajectory | StudyResult | Tradeoff:
    """Read what `Trajectory.save`, `StudyResult.save` or `Tradeoff.save` wrote.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    Trajectory, StudyResult or Tradeoff
        What was saved.

    Raises
    ------
    ValueError
        If the file holds something else, is damaged, or was written by a later version.

    Examples
    --------
    >>> import chebclear as cc
    >>> from tempfile import TemporaryDirectory
    >>> scene = cc.mechanisms.slider_crank()
    >>> run = cc.simulate(scene, duration=0.01, samples=101)
    >>> with TemporaryDirectory() as folder:
    ...     again = cc.load_result(run.save(f"{folder}/run.npz"))
    >>> again == run
    True
    """
    kind = kind_of(path)
    if kind not in _CLASSES:
        raise ArgumentError(f"{os.fspath(path)} holds a {kind}, which is none of {', '.join(_CLASSES)}")
    return _CLASSES[kind].load(path)
