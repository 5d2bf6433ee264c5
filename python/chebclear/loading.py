"""Results from files, whatever they hold."""

from __future__ import annotations

import os
from typing import TypeAlias, get_args

from .base.files import kind_of
from .decisions.allocation import Allocation
from .decisions.centering import Centering
from .decisions.contrast import Contrast
from .decisions.identification import Identification
from .decisions.lost_motion import LostMotion
from .decisions.measured import Measured
from .decisions.modes import Modes
from .decisions.rare_result import RareShare
from .decisions.stack_up_result import StackUp
from .decisions.wear import WearLife
from .errors import ArgumentError
from .run.signals import Cycles, Spectrum
from .run.trajectory import Trajectory
from .study.bifurcation import Bifurcation
from .study.comparison import Comparison
from .study.requirements.conformance import Conformance
from .study.results import StudyResult
from .study.runs import Runs
from .study.sweep import Sweep
from .tradeoffs.bounds import StudyTradeoff
from .tradeoffs.result import Tradeoff

Saved: TypeAlias = (
    Trajectory
    | StudyResult
    | Runs
    | Tradeoff
    | StudyTradeoff
    | Bifurcation
    | Comparison
    | Conformance
    | RareShare
    | Sweep
    | Spectrum
    | Cycles
    | Modes
    | LostMotion
    | WearLife
    | Allocation
    | Contrast
    | Centering
    | StackUp
    | Identification
    | Measured
)

_CLASSES = {kind.kind_of_file: kind for kind in get_args(Saved)}


def load_result(path: str | os.PathLike[str]) -> Saved:
    """Read what ``save`` of a result wrote, whichever result it is.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    Trajectory, StudyResult, Sweep, Modes or another result that has ``save``
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
    found: Saved = _CLASSES[kind].load(path)
    return found
