"""What was asked of a study: its specification, which is saved and compared, and checks of arguments."""

from __future__ import annotations

import dataclasses
import inspect
import math
import pickle
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from importlib import import_module
from typing import Any

import numpy as np

from .. import mechanisms
from ..base.arguments import Checks
from ..base.files import same
from ..base.named import ReadOnlyDict
from ..base.quantities import Written
from ..base.rows import Array
from ..base.shown import did_you_mean, in_a_sentence, meant_or_known
from ..base.units import unit, units_in
from ..errors import ArgumentError, Problem, SceneError
from ..execution.options import OnFailure
from ..run.features import Feature, Window
from ..run.settings import RunOptions, Settings
from ..scene.distributions import Distribution
from ..scene.scene import Interval, Scene
from ..scene.schema import Part, read, write
from .features.traces import BandPower, Crossings, MagnitudeQuantile
from .requirements.specification import Specification
from .sources.asked import FeatureSpec
from .sources.scenes import MOST_NODES, MOST_RUNS

MAX_RUNS = 20_000
"""Default limit of the runs of one call [-]: a minute or two for the paper's mechanism."""


class Absent:
    """What stands for a Python object that could not travel: the name of the function, or of its type."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __repr__(self) -> str:
        return self.name

    def __call__(self, *given: Any, **named: Any) -> Any:
        raise ArgumentError(f"{self.name} is a Python object, which does not travel with a result")


@dataclass(frozen=True, eq=False)
class StudySpec:
    """What was asked of a study: everything that its runs follow from, but not where they are made.

    It is saved, pickled and compared as plain values: a ready-made mechanism by its name, a scene file by its
    text. Python functions do not travel into files; `missing` names them, and `study` needs all of them.

    Its fields are the arguments of `Study` of the same names; the settings have no `rtol` where the user said
    none. One more, `table`, says whether the runs were a table of finished ones, to which none can be added.
    """

    build: Callable[..., Any]
    parameters: Mapping[str, Interval | Distribution]
    outputs: tuple[str, ...] | None = None
    settings: Settings | None = None
    fixed: Mapping[str, Any] = field(default_factory=dict)
    features: Mapping[str, FeatureSpec] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    cycles: int = 1
    on_failure: OnFailure = "collect"
    run_seconds: float | None = field(default=None, metadata=unit("s"))
    """Time limit of a run [s]."""
    requirements: Mapping[str, Specification] = field(default_factory=dict)
    table: bool = False

    def __post_init__(self) -> None:
        for name in ("parameters", "fixed", "features", "units", "requirements"):
            object.__setattr__(self, name, ReadOnlyDict(getattr(self, name)))

    @cached_property
    def intervals(self) -> dict[str, Interval]:
        """Interval of each parameter by name [SI units]."""
        return ReadOnlyDict({name: interval_of(given) for name, given in self.parameters.items()})

    @property
    def nominal(self) -> dict[str, float]:
        """Nominal value of each parameter [SI units]."""
        return {name: side.nominal for name, side in self.intervals.items()}

    @property
    def random(self) -> dict[str, Distribution]:
        """Distributions of the parameters that have one."""
        return {name: one for name, one in self.parameters.items() if isinstance(one, Distribution)}

    @cached_property
    def written(self) -> tuple[str, ...]:
        """Units that the user wrote: in the scene file, with parameters, limits and other arguments."""
        own = [one.unit for one in self.parameters.values()]
        own += getattr(self.build, "written", ()) if hasattr(self.build, "to_toml") else ()
        own += [one for limits in self.requirements.values() for one in limits.written]
        return tuple(dict.fromkeys(filter(None, [*own, *units_in(dict(self.fixed))])))

    def written_for(self, name: str) -> tuple[str, ...]:
        """Units in which a parameter, an output or a feature is shown: its own, or all that were written."""
        if name in self.parameters:
            return tuple(filter(None, [self.parameters[name].unit]))
        own = [
            one for limits in self.requirements.values() if limits.quantity == name for one in limits.written
        ]
        return tuple(dict.fromkeys(own)) or self.written

    def drawn(self, draw: Callable[[dict[str, Interval]], Array]) -> Array:
        """Points of the box that are the same for each parameter wherever the user names it: `draw` makes
        them, shape (runs, parameters), for the parameters in the order in which the model declares them."""
        names = declared_order(self.build, self.intervals)
        points = draw({name: self.intervals[name] for name in names})
        if names == list(self.intervals):
            return points
        return np.ascontiguousarray(points[:, [names.index(name) for name in self.intervals]])

    @property
    def mechanism(self) -> str | None:
        """Name of the ready-made mechanism; None for another one."""
        name = getattr(self.build, "__name__", "")
        return name if name in mechanisms.__all__ and getattr(mechanisms, name) is self.build else None

    @property
    def scene_file(self) -> str | None:
        """Text of the scene file; None without one."""
        written = getattr(self.build, "to_toml", None)
        return None if written is None else str(written())

    @property
    def origin(self) -> str:
        """Module and name of the function that builds scenes or is the model."""
        return named(self.build)

    @property
    def name(self) -> str:
        """What builds scenes, in a word: a mechanism, the title of a scene file, or a function."""
        if self.mechanism is not None:
            return self.mechanism
        return self.origin if self.scene_file is None else f"scene file {getattr(self.build, 'title', '')!r}"

    @property
    def objects(self) -> dict[str, str]:
        """Module and name of each Python object of the study, by its place: ``build``, ``features.NAME``."""
        return {place: named(one) for place, one in self._objects().items()}

    @property
    def missing(self) -> tuple[str, ...]:
        """Those of them that did not travel."""
        return tuple(one.name for one in self._objects().values() if isinstance(one, Absent))

    def study(self) -> Any:
        """The study, with runs on threads of this process and without a store.

        Raises
        ------
        ValueError
            If a Python object did not travel, or the runs were a table.
        """
        if self.table:
            raise ArgumentError("a table of finished runs has no further ones: make a new table")
        if self.missing:
            raise ArgumentError(
                f"{in_a_sentence(self.missing)} did not travel with the result, as Python code does not: "
                "make the Study with it again, and call study.extended(result, runs) or "
                "study.worst_cases(result)"
            )
        options: dict[str, Any] = {"cycles": self.cycles} if self.cycles != 1 else {}
        if self.settings is not None:
            options = {name: getattr(self.settings, name) for name in RunOptions.__annotations__}
        return public("Study")(
            self.build,
            self.parameters,
            self.outputs,
            fixed=self.fixed,
            features=self.features,
            units=self.units,
            on_failure=self.on_failure,
            run_seconds=self.run_seconds,
            requirements=self.requirements or None,
            **options,
        )

    def facts(self) -> dict[str, Any]:
        """The specification as JSON values; Python objects by their names."""
        build: dict[str, Any] = {"python": self.origin}
        if self.mechanism is not None:
            build = {"mechanism": self.mechanism}
        elif (text := self.scene_file) is not None:
            build = {"scene_file": text}
        return {
            "build": build,
            "parameters": {name: given.facts() for name, given in self.parameters.items()},
            "outputs": None if self.outputs is None else list(self.outputs),
            "settings": None if self.settings is None else dataclasses.asdict(self.settings),
            "fixed": {name: written(value) for name, value in self.fixed.items()},
            "features": {name: written(one) for name, one in self.features.items()},
            "units": dict(self.units),
            "requirements": {name: dataclasses.asdict(one) for name, one in self.requirements.items()},
            **{name: getattr(self, name) for name in _PLAIN},
        }

    @classmethod
    def from_facts(cls, facts: Mapping[str, Any], objects: Mapping[str, Any] | None = None) -> StudySpec:
        """The specification from its JSON values, and from Python objects by their places in it."""
        known, settings, outputs = dict(objects or {}), facts["settings"], facts["outputs"]

        def restored(place: str) -> dict[str, Any]:
            return {name: known.get(f"{place}.{name}", as_it_was(one)) for name, one in facts[place].items()}

        return cls(
            build=known["build"] if "build" in known else _build_of(facts["build"]),
            parameters={name: Written.from_facts(given) for name, given in facts["parameters"].items()},
            outputs=None if outputs is None else tuple(outputs),
            settings=None if settings is None else Settings.from_dict(settings),
            fixed=restored("fixed"),
            features=restored("features"),
            units=facts["units"],
            requirements={name: Specification(**one) for name, one in facts["requirements"].items()},
            **{name: facts[name] for name in _PLAIN},
        )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, StudySpec):
            return NotImplemented
        # Equal numbers of parameters are equal in whatever unit they were written.
        own, theirs = (one.facts() | {"parameters": dict(one.parameters)} for one in (self, other))
        return same(own, theirs)

    __hash__ = None  # type: ignore[assignment]

    def __copy__(self) -> StudySpec:
        return self

    def __deepcopy__(self, memory: object) -> StudySpec:
        return self

    def __reduce__(self) -> tuple[Callable[..., StudySpec], tuple[dict[str, Any], dict[str, bytes]]]:
        packed = {name: _packed(one) for name, one in self._objects().items()}
        return _unpacked, (self.facts(), {name: one for name, one in packed.items() if one is not None})

    def _objects(self) -> dict[str, Any]:
        """What has no plain form, by its place."""
        objects: dict[str, Any] = {}
        if not self.table and self.mechanism is None and self.scene_file is None:
            objects["build"] = self.build
        for place, values in (("fixed", self.fixed), ("features", self.features)):
            objects |= {f"{place}.{name}": one for name, one in values.items() if not _is_plain(written(one))}
        return objects


# Fields that files have as they are.
_PLAIN = ("cycles", "on_failure", "run_seconds", "table")
_SAMPLED = {kind.__name__: kind for kind in (BandPower, Crossings, MagnitudeQuantile)}


def named(one: object) -> str:
    """Module and name of a function, or of the type of another object."""
    if isinstance(one, Absent):
        return one.name
    own = one if hasattr(one, "__qualname__") else type(one)
    return f"{own.__module__}.{own.__qualname__}"


def written(value: Any) -> Any:
    """A value as JSON has it: plain ones as they are, others in an object that says what they are."""
    if isinstance(value, np.generic):
        value = value.item()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, list):
        return [written(item) for item in value]
    if isinstance(value, tuple):
        return {"tuple": [written(item) for item in value]}
    if isinstance(value, Mapping) and all(isinstance(name, str) for name in value):
        return {"mapping": {name: written(item) for name, item in value.items()}}
    if isinstance(value, np.ndarray) and value.dtype.kind in "biufU":
        return {"array": value.tolist(), "type": value.dtype.str}
    if isinstance(value, Feature):
        window = value.window
        own = [] if window is None else [window.of, window.lower, window.upper]
        return {"feature": [value.kind, value.of, *own]}
    if type(value) in _SAMPLED.values():
        return {"sampled": type(value).__name__, "numbers": list(dataclasses.astuple(value))}
    if isinstance(value, Part):
        problems: list[Problem] = []
        plain = write(value, (type(value),), "", problems)
        if not problems:
            return {"record": type(value).__name__, "fields": plain}
    return {"python": named(value)}


def as_it_was(plain: Any) -> Any:
    """The value that `written` wrote; an `Absent` one for Python objects."""
    if isinstance(plain, list):
        return [as_it_was(item) for item in plain]
    match plain:
        case {"tuple": items}:
            return tuple(as_it_was(item) for item in items)
        case {"mapping": items}:
            return {name: as_it_was(item) for name, item in items.items()}
        case {"array": items, "type": kind}:
            return np.array(items, dtype=kind)
        case {"feature": [kind, of, *window]}:
            return Feature(kind, of, Window(*window) if window else None)
        case {"sampled": kind, "numbers": numbers}:
            return _SAMPLED[kind](*numbers)
        case {"record": name, "fields": fields}:
            problems: list[Problem] = []
            record = read(fields, (_records()[name],), "", problems)
            if problems:
                raise SceneError(problems)
            return record
        case {"python": name}:
            return Absent(name)
    return plain


def _is_plain(value: Any) -> bool:
    """Whether what `written` returns holds no Python object."""
    if isinstance(value, list):
        return all(map(_is_plain, value))
    if isinstance(value, dict):
        return "python" not in value and all(map(_is_plain, value.values()))
    return True


def _records() -> dict[str, type[Part]]:
    """The records of scenes by name."""
    found, left = {}, [Part]
    while left:
        part = left.pop()
        found[part.__name__] = part
        left += part.__subclasses__()
    return found


def _build_of(plain: Mapping[str, str]) -> Callable[..., Any]:
    """A mechanism by its name, or a scene file by its text, as the script of a report has them."""
    match plain:
        case {"mechanism": name} if name in mechanisms.__all__:
            made: Callable[..., Any] = getattr(mechanisms, name)
            return made
        case {"scene_file": text}:
            template: Callable[..., Any] = public("loads")(text)
            return template
        case {"python": origin}:
            return Absent(origin)
    raise ValueError(f"{plain} builds no scene")


def public(name: str) -> Any:
    """What the package has under a public name.

    A specification makes a study as the script in a report does, by public names: what makes studies and
    reads scene files returns and uses specifications, and so cannot be imported here.
    """
    return getattr(import_module(__name__.partition(".")[0]), name)


def _packed(one: object) -> bytes | None:
    """A Python object for another process; None if it cannot leave this one."""
    try:
        return None if isinstance(one, Absent) else pickle.dumps(one)
    except Exception:  # whatever the object or its parts raise
        return None


def _unpacked(facts: Mapping[str, Any], packed: Mapping[str, bytes]) -> StudySpec:
    """The specification from a pickle; what is not known in this process is absent."""
    objects = {}
    for name, one in packed.items():
        try:
            objects[name] = pickle.loads(one)
        except Exception:  # its module may be missing, or have changed
            continue
    return StudySpec.from_facts(facts, objects)


def interval_of(given: Interval | Distribution) -> Interval:
    """The interval of a parameter."""
    return given if isinstance(given, Interval) else given.interval


def checked_intervals(checks: Checks, parameters: object) -> dict[str, Interval]:
    """The sides of the box."""
    if not isinstance(parameters, Mapping):
        checks.add("parameters", f"must map names to intervals, got {parameters!r}", wrong_type=True)
        return {}
    if not parameters:
        checks.add("parameters", "must name at least one interval")
    checks.names("parameters", parameters)
    for name, side in parameters.items():
        if not isinstance(side, Interval | Distribution):
            wrong = f"must be an Interval(lower, upper), got {side!r}"
            checks.add(f'parameters["{name}"]', wrong, wrong_type=True)
    return {
        name: interval_of(side)
        for name, side in parameters.items()
        if isinstance(side, Interval | Distribution)
    }


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
            checks.add(name, f'has the unknown parameter "{key}"{did_you_mean(key, known)}')
    counts = []
    for key, bound in zip(known, least, strict=True):
        if key in given:
            counts.append(checks.whole(f'{name}["{key}"]', given[key], least=bound, most=most))
        else:
            checks.add(name, f'misses the parameter "{key}"')
            counts.append(bound)
    return counts


def check_runs(counts: Sequence[int], max_runs: int, fewer: str) -> None:
    """Refuse numbers of runs that would fill the memory or take hours, before the first run."""
    runs = math.prod(counts)
    grid = " x ".join(map(str, counts))
    if runs > MOST_RUNS:
        raise ArgumentError(f"a study must have at most {MOST_RUNS} runs, got {grid} = {runs}")
    if runs > max_runs:
        raise ArgumentError(f"{grid} = {runs} runs are more than max_runs = {max_runs}: take {fewer}")


def returns_a_scene(build: object) -> bool:
    """Whether `build` says that it returns a scene, as ready-made mechanisms and annotated functions do."""
    try:
        returned = inspect.signature(build).return_annotation  # type: ignore[arg-type]
    except (TypeError, ValueError):  # no callable, or one without a signature
        return False
    return returned is Scene or (isinstance(returned, str) and returned.rpartition(".")[2] == Scene.__name__)


def declared_order(build: Callable[..., Any], names: Iterable[str]) -> list[str]:
    """Names of parameters in the order in which `build` declares them; those without one last, sorted."""
    try:
        known = list(inspect.signature(build).parameters)
    except (TypeError, ValueError):  # a callable without a signature, such as some compiled ones
        known = []
    # Those of the function itself come before what it takes as **options, which signatures show further up.
    code = getattr(inspect.unwrap(build), "__code__", None)
    if code is not None:
        known = [*code.co_varnames[: code.co_argcount + code.co_kwonlyargcount], *known]
    return sorted(names, key=lambda name: (known.index(name) if name in known else len(known), name))


def check_keywords(checks: Checks, build: object, intervals: Iterable[str], fixed: Iterable[str]) -> None:
    """Check that `build` can be called with these keywords, as far as its signature is known."""
    for name in sorted(set(intervals) & set(fixed)):
        checks.add(name, "is both a parameter and fixed")
    if not callable(build):
        checks.add("build", f"must be callable, got {build!r}", wrong_type=True)
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
                checks.add("build", f'has no parameter "{name}"{meant_or_known(name, known)}')
    for name in needed:
        if name not in given:
            checks.add("build", f'needs a value for "{name}": give it in parameters or fixed')
