"""How a simulation is run."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..base.arguments import Checks
from ..base.named import matching
from ..base.shown import Shown
from ..base.units import unit
from ..scene.scene import ClearanceRevolute, Scene
from .features import JOINT_KINDS, Feature, checked_features
from .names import output_meant

METHODS = ("auto", "rodas5p", "rodas4", "dop853")
MAX_STEPS = 10_000_000
MAX_EVENTS = 1_000_000

# What is accepted at most; beyond, memory or the exact counts of floats end.
LEAST_RTOL, MOST_RTOL = 1e-13, 0.1
MOST_SAMPLES = 10_000_000
MOST_COUNT = 2**53
MOST_CYCLES = 1_000_000
# Samples of all columns that surely fit into the memory: for fewer the columns need not be counted.
_MANY_SAMPLES = 1_000_000


@dataclass(frozen=True, repr=False)
class Settings(Shown):
    """How a simulation is run."""

    duration: float = field(metadata=unit("s"))
    """Simulated time [s]."""
    samples: int
    """Number of equally spaced samples, both ends included [-]."""
    skip: float = field(metadata=unit("s"))
    """Time simulated before the first sample [s]."""
    rtol: float
    """Relative tolerance of the integrator [-]."""
    method: str
    """Integrator."""
    outputs: tuple[str, ...] | None
    """Names of the columns to return; those of bodies, clearance joints and drives if None."""
    max_steps: int
    """Attempted steps, accepted or refused, after which a run is given up [-]."""
    max_events: int
    """Contact changes after which a run is given up [-]."""
    position_tolerance: float | None = field(metadata=unit("m"))
    """Absolute tolerance of positions [m]; from `rtol` and the scales of the scene if None."""
    velocity_tolerance: float | None = field(metadata=unit("m/s"))
    """Absolute tolerance of velocities [m/s]; from `rtol` and the scales of the scene if None."""
    features: tuple[Feature, ...] = ()
    """Features that are found on the way."""
    cycles: int = 1
    """Equal pieces of the sampled time, each with features of its own [-]."""
    companion_of: float | None = None
    """`rtol` of the run that this one is the companion of [-]; None if it is none."""

    @classmethod
    def checked(
        cls,
        checks: Checks,
        *,
        duration: object,
        samples: object,
        skip: object,
        rtol: object,
        method: object,
        outputs: object,
        max_steps: object,
        max_events: object,
        position_tolerance: object,
        velocity_tolerance: object,
        features: object = None,
        cycles: object = 1,
        outputs_needed: bool = True,
    ) -> Settings:
        """Settings from what the user gave; what is wrong with it is noted in `checks`."""
        absolute = {
            "position_tolerance": (position_tolerance, "m"),
            "velocity_tolerance": (velocity_tolerance, "m/s"),
        }
        return cls(
            duration=checks.real("duration", duration, "s", above=0.0),
            samples=checks.whole("samples", samples, least=2, most=MOST_SAMPLES),
            skip=checks.real("skip", skip, "s", least=0.0),
            rtol=checks.real("rtol", rtol, "-", least=LEAST_RTOL, most=MOST_RTOL),
            method=checks.word("method", method, METHODS),
            outputs=_checked_names(checks, outputs, needed=outputs_needed),
            max_steps=checks.whole("max_steps", max_steps, least=1, most=MOST_COUNT),
            max_events=checks.whole("max_events", max_events, least=1, most=MOST_COUNT),
            features=checked_features(checks, features),
            cycles=checks.whole("cycles", cycles, least=1, most=MOST_CYCLES),
            **{
                name: None if value is None else checks.real(name, value, unit, above=0.0)
                for name, (value, unit) in absolute.items()
            },
        )

    def to_json(self) -> str:
        """The settings as the core reads them."""
        return json.dumps(dataclasses.asdict(self), allow_nan=False)

    @classmethod
    def from_dict(cls, plain: Mapping[str, Any]) -> Settings:
        """The settings from what JSON made of them."""
        outputs = plain["outputs"]
        known = {"outputs": None if outputs is None else tuple(outputs)}
        known |= {"features": tuple(Feature(**feature) for feature in plain.get("features", ()))}
        # Files of the first version know no skip.
        return cls(**{"skip": 0.0, **plain, **known})

    def for_scene(self, scene: Scene, runs: int = 1) -> Settings:
        """The settings with patterns such as ``"energy.*"`` replaced by the columns of the scene.

        Raises
        ------
        ValueError
            If an output is no column of the scene, a feature names none or no clearance joint, or the samples
            of so many runs would fill the memory.
        """
        require_features(scene, self.features)
        if self.outputs is None:
            if runs * self.samples > _MANY_SAMPLES:
                _require_room(runs, self.samples, len(scene.check().columns))
            return self
        facts = scene.check()
        columns = facts.columns + facts.further_columns
        checks = Checks()
        names: dict[str, None] = {}
        for name in self.outputs:
            found = [name] if name in columns else matching(columns, name)
            if not found:
                checks.add(f'unknown output "{name}"{output_meant(name, columns)}')
            names |= dict.fromkeys(found)
        checks.finish()
        _require_room(runs, self.samples, len(names))
        return dataclasses.replace(self, outputs=tuple(names))


def require_features(scene: Scene, features: Iterable[Feature]) -> None:
    """Refuse features of outputs and clearance joints that the scene has not."""
    if not features:
        return
    facts, checks = scene.check(), Checks()
    columns = facts.columns + facts.further_columns
    joints = [joint.name for joint in scene.joints if isinstance(joint, ClearanceRevolute)]
    for feature in features:
        what, known = ("clearance joint", joints) if feature.kind in JOINT_KINDS else ("output", columns)
        if feature.of not in known:
            checks.add(
                f'{feature.kind} of the unknown {what} "{feature.of}"{output_meant(feature.of, known)}'
            )
    checks.finish()


def _require_room(runs: int, samples: int, columns: int) -> None:
    """Refuse results that fill more than half of the memory: what is made of them needs room as well."""
    try:
        memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # a system that does not tell
        return
    needed = 8 * runs * samples * columns
    if needed > memory // 2:
        raise ValueError(
            f"{runs} runs of {samples} samples and {columns} outputs would take {needed / 1e9:.3g} GB of the "
            f"{memory / 1e9:.3g} GB of this machine: ask for fewer samples, outputs or runs"
        )


def _checked_names(checks: Checks, outputs: object, needed: bool) -> tuple[str, ...] | None:
    if outputs is None:
        return None
    if isinstance(outputs, str) or not isinstance(outputs, Iterable):
        checks.add(f"outputs must be a list of column names, got {outputs!r}", wrong_type=True)
        return None
    names = tuple(outputs)
    for index, name in enumerate(names):
        if not isinstance(name, str):
            checks.add(f"outputs must be column names, got {name!r}", wrong_type=True)
        elif names.index(name) == index and names.count(name) > 1:
            checks.add(f'outputs names "{name}" more than once')
    if needed and not names:
        checks.add("outputs must name at least one column; None stands for all")
    return names
