"""What is taken from a measured trace and, in the same way, from the samples of the runs of a model."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase

import numpy as np
from numpy.random import default_rng

from ..base.arguments import Checks
from ..base.rows import Array
from ..base.shown import meant_or_known
from ..base.units import unit
from ..errors import ArgumentError
from ..execution.failures import AllFailedError
from ..notices import Notice
from ..run.features import JOINT_KINDS, Feature, rms
from ..scene.columns import column_unit
from ..scene.scene import Interval
from ..study.features.traces import Crossings, OfSamples
from ..study.polynomials.points import uniform_points
from ..study.results import StudyResult
from ..study.runner import Runner
from ..study.sources.own import sampled_feature
from ..study.sources.returned import time_axis
from ..study.sources.run_table import RunTable
from ..study.study import Study
from .measured import Measured, quantity, unit_factor

TraceFeature = Feature | OfSamples

# Impacts as they are seen in samples.
_OF_CONTACT = ("contact_share", "impacts")
# Statistics of many impacts. An extreme is one of them, which is another one in the next run.
_STEADY = ("rms", "mean", *_OF_CONTACT)


@dataclass(frozen=True)
class TraceFeatures:
    """What is taken from a trace and, in the same way, from runs."""

    t: Array = field(metadata=unit("s"))
    """Instants [s], shape (samples,)."""
    features: dict[str, TraceFeature]
    """The features by name."""
    noise: dict[str, float]
    """Standard deviation of the noise of each output, in the unit of the model."""

    def of(self, t: Array, series: Mapping[str, Array], seed: int) -> Array:
        """Features of outputs of shape (runs, samples), with noise, shape (runs, features)."""
        place = np.interp(self.t, t, np.arange(len(t)))
        before = np.minimum(place.astype(int), len(t) - 2)
        part = place - before
        seen = {}
        for number, (name, values) in enumerate(series.items()):
            seen[name] = values[:, before] * (1.0 - part) + values[:, before + 1] * part
            if self.noise[name]:
                random = default_rng([seed, number])
                seen[name] += self.noise[name] * random.standard_normal(seen[name].shape)
        found = [_value(one, self.t, seen[column_of(one)]) for one in self.features.values()]
        return np.column_stack(found)


def column_of(feature: TraceFeature) -> str:
    """The output from whose samples a feature is taken."""
    own = isinstance(feature, Feature) and feature.kind in _OF_CONTACT
    return f"{feature.of}.contact" if own else feature.of


def _value(feature: TraceFeature, t: Array, values: Array) -> Array:
    """A feature of samples of shape (runs, samples)."""
    if isinstance(feature, OfSamples):
        return feature.sampled(t, values)
    if feature.kind == "impacts":
        return Crossings(feature.of, 0.5).sampled(t, values)
    kind = "mean" if feature.kind == "contact_share" else feature.kind
    return sampled_feature(Feature(kind, column_of(feature)), t, values, 1)[..., 0]


def steady_features(
    own: Mapping[str, object], measured: Measured, outputs: Sequence[str] | None
) -> dict[str, TraceFeature]:
    """The features of a study that are statistics of what was measured, or else the rms of its outputs."""
    found = {
        name: one
        for name, one in own.items()
        if isinstance(one, OfSamples) or (isinstance(one, Feature) and one.kind in _STEADY)
    }
    known = {name: one for name, one in found.items() if column_of(one) in measured}
    named = [name for name in measured if outputs is None or any(fnmatchcase(name, one) for one in outputs)]
    return known or {f"rms of {name}": rms(name) for name in named}


def _outputs_of(source: Study | StudyResult) -> Sequence[str] | None:
    """Names of the outputs of a model; None if it says them only when it is run."""
    if isinstance(source, StudyResult):
        return source.outputs
    return source.runner.settings.outputs if source.runner.settings is not None else None


def asked_features(
    checks: Checks, given: object, source: Study | StudyResult, measured: Measured
) -> dict[str, TraceFeature]:
    """The features by name; of none those that are steady."""
    spec = source.runner.spec if isinstance(source, Study) else source.spec
    own = {} if spec is None else spec.features
    if given is None:
        given = steady_features(own, measured, _outputs_of(source))
    if isinstance(given, Mapping):
        pairs = list(given.items())
    elif isinstance(given, list | tuple):
        pairs = [(str(one), own.get(one, one) if isinstance(one, str) else one) for one in given]
    else:
        pairs = []
    if not pairs:
        checks.add("features", f"must be a list of features of outputs, got {given!r:.80}", wrong_type=True)
    asked: dict[str, TraceFeature] = {}
    for name, one in pairs:
        if not isinstance(one, Feature | OfSamples):
            checks.add(f'features["{name}"]', f"must be a feature of samples{meant_or_known(name, own)}")
        elif isinstance(one, Feature) and one.kind in JOINT_KINDS and one.kind not in _OF_CONTACT:
            checks.add(f'features["{name}"]', "is found in simulations only, not in samples of a trace")
        elif isinstance(one, Feature) and one.window is not None:
            checks.add(
                f'features["{name}"]', "has a window, which is found in simulations only: leave it out"
            )
        elif column_of(one) not in measured:
            checks.add(f'features["{name}"]', f"needs {column_of(one)}, which was not measured")
        else:
            asked[str(name)] = one
    return asked


def trace_features(
    checks: Checks,
    source: Study | StudyResult,
    measured: Measured,
    asked: dict[str, TraceFeature],
    noise: Mapping[str, float | str] | None,
) -> tuple[TraceFeatures, dict[str, float]]:
    """What is taken from runs, and the features of the trace."""
    wanted = list(dict.fromkeys(map(column_of, asked.values())))
    t, units = _axis(checks, source, wanted)
    assert measured.t is not None
    slack = 1e-9 * (t[-1] - t[0])
    inside = (measured.t >= t[0] - slack) & (measured.t <= t[-1] + slack)
    window = measured.t[inside]
    step = (window[-1] - window[0]) / (len(window) - 1) if len(window) > 1 else math.nan
    if not step > 0.0:
        checks.add("measured", f"does not overlap with the time of the model, {t[0]:.6g} to {t[-1]:.6g} s")
    else:
        time_axis(checks, window)
        if len(t) > 2 and t[1] - t[0] > step * (1.0 + 1e-3):
            checks.add(
                "samples",
                f"of the runs, every {t[1] - t[0]:.3g} s, are too coarse for a trace of {step:.3g} s",
            )
    factors = {name: unit_factor(checks, name, measured.units.get(name, ""), units[name]) for name in wanted}
    deviations = dict.fromkeys(wanted, 0.0)
    for name, size in (noise or {}).items():
        if name not in wanted:
            checks.add(f'noise["{name}"]', "is of no output that the features use")
            continue
        own = measured.units.get(name, "")
        deviations[name] = factors[name] * quantity(checks, f'noise["{name}"]', size, own, least=0.0)
    trace = TraceFeatures(window, asked, deviations)
    values = {}
    for name, one in asked.items() if step > 0.0 else ():
        samples = factors[column_of(one)] * measured[column_of(one)][inside]
        try:
            values[name] = float(_value(one, window, samples[None])[0])
        except ArgumentError as error:  # too coarse, for instance
            checks.add(f'features["{name}"]', str(error))
        _check_events(checks, name, one, samples)
    return trace, values


def _axis(checks: Checks, source: Study | StudyResult, wanted: list[str]) -> tuple[Array, dict[str, str]]:
    """Instants of the runs, of those that are simulated at any the two ends alone, and units of outputs."""
    if isinstance(source, StudyResult):
        t, known, units = source.t, source.outputs, {name: band.unit for name, band in source.items()}
        if source.requirement is not None and source.requirement.revolutions is not None:
            checks.add("source", "is a result by crank angle: give its study, or a result over time")
    elif (settings := source.runner.settings) is not None:
        t, known = np.array([settings.skip, settings.skip + settings.duration]), tuple(wanted)
        units = {name: column_unit(name) for name in wanted}
    else:
        nominal = np.array([[side.nominal for side in source.intervals.values()]])
        run = made_at(source.runner, nominal)
        t, known, units = run.t, run.outputs, dict(source.runner.units)
    for name in wanted:
        if name not in known:
            checks.add(name, f"is no output of the model{meant_or_known(name, known)}")
    return t, {name: units.get(name, "") for name in wanted}


def made_at(runner: Runner, points: Array) -> RunTable:
    """The runs of a study at points; the error of the first if all fail."""
    try:
        return runner.made(points, runner.settings, midpoint=False)
    except AllFailedError as error:
        raise error.first from None


def _check_events(checks: Checks, name: str, feature: TraceFeature, samples: Array) -> None:
    """Refuse to count what is so short that most of it falls between the samples."""
    if isinstance(feature, Crossings):
        level = feature.level
    elif isinstance(feature, Feature) and feature.kind == "impacts":
        level = 0.5
    else:
        return
    above = samples >= level
    events = np.count_nonzero(above[1:] & ~above[:-1])
    short = np.count_nonzero(above[1:-1] & ~above[:-2] & ~above[2:])
    if 2 * short > events:
        checks.add(
            f'features["{name}"]',
            f"counts what the samples are too coarse for: {short} of {events} events are one sample long",
        )


def simulated(
    study: Study,
    trace: TraceFeatures,
    named: dict[str, Interval],
    count: int,
    seed: int,
    fixed: Mapping[str, float],
) -> tuple[Array, Array, tuple[Notice, ...]]:
    """Points, features and notices of runs of a study: named parameters fill their box or are fixed."""
    runner, settings = study.runner, study.runner.settings
    points = uniform_points(runner.intervals, count, seed)
    for column, name in enumerate(runner.intervals):
        if name in fixed:
            points[:, column] = fixed[name]
        elif name not in named and name in runner.random:
            points[:, column] = runner.random[name].drawn(default_rng([seed, column]), count)
    if settings is not None:
        start, end, outputs = float(trace.t[0]), float(trace.t[-1]), tuple(trace.noise)
        settings = replace(
            settings,
            skip=start,
            duration=end - start,
            samples=len(trace.t),
            outputs=outputs,
            features=(),
            cycles=1,
        )
        runner = replace(runner, features={}, settings=settings)
    made = made_at(runner, points)
    series = {name: made.values[:, :, made.outputs.index(name)] for name in trace.noise}
    return points[made.kept], trace.of(made.t, series, seed), made.notices
