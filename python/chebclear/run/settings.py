"""How a simulation is run."""

from __future__ import annotations

import dataclasses
import json
import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypedDict

from .. import _core
from ..base.arguments import Checks
from ..base.files import package_version
from ..base.named import matching
from ..base.options import Documented, with_fields
from ..base.shown import Shown, did_you_mean, meant_or_known
from ..base.units import unit, units
from ..errors import SettingsError, is_plain
from ..scene.parts import Inspection
from ..scene.scene import Scene, revolution_time
from ..scene.schema import as_json_number
from .features import JOINT_KINDS, Feature, checked_features
from .memory import require_memory
from .names import output_meant

METHODS = _core.METHODS
"""Words for the methods."""
RTOL = 1e-6
"""Relative tolerance of a run where nothing was said [-]."""
LEAST_RTOL, MOST_RTOL = _core.RTOL_RANGE
"""Relative tolerances that are accepted [-]."""
MOST_SAMPLES = _core.MOST_SAMPLES
"""Samples of a run that are accepted [-]."""
MAX_STEPS, MAX_EVENTS = 10_000_000, 1_000_000  # some minutes of work
MOST_PERIODS = 1_000_000
"""Periods or revolutions of a run that are accepted [-]: their samples take 8 MB."""

# Placeholders for fields that are missing or of a wrong type, so that the core can check the others.
_EXAMPLE: dict[str, Any] = {"duration": 1.0, "samples": 2, "method": METHODS[0]}
# Of the samples of a run that must fit into the memory [-]: processing them takes as much again.
_COPIES = 2.0


class SpanOptions(TypedDict, total=False):
    """Fields of `Settings` for the simulated time, as keywords."""

    duration: float
    samples: int
    skip: float


class StepOptions(TypedDict, total=False):
    """Fields of `Settings` for the integration, as keywords."""

    rtol: float
    method: str
    max_step: float | None
    max_steps: int
    max_events: int
    position_tolerance: float | None
    velocity_tolerance: float | None


class RunOptions(SpanOptions, StepOptions, total=False):
    """Fields of `Settings` for a run, as keywords."""

    cycles: int


@dataclass(frozen=True, repr=False, kw_only=True)
class Settings(Shown):
    """All options of a run.

    `simulate`, `Study`, `tradeoff` and `bifurcation` take an instance as ``settings=``. They also take the
    fields as keywords, which take precedence, except those that they determine themselves.

    Parameters
    ----------
    duration : float
        Simulated time [s], above 0. If not given, `simulate` and `Study` take one revolution of the slowest
        drive where drives at constant speed prescribe the whole motion, as of a mechanism without play.
    samples : int
        Number of equally spaced samples, both ends included [-]; 2 to 10 000 000. Does not change the
        steps.
    skip : float
        Time to simulate before the first sample [s], such as ``10 * scene.period`` for a mechanism to settle.
    rtol : float, optional
        Relative tolerance of the integrator [-], from 1e-13 to 0.1. If not given 1e-6, and 1e-4 in bands; in
        the settings of results it is that of their runs.
    method : {"auto", "rodas5p", "rodas4", "dop853", "adams"}
        ``"auto"`` switches between an explicit multistep method, the Adams method of variable order, and a
        Rosenbrock method (Rodas4, or Rodas5P at an rtol below 1e-5): it tries both now and then and keeps the
        one whose progress costs fewer evaluations; the others use one method throughout. ``"adams"`` and
        ``"dop853"`` alone are much more expensive where a contact sticks, though not less accurate.
    outputs : sequence of str, optional
        Names of the columns to return, or patterns such as ``"energy.*"``; all quantities of bodies,
        clearance joints and drives if not given. ``scene.check()`` lists them, and further ones.
    max_step : float, optional
        Longest step of the integrator [s]; no limit if not given, or infinite. Loads that depend on time or
        on the motion limit steps themselves where they change faster than a step sees; this is for what no
        run can know.
    max_steps, max_events : int
        Attempted steps, accepted or rejected, and changes of contact after which a run fails [-].
    position_tolerance : float, optional
        Absolute tolerance of positions [m], at most half the smallest clearance, or the size of a scene
        without one; from `rtol` and this scale if not given.
    velocity_tolerance : float, optional
        Absolute tolerance of velocities [m/s], at most the speed of the scene; from `rtol` and this scale if
        not given. Both are tightened, up to thirtyfold, while an impact lasts, and that of velocities where a
        contact slides slowly.
    features : sequence of Feature, optional
        Features to compute during the run, such as ``[features.peak("slider.ax")]``.
        `Trajectory.peak` and `Trajectory.feature` then return them without a second simulation.
    cycles : int
        Equal pieces of the sampled time, each with features of its own [-].
    companion_of : float, optional
        Set for the companion runs of an error estimate: `rtol` of the run whose error is estimated [-].

    Raises
    ------
    ValueError, TypeError
        If a field is wrong; all problems are listed.

    Examples
    --------
    >>> tight = Settings(duration=0.1, samples=101, rtol=1e-9)
    >>> tight.method, tight.skip
    ('auto', 0.0)
    """

    duration: float = field(metadata=unit("s"))
    samples: int = 1001
    skip: float = field(default=0.0, metadata=unit("s"))
    rtol: float | None = None
    method: str = "auto"
    outputs: Sequence[str] | None = None
    max_step: float | None = field(default=None, metadata=unit("s"))
    max_steps: int = MAX_STEPS
    max_events: int = MAX_EVENTS
    position_tolerance: float | None = field(default=None, metadata=unit("m"))
    velocity_tolerance: float | None = field(default=None, metadata=unit("m/s"))
    features: Sequence[Feature] = ()
    cycles: int = 1
    companion_of: float | None = None

    def __post_init__(self) -> None:
        checks = Checks()
        for name, value in checked_settings(checks, vars(self)).items():
            object.__setattr__(self, name, value)
        checks.finish()

    @property
    def run_rtol(self) -> float:
        """Relative tolerance of a run with these settings [-]."""
        return RTOL if self.rtol is None else self.rtol

    @property
    def of_runs(self) -> Settings:
        """The settings of runs, which have a tolerance."""
        return self if self.rtol is not None else dataclasses.replace(self, rtol=RTOL)

    @classmethod
    def gathered(
        cls,
        checks: Checks,
        settings: object,
        options: Mapping[str, object],
        *,
        accepted: Iterable[str] | None = None,
        found: Mapping[str, object] | None = None,
        outputs_needed: bool = True,
    ) -> Settings:
        """Settings from the argument ``settings=`` and from keywords, which take precedence; without an
        `rtol` if none is given.

        `accepted` are the names of keywords, and `found` the fields that the function determines itself; None
        for `outputs` and `features` means not given. Problems are raised together with those of `checks`.
        """
        known = {item.name: item.default for item in dataclasses.fields(cls)}
        values = {name: value for name, value in known.items() if value is not dataclasses.MISSING}
        if isinstance(settings, cls):
            values = dict(vars(settings))
        elif settings is not None:
            checks.add("settings", f"must be a Settings, got {settings!r}", wrong_type=True)
        names = [*RunOptions.__annotations__, "outputs", "features"] if accepted is None else list(accepted)
        for name, value in options.items():
            if name not in names:
                checks.add(name, f"is no keyword{did_you_mean(name, names)}", wrong_type=True)
            elif value is not None or name not in ("outputs", "features"):
                values[name] = value
        values |= found or {}
        if "duration" not in values and (settings is None or isinstance(settings, cls)):
            checks.add("duration", "is missing: give it, or settings=Settings(...)", wrong_type=True)
        ordered = {name: values[name] for name in known if name in values}
        asked = ordered["features"]
        alone = not (asked if isinstance(asked, Sequence) else asked is not None)
        kept = checked_settings(checks, ordered, outputs_needed=outputs_needed and alone)
        checks.finish()
        made = object.__new__(cls)  # what was checked is not checked again
        vars(made).update(kept)
        return made

    def tightened(self, factor: float, **changes: Any) -> Settings:
        """The settings with all tolerances divided by a factor, and other changes."""
        known = {name: getattr(self, name) for name in ("position_tolerance", "velocity_tolerance")}
        changes |= {name: value / factor for name, value in known.items() if value is not None}
        return dataclasses.replace(self, rtol=max(self.run_rtol / factor, LEAST_RTOL), **changes)

    def to_json(self) -> str:
        """The settings as the core reads them."""
        return json.dumps(dataclasses.asdict(self), allow_nan=False)

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Settings:
        """The settings from their JSON form."""
        features = tuple(map(Feature.from_dict, plain.get("features", ())))
        return cls(**{**plain, "features": features})

    def fitted(self, facts: Inspection) -> Settings:
        """The settings with patterns such as ``"energy.*"`` replaced by the columns of a scene.

        An ArgumentError if it has no such output or feature, a MemoryLimitError if the samples do not fit.
        """
        require_features(facts, self.features)
        if self.outputs is None:
            require_memory(_COPIES * 8.0 * self.samples * len(facts.columns), "a run takes")
            return self
        columns = facts.columns + facts.further_columns
        # Not left to the core: it knows no patterns, and no words of textbooks to suggest names by.
        checks = Checks()
        names: dict[str, None] = {}
        for name in self.outputs:
            # Wear by sector is long: it is no part of what "wrist.*" matches.
            exact = name in columns or name in facts.sector_columns
            found = [name] if exact else matching(columns, name) or matching(facts.sector_columns, name)
            if not found:
                checks.add("outputs", f'name the unknown output "{name}"{output_meant(name, columns)}')
            names |= dict.fromkeys(found)
        checks.finish()
        require_memory(_COPIES * 8.0 * self.samples * len(names), "a run takes")
        return dataclasses.replace(self, outputs=tuple(names))


def revolution_of(scene: Scene) -> SpanOptions:
    """One revolution as the duration, if the drives prescribe the motion of a mechanism; else nothing."""
    period = revolution_time(scene)
    return {"duration": period} if period and not scene.check().degrees_of_freedom else {}


def require_features(facts: Inspection, features: Iterable[Feature]) -> None:
    """Refuse features of outputs and clearance joints that the scene does not have."""
    checks = Checks()  # not left to the core, which has no words of textbooks to suggest names by
    columns = facts.columns + facts.further_columns
    sectors = set(facts.sector_columns)
    for feature in features:
        joint = feature.kind in JOINT_KINDS
        what, known = ("clearance joint", facts.clearance_joints) if joint else ("output", columns)
        if feature.of not in known and (joint or feature.of not in sectors):
            hint = meant_or_known(feature.of, known) if joint else output_meant(feature.of, known)
            checks.add("features", f'has the {feature.kind} of the unknown {what} "{feature.of}"{hint}')
        window = feature.window
        if window is not None and window.of != "time" and window.of not in columns:
            hint = output_meant(window.of, columns)
            checks.add("features", f'has a window of the unknown output "{window.of}"{hint}')
    checks.finish()


def checked_settings(
    checks: Checks,
    values: Mapping[str, Any],
    called: Mapping[str, str] | None = None,
    *,
    outputs_needed: bool = False,
) -> dict[str, Any]:
    """Some fields of `Settings`, converted; problems are added under the names by which arguments are called.

    Types are checked here, since JSON has fewer; ranges and words by the core.
    """
    fields = [item for item in dataclasses.fields(Settings) if item.name in values]
    names = {item.name: (called or {}).get(item.name, item.name) for item in fields}
    symbols = units(Settings)
    own = Checks()
    found = dict(values)
    for item in fields:
        name, value, kind = item.name, values[item.name], str(item.type)
        if name == "max_step" and isinstance(value, float) and value == math.inf:
            value = found[name] = None  # as SciPy says it
        if kind.startswith("float") and (value is not None or not kind.endswith("| None")):
            found[name] = own.number(names[name], value, symbols.get(name, "-"))
        elif kind == "int":
            found[name] = own.integer(names[name], value)
        elif kind == "str" and not (isinstance(value, str) and is_plain(value)):
            own.word(names[name], value, METHODS)
        elif name == "outputs":
            found[name] = checked_names(own, value)
            if outputs_needed and found[name] == ():
                own.add("outputs", "must name at least one column; None stands for all")
        elif name == "features":
            found[name] = checked_features(own, value)
    readable = {name: found[name] for name in names if not own.noted(names[name])}
    if readable.get("rtol", 0.0) is None:
        del readable["rtol"]  # the core has no runs without one
    plain = {name: as_json_number(value) for name, value in (_EXAMPLE | readable).items()}
    try:
        _core.check_settings(json.dumps(plain, default=dataclasses.asdict))
    except SettingsError as error:
        for problem in error.problems:
            path = problem.path.removeprefix("settings.")
            name = re.split(r"[.\[]", path)[0]
            own.add(names[name] + path.removeprefix(name), problem.message)
    checks.include(own, list(names.values()))
    return found


def common_facts(
    settings: Settings | None, scene: Scene | None, warnings: Sequence[str]
) -> dict[str, str | int | float]:
    """Facts of all results for other programs: version, warnings, settings and scene if they have them."""
    facts: dict[str, str | int | float] = {"chebclear": package_version(), "warnings": "\n".join(warnings)}
    plain = {} if settings is None else dataclasses.asdict(settings)
    facts |= {name: value for name, value in plain.items() if isinstance(value, str | int | float)}
    return facts if scene is None else facts | {"scene": scene.to_json()}


def with_settings(options: type, *further: str) -> Callable[[Documented], Documented]:
    """Give a function or class of ``**options`` the signature and the documentation of fields of `Settings`.

    The fields of `options` are keywords; `further` ones, parameters of its own, are documented as well.
    """
    return with_fields(Settings, options, "{settings}", further)


def checked_names(checks: Checks, outputs: object) -> tuple[str, ...] | None:
    """Names of outputs from the argument of the user; problems are added to `checks`."""
    if outputs is None:
        return None
    if isinstance(outputs, str) or not isinstance(outputs, Iterable):
        checks.add("outputs", f"must be a list of column names, got {outputs!r}", wrong_type=True)
        return None
    names = tuple(outputs)
    counts = Counter(name for name in names if isinstance(name, str))
    for name in names:
        if not isinstance(name, str):
            checks.add("outputs", f"must be column names, got {name!r}", wrong_type=True)
        elif counts.pop(name, 1) > 1:
            checks.add("outputs", f'names "{name}" more than once')
    return names
