"""Exceptions and warnings of the package; all of them pickle and copy.

``ChebclearError`` is the base of all exceptions. A wrong argument of a function is an ``ArgumentError``, also
a ``ValueError``, or an ``ArgumentTypeError``, also a ``TypeError``, of a wrong type; an unknown name is an
``UnknownNameError``, also a ``KeyError``.
"""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

__all__ = [
    "ArgumentError",
    "ArgumentTypeError",
    "ChebclearError",
    "ChebclearWarning",
    "HorizonWarning",
    "InputError",
    "MemoryLimitError",
    "MissingProgramError",
    "Problem",
    "SceneError",
    "SettingsError",
    "SimulationError",
    "StartError",
    "StoreError",
    "UnknownNameError",
]

# Characters of a message that someone reads [-].
_READ = 1000
# What moves the cursor of a terminal, colors it or ends a line, and halves of letters, which no file holds.
_CONTROL = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff]")


def is_plain(text: str) -> bool:
    """Whether a text holds only what can be seen: no control characters, no ends of lines."""
    return _CONTROL.search(text) is None


def visible(text: str, kept: str = "\t\n") -> str:
    """A text with its control characters written out, so that a terminal shows and does not obey them.

    Parameters
    ----------
    text : str
        What may hold names from files of strangers.
    kept : str
        Control characters that stay.

    Examples
    --------
    >>> print(visible("\\x1b[2Jrod"))
    \\x1b[2Jrod
    """
    return _CONTROL.sub(lambda found: found[0] if found[0] in kept else ascii(found[0])[1:-1], text)


class Problem(NamedTuple):
    """One problem of an input."""

    path: str
    """Path of the field, such as ``joints[2].clearance``."""
    message: str
    """What is wrong and what would be accepted."""

    def __str__(self) -> str:
        return f"{self.path}: {self.message}"


class UnknownKey(Problem):
    """The problem of a key or field that there is not."""


class ChebclearError(Exception):
    """Base of all exceptions of this package."""

    def __str__(self) -> str:
        return visible(super().__str__())


class ArgumentError(ChebclearError, ValueError):
    """An argument that a function does not accept, as opposed to a wrong scene or a run that fails.

    `problems` has the name of each wrong argument and what is wrong with it, if they were checked together.
    """

    problems: tuple[Problem, ...] = ()


class ArgumentTypeError(ChebclearError, TypeError):
    """An argument of a wrong type; `problems` as of `ArgumentError`."""

    problems: tuple[Problem, ...] = ()


class UnknownNameError(ChebclearError, KeyError):
    """A name of an output, feature or parameter that there is not."""

    def __str__(self) -> str:
        # A KeyError puts quotes around its text.
        return visible(str(self.args[0])) if self.args else ""


class InputError(ChebclearError, ValueError):
    """An input that cannot be simulated: a scene, settings, or the end of an earlier run.

    Parameters
    ----------
    problems : iterable of (str, str)
        Path and message of every problem.

    Attributes
    ----------
    problems : list of Problem
        All of them, in the order of the input.
    """

    problems: list[Problem]

    def __init__(self, problems: Iterable[tuple[str, str]]) -> None:
        self.problems = [one if isinstance(one, Problem) else Problem(*one) for one in problems]
        super().__init__(self.problems)

    def __str__(self) -> str:
        return visible("\n".join(map(str, self.problems)))


class SceneError(InputError):
    """A scene that cannot be simulated; see `InputError`."""


class SettingsError(InputError):
    """Settings that do not fit a scene, such as an output that it does not have; see `InputError`."""


class StartError(InputError):
    """The end of an earlier run from which a scene cannot continue; see `InputError`."""


class SimulationError(ChebclearError, RuntimeError):
    """A simulation that did not reach its end.

    Parameters
    ----------
    reason : str
        The status word of the run, such as ``"step_underflow"``.
    time : float
        Time at which it ended [s].
    joint : str, optional
        Name of the clearance joint at fault, if it is known to be one.
    parameters : mapping of str to float, optional
        Parameters of the run, if it was one of a study [SI units].
    message : str
        What happened in words, with the time and such a joint.
    load : str, optional
        Name of the force, torque or spring that could not be followed further, if it is known to be one.

    Attributes
    ----------
    reason, time, joint, parameters, message, load
        As above.
    trajectory : Trajectory or None
        What was computed until then, if the run was a single simulation; samples after `time` are NaN.
    """

    def __init__(
        self,
        reason: str,
        time: float,
        joint: str | None = None,
        parameters: Mapping[str, float] | None = None,
        message: str = "",
        load: str | None = None,
    ) -> None:
        self.reason = reason
        self.time = time
        self.joint = joint
        self.parameters = None if parameters is None else dict(parameters)
        self.message = message
        self.load = load
        # A Trajectory; not typed as one, since errors import no other room.
        self.trajectory: Any = None
        super().__init__(reason, time, joint, self.parameters, message, load)

    def __str__(self) -> str:
        where = "" if self.joint is None else f', joint "{self.joint}"'
        what = self.message or f"it ended at t = {self.time:.9g} s{where}"
        given = f", with {describe(self.parameters)}" if self.parameters else ""
        return visible(f"the simulation failed ({self.reason}): {what}{given}")


class MissingProgramError(ChebclearError, RuntimeError):
    """Something was asked for that needs a program which is not installed, as LaTeX or ffmpeg."""


class MemoryLimitError(ChebclearError, MemoryError):
    """A study that does not fit into the memory that this process may take; nothing was simulated."""


class StoreError(ChebclearError, OSError):
    """A store of runs that cannot be used: it is another study's, in use, read-only or on a full disk."""


class ChebclearWarning(UserWarning):
    """Something that should be checked but did not stop the computation."""

    def __str__(self) -> str:
        return visible(super().__str__())


class HorizonWarning(ChebclearWarning):
    """A run that continues where single values are not predictable; the text says what to call instead."""


def warn(message: str, category: type[Warning] = ChebclearWarning) -> None:
    """Issue a warning at the line that called the package, however deep in it the cause is."""
    package = __name__.partition(".")[0]
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] == package:
        frame, level = frame.f_back, level + 1
    warnings.warn(message, category, stacklevel=level)


def describe(parameters: Mapping[str, float]) -> str:
    """Parameters in words, such as ``"crank_length = 0.05, rod_length = 0.12"``."""
    return ", ".join(f"{name} = {float(value)!r}" for name, value in parameters.items())


def cut(text: str) -> str:
    """A text of any length, as far as someone reads it.

    Examples
    --------
    >>> len(cut("x" * 50_000_000))
    1025
    """
    return text if len(text) <= _READ else f"{text[:_READ]}... ({len(text)} characters)"


def error_text(error: BaseException) -> str:
    """Type and message of an error, also if the message is endless or cannot be made.

    Examples
    --------
    >>> error_text(ValueError("no license"))
    'ValueError: no license'
    """
    try:
        message = str(error)
    except BaseException as another:  # the message is code of the user's too
        message = f"(its message raises {type(another).__name__})"
    return cut(f"{type(error).__name__}: {message}")
