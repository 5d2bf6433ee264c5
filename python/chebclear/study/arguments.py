"""Checks of the arguments of a study, and its progress reports."""

from __future__ import annotations

import inspect
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from ..base.arguments import Checks, did_you_mean, meant_or_known
from ..errors import ArgumentError
from ..scene.scene import Interval, Scene
from .band.hybrid import Normal, Uniform
from .runs import MOST_NODES, MOST_RUNS

MAX_RUNS = 20_000
"""Default limit of the runs of one call [-]: a minute or two for the paper's mechanism."""


def checked_intervals(checks: Checks, parameters: object) -> dict[str, Interval]:
    """The sides of the box."""
    if not isinstance(parameters, Mapping):
        checks.add(f"parameters must map names to intervals, got {parameters!r}", wrong_type=True)
        return {}
    if not parameters:
        checks.add("parameters must name at least one interval")
    checks.names("parameters", parameters)
    for name, side in parameters.items():
        if not isinstance(side, Interval | Normal | Uniform):
            checks.add(
                f'parameters["{name}"] must be an interval(lower, upper), got {side!r}', wrong_type=True
            )
    return {
        name: side if isinstance(side, Interval) else Interval(*side.reach)
        for name, side in parameters.items()
        if isinstance(side, Interval | Normal | Uniform)
    }


def checked_fixed(checks: Checks, fixed: object) -> dict[str, Any]:
    """The keywords that are the same for all runs."""
    if fixed is None:
        return {}
    if not isinstance(fixed, Mapping):
        checks.add(f"fixed must map names to values, got {fixed!r}", wrong_type=True)
        return {}
    return dict(fixed)


def per_parameter(
    checks: Checks,
    name: str,
    given: object,
    intervals: Iterable[str],
    least: Sequence[int],
    most: int = MOST_NODES,
) -> list[int]:
    """One whole number for every parameter, from one for all or a mapping by name."""
    if not isinstance(given, Mapping):
        return [checks.whole(name, given, least=max(least, default=1), most=most)] * len(least)
    known = list(intervals)
    for key in given:
        if key not in known:
            checks.add(f'{name} has the unknown parameter "{key}"{did_you_mean(key, known)}')
    counts = []
    for key, bound in zip(known, least, strict=True):
        if key in given:
            counts.append(checks.whole(f'{name}["{key}"]', given[key], least=bound, most=most))
        else:
            checks.add(f'{name} misses the parameter "{key}"')
            counts.append(bound)
    return counts


def check_runs(counts: Sequence[int], max_runs: int, fewer: str) -> None:
    """Refuse numbers of runs that would fill the memory or take hours, before the first run."""
    runs = math.prod(counts)
    grid = " x ".join(map(str, counts))
    if runs > MOST_RUNS:
        raise ArgumentError(f"a study must have at most {MOST_RUNS} runs, got {grid} = {runs}")
    if runs > max_runs:
        raise ArgumentError(
            f"{grid} = {runs} runs are more than max_runs = {max_runs}: take {fewer}, or allow them with "
            f"max_runs={runs}"
        )


def returns_a_scene(build: object) -> bool:
    """Whether `build` says that it returns a scene, as ready-made mechanisms and annotated functions do."""
    try:
        returned = inspect.signature(build).return_annotation  # type: ignore[arg-type]
    except (TypeError, ValueError):  # no callable, or one without a signature
        return False
    return returned is Scene or (isinstance(returned, str) and returned.rpartition(".")[2] == Scene.__name__)


def check_keywords(checks: Checks, build: object, intervals: Iterable[str], fixed: Iterable[str]) -> None:
    """Check that `build` can be called with these keywords, as far as its signature is known."""
    for name in sorted(set(intervals) & set(fixed)):
        checks.add(f'"{name}" is both a parameter and fixed')
    if not callable(build):
        checks.add(f"build must be callable, got {build!r}", wrong_type=True)
        return
    try:
        signature = inspect.signature(build).parameters.values()
    except (TypeError, ValueError):  # a callable without a signature, such as some compiled ones
        return
    by_keyword = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    known = [item.name for item in signature if item.kind in by_keyword]
    needed = [item.name for item in signature if item.kind in by_keyword and item.default is item.empty]
    given = list(dict.fromkeys([*intervals, *fixed]))
    if not any(item.kind is item.VAR_KEYWORD for item in signature):
        for name in given:
            if name not in known:
                checks.add(f'build has no parameter "{name}"{meant_or_known(name, known)}')
    for name in needed:
        if name not in given:
            checks.add(f'build needs a value for "{name}": give it in parameters or fixed')
