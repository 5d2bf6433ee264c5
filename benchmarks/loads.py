"""Random mechanisms with loads of the motion, faces, films and couplings, and how each ends; see README.md.

python benchmarks/loads.py [--scenes N] [--first I] [--seed S]
"""

from __future__ import annotations

import argparse
import dataclasses
import faulthandler
import math
import time
import warnings
from collections import Counter

import chebclear as cc
import numpy as np

LONGEST_SCENE = 60.0  # wall time after which a scene counts as hanging and the process is ended [s]
# Ends that need no look.
TYPED = ("held", "outside_table")
METHODS = ("auto", "dop853", "rodas5p")
# Largest error of the energy balance over the largest energy, at the tolerance of the runs.
IMBALANCE, RTOL = 1e-6, 1e-8
# Largest difference of two methods over the range of an output, over the first part of the run.
DISAGREEMENT = 1e-4

Table, Expression = cc.motions.Table, cc.motions.Expression


def quantities(scene: cc.Scene) -> dict[str, list[str]]:
    """Names of quantities by their kinds."""
    found: dict[str, list[str]] = {"x": [], "v": [], "angle": [], "omega": []}
    for body in scene.bodies:
        found["x"] += [f"{body.name}.x", f"{body.name}.y"]
        found["v"] += [f"{body.name}.vx", f"{body.name}.vy"]
        found["angle"].append(f"{body.name}.angle")
        found["omega"].append(f"{body.name}.angular_velocity")
    return found


def load(
    random: np.random.Generator, scene: cc.Scene, size: float, speed: float
) -> cc.motions.Expression | Table:
    """A random load of the motion, of about this size, in a mechanism of about this speed [m/s]."""
    names = quantities(scene)
    x, v, angle, omega = (str(random.choice(names[kind])) for kind in names)
    size, turn = float(size * random.uniform(-1.0, 1.0)), speed / 0.1
    forms = (
        ("-c*v", {"c": abs(size) / speed}),
        ("-c*v*abs(v)", {"c": abs(size) / speed**2}),
        ("F*tanh(v/s)", {"F": -abs(size), "s": 0.05 * speed}),
        ("F*sign(v)", {"F": -0.3 * abs(size)}),
        ("if(v < 0, F, 0)", {"F": size}),
        ("if(x < a, F, G)", {"F": size, "G": -0.5 * size, "a": float(random.uniform(-0.05, 0.1))}),
        ("F*min(1, max(-1, 20*x))", {"F": size}),
        ("F*cos(angle) + G*sin(3*angle)", {"F": size, "G": 0.3 * size}),
        ("F*(1 - omega/w)", {"F": abs(size) * 0.1, "w": 2.0 * turn}),
        ("F*sin(20*time) + if(time < b, F, 0)", {"F": size, "b": float(random.uniform(0.0, 0.3))}),
        ("F*exp(-(x/l)**2)", {"F": size, "l": 0.03}),
    )
    if random.random() < 0.3:
        over, reach = ((x, 0.3), (omega, 3.0 * turn), (angle, math.pi))[random.integers(3)]
        points = np.sort(random.uniform(-reach, reach, 5))
        values = size * random.uniform(-1.0, 1.0, 5)
        way = str(random.choice(("linear", "monotone", "cubic")))
        if over == angle:
            values[-1] = values[0]
            return Table(points, values, over=over, interpolation=way, periodic=True)
        return Table(
            points,
            values,
            over=over,
            interpolation=way,
            beyond=str(random.choice(("hold", "end"), p=(0.85, 0.15))),
        )
    text, constants = forms[random.integers(len(forms))]
    for plain, name in (("omega", omega), ("angle", angle)):
        text = text.replace(plain, name)
    for plain, name in (("x", x), ("v", v)):
        text = "".join(
            name if letter == plain and not _in_word(text, place) else letter
            for place, letter in enumerate(text)
        )
    return Expression(text, constants)


def _in_word(text: str, place: int) -> bool:
    """Whether a letter is part of a longer name."""
    beside = text[place - 1 : place] + text[place + 1 : place + 2]
    return any(letter.isalnum() or letter in "._" for letter in beside)


def contact(random: np.random.Generator) -> object:
    """A random law of contact."""
    stiffness = float(10.0 ** random.uniform(8.0, 10.5))
    restitution = float(random.uniform(0.05, 0.99))
    laws = cc.laws
    damping = float(10.0 ** random.uniform(0.0, 3.5))
    return (
        laws.Hertz(stiffness),
        laws.LankaraniNikravesh(stiffness, restitution),
        laws.Flores(stiffness, restitution),
        laws.ExactRestitution(stiffness, restitution),
        laws.HuntCrossley(stiffness, float(random.uniform(0.0, 1.0))),
        laws.KelvinVoigt(float(10.0 ** random.uniform(6.0, 8.0)), damping),
        laws.Impact(stiffness, damping, float(10.0 ** random.uniform(-6.0, -4.0))),
    )[random.integers(7)]


def guided(random: np.random.Generator, kind: str, speed: float) -> tuple[cc.Scene, float]:
    """A mechanism with faces: a slider or a block in a guide, a yoke, a bar between stops."""
    law, play = contact(random), float(10.0 ** random.uniform(-4.5, -3.0))
    velocity = 1e-2 * speed
    friction = cc.laws.SmoothedCoulomb(float(random.uniform(0.01, 0.4)), velocity)
    laws = {"contact": law, "friction": friction if random.random() < 0.6 else None}
    length, height = (float(size) for size in random.uniform((0.03, 0.01), (0.1, 0.04)))
    gravity = cc.Gravity((0.0, -9.81))
    turn = cc.motions.Speed("drive", "axle", speed / 0.05)
    if kind == "guide":
        plain = cc.mechanisms.slider_crank(crank_speed=speed / 0.05, clearance=1e-4, contact=law)
        joints = [
            cc.ClearancePrismatic("guide", joint.a, joint.b, joint.axis, length, height, play, **laws)
            if isinstance(joint, cc.Prismatic)
            else joint
            for joint in plain.joints
        ]
        return dataclasses.replace(plain, joints=joints, forces=[gravity]), 2.0 * plain.period
    if kind == "block":
        holder = cc.Body("holder", 2.0, 0.05, points={"O": (0.0, 0.2), "G": (0.03, 0.0)})
        block = cc.Body("block", 0.5, 5e-4, points={"P": (0.01, 0.005)})
        corners = str(random.choice(("a", "b")))
        guide = cc.ClearancePrismatic(
            "guide", "holder.G", "block", (1.0, 0.2), length, height, play, **laws, corners=corners
        )
        joints = [cc.Revolute("pivot", "ground", "holder.O"), guide]
        spring = cc.Spring("spring", "holder", "block.P", 200.0, 0.05, 0.2)
        start = [cc.JointStart("pivot", position=0.5, velocity=speed / 0.2)]
        return cc.Scene([holder, block], joints, [gravity, spring], start=start), 1.0
    if kind == "yoke":
        wheel = cc.Body("wheel", 1.0, 1e-3, points={"P": (0.05, 0.0)})
        yoke = cc.Body("yoke", 0.5, 1e-3, points={"S": (0.0, 0.0), "end": (0.15, 0.0)})
        slot = cc.PinInSlot("slot", "yoke.S", "wheel.P", (0.0, 1.0), 0.008, play, **laws)
        sleeve = cc.ClearancePrismatic(
            "sleeve", "ground.G", "yoke.end", (1.0, 0.0), length, height, play, **laws, corners="a"
        )
        joints = [cc.Revolute("axle", "ground", "wheel"), slot, sleeve]
        scene = cc.Scene([wheel, yoke], joints, [gravity], drives=[turn], ground={"G": (0.15, 0.0)})
        return scene, 2.0 * scene.period
    bar = cc.Body("bar", 1.0, 0.01, (0.1, 0.0), points={"A": (0.0, 0.0), "B": (0.2, 0.0)})
    ends = {"left": (-0.05, -0.15), "right": (0.1, -0.1)}
    stops = [
        cc.Stop("left", "ground.left", "bar.B", (1.0, 0.3), **laws, radius=float(random.choice((0.0, 0.01)))),
        cc.Stop("right", "ground.right", "bar.B", (-1.0, 0.2), **laws),
    ]
    start = [cc.JointStart("pivot", position=-1.5, velocity=speed / 0.2)]
    joints = [cc.Revolute("pivot", "ground", "bar.A"), *stops]
    return cc.Scene([bar], joints, [gravity], ground=ends, start=start), 1.0


GUIDED = ("guide", "block", "yoke", "stops")


def loose(random: np.random.Generator, kind: str, speed: float) -> tuple[cc.Scene, float]:
    """A slider-crank with play at the wrist, which may be oiled or stick."""
    rpm = 60.0 * speed / (2.0 * math.pi * 0.05)
    scene = cc.mechanisms.slider_crank(contact=contact(random), crank_speed=cc.rpm(rpm), clearance=1e-4)
    changes: dict[str, object] = {}
    if kind == "sticking":
        coefficient = float(random.uniform(0.05, 0.8))
        stribeck = float(random.choice((0.0, 1e-3, 1e-1)))
        changes["friction"] = cc.laws.StickSlip(coefficient, coefficient * random.uniform(0.5, 1.0), stribeck)
    elif kind == "oiled":
        kinds = (cc.laws.ShortBearing, cc.laws.FiniteBearing)
        viscosity, roughness = 10.0 ** random.uniform(-3.0, 0.0), 10.0 ** random.uniform(-7.0, -5.0)
        (wrist,) = (joint for joint in scene.joints if isinstance(joint, cc.ClearanceRevolute))
        length = 2.0 * wrist.journal_radius * random.uniform(0.25, 1.0)
        changes["film"] = kinds[random.integers(2)](viscosity, length, roughness)
    joints = [
        dataclasses.replace(joint, **changes) if isinstance(joint, cc.ClearanceRevolute) else joint
        for joint in scene.joints
    ]
    return dataclasses.replace(scene, joints=joints), 120.0 / rpm


LOOSE = ("loose", "sticking", "oiled")


def draw(index: int, seed: int) -> tuple[str, cc.Scene, float]:
    """Kind, scene and duration of an index: each has its own generator."""
    random = np.random.default_rng([seed, index])
    kind = str(random.choice(("ideal", "free", "chain", "coupled", *LOOSE, *GUIDED)))
    speed = float(10.0 ** random.uniform(-1.0, 1.0))
    if kind in GUIDED:
        scene, duration = guided(random, kind, speed)
    elif kind in LOOSE:
        scene, duration = loose(random, kind, speed)
    elif kind == "ideal":
        scene = cc.mechanisms.four_bar(clearance_at=())
        duration = 0.1
    else:
        bars = 1 if kind == "free" else 3
        bodies = [
            cc.Body(f"bar{k}", 1.0, 0.01, (0.1, 0.0), points={"A": (0.0, 0.0), "B": (0.2, 0.0)})
            for k in range(bars)
        ]
        joints = [
            cc.Revolute(f"pin{k}", f"bar{k - 1}.B" if k else "ground", f"bar{k}.A") for k in range(bars)
        ]
        start = [cc.JointStart("pin0", position=float(random.uniform(-3.0, 3.0)), velocity=speed / 0.2)]
        couplings = []
        if kind == "coupled":
            ratio = float(random.uniform(-2.0, 2.0))
            couplings = [cc.motions.Coupling("mesh", "bar2.angle", "bar0.angle", ratio)]
        scene = cc.Scene(bodies, joints, [cc.Gravity((0.0, -9.81))], start=start, couplings=couplings)
        duration = float(random.uniform(0.3, 2.0))
    size = 2.0 * max(speed, 1.0) ** 2
    forces = list(scene.forces)
    for number in range(int(random.integers(1, 4))):
        body = str(random.choice([body.name for body in scene.bodies]))
        part = random.integers(3)
        if part == 0:
            x, y = load(random, scene, size, speed), load(random, scene, size, speed)
            frame = str(random.choice(("ground", "body")))
            forces.append(cc.Force(f"force{number}", body, x, y, frame))
        elif part == 1:
            forces.append(cc.Torque(f"torque{number}", body, load(random, scene, 0.1 * size, speed)))
        else:
            tension = load(random, scene, size, speed)
            forces.append(cc.Spring(f"spring{number}", "ground.far", body, 20.0, 1.0, 0.5, tension))
    ground = dict(scene.ground) | {"far": (-1.0, 0.7)}
    return kind, dataclasses.replace(scene, forces=forces, ground=ground), duration


def judge(index: int, seed: int) -> tuple[str, str, str]:
    """Kind, end and details of a scene."""
    kind, scene, duration = draw(index, seed)
    outputs = ["energy.*", *(f"{body.name}.{name}" for body in scene.bodies for name in ("x", "y"))]
    runs: list[cc.Trajectory] = []
    ends = []
    for method in METHODS[: 1 + (index % 2) + 1]:
        try:
            run = cc.simulate(
                scene,
                duration=duration,
                samples=201,
                rtol=RTOL,
                method=method,
                outputs=outputs,
                max_steps=300_000,
            )
            ends.append("done")
        except cc.errors.SimulationError as error:
            run = error.trajectory
            ends.append(error.reason)
            if error.reason not in TYPED:
                return kind, error.reason, f"{method}: {error}"
        except cc.errors.SceneError as error:
            return kind, "refused", str(error)
        runs.append(run)
    if len(set(ends)) > 1:
        return kind, "ends differ", f"{ends}"
    if ends[0] == "done":
        energies = [
            runs[0][f"energy.{name}"] for name in ("kinetic", "potential", "contact", "input", "total")
        ]
        largest = max(float(np.max(np.abs(energy))) for energy in energies)
        error = float(np.max(np.abs(runs[0]["energy.balance"]))) / largest
        if not error <= IMBALANCE:
            return kind, "imbalance", f"{error:.1e}"
    # Contacts and chains amplify differences: the first tenth tells.
    part = 201 if kind in ("ideal", "free") else 21
    for name in outputs[1:]:
        first, *others = (run[name][:part] for run in runs)
        known = np.isfinite(first)
        for other in others:
            apart = np.max(np.abs(first - other)[known & np.isfinite(other)], initial=0.0)
            if apart > DISAGREEMENT * max(np.ptp(first[known]), 1e-3):
                return kind, "methods differ", f"{name}: {apart:.1e}"
    return kind, ends[0], ""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition(";")[0])
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seed", type=int, default=2026)
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    counts: Counter[tuple[str, str]] = Counter()
    start = time.perf_counter()
    for index in range(options.first, options.first + options.scenes):
        faulthandler.dump_traceback_later(LONGEST_SCENE, exit=True)
        kind, end, details = judge(index, options.seed)
        counts[kind, end] += 1
        if details:
            print(f"{index:5d} {kind:6s} {end}: {details[:150]}", flush=True)
    faulthandler.cancel_dump_traceback_later()
    for (kind, end), count in sorted(counts.items()):
        print(f"{kind:8s} {end:20s} {count:5d}")
    print(f"{options.scenes} scenes in {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
