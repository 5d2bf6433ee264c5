"""The script in a report that reproduces its study."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ...report.document import Listing
from ...run.features import Feature
from ...run.report import settings_in_script
from ...scene.distributions import Distribution
from ...scene.motions import Motion, Speed
from ...scene.schema import Part

if TYPE_CHECKING:
    from ..requirements.specification import Specification
    from ..results import StudyResult
    from ..spec import StudySpec

# Public modules by the files in which records of scenes stand; the others are in the package itself.
_ROOMS = {"laws": "laws.", "functions": "motions."}


def study_listings(result: StudyResult) -> tuple[Listing, str]:
    """The script, and its description in words.

    A ready-made mechanism is called by its name, and a scene file is part of the script. Other callables
    cannot be written to a script, which then imports them by name.
    """
    spec = result.spec
    ready_made = None if spec is None else spec.mechanism
    callable_text = f"cc.mechanisms.{ready_made}" if ready_made else "build"
    assert result.settings is not None, "of simulated runs"
    own, requirement = result.settings, result.requirement
    if requirement is not None and requirement.revolutions is not None:  # which chose times and samples
        own = dataclasses.replace(own, skip=0.0, samples=requirement.revolutions.samples, cycles=1)
    settings = settings_in_script(own)
    settings.pop("outputs", None)
    included = 0 if requirement is None else len(result.parameters) - requirement.runs
    lines = ["import chebclear as cc", ""]
    text = None if spec is None else spec.scene_file
    if text is not None:
        # As it is read, wherever quotes allow it.
        quoted = repr(text) if "'''" in text else f"r'''\n{text}'''"
        lines += ["# The scene file.", f"build = cc.loads({quoted})", ""]
    elif not ready_made:
        origin = "not stored: import your model" if spec is None else spec.origin
        lines += [
            f"# What builds a scene from the parameters; it was {origin}.",
            f"from model import {callable_text}",
            "",
        ]
    parameters = result.intervals if spec is None else spec.parameters
    lines += [
        "study = cc.Study(",
        f"    {callable_text},",
        "    {",
        *(f"        {name!r}: {_written(given)}," for name, given in parameters.items()),
        "    },",
        *([f"    outputs={list(result.bands)!r},"] if result.bands else []),
        *(f"    {name}={value!r}," for name, value in settings.items()),
        *_further(spec),
        *_features(spec),
        ")",
        *([f"# {included} runs of other results were included, by include=..."] if included else []),
        *([f"# It was stopped after {len(result.parameters)} runs."] if result.status == "stopped" else []),
        f"result = {_call(result)}",
        "print(result)",
    ]
    whole = spec is not None and not spec.objects
    meaning = "The script of this study" if whole else "A script of this study, which needs your model"
    return Listing("study.py", "\n".join(lines) + "\n", meaning), meaning


def _further(spec: StudySpec | None) -> list[str]:
    """Further keywords of the study that the user gave."""
    if spec is None:
        return []
    lines = []
    own = {place: name for place, name in spec.objects.items() if place.startswith("fixed.")}
    pairs = [f"{name!r}: {_value(one)}" for name, one in spec.fixed.items() if f"fixed.{name}" not in own]
    if pairs:
        lines.append(f"    fixed={{{', '.join(pairs)}}},")
    lines += [f"    # {place}: an object of your own, {name}" for place, name in own.items()]
    if spec.units:
        lines.append(f"    units={dict(spec.units)!r},")
    if spec.on_failure != "collect":
        lines.append(f"    on_failure={spec.on_failure!r},")
    if spec.run_seconds is not None:
        lines.append(f"    run_seconds={spec.run_seconds!r},")
    if spec.requirements:
        limits = [f"{name!r}: {_required(one)}" for name, one in spec.requirements.items()]
        lines.append(f"    requirements={{{', '.join(limits)}}},")
    return lines


def _required(one: Specification) -> str:
    """A requirement as the script has it."""
    given = {name: value for name, value in dataclasses.asdict(one).items() if value is not None}
    quantity = given.pop("quantity")
    return f"cc.require({', '.join([repr(quantity), *(f'{name}={end!r}' for name, end in given.items())])})"


def _value(value: Any) -> str:
    """A value as the script has it, which imports neither NumPy nor the user's modules."""
    if isinstance(value, Part):
        fields = ", ".join(f"{name}={_value(getattr(value, name))}" for name in value.__match_args__)
        name = type(value).__name__
        file = type(value).__module__.rpartition(".")[2]
        room = "motions." if isinstance(value, Motion | Speed) else _ROOMS.get(file, "")
        return f"cc.{room}{name}({fields})"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key!r}: {_value(item)}" for key, item in value.items()) + "}"
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, list | tuple):
        items = ", ".join(map(_value, value))
        return f"[{items}]" if isinstance(value, list) else f"({items}{',' * (len(value) == 1)})"
    if isinstance(value, float) and not math.isfinite(value):
        return f'float("{value}")'
    return repr(value)


def _written(given: Any) -> str:
    """A parameter as the script has it."""
    if isinstance(given, Distribution):
        values = []
        for item in dataclasses.fields(given):
            value = getattr(given, item.name)
            if item.default is dataclasses.MISSING:
                values.append(_written(value) if isinstance(value, Distribution) else repr(value))
            elif value != item.default:
                values.append(f"{item.name}={value!r}")
        return f"cc.{given.written_as}({', '.join(values)})"
    return f"cc.{given!r}"


def _features(spec: StudySpec | None) -> list[str]:
    """The features; those that are functions are left to the reader."""
    if spec is None or not spec.features:
        return []
    lines = ["    features={"]
    for name, feature in spec.features.items():
        if isinstance(feature, Feature):
            window = feature.window
            while_ = "" if window is None else f", {(window.of, window.lower, window.upper)!r}"
            lines.append(f"        {name!r}: cc.features.{feature.kind}({feature.of!r}{while_}),")
        else:
            lines.append(f"        # {name!r}: a function of your own, {spec.objects[f'features.{name}']}")
    return [*lines, "    },"]


def _call(result: StudyResult) -> str:
    """The call that made the result."""
    requirement = result.requirement
    if requirement is not None:
        known: dict[str, Any] = {"runs": requirement.runs + len(result.failures)}
        known |= {"coverage": requirement.coverage, "rng": requirement.seed}
        known |= {} if result.settings is None else {"rtol": result.settings.rtol}
        if requirement.confidence is not None:
            known["confidence"] = requirement.confidence
        if requirement.revolutions is not None:
            turns = requirement.revolutions
            known |= {
                "revolutions": turns.kept + turns.discarded,
                "discard": turns.discarded,
                "angle": turns.joint,
            }
        arguments = ", ".join(f"{name}={value!r}" for name, value in known.items())
        return f"study.band({arguments})"
    names = list(result.intervals)
    if result.degrees is not None:
        degrees = dict(zip(names, result.degrees, strict=True))
        nodes = dict(zip(names, result.nodes, strict=True))
        bounds = "" if result.bounds == "range" else f", bounds={result.bounds!r}"
        return f"study.chebyshev(degree={degrees!r}, nodes={nodes!r}{bounds})"
    if result.kind == "scan":
        return f"study.scan({dict(zip(names, result.nodes, strict=True))!r})"
    seed = "" if result.seed is None else f", rng={result.seed}"
    return f"study.sample({len(result.parameters) + len(result.failures)}{seed})"
