"""Scenes drawn at random up to extreme values of all settings, and how each of them ends; see README.md.

python benchmarks/extremes.py [--elements] [--scenes N] [--first I] [--seed S]
                              [--read CSV] [--csv FILE] [--map PNG]
"""

from __future__ import annotations

import argparse
import csv
import dataclasses
import faulthandler
import math
import time
import warnings
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import chebclear as cc
import numpy as np
from loads import GUIDED, guided
from numpy.typing import NDArray

Array = NDArray[np.float64]

SEED = 2026
MAX_STEPS, MAX_STEPS_OF_ELEMENTS = 100_000, 20_000
LONGEST_SCENE = 120.0  # wall time after which a scene counts as hanging and the process is ended [s]
SAMPLES = 201
ENERGIES = ("kinetic", "potential", "contact", "input", "impact_loss", "friction_loss")
FAMILIES = ("driven", "held", "pendulum", "chain")
# Guides, pins in slots, stops and the paper's mechanism with what a dry joint does not have.
ELEMENTS = (*GUIDED, "sticking", "oiled", "coupled")
PASSIVE = ("held", "pendulum", "chain", "block", "stops")
METHODS = ("auto", "rodas5p", "rodas4", "dop853")
STARTS = ("anywhere", "inner", "outer", "contact")  # at the dead centers of the crank, or in contact
GRAVITY = 9.81
SWING = 2.0 * math.pi * math.sqrt(0.12 / GRAVITY)  # of a link of 0.12 m [s]

# Energy that a passive scene may gain: this many tolerances per onset, of the largest kinetic energy.
ENERGY_PER_ONSET = 10.0
# Largest error of the energy balance relative to the exchanged energy. A velocity known to a tenth of the
# stick-slip velocity leaves a tenth of the friction that sticks unknown, and drives work against it, so a
# run beyond it is repeated with a velocity tolerance of this part of the stick-slip velocity. An oil film is
# stiff in the same way: there the run is repeated with this tolerance.
IMBALANCE = 0.02
FINE_STICKING, FINE = 1e-3, 1e-9
# A peak is looked at over this many contact changes, well before errors have grown by themselves: they
# double every 2 to 6 changes.
PEAK_EVENTS = 6
# A peak counts as converged if two runs, the second with a tenth of the tolerance, differ by less than this
# part of it.
CONVERGED = 0.01
# A third run, again ten times tighter, may then move it by this many times what the two differed by (in the
# largest difference of the two curves, not of their peaks, which may agree by chance), or by as many
# tolerances of the second.
CLAIM = 3.0


@dataclass(frozen=True)
class Case:
    """A scene of the grid and how it is run; SI units."""

    index: int
    family: str
    method: str
    rtol: float
    stiffness_factor: float
    clearance: float
    stick_velocity: float
    friction: float
    restitution: float
    speed_rpm: float
    mass_ratio: float
    revolutions: float
    start: str
    convention: str
    law: str
    duration: float

    def scene(self) -> cc.Scene:
        """The scene of this case."""
        families = {"driven": _slider_crank, "held": _slider_crank, "pendulum": _pendulum, "chain": _chain}
        families |= dict.fromkeys(GUIDED, _guided) | dict.fromkeys(ELEMENTS[len(GUIDED) :], _slider_crank)
        return _started(self, families[self.family](self))

    @property
    def max_steps(self) -> int:
        """The steps that it may take [-]."""
        return MAX_STEPS_OF_ELEMENTS if self.family in ELEMENTS else MAX_STEPS

    @property
    def passive(self) -> bool:
        """Whether nothing does work on the scene; as printed, friction of Eq. (5) can."""
        return self.family in PASSIVE and self.convention == "corrected"


def draw(index: int, seed: int = SEED, elements: bool = False) -> Case:
    """The case of an index: each has its own generator, so any part of the grid can be drawn alone."""
    random = np.random.default_rng([seed, index])

    def decades(low: float, high: float) -> float:
        return float(10.0 ** random.uniform(math.log10(low), math.log10(high)))

    def end(value: float, *ends: float) -> float:
        """One of the ends of a range instead of a value within, every eighth time."""
        return float(random.choice(ends)) if random.random() < 0.125 else value

    family = str(
        random.choice(ELEMENTS if elements else FAMILIES, p=None if elements else (0.55, 0.15, 0.2, 0.1))
    )
    method = str(random.choice(METHODS, p=(0.4, 0.25, 0.15, 0.2)))
    speed = end(decades(1.0, 2e4), 1.0, 2e4)
    revolutions = end(decades(2.0, 200.0), 2.0, 200.0)
    tiny = random.random() < 0.03
    # A free fall has no revolutions: it is given as many swings of the 0.12 m rod.
    period = 60.0 / speed if family == "driven" else SWING
    if elements:
        period = 60.0 / speed
    duration = decades(1e-15, 1e-6) if tiny else revolutions * period
    return Case(
        index=index,
        family=family,
        method=method,
        rtol=end(decades(1e-10, 1e-3), 1e-10, 1e-3),
        stiffness_factor=end(decades(1e-3, 1e3), 1e-3, 1e3),
        clearance=end(decades(1e-7, 1e-3), 1e-7, 1e-3),
        stick_velocity=end(decades(1e-6, 1e-2), 1e-6, 1e-2),
        friction=end(float(random.uniform(0.0, 1.0)), 0.0, 1.0),
        restitution=end(float(random.uniform(0.01, 0.999)), 0.01, 0.999),
        speed_rpm=speed,
        mass_ratio=end(decades(1e-4, 1e4), 1e-4, 1e4),
        revolutions=revolutions,
        start=str(random.choice(STARTS, p=(0.4, 0.15, 0.15, 0.3))),
        convention=str(random.choice(("corrected", "as_printed"), p=(0.8, 0.2))),
        law=str(random.choice(("lankarani_nikravesh", "flores"), p=(0.7, 0.3))),
        duration=duration,
    )


def _friction(case: Case) -> cc.laws.ModifiedCoulomb:
    return cc.laws.ModifiedCoulomb(
        case.friction, 0.75 * case.friction, case.stick_velocity, 1.5 * case.stick_velocity
    )


def _angle(case: Case) -> float:
    anywhere = float(np.random.default_rng([SEED, case.index, 1]).uniform(0.0, 2.0 * math.pi))
    return {"outer": 0.0, "inner": math.pi}.get(case.start, anywhere)


def _started(case: Case, scene: cc.Scene) -> cc.Scene:
    """The scene, with its journals pressed into their bearings if the case starts in contact."""
    if case.start != "contact" or case.family in GUIDED:
        return scene
    random = np.random.default_rng([SEED, case.index, 2])
    starts = []
    for joint in scene.joints:
        if not isinstance(joint, cc.ClearanceRevolute):
            continue
        # From a touch to a penetration as large as the clearance; at rest half the time, else in any
        # direction.
        place, way = random.uniform(0.0, 2.0 * math.pi, 2)
        eccentricity = joint.clearance * (1.0 + 10.0 ** random.uniform(-6.0, 0.0))
        speed = 10.0 ** random.uniform(-4.0, 1.0) * (random.random() < 0.5)
        starts.append(
            cc.ClearanceStart(
                joint.name,
                eccentricity=(eccentricity * math.cos(place), eccentricity * math.sin(place)),
                rate=(speed * math.cos(way), speed * math.sin(way)),
            )
        )
    return dataclasses.replace(scene, start=starts)


def _joint(case: Case, name: str, bearing: str, journal: str, journal_radius: float) -> cc.ClearanceRevolute:
    stiffness = case.stiffness_factor * cc.laws.hertz_stiffness(journal_radius, case.clearance, 207e9, 0.3)
    law = cc.laws.Flores if case.law == "flores" else cc.laws.LankaraniNikravesh
    return cc.ClearanceRevolute(
        name,
        bearing,
        journal,
        journal_radius,
        case.clearance,
        law(stiffness, case.restitution),
        _friction(case),
        sliding="contact_point" if case.convention == "as_printed" else "surface",
    )


def _slider_crank(case: Case) -> cc.Scene:
    """The paper's mechanism, driven; or held by a drive at rest, so that rod and slider fall."""
    driven = case.family not in PASSIVE
    scene = cc.mechanisms.slider_crank(
        clearance=case.clearance,
        crank_speed=cc.rpm(case.speed_rpm) if driven else 0.0,
        crank_angle=_angle(case),
        rod_mass=0.2 / math.sqrt(case.mass_ratio),
        slider_mass=0.2 * math.sqrt(case.mass_ratio),
        slider_inertia=1e-4 * math.sqrt(case.mass_ratio),
        gravity=0.0 if driven else GRAVITY,
        convention=case.convention,
    )
    joints = [
        _joint(case, "wrist", "rod.C", "slider.C", 9.8e-3) if joint.name == "wrist" else joint
        for joint in scene.joints
    ]
    scene = dataclasses.replace(scene, joints=joints)
    return _with_element(case, scene) if case.family in ELEMENTS else scene


def _with_element(case: Case, scene: cc.Scene) -> cc.Scene:
    """With a wrist that sticks, with one that is oiled, or with a motor that drives the crank by gears."""
    if case.family == "coupled":
        (drive,) = scene.drives
        ratio = 10.0 ** np.random.default_rng([SEED, case.index, 3]).uniform(-2.0, 2.0)
        motor = dataclasses.replace(drive, joint="bearing of the motor", speed=drive.speed / ratio, angle=0.0)
        return dataclasses.replace(
            scene,
            bodies=[*scene.bodies, cc.Body("motor", 1.0, 1e-3)],
            joints=[*scene.joints, cc.Revolute("bearing of the motor", "ground", "motor")],
            drives=[motor],
            couplings=[cc.motions.Coupling("gears", "crank.angle", "motor.angle", ratio)],
        )
    sticks = cc.laws.StickSlip(case.friction, 0.75 * case.friction, case.stick_velocity)
    film = cc.laws.ShortBearing(case.stick_velocity, 0.01, 0.1 * case.clearance)
    changes = {"friction": sticks, "sliding": "surface"} if case.family == "sticking" else {"film": film}
    joints = [
        dataclasses.replace(joint, **changes) if isinstance(joint, cc.ClearanceRevolute) else joint
        for joint in scene.joints
    ]
    return dataclasses.replace(scene, joints=joints)


def _guided(case: Case) -> cc.Scene:
    """A mechanism with faces, every second time with ends; sticking every fourth time."""
    random = np.random.default_rng([SEED, case.index, 4])
    scene, _ = guided(random, case.family, 0.05 * cc.rpm(case.speed_rpm))
    law = cc.laws.Flores if case.law == "flores" else cc.laws.ExactRestitution
    friction = _friction(case)
    if random.random() < 0.25:
        friction = cc.laws.StickSlip(case.friction, 0.75 * case.friction, case.stick_velocity)
    joints = []
    for joint in scene.joints:
        changes: dict[str, Any] = {}
        if not isinstance(joint, cc.Revolute):
            changes = {"contact": law(1e9 * case.stiffness_factor, case.restitution), "friction": friction}
        if isinstance(joint, cc.ClearanceRevolute):
            changes["sliding"] = "surface"
        if isinstance(joint, cc.ClearanceRevolute | cc.ClearancePrismatic | cc.PinInSlot):
            changes["clearance"] = case.clearance
        rolls = not isinstance(joint, cc.ClearancePrismatic)
        can_end = isinstance(friction, cc.laws.ModifiedCoulomb) and getattr(joint, "radius", 1.0) > 0.0
        if hasattr(joint, "face_length") and random.random() < 0.5 and (can_end or not rolls):
            changes["face_length"] = float(10.0 ** random.uniform(-1.3, 0.0))
        joints.append(dataclasses.replace(joint, **changes))
    return dataclasses.replace(scene, joints=joints)


def _bob(name: str, mass: float, angle: float) -> cc.Body:
    """A link of 0.12 m that hangs on its end P and carries the next at its end Q."""
    inertia = mass * 0.12**2 / 12.0
    points = {"P": (0.0, 0.0), "Q": (0.12, 0.0)}
    return cc.Body(name, mass, inertia, center_of_mass=(0.06, 0.0), points=points, angle=angle)


def _pendulum(case: Case) -> cc.Scene:
    """A link that swings in a bearing in ground."""
    return cc.Scene(
        [_bob("bob", 0.2 * case.mass_ratio, _angle(case) - math.pi)],
        [_joint(case, "pivot", "ground", "bob.P", 9.8e-3)],
        [cc.Gravity((0.0, -GRAVITY))],
    )


def _chain(case: Case) -> cc.Scene:
    """Two links in a row, both joints with play."""
    masses = 0.2 / math.sqrt(case.mass_ratio), 0.2 * math.sqrt(case.mass_ratio)
    angle = _angle(case)
    return cc.Scene(
        [_bob("upper", masses[0], angle - math.pi), _bob("lower", masses[1], 0.7 * angle - 2.0)],
        [
            _joint(case, "pivot", "ground", "upper.P", 9.8e-3),
            _joint(case, "elbow", "upper.Q", "lower.P", 6e-3),
        ],
        [cc.Gravity((0.0, -GRAVITY))],
    )


# ----------------------------------------------------------------------------------------------------
# One case


def energy_at_play(run: cc.Trajectory) -> float:
    """Scale of the energy exchanged in a run [J]."""
    reached = run.t <= run.end_time
    losses = (run["energy.impact_loss"] + run["energy.friction_loss"])[reached]
    given = run["energy.input"][reached]
    # The kinetic energy alone would miss all motion between coarse samples; and a tolerance of the position,
    # a part of the clearance, is an energy of its own where next to nothing moves.
    clearance = max((getattr(joint, "clearance", 0.0) for joint in run.scene.joints), default=0.0)
    weight = GRAVITY * sum(body.mass for body in run.scene.bodies)
    scale = float(run["energy.kinetic"][reached].max(initial=0.0)) + weight * clearance
    scale += float(run["energy.contact"][0])
    return scale + float(np.abs(losses).max(initial=0.0)) + float(np.abs(given).max(initial=0.0))


def rounding(run: cc.Trajectory) -> float:
    """Rounding errors of the energies themselves [J]."""
    return 1e-13 * max(float(np.nanmax(np.abs(run[f"energy.{what}"]))) for what in ENERGIES)


def energy_gain(case: Case, run: cc.Trajectory) -> float:
    """Largest rise of the energy above any value before, in tolerances per onset of the exchanged energy.

    What swings without contact exchanges its energy with every swing.
    """
    total = run["energy.total"][run.t <= run.end_time]
    rise = float(np.max(total - np.minimum.accumulate(total), initial=0.0)) - rounding(run)
    exchanges = 1.0 + np.sum(run.events.kind == "onset")
    if case.family in ELEMENTS:
        exchanges += run.end_time / SWING
    return float(rise / (energy_at_play(run) * run.settings.rtol * exchanges)) if rise > 0.0 else 0.0


def imbalance(run: cc.Trajectory) -> float:
    """Error of the energy balance relative to the exchanged energy."""
    gap = float(np.nanmax(np.abs(run["energy.balance"]))) - rounding(run)
    return gap / energy_at_play(run) if gap > 0.0 else 0.0


def simulate(case: Case, **changes: Any) -> cc.Trajectory:
    """Run a case, whatever becomes of it."""
    arguments: dict[str, Any] = {
        "duration": case.duration,
        "samples": SAMPLES,
        "rtol": case.rtol,
        "method": case.method,
        "outputs": ["*"],
        "max_steps": case.max_steps,
        "on_failure": "return",
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cc.ChebclearWarning)
        return cc.simulate(case.scene(), **(arguments | changes))


def faults(case: Case, run: cc.Trajectory) -> list[str]:
    """What is wrong with the result of a case, in words; a failure that is typed and honest is not."""
    found = []
    reached = run.t <= run.end_time
    if run.status == "done":
        if not np.isfinite(run.samples).all() or run.end_time != case.duration:
            found.append("done, but not finite or not at the end")
    else:
        if not np.isfinite(run.samples[reached]).all():
            found.append("not finite before the failure")
        if not np.isnan(run.samples[~reached]).all():
            found.append("values after the failure")
        if run.message == "the end was reached":
            found.append("a failure without a message")
    if run.stats.steps + run.stats.rejected > case.max_steps:
        found.append("more steps than allowed")
    # Two attempts at a relocation are usual; 20 and the last repetition at most.
    if run.stats.relocations > 21 * (run.stats.steps + 1):
        found.append("relocations without end")
    if case.passive and energy_gain(case, run) > ENERGY_PER_ONSET:
        found.append(f"energy grew by {energy_gain(case, run):.3g} tolerances per onset")
    if imbalance(run) > IMBALANCE:
        finer: dict[str, Any] = {"velocity_tolerance": FINE_STICKING * case.stick_velocity}
        if case.family == "oiled":
            finer = {"rtol": FINE, "max_steps": MAX_STEPS}
        fine = simulate(case, duration=run.end_time, **finer)
        if imbalance(fine) > 0.1 * IMBALANCE:
            found.append(f"the energy is off by {imbalance(fine):.3g} of what is at play, however fine")
    return found


@dataclass(frozen=True)
class Peak:
    """How a peak of the normal force moves when the tolerance is tightened."""

    converged: bool
    """Whether the first two runs agree."""
    ratio: float
    """What the third run changes it by, in claims: the difference of the curves of the first two [-]."""


def tighten(case: Case, run: cc.Trajectory) -> Peak | None:
    """Follow the first contact changes with the tolerance, a tenth and a hundredth; None if they fail."""
    times = run.events.time[:PEAK_EVENTS]
    if len(times) < 2 or case.rtol < 1e-9:
        return None
    horizon = float(times[-1])
    # Fine enough for the shortest impact: coarse samples miss peaks.
    apart = np.diff(times)
    shortest = float(apart[apart > 0.0].min(initial=horizon))
    samples = int(np.clip(40.0 * horizon / shortest, 4001, 400_001))
    outputs = [f"{name}.normal_force" for name in case.scene().check().clearance_joints]
    curves = []
    for factor in (1.0, 0.1, 0.01):
        again = simulate(
            case,
            duration=horizon,
            samples=samples,
            rtol=factor * case.rtol,
            outputs=outputs,
        )
        if not again.success:
            return None
        # The last sample lies at a contact change, where a force is zero to rounding.
        curves.append(again.samples.max(axis=1)[:-1])
    first, second, third = curves
    size = float(second.max())
    # The tolerance of a force follows from that of the position by the stiffness, which may have any size:
    # only runs can measure it.
    apart_by = float(np.abs(first - second).max())
    if not size > 0.0 or apart_by == 0.0:
        # A slow mechanism's tolerances are those of its resting contacts, whatever is asked for.
        return None
    # There two runs may also agree to more digits than either was asked for.
    claim = max(apart_by, 0.1 * case.rtol * size)
    # Rounding errors, magnified by the stiffness, are no fault of the tolerance.
    moved = max(abs(float(third.max()) - size) - 1e-9 * size, 0.0)
    return Peak(claim <= CONVERGED * size, moved / claim)


def cost_model(case: Case, run: cc.Trajectory) -> float:
    """Oscillations of a contact under the load that the motion needs, over the whole duration [-]."""
    if case.family in ELEMENTS:
        return math.nan
    driven = case.family == "driven"
    radius, length = 9.8e-3, 0.05 if driven else 0.12
    slider, rod = 0.2 * math.sqrt(case.mass_ratio), 0.2 / math.sqrt(case.mass_ratio)
    mass = 0.2 * case.mass_ratio if case.family == "pendulum" else slider * rod / (slider + rod)
    load = mass * (length * cc.rpm(case.speed_rpm) ** 2 if driven else GRAVITY)
    stiffness = case.stiffness_factor * cc.laws.hertz_stiffness(radius, case.clearance, 207e9, 0.3)
    if case.convention == "as_printed":
        stiffness *= math.pi if driven or case.family == "held" else 1.0
    depth = (load / stiffness) ** (2.0 / 3.0)
    return case.duration / (2.0 * math.pi) * math.sqrt(1.5 * stiffness * math.sqrt(depth) / mass)


COLUMNS = (
    "index",
    "family",
    "method",
    "rtol",
    "stiffness_factor",
    "clearance",
    "stick_velocity",
    "friction",
    "restitution",
    "speed_rpm",
    "mass_ratio",
    "start",
    "duration",
    "status",
    "paradox",
    "reached",
    "steps",
    "rejected",
    "changes",
    "oscillations",
    "energy_gain",
    "imbalance",
    "peak_converged",
    "peak_ratio",
    "faults",
)


def measure(case: Case) -> dict[str, str]:
    """A line of the table."""
    run = simulate(case)
    peak = tighten(case, run) if case.index % 4 == 0 else None
    found = faults(case, run)
    if peak is not None and peak.converged and peak.ratio > CLAIM:
        found.append("a converged peak moved by more than it claimed")
    plain = dataclasses.asdict(case)
    plain |= {
        "status": run.status,
        "paradox": int("Painlevé" in run.message),
        "reached": run.end_time / case.duration,
        "steps": run.stats.steps,
        "rejected": run.stats.rejected,
        "changes": run.stats.events,
        "oscillations": cost_model(case, run),
        "energy_gain": energy_gain(case, run) if case.passive else "",
        "imbalance": imbalance(run),
        "peak_converged": "" if peak is None else int(peak.converged),
        "peak_ratio": "" if peak is None else peak.ratio,
        "faults": "; ".join(found),
    }
    return {
        name: f"{plain[name]:.3g}" if isinstance(plain[name], float) else str(plain[name]) for name in COLUMNS
    }


# ----------------------------------------------------------------------------------------------------
# The map


def outcome(row: dict[str, str]) -> str:
    """What became of a scene: finished, slowed down (out of steps), or refused with a reason."""
    return {"done": "finished", "max_steps": "out of steps"}.get(row["status"], "refused")


OUTCOMES = ("finished", "out of steps", "refused")
PANELS = (
    ("stiffness_factor", "stiffness over Hertz's"),
    ("clearance", "clearance [m]"),
    ("stick_velocity", "stick-slip velocity [m/s]"),
    ("friction", "friction coefficient"),
    ("restitution", "restitution"),
    ("speed_rpm", "crank speed [r/min]"),
    ("mass_ratio", "mass ratio"),
    ("rtol", "rtol"),
    ("oscillations", "contact oscillations"),
)


def draw_map(rows: list[dict[str, str]], path: Path) -> None:
    """Shares of the outcomes over each parameter."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    FigureCanvasAgg(figure)
    for axes, (name, label) in zip(figure.subplots(3, 3, sharey=True).flat, PANELS, strict=True):
        # The drive's speed is that of the driven scenes only.
        chosen = [row for row in rows if name != "speed_rpm" or row["family"] == "driven"]
        values = np.array([float(row[name]) for row in chosen])
        linear = name in ("friction", "restitution")
        positions = values if linear else np.log10(np.maximum(values, 1e-12))
        edges = np.linspace(positions.min(), positions.max(), 9)
        bins = np.clip(np.digitize(positions, edges) - 1, 0, 7)
        bottom = np.zeros(8)
        for kind, color in zip(OUTCOMES, ("#4c956c", "#f2c14e", "#b23a48"), strict=True):
            counts = np.array(
                [
                    sum(outcome(row) == kind for row, b in zip(chosen, bins, strict=True) if b == k)
                    for k in range(8)
                ]
            )
            share = counts / np.maximum(np.bincount(bins, minlength=8), 1)
            axes.bar(edges[:-1], share, np.diff(edges), bottom, align="edge", color=color, label=kind)
            bottom += share
        axes.set(xlabel=label if linear else f"log10 of {label}", xlim=(edges[0], edges[-1]), ylim=(0.0, 1.0))
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, fontsize="small")
    figure.supylabel("share of the scenes")
    figure.savefig(path, dpi=90)


def summary(rows: list[dict[str, str]]) -> str:
    """The table of the outcomes, and what it took, in Markdown."""
    statuses = [status for status, _ in Counter(row["status"] for row in rows).most_common()]
    lines = [
        f"| scene, method | {' | '.join(statuses)} | attempts per oscillation: median, 90 % |",
        "|---|" + "---|" * (len(statuses) + 1),
    ]
    for family in (*FAMILIES, *ELEMENTS):
        for method in METHODS:
            chosen = [row for row in rows if (row["family"], row["method"]) == (family, method)]
            if not chosen:
                continue
            counts = Counter(row["status"] for row in chosen)
            spent = [
                (int(row["steps"]) + int(row["rejected"]))
                / (float(row["oscillations"]) * float(row["reached"]))
                for row in chosen
                if float(row["oscillations"]) * float(row["reached"]) > 10.0
            ]
            cost = f"{np.median(spent):.3g}, {np.quantile(spent, 0.9):.3g}" if spent else "-"
            cells = " | ".join(str(counts[status]) for status in statuses)
            lines.append(f"| {family}, {method} | {cells} | {cost} |")
    gains = [float(row["energy_gain"]) for row in rows if row["energy_gain"]]
    gaps = [float(row["imbalance"]) for row in rows]
    ratios = [float(row["peak_ratio"]) for row in rows if row["peak_converged"] == "1"]
    # A part of the grid may hold none of either.
    gain, ratio = max(gains, default=0.0), max(ratios, default=0.0)
    lines += [
        "",
        f"{len(rows)} scenes, {sum(bool(row['faults']) for row in rows)} with faults; "
        f"{sum(row['paradox'] == '1' for row in rows)} fail in Painlevé's paradox.",
        f"Energy of {len(gains)} passive scenes: gains up to {gain:.3g} tolerances per onset, "
        f"{sum(gain > 0.1 for gain in gains)} above 0.1.",
        f"Energy balance: error up to {max(gaps):.3g} of the exchanged energy, {np.median(gaps):.3g} in the "
        f"median, {sum(gap > 1e-3 for gap in gaps)} above 1e-3.",
        f"{len(ratios)} converged peaks: the third run moved them by up to {ratio:.3g} claims.",
    ]
    return "\n".join(lines)


def survey(first: int, count: int, seed: int, elements: bool) -> list[dict[str, str]]:
    """Measure a part of the grid; a scene that hangs ends the process with a traceback."""
    rows = []
    for index in range(first, first + count):
        faulthandler.dump_traceback_later(LONGEST_SCENE, exit=True)
        rows.append(measure(draw(index, seed, elements)))
        faulthandler.cancel_dump_traceback_later()
        if rows[-1]["faults"]:
            print(", ".join(f"{name} {value}" for name, value in rows[-1].items() if value), flush=True)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", type=int, default=2000)
    parser.add_argument(
        "--elements", action="store_true", help="guides, slots, stops, sticking, films, couplings"
    )
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--csv", type=Path, help="where to write the scenes")
    parser.add_argument("--read", type=Path, help="scenes to read instead of running them")
    parser.add_argument("--map", type=Path, help="where to draw the map")
    options = parser.parse_args()
    if options.read:
        with options.read.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    else:
        begin = time.perf_counter()
        rows = survey(options.first, options.scenes, options.seed, options.elements)
        print(f"{len(rows)} scenes in {time.perf_counter() - begin:.0f} s")
    if options.csv:
        with options.csv.open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    if options.map:
        draw_map(rows, options.map)
    print(summary(rows))


if __name__ == "__main__":
    main()
